// SPDX-License-Identifier: Apache-2.0
#include "scene/contacts.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "kernel/fingerprint.h"
#include "kernel/text.h"

namespace robomosp::scene {
namespace {

constexpr Colour kTouching{0.85F, 0.08F, 0.06F, 1.0F};
constexpr Colour kNearest{0.85F, 0.05F, 0.55F, 1.0F};

/// Name of a body's items: "arm.forearm" is drawn as "arm forearm".
std::string item_name(const collision::CollisionModel& model, std::int32_t body) {
  const collision::CollisionBody& b = model.bodies()[static_cast<std::size_t>(body)];
  if (b.robot < 0) return b.name;
  std::string name = b.name;
  name[model.robots()[static_cast<std::size_t>(b.robot)].name.size()] = ' ';
  return name;
}

}  // namespace

Result<void> mark_contacts(const collision::CollisionModel& model, std::span<const double> q,
                           render::Scene& scene, Progress& progress) {
  RMP_TRY_ASSIGN(const auto hits, model.collisions(q, progress));
  std::set<std::string> touching;
  for (const CollisionPair& p : hits) {
    touching.insert(item_name(model, p.a));
    touching.insert(item_name(model, p.b));
  }
  for (render::Item& item : scene.items)
    if (touching.contains(item.name)) {
      const float opacity = item.appearance.colour.a;
      item.appearance.colour = kTouching;
      item.appearance.colour.a = opacity;
      item.appearance.ambient.reset();
      item.appearance.specular.reset();
      item.appearance.metalness = 0;
    }
  if (!hits.empty()) return {};
  RMP_TRY_ASSIGN(const auto nearest, model.clearance(q, progress));
  const PairDistance& at = nearest.front().at;
  if (!(at.distance > 0) || !std::isfinite(at.distance)) return {};
  render::Line line;
  line.id = Fingerprinter("nearest points/1").finish().lo;
  line.points = {at.on_a, at.on_b};
  line.colour = kNearest;
  line.width = 4;
  scene.lines.push_back(std::move(line));
  Vec3 middle{};
  for (std::size_t k = 0; k < 3; ++k) middle[k] = 0.5 * (at.on_a[k] + at.on_b[k]);
  scene.labels.push_back({middle, text::print_rounded(1000 * at.distance, 3) + " mm"});
  return {};
}

Result<std::vector<double>> configuration_at(const collision::CollisionModel& model,
                                             const recording::Recording& recording, double time) {
  RMP_TRY_ASSIGN(const auto all, collision::configurations(model, recording));
  const std::size_t n = model.coordinate_count();
  if (n == 0 || all.empty()) return model.shown();
  const auto& times = recording.columns.front().values;
  const auto after = std::upper_bound(times.begin(), times.end(), time);
  const auto at = [&](std::size_t row) {
    return all.begin() + static_cast<std::ptrdiff_t>(row * n);
  };
  const auto row = static_cast<std::size_t>(after - times.begin());
  if (row == 0) return std::vector<double>(at(0), at(1));
  std::vector<double> q(at(row - 1), at(row));
  if (row == times.size()) return q;
  const double share = (time - times[row - 1]) / (times[row] - times[row - 1]);
  for (std::size_t k = 0; k < n; ++k) q[k] += share * (all[row * n + k] - q[k]);
  return q;
}

}  // namespace robomosp::scene
