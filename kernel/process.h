// SPDX-License-Identifier: Apache-2.0
// Runs a helper program in a process of its own, with limits, so that a crash, a hang or a memory
// bomb in it harms nothing else (layer: core).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

struct ProcessSpec {
  std::filesystem::path program;
  std::vector<std::string> arguments;  ///< without the program's name
  std::string_view input;              ///< goes to its standard input
  double seconds = 300;                ///< wall clock and processor time [s]
  /// Address space [bytes]; not enforced where the program itself is built with AddressSanitizer,
  /// which reserves terabytes.
  std::uint64_t memory = std::uint64_t{4} << 30;
  std::uint64_t most_output = std::uint64_t{1} << 30;  ///< of standard output [bytes]
  /// Hears every line of standard error (cut at 4096 bytes); may be empty.
  std::function<void(std::string_view)> line;
  /// In place of `line`: what it returns goes to standard input, which stays open. It may be empty.
  std::function<std::string(std::string_view)> answer;
};

/// Runs the program to its end and returns its standard output. Cancelling, the time limit and too
/// much output kill it and all that it started. The error says how it ended: not found, exit code,
/// signal ("crashed"), limit; ErrorCode::cancelled when cancelled. Needs the permit of
/// Effect::processes. [any thread; blocks]
[[nodiscard]] Result<std::string> run_process(const ProcessSpec&, Progress&);

/// What a program finds as its descriptors 0, 1 and 2; below 0 = nothing, /dev/null.
struct ProcessStreams {
  int in = -1, out = -1, err = -1;
};
struct StartedProcess {
  int id = -1;
  int failed = 0;  ///< why it does not run, by errno's numbers
};
/// Starts a program in a process group of its own (Ctrl-C at a terminal is not its), no signal
/// blocked or ignored, and leaves it to the caller. Asks for no permit. [any thread]
[[nodiscard]] StartedProcess start_process(const std::filesystem::path& program,
                                           std::vector<std::string> arguments, ProcessStreams,
                                           bool with_environment = true);

/// Where programs that ship with this one and are not for users to start lie:
/// `<executable>/../libexec/robomosp`.
[[nodiscard]] std::filesystem::path helper_program(std::string_view name);

/// Where a program of the system lies, by the environment's PATH; empty = it is not installed.
[[nodiscard]] std::filesystem::path program_on_path(std::string_view name);

}  // namespace robomosp
