// SPDX-License-Identifier: Apache-2.0
#include "ioci/client/call_text.h"

#include "ioci/core/lua_line.h"
#include "ioci/core/secrets.h"

namespace robomosp::ioci {

CallText call_text(std::string_view command, const Map& args) {
  CallText out;
  out.is_whole = !has_secrets(args);
  const Map shown = out.is_whole ? args : without_secrets(args);
  out.line = std::string(command);
  if (shown.empty()) {
    out.line += "()";
    return out;
  }
  out.line += "{";
  for (const auto& [name, value] : shown) {
    if (!out.parts.empty()) out.line += ", ";
    CallText::Part part{name, out.line.size(), 0};
    out.line += is_lua_key(name) ? name : "[" + lua_text(Value(name)) + "]";
    out.line += " = " + lua_text(value);
    part.end = out.line.size();
    out.parts.push_back(std::move(part));
  }
  out.line += "}";
  return out;
}

}  // namespace robomosp::ioci
