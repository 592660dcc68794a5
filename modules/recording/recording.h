// SPDX-License-Identifier: Apache-2.0
// Recording: what a simulation gives, columns with units over time (layer: application).
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
  /// What the values should stay within, such as joint limits, in their unit; infinite = none.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// An object or solid that a robot carries for a while: its mass rides on a joint of the model.
struct Load {
  std::string robot, object;  ///< names within the world
  AnyId what;
  std::int32_t joint = -1;  ///< -1 = the base
  Pose joint_T_object;
  double from = -std::numeric_limits<double>::infinity();  ///< [s]
  double to = std::numeric_limits<double>::infinity();     ///< up to here, without it [s]
};

/// What the columns of a moving object's place are called behind its name: x, y, z [m] and its
/// quaternion w, x, y, z, world_T_object.
inline constexpr std::array<const char*, 7> kPlaceColumns{".x",  ".y",  ".z", ".qw",
                                                          ".qx", ".qy", ".qz"};
/// The pose that these seven numbers tell; the quaternion has length 1.
[[nodiscard]] Pose pose_of_place(const std::array<double, 7>& place);

/// Column of a run along a trajectory: 1 in rows of moves that were put before a part of it.
inline constexpr const char* kApproachColumn = "approach";

/// A table with one row a sample; the first column is "time". Immutable once made.
struct Recording {
  std::string title;              ///< "pa10 on circle: inverse dynamics"
  WorldId world;                  ///< what it was made from; for playing it in the viewer
  std::string robot, trajectory;  ///< names within the world
  std::size_t dof = 0;
  double voxel =
      0;  ///< edge of the voxels that the rows are, with x, y, z first [m]; 0 = no voxels
  bool base_moves = false;  ///< the robot's mounting moved during the run
  std::vector<Column> columns;
  /// What robots carried when; none = what the world's attachments say.
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

/// Numbers that one recording may hold, all columns together.
inline constexpr std::size_t kMostValues = std::size_t{1} << 28;

/// What became of a recording.
struct RecordingChange {
  enum class What : std::uint8_t { added, appended, replaced, removed };
  std::uint64_t number = 0;
  What what = What::added;
  std::size_t rows = 0;  ///< that it has now
  std::string title;
};

/// Rows of a recording.
struct RecordingRows {
  std::size_t from = 0;      ///< index of the first that is given
  std::size_t rows = 0;      ///< that the recording has
  std::size_t replaced = 0;  ///< how often another table took the place of the one before
  std::vector<std::pair<std::string, std::vector<double>>> columns;  ///< names and values
};

/// Run state, outside the document and its history. [any thread]
///
/// A recording that is appended to stays immutable for who has it: `find` gives the rows of now,
/// and rows that come later are in what the next `find` gives. Appending costs the rows appended.
/// Reading copies the table only where somebody still has the one of before; else it grows in its
/// place.
class Recordings {
 public:
  std::uint64_t add(RecordingPtr);  ///< number of its handle, never reused
  [[nodiscard]] RecordingPtr find(std::uint64_t number) const;
  [[nodiscard]] std::vector<std::pair<std::uint64_t, RecordingPtr>> list() const;
  bool remove(std::uint64_t number);
  /// Puts another table behind a number, such as the same one with columns added; an error where it
  /// is no longer `was`, from which it was made.
  Result<void> replace(std::uint64_t number, const RecordingPtr& was, RecordingPtr recording);
  /// Adds rows at the end: the values of each column, in the recording's order, as many of each.
  /// All or none. An error where a column is missing, the time does not rise, or there would be
  /// more than kMostValues numbers. Gives how many rows there are then.
  Result<std::size_t> append(std::uint64_t number, std::span<const std::vector<double>> columns);
  /// Rows from index `from` on, at most `most` numbers but at least one row; from the first when
  /// the table was replaced since `replaced`. Of all columns, or of those named. Costs these rows,
  /// however many there are, and lends nothing, so that appending goes on in place.
  [[nodiscard]] Result<RecordingRows> rows(std::uint64_t number, std::size_t from,
                                           std::optional<std::size_t> replaced, std::size_t most,
                                           std::span<const std::string> columns) const;
  /// `heard` is called after each change, by the thread that made it and with nothing locked. Once,
  /// before there are other threads.
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
