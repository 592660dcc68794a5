// SPDX-License-Identifier: Apache-2.0
#include "collision/search_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "kernel/quiet_progress.h"
#include "spatial/instruction_set.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision {
namespace {

using spatial::Box;

const SearchKernel& search_kernel_of(spatial::InstructionSet set) {
#if defined(RMP_HAS_AVX512)
  if (set == spatial::InstructionSet::avx512) return avx512::search_kernel();
#endif
#if defined(__x86_64__)
  if (set == spatial::InstructionSet::avx2) return avx2::search_kernel();
#endif
  (void)set;
  return baseline::search_kernel();
}

/// Rounding of a place in the robot's surroundings [m]: what is free for certain is so by more.
constexpr double kSearchRounding = 1e-11;
/// How far the parts of a motion that is to be free for certain may move at first [m].
constexpr double kFirstGrowth = 0.01;
/// Parts that move by less than this are not halved any more [m].
constexpr double kLeastGrowth = 1e-9;
/// Parts of one motion that are looked at, at most.
constexpr std::size_t kMostParts = 4096;
/// Samples of one motion: more are an error of whoever asks for steps that small.
constexpr double kMostSamples = 1e6;

Error search_stopped() {
  return error(ErrorCode::cancelled, "the search for a path was cancelled");
}

}  // namespace

struct SearchCheck::Moving {
  std::int32_t body;
  std::int32_t joint;
  std::vector<SearchSphere> spheres;  ///< in the joint's frame
  SearchSphere around;
  bool are_exact;
  std::vector<bool> meets;  ///< by body
};

struct SearchCheck::Pairing {
  std::size_t a, b;  ///< of moving_
};

struct SearchCheck::Part {
  std::size_t motion;
  double middle, half;  ///< shares of it
};

/// Room for one call of look(). Vectors are kMostSearchLanes wide at most and aligned to 64 bytes.
struct SearchCheck::Room {
  std::vector<Pose> frames;     ///< rows of the joints
  std::vector<double> scratch;  ///< of the kinematics
  std::vector<double> storage;
  double *spread = nullptr, *around = nullptr, *centres = nullptr, *rooms = nullptr;
  std::vector<std::size_t> first;  ///< of each moving body's spheres
  std::vector<std::uint8_t> has_centres;
  std::vector<double> growth;  ///< rows of bounds, lane after lane [m]
  struct Asked {
    CollisionPair pair;
    std::uint32_t lanes;
    std::size_t row;  ///< of bounds
  };
  std::vector<Asked> asked;
  std::vector<double> rows;
};

SearchCheck::SearchCheck(const CollisionModel& model, std::size_t robot,
                         std::span<const double> lower, std::span<const double> upper)
    : model_(model),
      robot_(model.robots()[robot]),
      dof_(robot_.model->dof()),
      kinematics_(*robot_.model),
      kernel_(search_kernel_of(spatial::widest_instruction_set())),
      shown_(model.bodies().size()),
      room_(std::make_unique<Room>()) {
  model.place(model.shown(), shown_);
  add_moving(robot, lower, upper);
  add_still(shown_, robot_.world_T_base);

  Room& r = *room_;
  std::size_t spheres = 0;
  for (const Moving& m : moving_) {
    r.first.push_back(spheres);
    spheres += m.spheres.size();
  }
  const std::size_t joints = robot_.model->joints.size(), lanes = kernel_.lanes;
  r.frames.resize(joints * lanes);
  r.scratch.resize(kinematics_.scratch_size());
  const std::size_t numbers = (12 * joints + 3 * moving_.size() + 3 * spheres + 1) * lanes;
  r.storage.resize(numbers + 8);
  auto at = reinterpret_cast<std::uintptr_t>(r.storage.data());
  double* next = r.storage.data() + (64 - at % 64) % 64 / sizeof(double);
  const auto take = [&](std::size_t vectors) {
    double* here = next;
    next += vectors * lanes;
    return here;
  };
  r.spread = take(12 * joints);
  r.around = take(3 * moving_.size());
  r.centres = take(3 * spheres);
  r.rooms = take(1);
  r.has_centres.resize(moving_.size());
  r.growth.resize((moving_.size() + pairings_.size()) * lanes);
}

SearchCheck::~SearchCheck() = default;

/// By how much each coordinate moves a point at most that is within `reach` of a joint's origin,
/// against what moves with the joint `up_to` [m per rad or m].
std::vector<double> SearchCheck::motion_of(std::int32_t joint, std::int32_t up_to, double reach,
                                           std::span<const double> lower,
                                           std::span<const double> upper) const {
  std::vector<double> out(dof_);
  double arm = reach;
  for (std::int32_t i = joint; i >= 0 && i != up_to;) {
    const JointModel& j = robot_.model->joints[static_cast<std::size_t>(i)];
    const auto q = static_cast<std::size_t>(j.q_index);
    const double ratio = j.is_coupled() ? j.coupling.ratio : 1;
    if (j.type == JointType::prismatic) {
      const double offset = j.is_coupled() ? j.coupling.offset : 0;
      out[q] += std::fabs(ratio);
      arm += std::max(std::fabs(ratio * lower[q] + offset), std::fabs(ratio * upper[q] + offset));
    } else {
      out[q] += std::fabs(ratio) * arm;
    }
    arm += spatial::norm(j.placement.p);
    i = j.parent;
  }
  return out;
}

void SearchCheck::add_moving(std::size_t robot, std::span<const double> lower,
                             std::span<const double> upper) {
  const auto& bodies = model_.bodies();
  std::vector<std::size_t> number(bodies.size(), bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const CollisionBody& body = bodies[b];
    if (body.robot != static_cast<std::int32_t>(robot) || body.joint < 0) continue;
    Moving m{static_cast<std::int32_t>(b), body.joint,
             model_.covers_[b].spheres,    {},
             model_.covers_[b].are_exact,  std::vector<bool>(bodies.size())};
    for (SearchSphere& s : m.spheres) {
      const Vec3 at = spatial::transform(body.placement, {s.centre[0], s.centre[1], s.centre[2]});
      std::copy(at.begin(), at.end(), s.centre);
    }
    m.around = sphere_around(m.spheres);
    number[b] = moving_.size();
    const auto bound = motion_of(body.joint, -1, body.reach, lower, upper);
    bounds_.insert(bounds_.end(), bound.begin(), bound.end());
    moving_.push_back(std::move(m));
  }
  const auto& joints = robot_.model->joints;
  for (const CollisionPair& p : model_.pairs()) {
    const std::size_t a = number[static_cast<std::size_t>(p.a)],
                      b = number[static_cast<std::size_t>(p.b)];
    if (a < moving_.size()) moving_[a].meets[static_cast<std::size_t>(p.b)] = b == bodies.size();
    if (b < moving_.size()) moving_[b].meets[static_cast<std::size_t>(p.a)] = a == bodies.size();
    if (a >= moving_.size() || b >= moving_.size()) continue;
    pairings_.push_back({a, b});
    // The last joint that moves both alike; parents have lower numbers than their children.
    std::int32_t i = moving_[a].joint, k = moving_[b].joint;
    while (i != k) {
      std::int32_t& later = i > k ? i : k;
      later = joints[static_cast<std::size_t>(later)].parent;
    }
    auto bound =
        motion_of(moving_[a].joint, i, bodies[static_cast<std::size_t>(p.a)].reach, lower, upper);
    const auto other =
        motion_of(moving_[b].joint, i, bodies[static_cast<std::size_t>(p.b)].reach, lower, upper);
    for (std::size_t j = 0; j < dof_; ++j) bound[j] += other[j];
    bounds_.insert(bounds_.end(), bound.begin(), bound.end());
  }
}

void SearchCheck::add_still(const std::vector<Pose>& world_T_body, const Pose& world_T_base) {
  const Pose base_T_world = spatial::inverse(world_T_base);
  std::vector<Box> boxes;
  for (std::size_t b = 0; b < world_T_body.size(); ++b) {
    const bool is_met =
        std::any_of(moving_.begin(), moving_.end(), [&](const Moving& m) { return m.meets[b]; });
    if (!is_met) continue;
    const Pose base_T_body = spatial::compose(base_T_world, world_T_body[b]);
    for (const BodyCover::Still& own : model_.covers_[b].shapes) {
      SearchShape s = own.shape;
      Pose at;
      std::copy(s.R, s.R + 9, at.R.begin());
      std::copy(s.p, s.p + 3, at.p.begin());
      at = spatial::compose(base_T_body, at);
      std::copy(at.R.begin(), at.R.end(), s.R);
      std::copy(at.p.begin(), at.p.end(), s.p);
      Box box = spatial::moved(Box{{}, {s.half[0], s.half[1], s.half[2]}}, at);
      for (double& h : box.half) h += s.margin + kSearchRounding;
      boxes.push_back(box);
      shapes_.push_back(s);
      shape_body_.push_back(static_cast<std::int32_t>(b));
      shape_exact_.push_back(own.is_exact);
    }
  }
  tree_ = spatial::BoxTree(boxes);
  tree_.refit(boxes, tree_boxes_);
}

void SearchCheck::place(std::span<const double> rows, std::size_t count) {
  Room& r = *room_;
  const std::size_t joints = robot_.model->joints.size(), lanes = kernel_.lanes;
  kinematics_.joint_frames(rows, std::span(r.frames).first(joints * count), r.scratch);
  kernel_.spread(r.frames.data()->R.data(), 12 * joints, count, r.spread);
  for (std::size_t m = 0; m < moving_.size(); ++m)
    kernel_.centres(r.spread + 12 * lanes * static_cast<std::size_t>(moving_[m].joint),
                    &moving_[m].around, 1, r.around + 3 * lanes * m);
  std::fill(r.has_centres.begin(), r.has_centres.end(), std::uint8_t{0});
  counts_.configurations += count;
}

Result<SearchCheck::Lanes> SearchCheck::look(std::span<const double> rows, std::size_t count,
                                             double clearance, bool has_growth,
                                             Progress& progress) {
  const std::uint32_t all = (1U << count) - 1;  // other lanes repeat the last configuration
  place(rows, count);
  room_->asked.clear();
  Lanes found;
  // The outer bodies of an arm meet things more often.
  for (std::size_t m = moving_.size(); m-- > 0 && found.inside == 0;)
    against_still(m, clearance, has_growth, found);
  for (std::size_t k = 0; k < pairings_.size() && found.inside == 0; ++k)
    against_moving(pairings_[k], k, clearance, has_growth, found);
  found.inside &= all;
  found.near &= all;
  if (found.inside != 0 || room_->asked.empty()) return found;
  for (Room::Asked& a : room_->asked) a.lanes &= all;
  RMP_TRY(ask_engine(clearance, found, progress));
  return found;
}

namespace {

/// A vector that says how near counts, of a row of growths (or none).
void set_search_room(double* room, std::size_t lanes, double clearance, const double* growth) {
  for (std::size_t i = 0; i < lanes; ++i)
    room[i] = clearance + (growth ? growth[i] + kSearchRounding : 0);
}

}  // namespace

void SearchCheck::against_still(std::size_t number, double clearance, bool has_growth,
                                Lanes& found) {
  Room& r = *room_;
  const Moving& m = moving_[number];
  const std::size_t lanes = kernel_.lanes;
  const double* growth = has_growth ? &r.growth[number * lanes] : nullptr;
  set_search_room(r.rooms, lanes, clearance, growth);
  const double most = *std::max_element(r.rooms, r.rooms + lanes);
  const double* around = r.around + 3 * lanes * number;
  Box swept;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax_element(around + k * lanes, around + (k + 1) * lanes);
    swept.centre[k] = 0.5 * (*low + *high);
    swept.half[k] = 0.5 * (*high - *low) + m.around.radius;
  }
  double* centres = r.centres + 3 * lanes * r.first[number];
  tree_.near(
      tree_boxes_, swept, [&] { return most; },
      [&](std::size_t s) {
        const auto body = static_cast<std::size_t>(shape_body_[s]);
        if (found.inside != 0 || !m.meets[body] ||
            !kernel_.near_shape(around, &m.around, 1, shapes_[s], r.rooms))
          return;
        if (!r.has_centres[number]) {
          kernel_.centres(r.spread + 12 * lanes * static_cast<std::size_t>(m.joint),
                          m.spheres.data(), m.spheres.size(), centres);
          r.has_centres[number] = 1;
        }
        const std::uint32_t near =
            kernel_.near_shape(centres, m.spheres.data(), m.spheres.size(), shapes_[s], r.rooms);
        if (near == 0) return;
        if (!m.are_exact || !shape_exact_[s]) {
          const auto [a, b] = std::minmax(m.body, shape_body_[s]);
          r.asked.push_back({{a, b}, near, number});
          return;
        }
        found.near |= near;
        if (!has_growth) {
          found.inside |= near;
          return;
        }
        double exact[kMostSearchLanes];  // vectors are read from any address
        set_search_room(exact, lanes, clearance, nullptr);
        found.inside |=
            kernel_.near_shape(centres, m.spheres.data(), m.spheres.size(), shapes_[s], exact);
      });
}

void SearchCheck::against_moving(const Pairing& p, std::size_t number, double clearance,
                                 bool has_growth, Lanes& found) {
  Room& r = *room_;
  const Moving &a = moving_[p.a], &b = moving_[p.b];
  const std::size_t lanes = kernel_.lanes, row = moving_.size() + number;
  set_search_room(r.rooms, lanes, clearance, has_growth ? &r.growth[row * lanes] : nullptr);
  const double *around_a = r.around + 3 * lanes * p.a, *around_b = r.around + 3 * lanes * p.b;
  if (!kernel_.near_spheres(around_a, &a.around, 1, around_b, &b.around, 1, around_b, b.around,
                            r.rooms))
    return;
  for (const std::size_t m : {p.a, p.b}) {
    if (r.has_centres[m]) continue;
    kernel_.centres(r.spread + 12 * lanes * static_cast<std::size_t>(moving_[m].joint),
                    moving_[m].spheres.data(), moving_[m].spheres.size(),
                    r.centres + 3 * lanes * r.first[m]);
    r.has_centres[m] = 1;
  }
  const auto near_within = [&](const double* room) {
    return kernel_.near_spheres(r.centres + 3 * lanes * r.first[p.a], a.spheres.data(),
                                a.spheres.size(), r.centres + 3 * lanes * r.first[p.b],
                                b.spheres.data(), b.spheres.size(), around_b, b.around, room);
  };
  const std::uint32_t near = near_within(r.rooms);
  if (near == 0) return;
  if (!a.are_exact || !b.are_exact) {
    const auto [first, second] = std::minmax(a.body, b.body);
    r.asked.push_back({{first, second}, near, row});
    return;
  }
  found.near |= near;
  if (!has_growth) {
    found.inside |= near;
    return;
  }
  double exact[kMostSearchLanes];
  set_search_room(exact, lanes, clearance, nullptr);
  found.inside |= near_within(exact);
}

/// Distances of the pairs that spheres and boxes do not settle, lane by lane.
Result<void> SearchCheck::ask_engine(double clearance, Lanes& found, Progress& progress) {
  Room& r = *room_;
  const std::size_t joints = robot_.model->joints.size(), lanes = kernel_.lanes;
  std::uint32_t wanted = 0;
  for (const Room::Asked& a : r.asked) wanted |= a.lanes;
  // Pieces of one body ask for the same pair.
  std::stable_sort(r.asked.begin(), r.asked.end(),
                   [](const auto& x, const auto& y) { return comes_before(x.pair, y.pair); });
  std::vector<Pose> poses;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const std::uint32_t bit = 1U << lane;
    if (!(wanted & bit)) continue;
    bool is_placed = false;
    const Room::Asked* before = nullptr;
    for (const Room::Asked& a : r.asked) {
      if (!(a.lanes & bit)) continue;
      const bool is_again = before && before->pair.a == a.pair.a && before->pair.b == a.pair.b;
      if (is_again) continue;
      before = &a;
      if (!is_placed) {
        poses = shown_;
        for (const Moving& m : moving_) {
          const auto b = static_cast<std::size_t>(m.body);
          poses[b] = spatial::compose(
              robot_.world_T_base,
              spatial::compose(r.frames[lane * joints + static_cast<std::size_t>(m.joint)],
                               model_.bodies()[b].placement));
        }
        is_placed = true;
      }
      const double room = clearance + r.growth[a.row * lanes + lane];
      PairDistance d;
      ++counts_.distances;
      RMP_TRY(model_.ask(poses, {&a.pair, 1}, room * (1 + 1e-9), {&d, 1}, progress));
      if (d.distance < clearance) {
        found.inside |= bit;
        return {};
      }
      if (d.distance < room) found.near |= bit;
    }
  }
  return {};
}

Result<bool> SearchCheck::is_free(std::span<const double> q, double clearance, Progress& progress) {
  QuietProgress quiet(progress);
  std::fill(room_->growth.begin(), room_->growth.end(), 0.0);
  RMP_TRY_ASSIGN(const Lanes found, look(q, 1, clearance, false, quiet));
  return found.inside == 0;
}

Result<bool> SearchCheck::seems_free(std::span<const double> a, std::span<const double> b,
                                     double clearance, double step, Progress& progress) {
  QuietProgress quiet(progress);
  double motion = 0;
  for (std::size_t m = 0; m < moving_.size(); ++m) {
    double own = 0;
    for (std::size_t j = 0; j < dof_; ++j) own += bounds_[m * dof_ + j] * std::fabs(b[j] - a[j]);
    motion = std::max(motion, own);
  }
  const std::size_t lanes = kernel_.lanes;
  const double steps = std::ceil(motion / step);
  if (!(steps <= kMostSamples))
    return error(ErrorCode::invalid_argument, "a motion is too long to check",
                 "Give the joints limits.");
  const std::size_t samples = static_cast<std::size_t>(steps) + 1,
                    groups = (samples + lanes - 1) / lanes;
  std::fill(room_->growth.begin(), room_->growth.end(), 0.0);
  std::vector<double>& rows = room_->rows;
  rows.resize(lanes * dof_);
  // Each group is spread over the whole motion, and one after the other is far from the last: what
  // is in the way is met soon.
  std::size_t stride =
      std::max<std::size_t>(1, static_cast<std::size_t>(0.618 * static_cast<double>(groups)));
  while (std::gcd(stride, groups) != 1) --stride;
  std::size_t group = groups / 2;
  for (std::size_t n = 0; n < groups; ++n, group = (group + stride) % groups) {
    if (n % 64 == 63 && progress.cancelled()) return search_stopped();
    std::size_t count = 0;
    for (std::size_t i = group; i < samples; i += groups, ++count) {
      const double share =
          samples > 1 ? static_cast<double>(i) / static_cast<double>(samples - 1) : 0;
      for (std::size_t j = 0; j < dof_; ++j)
        rows[count * dof_ + j] =
            i + 1 == samples && samples > 1 ? b[j] : a[j] + share * (b[j] - a[j]);
    }
    RMP_TRY_ASSIGN(const Lanes found,
                   look(std::span(rows).first(count * dof_), count, clearance, false, quiet));
    if (found.inside != 0) return false;
  }
  return true;
}

Result<MotionFound> SearchCheck::check_rows(std::span<const double> rows, double clearance,
                                            Progress& progress) {
  QuietProgress quiet(progress);
  const std::size_t motions = std::max<std::size_t>(rows.size() / dof_, 1) - 1,
                    all = moving_.size() + pairings_.size(), lanes = kernel_.lanes;
  if (all == 0) return MotionFound::free;
  if (motions == 0) {
    RMP_TRY_ASSIGN(const bool free, is_free(rows, clearance, progress));
    return free ? MotionFound::free : MotionFound::blocked;
  }
  // How far bodies move on each of the motions, and pairs of them against each other.
  std::vector<double> moved(motions * all), most(motions);
  std::vector<Part> parts;
  for (std::size_t i = motions; i-- > 0;) {
    const double *a = &rows[i * dof_], *b = a + dof_;
    for (std::size_t k = 0; k < all; ++k) {
      double sum = 0;
      for (std::size_t j = 0; j < dof_; ++j) sum += bounds_[k * dof_ + j] * std::fabs(b[j] - a[j]);
      moved[i * all + k] = sum;
      most[i] = std::max(most[i], sum);
    }
    const double count = std::max(1.0, std::ceil(most[i] / (2 * kFirstGrowth)));
    if (!(count <= kMostSamples)) return MotionFound::unsure;
    const double half = 0.5 / count;
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
      parts.push_back({i, half * (2 * static_cast<double>(k) + 1), half});
  }
  const std::size_t room_for = parts.size() + kMostParts;
  std::vector<double> asked(lanes * dof_);
  for (std::size_t seen = 0, calls = 0; !parts.empty(); ++calls) {
    if (calls % 64 == 63 && progress.cancelled()) return search_stopped();
    const std::size_t count = std::min(lanes, parts.size());
    std::array<Part, kMostSearchLanes> now{};
    for (std::size_t n = 0; n < count; ++n) {
      now[n] = parts.back();
      parts.pop_back();
      const double *a = &rows[now[n].motion * dof_], *b = a + dof_;
      for (std::size_t j = 0; j < dof_; ++j)
        asked[n * dof_ + j] = a[j] + now[n].middle * (b[j] - a[j]);
    }
    for (std::size_t k = 0; k < all; ++k)
      for (std::size_t n = 0; n < lanes; ++n) {
        const Part& p = now[std::min(n, count - 1)];
        room_->growth[k * lanes + n] = p.half * moved[p.motion * all + k];
      }
    RMP_TRY_ASSIGN(const Lanes found,
                   look(std::span(asked).first(count * dof_), count, clearance, true, quiet));
    if (found.inside != 0) return MotionFound::blocked;
    seen += count;
    for (std::size_t n = count; n-- > 0;) {
      if (!(found.near & (1U << n))) continue;
      const Part& p = now[n];
      if (p.half * most[p.motion] < kLeastGrowth || seen > room_for) return MotionFound::unsure;
      parts.push_back({p.motion, p.middle + 0.5 * p.half, 0.5 * p.half});
      parts.push_back({p.motion, p.middle - 0.5 * p.half, 0.5 * p.half});
    }
  }
  return MotionFound::free;
}

}  // namespace robomosp::collision
