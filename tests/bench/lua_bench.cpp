// SPDX-License-Identifier: Apache-2.0
// What a call from Lua costs; the target for a trivial command is 5 us.
#include <benchmark/benchmark.h>

#include "lua/lua_state.h"

namespace {

void calls(benchmark::State& state, const char* setup, const char* body) {
  using namespace robomosp;
  auto app = ioci::Application::create();
  if (!app.ok()) {
    state.SkipWithError(app.error().sentence().c_str());
    return;
  }
  ioci::Session session("bench");
  lua::LuaState lua(**app, session);
  const std::string code = std::string(setup) + " for i = 1, 1000 do " + body + " end";
  for (auto _ : state)
    if (auto r = lua.run_string(code, "bench"); !r.ok())
      state.SkipWithError(r.error().sentence().c_str());
  state.SetItemsProcessed(state.iterations() * 1000);
}

BENCHMARK_CAPTURE(calls, no_arguments, "local f = version", "f()")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(calls, name_of_a_handle,
                  "pcall(material.create, {name = 'b', density = 1}) local m = material 'b'",
                  "local n = m.name")
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(calls, get_by_name,
                  "pcall(material.create, {name = 'c', density = 1}) local f = material.get",
                  "f{name = 'c'}")
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(calls, array_entry, "local a = array{1, 2, 3}", "local x = a[2]")
    ->Unit(benchmark::kMicrosecond);

}  // namespace
