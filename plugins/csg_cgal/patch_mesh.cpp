// SPDX-License-Identifier: GPL-3.0-or-later
#include "patch_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace robomosp::csg_cgal {

namespace {

/// Nearer to the axis [m] there is no direction away from it.
constexpr double kOnAxis = 1e-10;

/// p relative to the patch's point: along the axis, and the part across it.
std::pair<double, Vec3> along_and_across(const Patch& patch, const Vec3& p) {
  const Vec3 d = p - patch.point;
  const double along = dot(d, patch.axis);
  const Vec3 across = d - patch.axis * along;
  return {along, norm(across) < kOnAxis ? Vec3{} : across};
}

}  // namespace

Vec3 Patch::normal(const Vec3& p) const {
  const auto [along, across] = along_and_across(*this, p);
  switch (kind) {
    case Kind::plane: return axis;
    case Kind::cylinder: return unit(across);
    case Kind::cone: {
      const Vec3 out = unit(across);
      return out == Vec3{} ? out : unit(out - axis * (along < 0 ? -tube : tube));
    }
    case Kind::sphere: return unit(p - point);
    case Kind::torus: return unit(p - (point + unit(across) * radius));
    case Kind::free: break;
  }
  return {};
}

double Patch::distance(const Vec3& p) const {
  const auto [along, across] = along_and_across(*this, p);
  switch (kind) {
    case Kind::plane: return std::abs(along);
    case Kind::cylinder: return std::abs(norm(across) - radius);
    case Kind::cone:
      return std::abs(norm(across) - std::abs(along) * tube) / std::sqrt(1 + tube * tube);
    case Kind::sphere: return std::abs(norm(p - point) - radius);
    case Kind::torus: return std::abs(norm(p - (point + unit(across) * radius)) - tube);
    case Kind::free: break;
  }
  return 0;
}

// An offset d n of a surface ends at A d n from its image, which is d |A^T n'| along the normal n'
// that the image has.
double Patch::depth(const Vec3& n) const {
  if (unstretched == 0) return deviation;
  Vec3 back{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) back[k] += stretch[3 * i + k] * n[i];
  return unstretched * norm(back);
}

Patch moved(Patch patch, const Affine& motion) {
  const Affine::Stretch stretch = motion.stretch();
  patch.point = motion(patch.point);
  patch.stretch = (Affine{motion.A, {}} * Affine{patch.stretch, {}}).A;
  if (stretch.is_even) {
    patch.axis = motion.turn(patch.axis);
    if (std::abs(stretch.greatest - 1) < kRigid) return patch;
    patch.axis = patch.axis * (1 / stretch.greatest);
    patch.radius *= stretch.greatest;
    if (patch.kind == Patch::Kind::torus) patch.tube *= stretch.greatest;
    patch.deviation *= stretch.greatest;
    return patch;
  }
  if (patch.kind == Patch::Kind::plane) {
    patch.axis = motion.turn_normal(patch.axis);
    return patch;
  }
  if (patch.unstretched == 0) {
    patch.unstretched = patch.deviation;
    patch.stretch = motion.A;
  }
  patch.kind = Patch::Kind::free;
  patch.deviation *= stretch.greatest;
  return patch;
}

namespace {

/// For each triangle of stretched patches the greatest angle with a neighbour of its patch [rad]:
/// what their area lacks goes by its square.
std::vector<double> bends_of(const PatchMesh& mesh) {
  std::vector<double> bends(mesh.triangles.size(), 0.0);
  const auto is_stretched = [&](std::size_t t) {
    return mesh.patches[mesh.patch_of[t]].unstretched > 0;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> first;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!is_stretched(t)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto side = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
      const auto [other, is_new] = first.try_emplace({side.first, side.second}, t);
      if (is_new || mesh.patch_of[other->second] != mesh.patch_of[t]) continue;
      const Vec3 a = unit(mesh.area_vector(t)), b = unit(mesh.area_vector(other->second));
      const double bend = std::atan2(norm(cross(a, b)), dot(a, b));
      bends[t] = std::max(bends[t], bend);
      bends[other->second] = std::max(bends[other->second], bend);
    }
  }
  return bends;
}

}  // namespace

void Box3::add(const Vec3& p) {
  for (std::size_t i = 0; i < 3; ++i) {
    low[i] = std::min(low[i], p[i]);
    high[i] = std::max(high[i], p[i]);
  }
}

void Box3::add(const Box3& b) {
  add(b.low);
  add(b.high);
}

bool Box3::meets(const Box3& b) const {
  for (std::size_t i = 0; i < 3; ++i)
    if (low[i] > b.high[i] || high[i] < b.low[i]) return false;
  return true;
}

double Box3::diagonal() const { return low[0] <= high[0] ? norm(high - low) : 0; }

Box3 box_of(const PatchMesh& mesh) {
  Box3 box;
  for (const Vec3& p : mesh.points) box.add(p);
  return box;
}

double volume_of(const PatchMesh& mesh) {
  const Box3 box = box_of(mesh);
  const Vec3 centre = (box.low + box.high) * 0.5;
  double six = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.corners(t);
    six += dot(a - centre, cross(b - centre, c - centre));
  }
  return six / 6;
}

// Signed tetrahedra from the box's centre to every triangle (Mirtich 1996 in Tonon's form). What a
// patch may be off its surface by, times its area, bounds the volume that lies between them.
Moments moments_of(const PatchMesh& mesh) {
  Moments m;
  if (mesh.triangles.empty()) return m;
  const Box3 box = box_of(mesh);
  const Vec3 centre = (box.low + box.high) * 0.5;
  Vec3 first{};
  std::array<double, 6> second{};  // xx yy zz xy yz xz about the centre
  constexpr std::array<std::array<std::size_t, 2>, 6> kPairs{
      {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};
  double gap = 0, gap_second = 0, gap_area = 0;
  const std::vector<double> bends = bends_of(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto corners = mesh.corners(t);
    const Vec3 a = corners[0] - centre, b = corners[1] - centre, c = corners[2] - centre;
    const double area = 0.5 * norm(cross(b - a, c - a)), volume = dot(a, cross(b, c)) / 6;
    const Vec3 s = a + b + c;
    m.area += area;
    m.volume += volume;
    first = first + s * (volume / 4);
    for (std::size_t k = 0; k < 6; ++k) {
      const auto [i, j] = kPairs[k];
      second[k] += volume / 20 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
    }
    const Patch& patch = mesh.patches[mesh.patch_of[t]];
    const double depth = patch.depth(unit(mesh.area_vector(t)));
    gap += depth * area;
    gap_second += depth * area / 12 * (dot(a, a) + dot(b, b) + dot(c, c) + dot(s, s));
    gap_area += patch.unstretched > 0 ? bends[t] * bends[t] / 4 * area : patch.area_error * area;
  }
  const double trace = second[0] + second[1] + second[2];
  m.exact = gap == 0;
  // Corners lie on the grid, integrals are summed in double.
  m.relative_error = m.volume > 0 ? 1e-12 + 4 * kGrid * m.area / m.volume : 0;
  if (gap > 0 && m.volume > 0) {
    m.relative_error = std::max({gap / m.volume, gap_area / m.area, m.relative_error});
    if (trace > 0) m.relative_error = std::max(m.relative_error, gap_second / trace);
  }
  m.first = first + centre * m.volume;
  std::array<double, 6> about_origin{};
  for (std::size_t k = 0; k < 6; ++k) {
    const auto [i, j] = kPairs[k];
    about_origin[k] =
        second[k] + centre[i] * first[j] + centre[j] * first[i] + m.volume * centre[i] * centre[j];
  }
  m.second = {about_origin[0], about_origin[1], about_origin[2],
              about_origin[3], about_origin[4], about_origin[5]};
  return m;
}

std::optional<std::vector<Triangle>> neighbours_of(std::span<const Triangle> triangles,
                                                   std::size_t corners) {
  struct HalfEdge {
    std::uint32_t to, triangle;
  };
  // Sides by the corner they start from.
  std::vector<std::uint32_t> first(corners + 1, 0);
  for (const Triangle& t : triangles)
    for (const std::uint32_t v : t) ++first[v];
  std::exclusive_scan(first.begin(), first.end(), first.begin(), 0U);
  std::vector<HalfEdge> sides(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      sides[first[triangles[t][k]]++] = {triangles[t][(k + 1) % 3], t};
  // first[v] is now the end of v's sides.
  std::vector<Triangle> beyond(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t to = triangles[t][k], from = triangles[t][(k + 1) % 3];
      std::size_t count = 0;
      for (std::uint32_t i = from == 0 ? 0 : first[from - 1]; i < first[from]; ++i)
        if (sides[i].to == to) {
          beyond[t][k] = sides[i].triangle;
          ++count;
        }
      if (count != 1) return std::nullopt;
    }
  return beyond;
}

std::vector<std::uint32_t> parts_of(std::span<const Triangle> neighbours) {
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> part(neighbours.size(), kNone), open;
  std::uint32_t count = 0;
  for (std::uint32_t seed = 0; seed < part.size(); ++seed) {
    if (part[seed] != kNone) continue;
    part[seed] = count;
    open.push_back(seed);
    while (!open.empty()) {
      const std::uint32_t t = open.back();
      open.pop_back();
      for (const std::uint32_t next : neighbours[t])
        if (part[next] == kNone) {
          part[next] = count;
          open.push_back(next);
        }
    }
    ++count;
  }
  return part;
}

}  // namespace robomosp::csg_cgal
