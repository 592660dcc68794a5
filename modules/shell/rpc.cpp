// SPDX-License-Identifier: Apache-2.0
#include "shell/rpc.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "kernel/text.h"
#include "shell/json.h"

namespace robomosp::shell {
namespace {

// JSON-RPC 2.0, section 5.1.
constexpr int kParseError = -32700;
constexpr int kInvalidRequest = -32600;
constexpr int kMethodNotFound = -32601;
constexpr int kInvalidParams = -32602;
constexpr int kCommandFailed = -32000;

int code_of(ErrorCode c) {
  return c == ErrorCode::invalid_argument || c == ErrorCode::usage ? kInvalidParams
                                                                   : kCommandFailed;
}

bool is_id(const Value& v) { return v.is_nil() || v.is_number() || v.as_string(); }

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace

std::string RpcServer::success(const Value& id, const Value& result) const {
  return R"({"jsonrpc":"2.0","id":)" + to_json(id) + R"(,"result":)" +
         to_json(result, [this](const Handle& h) { return app_.name_of(h).value_or(""); }) + "}";
}

std::string RpcServer::failure(const Value& id, int code, std::string_view message,
                               const Error* data) {
  Map fault{{"code", code}, {"message", message}};
  if (data) {
    Map details = error_map(*data);
    details.erase("message");
    fault.set("data", std::move(details));
  }
  return R"({"jsonrpc":"2.0","id":)" + to_json(id) + R"(,"error":)" + to_json(std::move(fault)) +
         "}";
}

std::string RpcServer::too_long() {
  return failure({}, kInvalidRequest,
                 "The line is longer than " + std::to_string(kLongestLine >> 20) + " MiB.");
}

Result<Value> RpcServer::run(const std::string& method, const Value* params) {
  const Map* named = params ? params->as_map() : nullptr;
  const List* positional = params ? params->as_list() : nullptr;
  if (method == "lua.eval") {
    const Value* code = named                                   ? named->find("code")
                        : positional && positional->size() == 1 ? &positional->front()
                                                                : nullptr;
    if (!code || !code->as_string())
      return error(ErrorCode::invalid_argument, "lua.eval needs the text code",
                   "Send {\"code\": \"1 + 1\"}.");
    printed.clear();
    RMP_TRY_ASSIGN(List values, lua_.eval_values(*code->as_string()));
    Map out;
    if (values.size() == 1) out.set("value", std::move(values.front()));
    else if (!values.empty()) out.set("values", std::move(values));
    out.set("output", std::move(printed));
    printed.clear();
    return Value(std::move(out));
  }
  session_.clear_interrupt();
  if (positional) return app_.dispatch_positional(session_, method, *positional);
  return app_.dispatch(session_, method, named ? *named : Map{});
}

std::optional<std::string> RpcServer::answer_one(const Value& message) {
  const Map* m = message.as_map();
  const Value* version = m ? m->find("jsonrpc") : nullptr;
  const Value* method = m ? m->find("method") : nullptr;
  const Value* id = m ? m->find("id") : nullptr;
  const Value* params = m ? m->find("params") : nullptr;
  const Value told = id && is_id(*id) ? *id : Value();
  if (!m || !version || !version->as_string() || *version->as_string() != "2.0" || !method ||
      !method->as_string() || (id && !is_id(*id)))
    return failure(
        told, kInvalidRequest,
        R"(A request is {"jsonrpc": "2.0", "id": 1, "method": "...", "params": {...}}.)");
  const bool wants_answer = id != nullptr;
  if (params && !params->as_map() && !params->as_list()) {
    if (!wants_answer) return std::nullopt;
    return failure(told, kInvalidParams, "params must be an object or an array.");
  }
  const std::string& name = *method->as_string();
  if (name != "lua.eval" && !app_.commands.find(name)) {
    if (!wants_answer) return std::nullopt;
    const Error e = app_.commands.unknown(name);
    return failure(told, kMethodNotFound, e.sentence(), &e);
  }
  const auto result = run(name, params);
  if (!wants_answer) return std::nullopt;
  if (result.ok()) return success(told, *result);
  return failure(told, code_of(result.error().code), result.error().sentence(), &result.error());
}

std::optional<std::string> RpcServer::answer(std::string_view line) {
  line = text::trim(line);
  if (line.empty()) return std::nullopt;
  const auto message = from_json(line);
  if (!message.ok()) return failure({}, kParseError, message.error().sentence());
  const List* batch = message->as_list();
  if (!batch) return answer_one(*message);
  if (batch->empty()) return failure({}, kInvalidRequest, "The batch is empty.");
  std::string out;
  for (const Value& one : *batch)
    if (auto text = answer_one(one)) out += (out.empty() ? "[" : ",") + *text;
  if (out.empty()) return std::nullopt;
  return out + "]";
}

int serve(ioci::Application& app, ioci::Session& session, RpcServer& server, int in, int out) {
  constexpr int kPumpEvery = 20;  // ms
  std::string buffer;
  bool skipping = false;  // within a line that was too long
  const auto say = [&](const std::string& text) { return write_all(out, text + "\n"); };
  const auto take_line = [&](std::string_view line) -> bool {
    const auto text = server.answer(line);
    return !text || say(*text);
  };
  char chunk[1 << 16];
  for (;;) {
    app.thread.pump();
    app.jobs.pump();
    if (app.quit_requested) return 0;
    if (session.interrupted()) return 130;
    pollfd ready{in, POLLIN, 0};
    const int n = ::poll(&ready, 1, kPumpEvery);
    if (n == 0 || (n < 0 && errno == EINTR)) continue;
    if (n < 0) return 1;
    const ssize_t got = ::read(in, chunk, sizeof chunk);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    std::string_view fresh(chunk, static_cast<std::size_t>(got));
    while (!fresh.empty()) {
      const auto newline = fresh.find('\n');
      const std::string_view piece = fresh.substr(0, newline);
      if (!skipping) {
        if (buffer.size() + piece.size() > kLongestLine) {
          skipping = true;
          buffer.clear();
          if (!say(RpcServer::too_long())) return 1;
        } else {
          buffer.append(piece);
        }
      }
      if (newline == std::string_view::npos) break;
      fresh.remove_prefix(newline + 1);
      if (!std::exchange(skipping, false) && !take_line(buffer)) return 1;
      buffer.clear();
      if (app.quit_requested) return 0;
    }
  }
  if (!skipping && !take_line(buffer)) return 1;  // a last line without newline
  return 0;
}

}  // namespace robomosp::shell
