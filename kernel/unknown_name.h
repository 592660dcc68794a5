// SPDX-License-Identifier: Apache-2.0
// The error for a name that does not exist (layer: core). [any thread]
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/text.h"

namespace robomosp {

/// `there is no joint "elbo"`, with the similar ones of `known`, or all of them, as its hint.
[[nodiscard]] inline Error unknown_name(std::string_view what, std::string_view name,
                                        const std::vector<std::string>& known) {
  std::string hint = text::did_you_mean(name, known);
  if (known.empty()) hint = "There are none.";
  if (hint.empty() && known.size() <= 20)
    hint =
        "There " + std::string(known.size() == 1 ? "is " : "are ") + text::enumerate(known) + ".";
  return error(ErrorCode::unknown_name,
               "there is no " + std::string(what) + " " + text::quote(name), std::move(hint));
}

}  // namespace robomosp
