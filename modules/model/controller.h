// SPDX-License-Identifier: Apache-2.0
// Controllers: the data needed to post a program to one (layer: data processing, model). As in
// programs of robots, angles are in degrees and lengths of axes in mm.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/basics.h"
#include "model/placement.h"

namespace robomosp::model {

/// An axis of the controller: value = sign * joint + offset. If a robot is given, the axes of the
/// robot apply.
struct ControllerAxis {
  std::string name;
  std::int32_t joint = 1;  ///< of the robot, 1 is the first; of the additional joints if external
  bool is_external = false;
  bool is_linear = false;            ///< in mm, else degrees
  std::optional<std::int32_t> sign;  ///< empty = the robot's, 1 if unknown
  double offset = 0;                 ///< [degrees or mm]; 0 without a sign = the robot's
  double pulses = 0;                 ///< per degree or mm; 0 = not known
  double lower = 0, upper = 0;
};
template <class V>
constexpr void fields(V& v, Of<ControllerAxis>) {
  v("name", &ControllerAxis::name).needed().doc("Name such as A1.");
  v("joint", &ControllerAxis::joint)
      .range(1, 1000)
      .doc(
          "Number of the robot's joint, 1 is the first; of the additional joint if it is "
          "external.");
  v("is_external", &ControllerAxis::is_external).doc("Whether it is an additional joint.");
  v("is_linear", &ControllerAxis::is_linear).doc("Whether it is in mm instead of degrees.");
  v("sign", &ControllerAxis::sign)
      .range(-1, 1)
      .doc("1, or -1 if it turns in the opposite direction.");
  v("offset", &ControllerAxis::offset).doc("Added to the joint, degrees or mm.");
  v("pulses", &ControllerAxis::pulses)
      .doc("Pulses of the encoder per degree or mm; 0 if not known.");
  v("lower", &ControllerAxis::lower).doc("Lower limit, degrees or mm; applies if below upper.");
  v("upper", &ControllerAxis::upper).doc("Upper limit, degrees or mm.");
}

/// The name of a program's signal at the controller.
struct ControllerSignal {
  std::string name;
  std::string target;
  std::int32_t number = -1;
  std::string kind;
  bool is_inverted = false;
};
template <class V>
constexpr void fields(V& v, Of<ControllerSignal>) {
  v("name", &ControllerSignal::name).needed().doc("Name in the program.");
  v("target", &ControllerSignal::target).doc("Name at the controller; empty: by number.");
  v("number", &ControllerSignal::number)
      .at_least(-1)
      .doc("Number at the controller; -1: as in the program.");
  v("kind", &ControllerSignal::kind).doc("A keyword of the target, such as hand.");
  v("is_inverted", &ControllerSignal::is_inverted).doc("Whether the signal is inverted.");
}

/// A tool or a frame stored in the controller.
struct ControllerPlace {
  std::string name;
  std::int32_t number = -1;
  Placement placement;
  double mass = 0;
};
template <class V>
constexpr void fields(V& v, Of<ControllerPlace>) {
  v("name", &ControllerPlace::name).needed().doc("Unique among its kind.");
  v("number", &ControllerPlace::number).at_least(-1).doc("Number at the controller; -1 is none.");
  v("placement", &ControllerPlace::placement)
      .flat()
      .doc("Pose of a tool on the flange, or of a frame in the robot's base.");
  v("mass", &ControllerPlace::mass).unit("kg").at_least(0).doc("Mass of a tool.");
}

/// Another setting of a target.
struct ControllerOption {
  std::string name, value;
};
template <class V>
constexpr void fields(V& v, Of<ControllerOption>) {
  v("name", &ControllerOption::name).needed().doc("Name, as listed on the target's page.");
  v("value", &ControllerOption::value).doc("Value as text.");
}

struct Controller {
  std::string description;
  std::string target;  ///< provider of robomosp.post/1
  std::string program;
  std::vector<ControllerAxis> axes;
  std::vector<ControllerSignal> signals;
  std::vector<ControllerPlace> tools, frames;
  std::string tool, frame;
  std::vector<std::string> prologue, epilogue;
  std::int32_t length_digits = 3, angle_digits = 4, speed_digits = 3;
  std::int32_t max_points = 0, max_lines = 0, max_bytes = 0;
  double max_speed = 0;
  double max_speed_ori = 0;
  std::vector<ControllerOption> options;
  Parametric parametric = {};
};
template <class V>
constexpr void fields(V& v, Of<Controller>) {
  v("description", &Controller::description).doc("Its description.");
  v("parametric", &Controller::parametric).flat().doc("Parameters and expressions.");
  v("target", &Controller::target).needed().doc("Post that writes its language, such as krl.");
  v("program", &Controller::program)
      .doc("Name of programs on the controller; empty is that of the program.");
  v("axes", &Controller::axes)
      .by_names()
      .file("axis")
      .doc("In the controller's order; without any the robot's joints are used unchanged.");
  v("signals", &Controller::signals)
      .by_names()
      .doc("Names and numbers of signals at the controller.");
  v("tools", &Controller::tools).by_names().doc("Tools stored in the controller.");
  v("frames", &Controller::frames).by_names().doc("Frames stored in the controller.");
  v("tool", &Controller::tool).file("default_tool").doc("The tool with which programs begin.");
  v("frame", &Controller::frame).file("default_frame").doc("The frame with which programs begin.");
  v("prologue", &Controller::prologue)
      .doc("Lines of its language after the beginning of a program.");
  v("epilogue", &Controller::epilogue).doc("Lines of its language at a program's end.");
  v("length_digits", &Controller::length_digits).range(0, 12).doc("Decimals of lengths in mm.");
  v("angle_digits", &Controller::angle_digits).range(0, 12).doc("Decimals of angles in degrees.");
  v("speed_digits", &Controller::speed_digits).range(0, 12).doc("Decimals of speeds.");
  v("max_points", &Controller::max_points)
      .at_least(0)
      .doc("Greatest number of points of a program; 0 is the target's own.");
  v("max_lines", &Controller::max_lines)
      .at_least(0)
      .doc("Greatest number of lines of a file; 0 is the target's own.");
  v("max_bytes", &Controller::max_bytes)
      .at_least(0)
      .doc("Greatest number of bytes of a file; 0 is any number.");
  v("max_speed", &Controller::max_speed)
      .unit("m/s")
      .at_least(0)
      .doc("Greatest speed of the tool; 0 if not known.");
  v("max_speed_ori", &Controller::max_speed_ori)
      .unit("rad/s")
      .at_least(0)
      .doc("Greatest angular speed of the tool; 0 if not known.");
  v("options", &Controller::options).by_names().doc("Further options of the target.");
}

}  // namespace robomosp::model
