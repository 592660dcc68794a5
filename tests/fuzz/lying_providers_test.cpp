// SPDX-License-Identifier: Apache-2.0
// Plugins that lie: for every interface that the program knows, a provider that answers wrongly at
// random is made the default, and the commands that ask it are run. What can be seen to be wrong is
// refused with a sentence that names the provider; nothing crashes, hangs or hands out numbers that
// are none.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "fuzz/lying_bodies.h"
#include "kernel/interface_file.h"
#include "kernel/plugin_run.h"
#include "kernel/provider_process/doors.h"
#include "kernel/provider_process/proxies.h"
#include "kernel/text.h"
#include "support/lua_program.h"
#include "support/seed.h"

namespace robomosp::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "liar";

/// A liar on top of the provider `honest` of the program.
template <class Liar, class I>
std::function<Result<void*>()> on_top_of(const Registry& registry, const std::string& honest) {
  return [&registry, honest]() -> Result<void*> {
    RMP_TRY_ASSIGN(auto inner, registry.create<I>(honest));
    return static_cast<void*>(static_cast<I*>(new Liar(std::move(inner))));
  };
}
template <class Liar, class I>
std::function<Result<void*>()> alone() {
  return []() -> Result<void*> { return static_cast<void*>(static_cast<I*>(new Liar)); };
}

/// How an interface is lied about: the provider, and lines of Lua whose answers it has a part in.
struct Attack {
  std::string honest;  ///< whose schema and tags it has; "" = nobody's
  std::function<Result<void*>()> make;
  std::vector<std::string> lines;
};

/// What all lines can use. `fresh` numbers make new work of each line, which no cache answers.
constexpr const char* kStage = R"(
  count = count or 0
  function fresh() count = count + 1; return count * 1e-6 end
  function numbers(v, path, seen)
    path, seen = path or "answer", seen or {}
    if type(v) == "number" and v ~= v then error("NO NUMBER at " .. path, 0) end
    if type(v) == "table" and not seen[v] then
      seen[v] = true
      for k, x in pairs(v) do numbers(x, path .. "." .. tostring(k), seen) end
    end
    return v
  end
  arm = robot.get("arm")
  bar = robot.get("four_bar")
  rods = robot.create{name = "rods", convention = "dh", links = {
    {a = 0.5, lower = -3, upper = 3, mass = 1}, {a = 0.5, lower = -3, upper = 3, mass = 1}},
    poses = {left = {0.8, 0}, right = {-0.8, 0}}}
  material.create{name = "wood", density = 600}
  function box() return solid.create{name = "box" .. fresh(), material = "wood", root = {kind = "union", children = {
    {kind = "box", name = "a", x = 0.1 + fresh(), y = 0.1, z = 0.1},
    {kind = "cylinder", name = "b", radius = 0.02, height = 0.2}}}} end
  -- A body whose shape is none of primitives, so that its mesh is asked for.
  function hollow() return solid.create{name = "hollow" .. fresh(), root = {kind = "difference", children = {
    {kind = "box", x = 0.1 + fresh(), y = 0.1, z = 0.1}, {kind = "cylinder", radius = 0.02, height = 0.2}}}} end
  solid.create{name = "ball", root = {kind = "sphere", radius = 0.1}}
  cell = world.create{name = "cell"}
  cell:add_robot{robot = arm, q = "ready"}
  cell:add_object{what = "ball", position = {0.9, 0.3, 0.2}}
  local p, a = arm:fk{q = "ready"}.position, arm:fk{q = "ready"}.rpy
  function points(d) return {{p[1], p[2], p[3], a[1], a[2], a[3]},
    {p[1], p[2] + d, p[3], a[1], a[2], a[3]}} end
  trajectory.create{name = "stroke", sample_time = 0.05,
    segments = {{shape = "line", points = points(0.05)}}}
  cell:add_trajectory{trajectory = "stroke"}
  function stroke(s) return trajectory.create{name = "way" .. fresh(), sample_time = 0.05, segments = {s}} end
  plane = world.create{name = "plane"}
  plane:add_robot{robot = rods, q = "left"}
  plane:add_object{what = "ball", position = {0.8, 0, 0}}
  floor = world.create{name = "floor"}
  solid.create{name = "slab", root = {kind = "box", x = 2, y = 2, z = 0.1}}
  solid.create{name = "cube", material = "wood", root = {kind = "box", x = 0.1, y = 0.1, z = 0.1}}
  floor:add_object{what = "slab", position = {0, 0, -0.1}}
  floor:add_object{what = "cube", position = {0, 0, 0.04}}
  floor:add_robot{robot = arm, q = "ready", position = {3, 0, 0}}
  lone = arm:duplicate("lone")
  alone = world.create{name = "alone"}
  alone:add_robot{robot = lone, q = "ready"}
  lift = program.create{name = "lift", source = [[
PROGRAM lift;
SIGNAL OUTPUT BOOL: grip AT 2;
VAR POSE: place := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));
BEGIN
  MOVE LIN place SPEED := 80.0;
  grip := TRUE;
ENDPROGRAM;
]]}
  local at = lone:fk{q = "ready"}
  alone:add_frame{name = "target", rpy = at.rpy,
    position = {at.position[1], at.position[2], at.position[3] + 0.05}}
)";

std::map<std::string, Attack> attacks(const Registry& r) {
  std::map<std::string, Attack> all;
  const auto add = [&]<class L, class I>(std::type_identity<L>, std::type_identity<I>,
                                         const std::string& honest,
                                         std::vector<std::string> lines) {
    Attack a{honest, {}, std::move(lines)};
    if constexpr (std::is_default_constructible_v<L>) a.make = alone<L, I>();
    else a.make = on_top_of<L, I>(r, honest);
    all[I::kInterfaceId] = std::move(a);
  };
#define LIAR(L, I, ...) add(std::type_identity<L>{}, std::type_identity<I>{}, __VA_ARGS__)
  const std::string along = R"(robot = "arm", trajectory = "stroke")";
  LIAR(
      LyingIk, IkSolver, "numeric",
      {R"(arm:solve_ik{target = arm:fk{q = "ready"}.pose})",
       R"(arm:solve_ik{target = arm:fk{q = "ready"}.pose, all = true})",
       R"(arm:solve_ik{target = {9, 9, 9, 0, 0, 0}, partial = true})",
       R"(arm:solve_ik_batch{targets = {arm:fk{q = "ready"}.pose, arm:fk{q = {0.1, -0.8, 0.5, 0, 0.9, 0}}.pose}, seed = "ready"})",
       "cell:inverse_kinematics{" + along + "}", "cell:check{" + along + "}",
       R"(arm:reachability{samples = 50, voxel = 0.5, directions = 4})", R"(lone:follow_target())",
       R"(plane:plan_path{robot = "rods", target = rods:fk{q = "right"}.pose, seconds = 1, shortcuts = 3})"});
  LIAR(
      LyingInverse, InverseDynamics, "newton_euler",
      {R"(arm:inverse_dynamics{q = "ready", qd = {1, 1, 1, 1, 1, 1}})",
       R"(arm:inertia{q = "ready"})", R"(arm:gravity_torques{q = "ready"})",
       R"(arm:energy{q = "ready", qd = {1, 0, 0, 0, 0, 0}})", R"(arm:regressor{q = "ready"})",
       R"(arm:dynamics_derivatives{q = "ready"})", "cell:inverse_dynamics{" + along + "}",
       "cell:simulate{" + along + "}", "cell:time_optimal{" + along + "}",
       "cell:simulate_dynamics{" + along + R"(, controller = "computed_torque", duration = 0.1})",
       R"(arm:simulate{q = "ready", duration = 0.05})",
       R"(arm:simulate{q = "ready", reference = "ready", controller = "pd_gravity", duration = 0.05})"});
  LIAR(
      LyingForward, ForwardDynamics, "articulated_body",
      {R"(arm:forward_dynamics{q = "ready"})",
       R"(arm:dynamics_derivatives{q = "ready", of = "accelerations"})",
       R"(arm:simulate{q = "ready", duration = 0.05})",
       R"(arm:start_run("dynamics", {q = "ready", duration = 0.05}):finish())",
       "cell:simulate_dynamics{" + along + R"(, controller = "computed_torque", duration = 0.1})"});
  LIAR(
      LyingController, Controller, "computed_torque",
      {R"(arm:simulate{q = "ready", reference = "ready", controller = "liar", duration = 0.05})",
       "cell:simulate_dynamics{" + along + R"(, controller = "liar", duration = 0.1})",
       R"(floor:simulate_physics{duration = 0.05, robots = {{name = "arm", drive = "controlled", controller = "liar"}}})"});
  LIAR(LyingCode, RobotCodeGenerator, "c99",
       {R"(arm:generate_code{folder = ".", name = "lie"})",
        R"(rods:generate_code{folder = ".", parts = {"inertia"}})"});
  LIAR(
      LyingIntegrator, Integrator, "dormand_prince",
      {R"(arm:simulate{q = "ready", duration = 0.05})",
       R"(arm:simulate{q = "ready", duration = 0.05, integrator = "liar"})",
       R"(arm:start_run("dynamics", {q = "ready", duration = 0.05}):finish())",
       "cell:simulate_dynamics{" + along + R"(, controller = "computed_torque", duration = 0.1})"});
  LIAR(LyingTipForce, TipForce, "",
       {R"(arm:simulate{q = "ready", duration = 0.05, tip_force = "liar"})",
        "cell:inverse_dynamics{" + along + R"(, tip_force = "liar"})"});
  LIAR(LyingRetimer, Retimer, "reachability",
       {"cell:time_optimal{" + along + "}",
        R"(plane:plan_path{robot = "rods", to = "right", seconds = 1, shortcuts = 3})"});
  LIAR(LyingPlanner, Planner, "rrt_connect",
       {R"(plane:plan_path{robot = "rods", to = "right", seconds = 1, shortcuts = 3})"});
  LIAR(LyingLawFactory, MotionLawFactory, "constant_speed",
       {R"(stroke{shape = "line", points = points(0.05 + fresh()), law = "liar"}:sample(0.2))",
        R"(stroke{shape = "line", points = points(0.05), law = "liar"}:plot{file = "s.svg"})"});
  LIAR(
      LyingCurveFactory, CurveFactory, "line",
      {R"(stroke{shape = "liar", points = points(0.05 + fresh())}:sample(0.2))",
       R"(stroke{shape = "liar", points = points(0.05 + fresh())}:length())",
       R"(stroke{shape = "liar", points = points(0.05 + fresh()), law = "quintic"}:plot{file = "s.svg", kind = "path"})"});
  LIAR(
      LyingOrientationFactory, OrientationFactory, "slerp",
      {R"(stroke{shape = "line", points = points(0.05 + fresh()), orientation = "liar"}:sample(0.2))"});
  LIAR(LyingSegmentFactory, SegmentFactory, "",
       {R"(stroke{shape = "liar", points = points(0.05 + fresh())}:sample(0.2))",
        R"(stroke{shape = "liar", points = points(0.05 + fresh())}:length())"});
  LIAR(LyingJointFactory, JointSegmentFactory, "ptp", {R"((function()
             local t = stroke{shape = "liar", joints = {arm:poses().ready, {0.1, -0.8 + fresh(), 0.5, 0, 0.9, 0}}}
             cell:add_trajectory{trajectory = t, name = "run" .. count}
             return cell:simulate{robot = "arm", trajectory = "run" .. count} end)())"});
  LIAR(LyingCollision, CollisionEngine, "fcl",
       {R"(cell:clearance{q = {fresh(), -0.8, 0.5, 0, 0.9, 0}})", R"(cell:collisions())",
        R"(arm:clearance{q = "ready"})", R"(cell:check{robot = "arm", trajectory = "stroke"})",
        R"(cell:check_path{path = {"ready", {0.3, -0.8, 0.5, 0, 0.9, fresh()}}})",
        R"(arm:find_allowed_pairs{samples = 100})",
        R"(plane:plan_path{robot = "rods", to = "right", seconds = 1, shortcuts = 3})"});
  LIAR(
      LyingPhysics, PhysicsEngine, "ode",
      {R"(floor:simulate_physics{duration = 0.05})",
       R"(floor:simulate_physics{duration = 0.02, robots = {{name = "arm", drive = "controlled", controller = "pd_gravity"}}})",
       R"(floor:start_run("physics", {duration = 0.05}):finish())"});
  LIAR(
      LyingCsg, CsgEngine, "occt",
      {R"(box():mass())", R"(box():moments())", R"(box():bounds())", R"(box():mesh_info())",
       R"(box():features())", R"(box():section{plane = {position = {0, 0, 0.05}}})",
       R"((function() local b = box(); return object.create{name = "both" .. count, parts = {{what = b},
            {what = box(), position = {0.05, 0, 0}}}}:mass() end)())",
       R"((function() local b = box(); return b:export{file = "b.step"} end)())",
       R"((function() local b = hollow(); local w = world.create{name = "other" .. count}; w:add_object{what = b, position = {0.6, 0, 0}};
            w:add_robot{robot = rods, position = {1, 0, 0}}; return w:clearance() end)())"});
  LIAR(
      LyingPrimitive, CsgPrimitive, "",
      {R"(solid.create{name = "p" .. fresh(), root = {kind = "custom", primitive = "liar"}}:mass())"});
  LIAR(LyingImporter, Importer, "", {R"(import{file = "again.lie"})"});
  LIAR(LyingPost, Post, "krl",
       {R"(lift:post{target = "liar"})",
        R"(lift:post{target = "liar", check = true, source_map = true})",
        R"(lift:post{target = "liar", form = "flat", robot = "arm"})",
        R"(lift:post{target = "liar", folder = ".", overwrite = true})", "program.targets()"});
  LIAR(LyingExporter, Exporter, "",
       {R"(solid.export{id = "ball", file = "out.lie"})", R"(cell:export{file = "out.lie"})"});
  LIAR(
      LyingRenderer, render::Renderer, "",
      {R"(rods:render{file = "r.png", size = {64, 48}, quality = "draft"})",
       R"(cell:render{file = "c.png", size = {64, 48}, quality = "draft", ellipsoid = "velocity"})"});
#undef LIAR
  return all;
}

/// Cancels what waits.
class Patience {
 public:
  explicit Patience(ioci::Session& session) : session_(session), thread_([this] { watch(); }) {}
  ~Patience() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }
  /// `is_short`: what it watches never ends by itself.
  void begin(bool is_short = false) {
    const std::lock_guard lock(mutex_);
    began_ = Clock::now(), runs_ = true, is_short_ = is_short;
  }
  double end() {
    const std::lock_guard lock(mutex_);
    runs_ = false;
    session_.clear_interrupt();
    return std::chrono::duration<double>(Clock::now() - began_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  void watch() {
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, std::chrono::milliseconds(20), [this] { return ends_; }))
      // What waits is cancelled at once; what computes long, later.
      if (runs_ && Clock::now() - began_ > (is_short_ || liar().told().ends_with("cancelled")
                                                ? std::chrono::milliseconds(20)
                                                : std::chrono::milliseconds(10000)))
        session_.interrupt();
  }
  ioci::Session& session_;
  std::mutex mutex_;
  std::condition_variable wake_;
  Clock::time_point began_;
  bool ends_ = false, runs_ = false, is_short_ = false;
  std::thread thread_;
};

class LyingProviders : public LuaProgramTest {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("lying-providers-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "inner");
    before_ = fs::current_path();
    fs::current_path(folder_ / "inner");
    std::ofstream("again.lie") << "a file\n";
    std::ofstream(folder_ / "witness") << "untouched\n";
    ::setenv("ROBOMOSP_LIAR_STATE", liar_state().c_str(), 1);
    LuaProgramTest::SetUp();
    liar().seed(test::seed());
  }
  void TearDown() override {
    liar().rest();
    state_.reset();
    fs::current_path(before_);
    fs::remove_all(folder_);
  }
  /// Where the liars of all processes decide; one file a program.
  static const std::string& liar_state() {
    static const std::string file =
        (fs::temp_directory_path() / ("lying-state-" + std::to_string(::getpid()))).string();
    return file;
  }
  static void TearDownTestSuite() {
    fs::remove(liar_state());
    LuaProgramTest::TearDownTestSuite();
  }
  void offer(const std::string& id, const Attack& a) {
    ProviderInfo info;
    if (!a.honest.empty()) {
      auto known = app().registry.find(id, a.honest);
      ASSERT_TRUE(known.ok()) << known.error().sentence();
      info = *known;
    }
    info.interface_id = id;
    info.name = kName;
    info.origin = "a test";
    ASSERT_TRUE(app().registry.add(info, a.make, true).ok());
    ASSERT_TRUE(app().registry.set_default(id, kName).ok());
  }
  void withdraw(const std::string& id) {
    ASSERT_TRUE(app().registry.set_default(id, "").ok());
    app().registry.remove(id, kName);
  }
  void stage() {
    app().document.clear();
    // The tests share a program and its cache: none makes the numbers of another.
    static int tests = 0;
    if (std::exchange(is_new_, false)) run("count = " + std::to_string(2000 * tests++));
    run(kStage);
  }
  /// Tells them lies for a while, and looks at what becomes of each.
  void attack(const std::map<std::string, Attack>& all);
  FuzzBudget budget_{3};
  bool is_apart_ = false;
  bool is_new_ = true;
  fs::path folder_, before_;
};

TEST_F(LyingProviders, AreNamedAndDoNoHarm) {
  const auto all = attacks(app().registry);
  for (const InterfaceEntry* known : InterfaceFile::all())
    // Modules are made once, with the program: module_test has those that lie. Of languages
    // abi_test has tables that lie, and so it has readers that do.
    EXPECT_TRUE(all.contains(known->id) || known->id == "robomosp.module/1" ||
                known->id == "robomosp.language/1" || known->id == "robomosp.program_reader/1")
        << known->id << " has no provider here that lies";
  attack(all);
}

/// The same in a process of their own: what crosses the channel is as wrong as they can make it.
TEST_F(LyingProviders, InAProcessOfTheirOwnAreNamedAndDoNoHarm) {
  const fs::path file = fs::canonical(ROBOMOSP_LIAR_PLUGIN);
  {
    const PluginRunScope scope(PluginRun{false, {.seconds = 20, .confined = false}});
    const PluginReport report = app().plugins.load(file.string());
    ASSERT_TRUE(report.loaded) << (report.refusal ? report.refusal->sentence() : "");
    EXPECT_TRUE(report.remarks.empty());
  }
  // They come under another name below.
  for (const ProviderInfo& p : app().registry.list())
    if (p.origin == file.string()) app().registry.remove(p.interface_id, p.name);
  const auto process = PluginRuns::of_program().process(file);
  ASSERT_TRUE(process);
  const auto wire = process->describe();
  ASSERT_TRUE(wire.ok());
  auto all = attacks(app().registry);
  std::erase_if(all, [](const auto& a) { return apart::runs_in_program_only(a.first); });
  std::set<std::string> there;
  for (std::uint32_t i = 0; i < wire->providers.size(); ++i) {
    const std::string id = wire->providers[i].interface_id;
    const auto at = all.find(id);
    ASSERT_NE(at, all.end()) << id;
    there.insert(id);
    std::vector<std::string> params;
    if (const auto honest = app().registry.find(id, at->second.honest);
        honest.ok() && !at->second.honest.empty())
      for (const ParamSpec& p : honest->schema) params.push_back(p.name);
    at->second.make = [process, i, id, params] { return process->create(i, id, kName, params); };
  }
  for (const auto& [id, one] : all)
    EXPECT_TRUE(there.contains(id)) << id << " has no provider in the plugin that lies";
  is_apart_ = true;
  attack(all);
  EXPECT_GT(process->starts(), 0U);
  // It goes on working, and is gone with the program.
  liar().rest();
  stage();
  offer(InverseDynamics::kInterfaceId, all.at(InverseDynamics::kInterfaceId));
  EXPECT_TRUE(state_->eval(R"(arm:inverse_dynamics{q = "ready"})").ok());
  withdraw(InverseDynamics::kInterfaceId);
}

void LyingProviders::attack(const std::map<std::string, Attack>& all) {
  const char* only = std::getenv("ROBOMOSP_LIAR");
  std::map<std::string, std::size_t> told;
  Patience patience(session_);
  for (std::size_t round = 0; budget_.allows(round); ++round) {
    for (const auto& [id, attack] : all) {
      if (only && id.find(only) == std::string::npos) continue;
      liar().rest();
      stage();
      offer(id, attack);
      for (const std::string& line : attack.lines) {
        const double chances[] = {1, 0.5, 0.1, 0.01};
        const double chance = round == 0 ? 0 : chances[liar().pick(4)];
        std::string said;
        const auto hears = app().messages.subscribe([&](const Message& m) { said += m.text; });
        liar().arm(chance);
        patience.begin();
        auto done = state_->eval("numbers(" + line + ")");
        const double took = patience.end();
        app().messages.unsubscribe(hears);
        const std::string lie = liar().told();
        // A live run goes on when nobody waits for it any more, until it is stopped.
        const bool is_sure = liar().is_sure() && !(lie.ends_with("in vain for being cancelled") &&
                                                   line.find("start_run") != std::string::npos);
        const std::size_t asked = liar().asked();
        liar().rest();
        ASSERT_TRUE(state_->eval("for _, r in ipairs(run.list()) do r.id:remove() end").ok());
        const std::string at = id + ", " + line + "\n  lie: " + lie + "\n  answer: " +
                               text::shortened(done.ok() ? *done : done.error().sentence(), 600);
        if (lie.empty()) {
          EXPECT_TRUE(done.ok()) << at;
          EXPECT_TRUE(asked > 0 || round > 0) << at << "\n  does not ask the provider";
          continue;
        }
        ++told[id];
        EXPECT_LT(took, 15) << at;
        const std::string answer = done.ok() ? *done + said : done.error().sentence() + said;
        // Where an engine of solids breaks down another one stands in; answers with notes say so.
        const bool has_notes = line.find("mass()") != std::string::npos ||
                               line.find("mesh_info()") != std::string::npos ||
                               line.find("export{") != std::string::npos;
        const bool has_stand_in =
            id == CsgEngine::kInterfaceId &&
            ((done.ok() && !has_notes) || answer.find("is a mesh") != std::string::npos);
        // From a process the bounds of a solid come with it, whether they are asked for or not.
        const bool is_unused = is_apart_ && lie.starts_with("csg.bounds");
        if (is_sure && !has_stand_in && !is_unused) {
          EXPECT_NE(answer.find(kName), std::string::npos) << at;
        }
        if (!done.ok()) {
          const Error& e = done.error();
          EXPECT_FALSE(e.message.empty()) << at;
          EXPECT_NE(e.code, ErrorCode::internal) << at;
          EXPECT_LE(e.sentence().size(), 6000U) << at;
          EXPECT_EQ(e.message.find("NO NUMBER"), std::string::npos) << at;
          EXPECT_EQ(text::visible(e.sentence()), e.sentence()) << at;
        }
      }
      withdraw(id);
      // Nothing was written but beside what was asked for.
      EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 2) << id;
    }
  }
  std::size_t lies = 0;
  for (const auto& [id, count] : told) lies += count;
  std::printf("%zu lies by %zu interfaces\n", lies, told.size());
  // Each has few lines, and may stay honest in all of them.
  EXPECT_TRUE(only || told.size() > all.size() / 2) << told.size() << " of them told lies";
}

/// What functions of Lua answer; `lie` is one of them, drawn anew by draw(number).
constexpr const char* kLuaLies = R"(
  local itself = {}
  itself[1] = itself
  local many = {}
  for i = 1, 100000 do many[i] = i end
  local deep = {}
  for i = 1, 500 do deep = {deep} end
  function forever() while true do end end
  local function recurse(...) return 1 + recurse(...) end
  lies = {
    function() end, function() return false end, function() return true end,
    function() return "text" end, function() return ("x"):rep(100000) end,
    function() return "\27[31m\0\7" end, function() return 0 / 0 end,
    function() return 1 / 0 end, function() return -1e308 end, function() return -5 end,
    function() return 2^53 end, function() return math.mininteger end, function() return {} end,
    function() return {0 / 0, 1, 2} end, function() return {1, 2, "x"} end,
    function() return many end, function() return itself end, function() return deep end,
    function() return print end, function() return coroutine.create(print) end,
    function() return io.stdout end, function() return array{0 / 0, 0 / 0} end,
    function() return linalg.zeros(4, 4) end, function() return {linalg.zeros(4, 4)} end,
    function() return {q = {1}, tau = {}, pose = {}, distance = -1 / 0, point_a = {}, a = 1} end,
    function() return {{0, 0, 0}, {0 / 0, 0, 0}} end, function() return 1, 2, 3, 4, 5 end,
    function() return nil, "\27[2J" end, function() return nil, ("why "):rep(50000) end,
    function() return nil, {} end, function() return arm end,
    function() return setmetatable({}, {__index = function() error("index") end,
      __len = function() return 1e15 end}) end,
    function() error("refused by the script") end, function() error({}) end,
    function() error(nil) end, function() error(print) end,
    function() error(("e"):rep(200000)) end, function() error("\27]0;x\7") end,
    function() return ("x"):rep(1 << 40) end,
    function() coroutine.yield(1) end, forever, recurse,
    function() material.create{name = "m" .. fresh()} end, function() arm:set_name("other") end,
    function() robot.get("arm"):remove() end, function() ioci.withdraw(lying_for, "liar") end,
    function() return arm:solve_ik{target = arm:fk{q = "ready"}.pose} end,
    function() return cell:simulate{robot = "arm", trajectory = "stroke"} end}
  function draw(n) drawn = n end
  function lie(...) return lies[drawn](...) end
)";

TEST_F(LyingProviders, WrittenInLuaDoNoHarmEither) {
  const auto all = attacks(app().registry);
  Patience patience(session_);
  std::size_t told = 0, interfaces = 0;
  run(kLuaLies);
  const auto count = static_cast<std::size_t>(state_->eval_values("#lies")->front().number());
  for (std::size_t round = 0; budget_.allows(round); ++round) {
    interfaces = 0;
    for (const auto& [id, attack] : all) {
      stage();
      if (!state_->eval("lying_for = '" + id + "' ioci.provide(lying_for, 'liar', lie)").ok())
        continue;  // not for scripts, as their page says
      ++interfaces;
      // Segments and their parts are asked for by name; others where none is named.
      const bool is_default = app().registry.set_default(id, kName).ok();
      EXPECT_TRUE(is_default) << id;
      for (const std::string& line : attack.lines) {
        const std::size_t lie = liar().pick(count) + 1;
        run("draw(" + std::to_string(lie) + ")");
        const bool never_ends = state_->eval("lies[drawn] == forever").value() == "true";
        std::string said;
        const auto hears = app().messages.subscribe([&](const Message& m) { said += m.text; });
        patience.begin(never_ends);
        const auto done = state_->eval("numbers(" + line + ")");
        const double took = patience.end();
        app().messages.unsubscribe(hears);
        ++told;
        const std::string at =
            id + ", " + line + "\n  lie " + std::to_string(lie) +
            "\n  answer: " + text::shortened(done.ok() ? *done : done.error().sentence(), 600);
        EXPECT_LT(took, 15) << at;
        EXPECT_EQ(text::visible(said), said) << at;
        if (done.ok()) continue;
        const Error& e = done.error();
        EXPECT_FALSE(e.message.empty()) << at;
        EXPECT_NE(e.code, ErrorCode::internal) << at;
        EXPECT_LE(e.sentence().size(), 6000U) << at;
        EXPECT_EQ(e.message.find("NO NUMBER"), std::string::npos) << at;
        EXPECT_EQ(text::visible(e.sentence()), e.sentence()) << at;
      }
      ASSERT_TRUE(app().registry.set_default(id, "").ok());
      (void)state_->eval("ioci.withdraw(lying_for, 'liar')");
    }
  }
  EXPECT_GE(interfaces, 10U);
  EXPECT_GE(told, 40U);
}

}  // namespace
}  // namespace robomosp::test
