// SPDX-License-Identifier: Apache-2.0
// A column of a recording by its name (layer: application, recording).
#pragma once

#include <span>
#include <string>

#include "recording/recording.h"

namespace robomosp::recording {

[[nodiscard]] inline Result<const Column*> column_of(const Recording& r, const std::string& name) {
  RMP_TRY_ASSIGN(const auto found, r.select(std::span(&name, 1)));
  return found.front();
}

}  // namespace robomosp::recording
