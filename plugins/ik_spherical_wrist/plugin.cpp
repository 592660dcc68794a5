// SPDX-License-Identifier: Apache-2.0
// Provider "spherical_wrist" of robomosp.ik/1 (layer: plugin): all configurations of 6R arms by
// formulas, the choice among them, and what to say of targets without one.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/ik_branches.h>
#include <robomosp/sdk/plugin.h>

#include "branches.h"
#include "candidates.h"
#include "family.h"
#include "general.h"
#include "lanes.h"
#include "spatial/ik_support.h"
#include "spatial/pose.h"
#include "spatial/print.h"
#include "spatial/rotation.h"

namespace robomosp::ik_spherical_wrist {
namespace {

const rmp_param kParams[] = {
    {"turns", "bool", "",
     "If all solutions are requested, include those a full turn away that limits allow.", "true",
     nullptr, 0, 0},
    {"switching", "bool", "",
     "On a path, continue with another configuration if a joint limit ends the present one; "
     "otherwise the path ends there.",
     "false", nullptr, 0, 0},
};

/// Branches may have met, and the arm may be singular, below this margin (Candidates::margin).
constexpr double kMeeting = 1e-6;
/// Solutions closer to each other than this are one [rad].
constexpr double kSameSolution = 1e-7;
constexpr std::size_t kMostSolutions = 4096;

template <class T>
using Angles6 = std::array<T, 6>;
using Angles = Angles6<double>;
static_assert(sizeof(Pose) == 12 * sizeof(double));

/// One tip, made ready.
struct Prepared {
  Family family;
  Question question;  ///< with limits
  const LaneSolver* lanes;
  ArmPlaces places{};
  Angles6<std::size_t> index{};  ///< of the joints in a configuration

  [[nodiscard]] LaneQuestions together(const Pose* targets, const double* near, double touch,
                                       std::size_t count) const {
    return {targets->R.data(),
            near,
            family.tip_wrist.data(),
            question.lower.data(),
            question.upper.data(),
            touch,
            count};
  }
  void candidates(const Question& q, Candidates& out) const {
    if (family.form == Form::general) solve_general(family, q, out);
    else lanes->solve(family.lanes, together(&q.target, q.near.data(), q.touch, 1), &out);
    lanes->rank(&out, 1);
  }
};

Result<Prepared> prepared(const RobotModel& model, std::size_t tip) {
  Prepared p{{}, {}, &lane_solver(), {}, {}};
  RMP_TRY_ASSIGN(p.family, recognise(model, tip));
  const auto put = [&](std::size_t i, const Pose& place) {
    std::copy(place.R.begin(), place.R.end(), p.places.begin() + 12 * i);
    std::copy(place.p.begin(), place.p.end(), p.places.begin() + 12 * i + 9);
  };
  for (std::size_t j = 0; j < 6; ++j) {
    const spatial::ArmJoint& joint = p.family.arm.joints[j];
    p.question.lower[j] = joint.lower;
    p.question.upper[j] = joint.upper;
    p.index[j] = joint.q_index;
    put(j, joint.placement);
  }
  put(6, p.family.arm.tool);
  return p;
}

Angles lane(const Candidates& c, std::size_t i) {
  return {c.q[0][i], c.q[1][i], c.q[2][i], c.q[3][i], c.q[4][i], c.q[5][i]};
}

/// Everything of one call; nothing is shared between threads.
class Solver {
 public:
  Solver(const Prepared& prepared, const IkBatch& batch, bool turns, bool switching)
      : prepared_(prepared),
        arm_(prepared.family.arm),
        batch_(batch),
        turns_(turns),
        switching_(switching),
        question_(prepared.question) {
    question_.touch = 0.5 * std::min(batch.tolerance.position, 1e-3 * arm_.length);
  }

  /// Up to kTogether targets. `full`: the configurations to stay near in, the first answers out.
  /// `onward`: of one target, whose sample before it on a path is in `full`.
  void solve(std::span<const Pose> targets, std::span<double> full, bool onward,
             std::span<IkResult> out) {
    const std::size_t count = targets.size(), n = full.size() / count;
    std::array<Angles, kTogether> near, first;
    std::array<bool, kTogether> solved{};
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j < 6; ++j) near[i][j] = full[i * n + prepared_.index[j]];
    const auto lanes = prepared_.together(targets.data(), near[0].data(), question_.touch, count);
    const bool is_general = prepared_.family.form == Form::general;
    if (!is_general) {
      prepared_.lanes->solve(prepared_.family.lanes, lanes, found_.data());
      prepared_.lanes->rank(found_.data(), count);
    }
    for (std::size_t i = 0; i < count; ++i) {
      begin(targets[i], near[i], out[i]);
      c_ = &found_[i];
      if (is_general) prepared_.candidates(question_, *c_);
      solved[i] = answer(targets[i], full.subspan(i * n, n), onward, first[i], out[i]);
      if (!solved[i]) first[i] = near[i];
    }
    // What was solved is verified side by side too.
    alignas(64) std::array<double, kTogether> distance, square;
    prepared_.lanes->measure(prepared_.places, lanes, first[0].data(), distance.data(),
                             square.data());
    for (std::size_t i = 0; i < count; ++i)
      if (solved[i]) set_errors(targets[i], first[i], distance[i], square[i], out[i]);
  }

 private:
  // Finds the configurations of one target, of which candidates are in c_; false when there is
  // none, and `out` says why. `first` and `out` but for its errors, otherwise.
  bool answer(const Pose& target, std::span<double> full, bool onward, Angles& first,
              IkResult& out) {
    std::size_t best = choose(true);
    if (best == kBranches && wrist_is_free()) best = vary_kept_joint();
    if (best == kBranches) return explain(target, full, out), false;
    if (onward && !switching_) {
      const std::size_t any = choose(false);
      if (any != best && c_->outside[any] > 0 && 4 * c_->cost[any] < c_->cost[best])
        return blame_limit(target, full, any, out), false;
    }
    first = lane(*c_, best);
    put(first, full);
    const bool meets = c_->margin[best] < kMeeting;
    if (!batch_.all_solutions) out.q.assign(full.begin(), full.end());
    else collect(full, out);
    out.status = IkStatus::solved;
    if (meets) out.lost_direction = spatial::lost_direction(arm_, first);
    return true;
  }

  void begin(const Pose& target, const Angles& near, IkResult& out) {
    out.status = IkStatus::not_converged;
    out.q.clear();  // keeps its memory
    out.detail.clear();
    out.iterations = 0;
    out.shortfall = 0;
    out.limiting_joint = -1;
    out.lost_direction = {};
    question_.target = target;
    question_.near = near;
  }

  void put(const Angles& q, std::span<double> full) const {
    for (std::size_t i = 0; i < 6; ++i) full[prepared_.index[i]] = q[i];
  }

  void measure(const Pose& target, const Angles& q, IkResult& out) const {
    alignas(64) std::array<double, kTogether> distance, square;
    prepared_.lanes->measure(prepared_.places,
                             prepared_.together(&target, question_.near.data(), 0, 1), q.data(),
                             distance.data(), square.data());
    set_errors(target, q, distance[0], square[0], out);
  }
  // Small turns by the difference of the matrices, which is 2 sqrt(2) sin(angle / 2) long.
  void set_errors(const Pose& target, const Angles& q, double distance, double square,
                  IkResult& out) const {
    out.position_error = distance;
    out.rotation_error =
        square < 1e-8
            ? std::sqrt(0.5 * square)
            : spatial::norm(spatial::rotation_difference(spatial::arm_tip(arm_, q).R, target.R));
  }

  /// The lane nearest to the seed that reaches the target; kBranches = none.
  [[nodiscard]] std::size_t choose(bool within_limits) const {
    std::size_t best = kBranches;
    for (std::size_t i = 0; i < kBranches; ++i)
      if (c_->gap[i] == 0 && (!within_limits || c_->outside[i] == 0) &&
          (best == kBranches || c_->cost[i] < c_->cost[best]))
        best = i;
    return best;
  }

  [[nodiscard]] bool is_solution(std::size_t i) const {
    return c_->gap[i] == 0 && c_->outside[i] == 0;
  }
  [[nodiscard]] bool wrist_is_free(double margin = 1e-10) const {
    return std::any_of(c_->margin.begin(), c_->margin.end(), [&](double m) { return m < margin; });
  }

  /// At a singular wrist one joint is kept where it is; if that does not fit the limits, other
  /// places of it are tried, the nearest first.
  std::size_t vary_kept_joint() {
    constexpr int kPlaces = 24;
    const std::size_t kept = prepared_.family.form == Form::three_parallel ? 5 : 3;
    const double near = question_.near[kept], low = std::max(question_.lower[kept], near - 2 * kPi),
                 high = std::min(question_.upper[kept], near + 2 * kPi);
    const Candidates first = *c_;
    for (int i = 1; i <= 2 * kPlaces; ++i) {
      const double share = ((i + 1) / 2) / static_cast<double>(kPlaces);
      question_.near[kept] = near + share * (i % 2 ? high - near : low - near);
      prepared_.candidates(question_, *c_);
      if (const std::size_t best = choose(true); best != kBranches) return best;
    }
    question_.near[kept] = near;
    *c_ = first;
    return kBranches;
  }

  /// All lanes within the limits, those nearest to the seed first, then whole turns.
  void collect(std::span<double> full, IkResult& out) {
    std::array<std::size_t, kBranches> order;
    std::size_t count = 0;
    for (std::size_t i = 0; i < kBranches; ++i)
      if (is_solution(i)) order[static_cast<std::size_t>(c_->rank[i])] = i, ++count;
    if (wrist_is_free(kMeeting)) {
      const auto all = order;
      const std::size_t before = std::exchange(count, 0);
      for (std::size_t k = 0; k < before; ++k)
        if (!known(all[k], order, count)) order[count++] = all[k];
    }
    const std::size_t n = full.size();
    out.q.resize(count * n);
    double* to = out.q.data();
    for (std::size_t k = 0; k < count; ++k, to += n) {
      if (n > 6) std::copy(full.begin(), full.end(), to);
      for (std::size_t j = 0; j < 6; ++j) to[prepared_.index[j]] = c_->q[j][order[k]];
    }
    if (turns_ && may_turn()) add_turns(full, {order.data(), count}, out);
  }

  [[nodiscard]] bool known(std::size_t i, const std::array<std::size_t, kBranches>& order,
                           std::size_t count) const {
    if (c_->margin[i] >= kMeeting) return false;
    for (std::size_t k = 0; k < count; ++k) {
      double apart = 0;
      for (const auto& q : c_->q)
        apart = std::max(apart, std::fabs(std::remainder(q[i] - q[order[k]], 2 * kPi)));
      if (apart < kSameSolution) return true;
    }
    return false;
  }

  [[nodiscard]] bool may_turn() const {
    for (std::size_t i = 0; i < 6; ++i)
      if (question_.upper[i] - question_.lower[i] > 2 * kPi &&
          std::isfinite(question_.upper[i] - question_.lower[i]))
        return true;
    return false;
  }

  void add_turns(std::span<const double> full, std::span<const std::size_t> lanes, IkResult& out) {
    std::vector<std::pair<double, std::vector<double>>> more;
    for (const std::size_t i : lanes)
      for (auto& q : spatial::other_turns(arm_, lane(*c_, i), kMostSolutions / kBranches)) {
        double cost = 0;
        for (std::size_t j = 0; j < 6; ++j)
          cost += (q[j] - question_.near[j]) * (q[j] - question_.near[j]);
        more.emplace_back(cost, std::move(q));
      }
    std::stable_sort(more.begin(), more.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [cost, q] : more) {
      const std::size_t at = out.q.size();
      out.q.insert(out.q.end(), full.begin(), full.end());
      for (std::size_t j = 0; j < 6; ++j) out.q[at + arm_.joints[j].q_index] = q[j];
    }
  }

  void explain(const Pose& target, std::span<double> full, IkResult& out) {
    std::size_t least = kBranches;
    for (std::size_t i = 0; i < kBranches; ++i)
      if (c_->gap[i] == 0 && (least == kBranches || c_->outside[i] < c_->outside[least])) least = i;
    if (least != kBranches) return blame_limit(target, full, least, out);
    blame_reach(target, full, out);
  }

  /// A limit ends branch i.
  void blame_limit(const Pose& target, std::span<double> full, std::size_t i, IkResult& out) {
    Angles q = lane(*c_, i);
    std::size_t worst = 0;
    double most = -1;
    for (std::size_t j = 0; j < 6; ++j) {
      const double by = spatial::turns_outside(arm_.joints[j], q[j]);
      if (by > most) most = by, worst = j;
    }
    out.status = IkStatus::joint_limit;
    out.limiting_joint = static_cast<std::int32_t>(arm_.joints[worst].joint);
    out.detail = spatial::over_limit(arm_.joints[worst], q[worst]);
    nearest_within(target, q, full, out);
  }

  void blame_reach(const Pose& target, std::span<double> full, IkResult& out) {
    // The lanes hold the answers with their roots cut off: close to the closest ones.
    std::array<std::size_t, kBranches> order;
    for (std::size_t i = 0; i < kBranches; ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return c_->gap[a] < c_->gap[b]; });
    Angles best = question_.near;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < kBranches && std::isfinite(c_->gap[order[k]]); ++k) {
      if (k >= 4) break;
      if (k % 2 == 1 && prepared_.family.form != Form::three_parallel) continue;  // same arm
      Angles q = lane(*c_, order[k]);
      const double gap = spatial::closest_position(arm_, target, q);
      const Pose tip = spatial::arm_tip(arm_, q);
      if (spatial::norm(spatial::rotation_difference(tip.R, target.R)) > 1e-6) continue;
      if (gap < least) least = gap, best = q;
    }
    out.status = IkStatus::out_of_reach;
    if (std::isfinite(least) && least > batch_.tolerance.position) {
      out.shortfall = least;
      out.detail = "the target is out of reach by " + spatial::print_number(least, 3) + " m";
    } else {
      out.detail = "the position can be reached, but not with this orientation";
    }
    nearest_within(target, best, full, out);
  }

  /// Puts the configuration within the limits that is closest to the target, as found from q.
  void nearest_within(const Pose& target, Angles q, std::span<double> full, IkResult& out) {
    bool inside = true;
    for (std::size_t j = 0; j < 6; ++j) {
      q[j] = spatial::turn_within(arm_.joints[j], q[j], question_.near[j]);
      inside &= q[j] >= arm_.joints[j].lower && q[j] <= arm_.joints[j].upper;
    }
    if (!inside) {
      Angles other = question_.near;
      const double from_q = spatial::closest_pose(arm_, target, q);
      if (spatial::closest_pose(arm_, target, other) < from_q) q = other;
    }
    put(q, full);
    out.q.assign(full.begin(), full.end());
    measure(target, q, out);
    out.lost_direction = spatial::lost_direction(arm_, q);
  }

  static constexpr double kPi = std::numbers::pi;
  const Prepared& prepared_;
  const spatial::SerialArm& arm_;
  const IkBatch& batch_;
  bool turns_, switching_;
  Question question_;
  std::array<Candidates, kTogether> found_;
  Candidates* c_ = nullptr;  // of the target at hand
};

class SphericalWristIk final : public IkSolver, public IkBranches {
 public:
  using Interface = IkSolver;
  [[nodiscard]] const void* extension(const char* id) const override {
    const bool is_known = model_ && std::strcmp(id, IkBranches::kExtensionId) == 0;
    return is_known ? static_cast<const IkBranches*>(this) : nullptr;
  }
  [[nodiscard]] std::span<const IkBranchChoice> choices(std::int32_t tip) const override {
    const Prepared* of_tip = prepared_tip(tip);
    return of_tip ? branch_choices(of_tip->family) : std::span<const IkBranchChoice>();
  }
  void measure(std::int32_t tip, std::span<const double> q, std::span<double> out) const override {
    const Prepared* of_tip = prepared_tip(tip);
    if (!of_tip) return;
    const std::size_t n = model_->coordinate_count(), m = branch_choices(of_tip->family).size();
    for (std::size_t i = 0; (i + 1) * n <= q.size(); ++i) {
      Angles own;
      for (std::size_t k = 0; k < own.size(); ++k) own[k] = q[i * n + of_tip->index[k]];
      measure_branch(of_tip->family, own, out.subspan(i * m, m));
    }
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(spatial::check_ik_model(model));
    RMP_TRY_ASSIGN(tips_, spatial::recognise_tips(model, prepared));
    model_ = &model;
    turns_ = params.boolean("turns");
    switching_ = params.boolean("switching");
    return {};
  }

  Result<void> solve(const IkBatch& asked, std::span<IkResult> results,
                     Progress& progress) const override {
    if (!model_) return spatial::ik_not_prepared();
    RMP_TRY(spatial::check_ik_request(*model_, asked, results.size()));
    const spatial::NearTargets near(*model_, asked);
    const IkBatch& batch = near.batch();
    RMP_TRY_ASSIGN(const std::size_t tip, spatial::whole_pose_tip(batch));
    if (!batch.arm_angles.empty())
      return error(ErrorCode::unsupported, "a six-joint arm has no arm angle",
                   "Leave the arm angle out.");
    if (!tips_[tip]) return spatial::ik_unknown_arm(*model_, tip);
    Solver solver(*tips_[tip], batch, turns_, switching_);
    const std::size_t n = model_->coordinate_count();
    const std::size_t together = batch.continuous ? 1 : kTogether;
    std::vector<double> q(std::min(together, results.size()) * n);
    RMP_TRY(spatial::for_ik_samples(
        results.size(), together, progress, [&](std::size_t i, std::size_t count) {
          const bool onward = batch.continuous && i > 0;
          for (std::size_t k = 0; k < count && !onward; ++k)
            spatial::ik_start(*model_, batch, i + k, std::span(q).subspan(k * n, n));
          solver.solve(batch.targets.subspan(i, count), std::span(q).first(count * n), onward,
                       results.subspan(i, count));
        }));
    near.correct(results);
    return {};
  }

 private:
  [[nodiscard]] const Prepared* prepared_tip(std::int32_t tip) const {
    const auto i = static_cast<std::size_t>(tip);
    return tip >= 0 && i < tips_.size() && tips_[i] ? &*tips_[i] : nullptr;
  }
  const RobotModel* model_ = nullptr;
  std::vector<std::optional<Prepared>> tips_;
  bool turns_ = true, switching_ = false;
};

}  // namespace
}  // namespace robomosp::ik_spherical_wrist

RMP_PLUGIN("org.robomosp.ik_spherical_wrist", "0.1.0", "Apache-2.0",
           "Inverse kinematics of 6R arms in closed form.",
           RMP_PROVIDER(robomosp::ik_spherical_wrist::SphericalWristIk, "spherical_wrist",
                        "All solutions of 6R arms with a spherical wrist or three parallel axes.",
                        "serial,closed_form,all_solutions,branches,dof=6,batch",
                        robomosp::ik_spherical_wrist::kParams))
