// SPDX-License-Identifier: Apache-2.0
#include "ioci/simulation/run_start.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "collision/cache.h"
#include "collision/collision.h"
#include "evaluation/payload.h"
#include "ioci/core/commands.h"
#include "ioci/world/pair_remedy.h"
#include "program_check/check.h"
#include "robotics/joint_limits.h"
#include "sim/member_axes.h"

namespace robomosp::ioci {
namespace {

const FaultCodes kStartCodes{
    {"run.starts_outside_limits", ErrorCode::conflict,
     "The first row of a run is outside the limits of a joint."},
    {"run.starts_in_contact", ErrorCode::conflict, "Bodies touch in the first row of a run."},
};

/// Faults of robots whose first row is outside their limits. Robots that stand still are shown
/// where the world has them, which says so itself.
std::vector<Fault> limits_at_start(CommandContext& ctx, const recording::Recording& r) {
  std::vector<Fault> out;
  const model::World* const world = ctx.snapshot().get(r.world);
  for (const model::PlacedRobot& placed : world->robots) {
    const std::string stem = placed.name == r.robot ? "q" : placed.name + ".q";
    if (!r.find(stem + "1")) continue;
    const auto m =
        ctx.app.derived.robot_model(ctx.snapshot(), placed.robot, world->gravity, ctx.progress);
    if (!m.ok()) continue;
    std::vector<double> q;
    for (std::size_t k = 0; k < (*m)->coordinate_count(); ++k)
      if (const recording::Column* c = r.find(stem + std::to_string(k + 1)))
        q.push_back(c->values.front());
    if (q.size() != (*m)->coordinate_count()) continue;
    constexpr double kSlack = 1e-6;  // [rad or m]
    const auto excess = robotics::limit_excess(**m, q, kSlack);
    if (excess.joint < 0) continue;
    const auto entry = (*m)->joints[static_cast<std::size_t>(excess.joint)].q_index;
    Fault f =
        make_fault("run.starts_outside_limits",
                   "The run starts outside limits: robot " + text::quote(placed.name) + " has " +
                       sim::member_axes(ctx.snapshot(), r.world, placed.name)
                           .before_place(static_cast<std::size_t>(entry), q) +
                       robotics::excess_words(**m, excess));
    f.witness.robot = placed.name;
    f.witness.q = q;
    FaultJoint joint;
    joint.name = (*m)->joints[static_cast<std::size_t>(excess.joint)].name;
    joint.number = static_cast<std::size_t>(entry) + 1;
    joint.value = q[static_cast<std::size_t>(entry)];
    f.witness.joints.push_back(std::move(joint));
    out.push_back(std::move(f));
  }
  return out;
}

/// What robots hold by the world's attachments: what a live run of tasks, whose rows have places of
/// objects and no word on who holds them, starts with.
std::vector<recording::Load> attached_at_start(CommandContext& ctx, const recording::Recording& r) {
  const evaluation::Sources sources{ctx.app.registry, ctx.app.derived, ctx.snapshot(),
                                    &ctx.app.collision_models};
  std::vector<recording::Load> out;
  const model::World* const world = ctx.snapshot().get(r.world);
  for (const model::PlacedRobot& placed : world->robots) {
    const auto m =
        ctx.app.derived.robot_model(ctx.snapshot(), placed.robot, world->gravity, ctx.progress);
    if (!m.ok()) continue;
    auto own = evaluation::attached_loads(sources, r.world, placed, **m);
    if (own.ok()) std::move(own->begin(), own->end(), std::back_inserter(out));
  }
  return out;
}

/// Bodies that touch in the first row.
Result<std::vector<collision::Contact>> touching_at_start(
    CommandContext& ctx, const recording::Recording& first,
    std::shared_ptr<const collision::CollisionModel>& model) {
  const sim::Simulator sources{ctx.app.registry, ctx.app.derived, ctx.snapshot(),
                               &ctx.app.collision_models};
  const model::World& world = *ctx.snapshot().get(first.world);
  const bool is_as_shown = (!first.loads || first.loads->empty()) &&
                           std::none_of(world.objects.begin(), world.objects.end(),
                                        [&](const auto& o) { return first.find(o.name + ".x"); });
  if (is_as_shown) {
    RMP_TRY_ASSIGN(model, collision::collision_model(sources, AnyId(first.world), ctx.progress));
  } else {
    RMP_TRY_ASSIGN(const auto places, program_check::places_at(world, first, 0));
    RMP_TRY_ASSIGN(
        model, collision::CollisionModel::of_world(sources, first.world, ctx.progress, &places));
  }
  if (model->pairs().empty()) return std::vector<collision::Contact>();
  RMP_TRY_ASSIGN(const auto q, collision::configurations(*model, first));
  constexpr double kTouching = 1e-4;  // [m]
  return model->near(q, kTouching, ctx.progress);
}

}  // namespace

Result<std::vector<Fault>> start_faults(CommandContext& ctx,
                                        const recording::RecordingPtr& recording) {
  if (!ctx.snapshot().get(recording->world) || recording->rows() == 0) return std::vector<Fault>();
  std::vector<Fault> faults = limits_at_start(ctx, *recording);
  recording::Recording first;
  first.world = recording->world, first.robot = recording->robot, first.dof = recording->dof;
  first.loads = recording->loads;
  for (const recording::Column& c : recording->columns) {
    first.columns.push_back({c.name, c.unit, {}, {c.values.front()}});
  }
  const auto& objects = ctx.snapshot().get(first.world)->objects;
  if (!first.loads && std::any_of(objects.begin(), objects.end(),
                                  [&](const auto& o) { return first.find(o.name + ".x"); }))
    first.loads = attached_at_start(ctx, first);
  std::shared_ptr<const collision::CollisionModel> model;
  auto touching = touching_at_start(ctx, first, model);
  if (!touching.ok() && touching.error().code == ErrorCode::cancelled)
    return std::move(touching).error();
  if (touching.ok()) {
    const double start = first.columns.front().values.front();
    const auto is_meant = [&](const collision::Contact& c) {
      constexpr double kSame = 1e-6;  // [s]
      for (const std::int32_t body : {c.pair.a, c.pair.b})
        if (first.loads)
          for (const recording::Load& load : *first.loads)
            if (model->bodies()[static_cast<std::size_t>(body)].name == load.object &&
                load.from <= start + kSame)
              return true;
      return false;
    };
    std::erase_if(*touching, is_meant);
    if (!touching->empty()) {
      const auto worst = std::min_element(
          touching->begin(), touching->end(),
          [](const auto& a, const auto& b) { return a.at.distance < b.at.distance; });
      const double depth = -worst->at.distance * 1000;
      const std::size_t others = touching->size() - 1;
      Fault f = make_fault(
          "run.starts_in_contact",
          "The run starts in contact: " + model->describe(worst->pair) + " touch" +
              (depth > 0.05 ? ", " + text::print_rounded(depth, 3) + " mm deep" : std::string()) +
              (others == 0   ? std::string()
               : others == 1 ? std::string(", and 1 other pair touches")
                             : ", and " + std::to_string(others) + " other pairs touch"));
      const auto name = [&](std::int32_t body) {
        return model->bodies()[static_cast<std::size_t>(body)].name;
      };
      f.witness.bodies = {name(worst->pair.a), name(worst->pair.b)};
      if (worst->at.distance < 0) {
        f.witness.value = f.witness.excess = -worst->at.distance;
        f.witness.unit = "m";
      }
      const std::string& robot = recording->robot;
      for (std::size_t j = 1; !robot.empty() && j <= recording->dof; ++j)
        if (const recording::Column* c = first.find("q" + std::to_string(j)))
          f.witness.q.push_back(c->values.front());
      if (!f.witness.q.empty()) f.witness.robot = robot;
      f.remedies.push_back(allow_pair_remedy(Application::handle(AnyId(first.world)),
                                             f.witness.bodies[0], f.witness.bodies[1]));
      PairTrials(ctx).look_at(f);
      faults.push_back(std::move(f));
    }
  }
  for (Fault& f : faults) {
    f.severity = Severity::warning;
    f.subject.record = f.witness.scene = Application::handle(AnyId(recording->world));
    f.extent.first = f.extent.last = f.extent.worst = 1;
    f.extent.at = recording->columns.front().values.front();
  }
  return faults;
}

Result<recording::RecordingPtr> with_start_notes(CommandContext& ctx,
                                                 recording::RecordingPtr recording, bool posts) {
  RMP_TRY_ASSIGN(std::vector<Fault> faults, start_faults(ctx, recording));
  std::erase_if(faults, [&](const Fault& f) {
    return std::find(recording->notes.begin(), recording->notes.end(), sentence(f)) !=
           recording->notes.end();
  });
  if (faults.empty()) return recording;
  std::vector<std::string> notes;
  for (const Fault& f : faults) {
    notes.push_back(sentence(f));
    if (posts) ctx.app.messages.post(f, "run");
  }
  recording::Recording out = *recording;
  out.notes.insert(out.notes.begin(), notes.begin(), notes.end());
  return std::make_shared<const recording::Recording>(std::move(out));
}

}  // namespace robomosp::ioci
