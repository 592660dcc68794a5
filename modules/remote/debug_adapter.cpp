// SPDX-License-Identifier: Apache-2.0
// The session's thread answers requests in order, and looks where the programs are while they run;
// one thread reads, so that cancel, disconnect and terminate end what takes long.
#include "remote/debug_adapter.h"

#include <poll.h>

#include <cerrno>

#include "remote/debug_adapter_parts.h"

namespace robomosp::remote {
namespace adapter {

// ---- values of commands ----

const Value* at(const Value& v, std::string_view name) {
  const Map* m = v.as_map();
  return m ? m->find(name) : nullptr;
}
std::string text_at(const Value& v, std::string_view name) {
  const Value* found = at(v, name);
  return found && found->as_string() ? *found->as_string() : std::string();
}
std::int64_t number_at(const Value& v, std::string_view name, std::int64_t otherwise) {
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
std::int64_t units(std::string_view line, std::int64_t column) {
  std::int64_t n = 1;
  for (std::size_t i = 0; i < line.size() && static_cast<std::int64_t>(i) + 1 < column; ++i) {
    const auto c = static_cast<unsigned char>(line[i]);
    if ((c & 0xC0U) != 0x80) n += c >= 0xF0 ? 2 : 1;
  }
  return n;
}
std::size_t byte_behind(std::string_view text, std::size_t count) {
  std::size_t i = 0;
  for (std::size_t n = 0; i < text.size() && n < count;) {
    n += static_cast<unsigned char>(text[i]) >= 0xF0 ? 2 : 1;
    for (++i; i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0U) == 0x80;) ++i;
  }
  return i;
}

std::string seconds(double t) { return "t = " + text::print_rounded(t) + " s"; }

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

Adapter::Adapter(ioci::Application& app, ioci::Session& session, lua::LuaState& lua, int in,
                 int out)
    : app_(app), session_(session), lua_(lua), in_(in), out_(out) {
  messages_ = app_.messages.subscribe([this](const Message& m) {
    if (m.severity >= Severity::warning) say(m.text + "\n", "console");
  });
}

Adapter::~Adapter() {
  app_.messages.unsubscribe(messages_);
  ::close(wake_);
}

int Adapter::run() {
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

void Adapter::write(Json message) {
  const std::lock_guard lock(write_mutex_);
  if (is_broken_) return;
  message["seq"] = ++said_;
  if (!write_all(out_, framed(message))) is_broken_ = true;
}

void Adapter::event(const char* name, Json body) {
  write({{"type", "event"}, {"event", name}, {"body", std::move(body)}});
}

void Adapter::say(const std::string& text, const char* category) {
  event("output", {{"category", category}, {"output", text}});
}

void Adapter::tell_events() {
  for (auto& [name, body] : std::exchange(events_, {})) event(name, std::move(body));
}

void Adapter::answer(const Json& request, Answer made) {
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

void Adapter::read_all() {
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

void Adapter::take(std::string body) {
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

void Adapter::cancel(const Json& request) {
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

void Adapter::interrupt_current() {
  if (current_.is_null()) return;
  was_interrupted_ = true;
  cancel_ = true;
  session_.interrupt();
}

bool Adapter::interrupts_again() {
  const std::lock_guard lock(mutex_);
  if (wants_interrupt_) interrupt_current();
  return wants_interrupt_;
}

int Adapter::work() {
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

const std::map<std::string, Adapter::Request, std::less<>>& Adapter::requests() {
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

void Adapter::handle(const Waiting& w) {
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
    return answer(
        m, AdapterFailure{"The programs have not started; send configurationDone.", "notStopped"});
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

Result<Value> Adapter::ask(std::string_view command, Map args) {
  return debuggee_->ask_run(command, std::move(args));
}

AdapterFailure Adapter::failed(const Error& e) {
  return {e.sentence(), e.code == ErrorCode::cancelled ? "cancelled" : ""};
}

}  // namespace adapter

int serve_debugger(ioci::Application& app, ioci::Session& session, lua::LuaState& lua,
                   std::function<void(std::string_view)>& printed, int in, int out) {
  adapter::Adapter made(app, session, lua, in, out);
  printed = [&made](std::string_view text) { made.print(text); };
  const int code = made.run();
  printed = {};
  return code;
}

}  // namespace robomosp::remote
