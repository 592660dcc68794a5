// SPDX-License-Identifier: Apache-2.0
// What editors ask of a program: colours, hover, places of names, new names, outline.
#include "editing.h"

#include <algorithm>
#include <array>
#include <deque>
#include <utility>

namespace robomosp::irl {
namespace {

using Id = std::uint32_t;
constexpr std::size_t kMostEditedBytes = std::size_t{64} << 20;
/// Errors behind which an editor's program is not read on. Each costs a search for similar names.
constexpr std::uint32_t kMostFaults = 300;
constexpr std::size_t kLongestValue = 60;
constexpr std::size_t kLongestDoc = 600;

bool is_name(std::string_view s) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  if (s.empty() || !letter(s[0])) return false;
  return std::all_of(s.begin(), s.end(),
                     [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}
/// One line, blanks single, not too long.
std::string in_a_line(std::string_view s, std::size_t most) {
  std::string out;
  for (const char c : s) {
    const bool is_blank = c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\f';
    if (is_blank && (out.empty() || out.back() == ' ')) continue;
    if (out.size() >= most) {
      while (!out.empty() && (static_cast<unsigned char>(out.back()) & 0xC0U) == 0x80)
        out.pop_back();
      return out + "...";
    }
    out += is_blank ? ' ' : c;
  }
  if (!out.empty() && out.back() == ' ') out.pop_back();
  return out;
}

}  // namespace

void each_gap(std::string_view text, std::uint32_t from, std::uint32_t to,
              const std::function<void(Gap, std::uint32_t, std::uint32_t)>& tell) {
  const auto is_blank = [](char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f';
  };
  while (from < to) {
    std::uint32_t end = from;
    if (text[from] == '{') {
      while (end < to && text[end] != '}') ++end;
      if (end < to) ++end;
      tell(Gap::comment, from, end);
    } else if (is_blank(text[from])) {
      while (end < to && is_blank(text[end])) ++end;
      tell(Gap::blanks, from, end);
    } else {
      while (end < to && !is_blank(text[end]) && text[end] != '{') ++end;
      tell(Gap::unknown, from, end);
    }
    from = end;
  }
}

// ---- the program ----

Analysis::Analysis(std::span<const SourceFile> files, Depth depth)
    : faults(kMostFaults), files_(files) {
  uses_.resize(files.size());
  sources_.resize(files.size());
  raw_.reserve(256);
  depth_ = depth;
}

bool Analysis::run(Progress& progress) {
  checker_ = std::make_unique<Checker>(out, names, faults, files_, progress);
  checker_->tell_uses(raw_);
  checker_->look_at(depth_);
  if (!checker_->run()) return false;
  for (const Source& s : checker_->sources()) {
    Id task = kNone;
    for (Id f = 0; f < files_.size(); ++f)
      if (s.text.data() == files_[f].text.data() && s.text.size() == files_[f].text.size() &&
          s.name == files_[f].name)
        task = f;
    if (task_files_.size() <= s.file) task_files_.resize(s.file + 1, kNone);
    task_files_[s.file] = task;
    if (task != kNone && !sources_[task]) sources_[task] = &s;
  }
  for (const Use& u : raw_)
    if (const Id task = task_file(u.file); task != kNone) uses_[task].push_back(u);
  raw_ = {};
  for (std::vector<Use>& all : uses_) {
    std::stable_sort(all.begin(), all.end(),
                     [](const Use& a, const Use& b) { return a.begin < b.begin; });
    all.erase(std::unique(all.begin(), all.end(),
                          [](const Use& a, const Use& b) { return a.begin == b.begin; }),
              all.end());
  }
  return true;
}

const Source* Analysis::source(Id task_file) const { return sources_[task_file]; }

const Use* Analysis::use_at(Id task_file, Id at) const {
  const std::vector<Use>& all = uses_[task_file];
  auto it = std::upper_bound(all.begin(), all.end(), at,
                             [](Id place, const Use& u) { return place < u.begin; });
  if (it == all.begin()) return nullptr;
  --it;
  return at <= it->end ? &*it : nullptr;
}
const Use* Analysis::use_from(Id task_file, Id begin) const {
  const std::vector<Use>& all = uses_[task_file];
  const auto it = std::lower_bound(all.begin(), all.end(), begin,
                                   [](const Use& u, Id place) { return u.begin < place; });
  return it != all.end() && it->begin == begin ? &*it : nullptr;
}

SourceTokenKind Analysis::kind(const Use& u) const {
  if (u.kind == Use::field) return SourceTokenKind::field;
  if (u.kind == Use::attribute) return SourceTokenKind::attribute;
  const rmp_code_symbol& s = out.symbols[u.id];
  switch (s.kind) {
    case RMP_SYMBOL_CONSTANT: return SourceTokenKind::constant;
    case RMP_SYMBOL_PARAMETER: return SourceTokenKind::parameter;
    case RMP_SYMBOL_INPUT:
    case RMP_SYMBOL_OUTPUT: return SourceTokenKind::signal;
    case RMP_SYMBOL_ROBOT: return SourceTokenKind::robot;
    case RMP_SYMBOL_TYPE: return SourceTokenKind::type;
    case RMP_SYMBOL_LABEL: return SourceTokenKind::label;
    case RMP_SYMBOL_INTRINSIC: {
      for (const Intrinsic& i : intrinsics())
        if (i.name == s.name)
          return i.result.empty() ? SourceTokenKind::procedure : SourceTokenKind::function;
      return SourceTokenKind::function;
    }
    case RMP_SYMBOL_ROUTINE:
      switch (out.routines[s.routine].kind) {
        case RMP_ROUTINE_PROCEDURE: return SourceTokenKind::procedure;
        case RMP_ROUTINE_FUNCTION: return SourceTokenKind::function;
        case RMP_ROUTINE_PROCESS:
        case RMP_ROUTINE_INTERRUPT: return SourceTokenKind::process;
        default: return SourceTokenKind::program;
      }
    default: return SourceTokenKind::variable;
  }
}

std::string Analysis::parameter_name(char letter) {
  switch (letter) {
    case 'i': return "INT";
    case 'r': return "REAL";
    case 'n': return "INT or REAL";
    case 'c': return "CHAR";
    case 'b': return "BOOL";
    case 's': return "STRING";
    case 'p': return "POSITION";
    case 'o': return "ORIENTATION";
    case 'P': return "POSE";
    case 'J': return "JOINT";
    case 'T': return "ROBTARGET";
    case 'x': return "process";
    case 'S': return "SEMAPHORE";
    case 'L':
    case 'l': return "list";
    case 'F': return "FILE or TEXT";
    case 'B': return "STRING";
    case 'e': return "element";
    case 'a': return "array, list or STRING";
    case 'w': return "values";
    case 'm': return "variables";
    case 'q': return "mode, robot";
    case 'R': return "R_SPEC_TYPE";
    default: return "value";
  }
}

std::string Analysis::parameter_text(Id symbol) const {
  const rmp_code_symbol& p = out.symbols[symbol];
  static constexpr const char* kModes[] = {"IN ", "OUT ", "INOUT "};
  return kModes[p.mode < 3 ? p.mode : 0] + type_name(p.type) + ": " + p.name;
}

std::string Analysis::value_text(Id e) const {
  if (e == kNone) return {};
  const rmp_code_expression& x = out.expressions[e];
  if (x.constant != kNone)
    return in_a_line(code_text_detail::constant_text(out.constants[x.constant]), kLongestValue);
  for (const Source& s : checker_->sources())
    if (s.file == x.span.file && x.span.end <= s.text.size() && x.span.begin < x.span.end)
      return in_a_line(s.text.substr(x.span.begin, x.span.end - x.span.begin), kLongestValue);
  return {};
}

std::string Analysis::detail(const Use& u) const {
  if (u.kind == Use::attribute)
    return u.id < attribute_words().size() ? std::string(attribute_words()[u.id].detail) : "";
  if (u.kind == Use::field) {
    const rmp_code_field& f = out.fields[u.id];
    std::string of;
    for (const rmp_code_type& t : out.types)
      if (t.kind == RMP_TYPE_RECORD && u.id >= t.first_field &&
          u.id - t.first_field < t.field_count && *t.name)
        of = t.name;
    return type_name(f.type) + ": " + f.name + (of.empty() ? "" : "  { field of " + of + " }");
  }
  const rmp_code_symbol& s = out.symbols[u.id];
  const std::string type = type_name(s.type);
  const auto valued = [&](std::string text) {
    const std::string value =
        s.constant != kNone
            ? in_a_line(code_text_detail::constant_text(out.constants[s.constant]), kLongestValue)
            : value_text(s.value);
    return value.empty() ? text : text + " := " + value;
  };
  const auto parameters = [&](const rmp_code_routine& r) {
    std::string all;
    for (Id k = 0; k < r.parameter_count; ++k)
      all += (k ? "; " : "") + parameter_text(r.first_parameter + k);
    return all.empty() ? all : " (" + all + ")";
  };
  switch (s.kind) {
    case RMP_SYMBOL_CONSTANT: return valued("CONST " + type + ": " + s.name);
    case RMP_SYMBOL_VARIABLE: return valued("VAR " + type + ": " + s.name);
    case RMP_SYMBOL_PARAMETER: return parameter_text(u.id);
    case RMP_SYMBOL_INPUT:
    case RMP_SYMBOL_OUTPUT:
      return (s.kind == RMP_SYMBOL_INPUT ? "INPUT " : "OUTPUT ") + type + ": " + s.name + " AT " +
             std::to_string(s.address) + (s.width != 1 ? ", " + std::to_string(s.width) : "");
    case RMP_SYMBOL_ROBOT: return std::string("ROBOT ") + s.name;
    case RMP_SYMBOL_LABEL: return std::string("LABEL ") + s.name;
    case RMP_SYMBOL_TYPE: {
      if (s.type == kNone || s.type <= RMP_TYPE_PROCESS) return std::string("TYPE ") + s.name;
      const rmp_code_type& t = out.types[s.type];
      std::string made;
      if (t.kind == RMP_TYPE_RECORD) {
        made = "RECORD";
        constexpr Id kMostFields = 12;
        for (Id k = 0; k < t.field_count && k < kMostFields; ++k) {
          const rmp_code_field& f = out.fields[t.first_field + k];
          const bool is_next = k > 0 && out.fields[t.first_field + k - 1].type == f.type;
          made +=
              (is_next ? ", " : (k ? "; " : " ") + type_name(f.type) + ": ") + std::string(f.name);
        }
        made += t.field_count > kMostFields ? "; ... ENDRECORD" : "; ENDRECORD";
      } else if (t.kind == RMP_TYPE_LIST) {
        made = "LIST OF " + type_name(t.element);
      } else {
        made = "ARRAY [" + std::to_string(t.lower) + ".." + std::to_string(t.upper) + "] OF " +
               type_name(t.element);
      }
      return "TYPE " + made + ": " + s.name;
    }
    case RMP_SYMBOL_INTRINSIC: {
      for (const Intrinsic& i : intrinsics()) {
        if (i.name != s.name) continue;
        std::string all;
        for (const char p : i.parameters) all += (all.empty() ? "" : ", ") + parameter_name(p);
        if (!all.empty()) all = " (" + all + ")";
        return (i.result.empty() ? "PROCEDURE " : "FUNCTION ") + std::string(s.name) + all +
               (i.result.empty() ? "" : ": " + parameter_name(i.result[0]));
      }
      return s.name;
    }
    case RMP_SYMBOL_ROUTINE: {
      static constexpr const char* kWords[] = {"PROGRAM ", "PROCEDURE ", "FUNCTION ",
                                               "PROCESS ", "INTERRUPT ", "DATALIST "};
      const rmp_code_routine& r = out.routines[s.routine];
      return kWords[r.kind] + std::string(s.name) + parameters(r) +
             (r.kind == RMP_ROUTINE_FUNCTION ? ": " + type_name(r.result) : "");
    }
    default: return s.name;
  }
}

/// A comment above the line of a declaration, or behind it in its line.
std::string Analysis::comment_beside(const rmp_span& span) const {
  const Id task = task_file(span.file);
  const Source* source = nullptr;
  if (task != kNone) source = sources_[task];
  if (!source || span.end > source->text.size() || span.line == 0) return {};
  const std::string_view text = source->text;
  const auto cleaned = [](std::string_view comment) {
    if (!comment.empty() && comment.front() == '{') comment.remove_prefix(1);
    if (!comment.empty() && comment.back() == '}') comment.remove_suffix(1);
    return in_a_line(comment, kLongestDoc);
  };
  // Behind it: the first comment in the line.
  const auto first = std::upper_bound(source->tokens.begin(), source->tokens.end(), span.begin,
                                      [](Id place, const Token& t) { return place < t.begin; });
  const std::size_t line_end = std::min(text.find('\n', span.end), text.size());
  std::string behind;
  for (auto t = first; t != source->tokens.end() && behind.empty(); ++t) {
    const std::uint32_t from = (t == source->tokens.begin() ? span.begin : (t - 1)->end);
    if (from >= line_end) break;
    each_gap(text, from, t->begin, [&](Gap g, Id b, Id e) {
      if (g == Gap::comment && b < line_end && behind.empty())
        behind = cleaned(text.substr(b, e - b));
    });
  }
  if (!behind.empty()) return behind;
  const std::size_t newline = text.rfind('\n', span.begin);
  if (newline == std::string_view::npos || newline == 0) return {};
  std::size_t end = newline;
  while (end > 0 && (text[end - 1] == ' ' || text[end - 1] == '\t' || text[end - 1] == '\r')) --end;
  if (end == 0 || text[end - 1] != '}') return {};
  const std::size_t open = text.rfind('{', end);
  if (open == std::string_view::npos) return {};
  // One that begins behind something else belongs to that.
  std::size_t before = open;
  while (before > 0 && (text[before - 1] == ' ' || text[before - 1] == '\t')) --before;
  if (before > 0 && text[before - 1] != '\n') return {};
  return cleaned(text.substr(open, end - open));
}

std::string Analysis::doc(const Use& u) const {
  if (u.kind == Use::attribute)
    return u.id < attribute_words().size() ? std::string(attribute_words()[u.id].doc) : "";
  if (u.kind == Use::field) return comment_beside(out.fields[u.id].span);
  const rmp_code_symbol& s = out.symbols[u.id];
  if (s.kind == RMP_SYMBOL_INTRINSIC)
    for (const Intrinsic& i : intrinsics())
      if (i.name == s.name) return std::string(i.doc);
  return comment_beside(s.span);
}

SourceRange Analysis::declared(const Use& u) const {
  if (u.kind == Use::attribute) return {kNone, 0, 0};
  const rmp_span& span = u.kind == Use::field ? out.fields[u.id].span : out.symbols[u.id].span;
  if (span.line == 0) return {kNone, 0, 0};
  return {task_file(span.file), span.begin, span.end};
}

bool Analysis::is_predefined(const Use& u) const {
  return u.kind == Use::attribute || declared(u).file == kNone;
}

Id Analysis::scope_of(Id task_file) const {
  if (out.routines.empty() || out.routines[0].scope == kNone) return 0;
  const Id program = out.routines[0].scope;
  const Source* s = task_file < sources_.size() ? sources_[task_file] : nullptr;
  if (!s || task_file == 0 || s->nodes.empty() || s->nodes[0].kind == N::data_list) return program;
  if (s->nodes[0].kind == N::module)
    for (Id i = 0; i < out.scopes.size(); ++i)
      if (out.scopes[i].kind == RMP_SCOPE_MODULE && out.scopes[i].span.file == s->file) return i;
  return out.scopes[program].parent;
}

Id Analysis::lookup(Id scope, std::string_view name) const {
  const Id n = names.find(name);
  const auto& known = checker_->known_names();
  for (Id s = scope; n != kNone && s < known.size(); s = out.scopes[s].parent)
    if (const auto found = known[s].find(n); found != known[s].end()) return found->second;
  return kNone;
}

// ---- what is asked ----

namespace {

class Edited final : public EditedProgram {
 public:
  explicit Edited(std::span<const SourceFile> files) {
    for (const SourceFile& f : files) {
      names_.emplace_back(f.name);
      texts_.emplace_back(f.text);
    }
    for (std::size_t i = 0; i < texts_.size(); ++i) files_.push_back({names_[i], texts_[i], {}});
    made_.resize(files.size());
  }

  Result<std::vector<SourceFault>> faults(Progress& progress) const override {
    RMP_TRY_ASSIGN(const auto a, of(0, Depth::all, progress));
    std::vector<SourceFault> out;
    for (const Fault& f : a->faults.all) {
      const Id task = a->task_file(f.file);
      SourceFault one;
      one.severity = f.severity;
      // What is wrong with a file of the language itself is told of the program.
      if (task != kNone) one.range = {task, f.at.begin, std::max(f.at.begin, f.at.end)};
      one.message = f.message;
      one.hint = f.hint;
      out.push_back(std::move(one));
    }
    std::stable_sort(out.begin(), out.end(), [](const SourceFault& x, const SourceFault& y) {
      return std::pair(x.range.file, x.range.begin) < std::pair(y.range.file, y.range.begin);
    });
    if (a->faults.is_full()) {
      SourceFault more;
      more.severity = RMP_FAULT_NOTE;
      if (!out.empty()) more.range = out.back().range;
      more.message = "there are " + std::to_string(kMostFaults) +
                     " errors or more, and the rest was not checked";
      out.push_back(std::move(more));
    }
    return out;
  }

  Result<std::vector<SourceToken>> tokens(Id file, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, 0, Depth::all, progress));
    const Source& s = *p.source;
    std::vector<SourceToken> out;
    out.reserve(s.tokens.size());
    const std::vector<Use>& uses = p.analysis->uses(p.file);
    std::size_t next_use = 0;
    Id from = 0;
    for (const Token& t : s.tokens) {
      each_gap(s.text, from, t.begin, [&](Gap g, Id b, Id e) {
        if (g == Gap::blanks) return;
        SourceToken one;
        one.kind = g == Gap::comment ? SourceTokenKind::comment : SourceTokenKind::unknown;
        one.begin = b;
        one.end = e;
        out.push_back(one);
      });
      from = t.end;
      if (t.kind == Tok::end) break;
      SourceToken one;
      one.begin = t.begin;
      one.end = t.end;
      if (t.kind >= Tok::k_program) {
        one.kind = SourceTokenKind::keyword;
      } else if (t.kind == Tok::integer || t.kind == Tok::real) {
        one.kind = SourceTokenKind::number;
      } else if (t.kind == Tok::string) {
        one.kind = SourceTokenKind::string;
      } else if (t.kind == Tok::name) {
        while (next_use < uses.size() && uses[next_use].begin < t.begin) ++next_use;
        if (next_use < uses.size() && uses[next_use].begin == t.begin) {
          const Use& u = uses[next_use];
          one.kind = p.analysis->kind(u);
          one.is_declaration = u.is_declaration;
          one.is_predefined = p.analysis->is_predefined(u);
        } else {
          one.kind = is_word_of_place(p.analysis->names.upper(t.name)) ? SourceTokenKind::keyword
                                                                       : SourceTokenKind::name;
        }
      } else {
        one.kind = t.kind == Tok::unknown ? SourceTokenKind::unknown : SourceTokenKind::sign;
      }
      out.push_back(one);
    }
    return out;
  }

  Result<std::vector<SourceCompletion>> complete(Id file, Id at,
                                                 Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, at, Depth::heads, progress));
    return irl::complete(*p.analysis, p.files, p.file, at);
  }

  Result<SourceHover> hover(Id file, Id at, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, at, Depth::all, progress));
    SourceHover out;
    out.range.file = file;
    if (const Use* u = p.analysis->use_at(p.file, at)) {
      out.range = {file, u->begin, u->end};
      out.detail = p.analysis->detail(*u);
      out.doc = p.analysis->doc(*u);
      return out;
    }
    const Token* t = token_at(*p.source, at);
    if (!t) return out;
    const std::string word = upper(p.source->word(*t));
    if (t->kind < Tok::k_program && !(t->kind == Tok::name && is_word_of_place(word))) return out;
    out.range = {file, t->begin, t->end};
    out.detail = word;
    out.doc = std::string(word_doc(word));
    return out;
  }

  Result<std::vector<SourceRange>> definition(Id file, Id at, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, at, Depth::all, progress));
    std::vector<SourceRange> out;
    if (const Use* u = p.analysis->use_at(p.file, at)) {
      SourceRange r = p.analysis->declared(*u);
      if (r.file != kNone) {
        r.file = p.given(r.file);
        out.push_back(r);
      }
      return out;
    }
    // The name of a file leads to the file.
    const Token* t = token_at(*p.source, at);
    if (!t) return out;
    std::string wanted;
    if (t->kind == Tok::string) wanted = upper(string_value(p.source->word(*t)));
    else if (t->kind == Tok::name) wanted = upper(p.source->word(*t)) + ".IRL";
    const std::size_t slash = wanted.find_last_of("/\\");
    if (slash != std::string::npos) wanted = wanted.substr(slash + 1);
    const std::size_t index = static_cast<std::size_t>(t - p.source->tokens.data());
    const bool names_file = (t->kind == Tok::string && index > 0 &&
                             (p.source->tokens[index - 1].kind == Tok::k_system_specification ||
                              p.source->tokens[index - 1].kind == Tok::k_datalist)) ||
                            (t->kind == Tok::name && is_import(*p.source, *t));
    for (Id f = 0; names_file && f < files_.size(); ++f)
      if (upper(names_[f]) == wanted && f != file) out.push_back({f, 0, 0});
    return out;
  }

  Result<std::vector<SourceReference>> references(Id file, Id at,
                                                  Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, at, Depth::all, progress));
    std::vector<SourceReference> out;
    const Use* u = p.analysis->use_at(p.file, at);
    if (!u) return out;
    for (Id f = 0; f < files_.size(); ++f)
      for (const Use& x : p.analysis->uses(f)) {
        if (x.kind != u->kind || x.id != u->id) continue;
        SourceReference one;
        one.range = {p.given(f), x.begin, x.end};
        one.is_declaration = x.is_declaration;
        out.push_back(one);
      }
    std::sort(out.begin(), out.end(), [](const SourceReference& x, const SourceReference& y) {
      return std::pair(x.range.file, x.range.begin) < std::pair(y.range.file, y.range.begin);
    });
    return out;
  }

  Result<std::vector<SourceEdit>> rename(Id file, Id at, std::string_view new_name,
                                         Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, at, Depth::all, progress));
    const Analysis& a = *p.analysis;
    const Use* u = a.use_at(p.file, at);
    const Token* t = token_at(*p.source, at);
    if (!u) {
      if (t && t->kind == Tok::name)
        return error(ErrorCode::not_found,
                     quoted(p.source->word(*t)) + " is a name with unknown meaning here",
                     "Correct the errors of the line first.", where(file, *t));
      return error(
          ErrorCode::not_found, "there is no name at this position",
          "Only names of constants, variables, types, fields, routines and labels can be changed.",
          names_[file]);
    }
    const std::string_view old = files_[file].text.substr(u->begin, u->end - u->begin);
    if (a.is_predefined(*u))
      return error(ErrorCode::unsupported,
                   quoted(old) + " is a name of the language and cannot be changed", {},
                   names_[file]);
    SourceEdit self;
    self.range = {file, u->begin, u->end};
    self.text = std::string(old);
    if (new_name.empty()) return std::vector<SourceEdit>{std::move(self)};
    if (!is_name(new_name))
      return error(ErrorCode::invalid_argument, quoted(new_name) + " is not a name",
                   "Names start with a letter, followed by letters, digits and \"_\".", "new_name");
    const std::string big = upper(new_name);
    const auto& reserved = reserved_words();
    if (std::find(reserved.begin(), reserved.end(), big) != reserved.end())
      return error(ErrorCode::invalid_argument,
                   quoted(new_name) + " is a keyword of the language, not a name", {}, "new_name");
    // Where a line could not be read, it is not known whether its names are this one.
    const std::string old_big = upper(old);
    for (Id f = 0; a.faults.errors() > 0 && f < files_.size(); ++f) {
      const Source* s = a.source(f);
      if (!s) continue;
      for (const Token& x : s->tokens)
        if (x.kind == Tok::name && a.names.upper(x.name) == old_big && !a.use_from(f, x.begin))
          return error(ErrorCode::conflict,
                       "the program has errors, and it is unknown whether " + quoted(old) +
                           " here is the same",
                       "Correct them first: program.check.", where(p.given(f), x));
    }
    std::vector<SourceEdit> edits;
    std::vector<std::string> texts;
    for (const SourceFile& f : p.files) texts.emplace_back(f.text);
    for (Id f = 0; f < files_.size(); ++f) {
      const std::vector<Use>& uses = a.uses(f);
      std::string changed;
      Id done = 0;
      for (const Use& x : uses) {
        if (x.kind != u->kind || x.id != u->id) continue;
        SourceEdit e;
        e.range = {p.given(f), x.begin, x.end};
        e.text = std::string(new_name);
        changed.append(texts[f], done, x.begin - done);
        changed += new_name;
        done = x.end;
        edits.push_back(std::move(e));
      }
      if (done > 0) texts[f] = changed + texts[f].substr(done);
    }
    std::sort(edits.begin(), edits.end(), [](const SourceEdit& x, const SourceEdit& y) {
      return std::pair(x.range.file, x.range.begin) < std::pair(y.range.file, y.range.begin);
    });
    // The program as it would be: every name means what it meant.
    std::vector<SourceFile> files;
    for (std::size_t i = 0; i < texts.size(); ++i) files.push_back({p.files[i].name, texts[i], {}});
    Analysis after(files, Depth::all);
    if (!after.run(progress)) return stopped();
    RMP_TRY(same_meaning(p, after, new_name));
    return edits;
  }

  Result<std::string> format(Id file, const SourceLayout& layout, Progress&) const override {
    RMP_TRY(in_range(file, 0));
    return lay_out(names_[file], texts_[file], layout);
  }

  Result<std::vector<SourceSymbol>> outline(Id file, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, 0, Depth::declarations, progress));
    std::vector<SourceSymbol> out;
    const Source& s = *p.source;
    if (s.nodes.empty()) return out;
    const Node& root = s.nodes[0];
    const auto add = [&](const Node& n, Id parent, SourceTokenKind kind) {
      if (n.name == kNone) return kNone;
      SourceSymbol one;
      const Token& name = s.tokens[n.name_token];
      one.name = std::string(s.word(name));
      one.kind = kind;
      if (const Use* u = p.analysis->use_from(p.file, name.begin)) {
        one.detail = p.analysis->detail(*u);
        one.kind = p.analysis->kind(*u);
      }
      one.parent = parent;
      one.name_begin = name.begin;
      one.name_end = name.end;
      one.begin = std::min(s.tokens[n.token].begin, name.begin);
      one.end = std::max(s.tokens[n.last].end, name.end);
      out.push_back(std::move(one));
      return static_cast<Id>(out.size() - 1);
    };
    const auto section = [&](const Node& n, Id parent) {
      for (Id d = n.first; d != kNone; d = s.nodes[d].next) {
        const Node& x = s.nodes[d];
        switch (x.kind) {
          case N::var_decl:
            for (Id v = s.nodes[x.first].next; v != kNone; v = s.nodes[v].next)
              add(s.nodes[v], parent,
                  n.kind == N::const_section ? SourceTokenKind::constant
                                             : SourceTokenKind::variable);
            break;
          case N::type_decl: add(x, parent, SourceTokenKind::type); break;
          case N::robot_decl: add(x, parent, SourceTokenKind::robot); break;
          case N::signal_decl: add(x, parent, SourceTokenKind::signal); break;
          default: break;
        }
      }
    };
    const auto is_section = [](N k) {
      return k == N::const_section || k == N::var_section || k == N::type_section ||
             k == N::signal_section;
    };
    const Id top = root.kind == N::data_list ? kNone : add(root, kNone, SourceTokenKind::program);
    for (Id d = root.first; d != kNone; d = s.nodes[d].next) {
      const Node& n = s.nodes[d];
      if (is_section(n.kind)) section(n, top);
      const bool is_routine = n.kind == N::procedure || n.kind == N::function ||
                              n.kind == N::process || n.kind == N::interrupt;
      if (is_routine) {
        const Id r = add(n, top,
                         n.kind == N::procedure  ? SourceTokenKind::procedure
                         : n.kind == N::function ? SourceTokenKind::function
                                                 : SourceTokenKind::process);
        for (Id c = n.first; c != kNone && r != kNone; c = s.nodes[c].next) {
          if (is_section(s.nodes[c].kind)) section(s.nodes[c], r);
          if (s.nodes[c].kind != N::params) continue;
          for (Id q = s.nodes[c].first; q != kNone; q = s.nodes[q].next)
            for (Id v = s.nodes[s.nodes[q].first].next; v != kNone; v = s.nodes[v].next)
              add(s.nodes[v], r, SourceTokenKind::parameter);
        }
      }
      if (root.kind == N::data_list && n.kind == N::block)
        for (Id v = n.first; v != kNone; v = s.nodes[v].next)
          if (s.nodes[v].kind == N::assign && s.nodes[v].first != kNone) {
            Node one = s.nodes[s.nodes[v].first];
            one.last = s.nodes[v].last;
            add(one, kNone, SourceTokenKind::variable);
          }
    }
    return out;
  }

  Result<SourceSignature> signature(Id file, Id at, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, at, Depth::heads, progress));
    return irl::signature(*p.analysis, p.file, at);
  }

  Result<std::vector<SourceRange>> folds(Id file, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Place p, place(file, 0, Depth::declarations, progress));
    const Source& s = *p.source;
    std::vector<SourceRange> out;
    for (const Node& n : s.nodes) {
      switch (n.kind) {
        case N::procedure:
        case N::function:
        case N::process:
        case N::interrupt:
        case N::type_record:
        case N::const_section:
        case N::var_section:
        case N::type_section:
        case N::signal_section:
        case N::if_:
        case N::case_:
        case N::while_:
        case N::repeat:
        case N::loop:
        case N::for_:
          if (s.tokens[n.last].line > s.tokens[n.token].line)
            out.push_back({file, s.tokens[n.token].begin, s.tokens[n.last].end});
          break;
        default: break;
      }
    }
    Id from = 0;
    for (const Token& t : s.tokens) {
      each_gap(s.text, from, t.begin, [&](Gap g, Id b, Id e) {
        if (g == Gap::comment && s.text.substr(b, e - b).find('\n') != std::string_view::npos)
          out.push_back({file, b, e});
      });
      from = t.end;
    }
    std::sort(out.begin(), out.end(), [](const SourceRange& x, const SourceRange& y) {
      return std::pair(x.begin, y.end) < std::pair(y.begin, x.end);
    });
    return out;
  }

 private:
  /// Where a question is answered: a file as the program that names it reads it.
  struct Place {
    std::shared_ptr<const Analysis> analysis;
    std::span<const SourceFile> files;  ///< in the analysis' order
    Id file = 0;                        ///< there
    Id root = 0;                        ///< file of the task that is first there
    const Source* source = nullptr;
    /// Number in the task of a file of the analysis.
    [[nodiscard]] Id given(Id f) const {
      if (f == 0) return root;
      return f <= root ? f - 1 : f;
    }
  };
  struct Made {
    std::vector<SourceFile> files;
    std::shared_ptr<const Analysis> heads, declarations, all;
  };

  static Error stopped() { return error(ErrorCode::cancelled, "the compiler was cancelled"); }
  static std::string quoted(std::string_view s) { return "\"" + std::string(s) + "\""; }
  std::string where(Id file, const Token& t) const {
    return names_[file] + ":" + std::to_string(t.line) + ":" + std::to_string(t.column);
  }
  Result<void> in_range(Id file, Id at) const {
    if (files_.empty())
      return error(ErrorCode::invalid_argument, "there is no file to edit",
                   "Give the program's source.");
    if (file >= files_.size())
      return error(ErrorCode::invalid_argument, "the program has no file " + std::to_string(file));
    if (at > texts_[file].size())
      return error(ErrorCode::invalid_argument, "the text ends before byte " + std::to_string(at),
                   {}, names_[file]);
    for (std::size_t i = 0; i < texts_.size(); ++i)
      if (texts_[i].size() > kMostEditedBytes)
        return error(ErrorCode::unsupported,
                     "the source has more than " + std::to_string(kMostEditedBytes) + " bytes",
                     "Split it over modules.", names_[i]);
    return {};
  }
  Result<std::shared_ptr<const Analysis>> of(Id root, Depth depth, Progress& progress) const {
    RMP_TRY(in_range(root, 0));
    const std::lock_guard lock(mutex_);
    Made& m = made_[root];
    if (m.all) return m.all;
    if (depth != Depth::all && m.declarations) return m.declarations;
    if (depth == Depth::heads && m.heads) return m.heads;
    if (m.files.empty()) {
      m.files.push_back(files_[root]);
      for (Id f = 0; f < files_.size(); ++f)
        if (f != root) m.files.push_back(files_[f]);
    }
    auto made = std::make_shared<Analysis>(m.files, depth);
    if (!made->run(progress)) return stopped();
    (depth == Depth::all ? m.all : depth == Depth::declarations ? m.declarations : m.heads) = made;
    // What tells more takes the place of what tells less.
    if (depth != Depth::heads) m.heads.reset();
    if (depth == Depth::all) m.declarations.reset();
    return std::shared_ptr<const Analysis>(std::move(made));
  }
  /// A file that the program does not name is looked at by itself.
  Result<Place> place(Id file, Id at, Depth depth, Progress& progress) const {
    RMP_TRY(in_range(file, at));
    Place out;
    RMP_TRY_ASSIGN(out.analysis, of(0, depth, progress));
    out.file = file;
    if (!out.analysis->source(file)) {
      RMP_TRY_ASSIGN(out.analysis, of(file, depth, progress));
      out.file = 0;
      out.root = file;
    }
    out.files = made_[out.root].files;
    out.source = out.analysis->source(out.file);
    if (!out.source)
      return error(ErrorCode::internal, "the compiler did not read the file", {}, names_[file]);
    return out;
  }
  static const Token* token_at(const Source& s, Id at) {
    auto it = std::upper_bound(s.tokens.begin(), s.tokens.end(), at,
                               [](Id place, const Token& t) { return place < t.begin; });
    while (it != s.tokens.begin()) {
      --it;
      if (it->kind == Tok::end) continue;
      return at <= it->end ? &*it : nullptr;
    }
    return nullptr;
  }
  static bool is_import(const Source& s, const Token& t) {
    for (const Node& n : s.nodes) {
      if (n.kind != N::import_) continue;
      if (s.tokens[n.token].begin <= t.begin && t.end <= s.tokens[n.last].end) return true;
    }
    return false;
  }
  Result<void> same_meaning(const Place& p, const Analysis& after,
                            std::string_view new_name) const {
    const Analysis& before = *p.analysis;
    const auto refused = [&](const std::string& what, const std::string& place) {
      return error(ErrorCode::conflict, what, "Choose another name.", place);
    };
    if (after.faults.errors() > before.faults.errors()) {
      // The first that was not there before.
      for (std::size_t k = 0; k < after.faults.all.size(); ++k) {
        const Fault& f = after.faults.all[k];
        if (f.severity != RMP_FAULT_ERROR) continue;
        const bool is_old =
            k < before.faults.all.size() && before.faults.all[k].message == f.message;
        if (is_old) continue;
        const Id file = after.task_file(f.file);
        return refused(
            "with the name " + quoted(new_name) + " the program has an error: " + f.message,
            file == kNone ? names_[p.root] : where(p.given(file), f.at));
      }
    }
    const auto other = [&](Id f, const Use& u) {
      const Source* s = after.source(f);
      Token t;
      if (s) {
        const auto it = std::lower_bound(s->tokens.begin(), s->tokens.end(), u.begin,
                                         [](const Token& x, Id b) { return x.begin < b; });
        if (it != s->tokens.end()) t = *it;
      }
      return refused("with the name " + quoted(new_name) + ", " +
                         quoted(s ? s->word(t) : new_name) + " would have a different meaning here",
                     where(p.given(f), t));
    };
    for (Id f = 0; f < files_.size(); ++f) {
      const std::vector<Use>&x = before.uses(f), &y = after.uses(f);
      for (std::size_t k = 0; k < std::min(x.size(), y.size()); ++k)
        if (x[k].id != y[k].id || x[k].kind != y[k].kind ||
            x[k].is_declaration != y[k].is_declaration)
          return other(f, y[k]);
      if (x.size() != y.size())
        return refused(
            "with the name " + quoted(new_name) + " the program would have a different meaning",
            names_[p.given(f)]);
    }
    if (before.out.types.size() != after.out.types.size())
      return refused(
          "with the name " + quoted(new_name) + " the program would have a different meaning",
          names_[p.root]);
    for (std::size_t t = 0; t < before.out.types.size(); ++t)
      if (before.out.types[t].role != after.out.types[t].role)
        return refused(quoted(*before.out.types[t].name ? before.out.types[t].name : new_name) +
                           " has a meaning for motions by its name",
                       names_[p.root]);
    return {};
  }

  std::deque<std::string> names_, texts_;  // they stay where they are
  std::vector<SourceFile> files_;
  mutable std::mutex mutex_;
  mutable std::deque<Made> made_;  ///< by the file that comes first
};

}  // namespace

std::unique_ptr<EditedProgram> edit(std::span<const SourceFile> files) {
  return std::make_unique<Edited>(files);
}

}  // namespace robomosp::irl
