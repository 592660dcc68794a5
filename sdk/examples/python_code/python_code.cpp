// SPDX-License-Identifier: Apache-2.0
// A generator of one's own: a robot's kinematics and dynamics as one Python module, with nothing
// needed but the standard library. Where NumPy is installed, every joint value may also be an array
// of samples, and every answer then is one. The robot's numbers are a table; the algorithms below
// it are those of module.h: the same text for every robot, which a user can read.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/robot_code.h>

#include "module.h"

namespace {

using namespace robomosp;

/// A name that Python takes for a module and that is no word of its own.
bool is_module_name(std::string_view s) {
  static constexpr std::string_view kWords[] = {
      "and",    "as",   "assert", "async",  "await",    "break", "class", "continue", "def",
      "del",    "elif", "else",   "except", "finally",  "for",   "from",  "global",   "if",
      "import", "in",   "is",     "lambda", "nonlocal", "not",   "or",    "pass",     "raise",
      "return", "try",  "while",  "with",   "yield",    "None",  "True",  "False"};
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  return !s.empty() && is_letter(s.front()) && std::all_of(s.begin(), s.end(), [&](char c) {
    return is_letter(c) || (c >= '0' && c <= '9');
  }) && std::find(std::begin(kWords), std::end(kWords), s) == std::end(kWords);
}

/// All digits, and always the same ones: what is read back is the same double.
std::string number(double x) {
  char text[40];
  std::string s(text, std::to_chars(text, text + sizeof text, x).ptr);
  return s.find_first_of(".e") == std::string::npos ? s + ".0" : s;
}
template <class Numbers>
std::string tuple(const Numbers& all) {
  std::string s = "(";
  for (const double x : all) s += number(x) + ", ";
  s.pop_back();
  s.back() = ')';
  return s;
}
/// A Python string: names are the user's and may hold anything.
std::string quoted(std::string_view text) {
  constexpr char kHex[] = "0123456789abcdef";
  std::string s = "\"";
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') s += {'\\', c};
    else if (u >= 0x20 && u < 0x7f) s += c;
    else s += {'\\', 'x', kHex[u >> 4], kHex[u & 15]};
  }
  return s + "\"";
}

std::string joint_row(const JointModel& j) {
  const Sym3& I = j.body.inertia;
  const JointFriction& f = j.friction;
  return "    Joint(" + quoted(j.name) + ", " + std::to_string(j.parent) + ", " +
         (j.type == JointType::prismatic ? "True" : "False") + ",\n          " +
         tuple(j.placement.R) + ", " + tuple(j.placement.p) + ",\n          " +
         number(j.body.mass) + ", " + tuple(j.body.com) + ", " +
         tuple(std::array{I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz}) + ",\n          " +
         number(j.armature) + ", " +
         tuple(std::array{f.viscous, f.coulomb_positive, f.coulomb_negative}) + ", " +
         tuple(std::array{j.spring.stiffness, j.spring.rest}) + "),\n";
}

Error refused(const RobotModel& m, std::string what, std::string hint) {
  return error(ErrorCode::unsupported, std::move(what), std::move(hint),
               "robot \"" + m.name + "\"");
}

class PythonCode final : public RobotCodeGenerator {
 public:
  Result<std::vector<CodeFile>> generate(const RobotModel& model, std::string_view name,
                                         std::uint32_t parts, const Params&,
                                         Progress& progress) const override {
    if (!is_module_name(name))
      return error(
          ErrorCode::invalid_argument,
          "\"" + std::string(name) + "\" is not a valid name of a Python module",
          "Use letters, digits and underscores, starting with a letter, and no Python keyword.");
    if ((parts & kCodeAll) == 0)
      return error(ErrorCode::invalid_argument, "no part was selected", "Choose at least one.");
    if (progress.cancelled()) return error(ErrorCode::cancelled, "code generation was cancelled");
    if (!model.is_simple())
      return refused(model, "it has joints of several coordinates, or joints that follow others",
                     "Choose the generator c99.");
    if ((parts & (kCodeInverseDynamics | kCodeInertia | kCodeForwardDynamics)) &&
        !model.loops.empty())
      return refused(model,
                     "its dynamics include closed loops, which the generated code would ignore",
                     "Choose the parts forward_kinematics and jacobian.");

    std::string text = python_code::kHead;
    text +=
        "NAME = " + quoted(model.name) + "\nGRAVITY = " + tuple(model.gravity) + "\nJOINTS = [\n";
    for (const JointModel& j : model.joints) text += joint_row(j);
    text += "]\n# Name, joint that carries it, rotation and origin in its frame.\nTIPS = [\n";
    for (const TipModel& t : model.tips)
      text += "    (" + quoted(t.name) + ", " + std::to_string(t.joint) + ", " + tuple(t.tool.R) +
              ", " + tuple(t.tool.p) + "),\n";
    text += std::string("]\n") + python_code::kVectors;
    // A part brings what it needs.
    constexpr std::uint32_t kDynamics = kCodeInverseDynamics | kCodeInertia | kCodeForwardDynamics;
    if (parts & kCodeForwardKinematics) text += python_code::kForwardKinematics;
    if (parts & kCodeJacobian) text += python_code::kJacobian;
    if (parts & kDynamics) text += python_code::kInverseDynamics;
    if (parts & (kCodeInertia | kCodeForwardDynamics)) text += python_code::kInertia;
    if (parts & kCodeForwardDynamics) text += python_code::kForwardDynamics;
    return std::vector<CodeFile>{{std::string(name) + ".py", std::move(text)}};
  }
};

}  // namespace

RMP_PLUGIN("org.example.python_code", "0.1.0", "Apache-2.0", "A code generator as an example.",
           RMP_PROVIDER_NO_PARAMS(PythonCode, "python",
                                  "One Python module, for floats and for NumPy arrays of samples.",
                                  "python"))
