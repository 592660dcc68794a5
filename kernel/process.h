// SPDX-License-Identifier: Apache-2.0
// Runs a helper program in a separate process with limits, so that a crash, a hang or excessive
// memory use in it cannot harm this program (layer: core).
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
  std::string_view input;              ///< written to its standard input
  double seconds = 300;                ///< wall clock and processor time [s]
  /// Address space [bytes]; not enforced where the program itself is built with AddressSanitizer,
  /// which reserves terabytes.
  std::uint64_t memory = std::uint64_t{4} << 30;
  std::uint64_t most_output = std::uint64_t{1} << 30;  ///< of standard output [bytes]
  /// Called with every line of standard error (cut at 4096 bytes); may be empty.
  std::function<void(std::string_view)> line;
  /// Instead of `line`: its return value is written to standard input, which stays open. May be
  /// empty.
  std::function<std::string(std::string_view)> answer;
};

/// Runs the program to its end and returns its standard output. On cancellation, timeout or too
/// much output, it kills the program and all processes it started. The error gives the cause: not
/// found, exit code, signal ("crashed"), limit; ErrorCode::cancelled if cancelled. Needs the permit
/// of Effect::processes. [any thread; blocks]
[[nodiscard]] Result<std::string> run_process(const ProcessSpec&, Progress&);

/// A new program's descriptors 0, 1 and 2; below 0 = /dev/null.
struct ProcessStreams {
  int in = -1, out = -1, err = -1;
};
struct StartedProcess {
  int id = -1;
  int failed = 0;  ///< errno if the program could not be started
};
/// Starts a program in a separate process group (so Ctrl-C at a terminal does not reach it), with
/// no signal blocked or ignored; the caller must wait for it. Checks no permit. [any thread]
[[nodiscard]] StartedProcess start_process(const std::filesystem::path& program,
                                           std::vector<std::string> arguments, ProcessStreams,
                                           bool with_environment = true);

/// Path of a program that ships with this one and is not started by users:
/// `<executable>/../libexec/robomosp`.
[[nodiscard]] std::filesystem::path helper_program(std::string_view name);

/// Path of a system program, from the environment's PATH; empty = not installed.
[[nodiscard]] std::filesystem::path program_on_path(std::string_view name);

}  // namespace robomosp
