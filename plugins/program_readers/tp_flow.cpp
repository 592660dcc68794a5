// SPDX-License-Identifier: Apache-2.0
#include "tp_flow.h"

#include <bit>
#include <deque>
#include <utility>

namespace robomosp::readers {
namespace {

constexpr std::int64_t kMostNumbers = 60;
/// Programs that call each other in circles settle within a few rounds, one for each call deep.
constexpr int kMostRounds = 64;

constexpr std::uint64_t TpState::*kTpSettings[] = {&TpState::frame, &TpState::tool, &TpState::skip,
                                                   &TpState::offset, &TpState::tool_offset};

/// Adds what may come from another place; true = there is more than before.
bool joined(TpState& to, const TpState& from) {
  const TpState before = to;
  for (const auto setting : kTpSettings) to.*setting |= from.*setting;
  return !(to == before);
}
bool is_reached(const TpState& s) { return s.frame != 0; }

}  // namespace

std::uint64_t tp_bit(std::int64_t number) {
  return number >= 0 && number < kMostNumbers ? std::uint64_t{1} << number : kTpComputed;
}
std::optional<std::int64_t> tp_only(std::uint64_t numbers) {
  if (!std::has_single_bit(numbers) || (numbers & (kTpComputed | kTpBefore)) != 0)
    return std::nullopt;
  return std::countr_zero(numbers);
}

void TpFlow::add(std::string name, std::vector<TpStep> steps) {
  if (listings_.empty()) first_ = name;
  Listing& l = listings_[std::move(name)];
  l.steps = std::move(steps);
  l.before.assign(l.steps.size() + 1, {});
}

TpState TpFlow::behind_calls(const TpStep& step, TpState state) const {
  for (const std::string& name : step.calls) {
    const auto it = listings_.find(name);
    if (it == listings_.end()) continue;  // not among the files, which is a fault already
    const TpState& exit = it->second.exit;
    TpState after = state;
    for (const auto setting : {&TpState::frame, &TpState::tool}) {
      after.*setting = exit.*setting & ~kTpBefore;
      if ((exit.*setting & kTpBefore) != 0) after.*setting |= state.*setting;
    }
    if (step.is_conditional) joined(after, state);
    state = after;
  }
  return state;
}

TpState TpFlow::run(Listing& l, const TpState& entry) {
  const std::size_t n = l.steps.size();
  l.before.assign(n + 1, {});
  TpState anywhere;  // what computed jumps bring to each label
  std::vector<std::size_t> labels;
  for (std::size_t i = 0; i < n; ++i)
    if (l.steps[i].is_label) labels.push_back(i);
  std::deque<std::size_t> work;
  std::vector<bool> is_waiting(n + 1, false);
  const auto reach = [&](std::size_t i, const TpState& s) {
    if (i > n || !joined(l.before[i], s) || i == n || is_waiting[i]) return;
    is_waiting[i] = true;
    work.push_back(i);
  };
  TpState exit;
  reach(0, entry);
  while (!work.empty()) {
    const std::size_t i = work.front();
    work.pop_front();
    is_waiting[i] = false;
    const TpStep& step = l.steps[i];
    TpState s = behind_calls(step, l.before[i]);
    if (!step.calls.empty() && !is_reached(s)) continue;  // what it calls does not come back
    if (step.frame) s.frame = *step.frame;
    if (step.tool) s.tool = *step.tool;
    if (step.skip) s.skip = *step.skip;
    if (step.offset) s.offset = *step.offset;
    if (step.tool_offset) s.tool_offset = *step.tool_offset;
    const auto taught = [](std::uint64_t& active, std::uint64_t number) {
      if (number != 0 && (active & (number | kTpBefore | kTpComputed)) != 0) active = number;
    };
    taught(s.frame, step.taught_frame);
    taught(s.tool, step.taught_tool);
    for (const std::size_t t : step.to) reach(t, s);
    if (step.jumps_anywhere && joined(anywhere, s))
      for (const std::size_t t : labels) reach(t, anywhere);
    if (step.goes_on) reach(i + 1, s);
    if (step.returns) joined(exit, s);
  }
  joined(exit, l.before[n]);
  return exit;
}

void TpFlow::solve() {
  if (listings_.empty()) return;
  const TpState unknown{kTpBefore, kTpBefore, kTpBefore, kTpBefore, kTpBefore};
  // What each program does to what it finds, whoever calls it.
  bool changes = true;
  for (int round = 0; changes && round < kMostRounds; ++round) {
    changes = false;
    for (auto& [name, l] : listings_) {
      const TpState exit = run(l, unknown);
      changes = joined(l.exit, exit) || changes;
    }
  }
  // What each finds where it is called.
  listings_[first_].entry = unknown;
  changes = true;
  for (int round = 0; changes && round < kMostRounds; ++round) {
    changes = false;
    for (auto& [name, l] : listings_) {
      if (!is_reached(l.entry)) continue;
      (void)run(l, l.entry);
      for (std::size_t i = 0; i < l.steps.size(); ++i) {
        TpState found = l.before[i];
        if (!is_reached(found)) continue;
        found.skip = found.offset = found.tool_offset = kTpBefore;  // a program has its own
        for (const std::string& called : l.steps[i].calls)
          if (const auto it = listings_.find(called); it != listings_.end())
            changes = joined(it->second.entry, found) || changes;
      }
    }
  }
}

TpState TpFlow::before(const std::string& program, std::size_t step) const {
  const auto it = listings_.find(program);
  return it == listings_.end() || step >= it->second.before.size() ? TpState{}
                                                                   : it->second.before[step];
}

}  // namespace robomosp::readers
