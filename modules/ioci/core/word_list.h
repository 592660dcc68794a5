// SPDX-License-Identifier: Apache-2.0
// Lists of names in arguments of commands (layer: application, ioci).
#pragma once

#include <string>
#include <vector>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// "tau1", "q tau" or {"q", "tau"}; empty when not given.
inline Result<std::vector<std::string>> word_list(const Map& args, const std::string& path) {
  std::vector<std::string> out;
  const Value* given = args.find(path);
  if (!given || given->is_nil()) return out;
  if (given->as_string()) return split_classic(*given->as_string());
  if (!given->as_list())
    return error(ErrorCode::invalid_argument, given->text() + " is not a list of names",
                 "Give a name or a list such as {\"q\", \"tau\"}.", path);
  for (const Value& word : *given->as_list())
    out.push_back(word.as_string() ? *word.as_string() : word.text());
  return out;
}

}  // namespace robomosp::ioci
