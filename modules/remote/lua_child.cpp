// SPDX-License-Identifier: Apache-2.0
#include "remote/lua_child.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <ctime>
#include <set>
#include <utility>
#include <vector>

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "kernel/call_queue.h"
#include "kernel/process.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "lua/command_host.h"
#include "lua/lua_state.h"
#include "lua/sandbox/lock_down.h"
#include "lua/sandbox/wire.h"
#include "remote/rpc.h"

namespace robomosp::remote {
namespace {

namespace wire = lua::wire;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

/// How often limits are looked at.
constexpr auto kChildLook = 10ms;
/// How long a script that was told to stop may take before its process is ended.
constexpr auto kGrace = 500ms;
/// How long the process may take to start.
constexpr auto kStart = 30s;
/// Transactions in transactions.
constexpr int kDeepestGroup = 64;
constexpr std::size_t kLongestLabel = 256;

Clock::duration duration_of(double s) {
  return std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(std::clamp(s, 0.0, 1e8)));
}

std::string in_seconds(double s) { return text::print_rounded(s, 4) + " s"; }

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { reset(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  void reset(int fd = -1) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = fd;
  }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

/// A script's process. It is waited for when it is ended, so its number stays its own.
class Process {
 public:
  Process() = default;
  ~Process() { end(); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  Result<void> start(const std::filesystem::path& program, std::vector<std::string> words) {
    int pair[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
      return error(ErrorCode::io, std::string("no socket could be made: ") + std::strerror(errno),
                   "Close other connections, or raise the limits of the system.");
    socket_.reset(pair[0]);
    const Descriptor other(pair[1]);
    const auto [pid, failed] = start_process(program, std::move(words), {.in = other.get()}, false);
    if (failed != 0) {
      socket_.reset();
      return error(
          failed == ENOENT ? ErrorCode::not_found : ErrorCode::io,
          "the program " + text::quote(program.string()) +
              ", which runs untrusted scripts, cannot be started: " + std::strerror(failed),
          "Reinstall the program; this file is part of it.");
    }
    pid_ = pid;
    return {};
  }

  [[nodiscard]] bool runs() const { return pid_ > 0; }
  [[nodiscard]] pid_t id() const { return pid_; }
  [[nodiscard]] int socket() const { return socket_.get(); }
  void tell_to_stop() const {
    if (runs()) ::kill(pid_, SIGINT);
  }
  /// Ends it and gives its exit status.
  int end() {
    if (!runs()) return 0;
    ::kill(pid_, SIGKILL);
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    socket_.reset();
    return status;
  }
  /// Processor time that it has used [s].
  [[nodiscard]] double cpu() const {
    clockid_t clock{};
    timespec t{};
    if (!runs() || ::clock_getcpuclockid(pid_, &clock) != 0 || ::clock_gettime(clock, &t) != 0)
      return 0;
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  /// The system's own limit, in case nobody looks.
  void limit_cpu(double total) const {
    rlimit now{};
    if (::prlimit(pid_, RLIMIT_CPU, nullptr, &now) != 0) return;
    now.rlim_cur = std::min(now.rlim_max, static_cast<rlim_t>(std::ceil(std::min(total, 1e9))));
    ::prlimit(pid_, RLIMIT_CPU, &now, nullptr);
  }

 private:
  pid_t pid_ = -1;
  Descriptor socket_;
};

enum class Stop : std::uint8_t { none, cancelled, cpu, wall, start };

/// One call: what it may use, and what it has used.
struct Call {
  ioci::Session& session;
  Clock::time_point wall_end;
  double cpu_end = 0;  ///< of the process [s]
  Stop stop = Stop::none;
  Clock::time_point stop_end{};
  Clock::time_point next_look{};
  std::string output{};
  std::size_t printed = 0;
};

List rows_of(const std::vector<ParamSpec>& params) {
  List out;
  out.reserve(params.size());
  // The other process checks forms only, and knows no types with names.
  for (const ParamSpec& p : params)
    out.push_back(List{p.name, std::string(plain_type(p.type)), p.unit});
  return out;
}

Value row_of(const ioci::CommandSpec& c) {
  return List{c.name,
              c.summary,
              c.plugin,
              rows_of(c.params),
              std::string(plain_type(c.returns.type)),
              c.returns.unit,
              rows_of(c.returns.fields)};
}

}  // namespace

class LuaChild::Impl {
 public:
  Impl(ioci::Application& app, LuaChildOptions options) : app_(app), options_(std::move(options)) {
    LuaLimits& l = options_.limits;
    l.memory = std::max(l.memory, lua::kLeastMemory);
    if (options_.program.empty()) options_.program = helper_program("robomosp-lua");
  }

  /// Starts the process if there is none, runs `what` in it, and gives the frame of its end.
  Result<Map> call(Map what, ioci::Session& session, std::string& output) {
    traceback.clear();
    session.clear_interrupt();
    Call call{.session = session, .wall_end = Clock::now() + kStart};
    call.cpu_end = kStartCpu;
    if (!process_.runs()) RMP_TRY(start(call));
    call.wall_end = Clock::now() + duration_of(options_.limits.wall_seconds);
    call.cpu_end = process_.cpu() + options_.limits.cpu_seconds;
    is_starting_ = false;
    process_.limit_cpu(call.cpu_end + 2);
    const auto sent = wire::frame(wire::Kind::eval, what, wire::kLongestAnswer);
    if (!sent)
      return error(
          ErrorCode::invalid_argument,
          "the script is longer than " + std::to_string(wire::kLongestAnswer >> 20) + " MiB",
          "Send it in parts.");
    RMP_TRY(send(call, *sent));
    auto done = converse(call, 0);
    session.clear_interrupt();
    if (!done.ok()) return std::move(done).error();
    output = std::move(call.output);
    Map* const m = done->as_map();
    if (!m) return broken(call, "a call ended without its results");
    if (const Value* trace = m->find("trace"); trace && trace->as_string())
      traceback = *trace->as_string();
    if (const Value* failed = m->find("error")) return own_error(call, wire::error_from(*failed));
    // A script can catch what stops it, in its last instruction.
    if (call.stop != Stop::none) return stopped(call);
    return std::move(*m);
  }

  [[nodiscard]] std::optional<int> process() const {
    if (!process_.runs()) return std::nullopt;
    return process_.id();
  }
  [[nodiscard]] bool has_namespaces() const { return has_namespaces_; }
  [[nodiscard]] bool take_lost() { return std::exchange(has_lost_, false); }
  [[nodiscard]] const LuaChildOptions& options() const { return options_; }

  std::string traceback;

 private:
  static constexpr double kStartCpu = 20;  ///< [s]

  // --- the process ---

  Result<void> start(Call& call) {
    inbox_ = wire::Inbox(wire::kLongestRequest);
    is_starting_ = true;
    std::vector<std::string> words{std::to_string(options_.limits.memory)};
    if (options_.without_seccomp) words.emplace_back("--without-seccomp");
    RMP_TRY(process_.start(options_.program, std::move(words)));
    shown_.clear();
    Map setup{{"name", options_.input_name},
              {"output", options_.limits.output},
              {"commands", new_commands()}};
    List nouns;
    for (const std::string& noun : lua::classic_nouns(app_.commands)) nouns.emplace_back(noun);
    setup.set("nouns", std::move(nouns));
    const auto frame = wire::frame(wire::Kind::setup, setup, wire::kLongestAnswer);
    if (!frame) return broken(call, "there are too many commands");
    RMP_TRY(send(call, *frame));
    RMP_TRY_ASSIGN(const wire::Frame ready, next(call));
    const Map* m = ready.kind == wire::Kind::ready ? ready.value.as_map() : nullptr;
    if (!m) return broken(call, "it did not report readiness");
    if (const Value* failed = m->find("error")) {
      process_.end();
      Error e = wire::error_from(*failed);
      e.message = "untrusted scripts are not run, since " + e.message;
      e.hint = "If the other restrictions are sufficient, --without-seccomp runs them anyway.";
      return e;
    }
    const auto is = [m](const char* name) {
      const Value* v = m->find(name);
      return v && v->as_bool() && *v->as_bool();
    };
    if (!is("seccomp") && !options_.without_seccomp && !kIsSanitized)
      return broken(call, "it is not locked");
    has_namespaces_ = is("namespaces");
    return {};
  }

  /// Commands that the process does not know yet.
  List new_commands() {
    revision_ = app_.commands.revision();
    List out;
    for (const ioci::CommandSpec* spec : app_.commands.list())
      if (shown_.insert(spec).second) out.push_back(row_of(*spec));
    return out;
  }

  /// Ends the process because of what it did, which the sentence says.
  Error broken(Call& call, const std::string& why) {
    process_.end();
    has_lost_ = true;
    (void)call;
    return error(ErrorCode::script_failed,
                 "the process of the script broke the protocol and was ended: " + why,
                 std::string(kGone));
  }

  /// The process is at its end: why.
  Error death(const Call& call) {
    const bool was_starting = is_starting_;
    const int status = process_.end();
    has_lost_ = !was_starting;
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (was_starting && call.stop == Stop::none)
      return error(ErrorCode::unsupported,
                   "the program " + text::quote(options_.program.string()) +
                       ", which runs untrusted scripts, ended at its start (" +
                       (signal ? "signal " + name_of(signal)
                               : "exit code " + std::to_string(WEXITSTATUS(status))) +
                       ")",
                   "Install the program and its libraries again.");
    std::string what;
    ErrorCode code = ErrorCode::script_failed;
    if (call.stop != Stop::none && (signal == SIGKILL || signal == SIGXCPU)) {
      Error e = stopped(call);
      if (call.stop == Stop::cancelled) code = ErrorCode::cancelled;
      what = e.message + "; it did not stop, and its process was ended";
    } else if (signal == SIGXCPU) {
      what = "the script took more than " + in_seconds(options_.limits.cpu_seconds) +
             " of processor time, and its process was ended";
    } else if (signal == SIGSYS) {
      what =
          "the script's process was ended by the system: it made a call that the sandbox does "
          "not allow";
    } else if (signal == SIGKILL) {
      what = "the script's process was killed externally, as the system does when memory is low";
    } else if (signal != 0) {
      what = "the script's process crashed (signal " + name_of(signal) + ")";
    } else {
      what = "the script's process ended with exit code " + std::to_string(WEXITSTATUS(status));
    }
    return error(code, std::move(what), std::string(kGone));
  }

  static std::string name_of(int signal) {
    const char* name = ::sigabbrev_np(signal);
    return name ? "SIG" + std::string(name) : std::to_string(signal);
  }

  /// What was hit.
  [[nodiscard]] Error stopped(const Call& call) const {
    switch (call.stop) {
      case Stop::cpu:
        return error(ErrorCode::script_failed,
                     "the script took more than " + in_seconds(options_.limits.cpu_seconds) +
                         " of processor time and was stopped",
                     "Do less in one call, or raise the limit of untrusted scripts.");
      case Stop::wall:
        return error(ErrorCode::script_failed,
                     "the script took longer than " + in_seconds(options_.limits.wall_seconds) +
                         " and was stopped",
                     "Do less in one call, or raise the limit of untrusted scripts.");
      case Stop::start:
        return error(ErrorCode::script_failed, "the process of the script took too long to start",
                     "Try again when the machine is less busy.");
      case Stop::none:
      case Stop::cancelled: break;
    }
    return error(ErrorCode::cancelled, "the script was interrupted");
  }

  /// The error of the script itself, or the limit that made it.
  [[nodiscard]] Error own_error(const Call& call, Error e) const {
    if (call.stop == Stop::none || e.code != ErrorCode::cancelled) return e;
    return stopped(call);
  }

  // --- waiting ---

  /// Looks at limits and cancellation; false when the process was ended for them.
  bool look(Call& call) {
    const auto now = Clock::now();
    if (now < call.next_look) return true;
    call.next_look = now + kChildLook;
    if (call.stop == Stop::none) {
      if (call.session.interrupted()) call.stop = Stop::cancelled;
      else if (now >= call.wall_end) call.stop = is_starting_ ? Stop::start : Stop::wall;
      else if (process_.cpu() >= call.cpu_end) call.stop = is_starting_ ? Stop::start : Stop::cpu;
      else return true;
      call.stop_end = now + kGrace;
      process_.tell_to_stop();
      return true;
    }
    return now < call.stop_end;
  }

  /// Waits until the socket can be read or written; answers what other threads ask of this one.
  Result<void> wait(Call& call, short events) {
    const std::shared_ptr<CallQueue> queue = CallQueue::of_this_thread();
    for (;;) {
      if (!look(call)) return death(call);
      pollfd ready[2]{{process_.socket(), events, 0}, {wake_.get(), POLLIN, 0}};
      int n = ::poll(ready, 1, 0);
      if (n == 0) {
        if (queue && queue->has_calls()) queue->serve();
        const int most = static_cast<int>(std::chrono::milliseconds(kChildLook).count());
        if (queue) {
          const CallQueue::Waker waker(*queue, [fd = wake_.get()] {
            const std::uint64_t one = 1;
            (void)!::write(fd, &one, sizeof one);
          });
          n = queue->has_calls() ? 0 : ::poll(ready, 2, most);
        } else {
          n = ::poll(ready, 1, most);
        }
        if (queue && ready[1].revents != 0) {
          std::uint64_t count = 0;
          (void)!::read(wake_.get(), &count, sizeof count);
        }
      }
      if (n < 0 && errno != EINTR)
        return error(ErrorCode::io, std::string("waiting failed: ") + std::strerror(errno));
      if (n > 0 && ready[0].revents != 0) return {};
    }
  }

  Result<void> send(Call& call, std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n =
          ::send(process_.socket(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (n > 0) {
        bytes.remove_prefix(static_cast<std::size_t>(n));
      } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
        RMP_TRY(wait(call, POLLOUT));
      } else if (errno != EINTR) {
        return death(call);
      }
    }
    return {};
  }

  Result<wire::Frame> next(Call& call) {
    for (;;) {
      auto frame = inbox_.take();
      if (!frame.ok()) return broken(call, frame.error().message);
      if (*frame) return std::move(**frame);
      RMP_TRY(wait(call, POLLIN));
      const ssize_t n = ::recv(process_.socket(), chunk_.data(), chunk_.size(), MSG_DONTWAIT);
      if (n > 0) inbox_.add({chunk_.data(), static_cast<std::size_t>(n)});
      else if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR))
        return death(call);
    }
  }

  // --- the conversation ---

  struct Request {
    wire::Ask ask{};
    std::string name;
    Value args;
  };
  static std::optional<Request> request_of(Value& v) {
    Map* const m = v.as_map();
    if (!m || m->size() != 3) return std::nullopt;
    const Value* ask = m->find("ask");
    const Value* name = m->find("name");
    Value* args = m->find("args");
    if (!ask || !ask->as_int() || *ask->as_int() < 0 || *ask->as_int() > wire::kLastAsk || !name ||
        !name->as_string() || !args)
      return std::nullopt;
    return Request{static_cast<wire::Ask>(*ask->as_int()), *name->as_string(), std::move(*args)};
  }

  /// Answers what the script asks until it is done, or, in a group, until the group is: then gives
  /// the value that ended it.
  Result<Value> converse(Call& call, int groups) {
    for (;;) {
      RMP_TRY_ASSIGN(wire::Frame frame, next(call));
      if (frame.kind == wire::Kind::print) {
        if (auto heard = hear(call, frame.value); !heard.ok()) return std::move(heard).error();
        continue;
      }
      if (frame.kind == wire::Kind::done && groups == 0) return std::move(frame.value);
      auto request = frame.kind == wire::Kind::request ? request_of(frame.value) : std::nullopt;
      if (!request) return broken(call, "a message arrived out of turn");
      if (request->ask == wire::Ask::end) {
        if (groups == 0) return broken(call, "a transaction ended without a beginning");
        return std::move(request->args);
      }
      auto result = request->ask == wire::Ask::begin ? run_group(call, *request, groups)
                                                     : run(call, *request);
      if (!process_.runs()) return std::move(result).error();
      RMP_TRY(answer(call, request->name, std::move(result)));
    }
  }

  Result<void> hear(Call& call, const Value& text) {
    const std::string* s = text.as_string();
    call.printed += s ? s->size() : 0;
    if (!s || call.printed > options_.limits.output)
      return broken(call, "it printed more than allowed");
    if (options_.print) options_.print(*s);
    else call.output += *s;
    return {};
  }

  Result<Value> run(Call& call, Request& r) {
    call.next_look = {};
    if (!look(call)) return death(call);
    if (call.stop != Stop::none) return stopped_request();
    ioci::Session& session = call.session;
    const Handle* handle = r.args.as_handle();
    switch (r.ask) {
      case wire::Ask::dispatch:
        if (!r.args.as_map()) return error(ErrorCode::usage, "a command needs named arguments");
        return app_.dispatch(session, r.name, *r.args.as_map());
      case wire::Ask::start: {
        if (!r.args.as_map()) return error(ErrorCode::usage, "a command needs named arguments");
        RMP_TRY_ASSIGN(Handle job, app_.dispatch_async(session, r.name, *r.args.as_map()));
        return Value(std::move(job));
      }
      case wire::Ask::classic:
        if (!r.args.as_string()) return error(ErrorCode::usage, "a classic line must be a text");
        return app_.dispatch_classic(session, *r.args.as_string());
      case wire::Ask::unknown:
        if (app_.commands.find(r.name)) return Value();
        return app_.commands.unknown(r.name);
      case wire::Ask::name_of: {
        if (!handle) return Value();
        auto name = app_.name_of(*handle, &session);
        return name ? Value(std::move(*name)) : Value();
      }
      case wire::Ask::describe: return handle ? Value(app_.describe(*handle, &session)) : Value();
      case wire::Ask::begin:
      case wire::Ask::end: break;
    }
    return error(ErrorCode::internal, "a request of unknown kind");
  }

  static Error stopped_request() {
    return error(ErrorCode::cancelled, "the script was interrupted");
  }

  /// Edits of a script that are one step, from its `begin` to its `end`.
  Result<Value> run_group(Call& call, const Request& r, int groups) {
    if (call.stop != Stop::none) return stopped_request();
    if (groups >= kDeepestGroup)
      return error(ErrorCode::usage,
                   "transactions are nested deeper than " + std::to_string(kDeepestGroup));
    const auto done =
        app_.transaction(call.session, r.name.substr(0, kLongestLabel), [&]() -> Result<void> {
          RMP_TRY(answer(call, r.name, Value()));
          RMP_TRY_ASSIGN(const Value ended, converse(call, groups + 1));
          if (ended.is_nil()) return {};
          return wire::error_from(ended);
        });
    if (!done.ok()) return done.error();
    return Value();
  }

  Result<void> answer(Call& call, const std::string& name, Result<Value> result) {
    Map out;
    if (result.ok()) out.set("value", std::move(*result));
    else out.set("error", wire::error_value(result.error()));
    if (call.session.interrupted() || call.stop != Stop::none) out.set("stop", true);
    if (app_.commands.revision() != revision_) out.set("commands", new_commands());
    Value said(std::move(out));
    auto frame = wire::frame(wire::Kind::answer, said, wire::kLongestAnswer);
    if (!frame) {
      said.as_map()->erase("value");
      said.as_map()->set(
          "error", wire::error_value(
                       error(ErrorCode::unsupported,
                             "the result of " + name.substr(0, kLongestLabel) + " is more than " +
                                 std::to_string(wire::kLongestAnswer >> 20) + " MiB or " +
                                 std::to_string(wire::kMostValues) +
                                 " values, the limit of one transfer to an untrusted script",
                             "Request less of it.")));
      frame = wire::frame(wire::Kind::answer, said, wire::kLongestAnswer);
    }
    if (!frame) return broken(call, "a reply is too long");
    return send(call, *frame);
  }

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  static constexpr bool kIsSanitized = true;
#else
  static constexpr bool kIsSanitized = false;
#endif
  static constexpr std::string_view kGone =
      "Its variables are lost; the next call starts a new process.";

  ioci::Application& app_;
  LuaChildOptions options_;
  Process process_;
  wire::Inbox inbox_{wire::kLongestRequest};
  std::array<char, 65536> chunk_{};
  const Descriptor wake_{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::set<const ioci::CommandSpec*> shown_;  ///< commands that the process knows
  std::uint64_t revision_ = 0;
  bool is_starting_ = false;
  bool has_namespaces_ = false;
  bool has_lost_ = false;  ///< variables, and nobody was told since
};

LuaChild::LuaChild(ioci::Application& app, LuaChildOptions options)
    : impl_(std::make_unique<Impl>(app, std::move(options))) {}
LuaChild::~LuaChild() = default;

Result<Map> LuaChild::eval(std::string_view code, ioci::Session& session) {
  constexpr std::string_view kNote =
      "The process of the script was ended before this call; its variables are lost.";
  const bool has_lost = impl_->take_lost();
  std::string output;
  auto done = impl_->call(Map{{"code", code}}, session, output);
  if (!done.ok()) {
    Error e = std::move(done).error();
    if (has_lost) e.hint += (e.hint.empty() ? "" : " ") + std::string(kNote);
    return e;
  }
  const Value* values = done->find("values");
  Map out =
      script_answer(values && values->as_list() ? *values->as_list() : List{}, std::move(output));
  if (impl_->options().print) out.erase("output");  // it was heard at once
  if (has_lost) out.set("note", kNote);
  return out;
}

Result<List> LuaChild::run_file(const std::filesystem::path& file,
                                std::span<const std::string> args, ioci::Session& session) {
  RMP_TRY_ASSIGN(const std::string code, lua::script_text(file));
  List words(args.begin(), args.end());
  std::string output;
  RMP_TRY_ASSIGN(
      const Map done,
      impl_->call(Map{{"code", code}, {"file", file.string()}, {"args", std::move(words)}}, session,
                  output));
  const Value* values = done.find("values");
  return values && values->as_list() ? *values->as_list() : List{};
}

const std::string& LuaChild::traceback() const { return impl_->traceback; }
std::optional<int> LuaChild::process() const { return impl_->process(); }
bool LuaChild::has_namespaces() const { return impl_->has_namespaces(); }

Result<LuaLimits> lua_limits(std::string_view text, LuaLimits otherwise) {
  LuaLimits out = otherwise;
  for (const std::string_view part : text::split(text, ',')) {
    const auto equals = part.find('=');
    const std::string_view name = text::trim(part.substr(0, equals));
    const std::string_view digits =
        equals == std::string_view::npos ? "" : text::trim(part.substr(equals + 1));
    const std::optional<double> value = text::read_real(digits);
    const auto between = [&](double least, double most) -> Result<double> {
      if (value && *value >= least && *value <= most) return *value;
      return error(ErrorCode::usage,
                   "the limit " + std::string(name) + " of untrusted scripts is " +
                       text::quote(std::string(digits)) + ", not a number from " +
                       text::print(least) + " to " + text::print(most),
                   "Write memory=512,cpu=30,wall=600,output=4 (MiB, s, s, MiB).");
    };
    constexpr double kMiB = 1 << 20;
    if (name == "memory") {
      RMP_TRY_ASSIGN(const double mib,
                     between(static_cast<double>(lua::kLeastMemory) / kMiB, 65536));
      out.memory = static_cast<std::uint64_t>(mib * kMiB);
    } else if (name == "cpu") {
      RMP_TRY_ASSIGN(out.cpu_seconds, between(0.01, 1e6));
    } else if (name == "wall") {
      RMP_TRY_ASSIGN(out.wall_seconds, between(0.01, 1e6));
    } else if (name == "output") {
      RMP_TRY_ASSIGN(const double mib, between(0, 1024));
      out.output = static_cast<std::size_t>(mib * kMiB);
    } else {
      return error(ErrorCode::usage,
                   "there is no limit " + text::quote(std::string(name)) + " of untrusted scripts",
                   "Write memory=512,cpu=30,wall=600,output=4 (MiB, s, s, MiB).");
    }
  }
  return out;
}

}  // namespace robomosp::remote
