// SPDX-License-Identifier: Apache-2.0
// Provider "srs" of robomosp.ik/1 (layer: plugin): 7R arms by branch and arm angle, the arm angle
// given, kept near the seed's or in the middle of what limits leave.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <string>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/ik_branches.h>
#include <robomosp/sdk/plugin.h>

#include "follow.h"
#include "spatial/ik_support.h"
#include "spatial/pose.h"
#include "spatial/print.h"
#include "spatial/rotation.h"
#include "srs_arm.h"

namespace robomosp::ik_srs {
namespace {

const rmp_param kParams[] = {
    {"turns", "bool", "",
     "If all solutions are requested, include those a full turn away that limits allow.", "true",
     nullptr, 0, 0},
    {"switching", "bool", "",
     "On a path, continue with another branch if joint limits end the present one; otherwise the "
     "path ends there.",
     "false", nullptr, 0, 0},
};

constexpr unsigned kBranches = 8;
/// Solutions closer to each other than this are one [rad].
constexpr double kSameSolution = 1e-7;
/// Below this sine of joints 2, 4 or 6 the arm may be singular.
constexpr double kMaybeSingular = 1e-5;
constexpr std::size_t kMostSolutions = 4096;
/// On a path the arm angle is kept while joints move less than this from sample to sample [rad], or
/// not this many times as far, squared, as they need to.
constexpr double kSlow = 0.02, kWorthIt = 9;

struct Answer {
  Angles q{};
  double cost = 0;  ///< squared distance from the seed [rad^2]
};

/// Everything of one call; nothing is shared between threads.
class Solver {
 public:
  Solver(const SrsArm& arm, const IkBatch& batch, bool turns, bool switching)
      : arm_(arm), joints_(arm.arm.joints), batch_(batch), turns_(turns), switching_(switching) {
    touch_ = 0.5 * std::min(batch.tolerance.position, 1e-3 * arm_.arm.length);
  }

  /// `full`: the configuration to stay near in, the first answer out. `given`: the arm angle to
  /// take. `middle`: take the middle of the widest span instead of the seed's arm angle.
  void solve(const Pose& target, std::span<double> full, const double* given, bool middle,
             bool onward, IkResult& out) {
    out = IkResult{};
    for (std::size_t i = 0; i < 7; ++i) near_[i] = full[joints_[i].q_index];
    const SrsTarget aim(arm_, target, near_);
    if (aim.gap() > touch_) return blame_reach(target, full, aim.gap(), out);
    wanted_ = given ? std::remainder(*given, kTurn) : arm_angle(arm_, near_);
    std::array<Answer, kBranches> found;
    std::size_t count = 0;
    for (unsigned branch = 0; branch < kBranches; ++branch) {
      Answer a;
      const bool ok = given    ? take(aim, branch, wanted_, a)
                      : middle ? take_middle(aim, branch, a)
                               : take_nearest(aim, branch, a);
      if (ok && !known(a, {found.data(), count})) found[count++] = a;
    }
    if (count == 0) return blame_limit(aim, target, full, given, out);
    if (onward && !given && !batch_.all_solutions) smooth(aim, found, count);
    std::stable_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count),
                     [](const Answer& a, const Answer& b) { return a.cost < b.cost; });
    if (onward && !switching_ && !given && leaves_branch(aim, found[0]))
      return blame_limit(aim, target, full, nullptr, out);
    put(found[0].q, full);
    out.status = IkStatus::solved;
    out.q.assign(full.begin(), full.end());
    if (batch_.all_solutions) add_all(full, {found.data(), count}, out);
    measure(target, found[0].q, out);
  }

  /// Goes on along a path from `full` with its branch and arm angle, as solve() would sample by
  /// sample, as far as that is clear without looking at other branches; returns how many samples.
  std::size_t follow(const FollowArm& numbers, std::span<const Pose> targets,
                     std::span<double> full, std::span<IkResult> results) {
    for (std::size_t i = 0; i < 7; ++i) near_[i] = full[joints_[i].q_index];
    ik_srs::follow(numbers, follow_branch(arm_, near_), targets, followed_);
    std::size_t done = 0;
    for (; done < targets.size(); ++done) {
      if (!(followed_.clear[done] > kClearOfBranches)) break;
      // |R - S|^2 of two rotations is 8 sin^2 of half the angle between them.
      const double rotation = 2 * std::asin(std::min(1.0, std::sqrt(followed_.square[done] / 8)));
      if (!(followed_.distance[done] <= batch_.tolerance.position) ||
          !(rotation <= batch_.tolerance.rotation))
        break;
      Answer a;
      std::copy_n(followed_.q + 7 * done, 7, a.q.begin());
      if (!turn(a) || a.cost >= kSlow * kSlow) break;
      near_ = a.q;
      put(a.q, full);
      IkResult& out = results[done] = IkResult{};
      out.status = IkStatus::solved;
      out.q.assign(full.begin(), full.end());
      out.position_error = followed_.distance[done];
      out.rotation_error = rotation;
    }
    return done;
  }

 private:
  void put(const Angles& q, std::span<double> full) const {
    for (std::size_t i = 0; i < 7; ++i) full[joints_[i].q_index] = q[i];
  }

  void measure(const Pose& target, const Angles& q, IkResult& out) const {
    const Pose tip = spatial::arm_tip(arm_.arm, q);
    out.position_error = spatial::distance(tip.p, target.p);
    out.rotation_error = spatial::norm(spatial::rotation_difference(tip.R, target.R));
    const bool stretched = std::fabs(std::sin(q[1] + arm_.first.bend)) < kMaybeSingular ||
                           std::fabs(std::sin(q[5] + arm_.last.bend)) < kMaybeSingular;
    const double reach =
        spatial::norm(spatial::sub(spatial::transform(tip, arm_.tip_wrist), arm_.shoulder));
    const bool straight = arm_.most - reach < kMaybeSingular * arm_.most;
    if (stretched || straight) out.lost_direction = spatial::lost_direction(arm_.arm, q);
  }

  // The branch at one arm angle, turned towards the seed; false outside the limits.
  bool take(const SrsTarget& aim, unsigned branch, double angle, Answer& a) const {
    a.q = aim.at(branch, angle);
    return turn(a);
  }

  // Whole turns towards the seed; false outside the limits.
  bool turn(Answer& a) const {
    a.cost = 0;
    for (std::size_t j = 0; j < 7; ++j) {
      a.q[j] = spatial::turn_within(joints_[j], a.q[j], near_[j]);
      if (a.q[j] < joints_[j].lower || a.q[j] > joints_[j].upper) return false;
      a.cost += (a.q[j] - near_[j]) * (a.q[j] - near_[j]);
    }
    return true;
  }

  bool take_middle(const SrsTarget& aim, unsigned branch, Answer& a) const {
    const auto spans = aim.feasible(branch);
    const Interval* widest = nullptr;
    for (const Interval& s : spans)
      if (!widest || s.to - s.from > widest->to - widest->from) widest = &s;
    if (!widest) return false;
    // Where nothing limits the arm angle, the elbow stays as it is at the seed.
    const bool free = widest->to - widest->from >= kTurn - 1e-9;
    return take(aim, branch, free ? wanted_ : 0.5 * (widest->from + widest->to), a);
  }

  // The arm angle nearest to the wanted one that the limits allow.
  bool take_nearest(const SrsTarget& aim, unsigned branch, Answer& a) const {
    if (take(aim, branch, wanted_, a)) return true;
    bool any = false;
    double least = std::numeric_limits<double>::infinity();
    for (const Interval& s : aim.feasible(branch)) {
      const double middle = 0.5 * (s.from + s.to), half = 0.5 * (s.to - s.from);
      const double off = std::remainder(wanted_ - middle, kTurn);
      const double outside = std::fabs(off) - half;
      if (outside >= least) continue;
      // At the end itself rounding may put a joint beyond its limit: then a little inside.
      for (const double inset : {0.0, 1e-12, 1e-9, 1e-6}) {
        const double reach = std::max(0.0, half - inset);
        Answer b;
        if (!take(aim, branch, middle + std::clamp(off, -reach, reach), b)) continue;
        a = b;
        least = outside;
        any = true;
        break;
      }
    }
    return any;
  }

  // Near where the arm points along axis 1, and near a stretched wrist, to keep the arm angle can
  // need fast joints: then the arm angle of least motion goes before.
  void smooth(const SrsTarget& aim, std::array<Answer, kBranches>& found,
              std::size_t& count) const {
    const auto nearer = [](const Answer& a, const Answer& b) { return a.cost < b.cost; };
    const Answer& kept = *std::min_element(
        found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), nearer);
    if (kept.cost < kSlow * kSlow) return;
    Answer best = kept;
    constexpr int kSamples = 48;
    for (unsigned branch = 0; branch < kBranches; ++branch) {
      double at = wanted_;
      Answer least;
      least.cost = std::numeric_limits<double>::infinity();
      const auto attempt = [&](double angle) {
        Answer a;
        if (!take(aim, branch, angle, a) || a.cost >= least.cost) return false;
        least = a;
        at = angle;
        return true;
      };
      for (int i = 0; i < kSamples; ++i) attempt(wanted_ + i * kTurn / kSamples);
      for (double step = kTurn / kSamples; step > 1e-9; step *= 0.5)
        if (!attempt(at + step)) attempt(at - step);
      if (least.cost < best.cost) best = least;
    }
    if (kWorthIt * best.cost >= kept.cost) return;
    found[0] = best;
    count = 1;
  }

  static bool known(const Answer& a, std::span<const Answer> found) {
    return std::any_of(found.begin(), found.end(), [&](const Answer& b) {
      double apart = 0;
      for (std::size_t j = 0; j < 7; ++j)
        apart = std::max(apart, std::fabs(std::remainder(a.q[j] - b.q[j], kTurn)));
      return apart < kSameSolution;
    });
  }

  // True when the branch so far, limits apart, is much nearer than the best within them.
  bool leaves_branch(const SrsTarget& aim, const Answer& best) const {
    for (unsigned branch = 0; branch < kBranches; ++branch) {
      Angles q = aim.at(branch, wanted_);
      double cost = 0;
      for (std::size_t j = 0; j < 7; ++j)
        cost += std::pow(std::remainder(q[j] - near_[j], kTurn), 2);
      // A limit may be followed by turning the elbow away: that is on the branch.
      Answer same;
      if (4 * cost < best.cost && !take_nearest(aim, branch, same)) return true;
    }
    return false;
  }

  void add_all(std::span<const double> full, std::span<const Answer> found, IkResult& out) const {
    const auto add = [&](std::span<const double> q) {
      const std::size_t at = out.q.size();
      out.q.insert(out.q.end(), full.begin(), full.end());
      for (std::size_t j = 0; j < 7; ++j) out.q[at + joints_[j].q_index] = q[j];
    };
    for (const Answer& a : found.subspan(1)) add(a.q);
    if (!turns_) return;
    for (const Answer& a : found)
      for (const auto& q : spatial::other_turns(arm_.arm, a.q, kMostSolutions / kBranches)) add(q);
  }

  void blame_reach(const Pose& target, std::span<double> full, double gap, IkResult& out) {
    out.status = IkStatus::out_of_reach;
    out.shortfall = gap;
    out.detail = "the target is out of reach by " + spatial::print_number(gap, 3) + " m";
    // The same orientation with the wrist moved along the line to the shoulder.
    Pose near = target;
    const Vec3 way = spatial::sub(spatial::transform(target, arm_.tip_wrist), arm_.shoulder);
    const double distance = spatial::norm(way);
    const Vec3 along = distance > 0 ? spatial::scale(way, 1 / distance) : joints_[0].axis;
    const double move = (distance > arm_.most ? arm_.most : arm_.least) - distance;
    near.p = spatial::add(target.p, spatial::scale(along, move));
    const SrsTarget aim(arm_, near, near_);
    wanted_ = arm_angle(arm_, near_);
    Answer best;
    bool any = false;
    for (unsigned branch = 0; branch < kBranches; ++branch) {
      Answer a;
      if (take_nearest(aim, branch, a) && (!any || a.cost < best.cost)) best = a, any = true;
    }
    if (!any) {
      for (std::size_t j = 0; j < 7; ++j)
        best.q[j] = spatial::turn_within(joints_[j], aim.at(0, wanted_)[j], near_[j]);
      closest(target, best.q);
    }
    put(best.q, full);
    out.q.assign(full.begin(), full.end());
    measure(target, best.q, out);
  }

  // No arm angle serves: names the joint that is least outside its limits, over all of them.
  void blame_limit(const SrsTarget& aim, const Pose& target, std::span<double> full,
                   const double* given, IkResult& out) {
    constexpr int kSteps = 72;
    Angles least{};
    double least_out = std::numeric_limits<double>::infinity();
    std::size_t worst = 0;
    for (unsigned branch = 0; branch < kBranches; ++branch)
      for (int i = 0; i < (given ? 1 : kSteps); ++i) {
        const Angles q = aim.at(branch, wanted_ + i * kTurn / kSteps);
        double most = -1;
        std::size_t joint = 0;
        for (std::size_t j = 0; j < 7; ++j) {
          const double by = spatial::turns_outside(joints_[j], q[j]);
          if (by > most) most = by, joint = j;
        }
        if (most < least_out) least_out = most, least = q, worst = joint;
      }
    Angles q;
    for (std::size_t j = 0; j < 7; ++j) q[j] = spatial::turn_within(joints_[j], least[j], near_[j]);
    out.status = IkStatus::joint_limit;
    out.limiting_joint = static_cast<std::int32_t>(joints_[worst].joint);
    out.detail = spatial::over_limit(joints_[worst], q[worst]);
    closest(target, q);
    put(q, full);
    out.q.assign(full.begin(), full.end());
    measure(target, q, out);
  }

  // The closest configuration within the limits, as found from q and from the seed.
  void closest(const Pose& target, Angles& q) const {
    Angles other = near_;
    const double from_q = spatial::closest_pose(arm_.arm, target, q);
    if (spatial::closest_pose(arm_.arm, target, other) < from_q) q = other;
  }

  const SrsArm& arm_;
  const std::vector<spatial::ArmJoint>& joints_;
  const IkBatch& batch_;
  bool turns_, switching_;
  double touch_ = 0, wanted_ = 0;
  Angles near_{};
  Followed followed_;
};

constexpr IkBranchChoice kChoices[] = {{"shoulder", "right", "left", {}},
                                       {"elbow", "up", "down", {}},
                                       {"wrist", "no flip", "flip", {}}};

class SrsIk final : public IkSolver, public IkBranches {
 public:
  using Interface = IkSolver;
  [[nodiscard]] const void* extension(const char* id) const override {
    const bool is_known = model_ && std::strcmp(id, IkBranches::kExtensionId) == 0;
    return is_known ? static_cast<const IkBranches*>(this) : nullptr;
  }
  [[nodiscard]] std::span<const IkBranchChoice> choices(std::int32_t tip) const override {
    const auto i = static_cast<std::size_t>(tip);
    const bool is_arm = tip >= 0 && i < tips_.size() && tips_[i];
    return is_arm ? std::span<const IkBranchChoice>(kChoices) : std::span<const IkBranchChoice>();
  }
  void measure(std::int32_t tip, std::span<const double> q, std::span<double> out) const override {
    if (choices(tip).empty()) return;
    const SrsArm& arm = *tips_[static_cast<std::size_t>(tip)];
    const std::size_t n = model_->coordinate_count();
    for (std::size_t i = 0; (i + 1) * n <= q.size(); ++i) {
      Angles own;
      for (std::size_t j = 0; j < 7; ++j) own[j] = q[i * n + arm.arm.joints[j].q_index];
      const std::array<double, 3> of_one = branch_measures(arm, own);
      std::copy(of_one.begin(), of_one.end(), out.begin() + static_cast<std::ptrdiff_t>(3 * i));
    }
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(spatial::check_ik_model(model));
    RMP_TRY_ASSIGN(tips_, spatial::recognise_tips(model, recognise));
    numbers_.clear();
    for (const auto& tip : tips_) numbers_.push_back(tip ? follow_arm(*tip) : FollowArm{});
    model_ = &model;
    turns_ = params.boolean("turns");
    switching_ = params.boolean("switching");
    return {};
  }

  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    if (!model_) return spatial::ik_not_prepared();
    RMP_TRY(spatial::check_ik_request(*model_, batch, results.size()));
    const spatial::NearTargets near(*model_, batch);
    RMP_TRY(solve_near(near.batch(), results, progress));
    near.correct(results);
    return {};
  }

 private:
  Result<void> solve_near(const IkBatch& batch, std::span<IkResult> results,
                          Progress& progress) const {
    // Away from limits is what the middle of the arm angle's span is.
    IkBatch plain = batch;
    if (batch.objective == IkObjective::limits) plain.objective = IkObjective::none;
    RMP_TRY_ASSIGN(const std::size_t tip, spatial::whole_pose_tip(plain));
    if (!tips_[tip]) return spatial::ik_unknown_arm(*model_, tip);
    Solver solver(*tips_[tip], batch, turns_, switching_);
    std::vector<double> q(model_->coordinate_count());
    const bool follows = batch.continuous && !batch.all_solutions && batch.arm_angles.empty() &&
                         batch.objective != IkObjective::limits;
    if (follows) return follow(batch, numbers_[tip], solver, q, results, progress);
    return spatial::for_ik_samples(results.size(), 1, progress, [&](std::size_t i, std::size_t) {
      const bool onward = batch.continuous && i > 0;
      if (!onward) spatial::ik_start(*model_, batch, i, q);
      const double* given = batch.arm_angles.empty()
                                ? nullptr
                                : &batch.arm_angles[batch.arm_angles.size() > 1 ? i : 0];
      const bool middle =
          batch.objective == IkObjective::limits || (batch.seeds.empty() && !onward);
      solver.solve(batch.targets[i], q, given, middle, onward, results[i]);
    });
  }

  /// A path: many samples side by side, and one by one where branches or limits are near.
  Result<void> follow(const IkBatch& batch, const FollowArm& numbers, Solver& solver,
                      std::span<double> q, std::span<IkResult> results, Progress& progress) const {
    constexpr std::size_t kFewAhead = 8;
    std::size_t ahead = kFewAhead, done = 0;
    const std::size_t samples = results.size();
    while (done < samples) {
      if (progress.cancelled()) return spatial::ik_stopped();
      progress.report(static_cast<double>(done) / static_cast<double>(samples),
                      "inverse kinematics");
      std::size_t more = 0;
      const std::size_t count = std::min(ahead, samples - done);
      if (done == 0) spatial::ik_start(*model_, batch, 0, q);
      else
        more = solver.follow(numbers, batch.targets.subspan(done, count), q,
                             results.subspan(done, count));
      ahead = more == count ? std::min(2 * ahead, kMostAhead) : kFewAhead;
      done += more;
      if (more == count) continue;
      const bool onward = done > 0;
      solver.solve(batch.targets[done], q, nullptr, batch.seeds.empty() && !onward, onward,
                   results[done]);
      ++done;
    }
    return {};
  }

  const RobotModel* model_ = nullptr;
  std::vector<std::optional<SrsArm>> tips_;
  std::vector<FollowArm> numbers_;  ///< of the tips
  bool turns_ = true, switching_ = false;
};

}  // namespace
}  // namespace robomosp::ik_srs

RMP_PLUGIN("org.robomosp.ik_srs", "0.1.0", "Apache-2.0",
           "Inverse kinematics of 7R arms with spherical shoulder and wrist in closed form.",
           RMP_PROVIDER(robomosp::ik_srs::SrsIk, "srs",
                        "All branches of 7R arms by arm angle, joint limits in closed form.",
                        "serial,redundant,closed_form,all_solutions,branches,dof=7,arm_angle,batch",
                        robomosp::ik_srs::kParams))
