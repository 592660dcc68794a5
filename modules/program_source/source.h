// SPDX-License-Identifier: Apache-2.0
// A program while it is written: its robot, names, statements and notes (layer: data processing,
// program_source only).
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>

#include <robomosp/sdk/robot_model.h>
#include "evaluation/sources.h"
#include "model/records.h"
#include "program_source/from_records.h"
#include "program_source/source_text.h"

namespace robomosp::program_source {

/// Percent in 1.
inline constexpr double kPercent = 100;

/// A robot of a world as programs see it.
struct Arm {
  std::string name;
  const model::Robot* record = nullptr;
  std::shared_ptr<const RobotModel> model;
  Pose base_T_world;
};

/// The robot `w.robots[which]`; an error if programs cannot move its joints one by one.
[[nodiscard]] Result<Arm> arm_of(const evaluation::Sources&, const model::World& w,
                                 std::size_t which, Progress&);

/// The same of the robot of that name; an error that names the world if it has none.
[[nodiscard]] Result<Arm> arm_named(const evaluation::Sources&, WorldId, const std::string& name,
                                    Progress&);

/// A program while it is written, with the notes for its reader.
class Source {
 public:
  explicit Source(const Arm& arm) : arm_(arm) {}

  IrlNames names;
  IrlLines body;
  std::vector<std::string> notes;

  void note(const std::string& text) {
    if (std::find(notes.begin(), notes.end(), text) == notes.end()) notes.push_back(text);
  }
  /// MAIN_JOINT of values [rad or m], in degrees and mm.
  [[nodiscard]] Result<std::string> joints(std::span<const double> q) const;
  [[nodiscard]] const Arm& arm() const { return arm_; }

 private:
  const Arm& arm_;
};

/// The program. `from`: its origin, for the description; `head`: its declarations.
[[nodiscard]] WrittenProgram finished(const Source&, const std::string& name,
                                      const std::string& from, const std::string& head,
                                      const std::string& routines);

/// `world "cell"`
[[nodiscard]] std::string name_of(const evaluation::Sources&, WorldId);

}  // namespace robomosp::program_source
