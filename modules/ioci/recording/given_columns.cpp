// SPDX-License-Identifier: Apache-2.0
#include "ioci/recording/given_columns.h"

#include <algorithm>

#include "kernel/unit_lists.h"
#include "kernel/units.h"

namespace robomosp::ioci {
namespace {

/// The numbers of a vector, a matrix or a list, with the shape and unit that they bring.
Result<NumericArray> numbers_of(const Value& given, const std::string& where) {
  const auto refused = [&](const std::string& what) {
    return error(ErrorCode::invalid_argument, what,
                 "Give numbers: a list, an array, or a matrix with one row per sample.", where);
  };
  if (const NumericArray* a = given.as_array()) return *a;
  const List* list = given.as_list();
  if (!list) return refused(given.text() + " is not a list of numbers");
  if (!list->empty() && ((*list)[0].as_list() || (*list)[0].as_array())) {  // rows of a matrix
    std::vector<double> all;
    std::size_t width = 0;
    for (std::size_t i = 0; i < list->size(); ++i) {
      if (!(*list)[i].as_list() && !(*list)[i].as_array())
        return refused("row " + std::to_string(i + 1) + " is not a list of numbers");
      RMP_TRY_ASSIGN(const NumericArray row, numbers_of((*list)[i], where));
      if (row.is_matrix() || row.size() == 0 || (i > 0 && row.size() != width))
        return refused("row " + std::to_string(i + 1) +
                       " is empty or has a different length than row 1");
      width = row.size();
      for (const double v : row.data()) all.push_back(v);
    }
    return NumericArray(std::move(all), list->size(), width);
  }
  std::vector<double> values;
  values.reserve(list->size());
  for (const Value& v : *list) {
    if (!v.as_real() && !v.as_int())
      return refused("entry " + std::to_string(values.size() + 1) + ", " + v.text() +
                     ", is not a number");
    values.push_back(v.number());
  }
  return NumericArray(std::move(values));
}

/// The unit of a column: as it is read, and the name that it has in SI.
struct ColumnUnit {
  units::Unit unit;
  std::string name;
};

/// The units of `count` columns from one unit for all, or from a list of as many.
Result<std::vector<ColumnUnit>> units_of_columns(const std::string& typed, std::size_t count,
                                                 const std::string& where) {
  const std::string here = where + ".unit";
  if (typed.find(" or ") != std::string::npos)
    return error(ErrorCode::invalid_argument,
                 text::quote(typed) + " does not determine the unit of the numbers",
                 "Give one unit, or for a matrix one per column, such as unit = \"rad, m, rad\".",
                 here);
  const std::vector<std::string_view> names = units::entries(typed);
  if (names.size() > 1 && names.size() != count)
    return error(
        ErrorCode::invalid_argument,
        count == 1 ? "a column has one unit, but its numbers are in " + text::quote(typed)
                   : "there are " + std::to_string(names.size()) + " units, " + text::quote(typed) +
                         ", for " + std::to_string(count) + " columns",
        "Give a matrix with one row per sample and one column per unit, or name one unit.", here);
  std::vector<ColumnUnit> out;
  for (const std::string_view name : names) {
    auto unit = units::parse(name == "1" ? std::string_view() : name);
    if (!unit.ok()) return std::move(unit).error().in(here);
    out.push_back({*unit, unit->factor == 1 ? std::string(name == "1" ? "" : name)
                                            : units::si_name(unit->dimension)});
  }
  if (out.size() == 1) out.resize(count, out.front());
  return out;
}

}  // namespace

Result<void> add_columns(const Value& entry, const std::string& where, recording::Recording& out) {
  const Map* field = entry.as_map();
  const Value* name = field ? field->find("name") : nullptr;
  const Value* given = field ? field->find("values") : nullptr;
  if (!name || !name->as_string() || !given)
    return error(ErrorCode::invalid_argument, "a column needs a name and values",
                 "Give such as {name = \"error\", unit = \"m\", values = {0.1, 0.2}}.", where);
  for (const auto& [key, value] : *field)
    if (key != "name" && key != "values" && key != "unit" && key != "doc")
      return error(ErrorCode::invalid_argument, "a column has no field " + text::quote(key),
                   "The fields are name, values, unit and doc.", where);
  const std::string& stem = *name->as_string();
  if (text::trim(stem).empty() || text::read_real(stem))
    return error(ErrorCode::invalid_argument, text::quote(stem) + " is not the name of a column",
                 "Names must not be empty, and must not be numbers.", where);
  RMP_TRY_ASSIGN(const NumericArray values, numbers_of(*given, where + ".values"));
  const Value* named = field->find("unit");
  const std::string typed =
      named && named->as_string() ? *named->as_string() : std::string(values.unit());
  const std::size_t count = values.is_matrix() ? values.cols() : 1;
  RMP_TRY_ASSIGN(const std::vector<ColumnUnit> units, units_of_columns(typed, count, where));
  const Value* doc = field->find("doc");
  for (std::size_t c = 0; c < count; ++c) {
    recording::Column column;
    column.name = values.is_matrix() ? stem + std::to_string(c + 1) : stem;
    column.unit = units[c].name;
    if (doc && doc->as_string()) column.doc = *doc->as_string();
    column.values.reserve(values.rows());
    for (std::size_t r = 0; r < values.rows(); ++r)
      column.values.push_back(
          units::to_si(values.is_matrix() ? values.at(r, c) : values[r], units[c].unit));
    const auto same = std::find_if(out.columns.begin(), out.columns.end(),
                                   [&](const auto& other) { return other.name == column.name; });
    if (same != out.columns.end())
      return error(ErrorCode::invalid_argument, "there are two columns " + text::quote(column.name),
                   "Rename one.", where);
    if (!out.columns.empty() && column.values.size() != out.rows())
      return error(ErrorCode::invalid_argument,
                   "the column " + text::quote(column.name) + " has " +
                       std::to_string(column.values.size()) + " values, but " +
                       text::quote(out.columns.front().name) + " has " + std::to_string(out.rows()),
                   "Give the same number to each.", where);
    out.columns.push_back(std::move(column));
  }
  return {};
}

ParamSpec robot_of_columns_field() {
  return optional("robot", "string", "",
                  "Robot of the joint columns q1, q2 and so on, for example measured ones: its "
                  "name in the world, or without a world the name of a robot; or the robot.");
}
ParamSpec world_of_columns_field() {
  return optional("world", "ref:world", "", "The robot's world.");
}

Result<void> give_robot(CommandContext& ctx, const Map& args, recording::Recording& r) {
  const bool has_world = has(args, "world");
  if (!has(args, "robot")) {
    if (!has_world) return {};
    return error(ErrorCode::invalid_argument, "a world is given but no robot",
                 "Name the robot of the joint columns.", "robot");
  }
  const std::string name = text_of(args, "robot");
  RobotId id;
  if (has_world) {
    r.world = typed<model::World>(args, "world");
    std::vector<std::string> known;
    for (const model::PlacedRobot& p : ctx.snapshot().get(r.world)->robots) {
      known.push_back(p.name);
      if (p.name == name) id = p.robot;
    }
    if (id.number == 0) return unknown_name("robot", name, known).in(name_in(ctx, AnyId(r.world)));
  } else if (const auto found = ctx.snapshot().find(Kind::robot, name)) {
    id = RobotId{found->number};
  } else {
    return error(ErrorCode::unknown_name, "there is no robot " + text::quote(name),
                 "robot.list lists the existing ones.", "robot");
  }
  RMP_TRY_ASSIGN(const auto model,
                 ctx.app.derived.robot_model(ctx.snapshot(), id, {0, 0, -9.81}, ctx.progress));
  r.robot = name;
  r.dof = model->dof();
  if (!r.find("q1"))
    return error(ErrorCode::invalid_argument, "a robot is named, but there is no column \"q1\"",
                 "Name the columns of its joints q1, q2 and so on, or leave the robot out.",
                 "columns");
  for (const recording::Column& c : r.columns)
    if (c.name.size() > 1 && c.name.starts_with("q") && text::read_real(c.name.substr(1))) {
      const double n = *text::read_real(c.name.substr(1));
      if (n > static_cast<double>(model->coordinate_count()))
        return error(ErrorCode::invalid_argument,
                     "there is a column " + text::quote(c.name) + " and robot " +
                         text::quote(name) + " has " + std::to_string(model->coordinate_count()) +
                         " joint values",
                     "Give as many columns as the robot has joints.", "columns");
      if (n >= 1 && model->is_simple()) {
        const auto& joint = model->joints[static_cast<std::size_t>(n) - 1];
        const char* const unit = joint.type == JointType::prismatic ? "m" : "rad";
        if (c.unit != unit)
          return error(ErrorCode::invalid_argument,
                       "column " + text::quote(c.name) + " is in " + text::quote(c.unit) +
                           ", and joint " + text::quote(joint.name) + " of robot " +
                           text::quote(name) + " in " + text::quote(unit),
                       "Name the unit of its values.", "columns");
      }
    }
  return {};
}

}  // namespace robomosp::ioci
