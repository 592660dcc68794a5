// SPDX-License-Identifier: Apache-2.0
// Which records a record refers to; included by records.h only.
#pragma once

namespace robomosp::model {

template <class Fn>
void for_each_reference(const Body& body, Fn&& fn) {
  const auto call = [&fn](AnyId id, std::string_view field) {
    if (id) fn(id, field);
  };
  struct Visitor {
    decltype(call)& see;
    void operator()(const Material&) const {}
    void operator()(const Solid& s) const { see(s.material, "material"); }
    void operator()(const Object& o) const {
      for (const auto& p : o.parts) {
        see(p.what, p.name);
        see(p.material, "material");
      }
    }
    void operator()(const Robot& r) const {
      for (const auto& p : r.base_parts) see(p.what, "base");
      for (const auto& l : r.links)
        for (const auto& p : l.parts) see(p.what, l.name);
    }
    void operator()(const Trajectory& t) const {
      for (const auto& s : t.segments) see(s.stored, "segment");
    }
    void operator()(const World& w) const {
      for (const auto& o : w.objects) see(o.what, o.name);
      for (const auto& r : w.robots) see(r.robot, r.name);
      for (const auto& t : w.trajectories) see(t.trajectory, t.name);
      for (const auto& t : w.tasks) see(t.task, t.name);
    }
    void operator()(const Task& t) const {
      for (const auto& s : t.steps) {
        see(s.trajectory, "move");
        see(s.task, "call");
      }
    }
  };
  std::visit(Visitor{call}, body);
}

}  // namespace robomosp::model
