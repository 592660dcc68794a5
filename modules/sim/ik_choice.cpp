// SPDX-License-Identifier: Apache-2.0
#include "sim/ik_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernel/text.h"
#include "motion/provider_params.h"
#include "robotics/arm_status.h"
#include "robotics/coordinates.h"
#include "robotics/kinematics.h"

namespace robomosp::sim {
namespace {

constexpr std::size_t kMostJoints = 64, kMostTips = 64;

bool has_tag(const ProviderInfo& info, std::string_view tag) {
  return std::find(info.tags.begin(), info.tags.end(), tag) != info.tags.end();
}

/// Whether a solver serves each tip: what it says of the tips' poses in neutral.
Result<void> serves_all(const Registry& registry, const ProviderInfo& info,
                        const RobotModel& model) {
  RMP_TRY_ASSIGN(const auto solver, registry.create<IkSolver>(info.name));
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_params(info, {info.name, {}}, "provider " + info.name));
  RMP_TRY(guarded(info.name, [&] { return solver->prepare(model, *params); }));
  if (model.tips.size() == 1) return {};
  const std::vector<double> neutral = robotics::neutral_coordinates(model);
  std::vector<Pose> frames(model.joints.size());
  robotics::forward_kinematics(model, neutral, frames);
  NoProgress none;
  for (std::size_t i = 0; i < model.tips.size(); ++i) {
    const Pose target = robotics::tip_pose(model, i, frames);
    IkBatch batch;
    batch.targets = {&target, 1};
    batch.seeds = neutral;
    batch.tip = static_cast<std::int32_t>(i);
    IkResult result;
    RMP_TRY(guarded(info.name, [&] { return solver->solve(batch, {&result, 1}, none); }));
  }
  return {};
}

}  // namespace

Result<AutomaticIk> automatic_ik(const Registry& registry, const RobotModel& model) {
  RMP_TRY_ASSIGN(const ProviderInfo common, registry.find(IkSolver::kInterfaceId, ""));
  AutomaticIk out{common.name, has_tag(common, "closed_form"), {}};
  const auto chosen = registry.chosen();
  if (common.name != standard_provider(IkSolver::kInterfaceId) ||
      chosen.contains(IkSolver::kInterfaceId) || model.joints.size() > kMostJoints ||
      model.tips.empty() || model.tips.size() > kMostTips)
    return out;
  const std::string joints = "dof=" + std::to_string(model.dof());
  for (const ProviderInfo& info : registry.list(IkSolver::kInterfaceId)) {
    if (!info.enabled || !info.shipped || !has_tag(info, "closed_form")) continue;
    const auto served = serves_all(registry, info, model);
    if (served.ok()) return AutomaticIk{info.name, true, {}};
    if (has_tag(info, joints)) out.refusals.push_back(info.name + ": " + served.error().message);
  }
  return out;
}

std::vector<std::string> ik_solvers_with(const Registry& registry,
                                         const std::shared_ptr<const RobotModel>& model,
                                         std::string_view tag) {
  std::vector<std::string> out;
  for (const ProviderInfo& info : registry.list(IkSolver::kInterfaceId))
    if (info.enabled && has_tag(info, tag) && bind_ik(registry, model, {info.name, {}}).ok())
      out.push_back(info.name);
  return out;
}

BranchNames::BranchNames(const Bound<IkSolver>& ik, std::int32_t tip) : ik_(ik), tip_(tip) {
  const auto* branches =
      static_cast<const IkBranches*>(ik_.solver->extension(IkBranches::kExtensionId));
  if (!branches) return;
  const auto got = guarded(ik_.provider, [&]() -> Result<void> {
    const auto given = branches->choices(tip_);
    choices_.assign(given.begin(), given.end());
    return {};
  });
  const bool is_whole =
      got.ok() && std::all_of(choices_.begin(), choices_.end(),
                              [](const auto& c) { return c.name && c.positive && c.negative; });
  if (is_whole) branches_ = branches;
  else choices_.clear();
}

std::vector<double> BranchNames::measure(std::span<const double> q) const {
  const std::size_t n = ik_.model ? ik_.model->coordinate_count() : 0;
  if (!branches_ || n == 0) return {};
  std::vector<double> out(q.size() / n * choices_.size(), 0.0);
  const auto done = guarded(ik_.provider, [&]() -> Result<void> {
    branches_->measure(tip_, q, out);
    return {};
  });
  for (double& x : out)
    if (!done.ok() || !std::isfinite(x)) x = 0;
  return out;
}

namespace {
/// Bits of STATUS by the names of choices: shoulder, elbow, wrist; others take the next free bits.
std::vector<std::uint32_t> status_bits(std::span<const IkBranchChoice> choices) {
  static constexpr std::string_view kNames[] = {"shoulder", "elbow", "wrist"};
  std::vector<std::uint32_t> out(choices.size(), 0);
  std::uint32_t taken = 0;
  for (std::size_t i = 0; i < choices.size(); ++i)
    for (std::uint32_t bit = 0; bit < 3; ++bit)
      if (choices[i].name == kNames[bit] && (taken & (1U << bit)) == 0) {
        out[i] = 1U << bit;
        taken |= out[i];
      }
  for (std::uint32_t& x : out)
    for (std::uint32_t bit = 0; bit < 30 && x == 0; ++bit)
      if ((taken & (1U << bit)) == 0) {
        x = 1U << bit;
        taken |= x;
      }
  return out;
}
constexpr std::uint32_t kSeen =
    robotics::kShoulderBehind | robotics::kElbowBelow | robotics::kWristFlipped;
}  // namespace

std::uint32_t BranchNames::status(std::span<const double> q, std::uint32_t& known) const {
  known = 0;
  if (choices_.empty() || !ik_.model || q.size() != ik_.model->coordinate_count()) return 0;
  const std::vector<double> measures = measure(q);
  const std::vector<std::uint32_t> bits = status_bits(choices_);
  std::uint32_t out = 0;
  for (std::size_t i = 0; i < measures.size(); ++i) {
    known |= bits[i];
    if (measures[i] < 0) out |= bits[i];
  }
  if ((known & kSeen) == kSeen)
    if (const auto seen = robotics::arm_status(*ik_.model, q)) out = (out & ~kSeen) | *seen;
  return out;
}

std::string BranchNames::status_words() const {
  const std::vector<std::uint32_t> bits = status_bits(choices_);
  std::uint32_t known = 0;
  for (const std::uint32_t b : bits) known |= b;
  const bool is_seen =
      (known & kSeen) == kSeen && ik_.model &&
      robotics::arm_status(*ik_.model, std::vector<double>(ik_.model->coordinate_count(), 0.0));
  std::string out;
  for (std::size_t i = 0; i < choices_.size(); ++i) {
    const std::string words =
        is_seen && bits[i] == robotics::kShoulderBehind ? "in front or behind"
        : is_seen && bits[i] == robotics::kElbowBelow   ? "elbow up or down"
        : is_seen && bits[i] == robotics::kWristFlipped
            ? "hand down or up"
            : std::string(choices_[i].positive) + " or " + choices_[i].negative;
    out += (out.empty() ? "" : ", ") + std::to_string(bits[i]) + ": " + words;
  }
  return out;
}

std::string BranchNames::configuration(std::span<const double> q) const {
  std::uint32_t known = 0;
  const std::uint32_t is = status(q, known);
  const std::vector<std::uint32_t> bits = status_bits(choices_);
  const bool is_seen =
      (known & kSeen) == kSeen && ik_.model && robotics::arm_status(*ik_.model, q).has_value();
  std::string words;
  for (std::size_t i = 0; i < choices_.size(); ++i) {
    const bool second = (is & bits[i]) != 0;
    words += words.empty() ? "" : ", ";
    if (is_seen && bits[i] == robotics::kShoulderBehind) words += second ? "behind" : "in front";
    else if (is_seen && bits[i] == robotics::kElbowBelow)
      words += second ? "elbow down" : "elbow up";
    else if (is_seen && bits[i] == robotics::kWristFlipped)
      words += second ? "hand up" : "hand down";
    else words += std::string(second ? choices_[i].negative : choices_[i].positive);
  }
  return "STATUS " + std::to_string(is) + (words.empty() ? "" : " (" + words + ")");
}

std::string configuration_change(const BranchNames& names, std::span<const double> q,
                                 const BranchChange& change) {
  const std::size_t m = names.measure(q).size() / std::max<std::size_t>(1, names.choices().size());
  const std::size_t n = m > 0 ? q.size() / m : 0;
  const auto at = [&](std::size_t sample) {
    return sample < m ? names.configuration(q.subspan(sample * n, n)) : std::string();
  };
  const std::string from = at(change.before), to = at(change.at);
  return from.empty() || from == to ? change.from + " to " + change.to : from + " to " + to;
}

std::string BranchNames::name(std::span<const double> measures) const {
  std::string out;
  for (std::size_t i = 0; i < choices_.size() && i < measures.size(); ++i) {
    if (!out.empty()) out += ' ';
    out += measures[i] < -kBranchesMeet ? choices_[i].negative : choices_[i].positive;
  }
  return out;
}

std::string BranchNames::words() const {
  std::string out;
  for (const IkBranchChoice& c : choices_)
    out += (out.empty() ? "" : ", ") + std::string(c.positive) + " or " + c.negative;
  return out;
}

std::vector<BranchChange> branch_changes(const BranchNames& names, std::span<const double> q,
                                         std::size_t most) {
  std::vector<BranchChange> out;
  const std::size_t m = names.choices().size();
  if (m == 0) return out;
  const std::vector<double> all = names.measure(q);
  std::vector<double> held(all.begin(),
                           all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), m)));
  std::size_t before = 0;
  for (std::size_t i = 1; (i + 1) * m <= all.size(); ++i) {
    std::vector<double> now = held;
    bool changed = false, meets = false;
    for (std::size_t k = 0; k < m; ++k) {
      const double x = all[i * m + k];
      if (std::fabs(x) < kBranchesMeet) {
        meets = true;
        continue;
      }
      changed |= std::fabs(held[k]) >= kBranchesMeet && (x < 0) != (held[k] < 0);
      now[k] = x;
    }
    if (changed && out.size() < most) out.push_back({i, before, names.name(held), names.name(now)});
    if (!meets) before = i;
    held = std::move(now);
  }
  return out;
}

}  // namespace robomosp::sim
