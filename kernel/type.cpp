// SPDX-License-Identifier: Apache-2.0
#include "kernel/type.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>

#include "kernel/check.h"
#include "kernel/literal.h"
#include "kernel/text.h"
#include "kernel/type_forms.h"
#include "kernel/units.h"

namespace robomosp {
namespace {

using TreePtr = std::shared_ptr<const TypeTree>;

constexpr std::size_t kDeepestType = 40;  ///< types inside each other
constexpr std::size_t kLongestType = 1 << 20;

struct Word {
  std::string_view text;
  TypeKind kind;
  std::string_view plain;  ///< as the host has always checked it
};
/// Types that are written as a word alone, or before details.
constexpr Word kWords[] = {
    {"any", TypeKind::any, "any"},          {"nil", TypeKind::nothing, "nil"},
    {"bool", TypeKind::boolean, "bool"},    {"int", TypeKind::integer, "int"},
    {"real", TypeKind::real, "real"},       {"string", TypeKind::text, "string"},
    {"enum", TypeKind::word, "enum"},       {"path", TypeKind::path, "path"},
    {"colour", TypeKind::colour, "any"},    {"vec3", TypeKind::vector, "vec3"},
    {"vec", TypeKind::vector, "real[]"},    {"pose", TypeKind::pose, "pose"},
    {"matrix", TypeKind::matrix, "matrix"}, {"list", TypeKind::list, "list"},
    {"map", TypeKind::map, "map"},          {"table", TypeKind::table, "list"},
    {"variant", TypeKind::variant, "map"},  {"ref", TypeKind::reference, "ref"},
    {"handle", TypeKind::handle, "handle"}, {"array", TypeKind::array, "array"},
    {"member", TypeKind::member, "string"}, {"provider", TypeKind::provider, "any"},
    {"joints", TypeKind::joints, "any"},    {"expression", TypeKind::expression, "any"},
    {"script", TypeKind::script, "string"}, {"type", TypeKind::named, "any"},
};
constexpr std::string_view kQuantities[] = {"position", "velocity", "acceleration", "force"};
constexpr std::string_view kPurposes[] = {"open", "save", "folder"};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_type_name_char(char c) {
  return is_letter(c) || (c >= '0' && c <= '9') || c == '.' || c == '#';
}

template <class Words>
bool is_among(const Words& words, std::string_view word) {
  return std::find(std::begin(words), std::end(words), word) != std::end(words);
}

/// What a field of a table says beside its type.
void take_bounds(ParamSpec& spec, const TypeTree& tree) {
  spec.unit = tree.unit;
  for (const WordInfo& w : tree.choices) spec.choices.push_back(w.word);
  if (tree.notes.min) spec.min = *tree.notes.min;
  if (tree.notes.max) spec.max = *tree.notes.max;
  spec.infinite = tree.notes.is_infinite;
  spec.label = tree.notes.label;
  spec.group = tree.notes.group;
}

/// Trees by their texts. They are few: those of tables that come with the program or a plugin.
struct Trees {
  std::shared_mutex mutex;
  /// Finds texts without making a string of them, once for each argument of each call.
  struct Hash : std::hash<std::string_view> {
    using is_transparent = void;
  };
  std::unordered_map<std::string, TreePtr, Hash, std::equal_to<>> by_text;
};
Trees& trees() {
  static Trees all;
  return all;
}
/// The first tree of a text that was kept; that is this one, if there was none.
TreePtr keep_tree(std::string_view text, TreePtr tree) {
  Trees& all = trees();
  const std::unique_lock lock(all.mutex);
  return all.by_text.emplace(std::string(text), std::move(tree)).first->second;
}

class TypeParser {
 public:
  explicit TypeParser(std::string_view text) : text_(text) {}

  Result<TreePtr> all() {
    if (text_.size() > kLongestType) return fault("the type is too long");
    RMP_TRY_ASSIGN(TreePtr tree, type(0));
    skip();
    if (at_ < text_.size()) return fault("unexpected text");
    return tree;
  }

 private:
  Error fault(const std::string& what) const {
    constexpr std::size_t kShown = 80;
    return error(ErrorCode::syntax, what + " at character " + std::to_string(at_ + 1) +
                                        " of the type " + text::quote(text_.substr(0, kShown)) +
                                        (text_.size() > kShown ? "..." : ""));
  }
  void skip() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n')) ++at_;
  }
  [[nodiscard]] bool sees(char c) {
    skip();
    return at_ < text_.size() && text_[at_] == c;
  }
  bool take(char c) {
    if (!sees(c)) return false;
    ++at_;
    return true;
  }
  std::string_view name() {
    skip();
    const std::size_t from = at_;
    while (at_ < text_.size() && is_type_name_char(text_[at_])) ++at_;
    return text_.substr(from, at_ - from);
  }
  /// Takes `word` where it is a word of its own.
  bool take_word(std::string_view word) {
    skip();
    if (!text_.substr(at_).starts_with(word)) return false;
    const std::size_t end = at_ + word.size();
    if (end < text_.size() && is_type_name_char(text_[end])) return false;
    at_ = end;
    return true;
  }
  /// What is between parentheses, which may be nested; quoted texts in it count as a whole.
  Result<std::string_view> inside() {
    ++at_;
    const std::size_t from = at_;
    std::size_t depth = 1;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"') {
        skip_quoted();
        continue;
      }
      ++at_;
      if (c == '(') ++depth;
      if (c == ')' && --depth == 0) return text::trim(text_.substr(from, at_ - 1 - from));
    }
    return fault("a parenthesis ) is missing");
  }

  Result<TreePtr> type(std::size_t depth) {
    if (depth > kDeepestType) return fault("types are nested too deep");
    RMP_TRY_ASSIGN(TypeTree tree, one(depth));
    if (take_word("or")) {
      TypeTree all;
      all.kind = TypeKind::one_of;
      all.options.push_back(std::make_shared<const TypeTree>(std::move(tree)));
      do {
        RMP_TRY_ASSIGN(TypeTree next, one(depth));
        all.options.push_back(std::make_shared<const TypeTree>(std::move(next)));
      } while (take_word("or"));
      tree = std::move(all);
    }
    while (sees('@')) RMP_TRY(note(tree.notes));
    return std::make_shared<const TypeTree>(std::move(tree));
  }

  Result<TypeTree> one(std::size_t depth) {
    TypeTree tree;
    const std::size_t from = (skip(), at_);
    const std::string_view word = name();
    const auto* known = std::find_if(std::begin(kWords), std::end(kWords),
                                     [word](const Word& w) { return w.text == word; });
    if (known == std::end(kWords)) {
      at_ = from;
      return fault(word.empty() ? std::string("a type is missing")
                                : text::quote(word) + " is not a type");
    }
    tree.kind = known->kind;
    if (tree.kind == TypeKind::any && take('<')) {
      RMP_TRY_ASSIGN(const TreePtr inner, type(depth + 1));
      if (!take('>')) return fault("a bracket > is missing");
      tree = *inner;
      tree.is_unchecked = true;
      return tree;
    }
    if (word == "vec3") tree.count = 3;
    const bool needs_argument = tree.kind == TypeKind::reference || tree.kind == TypeKind::member ||
                                tree.kind == TypeKind::provider || tree.kind == TypeKind::script ||
                                tree.kind == TypeKind::named;
    if (needs_argument) RMP_TRY(argument(tree));
    if (at_ < text_.size() && text_[at_] == '(') {
      RMP_TRY_ASSIGN(const std::string_view details, inside());
      RMP_TRY(read_details(tree, details));
    } else if (word == "vec" || tree.kind == TypeKind::variant) {
      return fault(text::quote(word) + " needs parentheses, such as " +
                   (word == "vec" ? "vec(4)" : "variant(kind){...}"));
    }
    if (tree.kind == TypeKind::member || tree.kind == TypeKind::joints) {
      if (take_word("of")) {
        tree.of = name();
        if (tree.of.empty()) return fault("the name of an argument is missing behind \"of\"");
      }
    }
    if (tree.kind == TypeKind::real && text_.substr(at_).starts_with("[]")) {
      at_ += 2;
      tree.kind = TypeKind::vector;
    }
    if ((tree.kind == TypeKind::list || tree.kind == TypeKind::map) && take('<')) {
      RMP_TRY_ASSIGN(tree.element, type(depth + 1));
      if (!take('>')) return fault("a bracket > is missing");
    }
    if (tree.kind == TypeKind::map && sees('{')) {
      RMP_TRY_ASSIGN(tree.fields, fields(depth + 1));
    }
    if (tree.kind == TypeKind::table) {
      if (!sees('{')) return fault("a table needs its columns in braces");
      RMP_TRY_ASSIGN(tree.fields, fields(depth + 1));
    }
    if (tree.kind == TypeKind::variant) RMP_TRY(read_cases(tree, depth + 1));
    if (sees('[')) {
      ++at_;
      const std::size_t begin = at_;
      while (at_ < text_.size() && text_[at_] != ']') ++at_;
      if (at_ >= text_.size()) return fault("a bracket ] is missing");
      tree.unit = text::trim(text_.substr(begin, at_ - begin));
      ++at_;
      for (const std::string_view part : text::split(tree.unit, '|'))
        for (const std::string_view each : text::split(part, ','))
          if (const auto unit = units::parse(text::trim(each)); !unit.ok())
            return fault(unit.error().message);
    }
    return tree;
  }

  /// What follows a colon: kinds, interfaces, a member, a language.
  Result<void> argument(TypeTree& tree) {
    if (at_ >= text_.size() || text_[at_] != ':') return fault("a colon is missing");
    ++at_;
    const std::size_t from = at_;
    while (at_ < text_.size() && (is_type_name_char(text_[at_]) || text_[at_] == '|')) ++at_;
    const std::string_view given = text_.substr(from, at_ - from);
    if (given.empty()) return fault("a word is missing behind the colon");
    if (tree.kind == TypeKind::reference || tree.kind == TypeKind::provider) {
      for (const std::string_view each : text::split(given, '|')) tree.words.emplace_back(each);
    } else {
      tree.word = given;
    }
    return {};
  }

  Result<void> read_details(TypeTree& tree, std::string_view details) {
    switch (tree.kind) {
      case TypeKind::word: return read_choices(tree, details);
      case TypeKind::path: {
        const auto colon = std::min(details.find(':'), details.size());
        tree.word = text::trim(details.substr(0, colon));
        if (!is_among(kPurposes, tree.word))
          return fault("a path is for open, save or folder, not " + text::quote(tree.word));
        if (colon < details.size())
          for (const std::string_view each : text::split(details.substr(colon + 1), ' '))
            if (!each.empty()) tree.words.emplace_back(each);
        return {};
      }
      case TypeKind::vector: {
        if (const auto n = text::read_int(details); n && *n > 0) {
          tree.count = static_cast<std::size_t>(*n);
          return {};
        }
        for (const std::string_view each : text::split(details, ','))
          tree.words.emplace_back(text::trim(each));
        if (std::any_of(tree.words.begin(), tree.words.end(),
                        [](const std::string& w) { return w.empty() || !is_letter(w.front()); }))
          return fault("a vector has a count or names of components");
        tree.count = tree.words.size();
        return {};
      }
      case TypeKind::matrix: {
        const auto comma = details.find(',');
        if (comma == std::string_view::npos) return fault("a matrix has rows and columns");
        for (const auto& [part, out] : {std::pair{details.substr(0, comma), &tree.rows},
                                        std::pair{details.substr(comma + 1), &tree.cols}}) {
          const std::string_view digits = text::trim(part);
          if (digits.empty()) continue;
          const auto n = text::read_int(digits);
          if (!n || *n <= 0) return fault("a matrix has rows and columns");
          *out = static_cast<std::size_t>(*n);
        }
        return {};
      }
      case TypeKind::provider:
        if (details != "name") return fault("a provider takes (name) only");
        tree.is_name_only = true;
        return {};
      case TypeKind::joints:
        if (!is_among(kQuantities, details))
          return fault("joints have position, velocity, acceleration or force");
        tree.word = details;
        return {};
      case TypeKind::variant: tree.decided_by = details; return {};
      default: return fault("this type takes no parentheses");
    }
  }

  Result<void> read_choices(TypeTree& tree, std::string_view details) {
    for (const std::string_view each : text::split(details, '|')) {
      const auto colon = std::min(each.find(':'), each.size());
      WordInfo w;
      std::string_view word = text::trim(each.substr(0, colon));
      if (const auto quote = word.find('"'); quote != std::string_view::npos) {
        std::string_view label = word.substr(quote + 1);
        if (!label.ends_with('"')) return fault("the label of a word of the enum has no end");
        label.remove_suffix(1);
        if (text::trim(label).empty() || label.find('"') != std::string_view::npos)
          return fault("the label of a word of the enum is empty or contains quotes");
        w.label = label;
        word = text::trim(word.substr(0, quote));
      }
      w.word = word;
      if (colon < each.size()) w.doc = text::trim(each.substr(colon + 1));
      if (w.word.empty()) return fault("a word of the enum is empty");
      for (const WordInfo& other : tree.choices)
        if (other.word == w.word) return fault(text::quote(w.word) + " is twice in the enum");
      tree.choices.push_back(std::move(w));
    }
    return {};
  }

  Result<void> read_cases(TypeTree& tree, std::size_t depth) {
    if (!take('{')) return fault("a variant needs its cases in braces");
    while (!take('}')) {
      const std::string word(name());
      if (word.empty()) return fault("the word of a case is missing");
      if (!take(':')) return fault("a colon is missing");
      if (!sees('{')) return fault("a brace { is missing");
      RMP_TRY_ASSIGN(Schema schema, fields(depth));
      tree.cases.emplace_back(word, std::move(schema));
      if (take(';')) continue;
      if (!take('}')) return fault("a brace } is missing");
      break;
    }
    if (tree.cases.empty()) return fault("a variant has no case");
    return {};
  }

  Result<Schema> fields(std::size_t depth) {
    Schema out;
    ++at_;  // the brace
    while (!take('}')) {
      ParamSpec spec;
      spec.name = name();
      if (spec.name.empty()) return fault("the name of a field is missing");
      for (const ParamSpec& other : out)
        if (other.name == spec.name) return fault(text::quote(spec.name) + " is given twice");
      spec.required = !take('?');
      if (!take(':')) return fault("a colon is missing");
      skip();
      const std::size_t from = at_;
      RMP_TRY_ASSIGN(TreePtr tree, type(depth));
      spec.type = text::trim(text_.substr(from, at_ - from));
      take_bounds(spec, *tree);
      keep_tree(spec.type, std::move(tree));  // so that it is not parsed again by its text
      if (take('=')) {
        RMP_TRY_ASSIGN(const std::string_view value, literal_text());
        RMP_TRY_ASSIGN(spec.default_value, read_literal(value));
        spec.required = false;
      }
      if (sees('"')) {
        RMP_TRY_ASSIGN(const std::string_view doc, literal_text());
        RMP_TRY_ASSIGN(const Value read, read_literal(doc));
        spec.doc = *read.as_string();
      }
      out.push_back(std::move(spec));
      if (take(';')) continue;
      if (!take('}')) return fault("a semicolon or a brace } is missing");
      break;
    }
    return out;
  }

  /// One literal: a text in quotes, a table, or a word.
  /// From a quote to behind the one that closes it, or to the end.
  void skip_quoted() {
    for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_)
      if (text_[at_] == '\\') ++at_;
    at_ = std::min(at_ + 1, text_.size());
  }
  Result<std::string_view> literal_text() {
    skip();
    const std::size_t from = at_;
    if (sees('"')) {
      skip_quoted();
    } else if (sees('{')) {
      std::size_t depth = 0;
      do {
        if (text_[at_] == '"') {
          skip_quoted();
          continue;
        }
        if (text_[at_] == '{') ++depth;
        if (text_[at_] == '}') --depth;
        ++at_;
      } while (depth > 0 && at_ < text_.size());
    } else {
      while (at_ < text_.size() && text_[at_] != ' ' && text_[at_] != ';' && text_[at_] != '}' &&
             text_[at_] != '"')
        ++at_;
    }
    at_ = std::min(at_, text_.size());
    if (at_ == from) return fault("a value is missing");
    return text_.substr(from, at_ - from);
  }

  Result<void> note(TypeNotes& out) {
    const std::size_t from = at_;
    ++at_;
    const std::string_view word = name();
    std::string_view value;
    if (at_ < text_.size() && text_[at_] == '(') {
      RMP_TRY_ASSIGN(value, inside());
    }
    const auto number = [&]() -> Result<double> {
      if (const auto x = text::read_real(value)) return *x;
      at_ = from;
      return fault("the note @" + std::string(word) + " needs a number");
    };
    if (word == "advanced") out.is_advanced = true;
    else if (word == "log") out.is_logarithmic = true;
    else if (word == "infinite") out.is_infinite = true;
    else if (value.empty()) {
      at_ = from;
      return fault("the note @" + std::string(word) + " is not known or lacks its value");
    } else if (word == "label") out.label = value;
    else if (word == "group") out.group = value;
    else if (word == "since") out.since = value;
    else if (word == "deprecated") out.deprecated = value;
    else if (word == "effect") out.effect = value;
    else if (word == "order") {
      RMP_TRY_ASSIGN(const double x, number());
      out.order = static_cast<int>(std::clamp(x, -1e6, 1e6));
    } else if (word == "step") {
      RMP_TRY_ASSIGN(out.step, number());
      if (!(out.step > 0)) return fault("a step is greater than 0");
    } else if (word == "min") {
      RMP_TRY_ASSIGN(out.min, number());
    } else if (word == "max") {
      RMP_TRY_ASSIGN(out.max, number());
    } else if (word == "above") {
      RMP_TRY_ASSIGN(const double x, number());
      out.min = x == 0 ? kPositive : std::nextafter(x, HUGE_VAL);
    } else if (word == "when") {
      RMP_TRY_ASSIGN(out.when, Condition::parse(value));
    } else if (word == "shown") {
      if (const auto unit = units::parse(value); !unit.ok()) return fault(unit.error().message);
      out.shown_unit = value;
    } else if (word == "example") {
      RMP_TRY_ASSIGN(out.example, read_literal(value));
    } else {
      at_ = from;
      return fault("there is no note @" + std::string(word));
    }
    return {};
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

// ---- kept trees ----

TreePtr known_tree(std::string_view text) {
  Trees& all = trees();
  const std::shared_lock lock(all.mutex);
  const auto it = all.by_text.find(text);
  return it == all.by_text.end() ? nullptr : it->second;
}

/// A text whose tree is kept, as it is kept.
std::string_view kept_text(std::string_view text) {
  Trees& all = trees();
  const std::shared_lock lock(all.mutex);
  return all.by_text.find(text)->first;
}

struct NamedEntry {
  std::string_view plain;
  NamedType::Text text = nullptr;
  const TypeTree* tree = nullptr;  ///< once it was needed
};
struct NamedTypes {
  std::mutex mutex;
  std::map<std::string, NamedEntry, std::less<>> by_name;
  [[nodiscard]] NamedEntry* find(std::string_view name) {
    const auto it = by_name.find(name);
    return it == by_name.end() ? nullptr : &it->second;
  }
};
NamedTypes& names() {
  static NamedTypes all;
  return all;
}

// ---- text ----

void write_type(std::string& out, const TypeTree& t);

std::string quoted_doc(std::string_view s) { return literal(Value(s)); }

/// "rad or m" as "rad|m".
std::string with_bars(std::string unit) {
  constexpr std::string_view kOr = " or ";
  for (std::size_t at = 0; (at = unit.find(kOr, at)) != std::string::npos;)
    unit.replace(at, kOr.size(), "|");
  return unit;
}

void write_fields(std::string& out, const Schema& fields) {
  out += "{";
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const ParamSpec& p = fields[i];
    out += (i ? "; " : "") + p.name + (p.required || p.default_value ? ": " : "?: ");
    TypeTree tree = type_tree(p.type);
    if (tree.unit.empty()) tree.unit = with_bars(p.unit);
    if (tree.kind == TypeKind::word && tree.choices.empty())
      for (const std::string& word : p.choices) tree.choices.push_back({word});
    if (tree.notes.label.empty()) tree.notes.label = p.label;
    if (tree.notes.group.empty()) tree.notes.group = p.group;
    if (std::isfinite(p.min)) tree.notes.min = p.min;
    if (std::isfinite(p.max)) tree.notes.max = p.max;
    tree.notes.is_infinite = tree.notes.is_infinite || p.infinite;
    write_type(out, tree);
    if (p.default_value) out += " = " + literal(*p.default_value);
    if (!p.doc.empty()) out += " " + quoted_doc(p.doc);
  }
  out += "}";
}

void write_notes(std::string& out, const TypeNotes& n) {
  const auto note = [&out](const char* word, const std::string& value) {
    if (!value.empty()) out += std::string(" @") + word + "(" + value + ")";
  };
  note("label", n.label);
  note("group", n.group);
  if (n.order != 0) note("order", std::to_string(n.order));
  if (n.is_advanced) out += " @advanced";
  note("when", n.when.text());
  if (n.min && *n.min == kPositive) note("above", "0");
  else if (n.min) note("min", text::print(*n.min));
  if (n.max) note("max", text::print(*n.max));
  if (n.is_infinite) out += " @infinite";
  if (n.step > 0) note("step", text::print(n.step));
  if (n.is_logarithmic) out += " @log";
  note("shown", n.shown_unit);
  if (n.example) note("example", literal(*n.example));
  note("since", n.since);
  note("deprecated", n.deprecated);
  note("effect", n.effect);
}

std::string_view word_of(const TypeTree& t) {
  if (t.kind == TypeKind::vector)
    return t.count == 3 && t.words.empty() ? "vec3" : t.count == 0 ? "real[]" : "vec";
  for (const Word& w : kWords)
    if (w.kind == t.kind) return w.text;
  return {};
}

void write_type(std::string& out, const TypeTree& t) {
  if (t.is_unchecked) {
    TypeTree inner = t;
    inner.is_unchecked = false;
    out += "any<";
    write_type(out, inner);
    out += ">";
    return;
  }
  if (t.kind == TypeKind::one_of) {
    for (std::size_t i = 0; i < t.options.size(); ++i) {
      if (i) out += " or ";
      write_type(out, *t.options[i]);
    }
    return write_notes(out, t.notes);
  }
  out += word_of(t);
  switch (t.kind) {
    case TypeKind::reference:
    case TypeKind::provider: out += ":" + text::join(t.words, "|"); break;
    case TypeKind::member:
    case TypeKind::script:
    case TypeKind::named: out += ":" + t.word; break;
    case TypeKind::joints:
      if (!t.word.empty()) out += "(" + t.word + ")";
      break;
    case TypeKind::path:
      if (t.word.empty()) break;
      out += "(" + t.word + (t.words.empty() ? "" : ": " + text::join(t.words, " ")) + ")";
      break;
    case TypeKind::vector:
      if (!t.words.empty()) out += "(" + text::join(t.words, ", ") + ")";
      else if (t.count != 0 && t.count != 3) out += "(" + std::to_string(t.count) + ")";
      break;
    case TypeKind::matrix:
      if (t.rows || t.cols)
        out += "(" + (t.rows ? std::to_string(t.rows) : "") + ", " +
               (t.cols ? std::to_string(t.cols) : "") + ")";
      break;
    case TypeKind::word:
      if (t.choices.empty()) break;
      out += "(";
      for (std::size_t i = 0; i < t.choices.size(); ++i)
        out += (i ? " | " : "") + t.choices[i].word +
               (t.choices[i].label.empty() ? "" : " \"" + t.choices[i].label + "\"") +
               (t.choices[i].doc.empty() ? "" : ": " + t.choices[i].doc);
      out += ")";
      break;
    case TypeKind::variant:
      out += "(" + t.decided_by + "){";
      for (std::size_t i = 0; i < t.cases.size(); ++i) {
        out += (i ? "; " : "") + t.cases[i].first + ": ";
        write_fields(out, t.cases[i].second);
      }
      out += "}";
      break;
    case TypeKind::table: write_fields(out, t.fields); break;
    default: break;
  }
  if (t.is_name_only) out += "(name)";
  if (t.element) {
    out += "<";
    write_type(out, *t.element);
    out += ">";
  }
  if (t.kind == TypeKind::map && !t.fields.empty()) write_fields(out, t.fields);
  if (!t.of.empty()) out += " of " + t.of;
  if (!t.unit.empty()) out += " [" + t.unit + "]";
  write_notes(out, t.notes);
}

std::string with_article(std::string_view noun) {
  const bool is_vowel =
      !noun.empty() && std::string_view("aeio").find(noun.front()) != std::string_view::npos;
  return (is_vowel ? "an " : "a ") + std::string(noun);
}

std::string of_words(const TypeTree& t) { return t.of.empty() ? "" : " of `" + t.of + "`"; }

// ---- faults ----

bool is_named(std::string_view name) {
  NamedTypes& all = names();
  const std::lock_guard lock(all.mutex);
  return all.find(name) != nullptr;
}

std::string fields_fault(const Schema& fields);

std::string tree_fault(const TypeTree& t) {
  if (t.kind == TypeKind::named && !is_named(t.word))
    return "there is no type of the name " + text::quote(t.word);
  if (!t.notes.shown_unit.empty() && !t.unit.empty()) {
    const auto own = units::parse(t.unit), shown = units::parse(t.notes.shown_unit);
    if (own.ok() && shown.ok() && own->dimension != shown->dimension)
      return "it is shown in " + text::quote(t.notes.shown_unit) + ", which is not " +
             text::quote(t.unit);
  }
  if (t.notes.example)
    if (const std::string bad = misfit(t, *t.notes.example, {}); !bad.empty())
      return "its example does not fit: " + bad;
  if (t.element)
    if (std::string fault = tree_fault(*t.element); !fault.empty()) return fault;
  for (const TreePtr& option : t.options)
    if (std::string fault = tree_fault(*option); !fault.empty()) return fault;
  if (std::string fault = fields_fault(t.fields); !fault.empty()) return fault;
  for (const auto& [word, fields] : t.cases) {
    // The field that decides is there in each case.
    Schema all = fields;
    ParamSpec decides;
    decides.name = t.decided_by;
    decides.type = "string";
    all.push_back(std::move(decides));
    if (std::string fault = fields_fault(all); !fault.empty()) return word + ": " + fault;
  }
  return {};
}

std::string fields_fault(const Schema& fields) {
  for (const ParamSpec& p : fields) {
    const auto parsed = parse_type(p.type);
    if (!parsed.ok()) return p.name + ": " + parsed.error().message;
    const TypeTree& t = **parsed;
    for (const Condition::Test& test : t.notes.when.tests()) {
      const auto it = std::find_if(fields.begin(), fields.end(), [&](const ParamSpec& other) {
        return other.name == std::string_view(test.field).substr(0, test.field.find('.'));
      });
      if (it == fields.end())
        return p.name + ": its condition names " + text::quote(test.field) +
               ", which is no field beside it";
      const auto words = words_of(*it);
      if (plain_type(it->type) != "enum" || words.empty()) continue;
      for (const std::string& word : test.words)
        if (std::none_of(words.begin(), words.end(),
                         [&](const WordInfo& w) { return w.word == word; }))
          return p.name + ": its condition compares " + it->name + " with " + text::quote(word) +
                 ", which it cannot be";
    }
    if (std::string fault = tree_fault(t); !fault.empty()) return p.name + ": " + fault;
  }
  return {};
}

}  // namespace

Result<std::shared_ptr<const TypeTree>> parse_type(std::string_view text) {
  if (TreePtr known = known_tree(text)) return known;
  RMP_TRY_ASSIGN(TreePtr tree, TypeParser(text).all());
  return keep_tree(text, std::move(tree));
}

namespace {

/// A text that this thread asked about. All parts live as long as the program.
struct Asked {
  std::string_view text{}, plain{};  ///< without data = not known
  const TypeTree* tree = nullptr;    ///< null = not known
};

/// The place of a text, with what is known of it. Tables of fields stay where they are, so that the
/// address of a text nearly always distinguishes it from others.
Asked& asked(std::string_view text) {
  constexpr std::size_t kPlaces = 1024;
  thread_local std::array<Asked, kPlaces> all;
  Asked& a = all[(reinterpret_cast<std::uintptr_t>(text.data()) >> 4U) % kPlaces];
  if (a.text != text) a = {};
  return a;
}

}  // namespace

const TypeTree& type_tree(std::string_view text) {
  if (const Asked& a = asked(text); a.tree) return *a.tree;
  const auto parsed = parse_type(text);
  if (!parsed.ok()) {
    const std::string sentence = parsed.error().sentence();
    RMP_CHECK(false, sentence.c_str());
  }
  Asked& a = asked(text);  // parsing may have taken its place
  a.text = kept_text(text);
  a.tree = parsed->get();
  return *a.tree;
}

std::string type_fault(std::string_view text) {
  const auto parsed = parse_type(text);
  return parsed.ok() ? tree_fault(**parsed) : parsed.error().message;
}

std::string schema_fault(const Schema& schema) { return fields_fault(schema); }

namespace {

/// "ref" stands for any reference.
std::string_view plain_word(const TypeTree& t) {
  if (t.is_unchecked) return "any";
  switch (t.kind) {
    case TypeKind::vector: return t.count == 3 ? "vec3" : "real[]";
    case TypeKind::provider: return t.is_name_only ? "string" : "any";
    case TypeKind::named: {
      NamedTypes& all = names();
      const std::lock_guard lock(all.mutex);
      const NamedEntry* named = all.find(t.word);
      return named ? named->plain : "any";
    }
    case TypeKind::one_of: {
      const std::string_view first = plain_word(*t.options.front());
      for (const TreePtr& option : t.options)
        if (plain_word(*option) != first) return "any";
      return first == "ref" || first == "enum" ? "any" : first;
    }
    default: break;
  }
  for (const Word& w : kWords)
    if (w.kind == t.kind) return w.plain;
  return "any";
}

}  // namespace

std::string_view plain_type(std::string_view text) {
  // Every argument of every call passes here several times.
  if (const Asked& a = asked(text); a.plain.data()) return a.plain;
  if (text == "real[]") return "real[]";
  if (text.find_first_of(" ({<@:") == std::string_view::npos) {
    for (const Word& w : kWords)
      if (w.text == text) {
        Asked& a = asked(text);
        a.text = w.text;
        return a.plain = w.plain;
      }
    return text;
  }
  const TypeTree& t = type_tree(text);
  const std::string_view plain =
      t.kind == TypeKind::reference && !t.is_unchecked ? std::string_view() : plain_word(t);
  Asked& a = asked(text);  // parsing may have taken its place
  a.text = kept_text(text);
  a.tree = &t;
  return a.plain = plain.data() ? plain : a.text.substr(0, a.text.find_first_of(" @"));
}

std::string type_text(const TypeTree& t) {
  std::string out;
  write_type(out, t);
  return out;
}

std::string type_words(const TypeTree& t) {
  const std::string unit = t.unit.empty() ? std::string() : " [" + t.unit + "]";
  switch (t.kind) {
    case TypeKind::text: return "string";
    case TypeKind::word: {
      std::vector<std::string> words;
      for (const WordInfo& w : t.choices) words.push_back(w.word);
      return words.empty() ? "enum" : text::join(words, "|");
    }
    case TypeKind::list: return t.element ? "list of " + type_words(*t.element) : "list";
    case TypeKind::map:
      if (t.element && t.fields.empty()) return "map of " + type_words(*t.element);
      [[fallthrough]];
    case TypeKind::table: {
      std::string out = t.kind == TypeKind::table ? "list of " : t.fields.empty() ? "map" : "";
      if (t.fields.empty()) return out;
      out += "{";
      for (std::size_t i = 0; i < t.fields.size(); ++i) out += (i ? ", " : "") + t.fields[i].name;
      return out + (t.element ? ", ...}" : "}");
    }
    case TypeKind::variant: return "map by `" + t.decided_by + "`";
    case TypeKind::one_of: {
      std::string out;
      for (const TreePtr& option : t.options)
        out += (out.empty() ? "" : " or ") + type_words(*option);
      return out;
    }
    case TypeKind::reference: return "ref:" + text::join(t.words, "|");
    case TypeKind::member: {
      std::string noun(t.word);
      std::replace(noun.begin(), noun.end(), '_', ' ');
      return "name of " + with_article(noun) + of_words(t);
    }
    case TypeKind::provider: return text::join(t.words, " or ") + " provider";
    case TypeKind::joints:
      return (t.word.empty() || t.word == "position" ? std::string("joint values")
                                                     : "joint " + t.word) +
             of_words(t);
    case TypeKind::script: return t.word + " text";
    case TypeKind::named: return t.word;
    case TypeKind::vector:
      if (!t.words.empty()) return "{" + text::join(t.words, ", ") + "}" + unit;
      return std::string(word_of(t)) +
             (t.count && t.count != 3 ? "(" + std::to_string(t.count) + ")" : "") + unit;
    default: break;
  }
  return std::string(word_of(t)) + unit;
}

std::string map_type(const Schema& fields) {
  std::string out = "map";
  write_fields(out, fields);
  return out;
}

std::string table_type(const Schema& fields) {
  std::string out = "table";
  write_fields(out, fields);
  return out;
}

std::string variant_type(std::string_view decided_by,
                         const std::vector<std::pair<std::string, Schema>>& cases) {
  std::string out = "variant(" + std::string(decided_by) + "){";
  for (std::size_t i = 0; i < cases.size(); ++i) {
    out += (i ? "; " : "") + cases[i].first + ": ";
    write_fields(out, cases[i].second);
  }
  return out + "}";
}

NamedType::NamedType(const char* name, const char* plain, Text text) {
  NamedTypes& all = names();
  const std::lock_guard lock(all.mutex);
  RMP_CHECK(all.by_name.emplace(name, NamedEntry{plain, text}).second, name);
}

const TypeTree* named_type(std::string_view name) {
  NamedTypes& all = names();
  NamedType::Text text = nullptr;
  {
    const std::lock_guard lock(all.mutex);
    const NamedEntry* named = all.find(name);
    if (!named) return nullptr;
    if (named->tree) return named->tree;
    text = named->text;
  }
  const TypeTree& tree = type_tree(text());
  const std::lock_guard lock(all.mutex);
  all.find(name)->tree = &tree;
  return &tree;
}

std::vector<std::string> named_types() {
  NamedTypes& all = names();
  const std::lock_guard lock(all.mutex);
  std::vector<std::string> out;
  for (const auto& [name, named] : all.by_name) out.push_back(name);
  return out;
}

ParamSpec noted(ParamSpec p, std::string_view notes) {
  p.type += " " + std::string(notes);
  return p;
}

void retype(Schema& schema, std::string_view name, std::string_view type) {
  const ParamSpec* p = find_param(schema, name);
  RMP_CHECK(p, std::string(name).c_str());
  schema[static_cast<std::size_t>(p - schema.data())].type = type;
}

TypeNotes notes_of(const ParamSpec& p) {
  TypeNotes out = type_tree(p.type).notes;
  if (out.label.empty()) out.label = p.label;
  if (out.group.empty()) out.group = p.group;
  return out;
}

std::vector<WordInfo> words_of(const ParamSpec& p) {
  const TypeTree& t = type_tree(p.type);
  if (!t.choices.empty()) return t.choices;
  std::vector<WordInfo> out;
  for (const std::string& word : p.choices) out.push_back({word});
  return out;
}

std::string word_label(const WordInfo& w) {
  constexpr std::string_view kCapitals[] = {"ap203", "ap214", "ap242", "brep", "csv",
                                            "dh",    "html",  "json",  "mdh",  "pdf",
                                            "png",   "rpy",   "svg",   "xyz",  "zyz"};
  constexpr std::string_view kUnits[] = {"cm", "deg", "ft", "in", "m", "mm", "rad"};
  if (!w.label.empty()) return w.label;
  if (is_among(kUnits, w.word)) return w.word;
  std::string out;
  for (const std::string_view part : text::split(w.word, '_')) {
    if (!out.empty()) out += ' ';
    const std::size_t at = out.size();
    out += part;
    const std::size_t capitals = is_among(kCapitals, part) ? part.size() : at == 0 ? 1U : 0U;
    for (std::size_t i = at; i < std::min(out.size(), at + capitals); ++i)
      if (out[i] >= 'a' && out[i] <= 'z') out[i] = static_cast<char>(out[i] - 'a' + 'A');
  }
  return out;
}

std::string unit_of(const ParamSpec& p) { return p.unit.empty() ? type_tree(p.type).unit : p.unit; }

std::string_view shown_unit_of(std::string_view si_unit) {
  struct Shown {
    std::string_view si, shown;
  };
  constexpr Shown kShown[] = {
      {"m", "mm"},
      {"m/s", "mm/s"},
      {"m/s^2", "mm/s^2"},
      {"rad", "deg"},
      {"rad/s", "deg/s"},
      {"rad/s^2", "deg/s^2"},
      {"m/s^3", "mm/s^3"},
      {"rad/s^3", "deg/s^3"},
      {"rad|m", "deg|mm"},
      {"rad/s|m/s", "deg/s|mm/s"},
      {"rad/s^2|m/s^2", "deg/s^2|mm/s^2"},
      {"rad/s^3|m/s^3", "deg/s^3|mm/s^3"},
  };
  const std::string alternatives = with_bars(std::string(si_unit));
  for (const Shown& s : kShown)
    if (s.si == alternatives) return s.shown;
  return si_unit;
}

}  // namespace robomosp
