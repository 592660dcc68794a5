// SPDX-License-Identifier: Apache-2.0
#include "io/geometry.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "io/native.h"
#include "kernel/fingerprint.h"
#include "kernel/text.h"

namespace robomosp::io {

namespace {

namespace fs = std::filesystem;
using text::quote;

static_assert(std::endian::native == std::endian::little, "PLY is written as it is in memory");

constexpr std::size_t kHeadBytes = 4096;       ///< in which a file must tell what it is
constexpr std::size_t kFaceBytes = 1 + 3 * 4;  ///< a triangle in the file
constexpr std::size_t kVertexBytes = 3 * 8;

Error broken(std::string message, std::string hint = {}) {
  return error(ErrorCode::syntax, std::move(message), std::move(hint));
}

std::array<std::uint64_t, 2> digest_of(const CsgGeometry& g) {
  Fingerprinter fp("geometry/1");
  fp.add(static_cast<int>(g.form));
  if (g.form == CsgGeometry::Form::brep) {
    fp.add(std::string_view(g.brep));
  } else {
    fp.add(std::span<const double>(g.points));
    fp.add(std::string_view(reinterpret_cast<const char*>(g.triangles.data()),
                            g.triangles.size() * sizeof(std::uint32_t)));
    if (g.deviation > 0) fp.add(g.deviation);
  }
  const Fingerprint f = fp.finish();
  return {f.hi, f.lo};
}

Result<void> check_brep(const CsgGeometry& g) {
  if (g.brep.find('\0') != std::string::npos)
    return broken("the B-rep is binary, not text", "Write it in the text form of BREP.");
  if (std::string_view(g.brep).substr(0, kHeadBytes).find("CASCADE Topology V") ==
      std::string_view::npos)
    return broken("this is not a B-rep in the text form of Open CASCADE",
                  "Its first lines say \"CASCADE Topology V1\" or later.");
  return {};
}

Result<void> check_mesh(const CsgGeometry& g) {
  if (g.points.size() % 3 != 0 || g.triangles.size() % 3 != 0)
    return broken("the mesh has an incomplete point or triangle");
  if (g.triangles.empty()) return broken("the mesh has no triangles");
  if (!(g.deviation >= 0) || !std::isfinite(g.deviation))
    return broken("the deviation of the mesh is not a number of 0 m or more");
  const std::size_t points = g.points.size() / 3;
  if (points > std::numeric_limits<std::uint32_t>::max())
    return broken("the mesh has more points than can be counted in 32 bits");
  for (std::size_t i = 0; i < g.points.size(); ++i)
    if (!std::isfinite(g.points[i]))
      return broken("point " + std::to_string(i / 3) + " of the mesh is not finite");
  for (std::size_t t = 0; t < g.triangles.size(); t += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = g.triangles[t + k], b = g.triangles[t + (k + 1) % 3];
      if (a >= points)
        return broken("triangle " + std::to_string(t / 3) + " of the mesh refers to point " +
                      std::to_string(a) + " of " + std::to_string(points));
      if (a == b)
        return broken("triangle " + std::to_string(t / 3) + " of the mesh has point " +
                      std::to_string(a) + " twice");
    }
  }
  return {};
}

/// The next line of a PLY header, without its end; nullopt when there is none.
std::optional<std::string_view> next_line(std::string_view bytes, std::size_t& at) {
  const std::size_t end = bytes.substr(0, std::min(bytes.size(), kHeadBytes)).find('\n', at);
  if (end == std::string_view::npos) return std::nullopt;
  std::string_view line = bytes.substr(at, end - at);
  at = end + 1;
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// `element vertex 12` -> 12
std::optional<std::size_t> count_after(std::string_view line, std::string_view start) {
  if (!line.starts_with(start)) return std::nullopt;
  const auto n = text::read_int(line.substr(start.size()));
  if (!n || *n < 0 || *n > std::int64_t{0xFFFFFFFF}) return std::nullopt;
  return static_cast<std::size_t>(*n);
}

/// Of the triangles from the curved solid that they stand for, in metres; where they are it, none.
constexpr std::string_view kDeviation = "comment deviation ";

constexpr std::string_view kHeaderHint =
    "It must be as robomosp writes it: binary little-endian, vertices with double x, y, z, then "
    "triangles; import other PLY files instead.";

Result<CsgGeometry> read_ply(std::string_view bytes) {
  const auto refuse = [](std::string message) {
    return broken(std::move(message), std::string(kHeaderHint));
  };
  std::vector<std::string_view> lines;
  double deviation = 0;
  std::size_t at = 0;
  for (;;) {
    const auto line = next_line(bytes, at);
    if (!line || (lines.empty() && *line != "ply")) return refuse("this is not a PLY file");
    if (line->starts_with(kDeviation)) {
      const auto number = text::read_real(line->substr(kDeviation.size()));
      if (!number) return refuse("the deviation in the header is not a number");
      deviation = *number;
    }
    if (line->starts_with("comment")) continue;
    lines.push_back(*line);
    if (*line == "end_header") break;
  }
  if (lines.size() != 9 || lines[1] != "format binary_little_endian 1.0" ||
      lines[3] != "property double x" || lines[4] != "property double y" ||
      lines[5] != "property double z" ||
      (lines[7] != "property list uchar uint vertex_indices" &&
       lines[7] != "property list uchar int vertex_indices"))
    return refuse("the header of this PLY file is not that of a robomosp mesh");
  const auto vertices = count_after(lines[2], "element vertex ");
  const auto faces = count_after(lines[6], "element face ");
  if (!vertices || !faces)
    return refuse("the counts in the header of this PLY file are not numbers");
  const std::size_t wanted = *vertices * kVertexBytes + *faces * kFaceBytes;
  if (bytes.size() - at != wanted)
    return broken("the file has " + std::to_string(bytes.size() - at) +
                      " bytes after its header, but " + std::to_string(*vertices) +
                      " vertices and " + std::to_string(*faces) + " triangles need " +
                      std::to_string(wanted),
                  "It is truncated or does not contain triangles only.");
  CsgGeometry g;
  g.form = CsgGeometry::Form::mesh;
  g.deviation = deviation;
  g.points.resize(3 * *vertices);
  g.triangles.resize(3 * *faces);
  if (*vertices > 0) std::memcpy(g.points.data(), bytes.data() + at, *vertices * kVertexBytes);
  at += *vertices * kVertexBytes;
  for (std::size_t f = 0; f < *faces; ++f, at += kFaceBytes) {
    if (bytes[at] != 3)
      return broken("face " + std::to_string(f) + " of the mesh is not a triangle");
    std::memcpy(g.triangles.data() + 3 * f, bytes.data() + at + 1, kFaceBytes - 1);
  }
  return g;
}

}  // namespace

std::string_view geometry_extension(CsgGeometry::Form form) {
  return form == CsgGeometry::Form::brep ? ".brep" : ".ply";
}

Result<GeometryPtr> make_geometry(CsgGeometry g) {
  if (g.form == CsgGeometry::Form::brep) {
    RMP_TRY(check_brep(g));
  } else {
    RMP_TRY(check_mesh(g));
  }
  g.digest = digest_of(g);
  return std::make_shared<const CsgGeometry>(std::move(g));
}

Result<std::string> geometry_bytes(const CsgGeometry& g) {
  if (g.form == CsgGeometry::Form::brep) return g.brep;
  const std::size_t vertices = g.points.size() / 3, faces = g.triangles.size() / 3;
  std::string out =
      "ply\nformat binary_little_endian 1.0\ncomment robomosp mesh 1, metres\n" +
      (g.deviation > 0 ? std::string(kDeviation) + text::print(g.deviation) + "\n" : "") +
      "element vertex " + std::to_string(vertices) +
      "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
      std::to_string(faces) + "\nproperty list uchar uint vertex_indices\nend_header\n";
  const std::size_t size = out.size() + vertices * kVertexBytes + faces * kFaceBytes;
  if (size > kMostGeometryBytes)
    return error(ErrorCode::unsupported, "the mesh takes " + std::to_string(size) +
                                             " bytes; at most " +
                                             std::to_string(kMostGeometryBytes) + " are written");
  out.reserve(size);
  for (const double x : g.points) {
    const double plain = x + 0.0;  // -0 as 0: equal content, equal bytes
    out.append(reinterpret_cast<const char*>(&plain), sizeof plain);
  }
  for (std::size_t f = 0; f < faces; ++f) {
    out += '\3';
    out.append(reinterpret_cast<const char*>(g.triangles.data() + 3 * f), kFaceBytes - 1);
  }
  return out;
}

Result<GeometryPtr> parse_geometry(CsgGeometry::Form form, std::string bytes,
                                   const std::string& shown, std::string source) {
  const auto parse = [&]() -> Result<GeometryPtr> {
    CsgGeometry g;
    if (form == CsgGeometry::Form::mesh) {
      RMP_TRY_ASSIGN(g, read_ply(bytes));
    } else {
      g.form = form;
      g.brep = std::move(bytes);
    }
    g.source = std::move(source);
    return make_geometry(std::move(g));
  };
  auto parsed = parse();
  if (!parsed.ok()) return std::move(parsed).error().in(shown);
  return parsed;
}

Result<GeometryPtr> read_geometry(const fs::path& file, std::string source) {
  std::string extension = file.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  std::optional<CsgGeometry::Form> form;
  for (const auto each : {CsgGeometry::Form::brep, CsgGeometry::Form::mesh})
    if (extension == geometry_extension(each)) form = each;
  if (!form)
    return error(ErrorCode::unsupported,
                 quote(file.generic_string()) +
                     " is not a geometry file: it ends neither with "
                     ".brep nor with .ply",
                 "Import other formats first.");
  RMP_TRY_ASSIGN(std::string bytes, read_file(file, kMostGeometryBytes));
  return parse_geometry(*form, std::move(bytes), file.generic_string(), std::move(source));
}

std::string geometry_file_name(const fs::path& record, const CsgGeometry& g) {
  constexpr char kHex[] = "0123456789abcdef";
  std::string name = record.stem().string() + "-";
  for (int shift = 60; shift >= 0; shift -= 4) name += kHex[(g.digest[0] >> shift) & 0xFU];
  return name + std::string(geometry_extension(g.form));
}

}  // namespace robomosp::io
