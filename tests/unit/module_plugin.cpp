// SPDX-License-Identifier: Apache-2.0
// A plugin with two modules for module_test.cpp: "bench", whose commands do everything that a
// module may do and much that it may not, and "late", which is in a file of its own (CASE_LATE).
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <thread>

#include <robomosp/sdk/module.h>

namespace {

using namespace robomosp;

[[maybe_unused]] Result<ModuleValue> echo(const Module&, const ModuleValue& args, ModuleCall&) {
  return args["value"];
}

#if defined(CASE_CRASH)
class Crash final : public Module {
 public:
  const ModuleTable& table() const override { std::abort(); }
};
#elif defined(CASE_LATE)
const rmp_param kEcho[] = {{"id", "ref:material", "", "A material.", nullptr, nullptr, 1, 0},
                           {"value", "any", "", "A value.", nullptr, nullptr, 1, 0, RMP_OPTIONAL}};
const rmp_param kPlain[] = {{"value", "any", "", "A value.", nullptr, nullptr, 1, 0, RMP_OPTIONAL}};

/// As a later SDK would have it: rows and the table are longer.
struct LaterCommand {
  ModuleCommand now;
  const char* later = "what this program does not know";
};
struct LaterTable {
  ModuleTable now;
  std::uint64_t later = ~0ULL;
};

class Late final : public Module {
 public:
  const ModuleTable& table() const override {
    static const LaterCommand commands[] = {
        {{"material.late",
          "Gives its value.",
          "",
          "x",
          "reads",
          "",
          kEcho,
          "any",
          "",
          "",
          {},
          &echo}},
        {{"late.echo", "Gives its value.", "", "x", "reads", "", kPlain, "any", "", "", {}, &echo}},
        {{"bench.echo",
          "Gives its value.",
          "",
          "x",
          "reads",
          "",
          kPlain,
          "any",
          "",
          "",
          {},
          &echo}}};
    static const LaterTable t = [] {
      LaterTable all;
      all.now.struct_size = sizeof(LaterTable);
      all.now.commands = &commands[0].now;
      all.now.command_count = 3;
      all.now.command_size = sizeof(LaterCommand);
      return all;
    }();
    return t.now;
  }
};
#else

/// What hooks heard, for the command bench.heard.
std::atomic<int> before{0}, after{0}, failures{0};

const rmp_param kAny[] = {{"value", "any", "", "A value.", nullptr, nullptr, 1, 0, RMP_OPTIONAL}};
const rmp_param kAsk[] = {
    {"command", "string", "", "A command.", nullptr, nullptr, 1, 0},
    {"arguments", "map", "", "Its arguments.", nullptr, nullptr, 1, 0, RMP_OPTIONAL}};
const rmp_param kTyped[] = {
    {"length", "real", "m", "A length.", "5 mm", nullptr, 0, 2},
    {"mode", "enum", "", "A word.", "fast", "fast|slow", 1, 0},
    {"place", "pose", "", "A place.", nullptr, nullptr, 1, 0, RMP_OPTIONAL}};
const rmp_param kMaterial[] = {{"id", "ref:material", "", "A material.", nullptr, nullptr, 1, 0}};
const rmp_param kSeconds[] = {{"seconds", "real", "s", "How long.", "30", nullptr, 0, 100}};
const rmp_param kSettings[] = {
    {"gap", "real", "m", "A gap.", "2 mm", nullptr, 0, 1},
    {"veto", "string", "", "Commands that may not run.", "", nullptr, 1, 0},
    {"hook", "enum", "", "What the hooks do.", "look", "look|edit|throw|fail_after", 1, 0},
    {"weights", "real[]", "", "Some numbers.", "{1, 2}", nullptr, 1, 0}};
const rmp_param kTyping[] = {{"name", "string", "", "Its name.", nullptr, nullptr, 1, 0},
                             {"density", "real", "kg/m^3", "Mass.", nullptr, nullptr, 1, 0}};

Result<ModuleValue> typed(const Module&, const ModuleValue& args, ModuleCall&) {
  return ModuleValue::list({args["length"], args["mode"], args["place"]});
}
Result<ModuleValue> name_of(const Module&, const ModuleValue& args, ModuleCall& call) {
  RMP_TRY_ASSIGN(const std::string name, call.name(args["id"]));
  return ModuleValue::map().set("name", name).set("density", 1.5);
}
Result<ModuleValue> extra(const Module&, const ModuleValue&, ModuleCall&) {
  return ModuleValue::map().set("name", "x").set("density", 1.0).set("colour", "red");
}
Result<ModuleValue> ask(const Module&, const ModuleValue& args, ModuleCall& call) {
  return call.run(args["command"].text(), args["arguments"]);
}
Result<ModuleValue> two_edits(const Module&, const ModuleValue&, ModuleCall& call) {
  for (const char* name : {"one", "two"})
    RMP_TRY(call.run("material.create", ModuleValue::map().set("name", name).set("density", 1000.0))
                    .ok()
                ? Result<void>()
                : Result<void>(error(ErrorCode::conflict, std::string("no material ") + name)));
  return ModuleValue();
}
Result<ModuleValue> wait(const Module&, const ModuleValue& args, ModuleCall& call) {
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(args["seconds"].real());
  while (std::chrono::steady_clock::now() < end) {
    if (call.progress().cancelled()) return error(ErrorCode::cancelled, "the wait was cancelled");
    call.progress().report(0.25, "waiting");
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return ModuleValue("waited");
}
Result<ModuleValue> throws(const Module&, const ModuleValue&, ModuleCall&) {
  throw std::runtime_error("a bug of the author");
}
Result<ModuleValue> throws_int(const Module&, const ModuleValue&, ModuleCall&) { throw 7; }
Result<ModuleValue> not_a_number(const Module&, const ModuleValue&, ModuleCall&) {
  return ModuleValue::list({ModuleValue(1.0), ModuleValue(std::vector<double>{0, std::nan("")})});
}
Result<ModuleValue> wrong_type(const Module&, const ModuleValue&, ModuleCall&) {
  return ModuleValue("five");
}
Result<ModuleValue> wrong_matrix(const Module&, const ModuleValue&, ModuleCall&) {
  return ModuleValue::matrix({1, 2, 3}, 2, 2);
}
/// What a later SDK may hand over; the type comes first in a value.
Result<ModuleValue> later_type(const Module&, const ModuleValue&, ModuleCall&) {
  ModuleValue v;
  const std::uint32_t type = 77;
  std::memcpy(static_cast<void*>(&v), &type, sizeof type);
  return v;
}
Result<ModuleValue> too_deep(const Module&, const ModuleValue&, ModuleCall&) {
  ModuleValue v(1.0);
  for (int i = 0; i < 100; ++i) v = ModuleValue::list({v});
  return v;
}
Result<ModuleValue> dangling(const Module&, const ModuleValue&, ModuleCall&) {
  return ModuleValue::reference("material", 1234567);
}
Result<ModuleValue> misreads(const Module&, const ModuleValue&, ModuleCall& call) {
  return call.run("no.such_command", ModuleValue()).value();
}
Result<ModuleValue> other_thread(const Module&, const ModuleValue&, ModuleCall& call) {
  Result<ModuleValue> got = ModuleValue();
  std::thread([&] { got = call.run("material.create", ModuleValue()); }).join();
  return got;
}
Result<ModuleValue> endless(const Module&, const ModuleValue&, ModuleCall& call) {
  return call.run("bench.endless", ModuleValue());
}
Result<ModuleValue> get_setting(const Module&, const ModuleValue& args, ModuleCall& call) {
  return call.setting(args["value"].text());
}
Result<ModuleValue> heard(const Module&, const ModuleValue&, ModuleCall& call) {
  call.say(2, "hooks were counted");
  return ModuleValue::map()
      .set("before", before.load())
      .set("after", after.load())
      .set("failures", failures.load());
}

class Bench final : public Module {
 public:
  const ModuleTable& table() const override {
    const auto row = [](const char* name, ModuleFields params, const char* result,
                        decltype(ModuleCommand::run) run, const char* effects = "reads") {
      ModuleCommand c;
      c.name = name;
      c.summary = "Is of a test.";
      c.example = "assert(true)";
      c.params = params;
      c.result_type = result;
      c.run = run;
      c.effects = effects;
      return c;
    };
    static const ModuleCommand commands[] = {
        row("bench.echo", kAny, "any", echo),
        row("bench.typed", kTyped, "list", typed),
        [&] {
          ModuleCommand c = row("material.bench_name", kMaterial, "map", name_of);
          c.result_fields = kTyping;
          return c;
        }(),
        [&] {
          ModuleCommand c = row("bench.extra_field", {}, "map", extra);
          c.result_fields = kTyping;
          return c;
        }(),
        row("bench.ask", kAsk, "any", ask),
        row("bench.ask_to_edit", kAsk, "any", ask, "edits"),
        row("bench.two_edits", {}, "nil", two_edits, "edits"),
        row("bench.wait", kSeconds, "string", wait),
        row("bench.throws", {}, "nil", throws),
        row("bench.throws_int", {}, "nil", throws_int),
        row("bench.not_a_number", {}, "list", not_a_number),
        row("bench.wrong_type", {}, "real", wrong_type),
        row("bench.wrong_matrix", {}, "any", wrong_matrix),
        row("bench.too_deep", {}, "any", too_deep),
        row("bench.later_type", {}, "any", later_type),
        row("bench.dangling", {}, "handle", dangling),
        row("bench.misreads", {}, "any", misreads),
        row("bench.other_thread", {}, "any", other_thread, "edits"),
        row("bench.endless", {}, "any", endless),
        row("bench.setting", kAny, "any", get_setting),
        row("bench.heard", {}, "map", heard),
        // Left out, each for a reason of its own:
        row("robot.fk", {}, "nil", throws),
        row("bench.echo", {}, "nil", throws),
        row("Bench", {}, "nil", throws),
        row("bench.bad_effect", {}, "nil", throws, "reads,magic"),
        row("bench.nothing", {}, "nil", nullptr),
        row("bench.bad_result", {}, "tensor", throws),
        row("robot.of_material", kMaterial, "nil", throws),
    };
    static const ModuleTable t = [] {
      ModuleTable all;
      all.commands = commands;
      all.command_count = static_cast<std::uint32_t>(std::size(commands));
      all.settings = kSettings;
      all.runs = kModuleRunSimulation | kModuleRunTask | kModuleRunJob;
      return all;
    }();
    return t;
  }
  Result<void> before_run(const ModuleRunNotice& run, ModuleCall& call) const override {
    RMP_TRY_ASSIGN(const ModuleValue veto, call.setting("veto"));
    RMP_TRY_ASSIGN(const ModuleValue hook, call.setting("hook"));
    if (hook.text() == "throw") throw std::runtime_error("a bug in a hook");
    if (hook.text() == "edit")
      RMP_TRY(
          call.run("material.create", ModuleValue::map().set("name", "m").set("density", 1.0)).ok()
              ? Result<void>()
              : Result<void>(error(ErrorCode::permission, "hooks cannot edit")));
    if (veto.text() == run.command)
      return error(ErrorCode::conflict, "the bench is locked", "Unlock it.");
    ++before;
    return {};
  }
  Result<void> after_run(const ModuleRunNotice&, const ModuleRunEnd& end,
                         ModuleCall& call) const override {
    ++after;
    if (!end.error.empty()) ++failures;
    RMP_TRY_ASSIGN(const ModuleValue hook, call.setting("hook"));
    if (hook.text() == "fail_after") return error(ErrorCode::io, "the log is full");
    return {};
  }
};
#endif

}  // namespace

#if defined(CASE_CRASH)
RMP_PLUGIN("org.robomosp.test_crash", "1.0.0", "Apache-2.0", "A plugin of a test.",
           RMP_PROVIDER_NO_PARAMS(Crash, "crash", "Ends the program.", ""))
#elif defined(CASE_LATE)
RMP_PLUGIN("org.robomosp.test_late", "1.0.0", "Apache-2.0", "A plugin of a test.",
           RMP_PROVIDER_NO_PARAMS(Late, "late", "Comes later.", ""))
#else
RMP_PLUGIN("org.robomosp.test_bench", "1.0.0", "Apache-2.0", "A plugin of a test.",
           RMP_PROVIDER_NO_PARAMS(Bench, "bench", "Commands of a test.", ""))
#endif
