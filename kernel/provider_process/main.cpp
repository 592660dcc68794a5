// SPDX-License-Identifier: Apache-2.0
// The program robomosp-provider FILE MEMORY PARENT confined|free: opens one plugin and serves its
// providers to the program that started it, which is at the other end of descriptor 0
// (kernel/provider_process/provider_process.h).
#include <dlfcn.h>
#include <malloc.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <robomosp/sdk/files.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/threads.h>

#include "kernel/executor.h"
#include "kernel/interface_adapters.h"
#include "kernel/plugin_entry.h"
#include "kernel/provider_process/channel.h"
#include "kernel/provider_process/doors.h"
#include "kernel/provider_process/lock.h"
#include "kernel/provider_process/proxies.h"

namespace robomosp::apart {
namespace {

constexpr std::uint32_t kMostRows = 4096;

/// What a thread serves: it asks the program over the same channel, and so do those that help it.
struct Conversation {
  Channel& channel;
  std::mutex mutex;  ///< one question at a time
};
thread_local Conversation* t_conversation = nullptr;

class ChannelProgress final : public Progress {
 public:
  void report(double share, std::string_view what) override {
    Conversation* c = t_conversation;
    if (!c) return;
    const std::lock_guard lock(mutex_);
    Shared& s = c->channel.shared();
    s.told.fetch_add(1);
    s.share = share;
    s.what_size = static_cast<std::uint32_t>(std::min(what.size(), sizeof s.what));
    std::memcpy(s.what, what.data(), s.what_size);
    s.told.fetch_add(1);
  }
  [[nodiscard]] bool cancelled() const override {
    const Conversation* c = t_conversation;
    return c && c->channel.shared().cancelled.load(std::memory_order_relaxed) != 0;
  }

 private:
  std::mutex mutex_;
};

class Process final : public Peer, private PluginDoor {
 public:
  Process(std::string file) : file_(std::move(file)) {
    (void)table_.add({static_cast<PluginDoor*>(this), &Methods<PluginDoor>::serve, nullptr, nullptr,
                      nullptr, nullptr});
  }
  void start() {
    host_ = std::make_shared<Remote>();
    host_->peer = shared_from_this();
    host_->id = kDoor;
    host_->is_borrowed = true;
  }
  [[nodiscard]] const std::shared_ptr<Remote>& host() const { return host_; }

  /// Serves one channel for good.
  void serve(Channel& channel) {
    Conversation conversation{channel, {}};
    t_conversation = &conversation;
    for (;;) {
      const std::uint64_t top = channel.top();
      Message message;
      if (!channel.wait(-1) || !channel.receive(message) || message.kind != Kind::call) ::_exit(3);
      const Table::Entry entry = table_.find(message.object);
      Answering out(*this, table_, channel, message.object,
                    "the answer is longer than the memory there is");
      if (!entry.object) {
        FaultReply gone(Outcome::threw, "the object of the call no longer exists");
        out.send(gone);
      } else {
        Reader reader(*this, message.bytes, message.size, false);
        entry.serve(entry.object, message.method, reader, progress_, out);
      }
      channel.set_top(top);
    }
  }
  void erase(std::uint64_t id) {
    if (id != kDoor) table_.erase(id);
  }

  // --- Peer ---

  Result<void> exchange(Remote& object, std::uint32_t method, Exchange& e) override {
    Conversation* c = t_conversation;
    if (!c)
      return error(ErrorCode::plugin_failed,
                   "the plugin calls the program from a thread that serves no call",
                   "Call it within a call, or on threads of Host::spread().");
    std::vector<std::uint64_t> gone;
    {
      const std::lock_guard lock(mutex_);
      gone.swap(released_);
    }
    for (std::uint64_t id : gone) apart::call<&HostDoor::release>(host_, id);
    const std::lock_guard lock(c->mutex);
    Channel& channel = c->channel;
    const std::uint64_t top = channel.top();
    Sizer sizer;
    e.measure(sizer);
    char* place = channel.place(sizer.size());
    if (!place)
      return error(ErrorCode::unsupported,
                   "a call to the program is longer than the shared memory");
    Writer writer(*this, place, sizer.size());
    writer.is_lasting = e.is_lasting;
    writer.is_in_out = e.is_in_out;
    e.write(writer);
    if (e.is_lasting) object.lent.insert(object.lent.end(), writer.lent.begin(), writer.lent.end());
    channel.post(Kind::call, object.id, method, sizer.size());
    Message message;
    if (!channel.wait(-1) || !channel.receive(message) || message.kind != Kind::answer) ::_exit(3);
    Reader reader(*this, message.bytes, message.size, false);
    e.read(reader);
    writer.take_back();
    if (!e.is_lasting)
      for (const std::uint64_t l : writer.lent) table_.erase(l);
    channel.set_top(top);
    if (reader.is_broken()) return error(ErrorCode::internal, "an answer was cut off");
    return {};
  }
  std::uint64_t lend(void* object, Serve kind, std::shared_ptr<void> owner, bool) override {
    return table_.add({object, kind, nullptr, std::move(owner), nullptr, nullptr});
  }
  void take_back(std::uint64_t lent) override { table_.erase(lent); }
  std::shared_ptr<void> own(std::uint64_t lent, Serve kind) override {
    const Table::Entry e = table_.find(lent);
    if (e.serve != kind || !e.object) return nullptr;
    return e.owner ? e.owner : std::shared_ptr<void>(std::shared_ptr<void>(), e.object);
  }
  void release(std::uint64_t object, std::uint64_t) override {
    const std::lock_guard lock(mutex_);
    released_.push_back(object);  // said with the next question
  }
  Progress& progress() override { return progress_; }
  [[nodiscard]] std::uint64_t generation() const override { return 1; }

 private:
  // --- PluginDoor ---

  Result<const rmp_plugin*> plugin() {
    std::call_once(opened_, [this] { plugin_.emplace(open_plugin(file_)); });
    return *plugin_;
  }
  Result<PluginWire> describe() override {
    RMP_TRY_ASSIGN(const rmp_plugin* p, plugin());
    const auto text = [](const char* s) { return std::string(s ? s : ""); };
    PluginWire out{text(p->id), text(p->version), text(p->license), text(p->summary), {}};
    for (std::uint32_t i = 0; i < p->provider_count; ++i) {
      const rmp_provider& row = rmp_provider_at(*p, i);
      ProviderWire& w = out.providers.emplace_back();
      w.interface_id = text(row.interface_id);
      w.name = text(row.name);
      w.summary = text(row.summary);
      w.tags = text(row.tags);
      if (!row.create) {
        w.fault = "it has no create function";
      } else if (has_broken_parameters(row)) {
        w.fault = "its parameter table is broken";
      } else {
        for (std::uint32_t k = 0; k < row.param_count; ++k) {
          const rmp_param r = rmp_param_at(row, k);
          RowWire& to = w.params.emplace_back();
          to = {text(r.name), text(r.type), text(r.unit), text(r.doc), text(r.label), text(r.group),
                {},           {},           r.min,        r.max,       r.flags};
          if (r.default_text) to.default_text = r.default_text;
          if (r.choices) to.choices = r.choices;
        }
      }
    }
    return out;
  }
  Result<std::uint64_t> create(std::uint32_t index) override;

  const std::string file_;
  Table table_;
  std::shared_ptr<Remote> host_;
  ChannelProgress progress_;
  std::once_flag opened_;
  std::optional<Result<const rmp_plugin*>> plugin_;
  std::mutex mutex_;
  std::vector<std::uint64_t> released_;  // guarded by mutex_
};

// --- rmp_host, which has no context ---

Process* g_process = nullptr;

void say(char* to, std::uint32_t size, std::string_view words) {
  if (!to || size == 0) return;
  const std::size_t n = std::min<std::size_t>(size - 1, words.size());
  std::memcpy(to, words.data(), n);
  to[n] = '\0';
}

/// Nothing may be thrown into a plugin's C functions.
template <class Call>
auto shielded(Call&& what, decltype(what()) otherwise) -> decltype(what()) {
  try {
    return what();
  } catch (...) {
    return otherwise;
  }
}

void host_log(std::int32_t severity, const char* source, const char* words) {
  const std::string from = source ? source : "plugin", text = words ? words : "";
  (void)shielded(
      [&] {
        if (t_conversation) call<&HostDoor::log>(g_process->host(), severity, from, text);
        else std::fprintf(stderr, "%s: %s\n", from.c_str(), text.c_str());
        return 0;
      },
      0);
}

std::int32_t host_run(const rmp_program* p, char* error_text, std::uint32_t error_size) {
  return shielded(
      [&]() -> std::int32_t {
        if (!p || !RMP_HAS(p, cancelled) || !p->name || !p->output ||
            (p->argument_count && !p->arguments) || (p->input_size && !p->input)) {
          say(error_text, error_size, "its rmp_program is not filled in");
          return 2;
        }
        ProgramWire wire;
        wire.name = p->name;
        if (p->input_size) wire.input.assign(p->input, p->input_size);
        for (std::uint32_t i = 0; i < p->argument_count; ++i)
          wire.arguments.emplace_back(p->arguments[i] ? p->arguments[i] : "");
        wire.seconds = p->seconds;
        wire.memory = p->memory;
        wire.most_output = p->most_output;
        const auto done = call<&HostDoor::run>(g_process->host(), wire);
        if (!done.ok()) {
          say(error_text, error_size, done.error().sentence());
          return done.error().code == ErrorCode::cancelled ? 1 : 2;
        }
        if (p->line)
          for (const std::string& l : done->lines) p->line(p->context, l.data(), l.size());
        p->output(p->context, done->output.data(), done->output.size());
        return 0;
      },
      2);
}

void* host_create(const char* interface_id, const char* name, char* error_text,
                  std::uint32_t error_size) {
  return shielded(
      [&]() -> void* {
        const std::string id = interface_id ? interface_id : "", which = name ? name : "";
        auto made = call<&HostDoor::create>(g_process->host(), id, which);
        const InterfaceWire* wire = made.ok() ? interface_wire(made->interface_id) : nullptr;
        if (!wire) {
          say(error_text, error_size, made.ok() ? not_apart(id) : made.error().sentence());
          return nullptr;
        }
        auto remote = std::make_shared<Remote>();
        remote->peer = g_process->shared_from_this();
        remote->id = made->id;
        remote->generation = 1;
        remote->name = made->name;
        remote->params = std::move(made->params);
        auto proxy = wire->proxy(std::move(remote));
        if (proxy.ok()) return *proxy;
        say(error_text, error_size, proxy.error().sentence());
        return nullptr;
      },
      nullptr);
}

void host_list(const char* interface_id, void* context,
               void (*take)(void* context, const char* name, const char* tags)) {
  (void)shielded(
      [&] {
        const std::string id = interface_id ? interface_id : "";
        if (take)
          for (const auto& [name, tags] : call<&HostDoor::list>(g_process->host(), id))
            take(context, name.c_str(), tags.c_str());
        return 0;
      },
      0);
}

std::int32_t file_kind(const char* path) {
  return shielded(
      [&]() -> std::int32_t {
        const std::string which = path ? path : "";
        return call<&HostDoor::file_kind>(g_process->host(), which);
      },
      0);
}
std::int32_t file_read(const char* path, std::uint64_t most, void* context,
                       void (*take)(void* context, const char* bytes, std::uint64_t size),
                       char* error_text, std::uint32_t error_size) {
  return shielded(
      [&]() -> std::int32_t {
        const std::string which = path ? path : "";
        const auto bytes = call<&HostDoor::file_read>(g_process->host(), which, most);
        if (bytes.ok() && take) {
          take(context, bytes->data(), bytes->size());
          return 0;
        }
        say(error_text, error_size, bytes.ok() ? "no receiver was given" : bytes.error().message);
        return 2;
      },
      2);
}

void spread(std::size_t parts, std::size_t threads, void (*part)(void* context, std::size_t i),
            void* context) {
  Conversation* const mine = t_conversation;
  if (part)
    Executor::of_process().spread(parts, threads, [&](std::size_t i) {
      Conversation* const before = std::exchange(t_conversation, mine);
      part(context, i);
      t_conversation = before;
    });
}

const void* host_extension(const char* id) {
  static const rmp_files files = {sizeof(rmp_files), &file_kind, &file_read};
  static const rmp_threads threads = {
      sizeof(rmp_threads), static_cast<std::uint32_t>(Executor::of_process().cores()), &spread};
  const std::string_view which = id ? id : "";
  if (which == RMP_FILES) return &files;
  if (which == RMP_THREADS) return &threads;
  return nullptr;
}

const rmp_host kHost = {sizeof(rmp_host), RMP_SDK_VERSION, &host_log,      &host_run,
                        &host_create,     &host_list,      &host_extension};

Result<std::uint64_t> Process::create(std::uint32_t index) {
  RMP_TRY_ASSIGN(const rmp_plugin* p, plugin());
  if (index >= p->provider_count)
    return error(ErrorCode::unknown_name, "the plugin has no such provider any more");
  const rmp_provider& row = rmp_provider_at(*p, index);
  const std::string id = row.interface_id, label = id + " " + row.name;
  const InterfaceWire* wire = interface_wire(current_interface(id));
  if (!wire) return error(ErrorCode::unsupported, not_apart(id));
  RMP_TRY_ASSIGN(void* made, make_provider(row, &kHost, label));
  return table_.add({made, wire->serve, nullptr, wire->own(made), nullptr, nullptr});
}

/// Takes what the program says beside the channels, until it is gone.
void take_orders(Process& process, std::uint64_t memory) {
  for (;;) {
    Control control;
    iovec part{&control, sizeof control};
    alignas(cmsghdr) char space[CMSG_SPACE(sizeof(int))]{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = space;
    message.msg_controllen = sizeof space;
    const ssize_t n = ::recvmsg(0, &message, MSG_CMSG_CLOEXEC);
    if (n < 0 && errno == EINTR) continue;
    if (n != static_cast<ssize_t>(sizeof control)) return;
    if (control.what == Control::What::release) {
      process.erase(control.id);
      continue;
    }
    const cmsghdr* head = CMSG_FIRSTHDR(&message);
    if (!head || head->cmsg_type != SCM_RIGHTS) return;
    int fd = -1;
    std::memcpy(&fd, CMSG_DATA(head), sizeof fd);
    std::shared_ptr<Channel> channel = Channel::open(fd, memory);
    if (!channel) return;
    std::thread([&process, channel] { process.serve(*channel); }).detach();
  }
}

}  // namespace
}  // namespace robomosp::apart

int main(int argc, char** argv) {
  using namespace robomosp::apart;
  std::uint64_t memory = 0;
  int parent = 0;
  const auto number = [](const char* text, auto& value) {
    const std::string_view t = text;
    const auto read = std::from_chars(t.data(), t.data() + t.size(), value);
    return read.ec == std::errc() && read.ptr == t.data() + t.size();
  };
  if (argc != 5 || !number(argv[2], memory) || !number(argv[3], parent)) {
    std::fputs("robomosp-provider is started by robomosp.\n", stderr);
    return 2;
  }
  // Each arena reserves address space, of which there is a limit.
  ::mallopt(M_ARENA_MAX, 4);
  if (const char* why =
          lock_provider_process(parent, memory, std::string_view(argv[4]) == "confined")) {
    std::fprintf(stderr, "%s\n", why);
    return 1;
  }
  const auto process = std::make_shared<Process>(argv[1]);
  process->start();
  g_process = process.get();
  take_orders(*process, memory);
  ::_exit(0);  // plugins are never unloaded
}
