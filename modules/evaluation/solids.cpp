// SPDX-License-Identifier: Apache-2.0
#include "evaluation/solids.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include <robomosp/sdk/csg_check.h>
#include <robomosp/sdk/csg_primitive.h>

#include "evaluation/csg_tree.h"
#include "evaluation/leaves.h"
#include "evaluation/plain_mesh.h"
#include "geometry/mesh_checks.h"
#include "kernel/file_stamp.h"
#include "kernel/provider_guard.h"
#include "kernel/text.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::evaluation {
namespace {

using document::Snapshot;
using text::quote;

using ShapePtr = std::shared_ptr<const CsgShape>;

constexpr std::size_t kShapeBytesPerNode = 16'384;  ///< an engine's solid, about
/// Distance of the triangles from the exact solid that they stand for, by its size.
constexpr double kTrianglesBySize = 1e-4;
/// Relative rounding of the coordinates of display meshes, which are in single precision.
constexpr double kSinglePrecision = 6e-8;

Error broken(const std::string& provider, const std::string& what) {
  return error(ErrorCode::plugin_failed, "provider " + quote(provider) + " " + what,
               "Report it to the provider's author or choose another provider.");
}

bool is_finite(const Moments& m) {
  return std::isfinite(m.volume) && std::isfinite(m.area) && spatial::is_finite(m.first) &&
         spatial::is_finite(m.second) && std::isfinite(m.relative_error);
}

/// A sentence about what is wrong with a mesh a provider made, or "".
std::string mesh_fault(const Mesh& m, bool must_be_closed) {
  if (m.positions.size() % 3 != 0 || m.triangles.size() % 3 != 0)
    return "made a mesh with incomplete vertices or triangles";
  if (m.normals.size() != m.positions.size())
    return "made a mesh with " + std::to_string(m.normals.size() / 3) + " normals for " +
           std::to_string(m.positions.size() / 3) + " vertices";
  if (m.triangles.empty()) return "made a mesh without triangles";
  for (const auto* numbers : {&m.positions, &m.normals, &m.edge_points})
    for (const float v : *numbers)
      if (!std::isfinite(v)) return "made a mesh with numbers that are not finite";
  for (const auto i : m.triangles)
    if (i >= m.vertex_count()) return "made a mesh with triangles that refer to missing vertices";
  std::size_t edge_points = 0;
  for (const auto n : m.edge_sizes) edge_points += n;
  if (edge_points * 3 != m.edge_points.size())
    return "made a mesh with the wrong number of edge points";
  for (const auto& f : m.faces)
    if (std::size_t{f.first_triangle} + f.triangle_count > m.triangle_count())
      return "made a mesh with faces beyond its triangles";
  if (!must_be_closed) return "";
  const auto report = geometry::check(m);
  return report.is_closed ? "" : "made an open mesh: " + report.problem;
}

bool has_tag(const ProviderInfo& info, std::string_view tag) {
  return std::find(info.tags.begin(), info.tags.end(), tag) != info.tags.end();
}

bool holds_mesh(const CsgTree& tree) {
  return std::any_of(tree.nodes.begin(), tree.nodes.end(), [](const CsgNode& n) {
    return n.kind == CsgKind::imported && n.geometry && n.geometry->form == CsgGeometry::Form::mesh;
  });
}

/// Imported exact solids, and fillets and chamfers of what holds no mesh; the outermost of them.
std::vector<bool> needs_exact_engine(const CsgTree& tree) {
  std::vector<bool> has_mesh(tree.nodes.size()), needs(tree.nodes.size());
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {
    const CsgNode& n = tree.nodes[i];
    const bool is_brep = n.geometry && n.geometry->form == CsgGeometry::Form::brep;
    if (n.kind == CsgKind::imported) {
      has_mesh[i] = n.geometry && !is_brep;
      needs[i] = is_brep;
    }
    if (n.kind == CsgKind::fillet || n.kind == CsgKind::chamfer) needs[i] = !has_mesh[i];
    if (n.parent >= 0 && has_mesh[i]) has_mesh[static_cast<std::size_t>(n.parent)] = true;
  }
  return needs;
}

/// Of the files of all engines, as one stands in for another: what they make may differ where these
/// do. None where an engine has no file to tell its build by.
std::optional<Fingerprint> build_of_engines(const Registry& registry) {
  namespace fs = std::filesystem;
  Fingerprinter fp("engines/1");
  for (const ProviderInfo& info : registry.list(CsgEngine::kInterfaceId)) {
    if (!info.enabled) continue;
    fp.add(std::string_view(info.name)).add(std::string_view(info.version));
    const fs::path door = info.origin;
    if (!add_file_stamp(fp, door)) return std::nullopt;
    (void)add_file_stamp(fp, door.parent_path() / "lazy" / door.filename());
  }
  return fp.finish();
}

/// An engine that is made when something is asked of it: opening one takes longer than reading all
/// that it made in the run before.
class LateEngine final : public CsgEngine {
 public:
  LateEngine(const Registry& registry, std::string name)
      : registry_(registry), name_(std::move(name)) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    const auto e = own();
    return e.ok() ? (*e)->extension(id) : nullptr;
  }
  Result<std::shared_ptr<const CsgShape>> evaluate(const CsgTree& tree,
                                                   Progress& progress) const override {
    RMP_TRY_ASSIGN(const auto e, own());
    return e->evaluate(tree, progress);
  }
  Result<Mesh> mesh(const CsgShape& s, const MeshQuality& q, Progress& progress) const override {
    RMP_TRY_ASSIGN(const auto e, own());
    return e->mesh(s, q, progress);
  }
  Result<Moments> moments(const CsgShape& s, Progress& progress) const override {
    RMP_TRY_ASSIGN(const auto e, own());
    return e->moments(s, progress);
  }
  Result<Partition> partition(std::span<const PlacedShape> parts,
                              Progress& progress) const override {
    RMP_TRY_ASSIGN(const auto e, own());
    return e->partition(parts, progress);
  }
  Result<std::vector<CsgFeature>> features(const CsgShape& s, Progress& progress) const override {
    RMP_TRY_ASSIGN(const auto e, own());
    return e->features(s, progress);
  }
  Result<CsgProfile> section(const CsgShape& s, const Pose& plane, double chord,
                             Progress& progress) const override {
    RMP_TRY_ASSIGN(const auto e, own());
    return e->section(s, plane, chord, progress);
  }
  Result<CsgGeometry> geometry(const CsgShape& s, Progress& progress) const override {
    RMP_TRY_ASSIGN(const auto e, own());
    return e->geometry(s, progress);
  }

 private:
  Result<std::shared_ptr<CsgEngine>> own() const {
    const std::lock_guard lock(mutex_);
    if (!made_) {
      RMP_TRY_ASSIGN(made_, registry_.create<CsgEngine>(name_));
    }
    return made_;
  }
  const Registry& registry_;
  std::string name_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<CsgEngine> made_;  // guarded by mutex_
};

/// A solid that was made in a run before; what more is asked of it has its engine make it again.
class KnownShape final : public CsgShape {
 public:
  KnownShape(SolidFacts facts, CsgTree of) : tree(std::move(of)), facts_(std::move(facts)) {}
  [[nodiscard]] std::array<Vec3, 2> bounds() const override { return facts_.bounds; }
  [[nodiscard]] std::span<const std::string> notes() const override { return facts_.notes; }
  const CsgTree tree;

 private:
  SolidFacts facts_;
};

}  // namespace

std::size_t mesh_bytes(const Mesh& m) {
  return sizeof(Mesh) +
         4 * (m.positions.size() + m.normals.size() + m.triangles.size() + m.edge_points.size() +
              m.edge_sizes.size()) +
         sizeof(Mesh::Face) * m.faces.size();
}

Result<std::array<Vec3, 2>> placed_box(const MadeSolid& solid, const Pose& placement) {
  RMP_TRY_ASSIGN(const auto own, asked(solid.engine.name, [&]() -> Result<std::array<Vec3, 2>> {
                   return solid.shape->bounds();
                 }));
  if (!spatial::is_finite(own[0]) || !spatial::is_finite(own[1]))
    return broken(solid.engine.name, "returned bounds that are not finite numbers");
  for (std::size_t i = 0; i < 3; ++i)
    if (own[0][i] > own[1][i])
      return broken(solid.engine.name, "returned bounds with the lower corner above the upper one");
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::array<Vec3, 2> box{{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}};
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Vec3 p = spatial::transform(
        placement, {own[corner & 1U][0], own[(corner >> 1U) & 1U][1], own[(corner >> 2U) & 1U][2]});
    for (std::size_t i = 0; i < 3; ++i) {
      box[0][i] = std::min(box[0][i], p[i]);
      box[1][i] = std::max(box[1][i], p[i]);
    }
  }
  return box;
}

template <class Find>
Result<SolidEngine> Solids::engine(Known& slot, Find&& find) {
  const std::uint64_t revision = registry_.revision();
  {
    const std::lock_guard lock(mutex_);
    if (slot.engine && slot.revision == revision) return *slot.engine;
  }
  RMP_TRY_ASSIGN(const ProviderInfo info, find());
  std::optional<Fingerprint> build;
  if (files_ && cache_.is_enabled()) build = build_of_engines(registry_);
  std::shared_ptr<CsgEngine> csg;
  if (build) {
    csg = std::make_shared<LateEngine>(registry_, info.name);
  } else {
    RMP_TRY_ASSIGN(csg, registry_.create<CsgEngine>(info.name));
  }
  const std::lock_guard lock(mutex_);
  slot = {SolidEngine{std::move(csg), info.name, info.version, build, has_tag(info, "mesh"), false},
          revision};
  return *slot.engine;
}

Result<SolidEngine> Solids::engine() {
  return engine(known_, [this] { return registry_.find(CsgEngine::kInterfaceId, ""); });
}

Result<SolidEngine> Solids::mesh_engine() {
  return engine(known_mesh_, [this]() -> Result<ProviderInfo> {
    for (ProviderInfo& info : registry_.list(CsgEngine::kInterfaceId))
      if (info.enabled && has_tag(info, "mesh")) return std::move(info);
    return error(ErrorCode::unsupported, "no CSG engine for triangle meshes is loaded",
                 "Load the plugin csg_cgal, or use an exact solid.");
  });
}

Result<SolidEngine> Solids::exact_engine() {
  RMP_TRY_ASSIGN(SolidEngine e, engine());
  if (!e.is_mesh) return e;
  return engine(known_exact_, [this]() -> Result<ProviderInfo> {
    for (ProviderInfo& info : registry_.list(CsgEngine::kInterfaceId))
      if (info.enabled && !has_tag(info, "mesh")) return std::move(info);
    return error(ErrorCode::unsupported, "no CSG engine for exact solids is loaded",
                 "Load the plugin csg_occt, or import the solid as a mesh.");
  });
}

Result<SolidEngine> Solids::engine_for(const CsgTree& tree) {
  RMP_TRY_ASSIGN(SolidEngine e, engine());
  if (!e.is_mesh && holds_mesh(tree)) return mesh_engine();
  return e;
}

Solids::Keys Solids::keys_of(const SolidEngine& e, const CsgTree& tree) {
  Fingerprinter fp("shape/1");
  fp.add(std::string_view(e.name)).add(std::string_view(e.version));
  evaluation::feed(fp, tree);
  const Fingerprint key = fp.finish();
  // A failure names nodes, so equal trees with other names do not share it.
  Fingerprinter failure("shape failure/1");
  failure.add(key);
  for (const CsgNode& n : tree.nodes) failure.add(std::string_view(n.name));
  return {key, failure.finish()};
}

Result<ShapePtr> Solids::evaluate(const SolidEngine& e, const CsgTree& tree, Progress& progress) {
  if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
  auto made = guarded(e.name, [&] { return e.csg->evaluate(tree, progress); });
  if (made.ok() && !*made) return broken(e.name, "returned no solid");
  return made;
}

Result<ShapePtr> Solids::evaluated(const MadeSolid& s, Progress& progress) {
  const auto* known = dynamic_cast<const KnownShape*>(s.shape.get());
  if (!known) return s.shape;
  Fingerprinter fp("evaluated shape/1"), failure("evaluated shape failure/1");
  fp.add(s.key);
  failure.add(keys_of(s.engine, known->tree).failure);
  RMP_TRY_ASSIGN(const auto found, cache_.get<ShapePtr>(
                                       fp.finish(), failure.finish(), progress,
                                       [&] { return evaluate(s.engine, known->tree, progress); },
                                       [&](const ShapePtr&) {
                                         return kShapeBytesPerNode * known->tree.nodes.size();
                                       }));
  return *found;
}

Result<MadeSolid> Solids::shape(SolidEngine e, const CsgTree& tree, Progress& progress) {
  const Keys keys = keys_of(e, tree);
  RMP_TRY_ASSIGN(
      auto found,
      cache_.get<ShapePtr>(
          keys.value, keys.failure, progress,
          [&]() -> Result<ShapePtr> {
            if (SolidFacts facts; from_files("solid", e, keys.value, facts))
              return ShapePtr(std::make_shared<const KnownShape>(std::move(facts), tree));
            const auto begin = std::chrono::steady_clock::now();
            auto made = evaluate(e, tree, progress);
            if (!made.ok() || !uses_files(e)) return made;
            const auto took = std::chrono::steady_clock::now() - begin;
            const auto box = placed_box({*made, keys.value, e, ""}, {});
            const auto notes = (*made)->notes();
            if (box.ok())
              to_files("solid", e, keys.value,
                       SolidFacts{(*made)->bounds(), {notes.begin(), notes.end()}}, took);
            return made;
          },
          [&](const ShapePtr&) { return kShapeBytesPerNode * tree.nodes.size(); }));
  return MadeSolid{*found, keys.value, std::move(e), ""};
}

Result<MadeSolid> Solids::shape(const CsgTree& tree, Progress& progress) {
  const auto found = engine_for(tree);
  if (!found.ok())
    return is_plain_mesh(tree) ? as_it_is(tree, found.error(), progress) : found.error();
  const SolidEngine& e = *found;
  if (e.is_mesh) {
    auto made = shape_of_triangles(e, tree, progress);
    if (made.ok() || made.error().code == ErrorCode::cancelled || !is_plain_mesh(tree)) return made;
    return as_it_is(tree, made.error(), progress);
  }
  auto made = shape(e, tree, progress);
  if (made.ok() || made.error().code != ErrorCode::plugin_failed) return made;
  auto rough = stand_in(tree, made.error(), progress);
  if (rough.ok() || rough.error().code == ErrorCode::cancelled) return rough;
  return made;
}

Result<MadeSolid> Solids::as_it_is(const CsgTree& tree, const Error& why, Progress& progress) {
  static const SolidEngine plain{plain_engine(), "plain mesh", "1", {}, true, true};
  const Keys keys = keys_of(plain, tree);
  RMP_TRY_ASSIGN(auto found, cache_.get<ShapePtr>(
                                 keys.value, keys.failure, progress,
                                 [&]() -> Result<ShapePtr> { return plain_shape(tree, why); },
                                 [&](const ShapePtr&) {
                                   const CsgGeometry& g = *tree.nodes.back().geometry;
                                   return 8 * g.points.size() + 4 * g.triangles.size();
                                 }));
  return MadeSolid{*found, keys.value, plain, ""};
}

Result<MadeSolid> Solids::shape_of_triangles(SolidEngine e, const CsgTree& tree,
                                             Progress& progress) {
  const std::vector<bool> only_exact = needs_exact_engine(tree);
  if (std::none_of(only_exact.begin(), only_exact.end(), [](bool b) { return b; }))
    return shape(std::move(e), tree, progress);
  RMP_TRY_ASSIGN(const SolidEngine exact, exact_engine());
  CsgTree triangles;
  std::vector<std::int32_t> number(tree.nodes.size(), -1);  // -1 = inside a replaced branch
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    CsgNode node = tree.nodes[i];
    if (node.parent >= 0) {
      node.parent = number[static_cast<std::size_t>(node.parent)];
      if (node.parent < 0) continue;
    }
    if (only_exact[i]) {
      RMP_TRY_ASSIGN(node.geometry, triangulated(exact, branch_of(tree, i).tree, progress));
      node.kind = CsgKind::imported;
      node.sizes = {1};
      node.select.clear();
    } else {
      number[i] = static_cast<std::int32_t>(triangles.nodes.size());
    }
    triangles.nodes.push_back(std::move(node));
  }
  return shape(std::move(e), triangles, progress);
}

Result<std::shared_ptr<const CsgGeometry>> Solids::triangulated(const SolidEngine& exact,
                                                                const CsgTree& branch,
                                                                Progress& progress) {
  RMP_TRY_ASSIGN(const MadeSolid s, shape(exact, branch, progress));
  RMP_TRY_ASSIGN(const auto box, placed_box(s, {}));
  const double chord = kTrianglesBySize * spatial::distance(box[0], box[1]);
  Fingerprinter fp("triangulated/1");
  fp.add(s.key).add(chord);
  const Fingerprint key = fp.finish();
  return cache_.get<CsgGeometry>(
      key, key, progress,
      [&]() -> Result<CsgGeometry> {
        RMP_TRY_ASSIGN(const auto m, mesh(s, chord, progress));
        double farthest = 0;
        for (const Vec3& corner : box)
          for (const double x : corner) farthest = std::max(farthest, std::fabs(x));
        CsgGeometry out;
        out.form = CsgGeometry::Form::mesh;
        out.points.assign(m->positions.begin(), m->positions.end());
        out.triangles = m->triangles;
        out.deviation = chord + kSinglePrecision * farthest;
        out.digest = {key.hi, key.lo};
        return out;
      },
      [](const CsgGeometry& g) {
        return sizeof(CsgGeometry) + 8 * g.points.size() + 4 * g.triangles.size();
      });
}

Result<MadeSolid> Solids::stand_in(const CsgTree& tree, const Error& why, Progress& progress) {
  RMP_TRY_ASSIGN(SolidEngine e, mesh_engine());
  RMP_TRY_ASSIGN(MadeSolid rough, shape_of_triangles(std::move(e), tree, progress));
  rough.stand_in = stand_in_text(why);
  return rough;
}

std::string Solids::stand_in_text(const Error& why) {
  return "shown as an approximation: " + why.sentence();
}

Result<CsgTree> Solids::tree_of(const model::Solid& solid, Progress& progress) {
  return evaluation::tree_of(
      solid, [&](const model::SolidNode& node) -> Result<std::shared_ptr<const CsgTree>> {
        RMP_TRY_ASSIGN(const ProviderInfo info,
                       registry_.find(CsgPrimitive::kInterfaceId, node.primitive.name));
        Fingerprinter fp("primitive/1");
        fp.add(std::string_view(info.name)).add(std::string_view(info.version));
        fp.add(static_cast<std::int64_t>(registry_.revision()));
        for (const auto& [name, param] : node.primitive.params) {
          fp.add(std::string_view(name)).add(param.index());
          std::visit(
              [&](const auto& v) {
                using T = std::decay_t<decltype(v)>;
                if constexpr (std::is_same_v<T, std::string>) fp.add(std::string_view(v));
                else if constexpr (std::is_same_v<T, std::vector<double>>)
                  fp.add(std::span<const double>(v));
                else fp.add(v);
              },
              param);
        }
        const Fingerprint key = fp.finish();
        return cache_.get<CsgTree>(
            key, key, progress,
            [&] { return built_primitive(registry_, info, node.primitive, progress); },
            [](const CsgTree& t) { return sizeof(CsgNode) * t.nodes.size(); });
      });
}

Fingerprint Solids::mesh_key(const Fingerprint& shape, const MeshQuality& quality) {
  Fingerprinter fp("mesh/1");
  fp.add(shape).add(quality.chord).add(quality.angle);
  return fp.finish();
}

Result<std::shared_ptr<const Mesh>> Solids::mesh(const MadeSolid& s, double chord,
                                                 Progress& progress) {
  MeshQuality quality;
  quality.chord = chord;
  const Fingerprint key = mesh_key(s.key, quality);
  return kept<Mesh>(
      "mesh", s.engine, key, progress,
      [&]() -> Result<Mesh> {
        RMP_TRY_ASSIGN(const ShapePtr own, evaluated(s, progress));
        auto made =
            guarded(s.engine.name, [&] { return s.engine.csg->mesh(*own, quality, progress); });
        if (made.ok())
          if (const std::string fault = mesh_fault(*made, !s.engine.is_plain); !fault.empty())
            return broken(s.engine.name, fault);
        return made;
      },
      mesh_bytes);
}

Result<std::shared_ptr<const Mesh>> Solids::mesh(const CsgTree& tree, double chord,
                                                 Progress& progress) {
  RMP_TRY_ASSIGN(const MadeSolid s, shape(tree, progress));
  auto made = mesh(s, chord, progress);
  if (made.ok() || s.engine.is_mesh || made.error().code != ErrorCode::plugin_failed) return made;
  const auto rough = stand_in(tree, made.error(), progress);
  if (!rough.ok()) return rough.error().code == ErrorCode::cancelled ? rough.error() : made;
  auto other = mesh(*rough, chord, progress);
  return other.ok() || other.error().code == ErrorCode::cancelled ? std::move(other) : made;
}

Result<Moments> Solids::moments(const MadeSolid& s, Progress& progress) {
  Fingerprinter fp("moments/1");
  fp.add(s.key);
  const Fingerprint key = fp.finish();
  RMP_TRY_ASSIGN(
      auto found,
      kept<Moments>(
          "moments", s.engine, key, progress,
          [&]() -> Result<Moments> {
            RMP_TRY_ASSIGN(const ShapePtr own, evaluated(s, progress));
            auto made =
                guarded(s.engine.name, [&] { return s.engine.csg->moments(*own, progress); });
            if (made.ok() && !is_finite(*made))
              return broken(s.engine.name, "returned moments that are not finite numbers");
            const bool is_fine =
                made.ok() && (s.engine.is_plain ? made->volume >= 0 : made->volume > 0);
            if (made.ok() && !is_fine)
              return broken(s.engine.name,
                            "returned a volume of " + text::print(made->volume) + " m^3");
            return made;
          },
          [](const Moments&) { return sizeof(Moments); }));
  return *found;
}

Result<std::shared_ptr<const std::vector<CsgFeature>>> Solids::features(const MadeSolid& s,
                                                                        Progress& progress) {
  Fingerprinter fp("features/1");
  fp.add(s.key);
  const Fingerprint key = fp.finish();
  return kept<std::vector<CsgFeature>>(
      "features", s.engine, key, progress,
      [&]() -> Result<std::vector<CsgFeature>> {
        RMP_TRY_ASSIGN(const ShapePtr own, evaluated(s, progress));
        return guarded(s.engine.name, [&] { return s.engine.csg->features(*own, progress); });
      },
      [](const std::vector<CsgFeature>& all) { return sizeof(CsgFeature) * all.size(); });
}

Result<std::shared_ptr<const std::vector<CsgEdge>>> Solids::edges(const MadeSolid& s, double chord,
                                                                  Progress& progress) {
  const auto* known = static_cast<const CsgEdges*>(s.engine.csg->extension(CsgEdges::kExtensionId));
  if (!known)
    return error(ErrorCode::unsupported,
                 s.engine.is_plain ? "a mesh that is not a valid solid has no edges"
                                   : "a solid made of triangles has no curved edges",
                 "Use a solid without imported meshes.");
  Fingerprinter fp("edges/1");
  fp.add(s.key).add(chord);
  const Fingerprint key = fp.finish();
  return cache_.get<std::vector<CsgEdge>>(
      key, key, progress,
      [&]() -> Result<std::vector<CsgEdge>> {
        RMP_TRY_ASSIGN(const ShapePtr own, evaluated(s, progress));
        return guarded(s.engine.name, [&] { return known->edges(*own, chord, progress); });
      },
      [](const std::vector<CsgEdge>& all) {
        std::size_t bytes = sizeof(CsgEdge) * all.size();
        for (const CsgEdge& e : all) bytes += sizeof(CsgEdgePoint) * e.points.size();
        return bytes;
      });
}

Result<const model::Solid*> Solids::solid_of(const Snapshot& s, SolidId id) {
  const auto* solid = s.get(id);
  if (!solid) return stale(s, id);
  if (solid->nodes.empty())
    return error(ErrorCode::invalid_argument, "it has no nodes",
                 "Add a primitive such as a box to it.", s.describe(id));
  return solid;
}

Result<CsgTree> Solids::tree_of(const Snapshot& s, SolidId id, Progress& progress) {
  RMP_TRY_ASSIGN(const auto* solid, solid_of(s, id));
  return tree_of(*solid, progress).in(s.describe(id));
}

Result<MadeSolid> Solids::shape(const Snapshot& s, SolidId id, Progress& progress) {
  RMP_TRY_ASSIGN(const CsgTree tree, tree_of(s, id, progress));
  return shape(tree, progress).in(s.describe(id));
}

Result<std::shared_ptr<const CsgProfile>> Solids::section(const MadeSolid& s, const Pose& plane,
                                                          double chord, Progress& progress) {
  for (const double x : plane.p)
    if (!(std::fabs(x) <= kCsgGreatestLength))
      return error(ErrorCode::invalid_argument,
                   "the plane is " + text::print(std::fabs(x)) + " m away; it must be within " +
                       text::print(kCsgGreatestLength) + " m",
                   "Place it at the solid.");
  Fingerprinter fp("section/1");
  fp.add(s.key).add(chord);
  evaluation::feed(fp, plane);
  const Fingerprint key = fp.finish();
  return cache_.get<CsgProfile>(
      key, key, progress,
      [&]() -> Result<CsgProfile> {
        RMP_TRY_ASSIGN(const ShapePtr own, evaluated(s, progress));
        auto made = guarded(s.engine.name,
                            [&] { return s.engine.csg->section(*own, plane, chord, progress); });
        if (made.ok())
          for (const CsgLoop& loop : made->loops)
            for (const CsgCurve& curve : loop.curves)
              for (const auto& p : curve.points)
                if (!std::isfinite(p[0]) || !std::isfinite(p[1]))
                  return broken(s.engine.name,
                                "returned a section with numbers that are not finite");
        return made;
      },
      [](const CsgProfile& profile) {
        std::size_t bytes = sizeof(CsgProfile);
        for (const CsgLoop& loop : profile.loops) bytes += 80 * (1 + loop.curves.size());
        return bytes;
      });
}

Result<std::shared_ptr<const CsgGeometry>> Solids::geometry(const MadeSolid& s,
                                                            Progress& progress) {
  Fingerprinter fp("solid geometry/1");
  fp.add(s.key);
  const Fingerprint key = fp.finish();
  return cache_.get<CsgGeometry>(
      key, key, progress,
      [&]() -> Result<CsgGeometry> {
        RMP_TRY_ASSIGN(const ShapePtr own, evaluated(s, progress));
        auto made = guarded(s.engine.name, [&] { return s.engine.csg->geometry(*own, progress); });
        if (!made.ok()) return made;
        // As io::make_geometry() does: equal content, equal digest.
        Fingerprinter content("geometry/1");
        content.add(static_cast<int>(made->form));
        if (made->form == CsgGeometry::Form::brep) {
          content.add(std::string_view(made->brep));
        } else {
          content.add(std::span<const double>(made->points));
          content.add(std::string_view(reinterpret_cast<const char*>(made->triangles.data()),
                                       made->triangles.size() * sizeof(std::uint32_t)));
        }
        const Fingerprint digest = content.finish();
        made->digest = {digest.hi, digest.lo};
        return made;
      },
      [](const CsgGeometry& g) {
        return sizeof(CsgGeometry) + g.brep.size() + 8 * g.points.size() + 4 * g.triangles.size();
      });
}

Result<CsgEngine::Partition> Solids::partition(const std::vector<MadeSolid>& shapes,
                                               const std::vector<Pose>& poses, Progress& progress) {
  const SolidEngine& e = shapes.front().engine;
  Fingerprinter fp("partition/1");
  fp.add(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    fp.add(shapes[i].key);
    evaluation::feed(fp, poses[i]);
  }
  const Fingerprint key = fp.finish();
  RMP_TRY_ASSIGN(
      auto found,
      kept<CsgEngine::Partition>(
          "partition", e, key, progress,
          [&]() -> Result<CsgEngine::Partition> {
            std::vector<PlacedShape> placed;
            for (std::size_t i = 0; i < shapes.size(); ++i) {
              RMP_TRY_ASSIGN(const ShapePtr own, evaluated(shapes[i], progress));
              placed.push_back({own, poses[i]});
            }
            auto made = guarded(e.name, [&] { return e.csg->partition(placed, progress); });
            if (!made.ok()) return made;
            if (made->parts.size() != placed.size())
              return broken(e.name, "returned " + std::to_string(made->parts.size()) +
                                        " parts for " + std::to_string(placed.size()));
            if (!std::isfinite(made->overlap) ||
                !std::all_of(made->parts.begin(), made->parts.end(), is_finite))
              return broken(e.name, "returned moments that are not finite numbers");
            return made;
          },
          [](const CsgEngine::Partition& p) { return sizeof(Moments) * p.parts.size(); }));
  return *found;
}

}  // namespace robomosp::evaluation
