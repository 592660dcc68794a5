// SPDX-License-Identifier: Apache-2.0
#include "emit.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace robomosp::robot_code {
namespace {

constexpr std::size_t kLineLength = 96;

/// Binding strength of a piece of C text.
enum Strength { kSum = 1, kProduct = 2, kUnary = 3, kAtom = 4 };
struct Text {
  std::string text;
  int strength = kAtom;
};

std::string literal(double v) {
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, v).ptr;
  std::string s(buffer, end);
  if (s.find_first_of(".en") == std::string::npos) s += ".0";
  return s;
}

std::string wrapped(const Text& t, int least) {
  return t.strength < least ? "(" + t.text + ")" : t.text;
}

const char* array_name(std::uint32_t array) {
  static const char* const kNames[kArrays] = {"q", "qd", "qdd", "tau"};
  return kNames[array];
}

std::size_t array_size(const RobotModel& m, std::uint32_t array) {
  return array == kQ ? m.coordinate_count() : m.dof();
}

bool is_operation(const NodeData& n) {
  return n.operation != Operation::constant && n.operation != Operation::input;
}
bool is_binary(Operation o) {
  return o == Operation::add || o == Operation::subtract || o == Operation::multiply ||
         o == Operation::divide || o == Operation::select;
}

/// Which nodes the outputs need, and how often each is used.
std::vector<std::uint32_t> use_counts(const Function& f) {
  std::vector<std::uint32_t> uses(f.graph.size());
  for (const Node n : f.outputs) ++uses[n];
  for (std::size_t i = uses.size(); i-- > 0;) {
    const NodeData& n = f.graph[static_cast<Node>(i)];
    if (!uses[i] || !is_operation(n)) continue;
    ++uses[n.a];
    if (is_binary(n.operation)) ++uses[n.b];
  }
  return uses;
}

/// The statements of one function's body.
class Body {
 public:
  /// `index` comes behind every array element ("" or "[l]"); `any_angle` takes sine and cosine for
  /// angles of any size.
  Body(const Function& f, std::string prefix, std::string indent, std::string index, bool any_angle)
      : f_(f),
        prefix_(std::move(prefix)),
        indent_(std::move(indent)),
        index_(std::move(index)),
        any_angle_(any_angle),
        uses_(use_counts(f)),
        text_(f.graph.size()) {}

  std::string write() {
    for (const std::uint32_t a : f_.arrays)
      if (!uses_array(a)) line(std::string("(void)") + array_name(a) + ";");
    pair_angles();
    for (std::size_t i = 0; i < uses_.size(); ++i)
      if (uses_[i]) node(static_cast<Node>(i));
    for (std::size_t i = 0; i < f_.outputs.size(); ++i)
      line(f_.output + "[" + std::to_string(i) + "]" + index_ + " = " + text_[f_.outputs[i]].text +
           ";");
    return std::move(out_);
  }

 private:
  void line(const std::string& s) { out_ += indent_ + s + "\n"; }
  [[nodiscard]] bool uses_array(std::uint32_t array) const {
    for (std::size_t i = 0; i < uses_.size(); ++i) {
      const NodeData& n = f_.graph[static_cast<Node>(i)];
      if (uses_[i] && n.operation == Operation::input && n.a == array) return true;
    }
    return false;
  }
  std::string next_name(const char* stem) { return stem + std::to_string(names_++); }

  /// Angles of which sine or cosine is needed: both come from one call.
  void pair_angles() {
    angles_.assign(uses_.size(), 0);
    for (std::size_t i = 0; i < uses_.size(); ++i) {
      const NodeData& n = f_.graph[static_cast<Node>(i)];
      if (uses_[i] && (n.operation == Operation::sine || n.operation == Operation::cosine))
        angles_[n.a] = 1;
    }
  }

  Text compose(const NodeData& n) {
    const Text &a = text_[n.a], &b = text_[n.b];
    switch (n.operation) {
      case Operation::add: return {wrapped(a, kSum) + " + " + wrapped(b, kProduct), kSum};
      case Operation::subtract: return {wrapped(a, kSum) + " - " + wrapped(b, kProduct), kSum};
      case Operation::multiply:
        return {wrapped(a, kProduct) + " * " + wrapped(b, kUnary), kProduct};
      case Operation::divide: return {wrapped(a, kProduct) + " / " + wrapped(b, kUnary), kProduct};
      case Operation::negate: return {"-" + wrapped(a, kAtom), kUnary};
      case Operation::square_root: return {"sqrt(" + a.text + ")", kAtom};
      case Operation::select:
        return {"(" + wrapped(a, kSum) + " > 0 ? " + b.text + " : 0.0)", kAtom};
      default: return {};
    }
  }

  void node(Node i) {
    const NodeData& n = f_.graph[i];
    Text& t = text_[i];
    switch (n.operation) {
      case Operation::constant: t = {literal(n.value), n.value < 0 ? kUnary : kAtom}; break;
      case Operation::input:
        t.text = std::string(array_name(n.a)) + "[" + std::to_string(n.b) + "]" + index_;
        break;
      case Operation::sine: t.text = "s" + std::to_string(angle_name_.at(n.a)); break;
      case Operation::cosine: t.text = "c" + std::to_string(angle_name_.at(n.a)); break;
      default: {
        t = compose(n);
        const bool inlined = uses_[i] == 1 && t.text.size() < kLineLength - indent_.size();
        if (!inlined) {
          const std::string name = next_name("t");
          line("const double " + name + " = " + t.text + ";");
          t = {name, kAtom};
        }
      }
    }
    if (angles_[i]) {
      const std::size_t k = names_++;
      angle_name_[i] = k;
      const std::string id = std::to_string(k);
      line("double s" + id + ", c" + id + ";");
      line(prefix_ + (any_angle_ ? "_sincos(" : "_sincos_near(") + t.text + ", &s" + id + ", &c" +
           id + ");");
    }
  }

  const Function& f_;
  std::string prefix_, indent_, index_;
  bool any_angle_;
  std::vector<std::uint32_t> uses_;
  std::vector<Text> text_;
  std::vector<char> angles_;
  std::unordered_map<Node, std::size_t> angle_name_;
  std::size_t names_ = 0;
  std::string out_;
};

std::string upper(std::string s) {
  for (char& c : s)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
  return s;
}

std::string comment_text(const std::string& s) {
  std::string out;
  for (const char c : s) out += (c == '*' || c == '/' || c == '\n' || c == '\\') ? ' ' : c;
  return out;
}

std::string parameters(const RobotModel& m, const Function& f) {
  std::string s;
  for (const std::uint32_t a : f.arrays)
    s += std::string("const double ") + array_name(a) + "[" + std::to_string(array_size(m, a)) +
         "], ";
  return s + "double " + f.output + "[" + std::to_string(f.outputs.size()) + "]";
}
std::string batch_parameters(const Function& f) {
  std::string s = "size_t count";
  for (const std::uint32_t a : f.arrays) s += std::string(", const double *") + array_name(a);
  return s + ", double *" + f.output;
}

std::string joint_table(const RobotModel& m) {
  std::string s;
  for (const JointModel& j : m.joints) {
    s += " *   " + comment_text(j.name) + ": ";
    if (j.is_coupled()) {
      s += "follows " + comment_text(m.joints[static_cast<std::size_t>(j.coupling.of)].name);
    } else {
      const std::int32_t nq = coordinate_count(j.type), nv = velocity_count(j.type);
      s += "q[" + std::to_string(j.q_index) + "]";
      if (nq > 1) s += "..q[" + std::to_string(j.q_index + nq - 1) + "]";
      s += j.type == JointType::revolute    ? " [rad]"
           : j.type == JointType::prismatic ? " [m]"
           : j.type == JointType::spherical ? " quaternion w x y z"
                                            : " position [m], quaternion w x y z";
      if (nv != nq)
        s += "; qd[" + std::to_string(j.v_index) + "]..qd[" + std::to_string(j.v_index + nv - 1) +
             "]";
    }
    s += "\n";
  }
  return s;
}

std::string header(const RobotModel& m, const std::string& name,
                   const std::vector<Function>& functions) {
  const std::string up = upper(name);
  std::string s = "/* Kinematics and dynamics of the robot \"" + comment_text(m.name) +
                  "\", generated by ROBOMOSP. The code is yours.\n"
                  " * C99, no dependencies but the C library, no allocation, no state: safe in any "
                  "thread.\n * SI units and radians. Do not compile with -ffast-math.\n"
                  " * Poses and Jacobian are in the robot's base frame.\n *\n"
                  " * Joints:\n" +
                  joint_table(m) + " */\n#ifndef " + up + "_H\n#define " + up +
                  "_H\n\n#include <stddef.h>\n\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n" +
                  "#define " + up + "_COORDINATES " + std::to_string(m.coordinate_count()) +
                  " /* numbers in q */\n#define " + up + "_DOF " + std::to_string(m.dof()) +
                  " /* numbers in qd, qdd and tau */\n#define " + up + "_TIPS " +
                  std::to_string(m.tips.size()) + "\n";
  for (const Function& f : functions) {
    s += "\n/* " + f.doc + " " + std::to_string(operation_count(f)) + " operations. */\nvoid " +
         name + "_" + f.name + "(" + parameters(m, f) + ");\n";
    s += "/* The same for `count` samples, each array sample after sample. */\nvoid " + name + "_" +
         f.name + "_batch(" + batch_parameters(f) + ");\n";
  }
  return s + "\n#ifdef __cplusplus\n}\n#endif\n#endif\n";
}

// The reduction is Cody and Waite's in three parts (fdlibm's constants), the polynomials are
// fdlibm's for |r| <= pi/4.
constexpr const char* kSinCos =
    R"(/* Sine and cosine to about 1 ulp for |x| < 1e5, without branches. */
static inline void NAME_sincos_near(double x, double *s, double *c) {
  const double shift = 6755399441055744.0; /* adding it rounds to a whole number */
  const double n = (x * 0.63661977236758134308 + shift) - shift;
  const double quadrant = n - 4.0 * ((n * 0.25 - 0.375 + shift) - shift); /* 0, 1, 2 or 3 */
  const double r = ((x - n * 1.57079632673412561417) - n * 6.07710050630396597660e-11) -
                   n * 2.02226624879595063154e-21;
  const double z = r * r;
  const double sine =
      r + r * z * (-1.66666666666666324348e-01 +
                   z * (8.33333333332248946124e-03 +
                        z * (-1.98412698298579493134e-04 +
                             z * (2.75573137070700676789e-06 +
                                  z * (-2.50507602534068634195e-08 +
                                       z * 1.58969099521155010221e-10)))));
  const double cosine =
      1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 +
                               z * (-1.38888888888741095749e-03 +
                                    z * (2.48015872894767294178e-05 +
                                         z * (-2.75573143513906633035e-07 +
                                              z * (2.08757232129817482790e-09 -
                                                   z * 1.13596475577881948265e-11)))));
  const int odd = quadrant == 1.0 || quadrant == 3.0;
  const double a = odd ? cosine : sine, b = odd ? sine : cosine;
  *s = quadrant >= 2.0 ? -a : a;
  *c = quadrant == 1.0 || quadrant == 2.0 ? -b : b;
}

static inline void NAME_sincos(double x, double *s, double *c) {
  if (x > -1e5 && x < 1e5) {
    NAME_sincos_near(x, s, c);
  } else {
    *s = sin(x);
    *c = cos(x);
  }
}

/* Samples of a batch that are computed side by side: one vector of AVX-512, or enough of others. */
#ifndef NAME_LANES
#ifdef __AVX512F__
#define NAME_LANES 8
#else
#define NAME_LANES 16
#endif
#endif

/* With AVX-512, squares of 8 samples and 8 of their numbers are turned in registers. */
#if NAME_LANES == 8 && defined(__AVX512F__) && (defined(__clang__) || __GNUC__ >= 12)
#define NAME_LANES_TURN
typedef double NAME_square __attribute__((vector_size(64), aligned(8), may_alias));
static inline void NAME_turn(NAME_square *r) {
  NAME_square t[8];
  for (int i = 0; i < 8; i += 2) {
    t[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    t[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  for (int h = 0; h < 8; h += 4)
    for (int i = h; i < h + 2; ++i) {
      r[i] = __builtin_shufflevector(t[i], t[i + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      r[i + 2] = __builtin_shufflevector(t[i], t[i + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  for (int i = 0; i < 4; ++i) {
    const NAME_square a = r[i], b = r[i + 4];
    r[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
    r[i + 4] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
  }
}
/* Whether the squares of the first 8 of `samples` samples are all within the samples. */
static inline int NAME_has_squares(size_t width, size_t samples) {
  return 7 * width + (width + 7) / 8 * 8 <= samples * width;
}
#endif

/* Reads the first NAME_LANES of `samples` samples of `width` numbers; lanes without a sample repeat
 * the last one. */
static inline void NAME_load(const double *restrict from, size_t width, size_t samples,
                             double (*restrict to)[NAME_LANES]) {
#ifdef NAME_LANES_TURN
  if (NAME_has_squares(width, samples)) {
    for (size_t first = 0; first < width; first += 8) {
      NAME_square r[8];
      for (size_t l = 0; l < 8; ++l) r[l] = *(const NAME_square *)(from + l * width + first);
      NAME_turn(r);
      for (size_t k = 0; k < 8 && first + k < width; ++k) *(NAME_square *)to[first + k] = r[k];
    }
    return;
  }
#endif
  if (samples >= NAME_LANES) {
    for (size_t l = 0; l < NAME_LANES; ++l)
      for (size_t k = 0; k < width; ++k) to[k][l] = from[l * width + k];
  } else {
    for (size_t l = 0; l < NAME_LANES; ++l)
      for (size_t k = 0; k < width; ++k)
        to[k][l] = from[(l < samples ? l : samples - 1) * width + k];
  }
}

/* Whether every angle is one for NAME_sincos_near. */
static inline int NAME_is_near(double (*q)[NAME_LANES], size_t width) {
  double far = 0.0;
  for (size_t k = 0; k < width; ++k)
    for (size_t l = 0; l < NAME_LANES; ++l) far += fabs(q[k][l]) < NEAR_LIMIT ? 0.0 : 1.0;
  return far == 0.0;
}

static inline void NAME_store(double (*restrict from)[NAME_LANES], size_t width, size_t samples,
                              double *restrict to) {
#ifdef NAME_LANES_TURN
  if (NAME_has_squares(width, samples)) {
    for (size_t next = 0; next < width; next += 8) {
      /* The last square of a wide sample overlaps the one before; a narrow sample is written with
       * some of what follows it, which the next sample overwrites. */
      const size_t first = next + 8 <= width || width < 8 ? next : width - 8;
      NAME_square r[8];
      for (size_t k = 0; k < 8; ++k) r[k] = *(const NAME_square *)from[k < width ? first + k : 0];
      NAME_turn(r);
      for (size_t l = 0; l < 8; ++l) *(NAME_square *)(to + l * width + first) = r[l];
    }
    return;
  }
#endif
  for (size_t l = 0; l < samples && l < NAME_LANES; ++l)
    for (size_t k = 0; k < width; ++k) to[l * width + k] = from[k][l];
}
)";

/// Inputs within which every angle is one for _sincos_near: coupled joints turn faster.
std::string near_limit(const RobotModel& m) {
  double steepest = 1;
  for (const JointModel& j : m.joints)
    if (j.is_coupled()) steepest = std::max(steepest, std::fabs(j.coupling.ratio));
  return literal(std::floor(9e4 / steepest));
}

std::string with_name(std::string text, const std::string& name, const std::string& limit) {
  const std::string up = upper(name), key = "NEAR_LIMIT";
  for (std::size_t at = 0; (at = text.find(key, at)) != std::string::npos; at += limit.size())
    text.replace(at, key.size(), limit);
  for (std::size_t at = 0; (at = text.find("NAME_", at)) != std::string::npos;) {
    const bool is_macro = text.compare(at + 5, 5, "LANES") == 0;
    text.replace(at, 4, is_macro ? up : name);
    at += name.size();
  }
  return text;
}

std::string single(const RobotModel& m, const std::string& name, const Function& f) {
  std::string s = "\nvoid " + name + "_" + f.name + "(" + parameters(m, f) + ") {\n";
  return s + Body(f, name, "  ", "", true).write() + "}\n";
}

std::string batch(const RobotModel& m, const std::string& name, const Function& f) {
  const std::string lanes = upper(name) + "_LANES", whole = name + "_" + f.name;
  std::string block = "\nstatic void " + whole + "_block(", call = "      " + whole + "_block(";
  for (const std::uint32_t a : f.arrays) {
    block += std::string("double (*restrict ") + array_name(a) + ")[" + lanes + "], ";
    call += std::string(array_name(a)) + "_, ";
  }
  block += "double (*restrict " + f.output + ")[" + lanes + "]) {\n";
  block += "  for (size_t l = 0; l < " + lanes + "; ++l) {\n";
  block += Body(f, name, "    ", "[l]", false).write() + "  }\n}\n";

  std::string s = block + "\nvoid " + whole + "_batch(" + batch_parameters(f) + ") {\n";
  for (const std::uint32_t a : f.arrays)
    s += std::string("  double ") + array_name(a) + "_[" + std::to_string(array_size(m, a)) + "][" +
         lanes + "];\n";
  s += "  double " + f.output + "_[" + std::to_string(f.outputs.size()) + "][" + lanes + "];\n";
  s += "  for (size_t i = 0; i < count; i += " + lanes + ") {\n";
  s += "    const size_t samples = count - i < " + lanes + " ? count - i : " + lanes + ";\n";
  std::string one;
  for (const std::uint32_t a : f.arrays) {
    const std::string n = array_name(a), w = std::to_string(array_size(m, a));
    s += "    " + name + "_load(" + n + " + i * " + w + ", " + w + ", count - i, " + n + "_);\n";
    one += n + " + (i + l) * " + w + ", ";
  }
  const std::string width = std::to_string(f.outputs.size());
  s += "    if (" + name + "_is_near(q_, " + std::to_string(m.coordinate_count()) + ")) {\n" +
       call + f.output + "_);\n      " + name + "_store(" + f.output + "_, " + width +
       ", count - i, " + f.output + " + i * " + width + ");\n    } else {\n";
  s += "      for (size_t l = 0; l < samples; ++l)\n        " + whole + "(" + one + f.output +
       " + (i + l) * " + width + ");\n    }\n  }\n}\n";
  return s;
}

}  // namespace

std::size_t operation_count(const Function& f) {
  const auto uses = use_counts(f);
  std::size_t count = 0;
  for (std::size_t i = 0; i < uses.size(); ++i)
    count += uses[i] > 0 && is_operation(f.graph[static_cast<Node>(i)]) ? 1U : 0U;
  return count;
}

Result<void> check_size(const Function& f, const RobotModel& model) {
  const std::size_t count = operation_count(f);
  if (count <= kMostOperations) return {};
  return error(ErrorCode::unsupported,
               "its " + f.name + " takes " + std::to_string(count) +
                   " operations written out, more than the " + std::to_string(kMostOperations) +
                   " that compilers manage",
               "Long chains are served by the providers newton_euler and articulated_body.",
               "robot \"" + model.name + "\"");
}

std::vector<CodeFile> write_files(const RobotModel& model, const std::string& name,
                                  const std::vector<Function>& functions) {
  std::string source = "/* See " + name + ".h. Generated by ROBOMOSP. */\n#include \"" + name +
                       ".h\"\n\n#include <math.h>\n\n" +
                       with_name(kSinCos, name, near_limit(model));
  for (const Function& f : functions) source += single(model, name, f) + batch(model, name, f);
  return {{name + ".h", header(model, name, functions)}, {name + ".c", std::move(source)}};
}

}  // namespace robomosp::robot_code
