// SPDX-License-Identifier: Apache-2.0
#include "kernel/fingerprint.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace robomosp {
namespace {

// Mixing constants and final avalanche of MurmurHash3 x64-128 (A. Appleby, public domain); here
// every 64-bit word enters both lanes. Not meant to withstand an adversary.
constexpr std::uint64_t kC1 = 0x87c37b91114253d5ULL, kC2 = 0x4cf5ad432745937fULL;

enum Tag : std::uint64_t { kDomain = 1, kText, kReal, kInteger, kBoolean, kReals, kNested };

std::uint64_t avalanche(std::uint64_t k) {
  k ^= k >> 33;
  k *= 0xff51afd7ed558ccdULL;
  k ^= k >> 33;
  k *= 0xc4ceb9fe1a85ec53ULL;
  return k ^ (k >> 33);
}

std::uint64_t canonical(double v) {
  if (v == 0) v = 0;  // -0 too
  if (std::isnan(v)) v = std::numeric_limits<double>::quiet_NaN();
  return std::bit_cast<std::uint64_t>(v);
}

}  // namespace

std::string Fingerprint::hex() const {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string s(32, '0');
  for (std::size_t i = 0; i < 16; ++i) {
    s[15 - i] = kDigits[(hi >> (4 * i)) & 15];
    s[31 - i] = kDigits[(lo >> (4 * i)) & 15];
  }
  return s;
}

Fingerprinter::Fingerprinter(std::string_view domain)
    : a_(0x9e3779b97f4a7c15ULL), b_(0xc2b2ae3d27d4eb4fULL) {
  word(kDomain << 56 | domain.size());
  bytes(domain.data(), domain.size());
}

void Fingerprinter::word(std::uint64_t w) {
  a_ ^= std::rotl(w * kC1, 31) * kC2;
  a_ = (std::rotl(a_, 27) + b_) * 5 + 0x52dce729;
  b_ ^= std::rotl(w * kC2, 33) * kC1;
  b_ = (std::rotl(b_, 31) + a_) * 5 + 0x38495ab5;
  ++length_;
}

void Fingerprinter::bytes(const void* data, std::size_t size) {
  const auto* p = static_cast<const unsigned char*>(data);
  for (; size >= 8; p += 8, size -= 8) {
    std::uint64_t w = 0;
    std::memcpy(&w, p, 8);
    word(w);
  }
  if (size == 0) return;
  std::uint64_t w = 0;  // zero padding is unambiguous: the size was framed before
  std::memcpy(&w, p, size);
  word(w);
}

Fingerprinter& Fingerprinter::add(std::string_view s) {
  word(kText << 56 | s.size());
  bytes(s.data(), s.size());
  return *this;
}
Fingerprinter& Fingerprinter::add(double v) {
  word(kReal << 56);
  word(canonical(v));
  return *this;
}
Fingerprinter& Fingerprinter::add(std::int64_t v) {
  word(kInteger << 56);
  word(static_cast<std::uint64_t>(v));
  return *this;
}
Fingerprinter& Fingerprinter::add(bool v) {
  word(kBoolean << 56 | (v ? 1U : 0U));
  return *this;
}
Fingerprinter& Fingerprinter::add(std::span<const double> values) {
  word(kReals << 56 | values.size());
  for (const double v : values) word(canonical(v));
  return *this;
}
Fingerprinter& Fingerprinter::add(const Fingerprint& f) {
  word(kNested << 56);
  word(f.hi);
  word(f.lo);
  return *this;
}

Fingerprint Fingerprinter::finish() const {
  std::uint64_t a = a_ ^ length_, b = b_ ^ length_;
  a += b;
  b += a;
  a = avalanche(a);
  b = avalanche(b);
  a += b;
  b += a;
  return {a, b};
}

}  // namespace robomosp
