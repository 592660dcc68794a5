// SPDX-License-Identifier: Apache-2.0
#include "model/kept_solver.h"

#include <string_view>

#include "model/default_provider.h"
#include "model/records.h"

namespace robomosp::model {
namespace {

/// The interface without its number: a file of an older program has an older one.
std::string_view stem(std::string_view interface) {
  return interface.substr(0, interface.find('/'));
}

/// Calls fn(interface without its number, name) for every choice in a record, `B` const or not.
template <class B, class Fn>
void for_each_choice(B& body, Fn&& fn) {
  if (auto* r = std::get_if<Robot>(&body)) {
    fn("robomosp.ik", r->ik.name);
    fn("robomosp.inverse_dynamics", r->inverse_dynamics.name);
    fn("robomosp.forward_dynamics", r->forward_dynamics.name);
    fn("robomosp.controller", r->controller.name);
  } else if (auto* t = std::get_if<Trajectory>(&body)) {
    for (auto& s : t->segments) {
      for (const char* shape : {"robomosp.curve", "robomosp.segment", "robomosp.joint_segment"})
        fn(shape, s.shape.name);
      fn("robomosp.motion_law", s.law.name);
      fn("robomosp.motion_law", s.turning.name);
      fn("robomosp.orientation", s.orientation.name);
    }
  } else if (auto* other = std::get_if<OtherContent>(&body);
             other && to_string(other->kind()) == "default_provider") {
    auto& d = other->template as<DefaultProvider>();
    fn(stem(d.interface), d.provider);
  }
}

}  // namespace

void rename_choices(Body& body, std::string_view interface, const std::string& from,
                    const std::string& to) {
  for_each_choice(body, [&](std::string_view of, std::string& name) {
    if (of == stem(interface) && name == from) name = to;
  });
}

bool chooses(const Body& body, std::string_view interface, std::string_view name) {
  bool found = false;
  for_each_choice(body, [&](std::string_view of, const std::string& chosen) {
    found = found || (of == stem(interface) && chosen == name);
  });
  return found;
}

}  // namespace robomosp::model
