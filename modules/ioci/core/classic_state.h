// SPDX-License-Identifier: Apache-2.0
// What the program of 2006 kept of what it showed, and records do not hold (layer: application,
// ioci only).
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "model/basics.h"
#include "model/kind.h"

namespace robomosp::ioci {

/// [any thread] under `mutex`
struct ClassicState {
  /// By which codes a transform is read and set, where these are not those that its placement is
  /// kept in: PType, OType, RType.
  struct View {
    int position = 0, orientation = 3, reference = 0;
  };
  /// At which sample of a trajectory a robot was shown, and with which joint values.
  struct Point {
    std::size_t sample = 0;
    std::vector<double> q;
  };
  std::mutex mutex;
  std::map<std::pair<AnyId, std::string>, View> views;  ///< by record and member
  /// By world, robot and trajectory of it.
  std::map<std::pair<AnyId, std::pair<std::string, std::string>>, Point> points;
};

}  // namespace robomosp::ioci
