// SPDX-License-Identifier: Apache-2.0
// Where additional joints are at each motion of a program, as far as its text says (layer: data
// processing, program_post).
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include <robomosp/sdk/program_code.h>

#include "program_post/points.h"

namespace robomosp::program_post {

/// What the targets of a motion do to additional joints, as the joints count [degrees or mm].
struct CarriedSetting {
  bool is_unknown = false;  ///< to values that are known at run time only
  bool is_step = false;     ///< `values` are added
  std::vector<std::pair<std::size_t, double>> values;  ///< by number from 0
  [[nodiscard]] bool is_none() const { return !is_unknown && values.empty(); }
};

/// By motion. `start` has a number for each additional joint. A value is known only where it is the
/// same on every path through branches, loops and calls, and where no parallel process or interrupt
/// changes it. Linear in the size of the tables times its nesting.
[[nodiscard]] std::vector<CarriedMotion> follow_carried(const rmp_code& code,
                                                        std::span<const CarriedSetting> settings,
                                                        std::vector<double> start);

}  // namespace robomosp::program_post
