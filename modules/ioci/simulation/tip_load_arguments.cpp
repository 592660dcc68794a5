// SPDX-License-Identifier: Apache-2.0
#include "ioci/simulation/tip_load_arguments.h"

#include <algorithm>

#include "ioci/core/handle_text.h"

namespace robomosp::ioci {
namespace {

/// The three numbers of a force or moment from `first` on, each a number or an expression.
Result<void> read_load_numbers(const Map& args, const char* name, const char* unit,
                               std::size_t first, sim::TipLoad& load) {
  if (!has(args, name)) return {};
  const Value& given = *args.find(name);
  const auto take = [&](const Value& v) -> Result<void> {
    RMP_TRY_ASSIGN(const Value checked, check_value(field("", "vec3", unit, ""), v, name));
    const std::vector<double> numbers = reals(&checked);
    for (std::size_t k = 0; k < 3; ++k) load.constant[first + k] = numbers[k];
    return {};
  };
  const List* list = given.as_list();
  const NumericArray* array = given.as_array();
  if (const std::size_t count = list ? list->size() : array ? array->size() : 3; count != 3)
    return error(
        ErrorCode::invalid_argument,
        "it has " + std::to_string(count) + " numbers, but three are needed",
        "Give one for each of x, y and z, such as {0, 0, \"-20 N * sin(2 rad/s * time)\"}.", name);
  if (!list) return take(given);
  for (std::size_t k = 0; k < 3; ++k) {
    const Value& one = (*list)[k];
    const std::string where = std::string(name) + "[" + std::to_string(k + 1) + "]";
    if (const std::string* words = one.as_string()) {
      auto expression = Expression::compile(*words);
      if (!expression.ok()) return std::move(expression).error().in(where);
      if (!expression->is_literal()) {
        load.expressions[first + k] = *words;
        continue;
      }
    } else if (!one.is_number()) {
      return error(ErrorCode::invalid_argument,
                   one.text() + " is neither a number nor an expression",
                   "Give a number, or an expression of `time` and `path` in quotes.", where);
    }
    const ParamSpec number = field("", "real", unit, "");
    RMP_TRY_ASSIGN(const Value checked, check_value(number, one, where));
    load.constant[first + k] = checked.number();
  }
  return {};
}

/// Whether tip_force names a provider of forces, or is a table that does.
bool names_force(const CommandContext& ctx, const Map& args) {
  const Value* given = args.find("tip_force");
  if (!given) return false;
  if (given->as_map()) return true;
  const std::string* name = given->as_string();
  return name && (name->starts_with("function ") ||
                  ctx.app.registry.find(TipForce::kInterfaceId, *name).ok());
}

}  // namespace

std::optional<Handle> given_handle(const CommandContext& ctx, const Map& args,
                                   std::string_view name) {
  const Value* v = args.find(name);
  if (!v) return std::nullopt;
  if (const Handle* h = v->as_handle()) return *h;
  return v->as_string() ? handle_from_text(ctx.app.handle_kinds, *v->as_string()) : std::nullopt;
}

Result<recording::RecordingPtr> given_recording(const CommandContext& ctx, const Map& args,
                                                const std::string& name) {
  const Value& v = *args.find(name);
  const auto h = given_handle(ctx, args, name);
  const auto found = h && h->kind == "recording" ? ctx.app.recordings.find(h->number) : nullptr;
  if (!found)
    return error(ErrorCode::invalid_argument, v.text() + " is not a recording",
                 "Give the recording that a simulation returned.", name);
  return found;
}

std::vector<ParamSpec> tip_load_fields(const std::string& path) {
  return {
      optional(
          "tip_force", "any", "N",
          "Force on the robot at its tip: x, y and z, each a number or an expression of `time` "
          "[s] and `path` [m], " +
              path +
              "; or the name of a provider of forces. In Lua also a function (time, path) that "
              "returns three numbers, or six with the moment."),
      optional("tip_moment", "any", "N m",
               "Moment on the robot about its tip's origin, in the same form."),
      optional("tip_wrench", "any", "",
               "A recording of additional force and moment: columns wrench1 to wrench6, or fx, fy, "
               "fz, mx, my, mz, or those named by tip_columns. Linear between its rows; beyond "
               "them the nearest row is used."),
      optional(
          "tip_columns", "list", "",
          "Names of the columns of tip_wrench: three of the force, or six of force and moment."),
      choice("tip_over", {"time", "path"},
             "Independent variable of the rows of tip_wrench: its column time or path."),
      choice("tip_axes", {"world", "base", "tool"},
             "Axes of force and moment: those of the world, of the robot's mounting frame, or of "
             "the tip."),
      optional("tip", "string", "", "Name of the tip at which they act; the first if omitted.")};
}

bool has_tip_load(const Map& args) {
  return has(args, "tip_force") || has(args, "tip_moment") || has(args, "tip_wrench");
}

Result<sim::TipLoad> read_tip_load(const CommandContext& ctx, const Map& args) {
  sim::TipLoad load;
  if (names_force(ctx, args)) {
    RMP_TRY_ASSIGN(const auto choice, read_provider(*args.find("tip_force"), "tip_force"));
    auto force = sim::bind_tip_force(ctx.app.registry, choice);
    if (!force.ok()) return std::move(force).error().in("tip_force");
    load.force = std::move(*force);
  } else {
    RMP_TRY(read_load_numbers(args, "tip_force", "N", 0, load));
  }
  RMP_TRY(read_load_numbers(args, "tip_moment", "N m", 3, load));
  if (has(args, "tip_wrench")) {
    RMP_TRY_ASSIGN(load.recorded, given_recording(ctx, args, "tip_wrench"));
  }
  if (has(args, "tip_columns")) {
    for (const Value& v : *args.find("tip_columns")->as_list()) {
      if (!v.as_string())
        return error(ErrorCode::invalid_argument, v.text() + " is not the name of a column",
                     "recording.columns lists them.", "tip_columns");
      load.columns.push_back(*v.as_string());
    }
  }
  load.is_over_path = text_of(args, "tip_over") == "path";
  if (!load.recorded && (load.is_over_path || !load.columns.empty()))
    return error(ErrorCode::invalid_argument,
                 std::string(load.is_over_path ? "tip_over" : "tip_columns") +
                     " belongs to a recording, but no tip_wrench is given",
                 "Give tip_wrench, or leave it out.");
  const std::string axes = text_of(args, "tip_axes");
  load.axes = static_cast<sim::LoadAxes>(
      std::find(sim::kLoadAxes.begin(), sim::kLoadAxes.end(), axes) - sim::kLoadAxes.begin());
  load.tip = text_of(args, "tip");
  if (!load.tip.empty() && !has_tip_load(args))
    return error(ErrorCode::invalid_argument, "a tip is named, but no force acts at it",
                 "Give tip_force, tip_moment or tip_wrench, or leave the tip out.", "tip");
  return load;
}

Result<std::optional<sim::TipLoad>> read_optional_load(const CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(sim::TipLoad load, read_tip_load(ctx, args));
  std::optional<sim::TipLoad> out;
  if (has_tip_load(args)) out = std::move(load);
  return out;
}

}  // namespace robomosp::ioci
