// SPDX-License-Identifier: Apache-2.0
// Three-address code to typed operations on slots. Whatever would let an operation leave its
// values is refused here, so that nothing is asked of types when a program runs.
#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "program/state.h"

namespace robomosp::program {
namespace {

struct FnRow {
  std::string_view name;
  Fn fn;
  std::string_view parameters, result;  ///< letters as in the language's own table
};
constexpr FnRow kFns[] = {
    {"SIZEOF", Fn::size_of, "a", "i"},
    {"CROSS", Fn::cross, "pp", "p"},
    {"DOT", Fn::dot, "pp", "r"},
    {"ORIXYZ", Fn::ori_xyz, "rrr", "o"},
    {"ORIYXZ", Fn::ori_yxz, "rrr", "o"},
    {"ORIZYX", Fn::ori_zyx, "rrr", "o"},
    {"ORIZYZ2", Fn::ori_zyz2, "rrr", "o"},
    {"ORIRS", Fn::ori_rs, "rrr", "o"},
    {"ORIVANG", Fn::ori_vang, "pr", "o"},
    {"ORIQUAT", Fn::ori_quat, "rrrr", "o"},
    {"ORIMAT", Fn::ori_mat, "ppp", "o"},
    {"ORIMULT", Fn::ori_mult, "oo", "o"},
    {"ANGLEX", Fn::angle_x, "so", "r"},
    {"ANGLEY", Fn::angle_y, "so", "r"},
    {"ANGLEZ", Fn::angle_z, "so", "r"},
    {"ANGLEZ2", Fn::angle_z2, "so", "r"},
    {"QUATA", Fn::quat_a, "o", "r"},
    {"QUATB", Fn::quat_b, "o", "r"},
    {"QUATC", Fn::quat_c, "o", "r"},
    {"QUATD", Fn::quat_d, "o", "r"},
    {"ROTANGLE", Fn::rot_angle, "o", "r"},
    {"ROTAXIS", Fn::rot_axis, "o", "p"},
    {"VECTORN", Fn::vector_n, "o", "p"},
    {"VECTORO", Fn::vector_o, "o", "p"},
    {"VECTORA", Fn::vector_a, "o", "p"},
    {"INV", Fn::inv, "P", "P"},
    {"TRAFO", Fn::trafo, "J", "T"},
    {"TRAFOINV", Fn::trafo_inv, "T", "J"},
    {"COMPARE", Fn::compare, "ss", "i"},
    {"CONCAT", Fn::concat, "ss", "s"},
    {"LENGTH", Fn::length, "s", "i"},
    {"LOCATE", Fn::locate, "ss", "i"},
    {"EXTRACT", Fn::extract, "sii", "s"},
    {"DELETE", Fn::delete_, "Bii", ""},
    {"LIST_ADD", Fn::list_add, "Le", ""},
    {"LIST_INSERT", Fn::list_insert, "Lie", ""},
    {"LIST_DELETE", Fn::list_delete, "Li", ""},
    {"LIST_CLEAR", Fn::list_clear, "L", ""},
    {"LIST_INDEX", Fn::list_index, "le", "i"},
    {"OPEN", Fn::open, "Fss", ""},
    {"CLOSE", Fn::close, "F", ""},
    {"EOF", Fn::eof, "F", "b"},
    {"EOL", Fn::eol, "F", "b"},
    {"WRITE", Fn::write, "w", ""},
    {"WRITELN", Fn::writeln, "w", ""},
    {"READ", Fn::read, "m", ""},
    {"READLN", Fn::readln, "m", ""},
    {"ACQUIRE", Fn::acquire, "S", ""},
    {"RELEASE", Fn::release, "S", ""},
    {"GETSTATUS", Fn::get_status, "x", "i"},
    {"FOR_STEP", Fn::for_step, "i", "i"},
    {"R_JOINT_ACT", Fn::robot_joints, "", "J"},
    {"R_ROBTARGET_ACT", Fn::robot_target, "", "T"},
    {"R_FLANGE_ACT", Fn::robot_flange, "", "P"},
    {"R_SPEED_ACT", Fn::robot_speed, "", "r"},
    {"R_ACT_ROB", Fn::act_robot, "", "R"},
    {"BRAKE", Fn::brake, "q", ""},
};
struct NumberRow {
  std::string_view name, parameters, result;
};
constexpr NumberRow kNumbers[] = {
    {"SIN", "r", "r"},   {"COS", "r", "r"},   {"TAN", "r", "r"},    {"ASIN", "r", "r"},
    {"ACOS", "r", "r"},  {"ATAN", "r", "r"},  {"ATAN2", "rr", "r"}, {"SQRT", "r", "r"},
    {"EXP", "r", "r"},   {"LN", "r", "r"},    {"ABS", "n", "n"},    {"TRUNC", "r", "i"},
    {"ROUND", "r", "i"}, {"FLOAT", "i", "r"}, {"CHR", "i", "c"},    {"ORD", "c", "i"}};

constexpr std::uint64_t kMostOps = 200'000'000;

bool is_int(std::uint32_t kind) {
  return kind == RMP_TYPE_INT || kind == RMP_TYPE_CHAR || kind == RMP_TYPE_BOOL;
}

class Decoder {
 public:
  Decoder(std::shared_ptr<const CompiledProgram> program, const Limits& limits)
      : made_(std::make_shared<Machine::Code>()), c_(*made_), t_(program->code()) {
    c_.program = std::move(program);
    c_.limits = limits;
  }

  Result<std::shared_ptr<const Machine::Code>> run() {
    if (t_.has_errors) {
      for (std::uint32_t i = 0; i < t_.faults.count; ++i) {
        const auto& f = row<rmp_code_fault>(t_.faults, i);
        if (f.severity != RMP_FAULT_ERROR) continue;
        const std::string file =
            f.span.file < t_.files.count ? row<rmp_code_file>(t_.files, f.span.file).name : "";
        return error(
            ErrorCode::invalid_argument,
            "the program has errors, and the first is \"" + std::string(f.message) + "\"",
            "Correct it, and run it again.",
            file + ":" + std::to_string(f.span.line) + ":" + std::to_string(f.span.column));
      }
      return error(ErrorCode::invalid_argument, "the program has errors", "Correct them.");
    }
    if (t_.routines.count == 0)
      return error(ErrorCode::invalid_argument, "the program has no routine",
                   "Routine 0 is the program.");
    RMP_TRY(types());
    RMP_TRY(constants());
    RMP_TRY(layout());
    for (std::uint32_t r = 0; r < t_.routines.count; ++r) RMP_TRY(routine(r));
    statements();
    return std::shared_ptr<const Machine::Code>(made_);
  }

 private:
  [[nodiscard]] Error bad(const std::string& message) const {
    std::string where = "three-address code";
    if (now_) {
      where = "instruction " + std::to_string(index_) + " of routine " + std::to_string(routine_);
      if (now_->span.line) where += " (line " + std::to_string(now_->span.line) + ")";
    }
    return error(ErrorCode::invalid_argument, message,
                 "Compile the program again: no compiler writes such code.", where);
  }

  // ---- tables ----
  Result<void> types() {
    std::map<std::vector<std::uint64_t>, std::uint32_t> shapes;
    const std::uint64_t most = c_.limits.most_bytes / 8;
    for (std::uint32_t i = 0; i < t_.types.count; ++i) {
      const auto& t = row<rmp_code_type>(t_.types, i);
      TypeInfo x;
      x.kind = t.kind;
      std::uint64_t slots = t.kind == RMP_TYPE_VOID ? 0 : 1;
      std::vector<std::uint64_t> key{t.kind};
      if (t.kind == RMP_TYPE_ARRAY || t.kind == RMP_TYPE_LIST) {
        if (t.element >= i) return bad("a type refers to a later type");
        const TypeInfo& e = c_.types[t.element];
        x.element = t.element;
        x.element_slots = e.slots;
        key.push_back(e.shape);
        if (t.kind == RMP_TYPE_ARRAY) {
          const std::int64_t length = std::int64_t{t.upper} - t.lower + 1;
          if (length < 1 || length > std::int64_t{1} << 31) return bad("an array has no elements");
          x.lower = t.lower;
          x.length = static_cast<std::uint32_t>(length);
          slots = static_cast<std::uint64_t>(length) * e.slots;
          x.has_list = e.has_list;
          key.push_back(static_cast<std::uint64_t>(length));
        } else {
          x.has_list = true;
        }
      } else if (t.kind == RMP_TYPE_RECORD) {
        slots = 0;
        if (std::uint64_t{t.first_field} + t.field_count > t_.fields.count)
          return bad("a record refers to missing fields");
        for (std::uint32_t k = 0; k < t.field_count; ++k) {
          const std::uint32_t f = c_.field(t.first_field + k).type;
          if (f >= i) return bad("a record refers to a later type");
          slots += c_.types[f].slots;
          x.has_list = x.has_list || c_.types[f].has_list;
          key.push_back(c_.types[f].shape);
        }
        if (!role_fits(t)) return bad("a record does not have the fields of its role");
      } else if (t.kind > RMP_TYPE_LIST) {
        return bad("a type has an unknown kind");
      }
      // A type that nothing uses may be greater than the machine's memory; a value may not.
      x.slots = static_cast<std::uint32_t>(std::min<std::uint64_t>(slots, 0xffff'ffffu));
      if (slots > most || slots > 0x7fff'ffffu) x.slots = 0x7fff'ffffu;
      x.shape = shapes.try_emplace(key, static_cast<std::uint32_t>(shapes.size())).first->second;
      c_.types.push_back(x);
    }
    if (c_.types.size() <= RMP_TYPE_PROCESS) return bad("the types of the language are missing");
    return {};
  }
  [[nodiscard]] bool role_fits(const rmp_code_type& t) const {
    const auto field = [&](std::uint32_t k) -> const rmp_code_type& {
      return c_.type(c_.field(t.first_field + k).type);
    };
    const auto reals = [&](std::uint32_t n) {
      if (n && t.field_count != n) return false;
      for (std::uint32_t k = 0; k < t.field_count; ++k)
        if (field(k).kind != RMP_TYPE_REAL) return false;
      return true;
    };
    switch (t.role) {
      case RMP_ROLE_POSITION: return reals(3);
      case RMP_ROLE_ORIENTATION: return reals(4);
      case RMP_ROLE_POSE:
        return t.field_count == 2 && field(0).role == RMP_ROLE_POSITION &&
               field(1).role == RMP_ROLE_ORIENTATION;
      case RMP_ROLE_MAIN_JOINT:
      case RMP_ROLE_ADD_JOINT:
        for (std::uint32_t k = 0; k < t.field_count; ++k)
          if (field(k).kind != RMP_TYPE_REAL && field(k).kind != RMP_TYPE_INT) return false;
        return true;
      case RMP_ROLE_JOINT:
        return t.field_count == 2 && field(0).role == RMP_ROLE_MAIN_JOINT &&
               field(1).role == RMP_ROLE_ADD_JOINT;
      case RMP_ROLE_ROBTARGET:
        return t.field_count == 4 && field(0).role == RMP_ROLE_POSE &&
               field(1).kind == RMP_TYPE_INT && field(2).kind == RMP_TYPE_ARRAY &&
               c_.type(field(2).element).kind == RMP_TYPE_INT &&
               field(3).role == RMP_ROLE_ADD_JOINT;
      default: return true;
    }
  }
  Result<void> constants() {
    for (std::uint32_t i = 0; i < t_.constants.count; ++i) {
      const auto& k = row<rmp_code_constant>(t_.constants, i);
      c_.constant_slot.push_back(static_cast<std::uint32_t>(c_.constants.size()));
      if (k.kind == RMP_CONSTANT_TEXT) {
        c_.constants.push_back({kTextTag | kConstantText | c_.constant_texts.size()});
        c_.constant_texts.emplace_back(k.text, k.text_size);
      } else if (k.kind == RMP_CONSTANT_REAL) {
        c_.constants.push_back(Slot::of_real(k.real));
      } else {
        c_.constants.push_back(Slot::of(static_cast<std::int32_t>(k.integer)));
      }
    }
    first_number_ = static_cast<std::uint32_t>(c_.constants.size());
    for (std::uint32_t r = 0; r < t_.routines.count; ++r) c_.constants.push_back(Slot::of(r));
    return {};
  }
  [[nodiscard]] static bool kinds_fit(const rmp_code_constant& k) {
    switch (k.type) {
      case RMP_TYPE_INT:
      case RMP_TYPE_CHAR:
      case RMP_TYPE_BOOL:
      case RMP_TYPE_SEMAPHORE: return k.kind == RMP_CONSTANT_INT;
      case RMP_TYPE_REAL: return k.kind == RMP_CONSTANT_REAL;
      case RMP_TYPE_STRING: return k.kind == RMP_CONSTANT_TEXT;
      default: return false;
    }
  }

  Result<void> layout() {
    c_.routines.resize(t_.routines.count);
    c_.place_of.assign(t_.symbols.count, Place{kFrame, false, kNone, 0});
    c_.taught_offset.assign(t_.symbols.count, kNone);
    std::vector<std::uint64_t> size(t_.routines.count, 0);
    const std::uint64_t most = std::min<std::uint64_t>(c_.limits.most_bytes / 8, 0x3fff'ffff);
    for (std::uint32_t r = 0; r < t_.routines.count; ++r) {
      const auto& x = c_.routine(r);
      if (x.symbol >= t_.symbols.count || x.result >= t_.types.count)
        return bad("a routine has no name or no type");
      if (std::uint64_t{x.first_instruction} + x.instruction_count > t_.instructions.count)
        return bad("a routine refers to missing instructions");
      c_.routines[r].result_slots = c_.types[x.result].slots;
      if (x.kind == RMP_ROUTINE_DATA_LIST) c_.data_lists.push_back(r);
      for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
        const std::uint64_t s = std::uint64_t{x.first_parameter} + k;
        if (s >= t_.symbols.count) return bad("a routine refers to missing parameters");
        const auto& p = c_.symbol(static_cast<std::uint32_t>(s));
        if (c_.place_of[s].offset != kNone) return bad("two routines share a parameter");
        if (p.type == RMP_TYPE_VOID) return bad("a parameter has no type");
        const bool is_place = p.mode != RMP_MODE_IN;
        c_.place_of[s] = {kFrame, is_place, static_cast<std::uint32_t>(size[r]), p.type};
        size[r] += is_place ? 2 : c_.types[p.type].slots;
        if (size[r] > most) return too_big();
        owner_.resize(t_.symbols.count, kNone);
        owner_[s] = r;
      }
      c_.routines[r].parameters = static_cast<std::uint32_t>(size[r]);
    }
    owner_.resize(t_.symbols.count, kNone);
    std::uint64_t globals = 0;
    for (std::uint32_t i = 0; i < t_.symbols.count; ++i) {
      const auto& s = c_.symbol(i);
      if (s.kind == RMP_SYMBOL_CONSTANT && s.constant != kNone && s.constant < t_.constants.count) {
        c_.place_of[i] = {kConstant, false, c_.constant_slot[s.constant], s.type};
        // Code that was read from its text names it as a variable.
      }
      const bool has_place = s.kind == RMP_SYMBOL_VARIABLE || s.kind == RMP_SYMBOL_ROBOT ||
                             (s.kind == RMP_SYMBOL_CONSTANT && c_.place_of[i].offset == kNone);
      if (!has_place || s.type == RMP_TYPE_VOID || s.type >= t_.types.count) continue;
      if (s.routine != kNone && s.routine < t_.routines.count) {
        c_.place_of[i] = {kFrame, false, static_cast<std::uint32_t>(size[s.routine]), s.type};
        owner_[i] = s.routine;
        size[s.routine] += c_.types[s.type].slots;
        if (size[s.routine] > most) return too_big();
      } else {
        c_.place_of[i] = {kGlobal, false, static_cast<std::uint32_t>(globals), s.type};
        globals += c_.types[s.type].slots;
        if (globals > most) return too_big();
      }
    }
    for (std::uint32_t r = 0; r < t_.routines.count; ++r)
      c_.routines[r].zeroed = static_cast<std::uint32_t>(size[r]);
    // Values that lists of data give are on places of their own.
    for (const std::uint32_t r : c_.data_lists) {
      const auto& x = c_.routine(r);
      for (std::uint32_t k = 0; k < x.instruction_count; ++k) {
        const auto& i = row<rmp_code_instruction>(t_.instructions, x.first_instruction + k);
        if (i.r.kind != RMP_OPERAND_VARIABLE || i.r.index < 0 || i.r.index >= t_.symbols.count)
          continue;
        const auto s = static_cast<std::uint32_t>(i.r.index);
        if (c_.place_of[s].space != kGlobal || c_.place_of[s].offset == kNone ||
            c_.taught_offset[s] != kNone)
          continue;
        c_.taught_offset[s] = static_cast<std::uint32_t>(globals);
        globals += c_.types[c_.symbol(s).type].slots;
        if (globals > most) return too_big();
      }
    }
    c_.globals = static_cast<std::uint32_t>(globals);
    const std::pair<std::string_view, std::uint32_t*> system[] = {
        {"R_SPEED", &c_.r_speed},
        {"R_SPEED_ORI", &c_.r_speed_ori},
        {"R_ACC", &c_.r_acc},
        {"R_MOVE_TIME", &c_.r_move_time},
        {"R_C_CP", &c_.r_c_cp},
        {"R_C_SPEED", &c_.r_c_speed},
        {"R_WOBBLE_AMPLITUDE", &c_.r_wobble_amplitude},
        {"R_WOBBLE_LENGTH", &c_.r_wobble_length},
        {"R_SPEED_PTP", &c_.r_speed_ptp},
        {"R_ACC_PTP", &c_.r_acc_ptp},
        {"R_C_PTP", &c_.r_c_ptp},
        {"R_TIMEOUT", &c_.r_timeout}};
    for (std::uint32_t i = 0; i < t_.symbols.count; ++i) {
      const auto& s = c_.symbol(i);
      if (s.kind != RMP_SYMBOL_VARIABLE || c_.place_of[i].space != kGlobal) continue;
      if (s.scope != kNone &&
          (s.scope >= t_.scopes.count ||
           row<rmp_code_scope>(t_.scopes, s.scope).kind != RMP_SCOPE_PREDEFINED))
        continue;
      for (const auto& [name, to] : system)
        if (*to == kNone && name == s.name &&
            s.type == (to == &c_.r_timeout ? RMP_TYPE_BOOL : RMP_TYPE_REAL)) {
          *to = c_.place_of[i].offset;
          if (to == &c_.r_timeout) timeout_symbol_ = i;
        }
    }
    return {};
  }
  [[nodiscard]] Error too_big() const {
    return error(ErrorCode::invalid_argument,
                 "the variables of this program need more than the " +
                     std::to_string(c_.limits.most_bytes) + " bytes allowed",
                 "Make its arrays smaller, or give it more memory.");
  }

  // ---- operands ----
  [[nodiscard]] const TypeInfo& type(std::uint32_t t) const { return c_.types[t]; }
  [[nodiscard]] bool same(std::uint32_t a, std::uint32_t b) const {
    return type(a).shape == type(b).shape;
  }
  void emit(Do code, const Place& a, const Place& b, const Place& r, std::uint32_t n = 0) {
    c_.ops.push_back({code, a.space, b.space, r.space, a.offset, b.offset, r.offset, n});
    c_.instruction_of.push_back(index_);
    c_.routine_of_op.push_back(routine_);
  }
  Result<Place> scratch(std::uint32_t t, std::uint32_t slots = 0) {
    const std::uint64_t n = slots ? slots : type(t).slots;
    const Place p{kFrame, false, static_cast<std::uint32_t>(scratch_), t};
    scratch_ += n;
    most_ = std::max(most_, scratch_);
    if (scratch_ > std::min<std::uint64_t>(c_.limits.most_bytes / 8, 0x3fff'ffff)) return too_big();
    return p;
  }
  /// The place of a variable, and whether it may be used here.
  Result<Place> variable(std::uint32_t s) {
    Place p = c_.place_of[s];
    if (p.offset == kNone) return bad("v" + std::to_string(s) + " is no variable");
    if (p.space == kFrame && owner_[s] != routine_)
      return bad("v" + std::to_string(s) + " belongs to another routine");
    if (is_data_list_ && c_.taught_offset[s] != kNone) p.offset = c_.taught_offset[s];
    if (type(p.type).slots >= 0x7fff'ffffu) return too_big();
    return p;
  }
  /// Where an operand stands, as it is: a place may be a reference.
  Result<Place> place(const rmp_code_operand& o) {
    switch (o.kind) {
      case RMP_OPERAND_CONSTANT: {
        if (o.index < 0 || o.index >= t_.constants.count) return bad("there is no such constant");
        const auto k = static_cast<std::uint32_t>(o.index);
        const auto& x = row<rmp_code_constant>(t_.constants, k);
        if (!kinds_fit(x)) return bad("a constant does not have the kind of its type");
        return Place{kConstant, false, c_.constant_slot[k], x.type};
      }
      case RMP_OPERAND_VARIABLE:
        if (o.index < 0 || o.index >= t_.symbols.count) return bad("there is no such variable");
        return variable(static_cast<std::uint32_t>(o.index));
      case RMP_OPERAND_TEMPORARY:
      case RMP_OPERAND_REFERENCE: {
        if (o.type >= t_.types.count || o.type == RMP_TYPE_VOID)
          return bad("a temporary has no type");
        const auto found = temporaries_.find(o.index);
        if (found == temporaries_.end()) return bad("there is no such temporary");
        return Place{kFrame, o.kind == RMP_OPERAND_REFERENCE, found->second.first, o.type};
      }
      case RMP_OPERAND_ROUTINE:
        if (o.index < 0 || o.index >= t_.routines.count) return bad("there is no such routine");
        return Place{kConstant, false, first_number_ + static_cast<std::uint32_t>(o.index),
                     RMP_TYPE_PROCESS};
      default: return bad("a value is not allowed here");
    }
  }
  [[nodiscard]] std::uint32_t signal_of(const rmp_code_operand& o) const {
    if (o.kind != RMP_OPERAND_VARIABLE || o.index < 0 || o.index >= t_.symbols.count) return kNone;
    const auto s = static_cast<std::uint32_t>(o.index);
    const std::uint32_t kind = c_.symbol(s).kind;
    return kind == RMP_SYMBOL_INPUT || kind == RMP_SYMBOL_OUTPUT ? s : kNone;
  }
  Result<void> signal_fits(std::uint32_t s) const {
    const std::uint32_t t = c_.symbol(s).type;
    if (t != RMP_TYPE_BOOL && t != RMP_TYPE_INT && t != RMP_TYPE_REAL)
      return bad("a signal must be BOOL, INT or REAL");
    return {};
  }
  void notes_signal(std::uint32_t s) {
    for (ConditionInfo* i : {in_wait_, in_until_})
      if (i && std::find(i->signals.begin(), i->signals.end(), s) == i->signals.end())
        i->signals.push_back(s);
  }
  void notes_cycle() {
    for (ConditionInfo* i : {in_wait_, in_until_})
      if (i) i->each_cycle = true;
  }
  /// What a robot does now, before somebody looks at it. `field` = kNone: all of it.
  Result<void> refresh(std::uint32_t s, std::uint32_t only) {
    const auto& x = c_.symbol(s);
    if (x.kind != RMP_SYMBOL_ROBOT && x.kind != RMP_SYMBOL_VARIABLE) return {};
    std::vector<LiveField> live = live_fields(s, only);
    if (live.empty()) return {};
    notes_cycle();
    c_.live.push_back(std::move(live));
    c_.live_symbol.push_back(x.kind == RMP_SYMBOL_ROBOT ? s : kNone);
    emit(Do::refresh, {}, {}, {}, static_cast<std::uint32_t>(c_.live.size() - 1));
    return {};
  }
  std::vector<LiveField> live_fields(std::uint32_t s, std::uint32_t only) const {
    const auto& x = c_.symbol(s);
    std::vector<LiveField> live;
    const Place at = c_.place_of[s];
    if (at.offset == kNone || at.space != kGlobal) return live;
    const auto add = [&](std::string_view name, std::uint32_t t, std::uint32_t offset) {
      const std::uint32_t role = c_.type(t).role;
      if (name == "R_JOINT_ACT" && role == RMP_ROLE_JOINT) live.push_back({0, offset, t});
      else if (name == "R_ROBTARGET_ACT" && role == RMP_ROLE_ROBTARGET)
        live.push_back({1, offset, t});
      else if (name == "R_SPEED_ACT" && t == RMP_TYPE_REAL) live.push_back({2, offset, t});
    };
    if (x.kind == RMP_SYMBOL_ROBOT && type(x.type).kind == RMP_TYPE_RECORD) {
      const auto& t = c_.type(x.type);
      std::uint32_t offset = at.offset;
      for (std::uint32_t k = 0; k < t.field_count; ++k) {
        const auto& f = c_.field(t.first_field + k);
        if (only == kNone || only == k) add(upper(f.name), f.type, offset);
        offset += type(f.type).slots;
      }
    } else if (x.kind == RMP_SYMBOL_VARIABLE) {
      const bool is_system =
          x.scope == kNone || (x.scope < t_.scopes.count &&
                               row<rmp_code_scope>(t_.scopes, x.scope).kind <= RMP_SCOPE_SYSTEM);
      if (is_system) add(upper(x.name), x.type, at.offset);
    }
    return live;
  }
  /// Whether the argument now is of what wants a robot by its name, and not what it does.
  [[nodiscard]] bool is_robot_by_name(const rmp_code_operand& o) const {
    if (o.kind != RMP_OPERAND_VARIABLE || o.index < 0 || o.index >= t_.symbols.count ||
        c_.symbol(static_cast<std::uint32_t>(o.index)).kind != RMP_SYMBOL_ROBOT)
      return false;
    const auto& x = c_.routine(routine_);
    for (std::uint32_t k = index_ + 1; k < x.first_instruction + x.instruction_count; ++k) {
      const auto& i = row<rmp_code_instruction>(t_.instructions, k);
      if (i.op == RMP_OP_ARGUMENT || i.op == RMP_OP_ARGUMENT_PLACE) continue;
      if (i.op != RMP_OP_INTRINSIC || i.a.index < 0 || i.a.index >= t_.symbols.count) return false;
      const std::string_view name = c_.symbol(static_cast<std::uint32_t>(i.a.index)).name;
      return name == "BRAKE" || name == "R_ACT_ROB";
    }
    return false;
  }
  static std::string upper(std::string_view s) {
    std::string out(s);
    for (char& c : out)
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
    return out;
  }
  /// A value to be read, behind what has to be asked for it.
  Result<Place> in(const rmp_code_operand& o) {
    if (const std::uint32_t s = signal_of(o); s != kNone) {
      RMP_TRY(signal_fits(s));
      RMP_TRY_ASSIGN(Place p, scratch(c_.symbol(s).type));
      notes_signal(s);
      emit(Do::read_signal, {}, {}, p, s);
      return p;
    }
    if (o.kind == RMP_OPERAND_VARIABLE && o.index >= 0 && o.index < t_.symbols.count) {
      const auto s = static_cast<std::uint32_t>(o.index);
      if (s == timeout_symbol_) emit(Do::timeout_known, {}, {}, {});
      RMP_TRY(refresh(s, kNone));
    }
    RMP_TRY_ASSIGN(Place p, place(o));
    if (!p.is_reference) return p;
    RMP_TRY_ASSIGN(Place copy, scratch(p.type));
    load(p, copy);
    return copy;
  }
  void load(const Place& from, const Place& to) {
    const TypeInfo& t = type(to.type);
    const Do code = to.type == RMP_TYPE_CHAR ? Do::load_char
                    : t.has_list             ? Do::load_deep
                    : t.slots == 1           ? Do::load1
                                             : Do::load_n;
    emit(code, from, {}, to, t.has_list ? to.type : t.slots);
  }
  void store(const Place& from, const Place& to) {
    const TypeInfo& t = type(from.type);
    const Do code = from.type == RMP_TYPE_CHAR ? Do::store_char
                    : t.has_list               ? Do::store_deep
                    : t.slots == 1             ? Do::store1
                                               : Do::store_n;
    emit(code, from, {}, to, t.has_list ? from.type : t.slots);
  }
  void copy(const Place& from, const Place& to, std::uint32_t of) {
    const TypeInfo& t = type(of);
    if (t.has_list) emit(Do::copy_deep, from, {}, to, of);
    else if (t.slots == 1) emit(Do::copy1, from, {}, to);
    else if (t.slots) emit(Do::copy_n, from, {}, to, t.slots);
  }
  /// Where a result goes; finish() brings it to where that is no plain variable.
  Result<Place> out(const rmp_code_operand& o) {
    pending_out_ = nullptr;
    if (const std::uint32_t s = signal_of(o); s != kNone) {
      RMP_TRY(signal_fits(s));
      if (c_.symbol(s).kind != RMP_SYMBOL_OUTPUT) return bad("an input is written");
      RMP_TRY_ASSIGN(out_, scratch(c_.symbol(s).type));
      pending_out_ = &o;
      return out_;
    }
    RMP_TRY_ASSIGN(Place p, place(o));
    if (p.space == kConstant) return bad("a constant is written");
    if (!p.is_reference) return p;
    if (o.kind == RMP_OPERAND_REFERENCE) return bad("a place is used where a value is expected");
    RMP_TRY_ASSIGN(out_, scratch(p.type));
    pending_out_ = &o;
    return out_;
  }
  Result<void> finish() {
    if (!pending_out_) return {};
    const rmp_code_operand& o = *pending_out_;
    pending_out_ = nullptr;
    if (const std::uint32_t s = signal_of(o); s != kNone) {
      emit(Do::write_signal, out_, {}, {}, s);
      return {};
    }
    RMP_TRY_ASSIGN(Place p, place(o));
    store(out_, p);
    return {};
  }

  // ---- routines ----
  Result<void> routine(std::uint32_t r) {
    const auto& x = c_.routine(r);
    RoutineInfo& info = c_.routines[r];
    routine_ = r;
    is_data_list_ = x.kind == RMP_ROUTINE_DATA_LIST;
    temporaries_.clear();
    labels_.clear();
    fixups_.clear();
    arguments_.clear();
    targets_.clear();
    attributes_.clear();
    until_ = {};
    has_until_ = is_until_ = false;
    in_wait_ = in_until_ = nullptr;
    moves_ = waits_ = 0;
    info.first = static_cast<std::uint32_t>(c_.ops.size());
    // Temporaries: as long as the longest value that each one has.
    std::uint64_t frame = info.zeroed;
    for (std::uint32_t k = 0; k < x.instruction_count; ++k) {
      const auto& i = row<rmp_code_instruction>(t_.instructions, x.first_instruction + k);
      for (const rmp_code_operand* o : {&i.a, &i.b, &i.r}) {
        if (o->kind != RMP_OPERAND_TEMPORARY && o->kind != RMP_OPERAND_REFERENCE) continue;
        if (o->type >= t_.types.count) continue;
        auto& [offset, slots] = temporaries_[o->index];
        slots = std::max(slots,
                         o->kind == RMP_OPERAND_REFERENCE ? 2 : std::max(1u, type(o->type).slots));
      }
    }
    for (auto& [index, t] : temporaries_) {
      t.first = static_cast<std::uint32_t>(frame);
      frame += t.second;
      if (frame > std::min<std::uint64_t>(c_.limits.most_bytes / 8, 0x3fff'ffff)) return too_big();
    }
    base_ = scratch_ = most_ = frame;
    ConditionInfo interrupt;
    if (x.kind == RMP_ROUTINE_INTERRUPT) in_until_ = &interrupt;
    bool has_test = false;
    for (std::uint32_t k = 0; k < x.instruction_count; ++k) {
      index_ = x.first_instruction + k;
      now_ = &row<rmp_code_instruction>(t_.instructions, index_);
      if (arguments_.empty() && targets_.empty() && attributes_.empty()) scratch_ = base_;
      RMP_TRY(one(*now_));
      if (now_->op == RMP_OP_INTERRUPT_TEST) {
        if (x.kind != RMP_ROUTINE_INTERRUPT || has_test)
          return bad("INTERRUPT_TEST must be used once, in an interrupt");
        has_test = true;
        in_until_ = nullptr;
        info.condition = static_cast<std::uint32_t>(c_.conditions.size());
        c_.conditions.push_back(interrupt);
      }
      if (c_.ops.size() > kMostOps) return bad("the program is too long");
    }
    if (!arguments_.empty()) return bad("there are arguments without a call");
    if (in_wait_) return bad("WAIT_BEGIN has no WAIT_TEST");
    if (x.kind == RMP_ROUTINE_INTERRUPT ? !has_test || in_until_ != nullptr : in_until_ != nullptr)
      return bad("a condition has no end");
    if (x.instruction_count == 0) index_ = x.first_instruction;
    // Behind the last instruction.
    if (x.kind == RMP_ROUTINE_FUNCTION) emit(Do::end_without_value, {}, {}, {});
    else emit(Do::return_, {}, {}, {});
    if (x.instruction_count == 0) c_.instruction_of.back() = kNone;
    info.count = static_cast<std::uint32_t>(c_.ops.size()) - info.first;
    for (const auto& [op, label] : fixups_) {
      const auto found = labels_.find(label);
      if (found == labels_.end()) return bad("label L" + std::to_string(label) + " is nowhere");
      c_.ops[op].n = found->second;
    }
    info.frame = static_cast<std::uint32_t>(most_);
    now_ = nullptr;
    return {};
  }

  Result<void> jump(Do code, const Place& a, const rmp_code_operand& label) {
    if (label.kind != RMP_OPERAND_LABEL) return bad("a jump has no label");
    if (!arguments_.empty()) return bad("a jump is between a call and its arguments");
    fixups_.emplace_back(static_cast<std::uint32_t>(c_.ops.size()), label.index);
    emit(code, a, {}, {});
    return {};
  }
  Result<Place> value_of(const rmp_code_operand& o, std::uint32_t wanted, const char* what) {
    RMP_TRY_ASSIGN(Place p, in(o));
    if (!same(p.type, wanted)) return bad(std::string(what) + " has the wrong type");
    return p;
  }
  Result<std::uint32_t> number(const rmp_code_operand& o) {
    if (o.kind != RMP_OPERAND_NUMBER || o.index < 0 || o.index > 0x7fff'ffff)
      return bad("a number is missing");
    return static_cast<std::uint32_t>(o.index);
  }
  Result<std::uint32_t> routine_operand(const rmp_code_operand& o, std::uint32_t kind) {
    if (o.kind != RMP_OPERAND_ROUTINE || o.index < 0 || o.index >= t_.routines.count)
      return bad("a routine is missing");
    const auto r = static_cast<std::uint32_t>(o.index);
    if (c_.routine(r).kind != kind) return bad("a routine of the wrong kind is named");
    return r;
  }

  Result<void> one(const rmp_code_instruction& i) {
    const bool takes_arguments = i.op == RMP_OP_ARGUMENT || i.op == RMP_OP_ARGUMENT_PLACE ||
                                 i.op == RMP_OP_CALL || i.op == RMP_OP_INTRINSIC ||
                                 i.op == RMP_OP_MAKE;
    if (!arguments_.empty() && !takes_arguments)
      return bad("an instruction is between a call and its arguments");
    switch (i.op) {
      case RMP_OP_COPY: {
        RMP_TRY_ASSIGN(Place a, in(i.a));
        RMP_TRY_ASSIGN(Place r, out(i.r));
        if (!same(a.type, r.type)) return bad("a value is copied to a different type");
        copy(a, r, r.type);
        return finish();
      }
      case RMP_OP_CONVERT: return convert(i);
      case RMP_OP_NEGATE: {
        RMP_TRY_ASSIGN(Place a, in(i.a));
        RMP_TRY_ASSIGN(Place r, out(i.r));
        if (a.type != r.type || (a.type != RMP_TYPE_INT && a.type != RMP_TYPE_REAL))
          return bad("NEGATE needs a number");
        emit(a.type == RMP_TYPE_INT ? Do::negate_int : Do::negate_real, a, {}, r);
        return finish();
      }
      case RMP_OP_NOT: {
        RMP_TRY_ASSIGN(Place a, value_of(i.a, RMP_TYPE_BOOL, "NOT"));
        RMP_TRY_ASSIGN(Place r, out(i.r));
        if (r.type != RMP_TYPE_BOOL) return bad("NOT must return a BOOL");
        emit(Do::not_, a, {}, r);
        return finish();
      }
      case RMP_OP_FIELD: {
        if (signal_of(i.a) != kNone) return bad("a signal has no fields");
        RMP_TRY_ASSIGN(Place a, place(i.a));
        RMP_TRY_ASSIGN(const std::uint32_t k, number(i.b));
        const auto& t = c_.type(a.type);
        if (t.kind != RMP_TYPE_RECORD || k >= t.field_count) return bad("there is no such field");
        if (i.a.kind == RMP_OPERAND_VARIABLE)
          RMP_TRY(refresh(static_cast<std::uint32_t>(i.a.index), k));
        const std::uint32_t offset = field_offset(a.type, k);
        RMP_TRY_ASSIGN(Place r, reference(i.r));
        if (!same(r.type, c_.field(t.first_field + k).type))
          return bad("a field has a different type");
        if (a.is_reference) {
          emit(Do::field, a, {}, r, offset);
        } else {
          a.offset += offset;
          emit(Do::address, a, {}, r);
        }
        return {};
      }
      case RMP_OP_ELEMENT: {
        if (signal_of(i.a) != kNone) return bad("a signal has no elements");
        RMP_TRY_ASSIGN(Place a, place(i.a));
        RMP_TRY_ASSIGN(Place b, value_of(i.b, RMP_TYPE_INT, "an index"));
        RMP_TRY_ASSIGN(Place r, reference(i.r));
        const TypeInfo& t = type(a.type);
        if (t.kind != RMP_TYPE_ARRAY && t.kind != RMP_TYPE_LIST && t.kind != RMP_TYPE_STRING)
          return bad("this has no elements");
        if (!same(r.type, t.kind == RMP_TYPE_STRING ? std::uint32_t{RMP_TYPE_CHAR} : t.element))
          return bad("an element has a different type");
        emit(a.is_reference ? Do::element : Do::element_of, a, b, r, a.type);
        return {};
      }
      case RMP_OP_LOAD: {
        if (signal_of(i.a) != kNone) return bad("LOAD needs a place");
        RMP_TRY_ASSIGN(Place a, place(i.a));
        RMP_TRY_ASSIGN(Place r, out(i.r));
        if (!same(a.type, r.type)) return bad("a value is loaded as a different type");
        if (a.is_reference) load(a, r);
        else copy(a, r, r.type);
        return finish();
      }
      case RMP_OP_STORE: {
        RMP_TRY_ASSIGN(Place a, in(i.a));
        if (i.r.kind != RMP_OPERAND_REFERENCE) return bad("STORE needs a place");
        RMP_TRY_ASSIGN(Place r, place(i.r));
        if (!same(a.type, r.type)) return bad("a value is stored as a different type");
        store(a, r);
        return {};
      }
      case RMP_OP_ARGUMENT: {
        if (is_robot_by_name(i.a)) {
          RMP_TRY_ASSIGN(Place named, place(i.a));
          arguments_.push_back({named, false, kNone, static_cast<std::uint32_t>(i.a.index)});
          return {};
        }
        RMP_TRY_ASSIGN(Place a, in(i.a));
        arguments_.push_back({a, false, kNone});
        return {};
      }
      case RMP_OP_ARGUMENT_PLACE: {
        if (const std::uint32_t s = signal_of(i.a); s != kNone) {
          RMP_TRY_ASSIGN(Place a, in(i.a));
          if (c_.symbol(s).kind != RMP_SYMBOL_OUTPUT) return bad("an input is written");
          arguments_.push_back({a, true, s});
          return {};
        }
        RMP_TRY_ASSIGN(Place a, place(i.a));
        if (a.space == kConstant) return bad("a constant is written");
        arguments_.push_back({a, true, kNone});
        return {};
      }
      case RMP_OP_CALL: return call(i);
      case RMP_OP_INTRINSIC: return intrinsic(i);
      case RMP_OP_MAKE: return make(i);
      case RMP_OP_LABEL:
        if (i.r.kind != RMP_OPERAND_LABEL) return bad("LABEL has no label");
        if (!labels_.try_emplace(i.r.index, static_cast<std::uint32_t>(c_.ops.size())).second)
          return bad("a label is defined twice");
        return {};
      case RMP_OP_JUMP: return jump(Do::jump, {}, i.r);
      case RMP_OP_JUMP_IF:
      case RMP_OP_JUMP_UNLESS: {
        RMP_TRY_ASSIGN(Place a, value_of(i.a, RMP_TYPE_BOOL, "a condition"));
        return jump(i.op == RMP_OP_JUMP_IF ? Do::jump_if : Do::jump_unless, a, i.r);
      }
      case RMP_OP_RETURN: {
        const auto& x = c_.routine(routine_);
        if (i.a.kind == RMP_OPERAND_NONE) {
          emit(x.kind == RMP_ROUTINE_FUNCTION ? Do::end_without_value : Do::return_, {}, {}, {});
          return {};
        }
        if (x.result == RMP_TYPE_VOID)
          return bad("a routine that is not a function returns a value");
        RMP_TRY_ASSIGN(Place a, value_of(i.a, x.result, "RETURN"));
        emit(Do::return_, a, {}, {}, x.result);
        return {};
      }
      case RMP_OP_WAIT_TIME: {
        RMP_TRY_ASSIGN(Place a, value_of(i.a, RMP_TYPE_REAL, "WAIT"));
        emit(Do::wait_time, a, {}, {});
        return {};
      }
      case RMP_OP_WAIT_BEGIN: {
        if (in_wait_) return bad("a WAIT is in the condition of another WAIT");
        Place a{};
        const bool has_limit = i.a.kind != RMP_OPERAND_NONE;
        if (has_limit) {
          RMP_TRY_ASSIGN(a, value_of(i.a, RMP_TYPE_REAL, "TIMEOUT"));
        }
        WaitInfo w;
        w.begin = static_cast<std::uint32_t>(c_.ops.size());
        w.order = waits_++;
        c_.waits.push_back(w);
        emit(Do::wait_begin, a, {}, Place{kFrame, false, has_limit ? 1u : 0u, 0},
             static_cast<std::uint32_t>(c_.waits.size() - 1));
        wait_condition_ = {};
        in_wait_ = &wait_condition_;
        return {};
      }
      case RMP_OP_WAIT_TEST: {
        if (!in_wait_) return bad("WAIT_TEST has no WAIT_BEGIN");
        RMP_TRY_ASSIGN(Place a, value_of(i.a, RMP_TYPE_BOOL, "WAIT FOR"));
        in_wait_ = nullptr;
        WaitInfo& w = c_.waits.back();
        w.test = static_cast<std::uint32_t>(c_.ops.size());
        w.condition = static_cast<std::uint32_t>(c_.conditions.size());
        c_.conditions.push_back(wait_condition_);
        emit(Do::wait_test, a, {}, {}, static_cast<std::uint32_t>(c_.waits.size() - 1));
        return {};
      }
      case RMP_OP_PAUSE: {
        Place a{};
        const bool has_message = i.a.kind != RMP_OPERAND_NONE;
        if (has_message) {
          RMP_TRY_ASSIGN(a, value_of(i.a, RMP_TYPE_STRING, "PAUSE"));
        }
        emit(Do::pause, a, {}, {}, has_message ? 1 : 0);
        return {};
      }
      case RMP_OP_HALT: emit(Do::halt, {}, {}, {}); return {};
      case RMP_OP_TARGET: {
        RMP_TRY_ASSIGN(Place a, in(i.a));
        const std::uint32_t role = c_.type(a.type).role;
        if (role == RMP_ROLE_NONE || role == RMP_ROLE_ORIENTATION || role == RMP_ROLE_ROBOT)
          return bad("this is not a target");
        targets_.push_back(a);
        if (targets_.size() > 100'000) return bad("a motion has too many targets");
        return {};
      }
      case RMP_OP_ATTRIBUTE: return attribute(i);
      case RMP_OP_UNTIL: {
        if (in_until_ || has_until_) return bad("a motion has two conditions");
        until_ = {};
        if (i.a.kind != RMP_OPERAND_NONE) {
          RMP_TRY_ASSIGN(until_.action, routine_operand(i.a, RMP_ROUTINE_PROCEDURE));
          if (c_.routine(until_.action).parameter_count)
            return bad("the procedure called by UNTIL has parameters");
        }
        RMP_TRY(jump(Do::jump, {}, i.r));
        until_.until = static_cast<std::uint32_t>(c_.ops.size());
        until_condition_ = {};
        in_until_ = &until_condition_;
        is_until_ = true;
        return {};
      }
      case RMP_OP_UNTIL_TEST: {
        if (!in_until_ || !is_until_) return bad("UNTIL_TEST has no UNTIL");
        RMP_TRY_ASSIGN(Place a, value_of(i.a, RMP_TYPE_BOOL, "UNTIL"));
        in_until_ = nullptr;
        is_until_ = false;
        has_until_ = true;
        until_.condition = static_cast<std::uint32_t>(c_.conditions.size());
        c_.conditions.push_back(until_condition_);
        emit(Do::until_test, a, {}, {});
        return {};
      }
      case RMP_OP_MOVE: return move(i);
      case RMP_OP_START:
      case RMP_OP_ENABLE: {
        RMP_TRY_ASSIGN(const std::uint32_t r,
                       routine_operand(i.a, i.op == RMP_OP_START ? RMP_ROUTINE_PROCESS
                                                                 : RMP_ROUTINE_INTERRUPT));
        Place b{};
        const bool has_priority = i.b.kind != RMP_OPERAND_NONE;
        if (has_priority) {
          RMP_TRY_ASSIGN(b, value_of(i.b, RMP_TYPE_INT, "a priority"));
        }
        emit(i.op == RMP_OP_START ? Do::start : Do::enable, {}, b,
             Place{kFrame, false, has_priority ? 1u : 0u, 0}, r);
        return {};
      }
      case RMP_OP_STOP:
      case RMP_OP_CONTINUE:
      case RMP_OP_CANCEL:
      case RMP_OP_DISABLE: {
        RMP_TRY_ASSIGN(const std::uint32_t r,
                       routine_operand(i.a, i.op == RMP_OP_DISABLE ? RMP_ROUTINE_INTERRUPT
                                                                   : RMP_ROUTINE_PROCESS));
        emit(i.op == RMP_OP_STOP       ? Do::stop
             : i.op == RMP_OP_CONTINUE ? Do::continue_
             : i.op == RMP_OP_CANCEL   ? Do::cancel
                                       : Do::disable,
             {}, {}, {}, r);
        return {};
      }
      case RMP_OP_INTERRUPT_TEST: {
        RMP_TRY_ASSIGN(Place a, value_of(i.a, RMP_TYPE_BOOL, "WHEN"));
        emit(Do::interrupt_test, a, {}, {});
        return {};
      }
      case RMP_OP_TEACH: {
        if (i.a.kind != RMP_OPERAND_VARIABLE || i.a.index < 0 || i.a.index >= t_.symbols.count)
          return bad("TEACH needs a variable");
        const auto s = static_cast<std::uint32_t>(i.a.index);
        const Place p = c_.place_of[s];
        if (p.offset == kNone || p.space != kGlobal)
          return bad("TEACH needs variables of the program");
        emit(Do::teach, {}, {}, p, s);
        return {};
      }
      default:
        return i.op >= RMP_OP_ADD && i.op <= RMP_OP_COMPOSE
                   ? binary(i)
                   : Result<void>(bad("there is an unknown instruction"));
    }
  }
  Result<Place> reference(const rmp_code_operand& o) {
    if (o.kind != RMP_OPERAND_REFERENCE) return bad("a place is missing");
    return place(o);
  }

  Result<void> convert(const rmp_code_instruction& i) {
    RMP_TRY_ASSIGN(Place a, in(i.a));
    RMP_TRY_ASSIGN(Place r, out(i.r));
    const std::uint32_t from = a.type, to = r.type;
    if (same(from, to) || (from == RMP_TYPE_CHAR && to == RMP_TYPE_INT)) copy(a, r, to);
    else if (from == RMP_TYPE_INT && to == RMP_TYPE_REAL) emit(Do::int_to_real, a, {}, r);
    else if (from == RMP_TYPE_INT && to == RMP_TYPE_CHAR) emit(Do::int_to_char, a, {}, r);
    else if (from == RMP_TYPE_CHAR && to == RMP_TYPE_STRING) emit(Do::char_to_text, a, {}, r);
    else return bad("there is no such conversion");
    return finish();
  }

  Result<void> binary(const rmp_code_instruction& i) {
    RMP_TRY_ASSIGN(Place a, in(i.a));
    RMP_TRY_ASSIGN(Place b, in(i.b));
    RMP_TRY_ASSIGN(Place r, out(i.r));
    const std::uint32_t kind = type(a.type).kind;
    if (i.op == RMP_OP_COMPOSE) {
      const std::uint32_t x = c_.type(a.type).role, y = c_.type(b.type).role;
      std::uint32_t form = 0;
      if (x == RMP_ROLE_POSE && y == RMP_ROLE_POSE) form = 0;
      else if (x == RMP_ROLE_POSE && y == RMP_ROLE_POSITION) form = 1;
      else if (x == RMP_ROLE_ORIENTATION && y == RMP_ROLE_ORIENTATION) form = 2;
      else if (x == RMP_ROLE_ORIENTATION && y == RMP_ROLE_POSITION) form = 3;
      else return bad("COMPOSE needs poses");
      if (!same(r.type, b.type)) return bad("COMPOSE returns a different type");
      emit(Do::compose, a, b, r, form);
      return finish();
    }
    if (a.type != b.type && !(is_int(kind) && same(a.type, b.type)))
      return bad("an operation has operands of types two types");
    if (i.op == RMP_OP_EXOR) {
      if (a.type != RMP_TYPE_BOOL || r.type != RMP_TYPE_BOOL)
        return bad("EXOR needs BOOL operands");
      emit(Do::exor, a, b, r);
      return finish();
    }
    if (i.op >= RMP_OP_EQUAL) {
      if (r.type != RMP_TYPE_BOOL) return bad("a comparison must return a BOOL");
      const auto k = static_cast<std::uint16_t>(i.op - RMP_OP_EQUAL);
      if (kind == RMP_TYPE_STRING) emit(Do::compare_text, a, b, r, i.op);
      else if (is_int(kind))
        emit(static_cast<Do>(static_cast<std::uint16_t>(Do::equal_int) + k), a, b, r);
      else if (kind == RMP_TYPE_REAL)
        emit(static_cast<Do>(static_cast<std::uint16_t>(Do::equal_real) + k), a, b, r);
      else return bad("these values cannot be compared");
      return finish();
    }
    if (a.type != r.type) return bad("an operation returns a different type");
    Do code = Do::add_int;
    if (a.type == RMP_TYPE_INT) {
      switch (i.op) {
        case RMP_OP_ADD: code = Do::add_int; break;
        case RMP_OP_SUBTRACT: code = Do::subtract_int; break;
        case RMP_OP_MULTIPLY: code = Do::multiply_int; break;
        case RMP_OP_DIV: code = Do::div_int; break;
        case RMP_OP_MOD: code = Do::mod_int; break;
        default: return bad("DIVIDE needs REAL operands");
      }
    } else if (a.type == RMP_TYPE_REAL) {
      switch (i.op) {
        case RMP_OP_ADD: code = Do::add_real; break;
        case RMP_OP_SUBTRACT: code = Do::subtract_real; break;
        case RMP_OP_MULTIPLY: code = Do::multiply_real; break;
        case RMP_OP_DIVIDE: code = Do::divide_real; break;
        default: return bad("DIV and MOD need INT operands");
      }
    } else {
      return bad("an operation has operands of types no numbers");
    }
    emit(code, a, b, r);
    return finish();
  }

  struct Argument {
    Place at;
    bool is_place = false;
    std::uint32_t signal = kNone;
    std::uint32_t robot = kNone;  ///< symbol that is meant by its name
  };
  Result<std::vector<Argument>> arguments(const rmp_code_operand& count) {
    RMP_TRY_ASSIGN(const std::uint32_t n, number(count));
    if (n != arguments_.size())
      return bad("the number of arguments of a call differs from its count");
    return std::exchange(arguments_, {});
  }

  Result<void> call(const rmp_code_instruction& i) {
    RMP_TRY_ASSIGN(auto all, arguments(i.b));
    if (i.a.kind != RMP_OPERAND_ROUTINE || i.a.index < 0 || i.a.index >= t_.routines.count)
      return bad("a call names no routine");
    CallInfo c;
    c.routine = static_cast<std::uint32_t>(i.a.index);
    const auto& x = c_.routine(c.routine);
    if (x.kind != RMP_ROUTINE_PROCEDURE && x.kind != RMP_ROUTINE_FUNCTION)
      return bad("a call names a routine that cannot be called");
    if (x.parameter_count != all.size()) return bad("a call has the wrong number of arguments");
    std::vector<Argument> signals;
    for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
      const auto& p = c_.symbol(x.first_parameter + k);
      if (!same(p.type, all[k].at.type) || (p.mode != RMP_MODE_IN) != all[k].is_place)
        return bad("an argument and its parameter have different types");
      c.arguments.push_back(
          {all[k].at, c_.place_of[x.first_parameter + k].offset, all[k].is_place});
      if (all[k].signal != kNone) signals.push_back(all[k]);
    }
    notes_cycle();
    pending_out_ = nullptr;
    if (i.r.kind != RMP_OPERAND_NONE) {
      RMP_TRY_ASSIGN(c.result, out(i.r));
      c.has_result = true;
      if (x.result == RMP_TYPE_VOID || !same(c.result.type, x.result))
        return bad("a call returns a different type");
    }
    c_.calls.push_back(std::move(c));
    emit(Do::call, {}, {}, {}, static_cast<std::uint32_t>(c_.calls.size() - 1));
    RMP_TRY(finish());
    for (const Argument& a : signals) emit(Do::write_signal, a.at, {}, {}, a.signal);
    return {};
  }
  Result<void> intrinsic(const rmp_code_instruction& i) {
    RMP_TRY_ASSIGN(auto all, arguments(i.b));
    if (i.a.kind != RMP_OPERAND_INTRINSIC || i.a.index < 0 || i.a.index >= t_.symbols.count)
      return bad("a function of the language is missing");
    IntrinsicCall c;
    c.symbol = static_cast<std::uint32_t>(i.a.index);
    const std::string_view name = c_.symbol(c.symbol).name;
    std::string_view parameters, result;
    bool is_number = false;
    for (const NumberRow& r : kNumbers)
      if (r.name == name) {
        is_number = true;
        c.number = *number_function(name);
        parameters = r.parameters;
        result = r.result;
      }
    bool is_known = is_number;
    for (const FnRow& r : kFns)
      if (r.name == name) {
        is_known = true;
        c.fn = r.fn;
        parameters = r.parameters;
        result = r.result;
      }
    if (!is_known) return bad("the language has no function " + std::string(name));
    if (c.fn == Fn::act_robot && !is_number && !all.empty()) parameters = "N", result = "";
    if (parameters == "q") {
      static constexpr std::string_view kForms[] = {"", "i", "iN"};
      if (all.size() > 2) return bad("BRAKE needs a mode and a robot");
      parameters = kForms[all.size()];
    }
    const char many = parameters == "w" || parameters == "m" ? parameters[0] : '\0';
    if (!many && parameters.size() != all.size())
      return bad(std::string(name) + " has the wrong number of arguments");
    std::uint32_t element = RMP_TYPE_VOID, number_type = RMP_TYPE_VOID;
    std::vector<Argument> signals;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const std::uint32_t t = all[k].at.type;
      const std::uint32_t kind = type(t).kind, role = c_.type(t).role;
      const bool is_file = kind == RMP_TYPE_FILE || kind == RMP_TYPE_TEXT;
      const char p = many ? many : parameters[k];
      bool fits = false, wants_place = false;
      switch (p) {
        case 'i': fits = kind == RMP_TYPE_INT; break;
        case 'r': fits = kind == RMP_TYPE_REAL; break;
        case 'n':
          fits = kind == RMP_TYPE_INT || kind == RMP_TYPE_REAL;
          number_type = kind;
          break;
        case 'c': fits = kind == RMP_TYPE_CHAR; break;
        case 's': fits = kind == RMP_TYPE_STRING; break;
        case 'p': fits = role == RMP_ROLE_POSITION; break;
        case 'o': fits = role == RMP_ROLE_ORIENTATION; break;
        case 'P': fits = role == RMP_ROLE_POSE; break;
        case 'J': fits = role == RMP_ROLE_JOINT; break;
        case 'T': fits = role == RMP_ROLE_ROBTARGET; break;
        case 'x': fits = kind == RMP_TYPE_PROCESS; break;
        case 'N':
          fits = all[k].robot != kNone;
          c.robot = all[k].robot;
          break;
        case 'e': fits = element != RMP_TYPE_VOID && same(t, element); break;
        case 'l':
        case 'L':
          fits = kind == RMP_TYPE_LIST;
          element = fits ? type(t).element : element;
          wants_place = p == 'L';
          break;
        case 'a':
          fits = kind == RMP_TYPE_LIST || kind == RMP_TYPE_ARRAY || kind == RMP_TYPE_STRING;
          break;
        case 'F':
          fits = is_file;
          wants_place = true;
          break;
        case 'S':
          fits = kind == RMP_TYPE_SEMAPHORE;
          wants_place = true;
          break;
        case 'B':
          fits = kind == RMP_TYPE_STRING;
          wants_place = true;
          break;
        case 'w':
          fits = kind != RMP_TYPE_SEMAPHORE && kind != RMP_TYPE_PROCESS && (!is_file || k == 0);
          wants_place = is_file;
          break;
        default:
          fits = is_file ? k == 0 : kind <= RMP_TYPE_STRING && kind != RMP_TYPE_VOID;
          wants_place = true;
          break;
      }
      if (!fits || wants_place != all[k].is_place)
        return bad("an argument of " + std::string(name) + " has a different type");
      c.arguments.push_back(all[k].at);
      if (all[k].signal != kNone) signals.push_back(all[k]);
    }
    if (c.fn == Fn::trafo || c.fn == Fn::trafo_inv || c.fn == Fn::get_status ||
        (c.fn >= Fn::robot_joints && c.fn <= Fn::act_robot) ||
        (c.fn >= Fn::open && c.fn <= Fn::release))
      notes_cycle();
    pending_out_ = nullptr;
    if (result.empty()) {
      if (i.r.kind != RMP_OPERAND_NONE) return bad(std::string(name) + " has no value");
    } else {
      RMP_TRY_ASSIGN(c.result, out(i.r));
      c.has_result = true;
      const std::uint32_t kind = type(c.result.type).kind, role = c_.type(c.result.type).role;
      bool fits = false;
      switch (result[0]) {
        case 'i': fits = kind == RMP_TYPE_INT; break;
        case 'r': fits = kind == RMP_TYPE_REAL; break;
        case 'n': fits = kind == number_type; break;
        case 'c': fits = kind == RMP_TYPE_CHAR; break;
        case 'b': fits = kind == RMP_TYPE_BOOL; break;
        case 's': fits = kind == RMP_TYPE_STRING; break;
        case 'p': fits = role == RMP_ROLE_POSITION; break;
        case 'o': fits = role == RMP_ROLE_ORIENTATION; break;
        case 'P': fits = role == RMP_ROLE_POSE; break;
        case 'J': fits = role == RMP_ROLE_JOINT; break;
        case 'R':
          fits = role == RMP_ROLE_ROBOT && !type(c.result.type).has_list;
          if (fits) robots_of(c.result.type);
          break;
        default: fits = role == RMP_ROLE_ROBTARGET; break;
      }
      if (!fits) return bad(std::string(name) + " returns a different type");
    }
    // What is a plain operation.
    if (is_number && c.number == NumberFunction::same) {
      const Place& a = c.arguments[0];
      if (name == "FLOAT") emit(Do::int_to_real, a, {}, c.result);
      else if (name == "CHR") emit(Do::int_to_char, a, {}, c.result);
      else emit(Do::copy1, a, {}, c.result);
      return finish();
    }
    if (is_number && type(c.result.type).kind == RMP_TYPE_REAL) {
      emit(Do::number, c.arguments[0], c.arguments.size() > 1 ? c.arguments[1] : Place{}, c.result,
           static_cast<std::uint32_t>(c_.intrinsics.size()));
      c_.intrinsics.push_back(std::move(c));
      return finish();
    }
    if (is_number) c.fn = c.number == NumberFunction::abs ? Fn::abs_int : Fn::number;
    c_.intrinsics.push_back(std::move(c));
    emit(Do::intrinsic, {}, {}, {}, static_cast<std::uint32_t>(c_.intrinsics.size() - 1));
    RMP_TRY(finish());
    for (const Argument& a : signals) emit(Do::write_signal, a.at, {}, {}, a.signal);
    return {};
  }

  /// What R_ACT_ROB may be.
  void robots_of(std::uint32_t of) {
    if (!c_.robots.empty()) return;
    for (std::uint32_t s = 0; s < t_.symbols.count; ++s) {
      const auto& x = c_.symbol(s);
      if (x.kind != RMP_SYMBOL_ROBOT || !same(x.type, of) || c_.place_of[s].space != kGlobal ||
          c_.place_of[s].offset == kNone)
        continue;
      c_.robots.emplace_back(s, static_cast<std::uint32_t>(c_.live.size()));
      c_.live.push_back(live_fields(s, kNone));
      c_.live_symbol.push_back(s);
    }
  }

  Result<void> make(const rmp_code_instruction& i) {
    RMP_TRY_ASSIGN(auto all, arguments(i.b));
    for (const Argument& a : all)
      if (a.is_place) return bad("MAKE needs values");
    RMP_TRY_ASSIGN(Place r, out(i.r));
    const rmp_code_type& t = c_.type(r.type);
    const auto part = [&](std::size_t k) {
      return t.kind == RMP_TYPE_RECORD
                 ? c_.field(t.first_field + static_cast<std::uint32_t>(k)).type
                 : t.element;
    };
    if (t.kind == RMP_TYPE_RECORD  ? all.size() != t.field_count
        : t.kind == RMP_TYPE_ARRAY ? all.size() != type(r.type).length
                                   : t.kind != RMP_TYPE_LIST)
      return bad("MAKE has the wrong number of values");
    for (std::size_t k = 0; k < all.size(); ++k)
      if (!same(all[k].at.type, part(k))) return bad("MAKE makes a different type");
    if (t.kind == RMP_TYPE_LIST) {
      const std::uint32_t each = type(t.element).slots;
      const std::uint64_t total = all.size() * std::uint64_t{each};
      if (total > c_.limits.most_bytes / 8) return too_big();
      Place at{};
      if (total) {
        RMP_TRY_ASSIGN(at, scratch(t.element, static_cast<std::uint32_t>(total)));
      }
      for (std::size_t k = 0; k < all.size(); ++k) {
        Place to = at;
        to.offset += static_cast<std::uint32_t>(k * each);
        copy(all[k].at, to, t.element);
      }
      emit(Do::make_list, at, Place{kFrame, false, static_cast<std::uint32_t>(all.size()), 0}, r,
           t.element);
      return finish();
    }
    // A value that is made of itself goes by way of another place.
    const std::uint32_t slots = type(r.type).slots;
    bool overlaps = false;
    for (const Argument& a : all)
      overlaps = overlaps || (a.at.space == r.space && a.at.offset < r.offset + slots &&
                              r.offset < a.at.offset + type(a.at.type).slots);
    Place to = r;
    if (overlaps) {
      RMP_TRY_ASSIGN(to, scratch(r.type));
    }
    Place next = to;
    for (std::size_t k = 0; k < all.size(); ++k) {
      copy(all[k].at, next, part(k));
      next.offset += type(part(k)).slots;
    }
    if (overlaps) copy(to, r, r.type);
    return finish();
  }

  Result<void> attribute(const rmp_code_instruction& i) {
    if (i.b.kind != RMP_OPERAND_WORD || i.b.index < 0 || i.b.index > RMP_ATTR_FRAME)
      return bad("there is no such attribute");
    MoveAttribute m;
    m.attribute = static_cast<std::uint32_t>(i.b.index);
    for (const MoveAttribute& other : attributes_)
      if (other.attribute == m.attribute) return bad("an attribute is given twice");
    if (m.attribute == RMP_ATTR_ACT_ROB) {
      if (i.a.kind != RMP_OPERAND_VARIABLE || i.a.index < 0 || i.a.index >= t_.symbols.count ||
          c_.type(c_.symbol(static_cast<std::uint32_t>(i.a.index)).type).role != RMP_ROLE_ROBOT)
        return error(ErrorCode::unsupported, "ACT_ROB needs the name of a robot",
                     "Name a robot that the cell declares: ROBOT name := ...;",
                     "line " + std::to_string(now_->span.line));
      m.robot = static_cast<std::uint32_t>(i.a.index);
      attributes_.push_back(m);
      return {};
    }
    RMP_TRY_ASSIGN(m.value, in(i.a));
    const std::uint32_t t = m.value.type;
    bool fits = t == RMP_TYPE_REAL;
    if (m.attribute == RMP_ATTR_C_PASS || m.attribute == RMP_ATTR_WOBBLE) fits = t == RMP_TYPE_BOOL;
    if (m.attribute == RMP_ATTR_DEVICE || m.attribute == RMP_ATTR_ADAX_CONTROL)
      fits = t == RMP_TYPE_INT;
    if (m.attribute >= RMP_ATTR_TOOL) fits = c_.type(t).role == RMP_ROLE_POSE;
    if (!fits) return bad("an attribute has a different type");
    attributes_.push_back(m);
    return {};
  }

  Result<void> move(const rmp_code_instruction& i) {
    if (in_until_ && is_until_) return bad("a condition has no end before its MOVE");
    MoveInfo m;
    if (has_until_) m = until_;
    if (i.a.kind != RMP_OPERAND_WORD || i.a.index < 0 || i.a.index > RMP_MOVE_PATH)
      return bad("there is no such motion");
    m.interpolation = static_cast<std::uint32_t>(i.a.index);
    RMP_TRY_ASSIGN(const std::uint32_t incremental, number(i.b));
    m.is_incremental = incremental != 0;
    m.targets = std::exchange(targets_, {});
    m.attributes = std::exchange(attributes_, {});
    m.order = moves_++;
    has_until_ = false;
    until_ = {};
    if (m.targets.empty()) return bad("a motion has no target");
    if (m.interpolation == RMP_MOVE_CIRCLE && m.targets.size() != 2)
      return bad("CIRCLE needs two targets");
    for (const Place& t : m.targets) {
      const std::uint32_t role = c_.type(t.type).role;
      const bool is_joint = role == RMP_ROLE_JOINT || role == RMP_ROLE_MAIN_JOINT;
      if ((is_joint && m.interpolation != RMP_MOVE_PTP) ||
          (role == RMP_ROLE_ADD_JOINT && m.interpolation > RMP_MOVE_LIN))
        return bad("a motion has a target of the wrong kind");
    }
    c_.moves.push_back(std::move(m));
    emit(Do::move, {}, {}, {}, static_cast<std::uint32_t>(c_.moves.size() - 1));
    return {};
  }

  /// Slots before a field of a record.
  std::uint32_t field_offset(std::uint32_t of, std::uint32_t k) {
    const auto& t = c_.type(of);
    std::vector<std::uint32_t>& known = field_offsets_[of];
    if (known.empty()) {
      known.resize(t.field_count);
      for (std::uint32_t f = 1; f < t.field_count; ++f)
        known[f] = known[f - 1] + type(c_.field(t.first_field + f - 1).type).slots;
    }
    return known[k];
  }

  /// Where statements begin: where the place in the source changes.
  void statements() {
    for (std::uint32_t r = 0; r < t_.routines.count; ++r) {
      const RoutineInfo& x = c_.routines[r];
      rmp_span before{kNone, 0, 0, 0, 0};
      for (std::uint32_t k = 0; k + 1 < x.count; ++k) {
        const std::uint32_t op = x.first + k;
        const rmp_span& s = c_.instruction(op).span;
        if (s.file == before.file && s.line == before.line && s.column == before.column) continue;
        before = s;
        if (c_.ops[op].code != Do::jump) c_.statement_ops.push_back(op);
      }
    }
  }

  std::shared_ptr<Machine::Code> made_;
  Machine::Code& c_;
  const rmp_code& t_;
  std::vector<std::uint32_t> owner_;  ///< by symbol: routine whose frame it is in
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> field_offsets_;  ///< by type
  std::uint32_t first_number_ = 0, timeout_symbol_ = kNone;
  // Of one routine.
  std::uint32_t routine_ = 0, index_ = 0, moves_ = 0, waits_ = 0;
  const rmp_code_instruction* now_ = nullptr;
  bool is_data_list_ = false;
  std::map<std::int64_t, std::pair<std::uint32_t, std::uint32_t>> temporaries_;  ///< offset, slots
  std::map<std::int64_t, std::uint32_t> labels_;
  std::vector<std::pair<std::uint32_t, std::int64_t>> fixups_;
  std::vector<Argument> arguments_;
  std::vector<Place> targets_;
  std::vector<MoveAttribute> attributes_;
  MoveInfo until_;
  bool has_until_ = false, is_until_ = false;
  ConditionInfo wait_condition_, until_condition_;
  ConditionInfo *in_wait_ = nullptr, *in_until_ = nullptr;
  std::uint64_t base_ = 0, scratch_ = 0, most_ = 0;
  Place out_{};
  const rmp_code_operand* pending_out_ = nullptr;
};

}  // namespace

std::string Machine::Code::type_name(std::uint32_t t) const {
  static constexpr const char* kBasic[] = {"",       "INT",  "REAL", "CHAR",      "BOOL",
                                           "STRING", "TEXT", "FILE", "SEMAPHORE", "PROCESS"};
  std::string prefix;
  for (;;) {
    if (t <= RMP_TYPE_PROCESS) return prefix + kBasic[t];
    const rmp_code_type& x = type(t);
    if (*x.name) return prefix + x.name;
    if (x.kind == RMP_TYPE_ARRAY)
      prefix += "ARRAY [" + std::to_string(x.lower) + ".." + std::to_string(x.upper) + "] OF ";
    else if (x.kind == RMP_TYPE_LIST) prefix += "LIST OF ";
    else return prefix + "RECORD";
    t = x.element;
  }
}

Signal Machine::Code::signal(std::uint32_t s) const {
  const rmp_code_symbol& x = symbol(s);
  return {s, x.name, x.address, x.width, x.type, x.kind == RMP_SYMBOL_OUTPUT};
}

Result<Machine> Machine::load(std::shared_ptr<const CompiledProgram> program,
                              const Limits& limits) {
  if (!program)
    return error(ErrorCode::invalid_argument, "there is no program to run", "Compile one first.");
  RMP_TRY_ASSIGN(auto code, Decoder(std::move(program), limits).run());
  Machine m(std::move(code), std::make_shared<State>());
  m.restart();
  return m;
}

}  // namespace robomosp::program
