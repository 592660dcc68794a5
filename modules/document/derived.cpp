// SPDX-License-Identifier: Apache-2.0
#include "document/derived.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include <robomosp/sdk/csg_primitive.h>

#include "document/cache.h"
#include "document/csg_tree.h"
#include "document/digest.h"
#include "geometry/mesh_checks.h"
#include "kernel/fingerprint.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "robotics/build_model.h"
#include "robotics/skin.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::document {

namespace {

using text::quote;

constexpr std::size_t kMostLeaves = 100'000;  ///< solids in one object, nested ones included
constexpr double kSkinChord = 2e-4;           ///< tessellation of generated bodies [m]
constexpr double kSkinShininess = 0.4;
constexpr std::size_t kShapeBytesPerNode = 16'384;  ///< an engine's solid, about
/// Distance of the triangles from the exact solid that they stand for, by its size.
constexpr double kTrianglesBySize = 1e-4;
/// Relative rounding of the coordinates of display meshes, which are in single precision.
constexpr double kSinglePrecision = 6e-8;

using ShapePtr = std::shared_ptr<const CsgShape>;

Error stale(const Snapshot& s, AnyId id) {
  return error(ErrorCode::stale_handle, s.describe(id) + " does not exist",
               "Look it up again by its name.");
}

/// `object "arm" waits for solid "bore": ...`
Error waits(const Snapshot& s, AnyId who, Error e) {
  e.where = s.describe(who) + (e.where.empty() ? "" : " waits for " + e.where);
  return e;
}

Error broken(const std::string& provider, const std::string& what) {
  return error(ErrorCode::plugin_failed, "provider " + quote(provider) + " " + what,
               "Report it to the provider's author or choose another provider.");
}

bool is_finite(const Moments& m) {
  return std::isfinite(m.volume) && std::isfinite(m.area) && spatial::is_finite(m.first) &&
         spatial::is_finite(m.second) && std::isfinite(m.relative_error);
}

/// A sentence about what is wrong with a mesh a provider made, or "".
std::string fault_of(const Mesh& m) {
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
    if (i >= m.vertex_count()) return "made a mesh whose triangles name vertices that do not exist";
  std::size_t edge_points = 0;
  for (const auto n : m.edge_sizes) edge_points += n;
  if (edge_points * 3 != m.edge_points.size())
    return "made a mesh whose edges have the wrong number of points";
  for (const auto& f : m.faces)
    if (std::size_t{f.first_triangle} + f.triangle_count > m.triangle_count())
      return "made a mesh whose faces exceed its triangles";
  const auto report = geometry::check(m);
  return report.is_closed ? "" : "made an open mesh: " + report.problem;
}

std::size_t mesh_bytes(const Mesh& m) {
  return sizeof(Mesh) +
         4 * (m.positions.size() + m.normals.size() + m.triangles.size() + m.edge_points.size() +
              m.edge_sizes.size()) +
         sizeof(Mesh::Face) * m.faces.size();
}

/// A solid at a place within an object, nested objects resolved.
struct Leaf {
  SolidId solid;
  Pose placement;         ///< outermost_T_solid
  MaterialId material;    ///< resolved; may be none
  std::string name;       ///< "gripper.finger"; a solid's own name when it stands alone
  std::size_t group = 0;  ///< leaves of one group share an object whose overlaps count once
  /// The measured part its mass is in, by number.
  std::optional<std::size_t> measured = std::nullopt;
};

/// A solid or object in an object whose mass was measured.
struct MeasuredPart {
  AnyId what;
  Pose placement;  ///< outermost_T_part
  model::MeasuredMass measured;
};

const std::optional<model::MeasuredMass>* measured_of(const Record& record) {
  if (const auto* solid = std::get_if<model::Solid>(&record.body)) return &solid->measured;
  if (const auto* object = std::get_if<model::Object>(&record.body)) return &object->measured;
  return nullptr;
}

/// All solids of a solid or object in order of listing. The outermost material given wins, and the
/// outermost measured mass below `id`; those go to `measured`.
Result<std::vector<Leaf>> leaves_of(const Snapshot& s, AnyId id,
                                    std::vector<MeasuredPart>& measured) {
  struct Step {
    AnyId what;
    Pose placement;
    MaterialId material;
    std::string name;
    std::optional<std::size_t> group;
    std::optional<std::size_t> measured = std::nullopt;
  };
  std::vector<Leaf> leaves;
  std::size_t groups = 0, steps = 0;
  std::vector<Step> stack{{id, {}, {}, "", std::nullopt}};
  while (!stack.empty()) {
    Step step = std::move(stack.back());
    stack.pop_back();
    if (++steps > kMostLeaves || leaves.size() >= kMostLeaves)
      return error(
          ErrorCode::unsupported,
          "it has more than " + std::to_string(kMostLeaves) + " parts, nested ones included",
          "Divide it into smaller objects.", s.describe(id));
    const Record* record = s.find(step.what);
    if (!record) return stale(s, step.what);
    const auto* mass = measured_of(*record);
    if (steps > 1 && mass && mass->has_value() && !step.measured) {
      step.measured = measured.size();
      measured.push_back({step.what, step.placement, **mass});
    }
    if (const auto* solid = std::get_if<model::Solid>(&record->body)) {
      leaves.push_back({SolidId{step.what.number}, step.placement,
                        step.material ? step.material : solid->material,
                        step.name.empty() ? record->name : std::move(step.name),
                        step.group ? *step.group : groups++, step.measured});
      continue;
    }
    const auto* object = std::get_if<model::Object>(&record->body);
    if (!object)
      return error(ErrorCode::invalid_argument,
                   s.describe(step.what) + " is neither a solid nor an object");
    if (!step.group && object->overlap == model::Overlap::once) step.group = groups++;
    for (auto p = object->parts.rbegin(); p != object->parts.rend(); ++p)
      stack.push_back({p->what, spatial::compose(step.placement, model::pose(p->placement)),
                       step.material ? step.material : p->material,
                       step.name.empty() ? p->name : step.name + "." + p->name, step.group,
                       step.measured});
  }
  return leaves;
}
Result<std::vector<Leaf>> leaves_of(const Snapshot& s, AnyId id) {
  std::vector<MeasuredPart> measured;
  return leaves_of(s, id, measured);
}

void note(BodyMass& sum, std::string text) {
  if (std::find(sum.notes.begin(), sum.notes.end(), text) == sum.notes.end())
    sum.notes.push_back(std::move(text));
}

}  // namespace

struct Derived::Impl {
  Impl(const Registry& r, std::size_t budget) : registry(r), cache(budget) {}

  /// The CSG provider in use and its part of every key.
  struct Engine {
    std::shared_ptr<CsgEngine> csg;
    std::string name, version;
    bool is_mesh = false;  ///< works on triangles throughout
  };
  struct Shape {
    ShapePtr shape;
    Fingerprint key;
    Engine engine;
    std::string stand_in;  ///< why it is an approximation by another engine; "" = it is not
  };

  static bool has_tag(const ProviderInfo& info, std::string_view tag) {
    return std::find(info.tags.begin(), info.tags.end(), tag) != info.tags.end();
  }

  Result<Engine> engine() {
    return engine(known, [this] { return registry.find(CsgEngine::kInterfaceId, ""); });
  }
  /// The engine for imported meshes; made when first needed.
  Result<Engine> mesh_engine() {
    return engine(known_mesh, [this]() -> Result<ProviderInfo> {
      for (ProviderInfo& info : registry.list(CsgEngine::kInterfaceId))
        if (info.enabled && has_tag(info, "mesh")) return std::move(info);
      return error(ErrorCode::unsupported, "no CSG engine that takes triangle meshes is loaded",
                   "Load the plugin csg_cgal, or use an exact solid.");
    });
  }

  /// The engine for exact solids; made when first needed.
  Result<Engine> exact_engine() {
    RMP_TRY_ASSIGN(Engine e, engine());
    if (!e.is_mesh) return e;
    return engine(known_exact, [this]() -> Result<ProviderInfo> {
      for (ProviderInfo& info : registry.list(CsgEngine::kInterfaceId))
        if (info.enabled && !has_tag(info, "mesh")) return std::move(info);
      return error(ErrorCode::unsupported, "no CSG engine that takes exact solids is loaded",
                   "Load the plugin csg_occt, or import the solid as a mesh.");
    });
  }

  struct Known {
    std::optional<Engine> engine;
    std::uint64_t revision = 0;
  };
  template <class Find>
  Result<Engine> engine(Known& slot, Find&& find) {
    const std::uint64_t revision = registry.revision();
    {
      const std::lock_guard lock(mutex);
      if (slot.engine && slot.revision == revision) return *slot.engine;
    }
    RMP_TRY_ASSIGN(const ProviderInfo info, find());
    RMP_TRY_ASSIGN(auto csg, registry.create<CsgEngine>(info.name));
    const std::lock_guard lock(mutex);
    slot = {Engine{std::move(csg), info.name, info.version, has_tag(info, "mesh")}, revision};
    return *slot.engine;
  }

  static bool holds_mesh(const CsgTree& tree) {
    return std::any_of(tree.nodes.begin(), tree.nodes.end(), [](const CsgNode& n) {
      return n.kind == CsgKind::imported && n.geometry &&
             n.geometry->form == CsgGeometry::Form::mesh;
    });
  }
  Result<Engine> engine_for(const CsgTree& tree) {
    RMP_TRY_ASSIGN(Engine e, engine());
    if (!e.is_mesh && holds_mesh(tree)) return mesh_engine();
    return e;
  }

  struct Keys {
    Fingerprint value, failure;
  };
  static Keys keys_of(const Engine& e, const CsgTree& tree) {
    Fingerprinter fp("shape/1");
    fp.add(std::string_view(e.name)).add(std::string_view(e.version));
    document::feed(fp, tree);
    const Fingerprint key = fp.finish();
    // A failure names nodes, so equal trees with other names do not share it.
    Fingerprinter failure("shape failure/1");
    failure.add(key);
    for (const CsgNode& n : tree.nodes) failure.add(std::string_view(n.name));
    return {key, failure.finish()};
  }

  Result<Shape> shape(Engine e, const CsgTree& tree, Progress& progress) {
    const Keys keys = keys_of(e, tree);
    RMP_TRY_ASSIGN(auto found,
                   cache.get<ShapePtr>(
                       keys.value, keys.failure,
                       [&]() -> Result<ShapePtr> {
                         if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
                         auto made =
                             guarded(e.name, [&] { return e.csg->evaluate(tree, progress); });
                         if (made.ok() && !*made) return broken(e.name, "returned no solid");
                         return made;
                       },
                       [&](const ShapePtr&) { return kShapeBytesPerNode * tree.nodes.size(); }));
    return Shape{*found, keys.value, std::move(e), ""};
  }

  /// By the engine that suits the tree. Where the exact one could not verify its result, by the one
  /// that works on triangles.
  Result<Shape> shape(const CsgTree& tree, Progress& progress) {
    RMP_TRY_ASSIGN(const Engine e, engine_for(tree));
    if (e.is_mesh) return shape_of_triangles(e, tree, progress);
    auto made = shape(e, tree, progress);
    if (made.ok() || made.error().code != ErrorCode::plugin_failed) return made;
    auto rough = stand_in(tree, made.error(), progress);
    if (rough.ok() || rough.error().code == ErrorCode::cancelled) return rough;
    return made;
  }

  /// By an engine for triangles; what only an exact engine can make comes to it as a mesh that
  /// states how far it may be off.
  Result<Shape> shape_of_triangles(Engine e, const CsgTree& tree, Progress& progress) {
    const std::vector<bool> only_exact = needs_exact_engine(tree);
    if (std::none_of(only_exact.begin(), only_exact.end(), [](bool b) { return b; }))
      return shape(std::move(e), tree, progress);
    RMP_TRY_ASSIGN(const Engine exact, exact_engine());
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

  /// Imported exact solids, and fillets and chamfers of what holds no mesh; the outermost of them.
  static std::vector<bool> needs_exact_engine(const CsgTree& tree) {
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

  /// The closed mesh of an exact solid in its own frame.
  Result<std::shared_ptr<const CsgGeometry>> triangulated(const Engine& exact,
                                                          const CsgTree& branch,
                                                          Progress& progress) {
    RMP_TRY_ASSIGN(const Shape s, shape(exact, branch, progress));
    RMP_TRY_ASSIGN(const auto box, placed_box(s, {}));
    const double chord = kTrianglesBySize * spatial::distance(box[0], box[1]);
    Fingerprinter fp("triangulated/1");
    fp.add(s.key).add(chord);
    const Fingerprint key = fp.finish();
    return cache.get<CsgGeometry>(
        key, key,
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

  Result<Shape> stand_in(const CsgTree& tree, const Error& why, Progress& progress) {
    RMP_TRY_ASSIGN(Engine e, mesh_engine());
    RMP_TRY_ASSIGN(Shape rough, shape_of_triangles(std::move(e), tree, progress));
    rough.stand_in = "shown as an approximation: " + why.sentence();
    return rough;
  }

  /// The tree that engines see, plugins' primitives made.
  Result<CsgTree> tree_of(const model::Solid& solid, Progress& progress) {
    return document::tree_of(
        solid, [&](const model::SolidNode& node) -> Result<std::shared_ptr<const CsgTree>> {
          RMP_TRY_ASSIGN(const ProviderInfo info,
                         registry.find(CsgPrimitive::kInterfaceId, node.primitive.name));
          Fingerprinter fp("primitive/1");
          fp.add(std::string_view(info.name)).add(std::string_view(info.version));
          fp.add(static_cast<std::int64_t>(registry.revision()));
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
          return cache.get<CsgTree>(
              key, key, [&] { return built_primitive(registry, info, node.primitive, progress); },
              [](const CsgTree& t) { return sizeof(CsgNode) * t.nodes.size(); });
        });
  }

  static Fingerprint mesh_key(const Fingerprint& shape, const MeshQuality& quality) {
    Fingerprinter fp("mesh/1");
    fp.add(shape).add(quality.chord).add(quality.angle);
    return fp.finish();
  }

  Result<std::shared_ptr<const Mesh>> mesh(const Shape& s, double chord, Progress& progress) {
    MeshQuality quality;
    quality.chord = chord;
    const Fingerprint key = mesh_key(s.key, quality);
    return cache.get<Mesh>(
        key, key,
        [&]() -> Result<Mesh> {
          auto made = guarded(s.engine.name,
                              [&] { return s.engine.csg->mesh(*s.shape, quality, progress); });
          if (made.ok())
            if (const std::string fault = fault_of(*made); !fault.empty())
              return broken(s.engine.name, fault);
          return made;
        },
        mesh_bytes);
  }

  Result<std::shared_ptr<const Mesh>> mesh(const CsgTree& tree, double chord, Progress& progress) {
    RMP_TRY_ASSIGN(const Shape s, shape(tree, progress));
    auto made = mesh(s, chord, progress);
    if (made.ok() || s.engine.is_mesh || made.error().code != ErrorCode::plugin_failed) return made;
    const auto rough = stand_in(tree, made.error(), progress);
    if (!rough.ok()) return rough.error().code == ErrorCode::cancelled ? rough.error() : made;
    auto other = mesh(*rough, chord, progress);
    return other.ok() || other.error().code == ErrorCode::cancelled ? std::move(other) : made;
  }

  Result<Moments> moments(const Shape& s, Progress& progress) {
    Fingerprinter fp("moments/1");
    fp.add(s.key);
    const Fingerprint key = fp.finish();
    RMP_TRY_ASSIGN(
        auto found,
        cache.get<Moments>(
            key, key,
            [&]() -> Result<Moments> {
              auto made =
                  guarded(s.engine.name, [&] { return s.engine.csg->moments(*s.shape, progress); });
              if (made.ok() && !is_finite(*made))
                return broken(s.engine.name, "returned moments that are not finite numbers");
              if (made.ok() && !(made->volume > 0))
                return broken(s.engine.name,
                              "returned a volume of " + text::print(made->volume) + " m^3");
              return made;
            },
            [](const Moments&) { return sizeof(Moments); }));
    return *found;
  }

  Result<std::shared_ptr<const std::vector<CsgFeature>>> features(const Shape& s,
                                                                  Progress& progress) {
    Fingerprinter fp("features/1");
    fp.add(s.key);
    const Fingerprint key = fp.finish();
    return cache.get<std::vector<CsgFeature>>(
        key, key,
        [&] {
          return guarded(s.engine.name, [&] { return s.engine.csg->features(*s.shape, progress); });
        },
        [](const std::vector<CsgFeature>& all) { return sizeof(CsgFeature) * all.size(); });
  }

  /// The solid's content, or why there is none to work on.
  static Result<const model::Solid*> solid_of(const Snapshot& s, SolidId id) {
    const auto* solid = s.get(id);
    if (!solid) return stale(s, id);
    if (solid->nodes.empty())
      return error(ErrorCode::invalid_argument, "it has no nodes",
                   "Add a primitive such as a box to it.", s.describe(id));
    return solid;
  }

  Result<CsgTree> tree_of(const Snapshot& s, SolidId id, Progress& progress) {
    RMP_TRY_ASSIGN(const auto* solid, solid_of(s, id));
    return tree_of(*solid, progress).in(s.describe(id));
  }
  Result<Shape> shape(const Snapshot& s, SolidId id, Progress& progress) {
    RMP_TRY_ASSIGN(const CsgTree tree, tree_of(s, id, progress));
    return shape(tree, progress).in(s.describe(id));
  }

  Result<std::shared_ptr<const CsgProfile>> section(const Shape& s, const Pose& plane, double chord,
                                                    Progress& progress) {
    Fingerprinter fp("section/1");
    fp.add(s.key).add(chord);
    document::feed(fp, plane);
    const Fingerprint key = fp.finish();
    return cache.get<CsgProfile>(
        key, key,
        [&]() -> Result<CsgProfile> {
          auto made = guarded(s.engine.name, [&] {
            return s.engine.csg->section(*s.shape, plane, chord, progress);
          });
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

  Result<std::shared_ptr<const CsgGeometry>> geometry(const Shape& s, Progress& progress) {
    Fingerprinter fp("solid geometry/1");
    fp.add(s.key);
    const Fingerprint key = fp.finish();
    return cache.get<CsgGeometry>(
        key, key,
        [&]() -> Result<CsgGeometry> {
          auto made =
              guarded(s.engine.name, [&] { return s.engine.csg->geometry(*s.shape, progress); });
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

  Result<CsgEngine::Partition> partition(const std::vector<Shape>& shapes,
                                         const std::vector<Pose>& poses, Progress& progress) {
    const Engine& e = shapes.front().engine;
    Fingerprinter fp("partition/1");
    fp.add(shapes.size());
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      fp.add(shapes[i].key);
      document::feed(fp, poses[i]);
    }
    const Fingerprint key = fp.finish();
    RMP_TRY_ASSIGN(
        auto found,
        cache.get<CsgEngine::Partition>(
            key, key,
            [&]() -> Result<CsgEngine::Partition> {
              std::vector<PlacedShape> placed;
              for (std::size_t i = 0; i < shapes.size(); ++i)
                placed.push_back({shapes[i].shape, poses[i]});
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

  /// What add_group() found out about one leaf.
  struct Weighed {
    PartMass part;
    double relative_error = 0;
  };

  /// The box around a placed solid.
  static Result<std::array<Vec3, 2>> placed_box(const Shape& shape, const Pose& placement) {
    RMP_TRY_ASSIGN(const auto own, guarded(shape.engine.name, [&]() -> Result<std::array<Vec3, 2>> {
                     return shape.shape->bounds();
                   }));
    if (!spatial::is_finite(own[0]) || !spatial::is_finite(own[1]))
      return broken(shape.engine.name, "returned bounds that are not finite numbers");
    constexpr double kInf = std::numeric_limits<double>::infinity();
    std::array<Vec3, 2> box{{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}};
    for (unsigned corner = 0; corner < 8; ++corner) {
      const Vec3 p = spatial::transform(
          placement,
          {own[corner & 1U][0], own[(corner >> 1U) & 1U][1], own[(corner >> 2U) & 1U][2]});
      for (std::size_t i = 0; i < 3; ++i) {
        box[0][i] = std::min(box[0][i], p[i]);
        box[1][i] = std::max(box[1][i], p[i]);
      }
    }
    return box;
  }

  /// True when boxes show that no two solids of different engines share volume.
  static bool engines_are_apart(const std::vector<Shape>& shapes,
                                const std::vector<const Leaf*>& leaves) {
    std::vector<std::array<Vec3, 2>> boxes;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const auto box = placed_box(shapes[i], leaves[i]->placement);
      if (!box.ok()) return false;
      boxes.push_back(*box);
    }
    constexpr double kTouching = 1e-9;  ///< depth that is rounding of a face on a face [m]
    for (std::size_t a = 0; a < boxes.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        if (shapes[a].engine.name == shapes[b].engine.name) continue;
        bool is_apart = false;
        for (std::size_t i = 0; i < 3; ++i)
          is_apart |=
              std::min(boxes[a][1][i], boxes[b][1][i]) - std::max(boxes[a][0][i], boxes[b][0][i]) <=
              kTouching;
        if (!is_apart) return false;
      }
    return true;
  }

  /// Adds the mass of leaves that share one object with Overlap::once, in the order in which they
  /// claim volume; `group` is put into that order. Leaves whose mass was measured have none of
  /// their own, and are left out when they cannot be made.
  Result<void> add_group(const Snapshot& s, std::vector<const Leaf*>& group,
                         std::vector<Weighed>& parts, BodyMass& sum, Progress& progress) {
    // A material without density is a look only.
    const auto weighs = [&](const Leaf* l) {
      const auto* material = l->material ? s.get(l->material) : nullptr;
      return l->measured || (material && material->density > 0);
    };
    std::stable_partition(group.begin(), group.end(), weighs);
    std::vector<const Leaf*> made;
    std::vector<Shape> shapes;
    std::vector<Moments> whole;
    for (const Leaf* l : group) {
      const auto both = [&]() -> Result<void> {
        RMP_TRY_ASSIGN(Shape shape_of_leaf, shape(s, l->solid, progress));
        RMP_TRY_ASSIGN(const Moments m, moments(shape_of_leaf, progress).in(s.describe(l->solid)));
        shapes.push_back(std::move(shape_of_leaf));
        whole.push_back(m);
        return {};
      }();
      if (!both.ok() && l->measured && both.error().code != ErrorCode::cancelled) {
        note(sum, "Its volume lacks a part: " + both.error().sentence());
        continue;
      }
      RMP_TRY(both);
      made.push_back(l);
    }
    group = made;
    // Parts of two engines: each by its own where they cannot overlap, else triangles throughout.
    const bool is_mixed = std::any_of(shapes.begin(), shapes.end(), [&](const Shape& x) {
      return x.engine.name != shapes.front().engine.name;
    });
    const bool are_apart = is_mixed && engines_are_apart(shapes, group);
    if (is_mixed && !are_apart) {
      RMP_TRY_ASSIGN(const Engine triangles, mesh_engine());
      for (std::size_t i = 0; i < group.size(); ++i) {
        if (shapes[i].engine.name == triangles.name) continue;
        RMP_TRY_ASSIGN(const CsgTree tree, tree_of(s, group[i]->solid, progress));
        std::string why = std::move(shapes[i].stand_in);
        RMP_TRY_ASSIGN(
            shapes[i],
            shape_of_triangles(triangles, tree, progress).in(s.describe(group[i]->solid)));
        shapes[i].stand_in = std::move(why);
      }
    }
    std::vector<double> densities;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const Leaf* l = group[i];
      const auto* material = l->material ? s.get(l->material) : nullptr;
      if (l->material && !material) return stale(s, l->material);
      densities.push_back(material && !l->measured ? material->density : 0);
      if (!material && !l->measured)
        note(sum, s.describe(l->solid) + " has no material, so it has no mass.");
      sum.area += whole[i].area;
      sum.exact = sum.exact && whole[i].exact && shapes[i].stand_in.empty();
      if (!shapes[i].stand_in.empty()) note(sum, s.describe(l->solid) + ": " + shapes[i].stand_in);
      for (const std::string& text : shapes[i].shape->notes())
        note(sum, s.describe(l->solid) + ": " + text);
    }
    const auto add = [&](std::size_t i, const Moments& m, const MassProperties& mass) {
      sum.volume += m.volume;
      sum.exact = sum.exact && m.exact;
      parts.push_back(
          {{group[i]->name, group[i]->solid, group[i]->material, densities[i], m.volume, mass},
           m.relative_error});
    };
    if (group.size() == 1) {
      add(0, whole[0],
          spatial::in_frame(spatial::mass_properties(whole[0], densities[0]), group[0]->placement));
      return {};
    }
    if (group.empty()) return {};
    std::vector<Pose> poses;
    for (const Leaf* l : group) poses.push_back(l->placement);
    std::map<std::string, std::vector<std::size_t>> by_engine;
    for (std::size_t i = 0; i < group.size(); ++i) by_engine[shapes[i].engine.name].push_back(i);
    std::vector<Moments> own = whole;
    std::vector<MassProperties> masses(group.size());
    for (const auto& [name, members] : by_engine) {
      if (members.size() == 1) {
        const std::size_t i = members.front();
        masses[i] = spatial::in_frame(spatial::mass_properties(whole[i], densities[i]), poses[i]);
        continue;
      }
      std::vector<Shape> some;
      std::vector<Pose> where;
      for (const std::size_t i : members) {
        some.push_back(shapes[i]);
        where.push_back(poses[i]);
      }
      RMP_TRY_ASSIGN(const CsgEngine::Partition split, partition(some, where, progress));
      sum.overlap += split.overlap;
      for (std::size_t k = 0; k < members.size(); ++k) {
        own[members[k]] = split.parts[k];
        masses[members[k]] = spatial::mass_properties(split.parts[k], densities[members[k]]);
      }
    }
    for (std::size_t i = 0; i < group.size(); ++i) add(i, own[i], masses[i]);
    return {};
  }

  /// Without the measured mass of `id` itself. `listed` gets what each solid adds, in order of
  /// listing; a measured part's mass stands with its first solid.
  Result<BodyMass> computed_mass(const Snapshot& s, AnyId id, Progress& progress,
                                 std::vector<PartMass>* listed) {
    std::vector<MeasuredPart> measured;
    RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id, measured));
    std::size_t groups = 0;
    for (const Leaf& l : leaves) groups = std::max(groups, l.group + 1);
    std::vector<std::vector<const Leaf*>> by_group(groups);
    for (const Leaf& l : leaves) by_group[l.group].push_back(&l);
    BodyMass sum;
    std::vector<Weighed> parts;
    std::vector<const Leaf*> order;
    for (auto& group : by_group) {
      if (group.empty()) continue;
      auto added = add_group(s, group, parts, sum, progress);
      if (!added.ok()) return std::move(added).error();
      order.insert(order.end(), group.begin(), group.end());
    }
    std::vector<MassProperties> masses;
    double mass_error = 0, volume_error = 0;
    for (const Weighed& w : parts) {
      masses.push_back(w.part.mass);
      mass_error += w.relative_error * w.part.mass.mass;
      volume_error += w.relative_error * w.part.volume;
    }
    for (const MeasuredPart& m : measured) {
      masses.push_back(spatial::in_frame(m.measured.mass, m.placement));
      note(sum, s.describe(m.what) + " counts with its measured mass" +
                    (m.measured.source.empty() ? "." : " (" + m.measured.source + ")."));
    }
    sum.mass = spatial::combine(masses);
    if (!spatial::is_finite(sum.mass))
      return error(ErrorCode::invalid_argument, "its mass is beyond the range of real numbers",
                   "Check sizes and densities.", s.describe(id));
    if (!sum.exact)
      sum.relative_error = sum.mass.mass > 0 ? mass_error / sum.mass.mass
                           : sum.volume > 0  ? volume_error / sum.volume
                                             : 0;
    if (listed) {
      // Groups and their weightless parts come in another order than the listing.
      std::vector<std::pair<const Leaf*, PartMass*>> by_leaf;
      for (std::size_t i = 0; i < parts.size(); ++i) by_leaf.emplace_back(order[i], &parts[i].part);
      std::sort(by_leaf.begin(), by_leaf.end());  // all leaves are elements of one vector
      std::set<std::size_t> told;
      for (const auto& [leaf, part] : by_leaf) {
        if (leaf->measured && told.insert(*leaf->measured).second)
          part->mass = spatial::in_frame(measured[*leaf->measured].measured.mass,
                                         measured[*leaf->measured].placement);
        listed->push_back(std::move(*part));
      }
    }
    return sum;
  }

  Result<BodyMass> mass(const Snapshot& s, AnyId id, Progress& progress,
                        std::vector<PartMass>* listed = nullptr) {
    auto sum = computed_mass(s, id, progress, listed);
    const Record* record = s.find(id);
    const auto* own = record ? measured_of(*record) : nullptr;
    if (!own || !own->has_value()) return sum;
    if (!sum.ok()) {
      if (sum.error().code == ErrorCode::cancelled) return sum;
      // What was measured does not need the shape.
      BodyMass only;
      note(only, "Its volume is not known: " + sum.error().sentence());
      sum = std::move(only);
    } else {
      sum->computed = sum->mass;
    }
    sum->mass = (*own)->mass;
    sum->measured_source = (*own)->source;
    return sum;
  }

  /// A branch of a tree that can be shown though the tree cannot.
  struct Operand {
    std::string name;
    std::shared_ptr<const Mesh> mesh;
    Pose placement;           ///< solid_T_mesh
    bool is_healthy = false;  ///< stands in the solid as it is, beside what failed
  };

  /// The operands of the deepest operation that fails, those that can be made; before them what
  /// unions put beside it, which would look the same if it had not failed.
  Result<std::vector<Operand>> operands(const CsgTree& tree, double chord, Progress& progress) {
    std::vector<Operand> beside, found;
    bool is_in_unions = true;
    for (std::size_t top = 0;;) {
      std::optional<std::size_t> failing;
      found.clear();
      for (const std::size_t child : children_of(tree, top)) {
        Branch branch = branch_of(tree, child);
        auto made = mesh(branch.tree, chord, progress);
        if (made.ok()) {
          found.push_back(
              {tree.nodes[child].name, std::move(made).value(), branch.placement, false});
        } else if (made.error().code == ErrorCode::cancelled) {
          return std::move(made).error();
        } else if (!failing) {
          failing = child;
        }
      }
      // A primitive that fails is no operation: its neighbours are what there is to see.
      is_in_unions = is_in_unions && tree.nodes[top].kind == CsgKind::union_;
      const bool is_deepest =
          !failing || csg_info(tree.nodes[*failing].kind).children == CsgChildren::none;
      if (is_deepest) {
        // Somebody has to tell what failed.
        if (found.empty()) std::swap(found, beside);
        for (Operand& o : found) o.is_healthy = false;
        beside.insert(beside.end(), found.begin(), found.end());
        return beside;
      }
      if (is_in_unions)
        for (Operand& o : found) {
          o.is_healthy = true;
          beside.push_back(std::move(o));
        }
      top = *failing;
    }
  }

  Result<std::vector<Drawable>> drawables(const Snapshot& s, AnyId id, Progress& progress) {
    RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id));
    if (leaves.size() > 1) RMP_TRY(prepare(s, leaves, progress));
    std::vector<Drawable> all;
    std::optional<Error> first;
    for (const Leaf& l : leaves) {
      RMP_TRY_ASSIGN(const auto* solid, solid_of(s, l.solid));
      const auto* given = l.material ? s.get(l.material) : nullptr;
      const model::Material look = given ? *given : model::Material{};
      const auto draw = [&](std::string name, std::shared_ptr<const Mesh> m, const Pose& placement,
                            std::string failure) {
        const bool is_operand = !failure.empty();
        all.push_back({std::move(name), std::move(m), placement, look.colour, look.shininess,
                       look.metalness, look.ambient, look.specular, look.emission, is_operand,
                       std::move(failure)});
      };
      auto tree = tree_of(*solid, progress);
      auto made = tree.ok() ? mesh(*tree, solid->chord, progress)
                            : Result<std::shared_ptr<const Mesh>>(tree.error());
      if (made.ok()) {
        draw(l.name, *made, l.placement, "");
        continue;
      }
      Error why = std::move(made).error().in(s.describe(l.solid));
      if (why.code == ErrorCode::cancelled) return why;
      if (tree.ok()) {
        RMP_TRY_ASSIGN(const auto shown, operands(*tree, solid->chord, progress));
        for (const Operand& o : shown)
          draw(o.name.empty() ? l.name : l.name + "." + o.name, o.mesh,
               spatial::compose(l.placement, o.placement), o.is_healthy ? "" : why.sentence());
      }
      if (!first) first = std::move(why);
    }
    if (all.empty() && first) return *first;
    return all;
  }

  /// Cancels with the caller's, says nothing.
  class Quiet final : public Progress {
   public:
    explicit Quiet(const Progress& outer) : outer_(outer) {}
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return outer_.cancelled(); }

   private:
    const Progress& outer_;
  };

  /// Makes and meshes what is not known yet, several solids at once. Failures are remembered by
  /// the cache and told to whoever asks.
  Result<void> prepare(const Snapshot& s, const std::vector<Leaf>& leaves, Progress& progress) {
    struct Work {
      CsgTree tree;
      double chord = 0;
    };
    std::vector<Work> work;
    std::set<SolidId> seen;
    std::set<Fingerprint> keys;
    for (const Leaf& l : leaves) {
      if (!seen.insert(l.solid).second) continue;
      const auto solid = solid_of(s, l.solid);
      if (!solid.ok()) continue;
      auto tree = tree_of(**solid, progress);
      if (!tree.ok()) continue;
      const auto e = engine_for(*tree);
      if (!e.ok()) continue;
      MeshQuality quality;
      quality.chord = (*solid)->chord;
      const Keys shape_keys = keys_of(*e, *tree);
      const Fingerprint key = mesh_key(shape_keys.value, quality);
      if (cache.holds(key, shape_keys.failure) || !keys.insert(key).second) continue;
      work.push_back({std::move(*tree), quality.chord});
    }
    if (work.size() < 2 || !cache.is_enabled()) return {};
    std::atomic<std::size_t> next{0}, done{0};
    std::mutex tell;
    const auto run = [&] {
      Quiet quiet(progress);
      for (std::size_t i = next++; i < work.size() && !progress.cancelled(); i = next++) {
        (void)mesh(work[i].tree, work[i].chord, quiet).ok();
        const std::lock_guard lock(tell);
        progress.report(static_cast<double>(++done) / static_cast<double>(work.size()),
                        "making solids");
      }
    };
    {
      const std::size_t most = std::max(1U, std::thread::hardware_concurrency());
      std::vector<std::jthread> helpers;
      for (std::size_t i = 1; i < std::min(most, work.size()); ++i) helpers.emplace_back(run);
      run();
    }
    if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
    return {};
  }

  Result<void> prepare(const Snapshot& s, std::span<const AnyId> what, Progress& progress) {
    std::vector<Leaf> all;
    for (const AnyId id : what) {
      auto leaves = leaves_of(s, id);
      if (leaves.ok()) all.insert(all.end(), leaves->begin(), leaves->end());
    }
    return prepare(s, all, progress);
  }

  Result<std::array<Vec3, 2>> bounds(const Snapshot& s, AnyId id, Progress& progress) {
    RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id));
    if (leaves.empty())
      return error(ErrorCode::invalid_argument, "it has no parts", "Add a part to it.",
                   s.describe(id));
    constexpr double kInf = std::numeric_limits<double>::infinity();
    std::array<Vec3, 2> box{{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}};
    for (const Leaf& l : leaves) {
      RMP_TRY_ASSIGN(const Shape shape_of_leaf, shape(s, l.solid, progress));
      RMP_TRY_ASSIGN(const auto own,
                     placed_box(shape_of_leaf, l.placement).in(s.describe(l.solid)));
      for (std::size_t i = 0; i < 3; ++i) {
        box[0][i] = std::min(box[0][i], own[0][i]);
        box[1][i] = std::max(box[1][i], own[1][i]);
      }
    }
    return box;
  }

  /// Mass of a link's designed parts in the link's frame; nullopt without parts or material.
  Result<std::optional<MassProperties>> designed_mass(const Snapshot& s, const model::Link& link,
                                                      Progress& progress) {
    std::vector<MassProperties> masses;
    for (const auto& p : link.parts) {
      RMP_TRY_ASSIGN(const BodyMass m, mass(s, p.what, progress));
      if (m.mass.mass > 0) masses.push_back(spatial::in_frame(m.mass, model::pose(p.placement)));
    }
    if (masses.empty()) return std::optional<MassProperties>{};
    return std::optional<MassProperties>{spatial::combine(masses)};
  }

  Result<std::shared_ptr<const RobotModel>> robot_model(const Snapshot& s, RobotId id, Vec3 gravity,
                                                        Progress& progress) {
    const Record* record = s.find(id);
    if (!record) return stale(s, id);
    const auto& robot = std::get<model::Robot>(record->body);
    std::vector<std::optional<MassProperties>> masses;
    if (robot.mass_source == model::MassSource::designed)
      for (const auto& link : robot.links) {
        RMP_TRY_ASSIGN(auto m, designed_mass(s, link, progress));
        masses.push_back(m);
      }
    // The key: what the model is built from, without looks, poses, solvers and parts.
    model::Robot kinematic = robot;
    kinematic.description.clear();
    kinematic.source.clear();
    kinematic.base_parts.clear();
    kinematic.poses.clear();
    kinematic.pair_rules.clear();
    kinematic.ik = kinematic.inverse_dynamics = kinematic.forward_dynamics =
        kinematic.controller = {};
    kinematic.skin_colour = kinematic.skin_accent = {};
    kinematic.parametric = {};  // what it comes from does not matter, only the numbers
    for (auto& link : kinematic.links) {
      link.parts.clear();
      link.visible = true;
    }
    Fingerprinter fp("robot_model/1");
    fp.add(std::string_view(record->name)).add(std::span<const double>(gravity));
    document::feed(fp, kinematic, [](Fingerprinter&, AnyId) {});
    for (const auto& m : masses) {
      fp.add(m.has_value());
      if (!m) continue;
      const Sym3& i = m->inertia;
      fp.add(m->mass).add(std::span<const double>(m->com));
      for (const double v : {i.xx, i.yy, i.zz, i.xy, i.yz, i.xz}) fp.add(v);
    }
    const Fingerprint key = fp.finish();
    return cache.get<RobotModel>(
        key, key, [&] { return robotics::build_robot_model(record->name, robot, masses, gravity); },
        [](const RobotModel& m) {
          return sizeof(RobotModel) + sizeof(JointModel) * m.joints.size();
        });
  }

  Result<std::shared_ptr<const std::vector<ShapePiece>>> shapes(const CsgTree& tree, double chord,
                                                                Progress& progress) {
    RMP_TRY_ASSIGN(const Engine e, engine_for(tree));
    Fingerprinter fp("shapes/1");
    fp.add(keys_of(e, tree).value).add(chord);
    const Fingerprint key = fp.finish();
    return cache.get<std::vector<ShapePiece>>(
        key, key,
        [&] {
          return shape_pieces(tree,
                              [&](const CsgTree& part) { return mesh(part, chord, progress); });
        },
        [](const std::vector<ShapePiece>& pieces) {
          std::size_t bytes = sizeof(ShapePiece) * pieces.size();
          for (const ShapePiece& p : pieces)
            if (p.mesh) bytes += mesh_bytes(*p.mesh);
          return bytes;
        });
  }

  Result<std::shared_ptr<const std::vector<ShapePiece>>> shapes(const Snapshot& s, AnyId id,
                                                                Progress& progress) {
    RMP_TRY_ASSIGN(const auto leaves, leaves_of(s, id));
    std::vector<ShapePiece> all;
    for (const Leaf& leaf : leaves) {
      RMP_TRY_ASSIGN(const auto* solid, solid_of(s, leaf.solid));
      RMP_TRY_ASSIGN(const CsgTree tree, tree_of(s, leaf.solid, progress));
      RMP_TRY_ASSIGN(const auto own,
                     shapes(tree, solid->chord, progress).in(s.describe(leaf.solid)));
      for (ShapePiece p : *own) {
        p.pose = spatial::compose(leaf.placement, p.pose);
        all.push_back(std::move(p));
      }
    }
    return std::make_shared<const std::vector<ShapePiece>>(std::move(all));
  }

  Result<std::vector<std::vector<ShapePiece>>> robot_shapes(const Snapshot& s, RobotId id,
                                                            Progress& progress) {
    const auto* robot = s.get(id);
    if (!robot) return stale(s, id);
    std::vector<std::vector<ShapePiece>> out(robot->links.size() + 1);
    const bool is_generated =
        robot->base_parts.empty() && std::all_of(robot->links.begin(), robot->links.end(),
                                                 [](const auto& l) { return l.parts.empty(); });
    const auto add = [&](const std::shared_ptr<const std::vector<ShapePiece>>& pieces,
                         const Pose& at, std::vector<ShapePiece>& to) {
      for (ShapePiece p : *pieces) {
        p.pose = spatial::compose(at, p.pose);
        to.push_back(std::move(p));
      }
    };
    const auto add_skin = [&](const std::vector<robotics::SkinPiece>& skin,
                              std::vector<ShapePiece>& to) -> Result<void> {
      for (const auto& piece : skin) {
        RMP_TRY_ASSIGN(const auto own, shapes(piece.tree, kSkinChord, progress));
        add(own, {}, to);
      }
      return {};
    };
    const auto add_parts = [&](const std::vector<model::BodyPart>& parts,
                               std::vector<ShapePiece>& to) -> Result<void> {
      for (const auto& part : parts) {
        RMP_TRY_ASSIGN(const auto own, shapes(s, part.what, progress));
        add(own, model::pose(part.placement), to);
      }
      return {};
    };
    if (is_generated) {
      const robotics::Skin skin = robotics::make_skin(*robot);
      RMP_TRY(add_skin(skin.base, out[0]));
      for (std::size_t i = 0; i < skin.links.size(); ++i)
        RMP_TRY(add_skin(skin.links[i], out[i + 1]));
      return out;
    }
    RMP_TRY(add_parts(robot->base_parts, out[0]));
    for (std::size_t i = 0; i < robot->links.size(); ++i)
      RMP_TRY(add_parts(robot->links[i].parts, out[i + 1]));
    return out;
  }

  Result<RobotBodies> robot_bodies(const Snapshot& s, RobotId id, Progress& progress) {
    const auto* robot = s.get(id);
    if (!robot) return stale(s, id);
    RobotBodies out;
    out.bodies.resize(robot->links.size() + 1);
    out.generated =
        robot->base_parts.empty() && std::all_of(robot->links.begin(), robot->links.end(),
                                                 [](const auto& l) { return l.parts.empty(); });
    if (out.generated) {
      RMP_TRY(add_skin(*robot, out, progress));
      return out;
    }
    std::vector<AnyId> parts_of_all;
    for (const auto& p : robot->base_parts) parts_of_all.push_back(p.what);
    for (const auto& l : robot->links)
      if (l.visible)
        for (const auto& p : l.parts) parts_of_all.push_back(p.what);
    RMP_TRY(prepare(s, parts_of_all, progress));
    std::optional<Error> first;
    bool is_anything_drawn = false;
    const auto add = [&](const std::vector<model::BodyPart>& parts,
                         std::vector<Drawable>& to) -> Result<void> {
      for (const auto& p : parts) {
        auto drawn = drawables(s, p.what, progress);
        if (!drawn.ok()) {
          if (drawn.error().code == ErrorCode::cancelled) return drawn.error();
          if (!first) first = drawn.error();
          continue;
        }
        is_anything_drawn = is_anything_drawn || !drawn->empty();
        for (Drawable& d : *drawn) {
          d.placement = spatial::compose(model::pose(p.placement), d.placement);
          to.push_back(std::move(d));
        }
      }
      return {};
    };
    RMP_TRY(add(robot->base_parts, out.bodies[0]));
    for (std::size_t i = 0; i < robot->links.size(); ++i)
      if (robot->links[i].visible) RMP_TRY(add(robot->links[i].parts, out.bodies[i + 1]));
    if (first && !is_anything_drawn) return *first;
    return out;
  }

  Result<void> add_skin(const model::Robot& robot, RobotBodies& out, Progress& progress) {
    const robotics::Skin skin = robotics::make_skin(robot);
    const auto add = [&](const std::vector<robotics::SkinPiece>& pieces, const std::string& name,
                         std::vector<Drawable>& to) -> Result<void> {
      for (const auto& piece : pieces) {
        RMP_TRY_ASSIGN(auto m, mesh(piece.tree, kSkinChord, progress));
        to.push_back(
            {name,
             std::move(m),
             {},
             piece.role == robotics::SkinRole::tube ? robot.skin_colour : robot.skin_accent,
             kSkinShininess,
             0});
      }
      return {};
    };
    RMP_TRY(add(skin.base, "base", out.bodies[0]));
    for (std::size_t i = 0; i < robot.links.size() && i < skin.links.size(); ++i)
      RMP_TRY(add(skin.links[i], robot.links[i].name, out.bodies[i + 1]));
    return {};
  }

  const Registry& registry;
  Cache cache;
  std::mutex mutex;
  Known known, known_mesh, known_exact;  // guarded by mutex
};

namespace {

/// Adds who asked to an error of a part.
template <class T>
Result<T> for_whom(const Snapshot& s, AnyId who, Result<T> result) {
  if (result.ok() || result.error().code == ErrorCode::cancelled) return result;
  if (who.kind == Kind::solid || result.error().where == s.describe(who) || !s.find(who))
    return result;
  return waits(s, who, std::move(result).error());
}

}  // namespace

Derived::Derived(const Registry& registry, std::size_t budget_bytes)
    : impl_(std::make_unique<Impl>(registry, budget_bytes)) {}
Derived::~Derived() = default;

Result<std::shared_ptr<const Mesh>> Derived::mesh(const Snapshot& s, SolidId id,
                                                  Progress& progress) {
  return mesh(s, id, 0, progress);
}

Result<std::shared_ptr<const Mesh>> Derived::mesh(const Snapshot& s, SolidId id, double chord,
                                                  Progress& progress) {
  RMP_TRY_ASSIGN(const auto* solid, Impl::solid_of(s, id));
  RMP_TRY_ASSIGN(const CsgTree tree, impl_->tree_of(s, id, progress));
  return impl_->mesh(tree, chord > 0 ? chord : solid->chord, progress).in(s.describe(id));
}

Result<Moments> Derived::moments(const Snapshot& s, SolidId id, Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->shape(s, id, progress));
  return impl_->moments(shape, progress).in(s.describe(id));
}

Result<BodyMass> Derived::mass(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, impl_->mass(s, id, progress));
}

Result<std::vector<PartMass>> Derived::part_masses(const Snapshot& s, AnyId id,
                                                   Progress& progress) {
  std::vector<PartMass> listed;
  auto made = for_whom(s, id, impl_->mass(s, id, progress, &listed));
  if (!made.ok()) return std::move(made).error();
  return listed;
}

Result<std::shared_ptr<const std::vector<CsgFeature>>> Derived::features(const Snapshot& s,
                                                                         SolidId id,
                                                                         Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->shape(s, id, progress));
  return impl_->features(shape, progress).in(s.describe(id));
}

Result<std::shared_ptr<const CsgProfile>> Derived::section(const Snapshot& s, SolidId id,
                                                           const Pose& plane, double chord,
                                                           Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->shape(s, id, progress));
  return impl_->section(shape, plane, chord, progress).in(s.describe(id));
}

Result<std::shared_ptr<const CsgGeometry>> Derived::geometry(const Snapshot& s, SolidId id,
                                                             Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->shape(s, id, progress));
  return impl_->geometry(shape, progress).in(s.describe(id));
}

Result<void> Derived::prepare(const Snapshot& s, std::span<const AnyId> what, Progress& progress) {
  return impl_->prepare(s, what, progress);
}

Result<std::array<Vec3, 2>> Derived::bounds(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, impl_->bounds(s, id, progress));
}

Result<std::vector<Drawable>> Derived::drawables(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, impl_->drawables(s, id, progress));
}

Result<std::shared_ptr<const RobotModel>> Derived::robot_model(const Snapshot& s, RobotId id,
                                                               Vec3 gravity, Progress& progress) {
  auto made = impl_->robot_model(s, id, gravity, progress);
  // Faults of the robot itself say so already.
  if (!made.ok() && made.error().where.starts_with("robot ")) return made;
  return for_whom(s, id, std::move(made));
}

Result<RobotBodies> Derived::robot_bodies(const Snapshot& s, RobotId id, Progress& progress) {
  return for_whom(s, id, impl_->robot_bodies(s, id, progress));
}

Result<std::shared_ptr<const std::vector<ShapePiece>>> Derived::shapes(const Snapshot& s, AnyId id,
                                                                       Progress& progress) {
  return for_whom(s, id, impl_->shapes(s, id, progress));
}

Result<std::vector<std::vector<ShapePiece>>> Derived::robot_shapes(const Snapshot& s, RobotId id,
                                                                   Progress& progress) {
  return for_whom(s, id, impl_->robot_shapes(s, id, progress));
}

CacheStats Derived::stats() const { return impl_->cache.stats(); }
void Derived::clear() { impl_->cache.clear(); }
void Derived::set_enabled(bool is_enabled) { impl_->cache.set_enabled(is_enabled); }

}  // namespace robomosp::document
