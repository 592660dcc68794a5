// SPDX-License-Identifier: Apache-2.0
// Recordings against the bodies around them: configurations of their rows, and their clearance.
#include "recording/recording.h"

#include <algorithm>
#include <array>
#include <utility>

#include "collision/cache.h"
#include "collision/collision.h"
#include "evaluation/payload.h"
#include "kernel/text.h"

namespace robomosp::collision {
namespace {

using evaluation::load_stretches;
using evaluation::loads_at;
using evaluation::Sources;
using recording::Column;
using recording::kPlaceColumns;
using recording::pose_of_place;
using recording::Recording;
using recording::RecordingPtr;

/// Where objects are in a row of a recording that holds their places.
Result<ObjectPlaces> places_at(const model::World& world, const Recording& recording,
                               std::size_t row) {
  ObjectPlaces out;
  out.held = loads_at(*recording.loads, recording.columns.front().values[row]);
  for (const model::PlacedObject& object : world.objects) {
    if (!recording.find(object.name + ".x")) continue;
    std::array<double, 7> v{};
    for (std::size_t k = 0; k < v.size(); ++k) {
      const Column* c = recording.find(object.name + kPlaceColumns[k]);
      if (!c)
        return error(ErrorCode::invalid_argument,
                     "the recording has no column " + text::quote(object.name + kPlaceColumns[k]),
                     "Record it again.");
      v[k] = c->values[row];
    }
    out.moved.emplace(object.name, pose_of_place(v));
  }
  return out;
}

}  // namespace

Result<std::vector<double>> configurations(const CollisionModel& model,
                                           const Recording& recording) {
  const std::vector<double> shown = model.shown();
  std::vector<double> q;
  for (std::size_t i = 0; i < recording.rows(); ++i) q.insert(q.end(), shown.begin(), shown.end());
  bool is_found = recording.robot.empty();
  for (const CollisionRobot& robot : model.robots()) {
    // Further robots have their columns under their names, or stand still.
    const bool is_main = robot.name == recording.robot;
    const std::string stem = is_main ? "q" : robot.name + ".q";
    is_found = is_found || is_main;
    if (!is_main && !recording.find(stem + "1")) continue;
    for (std::size_t k = 0; k < robot.model->coordinate_count(); ++k) {
      const Column* c = recording.find(stem + std::to_string(k + 1));
      if (!c)
        return error(ErrorCode::invalid_argument,
                     "the recording has no column " + stem + std::to_string(k + 1),
                     "Its robot has changed since then; record it again.");
      for (std::size_t i = 0; i < recording.rows(); ++i)
        q[i * shown.size() + robot.first + k] = c->values[i];
    }
  }
  if (!is_found)
    return error(ErrorCode::unknown_name,
                 "the world has no robot " + text::quote(recording.robot) + " any more",
                 "Record it again.");
  return q;
}

Result<RecordingPtr> with_clearance(const Sources& source, const Recording& recording,
                                    Progress& progress) {
  const model::World* const world = source.snapshot.get(recording.world);
  if (!world)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  const bool has_loads = recording.loads && recording.rows() > 0;
  for (const model::PlacedObject& object : world->objects)
    if (!has_loads && recording.find(object.name + ".x"))
      return error(ErrorCode::unsupported,
                   "object " + text::quote(object.name) +
                       " moves freely in the recording, but clearances support only objects at "
                       "rest or held by a robot",
                   "Compute the clearance of a run without it.");
  // A model for each stretch of rows in which nothing is taken or let go.
  std::vector<std::shared_ptr<const CollisionModel>> models;
  std::vector<std::size_t> firsts{0};
  if (has_loads) firsts = load_stretches(recording, *recording.loads);
  std::vector<Contact> nearest;
  std::vector<double> q;  // the same for all models, which have the same robots
  for (std::size_t i = 0; i < firsts.size(); ++i) {
    if (has_loads) {
      RMP_TRY_ASSIGN(const ObjectPlaces places, places_at(*world, recording, firsts[i]));
      RMP_TRY_ASSIGN(const auto made,
                     CollisionModel::of_world(source, recording.world, progress, &places));
      models.push_back(made);
    } else {
      RMP_TRY_ASSIGN(const auto made, collision_model(source, recording.world, progress));
      models.push_back(made);
    }
    if (i == 0) {
      RMP_TRY_ASSIGN(q, configurations(*models.back(), recording));
    }
    const std::size_t width = models.back()->coordinate_count();
    const std::size_t end = i + 1 < firsts.size() ? firsts[i + 1] : recording.rows();
    RMP_TRY_ASSIGN(
        const auto part,
        models.back()->clearance(std::span(q).subspan(firsts[i] * width, (end - firsts[i]) * width),
                                 progress));
    nearest.insert(nearest.end(), part.begin(), part.end());
  }
  Recording out = recording;
  Column column{"clearance",
                "m",
                "least distance of the robots' bodies to each other and to all other bodies",
                {}};
  for (std::size_t i = 0; i < recording.rows(); ++i)
    column.values.push_back(nearest[i].at.distance);
  const auto first = std::find_if(nearest.begin(), nearest.end(),
                                  [](const Contact& c) { return c.at.distance <= 0; });
  if (first != nearest.end()) {
    const auto row = static_cast<std::size_t>(first - nearest.begin());
    const auto after = std::upper_bound(firsts.begin(), firsts.end(), row);
    out.notes.push_back(
        models[static_cast<std::size_t>(after - firsts.begin()) - 1]->describe(first->pair) +
        " touch from t = " + text::print_rounded(recording.columns.front().values[row]) + " s.");
  }
  if (std::all_of(models.begin(), models.end(), [](const auto& m) { return m->pairs().empty(); }))
    out.notes.emplace_back("Nothing in the world can touch, so the clearance is infinite.");
  std::erase_if(out.columns, [](const Column& c) { return c.name == "clearance"; });
  out.columns.push_back(std::move(column));
  return std::make_shared<const Recording>(std::move(out));
}

}  // namespace robomosp::collision
