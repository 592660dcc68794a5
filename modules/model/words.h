// SPDX-License-Identifier: Apache-2.0
// The words that files and commands have for kinds of joints and loops (layer: data processing,
// model). [any thread]
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "model/records.h"

namespace robomosp::model {

[[nodiscard]] constexpr std::string_view joint_word(JointKind kind) {
  return kJointWords[static_cast<std::size_t>(kind)];
}
[[nodiscard]] constexpr std::string_view loop_word(LoopKind kind) {
  return kLoopWords[static_cast<std::size_t>(kind)];
}
/// The kind of a word; none = it is no kind.
[[nodiscard]] constexpr std::optional<JointKind> joint_kind(std::string_view word) {
  for (std::size_t i = 0; i < kJointWords.size(); ++i)
    if (kJointWords[i] == word) return static_cast<JointKind>(i);
  return std::nullopt;
}
[[nodiscard]] constexpr std::optional<LoopKind> loop_kind(std::string_view word) {
  for (std::size_t i = 0; i < kLoopWords.size(); ++i)
    if (kLoopWords[i] == word) return static_cast<LoopKind>(i);
  return std::nullopt;
}

}  // namespace robomosp::model
