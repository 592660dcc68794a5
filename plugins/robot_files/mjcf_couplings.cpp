// SPDX-License-Identifier: Apache-2.0
#include "mjcf_couplings.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>

#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robot_files {
namespace {

Joint* find_joint(Mechanism& m, std::string_view name) {
  for (Body& b : m.bodies)
    for (Joint& j : b.joints)
      if (j.name == name) return &j;
  return nullptr;
}

/// The maximum magnitude of a range that counts, or infinity.
Result<double> bound(const MjcfBodies& b, const Element& e, const std::string& cls,
                     const char* range, const char* limited) {
  const std::string_view says = b.values.value(e, cls, limited);
  if (b.values.value(e, cls, range).empty() || says == "false" ||
      (says != "true" && !b.values.autolimits()))
    return kUnlimited;
  std::array<double, 2> r{};
  RMP_TRY(b.values.list(e, cls, range, r));
  return std::max(std::fabs(r[0]), std::fabs(r[1]));
}

/// The maximum force of an actuator before its gear: of its force range, and where the force is
/// the control (times a gain), of its control range.
Result<double> greatest_force(const MjcfBodies& b, const Element& e, const std::string& cls) {
  RMP_TRY_ASSIGN(double most, bound(b, e, cls, "forcerange", "forcelimited"));
  const std::string_view kind = e.Name();
  const auto is = [&](const char* attribute, std::string_view what) {
    const std::string_view v = b.values.value(e, cls, attribute);
    return v.empty() || v == what;
  };
  const bool is_direct = kind == "motor" || (kind == "general" && is("gaintype", "fixed") &&
                                             is("biastype", "none") && is("dyntype", "none"));
  if (!is_direct) return most;
  RMP_TRY_ASSIGN(const double control, bound(b, e, cls, "ctrlrange", "ctrllimited"));
  RMP_TRY_ASSIGN(const double gain,
                 kind == "general" ? b.values.first(e, cls, "gainprm", 1) : Result<double>(1.0));
  return std::isinf(control) ? most : std::min(most, control * std::fabs(gain));
}

struct Driven {
  double force = 0;  ///< sum of the actuators' greatest forces at the joint
  bool has_gear = false;
};

Result<void> coupling(MjcfBodies& b, const Element& e, const std::string& cls) {
  const std::string first(word(e, "joint1")), second(word(e, "joint2"));
  Joint* j = find_joint(b.m, first);
  if (!j || (!second.empty() && !find_joint(b.m, second)))
    return fault(e, "joint " + in_quotes(j ? second : first) + " of an equality is not in the file",
                 "Name joints of the file.");
  std::array<double, 5> c{0, 1, 0, 0, 0};
  if (const std::string_view v = b.values.value(e, cls, "polycoef"); !v.empty()) {
    RMP_TRY_ASSIGN(const auto n, numbers(e, v, "polycoef"));
    for (std::size_t i = 0; i < n.size() && i < 5; ++i) c[i] = n[i];
  }
  for (const double v : c)
    if (!(std::fabs(v) <= kGreatest)) return fault(e, "a coefficient is beyond 1e12");
  if (second.empty()) {
    b.m.notes.push_back("Joint " + in_quotes(first) +
                        " is fixed by an equality in the file; it is free here.");
    return {};
  }
  if (c[2] != 0 || c[3] != 0 || c[4] != 0)
    b.m.notes.push_back("Joint " + in_quotes(first) + " follows " + in_quotes(second) +
                        " by a polynomial; only its linear part was kept.");
  // Values of both count from their refs, as the equality's do.
  j->follows = second;
  j->offset = c[0];
  j->ratio = c[1];
  return {};
}

struct Place {
  std::int32_t body = -1;
  Pose in_body;
};

Result<void> loop(MjcfBodies& b, const Element& e, const std::string& cls, bool is_weld) {
  const bool by_sites = has(e, "site1");
  const auto find = [&](const char* body, const char* site) -> Result<Place> {
    const std::string name(word(e, by_sites ? site : body));
    if (by_sites) {
      const auto it = b.sites.find(name);
      if (it == b.sites.end())
        return fault(e, "site " + in_quotes(name) + " is not in the file",
                     "Name one of its sites.");
      return Place{it->second.first, it->second.second};
    }
    if (name.empty() || name == "world") return Place{};
    const auto it = b.index.find(name);
    if (it == b.index.end())
      return fault(e, "body " + in_quotes(name) + " is not in the file", "Name one of its bodies.");
    return Place{it->second, {}};
  };
  RMP_TRY_ASSIGN(const Place first, find("body1", "site1"));
  RMP_TRY_ASSIGN(const Place second, find("body2", "site2"));
  Loop l;
  l.name = std::string(word(e, "name"));
  if (l.name.empty()) l.name = is_weld ? "weld" : "connect";
  l.kind = is_weld ? "weld" : "point";
  l.a = first.body;
  l.b = second.body;
  l.in_a = first.in_body;
  l.in_b = second.in_body;
  if (!by_sites) {
    const auto at = [&](std::int32_t body) {
      return body < 0 ? Pose{} : b.world[static_cast<std::size_t>(body)];
    };
    // As the file shows the bodies.
    const Pose a_T_b = spatial::compose(spatial::inverse(at(l.a)), at(l.b));
    Vec3 anchor{};
    RMP_TRY(b.values.list(e, cls, "anchor", anchor));
    std::array<double, 7> r{0, 1, 0, 0, 0, 0, 0};
    if (is_weld) RMP_TRY(b.values.list(e, cls, "relpose", r));
    if (!is_weld) {
      l.in_a = spatial::translation(anchor);
      l.in_b = spatial::compose(spatial::inverse(a_T_b), l.in_a);
    } else if (r[3] == 0 && r[4] == 0 && r[5] == 0 && r[6] == 0) {
      l.in_b = spatial::translation(anchor);
      l.in_a = spatial::compose(a_T_b, l.in_b);
    } else {
      // The anchor of body 2 is held at the relative pose of body 1.
      l.in_b = spatial::translation(anchor);
      l.in_a.p = {r[0], r[1], r[2]};
      l.in_a.R = spatial::from_quaternion({r[3], r[4], r[5], r[6]});
    }
  }
  if (l.a == l.b) return fault(e, "it connects a body to itself", "Name two bodies.");
  b.m.loops.push_back(std::move(l));
  return {};
}

}  // namespace

Result<void> read_actuators(MjcfBodies& b, const std::vector<const Element*>& actuators,
                            const std::vector<const Element*>& tendons) {
  using Pull = std::pair<std::string, double>;  // joint, coefficient
  std::map<std::string, std::vector<Pull>, std::less<>> fixed;
  for (const Element* t : tendons) {
    if (std::string_view(t->Name()) != "fixed") continue;
    RMP_TRY_ASSIGN(const auto inside, b.values.children(*t));
    for (const Element* e : inside) {
      RMP_TRY_ASSIGN(const double coefficient, number(*e, "coef", 1));
      fixed[std::string(word(*t, "name"))].emplace_back(word(*e, "joint"), coefficient);
    }
  }
  std::map<std::string, Driven> driven;
  for (const Element* e : actuators) {
    const std::string cls = b.values.class_of(*e, "main");
    RMP_TRY_ASSIGN(const double gear, b.values.first(*e, cls, "gear", 1));
    RMP_TRY_ASSIGN(const double force, greatest_force(b, *e, cls));
    std::string joint(b.values.value(*e, cls, "joint"));
    if (joint.empty()) joint = std::string(b.values.value(*e, cls, "jointinparent"));
    std::vector<Pull> pulls;
    if (!joint.empty()) {
      if (!find_joint(b.m, joint))
        return fault(*e, "joint " + in_quotes(joint) + " is not in the file",
                     "Name one of its joints.");
      pulls = {{joint, 1}};
    } else if (const auto t = fixed.find(b.values.value(*e, cls, "tendon")); t != fixed.end()) {
      pulls = t->second;
    } else {
      b.left_out.add("<" + std::string(e->Name()).substr(0, 40) + "> that drives no joint");
      continue;
    }
    for (const auto& [name, coefficient] : pulls) {
      Driven& d = driven[name];
      d.force += std::fabs(gear * coefficient) * force;
      d.has_gear = d.has_gear || gear != 1;
    }
  }
  if (driven.empty()) return {};
  std::size_t geared = 0;
  for (Body& body : b.m.bodies)
    for (Joint& j : body.joints) {
      const auto d = driven.find(j.name);
      j.passive = d == driven.end();
      if (j.passive) continue;
      if (std::isfinite(d->second.force)) j.max_force = std::min(j.max_force, d->second.force);
      if (d->second.has_gear) ++geared;
    }
  b.m.notes.emplace_back(
      "Joints with an actuator have a motor, the others are passive; the gains of the actuators "
      "were left out.");
  if (geared > 0)
    b.m.notes.push_back("The gear of the actuators of " + std::to_string(geared) +
                        (geared == 1 ? " joint is" : " joints is") +
                        " in their maximum force; torques refer to the joint.");
  return {};
}

Result<void> read_equalities(MjcfBodies& b, const std::vector<const Element*>& all) {
  for (const Element* e : all) {
    const std::string_view kind = e->Name();
    const std::string cls = b.values.class_of(*e, "main");
    if (b.values.value(*e, cls, "active") == "false")
      b.left_out.add("inactive <" + std::string(kind).substr(0, 40) + "> in <equality>");
    else if (kind == "joint") RMP_TRY(coupling(b, *e, cls));
    else if ((kind == "connect" || kind == "weld") && (has(*e, "body1") || has(*e, "site1")))
      RMP_TRY(loop(b, *e, cls, kind == "weld"));
    else b.left_out.add("<" + std::string(kind).substr(0, 40) + "> in <equality>");
  }
  return {};
}

Result<void> read_keyframes(MjcfBodies& b, const std::vector<const Element*>& all) {
  std::size_t length = 0;
  const auto count = [](const Joint& j) -> std::size_t {
    return j.kind == Joint::Kind::free ? 7 : j.kind == Joint::Kind::spherical ? 4 : 1;
  };
  for (const Body& body : b.m.bodies)
    for (const Joint& j : body.joints) length += count(j);
  std::size_t unnamed = 0;
  for (const Element* e : all) {
    if (!has(*e, "qpos")) continue;
    RMP_TRY_ASSIGN(const auto q, numbers(*e, word(*e, "qpos"), "qpos", 3 * kMostBodies));
    if (q.size() != length) {
      b.left_out.add("a <key> with other joints than those read");
      continue;
    }
    NamedPose key;
    key.name = std::string(word(*e, "name"));
    if (key.name.empty()) key.name = "key_" + std::to_string(++unnamed);
    std::size_t at = 0;
    for (const Body& body : b.m.bodies)
      for (const Joint& j : body.joints) {
        std::vector<double> v(q.begin() + static_cast<std::ptrdiff_t>(at),
                              q.begin() + static_cast<std::ptrdiff_t>(at + count(j)));
        at += count(j);
        for (const double x : v)
          if (!(std::fabs(x) <= kGreatest)) return fault(*e, "a number of qpos is beyond 1e12");
        if (v.size() == 1) {
          const auto ref = b.refs.find(j.name);
          v[0] -= ref == b.refs.end() ? 0 : ref->second;
        } else {
          const std::size_t k = v.size() - 4;
          const double n = std::hypot(std::hypot(v[k], v[k + 1]), std::hypot(v[k + 2], v[k + 3]));
          if (!(n > 1e-9)) return fault(*e, "a quaternion of qpos has no length");
          for (std::size_t i = k; i < v.size(); ++i) v[i] /= n;
        }
        if (v.size() == 7) {
          // There the pose of the body in the world, here the way from where the file shows it.
          Pose t;
          t.p = {v[0], v[1], v[2]};
          t.R = spatial::from_quaternion({v[3], v[4], v[5], v[6]});
          t = spatial::compose(spatial::inverse(body.rest), t);
          const auto turn = spatial::to_quaternion(t.R);
          v = {t.p[0], t.p[1], t.p[2], turn.w, turn.x, turn.y, turn.z};
        }
        key.values.emplace_back(j.name, std::move(v));
      }
    b.m.poses.push_back(std::move(key));
  }
  return {};
}

}  // namespace robomosp::robot_files
