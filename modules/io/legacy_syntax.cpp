// SPDX-License-Identifier: Apache-2.0
#include "io/legacy_syntax.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <robomosp/sdk/utf8_text.h>

#include "kernel/text.h"

namespace robomosp::io {

namespace {

using text::quote;

constexpr std::size_t kMostNumbers = 1000;  ///< of a tuple

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f'; }
bool is_name_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_number(char c) { return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.'; }

std::size_t skip(std::string_view text, std::size_t at) {
  for (; at < text.size(); ++at) {
    if (is_blank(text[at])) continue;
    if (text[at] != '#') break;
    while (at + 1 < text.size() && text[at + 1] != '\n' && text[at + 1] != '\r') ++at;
  }
  return at;
}

}  // namespace

bool is_legacy(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const std::size_t at = skip(text, 0);
  if (at >= text.size()) return false;
  if (text[at] != '{') return text[at] == '"';
  const std::size_t name = skip(text, at + 1), end = text.find('"', name + 1);
  if (name >= text.size() || text[name] != '"' || end == std::string_view::npos) return false;
  const std::size_t code = skip(text, end + 1);
  return code < text.size() && is_number(text[code]);
}

std::string to_utf8(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  return is_utf8(bytes) ? std::string(bytes) : utf8_from_latin1(bytes);
}

char LegacyReader::next() {
  at_ = static_cast<std::uint32_t>(skip(s_.text, at_));
  if (at_ >= s_.text.size()) return '\0';
  const char c = s_.text[at_];
  return is_number(c) ? '0' : is_name_letter(c) ? 'a' : c;
}

std::uint32_t LegacyReader::offset() {
  (void)next();
  return at_;
}

Error LegacyReader::unexpected(const char* wanted) {
  const char c = next();
  std::string found = "the file ends";
  if (c != '\0') {
    std::size_t end = at_ + 1;
    while (end < s_.text.size() && end - at_ < 20 && (is_name_letter(c) || is_number(c)) &&
           (is_name_letter(s_.text[end]) || is_number(s_.text[end])))
      ++end;
    while (end < s_.text.size() && (static_cast<unsigned char>(s_.text[end]) & 0xC0) == 0x80) ++end;
    found = "there is " + quote(s_.text.substr(at_, end - at_));
  }
  return at(at_, found + " where " + wanted + " should be");
}

Result<std::string> LegacyReader::text(const char* what) {
  if (next() != '"') return unexpected(what);
  const std::size_t end = s_.text.find('"', at_ + 1);
  if (end == std::string_view::npos) return at(at_, "the \" of " + std::string(what) + " is open");
  std::string out(s_.text.substr(at_ + 1, end - at_ - 1));
  at_ = static_cast<std::uint32_t>(end + 1);
  return out;
}

Result<double> LegacyReader::number(const char* what) {
  if (next() != '0') return unexpected(what);
  std::size_t end = at_;
  const auto is_part = [&](char c) { return is_number(c) || c == 'e' || c == 'E'; };
  while (end < s_.text.size() && is_part(s_.text[end])) ++end;
  std::string_view word = s_.text.substr(at_, end - at_);
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto value = robomosp::text::read_real(word);
  if (!value || !std::isfinite(*value)) return at(at_, quote(word) + " is not a number");
  at_ = static_cast<std::uint32_t>(end);
  return *value;
}

Result<std::int64_t> LegacyReader::whole(const char* what) {
  const std::uint32_t start = offset();
  RMP_TRY_ASSIGN(const double value, number(what));
  if (value != std::floor(value) || std::fabs(value) > 1e9)
    return at(start, std::string(what) + " is " + robomosp::text::print(value) +
                         "; it must be a whole number");
  return static_cast<std::int64_t>(value);
}

Result<std::string_view> LegacyReader::word(const char* what) {
  if (next() != 'a') return unexpected(what);
  std::size_t end = at_;
  while (end < s_.text.size() && (is_name_letter(s_.text[end]) || is_number(s_.text[end]))) ++end;
  const std::string_view out = s_.text.substr(at_, end - at_);
  at_ = static_cast<std::uint32_t>(end);
  return out;
}

bool LegacyReader::accept(char c) {
  if (next() != c) return false;
  ++at_;
  return true;
}

Result<void> LegacyReader::expect(char c, const char* what) {
  if (accept(c)) return {};
  return unexpected(what);
}

Result<std::vector<double>> LegacyReader::tuple(const char* what) {
  const std::uint32_t start = offset();
  RMP_TRY(expect('(', what));
  std::vector<double> out;
  while (!accept(')')) {
    if (!out.empty()) (void)accept(',');
    RMP_TRY_ASSIGN(const double value, number(what));
    out.push_back(value);
    if (out.size() > kMostNumbers) return at(start, std::string(what) + " has too many numbers");
  }
  return out;
}

Result<LegacyReader::Frame> LegacyReader::frame(const char* what) {
  const std::uint32_t start = offset();
  RMP_TRY_ASSIGN(const auto v, tuple(what));
  if (v.size() != 6)
    return at(start, std::string(what) + " has " + std::to_string(v.size()) + " numbers, not 6");
  const std::uint32_t codes = offset();
  RMP_TRY_ASSIGN(const auto position, whole("the position's type"));
  RMP_TRY_ASSIGN(const auto orientation, whole("the orientation's type"));
  RMP_TRY_ASSIGN(const auto reference, whole("the reference's type"));
  Frame out;
  model::Placement& p = out.placement;
  p.position = {metres(v[0]), metres(v[1]), metres(v[2])};
  switch (position) {
    case 0: break;
    case 1:
      p.coordinates = model::PositionRepresentation::cylindrical;
      p.position = {metres(v[0]), v[1] * kDegree, metres(v[2])};
      break;
    case 2:
      p.coordinates = model::PositionRepresentation::spherical;
      p.position = {metres(v[0]), v[1] * kDegree, v[2] * kDegree};
      break;
    default:
      return at(codes, "the position's type " + std::to_string(position) + " is not known",
                "0 is Cartesian, 1 cylindrical, 2 spherical.");
  }
  const Vec3 o{v[3] * kDegree, v[4] * kDegree, v[5] * kDegree};
  switch (orientation) {
    case 0:
      p.notation = model::AngleRepresentation::xyz;
      p.angles = o;
      break;
    case 1: {  // z, x', z'': Goldstein's x convention, which a placement has no notation for
      const auto turn = [](const Vec3& axis, double angle) {
        return spatial::from_axis_angle(axis, angle);
      };
      const auto product = [](const spatial::Matrix3& a, const spatial::Matrix3& b) {
        spatial::Matrix3 c{};
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t j = 0; j < 3; ++j) c[3 * i + k] += a[3 * i + j] * b[3 * j + k];
        return c;
      };
      p.angles = spatial::to_rpy(
          product(product(turn({0, 0, 1}, o[0]), turn({1, 0, 0}, o[1])), turn({0, 0, 1}, o[2])));
      break;
    }
    case 2:  // z, y', z'': his y convention
      p.notation = model::AngleRepresentation::zyz;
      p.angles = o;
      break;
    case 3:  // R = Rz(o1) Ry(o2) Rx(o3), after Paul
      p.angles = {o[2], o[1], o[0]};
      break;
    case 4:
      return at(codes,
                "the orientation's type 4 is the quaternion, and no known file shows how it is "
                "stored in the six numbers of a frame",
                "Convert it to type 3, roll-pitch-yaw, there.");
    default:
      return at(codes, "the orientation's type " + std::to_string(orientation) + " is not known",
                "0 is Euler XYZ, 1 Euler X, 2 Euler Y, 3 roll-pitch-yaw.");
  }
  if (reference != 0 && reference != 1)
    return at(codes, "the reference's type " + std::to_string(reference) + " is not known",
              "0 is local, 1 global.");
  out.is_global = reference == 1;
  return out;
}

Result<void> LegacyReader::units(std::initializer_list<Unit> kinds) {
  // In the order of their codes, from 0.
  constexpr std::array<double, 6> kMetres{1, 0.1, 0.01, 0.001, 0.3048, 0.0254};
  for (const Unit kind : kinds) {
    const std::uint32_t start = offset();
    const char* const word = kind == Unit::length ? "length"
                             : kind == Unit::mass ? "mass"
                                                  : "angle";
    RMP_TRY_ASSIGN(const auto code, whole(("the unit of " + std::string(word)).c_str()));
    const std::int64_t known = kind == Unit::length ? 6 : kind == Unit::mass ? 3 : 1;
    if (code < 0 || code >= known)
      return at(start, "the unit " + std::to_string(code) + " of " + word + " is not known",
                kind == Unit::length
                    ? "0 is metre, 1 decimetre, 2 centimetre, 3 millimetre, 4 foot, 5 inch."
                : kind == Unit::mass ? "0 is kilogram, 1 gram, 2 pound."
                                     : "Only 0 is: degree.");
    if (kind == Unit::length) metre_ = kMetres[static_cast<std::size_t>(code)];
  }
  return {};
}

}  // namespace robomosp::io
