// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_process/provider_process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <optional>
#include <utility>

#include <robomosp/sdk/files.h>

#include "kernel/app_lock.h"
#include "kernel/confined_process.h"
#include "kernel/process.h"
#include "kernel/provider_process/channel.h"
#include "kernel/provider_process/doors.h"
#include "kernel/provider_process/proxies.h"
#include "kernel/provider_process/spawner.h"
#include "kernel/text.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace robomosp {

namespace fs = std::filesystem;
using namespace apart;

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kLook = 10;  ///< how often a call that lasts is looked at [ms]
/// How long a provider that was told to stop may take [s].
constexpr double kGrace = 2;
constexpr std::size_t kMostChannels = 256;  ///< calls at once
constexpr std::size_t kTail = 2000;         ///< of what it printed last [bytes]
constexpr std::uint64_t kLeastMemory = std::uint64_t{256} << 20;
constexpr std::string_view kAnew = "The next call starts it anew.";

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  void set(int fd) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = fd;
  }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

/// One process.
class Running {
 public:
  ~Running() { end(); }

  int pid = 0;
  std::uint64_t generation = 0;
  Descriptor socket, printed;

  bool send(const Control& control, int descriptor = -1) {
    iovec part{const_cast<Control*>(&control), sizeof control};
    alignas(cmsghdr) char space[CMSG_SPACE(sizeof(int))]{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    if (descriptor >= 0) {
      message.msg_control = space;
      message.msg_controllen = sizeof space;
      cmsghdr* head = CMSG_FIRSTHDR(&message);
      head->cmsg_level = SOL_SOCKET;
      head->cmsg_type = SCM_RIGHTS;
      head->cmsg_len = CMSG_LEN(sizeof(int));
      std::memcpy(CMSG_DATA(head), &descriptor, sizeof descriptor);
    }
    return ::sendmsg(socket.get(), &message, MSG_NOSIGNAL | MSG_DONTWAIT) ==
           static_cast<ssize_t>(sizeof control);
  }

  /// One that nobody uses; the error says why there is none.
  Result<std::unique_ptr<Channel>> take(std::uint64_t most) {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        auto one = std::move(idle_.back());
        idle_.pop_back();
        return one;
      }
      if (channels_ >= kMostChannels)
        return error(ErrorCode::unsupported,
                     "it is called " + std::to_string(kMostChannels) + " times at once already",
                     "Run less at once.");
      ++channels_;
    }
    RMP_TRY_ASSIGN(auto made, Channel::make(most));
    // Packets that it has not taken fill the socket.
    const auto end = Clock::now() + std::chrono::seconds(10);
    while (!send({Control::What::channel, 0}, made->descriptor())) {
      if ((errno != EAGAIN && errno != ENOBUFS) || Clock::now() > end) break;  // it is at its end
      ::usleep(1000);
    }
    return made;
  }
  void give(std::unique_ptr<Channel> channel) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(channel));
  }

  /// Whether it runs; what it ended with is kept for end().
  [[nodiscard]] bool runs() {
    const std::lock_guard lock(mutex_);
    if (pid <= 0 || is_ended_) return false;
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(pid), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == 0;
  }
  /// Ends it, if it has not ended; gives its exit status.
  int end() {
    const std::lock_guard lock(mutex_);
    if (pid <= 0 || is_ended_) return status_;
    ::kill(-pid, SIGKILL);
    ::kill(pid, SIGKILL);
    while (::waitpid(pid, &status_, 0) < 0 && errno == EINTR) {
    }
    is_ended_ = true;
    return status_;
  }
  /// Takes what it printed.
  void listen() {
    const std::lock_guard lock(mutex_);
    std::array<char, 4096> part;
    for (int i = 0; i < 64; ++i) {
      const ssize_t n = ::read(printed.get(), part.data(), part.size());
      if (n <= 0) return;
      tail_.append(part.data(), static_cast<std::size_t>(n));
      if (tail_.size() > kTail) tail_.erase(0, tail_.size() - kTail);
    }
  }
  /// Keeps what ended it; gives what did before.
  std::string ended_by(const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (!ended_by_.empty()) return ended_by_;
    ended_by_ = what;
    return {};
  }
  /// Its last line.
  [[nodiscard]] std::string last_words() {
    listen();
    const std::lock_guard lock(mutex_);
    std::string_view all = text::trim(tail_);
    if (const auto at = all.rfind('\n'); at != std::string_view::npos) all.remove_prefix(at + 1);
    std::string out;
    for (const char c : all.substr(0, 300)) out += c >= ' ' && c <= '~' ? c : ' ';
    return out;
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Channel>> idle_;  // guarded by mutex_
  std::size_t channels_ = 0;                    // guarded by mutex_
  bool is_ended_ = false;                       // guarded by mutex_
  int status_ = 0;                              // guarded by mutex_
  std::string tail_, ended_by_;                 // guarded by mutex_
};

enum class Why { died, hung, cancelled, lied };

class Conversing;
thread_local const Conversing* t_conversing = nullptr;
thread_local Progress* t_progress = nullptr;
thread_local std::uint64_t t_generation = 0;

/// A call of this thread, and those that it is within: an object that is lent for a call is there
/// for all that this one leads to.
class Conversing {
 public:
  Conversing(const void* conversation, Progress* progress, std::uint64_t generation)
      : conversation_(conversation),
        before_(std::exchange(t_conversing, this)),
        progress_(std::exchange(t_progress, progress)),
        generation_(std::exchange(t_generation, generation)) {}
  ~Conversing() {
    t_generation = generation_;
    t_conversing = before_;
    t_progress = progress_;
  }
  Conversing(const Conversing&) = delete;
  Conversing& operator=(const Conversing&) = delete;
  [[nodiscard]] const void* conversation() const { return conversation_; }
  [[nodiscard]] static bool is_within(const void* conversation) {
    for (const Conversing* c = t_conversing; c; c = c->before_)
      if (c->conversation_ == conversation) return true;
    return false;
  }

 private:
  const void* conversation_;
  const Conversing* before_;
  Progress* progress_;
  std::uint64_t generation_;
};

/// A message that was kept, said again.
class Again final : public Exchange {
 public:
  explicit Again(const std::string& bytes) : bytes_(bytes) {}
  void measure(Sizer& v) override { v.bytes(bytes_.data(), bytes_.size()); }
  void write(Writer& v) override { v.bytes(bytes_.data(), bytes_.size()); }
  void read(Reader& r) override {
    fields(r, outcome);
    if (outcome == Outcome::fault) {
      fields(r, fault);
    } else if (outcome == Outcome::done) {
      if (!wants_object) return;
      bool has = false;
      fields(r, has);
      fields(r, object);
    } else {
      fault.code = ErrorCode::plugin_failed;
      fault.message = "it threw";
    }
  }
  bool wants_object = false;
  std::uint64_t object = 0;
  Outcome outcome = Outcome::misread;
  Error fault;

 private:
  const std::string& bytes_;
};

}  // namespace

class ProviderProcess::Impl final : public Peer, private HostDoor {
 public:
  Impl(fs::path plugin, ApartLimits limits, const rmp_host* host, ParamNames params)
      : plugin_(std::move(plugin)), limits_(limits), host_(host), params_(std::move(params)) {
    limits_.memory = std::max(limits_.memory, kLeastMemory);
    limits_.seconds = std::clamp(limits_.seconds, 0.01, 1e6);
    (void)table_.add({static_cast<HostDoor*>(this), &Methods<HostDoor>::serve, nullptr, nullptr,
                      nullptr, nullptr});
  }

  std::shared_ptr<Remote> door() {
    auto out = std::make_shared<Remote>();
    out->peer = shared_from_this();
    out->is_borrowed = true;
    out->name = plugin_.filename().string();
    out->id = kDoor;
    out->generation = kAnyGeneration;
    return out;
  }
  [[nodiscard]] const fs::path& plugin() const { return plugin_; }
  [[nodiscard]] const ApartLimits& limits() const { return limits_; }
  [[nodiscard]] std::uint64_t starts() const {
    const std::lock_guard lock(mutex_);
    return starts_;
  }
  [[nodiscard]] int process() const {
    const std::lock_guard lock(mutex_);
    return running_ && running_->runs() ? running_->pid : 0;
  }
  void end() {
    std::shared_ptr<Running> gone;
    const std::lock_guard lock(mutex_);
    gone = std::move(running_);
    if (gone) gone->end();
  }

  /// Makes sure that an object is there in the process that runs.
  Result<void> ensure(Remote& r) {
    RMP_TRY_ASSIGN(const auto running, run());
    return ensure(*running, r);
  }

  // --- Peer ---

  Result<void> exchange(Remote& object, std::uint32_t method, Exchange& e) override {
    AppLock::expect_free();
    RMP_TRY_ASSIGN(const auto running, run());
    RMP_TRY(ensure(*running, object));
    for (Remote* r : e.also) RMP_TRY(ensure(*running, *r));
    std::uint64_t id = 0;
    {
      const std::lock_guard lock(object.mutex);
      id = object.id;
    }
    return converse(*running, object, id, method, e);
  }
  std::uint64_t lend(void* object, Serve kind, std::shared_ptr<void> owner,
                     bool is_for_call) override {
    return table_.add({object, kind, nullptr, std::move(owner),
                       is_for_call ? lending_scope_of_thread() : nullptr, nullptr});
  }
  void take_back(std::uint64_t lent) override { table_.erase(lent); }
  std::shared_ptr<void> own(std::uint64_t lent, Serve kind) override {
    const Table::Entry e = table_.find(lent);
    if (e.serve != kind || !e.object) return nullptr;
    return e.owner ? e.owner : std::shared_ptr<void>(std::shared_ptr<void>(), e.object);
  }
  void release(std::uint64_t object, std::uint64_t generation) override {
    std::shared_ptr<Running> running;
    {
      const std::lock_guard lock(mutex_);
      running = running_;
    }
    if (!running || running->generation != generation || !running->runs()) return;
    const Control control{Control::What::release, object};
    for (int i = 0; i < 100 && !running->send(control); ++i) {
      if (errno != EAGAIN && errno != ENOBUFS) return;
      ::usleep(1000);  // it takes them one by one
    }
  }
  Progress& progress() override {
    static NoProgress none;
    return t_progress ? *t_progress : none;
  }
  [[nodiscard]] std::uint64_t generation() const override { return t_generation; }

 private:
  static constexpr std::uint64_t kAnyGeneration = ~std::uint64_t{0};
  static const void* lending_scope_of_thread() {
    return t_conversing ? t_conversing->conversation() : nullptr;
  }

  // --- the process ---

  Result<std::shared_ptr<Running>> run() {
    const std::lock_guard lock(mutex_);
    if (running_ && running_->runs()) return running_;
    running_ = nullptr;
    RMP_TRY_ASSIGN(running_, start());
    return running_;
  }

  /// With mutex_ held.
  Result<std::shared_ptr<Running>> start() {
    auto out = std::make_shared<Running>();
    int pair[2], pipe[2];
    const auto failed = [] {
      return error(ErrorCode::io,
                   std::string("no process could be prepared: ") + std::strerror(errno),
                   "Close other programs, or raise the limits of the system, and try again.");
    };
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) != 0) return failed();
    out->socket.set(pair[0]);
    const Descriptor theirs(pair[1]);
    if (::pipe2(pipe, O_CLOEXEC | O_NONBLOCK) != 0) return failed();
    out->printed.set(pipe[0]);
    const Descriptor prints(pipe[1]);
    std::filesystem::path program = helper_program("robomosp-provider");
    std::vector<std::string> words;
    if (limits_.confined) {
      if (!can_confine_processes())
        return error(ErrorCode::unsupported,
                     "this system cannot keep the plugin's process from files (Landlock)",
                     "Use Linux 5.13 or later with Landlock, or allow it with confined = false.",
                     "plugin " + text::quote(plugin_.string()));
      words = {"confine"};
      for (const char* read : {"/usr/share", "/etc/localtime", "/etc/fonts", "/sys/devices/system",
                               "/proc/self", "/proc/cpuinfo", "/proc/meminfo", "/proc/stat"})
        words.insert(words.end(), {"read", read});
      words.insert(words.end(), {"code", plugin_.parent_path().string(), "run", program.string()});
      program = helper_program("robomosp-importer");
    }
    words.insert(words.end(), {plugin_.string(), std::to_string(limits_.memory),
                               std::to_string(static_cast<long>(::getpid())),
                               limits_.confined ? "confined" : "free"});
    RMP_TRY_ASSIGN(
        out->pid, spawn_for_good(std::move(program), std::move(words), theirs.get(), prints.get()));
    out->generation = ++starts_;
    return out;
  }

  /// Why a call got no answer. The process is at its end then.
  Error death(Running& running, const std::string& name, Why why) {
    const int status = running.end();
    {
      const std::lock_guard lock(mutex_);
      if (running_.get() == &running) running_ = nullptr;
    }
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    const char* abbreviated = signal ? ::sigabbrev_np(signal) : nullptr;
    std::string what;
    ErrorCode code = ErrorCode::plugin_failed;
    if (why == Why::hung) {
      what = "did not answer for " + text::print_rounded(limits_.seconds, 4) +
             " s, and its process was ended";
    } else if (why == Why::cancelled) {
      code = ErrorCode::cancelled;
      what = "did not stop when it was cancelled, and its process was ended";
    } else if (why == Why::lied) {
      what = "sent an invalid reply, and its process was ended";
    } else if (signal == SIGKILL) {
      what = "ended: its process was killed from outside, as the system does when memory is short";
    } else if (signal == SIGSYS) {
      what = "ended: its process made a call of the system that it may not make";
    } else if (signal) {
      what = "crashed (signal " +
             (abbreviated ? "SIG" + std::string(abbreviated) : std::to_string(signal)) +
             ") in its process";
    } else {
      what = "ended its process (exit code " + std::to_string(WEXITSTATUS(status)) + ")";
    }
    if (const std::string before = running.ended_by(name + "\" " + what); !before.empty())
      what = "was interrupted, since its process is gone: provider \"" + before;
    const std::string last = running.last_words();
    return error(code,
                 "provider " + text::quote(name) + " of the plugin " +
                     text::quote(plugin_.string()) + " " + what +
                     (last.empty() ? "" : "; it printed " + text::quote(last)),
                 std::string(kAnew));
  }

  Result<void> ensure(Running& running, Remote& r) {
    const std::lock_guard lock(r.mutex);
    if (r.generation == kAnyGeneration || (r.id && r.generation == running.generation)) return {};
    if (!r.lost.empty())
      return error(
          ErrorCode::plugin_failed,
          "provider " + text::quote(r.name) + " cannot continue in a new process: " + r.lost,
          "Run what made it again.");
    std::uint64_t id = 0;
    if (r.maker) {
      RMP_TRY(ensure(running, *r.maker));
      Again again(r.make_bytes);
      again.wants_object = true;
      std::uint64_t maker = 0;
      {
        const std::lock_guard maker_lock(r.maker->mutex);
        maker = r.maker->id;
      }
      RMP_TRY(converse(running, r, maker, r.make_method, again));
      if (again.outcome != Outcome::done) return std::move(again.fault);
      id = again.object;
    } else {
      RMP_TRY_ASSIGN(id, (apart::call<&PluginDoor::create>(door(), r.row)));
    }
    if (r.is_prepared) {
      Again again(r.prepare_bytes);
      RMP_TRY(converse(running, r, id, r.prepare_method, again));
      if (again.outcome != Outcome::done) return std::move(again.fault);
    }
    r.id = id;
    r.generation = running.generation;
    return {};
  }

  // --- conversations ---

  Result<void> converse(Running& running, Remote& object, std::uint64_t id, std::uint32_t method,
                        Exchange& e) {
    RMP_TRY_ASSIGN(auto channel, running.take(limits_.memory));
    const std::uint64_t top = channel->top();
    std::vector<std::uint64_t> lent;
    Result<void> done = [&]() -> Result<void> {
      try {
        return converse(running, *channel, object, id, method, e, lent);
      } catch (const std::bad_alloc&) {
        (void)death(running, object.name, Why::lied);
        return error(
            ErrorCode::plugin_failed,
            "there is not enough memory for the data of provider " + text::quote(object.name),
            "Work on less at once.");
      }
    }();
    for (const std::uint64_t l : lent) table_.erase(l);
    // If the process is at its end, so are its channels.
    channel->set_top(top);
    running.give(std::move(channel));
    return done;
  }

  Result<void> converse(Running& running, Channel& channel, Remote& object, std::uint64_t id,
                        std::uint32_t method, Exchange& e, std::vector<std::uint64_t>& lent) {
    const Conversing conversing(&channel, e.progress, running.generation);
    Sizer sizer;
    e.measure(sizer);
    char* place = channel.place(sizer.size());
    if (!place)
      return error(ErrorCode::unsupported,
                   "the data for provider " + text::quote(object.name) + " are " +
                       std::to_string(sizer.size() >> 20) + " MiB, more than its process may have",
                   "Give its plugin more memory, or work on less at once.");
    Writer writer(*this, place, sizer.size());
    writer.is_lasting = e.is_lasting;
    writer.is_in_out = e.is_in_out;
    e.write(writer);
    if (e.is_lasting) object.lent.insert(object.lent.end(), writer.lent.begin(), writer.lent.end());
    else lent = writer.lent;
    if (!writer.lent.empty() && !e.is_lasting) e.lends = true;
    if (e.keep) e.keep->assign(place, sizer.size());
    Shared& shared = channel.shared();
    shared.cancelled.store(e.progress && e.progress->cancelled() ? 1 : 0);
    std::uint32_t told = shared.told.load();
    channel.post(Kind::call, id, method, sizer.size());
    Limits limits(*this);
    for (;;) {
      while (!channel.wait(kLook))
        if (const auto why = look(running, shared, told, limits, e.progress)) {
          if (*why == Why::died && channel.wait(0)) break;  // its last word
          return death(running, object.name, *why);
        }
      report(shared, told, e.progress);
      Message message;
      if (!channel.receive(message)) return death(running, object.name, Why::lied);
      if (message.kind == Kind::call) {
        serve(channel, message);
        limits.restart();
        // One that asks without a pause is never waited for: it hears of the end here.
        if (hear(shared, limits, e.progress)) return death(running, object.name, Why::cancelled);
        continue;
      }
      Reader reader(*this, message.bytes, message.size, true);
      e.read(reader);
      if (reader.is_broken()) return death(running, object.name, Why::lied);
      writer.take_back();
      return {};
    }
  }

  struct Limits {
    explicit Limits(const Impl& impl) : seconds(impl.limits_.seconds) { restart(); }
    void restart() { end = Clock::now() + of(seconds); }
    static Clock::duration of(double s) {
      return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
    }
    double seconds;
    Clock::time_point end{};
    bool is_told = false;  ///< to stop
    Clock::time_point stop_end{};
  };

  /// Looks at a call that lasts; says why it has to end.
  static std::optional<Why> look(Running& running, Shared& shared, std::uint32_t& told,
                                 Limits& limits, Progress* progress) {
    running.listen();
    if (!running.runs()) return Why::died;
    if (report(shared, told, progress)) limits.restart();
    if (hear(shared, limits, progress)) return Why::cancelled;
    if (Clock::now() > limits.end) return Why::hung;
    return std::nullopt;
  }
  /// Tells the process that the call is to stop; whether it was told and has not stopped in time.
  static bool hear(Shared& shared, Limits& limits, Progress* progress) {
    if (limits.is_told) return Clock::now() > limits.stop_end;
    if (!progress || !progress->cancelled()) return false;
    shared.cancelled.store(1);
    limits.is_told = true;
    limits.stop_end = Clock::now() + Limits::of(kGrace);
    return false;
  }
  /// Hands on what it told of its progress.
  static bool report(Shared& shared, std::uint32_t& told, Progress* progress) {
    const std::uint32_t now = shared.told.load();
    if (now == told || now % 2 != 0) return false;
    const double share = shared.share;
    std::array<char, sizeof shared.what> what;
    const std::size_t size = std::min<std::size_t>(shared.what_size, what.size());
    std::memcpy(what.data(), shared.what, what.size());
    if (shared.told.load() != now) return false;  // it is told anew: next time
    told = now;
    if (progress) progress->report(share, std::string_view(what.data(), size));
    return true;
  }

  /// Answers a question of the process.
  void serve(Channel& channel, const Message& message) {
    Answering out(*this, table_, channel, message.object,
                  "the answer is more than the process may have");
    const Table::Entry entry = table_.find(message.object);
    if (!entry.object || (entry.scope && !Conversing::is_within(entry.scope))) {
      FaultReply gone(Outcome::threw, "the object of the call no longer exists");
      return out.send(gone);
    }
    std::unique_lock<std::recursive_mutex> turn;
    if (entry.in_turn) turn = std::unique_lock(*entry.in_turn);
    Reader reader(*this, message.bytes, message.size, true);
    // What lasts is reported by the provider itself.
    class Quiet final : public Progress {
     public:
      void report(double, std::string_view) override {}
      [[nodiscard]] bool cancelled() const override {
        return t_progress && t_progress->cancelled();
      }
    } quiet;
    entry.serve(entry.object, message.method, reader, quiet, out);
  }

  // --- HostDoor ---

  void log(std::int32_t severity, const std::string& source, const std::string& words) override {
    if (host_->log) host_->log(severity, source.c_str(), words.c_str());
  }
  Result<CreatedWire> create(const std::string& interface_id, const std::string& name) override {
    const InterfaceWire* wire = interface_wire(interface_id);
    if (!wire) return error(ErrorCode::unsupported, not_apart(interface_id));
    std::array<char, 512> why{};
    void* made = host_->create ? host_->create(interface_id.c_str(), name.c_str(), why.data(),
                                               static_cast<std::uint32_t>(why.size()))
                               : nullptr;
    if (!made) return error(ErrorCode::plugin_failed, why.data());
    CreatedWire out;
    out.id = table_.add({made, wire->serve, nullptr, wire->own(made), nullptr,
                         std::make_shared<std::recursive_mutex>()});
    out.interface_id = interface_id;
    out.name = name;
    if (params_) out.params = params_(interface_id, name);
    return out;
  }
  std::vector<std::pair<std::string, std::string>> list(const std::string& interface_id) override {
    std::vector<std::pair<std::string, std::string>> out;
    if (host_->list)
      host_->list(interface_id.c_str(), &out, [](void* to, const char* name, const char* tags) {
        static_cast<decltype(out)*>(to)->emplace_back(name ? name : "", tags ? tags : "");
      });
    return out;
  }
  [[nodiscard]] const rmp_files* files() const {
    return host_->extension ? static_cast<const rmp_files*>(host_->extension(RMP_FILES)) : nullptr;
  }
  std::int32_t file_kind(const std::string& path) override {
    return files() ? files()->kind(path.c_str()) : 0;
  }
  Result<std::string> file_read(const std::string& path, std::uint64_t most) override {
    if (!files()) return error(ErrorCode::unsupported, "this program hands out no files");
    std::string out;
    std::array<char, 512> why{};
    const auto failed = files()->read(
        path.c_str(), std::min(most, limits_.memory), &out,
        [](void* to, const char* bytes, std::uint64_t size) {
          static_cast<std::string*>(to)->assign(bytes, size);
        },
        why.data(), static_cast<std::uint32_t>(why.size()));
    if (failed) return error(ErrorCode::io, why.data());
    return out;
  }
  Result<ProgramDone> run(const ProgramWire& asked) override {
    if (limits_.confined || !host_->run)
      return error(ErrorCode::permission, "a plugin in a separate process may not start programs",
                   "Allow it with confined = false where the plugin is loaded.");
    struct Heard {
      ProgramDone done;
      Progress* progress;
    } heard{{}, t_progress};
    std::vector<const char*> words;
    for (const std::string& w : asked.arguments) words.push_back(w.c_str());
    rmp_program p{};
    p.struct_size = sizeof p;
    p.name = asked.name.c_str();
    p.arguments = words.data();
    p.argument_count = static_cast<std::uint32_t>(words.size());
    p.input = asked.input.data();
    p.input_size = asked.input.size();
    p.seconds = asked.seconds;
    p.memory = asked.memory;
    p.most_output = asked.most_output;
    p.context = &heard;
    p.output = [](void* to, const char* bytes, std::uint64_t size) {
      static_cast<Heard*>(to)->done.output.assign(bytes, size);
    };
    p.line = [](void* to, const char* bytes, std::uint64_t size) {
      static_cast<Heard*>(to)->done.lines.emplace_back(bytes, size);
    };
    p.cancelled = [](void* to) -> std::int32_t {
      auto* progress = static_cast<Heard*>(to)->progress;
      return progress && progress->cancelled() ? 1 : 0;
    };
    std::array<char, 1024> why{};
    const auto failed = host_->run(&p, why.data(), static_cast<std::uint32_t>(why.size()));
    if (failed == 1) return error(ErrorCode::cancelled, "stopped");
    if (failed) return error(ErrorCode::plugin_failed, why.data());
    return std::move(heard.done);
  }
  void release(std::uint64_t lent) override {
    if (lent != kDoor && table_.find(lent).owner) table_.erase(lent);
  }

  const fs::path plugin_;
  ApartLimits limits_;
  const rmp_host* host_;
  ParamNames params_;
  Table table_;
  mutable std::mutex mutex_;
  std::shared_ptr<Running> running_;  // guarded by mutex_
  std::uint64_t starts_ = 0;          // guarded by mutex_
};

ProviderProcess::ProviderProcess(fs::path plugin, ApartLimits limits, const rmp_host* host,
                                 ParamNames params)
    : impl_(std::make_shared<Impl>(std::move(plugin), limits, host, std::move(params))) {}
ProviderProcess::~ProviderProcess() = default;

Result<PluginWire> ProviderProcess::describe() {
  return apart::call<&PluginDoor::describe>(impl_->door());
}

Result<void*> ProviderProcess::create(std::uint32_t row, const std::string& interface_id,
                                      const std::string& name, std::vector<std::string> params) {
  const InterfaceWire* wire = interface_wire(interface_id);
  if (!wire) return error(ErrorCode::unsupported, not_apart(interface_id));
  auto remote = std::make_shared<Remote>();
  remote->peer = impl_;
  remote->name = name;
  remote->params = std::move(params);
  remote->row = row;
  RMP_TRY(impl_->ensure(*remote));
  return wire->proxy(std::move(remote));
}

void ProviderProcess::end() { impl_->end(); }
int ProviderProcess::process() const { return impl_->process(); }
std::uint64_t ProviderProcess::starts() const { return impl_->starts(); }
const ApartLimits& ProviderProcess::limits() const { return impl_->limits(); }

}  // namespace robomosp
