// SPDX-License-Identifier: Apache-2.0
#include "ioci/robot/states.h"

#include <algorithm>
#include <cmath>

#include "ioci/robot/robots.h"
#include "robotics/coordinates.h"
#include "spatial/magnitudes.h"

namespace robomosp::ioci {
namespace {

using model::Robot;

/// What an argument counts, in the words of its errors.
struct Counted {
  std::size_t width;
  std::string of_robot;  ///< "6 joints"
  std::string one_each;  ///< "joint"
};

Counted counted_coordinates(const RobotModel& m) {
  const std::size_t n = m.coordinate_count();
  const std::string noun = n == m.joints.size() ? "joint" : "coordinate";
  return {n, std::to_string(n) + " " + noun + (n == 1 ? "" : "s"), noun};
}
Counted counted_velocities(const RobotModel& m) {
  if (m.coordinate_count() == m.dof()) return counted_coordinates(m);
  return {m.dof(), std::to_string(m.dof()) + " velocities", "velocity"};
}

std::string row_path(std::string_view name, std::size_t row) {
  return std::string(name) + "[" + std::to_string(row + 1) + "]";
}

/// Whether a value is rows of states. A column of a matrix is the one state that it may be.
bool has_rows(const Value& value, std::size_t width) {
  if (width == 0) return false;
  if (const NumericArray* a = value.as_array())
    return a->is_matrix() && !(a->cols() == 1 && width > 1 && a->rows() == width);
  const List* list = value.as_list();
  return list && !list->empty() && (list->front().as_list() || list->front().as_array());
}

Error no_rows(std::string_view name) {
  return error(ErrorCode::invalid_argument, "a matrix without rows contains no state",
               "Give one row per state.", std::string(name));
}
Error wrong_width(std::size_t given, const Counted& c, std::string where, const char* noun) {
  return error(ErrorCode::invalid_argument,
               count_given(given, noun) + "; the robot has " + c.of_robot,
               "Give one row per state with one number per " + c.one_each + ".", std::move(where));
}

/// The numbers of a matrix, each within what can be calculated with.
Result<std::span<const double>> matrix_rows(const NumericArray& a, const Counted& c,
                                            std::string_view name) {
  if (a.rows() == 0) return no_rows(name);
  if (a.cols() != c.width) return wrong_width(a.cols(), c, std::string(name), "column");
  const std::span<const double> all = a.data();
  const std::size_t bad = spatial::first_beyond(all, kMostOfAJoint);
  if (bad == all.size()) return all;
  const std::size_t row = bad / c.width;
  RMP_TRY(check_size(all.subspan(row * c.width, c.width), row_path(name, row)));
  return all;
}

/// The rows of a list, each of numbers or read by read_one(value, path).
template <class ReadOne>
Result<std::vector<double>> list_rows(const List& list, const Counted& c, std::string_view name,
                                      ReadOne&& read_one) {
  std::vector<double> out;
  out.reserve(list.size() * c.width);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Value& one = list[i];
    const List* numbers = one.as_list();
    const NumericArray* array = one.as_array();
    if (!numbers && (!array || array->is_matrix()))
      return error(ErrorCode::invalid_argument, one.text() + " is not a row of numbers",
                   "Give one row per state with one number per " + c.one_each + ".",
                   row_path(name, i));
    const std::size_t width = numbers ? numbers->size() : array->size();
    if (width != c.width) return wrong_width(width, c, row_path(name, i), "number");
    const bool is_plain = !numbers || std::all_of(numbers->begin(), numbers->end(),
                                                  [](const Value& v) { return v.is_number(); });
    if (!is_plain) {
      RMP_TRY_ASSIGN(const std::vector<double> row, read_one(one, row_path(name, i)));
      out.insert(out.end(), row.begin(), row.end());
      continue;
    }
    if (numbers)
      for (const Value& v : *numbers) out.push_back(v.number());
    else out.insert(out.end(), array->data().begin(), array->data().end());
    const std::span<const double> row = std::span(out).last(c.width);
    if (spatial::first_beyond(row, kMostOfAJoint) != c.width)
      RMP_TRY(check_size(row, row_path(name, i)));
  }
  return out;
}

/// Quaternions of zeros are none.
Result<void> check_quaternions(std::span<const double> q, const RobotModel& m,
                               std::string_view name) {
  const std::vector<std::string_view> units = robotics::coordinate_units(m);
  if (std::none_of(units.begin(), units.end(), [](std::string_view u) { return u.empty(); }))
    return {};
  for (std::size_t row = 0; row < q.size() / units.size(); ++row)
    for (std::size_t i = 0; i + 3 < units.size(); i += units[i].empty() ? 4 : 1) {
      const double* x = &q[row * units.size() + i];
      if (units[i].empty() && !(std::hypot(std::hypot(x[0], x[1]), std::hypot(x[2], x[3])) > 1e-9))
        return error(ErrorCode::invalid_argument, "a quaternion is zero",
                     "Use 1 0 0 0 for no rotation.", row_path(row_path(name, row), i));
    }
  return {};
}

Result<std::vector<double>> read_rate(const Value& value, std::string_view name, const Robot& r,
                                      const RobotModel& m) {
  if (value.as_string() && value.as_string()->find_first_of("0123456789") == std::string::npos)
    return error(ErrorCode::invalid_argument,
                 text::quote(*value.as_string()) + " is not a list of joint values", {},
                 std::string(name));
  if (!value.as_array() && value.as_list())
    for (const Value& x : *value.as_list())
      if (!x.is_number())
        return error(ErrorCode::invalid_argument, x.text() + " is not a number",
                     "Give numbers in rad, m and seconds.", std::string(name));
  if (m.coordinate_count() == m.dof()) return read_q(value, r, m.joints, name);
  std::vector<double> out = reals(&value);
  if (out.size() != m.dof())
    return error(ErrorCode::invalid_argument,
                 count_given(out.size(), "number") + "; the robot has " + std::to_string(m.dof()) +
                     " velocities",
                 "Give one number per velocity: three for a ball joint, six for a free joint.",
                 std::string(name));
  RMP_TRY(check_size(out, name));
  return out;
}

}  // namespace

void States::keep(std::vector<double> numbers) {
  own_ = std::move(numbers);
  values_ = own_;
}

void States::repeat(std::size_t count) {
  std::vector<double> all;
  all.reserve(values_.size() * count);
  for (std::size_t i = 0; i < count; ++i) all.insert(all.end(), values_.begin(), values_.end());
  keep(std::move(all));
  count_ = count;
}

bool gives_rows(const Value& value, const RobotModel& model) {
  return has_rows(value, model.coordinate_count());
}

Result<States> read_states(const Value& value, const Robot& robot, const RobotModel& model,
                           std::string_view name) {
  States out;
  out.name_ = name;
  const Counted c = counted_coordinates(model);
  if (!has_rows(value, c.width)) {
    RMP_TRY_ASSIGN(auto q, read_q(value, robot, model.joints, name));
    out.keep(std::move(q));
    out.count_ = 1;
    return out;
  }
  out.is_batch_ = true;
  if (const NumericArray* a = value.as_array()) {
    RMP_TRY_ASSIGN(out.values_, matrix_rows(*a, c, name));
    out.count_ = a->rows();
  } else {
    RMP_TRY_ASSIGN(auto rows, list_rows(*value.as_list(), c, name,
                                        [&](const Value& one, const std::string& at) {
                                          return read_q(one, robot, model.joints, at);
                                        }));
    out.keep(std::move(rows));
    out.count_ = value.as_list()->size();
  }
  RMP_TRY(check_quaternions(out.values_, model, name));
  return out;
}

Result<States> read_rates(const Map& args, std::string_view name, const Robot& robot,
                          const RobotModel& model) {
  States out;
  out.name_ = name;
  const Value* value = args.find(name);
  if (!value || value->is_nil()) return out;
  const Counted c = counted_velocities(model);
  if (!has_rows(*value, c.width)) {
    RMP_TRY_ASSIGN(auto numbers, read_rate(*value, name, robot, model));
    out.keep(std::move(numbers));
    out.count_ = 1;
    return out;
  }
  out.is_batch_ = true;
  if (const NumericArray* a = value->as_array()) {
    RMP_TRY_ASSIGN(out.values_, matrix_rows(*a, c, name));
    out.count_ = a->rows();
    return out;
  }
  RMP_TRY_ASSIGN(auto rows, list_rows(*value->as_list(), c, name,
                                      [&](const Value& one, const std::string& at) {
                                        return read_rate(one, at, robot, model);
                                      }));
  out.keep(std::move(rows));
  out.count_ = value->as_list()->size();
  return out;
}

Result<std::size_t> share_rows(std::initializer_list<States*> all) {
  const States* first = nullptr;
  for (const States* s : all) {
    if (!s->is_batch()) continue;
    if (!first) first = s;
    if (s->count() != first->count())
      return error(ErrorCode::invalid_argument,
                   count_given(s->count(), "row") + "; " + first->name() + " has " +
                       std::to_string(first->count()),
                   "Give one row per state, or one list of numbers for all of them.", s->name());
  }
  if (!first) return std::size_t{0};
  for (States* s : all)
    if (!s->is_batch() && s->count() == 1) s->repeat(first->count());
  return first->count();
}

Result<void> refuse_rows(const Map& args, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const Value* value = args.find(name);
    if (!value) continue;
    const NumericArray* a = value->as_array();
    const std::size_t rows = a ? (a->is_matrix() && a->cols() > 1 ? a->rows() : 1)
                             : has_rows(*value, 1) ? value->as_list()->size()
                                                   : 1;
    if (rows != 1)
      return error(ErrorCode::invalid_argument,
                   "one state is expected, but a matrix of " + std::to_string(rows) + " is given",
                   "Call it once per state.", name);
  }
  return {};
}

std::string in_row(const States& states, std::size_t row) {
  return states.is_batch() ? ", row " + std::to_string(row + 1) : std::string();
}

std::shared_ptr<double[]> room_for(std::size_t count) {
  return std::make_shared_for_overwrite<double[]>(count);
}

NumericArray rows_of(std::shared_ptr<double[]> room, std::size_t rows, std::size_t cols,
                     std::string unit, std::size_t first) {
  const double* at = room.get() + first;
  return NumericArray(std::shared_ptr<const double>(std::move(room), at), rows, cols,
                      std::move(unit));
}

}  // namespace robomosp::ioci
