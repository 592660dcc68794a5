// SPDX-License-Identifier: Apache-2.0
// Fingerprint: 128-bit hash of canonical bytes, the key of every derived value (layer: core).
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace robomosp {

struct Fingerprint {
  std::uint64_t hi = 0, lo = 0;
  auto operator<=>(const Fingerprint&) const = default;
  [[nodiscard]] std::string hex() const;
};

/// Feeds typed values; each is framed (tag and length), so that no two sequences collide by
/// concatenation. Doubles by bits, with -0 as 0 and one NaN.
class Fingerprinter {
 public:
  explicit Fingerprinter(std::string_view domain);  ///< "mesh/1": what is being keyed
  Fingerprinter& add(std::string_view);
  Fingerprinter& add(const char* s) {
    return add(std::string_view(s));
  }  ///< else it would be a bool
  Fingerprinter& add(double);
  Fingerprinter& add(std::int64_t);
  Fingerprinter& add(int v) { return add(static_cast<std::int64_t>(v)); }
  Fingerprinter& add(std::size_t v) { return add(static_cast<std::int64_t>(v)); }
  Fingerprinter& add(bool);
  Fingerprinter& add(std::span<const double>);
  Fingerprinter& add(const Fingerprint&);
  [[nodiscard]] Fingerprint finish() const;

 private:
  void word(std::uint64_t w);
  void bytes(const void* data, std::size_t size);
  std::uint64_t a_, b_, length_ = 0;
};

}  // namespace robomosp

template <>
struct std::hash<robomosp::Fingerprint> {
  std::size_t operator()(const robomosp::Fingerprint& f) const noexcept {
    return static_cast<std::size_t>(f.hi ^ f.lo);
  }
};
