// SPDX-License-Identifier: Apache-2.0
// The clearance of one robot as a function of its joints, with its gradient.
#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "collision/collision.h"
#include "collision/random.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision {
namespace {

constexpr std::size_t kSamples = 64;  ///< that tell which pairs can be kept apart
constexpr std::uint64_t kSeed = 1;
/// Of the norm that sums up how far pairs are within the influence of a clearance field: the
/// nearest count most, but one that the task holds near does not hide the others.
constexpr double kNorm = 4;
constexpr double kVaries = 0.01;  ///< of the influence: a distance that one can change

}  // namespace

using namespace spatial;

class RobotClearance final : public AskedClearance {
 public:
  RobotClearance(const CollisionModel& model, std::size_t robot, double influence,
                 Progress& progress)
      : model_(model),
        robot_(robot),
        influence_(influence),
        progress_(progress),
        shown_(model.shown()),
        pairs_(model.bodies_.size(), avoidable()) {}

  [[nodiscard]] Result<void> outcome() const override {
    const std::lock_guard lock(mutex_);
    if (failure_) return *failure_;
    return {};
  }

  double distance(std::span<const double> q, std::span<double> gradient) const override {
    std::fill(gradient.begin(), gradient.end(), 0.0);
    const CollisionRobot& robot = model_.robots_[robot_];
    if (q.size() != robot.model->coordinate_count()) return influence_;
    const std::unique_ptr<State> state = take();
    std::copy(q.begin(), q.end(), state->q.begin() + static_cast<std::ptrdiff_t>(robot.first));
    const double value = evaluate(*state, gradient);
    give_back(std::move(*state));
    return value;
  }

 private:
  /// What a call needs; kept for the next one of any thread.
  struct State {
    std::vector<double> q;  ///< of all robots
    CollisionModel::Sample sample;
  };
  double evaluate(State& state, std::span<double> gradient) const {
    CollisionModel::Sample& s = state.sample;
    // Searches try what is no configuration; that alone is nothing to hear of.
    if (!model_.check(state.q).ok()) return influence_;
    model_.place_moving(state.q, s);
    model_.broad_.place(s.poses, {}, s.boxes);
    const auto pairs = model_.candidates(s, pairs_, influence_);
    std::vector<PairDistance> d(pairs.size());
    if (!asked(s.poses, pairs, d)) return influence_;
    double sum = 0;
    for (const PairDistance& at : d) sum += std::pow(intrusion(at), kNorm);
    if (!(sum > 0)) return influence_;
    const double whole = std::pow(sum, 1 / kNorm);
    if (gradient.size() != model_.robots_[robot_].model->dof()) return influence_ - whole;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (!(intrusion(d[k]) > 0) || std::fabs(d[k].distance) < 1e-12) continue;
      const double weight = std::pow(intrusion(d[k]) / whole, kNorm - 1);
      const Vec3 n = scale(sub(d[k].on_b, d[k].on_a), weight / d[k].distance);
      add(pairs[k].b, d[k].on_b, n, s.frames[robot_], gradient);
      add(pairs[k].a, d[k].on_a, scale(n, -1), s.frames[robot_], gradient);
    }
    return influence_ - whole;
  }
  /// Asks for distances; false when there is no answer, which outcome() tells.
  bool asked(const std::vector<Pose>& poses, std::span<const CollisionPair> pairs,
             std::span<PairDistance> out) const {
    Result<void> answer = model_.ask(poses, pairs, influence_, out, progress_);
    if (answer.ok()) return true;
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = std::move(answer).error();
    return false;
  }
  [[nodiscard]] double intrusion(const PairDistance& d) const {
    return std::max(0.0, influence_ - d.distance);
  }

  std::unique_ptr<State> take() const {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<State>(State{shown_, model_.sample()});
    auto state = std::make_unique<State>(std::move(idle_.back()));
    idle_.pop_back();
    return state;
  }
  void give_back(State state) const {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(state));
  }

  /// The robot's pairs that some sampled configuration brings farther apart than the influence, and
  /// those with other things whose distance changes.
  [[nodiscard]] std::vector<CollisionPair> avoidable() const {
    std::vector<CollisionPair> near, far;
    const auto index = static_cast<std::int32_t>(robot_);
    for (const CollisionPair& p : model_.pairs_)
      if (model_.bodies_[static_cast<std::size_t>(p.a)].robot == index ||
          model_.bodies_[static_cast<std::size_t>(p.b)].robot == index)
        near.push_back(p);
    const CollisionRobot& robot = model_.robots_[robot_];
    Random random(kSeed);
    CollisionModel::Sample s = model_.sample();
    std::vector<double> q = shown_, first_seen;
    for (std::size_t i = 0; i < kSamples && !near.empty(); ++i) {
      random_configuration(*robot.model, random, &q[robot.first]);
      model_.place_moving(q, s);
      std::vector<PairDistance> d(near.size());
      if (!asked(s.poses, near, d)) break;
      std::vector<CollisionPair> still;
      std::vector<double> began;
      for (std::size_t k = 0; k < near.size(); ++k) {
        const double first = i == 0 ? d[k].distance : first_seen[k];
        const bool is_own = model_.bodies_[static_cast<std::size_t>(near[k].a)].robot ==
                            model_.bodies_[static_cast<std::size_t>(near[k].b)].robot;
        const bool varies = std::fabs(d[k].distance - first) > kVaries * influence_;
        if (d[k].distance >= influence_ || (!is_own && varies)) {
          far.push_back(near[k]);
        } else {
          still.push_back(near[k]);
          began.push_back(first);
        }
      }
      near = std::move(still);
      first_seen = std::move(began);
    }
    return far;
  }

  /// Adds direction . velocity of a point of a body for unit rates of the robot.
  void add(std::int32_t body, const Vec3& point, const Vec3& direction,
           const std::vector<Pose>& frames, std::span<double> gradient) const {
    const CollisionBody& b = model_.bodies_[static_cast<std::size_t>(body)];
    if (b.robot != static_cast<std::int32_t>(robot_)) return;
    const CollisionRobot& robot = model_.robots_[robot_];
    for (std::int32_t i = b.joint; i >= 0;
         i = robot.model->joints[static_cast<std::size_t>(i)].parent) {
      const JointModel& j = robot.model->joints[static_cast<std::size_t>(i)];
      const Pose at = compose(robot.world_T_base, frames[static_cast<std::size_t>(i)]);
      const Vec3 arm = sub(point, at.p);
      const auto turning = [&](std::size_t k) { return dot(direction, cross(axis(at, k), arm)); };
      double* own = gradient.data() + j.v_index;
      const double ratio = j.is_coupled() ? j.coupling.ratio : 1;
      switch (j.type) {
        case JointType::revolute: *own += ratio * turning(2); break;
        case JointType::prismatic: *own += ratio * dot(direction, axis(at, 2)); break;
        case JointType::spherical:
          for (std::size_t k = 0; k < 3; ++k) own[k] += turning(k);
          break;
        case JointType::free:
          for (std::size_t k = 0; k < 3; ++k) {
            own[k] += dot(direction, axis(at, k));
            own[3 + k] += turning(k);
          }
          break;
      }
    }
  }

  const CollisionModel& model_;
  std::size_t robot_;
  double influence_;
  Progress& progress_;
  std::vector<double> shown_;
  mutable std::mutex mutex_;
  mutable std::optional<Error> failure_;  ///< guarded by mutex_
  mutable std::vector<State> idle_;       ///< guarded by mutex_
  PairSet pairs_;                         ///< last, as finding them asks
};

Result<std::unique_ptr<AskedClearance>> CollisionModel::field(std::size_t robot, double influence,
                                                              Progress& progress) const {
  auto field = std::make_unique<RobotClearance>(*this, robot, influence, progress);
  RMP_TRY(field->outcome());
  return std::unique_ptr<AskedClearance>(std::move(field));
}

}  // namespace robomosp::collision
