// SPDX-License-Identifier: Apache-2.0
// Controllers: what a program needs to be posted to one, as data (layer: data processing, model).
// As with programs of robots, angles are in degrees and lengths of axes in mm.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/basics.h"
#include "model/placement.h"

namespace robomosp::model {

/// An axis of the controller: value = sign * joint + offset. Robots have axes of their own, which
/// count where a robot is named.
struct ControllerAxis {
  std::string name;
  std::int32_t joint = 1;  ///< of the robot, 1 is the first; of the additional joints if external
  bool is_external = false;
  bool is_linear = false;            ///< in mm, else degrees
  std::optional<std::int32_t> sign;  ///< none = the robot's, 1 where that is not known
  double offset = 0;                 ///< [degrees or mm]; 0 without a sign = the robot's
  double pulses = 0;                 ///< per degree or mm; 0 = not known
  double lower = 0, upper = 0;
};
template <class V>
constexpr void fields(V& v, Of<ControllerAxis>) {
  v("name", &ControllerAxis::name).needed().doc("Such as A1.");
  v("joint", &ControllerAxis::joint)
      .range(1, 1000)
      .doc("Of the robot, 1 is the first; of the additional joints where it is external.");
  v("is_external", &ControllerAxis::is_external).doc("Whether it is an additional joint.");
  v("is_linear", &ControllerAxis::is_linear).doc("Whether it is in mm instead of degrees.");
  v("sign", &ControllerAxis::sign).range(-1, 1).doc("1, or -1 where it turns the other way.");
  v("offset", &ControllerAxis::offset).doc("Added to the joint, degrees or mm.");
  v("pulses", &ControllerAxis::pulses).doc("Of the encoder per degree or mm; 0 is not known.");
  v("lower", &ControllerAxis::lower).doc("Limit, degrees or mm; counts where below upper.");
  v("upper", &ControllerAxis::upper).doc("Limit, degrees or mm.");
}

/// How a signal of programs is called at the controller.
struct ControllerSignal {
  std::string name;
  std::string target;
  std::int32_t number = -1;
  std::string kind;
  bool is_inverted = false;
};
template <class V>
constexpr void fields(V& v, Of<ControllerSignal>) {
  v("name", &ControllerSignal::name).needed().doc("In the program.");
  v("target", &ControllerSignal::target).doc("Name at the controller; empty is by number.");
  v("number", &ControllerSignal::number).at_least(-1).doc("There; -1 is as the program says.");
  v("kind", &ControllerSignal::kind).doc("A word of the target, such as hand.");
  v("is_inverted", &ControllerSignal::is_inverted).doc("Whether on there is off here.");
}

/// A tool or a frame that the controller keeps.
struct ControllerPlace {
  std::string name;
  std::int32_t number = -1;
  Placement placement;
  double mass = 0;
};
template <class V>
constexpr void fields(V& v, Of<ControllerPlace>) {
  v("name", &ControllerPlace::name).needed().doc("Unique among its kind.");
  v("number", &ControllerPlace::number).at_least(-1).doc("At the controller; -1 is none.");
  v("placement", &ControllerPlace::placement)
      .flat()
      .doc("Of a tool on the flange; of a frame in the robot's base.");
  v("mass", &ControllerPlace::mass).unit("kg").at_least(0).doc("Of a tool.");
}

/// Whatever else a target asks for.
struct ControllerOption {
  std::string name, value;
};
template <class V>
constexpr void fields(V& v, Of<ControllerOption>) {
  v("name", &ControllerOption::name).needed().doc("As the target's page tells.");
  v("value", &ControllerOption::value).doc("As text.");
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
  v("description", &Controller::description).doc("What it is, for people.");
  v("parametric", &Controller::parametric).flat().doc("Parameters and expressions.");
  v("target", &Controller::target).needed().doc("Post that writes its language, such as krl.");
  v("program", &Controller::program).doc("Name of programs there; empty is the program's own.");
  v("axes", &Controller::axes)
      .by_names()
      .file("axis")
      .doc("In the controller's order; without any the robot's joints count as they are.");
  v("signals", &Controller::signals).by_names().doc("Names and numbers of signals there.");
  v("tools", &Controller::tools).by_names().doc("That the controller keeps.");
  v("frames", &Controller::frames).by_names().doc("That the controller keeps.");
  v("tool", &Controller::tool)
      .file("default_tool")
      .doc("Of the tools: the one that programs begin with.");
  v("frame", &Controller::frame)
      .file("default_frame")
      .doc("Of the frames: the one that programs begin with.");
  v("prologue", &Controller::prologue).doc("Lines of its language behind a program's beginning.");
  v("epilogue", &Controller::epilogue).doc("Lines of its language at a program's end.");
  v("length_digits", &Controller::length_digits).range(0, 12).doc("Of mm, behind the point.");
  v("angle_digits", &Controller::angle_digits).range(0, 12).doc("Of degrees, behind the point.");
  v("speed_digits", &Controller::speed_digits).range(0, 12).doc("Of speeds, behind the point.");
  v("max_points", &Controller::max_points).at_least(0).doc("Of a program; 0 is the target's own.");
  v("max_lines", &Controller::max_lines).at_least(0).doc("Of a file; 0 is the target's own.");
  v("max_bytes", &Controller::max_bytes).at_least(0).doc("Of a file; 0 is any number.");
  v("max_speed", &Controller::max_speed)
      .unit("m/s")
      .at_least(0)
      .doc("Of the tool; 0 is not known.");
  v("max_speed_ori", &Controller::max_speed_ori)
      .unit("rad/s")
      .at_least(0)
      .doc("Of the tool's turning; 0 is not known.");
  v("options", &Controller::options).by_names().doc("Whatever else its target asks for.");
}

}  // namespace robomosp::model
