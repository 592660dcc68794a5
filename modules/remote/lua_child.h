// SPDX-License-Identifier: Apache-2.0
// Untrusted scripts: a separate process that computes, and accesses the program only by the
// commands of its session (layer: application, remote).
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

/// Resource limits of a script.
struct LuaLimits {
  /// Address space of the process [bytes], at least 128 MiB; values of the script may use all but
  /// 96 MiB of it.
  std::uint64_t memory = std::uint64_t{256} << 20;
  double cpu_seconds = 10;  ///< processor time of one call, without that of its commands [s]
  /// Wall-clock time of one call [s]. A running command is not interrupted; the script ends after
  /// it.
  double wall_seconds = 60;
  std::size_t output = std::size_t{1} << 20;  ///< printed by one call [bytes]
};

/// "memory=512,cpu=30,wall=600,output=4": MiB, seconds, seconds, MiB; missing entries keep their
/// values from `otherwise`.
[[nodiscard]] Result<LuaLimits> lua_limits(std::string_view text, LuaLimits otherwise = {});

struct LuaChildOptions {
  LuaLimits limits{};
  /// Continues on systems without seccomp, with the other protections only; otherwise refuses to
  /// run.
  bool without_seccomp = false;
  /// Receives printed text immediately; empty = eval() returns it as `output`.
  std::function<void(std::string_view)> print{};
  std::string input_name = "rpc";   ///< name of eval()'s texts in errors
  std::filesystem::path program{};  ///< empty = robomosp-lua of this program
};

/// One process, started by the first call; it ends with this object, with its thread, or when it
/// ignores a limit. Variables of a script persist between calls as long as the process. [the
/// session's thread]
class LuaChild {
 public:
  /// `app` must outlive it.
  explicit LuaChild(ioci::Application& app, LuaChildOptions options = {});
  ~LuaChild();  ///< ends the process and waits for it
  LuaChild(const LuaChild&) = delete;
  LuaChild& operator=(const LuaChild&) = delete;

  /// Runs a text like a console: returns {value | values, output}, and a `note` if variables of
  /// earlier calls are lost. Its commands run in the session, with its permissions;
  /// session.interrupt() ends it. A process that ended is reported in one sentence, and the next
  /// call starts another.
  Result<Map> eval(std::string_view code, ioci::Session& session);
  /// Runs a file, which this program reads; returns the file's results.
  Result<List> run_file(const std::filesystem::path& file, std::span<const std::string> args,
                        ioci::Session& session);

  /// Call stack of the last failure; "" if none.
  [[nodiscard]] const std::string& traceback() const;
  /// Process id; nullopt if none is running.
  [[nodiscard]] std::optional<int> process() const;
  /// True if the running process has separate namespaces.
  [[nodiscard]] bool has_namespaces() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::remote
