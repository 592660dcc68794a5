// SPDX-License-Identifier: Apache-2.0
// 3MF in: core (1.3), the colours of materials (1.2), production (1.1: parts in several files), and
// a word about what is in the file and not in the result. Numbers stay in double precision
// (layer: plugin).
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mesh_tree.h"
#include "package.h"
#include "worker.h"

#include <expat.h>

namespace robomosp::cad_exchange {
namespace {

constexpr std::size_t kMostDepth = 1000;
constexpr std::size_t kMostRelations = std::size_t{16} << 20;
constexpr std::string_view kModelRelation =
    "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";

enum class Extension { core, materials, production, lattice, harmless, unknown };

Extension extension_of(std::string_view space) {
  constexpr std::string_view kBase = "http://schemas.microsoft.com/3dmanufacturing/";
  if (space.empty()) return Extension::core;
  if (!space.starts_with(kBase)) return Extension::unknown;
  space.remove_prefix(kBase.size());
  if (space.starts_with("core/") || space == "2013/01") return Extension::core;
  if (space.starts_with("material/")) return Extension::materials;
  if (space.starts_with("production/")) return Extension::production;
  if (space.starts_with("beamlattice/")) return Extension::lattice;
  // Slices are another picture of the meshes; sets of triangles are names for some of them.
  if (space.starts_with("slice/") || space.starts_with("trianglesets/")) return Extension::harmless;
  return Extension::unknown;
}

std::string quoted_word(std::string_view s) { return "\"" + std::string(s.substr(0, 80)) + "\""; }

std::string_view trimmed(std::string_view s) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
  while (!s.empty() && is_blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_blank(s.back())) s.remove_suffix(1);
  return s;
}

/// Takes a number off the front; nothing when there is none, or none that is finite.
std::optional<double> take_number(std::string_view& s) {
  s = trimmed(s);
  if (s.starts_with('+')) s.remove_prefix(1);
  double v = 0;
  const auto r = std::from_chars(s.data(), s.data() + s.size(), v);
  if (r.ec != std::errc() || !std::isfinite(v)) return std::nullopt;
  s.remove_prefix(static_cast<std::size_t>(r.ptr - s.data()));
  return v;
}

std::optional<std::uint32_t> index_of(std::string_view s) {
  s = trimmed(s);
  std::uint32_t v = 0;
  const auto r = std::from_chars(s.data(), s.data() + s.size(), v);
  if (r.ec != std::errc() || r.ptr != s.data() + s.size()) return std::nullopt;
  return v;
}

/// `#RRGGBB` or `#RRGGBBAA`, sRGB.
Paint paint_of_colour(std::string_view s) {
  Paint p;
  s = trimmed(s);
  if ((s.size() != 7 && s.size() != 9) || s.front() != '#') return p;
  std::uint32_t v = 0;
  const auto r = std::from_chars(s.data() + 1, s.data() + s.size(), v, 16);
  if (r.ec != std::errc() || r.ptr != s.data() + s.size()) return p;
  if (s.size() == 7) v = v << 8 | 0xFFU;
  const auto tone = [&](unsigned shift) { return static_cast<float>(v >> shift & 0xFFU) / 255.0F; };
  p.known = true;
  p.colour = {tone(24), tone(16), tone(8), tone(0)};
  return p;
}

/// Relative names are rooted: `/3D/a.model`, whatever the file that says so.
std::string rooted(std::string_view path) {
  return path.starts_with('/') ? std::string(path) : "/" + std::string(path);
}

// --- XML -------------------------------------------------------------------------------------

/// What prefixes mean. Namespaces are kept by hand, since files of the format's own makers use
/// prefixes that they never declare, which a reader of namespaces refuses.
class Spaces {
 public:
  void open(const XML_Char** attributes) {
    ++depth_;
    for (const XML_Char** a = attributes; *a; a += 2) {
      const std::string_view name = a[0];
      if (name == "xmlns") declare("", a[1]);
      else if (name.starts_with("xmlns:")) declare(std::string(name.substr(6)), a[1]);
    }
  }
  void close() {
    for (; !declared_.empty() && declared_.back().first == depth_; declared_.pop_back())
      meanings_[declared_.back().second].pop_back();
    --depth_;
  }
  /// Nothing when the prefix was never declared.
  [[nodiscard]] std::optional<std::string_view> find(std::string_view prefix) const {
    const auto it = meanings_.find(prefix);
    if (it != meanings_.end() && !it->second.empty()) return it->second.back();
    return prefix.empty() ? std::optional<std::string_view>("") : std::nullopt;
  }
  [[nodiscard]] Extension extension(std::string_view prefix) const {
    const auto space = find(prefix);
    return space ? extension_of(*space) : Extension::unknown;
  }

 private:
  void declare(const std::string& prefix, const char* space) {
    meanings_[prefix].emplace_back(space);
    declared_.emplace_back(depth_, prefix);
  }
  std::size_t depth_ = 0;
  std::map<std::string, std::vector<std::string>, std::less<>> meanings_;
  std::vector<std::pair<std::size_t, std::string>> declared_;  ///< at which depth
};

/// A name before and after its colon.
std::pair<std::string_view, std::string_view> split(std::string_view name) {
  const auto colon = name.find(':');
  if (colon == std::string_view::npos) return {{}, name};
  return {name.substr(0, colon), name.substr(colon + 1)};
}

/// Names and values of one element.
class Attributes {
 public:
  Attributes(const XML_Char** all, const Spaces& spaces) : all_(all), spaces_(spaces) {}
  [[nodiscard]] const char* find(std::string_view name) const {
    for (const XML_Char** a = all_; *a; a += 2)
      if (name == *a) return a[1];
    return nullptr;
  }
  [[nodiscard]] std::string_view text(std::string_view name) const {
    const char* v = find(name);
    return v ? v : std::string_view();
  }
  /// Of the production extension, whatever its prefix.
  [[nodiscard]] std::string_view produced(std::string_view name) const {
    for (const XML_Char** a = all_; *a; a += 2) {
      const auto [prefix, local] = split(*a);
      if (local == name && !prefix.empty() && spaces_.extension(prefix) == Extension::production)
        return a[1];
    }
    return {};
  }

 private:
  const XML_Char** all_;
  const Spaces& spaces_;
};

/// Reads one part; what a class derived from it hears may refuse() it.
class XmlReader {
 public:
  XmlReader() = default;
  XmlReader(const XmlReader&) = delete;
  XmlReader& operator=(const XmlReader&) = delete;
  virtual ~XmlReader() = default;

  Result<void> run(const Package& package, const std::string& part) {
    part_ = part;
    const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(
        XML_ParserCreate(nullptr), &XML_ParserFree);
    if (!parser) return error(ErrorCode::plugin_failed, "it needs more memory than allowed");
    parser_ = parser.get();
    XML_SetUserData(parser_, this);
    XML_SetElementHandler(parser_, &on_start, &on_end);
    XML_SetStartDoctypeDeclHandler(parser_, &on_doctype);
    RMP_TRY(package.read(part, [&](std::string_view piece) -> Result<void> {
      const XML_Status status =
          XML_Parse(parser_, piece.data(), static_cast<int>(piece.size()), piece.empty());
      if (failed_) return *failed_;
      if (status != XML_STATUS_OK)
        return error(ErrorCode::syntax,
                     place() + "this is not XML: " + XML_ErrorString(XML_GetErrorCode(parser_)),
                     "Check that the file is complete.");
      return {};
    }));
    return {};
  }

 protected:
  virtual void start(Extension, std::string_view name, const Attributes&) = 0;
  virtual void end() = 0;
  [[nodiscard]] const Spaces& spaces() const { return spaces_; }

  void refuse(ErrorCode code, const std::string& what, const std::string& hint = {}) {
    if (failed_) return;
    failed_ = error(code, place() + what,
                    hint.empty() ? "Write the file again with the program it comes from." : hint);
    XML_StopParser(parser_, XML_FALSE);
  }
  [[nodiscard]] const std::string& part() const { return part_; }

 private:
  [[nodiscard]] std::string place() const {
    return quoted_word(part_) + ", line " + std::to_string(XML_GetCurrentLineNumber(parser_)) +
           ": ";
  }
  static XmlReader& self(void* user) { return *static_cast<XmlReader*>(user); }
  static void on_start(void* user, const XML_Char* full, const XML_Char** attributes) {
    XmlReader& me = self(user);
    if (me.failed_) return;
    me.spaces_.open(attributes);
    const auto [prefix, name] = split(full);
    me.start(me.spaces_.extension(prefix), name, Attributes(attributes, me.spaces_));
  }
  static void on_end(void* user, const XML_Char*) {
    XmlReader& me = self(user);
    if (me.failed_) return;
    me.end();
    me.spaces_.close();
  }
  static void on_doctype(void* user, const XML_Char*, const XML_Char*, const XML_Char*, int) {
    self(user).refuse(ErrorCode::syntax, "it declares a document type, which 3MF does not allow");
  }

  XML_Parser parser_ = nullptr;
  std::string part_;
  std::optional<Error> failed_;
  Spaces spaces_;
};

/// `_rels/.rels`: where the model is.
class RelationReader final : public XmlReader {
 public:
  std::string model;
  std::string others;  ///< further models, which 3MF does not allow

 protected:
  void start(Extension, std::string_view name, const Attributes& a) override {
    if (name != "Relationship" || a.text("Type") != kModelRelation) return;
    if (model.empty()) {
      model = a.text("Target");
    } else if (a.text("Target") != model && others.size() < 200) {
      others +=
          (others.empty() ? "" : ", ") + quoted_word(std::string(a.text("Target")).substr(0, 80));
    }
  }
  void end() override {}
};

// --- one model part ----------------------------------------------------------------------------

struct Reference {
  std::string path;  ///< of the model part, as the package spells it
  std::uint32_t id = 0;
  Affine at;
};

struct Object {
  std::string name, type;
  TreeMesh mesh;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> coloured;  ///< triangles by colour
  std::vector<Reference> components;
  std::size_t beams = 0;
  std::string foreign;  ///< a shape in words of an extension that is not read
  bool is_sliced = false;
};

/// What colours are made of; entry by entry.
struct Property {
  std::vector<Paint> paints;
  std::vector<std::uint32_t> layers;                ///< of multiproperties: the groups
  std::vector<std::vector<std::uint32_t>> entries;  ///< and the entry in each
};

struct ModelPart {
  std::map<std::uint32_t, Object> objects;
  std::vector<std::uint32_t> order;  ///< of the objects, as they come
  std::map<std::uint32_t, Property> properties;
  std::vector<Reference> items;
  double unit = 1e-3;
  bool has_textures = false;
};

class ModelReader final : public XmlReader {
 public:
  explicit ModelReader(const Package& package) : package_(package) {}
  ModelPart out;

 protected:
  void start(Extension extension, std::string_view name, const Attributes& a) override {
    if (stack_.size() >= kMostDepth)
      return refuse(ErrorCode::unsupported, "elements are nested more than 1000 deep");
    const bool is_core = extension == Extension::core;
    Element next = Element::other;
    if (stack_.empty()) {
      if (!is_core || name != "model")
        return refuse(ErrorCode::syntax, "this is not a 3MF model but " + quoted_word(name),
                      "Check that the file is really of this format.");
      model(a);
      next = Element::model;
    } else if (stack_.back() == Element::model && is_core) {
      if (name == "resources") next = Element::resources;
      if (name == "build") next = Element::build;
    } else if (stack_.back() == Element::resources) {
      next = resource(extension, name, a);
    } else if (stack_.back() == Element::object) {
      if (is_core && name == "mesh") next = Element::mesh;
      else if (is_core && name == "components") next = Element::components;
      else if (extension == Extension::unknown) object_->foreign = name;
    } else if (stack_.back() == Element::mesh) {
      if (is_core && name == "vertices") next = Element::vertices;
      else if (is_core && name == "triangles") next = Element::triangles;
      else if (extension == Extension::lattice) next = Element::lattice;
    } else if (stack_.back() == Element::vertices && is_core && name == "vertex") {
      vertex(a);
    } else if (stack_.back() == Element::triangles && is_core && name == "triangle") {
      triangle(a);
    } else if (stack_.back() == Element::components && is_core && name == "component") {
      reference(a, object_->components);
    } else if (stack_.back() == Element::build && is_core && name == "item") {
      reference(a, out.items);
    } else if (stack_.back() == Element::lattice) {
      next = Element::lattice;
      if (name == "beam") ++object_->beams;
    } else if (stack_.back() == Element::property) {
      entry(name, a);
    }
    stack_.push_back(next);
  }

  void end() override {
    if (stack_.empty()) return;
    const Element closed = stack_.back();
    stack_.pop_back();
    if (closed == Element::object) finish_object();
  }

 private:
  enum class Element {
    other,
    model,
    resources,
    property,
    object,
    mesh,
    vertices,
    triangles,
    lattice,
    components,
    build
  };

  void model(const Attributes& a) {
    const std::string_view unit = trimmed(a.text("unit"));
    static const std::map<std::string_view, double> kUnits{
        {"", 1e-3},       {"micron", 1e-6}, {"millimeter", 1e-3}, {"centimeter", 1e-2},
        {"inch", 0.0254}, {"foot", 0.3048}, {"meter", 1}};
    const auto known = kUnits.find(unit);
    if (known == kUnits.end())
      return refuse(ErrorCode::syntax, quoted_word(unit) + " is not a unit of 3MF",
                    "Use micron, millimeter, centimeter, inch, foot or meter.");
    out.unit = known->second;
    for (std::string_view rest = trimmed(a.text("requiredextensions")); !rest.empty();
         rest = trimmed(rest)) {
      const auto length = std::min(rest.find_first_of(" \t\r\n"), rest.size());
      const auto space = spaces().find(rest.substr(0, length));
      if (!space)
        return refuse(ErrorCode::syntax, "it requires the extension " +
                                             quoted_word(rest.substr(0, length)) +
                                             " without declaring it");
      if (extension_of(*space) == Extension::unknown)
        return refuse(
            ErrorCode::unsupported,
            "its shapes require the 3MF extension " + quoted_word(*space) + ", which is not read",
            "Write it as plain meshes with the program it comes from.");
      rest.remove_prefix(length);
    }
  }

  Element resource(Extension extension, std::string_view name, const Attributes& a) {
    if (extension == Extension::core && name == "object") return object(a);
    const bool is_group =
        (extension == Extension::core && name == "basematerials") ||
        (extension == Extension::materials &&
         (name == "colorgroup" || name == "multiproperties" || name == "compositematerials"));
    if (extension == Extension::materials && name == "texture2dgroup") out.has_textures = true;
    const auto id = index_of(a.text("id"));
    if (!is_group || !id) return Element::other;
    property_ = &out.properties[*id];
    if (const auto base = index_of(a.text("matid"))) property_->layers = {*base};
    for (std::string_view rest = trimmed(a.text("pids")); !rest.empty(); rest = trimmed(rest)) {
      const auto length = std::min(rest.find_first_of(" \t\r\n"), rest.size());
      property_->layers.push_back(index_of(rest.substr(0, length)).value_or(0));
      rest.remove_prefix(length);
    }
    const std::string_view indices = trimmed(a.text("matindices"));
    composite_first_ =
        index_of(indices.substr(0, std::min(indices.find_first_of(" \t\r\n"), indices.size())))
            .value_or(0);
    return Element::property;
  }

  void entry(std::string_view name, const Attributes& a) {
    if (name == "base") property_->paints.push_back(paint_of_colour(a.text("displaycolor")));
    else if (name == "color") property_->paints.push_back(paint_of_colour(a.text("color")));
    else if (name == "composite") composite(a);
    else if (name == "multi") {
      auto& row = property_->entries.emplace_back();
      for (std::string_view rest = trimmed(a.text("pindices")); !rest.empty();
           rest = trimmed(rest)) {
        const auto length = std::min(rest.find_first_of(" \t\r\n"), rest.size());
        row.push_back(index_of(rest.substr(0, length)).value_or(0));
        rest.remove_prefix(length);
      }
    }
  }

  /// A mixture shows as the material of which it has most.
  void composite(const Attributes& a) {
    std::string_view rest = a.text("values");
    std::uint32_t best = 0;
    double most = -1;
    for (std::uint32_t i = 0; const auto share = take_number(rest); ++i)
      if (*share > most) {
        most = *share;
        best = i;
      }
    property_->entries.push_back({composite_first_ + best});
  }

  Element object(const Attributes& a) {
    const auto id = index_of(a.text("id"));
    if (!id) {
      refuse(ErrorCode::syntax, "an object has no number");
      return Element::other;
    }
    const auto [it, is_new] = out.objects.try_emplace(*id);
    if (!is_new) {
      refuse(ErrorCode::syntax, "there are two objects " + std::to_string(*id));
      return Element::other;
    }
    out.order.push_back(*id);
    object_ = &it->second;
    object_->name = a.text("name").empty() ? a.text("partnumber") : a.text("name");
    object_->type = a.text("type");
    object_->mesh.name = object_->name;
    group_ = index_of(a.text("pid")).value_or(0);
    first_ = index_of(a.text("pindex")).value_or(0);
    return Element::object;
  }

  void vertex(const Attributes& a) {
    for (const char* const axis : {"x", "y", "z"}) {
      std::string_view text = a.text(axis);
      const auto v = take_number(text);
      if (!v || !trimmed(text).empty())
        return refuse(ErrorCode::syntax, std::string("the ") + axis + " of a vertex is " +
                                             quoted_word(a.text(axis)) + ", not a number");
      object_->mesh.points.push_back(*v * out.unit);
    }
  }

  void triangle(const Attributes& a) {
    for (const char* const corner : {"v1", "v2", "v3"}) {
      const auto v = index_of(a.text(corner));
      if (!v)
        return refuse(ErrorCode::syntax, std::string("the ") + corner + " of a triangle is " +
                                             quoted_word(a.text(corner)) + ", not a number");
      object_->mesh.triangles.push_back(*v);
    }
    const auto group = index_of(a.text("pid"));
    const auto index = index_of(a.text("p1"));
    ++object_->coloured[{group.value_or(group_), index.value_or(first_)}];
  }

  void finish_object() {
    const std::size_t vertices = object_->mesh.points.size() / 3;
    for (const std::uint32_t v : object_->mesh.triangles)
      if (v >= vertices)
        return refuse(ErrorCode::syntax, "a triangle of object " +
                                             std::to_string(out.order.back()) + " names vertex " +
                                             std::to_string(v) + " of " + std::to_string(vertices));
  }

  void reference(const Attributes& a, std::vector<Reference>& into) {
    Reference r;
    const auto id = index_of(a.text("objectid"));
    if (!id) return refuse(ErrorCode::syntax, "an item or component names no object");
    r.id = *id;
    const std::string_view path = a.produced("path");
    r.path = path.empty() ? part() : package_.find(path);
    if (r.path.empty())
      return refuse(ErrorCode::syntax, "the part " + quoted_word(path) + " is not in the package");
    if (const char* text = a.find("transform")) {
      std::string_view rest = text;
      // Rows of a matrix that points are multiplied to from the left.
      for (std::size_t i = 0; i < 12; ++i) {
        const auto v = take_number(rest);
        if (!v || (i == 11 && !trimmed(rest).empty()))
          return refuse(ErrorCode::syntax,
                        quoted_word(text) + " is not a placement of twelve numbers");
        if (i < 9) r.at.m[3 * (i % 3) + i / 3] = *v;
        else r.at.t[i - 9] = *v * out.unit;
      }
    }
    into.push_back(std::move(r));
  }

  const Package& package_;
  std::vector<Element> stack_;
  Object* object_ = nullptr;
  Property* property_ = nullptr;
  std::uint32_t group_ = 0, first_ = 0, composite_first_ = 0;
};

// --- the package -------------------------------------------------------------------------------

std::string count(std::size_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

class ThreemfReader {
 public:
  ThreemfReader(const Package& package, Progress& progress)
      : package_(package), progress_(progress) {}

  Result<Scene> run() {
    RMP_TRY_ASSIGN(const std::string root, root_model());
    // Parts that items and components name are read when they are first named.
    std::vector<std::string> open{root};
    std::set<std::string> named{root};
    for (std::size_t at = 0; at < open.size(); ++at) {
      progress_.report(0.5 * static_cast<double>(at) / static_cast<double>(open.size()), "reading");
      ModelReader reader(package_);
      RMP_TRY(reader.run(package_, open[at]));
      const auto name_all = [&](const std::vector<Reference>& all) {
        for (const Reference& r : all)
          if (named.insert(r.path).second) open.push_back(r.path);
      };
      for (const auto& [id, object] : reader.out.objects) name_all(object.components);
      if (at == 0) name_all(reader.out.items);
      if (reader.out.has_textures) has_textures_ = true;
      models_.emplace(open[at], std::move(reader.out));
    }
    tree_.nodes.emplace_back();
    RMP_TRY_ASSIGN(const std::vector<Reference> items, items_of(root));
    for (const Reference& r : items) RMP_TRY(add_child(r, 0, root));
    RMP_TRY(add_objects());
    RMP_TRY(check_depth());
    tell();
    return scene_of(tree_, progress_);
  }

 private:
  using Key = std::pair<std::string, std::uint32_t>;

  Result<std::string> root_model() {
    if (const std::string relations = package_.find("_rels/.rels"); !relations.empty()) {
      RMP_TRY(package_.text(relations, kMostRelations));
      RelationReader reader;
      RMP_TRY(reader.run(package_, relations));
      const std::string found = package_.find(rooted(reader.model));
      if (!reader.model.empty() && found.empty())
        return error(
            ErrorCode::syntax,
            "the package names the model " + quoted_word(reader.model) + ", which is not in it",
            "Check that the file is complete.");
      if (!reader.others.empty())
        tree_.notes.push_back("The package has more than one model, where 3MF allows one; " +
                              quoted_word(reader.model) +
                              " was read, and further models were left out: " + reader.others +
                              ".");
      if (!found.empty()) return found;
    }
    for (const std::string& name : package_.names())
      if (name.ends_with(".model")) {
        tree_.notes.push_back("The package does not declare which part is its model; " +
                              quoted_word(name) + " was read.");
        return name;
      }
    return error(ErrorCode::syntax, "the package holds no 3MF model",
                 "Check that the file is really of this format.");
  }

  /// What is built; in a file that builds nothing, the objects that are part of no other.
  Result<std::vector<Reference>> items_of(const std::string& root) {
    const ModelPart& model = models_.at(root);
    if (!model.items.empty()) return model.items;
    std::set<Key> used;
    for (const auto& [path, part] : models_)
      for (const auto& [id, object] : part.objects)
        for (const Reference& r : object.components) used.insert({r.path, r.id});
    std::vector<Reference> items;
    for (const std::uint32_t id : model.order)
      if (!used.count({root, id})) items.push_back({root, id, {}});
    if (items.empty())
      return error(ErrorCode::unsupported, "the file contains no solid",
                   "Its model has no objects.");
    tree_.notes.push_back("The file lists no object to build; " +
                          count(items.size(), "object was", "objects were") +
                          " read in place.");
    return items;
  }

  /// Places an object, which add_objects() makes.
  Result<void> add_child(const Reference& r, std::uint32_t parent, const std::string& from) {
    const auto model = models_.find(r.path);
    if (model == models_.end() || !model->second.objects.count(r.id))
      return error(ErrorCode::syntax,
                   quoted_word(from) + " places object " + std::to_string(r.id) +
                       (r.path == from ? "" : " of " + quoted_word(r.path)) + ", which is missing",
                   "Check that the file is complete.");
    const std::string& type = model->second.objects.at(r.id).type;
    if (type == "support" || type == "solidsupport") {
      ++supports_;
      return {};
    }
    const Key key{r.path, r.id};
    const auto [it, is_new] =
        node_of_.try_emplace(key, static_cast<std::uint32_t>(tree_.nodes.size()));
    if (is_new) {
      tree_.nodes.emplace_back();
      wanted_.push_back(key);
    }
    tree_.nodes[parent].children.push_back({it->second, r.at});
    return {};
  }

  Result<void> add_objects() {
    for (std::size_t i = 0; i < wanted_.size(); ++i) {
      const Key key = wanted_[i];
      const std::uint32_t node = node_of_.at(key);
      ModelPart& model = models_.at(key.first);
      Object& object = model.objects.at(key.second);
      tree_.nodes[node].name = object.name;
      const std::string what =
          object.name.empty() ? "Object " + std::to_string(key.second) : quoted_word(object.name);
      if (!object.foreign.empty())
        tree_.notes.push_back(what + " has a shape in another extension (" + object.foreign +
                              "), which was left out.");
      if (object.beams > 0)
        tree_.notes.push_back(what + " has a lattice of " + count(object.beams, "beam", "beams") +
                              ", which was left out" +
                              (object.mesh.triangles.empty() ? "." : "; its mesh was read."));
      for (const Reference& r : object.components) RMP_TRY(add_child(r, node, key.first));
      if (object.mesh.triangles.empty()) continue;
      colour(model, object, what);
      tree_.nodes[node].meshes.push_back(static_cast<std::uint32_t>(tree_.meshes.size()));
      tree_.meshes.push_back(std::move(object.mesh));
    }
    return {};
  }

  /// The colour of an entry; of multiproperties that of the first layer that has one.
  static Paint paint_at(const ModelPart& model, std::uint32_t group, std::uint32_t index,
                        int depth = 0) {
    const auto it = model.properties.find(group);
    if (it == model.properties.end()) return {};
    const Property& p = it->second;
    if (index < p.paints.size()) return p.paints[index];
    if (depth > 2 || index >= p.entries.size()) return {};
    const auto& row = p.entries[index];
    for (std::size_t i = 0; i < p.layers.size(); ++i) {
      const Paint paint = paint_at(model, p.layers[i], i < row.size() ? row[i] : 0, depth + 1);
      if (paint.known) return paint;
    }
    return {};
  }

  void colour(const ModelPart& model, Object& object, const std::string& what) {
    std::map<std::uint32_t, std::pair<std::size_t, Paint>> seen;  // by RGBA
    for (const auto& [entry, triangles] : object.coloured) {
      const Paint p = paint_at(model, entry.first, entry.second);
      std::uint32_t key = 0;
      for (const float x : {p.colour.r, p.colour.g, p.colour.b, p.colour.a})
        key = key << 8 | static_cast<std::uint32_t>(std::lround(255 * x));
      auto& [sum, paint] = seen[p.known ? key : 0];
      sum += triangles;
      paint = p;
    }
    std::size_t most = 0;
    for (const auto& [key, found] : seen)
      if (found.first > most) {
        most = found.first;
        object.mesh.paint = found.second;
      }
    if (seen.size() > 1)
      tree_.notes.push_back(what + " has " + std::to_string(seen.size()) +
                            " colours; the most common one is used.");
  }

  /// Objects that hold themselves, and chains longer than anybody draws, are refused.
  [[nodiscard]] Result<void> check_depth() const {
    struct Open {
      std::uint32_t node;
      std::size_t next;
    };
    std::vector<char> state(tree_.nodes.size(), 0);  // 1 = on the way, 2 = done
    std::vector<Open> path{{0, 0}};
    state[0] = 1;
    while (!path.empty()) {
      Open& here = path.back();
      const auto& children = tree_.nodes[here.node].children;
      if (here.next == children.size()) {
        state[here.node] = 2;
        path.pop_back();
        continue;
      }
      const std::uint32_t child = children[here.next++].node;
      if (state[child] == 1)
        return error(
            ErrorCode::syntax,
            "the object " + quoted_word(tree_.nodes[child].name) + " is a component of itself",
            "Write the file again with the program it comes from.");
      if (state[child] == 2) continue;
      if (path.size() > kMostDepth)
        return error(ErrorCode::unsupported, "components are nested more than 1000 deep");
      state[child] = 1;
      path.push_back({child, 0});
    }
    return {};
  }

  void tell() {
    std::set<double> units;
    for (const auto& [path, model] : models_) units.insert(model.unit);
    if (units.size() > 1)
      tree_.notes.push_back(
          "The parts of the package have different units; each was read in its unit.");
    if (supports_ > 0)
      tree_.notes.push_back(
          count(supports_, "support for printing was", "supports for printing were") +
          " left out.");
    if (has_textures_) tree_.notes.push_back("Textures were left out.");
    // Slicers mark bodies as modifiers in files of their own; to 3MF they are solids as others.
    for (const char* const name :
         {"Metadata/model_settings.config", "Metadata/Slic3r_PE_model.config"}) {
      const std::string found = package_.find(name);
      if (found.empty()) continue;
      const auto settings = package_.text(found, kMostRelations);
      if (!settings.ok()) continue;
      for (const std::string_view word :
           {"negative_part", "modifier_part", "support_blocker", "support_enforcer",
            "ParameterModifier", "NegativeVolume", "SupportBlocker", "SupportEnforcer"})
        if (settings->find(word) != std::string::npos) {
          tree_.notes.push_back(
              "A slicer marked bodies of this file as modifiers (" + std::string(word) +
              "); they were imported as solids like the others: remove those that are not.");
          break;
        }
    }
  }

  const Package& package_;
  Progress& progress_;
  std::map<std::string, ModelPart> models_;
  MeshTree tree_;
  std::map<Key, std::uint32_t> node_of_;
  std::vector<Key> wanted_;
  std::size_t supports_ = 0;
  bool has_textures_ = false;
};

}  // namespace

Result<Scene> read_3mf(const std::string& path, Progress& progress) {
  progress.report(0, "reading");
  std::string head(2, '\0');
  std::ifstream(path, std::ios::binary).read(head.data(), 2);
  if (head != "PK")
    return error(ErrorCode::syntax, "the beginning of the file is not that of the format 3mf",
                 "Its extension may be wrong: the unit depends on the format.");
  RMP_TRY_ASSIGN(const Package package, Package::open(path));
  return ThreemfReader(package, progress).run();
}

}  // namespace robomosp::cad_exchange
