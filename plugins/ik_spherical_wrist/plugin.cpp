// SPDX-License-Identifier: Apache-2.0
// Provider "spherical_wrist" of robomosp.ik/1 (layer: plugin): all configurations of 6R arms by
// formulas, the choice among them, and what to say of targets without one.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>

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
     "When all solutions are asked, also those a whole turn away that limits allow.", "true",
     nullptr, 0, 0},
    {"switching", "bool", "",
     "On a path, go on with another configuration where a joint limit ends the one so far; "
     "otherwise the path ends there.",
     "false", nullptr, 0, 0},
};

/// Branches may have met, and the arm may be singular, below this margin (Candidates::margin).
constexpr double kMeeting = 1e-6;
/// Solutions closer to each other than this are one [rad].
constexpr double kSameSolution = 1e-7;
constexpr std::size_t kMostSolutions = 4096;
constexpr std::size_t kReportEvery = 16;

using Angles = std::array<double, 6>;

/// One tip, made ready.
struct Prepared {
  Family family;
  Question question;  ///< with limits
  LaneSolver lanes;

  void candidates(const Question& q, Candidates& out) const {
    if (family.form == Form::general) solve_general(family, q, out);
    else lanes.solve(family.lanes, q, out);
  }
};

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

  /// `full`: the configuration to stay near in, the first answer out. `onward`: the sample before
  /// it on a path is in `full`.
  void solve(const Pose& target, std::span<double> full, bool onward, IkResult& out) {
    begin(target, full, out);
    prepared_.candidates(question_, c_);
    std::size_t best = choose(true);
    if (best == kBranches && wrist_is_free()) best = vary_kept_joint();
    if (best == kBranches) return explain(target, full, out);
    if (onward && !switching_) {
      const std::size_t any = choose(false);
      if (any != best && c_.outside[any] > 0 && 4 * c_.cost[any] < c_.cost[best])
        return blame_limit(target, full, any, out);
    }
    const Angles q = lane(c_, best);
    put(q, full);
    const bool meets = c_.margin[best] < kMeeting;
    if (!batch_.all_solutions) out.q.assign(full.begin(), full.end());
    else collect(full, out);
    out.status = IkStatus::solved;
    measure(target, q, out);
    if (meets) out.lost_direction = spatial::lost_direction(arm_, q);
  }

 private:
  void begin(const Pose& target, std::span<const double> full, IkResult& out) {
    out.status = IkStatus::not_converged;
    out.q.clear();  // keeps its memory
    out.detail.clear();
    out.iterations = 0;
    out.shortfall = 0;
    out.limiting_joint = -1;
    out.lost_direction = {};
    question_.R = target.R;
    question_.wrist = spatial::transform(target, prepared_.family.tip_wrist);
    for (std::size_t i = 0; i < 6; ++i) question_.near[i] = full[arm_.joints[i].q_index];
  }

  void put(const Angles& q, std::span<double> full) const {
    for (std::size_t i = 0; i < 6; ++i) full[arm_.joints[i].q_index] = q[i];
  }

  void measure(const Pose& target, const Angles& q, IkResult& out) const {
    alignas(64) std::array<double, 8> angles{}, sine, cosine;
    std::copy(q.begin(), q.end(), angles.begin());
    prepared_.lanes.sines_cosines(angles.data(), sine.data(), cosine.data());
    Pose tip;
    for (std::size_t j = 0; j < 6; ++j) {
      Pose turned = arm_.joints[j].placement;
      for (std::size_t r = 0; r < 9; r += 3) {
        const double x = turned.R[r], y = turned.R[r + 1];
        turned.R[r] = x * cosine[j] + y * sine[j];
        turned.R[r + 1] = y * cosine[j] - x * sine[j];
      }
      tip = j == 0 ? turned : spatial::compose(tip, turned);
    }
    tip = spatial::compose(tip, arm_.tool);
    out.position_error = spatial::distance(tip.p, target.p);
    // Small turns by the difference of the matrices, which is 2 sqrt(2) sin(angle / 2) long.
    double square = 0;
    for (std::size_t k = 0; k < 9; ++k)
      square += (tip.R[k] - target.R[k]) * (tip.R[k] - target.R[k]);
    out.rotation_error = square < 1e-8
                             ? std::sqrt(0.5 * square)
                             : spatial::norm(spatial::rotation_difference(tip.R, target.R));
  }

  /// The lane nearest to the seed that reaches the target; kBranches = none.
  [[nodiscard]] std::size_t choose(bool within_limits) const {
    std::size_t best = kBranches;
    for (std::size_t i = 0; i < kBranches; ++i)
      if (c_.gap[i] == 0 && (!within_limits || c_.outside[i] == 0) &&
          (best == kBranches || c_.cost[i] < c_.cost[best]))
        best = i;
    return best;
  }

  [[nodiscard]] bool wrist_is_free() const {
    return std::any_of(c_.margin.begin(), c_.margin.end(), [](double m) { return m < 1e-10; });
  }

  /// At a singular wrist one joint is kept where it is; if that does not fit the limits, other
  /// places of it are tried, the nearest first.
  std::size_t vary_kept_joint() {
    constexpr int kPlaces = 24;
    const std::size_t kept = prepared_.family.form == Form::three_parallel ? 5 : 3;
    const double near = question_.near[kept], low = std::max(question_.lower[kept], near - 2 * kPi),
                 high = std::min(question_.upper[kept], near + 2 * kPi);
    const Candidates first = c_;
    for (int i = 1; i <= 2 * kPlaces; ++i) {
      const double share = ((i + 1) / 2) / static_cast<double>(kPlaces);
      question_.near[kept] = near + share * (i % 2 ? high - near : low - near);
      prepared_.candidates(question_, c_);
      if (const std::size_t best = choose(true); best != kBranches) return best;
    }
    question_.near[kept] = near;
    c_ = first;
    return kBranches;
  }

  /// All lanes within the limits, those nearest to the seed first, then whole turns.
  void collect(std::span<double> full, IkResult& out) {
    std::array<std::size_t, kBranches> order;
    std::size_t count = 0;
    for (std::size_t i = 0; i < kBranches; ++i) {
      if (c_.gap[i] != 0 || c_.outside[i] != 0 || known(i, order, count)) continue;
      std::size_t at = count++;
      for (; at > 0 && c_.cost[order[at - 1]] > c_.cost[i]; --at) order[at] = order[at - 1];
      order[at] = i;
    }
    const std::size_t n = full.size();
    out.q.resize(count * n);
    double* to = out.q.data();
    for (std::size_t k = 0; k < count; ++k, to += n) {
      std::copy(full.begin(), full.end(), to);
      for (std::size_t j = 0; j < 6; ++j) to[arm_.joints[j].q_index] = c_.q[j][order[k]];
    }
    if (turns_ && may_turn()) add_turns(full, {order.data(), count}, out);
  }

  [[nodiscard]] bool known(std::size_t i, const std::array<std::size_t, kBranches>& order,
                           std::size_t count) const {
    if (c_.margin[i] >= kMeeting) return false;
    for (std::size_t k = 0; k < count; ++k) {
      double apart = 0;
      for (const auto& q : c_.q)
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
      for (auto& q : spatial::other_turns(arm_, lane(c_, i), kMostSolutions / kBranches)) {
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
      if (c_.gap[i] == 0 && (least == kBranches || c_.outside[i] < c_.outside[least])) least = i;
    if (least != kBranches) return blame_limit(target, full, least, out);
    blame_reach(target, full, out);
  }

  /// A limit ends branch i.
  void blame_limit(const Pose& target, std::span<double> full, std::size_t i, IkResult& out) {
    Angles q = lane(c_, i);
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
                     [&](std::size_t a, std::size_t b) { return c_.gap[a] < c_.gap[b]; });
    Angles best = question_.near;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < kBranches && std::isfinite(c_.gap[order[k]]); ++k) {
      if (k >= 4) break;
      if (k % 2 == 1 && prepared_.family.form != Form::three_parallel) continue;  // same arm
      Angles q = lane(c_, order[k]);
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
  Candidates c_;
};

class SphericalWristIk final : public IkSolver {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(spatial::check_ik_model(model));
    const std::string where = "robot \"" + model.name + "\"";
    model_ = &model;
    tips_.clear();
    std::optional<Error> refusal;
    bool any = false;
    for (std::size_t i = 0; i < model.tips.size(); ++i) {
      auto family = recognise(model, i);
      if (!family.ok()) {
        if (!refusal) refusal = std::move(family).error().in(where);
        tips_.emplace_back();
        continue;
      }
      any = true;
      Prepared p{std::move(*family), {}, lane_solver()};
      for (std::size_t j = 0; j < 6; ++j) {
        p.question.lower[j] = p.family.arm.joints[j].lower;
        p.question.upper[j] = p.family.arm.joints[j].upper;
      }
      tips_.emplace_back(std::move(p));
    }
    if (!any) return *refusal;
    turns_ = params.boolean("turns");
    switching_ = params.boolean("switching");
    return {};
  }

  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    if (!model_)
      return error(ErrorCode::invalid_argument, "the solver was not given a robot",
                   "Call prepare first.");
    RMP_TRY(spatial::check_ik_request(*model_, batch, results.size()));
    RMP_TRY_ASSIGN(const std::size_t tip, spatial::whole_pose_tip(batch));
    if (!batch.arm_angles.empty())
      return error(ErrorCode::unsupported, "an arm of six joints has no arm angle",
                   "Leave the arm angle out.");
    if (!tips_[tip])
      return error(ErrorCode::unsupported,
                   "the tip \"" + model_->tips[tip].name + "\" is not that of an arm it can solve",
                   "Choose another provider, such as numeric.");
    Solver solver(*tips_[tip], batch, turns_, switching_);
    std::vector<double> q(model_->coordinate_count());
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (i % kReportEvery == 0) {
        if (progress.cancelled())
          return error(ErrorCode::cancelled, "the inverse kinematics were stopped");
        progress.report(static_cast<double>(i) / static_cast<double>(results.size()),
                        "inverse kinematics");
      }
      const bool onward = batch.continuous && i > 0;
      if (!onward) spatial::ik_start(*model_, batch, i, q);
      solver.solve(batch.targets[i], q, onward, results[i]);
    }
    return {};
  }

 private:
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
                        "serial,closed_form,all_solutions,batch",
                        robomosp::ik_spherical_wrist::kParams))
