// SPDX-License-Identifier: Apache-2.0
#include "remote/server.h"

#include <fcntl.h>
#include <malloc.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include <asio/generic/stream_protocol.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/local/stream_protocol.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>

#include "kernel/text.h"
#include "remote/connection.h"
#include "remote/crypto.h"
#include "remote/json.h"
#include "remote/reactor.h"
#include "remote/tls.h"
#include "remote/web.h"

namespace robomosp::remote {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

/// How often what takes too long is looked for.
constexpr auto kServerLook = 1s;
/// How often the program is weighed.
constexpr auto kWeigh = 100ms;
/// How long clients have to take what was said to them before the server ends.
constexpr auto kServerGoodbye = 1s;
/// How long nobody is let in when the system has no descriptor left.
constexpr auto kBreath = 100ms;

std::string time_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

/// Memory that the program takes [MiB]; 0 where the system does not say.
std::uint64_t resident_mib() {
  char text[128];
  const int fd = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (fd < 0) return 0;
  const ssize_t n = ::read(fd, text, sizeof text - 1);
  ::close(fd);
  if (n <= 0) return 0;
  text[n] = 0;
  unsigned long long all = 0, resident = 0;
  if (std::sscanf(text, "%llu %llu", &all, &resident) != 2) return 0;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) >> 20;
}

/// A file that lines are added to.
class AuditFile {
 public:
  static Result<std::shared_ptr<AuditFile>> open(const fs::path& file) {
    const int fd =
        ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK, 0600);
    if (fd < 0)
      return error(ErrorCode::io,
                   "the audit file " + text::quote(file.string()) +
                       " cannot be opened: " + std::strerror(errno),
                   "Choose another file.");
    return std::shared_ptr<AuditFile>(new AuditFile(fd));
  }
  ~AuditFile() { ::close(fd_); }
  AuditFile(const AuditFile&) = delete;
  AuditFile& operator=(const AuditFile&) = delete;
  /// One write a line, so that lines of several programs do not mix. False when it failed.
  bool add(const Map& line) {
    const std::string text = to_json(line) + "\n";
    return ::write(fd_, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  }

 private:
  explicit AuditFile(int fd) : fd_(fd) {}
  const int fd_;
};

}  // namespace

class Server::Impl {
 public:
  Impl(ioci::Application& app, ServerOptions options, Tokens tokens)
      : app_(app),
        options_(std::move(options)),
        tokens_(std::move(tokens)),
        hall_{.app = app,
              .reactor = reactor_,
              .options = options_,
              .tokens = tokens_,
              .web = nullptr,
              .audit = {},
              .gone = [this](std::uint64_t n) { gone(n); },
              .instance = {}},
        reactor_(static_cast<std::size_t>(options_.limits.threads)) {}
  ~Impl() { stop(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Result<void> start() {
    RMP_TRY_ASSIGN(hall_.instance, random_secret());
    hall_.instance = sha256(hall_.instance).substr(0, 16);
    if (!options_.certificate.empty() || !options_.key.empty()) {
      RMP_TRY_ASSIGN(tls_, TlsContext::create(options_.certificate, options_.key));
    }
    for (const Address& a : options_.addresses)
      if (!a.is_local() && !tls_)
        return error(ErrorCode::permission,
                     a.text() + " can be reached from other machines, so the server needs TLS",
                     "Give a certificate and its key, or listen on 127.0.0.1.");
    if (options_.browser) {
      RMP_TRY_ASSIGN(web_, WebRules::make(options_.origins, options_.addresses));
      hall_.web = &*web_;
    } else if (!options_.origins.empty()) {
      return error(ErrorCode::invalid_argument,
                   "origins apply to web pages, but browser access is disabled",
                   "Start it with browser = true, or leave origins out.", "origins");
    }
    if (!options_.audit.empty()) {
      RMP_TRY_ASSIGN(std::shared_ptr<AuditFile> file, AuditFile::open(options_.audit));
      hall_.audit = [this, file](Map line) {
        Map whole{{"time", time_now()}};
        for (const auto& [key, value] : line) whole.append(key, value);
        if (!file->add(whole) && !told_audit_.exchange(true))
          app_.messages.post(
              Severity::error, "audit_file",
              "The audit file cannot be written: " + std::string(std::strerror(errno)) + ".",
              "server");
      };
    }
    hall_.job_started = [this](std::uint64_t job) { job_started(job); };
    for (const Address& a : options_.addresses) RMP_TRY(listen(a));
    look_later();
    if (options_.limits.memory) weigh_later();
    return {};
  }

  void stop() {
    if (is_stopping_.exchange(true)) return;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& door : doors_) {
        asio::error_code ec;
        door->acceptor.close(ec);
        if (door->address.is_unix) ::unlink(door->address.path.c_str());
      }
    }
    for (const auto& c : connections()) c->close("The server ends.");
    const auto until = std::chrono::steady_clock::now() + kServerGoodbye;
    while (!connections().empty() && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(5ms);
    for (const auto& c : connections()) c->close("");
    reactor_.stop();
    const std::lock_guard lock(mutex_);
    connections_.clear();
  }

  std::vector<Address> addresses() const {
    std::vector<Address> out;
    const std::lock_guard lock(mutex_);
    for (const auto& door : doors_) out.push_back(door->address);
    return out;
  }

  std::vector<std::shared_ptr<Connection>> connections() const {
    std::vector<std::shared_ptr<Connection>> out;
    const std::lock_guard lock(mutex_);
    for (const auto& [number, c] : connections_) out.push_back(c);
    return out;
  }
  std::shared_ptr<Connection> connection(std::uint64_t number) const {
    const std::lock_guard lock(mutex_);
    const auto at = connections_.find(number);
    return at == connections_.end() ? nullptr : at->second;
  }

  const Tokens& tokens() const { return tokens_; }
  const ServerOptions& options() const { return options_; }
  std::size_t threads() const { return reactor_.threads(); }

 private:
  using Protocol = asio::generic::stream_protocol;
  struct Door {
    Door(asio::io_context& io, Address a) : address(std::move(a)), acceptor(io), rest(io) {}
    Address address;
    asio::basic_socket_acceptor<Protocol> acceptor;
    asio::steady_timer rest;
  };

  Result<void> listen(const Address& wanted) {
    const auto cannot = [&](const std::string& why) {
      return error(ErrorCode::io, "the server cannot listen on " + wanted.text() + ": " + why,
                   wanted.is_unix ? "Choose another path, or end the program that uses it."
                                  : "Choose another port; 0 selects a free one.");
    };
    asio::error_code ec;
    std::vector<Protocol::endpoint> ends;
    if (wanted.is_unix) {
      RMP_TRY(clear(wanted.path));
      ends.emplace_back(asio::local::stream_protocol::endpoint(wanted.path));
    } else if (wanted.host.empty()) {
      ends.emplace_back(asio::ip::tcp::endpoint(asio::ip::tcp::v6(), wanted.port));
    } else {
      asio::ip::tcp::resolver resolver(reactor_.io());
      const auto found = resolver.resolve(wanted.host, std::to_string(wanted.port), ec);
      if (ec) return cannot(ec.message());
      for (const auto& entry : found) ends.emplace_back(entry.endpoint());
    }
    for (const Protocol::endpoint& end : ends) {
      auto door = std::make_shared<Door>(reactor_.io(), wanted);
      auto& acceptor = door->acceptor;
      acceptor.open(end.protocol(), ec);
      if (!ec && !wanted.is_unix) acceptor.set_option(asio::socket_base::reuse_address(true), ec);
      if (!ec) {
        // The file of a Unix socket is its owner's only, from its first moment on.
        const mode_t before = wanted.is_unix ? ::umask(0177) : 0;
        acceptor.bind(end, ec);
        if (wanted.is_unix) ::umask(before);
      }
      if (!ec) acceptor.listen(asio::socket_base::max_listen_connections, ec);
      if (ec) {
        if (!wanted.is_unix && ends.size() > 1 && &end != &ends.back()) continue;
        return cannot(ec.message());
      }
      (void)::fcntl(acceptor.native_handle(), F_SETFD, FD_CLOEXEC);
      if (!wanted.is_unix) {
        const auto own = acceptor.local_endpoint(ec);
        const auto* address = reinterpret_cast<const sockaddr*>(own.data());
        if (!ec && address->sa_family == AF_INET)
          door->address.port = ntohs(reinterpret_cast<const sockaddr_in*>(address)->sin_port);
        else if (!ec && address->sa_family == AF_INET6)
          door->address.port = ntohs(reinterpret_cast<const sockaddr_in6*>(address)->sin6_port);
      }
      {
        const std::lock_guard lock(mutex_);
        doors_.push_back(door);
      }
      accept(door);
      return {};  // a name with several addresses: the first that can be had
    }
    return cannot("it has no address");
  }

  /// Removes the socket that a program left which is gone.
  static Result<void> clear(const std::string& path) {
    struct stat info {};
    if (::lstat(path.c_str(), &info) != 0) return {};
    if (!S_ISSOCK(info.st_mode))
      return error(ErrorCode::conflict, text::quote(path) + " exists and is not a socket",
                   "Choose another path.");
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un end{};
    end.sun_family = AF_UNIX;
    std::memcpy(end.sun_path, path.c_str(), std::min(path.size() + 1, sizeof end.sun_path));
    const bool is_used =
        fd >= 0 && ::connect(fd, reinterpret_cast<const sockaddr*>(&end), sizeof end) == 0;
    if (fd >= 0) ::close(fd);
    if (is_used)
      return error(ErrorCode::conflict, "another program listens on " + text::quote(path),
                   "Choose another path, or end that program.");
    ::unlink(path.c_str());
    return {};
  }

  void accept(const std::shared_ptr<Door>& door) {
    door->acceptor.async_accept(
        [this, door](const asio::error_code& ec, Connection::Socket socket) {
          if (is_stopping_ || ec == asio::error::operation_aborted) return;
          if (!ec) {
            enter(*door, std::move(socket));
            accept(door);
            return;
          }
          // No descriptor is left, most likely: others are served meanwhile.
          if (!told_accept_.exchange(true))
            app_.messages.post(Severity::warning, "server_full",
                               "The server cannot accept another connection: " + ec.message() + ".",
                               "server");
          door->rest.expires_after(kBreath);
          door->rest.async_wait([this, door](const asio::error_code& over) {
            if (!over && !is_stopping_) accept(door);
          });
        });
  }

  void enter(const Door& door, Connection::Socket socket) {
    (void)::fcntl(socket.native_handle(), F_SETFD, FD_CLOEXEC);
    std::string peer = "unix", host = "unix";
    if (!door.address.is_unix) {
      asio::error_code ec;
      const auto end = socket.remote_endpoint(ec);
      if (ec) return;
      asio::ip::tcp::endpoint tcp;
      std::memcpy(tcp.data(), end.data(), std::min(end.size(), tcp.capacity()));
      tcp.resize(end.size());
      host = tcp.address().to_string();
      peer = (tcp.address().is_v6() ? "[" + host + "]" : host) + ":" + std::to_string(tcp.port());
    }
    const bool is_local = door.address.is_local();
    std::shared_ptr<Connection> connection;
    {
      const std::lock_guard lock(mutex_);
      std::size_t& here = of_host_[host];
      if (connections_.size() >= options_.limits.clients ||
          here >= options_.limits.clients_of_address) {
        if (!told_full_.exchange(true))
          app_.messages.post(Severity::warning, "server_full",
                             "A connection of " + peer + " was refused, since " +
                                 std::to_string(connections_.size()) +
                                 " are open (limits clients, clients_of_address).",
                             "server");
        if (here == 0) of_host_.erase(host);
        return;  // closes it
      }
      ++here;
      const std::uint64_t number = next_++;
      connection = std::make_shared<Connection>(
          hall_, number, std::move(socket), peer, options_.needs_token || !is_local,
          is_local && !options_.tls_everywhere ? nullptr : tls_);
      connections_.emplace(number, connection);
      hosts_.emplace(number, host);
    }
    connection->start();
  }

  /// A connection was shut. What it ran is ended by whoever lets go of it last.
  void gone(std::uint64_t number) {
    std::shared_ptr<Connection> last;
    const std::lock_guard lock(mutex_);
    const auto at = connections_.find(number);
    if (at == connections_.end()) return;
    last = std::move(at->second);
    connections_.erase(at);
    if (const auto host = hosts_.find(number); host != hosts_.end()) {
      if (const auto count = of_host_.find(host->second);
          count != of_host_.end() && --count->second == 0)
        of_host_.erase(count);
      hosts_.erase(host);
    }
    // Not here: it may wait for its jobs, and this is called from within.
    asio::post(reactor_.io(), [last = std::move(last)]() mutable { last.reset(); });
  }

  void look_later() {
    look_.expires_after(kServerLook);
    look_.async_wait([this](const asio::error_code& ec) {
      if (ec || is_stopping_) return;
      const auto now = Connection::Clock::now();
      for (const auto& c : connections()) c->look(now);
      look_later();
    });
  }

  // --- memory ---

  void job_started(std::uint64_t job) {
    const std::lock_guard lock(jobs_mutex_);
    if (jobs_.size() >= most_jobs_) {
      std::erase_if(jobs_, [this](std::uint64_t number) {
        const auto s = app_.jobs.status(number);
        return !s.ok() || (s->state != JobState::waiting && s->state != JobState::running);
      });
      most_jobs_ = 2 * jobs_.size() + 64;
    }
    jobs_.push_back(job);
  }

  void weigh_later() {
    weigh_.expires_after(kWeigh);
    weigh_.async_wait([this](const asio::error_code& ec) {
      if (ec || is_stopping_) return;
      weigh();
      weigh_later();
    });
  }

  /// Ends commands and jobs of clients, one kind after the other, while the program is too large.
  void weigh() {
    std::uint64_t size = resident_mib();
    if (size > options_.limits.memory) {
      ::malloc_trim(0);  // what was freed and not given back is nobody's fault
      size = resident_mib();
    }
    if (size <= options_.limits.memory) {
      hall_.too_large = 0;
      return;
    }
    if (hall_.too_large.exchange(size) == 0)
      app_.messages.post(Severity::warning, "server_memory",
                         "The program takes " + std::to_string(size) + " MiB; beyond " +
                             std::to_string(options_.limits.memory) +
                             " MiB (limit memory) clients may only read.",
                         "server");
    std::shared_ptr<Connection> oldest;
    auto since = Connection::Clock::time_point::max();
    for (const auto& c : connections())
      if (const auto begin = c->running_since(); begin && *begin < since)
        since = *begin, oldest = c;
    if (oldest) return oldest->end_for_memory();
    std::vector<std::uint64_t> jobs;
    {
      const std::lock_guard lock(jobs_mutex_);
      jobs.swap(jobs_);
    }
    for (const std::uint64_t job : jobs) app_.jobs.cancel(job);
  }

  ioci::Application& app_;
  const ServerOptions options_;
  Tokens tokens_;
  std::shared_ptr<TlsContext> tls_;
  std::optional<WebRules> web_;
  std::atomic<bool> is_stopping_{false}, told_audit_{false}, told_accept_{false}, told_full_{false};
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<Door>> doors_;                          // guarded by mutex_
  std::map<std::uint64_t, std::shared_ptr<Connection>> connections_;  // guarded by mutex_
  std::map<std::uint64_t, std::string> hosts_;  ///< of connections; guarded by mutex_
  std::map<std::string, std::size_t> of_host_;  ///< connections; guarded by mutex_
  std::uint64_t next_ = 1;                      // guarded by mutex_
  Hall hall_;
  Reactor reactor_;  ///< after all that its handlers use
  asio::steady_timer look_{reactor_.io()}, weigh_{reactor_.io()};
  std::mutex jobs_mutex_;
  std::vector<std::uint64_t> jobs_;  ///< that clients started, and of before; by jobs_mutex_
  std::size_t most_jobs_ = 64;       ///< then those of before are forgotten; by jobs_mutex_
};

Result<std::unique_ptr<Server>> Server::start(ioci::Application& app, ServerOptions options) {
  if (options.addresses.empty()) {
    RMP_TRY_ASSIGN(const Address usual, Address::parse("127.0.0.1"));
    options.addresses.push_back(usual);
  }
  if (options.certificate.empty() != options.key.empty())
    return error(ErrorCode::invalid_argument,
                 options.key.empty() ? "a certificate needs its private key"
                                     : "a private key needs its certificate",
                 "Give both.");
  RMP_TRY_ASSIGN(Tokens tokens, Tokens::open(options.token_file.empty() ? Tokens::usual_file()
                                                                        : options.token_file));
  bool is_open = false;
  for (const Address& a : options.addresses) is_open = is_open || !a.is_local();
  if (is_open || options.needs_token) {
    RMP_TRY_ASSIGN(const std::vector<Token> known, tokens.list());
    if (known.empty())
      return error(ErrorCode::permission,
                   "the server needs a token, and " + text::quote(tokens.file().string()) +
                       " has none, so nobody could connect",
                   "Grant one first: server.grant{name = \"student\"}.");
  }
  auto impl = std::make_shared<Impl>(app, std::move(options), std::move(tokens));
  RMP_TRY(impl->start());
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

Server::~Server() { impl_->stop(); }

std::vector<Address> Server::addresses() const { return impl_->addresses(); }

std::vector<ClientInfo> Server::clients() const {
  std::vector<ClientInfo> out;
  for (const auto& c : impl_->connections()) out.push_back(c->info());
  return out;
}

bool Server::kick(std::uint64_t number, const std::string& reason) {
  const auto c = impl_->connection(number);
  if (c) c->close(reason);
  return c != nullptr;
}

std::size_t Server::kick_token(std::string_view token, const std::string& reason) {
  std::size_t count = 0;
  for (const auto& c : impl_->connections())
    if (c->info().token == token && !token.empty()) {
      c->close(reason);
      ++count;
    }
  return count;
}

const std::filesystem::path& Server::tokens_file() const { return impl_->tokens().file(); }
const ServerOptions& Server::options() const { return impl_->options(); }
std::size_t Server::threads() const { return impl_->threads(); }

Result<void> Servers::start(ServerOptions options) {
  const std::lock_guard lock(mutex_);
  if (server_)
    return error(ErrorCode::conflict,
                 "a server is already running on " + server_->addresses().front().text(),
                 "Stop it with server.stop(); one server can have several addresses.");
  RMP_TRY_ASSIGN(std::unique_ptr<Server> server, Server::start(app_, std::move(options)));
  server_ = std::move(server);
  return {};
}

std::shared_ptr<Server> Servers::release() {
  const std::lock_guard lock(mutex_);
  return std::exchange(server_, nullptr);
}

std::shared_ptr<Server> Servers::running() const {
  const std::lock_guard lock(mutex_);
  return server_;
}

}  // namespace robomosp::remote
