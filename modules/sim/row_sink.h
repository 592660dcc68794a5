// SPDX-License-Identifier: Apache-2.0
// Passes rows of a running simulation to an observer, one by one, with the state needed to continue
// from each (layer: application, sim).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

#include "recording/recording.h"

namespace robomosp::sim {

/// State of a simulation at one instant, by names of the world, so that it can continue in an
/// edited world. For a motion determined by time alone, it is only the time.
struct RunState {
  struct Body {
    std::string name;
    Pose pose;                            ///< world_T_object
    Vec3 velocity{}, angular_velocity{};  ///< of its origin, world axes [m/s, rad/s]
    std::array<double, 4> quaternion{};   ///< as recorded, w first: q and -q are one rotation
  };
  struct Grip {
    std::string joint;
    double force = 0, speed = 0;  ///< [N or N m], [m/s or rad/s]
  };
  struct Robot {
    std::string name;
    std::vector<double> start;  ///< beginning of its planned path
    std::vector<double> q, qd;
    std::vector<double> memory;  ///< of its controller
    std::vector<Grip> grips;     ///< joints that press
  };
  struct Held {
    std::string robot, joint, object;  ///< the joint moves the body that holds the object
  };
  double time = 0;  ///< [s]
  std::vector<Body> objects;
  std::vector<Robot> robots;
  std::vector<Held> held;

  [[nodiscard]] const Robot* robot(std::string_view name) const {
    for (const Robot& r : robots)
      if (r.name == name) return &r;
    return nullptr;
  }
};
using RunStatePtr = std::shared_ptr<const RunState>;

/// An error if a robot's number of joint values differs from its state.
Result<void> check_fits(std::size_t was, std::size_t is);

/// The error of a simulation that should continue at time `from` [s] but ends before.
[[nodiscard]] Error over_before(std::optional<double> end, double from);

/// Receives rows as they are computed. [the thread that computes]
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// Receives a row of a table and the state at it. May block until the next one is requested; an
  /// error ends the simulation, which returns it.
  virtual Result<void> take(const recording::Recording& table, std::size_t row,
                            RunStatePtr state) = 0;
  /// True if the next table may omit its first `count` notes, received with previous tables.
  virtual bool has_notes(std::size_t /*count*/) { return false; }
  /// The next row is the last one: nothing follows it.
  virtual void end_with_next() {}
  /// Pauses the run after the next row, regardless of requests.
  virtual void rest_behind_next() {}
  /// The same after the last row, now: blocks until the run should continue. The table's notes are
  /// used.
  virtual Result<void> rest(const recording::Recording&) { return {}; }
};

/// Passes on rows that are known in advance, from a time on, such as those of a motion along a
/// trajectory; the states are the times. No row from then on is an error.
Result<void> hand_on(const recording::Recording& table, double from, RowSink& sink);

}  // namespace robomosp::sim
