// SPDX-License-Identifier: Apache-2.0
#include "ioci/schema/choices.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <unordered_set>

#include "ioci/core/commands.h"
#include "ioci/core/interface_words.h"
#include "kernel/interface_file.h"
#include "kernel/letters.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/units.h"
#include "model/data.h"

namespace robomosp::ioci {
namespace {

/// What an argument names.
struct Owner {
  std::vector<const model::Record*> records{};
  recording::RecordingPtr recording{};
  /// False = no argument decides, and the records are all of a kind.
  bool is_given = false;
};

/// The arguments around a part, outermost first.
struct Level {
  const Schema* fields;
  const Map* given;
};

/// Members that are elements of a list of a record, by name; or by number where they have none.
struct ListMember {
  std::string_view word;
  Kind kind;
  std::string_view list;  ///< the record's field
};
constexpr ListMember kListMembers[] = {
    {"link", Kind::robot, "links"},
    {"link_or_base", Kind::robot, "links"},
    {"pose", Kind::robot, "poses"},
    {"tool", Kind::robot, "tools"},
    {"attached", Kind::robot, "attached"},
    {"loop", Kind::robot, "loops"},
    {"axis", Kind::robot, "axes"},
    {"robot", Kind::world, "robots"},
    {"object", Kind::world, "objects"},
    {"trajectory", Kind::world, "trajectories"},
    {"frame", Kind::world, "frames"},
    {"light", Kind::world, "lights"},
    {"task", Kind::world, "tasks"},
    {"program", Kind::world, "programs"},
    {"signal", Kind::world, "signals"},
    {"node", Kind::solid, "nodes"},
    {"part", Kind::object, "parts"},
    {"tcp", Kind::object, "tcps"},
    {"segment", Kind::trajectory, "segments"},
    {"step", Kind::task, "steps"},
};

void add_list(const model::Record& r, std::string_view list, std::vector<Choice>& out) {
  const model::Content content = model::content(r.body);
  const model::Field* field = content.type->field(list);
  if (!field) return;
  const void* elements = field->in(content.data);
  for (std::size_t i = 0; i < field->type->length(elements); ++i) {
    const std::string* name = model::name_of(*field->type->element, field->type->at(elements, i));
    if (name) out.push_back({Value(*name)});
    else out.push_back({Value(static_cast<std::int64_t>(i + 1))});
  }
}

/// What runs through the records of a kind.
using OfRecord = void (*)(CommandContext&, const model::Record&, std::vector<Choice>&);
/// What needs no owner.
using OfProgram = void (*)(CommandContext&, std::vector<Choice>&);

void add_joints(CommandContext&, const model::Record& r, std::vector<Choice>& out) {
  const auto& robot = std::get<model::Robot>(r.body);
  for (const model::Link& l : robot.links) {
    if (l.joint == model::JointKind::fixed) continue;
    Choice c{Value(l.name)};
    c.doc = model::kJointWords[static_cast<std::size_t>(l.joint)];
    if (l.mimic && l.mimic->link >= 0 &&
        static_cast<std::size_t>(l.mimic->link) < robot.links.size())
      c.why_not = "It follows the joint of link " +
                  text::quote(robot.links[static_cast<std::size_t>(l.mimic->link)].name) + ".";
    out.push_back(std::move(c));
  }
}

void add_tips(CommandContext& ctx, const model::Record& r, std::vector<Choice>& out) {
  const auto id = ctx.snapshot().find(Kind::robot, r.name);
  if (!id) return;
  const auto model = model_of(ctx, Map{{"id", Application::handle(*id)}});
  if (!model.ok()) return;
  for (const TipModel& tip : (*model)->tips) out.push_back({Value(tip.name)});
}

void add_links_and_tools(CommandContext&, const model::Record& r, std::vector<Choice>& out) {
  for (const char* list : {"tools", "attached", "links"}) add_list(r, list, out);
}

void add_robot_bodies(const model::Robot& robot, const std::string& prefix,
                      std::vector<Choice>& out) {
  out.push_back({Value(prefix + "base")});
  for (const model::Link& l : robot.links) out.push_back({Value(prefix + l.name)});
  for (const model::AttachedTool& t : robot.attached) out.push_back({Value(prefix + t.name)});
}

/// Bodies of a robot; of a world its objects and robots, and each robot's as `robot.link`.
void add_bodies(CommandContext& ctx, const model::Record& r, std::vector<Choice>& out) {
  if (const auto* robot = std::get_if<model::Robot>(&r.body)) {
    add_robot_bodies(*robot, "", out);
    return;
  }
  const auto* world = std::get_if<model::World>(&r.body);
  if (!world) return;
  add_list(r, "objects", out);
  add_list(r, "robots", out);
  for (const model::PlacedRobot& p : world->robots)
    if (const auto* robot = ctx.snapshot().get(p.robot))
      add_robot_bodies(*robot, p.name + ".", out);
}

void add_members(CommandContext&, const model::Record& r, std::vector<Choice>& out) {
  for (const ListMember& m : kListMembers) {
    if (m.kind != Kind::world) continue;
    const std::size_t from = out.size();
    add_list(r, m.list, out);
    for (std::size_t i = from; i < out.size(); ++i) out[i].doc = m.word;
  }
}

void add_parameters(CommandContext&, const model::Record& r, std::vector<Choice>& out) {
  if (const model::Parametric* own = model::parametric_of(r.body))
    for (const model::Parameter& p : own->parameters)
      out.push_back({Value(p.name), {}, p.description, {}});
}

/// Further members, of a kind of record each; a body is of a robot or a world.
struct RecordMember {
  std::string_view word;
  std::string_view kinds;
  OfRecord add;
};
constexpr RecordMember kRecordMembers[] = {
    {"joint", "robot", add_joints},
    {"tip", "robot", add_tips},
    {"link_or_tool", "robot", add_links_and_tools},
    {"body", "robot|world", add_bodies},
    {"member", "world", add_members},
    {"parameter", "material|solid|object|robot|trajectory|world|task", add_parameters},
};

void add_commands(CommandContext& ctx, std::vector<Choice>& out) {
  for (const CommandSpec* spec : ctx.app.commands.list())
    out.push_back({Value(spec->name), {}, spec->summary, {}});
}
void add_kinds(CommandContext&, std::vector<Choice>& out) {
  for (const Kind k : all_kinds()) out.push_back({Value(to_string(k))});
}
void add_interfaces(CommandContext&, std::vector<Choice>& out) {
  constexpr std::string_view kPrefix = "robomosp.";
  for (const InterfaceEntry* entry : InterfaceFile::all()) {
    std::string word = entry->id.substr(0, entry->id.find('/'));
    if (word.starts_with(kPrefix)) word.erase(0, kPrefix.size());
    out.push_back({Value(std::move(word)), {}, entry->id, {}});
  }
}
void add_modules(CommandContext& ctx, std::vector<Choice>& out) {
  for (const ProviderInfo& p : ctx.app.registry.list("robomosp.module/1"))
    out.push_back({Value(p.name), {}, p.summary, {}});
}
void add_settings(CommandContext& ctx, std::vector<Choice>& out) {
  const auto listed = ctx.dispatch("plugin.settings", {});
  if (!listed.ok() || !listed->as_list()) return;
  for (const Value& each : *listed->as_list()) {
    const Map* m = each.as_map();
    const Value* name = m ? m->find("setting") : nullptr;
    const Value* plugin = m ? m->find("plugin") : nullptr;
    if (name && plugin) out.push_back({*name, {}, "Of plugin " + plugin->text() + ".", {}});
  }
}

struct ProgramMember {
  std::string_view word;
  OfProgram add;
};
constexpr ProgramMember kProgramMembers[] = {
    {"command", add_commands}, {"kind", add_kinds},       {"interface", add_interfaces},
    {"module", add_modules},   {"setting", add_settings},
};

/// Spellings of units that are offered behind a number.
constexpr const char* kOfferedUnits[] = {
    "m",     "cm",     "mm",     "in",     "deg",     "rad",     "s",      "ms",    "min",
    "kg",    "g",      "N",      "kN",     "N m",     "m/s",     "mm/s",   "deg/s", "rad/s",
    "m/s^2", "kg/m^3", "g/cm^3", "mm/s^2", "deg/s^2", "rad/s^2", "kg m^2", "%"};

class Chooser {
 public:
  Chooser(CommandContext& ctx, std::string_view prefix, bool from_library, std::size_t most)
      : ctx_(ctx), prefix_(prefix), from_library_(from_library), most_(most) {}

  Result<std::vector<Choice>> at(const Schema& schema, std::string_view path, const Map& given) {
    levels_.push_back({&schema, &given});
    const Schema* fields = &schema;
    const Map* here = &given;
    const ParamSpec* param = nullptr;
    const TypeTree* tree = nullptr;
    for (std::string_view rest = path; !rest.empty();) {
      const std::size_t end = std::min(rest.find_first_of(".["), rest.size());
      const std::string_view name = rest.substr(0, end);
      rest.remove_prefix(end);
      if (!fields) return unknown(path, name, {});
      const auto it = std::find_if(fields->begin(), fields->end(),
                                   [name](const ParamSpec& p) { return p.name == name; });
      if (it == fields->end()) return unknown(path, name, *fields);
      param = &*it;
      tree = &type_tree(param->type);
      const Value* part = here ? here->find(name) : nullptr;
      // Into elements: "[2]".
      while (!rest.empty() && rest.front() == '[') {
        const std::size_t close = rest.find(']');
        if (close == std::string_view::npos) return unknown(path, rest, {});
        const auto number = text::read_int(rest.substr(1, close - 1));
        rest.remove_prefix(close + 1);
        const List* list = part ? part->as_list() : nullptr;
        part = list && number && *number >= 1 && *number <= std::ssize(*list)
                   ? &(*list)[static_cast<std::size_t>(*number - 1)]
                   : nullptr;
        tree = element_tree(*tree);
        if (!tree) return unknown(path, name, {});
      }
      if (rest.empty()) break;
      if (rest.front() != '.' || rest.size() == 1) return unknown(path, rest, {});
      rest.remove_prefix(1);  // the dot
      here = part ? part->as_map() : nullptr;
      tree = with_fields(*tree);
      if (tree && tree->kind == TypeKind::variant) {
        fields = case_of(*tree, here);
        // The field that decides is a choice of its words.
        if (rest == tree->decided_by) {
          for (const auto& [word, unused] : tree->cases) add({Value(word)});
          return std::move(out_);
        }
        if (!fields)
          return error(ErrorCode::invalid_argument,
                       "it is not known which fields there are at " + text::quote(path),
                       "Give " + tree->decided_by + " first.");
      } else {
        fields = tree ? &tree->fields : nullptr;
      }
      if (fields) levels_.push_back({fields, here});
    }
    if (!param) return unknown(path, path, schema);
    if (tree->kind == TypeKind::word && tree->choices.empty()) {
      for (const WordInfo& w : words_of(*param)) add({Value(w.word), {}, w.doc, {}});
      return std::move(out_);
    }
    const std::string unit = unit_of(*param);
    of_type(*tree, unit, 0);
    return std::move(out_);
  }

 private:
  static Error unknown(std::string_view path, std::string_view name, const Schema& fields) {
    std::vector<std::string> known;
    for (const ParamSpec& p : fields) known.push_back(p.name);
    Error e = unknown_name("argument", name, known);
    return std::move(e).in(path);
  }

  static const TypeTree* resolved(const TypeTree& t) {
    return t.kind == TypeKind::named ? named_type(t.word) : &t;
  }
  /// The type of elements; of several types, of the first that has some.
  static const TypeTree* element_tree(const TypeTree& given) {
    const TypeTree* t = resolved(given);
    if (!t) return nullptr;
    if (t->kind == TypeKind::table) return t;
    if (t->element) return t->element.get();
    for (const auto& option : t->options)
      if (const TypeTree* found = element_tree(*option)) return found;
    return nullptr;
  }
  static const TypeTree* with_fields(const TypeTree& given) {
    const TypeTree* t = resolved(given);
    if (!t) return nullptr;
    if (!t->fields.empty() || t->kind == TypeKind::variant) return t;
    for (const auto& option : t->options)
      if (const TypeTree* found = with_fields(*option)) return found;
    return nullptr;
  }
  static const Schema* case_of(const TypeTree& t, const Map* given) {
    const Value* word = given ? given->find(t.decided_by) : nullptr;
    if (!word || !word->as_string()) return nullptr;
    for (const auto& [name, fields] : t.cases)
      if (name == *word->as_string()) return &fields;
    return nullptr;
  }

  void add(Choice c) {
    if (out_.size() >= most_) return;
    const std::string* own = c.value.as_string();
    const std::string made = own ? std::string() : c.value.text();
    const std::string& text = own ? *own : made;
    if (text.size() < prefix_.size() ||
        !std::equal(prefix_.begin(), prefix_.end(), text.begin(), [](char a, char b) {
          return std::tolower(static_cast<unsigned char>(a)) ==
                 std::tolower(static_cast<unsigned char>(b));
        }))
      return;
    if (!seen_.insert(text).second) return;
    out_.push_back(std::move(c));
  }

  void of_type(const TypeTree& t, const std::string& unit, std::size_t depth) {
    constexpr std::size_t kDeepestChoice = 10;
    if (depth > kDeepestChoice) return;
    switch (t.kind) {
      case TypeKind::boolean:
        add({Value(true)});
        add({Value(false)});
        break;
      case TypeKind::word:
        for (const WordInfo& w : t.choices) add({Value(w.word), {}, w.doc, {}});
        break;
      case TypeKind::one_of:
        for (const auto& option : t.options) of_type(*option, unit, depth + 1);
        break;
      case TypeKind::list:
        if (t.element) of_type(*t.element, t.element->unit, depth + 1);
        break;
      case TypeKind::variant:
        for (const auto& [word, fields] : t.cases) add({Value(word)});
        break;
      case TypeKind::named:
        if (const TypeTree* named = named_type(t.word)) of_type(*named, unit, depth + 1);
        break;
      case TypeKind::reference: references(t); break;
      case TypeKind::member: members(t.word, t.of); break;
      case TypeKind::provider: providers(t); break;
      case TypeKind::path: files(t); break;
      case TypeKind::real: units_behind(t.unit.empty() ? unit : t.unit); break;
      default: break;
    }
  }

  void references(const TypeTree& t) {
    const bool is_any = std::find(t.words.begin(), t.words.end(), "any") != t.words.end();
    for (const Kind k : all_kinds()) {
      const std::string_view word = to_string(k);
      if (!is_any && std::find(t.words.begin(), t.words.end(), word) == t.words.end()) continue;
      for (const AnyId id : ctx_.snapshot().list(k))
        add({Value(ctx_.snapshot().find(id)->name), {}, std::string(word), {}});
    }
    // Behind those of the document; of "any" kind there would be the whole library.
    for (const Kind k : all_kinds()) {
      const std::string_view word = to_string(k);
      if (!from_library_ || std::find(t.words.begin(), t.words.end(), word) == t.words.end())
        continue;
      for (const std::string& name : library_names(ctx_.app, k))
        add({Value(name), {}, std::string(word) + " of the library", {}});
    }
    if (std::find(t.words.begin(), t.words.end(), "recording") != t.words.end())
      for (const auto& [number, r] : ctx_.app.recordings.list())
        add({Value("recording#" + std::to_string(number)), r->title, {}, {}});
  }

  void providers(const TypeTree& t) {
    for (const std::string& word : t.words) {
      const auto id = interface_of_word(word);
      if (!id.ok()) continue;
      for (const ProviderInfo& p : ctx_.app.registry.list(*id))
        add({Value(p.name), {}, p.summary, p.enabled ? std::string() : "It is disabled."});
    }
  }

  void files(const TypeTree& t) {
    if (!ctx_.session.may(Effect::files_read)) return;
    const auto slash = prefix_.rfind('/');
    const std::string folder(slash == std::string_view::npos ? std::string_view()
                                                             : prefix_.substr(0, slash + 1));
    const auto listed =
        ctx_.dispatch("file.list", Map{{"folder", folder.empty() ? std::string(".") : folder}});
    if (!listed.ok() || !listed->as_list()) return;
    for (const Value& each : *listed->as_list()) {
      const Map* m = each.as_map();
      const Value* name = m ? m->find("name") : nullptr;
      const Value* kind = m ? m->find("kind") : nullptr;
      if (!name || !name->as_string() || !kind || name->as_string()->starts_with('.')) continue;
      const bool is_folder = *kind == Value("folder");
      const std::string file = folder + *name->as_string();
      if (is_folder) {
        add({Value(file + "/")});
      } else if (t.word != "folder") {
        const bool fits =
            t.words.empty() ||
            std::any_of(t.words.begin(), t.words.end(), [&](const std::string& pattern) {
              return file.ends_with(std::string_view(pattern).substr(pattern.starts_with('*')));
            });
        if (fits) add({Value(file)});
      }
    }
  }

  /// "12" gives "12 mm" and its like.
  void units_behind(const std::string& si) {
    const std::string_view number = text::trim(prefix_.substr(0, prefix_.find(' ')));
    if (number.empty() || !text::read_real(number)) return;
    for (const std::string_view part : text::split(si, '|')) {
      const auto own = units::parse(part);
      if (!own.ok() || part.empty()) continue;
      for (const char* each : kOfferedUnits)
        if (const auto unit = units::parse(each); unit.ok() && unit->dimension == own->dimension)
          add({Value(std::string(number) + " " + each)});
    }
  }

  void members(std::string_view word, const std::string& of) {
    std::vector<Choice> found;
    for (const ProgramMember& m : kProgramMembers)
      if (m.word == word) m.add(ctx_, found);
    for (const ListMember& m : kListMembers) {
      if (m.word != word) continue;
      const Owner owner = owner_of(of, to_string(m.kind));
      for (const model::Record* r : owner.records) {
        const std::size_t from = found.size();
        add_list(*r, m.list, found);
        if (!owner.is_given)
          for (std::size_t i = from; i < found.size(); ++i) {
            found[i].doc = "Of " + r->name + ".";
            found[i].is_decided = false;
          }
      }
      if (word == "link_or_base" && !owner.records.empty()) {
        found.push_back({Value("base")});
        found.back().is_decided = owner.is_given;
      }
    }
    for (const RecordMember& m : kRecordMembers) {
      if (m.word != word) continue;
      const Owner owner = owner_of(of, m.kinds);
      const std::size_t from = found.size();
      for (const model::Record* r : owner.records) m.add(ctx_, *r, found);
      for (std::size_t i = from; i < found.size(); ++i) found[i].is_decided = owner.is_given;
    }
    if (word == "column") {
      const Owner owner = owner_of(of, "recording");
      if (owner.recording)
        for (const recording::Column& c : owner.recording->columns)
          found.push_back({Value(c.name), {}, c.doc, {}});
    }
    for (Choice& c : found) add(std::move(c));
  }

  /// The value of an argument, from the innermost table out, and its type.
  [[nodiscard]] std::pair<const Value*, const TypeTree*> value_named(std::string_view name) const {
    for (auto it = levels_.rbegin(); it != levels_.rend(); ++it) {
      const auto param = std::find_if(it->fields->begin(), it->fields->end(),
                                      [name](const ParamSpec& p) { return p.name == name; });
      const Value* v = it->given ? it->given->find(name) : nullptr;
      if (v && !v->is_nil() && param != it->fields->end()) return {v, &type_tree(param->type)};
    }
    return {nullptr, nullptr};
  }

  /// What the argument `name` names, as records of some kinds; all of these kinds where it says
  /// nothing.
  [[nodiscard]] Owner owner_of(std::string_view name, std::string_view kinds,
                               std::size_t depth = 0) const {
    constexpr std::size_t kDeepestOwner = 5;
    Owner out;
    if (depth > kDeepestOwner) return out;
    if (name.empty()) name = "id";
    if (const auto [v, tree] = value_named(name); v) {
      if (const auto found = named_by(*v, *tree, kinds, depth)) return *found;
    } else if (kinds == "robot" && name != "id") {
      // The only robot of a world need not be named.
      if (const auto [world, of_world] = value_named("id"); world)
        if (const auto found = named_by(*world, *of_world, "world", depth);
            found && found->records.size() == 1)
          if (const auto* w = std::get_if<model::World>(&found->records[0]->body))
            for (const model::PlacedRobot& p : w->robots) add_robot(p, out);
      if (!out.records.empty()) return out;
    } else if (kinds == "world" && name == "world") {
      if (const auto [id, of_id] = value_named("id"); id)
        if (const auto found = named_by(*id, *of_id, kinds, depth)) return *found;
    }
    if (kinds == "recording") return out;
    for (const std::string_view kind : text::split(kinds, '|'))
      if (const auto k = kind_from(kind))
        for (const AnyId id : ctx_.snapshot().list(*k))
          out.records.push_back(ctx_.snapshot().find(id));
    return out;
  }

  void add_robot(const model::PlacedRobot& p, Owner& out) const {
    if (const auto* r = ctx_.snapshot().find(AnyId{Kind::robot, p.robot.number}))
      out.records.push_back(r);
  }

  /// nullopt = it names nothing of these kinds.
  [[nodiscard]] std::optional<Owner> named_by(const Value& v, const TypeTree& tree,
                                              std::string_view kinds, std::size_t depth) const {
    Owner out;
    out.is_given = true;
    if (tree.kind == TypeKind::one_of) {
      for (const auto& option : tree.options)
        if (auto found = named_by(v, *option, kinds, depth + 1)) return found;
      return std::nullopt;
    }
    if (tree.kind == TypeKind::reference || v.as_handle()) {
      const std::string all = text::join(tree.words, "|");
      const auto handle =
          ctx_.app.resolve(ctx_.snapshot(), tree.kind == TypeKind::reference ? all : "any", v);
      if (!handle.ok()) return std::nullopt;
      if (handle->kind == "recording") {
        out.recording = ctx_.app.recordings.find(handle->number);
        return kinds == "recording" && out.recording ? std::optional(out) : std::nullopt;
      }
      const auto id = Application::record_id(ctx_.snapshot(), *handle);
      if (!id.ok()) return std::nullopt;
      return of_kind(*id, kinds, out);
    }
    if (tree.kind != TypeKind::member || !v.as_string()) return std::nullopt;
    // A member of a world: the record that is there.
    const Owner world = owner_of(tree.of, "world", depth + 1);
    for (const model::Record* r : world.records) {
      const auto* w = std::get_if<model::World>(&r->body);
      if (!w) continue;
      for (const model::PlacedRobot& p : w->robots)
        if (p.name == *v.as_string())
          if (const auto found = of_kind(AnyId{Kind::robot, p.robot.number}, kinds, out))
            return found;
      for (const model::PlacedObject& p : w->objects)
        if (p.name == *v.as_string())
          if (const auto found = of_kind(p.what, kinds, out)) return found;
    }
    return std::nullopt;
  }

  [[nodiscard]] std::optional<Owner> of_kind(AnyId id, std::string_view kinds, Owner out) const {
    const auto* r = ctx_.snapshot().find(id);
    if (!r) return std::nullopt;
    for (const std::string_view kind : text::split(kinds, '|'))
      if (kind == to_string(id.kind)) {
        out.records = {r};
        return out;
      }
    return std::nullopt;
  }

  CommandContext& ctx_;
  std::string_view prefix_;
  bool from_library_;
  const std::size_t most_;
  std::vector<Level> levels_;
  std::vector<Choice> out_;
  std::unordered_set<std::string> seen_;
};

}  // namespace

Result<std::vector<Choice>> choices_of(CommandContext& ctx, const Schema& schema,
                                       std::string_view path, const Map& given,
                                       std::string_view prefix, bool from_library,
                                       std::size_t most) {
  return Chooser(ctx, prefix, from_library, most).at(schema, path, given);
}

std::vector<std::string> member_words() {
  std::vector<std::string> out{"column"};
  for (const ListMember& m : kListMembers) out.emplace_back(m.word);
  for (const RecordMember& m : kRecordMembers) out.emplace_back(m.word);
  for (const ProgramMember& m : kProgramMembers) out.emplace_back(m.word);
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace robomosp::ioci
