// SPDX-License-Identifier: Apache-2.0
#include "remote/rpc.h"

#include <utility>

#include "kernel/message_collector.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "remote/json.h"

namespace robomosp::remote {
namespace {

/// A line of the program of 2006.
constexpr std::string_view kClassic = "ioci.classic";

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

}  // namespace

Map script_answer(List values, std::string output) {
  Map out;
  if (values.size() == 1) out.set("value", std::move(values.front()));
  else if (!values.empty()) out.set("values", std::move(values));
  out.set("output", std::move(output));
  return out;
}

RpcServer::RpcServer(ioci::Application& app, ioci::Session& session, lua::LuaState& lua)
    : RpcServer(app, session,
                RpcOptions{.evaluate = [this, &lua](const std::string& code) -> Result<Map> {
                  if (!session_.may(Effect::loads_code)) {
                    if (!untrusted)
                      return not_permitted(session_.name(), "lua.eval", Effect::loads_code);
                    return untrusted->eval(code, session_);
                  }
                  printed.clear();
                  RMP_TRY_ASSIGN(List values, lua.eval_values(code));
                  return script_answer(std::move(values), std::exchange(printed, {}));
                }}) {}

std::string RpcServer::success(const Value& id, const Value& result, Arrays arrays) const {
  std::string out = R"({"jsonrpc":"2.0","id":)" + to_json(id) + R"(,"result":)";
  append_json(
      out, result, [this](const Handle& h) { return app_.name_of(h).value_or(""); }, arrays);
  out += '}';
  return out;
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

std::string RpcServer::too_long() const {
  const std::size_t most = options_.longest_line;
  return failure(
      {}, kInvalidRequest,
      "The line is longer than " + (most >> 20 << 20 == most ? std::to_string(most >> 20) + " MiB."
                                                             : std::to_string(most) + " bytes."));
}

std::string RpcServer::not_json(const Error& e) { return failure({}, kParseError, e.sentence()); }

std::string RpcServer::failure(const Value& id, const Error& e) {
  const Error said = text::shortened(e);
  return failure(id, code_of(e.code), said.sentence(), &said);
}

struct RpcServer::Request {
  Value id;
  bool wants_answer = false;
  bool as_job = false;
  bool wants_progress = false;
  bool wants_notes = false;
  Arrays arrays = Arrays::numbers;
  std::string method;
  const ioci::CommandSpec* spec = nullptr;  ///< null for lua.eval, ioci.classic and `own`
  const std::function<Result<Value>(const Map&)>* own = nullptr;  ///< of the connection
  const Map* named = nullptr;
  const List* positional = nullptr;
};

Result<RpcServer::Request> RpcServer::read(const Value& message,
                                           std::optional<std::string>& refusal) const {
  const Map* m = message.as_map();
  const auto field = [m](const char* name) { return m ? m->find(name) : nullptr; };
  const Value *version = field("jsonrpc"), *method = field("method"), *id = field("id"),
              *params = field("params"), *job = field("job"), *progress = field("progress"),
              *arrays = field("arrays"), *notes = field("notes");
  const Error none = error(ErrorCode::usage, "no request");
  Request r;
  r.id = id && is_id(*id) ? *id : Value();
  r.wants_answer = id != nullptr;
  const auto refuse = [&](std::string answer) {
    refusal = std::move(answer);
    return none;
  };
  if (!m || !version || !version->as_string() || *version->as_string() != "2.0" || !method ||
      !method->as_string() || (id && !is_id(*id)))
    return refuse(
        failure(r.id, kInvalidRequest,
                R"(A request is {"jsonrpc": "2.0", "id": 1, "method": "...", "params": {...}}.)"));
  for (const Value* flag : {job, progress, notes})
    if (flag && !flag->as_bool())
      return refuse(
          failure(r.id, kInvalidRequest, "job, progress and notes must be true or false."));
  if (arrays) {
    const std::string word = arrays->as_string() ? *arrays->as_string() : std::string();
    if (word != "numbers" && word != "base64")
      return refuse(failure(r.id, kInvalidRequest, R"(arrays is "numbers" or "base64".)"));
    if (word == "base64") r.arrays = Arrays::base64;
  }
  r.as_job = job && *job->as_bool();
  r.wants_progress = progress && *progress->as_bool();
  r.wants_notes = notes && *notes->as_bool();
  r.method = *method->as_string();
  r.spec = app_.commands.find(r.method);
  if (params && !params->as_map() && !params->as_list()) {
    if (!r.wants_answer) return none;
    return refuse(failure(r.id, kInvalidParams, "params must be an object or an array."));
  }
  if (const auto own = options_.methods.find(r.method); own != options_.methods.end())
    r.own = &own->second;
  if (!r.spec && !r.own && r.method != "lua.eval" && r.method != kClassic) {
    if (!r.wants_answer) return none;
    const Error e = text::shortened(app_.commands.unknown(r.method));
    return refuse(failure(r.id, kMethodNotFound, e.sentence(), &e));
  }
  if (auto fault = params ? array_fault(*params) : std::nullopt) {
    if (!r.wants_answer) return none;
    return refuse(failure(r.id, std::move(*fault).in(r.method)));
  }
  r.named = params ? params->as_map() : nullptr;
  r.positional = params ? params->as_list() : nullptr;
  return r;
}

std::optional<std::string> RpcServer::told(const Request& r, Result<Value> result) const {
  if (options_.audit) options_.audit(r.method, r.named, result);
  if (!r.wants_answer) return std::nullopt;
  if (!result.ok())
    return failure(r.id, options_.explain ? options_.explain(std::move(result).error())
                                          : std::move(result).error());
  std::string text = success(r.id, *result, r.arrays);
  if (options_.longest_answer == 0 || text.size() <= options_.longest_answer) return text;
  return failure(r.id, error(ErrorCode::unsupported,
                             "the reply takes " + std::to_string(text.size()) + " bytes; at most " +
                                 std::to_string(options_.longest_answer) + " are sent",
                             "Request less at a time, with \"arrays\": \"base64\", or write it "
                             "to a file and fetch that in parts.",
                             r.method));
}

Result<Value> RpcServer::evaluate(const Request& r) {
  const Value* code = r.named                                     ? r.named->find("code")
                      : r.positional && r.positional->size() == 1 ? &r.positional->front()
                                                                  : nullptr;
  if (!code || !code->as_string())
    return error(ErrorCode::invalid_argument, "lua.eval needs the text code",
                 "Send {\"code\": \"1 + 1\"}.");
  if (r.as_job)
    return error(ErrorCode::usage, "a script runs on the thread of its session and cannot be a job",
                 "Make it start jobs: start(\"world.plan_path\", {...}).", "lua.eval");
  if (!options_.evaluate)
    return error(ErrorCode::unsupported, "this connection does not run scripts", "", "lua.eval");
  RMP_TRY_ASSIGN(Map out, options_.evaluate(*code->as_string()));
  return Value(std::move(out));
}

Result<Value> RpcServer::run_classic(const Request& r) {
  const Value* line = r.named                                     ? r.named->find("line")
                      : r.positional && r.positional->size() == 1 ? &r.positional->front()
                                                                  : nullptr;
  const std::size_t given = r.named ? r.named->size() : r.positional ? r.positional->size() : 0;
  if (!line || !line->as_string() || given != 1)
    return error(ErrorCode::invalid_argument, "ioci.classic needs the text line, and nothing else",
                 "Send {\"line\": \"PRobot puma560 GetDOF\"}.");
  if (r.as_job)
    return error(ErrorCode::usage, "a classic line cannot be a job",
                 "Start the corresponding command: help of the line names it.",
                 std::string(kClassic));
  session_.clear_interrupt();
  return app_.dispatch_classic(session_, *line->as_string());
}

Result<void> RpcServer::check_jobs() {
  if (options_.most_jobs == 0) return {};
  std::erase_if(jobs_, [this](std::uint64_t number) {
    const auto s = app_.jobs.status(number);
    return !s.ok() || (s->state != JobState::waiting && s->state != JobState::running);
  });
  if (jobs_.size() < options_.most_jobs) return {};
  return error(
      ErrorCode::conflict,
      std::to_string(jobs_.size()) + " jobs of this connection are already running or waiting",
      "Wait for the end of one, or cancel it.");
}

Result<Value> RpcServer::start_job(const Request& r) {
  if (auto room = check_jobs(); !room.ok()) return std::move(room).error().in(r.method);
  RMP_TRY_ASSIGN(Handle job,
                 r.positional
                     ? app_.dispatch_async_positional(session_, r.method, *r.positional)
                     : app_.dispatch_async(session_, r.method, r.named ? *r.named : Map{}));
  if (options_.most_jobs != 0) jobs_.push_back(job.number);
  if (options_.job_started) options_.job_started(job.number);
  if (r.wants_progress && watch) watch(job.number);
  return Value(std::move(job));
}

Result<Value> RpcServer::run_admitted(const Request& r) {
  if (options_.admit)
    if (auto refusal = options_.admit(r.method)) return std::move(*refusal);
  return run(r);
}

Result<Value> RpcServer::run(const Request& r) {
  if (r.own) {
    static const Map kNone;
    if (r.positional && !r.positional->empty())
      return error(ErrorCode::invalid_argument, "its params must be an object", "", r.method);
    if (r.as_job) return error(ErrorCode::usage, "it is not a job", "", r.method);
    auto result = (*r.own)(r.named ? *r.named : kNone);
    if (!result.ok()) return std::move(result).error().in(r.method);
    return result;
  }
  if (!r.spec) return r.method == kClassic ? run_classic(r) : evaluate(r);
  if (r.as_job) return start_job(r);
  session_.clear_interrupt();
  if (r.positional) return app_.dispatch_positional(session_, r.method, *r.positional);
  static const Map kNothing;
  return app_.dispatch(session_, *r.spec, r.named ? *r.named : kNothing);
}

namespace {

/// An answer with the notes that its command posted.
std::string with_notes(std::string answer, const std::vector<Message>& messages) {
  List notes;
  for (const Message& m : messages)
    if (m.severity == Severity::info) notes.emplace_back(Map{{"code", m.code}, {"text", m.text}});
  if (notes.empty() || !answer.ends_with('}')) return answer;
  answer.pop_back();
  answer += R"(,"notes":)" + to_json(std::move(notes)) + '}';
  return answer;
}
/// What `answer` returns, with the notes that it posts on this thread where they are wanted.
template <class Answer>
std::optional<std::string> answer_with_notes(bool wants_notes, const Answer& answer) {
  if (!wants_notes) return answer();
  const MessageCollector collector;
  std::optional<std::string> text = answer();
  if (text) text = with_notes(std::move(*text), collector.messages());
  return text;
}

}  // namespace

std::optional<std::string> RpcServer::answer_one(const Value& message) {
  std::optional<std::string> refusal;
  const auto request = read(message, refusal);
  if (!request.ok()) return refusal;
  return answer_with_notes(request->wants_notes,
                           [&] { return told(*request, run_admitted(*request)); });
}

std::optional<std::string> RpcServer::answer_beside(const Value& message,
                                                    ioci::Session& session) const {
  if (options_.admit)
    if (auto refusal = refuse_beside(message)) return refusal;
  return answer_admitted(message, session);
}

std::optional<std::string> RpcServer::refuse_beside(const Value& message) const {
  std::optional<std::string> refusal;
  const auto request = read(message, refusal);
  if (!request.ok()) return refusal;
  if (options_.admit)
    if (auto no = options_.admit(request->method)) return told(*request, std::move(*no));
  return std::nullopt;
}

std::optional<std::string> RpcServer::answer_admitted(const Value& message,
                                                      ioci::Session& session) const {
  std::optional<std::string> refusal;
  const auto request = read(message, refusal);
  if (!request.ok()) return refusal;
  return answer_with_notes(request->wants_notes, [&] {
    return told(
        *request,
        request->positional
            ? app_.dispatch_positional(session, request->method, *request->positional)
            : app_.dispatch(session, request->method, request->named ? *request->named : Map{}));
  });
}

std::optional<std::string> RpcServer::answer(const Value& message) {
  const List* batch = message.as_list();
  if (!batch) return answer_one(message);
  if (batch->empty()) return failure({}, kInvalidRequest, "The batch is empty.");
  if (batch->size() > options_.longest_batch)
    return failure({}, kInvalidRequest,
                   "The batch holds " + std::to_string(batch->size()) + " requests; at most " +
                       std::to_string(options_.longest_batch) + " are processed together.");
  const std::size_t longest = options_.longest_answer ? options_.longest_answer : kLongestAnswer;
  std::string out;
  for (const Value& one : *batch) {
    std::optional<std::string> text;
    if (out.size() < longest) {
      text = answer_one(one);
    } else {
      std::optional<std::string> refusal;
      const auto request = read(one, refusal);
      text = request.ok() ? told(*request, error(ErrorCode::conflict,
                                                 "the request was not run, since the previous "
                                                 "replies of the batch are too long",
                                                 "Send it separately."))
                          : refusal;
    }
    if (text) out += (out.empty() ? "[" : ",") + *text;
  }
  if (out.empty()) return std::nullopt;
  return out + "]";
}

std::optional<std::string> RpcServer::answer(std::string_view line) {
  line = text::trim(line);
  if (line.empty()) return std::nullopt;
  const auto message = from_json(line);
  return message.ok() ? answer(*message) : not_json(message.error());
}

}  // namespace robomosp::remote
