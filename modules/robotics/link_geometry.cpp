// SPDX-License-Identifier: Apache-2.0
#include "robotics/link_geometry.h"

#include <algorithm>
#include <cmath>
#include <optional>
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
  explicit Pieces(std::vector<LinkGeometryPiece>& out) : out_(&out) {}

  void cylinder(const char* name, LinkGeometryRole role, const Vec3& from, const Vec3& to,
                double radius, double fillet) {
    const double length = spatial::distance(from, to);
    if (!(length > 1e-3 * radius)) return;
    put(name, role, CsgKind::cylinder, frame_along(from, sub(to, from)),
        {radius, length, std::min({fillet, 0.45 * radius, 0.45 * length}), 0, 0, 0});
  }
  void cone(const char* name, LinkGeometryRole role, const Vec3& from, const Vec3& to, double base,
            double top) {
    const double length = spatial::distance(from, to);
    if (!(length > 1e-3 * base)) return;
    if (std::fabs(base - top) < 1e-6 * base) return cylinder(name, role, from, to, base, 0);
    put(name, role, CsgKind::cone, frame_along(from, sub(to, from)), {base, top, length, 0, 0, 0});
  }
  void box(const char* name, LinkGeometryRole role, const Vec3& from, const Vec3& to,
           double width) {
    const double length = spatial::distance(from, to);
    if (!(length > 1e-3 * width)) return;
    put(name, role, CsgKind::box, frame_along(from, sub(to, from)),
        {width, width, length, std::min(0.12 * width, 0.3 * length), 0, 0});
  }
  void sphere(const char* name, LinkGeometryRole role, const Vec3& at, double radius) {
    put(name, role, CsgKind::sphere, spatial::translation(at), {radius, 0, 0, 0, 0, 0});
  }

 private:
  void put(const char* name, LinkGeometryRole role, CsgKind kind, const Pose& at,
           const std::array<double, 6>& sizes) {
    out_->push_back({CsgTree{{CsgNode{kind, -1, at, sizes, name}}}, role});
  }
  std::vector<LinkGeometryPiece>* out_;
};

double travel(const model::Link& link, double otherwise) {
  const double range = std::max(std::fabs(link.lower), std::fabs(link.upper));
  return std::isfinite(range) ? range : otherwise;
}

/// Draws link after link; all positions are in the frame of the link at hand.
class LinkGeometryBuilder {
 public:
  explicit LinkGeometryBuilder(const model::Robot& robot) : robot_(robot) {
    children_.resize(robot.links.size());
    for (std::size_t i = 0; i < robot.links.size(); ++i)
      if (robot.links[i].parent >= 0)
        children_[static_cast<std::size_t>(robot.links[i].parent)].push_back(i);
    find_attachments();
    measure();
  }

  LinkGeometry build() {
    LinkGeometry skin;
    draw_base(skin.base);
    skin.links.resize(robot_.links.size());
    for (std::size_t i = 0; i < robot_.links.size(); ++i)
      if (robot_.links[i].visible) draw_link(i, skin.links[i]);
    return skin;
  }

 private:
  /// Where something other than a link is held: a loop's frame or a further tool.
  struct Attachment {
    Pose at;                              ///< in the link's frame
    std::optional<model::LoopKind> loop;  ///< none = a tool
    bool has_pin = false;                 ///< draws the pin of its loop
  };

  void find_attachments() {
    attachments_.resize(robot_.links.size() + 1);  // the base is the last one
    const auto of = [this](std::int32_t link) -> std::vector<Attachment>& {
      return link < 0 ? attachments_.back() : attachments_[static_cast<std::size_t>(link)];
    };
    for (const model::LoopClosure& loop : robot_.loops) {
      of(loop.link_a).push_back({model::pose(loop.in_a), loop.kind, true});
      of(loop.link_b).push_back({model::pose(loop.in_b), loop.kind, false});
    }
    for (const model::RobotTool& tool : robot_.tools)
      if (tool.link >= 0)  // a mark on the base is no arm
        of(tool.link).push_back({model::pose(tool.placement), std::nullopt, false});
  }
  [[nodiscard]] model::Convention convention(std::size_t i) const {
    return robot_.links[i].convention.value_or(robot_.convention);
  }
  // Distance of the link's farthest attachment from its frame.
  [[nodiscard]] double attachment_reach(std::size_t i) const {
    double most = 0;
    for (const Attachment& a : attachments_[i]) most = std::max(most, spatial::norm(a.at.p));
    return most;
  }

  // Where joint c is met in its parent link's frame.
  [[nodiscard]] Hook hook(std::size_t c) const {
    const model::DhRow& row = robot_.links[c].row;
    if (robot_.links[c].origin) {
      const Pose t = link_joint_poses(robot_, c).parent_T_joint;
      return {t.p, spatial::axis(t, 2), 0};
    }
    if (convention(c) == model::Convention::dh) return {Vec3{}, Vec3{0, 0, 1}, row.d};
    const Pose t = spatial::mdh_pose(row.a, row.alpha, 0, 0);
    return {t.p, spatial::axis(t, 2), row.d};
  }
  [[nodiscard]] double common_normal(std::size_t i) const {
    const model::Link& link = robot_.links[i];
    return link.origin ? spatial::norm(model::position(*link.origin)) : std::fabs(link.row.a);
  }
  // The link's own joint frame in the link's frame.
  [[nodiscard]] Pose own_joint(std::size_t i) const {
    return spatial::inverse(link_joint_poses(robot_, i).joint_T_link);
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
    // A loop's frame or a tool is as far as a link more; those on the base count as well.
    for (std::size_t i = 0; i <= n; ++i)
      for (const Attachment& a : attachments_[i])
        if (const double l = spatial::norm(a.at.p); l > 0) {
          total += l, ++lengths;
          if (i < n) longest[i] = std::max(longest[i], way[i] + l);
        }
    for (std::size_t i = 0; i < n; ++i) longest[0] = std::max(longest[0], longest[i]);
    double tool = spatial::norm(robot_.tool.position);
    reach_ = std::max(*std::max_element(longest.begin(), longest.end()) + tool, 0.0);
    if (!(reach_ > 1e-9)) reach_ = 1;
    const double typical = lengths > 0 ? total / static_cast<double>(lengths) : reach_;
    const double thickest = std::min(0.075 * reach_, 0.38 * typical);
    base_radius_ = thickest;
    sizes_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const model::Link& link = robot_.links[i];
      const double at = std::max(0.0, way[i] - (has_normal_ahead(i) ? common_normal(i) : 0.0));
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
    if (link.origin) return common_normal(i);
    const double a = convention(i) == model::Convention::dh
                         ? (p < 0 ? 0 : common_normal_ahead(static_cast<std::size_t>(p)))
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
      pieces.cone("arm", LinkGeometryRole::tube, start, at.foot, start_radius,
                  has_offset ? 0.5 * (start_radius + tube) : tube);
    if (has_offset) {
      const double begin = has_normal ? 0.5 * (start_radius + tube) : start_radius;
      const Vec3 end = sub(seat, scale(at.axis, std::copysign(hidden, at.offset)));
      if (has_normal) pieces.sphere("elbow", LinkGeometryRole::tube, at.foot, 1.06 * begin);
      pieces.cone("arm along axis", LinkGeometryRole::tube, at.foot, end, begin, tube);
      if (child.joint == JointKind::revolute) {
        const Vec3 inner = sub(end, scale(at.axis, std::copysign(0.18 * size.radius, at.offset)));
        if (spatial::distance(at.foot, end) > 0.4 * size.radius)
          pieces.cylinder("collar", LinkGeometryRole::tube, inner, end, 0.95 * size.radius,
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
      pieces.cylinder("hinge ring", LinkGeometryRole::tube, sub(seat, h), add(seat, h), 1.08 * r,
                      0.12 * r);
    } else if (child.joint == JointKind::prismatic || child.joint == JointKind::cylindrical) {
      const Vec3 h = scale(at.axis, 1.1 * r);
      if (is_slim(c) || child.joint == JointKind::cylindrical)
        pieces.cylinder("sleeve", LinkGeometryRole::tube, sub(seat, h), add(seat, h), r, 0.15 * r);
      else pieces.box("sleeve", LinkGeometryRole::tube, sub(seat, h), add(seat, h), 2.0 * r);
    } else if (child.joint == JointKind::fixed) {
      pieces.sphere("elbow", LinkGeometryRole::tube, seat, 0.8 * r);
    } else if (child.joint == JointKind::universal || child.joint == JointKind::spherical) {
      const Vec3 h = scale(at.axis, 0.35 * r);
      pieces.cylinder("socket", LinkGeometryRole::tube, sub(seat, h), add(seat, h), 1.1 * r,
                      0.1 * r);
    } else if (child.joint == JointKind::planar) {
      const Vec3 h = scale(at.axis, 0.6 * r);
      pieces.cylinder("table", LinkGeometryRole::tube, sub(seat, scale(h, 1.3)), sub(seat, h),
                      0.4 * reach_, 0.05 * r);
    }
  }

  // A slide that ends at a ball does not reach through it.
  [[nodiscard]] bool ends_in_ball(std::size_t i) const {
    return std::any_of(attachments_[i].begin(), attachments_[i].end(), [](const Attachment& a) {
      return a.loop == model::LoopKind::point && spatial::norm(a.at.p) < 1e-9;
    });
  }

  // Slides near the tool are round quills, those near the base square rails.
  [[nodiscard]] bool is_slim(std::size_t c) const { return sizes_[c].radius < 0.72 * base_radius_; }

  void draw_own_joint(Pieces& pieces, std::size_t i, bool is_leaf) const {
    const model::Link& link = robot_.links[i];
    const Pose joint = own_joint(i);
    const Vec3 z = spatial::axis(joint, 2);
    const double r = sizes_[i].radius, half = sizes_[i].half;
    const auto along = [&](double s) { return add(joint.p, scale(z, s)); };
    if (link.joint == JointKind::free) return draw_free_body(pieces, i);
    if (link.joint == JointKind::spherical)
      return pieces.sphere("ball", LinkGeometryRole::joint, joint.p, 0.95 * r);
    if (link.joint == JointKind::planar)
      return pieces.cylinder("puck", LinkGeometryRole::joint, along(-0.6 * r), along(0.6 * r),
                             1.4 * r, 0.1 * r);
    if (link.joint == JointKind::universal) {
      // The cross: its second axis is carried by the link.
      const Vec3 x = scale(spatial::axis(joint, 0), 1.05 * r);
      pieces.cylinder("cross pin", LinkGeometryRole::joint, sub(joint.p, x), add(joint.p, x),
                      0.4 * r, 0.05 * r);
      return pieces.sphere("cross", LinkGeometryRole::joint, joint.p, 0.7 * r);
    }
    if (link.joint == JointKind::prismatic || link.joint == JointKind::cylindrical) {
      const double free = 0.5 * reach_;
      const double up = std::isfinite(link.upper) ? link.upper : free;
      const double low = std::isfinite(link.lower) ? link.lower : -free;
      const double back = -std::max(up, 0.0) - 1.3 * r,
                   front = ends_in_ball(i) ? 0 : std::max(-low, 0.0) + 0.4 * r;
      if (is_slim(i) || link.joint == JointKind::cylindrical)
        pieces.cylinder("quill", LinkGeometryRole::joint, along(back), along(front), 0.55 * r,
                        0.08 * r);
      else pieces.box("rail", LinkGeometryRole::joint, along(back), along(front), 1.25 * r);
      return;
    }
    if (link.joint == JointKind::fixed) return;
    const bool ends_here = is_leaf && common_normal_ahead(i) < 0.2 * r;
    if (ends_here && std::fabs(link.row.d) > 1.05 * half) {
      pieces.cylinder("wrist", LinkGeometryRole::joint, along(-half), along(-0.3 * r), r, 0.12 * r);
    } else if (ends_here) {
      pieces.cylinder("wrist shaft", LinkGeometryRole::joint, along(0),
                      along(shaft_length(i) - 0.2 * r), 0.8 * r, 0.08 * r);
    } else {
      pieces.cylinder("housing", LinkGeometryRole::joint, along(-half), along(half), 0.98 * r,
                      0.16 * r);
      pieces.cylinder("caps", LinkGeometryRole::tube, along(-half - 0.05 * r),
                      along(half + 0.05 * r), 0.62 * r, 0.04 * r);
    }
  }

  // How far the output of a last joint reaches out of the housings at its point.
  [[nodiscard]] double shaft_length(std::size_t i) const {
    return sizes_[i].is_nested ? 1.1 * sizes_[i].envelope + 0.5 * sizes_[i].radius
                               : 1.6 * sizes_[i].radius;
  }

  [[nodiscard]] bool has_normal_ahead(std::size_t i) const {
    return !robot_.links[i].origin && convention(i) == model::Convention::dh;
  }
  // Length of the tube from the link's joint to its own frame.
  [[nodiscard]] double common_normal_ahead(std::size_t i) const {
    return has_normal_ahead(i) ? common_normal(i) : 0.0;
  }

  // The end of a branch: arm to the link's frame, flange, and for the last link a rod to the tool.
  void draw_end(Pieces& pieces, std::size_t i) const {
    const model::Link& link = robot_.links[i];
    const double r = sizes_[i].radius;
    const Pose joint = own_joint(i);
    if (common_normal_ahead(i) >= 0.2 * r)
      pieces.cone("arm", LinkGeometryRole::tube, joint.p, Vec3{}, 0.76 * r, 0.6 * r);
    Vec3 face{};
    if (common_normal_ahead(i) >= 0.2 * r) {
      // A planar arm ends in a round tip rather than a flange beside its axis.
      pieces.cylinder("tip", LinkGeometryRole::joint, {0, 0, -0.45 * r}, {0, 0, 0.45 * r}, 0.72 * r,
                      0.1 * r);
    } else if (link.joint == JointKind::revolute && std::fabs(link.row.d) > 1.05 * sizes_[i].half) {
      pieces.cylinder("flange", LinkGeometryRole::tube, {0, 0, -0.3 * r}, face, 0.86 * r, 0.06 * r);
    } else {
      face = {0, 0, shaft_length(i)};
      pieces.cylinder("flange", LinkGeometryRole::tube, {0, 0, face[2] - 0.3 * r}, face, r,
                      0.06 * r);
    }
    if (i + 1 != robot_.links.size()) return;
    const Vec3 tool = robot_.tool.position;
    if (spatial::distance(face, tool) > 0.5 * r && spatial::norm(tool) > spatial::norm(face))
      pieces.cone("tool", LinkGeometryRole::joint, face, tool, 0.42 * r, 0.16 * r);
  }

  // A floating base is a box; a platform held at three or more points is a disc through them.
  void draw_free_body(Pieces& pieces, std::size_t i) const {
    const double r = sizes_[i].radius;
    if (attachments_[i].size() >= 3) {
      const double radius = 1.05 * attachment_reach(i);
      return pieces.cylinder("platform", LinkGeometryRole::tube, {0, 0, 0}, {0, 0, 0.5 * r}, radius,
                             0.1 * r);
    }
    // Wide enough to carry what stands on it.
    double half = 2.2 * r;
    for (const std::size_t c : children_[i])
      for (const double x : hook(c).foot) half = std::max(half, 0.95 * std::fabs(x));
    pieces.box("body", LinkGeometryRole::tube, {0, 0, -half}, {0, 0, half}, 2 * half);
  }

  // Tubes from the link's joint to what it holds, with pins and balls where loops close.
  void draw_attachments(Pieces& pieces, const Vec3& start, double radius,
                        const std::vector<Attachment>& all) const {
    for (const Attachment& a : all) {
      const double pin = 0.85 * radius;
      if (spatial::distance(start, a.at.p) > 0.3 * radius)
        pieces.cone("arm to loop", LinkGeometryRole::tube, start, a.at.p, radius,
                    a.loop ? 0.85 * radius : 0.4 * radius);
      if (!a.loop) continue;
      if (*a.loop == model::LoopKind::point) {
        if (a.has_pin) pieces.sphere("ball", LinkGeometryRole::joint, a.at.p, 1.25 * pin);
        continue;
      }
      const Vec3 h = scale(spatial::axis(a.at, 2), a.has_pin ? 1.25 * pin : 0.9 * pin);
      pieces.cylinder(a.has_pin ? "pin" : "eye",
                      a.has_pin ? LinkGeometryRole::joint : LinkGeometryRole::tube, sub(a.at.p, h),
                      add(a.at.p, h), a.has_pin ? 0.8 * pin : 1.15 * pin, 0.1 * pin);
    }
  }

  void draw_link(std::size_t i, std::vector<LinkGeometryPiece>& out) const {
    Pieces pieces(out);
    const bool is_held = std::any_of(attachments_[i].begin(), attachments_[i].end(),
                                     [](const Attachment& a) { return a.loop.has_value(); });
    const bool is_leaf =
        children_[i].empty() && !is_held && robot_.links[i].joint != JointKind::free;
    draw_own_joint(pieces, i, is_leaf);
    const Vec3 start = own_joint(i).p;
    for (const std::size_t c : children_[i]) draw_arm(pieces, start, 0.76 * sizes_[i].radius, c);
    if (is_leaf) draw_end(pieces, i);
    const bool is_disc = robot_.links[i].joint == JointKind::free && attachments_[i].size() >= 3;
    draw_attachments(pieces, is_held && has_normal_ahead(i) ? start : own_joint(i).p,
                     is_disc ? 0.5 * sizes_[i].radius : 0.6 * sizes_[i].radius, attachments_[i]);
  }

  void draw_base(std::vector<LinkGeometryPiece>& out) const {
    Pieces pieces(out);
    const double r = base_radius_;
    // A floating robot has no foot.
    const bool floats = std::none_of(robot_.links.begin(), robot_.links.end(), [](const auto& l) {
      return l.parent < 0 && l.joint != JointKind::free;
    });
    if (floats) return;
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
      pieces.cone("pedestal", LinkGeometryRole::tube, {0, 0, floor},
                  {0, 0, at.offset - 0.7 * sizes_[c].half}, 1.12 * r, r);
    }
    pieces.cylinder("foot", LinkGeometryRole::joint, {0, 0, floor}, {0, 0, floor + 0.22 * r},
                    1.55 * r, 0.06 * r);
    for (std::size_t c = 0; c < robot_.links.size(); ++c)
      if (robot_.links[c].parent < 0 && robot_.links[c].joint != JointKind::free)
        draw_arm(pieces, Vec3{}, 1.12 * r, c);
    draw_attachments(pieces, Vec3{}, 0.6 * r, attachments_.back());
  }

  const model::Robot& robot_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<std::vector<Attachment>> attachments_;  ///< of every link, then of the base
  std::vector<JointSize> sizes_;
  double reach_ = 1, base_radius_ = 0.07;
};

}  // namespace

LinkGeometry make_link_geometry(const model::Robot& robot) {
  if (robot.links.empty()) return {};
  return LinkGeometryBuilder(robot).build();
}

std::vector<bool> generated_bodies(const model::Robot& robot) {
  std::vector<bool> out(robot.links.size() + 1);
  const bool is_any_designed =
      !robot.base_parts.empty() || std::any_of(robot.links.begin(), robot.links.end(),
                                               [](const auto& l) { return !l.parts.empty(); });
  if (!is_any_designed) {
    out.assign(out.size(), true);
    for (std::size_t i = 0; i < robot.links.size(); ++i) out[i + 1] = robot.links[i].visible;
    return out;
  }
  std::vector<bool> is_on_base(robot.links.size());  // moves as the base does
  bool is_base_designed = !robot.base_parts.empty(), carries_generated = false;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const model::Link& link = robot.links[i];
    const bool hangs_on_base = link.parent < 0 || is_on_base[static_cast<std::size_t>(link.parent)];
    if (link.joint == JointKind::fixed) {
      is_on_base[i] = hangs_on_base;
      is_base_designed = is_base_designed || (hangs_on_base && !link.parts.empty());
      continue;
    }
    out[i + 1] = link.visible && link.parts.empty();
    carries_generated = carries_generated || (hangs_on_base && out[i + 1]);
  }
  out[0] = carries_generated && !is_base_designed;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const model::Link& link = robot.links[i];
    if (link.joint == JointKind::fixed)
      out[i + 1] =
          link.visible && link.parts.empty() && out[static_cast<std::size_t>(link.parent + 1)];
  }
  return out;
}

}  // namespace robomosp::robotics
