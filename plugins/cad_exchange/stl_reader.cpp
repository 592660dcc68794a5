// SPDX-License-Identifier: Apache-2.0
#include "stl_reader.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include "spatial/stl_form.h"

namespace robomosp::cad_exchange {
namespace {

using spatial::kStlHead, spatial::kStlTriangle;

Error bad_stl(std::string message, std::string hint = "Check that the file is complete.") {
  return error(ErrorCode::syntax, std::move(message), std::move(hint));
}

std::uint32_t word(std::string_view bytes, std::size_t at) {
  std::uint32_t w = 0;
  for (std::size_t i = 0; i < 4; ++i)
    w |= std::uint32_t{static_cast<std::uint8_t>(bytes[at + i])} << (8 * i);
  return w;
}

void add_corner(Shape& s, const std::array<double, 3>& p) {
  s.triangles.push_back(static_cast<std::uint32_t>(s.points.size() / 3));
  s.points.insert(s.points.end(), p.begin(), p.end());
}

Result<std::vector<Shape>> read_binary(std::string_view bytes, double unit) {
  const std::size_t count = word(bytes, 80);
  Shape s;
  s.points.reserve(9 * count);
  s.triangles.reserve(3 * count);
  for (std::size_t t = 0; t < count; ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      std::array<double, 3> p{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t w = word(bytes, kStlHead + kStlTriangle * t + 12 + 12 * c + 4 * k);
        float f = 0;
        std::memcpy(&f, &w, 4);
        if (!std::isfinite(f))
          return bad_stl("triangle " + std::to_string(t + 1) +
                         " has a corner that is not a number");
        p[k] = static_cast<double>(f) * unit;
      }
      add_corner(s, p);
    }
  std::vector<Shape> all;
  if (count > 0) all.push_back(std::move(s));
  return all;
}

/// Words of a text with the line they stand in.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}
  std::string_view next() {
    while (at_ < text_.size() && is_blank(text_[at_])) line_ += text_[at_++] == '\n' ? 1U : 0U;
    const std::size_t start = at_;
    while (at_ < text_.size() && !is_blank(text_[at_])) ++at_;
    return text_.substr(start, at_ - start);
  }
  std::string_view rest_of_line() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view rest = text_.substr(at_, end - at_);
    at_ = end;
    while (!rest.empty() && is_blank(rest.front())) rest.remove_prefix(1);
    while (!rest.empty() && is_blank(rest.back())) rest.remove_suffix(1);
    return rest;
  }
  [[nodiscard]] std::size_t line() const { return line_; }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  std::string_view text_;
  std::size_t at_ = 0, line_ = 1;
};

bool same(std::string_view a, std::string_view b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
           return (x >= 'A' && x <= 'Z' ? static_cast<char>(x + 32) : x) == y;
         });
}

std::optional<double> stl_number(std::string_view s) {
  if (s.starts_with('+')) s.remove_prefix(1);
  double v = 0;
  const auto [end, failed] = std::from_chars(s.data(), s.data() + s.size(), v);
  if (failed != std::errc() || end != s.data() + s.size() || !std::isfinite(v)) return std::nullopt;
  return v;
}

Result<std::vector<Shape>> read_text(std::string_view bytes, double unit) {
  Words words(bytes);
  std::vector<Shape> all;
  Shape* solid = nullptr;
  std::size_t corners = 0;
  for (std::string_view w = words.next(); !w.empty(); w = words.next()) {
    const std::string line = " in line " + std::to_string(words.line());
    if (same(w, "solid")) {
      solid = &all.emplace_back();
      solid->name = std::string(words.rest_of_line().substr(0, 200));
    } else if (same(w, "facet") || same(w, "endsolid")) {
      words.rest_of_line();  // the normal follows from the corners
    } else if (same(w, "outer")) {
      words.next();
      corners = 0;
    } else if (same(w, "vertex")) {
      std::array<double, 3> p{};
      for (double& x : p) {
        const std::string_view text = words.next();
        const auto v = stl_number(text);
        if (!v)
          return bad_stl("\"" + std::string(text.substr(0, 40)) + "\"" + line + " is not a number");
        x = *v * unit;
      }
      if (!solid) solid = &all.emplace_back();
      add_corner(*solid, p);
      ++corners;
    } else if (same(w, "endloop")) {
      if (corners != 3)
        return bad_stl("the facet that ends" + line + " has " + std::to_string(corners) +
                       " corners, not 3");
    } else if (!same(w, "endfacet")) {
      return bad_stl("\"" + std::string(w.substr(0, 40)) + "\"" + line + " is not STL");
    }
  }
  for (const Shape& s : all)
    if (s.triangles.size() % 3 != 0) return bad_stl("the last facet is cut off");
  std::erase_if(all, [](const Shape& s) { return s.triangles.empty(); });
  return all;
}

}  // namespace

Result<std::vector<Shape>> read_stl(std::string_view bytes, double unit,
                                    std::vector<std::string>& notes) {
  const bool is_text = spatial::is_text_stl(bytes);
  if (!is_text) {
    if (bytes.size() < kStlHead) return bad_stl("the file is not STL");
    const std::size_t needed = kStlHead + kStlTriangle * std::size_t{word(bytes, 80)};
    if (bytes.size() < needed)
      return bad_stl("the file should hold " + std::to_string(word(bytes, 80)) +
                     " triangles but is too short for them");
    if (bytes.size() > needed)
      notes.push_back(std::to_string(bytes.size() - needed) +
                      " bytes after the last triangle were not read.");
  }
  RMP_TRY_ASSIGN(auto all, is_text ? read_text(bytes, unit) : read_binary(bytes, unit));
  if (all.empty()) return bad_stl("the file holds no triangles", "There is nothing to import.");
  return all;
}

}  // namespace robomosp::cad_exchange
