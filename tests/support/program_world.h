// SPDX-License-Identifier: Apache-2.0
// A world for programs in tests: motions have a given duration, signals have values, texts are
// stored.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "program/machine.h"

namespace robomosp::program::testing {

class TestWorld : public World {
 public:
  double now = 0;
  double motion_seconds = 1;  ///< of each motion
  double braking = 0;         ///< of an aborted one
  std::map<std::string, SignalValue> inputs;
  std::map<std::string, SignalValue> outputs;
  std::vector<std::pair<std::string, std::int64_t>> writes;
  std::vector<double> write_times;
  std::vector<Motion> motions;
  std::vector<double> begun;
  std::map<std::uint64_t, double> ends;
  std::vector<std::pair<std::uint64_t, AbortReason>> aborted;
  std::vector<std::uint64_t> held, resumed;
  std::string text;
  std::vector<std::string> pauses, lines;
  std::map<std::string, std::string> files;
  Target state;
  bool inputs_are_known = true;

  Result<std::optional<SignalValue>> read_signal(const Signal& s) override {
    const auto& from = s.is_output ? outputs : inputs;
    const auto found = from.find(std::string(s.name));
    if (found != from.end()) return std::optional(found->second);
    if (inputs_are_known) return std::optional(SignalValue{});
    return std::optional<SignalValue>();
  }
  Result<void> write_signal(const Signal& s, SignalValue v) override {
    outputs[std::string(s.name)] = v;
    writes.emplace_back(std::string(s.name), v.integer);
    write_times.push_back(now);
    return {};
  }
  Result<void> begin_motion(const Motion& m) override {
    motions.push_back(m);
    begun.push_back(now);
    const double from = m.after && ends.count(m.after) ? std::max(now, ends[m.after]) : now;
    ends[m.number] = from + motion_seconds;
    return {};
  }
  Result<MotionState> motion_state(std::uint64_t n) override {
    if (!ends.count(n)) return error(ErrorCode::internal, "no such motion");
    return now >= ends[n] ? MotionState::done : MotionState::running;
  }
  Result<void> abort_motion(std::uint64_t n, AbortReason r) override {
    aborted.emplace_back(n, r);
    ends[n] = std::min(ends[n], now + braking);
    return {};
  }
  Result<void> hold_motion(std::uint64_t n) override {
    held.push_back(n);
    ends[n] += 1e6;
    return {};
  }
  Result<void> resume_motion(std::uint64_t n) override {
    resumed.push_back(n);
    ends[n] -= 1e6;
    return {};
  }
  Result<Target> robot_state(std::uint32_t, std::uint32_t) override { return state; }
  Result<PlainPose> robot_flange(std::uint32_t, std::uint32_t) override {
    PlainPose out;
    out.position = {1, 2, 3};
    return out;
  }
  Result<double> robot_speed(std::uint32_t, std::uint32_t) override { return 12.5; }
  Result<Target> forward(const Target& t, std::uint32_t) override {
    Target out;
    out.pose.position = {t.joints.empty() ? 0 : t.joints[0], 1, 2};
    out.additional = t.additional;
    return out;
  }
  Result<Target> inverse(const Target& t, std::uint32_t) override {
    if (t.pose.position[0] > 1000)
      return error(ErrorCode::unreachable, "the target is out of reach", "Move it nearer.");
    Target out;
    out.joints = {t.pose.position[0]};
    return out;
  }
  Result<void> write_text(std::uint32_t, std::string_view s) override {
    text += s;
    return {};
  }
  Result<std::optional<std::string>> read_line(std::uint32_t) override {
    if (lines.empty()) return std::optional<std::string>();
    std::string l = lines.front();
    lines.erase(lines.begin());
    return std::optional(l);
  }
  Result<void> pause(std::uint32_t, std::string_view m) override {
    pauses.emplace_back(m);
    return {};
  }
  Result<std::string> read_file(std::string_view name) override {
    const auto found = files.find(std::string(name));
    if (found != files.end()) return found->second;
    return error(ErrorCode::not_found, "there is no file \"" + std::string(name) + "\"");
  }
  Result<void> write_file(std::string_view name, std::string_view bytes, bool adds) override {
    std::string& f = files[std::string(name)];
    f = adds ? f + std::string(bytes) : std::string(bytes);
    return {};
  }
};

struct File {
  std::string name, text;
};
inline std::shared_ptr<const CompiledProgram> compiled(const std::vector<File>& files) {
  std::vector<SourceFile> all;
  for (const File& f : files) all.push_back({f.name, f.text, {}});
  NoProgress progress;
  auto made = irl::compile(all, progress);
  if (!made.ok()) {
    ADD_FAILURE() << made.error().sentence();
    return nullptr;
  }
  for (const rmp_code_fault& f : (*made)->faults)
    if (f.severity == RMP_FAULT_ERROR)
      ADD_FAILURE() << f.span.line << ":" << f.span.column << " " << f.message << "\n"
                    << files[0].text;
  return std::shared_ptr<const CompiledProgram>(std::move(made).value());
}
inline std::shared_ptr<const CompiledProgram> compiled(const std::string& text) {
  return compiled(std::vector<File>{{"p.irl", text}});
}
inline Machine loaded(const std::string& text, const Limits& limits = {}) {
  auto m = Machine::load(compiled(text), limits);
  EXPECT_TRUE(m.ok()) << (m.ok() ? "" : m.error().sentence());
  return std::move(m).value();
}
/// Runs to the end, in steps of 10 ms.
inline const Status& run_to_end(Machine& m, TestWorld& w, double most = 1000) {
  for (;;) {
    const Status& s = m.run(w.now, w);
    if (s.state != RunState::waiting && s.state != RunState::busy) return s;
    if (w.now > most) return s;
    w.now += 0.01;
  }
}
inline std::string fault_of(const Status& s) {
  return s.fault ? s.fault->sentence() : std::string();
}

}  // namespace robomosp::program::testing
