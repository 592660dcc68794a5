// SPDX-License-Identifier: Apache-2.0
#include "io/legacy.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "document/digest.h"
#include "document/validate.h"
#include "io/bind.h"
#include "io/legacy_bound.h"
#include "io/legacy_motion.h"
#include "io/legacy_syntax.h"
#include "kernel/file_root.h"
#include "kernel/text.h"
#include "spatial/pose.h"

namespace robomosp::io {

namespace {

namespace fs = std::filesystem;
using namespace model;
using text::quote;

/// The exponent of OpenGL's highlights; ours is a fraction of it.
constexpr double kMostShininess = 128;

/// More than the densest matter on earth has, osmium's 22 590 [kg/m^3], by what alloys of models
/// may be said to be.
constexpr double kMostDensity = 30000;

/// Solids and objects have three units behind their description.
constexpr int kMostLeadingNumbers = 3;

/// A node of a .csg as written, its primitive already one of ours.
struct Node {
  SolidNode node;
  std::string material;
  std::uint32_t offset = 0, material_offset = 0;
};

class LegacyBinder {
 public:
  LegacyBinder(const Syntax& s, std::string name, bool as_solid)
      : s_(s), in_(s), name_(std::move(name)), as_solid_(as_solid) {}

  Result<LegacyBound> run() {
    out_.record.name = plain_name(name_, "record");
    const std::uint32_t beginning = in_.offset();
    const bool is_braced = in_.next() != '"';  // told by is_legacy()
    if (is_braced || is_section()) {
      in_.go_to(beginning);
      RMP_TRY(bind_legacy_section(in_, s_, is_braced, out_));
      return finished("section");
    }
    in_.go_to(beginning);
    RMP_TRY_ASSIGN(const std::string words, in_.text("a text"));
    const std::uint32_t start = in_.offset();
    if (in_.next() == '"') {
      RMP_TRY(bind_legacy_trajectory(in_, s_, out_));
      return finished("list of sections");
    }
    if (in_.next() == '(') {
      RMP_TRY_ASSIGN(const auto numbers, in_.tuple("a colour"));
      if (numbers.size() == 4) {
        RMP_TRY(material(words, start, numbers));
        return std::move(out_);
      }
      in_.go_to(start);
      RMP_TRY(bind_legacy_world(in_, s_, words, out_));
      return finished("list of objects, of robots and of trajectories");
    }
    RMP_TRY_ASSIGN([[maybe_unused]] const double first, in_.number("a unit"));
    if (in_.next() == '(') {
      in_.go_to(start);
      RMP_TRY(bind_legacy_robot(in_, s_, words, out_));
      return finished("tree in braces");
    }
    in_.go_to(start);
    using Unit = LegacyReader::Unit;
    RMP_TRY(in_.units({Unit::length, Unit::mass, Unit::angle}));
    if (in_.next() == '(') RMP_TRY(object(words));
    else RMP_TRY(solid(words));
    return finished("tree in braces");
  }

 private:
  /// A text and more whole numbers than any other file begins with: a stored section.
  bool is_section() {
    if (!in_.text("a text").ok()) return false;
    for (int i = 0; i < kMostLeadingNumbers; ++i)
      if (in_.next() != '0' || !in_.number("a code").ok()) return false;
    return in_.next() == '0';
  }

  /// What was read, if nothing comes after it; `what` a file holds once.
  Result<LegacyBound> finished(const char* what) {
    if (in_.next() != '\0')
      return in_.at(in_.offset(), "there is more after the end of the file's content",
                    "A file contains one " + std::string(what) + ".");
    return std::move(out_);
  }

  // ---- material ----

  Result<void> material(const std::string& words, std::uint32_t start,
                        const std::vector<double>& ambient) {
    Material m;
    // That program saved 0.25 as the alpha of nearly every material and drew all of them opaque.
    const auto colour = [&](const std::vector<double>& c) {
      const auto part = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
      return Colour{part(c[0]), part(c[1]), part(c[2]), 1};
    };
    std::vector<double> rest[3];
    for (auto& c : rest) {
      RMP_TRY_ASSIGN(c, in_.tuple("a colour"));
      if (c.size() != 4)
        return in_.at(start, "a colour needs four numbers: red, green, blue, alpha");
    }
    m.ambient = colour(ambient);
    m.colour = colour(rest[0]);
    m.specular = colour(rest[1]);
    m.emission = colour(rest[2]);
    RMP_TRY_ASSIGN(const double shininess, in_.number("the shininess"));
    m.shininess = std::clamp(shininess / kMostShininess, 0.0, 1.0);
    const std::uint32_t at = in_.offset();
    RMP_TRY_ASSIGN(m.density, in_.number("the density"));
    if (m.density < 0)
      return in_.at(at, "the density is " + text::print(m.density) + "; it must not be negative");
    const std::uint32_t unit_at = in_.offset();
    RMP_TRY_ASSIGN(const auto unit, in_.whole("the unit of the density"));
    // In the order of their codes, from 0.
    constexpr std::array<std::pair<const char*, double>, 4> kUnits{
        {{"kg/m^3", 1}, {"g/cm^3", 1000}, {"lb/ft^3", 16.018463373960142}, {"kg/dm^3", 1000}}};
    if (unit < 0 || unit >= static_cast<std::int64_t>(kUnits.size()))
      return in_.at(unit_at, "the unit " + std::to_string(unit) + " of the density is not known",
                    "0 is kg/m^3, 1 g/cm^3, 2 lb/ft^3, 3 kg/dm^3.");
    const auto& [unit_word, factor] = kUnits[static_cast<std::size_t>(unit)];
    // Files with code 3 say 2700 for aluminium: there the number is one of kg/m^3.
    if (unit != 0 && m.density * factor > kMostDensity && m.density <= kMostDensity)
      out_.notes.push_back(s_.place(unit_at) + ": no material has a density of " +
                           text::print(m.density) + " " + unit_word + " (unit " +
                           std::to_string(unit) + "), so " + text::print(m.density) +
                           " is taken as kg/m^3.");
    else m.density *= factor;
    if (words != name_) m.description = words;
    out_.record.body = std::move(m);
    return {};
  }

  // ---- solid ----

  Result<void> solid(const std::string& words) {
    RMP_TRY(nodes());
    std::vector<std::string> materials;  // in order of appearance
    for (const Node& n : nodes_)
      if (is_primitive(n) &&
          std::find(materials.begin(), materials.end(), n.material) == materials.end())
        materials.push_back(n.material);
    // Those that only cut, or are cut by something else, give no volume.
    std::erase_if(materials, [&](const std::string& m) { return pick(m).empty(); });
    if (materials.size() > 1 && as_solid_) {
      std::string first = legacy_stem(materials.front());
      out_.notes.push_back(quote(s_.file) + " has " + std::to_string(materials.size()) +
                           " materials; as one solid it is all of " + quote(first) +
                           ". Load it as an object to keep them: object.load.");
      materials.resize(1);
      solid_of(out_, words, out_.record.name, nodes_, materials.front());
      return {};
    }
    if (materials.size() == 1) {
      solid_of(out_, words, out_.record.name, nodes_, materials.front());
      return {};
    }
    Object o;
    o.description = words;
    FreshNames names;
    for (const std::string& m : materials) {
      auto made = std::make_shared<LegacyBound>();
      const std::string part = plain_name(m.empty() ? "rest" : legacy_stem(m), "part");
      made->record.name = out_.record.name + " " + part;
      solid_of(*made, words, made->record.name, pick(m), m);
      const std::size_t index = o.parts.size();
      o.parts.push_back({names.fresh(part), {}, {}, {}});
      Reference r;
      r.path = m;
      r.kinds = {Kind::solid};
      r.owner = "part " + quote(o.parts.back().name);
      r.set = [index](Body& b, AnyId id) { std::get<Object>(b).parts[index].what = id; };
      out_.made[out_.references.size()] = std::move(made);
      out_.references.push_back(std::move(r));
    }
    out_.record.body = std::move(o);
    return {};
  }

  static bool is_primitive(const Node& n) {
    return csg_info(n.node.kind).children == CsgChildren::none;
  }

  /// The part of the tree that is of one material: what it minus cuts leaves, in all unions.
  std::vector<Node> pick(const std::string& material) const {
    const std::size_t n = nodes_.size();
    std::vector<bool> is_first(n, false), keeps(n, false);
    std::vector<std::int32_t> first(n, -1);
    for (std::size_t i = 1; i < n; ++i) {
      const auto p = static_cast<std::size_t>(nodes_[i].node.parent);
      if (first[p] < 0) {
        first[p] = static_cast<std::int32_t>(i);
        is_first[i] = true;
      }
    }
    for (std::size_t i = n; i-- > 0;) {
      if (is_primitive(nodes_[i])) keeps[i] = nodes_[i].material == material;
      if (!keeps[i] || i == 0) continue;
      const auto p = static_cast<std::size_t>(nodes_[i].node.parent);
      if (nodes_[p].node.kind == CsgKind::union_ || is_first[i]) keeps[p] = true;
    }
    std::vector<Node> out;
    std::vector<std::int32_t> place(n, -1);
    std::vector<bool> is_whole(n, false);
    for (std::size_t i = 0; i < n; ++i) {
      bool is_in = keeps[i];
      if (i > 0) {
        const auto p = static_cast<std::size_t>(nodes_[i].node.parent);
        if (place[p] < 0) continue;
        is_whole[i] = is_whole[p] || (nodes_[p].node.kind != CsgKind::union_ && !is_first[i]);
        is_in = is_in || is_whole[i];
      }
      if (!is_in) continue;
      place[i] = static_cast<std::int32_t>(out.size());
      out.push_back(nodes_[i]);
      if (i > 0) out.back().node.parent = place[static_cast<std::size_t>(nodes_[i].node.parent)];
    }
    return out;
  }

  static void solid_of(LegacyBound& to, const std::string& words, const std::string& name,
                       const std::vector<Node>& tree, const std::string& material) {
    Solid s;
    s.description = words;
    FreshNames names;
    for (const Node& n : tree) {
      s.nodes.push_back(n.node);
      s.nodes.back().name = names.fresh(std::string(csg_info(n.node.kind).name));
      to.places[{"node", s.nodes.size() - 1}] = n.offset;
    }
    if (!material.empty()) {
      Reference r;
      r.path = material;
      for (const Node& n : tree)
        if (n.material == material) {
          r.offset = n.material_offset;
          break;
        }
      r.kinds = {Kind::material};
      r.owner = "solid " + quote(name);
      r.set = [](Body& b, AnyId id) { std::get<Solid>(b).material = {id.number}; };
      to.references.push_back(std::move(r));
    }
    to.record.body = std::move(s);
  }

  Result<void> nodes() {
    RMP_TRY(in_.expect('{', "{"));
    std::vector<std::int32_t> open;
    do {
      if (!nodes_.empty() && in_.accept('}')) {
        open.pop_back();
        (void)in_.accept(',');
        continue;
      }
      if (!nodes_.empty()) {
        RMP_TRY(in_.expect('{', "{ or }"));
        if (const Node& parent = nodes_[static_cast<std::size_t>(open.back())];
            is_primitive(parent))
          return in_.at(in_.offset(), "a primitive has a node inside",
                        "Only Union, Intersection and Difference have children.");
      }
      if (nodes_.size() >= kMostLegacyNodes)
        return in_.at(in_.offset(),
                      "the tree has more than " + std::to_string(kMostLegacyNodes) + " nodes");
      RMP_TRY(node(open.empty() ? -1 : open.back()));
      open.push_back(static_cast<std::int32_t>(nodes_.size()) - 1);
    } while (!open.empty());
    std::vector<bool> has_child(nodes_.size(), false);
    for (const Node& n : nodes_)
      if (n.node.parent >= 0) has_child[static_cast<std::size_t>(n.node.parent)] = true;
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (!is_primitive(nodes_[i]) && !has_child[i])
        return in_.at(nodes_[i].offset, "a " + std::string(csg_info(nodes_[i].node.kind).name) +
                                            " has no nodes inside");
    return {};
  }

  Result<void> node(std::int32_t parent) {
    Node n;
    RMP_TRY(in_.expect('[', "["));
    const std::uint32_t start = in_.offset();
    n.offset = start;
    RMP_TRY_ASSIGN(const std::string_view word, in_.word("the kind of a node"));
    n.node.parent = parent;
    RMP_TRY_ASSIGN(const auto frame, in_.frame("the frame of a node"));
    n.node.placement = frame.placement;
    n.node.is_global = frame.is_global && parent >= 0;
    if (word == "Union") n.node.kind = CsgKind::union_;
    else if (word == "Difference") n.node.kind = CsgKind::difference;
    else if (word == "Intersection") n.node.kind = CsgKind::intersection;
    else RMP_TRY(primitive(n, std::string(word), start));
    RMP_TRY(in_.expect(']', "]"));
    nodes_.push_back(std::move(n));
    return {};
  }

  Result<void> primitive(Node& n, const std::string& word, std::uint32_t start) {
    static const std::map<std::string, std::size_t> kCounts{
        {"Sphere", 3}, {"Cylinder", 5}, {"Cube", 5}, {"Cone", 4}, {"Pyramid", 3}};
    const auto count = kCounts.find(word);
    if (count == kCounts.end())
      return in_.at(start, "there is no primitive " + quote(word),
                    "There are Sphere, Cylinder, Cube, Cone and Pyramid.");
    const std::uint32_t sizes_at = in_.offset();
    RMP_TRY_ASSIGN(auto v, in_.tuple("the sizes"));
    if (v.size() != count->second)
      return in_.at(sizes_at, "a " + word + " has " + std::to_string(count->second) +
                                  " numbers, not " + std::to_string(v.size()));
    const std::size_t lengths = word == "Cube"                            ? 5
                                : word == "Cylinder" || word == "Pyramid" ? 3
                                : word == "Cone"                          ? 2
                                                                          : 1;
    for (std::size_t i = 0; i < lengths; ++i) v[i] = in_.metres(v[i]);
    n.material_offset = in_.offset();
    RMP_TRY_ASSIGN(n.material, in_.text("the file of the material"));
    if (word == "Sphere") {
      n.node.kind = CsgKind::sphere;
      n.node.sizes = {v[0]};
      return {};
    }
    if (word == "Cylinder") round(n, v[0], v[1], v[2]);
    else if (word == "Cube") block(n, v[0], v[1], v[2], v[3], v[4]);
    else if (word == "Cone") round(n, v[0], 0, v[1]);
    else block(n, v[0], v[1], 0, 0, v[2]);
    if (word == "Cone" || word == "Pyramid")
      out_.notes.push_back(
          s_.place(start) + ": no file of the 2006 program with a " + word +
          " is known; it is read as " +
          (word == "Cone" ? "(radius, height, slices, stacks)" : "(x, y, height)") +
          ", centred like a " + (word == "Cone" ? "Cylinder." : "Cube."));
    return {};
  }

  /// Those stand about the middle of their height, ours on z = 0.
  static void stand(Node& n, double height) {
    Placement& p = n.node.placement;
    const Pose t = pose(p);
    p.position = spatial::transform(t, {0, 0, -height / 2});
    p.coordinates = PositionRepresentation::cartesian;
  }

  static void round(Node& n, double base, double top, double height) {
    if (base == top) {
      n.node.kind = CsgKind::cylinder;
      n.node.sizes = {base, height, 0};
    } else {
      n.node.kind = CsgKind::cone;
      n.node.sizes = {base, top, height};
    }
    stand(n, height);
  }

  static void block(Node& n, double x1, double y1, double x2, double y2, double height) {
    if ((x1 == 0 || y1 == 0) && x2 > 0 && y2 > 0) {  // an edge or point below: upside down
      const Pose turned{spatial::from_rpy({std::numbers::pi, 0, 0}), {}};
      n.node.placement = placement(spatial::compose(pose(n.node.placement), turned));
      std::swap(x1, x2);
      std::swap(y1, y2);
    }
    if (x1 == x2 && y1 == y2) {
      n.node.kind = CsgKind::box;
      n.node.sizes = {x1, y1, height, 0};
    } else {
      n.node.kind = CsgKind::frustum;
      n.node.sizes = {x1, y1, x2, y2, height};
    }
    stand(n, height);
  }

  // ---- object ----

  Result<void> object(const std::string& words) {
    RMP_TRY(in_.tuple("the dynamic parameters"));  // cached there, computed here
    out_.is_assembly = true;
    Object o;
    o.description = words;
    FreshNames names;
    std::vector<Pose> open;
    std::size_t frames = 0;
    RMP_TRY(in_.expect('{', "{"));
    do {
      if (frames > 0 && in_.accept('}')) {
        open.pop_back();
        (void)in_.accept(',');
        continue;
      }
      if (frames > 0) RMP_TRY(in_.expect('{', "{ or }"));
      if (++frames > kMostLegacyNodes)
        return in_.at(in_.offset(),
                      "the tree has more than " + std::to_string(kMostLegacyNodes) + " parts");
      RMP_TRY(in_.expect('[', "["));
      const std::uint32_t at = in_.offset();
      RMP_TRY_ASSIGN(const std::string path, in_.text("the file of a part"));
      RMP_TRY_ASSIGN(auto frame, in_.frame("the frame of a part"));
      RMP_TRY(in_.expect(']', "]"));
      Placement place = frame.placement;
      if (!frame.is_global && !open.empty() && !is_identity(open.back()))
        place = placement(spatial::compose(open.back(), pose(place)));
      open.push_back(pose(place));
      if (path.empty()) continue;  // a bare frame
      const std::size_t index = o.parts.size();
      o.parts.push_back({names.fresh(plain_name(legacy_stem(path), "part")), {}, place, {}});
      Reference r;
      r.path = path;
      r.offset = at;
      r.kinds = {Kind::solid, Kind::object};
      r.owner = "part " + quote(o.parts.back().name);
      r.set = [index](Body& b, AnyId id) { std::get<Object>(b).parts[index].what = id; };
      out_.places[{"part", index}] = at;
      out_.references.push_back(std::move(r));
    } while (!open.empty());
    out_.record.body = std::move(o);
    return {};
  }

  static bool is_identity(const Pose& t) { return t.p == Vec3{} && t.R == Pose{}.R; }

  const Syntax& s_;
  LegacyReader in_;
  std::string name_;
  bool as_solid_;
  std::vector<Node> nodes_;
  LegacyBound out_;
};

constexpr const char* kSiblings[] = {"Materials", "CSGs",         "Objects",
                                     "Robots",    "Trajectories", "Worlds"};

/// Reads files and what they refer to: worlds to robots, objects and trajectories, robots to
/// objects, objects to solids, solids to materials.
class LegacyLoader {
 public:
  explicit LegacyLoader(document::Transaction& tx) : tx_(tx) {}

  Result<Loaded> run(const fs::path& file, std::optional<Kind> wanted) {
    auto id = open(file, file.generic_string(), wanted, nullptr);
    if (!id.ok()) {
      for (auto it = added_.rbegin(); it != added_.rend(); ++it) (void)tx_.remove(*it).ok();
      return std::move(id).error();
    }
    out_.id = *id;
    return std::move(out_);
  }

 private:
  /// A text that is being read; bound records point into it.
  struct Source {
    std::string text;
    Syntax syntax;
    fs::path folder;
  };

  /// `from` is the reference that led here, with the text it stands in; none for the file asked
  /// for.
  struct From {
    const Source& source;
    const Reference& reference;
  };

  Result<AnyId> open(const fs::path& file, const std::string& shown, std::optional<Kind> wanted,
                     const From* from) {
    RMP_TRY_ASSIGN(const std::string bytes, read_file(file));
    auto source = std::make_unique<Source>();
    source->text = to_utf8(bytes);
    source->syntax.file = shown;
    source->syntax.text = source->text;
    source->folder = file.parent_path();
    if (!is_legacy(bytes))
      return source->syntax.at(0, ErrorCode::syntax, "this is not a file of the 2006 program");
    if (const auto bad = source->text.find('\0'); bad != std::string::npos)
      return source->syntax.at(static_cast<std::uint32_t>(bad), ErrorCode::syntax,
                               "this is a binary file, not a text", "A text has no zero bytes.");
    RMP_TRY_ASSIGN(
        LegacyBound bound,
        LegacyBinder(source->syntax, file.stem().string(), !from && wanted == Kind::solid).run());
    const Kind kind = bound.record.kind();
    if (from) {
      RMP_TRY(check_kind(from->source, from->reference, kind, bound.is_assembly));
    } else if (wanted && kind != *wanted && !(kind == Kind::solid && wanted == Kind::object)) {
      return source->syntax.at(0, ErrorCode::invalid_argument,
                               "this is " + document::with_article(to_string(kind)) + ", not " +
                                   document::with_article(to_string(*wanted)),
                               std::string(to_string(kind)) + ".load reads it.");
    }
    out_.notes.insert(out_.notes.end(), bound.notes.begin(), bound.notes.end());
    // The name of the file is left for an object that holds this one as its first part.
    if (from && kind == Kind::object && !bound.is_assembly) bound.record.name += " parts";
    if (!from && wanted == Kind::object && kind == Kind::solid) bound = one_part(std::move(bound));
    return add(*source, std::move(bound));
  }

  /// Objects hold solids only; robots and worlds ask for objects first.
  static Result<void> check_kind(const Source& source, const Reference& r, Kind kind,
                                 bool is_assembly) {
    const bool is_nested = is_assembly && r.kinds.front() != Kind::object;
    if (!is_nested && std::find(r.kinds.begin(), r.kinds.end(), kind) != r.kinds.end()) return {};
    return source.syntax.at(r.offset, ErrorCode::invalid_argument,
                            "the file " + quote(r.path) + " holds " +
                                document::with_article(to_string(kind)) + ", but " + r.owner +
                                " needs " + document::with_article(to_string(r.kinds.front())));
  }

  /// A solid as the only part of an object.
  static LegacyBound one_part(LegacyBound solid) {
    LegacyBound out;
    Object o;
    out.record.name = solid.record.name;
    o.parts.push_back({plain_name(solid.record.name, "part"), {}, {}, {}});
    Reference r;
    r.kinds = {Kind::solid};
    r.set = [](Body& b, AnyId id) { std::get<Object>(b).parts[0].what = id; };
    out.references.push_back(std::move(r));
    out.made[0] = std::make_shared<LegacyBound>(std::move(solid));
    out.record.body = std::move(o);
    return out;
  }

  // NOLINTNEXTLINE(misc-no-recursion): at most world, robot, object, object of one .csg, solid,
  // material, since what a kind may refer to is always further down this list.
  Result<AnyId> add(const Source& source, LegacyBound bound) {
    RMP_TRY(check(source, bound));
    for (std::size_t i = 0; i < bound.references.size(); ++i) {
      const Reference& r = bound.references[i];
      AnyId target;
      if (const auto made = bound.made.find(i); made != bound.made.end()) {
        RMP_TRY_ASSIGN(target, add(source, *made->second));
      } else {
        RMP_TRY_ASSIGN(target, follow(source, r));
      }
      r.set(bound.record.body, target);
    }
    model::Record& record = bound.record;
    if (bound.finish) RMP_TRY(bound.finish(record.body, tx_.now(), out_.notes));
    if (const auto same = same_record(record)) {
      note_all(*same);
      return *same;
    }
    const std::string wanted = record.name;
    record.name = tx_.free_name(record.kind(), wanted);
    if (record.name != wanted)
      out_.notes.push_back("The " + std::string(to_string(record.kind())) + " of " +
                           quote(source.syntax.file) + " is named " + quote(record.name) +
                           " here, since there is another " + quote(wanted) + " already.");
    auto id = tx_.add(std::move(record));
    if (!id.ok()) return std::move(id).error().in(source.syntax.file);
    added_.push_back(*id);
    note_all(*id);
    return *id;
  }

  void note_all(AnyId id) {
    std::erase(out_.all, id);
    out_.all.push_back(id);
  }

  /// Checks the record as the document would, with a stand-in for each reference.
  static Result<void> check(const Source& source, const LegacyBound& bound) {
    model::Record record = bound.record;
    for (const Reference& r : bound.references) r.set(record.body, {r.kinds.front(), 1});
    document::Subject subject;
    auto checked = document::check_record(record, &subject);
    if (checked.ok()) return {};
    const auto place = bound.places.find({subject.list, subject.index});
    return source.syntax.at(place == bound.places.end() ? 0 : place->second, checked.error().code,
                            checked.error().message, checked.error().hint);
  }

  // NOLINTNEXTLINE(misc-no-recursion)
  Result<AnyId> follow(const Source& source, const Reference& r) {
    const auto tried = places(source.folder, r.path);
    const auto found = std::find_if(tried.begin(), tried.end(), [](const fs::path& p) {
      return file_kind(p) == FileKind::file;
    });
    if (found == tried.end())
      return source.syntax.at(
          r.offset, ErrorCode::not_found,
          "there is no file " + quote(r.path) + ", which " + r.owner + " refers to",
          "References are looked for from the folder of the file upwards, and "
          "in the folders Materials, CSGs, Objects, Robots, Trajectories and Worlds beside it.");
    const std::string key = found->lexically_normal().generic_string();
    if (const auto known = opened_.find(key); known != opened_.end()) {
      RMP_TRY(check_kind(source, r, known->second.kind, false));
      return known->second;
    }
    const From from{source, r};
    RMP_TRY_ASSIGN(const AnyId id, open(*found, key, std::nullopt, &from));
    opened_.emplace(key, id);
    return id;
  }

  static std::vector<fs::path> places(const fs::path& folder, const std::string& reference) {
    std::string text = reference;
    std::replace(text.begin(), text.end(), '\\', '/');
    const fs::path path(text);
    std::vector<fs::path> out;
    std::error_code ec;
    const fs::path start = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, ec);
    if (path.is_absolute()) out.push_back(path);
    for (fs::path at = start; path.is_relative(); at = at.parent_path()) {
      out.push_back((at / path).lexically_normal());
      if (!at.has_relative_path()) break;
    }
    out.push_back(start / path.filename());
    for (const char* sibling : kSiblings)
      out.push_back(start.parent_path() / sibling / path.filename());
    return out;
  }

  std::optional<AnyId> same_record(const model::Record& record) const {
    const auto id = tx_.now().find(record.kind(), record.name);
    if (!id) return std::nullopt;
    model::Record known = *tx_.now().find(*id);
    known.file = record.file;
    if (!(document::record_fingerprint(known) == document::record_fingerprint(record)))
      return std::nullopt;
    return id;
  }

  document::Transaction& tx_;
  std::map<std::string, AnyId> opened_;
  std::vector<AnyId> added_;
  Loaded out_;
};

}  // namespace

Result<Loaded> load_legacy(document::Transaction& tx, const fs::path& file,
                           std::optional<Kind> wanted) {
  return LegacyLoader(tx).run(file, wanted);
}

bool is_legacy_file(const fs::path& file) {
  const auto bytes = read_file(file);
  return bytes.ok() && is_legacy(*bytes);
}

}  // namespace robomosp::io
