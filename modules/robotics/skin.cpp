// SPDX-License-Identifier: Apache-2.0
#include "robotics/skin.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "model/placement.h"
#include "robotics/build_model.h"
#include "spatial/pose.h"

namespace robomosp::robotics {
namespace {

using model::JointKind;
using spatial::add;
using spatial::scale;
using spatial::sub;

/// Sizes of one joint's housing and where it stands along the chain.
struct JointSize {
  double radius = 0;       ///< of the housing [m]
  double half = 0;         ///< half its length along the axis [m]
  double envelope = 0;     ///< of all housings at the same point [m]
  bool is_nested = false;  ///< shares its point with the joint before it
};

/// A link's row seen from the frame that carries it.
struct Hook {
  Vec3 foot{};        ///< where the joint's axis is met, before the offset d
  Vec3 axis{};        ///< the joint's axis
  double offset = 0;  ///< d: from the foot along the axis to the joint
};

Vec3 any_normal(const Vec3& z) {
  const std::size_t least = std::fabs(z[0]) <= std::fabs(z[1]) && std::fabs(z[0]) <= std::fabs(z[2])
                                ? 0
                                : (std::fabs(z[1]) <= std::fabs(z[2]) ? 1 : 2);
  Vec3 e{};
  e[least] = 1;
  return spatial::unit(sub(e, scale(z, spatial::dot(e, z))));
}

/// A frame at p with its z axis along `direction`.
Pose frame_along(const Vec3& p, const Vec3& direction) {
  const Vec3 z = spatial::unit(direction), x = any_normal(z), y = spatial::cross(z, x);
  Pose t;
  t.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
  t.p = p;
  return t;
}

class Pieces {
 public:
  explicit Pieces(std::vector<SkinPiece>& out) : out_(&out) {}

  void cylinder(const char* name, SkinRole role, const Vec3& from, const Vec3& to, double radius,
                double fillet) {
    const double length = spatial::distance(from, to);
    if (!(length > 1e-3 * radius)) return;
    put(name, role, CsgKind::cylinder, frame_along(from, sub(to, from)),
        {radius, length, std::min({fillet, 0.45 * radius, 0.45 * length}), 0, 0, 0});
  }
  void cone(const char* name, SkinRole role, const Vec3& from, const Vec3& to, double base,
            double top) {
    const double length = spatial::distance(from, to);
    if (!(length > 1e-3 * base)) return;
    if (std::fabs(base - top) < 1e-6 * base) return cylinder(name, role, from, to, base, 0);
    put(name, role, CsgKind::cone, frame_along(from, sub(to, from)), {base, top, length, 0, 0, 0});
  }
  void box(const char* name, SkinRole role, const Vec3& from, const Vec3& to, double width) {
    const double length = spatial::distance(from, to);
    if (!(length > 1e-3 * width)) return;
    put(name, role, CsgKind::box, frame_along(from, sub(to, from)),
        {width, width, length, std::min(0.12 * width, 0.3 * length), 0, 0});
  }
  void sphere(const char* name, SkinRole role, const Vec3& at, double radius) {
    put(name, role, CsgKind::sphere, spatial::translation(at), {radius, 0, 0, 0, 0, 0});
  }

 private:
  void put(const char* name, SkinRole role, CsgKind kind, const Pose& at,
           const std::array<double, 6>& sizes) {
    out_->push_back({CsgTree{{CsgNode{kind, -1, at, sizes, name}}}, role});
  }
  std::vector<SkinPiece>* out_;
};

double travel(const model::Link& link, double otherwise) {
  const double range = std::max(std::fabs(link.lower), std::fabs(link.upper));
  return std::isfinite(range) ? range : otherwise;
}

/// Draws link after link; all positions are in the frame of the link at hand.
class SkinBuilder {
 public:
  explicit SkinBuilder(const model::Robot& robot) : robot_(robot) {
    children_.resize(robot.links.size());
    for (std::size_t i = 0; i < robot.links.size(); ++i)
      if (robot.links[i].parent >= 0)
        children_[static_cast<std::size_t>(robot.links[i].parent)].push_back(i);
    measure();
  }

  Skin build() {
    Skin skin;
    draw_base(skin.base);
    skin.links.resize(robot_.links.size());
    for (std::size_t i = 0; i < robot_.links.size(); ++i)
      if (robot_.links[i].visible) draw_link(i, skin.links[i]);
    return skin;
  }

 private:
  // Where joint c is met in its parent link's frame.
  [[nodiscard]] Hook hook(std::size_t c) const {
    const model::DhRow& row = robot_.links[c].row;
    if (robot_.convention == model::Convention::dh) return {Vec3{}, Vec3{0, 0, 1}, row.d};
    const Pose t = spatial::mdh_pose(row.a, row.alpha, 0, 0);
    return {t.p, spatial::axis(t, 2), row.d};
  }
  [[nodiscard]] double common_normal(std::size_t i) const {
    return std::fabs(robot_.links[i].row.a);
  }
  // The link's own joint frame in the link's frame.
  [[nodiscard]] Pose own_joint(std::size_t i) const {
    return spatial::inverse(row_poses(robot_.convention, robot_.links[i].row).joint_T_link);
  }

  // Reach is the longest path of row lengths; housings taper along it and shrink where several
  // joints share a point, so that they nest.
  void measure() {
    const std::size_t n = robot_.links.size();
    std::vector<double> way(n), longest(n);
    double total = 0;
    std::size_t lengths = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const model::Link& link = robot_.links[i];
      const double slide = link.joint == JointKind::prismatic ? travel(link, 0) : 0;
      const double step = common_normal(i) + std::fabs(link.row.d) + slide;
      const double before = link.parent < 0 ? 0 : way[static_cast<std::size_t>(link.parent)];
      way[i] = before + step;
      for (const double l : {common_normal(i), std::fabs(link.row.d), slide})
        if (l > 0) total += l, ++lengths;
    }
    // Children come after parents, so one backward pass carries the longest path to the root.
    for (std::size_t i = n; i-- > 0;) {
      longest[i] = std::max(longest[i], way[i]);
      if (robot_.links[i].parent >= 0) {
        double& up = longest[static_cast<std::size_t>(robot_.links[i].parent)];
        up = std::max(up, longest[i]);
      }
    }
    double tool = spatial::norm(robot_.tool.position);
    reach_ = std::max(*std::max_element(longest.begin(), longest.end()) + tool, 0.0);
    if (!(reach_ > 1e-9)) reach_ = 1;
    const double typical = lengths > 0 ? total / static_cast<double>(lengths) : reach_;
    const double thickest = std::min(0.075 * reach_, 0.38 * typical);
    base_radius_ = thickest;
    sizes_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const model::Link& link = robot_.links[i];
      const double at = std::max(
          0.0, way[i] - (robot_.convention == model::Convention::dh ? common_normal(i) : 0.0));
      const double t = std::clamp(at / reach_, 0.0, 1.0);
      JointSize& size = sizes_[i];
      size.radius = thickest * (1 - 0.52 * t);
      size.half = size.envelope = 0.95 * size.radius;
      if (link.parent < 0 || link_offset(i) >= 1e-6 * reach_) continue;
      // A joint inside another one's housing is slimmer and sticks out of it on both sides; after
      // a few of them they are as slim as may be.
      const JointSize& outer = sizes_[static_cast<std::size_t>(link.parent)];
      size.is_nested = true;
      size.radius = std::max(0.78 * outer.radius, 0.3 * size.radius);
      size.half = 1.22 * outer.radius;
      size.envelope = std::max(outer.envelope, size.half);
    }
  }

  // Distance between joint i and the joint before it.
  [[nodiscard]] double link_offset(std::size_t i) const {
    const model::Link& link = robot_.links[i];
    const std::int32_t p = link.parent;
    const double a = robot_.convention == model::Convention::dh
                         ? (p < 0 ? 0 : common_normal(static_cast<std::size_t>(p)))
                         : common_normal(i);
    return a + std::fabs(link.row.d);
  }

  // The arm from `start` to the place where child c turns or slides, with what holds it there.
  void draw_arm(Pieces& pieces, const Vec3& start, double start_radius, std::size_t c) const {
    const model::Link& child = robot_.links[c];
    const Hook at = hook(c);
    const JointSize& size = sizes_[c];
    const double tube = 0.76 * size.radius;
    const Vec3 seat = add(at.foot, scale(at.axis, at.offset));
    const bool has_normal = spatial::distance(start, at.foot) > 0.2 * tube;
    const double hidden = child.joint == JointKind::fixed ? 0 : size.half;
    const bool has_offset =
        std::fabs(at.offset) > 1.05 * hidden && std::fabs(at.offset) > 0.2 * tube;
    if (has_normal)
      pieces.cone("arm", SkinRole::tube, start, at.foot, start_radius,
                  has_offset ? 0.5 * (start_radius + tube) : tube);
    if (has_offset) {
      const double begin = has_normal ? 0.5 * (start_radius + tube) : start_radius;
      const Vec3 end = sub(seat, scale(at.axis, std::copysign(hidden, at.offset)));
      if (has_normal) pieces.sphere("elbow", SkinRole::tube, at.foot, 1.06 * begin);
      pieces.cone("arm along axis", SkinRole::tube, at.foot, end, begin, tube);
      if (child.joint == JointKind::revolute) {
        const Vec3 inner = sub(end, scale(at.axis, std::copysign(0.18 * size.radius, at.offset)));
        if (spatial::distance(at.foot, end) > 0.4 * size.radius)
          pieces.cylinder("collar", SkinRole::tube, inner, end, 0.95 * size.radius,
                          0.06 * size.radius);
      }
    }
    draw_holder(pieces, at, seat, has_offset, c);
  }

  // What stays with the parent at child c: a ring round a hinge, a sleeve round a slide.
  void draw_holder(Pieces& pieces, const Hook& at, const Vec3& seat, bool has_offset,
                   std::size_t c) const {
    const model::Link& child = robot_.links[c];
    const JointSize& size = sizes_[c];
    const double r = size.radius;
    if (child.joint == JointKind::revolute && !has_offset && !size.is_nested) {
      const Vec3 h = scale(at.axis, 0.7 * r);
      pieces.cylinder("hinge ring", SkinRole::tube, sub(seat, h), add(seat, h), 1.08 * r, 0.12 * r);
    } else if (child.joint == JointKind::prismatic) {
      const Vec3 h = scale(at.axis, 1.1 * r);
      if (is_slim(c))
        pieces.cylinder("sleeve", SkinRole::tube, sub(seat, h), add(seat, h), r, 0.15 * r);
      else pieces.box("sleeve", SkinRole::tube, sub(seat, h), add(seat, h), 2.0 * r);
    } else if (child.joint == JointKind::fixed) {
      pieces.sphere("elbow", SkinRole::tube, seat, 0.8 * r);
    }
  }

  // Slides near the tool are round quills, those near the base square rails.
  [[nodiscard]] bool is_slim(std::size_t c) const { return sizes_[c].radius < 0.72 * base_radius_; }

  void draw_own_joint(Pieces& pieces, std::size_t i, bool is_leaf) const {
    const model::Link& link = robot_.links[i];
    const Pose joint = own_joint(i);
    const Vec3 z = spatial::axis(joint, 2);
    const double r = sizes_[i].radius, half = sizes_[i].half;
    const auto along = [&](double s) { return add(joint.p, scale(z, s)); };
    if (link.joint == JointKind::prismatic) {
      const double free = 0.5 * reach_;
      const double up = std::isfinite(link.upper) ? link.upper : free;
      const double low = std::isfinite(link.lower) ? link.lower : -free;
      const double back = -std::max(up, 0.0) - 1.3 * r, front = std::max(-low, 0.0) + 0.4 * r;
      if (is_slim(i))
        pieces.cylinder("quill", SkinRole::joint, along(back), along(front), 0.55 * r, 0.08 * r);
      else pieces.box("rail", SkinRole::joint, along(back), along(front), 1.25 * r);
      return;
    }
    if (link.joint == JointKind::fixed) return;
    const bool ends_here = is_leaf && common_normal_ahead(i) < 0.2 * r;
    if (ends_here && std::fabs(link.row.d) > 1.05 * half) {
      pieces.cylinder("wrist", SkinRole::joint, along(-half), along(-0.3 * r), r, 0.12 * r);
    } else if (ends_here) {
      pieces.cylinder("wrist shaft", SkinRole::joint, along(0), along(shaft_length(i) - 0.2 * r),
                      0.8 * r, 0.08 * r);
    } else {
      pieces.cylinder("housing", SkinRole::joint, along(-half), along(half), 0.98 * r, 0.16 * r);
      pieces.cylinder("caps", SkinRole::tube, along(-half - 0.05 * r), along(half + 0.05 * r),
                      0.62 * r, 0.04 * r);
    }
  }

  // How far the output of a last joint reaches out of the housings at its point.
  [[nodiscard]] double shaft_length(std::size_t i) const {
    return sizes_[i].is_nested ? 1.1 * sizes_[i].envelope + 0.5 * sizes_[i].radius
                               : 1.6 * sizes_[i].radius;
  }

  // Length of the tube from the link's joint to its own frame.
  [[nodiscard]] double common_normal_ahead(std::size_t i) const {
    return robot_.convention == model::Convention::dh ? common_normal(i) : 0.0;
  }

  // The end of a branch: arm to the link's frame, flange, and for the last link a rod to the tool.
  void draw_end(Pieces& pieces, std::size_t i) const {
    const model::Link& link = robot_.links[i];
    const double r = sizes_[i].radius;
    const Pose joint = own_joint(i);
    if (common_normal_ahead(i) >= 0.2 * r)
      pieces.cone("arm", SkinRole::tube, joint.p, Vec3{}, 0.76 * r, 0.6 * r);
    Vec3 face{};
    if (common_normal_ahead(i) >= 0.2 * r) {
      // A planar arm ends in a round tip rather than a flange beside its axis.
      pieces.cylinder("tip", SkinRole::joint, {0, 0, -0.45 * r}, {0, 0, 0.45 * r}, 0.72 * r,
                      0.1 * r);
    } else if (link.joint == JointKind::revolute && std::fabs(link.row.d) > 1.05 * sizes_[i].half) {
      pieces.cylinder("flange", SkinRole::tube, {0, 0, -0.3 * r}, face, 0.86 * r, 0.06 * r);
    } else {
      face = {0, 0, shaft_length(i)};
      pieces.cylinder("flange", SkinRole::tube, {0, 0, face[2] - 0.3 * r}, face, r, 0.06 * r);
    }
    if (i + 1 != robot_.links.size()) return;
    const Vec3 tool = robot_.tool.position;
    if (spatial::distance(face, tool) > 0.5 * r && spatial::norm(tool) > spatial::norm(face))
      pieces.cone("tool", SkinRole::joint, face, tool, 0.42 * r, 0.16 * r);
  }

  void draw_link(std::size_t i, std::vector<SkinPiece>& out) const {
    Pieces pieces(out);
    const bool is_leaf = children_[i].empty();
    draw_own_joint(pieces, i, is_leaf);
    const Vec3 start = own_joint(i).p;
    for (const std::size_t c : children_[i]) draw_arm(pieces, start, 0.76 * sizes_[i].radius, c);
    if (is_leaf) draw_end(pieces, i);
  }

  void draw_base(std::vector<SkinPiece>& out) const {
    Pieces pieces(out);
    const double r = base_radius_;
    // Where the first joint sits at the base frame itself, that frame is the shoulder: the
    // pedestal is then drawn below it.
    double floor = 0;
    for (std::size_t c = 0; c < robot_.links.size(); ++c) {
      const model::Link& link = robot_.links[c];
      const Hook at = hook(c);
      if (link.parent >= 0 || link.joint != JointKind::revolute) continue;
      if (std::fabs(at.offset) > 1.05 * sizes_[c].half || spatial::norm(at.foot) > 0.2 * r)
        continue;
      if (std::fabs(at.axis[2]) < 0.7) continue;
      floor = -2.4 * r;
      pieces.cone("pedestal", SkinRole::tube, {0, 0, floor},
                  {0, 0, at.offset - 0.7 * sizes_[c].half}, 1.12 * r, r);
    }
    pieces.cylinder("foot", SkinRole::joint, {0, 0, floor}, {0, 0, floor + 0.22 * r}, 1.55 * r,
                    0.06 * r);
    for (std::size_t c = 0; c < robot_.links.size(); ++c)
      if (robot_.links[c].parent < 0) draw_arm(pieces, Vec3{}, 1.12 * r, c);
  }

  const model::Robot& robot_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<JointSize> sizes_;
  double reach_ = 1, base_radius_ = 0.07;
};

}  // namespace

Skin make_skin(const model::Robot& robot) {
  if (robot.links.empty()) return {};
  return SkinBuilder(robot).build();
}

}  // namespace robomosp::robotics
