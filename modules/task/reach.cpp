// SPDX-License-Identifier: Apache-2.0
// What a gripper reaches: one rule for the steps of tasks and the grips of programs.
#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "model/placement.h"
#include "spatial/pose.h"
#include "task/task_executor.h"

namespace robomosp::task {
namespace {

using text::quote;
using Box = std::array<Vec3, 2>;  ///< {min, max} in its own frame [m]

Vec3 into_box(const Box& box, const Vec3& p) {
  Vec3 out;
  for (std::size_t k = 0; k < 3; ++k) out[k] = std::clamp(p[k], box[0][k], box[1][k]);
  return out;
}

/// Least distance of two boxes, the second at a_T_b in the frame of the first. Points of both go
/// to the nearest point of the other by turns, which ends at the nearest two of convex bodies
/// (W. Cheney, A. Goldstein, "Proximity Maps for Convex Sets", 1959).
double distance_of_boxes(const Box& a, const Pose& a_T_b, const Box& b) {
  constexpr int kMostTurns = 10'000;
  constexpr double kSettled = 1e-9;  // [m]
  const Pose b_T_a = spatial::inverse(a_T_b);
  Vec3 p = into_box(a, spatial::transform(a_T_b, spatial::scale(spatial::add(b[0], b[1]), 0.5)));
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostTurns; ++i) {
    const Vec3 q = spatial::transform(a_T_b, into_box(b, spatial::transform(b_T_a, p)));
    const double now = spatial::distance(p, q);
    const Vec3 next = into_box(a, q);
    const bool is_settled = spatial::distance(p, next) < kSettled * 1e-3 || now < kSettled;
    least = std::min(least, now);
    if (is_settled) break;
    p = next;
  }
  return least < kSettled ? 0 : least;
}

}  // namespace

Result<TaskExecutor::Gripper> TaskExecutor::gripper(std::size_t who, const std::string& link,
                                                    const Grip& grip, double t,
                                                    Progress& progress) const {
  const Actor& a = actors_[who];
  Gripper out;
  const Pose joint = world_T_joint(a, grip.joint, t);
  out.world_point = spatial::compose(joint, grip.joint_T_grip).p;
  const auto& links = a.record->links;
  const bool names_link =
      std::any_of(links.begin(), links.end(), [&](const auto& l) { return l.name == link; }) &&
      std::none_of(a.record->tools.begin(), a.record->tools.end(),
                   [&](const auto& tool) { return tool.name == link; });
  out.is_link = names_link || (link.empty() && a.record->tools.empty() &&
                               a.record->attached.empty() && a.tcp.empty());
  if (!out.is_link) return out;
  const std::vector<robotics::LinkFrame> frames = robotics::link_frames(*a.record);
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (frames[i].joint != grip.joint) continue;
    for (const model::BodyPart& part : links[i].parts) {
      RMP_TRY_ASSIGN(const Box box, sim_->derived.bounds(sim_->snapshot, part.what, progress));
      out.bodies.emplace_back(spatial::compose(spatial::compose(joint, frames[i].joint_T_link),
                                               model::pose(part.placement)),
                              box);
    }
  }
  return out;
}

Result<double> TaskExecutor::distance(const Gripper& from, const Thing& thing, double t,
                                      Progress& progress) const {
  const Pose pose = pose_of(thing, t), object_T_world = spatial::inverse(pose);
  RMP_TRY_ASSIGN(const Box box, sim_->derived.bounds(sim_->snapshot, thing.placed->what, progress));
  const Vec3 p = spatial::transform(object_T_world, from.world_point);
  double out = spatial::distance(p, into_box(box, p));
  for (const auto& [world_T_body, body] : from.bodies)
    out =
        std::min(out, distance_of_boxes(box, spatial::compose(object_T_world, world_T_body), body));
  return out;
}

Result<TaskExecutor::Reached> TaskExecutor::reached(const Gripper& from, double reach, double t,
                                                    Progress& progress) const {
  std::vector<std::pair<double, const Thing*>> found;
  Reached out;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Thing& thing : things_) {
    RMP_TRY_ASSIGN(const double away, distance(from, thing, t, progress));
    if (away < nearest) {
      nearest = away;
      out.nearest = thing.placed->name, out.distance = away;
    }
    if (away > reach) continue;
    // Of several that hold the point, the one whose middle is nearest.
    RMP_TRY_ASSIGN(const Box box,
                   sim_->derived.bounds(sim_->snapshot, thing.placed->what, progress));
    const Vec3 middle =
        spatial::transform(pose_of(thing, t), spatial::scale(spatial::add(box[0], box[1]), 0.5));
    found.emplace_back(away + 1e-6 * spatial::distance(middle, from.world_point), &thing);
  }
  std::sort(found.begin(), found.end());
  for (const auto& [distance, thing] : found) out.objects.push_back(thing->placed->name);
  return out;
}

std::string TaskExecutor::missed(const std::string& robot, const Gripper& from,
                                 const std::string& object, double away, double reach) {
  // 3 digits of what is far, and never "5 mm away" of what is not within 5 mm.
  const auto length = [](double metres) {
    return metres < 1 ? text::print_rounded(metres * 1000, 4) + " mm"
                      : text::print_rounded(metres, 4) + " m";
  };
  return object + " is " + length(away) + " away from the " + (from.is_link ? "link" : "tool") +
         " of " + robot + ", which reaches " + length(reach);
}

}  // namespace robomosp::task
