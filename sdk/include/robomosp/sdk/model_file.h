// SPDX-License-Identifier: Apache-2.0
// Mechanisms as text files, so that a suite runs on robots that it was not compiled with (layer:
// contract helper, std only, not part of the ABI). The program writes them:
// robot.save_model{file=}. A line is a word and what belongs to it, in SI units; a pose is x y z
// and nine numbers of R, row by row; lines after "joint" speak of that joint; what is left out is
// as RobotModel has it.
//
//   robot "name"
//   base POSE
//   gravity x y z
//   joint "name" revolute|prismatic|spherical|free PARENT      (index of the parent, -1 = base)
//     placement POSE
//     link POSE
//     body m  x y z  Ixx Iyy Izz Ixy Iyz Ixz
//     coupling OF ratio offset
//     passive
//     limits lower upper velocity acceleration jerk force      (inf = none)
//     armature J
//     friction viscous coulomb+ coulomb-
//     spring stiffness rest
//   tip "name" JOINT POSE
//   loop "name" JOINT_A JOINT_B FIXED POSE_A POSE_B            (FIXED: sum of LoopDirection)
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp {

namespace model_file {

inline constexpr std::string_view kTypes[] = {"revolute", "prismatic", "spherical", "free"};

inline void put(std::string& out, double x) {
  char text[40];
  out += ' ';
  out.append(text, std::to_chars(text, text + sizeof text, x).ptr);
}
inline void put(std::string& out, const Pose& p) {
  for (const double x : p.p) put(out, x);
  for (const double x : p.R) put(out, x);
}
/// In quotation marks; line ends and quotation marks within become spaces.
inline void put(std::string& out, std::string_view name) {
  out += " \"";
  for (const char c : name) out += c == '"' || c == '\n' || c == '\r' ? ' ' : c;
  out += '"';
}

/// The words of one line.
class Line {
 public:
  Line(std::string_view text, int number) : rest_(text), number_(number) {}
  std::string word() {
    while (!rest_.empty() && (rest_.front() == ' ' || rest_.front() == '\t' || rest_[0] == '\r'))
      rest_.remove_prefix(1);
    if (rest_.empty()) return {};
    const bool is_quoted = rest_.front() == '"';
    if (is_quoted) rest_.remove_prefix(1);
    const std::size_t end = std::min(rest_.find_first_of(is_quoted ? "\"" : " \t\r"), rest_.size());
    std::string out(rest_.substr(0, end));
    rest_.remove_prefix(std::min(rest_.size(), end + (is_quoted ? 1 : 0)));
    return out;
  }
  double number(bool may_be_infinite = false) {
    const std::string text = word();
    double x = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), x);
    if (read.ec != std::errc() || read.ptr != text.data() + text.size() || std::isnan(x) ||
        (!may_be_infinite && std::isinf(x)))
      fault("\"" + text + "\" is not a number");
    return x;
  }
  std::int32_t integer(double least, double most) {
    const double x = number();
    if (x != std::floor(x) || x < least || x > most) {
      fault("an index is out of range");
      return -1;
    }
    return static_cast<std::int32_t>(x);
  }
  Pose pose() {
    Pose p;
    for (double& x : p.p) x = number();
    for (double& x : p.R) x = number();
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        double dot = 0;
        for (std::size_t c = 0; c < 3; ++c) dot += p.R[3 * i + c] * p.R[3 * k + c];
        if (!(std::fabs(dot - (i == k ? 1 : 0)) < 1e-6)) fault("its R is not a rotation");
      }
    return p;
  }
  void end() {
    if (!word().empty()) fault("there is unexpected text at the end");
  }
  void fault(const std::string& what) {
    if (fault_.empty()) fault_ = "line " + std::to_string(number_) + ": " + what;
  }
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  std::string_view rest_;
  int number_;
  std::string fault_;
};

inline void read_line(Line& line, RobotModel& m) {
  const std::string what = line.word();
  if (what.empty() || what.front() == '#') return;
  const double joints = static_cast<double>(m.joints.size());
  if (what == "robot") {
    m.name = line.word();
  } else if (what == "base") {
    m.base = line.pose();
  } else if (what == "gravity") {
    for (double& x : m.gravity) x = line.number();
  } else if (what == "joint") {
    JointModel j;
    j.name = line.word();
    const std::string type = line.word();
    std::size_t t = 0;
    while (t < std::size(kTypes) && kTypes[t] != type) ++t;
    if (t == std::size(kTypes)) return line.fault("\"" + type + "\" is not a joint type");
    j.type = static_cast<JointType>(t);
    j.parent = line.integer(-1, joints - 1);
    m.joints.push_back(std::move(j));
  } else if (what == "tip") {
    TipModel t;
    t.name = line.word();
    t.joint = line.integer(-1, joints - 1);
    t.tool = line.pose();
    m.tips.push_back(std::move(t));
  } else if (what == "loop") {
    LoopModel l;
    l.name = line.word();
    l.joint_a = line.integer(-1, joints - 1);
    l.joint_b = line.integer(-1, joints - 1);
    l.fixed = static_cast<std::uint32_t>(line.integer(0, kLoopWeld));
    l.in_a = line.pose();
    l.in_b = line.pose();
    m.loops.push_back(std::move(l));
  } else if (m.joints.empty()) {
    return line.fault("\"" + what + "\" before the first joint");
  } else {
    JointModel& j = m.joints.back();
    if (what == "placement") {
      j.placement = line.pose();
    } else if (what == "link") {
      j.link = line.pose();
    } else if (what == "body") {
      j.body.mass = line.number();
      for (double& x : j.body.com) x = line.number();
      Sym3& s = j.body.inertia;
      for (double* x : {&s.xx, &s.yy, &s.zz, &s.xy, &s.yz, &s.xz}) *x = line.number();
    } else if (what == "coupling") {
      j.coupling.of = line.integer(0, 1e6);
      j.coupling.ratio = line.number();
      j.coupling.offset = line.number();
    } else if (what == "passive") {
      j.passive = true;
    } else if (what == "limits") {
      for (double* x :
           {&j.lower, &j.upper, &j.max_velocity, &j.max_acceleration, &j.max_jerk, &j.max_force})
        *x = line.number(true);
    } else if (what == "armature") {
      j.armature = line.number();
    } else if (what == "friction") {
      for (double* x :
           {&j.friction.viscous, &j.friction.coulomb_positive, &j.friction.coulomb_negative})
        *x = line.number();
    } else if (what == "spring") {
      j.spring.stiffness = line.number();
      j.spring.rest = line.number();
    } else {
      return line.fault("\"" + what + "\" is not a keyword of a model");
    }
  }
  line.end();
}

}  // namespace model_file

/// Bit for bit what read_model makes the same model of.
[[nodiscard]] inline std::string model_text(const RobotModel& m) {
  using model_file::put;
  std::string out = "robot";
  put(out, m.name);
  out += "\nbase";
  put(out, m.base);
  out += "\ngravity";
  for (const double x : m.gravity) put(out, x);
  for (const JointModel& j : m.joints) {
    out += "\njoint";
    put(out, j.name);
    out += ' ';
    out += model_file::kTypes[static_cast<std::size_t>(j.type)];
    out += ' ' + std::to_string(j.parent) + "\n  placement";
    put(out, j.placement);
    out += "\n  link";
    put(out, j.link);
    out += "\n  body";
    put(out, j.body.mass);
    for (const double x : j.body.com) put(out, x);
    const Sym3& s = j.body.inertia;
    for (const double x : {s.xx, s.yy, s.zz, s.xy, s.yz, s.xz}) put(out, x);
    if (j.is_coupled()) {
      out += "\n  coupling " + std::to_string(j.coupling.of);
      put(out, j.coupling.ratio);
      put(out, j.coupling.offset);
    }
    if (j.passive) out += "\n  passive";
    out += "\n  limits";
    for (const double x :
         {j.lower, j.upper, j.max_velocity, j.max_acceleration, j.max_jerk, j.max_force})
      put(out, x);
    out += "\n  armature";
    put(out, j.armature);
    out += "\n  friction";
    for (const double x :
         {j.friction.viscous, j.friction.coulomb_positive, j.friction.coulomb_negative})
      put(out, x);
    out += "\n  spring";
    put(out, j.spring.stiffness);
    put(out, j.spring.rest);
  }
  for (const TipModel& t : m.tips) {
    out += "\ntip";
    put(out, t.name);
    out += ' ' + std::to_string(t.joint);
    put(out, t.tool);
  }
  for (const LoopModel& l : m.loops) {
    out += "\nloop";
    put(out, l.name);
    out += ' ' + std::to_string(l.joint_a) + ' ' + std::to_string(l.joint_b) + ' ' +
           std::to_string(l.fixed);
    put(out, l.in_a);
    put(out, l.in_b);
  }
  return out + '\n';
}

/// A model from its text; an error names the line.
[[nodiscard]] inline Result<RobotModel> model_from_text(std::string_view text) {
  RobotModel m;
  int number = 0;
  for (std::size_t at = 0; at < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    model_file::Line line(text.substr(at, end - at), number + 1);
    model_file::read_line(line, m);
    if (!line.fault().empty()) return error(ErrorCode::syntax, line.fault());
    at = end + 1;
  }
  for (const JointModel& j : m.joints) {
    if (!j.is_coupled()) continue;
    if (static_cast<std::size_t>(j.coupling.of) >= m.joints.size())
      return error(ErrorCode::syntax,
                   "joint \"" + j.name + "\" follows a joint that does not exist");
    const JointModel& of = m.joints[static_cast<std::size_t>(j.coupling.of)];
    if (of.is_coupled() || coordinate_count(of.type) != 1 || coordinate_count(j.type) != 1)
      return error(
          ErrorCode::syntax,
          "joint \"" + j.name +
              "\" follows a joint that is itself coupled or does not have a single coordinate");
  }
  if (m.tips.empty()) return error(ErrorCode::syntax, "it has no tip");
  m.number_coordinates();
  return m;
}

[[nodiscard]] inline Result<RobotModel> read_model(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf()))
    return error(ErrorCode::not_found, "it cannot be read", {}, "model \"" + file + "\"");
  auto model = model_from_text(text.str());
  if (!model.ok())
    return error(model.error().code, model.error().message, {}, "model \"" + file + "\"");
  return model;
}

}  // namespace robomosp
