// SPDX-License-Identifier: Apache-2.0
// `robomosp post` and `post test` (layer: application, shell only).
#pragma once

#include <string>

#include "shell/post_test.h"
#include "shell/program.h"

namespace robomosp::shell {

/// What `robomosp post` was asked for.
struct PostSettings {
  std::string file, target, profile, robot, folder, form = "automatic", name, templates;
  std::string world, side_by_side, picture, plot, only_robot;
  bool check = false, run_check = false, overwrite = false;
};

// Each returns the exit code.
int run_post(const Settings&, const Voice&, const PostSettings&);
/// What a target makes of the sample programs and of each construct.
int run_post_test(const Settings&, const Voice&, const PostTest&);

}  // namespace robomosp::shell
