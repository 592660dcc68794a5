// SPDX-License-Identifier: Apache-2.0
#include "sim/ik_question.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "kernel/text.h"
#include "robotics/kinematics.h"
#include "robotics/singularity.h"
#include "spatial/pose.h"
#include "spatial/print.h"

namespace robomosp::sim {
namespace {

/// Where most solutions of an answer are looked at and named.
constexpr std::size_t kMostSolutions = 4096;

/// Whether the axis of a joint counts other joints, too: its value depends on where these are.
bool counts_others(const IkQuestion& asked, std::int32_t joint) {
  if (joint < 0 || asked.model->joints[static_cast<std::size_t>(joint)].is_coupled()) return false;
  const auto entry = asked.model->joints[static_cast<std::size_t>(joint)].q_index;
  const PostAxis* const axis = asked.axes.of_entry(static_cast<std::size_t>(entry));
  return axis && !axis->coupled.empty();
}

Error unused(const IkQuestion& asked, const char* argument,
             const std::vector<std::string>& others) {
  std::vector<std::string> quoted;
  for (const std::string& name : others) quoted.push_back(text::quote(name));
  return error(ErrorCode::unsupported,
               "the solver " + text::quote(asked.bound.provider) + " does not use " + argument,
               quoted.empty() ? "No solver of this robot does: leave it out."
                              : "Of this robot's solvers " + text::enumerate(quoted) +
                                    (quoted.size() == 1 ? " does" : " do") +
                                    ": give provider = " + quoted.front() + ", or leave it out.",
               asked.where);
}

std::vector<IkSolution> solutions_of(const IkQuestion& asked, std::span<const double> q,
                                     std::span<const double> near) {
  const std::size_t n = asked.model->coordinate_count();
  std::vector<IkSolution> out;
  for (std::size_t i = 0; (i + 1) * n <= q.size() && i < kMostSolutions; ++i) {
    IkSolution s;
    s.q.assign(q.begin() + static_cast<std::ptrdiff_t>(i * n),
               q.begin() + static_cast<std::ptrdiff_t>((i + 1) * n));
    s.measures = asked.names.measure(s.q);
    s.excess = robotics::limit_excess(*asked.model, s.q);
    if (s.excess.joint >= 0) {
      robotics::turn_into_limits(*asked.model, s.q, near);
      s.excess = robotics::limit_excess(*asked.model, s.q);
    }
    out.push_back(std::move(s));
  }
  return out;
}

bool is_same_branch(const IkSolution& a, const IkSolution& b) {
  for (std::size_t k = 0; k < a.measures.size(); ++k)
    if (a.measures[k] * b.measures[k] < 0 && std::fabs(a.measures[k]) > kBranchesMeet &&
        std::fabs(b.measures[k]) > kBranchesMeet)
      return false;
  return true;
}

/// "5 by joint 2 ("shoulder"), 12.3 deg at least; 1 by ..."
std::string by_joints(const RobotModel& m, const robotics::MakerAxes& axes,
                      std::span<const IkSolution> beyond) {
  struct Count {
    std::size_t count = 0;
    double least = INFINITY;
    const IkSolution* at = nullptr;  ///< with the least excess
  };
  std::map<std::int32_t, Count> joints;
  for (const IkSolution& s : beyond) {
    Count& c = joints[s.excess.joint];
    ++c.count;
    if (s.excess.by < c.least) c.least = s.excess.by, c.at = &s;
  }
  std::string out;
  for (const auto& [joint, c] : joints) {
    const JointModel& j = m.joints[static_cast<std::size_t>(joint)];
    out += (out.empty() ? "" : "; ") + std::to_string(c.count) + " by " +
           (j.is_coupled() || !c.at
                ? std::string()
                : axes.before_place(static_cast<std::size_t>(j.q_index), c.at->q)) +
           "joint " + std::to_string(joint + 1) + " (" + text::quote(j.name) + "), " +
           spatial::print_joint_value(c.least, j.type) + (c.count > 1 ? " at least" : "");
  }
  return out;
}

/// What limits took away of one pose: the solver's answers without limits that no whole turn brings
/// within them.
/// `total`: all of them.
Result<std::vector<IkSolution>> beyond_limits(const Registry& registry, const IkQuestion& asked,
                                              const IkBatch& batch, std::span<const double> seed,
                                              std::span<const IkSolution> within,
                                              std::size_t& total, Progress& progress) {
  RMP_TRY_ASSIGN(const auto free, asked.unlimited(registry));
  IkBatch all = batch;
  all.all_solutions = true;
  all.seeds = seed;
  RMP_TRY_ASSIGN(const auto results, solve_ik(free, all, progress));
  std::vector<IkSolution> out;
  if (results.front().status != IkStatus::solved) return out;
  std::vector<IkSolution> found = solutions_of(asked, results.front().q, seed);
  total = found.size();
  // A redundant arm has a continuum on each branch: what is gone is a branch without any of it.
  const bool by_branch =
      asked.has_tag("redundant") && !asked.names.empty() && batch.arm_angles.empty();
  for (IkSolution& s : found) {
    if (s.excess.joint < 0) continue;
    if (by_branch && std::any_of(within.begin(), within.end(),
                                 [&](const IkSolution& w) { return is_same_branch(s, w); }))
      continue;
    out.push_back(std::move(s));
  }
  return out;
}

/// "2 of 8 solutions are beyond the joint limits: ..."
std::string limits_sentence(const IkQuestion& asked, std::span<const IkSolution> beyond,
                            std::size_t total) {
  if (beyond.empty()) return {};
  const std::string n = std::to_string(beyond.size());
  // A search meets what it meets; formulas have all.
  const std::string who = asked.has_tag("closed_form") ? "" : " that the search met";
  const bool is_all = beyond.size() == total;
  return (!is_all              ? n + " of " + std::to_string(total) + " solutions"
          : beyond.size() == 1 ? "the only solution"
                               : "all " + n + " solutions") +
         who + (beyond.size() == 1 ? " is" : " are") +
         " beyond the joint limits: " + by_joints(*asked.model, asked.axes, beyond);
}

/// Names of the branches of some solutions, each once.
std::vector<std::string> branches_of(const IkQuestion& asked, std::span<const IkSolution> some) {
  std::vector<std::string> out;
  for (const IkSolution& s : some) {
    std::string name = text::quote(asked.names.name(s.measures));
    if (std::find(out.begin(), out.end(), name) == out.end()) out.push_back(std::move(name));
  }
  return out;
}

Error no_such_branch(const IkQuestion& asked, std::span<const IkSolution> within,
                     std::span<const IkSolution> beyond) {
  std::string message = "no solution is on the branch " + text::quote(asked.wish->words);
  for (const IkSolution& s : beyond)
    if (asked.wish->is_met(s.measures)) {
      message += " within the joint limits: it would need " + asked.excess_words(s.excess, s.q);
      break;
    }
  return error(ErrorCode::unreachable, std::move(message),
               "There are " + text::enumerate(branches_of(asked, within)) + ".", asked.where);
}

std::size_t erase_other_branches(const IkQuestion& asked, std::vector<IkSolution>& some) {
  if (!asked.wish) return 0;
  return std::erase_if(some, [&](const IkSolution& s) { return !asked.wish->is_met(s.measures); });
}

/// The first of a target's solutions on the wanted branch takes the place of the answer; false
/// when there is none, and the answer says so.
bool take_branch(const IkQuestion& asked, IkResult& result) {
  std::vector<IkSolution> all = solutions_of(asked, result.q, {});
  std::vector<IkSolution> found = all;
  erase_other_branches(asked, found);
  if (found.empty()) {
    result.detail = "no solution is on the branch " + text::quote(asked.wish->words) +
                    "; there are " + text::enumerate(branches_of(asked, all));
    result.q.resize(asked.model->coordinate_count());
    return false;
  }
  result.q = std::move(found.front().q);
  return true;
}

}  // namespace

bool BranchWish::is_met(std::span<const double> measures) const {
  for (std::size_t k = 0; k < ways.size() && k < measures.size(); ++k)
    if (ways[k] * measures[k] < -kBranchesMeet) return false;
  return true;
}

bool IkQuestion::has_tag(std::string_view tag) const {
  return std::find(tags.begin(), tags.end(), tag) != tags.end();
}

std::string IkQuestion::excess_words(const robotics::LimitExcess& excess,
                                     std::span<const double> q) const {
  if (excess.joint < 0) return {};
  const auto entry = model->joints[static_cast<std::size_t>(excess.joint)].q_index;
  return axes.before_place(static_cast<std::size_t>(entry), q) +
         robotics::excess_words(*model, excess);
}

Result<void> IkQuestion::refuse_unused(const Registry& registry, bool has_arm_angle,
                                       bool has_branch) const {
  if (has_arm_angle && !has_tag("arm_angle"))
    return unused(*this, "arm_angle", ik_solvers_with(registry, model, "arm_angle"));
  if (has_branch && names.empty())
    return unused(*this, "branch", ik_solvers_with(registry, model, "branches"));
  return {};
}

Result<Bound<IkSolver>> IkQuestion::unlimited(const Registry& registry) const {
  return bind_ik(registry, std::make_shared<const RobotModel>(robotics::without_limits(*model)),
                 {bound.provider, choice.params});
}

std::string_view status_sentence(IkStatus s) {
  switch (s) {
    case IkStatus::out_of_reach: return "the target is out of reach";
    case IkStatus::joint_limit: return "the target can only be reached outside the joint limits";
    default: return "no configuration was found for the target";
  }
}

void report_singular(const RobotModel& m, std::size_t tip, std::uint32_t parts, IkResult& result) {
  constexpr double kNear = 1e-3;
  const std::size_t n = m.coordinate_count();
  if (result.status != IkStatus::solved || result.q.size() < n || n == 0) return;
  const auto part = !(parts & kIkRotation)   ? robotics::TwistPart::translation
                    : !(parts & kIkPosition) ? robotics::TwistPart::rotation
                                             : robotics::TwistPart::all;
  // The same for every solver: what is lost depends on how lengths are counted.
  const std::span<const double> q = std::span(result.q).first(n);
  std::vector<Pose> frames(m.joints.size());
  robotics::forward_kinematics(m, q, frames);
  const bool is_regular = robotics::is_surely_regular(m, tip, frames, part, kNear);
  if (!is_regular) {
    const auto s = robotics::singularity(m, tip, q, part, kNear);
    if (!s.lost.empty()) result.lost_direction = s.lost.front();
  }
  if (result.lost_direction == std::array<double, 6>{}) return;
  if (result.detail.empty()) {
    const auto& t = result.lost_direction;
    const Vec3 v = spatial::rotate(m.base, Vec3{t[0], t[1], t[2]});
    const Vec3 w = spatial::rotate(m.base, Vec3{t[3], t[4], t[5]});
    result.detail = "next to a singular configuration: there the tip " +
                    robotics::lost_words({v[0], v[1], v[2], w[0], w[1], w[2]});
  }
}

Result<IkAnswer> solve_one(const Registry& registry, const IkQuestion& asked, IkBatch batch,
                           bool wants_all, Progress& progress) {
  const RobotModel& m = *asked.model;
  batch.all_solutions = wants_all || asked.wish.has_value();
  // Without limits a search would begin at other joint values than within them.
  std::vector<double> start(batch.seeds.begin(), batch.seeds.end());
  if (start.empty()) start = robotics::start_configuration(m);
  Bound<IkSolver> solver = asked.bound;
  if (asked.is_ignoring) {
    RMP_TRY_ASSIGN(solver, asked.unlimited(registry));
    batch.seeds = start;
  }
  RMP_TRY_ASSIGN(auto results, solve_ik(solver, batch, progress));
  IkAnswer out;
  out.result = std::move(results.front());
  out.result.detail = asked.axes.in_text(m, out.result.detail);
  report_singular(m, asked.tip, kIkPose, out.result);
  const bool is_solved = out.result.status == IkStatus::solved;
  out.found = solutions_of(asked, out.result.q, start);
  std::size_t total = out.found.size();
  if (asked.is_ignoring) {
    for (const IkSolution& s : out.found)
      if (s.excess.joint >= 0) out.beyond.push_back(s);
  } else if ((is_solved && batch.all_solutions) ||
             (out.result.status == IkStatus::joint_limit &&
              (batch.all_solutions || asked.has_tag("closed_form") ||
               counts_others(asked, out.result.limiting_joint)))) {
    RMP_TRY_ASSIGN(out.beyond, beyond_limits(registry, asked, batch, start,
                                             is_solved ? std::span<const IkSolution>(out.found)
                                                       : std::span<const IkSolution>(),
                                             total, progress));
  }
  out.limits = limits_sentence(asked, out.beyond, total);
  if (is_solved && asked.wish) {
    const std::vector<IkSolution> all = out.found;
    erase_other_branches(asked, out.found);
    if (out.found.empty()) return no_such_branch(asked, all, out.beyond);
    erase_other_branches(asked, out.beyond);
    if (!wants_all) out.found.resize(1);
  }
  return out;
}

Result<std::vector<IkRow>> solve_many(const Registry& registry, const IkQuestion& asked,
                                      IkBatch batch, Progress& progress) {
  const RobotModel& m = *asked.model;
  const std::size_t n = m.coordinate_count();
  std::vector<double> start, first;
  Bound<IkSolver> solver = asked.bound;
  if (asked.is_ignoring) {
    RMP_TRY_ASSIGN(solver, asked.unlimited(registry));
    if (batch.seeds.empty()) {
      start = robotics::start_configuration(m);
      batch.seeds = start;
    }
  }
  if (asked.wish && batch.continuous && !batch.targets.empty()) {
    // The path begins on the branch, and stays on it.
    IkBatch begin = batch;
    begin.targets = batch.targets.first(1);
    if (!batch.seeds.empty()) begin.seeds = batch.seeds.first(n);
    if (!batch.arm_angles.empty()) begin.arm_angles = batch.arm_angles.first(1);
    begin.all_solutions = true;
    begin.continuous = false;
    RMP_TRY_ASSIGN(auto results, solve_ik(solver, begin, progress));
    IkResult& result = results.front();
    if (result.status == IkStatus::solved && !take_branch(asked, result))
      return error(ErrorCode::unreachable, "target 1: " + result.detail,
                   "Start from one of those, or move the target.", asked.where);
    if (result.status == IkStatus::solved) first = result.q;
    if (!first.empty()) batch.seeds = first;
  }
  batch.all_solutions = asked.wish && !batch.continuous;
  RMP_TRY_ASSIGN(auto results, solve_ik(solver, batch, progress));
  std::vector<IkRow> out;
  out.reserve(results.size());
  for (IkResult& result : results) {
    IkRow& row = out.emplace_back();
    row.is_other =
        batch.all_solutions && result.status == IkStatus::solved && !take_branch(asked, result);
    // A target without any configuration has the seed's place filled with zeros.
    if (result.q.size() < n) result.q.assign(n, 0.0);
    result.q.resize(n);
    if (asked.is_ignoring) {
      if (robotics::limit_excess(m, result.q).joint >= 0 && !batch.continuous)
        robotics::turn_into_limits(m, result.q, batch.seeds.first(std::min(n, batch.seeds.size())));
      const auto excess = robotics::limit_excess(m, result.q);
      row.is_within = excess.joint < 0;
      if (!row.is_within && result.detail.empty())
        result.detail = asked.excess_words(excess, result.q);
    }
    result.detail = asked.axes.in_text(m, result.detail);
    row.result = std::move(result);
  }
  return out;
}

}  // namespace robomosp::sim
