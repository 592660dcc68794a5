// SPDX-License-Identifier: Apache-2.0
// Provider "numeric" of robomosp.ik/1 (layer: plugin): searches from the seed, then from repeatable
// random starts, and says in words why a target has no answer.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>

#include "chain.h"
#include "search.h"
#include "spatial/pose.h"
#include "spatial/print.h"
#include "spatial/rotation.h"

namespace robomosp::ik_numeric {
namespace {

const rmp_param kParams[] = {
    {"max_iterations", "int", "", "Greatest number of steps of one search.", "100", nullptr, 1,
     100000},
    {"restarts", "int", "", "Random starts after the seed has led nowhere.", "100", nullptr, 0,
     100000},
    {"damping", "real", "",
     "Damping per squared error; larger is more cautious far from the target.", "0.01", nullptr,
     1e-9, 1e3},
    {"seed", "int", "", "Start of the random numbers; the same seed gives the same answers.", "1",
     nullptr, 0, 4294967295.0},
};

constexpr double kTurn = 2 * std::numbers::pi;

/// SplitMix64 (Steele, Lea, Flood 2014): the same numbers on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform(double low, double high) {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    z ^= z >> 31;
    return low + (high - low) * (static_cast<double>(z >> 11) * 0x1.0p-53);
  }

 private:
  std::uint64_t state_;
};

// Where searches may start: the limits, or one turn or chain length where there is none.
double start_bound(const PathJoint& joint, bool upper) {
  const double limit = upper ? joint.upper : joint.lower;
  if (std::isfinite(limit)) return limit;
  const double half = joint.type == JointType::revolute ? std::numbers::pi : joint.unit;
  const double other = upper ? joint.lower : joint.upper;
  const double centre = std::isfinite(other) ? other + (upper ? half : -half) : 0.0;
  return centre + (upper ? half : -half);
}

// The same turn of a revolute joint that is within the limits and nearest to `near`.
double nearest_turn(const PathJoint& joint, double q, double near) {
  if (joint.type != JointType::revolute) return q;
  double x = q + kTurn * std::round((near - q) / kTurn);
  if (x > joint.upper) x -= kTurn * std::ceil((x - joint.upper) / kTurn);
  if (x < joint.lower) x += kTurn * std::ceil((joint.lower - x) / kTurn);
  return x >= joint.lower && x <= joint.upper ? x : q;
}

double outside(const PathJoint& joint, double q) {
  return std::max({0.0, joint.lower - q, q - joint.upper});
}

/// Everything one solve call works with; nothing is shared between threads.
class Solver {
 public:
  Solver(const RobotModel& model, const Chain& chain, const SearchOptions& options, int restarts,
         std::uint64_t seed, const IkTolerance& tolerance, const Progress& progress)
      : model_(model),
        chain_(chain),
        options_(options),
        restarts_(restarts),
        seed_(seed),
        tolerance_(tolerance),
        progress_(progress),
        work_(chain.size()),
        q_(chain.size()),
        from_(chain.size()),
        best_(chain.size()) {}

  [[nodiscard]] bool cancelled() const { return cancelled_; }

  /// Solves for one target; `full` has one value a joint: the seed in, the first answer out.
  void solve(const Pose& target, std::span<double> full, bool all, IkResult& out) {
    begin(full, out);
    const int restarts =
        certain_gap(chain_, target.p) > tolerance_.position ? std::min(restarts_, 3) : restarts_;
    Random random(seed_);
    std::vector<std::vector<double>> found;
    for (int i = 0, idle = 0; idle <= restarts && !cancelled_; ++i, ++idle) {
      if (i > 0) random_start(random);
      if (attempt(target, options_, out)) {
        unwind(from_);
        if (!all) return finish(target, full, q_, out);
        if (remember(found)) idle = 0;
        if (found.size() >= kMostSolutions) break;
      }
    }
    if (cancelled_) return;
    if (found.empty()) return explain(target, full, out);
    finish_all(target, full, found, out);
  }

  /// Solves for the next sample of a path, from the sample before and on its branch.
  void follow(const Pose& target, std::span<double> full, IkResult& out) {
    begin(full, out);
    SearchOptions careful = options_;
    careful.max_step = 0.25;
    if (attempt(target, careful, out) || (!cancelled_ && approach(target, careful, out)))
      return finish(target, full, q_, out);
    if (!cancelled_) explain(target, full, out);
  }

 private:
  static constexpr std::size_t kMostSolutions = 64;
  static constexpr int kApproachSteps = 16;

  void begin(std::span<const double> full, IkResult& out) {
    out = IkResult{};
    for (std::size_t i = 0; i < chain_.size(); ++i) q_[i] = full[chain_.joints[i].index];
    from_ = q_;
    best_ = q_;
    best_end_ = SearchResult{};
    best_end_.cost = std::numeric_limits<double>::infinity();
    ended_early_ = false;
  }

  void random_start(Random& random) {
    for (std::size_t i = 0; i < chain_.size(); ++i)
      q_[i] =
          random.uniform(start_bound(chain_.joints[i], false), start_bound(chain_.joints[i], true));
  }

  // One search from q_; keeps the closest ending.
  bool attempt(const Pose& target, const SearchOptions& options, IkResult& out) {
    const SearchResult r = search(chain_, target, tolerance_, options, q_, work_, progress_);
    out.iterations += r.iterations;
    cancelled_ |= r.end == SearchEnd::cancelled || progress_.cancelled();
    ended_early_ |= r.end == SearchEnd::out_of_iterations;
    if (r.cost < best_end_.cost) best_end_ = r, best_ = q_;
    return r.end == SearchEnd::reached;
  }

  // Walks to a target that lies far from the sample before it, in small steps along the straight
  // way.
  bool approach(const Pose& target, const SearchOptions& options, IkResult& out) {
    q_ = from_;
    const Pose start = forward(chain_, q_, work_.frames);
    const Vec3 turn = spatial::rotation_difference(start.R, target.R);
    const Vec3 way = spatial::sub(target.p, start.p);
    for (int i = 1; i <= kApproachSteps; ++i) {
      const double s = static_cast<double>(i) / kApproachSteps;
      Pose between;
      between.p = spatial::add(start.p, spatial::scale(way, s));
      Pose turned, from_R;
      turned.R = spatial::rotation_exp(spatial::scale(turn, s));
      from_R.R = start.R;
      between.R = spatial::compose(turned, from_R).R;
      const SearchResult r = search(chain_, i == kApproachSteps ? target : between, tolerance_,
                                    options, q_, work_, progress_);
      out.iterations += r.iterations;
      cancelled_ |= r.end == SearchEnd::cancelled;
      if (r.end != SearchEnd::reached) return false;
    }
    return true;
  }

  void unwind(std::span<const double> near) {
    for (std::size_t i = 0; i < chain_.size(); ++i)
      q_[i] = nearest_turn(chain_.joints[i], q_[i], near[i]);
  }

  bool remember(std::vector<std::vector<double>>& found) const {
    for (const auto& other : found) {
      double apart = 0;
      for (std::size_t i = 0; i < chain_.size(); ++i) {
        const PathJoint& joint = chain_.joints[i];
        double d = q_[i] - other[i];
        if (joint.type == JointType::revolute) d -= kTurn * std::round(d / kTurn);
        apart = std::max(apart, std::fabs(d) / joint.unit);
      }
      if (apart < 1e-4) return false;
    }
    found.push_back(q_);
    return true;
  }

  [[nodiscard]] double distance_from_seed(std::span<const double> q) const {
    double d = 0;
    for (std::size_t i = 0; i < chain_.size(); ++i) {
      const double x = (q[i] - from_[i]) / chain_.joints[i].unit;
      d += x * x;
    }
    return d;
  }

  void finish_all(const Pose& target, std::span<double> full,
                  std::vector<std::vector<double>>& found, IkResult& out) {
    std::stable_sort(found.begin(), found.end(), [&](const auto& a, const auto& b) {
      return distance_from_seed(a) < distance_from_seed(b);
    });
    for (std::size_t k = found.size(); k-- > 1;) {
      put(found[k], full);
      out.q.insert(out.q.begin(), full.begin(), full.end());
    }
    std::vector<double> others = std::move(out.q);
    finish(target, full, found[0], out);
    out.q.insert(out.q.end(), others.begin(), others.end());
  }

  void put(std::span<const double> q, std::span<double> full) const {
    for (std::size_t i = 0; i < chain_.size(); ++i) full[chain_.joints[i].index] = q[i];
  }

  void finish(const Pose& target, std::span<double> full, std::span<const double> q,
              IkResult& out) {
    put(q, full);
    out.q.assign(full.begin(), full.end());
    measure(target, q, out);
    out.status = IkStatus::solved;
  }

  void measure(const Pose& target, std::span<const double> q, IkResult& out) {
    const Pose tip = forward(chain_, q, work_.frames);
    out.position_error = spatial::distance(tip.p, target.p);
    out.rotation_error = spatial::norm(spatial::rotation_difference(tip.R, target.R));
  }

  // No search has reached the target: finds out whether limits, distance or orientation forbid it.
  void explain(const Pose& target, std::span<double> full, IkResult& out) {
    const std::vector<double> closest = best_;
    if (certain_gap(chain_, target.p) <= tolerance_.position &&
        solve_without_limits(target, closest, out)) {
      if (out.detail.empty()) return finish(target, full, q_, out);
      out.status = IkStatus::joint_limit;
    } else if (!cancelled_) {
      blame_reach(target, closest, out);
    }
    put(closest, full);
    out.q.assign(full.begin(), full.end());
    measure(target, closest, out);
  }

  // True when the pose can be reached without limits. Then either q_ is within them after all and
  // `detail` stays empty, or `detail` names the joint that would have to go farthest out.
  bool solve_without_limits(const Pose& target, std::span<const double> closest, IkResult& out) {
    SearchOptions free = options_;
    free.use_limits = false;
    Random random(seed_ + 1);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 8 && !cancelled_; ++i) {
      if (i == 0) q_.assign(closest.begin(), closest.end());
      else random_start(random);
      const SearchResult r = search(chain_, target, tolerance_, free, q_, work_, progress_);
      out.iterations += r.iterations;
      cancelled_ |= r.end == SearchEnd::cancelled;
      if (r.end != SearchEnd::reached) continue;
      const std::size_t worst = bring_near_limits();
      if (chain_.size() == 0 || outside(chain_.joints[worst], q_[worst]) == 0) {
        out.detail.clear();
        return true;
      }
      const double by = outside(chain_.joints[worst], q_[worst]) / chain_.joints[worst].unit;
      if (by < least) least = by, out.detail = over_limit(worst);
    }
    return !out.detail.empty();
  }

  // Chooses the turn of every joint that is least outside its limits; returns the worst joint.
  std::size_t bring_near_limits() {
    std::size_t worst = 0;
    for (std::size_t i = 0; i < chain_.size(); ++i) {
      const PathJoint& joint = chain_.joints[i];
      if (joint.type == JointType::revolute && outside(joint, q_[i]) > 0) {
        const double low = std::isfinite(joint.lower) ? joint.lower : joint.upper - kTurn;
        const double high = std::isfinite(joint.upper) ? joint.upper : joint.lower + kTurn;
        q_[i] = nearest_turn(
            joint, q_[i] + kTurn * std::round((0.5 * (low + high) - q_[i]) / kTurn), from_[i]);
      }
      if (outside(joint, q_[i]) / joint.unit >
          outside(chain_.joints[worst], q_[worst]) / chain_.joints[worst].unit)
        worst = i;
    }
    return worst;
  }

  [[nodiscard]] std::string over_limit(std::size_t i) const {
    const PathJoint& joint = chain_.joints[i];
    return "joint " + std::to_string(joint.index + 1) + " (\"" + model_.joints[joint.index].name +
           "\") would need " + spatial::print_joint_value(q_[i], joint.type) + "; its limit is " +
           spatial::print_joint_value(q_[i] > joint.upper ? joint.upper : joint.lower, joint.type);
  }

  void blame_reach(const Pose& target, std::span<const double> closest, IkResult& out) {
    SearchOptions place = options_;
    place.position_only = true;
    double gap = std::numeric_limits<double>::infinity();
    Random random(seed_ + 2);
    for (int i = 0; i < 4 && gap > tolerance_.position && !cancelled_; ++i) {
      if (i == 0) q_.assign(closest.begin(), closest.end());
      else random_start(random);
      const SearchResult r = search(chain_, target, tolerance_, place, q_, work_, progress_);
      cancelled_ |= r.end == SearchEnd::cancelled;
      gap = std::min(gap, r.position_error);
    }
    const std::string left =
        spatial::print_number(best_end_.position_error, 3) + " m and " +
        spatial::print_joint_value(best_end_.rotation_error, JointType::revolute, 3);
    if (gap > tolerance_.position) {
      out.status = IkStatus::out_of_reach;
      out.detail = "the target is " + spatial::print_number(gap, 3) + " m out of reach";
    } else if (!ended_early_) {
      out.status = IkStatus::out_of_reach;
      out.detail =
          "the position can be reached, but not with this orientation; the closest pose found is "
          "off by " +
          left;
    } else {
      out.status = IkStatus::not_converged;
      out.detail = "the search ended with " + left +
                   " left; raise max_iterations or restarts, or give a seed nearby";
    }
  }

  const RobotModel& model_;
  const Chain& chain_;
  SearchOptions options_;
  int restarts_;
  std::uint64_t seed_;
  IkTolerance tolerance_;
  const Progress& progress_;
  Workspace work_;
  std::vector<double> q_, from_, best_;
  SearchResult best_end_;
  bool cancelled_ = false, ended_early_ = false;
};

Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

class NumericIk final : public IkSolver {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    const std::string where = "robot \"" + model.name + "\"";
    if (model.joints.empty()) return bad("it has no joints to solve for", "Add a joint.").in(where);
    if (model.tips.empty()) return bad("it has no tip to place", "Add a tool.").in(where);
    for (const JointModel& joint : model.joints)
      if (!(joint.lower <= joint.upper) || !spatial::is_rigid(joint.placement))
        return bad("its limits or its placement are not usable numbers",
                   "Correct the robot's table.")
            .in("joint \"" + joint.name + "\"")
            .in(where);
    if (!model.is_simple())
      return error(ErrorCode::unsupported,
                   "it has coupled, spherical or free joints, which this provider does not know",
                   "Choose another provider.", "robot \"" + model.name + "\"");
    model_ = &model;
    chains_.clear();
    for (std::size_t i = 0; i < model.tips.size(); ++i) chains_.push_back(make_chain(model, i));
    options_ = {};
    options_.max_iterations = static_cast<int>(params.integer("max_iterations"));
    options_.damping = params.real("damping");
    restarts_ = static_cast<int>(params.integer("restarts"));
    seed_ = static_cast<std::uint64_t>(params.integer("seed"));
    return {};
  }

  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    RMP_TRY(check(batch, results.size()));
    if (!batch.goals.empty() || batch.objective != IkObjective::none)
      return error(ErrorCode::unsupported, "this provider takes one whole pose and no objective",
                   "Choose another provider.");
    const std::size_t n = model_->dof();
    Solver solver(*model_, chains_[static_cast<std::size_t>(batch.tip)], options_, restarts_, seed_,
                  batch.tolerance, progress);
    std::vector<double> q(n);
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (progress.cancelled()) return stopped();
      if (i % 64 == 0)
        progress.report(static_cast<double>(i) / static_cast<double>(results.size()),
                        "inverse kinematics");
      if (batch.continuous && i > 0) {
        solver.follow(batch.targets[i], q, results[i]);
      } else {
        start(batch, i, q);
        solver.solve(batch.targets[i], q, batch.all_solutions, results[i]);
      }
      if (solver.cancelled()) return stopped();
    }
    return {};
  }

 private:
  static Error stopped() {
    return error(ErrorCode::cancelled, "the inverse kinematics were stopped");
  }

  [[nodiscard]] Result<void> check(const IkBatch& batch, std::size_t results) const {
    if (!model_) return bad("the solver was not given a robot", "Call prepare first.");
    const std::size_t n = model_->dof(), count = batch.targets.size();
    if (results != count)
      return bad(std::to_string(results) + " results for " + std::to_string(count) + " targets",
                 "Give one result a target.");
    if (!batch.seeds.empty() && batch.seeds.size() != n && batch.seeds.size() != n * count)
      return bad("the seeds have " + std::to_string(batch.seeds.size()) + " values for " +
                     std::to_string(count) + " targets and " + std::to_string(n) + " joints",
                 "Give " + std::to_string(n) + " for all targets, " + std::to_string(n * count) +
                     ", or none.");
    if (batch.tip < 0 || static_cast<std::size_t>(batch.tip) >= chains_.size())
      return bad("there is no tip " + std::to_string(batch.tip),
                 "The robot has tips 0 to " + std::to_string(chains_.size() - 1) + ".");
    if (!(batch.tolerance.position > 0) || !(batch.tolerance.rotation > 0))
      return bad("a tolerance is not positive", "Give lengths and angles above 0, such as 1e-9.");
    for (std::size_t i = 0; i < count; ++i)
      if (!spatial::is_rigid(batch.targets[i], 1e-6))
        return bad("target " + std::to_string(i + 1) + " is not a pose",
                   "Its rotation must be orthonormal and all its numbers finite.");
    for (std::size_t i = 0; i < batch.seeds.size(); ++i)
      if (!std::isfinite(batch.seeds[i]))
        return bad("value " + std::to_string(i + 1) + " of the seeds is not finite",
                   "Correct the seed.");
    return {};
  }

  // The seed within the limits; without one the middle of the limits.
  void start(const IkBatch& batch, std::size_t sample, std::span<double> q) const {
    const std::size_t n = q.size();
    const double* seed = batch.seeds.empty()
                             ? nullptr
                             : batch.seeds.data() + (batch.seeds.size() == n ? 0 : sample * n);
    for (std::size_t j = 0; j < n; ++j) {
      const JointModel& joint = model_->joints[j];
      const bool bounded = std::isfinite(joint.lower) && std::isfinite(joint.upper);
      const double middle = bounded ? 0.5 * (joint.lower + joint.upper) : 0.0;
      q[j] = std::clamp(seed ? seed[j] : middle, joint.lower, joint.upper);
    }
  }

  const RobotModel* model_ = nullptr;
  std::vector<Chain> chains_;
  SearchOptions options_;
  int restarts_ = 0;
  std::uint64_t seed_ = 1;
};

}  // namespace
}  // namespace robomosp::ik_numeric

RMP_PLUGIN(
    "org.robomosp.ik_numeric", "0.1.0", "Apache-2.0",
    "Inverse kinematics of any chain by a damped search.",
    RMP_PROVIDER(robomosp::ik_numeric::NumericIk, "numeric",
                 "Levenberg-Marquardt search within joint limits, for every tip of any robot.",
                 "serial,tree,redundant,batch", robomosp::ik_numeric::kParams))
