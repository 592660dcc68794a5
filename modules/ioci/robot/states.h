// SPDX-License-Identifier: Apache-2.0
// One or many states of a robot, one per row, as arguments of commands, and work on many of them
// (layer: application). Internal to modules/ioci.
#pragma once

#include <cstddef>
#include <functional>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/commands.h"
#include "sim/for_samples.h"
#include "spatial/parallel.h"

namespace robomosp::ioci {

/// Numbers of an argument that takes one state or a matrix of states.
class States {
 public:
  States() = default;
  States(States&&) = default;
  States& operator=(States&&) = default;

  /// True if rows were given, even a single one: then the result has rows too.
  [[nodiscard]] bool is_batch() const { return is_batch_; }
  /// Number of rows of a batch, 1 for a single state, 0 if not given.
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::span<const double> values() const { return values_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Repeats a single state for all `count` rows.
  void repeat(std::size_t count);
  /// Replaces the numbers of the states.
  void replace(std::vector<double> numbers) { keep(std::move(numbers)); }

 private:
  friend Result<States> read_states(const Value&, const model::Robot&, const RobotModel&,
                                    std::string_view);
  friend Result<States> read_rates(const Map&, std::string_view, const model::Robot&,
                                   const RobotModel&);
  /// Stores numbers that are not those of the argument.
  void keep(std::vector<double> numbers);

  std::string name_;
  std::vector<double> own_;
  std::span<const double> values_;
  std::size_t count_ = 0;
  bool is_batch_ = false;
};

/// True if an argument is a batch of joint values: a matrix, or a list of rows.
[[nodiscard]] bool gives_rows(const Value& value, const RobotModel& model);

/// Joint values: any argument of read_q(), or a matrix or list of rows, one per state. Numbers of
/// arrays are not copied: `value` must outlive the result.
[[nodiscard]] Result<States> read_states(const Value& value, const model::Robot& robot,
                                         const RobotModel& model, std::string_view name);
/// Rates, accelerations or torques, dof() per state, in the same forms; empty if not given.
[[nodiscard]] Result<States> read_rates(const Map& args, std::string_view name,
                                        const model::Robot& robot, const RobotModel& model);

/// Extends all to the same number of rows; a single state applies to every row. Returns that
/// number, 0 = none is a batch. Batches of different lengths are an error.
[[nodiscard]] Result<std::size_t> share_rows(std::initializer_list<States*> all);

/// The error of a command that accepts one state only; a matrix of one row counts as one.
[[nodiscard]] Result<void> refuse_rows(const Map& args, std::initializer_list<const char*> names);

/// Location for errors: `, row 3` in a batch, empty for a single state.
[[nodiscard]] std::string in_row(const States& states, std::size_t row);
/// Approximate time to close the loops of a state, for for_states().
inline constexpr double kNanosecondsToClose = 2e4;

/// Uninitialised memory of `count` numbers, to be shared by an array of a result.
[[nodiscard]] std::shared_ptr<double[]> room_for(std::size_t count);
/// Rows of a result in such memory, from `first` on.
[[nodiscard]] NumericArray rows_of(std::shared_ptr<double[]> room, std::size_t rows,
                                   std::size_t cols, std::string unit = {}, std::size_t first = 0);

/// sim::for_samples() under the name of its arguments here.
[[nodiscard]] inline Result<void> for_states(
    std::size_t count, double nanoseconds, Progress& progress,
    const std::function<Result<void>(std::size_t first, std::size_t last, std::size_t thread)>&
        work) {
  return sim::for_samples(count, nanoseconds, progress, work);
}

}  // namespace robomosp::ioci
