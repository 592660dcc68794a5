// SPDX-License-Identifier: Apache-2.0
// `robomosp irl`: the interpreter as a separate program: alone, with a robot, or in a world of a
// server (layer: application, shell).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::shell {

/// Options of the command line.
struct IrlSettings {
  std::string file, language;
  std::vector<std::string> set, bind, grip;  ///< NAME=VALUE, NAME=SIGNAL, NAME or NAME=OBJECT
  bool check = false, code = false, real_time = false, fast = false, free = false;
  std::string robot, frame, tool, record;           ///< record: file of the recording
  double most_time = 3600;                          ///< of the program [s]
  std::uint64_t most_instructions = 2'000'000'000;  ///< alone; 0 = unlimited
  // for a world on a server
  std::string connect, world, token, certificate;
  bool tls = false, no_tls = false;
  double seconds = 10;
  [[nodiscard]] bool is_alone() const { return robot.empty() && connect.empty(); }
};

/// Output functions. `line` is standard output, `tell` standard error.
struct IrlVoice {
  std::function<void(std::string_view piece)> text;  ///< output of the program, as it is written
  std::function<void(std::string_view line)> tell;
  std::function<int(const Error&)> fail;     ///< returns the exit code of an error
  std::function<void(const Value&)> result;  ///< with --json
  bool is_json = false, is_quiet = false, is_traced = false;
};

/// HALT ended the program.
constexpr int kHalted = 5;

/// Returns the exit code: 0 the program ended normally, 1 a fault in its source or its run, or a
/// lost connection; kHalted; else that of the error. [the session's thread]
int run_irl(ioci::Application&, ioci::Session&, const IrlSettings&, const IrlVoice&);

/// Checks combinations of settings for usage errors.
Result<void> check_irl(const IrlSettings&);

}  // namespace robomosp::shell
