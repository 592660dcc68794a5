// SPDX-License-Identifier: Apache-2.0
#include "mesh_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "spatial/pose.h"
#include "spatial/principal.h"
#include "spatial/vec.h"

namespace robomosp::collision_fcl {
namespace {

using namespace spatial;

constexpr std::uint32_t kLeaf = 2;  ///< triangles that are not divided further

constexpr double kGjk = 4e-9;  ///< relative, by which GJK may be above a distance
/// Of the bodies' reach: surfaces that are no farther apart touch, as rounding decides.
constexpr double kTouch = 1e-14;

constexpr std::uint32_t kByNormals = 6;  ///< triangles from which their normals may divide them
constexpr std::uint32_t kDeep = 48;      ///< from which only places do
constexpr std::size_t kThin = 24;        ///< the least share of a part, its inverse

using Triangle = std::array<Vec3, 3>;

/// Nearest points of two triangles so far; squared = 0 where they meet.
struct Near {
  double squared = std::numeric_limits<double>::infinity();
  Vec3 on_a{}, on_b{};
  void take(const Vec3& a, const Vec3& b) {
    const Vec3 way = sub(b, a);
    if (const double d = dot(way, way); d < squared) squared = d, on_a = a, on_b = b;
  }
};

Vec3 along(const Vec3& from, const Vec3& to, double share) {
  return add(from, scale(sub(to, from), share));
}

/// Of two edges (Ericson, Real-Time Collision Detection, 2005, 5.1.9). Where they are nearly
/// parallel rounding decides where along them, so that their ends are tried as well.
void edges(const Vec3& p1, const Vec3& q1, const Vec3& p2, const Vec3& q2, Near& best) {
  const Vec3 d1 = sub(q1, p1), d2 = sub(q2, p2), r = sub(p1, p2);
  const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r), c = dot(d1, r), b = dot(d1, d2);
  if (!(a > 0) || !(e > 0)) {  // a point
    const double s = a > 0 ? std::clamp(-c / a, 0.0, 1.0) : 0;
    const double t = e > 0 ? std::clamp(f / e, 0.0, 1.0) : 0;
    best.take(along(p1, q1, s), along(p2, q2, t));
    return;
  }
  const double det = a * e - b * b;
  if (det <= 1e-6 * a * e) {
    for (const double s : {0.0, 1.0})
      best.take(along(p1, q1, s), along(p2, q2, std::clamp((b * s + f) / e, 0.0, 1.0)));
    for (const double t : {0.0, 1.0})
      best.take(along(p1, q1, std::clamp((b * t - c) / a, 0.0, 1.0)), along(p2, q2, t));
    if (!(det > 1e-14 * a * e)) return;
  }
  double s = std::clamp((b * f - c * e) / det, 0.0, 1.0);
  double t = (b * s + f) / e;
  if (t < 0) t = 0, s = std::clamp(-c / a, 0.0, 1.0);
  else if (t > 1) t = 1, s = std::clamp((b - c) / a, 0.0, 1.0);
  best.take(along(p1, q1, s), along(p2, q2, t));
}

/// Whether a point of the triangle's plane is in it.
bool is_over(const Triangle& t, const Vec3& normal, const Vec3& p) {
  for (std::size_t k = 0; k < 3; ++k)
    if (dot(cross(sub(t[(k + 1) % 3], t[k]), sub(p, t[k])), normal) < 0) return false;
  return true;
}

/// How far the corners of `other` are above the plane of a triangle, not divided by its normal's
/// length; false where no corner is nearer than `bound` and all are on one side.
struct Above {
  Vec3 normal{}, height{};
  double length = 0;
};
bool comes_near(const Triangle& t, const Triangle& other, double bound, Above& out) {
  out.normal = cross(sub(t[1], t[0]), sub(t[2], t[0]));
  out.length = norm(out.normal);
  for (std::size_t k = 0; k < 3; ++k) out.height[k] = dot(out.normal, sub(other[k], t[0]));
  const auto [low, high] = std::minmax({out.height[0], out.height[1], out.height[2]});
  return !(low > bound * out.length) && !(-high > bound * out.length);
}

/// Corners over the other's face, and edges through it.
void faces(const Triangle& t, const Above& above, const Triangle& other, bool is_first,
           Near& best) {
  if (!(above.length > 0)) return;
  const double nn = above.length * above.length;
  const auto take = [&](const Vec3& on_t, const Vec3& on_other) {
    if (is_first) best.take(on_t, on_other);
    else best.take(on_other, on_t);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const double h = above.height[k], next = above.height[(k + 1) % 3];
    if (h * h < best.squared * nn) {
      const Vec3 foot = sub(other[k], scale(above.normal, h / nn));
      if (is_over(t, above.normal, foot)) take(foot, other[k]);
    }
    if ((h < 0) != (next < 0)) {
      const Vec3 p = along(other[k], other[(k + 1) % 3], h / (h - next));
      if (is_over(t, above.normal, p)) take(p, p);
    }
  }
}

/// Takes the nearest points of the triangles where they are nearer than `best`.
void nearest(const Triangle& a, const Triangle& b, Near& best) {
  const double bound = std::sqrt(best.squared);
  Above above_a, above_b;
  if (!comes_near(a, b, bound, above_a) || !comes_near(b, a, bound, above_b)) return;
  faces(a, above_a, b, true, best);
  faces(b, above_b, a, false, best);
  if (best.squared == 0) return;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) edges(a[i], a[(i + 1) % 3], b[k], b[(k + 1) % 3], best);
}

/// How far two boxes of two frames are apart at least, by the six directions of their sides.
class BoxGap {
 public:
  explicit BoxGap(const Pose& a_T_b) : at_(a_T_b) {}
  /// A lesser bound where that is above `bound` already.
  [[nodiscard]] double operator()(const Pose& a, const Vec3& half_a, const Pose& b,
                                  const Vec3& half_b, double radii, double bound) const {
    const Vec3 c = sub(transform(at_, b.p), a.p);
    if (const double cc = dot(c, c), far = bound + radii; cc > far * far)
      return std::sqrt(cc) - radii;
    std::array<double, 9> turned{}, between{};  // b's axes in the frame of the first, and in a's
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        turned[3 * i + k] =
            at_.R[3 * i] * b.R[k] + at_.R[3 * i + 1] * b.R[3 + k] + at_.R[3 * i + 2] * b.R[6 + k];
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        between[3 * i + k] =
            std::fabs(a.R[i] * turned[k] + a.R[3 + i] * turned[3 + k] + a.R[6 + i] * turned[6 + k]);
    double in_a = 0, in_b = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double of_a = std::fabs(a.R[i] * c[0] + a.R[3 + i] * c[1] + a.R[6 + i] * c[2]) -
                          half_a[i] - between[3 * i] * half_b[0] - between[3 * i + 1] * half_b[1] -
                          between[3 * i + 2] * half_b[2];
      const double of_b =
          std::fabs(turned[i] * c[0] + turned[3 + i] * c[1] + turned[6 + i] * c[2]) - half_b[i] -
          between[i] * half_a[0] - between[3 + i] * half_a[1] - between[6 + i] * half_a[2];
      const double x = std::max(of_a, 0.0), y = std::max(of_b, 0.0);
      in_a += x * x;
      in_b += y * y;
    }
    return std::sqrt(std::max(in_a, in_b));
  }

 private:
  Pose at_;
};

/// Less than a gap by what rounding may have added, as the nearest must not be passed over.
double at_least(double gap, double reach) { return gap - 1e-14 * reach; }

/// Around a core, in the frame of the mesh.
Box box_of(const Core& core, const Pose& mesh_T_core) {
  Vec3 low{}, high{};
  std::uint32_t hint = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3 along{};
    along[k] = 1;
    const Vec3 d = rotate_back(mesh_T_core, along);
    high[k] = transform(mesh_T_core, support(core, d, hint))[k] + core.margin;
    low[k] = transform(mesh_T_core, support(core, scale(d, -1), hint))[k] - core.margin;
  }
  return {scale(add(low, high), 0.5), scale(sub(high, low), 0.5)};
}

/// Along the longest edge of a triangle and its normal.
void along_triangle(const Triangle& t, Pose& tight) {
  Vec3 longest{};
  for (std::size_t k = 0; k < 3; ++k)
    if (const Vec3 e = sub(t[(k + 1) % 3], t[k]); dot(e, e) > dot(longest, longest)) longest = e;
  const Vec3 x = unit(longest), z = unit(cross(sub(t[1], t[0]), sub(t[2], t[0])));
  if (!(dot(x, x) > 0.5) || !(dot(z, z) > 0.5) || !(std::fabs(dot(x, z)) < 1e-9)) return;
  const Vec3 y = cross(z, x);
  tight.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
}

/// Along the principal axes of the surface (Gottschalk, Lin, Manocha, SIGGRAPH 1996).
void along_surface(std::span<const std::uint32_t> triangles, std::span<const Triangle> corners,
                   const Vec3& from, Pose& tight) {
  double area = 0;
  Vec3 first{};
  Sym3 second;
  const auto square = [&](const Vec3& v, double weight) {
    second.xx += weight * v[0] * v[0];
    second.yy += weight * v[1] * v[1];
    second.zz += weight * v[2] * v[2];
    second.xy += weight * v[0] * v[1];
    second.yz += weight * v[1] * v[2];
    second.xz += weight * v[0] * v[2];
  };
  for (const std::uint32_t i : triangles) {
    const Vec3 a = sub(corners[i][0], from), b = sub(corners[i][1], from),
               c = sub(corners[i][2], from);
    const double own = norm(cross(sub(b, a), sub(c, a)));
    const Vec3 sum = add(a, add(b, c));
    area += own;
    first = add(first, scale(sum, own / 3));
    for (const Vec3& v : {a, b, c, sum}) square(v, own / 12);
  }
  if (area > 0) {
    square(first, -1 / area);
    const double trace = second.xx + second.yy + second.zz;
    if (trace > 0 && std::isfinite(trace)) {
      for (double* x : {&second.xx, &second.yy, &second.zz, &second.xy, &second.yz, &second.xz})
        *x /= trace;
      tight.R = principal(second).axes;
    }
  }
}

/// Which triangles belong to the first half, by their normals.
struct Side {
  Vec3 axis;
  double least;
  bool is_either_way;
  bool operator()(const Vec3& normal) const {
    const double d = dot(axis, normal);
    return (is_either_way ? std::fabs(d) : d) > least;
  }
};

/// A division by normals, such as the face of a flange from its rim, where that makes smaller boxes
/// than the one by places whose first half are the first `half` triangles.
std::optional<Side> better_by_normals(std::span<const std::uint32_t> triangles, std::size_t half,
                                      const Pose& tight, std::span<const Vec3> normals,
                                      std::span<const Box> turned) {
  struct HalfBox {
    Vec3 low{1, 1, 1}, high{-1, -1, -1};
    std::size_t count = 0;
    void add(const Box& b) {
      const bool is_first = count++ == 0;
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = is_first ? b.centre[k] - b.half[k] : std::min(low[k], b.centre[k] - b.half[k]);
        high[k] = is_first ? b.centre[k] + b.half[k] : std::max(high[k], b.centre[k] + b.half[k]);
      }
    }
    [[nodiscard]] double cost() const {
      const Vec3 d = sub(high, low);
      return static_cast<double>(count) * (d[0] * d[1] + d[1] * d[2] + d[2] * d[0]);
    }
  };
  double least = -1;  // by places, when it is first needed
  const auto by_places = [&] {
    std::array<HalfBox, 2> by_place;
    for (std::size_t i = 0; i < triangles.size(); ++i)
      by_place[i < half ? 0 : 1].add(turned[triangles[i]]);
    return by_place[0].cost() + by_place[1].cost();
  };
  std::optional<Side> best;
  for (std::size_t k = 0; k < 3; ++k)
    for (const bool is_either_way : {true, false}) {
      const Side side{axis(tight, k), is_either_way ? 0.9 : 0.0, is_either_way};
      std::size_t first = 0;
      for (const std::uint32_t i : triangles) first += side(normals[i]) ? 1 : 0;
      if (std::min(first, triangles.size() - first) * kThin < triangles.size()) continue;
      std::array<HalfBox, 2> parts;
      for (const std::uint32_t i : triangles) parts[side(normals[i]) ? 0 : 1].add(turned[i]);
      if (least < 0) least = by_places();
      if (const double cost = parts[0].cost() + parts[1].cost(); cost < least)
        least = cost, best = side;
    }
  return best;
}

}  // namespace

MeshTree::MeshTree(std::span<const Vec3> points,
                   std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<std::array<Vec3, 3>> given;
  std::vector<Box> boxes;
  for (const auto& t : triangles) {
    given.push_back({points[t[0]], points[t[1]], points[t[2]]});
    boxes.push_back(box_around(given.back()));
  }
  std::vector<Vec3> normals;
  for (const Triangle& t : given) {
    const Vec3 n = cross(sub(t[1], t[0]), sub(t[2], t[0]));
    const double length = norm(n);
    normals.push_back(length > 0 ? scale(n, 1 / length) : Vec3{});
  }
  // Divided without recursion, since a mesh of a line of triangles is as deep as any other.
  std::vector<std::uint32_t> order(given.size());
  std::iota(order.begin(), order.end(), 0U);
  struct Job {
    std::uint32_t node, first, count, depth;
  };
  nodes_.emplace_back();
  std::vector<Job> jobs{{0, 0, static_cast<std::uint32_t>(given.size()), 0}};
  std::vector<Box> turned(given.size());  // of the triangles of a node, along its tight box
  while (!jobs.empty()) {
    const Job job = jobs.back();
    jobs.pop_back();
    const auto begin = order.begin() + job.first, end = begin + job.count;
    Box box = boxes[*begin];
    for (auto i = begin; i != end; ++i) box = around(box, boxes[*i]);
    nodes_[job.node].box = box;
    make_tight(nodes_[job.node], {&*begin, job.count}, given, turned);
    if (job.count <= kLeaf) {
      nodes_[job.node].first = job.first;
      nodes_[job.node].count = job.count;
      continue;
    }
    const Node& own = nodes_[job.node];
    const auto longest = static_cast<std::size_t>(
        std::max_element(own.half.begin(), own.half.end()) - own.half.begin());
    std::uint32_t half = job.count / 2;
    std::nth_element(begin, begin + half, end, [&](std::uint32_t a, std::uint32_t b) {
      return turned[a].centre[longest] < turned[b].centre[longest];
    });
    if (job.count >= kByNormals && job.depth < kDeep) {
      if (const auto side =
              better_by_normals({&*begin, job.count}, half, own.tight, normals, turned))
        half = static_cast<std::uint32_t>(
            std::partition(begin, end, [&](std::uint32_t i) { return (*side)(normals[i]); }) -
            begin);
    }
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    nodes_[job.node].first = child;
    nodes_.resize(nodes_.size() + 2);
    jobs.push_back({child, job.first, half, job.depth + 1});
    jobs.push_back({child + 1, job.first + half, job.count - half, job.depth + 1});
  }
  for (const std::uint32_t i : order) corners_.push_back(given[i]);
}

void MeshTree::make_tight(Node& node, std::span<const std::uint32_t> triangles,
                          std::span<const std::array<Vec3, 3>> corners, std::span<Box> turned) {
  const Vec3& from = node.box.centre;  // against cancellation
  node.tight = {};
  if (triangles.size() <= kLeaf) along_triangle(corners[triangles[0]], node.tight);
  else along_surface(triangles, corners, from, node.tight);
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf};
  for (const std::uint32_t i : triangles) {
    Triangle t = corners[i];
    for (Vec3& p : t) p = rotate_back(node.tight, sub(p, from));
    turned[i] = box_around(t);
    for (const Vec3& v : t)
      for (std::size_t k = 0; k < 3; ++k)
        low[k] = std::min(low[k], v[k]), high[k] = std::max(high[k], v[k]);
  }
  node.half = scale(sub(high, low), 0.5);
  node.radius = norm(node.half);
  node.tight.p = add(from, rotate(node.tight, scale(add(low, high), 0.5)));
}

Apart MeshTree::separation(const Core& core, const Pose& core_T_mesh, double interest,
                           double tolerance) const {
  const Pose mesh_T_core = inverse(core_T_mesh);
  const Box box = box_of(core, mesh_T_core);
  Apart best;
  best.state = Apart::State::beyond;
  best.distance = interest;
  double bound = enough(interest, tolerance);               ///< from which nothing is looked at
  double passed = std::numeric_limits<double>::infinity();  ///< least of what was not
  Core triangle, block;
  triangle.kind = Core::Kind::triangle;
  block.kind = Core::Kind::box;
  struct Open {
    double gap;
    std::uint32_t node;
  };
  std::vector<Open> open{{gap(nodes_[0].box, box), 0}};
  while (!open.empty()) {
    Open next = open.back();
    open.pop_back();
    const Node& node = nodes_[next.node];
    if (!(next.gap > bound) && std::isfinite(bound) && node.count == 0) {
      // The box around the shape is loose; its distance from the tight box of triangles is not.
      block.half = node.half;
      const Apart at =
          collision_fcl::separation(core, block, compose(core_T_mesh, node.tight), bound);
      if (at.state == Apart::State::beyond) next.gap = std::max(next.gap, bound);
      else if (at.state == Apart::State::apart)
        next.gap = std::max(next.gap, at.distance * (1 - kGjk));
    }
    if (next.gap > bound || (tolerance > 0 && next.gap >= bound)) {
      passed = std::min(passed, next.gap);
      continue;
    }
    if (node.count == 0) {
      Open a{gap(nodes_[node.first].box, box), node.first};
      Open b{gap(nodes_[node.first + 1].box, box), node.first + 1};
      if (a.gap < b.gap) std::swap(a, b);
      open.push_back(a);
      open.push_back(b);  // the nearer one first
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      triangle.corners = corners_[i];
      const Apart at = collision_fcl::separation(core, triangle, core_T_mesh, best.distance);
      if (at.state == Apart::State::overlap ||
          (at.state == Apart::State::apart && at.distance <= 0)) {
        best = at;
        best.state = Apart::State::overlap;
        return best;
      }
      if (at.state == Apart::State::apart && at.distance <= best.distance) {
        best = at;
        bound = enough(best.distance, tolerance);
      }
    }
  }
  best.distance = std::min(best.distance, passed);
  return best;
}

Apart MeshTree::separation(const MeshTree& other, const Pose& this_T_other, double interest,
                           double tolerance) const {
  const BoxGap gap_of(this_T_other);
  const double reach = norm(this_T_other.p) + norm(nodes_[0].box.centre) +
                       norm(nodes_[0].box.half) + norm(other.nodes_[0].box.centre) +
                       norm(other.nodes_[0].box.half);
  double bound = enough(interest, tolerance);
  const auto apart = [&](const Node& a, const Node& b) {
    return at_least(gap_of(a.tight, a.half, b.tight, b.half, a.radius + b.radius, bound), reach);
  };
  Near best;
  const double touch = kTouch * reach;
  // Infinity stays what it is.
  best.squared = std::max(interest * interest, 2 * touch * touch);
  bool found = false;
  double passed = std::numeric_limits<double>::infinity();  ///< least of what was not looked at
  struct Open {
    double gap;
    std::uint32_t a, b;
  };
  std::vector<Open> open;
  open.reserve(128);
  open.push_back({apart(nodes_[0], other.nodes_[0]), 0, 0});
  const auto size = [](const Node& n) { return dot(n.half, n.half); };
  while (!open.empty()) {
    const Open next = open.back();
    open.pop_back();
    if (next.gap > bound) {
      passed = std::min(passed, next.gap);
      continue;
    }
    const Node &a = nodes_[next.a], &b = other.nodes_[next.b];
    if (a.count > 0 && b.count > 0) {
      for (std::uint32_t k = b.first; k < b.first + b.count; ++k) {
        Triangle t = other.corners_[k];
        for (Vec3& p : t) p = transform(this_T_other, p);
        for (std::uint32_t i = a.first; i < a.first + a.count; ++i) {
          const double before = best.squared;
          nearest(corners_[i], t, best);
          if (!(best.squared < before)) continue;
          found = true;
          if (!(best.squared > touch * touch))
            return {Apart::State::overlap, 0, best.on_a, best.on_b, true};
          bound = enough(std::sqrt(best.squared), tolerance);
        }
      }
      continue;
    }
    const bool splits_a = b.count > 0 || (a.count == 0 && size(a) >= size(b));
    const std::uint32_t child = splits_a ? a.first : b.first;
    Open first, second;
    if (splits_a) {
      first = {apart(nodes_[child], b), child, next.b};
      second = {apart(nodes_[child + 1], b), child + 1, next.b};
    } else {
      first = {apart(a, other.nodes_[child]), next.a, child};
      second = {apart(a, other.nodes_[child + 1]), next.a, child + 1};
    }
    if (first.gap < second.gap) std::swap(first, second);
    open.push_back(first);
    open.push_back(second);
  }
  if (!found || best.squared > interest * interest)
    return {Apart::State::beyond, std::min(interest, passed), {}, {}, true};
  const double least = std::sqrt(best.squared);
  const double told = std::min(least, passed);
  return {Apart::State::apart, told, best.on_a, best.on_b, true};
}

}  // namespace robomosp::collision_fcl
