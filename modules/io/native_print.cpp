// SPDX-License-Identifier: Apache-2.0
#include "io/native_print.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>
#include <vector>

#include "io/expressions.h"
#include "io/geometry.h"
#include "io/plain_fields.h"
#include "io/syntax.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "model/data.h"
#include "model/placement.h"
#include "model/words.h"
#include "robotics/coordinates.h"

namespace robomosp::io {

namespace {

using namespace model;
using text::quote;

constexpr std::size_t kMostIndent = 40;  ///< levels; deeper trees do not move further right

std::string name(const std::string& s) { return is_word(s) ? s : quote(s); }
std::string quantity(double v, std::string_view unit) { return units::print_quantity(v, unit); }

template <class Numbers>
std::string tuple(const Numbers& numbers, std::string_view unit) {
  std::string s = "(";
  for (std::size_t i = 0; i < std::size(numbers); ++i)
    s += (i ? ", " : "") + quantity(numbers[i], unit);
  return s + ")";
}

/// Fewest digits that give the same float again.
std::string shortest(float v) {
  for (int digits = 1; digits < 9; ++digits) {
    std::string s = text::print_rounded(static_cast<double>(v), digits);
    const auto back = text::read_real(s);
    if (back && static_cast<float>(*back) == v) return s;
  }
  return text::print_rounded(static_cast<double>(v), 9);
}
std::string tuple(const Colour& c) {
  std::string s = "(" + shortest(c.r) + ", " + shortest(c.g) + ", " + shortest(c.b);
  if (c.a != 1.0F) s += ", " + shortest(c.a);
  return s + ")";
}
bool same(const Colour& a, const Colour& b) {
  return a.r == b.r && a.g == b.g && a.b == b.b && a.a == b.a;
}

std::string parameter(const ProviderChoice::Param& p) {
  struct Visitor {
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(std::int64_t v) const { return std::to_string(v); }
    std::string operator()(double v) const {
      // A real stays a real: 5 would read back as an integer.
      std::string s = text::print(v);
      return s.find_first_of(".ein") == std::string::npos ? s + ".0" : s;
    }
    std::string operator()(const std::string& v) const { return quote(v); }
    std::string operator()(const std::vector<double>& v) const { return tuple(v, ""); }
  };
  return std::visit(Visitor{}, p);
}

/// Behind a number and on its line, the name would be taken for the number's unit: teeth 20  m 2.
bool reads_as_unit(std::string_view name) {
  const std::size_t end = name.find_first_of("._-");
  return units::parse(name.substr(0, end)).ok();
}

/// equal(), quicker for the values that most fields have.
bool is_same(const Type& type, const void* a, const void* b) {
  switch (type.shape) {
    case Shape::boolean: return *static_cast<const bool*>(a) == *static_cast<const bool*>(b);
    case Shape::text:
      return *static_cast<const std::string*>(a) == *static_cast<const std::string*>(b);
    case Shape::real:
      if (*static_cast<const double*>(a) == *static_cast<const double*>(b)) return true;
      break;
    case Shape::integer:
    case Shape::word: return type.whole(a) == type.whole(b);
    case Shape::reference: return type.id(a) == type.id(b);
    default: break;
  }
  return equal(Content{&type, a}, Content{&type, b});
}

class Printer {
 public:
  Printer(const document::Snapshot& snapshot, const Record& record,
          const std::filesystem::path& file, const PathOf& path_of)
      : snapshot_(snapshot), file_(file), path_of_(path_of), texts_(record.body) {}

  std::string run(const Record& r) {
    line("robomosp " + std::string(to_string(r.kind())) + " " + std::to_string(kVersion));
    line("name " + name(r.name));
    record_ = content(r.body);
    switch (r.kind()) {
      case Kind::solid: print(std::get<Solid>(r.body)); break;
      case Kind::robot: print(std::get<Robot>(r.body)); break;
      case Kind::trajectory: print(std::get<Trajectory>(r.body)); break;
      case Kind::task: print(std::get<Task>(r.body)); break;
      default: {
        for (const Entry& e : entries(*record_.type, record_.data, 0)) put(e);
      }
    }
    for (const KeptSolver& s : r.solvers) solver(s);
    return std::move(out_);
  }

 private:
  /// Its text line by line, so that it can be read in the file.
  void solver(const KeptSolver& s) {
    open("solver " + name(s.name) + " {");
    line("interface " + quote(s.interface));
    if (!s.provides.empty()) line("provides " + quote(s.provides));
    for (const std::string_view each : text::split(s.text, '\n')) line("line " + quote(each));
    close();
  }
  void print(const Solid& s) {
    words("description", s.description);
    if (s.material) line("material " + quote(path_of_(s.material)));
    if (differs(s.chord, Solid{}.chord)) line("chord " + quantity(s.chord, "m"));
    named_parameters(s.parametric);
    measured(s.measured);
    if (s.nodes.empty()) return;
    // Pre-order with an explicit stack; children keep their order.
    std::vector<std::vector<std::size_t>> inner(s.nodes.size());
    for (std::size_t i = 1; i < s.nodes.size(); ++i)
      inner[static_cast<std::size_t>(s.nodes[i].parent)].push_back(i);
    struct Step {
      std::size_t node, next;
    };
    std::vector<Step> stack;
    const auto enter = [&](std::size_t i) {
      const SolidNode& n = s.nodes[i];
      const CsgNodeInfo& info = csg_info(n.kind);
      const std::string start = std::string(info.name) + " " + name(n.name);
      const std::vector<std::string> fields = node_fields(n);
      if (info.children == CsgChildren::none && !n.profile) return block(start, fields);
      std::string line = start + " {";
      for (const auto& f : fields) line += "  " + f;
      open(line);
      if (n.profile) profile(*n.profile);
      if (info.children == CsgChildren::none) return close();
      stack.push_back({i, 0});
    };
    enter(0);
    while (!stack.empty()) {
      Step& top = stack.back();
      if (top.next == inner[top.node].size()) {
        stack.pop_back();
        close();
      } else {
        enter(inner[top.node][top.next++]);
      }
    }
  }

  /// What stands on the node's line: all but its profile and inner nodes.
  std::vector<std::string> node_fields(const SolidNode& n) {
    std::vector<std::string> fields = placement(n.placement);
    if (n.is_global) fields.emplace_back("frame global");
    if (n.is_centred) fields.emplace_back("centred true");
    for (std::string& f : sizes(n)) fields.push_back(std::move(f));
    if (!n.select.empty()) fields.push_back("select " + quote(n.select));
    if (n.geometry) {
      fields.push_back("geometry " + quote(geometry_file_name(file_, *n.geometry)));
      if (!n.geometry->source.empty()) fields.push_back("source " + quote(n.geometry->source));
    }
    for (const Entry& e : plain(plain_node_fields(), type_of<SolidNode>(), &n))
      fields.push_back(on_one_line(e));
    if (n.kind != CsgKind::custom) return fields;
    std::string primitive = "primitive " + name(n.primitive.name);
    if (!n.primitive.params.empty()) {
      std::string inner;
      for (const auto& [key, value] : n.primitive.params)
        inner += (inner.empty()        ? " "
                  : reads_as_unit(key) ? "\n" + std::string(2 * depth_ + 4, ' ')
                                       : "  ") +
                 key + " " + setting(value);
      primitive += " {" + inner + " }";
    }
    fields.push_back(std::move(primitive));
    return fields;
  }

  /// The value of a provider's parameter; its numbers may be expressions.
  [[nodiscard]] std::string setting(const ProviderChoice::Param& p) const {
    if (const auto* list = std::get_if<std::vector<double>>(&p)) return tuple(*list, "");
    const double* number = std::get_if<double>(&p);
    return parameter(p) + (number ? texts_.behind(*number) : std::string());
  }

  void profile(const CsgProfile& p) {
    open("profile {");
    for (const CsgLoop& l : p.loops) {
      if (!l.curves.empty() && l.curves[0].kind == CsgCurve::Kind::circle) {
        const auto& points = l.curves[0].points;
        block("loop", {"circle " + tuple(points[0], "m"), "radius " + quantity(points[1][0], "m")});
        continue;
      }
      open("loop {");
      line("start " + tuple(l.start, "m"));
      for (const CsgCurve& c : l.curves) {
        std::string s = c.kind == CsgCurve::Kind::line  ? "line"
                        : c.kind == CsgCurve::Kind::arc ? "arc"
                                                        : "spline";
        for (const auto& point : c.points) s += " " + tuple(point, "m");
        line(s);
      }
      close();
    }
    close();
  }

  /// Sizes that are not their default.
  std::vector<std::string> sizes(const SolidNode& n) {
    const CsgNodeInfo& info = csg_info(n.kind);
    std::vector<std::string> fields;
    for (std::size_t k = 0; k < csg_size_count(n.kind); ++k) {
      const CsgSize& size = info.sizes[k];
      if (size.required || differs(n.sizes[k], size.default_value))
        fields.push_back(std::string(size.name) + " " + quantity(n.sizes[k], size.unit));
    }
    return fields;
  }

  void measured(const std::optional<MeasuredMass>& m) {
    if (m) block("measured", measured_fields(*m));
  }
  [[nodiscard]] std::vector<std::string> measured_fields(const MeasuredMass& m) const {
    std::vector<std::string> fields{"mass " + quantity(m.mass.mass, "kg"),
                                    "com " + tuple(m.mass.com, "m"),
                                    "inertia " + inertia(m.mass.inertia)};
    if (!m.source.empty()) fields.push_back("source " + quote(m.source));
    return fields;
  }

  // ---- what the declarations of the fields say ----

  /// A line, or a block with the entries in it.
  struct Entry {
    std::string text;
    bool is_block = false;
    std::vector<Entry> inner{};
    bool is_tall = false;  ///< a block with a line for each entry
  };
  static std::vector<Entry> lines(std::vector<std::string> texts) {
    std::vector<Entry> out;
    for (std::string& t : texts) out.push_back({std::move(t)});
    return out;
  }

  /// On one line when there is no block inside, and no name behind a number that reads as its unit.
  static bool is_tall(const Entry& e) {
    for (std::size_t i = 0; i < e.inner.size(); ++i) {
      if (e.inner[i].is_block) return true;
      const char last = i > 0 ? e.inner[i - 1].text.back() : ' ';
      const std::string_view text = e.inner[i].text;
      if (last >= '0' && last <= '9' && reads_as_unit(text.substr(0, text.find(' ')))) return true;
    }
    return e.is_tall;
  }
  void put(const Entry& e) {
    if (!e.is_block) return line(e.text);
    if (is_tall(e)) {
      open(e.text + " {");
      for (const Entry& i : e.inner) put(i);
      return close();
    }
    std::vector<std::string> fields;
    for (const Entry& i : e.inner) fields.push_back(i.text);
    block(e.text, fields);
  }

  static std::string on_one_line(const Entry& e) {
    if (!e.is_block) return e.text;
    std::string out = e.text + " {";
    for (const Entry& i : e.inner) out += " " + on_one_line(i);
    return out + " }";
  }
  void add_plain(const model::Field& f, const Type& t, const void* p,
                 std::vector<Entry>& out) const {
    if (!f.counts || f.counts(p)) add_entries(t, f, p, t.alternative ? t.alternative(p) : 0, out);
  }
  /// Fields that are written as declared, of a struct that has others.
  [[nodiscard]] std::vector<Entry> plain(const PlainFields& fields, const Type& t,
                                         const void* p) const {
    std::vector<Entry> out;
    for (const model::Field* f : fields) add_plain(*f, t, p, out);
    return out;
  }

  [[nodiscard]] std::vector<Entry> entries(const Type& t, const void* p,
                                           std::size_t alternative) const {
    if (&t == &type_of<Placement>()) return lines(placement(*static_cast<const Placement*>(p)));
    if (&t == &type_of<MassProperties>())
      return lines(mass(*static_cast<const MassProperties*>(p)));
    if (&t == &type_of<MeasuredMass>())
      return lines(measured_fields(*static_cast<const MeasuredMass*>(p)));
    if (t.alternative) alternative = t.alternative(p);
    std::vector<Entry> out;
    for (const model::Field& f : t.fields) {
      const bool is_name = f.name == "name" && name_of(t, p) && &t != record_.type;
      if (is_name || (f.counts && !f.counts(p))) continue;
      add_entries(t, f, p, alternative, out);
    }
    return out;
  }

  void add_entries(const Type& t, const model::Field& f, const void* owner, std::size_t alternative,
                   std::vector<Entry>& out) const {
    const void* v = f.in(owner);
    switch (f.type->shape) {  // what most fields are
      case Shape::boolean:
      case Shape::integer:
      case Shape::real:
      case Shape::text:
      case Shape::word:
      case Shape::reference: return add_single(t, f, owner, alternative, out);
      default: break;
    }
    if (f.type == &type_of<Parametric>()) {
      for (const Parameter& each : static_cast<const Parametric*>(v)->parameters)
        out.push_back({print_parameter(each)});
    } else if (f.type->shape == Shape::list) {
      for (std::size_t i = 0; i < f.type->length(v); ++i)
        out.push_back(element(f, f.type->at(v, i), owner, alternative));
    } else if (f.type->shape == Shape::table) {
      Entry block{std::string(f.word_in_files()), true};
      f.type->each(v, [&](const std::string& key, const void* each) {
        block.inner.push_back({key + " " + written(t, f, *f.type->element, each, owner, 0)});
      });
      if (!block.inner.empty()) out.push_back(std::move(block));
    } else if (f.type == &type_of<Placement>() && f.is_path_flat) {
      for (Entry& e : entries(*f.type, v, alternative)) out.push_back(std::move(e));
    } else if (f.type->shape == Shape::optional || f.type->shape == Shape::shared) {
      if (const void* inner = f.type->held(v))
        out.push_back(entry(t, f, *f.type->element, inner, owner, alternative));
    } else {
      add_single(t, f, owner, alternative, out);
    }
  }
  /// A field of one value, unless it has its default.
  void add_single(const Type& t, const model::Field& f, const void* owner, std::size_t alternative,
                  std::vector<Entry>& out) const {
    const void* v = f.in(owner);
    if (!f.is_needed && !f.is_always_written && is_same(*f.type, v, f.in(t.standard.get())) &&
        !has_expression(*f.type, v))
      return;
    if (f.type->shape == Shape::reference && !f.type->id(v)) return;
    out.push_back(entry(t, f, *f.type, v, owner, alternative));
  }

  [[nodiscard]] Entry element(const model::Field& f, const void* p, const void* owner,
                              std::size_t alternative) const {
    const Type& t = *f.type->element;
    std::string word(f.word_in_files());
    if (t.shape != Shape::structure) return entry(t, f, t, p, owner, alternative);
    if (&t == &type_of<CollisionPairRule>())
      return pair_rule(*static_cast<const CollisionPairRule*>(p));
    if (const std::string* own = name_of(t, p)) word += " " + name(*own);
    Entry block{word, true, entries(t, p, alternative)};
    // Lines of a text stand on lines.
    for (const model::Field& inner : t.fields)
      block.is_tall = block.is_tall || (inner.type->shape == Shape::list &&
                                        inner.type->element->shape == Shape::text);
    return block;
  }

  [[nodiscard]] Entry entry(const Type& t, const model::Field& f, const Type& type, const void* v,
                            const void* owner, std::size_t alternative) const {
    const std::string word(f.word_in_files());
    if (&type == &type_of<ProviderChoice>()) {
      const auto& choice = *static_cast<const ProviderChoice*>(v);
      Entry e{choice.name.empty() ? word : word + " " + name(choice.name)};
      e.is_block = e.is_tall = !choice.params.empty();
      for (const auto& [key, value] : choice.params)
        e.inner.push_back({key + " " + setting(value)});
      return e;
    }
    if (type.shape == Shape::structure) return {word, true, entries(type, v, alternative)};
    if (type.shape == Shape::reference && f.is_written_by_kind)
      return {std::string(to_string(type.id(v).kind)) + " " + quote(path_of_(type.id(v)))};
    return {word + " " + written(t, f, type, v, owner, alternative)};
  }

  /// The value alone.
  [[nodiscard]] std::string written(const Type& t, const model::Field& f, const Type& type,
                                    const void* v, const void* owner,
                                    std::size_t alternative) const {
    const auto unit = [&](std::size_t k) { return f.unit_of(owner, k, alternative); };
    switch (type.shape) {
      case Shape::boolean: return *static_cast<const bool*>(v) ? "true" : "false";
      case Shape::integer:
        return f.index_in.empty() ? std::to_string(type.whole(v)) : element_name(f, type.whole(v));
      case Shape::real: {
        const auto& number = *static_cast<const double*>(v);
        if (!f.is_unit_written) return quantity(number, unit(0));
        return units::print_with_unit(number, unit(0)) + texts_.behind(number);
      }
      case Shape::text: return quote(*static_cast<const std::string*>(v));
      case Shape::word: return std::string(type.word_of(v));
      case Shape::numbers: {
        std::string s = "(";
        for (std::size_t i = 0; i < type.count; ++i)
          s += (i ? ", " : "") + quantity(static_cast<const double*>(v)[i], unit(i));
        return s + ")";
      }
      case Shape::reals: {
        const auto& q = *static_cast<const std::vector<double>*>(v);
        if (f.si_unit != kByJoint) return tuple(q, unit(0));
        const Robot* robot = &t == &type_of<PlacedRobot>()
                                 ? snapshot_.get(static_cast<const PlacedRobot*>(owner)->robot)
                                 : nullptr;
        return joint_values(robot ? *robot : Robot{}, q);
      }
      case Shape::colour: return tuple(*static_cast<const Colour*>(v));
      case Shape::reference: return quote(path_of_(type.id(v)));
      case Shape::setting: return setting(*static_cast<const ProviderChoice::Param*>(v));
      default: return {};
    }
  }
  [[nodiscard]] std::string element_name(const model::Field& f, std::int64_t i) const {
    const model::Field* list = record_.type->field(f.index_in);
    if (!list || i < 0) return "base";
    const void* p = list->type->at(list->in(record_.data), static_cast<std::size_t>(i));
    const std::string* own = name_of(*list->type->element, p);
    return own ? name(*own) : std::to_string(i + 1);
  }
  [[nodiscard]] bool has_expression(const Type& type, const void* v) const {
    if (texts_.empty()) return false;
    if (type.shape == Shape::real) return texts_.has(*static_cast<const double*>(v));
    bool has = false;
    if (type.shape == Shape::reals)
      for (const double& number : *static_cast<const std::vector<double>*>(v))
        has = has || texts_.has(number);
    if (type.shape == Shape::numbers)
      for (std::size_t i = 0; i < type.count; ++i)
        has = has || texts_.has(static_cast<const double*>(v)[i]);
    if (type.shape == Shape::structure)
      for (const model::Field& f : type.fields) has = has || has_expression(*f.type, f.in(v));
    return has;
  }
  static Entry pair_rule(const CollisionPairRule& p) {
    std::vector<std::string> fields{"a " + quote(p.a), "b " + quote(p.b)};
    if (!p.reason.empty()) fields.push_back("reason " + quote(p.reason));
    return {p.is_allowed ? "allowed_pair" : "checked_pair", true, lines(std::move(fields))};
  }

  void print(const Robot& r) {
    words("description", r.description);
    words("source", r.source);
    named_parameters(r.parametric);
    line(r.convention == Convention::dh ? "convention dh" : "convention mdh");
    if (r.mass_source != MassSource::given) line("masses designed");
    if (differs(r.base)) block("base", placement(r.base));
    for (const auto& p : r.base_parts) block("base_part", body(p.what, p.placement));
    if (r.base_mass) block("base_mass", mass(*r.base_mass));
    for (std::size_t i = 0; i < r.links.size(); ++i) link(r, i);
    if (differs(r.tool)) block("tool", placement(r.tool));
    if (r.payload) block("payload", mass(*r.payload));
    for (const auto& t : r.tools) tool(r, t);
    for (const auto& t : r.attached) {
      std::vector<std::string> fields = body(t.what, t.placement);
      fields.insert(fields.begin() + 1, "link " + link_name(r, t.link));
      block("attached " + name(t.name), fields);
    }
    words("tcp", r.tcp);
    for (const auto& l : r.loops) loop(r, l);
    for (const auto& p : r.poses) line("pose " + name(p.name) + " " + joint_values(r, p.q));
    for (const auto& a : r.axes) maker_axis(r, a);
    pair_rules(r.pair_rules);
    provider("ik", r.ik);
    provider("inverse_dynamics", r.inverse_dynamics);
    provider("forward_dynamics", r.forward_dynamics);
    provider("controller", r.controller);
    const Robot d;
    std::vector<std::string> skin;
    if (!same(r.skin_colour, d.skin_colour)) skin.push_back("colour " + tuple(r.skin_colour));
    if (!same(r.skin_accent, d.skin_accent)) skin.push_back("accent " + tuple(r.skin_accent));
    if (!skin.empty()) block("skin", skin);
  }

  void maker_axis(const Robot& r, const MakerAxis& a) {
    const MakerAxis d;
    const char* const unit = a.unit == AxisUnit::mm ? "m" : "rad";
    std::vector<std::string> fields{"link " + link_name(r, a.link)};
    if (a.sign != d.sign) fields.push_back("sign " + std::to_string(a.sign));
    if (differs(a.offset, d.offset)) fields.push_back("offset " + quantity(a.offset, unit));
    for (const AxisCoupling& c : a.coupled)
      fields.push_back("coupled { link " + link_name(r, c.link) +
                       (differs(c.ratio, 1) ? "  ratio " + quantity(c.ratio, "") : "") + " }");
    if (a.unit != d.unit) fields.emplace_back("unit mm");
    if (a.external) fields.emplace_back("external true");
    if (differs(a.lower, d.lower) || differs(a.upper, d.upper))
      fields.push_back("limits " + pair(a.lower, a.upper, unit));
    block("axis " + name(a.name), fields);
  }
  void link(const Robot& r, std::size_t i) {
    const Link& l = r.links[i];
    const Link d;
    const bool slides = l.joint == JointKind::prismatic;
    open("link " + name(l.name) + " {");
    if (l.parent != static_cast<std::int32_t>(i) - 1) line("parent " + link_name(r, l.parent));
    if (l.joint != JointKind::revolute) line("joint " + std::string(joint_word(l.joint)));
    if (l.convention) line(*l.convention == Convention::dh ? "convention dh" : "convention mdh");
    if (l.origin) {
      block("origin", placement(*l.origin));
      if (differs(l.axis, d.axis)) line("axis " + tuple(l.axis, ""));
    }
    if (!l.origin)
      block("row", {"a " + quantity(l.row.a, "m"), "alpha " + quantity(l.row.alpha, "rad"),
                    "d " + quantity(l.row.d, "m"), "theta " + quantity(l.row.theta, "rad")});
    if (l.mimic) {
      std::vector<std::string> fields{"link " + link_name(r, l.mimic->link)};
      if (differs(l.mimic->ratio, 1)) fields.push_back("ratio " + quantity(l.mimic->ratio, ""));
      if (differs(l.mimic->offset, 0))
        fields.push_back("offset " + quantity(l.mimic->offset, slides ? "m" : "rad"));
      block("mimic", fields);
    }
    // In order of declaration, as the files have always been written.
    const PlainFields& plain_fields = plain_link_fields();
    std::vector<Entry> entries_of_field;
    const Type& type = type_of<Link>();
    for (const model::Field& f : type.fields) {
      if (f.name == "lower" && (differs(l.lower, d.lower) || differs(l.upper, d.upper)))
        line("limits " + pair(l.lower, l.upper, slides ? "m" : "rad"));
      else if (f.name == "drive") drive(l.drive);
      else if (f.name == "given" && l.given) block("given", mass(*l.given));
      else if (f.name == "parts")
        for (const auto& p : l.parts) block("part", body(p.what, p.placement));
      else if (std::find(plain_fields.begin(), plain_fields.end(), &f) != plain_fields.end())
        add_plain(f, type, &l, entries_of_field);
      for (const Entry& e : entries_of_field) put(e);
      entries_of_field.clear();
    }
    close();
  }
  void drive(const Drive& d) {
    std::vector<std::string> fields;
    for (const Entry& e : plain(plain_drive_fields(), type_of<Drive>(), &d))
      fields.push_back(on_one_line(e));
    if (differs(d.coulomb_positive, 0) || differs(d.coulomb_negative, 0))
      fields.push_back("coulomb " + pair(d.coulomb_positive, d.coulomb_negative, "N m"));
    if (!fields.empty()) block("drive", fields);
  }

  [[nodiscard]] static std::string link_name(const Robot& r, std::int32_t link) {
    return link < 0 ? std::string("base") : name(r.links[static_cast<std::size_t>(link)].name);
  }
  /// "mass ...  com (...)  inertia (...)", without what is zero.
  [[nodiscard]] std::vector<std::string> mass(const MassProperties& m) const {
    const Sym3& s = m.inertia;
    std::vector<std::string> fields{"mass " + quantity(m.mass, "kg")};
    if (differs(m.com, {})) fields.push_back("com " + tuple(m.com, "m"));
    const bool has_inertia = differs(s.xx, 0) || differs(s.yy, 0) || differs(s.zz, 0) ||
                             differs(s.xy, 0) || differs(s.yz, 0) || differs(s.xz, 0);
    if (has_inertia) fields.push_back("inertia " + inertia(s));
    return fields;
  }
  /// Its elements where they are, so that their expressions are found.
  [[nodiscard]] std::string inertia(const Sym3& s) const {
    std::string out;
    for (const double* v : {&s.xx, &s.yy, &s.zz, &s.xy, &s.yz, &s.xz})
      out += (out.empty() ? "(" : ", ") + quantity(*v, "kg m^2");
    return out + ")";
  }
  void tool(const Robot& r, const RobotTool& t) {
    std::vector<std::string> fields{"link " + link_name(r, t.link)};
    for (auto& f : placement(t.placement)) fields.push_back(std::move(f));
    if (!t.payload) return block("tool " + name(t.name), fields);
    std::string line = "tool " + name(t.name) + " {";
    for (const auto& f : fields) line += "  " + f;
    open(line);
    block("payload", mass(*t.payload));
    close();
  }
  void loop(const Robot& r, const LoopClosure& l) {
    open("loop " + name(l.name) + " {");
    line("kind " + std::string(loop_word(l.kind)));
    for (const auto& [word, link, at] :
         {std::tuple("a", l.link_a, &l.in_a), {"b", l.link_b, &l.in_b}}) {
      std::vector<std::string> fields{"link " + link_name(r, link)};
      for (auto& f : placement(*at)) fields.push_back(std::move(f));
      block(word, fields);
    }
    close();
  }

  void print(const Trajectory& t) {
    words("description", t.description);
    named_parameters(t.parametric);
    if (differs(t.sample_time, Trajectory{}.sample_time))
      line("sample_time " + quantity(t.sample_time, "s"));
    std::vector<Entry> along;
    const Type& type = type_of<Trajectory>();
    add_entries(type, *type.field("along"), &t, 0, along);
    for (const Entry& e : along) put(e);
    for (const auto& s : t.segments) {
      if (s.stored) {
        open("segment {");
        line("trajectory " + quote(path_of_(s.stored)));
        for (const auto& field : placement(s.placement)) line(field);
      } else {
        open("segment " + name(s.shape.name) + " {");
        parameters(s.shape);
        provider("law", s.law);
        provider("orientation", s.orientation);
        provider("turning", s.turning);
        for (const auto& p : s.points) block("point", placement(p));
        for (const auto& q : s.joints) line("joints " + joint_values(Robot{}, q));
      }
      transition(s.transition);
      for (const Entry& e : plain(plain_segment_fields(), type_of<TrajectorySegment>(), &s)) put(e);
      close();
    }
  }

  void transition(const Transition& t) {
    if (!t.is_smooth) return line("transition none");
    std::vector<std::string> fields;
    if (differs(t.distance, 0)) fields.push_back("distance " + quantity(t.distance, "m"));
    if (differs(t.speed, 0)) fields.push_back("speed " + quantity(t.speed, "m/s"));
    if (!fields.empty()) block("transition", fields);
  }

  void print(const Task& t) {
    words("description", t.description);
    named_parameters(t.parametric);
    std::vector<std::int32_t> open{-1};
    for (std::size_t i = 0; i < t.steps.size(); ++i) {
      const TaskStep& s = t.steps[i];
      while (open.back() != s.parent) {
        open.pop_back();
        close();
      }
      const std::string word(to_string(s.kind));
      const auto fields = step(s);
      if (!is_block(s.kind)) {
        block(word, fields);
        continue;
      }
      open_step(word, fields);
      open.push_back(static_cast<std::int32_t>(i));
    }
    for (; open.size() > 1; open.pop_back()) close();
  }
  void open_step(const std::string& word, const std::vector<std::string>& fields) {
    std::string start = word + " {";
    for (const auto& f : fields) start += " " + f;
    open(start);
  }
  [[nodiscard]] std::vector<std::string> step(const TaskStep& s) const {
    std::vector<std::string> fields;
    std::vector<Entry> written_as_declared;
    const Type& type = type_of<TaskStep>();
    for (const model::Field* f : file_step_fields(s.kind)) {
      if (f->name == "profile") {
        if (!s.profile.empty()) fields.push_back("profile " + s.profile);
      } else if (f->name == "is_straight") {
        if (s.is_straight) fields.emplace_back("path straight");
      } else {
        written_as_declared.clear();
        add_plain(*f, type, &s, written_as_declared);
        for (Entry& e : written_as_declared)
          fields.push_back(e.is_block ? on_one_line(e) : std::move(e.text));
      }
    }
    return fields;
  }

  void pair_rules(const std::vector<CollisionPairRule>& rules) {
    for (const CollisionPairRule& p : rules) put(pair_rule(p));
  }

  // ---- numbers: a number of the record itself is followed by its expression ----

  [[nodiscard]] std::string quantity(const double& v, std::string_view unit) const {
    return io::quantity(v, unit) + texts_.behind(v);
  }
  template <class Numbers>
  [[nodiscard]] std::string tuple(const Numbers& numbers, std::string_view unit) const {
    std::string s = "(";
    for (std::size_t i = 0; i < std::size(numbers); ++i)
      s += (i ? ", " : "") + quantity(numbers[i], unit);
    return s + ")";
  }
  static std::string tuple(const Colour& c) { return io::tuple(c); }
  [[nodiscard]] std::string pair(const double& a, const double& b, std::string_view unit) const {
    return "(" + quantity(a, unit) + ", " + quantity(b, unit) + ")";
  }
  /// Whether a number must be written although it is the default.
  [[nodiscard]] bool differs(const double& v, double standard) const {
    return v != standard || texts_.has(v);
  }
  [[nodiscard]] bool differs(const Placement& p) const { return p != Placement{} || texts_.has(p); }
  [[nodiscard]] bool differs(const Vec3& v, const Vec3& standard) const {
    return differs(v[0], standard[0]) || differs(v[1], standard[1]) || differs(v[2], standard[2]);
  }
  /// "at (...)  rpy (...)", without what is zero.
  [[nodiscard]] std::vector<std::string> placement(const Placement& p) const {
    std::vector<std::string> fields;
    if (differs(p.position, {}) || p.coordinates != PositionRepresentation::cartesian) {
      const auto units = position_units(p.coordinates);
      fields.push_back(
          std::string(word_of(p.coordinates)) + " (" + quantity(p.position[0], units[0]) + ", " +
          quantity(p.position[1], units[1]) + ", " + quantity(p.position[2], units[2]) + ")");
    }
    if (differs(p.angles, {}) || p.notation != AngleRepresentation::rpy)
      fields.push_back(std::string(word_of(p.notation)) + " " + tuple(p.angles, "rad"));
    return fields;
  }
  void named_parameters(const Parametric& p) {
    for (const Parameter& v : p.parameters) line(print_parameter(v));
  }

  // ---- parts of records ----

  std::vector<std::string> body(AnyId what, const Placement& at) {
    std::vector<std::string> fields{std::string(to_string(what.kind)) + " " +
                                    quote(path_of_(what))};
    for (auto& f : placement(at)) fields.push_back(std::move(f));
    return fields;
  }
  [[nodiscard]] std::string joint_values(const Robot& r, const std::vector<double>& q) const {
    const std::vector<std::string_view> joint_units = robotics::coordinate_units(r);
    const bool fits = joint_units.size() == q.size();
    std::string s = "(";
    for (std::size_t i = 0; i < q.size(); ++i)
      s += (i ? ", " : "") + quantity(q[i], fits ? joint_units[i] : "");
    return s + ")";
  }
  void provider(const std::string& field, const ProviderChoice& p) {
    if (p.name.empty() && p.params.empty()) return;
    const std::string start = p.name.empty() ? field : field + " " + name(p.name);
    if (p.params.empty()) return line(start);
    open(start + " {");
    parameters(p);
    close();
  }
  void parameters(const ProviderChoice& p) {
    for (const auto& [key, value] : p.params) line(key + " " + setting(value));
  }
  void words(const std::string& field, const std::string& s) {
    if (!s.empty()) line(field + " " + quote(s));
  }

  // ---- lines ----

  void line(const std::string& s) {
    out_.append(2 * std::min(depth_, kMostIndent), ' ');
    out_ += s;
    out_ += '\n';
  }
  void open(const std::string& s) {
    line(s);
    ++depth_;
  }
  void close() {
    --depth_;
    line("}");
  }
  /// `start { field  field }` on one line.
  void block(const std::string& start, const std::vector<std::string>& fields) {
    std::string s = start + " {";
    for (std::size_t i = 0; i < fields.size(); ++i) s += (i ? "  " : " ") + fields[i];
    line(s + " }");
  }

  const document::Snapshot& snapshot_;
  const std::filesystem::path& file_;
  const PathOf& path_of_;
  ExpressionTexts texts_;
  Content record_;  ///< of a kind that is written by its declarations
  std::string out_;
  std::size_t depth_ = 0;
};

}  // namespace

Result<std::string> print_record(const document::Snapshot& snapshot, const Record& record,
                                 const std::filesystem::path& file, const PathOf& path_of) {
  return Printer(snapshot, record, file, path_of).run(record);
}

}  // namespace robomosp::io
