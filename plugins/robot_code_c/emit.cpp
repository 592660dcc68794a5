// SPDX-License-Identifier: Apache-2.0
#include "emit.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <unordered_map>
#include <utility>

#include "c_text.h"

namespace robomosp::robot_code {
namespace {

constexpr std::size_t kLineLength = 96;
/// Operations beyond which a body is written as several functions.
constexpr std::size_t kMostInOneBody = 2'500;
/// Operations beyond which batches go sample by sample: written for several samples side by side,
/// the code takes as long again to compile.
constexpr std::size_t kMostSideBySide = 8'000;

/// Binding strength of a piece of C text.
enum Strength { kSum = 1, kProduct = 2, kUnary = 3, kAtom = 4 };
const char* array_name(std::uint32_t array) {
  static const char* const kNames[kArrays] = {"q", "qd", "qdd", "tau"};
  return kNames[array];
}

std::size_t array_size(const RobotModel& m, std::uint32_t array) {
  return array == kQ ? m.coordinate_count() : m.dof();
}

/// Pieces of a body that are functions of their own, since compilers' time grows faster than the
/// length of one.
struct Pieces {
  std::vector<std::string> bodies;  ///< in order of their calls
  std::size_t kept = 0;             ///< numbers that pass from piece to piece
};

/// The statements of one function's body.
class Body {
 public:
  /// `index` comes behind every array element ("" or "[l]"); `any_angle` takes sine and cosine for
  /// angles of any size; `output` is the array of the results.
  Body(const Function& f, std::string output, std::string prefix, std::string indent,
       std::string index, bool any_angle)
      : f_(f),
        output_(std::move(output)),
        prefix_(std::move(prefix)),
        indent_(std::move(indent)),
        index_(std::move(index)),
        any_angle_(any_angle),
        uses_(use_counts(f)),
        text_(f.graph.size()) {}

  std::string write() {
    collect(false);
    std::string out = unused(statements_, false);
    for (const Statement& s : statements_) out += s.text;
    return out;
  }

  /// Pieces of about kPieceOperations operations. Numbers of one that later ones need pass by the
  /// array "kept", whose places are used again.
  Pieces pieces() {
    collect(true);
    std::vector<std::span<const Statement>> parts;
    std::size_t start = 0, operations = 0;
    for (std::size_t i = 0; i < statements_.size(); ++i) {
      operations += statements_[i].operations;
      if (operations < kPieceOperations && i + 1 < statements_.size()) continue;
      parts.push_back(std::span(statements_).subspan(start, i + 1 - start));
      start = i + 1;
      operations = 0;
    }
    constexpr std::size_t kNowhere = ~std::size_t{0};
    std::vector<std::size_t> made(2 * names_, kNowhere), last(2 * names_, kNowhere),
        place(2 * names_, kNowhere);
    for (std::size_t p = 0; p < parts.size(); ++p)
      for (const Statement& s : parts[p]) {
        for (const std::size_t v : s.makes) made[v] = p;
        for (const std::size_t v : s.reads) last[v] = p;
      }
    Pieces out;
    std::vector<std::size_t> free_places;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      std::string text = unused(parts[p], true);
      bool uses_kept = false;
      std::vector<std::size_t> ended;
      std::vector<std::size_t> loaded;
      for (const Statement& s : parts[p])
        for (const std::size_t v : s.reads)
          if (made[v] != p && std::find(loaded.begin(), loaded.end(), v) == loaded.end())
            loaded.push_back(v);
      for (const std::size_t v : loaded) {
        text += indent_ + "const double " + name_of(v) + " = " + kept(place[v]) + ";\n";
        if (last[v] == p) ended.push_back(place[v]);
        uses_kept = true;
      }
      for (const Statement& s : parts[p]) text += s.text;
      free_places.insert(free_places.end(), ended.begin(), ended.end());
      for (const Statement& s : parts[p])
        for (const std::size_t v : s.makes) {
          if (last[v] == kNowhere || last[v] == p) continue;
          if (free_places.empty()) free_places.push_back(out.kept++);
          place[v] = free_places.back();
          free_places.pop_back();
          text += indent_ + kept(place[v]) + " = " + name_of(v) + ";\n";
          uses_kept = true;
        }
      if (!uses_kept) text = indent_ + "(void)kept;\n" + text;
      out.bodies.push_back(std::move(text));
    }
    out.kept = std::max<std::size_t>(out.kept, 1);
    return out;
  }

 private:
  /// A text and what it needs: names by number, input arrays by bits, operations.
  struct Part {
    std::string text;
    int strength = kAtom;
    std::vector<std::size_t> reads{};
    std::uint32_t arrays = 0;
    std::size_t operations = 0;
  };
  struct Statement {
    std::string text;  ///< whole lines
    std::vector<std::size_t> makes, reads;
    std::uint32_t arrays = 0;
    std::size_t operations = 0;
    bool is_result = false;
  };

  [[nodiscard]] std::string kept(std::size_t place) const {
    return "kept[" + std::to_string(place) + "]" + index_;
  }
  /// Twice the number of a name, and 1 for the cosine of a pair.
  static std::string name_of(std::size_t v, bool is_angle) {
    return (!is_angle ? "t" : v % 2 == 0 ? "s" : "c") + std::to_string(v / 2);
  }
  [[nodiscard]] std::string name_of(std::size_t v) const { return name_of(v, is_angle_[v / 2]); }
  std::size_t next_name(bool is_angle) {
    is_angle_.push_back(is_angle ? 1 : 0);
    return names_++;
  }

  /// Lines against warnings of what these statements leave out.
  [[nodiscard]] std::string unused(std::span<const Statement> statements, bool as_piece) const {
    std::uint32_t arrays = 0;
    bool has_result = false;
    for (const Statement& s : statements) {
      arrays |= s.arrays;
      has_result = has_result || s.is_result;
    }
    std::string out;
    for (const std::uint32_t a : f_.arrays)
      if (!(arrays >> a & 1U)) out += indent_ + "(void)" + array_name(a) + ";\n";
    if (as_piece && !has_result) out += indent_ + "(void)" + output_ + ";\n";
    return out;
  }

  /// All statements; `results_at_once` puts each result behind what it needs, not to the end.
  void collect(bool results_at_once) {
    pair_angles();
    std::vector<std::vector<std::size_t>> results(results_at_once ? uses_.size() : 0);
    if (results_at_once)
      for (std::size_t i = 0; i < f_.outputs.size(); ++i) results[f_.outputs[i]].push_back(i);
    for (std::size_t i = 0; i < uses_.size(); ++i) {
      if (!uses_[i]) continue;
      node(static_cast<Node>(i));
      if (results_at_once)
        for (const std::size_t k : results[i]) result(k);
    }
    if (!results_at_once)
      for (std::size_t i = 0; i < f_.outputs.size(); ++i) result(i);
  }
  void result(std::size_t i) {
    const Part& t = text_[f_.outputs[i]];
    statement(output_ + "[" + std::to_string(i) + "]" + index_ + " = " + t.text + ";", t, {})
        .is_result = true;
  }
  Statement& statement(const std::string& line, const Part& t, std::vector<std::size_t> makes) {
    statements_.push_back(
        {indent_ + line + "\n", std::move(makes), t.reads, t.arrays, t.operations, false});
    return statements_.back();
  }

  /// Angles of which sine or cosine is needed: both come from one call.
  void pair_angles() {
    angles_.assign(uses_.size(), 0);
    for (std::size_t i = 0; i < uses_.size(); ++i) {
      const NodeData& n = f_.graph[static_cast<Node>(i)];
      if (uses_[i] && (n.operation == Operation::sine || n.operation == Operation::cosine))
        angles_[n.a] = 1;
    }
  }

  static std::string enclosed(const Part& t, int least) {
    return t.strength < least ? "(" + t.text + ")" : t.text;
  }
  Part compose(const NodeData& n) const {
    const Part &a = text_[n.a], &b = text_[n.b];
    Part t;
    switch (n.operation) {
      case Operation::add: t = {enclosed(a, kSum) + " + " + enclosed(b, kProduct), kSum}; break;
      case Operation::subtract:
        t = {enclosed(a, kSum) + " - " + enclosed(b, kProduct), kSum};
        break;
      case Operation::multiply:
        t = {enclosed(a, kProduct) + " * " + enclosed(b, kUnary), kProduct};
        break;
      case Operation::divide:
        t = {enclosed(a, kProduct) + " / " + enclosed(b, kUnary), kProduct};
        break;
      case Operation::negate: t = {"-" + enclosed(a, kAtom), kUnary}; break;
      case Operation::square_root: t = {"sqrt(" + a.text + ")", kAtom}; break;
      case Operation::select:
        t = {"(" + enclosed(a, kSum) + " > 0 ? " + b.text + " : 0.0)", kAtom};
        break;
      default: return t;
    }
    t.reads = a.reads;
    t.arrays = a.arrays;
    t.operations = a.operations + 1;
    if (is_binary(n.operation)) {
      t.reads.insert(t.reads.end(), b.reads.begin(), b.reads.end());
      t.arrays |= b.arrays;
      t.operations += b.operations;
    }
    return t;
  }

  void node(Node i) {
    const NodeData& n = f_.graph[i];
    Part& t = text_[i];
    switch (n.operation) {
      case Operation::constant: t = {c_literal(n.value), n.value < 0 ? kUnary : kAtom}; break;
      case Operation::input:
        t.text = std::string(array_name(n.a)) + "[" + std::to_string(n.b) + "]" + index_;
        t.arrays = 1U << n.a;
        break;
      case Operation::sine:
      case Operation::cosine: {
        const std::size_t v =
            2 * angle_name_.at(n.a) + (n.operation == Operation::cosine ? 1U : 0U);
        t = {name_of(v), kAtom, {v}};
        break;
      }
      default: {
        t = compose(n);
        const bool inlined = uses_[i] == 1 && t.text.size() < kLineLength - indent_.size();
        if (!inlined) {
          const std::size_t v = 2 * next_name(false);
          statement("const double " + name_of(v) + " = " + t.text + ";", t, {v});
          t = {name_of(v), kAtom, {v}};
        }
      }
    }
    if (angles_[i]) {
      const std::size_t k = next_name(true);
      angle_name_[i] = k;
      const std::string id = std::to_string(k);
      Part call = t;
      call.operations += kOperationsOfAnAngle;
      statement("double s" + id + ", c" + id + ";\n" + indent_ + prefix_ +
                    (any_angle_ ? "_sincos(" : "_sincos_near(") + t.text + ", &s" + id + ", &c" +
                    id + ");",
                call, {2 * k, 2 * k + 1});
    }
  }

  static constexpr std::size_t kPieceOperations = 300, kOperationsOfAnAngle = 20;
  const Function& f_;
  std::string output_, prefix_, indent_, index_;
  bool any_angle_;
  std::vector<std::uint32_t> uses_;
  std::vector<Part> text_;
  std::vector<char> angles_;
  std::unordered_map<Node, std::size_t> angle_name_;
  std::size_t names_ = 0;
  std::vector<char> is_angle_;  ///< of each name
  std::vector<Statement> statements_;
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
  return s + "double " + f.output + "[" + std::to_string(f.width()) + "]";
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

constexpr const char* kApart = R"(
/* Long functions are pieces, which compilers would put together again and be slow about. */
#if defined(__GNUC__)
#define NAME_APART __attribute__((noinline))
#else
#define NAME_APART
#endif
)";

/// Inputs within which every angle is one for _sincos_near: coupled joints turn faster.
std::string near_limit(const RobotModel& m) {
  double steepest = 1;
  for (const JointModel& j : m.joints)
    if (j.is_coupled()) steepest = std::max(steepest, std::fabs(j.coupling.ratio));
  return c_literal(std::floor(9e4 / steepest));
}

std::string with_name(std::string text, const std::string& name, const std::string& limit) {
  const std::string up = upper(name), key = "NEAR_LIMIT";
  for (std::size_t at = 0; (at = text.find(key, at)) != std::string::npos; at += limit.size())
    text.replace(at, key.size(), limit);
  for (std::size_t at = 0; (at = text.find("NAME_", at)) != std::string::npos;) {
    const bool is_macro =
        text.compare(at + 5, 5, "LANES") == 0 || text.compare(at + 5, 5, "APART") == 0;
    text.replace(at, 4, is_macro ? up : name);
    at += name.size();
  }
  return text;
}

/// Definitions of the pieces, and the calls in order.
struct Calls {
  std::string definitions, calls;
};
Calls pieces_of(Body body, const Function& f, const std::string& whole, const std::string& output,
                const std::string& lanes) {
  const bool side_by_side = !lanes.empty();
  const Pieces pieces = body.pieces();
  const auto array = [&](const std::string& type, const std::string& name) {
    return side_by_side ? type + " (*restrict " + name + ")[" + lanes + "]" : type + " *" + name;
  };
  Calls out;
  std::string arguments, parameters;
  for (const std::uint32_t a : f.arrays) {
    parameters += array(side_by_side ? "double" : "const double", array_name(a)) + ", ";
    arguments += std::string(array_name(a)) + ", ";
  }
  parameters += array("double", "kept") + ", " + array("double", output);
  arguments += "kept, " + output;
  const std::string up = upper(whole.substr(0, whole.size() - f.name.size() - 1));
  out.calls = side_by_side ? "  double kept[" + std::to_string(pieces.kept) + "][" + lanes + "];\n"
                           : "  double kept[" + std::to_string(pieces.kept) + "];\n";
  for (std::size_t i = 0; i < pieces.bodies.size(); ++i) {
    const std::string name = whole + (side_by_side ? "_block_" : "_piece_") + std::to_string(i + 1);
    out.definitions += "\nstatic " + up + "_APART void " + name + "(" + parameters + ") {\n";
    if (side_by_side)
      out.definitions +=
          "  for (size_t l = 0; l < " + lanes + "; ++l) {\n" + pieces.bodies[i] + "  }\n}\n";
    else out.definitions += pieces.bodies[i] + "}\n";
    out.calls += "  " + name + "(" + arguments + ");\n";
  }
  return out;
}

bool is_in_pieces(const Function& f) { return operation_count(f) > kMostInOneBody; }

/// Name of the array that a body writes.
std::string body_output(const Function& f) { return f.ending == Ending::none ? f.output : "part"; }

/// The calls of the loops that make the result of "part". `block`: of samples side by side.
std::string ending_calls(const std::string& name, const Function& f, bool block) {
  const std::string kind = block ? "_block" : "", rows = std::to_string(f.columns.rows());
  const auto part = [](std::size_t first) { return "part + " + std::to_string(first); };
  const bool moves = f.ending == Ending::closed_accelerations;
  const std::size_t loops =
      is_closed(f.ending) ? f.outputs.size() - closed_numbers(f.loops, f.columns.rows(), moves)
                          : f.outputs.size();
  const auto take = [&](std::size_t first) {
    std::string s = "  for (size_t k = 0; k < " + rows + "; ++k)";
    if (block)
      return s + "\n    for (size_t l = 0; l < " + upper(name) + "_LANES; ++l) " + f.output +
             "[k][l] = part[" + std::to_string(first) + " + k][l];\n";
    return s + " " + f.output + "[k] = part[" + std::to_string(first) + " + k];\n";
  };
  const auto fill = [&](const std::string& m) {
    return "  " + name + "_fill_inertia" + kind + "(part, " + m + ");\n";
  };
  const std::string lanes = block ? "[" + upper(name) + "_LANES]" : "";
  const std::string matrix = "  double m[" + rows + " * " + rows + "]" + lanes + ";\n";
  switch (f.ending) {
    case Ending::none: return "";
    case Ending::inertia: return fill(f.output);
    case Ending::accelerations:
      return matrix + fill("m") + take(loops - f.columns.rows()) + "  " + name + "_solve" + kind +
             "(m, " + f.output + ");\n";
    case Ending::motor_forces:
      return take(0) + "  " + name + "_to_motors(" + part(loops) + ", " + f.output + ", 1);\n";
    case Ending::motor_inertia:
      return fill(f.output) + "  " + name + "_inertia_to_motors(" + part(loops) + ", " + f.output +
             ");\n";
    case Ending::closed_accelerations:
      return matrix + fill("m") + take(loops - f.columns.rows()) + "  " + name +
             "_closed_accelerations(" + part(loops) + ", m, " + f.output + ");\n";
  }
  return "";
}

std::string single(const RobotModel& m, const std::string& name, const Function& f) {
  const std::string whole = name + "_" + f.name, output = body_output(f);
  std::string definitions, body;
  if (is_in_pieces(f)) {
    Calls calls = pieces_of(Body(f, output, name, "  ", "", true), f, whole, output, "");
    definitions = std::move(calls.definitions);
    body = std::move(calls.calls);
  } else {
    body = Body(f, output, name, "  ", "", true).write();
  }
  std::string s = definitions + "\nvoid " + whole + "(" + parameters(m, f) + ") {\n";
  if (f.ending != Ending::none) s += "  double part[" + std::to_string(f.outputs.size()) + "];\n";
  return s + body + ending_calls(name, f, false) + "}\n";
}

/// Whether batches are computed for several samples side by side.
bool is_side_by_side(const Function& f) {
  return !is_closed(f.ending) && operation_count(f) <= kMostSideBySide &&
         (f.ending == Ending::none || f.columns.rows() <= kMostRowsSideBySide);
}

std::string batch_one_by_one(const RobotModel& m, const std::string& name, const Function& f) {
  const std::string whole = name + "_" + f.name;
  std::string one;
  for (const std::uint32_t a : f.arrays)
    one += std::string(array_name(a)) + " + i * " + std::to_string(array_size(m, a)) + ", ";
  return "\nvoid " + whole + "_batch(" + batch_parameters(f) +
         ") {\n  for (size_t i = 0; i < count; ++i)\n    " + whole + "(" + one + f.output +
         " + i * " + std::to_string(f.width()) + ");\n}\n";
}

std::string batch(const RobotModel& m, const std::string& name, const Function& f) {
  if (!is_side_by_side(f)) return batch_one_by_one(m, name, f);
  const std::string lanes = upper(name) + "_LANES", whole = name + "_" + f.name;
  std::string block = "\nstatic void " + whole + "_block(", call = "      " + whole + "_block(";
  for (const std::uint32_t a : f.arrays) {
    block += std::string("double (*restrict ") + array_name(a) + ")[" + lanes + "], ";
    call += std::string(array_name(a)) + "_, ";
  }
  block += "double (*restrict " + f.output + ")[" + lanes + "]) {\n";
  const std::string output = body_output(f);
  if (f.ending != Ending::none)
    block += "  double part[" + std::to_string(f.outputs.size()) + "][" + lanes + "];\n";
  Body body(f, output, name, "    ", "[l]", false);
  if (is_in_pieces(f)) {
    Calls calls = pieces_of(std::move(body), f, whole, output, lanes);
    block = calls.definitions + block + calls.calls;
  } else {
    block += "  for (size_t l = 0; l < " + lanes + "; ++l) {\n" + body.write() + "  }\n";
  }
  block += ending_calls(name, f, true) + "}\n";

  std::string s = block + "\nvoid " + whole + "_batch(" + batch_parameters(f) + ") {\n";
  for (const std::uint32_t a : f.arrays)
    s += std::string("  double ") + array_name(a) + "_[" + std::to_string(array_size(m, a)) + "][" +
         lanes + "];\n";
  s += "  double " + f.output + "_[" + std::to_string(f.width()) + "][" + lanes + "];\n";
  s += "  for (size_t i = 0; i < count; i += " + lanes + ") {\n";
  s += "    const size_t samples = count - i < " + lanes + " ? count - i : " + lanes + ";\n";
  std::string one;
  for (const std::uint32_t a : f.arrays) {
    const std::string n = array_name(a), w = std::to_string(array_size(m, a));
    s += "    " + name + "_load(" + n + " + i * " + w + ", " + w + ", count - i, " + n + "_);\n";
    one += n + " + (i + l) * " + w + ", ";
  }
  const std::string width = std::to_string(f.width());
  s += "    if (" + name + "_is_near(q_, " + std::to_string(m.coordinate_count()) + ")) {\n" +
       call + f.output + "_);\n      " + name + "_store(" + f.output + "_, " + width +
       ", count - i, " + f.output + " + i * " + width + ");\n    } else {\n";
  s += "      for (size_t l = 0; l < samples; ++l)\n        " + whole + "(" + one + f.output +
       " + (i + l) * " + width + ");\n    }\n  }\n}\n";
  return s;
}

}  // namespace

std::vector<CodeFile> write_files(const RobotModel& model, const std::string& name,
                                  const std::vector<Function>& functions) {
  std::string source = "/* See " + name + ".h. Generated by ROBOMOSP. */\n#include \"" + name +
                       ".h\"\n\n#include <math.h>\n\n" +
                       with_name(kSinCos, name, near_limit(model));
  const Columns* columns = nullptr;
  const Function* closed = nullptr;
  EndingUses uses;
  ClosedUses closed_uses;
  double stabilization = 0;
  bool in_pieces = false;
  for (const Function& f : functions) {
    in_pieces = in_pieces || is_in_pieces(f);
    if (is_closed(f.ending)) {
      closed = &f;
      const bool accelerates = f.ending == Ending::closed_accelerations;
      if (accelerates) stabilization = f.stabilization;
      closed_uses.accelerations = closed_uses.accelerations || accelerates;
      closed_uses.forces = closed_uses.forces || !accelerates;
      closed_uses.inertia = closed_uses.inertia || f.ending == Ending::motor_inertia;
    }
    if (!fills_inertia(f.ending)) continue;
    columns = &f.columns;
    const bool solves = f.ending == Ending::accelerations, block = is_side_by_side(f);
    uses.solve = uses.solve || solves;
    uses.fill_block = uses.fill_block || block;
    uses.solve_block = uses.solve_block || (solves && block);
  }
  if (in_pieces) source += with_name(kApart, name, "");
  if (columns) source += ending_text(name, upper(name) + "_LANES", *columns, uses);
  if (closed)
    source += closed_text(name, closed->loops, closed->columns.rows(), closed_uses, stabilization);
  for (const Function& f : functions) source += single(model, name, f) + batch(model, name, f);
  return {{name + ".h", header(model, name, functions)}, {name + ".c", std::move(source)}};
}

}  // namespace robomosp::robot_code
