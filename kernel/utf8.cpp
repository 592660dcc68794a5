// SPDX-License-Identifier: Apache-2.0
#include "kernel/utf8.h"

#include <robomosp/sdk/names.h>

namespace robomosp::text {

std::size_t first_bad_byte(std::string_view s) {
  for (std::size_t i = 0; i < s.size();) {
    const std::size_t bytes = s[i] == 0 ? 0 : name_rules::code_point(s, i).second;
    if (bytes == 0) return i;
    i += bytes;
  }
  return std::string_view::npos;
}

}  // namespace robomosp::text
