// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <unordered_map>
#include <utility>

#include "io/legacy.h"
#include "io/legacy_syntax.h"
#include "kernel/file_root.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "model/solid_edit.h"
#include "spatial/pose.h"

namespace robomosp::io {

namespace {

namespace fs = std::filesystem;
using namespace model;
using document::Snapshot;
using text::quote;

constexpr double kMostExportedShininess = 128;
constexpr int kDecimals = 10;  ///< 0.1 nm, 2e-12 rad; that program wrote 8
/// What its highlights are when a material of ours leaves them to its metalness.
constexpr Colour kNoHighlight{0, 0, 0, 1};

std::string real(double v) { return text::print_fixed(v, kDecimals); }

template <class Numbers>
std::string legacy_tuple(const Numbers& numbers) {
  std::string out = "( ";
  for (std::size_t i = 0; i < std::size(numbers); ++i) out += (i ? ", " : "") + real(numbers[i]);
  return out + " )";
}

std::string colour(const Colour& c, float alpha) {
  const auto d = [](float x) { return static_cast<double>(x); };
  return legacy_tuple(std::array{d(c.r), d(c.g), d(c.b), d(alpha)}) + "\n";
}

std::string frame(const Placement& p, bool is_global) {
  Vec3 at = p.position;
  if (p.coordinates != PositionRepresentation::cartesian) at[1] /= kDegree;
  if (p.coordinates == PositionRepresentation::spherical) at[2] /= kDegree;
  Vec3 angles = p.angles;
  int orientation = 0;
  if (p.notation == AngleRepresentation::zyz) orientation = 2;
  if (p.notation == AngleRepresentation::rpy) {
    orientation = 3;
    std::swap(angles[0], angles[2]);  // there the first turns about z
  }
  return legacy_tuple(std::array{at[0], at[1], at[2], angles[0] / kDegree, angles[1] / kDegree,
                                 angles[2] / kDegree}) +
         " " + std::to_string(static_cast<int>(p.coordinates)) + " " + std::to_string(orientation) +
         (is_global ? " 1" : " 0");
}

/// A text in quotes; the format has no way to write a quote or a line end.
Result<std::string> words(const std::string& s, const std::string& whose) {
  if (s.find('"') != std::string::npos)
    return error(ErrorCode::unsupported, "a text of " + whose + " has a quote in it",
                 "The 2006 format cannot represent it; remove it.");
  std::string out = "\"" + s + "\"";
  std::replace(out.begin(), out.end(), '\n', ' ');
  return out;
}

class Exporter {
 public:
  Exporter(const Snapshot& s, fs::path folder) : s_(s), folder_(std::move(folder)) {}

  Result<std::vector<fs::path>> run(AnyId id, bool overwrite) {
    if (!s_.find(id))
      return error(ErrorCode::stale_handle, s_.describe(id) + " cannot be exported",
                   "Look it up again by its name.");
    if (file_kind(folder_) != FileKind::folder)
      return error(ErrorCode::not_found,
                   "there is no folder " + quote(folder_.generic_string()) + " to export to",
                   "Create it first.");
    switch (id.kind) {
      case Kind::material: RMP_TRY(material({id.number})); break;
      case Kind::solid: RMP_TRY(solid({id.number}, {})); break;
      case Kind::object: RMP_TRY(object({id.number})); break;
      default:
        return error(ErrorCode::unsupported, s_.describe(id) + " cannot be exported",
                     "Materials, solids and objects can.");
    }
    for (const auto& [path, content] : files_) {
      if (overwrite || file_kind(path) == FileKind::none) continue;
      if (!file_holds(path, content))
        return error(ErrorCode::conflict,
                     "the file " + quote(path.generic_string()) + " exists with different content",
                     "Give overwrite = true, or another folder.");
    }
    std::vector<fs::path> written;
    for (const auto& [path, content] : files_) {
      if (const auto made = make_folders(path.parent_path());  // write_file says what failed
          !made.ok() && made.error().code == ErrorCode::permission)
        return made.error();
      RMP_TRY(write_file(path, content));
      written.push_back(path);
    }
    return written;
  }

 private:
  /// Path within the installation, as references are written.
  static std::string inside(const char* kind, const std::string& name, const char* extension) {
    return std::string("./Saves/") + kind + "/" + name + extension;
  }
  void put(const std::string& path, std::string content) {
    files_.emplace_back((folder_ / path).lexically_normal(), std::move(content));
  }

  Result<std::string> material(MaterialId id) {
    const auto [known, is_new] = materials_.try_emplace(id.number);
    if (!is_new) return known->second;
    const Material* m = s_.get(id);
    if (!m) return error(ErrorCode::stale_handle, s_.describe(id) + " is gone");
    const std::string& name = s_.find(id)->name;
    RMP_TRY_ASSIGN(std::string out, words(name, s_.describe(id)));
    out += "\n" + colour(m->ambient.value_or(m->colour), m->colour.a) +
           colour(m->colour, m->colour.a) +
           colour(m->specular.value_or(kNoHighlight), m->colour.a) +
           colour(m->emission, m->colour.a) + real(m->shininess * kMostExportedShininess) +
           "\n#Density\n" + real(m->density) + "\n#Metric Units\n0\n";
    known->second = inside("Materials", name, ".mtr");
    put(known->second, std::move(out));
    return known->second;
  }

  Result<std::string> solid(SolidId id, MaterialId other) {
    const Solid* solid = s_.get(id);
    if (!solid) return error(ErrorCode::stale_handle, s_.describe(id) + " is gone");
    const MaterialId of = other ? other : solid->material;
    if (!of)
      return error(ErrorCode::unsupported, "it has no material, which the 2006 format needs",
                   "Give it one, if necessary with density 0.", s_.describe(id));
    const auto [known, is_new] = solids_.try_emplace({id.number, of.number});
    if (!is_new) return known->second;
    RMP_TRY_ASSIGN(const std::string material_file, material(of));
    RMP_TRY_ASSIGN(std::string out, words(solid->description, s_.describe(id)));
    out += "\n#Metric Units ( Length, Mass, Angle)\n 0 0 0\n";
    auto tree = write_tree(*solid, material_file);
    if (!tree.ok()) return std::move(tree).error().in(s_.describe(id));
    out += *tree;
    std::string name = s_.find(id)->name;
    if (of != solid->material) name += " " + s_.find(of)->name;
    while (!solid_files_.insert(name).second) name += "_2";
    known->second = inside("CSGs", name, ".csg");
    put(known->second, std::move(out));
    return known->second;
  }

  static Result<std::string> write_tree(const Solid& solid, const std::string& material_file) {
    std::string out;
    std::vector<std::size_t> open;
    const auto indent = [&] { out.append(2 * std::min<std::size_t>(open.size(), 20), ' '); };
    const auto close = [&] {
      open.pop_back();
      indent();
      out += "}\n";
    };
    for (std::size_t i = 0; i < solid.nodes.size(); ++i) {
      while (!open.empty() && static_cast<std::int32_t>(open.back()) != solid.nodes[i].parent)
        close();
      RMP_TRY_ASSIGN(const std::string node, write_node(solid.nodes[i], material_file));
      indent();
      out += "{\n";
      open.push_back(i);
      indent();
      out += "[ " + node + " ]\n";
    }
    while (!open.empty()) close();
    return out;
  }

  static Result<std::string> write_node(const SolidNode& n, const std::string& material_file) {
    const auto& z = n.sizes;
    const auto primitive = [&](const std::string& word, double lift, double turn,
                               const std::vector<double>& sizes) {
      Placement p = n.placement;
      lift += model::node_T_body(n).p[2];
      if (turn != 0 || lift != 0) {
        const Pose local{spatial::from_rpy({0, 0, turn}), {0, 0, lift}};
        const Pose t = spatial::compose(pose(p), local);
        if (turn != 0) p = placement(t);
        p.position = t.p;
        p.coordinates = PositionRepresentation::cartesian;
      }
      return word + " " + frame(p, n.is_global) + " " + legacy_tuple(sizes) + " \"" +
             material_file + "\"";
    };
    // What the facets are made of there; here surfaces are exact.
    constexpr double kSlices = 24, kStacks = 12;
    const double quarter = std::numbers::pi / 4;
    switch (n.kind) {
      case CsgKind::union_: return "Union " + frame(n.placement, n.is_global);
      case CsgKind::difference: return "Difference " + frame(n.placement, n.is_global);
      case CsgKind::intersection: return "Intersection " + frame(n.placement, n.is_global);
      case CsgKind::sphere: return primitive("Sphere", 0, 0, {z[0], kSlices, kStacks});
      case CsgKind::cone:
        return primitive("Cylinder", z[2] / 2, 0, {z[0], z[1], z[2], kSlices, kStacks});
      case CsgKind::frustum: return primitive("Cube", z[4] / 2, 0, {z[0], z[1], z[2], z[3], z[4]});
      case CsgKind::cylinder:
        if (z[2] == 0)
          return primitive("Cylinder", z[1] / 2, 0, {z[0], z[0], z[1], kSlices, kStacks});
        break;
      case CsgKind::box:
        if (z[3] == 0) return primitive("Cube", z[2] / 2, 0, {z[0], z[1], z[0], z[1], z[2]});
        break;
      case CsgKind::pyramid:
        if (z[0] == 4) {
          const double base = z[1] * std::numbers::sqrt2, top = z[2] * std::numbers::sqrt2;
          return primitive("Cube", z[3] / 2, quarter, {base, base, top, top, z[3]});
        }
        break;
      default: break;
    }
    std::string what = document_word(n);
    return error(ErrorCode::unsupported,
                 "the 2006 format cannot express " + what + " " + quote(n.name),
                 "It has unions, differences, intersections, spheres, cones, plain cylinders and "
                 "blocks with equally inclined sides.");
  }

  static std::string document_word(const SolidNode& n) {
    std::string word(csg_info(n.kind).name);
    if (n.kind == CsgKind::box || n.kind == CsgKind::cylinder) return "the fillet of " + word;
    return "the " + word;
  }

  Result<void> object(ObjectId id) {
    // Nested objects become bare frames with children; an explicit stack, as users nest them.
    struct Open {
      const Object* object;
      MaterialId material;  ///< replaces all within
      std::size_t next = 0;
    };
    const Object* root = s_.get(id);
    RMP_TRY_ASSIGN(std::string out, words(root->description, s_.describe(id)));
    out += "\n#Metric Units ( Length, Mass, Angle)\n 0 0 0\n" +
           legacy_tuple(std::array<double, 20>{}) + "\n{\n" + "  [ \"\" " + frame({}, false) +
           " ]\n";
    std::vector<Open> open{{root, {}}};
    const auto indent = [&] { out.append(2 * std::min<std::size_t>(open.size(), 20), ' '); };
    while (!open.empty()) {
      Open& top = open.back();
      if (top.next == top.object->parts.size()) {
        open.pop_back();
        indent();
        out += "}\n";
        continue;
      }
      const ObjectPart& part = top.object->parts[top.next++];
      const MaterialId material = part.material ? part.material : top.material;
      std::string file;
      const Object* inner = nullptr;
      if (part.what.kind == Kind::solid) {
        RMP_TRY_ASSIGN(file, solid({part.what.number}, material));
      } else {
        inner = s_.get(ObjectId{part.what.number});
        if (!inner) return error(ErrorCode::stale_handle, s_.describe(part.what) + " is gone");
      }
      indent();
      out += "{\n";
      indent();
      out += "  [ \"" + file + "\" " + frame(part.placement, false) + " ]\n";
      if (inner) {
        open.push_back({inner, material});
      } else {
        indent();
        out += "}\n";
      }
    }
    put(inside("Objects", s_.find(id)->name, ".obj"), std::move(out));
    return {};
  }

  const Snapshot& s_;
  fs::path folder_;
  std::vector<std::pair<fs::path, std::string>> files_;
  std::unordered_map<std::uint64_t, std::string> materials_;
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::string> solids_;
  std::set<std::string> solid_files_;
};

}  // namespace

Result<std::vector<fs::path>> export_legacy(const Snapshot& s, AnyId id, const fs::path& folder,
                                            bool overwrite) {
  return Exporter(s, folder).run(id, overwrite);
}

}  // namespace robomosp::io
