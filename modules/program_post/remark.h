// SPDX-License-Identifier: Apache-2.0
// What is to be told of a program on its way to a controller (layer: data processing,
// program_post).
#pragma once

#include <string>

#include <robomosp/sdk/program_code.h>

namespace robomosp::program_post {

/// Something that is said of a place of the program.
struct Remark {
  std::uint32_t severity = RMP_FAULT_ERROR;
  rmp_span span{};
  std::string message, hint;
};

}  // namespace robomosp::program_post
