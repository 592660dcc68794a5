// SPDX-License-Identifier: Apache-2.0
#include "prismatic.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>

#include "arrangement.h"
#include "leaders.h"
#include "occt_support.h"

#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_Circle.hxx>
#include <Geom2d_Line.hxx>
#include <Geom_Circle.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_Line.hxx>
#include <Geom_Plane.hxx>
#include <Precision.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <gp_Quaternion.hxx>

namespace robomosp::csg_occt {
namespace {

// Axes count as parallel when over the size of a large part they part by less than kSamePlace.
constexpr double kParallel = 1e-12;
constexpr std::size_t kMostLeaves = 20'000, kMostParts = 4'000'000;
// The integrals over the faces must give the volume of sections times heights.
constexpr double kVolumeAgreement = 1e-9;
constexpr double kTolerance = 1e-7;  // Precision::Confusion(), of what is built

double wrapped_turn(double angle) {
  angle = std::fmod(angle, kTurn);
  if (angle < 0) angle += kTurn;
  return angle < kTurn ? angle : 0;
}

gp_XYZ column(const gp_Trsf& t, int k) { return {t.Value(1, k), t.Value(2, k), t.Value(3, k)}; }
bool is_along(const gp_XYZ& axis, const gp_XYZ& direction) {
  return axis.Crossed(direction).Modulus() <= kParallel;
}

/// An operation of the tree, or a prism.
struct Node {
  std::uint32_t parent = 0, item = 0;  ///< item: its number among the parent's
  bool is_leaf = false;
  std::size_t term = 0;
  gp_Trsf pose;  ///< in the frame of the whole
  // of operations
  CsgKind kind = CsgKind::union_;
  std::size_t count = 0;
  std::size_t first_on = 0, others_on = 0;  ///< operands that cover the place looked at
  bool was_on = false;                      ///< somewhere
  bool has_cut = false;                     ///< as a tool of a difference
  // of leaves
  double low = 0, high = 0;
  std::uint32_t low_level = 0, high_level = 0;

  bool is_on() const {
    switch (kind) {
      case CsgKind::union_: return first_on + others_on > 0;
      case CsgKind::intersection: return first_on + others_on == count;
      default: return first_on > 0 && others_on == 0;
    }
  }
};

class PrismaticBuilder {
 public:
  PrismaticBuilder(const Plan& plan, std::size_t term, FaceMemory& faces, const Progress& progress)
      : plan_(plan), root_(term), faces_(faces), progress_(progress) {}

  std::optional<PrismaticOutcome> run() {
    if (!collect() || !find_direction() || !place_leaves() || !find_levels()) return {};
    auto arrangement = arrange(borders_, progress_);
    if (!arrangement || progress_.cancelled()) return {};
    plane_ = std::move(*arrangement);
    slabs_ = levels_.size() - 1;
    if ((plane_.cells.size() + plane_.edges.size() + plane_.vertices.size()) * (slabs_ + 1) >
        kMostParts)
      return {};
    fill_cells();
    for (std::size_t n = 0; n < nodes_.size(); ++n)
      if (!nodes_[n].is_leaf && !nodes_[n].was_on) return {};  // something is empty
    if (!find_sides() || !choose_seams() || !find_corners()) return {};
    if (!make_rims() || !make_posts()) return {};
    if (!make_faces() || progress_.cancelled()) return {};
    PrismaticOutcome outcome;
    if (!make_solids(outcome)) return {};
    report_idle_tools(outcome);
    return outcome;
  }

  std::size_t looked_at() const { return nodes_.size(); }

 private:
  using Index = std::uint32_t;
  static constexpr Index kNone = ~Index{0};

  bool collect() {
    Node root;
    root.term = root_;
    nodes_.push_back(root);
    for (std::size_t n = 0; n < nodes_.size(); ++n) {  // grows while it runs
      const Term& term = plan_.terms[nodes_[n].term];
      nodes_[n].kind = term.kind;
      nodes_[n].count = term.items.size();
      nodes_[n].is_leaf = term.items.empty();
      if (nodes_[n].is_leaf ? !is_prism(term) : !is_boolean(term.kind)) return false;
      if (nodes_.size() + term.items.size() > kMostLeaves) return false;
      for (std::size_t i = 0; i < term.items.size(); ++i) {
        Node child;
        child.parent = static_cast<Index>(n);
        child.item = static_cast<Index>(i);
        child.term = term.items[i].term;
        child.pose = n == 0 ? term.items[i].pose : nodes_[n].pose * term.items[i].pose;
        nodes_.push_back(child);
      }
    }
    return !nodes_[0].is_leaf;
  }

  static bool is_boolean(CsgKind kind) {
    return kind == CsgKind::union_ || kind == CsgKind::difference || kind == CsgKind::intersection;
  }
  static bool is_prism(const Term& term) {
    return (term.kind == CsgKind::cylinder && term.sizes[2] == 0) ||
           (term.kind == CsgKind::box && term.sizes[3] == 0);
  }

  /// The local axes (1..3) along which the leaf is a prism.
  static std::pair<int, int> own_axes(CsgKind kind) {
    return kind == CsgKind::box ? std::pair{1, 3} : std::pair{3, 3};
  }

  bool find_direction() {
    const Node* strictest = nullptr;
    for (const Node& n : nodes_) {
      if (!n.is_leaf) continue;
      if (n.pose.ScaleFactor() != 1) return false;
      if (!strictest || (n.kind != CsgKind::box && strictest->kind == CsgKind::box)) strictest = &n;
    }
    const auto [first, last] = own_axes(strictest->kind);
    for (int axis = last; axis >= first; --axis) {
      const gp_XYZ d = column(strictest->pose, axis);
      const bool fits = std::all_of(nodes_.begin(), nodes_.end(), [&](const Node& n) {
        if (!n.is_leaf) return true;
        const auto [from, to] = own_axes(n.kind);
        for (int k = from; k <= to; ++k)
          if (is_along(column(n.pose, k), d)) return true;
        return false;
      });
      if (!fits) continue;
      turn_to(d, column(strictest->pose, axis == 1 ? 2 : 1));
      return true;
    }
    return false;
  }

  // A frame with z along the direction; the term's own if it can be.
  void turn_to(gp_XYZ z, const gp_XYZ& x) {
    is_turned_ = !is_along(z, gp_XYZ(0, 0, 1));
    if (!is_turned_) return;
    for (int k = 1; k <= 3; ++k)
      if (std::abs(z.Coord(k)) > 0.5) {
        if (z.Coord(k) < 0) z.Reverse();
        break;
      }
    const gp_XYZ y = z.Crossed(x);
    gp_Quaternion q(gp_Mat(x, y, z));
    q.Normalize();
    frame_.SetRotation(q);
  }

  bool place_leaves() {
    const gp_Trsf back = frame_.Inverted();
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      Node& node = nodes_[n];
      if (!node.is_leaf) continue;
      const gp_Trsf pose = is_turned_ ? back * node.pose : node.pose;
      const auto region = static_cast<Index>(n);
      const std::array<double, 6>& sizes = plan_.terms[node.term].sizes;
      if (node.kind == CsgKind::cylinder) {
        const gp_XYZ base = pose.TranslationPart();
        node.low = base.Z();
        node.high = node.low + column(pose, 3).Z() * sizes[1] * kMillimetresPerMetre;
        BorderPiece circle;
        circle.region = region;
        circle.is_circular = true;
        circle.centre = {base.X(), base.Y()};
        circle.radius = sizes[0] * kMillimetresPerMetre;
        circle.from = circle.to = {base.X() + circle.radius, base.Y()};
        borders_.push_back(circle);
      } else {
        place_box(node, region, pose, sizes);
      }
      if (node.low > node.high) std::swap(node.low, node.high);
    }
    return true;
  }

  void place_box(Node& node, Index region, const gp_Trsf& pose,
                 const std::array<double, 6>& sizes) {
    const gp_XYZ size = gp_XYZ(sizes[0], sizes[1], sizes[2]) * kMillimetresPerMetre;
    const gp_XYZ low(-size.X() / 2, -size.Y() / 2, 0);
    int up = 3;
    for (int k = 1; k <= 3; ++k)
      if (std::abs(column(pose, k).Z()) > 0.5 && is_along(column(pose, k), gp_XYZ(0, 0, 1))) up = k;
    const int a = up % 3 + 1, b = a % 3 + 1;
    const auto corner = [&](bool at_a, bool at_b) {
      gp_XYZ p = low;
      if (at_a) p.SetCoord(a, p.Coord(a) + size.Coord(a));
      if (at_b) p.SetCoord(b, p.Coord(b) + size.Coord(b));
      pose.Transforms(p);
      return p;
    };
    const std::array<gp_XYZ, 4> corners{corner(false, false), corner(true, false),
                                        corner(true, true), corner(false, true)};
    node.low = corners[0].Z();
    node.high = node.low + column(pose, up).Z() * size.Coord(up);
    for (std::size_t k = 0; k < 4; ++k) {
      const gp_XYZ &p = corners[k], &q = corners[(k + 1) % 4];
      BorderPiece side;
      side.region = region;
      side.from = {p.X(), p.Y()};
      side.to = {q.X(), q.Y()};
      borders_.push_back(side);
    }
  }

  bool find_levels() {
    std::vector<double> all;
    for (const Node& n : nodes_)
      if (n.is_leaf) {
        all.push_back(n.low);
        all.push_back(n.high);
      }
    std::sort(all.begin(), all.end());
    for (const double z : all) {
      if (!levels_.empty() && z - levels_.back() <= kSamePlace) continue;
      if (!levels_.empty() && z - levels_.back() < kClearance) return false;
      levels_.push_back(z);
    }
    const auto level_of = [&](double z) {
      return static_cast<Index>(std::upper_bound(levels_.begin(), levels_.end(), z) -
                                levels_.begin() - 1);
    };
    for (Node& n : nodes_)
      if (n.is_leaf) {
        n.low_level = level_of(n.low);
        n.high_level = level_of(n.high);
        if (n.low_level == n.high_level) return false;
      }
    return true;
  }

  /// Switches a leaf on or off and passes on what that changes.
  void switch_leaf(Index leaf, bool on) {
    for (Index n = leaf; n != 0;) {
      Node& parent = nodes_[nodes_[n].parent];
      const bool before = parent.is_on();
      std::size_t& counter = nodes_[n].item == 0 ? parent.first_on : parent.others_on;
      if (on) ++counter;
      else --counter;
      const bool after = parent.is_on();
      if (before == after) return;
      on = after;
      n = nodes_[n].parent;
    }
  }

  void remember_what_is_on(Index leaf) {
    for (Index n = leaf; n != 0;) {
      Node& parent = nodes_[nodes_[n].parent];
      if (parent.kind == CsgKind::difference && nodes_[n].item != 0 && parent.first_on > 0)
        nodes_[n].has_cut = true;
      if (!parent.is_on()) return;
      n = nodes_[n].parent;
      nodes_[n].was_on = true;
    }
  }

  // Which cells are filled in which slabs.
  void fill_cells() {
    filled_.assign(plane_.cells.size() * slabs_, 0);
    std::vector<Index> stops, active;
    for (std::size_t c = 0; c < plane_.cells.size(); ++c) {
      const auto& regions = plane_.cells[c].regions;
      stops.clear();
      for (const Index r : regions) {
        stops.push_back(nodes_[r].low_level);
        stops.push_back(nodes_[r].high_level);
      }
      std::sort(stops.begin(), stops.end());
      stops.erase(std::unique(stops.begin(), stops.end()), stops.end());
      for (std::size_t k = 0; k + 1 < stops.size(); ++k) {
        active.clear();
        for (const Index r : regions)
          if (nodes_[r].low_level <= stops[k] && nodes_[r].high_level > stops[k])
            active.push_back(r);
        for (const Index r : active) switch_leaf(r, true);
        for (const Index r : active) remember_what_is_on(r);
        if (nodes_[0].is_on())
          std::fill_n(filled_.begin() + static_cast<std::ptrdiff_t>(c * slabs_ + stops[k]),
                      stops[k + 1] - stops[k], std::uint8_t{1});
        for (const Index r : active) switch_leaf(r, false);
      }
    }
  }

  bool is_filled(std::size_t cell, std::size_t slab) const {  // slab -1 wraps to a large number
    return slab < slabs_ && filled_[cell * slabs_ + slab] != 0;
  }

  // A side is a piece of the boundary: flat(cell, level) or wall(edge, slab).
  bool has_flat(std::size_t cell, std::size_t level) const {
    return is_filled(cell, level - 1) != is_filled(cell, level);
  }
  bool has_wall(std::size_t edge, std::size_t slab) const {
    const Arrangement::Edge& e = plane_.edges[edge];
    return is_filled(e.left, slab) != is_filled(e.right, slab);
  }
  Index wall(std::size_t edge, std::size_t slab) const {
    return static_cast<Index>(edge * slabs_ + slab);
  }
  Index flat(std::size_t cell, std::size_t level) const {
    return static_cast<Index>(plane_.edges.size() * slabs_ + cell * (slabs_ + 1) + level);
  }

  // What lies between two sides: rim(edge, level) and post(vertex, slab). One between two sides of
  // one surface is no edge of the solid.
  enum class Seam : std::uint8_t { none, inner, real, seam };

  bool find_sides() {
    const std::size_t levels = slabs_ + 1;
    sides_.emplace(plane_.edges.size() * slabs_ + plane_.cells.size() * levels);
    rims_.assign(plane_.edges.size() * levels, Seam::none);
    for (std::size_t e = 0; e < plane_.edges.size(); ++e) {
      const auto [left, right] = std::pair{plane_.edges[e].left, plane_.edges[e].right};
      for (std::size_t l = 0; l < levels; ++l) {
        const bool on_left = has_flat(left, l), on_right = has_flat(right, l),
                   below = l > 0 && has_wall(e, l - 1), above = l < slabs_ && has_wall(e, l);
        const int flats = on_left + on_right, walls = below + above;
        if (flats + walls == 0) continue;
        if (flats + walls != 2) return false;  // solids touch along it
        rims_[e * levels + l] = flats == 1 ? Seam::real : Seam::inner;
        if (flats == 2) sides_->join(flat(left, l), flat(right, l));
        if (walls == 2) sides_->join(wall(e, l - 1), wall(e, l));
      }
    }
    posts_.assign(plane_.vertices.size() * slabs_, Seam::none);
    for (std::size_t v = 0; v < plane_.vertices.size(); ++v)
      for (std::size_t s = 0; s < slabs_; ++s) {
        std::array<Index, 2> two{};
        std::size_t count = 0;
        for (const Index e : plane_.vertices[v].edges)
          if (has_wall(e, s)) {
            if (count == 2) return false;  // solids touch along it
            two[count++] = e;
          }
        if (count == 0) continue;
        if (count != 2) return false;
        const bool is_inner = plane_.edges[two[0]].carrier == plane_.edges[two[1]].carrier;
        posts_[v * slabs_ + s] = is_inner ? Seam::inner : Seam::real;
        if (is_inner) sides_->join(wall(two[0], s), wall(two[1], s));
      }
    return true;
  }

  // A face on a cylinder is cut open where it need not be; if it goes all around, along a seam.
  bool choose_seams() {
    for (const auto& carrier : plane_.carriers) {
      if (!carrier.is_circle) continue;
      const std::size_t n = carrier.edges.size();
      // Faces on this circle with, for every edge, the slabs in which they come in across its
      // start.
      std::map<Index, std::vector<std::size_t>> crossings;
      for (std::size_t k = 0; k < n; ++k) {
        const Index e = carrier.edges[k], before = carrier.edges[(k + n - 1) % n];
        const Index v = plane_.edges[e].from;
        for (std::size_t s = 0; s < slabs_; ++s) {
          if (!has_wall(e, s)) continue;
          auto& crossed = crossings[sides_->find(wall(e, s))];
          crossed.resize(n);
          if (plane_.edges[before].to == v && has_wall(before, s) &&
              posts_[v * slabs_ + s] == Seam::inner)
            ++crossed[k];
        }
      }
      for (const auto& [face, crossed] : crossings) {
        const auto best = std::min_element(crossed.begin(), crossed.end());
        const Index e = carrier.edges[static_cast<std::size_t>(best - crossed.begin())];
        opening_[face] = e;
        if (*best == 0) continue;
        const Index v = plane_.edges[e].from;
        for (std::size_t s = 0; s < slabs_; ++s)
          if (has_wall(e, s) && sides_->find(wall(e, s)) == face &&
              posts_[v * slabs_ + s] == Seam::inner)
            posts_[v * slabs_ + s] = Seam::seam;
      }
    }
    return true;
  }

  static bool is_edge(Seam seam) { return seam == Seam::real || seam == Seam::seam; }

  // A corner is where edges end; one between two parts of the same straight or circular edge is
  // none.
  bool find_corners() {
    const std::size_t levels = slabs_ + 1;
    corners_.assign(plane_.vertices.size() * levels, 0);
    for (std::size_t v = 0; v < plane_.vertices.size(); ++v)
      for (std::size_t l = 0; l < levels; ++l) {
        const Seam below = l > 0 ? posts_[v * slabs_ + l - 1] : Seam::none,
                   above = l < slabs_ ? posts_[v * slabs_ + l] : Seam::none;
        int rims = 0;
        Index carrier = kNone;
        bool is_same = true;
        for (const Index e : plane_.vertices[v].edges)
          if (rims_[e * levels + l] == Seam::real) {
            ++rims;
            if (carrier == kNone) carrier = plane_.edges[e].carrier;
            is_same = is_same && carrier == plane_.edges[e].carrier;
          }
        const int posts = is_edge(below) + is_edge(above);
        if (rims + posts == 0) continue;
        if (rims + posts == 1) return false;
        const bool is_none =
            (posts == 2 && rims == 0 && below == above) || (posts == 0 && rims == 2 && is_same);
        corners_[v * levels + l] = is_none ? 0 : 1;
      }
    return true;
  }

  gp_Pnt point(Index v, std::size_t level) const {
    const Point2 p = plane_.vertices[v].p;
    return {p.x, p.y, levels_[level]};
  }

  TopoDS_Vertex corner(Index v, std::size_t level) {
    TopoDS_Vertex& vertex = vertices_[v * (slabs_ + 1) + level];
    if (vertex.IsNull()) builder_.MakeVertex(vertex, point(v, level), kTolerance);
    return vertex;
  }

  TopoDS_Edge edge(const Handle(Geom_Curve) & curve, const TopoDS_Vertex& from,
                   const TopoDS_Vertex& to, double first, double last) {
    TopoDS_Edge e;
    builder_.MakeEdge(e, curve, kTolerance);
    builder_.Add(e, from.Oriented(TopAbs_FORWARD));
    builder_.Add(e, to.Oriented(TopAbs_REVERSED));
    builder_.Range(e, first, last);
    if (from.IsSame(to)) e.Closed(true);
    return e;
  }

  /// An edge of the solid, along its carrier or upwards.
  struct Line {
    TopoDS_Edge edge;
    bool is_post = false;
    Index carrier = 0, from = 0, to = 0;  ///< vertices; equal for posts and whole circles
    std::size_t low = 0, high = 0;        ///< levels; equal for rims
    double start = 0, end = 0;            ///< on the carrier
  };
  struct Use {
    Index line;
    bool is_forward;
    bool at_high_end;  ///< of posts: where the wall ends along its carrier
  };

  bool make_rims() {
    const std::size_t levels = slabs_ + 1;
    vertices_.resize(plane_.vertices.size() * levels);
    for (Index c = 0; c < plane_.carriers.size(); ++c) {
      const auto& edges = plane_.carriers[c].edges;
      const std::size_t n = edges.size();
      for (std::size_t l = 0; l < levels; ++l) {
        const auto is_rim = [&](std::size_t k) {
          return rims_[edges[k] * levels + l] == Seam::real;
        };
        // Whether rim k goes on from the one before.
        const auto goes_on = [&](std::size_t k) {
          const std::size_t before = (k + n - 1) % n;
          return is_rim(before) && plane_.edges[edges[before]].to == plane_.edges[edges[k]].from &&
                 corners_[plane_.edges[edges[k]].from * levels + l] == 0;
        };
        for (std::size_t k = 0; k < n; ++k) {
          if (!is_rim(k) || goes_on(k)) continue;
          std::size_t last = k;
          for (std::size_t next = (k + 1) % n; next != k && is_rim(next) && goes_on(next);
               next = (next + 1) % n)
            last = next;
          add_rim(c, edges[k], edges[last], l);
        }
      }
    }
    return true;
  }

  void add_rim(Index c, Index first, Index last, std::size_t level) {
    const Arrangement::Carrier& carrier = plane_.carriers[c];
    Line line;
    line.carrier = c;
    line.from = plane_.edges[first].from;
    line.to = plane_.edges[last].to;
    line.low = line.high = level;
    line.start = plane_.edges[first].start;
    line.end = plane_.edges[last].end;
    const TopoDS_Vertex from = corner(line.from, level), to = corner(line.to, level);
    const double z = levels_[level];
    if (carrier.is_circle) {
      double sweep = std::fmod(line.end - line.start, kTurn);
      if (sweep <= 0) sweep += kTurn;
      if (line.from == line.to) sweep = kTurn;
      line.end = line.start + sweep;
      const gp_Ax2 axes(gp_Pnt(carrier.origin.x, carrier.origin.y, z), gp_Dir(0, 0, 1),
                        gp_Dir(std::cos(line.start), std::sin(line.start), 0));
      line.edge = edge(new Geom_Circle(axes, carrier.radius), from, to, 0, sweep);
    } else {
      const gp_Pnt origin(carrier.origin.x, carrier.origin.y, z);
      line.edge = edge(new Geom_Line(origin, gp_Dir(carrier.direction.x, carrier.direction.y, 0)),
                       from, to, line.start, line.end);
    }
    const auto number = static_cast<Index>(lines_.size());
    lines_.push_back(line);
    // The flat on its left or right, the wall above or below.
    const Arrangement::Edge& e = plane_.edges[first];
    const bool is_left = has_flat(e.left, level);
    use(flat(is_left ? e.left : e.right, level), {number, is_left, false});
    const bool is_above = level < slabs_ && has_wall(first, level);
    use(wall(first, is_above ? level : level - 1), {number, is_above, false});
  }

  bool make_posts() {
    const std::size_t levels = slabs_ + 1;
    for (Index v = 0; v < plane_.vertices.size(); ++v)
      for (std::size_t s = 0; s < slabs_; ++s) {
        if (!is_edge(posts_[v * slabs_ + s])) continue;
        const std::size_t first = s;
        while (s + 1 < slabs_ && is_edge(posts_[v * slabs_ + s + 1]) &&
               corners_[v * levels + s + 1] == 0)
          ++s;
        Line line;
        line.is_post = true;
        line.from = line.to = v;
        line.low = first;
        line.high = s + 1;
        const Point2 p = plane_.vertices[v].p;
        line.edge = edge(new Geom_Line(gp_Pnt(p.x, p.y, 0), gp_Dir(0, 0, 1)), corner(v, first),
                         corner(v, s + 1), levels_[first], levels_[s + 1]);
        const auto number = static_cast<Index>(lines_.size());
        lines_.push_back(line);
        Index previous = kNone;
        for (const Index e : plane_.vertices[v].edges) {
          if (!has_wall(e, first) || e == previous) continue;
          previous = e;
          // Around a wall seen from its right the end goes up and the start down.
          if (plane_.edges[e].to == v) use(wall(e, first), {number, true, true});
          if (plane_.edges[e].from == v) use(wall(e, first), {number, false, false});
        }
      }
    return true;
  }

  void use(Index side, Use u) {
    const Index face = sides_->find(side);
    auto [place, is_new] = face_of_.try_emplace(face, static_cast<Index>(drafts_.size()));
    if (is_new) drafts_.push_back({face, side, {}, {}, {}});
    drafts_[place->second].uses.push_back(u);
  }

  /// A face to be, by one of its sides.
  struct Draft {
    Index face, side;
    std::vector<Use> uses;
    TopoDS_Face made;
    std::array<std::size_t, 2> material{};  ///< a filled cell and slab behind it
  };

  bool make_faces() {
    Leaders shells(drafts_.size());
    std::vector<Index> user(lines_.size(), kNone);
    for (Index d = 0; d < drafts_.size(); ++d) {
      for (const Use& u : drafts_[d].uses) {
        if (user[u.line] == kNone) user[u.line] = d;
        else shells.join(user[u.line], d);
      }
      const bool is_wall = drafts_[d].side < plane_.edges.size() * slabs_;
      if (!(is_wall ? make_wall(drafts_[d]) : make_flat(drafts_[d]))) return false;
    }
    for (Index d = 0; d < drafts_.size(); ++d) shell_of_.push_back(shells.find(d));
    return true;
  }

  bool make_flat(Draft& draft) {
    const std::size_t number = draft.side - plane_.edges.size() * slabs_;
    const std::size_t cell = number / (slabs_ + 1), level = number % (slabs_ + 1);
    const bool is_top = is_filled(cell, level - 1);
    draft.material = {cell, is_top ? level - 1 : level};
    const Handle(Geom_Plane) plane =
        new Geom_Plane(gp_Ax3(gp_Pnt(0, 0, levels_[level]), gp_Dir(0, 0, 1), gp_Dir(1, 0, 0)));
    builder_.MakeFace(draft.made, plane, kTolerance);
    for (const Use& u : draft.uses) {
      const Line& line = lines_[u.line];
      const Arrangement::Carrier& c = plane_.carriers[line.carrier];
      Handle(Geom2d_Curve) trim;
      if (c.is_circle)
        trim = new Geom2d_Circle(gp_Ax2d(gp_Pnt2d(c.origin.x, c.origin.y),
                                         gp_Dir2d(std::cos(line.start), std::sin(line.start))),
                                 c.radius);
      else
        trim = new Geom2d_Line(gp_Pnt2d(c.origin.x, c.origin.y),
                               gp_Dir2d(c.direction.x, c.direction.y));
      builder_.UpdateEdge(line.edge, trim, draft.made, kTolerance);
    }
    const auto area_under = [&](const Use& u) {
      const Line& line = lines_[u.line];
      const Arrangement::Carrier& c = plane_.carriers[line.carrier];
      const Point2 base = plane_.vertices[0].p, p = plane_.vertices[line.from].p,
                   q = plane_.vertices[line.to].p;
      double twice = (p.x - base.x) * (q.y - base.y) - (p.y - base.y) * (q.x - base.x);
      if (c.is_circle) {
        const double sweep = line.end - line.start;
        twice += c.radius * c.radius * (sweep - std::sin(sweep));
      }
      return u.is_forward ? twice / 2 : -twice / 2;
    };
    const auto start = [&](const Use& u) {
      return std::uint64_t{u.is_forward ? lines_[u.line].from : lines_[u.line].to};
    };
    const auto end = [&](const Use& u) {
      return std::uint64_t{u.is_forward ? lines_[u.line].to : lines_[u.line].from};
    };
    if (!add_loops(draft, start, end, area_under)) return false;
    if (!is_top) draft.made.Reverse();
    return true;
  }

  bool make_wall(Draft& draft) {
    const std::size_t e = draft.side / slabs_, slab = draft.side % slabs_;
    const Arrangement::Edge& side = plane_.edges[e];
    const Arrangement::Carrier& c = plane_.carriers[side.carrier];
    const bool is_left = is_filled(side.left, slab);
    draft.material = {is_left ? side.left : side.right, slab};
    Index opening = kNone;
    double u0 = 0;
    if (c.is_circle) {
      const Arrangement::Edge& open = plane_.edges[opening_.at(draft.face)];
      opening = open.from;
      u0 = open.start;
      builder_.MakeFace(
          draft.made,
          new Geom_CylindricalSurface(gp_Ax3(gp_Pnt(c.origin.x, c.origin.y, 0), gp_Dir(0, 0, 1),
                                             gp_Dir(std::cos(u0), std::sin(u0), 0)),
                                      c.radius),
          kTolerance);
    } else {
      builder_.MakeFace(draft.made,
                        new Geom_Plane(gp_Ax3(gp_Pnt(c.origin.x, c.origin.y, 0),
                                              gp_Dir(c.direction.y, -c.direction.x, 0),
                                              gp_Dir(c.direction.x, c.direction.y, 0))),
                        kTolerance);
    }
    const auto u_at = [&](Index v, bool at_high_end) {
      const Point2 p = plane_.vertices[v].p;
      if (!c.is_circle)
        return (p.x - c.origin.x) * c.direction.x + (p.y - c.origin.y) * c.direction.y;
      if (v == opening) return at_high_end ? kTurn : 0;
      return wrapped_turn(std::atan2(p.y - c.origin.y, p.x - c.origin.x) - u0);
    };
    for (const Use& u : draft.uses) {
      const Line& line = lines_[u.line];
      if (line.is_post) {
        const auto trim = [&](bool at_high_end) -> Handle(Geom2d_Curve) {
          return new Geom2d_Line(gp_Pnt2d(u_at(line.from, at_high_end), 0), gp_Dir2d(0, 1));
        };
        const bool is_seam = posts_[line.from * slabs_ + line.low] == Seam::seam;
        if (!is_seam) {
          builder_.UpdateEdge(line.edge, trim(u.at_high_end), draft.made, kTolerance);
        } else if (u.at_high_end) {
          builder_.UpdateEdge(line.edge, trim(true), trim(false), draft.made, kTolerance);
          builder_.Continuity(line.edge, draft.made, draft.made, GeomAbs_CN);
        }
      } else {
        const double shift =
            c.is_circle ? (line.from == opening ? 0 : wrapped_turn(line.start - u0)) : 0;
        builder_.UpdateEdge(line.edge,
                            new Geom2d_Line(gp_Pnt2d(shift, levels_[line.low]), gp_Dir2d(1, 0)),
                            draft.made, kTolerance);
      }
    }
    // Corners, with the opening once at either end.
    const auto at = [&](Index v, std::size_t level, bool at_high_end) {
      return (std::uint64_t{v} * (slabs_ + 1) + level) * 2 + (v == opening && at_high_end);
    };
    const auto at_end = [&](const Use& u, bool upper) {
      const Line& line = lines_[u.line];
      if (line.is_post) return at(line.from, upper ? line.high : line.low, u.at_high_end);
      return at(upper ? line.to : line.from, line.low, upper);
    };
    const auto start = [&](const Use& u) { return at_end(u, !u.is_forward); };
    const auto end = [&](const Use& u) { return at_end(u, u.is_forward); };
    const auto area_under = [&](const Use& u) {
      const Line& line = lines_[u.line];
      if (line.is_post) return 0.0;
      const double area = -(levels_[line.low] - levels_[0]) * (line.end - line.start);
      return u.is_forward ? area : -area;
    };
    if (!add_loops(draft, start, end, area_under)) return false;
    if (!is_left) draft.made.Reverse();
    return true;
  }

  // Follows the uses from corner to corner; the one loop with positive area is the outer one.
  template <class Start, class End, class Area>
  bool add_loops(Draft& draft, const Start& start, const End& end, const Area& area_under) {
    std::unordered_map<std::uint64_t, Index> leaving;
    leaving.reserve(draft.uses.size());
    for (Index i = 0; i < draft.uses.size(); ++i)
      if (!leaving.try_emplace(start(draft.uses[i]), i).second) return false;  // a pinch
    std::vector<bool> is_done(draft.uses.size(), false);
    std::vector<TopoDS_Wire> wires;
    std::size_t outer = 0, outer_count = 0;
    for (Index i = 0; i < draft.uses.size(); ++i) {
      if (is_done[i]) continue;
      TopoDS_Wire wire;
      builder_.MakeWire(wire);
      double area = 0;
      Index at = i;
      do {
        is_done[at] = true;
        const Use& u = draft.uses[at];
        area += area_under(u);
        builder_.Add(wire,
                     lines_[u.line].edge.Oriented(u.is_forward ? TopAbs_FORWARD : TopAbs_REVERSED));
        const auto next = leaving.find(end(u));
        if (next == leaving.end()) return false;
        at = next->second;
      } while (!is_done[at]);
      if (at != i) return false;
      wire.Closed(true);
      if (area > 0) {
        outer = wires.size();
        ++outer_count;
      }
      wires.push_back(wire);
    }
    if (outer_count != 1) return false;
    std::swap(wires[0], wires[outer]);
    for (const TopoDS_Wire& wire : wires) builder_.Add(draft.made, wire);
    return true;
  }

  bool make_solids(PrismaticOutcome& outcome) {
    // Pieces of material: filled cells joined across open sides.
    Leaders pieces(plane_.cells.size() * slabs_);
    const auto block = [&](std::size_t c, std::size_t s) {
      return static_cast<Index>(c * slabs_ + s);
    };
    for (std::size_t c = 0; c < plane_.cells.size(); ++c)
      for (std::size_t s = 0; s + 1 < slabs_; ++s)
        if (is_filled(c, s) && is_filled(c, s + 1)) pieces.join(block(c, s), block(c, s + 1));
    for (const auto& e : plane_.edges)
      for (std::size_t s = 0; s < slabs_; ++s)
        if (is_filled(e.left, s) && is_filled(e.right, s))
          pieces.join(block(e.left, s), block(e.right, s));
    std::map<Index, double> volumes;
    for (std::size_t c = 0; c < plane_.cells.size(); ++c)
      for (std::size_t s = 0; s < slabs_; ++s)
        if (is_filled(c, s))
          volumes[pieces.find(block(c, s))] += plane_.cells[c].area * (levels_[s + 1] - levels_[s]);

    struct Shell {
      Index piece = 0;
      TopoDS_Shell shell;
      Bnd_Box box;
    };
    std::map<Index, Shell> shells;
    for (Index d = 0; d < drafts_.size(); ++d) {
      const Draft& draft = drafts_[d];
      auto [place, is_new] = shells.try_emplace(shell_of_[d]);
      Shell& shell = place->second;
      const Index piece = pieces.find(block(draft.material[0], draft.material[1]));
      if (is_new) {
        builder_.MakeShell(shell.shell);
        shell.piece = piece;
      } else if (shell.piece != piece) {
        return false;
      }
      builder_.Add(shell.shell, draft.made);
      for (const Use& u : draft.uses) widen(shell.box, lines_[u.line]);
    }
    std::map<Index, std::vector<Shell*>> by_piece;
    for (auto& [number, shell] : shells) {
      shell.shell.Closed(true);
      by_piece[shell.piece].push_back(&shell);
    }
    if (by_piece.size() != volumes.size()) return false;
    for (auto& [piece, list] : by_piece) {
      // The outer shell holds the others.
      const auto outer = std::max_element(list.begin(), list.end(), [](Shell* a, Shell* b) {
        return a->box.SquareExtent() < b->box.SquareExtent();
      });
      std::iter_swap(list.begin(), outer);
      TopoDS_Solid made;
      builder_.MakeSolid(made);
      for (const Shell* shell : list) builder_.Add(made, shell->shell);
      Solid solid;
      solid.shape = is_turned_ ? placed(made, frame_) : TopoDS_Shape(made);
      solid.box = list[0]->box;
      solid.box.SetGap(2 * kTolerance);
      if (is_turned_) solid.box = solid.box.Transformed(frame_);
      solid.volume = faces_.of(solid.shape).volume;
      const double expected = volumes.at(piece);
      if (!(expected > 0) || !(std::abs(solid.volume - expected) <= kVolumeAgreement * expected))
        return false;
      outcome.solids.push_back(std::move(solid));
    }
    for (const Solid& solid : outcome.solids) faces_.set_verified(solid.shape);
    return !outcome.solids.empty();
  }

  void widen(Bnd_Box& box, const Line& line) const {
    box.Add(point(line.from, line.low));
    box.Add(point(line.to, line.high));
    const Arrangement::Carrier& c = plane_.carriers[line.carrier];
    if (line.is_post || !c.is_circle) return;
    const double z = levels_[line.low];
    for (int k = 0; k < 4; ++k)
      if (wrapped_turn(k * kTurn / 4 - line.start) < line.end - line.start) {
        const double dx = k == 0 ? 1 : k == 2 ? -1 : 0, dy = k == 1 ? 1 : k == 3 ? -1 : 0;
        box.Add(gp_Pnt(c.origin.x + dx * c.radius, c.origin.y + dy * c.radius, z));
      }
  }

  void report_idle_tools(PrismaticOutcome& outcome) const {
    for (const Node& n : nodes_) {
      if (&n == &nodes_[0] || n.item == 0 || n.has_cut ||
          nodes_[n.parent].kind != CsgKind::difference)
        continue;
      Note note{{}, "cuts nothing: it does not reach the solid"};
      for (const Node* at = &n; at != &nodes_[0]; at = &nodes_[at->parent])
        note.path.insert(note.path.begin(), at->item);
      outcome.notes.push_back(std::move(note));
    }
  }

  const Plan& plan_;
  std::size_t root_;
  FaceMemory& faces_;
  const Progress& progress_;
  BRep_Builder builder_;
  std::vector<Node> nodes_;  // parents first
  bool is_turned_ = false;
  gp_Trsf frame_;  // of the sections, in the term's frame
  std::vector<BorderPiece> borders_;
  std::vector<double> levels_;
  std::size_t slabs_ = 0;
  Arrangement plane_;
  std::vector<std::uint8_t> filled_, corners_;
  std::vector<Seam> rims_, posts_;
  std::optional<Leaders> sides_;              // joined to faces
  std::unordered_map<Index, Index> opening_;  // of faces on cylinders: the edge at whose start
  std::vector<TopoDS_Vertex> vertices_;
  std::vector<Line> lines_;
  std::unordered_map<Index, Index> face_of_;
  std::vector<Draft> drafts_;
  std::vector<Index> shell_of_;
};

}  // namespace

std::optional<PrismaticOutcome> build_prismatic(const Plan& plan, std::size_t term,
                                                FaceMemory& faces, const Progress& progress,
                                                std::size_t& looked_at) {
  PrismaticBuilder builder(plan, term, faces, progress);
  auto outcome = builder.run();
  looked_at = builder.looked_at();
  return outcome;
}

}  // namespace robomosp::csg_occt
