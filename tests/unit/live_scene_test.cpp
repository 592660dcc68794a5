// SPDX-License-Identifier: Apache-2.0
// The scene that follows the document: equal to one that is built anew whatever happened before.
#include "scene/live_scene.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <iostream>
#include <map>
#include <random>
#include <set>
#include <thread>

#include <gtest/gtest.h>

#include "collision/collision.h"
#include "model/data.h"
#include "model/field_path.h"
#include "model/placement.h"
#include "scene/build.h"
#include "scene/flat_scene.h"
#include "scene/origin.h"
#include "spatial/pose.h"
#include "support/allocations.h"
#include "support/workbench.h"

namespace robomosp::scene {
namespace {

using document::Transaction;
using test::unwrap;
using test::Workbench;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kEdits = 500;
#else
constexpr int kEdits = 10'000;
#endif

model::Solid box_of_size(double x, double y, double z) {
  model::Solid s;
  s.nodes.push_back({CsgKind::box, "block", -1, {}, {x, y, z}});
  return s;
}

/// A box less a box of `cut` on a side: nothing is left where that is the larger one.
model::Solid box_less(double cut) {
  model::Solid s;
  s.nodes.resize(3);
  s.nodes[0].kind = CsgKind::difference;
  s.nodes[0].name = "cut";
  for (const std::size_t i : {1U, 2U}) {
    s.nodes[i].kind = CsgKind::box;
    s.nodes[i].name = i == 1 ? "inner" : "outer";
    s.nodes[i].parent = 0;
    const double l = i == 1 ? 0.1 : cut;
    s.nodes[i].sizes = {l, l, l};
  }
  return s;
}

std::string told(const render::Scene& scene, const std::vector<std::string>& left_out) {
  std::string out;
  const auto number = [&](double x) {
    out += std::to_string(std::bit_cast<std::uint64_t>(x)) + ' ';
  };
  const auto pose = [&](const Pose& p) {
    for (const double x : p.R) number(x);
    for (const double x : p.p) number(x);
  };
  const auto colour = [&](const Colour& c) {
    for (const float x : {c.r, c.g, c.b, c.a}) number(static_cast<double>(x));
  };
  const auto line = [&](const char* kind, std::uint64_t id, const std::string& name) {
    out += "\n" + std::string(kind) + " " + std::to_string(id) + " " + name + ": ";
  };
  for (const auto& i : scene.items) {
    line("item", i.id, i.name);
    pose(i.pose);
    colour(i.appearance.colour);
    number(static_cast<double>(i.appearance.shininess));
    number(static_cast<double>(i.appearance.metalness));
    std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a over the words
    for (const float x : i.mesh->positions)
      hash = (hash ^ std::bit_cast<std::uint32_t>(x)) * 1099511628211ULL;
    out += std::to_string(hash) + " ";
    out += std::to_string(i.mesh->triangle_count());
  }
  for (const auto& l : scene.lines) {
    line("line", l.id, "");
    colour(l.colour);
    for (const Vec3& p : l.points)
      for (const double x : p) number(x);
  }
  for (const auto& t : scene.triads) {
    line("triad", t.id, t.label);
    pose(t.pose);
    number(t.length);
  }
  for (const auto& m : scene.marks) {
    line("mark", m.id, m.label);
    pose(m.pose);
    for (const double x : m.gyration) number(x);
  }
  for (const auto& l : scene.labels) {
    line("label", 0, l.text);
    for (const double x : l.place) number(x);
  }
  for (const auto& l : scene.legends) {
    line("legend", l.colours.size(), l.title);
    for (const Colour& c : l.colours) colour(c);
    for (const auto& t : l.ticks) {
      number(t.share);
      out += t.text + " ";
    }
  }
  for (const auto& l : scene.lights) {
    line("light", static_cast<std::uint64_t>(l.kind), "");
    pose(l.pose);
    colour(l.colour);
    number(l.intensity);
    number(l.angle);
  }
  for (const auto& s : left_out) out += "\nleft out: " + s;
  return out;
}

std::string told(const Frame& frame) {
  std::string out = told(to_scene(frame), left_out(frame));
  if (frame.failure) out += "\nfailure: " + frame.failure->sentence();
  return out;
}

/// Says only where the texts begin to differ.
void expect_same(const std::string& a, const std::string& b, const std::string& when) {
  if (a == b) return;
  const auto at = static_cast<std::size_t>(
      std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first - a.begin());
  const std::size_t from = a.rfind('\n', at) == std::string::npos ? 0 : a.rfind('\n', at) + 1;
  ADD_FAILURE() << when << ": " << a.substr(from, 200) << "\ninstead of " << b.substr(from, 200);
}

/// What a reader has who only applies changes.
class Mirror {
 public:
  void apply(const Changes& changes) {
    const auto put = [&](const ElementRef& ref) {
      if (ref.kind == ElementKind::item) items_[id_of(ref)] = item_of(ref);
    };
    for (const ElementRef& ref : changes.removed)
      if (ref.kind == ElementKind::item) items_.erase(id_of(ref));
    for (const auto* list : {&changes.added, &changes.changed, &changes.moved})
      for (const ElementRef& ref : *list) put(ref);
  }
  void expect_items_of(const Frame& frame, const std::string& when) const {
    std::map<std::uint64_t, const render::Item*> wanted;
    const render::Scene scene = to_scene(frame);
    for (const auto& i : scene.items) wanted[i.id] = &i;
    ASSERT_EQ(wanted.size(), scene.items.size()) << when << ": two items share an id";
    ASSERT_EQ(wanted.size(), items_.size()) << when;
    for (const auto& [id, item] : wanted) {
      const auto at = items_.find(id);
      ASSERT_NE(at, items_.end()) << when << ": " << item->name;
      EXPECT_EQ(at->second.mesh, item->mesh) << when << ": " << item->name;
      EXPECT_EQ(at->second.pose.p, item->pose.p) << when << ": " << item->name;
      EXPECT_EQ(at->second.pose.R, item->pose.R) << when << ": " << item->name;
      EXPECT_EQ(at->second.name, item->name) << when;
      EXPECT_EQ(at->second.appearance.colour.r, item->appearance.colour.r) << when;
    }
  }

 private:
  std::map<std::uint64_t, render::Item> items_;
};

/// Stops after so many questions.
class Impatient final : public Progress {
 public:
  explicit Impatient(int questions) : left_(questions) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return --left_ < 0; }

 private:
  mutable std::atomic<int> left_;
};

struct LiveSceneTest : testing::Test {
  Workbench bench;
  NoProgress progress;
  SolidId block, cut;
  MaterialId paint;
  ObjectId stack;
  RobotId arm;
  TrajectoryId way;
  WorldId cell;

  void SetUp() override {
    arm = RobotId{bench.load("robots/twolink.rbt").number};
    way = TrajectoryId{bench.load("trajectories/circle.tjc").number};
    commit([&](Transaction& tx) {
      model::Material look;
      look.density = 7850;
      paint = unwrap(tx.add("paint", look));
      model::Solid s = box_of_size(0.1, 0.1, 0.1);
      s.material = paint;
      block = unwrap(tx.add("block", s));
      cut = unwrap(tx.add("cut", box_less(0.05)));
      model::Object o;
      o.parts.push_back({"lower", block, {}, {}});
      o.parts.push_back({"upper", cut, {.position = {0, 0, 0.1}}, {}});
      stack = unwrap(tx.add("stack", o));
      model::World w;
      w.robots.push_back({"arm", arm, {.position = {0, 0, 0.5}}, {0, 0.3}});
      w.objects = {{"one", block, {.position = {1, 0, 0}}},
                   {"two", stack, {.position = {2, 0, 0}}},
                   {"three", cut, {.position = {3, 0, 0}}}};
      w.frames.push_back({"bench", {.position = {1, 2, 3}}});
      w.lights.push_back({"lamp", model::LightKind::spot, {.position = {0, 0, 4}}, {}, 1, 0.5});
      w.trajectories.push_back({"way", way, {}});
      cell = unwrap(tx.add("cell", w));
    });
  }
  void commit(const std::function<void(Transaction&)>& change) {
    auto tx = bench.document.begin("edit");
    ASSERT_TRUE(tx.ok());
    change(*tx);
    const auto done = tx->commit();
    EXPECT_TRUE(done.ok()) << done.error().sentence();
  }
  template <class R, Kind K>
  void edit(Transaction& tx, Id<K> id, const std::function<void(R&)>& change) {
    const auto done = tx.edit(AnyId(id), [&](model::Record& r) -> Result<void> {
      change(std::get<R>(r.body));
      return {};
    });
    EXPECT_TRUE(done.ok()) << done.error().sentence();
  }
  void edit_world(const std::function<void(model::World&)>& change) {
    commit([&](Transaction& tx) { edit<model::World>(tx, cell, change); });
  }
  Wanted wanted(const Extras& extras = {}, MotionPtr motion = nullptr) {
    return {bench.document.now(), extras, std::move(motion)};
  }
  FramePtr anew(AnyId what, const Wanted& w) {
    SceneModel model(bench.derived, bench.registry, what);
    return unwrap(model.update(w, Detail::exact, progress));
  }
  static Extras all_layers() {
    Extras e;
    for (const std::string& name : layer_names()) EXPECT_TRUE(set_layer(e, name, true).ok());
    e.ghosts = {{"arm", {0.5, 0.5}}};
    return e;
  }
  /// Without those that ask for every pair of bodies.
  static Extras layers_but_proximity() {
    Extras e = all_layers();
    e.contacts = e.clearances = e.path_faults = false;
    return e;
  }
};

/// One of the things that can happen to a world.
class Chance {
 public:
  explicit Chance(unsigned seed) : random_(seed) {}
  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }
  double real() { return std::uniform_real_distribution<double>(-2, 2)(random_); }
  /// Few, so that their meshes are known soon.
  double size() { return 0.05 + 0.01 * static_cast<double>(below(8)); }
  model::Placement placement() {
    return {.position = {real(), real(), real()}, .angles = {real(), real(), real()}};
  }
  std::string name(const char* what) { return what + std::to_string(below(1'000'000)); }

 private:
  std::mt19937_64 random_;
};

void change_world(model::World& w, Chance& chance, const LiveSceneTest& t) {
  const auto at = [&](const auto& list) { return chance.below(list.size()); };
  switch (chance.below(16)) {
    case 0:
    case 1:
    case 2:
    case 3:
      if (!w.objects.empty()) w.objects[at(w.objects)].placement = chance.placement();
      break;
    case 4:
      if (w.objects.size() < 150)
        w.objects.push_back({chance.name("o"), chance.below(2) ? AnyId(t.block) : AnyId(t.stack),
                             chance.placement()});
      break;
    case 5:
      if (!w.objects.empty()) {
        const std::size_t i = at(w.objects);
        const std::string name = std::as_const(w.objects)[i].name;
        w.objects.erase(i);
        std::erase_if(w.attachments, [&](const auto& a) { return a.object == name; });
      }
      break;
    case 6:
      if (!w.objects.empty()) {
        const std::size_t i = at(w.objects);
        const std::string name = std::as_const(w.objects)[i].name, now = chance.name("renamed");
        w.objects[i].name = now;
        for (auto& a : w.attachments)
          if (a.object == name) a.object = now;
      }
      break;
    case 7:
      if (!w.objects.empty()) w.objects[at(w.objects)].what = AnyId(t.cut);
      break;
    case 8: w.robots[0].q = {chance.real(), chance.real()}; break;
    case 9: w.robots[0].placement = chance.placement(); break;
    case 10:
      if (w.robots.size() < 2) w.robots.push_back({"second", t.arm, chance.placement(), {}});
      else w.robots.pop_back();
      break;
    case 11:
      if (w.frames.size() < 4) w.frames.push_back({chance.name("f"), chance.placement()});
      else w.frames.erase(w.frames.begin());
      break;
    case 12:
      if (w.lights.size() < 4)
        w.lights.push_back(
            {chance.name("l"), model::LightKind::point, chance.placement(), {}, 1, 0.5});
      else w.lights.erase(w.lights.begin());
      break;
    case 13:
      if (!w.trajectories.empty()) w.trajectories[0].placement = chance.placement();
      break;
    case 14:
      if (w.trajectories.empty()) w.trajectories.push_back({"way", t.way, chance.placement()});
      else w.trajectories.pop_back();
      break;
    default:
      if (!w.attachments.empty()) w.attachments.clear();
      else if (!w.objects.empty())
        w.attachments.push_back(
            {std::as_const(w.objects)[at(w.objects)].name, "arm", "", chance.placement()});
      break;
  }
}

void change_records(LiveSceneTest& t, Transaction& tx, Chance& chance) {
  switch (chance.below(6)) {
    case 0:
      t.edit<model::Solid>(tx, t.block, [&](model::Solid& s) {
        s.nodes[0].sizes = {chance.size(), chance.size(), 0.1};
      });
      break;
    case 1:  // it fails now and then
      t.edit<model::Solid>(tx, t.cut, [&](model::Solid& s) {
        s = box_less(chance.below(3) == 0 ? 0.2 : chance.size());
      });
      break;
    case 2:
      t.edit<model::Material>(tx, t.paint, [&](model::Material& m) {
        m.colour.r = static_cast<float>(chance.below(100)) / 100;
      });
      break;
    case 3:
      t.edit<model::Object>(tx, t.stack, [&](model::Object& o) {
        if (o.parts.size() < 4)
          o.parts.push_back({chance.name("p"), t.block, chance.placement(), {}});
        else o.parts.resize(1);
      });
      break;
    case 4:
      t.edit<model::Robot>(tx, t.arm, [&](model::Robot& r) {
        r.links[0].visible = !r.links[0].visible;
        r.tool = chance.placement();
      });
      break;
    default: t.edit<model::World>(tx, t.cell, [&](model::World& w) { change_world(w, chance, t); });
  }
}

TEST_F(LiveSceneTest, EqualsASceneBuiltAnewWhateverHappened) {
  const unsigned seed = 20261129;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Chance chance(seed);
  SceneModel model(bench.derived, bench.registry, cell);
  LiveScene live(bench.derived, bench.registry, cell);
  Mirror mirror;
  FlatScene flat[3];  // each shows every third frame
  FramePtr last;
  Extras extras;
  MotionPtr motion;
  std::optional<std::uint64_t> gesture;
  const auto names = layer_names();
  struct {
    int edits = 0, gestures = 0, undone = 0, redone = 0, states = 0, layers = 0, ghosts = 0,
        compared = 0;
  } done_so_far;
  for (int n = 0; n < kEdits; ++n) {
    switch (chance.below(12)) {
      case 0:
        if (gesture) break;
        gesture = unwrap(bench.document.begin_gesture("drag", {1, "tester"}));
        ++done_so_far.gestures;
        break;
      case 1:
        if (gesture) {
          if (chance.below(2)) EXPECT_TRUE(bench.document.commit_gesture(*gesture).ok());
          else EXPECT_TRUE(bench.document.cancel_gesture(*gesture).ok());
          gesture.reset();
        }
        break;
      case 2:
        if (!gesture) done_so_far.undone += bench.document.undo(1).ok();
        break;
      case 3:
        if (!gesture) done_so_far.redone += bench.document.redo(1).ok();
        break;
      case 4: {  // a state of a run
        ++done_so_far.states;
        auto m = std::make_shared<Motion>();
        m->q["arm"] = {chance.real(), chance.real()};
        const auto* w = bench.document.now()->get(cell);
        if (w && !w->objects.empty())
          m->objects[w->objects[chance.below(w->objects.size())].name] =
              model::pose(chance.placement());
        motion = std::move(m);
        break;
      }
      case 5: motion = nullptr; break;
      case 6: {
        if (chance.below(4) == 0) {
          ++done_so_far.ghosts;
          extras.ghosts.clear();
          if (chance.below(2))
            extras.ghosts = {{"arm", {chance.real(), chance.real()}}, {"second", {}}};
          break;
        }
        ++done_so_far.layers;
        // Contacts and clearances ask for every pair of bodies, which takes its time.
        const std::string& name = names[chance.below(names.size())];
        const bool is_slow = name == "contacts" || name == "clearances" || name == "path_faults";
        EXPECT_TRUE(set_layer(extras, name, chance.below(is_slow ? 8 : 2) == 0).ok());
        break;
      }
      default: {
        auto tx = gesture ? bench.document.begin_update(*gesture)
                          : bench.document.begin("edit", {1, "tester"});
        ASSERT_TRUE(tx.ok());
        change_records(*this, *tx, chance);
        const auto done = tx->commit();
        ASSERT_TRUE(done.ok()) << done.error().sentence();
        ++done_so_far.edits;
      }
    }
    live.follow(bench.document.now());
    live.show(extras);
    live.move(motion);
    const Wanted now = wanted(extras, motion);
    if (chance.below(3) == 0) {
      Impatient impatient(static_cast<int>(chance.below(40)));
      const auto tried =
          model.update(now, chance.below(2) ? Detail::coarse : Detail::exact, impatient);
      if (tried.ok() && *tried != last) mirror.apply((last = *tried)->since);
    }
    if (chance.below(10) != 0 && n + 1 < kEdits) continue;
    const FramePtr frame = unwrap(model.update(now, Detail::exact, progress));
    ASSERT_TRUE(frame);
    EXPECT_TRUE(frame->is_exact);
    if (frame != last) mirror.apply(frame->since);
    last = frame;
    ++done_so_far.compared;
    const std::string when = "after " + std::to_string(n + 1) + " edits";
    const std::string wanted_text = told(*anew(cell, now));
    expect_same(told(*frame), wanted_text, when);
    FlatScene& lists = flat[done_so_far.compared % 3];
    lists.show(frame);
    expect_same(told(lists.scene(), lists.left_out()), wanted_text, when + ", as lists");
    mirror.expect_items_of(*frame, when);
    if (n % 10 == 0 || n + 1 == kEdits)
      expect_same(told(*unwrap(live.settle(progress))), wanted_text, when + ", off the thread");
    if (HasFailure()) return;
  }
  // Shares of all steps; a step may find nothing to undo, or a gesture open.
  EXPECT_GT(done_so_far.edits, kEdits / 4);
  EXPECT_GT(done_so_far.states, kEdits / 20);
  EXPECT_GT(done_so_far.layers, kEdits / 25);
  EXPECT_GT(done_so_far.redone, kEdits / 500);
  for (const int n :
       {done_so_far.gestures, done_so_far.undone, done_so_far.ghosts, done_so_far.compared})
    EXPECT_GT(n, kEdits / 100);
}

TEST_F(LiveSceneTest, WhatOnlyMovesKeepsItsShapes) {
  SceneModel model(bench.derived, bench.registry, cell);
  Extras layers = all_layers();
  layers.path_faults = false;  // what touches a dragged object is a fault of the path
  const FramePtr first = unwrap(model.update(wanted(layers), Detail::exact, progress));
  const auto only_moved = [&](const Frame& frame, const std::string& member) {
    EXPECT_TRUE(frame.since.added.empty());
    EXPECT_TRUE(frame.since.removed.empty());
    EXPECT_FALSE(frame.since.moved.empty());
    for (const ElementRef& ref : frame.since.moved) EXPECT_EQ(ref.member->name, member);
    for (const ElementRef& ref : frame.since.changed)
      EXPECT_NE(ref.layer, ShapeLayer::bodies) << ref.member->name;
  };
  edit_world([](model::World& w) { w.objects[1].placement.position = {5, 5, 5}; });
  const FramePtr dragged = unwrap(model.update(wanted(layers), Detail::exact, progress));
  only_moved(*dragged, "two");
  EXPECT_EQ(dragged->bodies[1]->shapes, first->bodies[1]->shapes);
  auto motion = std::make_shared<Motion>();
  motion->q["arm"] = {0.1, 0.2};
  const FramePtr run = unwrap(model.update(wanted(layers, motion), Detail::exact, progress));
  only_moved(*run, "arm");
  // The same is no new frame, and the edit of a record that is not shown changes nothing.
  EXPECT_EQ(unwrap(model.update(wanted(layers, motion), Detail::exact, progress)), run);
  commit([](Transaction& tx) { (void)unwrap(tx.add("other", box_of_size(1, 1, 1))); });
  const FramePtr other = unwrap(model.update(wanted(layers, motion), Detail::exact, progress));
  EXPECT_TRUE(other->since.empty());
  // A reader who missed frames gets the sum.
  const Changes sum = changes_between(first.get(), *other);
  std::set<std::string> moved;
  for (const ElementRef& ref : sum.moved) moved.insert(ref.member->name);
  EXPECT_EQ(moved, (std::set<std::string>{"arm", "two"}));
}

TEST_F(LiveSceneTest, EveryPickLeadsToAPlaceThatCanBeSet) {
  std::set<std::string> seen;  // kinds of members and elements
  Extras layers = all_layers();
  const auto check = [&](AnyId what) {
    const FramePtr frame = anew(what, wanted(layers));
    EXPECT_TRUE(frame->troubles.empty()) << frame->troubles.front();
    for_each_element(*frame, [&](const ElementRef& ref) {
      seen.insert(std::to_string(static_cast<int>(ref.member->kind)) + "/" +
                  std::to_string(static_cast<int>(ref.kind)));
      std::vector<std::optional<std::size_t>> primitives{std::nullopt};
      const Shape& shape = *ref.member->shape(ref.layer);
      std::size_t count = 0;
      if (ref.kind == ElementKind::item) count = shape.items[ref.index].what.mesh->triangle_count();
      if (ref.kind == ElementKind::line) count = shape.lines[ref.index].what.points.size() - 1;
      if (count > 0) {
        primitives.emplace_back(0);
        primitives.emplace_back(count - 1);
        EXPECT_FALSE(pick(*frame, ref, count).ok());
      }
      for (const auto& primitive : primitives) {
        const auto picked = pick(*frame, ref, primitive);
        ASSERT_TRUE(picked.ok()) << ref.member->name << ": " << picked.error().sentence();
        const Origin& o = *picked;
        ASSERT_FALSE(o.steps.empty());
        EXPECT_EQ(o.record, o.steps.back().record);
        EXPECT_EQ(o.path, o.steps.back().path);
        if (what.kind == Kind::world) {
          EXPECT_EQ(o.member, ref.member->kind == MemberKind::ghost       ? std::string("arm")
                              : ref.member->kind == MemberKind::clearance ? ref.member->begins_at
                                                                          : ref.member->name);
          EXPECT_EQ(o.steps.front().record, what);
        }
        for (const RecordPath& p : o.steps) {
          const model::Record* record = frame->snapshot->find(p.record);
          ASSERT_NE(record, nullptr);
          model::Record copy = *record;
          const auto place = model::find_for_change(model::content(copy.body), p.path);
          ASSERT_TRUE(place) << record->name << " has no " << p.path;
          EXPECT_NE(place->field, nullptr) << p.path;
        }
        if (primitive && ref.kind == ElementKind::item && ref.member->kind == MemberKind::body) {
          EXPECT_NE(o.face, 0U) << ref.member->name;
          EXPECT_FALSE(o.node.empty()) << ref.member->name;
        }
        if (ref.member->kind == MemberKind::trajectory && primitive) {
          EXPECT_GT(o.segment, 0U) << ref.member->name;
        }
      }
    });
  };
  check(AnyId(cell));
  check(AnyId(arm));
  layers = layers_but_proximity();  // which a body that fails does not have
  commit([&](Transaction& tx) {
    edit<model::Solid>(tx, cut, [](model::Solid& s) { s = box_less(0.2); });  // it fails
    // Neither has a mass that fails, which a robot would not be built with.
    model::Object shell;
    shell.parts.push_back({"inner", block, {}, {}});
    const ObjectId cover = unwrap(tx.add("cover", shell));
    edit<model::Robot>(tx, arm, [&](model::Robot& r) {
      r.links[0].parts.push_back({cover, {}});
      r.attached.push_back({"torch", block, 1, {.position = {0, 0, 0.1}}});
    });
  });
  for (const AnyId id :
       {AnyId(cell), AnyId(stack), AnyId(block), AnyId(cut), AnyId(arm), AnyId(paint)})
    check(id);
  // Bodies: items, lines, triads, marks, labels; robots: all but lines; ways; frames; lights.
  for (const char* kind : {"0/0", "0/1", "0/2", "0/3", "0/4", "1/0", "1/2", "1/3", "1/4", "2/0",
                           "2/1", "2/2", "3/2", "4/2", "4/6", "5/0", "6/0", "7/1", "7/4"})
    EXPECT_TRUE(seen.contains(kind)) << kind;
}

TEST_F(LiveSceneTest, APickNamesPartsWithinParts) {
  const FramePtr frame = anew(cell, wanted());
  std::set<std::string> nodes;
  for_each_element(*frame, [&](const ElementRef& ref) {
    if (ref.member->name != "two" || ref.kind != ElementKind::item) return;
    const Origin o = unwrap(pick(*frame, ref, 0));
    nodes.insert(o.part + ":" + o.node);
    ASSERT_EQ(o.steps.size(), 3U);
    EXPECT_EQ(o.steps[0].path, "two.position");
    EXPECT_EQ(o.steps[1].record, AnyId(stack));
    EXPECT_EQ(o.steps[1].path, o.part + ".position");
    EXPECT_EQ(o.steps[2].path, o.node + ".position");
  });
  EXPECT_EQ(nodes, (std::set<std::string>{"lower:block", "upper:cut"}));
}

TEST_F(LiveSceneTest, ManyReadersSeeWholeFramesWhileEditsGoOn) {
  LiveScene live(bench.derived, bench.registry, cell);
  std::atomic<bool> is_over{false};
  std::atomic<int> read{0}, woken{0};
  live.on_frame([&] { ++woken; });
  std::vector<std::jthread> readers;
  for (int r = 0; r < 4; ++r)
    readers.emplace_back([&] {
      std::uint64_t last = 0;
      while (!is_over) {
        const FramePtr frame = live.frame();
        EXPECT_GE(frame->number, last);
        last = frame->number;
        const auto* w = frame->snapshot ? frame->snapshot->get(cell) : nullptr;
        if (w) {
          EXPECT_EQ(frame->bodies.size(), w->objects.size());
        }
        read += static_cast<int>(to_scene(*frame).items.size() > 0);
        std::this_thread::yield();
      }
    });
  Chance chance(7);
  for (int n = 0; n < 200; ++n) {
    commit([&](Transaction& tx) { change_records(*this, tx, chance); });
    live.follow(bench.document.now());
  }
  const FramePtr frame = unwrap(live.settle(progress));
  is_over = true;
  readers.clear();
  expect_same(told(*frame), told(*anew(cell, wanted())), "in the end");
  EXPECT_GT(read, 0);
  EXPECT_GT(woken, 0);
}

TEST_F(LiveSceneTest, ARecordThatGoesIsNoLongerShownAndComesBackByUndo) {
  LiveScene live(bench.derived, bench.registry, cell);
  live.follow(bench.document.now());
  const std::string before = told(*unwrap(live.settle(progress)));
  commit([&](Transaction& tx) { EXPECT_TRUE(tx.remove(AnyId(cell)).ok()); });
  live.follow(bench.document.now());
  const FramePtr gone = unwrap(live.settle(progress));
  EXPECT_FALSE(gone->is_there);
  EXPECT_TRUE(to_scene(*gone).items.empty());
  EXPECT_FALSE(gone->since.removed.empty());
  ASSERT_TRUE(gone->failure);
  ASSERT_TRUE(bench.document.undo().ok());
  live.follow(bench.document.now());
  expect_same(told(*unwrap(live.settle(progress))), before, "after undo");
  bench.document.clear();
  live.follow(bench.document.now());
  EXPECT_FALSE(unwrap(live.settle(progress))->is_there);
}

TEST_F(LiveSceneTest, CoarseMeshesComeFirstAndExactOnesFollow) {
  model::Solid ball;
  ball.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {0.05}});
  commit([&](Transaction& tx) {
    const auto id = unwrap(tx.add("ball", ball));
    edit<model::World>(tx, cell, [&](model::World& w) { w.objects.push_back({"ball", id, {}}); });
  });
  SceneModel model(bench.derived, bench.registry, cell);
  const FramePtr coarse = unwrap(model.update(wanted(), Detail::coarse, progress));
  EXPECT_FALSE(coarse->is_exact);
  const FramePtr exact = unwrap(model.update(wanted(), Detail::exact, progress));
  EXPECT_TRUE(exact->is_exact);
  const auto triangles = [](const Frame& f) {
    return f.bodies.back()->shape(ShapeLayer::bodies)->items[0].what.mesh->triangle_count();
  };
  EXPECT_GT(triangles(*exact), 2 * triangles(*coarse));
  expect_same(told(*exact), told(*anew(cell, wanted())), "when exact");
}

// A line from rest to rest: the speeds of its pieces are read off the colours of the legend.
TEST_F(LiveSceneTest, PathsBySpeedCoverThePathInBandsOfTheLegend) {
  commit([&](Transaction& tx) {
    edit<model::Trajectory>(tx, way, [](model::Trajectory& t) {
      model::TrajectorySegment line;
      line.shape.name = "line";
      line.law.name = "quintic";
      line.law.params["duration"] = 2.0;
      line.points = {{}, {.position = {1, 0, 0}}};
      t.segments = {line};
      t.parametric = {};
    });
  });
  Extras extras;
  const Built plain = unwrap(built_of(*anew(cell, wanted(extras)), 0));
  extras.path_speeds = true;
  const Built banded = unwrap(built_of(*anew(cell, wanted(extras)), 0));
  ASSERT_TRUE(banded.left_out.empty()) << banded.left_out.front();
  ASSERT_EQ(plain.scene.lines.size(), 1U);
  std::vector<Vec3> joined;
  for (const render::Line& l : banded.scene.lines) {
    if (!joined.empty()) {
      EXPECT_EQ(joined.back(), l.points.front());
      joined.pop_back();
    }
    joined.insert(joined.end(), l.points.begin(), l.points.end());
  }
  EXPECT_EQ(joined, plain.scene.lines[0].points);
  // Up through five bands and down again.
  EXPECT_EQ(banded.scene.lines.size(), 9U);
  ASSERT_EQ(banded.scene.legends.size(), 1U);
  EXPECT_EQ(banded.scene.legends[0].colours.size(), 5U);
  // The greatest speed of a quintic over 1 m in 2 s is 15/8 of the mean 0.5 m/s; the band at the
  // top ends there, and its middle is nine tenths of the way from (about) 0.
  EXPECT_NEAR(std::stod(banded.scene.legends[0].ticks.back().text), 0.9 * 937.5, 10);
}

TEST_F(LiveSceneTest, PathsByFaultAreColouredAsACheckFindsThemAndFollowTheWorld) {
  // A rail of 1 m, and a line along it that is twice as long.
  commit([&](Transaction& tx) {
    model::Robot rail;
    model::Link l;
    l.name = "slide";
    l.joint = model::JointKind::prismatic;
    l.lower = 0;
    l.upper = 1;
    l.parts.push_back({block, {}});
    rail.links.push_back(l);
    const RobotId id = unwrap(tx.add("rail", rail));
    edit<model::Trajectory>(tx, way, [](model::Trajectory& t) {
      model::TrajectorySegment line;
      line.shape.name = "line";
      line.law.name = "quintic";
      line.law.params["duration"] = 4.0;
      line.points = {{.position = {0, 0, 0.1}}, {.position = {0, 0, 2}}};
      t.segments = {line};
      t.sample_time = 0.05;
      t.parametric = {};
    });
    edit<model::World>(tx, cell, [&](model::World& w) { w.robots = {{"arm", id, {}, {}}}; });
  });
  SceneModel model(bench.derived, bench.registry, cell);
  Extras extras;
  ASSERT_TRUE(set_layer(extras, "path_faults", true).ok());
  const auto lines = [&] {
    const FramePtr frame = unwrap(model.update(wanted(extras), Detail::exact, progress));
    EXPECT_TRUE(frame->is_exact);
    const Built built = unwrap(built_of(*frame, 0));
    EXPECT_EQ(built.scene.legends.size(), 1U);
    return built.scene.lines;
  };
  const auto partly = lines();
  ASSERT_EQ(partly.size(), 2U);
  EXPECT_GT(partly.front().colour.g, partly.front().colour.r) << "good";
  EXPECT_GT(partly.back().colour.r, partly.back().colour.g) << "out of reach";
  EXPECT_NEAR(partly.back().points.front()[2], 1, 0.1) << "where the rail ends";
  EXPECT_EQ(partly.front().points.front(), (Vec3{0, 0, 0.1}));
  // A coarse frame keeps what it has; the exact one finds that the rail reaches nothing now.
  edit_world([](model::World& w) { w.robots[0].placement.position = {9, 9, 9}; });
  const FramePtr coarse = unwrap(model.update(wanted(extras), Detail::coarse, progress));
  EXPECT_FALSE(coarse->is_exact);
  EXPECT_EQ(to_scene(*coarse).lines.size(), partly.size());
  const auto none = lines();
  ASSERT_EQ(none.size(), 1U);
  EXPECT_GT(none.front().colour.r, none.front().colour.g);
}

TEST_F(LiveSceneTest, WhatTouchesIsRedAndALineShowsHowNearTheRestIs) {
  commit([&](Transaction& tx) {  // without the solid that fails
    edit<model::World>(tx, cell, [&](model::World& w) { w.objects.erase(2); });
  });
  SceneModel model(bench.derived, bench.registry, cell);
  Extras extras;
  ASSERT_TRUE(set_layer(extras, "contacts", true).ok());
  ASSERT_TRUE(set_layer(extras, "clearances", true).ok());
  const auto update = [&](MotionPtr motion, Detail detail = Detail::exact) {
    const FramePtr frame = unwrap(model.update(wanted(extras, motion), detail, progress));
    EXPECT_TRUE(frame->troubles.empty()) << frame->troubles.front();
    return frame;
  };
  const auto red = [](const Frame& frame) {
    std::set<std::string> names;
    for_each_element(frame, [&](const ElementRef& ref) {
      if (ref.kind != ElementKind::item) return;
      const Colour c = item_of(ref).appearance.colour;
      if (c.r == 0.85F && c.g == 0.08F && c.b == 0.06F) names.insert(item_of(ref).name);
    });
    return names;
  };
  const auto reference = [&] {
    const document::SnapshotPtr now = bench.document.now();
    const auto collisions = unwrap(
        collision::CollisionModel::of_world({bench.registry, bench.derived, *now}, cell, progress));
    return unwrap(collisions->clearance(collisions->shown(), progress)).front();
  };

  const FramePtr apart = update(nullptr);
  EXPECT_EQ(red(*apart), std::set<std::string>{});
  ASSERT_EQ(apart->clearances.size(), 1U);
  const render::Line& line = apart->clearances[0]->shape(ShapeLayer::posed)->lines.front().what;
  ASSERT_EQ(line.points.size(), 2U);
  const double length =
      std::hypot(line.points[1][0] - line.points[0][0], line.points[1][1] - line.points[0][1],
                 line.points[1][2] - line.points[0][2]);
  EXPECT_NEAR(length, reference().at.distance, 1e-9);
  EXPECT_GT(length, 0);

  // A run brings the object into the arm.
  auto motion = std::make_shared<Motion>();
  motion->objects["one"] = {.R = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .p = apart->robots[0]->bodies[1].p};
  const FramePtr coarse = update(motion, Detail::coarse);
  EXPECT_FALSE(coarse->is_exact) << "contacts are outstanding";
  const FramePtr touching = update(motion);
  EXPECT_TRUE(touching->is_exact);
  EXPECT_TRUE(red(*touching).contains("one"));
  EXPECT_GE(red(*touching).size(), 2U) << "and a link of the arm";
  EXPECT_FALSE(red(*touching).contains("two"));
  EXPECT_EQ(touching->bodies[1], apart->bodies[1]) << "what rests is shared";
  std::set<std::string> changed;
  for (const ElementRef& ref : changes_between(apart.get(), *touching).changed)
    changed.insert(ref.member->name);
  EXPECT_TRUE(changed.contains("one") && changed.contains("arm"));
  expect_same(told(*touching), told(*anew(cell, wanted(extras, motion))), "touching");

  // Lines of all that is near, and each picks the body that it begins at.
  extras.clearances_below = 10;
  const FramePtr near = update(nullptr);
  EXPECT_GT(near->clearances.size(), 2U);
  EXPECT_EQ(red(*near), std::set<std::string>{});
  for (const MemberPtr& m : near->clearances) {
    const Origin o = unwrap(pick(*near, {ElementKind::line, ShapeLayer::posed, 0, m}, 0));
    EXPECT_TRUE(o.member == "arm" || o.member == "one" || o.member == "two") << o.member;
    EXPECT_EQ(m->name.substr(0, o.member.size()), o.member);
  }
  extras = {};
  const FramePtr off = update(nullptr);
  EXPECT_TRUE(off->clearances.empty());
  expect_same(told(*off), told(*anew(cell, wanted())), "without them");
}

TEST_F(LiveSceneTest, RobotsThatLeaveTheWorldAreForgotten) {
  SceneModel model(bench.derived, bench.registry, cell);
  std::weak_ptr<const Shape> shape;
  {
    const FramePtr frame = unwrap(model.update(wanted(), Detail::exact, progress));
    shape = frame->robots[0]->shape(ShapeLayer::bodies);
  }
  edit_world([](model::World& w) {
    w.robots.clear();
    w.attachments.clear();
  });
  (void)unwrap(model.update(wanted(), Detail::exact, progress));
  // That frame lists the robot as removed; the next one does not.
  edit_world([](model::World& w) { w.objects[0].placement.position = {4, 0, 0}; });
  (void)unwrap(model.update(wanted(), Detail::exact, progress));
  EXPECT_TRUE(shape.expired());
}

TEST_F(LiveSceneTest, APlaybackMovesTheElementsOfThePicture) {
  recording::Recording r;
  r.world = cell;
  r.robot = "arm";
  r.dof = 2;
  const auto add = [&](const std::string& name, double first, double last) {
    recording::Column c;
    c.name = name;
    c.values = {first, last};
    r.columns.push_back(std::move(c));
  };
  add("time", 0, 1);
  add("q1", 0, 0.4);
  add("q2", 0.3, -0.2);
  const std::array<double, 7> first{1, 0, 0, 1, 0, 0, 0}, last{1, 2, 3, 1, 0, 0, 0};
  for (std::size_t k = 0; k < 7; ++k)
    add(std::string("two") + recording::kPlaceColumns[k], first[k], last[k]);
  const document::SnapshotPtr now = bench.document.now();
  const Source source{*now, bench.derived, bench.registry};
  const Playback playback = unwrap(build_playback(source, cell, r, progress));
  Built posed = unwrap(build(source, AnyId(cell), {}, progress));
  pose_at(posed.scene, playback, 1);
  const auto motion = std::make_shared<const Motion>(unwrap(motion_at(*now, cell, r, 1)));
  const render::Scene moved = unwrap(build(source, AnyId(cell), {}, progress, motion)).scene;
  ASSERT_EQ(posed.scene.items.size(), moved.items.size());
  std::size_t moving = 0;
  for (std::size_t i = 0; i < moved.items.size(); ++i) {
    EXPECT_EQ(posed.scene.items[i].id, moved.items[i].id);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(posed.scene.items[i].pose.p[k], moved.items[i].pose.p[k], 1e-12)
          << moved.items[i].name;
    moving += static_cast<std::size_t>(
        std::count(playback.ids.begin(), playback.ids.end(), moved.items[i].id));
  }
  EXPECT_GE(moving, 4U) << "links of the arm and both parts of the stack";
}

TEST_F(LiveSceneTest, AnEmptyWorldAndNamesOfAnyLanguage) {
  WorldId empty;
  commit([&](Transaction& tx) {
    empty = unwrap(tx.add("empty", model::World{}));
    edit<model::World>(tx, cell, [&](model::World& w) {
      w.objects.push_back({"Größe 测试 тест", stack, {}});
      w.objects.push_back({"a.b position", block, {}});
    });
  });
  const FramePtr nothing = anew(empty, wanted(all_layers()));
  EXPECT_TRUE(nothing->is_there);
  EXPECT_TRUE(to_scene(*nothing).items.empty());
  const FramePtr frame = anew(cell, wanted(all_layers()));
  int found = 0;
  for_each_element(*frame, [&](const ElementRef& ref) {
    const auto picked = pick(*frame, ref);
    ASSERT_TRUE(picked.ok());
    found += static_cast<int>(picked->member == "Größe 测试 тест");
    for (const RecordPath& p : picked->steps)
      EXPECT_TRUE(model::find(model::content(frame->snapshot->find(p.record)->body), p.path))
          << p.path;
  });
  EXPECT_GT(found, 2);
}

TEST_F(LiveSceneTest, AnUnknownLayerIsRefusedWithTheListOfThoseThereAre) {
  LiveScene live(bench.derived, bench.registry, cell);
  const auto refused = live.show_layer("shadows", true);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("dh_rows"), std::string::npos);
  EXPECT_TRUE(live.show_layer("dh_rows", true).ok());
}

TEST_F(LiveSceneTest, TenThousandObjectsAndARobotOfFourThousandLinks) {
  model::Robot chain;
  for (int i = 0; i < 4000; ++i) {
    model::Link l;
    l.name = "l" + std::to_string(i);
    l.parent = i - 1;
    l.row.a = 0.01;
    l.lower = -3;
    l.upper = 3;
    l.parts.push_back({block, {}});  // else a body of its own is generated for each link
    chain.links.push_back(l);
  }
  commit([&](Transaction& tx) {
    const auto id = unwrap(tx.add("chain", chain));
    edit<model::World>(tx, cell, [&](model::World& w) {
      for (int i = 0; i < 10'000; ++i)
        w.objects.push_back(
            {"n" + std::to_string(i), block, {.position = {0.2 * (i % 100), 0.2 * (i / 100), 0}}});
      w.robots.push_back({"chain", id, {}, {}});
    });
  });
  SceneModel model(bench.derived, bench.registry, cell);
  (void)unwrap(model.update(wanted(layers_but_proximity()), Detail::exact, progress));
  edit_world([](model::World& w) { w.objects[5000].placement.position = {1, 1, 1}; });
  const FramePtr frame =
      unwrap(model.update(wanted(layers_but_proximity()), Detail::exact, progress));
  for (const ElementRef& ref : frame->since.moved) EXPECT_EQ(ref.member->name, "n4997");
  EXPECT_FALSE(frame->since.moved.empty());
  expect_same(told(*frame), told(*anew(cell, wanted(layers_but_proximity()))), "of 10,000");
}

TEST_F(LiveSceneTest, ListsForRenderersKeepWhatIsShownBesideTheFrame) {
  SceneModel model(bench.derived, bench.registry, cell);
  const auto map = std::make_shared<render::Scene>();
  map->items.resize(3);
  for (render::Item& i : map->items) i.name = "voxel";
  map->legends.resize(1);
  FlatScene flat;
  const auto expect = [&](std::size_t voxels) {
    const FramePtr frame = unwrap(model.update(wanted(), Detail::exact, progress));
    flat.show(frame, voxels > 0 ? map : nullptr);
    render::Scene both = to_scene(*frame);
    if (voxels > 0) {
      both.items.insert(both.items.end(), map->items.begin(), map->items.end());
      both.legends.insert(both.legends.end(), map->legends.begin(), map->legends.end());
    }
    ASSERT_EQ(flat.scene().items.size(), both.items.size());
    for (std::size_t i = 0; i < both.items.size(); ++i) {
      EXPECT_EQ(flat.scene().items[i].name, both.items[i].name);
      EXPECT_EQ(flat.scene().items[i].pose.p, both.items[i].pose.p);
    }
    EXPECT_EQ(flat.scene().legends.size(), both.legends.size());
    EXPECT_EQ(flat.frame(), frame);
  };
  expect(0);
  expect(3);
  edit_world([](model::World& w) { w.objects[0].placement.position = {5, 5, 5}; });
  expect(3);  // only the object is written
  edit_world([](model::World& w) { w.objects.pop_back(); });
  expect(3);  // all is written
  expect(0);
  flat.show(render::Scene());
  EXPECT_TRUE(flat.scene().items.empty());
  EXPECT_EQ(flat.frame(), nullptr);
  expect(3);
}

#if ROBOMOSP_COUNTS_MEMORY
TEST_F(LiveSceneTest, ADraggedObjectCostsMemoryByWhatItChangesHoweverManyThereAre) {
  struct Of {
    test::Cost frame, lists;
  };
  const auto drag_in_world_of = [&](std::size_t count) {
    edit_world([&](model::World& w) {
      for (std::size_t i = w.objects.size(); i < count; ++i)
        w.objects.push_back({"another object " + std::to_string(i),
                             block,
                             {.position = {0.2 * static_cast<double>(i), 0, 0}}});
    });
    SceneModel model(bench.derived, bench.registry, cell);
    FlatScene flat[3];
    std::vector<Wanted> wishes;
    for (int i = 0; i < 200; ++i) {
      edit_world([&](model::World& w) {
        w.objects[w.objects.size() / 2].placement.position[2] = 0.001 * i;
      });
      wishes.push_back(wanted());
    }
    for (FlatScene& f : flat) f.show(unwrap(model.update(wishes[0], Detail::exact, progress)));
    Of out;
    std::vector<FramePtr> frames;
    frames.reserve(wishes.size());
    out.frame = test::cost([&](int i) {
      frames.push_back(
          *model.update(wishes[static_cast<std::size_t>(i) + 1], Detail::exact, progress));
    });
    out.lists = test::cost([&](int i) { flat[i % 3].show(frames[static_cast<std::size_t>(i)]); });
    const render::Scene whole = to_scene(*frames.back());
    EXPECT_EQ(whole.items.size(), flat[0].scene().items.size());
    return out;
  };
  const Of few = drag_in_world_of(100), many = drag_in_world_of(10'000);
  std::cout << "a drag of one in 100: " << few.frame.bytes << " + " << few.lists.bytes
            << " bytes; in 10,000: " << many.frame.bytes << " + " << many.lists.bytes << "\n";
  // A pointer for each 64 objects, in frame and snapshot.
  EXPECT_LT(many.frame.bytes, few.frame.bytes + 24'000);
  EXPECT_LT(many.frame.allocations, few.frame.allocations + 20);
  // The name of the item that moved, of each of the three frames between.
  EXPECT_LT(many.lists.bytes, few.lists.bytes + 500);
  EXPECT_LT(many.lists.bytes, 2'000);
  EXPECT_LT(many.lists.allocations, 20);
}
#endif

}  // namespace
}  // namespace robomosp::scene
