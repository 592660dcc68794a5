// SPDX-License-Identifier: Apache-2.0
// `robomosp run`, `eval` and `classic` (layer: application, shell only).
#pragma once

#include <string>
#include <vector>

#include "shell/program.h"

namespace robomosp::shell {

/// What `run --sandbox` was given beside the file.
struct Sandbox {
  bool is_wanted = false, without_seccomp = false;
  std::string allow = "reads,edits,simulates", limits;
};

// Each returns the exit code.
int run_script(const Settings&, const Voice&, const std::string& file,
               const std::vector<std::string>& args);
/// A script of a stranger: in a separate process, with some effects only.
int run_sandboxed(const Settings&, const Voice&, const std::string& file,
                  const std::vector<std::string>& args, const Sandbox&);
int run_eval(const Settings&, const Voice&, const std::string& code);
/// Words of one line, or several lines when every argument is more than a word.
[[nodiscard]] std::vector<std::string> classic_lines(const std::vector<std::string>& arguments);
int run_classic(const Settings&, const Voice&, const std::vector<std::string>& lines);

}  // namespace robomosp::shell
