// SPDX-License-Identifier: Apache-2.0
#include "motion/cartesian_path.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/segment.h"
#include "motion/transition.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

/// The segments of a trajectory and of those stored in it, in order, seen from the outermost.
class Collector {
 public:
  Collector(const Registry& registry, const FindTrajectory& find)
      : registry_(registry), find_(find) {}

  /// `first` is how the first segment follows what was before.
  Result<void> collect(const model::Trajectory& trajectory, const std::string& where,
                       const Pose& outer_T_trajectory, const model::Transition& first) {
    const bool is_outermost = open_.empty();
    if (trajectory.segments.empty())
      return error(ErrorCode::invalid_argument, "it has no segments",
                   "Add a segment such as a line or a circle.", where);
    for (std::size_t i = 0; i < trajectory.segments.size(); ++i) {
      const model::TrajectorySegment& record = trajectory.segments[i];
      const model::Transition& transition = i == 0 ? first : record.transition;
      const std::string here = where + ", segment " + std::to_string(i + 1);
      if (is_outermost) number_ = i + 1;
      if (record.stored) {
        RMP_TRY(collect_stored(record, here, outer_T_trajectory, transition));
        continue;
      }
      SegmentInLine next;
      next.transition = transition;
      RMP_TRY_ASSIGN(next.segment, make_segment(registry_, record, here, &next.limits));
      if (!is_outermost) next.segment = placed_segment(outer_T_trajectory, std::move(next.segment));
      line.push_back(std::move(next));
      numbers.push_back(number_);
    }
    return {};
  }

  std::vector<SegmentInLine> line;
  std::vector<std::size_t> numbers;  ///< of each: the outermost trajectory's segment

 private:
  Result<void> collect_stored(const model::TrajectorySegment& record, const std::string& here,
                              const Pose& outer_T_trajectory, const model::Transition& first) {
    const model::Record* stored = find_ ? find_(record.stored) : nullptr;
    const auto* trajectory = stored ? std::get_if<model::Trajectory>(&stored->body) : nullptr;
    if (!trajectory)
      return error(ErrorCode::not_found, "the trajectory it runs does not exist",
                   "Remove the segment or give another trajectory.", here);
    if (std::find(open_.begin(), open_.end(), record.stored) != open_.end())
      return error(ErrorCode::invalid_argument,
                   "trajectory " + text::quote(stored->name) + " would run itself",
                   "Remove one of the segments that form the cycle.", here);
    open_.push_back(record.stored);
    RMP_TRY(collect(*trajectory, here + ", trajectory " + text::quote(stored->name),
                    spatial::compose(outer_T_trajectory, model::pose(record.placement)), first));
    open_.pop_back();
    return {};
  }

  const Registry& registry_;
  const FindTrajectory& find_;
  std::vector<TrajectoryId> open_;  ///< being run, outermost first
  std::size_t number_ = 0;          ///< of the outermost trajectory's segment
};

}  // namespace

Result<std::shared_ptr<const Path>> Path::build(const Registry& registry,
                                                std::string_view trajectory_name,
                                                const model::Trajectory& trajectory,
                                                const FindTrajectory& find) {
  const std::string name = "trajectory " + text::quote(trajectory_name);
  Collector collector(registry, find);
  RMP_TRY(collector.collect(trajectory, name, Pose{}, {}));
  auto joined = join(collector.line);
  if (!joined.ok()) return std::move(joined).error().in(name);
  auto path = std::make_shared<Path>();
  path->starts_.push_back(0);
  for (JoinedPiece& piece : joined->pieces) {
    path->pieces_.push_back({std::move(piece.segment), path->starts_.back(),
                             collector.numbers[piece.index], piece.is_transition});
    const Segment& segment = *path->pieces_.back().segment;
    path->starts_.push_back(path->starts_.back() + segment.duration());
    path->length_ += segment.length();
  }
  for (std::string& note : joined->notes) path->notes_.push_back(name + ": " + std::move(note));
  return std::shared_ptr<const Path>(std::move(path));
}

Result<std::vector<std::string>> Path::check(const Registry& registry,
                                             std::string_view trajectory_name,
                                             const model::Trajectory& trajectory,
                                             const FindTrajectory& find) {
  bool has_joints = false;
  for (std::size_t i = 0; i < trajectory.segments.size(); ++i) {
    const model::TrajectorySegment& record = trajectory.segments[i];
    if (record.stored) continue;
    const std::string where =
        "trajectory " + text::quote(trajectory_name) + ", segment " + std::to_string(i + 1);
    RMP_TRY_ASSIGN(const SegmentProviders providers, providers_of(registry, record, where));
    if (!providers.is_joint()) continue;
    has_joints = true;
    RMP_TRY(params_of(providers, record, where));
    if (record.joints.empty() && record.points.empty())
      return error(ErrorCode::invalid_argument, "it has neither joint vectors nor points",
                   "Give joints = {{...}, ...}, or points.", where);
  }
  if (has_joints) return std::vector<std::string>();  // what follows what shows on a robot
  auto built = build(registry, trajectory_name, trajectory, find);
  if (!built.ok()) return std::move(built).error();
  return (*built)->notes();
}

Result<void> Path::sample(std::span<const double> times, std::span<PathSample> out) const {
  // Runs of samples in one segment go to its provider in one call.
  std::vector<double> local(times.size());
  std::size_t first = 0;
  const auto segment_at = [this](double t) {
    const auto next = std::upper_bound(starts_.begin() + 1, starts_.end() - 1, t);
    return static_cast<std::size_t>(next - starts_.begin()) - 1;
  };
  while (first < times.size()) {
    const std::size_t segment = segment_at(times[first]);
    std::size_t last = first;
    while (last < times.size() && segment_at(times[last]) == segment) {
      local[last] = times[last] - starts_[segment];
      ++last;
    }
    RMP_TRY(pieces_[segment].segment->sample(
        std::span<const double>(local).subspan(first, last - first),
        out.subspan(first, last - first)));
    first = last;
  }
  return {};
}

std::vector<double> Path::sample_times(double step) const {
  std::vector<double> times;
  const double end = duration();
  const auto count = static_cast<std::size_t>(std::floor(end / step * (1 + 1e-12)));
  times.reserve(count + 2);
  for (std::size_t i = 0; i <= count; ++i)
    times.push_back(std::min(static_cast<double>(i) * step, end));
  if (end - times.back() > 1e-9 * step) times.push_back(end);
  return times;
}

}  // namespace robomosp::motion
