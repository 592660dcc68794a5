// SPDX-License-Identifier: Apache-2.0
// Rows of the tables of a program, by their type (layer: application, ioci).
#pragma once

#include <cstdint>

#include <robomosp/sdk/program_code.h>

namespace robomosp::ioci {

/// Row i of a table with rows of type Row; i is below the table's count.
template <class Row>
[[nodiscard]] const Row& row_of(const rmp_table& t, std::uint32_t i) {
  return *static_cast<const Row*>(rmp_row(&t, i));
}

}  // namespace robomosp::ioci
