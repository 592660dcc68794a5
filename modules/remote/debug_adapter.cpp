// SPDX-License-Identifier: Apache-2.0
// The session's thread answers requests in order, and looks where the programs are while they run;
// one thread reads, so that cancel, disconnect and terminate end what takes long.
#include "remote/debug_adapter.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/native.h"
#include "ioci/program/program_files.h"
#include "kernel/call_queue.h"
#include "kernel/file_root.h"
#include "kernel/text.h"
#include "remote/debuggee.h"
#include "remote/framed_messages.h"

namespace robomosp::remote {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostWaitingRequests = std::size_t{64}
                                             << 20;  ///< bytes that wait to be answered
constexpr std::size_t kMostBreakpoints = 100'000;    ///< of all sources; of all routines
constexpr std::size_t kMostSources = 10'000;         ///< that have breakpoints, or had
constexpr std::size_t kMostReferences = 200'000;     ///< of one stop
constexpr std::size_t kMostParts = 10'000;           ///< of one answer
constexpr std::size_t kMostNotes = 1000;             ///< told at once
constexpr std::size_t kMostTargets = 50;             ///< of one gotoTargets
constexpr std::size_t kMostCompletions = 500;
constexpr const char* kAsks =
    "The program waits for a line: type it in the debug console, and continue.";
constexpr std::uint64_t kMostSource = std::uint64_t{16} << 20;  ///< of a file that is compared
constexpr auto kFirstNap = 1ms, kMostNap = 20ms;  ///< between looks at programs that run
constexpr auto kFarNap = 50ms;                    ///< the same in another program
constexpr auto kIdle = 100ms;
/// How long what runs may take when the input has ended.
constexpr auto kLastWork = 5s;
constexpr int kAdapterAgain = 20;  ///< how often it is told to end [ms]

constexpr int kEndedByUser = 130;

struct AdapterFailure {
  std::string sentence;
  std::string word = {};  ///< "cancelled" or "notStopped", as the protocol has them
};
using Answer = std::variant<Json, AdapterFailure>;

// ---- values of commands ----

const Value* at(const Value& v, std::string_view name) {
  const Map* m = v.as_map();
  return m ? m->find(name) : nullptr;
}
std::string text_at(const Value& v, std::string_view name) {
  const Value* found = at(v, name);
  return found && found->as_string() ? *found->as_string() : std::string();
}
std::int64_t number_at(const Value& v, std::string_view name, std::int64_t otherwise = 0) {
  const Value* found = at(v, name);
  return found && found->as_int() ? *found->as_int() : otherwise;
}
double real_at(const Value& v, std::string_view name) {
  const Value* found = at(v, name);
  return found ? found->number() : 0;
}
bool flag_at(const Value& v, std::string_view name) {
  const Value* found = at(v, name);
  return found && found->as_bool() && *found->as_bool();
}
const List& list_of(const Value& v) {
  static const List none;
  return v.as_list() ? *v.as_list() : none;
}
const List& list_at(const Value& v, std::string_view name) {
  static const List none;
  const Value* found = at(v, name);
  return found && found->as_list() ? *found->as_list() : none;
}

bool same(std::string_view a, std::string_view b) {
  const auto lower = [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  };
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                            [&](char x, char y) { return lower(x) == lower(y); });
}

std::string_view line_of(std::string_view text, std::size_t line) {
  for (; line > 1; --line) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end + 1);
  }
  return text.substr(0, text.find('\n'));
}
/// Bytes before a column as units of UTF-16, both from 1.
std::int64_t units(std::string_view line, std::int64_t column) {
  std::int64_t n = 1;
  for (std::size_t i = 0; i < line.size() && static_cast<std::int64_t>(i) + 1 < column; ++i) {
    const auto c = static_cast<unsigned char>(line[i]);
    if ((c & 0xC0U) != 0x80) n += c >= 0xF0 ? 2 : 1;
  }
  return n;
}
/// The byte behind so many units of UTF-16.
std::size_t byte_behind(std::string_view text, std::size_t count) {
  std::size_t i = 0;
  for (std::size_t n = 0; i < text.size() && n < count;) {
    n += static_cast<unsigned char>(text[i]) >= 0xF0 ? 2 : 1;
    for (++i; i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0U) == 0x80;) ++i;
  }
  return i;
}

std::string seconds(double t) { return "t = " + text::print_rounded(t) + " s"; }

/// Requests of the protocol that are not served, and why.
const char* why_not(std::string_view command) {
  static const std::map<std::string_view, const char*> all = {
      {"attachForSuspendedLaunch", "a launched program waits for configurationDone by itself"},
      {"dataBreakpointInfo",
       "data breakpoints are not supported; use a breakpoint with a condition"},
      {"setDataBreakpoints",
       "data breakpoints are not supported; use a breakpoint with a condition"},
      {"setInstructionBreakpoints", "breakpoints are supported at lines and routines"},
      {"disassemble", "program.code shows a program as three-address code"},
      {"readMemory", "programs of robots have no addresses"},
      {"writeMemory", "programs of robots have no addresses"},
      {"modules", "loadedSources lists the files of the programs"},
      {"restartFrame", "restart starts again, stepBack steps back through the recording"},
      {"stepInTargets", "a step enters the first call of its line"},
      {"terminateThreads", "all programs run on one clock; terminate ends them"},
      {"locations", "values have no memory locations"},
      {"runInTerminal", "this request is sent by adapters only"},
      {"startDebugging", "this request is sent by adapters only"}};
  const auto it = all.find(command);
  return it == all.end() ? nullptr : it->second;
}

class Adapter {
 public:
  Adapter(ioci::Application& app, ioci::Session& session, lua::LuaState& lua, int in, int out)
      : app_(app), session_(session), lua_(lua), in_(in), out_(out) {
    messages_ = app_.messages.subscribe([this](const Message& m) {
      if (m.severity >= Severity::warning) say(m.text + "\n", "console");
    });
  }
  ~Adapter() {
    app_.messages.unsubscribe(messages_);
    ::close(wake_);
  }
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;

  void print(std::string_view text) { say(std::string(text), "stdout"); }

  int run() {
    std::thread reader([this] { read_all(); });
    const int code = work();
    {
      const std::lock_guard lock(mutex_);
      is_done_ = true;
    }
    changed_.notify_all();
    const std::uint64_t one = 1;
    (void)!::write(wake_, &one, sizeof one);
    reader.join();
    if (debuggee_) debuggee_->leave(true);
    return code;
  }

 private:
  struct Waiting {
    Json message;
    std::size_t bytes = 0;
    bool is_cancelled = false;
  };

  // ---- output [any thread] ----

  void write(Json message) {
    const std::lock_guard lock(write_mutex_);
    if (is_broken_) return;
    message["seq"] = ++said_;
    if (!write_all(out_, framed(message))) is_broken_ = true;
  }
  void event(const char* name, Json body) {
    write({{"type", "event"}, {"event", name}, {"body", std::move(body)}});
  }
  void say(const std::string& text, const char* category) {
    event("output", {{"category", category}, {"output", text}});
  }
  /// Something is wrong that no request is answered with.
  void complain(const std::string& sentence) { say(sentence + "\n", "important"); }
  /// Behind the answer to the request that is handled.
  void later(const char* name, Json body) { events_.emplace_back(name, std::move(body)); }
  void tell_events() {
    for (auto& [name, body] : std::exchange(events_, {})) event(name, std::move(body));
  }

  void answer(const Json& request, Answer made) {
    Json out{{"type", "response"},
             {"request_seq", member(request, "seq")},
             {"command", string_member(request, "command")},
             {"success", made.index() == 0}};
    if (made.index() == 0) {
      if (Json& body = std::get<0>(made); !body.is_null()) out["body"] = std::move(body);
    } else {
      AdapterFailure& f = std::get<1>(made);
      const bool shows = f.word.empty();
      out["message"] = shows ? f.sentence : f.word;
      // Braces would be variables of the format.
      out["body"] = {{"error",
                      {{"id", 1},
                       {"format", "{sentence}"},
                       {"variables", {{"sentence", f.sentence}}},
                       {"showUser", shows}}}};
    }
    write(std::move(out));
  }

  // ---- the reader's thread ----

  void read_all() {
    std::vector<char> chunk(1 << 16);
    Frames frames;
    bool is_open = true;
    while (is_open) {
      pollfd ready[2]{{in_, POLLIN, 0}, {wake_, POLLIN, 0}};
      const int n = ::poll(ready, 2, interrupts_again() ? kAdapterAgain : -1);
      if (n == 0 || (n < 0 && errno == EINTR)) continue;
      if (n < 0 || ready[1].revents != 0) break;
      const ssize_t got = ::read(in_, chunk.data(), chunk.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      std::string fault;
      if (!frames.feed(
              {chunk.data(), static_cast<std::size_t>(got)},
              [this](std::string body) { take(std::move(body)); }, fault)) {
        // Where messages begin is not known any more.
        complain("The debugger ends: " + fault + ".");
        is_open = false;
      }
    }
    std::unique_lock lock(mutex_);
    is_input_over_ = true;
    changed_.notify_all();
    // What still runs gets some time, as nobody is there for its answer.
    if (changed_.wait_for(lock, kLastWork, [this] { return is_done_; })) return;
    while (!is_done_) {
      interrupt_current();
      changed_.wait_for(lock, std::chrono::milliseconds(kAdapterAgain));
    }
  }

  void take(std::string body) {
    const auto bytes = bytes_of_json(body);
    if (!bytes)
      return complain("A message is nested too deeply or has too many values and is ignored.");
    Waiting w;
    w.bytes = *bytes;
    w.message = Json::parse(body, nullptr, false);
    if (w.message.is_discarded()) return complain("A message is not JSON in UTF-8 and is ignored.");
    if (string_member(w.message, "type") != "request")
      return complain("A message is not a request and is ignored.");
    const Json& seq = member(w.message, "seq");
    if (!seq.is_number_integer())
      return complain("A request has no whole number as its seq and is ignored.");
    const std::string command = string_member(w.message, "command");
    if (command == "cancel") return cancel(w.message);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_bytes_ < kMostWaitingRequests || is_done_; });
    if (command == "disconnect" || command == "terminate") {
      wants_interrupt_ = !current_.is_null();
      interrupt_current();
    }
    waiting_bytes_ += w.bytes;
    waiting_.push_back(std::move(w));
    changed_.notify_all();
  }
  void cancel(const Json& request) {
    const Json& id = member(member(request, "arguments"), "requestId");
    {
      const std::lock_guard lock(mutex_);
      for (Waiting& w : waiting_)
        if (!id.is_null() && member(w.message, "seq") == id) w.is_cancelled = true;
      if (!id.is_null() && current_ == id) {
        wants_interrupt_ = true;
        interrupt_current();
      }
    }
    answer(request, Json());
  }
  /// With mutex_ held.
  void interrupt_current() {
    if (current_.is_null()) return;
    was_interrupted_ = true;
    cancel_ = true;
    session_.interrupt();
  }
  bool interrupts_again() {
    const std::lock_guard lock(mutex_);
    if (wants_interrupt_) interrupt_current();
    return wants_interrupt_;
  }

  // ---- the session's thread ----

  int work() {
    for (;;) {
      std::optional<Waiting> next;
      {
        std::unique_lock lock(mutex_);
        const auto nap =
            is_running_ ? std::chrono::milliseconds(nap_) : std::chrono::milliseconds(kIdle);
        (void)wait_serving(lock, changed_, nap,
                           [this] { return !waiting_.empty() || is_input_over_; });
        if (is_broken_) return 1;
        if (session_.interrupted() && !was_interrupted_) return kEndedByUser;
        if (!waiting_.empty()) {
          next = std::move(waiting_.front());
          waiting_.pop_front();
          waiting_bytes_ -= std::min(waiting_bytes_, next->bytes);
          current_ = member(next->message, "seq");
          was_interrupted_ = wants_interrupt_ = cancel_ = false;
          session_.clear_interrupt();
          changed_.notify_all();
        } else if (is_input_over_) {
          return 1;
        }
      }
      if (next) handle(*next);
      {
        const std::lock_guard lock(mutex_);
        current_ = nullptr;
        wants_interrupt_ = false;
      }
      tell_events();
      if (is_over_) return 0;
      if (app_.quit_requested) return 1;
      look();
    }
  }

  using Method = Answer (Adapter::*)(const Json&);
  enum class Needs : std::uint8_t { nothing, initialized, loaded, stopped };
  struct Request {
    Method method;
    Needs needs;
  };
  static const std::map<std::string, Request, std::less<>>& requests() {
    static const std::map<std::string, Request, std::less<>> all = {
        {"initialize", {&Adapter::initialize, Needs::nothing}},
        {"launch", {&Adapter::launch, Needs::initialized}},
        {"attach", {&Adapter::attach, Needs::initialized}},
        {"configurationDone", {&Adapter::configuration_done, Needs::loaded}},
        {"disconnect", {&Adapter::disconnect, Needs::nothing}},
        {"terminate", {&Adapter::terminate, Needs::loaded}},
        {"restart", {&Adapter::restart, Needs::loaded}},
        {"setBreakpoints", {&Adapter::set_breakpoints, Needs::initialized}},
        {"setFunctionBreakpoints", {&Adapter::set_function_breakpoints, Needs::initialized}},
        {"setExceptionBreakpoints", {&Adapter::set_exception_breakpoints, Needs::initialized}},
        {"breakpointLocations", {&Adapter::breakpoint_locations, Needs::loaded}},
        {"threads", {&Adapter::threads, Needs::loaded}},
        {"stackTrace", {&Adapter::stack_trace, Needs::stopped}},
        {"scopes", {&Adapter::scopes, Needs::stopped}},
        {"variables", {&Adapter::variables, Needs::stopped}},
        {"setVariable", {&Adapter::set_variable, Needs::stopped}},
        {"setExpression", {&Adapter::set_expression, Needs::stopped}},
        {"evaluate", {&Adapter::evaluate, Needs::stopped}},
        {"completions", {&Adapter::completions, Needs::stopped}},
        {"exceptionInfo", {&Adapter::exception_info, Needs::stopped}},
        {"continue", {&Adapter::continue_run, Needs::stopped}},
        {"next", {&Adapter::next, Needs::stopped}},
        {"stepIn", {&Adapter::step_in, Needs::stopped}},
        {"stepOut", {&Adapter::step_out, Needs::stopped}},
        {"stepBack", {&Adapter::step_back, Needs::stopped}},
        {"reverseContinue", {&Adapter::reverse_continue, Needs::stopped}},
        {"gotoTargets", {&Adapter::goto_targets, Needs::stopped}},
        {"goto", {&Adapter::go_to, Needs::stopped}},
        {"pause", {&Adapter::pause, Needs::loaded}},
        {"loadedSources", {&Adapter::loaded_sources, Needs::loaded}},
        {"source", {&Adapter::source, Needs::loaded}}};
    return all;
  }

  void handle(const Waiting& w) {
    const Json& m = w.message;
    const Json& command = member(m, "command");
    if (!command.is_string())
      return answer(m, AdapterFailure{"A request must have the name of a command."});
    if (w.is_cancelled) return answer(m, AdapterFailure{"The request was cancelled.", "cancelled"});
    const auto found = requests().find(command.get_ref<const std::string&>());
    if (found == requests().end()) {
      const std::string name = command.get<std::string>();
      if (const char* why = why_not(name))
        return answer(m, AdapterFailure{name + " is not supported: " + why + "."});
      return answer(m, AdapterFailure{"There is no request " +
                                      text::quote(text::visible(name.substr(0, 80))) + "."});
    }
    const Needs needs = found->second.needs;
    if (needs != Needs::nothing && !is_initialized_)
      return answer(m, AdapterFailure{"initialize must come first."});
    if (needs >= Needs::loaded && !debuggee_)
      return answer(m, AdapterFailure{"launch or attach must come first."});
    if (needs == Needs::stopped && !is_configured_)
      return answer(m, AdapterFailure{"The programs have not started; send configurationDone.",
                                      "notStopped"});
    if (needs == Needs::stopped && is_ended_)
      return answer(
          m, AdapterFailure{"The programs have ended; restart starts them again.", "notStopped"});
    if (needs == Needs::stopped && is_running_)
      return answer(m, AdapterFailure{"The programs are running; pause them first.", "notStopped"});
    const Json& arguments = member(m, "arguments");
    if (!arguments.is_null() && !arguments.is_object())
      return answer(m, AdapterFailure{"The arguments of a request must be an object."});
    answer(m, (this->*found->second.method)(arguments));
  }

  Result<Value> ask(std::string_view command, Map args = {}) {
    return debuggee_->ask_run(command, std::move(args));
  }
  static AdapterFailure failed(const Error& e) {
    return {e.sentence(), e.code == ErrorCode::cancelled ? "cancelled" : ""};
  }

  // ---- the session ----

  Answer initialize(const Json& a) {
    if (is_initialized_) return AdapterFailure{"initialize may be sent only once."};
    is_initialized_ = true;
    if (member(a, "linesStartAt1") == false) first_line_ = 0;
    if (member(a, "columnsStartAt1") == false) first_column_ = 0;
    has_types_ = member(a, "supportsVariableType") == true;
    has_paging_ = member(a, "supportsVariablePaging") == true;
    Json can = Json::object();
    for (const char* each : {"supportsConfigurationDoneRequest",
                             "supportsFunctionBreakpoints",
                             "supportsConditionalBreakpoints",
                             "supportsHitConditionalBreakpoints",
                             "supportsEvaluateForHovers",
                             "supportsStepBack",
                             "supportsSetVariable",
                             "supportsGotoTargetsRequest",
                             "supportsCompletionsRequest",
                             "supportsRestartRequest",
                             "supportsExceptionInfoRequest",
                             "supportTerminateDebuggee",
                             "supportSuspendDebuggee",
                             "supportsDelayedStackTraceLoading",
                             "supportsLoadedSourcesRequest",
                             "supportsLogPoints",
                             "supportsSetExpression",
                             "supportsTerminateRequest",
                             "supportsCancelRequest",
                             "supportsBreakpointLocationsRequest",
                             "supportsClipboardContext"})
      can[each] = true;
    can["completionTriggerCharacters"] = {"."};
    can["exceptionBreakpointFilters"] = {{{"filter", "fault"},
                                          {"label", "Run-time faults"},
                                          {"description",
                                           "Where a program cannot continue: index out of range, "
                                           "division by zero, a target out of reach, ..."},
                                          {"default", true}}};
    return can;
  }

  /// A text of the arguments; an error where it is something else.
  static Result<std::string> text_argument(const Json& a, const char* name) {
    const Json& v = member(a, name);
    if (v.is_null()) return std::string();
    if (v.is_string()) return v.get<std::string>();
    return error(ErrorCode::invalid_argument, std::string(name) + " is a text", "");
  }
  static Result<std::vector<std::string>> texts_argument(const Json& a, const char* name) {
    const Json& v = member(a, name);
    std::vector<std::string> out;
    if (v.is_null()) return out;
    const auto wrong = [&] {
      return error(ErrorCode::invalid_argument, std::string(name) + " must be a list of texts", "");
    };
    if (!v.is_array()) return wrong();
    for (const Json& one : v) {
      if (!one.is_string()) return wrong();
      out.push_back(one.get<std::string>());
    }
    return out;
  }
  static Result<std::optional<double>> number_argument(const Json& a, const char* name) {
    const Json& v = member(a, name);
    if (v.is_null()) return std::optional<double>();
    if (v.is_number() && v.get<double>() > 0) return std::optional(v.get<double>());
    return error(ErrorCode::invalid_argument, std::string(name) + " must be a number above 0", "");
  }
  static Result<bool> flag_argument(const Json& a, const char* name) {
    const Json& v = member(a, name);
    if (v.is_null() || v.is_boolean()) return v == true;
    return error(ErrorCode::invalid_argument, std::string(name) + " must be true or false", "");
  }
  /// What launch and attach have in common.
  Result<RunSettings> run_settings(const Json& a) {
    RunSettings run;
    RMP_TRY_ASSIGN(run.world, text_argument(a, "world"));
    RMP_TRY_ASSIGN(run.programs, texts_argument(a, "programs"));
    RMP_TRY_ASSIGN(run.unbound, text_argument(a, "unbound"));
    RMP_TRY_ASSIGN(run.sample_time, number_argument(a, "sampleTime"));
    RMP_TRY_ASSIGN(run.most_time, number_argument(a, "mostTime"));
    RMP_TRY_ASSIGN(run.duration, number_argument(a, "duration"));
    RMP_TRY_ASSIGN(stops_on_entry_, flag_argument(a, "stopOnEntry"));
    RMP_TRY_ASSIGN(stops_at_end_, flag_argument(a, "stopAtEnd"));
    RMP_TRY_ASSIGN(has_no_debug_, flag_argument(a, "noDebug"));
    run.entry = entry();
    const Json& speed = member(a, "speed");
    if (speed.is_null() || speed == "fast" || speed == "max") speed_ = Value("max");
    else if (speed == "real" || speed == "realtime") speed_ = Value(1.0);
    else if (speed.is_number() && speed.get<double>() > 0) speed_ = Value(speed.get<double>());
    else
      return error(ErrorCode::invalid_argument,
                   "speed must be \"fast\", \"real\" or a number above 0",
                   "1 is real time, 2 is twice as fast.");
    return run;
  }
  [[nodiscard]] std::string entry() const {
    return stops_on_entry_ && !has_no_debug_ ? "stop" : "wait";
  }

  Answer launch(const Json& a) {
    if (debuggee_) return AdapterFailure{"A debug session already exists; restart starts again."};
    auto settings = [&]() -> Result<LaunchSettings> {
      LaunchSettings s;
      RMP_TRY_ASSIGN(s.run, run_settings(a));
      RMP_TRY_ASSIGN(const std::string program, text_argument(a, "program"));
      if (program.empty())
        return error(ErrorCode::invalid_argument, "launch needs program",
                     "Give the path of a program (.irl), a script (.lua) or a world (.wld).");
      s.program = path_of(program);
      RMP_TRY_ASSIGN(s.robot, text_argument(a, "robot"));
      RMP_TRY_ASSIGN(s.arguments, texts_argument(a, "args"));
      RMP_TRY_ASSIGN(const auto files, texts_argument(a, "files"));
      for (const std::string& f : files) s.files.push_back(path_of(f));
      return s;
    }();
    if (!settings.ok()) return failed(settings.error());
    auto made = Debuggee::launch(app_, session_, lua_, std::move(*settings));
    if (!made.ok()) return failed(made.error());
    return loaded(std::move(*made), "launch");
  }

  Answer attach(const Json& a) {
    if (debuggee_) return AdapterFailure{"A debug session already exists."};
    auto settings = [&]() -> Result<AttachSettings> {
      AttachSettings s;
      RMP_TRY_ASSIGN(s.run, run_settings(a));
      RMP_TRY_ASSIGN(std::string address, text_argument(a, "address"));
      if (address.empty()) {
        RMP_TRY_ASSIGN(std::string host, text_argument(a, "host"));
        if (host.empty()) host = "127.0.0.1";
        const auto port = number_member(a, "port");
        if (!port || *port == 0 || *port > 65535)
          return error(ErrorCode::invalid_argument, "attach needs address, or host and port",
                       "Write \"address\": \"127.0.0.1:7007\", where robomosp serve listens.");
        address = (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" +
                  std::to_string(*port);
      }
      RMP_TRY_ASSIGN(s.client.address, Address::parse(address));
      RMP_TRY_ASSIGN(s.client.token, text_argument(a, "token"));
      RMP_TRY_ASSIGN(const std::string token_file, text_argument(a, "tokenFile"));
      if (!token_file.empty()) {
        RMP_TRY_ASSIGN(const std::string bytes, io::read_file(path_of(token_file), 4096));
        s.client.token = std::string(text::trim(bytes.substr(0, bytes.find('\n'))));
      }
      if (const Json& tls = member(a, "tls"); !tls.is_null()) {
        RMP_TRY_ASSIGN(s.client.tls, flag_argument(a, "tls"));
      }
      RMP_TRY_ASSIGN(const std::string certificate, text_argument(a, "certificate"));
      if (!certificate.empty()) s.client.certificate = path_of(certificate);
      if (const auto number = number_member(a, "run")) {
        s.which = std::to_string(*number);
      } else {
        RMP_TRY_ASSIGN(s.which, text_argument(a, "run"));
      }
      return s;
    }();
    if (!settings.ok()) return failed(settings.error());
    auto made = Debuggee::attach(std::move(*settings), cancel_);
    if (!made.ok()) return failed(made.error());
    return loaded(std::move(*made), "attach");
  }

  Answer loaded(std::unique_ptr<Debuggee> made, const char* how) {
    debuggee_ = std::move(made);
    if (auto known = know_programs(); !known.ok()) {
      const Error e = known.error();
      debuggee_.reset();
      return failed(e);
    }
    place_breakpoints();
    later("process", {{"name", debuggee_->title()},
                      {"isLocalProcess", !debuggee_->is_attached()},
                      {"startMethod", how}});
    later("initialized", Json::object());
    return Json();
  }

  /// Names of the programs and their files.
  Result<void> know_programs() {
    RMP_TRY_ASSIGN(const Value all, ask("run.programs"));
    programs_.clear();
    sources_.clear();
    texts_.clear();
    for (const Value& p : list_of(all)) {
      Known one;
      one.name = text_at(p, "name");
      for (const Value& f : list_at(p, "files"))
        if (f.as_string()) one.files.push_back(*f.as_string());
      (void)thread_number({one.name, 0});
      programs_.push_back(std::move(one));
    }
    return {};
  }

  Answer configuration_done(const Json&) {
    if (is_configured_) return AdapterFailure{"configurationDone may be sent only once."};
    is_configured_ = true;
    return begin();
  }
  /// The programs stand before their first statement, or as somebody else has left them.
  Answer begin() {
    is_ended_ = is_faulted_ = is_end_told_ = false;
    fault_ = Value();
    const auto place = ask("run.place");
    if (!place.ok()) return failed(place.error());
    tell_notes(*place);
    if (flag_at(*place, "is_playing")) {
      runs();
      return Json();
    }
    if (stops_on_entry_ && !has_no_debug_) {
      arrived(*place, 0);
      return Json();
    }
    if (debuggee_->is_foreign()) {
      arrived(*place, 0);
      return Json();
    }
    if (auto done = ask("run.continue", Map{{"speed", speed_}}); !done.ok())
      return failed(done.error());
    runs();
    return Json();
  }

  Answer disconnect(const Json& a) {
    is_over_ = true;
    if (!debuggee_) return Json();
    const bool ends = member(a, "terminateDebuggee") == true;
    const bool rests = member(a, "suspendDebuggee") == true;
    if (debuggee_->is_foreign()) {
      clear_all();
      if (ends) (void)ask("run.stop");
    }
    debuggee_->leave(!ends && !rests);
    debuggee_.reset();
    return Json();
  }

  Answer terminate(const Json&) {
    if (is_ended_) return AdapterFailure{"The programs have ended."};
    (void)ask("run.stop");
    end(kEndedByUser);
    return Json();
  }

  Answer restart(const Json& a) {
    // The editor may say anew how.
    const Json& with = member(a, "arguments");
    if (with.is_object()) {
      const auto run = run_settings(with);
      if (!run.ok()) return failed(run.error());
    }
    const bool was_running = is_running_;
    is_running_ = false;
    if (was_running) (void)ask("run.pause");
    forget_stop();
    if (auto done = debuggee_->restart(entry()); !done.ok()) {
      is_ended_ = true;
      later("terminated", Json::object());
      return failed(done.error());
    }
    told_notes_ = 0;
    if (auto known = know_programs(); !known.ok()) return failed(known.error());
    threads_told_.clear();
    if (!debuggee_->is_attached()) place_breakpoints();
    is_configured_ = true;
    auto answered = begin();
    if (is_running_ && !was_running)
      later("continued", {{"threadId", first_thread()}, {"allThreadsContinued", true}});
    return answered;
  }

  // ---- breakpoints ----

  /// A program of the run.
  struct Known {
    std::string name;
    std::vector<std::string> files;
  };
  struct Wanted {
    std::int64_t id = 0;
    std::int64_t line = 0;
    std::string routine, condition, hits, log;
    std::vector<std::int64_t> numbers;  ///< of the run
    bool is_verified = false;
    std::int64_t at_line = 0, at_column = 0;
    std::string message, program, file;
  };
  struct WantedOf {
    std::string path, name;  ///< of the source
    std::int64_t reference = 0;
    std::vector<Wanted> all;
  };

  Json shown(const Wanted& w) {
    Json out{{"id", w.id}, {"verified", w.is_verified}};
    if (!w.message.empty()) out["message"] = w.message;
    if (w.is_verified) {
      out["line"] = w.at_line - 1 + first_line_;
      out["column"] = column_of(w.program, w.file, w.at_line, w.at_column);
      out["source"] = source_of(w.program, w.file);
    } else if (w.line > 0) {
      out["line"] = w.line - 1 + first_line_;
    }
    return out;
  }
  void clear(Wanted& w) {
    for (const std::int64_t n : w.numbers) {
      (void)ask("run.clear_breakpoint", Map{{"number", n}});
      ids_.erase(n);
    }
    w.numbers.clear();
    w.is_verified = false;
  }
  void clear_all() {
    for (auto& [key, of] : wanted_)
      for (Wanted& w : of.all) clear(w);
    for (Wanted& w : functions_) clear(w);
  }
  void set(Wanted& w, const Known& program, const std::string& file) {
    Map args{{"program", program.name}};
    if (!w.routine.empty()) {
      args.set("routine", w.routine);
    } else {
      args.set("source", file);
      args.set("line", w.line);
    }
    if (!w.condition.empty()) args.set("condition", w.condition);
    if (!w.hits.empty()) args.set("hits", w.hits);
    if (!w.log.empty()) args.set("log", w.log);
    const auto made = ask("run.set_breakpoint", std::move(args));
    if (!made.ok()) {
      if (w.message.empty()) w.message = made.error().sentence();
      return;
    }
    w.numbers.push_back(number_at(*made, "number"));
    ids_[w.numbers.back()] = {w.id, !w.routine.empty()};
    if (w.is_verified) return;
    w.is_verified = true;
    w.at_line = number_at(*made, "line");
    w.at_column = number_at(*made, "column", 1);
    w.program = program.name;
    w.file = text_at(*made, "source");
  }
  /// Into the run, as far as it has the file or the routine.
  void place(WantedOf& of) {
    for (Wanted& w : of.all) {
      w.message.clear();
      if (has_no_debug_) {
        w.message = "The programs run without a debugger.";
        continue;
      }
      const auto files = files_of(of);
      for (const auto& [program, file] : files) set(w, *program, file);
      if (w.is_verified) w.message.clear();
      if (files.empty())
        w.message = debuggee_ ? "No program of the run has a file " + of.name + "."
                              : "The program is not loaded yet.";
    }
  }
  void place(Wanted& w) {
    w.message.clear();
    if (has_no_debug_) w.message = "The programs run without a debugger.";
    else if (!debuggee_) w.message = "The program is not loaded yet.";
    else
      for (const Known& p : programs_) set(w, p, "");
    if (w.is_verified) w.message.clear();
  }
  /// All that are known, as a new run has none.
  void place_breakpoints() {
    const auto anew = [](Wanted& w) {
      w.numbers.clear();
      w.is_verified = false;
    };
    ids_.clear();
    for (auto& [key, of] : wanted_) {
      for (Wanted& w : of.all) anew(w);
      place(of);
      for (const Wanted& w : of.all)
        later("breakpoint", {{"reason", "changed"}, {"breakpoint", shown(w)}});
    }
    for (Wanted& w : functions_) {
      anew(w);
      place(w);
      later("breakpoint", {{"reason", "changed"}, {"breakpoint", shown(w)}});
    }
  }

  /// Files of programs that a source means.
  std::vector<std::pair<const Known*, std::string>> files_of(const WantedOf& of) {
    std::vector<std::pair<const Known*, std::string>> out;
    if (of.reference > 0) {
      const auto found = references_to_sources_.find(of.reference);
      if (found == references_to_sources_.end()) return out;
      for (const Known& p : programs_)
        if (p.name == found->second.first) out.emplace_back(&p, found->second.second);
      return out;
    }
    for (const Known& p : programs_)
      for (const std::string& f : p.files)
        if (same(f, of.name)) out.emplace_back(&p, f);
    if (out.size() < 2 || of.path.empty()) return out;
    // Of files of one name, those with the text of this one.
    std::vector<std::pair<const Known*, std::string>> equal;
    for (const auto& one : out)
      if (has_text(of.path, one.first->name, one.second)) equal.push_back(one);
    return equal.empty() ? out : equal;
  }

  /// Path, name and reference of a source of the arguments.
  Result<WantedOf> source_argument(const Json& a) {
    const Json& s = member(a, "source");
    WantedOf out;
    if (!s.is_object()) return error(ErrorCode::invalid_argument, "the request has no source", "");
    const Json& path = member(s, "path");
    if (path.is_string()) out.path = path_of(path.get<std::string>());
    out.name = out.path.empty() ? string_member(s, "name") : fs::path(out.path).filename().string();
    if (const auto r = number_member(s, "sourceReference")) out.reference = *r;
    if (out.name.empty() && out.reference == 0)
      return error(ErrorCode::invalid_argument, "the source has no path",
                   "Give path, or sourceReference.");
    return out;
  }

  Answer set_breakpoints(const Json& a) {
    auto read = source_argument(a);
    if (!read.ok()) return failed(read.error());
    WantedOf of = std::move(*read);
    Json given = member(a, "breakpoints");
    if (given.is_null()) {
      // As old editors say it.
      given = Json::array();
      if (const Json& lines = member(a, "lines"); lines.is_array())
        for (const Json& line : lines) given.push_back({{"line", line}});
    }
    if (!given.is_array()) return AdapterFailure{"breakpoints must be a list."};
    const std::string key =
        of.reference > 0 ? "#" + std::to_string(of.reference) : of.path + "\n" + of.name;
    std::size_t others = 0;
    for (const auto& [source, set] : wanted_)
      if (source != key) others += set.all.size();
    if (given.size() > kMostBreakpoints - others)
      return AdapterFailure{
          "There are at most " + std::to_string(kMostBreakpoints) + " breakpoints" +
          (others > 0 ? ", and other sources have " + std::to_string(others) : "") + "."};
    if (!wanted_.contains(key) && (wanted_.size() >= kMostSources || paths_.size() >= kMostSources))
      return AdapterFailure{"At most " + std::to_string(kMostSources) +
                            " sources have breakpoints."};
    for (const Json& one : given) {
      const Json& line = member(one, "line");
      if (!line.is_number_integer())
        return AdapterFailure{"A breakpoint must have a line, a whole number."};
      Wanted w;
      const auto n = number_member(one, "line");
      w.line = n ? std::int64_t{*n} + 1 - first_line_ : 0;
      w.condition = text::trim(string_member(one, "condition"));
      w.hits = text::trim(string_member(one, "hitCondition"));
      w.log = string_member(one, "logMessage");
      if (w.line < 1) w.message = "Lines begin at " + std::to_string(first_line_) + ".";
      of.all.push_back(std::move(w));
    }
    if (const auto old = wanted_.find(key); old != wanted_.end()) {
      if (debuggee_)
        for (Wanted& w : old->second.all) clear(w);
      wanted_.erase(old);
    }
    if (!of.path.empty()) paths_.insert(of.path);
    sources_.clear();  // a path may fit now
    for (Wanted& w : of.all) w.id = ++breakpoints_made_;
    std::vector<Wanted> wrong;
    std::vector<std::size_t> order;
    std::vector<Wanted> all = std::exchange(of.all, {});
    for (Wanted& w : all) (w.line < 1 ? wrong : of.all).push_back(std::move(w));
    place(of);
    std::map<std::int64_t, const Wanted*> by_id;
    for (const Wanted& w : wrong) by_id[w.id] = &w;
    for (const Wanted& w : of.all) by_id[w.id] = &w;
    Json out = Json::array();
    for (const auto& [id, w] : by_id) out.push_back(shown(*w));
    if (!of.all.empty()) wanted_[key] = std::move(of);
    return Json{{"breakpoints", std::move(out)}};
  }

  Answer set_function_breakpoints(const Json& a) {
    const Json& given = member(a, "breakpoints");
    if (!given.is_array()) return AdapterFailure{"breakpoints must be a list."};
    if (given.size() > kMostBreakpoints)
      return AdapterFailure{"There are at most " + std::to_string(kMostBreakpoints) +
                            " function breakpoints."};
    std::vector<Wanted> all;
    for (const Json& one : given) {
      Wanted w;
      w.routine = text::trim(string_member(one, "name"));
      if (w.routine.empty())
        return AdapterFailure{"A function breakpoint must have the name of a routine."};
      w.condition = text::trim(string_member(one, "condition"));
      w.hits = text::trim(string_member(one, "hitCondition"));
      w.id = ++breakpoints_made_;
      all.push_back(std::move(w));
    }
    if (debuggee_)
      for (Wanted& w : functions_) clear(w);
    functions_ = std::move(all);
    Json out = Json::array();
    for (Wanted& w : functions_) {
      place(w);
      out.push_back(shown(w));
    }
    return Json{{"breakpoints", std::move(out)}};
  }

  Answer set_exception_breakpoints(const Json& a) {
    bool breaks = false;
    Json out = Json::array();
    const auto take = [&](const Json& filter) {
      const bool is_known = filter == "fault";
      breaks = breaks || is_known;
      Json one{{"verified", is_known}};
      if (!is_known) one["message"] = "The filter must be \"fault\".";
      out.push_back(std::move(one));
    };
    const Json& filters = member(a, "filters");
    if (!filters.is_array()) return AdapterFailure{"filters must be a list of texts."};
    for (const Json& f : filters) take(f);
    if (const Json& options = member(a, "filterOptions"); options.is_array())
      for (const Json& o : options) take(member(o, "filterId"));
    breaks_on_faults_ = breaks;
    return Json{{"breakpoints", std::move(out)}};
  }

  Answer breakpoint_locations(const Json& a) {
    auto of = source_argument(a);
    if (!of.ok()) return failed(of.error());
    const auto line = number_member(a, "line");
    if (!line) return AdapterFailure{"The request has no line."};
    const std::int64_t first = std::int64_t{*line} + 1 - first_line_;
    std::int64_t last = first;
    if (const auto end = number_member(a, "endLine")) last = std::int64_t{*end} + 1 - first_line_;
    Json out = Json::array();
    const auto files = files_of(*of);
    if (files.empty()) return AdapterFailure{"No program of the run has a file " + of->name + "."};
    const auto& [program, file] = files.front();
    const auto lines = ask("run.program_lines", Map{{"program", program->name}, {"source", file}});
    if (!lines.ok()) return failed(lines.error());
    for (const Value& s : list_at(*lines, "statements")) {
      const std::int64_t n = number_at(s, "line");
      if (n < first || n > last) continue;
      out.push_back({{"line", n - 1 + first_line_},
                     {"column", column_of(program->name, file, n, number_at(s, "column", 1))}});
    }
    return Json{{"breakpoints", std::move(out)}};
  }

  // ---- sources ----

  fs::path path_of(const std::string& given) const {
    constexpr std::string_view kFile = "file://";
    if (!given.starts_with(kFile)) return given;
    std::string out;
    for (std::size_t i = kFile.size(); i < given.size(); ++i) {
      const auto digit = [](char c) {
        return c >= '0' && c <= '9'   ? c - '0'
               : c >= 'a' && c <= 'f' ? c - 'a' + 10
               : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                      : -1;
      };
      if (given[i] == '%' && i + 2 < given.size() && digit(given[i + 1]) >= 0 &&
          digit(given[i + 2]) >= 0) {
        out += static_cast<char>(digit(given[i + 1]) * 16 + digit(given[i + 2]));
        i += 2;
      } else {
        out += given[i];
      }
    }
    return out;
  }
  /// A text with the places where its lines begin.
  struct Lines {
    std::string text;
    std::vector<std::size_t> starts;
    [[nodiscard]] std::string_view at(std::int64_t line) const {
      if (line < 1 || static_cast<std::size_t>(line) > starts.size()) return {};
      const std::string_view rest =
          std::string_view(text).substr(starts[static_cast<std::size_t>(line) - 1]);
      return rest.substr(0, rest.find('\n'));
    }
  };
  const Lines& program_lines(const std::string& program, const std::string& file) {
    const auto [it, is_new] = texts_.try_emplace({program, file});
    Lines& out = it->second;
    if (!is_new) return out;
    const auto text = ask("run.program_text", Map{{"program", program}, {"source", file}});
    if (text.ok() && text->as_string()) out.text = *text->as_string();
    out.starts.push_back(0);
    for (std::size_t i = 0; i < out.text.size(); ++i)
      if (out.text[i] == '\n') out.starts.push_back(i + 1);
    return out;
  }
  /// Whether a file on the disk is what a program runs.
  bool has_text(const fs::path& path, const std::string& program, const std::string& file) {
    if (file_kind(path) != FileKind::file) return false;
    const auto bytes = io::read_file(path, kMostSource);
    if (!bytes.ok()) return false;
    std::string on_disk = ioci::as_utf8(*bytes), runs = program_lines(program, file).text;
    for (std::string* s : {&on_disk, &runs}) {
      std::erase(*s, '\r');
      while (!s->empty() && s->back() == '\n') s->pop_back();
    }
    return on_disk == runs;
  }
  /// By the path of a file that has its text, else by a number under which it can be asked for.
  Json source_of(const std::string& program, const std::string& file) {
    const auto [it, is_new] = sources_.try_emplace({program, file});
    if (!is_new) return it->second;
    Json out{{"name", file}};
    std::vector<fs::path> candidates;
    if (const fs::path folder = debuggee_->folder(); !folder.empty())
      candidates.push_back(folder / file);
    for (const std::string& path : paths_)
      if (same(fs::path(path).filename().string(), file)) candidates.emplace_back(path);
    for (const fs::path& path : candidates)
      if (has_text(path, program, file)) {
        out["path"] = path.string();
        return it->second = out;
      }
    std::int64_t reference = 0;
    for (const auto& [number, of] : references_to_sources_)
      if (of.first == program && of.second == file) reference = number;
    if (reference == 0) {
      reference = static_cast<std::int64_t>(references_to_sources_.size()) + 1;
      references_to_sources_[reference] = {program, file};
    }
    out["sourceReference"] = reference;
    out["origin"] = "program " + program;
    return it->second = out;
  }
  std::int64_t column_of(const std::string& program, const std::string& file, std::int64_t line,
                         std::int64_t column) {
    if (line < 1) return first_column_;
    return units(program_lines(program, file).at(line), column) - 1 + first_column_;
  }

  Answer loaded_sources(const Json&) {
    Json out = Json::array();
    for (const Known& p : programs_)
      for (const std::string& f : p.files) out.push_back(source_of(p.name, f));
    return Json{{"sources", std::move(out)}};
  }

  Answer source(const Json& a) {
    std::int64_t reference = 0;
    if (const auto r = number_member(a, "sourceReference")) reference = *r;
    if (const auto r = number_member(member(a, "source"), "sourceReference"); r && *r > 0)
      reference = *r;
    const auto found = references_to_sources_.find(reference);
    if (found == references_to_sources_.end())
      return AdapterFailure{"There is no source " + std::to_string(reference) + "."};
    const auto text = ask("run.program_text",
                          Map{{"program", found->second.first}, {"source", found->second.second}});
    if (!text.ok()) return failed(text.error());
    return Json{{"content", text->as_string() ? *text->as_string() : ""}};
  }

  // ---- where it is ----

  struct Thread {
    std::string program;
    std::int64_t process = 0;
    bool operator<(const Thread& o) const {
      return std::pair(program, process) < std::pair(o.program, o.process);
    }
  };
  std::int64_t thread_number(const Thread& t) {
    const auto [it, is_new] = threads_.try_emplace(t, 0);
    if (is_new) {
      it->second = static_cast<std::int64_t>(threads_.size());
      threads_by_number_[it->second] = t;
    }
    return it->second;
  }
  std::int64_t first_thread() {
    return programs_.empty() ? 1 : thread_number({programs_.front().name, 0});
  }
  Result<Thread> thread_argument(const Json& a) {
    const Json& id = member(a, "threadId");
    if (!id.is_number_integer())
      return error(ErrorCode::invalid_argument, "the request has no threadId", "");
    const auto n = number_member(a, "threadId");
    const auto found = threads_by_number_.find(n ? std::int64_t{*n} : -1);
    if (found == threads_by_number_.end())
      return error(ErrorCode::not_found, "there is no thread " + id.dump(), "threads lists them.");
    return found->second;
  }

  Answer threads(const Json&) {
    if (is_ended_) return Json{{"threads", Json::array()}};
    const auto all = ask("run.programs");
    if (!all.ok()) return failed(all.error());
    Json out = Json::array();
    for (const Value& p : list_of(*all)) {
      const std::string name = text_at(p, "name");
      if (text_at(p, "state") == "over") continue;
      for (const Value& process : list_at(p, "processes")) {
        const std::int64_t number = number_at(process, "number");
        out.push_back({{"id", thread_number({name, number})},
                       {"name", number == 0 ? name : name + ": " + text_at(process, "name")}});
      }
    }
    return Json{{"threads", std::move(out)}};
  }
  /// Tells the editor what processes have begun and ended since.
  void tell_threads() {
    const auto all = ask("run.programs");
    if (!all.ok()) return;
    std::set<std::int64_t> now;
    for (const Value& p : list_of(*all)) {
      if (text_at(p, "state") == "over") continue;
      for (const Value& process : list_at(p, "processes"))
        now.insert(thread_number({text_at(p, "name"), number_at(process, "number")}));
    }
    for (const std::int64_t n : now)
      if (!threads_told_.contains(n)) later("thread", {{"reason", "started"}, {"threadId", n}});
    for (const std::int64_t n : threads_told_)
      if (!now.contains(n)) later("thread", {{"reason", "exited"}, {"threadId", n}});
    threads_told_ = std::move(now);
  }

  /// What is written and noted since.
  void tell_notes(const Value& place) {
    const std::int64_t count = number_at(place, "notes");
    while (told_notes_ < count) {
      const auto more = ask("run.notes", Map{{"from", told_notes_ + 1}, {"most", kMostNotes}});
      if (!more.ok() || list_of(*more).empty()) return;
      for (const Value& note : list_of(*more))
        if (note.as_string()) tell_note(*note.as_string());
      told_notes_ += static_cast<std::int64_t>(list_of(*more).size());
    }
  }
  /// "t = 6.32 s: carry: text" is what a program writes; all else is told as it is.
  void tell_note(const std::string& note) {
    const std::size_t colon = note.starts_with("t = ") ? note.find(": ") : std::string::npos;
    if (colon != std::string::npos)
      for (const Known& p : programs_)
        if (const std::string begin = p.name + ": ";
            note.compare(colon + 2, begin.size(), begin) == 0) {
          const std::string text = note.substr(colon + 2 + begin.size());
          return say((programs_.size() > 1 ? begin : "") + text + "\n", "stdout");
        }
    say(note + "\n", "console");
  }

  void runs() {
    reads_.clear();
    is_running_ = true;
    nap_ = kFirstNap;
    forget_stop();
  }
  void forget_stop() {
    frames_.clear();
    frame_numbers_.clear();
    stacks_.clear();
    references_.clear();
    targets_.clear();
  }

  void look() {
    if (!debuggee_ || !is_configured_ || is_ended_) return;
    const auto now = Clock::now();
    if (!is_running_ && (!debuggee_->is_foreign() || now < next_look_)) return;
    next_look_ = now + 250ms;
    const auto place = ask("run.place");
    if (!place.ok()) {
      complain("The run can no longer be observed: " + place.error().sentence());
      end(1);
      return tell_events();
    }
    tell_notes(*place);
    if (flag_at(*place, "is_playing")) {
      if (!is_running_) {
        runs();
        event("continued", {{"threadId", first_thread()}, {"allThreadsContinued", true}});
      }
      nap_ = std::min(nap_ * 2, debuggee_->is_attached() ? std::chrono::milliseconds(kFarNap)
                                                         : std::chrono::milliseconds(kMostNap));
      return;
    }
    if (!is_running_) return;
    is_running_ = false;
    arrived(*place, first_thread());
    tell_events();
  }

  /// Says where it stands, or that it is over. `thread` = who asked.
  void arrived(const Value& place, std::int64_t thread) {
    forget_stop();
    tell_threads();
    const std::string reason = text_at(place, "reason"), message = text_at(place, "error");
    if (thread == 0) thread = first_thread();
    if (!text_at(place, "program").empty())
      thread = thread_number({text_at(place, "program"), number_at(place, "process")});
    Json body{{"threadId", thread}, {"allThreadsStopped", true}};
    const bool is_past = flag_at(place, "is_past");
    if (!message.empty() && !is_past) {
      fault_ = place;
      is_faulted_ = true;
      if (!breaks_on_faults_ || has_no_debug_) {
        say(message + "\n", "stderr");
        return end(1);
      }
      body["reason"] = "exception";
      body["description"] = "Run-time fault";
      body["text"] = message;
      return later("stopped", std::move(body));
    }
    if (flag_at(place, "is_complete") && !flag_at(place, "is_stopped") && !is_past) {
      if (!stops_at_end_ || is_end_told_) return end(0);
      is_end_told_ = true;
      body["reason"] = "pause";
      body["description"] = "The programs have ended at " + seconds(real_at(place, "time"));
      return later("stopped", std::move(body));
    }
    body["reason"] = reason == "breakpoint" ? "breakpoint"
                     : reason == "entry"    ? "entry"
                     : reason == "step"     ? "step"
                     : reason == "motion"   ? "step"
                                            : "pause";
    if (reason == "breakpoint") hit(number_at(place, "breakpoint"), body);
    if (const std::string why = text_at(place, "message"); reason == "breakpoint" && !why.empty()) {
      body["text"] = why;
      say(why + "\n", "important");
    }
    if (reason == "pause" && !text_at(place, "file").empty() && place.as_map()->find("message")) {
      const std::string said = text_at(place, "message");
      body["description"] = "PAUSE";
      if (!said.empty()) body["text"] = said;
    }
    if (reason == "input") {
      body["description"] = "READ waits for a line";
      body["text"] = kAsks;
      say(std::string(kAsks) + "\n", "console");
    }
    if (reason == "input" && !is_past) reads_ = text_at(place, "program");
    later("stopped", std::move(body));
  }
  void hit(std::int64_t number, Json& body) {
    const auto found = ids_.find(number);
    if (found == ids_.end()) return;
    body["hitBreakpointIds"] = {found->second.first};
    if (found->second.second) body["reason"] = "function breakpoint";
  }
  void end(int code) {
    if (is_ended_) return;
    is_ended_ = true;
    is_running_ = false;
    later("exited", {{"exitCode", code}});
    later("terminated", Json::object());
  }

  // ---- going on ----

  /// Forward: over what is recorded where the past is shown, else computed.
  Answer go_on(const Json& a, const char* command, const char* recorded) {
    const auto thread = thread_argument(a);
    if (!thread.ok()) return failed(thread.error());
    const auto place = ask("run.place");
    if (!place.ok()) return failed(place.error());
    Map args;
    const bool is_step = std::string_view(command) != "run.continue";
    if (is_step) {
      args.set("program", thread->program);
      args.set("process", thread->process);
    }
    if (flag_at(*place, "is_past")) {
      Map over{{"to", recorded}, {"program", thread->program}};
      if (is_step) over.set("process", thread->process);
      const auto stood = ask("run.step_recorded", std::move(over));
      if (!stood.ok()) return failed(stood.error());
      if (is_step || flag_at(*stood, "is_found")) {
        stopped_at(*stood, *thread, is_step ? "step" : "breakpoint", "");
        return Json();
      }
    }
    if (is_faulted_) {
      end(1);
      return Json();
    }
    if (is_end_told_) {
      end(0);
      return Json();
    }
    args.set("speed", speed_);
    const auto done = ask(command, std::move(args));
    if (!done.ok()) return failed(done.error());
    runs();
    return Json();
  }
  Answer continue_run(const Json& a) {
    auto done = go_on(a, "run.continue", "breakpoint");
    if (done.index() == 0) return Json{{"allThreadsContinued", true}};
    return done;
  }
  Answer next(const Json& a) { return go_on(a, "run.step_over", "over"); }
  Answer step_in(const Json& a) { return go_on(a, "run.step_into", "into"); }
  Answer step_out(const Json& a) { return go_on(a, "run.step_out", "out"); }

  void stopped_at(const Value& place, const Thread& thread, const char* reason,
                  const std::string& description) {
    forget_stop();
    tell_threads();
    Json body{{"threadId", thread_number(thread)}, {"allThreadsStopped", true}, {"reason", reason}};
    if (flag_at(place, "is_past"))
      body["description"] = "In the recording, " + seconds(real_at(place, "time"));
    if (!description.empty()) body["description"] = description;
    later("stopped", std::move(body));
  }
  Answer go_back(const Json& a, const char* to, const char* reason) {
    const auto thread = thread_argument(a);
    if (!thread.ok()) return failed(thread.error());
    const auto stood = ask("run.step_recorded", Map{{"back", true},
                                                    {"to", to},
                                                    {"program", thread->program},
                                                    {"process", thread->process}});
    if (!stood.ok()) return failed(stood.error());
    const bool is_found = flag_at(*stood, "is_found");
    stopped_at(*stood, *thread, is_found ? reason : "entry",
               is_found ? "" : "The start of the recording");
    return Json();
  }
  Answer step_back(const Json& a) { return go_back(a, "into", "step"); }
  Answer reverse_continue(const Json& a) { return go_back(a, "breakpoint", "breakpoint"); }

  Answer goto_targets(const Json& a) {
    auto of = source_argument(a);
    if (!of.ok()) return failed(of.error());
    const auto line = number_member(a, "line");
    if (!line) return AdapterFailure{"The request has no line."};
    const std::int64_t wanted = std::int64_t{*line} + 1 - first_line_;
    if (wanted < 1) return AdapterFailure{"Lines begin at " + std::to_string(first_line_) + "."};
    const auto files = files_of(*of);
    if (files.empty()) return AdapterFailure{"No program of the run has a file " + of->name + "."};
    Json out = Json::array();
    for (const auto& [program, file] : files) {
      const auto times = ask("run.recorded_at",
                             Map{{"program", program->name}, {"source", file}, {"line", wanted}});
      if (!times.ok()) return failed(times.error());
      for (const Value& t : list_of(*times)) {
        if (out.size() >= kMostTargets) break;
        targets_.push_back({real_at(t, "time"), {program->name, number_at(t, "process")}});
        out.push_back(
            {{"id", targets_.size()}, {"label", seconds(targets_.back().time)}, {"line", *line}});
      }
    }
    if (out.empty())
      return AdapterFailure{
          "No program reached this line in the recording, and goto moves within the recording."};
    return Json{{"targets", std::move(out)}};
  }
  Answer go_to(const Json& a) {
    const auto thread = thread_argument(a);
    if (!thread.ok()) return failed(thread.error());
    const auto id = number_member(a, "targetId");
    if (!id || *id == 0 || *id > targets_.size())
      return AdapterFailure{"There is no such target; gotoTargets lists them."};
    const Target target = targets_[*id - 1];
    const auto done = ask("run.seek", Map{{"time", target.time}});
    if (!done.ok()) return failed(done.error());
    const auto place = ask("run.place");
    if (!place.ok()) return failed(place.error());
    stopped_at(*place, target.thread, "goto", "");
    return Json();
  }

  Answer pause(const Json& a) {
    const auto thread = thread_argument(a);
    if (!thread.ok()) return failed(thread.error());
    if (!is_configured_ || is_ended_ || !is_running_)
      return AdapterFailure{"The programs are not running."};
    const auto done = ask("run.pause");
    if (!done.ok() && done.error().code == ErrorCode::cancelled) return failed(done.error());
    const auto place = ask("run.place");
    if (!place.ok()) return failed(place.error());
    tell_notes(*place);
    is_running_ = false;
    arrived(*place, thread_number(*thread));
    // Where it has not left the breakpoint yet, that is not what has stopped it.
    for (auto& [name, body] : events_)
      if (std::string_view(name) == "stopped" && body["reason"] != "exception")
        body["reason"] = "pause";
    return Json();
  }

  // ---- frames and variables ----

  struct FramePlace {
    Thread thread;
    std::int64_t number = 1;  ///< of the stack, 1 is the innermost; 0 = program and modules
  };
  struct Reference {
    enum Kind : std::uint8_t { variables, parts, world } kind = variables;
    FramePlace frame;
    std::string path;  ///< of a variable, or of a member of the world
  };

  Answer stack_trace(const Json& a) {
    const auto thread = thread_argument(a);
    if (!thread.ok()) return failed(thread.error());
    auto& stack = stacks_[*thread];
    if (stack.is_nil()) {
      auto all = ask("run.stack", Map{{"program", thread->program}, {"process", thread->process}});
      if (!all.ok()) return failed(all.error());
      stack = std::move(*all);
    }
    const List& all = list_of(stack);
    const std::size_t first =
        std::min<std::size_t>(number_member(a, "startFrame").value_or(0), all.size());
    std::size_t levels = number_member(a, "levels").value_or(0);
    if (levels == 0) levels = all.size();
    Json out = Json::array();
    for (std::size_t i = first; i < all.size() && i - first < levels; ++i) {
      const std::string file = text_at(all[i], "file");
      const std::int64_t line = number_at(all[i], "line");
      Json one{
          {"id", frame_number({*thread, static_cast<std::int64_t>(i) + 1})},
          {"name", text_at(all[i], "routine")},
          {"line", line > 0 ? line - 1 + first_line_ : 0},
          {"column",
           line > 0 ? column_of(thread->program, file, line, number_at(all[i], "column", 1)) : 0}};
      if (!file.empty() && line > 0) one["source"] = source_of(thread->program, file);
      out.push_back(std::move(one));
    }
    return Json{{"stackFrames", std::move(out)}, {"totalFrames", all.size()}};
  }
  std::int64_t frame_number(const FramePlace& f) {
    const auto [it, is_new] = frame_numbers_.try_emplace({f.thread, f.number}, 0);
    if (is_new) {
      it->second = ++frames_made_;
      frames_[it->second] = f;
    }
    return it->second;
  }
  /// Of an argument frameId; without one the program's and modules' variables.
  Result<FramePlace> frame_argument(const Json& a) {
    const Json& id = member(a, "frameId");
    if (id.is_null()) {
      FramePlace out;
      if (!programs_.empty()) out.thread.program = programs_.front().name;
      out.number = 0;
      return out;
    }
    const auto n = number_member(a, "frameId");
    const auto found = frames_.find(n ? std::int64_t{*n} : -1);
    if (found == frames_.end())
      return error(ErrorCode::not_found, "there is no frame " + id.dump(),
                   "stackTrace lists them while the programs are paused.");
    return found->second;
  }
  static Map of_frame(const FramePlace& f) {
    return Map{{"program", f.thread.program}, {"process", f.thread.process}, {"frame", f.number}};
  }
  std::int64_t reference(Reference r) {
    if (references_.size() >= kMostReferences) return 0;
    references_.push_back(std::move(r));
    return static_cast<std::int64_t>(references_.size());
  }

  Answer scopes(const Json& a) {
    if (!member(a, "frameId").is_number_integer())
      return AdapterFailure{"The request has no frameId."};
    const auto frame = frame_argument(a);
    if (!frame.ok()) return failed(frame.error());
    const FramePlace globals{frame->thread, 0};
    Json out = Json::array();
    out.push_back({{"name", "Locals"},
                   {"presentationHint", "locals"},
                   {"variablesReference", reference({Reference::variables, *frame, ""})},
                   {"expensive", false}});
    out.push_back({{"name", "Program"},
                   {"variablesReference", reference({Reference::variables, globals, ""})},
                   {"expensive", false}});
    out.push_back({{"name", "World"},
                   {"variablesReference", reference({Reference::world, globals, ""})},
                   {"expensive", true}});
    return Json{{"scopes", std::move(out)}};
  }

  Json variable(const Value& v, const std::string& path, const FramePlace& frame) {
    const std::int64_t parts = number_at(v, "part_count");
    Json out{
        {"name", text_at(v, "name")}, {"value", text_at(v, "value")}, {"variablesReference", 0}};
    if (has_types_) out["type"] = text_at(v, "type");
    if (!path.empty()) out["evaluateName"] = path;
    if (parts > 0) {
      out["variablesReference"] = reference({Reference::parts, frame, path});
      if (has_paging_)
        out[flag_at(v, "is_indexed") ? "indexedVariables" : "namedVariables"] = parts;
    }
    return out;
  }
  static std::string part_path(const std::string& whole, const std::string& name) {
    return name.starts_with("[") ? whole + name : whole + "." + name;
  }

  Answer variables(const Json& a) {
    const auto number = number_member(a, "variablesReference");
    if (!number || *number == 0 || *number > references_.size())
      return AdapterFailure{"There is no variablesReference " +
                            member(a, "variablesReference").dump() + " any more."};
    const Reference r = references_[*number - 1];
    const std::size_t start = number_member(a, "start").value_or(0);
    std::size_t count = number_member(a, "count").value_or(0);
    if (count == 0 || count > kMostParts) count = kMostParts;
    const std::string filter = string_member(a, "filter");
    if (r.kind == Reference::world) return world_variables(r, start, count);
    Map args = of_frame(r.frame);
    if (r.kind == Reference::parts) args.set("of", r.path);
    args.set("depth", 0);
    args.set("from", static_cast<std::int64_t>(start) + 1);
    args.set("most", static_cast<std::int64_t>(count));
    const auto all = ask("run.variables", std::move(args));
    if (!all.ok()) return failed(all.error());
    Json out = Json::array();
    for (const Value& v : list_of(*all)) {
      const std::string name = text_at(v, "name");
      const bool is_element = name.starts_with("[");
      if ((filter == "indexed" && !is_element) || (filter == "named" && is_element)) continue;
      out.push_back(
          variable(v, r.kind == Reference::parts ? part_path(r.path, name) : name, r.frame));
    }
    return Json{{"variables", std::move(out)}};
  }

  /// Time, signals, joints and objects of the world at the time that is shown.
  Answer world_variables(const Reference& r, std::size_t start, std::size_t count) {
    const auto state = ask("run.state");
    if (!state.ok()) return failed(state.error());
    Json all = Json::array();
    const auto put = [&](const std::string& name, const std::string& value, const char* type,
                         const std::string& path) {
      Json one{
          {"name", name},
          {"value", value},
          {"variablesReference", path.empty() ? 0 : reference({Reference::world, r.frame, path})},
          {"presentationHint", {{"attributes", {"readOnly"}}}}};
      if (has_types_) one["type"] = type;
      all.push_back(std::move(one));
    };
    const auto members = [](const Value* v) {
      static const Map none;
      return v && v->as_map() ? *v->as_map() : none;
    };
    const auto numbers = [](const Value& v) {
      std::vector<double> out;
      if (const NumericArray* n = v.as_array()) out = n->data();
      for (const Value& one : list_of(v)) out.push_back(one.number());
      return out;
    };
    if (r.path.empty()) {
      put("time", text::print_rounded(real_at(*state, "time")) + " s", "s", "");
      for (const auto& [name, value] : members(at(*state, "values")))
        if (name.starts_with("signal."))
          put(name.substr(7), text::print_rounded(value.number()), "signal", "");
      for (const auto& [name, value] : members(at(*state, "joints")))
        put(name, value.text(), "robot", "joints/" + name);
      for (const auto& [name, value] : members(at(*state, "objects")))
        put(name, value.text(), "object", "objects/" + name);
    } else {
      const std::size_t slash = r.path.find('/');
      const Map group = members(at(*state, r.path.substr(0, slash)));
      const Value* one = group.find(r.path.substr(slash + 1));
      if (one && one->as_map()) {
        for (const auto& [name, value] : *one->as_map()) put(name, value.text(), "", "");
      } else if (one) {
        std::size_t k = 0;
        for (const double q : numbers(*one))
          put("q" + std::to_string(++k), text::print_rounded(q), "rad, m", "");
        // As the robot's pendant shows them.
        const Map axes = r.path.starts_with("joints/") ? members(at(*state, "axes")) : Map();
        for (const auto& [name, value] : members(axes.find(r.path.substr(slash + 1))))
          put(name, text::print_rounded(value.number()), "deg, mm", "");
      }
    }
    Json out = Json::array();
    for (std::size_t i = start; i < all.size() && i - start < count; ++i)
      out.push_back(std::move(all[i]));
    return Json{{"variables", std::move(out)}};
  }

  Answer assigned(const FramePlace& frame, const std::string& path, const std::string& value) {
    Map args = of_frame(frame);
    args.set("variable", path);
    args.set("value", value);
    const auto now = ask("run.set_variable", std::move(args));
    if (!now.ok()) return failed(now.error());
    Json out = variable(*now, path, frame);
    out.erase("name");
    out.erase("evaluateName");
    return out;
  }
  Answer set_variable(const Json& a) {
    const auto number = number_member(a, "variablesReference");
    if (!number || *number == 0 || *number > references_.size())
      return AdapterFailure{"There is no variablesReference " +
                            member(a, "variablesReference").dump() + " any more."};
    const std::string name = string_member(a, "name");
    if (name.empty() || !member(a, "value").is_string())
      return AdapterFailure{"The request has no name, or no value."};
    const Reference r = references_[*number - 1];
    if (r.kind == Reference::world)
      return AdapterFailure{"Change the world with its commands, such as world.set_signal."};
    return assigned(r.frame, r.kind == Reference::parts ? part_path(r.path, name) : name,
                    string_member(a, "value"));
  }
  Answer set_expression(const Json& a) {
    const auto frame = frame_argument(a);
    if (!frame.ok()) return failed(frame.error());
    const std::string expression = string_member(a, "expression");
    if (expression.empty() || !member(a, "value").is_string())
      return AdapterFailure{"The request has no expression, or no value."};
    return assigned(*frame, expression, string_member(a, "value"));
  }

  Answer evaluate(const Json& a) {
    const auto frame = frame_argument(a);
    if (!frame.ok()) return failed(frame.error());
    const Json& given = member(a, "expression");
    if (!given.is_string()) return AdapterFailure{"The request has no expression."};
    if (!reads_.empty() && string_member(a, "context") == "repl") {
      const auto done =
          ask("run.input", Map{{"text", given.get<std::string>()}, {"program", reads_}});
      if (!done.ok()) return failed(done.error());
      return Json{{"result", "READ gets this line when the program continues."},
                  {"variablesReference", 0}};
    }
    std::string expression(text::trim(given.get_ref<const std::string&>()));
    while (expression.ends_with(';')) expression.pop_back();
    if (const std::size_t sign = assignment(expression); sign != std::string::npos) {
      if (string_member(a, "context") != "repl")
        return AdapterFailure{"Assignments are allowed only in the console."};
      auto done = assigned(*frame, std::string(text::trim(expression.substr(0, sign))),
                           std::string(text::trim(expression.substr(sign + 2))));
      if (done.index() == 1) return done;
      Json& out = std::get<0>(done);
      out["result"] = out["value"];
      out.erase("value");
      return done;
    }
    Map args = of_frame(*frame);
    args.set("expression", expression);
    args.set("depth", 0);
    const auto v = ask("run.evaluate", std::move(args));
    if (!v.ok()) return failed(v.error());
    Json out = variable(*v, expression, *frame);
    out["result"] = out["value"];
    for (const char* each : {"name", "value", "evaluateName"}) out.erase(each);
    return out;
  }
  /// Where := stands outside of texts.
  static std::size_t assignment(std::string_view s) {
    bool is_text = false;
    for (std::size_t i = 0; i + 1 < s.size(); ++i) {
      if (s[i] == '\'') is_text = !is_text;
      if (!is_text && s[i] == ':' && s[i + 1] == '=') return i;
    }
    return std::string::npos;
  }

  Answer completions(const Json& a) {
    const auto frame = frame_argument(a);
    if (!frame.ok()) return failed(frame.error());
    const Json& given = member(a, "text");
    const auto column = number_member(a, "column");
    if (!given.is_string() || !column)
      return AdapterFailure{"The request has no text, or no column."};
    std::string line = given.get<std::string>();
    std::uint32_t row = 1;
    if (const auto n = number_member(a, "line"))
      row = *n + 1 - static_cast<std::uint32_t>(first_line_);
    line = line_of(line, row);
    const std::size_t behind =
        *column - std::min<std::uint32_t>(*column, static_cast<std::uint32_t>(first_column_));
    line.resize(byte_behind(line, behind));
    const auto is_word = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    };
    std::size_t word = line.size();
    while (word > 0 && is_word(line[word - 1])) --word;
    const std::string prefix = line.substr(word);
    std::vector<Value> candidates;
    Map args = of_frame(*frame);
    args.set("depth", 0);
    args.set("most", static_cast<std::int64_t>(kMostParts));
    if (word > 0 && line[word - 1] == '.') {
      // The path before it: names, fields, and indices in brackets.
      std::size_t begin = word - 1, depth = 0;
      while (begin > 0) {
        const char c = line[begin - 1];
        if (c == ']') ++depth;
        if (c == '[' && depth-- == 0) break;
        if (depth == 0 && !is_word(c) && c != '.' && c != '[') break;
        --begin;
      }
      args.set("of", line.substr(begin, word - 1 - begin));
      if (const auto all = ask("run.variables", std::move(args)); all.ok())
        candidates = list_of(*all);
    } else {
      Map globals = args;
      globals.set("frame", 0);
      if (frame->number > 0)
        if (const auto all = ask("run.variables", std::move(args)); all.ok())
          candidates = list_of(*all);
      if (const auto all = ask("run.variables", std::move(globals)); all.ok())
        candidates.insert(candidates.end(), list_of(*all).begin(), list_of(*all).end());
    }
    Json out = Json::array();
    for (const Value& v : candidates) {
      const std::string name = text_at(v, "name");
      if (name.size() < prefix.size() || !same(name.substr(0, prefix.size()), prefix) ||
          name.starts_with("[") || out.size() >= kMostCompletions)
        continue;
      // `start` counts from 0 within the text, or from 1 as columns do.
      const auto start = units(line, static_cast<std::int64_t>(word) + 1) - 1;
      out.push_back({{"label", name},
                     {"type", "variable"},
                     {"detail", text_at(v, "type")},
                     {"start", start},
                     {"length", prefix.size()}});
    }
    return Json{{"targets", std::move(out)}};
  }

  Answer exception_info(const Json& a) {
    const auto thread = thread_argument(a);
    if (!thread.ok()) return failed(thread.error());
    if (!is_faulted_) return AdapterFailure{"No program has a fault."};
    const std::string message = text_at(fault_, "error");
    const std::string own = text_at(fault_, "message");
    return Json{{"exceptionId", "fault"},
                {"description", own.empty() ? message : own},
                {"breakMode", "unhandled"},
                {"details", {{"message", message}, {"typeName", "fault"}}}};
  }

  ioci::Application& app_;
  ioci::Session& session_;
  lua::LuaState& lua_;
  const int in_, out_;
  const int wake_ = ::eventfd(0, EFD_CLOEXEC);  ///< ends the reader
  std::uint64_t messages_ = 0;

  std::mutex write_mutex_;
  std::int64_t said_ = 0;  // guarded by write_mutex_
  std::atomic<bool> is_broken_{false};

  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_:
  std::deque<Waiting> waiting_;
  std::size_t waiting_bytes_ = 0;
  Json current_;  ///< seq of the request that is answered; null = none
  bool is_input_over_ = false, is_done_ = false;
  bool wants_interrupt_ = false;  ///< of the request that is answered, until it ends
  bool was_interrupted_ = false;  ///< by this, not by the user

  std::atomic<bool> cancel_{false};

  // The session's thread:
  struct Target {
    double time = 0;
    Thread thread;
  };
  std::unique_ptr<Debuggee> debuggee_;
  std::vector<Known> programs_;
  std::vector<std::pair<const char*, Json>> events_;
  Value speed_{"max"};
  bool is_initialized_ = false, is_configured_ = false, is_over_ = false;
  bool is_running_ = false, is_ended_ = false;
  bool is_faulted_ = false, is_end_told_ = false;
  std::string reads_;  ///< program that waits for a line; "" = none
  Value fault_;
  bool stops_on_entry_ = false, stops_at_end_ = false, has_no_debug_ = false;
  bool breaks_on_faults_ = true;
  bool has_types_ = false, has_paging_ = false;
  std::int64_t first_line_ = 1, first_column_ = 1;
  std::chrono::milliseconds nap_ = kFirstNap;
  Clock::time_point next_look_{};
  std::int64_t told_notes_ = 0;
  std::map<std::string, WantedOf> wanted_;  ///< by source
  std::vector<Wanted> functions_;
  std::int64_t breakpoints_made_ = 0;
  std::map<std::int64_t, std::pair<std::int64_t, bool>>
      ids_;                      ///< by number of the run; of a routine
  std::set<std::string> paths_;  ///< that the editor has named
  std::map<std::pair<std::string, std::string>, Json> sources_;  ///< by program and file
  std::map<std::pair<std::string, std::string>, Lines> texts_;   ///< the same
  std::map<std::int64_t, std::pair<std::string, std::string>> references_to_sources_;
  std::map<Thread, std::int64_t> threads_;
  std::map<std::int64_t, Thread> threads_by_number_;
  std::set<std::int64_t> threads_told_;
  // Of one stop:
  std::map<std::int64_t, FramePlace> frames_;
  std::map<std::pair<Thread, std::int64_t>, std::int64_t> frame_numbers_;
  std::int64_t frames_made_ = 0;  ///< of all stops
  std::map<Thread, Value> stacks_;
  std::vector<Reference> references_;
  std::vector<Target> targets_;
};

}  // namespace

int serve_debugger(ioci::Application& app, ioci::Session& session, lua::LuaState& lua,
                   std::function<void(std::string_view)>& printed, int in, int out) {
  Adapter adapter(app, session, lua, in, out);
  printed = [&adapter](std::string_view text) { adapter.print(text); };
  const int code = adapter.run();
  printed = {};
  return code;
}

}  // namespace robomosp::remote
