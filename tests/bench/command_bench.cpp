// SPDX-License-Identifier: Apache-2.0
// What commands take that programs give in thousands, the whole way from Lua (or JSON-RPC) to the
// published commit: checks, history, events. Times are processor time of the whole process, of all
// threads. How many allocations a call makes is counted beside.
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <benchmark/benchmark.h>

#include "kernel/literal.h"
#include "kernel/part_faults.h"
#include "lua/lua_state.h"
#include "support/allocations.h"

namespace {

using namespace robomosp;

/// A program with a Lua state; `setup` has run.
struct Program {
  explicit Program(const std::string& setup) {
    auto made = ioci::Application::create();
    if (!made.ok()) std::abort();
    app = std::move(*made);
    state.emplace(*app, session);
    run(setup);
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
};

/// One run of `code` in a program of its own, which is made and ended outside of the time.
void once(benchmark::State& state, const std::string& setup, const std::string& code) {
  for (auto _ : state) {
    state.PauseTiming();
    Program p(setup);
    state.ResumeTiming();
    p.run(code);
    state.PauseTiming();
    p.state.reset();
    p.app.reset();
    state.ResumeTiming();
  }
}

const std::string kHall =
    "solid.create{name = 'brick', root = {kind = 'box', x = 1, y = 1, z = 1}}\n"
    "cell = world.create{name = 'cell'}\n";

void add_objects_one_by_one(benchmark::State& state) {
  once(state, kHall,
       "for i = 1, " + std::to_string(state.range(0)) +
           " do cell:add_object{what = 'brick', name = 'o' .. i, position = {i, 0, 0}} end");
}
BENCHMARK(add_objects_one_by_one)
    ->Name("add_10000_objects_one_by_one")
    ->Arg(10'000)
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);
// The growth shows: a fortieth, a tenth, a quarter of it.
BENCHMARK(add_objects_one_by_one)
    ->Arg(250)
    ->Arg(1000)
    ->Arg(2500)
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// The same without names: each gets the first number that is free.
void add_unnamed_objects_one_by_one(benchmark::State& state) {
  once(state, kHall,
       "for i = 1, " + std::to_string(state.range(0)) + " do cell:add_object('brick') end");
}
BENCHMARK(add_unnamed_objects_one_by_one)
    ->Name("add_10000_unnamed_objects_one_by_one")
    ->Arg(10'000)
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

const std::string kMany =
    "local many = {} for i = 1, 10000 do many[i] = {what = 'brick', name = 'o' .. i, position = "
    "{i, 0, 0}} end\n";

void add_objects_at_once(benchmark::State& state) {
  once(state, kHall, kMany + "cell:add_objects(many)");
}
BENCHMARK(add_objects_at_once)
    ->Name("add_10000_objects_at_once")
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

void text_of_a_large_world(benchmark::State& state) {
  Program p(kHall + kMany + "cell:add_objects(many)");
  for (auto _ : state) p.run("local s = cell:text()");
}
BENCHMARK(text_of_a_large_world)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

/// What a form asks when it is drawn: the choices of each argument, and what all commands take.
void choices_of_a_form(benchmark::State& state) {
  Program p(kHall + kMany + "cell:add_objects(many)");
  for (auto _ : state)
    p.run(
        "for _, a in ipairs{'id', 'what', 'name'} do schema.choices{command = "
        "'world.add_object', argument = a, given = {id = 'cell'}} end");
}
BENCHMARK(choices_of_a_form)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

/// Processor time of this thread [s].
double thread_seconds() {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Every argument of every command, of a world with 10,000 objects, a robot, a task and a program:
/// all sources of choices. The time is that of the slowest answer.
void choices_of_every_argument(benchmark::State& state) {
  Program p(kHall + kMany +
            "cell:add_objects(many)\narm = robot.get('kr5')\n"
            "cell:add_robot{robot = arm, name = 'left'}\n"
            "task.create{name = 'job', steps = {{step = 'message', text = 'go'}}}\n"
            "program.create{name = 'weld', source = 'PROGRAM weld; BEGIN HALT; ENDPROGRAM;'}\n");
  const auto given = [](const ioci::CommandSpec& spec) {
    const std::string_view kind = spec.params.empty() ? "" : std::string_view(spec.params[0].type);
    for (const auto& [type, name] : {std::pair{"ref:world", "cell"},
                                     {"ref:robot", "kr5"},
                                     {"ref:solid", "brick"},
                                     {"ref:task", "job"},
                                     {"ref:program", "weld"}})
      if (kind == type) return Map{{"id", name}, {"robot", "left"}};
    return Map();
  };
  std::size_t asked = 0;
  for (auto _ : state) {
    double slowest = 0;
    for (const ioci::CommandSpec* spec : p.app->commands.list())
      for (const ParamSpec& param : spec->params) {
        const double begin = thread_seconds();
        const auto found = p.app->dispatch(
            p.session, "schema.choices",
            Map{{"command", spec->name}, {"argument", param.name}, {"given", given(*spec)}});
        benchmark::DoNotOptimize(found);
        const double took = thread_seconds() - begin;
        if (took > slowest) state.SetLabel(spec->name + " " + param.name);
        slowest = std::max(slowest, took);
        ++asked;
      }
    state.SetIterationTime(slowest);
  }
  state.counters["arguments"] =
      static_cast<double>(asked) / static_cast<double>(state.iterations());
}
BENCHMARK(choices_of_every_argument)
    ->Name("slowest_choices_of_any_argument")
    ->Iterations(3)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

/// The check of the parts of an argument with many rows.
void check_rows(benchmark::State& state, const char* command, const char* argument,
                const char* row) {
  Program p(kHall);
  const ioci::CommandSpec* spec = p.app->commands.find(command);
  const auto one = read_literal(row);
  if (!spec || !one.ok()) std::abort();
  const ParamSpec& param = *find_param(spec->params, argument);
  const Value rows(List(static_cast<std::size_t>(state.range(0)), *one));
  for (auto _ : state) benchmark::DoNotOptimize(part_faults(param, rows, argument));
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK_CAPTURE(check_rows, links, "robot.create", "links", "{a = 0.3, alpha = 0.5, d = 0.1}")
    ->Arg(10)
    ->Arg(1000)
    ->Arg(100'000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(check_rows, objects, "world.add_objects", "objects",
                  "{what = \"brick\", name = \"o\", position = {1, 0, 0}}")
    ->Arg(10)
    ->Arg(1000)
    ->Arg(100'000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(check_rows, segments, "trajectory.create", "segments",
                  "{shape = \"line\", points = {{0, 0, 0}, {0.1, 0, 0}}, speed = 0.1}")
    ->Arg(10)
    ->Arg(1000)
    ->Arg(100'000)
    ->Unit(benchmark::kMicrosecond);

/// The first call of a program describes each command.
void describe_all_commands_first(benchmark::State& state) {
  for (auto _ : state) {
    state.PauseTiming();
    Program p(kHall);
    state.ResumeTiming();
    benchmark::DoNotOptimize(p.app->dispatch(p.session, "ioci.describe", Map()));
    state.PauseTiming();
    p.state.reset();
    p.app.reset();
    state.ResumeTiming();
  }
}
BENCHMARK(describe_all_commands_first)
    ->Iterations(3)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// The same with all of it as tables of Lua.
void describe_all_commands_in_lua(benchmark::State& state) {
  once(state, kHall, "ioci.describe()");
}
BENCHMARK(describe_all_commands_in_lua)
    ->Iterations(3)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

void describe_all_commands(benchmark::State& state) {
  Program p(kHall);
  for (auto _ : state) benchmark::DoNotOptimize(p.app->dispatch(p.session, "ioci.describe", Map()));
}
BENCHMARK(describe_all_commands)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

void place_in_a_large_world(benchmark::State& state) {
  Program p(kHall + kMany + "cell:add_objects(many)");
  for (auto _ : state)
    p.run(
        "for i = 1, 100 do cell:place{member = 'o' .. 100 * i, position = {0, math.random(), 0}} "
        "end");
  state.SetItemsProcessed(state.iterations() * 100);
}
BENCHMARK(place_in_a_large_world)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

void chain_of_parameters(benchmark::State& state) {
  once(state, kHall + "brick = solid 'brick' brick:set_parameter('p1', '1 mm')",
       "for i = 2, " + std::to_string(state.range(0)) +
           " do brick:set_parameter('p' .. i, 'p' .. i - 1 .. ' + 1 mm') end");
}
BENCHMARK(chain_of_parameters)
    ->Name("chain_of_3000_parameters")
    ->Arg(3000)
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(chain_of_parameters)
    ->Arg(300)
    ->Arg(1000)
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// Its first parameter changes, so that all others follow.
void first_of_a_chain(benchmark::State& state) {
  Program p(kHall +
            "brick = solid 'brick' brick:set_parameter('p1', '1 mm')\n"
            "for i = 2, 3000 do brick:set_parameter('p' .. i, 'p' .. i - 1 .. ' + 1 mm') end");
  for (auto _ : state) p.run("brick:set_parameter('p1', math.random())");
}
BENCHMARK(first_of_a_chain)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

void save_all(benchmark::State& state) {
  const auto folder = std::filesystem::temp_directory_path() /
                      ("robomosp_command_bench_" + std::to_string(::getpid()));
  for (auto _ : state) {
    state.PauseTiming();
    std::filesystem::create_directories(folder);
    Program p("ioci.transaction('fill', function()\nfor i = 1, " + std::to_string(state.range(0)) +
              " do material.create{name = 'm' .. i, density = i} end\nend)");
    state.ResumeTiming();
    p.run("file.save_all('" + folder.string() + "')");
    state.PauseTiming();
    std::filesystem::remove_all(folder);
    state.ResumeTiming();
  }
}
BENCHMARK(save_all)
    ->Name("save_all_of_8000")
    ->Arg(8000)
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// A thousand calls a run, with what one allocates by operator new.
void calls(benchmark::State& state, const std::string& setup, const std::string& call) {
  Program p(setup);
  const std::string code = "for i = 1, 1000 do " + call + " end";
  p.run(code);
  const std::size_t before = test::allocations;
  for (auto _ : state) p.run(code);
  const double n = static_cast<double>(state.iterations()) * 1000;
  state.counters["allocations"] = static_cast<double>(test::allocations - before) / n;
  state.SetItemsProcessed(state.iterations() * 1000);
}

/// The choices of each argument of a command with many sources, in a small world.
void choices_of_plan_path(benchmark::State& state) {
  Program p(
      "arm = robot.get('kr5')\ncell = world.create{name = 'cell'}\n"
      "cell:add_robot{robot = arm, name = 'left'}");
  const Map given{{"id", "cell"}, {"robot", "left"}};
  const ioci::CommandSpec* plan = p.app->commands.find("world.plan_path");
  for (auto _ : state)
    for (const ParamSpec& param : plan->params) {
      const auto found =
          p.app->dispatch(p.session, "schema.choices",
                          Map{{"command", plan->name}, {"argument", param.name}, {"given", given}});
      benchmark::DoNotOptimize(found);
    }
}
BENCHMARK(choices_of_plan_path)->Unit(benchmark::kMillisecond);

/// The unit is that of a thousand calls, so a millisecond stands for a microsecond a call.
BENCHMARK_CAPTURE(calls, trivial, "", "version()")
    ->Name("thousand_trivial_calls")
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(calls, forward_kinematics,
                  "arm = robot.create{name = 'arm', links = {{a = 0.4}, {a = 0.3, alpha = 1.5}, {a "
                  "= 0.2}, {a = 0.1, alpha = 1}, {a = 0.1}, {a = 0.1}}}\n"
                  "q = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6}",
                  "arm:fk{q = q}")
    ->Name("thousand_forward_kinematics")
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(calls, edit_beside_10000_records,
                  "ioci.transaction('fill', function() for i = 1, 10000 do material.create{name = "
                  "'m' .. i, density = i} end end)\nm = material 'm5000'",
                  "m:set{density = i}")
    ->Name("thousand_edits_beside_10000_records")
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// A commit that so many subscriptions are notified of, which never read.
void listeners(benchmark::State& state) {
  Program p("m = material.create{name = 'm', density = 1}");
  std::vector<std::uint64_t> tokens;
  for (std::int64_t i = 0; i < state.range(0); ++i)
    tokens.push_back(p.app->events.subscribe({}, {}));
  double density = 1;
  const auto id = p.app->dispatch(p.session, "material.get", Map{{"name", "m"}});
  for (auto _ : state) {
    density += 1;
    if (!p.app->dispatch(p.session, "material.set", Map{{"id", *id}, {"density", density}}).ok())
      state.SkipWithError("the edit failed");
  }
}
BENCHMARK(listeners)
    ->Name("commit_without_listeners")
    ->Arg(0)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(listeners)
    ->Name("commit_with_100_listeners")
    ->Arg(100)
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMicrosecond);

/// The processor time of the program that answers, start and end included, for 100,000 requests.
void json_rpc(benchmark::State& state) {
  constexpr int kRequests = 100'000;
  const std::string program = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp";
  for (auto _ : state) {
    int in[2], out[2];
    if (::pipe(in) != 0 || ::pipe(out) != 0) std::abort();
    const pid_t child = ::fork();
    if (child == 0) {
      ::dup2(in[0], 0);
      ::dup2(out[1], 1);
      for (const int fd : {in[0], in[1], out[0], out[1]}) ::close(fd);
      ::execl(program.c_str(), program.c_str(), "rpc", static_cast<char*>(nullptr));
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(out[1]);
    FILE* requests = ::fdopen(in[1], "w");
    FILE* answers = ::fdopen(out[0], "r");
    char line[4096];
    for (int i = 0; i < kRequests; ++i) {
      std::fprintf(requests,
                   R"({"jsonrpc": "2.0", "id": %d, "method": "version"})"
                   "\n",
                   i);
      std::fflush(requests);
      if (!std::fgets(line, sizeof line, answers)) state.SkipWithError("no answer");
    }
    std::fclose(requests);
    std::fclose(answers);
    struct rusage used {};
    int status = 0;
    ::wait4(child, &status, 0, &used);
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    state.SetIterationTime((seconds(used.ru_utime) + seconds(used.ru_stime)) / kRequests);
  }
}
BENCHMARK(json_rpc)->Iterations(1)->UseManualTime()->Unit(benchmark::kMicrosecond);

}  // namespace
