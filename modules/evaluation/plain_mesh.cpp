// SPDX-License-Identifier: Apache-2.0
#include "evaluation/plain_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <robomosp/sdk/csg_check.h>

#include "kernel/text.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::evaluation {
namespace {

/// Faces that meet at a smaller angle are shaded as one: cos 30 degrees.
constexpr double kSmooth = 0.866;
/// Triangles about one corner; of more, normals are those of the triangles.
constexpr std::size_t kMostAround = 64;

class PlainShape final : public CsgShape {
 public:
  PlainShape(std::vector<double> points, spatial::SurfaceMoments state, Error why)
      : points_(std::move(points)), state_(std::move(state)), why_(std::move(why)) {
    constexpr double kInf = std::numeric_limits<double>::infinity();
    box_ = {{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}};
    for (const std::uint32_t v : state_.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        box_[0][k] = std::min(box_[0][k], points_[3 * std::size_t{v} + k]);
        box_[1][k] = std::max(box_[1][k], points_[3 * std::size_t{v} + k]);
      }
    std::string note =
        "it is used as a plain mesh, which does not bound a valid solid (" + why_.message + "); ";
    if (state_.is_hull)
      note += "volume, mass and inertia are those of its convex hull, which are upper bounds";
    else if (!(state_.moments.volume > 0)) note += "it lies in a plane and has no volume";
    else
      note += "volume, mass and inertia are those enclosed by its triangles" +
              std::string(state_.open_edges > 0 ? ", holes closed" : "") + ", within " +
              text::print_rounded(100 * state_.moments.relative_error) + " %";
    notes_.push_back(note + ".");
  }
  std::array<Vec3, 2> bounds() const override { return box_; }
  std::span<const std::string> notes() const override { return notes_; }

  [[nodiscard]] const std::vector<double>& points() const { return points_; }
  [[nodiscard]] const spatial::SurfaceMoments& state() const { return state_; }
  [[nodiscard]] const Error& why() const { return why_; }

 private:
  std::vector<double> points_;
  spatial::SurfaceMoments state_;
  Error why_;
  std::array<Vec3, 2> box_{};
  std::vector<std::string> notes_;
};

std::vector<double> points_of(const CsgTree& tree) {
  const CsgNode& node = tree.nodes.back();
  std::vector<double> out;
  out.reserve(node.geometry->points.size());
  const auto& in = node.geometry->points;
  for (std::size_t i = 0; i + 2 < in.size(); i += 3) {
    Vec3 p = spatial::transform(node.placement,
                                spatial::scale(Vec3{in[i], in[i + 1], in[i + 2]}, node.sizes[0]));
    for (std::size_t n = tree.nodes.size() - 1; n-- > 0;) {
      for (std::size_t k = 0; k < 3; ++k) p[k] *= tree.nodes[n].sizes[k];
      p = spatial::transform(tree.nodes[n].placement, p);
    }
    out.insert(out.end(), p.begin(), p.end());
  }
  return out;
}

/// Triangles in single precision, with normals that are smooth but at edges, and the edges.
class Display {
 public:
  explicit Display(const PlainShape& shape) : in_(shape) {
    const auto& t = in_.state().triangles;
    normals_.resize(t.size() / 3);
    for (std::size_t i = 0; i < normals_.size(); ++i)
      normals_[i] = spatial::cross(spatial::sub(at(t[3 * i + 1]), at(t[3 * i])),
                                   spatial::sub(at(t[3 * i + 2]), at(t[3 * i])));
  }

  Mesh run() {
    const auto& t = in_.state().triangles;
    std::map<Vec3, std::uint32_t> number;
    std::vector<std::uint32_t> place(in_.points().size() / 3);
    for (std::uint32_t v = 0; v < place.size(); ++v)
      place[v] = number.emplace(at(v), static_cast<std::uint32_t>(number.size())).first->second;
    std::vector<std::vector<std::uint32_t>> around(number.size());
    for (std::size_t i = 0; i < t.size(); ++i)
      around[place[t[i]]].push_back(static_cast<std::uint32_t>(i / 3));
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> lines;
    std::map<std::pair<std::uint32_t, std::array<float, 3>>, std::uint32_t> corners;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const auto triangle = static_cast<std::uint32_t>(i / 3);
      const std::uint32_t here = place[t[i]], next = place[t[3 * (i / 3) + (i + 1) % 3]];
      if (here != next) lines[std::minmax(here, next)].push_back(triangle);
      const Vec3 own = spatial::unit(normals_[triangle]);
      Vec3 sum = normals_[triangle];
      if (around[here].size() <= kMostAround)
        for (const std::uint32_t other : around[here])
          if (other != triangle && spatial::dot(spatial::unit(normals_[other]), own) > kSmooth)
            sum = spatial::add(sum, normals_[other]);
      Vec3 n = spatial::unit(sum);
      if (!spatial::is_finite(n) || !(spatial::norm(n) > 0.5)) n = {0, 0, 1};
      const std::array<float, 3> normal{static_cast<float>(n[0]), static_cast<float>(n[1]),
                                        static_cast<float>(n[2])};
      const auto [it, is_new] =
          corners.try_emplace({here, normal}, static_cast<std::uint32_t>(corners.size()));
      if (is_new) {
        for (const double x : at(t[i])) out_.positions.push_back(static_cast<float>(x));
        out_.normals.insert(out_.normals.end(), normal.begin(), normal.end());
      }
      out_.triangles.push_back(it->second);
    }
    std::vector<Vec3> at_place(number.size());
    for (const auto& [p, n] : number) at_place[n] = p;
    for (const auto& [line, users] : lines) {
      const bool is_edge =
          users.size() != 2 || spatial::dot(spatial::unit(normals_[users[0]]),
                                            spatial::unit(normals_[users[1]])) < kSmooth;
      if (!is_edge) continue;
      for (const std::uint32_t end : {line.first, line.second})
        for (const double x : at_place[end]) out_.edge_points.push_back(static_cast<float>(x));
      out_.edge_sizes.push_back(2);
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] Vec3 at(std::uint32_t v) const {
    const double* p = in_.points().data() + 3 * std::size_t{v};
    return {p[0], p[1], p[2]};
  }
  const PlainShape& in_;
  std::vector<Vec3> normals_;  ///< twice the area long
  Mesh out_;
};

class PlainEngine final : public CsgEngine {
 public:
  Result<std::shared_ptr<const CsgShape>> evaluate(const CsgTree& tree, Progress&) const override {
    return plain_shape(tree, error(ErrorCode::unsupported, "no solid requested"));
  }
  Result<Mesh> mesh(const CsgShape& shape, const MeshQuality&, Progress&) const override {
    return Display(own(shape)).run();
  }
  Result<Moments> moments(const CsgShape& shape, Progress&) const override {
    return own(shape).state().moments;
  }
  Result<Partition> partition(std::span<const PlacedShape> parts, Progress&) const override {
    return parts.empty() ? Partition{} : Result<Partition>(own(*parts.front().shape).why());
  }
  Result<std::vector<CsgFeature>> features(const CsgShape& shape, Progress&) const override {
    return own(shape).why();
  }
  Result<CsgProfile> section(const CsgShape& shape, const Pose&, double, Progress&) const override {
    return own(shape).why();
  }
  Result<CsgGeometry> geometry(const CsgShape& shape, Progress&) const override {
    CsgGeometry out;
    out.form = CsgGeometry::Form::mesh;
    out.points = own(shape).points();
    out.triangles = own(shape).state().triangles;
    return out;
  }

 private:
  static const PlainShape& own(const CsgShape& shape) {
    return static_cast<const PlainShape&>(shape);  // Solids hands out no others with this engine
  }
};

}  // namespace

bool is_plain_mesh(const CsgTree& tree) {
  // A scale has one child: nothing but a line of them may lead to the mesh.
  if (tree.nodes.empty()) return false;
  const CsgNode& last = tree.nodes.back();
  return last.kind == CsgKind::imported && last.geometry &&
         last.geometry->form == CsgGeometry::Form::mesh &&
         std::all_of(tree.nodes.begin(), tree.nodes.end() - 1,
                     [](const CsgNode& n) { return n.kind == CsgKind::scale; });
}

spatial::SurfaceMoments examined(const CsgTree& tree) {
  return spatial::surface_moments(points_of(tree), tree.nodes.back().geometry->triangles);
}

std::vector<spatial::SurfaceCut> cuts_of(const CsgTree& tree, std::size_t most) {
  const std::vector<double> points = points_of(tree);
  std::map<Vec3, std::uint32_t> number;
  std::vector<double> joined;
  std::vector<std::uint32_t> triangles;
  const auto& all = tree.nodes.back().geometry->triangles;
  for (std::size_t i = 0; i + 2 < all.size(); i += 3) {
    std::array<std::uint32_t, 3> t{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double* p = points.data() + 3 * std::size_t{all[i + k]};
      const Vec3 at{p[0] + 0.0, p[1] + 0.0, p[2] + 0.0};
      const auto [it, is_new] = number.emplace(at, static_cast<std::uint32_t>(number.size()));
      if (is_new) joined.insert(joined.end(), at.begin(), at.end());
      t[k] = it->second;
    }
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
      triangles.insert(triangles.end(), t.begin(), t.end());
  }
  return spatial::surface_cuts(joined, triangles, 0, most);
}

const Error* why_plain(const CsgShape& shape) {
  const auto* plain = dynamic_cast<const PlainShape*>(&shape);
  return plain ? &plain->why() : nullptr;
}

Result<std::shared_ptr<const CsgShape>> plain_shape(const CsgTree& tree, const Error& why) {
  const CsgGeometry& g = *tree.nodes.back().geometry;
  std::vector<double> points = points_of(tree);
  const bool is_sound = g.triangles.size() >= 3 && g.triangles.size() % 3 == 0 &&
                        std::all_of(points.begin(), points.end(),
                                    [](double x) { return std::fabs(x) <= kCsgGreatestLength; }) &&
                        std::all_of(g.triangles.begin(), g.triangles.end(),
                                    [&](std::uint32_t v) { return v < points.size() / 3; });
  if (!is_sound) return why;
  auto state = spatial::surface_moments(points, g.triangles);
  return std::shared_ptr<const CsgShape>(
      std::make_shared<PlainShape>(std::move(points), std::move(state), why));
}

std::shared_ptr<CsgEngine> plain_engine() { return std::make_shared<PlainEngine>(); }

}  // namespace robomosp::evaluation
