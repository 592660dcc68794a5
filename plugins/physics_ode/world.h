// SPDX-License-Identifier: Apache-2.0
// A physical world on the Open Dynamics Engine (layer: plugin).
#pragma once

#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include <robomosp/sdk/physics.h>

#include "geometry.h"

namespace robomosp::physics_ode {

struct Settings {
  bool exact = true;  ///< Dantzig's method; else a fixed number of sweeps
  int sweeps = 50;    ///< of the iterative method
  double erp = 0.2;   ///< share of a joint's error that a step repairs, 0..1
  double cfm = 1e-8;  ///< softness of constraints
  double contact_erp = 0.2, contact_cfm = 1e-7;
  int most_contacts = 16;  ///< of a pair of shapes
};

class OdeWorld final : public PhysicsWorld {
 public:
  static Result<std::unique_ptr<OdeWorld>> make(std::span<const PhysicsBody> bodies,
                                                std::span<const PhysicsJoint> joints, Vec3 gravity,
                                                const Settings& settings);
  ~OdeWorld() override;
  Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                    Progress&) override;
  void read(const PhysicsState& out) const override;
  void contacts(std::vector<PhysicsContact>& out) const override;
  Result<std::int32_t> attach(std::int32_t a, std::int32_t b) override;
  Result<void> release(std::int32_t attachment) override;
  Result<void> move(std::int32_t body, const Pose& pose, Vec3 velocity,
                    Vec3 angular_velocity) override;

 private:
  /// ODE's body stands at the centre of mass.
  struct Body {
    dBodyID id = nullptr;
    Vec3 com{};
    double friction = 0.5, restitution = 0;
    std::uint32_t group = 0;
    bool self = false, is_movable = false;
    std::vector<Geometry> geometries;
  };
  struct Joint {
    dJointID id = nullptr;
    std::int32_t a = -1, b = -1;
    int type = 0;
    double lower = 0, upper = 0, viscous = 0, coulomb = 0;
    double start = 0;   ///< joint position where ODE's is 0
    double turned = 0;  ///< whole turns since then [rad]
    double last = 0;    ///< ODE's angle before the last step [rad]
  };
  struct Contact {
    PhysicsContact contact;
    dJointFeedback feedback;
    bool first_is_a = true;
  };
  struct Attachment {
    dJointID joint = nullptr;
    std::int32_t a = -1, b = -1;
  };

  OdeWorld() = default;
  Result<void> add_body(const PhysicsBody& body, std::size_t number);
  Result<void> add_joint(const PhysicsJoint& joint, std::size_t number,
                         std::span<const PhysicsBody> bodies);
  [[nodiscard]] bool may_touch(std::int32_t a, std::int32_t b) const;
  void collide(dGeomID first, dGeomID second);
  void set_stops(Joint& joint) const;
  [[nodiscard]] static double position(const Joint& joint);
  [[nodiscard]] static double rate(const Joint& joint);
  [[nodiscard]] dBodyID body_id(std::int32_t body) const {
    return body < 0 ? nullptr : bodies_[static_cast<std::size_t>(body)].id;
  }

  Settings settings_;
  dWorldID world_ = nullptr;
  dSpaceID space_ = nullptr;
  dJointGroupID contact_joints_ = nullptr;
  std::vector<Body> bodies_;
  std::vector<Joint> joints_;
  std::vector<Attachment> attachments_;
  std::vector<std::pair<std::int32_t, std::int32_t>> tied_;  ///< a < b: do not touch
  std::deque<Contact> contacts_;                             ///< ODE keeps their addresses
};

}  // namespace robomosp::physics_ode
