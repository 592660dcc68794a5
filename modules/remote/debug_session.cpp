// SPDX-License-Identifier: Apache-2.0
// Requests of the debug adapter that begin and end a session.
#include "io/native.h"
#include "kernel/file_root.h"
#include "remote/debug_adapter_parts.h"

namespace robomosp::remote::adapter {

Answer Adapter::initialize(const Json& a) {
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

Result<std::string> Adapter::text_argument(const Json& a, const char* name) {
  const Json& v = member(a, name);
  if (v.is_null()) return std::string();
  if (v.is_string()) return v.get<std::string>();
  return error(ErrorCode::invalid_argument, std::string(name) + " is a text", "");
}

Result<std::vector<std::string>> Adapter::texts_argument(const Json& a, const char* name) {
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

Result<std::optional<double>> Adapter::number_argument(const Json& a, const char* name) {
  const Json& v = member(a, name);
  if (v.is_null()) return std::optional<double>();
  if (v.is_number() && v.get<double>() > 0) return std::optional(v.get<double>());
  return error(ErrorCode::invalid_argument, std::string(name) + " must be a number above 0", "");
}

Result<bool> Adapter::flag_argument(const Json& a, const char* name) {
  const Json& v = member(a, name);
  if (v.is_null() || v.is_boolean()) return v == true;
  return error(ErrorCode::invalid_argument, std::string(name) + " must be true or false", "");
}

Result<RunSettings> Adapter::run_settings(const Json& a) {
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

std::string Adapter::entry() const { return stops_on_entry_ && !has_no_debug_ ? "stop" : "wait"; }

Answer Adapter::launch(const Json& a) {
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

Answer Adapter::attach(const Json& a) {
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

Answer Adapter::loaded(std::unique_ptr<Debuggee> made, const char* how) {
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

Result<void> Adapter::know_programs() {
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

Answer Adapter::configuration_done(const Json&) {
  if (is_configured_) return AdapterFailure{"configurationDone may be sent only once."};
  is_configured_ = true;
  return begin();
}

Answer Adapter::begin() {
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

Answer Adapter::disconnect(const Json& a) {
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

Answer Adapter::terminate(const Json&) {
  if (is_ended_) return AdapterFailure{"The programs have ended."};
  (void)ask("run.stop");
  end(kEndedByUser);
  return Json();
}

Answer Adapter::restart(const Json& a) {
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

}  // namespace robomosp::remote::adapter
