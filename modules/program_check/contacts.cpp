// SPDX-License-Identifier: Apache-2.0
// Bodies that touch along the rows of a run, without those that are meant to.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "collision/cache.h"
#include "collision/collision.h"
#include "evaluation/payload.h"
#include "kernel/text.h"
#include "program_check/check.h"
#include "robotics/singularity.h"

namespace robomosp::program_check {
namespace {

using collision::CollisionModel;
using collision::Contact;
using recording::Column;
using recording::Load;
using recording::Recording;

constexpr double kSupport = 1e-3;      ///< a part may be put so deep into what it lies on [m]
constexpr double kTolerance = 2e-4;    ///< of clearances [m]
constexpr double kSameContact = 1e-6;  ///< times [s]

/// Rows in a row in which a pair is near.
struct Stretch {
  std::size_t first = 0, last = 0, worst = 0;
  double distance = 0;
  double placed_at = 0;  ///< distance, of whatever sign, where the position is from
  Vec3 position{};
};

/// No point of two bodies comes nearer to the other by more than this from a row to the next: what
/// each robot's joints do, at its whole reach, added up over the robots [m].
template <class At>
double most_way(const CollisionModel& model, At&& at, std::size_t row) {
  const auto now = at(row), next = at(row + 1);
  double out = 0;
  for (const auto& robot : model.robots()) {
    const RobotModel& m = *robot.model;
    double reach = m.tips.empty() ? 0 : robotics::reach(m, 0);
    double body = 0;
    for (const auto& b : model.bodies())
      if (b.robot >= 0 && model.robots()[static_cast<std::size_t>(b.robot)].name == robot.name)
        body = std::max(body, b.reach);
    reach += body;
    for (std::size_t j = 0; j < m.joints.size() && m.is_simple(); ++j) {
      const double d = std::fabs(next[robot.first + j] - now[robot.first + j]);
      out += d * (m.joints[j].type == JointType::revolute ? reach : 1.0);
    }
    if (!m.is_simple()) out = std::numeric_limits<double>::infinity();
  }
  return out;
}

/// The object that a body is, where it is one of the world.
std::string object_of(const collision::CollisionBody& b) {
  return b.robot < 0 || b.is_held ? b.name : std::string();
}

}  // namespace

Result<collision::ObjectPlaces> places_at(const model::World& world, const Recording& r,
                                          std::size_t row) {
  collision::ObjectPlaces out;
  if (r.loads) out.held = evaluation::loads_at(*r.loads, r.columns.front().values[row]);
  for (const model::PlacedObject& object : world.objects) {
    if (!r.find(object.name + ".x")) continue;
    std::array<double, 7> v{};
    for (std::size_t k = 0; k < v.size(); ++k) {
      const Column* c = r.find(object.name + recording::kPlaceColumns[k]);
      if (!c)
        return error(ErrorCode::internal, "the place of " + text::quote(object.name) +
                                              " is incomplete in the recording");
      v[k] = c->values[row];
    }
    out.moved.emplace(object.name, recording::pose_of_place(v));
  }
  return out;
}

Result<Contacts> contacts(const sim::Simulator& sim, const Recording& r, const Options& options,
                          const std::vector<bool>& is_jump, Progress& progress) {
  Contacts out;
  const model::World* const world = sim.snapshot.get(r.world);
  const std::size_t rows = r.rows();
  out.clearance.assign(rows, std::numeric_limits<double>::infinity());
  out.nearest.assign(rows, {});
  if (!world || rows == 0) return out;
  const std::vector<double>& time = r.columns.front().values;
  const double interest = std::max(options.clearance, options.touch);
  std::vector<std::size_t> firsts{0};
  if (r.loads) firsts = evaluation::load_stretches(r, *r.loads);
  const std::vector<Load> none, &loads = r.loads ? *r.loads : none;
  std::map<std::pair<std::string, std::string>, std::vector<Stretch>> found;
  struct Bodies {
    std::string object_a, object_b;  ///< "" = of a robot
    std::string robot_a, robot_b;    ///< that it is of, or that holds it
  };
  std::map<std::pair<std::string, std::string>, Bodies> bodies;
  const auto add = [&](const CollisionModel& model, const Contact& c, std::size_t row) {
    const auto& a = model.bodies()[static_cast<std::size_t>(c.pair.a)];
    const auto& b = model.bodies()[static_cast<std::size_t>(c.pair.b)];
    const auto key = a.name < b.name ? std::pair(a.name, b.name) : std::pair(b.name, a.name);
    auto& all = found[key];
    if (all.empty() || all.back().last + 1 < row)
      all.push_back({row, row, row, c.at.distance, 0, {}});
    Stretch& s = all.back();
    // Of bodies deep in each other the nearest points may be anywhere: where they begin to touch is
    // where they do.
    if (row == s.first || std::fabs(c.at.distance) < s.placed_at) {
      s.placed_at = std::fabs(c.at.distance);
      for (std::size_t k = 0; k < 3; ++k) s.position[k] = 0.5 * (c.at.on_a[k] + c.at.on_b[k]);
    }
    if (row == s.first || c.at.distance < s.distance) s.worst = row, s.distance = c.at.distance;
    s.last = row;
    const auto robot = [&](const collision::CollisionBody& x) {
      return x.robot < 0 ? std::string() : model.robots()[static_cast<std::size_t>(x.robot)].name;
    };
    const auto& first = a.name < b.name ? a : b;
    const auto& second = a.name < b.name ? b : a;
    bodies[key] = {object_of(first), object_of(second), robot(first), robot(second)};
  };
  std::size_t unchecked_pairs = 0;
  for (std::size_t i = 0; i < firsts.size(); ++i) {
    const std::size_t begin = firsts[i], end = i + 1 < firsts.size() ? firsts[i + 1] : rows;
    RMP_TRY_ASSIGN(const auto places, places_at(*world, r, begin));
    RMP_TRY_ASSIGN(const auto model, CollisionModel::of_world(sim, r.world, progress, &places));
    if (i == 0 && !model->shapeless().empty())
      out.notes.push_back("Without a shape and therefore never in contact: " +
                          text::enumerate(model->shapeless()) + ".");
    if (i == 0) {
      std::vector<std::string> passed;
      for (const auto& p : model->passed())
        if (p.reason == collision::PairReason::rule) passed.push_back(model->describe(p.pair));
      constexpr std::size_t kMost = 10;
      const std::size_t count = passed.size();
      if (count > kMost) passed.resize(kMost);
      if (count > 0)
        out.notes.push_back(
            "Allowed to touch by rules of the world or robot: " + text::enumerate(passed) +
            (count > kMost ? ", and " + std::to_string(count - kMost) + " others" : std::string()) +
            ".");
    }
    unchecked_pairs = model->pairs().size();
    if (model->pairs().empty()) continue;
    RMP_TRY_ASSIGN(const auto q, collision::configurations(*model, r));
    const std::size_t width = model->coordinate_count();
    const auto at = [&](std::size_t row) { return std::span(q).subspan(row * width, width); };
    // Blocks, so that it can be cancelled and tells how far it is.
    constexpr std::size_t kBlock = 64;
    for (std::size_t from = begin; from < end; from += kBlock) {
      if (progress.cancelled()) return error(ErrorCode::cancelled, "the check was cancelled");
      progress.report(0.5 + 0.45 * static_cast<double>(from) / static_cast<double>(rows),
                      "contacts");
      const std::size_t to = std::min(end, from + kBlock);
      RMP_TRY_ASSIGN(const auto least,
                     model->clearance(std::span(q).subspan(from * width, (to - from) * width),
                                      kTolerance, progress));
      for (std::size_t row = from; row < to; ++row) {
        const Contact& c = least[row - from];
        if (c.pair.a < 0) continue;
        out.clearance[row] = c.at.distance;
        out.nearest[row] = model->describe(c.pair);
        if (c.at.distance > interest) continue;
        RMP_TRY_ASSIGN(const auto near, model->near(at(row), interest, progress));
        for (const Contact& one : near) add(*model, one, row);
      }
    }
    // Between rows, as the joints go evenly: where bodies are nearer than they may come to each
    // other until the next row, and at least where they are near.
    constexpr double kNear = 0.05;  // [m]
    const auto quiet = [&](std::size_t k) { return out.clearance[k] > options.touch; };
    const auto may_meet = [&](std::size_t k) {  // between k and k + 1
      const double near = std::min(out.clearance[k], out.clearance[k + 1]);
      return quiet(k) && quiet(k + 1) && !is_jump[k] && !is_jump[k + 1] &&
             (near < kNear || out.clearance[k] + out.clearance[k + 1] < most_way(*model, at, k));
    };
    for (std::size_t row = begin; row + 1 < end; ++row) {
      if (!may_meet(row)) continue;
      std::size_t last = row + 1;
      while (last + 1 < end && may_meet(last)) ++last;
      RMP_TRY_ASSIGN(const auto contact,
                     model->check_path(std::span(q).subspan(row * width, (last + 1 - row) * width),
                                       options.touch, progress));
      if (contact) add(*model, contact->contact, row + contact->segment);
      row = last;
    }
  }
  if (unchecked_pairs == 0)
    out.notes.emplace_back("Nothing in the world can touch, so there are no contacts to look for.");
  // What is meant.
  std::vector<bool> hides(rows);  // rows whose nearest pair is meant
  for (const auto& [key, stretches] : found) {
    const Bodies& who = bodies[key];
    for (const Stretch& s : stretches) {
      const double from = time[s.first], to = time[s.last];
      const double step = rows > 1 ? time[1] - time[0] : 0;
      const double slack = 1.5 * step + kSameContact;
      bool is_meant = false;
      for (const Load& load : loads) {
        const bool is_first = who.object_a == load.object, is_second = who.object_b == load.object;
        if (!is_first && !is_second) continue;
        const std::string& other_object = is_first ? who.object_b : who.object_a;
        const std::string& other_robot = is_first ? who.robot_b : who.robot_a;
        const bool touches_taking = from <= load.from + slack && to >= load.from - slack;
        const bool touches_putting = from <= load.to + slack && to >= load.to - slack;
        if (other_robot == load.robot) {  // also by what else it holds, such as a rod
          is_meant = is_meant || touches_taking || touches_putting;
        } else if (!other_object.empty() || !other_robot.empty()) {
          // What it lies on may be a robot, too: a belt, or who hands it over.
          is_meant = is_meant || touches_taking ||
                     (touches_putting && s.distance >= -kSupport - kTolerance);
        }
      }
      if (is_meant) {
        ++out.meant;
        for (std::size_t k = s.first; k <= s.last; ++k) hides[k] = true;
        continue;
      }
      Touch t;
      t.a = key.first, t.b = key.second;
      t.from = from, t.to = to, t.at = time[s.worst];
      t.distance = s.distance;
      t.position = s.position;
      t.is_touch = s.distance <= options.touch;
      out.touches.push_back(std::move(t));
    }
  }
  for (std::size_t k = 0; k < rows; ++k)
    if (hides[k]) {
      out.clearance[k] = std::numeric_limits<double>::infinity();
      out.nearest[k].clear();
    }
  return out;
}

}  // namespace robomosp::program_check
