// SPDX-License-Identifier: Apache-2.0
// MoveWriter: the treatment of motions shared by posts of all languages: absolute goals, numeric
// attributes, tools and frames of the profile, tests of one signal (layer: plugin helper).
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_writer.h>

namespace robomosp::post {

/// A condition on one signal.
struct SignalTest {
  Signal signal;
  std::int64_t value = 1;
  bool is_equal = true;
};

class MoveWriter : public Writer {
 public:
  using Writer::Writer;

 protected:
  static constexpr double kFarthest = 100'000.0;  ///< [mm]

  void forget() override { last_.reset(); }

  /// Checks that the motion has no feature that all of these targets lack; reports it otherwise. If
  /// the tool differs from the previous motion's, the tip starts elsewhere than where that motion
  /// left its tip.
  bool plain(const Motion& m) {
    std::optional<Pose> tool;
    std::uint32_t computed = RMP_NONE;
    if (m[RMP_ATTR_TOOL].given) {
      const PostPoint* p = point(m[RMP_ATTR_TOOL].expression);
      if (p && p->has_pose) tool = p->pose;
      else computed = m[RMP_ATTR_TOOL].expression;
    }
    has_other_tool_ = computed != RMP_NONE || computed != computed_tool_ ||
                      tool.has_value() != tool_before_.has_value() ||
                      (tool && !same_place(*tool, *tool_before_));
    tool_before_ = tool;
    computed_tool_ = computed;
    if (has_other_tool_) last_.reset();
    bool fine = true;
    const auto refuse = [&](std::uint32_t a, const char* what, double harmless, const char* hint) {
      if (!m[a].given || (m[a].known && *m[a].known == harmless)) return;
      cannot(what, hint);
      fine = false;
    };
    refuse(RMP_ATTR_WOBBLE, "weaving (WOBBLE)", 0, "Write the weave as separate motions.");
    refuse(RMP_ATTR_DEVICE, "choice of a device (DEVICE)", 1,
           "Post a program for each device, or leave DEVICE out.");
    refuse(RMP_ATTR_ADAX_CONTROL, "control of additional axes (ADAX_CONTROL)", 0,
           "Leave ADAX_CONTROL out.");
    if (m[RMP_ATTR_C_SPEED].given && m[RMP_ATTR_C_SPEED].known.value_or(0) != 100)
      warn("C_SPEED is not written: the controller chooses its speed in transitions",
           "Remove C_SPEED, or give the motion a lower SPEED.");
    return fine;
  }
  /// The number of an attribute; nothing if it is unknown, missing, or invalid (then reported).
  std::optional<double> number_of(const Motion& m, std::uint32_t a, const char* name,
                                  double least = 0, double most = 1e9) {
    const auto& x = m[a];
    if (!x.known) return std::nullopt;
    if (!std::isfinite(*x.known) || *x.known < least || *x.known > most) {
      fail(std::string(name) + " is " + shortest(*x.known) + ", which is not from " +
               trimmed(least, 3) + " to " + trimmed(most, 3),
           "Give another value.");
      return std::nullopt;
    }
    return *x.known;
  }
  /// Time of the whole motion [s], if given and known.
  std::optional<double> time_of(const Motion& m) {
    const auto& x = m[RMP_ATTR_TIME];
    if (!x.known || *x.known == -1) return std::nullopt;
    return number_of(m, RMP_ATTR_TIME, "TIME", 0.001, 1e6);
  }
  /// True if TIME may apply.
  [[nodiscard]] static bool has_time(const Motion& m) {
    const auto& x = m[RMP_ATTR_TIME];
    return x.known ? *x.known != -1 : x.expression != RMP_NONE;
  }
  /// An attribute that is a pose; nothing = missing, or unknown (reported).
  std::optional<Pose> pose_of(const Motion& m, std::uint32_t a, const char* name) {
    if (!m[a].given) return std::nullopt;
    const PostPoint* p = point(m[a].expression);
    if (p && p->has_pose && usable(p->pose)) return p->pose;
    if (!p || !p->has_pose)
      fail(std::string(name) + " of this motion is unknown before run time",
           "Build it from constants, or post the flattened program (form = \"flat\").");
    return std::nullopt;
  }
  /// Checks that a controller could accept this position; reports it otherwise.
  bool usable(const Pose& p) {
    for (const double x : p.R)
      if (!std::isfinite(x)) {
        fail("the orientation of this target is not finite", "Check what it is computed from.");
        return false;
      }
    for (const double x : p.p)
      if (!(std::fabs(x) * 1000 <= kFarthest)) {
        fail("the position of this target is " +
                 (std::isfinite(x) ? shortest(x * 1000) + " mm away" : std::string("not finite")),
             "Positions are in mm, at most 100 m.");
        return false;
      }
    return true;
  }
  static bool is_joints(std::uint32_t role) {
    return role == RMP_ROLE_JOINT || role == RMP_ROLE_MAIN_JOINT;
  }
  /// The step of an increment in the base's axes, if known: FRAME rotates it.
  std::optional<Pose> step(const Motion& m, const Target& t) const {
    if (!t.point || !t.point->has_pose) return std::nullopt;
    Pose out = t.point->pose;
    if (t.role == RMP_ROLE_POSITION) out.R = Pose{}.R;
    if (!m[RMP_ATTR_FRAME].given) return out;
    const PostPoint* f = point(m[RMP_ATTR_FRAME].expression);
    if (!f || !f->has_pose) return std::nullopt;
    Pose turn;
    turn.R = f->pose.R;
    return product(product(turn, out), inverse(turn));
  }
  /// base_T_tip at a target, if known; increments are added to the previous goal. An unknown one is
  /// not reported.
  std::optional<Pose> goal(const Motion& m, const Target& t) {
    if (!t.point || !t.point->has_pose) return std::nullopt;
    const Pose& p = t.point->pose;
    if (m.incremental) {
      const auto by = step(m, t);
      if (!last_ || !by) return std::nullopt;
      Pose out = *last_;
      for (std::size_t i = 0; i < 3; ++i) out.p[i] += by->p[i];
      out.R = product(*by, *last_).R;
      return out;
    }
    if (is_joints(t.role)) return p;
    Pose out = p;
    if (m[RMP_ATTR_FRAME].given) {
      const PostPoint* f = point(m[RMP_ATTR_FRAME].expression);
      if (!f || !f->has_pose) return std::nullopt;
      out = product(f->pose, p);
    }
    if (t.role == RMP_ROLE_POSITION) {
      if (!last_) return std::nullopt;
      out.R = last_->R;
    }
    return out;
  }
  /// The same, with an error if it is unknown.
  std::optional<Pose> certain_goal(const Motion& m, const Target& t) {
    auto out = goal(m, t);
    if (out) return usable(*out) ? out : std::nullopt;
    if (m.incremental)
      fail("the target of this increment is unknown, since the pose before it is unknown",
           "Move to the pose itself (MOVE), or name the robot: program.post{robot = ...}.");
    else if (t.point && t.role == RMP_ROLE_POSITION)
      fail("a position without an orientation keeps the previous one, which is unknown",
           "Begin with a motion to a pose, or give a POSE.");
    else if (t.point && is_joints(t.role))
      fail("the pose at these joint values is unknown",
           "Name the robot: program.post{robot = ...}.");
    else if (t.role == RMP_ROLE_ADD_JOINT)
      cannot("motions of additional axes only", "Give a JOINT or a ROBTARGET with all axes.");
    else
      fail("this target is unknown before run time",
           "Post the flattened program (form = \"flat\"), or build it from constants.");
    return std::nullopt;
  }
  void arrived(std::optional<Pose> at) { last_ = std::move(at); }
  [[nodiscard]] const std::optional<Pose>& last() const { return last_; }

  /// Rejects additional joints of a target if the controller has no external axes.
  void no_external(const PostPoint* p) {
    if (!p || p->external.empty()) return;
    for (const double x : p->external)
      if (x != 0) {
        cannot("additional joints, and here one is at " + trimmed(x, 4),
               "Drive the gripper with an OUTPUT, and an axis with its own controller.");
        return;
      }
    if (!std::exchange(told_external_, true))
      note("additional joints are not written; those of this target are 0");
  }
  /// Number of the profile's tool or frame with this placement; an error if there is none.
  std::optional<std::int32_t> place_number(std::span<const PostPlace> places, const Pose& pose,
                                           const char* what) {
    for (const PostPlace& p : places)
      if (same_place(p.pose, pose)) {
        if (p.number >= 0) return p.number;
        fail(
            "the profile's " + std::string(what) + " \"" + std::string(p.name) + "\" has no number",
            "Give it its number on the controller.");
        return std::nullopt;
      }
    fail("the profile has no " + std::string(what) + " with this placement",
         "The controller keeps its " + std::string(what) +
             "s by number: add it to the profile with its number.");
    return std::nullopt;
  }
  /// A condition that compares one signal with a value.
  std::optional<SignalTest> signal_test(std::uint32_t e) {
    const auto& x = expression(e);
    const auto operands = links(x.first, x.count);
    if (x.op == RMP_EXPR_SYMBOL &&
        (symbol(x.symbol).kind == RMP_SYMBOL_INPUT || symbol(x.symbol).kind == RMP_SYMBOL_OUTPUT))
      return SignalTest{signal(x.symbol), 1, true};
    if (x.op == RMP_EXPR_NOT) {
      auto t = signal_test(operands[0]);
      if (t) t->is_equal = !t->is_equal;
      return t;
    }
    if (x.op != RMP_EXPR_EQUAL && x.op != RMP_EXPR_NOT_EQUAL) return std::nullopt;
    for (std::size_t i = 0; i < 2; ++i) {
      const auto& s = expression(operands[i]);
      const auto v = known(operands[1 - i]);
      if (s.op != RMP_EXPR_SYMBOL || !v || *v != std::floor(*v) || std::fabs(*v) > 1e9) continue;
      auto t = signal_test(operands[i]);
      if (!t) continue;
      t->value = static_cast<std::int64_t>(*v);
      if (x.op == RMP_EXPR_NOT_EQUAL) t->is_equal = !t->is_equal;
      return t;
    }
    return std::nullopt;
  }
  /// The requested state of a BOOL signal in a test, with the profile's inversion.
  static bool wanted(const SignalTest& t) {
    return (t.value != 0) == t.is_equal ? !t.signal.inverted : t.signal.inverted;
  }
  /// Text in the target's character set; other characters become '?', which is reported.
  std::string plain_text(std::string_view s, char quote) {
    std::string out;
    bool changed = false;
    for (const char c : s) {
      const bool bad = c < 32 || c > 126;
      if (bad && (static_cast<unsigned char>(c) & 0xC0U) == 0x80U) continue;  // rest of a character
      out += bad ? '?' : c == quote ? (quote == '\'' ? '`' : '\'') : c;
      changed = changed || bad || c == quote;
    }
    if (changed) warn("a text has characters that " + std::string(caps_.title) + " does not take");
    return out;
  }
  /// Degrees of a list of axes, all finite and of this number; else empty, and reported.
  std::vector<double> checked_axes(const PostPoint& p, std::size_t count = 0) {
    const std::uint32_t before = errors_;
    auto out = axes(p);
    for (const double v : out)
      if (!std::isfinite(v) || std::fabs(v) > 1e6) {
        fail("a joint of this target is " +
                 (std::isfinite(v) ? "at " + shortest(v) : std::string("not finite")),
             "Check what it is computed from.");
        return {};
      }
    if (!out.empty() && count > 0 && out.size() != count) {
      fail(std::string(caps_.title) + " has " + std::to_string(count) + " axes, and this target " +
               std::to_string(out.size()),
           "Give the profile the axes of this robot.");
      return {};
    }
    return errors_ == before ? out : std::vector<double>{};
  }

  bool has_other_tool_ = false;  ///< different from the previous motion's

 private:
  std::optional<Pose> last_, tool_before_;
  std::uint32_t computed_tool_ = RMP_NONE;
  bool told_external_ = false;
};

}  // namespace robomosp::post
