// SPDX-License-Identifier: Apache-2.0
// The commands of a session as a script in the sandbox reaches them: each call is a request to the
// program that started this one (layer: application, lua, internal).
#pragma once

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "lua/listed_commands.h"
#include "lua/sandbox/wire.h"

namespace robomosp::lua {

/// The one descriptor of the process. When the program at the other end is gone, it ends the
/// process.
class Link {
 public:
  /// False when the value is too long or too deep for a frame; then nothing is sent.
  [[nodiscard]] bool send(wire::Kind kind, const Value& value);
  /// The next frame. \throws std::bad_alloc when there is no memory for it; it is taken off then.
  [[nodiscard]] wire::Frame receive();
};

/// [the only thread]
class ChildHost final : public ListedCommands {
 public:
  /// `setup` is the value of the frame of that kind.
  ChildHost(Link& link, const Map& setup);

  [[nodiscard]] Error unknown(std::string_view name) const override;
  Result<Value> dispatch(const ioci::CommandSpec&, const Map& args) override;
  Result<Handle> dispatch_async(const ioci::CommandSpec&, Map args) override;
  Result<Value> dispatch_classic(std::string_view line) override;
  Result<void> transaction(const std::string& label,
                           const std::function<Result<void>()>& body) override;
  [[nodiscard]] std::optional<std::string> name_of(const Handle&) const override;
  [[nodiscard]] std::string describe(const Handle&) const override;
  [[nodiscard]] bool interrupted() const override;
  void clear_interrupt() override;
  [[nodiscard]] Result<void> may(Effect, std::string_view what) const override;
  void warn(std::string_view code, const std::string& sentence) override;

  [[nodiscard]] Result<void> may_print(std::size_t bytes) override;

  /// Takes what a script printed.
  void print(std::string_view text);
  /// Sends what waits to be shown.
  void flush() const;
  /// A new call begins.
  void begin();

 private:
  /// Sends a request and waits for its answer.
  Result<Value> ask(wire::Ask what, std::string_view name, Value args) const;
  void add_commands(const Value& list) const;

  Link& link_;
  std::size_t most_output_ = 0;  ///< [bytes]
  std::size_t printed_ = 0;      ///< in this call [bytes]
  // What any answer may change:
  mutable std::string waiting_;  ///< printed and not sent yet
  mutable bool was_told_to_stop_ = false;
};

/// Makes SIGINT stop the script that runs.
void catch_stop();

}  // namespace robomosp::lua
