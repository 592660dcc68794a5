// SPDX-License-Identifier: Apache-2.0
// JSON-RPC 2.0 over the command table: answers to single messages, and the loop over standard input
// and output (layer: application, remote).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/application.h"
#include "lua/lua_state.h"
#include "remote/json.h"
#include "remote/lua_child.h"

namespace robomosp::remote {

/// Longest line that is read [bytes].
inline constexpr std::size_t kLongestLine = std::size_t{8} << 20;

/// Most requests of a batch.
inline constexpr std::size_t kLongestBatch = 10'000;

/// Limit for the answers to a batch, after which its other requests are not run [bytes].
inline constexpr std::size_t kLongestAnswer = std::size_t{64} << 20;

/// Additions and limits of a connection.
struct RpcOptions {
  /// Result of lua.eval; empty = refused. [the session's thread]
  std::function<Result<Map>(const std::string& code)> evaluate{};
  /// Methods of the connection itself, with params as an object. [the session's thread]
  std::map<std::string, std::function<Result<Value>(const Map& params)>, std::less<>> methods{};
  /// An error refuses the request before it has any effect. [any thread]
  std::function<std::optional<Error>(std::string_view method)> admit{};
  /// Called after each request with its result. [any thread]
  std::function<void(std::string_view method, const Map* params, const Result<Value>&)> audit{};
  /// Called with the number of each job that is started. [the session's thread]
  std::function<void(std::uint64_t job)> job_started{};
  /// Converts an error to the form shown to the client. [any thread]
  std::function<Error(Error)> explain{};
  std::size_t longest_line = kLongestLine;
  std::size_t longest_batch = kLongestBatch;
  std::size_t longest_answer = 0;  ///< [bytes]; 0 = no limit
  std::size_t most_jobs = 0;       ///< concurrent jobs of the session; 0 = no limit
};

/// The result of lua.eval: {value or values, output}.
[[nodiscard]] Map script_answer(List values, std::string output);

/// Methods are the commands, plus "lua.eval" {code}, "ioci.classic" {line} and those of the
/// options. A request with "job": true returns the handle of a job at once. [the session's thread]
/// unless marked
class RpcServer {
 public:
  /// lua.eval runs in `lua`.
  RpcServer(ioci::Application& app, ioci::Session& session, lua::LuaState& lua);
  RpcServer(ioci::Application& app, ioci::Session& session, RpcOptions options)
      : app_(app), session_(session), options_(std::move(options)) {}

  /// The answer to one line without its newline; nullopt if nothing is to be sent (notifications,
  /// blank lines).
  [[nodiscard]] std::optional<std::string> answer(std::string_view line);
  /// Answer to a message or batch.
  [[nodiscard]] std::optional<std::string> answer(const Value& message);
  /// The answer to one message, on another session of the connection while this one is busy; not
  /// for lua.eval. [that session's thread]
  [[nodiscard]] std::optional<std::string> answer_beside(const Value& message,
                                                         ioci::Session& session) const;
  /// The same in two parts: the answer if the message is refused, and that of an admitted one.
  [[nodiscard]] std::optional<std::string> refuse_beside(const Value& message) const;
  [[nodiscard]] std::optional<std::string> answer_admitted(const Value& message,
                                                           ioci::Session& session) const;
  /// Text printed by scripts since the last lua.eval; set LuaOptions::print to append here.
  std::string printed;
  /// Runs lua.eval for a session that may not load code; null = refused. A session with loads_code
  /// runs its scripts in this process.
  LuaChild* untrusted = nullptr;
  /// Called with the number of each job that is started by a request with "progress": true.
  std::function<void(std::uint64_t)> watch;
  /// The answer to a line that exceeded the length limit. [any thread]
  [[nodiscard]] std::string too_long() const;
  [[nodiscard]] static std::string not_json(const Error& e);  ///< [any thread]
  [[nodiscard]] std::string success(const Value& id, const Value& result,
                                    Arrays arrays = Arrays::numbers) const;   ///< [any thread]
  [[nodiscard]] static std::string failure(const Value& id, const Error& e);  ///< [any thread]

 private:
  struct Request;
  [[nodiscard]] std::optional<std::string> answer_one(const Value& message);
  [[nodiscard]] Result<Value> run(const Request&);
  /// run() with the checks of the options.
  [[nodiscard]] Result<Value> run_admitted(const Request&);
  [[nodiscard]] Result<Value> run_classic(const Request&);
  [[nodiscard]] Result<Value> evaluate(const Request&);
  [[nodiscard]] Result<Value> start_job(const Request&);
  [[nodiscard]] Result<void> check_jobs();
  /// The request, or the answer that it is invalid (nullopt = none is to be sent).
  [[nodiscard]] Result<Request> read(const Value& message,
                                     std::optional<std::string>& refusal) const;
  [[nodiscard]] std::optional<std::string> told(const Request&, Result<Value>) const;
  [[nodiscard]] static std::string failure(const Value& id, int code, std::string_view message,
                                           const Error* data = nullptr);

  ioci::Application& app_;
  ioci::Session& session_;
  const RpcOptions options_;
  std::vector<std::uint64_t> jobs_;  ///< started by the session, if they are limited
};

/// Reads lines from descriptor `in`, writes answers to `out`, until the end of input, a `quit`
/// command or an interrupt. It continues to read while a request runs: requests about jobs
/// (job.list, job.progress, job.wait, job.cancel) and rpc.cancel are answered at once, all others
/// in order. Returns the program's exit code. [the session's thread]
int serve(ioci::Application& app, ioci::Session& session, RpcServer& server, int in, int out);

}  // namespace robomosp::remote
