// SPDX-License-Identifier: Apache-2.0
// What of a run is shown to those outside of it, and what they may change.
#include "robotics/grip.h"
#include "spatial/pose.h"
#include "task/task_executor.h"

namespace robomosp::task {

std::vector<std::pair<std::string, double>> TaskExecutor::signals() const {
  std::vector<std::pair<std::string, double>> out;
  for (const Wire& w : wires_) out.emplace_back(w.signal->name, w.history.back().second);
  return out;
}

bool TaskExecutor::set_signal(const std::string& name, double value, double t) {
  const auto it = wire_of_.find(name);
  if (it == wire_of_.end()) return false;
  set_wire(it->second, value, t);
  return true;
}

std::vector<std::pair<std::string, std::vector<double>>> TaskExecutor::joints(double t) const {
  std::vector<std::pair<std::string, std::vector<double>>> out;
  for (const Actor& a : actors_)
    if (can_move(a)) out.emplace_back(a.placed->name, sample(a, t).q);
  return out;
}

std::vector<TaskExecutor::Carried> TaskExecutor::carried() const {
  std::vector<Carried> out;
  for (const Thing& thing : things_) {
    // What was held from the beginning is no news until it is released.
    if (thing.history.size() == 1) continue;
    const Held& h = thing.history.back();
    Carried c{thing.placed->name, h.from, {}, {}, h.pose};
    if (h.is_held) {
      const Actor& a = actors_[h.actor];
      const auto take = [&](const std::string& link) {
        const auto at = robotics::find_grip(*a.record, *a.model, link);
        if (!at || at->joint != h.joint) return false;
        c.robot = a.placed->name;
        c.link = link;
        c.pose = spatial::compose(spatial::inverse(at->joint_T_link), h.pose);
        return true;
      };
      bool is_found = take("");
      for (std::size_t i = a.record->links.size(); i-- > 0 && !is_found;)
        is_found = take(a.record->links[i].name);
      if (!is_found) c.pose = pose_of(thing, h.from);
    }
    out.push_back(std::move(c));
  }
  return out;
}

}  // namespace robomosp::task
