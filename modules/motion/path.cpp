// SPDX-License-Identifier: Apache-2.0
#include "motion/path.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "model/placement.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

Value value_of(const model::ProviderChoice::Param& p) {
  return std::visit(
      [](const auto& v) -> Value {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::vector<double>>) return NumericArray(v);
        else return Value(v);
      },
      p);
}

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

}  // namespace

Result<std::unique_ptr<Params>> checked_params(const ProviderInfo& provider,
                                               const model::ProviderChoice& choice,
                                               std::string_view where) {
  Map given;
  for (const auto& [name, param] : choice.params) given.set(name, value_of(param));
  auto checked = check(provider.schema, given);
  if (!checked.ok()) return std::move(checked).error().in(where);
  return make_params(std::move(checked).value());
}

Result<std::shared_ptr<const Path>> Path::build(const Registry& registry,
                                                std::string_view trajectory_name,
                                                const model::Trajectory& trajectory) {
  const std::string name = "trajectory " + text::quote(trajectory_name);
  if (trajectory.segments.empty())
    return error(ErrorCode::invalid_argument, "it has no segments",
                 "Add a segment such as a line or a circle.", name);
  auto path = std::make_shared<Path>();
  path->starts_.push_back(0);
  for (std::size_t i = 0; i < trajectory.segments.size(); ++i) {
    const auto& record = trajectory.segments[i];
    const std::string where = name + ", segment " + std::to_string(i + 1);
    RMP_TRY_ASSIGN(const ProviderInfo info,
                   registry.find(SegmentMaker::kInterfaceId, record.shape.name).in(where));
    RMP_TRY_ASSIGN(auto maker, registry.create<SegmentMaker>(info.name).in(where));
    RMP_TRY_ASSIGN(auto params, checked_params(info, record.shape, where));
    std::vector<Pose> points;
    points.reserve(record.points.size());
    for (const auto& p : record.points) points.push_back(model::pose(p));
    auto made = guarded(info.name, [&] { return maker->make(points, *params); });
    if (!made.ok()) return std::move(made).error().in(where);
    std::shared_ptr<const Segment> segment = std::move(made).value();
    const double duration = segment ? segment->duration() : 0;
    if (!std::isfinite(duration) || duration <= 0)
      return error(ErrorCode::plugin_failed,
                   "provider \"" + info.name + "\" made a segment without a positive duration",
                   "Report it to the provider's author or choose another provider.", where);
    if (i > 0) RMP_TRY(check_joint(*path->segments_.back(), *segment, i).in(name));
    path->starts_.push_back(path->starts_.back() + duration);
    path->length_ += segment->length();
    path->segments_.push_back(std::move(segment));
  }
  return std::shared_ptr<const Path>(std::move(path));
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
