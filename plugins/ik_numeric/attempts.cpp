// SPDX-License-Identifier: Apache-2.0
#include "attempts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "random.h"
#include "spatial/pose.h"

namespace robomosp::ik_numeric {
namespace {

constexpr int kFeatures = 12;
constexpr int kNone = std::numeric_limits<int>::max();

void random_start(const Chain& chain, Random& random, double* q) {
  for (std::size_t i = 0; i < chain.size(); ++i)
    q[i] = random.uniform(start_bound(chain.joints[i], false), start_bound(chain.joints[i], true));
}

/// Hands targets and starts to the lanes. A target is open from its first attempt until it is
/// answered; there is room for one open target a lane.
class Scheduler final : public LaneWork {
 public:
  Scheduler(const Chain& chain, const StartTable& table, const AttemptOptions& options, int width,
            std::span<const Pose> targets, std::span<const double> starts,
            std::span<const int> restarts, std::span<Attempted> out, Progress& progress)
      : chain_(chain),
        table_(table),
        options_(options),
        targets_(targets),
        starts_(starts),
        restarts_(restarts),
        out_(out),
        progress_(progress),
        slots_(static_cast<std::size_t>(width)),
        lanes_(static_cast<std::size_t>(width)) {}

  bool next(int lane, double* q, double* R, double* p) override {
    Lane& l = lanes_[static_cast<std::size_t>(lane)];
    if (l.slot < 0 || !wants_more(slots_[static_cast<std::size_t>(l.slot)])) l.slot = find_slot();
    if (l.slot < 0) return false;
    Slot& s = slots_[static_cast<std::size_t>(l.slot)];
    l.attempt = s.next++;
    ++s.running;
    start(s, l.attempt, q);
    const Pose& target = targets_[static_cast<std::size_t>(s.sample)];
    std::copy(target.R.begin(), target.R.end(), R);
    std::copy(target.p.begin(), target.p.end(), p);
    return true;
  }

  void done(int lane, LaneEnd end, const double* q, double cost, int iterations) override {
    Lane& l = lanes_[static_cast<std::size_t>(lane)];
    Slot& s = slots_[static_cast<std::size_t>(l.slot)];
    --s.running;
    // Answered by another lane that ended in the same step.
    if (s.sample < 0) {
      l.slot = l.attempt = -1;
      return;
    }
    Attempted& out = out_[static_cast<std::size_t>(s.sample)];
    out.iterations += iterations;
    const bool good = end == LaneEnd::reached;
    // The first one is the closest so far whatever it costs: infinity is not below infinity.
    if (good ? l.attempt < s.best
             : s.best == kNone && (out.q.empty() || cost < out.cost ||
                                   (cost == out.cost && l.attempt < s.closest))) {
      (good ? s.best : s.closest) = l.attempt;
      out.q.assign(q, q + chain_.size());
      out.cost = cost;
    }
    out.reached |= good;
    out.ended_early |= end == LaneEnd::out_of_iterations;
    const bool over =
        s.best != kNone ? !earlier(l.slot, lane, s.best) : s.running == 0 && !wants_more(s);
    if (over) s.sample = -1, l.slot = -1;
    l.attempt = -1;
  }

  bool obsolete(int lane) override {
    Lane& l = lanes_[static_cast<std::size_t>(lane)];
    if (l.attempt < 0) return false;
    // A slot is not given to another target while a lane works for it.
    Slot& s = slots_[static_cast<std::size_t>(l.slot)];
    if (s.sample >= 0 && s.best > l.attempt) return false;
    --s.running;
    l.attempt = l.slot = -1;
    return true;
  }

  bool stopped() override {
    if (first_fresh_ > 64)
      progress_.report(static_cast<double>(first_fresh_) / static_cast<double>(targets_.size()),
                       "inverse kinematics");
    return cancelled_ = progress_.cancelled();
  }
  [[nodiscard]] bool cancelled() const { return cancelled_; }

 private:
  struct Slot {
    long sample = -1;  ///< -1 = free
    int next = 0, running = 0, best = kNone, closest = kNone;
    bool listed = false;
    std::vector<float> distances;
  };
  struct Lane {
    int slot = -1, attempt = -1;  ///< -1 = none
  };

  [[nodiscard]] bool wants_more(const Slot& s) const {
    return s.sample >= 0 && s.best == kNone &&
           s.next <= restarts_[static_cast<std::size_t>(s.sample)];
  }
  int find_slot() {
    if (first_fresh_ < targets_.size())
      for (std::size_t i = 0; i < slots_.size(); ++i)
        if (slots_[i].sample < 0 && !in_use(static_cast<int>(i))) {
          Slot& s = slots_[i];
          s.sample = static_cast<long>(first_fresh_++);
          s.next = s.running = 0, s.best = s.closest = kNone, s.listed = false;
          Attempted& out = out_[static_cast<std::size_t>(s.sample)];
          out.reached = out.ended_early = false, out.iterations = 0;
          out.cost = std::numeric_limits<double>::infinity();
          out.q.clear();
          return static_cast<int>(i);
        }
    for (std::size_t i = 0; i < slots_.size(); ++i)
      if (wants_more(slots_[i])) return static_cast<int>(i);
    return -1;
  }
  // Attempts of an answered target may still run in other lanes.
  [[nodiscard]] bool in_use(int slot) const {
    return std::any_of(lanes_.begin(), lanes_.end(),
                       [&](const Lane& l) { return l.slot == slot && l.attempt >= 0; });
  }
  [[nodiscard]] bool earlier(int slot, int but, int attempt) const {
    for (std::size_t i = 0; i < lanes_.size(); ++i)
      if (static_cast<int>(i) != but && lanes_[i].slot == slot && lanes_[i].attempt >= 0 &&
          lanes_[i].attempt < attempt)
        return true;
    return false;
  }

  void start(Slot& s, int attempt, double* q) {
    const auto sample = static_cast<std::size_t>(s.sample);
    const std::size_t n = chain_.size();
    if (attempt == 0) {
      std::copy_n(starts_.data() + sample * n, n, q);
      return;
    }
    if (attempt > StartTable::kSize) {
      Random random(options_.seed, static_cast<std::uint64_t>(attempt));
      random_start(chain_, random, q);
      return;
    }
    if (!s.listed) {
      s.distances.resize(StartTable::kSize);
      table_.distances(targets_[sample], s.distances);
      s.listed = true;
    }
    const auto nearest = std::min_element(s.distances.begin(), s.distances.end());
    *nearest = std::numeric_limits<float>::infinity();
    std::copy_n(table_.configuration(static_cast<int>(nearest - s.distances.begin())), n, q);
  }

  const Chain& chain_;
  const StartTable& table_;
  const AttemptOptions& options_;
  std::span<const Pose> targets_;
  std::span<const double> starts_;
  std::span<const int> restarts_;
  std::span<Attempted> out_;
  Progress& progress_;
  std::vector<Slot> slots_;
  std::vector<Lane> lanes_;
  std::size_t first_fresh_ = 0;
  bool cancelled_ = false;
};

}  // namespace

StartTable::StartTable(const Chain& chain, std::uint64_t seed)
    : joints_(chain.size()),
      length_(chain.length),
      q_(static_cast<std::size_t>(kSize) * chain.size()),
      features_(static_cast<std::size_t>(kFeatures + 1) * kSize) {
  Random random(seed);
  std::vector<Pose> frames(chain.size());
  for (std::size_t i = 0; i < kSize; ++i) {
    double* q = q_.data() + i * joints_;
    random_start(chain, random, q);
    const Pose at = forward(chain, {q, joints_}, frames);
    float* f = features_.data() + i;
    // |p - p'|^2 / length^2 and 3 - trace(R^T R'), the squared chord, are sums of products.
    for (std::size_t k = 0; k < 9; ++k) f[k * kSize] = static_cast<float>(-at.R[k]);
    for (std::size_t k = 0; k < 3; ++k)
      f[(9 + k) * kSize] = static_cast<float>(-2 * at.p[k] / length_);
    f[12 * kSize] = static_cast<float>(spatial::dot(at.p, at.p) / (length_ * length_));
  }
}

void StartTable::distances(const Pose& target, std::span<float> out) const {
  float t[kFeatures];
  for (std::size_t k = 0; k < 9; ++k) t[k] = static_cast<float>(target.R[k]);
  for (std::size_t k = 0; k < 3; ++k) t[9 + k] = static_cast<float>(target.p[k] / length_);
  std::copy_n(features_.data() + std::size_t{kFeatures} * kSize, kSize, out.data());
  for (std::size_t k = 0; k < kFeatures; ++k) {
    const float* f = features_.data() + k * kSize;
    for (std::size_t i = 0; i < kSize; ++i) out[i] += t[k] * f[i];
  }
}

bool attempt(const Chain& chain, const StartTable& table, const AttemptOptions& options,
             std::span<const Pose> targets, std::span<const double> starts,
             std::span<const int> restarts, std::span<Attempted> out, Progress& progress) {
  const LaneEngine& engine = lane_engine();
  std::vector<LaneJoint> joints(chain.size());
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const PathJoint& j = chain.joints[i];
    LaneJoint& l = joints[i];
    std::copy(j.placement.R.begin(), j.placement.R.end(), l.R);
    std::copy(j.placement.p.begin(), j.placement.p.end(), l.p);
    constexpr double kFar = 1e300;  // finite, so that no product of it with 0 is lost
    l.lower = options.limits ? std::max(j.lower, -kFar) : -kFar;
    l.upper = options.limits ? std::min(j.upper, kFar) : kFar;
    l.unit = j.unit;
    l.slides = j.type == JointType::prismatic;
  }
  LaneChain lane_chain;
  lane_chain.joints = joints.data();
  lane_chain.size = static_cast<int>(chain.size());
  std::copy(chain.tool.R.begin(), chain.tool.R.end(), lane_chain.R);
  std::copy(chain.tool.p.begin(), chain.tool.p.end(), lane_chain.p);
  lane_chain.inverse_length = 1 / chain.length;
  std::vector<double> memory(lane_memory(lane_chain.size, engine.width) + 8);
  const auto address = reinterpret_cast<std::uintptr_t>(memory.data());
  double* aligned = memory.data() + ((64 - address % 64) % 64) / sizeof(double);
  Scheduler scheduler(chain, table, options, engine.width, targets, starts, restarts, out,
                      progress);
  engine.run(lane_chain, options.lanes, scheduler, aligned);
  return !scheduler.cancelled();
}

}  // namespace robomosp::ik_numeric
