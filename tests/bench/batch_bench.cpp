// SPDX-License-Identifier: Apache-2.0
// 10,000 states of a PUMA 560 through one command, from Lua and over JSON-RPC, beside the kernels
// that compute them: processor time of all threads, the two in turns, medians. `ratio` is the
// command over the kernel; it should be 2 at most.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>

#include "lua/lua_state.h"
#include "remote/json.h"
#include "robotics/batch_kinematics.h"

namespace {

using namespace robomosp;

constexpr std::size_t kStates = 10'000;

/// The program with its library and plugins, a robot and states in globals of Lua.
struct Program {
  Program() {
    ioci::ApplicationOptions options;
    options.library = {std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/library"};
    options.plugin_path = {ROBOMOSP_PLUGIN_DIR};
    auto made = ioci::Application::create(std::move(options));
    if (!made.ok()) std::abort();
    app = std::move(*made);
    state.emplace(*app, session);
    run("arm = robot 'puma560'\n"
        "local function states(most)\n"
        "  local rows = {}\n"
        "  for i = 1, " +
        std::to_string(kStates) +
        " do\n"
        "    rows[i] = {}\n"
        "    for j = 1, 6 do rows[i][j] = (2 * math.random() - 1) * most end\n"
        "  end\n"
        "  return linalg.rows(rows)\n"
        "end\n"
        "Q, QD, U = states(0.7), states(1), states(3)");
    const auto id = app->dispatch(session, "robot.get", Map{{"name", "puma560"}});
    NoProgress none;
    model = *app->derived.robot_model(*app->document.now(), RobotId{id->as_handle()->number},
                                      {0, 0, -9.81}, none);
    for (const char* name : {"Q", "QD", "U"}) {
      const auto values = state->eval_values(name);
      const Numbers numbers = values->front().as_array()->data();
      states.emplace_back(numbers.begin(), numbers.end());
    }
  }
  void run(const std::string& code) {
    if (auto r = state->run_string(code, "bench"); !r.ok()) {
      std::fprintf(stderr, "%s\n", r.error().sentence().c_str());
      std::abort();
    }
  }
  std::unique_ptr<ioci::Application> app;
  ioci::Session session{"bench"};
  std::optional<lua::LuaState> state;
  std::shared_ptr<const RobotModel> model;
  std::vector<std::vector<double>> states;  ///< q, qd, and what they are driven by
};
Program& program() {
  static Program p;
  return p;
}

double now() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

/// `call` beside `kernel`, in turns.
void compare(benchmark::State& state, const std::function<double()>& call,
             const std::function<void()>& kernel) {
  std::vector<double> calls, kernels;
  for (auto _ : state) {
    const double start = now();
    kernel();
    kernels.push_back(now() - start);
    calls.push_back(call());
    state.SetIterationTime(calls.back());
  }
  state.counters["kernel_us"] = 1e6 * median(kernels);
  state.counters["command_us"] = 1e6 * median(calls);
  state.counters["ratio"] = median(calls) / median(kernels);
}

template <class Interface>
std::unique_ptr<Interface> provider(const char* name) {
  auto found = conformance::find_provider<Interface>(
      std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so", name);
  if (!found.ok()) std::abort();
  auto made = conformance::create<Interface>(**found);
  if (!made->prepare(*program().model, conformance::TableParams(**found)).ok()) std::abort();
  return made;
}

enum class What { inverse_dynamics, gravity_torques, inertia, forward_dynamics, fk, jacobian };

/// The kernel of a command, into memory that is there.
std::function<void()> kernel_of(What what) {
  const Program& p = program();
  const std::size_t n = p.model->dof();
  const auto out = std::make_shared<std::vector<double>>(kStates * n * n);
  if (what == What::fk || what == What::jacobian) {
    const auto kinematics = std::make_shared<robotics::BatchKinematics>(*p.model);
    const auto scratch = std::make_shared<std::vector<double>>(kinematics->scratch_size());
    const auto poses = std::make_shared<std::vector<Pose>>(kStates);
    if (what == What::fk)
      return [=, &p] { kinematics->tip_poses(0, p.states[0], *poses, *scratch); };
    return [=, &p] {
      kinematics->jacobians(0, p.states[0], robotics::JacobianFrame::world, {},
                            std::span(*out).first(6 * n * kStates), *scratch);
    };
  }
  DynamicsBatch b;
  b.count = kStates;
  b.q = p.states[0];
  if (what == What::gravity_torques) {
    b.terms = kGravityTerm;
  } else if (what != What::inertia) {
    b.qd = p.states[1];
    (what == What::forward_dynamics ? b.tau : b.qdd) = p.states[2];
  }
  NoProgress none;
  if (what == What::forward_dynamics) {
    const std::shared_ptr<ForwardDynamics> solver = provider<ForwardDynamics>("inertia_matrix");
    const auto scratch = std::make_shared<std::vector<double>>(solver->scratch_size());
    return [=]() mutable {
      b.scratch = *scratch;
      if (!solver->accelerations(b, std::span(*out).first(n * kStates), none).ok()) std::abort();
    };
  }
  const std::shared_ptr<InverseDynamics> solver = provider<InverseDynamics>("newton_euler");
  const auto scratch = std::make_shared<std::vector<double>>(solver->scratch_size());
  return [=]() mutable {
    b.scratch = *scratch;
    const auto done = what == What::inertia
                          ? solver->inertia(b, *out, none)
                          : solver->torques(b, std::span(*out).first(n * kStates), none);
    if (!done.ok()) std::abort();
  };
}

void from_lua(benchmark::State& state, What what, const char* call) {
  Program& p = program();
  const std::string code = std::string("local answer = arm:") + call;
  const auto kernel = kernel_of(what);
  compare(
      state,
      [&] {
        const double start = now();
        p.run(code);
        return now() - start;
      },
      kernel);
}

#define FROM_LUA(what, call)                          \
  BENCHMARK_CAPTURE(from_lua, what, What::what, call) \
      ->UseManualTime()                               \
      ->Unit(benchmark::kMicrosecond)
FROM_LUA(inverse_dynamics, "inverse_dynamics(Q, QD, U)");
FROM_LUA(gravity_torques, "gravity_torques(Q)");
FROM_LUA(inertia, "inertia(Q)");
FROM_LUA(forward_dynamics, "forward_dynamics(Q, QD, U)");
FROM_LUA(fk, "fk(Q)");
FROM_LUA(jacobian, "jacobian(Q)");

/// Calls of robot.solve_ik for poses of the PUMA's states, one at a time, beside its solver alone;
/// aim: 15 us a call. A thousand of them a run.
void solve_ik(benchmark::State& state) {
  constexpr std::size_t kCalls = 1000;
  Program& p = program();
  p.run(
      "if not targets then\n"
      "  targets = {}\n"
      "  local poses = arm:fk(Q).pose\n"
      "  for i = 1, 1000 do targets[i] = poses[i]:reshape(4, 4) end\n"
      "end");
  auto found = conformance::find_provider<IkSolver>(
      std::string(ROBOMOSP_PLUGIN_DIR) + "/ik_spherical_wrist.so", "spherical_wrist");
  if (!found.ok()) std::abort();
  const auto solver = conformance::create<IkSolver>(**found);
  if (!solver->prepare(*p.model, conformance::TableParams(**found)).ok()) std::abort();
  const robotics::BatchKinematics kinematics(*p.model);
  std::vector<double> scratch(kinematics.scratch_size());
  std::vector<Pose> targets(kStates);
  kinematics.tip_poses(0, p.states[0], targets, scratch);
  compare(
      state,
      [&] {
        const double start = now();
        p.run("for i = 1, 1000 do arm:solve_ik{target = targets[i]} end");
        return now() - start;
      },
      [&] {
        NoProgress none;
        for (std::size_t i = 0; i < kCalls; ++i) {
          std::vector<IkResult> result(1);
          IkBatch batch;
          batch.targets = {&targets[i], 1};
          (void)solver->solve(batch, result, none);
          benchmark::DoNotOptimize(result.data());
        }
      });
  state.counters["one_call_us"] = state.counters["command_us"].value / kCalls;
  state.counters["aim_us"] = 15;
}
BENCHMARK(solve_ik)->UseManualTime()->Unit(benchmark::kMicrosecond);

/// A child that serves JSON-RPC, and the processor time that it has taken.
class Server {
 public:
  Server() {
    int in[2], out[2];
    if (::pipe(in) != 0 || ::pipe(out) != 0) std::abort();
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(in[0], 0);
      ::dup2(out[1], 1);
      for (const int fd : {in[0], in[1], out[0], out[1]}) ::close(fd);
      const std::string path = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp";
      const std::string library = std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/library";
      ::setenv("ROBOMOSP_LIBRARY", library.c_str(), 1);
      ::execl(path.c_str(), path.c_str(), "rpc", static_cast<char*>(nullptr));
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(out[1]);
    requests_ = ::fdopen(in[1], "w");
    answers_ = ::fdopen(out[0], "r");
    if (::clock_getcpuclockid(child_, &clock_) != 0) std::abort();
    ask(R"({"jsonrpc":"2.0","id":0,"method":"robot.get","params":["puma560"]})"
        "\n");
  }
  ~Server() {
    std::fclose(requests_);
    std::fclose(answers_);
    std::free(line_);
    ::waitpid(child_, nullptr, 0);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// Bytes of the answer.
  std::size_t ask(const std::string& request) {
    std::fwrite(request.data(), 1, request.size(), requests_);
    std::fflush(requests_);
    const ssize_t got = ::getline(&line_, &room_, answers_);
    if (got < 0 || std::string_view(line_, 200).find("\"error\"") != std::string_view::npos)
      std::abort();
    return static_cast<std::size_t>(got);
  }
  [[nodiscard]] double used() const {
    timespec t{};
    clock_gettime(clock_, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }

 private:
  pid_t child_ = 0;
  clockid_t clock_{};
  FILE *requests_ = nullptr, *answers_ = nullptr;
  char* line_ = nullptr;
  std::size_t room_ = 0;
};

void over_json_rpc(benchmark::State& state, What what, const char* method,
                   std::vector<const char*> names, bool as_base64) {
  const Program& p = program();
  Map params{{"id", "puma560"}};
  for (std::size_t i = 0; i < names.size(); ++i)
    params.set(names[i], NumericArray(p.states[i], kStates, 6));
  const auto arrays = as_base64 ? remote::Arrays::base64 : remote::Arrays::numbers;
  const std::string request = std::string(R"({"jsonrpc":"2.0","id":1,"method":"robot.)") + method +
                              R"(","params":)" + remote::to_json(params, {}, arrays) +
                              (as_base64 ? R"(,"arrays":"base64"})" : "}") + "\n";
  static Server server;
  const auto kernel = kernel_of(what);
  std::size_t answered = 0;
  compare(
      state,
      [&] {
        const double start = server.used();
        answered = server.ask(request);
        return server.used() - start;
      },
      kernel);
  state.counters["sent_kB"] = 1e-3 * static_cast<double>(request.size());
  state.counters["answered_kB"] = 1e-3 * static_cast<double>(answered);
}

using Names = std::vector<const char*>;
#define OVER_JSON_RPC(what, ...)                                                        \
  BENCHMARK_CAPTURE(over_json_rpc, what##_base64, What::what, #what, __VA_ARGS__, true) \
      ->UseManualTime()                                                                 \
      ->Unit(benchmark::kMicrosecond)
OVER_JSON_RPC(inverse_dynamics, Names{"q", "qd", "qdd"});
OVER_JSON_RPC(gravity_torques, Names{"q"});
OVER_JSON_RPC(inertia, Names{"q"});
OVER_JSON_RPC(forward_dynamics, Names{"q", "qd", "tau"});
OVER_JSON_RPC(fk, Names{"q"});
OVER_JSON_RPC(jacobian, Names{"q"});
BENCHMARK_CAPTURE(over_json_rpc, inverse_dynamics_numbers, What::inverse_dynamics,
                  "inverse_dynamics", Names{"q", "qd", "qdd"}, false)
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);

}  // namespace
