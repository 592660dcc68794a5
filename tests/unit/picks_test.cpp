// SPDX-License-Identifier: Apache-2.0
// Picks in pictures of rich worlds: each leads to a path that the commands set, and the scene
// follows.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "scene/movable.h"
#include "scene/origin.h"
#include "scene/scene_model.h"
#include "support/lua_program.h"

namespace robomosp::scene {
namespace {

/// Inside a value from record.describe: names of fields and numbers of elements from 1.
Value value_inside(Value whole, std::string_view path) {
  while (!path.empty()) {
    const auto dot = path.find('.');
    const std::string step(path.substr(0, dot));
    path = dot == std::string_view::npos ? "" : path.substr(dot + 1);
    const List* list = whole.as_list();
    const Map* map = whole.as_map();
    const Value* next = nullptr;
    if (list) {
      const auto i = static_cast<std::size_t>(std::stoul(step));
      if (i >= 1 && i <= list->size()) next = &(*list)[i - 1];
    } else if (map) {
      next = map->find(step);
    }
    if (!next) return Value();
    whole = Value(*next);
  }
  return whole;
}

class PicksTest : public test::LuaProgramTest {
 protected:
  struct Place {
    AnyId record;
    std::string path;
    std::size_t segment = 0;
    bool operator<(const Place& other) const {
      return std::tie(record, path) < std::tie(other.record, other.path);
    }
  };

  [[nodiscard]] Wanted wanted(const Extras& extras) {
    return {app().document.now(), extras, nullptr};
  }
  Value call(const std::string& command, Map args) {
    auto r = app().dispatch(session_, command, args);
    EXPECT_TRUE(r.ok()) << command << Value(args).text() << ": "
                        << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? std::move(*r) : Value();
  }
  /// Another value for a path that a pick gave; the present one where it is a list or a word.
  Value other_value(const Place& at) {
    const auto ends = [&](std::string_view with) {
      return at.path == with || at.path.ends_with("." + std::string(with));
    };
    ++edits_;
    const double step = 0.001 * edits_;
    if (ends("position")) return List{0.1 + step, 0.2 - step, 0.3 + step};
    if (ends("colour")) return List{0.5, 0.25 + step, 0.125};
    if (ends("a")) return 0.2 + step;
    if (ends("description")) return "picked " + std::to_string(edits_);
    const Value now = value_inside(
        call("record.describe", {{"id", ioci::Application::handle(at.record)}}), at.path);
    if (ends("stored")) return "stroke";
    if (!(ends("parts") || ends("segments")) || !now.as_list()) return now;
    // Described with the kind of a part's record, and with the parameters of a segment apart.
    List elements;
    for (const Value& element : *now.as_list()) {
      Map fields;
      for (const auto& [name, value] : *element.as_map())
        if (name != "kind" && name != "params") fields.set(name, value);
      elements.emplace_back(std::move(fields));
    }
    return elements;
  }
  /// Sets the place by each command that takes it; whether the value differs from the present one.
  bool set(const Place& at) {
    const Handle id = ioci::Application::handle(at.record);
    const Value value = other_value(at);
    EXPECT_FALSE(value.is_nil()) << at.path << " has no value";
    const auto before = app().document.content_digest();
    call(at.record.kind == Kind::solid ? "solid.set" : "record.set",
         {{"id", id}, {"path", at.path}, {"value", value}});
    const bool is_other = app().document.content_digest() != before;
    if (at.segment > 0) {
      const std::string all = "segments." + std::to_string(at.segment);
      const Value segment = value_inside(call("record.describe", {{"id", id}}), all);
      for (const char* list : {"points", "joints"})
        if (const Value v = value_inside(segment, list); v.as_list() && !v.as_list()->empty())
          call("trajectory.set_segment",
               {{"id", id}, {"index", at.segment}, {"segment", Map{{list, v}}}});
    }
    return is_other;
  }

  /// Picks everything in a scene, and sets what the picks lead to; at most three places that are
  /// alike.
  void pick_all(AnyId what, const Extras& extras, bool all_layers = true) {
    SceneModel model(app().derived, app().registry, what);
    NoProgress progress;
    auto made = model.update(wanted(extras), Detail::exact, progress);
    ASSERT_TRUE(made.ok());
    const FramePtr frame = *made;
    ASSERT_FALSE(all_layers && frame->bodies.empty() && frame->robots.empty());
    std::map<std::string, std::set<Place>> alike;
    for_each_element(*frame, [&](const ElementRef& ref) {
      const std::string kind = std::to_string(static_cast<int>(ref.member->kind)) + "/" +
                               std::to_string(static_cast<int>(ref.kind));
      seen_.insert(kind);
      const Shape& shape = *ref.member->shape(ref.layer);
      std::vector<std::optional<std::size_t>> primitives{std::nullopt};
      if (ref.kind == ElementKind::item && shape.items[ref.index].what.mesh->triangle_count() > 0)
        primitives.emplace_back(0);
      if (ref.kind == ElementKind::line && shape.lines[ref.index].what.points.size() > 1)
        primitives.emplace_back(shape.lines[ref.index].what.points.size() - 2);
      for (const auto& primitive : primitives) {
        const auto picked = pick(*frame, ref, primitive);
        ASSERT_TRUE(picked.ok()) << ref.member->name << ": " << picked.error().sentence();
        for (const RecordPath& p : picked->steps) {
          const std::size_t segment = p.record.kind == Kind::trajectory ? picked->segment : 0;
          auto& places = alike[kind + std::string(to_string(p.record.kind)) +
                               p.path.substr(p.path.rfind('.') + 1)];
          if (places.size() < 3) places.insert({p.record, p.path, segment});
        }
      }
    });
    std::set<Place> all;
    for (const auto& [kind, places] : alike) all.insert(places.begin(), places.end());
    for (const Place& place : all) set_and_follow(model, extras, place);
  }
  void set_and_follow(SceneModel& model, const Extras& extras, const Place& place) {
    const std::string where = app().document.now()->describe(place.record) + " " + place.path;
    SCOPED_TRACE(where);
    const bool is_other = set(place);
    NoProgress progress;
    const auto after = model.update(wanted(extras), Detail::exact, progress);
    ASSERT_TRUE(after.ok());
    const bool is_seen = place.path.ends_with("position") || place.path.ends_with("colour") ||
                         place.path == "a" || place.path.ends_with(".a");
    EXPECT_TRUE(is_other || !is_seen) << "nothing was changed";
    if (is_seen) {
      EXPECT_FALSE((*after)->since.empty()) << where << " was set, and the scene is as before";
    }
    SceneModel anew(app().derived, app().registry, model.frame()->what);
    const auto fresh = anew.update(wanted(extras), Detail::exact, progress);
    ASSERT_TRUE(fresh.ok());
    const render::Scene followed = to_scene(**after), built = to_scene(**fresh);
    ASSERT_EQ(followed.items.size(), built.items.size());
    ASSERT_EQ(followed.triads.size(), built.triads.size());
    ASSERT_EQ(followed.lines.size(), built.lines.size());
    for (std::size_t i = 0; i < built.items.size(); ++i) {
      const render::Item &a = followed.items[i], &b = built.items[i];
      EXPECT_EQ(a.name, b.name);
      EXPECT_EQ(a.pose.p, b.pose.p) << b.name;
      EXPECT_EQ(a.mesh->positions, b.mesh->positions) << b.name;
      EXPECT_EQ(a.appearance.colour.g, b.appearance.colour.g) << b.name;
    }
    for (std::size_t i = 0; i < built.triads.size(); ++i)
      EXPECT_EQ(followed.triads[i].pose.p, built.triads[i].pose.p) << built.triads[i].label;
    for (std::size_t i = 0; i < built.lines.size(); ++i)
      EXPECT_EQ(followed.lines[i].points, built.lines[i].points);
    while (app().document.undo_labels().size() > steps_) ASSERT_TRUE(app().document.undo().ok());
    ASSERT_TRUE(model.update(wanted(extras), Detail::exact, progress).ok());
    ++set_;
  }
  static Extras layers(std::initializer_list<std::string_view> without) {
    Extras e;
    for (const std::string& name : layer_names())
      if (std::find(without.begin(), without.end(), name) == without.end()) {
        EXPECT_TRUE(set_layer(e, name, true).ok());
      }
    return e;
  }
  AnyId named(Kind kind, const char* name) {
    const auto id = app().document.now()->find(kind, name);
    EXPECT_TRUE(id) << name;
    return id.value_or(AnyId{});
  }

  std::set<std::string> seen_;  ///< kinds of members and elements
  std::size_t steps_ = 0;       ///< of the history, before anything was picked
  int set_ = 0, edits_ = 0;
};

TEST_F(PicksTest, EveryKindOfItemLeadsToAPathThatCommandsSetAndTheSceneFollows) {
  run(R"(
    material.create{name = "steel", density = 7850}
    local block = solid.create{name = "block", material = "steel",
      root = {kind = "difference", children = {
        {kind = "box", name = "body", x = 0.1, y = 0.1, z = 0.1},
        {kind = "cylinder", name = "bore", radius = 0.02, height = 0.2, position = {0, 0, -0.05}}}}}
    local pin = solid.create{name = "pin", material = "steel",
      root = {kind = "cylinder", name = "shaft", radius = 0.01, height = 0.2}}
    object.create{name = "pair", parts = {{name = "left", what = "block"},
      {name = "right", what = "pin", position = {0.2, 0, 0}}}}
    object.create{name = "stack", parts = {{name = "lower", what = "pair"},
      {name = "upper", what = "pair", position = {0, 0, 0.2}}}}
    object.create{name = "torch", parts = {{name = "barrel", what = "pin"}},
      tcps = {{name = "tip", position = {0, 0, 0.2}}}}
    local arm = robot.create{name = "arm", links = {
      {name = "turn", a = 0.4, lower = -3, upper = 3},
      {name = "bend", a = 0.3, lower = -3, upper = 3}}}
    arm:attach{tool = "torch", link = "turn", tcp = false}
    trajectory.create{name = "stroke", segments = {
      {shape = "line", points = {{0.5, 0, 0, 0, 0, 0}, {0.4, 0.2, 0, 0, 0, 0}}, speed = 0.1},
      {shape = "line", points = {{0.4, 0.2, 0, 0, 0, 0}, {0.3, 0.3, 0, 0, 0, 0}}, speed = 0.1}}}
    trajectory.create{name = "whole", segments = {{trajectory = "stroke"}}}
    trajectory.create{name = "swing", segments = {
      {shape = "ptp", joints = {{0, 0.1}, {0.5, 0.4}}}}}
    local cell = world.create{name = "cell"}
    cell:add_robot{robot = arm, name = "arm"}
    cell:add_object{what = "block", name = "one", position = {1, 0, 0}}
    cell:add_object{what = "stack", name = "two", position = {2, 0, 0}}
    cell:add_object{what = "pin", name = "in hand", position = {3, 0, 0}}
    cell:attach{object = "in hand", robot = "arm"}
    cell:add_frame{name = "bench", position = {0, 1, 0}}
    cell:add_light{name = "lamp", kind = "spot", position = {0, 0, 3}}
    cell:add_light{name = "sun", kind = "sun", position = {0, 0, 4}}
    cell:add_trajectory{trajectory = "stroke"}
    cell:add_trajectory{trajectory = "whole", position = {0, 0, 0.1}}
    cell:add_trajectory{trajectory = "swing"}
  )");
  steps_ = app().document.undo_labels().size();
  Extras extras = layers({});
  extras.clearances_below = 10;
  extras.ghosts = {{"arm", {0.5, 0.5}}};
  pick_all(named(Kind::world, "cell"), extras);
  for (const auto& [kind, name] :
       {std::pair{Kind::object, "stack"}, {Kind::object, "torch"}, {Kind::solid, "block"}})
    pick_all(named(kind, name), layers({}));
  Extras alone = layers({});
  alone.ghosts = {{"", {0.5, 0.5}}};
  pick_all(named(Kind::robot, "arm"), alone);
  pick_all(named(Kind::material, "steel"), layers({}));
  // Bodies: items, lines, triads, marks, labels; robots; trajectories; frames; lights; materials;
  // ghosts; clearances.
  for (const char* kind : {"0/0", "0/1", "0/2", "0/3", "0/4", "1/0", "1/2", "1/3", "1/4", "2/0",
                           "2/1", "2/2", "3/2", "4/2", "4/6", "5/0", "6/0", "7/1", "7/4"})
    EXPECT_TRUE(seen_.contains(kind)) << kind;
  EXPECT_GT(set_, 40);
}

// A trajectory that is placed twice: the points and the segment of the placement that was picked.
TEST_F(PicksTest, ATrajectoryPlacedTwiceIsMovedWhereItWasPicked) {
  run("stroke = trajectory.create{name = 'stroke', segments = {{shape = 'line', "
      "points = {{0.1, 0, 0}, {0.3, 0, 0}}}}}\n"
      "cell = world.create{name = 'cell'}\n"
      "cell:add_trajectory{trajectory = stroke, name = 'near'}\n"
      "cell:add_trajectory{trajectory = stroke, name = 'far', position = {0, 2, 0}}");
  const AnyId world = named(Kind::world, "cell"), stroke = named(Kind::trajectory, "stroke");
  SceneModel model(app().derived, app().registry, world);
  NoProgress progress;
  const auto frame = model.update(wanted({}), Detail::exact, progress);
  ASSERT_TRUE(frame.ok());
  std::map<std::string, ElementRef> picked;
  for_each_element(**frame, [&](const ElementRef& ref) {
    if (ref.member->kind == MemberKind::trajectory) picked.emplace(ref.member->name, ref);
  });
  ASSERT_EQ(picked.size(), 2U);
  for (const auto& [name, y] : {std::pair{"near", 0.0}, {"far", 2.0}}) {
    const std::optional<ElementRef> seen = picked.at(name);
    const auto points = control_points(**frame, stroke, seen);
    ASSERT_EQ(points.size(), 2U) << name;
    EXPECT_NEAR(points[1].place[0], 0.3, 1e-12) << name;
    EXPECT_NEAR(points[1].place[1], y, 1e-12) << name;
    const auto moved = movable(**frame, stroke, "segments.1.points.2", seen);
    ASSERT_TRUE(moved.ok()) << moved.error().sentence();
    EXPECT_NEAR(moved->world_T_own().p[0], 0.3, 1e-12) << name;
    EXPECT_NEAR(moved->world_T_own().p[1], y, 1e-12) << name;
  }
  EXPECT_NEAR(control_points(**frame, stroke)[0].place[1], 0, 1e-12);
  for (const char* path : {"segments.0", "segments.2", "segments.1.points.3", "segments.x",
                           "segments.99999999999999999999"})
    EXPECT_FALSE(movable(**frame, stroke, path).ok()) << path;
}

TEST_F(PicksTest, RowsOfLinksHaveTheValuesOfTheirJoints) {
  run("two = robot.create{name = 'two', links = {{name = 'turn', a = 0.5, alpha = '90 deg', "
      "theta = "
      "'30 deg'}, {name = 'slide', joint = 'prismatic', d = 0.2}}}\n"
      "cell = world.create{name = 'rows'}\n"
      "cell:add_robot{name = 'r', robot = two, q = {'-12.5 deg', 0.05}}");
  Extras extras;
  extras.dh_rows = true;
  SceneModel model(app().derived, app().registry, named(Kind::world, "rows"));
  const auto texts = [&] {
    std::set<std::string> out;
    NoProgress progress;
    const auto frame = model.update(wanted(extras), Detail::exact, progress);
    EXPECT_TRUE(frame.ok());
    if (frame.ok())
      for (const render::Label& label : to_scene(**frame).labels) out.insert(label.text);
    return out;
  };
  EXPECT_TRUE(texts().contains("turn: a 500 mm, alpha 90 deg, d 0 mm, theta 30 deg - 12.5 deg"));
  EXPECT_TRUE(texts().contains("slide: a 0 mm, alpha 0 deg, d 200 mm + 50 mm, theta 0 deg"));
  run("cell:set_robot_q{robot = 'r', q = {'20 deg', 0}}");
  EXPECT_TRUE(texts().contains("turn: a 500 mm, alpha 90 deg, d 0 mm, theta 30 deg + 20 deg"));
}

class LibraryPicksTest : public PicksTest, public testing::WithParamInterface<const char*> {};

TEST_P(LibraryPicksTest, WorldsOfTheLibraryArePickedAndSet) {
  run("world.get('" + std::string(GetParam()) + "')");
  steps_ = app().document.undo_labels().size();
  pick_all(named(Kind::world, GetParam()),
           layers({"contacts", "clearances", "force_ellipsoids", "path_speeds"}));
  EXPECT_GT(set_, 5);
}

INSTANTIATE_TEST_SUITE_P(Library, LibraryPicksTest,
                         testing::Values("pa10_circle", "pick_and_place", "mechanisms", "dual_arm"),
                         [](const auto& name) { return std::string(name.param); });

}  // namespace
}  // namespace robomosp::scene
