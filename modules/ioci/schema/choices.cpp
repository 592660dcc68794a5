// SPDX-License-Identifier: Apache-2.0
#include "ioci/schema/choices.h"

#include <algorithm>
#include <optional>

#include "document/each_record.h"
#include "ioci/core/commands.h"
#include "ioci/core/interface_words.h"
#include "ioci/core/runs.h"
#include "ioci/schema/member_choices.h"
#include "kernel/folder_names.h"
#include "kernel/letters.h"
#include "kernel/permit.h"
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

/// Spellings of units that are offered behind a number.
constexpr const char* kOfferedUnits[] = {
    "m",     "cm",     "mm",     "in",     "deg",     "rad",     "s",      "ms",    "min",
    "kg",    "g",      "N",      "kN",     "N m",     "m/s",     "mm/s",   "deg/s", "rad/s",
    "m/s^2", "kg/m^3", "g/cm^3", "mm/s^2", "deg/s^2", "rad/s^2", "kg m^2", "%"};

class Chooser {
 public:
  Chooser(CommandContext& ctx, std::string_view prefix, bool from_library, std::size_t most)
      : ctx_(ctx), prefix_(prefix), from_library_(from_library), out_(prefix, most) {}

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
      // Into elements: "[2]", or ".2" as paths of records have it.
      while (!rest.empty() && (rest.front() == '[' || is_numbered(rest))) {
        const bool is_bracket = rest.front() == '[';
        const std::size_t close = is_bracket ? rest.find(']') : rest.find_first_of(".[", 1);
        if (is_bracket && close == std::string_view::npos) return unknown(path, rest, {});
        const auto number = text::read_int(rest.substr(1, close - 1));
        rest.remove_prefix(std::min(rest.size(), is_bracket ? close + 1 : close));
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
          for (const auto& [word, unused] : tree->cases) add_word({word});
          return out_.take();
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
      for (const WordInfo& w : words_of(*param)) add_word(w);
      return out_.take();
    }
    const std::string unit = unit_of(*param);
    of_type(*tree, unit, 0);
    return out_.take();
  }

 private:
  /// ".2" at the front of a path.
  static bool is_numbered(std::string_view rest) {
    return rest.size() > 1 && rest.front() == '.' && rest[1] >= '0' && rest[1] <= '9';
  }
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

  void add_word(const WordInfo& w) {
    if (Choice* c = out_.add(w.word, w.doc)) c->label = word_label(w);
  }

  void of_type(const TypeTree& t, const std::string& unit, std::size_t depth) {
    constexpr std::size_t kDeepestChoice = 10;
    if (depth > kDeepestChoice) return;
    switch (t.kind) {
      case TypeKind::boolean:
        out_.add_value(Value(true));
        out_.add_value(Value(false));
        break;
      case TypeKind::word:
        for (const WordInfo& w : t.choices) add_word(w);
        break;
      case TypeKind::one_of:
        for (const auto& option : t.options) of_type(*option, unit, depth + 1);
        break;
      case TypeKind::list:
        if (t.element) of_type(*t.element, t.element->unit, depth + 1);
        break;
      case TypeKind::variant:
        for (const auto& [word, fields] : t.cases) add_word({word});
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
    const auto takes = [&t](std::string_view kind) {
      return std::find(t.words.begin(), t.words.end(), kind) != t.words.end();
    };
    const bool is_any = takes("any");
    std::vector<Kind> kinds;
    for (const Kind k : all_kinds())
      if (is_any || takes(to_string(k))) kinds.push_back(k);
    // By kind, but in one pass over the document.
    std::vector<std::vector<const std::string*>> names(all_kinds().size());
    std::size_t found = 0;
    document::each_record(ctx_.snapshot(), kinds, [&](AnyId id, const model::Record& r) {
      auto& of_kind = names[static_cast<std::size_t>(id.kind)];
      if (of_kind.size() < out_.room() && begins_with(r.name, prefix_)) {
        of_kind.push_back(&r.name);
        ++found;
      }
      return kinds.size() > 1 || found < out_.room();
    });
    for (const Kind k : kinds)
      for (const std::string* name : names[static_cast<std::size_t>(k)]) {
        if (out_.is_full()) return;
        out_.add(*name, to_string(k));
      }
    // Behind those of the document; of "any" kind there would be the whole library.
    if (from_library_ && !is_any)
      for (const Kind k : kinds)
        for (const std::string& name : library_names(ctx_.app, k))
          out_.add(name, std::string(to_string(k)) + " of the library");
    const auto add = [this](const char* kind, std::uint64_t number, const std::string& label) {
      if (Choice* c = out_.add(kind + ("#" + std::to_string(number)))) c->label = label;
    };
    if (takes("recording"))
      for (const auto& [number, r] : ctx_.app.recordings.list()) add("recording", number, r->title);
    if (takes("run"))
      for (const auto& [number, entry] : ctx_.app.runs->list()) add("run", number, entry->title);
    if (takes("job"))
      for (const JobStatus& s : ctx_.app.jobs.list()) add("job", s.id, s.label);
  }

  void providers(const TypeTree& t) {
    for (const std::string& word : t.words) {
      const auto id = interface_of_word(word);
      if (!id.ok()) continue;
      for (const ProviderInfo& p : ctx_.app.registry.list(*id))
        if (Choice* c = out_.add(p.name, p.summary); c && !p.enabled)
          c->why_not = "It is disabled.";
    }
  }

  void files(const TypeTree& t) {
    if (!ctx_.session.may(Effect::files_read) || !require(Effect::files_read).ok()) return;
    const auto slash = prefix_.rfind('/');
    const std::string folder(slash == std::string_view::npos ? std::string_view()
                                                             : prefix_.substr(0, slash + 1));
    const std::string_view begun = prefix_.substr(folder.size());
    const auto fits = [&](std::string_view name, FileKind kind) {
      if (name.starts_with('.') || !begins_with(name, begun)) return false;
      if (kind == FileKind::folder) return true;
      return t.word != "folder" &&
             (t.words.empty() ||
              std::any_of(t.words.begin(), t.words.end(), [&](const std::string& pattern) {
                return name.ends_with(std::string_view(pattern).substr(pattern.starts_with('*')));
              }));
    };
    const auto listed = first_names(folder.empty() ? "." : folder, out_.room(), fits);
    if (!listed.ok()) return;
    for (const FolderEntry& e : *listed)
      out_.add(folder + e.name + (e.kind == FileKind::folder ? "/" : ""));
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
          out_.add(std::string(number) + " " + each);
    }
  }

  void members(std::string_view word, const std::string& of) {
    for (const ProgramMember& m : program_members())
      if (m.word == word) m.add(ctx_, out_);
    for (const ListMember& m : list_members()) {
      if (m.word != word) continue;
      const Owner owner = owner_of(of, to_string(m.kind));
      const std::size_t first = out_.size();
      for (const model::Record* r : owner.records) {
        if (out_.is_full()) break;
        add_list(*r, m.list, out_, owner.is_given ? std::string() : "Of " + r->name + ".");
      }
      if (word == "link_or_base" && !owner.records.empty()) out_.add("base");
      leave_open(owner, first);
    }
    for (const RecordMember& m : record_members()) {
      if (m.word != word) continue;
      const Owner owner = owner_of(of, m.kinds);
      const std::size_t first = out_.size();
      for (const model::Record* r : owner.records) {
        if (out_.is_full()) break;
        m.add(ctx_, *r, out_);
      }
      leave_open(owner, first);
    }
    if (word == "column") {
      const Owner owner = owner_of(of, "recording");
      const std::size_t first = out_.size();
      const auto add = [this](const recording::Recording& r) {
        for (const recording::Column& c : r.columns) {
          if (out_.is_full()) break;
          out_.add(c.name, c.doc);
        }
      };
      if (owner.recording) add(*owner.recording);
      else if (!owner.is_given)
        for (const auto& [number, r] : ctx_.app.recordings.list()) add(*r);
      leave_open(owner, first);
    }
  }
  /// Choices from `first` on, of records that nothing given names.
  void leave_open(const Owner& owner, std::size_t first) {
    for (std::size_t i = first; i < out_.size(); ++i) out_[i].is_decided = owner.is_given;
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
    const auto [v, tree] = value_named(name);
    if (v)
      if (const auto found = named_by(*v, *tree, kinds, depth)) return *found;
    if (kinds == "robot" && (!v || name == "id")) {
      // The only robot of a world need not be named.
      if (const auto [world, of_world] = value_named("id"); world)
        if (const auto found = named_by(*world, *of_world, "world", depth);
            found && found->records.size() == 1)
          if (const auto* w = std::get_if<model::World>(&found->records[0]->body))
            for (const model::PlacedRobot& p : w->robots) add_robot(p, out);
      if (!out.records.empty()) return out;
    } else if (!v && kinds == "world" && name == "world") {
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
  ChoiceList out_;
  std::vector<Level> levels_;
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
  for (const ListMember& m : list_members()) out.emplace_back(m.word);
  for (const RecordMember& m : record_members()) out.emplace_back(m.word);
  for (const ProgramMember& m : program_members()) out.emplace_back(m.word);
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace robomosp::ioci
