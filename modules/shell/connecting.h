// SPDX-License-Identifier: Apache-2.0
// `robomosp connect` and `irl` (layer: application, shell only).
#pragma once

#include <string>

#include "shell/irl.h"
#include "shell/program.h"

namespace robomosp::shell {

/// Options of `connect`.
struct ConnectSettings {
  std::string address, token_file, certificate;
  bool tls = false, no_tls = false;
  double seconds = 10;
};

/// Options of `irl`; the token is in a file.
struct IrlWords {
  IrlSettings settings;
  std::string token_file;
};

// Each returns the exit code.
/// Runs a program of a robot.
int run_program(const Settings&, Voice&, const IrlWords&);
int run_connect(const Settings&, Voice&, const ConnectSettings&);

}  // namespace robomosp::shell
