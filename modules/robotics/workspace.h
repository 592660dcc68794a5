// SPDX-License-Identifier: Apache-2.0
// Workspace of a robot's tip: samples of the joint space counted in voxels, the volume with its
// error, and the robot's mobility there (layer: data processing, robotics).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "robotics/singularity.h"

namespace robomosp::robotics {

/// A box of the mounting frame in cubes, x-fastest.
struct VoxelGrid {
  Vec3 corner{};    ///< least x, y, z [m]
  double size = 0;  ///< edge of a voxel [m]
  std::array<std::size_t, 3> count{};

  [[nodiscard]] std::size_t voxels() const { return count[0] * count[1] * count[2]; }
  [[nodiscard]] std::array<std::size_t, 3> cell(std::size_t voxel) const;
  [[nodiscard]] Vec3 centre(std::size_t voxel) const;
  /// The voxel of a point; the nearest one of a point outside.
  [[nodiscard]] std::size_t voxel_of(const Vec3& p) const;
};

/// Singular values of a Jacobian, up to its rank over the joint space.
struct JacobianMeasures {
  double manipulability = 0;  ///< product of the first `rank` (Yoshikawa, IJRR 4(2), 1985)
  double condition = 0;       ///< greatest / least of them; infinite where singular
  double least = 0;           ///< least of them
};
/// `jacobian` joint after joint; linear rows over `length` [m]; the rows of `part`; the first
/// `rank` singular values (Singularity::full_rank of the robot).
[[nodiscard]] JacobianMeasures jacobian_measures(std::span<const double> jacobian, TwistPart part,
                                                 double length, int rank);

/// Sets keep[i] to 0 for configurations (coordinate_count() numbers each) to be ignored.
using ConfigurationFilter =
    std::function<Result<void>(std::span<const double> q, std::span<std::uint8_t> keep)>;

struct WorkspaceOptions {
  std::size_t tip = 0;
  std::size_t samples = 200000;
  double voxel = 0;  ///< edge [m]; 0 = a fortieth of the greatest extent
  std::uint64_t seed = 1;
  TwistPart part = TwistPart::all;  ///< of the manipulability
  double length = 1;                ///< length by which linear velocities are divided [m]
  /// Least and greatest corner of the region, mounting frame [m]; empty = unlimited.
  std::optional<std::array<Vec3, 2>> region;
  ConfigurationFilter filter;  ///< may be empty
  std::size_t threads = 0;     ///< 0 = all cores; the result does not depend on it
};

/// Reached voxels and the size of the body they form (for a curve traced by one coordinate:
/// curve_length()). A voxel counts half for each axis along which a neighbour is not reached (a
/// face of the body half, an edge a quarter, a corner an eighth): the position of the surface in it
/// is unknown, so half of the surface voxels are the error.
struct WorkspaceSize {
  std::size_t voxels = 0, surface = 0;
  double size = 0;   ///< [m^3, m^2 or m, by the dimension]
  double error = 0;  ///< surface / 2 voxel^dimension
};

struct Workspace {
  VoxelGrid grid;
  int dimension = 3;        ///< 2 if the tip stays in a plane normal to x, y or z; 1 on a line, or
                            ///< a curve traced by one coordinate; 0
  Vec3 lower{}, upper{};    ///< box around the reached points [m]
  WorkspaceSize all, half;  ///< from all samples, and from the first half of them
  std::size_t samples = 0, counted = 0;  ///< drawn; within filter and region
  std::vector<std::uint32_t> hits;       ///< samples in each voxel of the grid
  std::vector<std::uint8_t> is_surface;  ///< of the reached ones
  std::vector<double> best, mean;        ///< manipulability over the samples of a voxel
  /// For curves traced by one coordinate: the reached point nearest to each voxel's centre, which
  /// is not reached itself. Else empty.
  std::vector<Vec3> places;
  int rank = 0;  ///< of the Jacobian's part over the joint space

  /// Growth of the size by the second half of the samples, relative to the size.
  [[nodiscard]] double growth() const {
    return all.size > 0 ? (all.size - half.size) / all.size : 0;
  }
  /// True if the second half of the samples changed the size by less than its error and by less
  /// than a twentieth. If not, parts are still missing, which `error` does not cover: the true size
  /// is greater.
  [[nodiscard]] bool is_settled() const {
    return all.size > 0 && all.size - half.size < all.error && growth() < 0.05;
  }
};

/// Joints that do not carry the tip stay at `fixed`. Errors: those of JointSampler, and a grid of
/// more than 2^24 voxels. [any thread]
[[nodiscard]] Result<Workspace> workspace(const RobotModel& model, std::span<const double> fixed,
                                          const WorkspaceOptions&, Progress&);

/// `count` unit vectors spread evenly over the sphere, by the golden angle at equal steps of
/// height (Swinbank, Purser, Q. J. R. Meteorol. Soc. 132, 2006).
[[nodiscard]] std::vector<Vec3> sphere_directions(std::size_t count);

}  // namespace robomosp::robotics
