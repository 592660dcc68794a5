// SPDX-License-Identifier: Apache-2.0
// Between a simulation and whoever looks on while it computes: rows one by one, and what is needed
// to go on from each of them (layer: application, sim).
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

/// State of a simulation at one instant, by the names of the world, so that it can go on in a world
/// that was edited. A motion that follows from the time alone has nothing but the time.
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
    std::vector<double> start;  ///< where its planned way began
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

/// An error where a robot has another number of joint values than its state.
Result<void> check_fits(std::size_t was, std::size_t is);

/// An error of a simulation that is to go on at time `from` [s], and is over before.
[[nodiscard]] Error over_before(std::optional<double> end, double from);

/// Takes rows as they are made. [the thread that computes]
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// A row of a table and the state there. May block until the next one is wanted; an error ends
  /// the simulation, which returns it.
  virtual Result<void> take(const recording::Recording& table, std::size_t row,
                            RunStatePtr state) = 0;
  /// Whether the next table may leave out its first `count` notes, since it has them from tables
  /// before.
  virtual bool has_notes(std::size_t /*count*/) { return false; }
  /// Lets the run rest behind the next row, whatever was wanted of it.
  virtual void rest_behind_next() {}
  /// The same behind the last row, now: blocks until the run is to go on. The table's notes count.
  virtual Result<void> rest(const recording::Recording&) { return {}; }
};

/// Hands on rows that are known already, from a time on, such as those of a motion along a
/// trajectory; the states are the times. None from then on is an error.
Result<void> hand_on(const recording::Recording& table, double from, RowSink& sink);

}  // namespace robomosp::sim
