// SPDX-License-Identifier: Apache-2.0
// Expressions over parameters among the arguments of commands (layer: application, ioci only).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "document/document.h"
#include "kernel/number_reader.h"
#include "kernel/schema.h"
#include "kernel/value.h"
#include "model/marked_numbers.h"
#include "model/parametric.h"

namespace robomosp::ioci {

class CommandContext;
struct CommandSpec;

/// Reads numbers that were given as expressions: code that reads the arguments sees plain numbers,
/// and the texts are stored here until the command puts them into its record with keep().
class Expressions {
 public:
  Expressions() = default;
  /// For a record with parameters `own`; `own_name` is the name of a world itself, else "".
  Expressions(const document::Snapshot&, model::Parametric own, std::string own_name);

  [[nodiscard]] const model::Parametric& own() const { return own_; }
  /// Resolves names; must not outlive this object.
  [[nodiscard]] Expression::Lookup lookup() const;

  /// The fields of `given` with reals, vec3s and poses of the schema as numbers; everything else
  /// unchanged. Paths are those of model::number_at() behind `prefix`. A field `expressions` of
  /// type map in the schema holds texts by path.
  Result<Map> read(const Schema&, const Map& given, std::string_view where,
                   const std::string& prefix = {});
  /// The value for a path of `body` ("bore.radius", "bore.position", "bore.placement").
  Result<Value> read_at(const model::Body& body, const std::string& path, const Value&);

  /// Moves the texts read so far into a record, with their paths behind `prefix` ("bore" for the
  /// path "radius"); paths given as plain numbers lose their expression.
  void keep(model::Parametric&, std::string_view prefix = {});

 private:
  Result<Value> number(const Value&, std::string_view unit, const std::string& path,
                       const std::string& where);
  Result<Value> numbers(const Value&, const std::vector<std::string_view>& units,
                        const std::vector<std::string>& paths, const std::string& where);
  Result<Value> pose(const Value&, const std::string& path, const std::string& where);
  Result<Value> field(const ParamSpec&, const Value&, const std::string& prefix,
                      const std::string& where);
  void note(const std::string& path, std::optional<std::string> text);

  const document::Snapshot* snapshot_ = nullptr;
  model::Parametric own_;
  std::string own_name_;
  model::WorldParameters worlds_;
  std::vector<std::pair<std::string, std::optional<std::string>>> found_;  ///< none = plain
};

/// The expressions over the parameters of the record `id` of the arguments, or over those of the
/// argument `parameters`.
Result<Expressions> expressions_of(const CommandContext&, const CommandSpec&, const Map& args);

/// Reads texts given in place of numbers, anywhere in a command's arguments, as expressions, and
/// finds afterwards which numbers of which records they became. For commands that edit records.
class GivenExpressions final : public NumberReader {
 public:
  GivenExpressions(const CommandContext& ctx, const CommandSpec& spec, const Map& args)
      : ctx_(ctx), spec_(spec), args_(args) {}

  std::optional<Result<double>> read(std::string_view text, std::string_view unit, double min,
                                     double max) override;
  /// Stores the expressions in the records that the command edited. An expression with a number
  /// that is in no record, because the command computed with it, is an error.
  Result<void> keep(document::Transaction&) const;

 private:
  const CommandContext& ctx_;
  const CommandSpec& spec_;
  const Map& args_;
  std::optional<Expressions> known_;  ///< made for the first text
  model::MarkedNumbers marks_;
};

/// Sets a number that is a component of a settable value: an angle (`bore.rpy.z`) or a coordinate
/// of a profile (`plate.profile.1.3.x`). False = the path is neither.
Result<bool> set_component(CommandContext&, AnyId, const std::string& path, const Value& value);

/// `parameters` of the create commands: {bore = "20 mm", wall = {value = "bore/4", ...}}.
[[nodiscard]] ParamSpec parameters_field();
/// Reads it; nil is none. Every parameter has its unit and value.
[[nodiscard]] Result<model::Parametric> read_parameters(const document::Snapshot&,
                                                        const std::string& own_world, const Value*,
                                                        std::string_view where);
/// Sets one parameter from `{value, unit, expression, description}`; missing entries stay
/// unchanged.
Result<void> set_parameter(const document::Snapshot&, const std::string& own_world,
                           model::Parametric&, const std::string& name, const Map& given);
/// {bore = {value, unit, text, expression, description}}, which create takes as well.
[[nodiscard]] Value parameters_value(const model::Parametric&);
/// {["bore.radius"] = "bore/2"}; with a prefix those below it, without it in front.
[[nodiscard]] Map expressions_map(const model::Parametric&, std::string_view prefix = {});

}  // namespace robomosp::ioci
