// SPDX-License-Identifier: Apache-2.0
#include "scene/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kernel/text.h"
#include "robotics/coordinates.h"
#include "scene/playback.h"

namespace robomosp::scene {
namespace {

/// Two rows and how far between them a time is.
struct Between {
  std::size_t a = 0, b = 0;
  double share = 0;  ///< 0 = at row a, 1 = at row b
};

Between rows_at(const std::vector<double>& times, double time) {
  const auto after =
      static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), time) - times.begin());
  Between at;
  at.a = after == 0 ? 0 : after - 1;
  at.b = std::min(after == 0 ? 0 : after, times.size() - 1);
  const double span = times[at.b] - times[at.a];
  at.share = span > 0 ? std::min((time - times[at.a]) / span, 1.0) : 0.0;
  return at;
}

/// Quaternions stand in q as four coordinates without a unit; either sign is the same rotation.
void take_nearer_signs(const model::Robot& robot, const std::vector<double>& a,
                       std::vector<double>& b) {
  const auto units = robotics::coordinate_units(robot);
  for (std::size_t k = 0; k + 4 <= units.size() && k + 4 <= b.size();) {
    if (!units[k].empty()) {
      ++k;
      continue;
    }
    double cosine = 0;
    for (std::size_t i = k; i < k + 4; ++i) cosine += a[i] * b[i];
    for (std::size_t i = k; cosine < 0 && i < k + 4; ++i) b[i] = -b[i];
    k += 4;
  }
}

Pose pose_at_row(const std::array<const recording::Column*, 7>& place, std::size_t row) {
  std::array<double, 7> at{};
  for (std::size_t k = 0; k < at.size(); ++k) at[k] = place[k]->values[row];
  return recording::pose_of_place(at);
}

/// Joint values of a robot along `<prefix>q1`, ...
Result<std::vector<double>> joints_at(const model::Robot& robot,
                                      const recording::Recording& recording,
                                      const std::string& prefix, const Between& at) {
  const std::size_t count = robotics::neutral_coordinates(robot).size();
  const recording::Column* beyond = recording.find(prefix + "q" + std::to_string(count + 1));
  std::vector<double> q, next;
  for (std::size_t j = 0; j < count; ++j) {
    const auto* column = recording.find(prefix + "q" + std::to_string(j + 1));
    if (!column || beyond)
      return error(ErrorCode::conflict, "the recording was made from a robot with other joints",
                   "Simulate again.");
    q.push_back(column->values[at.a]);
    next.push_back(column->values[at.b]);
  }
  take_nearer_signs(robot, q, next);
  if (at.share > 0)
    for (std::size_t j = 0; j < count; ++j) q[j] += at.share * (next[j] - q[j]);
  return q;
}

}  // namespace

Result<Motion> motion_at(const document::Snapshot& snapshot, WorldId id,
                         const recording::Recording& recording, double time) {
  const model::World* world = snapshot.get(id);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  Motion out;
  if (recording.columns.empty() || recording.columns.front().values.empty()) return out;
  const Between at = rows_at(recording.columns.front().values, time);
  bool is_found = recording.robot.empty();
  for (const model::PlacedRobot& placed : world->robots) {
    // Further robots have their columns under their names.
    const bool is_main = placed.name == recording.robot;
    const std::string prefix = is_main ? "" : placed.name + ".";
    is_found = is_found || is_main;
    if (!is_main && !recording.find(prefix + "q1")) continue;
    const model::Robot* robot = snapshot.get(placed.robot);
    if (!robot) continue;
    RMP_TRY_ASSIGN(std::vector<double> q, joints_at(*robot, recording, prefix, at));
    out.q[placed.name] = std::move(q);
  }
  if (!is_found)
    return error(ErrorCode::unknown_name,
                 "the world has no robot " + text::quote(recording.robot) + " any more",
                 "Simulate again.");
  for (const model::PlacedObject& placed : world->objects) {
    std::array<const recording::Column*, 7> place{};
    bool is_told = true;
    for (std::size_t k = 0; k < place.size() && is_told; ++k) {
      place[k] = recording.find(placed.name + recording::kPlaceColumns[k]);
      is_told = place[k] != nullptr;
    }
    if (!is_told) continue;
    Playback way;
    way.times = {0, 1};
    way.ids = {0};
    way.poses = {pose_at_row(place, at.a), pose_at_row(place, at.b)};
    out.objects[placed.name] = poses_at(way, at.share).front();
  }
  return out;
}

Result<Motion> motion_at(const document::Snapshot& snapshot, RobotId id,
                         const recording::Recording& recording, double time) {
  const auto* record = snapshot.find(AnyId(id));
  const model::Robot* robot = snapshot.get(id);
  if (!record || !robot)
    return error(ErrorCode::stale_handle, "the robot no longer exists", "Open or create one.");
  Motion out;
  if (recording.columns.empty() || recording.columns.front().values.empty()) return out;
  RMP_TRY_ASSIGN(out.q[record->name],
                 joints_at(*robot, recording, "", rows_at(recording.columns.front().values, time)));
  return out;
}

}  // namespace robomosp::scene
