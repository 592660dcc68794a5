// SPDX-License-Identifier: Apache-2.0
// Guards of collision, contact physics and planning: numbers that are finite, poses that are poses,
// bodies that there are.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/planner.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"

namespace robomosp {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class GuardedScene final : public CollisionScene {
 public:
  GuardedScene(std::string name, std::unique_ptr<CollisionScene> inner)
      : name_(std::move(name)), inner_(std::move(inner)) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                         double interest, std::span<PairDistance> out,
                         Progress& told) const override {
    for (PairDistance& d : out) d.distance = kNan;
    HeardProgress progress(told);
    RMP_TRY(asked(name_, [&] { return inner_->distances(poses, pairs, interest, out, progress); }));
    for (const PairDistance& d : out) {
      const bool is_number = !std::isnan(d.distance) && d.distance > -kInfinity;
      if (!is_number || !all_finite(d.on_a) || !all_finite(d.on_b))
        return broken_answer(name_, "returned a distance that is not a number");
    }
    return {};
  }
  Result<void> collisions(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                          std::span<std::uint8_t> out, Progress& told) const override {
    constexpr std::uint8_t kUnfilled = 255;
    std::fill(out.begin(), out.end(), kUnfilled);
    HeardProgress progress(told);
    RMP_TRY(asked(name_, [&] { return inner_->collisions(poses, pairs, out, progress); }));
    if (std::any_of(out.begin(), out.end(), [](std::uint8_t x) { return x > 1; }))
      return broken_answer(name_, "did not report whether two bodies touch");
    return {};
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::string name_;
  std::unique_ptr<CollisionScene> inner_;
};

class GuardedCollision final : public CollisionEngine {
 public:
  GuardedCollision(const ProviderInfo& info, CollisionEngine* inner)
      : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody> bodies,
                                                const Params& params,
                                                Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto made,
                   asked(name_, [&] { return inner_->build(bodies, params, progress); }));
    if (!made) return broken_answer(name_, "made nothing");
    return std::unique_ptr<CollisionScene>(std::make_unique<GuardedScene>(name_, std::move(made)));
  }

 private:
  std::string name_;
  std::unique_ptr<CollisionEngine> inner_;
};

/// Contacts are looked at with the step that made them, as contacts() itself cannot fail.
class GuardedWorld final : public PhysicsWorld {
 public:
  GuardedWorld(std::string name, std::unique_ptr<PhysicsWorld> inner, std::size_t bodies)
      : name_(std::move(name)), inner_(std::move(inner)), bodies_(bodies) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                    Progress& told) override {
    HeardProgress progress(told);
    RMP_TRY(asked(name_, [&] { return inner_->step(dt, steps, forces, progress); }));
    return read_contacts();
  }
  Result<void> read(const PhysicsState& out) const override {
    for (Pose& p : out.poses) p.p[0] = kNan;
    for (const std::span<double> numbers : {out.joint_positions, out.joint_velocities})
      std::fill(numbers.begin(), numbers.end(), kNan);
    RMP_TRY(asked(name_, [&] { return inner_->read(out); }));
    for (const Pose& p : out.poses) {
      if (!all_finite(p.p) || !all_finite(p.R)) return no_number();
      if (!is_rotation_matrix(p.R))
        return broken_answer(name_, "returned a pose with an orientation that is not a rotation");
    }
    for (const std::span<Vec3> all : {out.velocities, out.angular_velocities})
      for (const Vec3& v : all)
        if (!all_finite(v)) return no_number();
    if (!all_finite(out.joint_positions) || !all_finite(out.joint_velocities)) return no_number();
    return {};
  }
  void contacts(std::vector<PhysicsContact>& out) const override {
    if (!is_read_ && !read_contacts().ok()) contacts_.clear();
    out.swap(contacts_);
    is_read_ = false;
  }
  Result<std::int32_t> attach(std::int32_t a, std::int32_t b) override {
    return asked(name_, [&] { return inner_->attach(a, b); });
  }
  Result<void> release(std::int32_t attachment) override {
    return asked(name_, [&] { return inner_->release(attachment); });
  }
  Result<void> move(std::int32_t body, const Pose& pose, Vec3 velocity,
                    Vec3 angular_velocity) override {
    return asked(name_, [&] { return inner_->move(body, pose, velocity, angular_velocity); });
  }
  Result<void> servo(std::int32_t joint, double velocity, double force) override {
    return asked(name_, [&] { return inner_->servo(joint, velocity, force); });
  }
  Result<void> push(std::int32_t body, Vec3 force, Vec3 torque) override {
    return asked(name_, [&] { return inner_->push(body, force, torque); });
  }
  Result<void> ignore(std::int32_t a, std::int32_t b) override {
    return asked(name_, [&] { return inner_->ignore(a, b); });
  }

 private:
  [[nodiscard]] Error no_number() const {
    Error e = broken_answer(name_, "returned a state that is not a number");
    e.hint = "Use a shorter step; else report it to the provider's author.";
    return e;
  }
  Result<void> read_contacts() const {
    is_read_ = false;
    RMP_TRY(asked(name_, [&]() -> Result<void> {
      contacts_.clear();
      inner_->contacts(contacts_);
      return {};
    }));
    const auto is_there = [this](std::int32_t body) {
      return body >= -1 && body < static_cast<std::int64_t>(bodies_);
    };
    for (const PhysicsContact& c : contacts_) {
      if (!is_there(c.a) || !is_there(c.b))
        return broken_answer(name_, "reported a contact of a body that does not exist");
      if (!all_finite(c.point) || !all_finite(c.normal) || !all_finite(c.force) ||
          !std::isfinite(c.depth))
        return no_number();
    }
    is_read_ = true;
    return {};
  }
  std::string name_;
  std::unique_ptr<PhysicsWorld> inner_;
  std::size_t bodies_;
  mutable std::vector<PhysicsContact> contacts_;  ///< of the last step, until they are asked for
  mutable bool is_read_ = false;
};

class GuardedPhysics final : public PhysicsEngine {
 public:
  GuardedPhysics(const ProviderInfo& info, PhysicsEngine* inner)
      : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                               std::span<const PhysicsJoint> joints, Vec3 gravity,
                                               const Params& params) const override {
    RMP_TRY_ASSIGN(auto made,
                   asked(name_, [&] { return inner_->create(bodies, joints, gravity, params); }));
    if (!made) return broken_answer(name_, "made no world");
    return std::unique_ptr<PhysicsWorld>(
        std::make_unique<GuardedWorld>(name_, std::move(made), bodies.size()));
  }

 private:
  std::string name_;
  std::unique_ptr<PhysicsEngine> inner_;
};

class GuardedPlanner final : public Planner {
 public:
  GuardedPlanner(const ProviderInfo& info, Planner* inner) : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<Plan> plan(const PlanProblem& problem, const Params& params,
                    Progress& told) const override {
    std::optional<Error> fault;
    const auto is_one = [&](std::span<const double> q) {
      if (q.size() == problem.dof && all_finite(q)) return true;
      if (!fault) fault = broken_answer(name_, "checked joint values that are not a configuration");
      return false;
    };
    PlanProblem checked = problem;
    checked.is_free = [&](std::span<const double> q) { return is_one(q) && problem.is_free(q); };
    checked.is_free_between = [&](std::span<const double> a, std::span<const double> b) {
      return is_one(a) && is_one(b) && problem.is_free_between(a, b);
    };
    HeardProgress progress(told);
    auto planned = asked(name_, [&] { return inner_->plan(checked, params, progress); });
    if (fault) return std::move(*fault);
    return planned;
  }

 private:
  std::string name_;
  std::unique_ptr<Planner> inner_;
};

}  // namespace

RMP_INTERFACES(collision, guarded_interface<CollisionEngine, GuardedCollision>("fcl"),
               guarded_interface<PhysicsEngine, GuardedPhysics>("ode"),
               guarded_interface<Planner, GuardedPlanner>("rrt_connect"));

}  // namespace robomosp
