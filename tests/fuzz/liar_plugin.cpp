// SPDX-License-Identifier: Apache-2.0
// The providers that lie as a plugin, for a process of its own. Each stands on one of the program,
// which it asks across the channel.
#include <memory>
#include <stdexcept>
#include <string>

#include <robomosp/sdk/host.h>
#include <robomosp/sdk/plugin.h>

#include "fuzz/lying_bodies.h"

namespace robomosp::test {
namespace {

template <class I>
std::shared_ptr<I> honest(const rmp_host* host, const char* name) {
  auto made = Host(host).create<I>(name);
  if (!made.ok()) throw std::runtime_error(made.error().sentence());
  return std::move(*made);
}

/// A row for a liar that stands on the provider `Name`.
template <class L, class I, const char* Name>
void* make(const rmp_host* host, char* error, std::uint32_t error_size) {
  try {
    if constexpr (std::is_default_constructible_v<L>) return static_cast<I*>(new L);
    else return static_cast<I*>(new L(honest<I>(host, Name)));
  } catch (const std::exception& e) {
    if (error && error_size) std::snprintf(error, error_size, "%s", e.what());
  }
  return nullptr;
}
template <class L, class I, const char* Name>
rmp_provider row() {
  return {I::kInterfaceId,   "liar_apart",     "Lies.", "", nullptr, 0,
          sizeof(rmp_param), &make<L, I, Name>};
}

constexpr char kNumeric[] = "numeric", kNewton[] = "newton_euler",
               kArticulated[] = "articulated_body", kComputed[] = "computed_torque", kC[] = "c99",
               kDormand[] = "dormand_prince", kReach[] = "reachability", kRrt[] = "rrt_connect",
               kConstant[] = "constant_speed", kLine[] = "line", kSlerp[] = "slerp", kPtp[] = "ptp",
               kFcl[] = "fcl", kOde[] = "ode", kOcct[] = "occt", kNone[] = "";

}  // namespace
}  // namespace robomosp::test

using namespace robomosp;
using namespace robomosp::test;
RMP_PLUGIN("test.liar", "1.0", "Apache-2.0", "Answers wrongly.", row<LyingIk, IkSolver, kNumeric>(),
           row<LyingInverse, InverseDynamics, kNewton>(),
           row<LyingForward, ForwardDynamics, kArticulated>(),
           row<LyingController, Controller, kComputed>(), row<LyingCode, RobotCodeGenerator, kC>(),
           row<LyingIntegrator, Integrator, kDormand>(), row<LyingRetimer, Retimer, kReach>(),
           row<LyingPlanner, Planner, kRrt>(), row<LyingLawFactory, MotionLawFactory, kConstant>(),
           row<LyingCurveFactory, CurveFactory, kLine>(),
           row<LyingOrientationFactory, OrientationFactory, kSlerp>(),
           row<LyingSegmentFactory, SegmentFactory, kNone>(),
           row<LyingJointFactory, JointSegmentFactory, kPtp>(),
           row<LyingCollision, CollisionEngine, kFcl>(), row<LyingPhysics, PhysicsEngine, kOde>(),
           row<LyingCsg, CsgEngine, kOcct>(), row<LyingPrimitive, CsgPrimitive, kNone>(),
           row<LyingImporter, Importer, kNone>(), row<LyingExporter, Exporter, kNone>())
