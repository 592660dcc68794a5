// SPDX-License-Identifier: Apache-2.0
#include "program/alone.h"

#include <algorithm>
#include <set>

#include <robomosp/sdk/program_tables.h>

#include "kernel/letters.h"
#include "kernel/text.h"
#include "program/state.h"

namespace robomosp::program {
namespace {

std::string numbers(std::span<const double> values) {
  std::string out;
  for (const double x : values) out += (out.empty() ? "" : ", ") + text::print_rounded(x);
  return "(" + out + ")";
}
std::string value_text(std::uint32_t type, const SignalValue& v) {
  if (type == RMP_TYPE_BOOL) return v.integer != 0 ? "TRUE" : "FALSE";
  return type == RMP_TYPE_REAL ? text::print_rounded(v.real) : std::to_string(v.integer);
}

class AloneWorld final : public World {
 public:
  AloneWorld(const Machine& machine, const AloneOptions& options, Operator& user)
      : machine_(machine), options_(options), user_(user) {
    for (const auto& [name, value] : options.inputs) inputs_[text::upper(name)] = value;
  }

  Result<std::optional<SignalValue>> read_signal(const Signal& s) override {
    if (s.is_output) {
      const auto at = outputs_.find(s.symbol);
      return std::optional(at == outputs_.end() ? SignalValue{} : at->second.second);
    }
    if (const auto at = inputs_.find(text::upper(s.name)); at != inputs_.end())
      return std::optional(at->second);
    return error(ErrorCode::not_found, "the input " + std::string(s.name) + " has no value",
                 "Give one (--set " + std::string(s.name) +
                     "=VALUE), or run the program in a world in which others set the signals.");
  }
  Result<void> write_signal(const Signal& s, SignalValue v) override {
    outputs_[s.symbol] = {std::string(s.name), v};
    types_[s.symbol] = s.type;
    return does(std::string(s.name) + " := " + value_text(s.type, v));
  }

  Result<void> begin_motion(const Motion& m) override {
    ++motions_;
    std::string said;
    std::optional<PlainPose>& last = last_[m.attributes.robot_symbol];
    for (const Target& t : m.targets) {
      const bool is_place =
          t.role == RMP_ROLE_POSE || t.role == RMP_ROLE_ROBTARGET || t.role == RMP_ROLE_POSITION;
      said += said.empty() ? " " : ", ";
      if (!is_place) {
        said += numbers(t.role == RMP_ROLE_ADD_JOINT ? t.additional : t.joints);
        if (t.role != RMP_ROLE_ADD_JOINT) last.reset();
        continue;
      }
      said += numbers(t.pose.position) + " mm";
      PlainPose given = t.pose;
      if (t.role == RMP_ROLE_POSITION) given.quaternion = {1, 0, 0, 0};
      if (m.is_incremental) {
        if (!last) continue;
        if (m.attributes.frame) {
          PlainPose f = *m.attributes.frame;
          f.position = {0, 0, 0};
          given = compose_poses(compose_poses(f, given), inverse_pose(f));
        }
        PlainPose p = *last;
        for (std::size_t k = 0; k < 3; ++k) p.position[k] += given.position[k];
        compose_orientations(given.quaternion.data(), last->quaternion.data(), p.quaternion.data());
        last = p;
        continue;
      }
      if (m.attributes.frame) given = compose_poses(*m.attributes.frame, given);
      if (t.role == RMP_ROLE_POSITION) {
        if (last) given.quaternion = last->quaternion;
        else continue;
      }
      last = given;
    }
    tools_[m.attributes.robot_symbol] = m.attributes.tool;
    if (m.has_until) last.reset();
    if (!options_.is_traced) return {};
    return does_at(m.span, std::string(m.is_incremental ? "MOVE_INC " : "MOVE ") +
                               std::string(code_text_detail::kMoves[m.interpolation]) + said);
  }
  Result<MotionState> motion_state(std::uint64_t) override { return MotionState::done; }
  Result<void> abort_motion(std::uint64_t, AbortReason) override { return {}; }
  Result<void> hold_motion(std::uint64_t) override { return {}; }
  Result<void> resume_motion(std::uint64_t) override { return {}; }

  Result<Target> robot_state(std::uint32_t robot, std::uint32_t) override {
    const auto at = last_.find(robot);
    if (at == last_.end() || !at->second) return needs_robot("the robot's position");
    Target out;
    out.pose = *at->second;
    return out;
  }
  Result<PlainPose> robot_flange(std::uint32_t robot, std::uint32_t) override {
    const auto at = last_.find(robot);
    if (at == last_.end() || !at->second) return needs_robot("where the robot is");
    const auto tool = tools_.find(robot);
    return tool == tools_.end() || !tool->second
               ? *at->second
               : compose_poses(*at->second, inverse_pose(*tool->second));
  }
  Result<double> robot_speed(std::uint32_t, std::uint32_t) override { return 0.0; }
  Result<Target> forward(const Target&, std::uint32_t) override { return needs_robot("TRAFO"); }
  Result<Target> inverse(const Target&, std::uint32_t) override { return needs_robot("TRAFOINV"); }

  Result<void> write_text(std::uint32_t, std::string_view piece) override {
    return user_.says(piece);
  }
  Result<std::optional<std::string>> read_line(std::uint32_t) override {
    RMP_TRY_ASSIGN(std::string line, user_.line());
    return std::optional(std::move(line));
  }
  Result<void> pause(std::uint32_t process, std::string_view message) override {
    RMP_TRY(does("PAUSE" + (message.empty() ? std::string() : " '" + std::string(message) + "'")));
    RMP_TRY(user_.pause(message));
    pauses_.insert(process);
    return {};
  }
  Result<std::string> read_file(std::string_view name) override { return user_.read_file(name); }
  Result<void> write_file(std::string_view name, std::string_view bytes, bool adds) override {
    return user_.write_file(name, bytes, adds);
  }

  /// The present line of a process, and what it does there.
  Result<void> does(const std::string& what) {
    if (!options_.is_traced) return {};
    const auto calls = machine_.call_stack(0);
    return does_at(calls.empty() ? rmp_span{} : calls.front().span, what);
  }
  Result<void> does_at(const rmp_span& at, const std::string& what) {
    const rmp_code& c = machine_.code();
    return user_.does(now, at.file < c.files.count ? row<rmp_code_file>(c.files, at.file).name : "",
                      at.line, what);
  }
  std::set<std::uint32_t> take_pauses() { return std::exchange(pauses_, {}); }
  [[nodiscard]] std::uint64_t motions() const { return motions_; }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> outputs() const {
    std::vector<std::pair<std::string, std::string>> out;
    for (const auto& [symbol, set] : outputs_)
      out.emplace_back(set.first, value_text(types_.at(symbol), set.second));
    return out;
  }
  double now = 0;

 private:
  static Error needs_robot(const std::string& what) {
    return error(
        ErrorCode::unsupported, what + " is unknown without a robot",
        "Run the program with one (--robot NAME), or in a served world (--connect ADDRESS).");
  }
  const Machine& machine_;
  const AloneOptions& options_;
  Operator& user_;
  std::map<std::string, SignalValue> inputs_;
  std::map<std::uint32_t, std::pair<std::string, SignalValue>> outputs_;
  std::map<std::uint32_t, std::uint32_t> types_;
  std::map<std::uint32_t, std::optional<PlainPose>> last_;   ///< base_T_tool, by robot
  std::map<std::uint32_t, std::optional<PlainPose>> tools_;  ///< flange_T_tool of that motion
  std::set<std::uint32_t> pauses_;
  std::uint64_t motions_ = 0;
};

Error waits_for_ever(const Machine& machine, const Wait& w) {
  const rmp_code& c = machine.code();
  std::string signals;
  for (const std::uint32_t s : w.signals)
    signals += (signals.empty() ? "" : ", ") + std::string(row<rmp_code_symbol>(c.symbols, s).name);
  const std::string where = w.span.file < c.files.count
                                ? std::string(row<rmp_code_file>(c.files, w.span.file).name) + ":" +
                                      std::to_string(w.span.line) + ":" +
                                      std::to_string(w.span.column)
                                : std::string();
  if (w.kind == WaitKind::semaphore)
    return error(ErrorCode::script_failed, "the semaphore is never released",
                 "RELEASE it in another process.", where);
  if (w.kind == WaitKind::stopped)
    return error(ErrorCode::script_failed,
                 "the process is stopped, and no other process can continue it", "CONTINUE it.",
                 where);
  return error(ErrorCode::script_failed,
               "the condition never comes true" +
                   (signals.empty() ? std::string() : ", since nothing changes " + signals),
               signals.empty() ? "Give the wait a TIMEOUT."
                               : "Give other values (--set), or run the program in a world in "
                                 "which others set the signals.",
               where);
}

}  // namespace

Result<Ended> run_alone(std::shared_ptr<const CompiledProgram> program, const AloneOptions& options,
                        Operator& user, const Progress& progress) {
  RMP_TRY_ASSIGN(Machine machine, Machine::load(std::move(program), options.limits));
  const rmp_code& c = machine.code();
  for (const auto& [name, value] : options.inputs) {
    std::vector<std::string> known;
    bool is_known = false;
    for (std::uint32_t s = 0; s < c.symbols.count; ++s) {
      const auto& x = row<rmp_code_symbol>(c.symbols, s);
      if (x.kind != RMP_SYMBOL_INPUT) continue;
      known.emplace_back(x.name);
      if (text::upper(x.name) != text::upper(name)) continue;
      RMP_TRY(fits_signal(x, value));
      is_known = true;
    }
    if (is_known) continue;
    return error(ErrorCode::unknown_name, "the program has no input " + text::quote(name),
                 known.empty() ? "It declares none." : "It has " + text::enumerate(known) + ".");
  }
  RMP_TRY_ASSIGN(Presets presets, Presets::make(machine, options.values));
  AloneWorld world(machine, options, user);
  Ended out;
  for (;;) {
    if (progress.cancelled()) return error(ErrorCode::cancelled, "the program was interrupted");
    const Status& s = machine.run(world.now, world);
    if (s.state == RunState::fault) {
      const Fault& f = *s.fault;
      return error(
          ErrorCode::script_failed, f.message, f.hint,
          f.file + ":" + std::to_string(f.span.line) + ":" + std::to_string(f.span.column));
    }
    if (s.state == RunState::over) {
      out.is_halted = s.is_halted;
      break;
    }
    if (s.state == RunState::stopped) {
      RMP_TRY_ASSIGN(const bool is_given, presets.give(machine));
      if (!is_given) return error(ErrorCode::internal, "the program stopped for no known reason");
      continue;
    }
    if (s.state != RunState::waiting) continue;
    bool goes_on = false;
    for (const std::uint32_t process : world.take_pauses())
      goes_on = machine.resume_pause(process) || goes_on;
    std::optional<double> next;
    for (const Wait& w : s.waits) {
      // Motions are done at once; the machine has to be asked again to see it.
      if (w.kind == WaitKind::motion || w.kind == WaitKind::pause) goes_on = true;
      if (w.until) next = next ? std::min(*next, *w.until) : *w.until;
    }
    if (goes_on) continue;
    if (!next) {
      for (const Wait& w : s.waits)
        if (w.kind != WaitKind::interrupt) return waits_for_ever(machine, w);
      return error(ErrorCode::script_failed, "the program waits for an event that never occurs",
                   "Run it in a world.");
    }
    if (options.is_traced)
      RMP_TRY(world.does("WAIT until t = " + text::print_rounded(*next) + " s"));
    world.now = std::max(world.now, *next);
    RMP_TRY(user.time(world.now));
  }
  out.time = world.now;
  out.instructions = machine.instructions();
  out.motions = world.motions();
  out.outputs = world.outputs();
  return out;
}

}  // namespace robomosp::program
