// SPDX-License-Identifier: Apache-2.0
// Editing the tree of a solid by commands: structure, places, names, expressions, profiles.
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "model/solid_edit.h"

namespace robomosp::ioci {
namespace {

class SolidNodes : public ::testing::Test {
 protected:
  SolidNodes() {
    auto made = Application::create({.plugin_path = {ROBOMOSP_PLUGIN_DIR}, .library = {}});
    if (made.ok()) app = std::move(*made);
  }
  void SetUp() override {
    ASSERT_TRUE(app);
    // cut(at z 0.1): body, holes(at x 0.05): bore, dent
    const Map hole{{"kind", "cylinder"},
                   {"name", "bore"},
                   {"radius", "r"},
                   {"height", 0.03},
                   {"position", List{"2*r", 0, 0}}};
    const Map dent{{"kind", "sphere"}, {"name", "dent"}, {"radius", "4 mm"}};
    const Map body{{"kind", "box"}, {"name", "body"}, {"x", 0.2}, {"y", 0.1}, {"z", 0.01}};
    const Map holes{{"kind", "union"},
                    {"name", "holes"},
                    {"position", List{0.05, 0, 0}},
                    {"rpy", List{0, 0, "90 deg"}},
                    {"children", List{hole, dent}}};
    call("solid.create", {{"name", "plate"},
                          {"parameters", Map{{"r", "10 mm"}}},
                          {"root", Map{{"kind", "difference"},
                                       {"name", "cut"},
                                       {"position", List{0, 0, 0.1}},
                                       {"children", List{body, holes}}}}});
  }
  Value call(std::string_view name, const Map& args) {
    auto r = app->dispatch(session, name, args);
    EXPECT_TRUE(r.ok()) << name << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? std::move(*r) : Value();
  }
  std::string refusal(std::string_view name, const Map& args) {
    const std::string before = app->document.content_digest();
    auto r = app->dispatch(session, name, args);
    EXPECT_EQ(app->document.content_digest(), before) << name;
    return r.ok() ? "accepted" : r.error().sentence();
  }
  const model::Solid& solid(const std::string& name = "plate") {
    now = app->document.now();
    return *now->get(SolidId{now->find(Kind::solid, name)->number});
  }
  std::string order() {
    std::string out;
    for (const auto& n : solid().nodes)
      out += n.name + "<" +
             (n.parent < 0 ? "" : solid().nodes[static_cast<std::size_t>(n.parent)].name) + " ";
    return out;
  }
  Vec3 place(const std::string& node) {
    const model::Solid& s = solid();
    return model::solid_T_node(s, *model::find_node(s, node)).p;
  }
  void expect_near(const Vec3& a, const Vec3& b) {
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-15) << i;
  }

  std::unique_ptr<Application> app;
  Session session{"test"};
  document::SnapshotPtr now;
};

TEST_F(SolidNodes, AMoveKeepsThePlaceInTheSolidAndIsOneStep) {
  expect_near(place("bore"), {0.05, 0.02, 0.1});
  const auto steps = app->document.undo_labels().size();
  call("solid.move_node", {{"id", "plate"}, {"node", "bore"}, {"parent", "cut"}, {"index", 2}});
  EXPECT_EQ(order(), "cut< body<cut bore<cut holes<cut dent<holes ");
  expect_near(place("bore"), {0.05, 0.02, 0.1});
  EXPECT_EQ(app->document.undo_labels().size(), steps + 1);
  // The radius stays an expression, the place is a number now.
  EXPECT_EQ(solid().parametric.expressions.count("bore.radius"), 1U);
  EXPECT_EQ(solid().parametric.expressions.count("bore.position.x"), 0U);

  // Its numbers, (0.05, 0.02, 0), now count from a frame at x 0.05 with x along the solid's y.
  call("solid.move_node",
       {{"id", "plate"}, {"node", "bore"}, {"parent", "holes"}, {"stay", false}});
  expect_near(place("bore"), {0.03, 0.05, 0.1});
}

TEST_F(SolidNodes, AMoveFromBelowAPatternSaysThatTheShapeMoves) {
  const auto said = [&] {
    std::string out;
    for (const Message& m : app->messages.recent(1000))
      if (m.code == "stay") out = m.text;
    return out;
  };
  call("solid.wrap", {{"id", "plate"}, {"node", "bore"}, {"kind", "union"}, {"name", "both"}});
  call("solid.wrap", {{"id", "plate"},
                      {"node", "both"},
                      {"kind", "scale"},
                      {"name", "thin"},
                      {"fields", Map{{"x", 0.5}}}});
  call("solid.add_node", {{"id", "plate"},
                          {"parent", "both"},
                          {"node", Map{{"kind", "sphere"}, {"name", "ball"}, {"radius", 0.01}}}});
  call("solid.move_node", {{"id", "plate"}, {"node", "ball"}, {"parent", "both"}, {"index", 1}});
  EXPECT_EQ(said(), "");
  call("solid.move_node", {{"id", "plate"}, {"node", "ball"}, {"parent", "holes"}});
  EXPECT_EQ(said(), "The frame of \"ball\" stays; what it makes does not, by scale \"thin\".");
}

TEST_F(SolidNodes, ATreeDeeperThanTablesAreIsRefusedWithItsLimit) {
  auto tx = app->document.begin("deep");
  ASSERT_TRUE(tx.ok());
  const auto nested = [&](const std::string& name, std::int32_t levels) {
    model::Solid s;
    for (std::int32_t i = 0; i < levels; ++i) {
      model::SolidNode n;
      n.kind = i + 1 < levels ? CsgKind::union_ : CsgKind::sphere;
      n.parent = i - 1;
      n.name = "n" + std::to_string(i);
      n.sizes[0] = 0.01;
      s.nodes.push_back(n);
    }
    EXPECT_TRUE(tx->add(name, std::move(s)).ok());
  };
  nested("shallow", 100);
  nested("deep", 30'000);
  ASSERT_TRUE(tx->commit().ok());
  const Value tree = call("solid.tree", {{"id", "shallow"}});
  ASSERT_TRUE(tree.as_map());
  EXPECT_NE(refusal("solid.tree", {{"id", "deep"}}).find("nested deeper than 100 levels"),
            std::string::npos);
}

TEST_F(SolidNodes, MovesThatMakeNoTreeAreRefused) {
  const auto move = [&](const char* node, const char* parent) {
    return refusal("solid.move_node", {{"id", "plate"}, {"node", node}, {"parent", parent}});
  };
  EXPECT_EQ(move("cut", "holes"),
            "solid \"plate\": node \"cut\" is the root. Move other nodes out of it instead.");
  EXPECT_NE(move("holes", "holes").find("cannot be moved into itself"), std::string::npos);
  EXPECT_NE(move("bore", "body").find("box \"body\" cannot have children"), std::string::npos);
  call("solid.wrap", {{"id", "plate"}, {"node", "bore"}, {"kind", "union"}, {"name", "inner"}});
  EXPECT_NE(move("holes", "inner").find("\"inner\" is inside \"holes\""), std::string::npos);
  EXPECT_NE(move("bore", "cut").find("the only child of union \"inner\""), std::string::npos);
}

TEST_F(SolidNodes, ACopyHasNamesAndExpressionsOfItsOwn) {
  const Value made = call("solid.duplicate_node", {{"id", "plate"}, {"node", "holes"}});
  EXPECT_EQ(*made.as_string(), "holes_2");
  EXPECT_EQ(order(),
            "cut< body<cut holes<cut bore<holes dent<holes holes_2<cut bore_2<holes_2 "
            "dent_2<holes_2 ");
  EXPECT_EQ(solid().parametric.expressions.at("bore_2.radius"), "r");
  EXPECT_EQ(solid().parametric.expressions.at("bore_2.position.x"), "2*r");
  call("solid.set", {{"id", "plate"}, {"path", "bore.radius"}, {"value", 0.002}});
  EXPECT_EQ(solid().nodes[6].sizes[0], 0.01);
  call("solid.remove_node", {{"id", "plate"}, {"node", "holes_2"}});
  EXPECT_EQ(solid().parametric.expressions.size(), 1U);  // bore.position.x
}

TEST_F(SolidNodes, ANodeOfAnotherSolidComesWithNumbersInsteadOfItsParameters) {
  call("solid.create",
       {{"name", "other"},
        {"root",
         Map{{"kind", "union"},
             {"children", List{Map{{"kind", "sphere"}, {"name", "bore"}, {"radius", 1}}}}}}});
  const Value made =
      call("solid.add_node", {{"id", "other"}, {"copy", "holes"}, {"from", "plate"}, {"index", 1}});
  EXPECT_EQ(*made.as_string(), "holes");
  const model::Solid& s = solid("other");
  ASSERT_EQ(s.nodes.size(), 5U);
  EXPECT_EQ(s.nodes[2].name, "bore_2");
  EXPECT_EQ(s.nodes[2].sizes[0], 0.01);
  EXPECT_TRUE(s.parametric.expressions.empty());
}

TEST_F(SolidNodes, UnwrappingKeepsWhatIsInsideWhereItStands) {
  call("solid.unwrap", {{"id", "plate"}, {"node", "holes"}});
  EXPECT_EQ(order(), "cut< body<cut bore<cut dent<cut ");
  expect_near(place("bore"), {0.05, 0.02, 0.1});
  EXPECT_NE(refusal("solid.unwrap", {{"id", "plate"}}).find("a solid has a single root"),
            std::string::npos);
  call("solid.wrap", {{"id", "plate"}, {"kind", "mirror"}, {"fields", Map{{"normal_y", 1}}}});
  EXPECT_EQ(solid().nodes[0].kind, CsgKind::mirror);
  call("solid.unwrap", {{"id", "plate"}});
  EXPECT_EQ(solid().nodes[0].name, "cut");
}

TEST_F(SolidNodes, AReplacementStandsWhereTheOldNodeStoodUnderItsName) {
  call("solid.replace_node",
       {{"id", "plate"},
        {"node", "bore"},
        {"with", Map{{"kind", "cone"}, {"base_radius", 0.01}, {"top_radius", 0}, {"height", 1}}}});
  EXPECT_EQ(order(), "cut< body<cut holes<cut bore<holes dent<holes ");
  EXPECT_EQ(solid().nodes[3].kind, CsgKind::cone);
  expect_near(place("bore"), {0.05, 0.02, 0.1});
  EXPECT_EQ(solid().parametric.expressions.count("bore.radius"), 0U);
  call("solid.replace_node", {{"id", "plate"}, {"node", "cut"}, {"copy", "dent"}});
  EXPECT_EQ(order(), "dent< ");
  EXPECT_TRUE(solid().parametric.expressions.empty());
  EXPECT_EQ(solid().parametric.parameters.size(), 1U);
}

TEST_F(SolidNodes, ModifiersHoldOneNode) {
  call("solid.wrap", {{"id", "plate"},
                      {"node", "body"},
                      {"kind", "fillet"},
                      {"fields", Map{{"radius", "r/5"}, {"select", "parallel z"}}}});
  EXPECT_EQ(solid().nodes[1].select, "parallel z");
  EXPECT_EQ(solid().nodes[1].sizes[0], 0.002);
  EXPECT_EQ(solid().parametric.expressions.at("fillet.radius"), "r/5");
  const Map ball{{"kind", "sphere"}, {"radius", 1}};
  EXPECT_NE(refusal("solid.add_node", {{"id", "plate"}, {"parent", "fillet"}, {"node", ball}})
                .find("takes one node"),
            std::string::npos);
  EXPECT_NE(
      refusal("solid.duplicate_node", {{"id", "plate"}, {"node", "body"}}).find("takes one node"),
      std::string::npos);
  EXPECT_NE(refusal("solid.set", {{"id", "plate"}, {"path", "fillet.select"}, {"value", "upwards"}})
                .find("\"upwards\""),
            std::string::npos);
}

TEST_F(SolidNodes, ShortFormsOfProfilesAreLoopsAndKeepExpressions) {
  call("solid.create",
       {{"name", "web"},
        {"parameters", Map{{"w", "40 mm"}}},
        {"root", Map{{"kind", "prism"},
                     {"height", 0.01},
                     {"profile", List{Map{{"rectangle", List{"w", "20 mm"}}},
                                      Map{{"circle", List{List{0, 0}, "w/10"}}}}}}}});
  const auto corner = [&] { return solid("web").nodes[0].profile->loops[0].start; };
  EXPECT_EQ(corner(), (std::array<double, 2>{-0.02, -0.01}));
  EXPECT_EQ(solid("web").nodes[0].profile->loops[1].curves[0].points[1][0], 0.004);
  call("solid.set_parameter", {{"id", "web"}, {"name", "w"}, {"value", "60 mm"}});
  EXPECT_EQ(corner(), (std::array<double, 2>{-0.03, -0.01}));
  call("solid.set", {{"id", "web"}, {"path", "prism.profile.1.3.y"}, {"value", "12 mm"}});
  EXPECT_EQ(solid("web").nodes[0].profile->loops[0].curves[1].points[0][1], 0.012);
  // A tree is what create takes.
  call("solid.create", {{"name", "twin"},
                        {"parameters", Map{{"w", "60 mm"}}},
                        {"root", call("solid.tree", {{"id", "web"}})}});
  EXPECT_EQ(*solid("web").nodes[0].profile, *solid("twin").nodes[0].profile);
  EXPECT_EQ(solid("web").parametric.expressions, solid("twin").parametric.expressions);
  call("solid.set", {{"id", "web"},
                     {"path", "prism.profile"},
                     {"value", Map{{"regular", Map{{"sides", 4}, {"radius", 1}}}}}});
  EXPECT_TRUE(solid("web").parametric.expressions.empty());
  EXPECT_NEAR(solid("web").nodes[0].profile->loops[0].curves[0].points[0][1], 1, 1e-15);
}

TEST_F(SolidNodes, AMeshIsGivenByPointsAndPassedOnByName) {
  const Map mesh{{"points", List{List{0, 0, 0}, List{1, 0, 0}, List{0, 1, 0}, List{0, 0, 1}}},
                 {"triangles", List{List{1, 3, 2}, List{1, 2, 4}, List{2, 3, 4}, List{3, 1, 4}}}};
  call("solid.create", {{"name", "a"}, {"root", Map{{"kind", "imported"}, {"geometry", mesh}}}});
  call("solid.create", {{"name", "b"}, {"root", call("solid.tree", {{"id", "a"}})}});
  EXPECT_EQ(solid("a").nodes[0].geometry, solid("b").nodes[0].geometry);
  const Map open{{"points", *mesh.find("points")}, {"triangles", List{List{1, 3, 2}}}};
  // An open one is there as it is, but nothing can be done with it.
  call("solid.create", {{"name", "c"}, {"root", Map{{"kind", "imported"}, {"geometry", open}}}});
  EXPECT_EQ(solid("c").nodes[0].geometry->triangles.size(), 3U);
  EXPECT_NE(refusal("solid.features", {{"id", "c"}}).find("not closed"), std::string::npos);
}

TEST_F(SolidNodes, TheGlobalFrameLeavesOutWhatIsAbove) {
  call("solid.set", {{"id", "plate"}, {"path", "dent.frame"}, {"value", "global"}});
  call("solid.set",
       {{"id", "plate"}, {"path", "dent.spherical"}, {"value", List{2, "90 deg", "90 deg"}}});
  EXPECT_NEAR(place("dent")[1], 2, 1e-15);
  EXPECT_NEAR(place("dent")[2], 0, 1e-15);
  call("solid.set", {{"id", "plate"}, {"path", "dent.position.z"}, {"value", "0 deg"}});
  EXPECT_NEAR(place("dent")[2], 2, 1e-15);
  call("solid.set", {{"id", "plate"}, {"path", "dent.quaternion"}, {"value", List{1, 0, 0, 1}}});
  EXPECT_NEAR(solid().nodes[4].placement.angles[2], std::acos(0.0), 1e-15);
}

// Centred, the first moment about z is 0 whatever the height, which is an expression; on its base
// it is area h^2 / 2.
TEST_F(SolidNodes, CentredPrimitivesStayCentredWhenTheirHeightChanges) {
  const auto lift = [&] {
    const Value m = call("solid.moments", {{"id", "post"}});
    return (*m.as_map()->find("first")->as_array())[2];
  };
  call("solid.create", {{"name", "post"},
                        {"parameters", Map{{"high", "0.4 m"}}},
                        {"root", Map{{"kind", "box"},
                                     {"name", "body"},
                                     {"x", 0.1},
                                     {"y", 0.2},
                                     {"z", "high"},
                                     {"centred", true}}}});
  EXPECT_NEAR(lift(), 0, 1e-15);
  call("solid.set_parameter", {{"id", "post"}, {"name", "high"}, {"value", 1.0}});
  EXPECT_NEAR(lift(), 0, 1e-15);
  call("solid.set", {{"id", "post"}, {"path", "body.centred"}, {"value", false}});
  EXPECT_NEAR(lift(), 0.02 / 2, 1e-15);
  call("document.undo", {});
  EXPECT_NEAR(lift(), 0, 1e-15);
  // Replaced by what stands as well it stays centred; a tree says so, and makes the same again.
  call("solid.replace_node", {{"id", "post"},
                              {"node", "body"},
                              {"with", Map{{"kind", "cylinder"}, {"radius", 0.1}, {"height", 1}}}});
  EXPECT_NEAR(lift(), 0, 1e-15);
  call("solid.create", {{"name", "twin"}, {"root", call("solid.tree", {{"id", "post"}})}});
  EXPECT_TRUE(solid("twin").nodes[0].is_centred);
  EXPECT_NE(
      refusal("solid.create", {{"name", "ball"},
                               {"root", Map{{"kind", "sphere"}, {"radius", 1}, {"centred", true}}}})
          .find("centred"),
      std::string::npos);
}

TEST_F(SolidNodes, EllipsoidsAndScalesAreNodesAsAllOthers) {
  const double ball = 4 * std::numbers::pi / 3;
  const auto volume = [&](const std::string& name) {
    const Value m = call("solid.moments", {{"id", name}});
    EXPECT_TRUE(*m.as_map()->find("exact")->as_bool()) << name;
    return *m.as_map()->find("volume")->as_real();
  };
  call("solid.create",
       {{"name", "egg"},
        {"parameters", Map{{"r", "20 mm"}}},
        {"root",
         Map{{"kind", "ellipsoid"}, {"name", "shell"}, {"x", "r"}, {"y", "r/2"}, {"z", "2*r"}}}});
  EXPECT_NEAR(volume("egg"), ball * 8e-6, 1e-12 * 8e-6);
  call("solid.set_parameter", {{"id", "egg"}, {"name", "r"}, {"value", "10 mm"}});
  EXPECT_NEAR(volume("egg"), ball * 1e-6, 1e-12 * 1e-6);
  call("document.undo", {});
  EXPECT_NEAR(volume("egg"), ball * 8e-6, 1e-12 * 8e-6);

  // A sphere in a scale is that ellipsoid; the factors are expressions too.
  call("solid.create",
       {{"name", "stretched"},
        {"parameters", Map{{"k", 2}}},
        {"root",
         Map{{"kind", "scale"},
             {"name", "wide"},
             {"y", 0.5},
             {"z", "k"},
             {"children", List{Map{{"kind", "sphere"}, {"name", "core"}, {"radius", "20 mm"}}}}}}});
  EXPECT_NEAR(volume("stretched"), ball * 8e-6, 1e-12 * 8e-6);
  call("solid.set", {{"id", "stretched"}, {"path", "wide.x"}, {"value", 3}});
  EXPECT_NEAR(volume("stretched"), 3 * ball * 8e-6, 3e-12 * 8e-6);
  EXPECT_EQ(solid("stretched").nodes[0].sizes, (std::array<double, 6>{3, 0.5, 2}));

  // Around a node that is there, and saved, with what is inside.
  const double plate = volume("plate");
  call("solid.wrap", {{"id", "plate"}, {"node", "cut"}, {"kind", "scale"}, {"name", "longer"}});
  call("solid.set", {{"id", "plate"}, {"path", "longer.x"}, {"value", 1.5}});
  EXPECT_NEAR(volume("plate"), 1.5 * plate, 1e-11 * plate);
  const auto folder =
      std::filesystem::temp_directory_path() / ("robomosp-scaled-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::vector<std::string> names{"plate", "stretched", "egg"};
  std::vector<model::Solid> before;
  std::vector<double> held;
  for (const std::string& name : names) {
    before.push_back(solid(name));
    held.push_back(volume(name));
    call("solid.save", {{"id", name}, {"file", (folder / (name + ".csg")).string()}});
  }
  app->document.clear();
  for (std::size_t k = 0; k < names.size(); ++k) {
    SCOPED_TRACE(names[k]);
    call("solid.load", {{"file", (folder / (names[k] + ".csg")).string()}});
    const model::Solid& after = solid(names[k]);
    ASSERT_EQ(after.nodes.size(), before[k].nodes.size());
    for (std::size_t i = 0; i < after.nodes.size(); ++i) {
      EXPECT_EQ(after.nodes[i].kind, before[k].nodes[i].kind);
      EXPECT_EQ(after.nodes[i].sizes, before[k].nodes[i].sizes);
    }
    EXPECT_EQ(after.parametric.expressions, before[k].parametric.expressions);
    EXPECT_EQ(volume(names[k]), held[k]);
  }
  std::filesystem::remove_all(folder);

  const auto set = [&](const char* id, const char* path, const Value& value) {
    return refusal("solid.set", {{"id", id}, {"path", path}, {"value", value}});
  };
  for (const double x : {0.0, -1.0, 1e300, 1e-300, 1001.0}) {
    EXPECT_NE(set("stretched", "wide.x", x).find("x"), std::string::npos) << x;
    EXPECT_NE(set("stretched", "wide.x", x), "accepted") << x;
  }
  EXPECT_NE(set("stretched", "wide.x", 1001.0).find("a scale is from 0.001 to 1000"),
            std::string::npos);
  EXPECT_NE(set("egg", "shell.y", 0.0), "accepted");
  EXPECT_NE(set("egg", "shell.y", std::nan("")), "accepted");
  EXPECT_NE(refusal("solid.add_node", {{"id", "stretched"},
                                       {"parent", "wide"},
                                       {"node", Map{{"kind", "sphere"}, {"radius", 1}}}})
                .find("wide"),
            std::string::npos)
      << "a scale holds one node";
}

}  // namespace
}  // namespace robomosp::ioci
