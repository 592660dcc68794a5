// SPDX-License-Identifier: Apache-2.0
// The server as its clients find it: `robomosp serve` in a process of its own, clients in this one,
// so that both sides are in the figures. ROBOMOSP_LOAD_SECONDS (5) says how long the loads last.
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spawn.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>

#include "kernel/base64.h"

extern char** environ;

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

double load_seconds() {
  const char* given = std::getenv("ROBOMOSP_LOAD_SECONDS");
  return given ? std::max(0.1, std::atof(given)) : 5;
}

pid_t g_server = -1;

[[noreturn]] void fail(const std::string& what) {
  std::cerr << what << '\n';
  if (g_server > 0) ::kill(g_server, SIGKILL);
  std::_Exit(1);
}

/// A cell with sixty boxes that fall on a floor, for runs.
constexpr const char* kCell = R"(
material.create{name = "wood", density = 600}
solid.create{name = "floor", root = {kind = "box", x = 4, y = 4, z = 0.1}}
solid.create{name = "box", material = "wood", root = {kind = "box", x = 0.1, y = 0.1, z = 0.1}}
local cell = world.create{name = "cell"}
cell:add_object{what = "floor", position = {0, 0, -0.1}}
for i = 0, 59 do
  cell:add_object{what = "box", name = "box" .. i,
                  position = {-1 + 0.2 * (i % 10), -1 + 0.2 * (i // 10), 0.5}}
end
robot.load("robots/puma560.rbt")
)";

/// `robomosp serve` on a Unix socket and a port, until it is destroyed.
class Serving {
 public:
  Serving() {
    folder_ = fs::temp_directory_path() / ("robomosp-load-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    socket = folder_ / "socket";
    std::ofstream(folder_ / "cell.lua") << kCell;
    rlimit files{65'536, 65'536};
    ::setrlimit(RLIMIT_NOFILE, &files);
  }
  ~Serving() {
    stop();
    fs::remove_all(folder_);
  }
  Serving(const Serving&) = delete;
  Serving& operator=(const Serving&) = delete;

  void start(bool with_cell = true) {
    const std::string program = ROBOMOSP_PROGRAM, listen = "unix:" + socket.string();
    const std::string cell = folder_ / "cell.lua";
    std::vector<std::string> words{program, "serve",   "--listen",
                                   listen,  "--allow", "reads,edits,simulates,files_read"};
    if (with_cell) words.push_back(cell);
    std::vector<char*> argv;
    for (std::string& w : words) argv.push_back(w.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);
    if (::posix_spawn(&pid, program.c_str(), &files, nullptr, argv.data(), environ) != 0)
      fail("cannot start " + program);
    g_server = pid;
    ::posix_spawn_file_actions_destroy(&files);
  }
  void stop() {
    if (pid <= 0) return;
    ::kill(pid, SIGTERM);
    ::waitpid(pid, nullptr, 0);
    pid = g_server = -1;
  }
  /// Resident memory [bytes].
  [[nodiscard]] double memory() const {
    std::ifstream in("/proc/" + std::to_string(pid) + "/statm");
    double all = 0, resident = 0;
    in >> all >> resident;
    return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
  }
  /// Processor time of all its threads [s].
  [[nodiscard]] double cpu() const {
    std::ifstream in("/proc/" + std::to_string(pid) + "/stat");
    std::string text((std::istreambuf_iterator<char>(in)), {});
    unsigned long long user = 0, system = 0;
    std::sscanf(text.c_str() + text.rfind(')') + 2,
                "%*c %*d %*d %*d %*d %*d %*u %*u %*u %*u %*u %llu %llu", &user, &system);
    return static_cast<double>(user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }

  fs::path socket;
  pid_t pid = -1;

 private:
  fs::path folder_;
};

class Client {
 public:
  /// Connects and says hello; waits for a server that is starting.
  explicit Client(const fs::path& path, std::string_view more = "") {
    sockaddr_un end{};
    end.sun_family = AF_UNIX;
    std::strncpy(end.sun_path, path.c_str(), sizeof end.sun_path - 1);
    const auto until = Clock::now() + 20s;
    for (;;) {
      fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
      if (::connect(fd, reinterpret_cast<sockaddr*>(&end), sizeof end) == 0) break;
      ::close(fd);
      if (Clock::now() > until) fail("nobody listens on " + path.string());
      ::poll(nullptr, 0, 1);
    }
    const std::string answer =
        ask(R"({"jsonrpc":"2.0","id":0,"method":"server.hello","params":{"protocol":1)" +
            std::string(more) + "}}\n");
    if (answer.find("\"result\"") == std::string::npos) fail(answer);
  }
  ~Client() { ::close(fd); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t n = ::send(fd, text.data(), text.size(), MSG_NOSIGNAL);
      if (n <= 0) fail("the server is gone");
      text.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  std::string line() {
    for (std::size_t from = 0;;) {
      if (const auto end = buffer_.find('\n', from); end != std::string::npos) {
        std::string out = buffer_.substr(0, end);
        buffer_.erase(0, end + 1);
        return out;
      }
      from = buffer_.size();
      fill();
    }
  }
  /// The next answer, without the events before it.
  std::string ask(std::string_view text) {
    send(text);
    for (;;)
      if (std::string out = line(); out.find(R"("method":)") == std::string::npos) return out;
  }
  /// Lines that are whole, of what there is to read now.
  std::size_t lines_now() {
    fill();
    const auto count = static_cast<std::size_t>(std::count(buffer_.begin(), buffer_.end(), '\n'));
    if (count) buffer_.erase(0, buffer_.rfind('\n') + 1);
    return count;
  }
  int fd = -1;
  Clock::time_point sent{};

 private:
  void fill() {
    std::array<char, 262'144> piece;
    const ssize_t n = ::recv(fd, piece.data(), piece.size(), 0);
    if (n <= 0) fail("the server closed the connection");
    buffer_.append(piece.data(), static_cast<std::size_t>(n));
  }
  std::string buffer_;
};

constexpr std::string_view kTrivial =
    "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"material.list\",\"params\":{}}\n";

void show(benchmark::State& state, std::vector<double> times) {
  if (times.empty()) return;
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    return 1e6 * times[std::min(times.size() - 1, static_cast<std::size_t>(
                                                      share * static_cast<double>(times.size())))];
  };
  state.counters["p50_us"] = at(0.5);
  state.counters["p99_us"] = at(0.99);
  state.counters["max_us"] = at(1);
}

/// Boxes that fall, for as long as anybody looks.
void play(Client& c, const std::string& speed) {
  const std::string made = c.ask(
      R"({"jsonrpc":"2.0","id":1,"method":"world.start_run","params":{"id":"cell","of":"physics",)"
      R"("with":{"duration":10000}}})"
      "\n");
  const auto at = made.find(R"("result":)");
  if (at == std::string::npos) fail(made);
  const std::string run = made.substr(at + 9, made.size() - at - 10);
  const std::string said = c.ask(R"({"jsonrpc":"2.0","id":1,"method":"run.play","params":{"id":)" +
                                 run + R"(,"speed":)" + speed + "}}\n");
  if (said.find(R"("result":)") == std::string::npos) fail(said);
}

// From the start of the program to its first answer (aim 100 ms), without a script.
void start(benchmark::State& state) {
  Serving s;
  std::vector<double> times;
  for (auto _ : state) {
    const auto begin = Clock::now();
    s.start(false);
    const Client c(s.socket);
    times.push_back(seconds_since(begin));
    state.PauseTiming();
    s.stop();
    state.ResumeTiming();
  }
  show(state, times);
}
BENCHMARK(start)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();

// One request, one answer, over a Unix socket (aim: p50 of 40 us).
void round_trip(benchmark::State& state) {
  Serving s;
  s.start();
  Client c(s.socket);
  std::vector<double> times;
  for (auto _ : state) {
    const auto begin = Clock::now();
    benchmark::DoNotOptimize(c.ask(kTrivial));
    times.push_back(seconds_since(begin));
  }
  show(state, times);
}
BENCHMARK(round_trip)->Unit(benchmark::kMicrosecond)->Iterations(20'000)->UseRealTime();

// From a commit's answer being asked for to the other client's event (aim 2 ms).
void notification(benchmark::State& state) {
  Serving s;
  s.start();
  Client writer(s.socket);
  Client reader(s.socket, R"(,"subscribe":["change"])");
  writer.ask(
      R"({"jsonrpc":"2.0","id":1,"method":"material.create","params":{"name":"brass","density":1}})"
      "\n");
  (void)reader.line();
  std::vector<double> times;
  double density = 1;
  for (auto _ : state) {
    const auto begin = Clock::now();
    writer.send(
        R"({"jsonrpc":"2.0","id":1,"method":"material.set","params":{"id":"brass","density":)" +
        std::to_string(density += 1) + "}}\n");
    (void)reader.line();
    times.push_back(seconds_since(begin));
    (void)writer.line();
  }
  show(state, times);
}
BENCHMARK(notification)->Unit(benchmark::kMicrosecond)->Iterations(2'000)->UseRealTime();

// Torques of 10,000 states of a PUMA in one request, arrays as bytes both ways (aim 5 ms).
void inverse_dynamics(benchmark::State& state) {
  Serving s;
  s.start();
  Client c(s.socket);
  constexpr std::size_t kStates = 10'000, kJoints = 6;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-3, 3);
  std::vector<double> numbers(kStates * kJoints);
  const auto matrix = [&] {
    for (double& x : numbers) x = angle(random);
    std::string out = R"({"$array":{"shape":[10000,6],"base64":")";
    robomosp::base64::append(out, std::string_view(reinterpret_cast<const char*>(numbers.data()),
                                                   numbers.size() * sizeof(double)));
    return out + R"("}})";
  };
  const std::string request =
      R"({"jsonrpc":"2.0","id":1,"method":"robot.inverse_dynamics","arrays":"base64","params":{)"
      R"("id":"puma560","q":)" +
      matrix() + R"(,"qd":)" + matrix() + R"(,"qdd":)" + matrix() + "}}\n";
  if (const std::string first = c.ask(request); first.find("\"result\"") == std::string::npos)
    fail(first.substr(0, 500));
  for (auto _ : state) benchmark::DoNotOptimize(c.ask(request));
  state.counters["MB"] = static_cast<double>(request.size()) / 1e6;
}
BENCHMARK(inverse_dynamics)->Unit(benchmark::kMillisecond)->Iterations(50)->UseRealTime();

// So many clients, each with one request at a time, while a simulation runs as fast as it can
// (aim for 200: 20,000 requests a second, p99 of 5 ms); as fast as they are answered, or so many
// requests a second in all.
void clients(benchmark::State& state) {
  Serving s;
  s.start();
  Client owner(s.socket);
  if (state.range(1)) play(owner, "\"max\"");
  std::vector<std::unique_ptr<Client>> all;
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    all.push_back(std::make_unique<Client>(s.socket));
    epoll_event e{};
    e.events = EPOLLIN;
    e.data.ptr = all.back().get();
    ::epoll_ctl(epoll, EPOLL_CTL_ADD, all.back()->fd, &e);
  }
  std::vector<double> times;
  times.reserve(2'000'000);
  std::vector<epoll_event> ready(256);
  double asked = 0;
  const double rate = static_cast<double>(state.range(2));
  const Clock::duration pause =
      rate > 0 ? std::chrono::duration_cast<Clock::duration>(
                     std::chrono::duration<double>(static_cast<double>(state.range(0)) / rate))
               : Clock::duration::zero();
  std::deque<Client*> resting;  ///< that were answered, in the order of their requests nearly
  for (auto _ : state) {
    const auto begin = Clock::now();
    for (const auto& c : all) {
      c->sent = Clock::now();
      c->send(kTrivial);
    }
    std::size_t count = 0;
    while (seconds_since(begin) < load_seconds()) {
      int patience = 1000;
      while (!resting.empty()) {
        Client& c = *resting.front();
        const auto now = Clock::now();
        if (c.sent + pause > now) {
          patience = static_cast<int>((c.sent + pause - now) / 1ms);
          break;
        }
        resting.pop_front();
        c.sent = now;
        c.send(kTrivial);
      }
      const int n = ::epoll_wait(epoll, ready.data(), static_cast<int>(ready.size()), patience);
      for (int i = 0; i < n; ++i) {
        Client& c = *static_cast<Client*>(ready[static_cast<std::size_t>(i)].data.ptr);
        if (c.lines_now() == 0) continue;
        const auto now = Clock::now();
        times.push_back(std::chrono::duration<double>(now - c.sent).count());
        ++count;
        if (pause > Clock::duration::zero()) {
          resting.push_back(&c);
          continue;
        }
        c.sent = now;
        c.send(kTrivial);
      }
    }
    asked = static_cast<double>(count) / seconds_since(begin);
  }
  ::close(epoll);
  state.counters["requests/s"] = asked;
  show(state, times);
}
BENCHMARK(clients)
    ->Args({200, 1, 20'000})
    ->Args({200, 1, 0})
    ->Args({200, 0, 0})
    ->Args({1, 0, 0})
    ->Unit(benchmark::kSecond)
    ->Iterations(1)
    ->UseRealTime();

// So many clients that say nothing (aim for 1,000: below 1 % of a processor, 20 kB each).
void idle(benchmark::State& state) {
  Serving s;
  s.start();
  const Client first(s.socket);
  ::poll(nullptr, 0, 300);
  const double before = s.memory();
  std::vector<std::unique_ptr<Client>> all;
  for (std::int64_t i = 0; i < state.range(0); ++i)
    all.push_back(std::make_unique<Client>(s.socket));
  const double bytes = (s.memory() - before) / static_cast<double>(state.range(0));
  double share = 0;
  for (auto _ : state) {
    const double cpu = s.cpu();
    const auto begin = Clock::now();
    ::poll(nullptr, 0, static_cast<int>(1000 * load_seconds()));
    share = (s.cpu() - cpu) / seconds_since(begin);
  }
  state.counters["kB_each"] = bytes / 1e3;
  state.counters["cpu_percent"] = 100 * share;
}
BENCHMARK(idle)->Arg(1000)->Unit(benchmark::kSecond)->Iterations(1)->UseRealTime();

// So many clients that follow a run that plays in real time, at 60 states a second each.
void subscribers(benchmark::State& state) {
  Serving s;
  s.start();
  Client owner(s.socket);
  std::vector<std::unique_ptr<Client>> all;
  std::vector<pollfd> fds;
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    all.push_back(
        std::make_unique<Client>(s.socket, R"(,"subscribe":{"topics":["run"],"rate":60})"));
    fds.push_back({all.back()->fd, POLLIN, 0});
  }
  play(owner, "1");
  std::vector<double> gaps;
  double rate = 0, share = 0;
  for (auto _ : state) {
    const double cpu = s.cpu();
    const auto begin = Clock::now();
    std::size_t count = 0;
    while (seconds_since(begin) < load_seconds()) {
      if (::poll(fds.data(), fds.size(), 1000) <= 0) break;
      for (std::size_t i = 0; i < fds.size(); ++i) {
        if (!(fds[i].revents & POLLIN)) continue;
        const std::size_t lines = all[i]->lines_now();
        if (lines == 0) continue;
        count += lines;
        const auto now = Clock::now();
        if (all[i]->sent != Clock::time_point())
          gaps.push_back(std::chrono::duration<double>(now - all[i]->sent).count());
        all[i]->sent = now;
      }
    }
    const double took = seconds_since(begin);
    rate = static_cast<double>(count) / took / static_cast<double>(all.size());
    share = (s.cpu() - cpu) / took;
  }
  state.counters["states/s_each"] = rate;
  state.counters["cpu_percent"] = 100 * share;
  show(state, gaps);
}
BENCHMARK(subscribers)->Arg(50)->Unit(benchmark::kSecond)->Iterations(1)->UseRealTime();

}  // namespace
