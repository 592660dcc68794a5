// SPDX-License-Identifier: Apache-2.0
#include "sim/base_motion.h"

#include <utility>
#include <vector>

#include "kernel/expression.h"
#include "kernel/text.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::sim {
namespace {

constexpr double kBaseStep = 2e-3;  // [s] of the differences

/// Value, first and second derivative.
struct Jet {
  double x = 0, v = 0, a = 0;
};

using Function = std::function<Result<double>(double t)>;

Result<Function> function_of(const std::string& text, std::string unit, const std::string& name) {
  if (text.empty()) return Function([](double) -> Result<double> { return 0.0; });
  auto compiled = Expression::compile(text);
  if (!compiled.ok()) return std::move(compiled).error().in(name);
  return Function(
      [e = std::move(compiled).value(), unit = std::move(unit), name](double t) -> Result<double> {
        auto value = e.evaluate(
            [&](const Expression::Name& n) -> Result<Quantity> {
              if (n.scope.empty() && n.name == "time") return Quantity{t, {0, 0, 1, 0}};
              return error(ErrorCode::unknown_name, "there is no " + Expression::spell(n) + " here",
                           "Only `time` [s] is known, such as in 0.1 m * sin(2 rad/s * time).");
            },
            unit);
        if (!value.ok()) return std::move(value).error().in(name);
        return *value;
      });
}

/// Central differences of order 8 (B. Fornberg, "Generation of finite difference formulas on
/// arbitrarily spaced grids", Math. Comp. 51, 1988, table 1).
Result<Jet> jet_of(const Function& f, double t) {
  constexpr double kFirst[4] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  constexpr double kSecond[4] = {8.0 / 5, -1.0 / 5, 8.0 / 315, -1.0 / 560};
  Jet jet;
  RMP_TRY_ASSIGN(jet.x, f(t));
  jet.a = -205.0 / 72 * jet.x;
  for (int k = 1; k <= 4; ++k) {
    RMP_TRY_ASSIGN(const double ahead, f(t + k * kBaseStep));
    RMP_TRY_ASSIGN(const double back, f(t - k * kBaseStep));
    jet.v += kFirst[k - 1] * (ahead - back);
    jet.a += kSecond[k - 1] * (ahead + back);
  }
  jet.v /= kBaseStep;
  jet.a /= kBaseStep * kBaseStep;
  return jet;
}

/// R = Rz(yaw) Ry(pitch) Rx(roll), its angular velocity and acceleration in the outer axes.
Result<PathSample> sample_of(const std::array<Function, 6>& functions, double t) {
  using namespace spatial;
  std::array<Jet, 6> j;
  for (std::size_t k = 0; k < 6; ++k) {
    RMP_TRY_ASSIGN(j[k], jet_of(functions[k], t));
  }
  PathSample s;
  s.pose.R = from_rpy({j[3].x, j[4].x, j[5].x});
  for (std::size_t k = 0; k < 3; ++k) {
    s.pose.p[k] = j[k].x;
    s.velocity[k] = j[k].v;
    s.acceleration[k] = j[k].a;
  }
  // Each turn is about an axis that the ones before it carry.
  Pose outer;
  for (const auto& [k, axis] :
       {std::pair{5, Vec3{0, 0, 1}}, {4, Vec3{0, 1, 0}}, {3, Vec3{1, 0, 0}}}) {
    const Jet& turn = j[static_cast<std::size_t>(k)];
    const Vec3 about = rotate(outer, axis);
    s.angular_acceleration =
        add(s.angular_acceleration,
            add(scale(about, turn.a), cross(s.angular_velocity, scale(about, turn.v))));
    s.angular_velocity = add(s.angular_velocity, scale(about, turn.v));
    Pose own;
    own.R = from_rpy({k == 3 ? turn.x : 0, k == 4 ? turn.x : 0, k == 5 ? turn.x : 0});
    outer = compose(outer, own);
  }
  return s;
}

}  // namespace

BasePath::BasePath(std::shared_ptr<const motion::Path> path, const Pose& world_T_path)
    : sample_([path = std::move(path)](double t) -> Result<PathSample> {
        PathSample s;
        RMP_TRY(path->sample(std::span(&t, 1), std::span(&s, 1)));
        if (t > path->duration() || t < 0) s = {s.pose, {}, {}, {}, {}};
        return s;
      }),
      world_T_path_(world_T_path) {}

Result<BasePath> BasePath::by_expressions(const BaseExpressions& texts,
                                          const Pose& world_T_mounting, double start, double end) {
  std::array<Function, 6> functions;
  for (std::size_t k = 0; k < 6; ++k) {
    const std::string name = std::string("base_motion.") + kBaseNumbers[k];
    RMP_TRY_ASSIGN(functions[k], function_of(texts[k], k < 3 ? "m" : "rad", name));
    constexpr int kLooks = 200;
    for (int i = -1; i <= kLooks + 1; ++i)
      RMP_TRY(functions[k](start + (end - start) * i / kLooks));
  }
  BasePath out;
  out.sample_ = [f = std::move(functions)](double t) { return sample_of(f, t); };
  out.world_T_path_ = world_T_mounting;
  return out;
}

Result<Pose> BasePath::world_T_mounting(double t) const {
  RMP_TRY_ASSIGN(const PathSample s, sample_(t));
  return spatial::compose(world_T_path_, s.pose);
}

Result<PathSample> BasePath::base(double t, const Pose& mounting_T_base) const {
  using namespace spatial;
  RMP_TRY_ASSIGN(const PathSample s, sample_(t));
  const Pose mounting = compose(world_T_path_, s.pose);
  const Vec3 r = rotate(mounting, mounting_T_base.p);
  const Vec3 w = rotate(world_T_path_, s.angular_velocity),
             wd = rotate(world_T_path_, s.angular_acceleration);
  return PathSample{
      compose(mounting, mounting_T_base), add(rotate(world_T_path_, s.velocity), cross(w, r)), w,
      add(rotate(world_T_path_, s.acceleration), add(cross(wd, r), cross(w, cross(w, r)))), wd};
}

Result<BaseMotion> BasePath::felt(double t, const Pose& mounting_T_base,
                                  const Vec3& gravity) const {
  using namespace spatial;
  RMP_TRY_ASSIGN(const PathSample b, base(t, mounting_T_base));
  return BaseMotion{rotate_back(b.pose, gravity), rotate_back(b.pose, b.acceleration),
                    rotate_back(b.pose, b.angular_velocity),
                    rotate_back(b.pose, b.angular_acceleration)};
}

std::optional<std::string> note_on_standing_base(const model::PlacedRobot& robot,
                                                 std::string_view who) {
  if (robot.base_trajectory.empty()) return std::nullopt;
  return "the base of " + text::quote(robot.name) +
         " stays where it is placed: " + std::string(who) + " not move it along " +
         text::quote(robot.base_trajectory);
}

}  // namespace robomosp::sim
