// SPDX-License-Identifier: Apache-2.0
// Posted files, read back by an independent reader, and what they do in the world beside what the
// program does there (layer: application, ioci only).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/language.h>

#include "ioci/core/command.h"
#include "kernel/registry.h"
#include "model/controller.h"

namespace robomosp::ioci {

using PostedFiles = std::vector<std::pair<std::string, std::string>>;  ///< names and texts

/// What a reader made of posted files.
struct ReadBack {
  std::string reader;    ///< empty = none, or it made no program of them
  std::string not_read;  ///< then why, a sentence without its end
  struct Unread {
    std::string file;  ///< of the posted ones
    std::uint32_t line = 0;
    std::string message;
  };
  std::vector<Unread> not_said;  ///< errors of the reader: what it left out
  std::shared_ptr<const CompiledProgram> program;
};

/// Reads them by the reader that takes the extension of the first file and knows its text best,
/// with the profile's pulses, speeds, tools and figure (nullptr = no profile), and with the joint
/// speed that 100 % are [rad/s] (0 = the reader's own). An error is a reader that cannot be made,
/// or being cancelled; `not_read` has all else.
Result<ReadBack> read_posted(CommandContext&, const PostedFiles&,
                             const model::Controller* profile = nullptr, double joint_speed = 0);

/// A posted program in the world beside the program itself. Angles in degrees, lengths in mm.
struct RunBeside {
  std::string not_run;  ///< why there is nothing to compare, a sentence; empty = compared
  std::size_t motions = 0, read_motions = 0;  ///< of the program, of what was read back
  std::size_t compared = 0;                   ///< ends of motions
  double most_mm = 0, most_degrees = 0;       ///< of the tool in the world, between their ends
  double most_joint = 0;                      ///< between joints there [degrees or mm]
  double seconds = 0, read_seconds = 0;       ///< of both runs
  std::size_t changes = 0, read_changes = 0;  ///< of signals of the world
  bool has_times = true;                      ///< the target says how long motions take
  std::size_t not_said = 0;                   ///< things that the reader left out
  std::string reader;
  struct Difference {
    /// point, orientation, configuration, motion, until, additional, output, signal, time
    std::string kind;
    std::uint32_t file = 0, line = 0;  ///< of the program
    std::string text;                  ///< a sentence without its end
  };
  std::vector<Difference> differences;  ///< the first of each kind and line
};

/// Runs both in copies of the world that `args` (id, world, name_there, robot) mean, without
/// contacts and torques, and compares the tool's place in the world and the joints at the ends of
/// motions, the time, and the signals. Names of signals are matched by what the profile of `args`
/// calls them. `target` is the post that wrote the files: those in C are compiled and run
/// (run_c.h).
Result<RunBeside> run_beside(CommandContext&, const Map& args, const PostedFiles&,
                             const ProviderInfo& target);
/// What was compared, in a sentence.
[[nodiscard]] std::string beside_sentence(const RunBeside&);

}  // namespace robomosp::ioci
