// SPDX-License-Identifier: Apache-2.0
#include "xml.h"

#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "documents.h"
#include "files.h"
#include "reach.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::robot_files {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && is_blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_blank(s.back())) s.remove_suffix(1);
  return s;
}

}  // namespace

std::string in_quotes(std::string_view s) {
  std::string out = "\"";
  for (const char c : s.substr(0, 80)) out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  return out + (s.size() > 80 ? "...\"" : "\"");
}

std::string place(const Element& e) {
  const Source* s = source_of(e);
  const std::string file = s && !s->name.empty() ? "file " + in_quotes(s->name) + ", " : "";
  return file + "line " + std::to_string(e.GetLineNum()) + ", <" +
         std::string(e.Name()).substr(0, 40) + ">";
}

Error fault(const Element& e, std::string message, std::string hint) {
  return error(ErrorCode::syntax, std::move(message), std::move(hint), place(e));
}

std::string_view word(const Element& e, const char* attribute) {
  const char* text = e.Attribute(attribute);
  return text ? trimmed(text) : std::string_view();
}

bool has(const Element& e, const char* attribute) { return e.Attribute(attribute) != nullptr; }

std::string_view inner(const Element& e) {
  const char* text = e.GetText();
  return text ? trimmed(text) : std::string_view();
}

Result<std::vector<double>> numbers(const Element& e, std::string_view text, std::string_view what,
                                    std::size_t most) {
  std::vector<double> out;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    std::size_t end = 0;
    while (end < text.size() && !is_blank(text[end])) ++end;
    std::string_view one = text.substr(0, end);
    text.remove_prefix(end);
    std::string_view digits = one;
    if (digits.size() > 1 && digits.front() == '+') digits.remove_prefix(1);
    double v = 0;
    const auto r = std::from_chars(digits.data(), digits.data() + digits.size(), v);
    if (r.ec != std::errc() || r.ptr != digits.data() + digits.size() || std::isnan(v))
      return fault(e, in_quotes(one) + " is not a number in " + std::string(what),
                   one.find("${") != std::string_view::npos || one.find("$(") != one.npos
                       ? "Expand it first: xacro robot.urdf.xacro > robot.urdf"
                       : "Correct the file.");
    if (std::isinf(v)) v = v > 0 ? 2 * kGreatest : -2 * kGreatest;  // only limits may be that great
    if (out.size() >= most)
      return fault(
          e, "there are more than " + std::to_string(most) + " numbers in " + std::string(what));
    out.push_back(v);
  }
  return out;
}

Result<void> read(const Element& e, std::string_view text, std::string_view what,
                  std::span<double> out) {
  RMP_TRY_ASSIGN(const std::vector<double> v, numbers(e, text, what));
  if (v.size() != out.size())
    return fault(e,
                 std::string(what) + " has " + std::to_string(v.size()) + " numbers, not " +
                     std::to_string(out.size()),
                 "Correct the file.");
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!(std::fabs(v[i]) <= kGreatest))
      return fault(e, "a number of " + std::string(what) + " is beyond 1e12", "Correct the file.");
    out[i] = v[i];
  }
  return {};
}

Result<double> number(const Element& e, const char* attribute, double otherwise) {
  if (!has(e, attribute)) return otherwise;
  RMP_TRY_ASSIGN(const std::vector<double> v, numbers(e, word(e, attribute), attribute));
  if (v.size() != 1)
    return fault(e, std::string(attribute) + " has " + std::to_string(v.size()) + " numbers, not 1",
                 "Correct the file.");
  return v[0];
}

Result<Vec3> vec3(const Element& e, const char* attribute, Vec3 otherwise) {
  if (has(e, attribute)) RMP_TRY(read(e, word(e, attribute), attribute, otherwise));
  return otherwise;
}

Result<Vec3> unit_vector(const Element& e, const Vec3& v) {
  const double length = spatial::norm(v);
  if (!(length > 1e-9)) return fault(e, "the axis has no direction", "Give it as 0 0 1.");
  // A unit vector is kept to the bit.
  if (std::fabs(length - 1) < 1e-15) return v;
  return spatial::scale(v, 1 / length);
}

std::array<double, 9> turn_z_to(const Vec3& to) {
  const Vec3 axis{0.0 - to[1], to[0], 0};
  const double sine = spatial::norm(axis);
  if (sine < 1e-12) return to[2] > 0 ? Pose{}.R : spatial::rotation_x(std::numbers::pi).R;
  return spatial::from_axis_angle(axis, std::atan2(sine, to[2]));
}

bool is_yes(std::string_view w, bool otherwise) {
  if (w == "true" || w == "1") return true;
  if (w == "false" || w == "0") return false;
  return otherwise;
}

namespace {
constexpr int kHighest = 32;  // folders above that are looked into
}

std::filesystem::path found_above(const std::filesystem::path& relative,
                                  const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::path above = std::filesystem::absolute(folder, failed);
  for (int k = 0; k < kHighest; ++k) {
    if (files::exists(above / relative)) return above / relative;
    if (above == above.parent_path()) break;
    above = above.parent_path();
  }
  return {};
}

namespace {

/// As mesh_file, with the URI as it stands.
std::filesystem::path file_as_written(std::string_view uri, const std::filesystem::path& folder,
                                      Reach& reach) {
  namespace fs = std::filesystem;
  std::error_code failed;
  const auto exists = [&](const fs::path& p) { return files::is_file(p); };
  if (uri.size() > 4096 || uri.find('\0') != std::string_view::npos) return {};
  const auto scheme = uri.find("://");
  const std::string_view kind = uri.substr(0, scheme == std::string_view::npos ? 0 : scheme);
  const std::string asked(uri);
  if (scheme == std::string_view::npos || kind == "file") {
    if (scheme != std::string_view::npos) uri.remove_prefix(scheme + 3);
    const fs::path p = fs::path(std::string(uri));
    const fs::path full = p.is_absolute() ? p : folder / p;
    // What is out of reach is not even asked whether it is there.
    if (!reach.allows(full)) {
      reach.refuse(asked);
      return {};
    }
    if (exists(full)) return full;
    // A URI that begins with a folder's name is looked for as one of a package is.
    if (scheme == std::string_view::npos || p.is_absolute()) return {};
  } else if (kind == "package" || kind == "model") {
    uri.remove_prefix(scheme + 3);
  } else {
    return {};
  }
  const fs::path in_package = fs::path(std::string(uri)).lexically_normal();
  if (in_package.empty() || in_package.is_absolute() || *in_package.begin() == "..") {
    reach.refuse(asked);
    return {};
  }
  fs::path alone;
  for (auto it = in_package.begin(); it != in_package.end(); ++it)
    if (it != in_package.begin()) alone /= *it;
  fs::path above = fs::absolute(folder, failed).lexically_normal();
  if (above.filename().empty()) above = above.parent_path();
  for (int k = 0; k < kHighest && above != above.parent_path(); ++k) {
    if (exists(above / in_package)) {
      reach.add(above / *in_package.begin());
      if (reach.allows(above / in_package)) return above / in_package;
      reach.refuse(asked);
      return {};
    }
    if (!alone.empty() && reach.allows(above / alone) && exists(above / alone))
      return above / alone;
    above = above.parent_path();
  }
  return {};
}

}  // namespace

std::string without_escapes(std::string_view uri) {
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'                     ? c - '0'
           : (c | 0x20) >= 'a' && (c | 0x20) <= 'f' ? (c | 0x20) - 'a' + 10
                                                    : -1;
  };
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const int high = uri[i] == '%' && i + 2 < uri.size() ? digit(uri[i + 1]) : -1,
              low = high < 0 ? -1 : digit(uri[i + 2]);
    const bool is_byte = low >= 0 && high + low > 0;  // a path has no zero byte
    out += !is_byte ? uri[i] : static_cast<char>(16 * high + low);
    if (is_byte) i += 2;
  }
  return out;
}

std::filesystem::path mesh_file(std::string_view uri, const std::filesystem::path& folder,
                                Reach& reach) {
  std::filesystem::path found = file_as_written(uri, folder, reach);
  if (found.empty())
    if (const std::string plain = without_escapes(uri); plain != uri)
      found = file_as_written(plain, folder, reach);
  return found;
}

void tell_missing(const std::set<std::string>& meshes, const Reach& reach,
                  std::vector<std::string>& notes) {
  constexpr std::size_t kMostNamed = 8;
  std::vector<std::string> names;
  for (const std::string& m : meshes)
    if (!reach.has_refused(m)) names.push_back(in_quotes(m));
  if (names.empty()) return;
  if (names.size() == 1) {
    notes.push_back("Mesh " + names[0] + " was not found; its shape was left out.");
    return;
  }
  std::string all;
  const std::size_t named = std::min(names.size(), kMostNamed);
  for (std::size_t i = 0; i < named; ++i)
    all += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  if (names.size() > named) all += " and " + std::to_string(names.size() - named) + " more";
  notes.push_back(std::to_string(names.size()) +
                  " meshes were not found, and their shapes were left out: " + all + ".");
}

}  // namespace robomosp::robot_files
