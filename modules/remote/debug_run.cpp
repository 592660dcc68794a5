// SPDX-License-Identifier: Apache-2.0
// Requests of the debug adapter that let programs go on, and where they are.
#include "remote/debug_adapter_parts.h"

namespace robomosp::remote::adapter {

std::int64_t Adapter::thread_number(const Thread& t) {
  const auto [it, is_new] = threads_.try_emplace(t, 0);
  if (is_new) {
    it->second = static_cast<std::int64_t>(threads_.size());
    threads_by_number_[it->second] = t;
  }
  return it->second;
}

std::int64_t Adapter::first_thread() {
  return programs_.empty() ? 1 : thread_number({programs_.front().name, 0});
}

Result<Adapter::Thread> Adapter::thread_argument(const Json& a) {
  const Json& id = member(a, "threadId");
  if (!id.is_number_integer())
    return error(ErrorCode::invalid_argument, "the request has no threadId", "");
  const auto n = number_member(a, "threadId");
  const auto found = threads_by_number_.find(n ? std::int64_t{*n} : -1);
  if (found == threads_by_number_.end())
    return error(ErrorCode::not_found, "there is no thread " + id.dump(), "threads lists them.");
  return found->second;
}

Answer Adapter::threads(const Json&) {
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

void Adapter::tell_threads() {
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

void Adapter::tell_notes(const Value& place) {
  const std::int64_t count = number_at(place, "notes");
  while (told_notes_ < count) {
    const auto more = ask("run.notes", Map{{"from", told_notes_ + 1}, {"most", kMostNotes}});
    if (!more.ok() || list_of(*more).empty()) return;
    for (const Value& note : list_of(*more))
      if (note.as_string()) tell_note(*note.as_string());
    told_notes_ += static_cast<std::int64_t>(list_of(*more).size());
  }
}

void Adapter::tell_note(const std::string& note) {
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

void Adapter::runs() {
  reads_.clear();
  is_running_ = true;
  nap_ = kFirstNap;
  forget_stop();
}

void Adapter::forget_stop() {
  frames_.clear();
  frame_numbers_.clear();
  stacks_.clear();
  references_.clear();
  targets_.clear();
}

void Adapter::look() {
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

void Adapter::arrived(const Value& place, std::int64_t thread) {
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

void Adapter::hit(std::int64_t number, Json& body) {
  const auto found = ids_.find(number);
  if (found == ids_.end()) return;
  body["hitBreakpointIds"] = {found->second.first};
  if (found->second.second) body["reason"] = "function breakpoint";
}

void Adapter::end(int code) {
  if (is_ended_) return;
  is_ended_ = true;
  is_running_ = false;
  later("exited", {{"exitCode", code}});
  later("terminated", Json::object());
}

Answer Adapter::go_on(const Json& a, const char* command, const char* recorded) {
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

Answer Adapter::continue_run(const Json& a) {
  auto done = go_on(a, "run.continue", "breakpoint");
  if (done.index() == 0) return Json{{"allThreadsContinued", true}};
  return done;
}

void Adapter::stopped_at(const Value& place, const Thread& thread, const char* reason,
                         const std::string& description) {
  forget_stop();
  tell_threads();
  Json body{{"threadId", thread_number(thread)}, {"allThreadsStopped", true}, {"reason", reason}};
  if (flag_at(place, "is_past"))
    body["description"] = "In the recording, " + seconds(real_at(place, "time"));
  if (!description.empty()) body["description"] = description;
  later("stopped", std::move(body));
}

Answer Adapter::go_back(const Json& a, const char* to, const char* reason) {
  const auto thread = thread_argument(a);
  if (!thread.ok()) return failed(thread.error());
  const auto stood = ask(
      "run.step_recorded",
      Map{{"back", true}, {"to", to}, {"program", thread->program}, {"process", thread->process}});
  if (!stood.ok()) return failed(stood.error());
  const bool is_found = flag_at(*stood, "is_found");
  stopped_at(*stood, *thread, is_found ? reason : "entry",
             is_found ? "" : "The start of the recording");
  return Json();
}

Answer Adapter::goto_targets(const Json& a) {
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
    const auto times =
        ask("run.recorded_at", Map{{"program", program->name}, {"source", file}, {"line", wanted}});
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

Answer Adapter::go_to(const Json& a) {
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

Answer Adapter::pause(const Json& a) {
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

}  // namespace robomosp::remote::adapter
