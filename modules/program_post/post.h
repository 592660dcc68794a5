// SPDX-License-Identifier: Apache-2.0
// Posting: a program of a record to the texts of a controller, by a provider of robomosp.post/1
// (layer: application, program_post).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/fault.h"
#include "kernel/registry.h"
#include "model/basics.h"
#include "program/trace.h"
#include "program_post/part_of_robot.h"
#include "program_post/posted.h"
#include "program_post/robot_cell.h"
#include "program_source/compile.h"
#include "program_source/text_faults.h"

namespace robomosp::program_post {

/// The tag of targets for controllers that move several robots, by programs that share variables.
inline constexpr const char* kSeveralRobots = "several_robots";

enum class PostForm : std::uint8_t {
  automatic,   ///< flat if the target cannot express the program as written
  structured,  ///< the program as written
  flat,        ///< its actions in a run without inputs
};
[[nodiscard]] std::string_view to_string(PostForm);

struct PostRequest {
  AnyId program;                      ///< exists
  program_source::PlaceWish place{};  ///< selects one of its places in worlds
  RobotId robot{};                    ///< that moves; number 0 = that of the world, or none
  AnyId profile{};                    ///< a controller; number 0 = none
  std::string target{};               ///< a provider; empty = that of the profile
  model::ProviderChoice params{};     ///< of the target; its name is not read
  /// A ROBOT of a program for several: only the part for its controller is posted. Empty = all.
  std::string only_robot{};
  std::string name{};  ///< on the controller; empty = that of the profile, or of the program
  PostForm form = PostForm::automatic;
  program::TraceOptions flattening{};  ///< inputs and limits of the run that flattens
  /// A program that cannot be flattened is a fault of the result and no error.
  bool lists_faults = false;
  [[nodiscard]] CellWish cell() const { return {program, place, robot}; }
};

struct PostResult {
  ProviderInfo target;
  bool has_flat = false;             ///< the target takes flattened programs
  program_source::Compiled program;  ///< the whole; spans of faults and lines are in its files
  Posted posted;
};

/// Compiles the program and writes it for the target, which may be several programs for the robots
/// of one controller. Faults that keep it from being posted are in the result, which then has files
/// that are of no use. Errors: a program that does not compile, an unknown target, options of the
/// profile or parameters out of range, a cell without a meaning (post_cell()), cancellation.
[[nodiscard]] Result<PostResult> post(const program_source::Workshop&, const PostRequest&);

/// The part of a compiled program for the controller of one robot, with the signals of the profile
/// (number 0 = none) as lines to other controllers. See PartTask.
[[nodiscard]] Result<Part> part_of(const program_source::Workshop&, AnyId profile,
                                   const program_source::Compiled&, const std::string& robot,
                                   bool keeps_lines, bool shares);

/// A fault of a post as data, with the codes program.not_posted and program.posted_otherwise.
[[nodiscard]] Fault posted_fault(const program_source::FaultyText&, const rmp_code&,
                                 const PostedFault&);

}  // namespace robomosp::program_post
