// SPDX-License-Identifier: Apache-2.0
// How well a tip can move: singular values of its Jacobian, ellipsoids of velocity and force, rank,
// and the directions that are lost where it is singular (layer: data processing, robotics).
// [any thread]
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// A direction of motion (vx vy vz wx wy wz) or the like, unit length.
using Twist = std::array<double, 6>;

/// Which part of the twist is looked at.
enum class TwistPart { all, translation, rotation };

/// Measures of a Jacobian given joint after joint, (v, w) each.
struct Dexterity {
  std::vector<double> singular_values;  ///< descending, min(rows, dof) of them
  double yoshikawa = 0;  ///< product of the singular values (Yoshikawa, IJRR 4(2), 1985)
  double condition = 0;  ///< greatest / least, infinite when singular; 1 = isotropic
  double least = 0;      ///< least singular value: the slowest direction for unit joint rates
  Twist weakest{};       ///< direction of the least one; zeros for the part left out
};
/// Linear rows are divided by `length` [m] first, so that both parts count alike; 1 = as they are.
/// `loose`: twists that the tip makes while the motors stand still (TipMotion); their directions
/// have infinite singular values, and where there are some the measures are infinite too, but for
/// `yoshikawa`, 0 where something is lost as well, and `least` and `weakest`, of the others.
[[nodiscard]] Dexterity dexterity(std::span<const double> jacobian, TwistPart part, double length,
                                  std::span<const double> loose = {});

/// The velocities of the tip for joint rates of unit length, an ellipsoid about the tip; the forces
/// for joint torques of unit length have the same axes and the inverse half lengths.
struct Ellipsoid {
  std::array<double, 9> axes{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< columns, right-handed, row-major
  /// Half lengths, descending [m/s or rad/s for unit rates]; infinite along directions that the
  /// motors do not hold.
  Vec3 velocity{};
  Vec3 force{};  ///< half lengths; infinite along directions that are lost [N or N m]
};
/// Of the linear or the angular part of a Jacobian; its axes are the ellipsoid's. `loose` as above.
[[nodiscard]] Ellipsoid ellipsoid(std::span<const double> jacobian, TwistPart part,
                                  std::span<const double> loose = {});

/// What a configuration cannot do that the robot can do elsewhere, and what in closed loops it does
/// of itself: Gosselin and Angeles' first and second kind (1990; see tip_motion.h).
struct Singularity {
  int rank = 0;                           ///< here
  int full_rank = 0;                      ///< greatest, over the joint space
  double least = 0;                       ///< the full_rank-th singular value, over the greatest
  std::vector<Twist> lost;                ///< full_rank - rank of them, base axes, at the tip
  std::vector<std::vector<double>> idle;  ///< joint rates that move nothing, unit, dof() each
  int mobility = 0;                       ///< independent motions that keep the loops closed, here
  int least_mobility = 0;  ///< the least, over the joint space: greater here = the loops give way
  /// Joint rates with the motors at rest, unit, dof() each, that there are elsewhere fewer of, and
  /// the tip's twists of unit length for them, base axes; zeros where the tip stays.
  std::vector<std::vector<double>> loose;
  std::vector<Twist> gained;
  double hold = 1;  ///< least rate of the motors for unit joint rates: 0 = not held by the motors
  [[nodiscard]] bool is_singular() const {
    return rank < full_rank || !loose.empty() || mobility > least_mobility;
  }
};
/// Looks at a tip in one configuration, closed where there are loops, at the whole twist or at a
/// part of it. A direction counts as lost when its rate is below `threshold` times the greatest,
/// lengths counted in the way from base to tip; a motion as loose when the motors turn by less than
/// `threshold` for unit joint rates.
[[nodiscard]] Singularity singularity(const RobotModel& model, std::size_t tip,
                                      std::span<const double> q, TwistPart part = TwistPart::all,
                                      double threshold = 1e-6);

/// Whether singularity() of a mechanism without loops surely finds nothing lost, from the joint
/// frames of the configuration: true where all singular values are above the threshold by a margin.
/// Costs a factorization of at most 6 x 6 instead of a dozen decompositions; allocates little.
[[nodiscard]] bool is_surely_regular(const RobotModel& model, std::size_t tip,
                                     std::span<const Pose> joint_frames, TwistPart part,
                                     double threshold);

/// The sum of the distances between the joints from base to tip, or to where a loop closes if that
/// is farther; at least 1e-9, else 1 [m].
[[nodiscard]] double reach(const RobotModel& model, std::size_t tip);

/// "cannot move along (0, 0, 1)", "cannot turn about (1, 0, 0)", or both at once.
[[nodiscard]] std::string lost_words(const Twist& twist);
/// "can move along (0, 0, 1) with the motors at rest"; of zeros "its joints can move ...".
[[nodiscard]] std::string gained_words(const Twist& twist);

}  // namespace robomosp::robotics
