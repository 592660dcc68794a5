// SPDX-License-Identifier: Apache-2.0
// Guard of languages: what a compiler hands over is looked at before anybody follows its numbers.
#include <memory>
#include <string>

#include <robomosp/sdk/language.h>
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
        return "made tables whose rows are too short";
    if (!c_.name) return "made a program without a name";
    for (std::uint32_t i = 0; i < c_.files.count; ++i) name(row<rmp_code_file>(c_.files, i).name);
    for (std::uint32_t i = 0; i < c_.faults.count; ++i) {
      const auto& f = row<rmp_code_fault>(c_.faults, i);
      name(f.message);
      name(f.hint);
      in(f.severity, RMP_FAULT_NOTE + 1);
      in(f.span.file, c_.files.count);
    }
    if (wrong_) return "made tables whose numbers lead nowhere";
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
    return wrong_ ? "made tables whose numbers lead nowhere" : "";
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

class GuardedLanguage final : public Language {
 public:
  GuardedLanguage(const ProviderInfo& info, Language* inner)
      : name_(info.name), inner_(inner), extensions_(inner->extensions()) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
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
