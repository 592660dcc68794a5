// SPDX-License-Identifier: Apache-2.0
// Records of controllers as posts, readers and checks see them (layer: data processing, robotics).
#pragma once

#include <cstddef>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/result.h>

#include "model/controller.h"
#include "robotics/maker_axes.h"
#include "robotics/rail.h"

namespace robomosp::robotics {

/// A controller's record as posts see it. Owns what the views refer to, and cannot be moved: views
/// refer to short strings in place.
struct ControllerProfile {
  ControllerProfile() = default;
  ControllerProfile(const ControllerProfile&) = delete;
  ControllerProfile& operator=(const ControllerProfile&) = delete;

  model::Controller record;
  std::string name, prologue, epilogue;
  std::vector<PostAxis> axes;
  std::deque<std::string> carried;  ///< names of axes that carry() adds
  std::vector<PostSignal> signals;
  std::vector<std::string> shared;  ///< names of the last of them
  std::string number, partner;      ///< values of options
  std::vector<PostPlace> tools, frames;
  std::vector<PostOption> options;
  MakerAxes maker;  ///< of the robot, where one is named
  PostProfile view;

  /// Fills the view from `record` and `name`; call it once, before all else. Errors: an axis with
  /// sign 0, an unknown name of the initial tool or frame.
  [[nodiscard]] Result<void> fill();

  /// Takes the maker's axes of the robot, which count instead of signs and offsets of the record;
  /// its names, pulses and limits stay. Returns a sentence for each contradiction.
  /// With `rail` they are those of the arm behind its first joints, as axes_behind_rail() has them.
  [[nodiscard]] Result<std::vector<std::string>> use(MakerAxes&& of_robot, const std::string& robot,
                                                     std::span<const RailJoint> rail = {});

  /// An additional joint of a program that is a joint of the world.
  struct AdditionalAxis {
    std::size_t number = 0;  ///< from 1
    bool is_linear = false;
    double sign = 1, offset = 0;
    double lower = 0, upper = 0;  ///< [degrees or mm]
    std::string name;             ///< of the maker; empty = it has none
  };
  /// Adds external axes for additional joints that have none, where the record names none: E1, E2
  /// and so on. For `bound` joints only, or, where no axis is external, for all `slots`.
  void carry(std::span<const AdditionalAxis> bound, std::size_t slots);

  /// Signals that are variables which programs share: with the one of that name. This is the
  /// `arm`th robot of its controller, 1 is the first; the option arm_ROBOT says otherwise.
  void share(const std::vector<std::string>& names, const std::string& robot, std::size_t arm,
             const std::string& with);
};

}  // namespace robomosp::robotics
