// SPDX-License-Identifier: Apache-2.0
// Programs of robots: their source, line by line (layer: data processing, model).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/basics.h"

namespace robomosp::model {

/// A file of a program's source. Lines joined by "\n" are its text.
struct ProgramFile {
  std::string name;  ///< without folders: "towers.irl"
  std::vector<std::string> lines;
};
template <class V>
constexpr void fields(V& v, Of<ProgramFile>) {
  v("name", &ProgramFile::name).needed().doc("Of the file, without folders.");
  v("lines", &ProgramFile::lines).file("line").doc("Its text, line by line.");
}

/// What a name of a program means in a world.
enum class BindingKind : std::uint8_t {
  robot,   ///< its robot is that of the world
  signal,  ///< its signal is that of the world
  grip,    ///< its output, or additional joint, takes and lets go
  joint,   ///< its additional joint is a joint of a robot or mechanism of the world
  free,    ///< its signal is its own: an input has a value, an output is for nobody
  point,   ///< its variable is a place on an object or frame of the world
  value,   ///< its variable is an expression over parameters of an object or of the world
};
/// Whether such a binding gives a variable what it begins with.
[[nodiscard]] constexpr bool gives_value(BindingKind k) {
  return k == BindingKind::point || k == BindingKind::value;
}
/// How files and commands name them, in order of BindingKind.
inline constexpr std::array<std::string_view, 7> kBindingWords{"robot", "signal", "grip", "joint",
                                                               "free",  "point",  "value"};
constexpr std::span<const std::string_view> words(Of<BindingKind>) { return kBindingWords; }
[[nodiscard]] constexpr std::string_view to_string(BindingKind k) {
  return kBindingWords[static_cast<std::size_t>(k)];
}

struct ProgramBinding {
  BindingKind kind = BindingKind::signal;
  std::string name;  ///< in the program; of an additional joint its number; "" = its own robot
  std::string to;  ///< in the world: robot, signal; the object that a grip takes, "" = the nearest;
                   ///< the object or frame that a point is on; of a value "" = the world itself
  std::string frame;  ///< robot: frame or object of the world for base targets; "" = its base
  std::string tool;   ///< robot, grip: link, tool or centre point; "" = the robot's tool
  std::string joint;  ///< joint: its name or number; grip: the robot that takes, "" = the own
  double reach = 0;   ///< grip: what is farther from the tool stays [m]; 0 = 5 mm
  double value = 0;   ///< free: of an input
  std::string at;     ///< point: centre point, part, node or feature of the object; "" = its frame
  /// point: from there, in its axes; expressions, "" = 0
  std::string x, y, z, roll, pitch, yaw;
  std::string expression;  ///< value
};
template <class V>
constexpr void fields(V& v, Of<ProgramBinding>) {
  v("kind", &ProgramBinding::kind).needed().doc("What the name stands for.");
  v("name", &ProgramBinding::name)
      .doc("In the program; of an additional joint its number; empty is its own robot.");
  v("to", &ProgramBinding::to)
      .doc(
          "Robot or signal of the world; of a grip the object that it takes, empty is the "
          "nearest; what a point is on; whose parameters a value has, empty is the world's.");
  v("frame", &ProgramBinding::frame)
      .doc("Frame or object of the world that the robot's targets are in; empty is its base.");
  v("tool", &ProgramBinding::tool)
      .doc("Link, tool or tool centre point that targets are for, or that takes.");
  v("joint", &ProgramBinding::joint)
      .doc(
          "Of the robot or mechanism: name or number; of a grip or point the robot that it is "
          "of.");
  v("reach", &ProgramBinding::reach)
      .unit("m")
      .at_least(0)
      .doc("A grip takes nothing that is farther from its tool; 0 is 5 mm.");
  v("value", &ProgramBinding::value).doc("Of a free input.");
  v("at", &ProgramBinding::at)
      .doc(
          "Of a point: centre point or part of the object, node of the solid, or a feature by "
          "words or number; empty is its frame.");
  v("x", &ProgramBinding::x).doc("Of a point: how far from there, an expression [m]; empty is 0.");
  v("y", &ProgramBinding::y).doc("Likewise.");
  v("z", &ProgramBinding::z).doc("Likewise.");
  v("roll", &ProgramBinding::roll)
      .doc("Of a point: turn Rz(yaw) Ry(pitch) Rx(roll) there, an expression [rad]; empty is 0.");
  v("pitch", &ProgramBinding::pitch).doc("Likewise.");
  v("yaw", &ProgramBinding::yaw).doc("Likewise.");
  v("expression", &ProgramBinding::expression)
      .doc("Of a value: over parameters of the object, or of worlds.");
}

/// A world that the program runs in, under a name of its own there.
struct ProgramPlacement {
  std::string name;  ///< unique among the programs of the world
  WorldId world;
  std::string robot;  ///< of the world, that motions mean which name none; "" = its only one
  std::vector<ProgramBinding> bindings;
};
template <class V>
constexpr void fields(V& v, Of<ProgramPlacement>) {
  v("name", &ProgramPlacement::name).needed().doc("Unique among the programs of the world.");
  v("world", &ProgramPlacement::world).needed().doc("The world that it runs in.");
  v("robot", &ProgramPlacement::robot)
      .doc("That motions mean which name none; empty is the world's only one.");
  v("bindings", &ProgramPlacement::bindings).doc("What its names mean there.");
}

struct Program {
  std::string description;
  std::string language;             ///< the provider; "" = the default one
  std::vector<ProgramFile> files;   ///< the program first, then cells, modules, lists of data
  std::string target_profile = {};  ///< of the controller that it is posted for; "" = none
  std::vector<ProgramPlacement> placements = {};
};
template <class V>
constexpr void fields(V& v, Of<Program>) {
  v("description", &Program::description).doc("What it is, for people.");
  v("language", &Program::language).doc("Provider of its language; empty is the default one.");
  v("files", &Program::files)
      .by_names()
      .doc("Its source: the program first, then what it names: cell, modules, lists of data.");
  v("target_profile", &Program::target_profile)
      .doc("Profile of the controller that it is posted for; empty is none.");
  v("placements", &Program::placements)
      .doc("Worlds that it runs in, and what its names mean there.");
}

}  // namespace robomosp::model
