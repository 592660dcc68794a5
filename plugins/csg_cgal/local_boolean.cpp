// SPDX-License-Identifier: GPL-3.0-or-later
#include "local_boolean.h"

#include <algorithm>
#include <map>
#include <unordered_map>

#include "inside.h"
#include "near_surface.h"
#include "signs.h"

namespace robomosp::csg_cgal {
namespace {

using State = LocalOutcome::State;

/// Where a cell is, seen from the other solid. `same` and `opposite`: on its surface, its outside
/// on the same side or on the other.
enum class Where : std::uint8_t { unknown, inside, outside, same, opposite, contradictory };

constexpr std::uint32_t kNoTriangle = NearSurface::kNone, kWall = NearSurface::kWall;
constexpr std::size_t kPairsBetweenQuestions = 4096;

/// Whether two triangles certainly have no point in common.
bool are_apart(const PatchMesh& a, std::uint32_t ta, const PatchMesh& b, std::uint32_t tb,
               double slack) {
  const auto one_side = [&](const std::array<Vec3, 3>& t, const std::array<Vec3, 3>& u) {
    const int first = sure_side(t[0], t[1], t[2], u[0], slack);
    return first != 0 && sure_side(t[0], t[1], t[2], u[1], slack) == first &&
           sure_side(t[0], t[1], t[2], u[2], slack) == first;
  };
  const auto t = a.corners(ta), u = b.corners(tb);
  return one_side(t, u) || one_side(u, t);
}

/// Takes the triangles that may meet the other solid.
void take_near(NearSurface& a, NearSurface& b, const Progress& progress) {
  const ExactSolid &first = a.solid(), &second = b.solid();
  const double slack = first.impl().slack + second.impl().slack;
  std::size_t count = 0;
  first.tree().pairs(second.tree(), [&](std::uint32_t ta, std::uint32_t tb) {
    if (++count % kPairsBetweenQuestions == 0) stop_if_cancelled(progress);
    if (a.has(ta) && b.has(tb)) return;
    if (are_apart(first.mesh(), ta, second.mesh(), tb, slack)) return;
    a.take(ta);
    b.take(tb);
  });
}

/// Directions about an edge u v, counter-clockwise seen against it, from that to `zero`.
class Around {
 public:
  Around(const Point& u, const Point& v, const Point& zero) : u_(u), v_(v), zero_(zero) {}
  /// 0 = at zero, 1 = within the first half turn, 2 = opposite, 3 = within the second half.
  [[nodiscard]] int quarter(const Point& p) const {
    switch (CGAL::orientation(u_, v_, zero_, p)) {
      case CGAL::POSITIVE: return 1;
      case CGAL::NEGATIVE: return 3;
      default: return CGAL::coplanar_orientation(u_, v_, zero_, p) == CGAL::POSITIVE ? 0 : 2;
    }
  }
  /// Of two in the same quarter: 1 = p comes before q, 0 = both at one place.
  [[nodiscard]] int before(int quarter, const Point& p, const Point& q) const {
    if (quarter == 0 || quarter == 2) return 0;
    return static_cast<int>(CGAL::orientation(u_, v_, p, q));
  }

 private:
  const Point &u_, &v_, &zero_;
};

/// Where the half plane from a wall's ends through `p` is, seen from the wall's solid. The solid's
/// inside is what a half plane sweeps that turns counter-clockwise from the right cell to the left
/// one. `runs_along`: p's triangle runs along the wall as its left cell does.
Where where_at(const NearSurface::Wall& wall, const Point& p, bool runs_along) {
  const Around around(wall.ends[0], wall.ends[1], wall.right_apex);
  const int at = around.quarter(p);
  const int end = wall.is_flat ? 2 : around.quarter(wall.left_apex);
  if (end == 0) return Where::contradictory;
  if (at == 0) return runs_along ? Where::opposite : Where::same;
  if (at != end) return at < end ? Where::inside : Where::outside;
  const int before = around.before(at, p, wall.left_apex);
  if (before == 0) return runs_along ? Where::same : Where::opposite;
  return before > 0 ? Where::inside : Where::outside;
}

/// Parts of a surface between the walls.
struct Parts {
  std::vector<std::uint32_t> of;     ///< by cell
  std::vector<std::uint32_t> first;  ///< a cell of each
  std::vector<Where> where;

  explicit Parts(const NearSurface& s) : of(s.cell_count(), kNoTriangle) {
    std::vector<std::uint32_t> open;
    for (std::uint32_t seed = 0; seed < of.size(); ++seed) {
      if (of[seed] != kNoTriangle || !s.is_cell(seed)) continue;
      const auto part = static_cast<std::uint32_t>(first.size());
      first.push_back(seed);
      of[seed] = part;
      open.push_back(seed);
      while (!open.empty()) {
        const std::uint32_t cell = open.back();
        open.pop_back();
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t next = s.beyond(cell, k);
          if (next == kWall || of[next] != kNoTriangle) continue;
          of[next] = part;
          open.push_back(next);
        }
      }
    }
    where.assign(first.size(), Where::unknown);
  }
  void say(std::uint32_t cell, Where w) {
    Where& known = where[of[cell]];
    if (known == Where::unknown) known = w;
    else if (known != w) known = Where::contradictory;
  }
};

/// For the corners of b's walls the same ones of a's.
using Matches = std::unordered_map<std::uint32_t, std::uint32_t>;

/// Nothing when a corner of a wall of `b` is none of a's.
std::optional<Matches> match(const NearSurface& a, const NearSurface& b) {
  struct Less {
    bool operator()(const Point& p, const Point& q) const { return p < q; }
  };
  std::unordered_map<std::ptrdiff_t, std::uint32_t> by_name;
  std::map<Point, std::uint32_t, Less> by_place;
  Matches all;
  for (const auto& w : a.walls())
    for (const auto& [corner, p] : {std::pair{w.from, &w.ends[0]}, std::pair{w.to, &w.ends[1]}})
      by_name.emplace(p->id(), corner);
  bool is_filled = false;
  for (const auto& w : b.walls())
    for (const auto& [corner, p] : {std::pair{w.from, &w.ends[0]}, std::pair{w.to, &w.ends[1]}}) {
      if (all.contains(corner)) continue;
      if (const auto at = by_name.find(p->id()); at != by_name.end()) {
        all.emplace(corner, at->second);
        continue;
      }
      if (!is_filled)
        for (const auto& v : a.walls()) {
          by_place.emplace(v.ends[0], v.from);
          by_place.emplace(v.ends[1], v.to);
        }
      is_filled = true;
      const auto at = by_place.find(*p);
      if (at == by_place.end()) return std::nullopt;
      all.emplace(corner, at->second);
    }
  return all;
}

/// Places the parts on both sides of every wall; false when the walls of the two differ.
bool look_across_walls(const NearSurface& a, const NearSurface& b, const Matches& same, Parts& of_a,
                       Parts& of_b) {
  if (a.walls().size() != b.walls().size()) return false;
  const auto key = [](std::uint32_t u, std::uint32_t v) {
    return (std::uint64_t{std::min(u, v)} << 32U) | std::max(u, v);
  };
  std::unordered_map<std::uint64_t, const NearSurface::Wall*> at;
  for (const auto& w : a.walls())
    if (!at.emplace(key(w.from, w.to), &w).second) return false;
  for (const auto& w : b.walls()) {
    const std::uint32_t from = same.at(w.from), to = same.at(w.to);
    const auto found = at.find(key(from, to));
    if (found == at.end()) return false;
    NearSurface::Wall v = *found->second;
    if (v.from != from) {
      std::swap(v.left, v.right);
      std::swap(v.left_apex, v.right_apex);
      std::swap(v.ends[0], v.ends[1]);
    }
    // Both now run the same way.
    of_a.say(v.left, where_at(w, v.left_apex, true));
    of_a.say(v.right, where_at(w, v.right_apex, false));
    of_b.say(w.left, where_at(v, w.left_apex, true));
    of_b.say(w.right, where_at(v, w.right_apex, false));
  }
  return true;
}

/// Places the parts that no wall bounds; false when one contradicts itself.
bool look_elsewhere(const NearSurface& s, const ExactSolid& other, Parts& parts,
                    const Progress& progress) {
  for (std::uint32_t part = 0; part < parts.where.size(); ++part) {
    Where& w = parts.where[part];
    if (w == Where::unknown) {
      stop_if_cancelled(progress);
      const Triangle& t = s.corners(parts.first[part]);
      const auto is_in = is_inside(other, {s.exact(t[0]), s.exact(t[1]), s.exact(t[2])},
                                   {s.point(t[0]), s.point(t[1]), s.point(t[2])},
                                   s.solid().impl().slack + s.made_slack());
      if (!is_in) return false;
      w = *is_in ? Where::inside : Where::outside;
    }
    if (w == Where::contradictory) return false;
  }
  return true;
}

/// Puts the result together.
class Assembly {
 public:
  Assembly(const NearSurface& a, const NearSurface& b, const Matches& same)
      : a_(a), b_(b), same_(same) {
    PatchMesh& mesh = out_->mesh;
    mesh.points.reserve(a.corner_count());
    mesh.triangles.reserve(a.cell_count());
    mesh.patch_of.reserve(a.cell_count());
    out_->names.reserve(a.corner_count());
  }

  template <class Keep>
  void add_first(Keep&& keep) {
    number_.assign(a_.corner_count(), kNoTriangle);
    add(a_, 0, 0, false, keep);
  }
  /// Corners on walls are those of the first.
  template <class Keep>
  void add_second(bool turned, Keep&& keep) {
    std::vector<std::uint32_t> first = std::move(number_);
    number_.assign(b_.corner_count(), kNoTriangle);
    const auto sources = static_cast<std::uint32_t>(a_.solid().impl().sources.size());
    for (const auto& [mine, its] : same_) number_[mine] = first[its];
    add(b_, static_cast<std::uint32_t>(a_.solid().mesh().patches.size()), sources + 1, turned,
        keep);
  }

  std::shared_ptr<ExactSolid::Impl> finish();

 private:
  template <class Keep>
  void add(const NearSurface& s, std::uint32_t patch_offset, std::uint32_t source_offset,
           bool turned, Keep&& keep) {
    auto& mesh = out_->mesh;
    for (std::uint32_t cell = 0; cell < s.cell_count(); ++cell) {
      if (!s.is_cell(cell) || !keep(cell)) continue;
      Triangle t = s.corners(cell);
      for (std::uint32_t& v : t) {
        std::uint32_t& n = number_[v];
        if (n == kNoTriangle) {
          n = static_cast<std::uint32_t>(mesh.points.size());
          mesh.points.push_back(s.point(v));
          out_->names.push_back(name(s, v, source_offset));
        }
        v = n;
      }
      if (turned) std::swap(t[1], t[2]);
      mesh.triangles.push_back(t);
      mesh.patch_of.push_back(s.patch(cell) + patch_offset);
    }
  }

  /// Sources: those of the first, what its cut made, those of the second, what its cut made.
  CornerName name(const NearSurface& s, std::uint32_t corner, std::uint32_t offset) const {
    const auto& impl = s.solid().impl();
    if (s.is_made(corner)) {
      const auto made = static_cast<std::uint32_t>(corner - impl.mesh.points.size());
      return is_on_grid(s.made()[made])
                 ? CornerName{}
                 : CornerName{offset + static_cast<std::uint32_t>(impl.sources.size()), made};
    }
    if (impl.is_plain(corner)) return {};
    return {offset + impl.names[corner].source, impl.names[corner].index};
  }
  static bool is_on_grid(const Point& p) {
    for (const auto& x : {p.x(), p.y(), p.z()}) {
      const auto [low, high] = CGAL::to_interval(x);
      if (low != high || snapped(low) != low) return false;
    }
    return true;
  }

  const NearSurface &a_, &b_;
  const Matches& same_;
  std::shared_ptr<ExactSolid::Impl> out_ = std::make_shared<ExactSolid::Impl>();
  std::vector<std::uint32_t> number_;  ///< of a corner in the result
};

std::shared_ptr<ExactSolid::Impl> Assembly::finish() {
  const auto& first = a_.solid().impl();
  const auto& second = b_.solid().impl();
  auto& mesh = out_->mesh;
  mesh.patches = first.mesh.patches;
  mesh.patches.insert(mesh.patches.end(), second.mesh.patches.begin(), second.mesh.patches.end());
  std::vector<CornerSource> sources = first.sources;
  sources.push_back({nullptr, std::make_shared<const std::vector<Point>>(a_.made()), {}});
  sources.insert(sources.end(), second.sources.begin(), second.sources.end());
  sources.push_back({nullptr, std::make_shared<const std::vector<Point>>(b_.made()), {}});
  // Only what is used is kept.
  std::vector<std::uint32_t> number(sources.size(), kNoTriangle);
  for (CornerName& n : out_->names) {
    if (n.source == CornerName::kPlain) continue;
    std::uint32_t& to = number[n.source];
    if (to == kNoTriangle) {
      to = static_cast<std::uint32_t>(out_->sources.size());
      out_->sources.push_back(sources[n.source]);
    }
    n.source = to;
  }
  if (out_->sources.empty()) out_->names.clear();
  else out_->slack = std::max({first.slack, second.slack, a_.made_slack(), b_.made_slack()});
  out_->measure();
  return out_;
}

bool keeps_first(CsgKind kind, Where w) {
  switch (kind) {
    case CsgKind::union_: return w == Where::outside || w == Where::same;
    case CsgKind::difference: return w == Where::outside || w == Where::opposite;
    default: return w == Where::inside || w == Where::same;
  }
}
bool keeps_second(CsgKind kind, Where w) {
  return w == (kind == CsgKind::union_ ? Where::outside : Where::inside);
}

bool are_equal(const ExactSolid& a, const ExactSolid& b) {
  if (&a.impl() == &b.impl()) return true;
  return a.impl().names.empty() && b.impl().names.empty() && a.mesh().points == b.mesh().points &&
         a.mesh().triangles == b.mesh().triangles;
}

}  // namespace

LocalOutcome local_boolean(CsgKind kind, const ExactSolid& a, const ExactSolid& b,
                           const Progress& progress) {
  if (are_equal(a, b))
    return {State::closed,
            kind == CsgKind::difference ? ExactSolid(std::make_shared<ExactSolid::Impl>()) : a};
  NearSurface first(a), second(b);
  take_near(first, second, progress);
  stop_if_cancelled(progress);
  if (!first.empty()) {
    first.build();
    second.build();
    NearSurface::cut(first, second, progress);
    stop_if_cancelled(progress);
  }
  if (!first.finish() || !second.finish()) return {};
  const auto same = match(first, second);
  if (!same) return {};
  Parts of_first(first), of_second(second);
  if (!look_across_walls(first, second, *same, of_first, of_second) ||
      !look_elsewhere(first, b, of_first, progress) ||
      !look_elsewhere(second, a, of_second, progress))
    return {};
  stop_if_cancelled(progress);
  Assembly result(first, second, *same);
  result.add_first(
      [&](std::uint32_t cell) { return keeps_first(kind, of_first.where[of_first.of[cell]]); });
  result.add_second(kind == CsgKind::difference, [&](std::uint32_t cell) {
    return keeps_second(kind, of_second.where[of_second.of[cell]]);
  });
  auto impl = result.finish();
  auto neighbours = neighbours_of(impl->mesh.triangles, impl->mesh.points.size());
  if (!neighbours) return {State::touches, {}};
  impl->neighbours = std::move(*neighbours);
  return {State::closed, ExactSolid(std::move(impl))};
}

}  // namespace robomosp::csg_cgal
