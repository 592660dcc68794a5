// SPDX-License-Identifier: Apache-2.0
#include "robotics/workspace.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include <robomosp/sdk/eigen.h>

#include "robotics/batch_kinematics.h"
#include "robotics/decompositions.h"
#include "robotics/joint_sampler.h"
#include "robotics/thin_workspace.h"
#include "spatial/parallel.h"
#include "spatial/pose.h"
#include "spatial/print.h"
#include "spatial/vec.h"

namespace robomosp::robotics {
namespace {

constexpr std::size_t kChunk = 16384;            // samples between two looks at the progress
constexpr std::size_t kFilterChunk = 1024;       // the same with a filter, which may take long
constexpr std::size_t kMostVoxels = 1ULL << 24;  // about 0.4 GB
constexpr double kFlat = 1e-9;                   // extents below, over the greatest, are none

/// JacobianMeasures::manipulability alone, by a determinant where the rank is full.
double manipulability_of(std::span<const double> jacobian, TwistPart part, double length,
                         int rank) {
  const auto columns = static_cast<Eigen::Index>(jacobian.size() / 6);
  const Eigen::Index first = part == TwistPart::rotation ? 3 : 0,
                     rows = part == TwistPart::all ? 6 : 3;
  if (rank != std::min(rows, columns))
    return jacobian_measures(jacobian, part, length, rank).manipulability;
  const Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>> J(jacobian.data(), 6, columns);
  const double scale = 1 / (length * length);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6> square;
  if (columns >= rows) {
    const auto part_rows = J.middleRows(first, rows);
    square.noalias() = part_rows * part_rows.transpose();
    if (first == 0) {
      square.topRows(3) /= length;
      square.leftCols(3) /= length;
    }
  } else {
    square.setZero(columns, columns);
    if (first == 0) square.noalias() += scale * J.topRows<3>().transpose() * J.topRows<3>();
    if (part != TwistPart::translation)
      square.noalias() += J.bottomRows<3>().transpose() * J.bottomRows<3>();
  }
  return std::sqrt(std::max(0.0, square.determinant()));
}

/// What is kept of a sample.
struct Point {
  Vec3 p;
  double manipulability;
};

struct Points {
  std::vector<Point> all;
  std::size_t half = 0;  ///< those of the first half of the samples
  int rank = 0;
  TipMobility mobility;
  std::vector<CurvePoint> curve;  ///< of each, where one coordinate alone moves the tip
  double drawn = 0;               ///< the range of that coordinate over all samples
};

/// The coordinate of a velocity, of joints with one of each; nullopt for balls and free joints.
std::optional<std::size_t> coordinate_of(const RobotModel& model, std::ptrdiff_t velocity) {
  for (const JointModel& j : model.joints)
    if (!j.is_coupled() && j.v_index == velocity && coordinate_count(j.type) == 1)
      return static_cast<std::size_t>(j.q_index);
  return std::nullopt;
}

/// True where a whole turn of the coordinate brings the tip back: one revolute joint, which no
/// other joint follows.
bool comes_back(const RobotModel& model, std::size_t coordinate) {
  std::size_t moved = 0;
  bool turns = false;
  for (const JointModel& j : model.joints)
    if (j.q_index == static_cast<std::int32_t>(coordinate)) {
      ++moved;
      turns = j.type == JointType::revolute;
    }
  return moved == 1 && turns;
}

bool is_within(const Vec3& p, const std::array<Vec3, 2>& region) {
  for (std::size_t k = 0; k < 3; ++k)
    if (p[k] < region[0][k] || p[k] > region[1][k]) return false;
  return true;
}

Result<Points> sampled(const RobotModel& model, std::span<const double> fixed,
                       const WorkspaceOptions& o, Progress& progress) {
  RMP_TRY_ASSIGN(const JointSampler sampler, JointSampler::make(model, o.tip, fixed, o.seed));
  const BatchKinematics kinematics(model);
  const std::size_t n = model.coordinate_count(), dof = model.dof();
  const std::size_t threads = o.threads ? o.threads : spatial::cores();
  const std::size_t chunk = o.filter ? kFilterChunk : kChunk;
  std::vector<double> scratch(kinematics.scratch_size()), q(chunk * n), jacobians(chunk * 6 * dof);
  std::vector<Pose> poses(chunk);
  std::vector<double> values(chunk);
  std::vector<std::uint8_t> keep(chunk);
  Points out;
  sampler.sample(0, std::span(q).first(n));
  std::optional<std::size_t> coordinate;
  bool is_periodic = false;
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  out.rank = singularity(model, o.tip, std::span(q).first(n), o.part).full_rank;
  for (std::size_t done = 0; done < o.samples;) {
    progress.report(static_cast<double>(done) / static_cast<double>(o.samples), "workspace");
    if (progress.cancelled()) return error(ErrorCode::cancelled, "the workspace was cancelled", "");
    // A chunk does not reach over the middle, so that the first half is a number of chunks.
    const std::size_t end = done < o.samples / 2 ? o.samples / 2 : o.samples;
    const std::size_t count = std::min(chunk, end - done);
    spatial::in_parallel(count, 256, threads, [&](std::size_t a, std::size_t b, std::size_t) {
      for (std::size_t i = a; i < b; ++i) sampler.sample(done + i, std::span(&q[i * n], n));
    });
    kinematics.jacobians(o.tip, std::span(q).first(count * n), JacobianFrame::base,
                         std::span(poses).first(count), std::span(jacobians).first(count * 6 * dof),
                         scratch);
    if (done == 0) {
      constexpr std::size_t kProbes = 64;
      out.mobility =
          tip_mobility(std::span(jacobians).first(std::min(count, kProbes) * 6 * dof), dof);
      coordinate = coordinate_of(model, out.mobility.only);
      is_periodic = coordinate && comes_back(model, *coordinate);
    }
    std::fill(keep.begin(), keep.end(), std::uint8_t{1});
    for (std::size_t i = 0; i < count; ++i) {
      poses[i].p = spatial::transform(model.base, poses[i].p);
      if (o.region && !is_within(poses[i].p, *o.region)) keep[i] = 0;
    }
    if (o.filter) RMP_TRY(o.filter(std::span(q).first(count * n), std::span(keep).first(count)));
    spatial::in_parallel(count, 64, threads, [&](std::size_t a, std::size_t b, std::size_t) {
      for (std::size_t i = a; i < b; ++i)
        if (keep[i])
          values[i] = manipulability_of(std::span(&jacobians[i * 6 * dof], 6 * dof), o.part,
                                        o.length, out.rank);
    });
    for (std::size_t i = 0; i < count; ++i)
      if (keep[i]) out.all.push_back({poses[i].p, values[i]});
    if (coordinate) {
      const auto column = static_cast<std::size_t>(out.mobility.only);
      for (std::size_t i = 0; i < count; ++i) {
        double x = q[i * n + *coordinate];
        if (is_periodic) x = std::remainder(x, 2 * std::numbers::pi);
        least = std::min(least, x), greatest = std::max(greatest, x);
        const double* J = &jacobians[i * 6 * dof + 6 * column];
        if (keep[i]) out.curve.push_back({x, std::hypot(J[0], J[1], J[2])});
      }
    }
    done += count;
    if (done == o.samples / 2) out.half = out.all.size();
  }
  if (coordinate) out.drawn = greatest - least;
  return out;
}

bool is_reached(const Workspace& w, std::array<std::size_t, 3> cell, std::size_t axis, bool up) {
  if (up ? cell[axis] + 1 == w.grid.count[axis] : cell[axis] == 0) return false;
  cell[axis] += up ? 1 : static_cast<std::size_t>(-1);
  return w.hits[(cell[2] * w.grid.count[1] + cell[1]) * w.grid.count[0] + cell[0]] > 0;
}

/// Marks the surface; `flat` axes have no extent.
WorkspaceSize measured(Workspace& w, const std::array<bool, 3>& flat) {
  WorkspaceSize s;
  w.is_surface.assign(w.hits.size(), 0);
  for (std::size_t v = 0; v < w.hits.size(); ++v) {
    if (w.hits[v] == 0) continue;
    ++s.voxels;
    const auto cell = w.grid.cell(v);
    double inside = 1;
    for (std::size_t k = 0; k < 3; ++k)
      if (!flat[k] && !(is_reached(w, cell, k, false) && is_reached(w, cell, k, true)))
        inside *= 0.5;
    w.is_surface[v] = inside < 1;
    s.surface += w.is_surface[v];
    s.size += inside;
  }
  const double one = std::pow(w.grid.size, w.dimension);
  s.error = 0.5 * static_cast<double>(s.surface) * one;
  s.size *= one;
  return s;
}

}  // namespace

std::array<std::size_t, 3> VoxelGrid::cell(std::size_t voxel) const {
  return {voxel % count[0], voxel / count[0] % count[1], voxel / (count[0] * count[1])};
}
Vec3 VoxelGrid::centre(std::size_t voxel) const {
  const auto c = cell(voxel);
  Vec3 p;
  for (std::size_t k = 0; k < 3; ++k) p[k] = corner[k] + size * (static_cast<double>(c[k]) + 0.5);
  return p;
}
std::size_t VoxelGrid::voxel_of(const Vec3& p) const {
  std::array<std::size_t, 3> c{};
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = static_cast<std::size_t>(
        std::clamp(std::floor((p[k] - corner[k]) / size), 0.0, static_cast<double>(count[k] - 1)));
  return (c[2] * count[1] + c[1]) * count[0] + c[0];
}

JacobianMeasures jacobian_measures(std::span<const double> jacobian, TwistPart part, double length,
                                   int rank) {
  JacobianMeasures m;
  const auto columns = static_cast<Eigen::Index>(jacobian.size() / 6);
  if (columns == 0 || rank == 0) return m;
  Eigen::Matrix<double, 6, Eigen::Dynamic> J =
      Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>>(jacobian.data(), 6, columns);
  if (part == TwistPart::translation) J.bottomRows<3>().setZero();
  if (part == TwistPart::rotation) J.topRows<3>().setZero();
  J.topRows<3>() /= length;
  const Eigen::VectorXd s = Eigen::JacobiSVD<Eigen::MatrixXd>(J).singularValues();
  const Eigen::Index last = std::min<Eigen::Index>(rank, s.size());
  m.manipulability = s.head(last).prod();
  m.least = s[last - 1];
  m.condition = m.least > 1e-15 * s[0] ? s[0] / m.least : std::numeric_limits<double>::infinity();
  return m;
}

Result<Workspace> workspace(const RobotModel& model, std::span<const double> fixed,
                            const WorkspaceOptions& o, Progress& progress) {
  RMP_TRY_ASSIGN(const Points points, sampled(model, fixed, o, progress));
  Workspace w;
  w.samples = o.samples;
  w.counted = points.all.size();
  w.rank = points.rank;
  if (points.all.empty())
    return error(ErrorCode::unreachable,
                 "none of " + std::to_string(o.samples) + " sampled configurations is valid",
                 "Widen the region, take more samples, or leave "
                 "collisions out.",
                 "robot \"" + model.name + "\"");
  w.lower = w.upper = points.all.front().p;
  for (const Point& x : points.all)
    for (std::size_t k = 0; k < 3; ++k) {
      w.lower[k] = std::min(w.lower[k], x.p[k]);
      w.upper[k] = std::max(w.upper[k], x.p[k]);
    }
  double extent = 0;
  for (std::size_t k = 0; k < 3; ++k) extent = std::max(extent, w.upper[k] - w.lower[k]);
  w.grid.size = o.voxel > 0 ? o.voxel : extent > 0 ? extent / 40 : 0.01;
  if (!std::isfinite(w.grid.size * w.grid.size * w.grid.size * static_cast<double>(kMostVoxels)))
    return error(ErrorCode::invalid_argument,
                 "voxels of " + spatial::print_number(w.grid.size) +
                     " m have a volume outside the range of numbers",
                 "Choose smaller ones, such as a fortieth of the robot's reach.", "voxel");
  std::array<bool, 3> flat{};
  w.dimension = 0;
  double voxels = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const double way = w.upper[k] - w.lower[k];
    flat[k] = way <= kFlat * std::max(extent, 1.0);
    w.dimension += !flat[k];
    // The grid is as wide to either side of the middle.
    const double cells = flat[k] ? 1 : std::floor(way / w.grid.size * (1 + 1e-12)) + 1;
    voxels *= cells;
    if (voxels > static_cast<double>(kMostVoxels)) break;
    w.grid.count[k] = static_cast<std::size_t>(cells);
    w.grid.corner[k] = 0.5 * (w.lower[k] + w.upper[k] - cells * w.grid.size);
  }
  if (voxels > static_cast<double>(kMostVoxels))
    return error(ErrorCode::invalid_argument,
                 "voxels of that size would be more than " + std::to_string(kMostVoxels),
                 "Choose larger ones, or a smaller region.", "voxel");
  const bool is_curve = !points.curve.empty();
  if (is_curve) {
    w.dimension = 1;
    w.places.assign(w.grid.voxels(), Vec3{});
  }
  const auto sized = [&](std::size_t count) {
    WorkspaceSize s = measured(w, flat);
    if (!is_curve) return s;
    // Samples of one joint leave gaps of a few times their mean distance: longer ones are
    // configurations that the region or the filter leaves out.
    constexpr double kGap = 64;
    std::vector<CurvePoint> curve(points.curve.begin(),
                                  points.curve.begin() + static_cast<std::ptrdiff_t>(count));
    const WorkspaceSize length =
        curve_length(curve, kGap * points.drawn / static_cast<double>(o.samples));
    s.size = length.size, s.error = length.error;
    return s;
  };
  w.hits.assign(w.grid.voxels(), 0);
  w.best.assign(w.grid.voxels(), 0);
  w.mean.assign(w.grid.voxels(), 0);
  for (std::size_t i = 0; i < points.all.size(); ++i) {
    if (i == points.half) w.half = sized(i);
    const Point& x = points.all[i];
    const std::size_t v = w.grid.voxel_of(x.p);
    if (is_curve &&
        (w.hits[v] == 0 || spatial::norm(spatial::sub(x.p, w.grid.centre(v))) <
                               spatial::norm(spatial::sub(w.places[v], w.grid.centre(v)))))
      w.places[v] = x.p;
    ++w.hits[v];
    w.best[v] = std::max(w.best[v], x.manipulability);
    w.mean[v] += x.manipulability;
  }
  if (points.half >= points.all.size()) w.half = sized(points.all.size());
  for (std::size_t v = 0; v < w.hits.size(); ++v)
    if (w.hits[v]) w.mean[v] /= w.hits[v];
  w.all = sized(points.all.size());
  return w;
}

std::vector<Vec3> sphere_directions(std::size_t count) {
  std::vector<Vec3> out;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double r = std::sqrt(1 - z * z), a = golden * static_cast<double>(i);
    out.push_back({r * std::cos(a), r * std::sin(a), z});
  }
  return out;
}

}  // namespace robomosp::robotics
