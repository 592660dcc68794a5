// SPDX-License-Identifier: Apache-2.0
// CommandHost: everything a Lua state can access of the program, so that the same bindings serve a
// session in this process and a script in a separate process (layer: application, lua, internal).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "ioci/core/command.h"
#include "kernel/effects.h"
#include "kernel/value.h"

namespace robomosp::lua {

/// The commands and names of one session. [the state's thread]
class CommandHost {
 public:
  CommandHost() = default;
  virtual ~CommandHost() = default;
  CommandHost(const CommandHost&) = delete;
  CommandHost& operator=(const CommandHost&) = delete;

  // --- the command table; entries are never moved ---
  [[nodiscard]] virtual std::uint64_t revision() const = 0;  ///< counts up with every addition
  [[nodiscard]] virtual const ioci::CommandSpec* find(std::string_view name) const = 0;
  [[nodiscard]] virtual std::vector<const ioci::CommandSpec*> list() const = 0;  ///< incremented by
                                                                                 ///< every addition
  [[nodiscard]] virtual std::vector<const ioci::CommandSpec*> methods_of(
      std::string_view kind) const = 0;
  /// "there is no command ..." with near names.
  [[nodiscard]] virtual Error unknown(std::string_view name) const = 0;
  /// True if lines of the program of 2006 can begin with this word.
  [[nodiscard]] virtual bool is_classic_noun(std::string_view word) const = 0;

  // --- calls ---
  virtual Result<Value> dispatch(const ioci::CommandSpec&, const Map& args) = 0;
  virtual Result<Handle> dispatch_async(const ioci::CommandSpec&, Map args) = 0;
  virtual Result<Value> dispatch_classic(std::string_view line) = 0;
  virtual Result<void> transaction(const std::string& label,
                                   const std::function<Result<void>()>& body) = 0;

  // --- names ---
  [[nodiscard]] virtual std::optional<std::string> name_of(const Handle&) const = 0;
  [[nodiscard]] virtual std::string describe(const Handle&) const = 0;

  // --- the session ---
  [[nodiscard]] virtual bool interrupted() const = 0;
  virtual void clear_interrupt() = 0;
  /// An error for what the session may not do; `what` is the function that would do it.
  [[nodiscard]] virtual Result<void> may(Effect, std::string_view what) const = 0;
  virtual void warn(std::string_view code, const std::string& sentence) = 0;
  /// Posts a note to the user; a host for untrusted scripts does nothing.
  virtual void note(std::string_view /*code*/, const std::string& /*sentence*/) {}
  /// Rejects texts beyond a limit.
  [[nodiscard]] virtual Result<void> may_print(std::size_t) { return {}; }
};

/// First words of lines of the program of 2006, in lower case.
[[nodiscard]] std::set<std::string, std::less<>> classic_nouns(const ioci::CommandTable&);

}  // namespace robomosp::lua
