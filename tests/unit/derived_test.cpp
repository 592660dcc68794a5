// SPDX-License-Identifier: Apache-2.0
// Derived values: that they follow their inputs and nothing else, and that providers are checked.
#include "evaluation/derived.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/csg_primitive.h>

#include "evaluation/csg_tree.h"
#include "io/geometry.h"
#include "kernel/plugin_loader.h"
#include "spatial/pose.h"
#include "support/records.h"

namespace robomosp {
namespace {

using document::Document;
using evaluation::Derived;

/// An axis-aligned box, for which every integral has a closed form.
struct Box {
  Vec3 low, high;
};

Moments box_moments(const Box& b) {
  const Vec3 &l = b.low, &h = b.high;
  const auto first = [&](std::size_t i) { return (h[i] * h[i] - l[i] * l[i]) / 2; };
  const auto second = [&](std::size_t i) { return (h[i] * h[i] * h[i] - l[i] * l[i] * l[i]) / 3; };
  const double x = h[0] - l[0], y = h[1] - l[1], z = h[2] - l[2];
  Moments m;
  m.volume = x * y * z;
  m.area = 2 * (x * y + y * z + z * x);
  m.first = {first(0) * y * z, x * first(1) * z, x * y * first(2)};
  m.second = {second(0) * y * z,       x * second(1) * z,       x * y * second(2),
              first(0) * first(1) * z, x * first(1) * first(2), first(0) * y * first(2)};
  return m;
}

void add(Moments& a, const Moments& b) {
  a.volume += b.volume;
  a.area += b.area;
  for (std::size_t i = 0; i < 3; ++i) a.first[i] += b.first[i];
  a.second = {a.second.xx + b.second.xx, a.second.yy + b.second.yy, a.second.zz + b.second.zz,
              a.second.xy + b.second.xy, a.second.yz + b.second.yz, a.second.xz + b.second.xz};
}

class BoxShape final : public CsgShape {
 public:
  explicit BoxShape(Box b) : box(b) {}
  [[nodiscard]] std::array<Vec3, 2> bounds() const override { return {box.low, box.high}; }
  [[nodiscard]] std::span<const std::string> notes() const override { return {}; }
  Box box;
};

struct Counts {
  std::atomic<int> evaluations{0}, meshes{0}, moments{0}, partitions{0};
};

/// Faults that a provider might have.
enum class Fault {
  none,
  nan_moments,
  nan_mesh,
  open_mesh,
  short_partition,
  throws,
  null_shape,
  unverified
};

/// Single boxes (also turned ones as a solid of their own), placed by translations in a partition.
class BoxEngine final : public CsgEngine {
 public:
  BoxEngine(Counts& counts, const Fault& fault, bool takes_meshes = false)
      : counts_(counts), fault_(fault), takes_meshes_(takes_meshes) {}

  Result<std::shared_ptr<const CsgShape>> evaluate(const CsgTree& tree,
                                                   Progress& progress) const override {
    ++counts_.evaluations;
    if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
    if (fault_ == Fault::throws) throw std::runtime_error("out of luck");
    if (fault_ == Fault::null_shape) return std::shared_ptr<const CsgShape>();
    const CsgNode& n = tree.nodes.at(0);
    if (fault_ == Fault::unverified)
      return error(ErrorCode::plugin_failed, "the result did not close", "Move an operand.",
                   "node \"" + n.name + "\"");
    if (n.kind == CsgKind::imported && takes_meshes_) {
      const auto& p = n.geometry->points;  // the box of its corners
      Box b{{p[0], p[1], p[2]}, {p[0], p[1], p[2]}};
      for (std::size_t i = 0; i < p.size(); ++i) {
        b.low[i % 3] = std::min(b.low[i % 3], p[i]);
        b.high[i % 3] = std::max(b.high[i % 3], p[i]);
      }
      std::shared_ptr<const CsgShape> made = std::make_shared<const BoxShape>(b);
      return made;
    }
    if (n.kind != CsgKind::box)
      return error(ErrorCode::unsupported, "node \"" + n.name + "\" is no box", "Use a box.");
    const Vec3& p = n.placement.p;
    const double x = n.sizes[0] / 2, y = n.sizes[1] / 2;
    std::shared_ptr<const CsgShape> shape = std::make_shared<const BoxShape>(
        Box{{p[0] - x, p[1] - y, p[2]}, {p[0] + x, p[1] + y, p[2] + n.sizes[2]}});
    return shape;
  }
  Result<Mesh> mesh(const CsgShape& shape, const MeshQuality&, Progress&) const override {
    ++counts_.meshes;
    const Box& b = dynamic_cast<const BoxShape&>(shape).box;
    Mesh m;
    for (std::uint32_t side = 0; side < 6; ++side) {
      const std::size_t axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
      const bool is_high = side % 2 == 1;
      const auto start = static_cast<std::uint32_t>(m.vertex_count());
      for (const auto& [cu, cv] :
           {std::pair{0, 0}, std::pair{1, 0}, std::pair{1, 1}, std::pair{0, 1}}) {
        Vec3 p{}, n{};
        p[axis] = is_high ? b.high[axis] : b.low[axis];
        p[u] = cu ? b.high[u] : b.low[u];
        p[v] = cv ? b.high[v] : b.low[v];
        n[axis] = is_high ? 1 : -1;
        for (std::size_t i = 0; i < 3; ++i) {
          m.positions.push_back(static_cast<float>(p[i]));
          m.normals.push_back(static_cast<float>(n[i]));
        }
      }
      if (fault_ == Fault::open_mesh && side == 5) break;
      for (const std::uint32_t k :
           is_high ? std::array{0U, 1U, 2U, 0U, 2U, 3U} : std::array{0U, 2U, 1U, 0U, 3U, 2U})
        m.triangles.push_back(start + k);
    }
    if (fault_ == Fault::nan_mesh) m.positions[4] = std::numeric_limits<float>::quiet_NaN();
    return m;
  }
  Result<Moments> moments(const CsgShape& shape, Progress&) const override {
    ++counts_.moments;
    Moments m = box_moments(dynamic_cast<const BoxShape&>(shape).box);
    if (fault_ == Fault::nan_moments) m.first[1] = std::nan("");
    return m;
  }
  /// Cuts space at all box sides; each cell belongs to the first part that holds it.
  Result<Partition> partition(std::span<const PlacedShape> parts, Progress&) const override {
    ++counts_.partitions;
    std::array<std::set<double>, 3> cuts;
    std::vector<Box> boxes;
    for (const auto& p : parts) {
      Box b = dynamic_cast<const BoxShape&>(*p.shape).box;
      for (std::size_t i = 0; i < 3; ++i) {
        b.low[i] += p.placement.p[i];
        b.high[i] += p.placement.p[i];
        cuts[i].insert({b.low[i], b.high[i]});
      }
      boxes.push_back(b);
    }
    Partition out;
    out.parts.resize(parts.size());
    for (auto x = cuts[0].begin(); std::next(x) != cuts[0].end(); ++x)
      for (auto y = cuts[1].begin(); std::next(y) != cuts[1].end(); ++y)
        for (auto z = cuts[2].begin(); std::next(z) != cuts[2].end(); ++z) {
          const Box cell{{*x, *y, *z}, {*std::next(x), *std::next(y), *std::next(z)}};
          bool is_taken = false, is_shared = false;
          for (std::size_t i = 0; i < boxes.size(); ++i) {
            bool is_inside = true;
            for (std::size_t k = 0; k < 3; ++k)
              is_inside =
                  is_inside && boxes[i].low[k] <= cell.low[k] && cell.high[k] <= boxes[i].high[k];
            if (!is_inside) continue;
            if (is_taken) is_shared = true;
            if (!is_taken) add(out.parts[i], box_moments(cell));
            is_taken = true;
          }
          if (is_shared) out.overlap += box_moments(cell).volume;
        }
    if (fault_ == Fault::short_partition) out.parts.pop_back();
    return out;
  }

 private:
  Counts& counts_;
  const Fault& fault_;
  bool takes_meshes_;
};

/// A block of three sizes on a foot that is as wide and 1 m high.
class Block final : public CsgPrimitive {
 public:
  Block(int& built, const std::int32_t& parent) : built_(built), parent_(parent) {}
  Result<CsgTree> build(const Params& params, Progress&) const override {
    ++built_;
    if (params.real("width") > 5)
      return error(ErrorCode::invalid_argument, "width exceeds 5 m", "Make it less.");
    CsgTree tree;
    tree.nodes.push_back({CsgKind::box, parent_, {}, {params.real("width"), 1, 1}, "foot"});
    return tree;
  }

 private:
  int& built_;
  const std::int32_t& parent_;
};

class DerivedTest : public testing::Test {
 protected:
  DerivedTest() {
    ProviderInfo info;
    info.interface_id = CsgEngine::kInterfaceId;
    info.name = "boxes";
    info.shipped = true;  // so that it stays the default beside another one
    info.version = "1";
    const auto added = registry.add(info, [this]() -> Result<void*> {
      // The registry's caller owns what is made, as with plugins.
      return static_cast<void*>(
          static_cast<CsgEngine*>(std::make_unique<BoxEngine>(counts, fault).release()));
    });
    EXPECT_TRUE(added.ok());
  }

  /// A second engine, for triangles.
  void add_mesh_engine() {
    ProviderInfo info;
    info.interface_id = CsgEngine::kInterfaceId;
    info.name = "triangles";
    info.version = "1";
    info.tags = {"mesh", "approximate"};
    ASSERT_TRUE(registry
                    .add(info,
                         [this]() -> Result<void*> {
                           return static_cast<void*>(static_cast<CsgEngine*>(
                               std::make_unique<BoxEngine>(mesh_counts, no_fault, true).release()));
                         })
                    .ok());
  }
  static model::Solid imported(MaterialId material, const Vec3& size) {
    auto geometry = std::make_shared<CsgGeometry>();
    geometry->form = CsgGeometry::Form::mesh;
    // The box's first and last corner, by which BoxEngine knows it, then the others.
    const double x = size[0] / 2, y = size[1] / 2, z = size[2];
    geometry->points = {-x, -y, 0, x,  y,  z, x, -y, 0, -x, y, 0,
                        x,  y,  0, -x, -y, z, x, -y, z, -x, y, z};
    geometry->triangles = {0, 3, 4, 0, 4, 2, 5, 6, 1, 5, 1, 7, 0, 2, 6, 0, 6, 5,
                           3, 7, 1, 3, 1, 4, 0, 5, 7, 0, 7, 3, 2, 4, 1, 2, 1, 6};
    geometry->digest = {1, static_cast<std::uint64_t>(size[0] * 1e6)};
    model::Solid s;
    s.material = material;
    model::SolidNode n;
    n.kind = CsgKind::imported;
    n.name = "scan";
    n.sizes = {1};
    n.geometry = geometry;
    s.nodes.push_back(n);
    return s;
  }
  void add_block_primitive() {
    ProviderInfo info;
    info.interface_id = CsgPrimitive::kInterfaceId;
    info.name = "block";
    info.version = "1";
    ParamSpec width;
    width.name = "width";
    width.type = "real";
    width.unit = "m";
    width.required = true;
    width.min = 0.1;
    info.schema.push_back(width);
    ASSERT_TRUE(registry
                    .add(info,
                         [this]() -> Result<void*> {
                           return static_cast<void*>(static_cast<CsgPrimitive*>(
                               std::make_unique<Block>(built, block_parent).release()));
                         })
                    .ok());
  }
  static model::Solid block(MaterialId material, double width) {
    model::Solid s;
    s.material = material;
    model::SolidNode n;
    n.kind = CsgKind::custom;
    n.name = "gear";
    n.placement.position = {0, 0, 2};
    n.primitive.name = "block";
    n.primitive.params["width"] = width;
    s.nodes.push_back(n);
    return s;
  }

  static model::Solid box(MaterialId material, double x, double y, double z) {
    model::Solid s;
    s.material = material;
    s.nodes.push_back({CsgKind::box, "block", -1, {}, {x, y, z}});
    return s;
  }
  template <class R>
  Id<model::kind_of<R>> make(const std::string& name, R content) {
    auto tx = document.begin("add " + name);
    auto id = tx->add(name, std::move(content));
    EXPECT_TRUE(id.ok()) << (id.ok() ? "" : id.error().sentence());
    const auto commit = tx->commit();
    EXPECT_TRUE(commit.ok()) << (commit.ok() ? "" : commit.error().sentence());
    return *id;
  }
  MaterialId material(const std::string& name, double density) {
    model::Material m;
    m.density = density;
    return make(name, m);
  }
  template <class R>
  void edit(AnyId id, const std::function<void(R&)>& change) {
    auto tx = document.begin("edit");
    ASSERT_TRUE(tx->edit(id, [&](model::Record& r) -> Result<void> {
                    change(std::get<R>(r.body));
                    return {};
                  }).ok());
    ASSERT_TRUE(tx->commit().ok());
  }
  evaluation::BodyMass mass(AnyId id) {
    auto m = derived.mass(*document.now(), id, progress);
    EXPECT_TRUE(m.ok()) << (m.ok() ? "" : m.error().sentence());
    return m.ok() ? *m : evaluation::BodyMass{};
  }
  /// A robot with one link that carries an object of one 0.1 m cube of water.
  struct Chain {
    MaterialId water;
    SolidId cube;
    ObjectId arm;
    RobotId robot;
  };
  Chain chain() {
    Chain c;
    c.water = material("water", 1000);
    c.cube = make("cube", box(c.water, 0.1, 0.1, 0.1));
    model::Object o;
    o.parts.push_back({"cube", c.cube, {{0, 0, 0.2}, {}, {}}, {}});
    c.arm = make("arm", o);
    model::Robot r;
    r.mass_source = model::MassSource::designed;
    r.links.resize(1);
    r.links[0].name = "elbow";
    r.links[0].parts.push_back({c.arm, {}});
    c.robot = make("pa10", r);
    return c;
  }
  double link_mass(RobotId id) {
    const auto m = derived.robot_model(*document.now(), id, {0, 0, -9.81}, progress);
    EXPECT_TRUE(m.ok()) << (m.ok() ? "" : m.error().sentence());
    return m.ok() ? (*m)->joints.at(0).body.mass : -1;
  }

  Counts counts, mesh_counts;
  Fault fault = Fault::none;
  const Fault no_fault = Fault::none;
  int built = 0;
  std::int32_t block_parent = -1;
  Registry registry;
  Document document;
  Derived derived{registry};
  NoProgress progress;
};

TEST_F(DerivedTest, MassFollowsTheSizeOfAPrimitiveUpToTheRobotAndUndoFindsTheOldOne) {
  const Chain c = chain();
  EXPECT_NEAR(link_mass(c.robot), 1, 1e-12);
  edit<model::Solid>(c.cube, [](model::Solid& s) { s.nodes[0].sizes[2] = 0.3; });
  EXPECT_NEAR(link_mass(c.robot), 3, 1e-12);
  const auto before = derived.stats();
  ASSERT_TRUE(document.undo().ok());
  EXPECT_NEAR(link_mass(c.robot), 1, 1e-12);
  EXPECT_EQ(derived.stats().misses, before.misses);
  EXPECT_GT(derived.stats().hits, before.hits);
}

TEST_F(DerivedTest, AColourOrDensityEditComputesNoShapeMeshOrMoments) {
  const Chain c = chain();
  ASSERT_TRUE(derived.drawables(*document.now(), c.arm, progress).ok());
  EXPECT_NEAR(mass(c.arm).mass.mass, 1, 1e-12);
  const int evaluations = counts.evaluations, meshes = counts.meshes, moments = counts.moments;
  edit<model::Material>(c.water, [](model::Material& m) {
    m.colour = {1, 0, 0, 1};
    m.density = 2000;
  });
  const auto drawn = derived.drawables(*document.now(), c.arm, progress);
  ASSERT_TRUE(drawn.ok());
  EXPECT_EQ(drawn->at(0).colour.r, 1.0F);
  EXPECT_EQ(drawn->at(0).placement.p[2], 0.2);
  EXPECT_NEAR(mass(c.arm).mass.mass, 2, 1e-12);
  EXPECT_EQ(counts.evaluations, evaluations);
  EXPECT_EQ(counts.meshes, meshes);
  EXPECT_EQ(counts.moments, moments);
}

TEST_F(DerivedTest, TwoEqualSolidsShareOneMeshAndFinerTessellationDoesNot) {
  const auto a = make("a", box({}, 1, 2, 3));
  model::Solid same = box({}, 1, 2, 3);
  same.nodes[0].name = "other";
  const auto b = make("b", same);
  same.chord = 1e-5;
  const auto fine = make("fine", same);
  const auto ma = derived.mesh(*document.now(), a, progress),
             mb = derived.mesh(*document.now(), b, progress);
  ASSERT_TRUE(ma.ok() && mb.ok());
  EXPECT_EQ(ma->get(), mb->get());
  EXPECT_EQ(counts.meshes, 1);
  const auto mf = derived.mesh(*document.now(), fine, progress);
  ASSERT_TRUE(mf.ok());
  EXPECT_NE(mf->get(), ma->get());
  EXPECT_EQ(counts.evaluations, 1);
}

TEST_F(DerivedTest, MassOfASolidIsThatOfTheClosedForm) {
  const auto m = material("m", 500);
  const auto id = make("s", box(m, 0.2, 0.3, 0.4));
  const auto got = mass(id);
  const double kg = 500 * 0.2 * 0.3 * 0.4;
  EXPECT_NEAR(got.mass.mass, kg, 1e-12);
  EXPECT_NEAR(got.mass.com[2], 0.2, 1e-12);
  EXPECT_NEAR(got.mass.inertia.xx, kg * (0.3 * 0.3 + 0.4 * 0.4) / 12, 1e-12);
  EXPECT_NEAR(got.mass.inertia.yy, kg * (0.2 * 0.2 + 0.4 * 0.4) / 12, 1e-12);
  EXPECT_NEAR(got.mass.inertia.zz, kg * (0.2 * 0.2 + 0.3 * 0.3) / 12, 1e-12);
  EXPECT_NEAR(got.area, 2 * (0.06 + 0.12 + 0.08), 1e-12);
}

TEST_F(DerivedTest, OverlappingPartsCountOnceForTheFirstOrInFull) {
  const auto light = material("light", 1000), heavy = material("heavy", 3000);
  const auto cube = make("cube", box(light, 1, 1, 1));
  model::Object o;
  o.parts.push_back({"first", cube, {}, {}});
  o.parts.push_back({"second", cube, {{0.5, 0, 0}, {}, {}}, heavy});
  const auto id = make("pair", o);
  const auto once = mass(id);
  EXPECT_NEAR(once.mass.mass, 1000 + 3000 * 0.5, 1e-9);
  EXPECT_NEAR(once.volume, 1.5, 1e-12);
  EXPECT_NEAR(once.overlap, 0.5, 1e-12);
  EXPECT_NEAR(once.mass.com[0], (1000 * 0 + 1500 * 0.75) / 2500, 1e-12);
  edit<model::Object>(id, [](model::Object& x) { x.overlap = model::Overlap::sum; });
  const auto sum = mass(id);
  EXPECT_NEAR(sum.mass.mass, 4000, 1e-9);
  EXPECT_NEAR(sum.volume, 2, 1e-12);
  EXPECT_EQ(sum.overlap, 0);
}

TEST_F(DerivedTest, NestedObjectsAreResolvedAndTheOutermostMaterialWins) {
  const auto light = material("light", 1000), heavy = material("heavy", 8000);
  const auto cube = make("cube", box(light, 1, 1, 1));
  model::Object inner;
  inner.parts.push_back({"plain", cube, {}, {}});
  inner.parts.push_back({"iron", cube, {{2, 0, 0}, {}, {}}, heavy});
  const auto inner_id = make("inner", inner);
  model::Object outer;
  outer.parts.push_back({"as_is", inner_id, {}, {}});
  outer.parts.push_back({"all_light", inner_id, {{0, 5, 0}, {0, 0, std::numbers::pi}, {}}, light});
  const auto outer_id = make("outer", outer);
  const auto drawn = derived.drawables(*document.now(), outer_id, progress);
  ASSERT_TRUE(drawn.ok());
  ASSERT_EQ(drawn->size(), 4U);
  EXPECT_EQ(drawn->at(3).name, "all_light.iron");
  EXPECT_NEAR(drawn->at(3).placement.p[0], -2, 1e-12);
  EXPECT_NEAR(drawn->at(3).placement.p[1], 5, 1e-12);
  EXPECT_NEAR(mass(outer_id).mass.mass, 1000 + 8000 + 2000, 1e-9);
}

TEST_F(DerivedTest, APartWithoutMaterialHasNoMassTakesNoneAndIsNoted) {
  const auto m = material("m", 1000);
  const auto bare = make("bare", box({}, 1, 1, 1));
  const auto cube = make("cube", box(m, 1, 1, 1));
  model::Object o;
  o.parts.push_back({"cover", bare, {}, {}});
  o.parts.push_back({"cube", cube, {}, {}});
  const auto got = mass(make("o", o));
  EXPECT_NEAR(got.mass.mass, 1000, 1e-9);
  EXPECT_NEAR(got.volume, 1, 1e-12);
  EXPECT_EQ(got.notes,
            std::vector<std::string>{"solid \"bare\" has no material, so it has no mass."});
}

TEST_F(DerivedTest, BoundsHoldTurnedParts) {
  const auto cube = make("cube", box({}, 2, 1, 1));
  model::Object o;
  o.parts.push_back({"turned", cube, {{10, 0, 0}, {0, 0, std::numbers::pi / 2}, {}}, {}});
  const auto b = derived.bounds(*document.now(), make("o", o), progress);
  ASSERT_TRUE(b.ok());
  EXPECT_NEAR((*b)[0][0], 9.5, 1e-12);
  EXPECT_NEAR((*b)[1][0], 10.5, 1e-12);
  EXPECT_NEAR((*b)[0][1], -1, 1e-12);
  EXPECT_NEAR((*b)[1][2], 1, 1e-12);
}

TEST_F(DerivedTest, AFailingSolidIsNamedAndBlocksOnlyWhatNeedsIt) {
  model::Solid ball;
  ball.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {1}});
  const auto bore = make("bore", ball);
  const auto cube = make("cube", box({}, 1, 1, 1));
  model::Object o;
  o.parts.push_back({"a", cube, {}, {}});
  o.parts.push_back({"b", bore, {}, {}});
  const auto arm = make("arm", o);
  model::Robot r;
  r.mass_source = model::MassSource::designed;
  r.links.resize(1);
  r.links[0].name = "l";
  r.links[0].parts.push_back({arm, {}});
  const auto robot = make("pa10", r);
  const auto now = document.now();
  EXPECT_TRUE(derived.mesh(*now, cube, progress).ok());
  EXPECT_EQ(derived.mesh(*now, bore, progress).error().sentence(),
            "solid \"bore\": node \"ball\" is no box. Use a box.");
  const std::string reason = "waits for solid \"bore\": node \"ball\" is no box. Use a box.";
  EXPECT_EQ(derived.mass(*now, arm, progress).error().sentence(), "object \"arm\" " + reason);
  EXPECT_EQ(derived.drawables(*now, bore, progress).error().sentence(),
            "solid \"bore\": node \"ball\" is no box. Use a box.");
  const auto drawn = derived.drawables(*now, arm, progress);
  ASSERT_TRUE(drawn.ok()) << "the other part is drawn";
  ASSERT_EQ(drawn->size(), 1U);
  EXPECT_EQ(drawn->at(0).name, "a");
  EXPECT_FALSE(drawn->at(0).is_operand);
  EXPECT_EQ(derived.robot_model(*now, robot, {}, progress).error().sentence(),
            "robot \"pa10\" " + reason);
  const auto bodies = derived.robot_bodies(*now, robot, progress);
  ASSERT_TRUE(bodies.ok()) << bodies.error().sentence();
  EXPECT_EQ(bodies->bodies[1].size(), 1U);
  // The failure is remembered: asked again, the engine is not.
  const int evaluations = counts.evaluations;
  EXPECT_FALSE(derived.mesh(*now, bore, progress).ok());
  EXPECT_EQ(counts.evaluations, evaluations);
  // An equal solid with another node name is reported by its own name.
  ball.nodes[0].name = "knob";
  const auto second = make("bore_2", ball);
  EXPECT_EQ(derived.mesh(*document.now(), second, progress).error().sentence(),
            "solid \"bore_2\": node \"knob\" is no box. Use a box.");
}

TEST_F(DerivedTest, ProvidersThatBreakTheirContractAreNamed) {
  const auto m = material("m", 1);
  const auto cube = make("cube", box(m, 1, 1, 1));
  model::Object o;
  o.parts.push_back({"a", cube, {}, {}});
  o.parts.push_back({"b", cube, {}, {}});
  const auto pair = make("pair", o);
  const auto now = document.now();
  const auto sentence_with = [&](Fault f, const std::function<Error()>& ask) {
    derived.clear();
    fault = f;
    const Error e = ask();
    EXPECT_EQ(e.code, ErrorCode::plugin_failed);
    return e.sentence();
  };
  const std::string hint = " Report it to the provider's author or choose another provider.";
  const auto mass_error = [&] { return derived.mass(*now, cube, progress).error(); };
  const auto mesh_error = [&] { return derived.mesh(*now, cube, progress).error(); };
  EXPECT_EQ(
      sentence_with(Fault::nan_moments, mass_error),
      "solid \"cube\": provider \"boxes\" returned moments that are not finite numbers." + hint);
  EXPECT_EQ(
      sentence_with(Fault::nan_mesh, mesh_error),
      "solid \"cube\": provider \"boxes\" made a mesh with numbers that are not finite." + hint);
  EXPECT_NE(
      sentence_with(Fault::open_mesh, mesh_error).find("provider \"boxes\" made an open mesh"),
      std::string::npos);
  EXPECT_EQ(sentence_with(Fault::throws, mesh_error),
            "solid \"cube\": provider \"boxes\" threw: out of luck." + hint);
  EXPECT_EQ(sentence_with(Fault::null_shape, mesh_error),
            "solid \"cube\": provider \"boxes\" returned no solid." + hint);
  EXPECT_EQ(sentence_with(Fault::short_partition,
                          [&] { return derived.mass(*now, pair, progress).error(); }),
            "object \"pair\": provider \"boxes\" returned 1 parts for 2." + hint);
}

TEST_F(DerivedTest, ImportedMeshesGoToTheEngineForTrianglesAndNothingElseDoes) {
  const auto m = material("m", 1000);
  const auto scan = make("scan", imported(m, {1, 2, 3}));
  // Without such an engine it is drawn and weighed as it is, and no operation takes it.
  EXPECT_TRUE(derived.mesh(*document.now(), scan, progress).ok());
  EXPECT_FALSE(mass(scan).exact);
  EXPECT_NEAR(mass(scan).mass.mass, 6000, 6000 * mass(scan).relative_error);
  EXPECT_EQ(derived.features(*document.now(), scan, progress).error().sentence(),
            "solid \"scan\": no CSG engine for triangle meshes is loaded. Load the plugin "
            "csg_cgal, or use an exact solid.");
  add_mesh_engine();
  EXPECT_NEAR(mass(scan).mass.mass, 6000, 1e-9);
  EXPECT_EQ(mesh_counts.evaluations, 1);
  EXPECT_NEAR(mass(make("cube", box(m, 1, 1, 1))).mass.mass, 1000, 1e-9);
  EXPECT_EQ(mesh_counts.evaluations, 1);
  EXPECT_EQ(counts.evaluations, 1);
}

TEST_F(DerivedTest, OverlappingPartsOfTwoEnginesAreSeparatedByTheOneForTriangles) {
  add_mesh_engine();
  const auto m = material("m", 1000);
  model::Object o;
  o.parts.push_back({"scan", make("scan", imported(m, {1, 1, 1})), {}, {}});
  o.parts.push_back({"cube", make("cube", box(m, 1, 1, 1)), {{0.25, 0, 0}, {}, {}}, {}});
  const auto got = mass(make("o", o));
  EXPECT_NEAR(got.mass.mass, 1250, 1e-9);
  EXPECT_NEAR(got.overlap, 0.75, 1e-12);
  EXPECT_EQ(counts.partitions, 0);
  EXPECT_EQ(mesh_counts.partitions, 1);
}

TEST_F(DerivedTest, PartsOfTwoEnginesThatAreApartKeepTheirOwnEngines) {
  add_mesh_engine();
  const auto m = material("m", 1000);
  const auto cube = make("cube", box(m, 1, 1, 1));
  model::Object o;
  o.parts.push_back({"left", cube, {{0.75, 0, 0}, {}, {}}, {}});
  o.parts.push_back({"scan", make("scan", imported(m, {1, 1, 1})), {{-0.5, 0, 0}, {}, {}}, {}});
  o.parts.push_back({"right", cube, {{1.25, 0, 0}, {}, {}}, {}});
  const auto id = make("o", o);
  const auto got = mass(id);
  EXPECT_NEAR(got.mass.mass, 2500, 1e-9);
  EXPECT_NEAR(got.mass.com[0], (1000 * 0.75 - 1000 * 0.5 + 500 * 1.5) / 2500, 1e-12);
  EXPECT_NEAR(got.overlap, 0.5, 1e-12);
  EXPECT_EQ(counts.partitions, 1) << "of the two cubes";
  EXPECT_EQ(mesh_counts.partitions, 0);
  const auto rows = derived.part_masses(*document.now(), id, progress);
  ASSERT_TRUE(rows.ok());
  EXPECT_EQ(rows->at(1).name, "scan");
  EXPECT_NEAR(rows->at(1).mass.mass, 1000, 1e-9);
}

TEST_F(DerivedTest, WhatTheExactEngineCannotVerifyIsAnApproximationThatSaysWhy) {
  const auto cube = make("cube", box(material("m", 1000), 1, 1, 1));
  fault = Fault::unverified;
  const std::string refusal =
      "solid \"cube\", node \"block\": the result did not close. Move an operand.";
  EXPECT_EQ(derived.mass(*document.now(), cube, progress).error().sentence(), refusal);
  add_mesh_engine();
  const auto got = mass(cube);
  EXPECT_NEAR(got.mass.mass, 1000, 1e-9);
  EXPECT_FALSE(got.exact);
  EXPECT_EQ(got.notes, std::vector<std::string>{
                           "solid \"cube\": shown as an approximation: node \"block\": the result "
                           "did not close. Move an operand."});
  EXPECT_TRUE(derived.mesh(*document.now(), cube, progress).ok());
  // A fault of the arguments is no reason to look elsewhere.
  fault = Fault::none;
  model::Solid ball;
  ball.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {1}});
  const int evaluations = mesh_counts.evaluations;
  EXPECT_FALSE(derived.mesh(*document.now(), make("ball", ball), progress).ok());
  EXPECT_EQ(mesh_counts.evaluations, evaluations);
}

TEST_F(DerivedTest, APrimitiveOfAPluginIsBuiltOnceAndItsFaultsNameTheNode) {
  const auto m = material("m", 1000);
  const auto bare = make("bare", block(m, 2));
  EXPECT_FALSE(derived.mass(*document.now(), bare, progress).ok()) << "there is no such primitive";
  add_block_primitive();
  const auto got = mass(bare);
  EXPECT_NEAR(got.mass.mass, 2000, 1e-9);
  EXPECT_NEAR(got.mass.com[2], 2.5, 1e-12) << "it stands where the node is";
  EXPECT_EQ(built, 1);
  ASSERT_TRUE(derived.mesh(*document.now(), bare, progress).ok());
  EXPECT_EQ(built, 1);
  const auto wide = make("wide", block(m, 6));
  EXPECT_EQ(derived.mesh(*document.now(), wide, progress).error().sentence(),
            "solid \"wide\", node \"gear\", primitive \"block\": width exceeds 5 m. Make it less.");
  const auto thin = make("thin", block(m, 0.01));
  const std::string refused = derived.mesh(*document.now(), thin, progress).error().sentence();
  EXPECT_EQ(refused.find("solid \"thin\", node \"gear\", primitive \"block\""), 0U) << refused;
  EXPECT_NE(refused.find("width"), std::string::npos) << refused;
  block_parent = 3;
  const auto odd = make("odd", block(m, 3));
  EXPECT_EQ(derived.mesh(*document.now(), odd, progress).error().sentence(),
            "solid \"odd\", node \"gear\": provider \"block\" built a tree in which node 0 has the "
            "parent 3. Report it to the provider's author.");
}

TEST_F(DerivedTest, AMeasuredMassCountsInsteadOfTheComputedOneAndAboveIt) {
  const auto water = material("water", 1000);
  const auto motor = make("motor", box(water, 1, 1, 1)), plate = make("plate", box(water, 2, 2, 1));
  model::Object inner;
  inner.parts.push_back({"motor", motor, {{0, 0, 1}, {}, {}}, {}});
  const auto drive = make("drive", inner);
  model::Object outer;
  outer.parts.push_back({"drive", drive, {{10, 0, 0}, {}, {}}, {}});
  outer.parts.push_back({"plate", plate, {{10, 0, 0}, {}, {}}, {}});
  const auto arm = make("arm", outer);
  EXPECT_NEAR(mass(arm).mass.mass, 5000, 1e-9);
  model::MeasuredMass weighed{{700, {0, 0, 0.25}, {1, 2, 3, 0, 0, 0}}, "scales, J. Doe"};
  edit<model::Solid>(motor, [&](model::Solid& s) { s.measured = weighed; });
  const auto own = mass(motor);
  EXPECT_EQ(own.mass.mass, 700);
  EXPECT_EQ(own.measured_source, "scales, J. Doe");
  ASSERT_TRUE(own.computed.has_value());
  EXPECT_NEAR(own.computed->mass, 1000, 1e-9);
  EXPECT_NEAR(own.volume, 1, 1e-12);
  const auto above = mass(arm);
  EXPECT_NEAR(above.mass.mass, 4700, 1e-9);
  EXPECT_NEAR(above.mass.com[2], (700 * 1.25 + 4000 * 0.5) / 4700, 1e-12);
  EXPECT_FALSE(above.computed.has_value());
  EXPECT_EQ(above.notes,
            std::vector<std::string>{
                "solid \"motor\" is included with its measured mass (scales, J. Doe)."});
  const auto parts = derived.part_masses(*document.now(), arm, progress);
  ASSERT_TRUE(parts.ok());
  EXPECT_NEAR(parts->at(0).mass.mass, 700, 1e-9);
  EXPECT_NEAR(parts->at(1).mass.mass, 4000, 1e-9);
  // The outermost measured mass wins; no shape is needed for it.
  weighed.mass.mass = 650;
  edit<model::Object>(drive, [&](model::Object& x) { x.measured = weighed; });
  EXPECT_NEAR(mass(arm).mass.mass, 4650, 1e-9);
  edit<model::Solid>(motor, [](model::Solid& s) { s.nodes[0].kind = CsgKind::sphere; });
  EXPECT_NEAR(mass(drive).mass.mass, 650, 1e-9);
  EXPECT_FALSE(mass(drive).computed.has_value() && mass(drive).notes.empty());
  EXPECT_NEAR(mass(arm).mass.mass, 4650, 1e-9);
}

TEST_F(DerivedTest, PlacementsInTheSolidsFrameAndInOtherCoordinatesAreResolved) {
  model::Solid s;
  s.nodes.push_back({CsgKind::union_, "all", -1, {{1, 0, 0}, {0, 0, std::numbers::pi / 2}, {}}});
  s.nodes.push_back({CsgKind::union_, "group", 0, {{0, 3, 0}, {0.3, 0.2, 0.1}, {}}});
  s.nodes.push_back({CsgKind::box, "here", 1, {{5, 6, 7}, {0.1, 0, 0}, {}}, {1, 1, 1}});
  s.nodes[2].is_global = true;
  s.nodes.push_back({CsgKind::box, "round", 0, {}, {1, 1, 1}});
  s.nodes[3].placement.coordinates = model::PositionRepresentation::cylindrical;
  s.nodes[3].placement.position = {2, std::numbers::pi / 2, 4};
  const auto tree = evaluation::tree_of(s, {});
  ASSERT_TRUE(tree.ok());
  // Chained by hand: the pose of "here" in the solid's frame is what was written.
  const Pose here =
      spatial::compose(spatial::compose(tree->nodes[0].placement, tree->nodes[1].placement),
                       tree->nodes[2].placement);
  EXPECT_NEAR(here.p[0], 5, 1e-12);
  EXPECT_NEAR(here.p[1], 6, 1e-12);
  EXPECT_NEAR(here.p[2], 7, 1e-12);
  EXPECT_NEAR(here.R[0], 1, 1e-12);
  EXPECT_NEAR(here.R[5], -std::sin(0.1), 1e-12);
  EXPECT_NEAR(tree->nodes[3].placement.p[0], 0, 1e-12);
  EXPECT_NEAR(tree->nodes[3].placement.p[1], 2, 1e-12);
  EXPECT_NEAR(tree->nodes[3].placement.p[2], 4, 1e-12);
}

// Each kind of primitive that stands on z = 0, with a height of 0.4 m: its engine's frame is 0.2 m
// below the node's, along the node's own z.
TEST_F(DerivedTest, CentredPrimitivesHaveTheirFrameAtHalfTheirHeight) {
  const std::vector<std::pair<CsgKind, std::array<double, 6>>> kinds{
      {CsgKind::box, {1, 2, 0.4}},
      {CsgKind::cylinder, {1, 0.4}},
      {CsgKind::cone, {1, 0.5, 0.4}},
      {CsgKind::frustum, {1, 2, 0.5, 1, 0.4}},
      {CsgKind::wedge, {1, 2, 0.4, 0.1}},
      {CsgKind::pyramid, {5, 1, 0, 0.4}},
      {CsgKind::prism, {0.4}}};
  for (const auto& [kind, sizes] : kinds) {
    model::Solid s;
    s.nodes.push_back({CsgKind::union_, "all", -1, {{0, 0, 7}, {}, {}}});
    s.nodes.push_back({kind, "part", 0, {{1, 2, 3}, {std::numbers::pi / 2, 0, 0}, {}}, sizes});
    s.nodes[1].is_centred = true;
    const auto tree = evaluation::tree_of(s, {});
    ASSERT_TRUE(tree.ok());
    // Turned by 90 degrees about x, z points to -y: the base is at y + 0.2.
    EXPECT_NEAR(tree->nodes[1].placement.p[0], 1, 1e-15) << s.nodes[1].name;
    EXPECT_NEAR(tree->nodes[1].placement.p[1], 2.2, 1e-15);
    EXPECT_NEAR(tree->nodes[1].placement.p[2], 3, 1e-15);
    s.nodes[1].is_centred = false;
    EXPECT_EQ(evaluation::tree_of(s, {})->nodes[1].placement.p[1], 2);
  }
}

TEST_F(DerivedTest, SolidsPreparedTogetherAreFoundAndCancellingStops) {
  std::vector<AnyId> ids;
  for (int i = 1; i <= 12; ++i) ids.push_back(make("s" + std::to_string(i), box({}, i, 1, 1)));
  ids.push_back(make("s1_again", box({}, 1, 1, 1)));
  class Cancelled final : public Progress {
   public:
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return true; }
  } cancelled;
  EXPECT_EQ(derived.prepare(*document.now(), ids, cancelled).error().code, ErrorCode::cancelled);
  EXPECT_EQ(counts.meshes, 0);
  class Last final : public Progress {
   public:
    void report(double fraction, std::string_view) override { last = fraction; }
    [[nodiscard]] bool cancelled() const override { return false; }
    double last = 0;
  } told;
  ASSERT_TRUE(derived.prepare(*document.now(), ids, told).ok());
  EXPECT_EQ(told.last, 1);
  EXPECT_EQ(counts.meshes, 12) << "equal solids share one";
  for (const AnyId id : ids)
    EXPECT_TRUE(derived.mesh(*document.now(), SolidId{id.number}, progress).ok());
  EXPECT_EQ(counts.meshes, 12);
  ASSERT_TRUE(derived.prepare(*document.now(), ids, told).ok());
  EXPECT_EQ(counts.meshes, 12);
}

TEST_F(DerivedTest, WithoutTheCacheEverythingIsTheSame) {
  const Chain c = chain();
  const auto now = document.now();
  const auto with_mesh = derived.mesh(*now, c.cube, progress);
  const auto with_mass = mass(c.arm);
  const auto with_model = derived.robot_model(*now, c.robot, {0, 0, -1}, progress);
  derived.set_enabled(false);
  const int meshes = counts.meshes;
  const auto without_mesh = derived.mesh(*now, c.cube, progress);
  const auto without_mass = mass(c.arm);
  const auto without_model = derived.robot_model(*now, c.robot, {0, 0, -1}, progress);
  EXPECT_EQ(counts.meshes, meshes + 1);
  EXPECT_EQ((*with_mesh)->positions, (*without_mesh)->positions);
  EXPECT_EQ((*with_mesh)->triangles, (*without_mesh)->triangles);
  EXPECT_EQ(with_mass.mass.mass, without_mass.mass.mass);
  EXPECT_EQ(with_mass.mass.com, without_mass.mass.com);
  EXPECT_EQ(with_mass.mass.inertia.xx, without_mass.mass.inertia.xx);
  EXPECT_EQ((*with_model)->joints[0].body.mass, (*without_model)->joints[0].body.mass);
  EXPECT_EQ((*with_model)->gravity, (*without_model)->gravity);
}

TEST_F(DerivedTest, ACancelledComputationLeavesNoTrace) {
  class Cancelled final : public Progress {
   public:
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return true; }
  } cancelled;
  const auto id = make("cube", box({}, 1, 1, 1));
  EXPECT_EQ(derived.mesh(*document.now(), id, cancelled).error().code, ErrorCode::cancelled);
  EXPECT_EQ(derived.stats().entries, 0U);
  EXPECT_TRUE(derived.mesh(*document.now(), id, progress).ok());
}

TEST_F(DerivedTest, TheBudgetDropsWhatWasNotUsedForLongest) {
  Derived small(registry, 60'000);
  std::vector<SolidId> ids;
  for (int i = 1; i <= 20; ++i) ids.push_back(make("s" + std::to_string(i), box({}, i, 1, 1)));
  for (const auto id : ids) ASSERT_TRUE(small.mesh(*document.now(), id, progress).ok());
  EXPECT_LE(small.stats().bytes, 60'000U);
  const auto misses = small.stats().misses;
  ASSERT_TRUE(small.mesh(*document.now(), ids.back(), progress).ok());
  EXPECT_EQ(small.stats().misses, misses);
  ASSERT_TRUE(small.mesh(*document.now(), ids.front(), progress).ok());
  EXPECT_GT(small.stats().misses, misses);
}

TEST_F(DerivedTest, ARobotWithoutPartsGetsAGeneratedBodyAndOneWithPartsItsOwn) {
  const Chain c = chain();
  const auto designed = derived.robot_bodies(*document.now(), c.robot, progress);
  ASSERT_TRUE(designed.ok()) << designed.error().sentence();
  EXPECT_FALSE(designed->generated);
  ASSERT_EQ(designed->bodies.size(), 2U);
  ASSERT_EQ(designed->bodies[1].size(), 1U);
  EXPECT_EQ(designed->bodies[1][0].placement.p[2], 0.2);
  edit<model::Robot>(c.robot, [](model::Robot& r) { r.links[0].visible = false; });
  EXPECT_TRUE(derived.robot_bodies(*document.now(), c.robot, progress)->bodies[1].empty());
}

TEST_F(DerivedTest, ManyThreadsAskingAtOnceShareOneValue) {
  const Chain c = chain();
  const auto now = document.now();
  std::vector<std::shared_ptr<const Mesh>> got(8);
  {
    std::vector<std::jthread> threads;
    for (auto& out : got)
      threads.emplace_back([&, this] {
        NoProgress quiet;
        for (int i = 0; i < 50; ++i) {
          const auto m = derived.mesh(*now, c.cube, quiet);
          if (m.ok()) out = *m;
          (void)derived.mass(*now, c.arm, quiet).ok();
        }
      });
  }
  for (const auto& m : got) EXPECT_EQ(m.get(), got[0].get());
  EXPECT_NE(got[0], nullptr);
}

TEST_F(DerivedTest, AStaleIdAndAnEmptySolidAreSentences) {
  EXPECT_EQ(derived.mesh(*document.now(), SolidId{99}, progress).error().code,
            ErrorCode::stale_handle);
  const auto empty = make("empty", model::Solid{});
  EXPECT_EQ(derived.mesh(*document.now(), empty, progress).error().sentence(),
            "solid \"empty\": it has no nodes. Add a primitive such as a box to it.");
}

TEST_F(DerivedTest, ObjectsThatDoubleAtEveryLevelAreRefusedBeforeTheyFillTheMemory) {
  AnyId what = make("s", box({}, 1, 1, 1));
  for (int level = 0; level < 40; ++level) {
    model::Object o;
    o.parts.push_back({"a", what, {}, {}});
    o.parts.push_back({"b", what, {}, {}});
    what = make("o" + std::to_string(level), o);
  }
  EXPECT_EQ(derived.mass(*document.now(), what, progress).error().sentence(),
            "object \"o39\": it has more than 100000 parts, nested ones included. Split it into "
            "smaller objects.");
}

/// Derived values with the exact engine of the project.
class DerivedWithOcct : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path plugin = std::filesystem::path(ROBOMOSP_PLUGIN_DIR) / "csg_occt.so";
    if (!std::filesystem::exists(plugin)) GTEST_SKIP() << "csg_occt is not built";
    ASSERT_TRUE(loader.load(plugin.string()).loaded);
  }
  Registry registry;
  PluginLoader loader{registry};
  Document document;
  Derived derived{registry};
  NoProgress progress;
};

TEST_F(DerivedWithOcct, ABoredCylinderHasTheMassOfTheClosedFormAndASkinIsClosed) {
  auto tx = document.begin("make");
  model::Material steel;
  steel.density = 7850;
  const auto material = tx->add("steel", steel);
  model::Solid tube;
  tube.material = *material;
  tube.nodes.push_back({CsgKind::difference, "tube", -1, {}, {}});
  tube.nodes.push_back({CsgKind::cylinder, "outside", 0, {}, {0.05, 0.2}});
  tube.nodes.push_back({CsgKind::cylinder, "bore", 0, {{0, 0, -0.01}, {}, {}}, {0.04, 0.22}});
  const auto id = tx->add("tube", tube);
  model::Robot r;
  for (int i = 0; i < 3; ++i) {
    model::Link l;
    l.name = "link" + std::to_string(i + 1);
    l.row = {0.3, i == 0 ? std::numbers::pi / 2 : 0, i == 0 ? 0.4 : 0, 0};
    r.links.push_back(l);
  }
  const auto robot = tx->add("arm", r);
  ASSERT_TRUE(tx->commit().ok());
  const auto m = derived.mass(*document.now(), AnyId(*id), progress);
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  const double kg = 7850 * std::numbers::pi * (0.05 * 0.05 - 0.04 * 0.04) * 0.2;
  EXPECT_NEAR(m->mass.mass, kg, 1e-9 * kg);
  EXPECT_NEAR(m->mass.inertia.zz, kg * (0.05 * 0.05 + 0.04 * 0.04) / 2, 1e-9 * kg);
  const auto bodies = derived.robot_bodies(*document.now(), *robot, progress);
  ASSERT_TRUE(bodies.ok()) << bodies.error().sentence();
  EXPECT_TRUE(bodies->generated);
  EXPECT_FALSE(bodies->bodies[0].empty() && bodies->bodies[1].empty());
}

TEST_F(DerivedWithOcct, CubesThatTouchAlongAnEdgeAreASolid) {
  auto tx = document.begin("make");
  model::Material water;
  water.density = 1000;
  const auto material = tx->add("water", water);
  model::Solid pair;
  pair.material = *material;
  pair.nodes.push_back({CsgKind::union_, "pair", -1, {}, {}});
  pair.nodes.push_back({CsgKind::box, "first", 0, {}, {0.1, 0.1, 0.1}});
  pair.nodes.push_back({CsgKind::box, "second", 0, {{0.1, 0.1, 0}, {}, {}}, {0.1, 0.1, 0.1}});
  const auto id = tx->add("pair", pair);
  ASSERT_TRUE(tx->commit().ok());
  const auto m = derived.mass(*document.now(), AnyId(*id), progress);
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  EXPECT_NEAR(m->mass.mass, 2, 1e-9);
  const auto mesh = derived.mesh(*document.now(), *id, progress);
  ASSERT_TRUE(mesh.ok()) << mesh.error().sentence();
}

TEST_F(DerivedWithOcct, AFailedOperationShowsItsOperands) {
  auto tx = document.begin("make");
  model::Solid part;
  part.nodes.push_back({CsgKind::union_, "all", -1, {{0, 0, 1}, {}, {}}, {}});
  part.nodes.push_back({CsgKind::box, "plate", 0, {}, {0.3, 0.3, 0.01}});
  part.nodes.push_back({CsgKind::fillet, "nothing", 0, {{2, 0, 0}, {}, {}}, {5}});
  part.nodes.push_back({CsgKind::box, "small", 2, {{0, 3, 0}, {}, {}}, {0.1, 0.1, 0.1}});
  model::Solid gone;
  gone.nodes.push_back({CsgKind::difference, "gone", -1, {}, {}});
  gone.nodes.push_back({CsgKind::box, "small", 0, {}, {0.1, 0.1, 0.1}});
  gone.nodes.push_back({CsgKind::sphere, "ball", 0, {{0, 3, 0}, {}, {}}, {0.01}});
  gone.nodes.push_back({CsgKind::box, "big", 0, {{0, 0, -1}, {}, {}}, {3, 3, 3}});
  const auto id = tx->add("part", part), gone_id = tx->add("gone", gone);
  ASSERT_TRUE(tx->commit().ok());
  const auto mesh = derived.mesh(*document.now(), *id, progress);
  ASSERT_FALSE(mesh.ok());
  EXPECT_NE(mesh.error().sentence().find("nothing"), std::string::npos);
  EXPECT_FALSE(derived.mass(*document.now(), *id, progress).ok());
  const auto drawn = derived.drawables(*document.now(), *id, progress);
  ASSERT_TRUE(drawn.ok()) << drawn.error().sentence();
  ASSERT_EQ(drawn->size(), 2U);
  EXPECT_EQ(drawn->at(0).name, "part.plate");
  EXPECT_FALSE(drawn->at(0).is_operand) << "it stands beside what failed, and is well";
  EXPECT_EQ(drawn->at(0).placement.p[2], 1);
  EXPECT_EQ(drawn->at(1).name, "part.small");
  EXPECT_TRUE(drawn->at(1).is_operand);
  EXPECT_EQ(drawn->at(1).failure, mesh.error().sentence());
  EXPECT_EQ(drawn->at(1).placement.p[0], 2);
  EXPECT_EQ(drawn->at(1).placement.p[1], 3);
  const auto left = derived.drawables(*document.now(), *gone_id, progress);
  ASSERT_TRUE(left.ok()) << left.error().sentence();
  ASSERT_EQ(left->size(), 3U) << "of what is empty the operands";
  EXPECT_EQ(left->at(2).name, "gone.big");
  for (const auto& d : *left) EXPECT_NE(d.failure.find("empty"), std::string::npos);
}

/// Derived values with both engines of the project.
class DerivedWithCgal : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path folder(ROBOMOSP_PLUGIN_DIR);
    for (const char* name : {"csg_cgal.so", "csg_occt.so"}) {
      if (!std::filesystem::exists(folder / name)) GTEST_SKIP() << name << " is not built";
      ASSERT_TRUE(loader.load((folder / name).string()).loaded);
    }
    EXPECT_EQ(registry.find(CsgEngine::kInterfaceId, "")->name, "occt");
  }
  /// A cube of 0.1 m with a corner in the origin, as a mesh.
  static std::shared_ptr<const CsgGeometry> cube() {
    auto geometry = std::make_shared<CsgGeometry>();
    geometry->form = CsgGeometry::Form::mesh;
    for (int i = 0; i < 8; ++i)
      for (int k = 0; k < 3; ++k) geometry->points.push_back((i >> k) & 1 ? 0.1 : 0.0);
    geometry->triangles = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                           2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    geometry->digest = {7, 8};
    return geometry;
  }
  static model::SolidNode imported_node(std::string name, std::int32_t parent,
                                        std::shared_ptr<const CsgGeometry> geometry) {
    model::SolidNode n;
    n.kind = CsgKind::imported;
    n.name = std::move(name);
    n.parent = parent;
    n.sizes = {1};
    n.geometry = std::move(geometry);
    return n;
  }
  model::Solid of_water() {
    if (!water) {
      model::Material m;
      m.density = 1000;
      water = test::make(document, "water", m);
    }
    model::Solid s;
    s.material = water;
    return s;
  }
  Registry registry;
  PluginLoader loader{registry};
  Document document;
  Derived derived{registry};
  NoProgress progress;
  MaterialId water;
};

TEST_F(DerivedWithCgal, AnImportedExactSolidBesideAMeshIsTrianglesWithAStatedBound) {
  constexpr double kRadius = 0.03, kPi = std::numbers::pi;
  model::Solid rod = of_water();
  rod.nodes.push_back({CsgKind::cylinder, "rod", -1, {}, {kRadius, 0.2}});
  const auto exact = derived.geometry(*document.now(), test::make(document, "rod", rod), progress);
  ASSERT_TRUE(exact.ok()) << exact.error().sentence();
  ASSERT_EQ((*exact)->form, CsgGeometry::Form::brep);
  model::Solid bored = of_water();
  bored.nodes.push_back({CsgKind::difference, "bored", -1, {}, {}});
  bored.nodes.push_back(imported_node("scan", 0, cube()));
  bored.nodes.push_back(imported_node("drill", 0, *exact));
  bored.nodes.back().placement.position = {0.05, 0.05, -0.05};
  const auto id = test::make(document, "bored", bored);
  const auto m = derived.mass(*document.now(), AnyId(id), progress);
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  const double volume = 1e-3 - kPi * kRadius * kRadius * 0.1;
  EXPECT_FALSE(m->exact);
  EXPECT_LT(m->relative_error, 1e-2);
  EXPECT_LE(std::abs(m->volume / volume - 1), m->relative_error);
  EXPECT_GT(std::abs(m->volume / volume - 1), 1e-9) << "it is made of triangles";
  EXPECT_TRUE(derived.mesh(*document.now(), id, progress).ok());
  // In an object the two are separated in the same way.
  model::Object o;
  model::Solid scan = of_water();
  scan.nodes.push_back(imported_node("scan", -1, cube()));
  model::Solid step = of_water();
  step.nodes.push_back(imported_node("step", -1, *exact));
  o.parts.push_back({"scan", test::make(document, "scan", scan), {}, {}});
  o.parts.push_back(
      {"step", test::make(document, "step", step), {{0.05, 0.05, -0.05}, {}, {}}, {}});
  const auto both = derived.mass(*document.now(), AnyId(test::make(document, "o", o)), progress);
  ASSERT_TRUE(both.ok()) << both.error().sentence();
  const double rod_volume = kPi * kRadius * kRadius * 0.2;
  EXPECT_NEAR(both->overlap, rod_volume / 2, 1e-2 * rod_volume);
  EXPECT_LE(std::abs(both->volume / (1e-3 + rod_volume / 2) - 1), both->relative_error);
}

TEST_F(DerivedWithCgal, AFilletBesideAMeshIsMadeByTheExactEngineFirst) {
  model::Solid s = of_water();
  s.nodes.push_back({CsgKind::union_, "all", -1, {}, {}});
  s.nodes.push_back(imported_node("scan", 0, cube()));
  s.nodes.push_back({CsgKind::fillet, "round", 0, {{0.3, 0.05, 0}, {}, {}}, {0.01}});
  s.nodes.back().select = "parallel z";
  s.nodes.push_back({CsgKind::box, "block", 2, {}, {0.1, 0.1, 0.1}});
  const auto m = derived.mass(*document.now(), AnyId(test::make(document, "s", s)), progress);
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  const double volume = 1e-3 + 0.1 * (0.01 - (4 - std::numbers::pi) * 1e-4);
  EXPECT_LE(std::abs(m->volume / volume - 1), m->relative_error);
  EXPECT_LT(m->relative_error, 1e-2);
}

TEST_F(DerivedWithCgal, AnImportedCubeIsCutMeasuredAndHandedOutAgain) {
  model::Solid cut = of_water();
  cut.nodes.push_back({CsgKind::difference, "cut", -1, {}, {}});
  cut.nodes.push_back(imported_node("scan", 0, cube()));
  cut.nodes.push_back({CsgKind::box, "slot", 0, {{0.05, 0.05, 0.05}, {}, {}}, {0.02, 0.2, 0.1}});
  const auto id = test::make(document, "cut", cut);
  const auto now = document.now();
  const auto mass = derived.mass(*now, AnyId(id), progress);
  ASSERT_TRUE(mass.ok()) << mass.error().sentence();
  EXPECT_NEAR(mass->mass.mass, 1 - 0.1, 1e-9);
  EXPECT_TRUE(mass->exact) << "flat faces only";
  const auto mesh = derived.mesh(*now, id, progress);
  ASSERT_TRUE(mesh.ok()) << mesh.error().sentence();
  Pose plane;
  plane.p = {0, 0, 0.075};
  const auto section = derived.section(*now, id, plane, 1e-4, progress);
  ASSERT_TRUE(section.ok()) << section.error().sentence();
  EXPECT_EQ((*section)->loops.size(), 2U) << "one either side of the slot";
  plane.p = {1e308, 0, 0.075};
  const auto far = derived.section(*now, id, plane, 1e-4, progress);
  ASSERT_FALSE(far.ok());
  EXPECT_NE(far.error().sentence().find("it must be within 10000 m"), std::string::npos)
      << far.error().sentence();
  const auto out = derived.geometry(*now, id, progress);
  ASSERT_TRUE(out.ok()) << out.error().sentence();
  EXPECT_EQ((*out)->form, CsgGeometry::Form::mesh);
  EXPECT_EQ((*out)->deviation, 0);
  const auto same = io::make_geometry(**out);
  ASSERT_TRUE(same.ok()) << same.error().sentence();
  EXPECT_EQ((*out)->digest, (*same)->digest) << "as if it came from a file";
  const auto features = derived.features(*now, id, progress);
  ASSERT_TRUE(features.ok()) << features.error().sentence();
  // Bottom and two sides of the cube, two fronts cut to a U, two tops left, three of the slot.
  EXPECT_EQ(std::count_if((*features)->begin(), (*features)->end(),
                          [](const CsgFeature& f) { return f.kind == CsgFeature::Kind::plane; }),
            3 + 2 + 2 + 3);
  // What was handed out is the solid again.
  model::Solid copy = of_water();
  copy.nodes.push_back(imported_node("scan", -1, *out));
  const auto again = test::make(document, "copy", copy);
  EXPECT_NEAR(derived.mass(*document.now(), AnyId(again), progress)->mass.mass, 0.9, 1e-9);
}

}  // namespace
}  // namespace robomosp
