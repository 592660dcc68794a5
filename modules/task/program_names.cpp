// SPDX-License-Identifier: Apache-2.0
// What the names of a program mean in its world: bindings, and what goes without.
#include <algorithm>
#include <cctype>
#include <numbers>
#include <set>

#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/program_turns.h>

#include "kernel/text.h"
#include "robotics/maker_axes.h"
#include "robotics/single_joints.h"
#include "task/members.h"
#include "task/program_actor.h"

namespace robomosp::task {
namespace {

using model::BindingKind;
using text::quote;

constexpr double kDegreesOfRadian = 180 / std::numbers::pi;

bool same(std::string_view a, std::string_view b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
           return std::tolower(static_cast<unsigned char>(x)) ==
                  std::tolower(static_cast<unsigned char>(y));
         });
}

const rmp_code_symbol& symbol(const rmp_code& c, std::uint32_t i) {
  return *static_cast<const rmp_code_symbol*>(rmp_row(&c.symbols, i));
}

/// Whether motions of a program say by number which robot they are of.
bool names_devices(const rmp_code& c) {
  for (std::uint32_t k = 0; k < c.instructions.count; ++k) {
    const auto& i = *static_cast<const rmp_code_instruction*>(rmp_row(&c.instructions, k));
    if (i.op == RMP_OP_ATTRIBUTE && i.b.kind == RMP_OPERAND_WORD && i.b.index == RMP_ATTR_DEVICE)
      return true;
  }
  return false;
}

}  // namespace

std::optional<CountedJoint> ProgramActor::maker_counts(const TaskExecutor::Actor& robot,
                                                       std::size_t joint, std::string* name) {
  const auto axes = robotics::MakerAxes::of(*robot.record);
  const PostAxis* a = axes.ok() ? axes->of_entry(joint) : nullptr;
  if (!a || !a->coupled.empty() || a->sign == 0) return std::nullopt;
  if (name) *name = a->name;
  // Of a joint in its own unit, whichever the maker's is.
  const double unit = TaskExecutor::is_rotary(robot, joint) ? kDegreesOfRadian : 1000.0;
  return CountedJoint{a->sign * axis_scale(*a, nullptr) / unit, a->offset};
}

void ProgramActor::bind_external_axes(const rmp_code& c, const TaskExecutor::Actor& robot,
                                      std::size_t actor, Names& names) {
  const auto axes = robotics::MakerAxes::of(*robot.record);
  if (!axes.ok() || !axes->known()) return;
  std::vector<std::size_t> joints;
  for (const PostAxis& a : axes->axes())
    if (a.external) joints.push_back(static_cast<std::size_t>(std::max(0, a.joint)));
  std::size_t main = 0, greatest = 0;
  for (std::uint32_t i = 0; i < c.types.count; ++i) {
    const auto& t = *static_cast<const rmp_code_type*>(rmp_row(&c.types, i));
    if (t.role == RMP_ROLE_MAIN_JOINT) main = t.field_count;
  }
  for (const std::size_t j : joints) greatest = std::max(greatest, j + 1);
  if (joints.empty() || greatest != joints.size() ||
      main + joints.size() != robot.model->joints.size() ||
      !robotics::why_not_single_joints(*robot.model).empty())
    return;
  for (const auto& [number, use] : names.joints)
    if (!use.is_grip && use.at == actor) return;  // bound by the user
  for (std::size_t k = 0; k < joints.size(); ++k)
    if (names.joints.contains(k + 1)) return;
  for (std::size_t k = 0; k < joints.size(); ++k) names.joints[k + 1] = {false, actor, joints[k]};
}

Result<ProgramActor> ProgramActor::create(const TaskExecutor& x, ProgramInWorld wanted,
                                          std::vector<std::string>& notes) {
  const model::PlacedProgram& placed = wanted.placement;
  const rmp_code& c = wanted.code->code();
  const std::string where = "program " + quote(placed.name);
  auto names = std::make_shared<Names>();
  names->name = placed.name;
  names->moves_flange = wanted.moves_flange;
  names->is_on_carriage = wanted.is_on_carriage;
  names->has_no_additional = cell_number(c, "R_NADDJ", 1) == 0;
  const auto known_actor = [&](const std::string& name) -> Result<std::size_t> {
    RMP_TRY_ASSIGN(const std::size_t at, find_member(x.actor_of_, name, "robot"));
    return at;
  };
  const auto check = [&](const RobotUse& use) -> Result<void> {
    if (!use.frame.empty()) RMP_TRY(x.frame(use.frame, 0));
    std::string point;
    if (!use.tool.empty() && !x.thing_of(use.tool, point))
      RMP_TRY(x.grip(x.actors_[use.actor], use.tool));
    return {};
  };
  // Its own robot: the binding without a name, what it is placed with, or the only one.
  const auto of = [&](BindingKind kind, std::string_view name) -> const model::ProgramBinding* {
    for (const model::ProgramBinding& b : placed.bindings)
      if (b.kind == kind && same(b.name, name)) return &b;
    return nullptr;
  };
  const auto use_of = [&](const model::ProgramBinding& b) -> Result<RobotUse> {
    RobotUse use;
    const std::string& to = b.to.empty() ? placed.robot : b.to;
    if (to.empty() && x.actors_.size() != 1)
      return error(ErrorCode::invalid_argument,
                   "the binding of " + (b.name.empty() ? "its robot" : quote(b.name)) +
                       " names no robot, but the world has " + std::to_string(x.actors_.size()),
                   "Give the binding to = a robot of the world.", where);
    auto at = to.empty() ? Result<std::size_t>(std::size_t{0}) : known_actor(to);
    if (!at.ok()) return std::move(at).error().in(where);
    use.actor = *at;
    use.frame = b.frame, use.tool = b.tool;
    auto checked = check(use);
    if (!checked.ok()) return std::move(checked).error().in(where);
    return use;
  };
  if (const auto* b = of(BindingKind::robot, "")) {
    RMP_TRY_ASSIGN(names->own, use_of(*b));
  } else if (!placed.robot.empty()) {
    auto at = known_actor(placed.robot);
    if (!at.ok()) return std::move(at).error().in(where);
    names->own = RobotUse{*at, {}, {}};
  } else if (x.actors_.size() == 1) {
    names->own = RobotUse{0, {}, {}};
  }
  std::vector<const model::ProgramBinding*> used;
  for (std::uint32_t i = 0; i < c.symbols.count; ++i) {
    const rmp_code_symbol& s = symbol(c, i);
    if (s.kind == RMP_SYMBOL_ROBOT) {
      const std::string number = std::to_string(names->robots.size() + 1);
      const auto* b = of(BindingKind::robot, s.name);
      if (!b) b = of(BindingKind::robot, number);
      if (b) {
        used.push_back(b);
        RMP_TRY_ASSIGN(names->robots[i], use_of(*b));
        continue;
      }
      const auto at = std::find_if(x.actors_.begin(), x.actors_.end(),
                                   [&](const auto& a) { return same(a.placed->name, s.name); });
      if (at != x.actors_.end())
        names->robots[i] = {static_cast<std::size_t>(at - x.actors_.begin()), {}, {}};
      else if (names->own) names->robots[i] = *names->own;
    }
  }
  if (!names->own && names->robots.size() == 1) names->own = names->robots.begin()->second;
  const auto grip_of = [&](const model::ProgramBinding* b) -> Result<std::size_t> {
    GripUse g;
    if (b && !b->joint.empty()) {
      RMP_TRY_ASSIGN(g.robot.actor, known_actor(b->joint));
    } else if (names->own) {
      g.robot = *names->own;
    } else {
      return error(ErrorCode::invalid_argument,
                   "the grip " + (b ? quote(b->name) : std::string("of the program")) +
                       " belongs to no robot: the world has " + std::to_string(x.actors_.size()),
                   "Give the program its robot: program.bind{kind = \"robot\", to = ...}.", where);
    }
    if (b && !b->tool.empty()) g.robot.tool = b->tool;
    auto checked = check(g.robot);
    if (!checked.ok()) return std::move(checked).error().in(where);
    g.reach = b && b->reach > 0 ? b->reach : TaskExecutor::kReach;
    if (b && !b->to.empty()) {
      auto at = find_member(x.thing_of_, b->to, "object");
      if (!at.ok()) return std::move(at).error().in(where);
      g.object = b->to;
    }
    names->grips.push_back(std::move(g));
    return names->grips.size() - 1;
  };
  std::vector<std::string> unbound, known;
  for (std::uint32_t i = 0; i < c.symbols.count; ++i) {
    const rmp_code_symbol& s = symbol(c, i);
    if (s.kind != RMP_SYMBOL_INPUT && s.kind != RMP_SYMBOL_OUTPUT) continue;
    known.emplace_back(s.name);
    SignalUse use;
    if (const auto* b = of(BindingKind::grip, s.name)) {
      used.push_back(b);
      if (s.kind != RMP_SYMBOL_OUTPUT || s.type == RMP_TYPE_REAL)
        return error(
            ErrorCode::invalid_argument,
            "signal " + quote(s.name) + " cannot grip: it is not an output of type BOOL or INT",
            "Bind an output.", where);
      use.kind = SignalUse::grip;
      RMP_TRY_ASSIGN(use.at, grip_of(b));
    } else if (const auto* bound = of(BindingKind::task, s.name)) {
      used.push_back(bound);
      if (s.type != RMP_TYPE_BOOL)
        return error(ErrorCode::invalid_argument,
                     "signal " + quote(s.name) + " is not a BOOL and cannot start a task",
                     "Bind a BOOL output that starts it, or a BOOL input that reports its end.",
                     where);
      auto task = find_member(x.task_of_, bound->to, "task");
      if (!task.ok()) return std::move(task).error().in(where);
      use.kind = SignalUse::task;
      use.at = *task;
      names->tasks.insert(use.at);
    } else if (const auto* own = of(BindingKind::free, s.name)) {
      used.push_back(own);
      auto fits = program::fits_signal(s, own->value);
      if (!fits.ok()) return std::move(fits).error().in(where);
      use.value = own->value;
    } else {
      const auto* to = of(BindingKind::signal, s.name);
      const std::string wanted_name = to ? to->to : s.name;
      const auto wire = std::find_if(x.wires_.begin(), x.wires_.end(), [&](const auto& w) {
        return to ? w.signal->name == wanted_name : same(w.signal->name, wanted_name);
      });
      if (to) used.push_back(to);
      if (wire != x.wires_.end()) {
        use.kind = SignalUse::wire;
        use.at = static_cast<std::size_t>(wire - x.wires_.begin());
      } else if (to) {
        return find_member(x.wire_of_, wanted_name, "signal").error().in(where);
      } else if (s.kind == RMP_SYMBOL_OUTPUT && s.type == RMP_TYPE_BOOL &&
                 same(s.name, "gripper")) {
        use.kind = SignalUse::grip;
        RMP_TRY_ASSIGN(use.at, grip_of(nullptr));
      } else if (!wanted.frees_unbound) {
        unbound.emplace_back(s.name);
      } else {
        notes.push_back(where + ": " + s.name + " is not bound" +
                        (s.kind == RMP_SYMBOL_INPUT ? " and stays at 0" : ""));
      }
    }
    names->signals[i] = use;
  }
  if (!unbound.empty())
    return error(ErrorCode::invalid_argument,
                 "the world has no signal for " + text::enumerate(unbound) + " of the program",
                 "Bind one with program.bind, create one of that name with world.add_signal, or "
                 "use kind = \"free\" to leave it to the program.",
                 where);
  for (const model::ProgramBinding& b : placed.bindings) {
    if (gives_value(b.kind)) continue;  // the compiled program has it
    if (b.kind == BindingKind::joint || (b.kind == BindingKind::grip && text::read_int(b.name))) {
      const auto number = text::read_int(b.name);
      if (!number || *number < 1 || *number > 100)
        return error(ErrorCode::invalid_argument,
                     quote(b.name) + " is not a number of an additional joint",
                     "They are numbered from 1.", where);
      JointUse use;
      use.is_grip = b.kind == BindingKind::grip;
      if (use.is_grip) {
        RMP_TRY_ASSIGN(use.at, grip_of(&b));
      } else {
        auto at = known_actor(b.to);
        if (!at.ok()) return std::move(at).error().in(where);
        use.at = *at;
        const auto& joints = x.actors_[use.at].model->joints;
        const auto joint_number = text::read_int(b.joint);
        const auto found = std::find_if(joints.begin(), joints.end(),
                                        [&](const JointModel& j) { return j.name == b.joint; });
        const PostAxis* const axis = x.actors_[use.at].maker->find(b.joint);
        if (found != joints.end()) use.joint = static_cast<std::size_t>(found - joints.begin());
        else if (axis && axis->coupled.empty()) use.joint = static_cast<std::size_t>(axis->joint);
        else if (b.joint.empty()) use.joint = 0;
        else if (joint_number && *joint_number >= 1 &&
                 *joint_number <= static_cast<std::int64_t>(joints.size()))
          use.joint = static_cast<std::size_t>(*joint_number - 1);
        else
          return error(ErrorCode::unknown_name,
                       "robot " + quote(b.to) + " has no joint " + quote(b.joint),
                       "It has " + std::to_string(joints.size()) + ", numbered from 1.", where);
        if (const std::string why = robotics::why_not_single_joints(*x.actors_[use.at].model);
            !why.empty())
          return error(
              ErrorCode::unsupported,
              "robot " + quote(b.to) + ": " + why + ", and it cannot be an additional axis",
              "Bind another robot.", where);
      }
      names->joints[static_cast<std::size_t>(*number)] = use;
      continue;
    }
    if (b.kind == BindingKind::robot) {
      const auto number = text::read_int(b.name);
      const auto robots = static_cast<std::int64_t>(names->robots.size());
      if (b.name.empty() || (number && (names_devices(c) || (*number >= 1 && *number <= robots))) ||
          std::find(used.begin(), used.end(), &b) != used.end())
        continue;
      if (number)
        return error(ErrorCode::unknown_name,
                     "it has no ROBOT number " + b.name + ", and no motion names a DEVICE",
                     robots == 0 ? "Bind its own robot without a name."
                                 : "It has " + std::to_string(robots) + ", numbered from 1.",
                     where);
      return error(ErrorCode::unknown_name, "it has no robot " + quote(b.name),
                   "Give the name or number of a ROBOT of its cell, or none for its own robot.",
                   where);
    }
    if (std::find(used.begin(), used.end(), &b) == used.end())
      return error(ErrorCode::unknown_name,
                   "it has no signal " + quote(b.name) + " to bind as " + quote(to_string(b.kind)),
                   known.empty() ? "It has none." : "It has " + text::enumerate(known) + ".",
                   where);
  }
  if (names->own) bind_external_axes(c, x.actors_[names->own->actor], names->own->actor, *names);
  // By convention the first additional joint is a gripper: 0 is open, 1 is shut.
  if (!names->joints.contains(1) && names->own) {
    JointUse use;
    use.is_grip = true;
    RMP_TRY_ASSIGN(use.at, grip_of(nullptr));
    names->joints[1] = use;
  }
  // Joints of a program's own robots that are additional ones stand before the chain: a rail.
  std::set<std::size_t> movers;
  if (names->own) movers.insert(names->own->actor);
  for (const auto& [robot_symbol, use] : names->robots) movers.insert(use.actor);
  for (const std::size_t mover : movers) {
    std::set<std::size_t> bound;
    for (const auto& [number, use] : names->joints)
      if (!use.is_grip && use.at == mover) bound.insert(use.joint);
    if (bound.empty()) continue;
    const RobotModel& model = *x.actors_[mover].model;
    if (*bound.rbegin() + 1 != bound.size() || bound.size() >= model.joints.size() ||
        !model.is_serial())
      return error(ErrorCode::unsupported,
                   "additional joints of robot " + quote(x.actors_[mover].placed->name) +
                       " are not the first ones of its chain",
                   "Bind its rail, starting at joint 1, and leave the arm to the program's robot.",
                   where);
    names->rails[mover] = bound.size();
  }
  for (const model::ProgramBinding& b : placed.bindings)
    if (const auto number = text::read_int(b.name); number && b.kind == BindingKind::robot) {
      RMP_TRY_ASSIGN(names->devices[*number], use_of(b));
    }
  std::int64_t number_of_robot = 0;
  for (const auto& [robot_symbol, use] : names->robots)
    names->devices.try_emplace(++number_of_robot, use);
  for (const auto& [number, use] : names->joints) {
    if (use.is_grip) continue;
    const auto given = wanted.counted.find(number);
    std::optional<CountedJoint> count;
    if (given != wanted.counted.end()) count = given->second;
    else if (counts_maker_axes(c)) count = maker_counts(x.actors_[use.at], use.joint);
    if (count) names->counted[number] = *count;
  }
  auto machine = program::Machine::load(wanted.code);
  if (!machine.ok()) return std::move(machine).error().in(where);
  auto presets = program::Presets::make(*machine, wanted.values);
  if (!presets.ok()) return std::move(presets).error().in(where);
  ProgramActor out(std::move(names), std::move(*machine));
  out.presets_ = std::move(*presets);
  out.own_lines_ = std::move(wanted.lines);
  out.files_ = std::move(wanted.files);
  out.taken_.resize(out.names_->grips.size());
  if (wanted.inspection) {
    out.inspection_ = std::move(wanted.inspection);
    out.machine_.keep_journal();
    for (const auto& [number, use] : out.names_->joints)
      if (!use.is_grip) out.inspection_->additional.push_back(use.at);
    for (const auto& a : x.actors_)
      out.inspection_->robots.push_back(
          {a.placed->name, a.model, a.world_T_base, a.record->ik, a.maker});
  }
  return out;
}

}  // namespace robomosp::task
