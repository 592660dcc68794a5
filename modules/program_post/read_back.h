// SPDX-License-Identifier: Apache-2.0
// Posted files read back by an independent reader, and their run in the world compared with the
// program's (layer: application, program_post).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/language.h>

#include "kernel/registry.h"
#include "model/controller.h"
#include "program_post/posted.h"
#include "program_post/robot_cell.h"
#include "program_source/workshop.h"

namespace robomosp::program_post {

/// Result of reading posted files.
struct ReadBack {
  std::string reader;    ///< empty = none, or it produced no program
  std::string not_read;  ///< reason in that case, without a full stop
  struct Unread {
    std::string file;  ///< of the posted ones
    std::uint32_t line = 0;
    std::string message;
  };
  std::vector<Unread> not_said;  ///< errors of the reader: parts it left out
  std::shared_ptr<const CompiledProgram> program;
};

/// Reads them by the reader that accepts the extension of the first file and recognises its text
/// best, with the profile's pulses, speeds, tools and figure (nullptr = no profile), and with the
/// joint speed for 100 % [rad/s] (0 = the reader's own). An error for a reader that cannot be
/// created, or cancellation; everything else is in `not_read`.
Result<ReadBack> read_posted(const program_source::Workshop&, const PostedFiles&,
                             const model::Controller* profile = nullptr, double joint_speed = 0);

/// A posted program in the world beside the program itself. Angles in degrees, lengths in mm.
struct RunBeside {
  std::string not_run;  ///< reason why there is no comparison, a sentence; empty = compared
  std::size_t motions = 0, read_motions = 0;  ///< of the program, and of the program read back
  std::size_t compared = 0;                   ///< ends of motions
  double most_mm = 0, most_degrees = 0;       ///< of the tool in the world, between their ends
  double most_joint = 0;                      ///< between joints there [degrees or mm]
  double seconds = 0, read_seconds = 0;       ///< of both runs
  std::size_t changes = 0, read_changes = 0;  ///< of signals of the world
  bool has_times = true;                      ///< the target states the duration of motions
  std::size_t not_said = 0;                   ///< parts that the reader left out
  std::string reader;
  struct Difference {
    /// point, orientation, configuration, motion, until, additional, output, signal, time
    std::string kind;
    std::uint32_t file = 0, line = 0;  ///< of the program
    std::string text;                  ///< a sentence without its end
  };
  std::vector<Difference> differences;  ///< the first of each kind and line
};

/// Runs both in copies of the selected world, without contacts and torques, and compares the tool's
/// pose in the world and the joints at the ends of motions, the time, and the signals. Signals are
/// matched by their names in the profile, a controller's record (number 0 = none). `symbol`: the
/// ROBOT of the program that was posted, "" = the only one. `target` is the post that wrote the
/// files: those in C are compiled and run (run_c.h).
[[nodiscard]] Result<RunBeside> run_beside(const program_source::Workshop&, const CellWish&,
                                           AnyId profile, const std::string& symbol,
                                           const PostedFiles&, const ProviderInfo& target);
/// The result of the comparison, in a sentence.
[[nodiscard]] std::string beside_sentence(const RunBeside&);
/// Adds what the comparison found to the faults of the post; `head` is for differences without a
/// line. Speeds of joints and blends have other units at many controllers, so that other times are
/// warnings; so are all differences if the reader left a part out.
void add_beside(const RunBeside&, const rmp_span& head, Posted&);

}  // namespace robomosp::program_post
