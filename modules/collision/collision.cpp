// SPDX-License-Identifier: Apache-2.0
#include "collision/collision.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "kernel/quiet_progress.h"
#include "kernel/text.h"
#include "robotics/kinematics.h"
#include "spatial/parallel.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision {
namespace {

using namespace spatial;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kAboutASample = 5000;  ///< that the clearance of a configuration takes [ns]

}  // namespace

std::vector<double> CollisionModel::shown() const {
  std::vector<double> q;
  for (const CollisionRobot& r : robots_) q.insert(q.end(), r.shown.begin(), r.shown.end());
  return q;
}

std::string CollisionModel::describe(const CollisionPair& p) const {
  return bodies_[static_cast<std::size_t>(p.a)].name + " and " +
         bodies_[static_cast<std::size_t>(p.b)].name;
}

void CollisionModel::place(std::span<const double> q, std::span<Pose> out) const {
  Sample at = sample();
  place_moving(q, at);
  std::copy(at.poses.begin(), at.poses.end(), out.begin());
}

CollisionModel::Sample CollisionModel::sample() const {
  Sample s;
  for (const CollisionRobot& r : robots_) s.frames.emplace_back(r.model->joints.size());
  for (const CollisionBody& b : bodies_) s.poses.push_back(b.placement);
  return s;
}

void CollisionModel::place_moving(std::span<const double> q, Sample& s) const {
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const CollisionRobot& r = robots_[i];
    robotics::forward_kinematics(*r.model, q.subspan(r.first, r.model->coordinate_count()),
                                 s.frames[i]);
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const CollisionBody& body = bodies_[b];
    if (body.joint < 0) continue;
    const auto robot = static_cast<std::size_t>(body.robot);
    s.poses[b] =
        compose(robots_[robot].world_T_base,
                compose(s.frames[robot][static_cast<std::size_t>(body.joint)], body.placement));
  }
}

Result<void> CollisionModel::check(std::span<const double> q) const {
  if (coordinates_ == 0 ? !q.empty() : q.empty() || q.size() % coordinates_ != 0)
    return error(ErrorCode::invalid_argument,
                 std::to_string(q.size()) + " joint values for configurations of " +
                     std::to_string(coordinates_),
                 "Give whole configurations.");
  for (const double x : q)
    if (!std::isfinite(x))
      return error(ErrorCode::invalid_argument, "a joint value is not a finite number",
                   "Correct it.");
  return {};
}

Result<void> CollisionModel::ask(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                                 double interest, std::span<PairDistance> out, Progress& progress,
                                 double tolerance) const {
  if (pairs.empty()) return {};
  if (tolerance > 0 && bounds_) {
    auto told = guarded(provider_, [&] {
      return bounds_->lower_bounds(poses, pairs, interest, tolerance, out, progress);
    });
    if (!told.ok()) return std::move(told).error();
    for (const PairDistance& d : out)
      if (std::isnan(d.distance) || d.distance == -kInf || !is_finite(d.on_a) || !is_finite(d.on_b))
        return error(
            ErrorCode::plugin_failed,
            "provider " + text::quote(provider_) + " returned a bound that is not a number",
            "Report it to the provider's author or choose another provider.");
    return {};
  }
  auto done =
      guarded(provider_, [&] { return scene_->distances(poses, pairs, interest, out, progress); });
  if (!done.ok()) return std::move(done).error();
  return {};
}

Result<std::vector<PairDistance>> CollisionModel::distances_of(std::span<const double> q,
                                                               std::span<const CollisionPair> pairs,
                                                               double interest,
                                                               Progress& progress) const {
  RMP_TRY(check(q));
  const std::size_t samples = coordinates_ == 0 ? 1 : q.size() / coordinates_;
  std::vector<PairDistance> out(samples * pairs.size());
  if (out.empty()) return out;
  std::vector<Pose> poses;
  poses.reserve(samples * bodies_.size());
  Sample at = sample();
  for (std::size_t i = 0; i < samples; ++i) {
    place_moving(q.subspan(i * coordinates_, coordinates_), at);
    poses.insert(poses.end(), at.poses.begin(), at.poses.end());
  }
  RMP_TRY(ask(poses, pairs, interest, out, progress));
  return out;
}

std::vector<CollisionPair> CollisionModel::candidates(const Sample& s, const PairSet& of,
                                                      double within) const {
  std::vector<CollisionPair> out;
  broad_.near(
      s.boxes, of, [&] { return within; }, [&](const CollisionPair& p) { out.push_back(p); });
  std::sort(out.begin(), out.end(), comes_before);
  return out;
}

Result<Contact> CollisionModel::least(Sample& s, const PairSet& of, double interest,
                                      const Progress& whole, double tolerance) const {
  if (tolerance > 0 && bounds_) return least_bound(s, of, interest, whole, tolerance);
  Contact best{{-1, -1}, {interest, {}, {}}};
  QuietProgress none(whole);  // one configuration
  std::optional<Error> failure;
  const auto room_left = [&] { return failure ? -1 : std::max(best.at.distance, 0.0); };
  const auto consider = [&](const CollisionPair& p) {
    // A little more than the least so far, so that rounding leaves out none that is equal.
    const double room = room_left() * (1 + 1e-12) + 1e-15;
    PairDistance d;
    if (auto done = ask(s.poses, {&p, 1}, room, {&d, 1}, none); !done.ok()) {
      failure = std::move(done).error();
      return;
    }
    const bool is_first =
        d.distance == best.at.distance && best.pair.a >= 0 && comes_before(p, best.pair);
    if (d.distance < best.at.distance || is_first) best = {p, d};
  };
  if (bounds_) {
    // Where meshes are among them, what may be the nearest is found first.
    RMP_TRY_ASSIGN(const Rough known, rough(s, of, interest, none));
    // By some more, as the exact distance may be computed in another way.
    best.at.distance = std::min(interest, std::max(known.most, 0.0) * (1 + 1e-6) + 1e-9);
    for (const Rough::Row& row : known.rows)
      if (!failure && row.least <= room_left() * (1 + 1e-12) + 1e-15) consider(row.pair);
    if (failure) return std::move(*failure);
    s.nearest = best.pair;
    return best;
  }
  // What was nearest before mostly still is, and leaves little to look at.
  const CollisionPair before = s.nearest;
  if (before.a >= 0 && of.contains(before.a, before.b)) consider(before);
  broad_.near(s.boxes, of, room_left, [&](const CollisionPair& p) {
    if (p.a != before.a || p.b != before.b) consider(p);
  });
  if (failure) return std::move(*failure);
  s.nearest = best.pair;
  return best;
}

/// Of one pair, at least; what is found is put into what is known.
Result<double> CollisionModel::bound(const Sample& s, const CollisionPair& p, double tolerance,
                                     Rough& known, Progress& progress) const {
  const double room = std::max(known.most, 0.0);
  PairDistance d;
  RMP_TRY(ask(s.poses, {&p, 1}, room, {&d, 1}, progress, tolerance));
  // Equal points: it is only known to be no nearer.
  if (d.distance > 0 && d.on_a == d.on_b) return std::min(room, d.distance);
  const double above = d.distance > 0 ? std::max(d.distance, distance(d.on_a, d.on_b)) : d.distance;
  if (above < known.most) known.most = above, known.nearest = {p, d};
  return d.distance;
}

Result<CollisionModel::Rough> CollisionModel::rough(const Sample& s, const PairSet& of,
                                                    double interest, Progress& progress) const {
  constexpr double kHalf = std::numeric_limits<double>::max();  // half of the distance will do
  Rough known{{}, {{-1, -1}, {interest, {}, {}}}, interest};
  std::optional<Error> failure;
  broad_.near(
      s.boxes, of, [&] { return failure ? -1 : std::max(known.most, 0.0); },
      [&](const CollisionPair& p) {
        auto least = bound(s, p, kHalf, known, progress);
        if (least.ok()) known.rows.push_back({p, *least});
        else failure = std::move(least).error();
      });
  if (failure) return std::move(*failure);
  std::sort(known.rows.begin(), known.rows.end(), [](const Rough::Row& x, const Rough::Row& y) {
    return x.least != y.least ? x.least < y.least : comes_before(x.pair, y.pair);
  });
  return known;
}

Result<Contact> CollisionModel::least_bound(const Sample& s, const PairSet& of, double interest,
                                            const Progress& whole, double tolerance) const {
  QuietProgress none(whole);  // one configuration
  RMP_TRY_ASSIGN(Rough known, rough(s, of, interest, none));
  double told = known.most;
  for (const Rough::Row& row : known.rows) {
    double least = row.least;
    if (known.most > 0 && std::isfinite(known.most) &&
        least < std::max(known.most - tolerance, 0.5 * known.most)) {
      RMP_TRY_ASSIGN(least, bound(s, row.pair, tolerance, known, none));
    }
    told = std::min(told, least);
  }
  if (known.nearest.pair.a >= 0) known.nearest.at.distance = told;
  return known.nearest;
}

Result<std::vector<PairDistance>> CollisionModel::distances(std::span<const double> q,
                                                            double interest,
                                                            Progress& progress) const {
  return distances_of(q, pairs_, interest, progress);
}

Result<std::vector<Contact>> CollisionModel::near(std::span<const double> q, double interest,
                                                  Progress& progress) const {
  RMP_TRY(check(q));
  if (!(interest >= 0))
    return error(ErrorCode::invalid_argument, "the requested distance is not a length",
                 "Give a length of 0 or more, or infinity.");
  Sample s = sample();
  place_moving(q, s);
  broad_.place(s.poses, {}, s.boxes);
  const auto asked = candidates(s, checked_, interest);
  std::vector<PairDistance> found(asked.size());
  RMP_TRY(ask(s.poses, asked, interest, found, progress));
  std::vector<Contact> out;
  for (std::size_t k = 0; k < asked.size(); ++k)
    if (found[k].distance < interest) out.push_back({asked[k], found[k]});
  return out;
}

Result<std::vector<CollisionPair>> CollisionModel::collisions(std::span<const double> q,
                                                              Progress& progress) const {
  RMP_TRY(check(q));
  Sample s = sample();
  place_moving(q, s);
  broad_.place(s.poses, {}, s.boxes);
  return touching_at(s, candidates(s, checked_, 0), progress);
}

Result<std::vector<CollisionPair>> CollisionModel::touching_at(const Sample& s,
                                                               std::span<const CollisionPair> asked,
                                                               Progress& progress) const {
  std::vector<CollisionPair> hits;
  if (asked.empty()) return hits;
  std::vector<std::uint8_t> touch(asked.size());
  auto done =
      guarded(provider_, [&] { return scene_->collisions(s.poses, asked, touch, progress); });
  if (!done.ok()) return std::move(done).error();
  for (std::size_t k = 0; k < asked.size(); ++k)
    if (touch[k]) hits.push_back(asked[k]);
  return hits;
}

Result<std::vector<CollisionPair>> CollisionModel::touching(std::span<const double> q,
                                                            std::span<const CollisionPair> pairs,
                                                            Progress& progress) const {
  RMP_TRY(check(q));
  Sample s = sample();
  place_moving(q, s);
  return touching_at(s, pairs, progress);
}

Result<std::vector<Contact>> CollisionModel::between(std::span<const double> q,
                                                     std::span<const CollisionPair> pairs,
                                                     double interest, Progress& progress) const {
  RMP_TRY_ASSIGN(const auto found, distances_of(q, pairs, interest, progress));
  std::vector<Contact> out;
  for (std::size_t k = 0; k < pairs.size(); ++k) out.push_back({pairs[k], found[k]});
  return out;
}

Result<std::vector<Contact>> CollisionModel::clearance(std::span<const double> q,
                                                       Progress& progress) const {
  return clearance(q, 0, progress);
}

Result<std::vector<Contact>> CollisionModel::clearance(std::span<const double> q, double tolerance,
                                                       Progress& progress) const {
  RMP_TRY(check(q));
  if (!(tolerance >= 0) || !std::isfinite(tolerance))
    return error(ErrorCode::invalid_argument, "the tolerance is not a length",
                 "Give a length of 0 or more.");
  const std::size_t samples = coordinates_ == 0 ? 1 : q.size() / coordinates_;
  std::vector<Contact> out(samples, Contact{{-1, -1}, {kInf, {}, {}}});
  if (pairs_.empty()) return out;
  std::mutex mutex;
  std::optional<Error> failure;  // guarded by mutex
  std::atomic<bool> stops{false};
  const auto fail = [&](Error e) {
    const std::lock_guard lock(mutex);
    if (!failure) failure = std::move(e);
    stops = true;
  };
  const auto work = [&](std::size_t first, std::size_t last, std::size_t thread) {
    Sample s = sample();
    for (std::size_t i = first; i < last && !stops; ++i) {
      if (progress.cancelled())
        return fail(error(ErrorCode::cancelled, "the clearance computation was cancelled"));
      place_moving(q.subspan(i * coordinates_, coordinates_), s);
      broad_.place(s.poses, {}, s.boxes);
      auto found = least(s, checked_, kInf, progress, tolerance);
      if (!found.ok()) return fail(std::move(found).error());
      out[i] = *found;
      if (thread == 0 && i % 64 == 0)
        progress.report(static_cast<double>(i - first) / static_cast<double>(last - first),
                        "clearance");
    }
  };
  const std::size_t threads = is_script_ ? 1 : worthwhile_threads(samples, kAboutASample);
  in_parallel(samples, 16, threads, work);
  if (failure) return std::move(*failure);
  return out;
}

}  // namespace robomosp::collision
