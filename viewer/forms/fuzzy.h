// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzy search of commands by name, classic spelling and summary (layer: GUI; no Qt).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace robomosp::viewer {

/// How well a text matches what was typed, and which of its bytes did.
struct FuzzyMatch {
  double score = 0;  ///< 0 = it does not match
  std::vector<std::size_t> places{};
};

/// Matches the letters of `typed` in order, blanks aside, without regard to case. Runs of letters,
/// beginnings of words and early matches score higher.
[[nodiscard]] FuzzyMatch fuzzy_match(std::string_view typed, std::string_view text);

/// A command as the palette finds it.
struct FoundCommand {
  std::size_t index = 0;  ///< in the list that was searched
  double score = 0;
  std::vector<std::size_t> name_places{};
};
struct SearchedCommand {
  std::string name, classic, summary;
};
/// Commands that match, best first: by name, by classic spelling, or by words of the summary. All
/// in alphabetical order if nothing was typed.
[[nodiscard]] std::vector<FoundCommand> find_commands(std::string_view typed,
                                                      const std::vector<SearchedCommand>& commands);

}  // namespace robomosp::viewer
