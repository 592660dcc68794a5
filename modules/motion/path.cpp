// SPDX-License-Identifier: Apache-2.0
#include "motion/path.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/segment.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

/// How far apart the end of one segment and the start of the next are.
Result<void> check_joint(const Segment& before, const Segment& after, std::size_t index) {
  const double end = before.duration(), start = 0;
  PathSample a, b;
  before.sample({&end, 1}, {&a, 1});
  after.sample({&start, 1}, {&b, 1});
  const double gap = spatial::distance(a.pose.p, b.pose.p);
  const double turn = spatial::norm(spatial::rotation_difference(a.pose.R, b.pose.R));
  if (gap <= kJoinPosition && turn <= kJoinRotation) return {};
  const std::string names = "segment " + std::to_string(index) + " ends and segment " +
                            std::to_string(index + 1) + " starts ";
  return error(ErrorCode::invalid_argument,
               gap > kJoinPosition
                   ? names + text::print_rounded(gap) + " m apart"
                   : names + "with orientations " + text::print_rounded(turn) + " rad apart",
               "Give the second segment the first one's last pose, or put a line between them.");
}

/// The segments of a trajectory and of those stored in it, in order, seen from the outermost.
class Collector {
 public:
  Collector(const Registry& registry, const FindTrajectory& find)
      : registry_(registry), find_(find) {}

  Result<void> collect(const model::Trajectory& trajectory, const std::string& where,
                       const Pose& outer_T_trajectory, bool is_outermost) {
    if (trajectory.segments.empty())
      return error(ErrorCode::invalid_argument, "it has no segments",
                   "Add a segment such as a line or a circle.", where);
    for (std::size_t i = 0; i < trajectory.segments.size(); ++i) {
      const model::TrajectorySegment& record = trajectory.segments[i];
      const std::string here = where + ", segment " + std::to_string(i + 1);
      if (record.stored) {
        RMP_TRY(collect_stored(record, here, outer_T_trajectory));
        continue;
      }
      RMP_TRY_ASSIGN(auto segment, make_segment(registry_, record, here));
      if (!is_outermost) segment = placed_segment(outer_T_trajectory, std::move(segment));
      out.push_back(std::move(segment));
    }
    return {};
  }

  std::vector<std::shared_ptr<const Segment>> out;

 private:
  Result<void> collect_stored(const model::TrajectorySegment& record, const std::string& here,
                              const Pose& outer_T_trajectory) {
    const model::Record* stored = find_ ? find_(record.stored) : nullptr;
    const auto* trajectory = stored ? std::get_if<model::Trajectory>(&stored->body) : nullptr;
    if (!trajectory)
      return error(ErrorCode::not_found, "the trajectory it runs is not there",
                   "Remove the segment or give another trajectory.", here);
    if (std::find(open_.begin(), open_.end(), record.stored) != open_.end())
      return error(ErrorCode::invalid_argument,
                   "trajectory " + text::quote(stored->name) + " would run itself",
                   "Remove one of the segments that go round in a circle.", here);
    open_.push_back(record.stored);
    RMP_TRY(collect(*trajectory, here + ", trajectory " + text::quote(stored->name),
                    spatial::compose(outer_T_trajectory, model::pose(record.placement)), false));
    open_.pop_back();
    return {};
  }

  const Registry& registry_;
  const FindTrajectory& find_;
  std::vector<TrajectoryId> open_;  ///< being run, outermost first
};

}  // namespace

Result<std::shared_ptr<const Path>> Path::build(const Registry& registry,
                                                std::string_view trajectory_name,
                                                const model::Trajectory& trajectory,
                                                const FindTrajectory& find) {
  const std::string name = "trajectory " + text::quote(trajectory_name);
  Collector collector(registry, find);
  RMP_TRY(collector.collect(trajectory, name, Pose{}, true));
  auto path = std::make_shared<Path>();
  path->starts_.push_back(0);
  for (auto& segment : collector.out) RMP_TRY(path->append(std::move(segment), name));
  return std::shared_ptr<const Path>(std::move(path));
}

Result<void> Path::append(std::shared_ptr<const Segment> segment,
                          std::string_view trajectory_name) {
  if (!segments_.empty())
    RMP_TRY(check_joint(*segments_.back(), *segment, segments_.size()).in(trajectory_name));
  starts_.push_back(starts_.back() + segment->duration());
  length_ += segment->length();
  segments_.push_back(std::move(segment));
  return {};
}

void Path::sample(std::span<const double> times, std::span<PathSample> out) const {
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
    segments_[segment]->sample(std::span<const double>(local).subspan(first, last - first),
                               out.subspan(first, last - first));
    first = last;
  }
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
