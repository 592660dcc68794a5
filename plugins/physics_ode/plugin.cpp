// SPDX-License-Identifier: Apache-2.0
// Provider "ode" of robomosp.physics/1 (layer: plugin).
#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/plugin.h>

#include "world.h"

namespace robomosp::physics_ode {
namespace {

const rmp_param kParams[] = {
    {"solver", "enum", "",
     "Solver for contacts and joints: exact (Dantzig's method), or iterative, for worlds of many "
     "bodies.",
     "exact", "exact|sweeps", 1, 0},
    {"sweeps", "int", "", "Iterations per step.", "50", nullptr, 1, 10000},
    {"erp", "real", "", "Share of a joint's drift that a step corrects.", "0.2", nullptr, 0, 1},
    {"cfm", "real", "", "Softness of joints; 0 = rigid.", "1e-8", nullptr, 0, 1},
    {"contact_erp", "real", "", "Share of a penetration that a step corrects.", "0.2", nullptr, 0,
     1},
    {"contact_cfm", "real", "", "Softness of contacts.", "1e-7", nullptr, 0, 1},
    {"piles_from", "int", "",
     "For the exact solver: bodies without joints that touch at this many points are solved as a "
     "pile, by an equally exact method for sparse matrices; fewer are solved all at once, which is "
     "as quick.",
     "17", nullptr, 0, 1000000},
    {"most_contacts", "int", "", "Greatest number of contact points of a pair of shapes.", "16",
     nullptr, 1, 64},
};

class Ode final : public PhysicsEngine {
 public:
  Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                               std::span<const PhysicsJoint> joints, Vec3 gravity,
                                               const Params& p) const override {
    Settings s;
    s.exact = p.text("solver") != "sweeps";
    s.sweeps = static_cast<int>(p.integer("sweeps"));
    s.erp = p.real("erp"), s.cfm = p.real("cfm");
    s.contact_erp = p.real("contact_erp"), s.contact_cfm = p.real("contact_cfm");
    s.piles_from = static_cast<std::size_t>(p.integer("piles_from"));
    s.most_contacts = static_cast<int>(p.integer("most_contacts"));
    RMP_TRY_ASSIGN(auto world, OdeWorld::make(bodies, joints, gravity, s));
    return std::unique_ptr<PhysicsWorld>(std::move(world));
  }
};

}  // namespace
}  // namespace robomosp::physics_ode

using robomosp::physics_ode::Ode;

RMP_PLUGIN("org.robomosp.physics_ode", "0.1.0", "Apache-2.0",
           "Rigid bodies with contact and friction by the Open Dynamics Engine.",
           RMP_PROVIDER(Ode, "ode",
                        "Rigid bodies, joints, contact with friction, in fixed steps with bitwise "
                        "reproducible results.",
                        "contact,friction", robomosp::physics_ode::kParams))
