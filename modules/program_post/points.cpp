// SPDX-License-Identifier: Apache-2.0
#include "program_post/points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/post_writer.h>

#include "kernel/text.h"
#include "program_post/carried.h"
#include "program_post/vectors.h"
#include "program_post/walk.h"
#include "robotics/rail.h"

namespace robomosp::program_post {
namespace {

using Numbers = std::shared_ptr<const std::vector<double>>;
constexpr std::size_t kMostSlots = 4096;  ///< of one value; longer ones are left to the run

double sine(double degrees) {
  const double r = std::fmod(degrees, 360.0);
  if (std::fmod(r, 90.0) == 0.0) {
    const int quarter = (static_cast<int>(r / 90.0) + 4) % 4;
    return quarter == 1 ? 1.0 : quarter == 3 ? -1.0 : 0.0;
  }
  return std::sin(r / post::kDegree);
}
double cosine(double degrees) { return sine(std::fmod(degrees, 360.0) + 90.0); }

Quaternion times(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
Quaternion about(std::size_t axis, double degrees) {
  Quaternion q{cosine(degrees / 2), 0, 0, 0};
  q[axis + 1] = sine(degrees / 2);
  return q;
}
std::optional<Quaternion> unit(Quaternion q) {
  double n = 0;
  for (const double x : q) n += x * x;
  if (!(n > 0) || !std::isfinite(n)) return std::nullopt;
  for (double& x : q) x /= std::sqrt(n);
  return q;
}
std::array<double, 3> turned(const Quaternion& q, const double* v) {
  const auto r = matrix(q);
  std::array<double, 3> out{};
  for (std::size_t i = 0; i < 3; ++i)
    out[i] = r[3 * i] * v[0] + r[3 * i + 1] * v[1] + r[3 * i + 2] * v[2];
  return out;
}

/// Values of expressions as numbers one behind the other, field by field.
class Values {
 public:
  explicit Values(const rmp_code& code) : c_(code) {
    slots();
    find_assigned();
    values_.resize(c_.expressions.count);
    // Operands come before what they are of; what a name stands for mostly does, too.
    for (int round = 0; round < 8 && pass(); ++round) {
    }
  }
  [[nodiscard]] const Numbers& operator[](std::uint32_t e) const { return values_[e]; }
  [[nodiscard]] std::size_t slots_of(std::uint32_t type) const { return slots_[type]; }

 private:
  [[nodiscard]] const rmp_code_expression& at(std::uint32_t e) const {
    return row<rmp_code_expression>(c_.expressions, e);
  }
  [[nodiscard]] const rmp_code_type& type(std::uint32_t t) const {
    return row<rmp_code_type>(c_.types, t);
  }
  [[nodiscard]] std::uint32_t operand(const rmp_code_expression& e, std::uint32_t k) const {
    return row<std::uint32_t>(c_.links, e.first + k);
  }
  /// 0 = a type whose values are not numbers, or too many.
  void slots() {
    slots_.assign(c_.types.count, 0);
    field_from_.assign(c_.fields.count, 0);
    for (std::uint32_t t = 0; t < c_.types.count; ++t) {
      const auto& x = type(t);
      std::size_t n = 0;
      if (x.kind == RMP_TYPE_INT || x.kind == RMP_TYPE_REAL || x.kind == RMP_TYPE_BOOL) n = 1;
      if (x.kind == RMP_TYPE_ARRAY) {
        const auto length = static_cast<std::uint64_t>(std::int64_t{x.upper} - x.lower + 1);
        if (slots_[x.element] > 0 && length <= kMostSlots) n = slots_[x.element] * length;
      }
      if (x.kind == RMP_TYPE_RECORD) {
        bool whole = true;
        for (std::uint32_t k = 0; k < x.field_count; ++k) {
          const std::size_t f = slots_[row<rmp_code_field>(c_.fields, x.first_field + k).type];
          field_from_[x.first_field + k] = n;
          whole = whole && f > 0;
          n += f;
        }
        if (!whole) n = 0;
      }
      slots_[t] = n <= kMostSlots ? n : 0;
    }
  }
  void assigned(std::uint32_t e) {
    while (e != RMP_NONE) {
      const auto& x = at(e);
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE) assigned_[x.symbol] = true;
      if ((x.op != RMP_EXPR_FIELD && x.op != RMP_EXPR_INDEX) || x.count == 0) return;
      e = operand(x, 0);
    }
  }
  void find_assigned() {
    assigned_.assign(c_.symbols.count, false);
    for (std::uint32_t i = 0; i < c_.statements.count; ++i) {
      const auto& s = row<rmp_code_statement>(c_.statements, i);
      if (s.op == RMP_STMT_ASSIGN) assigned(s.a);
      if ((s.op == RMP_STMT_FOR || s.op == RMP_STMT_FOR_DOWN || s.op == RMP_STMT_TEACH) &&
          s.symbol != RMP_NONE)
        assigned_[s.symbol] = true;
      // WAIT FOR sets it by itself.
      if (s.op == RMP_STMT_WAIT_FOR)
        for (std::uint32_t k = 0; k < c_.symbols.count && !timeout_known_; ++k)
          if (post::upper(row<rmp_code_symbol>(c_.symbols, k).name) == "R_TIMEOUT")
            assigned_[k] = true;
      timeout_known_ = timeout_known_ || s.op == RMP_STMT_WAIT_FOR;
    }
    for (std::uint32_t e = 0; e < c_.expressions.count; ++e) {
      const auto& x = at(e);
      if (x.op != RMP_EXPR_CALL && x.op != RMP_EXPR_INTRINSIC) continue;
      for (std::uint32_t k = 0; k < x.count; ++k) {
        bool is_out = x.op == RMP_EXPR_INTRINSIC;
        if (x.op == RMP_EXPR_CALL) {
          const std::uint32_t r = row<rmp_code_symbol>(c_.symbols, x.symbol).routine;
          if (r != RMP_NONE) {
            const auto& routine = row<rmp_code_routine>(c_.routines, r);
            if (k < routine.parameter_count)
              is_out =
                  row<rmp_code_symbol>(c_.symbols, routine.first_parameter + k).mode != RMP_MODE_IN;
          }
        }
        // Functions of the language read their arguments; its procedures have no value.
        if (x.op == RMP_EXPR_INTRINSIC && x.type != RMP_TYPE_VOID) is_out = false;
        if (is_out) assigned(operand(x, k));
      }
    }
  }
  bool pass() {
    bool changed = false;
    for (std::uint32_t e = 0; e < c_.expressions.count; ++e) {
      if (values_[e] || slots_[at(e).type] == 0) continue;
      values_[e] = value(at(e));
      changed = changed || values_[e];
    }
    return changed;
  }
  static Numbers make(std::vector<double> v) {
    for (const double x : v)
      if (!std::isfinite(x)) return nullptr;
    return std::make_shared<const std::vector<double>>(std::move(v));
  }
  Numbers part(const Numbers& of, std::size_t from, std::size_t count) const {
    if (!of || from + count > of->size()) return nullptr;
    const auto begin = of->begin() + static_cast<std::ptrdiff_t>(from);
    return make({begin, begin + static_cast<std::ptrdiff_t>(count)});
  }
  Numbers value(const rmp_code_expression& e) {
    if (e.constant != RMP_NONE) {
      const auto& k = row<rmp_code_constant>(c_.constants, e.constant);
      if (k.kind == RMP_CONSTANT_TEXT) return nullptr;
      return make({k.kind == RMP_CONSTANT_INT ? static_cast<double>(k.integer) : k.real});
    }
    const auto of = [&](std::uint32_t k) -> Numbers {
      return k < e.count ? values_[operand(e, k)] : nullptr;
    };
    switch (e.op) {
      case RMP_EXPR_SYMBOL: {
        if (e.symbol == RMP_NONE) return nullptr;
        const auto& s = row<rmp_code_symbol>(c_.symbols, e.symbol);
        if ((s.kind != RMP_SYMBOL_CONSTANT && s.kind != RMP_SYMBOL_VARIABLE) || assigned_[e.symbol])
          return nullptr;
        if (s.value == RMP_NONE) return make(std::vector<double>(slots_[e.type], 0.0));
        return values_[s.value];
      }
      case RMP_EXPR_FIELD: {
        const auto& t = type(at(operand(e, 0)).type);
        if (t.kind != RMP_TYPE_RECORD || e.symbol >= t.field_count) return nullptr;
        return part(of(0), field_from_[t.first_field + e.symbol], slots_[e.type]);
      }
      case RMP_EXPR_INDEX: {
        const auto& t = type(at(operand(e, 0)).type);
        if (t.kind != RMP_TYPE_ARRAY || !of(0) || !of(1)) return nullptr;
        const double i = of(1)->front() - t.lower;
        if (i < 0 || i > double(t.upper) - t.lower) return nullptr;
        return part(of(0), static_cast<std::size_t>(i) * slots_[e.type], slots_[e.type]);
      }
      case RMP_EXPR_MAKE: {
        std::vector<double> all;
        for (std::uint32_t k = 0; k < e.count; ++k) {
          if (!of(k)) return nullptr;
          all.insert(all.end(), of(k)->begin(), of(k)->end());
        }
        return all.size() == slots_[e.type] ? make(std::move(all)) : nullptr;
      }
      case RMP_EXPR_CONVERT: return of(0) && of(0)->size() == slots_[e.type] ? of(0) : nullptr;
      case RMP_EXPR_NEGATE: return of(0) && of(0)->size() == 1 ? make({-of(0)->front()}) : nullptr;
      case RMP_EXPR_ADD:
      case RMP_EXPR_SUBTRACT:
      case RMP_EXPR_MULTIPLY:
      case RMP_EXPR_DIVIDE: {
        if (!of(0) || !of(1) || of(0)->size() != of(1)->size()) return nullptr;
        const bool is_int = e.type == RMP_TYPE_INT;
        std::vector<double> out;
        for (std::size_t i = 0; i < of(0)->size(); ++i) {
          const double a = (*of(0))[i], b = (*of(1))[i];
          if (e.op == RMP_EXPR_DIVIDE && b == 0) return nullptr;
          out.push_back(e.op == RMP_EXPR_ADD        ? a + b
                        : e.op == RMP_EXPR_SUBTRACT ? a - b
                        : e.op == RMP_EXPR_MULTIPLY ? a * b
                                                    : a / b);
          if (is_int && std::fabs(out.back()) > 2147483647.0) return nullptr;
        }
        if (out.size() > 1 && type(e.type).role != RMP_ROLE_POSITION) return nullptr;
        return make(std::move(out));
      }
      case RMP_EXPR_COMPOSE: return compose(e, of(0), of(1));
      case RMP_EXPR_INTRINSIC: return intrinsic(e, of);
      default: return nullptr;
    }
  }
  Numbers compose(const rmp_code_expression& e, const Numbers& a, const Numbers& b) {
    if (!a || !b) return nullptr;
    const std::uint32_t left = type(at(operand(e, 0)).type).role;
    const std::uint32_t right = type(at(operand(e, 1)).type).role;
    const auto ori = [](const Numbers& n, std::size_t i) {
      return unit({(*n)[i], (*n)[i + 1], (*n)[i + 2], (*n)[i + 3]});
    };
    if (left == RMP_ROLE_ORIENTATION) {
      const auto q = ori(a, 0);
      if (!q) return nullptr;
      if (right == RMP_ROLE_POSITION) {
        const auto v = turned(*q, b->data());
        return make({v[0], v[1], v[2]});
      }
      const auto p = ori(b, 0);
      if (!p) return nullptr;
      const auto out = times(*q, *p);
      return make({out.begin(), out.end()});
    }
    if (left != RMP_ROLE_POSE) return nullptr;
    const auto q = ori(a, 3);
    if (!q) return nullptr;
    const auto v = turned(*q, b->data());
    std::vector<double> out{v[0] + (*a)[0], v[1] + (*a)[1], v[2] + (*a)[2]};
    if (right == RMP_ROLE_POSE) {
      const auto p = ori(b, 3);
      if (!p) return nullptr;
      const auto r = times(*q, *p);
      out.insert(out.end(), r.begin(), r.end());
    } else if (right != RMP_ROLE_POSITION) {
      return nullptr;
    }
    return make(std::move(out));
  }
  template <class Of>
  Numbers intrinsic(const rmp_code_expression& e, const Of& of) {
    const std::string name = post::upper(row<rmp_code_symbol>(c_.symbols, e.symbol).name);
    for (std::uint32_t k = 0; k < e.count; ++k)
      if (!of(k)) return nullptr;
    const auto x = [&](std::uint32_t k) { return of(k)->front(); };
    const auto quat = [](const std::optional<Quaternion>& q) {
      return q ? make({q->begin(), q->end()}) : nullptr;
    };
    const auto three = [&](std::size_t a, std::size_t b, std::size_t c) {
      return quat(times(times(about(a, x(0)), about(b, x(1))), about(c, x(2))));
    };
    const auto vector = [&](std::uint32_t k, std::size_t i) { return (*of(k))[i]; };
    if (name == "ORIXYZ") return three(0, 1, 2);
    if (name == "ORIYXZ") return three(1, 0, 2);
    if (name == "ORIZYX") return three(2, 1, 0);
    if (name == "ORIZYZ2") return three(2, 1, 2);
    if (name == "ORIRS") return quat(times(times(about(2, x(2)), about(1, x(1))), about(0, x(0))));
    if (name == "ORIQUAT") return quat(unit({x(0), x(1), x(2), x(3)}));
    if (name == "ORIVANG") {
      const double n = std::hypot(vector(0, 0), vector(0, 1), vector(0, 2));
      if (!(n > 0)) return nullptr;
      const double s = sine(x(1) / 2) / n;
      return quat(unit({cosine(x(1) / 2), s * vector(0, 0), s * vector(0, 1), s * vector(0, 2)}));
    }
    if (name == "ORIMAT") {
      std::array<double, 9> r{};
      for (std::uint32_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i) r[3 * i + k] = vector(k, i);
      return quat(post::quaternion(r));
    }
    if (name == "ORIMULT") {
      const Quaternion a{vector(0, 0), vector(0, 1), vector(0, 2), vector(0, 3)};
      const Quaternion b{vector(1, 0), vector(1, 1), vector(1, 2), vector(1, 3)};
      return quat(times(a, b));
    }
    if (name == "INV") {
      const auto q = unit({vector(0, 3), -vector(0, 4), -vector(0, 5), -vector(0, 6)});
      if (!q) return nullptr;
      const auto v = turned(*q, of(0)->data());
      return make({-v[0], -v[1], -v[2], (*q)[0], (*q)[1], (*q)[2], (*q)[3]});
    }
    if (name == "CROSS")
      return make({vector(0, 1) * vector(1, 2) - vector(0, 2) * vector(1, 1),
                   vector(0, 2) * vector(1, 0) - vector(0, 0) * vector(1, 2),
                   vector(0, 0) * vector(1, 1) - vector(0, 1) * vector(1, 0)});
    if (name == "VECTORN" || name == "VECTORO" || name == "VECTORA") {
      const auto q = unit({vector(0, 0), vector(0, 1), vector(0, 2), vector(0, 3)});
      if (!q) return nullptr;
      const std::size_t k = name == "VECTORN" ? 0 : name == "VECTORO" ? 1 : 2;
      const auto r = matrix(*q);
      return make({r[k], r[3 + k], r[6 + k]});
    }
    if (name == "SIN") return make({sine(x(0))});
    if (name == "COS") return make({cosine(x(0))});
    if (name == "FLOAT") return make({x(0)});
    return nullptr;
  }

  const rmp_code& c_;
  std::vector<std::size_t> slots_;
  std::vector<std::size_t> field_from_;  ///< by field: numbers before it in its record
  std::vector<bool> assigned_;
  bool timeout_known_ = false;
  std::vector<Numbers> values_;
};

class Finder {
 public:
  Finder(const rmp_code& code, const RobotModel* robot, const PostKinematics* kinematics,
         std::span<const double> start, const Pose& default_tool, std::span<const PostAxis> axes,
         const Carrier* carrier)
      : c_(code),
        robot_(robot),
        kinematics_(kinematics),
        values_(code),
        default_tool_(default_tool),
        carrier_(carrier) {
    turns_from_ = turns_from(code);
    if (counts_maker_axes(code)) axes_ = axes;
    for (std::uint32_t t = 0; t < code.types.count; ++t)
      if (row<rmp_code_type>(code.types, t).role == RMP_ROLE_MAIN_JOINT)
        joints_ = values_.slots_of(t);
    last_.assign(start.begin(), start.end());
    if (robot_ && last_.size() != robot_->coordinate_count())
      last_.assign(robot_->coordinate_count(), 0.0);
  }
  KnownPoints run() {
    number_.assign(c_.expressions.count, RMP_NONE);
    for (std::uint32_t e = 0; e < c_.expressions.count; ++e) {
      const auto& x = row<rmp_code_expression>(c_.expressions, e);
      const auto& type = row<rmp_code_type>(c_.types, x.type);
      if (type.role == RMP_ROLE_NONE || type.role == RMP_ROLE_ROBOT || !values_[e]) continue;
      PostPoint p;
      p.expression = e;
      p.role = type.role;
      if (!fill(p, type, *values_[e])) continue;
      number_[e] = static_cast<std::uint32_t>(out_.points.size());
      out_.points.push_back(p);
    }
    if (carrier_) follow();
    for (std::uint32_t r = 0; r < c_.routines.count; ++r) {
      is_placed_ = false;  // who calls it has been anywhere
      block(row<rmp_code_routine>(c_.routines, r).body);
    }
    return std::move(out_);
  }

 private:
  std::span<const double> keep(std::vector<double> v) {
    out_.numbers.push_back(std::move(v));
    return out_.numbers.back();
  }
  const char* word(std::string s) {
    for (const std::string& w : out_.words)
      if (w == s) return w.c_str();
    if (out_.words.size() >= 1000) return "the joint values of this target are unknown";
    return out_.words.emplace_back(std::move(s)).c_str();
  }
  static bool pose(PostPoint& p, const double* mm, const double* quaternion) {
    if (mm)
      for (std::size_t i = 0; i < 3; ++i) p.pose.p[i] = mm[i] / 1000;
    if (quaternion) {
      const auto q = unit({quaternion[0], quaternion[1], quaternion[2], quaternion[3]});
      if (!q) return false;
      p.pose.R = matrix(*q);
    }
    p.has_pose = true;
    return true;
  }
  [[nodiscard]] std::size_t slots_of_role(const rmp_code_type& t, std::uint32_t role) const {
    for (std::uint32_t k = 0; k < t.field_count; ++k) {
      const auto& f = row<rmp_code_field>(c_.fields, t.first_field + k);
      if (row<rmp_code_type>(c_.types, f.type).role == role) return values_.slots_of(f.type);
    }
    return 0;
  }
  std::vector<double> joints(const double* v, std::size_t n) const {
    if (!axes_.empty()) {
      const std::size_t coordinates = robot_ ? robot_->coordinate_count() : n;
      if (auto q = joints_from_axes(axes_, {v, n}, std::vector<double>(coordinates, 0.0), robot_))
        return std::move(*q);
    }
    std::vector<double> q(v, v + n);
    for (std::size_t i = 0; i < n; ++i) {
      const bool is_linear = robot_ && robot_->is_simple() && i < robot_->joints.size() &&
                             robot_->joints[i].type == JointType::prismatic;
      q[i] /= is_linear ? 1000.0 : post::kDegree;
    }
    return q;
  }
  bool fill(PostPoint& p, const rmp_code_type& type, const std::vector<double>& v) {
    switch (type.role) {
      case RMP_ROLE_POSITION: return v.size() == 3 && pose(p, v.data(), nullptr);
      case RMP_ROLE_ORIENTATION: return v.size() == 4 && pose(p, nullptr, v.data());
      case RMP_ROLE_POSE: return v.size() == 7 && pose(p, v.data(), v.data() + 3);
      case RMP_ROLE_MAIN_JOINT: p.q = keep(joints(v.data(), v.size())); return true;
      case RMP_ROLE_ADD_JOINT: p.external = keep(v); return true;
      case RMP_ROLE_JOINT: {
        const std::size_t n = slots_of_role(type, RMP_ROLE_MAIN_JOINT);
        if (n == 0 || n > v.size()) return false;
        p.q = keep(joints(v.data(), n));
        p.external = keep({v.begin() + static_cast<std::ptrdiff_t>(n), v.end()});
        return true;
      }
      case RMP_ROLE_ROBTARGET: {
        if (v.size() < 8 || !pose(p, v.data(), v.data() + 3)) return false;
        const std::size_t n = slots_of_role(type, RMP_ROLE_ADD_JOINT);
        if (n > 0 && n + 8 <= v.size())
          p.external = keep({v.end() - static_cast<std::ptrdiff_t>(n), v.end()});
        // Below zero any configuration will do.
        if (v[7] < 0) return true;
        p.status = static_cast<std::uint32_t>(static_cast<std::int64_t>(v[7])) & 7U;
        p.status_known = 7;
        p.has_status = true;
        std::vector<std::int32_t> turns;
        for (std::size_t k = 8; k + n < v.size(); ++k)
          turns.push_back(static_cast<std::int32_t>(std::clamp(v[k], -1e6, 1e6)));
        const std::size_t joints = robot_ ? robot_->coordinate_count() : joints_;
        p.turns_first =
            static_cast<std::uint32_t>(joints > turns.size() ? joints - turns.size() : 0);
        p.turns_from = turns_from_;
        p.turns = out_.turns.emplace_back(std::move(turns));
        return true;
      }
      default: return false;
    }
  }
  // ---- additional joints ----
  /// Where additional joints are at each motion; points count them as joints from here on.
  void follow() {
    std::vector<CarriedSetting> settings(c_.motions.count);
    std::size_t slots = carrier_->slots;
    for (const CarriedAxis& a : carrier_->axes) slots = std::max(slots, a.number);
    std::vector<double> start(slots, 0.0);
    for (const CarriedAxis& a : carrier_->axes) start[a.number - 1] = a.start;
    for (std::uint32_t i = 0; i < c_.motions.count; ++i) {
      const auto& m = row<rmp_code_motion>(c_.motions, i);
      CarriedSetting& s = settings[i];
      s.is_step = m.is_incremental != 0;
      for (std::uint32_t k = 0; k < m.target_count; ++k) {
        const std::uint32_t e = row<std::uint32_t>(c_.links, m.first_target + k);
        const auto role =
            row<rmp_code_type>(c_.types, row<rmp_code_expression>(c_.expressions, e).type).role;
        if (role != RMP_ROLE_ADD_JOINT && role != RMP_ROLE_JOINT && role != RMP_ROLE_ROBTARGET)
          continue;
        if (number_[e] == RMP_NONE) {
          s.is_unknown = true;
          continue;
        }
        if (s.is_step) is_step_.insert(e);
        const std::span<const double> given = out_.points[number_[e]].external;
        for (std::size_t n = 0; n < given.size() && n < slots; ++n) {
          const CarriedAxis* a = axis_of(n + 1);
          if (a && carrier_->has_no_additional && given[n] == 0) continue;
          s.values.emplace_back(n, a ? joint_of(*a, given[n], s.is_step) : given[n]);
        }
      }
    }
    for (PostPoint& p : out_.points) {
      if (p.external.empty()) continue;
      const bool is_step = is_step_.contains(p.expression);
      std::vector<double> v(p.external.begin(), p.external.end());
      for (std::size_t n = 0; n < v.size(); ++n)
        if (const CarriedAxis* a = axis_of(n + 1)) v[n] = joint_of(*a, v[n], is_step);
      p.external = keep(std::move(v));
    }
    out_.motions = follow_carried(c_, settings, std::move(start));
  }
  [[nodiscard]] const CarriedAxis* axis_of(std::size_t number) const {
    for (const CarriedAxis& a : carrier_->axes)
      if (a.number == number) return &a;
    return nullptr;
  }
  /// base_T_carriage at the end of a motion; nothing = it is known at run time only.
  [[nodiscard]] std::optional<Pose> carriage(std::uint32_t m) const {
    if (!carrier_ || carrier_->rail == 0 || carrier_->is_on_carriage) return Pose{};
    const auto& to = out_.motions[m].to;
    if (!to) return std::nullopt;
    return carriage_at(*carrier_, *to);
  }
  /// What is written of a target without additional joints of its own, and whether they go there.
  void carry(PostPoint& p, std::uint32_t m) {
    const auto& to = out_.motions[m].to;
    if (!to) return;
    p.external = keep(*to);
    for (const CarriedAxis& a : carrier_->axes) {
      const double v = (*to)[a.number - 1];
      constexpr double kNear = 1e-6;
      if (v >= a.lower - kNear && v <= a.upper + kNear) continue;
      const char* unit = a.is_rotary ? " degrees" : " mm";
      remark(row<rmp_code_expression>(c_.expressions, p.expression).span,
             "additional joint " + std::to_string(a.number) + ", which is " + text::quote(a.name) +
                 ", cannot go to " + text::print_rounded(v, 6) + unit,
             "It goes from " + text::print_rounded(a.lower, 6) + " to " +
                 text::print_rounded(a.upper, 6) + unit + ".");
    }
  }

  void block(std::uint32_t first) {
    const auto at = [&](std::uint32_t i) -> const rmp_code_statement& {
      return row<rmp_code_statement>(c_.statements, i);
    };
    each_statement(first, at, [&](const rmp_code_statement& s) {
      if (s.motion != RMP_NONE) motion(s.motion);
    });
  }
  void motion(std::uint32_t number) {
    const auto& m = row<rmp_code_motion>(c_.motions, number);
    std::optional<Pose> frame = Pose{}, tool = default_tool_;
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      const auto& a = row<rmp_code_attribute>(c_.attributes, m.first_attribute + k);
      if (a.attribute != RMP_ATTR_FRAME && a.attribute != RMP_ATTR_TOOL) continue;
      std::optional<Pose>& place = a.attribute == RMP_ATTR_FRAME ? frame : tool;
      place.reset();
      if (number_[a.value] != RMP_NONE && out_.points[number_[a.value]].has_pose)
        place = out_.points[number_[a.value]].pose;
    }
    for (std::uint32_t k = 0; k < m.target_count; ++k) {
      const std::uint32_t n = number_[row<std::uint32_t>(c_.links, m.first_target + k)];
      if (n == RMP_NONE || m.is_incremental) is_placed_ = false;
      if (n == RMP_NONE) continue;
      PostPoint& p = out_.points[n];
      if (p.motion == RMP_NONE) p.motion = number;
      if (carrier_ && !m.is_incremental) carry(p, number);
      if (!m.is_incremental) solve(p, tool, frame, m, carriage(number));
    }
  }
  /// Into the turns that the program asks for; false = the joints do not go there.
  bool turn(const PostPoint& p, std::vector<double>& q) const {
    for (std::size_t k = 0; k < p.turns.size(); ++k) {
      const std::size_t j = p.turns_first + k;
      if (j >= q.size() || !robot_->is_simple() || j >= robot_->joints.size()) continue;
      if (is_any_turn(p.turns[k])) continue;
      const JointModel& joint = robot_->joints[j];
      if (joint.type == JointType::prismatic) continue;
      const double seed = j < last_.size() ? last_[j] * post::kDegree : 0;
      double sign = 1, offset = 0;
      for (const PostAxis& a : axes_)
        if (!a.external && a.joint == static_cast<std::int32_t>(j) && a.coupled.empty())
          sign = a.sign, offset = a.offset;
      q[j] = (in_turn(sign * q[j] * post::kDegree + offset, p.turns[k], p.turns_from,
                      sign * seed + offset) -
              offset) /
             sign / post::kDegree;
      if (q[j] < joint.lower - 1e-6 || q[j] > joint.upper + 1e-6) return false;
    }
    return true;
  }
  /// Once for each place of the program.
  void remark(const rmp_span& at, std::string message, std::string hint) {
    if (told_.emplace(at.file, at.line, at.column).second)
      out_.remarks.push_back({RMP_FAULT_WARNING, at, std::move(message), std::move(hint)});
  }
  /// Joints on the way along a straight line from where the robot is, a step from the last one;
  /// nothing = the way leaves what it reaches. Of arcs and splines it is the chord.
  std::optional<std::vector<double>> followed(const Pose& to, const Pose& tool) {
    constexpr int kSteps = 32;
    constexpr double kJump = 1.2;  ///< [rad] of a joint in a step
    const auto flange = kinematics_->forward(last_);
    if (!flange.ok()) return std::nullopt;
    const Pose from = post::product(*flange, tool), back = post::inverse(tool);
    const Quaternion a = post::quaternion(from.R);
    Quaternion b = post::quaternion(to.R);
    double cosine_of = 0;
    for (std::size_t i = 0; i < 4; ++i) cosine_of += a[i] * b[i];
    if (cosine_of < 0)
      for (double& x : b) x = -x;
    const double angle = std::acos(std::min(1.0, std::fabs(cosine_of)));
    std::vector<double> q = last_;
    for (int k = 1; k <= kSteps; ++k) {
      const double s = double(k) / kSteps;
      const double u = angle < 1e-9 ? 1 - s : std::sin((1 - s) * angle) / std::sin(angle);
      const double v = angle < 1e-9 ? s : std::sin(s * angle) / std::sin(angle);
      Quaternion r{};
      for (std::size_t i = 0; i < 4; ++i) r[i] = u * a[i] + v * b[i];
      const auto turned_to = unit(r);
      if (!turned_to) return std::nullopt;
      Pose here = to;
      if (k < kSteps) {
        here.R = matrix(*turned_to);
        for (std::size_t i = 0; i < 3; ++i) here.p[i] = from.p[i] + s * (to.p[i] - from.p[i]);
      }
      auto next = kinematics_->inverse(post::product(here, back), q, -1);
      if (!next.ok()) return std::nullopt;
      // Where its branch ends, the nearest solution is one of another.
      for (std::size_t i = 0; i < q.size(); ++i)
        if (std::fabs((*next)[i] - q[i]) > kJump) return std::nullopt;
      q = std::move(*next);
    }
    return q;
  }
  void place(PostPoint& p) {
    std::uint32_t known = 0;
    const std::uint32_t status = kinematics_->status(p.q, known);
    // Without names the program's own STATUS is all that is known.
    if (p.has_status && known != 7) return;
    p.status = status;
    p.status_known = known;
  }
  /// `base`: base_T_carriage, which the arm is mounted on.
  void solve(PostPoint& p, const std::optional<Pose>& tool, const std::optional<Pose>& frame,
             const rmp_code_motion& m, const std::optional<Pose>& base) {
    const bool is_joints = p.role == RMP_ROLE_JOINT || p.role == RMP_ROLE_MAIN_JOINT;
    const bool was_placed = std::exchange(is_placed_, false);
    if (!kinematics_ || !robot_) {
      if (!is_joints)
        p.q_missing = "the joint values of this target are unknown, since no robot is named";
      return;
    }
    if (is_joints) {
      if (p.q.size() != robot_->coordinate_count()) return;
      last_.assign(p.q.begin(), p.q.end());
      is_placed_ = true;
      if (p.has_pose) return;
      if (auto found = kinematics_->forward(p.q); found.ok()) {
        if (tool && base) p.pose = post::product(*base, post::product(*found, *tool));
        p.has_pose = tool && base;
      }
      place(p);
      return;
    }
    if (p.role != RMP_ROLE_POSE && p.role != RMP_ROLE_ROBTARGET) {
      p.q_missing = "the joint values of this target are unknown, since it keeps an orientation";
      return;
    }
    if (!p.q.empty()) {
      last_.assign(p.q.begin(), p.q.end());
      is_placed_ = true;
      return;
    }
    if (!tool || !frame) {
      p.q_missing = !tool
                        ? "the joint values of this target are unknown, since its TOOL is unknown"
                        : "the joint values of this target are unknown, since its FRAME is unknown";
      return;
    }
    if (!base) {
      const char* why =
          "the joints of this target are not known, since the additional joints that carry the "
          "robot are known at run time only";
      p.q_missing = why;
      remark(row<rmp_code_expression>(c_.expressions, p.expression).span, why,
             "Give the target its additional joints as constants (ROBTARGET), or post the "
             "flattened program (form = \"flat\").");
      return;
    }
    const Pose tip = post::product(post::inverse(*base), post::product(*frame, p.pose));
    const Pose to = post::product(tip, post::inverse(*tool));
    // Motions along a path keep the branch that they begin in, whatever STATUS says.
    const bool keeps = was_placed && m.interpolation != RMP_MOVE_PTP;
    const auto asked = p.has_status ? std::int64_t{p.status} : -1;
    auto found = kinematics_->inverse(to, last_, keeps ? -1 : asked);
    std::uint32_t known = 0, before_known = 0;
    if (found.ok() && keeps) {
      const rmp_span& span = row<rmp_code_expression>(c_.expressions, p.expression).span;
      const std::uint32_t before = kinematics_->status(last_, before_known);
      if (((kinematics_->status(*found, known) ^ before) & known & before_known) != 0) {
        if (auto way = followed(tip, *tool)) found = std::move(*way);
        else if (m.interpolation == RMP_MOVE_LIN)
          remark(span,
                 "on a straight line the robot cannot reach this point in its present branch, and "
                 "the nearest configuration is used",
                 "program.check_run shows where the path ends; move there by PTP.");
      }
      const std::uint32_t has = kinematics_->status(*found, known);
      if (asked >= 0 && ((has ^ static_cast<std::uint32_t>(asked)) & known) != 0)
        remark(span,
               "the target has STATUS " + std::to_string(asked) +
                   ", but a motion along a path keeps its branch, which is STATUS " +
                   std::to_string(has) + " here",
               "Move there by PTP, or give the target the STATUS of the previous motion.");
    }
    // All targets tell of it, also those whose languages have no joints.
    const auto told = [&](const char* why, std::string hint) {
      p.q_missing = why;
      remark(row<rmp_code_expression>(c_.expressions, p.expression).span, why, std::move(hint));
    };
    if (!found.ok()) {
      told(word(found.error().message),
           found.error().hint.empty()
               ? "Move the target or the robot, or choose another configuration (STATUS)."
               : found.error().hint);
      return;
    }
    if (!keeps && !turn(p, *found)) {
      told("the robot does not reach this target with its TURNS", "Give other TURNS, or none.");
      return;
    }
    last_ = *found;
    is_placed_ = true;
    p.q = keep(std::move(*found));
    place(p);
  }

  const rmp_code& c_;
  const RobotModel* robot_;
  const PostKinematics* kinematics_;
  Values values_;
  Pose default_tool_;
  KnownPoints out_;
  std::vector<std::uint32_t> number_;
  std::vector<double> last_;
  std::set<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> told_;
  bool is_placed_ = false;  ///< last_ is where the motion before leads
  double turns_from_ = kTurnsFrom;
  std::span<const PostAxis> axes_;  ///< that joints and turns of the program count
  std::size_t joints_ = 0;          ///< of MAIN_JOINT
  const Carrier* carrier_ = nullptr;
  std::set<std::uint32_t> is_step_;  ///< expressions that motions add to where the robot is
};

}  // namespace

KnownPoints known_points(const rmp_code& code, const RobotModel* robot,
                         const PostKinematics* kinematics, std::span<const double> start,
                         const Pose& default_tool, std::span<const PostAxis> axes,
                         const Carrier* carrier) {
  return Finder(code, robot, kinematics, start, default_tool, axes, carrier).run();
}

double joint_of(const CarriedAxis& a, double value, bool is_step) {
  return (is_step ? value : value - a.offset) / a.sign;
}

std::vector<double> chain_at(const Carrier& carrier, std::span<const double> additional) {
  std::vector<double> q = carrier.start;
  for (const CarriedAxis& a : carrier.axes)
    if (a.rail >= 0 && a.number <= additional.size())
      q[static_cast<std::size_t>(a.rail)] =
          additional[a.number - 1] / (a.is_rotary ? post::kDegree : 1000.0);
  return q;
}
Pose carriage_at(const Carrier& carrier, std::span<const double> additional) {
  return robotics::base_T_carriage(*carrier.chain, carrier.rail, chain_at(carrier, additional));
}

}  // namespace robomosp::program_post
