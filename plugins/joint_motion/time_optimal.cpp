// SPDX-License-Identifier: Apache-2.0
// From any state of motion to any other: as fast as limits of velocity, acceleration and jerk
// allow, all joints arriving together (layer: plugin). The mathematics: spatial/state_to_state.h.
#include <algorithm>
#include <cmath>

#include "knots.h"
#include "spatial/state_to_state.h"

namespace robomosp::joint_motion {
namespace {

using spatial::Ramps;
using spatial::StateToState;

class TimeOptimal final : public JointwiseSegment {
 public:
  TimeOptimal(double duration, std::vector<Ramps> joints, std::vector<Motion1> ends)
      : JointwiseSegment(joints.size(), duration),
        joints_(std::move(joints)),
        ends_(std::move(ends)) {}

 protected:
  [[nodiscard]] Motion1 at(std::size_t joint, double t) const override {
    if (t < duration()) return joints_[joint].at(t);
    Motion1 end = ends_[joint];  // to the last bit
    end.j = joints_[joint].end().j;
    return end;
  }

 private:
  std::vector<Ramps> joints_;
  std::vector<Motion1> ends_;
};

Error end_error(StateToState::Fault fault, const Task& t, const Motion1& end, std::size_t j) {
  if (fault == StateToState::Fault::end_velocity)
    return bad("the velocity of " + joint_name(j) + " at the end is " + print_number(end.v, 6) +
                   ", above its limit " + print_number(t.velocity[j], 6),
               "Lower it.");
  if (fault == StateToState::Fault::end_acceleration)
    return bad("the acceleration of " + joint_name(j) + " at the end is " + print_number(end.a, 6) +
                   ", above its limit " + print_number(t.acceleration[j], 6),
               "Lower it.");
  return bad("with an acceleration of " + print_number(end.a, 6) + " at the end, " + joint_name(j) +
                 " would be above its velocity limit " + print_number(t.velocity[j], 6) +
                 " before or after it",
             "Bring velocity or acceleration at the end nearer to 0.");
}

}  // namespace

Result<std::unique_ptr<JointSegment>> TimeOptimalFactory::make(std::size_t dof,
                                                               std::span<const double> points,
                                                               const JointLimits& limits,
                                                               const JointEnds& ends,
                                                               const Params& params) const {
  RMP_TRY_ASSIGN(const Task task, read_task(dof, points, limits, params, 2));
  if (task.count > 2)
    return bad(std::to_string(task.count) + " joint vectors are given to time_optimal",
               "Give the first and the last; joint_spline passes through others in between.");
  RMP_TRY_ASSIGN(const auto v0, end_values(ends.start_velocity, task, "velocity at the start"));
  RMP_TRY_ASSIGN(const auto v1, end_values(end_or(ends.end_velocity, params, "end_velocity"), task,
                                           "velocity at the end"));
  RMP_TRY_ASSIGN(const auto a0,
                 end_values(ends.start_acceleration, task, "acceleration at the start"));
  RMP_TRY_ASSIGN(const auto a1,
                 end_values(end_or(ends.end_acceleration, params, "end_acceleration"), task,
                            "acceleration at the end"));
  std::vector<StateToState> work(dof);
  std::vector<Motion1> arrivals;
  for (std::size_t j = 0; j < dof; ++j) {
    RMP_TRY(need(task.jerk, "jerk", j, "jerk"));
    const Motion1 start{task.at(0, j), v0[j], a0[j], 0}, end{task.at(1, j), v1[j], a1[j], 0};
    const auto fault =
        work[j].prepare(start, end, {task.velocity[j], task.acceleration[j], task.jerk[j]});
    if (fault != StateToState::Fault::none) return end_error(fault, task, end, j);
    arrivals.push_back(end);
  }
  const double wanted = params.real("duration"), least = spatial::common_duration(work);
  if (!(least > 0))
    return bad("start and end are the same state", "Give two different joint vectors.");
  const double duration = wanted > 0 ? spatial::common_duration(work, wanted) : least;
  if (!std::isfinite(duration))
    return bad("no motion between these states was found", "Check the states and limits.");
  if (wanted > 0 && wanted < least * (1 - 1e-12))
    return bad("a duration of " + print_number(wanted) + " s is too short for the limits",
               "The shortest is " + print_number(least, 6) + " s.");
  if (wanted > 0 && duration > wanted * (1 + 1e-9))
    return bad("with their initial motion, not all joints can be delayed to " +
                   print_number(wanted) + " s",
               "The next possible duration is " + print_number(duration, 6) + " s.");
  std::vector<Ramps> joints;
  for (std::size_t j = 0; j < dof; ++j) {
    joints.push_back(work[j].motion(duration));
    const auto pieces = joints[j].pieces();
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const double until = i + 1 < pieces.size() ? pieces[i + 1].from : joints[j].duration();
      const Motion1& s = pieces[i].start;
      RMP_TRY(check_range({s.x, s.v, s.a / 2, s.j / 6, 0, 0}, until - pieces[i].from, task, j, 0));
    }
  }
  return std::unique_ptr<JointSegment>(
      new TimeOptimal(duration, std::move(joints), std::move(arrivals)));
}

}  // namespace robomosp::joint_motion
