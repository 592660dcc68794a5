// SPDX-License-Identifier: Apache-2.0
// Plugins in processes of their own: what they compute arrives, and whatever they do to their
// process ends in a sentence that names them, after which the next call works.
#include "kernel/provider_process/provider_process.h"

#include <dirent.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/module.h>

#include "kernel/plugin_loader.h"
#include "kernel/plugin_run.h"
#include "kernel/provider_process/proxies.h"

namespace robomosp {
namespace {

using namespace std::chrono_literals;

class After final : public Progress {
 public:
  explicit After(std::chrono::milliseconds time) : end_(std::chrono::steady_clock::now() + time) {}
  void report(double share, std::string_view what) override {
    told += std::to_string(static_cast<int>(share * 100)) + std::string(what);
  }
  [[nodiscard]] bool cancelled() const override { return std::chrono::steady_clock::now() > end_; }
  std::string told;

 private:
  std::chrono::steady_clock::time_point end_;
};

std::size_t open_descriptors() {
  std::size_t n = 0;
  DIR* folder = ::opendir("/proc/self/fd");
  while (::readdir(folder)) ++n;
  ::closedir(folder);
  return n;
}
std::size_t children() {
  std::size_t n = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream in(task.path() / "children");
    for (std::string pid; in >> pid;) ++n;
  }
  return n;
}
RobotModel model(std::size_t dof, const std::string& name = "m") {
  RobotModel m;
  m.name = name;
  m.joints.resize(dof);
  for (std::size_t i = 0; i < dof; ++i) m.joints[i].parent = static_cast<std::int32_t>(i) - 1;
  m.tips.resize(1);
  m.number_coordinates();
  return m;
}

// AddressSanitizer ends a process that crashes in its own way.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr const char* kCrashed = "ended its process (exit code";
#else
constexpr const char* kCrashed = "crashed (signal SIGSEGV)";
#endif

class ProviderProcesses : public testing::Test {
 protected:
  void open(ApartLimits limits = {}) {
    const PluginRunScope scope(PluginRun{false, limits});
    const auto report = loader_.load(kFile);
    ASSERT_TRUE(report.loaded) << (report.refusal ? report.refusal->sentence() : "");
    remarks_ = report.remarks;
  }
  std::shared_ptr<InverseDynamics> solver(const RobotModel& m) {
    auto made = registry_.create<InverseDynamics>("reckless");
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
    if (!made.ok()) return nullptr;
    const auto info = registry_.find(InverseDynamics::kInterfaceId, "reckless");
    const auto params = make_params(*check(info->schema, {}));
    const auto bound = (*made)->prepare(m, *params);
    EXPECT_TRUE(bound.ok()) << (bound.ok() ? "" : bound.error().sentence());
    return *made;
  }
  /// Torques of two joints at (what, more); what came of it in words.
  static std::string ask(const InverseDynamics& s, double what, double more = 1,
                         std::vector<double>* tau = nullptr, Progress* progress = nullptr) {
    std::vector<double> q{what, more}, out(2), scratch(s.scratch_size());
    DynamicsBatch b;
    b.count = 1;
    b.q = q;
    b.scratch = scratch;
    NoProgress none;
    const auto done = s.torques(b, out, progress ? *progress : none);
    if (tau) *tau = out;
    return done.ok() ? "ok" : done.error().sentence();
  }
  std::shared_ptr<ProviderProcess> process() const {
    return PluginRuns::of_program().process(std::filesystem::canonical(kFile));
  }
  const std::string kFile = std::string(ABI_PLUGIN_DIR) + "/abi_reckless.so";
  Messages messages_;
  Registry registry_;
  PluginLoader loader_{registry_, &messages_};
  std::vector<std::string> remarks_;
};

TEST(ProvidersApart, EachInterfaceRunsApartOrSaysWhyNot) {
  ASSERT_GT(known_interfaces().size(), 20U);
  int apart = 0;
  for (const std::string& id : known_interfaces())
    if (apart::interface_wire(id)) ++apart;
    else
      EXPECT_EQ(apart::not_apart(id).find("has no form between processes"), std::string::npos)
          << id << ": give the reason in kernel/provider_process/proxies.cpp";
  EXPECT_GE(apart, 20);
}

TEST_F(ProviderProcesses, ComputesInItsOwnProcess) {
  open();
  ASSERT_EQ(remarks_.size(), 1U);
  EXPECT_NE(remarks_[0].find("\"draws\" is skipped: a renderer draws with the display"),
            std::string::npos)
      << remarks_[0];
  EXPECT_EQ(process()->process(), 0) << "none is needed yet";
  const RobotModel m = model(2);
  const auto s = solver(m);
  std::vector<double> tau;
  EXPECT_EQ(ask(*s, 0, 21, &tau), "ok");
  EXPECT_EQ(tau, (std::vector<double>{0, 42}));
  std::vector<double> pid(1);
  NoProgress none;
  DynamicsBatch b;
  ASSERT_TRUE(s->inertia(b, pid, none).ok());
  EXPECT_EQ(static_cast<int>(pid[0]), process()->process());
  EXPECT_NE(static_cast<int>(pid[0]), ::getpid());
  After told(1h);
  EXPECT_EQ(ask(*s, 12, 1, nullptr, &told), "ok");
  EXPECT_EQ(told.told, "50half");
  EXPECT_EQ(ask(*s, 16), "ok");
  bool was_heard = false;
  for (const Message& message : messages_.recent())
    was_heard = was_heard || message.text == "said by hand";
  EXPECT_TRUE(was_heard);
  // What a plugin asks of the program is asked of its registry.
  EXPECT_NE(ask(*s, 17).find("there is no"), std::string::npos) << ask(*s, 17);
  EXPECT_EQ(ask(*s, 18), "here: it cannot be reached. Come nearer.");
  EXPECT_EQ(process()->starts(), 2U) << "one to read its tables, one to work";
}

TEST_F(ProviderProcesses, WhateverEndsTheProcessIsNamedAndTheNextCallWorks) {
  ApartLimits limits;
  limits.seconds = 4;  // a busy machine needs two to give out the memory
  limits.memory = std::uint64_t{512} << 20;
  open(limits);
  const auto s = solver(model(2));
  const struct {
    double what;
    const char* words;
    bool lives;
  } all[] = {
    {1, "crashed (signal SIGSEGV)", false},
    {2, "crashed (signal SIGABRT)", false},
    {3, "ended its process (exit code 7)", false},
    {4, "did not answer for 4 s, and its process was ended", false},
    {5, "threw: thrown by hand", true},
#if !defined(__SANITIZE_ADDRESS__)
    {6, "threw: std::bad_alloc", true},
#endif
    {7, "ok", true},
    {8, "returned a value that is not a number", true},
    {10, "was killed from outside", false},
    {14, "threw an unknown exception", true},
    {15, "it printed \"assertion \\\"x > 0\\\" failed\"", false}
  };
  for (const auto& one : all) {
    SCOPED_TRACE(one.what);
    const std::uint64_t before = process()->starts();
    const std::string said = ask(*s, one.what);
    EXPECT_NE(said.find(one.words), std::string::npos) << said;
    if (said != "ok") {
      EXPECT_NE(said.find("reckless"), std::string::npos) << said;
    }
    if (!one.lives) {
      EXPECT_NE(said.find(kFile.substr(kFile.rfind('/'))), std::string::npos) << said;
      EXPECT_NE(said.find("The next call starts it anew."), std::string::npos) << said;
    }
    std::vector<double> tau;
    EXPECT_EQ(ask(*s, 0, 4, &tau), "ok") << "bound to its robot again";
    EXPECT_EQ(tau[1], 8);
    EXPECT_EQ(process()->starts(), before + (one.lives ? 0 : 1));
  }
}

TEST_F(ProviderProcesses, CrashInPrepareIsNamed) {
  open();
  const auto s = solver(model(2));
  const auto params = make_params(Map{{"gain", 1.0}});
  const auto bound = s->prepare(model(2, "crash in prepare"), *params);
  ASSERT_FALSE(bound.ok());
  EXPECT_NE(bound.error().message.find(kCrashed), std::string::npos);
  ASSERT_TRUE(s->prepare(model(2), *params).ok());
  std::vector<double> tau;
  EXPECT_EQ(ask(*s, 0, 4, &tau), "ok");
  EXPECT_EQ(tau[1], 4) << "the values of parameters arrive";
}

TEST_F(ProviderProcesses, CancelIsHeardAndEnforced) {
  open();
  const auto s = solver(model(2));
  After soon(50ms), later(50ms);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(ask(*s, 9, 1, nullptr, &soon), "cancelled.");
  EXPECT_EQ(process()->starts(), 2U);
  const std::string said = ask(*s, 4, 1, nullptr, &later);
  EXPECT_NE(said.find("did not stop when it was cancelled"), std::string::npos) << said;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 30s);
  EXPECT_EQ(ask(*s, 0), "ok");
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_F(ProviderProcesses, ConfinedProcessReachesNothing) {
  open();
  std::vector<double> done;
  EXPECT_EQ(ask(*solver(model(2)), 11, 1, &done), "ok");
  EXPECT_EQ(done[0], 0) << "what it could do, by bits of reckless_plugin.cpp";
}
TEST_F(ProviderProcesses, FreeProcessReachesWhatItsUserDoes) {
  ApartLimits limits;
  limits.confined = false;
  open(limits);
  std::vector<double> done;
  EXPECT_EQ(ask(*solver(model(2)), 11, 1, &done), "ok");
  EXPECT_EQ(static_cast<int>(done[0]) & 1, 1);
  ::unlink("/tmp/robomosp-reckless");
}
#endif

TEST_F(ProviderProcesses, SmashedMemoryHarmsNothing) {
  ApartLimits limits;
  limits.seconds = 5;
  open(limits);
  const auto s = solver(model(2));
  for (int i = 0; i < 40; ++i) {
    (void)ask(*s, 13, i);
    std::vector<double> tau;
    std::string said = ask(*s, 0, 3, &tau);
    if (said != "ok") said = ask(*s, 0, 3, &tau);
    ASSERT_EQ(said, "ok");
    ASSERT_EQ(tau[1], 6);
  }
}

TEST_F(ProviderProcesses, SeveralThreadsCallAtOnceAndKillsAreSurvived) {
  open();
  const auto s = solver(model(2));
  std::atomic<int> good{0}, ended{0}, wrong{0};
  std::atomic<bool> goes_on{true};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 2000; ++i) {
        std::vector<double> tau;
        const std::string said = ask(*s, 0, t * 10000 + i, &tau);
        if (said == "ok") ++(tau[1] == 2 * (t * 10000 + i) ? good : wrong);
        else ++(said.find("its process") != std::string::npos ? ended : wrong);
      }
    });
  std::thread killer([&] {
    std::mt19937 random(7);
    while (goes_on) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20 + random() % 40));
      if (const int pid = process()->process()) ::kill(pid, SIGKILL);
    }
  });
  for (std::thread& t : threads) t.join();
  goes_on = false;
  killer.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(good, 0);
  EXPECT_EQ(good + ended, 8000);
  (void)ask(*s, 0);  // which may be the one that hears of the last kill
  EXPECT_EQ(ask(*s, 0), "ok");
}

TEST_F(ProviderProcesses, ManyStartsLeaveNothing) {
  const bool is_long = std::getenv("ROBOMOSP_LONG") != nullptr;
  open();
  const auto s = solver(model(2));
  EXPECT_EQ(ask(*s, 0), "ok");
  process()->end();
  const std::size_t before = open_descriptors(), processes = children();
  for (int i = 0; i < (is_long ? 1000 : 50); ++i) {
    ASSERT_EQ(ask(*s, 0), "ok");
    process()->end();
  }
  EXPECT_EQ(open_descriptors(), before);
  EXPECT_EQ(children(), processes);
}

/// Whether a process is there and no zombie.
bool is_alive(int pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/stat");
  std::string number, name, state;
  return static_cast<bool>(in >> number >> name >> state) && state != "Z" && state != "X";
}

/// The program of the next test, which starts it: it says the number of its plugin's process, and
/// waits to be killed.
TEST_F(ProviderProcesses, DISABLED_Program) {
  open();
  const auto made = registry_.create<InverseDynamics>("reckless");
  const int pid = process()->process();
  ASSERT_EQ(::write(9, &pid, sizeof pid), static_cast<ssize_t>(sizeof pid));
  for (;;) ::pause();
}

TEST_F(ProviderProcesses, EndsWithTheProgramHoweverThatEnds) {
  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  const pid_t program = ::fork();
  if (program == 0) {
    ::dup2(pipe[1], 9);
    ::execl("/proc/self/exe", "program", "--gtest_also_run_disabled_tests",
            "--gtest_filter=ProviderProcesses.DISABLED_Program", nullptr);
    ::_exit(1);
  }
  ::close(pipe[1]);
  int pid = 0;
  ASSERT_EQ(::read(pipe[0], &pid, sizeof pid), static_cast<ssize_t>(sizeof pid));
  ::close(pipe[0]);
  ASSERT_GT(pid, 0);
  EXPECT_TRUE(is_alive(pid));
  ::kill(program, SIGKILL);
  ::waitpid(program, nullptr, 0);
  for (int i = 0; i < 500 && is_alive(pid); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_FALSE(is_alive(pid));
}

TEST_F(ProviderProcesses, PluginMovesBetweenTheProgramAndAProcess) {
  ASSERT_TRUE(loader_.load(kFile).loaded);
  EXPECT_EQ(process(), nullptr);
  std::vector<double> pid(1);
  NoProgress none;
  DynamicsBatch b;
  const auto inside = solver(model(2));
  ASSERT_TRUE(inside->inertia(b, pid, none).ok());
  EXPECT_EQ(static_cast<int>(pid[0]), ::getpid());
  open();
  ASSERT_TRUE(process());
  const auto outside = solver(model(2));
  ASSERT_TRUE(outside->inertia(b, pid, none).ok());
  EXPECT_EQ(static_cast<int>(pid[0]), process()->process());
  ASSERT_TRUE(inside->inertia(b, pid, none).ok());
  EXPECT_EQ(static_cast<int>(pid[0]), ::getpid()) << "what was made stays where it is";
  const PluginRunScope scope(PluginRun{});
  EXPECT_TRUE(loader_.load(kFile).loaded);
  EXPECT_EQ(process(), nullptr);
}

TEST_F(ProviderProcesses, OfOnePluginSomeProvidersRunApartAndTheRestInTheProgram) {
  const std::string file = std::string(ABI_PLUGIN_DIR) + "/abi_reckless_module.so";
  const auto load = [&](const PluginRun& run) {
    PluginRunScope scope(run);
    const auto report = loader_.load(file);
    EXPECT_TRUE(report.loaded);
    return std::pair(scope.refusal ? scope.refusal->sentence() : "", report.providers.size());
  };
  const auto where = [&] {
    NoProgress none;
    DynamicsBatch b;
    std::vector<double> pid(1);
    EXPECT_TRUE(solver(model(2))->inertia(b, pid, none).ok());
    return static_cast<int>(pid[0]);
  };
  PluginRuns& runs = PluginRuns::of_program();
  const std::size_t all = loader_.load(file).providers.size();
  const auto real = std::filesystem::canonical(file);
  // By name and interface, whatever the form; what adds commands stays.
  for (const char* word :
       {"reckless", "inverse_dynamics reckless", "robomosp.inverse_dynamics/1 reckless"}) {
    const auto [refusal, count] = load({false, {}, {word}});
    EXPECT_EQ(refusal, "") << word;
    EXPECT_EQ(count, all) << word;
    ASSERT_TRUE(runs.process(real)) << word;
    EXPECT_TRUE(runs.is_apart(real, InverseDynamics::kInterfaceId, "reckless"));
    EXPECT_FALSE(runs.is_apart(real, "robomosp.primitive/1", "brick"));
    const int first = where();
    EXPECT_EQ(first, runs.process(real)->process()) << word;
    // Its crash is its own.
    EXPECT_NE(ask(*solver(model(2)), 1).find(kCrashed), std::string::npos) << word;
    const int second = where();
    EXPECT_EQ(second, runs.process(real)->process()) << word;
    EXPECT_NE(first, second) << word;
    EXPECT_TRUE(registry_.create<Module>("adds").ok()) << word;
  }
  // What is not there, or cannot run so, changes nothing.
  EXPECT_NE(load({false, {}, {"no_such"}}).first.find("It has reckless, "), std::string::npos)
      << load({false, {}, {"no_such"}}).first;
  EXPECT_NE(load({false, {}, {"draws"}}).first.find("a renderer draws"), std::string::npos);
  EXPECT_NE(load({false, {}, {"adds"}}).first.find("adds commands"), std::string::npos);
  EXPECT_TRUE(runs.is_apart(real, InverseDynamics::kInterfaceId, "reckless"));
  EXPECT_EQ(load({true, {}, {}}).first, "");
  EXPECT_EQ(where(), ::getpid());
  EXPECT_FALSE(runs.process(real));
}

TEST_F(ProviderProcesses, WhatCannotMoveStaysAndWorks) {
  // A copy that is gone when it is to be opened again.
  const std::filesystem::path copy = std::filesystem::path(testing::TempDir()) / "moves.so";
  std::filesystem::copy_file(kFile, copy, std::filesystem::copy_options::overwrite_existing);
  ASSERT_TRUE(loader_.load(copy.string()).loaded);
  std::filesystem::remove(copy);
  std::ofstream(copy) << "no library";
  PluginRunScope scope(PluginRun{false, {}});
  EXPECT_TRUE(loader_.load(copy.string()).loaded);
  ASSERT_TRUE(scope.refusal);
  EXPECT_NE(scope.refusal->message.find("cannot open it"), std::string::npos)
      << scope.refusal->sentence();
  std::vector<double> tau;
  EXPECT_EQ(ask(*solver(model(2)), 0, 4, &tau), "ok");
  std::filesystem::remove(copy);
}

TEST_F(ProviderProcesses, CommandsStayWhereTheyAre) {
  const std::string file = std::string(ABI_PLUGIN_DIR) + "/abi_reckless_module.so";
  ASSERT_TRUE(loader_.load(file).loaded);
  PluginRunScope scope(PluginRun{false, {}});
  EXPECT_TRUE(loader_.load(file).loaded);
  ASSERT_TRUE(scope.refusal);
  EXPECT_NE(scope.refusal->message.find("adds commands, which stay where they are"),
            std::string::npos);
}

TEST_F(ProviderProcesses, RefusalsAreThoseOfTheLoader) {
  const PluginRunScope scope(PluginRun{false, {}});
  const std::string folder = ABI_PLUGIN_DIR;
  const auto refusal = [&](const char* name) {
    const auto& r = loader_.load(folder + "/" + name);
    return r.refusal ? r.refusal->sentence() : "it was loaded";
  };
  EXPECT_NE(refusal("abi_no_entry.so").find("does not export rmp_plugin_entry_v1"),
            std::string::npos);
  EXPECT_NE(refusal("abi_wrong_tag.so").find("its ABI tag"), std::string::npos);
  EXPECT_NE(refusal("abi_load_crashes.so").find("crashed (signal"), std::string::npos)
      << refusal("abi_load_crashes.so");
}

}  // namespace
}  // namespace robomosp
