// SPDX-License-Identifier: Apache-2.0
// URScript has metres, radians and rotation vectors, lists of one kind of element, functions that
// take values, and no records: a record is one variable for each of its fields, an array of records
// one list for each. Geometric values are poses p[x,y,z,rx,ry,rz].
#include "urscript.h"

#include <array>
#include <functional>

#include "../common/moves.h"

namespace robomosp::post {
namespace {

constexpr double kRadian = 1 / kDegree;

class UrWriter final : public MoveWriter {
 public:
  using MoveWriter::MoveWriter;

 private:
  // ---- the program ----
  bool program_is_last() const override { return true; }
  void begin() override {
    names_.of(1ULL << 40U, task_.name);
    acceleration_ = number_option("acceleration", 1200);
    joint_acceleration_ = number_option("joint_acceleration", 80);
    joint_speed_ = number_option("joint_speed", model_speed());
    ptp_radius_ = number_option("ptp_radius", 50);
    texts_.resize(c_.routines.count);
    calls_.resize(c_.routines.count);
    if (profile_.frame >= 0)
      note("poses are written in the robot's base: URScript has no active frame");
  }
  double model_speed() const {
    double least = std::numeric_limits<double>::infinity();
    if (task_.robot)
      for (const JointModel& j : task_.robot->joints)
        if (j.type == JointType::revolute) least = std::min(least, j.max_velocity * kDegree);
    return std::isfinite(least) && least > 0 ? least : 60;
  }
  void routine_begin(std::uint32_t r) override {
    radii_.clear();
    out_ = &texts_[r];
    const auto& x = routine(r);
    if (r == 0) {
      out_->in();
      start();
      return;
    }
    out_->in();
    if (x.kind == RMP_ROUTINE_INTERRUPT) {
      cannot("interrupts", "Poll the condition in a PROCESS.");
      return;
    }
    std::string head = x.kind == RMP_ROUTINE_PROCESS ? "thread " : "def ";
    head += routine_name(r) + "(";
    for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
      const std::uint32_t s = x.first_parameter + k;
      if (symbol(s).mode != RMP_MODE_IN) {
        at_ = symbol(s).span;
        cannot("parameters that are changed (OUT, INOUT)",
               "Give the result by RETURN, or use a variable of the program.");
      }
      if (!is_simple(symbol(s).type)) {
        at_ = symbol(s).span;
        cannot("parameters of type " + type_name(symbol(s).type),
               "Give its parts one by one, or use a variable of the program.");
      }
      head += (k ? ", " : "") + name(s);
    }
    open(head + "):");
    at_ = x.span;
  }
  void routine_end(std::uint32_t r) override {
    if (r == 0) return;
    if (out_->lines().size() == 1) line("return 0");
    close("end");
  }
  void start() {
    if (!profile_.prologue.empty()) out_->add_lines(profile_.prologue);
    if (const auto common = common_place(RMP_ATTR_TOOL)) {
      line("set_tcp(" + pose_text(*common) + ")");
      for (const PostPlace& t : profile_.tools)
        if (same_place(t.pose, *common)) payload(t);
      common_tool_ = true;
    } else if (profile_.tool >= 0 &&
               static_cast<std::size_t>(profile_.tool) < profile_.tools.size()) {
      const PostPlace& t = profile_.tools[static_cast<std::size_t>(profile_.tool)];
      line("set_tcp(" + pose_text(t.pose) + ")");
      payload(t);
      tool_.changes(pose_text(t.pose));
    }
  }
  void payload(const PostPlace& t) {
    if (t.mass <= 0) return;
    line("set_payload(" + number(t.mass, 3) + ", [" + number(t.com[0], 4) + ", " +
         number(t.com[1], 4) + ", " + number(t.com[2], 4) + "])");
  }
  void declare(std::uint32_t s, std::uint32_t r) override {
    const auto& x = symbol(s);
    at_ = x.span;
    if (x.kind == RMP_SYMBOL_ROBOT) return;
    // Variables of the program stand in front of the functions that use them.
    File* const before = out_;
    if (r == 0) {
      out_ = &globals_;
      if (globals_.empty()) globals_.in();
    }
    if (is_list(x.type)) {
      cannot("variables of type " + type_name(x.type), "Use an ARRAY and a count.");
    } else {
      std::vector<std::string> path;
      define(s, "", x.type, x.value, r == 0 ? "global " : "local ");
    }
    out_ = before;
  }
  void finish() override {
    File all(2);
    const rmp_span head = routine(0).span;
    all.add("def " + routine_name(0) + "():", &head);
    all.append(globals_);
    helpers_text(all);
    all.append(threads_);
    for (const std::uint32_t r : call_order()) all.append(texts_[r]);
    if (texts_[0].empty()) all.add("  halt", &head);
    all.append(texts_[0]);
    all.add_lines(profile_.epilogue);
    all.add("end", &head);
    all.give(output_, std::string(task_.name) + ".script", false);
  }
  /// Functions stand behind those that they call.
  std::vector<std::uint32_t> call_order() const {
    std::vector<std::uint32_t> out;
    std::vector<int> state(c_.routines.count, 0);
    for (std::uint32_t first = 1; first < c_.routines.count; ++first) {
      std::vector<std::uint32_t> open{first};
      while (!open.empty()) {
        const std::uint32_t r = open.back();
        if (state[r] == 0) {
          state[r] = 1;
          for (const std::uint32_t to : calls_[r])
            if (to != 0 && state[to] == 0) open.push_back(to);
          continue;
        }
        open.pop_back();
        if (state[r] == 1) out.push_back(r);
        state[r] = 2;
      }
    }
    return out;
  }
  void helpers_text(File& f) const {
    const auto has = [&](const char* h) { return helpers_.contains(h); };
    if (has("rmp_pose"))
      f.add_lines(
          "  # position of a, orientation of b\n"
          "  def rmp_pose(a, b):\n"
          "    return p[a[0], a[1], a[2], b[3], b[4], b[5]]\n"
          "  end\n");
    if (has("rmp_at"))
      f.add_lines(
          "  def rmp_at(a, i):\n"
          "    return a[i]\n"
          "  end\n");
    if (has("rmp_rpy"))
      f.add_lines(
          "  # Rz(c) Ry(b) Rx(a), degrees\n"
          "  def rmp_rpy(a, b, c):\n"
          "    local v = rpy2rotvec([d2r(a), d2r(b), d2r(c)])\n"
          "    return p[0.0, 0.0, 0.0, v[0], v[1], v[2]]\n"
          "  end\n");
    if (has("rmp_div") || has("rmp_mod"))
      f.add_lines(
          "  # whole quotient, towards zero\n"
          "  def rmp_div(a, b):\n"
          "    local q = (a + 0.0) / b\n"
          "    if q < 0:\n"
          "      return ceil(q)\n"
          "    end\n"
          "    return floor(q)\n"
          "  end\n");
    if (has("rmp_mod"))
      f.add_lines(
          "  def rmp_mod(a, b):\n"
          "    return a - rmp_div(a, b) * b\n"
          "  end\n");
    if (has("rmp_round"))
      f.add_lines(
          "  # nearest whole number, halves away from zero\n"
          "  def rmp_round(x):\n"
          "    if x < 0:\n"
          "      return ceil(x - 0.5)\n"
          "    end\n"
          "    return floor(x + 0.5)\n"
          "  end\n");
    if (has("rmp_trunc"))
      f.add_lines(
          "  def rmp_trunc(x):\n"
          "    if x < 0:\n"
          "      return ceil(x)\n"
          "    end\n"
          "    return floor(x)\n"
          "  end\n");
    if (has("rmp_abs"))
      f.add_lines(
          "  def rmp_abs(x):\n"
          "    if x < 0:\n"
          "      return -x\n"
          "    end\n"
          "    return x\n"
          "  end\n");
    for (const char* kind : {"standard", "configurable", "tool"}) {
      const std::string k = kind;
      if (helpers_.contains("out_" + k))
        f.add_lines("  # the lowest bit first\n  def rmp_write_" + k +
                    "(first, count, value):\n"
                    "    local k = 0\n"
                    "    local rest = value\n"
                    "    while k < count:\n"
                    "      local half = floor(rest / 2.0)\n"
                    "      set_" +
                    k +
                    "_digital_out(first + k, rest - 2 * half == 1)\n"
                    "      rest = half\n"
                    "      k = k + 1\n"
                    "    end\n"
                    "  end\n");
      for (const char* way : {"in", "out"})
        if (helpers_.contains("read_" + k + way))
          f.add_lines("  def rmp_read_" + k + "_" + way +
                      "(first, count):\n"
                      "    local k = count - 1\n"
                      "    local value = 0\n"
                      "    while k >= 0:\n"
                      "      value = 2 * value\n"
                      "      if get_" +
                      k + "_digital_" + way +
                      "(first + k):\n"
                      "        value = value + 1\n"
                      "      end\n"
                      "      k = k - 1\n"
                      "    end\n"
                      "    return value\n"
                      "  end\n");
    }
  }
  const char* helper(const char* h) {
    helpers_.insert(h);
    return h;
  }

  // ---- variables ----
  static bool is_geometry(std::uint32_t role) {
    return role == RMP_ROLE_POSITION || role == RMP_ROLE_ORIENTATION || role == RMP_ROLE_POSE ||
           role == RMP_ROLE_ROBTARGET || role == RMP_ROLE_JOINT || role == RMP_ROLE_MAIN_JOINT;
  }
  /// One variable there.
  bool is_simple(std::uint32_t t) const {
    const auto& x = type(t);
    return is_geometry(x.role) || x.kind == RMP_TYPE_INT || x.kind == RMP_TYPE_REAL ||
           x.kind == RMP_TYPE_BOOL || x.kind == RMP_TYPE_STRING || x.kind == RMP_TYPE_CHAR ||
           x.kind == RMP_TYPE_SEMAPHORE;
  }
  bool is_list(std::uint32_t t) const {
    const auto kind = type(t).kind;
    return kind == RMP_TYPE_LIST || kind == RMP_TYPE_TEXT || kind == RMP_TYPE_FILE ||
           kind == RMP_TYPE_PROCESS;
  }
  std::string zero(std::uint32_t t) const {
    const auto& x = type(t);
    if (is_joints(x.role)) return "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]";
    if (is_geometry(x.role)) return "p[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]";
    if (x.kind == RMP_TYPE_BOOL) return "False";
    if (x.kind == RMP_TYPE_REAL) return "0.0";
    if (x.kind == RMP_TYPE_STRING || x.kind == RMP_TYPE_CHAR) return "\"\"";
    return "0";
  }
  static std::uint32_t length_of(const rmp_code_type& array) {
    return static_cast<std::uint32_t>(std::int64_t{array.upper} - array.lower + 1);
  }
  std::string part_name(std::uint32_t s, const std::string& suffix) {
    if (suffix.empty()) return name(s);
    const auto [it, is_new] = parts_.try_emplace({s, suffix});
    if (is_new) it->second = names_.unique(std::string(symbol(s).name) + suffix);
    return it->second;
  }
  /// All variables of one of the program, with what they begin with.
  void define(std::uint32_t s, const std::string&, std::uint32_t t, std::uint32_t value,
              const std::string& how) {
    std::vector<std::pair<std::string, std::vector<std::string>>> leaves;
    std::map<std::string, std::size_t> at;
    bool fine = true;
    std::size_t count = 0;
    const std::function<void(std::uint32_t, std::uint32_t, const std::string&, int)> walk =
        [&](std::uint32_t of, std::uint32_t e, const std::string& suffix, int depth) {
          const auto& x = type(of);
          if (!fine || depth > 100) return;
          if (is_simple(of)) {
            const auto [it, is_new] = at.try_emplace(suffix, leaves.size());
            if (is_new) leaves.push_back({suffix, {}});
            leaves[it->second].second.push_back(e == RMP_NONE ? zero(of) : text(e));
            if (++count > 10'000) {
              fail("variables of more than 10000 numbers cannot be posted", "Make it smaller.");
              fine = false;
            }
            return;
          }
          // Another variable's value is copied part by part.
          std::span<const std::uint32_t> parts;
          if (e != RMP_NONE) {
            const auto& v = expression(e);
            if (v.op != RMP_EXPR_MAKE) {
              cannot("such value of type " + type_name(of) + " at the start of a variable",
                     "Assign its parts in the program.");
              fine = false;
              return;
            }
            parts = links(v.first, v.count);
          }
          if (x.kind == RMP_TYPE_RECORD) {
            for (std::uint32_t k = 0; k < x.field_count; ++k)
              walk(field_row(x.first_field + k).type, k < parts.size() ? parts[k] : RMP_NONE,
                   suffix + "_" + field_name(of, k), depth + 1);
            return;
          }
          if (x.kind == RMP_TYPE_ARRAY) {
            const std::uint32_t n = length_of(x);
            for (std::uint32_t k = 0; k < n && fine; ++k)
              walk(x.element, k < parts.size() ? parts[k] : RMP_NONE, suffix, depth + 1);
            return;
          }
          cannot("variables of type " + type_name(of));
          fine = false;
        };
    walk(t, value, "", 0);
    if (!fine) return;
    const bool is_array = has_array(t);
    for (const auto& [suffix, values] : leaves) {
      std::string all = values[0];
      if (is_array || values.size() > 1) {
        all = "[";
        for (std::size_t i = 0; i < values.size(); ++i) all += (i ? ", " : "") + values[i];
        all += "]";
      }
      line(how + part_name(s, suffix) + " = " + all);
    }
  }
  bool has_array(std::uint32_t t) const {
    for (int depth = 0; depth < 100; ++depth) {
      const auto& x = type(t);
      if (x.kind == RMP_TYPE_ARRAY) return true;
      if (x.kind != RMP_TYPE_RECORD || x.role != RMP_ROLE_NONE) return false;
      // Any field may hold one.
      for (std::uint32_t k = 0; k < x.field_count; ++k) {
        const std::uint32_t f = field_row(x.first_field + k).type;
        if (type(f).kind == RMP_TYPE_ARRAY) return true;
      }
      return false;
    }
    return false;
  }

  /// A place in a variable: which of the variables there, and which element.
  struct Place {
    std::uint32_t symbol = RMP_NONE;
    std::string suffix, index;
    std::uint32_t type = RMP_NONE;
  };
  std::optional<Place> place(std::uint32_t e) {
    const auto& x = expression(e);
    const auto operands = links(x.first, x.count);
    if (x.op == RMP_EXPR_SYMBOL) {
      const auto kind = symbol(x.symbol).kind;
      if (kind == RMP_SYMBOL_INPUT || kind == RMP_SYMBOL_OUTPUT) return std::nullopt;
      return Place{x.symbol, "", "", x.type};
    }
    if (x.op == RMP_EXPR_FIELD) {
      const std::uint32_t of = expression(operands[0]).type;
      if (role(of) != RMP_ROLE_NONE) return std::nullopt;
      auto p = place(operands[0]);
      if (!p) return std::nullopt;
      p->suffix += "_" + field_name(of, x.symbol);
      p->type = x.type;
      return p;
    }
    if (x.op == RMP_EXPR_INDEX) {
      const auto& of = type(expression(operands[0]).type);
      if (of.kind != RMP_TYPE_ARRAY) return std::nullopt;
      auto p = place(operands[0]);
      if (!p) return std::nullopt;
      std::string i = less(operands[1], of.lower);
      if (!p->index.empty())
        i = (p->index.find_first_not_of("0123456789") == std::string::npos ? p->index
                                                                           : "(" + p->index + ")") +
            " * " + std::to_string(length_of(of)) + " + " + i;
      p->index = i;
      p->type = x.type;
      return p;
    }
    return std::nullopt;
  }
  /// An expression less a number.
  std::string less(std::uint32_t e, std::int64_t by) {
    if (const auto v = known(e)) return std::to_string(static_cast<std::int64_t>(*v) - by);
    const Text t = expr(e);
    if (by == 0) return t.text;
    return within(t, 6) + (by > 0 ? " - " : " + ") + std::to_string(by > 0 ? by : -by);
  }
  /// Text of a place of one variable there; empty = said.
  std::string place_text(const Place& p) {
    if (!is_simple(p.type) && !(type(p.type).kind == RMP_TYPE_ARRAY && p.index.empty() &&
                                is_simple(type(p.type).element))) {
      cannot("whole values of type " + type_name(p.type), "Assign its parts one by one.");
      return "x";
    }
    return part_name(p.symbol, p.suffix) + (p.index.empty() ? "" : "[" + p.index + "]");
  }
  Text variable(std::uint32_t s) override {
    const auto& x = symbol(s);
    if (!is_simple(x.type) &&
        !(x.kind != RMP_SYMBOL_PARAMETER && type(x.type).kind == RMP_TYPE_ARRAY &&
          is_simple(type(x.type).element))) {
      cannot("whole values of type " + type_name(x.type), "Assign its parts one by one.");
      return {"x"};
    }
    return {name(s)};
  }
  Text index(std::uint32_t object, std::uint32_t i, const rmp_code_expression& e) override {
    if (expression(object).type == RMP_TYPE_STRING)
      return {"str_at(" + text(object) + ", " + less(i, 1) + ")"};
    const auto me = static_cast<std::uint32_t>(&e - &expression(0));
    if (auto p = place(me)) return {place_text(*p)};
    cannot("such use of an element", "Assign it to a variable first.");
    return {"x"};
  }
  Text field(std::uint32_t object, std::uint32_t n, const rmp_code_expression& e) override {
    const std::uint32_t of = role(expression(object).type);
    if (of == RMP_ROLE_NONE) {
      const auto me = static_cast<std::uint32_t>(&e - &expression(0));
      if (auto p = place(me)) return {place_text(*p)};
      cannot("fields of this value", "Assign it to a variable first.");
      return {"x"};
    }
    const std::string zeros = "p[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]";
    switch (of) {
      case RMP_ROLE_POSITION: {
        // The position within a pose has its first three numbers.
        const auto& x = expression(object);
        std::uint32_t whole = object;
        if (x.op == RMP_EXPR_FIELD &&
            role(expression(links(x.first, x.count)[0]).type) == RMP_ROLE_POSE)
          whole = links(x.first, x.count)[0];
        return {element(text(whole), n) + " * 1000.0", 7};
      }
      case RMP_ROLE_POSE:
        if (n == 0)
          return {std::string(helper("rmp_pose")) + "(" + text(object) + ", " + zeros + ")"};
        return {std::string(helper("rmp_pose")) + "(" + zeros + ", " + text(object) + ")"};
      case RMP_ROLE_ROBTARGET:
        if (n == 0) return expr(object);
        cannot("status, turns and additional joints of a target at run time", "Read its PSE only.");
        return {"x"};
      case RMP_ROLE_MAIN_JOINT: return {"r2d(" + element(text(object), n) + ")"};
      case RMP_ROLE_JOINT:
        if (n == 0) return expr(object);
        cannot("additional joints", "Use M_JOINT only.");
        return {"x"};
      default:
        cannot("parts of an orientation at run time", "Compute them with constants.");
        return {"x"};
    }
  }
  std::string element(const std::string& of, std::uint32_t i) {
    const bool is_name = of.find_first_of("( ") == std::string::npos && of.back() != ']';
    if (is_name) return of + "[" + std::to_string(i) + "]";
    return std::string(helper("rmp_at")) + "(" + of + ", " + std::to_string(i) + ")";
  }
  void assign(std::uint32_t to, std::uint32_t value) override {
    if (auto p = place(to)) {
      const auto& t = type(p->type);
      if (!is_simple(p->type) && t.kind == RMP_TYPE_RECORD) {
        assign_record(*p, value);
        return;
      }
      const bool is_element = !p->index.empty();
      const std::string where = place_text(*p);
      (void)is_element;
      line(where + " = " + text(value));
      return;
    }
    // A part of a geometric value.
    const auto& x = expression(to);
    const auto operands = links(x.first, x.count);
    if (x.op != RMP_EXPR_FIELD) {
      cannot("assignments to this place", "Assign the whole.");
      return;
    }
    const std::uint32_t of = role(expression(operands[0]).type);
    std::uint32_t object = operands[0];
    const auto& inner = expression(object);
    if (of == RMP_ROLE_POSITION && inner.op == RMP_EXPR_FIELD &&
        role(expression(links(inner.first, inner.count)[0]).type) == RMP_ROLE_POSE)
      object = links(inner.first, inner.count)[0];
    if (of == RMP_ROLE_JOINT || of == RMP_ROLE_ROBTARGET ||
        role(expression(object).type) == RMP_ROLE_ROBTARGET) {
      if (x.symbol != 0) {
        cannot("status, turns and additional joints at run time", "Assign the pose only.");
        return;
      }
    }
    // PSE of a target and M_JOINT of joints are the whole itself there.
    for (int k = 0; k < 3; ++k) {
      const auto& y = expression(object);
      if (y.op != RMP_EXPR_FIELD || y.symbol != 0) break;
      const std::uint32_t outer = links(y.first, y.count)[0];
      if (role(expression(outer).type) != RMP_ROLE_ROBTARGET &&
          role(expression(outer).type) != RMP_ROLE_JOINT)
        break;
      object = outer;
    }
    const auto p = place(object);
    if (!p) {
      cannot("assignments to this place", "Assign the whole.");
      return;
    }
    const std::string where = place_text(*p);
    if (of == RMP_ROLE_JOINT || of == RMP_ROLE_ROBTARGET) {
      line(where + " = " + text(value));
      return;
    }
    if (of == RMP_ROLE_POSE) {
      const std::string v = text(value);
      line(where + " = " + helper("rmp_pose") + "(" +
           (x.symbol == 0 ? v + ", " + where : where + ", " + v) + ")");
      return;
    }
    if (of != RMP_ROLE_POSITION && of != RMP_ROLE_MAIN_JOINT) {
      cannot("assignments to parts of an orientation", "Assign the whole orientation.");
      return;
    }
    const std::string part =
        of == RMP_ROLE_POSITION ? within(expr(value), 7) + " / 1000.0" : "d2r(" + text(value) + ")";
    if (p->index.empty()) {
      line(where + "[" + std::to_string(x.symbol) + "] = " + part);
      return;
    }
    const std::string whole = names_.unique("rmp_whole");
    line(whole + " = " + where);
    line(whole + "[" + std::to_string(x.symbol) + "] = " + part);
    line(where + " = " + whole);
  }
  void assign_record(const Place& to, std::uint32_t value) {
    const auto from = place(value);
    const auto& v = expression(value);
    if (!from && v.op != RMP_EXPR_MAKE) {
      cannot("whole values of type " + type_name(to.type), "Assign its parts one by one.");
      return;
    }
    const auto& t = type(to.type);
    const auto parts = links(v.first, v.count);
    for (std::uint32_t k = 0; k < t.field_count; ++k) {
      Place a = to;
      const std::string tail = "_" + field_name(to.type, k);
      a.suffix += tail;
      a.type = field_row(t.first_field + k).type;
      if (!is_simple(a.type)) {
        cannot("whole values of type " + type_name(to.type), "Assign its parts one by one.");
        return;
      }
      if (!from) {
        line(place_text(a) + " = " + text(parts[k]));
        continue;
      }
      Place b = *from;
      b.suffix += tail;
      b.type = a.type;
      line(place_text(a) + " = " + place_text(b));
    }
  }

  // ---- expressions ----
  std::span<const Operator> operators() const override {
    static constexpr Operator kAll[] = {
        {RMP_EXPR_NEGATE, "-", 8, Operator::prefix},
        {RMP_EXPR_NOT, "not ", 4, Operator::prefix},
        {RMP_EXPR_ADD, " + ", 6},
        {RMP_EXPR_SUBTRACT, " - ", 6},
        {RMP_EXPR_MULTIPLY, " * ", 7},
        {RMP_EXPR_DIVIDE, " / ", 7},
        {RMP_EXPR_DIV, "rmp_div", 100, Operator::call},
        {RMP_EXPR_MOD, "rmp_mod", 100, Operator::call},
        {RMP_EXPR_EQUAL, " == ", 5},
        {RMP_EXPR_NOT_EQUAL, " != ", 5},
        {RMP_EXPR_LESS, " < ", 5},
        {RMP_EXPR_LESS_EQUAL, " <= ", 5},
        {RMP_EXPR_GREATER, " > ", 5},
        {RMP_EXPR_GREATER_EQUAL, " >= ", 5},
        {RMP_EXPR_AND, " and ", 3},
        {RMP_EXPR_OR, " or ", 1},
        {RMP_EXPR_EXOR, " xor ", 2},
    };
    return kAll;
  }
  const Operator* operation(const rmp_code_expression& e) override {
    const auto operands = links(e.first, e.count);
    for (const std::uint32_t o : operands) {
      const auto& t = type(expression(o).type);
      if (t.kind >= RMP_TYPE_TEXT) return nullptr;
      const bool is_text = t.kind == RMP_TYPE_STRING || t.kind == RMP_TYPE_CHAR;
      if (is_text && e.op != RMP_EXPR_EQUAL && e.op != RMP_EXPR_NOT_EQUAL) return nullptr;
      if (e.op == RMP_EXPR_EXOR && t.kind != RMP_TYPE_BOOL) return nullptr;
    }
    if (e.op == RMP_EXPR_DIV) helper("rmp_div");
    if (e.op == RMP_EXPR_MOD) helper("rmp_mod");
    if ((e.op == RMP_EXPR_AND || e.op == RMP_EXPR_OR) && matters(operands[1]))
      warn(
          "the right side of AND and OR may always be evaluated: URScript's manual does not "
          "specify it",
          "Nest IF statements if it must not be evaluated.");
    return Writer::operation(e);
  }
  /// Whether evaluating an expression does or refuses something.
  bool matters(std::uint32_t first) const {
    std::vector<std::uint32_t> open{first};
    while (!open.empty()) {
      const auto& x = expression(open.back());
      open.pop_back();
      if (x.constant != RMP_NONE) continue;
      if (x.op == RMP_EXPR_CALL || x.op == RMP_EXPR_INDEX || x.op == RMP_EXPR_DIVIDE ||
          x.op == RMP_EXPR_DIV || x.op == RMP_EXPR_MOD)
        return true;
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return false;
  }
  Text literal(const rmp_code_constant& k) override {
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_BOOL)
      return {k.integer ? "True" : "False"};
    return Writer::literal(k);
  }
  std::string real_literal(double v) override {
    // No exponents: the longest stay readable everywhere.
    if (std::fabs(v) >= 1e15 || (v != 0 && std::fabs(v) < 1e-9)) return lower(shortest(v));
    return trimmed(v, 12, 1);
  }
  Text string_literal(std::string_view s) override { return {"\"" + plain_text(s, '"') + "\""}; }
  Text convert(std::uint32_t operand, const rmp_code_expression& e) override {
    const std::uint32_t from = expression(operand).type;
    if (e.type == RMP_TYPE_REAL && from == RMP_TYPE_INT) {
      const Text t = expr(operand);
      return {within(t, 6) + " + 0.0", 6};
    }
    if (e.type == RMP_TYPE_STRING && from == RMP_TYPE_CHAR) return expr(operand);
    return Writer::convert(operand, e);
  }
  std::string pose_text(const Pose& p) {
    if (!usable(p)) return "p[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]";
    const Placed at = placed(p, Orientation::rotation_vector);
    const int length = std::max(3, static_cast<int>(profile_.length_digits)) + 3;
    const int angle = std::max(4, static_cast<int>(profile_.angle_digits)) + 2;
    std::string out = "p[";
    for (std::size_t i = 0; i < 3; ++i)
      out += (i ? ", " : "") + trimmed(at.mm[i] / 1000, length, 1);
    for (std::size_t i = 0; i < 3; ++i) out += ", " + trimmed(at.ori[i], angle, 1);
    return out + "]";
  }
  std::string joints_text(const PostPoint& p) {
    const auto v = checked_axes(p, 6);
    if (v.empty()) return "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]";
    std::string out = "[";
    for (std::size_t i = 0; i < v.size(); ++i)
      out += (i ? ", " : "") +
             trimmed(v[i] * kRadian, std::max(4, static_cast<int>(profile_.angle_digits)) + 2, 1);
    return out + "]";
  }
  std::optional<Text> known_point(const PostPoint& p, const rmp_code_expression&) override {
    if (is_joints(p.role)) {
      no_external(&p);
      return Text{joints_text(p)};
    }
    if (!p.has_pose) return std::nullopt;
    if (p.role == RMP_ROLE_ROBTARGET) no_external(&p);
    return Text{pose_text(p.pose)};
  }
  Text make(std::span<const std::uint32_t> o, const rmp_code_expression& e) override {
    switch (role(e.type)) {
      case RMP_ROLE_POSITION: {
        std::string out = "p[";
        for (const std::uint32_t x : o) {
          const auto v = known(x);
          out += (v ? trimmed(*v / 1000, 6, 1) : within(expr(x), 7) + " / 1000.0") + ", ";
        }
        return {out + "0.0, 0.0, 0.0]"};
      }
      case RMP_ROLE_POSE:
        return {std::string(helper("rmp_pose")) + "(" + text(o[0]) + ", " + text(o[1]) + ")"};
      case RMP_ROLE_MAIN_JOINT: {
        if (o.size() != 6) {
          cannot(std::to_string(o.size()) + " joints", "Its robots have 6.");
          return {"x"};
        }
        std::string out = "[";
        for (std::size_t i = 0; i < 6; ++i) out += (i ? ", d2r(" : "d2r(") + text(o[i]) + ")";
        return {out + "]"};
      }
      case RMP_ROLE_JOINT: return expr(o[0]);
      case RMP_ROLE_ROBTARGET:
        warn(
            "status and turns of a target computed at run time are not written: the robot keeps "
            "its present configuration",
            "Move to a known target first.");
        return expr(o[0]);
      default: break;
    }
    if (type(e.type).kind == RMP_TYPE_ARRAY && is_simple(type(e.type).element)) {
      std::string out = "[";
      for (std::size_t i = 0; i < o.size(); ++i) out += (i ? ", " : "") + text(o[i]);
      return {out + "]"};
    }
    return Writer::make(o, e);
  }
  Text compose(std::uint32_t a, std::uint32_t b, const rmp_code_expression& e) override {
    const std::string both = "pose_trans(" + text(a) + ", " + text(b) + ")";
    if (role(e.type) != RMP_ROLE_POSITION) return {both};
    return {std::string(helper("rmp_pose")) + "(" + both + ", p[0.0, 0.0, 0.0, 0.0, 0.0, 0.0])"};
  }
  Text call_function(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    calls_[in_routine_].push_back(r);
    return Writer::call_function(r, arguments);
  }
  Text intrinsic(std::string_view f, std::span<const std::uint32_t> a,
                 const rmp_code_expression& e) override {
    const auto t = [&](std::size_t i) { return text(a[i]); };
    for (const char* n : {"SIN", "COS", "TAN"})
      if (f == n) return {lower(f) + "(d2r(" + t(0) + "))"};
    for (const char* n : {"ASIN", "ACOS", "ATAN"})
      if (f == n) return {"r2d(" + lower(f) + "(" + t(0) + "))"};
    if (f == "ATAN2") return {"r2d(atan2(" + t(0) + ", " + t(1) + "))"};
    if (f == "SQRT") return {"sqrt(" + t(0) + ")"};
    if (f == "EXP") return {"pow(2.718281828459045, " + t(0) + ")"};
    if (f == "LN") return {"log(2.718281828459045, " + t(0) + ")"};
    if (f == "ABS") return {std::string(helper("rmp_abs")) + "(" + t(0) + ")"};
    if (f == "ROUND") return {std::string(helper("rmp_round")) + "(" + t(0) + ")"};
    if (f == "TRUNC") return {std::string(helper("rmp_trunc")) + "(" + t(0) + ")"};
    if (f == "FLOAT") return {within(expr(a[0]), 6) + " + 0.0", 6};
    if (f == "INV") return {"pose_inv(" + t(0) + ")"};
    if (f == "ORIMULT") return {"pose_trans(" + t(0) + ", " + t(1) + ")"};
    if (f == "ORIZYX" || f == "ORIRS") {
      // rpy2rotvec turns about x, y and z of the fixed axes, which is Rz Ry Rx.
      const bool is_zyx = f == "ORIZYX";
      return {std::string(helper("rmp_rpy")) + "(" + t(is_zyx ? 2 : 0) + ", " + t(1) + ", " +
              t(is_zyx ? 0 : 2) + ")"};
    }
    if (f == "ORIXYZ") {
      helper("rmp_rpy");
      return {"pose_trans(rmp_rpy(" + t(0) + ", 0.0, 0.0), pose_trans(rmp_rpy(0.0, " + t(1) +
              ", 0.0), rmp_rpy(0.0, 0.0, " + t(2) + ")))"};
    }
    if (f == "TRAFO") return {"get_forward_kin(" + t(0) + ")"};
    if (f == "TRAFOINV") return {"get_inverse_kin(" + t(0) + ")"};
    if (f == "CONCAT") return {"str_cat(" + t(0) + ", " + t(1) + ")"};
    if (f == "LENGTH") return {"str_len(" + t(0) + ")"};
    if (f == "LOCATE") return {"str_find(" + t(0) + ", " + t(1) + ") + 1", 6};
    if (f == "EXTRACT") return {"str_sub(" + t(0) + ", " + less(a[1], 1) + ", " + t(2) + ")"};
    return Writer::intrinsic(f, a, e);
  }

  // ---- signals ----
  /// Whether it is one that the controller has.
  bool fits(const Signal& s) {
    const std::string kind = s.kind.empty() ? "standard" : s.kind;
    std::int64_t count = 0;
    if (s.type == RMP_TYPE_REAL) {
      count = kind == "register" ? 48 : kind == "standard" || kind == "tool" ? 2 : 0;
    } else {
      count = kind == "standard" || kind == "configurable" ? 8
              : kind == "tool"                             ? 2
              : kind == "register"                         ? (s.type == RMP_TYPE_BOOL ? 128 : 48)
                                                           : 0;
    }
    if (count == 0) {
      fail("\"" + kind + "\" is not a signal kind of URScript",
           "Give the profile standard, configurable, tool or register.");
      return false;
    }
    const bool bits = s.type == RMP_TYPE_INT && kind != "register";
    const std::int64_t last = s.number + (bits ? s.width : 1) - 1;
    if (s.number >= 0 && last < count) return true;
    fail("signal " + std::to_string(s.number < 0 ? s.number : last) + " is not one of the " +
             std::to_string(count) + " " + kind + " signals of the controller, numbered from 0",
         "Map it in the profile: a number, and standard, configurable, tool or register as kind.");
    return false;
  }
  static std::string kind_of(const Signal& s) { return s.kind.empty() ? "standard" : s.kind; }
  void set_output(const Signal& s, std::uint32_t value) override {
    if (!fits(s)) return;
    const std::string n = std::to_string(s.number), kind = kind_of(s);
    std::string v = text(value);
    if (s.inverted) {
      if (s.type != RMP_TYPE_BOOL) {
        fail("an inverted signal must be BOOL", "Remove inverted from the profile.");
        return;
      }
      v = v == "True" ? "False" : v == "False" ? "True" : "not (" + v + ")";
    }
    if (kind == "register") {
      line("write_output_" +
           std::string(s.type == RMP_TYPE_BOOL  ? "boolean"
                       : s.type == RMP_TYPE_INT ? "integer"
                                                : "float") +
           "_register(" + n + ", " + v + ")");
    } else if (s.type == RMP_TYPE_REAL) {
      if (kind != "standard") cannot("analogue outputs of this kind", "Use standard or register.");
      else line("set_standard_analog_out(" + n + ", " + v + ")");
    } else if (s.type == RMP_TYPE_BOOL) {
      line("set_" + kind + "_digital_out(" + n + ", " + v + ")");
    } else {
      if (const auto k = known(value); k && (*k < 0 || *k >= std::pow(2.0, s.width))) {
        fail("the value " + trimmed(*k, 0) + " does not fit into " + std::to_string(s.width) +
                 " signals",
             "Widen the signal or make the value smaller.");
        return;
      }
      helpers_.insert("out_" + kind);
      line("rmp_write_" + kind + "(" + n + ", " + std::to_string(s.width) + ", " + v + ")");
    }
  }
  Text read(const Signal& s, const char* way) {
    if (!fits(s)) return {"False"};
    const std::string n = std::to_string(s.number), kind = kind_of(s);
    Text out;
    if (kind == "register")
      out = {"read_" + std::string(way) + "put_" +
             (s.type == RMP_TYPE_BOOL  ? "boolean"
              : s.type == RMP_TYPE_INT ? "integer"
                                       : "float") +
             "_register(" + n + ")"};
    else if (s.type == RMP_TYPE_REAL) out = {"get_" + kind + "_analog_" + way + "(" + n + ")"};
    else if (s.type == RMP_TYPE_BOOL) out = {"get_" + kind + "_digital_" + way + "(" + n + ")"};
    else {
      helpers_.insert("read_" + kind + way);
      out = {"rmp_read_" + kind + "_" + way + "(" + n + ", " + std::to_string(s.width) + ")"};
    }
    if (s.inverted && s.type == RMP_TYPE_BOOL) return {"not " + out.text, 4};
    return out;
  }
  Text input(const Signal& s) override { return read(s, "in"); }
  Text output(const Signal& s) override { return read(s, "out"); }

  // ---- statements ----
  void call(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    calls_[in_routine_].push_back(r);
    line(routine_name(r) + "(" + list(arguments) + ")");
  }
  void intrinsic_call(std::string_view f, std::span<const std::uint32_t> a) override {
    if (f == "ACQUIRE") {
      const auto p = place(a[0]);
      if (!p) return cannot("such semaphore");
      const std::string s = place_text(*p);
      line("enter_critical");
      open("while " + s + " <= 0:");
      line("exit_critical");
      line("sync()");
      line("enter_critical");
      close("end");
      line(s + " = " + s + " - 1");
      line("exit_critical");
      return;
    }
    if (f == "RELEASE") {
      const auto p = place(a[0]);
      if (!p) return cannot("such semaphore");
      const std::string s = place_text(*p);
      line("enter_critical");
      line(s + " = " + s + " + 1");
      line("exit_critical");
      return;
    }
    Writer::intrinsic_call(f, a);
  }
  void message(std::span<const std::uint32_t> values, bool ends_line) override {
    if (!ends_line) note("WRITE becomes a separate log entry: URScript has no partial lines");
    if (values.empty()) {
      line("textmsg(\"\")");
      return;
    }
    std::string all;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::uint32_t t = expression(values[i]).type;
      if (!is_simple(t)) {
        cannot("texts of values of type " + type_name(t), "Write its parts one by one.");
        return;
      }
      const bool is_text = t == RMP_TYPE_STRING || t == RMP_TYPE_CHAR;
      std::string one = text(values[i]);
      if (!is_text) one = "to_str(" + one + ")";
      all = i == 0 ? one : "str_cat(" + all + ", " + one + ")";
    }
    line("textmsg(" + all + ")");
  }
  void if_begin(std::uint32_t c) override { open("if " + text(c) + ":"); }
  void else_if(std::uint32_t c) override { middle("elif " + text(c) + ":"); }
  void else_() override { middle("else:"); }
  void if_end() override { close("end"); }
  void while_begin(std::uint32_t c) override { open("while " + text(c) + ":"); }
  void while_end() override { close("end"); }
  void loop_begin() override { open("while True:"); }
  void loop_end() override { close("end"); }
  void repeat_begin() override { open("while True:"); }
  void repeat_end(std::uint32_t until) override {
    open("if " + text(until) + ":");
    line("break");
    close("end");
    close("end");
  }
  void exit_loop() override { line("break"); }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    const std::string i = name(s);
    // The bounds are computed once, before the variable changes.
    const auto once = [&](std::uint32_t e, const char* wish) {
      if (e == RMP_NONE) return std::string("1");
      if (known(e)) return within(expr(e), 6);
      const std::string n = names_.unique(wish);
      line(n + " = " + text(e));
      return n;
    };
    if (step != RMP_NONE && known(step).value_or(1) <= 0)
      fail("the step of this loop is not positive", "Use DOWNTO to count downwards.");
    const std::string end = once(to, "rmp_to"), by = once(step, "rmp_step");
    line(i + " = " + text(from));
    open("while " + i + (down ? " >= " : " <= ") + end + ":");
    steps_.push_back(i + " = " + i + (down ? " - " : " + ") + by);
  }
  void for_end(std::uint32_t) override {
    if (!steps_.empty()) {
      line(steps_.back());
      steps_.pop_back();
    }
    close("end");
  }
  void case_begin(std::uint32_t selector) override {
    std::string n = names_.unique("rmp_case");
    line(n + " = " + text(selector));
    cases_.push_back({std::move(n), true});
  }
  void case_when(std::span<const std::uint32_t> labels) override {
    std::string c;
    for (std::size_t i = 0; i < labels.size(); ++i)
      c += (i ? " or " : "") + cases_.back().first + " == " + within(expr(labels[i]), 6);
    if (cases_.back().second) open("if " + c + ":");
    else middle("elif " + c + ":");
    cases_.back().second = false;
  }
  void case_default() override {
    if (cases_.back().second) open("if True:");
    else middle("else:");
    cases_.back().second = false;
  }
  void case_end() override {
    if (!cases_.back().second) close("end");
    cases_.pop_back();
  }
  void return_(std::uint32_t value) override {
    if (in_routine_ == 0) line("halt");
    else line("return " + (value == RMP_NONE ? std::string("0") : text(value)));
  }
  void wait_time(std::uint32_t seconds) override {
    if (const auto v = known(seconds); v && !(*v >= 0 && *v <= 1e6)) {
      fail("a wait of " + shortest(*v) + " s", "Give a time from 0 to 1000000 s.");
      return;
    }
    line("sleep(" + text(seconds) + ")");
  }
  void wait_for(std::uint32_t condition, std::uint32_t timeout) override {
    const Text c = expr(condition);
    const std::string until = "not " + (c.binding < 100 ? "(" + c.text + ")" : c.text);
    if (timeout == RMP_NONE) {
      open("while " + until + ":");
      line("sync()");
      close("end");
      return;
    }
    const std::uint32_t flag = system_symbol("R_TIMEOUT");
    const bool told = flag != RMP_NONE && is_used(flag);
    const std::string t = names_.unique("rmp_waited");
    if (told) line(name(flag) + " = False");
    line(t + " = 0.0");
    open("while " + until + ":");
    open("if " + t + " >= " + within(expr(timeout), 6) + ":");
    if (told) line(name(flag) + " = True");
    line("break");
    close("end");
    line("sync()");
    line(t + " = " + t + " + get_steptime()");
    close("end");
  }
  void pause(std::uint32_t message) override {
    line("popup(" + (message == RMP_NONE ? std::string("\"PAUSE\"") : text(message)) +
         ", title=\"PAUSE\", warning=False, error=False, blocking=True)");
  }
  void halt() override { line("halt"); }
  void process(std::uint32_t op, std::uint32_t r, std::uint32_t priority) override {
    if (priority != RMP_NONE || routine(r).priority != RMP_NONE)
      warn("the priority of a process is not written: threads of URScript have none",
           "Remove PRIORITY.");
    const auto [it, is_new] = handles_.try_emplace(r);
    if (is_new) {
      it->second = names_.unique("rmp_handle");
      if (globals_.empty()) globals_.in();
      globals_.add("global " + it->second + " = 0", &at_);
    }
    calls_[in_routine_].push_back(r);
    if (op == RMP_STMT_START) line(it->second + " = run " + routine_name(r) + "()");
    else if (op == RMP_STMT_CANCEL) line("kill " + it->second);
    else
      cannot(op == RMP_STMT_STOP ? "STOP of a process" : "CONTINUE of a process",
             "Let the process wait for a variable (WAIT FOR), or CANCEL it.");
  }

  // ---- motions ----
  std::string scaled(const Motion& m, std::uint32_t a, const char* name, double factor,
                     double otherwise, double least) {
    if (m[a].known) {
      const auto v = number_of(m, a, name, least);
      return trimmed(v ? *v * factor : otherwise, 6, 1);
    }
    if (m[a].expression == RMP_NONE) return trimmed(otherwise, 6, 1);
    // Reals that are asked for in parts of the target's unit.
    const double divisor = 1 / factor;
    const bool whole = std::fabs(divisor - std::round(divisor)) < 1e-9;
    return within(expr(m[a].expression), 7) +
           (whole ? " / " + trimmed(divisor, 1, 1) : " * " + trimmed(factor, 9, 1));
  }
  std::string dynamics(const Motion& m, bool is_ptp) {
    std::string out;
    if (has_time(m)) {
      if (m[RMP_ATTR_TIME].known) {
        const auto t = time_of(m);
        out = ", t=" + trimmed(t.value_or(1), 4, 1);
      } else if (m[RMP_ATTR_TIME].given) {
        out = ", t=" + text(m[RMP_ATTR_TIME].expression);
      } else {
        fail("R_MOVE_TIME is assigned at run time, where -1 would mean no time",
             "Give TIME at the motions.");
      }
      return ", a=" + trimmed(is_ptp ? joint_acceleration_ * kRadian : acceleration_ / 1000, 6, 1) +
             ", v=" + trimmed(is_ptp ? joint_speed_ * kRadian : 0.25, 6, 1) + out;
    }
    if (is_ptp) {
      const std::uint32_t acc = m[RMP_ATTR_ACC_PTP].given ? RMP_ATTR_ACC_PTP
                                : m[RMP_ATTR_ACC].given   ? RMP_ATTR_ACC
                                                          : RMP_ATTR_ACC_PTP;
      return ", a=" +
             scaled(m, acc, "the acceleration", joint_acceleration_ * kRadian / 100,
                    joint_acceleration_ * kRadian, 0.01) +
             ", v=" +
             scaled(m, RMP_ATTR_SPEED_PTP, "SPEED_PTP", joint_speed_ * kRadian / 100,
                    joint_speed_ * kRadian, 0.01);
    }
    return ", a=" +
           scaled(m, RMP_ATTR_ACC, "ACC", acceleration_ / 100'000, acceleration_ / 1000, 0.01) +
           ", v=" + scaled(m, RMP_ATTR_SPEED, "SPEED", 0.001, 0.25, 0.001);
  }
  /// Text of the blend, and its number where it is known [mm].
  std::pair<std::string, double> blend(const Motion& m, bool is_ptp) {
    if (m.until != RMP_NONE) {
      const std::uint32_t a = is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP;
      if (m[a].given && m[a].known.value_or(1) != 0)
        warn("a motion with UNTIL is not blended", "Remove C_CP and C_PTP.");
      return {};
    }
    const std::uint32_t a = is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP;
    double r = 0;
    if (m[a].known) {
      r = number_of(m, a, is_ptp ? "C_PTP" : "C_CP", 0).value_or(0);
    } else if (m[a].expression != RMP_NONE) {
      if (!is_ptp) return {", r=" + within(expr(m[a].expression), 7) + " / 1000.0", 0};
      return {
          ", r=" + within(expr(m[a].expression), 7) + " * " + trimmed(ptp_radius_ / 100'000, 9, 1),
          0};
    }
    if (is_ptp && r > 0) {
      const double radius = ptp_radius_ * r / 100;
      note("C_PTP of " + trimmed(r, 2) + " % is written as a blend radius of " +
               trimmed(radius, 2) + " mm",
           "The profile's option ptp_radius sets the radius for 100 %.");
      r = radius;
    }
    if (m[RMP_ATTR_C_PASS].known.value_or(0) != 0 && r == 0)
      warn("C_PASS without a distance is written as a stop: URScript blends by a radius only",
           "Give C_CP or C_PTP.");
    if (r == 0) return {};
    return {"r", r};
  }
  void tool(const Motion& m) {
    if (common_tool_) return;
    std::string wanted;
    if (m[RMP_ATTR_TOOL].given) {
      wanted = text(m[RMP_ATTR_TOOL].expression);
    } else if (profile_.tool >= 0 &&
               static_cast<std::size_t>(profile_.tool) < profile_.tools.size()) {
      wanted = pose_text(profile_.tools[static_cast<std::size_t>(profile_.tool)].pose);
    } else {
      if (had_tool_)
        fail("this motion has no TOOL, an earlier one has, and the initial tool is unknown",
             "Give it a TOOL, or set the initial tool in the profile.");
      return;
    }
    had_tool_ = had_tool_ || m[RMP_ATTR_TOOL].given;
    if (!tool_.changes(wanted)) return;
    line("set_tcp(" + wanted + ")");
    const PostPoint* p = m[RMP_ATTR_TOOL].given ? point(m[RMP_ATTR_TOOL].expression) : nullptr;
    for (const PostPlace& t : profile_.tools)
      if (p && p->has_pose && same_place(t.pose, p->pose)) payload(t);
  }
  /// What the motion goes to, as a pose or joints there; empty = said.
  std::string target(const Motion& m, const Target& t, bool is_ptp) {
    if (t.role == RMP_ROLE_ADD_JOINT) {
      cannot("additional joints", "Drive them with an OUTPUT or with their own controller.");
      return {};
    }
    if (m.incremental) {
      if (is_joints(t.role)) {
        cannot("increments of joints", "Give joints, or an increment of the pose.");
        return {};
      }
      // Positions are added, and the increment's rotation stands in front: the base's axes.
      if (!m[RMP_ATTR_FRAME].given)
        return "pose_add(" + text(t.expression) + ", get_target_tcp_pose())";
      const auto by = step(m, t);
      if (!by) {
        cannot("computed increments in a frame", "Give them in the base's axes.");
        return {};
      }
      return "pose_add(" + pose_text(*by) + ", get_target_tcp_pose())";
    }
    if (is_joints(t.role)) {
      if (m[RMP_ATTR_FRAME].given) note("FRAME has no meaning for joints and is not written");
      return text(t.expression);
    }
    std::string pose;
    if (t.role == RMP_ROLE_POSITION) {
      const auto at = goal(m, t);
      if (at && usable(*at)) pose = pose_text(*at);
      else pose = std::string(helper("rmp_pose")) + "(" + framed(m, t) + ", get_target_tcp_pose())";
    } else {
      pose = framed(m, t);
    }
    if (!is_ptp || !t.point || !t.point->has_status) return pose;
    if (t.point->q.empty()) {
      warn("the status of this target is not written: the robot keeps its present configuration",
           "Name the robot: program.post{robot = ...}.");
      return pose;
    }
    return "get_inverse_kin(" + pose + ", qnear=" + joints_text(*t.point) + ")";
  }
  std::string framed(const Motion& m, const Target& t) {
    if (t.point && t.role == RMP_ROLE_ROBTARGET) no_external(t.point);
    if (!m[RMP_ATTR_FRAME].given) return text(t.expression);
    if (const auto at = goal(m, t)) return pose_text(*at);
    return "pose_trans(" + text(m[RMP_ATTR_FRAME].expression) + ", " + text(t.expression) + ")";
  }
  void ptp(const Motion& m) override { simple(m, true); }
  void lin(const Motion& m) override { simple(m, false); }
  void simple(const Motion& m, bool is_ptp) {
    if (!plain(m) || m.targets.size() != 1) return;
    const Target& t = m.targets[0];
    if (!is_ptp && is_joints(t.role)) note("LIN to joint values: the line leads to their pose");
    if (!is_ptp && m[RMP_ATTR_SPEED_ORI].given)
      warn("SPEED_ORI is not written: URScript rotates the tool with the path",
           "Give TIME, or a lower SPEED.");
    tool(m);
    const std::string to = target(m, t, is_ptp);
    if (to.empty()) return;
    const auto at = goal(m, t);
    emit(m, is_ptp ? "movej(" : "movel(", to, is_ptp, at, at, "");
    arrived(m.until == RMP_NONE ? at : std::nullopt);
  }
  void circle(const Motion& m) override {
    if (!plain(m) || m.targets.size() != 2) return;
    for (const Target& t : m.targets)
      if (is_joints(t.role) || t.role == RMP_ROLE_ADD_JOINT || m.incremental) {
        cannot("circles through increments or joints", "Give poses.");
        return;
      }
    if (m[RMP_ATTR_SPEED_ORI].given)
      warn("SPEED_ORI is not written: URScript rotates the tool with the path",
           "Give a lower SPEED.");
    if (has_time(m)) {
      cannot("TIME of circles", "Give SPEED.");
      return;
    }
    tool(m);
    const std::string via = target(m, m.targets[0], false), to = target(m, m.targets[1], false);
    const auto at = goal(m, m.targets[1]);
    emit(m, "movec(", via + ", " + to, false, goal(m, m.targets[0]), at, ", mode=0");
    arrived(m.until == RMP_NONE ? at : std::nullopt);
  }
  /// Blends that the next motion may shorten.
  struct Radius {
    std::size_t line = 0;
    std::string head, tail;
    double r = 0;
    rmp_span span{};
    std::optional<Pose> at;
  };
  static double distance(const Pose& a, const Pose& b) {
    return 1000 * std::hypot(a.p[0] - b.p[0], a.p[1] - b.p[1], a.p[2] - b.p[2]);
  }
  /// A blend takes at most half of the way before and behind it.
  void shorten(Radius& x, double way) {
    const double most = std::floor(way / 2 * 1000) / 1000;
    if (x.r <= most) return;
    const rmp_span here = at_;
    at_ = x.span;
    warn("the blend radius of " + trimmed(x.r, 3) + " mm is written as " + trimmed(most, 3) +
             " mm: half the distance to the next target",
         "Give a smaller C_CP or C_PTP.");
    at_ = here;
    x.r = most;
    const std::size_t indent = out_->lines()[x.line].find_first_not_of(' ');
    out_->lines()[x.line] = std::string(indent, ' ') + x.head + radius_text(x.r) + x.tail;
  }
  static std::string radius_text(double r) { return r > 0 ? ", r=" + trimmed(r / 1000, 6, 1) : ""; }
  void emit(const Motion& m, const char* word, const std::string& to, bool is_ptp,
            const std::optional<Pose>& first, const std::optional<Pose>& at,
            const std::string& tail) {
    const auto [said, r] = blend(m, is_ptp);
    const std::string head = word + to + dynamics(m, is_ptp);
    if (!radii_.empty() && first && radii_.back().at)
      shorten(radii_.back(), distance(*first, *radii_.back().at));
    if (m.until != RMP_NONE) {
      until(m, head + tail + ")", is_ptp);
      radii_.clear();
      return;
    }
    if (said != "r") {
      line(head + said + tail + ")");
      radii_.clear();
      return;
    }
    Radius x;
    x.line = out_->size();
    x.head = head;
    x.tail = tail + ")";
    x.r = r;
    x.span = at_;
    x.at = at;
    line(head + radius_text(r) + x.tail);
    if (last() && at) shorten(x, distance(*last(), tail.empty() ? *at : *first));
    radii_.assign(1, std::move(x));
  }
  /// The motion runs in a thread, which is ended by the condition.
  void until(const Motion& m, const std::string& move, bool is_ptp) {
    const std::string thread = names_.unique("rmp_move"), handle = names_.unique("rmp_moves"),
                      moving = names_.unique("rmp_moving");
    if (globals_.empty()) globals_.in();
    globals_.add("global " + moving + " = False", &at_);
    // What the motion is made of is computed here: a thread does not see variables of a routine.
    std::string in_thread = move;
    if (uses_locals(m)) {
      cannot("UNTIL in a routine with targets, speeds or times that use its local variables",
             "Use variables of the program, or constants.");
      return;
    }
    if (threads_.empty()) threads_.in();
    threads_.add("thread " + thread + "():", &at_);
    threads_.in();
    threads_.add(in_thread, &at_);
    threads_.add(moving + " = False", &at_);
    threads_.out();
    threads_.add("end", &at_);
    line(moving + " = True");
    line(handle + " = run " + thread + "()");
    open("while " + moving + ":");
    open("if " + text(m.until) + ":");
    line("kill " + handle);
    line(is_ptp ? "stopj(" + trimmed(joint_acceleration_ * kRadian, 6, 1) + ")"
                : "stopl(" + trimmed(acceleration_ / 1000, 6, 1) + ")");
    line(moving + " = False");
    if (m.action != RMP_NONE) {
      calls_[in_routine_].push_back(m.action);
      line(routine_name(m.action) + "()");
    }
    close("else:");
    out_->in();
    line("sync()");
    close("end");
    close("end");
  }
  bool uses_locals(const Motion& m) const {
    std::vector<std::uint32_t> open;
    for (const Target& t : m.targets) open.push_back(t.expression);
    for (const Attribute& a : m.attributes)
      if (!a.known) open.push_back(a.expression);
    while (!open.empty()) {
      const std::uint32_t e = open.back();
      open.pop_back();
      if (e == RMP_NONE || point(e)) continue;
      const auto& x = expression(e);
      if (x.constant != RMP_NONE) continue;
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE) {
        const auto& s = symbol(x.symbol);
        if (s.kind == RMP_SYMBOL_PARAMETER ||
            (s.kind == RMP_SYMBOL_VARIABLE && s.routine != RMP_NONE && s.routine != 0))
          return true;
      }
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return false;
  }
  void forget() override {
    MoveWriter::forget();
    radii_.clear();
    tool_.forget();
  }

  double acceleration_ = 1200, joint_acceleration_ = 80, joint_speed_ = 60, ptp_radius_ = 50;
  File globals_{2}, threads_{2};
  std::deque<File> texts_;
  std::vector<std::vector<std::uint32_t>> calls_;
  std::set<std::string, std::less<>> helpers_;
  std::map<std::pair<std::uint32_t, std::string>, std::string> parts_;
  std::map<std::uint32_t, std::string> handles_;
  std::vector<std::string> steps_;
  std::vector<std::pair<std::string, bool>> cases_;
  std::vector<Radius> radii_;
  Modal<std::string> tool_;
  bool had_tool_ = false, common_tool_ = false;
};

}  // namespace

const PostCapabilities& UrScript::capabilities() const {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostFunctions | kPostParameters | kPostLocals | kPostIntegers |
                 kPostReals | kPostBooleans | kPostStrings | kPostArrays | kPostRecords |
                 kPostPoses | kPostPoseProduct | kPostJointValues | kPostFunctionsOfMath | kPostIf |
                 kPostElsif | kPostWhile | kPostRepeat | kPostLoop | kPostExit | kPostFor |
                 kPostForStep | kPostCase | kPostReturn | kPostProcesses | kPostWaitFor |
                 kPostWaitTimeout | kPostUntil | kPostVariableTargets | kPostVariableAttributes |
                 kPostMessages | kPostPause | kPostOutputsAreRead | kPostTools | kPostFrames |
                 kPostTime;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostLinJoints | kPostCircle |
                kPostPtpIncrement | kPostLinIncrement;
    c.circle = PostCircle::via;
    c.blending = PostBlending::radius;
    c.speed = PostSpeed::m_per_s;
    c.max_name = 60;
    c.case_matters = true;
    c.charset = PostCharset::ascii;
    c.reserved =
        "and break continue def elif else end enter_critical exit_critical False global goto halt "
        "if join kill local not or return run sec sleep struct switch case default sync thread "
        "True while xor pi p movej movel movec movep stopj stopl pose_trans pose_inv pose_add "
        "set_tcp set_payload get_inverse_kin get_forward_kin get_target_tcp_pose textmsg popup "
        "to_str str_cat str_len str_at str_find str_sub d2r r2d rpy2rotvec get_steptime sin cos "
        "tan asin acos atan atan2 sqrt pow log ceil floor abs norm length size random "
        "rmp_pose rmp_at rmp_rpy rmp_div rmp_mod rmp_round rmp_trunc rmp_abs";
    c.extensions = "script";
    c.title = "URScript";
    return c;
  }();
  return kAll;
}

Result<void> UrScript::write(const PostTask& task, const Params&, PostOutput& output,
                             Progress& progress) const {
  UrWriter writer(task, output, capabilities(), progress);
  return writer.run();
}

}  // namespace robomosp::post
