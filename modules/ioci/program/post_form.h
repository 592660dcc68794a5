// SPDX-License-Identifier: Apache-2.0
// The argument `form` of commands that post programs (layer: application, ioci only).
#pragma once

#include <string>

#include "ioci/core/commands.h"
#include "program_post/post.h"

namespace robomosp::ioci {

[[nodiscard]] inline program_post::PostForm form_of(const Map& args) {
  const std::string form = text_of(args, "form");
  return form == "structured" ? program_post::PostForm::structured
         : form == "flat"     ? program_post::PostForm::flat
                              : program_post::PostForm::automatic;
}

}  // namespace robomosp::ioci
