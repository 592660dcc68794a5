// SPDX-License-Identifier: Apache-2.0
// `robomosp irl`: the interpreter as a program of its own, alone, with a robot, or in a world that
// another program serves (layer: application, shell).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::shell {

/// What the command line says.
struct IrlSettings {
  std::string file, language;
  std::vector<std::string> set, bind, grip;  ///< NAME=VALUE, NAME=SIGNAL, NAME or NAME=OBJECT
  bool check = false, code = false, real_time = false, fast = false, free = false;
  std::string robot, frame, tool, record;           ///< record: file of the recording
  double most_time = 3600;                          ///< of the program [s]
  std::uint64_t most_instructions = 2'000'000'000;  ///< alone; 0 = no bound
  // of a world that is served
  std::string connect, world, token, certificate;
  bool tls = false, no_tls = false;
  double seconds = 10;
  [[nodiscard]] bool is_alone() const { return robot.empty() && connect.empty(); }
};

/// How it speaks. `line` is standard output, `tell` standard error.
struct IrlVoice {
  std::function<void(std::string_view piece)> text;  ///< what the program writes, as it comes
  std::function<void(std::string_view line)> tell;
  std::function<int(const Error&)> fail;     ///< gives the exit code of an error
  std::function<void(const Value&)> result;  ///< with --json
  bool is_json = false, is_quiet = false, is_traced = false;
};

/// HALT ended the program.
constexpr int kHalted = 5;

/// The exit code: 0 the program came to its end, 1 its source or its run has a fault, or the
/// connection was lost; kHalted; else that of the error. [the session's thread]
int run_irl(ioci::Application&, ioci::Session&, const IrlSettings&, const IrlVoice&);

/// A usage fault of the settings among each other.
Result<void> check_irl(const IrlSettings&);

}  // namespace robomosp::shell
