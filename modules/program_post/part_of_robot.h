// SPDX-License-Identifier: Apache-2.0
// Divides a program of several robots into parts, one for the controller of each robot (layer: data
// processing, program_post).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/result.h>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// A line between two controllers: a signal by its name, with its number at this one.
struct Line {
  std::string_view name;
  std::int32_t number = -1;  ///< -1 = only a name
  bool has_kind = false;     ///< whether its number has an explicit kind
};

struct PartTask {
  const rmp_code* code = nullptr;  ///< without errors
  std::string_view text;           ///< of the program's own file
  std::string_view robot;          ///< a ROBOT of the program, in any letter case
  std::string_view controller;     ///< the controller of these lines, for messages; "" = none given
  std::span<const Line> lines;
  /// True if programs of all robots share variables, in one controller: lines that the record does
  /// not name are shared variables.
  bool shares = false;
  bool keeps_lines = true;  ///< keep each statement at its line of the text
};

/// Generated text for a place of the program: bytes [begin, end) of the new text.
struct MadeFor {
  std::uint32_t begin = 0, end = 0;
  rmp_span span{};
};

struct Part {
  std::string text;              ///< replaces the program's own file; "" on errors
  std::vector<Remark> remarks;   ///< parts that are left out, and those that cannot be divided; of
                                 ///< the program
  std::vector<std::string> out;  ///< names of the lines that this part sets
  std::vector<std::string> in;   ///< and of those it reads
  std::vector<std::string> shared;  ///< those of both that are variables
  std::string partner;              ///< the robot at the other end of the lines; "" = none
  std::vector<MadeFor> made_for;    ///< declarations and procedures, by place
};

/// The program of the controller of one robot, as source in the Industrial Robot Language.
///
/// The program and its processes are threads, and each runs on one controller: that of the robot it
/// moves; a thread without motions runs on the controller with which it shares most. Data shared by
/// two controllers is passed over lines named by the controller's record:
/// - a semaphore `s` released by one and acquired by the other: `s_released` and `s_acquired`, with
///   their changes counted. It is available while they differ. RELEASE waits until the previous one
///   was acquired, so that none is lost; if at most one is released at a time, it never waits;
/// - BOOL and INT written by one and read by the other: a line of the same name;
/// - the start: NAME_starts of each robot. Neither continues before the other has set the initial
///   values of its lines, whatever state they were left in.
/// Other shared data is an error at its place. If only one thread is left, it is the program, not a
/// process. A robot that is not in the program is an error. Linear in the program for each thread.
[[nodiscard]] Result<Part> part_of_robot(const PartTask&);

/// The robots named by motions, as declared.
[[nodiscard]] std::vector<std::string> robots_that_move(const rmp_code&);

}  // namespace robomosp::program_post
