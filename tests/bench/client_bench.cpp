// SPDX-License-Identifier: Apache-2.0
// How long the thread of a window is held up by its client, at the worst, while a command of 30 s
// and a job run and updates come 60 times a second: never above a millisecond.
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include <benchmark/benchmark.h>

#include "ioci/client/client.h"
#include "ioci/core/commands.h"

namespace robomosp {
namespace {

using namespace std::chrono_literals;
using ioci::Client;
using Clock = std::chrono::steady_clock;

/// Computes for so long.
Result<Value> last(ioci::CommandContext& ctx, const Map& args) {
  const auto end = Clock::now() + std::chrono::duration<double>(ioci::real(args, "seconds"));
  while (Clock::now() < end && !ctx.progress.cancelled()) ctx.progress.report(0.5, "lasting");
  return Value();
}

/// A result that takes long to destroy.
Result<Value> much(ioci::CommandContext&, const Map&) {
  List out;
  for (int i = 0; i < 100'000; ++i) out.emplace_back(Map{{"name", "a name that is not short"}});
  return Value(std::move(out));
}

std::unique_ptr<ioci::Application> program() {
  ioci::ApplicationOptions options;
  options.plugins = false;
  auto app = std::move(*ioci::Application::create(std::move(options)));
  std::vector<ioci::CommandSpec> own;
  for (const auto& [name, run] : {std::pair{"bench.last", &last}, std::pair{"bench.much", &much}})
    own.push_back({.name = name,
                   .classic = "",
                   .summary = "For a benchmark.",
                   .details = "",
                   .example = "bench",
                   .params = {ioci::defaulted("seconds", "real", "s", 0.0, "How long.")},
                   .returns = {"any", "", "", {}},
                   .effect = Effect::reads,
                   .run = run});
  app->commands.add(std::move(own));
  return app;
}

/// The longest of a kind of call in each second; `lasts`: a command holds up the client's thread.
void client_longest(benchmark::State& state) {
  const auto app = program();
  const bool lasts = state.range(0) != 0;
  std::atomic<bool> is_woken{false};
  Client::Options options;
  options.wake = [&] { is_woken = true; };
  options.on_event = [](const ioci::Event&) {};
  const auto client = std::move(*Client::open(*app, std::move(options)));
  client->call("material.create", {{"name", "steel"}, {"density", 7850}});
  client->start("bench.last", {{"seconds", 3600}});
  const Client::Edits drag = client->begin_gesture("drag");
  double density = 1;
  double call = 0, update = 0, deliver = 0;
  const auto longest = [](double& most, const auto& fn) {
    const auto begin = Clock::now();
    fn();
    most = std::max(most, std::chrono::duration<double>(Clock::now() - begin).count());
  };
  for (auto _ : state) {
    double now = 0;
    const auto held = lasts ? client->call("bench.last", {{"seconds", 30}}) : Client::Answer();
    const auto begin = Clock::now();
    for (int i = 0; i < 60; ++i) {
      longest(update, [&] {
        client->update(drag, "material.set", {{"id", "steel"}, {"density", density += 1}});
      });
      longest(call, [&] { client->call(i % 20 == 0 ? "bench.much" : "material.list"); });
      const auto next = begin + (i + 1) * 16667us;
      while (Clock::now() < next) {
        if (is_woken.exchange(false)) longest(deliver, [&] { (void)client->deliver(); });
        std::this_thread::sleep_for(200us);
      }
    }
    longest(call, [&] { client->cancel(held); });
    now = std::max({call, update, deliver});
    state.SetIterationTime(now);
  }
  state.counters["call_us"] = call * 1e6;
  state.counters["update_us"] = update * 1e6;
  state.counters["deliver_us"] = deliver * 1e6;
}
BENCHMARK(client_longest)
    ->Arg(0)
    ->Arg(1)
    ->UseManualTime()
    ->Iterations(5)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace robomosp
