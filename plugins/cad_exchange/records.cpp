// SPDX-License-Identifier: Apache-2.0
#include "records.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include <robomosp/sdk/names.h>

#include "spatial/rotation.h"

namespace robomosp::cad_exchange {
namespace {

/// Exact solids larger than this [m] get a chord for their size, not the 0.1 mm of others.
constexpr double kLarge = 2, kChordOfSize = 5e-5;
constexpr Colour kPlain{0.75F, 0.75F, 0.77F, 1.0F};  ///< where the file gives none

std::string print_number(double v) {
  char buffer[32];
  const auto r = std::to_chars(buffer, buffer + sizeof buffer, v == 0 ? 0.0 : v);
  return {buffer, r.ptr};
}

std::string quote(std::string_view s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + '"';
}

class Names {
 public:
  std::string take(std::string_view wanted, std::string_view otherwise) {
    const std::string base = valid_name(wanted, otherwise);
    for (std::size_t& i = next_[base];;) {
      ++i;
      std::string name = i == 1 ? base : base + "_" + std::to_string(i);
      if (!taken_.insert(name).second) continue;
      if (!wanted.empty() && base != wanted && ++changed_ <= kNamesTold)
        told_ += (told_.empty() ? "\"" : ", \"") + std::string(wanted) + "\" is \"" + name + "\"";
      return name;
    }
  }
  /// A sentence where names differ from those that were wanted, else "".
  [[nodiscard]] std::string changes(const std::string& of_what) const {
    if (changed_ == 0) return {};
    return "Names of " + of_what + " that are not valid here were changed: " + told_ +
           (changed_ > kNamesTold ? " and " + std::to_string(changed_ - kNamesTold) + " more"
                                  : "") +
           ".";
  }

 private:
  static constexpr std::size_t kNamesTold = 5;
  std::size_t changed_ = 0;
  std::string told_;
  std::set<std::string> taken_;
  std::map<std::string, std::size_t> next_;
};

std::string placement(const Pose& t) {
  std::string out;
  if (t.p != Vec3{})
    out += "  at (" + print_number(t.p[0]) + ", " + print_number(t.p[1]) + ", " +
           print_number(t.p[2]) + ")";
  if (t.R != Pose{}.R) {
    const Vec3 a = spatial::to_rpy(t.R);
    out += "  rpy (" + print_number(a[0]) + ", " + print_number(a[1]) + ", " + print_number(a[2]) +
           ")";
  }
  return out;
}

bool is_identity(const Pose& t) { return t.p == Vec3{} && t.R == Pose{}.R; }

class Recorder {
 public:
  Recorder(Scene scene, const RecordOptions& options)
      : scene_(std::move(scene)), options_(options) {}

  Imported run() {
    out_.notes = std::move(scene_.notes);
    out_.profile = std::move(scene_.profile);
    if (scene_.nodes.empty()) return std::move(out_);
    const auto used = used_nodes();
    std::size_t tops = 0, top = 0;
    for (std::size_t i = 0; i < scene_.nodes.size(); ++i)
      if (used[i] && scene_.nodes[i].parent < 0) {
        ++tops;
        top = i;
      }
    if (tops == 0) return std::move(out_);
    const bool is_one_solid =
        tops == 1 && scene_.nodes[top].shape >= 0 && is_identity(scene_.nodes[top].pose);
    // An assembly that stands alone at the origin is the main record itself.
    const bool is_one_object =
        tops == 1 && scene_.nodes[top].shape < 0 && is_identity(scene_.nodes[top].pose);
    if (is_one_solid || is_one_object) scene_.nodes[top].name = options_.name;
    if (is_one_solid)
      scene_.shapes[static_cast<std::size_t>(scene_.nodes[top].shape)].name = options_.name;
    main_name_ = is_one_solid ? "" : objects_.take(options_.name, "assembly");

    // From the last node to the first: each hands its line to its assembly.
    std::vector<std::vector<std::size_t>> children(scene_.nodes.size() + 1);
    for (std::size_t i = 0; i < scene_.nodes.size(); ++i)
      if (used[i]) children[static_cast<std::size_t>(scene_.nodes[i].parent + 1)].push_back(i);
    std::vector<std::string> file(scene_.nodes.size());
    for (std::size_t i = scene_.nodes.size(); i-- > 0;) {
      if (!used[i]) continue;
      const Node& n = scene_.nodes[i];
      if (n.shape >= 0) file[i] = solid(static_cast<std::size_t>(n.shape));
      else if (!(is_one_object && i == top)) file[i] = object(n.name, "", children[i + 1], file);
    }
    if (!is_one_solid)
      object(options_.name, main_name_, children[is_one_object ? top + 1 : 0], file);
    if (made_materials_ > 0 && !(options_.density > 0))
      out_.notes.push_back(std::string("Files of this kind do not store masses reliably: ") +
                           (made_materials_ == 1 ? "the colour" : "each colour") +
                           " became a material with the density of aluminium, " +
                           print_number(kDefaultDensity) +
                           " kg/m^3. Give density= or material=, or set the materials afterwards.");
    if (!coarser_.empty()) {
      std::string all;
      const std::size_t named = std::min<std::size_t>(coarser_.size(), 5);
      for (std::size_t i = 0; i < named; ++i) all += (i ? ", " : "") + coarser_[i];
      if (coarser_.size() > named)
        all += " and " + std::to_string(coarser_.size() - named) + " more";
      out_.notes.push_back("The mesh of solids larger than 2 m is coarser, see chord: " + all +
                           ".");
    }
    for (std::string note : {solids_.changes("solids"), objects_.changes("objects")})
      if (!note.empty()) out_.notes.push_back(std::move(note));
    return std::move(out_);
  }

 private:
  /// Nodes that are parts or hold some.
  [[nodiscard]] std::vector<char> used_nodes() const {
    std::vector<char> used(scene_.nodes.size(), 0);
    for (std::size_t i = scene_.nodes.size(); i-- > 0;) {
      if (scene_.nodes[i].shape >= 0) used[i] = 1;
      if (used[i] && scene_.nodes[i].parent >= 0)
        used[static_cast<std::size_t>(scene_.nodes[i].parent)] = 1;
    }
    return used;
  }

  /// The file of the material of a colour; "" when none are made.
  std::string material(const Paint& paint) {
    if (!options_.materials) return {};
    const Colour c = paint.known ? paint.colour : kPlain;
    const auto [it, is_new] = colours_.try_emplace({c.r, c.g, c.b, c.a});
    if (!is_new) return it->second;
    ++made_materials_;
    const std::string name = materials_.take(
        options_.name + (paint.known ? "_colour" : "_material"), "imported_material");
    std::string text = "robomosp material 1\nname " + quote(name) + "\ndescription " +
                       quote("Colour from " + options_.source) + "\ndensity " +
                       print_number(options_.density > 0 ? options_.density : kDefaultDensity);
    if (!(options_.density > 0))
      text += "\nsource \"assumed on import: aluminium; not given in the file\"";
    const auto tone = [](float x) {
      return print_number(std::round(static_cast<double>(x) * 1e4) / 1e4);
    };
    text += "\ncolour (" + tone(c.r) + ", " + tone(c.g) + ", " + tone(c.b);
    if (c.a < 1) text += ", " + tone(c.a);
    text += ")\n";
    it->second = name + ".mtr";
    out_.records.push_back({it->second, std::move(text)});
    return it->second;
  }

  std::string solid(std::size_t index) {
    const auto known = solid_files_.find(index);
    if (known != solid_files_.end()) return known->second;
    Shape& s = scene_.shapes[index];
    const std::string name = solids_.take(s.name, options_.name);
    const bool is_exact = !s.brep.empty();
    const std::string geometry = name + (is_exact ? ".brep" : ".ply");
    const std::string made_of = material(s.paint);
    std::string text = "robomosp solid 1\nname " + quote(name) + "\n";
    if (!made_of.empty()) text += "material " + quote(made_of) + "\n";
    if (s.size > kLarge) {
      // The chord that solids have otherwise would make millions of triangles of it.
      char chord[32];
      std::snprintf(chord, sizeof chord, "%.1g", s.size * kChordOfSize);
      text += "chord " + std::string(chord) + "\n";
      coarser_.push_back(quote(name) + " (" + chord + " m)");
    }
    text += "imported body { geometry " + quote(geometry) + "  source " + quote(options_.source) +
            " }\n";
    ImportedGeometry g;
    g.name = geometry;
    g.geometry.form = is_exact ? CsgGeometry::Form::brep : CsgGeometry::Form::mesh;
    g.geometry.brep = std::move(s.brep);
    g.geometry.points = std::move(s.points);
    g.geometry.triangles = std::move(s.triangles);
    g.geometry.source = options_.source;
    out_.geometries.push_back(std::move(g));
    out_.records.push_back({name + ".csg", std::move(text)});
    return solid_files_[index] = name + ".csg";
  }

  /// An assembly; equal ones share a record. `fixed` is the main one's name, which has its own.
  std::string object(const std::string& wanted, const std::string& fixed,
                     const std::vector<std::size_t>& children,
                     const std::vector<std::string>& file) {
    std::string parts;
    Names part_names;
    for (const std::size_t i : children) {
      const Node& n = scene_.nodes[i];
      parts += "part " + quote(part_names.take(n.name, "part")) + " { " +
               (n.shape >= 0 ? "solid " : "object ") + quote(file[i]);
      parts += placement(n.pose);
      if (n.shape >= 0 && n.paint.known) {
        const std::string own = material(n.paint);
        if (!own.empty() && own != material(scene_.shapes[static_cast<std::size_t>(n.shape)].paint))
          parts += "  material " + quote(own);
      }
      parts += " }\n";
    }
    if (fixed.empty())
      if (const auto same = object_files_.find(parts); same != object_files_.end())
        return same->second;
    const std::string name = fixed.empty() ? objects_.take(wanted, "assembly") : fixed;
    // Files tell what touches and what is inside what; every part counts in full.
    out_.records.push_back({name + ".part", "robomosp object 1\nname " + quote(name) +
                                                "\ndescription " +
                                                quote("From " + options_.source) + "\n" + parts});
    return object_files_[parts] = name + ".part";
  }

  Scene scene_;
  const RecordOptions& options_;
  Imported out_;
  Names solids_, objects_, materials_;
  std::string main_name_;
  std::map<std::array<float, 4>, std::string> colours_;
  std::map<std::size_t, std::string> solid_files_;
  std::vector<std::string> coarser_;  ///< solids with a chord of their own
  std::map<std::string, std::string> object_files_;
  std::size_t made_materials_ = 0;
};

}  // namespace

Imported records(Scene scene, const RecordOptions& options) {
  return Recorder(std::move(scene), options).run();
}

}  // namespace robomosp::cad_exchange
