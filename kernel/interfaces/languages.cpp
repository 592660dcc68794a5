// SPDX-License-Identifier: Apache-2.0
// Guard of languages: what a compiler hands over is looked at before anybody follows its numbers,
// and what it tells editors before anybody changes a text by it.
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/language_editing.h>
#include <robomosp/sdk/program_tables.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"

namespace robomosp {
namespace {

/// What is wrong with the tables of a program; "" = nothing.
class Tables {
 public:
  explicit Tables(const rmp_code& code) : c_(code) {}
  std::string fault() {
    if (c_.struct_size < sizeof(rmp_code)) return "made tables of another version";
    const std::pair<const rmp_table*, std::size_t> sizes[] = {
        {&c_.files, sizeof(rmp_code_file)},
        {&c_.faults, sizeof(rmp_code_fault)},
        {&c_.types, sizeof(rmp_code_type)},
        {&c_.fields, sizeof(rmp_code_field)},
        {&c_.constants, sizeof(rmp_code_constant)},
        {&c_.scopes, sizeof(rmp_code_scope)},
        {&c_.symbols, sizeof(rmp_code_symbol)},
        {&c_.routines, sizeof(rmp_code_routine)},
        {&c_.expressions, sizeof(rmp_code_expression)},
        {&c_.statements, sizeof(rmp_code_statement)},
        {&c_.motions, sizeof(rmp_code_motion)},
        {&c_.attributes, sizeof(rmp_code_attribute)},
        {&c_.links, sizeof(std::uint32_t)},
        {&c_.instructions, sizeof(rmp_code_instruction)}};
    for (const auto& [table, size] : sizes)
      if (table->count > 0 && (!table->rows || table->row_size < size))
        return "made tables with rows that are too short";
    if (!c_.name) return "made a program without a name";
    for (std::uint32_t i = 0; i < c_.files.count; ++i) name(row<rmp_code_file>(c_.files, i).name);
    for (std::uint32_t i = 0; i < c_.faults.count; ++i) {
      const auto& f = row<rmp_code_fault>(c_.faults, i);
      name(f.message);
      name(f.hint);
      in(f.severity, RMP_FAULT_NOTE + 1);
      in(f.span.file, c_.files.count);
    }
    if (wrong_) return "made tables with numbers that refer to nothing";
    // With errors only the faults are looked at.
    if (c_.has_errors) return {};
    types();
    symbols();
    statements();
    for (std::uint32_t i = 0; i < c_.instructions.count; ++i) {
      const auto& x = row<rmp_code_instruction>(c_.instructions, i);
      in(x.op, RMP_OP_TEACH + 1);
      in(x.span.file, c_.files.count);
      for (const rmp_code_operand* o : {&x.a, &x.b, &x.r}) operand(*o, x.op);
    }
    return wrong_ ? "made tables with numbers that refer to nothing" : "";
  }

 private:
  void name(const char* text) { wrong_ = wrong_ || !text; }
  void in(std::uint64_t i, std::uint64_t count) { wrong_ = wrong_ || i >= count; }
  void in_or_none(std::uint32_t i, std::uint64_t count) {
    if (i != RMP_NONE) in(i, count);
  }
  void run(std::uint64_t first, std::uint64_t count, std::uint64_t all) {
    wrong_ = wrong_ || first + count > all;
  }
  void types() {
    for (std::uint32_t i = 0; i < c_.types.count; ++i) {
      const auto& t = row<rmp_code_type>(c_.types, i);
      name(t.name);
      in(t.kind, RMP_TYPE_LIST + 1);
      in(t.role, RMP_ROLE_ROBOT + 1);
      if (i <= RMP_TYPE_PROCESS) wrong_ = wrong_ || t.kind != i;
      // Made of types that come before, so that no type holds itself.
      if (t.kind == RMP_TYPE_ARRAY || t.kind == RMP_TYPE_LIST) in(t.element, i);
      if (t.kind == RMP_TYPE_ARRAY) wrong_ = wrong_ || t.upper < t.lower;
      if (t.kind != RMP_TYPE_RECORD) continue;
      run(t.first_field, t.field_count, c_.fields.count);
      for (std::uint32_t k = 0; !wrong_ && k < t.field_count; ++k) {
        const auto& f = row<rmp_code_field>(c_.fields, t.first_field + k);
        name(f.name);
        in(f.type, i);
      }
    }
    wrong_ = wrong_ || c_.types.count <= RMP_TYPE_PROCESS;
    for (std::uint32_t i = 0; i < c_.constants.count; ++i) {
      const auto& k = row<rmp_code_constant>(c_.constants, i);
      in(k.kind, RMP_CONSTANT_TEXT + 1);
      in(k.type, c_.types.count);
      name(k.text);
    }
  }
  void symbols() {
    for (std::uint32_t i = 0; i < c_.scopes.count; ++i) {
      const auto& s = row<rmp_code_scope>(c_.scopes, i);
      name(s.name);
      in(s.kind, RMP_SCOPE_ROUTINE + 1);
      in_or_none(s.parent, i);
    }
    for (std::uint32_t i = 0; i < c_.symbols.count; ++i) {
      const auto& s = row<rmp_code_symbol>(c_.symbols, i);
      name(s.name);
      in(s.kind, RMP_SYMBOL_IMPORT + 1);
      in(s.mode, RMP_MODE_INOUT + 1);
      in(s.type, c_.types.count);
      in_or_none(s.scope, c_.scopes.count);
      in_or_none(s.routine, c_.routines.count);
      in_or_none(s.value, c_.expressions.count);
      in_or_none(s.constant, c_.constants.count);
    }
    in(0, c_.routines.count);
    for (std::uint32_t i = 0; i < c_.routines.count; ++i) {
      const auto& r = row<rmp_code_routine>(c_.routines, i);
      in(r.kind, RMP_ROUTINE_DATA_LIST + 1);
      in(r.symbol, c_.symbols.count);
      in_or_none(r.scope, c_.scopes.count);
      in(r.result, c_.types.count);
      if (r.parameter_count) run(r.first_parameter, r.parameter_count, c_.symbols.count);
      in_or_none(r.body, c_.statements.count);
      in_or_none(r.priority, c_.expressions.count);
      in_or_none(r.condition, c_.expressions.count);
      run(r.first_instruction, r.instruction_count, c_.instructions.count);
    }
  }
  void statements() {
    for (std::uint32_t i = 0; i < c_.links.count; ++i)
      in(row<std::uint32_t>(c_.links, i), c_.expressions.count);
    for (std::uint32_t i = 0; i < c_.expressions.count; ++i) {
      const auto& e = row<rmp_code_expression>(c_.expressions, i);
      in(e.op, RMP_EXPR_COMPOSE + 1);
      in(e.type, c_.types.count);
      in_or_none(e.constant, c_.constants.count);
      run(e.first, e.count, c_.links.count);
      // Operands come before what they are operands of, so that no expression holds itself.
      for (std::uint32_t k = 0; !wrong_ && k < e.count; ++k)
        in(row<std::uint32_t>(c_.links, e.first + k), i);
      if (e.op != RMP_EXPR_FIELD) in_or_none(e.symbol, c_.symbols.count);
    }
    for (std::uint32_t i = 0; i < c_.statements.count; ++i) {
      const auto& s = row<rmp_code_statement>(c_.statements, i);
      in(s.op, RMP_STMT_TEACH + 1);
      for (const std::uint32_t e : {s.a, s.b, s.c}) in_or_none(e, c_.expressions.count);
      in_or_none(s.symbol, c_.symbols.count);
      in_or_none(s.motion, c_.motions.count);
      if (s.count) run(s.first, s.count, c_.links.count);
      in(s.span.file, c_.files.count);
      // Each statement is in one place of one block, so that following them ends.
      for (const std::uint32_t next : {s.next, s.body}) {
        in_or_none(next, c_.statements.count);
        if (next == RMP_NONE || wrong_) continue;
        if (entered_.size() <= next) entered_.resize(c_.statements.count);
        wrong_ = entered_[next];
        entered_[next] = true;
      }
    }
    for (std::uint32_t i = 0; !wrong_ && i < c_.routines.count; ++i) {
      const std::uint32_t body = row<rmp_code_routine>(c_.routines, i).body;
      if (body == RMP_NONE) continue;
      if (entered_.size() <= body) entered_.resize(c_.statements.count);
      wrong_ = entered_[body];  // a circle that is entered from nowhere is not followed
      entered_[body] = true;
    }
    for (std::uint32_t i = 0; i < c_.motions.count; ++i) {
      const auto& m = row<rmp_code_motion>(c_.motions, i);
      in(m.interpolation, RMP_MOVE_PATH + 1);
      run(m.first_target, m.target_count, c_.links.count);
      run(m.first_attribute, m.attribute_count, c_.attributes.count);
      in_or_none(m.until, c_.expressions.count);
      in_or_none(m.action, c_.routines.count);
    }
    for (std::uint32_t i = 0; i < c_.attributes.count; ++i) {
      const auto& a = row<rmp_code_attribute>(c_.attributes, i);
      in(a.attribute, RMP_ATTR_FRAME + 1);
      in(a.value, c_.expressions.count);
    }
  }
  void operand(const rmp_code_operand& o, std::uint32_t op) {
    if (o.index < 0) {
      wrong_ = true;
      return;
    }
    const auto i = static_cast<std::uint64_t>(o.index);
    in(o.type, c_.types.count);
    switch (o.kind) {
      case RMP_OPERAND_CONSTANT: in(i, c_.constants.count); break;
      case RMP_OPERAND_VARIABLE:
      case RMP_OPERAND_INTRINSIC: in(i, c_.symbols.count); break;
      case RMP_OPERAND_ROUTINE: in(i, c_.routines.count); break;
      case RMP_OPERAND_WORD:
        in(i, op == RMP_OP_MOVE ? RMP_MOVE_PATH + 1 : RMP_ATTR_FRAME + 1);
        break;
      default: in(o.kind, RMP_OPERAND_INTRINSIC + 1); break;
    }
  }
  const rmp_code& c_;
  bool wrong_ = false;
  std::vector<bool> entered_;
};

/// Answers to editors: places within the texts, edits in order that do not overlap.
class GuardedEdited final : public EditedProgram {
 public:
  GuardedEdited(std::string name, std::unique_ptr<EditedProgram> inner, const LanguageTask& task)
      : name_(std::move(name)), inner_(std::move(inner)) {
    for (const SourceFile& f : task.files) sizes_.push_back(f.text.size());
  }
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<std::vector<SourceFault>> faults(Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return inner_->faults(progress); }));
    for (const SourceFault& f : all)
      if (!is_within(f.range) || f.severity > RMP_FAULT_NOTE) return outside("a fault");
    return all;
  }
  Result<std::vector<SourceToken>> tokens(std::uint32_t file, Progress& told) const override {
    RMP_TRY(is_place(file, 0));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return inner_->tokens(file, progress); }));
    std::uint32_t last = 0;
    for (const SourceToken& t : all) {
      if (!is_kind(t.kind) || t.begin < last || t.end < t.begin || t.end > sizes_[file])
        return outside("a token");
      last = t.end;
    }
    return all;
  }
  Result<std::vector<SourceCompletion>> complete(std::uint32_t file, std::uint32_t at,
                                                 Progress& told) const override {
    RMP_TRY(is_place(file, at));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return inner_->complete(file, at, progress); }));
    for (const SourceCompletion& c : all)
      if (!is_kind(c.kind) || !is_within({file, c.begin, c.end}) || at < c.begin || at > c.end)
        return outside("a completion");
    return all;
  }
  Result<SourceHover> hover(std::uint32_t file, std::uint32_t at, Progress& told) const override {
    RMP_TRY(is_place(file, at));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto one, asked(name_, [&] { return inner_->hover(file, at, progress); }));
    if (!one.detail.empty() && !is_within(one.range)) return outside("a word");
    return one;
  }
  Result<std::vector<SourceRange>> definition(std::uint32_t file, std::uint32_t at,
                                              Progress& told) const override {
    RMP_TRY(is_place(file, at));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return inner_->definition(file, at, progress); }));
    for (const SourceRange& r : all)
      if (!is_within(r)) return outside("a definition");
    return all;
  }
  Result<std::vector<SourceReference>> references(std::uint32_t file, std::uint32_t at,
                                                  Progress& told) const override {
    RMP_TRY(is_place(file, at));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return inner_->references(file, at, progress); }));
    for (const SourceReference& r : all)
      if (!is_within(r.range)) return outside("a reference");
    return all;
  }
  Result<std::vector<SourceEdit>> rename(std::uint32_t file, std::uint32_t at,
                                         std::string_view new_name, Progress& told) const override {
    RMP_TRY(is_place(file, at));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all,
                   asked(name_, [&] { return inner_->rename(file, at, new_name, progress); }));
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!is_within(all[i].range)) return outside("an edit");
      if (i == 0) continue;
      const SourceRange &a = all[i - 1].range, &b = all[i].range;
      if (b.file < a.file || (b.file == a.file && b.begin < a.end))
        return broken_answer(name_, "returned edits that overlap or are not in order");
    }
    return all;
  }
  Result<std::string> format(std::uint32_t file, const SourceLayout& layout,
                             Progress& told) const override {
    RMP_TRY(is_place(file, 0));
    HeardProgress progress(told);
    return asked(name_, [&] { return inner_->format(file, layout, progress); });
  }
  Result<std::vector<SourceSymbol>> outline(std::uint32_t file, Progress& told) const override {
    RMP_TRY(is_place(file, 0));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return inner_->outline(file, progress); }));
    for (std::size_t i = 0; i < all.size(); ++i) {
      const SourceSymbol& s = all[i];
      if (!is_kind(s.kind) || !is_within({file, s.begin, s.end}) || s.name_begin < s.begin ||
          s.name_end < s.name_begin || s.name_end > s.end)
        return outside("a symbol");
      // Behind what it is within, so that following parents ends.
      if (s.parent != RMP_NONE && s.parent >= i) return outside("a symbol's parent");
    }
    return all;
  }
  Result<SourceSignature> signature(std::uint32_t file, std::uint32_t at,
                                    Progress& told) const override {
    RMP_TRY(is_place(file, at));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto one, asked(name_, [&] { return inner_->signature(file, at, progress); }));
    bool is_sound = one.parameters.size() % 2 == 0;
    std::uint32_t last = 0;
    for (const std::uint32_t p : one.parameters) {
      is_sound = is_sound && p >= last && p <= one.label.size();
      last = p;
    }
    if (!is_sound) return outside("a parameter");
    return one;
  }
  Result<std::vector<SourceRange>> folds(std::uint32_t file, Progress& told) const override {
    RMP_TRY(is_place(file, 0));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto all, asked(name_, [&] { return inner_->folds(file, progress); }));
    for (const SourceRange& r : all)
      if (r.file != file || !is_within(r)) return outside("a fold");
    return all;
  }

 private:
  static bool is_kind(SourceTokenKind k) {
    return static_cast<std::uint32_t>(k) < kSourceTokenKinds;
  }
  [[nodiscard]] bool is_within(const SourceRange& r) const {
    return r.file < sizes_.size() && r.begin <= r.end && r.end <= sizes_[r.file];
  }
  [[nodiscard]] Error outside(const char* what) const {
    return broken_answer(name_, std::string("gave ") + what + " that lies outside of its text");
  }
  [[nodiscard]] Result<void> is_place(std::uint32_t file, std::uint32_t at) const {
    if (file < sizes_.size() && at <= sizes_[file]) return {};
    return error(ErrorCode::invalid_argument, "the program has no byte " + std::to_string(at) +
                                                  " in file " + std::to_string(file));
  }
  std::string name_;
  std::unique_ptr<EditedProgram> inner_;
  std::vector<std::size_t> sizes_;  ///< of the texts
};

class GuardedLanguage final : public Language, public LanguageEditing {
 public:
  GuardedLanguage(const ProviderInfo& info, Language* inner)
      : name_(info.name), inner_(inner), extensions_(inner->extensions()) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    const void* known = inner_->extension(id);
    return known && std::string_view(id) == LanguageEditing::kExtensionId
               ? static_cast<const LanguageEditing*>(this)
               : known;
  }
  Result<std::unique_ptr<EditedProgram>> open(const LanguageTask& task) const override {
    const auto* known =
        static_cast<const LanguageEditing*>(inner_->extension(LanguageEditing::kExtensionId));
    RMP_TRY_ASSIGN(auto made, asked(name_, [&] { return known->open(task); }));
    if (!made) return broken_answer(name_, "opened no program");
    return std::unique_ptr<EditedProgram>(
        std::make_unique<GuardedEdited>(name_, std::move(made), task));
  }
  [[nodiscard]] std::string_view extensions() const override { return extensions_; }
  Result<std::vector<std::string>> needs(const SourceFile& file) const override {
    return asked(name_, [&] { return inner_->needs(file); });
  }
  Result<std::unique_ptr<CompiledProgram>> compile(const LanguageTask& task, const Params& params,
                                                   Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto made,
                   asked(name_, [&] { return inner_->compile(task, params, progress); }));
    if (!made) return broken_answer(name_, "made no program");
    const std::string fault = Tables(made->code()).fault();
    if (!fault.empty()) return broken_answer(name_, fault);
    return made;
  }

 private:
  std::string name_;
  std::unique_ptr<Language> inner_;
  std::string extensions_;
};

}  // namespace

RMP_INTERFACES(languages, guarded_interface<Language, GuardedLanguage>("irl"));

}  // namespace robomosp
