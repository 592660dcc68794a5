// SPDX-License-Identifier: Apache-2.0
// Posted programs in C, compiled by the user's compiler and run in a separate process that
// writes down what they command (layer: application, program_post).
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "program_post/posted.h"

namespace robomosp::program_post {

/// What a program in C runs with.
struct CInputs {
  bool is_pa10 = false;                        ///< the library of the PA-10, else ROBOMOSP
  const PostKinematics* kinematics = nullptr;  ///< of the robot's flange
  std::vector<double> start;                   ///< joints at the start [rad or m]
  std::map<int, double> inputs;                ///< by number; they stay as they are
  std::map<int, std::string> changing;         ///< inputs that change in the run, by number
};
/// What it commanded.
struct CCommands {
  std::string not_run;  ///< why it was not run, a sentence without its end; empty = it was
  /// End of a motion.
  struct End {
    std::vector<double> q;           ///< joints [rad or m]
    std::vector<double> additional;  ///< joints that are given besides [degrees or mm]
  };
  std::vector<End> ends;
  struct Output {
    double time = 0, value = 0;
    int number = 0;
  };
  std::vector<Output> outputs;
  std::size_t cycles = 0;     ///< joint values that were sent
  double seconds = 0;         ///< of the whole program
  bool has_times = false;     ///< of motions; the PA-10's library moves at its own speeds
  std::vector<double> rates;  ///< greatest of each joint between two cycles [rad/s or m/s]
};

/// Compiles and runs them. The compiler is that of the environment variable ROBOMOSP_CC, else cc,
/// gcc or clang on PATH, and never what a record says. Needs the permit of Effect::processes. All
/// that keeps it from running is reported by `not_run`; an error is being cancelled.
[[nodiscard]] Result<CCommands> run_c(const PostedFiles&, const CInputs&, Progress&);

}  // namespace robomosp::program_post
