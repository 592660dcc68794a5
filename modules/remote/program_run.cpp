// SPDX-License-Identifier: Apache-2.0
// program.run_remote: a program that is run here moves a world that another program serves. The
// interpreter, the clock and the motions are this program's; robots, held objects and signals over
// there follow by commands, and signals that others set there count here.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "ioci/core/commands.h"
#include "ioci/program/in_world.h"
#include "ioci/simulation/run_start.h"
#include "ioci/simulation/task_run.h"
#include "kernel/text.h"
#include "remote/connections.h"
#include "spatial/rotation.h"
#include "task/run.h"

namespace robomosp::remote {
namespace {

using namespace ioci;
using Clock = std::chrono::steady_clock;

/// How often robots over there are told where they stand, in the time of the program [s].
constexpr double kBetweenPlaces = 0.04;
/// How long a wait for others lasts before it looks whether the user wants an end [s].
constexpr double kRunLook = 0.1;

std::string run_text(const Value& v, std::string_view name) {
  const Value* f = v.as_map() ? v.as_map()->find(name) : nullptr;
  return f && f->as_string() ? *f->as_string() : std::string();
}

/// The world over there while the program runs here.
class Mirror final : public task::Outside {
 public:
  Mirror(Client& client, std::string world, bool in_real_time, CommandContext& ctx)
      : client_(client), world_(std::move(world)), in_real_time_(in_real_time), ctx_(ctx) {}

  Result<Value> call(const std::string& method, Map args) {
    return client_.call(method, Value(std::move(args)), false, 0, ctx_.progress);
  }
  /// Changes that others make of the world come as events from here on.
  Result<void> subscribe() {
    RMP_TRY_ASSIGN(const Value number,
                   call("server.subscribe", Map{{"topics", List{Value("change")}},
                                                {"kinds", List{Value("world")}},
                                                {"own", false}}));
    subscription_ = number;
    return {};
  }
  void unsubscribe() {
    if (client_.is_open() && !subscription_.is_nil())
      (void)call("server.unsubscribe", Map{{"subscription", subscription_}});
  }

  Result<void> row(task::TaskExecutor& executor, const std::vector<task::ProgramActor>& programs,
                   double now, bool is_idle, bool is_over) override {
    tell(executor, programs, now);
    auto done = exchange(executor, now, is_idle, is_over);
    if (done.ok()) return done;
    std::string where = "at t = " + text::print_rounded(now) + " s";
    for (const task::ProgramActor& p : programs)
      where = "program " + text::quote(p.name()) + ", " + p.where() + ", " + where;
    return std::move(done).error().in(where);
  }

 private:
  /// Notes and lines, as they come.
  void tell(const task::TaskExecutor& executor, const std::vector<task::ProgramActor>& programs,
            double now) {
    for (; told_ < executor.notes().size(); ++told_)
      ctx_.app.messages.post(Severity::info, "program_note", executor.notes()[told_], "program");
    for (const task::ProgramActor& p : programs) {
      const double line = p.line_at(now);
      if (line == std::exchange(lines_[p.name()], line)) continue;
      ctx_.app.messages.post(Severity::debug, "program_line",
                             "t = " + text::print_rounded(now) + " s: " + p.name() + ", line " +
                                 text::print_rounded(line),
                             "program");
    }
  }
  Result<void> exchange(task::TaskExecutor& executor, double now, bool is_idle, bool is_over) {
    if (!has_begun_) {
      has_begun_ = true;
      start_ = Clock::now();
      for (const auto& [name, value] : executor.signals()) signals_[name] = value;
      for (auto& [name, q] : executor.joints(0)) joints_[name] = std::move(q);
    }
    RMP_TRY(send(executor, now, is_over));
    if (is_over) return {};
    for (;;) {
      double wait = 0;
      if (in_real_time_) {
        const std::chrono::duration<double> passed = Clock::now() - start_;
        wait = std::clamp(now - passed.count(), 0.0, kRunLook);
      } else if (is_idle) {
        wait = kRunLook;  // the time of the program stands until somebody sets a signal
      }
      RMP_TRY_ASSIGN(const List events, client_.events(wait, ctx_.progress));
      bool is_new = false;
      if (!events.empty()) {
        RMP_TRY_ASSIGN(is_new, receive(executor, now));
      }
      if (ctx_.progress.cancelled()) return error(ErrorCode::cancelled, "the run was interrupted");
      const std::chrono::duration<double> passed = Clock::now() - start_;
      if (in_real_time_ ? passed.count() >= now : is_new || !is_idle) return {};
    }
  }
  /// What has changed here.
  Result<void> send(const task::TaskExecutor& executor, double now, bool is_over) {
    Map held;
    std::vector<std::pair<std::string, double>> set;
    for (const auto& [name, value] : executor.signals())
      if (signals_[name] != value) set.emplace_back(name, value);
    std::vector<task::TaskExecutor::Carried> carried;
    for (auto& c : executor.carried())
      if (const auto it = carried_.find(c.object); it == carried_.end() || it->second != c.since)
        carried.push_back(std::move(c));
    const bool is_due = is_over || !set.empty() || !carried.empty() ||
                        now - sent_at_ >= kBetweenPlaces * (1 - 1e-9);
    if (!is_due) return {};
    for (auto& [name, q] : executor.joints(now)) {
      auto& last = joints_[name];
      if (last == q) continue;
      RMP_TRY(done(
          call("world.set_robot_q", Map{{"id", world_}, {"robot", name}, {"q", NumericArray(q)}})));
      last = std::move(q);
    }
    sent_at_ = now;
    for (const auto& c : carried) {
      const spatial::Quaternion r = spatial::to_quaternion(c.pose.R);
      Map args{{"id", world_},
               {c.robot.empty() ? "member" : "object", c.object},
               {"position", NumericArray({c.pose.p[0], c.pose.p[1], c.pose.p[2]})},
               {"quaternion", NumericArray({r.w, r.x, r.y, r.z})}};
      if (!c.robot.empty()) {
        args.set("robot", c.robot);
        if (!c.link.empty()) args.set("link", c.link);
        RMP_TRY(done(call("world.attach", std::move(args))));
        is_held_[c.object] = true;
      } else {
        if (std::exchange(is_held_[c.object], false))
          RMP_TRY(done(call("world.detach", Map{{"id", world_}, {"object", c.object}})));
        RMP_TRY(done(call("world.place", std::move(args))));
      }
      carried_[c.object] = c.since;
    }
    for (const auto& [name, value] : set) {
      RMP_TRY(
          done(call("world.set_signal", Map{{"id", world_}, {"signal", name}, {"value", value}})));
      signals_[name] = value;
    }
    return {};
  }
  /// What others have set over there; true = something.
  Result<bool> receive(task::TaskExecutor& executor, double now) {
    RMP_TRY_ASSIGN(const Value all, call("world.signals", Map{{"id", world_}}));
    bool is_new = false;
    if (!all.as_list()) return is_new;
    for (const Value& one : *all.as_list()) {
      const std::string name = run_text(one, "name");
      const Value* value = one.as_map() ? one.as_map()->find("initial") : nullptr;
      const auto known = signals_.find(name);
      if (!value || !value->is_number() || known == signals_.end()) continue;
      if (known->second == value->number()) continue;
      known->second = value->number();
      is_new = executor.set_signal(name, value->number(), now) || is_new;
    }
    return is_new;
  }
  static Result<void> done(Result<Value> answer) {
    if (answer.ok()) return {};
    return std::move(answer).error();
  }

  Client& client_;
  const std::string world_;
  const bool in_real_time_;
  CommandContext& ctx_;
  Value subscription_;
  bool has_begun_ = false;
  Clock::time_point start_{};
  double sent_at_ = -1;
  std::size_t told_ = 0;
  std::map<std::string, double> lines_;    ///< by program
  std::map<std::string, double> signals_;  ///< as they are over there
  std::map<std::string, std::vector<double>> joints_;
  std::map<std::string, double> carried_;  ///< since when, as it was told
  std::map<std::string, bool> is_held_;
};

Error of_server(Error e, const Client& client) {
  if (e.where.empty()) e.where = client.options().address.text();
  return e;
}

/// The world that is meant over there.
Result<std::string> remote_world(CommandContext& ctx, Client& client, const std::string& wanted) {
  auto all = client.call("world.list", Map{}, false, 0, ctx.progress);
  if (!all.ok()) return of_server(std::move(all).error(), client);
  std::vector<std::string> names;
  if (all->as_list())
    for (const Value& each : *all->as_list())
      if (const Value* h = each.as_map() ? each.as_map()->find("$handle") : nullptr)
        names.push_back(run_text(*h, "name"));
  const std::string there = client.options().address.text();
  if (!wanted.empty()) {
    if (std::find(names.begin(), names.end(), wanted) != names.end()) return wanted;
    return error(ErrorCode::unknown_name, "there is no world " + text::quote(wanted),
                 names.empty() ? "It has none; start it with a script that creates one."
                               : "It has " + text::enumerate(names) + ".",
                 there);
  }
  if (names.size() == 1) return names.front();
  if (names.empty())
    return error(ErrorCode::not_found, "there is no world to run in",
                 "Start it with a script that creates one: robomosp serve cell.lua.", there);
  return error(ErrorCode::invalid_argument, "there are " + std::to_string(names.size()) + " worlds",
               "Select one: " + text::enumerate(names) + ".", there);
}

Result<Value> run_remote(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ConnectionUse use, use_connection(ctx, args));
  Client& client = use.client();
  const AnyId id = ref(args, "id");
  // What is wrong with the program is said before anything is asked of others.
  RMP_TRY(compile_program(ctx, id));
  const std::string theirs = run_text(Value(client.hello()), "version");
  if (theirs != ROBOMOSP_VERSION)
    return error(ErrorCode::unsupported,
                 "it runs robomosp " + (theirs.empty() ? "of no version" : theirs) +
                     ", and this is " ROBOMOSP_VERSION
                     ": the content of its world might have a different meaning here",
                 "Use programs of the same version.", client.options().address.text());
  RMP_TRY_ASSIGN(const std::string name, remote_world(ctx, client, text_of(args, "world")));
  auto pack = client.call("world.pack", Map{{"id", name}}, false, 0, ctx.progress);
  if (!pack.ok()) return of_server(std::move(pack).error(), client);
  if (!pack->as_map())
    return error(ErrorCode::unsupported, "it does not return the texts of its world",
                 "Use programs of the same version.", client.options().address.text());
  RMP_TRY_ASSIGN(const Value copy, ctx.dispatch("world.unpack", *pack->as_map()));

  Map add{{"id", copy}, {"program", Application::handle(id)}};
  if (has(args, "robot")) add.set("robot", text_of(args, "robot"));
  RMP_TRY_ASSIGN(const Value placed, ctx.dispatch("world.add_program", add));
  const auto bind = [&](Map b) -> Result<void> {
    b.set("id", Application::handle(id));
    b.set("world", copy);
    auto bound = ctx.dispatch("program.bind", b);
    if (bound.ok()) return {};
    return std::move(bound).error();
  };
  if (has(args, "frame") || has(args, "tool")) {
    Map b{{"kind", "robot"}};
    for (const auto& [from, to] : {std::pair("robot", "to"), {"frame", "frame"}, {"tool", "tool"}})
      if (has(args, from)) b.set(to, text_of(args, from));
    RMP_TRY(bind(std::move(b)));
  }
  if (const Value* given = args.find("bindings"); given && given->as_list())
    for (const Value& one : *given->as_list()) {
      if (!one.as_map())
        return error(ErrorCode::invalid_argument, "a binding must be a table",
                     "Give the arguments of program.bind.", "bindings");
      RMP_TRY(bind(*one.as_map()));
    }
  Map wanted{{"id", copy}, {"program", placed}};
  for (const char* each : {"unbound", "values", "sample_time", "most_time"})
    if (has(args, each)) wanted.set(each, *args.find(each));
  RMP_TRY_ASSIGN(task::TaskRun run, task_run(ctx, wanted));
  Mirror mirror(client, name, flag(args, "real_time"), ctx);
  run.outside = &mirror;
  auto heard = mirror.subscribe();
  if (!heard.ok()) return of_server(std::move(heard).error(), client);
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot(),
                                 &ctx.app.collision_models};
  auto recording = task::run(simulator, run, ctx.progress);
  mirror.unsubscribe();
  if (!recording.ok()) return of_server(std::move(recording).error(), client);
  RMP_TRY_ASSIGN(auto noted, with_start_notes(ctx, *recording));
  return Value(Handle{"recording", ctx.app.recordings.add(std::move(noted))});
}

}  // namespace

RMP_COMMANDS(program_run_remote_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "program.run_remote",
       .classic = "",
       .summary = "Runs a program here, in a world that another program serves.",
       .details =
           "The world is fetched (world.pack) and the program runs in the copy, so that motions "
           "and recording are those of program.run. The robots on the server follow 25 times per "
           "second of the program's time, held objects and signals at each change, and signals "
           "that others set on the server are used from the next row on. Other changes on the "
           "server take effect in the next run. If the connection is lost the run ends with an "
           "error that gives the program's place; the server keeps the last state it received. The "
           "copy is kept for the recording; undo removes it, but changes nothing on the server. "
           "Notes are messages of the code program_note during the run.",
       .example = "local nop = program.create{name = \"nop\", source = \"PROGRAM nop; "
                  "BEGIN ENDPROGRAM;\"}\n"
                  "assert(not pcall(program.run_remote, {id = nop, connection = 1}))",
       .params =
           {self("program"),
            between(needed("connection", "int", "", "Number from connection.open."), 1, 9e15),
            optional("world", "string", "",
                     "Name of the world on the server; by default the only one."),
            optional("robot", "string", "",
                     "Robot of that world for motions that name none; by default the only robot."),
            optional("frame", "string", "", "Frame or object in which targets are given."),
            optional("tool", "string", "", "Tool for targets."),
            optional("bindings", "list", "",
                     "Bindings of names in that world: tables with the arguments of program.bind."),
            choice("unbound", {"error", "free"},
                   "Whether signals without a binding are an error or belong to the program."),
            values_field(),
            defaulted("real_time", "bool", "", true,
                      "True: a second of the program takes one second; false: it runs as fast as "
                      "it can, and waits only if nothing but a signal can continue it."),
            above_zero(defaulted("sample_time", "real", "s", 0.02, "Time between rows.")),
            above_zero(defaulted("most_time", "real", "s", 3600.0,
                                 "Limit: a run that takes longer is an error."))},
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates | Effect::edits | Effect::administers,
       .run = run_remote});
  return all;
}

}  // namespace robomosp::remote
