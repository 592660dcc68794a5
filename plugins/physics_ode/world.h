// SPDX-License-Identifier: Apache-2.0
// A physical world on the Open Dynamics Engine (layer: plugin).
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/physics_notes.h>

#include "geometry.h"
#include "pile.h"
#include "turning.h"

namespace robomosp::physics_ode {

class NearPairs;

enum Type { kRevolute = 0, kPrismatic = 1, kFixed = 2, kBall = 3, kDirections = 4 };

inline Vec3 vec3(const dReal* v) { return {v[0], v[1], v[2]}; }
inline std::string number_text(std::size_t i) { return std::to_string(i + 1); }

[[nodiscard]] std::string short_number(double x);  ///< three digits

struct Settings {
  bool exact = true;  ///< Dantzig's method; else a fixed number of sweeps
  int sweeps = 50;    ///< of the iterative method
  double erp = 0.2;   ///< fraction of a joint's error corrected per step, 0..1
  double cfm = 1e-8;  ///< softness of constraints
  double contact_erp = 0.2, contact_cfm = 1e-7;
  std::size_t piles_from = 17;  ///< least number of contacts of free bodies solved as a pile
  int most_contacts = 16;       ///< per pair of shapes
};

/// Targets of contacts and joint stops in a solution of one step.
enum class Pass {
  whole,   ///< velocities that separate bodies and correct penetration
  motion,  ///< velocities that separate bodies
  places,  ///< displacements of bodies: `motion` plus the correction, dropped from the velocity
};

/// dWorldStep(); returns whether its solver failed, so that velocities are invalid.
bool step_exactly(dWorldID world, double dt);
[[nodiscard]] bool gave_up();

class OdeWorld final : public PhysicsWorld, private PhysicsNotes {
 public:
  static Result<std::unique_ptr<OdeWorld>> make(std::span<const PhysicsBody> bodies,
                                                std::span<const PhysicsJoint> joints, Vec3 gravity,
                                                const Settings& settings);
  ~OdeWorld() override;
  [[nodiscard]] const void* extension(const char* id) const override;
  Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                    Progress&) override;
  Result<void> read(const PhysicsState& out) const override;
  void contacts(std::vector<PhysicsContact>& out) const override;
  Result<std::int32_t> attach(std::int32_t a, std::int32_t b) override;
  Result<void> release(std::int32_t attachment) override;
  Result<void> move(std::int32_t body, const Pose& pose, Vec3 velocity,
                    Vec3 angular_velocity) override;
  Result<void> servo(std::int32_t joint, double velocity, double force) override;
  Result<void> push(std::int32_t body, Vec3 force, Vec3 torque) override;
  Result<void> ignore(std::int32_t a, std::int32_t b) override;

 private:
  /// The origin of ODE's body is its centre of mass.
  struct Body {
    /// null for bodies that were never moved or jointed: geometries alone, which do not merge the
    /// islands that touch them.
    dBodyID id = nullptr;
    Pose pose;  ///< without an id
    Vec3 com{};
    double friction = 0.5, restitution = 0;
    std::uint32_t group = 0;
    bool self = false, is_movable = false, is_jointed = false;
    int attached = 0;  ///< attachments that hold it
    std::vector<Geometry> geometries;
    double thinnest = 0, reach = 0;  ///< of geometries; distance of their boxes from the centre of
                                     ///< mass [m]
    FreeTurn turn;                   ///< of this step
  };
  struct Joint {
    dJointID id = nullptr;
    /// Motors beside it, null if not needed: Coulomb friction, the motor's inertia with viscous
    /// friction, and servo().
    dJointID brake = nullptr, rotor = nullptr, motor = nullptr;
    std::int32_t a = -1, b = -1;
    int type = 0;
    double lower = 0, upper = 0, viscous = 0, coulomb = 0, armature = 0;
    Pose in_a, in_b;
    std::uint32_t fixed = 0;
    std::int32_t follows = -1;
    double ratio = 1, offset = 0;
    double start = 0;   ///< joint position where ODE's is 0
    double turned = 0;  ///< whole turns since then [rad]
    double last = 0;    ///< ODE's angle before the last step [rad]
  };
  struct Contact {
    PhysicsContact contact;
    dContact made;
    dJointFeedback feedback;
    bool first_is_a = true;
    unsigned round = 0;  ///< bit 0: of a's round outside, bit 1: of b's
    std::array<std::int32_t, 2> shapes{};
    /// Numbers of geometries and of their point; ascending in contacts_.
    std::array<std::uint32_t, 3> key{};
    std::array<signed char, 4> place{2, 2, 2, 2};  ///< as in PileContact
    double push_limit = 0;   ///< of friction in Pass::places: the limit from Pass::motion [N]
    bool is_solved = false;  ///< solved with its pile, so that the engine has no joint for it
  };
  /// A row of constraints without an ODE joint, between any number of bodies: sum J v = target -
  /// cfm * force.
  struct Row {
    struct Entry {
      dBodyID id;
      Vec3 linear, angular;  ///< of the centre of mass
    };
    std::vector<Entry> entries;
    double target = 0;  ///< after the step
  };
  struct Push {
    std::int32_t body;
    Vec3 force, torque;
  };
  struct PileForce {
    dBodyID id;
    Vec3 force, torque;
  };
  struct Attachment {
    dJointID joint = nullptr;
    std::int32_t a = -1, b = -1;
  };

  OdeWorld();
  Result<void> add_body(const PhysicsBody& body, std::size_t number);
  static void fasten(const Body& body);
  void note_extent(Body& body) const;
  void give_id(std::int32_t body);  ///< also for static bodies; once
  [[nodiscard]] Result<void> check_state() const;
  [[nodiscard]] bool are_islands_small() const;
  void make_contact_joints(Pass pass);
  [[nodiscard]] dSurfaceParameters surface(const Contact& contact, Pass pass) const;
  Result<void> find_contacts(Progress& progress);
  void expect_places();
  [[nodiscard]] bool is_deep() const;
  Result<void> solve_step(std::span<const double> forces, Pass pass);
  [[nodiscard]] Result<std::vector<PhysicsNote>> notes() const override;
  // turning.cpp
  void begin_turns();
  void end_turns();
  [[nodiscard]] bool turns_freely(const Body& body) const;
  // piles.cpp
  void settle_piles(Pass pass);
  bool settle(std::span<const std::size_t> contacts, Pass pass);
  [[nodiscard]] PileBody pile_body(std::int32_t body) const;
  [[nodiscard]] PileContact pile_contact(const Contact& contact, Pass pass) const;
  Result<void> step_once(std::span<const double> forces, Progress& progress);
  Result<void> add_joint(const PhysicsJoint& joint, std::size_t number,
                         std::span<const PhysicsBody> bodies);
  [[nodiscard]] bool may_touch(std::int32_t a, std::int32_t b) const;
  void collide(dGeomID first, dGeomID second);
  [[nodiscard]] std::size_t drop_beside_round(const GeometryTag& x, const GeometryTag& y,
                                              std::span<dContactGeom> points) const;
  void add_contact(const GeometryTag& x, const GeometryTag& y, const dContactGeom& at,
                   double softness);
  void set_direction(const Body& x, const Body& y, dContact& contact) const;
  void set_stops(Joint& joint) const;
  void prepare(Joint& joint, Pass pass);
  /// Excess over a stop [rad or m]; 0 = within.
  [[nodiscard]] static double beyond_stop(const Joint& joint);
  [[nodiscard]] dJointID make_motor(const Joint& joint) const;
  [[nodiscard]] Vec3 axis(const Joint& joint) const;
  [[nodiscard]] Pose pose(std::int32_t body) const;
  // constraints.cpp
  void add_rate(const Joint& joint, double factor, Row& row) const;
  void make_rows();
  struct Moving {
    dBodyID id;
    Vec3 p, v, w;
    std::array<dReal, 4> q;
  };
  /// State before a step.
  struct FastBody {
    std::size_t body;
    double way;  ///< displacement of its fastest point in the step [m]
    Moving before;
    std::vector<std::array<Vec3, 2>> bounds;  ///< of its geometries
  };
  // passing.cpp
  [[nodiscard]] std::vector<FastBody> fast_bodies() const;
  void find_passed(std::span<const FastBody> fast);
  void look_between(const FastBody& f, const FastBody* twin, dGeomID own, dGeomID other, double way,
                    double thick);
  [[nodiscard]] std::vector<Moving> moving() const;
  static void put_back(std::span<const Moving> before);
  void add_forces(std::span<const double> forces, std::span<const double> row_forces);
  bool advance(std::span<const double> forces, std::span<const double> row_forces);
  bool advance_with_rows(std::span<const double> forces);
  [[nodiscard]] static double position(const Joint& joint);
  [[nodiscard]] static double rate(const Joint& joint);
  [[nodiscard]] dBodyID body_id(std::int32_t body) const {
    return body < 0 ? nullptr : bodies_[static_cast<std::size_t>(body)].id;
  }

  Settings settings_;
  Vec3 gravity_{};
  double dt_ = 1e-3;
  dWorldID world_ = nullptr;
  dSpaceID space_ = nullptr;  ///< owns the geometries
  std::unique_ptr<NearPairs> near_pairs_;
  std::uint32_t geometries_ = 0;
  dJointGroupID contact_joints_ = nullptr;
  std::vector<Body> bodies_;
  std::vector<Joint> joints_;
  bool has_rows_ = false;
  std::vector<Row> rows_;             ///< constant number in all steps
  std::vector<double> row_forces_;    ///< of the previous step
  std::vector<double> row_response_;  ///< d (J v) / d force, rows_ x rows_; empty = unknown
  std::vector<Push> pushes_;
  std::vector<PileForce> pile_forces_;  ///< of this step
  std::vector<std::int32_t> local_;     ///< number of a body in the pile being solved, or -1
  std::vector<Attachment> attachments_;
  std::multiset<std::pair<std::int32_t, std::int32_t>> tied_;  ///< a < b: no contact between them
  int steps_until_exact_ = 0;                                  ///< after the exact solver gave up
  bool is_swept_ = false;  ///< this step has too many contacts for the exact solver
  bool was_swept_ = false;
  std::int64_t steps_ = 0;
  std::vector<std::pair<std::int32_t, std::int32_t>> passed_;  ///< each pair once
  std::vector<PhysicsNote> notes_;
  bool is_broken_ = false;        ///< the engine stopped in the middle of a step
  std::deque<Contact> contacts_;  ///< ODE keeps their addresses
  /// Keys and states of the contacts of the previous step.
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::array<signed char, 4>>> places_;
};

}  // namespace robomosp::physics_ode
