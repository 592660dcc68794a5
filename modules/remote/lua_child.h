// SPDX-License-Identifier: Apache-2.0
// Scripts of strangers: a process of its own that computes, and reaches the world by the commands
// of its session only (layer: application, remote).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"
#include "kernel/value.h"

namespace robomosp::remote {

/// What one script may use.
struct LuaLimits {
  /// Address space of the process [bytes], at least 128 MiB; values of the script get what is more
  /// than 96 MiB of it.
  std::uint64_t memory = std::uint64_t{256} << 20;
  double cpu_seconds = 10;  ///< processor time of one call, without that of commands [s]
  /// Wall clock of one call [s]. A command that runs then is not cut off; the script ends behind
  /// it.
  double wall_seconds = 60;
  std::size_t output = std::size_t{1} << 20;  ///< printed by one call [bytes]
};

/// "memory=512,cpu=30,wall=600,output=4": MiB, seconds, seconds, MiB; what is left out stays as it
/// is.
[[nodiscard]] Result<LuaLimits> lua_limits(std::string_view text, LuaLimits otherwise = {});

struct LuaChildOptions {
  LuaLimits limits{};
  /// Goes on where the system has no seccomp, with the other walls only; otherwise nothing runs.
  bool without_seccomp = false;
  /// Hears at once what is printed; empty = eval() hands it over as `output`.
  std::function<void(std::string_view)> print{};
  std::string input_name = "rpc";   ///< what errors call the texts of eval()
  std::filesystem::path program{};  ///< empty = robomosp-lua of this program
};

/// One process, started by the first call and ended with this object, with its thread, or when a
/// limit is hit that it does not heed. What a script keeps in variables lasts from call to call as
/// long as the process. [the session's thread]
class LuaChild {
 public:
  /// `app` outlives it.
  explicit LuaChild(ioci::Application& app, LuaChildOptions options = {});
  ~LuaChild();  ///< ends the process and waits for its end
  LuaChild(const LuaChild&) = delete;
  LuaChild& operator=(const LuaChild&) = delete;

  /// Runs a text as a console does: {value | values, output}, and a `note` when variables of
  /// earlier calls are gone. Its commands run as the session's, with its effects;
  /// session.interrupt() ends it. A process that ended is one sentence, and the next call starts
  /// another.
  Result<Map> eval(std::string_view code, ioci::Session& session);
  /// Runs a file, which this program reads; gives what it returned.
  Result<List> run_file(const std::filesystem::path& file, std::span<const std::string> args,
                        ioci::Session& session);

  /// Call stack of the last failure; "" when there is none.
  [[nodiscard]] const std::string& traceback() const;
  /// Of the process; nullopt when none runs.
  [[nodiscard]] std::optional<int> process() const;
  /// Whether the process that runs is in namespaces of its own.
  [[nodiscard]] bool has_namespaces() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::remote
