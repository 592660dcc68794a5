// SPDX-License-Identifier: Apache-2.0
// Pulls: springs that pull bodies of a simulation while it is computed, such as towards the mouse
// (layer: application, sim).
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::sim {

/// A spring with damping from a point of an object or link to a place in the world.
struct Pull {
  std::uint64_t session = 0;  ///< that pulls
  std::string object;         ///< of the world; "" = the link of a robot
  std::string robot, link;    ///< link or tool
  std::optional<Vec3> point;  ///< in the frame of the object or link [m]; none = centre of mass
  Vec3 to{};                  ///< in the world [m]
  double stiffness = 0;       ///< [N/m]; 0 = kPullRate times the mass that is moved
  double force = 0;           ///< greatest force [N]; 0 = kPullWeights weights of that mass
  /// A session pulls each body at most once.
  [[nodiscard]] bool is_of(const Pull& other) const {
    return session == other.session && object == other.object && robot == other.robot &&
           link == other.link;
  }
  /// `"box"`, `link "forearm" of "arm"`
  [[nodiscard]] std::string body() const;
};

/// Stiffness per mass: an undamped body would swing with 1.5 Hz [1/s^2].
inline constexpr double kPullRate = 90;
/// Greatest force in weights on the earth.
inline constexpr double kPullWeights = 20;

/// The pulls of a live run, shared by commands that change them and by the simulation. They are
/// input from outside and are not replayed: a change acts on what is computed next. Copies share
/// their state. [any thread]
class Pulls {
 public:
  /// Begins a pull, or moves the same session's pull of the same body.
  void set(Pull pull);
  /// Ends the pulls that `is_meant` selects; returns their number.
  std::size_t end(const std::function<bool(const Pull&)>& is_meant);
  /// `is_open` is called on the simulation's thread; pulls of sessions that are closed end.
  void set_open_check(std::function<bool(std::uint64_t session)> is_open);

  struct Shown {
    Pull pull;
    /// The pulled point in the world [m] and the force [N] at the last computed step; none = no
    /// step was computed since.
    std::optional<Vec3> at;
    double force = 0;
  };
  [[nodiscard]] std::vector<Shown> shown() const;

 private:
  friend class PullsInForce;
  struct State {
    std::atomic<std::uint64_t> revision{0};
    mutable std::mutex mutex;
    std::vector<Shown> all;                              ///< guarded by mutex
    std::function<bool(std::uint64_t session)> is_open;  ///< guarded by mutex
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

/// The pulls of a simulation at the step that it computes. One thread.
class PullsInForce {
 public:
  explicit PullsInForce(Pulls pulls) : state_(std::move(pulls.state_)) {}
  /// Takes over changes at time t [s] and notes what begins and ends. True if anything changed.
  bool update(double t, std::vector<std::string>& notes);
  [[nodiscard]] const std::vector<Pull>& all() const { return all_; }
  /// Reports the pulled point in the world [m] and the force [N] of pull i.
  void report(std::size_t i, const Vec3& at, double force);
  /// Ends pull i: what it pulls is missing or is not moved by forces.
  void drop(std::size_t i, double t, std::vector<std::string>& notes);

 private:
  struct Record {
    double begin = 0, greatest = 0;  ///< [s], [N]
  };
  void end_pulls_of_closed_sessions();

  std::shared_ptr<Pulls::State> state_;
  std::uint64_t seen_ = 0;  ///< revision
  std::vector<Pull> all_;
  std::vector<Record> records_;  ///< one per pull
  std::chrono::steady_clock::time_point looked_{};
};

/// A spring between a point and a place.
struct PullSpring {
  double stiffness = 0, damping = 0;  ///< [N/m], [N s/m]
  double most = 0;                    ///< greatest force [N]
  /// `mass` is the mass that is moved. For an engine with fixed steps of `dt` [s], `least_mass` is
  /// a lower bound of the mass felt at the point, and the spring is stable; dt 0 = no bound.
  PullSpring(const Pull& pull, double mass, double least_mass = 0, double dt = 0);
  PullSpring() = default;
  /// The force on the point at `at` with a velocity [m, m/s], world axes [N].
  [[nodiscard]] Vec3 force(const Vec3& at, const Vec3& velocity, const Vec3& to) const;
};

/// A lower bound of the mass that a force in any direction feels at a point of a body [kg]; joints
/// and bodies connected with it can only increase it.
[[nodiscard]] double least_mass_at(const MassProperties& body, const Vec3& point);

}  // namespace robomosp::sim
