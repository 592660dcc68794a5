// SPDX-License-Identifier: Apache-2.0
// Guards of engines of solids and of primitives. Meshes and moments are checked where they are
// derived, as far as it takes the solid to tell.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_edges.h>
#include <robomosp/sdk/csg_primitive.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"

namespace robomosp {
namespace {

constexpr std::size_t kMostNotes = 100;

/// What an engine made, with what it says of it asked once.
class GuardedShape final : public CsgShape {
 public:
  GuardedShape(std::shared_ptr<const CsgShape> inner, std::vector<std::string> notes)
      : inner_(std::move(inner)), notes_(std::move(notes)) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  [[nodiscard]] std::array<Vec3, 2> bounds() const override { return inner_->bounds(); }
  [[nodiscard]] std::span<const std::string> notes() const override { return notes_; }
  [[nodiscard]] const std::shared_ptr<const CsgShape>& inner() const { return inner_; }

 private:
  std::shared_ptr<const CsgShape> inner_;
  std::vector<std::string> notes_;
};

bool is_sound(const Moments& m) {
  const double plain[] = {m.volume, m.area, m.relative_error};
  const double second[] = {m.second.xx, m.second.yy, m.second.zz,
                           m.second.xy, m.second.yz, m.second.xz};
  return all_finite(plain) && all_finite(m.first) && all_finite(second);
}

/// Whether some body has them: no second moment is below what its centre of mass alone has, and no
/// product is above its two squares (Cauchy and Schwarz).
bool are_possible(const Moments& m) {
  if (!(m.volume > 0)) return true;  // a fault of its own
  const double slack = 1e-6 + std::fabs(m.relative_error);
  const Sym3& s = m.second;
  const std::array<double, 3> squares{s.xx, s.yy, s.zz}, products{s.yz, s.xz, s.xy};
  for (std::size_t k = 0; k < 3; ++k) {
    if (squares[k] * m.volume < m.first[k] * m.first[k] * (1 - slack)) return false;
    const double both = std::sqrt(squares[(k + 1) % 3]) * std::sqrt(squares[(k + 2) % 3]);
    if (!(std::fabs(products[k]) <= both * (1 + slack))) return false;
  }
  return true;
}

class GuardedCsg final : public CsgEngine, public CsgEdges {
 public:
  GuardedCsg(const ProviderInfo& info, CsgEngine* inner) : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    const void* known = inner_->extension(id);
    return known && std::string_view(id) == CsgEdges::kExtensionId
               ? static_cast<const CsgEdges*>(this)
               : known;
  }
  Result<std::shared_ptr<const CsgShape>> evaluate(const CsgTree& tree,
                                                   Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto made, asked(name_, [&] { return inner_->evaluate(tree, progress); }));
    if (!made) return broken_answer(name_, "returned no solid");
    using Notes = std::vector<std::string>;
    RMP_TRY_ASSIGN(Notes notes, asked(name_, [&]() -> Result<Notes> {
                     const auto all = made->notes();
                     const auto count = std::min(all.size(), kMostNotes);
                     return Notes(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
                   }));
    for (std::string& note : notes) note = heard(note);
    return std::shared_ptr<const CsgShape>(
        std::make_shared<GuardedShape>(std::move(made), std::move(notes)));
  }
  Result<Mesh> mesh(const CsgShape& s, const MeshQuality& quality, Progress& told) const override {
    HeardProgress progress(told);
    return asked(name_, [&] { return inner_->mesh(own(s), quality, progress); });
  }
  Result<Moments> moments(const CsgShape& s, Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(const Moments m,
                   asked(name_, [&] { return inner_->moments(own(s), progress); }));
    RMP_TRY(check(m));
    if (!are_possible(m))
      return broken_answer(name_, "returned second moments that are impossible for a body");
    return m;
  }
  Result<Partition> partition(std::span<const PlacedShape> parts, Progress& told) const override {
    std::vector<PlacedShape> plain(parts.begin(), parts.end());
    for (PlacedShape& p : plain)
      if (const auto* made = dynamic_cast<const GuardedShape*>(p.shape.get()))
        p.shape = made->inner();
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(Partition made,
                   asked(name_, [&] { return inner_->partition(plain, progress); }));
    if (made.parts.size() != parts.size())
      return broken_answer(name_, "returned " + std::to_string(made.parts.size()) + " parts for " +
                                      std::to_string(parts.size()));
    double largest = 0;
    for (const Moments& m : made.parts) {
      RMP_TRY(check(m));
      largest = std::max(largest, std::fabs(m.volume));
    }
    for (const Moments& m : made.parts)
      if (m.volume < -(1e-6 + std::fabs(m.relative_error)) * largest)
        return broken_answer(name_, "returned a part of negative volume");
    if (!std::isfinite(made.overlap))
      return broken_answer(name_, "returned an overlap that is not a number");
    return made;
  }
  Result<std::vector<CsgFeature>> features(const CsgShape& s, Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return inner_->features(own(s), progress); }));
    for (const CsgFeature& f : all) {
      if (f.kind < CsgFeature::Kind::plane || f.kind > CsgFeature::Kind::other)
        return broken_answer(name_, "listed a feature of unknown kind");
      const double sizes[] = {f.radius, f.size};
      if (!all_finite(f.point) || !all_finite(f.direction) || !all_finite(sizes))
        return broken_answer(name_, "listed a feature with an invalid number");
    }
    return all;
  }
  Result<std::vector<CsgEdge>> edges(const CsgShape& s, double chord,
                                     Progress& told) const override {
    const auto* known = static_cast<const CsgEdges*>(inner_->extension(CsgEdges::kExtensionId));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return known->edges(own(s), chord, progress); }));
    for (const CsgEdge& e : all) {
      if (e.kind < CsgEdge::Kind::line || e.kind > CsgEdge::Kind::curve || e.points.size() < 2)
        return broken_answer(name_, "listed an edge of unknown kind or without ends");
      const double sizes[] = {e.length, e.radius, e.angle};
      bool is_sound = all_finite(e.centre) && all_finite(e.axis) && all_finite(sizes);
      for (const CsgEdgePoint& p : e.points)
        is_sound = is_sound && all_finite(p.position) && all_finite(p.tangent) &&
                   all_finite(p.normals[0]) && all_finite(p.normals[1]);
      if (!is_sound) return broken_answer(name_, "listed an edge with an invalid number");
    }
    return all;
  }
  Result<CsgProfile> section(const CsgShape& s, const Pose& plane, double chord,
                             Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(CsgProfile p,
                   asked(name_, [&] { return inner_->section(own(s), plane, chord, progress); }));
    for (const CsgLoop& loop : p.loops) {
      bool is_finite = all_finite(loop.start);
      for (const CsgCurve& curve : loop.curves)
        for (const auto& point : curve.points) is_finite = is_finite && all_finite(point);
      if (!is_finite)
        return broken_answer(name_, "returned a section with points that are not numbers");
    }
    return p;
  }
  Result<CsgGeometry> geometry(const CsgShape& s, Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(CsgGeometry g, asked(name_, [&] { return inner_->geometry(own(s), progress); }));
    const bool is_brep = g.form == CsgGeometry::Form::brep && !g.brep.empty();
    bool is_mesh = g.form == CsgGeometry::Form::mesh && !g.points.empty() &&
                   g.points.size() % 3 == 0 && !g.triangles.empty() &&
                   g.triangles.size() % 3 == 0 && all_finite(g.points);
    for (const std::uint32_t i : g.triangles) is_mesh = is_mesh && i < g.points.size() / 3;
    if (!is_brep && !is_mesh)
      return broken_answer(name_, "exported a geometry that is neither a B-rep nor a mesh");
    return g;
  }

 private:
  /// The engine's own shape. What another engine made it refuses itself.
  static const CsgShape& own(const CsgShape& s) {
    const auto* made = dynamic_cast<const GuardedShape*>(&s);
    return made ? *made->inner() : s;
  }
  [[nodiscard]] Result<void> check(const Moments& m) const {
    if (!is_sound(m)) return broken_answer(name_, "returned moments that are not finite numbers");
    return {};
  }
  std::string name_;
  std::unique_ptr<CsgEngine> inner_;
};

class GuardedPrimitive final : public CsgPrimitive {
 public:
  GuardedPrimitive(const ProviderInfo& info, CsgPrimitive* inner)
      : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<CsgTree> build(const Params& params, Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(CsgTree tree, asked(name_, [&] { return inner_->build(params, progress); }));
    for (CsgNode& n : tree.nodes) n.name = heard(n.name);
    return tree;
  }

 private:
  std::string name_;
  std::unique_ptr<CsgPrimitive> inner_;
};

}  // namespace

RMP_INTERFACES(solids, guarded_interface<CsgEngine, GuardedCsg>("occt"),
               guarded_interface<CsgPrimitive, GuardedPrimitive>());

}  // namespace robomosp
