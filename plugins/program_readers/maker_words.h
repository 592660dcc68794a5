// SPDX-License-Identifier: Apache-2.0
// Instructions and functions that controllers have by themselves, by the makers' manuals: a program
// that calls one calls no routine of a user (layer: plugin, std only).
#pragma once

#include <optional>
#include <string_view>

namespace robomosp::readers {

/// Languages whose readers have no list of their own.
enum class MakerLanguage { none, krl, rapid, val3, pdl2, pacscript };
/// What a controller's own word does to motions and signals.
enum class MakerWord {
  moves,  ///< it moves, switches, waits, gives variables a value or changes what later motions do
  tells,  ///< it shows, writes or measures time, and motions go on as without it
};
/// Of a word in lower case; nothing where the controller has no such word. Words that a reader
/// reads are looked at by it before.
[[nodiscard]] std::optional<MakerWord> maker_word(MakerLanguage language, std::string_view word);

}  // namespace robomosp::readers
