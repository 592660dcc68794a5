// SPDX-License-Identifier: Apache-2.0
// Extras: what a picture shows besides the bodies themselves, layers that are asked for by name
// (layer: application, scene).
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "scene/ellipsoid.h"
#include "scene/path_lines.h"

namespace robomosp::scene {

/// A robot drawn clear at other joint values than its own.
struct Ghost {
  std::string robot;      ///< of the world; of a robot on its own ""
  std::vector<double> q;  ///< [rad, m or 1]; empty = the pose "home" or zeros
  bool operator==(const Ghost&) const = default;
};

/// What a picture shows besides the bodies themselves.
struct Extras {
  bool com = false;                 ///< a MassMark for each solid, object and robot
  bool frames = false;              ///< frames of nodes, parts and links, with their names
  ShownEllipsoids ellipsoids = {};  ///< at the tools of robots
  double explode = 0;  ///< parts are moved outwards by this share of their distance, >= 0
  std::vector<double> q =
      {};  ///< joint values of a robot on its own [rad or m]; empty = "home" or 0
  /// Of robots of a world by name, instead of those that the world gives [rad or m].
  std::map<std::string, std::vector<double>> robot_q = {};
  ShownPath paths = ShownPath::line;  ///< of the trajectories of a world
  /// The robot with the tool that draws trajectories of joints; "" = the only robot, if just one.
  std::string path_robot = {};
  bool path_speeds = false;  ///< trajectories in bands of the tool's speed, with a legend
  /// Trajectories in the colours of world.check for the robot that draws them, instead of speeds:
  /// good, beyond a limit, out of reach, and with `contacts` where bodies touch.
  bool path_faults = false;
  bool labels = false;      ///< names of members
  bool dh_rows = false;     ///< the Denavit-Hartenberg row of each link
  bool dimensions = false;  ///< a box with the lengths of its sides around each body
  bool contacts = false;    ///< bodies that touch are red, of a world or of a robot on its own
  bool clearances = false;  ///< the shortest line between two bodies, with its length
  /// With `clearances`: a line for each pair of bodies nearer than this [m]; 0 = the shortest only.
  double clearances_below = 0;
  std::vector<Ghost> ghosts = {};
};

/// The names of layers that are on or off.
[[nodiscard]] std::vector<std::string> layer_names();
/// Turns a layer on or off by its name; an unknown name is an error that lists those there are.
/// `path_arrows`, `path_points` and `path_frames` include the layers before them; turning one off
/// keeps the layers before it, and `paths` off hides them all.
[[nodiscard]] Result<void> set_layer(Extras&, std::string_view name, bool is_shown);

}  // namespace robomosp::scene
