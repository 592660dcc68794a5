// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "solver.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::ik_numeric {
namespace {

constexpr int kApproachSteps = 16;
constexpr std::size_t kBlock = 64;
constexpr int kAllFactor = 4;

}  // namespace

FastSolver::FastSolver(const Mechanism& m, const Chain& chain, const StartTable& table,
                       std::size_t tip, const SolverOptions& options, Progress& progress)
    : mechanism_(m),
      chain_(chain),
      table_(table),
      options_(options),
      progress_(progress),
      path_(chain.size()),
      frames_(chain.size()) {
  goal_.tip = static_cast<std::int32_t>(tip);
}

LaneOptions FastSolver::lanes() const {
  LaneOptions o;
  o.max_iterations = options_.max_iterations;
  o.damping = options_.damping;
  o.position = options_.tolerance.position;
  o.rotation = 2 * std::sin(std::min(options_.tolerance.rotation, std::numbers::pi) / 2);
  return o;
}

double FastSolver::gap(const Pose& target) const { return certain_gap(chain_, target.p); }

void FastSolver::solve(std::span<const Pose> targets, std::span<const double> seeds,
                       std::span<IkResult> out) {
  const std::size_t n = chain_.size(), dof = mechanism_.velocities.size();
  path_.resize(targets.size() * n);
  restarts_.resize(targets.size());
  attempted_.resize(targets.size());
  for (std::size_t i = 0; i < targets.size(); ++i) {
    for (std::size_t j = 0; j < n; ++j) path_[i * n + j] = seeds[i * dof + chain_.joints[j].index];
    restarts_[i] = gap(targets[i]) > options_.tolerance.position ? std::min(options_.restarts, 3)
                                                                 : options_.restarts;
  }
  const AttemptOptions options{lanes(), options_.seed, true};
  if (!ik_numeric::attempt(chain_, table_, options, targets, path_, restarts_, attempted_,
                           progress_)) {
    cancelled_ = true;
    return;
  }
  for (std::size_t i = 0; i < targets.size() && !cancelled_; ++i) {
    const auto seed = seeds.subspan(i * dof, dof);
    out[i] = IkResult{};
    out[i].iterations = attempted_[i].iterations;
    if (attempted_[i].reached) finish(targets[i], attempted_[i].q, seed, out[i]);
    else fail(targets[i], attempted_[i], seed, out[i]);
  }
}

void FastSolver::finish(const Pose& target, std::span<const double> path,
                        std::span<const double> seed, IkResult& out) {
  out.q.assign(seed.begin(), seed.end());
  for (std::size_t j = 0; j < chain_.size(); ++j) out.q[chain_.joints[j].index] = path[j];
  unwind(mechanism_, seed, out.q);
  out.status = IkStatus::solved;
  measure(target, out);
}

void FastSolver::measure(const Pose& target, IkResult& out) {
  std::vector<double>& q = path_;
  q.resize(std::max(q.size(), chain_.size()));
  for (std::size_t j = 0; j < chain_.size(); ++j) q[j] = out.q[chain_.joints[j].index];
  const Pose tip = forward(chain_, {q.data(), chain_.size()}, frames_);
  out.position_error = spatial::distance(tip.p, target.p);
  out.rotation_error = spatial::norm(spatial::rotation_difference(tip.R, target.R));
}

void FastSolver::fail(const Pose& target, const Attempted& a, std::span<const double> seed,
                      IkResult& out) {
  std::vector<double> q(seed.begin(), seed.end());
  for (std::size_t j = 0; j < chain_.size(); ++j) q[chain_.joints[j].index] = a.q[j];
  const Failure failure{mechanism_,    {&goal_, 1}, {&target, 1}, options_.search(),
                        options_.seed, gap(target), a.ended_early};
  const bool found = explain(failure, q, out, progress_);
  cancelled_ |= progress_.cancelled();
  out.q = std::move(q);
  if (found) out.status = IkStatus::solved;
  measure(target, out);
}

void FastSolver::solve_all(const Pose& target, std::span<const double> seed, IkResult& out) {
  const std::size_t n = chain_.size();
  std::vector<double> from(n);
  for (std::size_t j = 0; j < n; ++j) from[j] = seed[chain_.joints[j].index];
  const bool far = gap(target) > options_.tolerance.position;
  // Some postures are seldom met: here restarts count several times.
  const int most_idle = far ? std::min(options_.restarts, 3) : kAllFactor * options_.restarts;
  std::vector<std::vector<double>> found;
  Attempted closest;
  closest.cost = std::numeric_limits<double>::infinity();
  AttemptOptions options{lanes(), options_.seed, true};
  options.lanes.patience = 20;
  // The searches are targets of their own here: the same one from many starts.
  const std::vector<Pose> copies(kBlock, target);
  restarts_.assign(kBlock, 0);
  attempted_.resize(kBlock);
  std::vector<double> starts(kBlock * n);
  out = IkResult{};
  int idle = 0;
  for (std::size_t block = 0; idle <= most_idle && found.size() < kMostSolutions; ++block) {
    for (std::size_t i = 0; i < kBlock; ++i) {
      double* q = starts.data() + i * n;
      if (block == 0 && i == 0) std::copy(from.begin(), from.end(), q);
      else if (const std::size_t k = block * kBlock + i; k <= StartTable::kSize)
        std::copy_n(table_.configuration(static_cast<int>(k - 1)), n, q);
      else {
        Random random(options_.seed, k);
        for (std::size_t j = 0; j < n; ++j)
          q[j] = random.uniform(start_bound(chain_.joints[j], false),
                                start_bound(chain_.joints[j], true));
      }
    }
    if (!ik_numeric::attempt(chain_, table_, options, copies, starts, restarts_, attempted_,
                             progress_)) {
      cancelled_ = true;
      return;
    }
    for (const Attempted& a : attempted_) {
      if (idle > most_idle) break;
      ++idle;
      out.iterations += a.iterations;
      if (!a.reached) {
        if (closest.q.empty() || a.cost < closest.cost) closest = a;
        continue;
      }
      std::vector<double> q(seed.begin(), seed.end());
      for (std::size_t j = 0; j < n; ++j) q[chain_.joints[j].index] = a.q[j];
      unwind(mechanism_, seed, q);
      const bool known = std::any_of(found.begin(), found.end(), [&](const auto& other) {
        for (const PathJoint& joint : chain_.joints) {
          double d = q[joint.index] - other[joint.index];
          if (joint.type == JointType::revolute)
            d -= 2 * std::numbers::pi * std::round(d / (2 * std::numbers::pi));
          if (std::fabs(d) >= 1e-4 * joint.unit) return false;
        }
        return true;
      });
      if (!known) found.push_back(std::move(q)), idle = 0;
    }
  }
  if (found.empty()) return fail(target, closest, seed, out);
  const auto distance = [&](const std::vector<double>& q) {
    double d = 0;
    for (const PathJoint& joint : chain_.joints) {
      const double x = (q[joint.index] - seed[joint.index]) / joint.unit;
      d += x * x;
    }
    return d;
  };
  std::stable_sort(found.begin(), found.end(),
                   [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  for (const auto& q : found) out.q.insert(out.q.end(), q.begin(), q.end());
  out.status = IkStatus::solved;
  measure(target, out);
}

void FastSolver::follow(const Pose& target, std::span<double> q, IkResult& out) {
  const std::size_t n = chain_.size();
  std::vector<double> from(n);
  for (std::size_t j = 0; j < n; ++j) from[j] = q[chain_.joints[j].index];
  AttemptOptions options{lanes(), options_.seed, true};
  options.lanes.max_step = 0.25;
  options.lanes.patience = options_.max_iterations;
  restarts_.assign(1, 0);
  attempted_.resize(1);
  out = IkResult{};
  if (!ik_numeric::attempt(chain_, table_, options, {&target, 1}, from, restarts_, attempted_,
                           progress_)) {
    cancelled_ = true;
    return;
  }
  out.iterations = attempted_[0].iterations;
  const Attempted direct = attempted_[0];
  if (direct.reached) from = direct.q;
  if (!direct.reached && !walk(target, options, from, out)) {
    if (!cancelled_) fail(target, direct, q, out);
  } else {
    // As it stands: another turn of a joint would be a jump.
    out.q.assign(q.begin(), q.end());
    for (std::size_t j = 0; j < n; ++j) out.q[chain_.joints[j].index] = from[j];
    out.status = IkStatus::solved;
    measure(target, out);
  }
  if (!out.q.empty()) std::copy_n(out.q.begin(), q.size(), q.begin());
}

// Goes to a target that lies far from the sample before it in small steps along the straight way.
bool FastSolver::walk(const Pose& target, const AttemptOptions& options, std::span<double> path,
                      IkResult& out) {
  const Pose start = forward(chain_, path, frames_);
  const Vec3 turn = spatial::rotation_difference(start.R, target.R);
  const Vec3 way = spatial::sub(target.p, start.p);
  for (int i = 1; i <= kApproachSteps; ++i) {
    const double s = static_cast<double>(i) / kApproachSteps;
    Pose between, turned, from_R;
    between.p = spatial::add(start.p, spatial::scale(way, s));
    turned.R = spatial::rotation_exp(spatial::scale(turn, s));
    from_R.R = start.R;
    between.R = spatial::compose(turned, from_R).R;
    const Pose& here = i == kApproachSteps ? target : between;
    if (!ik_numeric::attempt(chain_, table_, options, {&here, 1}, path, restarts_, attempted_,
                             progress_)) {
      cancelled_ = true;
      return false;
    }
    out.iterations += attempted_[0].iterations;
    if (!attempted_[0].reached) return false;
    std::copy(attempted_[0].q.begin(), attempted_[0].q.end(), path.begin());
  }
  return true;
}

}  // namespace robomosp::ik_numeric
