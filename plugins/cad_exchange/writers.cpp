// SPDX-License-Identifier: Apache-2.0
// Formats: Khronos glTF 2.0; 3MF Core Specification 1.2 in an OPC package (a ZIP whose files are
// stored); little-endian throughout.
#include "writers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <vector>

#include "spatial/pose.h"

namespace robomosp::cad_exchange {
namespace {

void put_u8(std::string& out, unsigned v) { out += static_cast<char>(v & 0xFFU); }
void put_u16(std::string& out, unsigned v) {
  put_u8(out, v);
  put_u8(out, v >> 8);
}
void put_u32(std::string& out, std::size_t v) {
  for (int i = 0; i < 4; ++i) put_u8(out, static_cast<unsigned>(v >> (8 * i)));
}
void put_f32(std::string& out, double v) {
  const auto f = static_cast<float>(v);
  std::uint32_t w = 0;
  std::memcpy(&w, &f, 4);
  put_u32(out, w);
}

/// Shortest text of a number, whatever the locale.
std::string text_of(double v) {
  char buffer[32];
  const auto r = std::to_chars(buffer, buffer + sizeof buffer, v == 0 ? 0.0 : v);
  return {buffer, r.ptr};
}
std::string text_of(float v) {
  char buffer[32];
  const auto r = std::to_chars(buffer, buffer + sizeof buffer, v == 0 ? 0.0F : v);
  return {buffer, r.ptr};
}

std::vector<Pose> world_poses(std::span<const ExportItem> items) {
  std::vector<Pose> out;
  for (const ExportItem& item : items)
    out.push_back(item.parent < 0
                      ? item.pose
                      : spatial::compose(out[static_cast<std::size_t>(item.parent)], item.pose));
  return out;
}

Vec3 at(const std::vector<float>& v, std::size_t i) {
  return {static_cast<double>(v[3 * i]), static_cast<double>(v[3 * i + 1]),
          static_cast<double>(v[3 * i + 2])};
}

Result<std::size_t> count_triangles(std::span<const ExportItem> items) {
  std::size_t n = 0;
  for (const ExportItem& item : items) n += item.mesh ? item.mesh->triangle_count() : 0;
  if (n == 0)
    return error(ErrorCode::invalid_argument, "there is no mesh to write",
                 "Export a solid or object.");
  if (n > 0xFFFFFFFFU / 3)
    return error(ErrorCode::unsupported, "there are too many triangles for this format",
                 "Give a coarser chord=.");
  return n;
}

/// Corners at one position are one.
struct Welded {
  std::vector<std::uint32_t> first;  ///< a vertex of the mesh for each joined one
  std::vector<std::uint32_t> of;     ///< joined one for each vertex
};
Welded welded(const Mesh& mesh) {
  Welded j;
  std::map<std::array<float, 3>, std::uint32_t> known;
  for (std::uint32_t i = 0; i < mesh.vertex_count(); ++i) {
    const std::size_t k = 3 * std::size_t{i};
    const std::array<float, 3> p{mesh.positions[k] + 0.0F, mesh.positions[k + 1] + 0.0F,
                                 mesh.positions[k + 2] + 0.0F};
    const auto [it, is_new] = known.try_emplace(p, static_cast<std::uint32_t>(j.first.size()));
    if (is_new) j.first.push_back(i);
    j.of.push_back(it->second);
  }
  return j;
}

std::string xml(std::string_view s) {
  std::string out;
  for (const char c : s) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

std::string json(std::string_view s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + '"';
}

unsigned tone(float c) {
  return static_cast<unsigned>(std::lround(255 * std::clamp(c, 0.0F, 1.0F)));
}
double linear(float c) {
  const double x = std::clamp(static_cast<double>(c), 0.0, 1.0);
  return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}

// --- ZIP ---------------------------------------------------------------------------------------

std::uint32_t crc32(std::string_view bytes) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t c = i;
      for (int k = 0; k < 8; ++k) c = (c & 1U) ? 0xEDB88320U ^ (c >> 1) : c >> 1;
      t[i] = c;
    }
    return t;
  }();
  std::uint32_t c = 0xFFFFFFFFU;
  for (const char b : bytes) c = table[(c ^ static_cast<std::uint8_t>(b)) & 0xFFU] ^ (c >> 8);
  return c ^ 0xFFFFFFFFU;
}

/// Files stored one after the other, and their directory.
std::string zip(const std::vector<std::pair<std::string, std::string>>& files) {
  constexpr unsigned kDate = (2000 - 1980) << 9 | 1 << 5 | 1;  // fixed: equal content, equal bytes
  std::string out, directory;
  for (const auto& [name, content] : files) {
    std::string entry;
    put_u16(entry, 20);  // version needed
    put_u16(entry, 0);
    put_u16(entry, 0);  // stored
    put_u16(entry, 0);
    put_u16(entry, kDate);
    put_u32(entry, crc32(content));
    put_u32(entry, content.size());
    put_u32(entry, content.size());
    put_u16(entry, static_cast<unsigned>(name.size()));
    put_u16(entry, 0);
    const std::size_t offset = out.size();
    out += "PK\x03\x04" + entry + name + content;
    directory += "PK\x01\x02";
    put_u16(directory, 20);
    directory += entry;
    put_u16(directory, 0);  // comment
    put_u16(directory, 0);  // disk
    put_u16(directory, 0);
    put_u32(directory, 0);
    put_u32(directory, offset);
    directory += name;
  }
  const std::size_t start = out.size();
  out += directory;
  out += "PK\x05\x06";
  put_u32(out, 0);
  put_u16(out, static_cast<unsigned>(files.size()));
  put_u16(out, static_cast<unsigned>(files.size()));
  put_u32(out, directory.size());
  put_u32(out, start);
  put_u16(out, 0);
  return out;
}

/// Index of the first item with the same mesh: what is written once.
std::vector<std::size_t> first_with_mesh(std::span<const ExportItem> items) {
  std::vector<std::size_t> out(items.size());
  std::map<std::pair<const Mesh*, std::array<float, 4>>, std::size_t> known;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Colour& c = items[i].colour;
    out[i] = known.try_emplace({items[i].mesh, {c.r, c.g, c.b, c.a}}, i).first->second;
  }
  return out;
}

}  // namespace

Result<std::string> write_stl(std::span<const ExportItem> items, const MeshOptions& options) {
  RMP_TRY_ASSIGN(const std::size_t count, count_triangles(items));
  std::string out = "robomosp, " + std::string(options.unit_name);
  out.resize(80, ' ');
  out.reserve(84 + 50 * count);
  put_u32(out, count);
  const auto poses = world_poses(items);
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!items[i].mesh) continue;
    const Mesh& m = *items[i].mesh;
    for (std::size_t t = 0; t < m.triangle_count(); ++t) {
      std::array<Vec3, 3> p;
      for (std::size_t c = 0; c < 3; ++c)
        p[c] = spatial::scale(spatial::transform(poses[i], at(m.positions, m.triangles[3 * t + c])),
                              1 / options.unit);
      const Vec3 n =
          spatial::unit(spatial::cross(spatial::sub(p[1], p[0]), spatial::sub(p[2], p[0])));
      for (const double x : n) put_f32(out, x);
      for (const Vec3& q : p)
        for (const double x : q) put_f32(out, x);
      put_u16(out, 0);
    }
  }
  return out;
}

Result<std::string> write_obj(std::span<const ExportItem> items, const MeshOptions& options) {
  RMP_TRY(count_triangles(items));
  std::string out = "# robomosp, " + std::string(options.unit_name) + "\n";
  const auto poses = world_poses(items);
  std::size_t points = 0, normals = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!items[i].mesh) continue;
    const Mesh& m = *items[i].mesh;
    const Welded j = welded(m);
    std::string name;
    for (const char c : items[i].name) name += static_cast<unsigned char>(c) <= 0x20 ? '_' : c;
    out += "o " + (name.empty() ? "part" : name) + "\n";
    for (const std::uint32_t v : j.first) {
      const Vec3 p =
          spatial::scale(spatial::transform(poses[i], at(m.positions, v)), 1 / options.unit);
      out += "v " + text_of(static_cast<float>(p[0])) + " " + text_of(static_cast<float>(p[1])) +
             " " + text_of(static_cast<float>(p[2])) + "\n";
    }
    const bool has_normals = m.normals.size() == m.positions.size();
    if (has_normals)
      for (std::size_t v = 0; v < m.vertex_count(); ++v) {
        const Vec3 n = spatial::rotate(poses[i], at(m.normals, v));
        out += "vn " + text_of(static_cast<float>(n[0])) + " " + text_of(static_cast<float>(n[1])) +
               " " + text_of(static_cast<float>(n[2])) + "\n";
      }
    for (std::size_t t = 0; t < m.triangle_count(); ++t) {
      out += "f";
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint32_t v = m.triangles[3 * t + c];
        out += " " + std::to_string(points + j.of[v] + 1);
        if (has_normals) out += "//" + std::to_string(normals + v + 1);
      }
      out += "\n";
    }
    points += j.first.size();
    if (has_normals) normals += m.vertex_count();
  }
  return out;
}

Result<std::string> write_ply(std::span<const ExportItem> items, const MeshOptions& options) {
  RMP_TRY_ASSIGN(const std::size_t count, count_triangles(items));
  const auto poses = world_poses(items);
  std::string vertices, faces;
  std::size_t total = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!items[i].mesh) continue;
    const Mesh& m = *items[i].mesh;
    const Welded j = welded(m);
    for (const std::uint32_t v : j.first) {
      const Vec3 p =
          spatial::scale(spatial::transform(poses[i], at(m.positions, v)), 1 / options.unit);
      for (const double x : p) put_f32(vertices, x);
      const Colour& c = items[i].colour;
      for (const float x : {c.r, c.g, c.b, c.a}) put_u8(vertices, tone(x));
    }
    for (std::size_t t = 0; t < m.triangle_count(); ++t) {
      put_u8(faces, 3);
      for (std::size_t c = 0; c < 3; ++c) put_u32(faces, total + j.of[m.triangles[3 * t + c]]);
    }
    total += j.first.size();
  }
  return "ply\nformat binary_little_endian 1.0\ncomment robomosp, " +
         std::string(options.unit_name) + "\nelement vertex " + std::to_string(total) +
         "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty "
         "uchar "
         "green\nproperty uchar blue\nproperty uchar alpha\nelement face " +
         std::to_string(count) + "\nproperty list uchar uint vertex_indices\nend_header\n" +
         vertices + faces;
}

Result<std::string> write_glb(std::span<const ExportItem> items) {
  RMP_TRY(count_triangles(items));
  std::string bin, accessors, views, meshes, materials, nodes, roots;
  std::size_t accessor = 0, view = 0, mesh_count = 0;
  const auto first = first_with_mesh(items);
  std::vector<std::size_t> mesh_of(items.size(), 0);
  const auto add_view = [&](std::size_t from, int target) {
    views += (view ? "," : "") + std::string("{\"buffer\":0,\"byteOffset\":") +
             std::to_string(from) + ",\"byteLength\":" + std::to_string(bin.size() - from) +
             ",\"target\":" + std::to_string(target) + "}";
    return view++;
  };
  const auto add_accessor = [&](std::size_t in_view, int type, std::size_t n, const char* kind,
                                const std::string& more) {
    accessors += (accessor ? "," : "") + std::string("{\"bufferView\":") + std::to_string(in_view) +
                 ",\"componentType\":" + std::to_string(type) + ",\"count\":" + std::to_string(n) +
                 ",\"type\":\"" + kind + "\"" + more + "}";
    return accessor++;
  };
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!items[i].mesh) continue;
    if (first[i] != i) {
      mesh_of[i] = mesh_of[first[i]];
      continue;
    }
    const Mesh& m = *items[i].mesh;
    std::array<float, 3> low, high;
    low.fill(INFINITY);
    high.fill(-INFINITY);
    std::size_t from = bin.size();
    for (std::size_t k = 0; k < m.positions.size(); ++k) {
      put_f32(bin, static_cast<double>(m.positions[k]));
      low[k % 3] = std::min(low[k % 3], m.positions[k]);
      high[k % 3] = std::max(high[k % 3], m.positions[k]);
    }
    const auto triple = [](const std::array<float, 3>& v) {
      return "[" + text_of(v[0]) + "," + text_of(v[1]) + "," + text_of(v[2]) + "]";
    };
    const std::size_t position =
        add_accessor(add_view(from, 34962), 5126, m.vertex_count(), "VEC3",
                     ",\"min\":" + triple(low) + ",\"max\":" + triple(high));
    std::string attributes = "\"POSITION\":" + std::to_string(position);
    if (m.normals.size() == m.positions.size()) {
      from = bin.size();
      for (const float x : m.normals) put_f32(bin, static_cast<double>(x));
      attributes += ",\"NORMAL\":" + std::to_string(add_accessor(add_view(from, 34962), 5126,
                                                                 m.vertex_count(), "VEC3", ""));
    }
    from = bin.size();
    for (const std::uint32_t x : m.triangles) put_u32(bin, x);
    const std::size_t indices =
        add_accessor(add_view(from, 34963), 5125, m.triangles.size(), "SCALAR", "");
    const Colour& c = items[i].colour;
    const std::string comma = mesh_count ? "," : "";
    materials += comma + "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[" + text_of(linear(c.r)) +
                 "," + text_of(linear(c.g)) + "," + text_of(linear(c.b)) + "," +
                 text_of(std::clamp(c.a, 0.0F, 1.0F)) +
                 "],\"metallicFactor\":0,\"roughnessFactor\":0.6}" +
                 (c.a < 1 ? ",\"alphaMode\":\"BLEND\"" : "") + "}";
    meshes += comma + "{\"name\":" + json(items[i].name) + ",\"primitives\":[{\"attributes\":{" +
              attributes + "},\"indices\":" + std::to_string(indices) +
              ",\"material\":" + std::to_string(mesh_count) + "}]}";
    mesh_of[i] = mesh_count++;
  }
  // Node 0 turns z up to glTF's y up.
  std::vector<std::string> children(items.size() + 1);
  for (std::size_t i = 0; i < items.size(); ++i) {
    std::string& list = children[static_cast<std::size_t>(items[i].parent + 1)];
    list += (list.empty() ? "" : ",") + std::to_string(i + 1);
  }
  nodes =
      "{\"name\":\"robomosp\",\"rotation\":[-0.7071067811865476,0,0,0.7071067811865476],"
      "\"children\":[" +
      children[0] + "]}";
  for (std::size_t i = 0; i < items.size(); ++i) {
    const auto& R = items[i].pose.R;
    const auto& p = items[i].pose.p;
    const std::array<double, 16> matrix{R[0], R[3], R[6], 0, R[1], R[4], R[7], 0,
                                        R[2], R[5], R[8], 0, p[0], p[1], p[2], 1};  // by columns
    nodes += ",{\"name\":" + json(items[i].name);
    if (p != Vec3{} || R != Pose{}.R) {
      nodes += ",\"matrix\":[";
      for (std::size_t k = 0; k < 16; ++k) nodes += (k ? "," : "") + text_of(matrix[k]);
      nodes += "]";
    }
    if (items[i].mesh) nodes += ",\"mesh\":" + std::to_string(mesh_of[i]);
    if (!children[i + 1].empty()) nodes += ",\"children\":[" + children[i + 1] + "]";
    nodes += "}";
  }
  std::string text =
      "{\"asset\":{\"version\":\"2.0\",\"generator\":\"robomosp\"},\"scene\":0,\"scenes\":[{"
      "\"nodes\":[0]}],\"nodes\":[" +
      nodes + "],\"meshes\":[" + meshes + "],\"materials\":[" + materials + "],\"accessors\":[" +
      accessors + "],\"bufferViews\":[" + views +
      "],\"buffers\":[{\"byteLength\":" + std::to_string(bin.size()) + "}]}";
  while (text.size() % 4 != 0) text += ' ';
  if (bin.size() + text.size() > 0xFFFFFF00U)
    return error(ErrorCode::unsupported, "there are too many triangles for GLB",
                 "Give a coarser chord=.");
  std::string out = "glTF";
  put_u32(out, 2);
  put_u32(out, 12 + 8 + text.size() + 8 + bin.size());
  put_u32(out, text.size());
  out += "JSON" + text;
  put_u32(out, bin.size());
  out += "BIN";
  out += '\0';
  return out + bin;
}

Result<std::string> write_3mf(std::span<const ExportItem> items, const MeshOptions& options) {
  RMP_TRY(count_triangles(items));
  const std::string_view unit = options.unit_name == "m"    ? "meter"
                                : options.unit_name == "cm" ? "centimeter"
                                : options.unit_name == "in" ? "inch"
                                : options.unit_name == "ft" ? "foot"
                                                            : "millimeter";
  const auto first = first_with_mesh(items);
  std::map<std::array<unsigned, 4>, std::size_t> colours;
  std::vector<std::size_t> id(items.size(), 0), colour_of(items.size(), 0);
  std::string bases;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!items[i].mesh || first[i] != i) continue;
    const Colour& c = items[i].colour;
    const std::array<unsigned, 4> key{tone(c.r), tone(c.g), tone(c.b), tone(c.a)};
    const auto [it, is_new] = colours.try_emplace(key, colours.size());
    colour_of[i] = it->second;
    if (!is_new) continue;
    char hex[10];
    std::snprintf(hex, sizeof hex, "#%02X%02X%02X%02X", key[0], key[1], key[2], key[3]);
    bases += "<base name=\"colour " + std::to_string(it->second + 1) + "\" displaycolor=\"" + hex +
             "\"/>";
  }
  const auto transform = [&](const Pose& t) {
    const auto& R = t.R;
    std::string s;
    for (const double x : {R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8],
                           t.p[0] / options.unit, t.p[1] / options.unit, t.p[2] / options.unit})
      s += (s.empty() ? "" : " ") + text_of(x);
    return s;
  };
  std::string objects;
  std::size_t next = 2;  // 1 = the colours
  // Meshes first; then assemblies, the innermost first, since an object may name earlier ones only.
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!items[i].mesh) continue;
    if (first[i] != i) {
      id[i] = id[first[i]];
      continue;
    }
    id[i] = next++;
    const Mesh& m = *items[i].mesh;
    const Welded j = welded(m);
    objects += "<object id=\"" + std::to_string(id[i]) + "\" type=\"model\" name=\"" +
               xml(items[i].name) + "\" pid=\"1\" pindex=\"" + std::to_string(colour_of[i]) +
               "\"><mesh><vertices>\n";
    for (const std::uint32_t v : j.first) {
      const Vec3 p = spatial::scale(at(m.positions, v), 1 / options.unit);
      objects += "<vertex x=\"" + text_of(static_cast<float>(p[0])) + "\" y=\"" +
                 text_of(static_cast<float>(p[1])) + "\" z=\"" + text_of(static_cast<float>(p[2])) +
                 "\"/>\n";
    }
    objects += "</vertices><triangles>\n";
    for (std::size_t t = 0; t < m.triangle_count(); ++t) {
      const auto a = j.of[m.triangles[3 * t]], b = j.of[m.triangles[3 * t + 1]],
                 c = j.of[m.triangles[3 * t + 2]];
      if (a == b || b == c || c == a) continue;  // the format forbids them
      objects += "<triangle v1=\"" + std::to_string(a) + "\" v2=\"" + std::to_string(b) +
                 "\" v3=\"" + std::to_string(c) + "\"/>\n";
    }
    objects += "</triangles></mesh></object>\n";
  }
  std::vector<std::string> parts(items.size());
  std::string build;
  for (std::size_t i = items.size(); i-- > 0;) {
    if (!items[i].mesh) {
      if (parts[i].empty()) continue;
      id[i] = next++;
      objects += "<object id=\"" + std::to_string(id[i]) + "\" type=\"model\" name=\"" +
                 xml(items[i].name) + "\"><components>" + parts[i] + "</components></object>\n";
    }
    const std::string use = "objectid=\"" + std::to_string(id[i]) + "\" transform=\"" +
                            transform(items[i].pose) + "\"/>";
    if (items[i].parent < 0) build = "<item " + use + build;
    else parts[static_cast<std::size_t>(items[i].parent)].insert(0, "<component " + use);
  }
  const std::string head = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  const std::string model =
      head + "<model unit=\"" + std::string(unit) +
      "\" xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n"
      "<metadata name=\"Application\">robomosp</metadata>\n<resources>\n<basematerials id=\"1\">" +
      bases + "</basematerials>\n" + objects + "</resources>\n<build>" + build +
      "</build>\n</model>\n";
  if (model.size() > 0xFFFFFF00U)
    return error(ErrorCode::unsupported, "there are too many triangles for 3MF",
                 "Give a coarser chord=.");
  return zip(
      {{"[Content_Types].xml",
        head +
            "<Types "
            "xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\"><Default "
            "Extension=\"rels\" "
            "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/><Default "
            "Extension=\"model\" "
            "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n"},
       {"_rels/.rels",
        head +
            "<Relationships "
            "xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship "
            "Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
            "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></"
            "Relationships>\n"},
       {"3D/3dmodel.model", model}});
}

}  // namespace robomosp::cad_exchange
