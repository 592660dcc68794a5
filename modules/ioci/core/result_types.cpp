// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/result_types.h"

#include "ioci/core/commands.h"
#include "kernel/type.h"

namespace robomosp::ioci {

std::string result_type(const ReturnSpec& returns) {
  const auto of_fields = [&] {
    Schema fields = returns.fields;
    for (ParamSpec& p : fields) p.required = false;
    return map_type(fields);
  };
  if (!returns.fields.empty() && returns.type == "map") return of_fields();
  if (!returns.fields.empty() && returns.type == "map<map>") return "map<" + of_fields() + ">";
  if (!returns.fields.empty() && returns.type == "list") return "list<" + of_fields() + ">";
  const bool is_quantity = returns.type == "real" && !returns.unit.empty();
  return is_quantity ? "real [" + returns.unit + "]" : returns.type;
}

std::vector<ParamSpec> param_value_fields() {
  return {field("name", "string", "", "Its name."),
          field("type", "string", "", "Its type, without the parts."),
          field("declared", "string", "", "The type in full, if it has parts or notes."),
          field("form", "map", "", "The type as nested tables; schema.types lists the named ones."),
          field("unit", "string", "", "SI unit."),
          field("shown_unit", "string", "", "Usual unit in user interfaces."),
          field("doc", "string", "", "Its description."),
          field("label", "string", "", "Label to show instead of the name."),
          field("group", "string", "", "Heading to show it under."),
          field("order", "int", "", "Place within the group."),
          field("advanced", "bool", "", "Whether it is hidden at first."),
          field("when", "string", "", "Condition under which it counts."),
          field("required", "bool", "", "Whether a value is required."),
          field("default", "any", "", "Its default."),
          field("min", "real", "", "Least value."),
          field("above", "real", "", "Bound that it must exceed."),
          field("max", "real", "", "Greatest value."),
          field("infinite", "bool", "", "Whether infinite values are allowed."),
          field("choices", "list<string>", "", "Words of an enum."),
          field("words", "list<map{word: string; label: string; doc?: string}>", "",
                "Words of an enum with labels to show and descriptions."),
          field("step", "real", "", "Sensible change."),
          field("logarithmic", "bool", "", "Whether it is changed by factors."),
          field("example", "any", "", "An example."),
          field("since", "string", "", "Version of the program that has it."),
          field("deprecated", "string", "", "What to give instead."),
          field("effect", "string", "", "How it changes the result.")};
}

namespace {
std::string param_value_type() {
  std::vector<ParamSpec> fields = param_value_fields();
  for (ParamSpec& p : fields) p.required = false;
  return map_type(fields);
}
const NamedType kParamValueType("parameter_facts", "map", param_value_type);
}  // namespace

}  // namespace robomosp::ioci
