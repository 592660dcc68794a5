// SPDX-License-Identifier: Apache-2.0
// One state of a robot or many, a row each, as arguments of commands, and the work that is done on
// many of them (layer: application). Internal to modules/ioci.
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

  /// Whether rows were given, be it one only: the answer has rows too then.
  [[nodiscard]] bool is_batch() const { return is_batch_; }
  /// Rows of a batch, 1 of one state, 0 when nothing was given.
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::span<const double> values() const { return values_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// One state becomes that of all `count` rows.
  void repeat(std::size_t count);
  /// Other numbers for the same states.
  void replace(std::vector<double> numbers) { keep(std::move(numbers)); }

 private:
  friend Result<States> read_states(const Value&, const model::Robot&, const RobotModel&,
                                    std::string_view);
  friend Result<States> read_rates(const Map&, std::string_view, const model::Robot&,
                                   const RobotModel&);
  /// Room for `values_` that is not the argument's own.
  void keep(std::vector<double> numbers);

  std::string name_;
  std::vector<double> own_;
  std::span<const double> values_;
  std::size_t count_ = 0;
  bool is_batch_ = false;
};

/// Whether an argument is a batch of joint values: a matrix, or a list of rows.
[[nodiscard]] bool gives_rows(const Value& value, const RobotModel& model);

/// Joint values: what read_q() takes, or a matrix or list of rows, one a state. Numbers of arrays
/// are not copied: `value` must outlive the result.
[[nodiscard]] Result<States> read_states(const Value& value, const model::Robot& robot,
                                         const RobotModel& model, std::string_view name);
/// Rates, accelerations or torques, dof() a state, in the same ways; empty when not given.
[[nodiscard]] Result<States> read_rates(const Map& args, std::string_view name,
                                        const model::Robot& robot, const RobotModel& model);

/// Brings all to as many rows as those have that are batches: what is one state counts for all of
/// them. Returns their number, 0 = none is a batch. Batches of different lengths are an error.
[[nodiscard]] Result<std::size_t> share_rows(std::initializer_list<States*> all);

/// The error of a command that takes one state; a matrix of one row counts as that.
[[nodiscard]] Result<void> refuse_rows(const Map& args, std::initializer_list<const char*> names);

/// `, row 3` of a batch, nothing of one state: where an error is.
[[nodiscard]] std::string in_row(const States& states, std::size_t row);
/// About what closing the loops of a state takes, for for_states().
inline constexpr double kNanosecondsToClose = 2e4;

/// Memory of `count` numbers that an array of an answer can share, as it comes.
[[nodiscard]] std::shared_ptr<double[]> room_for(std::size_t count);
/// Rows of an answer that lie in such memory, from `first` on.
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
