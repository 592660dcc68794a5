// SPDX-License-Identifier: Apache-2.0
// What the files of commands share: short forms for schemas, reading of checked arguments, and the
// library of shipped files (layer: application, ioci only).
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ioci/core/application.h"
#include "kernel/text.h"
#include "model/placement.h"

namespace robomosp::ioci {

// --- schemas -------------------------------------------------------------------------------

/// A parameter that must be given.
[[nodiscard]] ParamSpec needed(std::string name, std::string type, std::string unit,
                               std::string doc);
/// A parameter that may be left out.
[[nodiscard]] ParamSpec optional(std::string name, std::string type, std::string unit,
                                 std::string doc);
/// A parameter with a default.
[[nodiscard]] ParamSpec defaulted(std::string name, std::string type, std::string unit, Value value,
                                  std::string doc);
/// One of a few words; the first is the default unless `must`.
[[nodiscard]] ParamSpec choice(std::string name, std::vector<std::string> choices, std::string doc,
                               bool must = false);
/// `id` of a method of one kind or several ("robot", "solid|object").
[[nodiscard]] ParamSpec self(std::string kinds);
/// The same parameter with bounds; `above_zero(p)` for what must be greater than 0.
[[nodiscard]] ParamSpec between(ParamSpec p, double min, double max);
[[nodiscard]] ParamSpec above_zero(ParamSpec p);
/// A field of a returned map.
[[nodiscard]] ParamSpec field(std::string name, std::string type, std::string unit,
                              std::string doc);

// --- checked arguments ---------------------------------------------------------------------

[[nodiscard]] bool has(const Map& args, std::string_view name);
[[nodiscard]] double real(const Map& args, std::string_view name);
[[nodiscard]] std::int64_t integer(const Map& args, std::string_view name);
[[nodiscard]] bool flag(const Map& args, std::string_view name);
[[nodiscard]] std::string text_of(const Map& args, std::string_view name);
[[nodiscard]] Vec3 vec3(const Map& args, std::string_view name);
/// Of real[], vec3 or a list of numbers; empty when not given.
[[nodiscard]] std::vector<double> reals(const Value* value);
[[nodiscard]] std::vector<double> reals(const Map& args, std::string_view name);
/// The record that a checked ref argument names; number 0 when it was not given.
[[nodiscard]] AnyId ref(const Map& args, std::string_view name);
/// Content of a checked `id`.
template <class R>
[[nodiscard]] const R& content(const CommandContext& ctx, const Map& args,
                               std::string_view name = "id") {
  const model::Record* r = ctx.snapshot().find(ref(args, name));
  return std::get<R>(r->body);
}
template <class R>
[[nodiscard]] Id<model::kind_of<R>> typed(const Map& args, std::string_view name = "id") {
  return Id<model::kind_of<R>>{ref(args, name).number};
}
/// Changes the content of the record `id` in the command's transaction.
template <class R, class Fn>
[[nodiscard]] Result<void> change(CommandContext& ctx, AnyId id, Fn&& fn) {
  return ctx.edit().edit(id,
                         [&](model::Record& r) -> Result<void> { return fn(std::get<R>(r.body)); });
}
/// `robot "pa10"`
[[nodiscard]] std::string name_in(const CommandContext& ctx, AnyId id);

/// A name or handle inside a list or map, as a record of one of the kinds.
[[nodiscard]] Result<AnyId> read_ref(const CommandContext& ctx, std::string_view kinds,
                                     const Value& value, std::string_view path);
/// A placement as it was written (notation kept), from a pose's spellings; nil is the identity.
[[nodiscard]] Result<model::Placement> read_placement(const Value* value, std::string_view path);
/// The placement fields of a table: `placement`, or one of `position`, `cylindrical`, `spherical`
/// with one of `rpy`, `xyz`, `zyz`, `quaternion`, `axis_angle`.
[[nodiscard]] Schema placement_fields(std::string frame);
/// Reads placement_fields() from a table as it was given.
[[nodiscard]] Result<model::Placement> read_placement_fields(const Map& table,
                                                             std::string_view path);
/// Sets "placement", another of kPlacementFields; "position.x" is the first number of the position
/// in the coordinates it is written in. False = another field.
[[nodiscard]] Result<bool> set_placement(model::Placement& p, std::string_view field,
                                         const Value& value, std::string_view path);
inline constexpr std::string_view kPlacementFields[] = {
    "placement",  "position", "cylindrical", "spherical", "position.x", "position.y",
    "position.z", "rpy",      "xyz",         "zyz",       "quaternion", "axis_angle"};
/// Checks the entries of a list of maps or one map against a schema; `path` names it.
[[nodiscard]] Result<Map> read_map(const CommandContext& ctx, const Schema& schema,
                                   const Value& value, std::string_view path);
/// `{name = "numeric", params = {...}}` or a plain name.
[[nodiscard]] Result<model::ProviderChoice> read_provider(const Value& value,
                                                          std::string_view path);

/// Joint values as given: numbers, texts with units by each joint's type, or a named pose.
[[nodiscard]] Result<std::vector<double>> read_q(const Value& value, const model::Robot& robot,
                                                 std::span<const JointModel> joints,
                                                 std::string_view path);
/// The mechanism of a checked `id` under standard or given `gravity` (mounting frame).
[[nodiscard]] Result<std::shared_ptr<const RobotModel>> model_of(CommandContext& ctx,
                                                                 const Map& args,
                                                                 std::string_view name = "id");
/// The parameters `objective` and `influence` of commands that move redundant robots; `more`
/// describes the obstacles that count. Then the objective given.
[[nodiscard]] std::vector<ParamSpec> objective_fields(const std::string& more);
[[nodiscard]] IkObjective objective_of(const Map& args);
/// Index of the part of that name; the error lists the existing names.
[[nodiscard]] Result<std::size_t> find_part(const model::Object& o, std::string_view name);
/// Index of a link given by number (1 = first) or name; "base" or 0 is -1 where allowed.
[[nodiscard]] Result<std::int32_t> read_link(const model::Robot& r, const Value& value,
                                             bool base_allowed, std::string_view path);
/// Lua that makes a six-joint arm `arm` for examples.
[[nodiscard]] std::string with_arm(const char* rest);

// --- values --------------------------------------------------------------------------------

[[nodiscard]] Value vec_value(const Vec3& v, std::string unit = {});
[[nodiscard]] Value sym_value(const Sym3& s, std::string unit);  ///< 3x3 matrix of its elements
[[nodiscard]] Value placement_value(const model::Placement& p);
[[nodiscard]] Value mass_value(const MassProperties& m);  ///< {mass, com, inertia}
[[nodiscard]] Value provider_value(const model::ProviderChoice& p);
[[nodiscard]] Value ref_value(const document::Snapshot& s, AnyId id);  ///< name, nil when none
[[nodiscard]] std::string colour_text(const Colour& c);                ///< "#c0c0c0"
[[nodiscard]] Value colour_value(const Colour& c);
[[nodiscard]] Result<Colour> read_colour(const Value& v, std::string_view path);
/// Everything a record holds as nested maps; what `describe` returns.
[[nodiscard]] Map describe_record(const document::Snapshot& s, AnyId id);
/// Fields for the mass of a body, and their values.
[[nodiscard]] std::vector<ParamSpec> body_mass_fields();
[[nodiscard]] Map body_mass_map(const evaluation::BodyMass& b, const Pose& about = {});
/// The argument `about` of the mass commands, and the frame that was given.
[[nodiscard]] ParamSpec about_field();
[[nodiscard]] Pose about_of(const Map& args);
/// Warns the user (code "no_mass") if no moving link of a robot has a mass; `outcome` as in `, so
/// its torques are zero`.
void report_no_mass(CommandContext& ctx, const RobotModel& m, Severity severity,
                    std::string_view outcome);
/// Pose as 4x4 matrix with position, roll-pitch-yaw and quaternion.
[[nodiscard]] Map pose_map(const Pose& t);

// --- library of shipped files --------------------------------------------------------------

/// The folders of the library, canonical.
[[nodiscard]] std::vector<std::filesystem::path> library_folders(const Application& app);
/// True if a file, with a canonical path, is in one of these folders or below.
[[nodiscard]] bool is_within(std::span<const std::filesystem::path> folders,
                             const std::filesystem::path& file);
/// "materials", "parts", ... below a library folder.
[[nodiscard]] std::vector<std::filesystem::path> library_folders(const Application& app, Kind kind);
/// Names of the library's records of a kind, sorted.
[[nodiscard]] std::vector<std::string> library_names(const Application& app, Kind kind);
[[nodiscard]] std::optional<std::filesystem::path> library_file(const Application& app, Kind kind,
                                                                std::string_view name);

/// `1 number is given`, `3 numbers are given`.
[[nodiscard]] inline std::string count_given(std::size_t n, const std::string& noun) {
  return std::to_string(n) + " " + noun + (n == 1 ? " is given" : "s are given");
}
/// A list "a, b and c" of unknown-name fault.
[[nodiscard]] Error unknown_name(std::string_view what, std::string_view name,
                                 const std::vector<std::string>& known);

}  // namespace robomosp::ioci
