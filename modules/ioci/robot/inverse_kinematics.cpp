// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics of one pose and of many: joint values, branches by name, what joint limits
// take away.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "ioci/robot/array_units.h"
#include "ioci/robot/branch_wish.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "robotics/joint_limits.h"
#include "robotics/maker_axes.h"
#include "sim/ik_choice.h"
#include "spatial/pose.h"
#include "spatial/print.h"

namespace robomosp::ioci {
namespace {

using model::Robot;

std::string_view status_word(IkStatus s) {
  switch (s) {
    case IkStatus::solved: return "solved";
    case IkStatus::out_of_reach: return "out_of_reach";
    case IkStatus::joint_limit: return "joint_limit";
    case IkStatus::not_converged: return "not_converged";
  }
  return "not_converged";
}

std::string_view status_sentence(IkStatus s) {
  switch (s) {
    case IkStatus::out_of_reach: return "the target is out of reach";
    case IkStatus::joint_limit: return "the target can only be reached outside the joint limits";
    default: return "no configuration was found for the target";
  }
}

Result<model::ProviderChoice> chosen(const Map& args, const model::ProviderChoice& robots_own) {
  return has(args, "provider") ? read_provider(*args.find("provider"), "provider")
                               : Result<model::ProviderChoice>(robots_own);
}

/// Why there is no solution, or which way the tip has lost: as far as the solver knows.
void set_reasons(Map& out, const RobotModel& m, const IkResult& result) {
  out.set("shortfall", result.shortfall);
  if (result.limiting_joint >= 0 &&
      static_cast<std::size_t>(result.limiting_joint) < m.joints.size())
    out.set("limiting_joint", m.joints[static_cast<std::size_t>(result.limiting_joint)].name);
  const auto& lost = result.lost_direction;
  if (lost == std::array<double, 6>{}) return;
  const Vec3 v = spatial::rotate(m.base, Vec3{lost[0], lost[1], lost[2]});
  const Vec3 w = spatial::rotate(m.base, Vec3{lost[3], lost[4], lost[5]});
  out.set("lost_direction", NumericArray({v[0], v[1], v[2], w[0], w[1], w[2]}));
}

/// Where most solutions of an answer are looked at and named.
constexpr std::size_t kMostNamed = 4096;

/// One command: the robot, its solver, what is asked.
class Question {
 public:
  static Result<Question> read(CommandContext& ctx, const Map& args) {
    Question out;
    const Robot& r = content<Robot>(ctx, args);
    RMP_TRY_ASSIGN(out.model, model_of(ctx, args));
    RMP_TRY_ASSIGN(out.tip, tip_index(*out.model, args));
    RMP_TRY_ASSIGN(out.choice, chosen(args, r.ik));
    RMP_TRY_ASSIGN(out.bound, ctx.app.solvers.ik(ctx.app.registry, out.model, out.choice));
    RMP_TRY_ASSIGN(const ProviderInfo info,
                   ctx.app.registry.find(IkSolver::kInterfaceId, out.bound.provider));
    out.tags = info.tags;
    out.where = "robot " + text::quote(out.model->name);
    if (auto axes = robotics::MakerAxes::of(r); axes.ok()) out.axes = std::move(*axes);
    out.names = sim::BranchNames(out.bound, static_cast<std::int32_t>(out.tip));
    out.is_ignoring = text_of(args, "limits") == "ignore";
    RMP_TRY(out.refuse_unused(ctx, args));
    if (has(args, "branch")) {
      RMP_TRY_ASSIGN(out.wish, BranchWish::read(out.names, *args.find("branch"), "branch"));
    }
    return out;
  }

  /// A joint beyond its limit at q, and the maker's axis where that is known.
  [[nodiscard]] std::string excess_words(const robotics::LimitExcess& excess,
                                         std::span<const double> q) const {
    if (excess.joint < 0) return {};
    const auto entry = model->joints[static_cast<std::size_t>(excess.joint)].q_index;
    return axes.before_place(static_cast<std::size_t>(entry), q) +
           robotics::excess_words(*model, excess);
  }

  /// Whether the axis of a joint counts other joints, too: its value depends on where these are.
  [[nodiscard]] bool counts_others(std::int32_t joint) const {
    if (joint < 0 || model->joints[static_cast<std::size_t>(joint)].is_coupled()) return false;
    const auto entry = model->joints[static_cast<std::size_t>(joint)].q_index;
    const PostAxis* const axis = axes.of_entry(static_cast<std::size_t>(entry));
    return axis && !axis->coupled.empty();
  }

  [[nodiscard]] bool has_tag(std::string_view tag) const {
    return std::find(tags.begin(), tags.end(), tag) != tags.end();
  }

  /// The same solver for the robot without limits of position.
  Result<sim::Bound<IkSolver>> unlimited(CommandContext& ctx) const {
    return sim::bind_ik(ctx.app.registry,
                        std::make_shared<const RobotModel>(robotics::without_limits(*model)),
                        {bound.provider, choice.params});
  }

  /// The tolerances and the tip of what is asked.
  [[nodiscard]] IkBatch batch(const Map& args) const {
    IkBatch out;
    out.tolerance = {real(args, "position_tolerance"), real(args, "rotation_tolerance")};
    out.tip = static_cast<std::int32_t>(tip);
    return out;
  }

  std::shared_ptr<const RobotModel> model;
  std::size_t tip = 0;
  model::ProviderChoice choice;
  sim::Bound<IkSolver> bound;
  std::vector<std::string> tags;
  sim::BranchNames names;
  std::optional<BranchWish> wish;
  bool is_ignoring = false;
  robotics::MakerAxes axes;
  std::string where;

 private:
  /// What the solver would not use is refused, with those solvers of this robot that do.
  Result<void> refuse_unused(CommandContext& ctx, const Map& args) const {
    if (has(args, "arm_angle") && !has_tag("arm_angle"))
      return unused("arm_angle", sim::ik_solvers_with(ctx.app.registry, model, "arm_angle"));
    if (has(args, "branch") && names.empty()) {
      std::vector<std::string> others = sim::ik_solvers_with(ctx.app.registry, model, "branches");
      return unused("branch", others);
    }
    return {};
  }
  [[nodiscard]] Error unused(const char* argument, const std::vector<std::string>& others) const {
    std::vector<std::string> quoted;
    for (const std::string& name : others) quoted.push_back(text::quote(name));
    return error(ErrorCode::unsupported,
                 "the solver " + text::quote(bound.provider) + " does not use " + argument,
                 quoted.empty() ? "No solver of this robot does: leave it out."
                                : "Of this robot's solvers " + text::enumerate(quoted) +
                                      (quoted.size() == 1 ? " does" : " do") +
                                      ": give provider = " + quoted.front() + ", or leave it out.",
                 where);
  }
};

/// A configuration with what is said of it.
struct Solution {
  std::vector<double> q;
  std::vector<double> measures;  ///< of its branch
  robotics::LimitExcess excess;
};

std::vector<Solution> solutions_of(const Question& asked, std::span<const double> q,
                                   std::span<const double> near) {
  const std::size_t n = asked.model->coordinate_count();
  std::vector<Solution> out;
  for (std::size_t i = 0; (i + 1) * n <= q.size() && i < kMostNamed; ++i) {
    Solution s;
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

bool is_same_branch(const Solution& a, const Solution& b) {
  for (std::size_t k = 0; k < a.measures.size(); ++k)
    if (a.measures[k] * b.measures[k] < 0 && std::fabs(a.measures[k]) > sim::kBranchesMeet &&
        std::fabs(b.measures[k]) > sim::kBranchesMeet)
      return false;
  return true;
}

/// "5 by joint 2 ("shoulder"), 12.3 deg at least; 1 by ..."
std::string by_joints(const RobotModel& m, const robotics::MakerAxes& axes,
                      std::span<const Solution> beyond) {
  struct Count {
    std::size_t count = 0;
    double least = INFINITY;
    const Solution* at = nullptr;  ///< with the least excess
  };
  std::map<std::int32_t, Count> joints;
  for (const Solution& s : beyond) {
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
Result<std::vector<Solution>> beyond_limits(CommandContext& ctx, const Question& asked,
                                            const IkBatch& batch, std::span<const double> seed,
                                            std::span<const Solution> within, std::size_t& total) {
  RMP_TRY_ASSIGN(const auto free, asked.unlimited(ctx));
  IkBatch all = batch;
  all.all_solutions = true;
  all.seeds = seed;
  RMP_TRY_ASSIGN(const auto results, sim::solve_ik(free, all, ctx.progress));
  std::vector<Solution> out;
  if (results.front().status != IkStatus::solved) return out;
  std::vector<Solution> found = solutions_of(asked, results.front().q, seed);
  total = found.size();
  // A redundant arm has a continuum on each branch: what is gone is a branch without any of it.
  const bool by_branch =
      asked.has_tag("redundant") && !asked.names.empty() && batch.arm_angles.empty();
  for (Solution& s : found) {
    if (s.excess.joint < 0) continue;
    if (by_branch && std::any_of(within.begin(), within.end(),
                                 [&](const Solution& w) { return is_same_branch(s, w); }))
      continue;
    out.push_back(std::move(s));
  }
  return out;
}

/// "2 of 8 solutions are beyond the joint limits: ..."
std::string limits_sentence(const Question& asked, std::span<const Solution> beyond,
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

List beyond_list(const Question& asked, std::span<const Solution> beyond) {
  List out;
  for (const Solution& s : beyond) {
    const JointModel& j = asked.model->joints[static_cast<std::size_t>(s.excess.joint)];
    Map row{{"q", NumericArray(s.q, joint_array_unit(*asked.model))},
            {"joint", j.name},
            {"by", s.excess.by},
            {"value", s.excess.value},
            {"limit", s.excess.limit},
            {"detail", asked.excess_words(s.excess, s.q)}};
    if (!asked.names.empty()) row.set("branch", asked.names.name(s.measures));
    out.emplace_back(std::move(row));
  }
  return out;
}

/// Names of the branches of some solutions, each once.
std::vector<std::string> branches_of(const Question& asked, std::span<const Solution> some) {
  std::vector<std::string> out;
  for (const Solution& s : some) {
    std::string name = text::quote(asked.names.name(s.measures));
    if (std::find(out.begin(), out.end(), name) == out.end()) out.push_back(std::move(name));
  }
  return out;
}

Error no_such_branch(const Question& asked, std::span<const Solution> within,
                     std::span<const Solution> beyond) {
  std::string message = "no solution is on the branch " + text::quote(asked.wish->words());
  for (const Solution& s : beyond)
    if (asked.wish->is_met(s.measures)) {
      message += " within the joint limits: it would need " + asked.excess_words(s.excess, s.q);
      break;
    }
  return error(ErrorCode::unreachable, std::move(message),
               "There are " + text::enumerate(branches_of(asked, within)) + ".", asked.where);
}

std::size_t erase_other_branches(const Question& asked, std::vector<Solution>& some) {
  if (!asked.wish) return 0;
  return std::erase_if(some, [&](const Solution& s) { return !asked.wish->is_met(s.measures); });
}

Result<Value> solve_ik(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Question asked, Question::read(ctx, args));
  const RobotModel& m = *asked.model;
  std::vector<double> seed;
  std::optional<Pose> target;
  if (has(args, "target")) {
    target = pose_from(*args.find("target"));
    if (!target)
      return error(ErrorCode::invalid_argument, "the target is not a pose", {}, "target");
  } else {
    auto s = shown_robot(ctx, args);
    if (!s.ok()) {
      Error e = std::move(s).error();
      e.message = "no target is given, and " + e.message;
      e.hint = "Give target, or have one world show it, whose target is meant then.";
      return e;
    }
    target = target_in_mounting(ctx, *s);
    seed = s->q;
  }
  const Pose in_base = spatial::compose(spatial::inverse(m.base), *target);
  if (has(args, "seed")) {
    RMP_TRY_ASSIGN(seed, read_q(*args.find("seed"), content<Robot>(ctx, args), m.joints, "seed"));
  }
  IkBatch batch = asked.batch(args);
  batch.targets = std::span(&in_base, 1);
  batch.seeds = seed;
  const bool wants_all = flag(args, "all");
  batch.all_solutions = wants_all || asked.wish.has_value();
  const double arm_angle = has(args, "arm_angle") ? real(args, "arm_angle") : 0.0;
  if (has(args, "arm_angle")) batch.arm_angles = std::span(&arm_angle, 1);
  // Without limits a search would begin at other joint values than within them.
  std::vector<double> start = seed;
  if (start.empty()) start = robotics::start_configuration(m);
  sim::Bound<IkSolver> solver = asked.bound;
  if (asked.is_ignoring) {
    RMP_TRY_ASSIGN(solver, asked.unlimited(ctx));
    batch.seeds = start;
  }
  RMP_TRY_ASSIGN(auto results, sim::solve_ik(solver, batch, ctx.progress));
  IkResult& result = results.front();
  result.detail = asked.axes.in_text(m, result.detail);
  report_singular(m, asked.tip, kIkPose, result);
  const bool is_solved = result.status == IkStatus::solved;
  const std::size_t n = m.coordinate_count();
  std::vector<Solution> found = solutions_of(asked, result.q, start), beyond;
  std::size_t total = found.size();
  if (asked.is_ignoring) {
    for (const Solution& s : found)
      if (s.excess.joint >= 0) beyond.push_back(s);
  } else if ((is_solved && batch.all_solutions) ||
             (result.status == IkStatus::joint_limit &&
              (batch.all_solutions || asked.has_tag("closed_form") ||
               asked.counts_others(result.limiting_joint)))) {
    RMP_TRY_ASSIGN(beyond, beyond_limits(ctx, asked, batch, start,
                                         is_solved ? std::span<const Solution>(found)
                                                   : std::span<const Solution>(),
                                         total));
  }
  const std::string said_of_limits = limits_sentence(asked, beyond, total);
  if (!is_solved && !flag(args, "partial")) {
    std::string message =
        result.detail.empty() ? std::string(status_sentence(result.status)) : result.detail;
    if (!said_of_limits.empty()) message += "; " + said_of_limits;
    return error(ErrorCode::unreachable, std::move(message),
                 said_of_limits.empty()
                     ? "Move the target, or give partial = true to get the closest configuration."
                     : "Move the target, or give partial = true to get the closest configuration, "
                       "or limits = \"ignore\" to get those beyond.",
                 asked.where);
  }
  if (is_solved && asked.wish) {
    const std::vector<Solution> all = found;
    erase_other_branches(asked, found);
    if (found.empty()) return no_such_branch(asked, all, beyond);
    erase_other_branches(asked, beyond);
    if (!wants_all) found.resize(1);
  }
  Map out{{"status", status_word(result.status)}};
  const std::string unit = joint_array_unit(m);
  if (!found.empty()) out.set("q", NumericArray(found.front().q, unit));
  std::vector<double> rows;
  for (const Solution& s : found) rows.insert(rows.end(), s.q.begin(), s.q.end());
  out.set("solutions", found.empty() ? Value(List{})
                                     : Value(NumericArray(std::move(rows), found.size(), n, unit)));
  out.set("position_error", result.position_error);
  out.set("rotation_error", result.rotation_error);
  out.set("iterations", static_cast<std::int64_t>(result.iterations));
  std::string detail = result.detail;
  if (!said_of_limits.empty()) detail += (detail.empty() ? "" : "; ") + said_of_limits;
  out.set("detail", detail);
  set_reasons(out, m, result);
  if (!asked.names.empty() && !found.empty()) {
    out.set("branch", asked.names.name(found.front().measures));
    List branches;
    for (const Solution& s : found) branches.emplace_back(asked.names.name(s.measures));
    out.set("branches", std::move(branches));
  }
  if (wants_all || asked.is_ignoring || !beyond.empty()) {
    out.set("beyond_limits", static_cast<std::int64_t>(beyond.size()));
    out.set("beyond", beyond_list(asked, beyond));
  }
  if (asked.is_ignoring) {
    List within;
    for (const Solution& s : found) within.emplace_back(s.excess.joint < 0);
    out.set("within_limits", std::move(within));
  }
  out.set("provider", asked.bound.provider);
  return Value(std::move(out));
}

/// Seeds of a batch: a pose's name, one configuration, or a list of configurations.
Result<std::vector<double>> read_seeds(const Map& args, const Robot& r, const RobotModel& m) {
  std::vector<double> out;
  if (!has(args, "seed")) return out;
  const Value& given = *args.find("seed");
  const bool many =
      given.as_list() && !given.as_list()->empty() && !given.as_list()->front().is_number();
  const bool table = given.as_array() && given.as_array()->is_matrix();
  if (!many && !table) return read_q(given, r, m.joints, "seed");
  if (table) return reals(&given);
  for (const Value& one : *given.as_list()) {
    RMP_TRY_ASSIGN(const auto q, read_q(one, r, m.joints, "seed"));
    out.insert(out.end(), q.begin(), q.end());
  }
  return out;
}

/// The first of a target's solutions on the wanted branch takes the place of the answer; false
/// when there is none, and the answer says so.
bool take_branch(const Question& asked, IkResult& result) {
  std::vector<Solution> all = solutions_of(asked, result.q, {});
  std::vector<Solution> found = all;
  erase_other_branches(asked, found);
  if (found.empty()) {
    result.detail = "no solution is on the branch " + text::quote(asked.wish->words()) +
                    "; there are " + text::enumerate(branches_of(asked, all));
    result.q.resize(asked.model->coordinate_count());
    return false;
  }
  result.q = std::move(found.front().q);
  return true;
}

Result<Value> solve_ik_batch(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Question asked, Question::read(ctx, args));
  const RobotModel& m = *asked.model;
  const Pose base_T_mounting = spatial::inverse(m.base);
  std::vector<Pose> targets;
  for (const Value& v : *args.find("targets")->as_list()) {
    const auto target = pose_from(v);
    if (!target)
      return error(ErrorCode::invalid_argument,
                   "target " + std::to_string(targets.size() + 1) + " is not a pose",
                   "Give poses such as pose(0.5, 0, 0.3).", "targets");
    targets.push_back(spatial::compose(base_T_mounting, *target));
  }
  RMP_TRY_ASSIGN(auto seeds, read_seeds(args, content<Robot>(ctx, args), m));
  const std::vector<double> arm_angles = reals(args.find("arm_angle"));
  sim::Bound<IkSolver> solver = asked.bound;
  if (asked.is_ignoring) {
    RMP_TRY_ASSIGN(solver, asked.unlimited(ctx));
    if (seeds.empty()) seeds = robotics::start_configuration(m);
  }
  IkBatch batch = asked.batch(args);
  batch.targets = targets;
  batch.seeds = seeds;
  batch.arm_angles = arm_angles;
  batch.continuous = flag(args, "continuous");
  std::vector<double> first;
  if (asked.wish && batch.continuous && !targets.empty()) {
    // The path begins on the branch, and stays on it.
    IkBatch begin = batch;
    begin.targets = std::span(targets).first(1);
    if (!seeds.empty()) begin.seeds = std::span(seeds).first(m.coordinate_count());
    if (!arm_angles.empty()) begin.arm_angles = std::span(arm_angles).first(1);
    begin.all_solutions = true;
    begin.continuous = false;
    RMP_TRY_ASSIGN(auto results, sim::solve_ik(solver, begin, ctx.progress));
    IkResult& result = results.front();
    if (result.status == IkStatus::solved && !take_branch(asked, result))
      return error(ErrorCode::unreachable, "target 1: " + result.detail,
                   "Start from one of those, or move the target.", asked.where);
    if (result.status == IkStatus::solved) first = result.q;
    if (!first.empty()) batch.seeds = first;
  }
  batch.all_solutions = asked.wish && !batch.continuous;
  RMP_TRY_ASSIGN(auto results, sim::solve_ik(solver, batch, ctx.progress));
  const std::size_t n = m.coordinate_count();
  std::vector<double> q, position, rotation, shortfall;
  List status, detail, within;
  std::int64_t solved = 0;
  for (IkResult& result : results) {
    const bool is_other =
        batch.all_solutions && result.status == IkStatus::solved && !take_branch(asked, result);
    // A target without any configuration has the seed's place filled with zeros.
    if (result.q.size() >= n)
      q.insert(q.end(), result.q.begin(), result.q.begin() + static_cast<std::ptrdiff_t>(n));
    else q.insert(q.end(), n, 0.0);
    if (asked.is_ignoring) {
      const std::span<double> own = std::span(q).last(n);
      if (robotics::limit_excess(m, own).joint >= 0 && !batch.continuous)
        robotics::turn_into_limits(m, own, batch.seeds.first(std::min(n, batch.seeds.size())));
      const auto excess = robotics::limit_excess(m, own);
      within.emplace_back(excess.joint < 0);
      if (excess.joint >= 0 && result.detail.empty())
        result.detail = asked.excess_words(excess, own);
    }
    status.emplace_back(std::string(is_other ? "other_branch" : status_word(result.status)));
    detail.emplace_back(asked.axes.in_text(m, result.detail));
    position.push_back(result.position_error);
    rotation.push_back(result.rotation_error);
    shortfall.push_back(result.shortfall);
    solved += result.status == IkStatus::solved && !is_other ? 1 : 0;
  }
  Map out{{"solved", solved}};
  if (!asked.names.empty()) {
    const std::vector<double> measures = asked.names.measure(q);
    const std::size_t each = asked.names.choices().size();
    List branches, changes;
    for (std::size_t i = 0; i < results.size(); ++i)
      branches.emplace_back(asked.names.name(std::span(measures).subspan(i * each, each)));
    out.set("branches", std::move(branches));
    if (batch.continuous) {
      for (const sim::BranchChange& c : sim::branch_changes(asked.names, q, kMostNamed))
        changes.emplace_back(Map{{"target", c.at + 1}, {"from", c.from}, {"to", c.to}});
      out.set("branch_changes", std::move(changes));
    }
  }
  if (asked.is_ignoring) out.set("within_limits", std::move(within));
  out.set("q", results.empty()
                   ? Value(List{})
                   : Value(NumericArray(std::move(q), results.size(), n, joint_array_unit(m))));
  out.set("status", std::move(status));
  out.set("detail", std::move(detail));
  out.set("position_error", NumericArray(std::move(position), "m"));
  out.set("rotation_error", NumericArray(std::move(rotation), "rad"));
  out.set("shortfall", NumericArray(std::move(shortfall), "m"));
  out.set("provider", asked.bound.provider);
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(inverse_kinematics_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec tip =
      optional("tip", "string", "",
               "Name of the tip in a branched robot; by default the tool of the last link.");
  const ParamSpec provider =
      optional("provider", "any", "",
               "Name of the solver, or {name = ..., params = {...}}; by default the robot's own, "
               "otherwise a closed form that supports the robot, otherwise the default provider.");
  const ParamSpec branch = optional(
      "branch", "any", "",
      "For solvers that name branches: a text such as \"left up no flip\", or a table {shoulder = "
      "\"left\", elbow = \"up\", wrist = \"flip\"}; omitted parts may be either.");
  const ParamSpec limits =
      choice("limits", {"apply", "ignore"},
             "Joint limits; ignore also returns solutions beyond them, marked in within_limits.");
  all.push_back(
      {.name = "robot.solve_ik",
       .classic = "PRobot LLRL IKine",
       .summary = "Finds joint values that bring the tool to a pose: inverse kinematics.",
       .details =
           "The target is given in the mounting frame. A target that cannot be reached is an error "
           "of code unreachable that gives the remaining distance, unless partial = true.",
       .example = with_arm("local target = arm:fk{q = \"ready\"}.pose\nlocal s = "
                           "arm:solve_ik{target = target, seed = {0, -0.8, 0.5, 0, 0.9, "
                           "0}}\nassert(s.status == \"solved\" and s.position_error < 1e-8)"),
       .params = {self("robot"),
                  optional("target", "pose", "",
                           "Pose of the tool to reach; by default the target of the world that "
                           "shows the robot, starting at the joint values shown."),
                  optional("seed", "any", "rad or m",
                           "Joint values to start from, or the name of a pose."),
                  defaulted("all", "bool", "", false,
                            "Return every solution that the solver can distinguish."),
                  defaulted("partial", "bool", "", false,
                            "Return the closest configuration if the target cannot be reached."),
                  above_zero(defaulted("position_tolerance", "real", "m", 1e-9,
                                       "Tolerance for reaching the position.")),
                  above_zero(defaulted("rotation_tolerance", "real", "rad", 1e-9,
                                       "Tolerance for reaching the rotation.")),
                  provider, tip,
                  optional(
                      "arm_angle", "real", "rad",
                      "For 7-joint arms, with a solver tagged arm_angle: rotation of the elbow "
                      "about the line from shoulder to wrist; 0 is the plane of axis 1."),
                  branch, limits, shown_world()},
       .returns =
           {"map",
            "",
            "",
            {field("status", "string", "", "solved, out_of_reach, joint_limit or not_converged."),
             field("q", "real[]", "rad or m", "The (first) solution."),
             field("solutions", "matrix", "rad or m", "One row per solution."),
             field("position_error", "real", "m", "Remaining error of the first solution."),
             field("rotation_error", "real", "rad", "Remaining error of the first solution."),
             field("iterations", "int", "", "Iterations of the solver."),
             field(
                 "detail", "string", "",
                 "Reason if not solved, or a remark that q is close to a singular configuration."),
             field("shortfall", "real", "m",
                   "Least distance by which the target is out of reach; 0 if not known."),
             field("limiting_joint", "string", "",
                   "The joint that prevents the solution by its limit, if known."),
             field("lost_direction", "real[]", "",
                   "If q is singular or close to it: the unit twist (vx, vy, vz, wx, wy, wz) that "
                   "the tip has lost, axes of the mounting frame."),
             field("branch", "string", "",
                   "Branch of the first solution, if the solver names branches."),
             field("branches", "list", "", "Branch of each solution."),
             field("beyond_limits", "int", "",
                   "Number of solutions beyond joint limits: with all = true, a branch, limits = "
                   "\"ignore\", or if there is none within the limits."),
             field("beyond", "list", "",
                   "For each of them q, branch, the joint farthest beyond its limit, by how much, "
                   "its value and limit, and detail."),
             field("within_limits", "list", "",
                   "With limits = \"ignore\": whether each solution is within the limits."),
             field("provider", "string", "", "The solver.")}},
       .effect = Effect::reads,
       .run = solve_ik});
  all.push_back(
      {.name = "robot.solve_ik_batch",
       .classic = "",
       .summary = "Finds joint values for many poses of the tool in one call.",
       .details = "Poses are in the mounting frame. An unreachable pose is not an error: see "
                  "status and detail; q is the closest configuration found.",
       .example = with_arm("local a = arm:fk{q = \"ready\"}.pose\nlocal b = arm:fk{q = {0.1, -0.8, "
                           "0.5, 0, 0.9, 0}}.pose\nlocal s = arm:solve_ik_batch{targets = {a, b}, "
                           "seed = \"ready\"}\nassert(s.solved == 2 and #s.q == 2)"),
       .params =
           {self("robot"), needed("targets", "list", "", "Poses of the tool."),
            optional(
                "seed", "any", "rad or m",
                "Joint values to start from, the name of a pose, or a list with one per target."),
            defaulted(
                "continuous", "bool", "", false,
                "The poses are samples of one path: each search starts from the solution before."),
            optional("arm_angle", "real[]", "rad",
                     "For 7-joint arms, see robot.solve_ik: one for all targets, or one each."),
            above_zero(defaulted("position_tolerance", "real", "m", 1e-9,
                                 "Tolerance for reaching the position.")),
            above_zero(defaulted("rotation_tolerance", "real", "rad", 1e-9,
                                 "Tolerance for reaching the rotation.")),
            provider, tip, branch, limits},
       .returns = {"map",
                   "",
                   "",
                   {field("solved", "int", "", "Number of targets reached."),
                    field("q", "matrix", "rad or m", "One row per target."),
                    field("status", "list", "",
                          "Status as in robot.solve_ik, or other_branch: q is on another branch "
                          "than requested."),
                    field("detail", "list", "", "Reasons as text."),
                    field("position_error", "array", "m", "One per target."),
                    field("rotation_error", "array", "rad", "One per target."),
                    field("shortfall", "array", "m", "One per target; 0 if not known."),
                    field("branches", "list", "", "One per target, if the solver names branches."),
                    field(
                        "branch_changes", "list", "",
                        "With continuous: changes of the branch along the path: target, from, to."),
                    field("within_limits", "list", "", "With limits = \"ignore\", one per target."),
                    field("provider", "string", "", "The solver.")}},
       .effect = Effect::reads,
       .run = solve_ik_batch});
  return all;
}

}  // namespace robomosp::ioci
