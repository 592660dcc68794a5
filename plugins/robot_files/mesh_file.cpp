// SPDX-License-Identifier: Apache-2.0
#include "mesh_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>

#include "files.h"
#include "spatial/convex_hull.h"
#include "spatial/mass.h"
#include "spatial/stl_form.h"
#include "spatial/surface_moments.h"
#include "spatial/vec.h"

namespace robomosp::robot_files {
namespace {

constexpr std::uintmax_t kMostMeshBytes = std::uintmax_t{256} << 20;
constexpr double kLeastVolume = 1e-15;  ///< MuJoCo's

Error broken(std::string what) {
  return error(ErrorCode::syntax, std::move(what), "Check that it is complete.");
}

template <class T>
T at(std::string_view bytes, std::size_t offset) {
  T out;
  std::memcpy(&out, bytes.data() + offset, sizeof out);
  return out;
}

bool is_fine(float x) { return std::isfinite(x); }

Result<MeshFile> parse_binary_stl(std::string_view bytes) {
  MeshFile m;
  const auto count = std::size_t{at<std::uint32_t>(bytes, 80)};
  if ((bytes.size() - spatial::kStlHead) / spatial::kStlTriangle < count)
    return broken("it should hold " + std::to_string(count) +
                  " triangles but is too short for them");
  for (std::size_t t = 0; t < count; ++t)
    for (std::size_t k = 0; k < 9; ++k) {
      const auto x = at<float>(bytes, spatial::kStlHead + spatial::kStlTriangle * t + 12 + 4 * k);
      if (!is_fine(x)) return broken("a corner is not a finite number");
      m.points.push_back(static_cast<double>(x));
    }
  for (std::uint32_t v = 0; v < 3 * count; ++v) m.triangles.push_back(v);
  return m;
}

/// The next word of a text, "" at its end.
std::string_view next_word(std::string_view& text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return text = {};
  text.remove_prefix(first);
  const std::string_view word = text.substr(0, text.find_first_of(kBlank));
  text.remove_prefix(word.size());
  return word;
}

std::optional<double> number_of(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double x = 0;
  const auto r = std::from_chars(word.data(), word.data() + word.size(), x);
  if (r.ec != std::errc() || r.ptr != word.data() + word.size() || !std::isfinite(x))
    return std::nullopt;
  return x;
}

Result<MeshFile> parse_text_stl(std::string_view text) {
  MeshFile m;
  for (std::string_view word = next_word(text); !word.empty(); word = next_word(text)) {
    if (word != "vertex") continue;
    for (int k = 0; k < 3; ++k) {
      const auto x = number_of(next_word(text));
      if (!x) return broken("a corner is not a finite number");
      m.points.push_back(*x);
    }
  }
  const auto corners = static_cast<std::uint32_t>(m.points.size() / 9 * 3);
  for (std::uint32_t v = 0; v < corners; ++v) m.triangles.push_back(v);
  return m;
}

Result<MeshFile> parse_obj(std::string_view text) {
  MeshFile m;
  std::vector<std::uint32_t> face;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string_view kind = next_word(line);
    if (kind == "v") {
      for (int k = 0; k < 3; ++k) {
        const auto x = number_of(next_word(line));
        if (!x) return broken("a corner is not a finite number");
        m.points.push_back(*x);
      }
    } else if (kind == "f") {
      face.clear();
      const auto count = static_cast<std::int64_t>(m.points.size() / 3);
      for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
        word = word.substr(0, word.find('/'));
        std::int64_t i = 0;
        const auto r = std::from_chars(word.data(), word.data() + word.size(), i);
        if (r.ec != std::errc()) return broken("a face has no corners");
        i = i < 0 ? count + i : i - 1;
        if (i < 0 || i >= count) return broken("a face refers to a missing corner");
        face.push_back(static_cast<std::uint32_t>(i));
      }
      for (std::size_t k = 2; k < face.size(); ++k)
        m.triangles.insert(m.triangles.end(), {face[0], face[k - 1], face[k]});
    }
  }
  return m;
}

/// Numbers of corners, normals, texture places and triangles; then these.
Result<MeshFile> parse_msh(std::string_view bytes) {
  std::array<std::int64_t, 4> n{};
  if (bytes.size() < 16) return broken("it is cut off");
  for (std::size_t k = 0; k < 4; ++k) {
    n[k] = at<std::int32_t>(bytes, 4 * k);
    if (n[k] < 0) return broken("it has a negative number of corners or triangles");
  }
  const std::int64_t wanted = 16 + 12 * n[0] + 12 * n[1] + 8 * n[2] + 12 * n[3];
  if (static_cast<std::int64_t>(bytes.size()) != wanted) return broken("it is cut off or too long");
  MeshFile m;
  for (std::int64_t i = 0; i < 3 * n[0]; ++i) {
    const auto x = at<float>(bytes, static_cast<std::size_t>(16 + 4 * i));
    if (!is_fine(x)) return broken("a corner is not a finite number");
    m.points.push_back(static_cast<double>(x));
  }
  const auto faces = static_cast<std::size_t>(wanted - 12 * n[3]);
  for (std::size_t i = 0; i < static_cast<std::size_t>(3 * n[3]); ++i) {
    const auto v = at<std::int32_t>(bytes, faces + 4 * i);
    if (v < 0 || v >= n[0]) return broken("a triangle refers to a missing corner");
    m.triangles.push_back(static_cast<std::uint32_t>(v));
  }
  return m;
}

Vec3 corner(const MeshFile& m, std::size_t triangle, std::size_t k, const Vec3& size) {
  const double* p = m.points.data() + 3 * std::size_t{m.triangles[3 * triangle + k]};
  return {p[0] * size[0], p[1] * size[1], p[2] * size[2]};
}

MassProperties of_moments(const Moments& m) { return spatial::mass_properties(m, 1); }

/// Sums of pyramids or, for a shell, of triangles about a point; weights are what each counts.
struct Sum {
  double total = 0;
  Vec3 first{};
  Sym3 second{};
};

/// Adds the triangle a, b, c (3 corners) or its pyramid over the origin (4), which counts `weight`.
void add_simplex(Sum& s, const Vec3& a, const Vec3& b, const Vec3& c, int corners, double weight) {
  const Vec3 sum = spatial::add(a, spatial::add(b, c));
  s.total += weight;
  s.first = spatial::add(s.first, spatial::scale(sum, weight / corners));
  const auto second = [&](std::size_t i, std::size_t j) {
    return weight / (corners * (corners + 1)) *
           (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + sum[i] * sum[j]);
  };
  s.second = spatial::add(s.second, {second(0, 0), second(1, 1), second(2, 2), second(0, 1),
                                     second(1, 2), second(0, 2)});
}

/// The triangles about a point, with what each counts: its pyramid, or its area for a shell.
Sum summed(const MeshFile& m, const Vec3& size, const Vec3& about, bool is_shell) {
  Sum s;
  for (std::size_t t = 0; t < m.triangles.size() / 3; ++t) {
    const Vec3 a = spatial::sub(corner(m, t, 0, size), about),
               b = spatial::sub(corner(m, t, 1, size), about),
               c = spatial::sub(corner(m, t, 2, size), about);
    if (is_shell)
      add_simplex(s, a, b, c, 3,
                  spatial::norm(spatial::cross(spatial::sub(b, a), spatial::sub(c, a))) / 2);
    else add_simplex(s, a, b, c, 4, std::fabs(spatial::dot(a, spatial::cross(b, c)) / 6));
  }
  return s;
}

/// About the point that the sum was made about, which becomes the centre of mass.
MassProperties about(const Sum& s, const Vec3& point) {
  MassProperties m;
  m.mass = s.total;
  m.com = point;
  m.inertia = {s.second.yy + s.second.zz,
               s.second.xx + s.second.zz,
               s.second.xx + s.second.yy,
               -s.second.xy,
               -s.second.yz,
               -s.second.xz};
  return m;
}

}  // namespace

Result<MeshFile> parse_mesh(std::string_view bytes, std::string_view extension) {
  if (extension == "stl") {
    if (spatial::is_text_stl(bytes)) return parse_text_stl(bytes);
    if (bytes.size() < spatial::kStlHead) return broken("it is not STL");
    return parse_binary_stl(bytes);
  }
  if (extension == "obj") return parse_obj(bytes);
  if (extension == "msh") return parse_msh(bytes);
  return error(
      ErrorCode::unsupported,
      "\"." + std::string(extension.substr(0, 20)) + "\" is not a mesh format that MuJoCo supports",
      "Use STL, OBJ or MSH.");
}

Result<MeshFile> read_mesh_file(const std::filesystem::path& file) {
  const auto bytes = files::read(file, kMostMeshBytes);
  if (!bytes.ok()) return broken("it has more than 256 MiB or cannot be read");
  std::string extension = file.extension().string();
  if (!extension.empty()) extension.erase(0, 1);
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
  return parse_mesh(*bytes, extension);
}

std::optional<MassProperties> MeshMasses::of(const std::string& file, const Vec3& size,
                                             MeshInertia rule) {
  const auto [it, is_new] = known_.try_emplace(Key{file, size, rule});
  if (!is_new) return it->second;
  if (const auto mesh = read_mesh_file(file); mesh.ok()) it->second = mesh_mass(*mesh, size, rule);
  return it->second;
}

std::optional<MassProperties> mesh_mass(const MeshFile& mesh, const Vec3& size, MeshInertia rule) {
  if (mesh.triangles.empty()) return std::nullopt;
  if (rule == MeshInertia::exact || rule == MeshInertia::convex) {
    std::vector<double> points = mesh.points;
    for (std::size_t i = 0; i < points.size(); ++i) points[i] *= size[i % 3];
    std::vector<std::uint32_t> triangles = mesh.triangles;
    if (rule == MeshInertia::convex) {
      std::vector<Vec3> corners;
      for (std::size_t i = 0; i + 2 < points.size(); i += 3)
        corners.push_back({points[i], points[i + 1], points[i + 2]});
      const auto hull = spatial::convex_hull(corners);
      if (!hull) return std::nullopt;
      points.clear();
      triangles.clear();
      for (const Vec3& p : hull->points) points.insert(points.end(), p.begin(), p.end());
      for (const auto& t : hull->triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    }
    const auto m = spatial::surface_moments(points, triangles);
    if (!(m.moments.volume > kLeastVolume)) return std::nullopt;
    return of_moments(m.moments);
  }
  const Sum surface = summed(mesh, size, {}, true);
  if (!(surface.total > kLeastVolume)) return std::nullopt;
  const Vec3 middle = spatial::scale(surface.first, 1 / surface.total);
  if (rule == MeshInertia::shell) return about(summed(mesh, size, middle, true), middle);
  const Sum first = summed(mesh, size, middle, false);
  if (!(first.total > kLeastVolume)) return std::nullopt;
  const Vec3 com = spatial::add(middle, spatial::scale(first.first, 1 / first.total));
  return about(summed(mesh, size, com, false), com);
}

}  // namespace robomosp::robot_files
