// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/result_types.h"

#include "kernel/type.h"

namespace robomosp::ioci {

std::string result_type(const ReturnSpec& returns) {
  const auto of_fields = [&] {
    Schema fields = returns.fields;
    for (ParamSpec& p : fields) p.required = false;
    return map_type(fields);
  };
  if (!returns.fields.empty() && returns.type == "map") return of_fields();
  if (!returns.fields.empty() && returns.type == "list") return "list<" + of_fields() + ">";
  const bool is_quantity = returns.type == "real" && !returns.unit.empty();
  return is_quantity ? "real [" + returns.unit + "]" : returns.type;
}

}  // namespace robomosp::ioci
