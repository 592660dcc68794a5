// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/gizmo/picking.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <QLineF>

#include "scene/origin.h"
#include "viewer/scene/linear.h"

namespace robomosp::viewer {
namespace {

/// The place within a member that an element shows.
Selection inside(const scene::Frame& frame, const scene::ElementRef& element) {
  const scene::Member& member = *element.member;
  const auto origin = scene::pick(frame, element);
  if (!origin.ok()) return {};
  // The base is no link: its fields are those of the robot.
  if (origin->link == "base") return {{record_handle(member.what), ""}};
  if (!origin->link.empty()) return {{record_handle(member.what), "links." + origin->link}};
  if (!origin->node.empty()) return {{record_handle(origin->record), "nodes." + origin->node}};
  if (!origin->part.empty()) return {{record_handle(member.what), "parts." + origin->part}};
  return {};
}

bool crosses(const QRectF& box, const QLineF& line) {
  if (box.contains(line.p1()) || box.contains(line.p2())) return true;
  const QLineF sides[] = {{box.topLeft(), box.topRight()},
                          {box.topRight(), box.bottomRight()},
                          {box.bottomRight(), box.bottomLeft()},
                          {box.bottomLeft(), box.topLeft()}};
  return std::any_of(std::begin(sides), std::end(sides), [&](const QLineF& side) {
    return side.intersects(line, nullptr) == QLineF::BoundedIntersection;
  });
}

bool is_in(const QPolygonF& triangle, QPointF at) {
  return triangle.containsPoint(at, Qt::OddEvenFill);
}

/// Whether the triangles of an item are all inside a box, or whether one touches it.
bool is_boxed(const Item& item, const ScreenCamera& camera, const QRectF& box, bool is_touching) {
  const Mesh& mesh = *item.mesh;
  std::vector<QPointF> at(mesh.vertex_count());
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Vec3 p = transform(item.pose, {static_cast<double>(mesh.positions[3 * i]),
                                         static_cast<double>(mesh.positions[3 * i + 1]),
                                         static_cast<double>(mesh.positions[3 * i + 2])});
    const auto q = camera.project(p);
    if (!q) return false;  // behind the eye
    if (is_touching && box.contains(*q)) return true;
    if (!is_touching && !box.contains(*q)) return false;
    at[i] = *q;
  }
  if (!is_touching) return !at.empty();
  for (std::size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
    const QPointF a = at[mesh.triangles[t]], b = at[mesh.triangles[t + 1]],
                  c = at[mesh.triangles[t + 2]];
    const QRectF around =
        QRectF(QPointF(std::min({a.x(), b.x(), c.x()}), std::min({a.y(), b.y(), c.y()})),
               QPointF(std::max({a.x(), b.x(), c.x()}), std::max({a.y(), b.y(), c.y()})));
    if (!around.intersects(box)) continue;
    if (crosses(box, {a, b}) || crosses(box, {b, c}) || crosses(box, {c, a}) ||
        is_in(QPolygonF{a, b, c, a}, box.center()))
      return true;
  }
  return false;
}

}  // namespace

Handle record_handle(AnyId id) { return {std::string(to_string(id.kind)), id.number}; }

Selection clicked(const scene::Frame& frame, const scene::ElementRef& element,
                  const Selection& now) {
  const scene::Member& member = *element.member;
  const std::string path = scene::member_path(member);
  const Selection whole{path.empty() ? Selected{record_handle(frame.what), ""}
                                     : Selected{record_handle(frame.what), path}};
  // Once something of a member is selected, clicks on its other parts select those directly.
  bool is_entered = !member.is_placed || now == whole;
  for (const Selected& s : now)
    is_entered =
        is_entered || (s.record == record_handle(member.what) && member.what != frame.what);
  for (const Selected& s : now)
    if (s.record.kind == "solid" && s.path.starts_with("nodes.")) {
      const Selection deep = inside(frame, element);
      is_entered = is_entered || (deep.size() == 1 && deep.front().record == s.record);
    }
  if (!is_entered) return whole;
  const Selection deep = inside(frame, element);
  return deep.empty() ? whole : deep;
}

std::string words_of(const scene::Frame& frame, const scene::ElementRef& element,
                     const Selected& what) {
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"objects", "object"}, {"robots", "robot"}, {"trajectories", "trajectory"},
      {"frames", "frame"},   {"lights", "light"}, {"links", "link"},
      {"parts", "part"},     {"nodes", "node"}};
  const scene::Member& member = *element.member;
  const auto dot = what.path.find('.');
  if (dot == std::string::npos) return what.record.kind + " " + member.name;
  const std::string_view list = std::string_view(what.path).substr(0, dot);
  std::string out(list);
  for (const auto& [many, one] : kWords)
    if (list == many) out = one;
  out += " " + what.path.substr(dot + 1);
  if (what.record != record_handle(frame.what)) return out + " of " + member.name;
  if (!member.is_placed) return out;
  const auto origin = scene::pick(frame, element);
  if (!origin.ok()) return out;
  const std::string& inner = origin->link.empty() ? origin->part : origin->link;
  return inner.empty() ? out : out + " › " + inner;
}

Selection boxed(const scene::Frame& frame, const viewer::Frame& drawn, const ScreenCamera& camera,
                const QRectF& box, bool is_touching, const std::set<std::uint64_t>& hidden) {
  std::map<std::uint64_t, const Item*> items;
  for (const Item& item : drawn.items)
    if (item.mesh && !hidden.contains(item.id)) items.emplace(item.id, &item);
  Selection out;
  frame.for_each_member([&](const scene::MemberPtr& m) {
    if (m->kind == scene::MemberKind::ghost || m->kind == scene::MemberKind::clearance) return;
    const std::string path = scene::member_path(*m);
    const scene::ShapePtr& shape = m->shape(scene::ShapeLayer::bodies);
    if (!shape) return;
    if (shape->items.empty() && !path.empty() && !m->bodies.empty()) {
      // Frames and lights are where their origins are.
      const auto at = camera.project(m->bodies.front().p);
      if (m->kind != scene::MemberKind::trajectory && at && box.contains(*at))
        out.push_back({record_handle(frame.what), path});
      return;
    }
    bool all = !shape->items.empty(), any = false;
    for (std::size_t i = 0; i < shape->items.size(); ++i) {
      const scene::ElementRef element{scene::ElementKind::item, scene::ShapeLayer::bodies,
                                      static_cast<std::uint32_t>(i), m};
      const auto at = items.find(scene::id_of(element));
      const bool is_hit = at != items.end() && is_boxed(*at->second, camera, box, is_touching);
      all = all && is_hit;
      any = any || is_hit;
      if (path.empty() && is_hit)
        for (Selected& s : inside(frame, element))
          if (std::find(out.begin(), out.end(), s) == out.end()) out.push_back(std::move(s));
      if (!path.empty() && (is_touching ? any : !all)) break;
    }
    if (!path.empty() && (is_touching ? any : all))
      out.push_back({record_handle(frame.what), path});
  });
  return out;
}

void HiddenMembers::hide(const Selection& what, const scene::Frame& frame) {
  frame.for_each_member([&](const scene::MemberPtr& m) {
    const std::string path = scene::member_path(*m);
    if (path.empty()) return;
    for (const Selected& s : what)
      if ((s.record == record_handle(frame.what) && s.path == path) ||
          (s.record == record_handle(m->what) && m->what != frame.what))
        names_.insert(path);
  });
}

void HiddenMembers::isolate(const Selection& what, const scene::Frame& frame) {
  HiddenMembers kept;
  kept.hide(what, frame);
  if (kept.names_.empty()) return;
  names_.clear();
  frame.for_each_member([&](const scene::MemberPtr& m) {
    const std::string path = scene::member_path(*m);
    if (!path.empty() && m->kind != scene::MemberKind::light && !kept.names_.contains(path))
      names_.insert(path);
  });
}

void HiddenMembers::toggle(const std::string& member) {
  if (names_.erase(member) == 0) names_.insert(member);
}

std::set<std::uint64_t> HiddenMembers::apply(const scene::Frame& frame, render::Scene& scene) {
  scene::LeftOut out = scene::leave_out(frame, names_, scene);
  names_ = std::move(out.members);
  return std::move(out.items);
}

}  // namespace robomosp::viewer
