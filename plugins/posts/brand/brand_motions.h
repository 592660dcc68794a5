// SPDX-License-Identifier: Apache-2.0
// BrandMotions: a motion resolved into targets, speeds and blending (layer: plugins/posts, header
// only).
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "brand_values.h"

namespace robomosp::post::brand {

/// A number of a motion: known, or computed at run time.
struct Number {
  std::optional<double> known;
  std::string text;  ///< if unknown
};
/// Target of a motion.
struct Goal {
  bool is_joints = false;
  std::vector<double> axes;      ///< of the controller [degrees or mm], if is_joints
  std::vector<double> external;  ///< of the profile's external axes
  std::optional<Pose> pose;      ///< frame_T_tip, if known
  std::string text;              ///< else the transform, in the target's language
  const PostPoint* point = nullptr;
};
/// A tool or a frame of a motion.
struct Placing {
  std::optional<Pose> pose;  ///< empty = unchanged since the start
  std::string text;          ///< computed at run time
  bool operator==(const Placing& o) const {
    const auto same = [](const std::optional<Pose>& a, const std::optional<Pose>& b) {
      return a.has_value() == b.has_value() && (!a || (a->p == b->p && a->R == b->R));
    };
    return same(pose, o.pose) && text == o.text;
  }
};
struct Move {
  std::vector<Goal> goals;
  bool is_ptp = false, incremental = false;
  Number speed, speed_ori, acc;  ///< [mm/s or %], [degrees/s], [%]
  Number blend;                  ///< [mm or %]
  bool passes = false;           ///< continues without a stop
  Placing tool, frame;
};
class BrandMotions : public BrandValues {
 public:
  using BrandValues::BrandValues;

 protected:
  // ---- what the target writes ----
  virtual void write_move(const Motion&, const Move&) = 0;
  virtual bool has_external() const { return false; }
  virtual bool has_speed_ori() const { return false; }
  virtual bool has_acc() const { return true; }

  // ---- motions ----
  void ptp(const Motion& m) override { resolve(m); }
  void lin(const Motion& m) override { resolve(m); }
  void circle(const Motion& m) override { resolve(m); }
  Number value(const Attribute& a, double otherwise) {
    Number n;
    if (a.known) n.known = *a.known;
    else if (a.expression != RMP_NONE) n.text = text(a.expression);
    else n.known = otherwise;
    if (n.known && !std::isfinite(*n.known)) fail("a number of this motion is not finite");
    return n;
  }
  Placing placing(const Attribute& a, std::int32_t number, std::span<const PostPlace> places) {
    Placing out;
    if (!a.given) {
      if (number >= 0 && static_cast<std::size_t>(number) < places.size())
        out.pose = places[static_cast<std::size_t>(number)].pose;
      return out;
    }
    if (const PostPoint* p = point(a.expression); p && p->has_pose) out.pose = p->pose;
    else out.text = text(a.expression);
    return out;
  }
  bool is_sane(const Pose& p) {
    for (const double x : p.p)
      if (!std::isfinite(x) || std::fabs(x) > 1e6) {
        fail(std::isfinite(x) ? "a target is more than 1000 km away" : "a target is not finite",
             "Check the numbers it is built from.");
        return false;
      }
    for (const double x : p.R)
      if (!std::isfinite(x)) {
        fail("the orientation of a target is not finite", "Check the numbers it is built from.");
        return false;
      }
    return true;
  }
  std::optional<Goal> goal(const Target& t, bool is_ptp) {
    Goal g;
    g.point = t.point;
    const bool is_joints = t.role == RMP_ROLE_JOINT || t.role == RMP_ROLE_MAIN_JOINT;
    if (t.role == RMP_ROLE_ADD_JOINT) {
      fail("a motion of additional joints only cannot be posted",
           "Add the robot's target (JOINT or ROBTARGET), or switch the gripper with a signal.");
      return std::nullopt;
    }
    if (t.role == RMP_ROLE_POSITION) {
      fail("a target that keeps the present orientation cannot be posted",
           "Write POSE(position, orientation).");
      return std::nullopt;
    }
    if (t.point) g.external = outer(*t.point);
    if (is_joints) {
      if (!t.point) {
        fail("joint values computed at run time cannot be posted",
             "Build the target from constants, or post the flattened program (form = \"flat\").");
        return std::nullopt;
      }
      if (is_ptp || !t.point->has_pose) {
        if (!is_ptp) {
          fail("a straight motion to joint values needs their pose, which is unknown",
               "Name the robot: program.post{robot = ...}.");
          return std::nullopt;
        }
        g.is_joints = true;
        g.axes = axes(*t.point);
        for (const double x : g.axes)
          if (!std::isfinite(x) || std::fabs(x) > 1e7) {
            fail("a joint value of this target is not a usable number",
                 "Check what it is built from.");
            return std::nullopt;
          }
        if (g.axes.empty()) return std::nullopt;
      }
    }
    if (g.is_joints) return g;
    if (t.point && t.point->has_pose) {
      if (!is_sane(t.point->pose)) return std::nullopt;
      no_turns(t.point);
      g.pose = t.point->pose;
      return g;
    }
    if (t.role != RMP_ROLE_POSE) {
      fail("a target of this kind cannot be posted if it is computed at run time",
           "Make it a POSE, or post the flattened program (form = \"flat\").");
      return std::nullopt;
    }
    g.text = text(t.expression);
    return g.text.empty() ? std::nullopt : std::optional<Goal>(g);
  }
  std::vector<double> outer(const PostPoint& p) {
    const bool in_profile = std::any_of(profile_.axes.begin(), profile_.axes.end(),
                                        [](const PostAxis& a) { return a.external; });
    const bool moved =
        std::any_of(p.external.begin(), p.external.end(), [](double x) { return x != 0; });
    if (!in_profile || !has_external()) {
      if (moved || (in_profile && !has_external()))
        fail(has_external()
                 ? "the profile names no external axes for the additional joints of this target"
                 : std::string(caps_.title) + " has no external axes in targets",
             has_external()
                 ? "Add axes with is_external = true to the profile."
                 : "Move them with signals, or remove them from the profile and the target.");
      return {};
    }
    // A target without additional joints leaves them unchanged.
    if (p.external.empty()) return {};
    return external_axes(p);
  }
  bool is_given(const Motion& m, std::uint32_t a, double usual) {
    return m[a].given && (!m[a].known || *m[a].known != usual);
  }
  void resolve(const Motion& m) {
    Move out;
    const std::uint32_t errors = errors_;
    out.is_ptp = m.interpolation == RMP_MOVE_PTP;
    out.incremental = m.incremental;
    const std::string title(caps_.title);
    if ((m[RMP_ATTR_TIME].known && *m[RMP_ATTR_TIME].known >= 0) ||
        (!m[RMP_ATTR_TIME].known && m[RMP_ATTR_TIME].expression != RMP_NONE))
      fail(title + " has no motions with a given duration", "Give SPEED instead of TIME.");
    if (is_given(m, RMP_ATTR_WOBBLE, 0))
      fail(title + " has no weaving here", "Remove WOBBLE, and weave with the welding equipment.");
    if (is_given(m, RMP_ATTR_DEVICE, 1) || is_given(m, RMP_ATTR_ADAX_CONTROL, 0))
      fail(title + " has no DEVICE or ADAX_CONTROL", "Remove the attribute.");
    if ((m[RMP_ATTR_C_SPEED].known && *m[RMP_ATTR_C_SPEED].known != 100) ||
        (!m[RMP_ATTR_C_SPEED].known && m[RMP_ATTR_C_SPEED].expression != RMP_NONE))
      warn("the speed in the transition (C_SPEED) is left to the controller");
    if (!has_speed_ori() && !out.is_ptp && m[RMP_ATTR_SPEED_ORI].given)
      warn("the speed of the orientation (SPEED_ORI) is left to the controller");
    const std::uint32_t acc = out.is_ptp ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC;
    if (!has_acc() && is_given(m, acc, 100)) warn("the acceleration is left to the controller");
    out.speed = value(m[out.is_ptp ? RMP_ATTR_SPEED_PTP : RMP_ATTR_SPEED], out.is_ptp ? 100 : 250);
    out.speed_ori = value(m[RMP_ATTR_SPEED_ORI], 90);
    out.acc = value(m[acc], 100);
    out.blend = value(m[out.is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP], 0);
    check(out.speed, out.is_ptp, "speed");
    if (out.acc.known && !(*out.acc.known > 0 && *out.acc.known <= 100))
      fail("an acceleration of " + trimmed(*out.acc.known, 3) + " % is outside 0 to 100",
           "Give a percentage of the maximum.");
    if (out.blend.known && *out.blend.known < 0) fail("a blending distance is negative");
    if (m[RMP_ATTR_C_PASS].given && !m[RMP_ATTR_C_PASS].known)
      fail("C_PASS cannot be posted if it is computed at run time", "Write TRUE or FALSE.");
    const bool pass = m[RMP_ATTR_C_PASS].known && *m[RMP_ATTR_C_PASS].known != 0;
    out.passes = pass || !out.blend.text.empty() || (out.blend.known && *out.blend.known > 0);
    if (pass && out.blend.known && *out.blend.known == 0) {
      out.blend.known = number_option("pass", out.is_ptp ? 10 : 5);
      note("C_PASS without a distance is posted as " + trimmed(*out.blend.known, 3) +
               (out.is_ptp ? " %" : " mm"),
           "Give C_CP or C_PTP, or set the profile's option pass.");
    }
    out.tool = placing(m[RMP_ATTR_TOOL], profile_.tool, profile_.tools);
    out.frame = placing(m[RMP_ATTR_FRAME], profile_.frame, profile_.frames);
    for (const Placing* p : {&out.tool, &out.frame})
      if (p->pose) static_cast<void>(is_sane(*p->pose));
    for (const Target& t : m.targets) {
      auto g = goal(t, out.is_ptp);
      if (!g) return;
      out.goals.push_back(std::move(*g));
    }
    if (m.incremental && !is_translation(out)) return;
    if (m.interpolation == RMP_MOVE_CIRCLE && (out.goals.size() != 2 || m.incremental)) {
      fail("a circle needs a via point and an end point, both absolute");
      return;
    }
    if (errors_ == errors) write_move(m, out);
  }
  void check(const Number& n, bool is_ptp, const char* what) {
    if (!n.known) return;
    if (!(*n.known > 0))
      fail(std::string("a ") + what + " of " + trimmed(*n.known, 6) + " moves nothing",
           "Give a value above zero.");
    else if (is_ptp && *n.known > 100)
      fail(std::string("a ") + what + " of " + trimmed(*n.known, 3) + " % exceeds 100 %",
           "SPEED_PTP is a percentage of the maximum, up to 100.");
    else if (!is_ptp && profile_.max_speed > 0 && *n.known > profile_.max_speed)
      fail(std::string("a ") + what + " of " + trimmed(*n.known, 3) +
               " mm/s is above the robot's " + trimmed(profile_.max_speed, 3),
           "Give a lower SPEED.");
  }
  bool is_translation(const Move& m) {
    for (const Goal& g : m.goals) {
      bool straight = !g.is_joints && g.pose;
      for (std::size_t i = 0; straight && i < 9; ++i)
        straight = std::fabs(g.pose->R[i] - (i % 4 == 0 ? 1.0 : 0.0)) < 1e-12;
      if (straight) continue;
      fail("an increment of joints or of an orientation, or an unknown increment, cannot be posted",
           "Write the target itself, or post the flattened program (form = \"flat\").");
      return false;
    }
    return true;
  }
  /// A number for use inside a text.
  std::string shown(const Number& n, int digits) {
    return n.known ? number(*n.known, digits) : n.text;
  }

  /// Blending distance in millimetres: C_CP itself; C_PTP by the profile's option c_ptp_mm, the
  /// distance for 100 %.
  Number blend_mm(const Move& m) {
    if (!m.is_ptp || !m.passes) return m.blend;
    const double full = number_option("c_ptp_mm", 100);
    if (!m.blend.known) {
      note("C_PTP is posted as a distance, 100 % being " + trimmed(full, 3) + " mm",
           "The profile's option c_ptp_mm sets this distance.");
      return {std::nullopt, "(" + m.blend.text + ") * " + trimmed(full / 100, 6, 1)};
    }
    Number mm;
    mm.known = *m.blend.known * full / 100;
    note("C_PTP of " + trimmed(*m.blend.known, 3) + " % is posted as " + trimmed(*mm.known, 3) +
             " mm",
         "The profile's option c_ptp_mm sets the distance for 100 %.");
    return mm;
  }
};

}  // namespace robomosp::post::brand
