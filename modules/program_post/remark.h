// SPDX-License-Identifier: Apache-2.0
// Remarks on a program being posted to a controller (layer: data processing, program_post).
#pragma once

#include <string>

#include <robomosp/sdk/program_code.h>

namespace robomosp::program_post {

/// A remark on a place of the program.
struct Remark {
  std::uint32_t severity = RMP_FAULT_ERROR;
  rmp_span span{};
  std::string message, hint;
};

}  // namespace robomosp::program_post
