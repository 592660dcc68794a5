// SPDX-License-Identifier: Apache-2.0
// Built-in instructions and functions of controllers, from the makers' manuals: a call of one is
// not a call of a user's routine (layer: plugin, std only).
#pragma once

#include <optional>
#include <string_view>

namespace robomosp::readers {

/// Languages of readers without a separate list.
enum class MakerLanguage { none, krl, rapid, val3, pdl2, pacscript };
/// Effect of a controller's built-in word on motions and signals.
enum class MakerWord {
  moves,  ///< it moves, switches, waits, assigns variables or affects later motions
  tells,  ///< it shows, writes or measures time, without effect on motions
};
/// For a word in lower case; nothing if the controller has no such word. Words supported by a
/// reader are handled by it before.
[[nodiscard]] std::optional<MakerWord> maker_word(MakerLanguage language, std::string_view word);

}  // namespace robomosp::readers
