// SPDX-License-Identifier: Apache-2.0
#include "ioci/world/pair_remedy.h"

#include <algorithm>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

FaultRemedy allow_pair_remedy(const Handle& world, const std::string& a, const std::string& b) {
  FaultRemedy r;
  r.label = "Allow " + a + " and " + b + " to touch";
  r.command = "world.allow_pair";
  r.args = {{"id", world}, {"a", a}, {"b", b}};
  r.untried = kUntriedHere;
  return r;
}

PairTrials::Outcome PairTrials::outcome_of(const FaultRemedy& r) {
  const auto [at, is_new] = known_.try_emplace(Value(r.args).text(), Outcome::not_tried);
  if (!is_new || known_.size() > kMostTried) return at->second;
  const auto trial = Trial::open(ctx_, ctx_.snapshot());
  if (!trial) return at->second;
  if (!trial->run(r.command, r.args).ok())
    return at->second = trial->is_over() ? Outcome::not_tried : Outcome::useless;
  const auto pairs = trial->run("world.checked_pairs", {{"id", *r.args.find("id")}});
  if (!pairs.ok()) return at->second;
  const std::string a = text_of(r.args, "a"), b = text_of(r.args, "b");
  const List& checked = *pairs->as_list();
  const bool is_checked = std::any_of(checked.begin(), checked.end(), [&](const Value& v) {
    const std::string x = text_of(*v.as_map(), "a"), y = text_of(*v.as_map(), "b");
    return (x == a && y == b) || (x == b && y == a);
  });
  return at->second = is_checked ? Outcome::useless : Outcome::helps;
}

void PairTrials::look_at(Fault& f) {
  std::erase_if(f.remedies, [&](FaultRemedy& r) {
    if (r.command != "world.allow_pair") return false;
    const Outcome outcome = outcome_of(r);
    r.is_tried = outcome == Outcome::helps;
    r.untried = r.is_tried ? "" : known_.size() > kMostTried ? kUntriedTooLong : kUntriedHere;
    return outcome == Outcome::useless;
  });
}

}  // namespace robomosp::ioci
