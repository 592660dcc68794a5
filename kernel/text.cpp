// SPDX-License-Identifier: Apache-2.0
#include "kernel/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

#include "kernel/fault.h"

namespace robomosp::text {
namespace {

constexpr bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v';
}
constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Edit distance with swaps of neighbours counted as one, case-blind; stops at `limit` + 1.
std::size_t edit_distance(std::string_view a, std::string_view b, std::size_t limit) {
  const std::size_t gap = a.size() > b.size() ? a.size() - b.size() : b.size() - a.size();
  if (gap > limit) return limit + 1;
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    std::size_t least = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0U : 1U)});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
          lower(a[i - 2]) == lower(b[j - 1]))
        row[j] = std::min(row[j], before[j - 2] + 1);
      least = std::min(least, row[j]);
    }
    if (least > limit) return limit + 1;
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

bool starts_with_blind(std::string_view s, std::string_view start) {
  return s.size() >= start.size() &&
         std::equal(start.begin(), start.end(), s.begin(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace

std::string print(double v) {
  if (v == 0) return "0";
  if (std::isnan(v)) return "nan";
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), v);
  return {buffer.data(), end.ptr};
}

std::string print_rounded(double v, int digits) {
  if (v == 0) return "0";
  if (!std::isfinite(v)) return print(v);
  // Where exponents begin: people read 100000 and 0.0001 more easily than 1e+05 and 1e-04.
  constexpr double kLargest = 1e15, kSmallest = 1e-5;
  std::array<char, 64> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), v,
                                 std::chars_format::scientific, std::clamp(digits, 1, 17) - 1);
  // Through the rounded value, so that the text is also the shortest one of that value.
  double rounded = v;
  std::from_chars(buffer.data(), end.ptr, rounded);
  const double size = std::fabs(rounded);
  const bool has_exponent = size < kSmallest || size >= kLargest;
  const auto shown =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), rounded,
                    has_exponent ? std::chars_format::scientific : std::chars_format::fixed);
  return {buffer.data(), shown.ptr};
}

std::string print_fixed(double v, int decimals) {
  if (!std::isfinite(v)) return print(v);
  std::array<char, 400> buffer;  // 309 digits of the greatest double, and the decimals
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), v,
                                 std::chars_format::fixed, std::clamp(decimals, 0, 50));
  std::string out(buffer.data(), end.ptr);
  if (out.find_first_not_of("-0.") == std::string::npos && out[0] == '-') out.erase(0, 1);
  return out;
}

std::optional<double> read_real(std::string_view s) {
  if (s.size() > 1 && s[0] == '+' && s[1] != '-' && s[1] != '+') s.remove_prefix(1);
  double v = 0;
  const auto end = std::from_chars(s.data(), s.data() + s.size(), v);
  if (s.empty() || end.ec != std::errc() || end.ptr != s.data() + s.size()) return std::nullopt;
  return v;
}

std::optional<std::int64_t> read_int(std::string_view s) {
  if (s.size() > 1 && s[0] == '+' && s[1] != '-' && s[1] != '+') s.remove_prefix(1);
  std::int64_t v = 0;
  const auto end = std::from_chars(s.data(), s.data() + s.size(), v);
  if (s.empty() || end.ec != std::errc() || end.ptr != s.data() + s.size()) return std::nullopt;
  return v;
}

std::string quote(std::string_view s) {
  std::string out = "\"";
  for (const char c : s) {
    switch (c) {
      case '"': out += "\\\""; break;
      case '\\': out += "\\\\"; break;
      case '\n': out += "\\n"; break;
      case '\t': out += "\\t"; break;
      case '\r': out += "\\r"; break;
      default: out += c;
    }
  }
  return out + '"';
}

std::string visible(std::string_view s) {
  static constexpr char kDigits[] = "0123456789abcdef";
  const auto byte = [&](std::size_t i) {
    return i < s.size() ? static_cast<unsigned char>(s[i]) : 0U;
  };
  std::string out;
  out.reserve(s.size());
  for (std::size_t i = 0; i < s.size(); ++i) {
    const unsigned c = byte(i);
    // In UTF-8 the control characters from 0x80 to 0x9f are 0xc2 and that byte; by itself none of
    // them begins a character.
    const bool is_pair = c == 0xC2 && byte(i + 1) >= 0x80 && byte(i + 1) < 0xA0;
    const unsigned before = i > 0 ? byte(i - 1) : 0U;
    const bool is_stray = c >= 0x80 && c < 0xA0 && before < 0x80;
    if (!is_pair && !is_stray && ((c >= 0x20 && c != 0x7F) || c == '\n' || c == '\t')) {
      out += s[i];
      continue;
    }
    const unsigned code = is_pair ? byte(++i) : c;
    out += "\\x";
    out += kDigits[code >> 4];
    out += kDigits[code & 15U];
  }
  return out;
}

namespace {

/// The first bytes of a text, whole characters.
std::string_view first_bytes(std::string_view s, std::size_t n) {
  while (n > 0 && n < s.size() && (static_cast<unsigned char>(s[n]) & 0xC0U) == 0x80U) --n;
  return s.substr(0, n);
}
std::string_view last_bytes(std::string_view s, std::size_t n) {
  std::size_t from = s.size() - std::min(n, s.size());
  while (from < s.size() && (static_cast<unsigned char>(s[from]) & 0xC0U) == 0x80U) ++from;
  return s.substr(from);
}

constexpr std::size_t kLongQuote = 160;  // bytes of a quoted text that are worth cutting

}  // namespace

std::string shortened(std::string s, std::size_t most) {
  if (s.size() <= most) return s;
  std::string out;
  for (std::size_t i = 0; i < s.size();) {
    if (s[i] != '"') {
      out += s[i++];
      continue;
    }
    std::size_t end = i + 1;
    while (end < s.size() && s[end] != '"') end += s[end] == '\\' ? 2 : 1;
    end = std::min(end + 1, s.size());
    const std::string_view quoted = std::string_view(s).substr(i, end - i);
    if (quoted.size() <= kLongQuote) {
      out += quoted;
    } else {
      out += first_bytes(quoted, kLongQuote / 2);
      out += "...\" (" + std::to_string(quoted.size() - 2) + " bytes)";
    }
    i = end;
  }
  if (out.size() <= most) return out;
  const std::size_t tail = std::min<std::size_t>(most / 4, 200);
  std::string cut(first_bytes(out, most - tail));
  cut += " ... ";
  cut += last_bytes(out, tail);
  return cut;
}

Error shortened(Error e) {
  edit_texts(e, [](std::string s) { return shortened(std::move(s)); });
  return e;
}

std::string_view trim(std::string_view s) {
  while (!s.empty() && is_space(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_space(s.back())) s.remove_suffix(1);
  return s;
}

std::vector<std::string_view> split(std::string_view s, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto at = s.find(separator);
    parts.push_back(s.substr(0, at));
    if (at == std::string_view::npos) return parts;
    s.remove_prefix(at + 1);
  }
}

std::string join(std::span<const std::string> words, std::string_view separator) {
  std::string out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i) out += separator;
    out += words[i];
  }
  return out;
}

std::string enumerate(std::span<const std::string> words) {
  if (words.size() < 2) return words.empty() ? std::string() : words[0];
  return join(words.first(words.size() - 1), ", ") + " and " + words.back();
}

std::string enumerate_some(std::span<const std::string> words, std::size_t most) {
  if (words.size() <= most) return enumerate(words);
  std::vector<std::string> some(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(most));
  some.push_back(std::to_string(words.size() - most) + " more");
  return enumerate(some);
}

std::optional<std::string> nearest(std::string_view word, std::span<const std::string> candidates) {
  if (word.empty()) return std::nullopt;
  const std::size_t limit = std::max<std::size_t>(1, word.size() / 3);
  const std::string* best = nullptr;
  std::size_t best_distance = limit + 1;
  for (const std::string& c : candidates) {
    std::size_t d = edit_distance(word, c, limit);
    // A word of which nothing stays is no near miss ("x" for "y").
    if (d >= std::max(word.size(), c.size())) d = limit + 1;
    if (d < best_distance) {
      best = &c;
      best_distance = d;
    }
  }
  if (best) return *best;
  for (const std::string& c : candidates)
    if (word.size() >= 2 && starts_with_blind(c, word)) return c;
  return std::nullopt;
}

std::string did_you_mean(std::string_view word, std::span<const std::string> candidates) {
  const auto near = nearest(word, candidates);
  return near ? "Did you mean " + quote(*near) + "?" : std::string();
}

}  // namespace robomosp::text
