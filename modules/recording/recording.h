// SPDX-License-Identifier: Apache-2.0
// Recording: the result of a simulation, columns with units over time (layer: application).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

#include "model/kind.h"

namespace robomosp::recording {

struct Column {
  std::string name;  ///< "time", "q1", "tau3", "x"
  std::string unit;  ///< SI: "s", "rad", "N m"
  std::string doc;   ///< "torque of joint 3 (elbow)"
  std::vector<double> values;
  /// Limits of the values, such as joint limits, in their unit; infinite = none.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// An object or solid carried by a robot for some time: its mass is added to a joint of the model.
struct Load {
  std::string robot, object;  ///< names within the world
  AnyId what;
  std::int32_t joint = -1;  ///< -1 = the base
  Pose joint_T_object;
  double from = -std::numeric_limits<double>::infinity();  ///< [s]
  double to = std::numeric_limits<double>::infinity();     ///< exclusive [s]
};

/// Suffixes of the columns with the pose of a moving object: x, y, z [m] and its quaternion w, x,
/// y, z, world_T_object.
inline constexpr std::array<const char*, 7> kPlaceColumns{".x",  ".y",  ".z", ".qw",
                                                          ".qx", ".qy", ".qz"};
/// The pose given by these seven numbers; the quaternion is normalised.
[[nodiscard]] Pose pose_of_place(const std::array<double, 7>& place);

/// Column of a run along a trajectory: 1 in rows of approach moves inserted before a part of it.
inline constexpr const char* kApproachColumn = "approach";

/// A table with one row a sample; the first column is "time". Immutable once made.
struct Recording {
  std::string title;              ///< "pa10 on circle: inverse dynamics"
  WorldId world;                  ///< its world, for playback in the viewer
  std::string robot, trajectory;  ///< names within the world
  std::size_t dof = 0;
  double voxel =
      0;  ///< edge of the voxels that the rows are, with x, y, z first [m]; 0 = no voxels
  bool base_moves = false;  ///< the robot's mounting moved during the run
  std::vector<Column> columns;
  /// Loads of the robots over time; empty = those of the world's attachments.
  std::optional<std::vector<Load>> loads;
  std::vector<std::string> notes;  ///< remarks, such as a limit exceeded, a sentence each

  [[nodiscard]] std::size_t rows() const {
    return columns.empty() ? 0 : columns.front().values.size();
  }
  [[nodiscard]] const Column* find(std::string_view name) const;
  /// Columns chosen by names; "tau" means all of tau1..tauN, "q" all of q1..qN. An unknown name is
  /// an error that suggests near ones.
  [[nodiscard]] Result<std::vector<const Column*>> select(std::span<const std::string> names) const;
};
using RecordingPtr = std::shared_ptr<const Recording>;

/// Most numbers of one recording, all columns together.
inline constexpr std::size_t kMostValues = std::size_t{1} << 28;

/// A change of a recording.
struct RecordingChange {
  enum class What : std::uint8_t { added, appended, replaced, removed };
  std::uint64_t number = 0;
  What what = What::added;
  std::size_t rows = 0;  ///< number of rows after it
  std::string title;
};

/// Rows of a recording.
struct RecordingRows {
  std::size_t from = 0;      ///< index of the first row returned
  std::size_t rows = 0;      ///< number of rows of the recording
  std::size_t replaced = 0;  ///< number of times that the table was replaced
  std::vector<std::pair<std::string, std::vector<double>>> columns;  ///< names and values
};

/// Run state, outside the document and its history. [any thread]
///
/// A recording being appended to stays immutable for its holders: `find` returns the current rows,
/// and later rows are in the result of the next `find`. The cost of appending depends on the
/// appended rows only. The table is copied only if a previous version is still in use; else it
/// grows in place.
class Recordings {
 public:
  std::uint64_t add(RecordingPtr);  ///< number of its handle, never reused
  [[nodiscard]] RecordingPtr find(std::uint64_t number) const;
  [[nodiscard]] std::vector<std::pair<std::uint64_t, RecordingPtr>> list() const;
  bool remove(std::uint64_t number);
  /// Replaces the table of a number, for example by one with more columns; an error if it is no
  /// longer `was`, from which the new one was made.
  Result<void> replace(std::uint64_t number, const RecordingPtr& was, RecordingPtr recording);
  /// Appends rows: the values of each column, in the recording's order, equally many for each. All
  /// or none. An error if a column is missing, the time does not increase, or the recording would
  /// exceed kMostValues numbers. Returns the new number of rows.
  Result<std::size_t> append(std::uint64_t number, std::span<const std::vector<double>> columns);
  /// Rows from index `from` on, at most `most` numbers but at least one row; from the first if the
  /// table was replaced since `replaced`. Of all columns, or the named ones. Cost proportional to
  /// these rows, and without sharing memory, so that appending continues in place.
  [[nodiscard]] Result<RecordingRows> rows(std::uint64_t number, std::size_t from,
                                           std::optional<std::size_t> replaced, std::size_t most,
                                           std::span<const std::string> columns) const;
  /// `heard` is called after each change, on the thread that made it and without locks. Call it
  /// once, before other threads start.
  void observe(std::function<void(const RecordingChange&)> heard) { heard_ = std::move(heard); }

 private:
  struct Slot;
  [[nodiscard]] std::shared_ptr<Slot> slot(std::uint64_t number) const;

  void tell(RecordingChange change) const {
    if (heard_) heard_(change);
  }

  std::function<void(const RecordingChange&)> heard_;
  mutable std::mutex mutex_;
  std::uint64_t next_ = 1;                                     // guarded by mutex_
  std::map<std::uint64_t, std::shared_ptr<Slot>> recordings_;  // guarded by mutex_
};

}  // namespace robomosp::recording
