// SPDX-License-Identifier: Apache-2.0
// The part of a program of several robots that is for the controller of one (layer: data
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

/// A line between two controllers: a signal by its name, and its number at this one.
struct Line {
  std::string_view name;
  std::int32_t number = -1;  ///< -1 = it has a name there only
  bool has_kind = false;     ///< whether its number is of a kind of its own
};

struct PartTask {
  const rmp_code* code = nullptr;  ///< without errors
  std::string_view text;           ///< of the program's own file
  std::string_view robot;          ///< a ROBOT of the program, in any letter case
  std::string_view controller;     ///< whose lines they are, for sentences; "" = none was given
  std::span<const Line> lines;
  /// Whether programs of all robots share variables, in one controller: lines that the record does
  /// not name are such.
  bool shares = false;
  bool keeps_lines = true;  ///< whether each statement stays in its line of the text
};

/// What was made for a place of the program: bytes [begin, end) of the new text.
struct MadeFor {
  std::uint32_t begin = 0, end = 0;
  rmp_span span{};
};

struct Part {
  std::string text;              ///< in place of the program's own file; "" where there are errors
  std::vector<Remark> remarks;   ///< what is left out, and what cannot be divided; of the program
  std::vector<std::string> out;  ///< names of the lines that this part sets
  std::vector<std::string> in;   ///< and of those that it reads
  std::vector<std::string> shared;  ///< those of both that are variables
  std::string partner;              ///< the robot at the other end of the lines; "" = there is none
  std::vector<MadeFor> made_for;    ///< declarations and procedures, by place
};

/// The program of the controller of one robot, as source in the Industrial Robot Language.
///
/// The program and its processes are threads, and each runs on one controller: that of the robot
/// that it moves; one that moves nothing on that with which it shares most. What two controllers
/// share goes over lines, which the controller's record names:
/// - a semaphore `s` that one releases and the other acquires: `s_released` and `s_acquired`, whose
///   changes count. There is one when they differ. RELEASE waits until the one before was acquired,
///   so that nothing is lost; where no more than one is released at a time it never waits;
/// - BOOL and INT that one writes and the other reads: a line of the same name;
/// - the beginning: NAME_starts of each robot. Neither goes on before the other has given its lines
///   their first values, whatever they were left as.
/// Whatever else they share is an error at its place. Where one thread is left it is the program,
/// not a process. An error is a robot that is none of the program's. Linear in the program for each
/// thread.
[[nodiscard]] Result<Part> part_of_robot(const PartTask&);

/// The robots that motions name, as they are declared.
[[nodiscard]] std::vector<std::string> robots_that_move(const rmp_code&);

}  // namespace robomosp::program_post
