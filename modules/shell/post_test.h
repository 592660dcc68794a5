// SPDX-License-Identifier: Apache-2.0
// `robomosp post test`: what a target makes of the sample programs and of every construct of the
// language (layer: application).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>
#include "ioci/core/application.h"
#include "kernel/value.h"

namespace robomosp::shell {

struct PostTest {
  std::string what;           ///< a target, plugin.so, pack.post, a folder, or a controller's .ctl
  std::string robot = "ur5";  ///< of the library, or a .rbt file; "none" = none
  std::string profile;        ///< a controller of the library, or a .ctl file
  std::string reader;         ///< folder for a reader's skeleton; "" = none
  std::vector<std::string> programs;  ///< files besides those that are shipped
  bool brief = false;                 ///< only what is refused or wrong
};

/// Runs a command of the program.
using Ask = std::function<Result<Value>(const char* command, const Map& args)>;

/// Prints the tables by `line`; what programs read is in `report`. The exit code: 0 nothing is
/// wrong, 1 something is (a construct that is lost, a fault without a place, unequal files).
Result<int> test_post(ioci::Application&, const Ask&, const PostTest&,
                      const std::function<void(const std::string&)>& line, Map& report);

}  // namespace robomosp::shell
