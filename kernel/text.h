// SPDX-License-Identifier: Apache-2.0
// Locale-free reading and printing of numbers, quoting, near-name suggestions (layer: core).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::text {

/// Shortest text that reads back to the same bits; "inf", "-inf", "nan"; -0 prints as 0.
[[nodiscard]] std::string print(double v);
/// At most `digits` significant digits, trailing zeros dropped; for people, not for files.
[[nodiscard]] std::string print_rounded(double v, int digits = 6);
/// Exactly `decimals` digits after the point, never an exponent; for formats that require it.
[[nodiscard]] std::string print_fixed(double v, int decimals);
/// The whole of `s` as a real / an integer; nullopt if anything is left over or out of range.
[[nodiscard]] std::optional<double> read_real(std::string_view s);
[[nodiscard]] std::optional<std::int64_t> read_int(std::string_view s);

/// "a \"b\"" with \" \\ \n \t \r escaped.
[[nodiscard]] std::string quote(std::string_view s);
/// For a terminal: control characters except line ends and tabs become \\xNN, so that texts of a
/// file or plugin cannot control it.
[[nodiscard]] std::string visible(std::string_view s);
/// A sentence of at most `most` bytes: shortens long quoted texts in it first, then its middle.
[[nodiscard]] std::string shortened(std::string s, std::size_t most = 2000);
/// The same for all texts of an error.
[[nodiscard]] Error shortened(Error e);
[[nodiscard]] std::string_view trim(std::string_view s);
[[nodiscard]] std::vector<std::string_view> split(std::string_view s, char separator);
[[nodiscard]] std::string join(std::span<const std::string> words, std::string_view separator);
/// "a, b and c"
[[nodiscard]] std::string enumerate(std::span<const std::string> words);
/// "a, b and 7 more": at most `most` of the words.
[[nodiscard]] std::string enumerate_some(std::span<const std::string> words, std::size_t most);

/// The candidate nearest to `word` (edit distance, ignoring case), if it is a likely misspelling.
[[nodiscard]] std::optional<std::string> nearest(std::string_view word,
                                                 std::span<const std::string> candidates);
/// `Did you mean "x"?` or "" .
[[nodiscard]] std::string did_you_mean(std::string_view word,
                                       std::span<const std::string> candidates);

}  // namespace robomosp::text
