// SPDX-License-Identifier: Apache-2.0
// Costs that grow with the work and not faster: files of long worlds and robots are loaded right
// and in time that grows with them, meshes of robots are read once and by programs that start
// quickly, paths are built once, and long chains are accelerated by a method whose time grows with
// their length.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/io.h>

#include "ioci/core/commands.h"
#include "model/field_path.h"
#include "sim/dynamics_choice.h"
#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

double processor() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
/// The least of a few passes.
template <class Fn>
double time_of(int passes, Fn&& fn) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < passes; ++i) {
    const double begin = processor();
    fn();
    best = std::min(best, processor() - begin);
  }
  return best;
}
/// Of all programs that this one has started and that have ended.
double processor_of_children() {
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

class Growth : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-growth-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    run("folder = '" + folder_.string() + "/'");
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string digest() { return app().document.content_digest(); }
  std::size_t count(Kind kind) { return app().document.now()->list(kind).size(); }
  /// A closed mesh of its own size as an STL text.
  void write_stl(const std::string& name, double size) {
    std::ofstream out(folder_ / name);
    const double p[4][3] = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {0, 0, size}};
    const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    out << "solid a\n";
    for (const auto& f : faces) {
      out << "facet normal 0 0 0\nouter loop\n";
      for (const int k : f) out << "vertex " << p[k][0] << " " << p[k][1] << " " << p[k][2] << "\n";
      out << "endloop\nendfacet\n";
    }
    out << "endsolid a\n";
  }
  /// A chain of links, each with what `visual(i)` gives.
  template <class Fn>
  void write_urdf(const std::string& name, int count, Fn&& visual) {
    std::ofstream out(folder_ / name);
    out << "<robot name=\"r\"><link name=\"base\"/>\n";
    for (int i = 0; i < count; ++i)
      out << "<link name=\"l" << i << "\">" << visual(i) << "</link>\n<joint name=\"j" << i
          << "\" type=\"continuous\"><parent link=\""
          << (i == 0 ? "base" : "l" + std::to_string(i - 1)) << "\"/><child link=\"l" << i
          << "\"/><origin xyz=\"0.1 0 0\"/><axis xyz=\"0 0 1\"/></joint>\n";
    out << "</robot>\n";
  }
  fs::path folder_;
};

/// Names that paths could take for something else.
const char* const kWall =
    "solid.create{name = 'brick', root = {kind = 'box', x = 0.2, y = 0.1, z = 0.05}}\n"
    "solid.create{name = 'tile', root = {kind = 'box', x = 0.1, y = 0.1, z = 0.01}}\n"
    "object.create{name = 'pair', parts = {{what = 'brick', name = 'what'}, {what = 'tile', name = "
    "'parts'}}}\n"
    "names = {'objects', 'what', 'name', 'placement', 'objects.what', 'robots', 'b1.what'}\n"
    "function wall(n)\n"
    "  local all, kinds = {}, {'brick', 'tile', 'pair'}\n"
    "  for i = 1, n do all[i] = {what = kinds[i % 3 + 1], name = names[i] or 'b' .. i, position = "
    "{0.3 * i, 0, 0}} end\n"
    "  cell = world.create{name = 'cell'} cell:add_objects(all)\n"
    "  file.save_all{folder = folder}\n"
    "end";

TEST_F(Growth, AWorldIsLoadedAsItWasSavedWhateverItsObjectsAreNamed) {
  run(kWall);
  run("robot.create{name = 'arm', links = {{a = 0.3}}}\n"
      "wall(500) cell:add_robot{robot = 'arm', name = 'trajectories'}\n"
      "cell:attach{object = 'what', robot = 'trajectories'}\n"
      "cell:save{file = folder .. 'cell.wld', overwrite = true}");
  const std::string before = digest();
  run("document.clear() world.load{file = folder .. 'cell.wld'}");
  EXPECT_EQ(digest(), before);
}

TEST_F(Growth, LoadingAWorldTakesTimeByTheNumberOfItsObjects) {
  run(kWall);
  const auto load = [this](int count) {
    run("document.clear()");
    run(kWall);
    run("wall(" + std::to_string(count) + ")");
    return time_of(3, [this] { run("document.clear() world.load{file = folder .. 'cell.wld'}"); });
  };
  const double few = load(1000), many = load(8000);
  RecordProperty("times", std::to_string(many / few));
  // It was 64 times as long for 8 times as many, by the square of their number.
  EXPECT_LT(many, 24 * few) << few << " s, " << many << " s";
}

TEST_F(Growth, LinksAreFoundByTheirNamesHoweverManyThereAre) {
  // A comb: every link stands on the first one, every other joint follows the one before.
  const auto comb = [](int count) {
    std::string text = "robomosp robot 1\nname comb\n";
    for (int i = 0; i < count; ++i) {
      text += "link l" + std::to_string(i) + " {\n  joint revolute\n";
      if (i > 0) text += "  parent l" + std::to_string(i / 2) + "\n";
      if (i % 2 == 1 && i > 1) text += "  mimic { link l" + std::to_string(i - 1) + "  ratio 2 }\n";
      text += "  row { a 0.1 }\n}\n";
    }
    return text + "loop pin { kind point  a { link l" + std::to_string(count - 1) +
           " }  b { link l1 } }\ntool tip { link l" + std::to_string(count / 2) + " }\n";
  };
  std::ofstream(folder_ / "comb.rbt") << comb(3000);
  run("r = robot.load{file = folder .. 'comb.rbt'} l = r:links() assert(#l == 3000)\n"
      "r:save{file = folder .. 'again.rbt'}");
  const auto robots = app().document.now()->list(Kind::robot);
  ASSERT_EQ(robots.size(), 1U);
  const auto& robot = std::get<model::Robot>(app().document.now()->find(robots[0])->body);
  for (std::size_t i = 1; i < robot.links.size(); ++i) {
    EXPECT_EQ(robot.links[i].parent, static_cast<std::int32_t>(i / 2));
    if (i % 2 == 1 && i > 1) {
      EXPECT_EQ(robot.links[i].mimic->link, static_cast<std::int32_t>(i) - 1);
    }
  }
  EXPECT_EQ(robot.loops[0].link_a, 2999);
  EXPECT_EQ(robot.tools[0].link, 1500);
  // Names that are not there, or stand behind, are told with those that were meant.
  std::ofstream(folder_ / "wrong.rbt") << "robomosp robot 1\nname r\nlink upper { row { a 1 } }\n"
                                          "link lower { parent uper  row { a 1 } }\n";
  EXPECT_NE(eval("robot.load{file = folder .. 'wrong.rbt'}").find("upper"), std::string::npos);
  std::ofstream(folder_ / "behind.rbt")
      << "robomosp robot 1\nname r\nlink upper { mimic { link lower }  row { a 1 } }\n"
         "link lower { row { a 1 } }\n";
  EXPECT_NE(eval("robot.load{file = folder .. 'behind.rbt'}").find("not a link before"),
            std::string::npos);
}

TEST_F(Growth, AWayLeadsWhereThePathOfTheSameStepsLeads) {
  run(kWall);
  run("wall(20)");
  model::Body body =
      app().document.now()->find(*app().document.now()->find(Kind::world, "cell"))->body;
  const model::MutableContent record = model::content(body);
  const model::Field* objects = record.type->field("objects");
  ASSERT_NE(objects, nullptr);
  const model::Type& placed = *objects->type->element;
  for (std::size_t i = 0; i < 20; ++i)
    for (const char* member : {"name", "what", "placement"}) {
      const model::WayStep way[] = {{objects, 0}, {nullptr, i}, {placed.field(member), 0}};
      const model::MutableContent at = model::follow_for_change(record, way);
      ASSERT_NE(at.data, nullptr);
      EXPECT_EQ(at.type, placed.field(member)->type);
      EXPECT_EQ(at.data, placed.field(member)->in(objects->type->at(objects->in(record.data), i)));
    }
  const model::WayStep beyond[] = {{objects, 0}, {nullptr, 20}};
  EXPECT_EQ(model::follow_for_change(record, beyond).data, nullptr);
  EXPECT_EQ(model::follow_for_change(record, {}).data, record.data);
}

/// Reads files of its own and counts how often.
class CountingImporter final : public Importer {
 public:
  static std::map<std::string, int>& reads() {
    static std::map<std::string, int> all;
    return all;
  }
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  [[nodiscard]] std::string_view extensions() const override { return "counted"; }
  Result<Imported> read(std::string_view path, const Params&, Progress&) const override {
    {
      const std::lock_guard lock(mutex());
      ++reads()[fs::path(std::string(path)).filename().string()];
    }
    if (path.find("bad") != std::string_view::npos)
      return error(ErrorCode::syntax, "it is damaged", "Mend it.");
    Imported out;
    ImportedGeometry g;
    g.name = "g.ply";
    g.geometry.form = CsgGeometry::Form::mesh;
    g.geometry.points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    g.geometry.triangles = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    out.geometries.push_back(std::move(g));
    out.records.push_back(
        {"g.csg", "robomosp solid 1\nname g\nimported body { geometry \"g.ply\" }\n"});
    return out;
  }
};

TEST_F(Growth, AMeshThatManyShapesShowIsReadOnce) {
  ProviderInfo info;
  info.interface_id = Importer::kInterfaceId;
  info.name = "counting";
  info.version = "1";
  ASSERT_TRUE(app()
                  .registry
                  .add(
                      info,
                      [] {
                        return Result<void*>(
                            static_cast<Importer*>(std::make_unique<CountingImporter>().release()));
                      },
                      true)
                  .ok());
  CountingImporter::reads().clear();
  for (const char* name : {"one.counted", "two.counted", "bad.counted"})
    std::ofstream(folder_ / name) << "x";
  // Twenty looks of one file, ten sizes of another, and one that cannot be read.
  write_urdf("r.urdf", 31, [](int i) {
    const std::string file = i < 20 ? "one" : i < 30 ? "two" : "bad";
    const int k = i % 10 + 1;
    return "<visual><geometry><mesh filename=\"" + file + ".counted\" scale=\"" +
           (i < 20 ? std::string("1 1 1") : std::to_string(k) + " 1 -1") +
           "\"/></geometry><material name=\"m" + std::to_string(i) + "\"><color rgba=\"0." +
           std::to_string(10 + i) + " 0 0 1\"/></material></visual>";
  });
  run("made = import{file = folder .. 'r.urdf'}");
  const std::map<std::string, int> once{{"bad.counted", 1}, {"one.counted", 1}, {"two.counted", 1}};
  EXPECT_EQ(CountingImporter::reads(), once);
  EXPECT_EQ(count(Kind::solid), 30U);
  // Every shape has its own size, and mirrored ones enclose no negative volume.
  std::vector<double> volumes;
  for (const AnyId id : app().document.now()->list(Kind::solid)) {
    const auto mass =
        app().dispatch(session_, "solid.mass", {{"id", ioci::Application::handle(id)}});
    ASSERT_TRUE(mass.ok()) << mass.error().sentence();
    volumes.push_back(mass->as_map()->find("volume")->number());
  }
  std::sort(volumes.begin(), volumes.end());
  for (int i = 0; i < 21; ++i) EXPECT_NEAR(volumes[static_cast<std::size_t>(i)], 1.0 / 6, 1e-9);
  for (int k = 2; k <= 10; ++k)
    EXPECT_NEAR(volumes[static_cast<std::size_t>(19 + k)], k / 6.0, 1e-9);
  app().registry.remove(Importer::kInterfaceId, "counting");
}

TEST_F(Growth, MeshesAreReadByAProgramThatStartsQuickly) {
  constexpr int kMeshes = 30;
  for (int i = 0; i < kMeshes; ++i) write_stl("m" + std::to_string(i) + ".stl", 0.1 + 0.001 * i);
  write_urdf("r.urdf", kMeshes, [](int i) {
    return "<visual><geometry><mesh filename=\"m" + std::to_string(i) +
           ".stl\"/></geometry></visual>";
  });
  run("b = solid.create{name = 'b', root = {kind = 'box', x = 1, y = 1, z = 1}}\n"
      "b:export{file = folder .. 'b.step'}");
  const double start = processor_of_children();
  run("import{file = folder .. 'b.step', name = 'again'}");
  const double step = processor_of_children() - start;
  run("import{file = folder .. 'r.urdf'}");
  const double meshes = processor_of_children() - start - step;
  RecordProperty("meshes_per_step_file", std::to_string(meshes / step));
  EXPECT_EQ(count(Kind::solid), 2U + kMeshes);
  // Where each of them starts a program that links Open CASCADE, it takes as long as 30 STEP files.
  EXPECT_LT(meshes, kMeshes / 2 * step) << meshes << " s, " << step << " s";
}

TEST_F(Growth, AnExportWritesTheMeshesThatChangedAndAllFilesOrNone) {
  run("arm = robot.create{name = 'arm', links = {{a = 0.3}, {a = 0.2}, {a = 0.1}}}\n"
      "done = arm:export_urdf{file = folder .. 'arm.urdf'} assert(#done.meshes > 3)");
  const auto stamps = [this] {
    std::map<std::string, fs::file_time_type> all;
    for (const auto& f : fs::recursive_directory_iterator(folder_))
      if (f.is_regular_file()) all[f.path().string()] = f.last_write_time();
    return all;
  };
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(1);
  for (const auto& [name, when] : stamps()) fs::last_write_time(name, old);
  const auto before = stamps();
  run("arm:export_urdf{file = folder .. 'arm.urdf'}");
  for (const auto& [name, when] : stamps())
    EXPECT_EQ(when == before.at(name), name.ends_with(".stl")) << name;
  // A damaged one is written again.
  const std::string mesh = std::find_if(before.begin(), before.end(), [](const auto& f) {
                             return f.first.ends_with(".stl");
                           })->first;
  const auto size = fs::file_size(mesh);
  std::ofstream(mesh) << "damaged";
  run("arm:export_urdf{file = folder .. 'arm.urdf'}");
  EXPECT_EQ(fs::file_size(mesh), size);
  // Where the robot's own file cannot be written, no mesh is left behind.
  fs::create_directories(folder_ / "taken.urdf");
  const auto files = stamps().size();
  EXPECT_NE(eval("arm:export_urdf{file = folder .. 'taken.urdf'}").find("is a folder"),
            std::string::npos);
  EXPECT_EQ(stamps().size(), files);
}

TEST_F(Growth, APathIsBuiltOnceForAllThatIsAskedOfIt) {
  run("t = trajectory.create{name = 'way', segments = {\n"
      "  {shape = 'line', points = {{0, 0, 0, 0, 0, 0}, {0.4, 0, 0, 0, 0, 0}}, speed = 0.1}}}\n"
      "outer = trajectory.create{name = 'outer', segments = {{trajectory = t, position = {1, 0, "
      "0}}}}");
  const auto built = [this](std::string_view code) {
    const auto before = app().paths.built();
    run(code);
    return app().paths.built() - before;
  };
  EXPECT_EQ(built("l = t:length() d = t:duration() assert(math.abs(l - 0.4) < 1e-12)\n"
                  "t:segments() t:points{step = d / 10}"),
            1U);
  EXPECT_EQ(built("assert(t:length() == l) assert(t:duration() == d)"), 0U);
  // An edit is seen, and so is that of a trajectory stored within; undo finds the old one again.
  EXPECT_EQ(built("lo = outer:length() outer:length()"), 1U);
  EXPECT_EQ(built("t:set_segment(1, {points = {{0, 0, 0, 0, 0, 0}, {0.3, 0, 0, 0, 0, 0}}})\n"
                  "assert(math.abs(t:length() - 0.3) < 1e-12)\n"
                  "assert(math.abs(outer:length() - 0.3) < 1e-12)"),
            2U);
  EXPECT_EQ(built("document.undo() assert(t:length() == l) assert(outer:length() == lo)"), 0U);
  // A choice of providers is seen too.
  EXPECT_EQ(built("provider.disable{interface = 'curve', name = 'line'}\n"
                  "assert(not pcall(t.length, t))\n"
                  "provider.enable{interface = 'curve', name = 'line'} assert(t:length() == l)"),
            1U);
}

/// A chain of slender rods with `count` joints, all kinds of axes.
std::string rods(const std::string& name, std::size_t count) {
  const std::string n = std::to_string(count);
  return "local links = {} for i = 1, " + n + " do links[i] = {a = 1 / " + n +
         ", alpha = i % 2 == 0 and '90 deg' or '-90 deg', mass = 1 / " + n + ", com = {-0.5 / " +
         n + ", 0, 0}, inertia = {1e-4, 1e-4, 1e-4, 0, 0, 0}} end\n" + name +
         " = robot.create{name = '" + name + "', links = links}\n";
}

TEST_F(Growth, LongChainsAreAcceleratedByArticulatedBodiesUnlessSomebodyChose) {
  const std::string just = std::to_string(sim::kLongChain);
  run(rods("short", sim::kLongChain - 1) + rods("long", sim::kLongChain) +
      "function fall(r, n)\n"
      "  local q = {} for i = 1, n do q[i] = 0.3 * math.sin(i) end\n"
      "  local run = r:simulate{q = q, duration = 0.05}\n"
      "  local how = 'default' for _, note in ipairs(run:notes()) do\n"
      "    if note:find('accelerations by articulated_body', 1, true) then how = 'articulated' end "
      "end\n"
      "  return how, run:values('q1')\n"
      "end\n"
      "how, by_bodies = fall(long, " +
      just +
      ") assert(how == 'articulated', how)\n"
      "how = fall(short, " +
      just + " - 1) assert(how == 'default', how)");
  // The robot's own choice, and that of the run, hold; and the motion is the same.
  run("long:set{forward_dynamics = 'inertia_matrix'}\n"
      "how, by_matrix = fall(long, " +
      just +
      ") assert(how == 'default', how)\n"
      "for i = 1, #by_matrix do assert(math.abs(by_matrix[i] - by_bodies[i]) < 1e-8) end\n"
      "document.undo()\n"
      "provider.default{interface = 'forward_dynamics', name = 'inertia_matrix'}\n"
      "how = fall(long, " +
      just +
      ") assert(how == 'default', how)\n"
      "provider.default{interface = 'forward_dynamics', name = ''}");
  // Accelerations of one state agree to the accuracy of the solvers.
  run("local q, z, n = {}, {}, " + just +
      " for i = 1, n do q[i] = math.sin(i) z[i] = 0.1 end\n"
      "local a = long:forward_dynamics{q = q, qd = z, tau = z}\n"
      "local b = long:forward_dynamics{q = q, qd = z, tau = z, provider = 'inertia_matrix'}\n"
      "local most = 0 for i = 1, n do most = math.max(most, math.abs(b[i])) end\n"
      "for i = 1, n do assert(math.abs(a[i] - b[i]) < 1e-8 * most) end");
}

TEST_F(Growth, ContactPhysicsTakesTimeByTheNumberOfObjects) {
  // A lattice of boxes that touch nothing, each with settings of its own.
  run("function lattice(n)\n"
      "  document.clear()\n"
      "  solid.create{name = 'brick', root = {kind = 'box', x = 0.2, y = 0.1, z = 0.05}}\n"
      "  local all, side = {}, math.ceil(n ^ (1 / 3))\n"
      "  settings = {}\n"
      "  for i = 0, n - 1 do\n"
      "    all[i + 1] = {what = 'brick', name = 'b' .. i, position = {0.3 * (i % side), 0.3 * (i "
      "// side % side), 0.3 * (i // side // side)}}\n"
      "    settings[i + 1] = {name = 'b' .. i, friction = 0.3}\n"
      "  end\n"
      "  cell = world.create{name = 'cell'} cell:add_objects(all)\n"
      "end");
  const auto physics = [this](int count) {
    run("lattice(" + std::to_string(count) + ")");
    return time_of(2, [this] {
      run("cell:simulate_physics{duration = 0.01, step = 0.001, objects = settings}");
    });
  };
  physics(10);
  const double few = physics(2000), many = physics(16000);
  RecordProperty("times", std::to_string(many / few));
  // It was 60 times as long for 8 times as many.
  EXPECT_LT(many, 24 * few) << few << " s, " << many << " s";
}

TEST_F(Growth, SolidsApartAreUnitedAndMeshedInTimeByTheirNumberWhereverTheyLie) {
  run("function column(n, axis)\n"
      "  document.clear()\n"
      "  local all = {}\n"
      "  for i = 1, n do\n"
      "    local p = {0, 0, 0} p[axis] = 0.02 * i\n"
      "    all[i] = {kind = 'box', x = 0.01, y = 0.01, z = 0.01, position = p}\n"
      "  end\n"
      "  s = solid.create{name = 's', root = {kind = 'union', children = all}}\n"
      "end\n"
      "width = 0.01\n"
      "function edit()\n"
      "  width = width + 1e-5\n"
      "  s:set{path = 'box_2.x', value = width} s:mass() s:mesh_info()\n"
      "end");
  for (const char* axis : {"1", "3"}) {
    const auto edited = [&](int count) {
      run("column(" + std::to_string(count) + ", " + axis + ") edit()");
      return time_of(3, [this] { run("edit()"); });
    };
    const double few = edited(500), many = edited(4000);
    // Along z it was 30 times as long for 8 times as many.
    EXPECT_LT(many, 16 * few) << "axis " << axis << ": " << few << " s, " << many << " s";
  }
  // What touches shares its edges: two boxes that meet along one have 23.
  run("local function box(x, y) return {kind = 'box', x = 0.1, y = 0.1, z = 0.1, position = {x, y, "
      "0}} end\n"
      "s = solid.create{name = 'touching', root = {kind = 'union', children = {box(0, 0), box(0.1, "
      "0.1), box(0.5, 0)}}}\n"
      "local m = s:mesh_info() assert(m.edges == 23 + 12, m.edges)");
}

TEST_F(Growth, RoundedCylindersAreMadeOfToriAndSpheresThatMeshQuickly) {
  // The volume of a cylinder with rounded rims, and of one whose rims meet in the middle, by
  // Pappus.
  run("local function volume(r, h, f)\n"
      "  local c = r - f\n"
      "  return math.pi * r * r * (h - 2 * f) + 2 * math.pi * (c * c * f + 2 * f * f * (c * "
      "math.pi / 4 + f / 3))\n"
      "end\n"
      "for _, v in ipairs{{0.05, 0.1, 0.005}, {0.05, 0.1, 0.02}, {0.05, 0.1, 0.04}, {0.05, 0.1, "
      "0.0499}, {0.05, 0.1, 0.001}} do\n"
      "  local r, h, f = table.unpack(v)\n"
      "  local s = solid.create{name = 's' .. f, root = {kind = 'cylinder', radius = r, height = "
      "h, "
      "fillet = f}}\n"
      "  local exact = volume(r, h, f)\n"
      "  assert(math.abs(s:mass().volume / exact - 1) < 1e-9, f .. ': ' .. s:mass().volume .. ' ' "
      ".. "
      "exact)\n"
      "  assert(s:mesh_info().triangles > 100)\n"
      "end");
  // A first mesh took 12 ms.
  run("k = 0 function fresh() k = k + 1 local s = solid.create{name = 'f' .. k, root = {kind = "
      "'cylinder', radius = 0.05 + 1e-5 * k, height = 0.1, fillet = 0.01}} s:mesh_info() end "
      "fresh()");
  EXPECT_LT(time_of(10, [this] { run("fresh()"); }), 0.006);
}

TEST_F(Growth, SimulatingALongChainTakesTimeByItsLength) {
  const auto fall = [this](int count) {
    const std::string name = "chain" + std::to_string(count);
    run(rods(name, static_cast<std::size_t>(count)));
    return time_of(3, [&] { run("r = " + name + ":simulate{duration = 0.01}"); });
  };
  fall(10);
  const double few = fall(300), many = fall(2400);
  // With a matrix for the energy of every row and for scratch it was 40 times as long for 8 times
  // as many, and 10,000 were refused.
  EXPECT_LT(many, 16 * few) << few << " s, " << many << " s";
  run("for _, x in ipairs(r:values('energy')) do assert(x == x) end\n" + rods("longest", 10000) +
      "longest:simulate{duration = 0.001}\n"
      "local q = {} for i = 1, 10000 do q[i] = 0 end\n"
      "assert(#longest:gravity_torques{q = q} == 10000)");
}

TEST_F(Growth, EnergyOfMotionIsHalfOfRatesTimesTheMatrixTimesRates) {
  // Of the short chain by its matrix; of the long one, whose matrix needs scratch of its own, too.
  for (const int count : {7, 60}) {
    run("document.clear() " + rods("chain", static_cast<std::size_t>(count)) +
        "local n = " + std::to_string(count) +
        "\n"
        "local q, z = {}, {} for i = 1, n do q[i] = math.sin(i) z[i] = 0.1 * math.cos(i) end\n"
        "local run = chain:simulate{q = q, qd = z, duration = 0.001}\n"
        "local kinetic = run:values('kinetic')[1]\n"
        "local m, sum = chain:inertia{q = q}, 0\n"
        "for i = 1, n do for k = 1, n do sum = sum + 0.5 * z[i] * m[i][k] * z[k] end end\n"
        "assert(math.abs(sum / kinetic - 1) < 1e-11, sum .. ' ' .. kinetic)");
  }
}

}  // namespace
}  // namespace robomosp::lua
