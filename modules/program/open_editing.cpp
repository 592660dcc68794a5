// SPDX-License-Identifier: Apache-2.0
#include "program/open_editing.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <utility>

#include <robomosp/sdk/program_tables.h>

#include "kernel/text.h"

namespace robomosp::program {
namespace {

/// Without regard to case of letters A to Z.
bool is_same_word(std::string_view a, std::string_view b) {
  const auto small = [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : +c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return small(x) == small(y); });
}

/// What the language itself tells, with the language, which must stay as long.
class Kept final : public EditedProgram {
 public:
  Kept(std::shared_ptr<Language> language, std::unique_ptr<EditedProgram> inner)
      : language_(std::move(language)), inner_(std::move(inner)) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<std::vector<SourceFault>> faults(Progress& p) const override { return inner_->faults(p); }
  Result<std::vector<SourceToken>> tokens(std::uint32_t f, Progress& p) const override {
    return inner_->tokens(f, p);
  }
  Result<std::vector<SourceCompletion>> complete(std::uint32_t f, std::uint32_t at,
                                                 Progress& p) const override {
    return inner_->complete(f, at, p);
  }
  Result<SourceHover> hover(std::uint32_t f, std::uint32_t at, Progress& p) const override {
    return inner_->hover(f, at, p);
  }
  Result<std::vector<SourceRange>> definition(std::uint32_t f, std::uint32_t at,
                                              Progress& p) const override {
    return inner_->definition(f, at, p);
  }
  Result<std::vector<SourceReference>> references(std::uint32_t f, std::uint32_t at,
                                                  Progress& p) const override {
    return inner_->references(f, at, p);
  }
  Result<std::vector<SourceEdit>> rename(std::uint32_t f, std::uint32_t at, std::string_view name,
                                         Progress& p) const override {
    return inner_->rename(f, at, name, p);
  }
  Result<std::string> format(std::uint32_t f, const SourceLayout& how, Progress& p) const override {
    return inner_->format(f, how, p);
  }
  Result<std::vector<SourceSymbol>> outline(std::uint32_t f, Progress& p) const override {
    return inner_->outline(f, p);
  }
  Result<SourceSignature> signature(std::uint32_t f, std::uint32_t at, Progress& p) const override {
    return inner_->signature(f, at, p);
  }
  Result<std::vector<SourceRange>> folds(std::uint32_t f, Progress& p) const override {
    return inner_->folds(f, p);
  }

 private:
  std::shared_ptr<Language> language_;  // goes after inner_
  std::unique_ptr<EditedProgram> inner_;
};

/// By the tables of the compiler alone.
class ByTables final : public EditedProgram {
 public:
  ByTables(std::shared_ptr<Language> language, std::string name,
           std::shared_ptr<const Params> params, std::span<const SourceFile> files)
      : language_(std::move(language)), name_(std::move(name)), params_(std::move(params)) {
    for (const SourceFile& f : files) {
      names_.emplace_back(f.name);
      texts_.emplace_back(f.text);
    }
    for (std::size_t i = 0; i < names_.size(); ++i) files_.push_back({names_[i], texts_[i], {}});
  }

  Result<std::vector<SourceFault>> faults(Progress& progress) const override {
    RMP_TRY_ASSIGN(const Tables* t, tables(progress));
    const rmp_code& c = t->program->code();
    std::vector<SourceFault> out;
    for (std::uint32_t i = 0; i < c.faults.count; ++i) {
      const auto& f = row<rmp_code_fault>(c.faults, i);
      SourceFault one;
      one.severity = f.severity;
      if (auto r = range(*t, f.span)) one.range = *r;
      one.message = f.message;
      one.hint = f.hint;
      out.push_back(std::move(one));
    }
    return out;
  }
  Result<std::vector<SourceToken>> tokens(std::uint32_t file, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Tables* t, whole(file, 0, progress));
    std::vector<SourceToken> out;
    for (const Name& n : t->names) {
      if (n.range.file != file) continue;
      SourceToken one;
      one.kind = kind(*t, n.symbol);
      one.begin = n.range.begin;
      one.end = n.range.end;
      one.is_declaration = n.is_declaration;
      out.push_back(one);
    }
    return out;
  }
  Result<std::vector<SourceCompletion>> complete(std::uint32_t, std::uint32_t,
                                                 Progress&) const override {
    return lacks("completion");
  }
  Result<SourceHover> hover(std::uint32_t file, std::uint32_t at,
                            Progress& progress) const override {
    RMP_TRY_ASSIGN(const Tables* t, whole(file, at, progress));
    SourceHover out;
    out.range.file = file;
    if (const Name* n = name_at(*t, file, at)) {
      out.range = n->range;
      out.detail = detail(*t, n->symbol);
    }
    return out;
  }
  Result<std::vector<SourceRange>> definition(std::uint32_t file, std::uint32_t at,
                                              Progress& progress) const override {
    RMP_TRY_ASSIGN(const Tables* t, whole(file, at, progress));
    std::vector<SourceRange> out;
    if (const Name* n = name_at(*t, file, at)) {
      const auto& s = row<rmp_code_symbol>(t->program->code().symbols, n->symbol);
      if (s.span.line > 0)
        if (const auto r = range(*t, s.span)) out.push_back(*r);
    }
    return out;
  }
  Result<std::vector<SourceReference>> references(std::uint32_t file, std::uint32_t at,
                                                  Progress& progress) const override {
    RMP_TRY_ASSIGN(const Tables* t, whole(file, at, progress));
    std::vector<SourceReference> out;
    const Name* n = name_at(*t, file, at);
    for (const Name& x : t->names)
      if (n && x.symbol == n->symbol) out.push_back({x.range, x.is_declaration, {}});
    return out;
  }
  Result<std::vector<SourceEdit>> rename(std::uint32_t, std::uint32_t, std::string_view,
                                         Progress&) const override {
    return lacks("new names");
  }
  Result<std::string> format(std::uint32_t, const SourceLayout&, Progress&) const override {
    return lacks("a layout");
  }
  Result<std::vector<SourceSymbol>> outline(std::uint32_t file, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Tables* t, whole(file, 0, progress));
    const rmp_code& c = t->program->code();
    std::vector<SourceSymbol> out;
    for (std::uint32_t i = 0; i < c.symbols.count; ++i) {
      const auto& s = row<rmp_code_symbol>(c.symbols, i);
      const auto r = s.span.line > 0 ? range(*t, s.span) : std::nullopt;
      if (!r || r->file != file || s.kind > RMP_SYMBOL_ROUTINE) continue;
      SourceSymbol one;
      one.name = s.name;
      one.detail = detail(*t, i);
      one.kind = kind(*t, i);
      one.begin = one.name_begin = r->begin;
      one.end = one.name_end = r->end;
      if (s.kind == RMP_SYMBOL_ROUTINE && s.routine < c.routines.count) {
        const auto all = range(*t, row<rmp_code_routine>(c.routines, s.routine).span);
        if (all && all->file == file && all->begin <= r->begin && all->end >= r->end) {
          one.begin = all->begin;
          one.end = all->end;
        }
      }
      out.push_back(std::move(one));
    }
    return out;
  }
  Result<SourceSignature> signature(std::uint32_t, std::uint32_t, Progress&) const override {
    return lacks("help with calls");
  }
  Result<std::vector<SourceRange>> folds(std::uint32_t file, Progress& progress) const override {
    RMP_TRY_ASSIGN(const Tables* t, whole(file, 0, progress));
    const rmp_code& c = t->program->code();
    std::vector<SourceRange> out;
    for (std::uint32_t i = 0; i < c.routines.count; ++i)
      if (const auto r = range(*t, row<rmp_code_routine>(c.routines, i).span))
        if (r->file == file && r->begin < r->end) out.push_back(*r);
    return out;
  }

 private:
  struct Name {
    SourceRange range;
    std::uint32_t symbol = 0;
    bool is_declaration = false;
  };
  struct Tables {
    std::unique_ptr<CompiledProgram> program;
    std::vector<std::uint32_t> files;  ///< by file of the compiler: of the task, or RMP_NONE
    std::vector<Name> names;           ///< in order of file and place, none twice
  };

  [[nodiscard]] Error lacks(const std::string& what) const {
    return error(
        ErrorCode::unsupported, "the language " + text::quote(name_) + " gives editors no " + what,
        "Its provider lacks the extension " + std::string(LanguageEditing::kExtensionId) + ".");
  }
  [[nodiscard]] std::optional<SourceRange> range(const Tables& t, const rmp_span& s) const {
    if (s.file >= t.files.size() || t.files[s.file] == RMP_NONE) return std::nullopt;
    const SourceRange r{t.files[s.file], s.begin, s.end};
    if (r.begin > r.end || r.end > texts_[r.file].size()) return std::nullopt;
    return r;
  }
  Result<const Tables*> tables(Progress& progress) const {
    const std::lock_guard lock(mutex_);
    if (made_) return made_.get();
    LanguageTask task;
    task.files = files_;
    auto made = std::make_unique<Tables>();
    RMP_TRY_ASSIGN(made->program, language_->compile(task, *params_, progress));
    const rmp_code& c = made->program->code();
    for (std::uint32_t i = 0; i < c.files.count; ++i) {
      const auto it = std::find(names_.begin(), names_.end(), row<rmp_code_file>(c.files, i).name);
      made->files.push_back(it == names_.end() ? RMP_NONE
                                               : static_cast<std::uint32_t>(it - names_.begin()));
    }
    if (!c.has_errors) find_names(*made);
    made_ = std::move(made);
    return made_.get();
  }
  void find_names(Tables& t) const {
    const rmp_code& c = t.program->code();
    const auto add = [&](const rmp_span& span, std::uint32_t symbol, bool is_declaration) {
      if (symbol >= c.symbols.count || span.line == 0) return;
      auto r = range(t, span);
      if (!r) return;
      // An expression may begin with its name and go on.
      const std::string_view name = row<rmp_code_symbol>(c.symbols, symbol).name;
      if (r->end - r->begin < name.size()) return;
      r->end = r->begin + static_cast<std::uint32_t>(name.size());
      const std::string_view written =
          std::string_view(texts_[r->file]).substr(r->begin, name.size());
      if (!is_same_word(written, name)) return;
      t.names.push_back({*r, symbol, is_declaration});
    };
    for (std::uint32_t i = 0; i < c.symbols.count; ++i)
      add(row<rmp_code_symbol>(c.symbols, i).span, i, true);
    for (std::uint32_t i = 0; i < c.expressions.count; ++i) {
      const auto& e = row<rmp_code_expression>(c.expressions, i);
      if (e.op == RMP_EXPR_SYMBOL || e.op == RMP_EXPR_CALL || e.op == RMP_EXPR_INTRINSIC)
        add(e.span, e.symbol, false);
    }
    const auto order = [](const Name& a, const Name& b) {
      return std::pair(a.range.file, a.range.begin) < std::pair(b.range.file, b.range.begin);
    };
    std::stable_sort(t.names.begin(), t.names.end(), order);
    std::vector<Name> once;
    for (const Name& n : t.names)
      if (once.empty() || once.back().range.file != n.range.file ||
          once.back().range.end <= n.range.begin)
        once.push_back(n);
    t.names = std::move(once);
  }
  /// The tables of a program without errors.
  Result<const Tables*> whole(std::uint32_t file, std::uint32_t at, Progress& progress) const {
    if (file >= texts_.size() || at > texts_[file].size())
      return error(ErrorCode::invalid_argument, "the program has no byte " + std::to_string(at) +
                                                    " in file " + std::to_string(file));
    RMP_TRY_ASSIGN(const Tables* t, tables(progress));
    if (t->program->code().has_errors)
      return error(ErrorCode::unsupported,
                   "the language " + text::quote(name_) +
                       " gives editors no information about programs with errors",
                   "Correct them first: program.check.", names_[file]);
    return t;
  }
  static const Name* name_at(const Tables& t, std::uint32_t file, std::uint32_t at) {
    for (const Name& n : t.names)
      if (n.range.file == file && n.range.begin <= at && at <= n.range.end) return &n;
    return nullptr;
  }
  static SourceTokenKind kind(const Tables& t, std::uint32_t symbol) {
    static constexpr SourceTokenKind kKinds[] = {
        SourceTokenKind::constant, SourceTokenKind::variable,  SourceTokenKind::parameter,
        SourceTokenKind::signal,   SourceTokenKind::signal,    SourceTokenKind::robot,
        SourceTokenKind::type,     SourceTokenKind::procedure, SourceTokenKind::label,
        SourceTokenKind::function, SourceTokenKind::variable};
    const std::uint32_t k = row<rmp_code_symbol>(t.program->code().symbols, symbol).kind;
    return k < std::size(kKinds) ? kKinds[k] : SourceTokenKind::name;
  }
  /// "variable a: INT".
  static std::string detail(const Tables& t, std::uint32_t symbol) {
    static constexpr const char* kWords[] = {"constant", "variable", "parameter", "input",
                                             "output",   "robot",    "type",      "routine",
                                             "label",    "function", "import"};
    static constexpr const char* kBasic[] = {"",       "INT",  "REAL", "CHAR",      "BOOL",
                                             "STRING", "TEXT", "FILE", "SEMAPHORE", "process"};
    const rmp_code& c = t.program->code();
    const auto& s = row<rmp_code_symbol>(c.symbols, symbol);
    std::string out =
        std::string(s.kind < std::size(kWords) ? kWords[s.kind] : "name") + " " + s.name;
    if (s.kind > RMP_SYMBOL_ROBOT || s.type >= c.types.count) return out;
    const auto& type = row<rmp_code_type>(c.types, s.type);
    const std::string name = s.type <= RMP_TYPE_PROCESS ? kBasic[s.type] : type.name;
    return name.empty() ? out : out + ": " + name;
  }

  std::shared_ptr<Language> language_;
  std::string name_;
  std::shared_ptr<const Params> params_;
  std::deque<std::string> names_, texts_;  // they stay where they are
  std::vector<SourceFile> files_;
  mutable std::mutex mutex_;
  mutable std::unique_ptr<Tables> made_;
};

}  // namespace

Result<std::unique_ptr<EditedProgram>> open_editing(std::shared_ptr<Language> language,
                                                    std::string name,
                                                    std::shared_ptr<const Params> params,
                                                    std::span<const SourceFile> files) {
  if (const void* known = language->extension(LanguageEditing::kExtensionId)) {
    LanguageTask task;
    task.files = files;
    RMP_TRY_ASSIGN(auto made, static_cast<const LanguageEditing*>(known)->open(task));
    return std::unique_ptr<EditedProgram>(
        std::make_unique<Kept>(std::move(language), std::move(made)));
  }
  return std::unique_ptr<EditedProgram>(
      std::make_unique<ByTables>(std::move(language), std::move(name), std::move(params), files));
}

}  // namespace robomosp::program
