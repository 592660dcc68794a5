// SPDX-License-Identifier: Apache-2.0
// Forces and moments on a robot's tip during motion: constants, expressions of time and path,
// columns of recordings (layer: application, sim).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>
#include <robomosp/sdk/tip_force.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/expression.h"
#include "kernel/registry.h"
#include "model/basics.h"
#include "recording/recording.h"
#include "sim/motion_reference.h"

namespace robomosp::sim {

/// Axes in which a force and a moment are given.
enum class LoadAxes : std::uint8_t {
  world,
  base,  ///< of the robot's mounting frame
  tool,  ///< of the tip at which they act
};
inline constexpr std::array<std::string_view, 3> kLoadAxes{"world", "base", "tool"};

/// Names of a force's and a moment's numbers in errors.
inline constexpr std::array<const char*, 6> kLoadNumbers{"tip_force[1]",  "tip_force[2]",
                                                         "tip_force[3]",  "tip_moment[1]",
                                                         "tip_moment[2]", "tip_moment[3]"};

/// A prepared TipForce. Errors: an unknown provider or parameter.
[[nodiscard]] Result<std::shared_ptr<const TipForce>> bind_tip_force(const Registry&,
                                                                     const model::ProviderChoice&);

/// A force [N] and a moment [N m] about the tip's origin on a robot; the sum of all parts.
struct TipLoad {
  /// Of the robot's model; "" = the one named in the doc of the columns wrench1..6 of `recorded`,
  /// else the first.
  std::string tip;
  LoadAxes axes = LoadAxes::world;
  std::array<double, 6> constant{};        ///< force, then moment
  std::array<std::string, 6> expressions;  ///< of `time` [s] and `path` [m]; "" = none
  std::shared_ptr<const TipForce> force;   ///< prepared; null = none
  recording::RecordingPtr recorded;        ///< linear between its rows, constant before and after
  /// Columns of `recorded`: six names, or three of the force alone. Empty = wrench1..6, else fx,
  /// fy, fz, mx, my, mz.
  std::vector<std::string> columns;
  bool is_over_path = false;  ///< the key of `recorded` is its column "path" [m], not its time

  [[nodiscard]] bool is_given() const;
};

/// A TipLoad parsed and bound to a robot. [one thread]
class BoundTipLoad {
 public:
  /// Errors: an unknown tip or column, a fault of an expression, a column of another quantity.
  static Result<BoundTipLoad> create(const TipLoad&, const RobotModel&);

  [[nodiscard]] std::int32_t tip() const { return tip_; }  ///< into RobotModel::tips
  [[nodiscard]] LoadAxes axes() const { return load_.axes; }
  [[nodiscard]] bool uses_time() const { return uses_time_; }
  [[nodiscard]] bool uses_path() const { return uses_path_; }
  /// True if its TipForce should get a path if available.
  [[nodiscard]] bool takes_path() const { return load_.force != nullptr; }

  /// In the axes in which it is given. `path`: path length of the tip since the trajectory began
  /// [m], NaN if there is none and uses_path() is false. Errors: those of the expressions and the
  /// TipForce, and results that are not finite or exceed 1e12.
  [[nodiscard]] Result<TipWrench> at(double time, double path) const;
  /// The same in the base frame's axes, as solvers expect. `mounting_T_base`: RobotModel::base.
  [[nodiscard]] TipWrench in_base(const TipWrench& given, const Pose& world_T_base,
                                  const Pose& mounting_T_base, const Pose& base_T_tip) const;
  /// A note if the recording does not cover [from, to] of its key, so that its first or last row is
  /// held; none if it does.
  [[nodiscard]] std::optional<std::string> note_on_cover(double from, double to) const;

 private:
  BoundTipLoad() = default;
  Result<void> read_columns();

  TipLoad load_;
  std::int32_t tip_ = 0;
  bool uses_time_ = false, uses_path_ = false;
  std::array<std::optional<Expression>, 6> expressions_;
  TimedRows rows_;  ///< `times` is the path for a load over the path
};

/// The six columns of a force and a moment at a tip in the world's axes, wrench1 to wrench6,
/// without values.
[[nodiscard]] std::array<recording::Column, 6> wrench_columns(std::string_view tip);
/// The tip named in the doc of a recording's column wrench1, as written by wrench_columns();
/// nullopt if no tip of the model is named.
[[nodiscard]] std::optional<std::int32_t> tip_of_wrench(const recording::Recording&,
                                                        const RobotModel&);

/// The values of a column in SI. Errors, at `where`: no such column, a unit of another quantity, a
/// value that is not finite.
[[nodiscard]] Result<std::vector<double>> load_column(const recording::Recording&,
                                                      const std::string& name, const char* si_unit,
                                                      const std::string& where);

/// The load at a tip in each row of a recording or run.
struct ActingLoad {
  std::int32_t tip = 0;            ///< into RobotModel::tips
  std::vector<TipWrench> in_base;  ///< axes of the robot's base; empty = no load
};
/// Rows of a motion: the inputs of a load.
struct LoadedRows {
  std::span<const double> times, q, qd;  ///< [s]; rows of coordinates and rates
  std::span<const PathSample> base;      ///< as of tip_way()
  std::span<const double> approach;      ///< likewise
};
/// The load in each row. Adds the columns wrench1 to wrench6 and path, replacing those with these
/// names, and a note if the load's rows do not cover these. Errors: those of BoundTipLoad::create()
/// and at().
[[nodiscard]] Result<ActingLoad> add_load_columns(recording::Recording&, const TipLoad&,
                                                  const RobotModel&, const LoadedRows&);

/// Pose of a tip at each row, in the base's frame, and its path length in the world up to there
/// [m]: cubic between rows by positions and velocities, excluding approaches.
struct TipWay {
  std::vector<Pose> base_T_tip;
  std::vector<double> length;
};
/// `q`, `qd`: rows of coordinates and rates. `base`: motion of the base in the world at each row,
/// one for all if it is fixed. `approach`: 1 in rows to exclude, empty = none.
[[nodiscard]] TipWay tip_way(const RobotModel&, std::int32_t tip, std::span<const double> times,
                             std::span<const double> q, std::span<const double> qd,
                             std::span<const PathSample> base, std::span<const double> approach);

}  // namespace robomosp::sim
