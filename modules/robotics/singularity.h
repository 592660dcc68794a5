// SPDX-License-Identifier: Apache-2.0
// Mobility of a tip: singular values of its Jacobian, ellipsoids of velocity and force, rank, and
// the directions lost at a singularity (layer: data processing, robotics). [any thread]
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// A direction of motion (vx vy vz wx wy wz) or the like, unit length.
using Twist = std::array<double, 6>;

/// The part of the twist that is analysed.
enum class TwistPart { all, translation, rotation };

/// Measures of a Jacobian given joint after joint, (v, w) each.
struct Dexterity {
  std::vector<double> singular_values;  ///< descending, min(rows, dof) of them
  double yoshikawa = 0;  ///< product of the singular values (Yoshikawa, IJRR 4(2), 1985)
  double condition = 0;  ///< greatest / least, infinite when singular; 1 = isotropic
  double least = 0;      ///< least singular value: the slowest direction for unit joint rates
  Twist weakest{};       ///< direction of the least one; zeros for the omitted part
};
/// Linear rows are first divided by `length` [m], so that both parts have equal weight; 1 =
/// unchanged. `loose`: twists of the tip with the motors at rest (TipMotion); their directions have
/// infinite singular values, and then all measures are infinite except `yoshikawa`, which is 0 if a
/// direction is lost as well, and `least` and `weakest`, which are those of the other directions.
[[nodiscard]] Dexterity dexterity(std::span<const double> jacobian, TwistPart part, double length,
                                  std::span<const double> loose = {});

/// The velocities of the tip for joint rates of unit length, an ellipsoid about the tip; the forces
/// for joint torques of unit length have the same axes and the inverse half lengths.
struct Ellipsoid {
  std::array<double, 9> axes{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< columns, right-handed, row-major
  /// Half lengths, descending [m/s or rad/s for unit rates]; infinite along directions not held by
  /// the motors.
  Vec3 velocity{};
  Vec3 force{};  ///< half lengths; infinite along lost directions [N or N m]
};
/// For the linear or the angular part of a Jacobian; its axes are the ellipsoid's. `loose` as
/// above.
[[nodiscard]] Ellipsoid ellipsoid(std::span<const double> jacobian, TwistPart part,
                                  std::span<const double> loose = {});

/// Motions lost in a configuration compared to others, and in closed loops the self-motions gained:
/// Gosselin and Angeles' first and second kind (1990; see tip_motion.h).
struct Singularity {
  int rank = 0;                           ///< here
  int full_rank = 0;                      ///< greatest, over the joint space
  double least = 0;                       ///< the full_rank-th singular value, over the greatest
  std::vector<Twist> lost;                ///< full_rank - rank of them, base axes, at the tip
  std::vector<std::vector<double>> idle;  ///< joint rates without effect on the tip, unit, dof()
                                          ///< each
  int mobility = 0;                       ///< independent motions that keep the loops closed, here
  int least_mobility = 0;  ///< the least, over the joint space: if fewer than here, the loops yield
                           ///< here
  /// Additional joint rates with the motors at rest, unit, dof() each, beyond those at other
  /// configurations, and the tip's twists of unit length for them, base axes; zeros if the tip is
  /// at rest.
  std::vector<std::vector<double>> loose;
  std::vector<Twist> gained;
  double hold = 1;  ///< least rate of the motors for unit joint rates: 0 = not held by the motors
  [[nodiscard]] bool is_singular() const {
    return rank < full_rank || !loose.empty() || mobility > least_mobility;
  }
};
/// Analyses a tip in one configuration, with loops closed, for the whole twist or a part of it. A
/// direction counts as lost if its rate is below `threshold` times the greatest, with lengths
/// relative to reach(); a motion is loose if the motors turn by less than `threshold` for unit
/// joint rates.
[[nodiscard]] Singularity singularity(const RobotModel& model, std::size_t tip,
                                      std::span<const double> q, TwistPart part = TwistPart::all,
                                      double threshold = 1e-6);

/// True if singularity() of a mechanism without loops certainly finds no lost direction, from the
/// joint frames of the configuration: all singular values are above the threshold by a margin.
/// Costs a factorization of at most 6 x 6 instead of a dozen decompositions; allocates little.
[[nodiscard]] bool is_surely_regular(const RobotModel& model, std::size_t tip,
                                     std::span<const Pose> joint_frames, TwistPart part,
                                     double threshold);

/// The sum of the distances between the joints from base to tip, or to the closing frame of a loop
/// if that is farther; if below 1e-9, 1 [m].
[[nodiscard]] double reach(const RobotModel& model, std::size_t tip);

/// "cannot move along (0, 0, 1)", "cannot turn about (1, 0, 0)", or both at once.
[[nodiscard]] std::string lost_words(const Twist& twist);
/// "can move along (0, 0, 1) with the motors at rest"; of zeros "its joints can move ...".
[[nodiscard]] std::string gained_words(const Twist& twist);

}  // namespace robomosp::robotics
