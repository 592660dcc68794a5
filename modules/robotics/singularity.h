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
[[nodiscard]] Dexterity dexterity(std::span<const double> jacobian, TwistPart part, double length);

/// The velocities of the tip for joint rates of unit length, an ellipsoid about the tip; the forces
/// for joint torques of unit length have the same axes and the inverse half lengths.
struct Ellipsoid {
  std::array<double, 9> axes{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< columns, right-handed, row-major
  Vec3 velocity{};  ///< half lengths, descending [m/s or rad/s for unit rates]
  Vec3 force{};     ///< half lengths; infinite along directions that are lost [N or N m]
};
/// Of the linear or the angular part of a Jacobian; its axes are the ellipsoid's.
[[nodiscard]] Ellipsoid ellipsoid(std::span<const double> jacobian, TwistPart part);

/// What a configuration cannot do that the robot can do elsewhere.
struct Singularity {
  int rank = 0;                           ///< here
  int full_rank = 0;                      ///< greatest, over the joint space
  double least = 0;                       ///< the full_rank-th singular value, over the greatest
  std::vector<Twist> lost;                ///< full_rank - rank of them, base axes, at the tip
  std::vector<std::vector<double>> idle;  ///< joint rates that move nothing, unit, dof() each
  [[nodiscard]] bool is_singular() const { return rank < full_rank; }
};
/// Looks at a tip in one configuration, at the whole twist or at a part of it. A direction counts
/// as lost when its rate is below `threshold` times the greatest, lengths counted in the way from
/// base to tip.
[[nodiscard]] Singularity singularity(const RobotModel& model, std::size_t tip,
                                      std::span<const double> q, TwistPart part = TwistPart::all,
                                      double threshold = 1e-6);

/// The sum of the distances between the joints from base to tip, at least 1e-9, else 1 [m].
[[nodiscard]] double reach(const RobotModel& model, std::size_t tip);

/// "cannot move along (0, 0, 1)", "cannot turn about (1, 0, 0)", or both at once.
[[nodiscard]] std::string lost_words(const Twist& twist);

}  // namespace robomosp::robotics
