// SPDX-License-Identifier: Apache-2.0
// Robots whose meshes are as found in the wild: open, cutting themselves, turned, or unreadable.
// All that can be read is drawn, collides and weighs; files name no others than those of their
// package.
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

/// Binary STL of boxes {low, high}, each but for its last `missing` triangles.
std::string stl(const std::vector<std::array<Vec3, 2>>& boxes, std::size_t missing = 0) {
  std::vector<float> all;
  constexpr int kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& box : boxes) {
    std::vector<float> own;
    for (const auto& face : kFaces)
      for (const int i : {0, 1, 2, 0, 2, 3})
        for (std::size_t k = 0; k < 3; ++k)
          own.push_back(static_cast<float>(box[static_cast<std::size_t>(face[i] >> k) & 1U][k]));
    own.resize(own.size() - 9 * missing);
    all.insert(all.end(), own.begin(), own.end());
  }
  std::string out(80, ' ');
  const auto put = [&](const void* p, std::size_t n) {
    out.append(static_cast<const char*>(p), n);
  };
  const auto count = static_cast<std::uint32_t>(all.size() / 9);
  put(&count, 4);
  for (std::size_t t = 0; t < count; ++t) {
    out.append(12, '\0');
    put(all.data() + 9 * t, 36);
    out.append(2, '\0');
  }
  return out;
}

class ImportedMeshes : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    top_ = fs::temp_directory_path() / ("robomosp-meshes-" + std::to_string(::getpid()));
    folder_ = top_ / "pack" / "arm";
    fs::create_directories(folder_);
    subscription_ = app().messages.subscribe([this](const Message& m) { messages_.push_back(m); });
  }
  void TearDown() override {
    app().messages.unsubscribe(subscription_);
    fs::remove_all(top_);
  }
  std::string put(const std::string& name, const std::string& bytes) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }
  /// All that was said since the test began.
  std::string told(std::optional<Severity> severity = std::nullopt) {
    std::string out;
    for (const Message& m : messages_)
      if (!severity || m.severity == *severity) out += m.text + "\n";
    return out;
  }
  const model::Robot& robot(const std::string& name) {
    snapshot_ = app().document.now();
    const AnyId id = snapshot_->find(Kind::robot, name).value_or(AnyId{});
    return *snapshot_->get(RobotId{id.number});
  }
  std::size_t solids() { return app().document.now()->list(Kind::solid).size(); }
  /// A URDF whose links l1, l2, ... have these meshes.
  static std::string urdf(const std::vector<std::string>& meshes, bool has_mass = true) {
    std::string out = "<robot name=\"arm\"><link name=\"root\"/>";
    std::string parent = "root";
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      const std::string name = "l" + std::to_string(i + 1);
      out += "<link name=\"" + name + "\">";
      if (has_mass)
        out +=
            "<inertial><mass value=\"2\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" "
            "ixz=\"0\" iyz=\"0\"/></inertial>";
      out += "<visual><geometry><mesh filename=\"" + meshes[i] +
             "\"/></geometry></visual></link><joint name=\"j" + name +
             "\" type=\"continuous\"><parent link=\"" + parent + "\"/><child link=\"" + name +
             "\"/><origin xyz=\"0 0 3\"/><axis xyz=\"0 1 0\"/></joint>";
      parent = name;
    }
    return out + "</robot>";
  }

  fs::path top_, folder_;
  std::shared_ptr<const document::Snapshot> snapshot_;
  std::uint64_t subscription_ = 0;
  std::vector<Message> messages_;
};

constexpr Vec3 kLow{-0.5, -0.5, 0}, kHigh{0.5, 0.5, 1};

TEST_F(ImportedMeshes, AreDrawnAndCollideAsTheyAre) {
  put("meshes/cuts.stl", stl({{kLow, kHigh}, {Vec3{-0.2, -0.2, 0.5}, Vec3{0.2, 0.2, 2.5}}}));
  // Two thirds of a box: what closes it would be a guess, but it is there.
  put("meshes/open.stl", stl({{kLow, kHigh}}, 5));
  put("meshes/sound.stl", stl({{kLow, kHigh}}));
  call("import", {{"file", put("arm.urdf",
                               urdf({"meshes/cuts.stl", "meshes/open.stl", "meshes/sound.stl"}))}});
  EXPECT_NE(told().find("l1_cuts"), std::string::npos) << told();
  EXPECT_NE(told().find("cuts itself"), std::string::npos) << told();
  EXPECT_EQ(told().find("\"l3_sound\""), std::string::npos) << told();
  const auto& arm = robot("arm");
  ASSERT_EQ(arm.links.size(), 3U);
  NoProgress progress;
  const AnyId id = snapshot_->find(Kind::robot, "arm").value_or(AnyId{});
  const auto bodies = app().derived.robot_bodies(*snapshot_, RobotId{id.number}, progress);
  ASSERT_TRUE(bodies.ok()) << bodies.error().sentence();
  const auto shapes = app().derived.robot_shapes(*snapshot_, RobotId{id.number}, progress);
  ASSERT_TRUE(shapes.ok()) << shapes.error().sentence();
  for (std::size_t i = 1; i <= 3; ++i) {
    ASSERT_EQ(bodies->bodies[i].size(), 1U) << i;
    EXPECT_FALSE(bodies->bodies[i][0].is_operand);
    EXPECT_FALSE((*shapes)[i].empty()) << i;
  }
  EXPECT_EQ(bodies->bodies[1][0].mesh->triangle_count(), 24U) << "as it is";
  // l1 turned by half a turn has the others below it; l2 turned onto l1 meets its tower.
  const Value clear = call("robot.self_collisions", {{"id", "arm"}, {"q", List{0, 0, 0}}});
  const Value met =
      call("robot.self_collisions", {{"id", "arm"}, {"q", List{0, "180 deg", "180 deg"}}});
  EXPECT_NE(clear.text(), met.text());
}

TEST_F(ImportedMeshes, WeighWhatTheyEncloseWithinTheirError) {
  const Vec3 inner_low{-0.2, -0.2, 0.5}, inner_high{0.2, 0.2, 2.5};
  const std::string file = put("cuts.stl", stl({{kLow, kHigh}, {inner_low, inner_high}}));
  call("import", {{"file", file}, {"unit", "m"}, {"density", 1000}, {"name", "cuts"}});
  const Value mass = call("solid.mass", {{"id", "cuts"}});
  const double volume = 1 + 0.4 * 0.4 * 1.5, error = *at(mass, "relative_error").as_real();
  EXPECT_GT(error, 0);
  EXPECT_LT(error, 0.1);
  EXPECT_NEAR(*at(mass, "volume").as_real(), volume, volume * error);
  EXPECT_NEAR(*at(mass, "mass").as_real(), 1000 * volume, 1000 * volume * error);
  EXPECT_FALSE(*at(mass, "exact").as_bool());
  EXPECT_NE(at(mass, "notes").text().find("does not bound a valid solid"), std::string::npos);
  // Operations need a clean solid, and say where it is none.
  const Error refused = fails("solid.features", {{"id", "cuts"}});
  EXPECT_NE(refused.sentence().find("cuts itself, for example at"), std::string::npos)
      << refused.sentence();
  const Value faults = call("solid.mesh_faults", {{"id", "cuts"}});
  const List& meshes = *at(faults, "meshes").as_list();
  ASSERT_EQ(meshes.size(), 1U);
  std::size_t cuts = 0, overlaps = 0;
  for (const Value& place : *at(meshes[0], "places").as_list()) {
    const std::string kind = *at(place, "kind").as_string();
    cuts += kind == "cut" ? 1U : 0U;
    overlaps += kind == "overlap" ? 1U : 0U;
    if (kind == "cut") {
      EXPECT_NEAR(at(place, "position").as_array()->data()[2], 1, 1e-6);
    }
  }
  EXPECT_GE(cuts, 4U) << "each wall of the tower passes the lid";
  EXPECT_EQ(overlaps, 1U);
}

TEST_F(ImportedMeshes, CountInFullAmongOverlappingPartsAndSayWhatThatMayBe) {
  const std::string file =
      put("cuts.stl", stl({{kLow, kHigh}, {Vec3{-0.2, -0.2, 0.5}, Vec3{0.2, 0.2, 2.5}}}));
  call("material.create", {{"name", "water"}, {"density", 1000}});
  call("import", {{"file", file}, {"unit", "m"}, {"material", "water"}, {"name", "cuts"}});
  call("solid.create", {{"name", "block"},
                        {"root", Map{{"kind", "box"}, {"x", 1}, {"y", 1}, {"z", 1}}},
                        {"material", "water"}});
  const auto part = [](const char* what, double x) {
    return Map{{"what", what}, {"position", List{x, 0, 0}}};
  };
  const auto mass = [&](const char* name, double x) {
    call("object.create", {{"name", name},
                           {"overlap", "once"},
                           {"parts", List{part("cuts", 0), part("block", x), part("block", 10)}}});
    return call("object.mass", {{"id", name}});
  };
  const double full = 1000 * (1 + 0.16 * 1.5 + 2);
  const Value far = mass("far", 5), near = mass("near", 0.5);
  const double alone = *at(far, "relative_error").as_real();
  EXPECT_NEAR(*at(far, "mass").as_real(), full, full * alone);
  EXPECT_LT(alone, 0.05);
  EXPECT_EQ(at(far, "notes").text().find("cannot be cut"), std::string::npos);
  EXPECT_NEAR(*at(near, "mass").as_real(), full, full * alone);
  // Half of the block may be in it, of 3.24 in all.
  EXPECT_NEAR(*at(near, "relative_error").as_real(), alone + 0.5 / 3.24, 0.01);
  EXPECT_NE(at(near, "notes").text().find("cannot be cut"), std::string::npos);
}

TEST_F(ImportedMeshes, StandingForCurvedSolidsAreNotExactNorAfterSaving) {
  // An octahedron for a ball; exact as a solid of its own, not as one that stands for another.
  const auto file = [&](const std::string& name, const std::string& header) {
    std::string ply = "ply\nformat binary_little_endian 1.0\n" + header +
                      "element vertex 6\nproperty double x\nproperty double y\nproperty double z\n"
                      "element face 8\nproperty list uchar uint vertex_indices\nend_header\n";
    const auto add = [&](const auto& x) {
      ply.append(reinterpret_cast<const char*>(&x), sizeof x);
    };
    for (const double s : {1.0, -1.0})
      for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) add(i == k ? s : 0.0);
    for (std::uint32_t t = 0; t < 8; ++t) {
      const std::uint32_t x = t & 1U ? 3 : 0, y = t & 2U ? 4 : 1, z = t & 4U ? 5 : 2;
      const bool is_turned = ((t & 1U) + (t >> 1U & 1U) + (t >> 2U & 1U)) % 2 == 1;
      ply += '\3';
      add(x), add(is_turned ? z : y), add(is_turned ? y : z);
    }
    put(name + ".ply", ply);
    return put(name + ".csg", "robomosp solid 1\nname \"" + name +
                                  "\"\nimported body { geometry \"" + name + ".ply\" }\n");
  };
  const auto check = [&](const std::string& name, double deviation) {
    const Value m = call("solid.moments", {{"id", name}});
    EXPECT_EQ(*at(m, "exact").as_bool(), deviation == 0) << name;
    EXPECT_NEAR(*at(m, "volume").as_real(), 4.0 / 3, 1e-9) << name;
    if (deviation == 0) return;
    // The whole surface, 4 sqrt(3), may be so far off.
    EXPECT_GT(*at(m, "relative_error").as_real(), 0.9 * deviation * 3 * std::sqrt(3.0)) << name;
  };
  call("solid.load", {{"file", file("plain", "")}});
  call("solid.load", {{"file", file("round", "comment deviation 0.01\n")}});
  check("plain", 0);
  check("round", 0.01);
  const std::string saved = (folder_ / "saved.csg").string();
  call("solid.save", {{"id", "round"}, {"file", saved}});
  app().document.clear();
  call("solid.load", {{"file", saved}});
  check("round", 0.01);
}

TEST_F(ImportedMeshes, EllipsoidsOfRobotFilesAreNoMeshes) {
  call("import",
       {{"file", put("arm.xml",
                     "<mujoco model=\"arm\"><worldbody><body name=\"a\"><joint/><geom name=\"e\" "
                     "type=\"ellipsoid\" size=\"1 2 0.5\"/></body></worldbody></mujoco>")}});
  call("import", {{"file", put("leg.sdf",
                               "<sdf version=\"1.9\"><model name=\"leg\"><link name=\"l\"><visual "
                               "name=\"v\"><geometry><ellipsoid><radii>1 2 0.5</radii></ellipsoid>"
                               "</geometry></visual></link></model></sdf>")}});
  EXPECT_EQ(told().find("llipsoid"), std::string::npos) << told();
  const auto check = [&](std::size_t count) {
    const auto snapshot = app().document.now();
    ASSERT_EQ(snapshot->list(Kind::solid).size(), count);
    for (const AnyId id : snapshot->list(Kind::solid)) {
      const auto& solid = std::get<model::Solid>(snapshot->find(id)->body);
      ASSERT_EQ(solid.nodes.size(), 1U);
      EXPECT_EQ(solid.nodes[0].kind, CsgKind::ellipsoid);
      const Value m = call("solid.moments", {{"id", snapshot->find(id)->name}});
      const double volume = 4 * 3.14159265358979323846 / 3;
      EXPECT_TRUE(*at(m, "exact").as_bool());
      EXPECT_NEAR(*at(m, "volume").as_real(), volume, 1e-12 * volume);
    }
  };
  check(2);
  const std::string name =
      app().document.now()->find(app().document.now()->list(Kind::solid)[0])->name;
  const std::string file = (folder_ / "ball.csg").string();
  call("solid.save", {{"id", name}, {"file", file}});
  app().document.clear();
  call("solid.load", {{"file", file}});
  check(1);
}

TEST_F(ImportedMeshes, OpenOnesCanBeStretched) {
  // Two boxes through each other, each with a hole: no solid can be made of them, but a scale needs
  // none.
  const std::string file =
      put("sheet.stl", stl({{kLow, kHigh}, {Vec3{0.2, -0.7, 0.3}, Vec3{0.6, 0.9, 0.8}}}, 1));
  call("import", {{"file", file}, {"unit", "m"}, {"density", 1000}, {"name", "sheet"}});
  const Value plain = call("solid.moments", {{"id", "sheet"}});
  const double before = *at(plain, "volume").as_real();
  EXPECT_FALSE(*at(plain, "exact").as_bool());
  const Value tree = call("solid.tree", {{"id", "sheet"}});
  call("solid.wrap", {{"id", "sheet"},
                      {"node", *at(tree, "name").as_string()},
                      {"kind", "scale"},
                      {"name", "longer"}});
  call("solid.set", {{"id", "sheet"}, {"path", "longer.y"}, {"value", 2}});
  const Value m = call("solid.moments", {{"id", "sheet"}});
  EXPECT_FALSE(*at(m, "exact").as_bool());
  EXPECT_NEAR(*at(m, "volume").as_real(), 2 * before, 1e-9 * std::fabs(before));
}

TEST_F(ImportedMeshes, APlaneHoleIsFilledAndTheFillingIsVouchedFor) {
  call("import", {{"file", put("lid.stl", stl({{kLow, kHigh}}, 2))},
                  {"unit", "m"},
                  {"density", 1000},
                  {"name", "lid"}});
  EXPECT_NE(told().find("1 hole was filled"), std::string::npos) << told();
  EXPECT_NEAR(*at(call("solid.mass", {{"id", "lid"}}), "mass").as_real(), 1000, 1e-3);
  EXPECT_TRUE(at(call("solid.mesh_faults", {{"id", "lid"}}), "meshes").as_list()->empty());
  // Where a tower stands out of the hole, the filling would cut it.
  call("import",
       {{"file", put(
                     "tower.stl", stl({{kLow, kHigh}}, 2).substr(0, 80) +
                                      [&] {
                                        const std::string open = stl({{kLow, kHigh}}, 2),
                                                          tower = stl({{Vec3{0.3, -0.2, 0.3},
                                                                        Vec3{0.8, 0.2, 0.6}}});
                                        const std::uint32_t n = 10 + 12;
                                        std::string out(4, '\0');
                                        std::memcpy(out.data(), &n, 4);
                                        return out + open.substr(84) + tower.substr(84);
                                      }())},
        {"unit", "m"},
        {"name", "tower"}});
  EXPECT_NE(told().find("filling its holes would cut the surface at"), std::string::npos) << told();
  const Value faults = call("solid.mesh_faults", {{"id", "tower"}});
  ASSERT_EQ(at(faults, "meshes").as_list()->size(), 1U);
  EXPECT_EQ(*at((*at(faults, "meshes").as_list())[0], "open_edges").as_int(), 4);
}

TEST_F(ImportedMeshes, ThatCannotBeReadAreNotThere) {
  put("meshes/broken.stl", "solid nothing\nfacet normal 0 0");
  put("meshes/sound.stl", stl({{kLow, kHigh}}));
  const Value made =
      call("import", {{"file", put("arm.urdf", urdf({"meshes/broken.stl", "meshes/sound.stl"}))}});
  EXPECT_NE(told().find("broken.stl\" was left out"), std::string::npos) << told();
  EXPECT_EQ(solids(), 1U) << "no stand-in stays";
  EXPECT_TRUE(robot("arm").links[0].parts.empty());
  EXPECT_EQ(robot("arm").links[1].parts.size(), 1U);
  EXPECT_EQ(made.text().find("broken"), std::string::npos);
  const Value out =
      call("robot.export_urdf", {{"id", "arm"}, {"file", (folder_ / "out.urdf").string()}});
  std::ifstream in(folder_ / "out.urdf");
  const std::string xml{std::istreambuf_iterator<char>(in), {}};
  std::size_t meshes = 0;
  for (auto p = xml.find("<mesh "); p != std::string::npos; p = xml.find("<mesh ", p + 1)) ++meshes;
  EXPECT_EQ(meshes, 2U) << "one, as visual and as collision shape";
}

TEST_F(ImportedMeshes, OfMjcfHaveTheirMasses) {
  put("box.stl", stl({{kLow, kHigh}}));
  // A slab far to the side makes the middle of the surface lie outside of both.
  put("two.stl", stl({{kLow, kHigh}, {Vec3{3, -0.5, 0}, Vec3{4, 0.5, 1}}}));
  const auto body = [](const std::string& name, const std::string& geom) {
    return "<body name=\"" + name + "\"><joint axis=\"0 0 1\"/>" + geom;
  };
  call("import",
       {{"file",
         put("arm.xml",
             "<mujoco model=\"arm\"><compiler angle=\"radian\"/><asset>"
             "<mesh name=\"box\" file=\"box.stl\" scale=\"0.1 0.2 0.3\"/>"
             "<mesh name=\"two\" file=\"two.stl\" inertia=\"exact\"/>"
             "<mesh name=\"legacy\" file=\"two.stl\"/>"
             "<mesh name=\"hull\" file=\"two.stl\" inertia=\"convex\"/>"
             "<mesh name=\"gone\" file=\"gone.stl\"/>"
             "<mesh name=\"shell\" file=\"box.stl\" inertia=\"shell\"/></asset><worldbody>" +
                 body("a", "<geom type=\"mesh\" mesh=\"box\" mass=\"5\" pos=\"1 0 0\"/>") +
                 body("b", "<geom type=\"mesh\" mesh=\"two\" density=\"10\"/>") +
                 body("c", "<geom type=\"mesh\" mesh=\"hull\" density=\"10\"/>") +
                 body("d", "<geom type=\"mesh\" mesh=\"shell\" density=\"10\"/>") +
                 body("e", "<geom type=\"mesh\" mesh=\"legacy\" density=\"10\"/>") +
                 body("f", "<geom type=\"mesh\" mesh=\"box\"/>") +
                 body("g", "<geom type=\"mesh\" mesh=\"gone\" mass=\"3\" pos=\"0 1 0\"/>") +
                 "</body></body></body></body></body></body></body></worldbody></mujoco>")}});
  const auto given = [&](std::size_t i) { return robot("arm").links[i].given.value(); };
  EXPECT_NEAR(given(0).mass, 5, 1e-12);
  EXPECT_NEAR(given(0).com[0], 1, 1e-7);
  EXPECT_NEAR(given(0).com[2], 0.15, 1e-7);
  EXPECT_NEAR(given(0).inertia.xx, 5.0 / 12 * (0.04 + 0.09), 1e-7);
  EXPECT_NEAR(given(0).inertia.zz, 5.0 / 12 * (0.01 + 0.04), 1e-7);
  EXPECT_NEAR(given(1).mass, 20, 1e-3);
  EXPECT_NEAR(given(1).com[0], 1.75, 1e-4);
  EXPECT_NEAR(given(2).mass, 45, 1e-4);
  EXPECT_NEAR(given(3).mass, 60, 1e-5);
  EXPECT_NEAR(given(3).com[2], 0.5, 1e-7);
  EXPECT_NEAR(given(3).inertia.xx, 60 * (2.0 / 6 * (1.0 / 12 + 1.0 / 4) * 2 + 2.0 / 6 / 6), 1e-4);
  // From the middle of both, (1.75, 0, 0.5): the sides towards each other count as well.
  EXPECT_NEAR(given(4).mass, 10 * (2.0 + 2 * 2 * (1.25 / 3)), 1e-3);
  EXPECT_NEAR(given(5).mass, 6, 1e-6) << "water, where nothing is said";
  EXPECT_NEAR(given(6).mass, 3, 1e-12) << "the mesh is missing, its mass is not";
  EXPECT_EQ(given(6).com[1], 1);
  EXPECT_NE(told().find("\"gone.stl\" was not found"), std::string::npos) << told();
  EXPECT_NE(told().find("\"legacy\""), std::string::npos) << told();
}

TEST_F(ImportedMeshes, ARobotWithoutMassesIsAWarning) {
  put("m.stl", stl({{kLow, kHigh}}));
  call("import", {{"file", put("arm.urdf", urdf({"m.stl", "m.stl"}, false))}});
  EXPECT_NE(told(Severity::warning).find("The robot \"arm\" has no masses"), std::string::npos)
      << told();
}

// Principal moments 1, 1 and 3: no body has them, as 3 > 1 + 1. The joint's limits are those of
// joint_a4 in kuka_kr5_support, where the sign of the lower one is missing.
TEST_F(ImportedMeshes, ImpossibleInertiasAndJointsThatCannotMoveAreWarnings) {
  const auto arm = [](const char* base, const char* izz, const char* lower) {
    return std::string(
               "<robot name=\"doubt\"><link name=\"foot\"><inertial><mass value=\"1\"/>"
               "<inertia ixx=\"1\" iyy=\"1\" izz=\"") +
           base +
           "\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link><link name=\"hand\"><inertial>"
           "<mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"" +
           izz +
           "\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"turn\" "
           "type=\"revolute\"><parent link=\"foot\"/><child link=\"hand\"/><axis xyz=\"0 0 1\"/>"
           "<limit effort=\"0\" lower=\"" +
           lower + "\" upper=\"6.1086523819801535\" velocity=\"1\"/></joint></robot>";
  };
  const auto write = [&](const std::string& text) {
    std::ofstream(folder_ / "doubt.urdf", std::ios::binary) << text;
    return (folder_ / "doubt.urdf").string();
  };
  call("import", {{"file", write(arm("3", "1", "6.1086523819801535"))}});
  const std::string base = told(Severity::warning);
  EXPECT_NE(base.find("no body can have"), std::string::npos) << base;
  EXPECT_NE(base.find("the base (1, 1 and 3)"), std::string::npos) << base;
  EXPECT_NE(base.find("joints that cannot move"), std::string::npos) << base;
  EXPECT_NE(base.find("\"hand\" (350 deg)"), std::string::npos) << base;
  app().document.clear();
  messages_.clear();
  call("import", {{"file", write(arm("1", "3", "-1"))}});
  EXPECT_NE(told(Severity::warning).find("\"hand\" (1, 1 and 3)"), std::string::npos) << told();
  app().document.clear();
  messages_.clear();
  // The bound itself is a flat plate's.
  call("import", {{"file", write(arm("2", "2", "-1"))}});
  EXPECT_EQ(told(Severity::warning), "") << told();
}

TEST_F(ImportedMeshes, FilesOutsideThePackageAreNotOpenedUnasked) {
  std::ofstream(top_ / "pack" / "beside.stl", std::ios::binary) << stl({{kLow, kHigh}});
  std::ofstream(top_ / "other.xml") << "<mujoco/>";
  const std::string absolute = (top_ / "pack" / "beside.stl").string();
  for (const std::string& name : {std::string("../beside.stl"), absolute, "file://" + absolute,
                                  std::string("package://../beside.stl")}) {
    app().document.clear();
    messages_.clear();
    const std::string file = put("arm.urdf", urdf({name}));
    call("import", {{"file", file}});
    EXPECT_NE(told().find("outside the package"), std::string::npos) << name << "\n" << told();
    EXPECT_EQ(solids(), 0U) << name;
    app().document.clear();
    call("import", {{"file", file}, {"options", Map{{"outside", true}}}});
    EXPECT_EQ(solids(), name.starts_with("package") ? 0U : 1U) << name;
  }
  // A link of the file system leads outside as well.
  app().document.clear();
  fs::create_symlink(absolute, folder_ / "inside.stl");
  call("import", {{"file", put("arm.urdf", urdf({"inside.stl"}))}});
  EXPECT_EQ(solids(), 0U);
  const Error refused = fails(
      "import", {{"file", put("arm.xml", "<mujoco><include file=\"../../other.xml\"/></mujoco>")}});
  EXPECT_NE(refused.sentence().find("outside the package"), std::string::npos)
      << refused.sentence();
  // The package is what its mark, or the custom of folders, says.
  app().document.clear();
  call("import", {{"file", put("urdf/arm.urdf", urdf({"../meshes/m.stl"}))}});
  put("meshes/m.stl", stl({{kLow, kHigh}}));
  call("import", {{"file", put("urdf/arm.urdf", urdf({"../meshes/m.stl"}))}, {"name", "two"}});
  EXPECT_EQ(solids(), 1U);
  // The mark of a model does not hide the package that it is in.
  app().document.clear();
  put("urdf/model.config", "<model/>");
  call("import", {{"file", put("urdf/arm.urdf", urdf({"../meshes/m.stl"}))}});
  EXPECT_EQ(solids(), 1U);
  app().document.clear();
  std::ofstream(top_ / "pack" / "package.xml") << "<package/>";
  call("import", {{"file", put("arm.urdf", urdf({"../beside.stl"}))}});
  EXPECT_EQ(solids(), 1U);
}

}  // namespace
}  // namespace robomosp
