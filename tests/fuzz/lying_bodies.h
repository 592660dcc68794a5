// SPDX-License-Identifier: Apache-2.0
// Lying providers of solids, contact, files and pictures.
#pragma once

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <sstream>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_primitive.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_tables.h>
#include <robomosp/sdk/render.h>

#include "fuzz/lying_motion.h"

namespace robomosp::test {

// --- solids --------------------------------------------------------------------------------------

inline void spoil_mesh(Mesh& m) {
  switch (liar().pick(8)) {
    case 0: m = {}; break;
    case 1: m.positions.resize(m.positions.size() / 2); break;
    case 2: m.normals.clear(); break;
    case 3: m.triangles[liar().pick(m.triangles.size())] = 4'000'000'000U; break;
    case 4: m.triangles.pop_back(); break;
    case 5: m.positions[liar().pick(m.positions.size())] = NAN; break;
    case 6: m.edge_sizes.assign(3, 4'000'000'000U); break;
    default: m.triangles.resize(m.triangles.size() / 6 * 3); break;
  }
}
inline void spoil_moments(Moments& m) {
  double* const all[] = {&m.volume, &m.area, &m.first[1], &m.second.yz, &m.relative_error};
  *all[liar().pick(5)] = liar().no_number();
}

class LyingShape final : public CsgShape {
 public:
  explicit LyingShape(std::shared_ptr<const CsgShape> inner) : inner_(std::move(inner)) {}
  std::array<Vec3, 2> bounds() const override {
    using Box = std::array<Vec3, 2>;
    return liar().value<Box>(
        "csg.bounds", [&] { return inner_->bounds(); },
        {{"no number", Seen::surely,
          [](Box& b) { b[liar().pick(2)][liar().pick(3)] = liar().no_number(); }},
         {"upside down", Seen::surely, [](Box& b) { std::swap(b[0], b[1]); }},
         {"wild ones", Seen::maybe, [](Box& b) { b[1][0] = 1e300; }}});
  }
  std::span<const std::string> notes() const override {
    return liar().value<std::span<const std::string>>(
        "csg.notes", [&] { return inner_->notes(); },
        {{"strange words", Seen::maybe, [this](std::span<const std::string>& s) {
            strange_.assign(3, liar().wild_text());
            s = strange_;
          }}});
  }
  const CsgShape& inner() const { return *inner_; }
  std::shared_ptr<const CsgShape> shared() const { return inner_; }

 private:
  std::shared_ptr<const CsgShape> inner_;
  mutable std::vector<std::string> strange_;
};

class LyingCsg final : public Lying<CsgEngine> {
 public:
  using Lying::Lying;
  using Made = std::shared_ptr<const CsgShape>;
  Result<Made> evaluate(const CsgTree& tree, Progress& p) const override {
    return liar().answer<Made>("csg.evaluate", &p,
                               [&]() -> Result<Made> {
                                 RMP_TRY_ASSIGN(auto made, inner_->evaluate(tree, p));
                                 return Made(std::make_shared<LyingShape>(std::move(made)));
                               },
                               {{"no solid", Seen::surely, [](Made& m) { m.reset(); }}});
  }
  Result<Mesh> mesh(const CsgShape& s, const MeshQuality& q, Progress& p) const override {
    return liar().answer<Mesh>(
        "csg.mesh", &p, [&] { return inner_->mesh(of(s), q, p); },
        {{"a spoiled mesh", Seen::surely, spoil_mesh},
         {"wild places", Seen::maybe, [](Mesh& m) { m.positions[0] = 1e38F; }}});
  }
  Result<Moments> moments(const CsgShape& s, Progress& p) const override {
    return liar().answer<Moments>(
        "csg.moments", &p, [&] { return inner_->moments(of(s), p); },
        {{"no number", Seen::surely, spoil_moments},
         {"a negative volume", Seen::surely, [](Moments& m) { m.volume = -m.volume; }},
         {"an impossible second moment", Seen::surely,
          [](Moments& m) { m.second.xx = m.second.yy = m.second.zz = -1; }},
         {"a wild volume", Seen::maybe, [](Moments& m) { m.volume = 1e300; }}});
  }
  Result<Partition> partition(std::span<const PlacedShape> parts, Progress& p) const override {
    std::vector<PlacedShape> plain(parts.begin(), parts.end());
    for (PlacedShape& x : plain) x.shape = static_cast<const LyingShape&>(*x.shape).shared();
    return liar().answer<Partition>(
        "csg.partition", &p, [&] { return inner_->partition(plain, p); },
        {{"too few", Seen::surely, [](Partition& x) { x.parts.pop_back(); }},
         {"none", Seen::surely, [](Partition& x) { x.parts.clear(); }},
         {"too many", Seen::surely, [](Partition& x) { x.parts.resize(x.parts.size() + 7); }},
         {"no number", Seen::surely, [](Partition& x) { spoil_moments(x.parts[0]); }},
         {"a negative part", Seen::surely, [](Partition& x) { x.parts[0].volume = -1; }},
         {"no overlap", Seen::maybe, [](Partition& x) { x.overlap = liar().no_number(); }}});
  }
  Result<std::vector<CsgFeature>> features(const CsgShape& s, Progress& p) const override {
    using All = std::vector<CsgFeature>;
    return liar().answer<All>(
        "csg.features", &p, [&] { return inner_->features(of(s), p); },
        {{"no number", Seen::surely,
          [](All& f) {
            CsgFeature& x = f[liar().pick(f.size())];
            double* const all[] = {&x.point[0], &x.direction[1], &x.radius, &x.size};
            *all[liar().pick(4)] = liar().no_number();
          }},
         {"a kind that is none", Seen::surely,
          [](All& f) { f[liar().pick(f.size())].kind = static_cast<CsgFeature::Kind>(99); }},
         {"none", Seen::maybe, [](All& f) { f.clear(); }}});
  }
  Result<CsgProfile> section(const CsgShape& s, const Pose& plane, double chord,
                             Progress& p) const override {
    return liar().answer<CsgProfile>(
        "csg.section", &p, [&] { return inner_->section(of(s), plane, chord, p); },
        {{"no number", Seen::surely,
          [](CsgProfile& x) {
            if (!x.loops.empty()) x.loops[0].start[0] = liar().no_number();
          }},
         {"a curve without points", Seen::surely,
          [](CsgProfile& x) {
            x.loops.push_back({{0, 0}, {{CsgCurve::Kind::arc, {}}}});
          }},
         {"a curve of no kind", Seen::surely,
          [](CsgProfile& x) {
            x.loops.push_back({{0, 0}, {{static_cast<CsgCurve::Kind>(9), {{1, 1}, {2, 2}}}}});
          }},
         {"a loop without curves", Seen::surely, [](CsgProfile& x) { x.loops.push_back({}); }}});
  }
  Result<CsgGeometry> geometry(const CsgShape& s, Progress& p) const override {
    return liar().answer<CsgGeometry>(
        "csg.geometry", &p, [&] { return inner_->geometry(of(s), p); },
        {{"nothing", Seen::surely, [](CsgGeometry& g) { g = {}; }},
         {"triangles of nothing", Seen::surely,
          [](CsgGeometry& g) {
            g.form = CsgGeometry::Form::mesh;
            g.points.assign(3, 0);
            g.triangles.assign(3, 77);
          }},
         {"a form that is none", Seen::surely,
          [](CsgGeometry& g) { g.form = static_cast<CsgGeometry::Form>(5); }}});
  }

 private:
  static const CsgShape& of(const CsgShape& s) { return static_cast<const LyingShape&>(s).inner(); }
};

/// A box of 1 cm.
class LyingPrimitive final : public CsgPrimitive {
 public:
  Result<CsgTree> build(const Params&, Progress& p) const override {
    return liar().answer<CsgTree>(
        "primitive.build", &p,
        []() -> Result<CsgTree> {
          CsgTree t;
          t.nodes.resize(3);
          t.nodes[0].kind = CsgKind::union_;
          t.nodes[1].parent = t.nodes[2].parent = 0;
          t.nodes[1].sizes = {0.01, 0.01, 0.01};
          t.nodes[2].sizes = {0.02, 0.005, 0.005};
          return t;
        },
        {{"no nodes", Seen::surely, [](CsgTree& t) { t.nodes.clear(); }},
         {"a parent that is not there", Seen::surely,
          [](CsgTree& t) { t.nodes[2].parent = liar().pick(2) ? 77 : -5; }},
         {"a node below itself", Seen::surely, [](CsgTree& t) { t.nodes[2].parent = 2; }},
         {"two roots", Seen::surely, [](CsgTree& t) { t.nodes[2].parent = -1; }},
         {"no number", Seen::surely,
          [](CsgTree& t) { t.nodes[1].sizes[liar().pick(3)] = liar().no_number(); }},
         {"a negative size", Seen::surely, [](CsgTree& t) { t.nodes[1].sizes[1] = -1; }},
         {"a wild size", Seen::maybe, [](CsgTree& t) { t.nodes[1].sizes[1] = liar().wild(); }},
         {"a kind that is none", Seen::surely,
          [](CsgTree& t) { t.nodes[1].kind = static_cast<CsgKind>(99); }},
         {"a primitive of its own kind", Seen::surely,
          [](CsgTree& t) { t.nodes[1].kind = CsgKind::custom; }},
         {"a prism without a profile", Seen::surely,
          [](CsgTree& t) { t.nodes[1].kind = CsgKind::prism; }},
         {"an imported node without geometry", Seen::surely,
          [](CsgTree& t) { t.nodes[1].kind = CsgKind::imported; }},
         {"a placement that is none", Seen::surely,
          [](CsgTree& t) { t.nodes[1].placement.R[liar().pick(9)] = liar().wild(); }},
         {"a place that is none", Seen::surely,
          [](CsgTree& t) { t.nodes[1].placement.p[0] = liar().no_number(); }},
         {"a strange name and choice of edges", Seen::maybe,
          [](CsgTree& t) { t.nodes[1].name = t.nodes[1].select = liar().wild_text(); }},
         {"very many nodes", Seen::maybe, [](CsgTree& t) { t.nodes.resize(300, t.nodes[1]); }}});
  }
};

// --- contact -------------------------------------------------------------------------------------

class LyingScene final : public LyingMade<CollisionScene> {
 public:
  using LyingMade::LyingMade;
  Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                         double interest, std::span<PairDistance> out, Progress& p) const override {
    using D = PairDistance;
    return liar().fill(
        "collision.distances", &p,
        [&] { return inner_->distances(poses, pairs, interest, out, p); },
        {spoiled_sample<D>(out, "no number", Seen::surely,
                           [](D& d) {
                             double* const all[] = {&d.distance, &d.on_a[0], &d.on_b[2]};
                             *all[liar().pick(3)] = NAN;
                           }),
         spoiled_sample<D>(out, "an infinite depth", Seen::surely,
                           [](D& d) { d.distance = -INFINITY; }),
         spoiled_sample<D>(out, "a wild distance", Seen::maybe,
                           [](D& d) { d.distance = liar().wild(); }),
         spoiled_sample<D>(out, "an infinite place", Seen::surely,
                           [](D& d) { d.on_a[1] = INFINITY; }),
         unfilled_samples(out, Seen::maybe)});
  }
  Result<void> collisions(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                          std::span<std::uint8_t> out, Progress& p) const override {
    return liar().fill("collision.collisions", &p,
                       [&] { return inner_->collisions(poses, pairs, out, p); },
                       {spoiled_sample<std::uint8_t>(out, "the other", Seen::maybe,
                                                     [](std::uint8_t& x) { x = !x; }),
                        spoiled_sample<std::uint8_t>(out, "neither yes nor no", Seen::maybe,
                                                     [](std::uint8_t& x) { x = 200; }),
                        unfilled_samples(out, Seen::maybe)});
  }
};
class LyingCollision final : public Lying<CollisionEngine> {
 public:
  using Lying::Lying;
  Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody> bodies,
                                                const Params& params, Progress& p) const override {
    return made_lying<LyingScene, CollisionScene>("collision.build",
                                                  [&] { return inner_->build(bodies, params, p); });
  }
};

class LyingWorld final : public LyingMade<PhysicsWorld> {
 public:
  using LyingMade::LyingMade;
  Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                    Progress& p) override {
    return liar().fill("physics.step", &p, [&] { return inner_->step(dt, steps, forces, p); }, {});
  }
  Result<void> read(const PhysicsState& out) const override {
    // A world without driven robots has no joints to lie about.
    std::vector<Lie<Nothing>> lies;
    if (!out.joint_positions.empty())
      lies = about_numbers(liar().pick(2) ? out.joint_positions : out.joint_velocities);
    lies.push_back(spoiled_sample<Pose>(out.poses, "no rotation", Seen::surely,
                                        [](Pose& x) { x.R[liar().pick(9)] += 0.3; }));
    lies.push_back(spoiled_sample<Pose>(out.poses, "a place that is none", Seen::surely,
                                        [](Pose& x) { x.p[liar().pick(3)] = liar().no_number(); }));
    lies.push_back(spoiled_sample<Pose>(out.poses, "a wild place", Seen::maybe,
                                        [](Pose& x) { x.p[liar().pick(3)] = liar().wild(); }));
    lies.push_back(spoiled_sample<Vec3>(liar().pick(2) ? out.velocities : out.angular_velocities,
                                        "a velocity that is none", Seen::surely,
                                        [](Vec3& v) { v[liar().pick(3)] = liar().no_number(); }));
    lies.push_back({"zeros", Seen::surely, [out](Nothing&) {
                      for (Pose& x : out.poses) x.R.fill(0);
                    }});
    return liar().fill(
        "physics.read", nullptr, [&] { return inner_->read(out); }, std::move(lies));
  }
  void contacts(std::vector<PhysicsContact>& out) const override {
    using All = std::vector<PhysicsContact>;
    out = liar().value<All>("physics.contacts",
                            [&] {
                              All all;
                              inner_->contacts(all);
                              return all;
                            },
                            {{"bodies that are none", Seen::surely,
                              [](All& c) {
                                c.resize(c.size() + 1);
                                c.back().a = 2'000'000'000, c.back().b = -77;
                              }},
                             {"no number", Seen::surely,
                              [](All& c) {
                                c.resize(c.size() + 1);
                                c.back().a = 0, c.back().b = 1;
                                double* const all[] = {&c.back().force[0], &c.back().point[1],
                                                       &c.back().normal[2], &c.back().depth};
                                *all[liar().pick(4)] = liar().no_number();
                              }},
                             {"very many", Seen::maybe, [](All& c) { c.resize(1'000'000); }},
                             {"none", Seen::maybe, [](All& c) { c.clear(); }}});
  }
  Result<std::int32_t> attach(std::int32_t a, std::int32_t b) override {
    return liar().answer<std::int32_t>(
        "physics.attach", nullptr, [&] { return inner_->attach(a, b); },
        {{"a number that is none", Seen::maybe, [](std::int32_t& n) { n = -2'000'000'000; }}});
  }
  Result<void> release(std::int32_t n) override {
    return liar().fill("physics.release", nullptr, [&] { return inner_->release(n); }, {});
  }
  Result<void> move(std::int32_t body, const Pose& pose, Vec3 v, Vec3 w) override {
    return liar().fill("physics.move", nullptr, [&] { return inner_->move(body, pose, v, w); }, {});
  }
  Result<void> servo(std::int32_t joint, double v, double force) override {
    return liar().fill("physics.servo", nullptr, [&] { return inner_->servo(joint, v, force); },
                       {});
  }
  Result<void> push(std::int32_t body, Vec3 force, Vec3 torque) override {
    return liar().fill("physics.push", nullptr, [&] { return inner_->push(body, force, torque); },
                       {});
  }
  Result<void> ignore(std::int32_t a, std::int32_t b) override {
    return liar().fill("physics.ignore", nullptr, [&] { return inner_->ignore(a, b); }, {});
  }
};
class LyingPhysics final : public Lying<PhysicsEngine> {
 public:
  using Lying::Lying;
  Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                               std::span<const PhysicsJoint> joints, Vec3 gravity,
                                               const Params& p) const override {
    return made_lying<LyingWorld, PhysicsWorld>(
        "physics.create", [&] { return inner_->create(bodies, joints, gravity, p); });
  }
};

// --- files and pictures --------------------------------------------------------------------------

inline Lie<std::string_view> strange_extensions() {
  return {"strange words", Seen::maybe, [](std::string_view& s) {
            static const std::string all[] = {std::string(1'000'000, ','), "\x1b[2J,\x07", ""};
            s = all[liar().pick(3)];
          }};
}

/// Reads a box from any file.
class LyingImporter final : public Importer {
 public:
  std::string_view extensions() const override {
    return liar().value<std::string_view>(
        "importer.extensions", [] { return std::string_view("lie"); }, {strange_extensions()});
  }
  Result<Imported> read(std::string_view, const Params&, Progress& p) const override {
    return liar().answer<Imported>(
        "importer.read", &p,
        []() -> Result<Imported> {
          Imported made;
          made.records.push_back({"lie.csg",
                                  "robomosp solid 1\nname lie\nimported root { geometry "
                                  "\"lie.ply\" }\n"});
          CsgGeometry g;
          g.form = CsgGeometry::Form::mesh;
          g.points = {0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1};
          g.triangles = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
          made.geometries.push_back({"lie.ply", g});
          made.notes.emplace_back("Nothing was mended.");
          return made;
        },
        {{"no records", Seen::maybe, [](Imported& x) { x.records.clear(); }},
         {"a record that is none", Seen::surely,
          [](Imported& x) { x.records.back().text = liar().wild_text(); }},
         {"a name that leads out", Seen::maybe,
          [](Imported& x) {
            const char* all[] = {"../out.csg", "/lie.csg", "", "a/../../b.csg", "x.sh"};
            x.records.back().name = all[liar().pick(5)];
          }},
         {"a name of strange words", Seen::maybe,
          [](Imported& x) { x.records.back().name = liar().wild_text() + ".csg"; }},
         {"geometry of no points", Seen::surely,
          [](Imported& x) { x.geometries[0].geometry.points.clear(); }},
         {"a point too few", Seen::surely,
          [](Imported& x) { x.geometries[0].geometry.points.pop_back(); }},
         {"an index out of range", Seen::surely,
          [](Imported& x) { x.geometries[0].geometry.triangles[4] = 4'000'000'000U; }},
         {"no number", Seen::surely,
          [](Imported& x) { x.geometries[0].geometry.points[3] = liar().no_number(); }},
         {"a B-rep of rubbish", Seen::surely,
          [](Imported& x) {
            x.geometries[0].geometry.form = CsgGeometry::Form::brep;
            x.geometries[0].geometry.brep = liar().wild_text();
          }},
         {"a form that is none", Seen::surely,
          [](Imported& x) { x.geometries[0].geometry.form = static_cast<CsgGeometry::Form>(9); }},
         {"no geometry", Seen::surely, [](Imported& x) { x.geometries.clear(); }},
         {"notes of strange words", Seen::maybe,
          [](Imported& x) { x.notes.assign(2000, liar().wild_text()); }},
         {"a profile that is none", Seen::maybe,
          [](Imported& x) {
            x.profile.loops.push_back({{NAN, 0}, {{CsgCurve::Kind::arc, {}}}});
          }},
         {"foreign geometry that is none", Seen::maybe,
          [](Imported& x) {
            x.foreign.push_back({"lie.ply", "/dev/zero.stl", {0, NAN, -1}, "furlong"});
          }},
         {"a file that imports itself", Seen::maybe, [](Imported& x) {
            x.geometries.clear();
            x.foreign.push_back({"lie.ply", "again.lie", {1, 1, 1}, "m"});
          }}});
  }
};

class LyingExporter final : public Exporter {
 public:
  std::string_view extensions() const override {
    return liar().value<std::string_view>(
        "exporter.extensions", [] { return std::string_view("lie"); }, {strange_extensions()});
  }
  bool is_exact(std::string_view) const override {
    return liar().value<bool>("exporter.is_exact", [] { return false; },
                              {{"the other", Seen::maybe, [](bool& b) { b = !b; }}});
  }
  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params&,
                                          Progress& p) const override {
    using Files = std::vector<ExportedFile>;
    return liar().answer<Files>(
        "exporter.write", &p,
        [&]() -> Result<Files> {
          return Files{{std::string(task.name), "text"}};
        },
        {{"no files", Seen::surely, [](Files& f) { f.clear(); }},
         {"a name that leads out", Seen::surely,
          [](Files& f) {
            const char* all[] = {"../out.lie", "/out.lie", "", ".", "a/../../b", "..", "a/.."};
            f.push_back({all[liar().pick(7)], "x"});
          }},
         {"a name that no file has", Seen::surely,
          [](Files& f) {
            f.push_back({liar().pick(2) ? std::string(5000, 'n') : std::string("a\0b", 3), "x"});
          }},
         {"one name twice", Seen::surely, [](Files& f) { f.push_back(f[0]); }},
         {"a report of strange words", Seen::maybe, [&](Files&) {
            if (!task.report) return;
            task.report->notes.assign(2000, liar().wild_text());
            task.report->counts.push_back({liar().wild_text(), -7});
          }}});
  }
};

/// Writes what another post writes, with a lie between.
class LyingPost final : public Lying<Post> {
 public:
  using Lying::Lying;
  const PostCapabilities& capabilities() const override {
    using Caps = PostCapabilities;
    lied_ = liar().value<Caps>(
        "post.capabilities", [&] { return inner_->capabilities(); },
        {{"no form", Seen::surely, [](Caps& c) { c.forms = 0; }},
         {"names of no letters", Seen::surely,
          [](Caps& c) { c.max_name = liar().pick(2) ? -1 : std::numeric_limits<int>::min(); }},
         {"no title", Seen::surely, [](Caps& c) { c.title = {}; }},
         {"a title of no text", Seen::surely, [](Caps& c) { c.title = no_text(); }},
         {"reserved words without an end", Seen::surely,
          [](Caps& c) {
            c.reserved = {"x", liar().wild_size()};
          }},
         {"extensions that lead out", Seen::surely, [](Caps& c) { c.extensions = "../x"; }},
         {"another version", Seen::surely, [](Caps& c) { c.struct_size = 8; }},
         {"circles of no kind", Seen::surely,
          [](Caps& c) { c.circle = static_cast<PostCircle>(99); }},
         {"a case of no kind", Seen::surely,
          [](Caps& c) { c.name_case = static_cast<PostCase>(-7); }},
         {"a negative number of points", Seen::surely, [](Caps& c) { c.max_points = -3; }},
         {"a title of strange words", Seen::maybe, [](Caps& c) { c.title = "\x1b[2J\x07 x"; }},
         {"all features", Seen::maybe, [](Caps& c) { c.features = ~std::uint64_t{0}; }},
         {"no features", Seen::maybe, [](Caps& c) { c.features = 0; }},
         {"no motions", Seen::maybe, [](Caps& c) { c.motions = 0; }},
         {"all motions", Seen::maybe, [](Caps& c) { c.motions = ~0U; }}});
    return lied_;
  }
  Result<void> write(const PostTask& task, const Params& params, PostOutput& to,
                     Progress& p) const override {
    using Said = std::vector<std::function<void(PostOutput&)>>;
    const auto one = [](auto&& act) { return [act](Said& all) { all.emplace_back(act); }; };
    const rmp_span here = row<rmp_code_routine>(task.code->routines, 0).span;
    const auto fault = [here](std::uint32_t severity, auto&& spoil) {
      rmp_span at = here;
      spoil(at);
      return
          [severity, at](PostOutput& o) { o.fault(severity, at, "it has no such thing", "Go."); };
    };
    RMP_TRY_ASSIGN(
        const Said all,
        liar().answer<Said>(
            "post.write", &p,
            [&]() -> Result<Said> {
              Kept kept;
              RMP_TRY(inner_->write(task, params, kept, p));
              return std::move(kept.all);
            },
            {{"nothing", Seen::surely, [](Said& a) { a.clear(); }},
             {"a name that leads out", Seen::surely, one([](PostOutput& o) {
                const char* names[] = {"../out",    "/out", "",     ".",
                                       "a/../../b", "..",   "a/..", "a//b"};
                o.file(names[liar().pick(8)], "x");
              })},
             {"a name that no file has", Seen::surely, one([](PostOutput& o) {
                switch (liar().pick(4)) {
                  case 0: o.file(std::string(5000, 'n'), "x"); break;
                  case 1: o.file(std::string_view("a\0b", 3), "x"); break;
                  case 2: o.file(no_text(), "x"); break;
                  default: o.file("c:\\boot", "x"); break;
                }
              })},
             {"one name twice", Seen::surely, one([](PostOutput& o) {
                o.file("a", "x");
                o.file("a", "y");
              })},
             {"bytes that are none", Seen::surely,
              one([](PostOutput& o) { o.file("a", no_text()); })},
             {"a file without an end", Seen::surely, one([](PostOutput& o) {
                o.file("a", {"x", liar().wild_size()});
              })},
             {"a file of 300 MiB", Seen::surely, one([](PostOutput& o) {
                constexpr std::size_t kSize = std::size_t{300} << 20;
                const std::unique_ptr<void, void (*)(void*)> room(std::calloc(kSize, 1),
                                                                  &std::free);
                if (room) o.file("a", {static_cast<const char*>(room.get()), kSize});
                else o.file("..", "");
              })},
             {"files without end", Seen::surely, one([](PostOutput& o) {
                for (int i = 0; i < 200'000; ++i) o.file("f" + std::to_string(i), "x");
              })},
             {"a line of a file that is not there", Seen::surely,
              one([here](PostOutput& o) { o.from("nowhere", 1, here); })},
             {"a line that is not there", Seen::surely, one([here](PostOutput& o) {
                o.file("a", "one\n");
                o.from("a", liar().pick(2) ? 0 : 4'000'000'000U, here);
              })},
             {"a line from nowhere", Seen::surely, one([here](PostOutput& o) {
                o.file("a", "one\n");
                rmp_span at = here;
                at.file = 77;
                o.from("a", 1, at);
              })},
             {"lines without end", Seen::surely, one([here](PostOutput& o) {
                o.file("a", "one\n");
                for (int i = 0; i < 2'000'000; ++i) o.from("a", 1, here);
              })},
             {"a severity that is none", Seen::surely, one(fault(9, [](rmp_span&) {}))},
             {"a fault of another file", Seen::surely,
              one(fault(RMP_FAULT_ERROR, [](rmp_span& s) { s.file = RMP_NONE; }))},
             {"a fault behind the program", Seen::surely,
              one(fault(RMP_FAULT_ERROR, [](rmp_span& s) { s.end = 4'000'000'000U; }))},
             {"a fault that ends before it begins", Seen::surely,
              one(fault(RMP_FAULT_ERROR, [](rmp_span& s) { s.begin = s.end + 1; }))},
             {"a fault at a line that is none", Seen::surely,
              one(fault(RMP_FAULT_WARNING, [](rmp_span& s) { s.line = 4'000'000'000U; }))},
             {"a fault without words", Seen::surely,
              one([here](PostOutput& o) { o.fault(RMP_FAULT_ERROR, here, "", ""); })},
             {"a fault of no text", Seen::surely,
              one([here](PostOutput& o) { o.fault(RMP_FAULT_ERROR, here, no_text(), ""); })},
             {"a fault of strange words", Seen::maybe, one([here](PostOutput& o) {
                o.fault(RMP_FAULT_ERROR, here, "w" + liar().wild_text(), liar().wild_text());
              })},
             {"faults without end", Seen::maybe, one([here](PostOutput& o) {
                for (int i = 0; i < 300'000; ++i) o.fault(RMP_FAULT_WARNING, here, "hm", "");
              })},
             {"no numbers", Seen::maybe,
              one([](PostOutput& o) { o.file("a", "LIN {X nan,Y inf}\n"); })}}));
    for (const auto& one_of : all) one_of(to);
    return {};
  }

 private:
  /// A view of nothing that has a length.
  static std::string_view no_text() {
    std::string_view none("12345");
    const char* nowhere = nullptr;
    // Where the pointer lies in it.
    for (std::size_t at = 0; at + sizeof nowhere <= sizeof none; at += sizeof nowhere) {
      const char* is = nullptr;
      std::memcpy(&is, reinterpret_cast<const char*>(&none) + at, sizeof is);
      if (is != none.data()) continue;
      std::memcpy(reinterpret_cast<char*>(&none) + at, &nowhere, sizeof nowhere);
      break;
    }
    return none;
  }
  struct Kept final : PostOutput {
    void file(std::string_view name, std::string_view bytes) override {
      all.emplace_back(
          [n = std::string(name), b = std::string(bytes)](PostOutput& o) { o.file(n, b); });
    }
    void from(std::string_view file, std::uint32_t line, const rmp_span& span) override {
      all.emplace_back(
          [f = std::string(file), line, span](PostOutput& o) { o.from(f, line, span); });
    }
    void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
               std::string_view hint) override {
      all.emplace_back([severity, span, m = std::string(message),
                        h = std::string(hint)](PostOutput& o) { o.fault(severity, span, m, h); });
    }
    std::vector<std::function<void(PostOutput&)>> all;
  };
  mutable PostCapabilities lied_;
};

/// Draws nothing, in the size that was asked for.
class LyingRenderer final : public render::Renderer {
 public:
  Result<render::Image> draw(const render::Scene&, const render::Options& o,
                             Progress& p) const override {
    using render::Image;
    return liar().answer<Image>(
        "renderer.draw", &p,
        [&]() -> Result<Image> {
          Image i;
          i.width = o.width, i.height = o.height;
          i.rgba.assign(4U * static_cast<std::size_t>(o.width) * static_cast<std::size_t>(o.height),
                        255);
          i.clip_T_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
          return i;
        },
        {{"no pixels", Seen::surely, [](Image& i) { i.rgba.clear(); }},
         {"a pixel too few", Seen::surely, [](Image& i) { i.rgba.pop_back(); }},
         {"another size", Seen::surely, [](Image& i) { i.width = -i.width, i.height = 1 << 30; }},
         {"a projection that is none", Seen::maybe,
          [](Image& i) { i.clip_T_world[liar().pick(16)] = liar().no_number(); }}});
  }
  Result<std::string> png(const render::Image&) const override {
    return liar().answer<std::string>(
        "renderer.png", nullptr,
        []() -> Result<std::string> { return std::string("\x89PNG\r\n\x1a\n rest"); },
        {{"nothing", Seen::surely, [](std::string& s) { s.clear(); }},
         {"no PNG", Seen::surely, [](std::string& s) { s = liar().wild_text(); }}});
  }
};

}  // namespace robomosp::test
