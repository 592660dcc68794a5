// SPDX-License-Identifier: Apache-2.0
#include "kernel/base64.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace robomosp::base64 {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint32_t kNoDigit = 0x80000000U;

/// Both characters of every twelve bits.
constexpr auto kPairs = [] {
  std::array<char, std::size_t{2} * 4096> out{};
  for (std::size_t i = 0; i < 4096; ++i) {
    out[2 * i] = kDigits[i >> 6U];
    out[2 * i + 1] = kDigits[i & 63U];
  }
  return out;
}();

/// What a character adds at each of the four places of a group: bytes as they lie in memory, the
/// first lowest; kNoDigit of what is no digit.
constexpr auto kPlaces = [] {
  std::array<std::array<std::uint32_t, 256>, 4> out{};
  for (auto& place : out) place.fill(kNoDigit);
  for (std::uint32_t v = 0; v < 64; ++v) {
    const auto c = static_cast<unsigned char>(kDigits[v]);
    out[0][c] = v << 2U;
    out[1][c] = v >> 4U | (v & 15U) << 12U;
    out[2][c] = (v >> 2U) << 8U | (v & 3U) << 22U;
    out[3][c] = v << 16U;
  }
  return out;
}();

std::uint32_t group(const char* at) {
  const auto c = [at](std::size_t i) { return static_cast<unsigned char>(at[i]); };
  return kPlaces[0][c(0)] | kPlaces[1][c(1)] | kPlaces[2][c(2)] | kPlaces[3][c(3)];
}
// Sixteen characters at once, in the compiler's own vectors, which every processor has. Decoding is
// quicker by the tables: without shuffles of bytes the vectors take twice as long.
using Bytes = signed char __attribute__((vector_size(16)));
using Words = std::uint32_t __attribute__((vector_size(16)));

/// The characters of values 0..63 in their places.
Bytes digits_of(Bytes values) {
  const auto above = [&](signed char least, signed char offset) {
    return Bytes(values > least) & (Bytes{} + offset);
  };
  return values + 'A' + above(25, 'a' - 'Z' - 1) - above(51, 75) - above(61, 15) + above(62, 3);
}

void put(char* out, std::uint32_t three, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) out[k] = static_cast<char>(three >> (8 * k));
}

}  // namespace

void append(std::string& out, std::string_view bytes) {
  const std::size_t start = out.size(), whole = bytes.size() / 3;
  out.resize(start + (bytes.size() + 2) / 3 * 4);
  char* to = out.data() + start;
  const auto byte = [&](std::size_t i) {
    return i < bytes.size() ? std::uint32_t{static_cast<unsigned char>(bytes[i])} : 0U;
  };
  const auto three = [&](std::size_t i) {
    return byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
  };
  const auto pairs = [&](std::uint32_t v) {
    const char* first = &kPairs[std::size_t{2} * (v >> 12U)];
    const char* second = &kPairs[std::size_t{2} * (v & 4095U)];
    to[0] = first[0], to[1] = first[1], to[2] = second[0], to[3] = second[1];
    to += 4;
  };
  const auto* from = reinterpret_cast<const unsigned char*>(bytes.data());
  std::size_t i = 0;
  // Words are put together from bytes with the first lowest.
  constexpr bool kFast = std::endian::native == std::endian::little;
  for (; kFast && 3 * i + 13 <= bytes.size(); i += 4, from += 12, to += 16) {
    std::uint32_t lanes[4];
    for (std::size_t k = 0; k < 4; ++k) std::memcpy(&lanes[k], from + 3 * k, 4);
    Words x;
    std::memcpy(&x, lanes, sizeof x);
    const Words indices = ((x >> 2) & 0x3f) | ((x & 3) << 12) | ((x >> 4) & 0x0f00) |
                          ((x & 0x0f00) << 10) | ((x >> 6) & 0x030000) | ((x << 8) & 0x3f000000);
    const Bytes text = digits_of(reinterpret_cast<Bytes>(indices));
    std::memcpy(to, &text, sizeof text);
  }
  for (; i < whole; ++i, from += 3)
    pairs(std::uint32_t{from[0]} << 16U | std::uint32_t{from[1]} << 8U | from[2]);
  if (const std::size_t rest = bytes.size() % 3; rest > 0) {
    pairs(three(3 * whole));
    to[-1] = '=';
    if (rest == 1) to[-2] = '=';
  }
}

std::optional<std::size_t> decoded_size(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  if (text.empty()) return 0;
  const std::size_t padding = text.ends_with("==") ? 2 : text.ends_with('=') ? 1 : 0;
  return text.size() / 4 * 3 - padding;
}

bool decode(std::string_view text, char* out) {
  const auto size = decoded_size(text);
  if (!size) return false;
  std::uint32_t seen = 0;
  const std::size_t whole = *size / 3;
  const char* from = text.data();
  // Four bytes are written where there is room, of which the next group takes the last.
  std::size_t i = 0;
  for (; i + 1 < whole; ++i, from += 4, out += 3) {
    const std::uint32_t v = group(from);
    seen |= v;
    put(out, v, 4);
  }
  for (; i < whole; ++i, from += 4, out += 3) {
    const std::uint32_t v = group(from);
    seen |= v;
    put(out, v, 3);
  }
  if (const std::size_t rest = *size % 3; rest > 0) {
    const char last[4] = {from[0], from[1], rest == 2 ? from[2] : 'A', 'A'};
    const std::uint32_t v = group(last);
    seen |= v;
    if ((v >> (8 * rest)) != 0) return false;
    put(out, v, rest);
  }
  return (seen & kNoDigit) == 0;
}

}  // namespace robomosp::base64
