// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <span>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/segment.h"
#include "program_source/from_records.h"
#include "program_source/motions.h"
#include "spatial/pose.h"

namespace robomosp::program_source {
namespace {

using text::quote;

const double* real_param(const model::TrajectorySegment& s, const char* name) {
  const auto it = s.shape.params.find(name);
  return it == s.shape.params.end() ? nullptr : std::get_if<double>(&it->second);
}

/// 100 % of ACC (task/program_cell.h).
constexpr double kFullAcceleration = 2.5;  // [m/s^2]

}  // namespace

Result<std::string> trapezoid_words(const evaluation::Sources& from,
                                    const model::TrajectorySegment& s, Source& source) {
  RMP_TRY_ASSIGN(const auto providers, motion::providers_of(from.registry, s, "segment"));
  RMP_TRY_ASSIGN(const auto params, motion::params_of(providers, s, "segment"));
  const double acceleration = params.law->real("acceleration");
  std::string out = " SPEED := " + irl_real(kMm * params.law->real("speed"));
  out += " SPEED_ORI := " + irl_real(kDegreesPerRadian * params.law->real("angular_speed"));
  if (acceleration < kFullAcceleration)
    out += " ACC := " + irl_real(kPercent * acceleration / kFullAcceleration);
  if (acceleration > kFullAcceleration)
    source.note("Accelerations above 2.5 m/s^2 are 2.5 m/s^2 in the program, which takes longer.");
  return out;
}

namespace {

/// The motions of a trajectory that stands at `base_T_trajectory`.
class Motions {
 public:
  Motions(const evaluation::Sources& from, Source& source, std::int64_t samples)
      : from_(from), source_(source), samples_(samples) {}

  Result<void> write(const model::Trajectory& t, const Pose& base_T, int depth = 0) {
    constexpr int kDeepest = 60;
    if (depth > kDeepest)
      return error(ErrorCode::conflict, "its stored trajectories refer to each other",
                   "Remove one of them.");
    for (std::size_t i = 0; i < t.segments.size(); ++i) {
      const auto done = segment(t.segments[i], base_T, depth);
      if (!done.ok()) return Error(done.error()).in("segment " + std::to_string(i + 1));
      if (i + 1 < t.segments.size()) flush(&t.segments[i + 1].transition);
    }
    flush(nullptr);
    return {};
  }

 private:
  /// A motion is written when it is known how the next one follows.
  void flush(const model::Transition* next) {
    if (pending_.empty()) return;
    std::string line = pending_;
    pending_.clear();
    if (next && next->is_smooth && next->distance > 0) {
      line += " C_CP := " + irl_real(kMm * next->distance);
    } else if (next && next->is_smooth) {
      source_.note(
          "Where segments do not meet, the program stops: transitions without a distance have no "
          "counterpart in the language.");
    }
    source_.body.add(line + ";");
  }
  Result<void> segment(const model::TrajectorySegment& s, const Pose& base_T, int depth) {
    if (s.stored) {
      const model::Trajectory* stored = from_.snapshot.get(s.stored);
      if (!stored)
        return error(ErrorCode::stale_handle, "its trajectory no longer exists",
                     "Give another one.");
      return write(*stored, spatial::compose(base_T, model::pose(s.placement)), depth + 1);
    }
    RMP_TRY_ASSIGN(const auto providers, motion::providers_of(from_.registry, s, "segment"));
    if (providers.is_joint()) return joint_segment(s, base_T);
    RMP_TRY_ASSIGN(const auto made, motion::make_segment(from_.registry, s, "segment"));
    const double duration = made->duration();
    std::string attributes;
    const double* speed = real_param(s, "speed");
    const std::string& law = s.law.name;
    if (speed && !s.shape.params.contains("duration") && law == "trapezoidal") {
      RMP_TRY_ASSIGN(attributes, trapezoid_words(from_, s, source_));
    } else if (speed && !s.shape.params.contains("duration") &&
               (law.empty() || law == "constant_speed")) {
      attributes = " SPEED := " + irl_real(kMm * *speed);
      source_.note(
          "Segments at constant speed start and end at rest in the program, which takes longer, "
          "except where they are blended.");
    } else {
      attributes = " TIME := " + irl_real(duration);
      if (!law.empty() && law != "trapezoidal")
        source_.note("Segments of the law " + quote(law) +
                     " keep their duration, with a trapezoidal profile.");
    }
    std::vector<PathSample> at(1);
    const double begin = 0;
    RMP_TRY(made->sample(std::span(&begin, 1), at));
    approach(spatial::compose(base_T, at[0].pose));
    const auto place = [&](double t) -> Result<std::string> {
      std::vector<PathSample> one(1);
      RMP_TRY(made->sample(std::span(&t, 1), one));
      last_ = spatial::compose(base_T, one[0].pose);
      return irl_pose(last_);
    };
    if (s.shape.name == "line") {
      RMP_TRY_ASSIGN(const std::string to, place(duration));
      pending_ = "MOVE LIN " + to + attributes;
    } else if (s.shape.name == "arc" && s.points.size() == 3) {
      RMP_TRY_ASSIGN(const std::string to, place(duration));
      pending_ = "MOVE CIRCLE " + irl_pose(spatial::compose(base_T, model::pose(s.points[1]))) +
                 ", " + to + attributes;
    } else {
      std::string line = "MOVE PATH ";
      for (std::int64_t k = 1; k <= samples_; ++k) {
        RMP_TRY_ASSIGN(const std::string to,
                       place(duration * static_cast<double>(k) / static_cast<double>(samples_)));
        line += (k > 1 ? ",\n    " : "") + to;
      }
      pending_ = line + attributes;
      source_.note("Segments of the shape " + quote(s.shape.name) + " are paths through " +
                   std::to_string(samples_) + " points of them.");
    }
    return {};
  }
  Result<void> joint_segment(const model::TrajectorySegment& s, const Pose& base_T) {
    std::string attributes;
    if (const double* d = real_param(s, "duration"))
      attributes = " TIME := " + irl_real(*d / static_cast<double>(std::max<std::size_t>(
                                                   1, s.joints.size() + s.points.size())));
    else if (const double* share = real_param(s, "speed_share"))
      attributes = " SPEED_PTP := " + irl_real(kPercent * *share);
    if (s.shape.name != "ptp")
      source_.note("Segments of the shape " + quote(s.shape.name) +
                   " are joint motions from one of their points to the next.");
    std::vector<std::string> places;
    for (const auto& q : s.joints) {
      RMP_TRY_ASSIGN(std::string to, source_.joints(q));
      places.push_back(std::move(to));
    }
    for (const auto& p : s.points)
      places.push_back(irl_pose(spatial::compose(base_T, model::pose(p))));
    for (const std::string& to : places) {
      flush(nullptr);
      pending_ = "MOVE PTP " + to + attributes;
    }
    is_known_ = false;
    return {};
  }
  /// To the begin of a segment, where the one before does not end there.
  void approach(const Pose& begin) {
    constexpr double kSame = 1e-6;
    bool is_there = is_known_;
    for (std::size_t k = 0; k < 3; ++k)
      is_there = is_there && std::fabs(begin.p[k] - last_.p[k]) < kSame;
    for (std::size_t k = 0; k < 9; ++k)
      is_there = is_there && std::fabs(begin.R[k] - last_.R[k]) < kSame;
    if (!is_there) {
      const bool is_first = !is_known_ && pending_.empty();
      flush(nullptr);
      source_.body.add((is_first ? "MOVE PTP " : "MOVE LIN ") + irl_pose(begin) + ";");
    }
    last_ = begin;
    is_known_ = true;
  }

  const evaluation::Sources& from_;
  Source& source_;
  std::int64_t samples_;
  std::string pending_;
  Pose last_;
  bool is_known_ = false;
};

}  // namespace

Result<void> write_motions(const evaluation::Sources& from, Source& source,
                           const model::Trajectory& trajectory, const Pose& base_T_trajectory,
                           std::int64_t points) {
  return Motions(from, source, points).write(trajectory, base_T_trajectory);
}

Result<WrittenProgram> from_trajectory(const evaluation::Sources& from, WorldId world,
                                       std::size_t robot, std::size_t trajectory,
                                       std::int64_t points, const std::string& name,
                                       Progress& progress) {
  const model::World& w = *from.snapshot.get(world);
  RMP_TRY_ASSIGN(const Arm arm, arm_of(from, w, robot, progress));
  const model::PlacedTrajectory& placed = w.trajectories[trajectory];
  const model::Trajectory* t = from.snapshot.get(placed.trajectory);
  if (!t) return error(ErrorCode::stale_handle, "the trajectory no longer exists", "Give another.");
  Source source(arm);
  source.body.in();
  auto done = write_motions(
      from, source, *t, spatial::compose(arm.base_T_world, model::pose(placed.placement)), points);
  if (!done.ok()) return std::move(done).error().in("trajectory " + quote(placed.name));
  return finished(source, name.empty() ? placed.name : name,
                  "Of the trajectory " + placed.name + " for the robot " + arm.name + " of " +
                      name_of(from, world),
                  {}, {});
}

}  // namespace robomosp::program_source
