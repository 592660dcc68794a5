// SPDX-License-Identifier: Apache-2.0
#include "sim/robot_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <robomosp/sdk/joint_segment.h>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/segment.h"
#include "robotics/kinematics.h"
#include "sim/ik_choice.h"
#include "sim/ik_reason.h"
#include "sim/joint_rates.h"
#include "sim/simulate.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"

namespace robomosp::sim {
PathSample in_base(const PathSample& s, const Pose& base_T_path) {
  using namespace spatial;
  return {compose(base_T_path, s.pose), rotate(base_T_path, s.velocity),
          rotate(base_T_path, s.angular_velocity), rotate(base_T_path, s.acceleration),
          rotate(base_T_path, s.angular_acceleration)};
}

PathSample seen_from(const PathSample& base, const PathSample& s) {
  using namespace spatial;
  const Vec3 r = sub(s.pose.p, base.pose.p), &w = base.angular_velocity;
  const Vec3 v = sub(sub(s.velocity, base.velocity), cross(w, r));
  const Vec3 a = sub(sub(sub(s.acceleration, base.acceleration),
                         add(cross(base.angular_acceleration, r), cross(w, cross(w, r)))),
                     scale(cross(w, v), 2));
  return {compose(inverse(base.pose), s.pose), rotate_back(base.pose, v),
          rotate_back(base.pose, sub(s.angular_velocity, w)), rotate_back(base.pose, a),
          rotate_back(base.pose, sub(sub(s.angular_acceleration, base.angular_acceleration),
                                     cross(w, s.angular_velocity)))};
}

namespace {

/// Joint configurations closer than this count as one [rad or m].
constexpr double kSameConfiguration = 1e-6;
/// Joint vectors that differ by no more than this are the same: no segment moves by less.
constexpr double kNoWay = 1e-12;
constexpr double kAtRest = 1e-9;  ///< slower joints stand [rad/s or m/s]
/// Of joints without limits, where a segment gives none either.
constexpr double kSpeed = 1;  ///< [rad/s or m/s]
/// Parameters of joint segments that lower the robot's limits, or stand in for them.
constexpr std::array<const char*, 3> kLimits{"velocity", "acceleration", "jerk"};
constexpr double kRiseTime = 0.25;  ///< to full speed, and to full acceleration [s]

std::string place_text(const Vec3& p) {
  std::string out = "(";
  for (std::size_t k = 0; k < 3; ++k) out += (k ? ", " : "") + text::print_rounded(p[k]);
  return out + ") m";
}

/// From one configuration to another, all joints together by x^3 (10 - 15 x + 6 x^2).
class QuinticMove final : public JointSegment {
 public:
  /// `velocity` and `acceleration`: limits of the joints, all finite.
  QuinticMove(std::vector<double> from, std::vector<double> to, std::span<const double> velocity,
              std::span<const double> acceleration)
      : from_(std::move(from)), to_(std::move(to)) {
    for (std::size_t j = 0; j < from_.size(); ++j) {
      // Its greatest rates are 15/8 and 10/sqrt(3) of the mean ones.
      const double way = std::fabs(to_[j] - from_[j]), v = velocity[j], a = acceleration[j];
      duration_ = std::max({duration_, 1.875 * way / v, std::sqrt(10 / std::sqrt(3.0) * way / a)});
    }
  }
  [[nodiscard]] double duration() const override { return duration_; }
  Result<void> sample(std::span<const double> times, const JointSamples& out) const override {
    const std::size_t n = from_.size();
    for (std::size_t i = 0; i < times.size(); ++i) {
      const double x = std::clamp(times[i] / duration_, 0.0, 1.0), T = duration_;
      const spatial::Jet s = spatial::ease(x);
      for (std::size_t j = 0; j < n; ++j) {
        const double way = to_[j] - from_[j];
        out.q[i * n + j] = from_[j] + s.v * way;
        if (!out.qd.empty()) out.qd[i * n + j] = s.d / T * way;
        if (!out.qdd.empty()) out.qdd[i * n + j] = s.dd / (T * T) * way;
      }
    }
    return {};
  }

 private:
  std::vector<double> from_, to_;
  double duration_ = 0;
};

/// The joints stand for a time.
class StandingMove final : public JointSegment {
 public:
  StandingMove(std::vector<double> q, double duration) : q_(std::move(q)), duration_(duration) {}
  [[nodiscard]] double duration() const override { return duration_; }
  Result<void> sample(std::span<const double> times, const JointSamples& out) const override {
    for (std::size_t i = 0; i < times.size(); ++i)
      std::copy(q_.begin(), q_.end(), out.q.begin() + static_cast<std::ptrdiff_t>(i * q_.size()));
    for (const std::span<double> rates : {out.qd, out.qdd, out.qddd})
      std::fill(rates.begin(), rates.end(), 0.0);
    return {};
  }

 private:
  std::vector<double> q_;
  double duration_;
};

class Builder {
 public:
  Builder(const Registry& registry, const RobotMotionTask& task, Progress& progress)
      : registry_(registry),
        task_(task),
        progress_(progress),
        dof_(task.model->dof()),
        is_moved_(task.is_at_start),
        at_(task.start) {}

  Result<RobotMotion> build() {
    const auto& segments = task_.trajectory->segments;
    if (segments.empty())
      return error(ErrorCode::invalid_argument, "it has no segments",
                   "Add a segment such as a line or a circle.", task_.where);
    std::size_t i = 0;
    while (i < segments.size()) {
      RMP_TRY_ASSIGN(const bool is_joint, moves_joints(i));
      if (is_joint) {
        RMP_TRY(add_joint_segment(i++));
        continue;
      }
      model::Trajectory part = *task_.trajectory;
      part.segments.clear();
      for (; i < segments.size(); ++i) {
        RMP_TRY_ASSIGN(const bool is_next_joint, moves_joints(i));
        if (is_next_joint) break;
        part.segments.push_back(segments[i]);
      }
      RMP_TRY(add_path(part));
    }
    finish();
    return std::move(out_);
  }

 private:
  [[nodiscard]] std::string segment_name(std::size_t i) const {
    return task_.where + ", segment " + std::to_string(i + 1);
  }
  Result<bool> moves_joints(std::size_t i) const {
    const model::TrajectorySegment& record = task_.trajectory->segments[i];
    if (record.stored) return false;
    RMP_TRY_ASSIGN(const auto providers, motion::providers_of(registry_, record, segment_name(i)));
    return providers.is_joint();
  }

  /// Times of the whole motion's samples that fall into a piece of `duration` from now on.
  Result<std::vector<double>> local_times(double duration) {
    if (!(task_.step > 0) || (begin_ + duration) / task_.step > 1e7)
      return error(ErrorCode::invalid_argument,
                   "a sample time of " + text::print_rounded(task_.step) +
                       " s gives too many samples for " + text::print_rounded(begin_ + duration) +
                       " s",
                   "Give a longer sample time.", task_.where);
    std::vector<double> times;
    auto k = static_cast<std::size_t>(std::ceil((begin_ + task_.lead) / task_.step * (1 - 1e-12)));
    if (!out_.times.empty() && k < next_) k = next_;
    for (;; ++k) {
      const double t = static_cast<double>(k) * task_.step - task_.lead - begin_;
      if (t > duration * (1 + 1e-12)) break;
      times.push_back(std::clamp(t, 0.0, duration));
      out_.times.push_back(begin_ + times.back());
      next_ = k + 1;
    }
    return times;
  }

  Result<void> add_joint_segment(std::size_t i) {
    const model::TrajectorySegment& record = task_.trajectory->segments[i];
    const std::string here = segment_name(i);
    RMP_TRY_ASSIGN(const auto providers, motion::providers_of(registry_, record, here));
    RMP_TRY_ASSIGN(const auto params, motion::params_of(providers, record, here));
    std::vector<double> points = at_;
    const bool is_first = i == 0, is_way = record.joints.size() + record.points.size() > 1;
    for (std::size_t k = 0; k < record.joints.size(); ++k) {
      const auto& q = record.joints[k];
      if (q.size() != dof_)
        return error(ErrorCode::invalid_argument,
                     "joint vector " + std::to_string(k + 1) + " has " + std::to_string(q.size()) +
                         " values, but the robot has " + std::to_string(dof_) + " joints",
                     "Give one value per joint.", here);
      // The first may be where the joints are already.
      if (k == 0 && is_way && distance(at_, q) < kSameConfiguration) continue;
      if (k == 0 && is_first && is_way) {
        RMP_TRY(begin_at(q));
        points = at_;
        continue;
      }
      points.insert(points.end(), q.begin(), q.end());
    }
    if (task_.base && !record.points.empty())
      return error(ErrorCode::unsupported,
                   "it moves to points in space at unknown times while the base moves",
                   "Give joint values, or a path in space such as a line.", here);
    for (std::size_t k = 0; k < record.points.size(); ++k) {
      const Pose target = spatial::compose(task_.base_T_trajectory, model::pose(record.points[k]));
      const std::vector<double> seed(points.end() - static_cast<std::ptrdiff_t>(dof_),
                                     points.end());
      RMP_TRY_ASSIGN(const auto q, solve(target, seed, "point " + std::to_string(k + 1), here));
      if (k == 0 && points.size() == dof_ && distance(at_, q) < kSameConfiguration) continue;
      if (k == 0 && is_first && is_way && record.joints.empty()) {
        RMP_TRY(begin_at(q));
        points = at_;
        continue;
      }
      points.insert(points.end(), q.begin(), q.end());
    }
    if (record.joints.empty() && record.points.empty())
      return error(ErrorCode::invalid_argument, "it has neither joint vectors nor points",
                   "Give joints or points.", here);
    if (!is_joint_moving_ && !has_own_rates(*params.shape)) {
      drop_repeated(points);
      if (points.size() < 2 * dof_) return stand(*params.shape);
    }
    std::vector<double> lower(dof_), upper(dof_);
    for (std::size_t j = 0; j < dof_; ++j) {
      lower[j] = task_.model->joints[j].lower;
      upper[j] = task_.model->joints[j].upper;
    }
    const auto [velocity, acceleration, jerk] = limits(params.shape.get());
    RMP_TRY_ASSIGN(const auto factory,
                   registry_.create<JointSegmentFactory>(providers.shape.name).in(here));
    // A joint segment that ended in motion hands it on.
    JointEnds ends;
    if (is_joint_moving_) ends.start_velocity = end_qd_, ends.start_acceleration = end_qdd_;
    auto made = guarded(providers.shape.name, [&] {
      return factory->make(dof_, points,
                           {sizeof(JointLimits), lower, upper, velocity, acceleration, jerk}, ends,
                           *params.shape);
    });
    if (!made.ok()) return std::move(made).error().in(here);
    if (!*made || !((*made)->duration() > 0) || !std::isfinite((*made)->duration()))
      return error(ErrorCode::plugin_failed,
                   "provider \"" + providers.shape.name + "\" made no motion with a duration",
                   "Report it to the provider's author or choose another provider.", here);
    RMP_TRY(add(**made));
    is_joint_moving_ = std::any_of(end_qd_.begin(), end_qd_.end(),
                                   [](double v) { return std::fabs(v) > kAtRest; });
    return {};
  }

  /// Whether a joint segment says when it is where, or how fast it ends: one that goes nowhere
  /// moves nevertheless, or waits for so long.
  static bool has_own_rates(const Params& shape) {
    for (const char* name : {"times", "end_velocity", "end_acceleration"}) {
      if (!shape.has(name)) continue;
      const auto values = shape.reals(name);
      if (std::any_of(values.begin(), values.end(), [](double v) { return v != 0; })) return true;
    }
    return false;
  }
  /// Of joint vectors that follow each other, those that move a joint.
  void drop_repeated(std::vector<double>& points) const {
    std::size_t kept = dof_;
    for (std::size_t i = dof_; i < points.size(); i += dof_) {
      double way = 0;
      for (std::size_t j = 0; j < dof_; ++j)
        way = std::max(way, std::fabs(points[i + j] - points[kept - dof_ + j]));
      if (!(way <= kNoWay)) {
        std::copy_n(points.begin() + static_cast<std::ptrdiff_t>(i), dof_,
                    points.begin() + static_cast<std::ptrdiff_t>(kept));
        kept += dof_;
      }
    }
    points.resize(kept);
  }
  /// A joint segment to where the joints are: its duration, or nothing.
  Result<void> stand(const Params& shape) {
    end_qd_.assign(dof_, 0.0), end_qdd_.assign(dof_, 0.0);
    const double duration = shape.has("duration") ? shape.real("duration") : 0;
    if (duration > 0) RMP_TRY(add(StandingMove(at_, duration)));
    is_moved_ = true;
    return {};
  }

  /// Limits of velocity, acceleration and jerk: the robot's; where it has none, those of the
  /// segment's parameters; else assumed ones.
  std::array<std::vector<double>, 3> limits(const Params* given) {
    std::array<std::vector<double>, 3> out;
    constexpr std::array<double JointModel::*, 3> kOwn{
        &JointModel::max_velocity, &JointModel::max_acceleration, &JointModel::max_jerk};
    for (std::size_t k = 0; k < out.size(); ++k) {
      std::span<const double> other;
      if (given && given->has(kLimits[k])) other = given->reals(kLimits[k]);
      for (std::size_t j = 0; j < dof_; ++j) {
        double limit = task_.model->joints[j].*kOwn[k];
        // A list of another length is the provider's to refuse.
        if (!std::isfinite(limit) && (other.size() == 1 || other.size() == dof_))
          limit = other[other.size() == 1 ? 0 : j];
        if (!std::isfinite(limit)) {
          limit = k == 0 ? kSpeed : out[k - 1][j] / kRiseTime;
          assumed_[k].insert(j);
        }
        out[k].push_back(limit);
      }
    }
    return out;
  }

  /// Which limits were assumed, of which joints.
  void note_assumed() {
    std::vector<std::string> lacking, instead;
    constexpr std::array<const char*, 3> kInstead{"1 rad/s (m/s)", "full speed after 0.25 s",
                                                  "full acceleration after 0.25 s"};
    for (std::size_t k = 0; k < assumed_.size(); ++k) {
      if (assumed_[k].empty()) continue;
      std::vector<std::string> joints, axes;
      for (const std::size_t j : assumed_[k]) {
        joints.push_back(std::to_string(j + 1));
        const PostAxis* const axis = task_.axes ? task_.axes->of_entry(j) : nullptr;
        if (axis) axes.emplace_back(axis->name);
      }
      const std::string of_axes =
          axes.size() > 1 ? "axes " + text::enumerate(axes) + ", " : std::string();
      lacking.push_back(std::string(kLimits[k]) + " of " +
                        (joints.size() == dof_ ? std::string("all joints")
                         : joints.size() == 1  ? "joint " + joints[0]
                                               : of_axes + "joints " + text::enumerate(joints)));
      instead.emplace_back(kInstead[k]);
    }
    if (lacking.empty()) return;
    out_.notes.push_back("The robot lacks limits: " + text::enumerate(lacking) +
                         ". Joint moves use these defaults: " + text::enumerate(instead) + ".");
  }

  /// Goes to where the trajectory goes on; these rows are known from its own.
  Result<void> approach(const std::vector<double>& to) {
    const auto [velocity, acceleration, jerk] = limits(nullptr);
    const std::size_t before = out_.times.size();
    RMP_TRY(add(QuinticMove(at_, to, velocity, acceleration)));
    out_.approach.resize(before, 0.0);
    out_.approach.resize(out_.times.size(), 1.0);
    return {};
  }

  /// The first segment is a way from `q` on.
  Result<void> begin_at(const std::vector<double>& q) {
    if (task_.begins_on_path) {
      at_ = q;
      return {};
    }
    RMP_TRY(approach(q));
    out_.notes.push_back("An approach of " + text::print_rounded(begin_) +
                         " s was inserted before segment 1, which does not start at the robot's "
                         "configuration; start = \"path\" starts there.");
    return {};
  }

  Result<void> add(const JointSegment& move) {
    RMP_TRY_ASSIGN(const std::vector<double> times, local_times(move.duration()));
    const std::size_t first = out_.q.size(), more = times.size() * dof_;
    for (auto* table : {&out_.q, &out_.qd, &out_.qdd}) table->resize(first + more);
    RMP_TRY(move.sample(times, {std::span(out_.q).subspan(first),
                                std::span(out_.qd).subspan(first),
                                std::span(out_.qdd).subspan(first),
                                {}})
                .in(task_.where));
    out_.position_error.resize(out_.times.size());
    out_.rotation_error.resize(out_.times.size());
    const double end[] = {move.duration()};
    end_qd_.resize(dof_), end_qdd_.resize(dof_);
    RMP_TRY(move.sample(end, {at_, end_qd_, end_qdd_, {}}).in(task_.where));
    begin_ += move.duration();
    is_moved_ = true;
    return {};
  }

  /// A sample of a path that began with the piece, `t` later, in the base's frame.
  Result<PathSample> from_base(const PathSample& s, double t) const {
    const PathSample placed = in_base(s, task_.base_T_trajectory);
    if (!task_.base) return placed;
    RMP_TRY_ASSIGN(const PathSample base, task_.base(begin_ + t));
    return seen_from(base, placed);
  }

  Result<void> add_path(const model::Trajectory& part) {
    if (is_joint_moving_)
      return error(ErrorCode::invalid_argument,
                   "the joint segment that ends at t = " + text::print_rounded(begin_) +
                       " s ends in motion, but a path in space follows",
                   "Make it end at rest, or insert a joint segment.", task_.where);
    RMP_TRY_ASSIGN(const auto path, motion::Path::build(registry_, task_.name, part, task_.stored));
    for (const std::string& note : path->notes())
      out_.notes.push_back(begin_ > 0 ? "In the path from t = " + text::print_rounded(begin_) +
                                            " s on, with times counted from there: " + note
                                      : note);
    double at = 0;
    PathSample first;
    RMP_TRY(path->sample({&at, 1}, {&first, 1}).in(task_.where));
    RMP_TRY_ASSIGN(first, from_base(first, 0));
    RMP_TRY_ASSIGN(const auto q0, solve(first.pose, at_, "the start of the path", task_.where));
    if (is_moved_ && distance(at_, q0) > kSameConfiguration) {
      if (task_.base)
        return error(ErrorCode::unsupported,
                     "at t = " + text::print_rounded(begin_) +
                         " s the path does not start at the present joint values, and the base "
                         "moves during the approach",
                     "Make the segments meet.", task_.where);
      out_.notes.push_back("A joint move was inserted at t = " + text::print_rounded(begin_) +
                           " s: the path does not start at the present joint values.");
      RMP_TRY(approach(q0));
    }
    if (!(path->duration() > 0)) {  // it stays where it begins
      if (distance(at_, q0) > kSameConfiguration) at_ = q0;
      end_qd_.assign(dof_, 0.0), end_qdd_.assign(dof_, 0.0);
      is_moved_ = true;
      return {};
    }
    // The start and the end of the path belong to it even where no sample falls on them.
    const std::size_t before = out_.times.size();
    RMP_TRY_ASSIGN(std::vector<double> times, local_times(path->duration()));
    const bool has_start = !times.empty() && times.front() == 0,
               has_end = !times.empty() && times.back() == path->duration();
    if (!has_start) times.insert(times.begin(), 0.0);
    if (!has_end) times.push_back(path->duration());
    std::vector<PathSample> samples(times.size());
    RMP_TRY(path->sample(times, samples).in(task_.where));
    if (task_.weave) {
      RMP_TRY_ASSIGN(const auto weaving, motion::Weaving::over(path, *task_.weave));
      RMP_TRY(weaving.move(times, samples).in(task_.where));
    }
    std::vector<Pose> targets;
    targets.reserve(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      RMP_TRY_ASSIGN(samples[i], from_base(samples[i], times[i]));
      targets.push_back(samples[i].pose);
    }
    IkBatch batch = asked();
    batch.targets = targets;
    batch.seeds = q0;
    batch.continuous = true;
    RMP_TRY_ASSIGN(const auto results, solve_ik(ik_, batch, progress_));
    std::vector<double> q, qd(times.size() * dof_), qdd(times.size() * dof_);
    q.reserve(times.size() * dof_);
    for (std::size_t i = 0; i < results.size(); ++i) {
      const IkResult& r = results[i];
      if (r.status != IkStatus::solved)
        return error(
            ErrorCode::unreachable,
            "at t = " + text::print_rounded(begin_ + times[i]) + " s (sample " +
                std::to_string(before + i + (has_start ? 1 : 0)) + " of " +
                std::to_string(before + results.size() - (has_start ? 0 : 1)) +
                ") the robot cannot follow to " + place_text(targets[i].p) + " from its base: " +
                why(r, targets[i],
                    i > 0 ? std::span<const double>(q).last(dof_) : std::span<const double>(q0)),
            "Move the trajectory or the robot, or start from another configuration.", task_.where);
      q.insert(q.end(), r.q.begin(), r.q.begin() + static_cast<std::ptrdiff_t>(dof_));
    }
    joint_rates(*task_.model, times, q, samples, qd, qdd);
    note_branches(times, q, qd);
    const auto n = static_cast<std::ptrdiff_t>(dof_);
    at_.assign(q.end() - n, q.end());
    end_qd_.assign(qd.end() - n, qd.end());
    end_qdd_.assign(qdd.end() - n, qdd.end());
    const std::size_t from = has_start ? 0 : 1, to = times.size() - (has_end ? 0 : 1);
    append(out_.q, q, from, to);
    append(out_.qd, qd, from, to);
    append(out_.qdd, qdd, from, to);
    for (std::size_t i = from; i < to; ++i) {
      out_.position_error.push_back(results[i].position_error);
      out_.rotation_error.push_back(results[i].rotation_error);
    }
    last_errors_ = {results.back().position_error, results.back().rotation_error};
    begin_ += path->duration();
    is_moved_ = true;
    return {};
  }

  /// Says where the path goes over to another branch, and where joints jump.
  void note_branches(std::span<const double> times, std::span<const double> q,
                     std::span<const double> qd) {
    constexpr std::size_t kMost = 5;
    constexpr double kLargeStep = 0.3;  // [rad or m], and this much faster than the path asks for:
    constexpr double kFaster = 3;
    std::vector<std::string> notes;
    const auto when = [&](std::size_t i) {
      return "At t = " + text::print_rounded(begin_ + times[i]) + " s";
    };
    const auto jump = [&](std::size_t i) -> std::string {
      for (std::size_t j = 0; j < dof_; ++j) {
        const std::size_t now = i * dof_ + j, before = now - dof_;
        const double by = std::fabs(q[now] - q[before]);
        const double asked = std::max(std::fabs(qd[now]), std::fabs(qd[before]));
        if (by > kLargeStep && by > kFaster * asked * (times[i] - times[i - 1]))
          return "joint " + std::to_string(j + 1) + " jumps by " + text::print_rounded(by, 3) +
                 (task_.model->joints[j].type == JointType::prismatic ? " m" : " rad");
      }
      return {};
    };
    std::set<std::size_t> told;
    const BranchNames names(ik_, 0);
    for (const BranchChange& c : branch_changes(names, q, kMost + 1)) {
      told.insert(c.at);
      const std::string jumps = jump(c.at);
      notes.push_back(when(c.at) + " the arm changes its configuration from " +
                      configuration_change(names, q, c) +
                      (jumps.empty() ? ", through a singular configuration." : ": " + jumps + "."));
    }
    for (std::size_t i = 1; i < times.size() && notes.size() <= kMost; ++i)
      if (const std::string jumps = told.contains(i) ? std::string() : jump(i); !jumps.empty())
        notes.push_back(when(i) + " " + jumps + ": the configuration is not continuous.");
    if (notes.size() > kMost) {
      notes.resize(kMost);
      notes.emplace_back("The path changes its configuration or jumps more often than that.");
    }
    out_.notes.insert(out_.notes.end(), notes.begin(), notes.end());
  }

  /// Adds rows from..to to a table; the first ones of a motion are not copied.
  void append(std::vector<double>& table, std::vector<double>& rows, std::size_t from,
              std::size_t to) const {
    rows.resize(to * dof_);
    if (table.empty() && from == 0) table = std::move(rows);
    else
      table.insert(table.end(), rows.begin() + static_cast<std::ptrdiff_t>(from * dof_),
                   rows.end());
  }

  /// The very end, where no sample has fallen on it.
  void finish() {
    note_assumed();
    finish_rows();
    if (!out_.approach.empty()) out_.approach.resize(out_.times.size(), 0.0);
  }
  void finish_rows() {
    if (!out_.times.empty() && begin_ - out_.times.back() <= 1e-9 * task_.step) {
      out_.times.back() = begin_;
      return;
    }
    out_.times.push_back(begin_);
    out_.q.insert(out_.q.end(), at_.begin(), at_.end());
    out_.qd.insert(out_.qd.end(), end_qd_.begin(), end_qd_.end());
    out_.qdd.insert(out_.qdd.end(), end_qdd_.begin(), end_qdd_.end());
    out_.position_error.push_back(last_errors_[0]);
    out_.rotation_error.push_back(last_errors_[1]);
  }

  [[nodiscard]] IkBatch asked() const {
    IkBatch batch;
    batch.tolerance = task_.tolerance;
    batch.objective = task_.objective;
    batch.clearance = task_.clearance;
    return batch;
  }

  /// One pose, from a seed; the solver is bound at the first one.
  Result<std::vector<double>> solve(const Pose& target, const std::vector<double>& seed,
                                    const std::string& what, const std::string& where) {
    if (!ik_.solver) {
      RMP_TRY_ASSIGN(ik_, bind_ik(registry_, task_.model, task_.ik));
    }
    IkBatch batch = asked();
    batch.targets = {&target, 1};
    batch.seeds = seed;
    auto found = solve_ik(ik_, batch, progress_);
    // The robot's own solver may have no use for the objective; another one follows instead.
    if (!found.ok() && found.error().code == ErrorCode::unsupported) {
      const std::string own = ik_.provider;
      RMP_TRY_ASSIGN(
          ik_, bind_ik(registry_, task_.model, ik_with_tag(registry_, task_.ik, "objectives")));
      if (ik_.provider != own)
        out_.notes.push_back("Inverse kinematics is solved by " + text::quote(ik_.provider) +
                             ", since " + text::quote(own) + " does not support the objective.");
      found = solve_ik(ik_, batch, progress_);
    }
    RMP_TRY_ASSIGN(const auto results, std::move(found));
    const IkResult& r = results.front();
    if (r.status != IkStatus::solved)
      return error(ErrorCode::unreachable, what + " cannot be reached: " + why(r, target, seed),
                   "Move the trajectory or the robot, or start from another configuration.", where);
    return std::vector<double>(r.q.begin(), r.q.begin() + static_cast<std::ptrdiff_t>(dof_));
  }

  /// Why a pose is not reached, from where the joints are before.
  [[nodiscard]] std::string why(const IkResult& r, const Pose& target,
                                std::span<const double> seed) const {
    const std::string reason =
        task_.axes ? ik_reason(registry_, ik_, task_.ik, r, target, seed, *task_.axes, progress_)
                   : r.detail;
    return reason.empty() ? "the solver found no solution" : reason;
  }

  [[nodiscard]] static double distance(const std::vector<double>& a, const std::vector<double>& b) {
    double most = 0;
    for (std::size_t j = 0; j < a.size(); ++j) most = std::max(most, std::fabs(a[j] - b[j]));
    return most;
  }

  const Registry& registry_;
  const RobotMotionTask& task_;
  Progress& progress_;
  std::size_t dof_, next_ = 0;    ///< number of the next sample
  double begin_ = 0;              ///< of the piece to come [s]
  bool is_moved_ = false;         ///< the joints are where a piece left them, or at the start
  bool is_joint_moving_ = false;  ///< a joint segment has ended in motion
  /// Joints whose velocity, acceleration and jerk limits were assumed.
  std::array<std::set<std::size_t>, 3> assumed_;
  std::vector<double> at_, end_qd_, end_qdd_;
  std::array<double, 2> last_errors_{};
  Bound<IkSolver> ik_;
  RobotMotion out_;
};

}  // namespace

Result<RobotMotion> robot_motion(const Registry& registry, const RobotMotionTask& task,
                                 Progress& progress) {
  auto out = Builder(registry, task, progress).build();
  if (!task.axes) return out;
  // Solvers and providers of segments know joints only.
  if (!out.ok()) return task.axes->in_error(*task.model, std::move(out).error());
  for (std::string& note : out->notes) note = task.axes->in_text(*task.model, note);
  return out;
}

}  // namespace robomosp::sim
