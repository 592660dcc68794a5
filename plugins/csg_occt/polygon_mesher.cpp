// SPDX-License-Identifier: Apache-2.0
#include "polygon_mesher.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace robomosp::csg_occt {
namespace {

// The triangles must fill the region: a share of its area that only rounding explains.
constexpr double kFilled = 1e-9;

class Sweep {
 public:
  using Index = std::uint32_t;
  Sweep(const std::vector<PolygonCorner>& corners, const std::vector<Index>& next)
      : p_(corners), next_(next), previous_(corners.size()), region_of_(corners.size(), kNone) {
    for (Index i = 0; i < next.size(); ++i) previous_[next[i]] = i;
  }

  std::optional<std::vector<std::array<Index, 3>>> run() {
    std::vector<Index> order(p_.size());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return is_below(a, b); });
    triangles_.reserve(p_.size() + 64);
    for (const Index v : order)
      if (!take(v)) return {};
    if (!active_.empty()) return {};
    double area = 0;
    for (Index i = 0; i < p_.size(); ++i) {
      const PolygonCorner &a = p_[i], &b = p_[next_[i]];
      area += (a.x - p_[0].x) * (b.y - p_[0].y) - (a.y - p_[0].y) * (b.x - p_[0].x);
    }
    if (!(std::abs(filled_ - area) <= kFilled * area)) return {};
    return std::move(triangles_);
  }

 private:
  static constexpr Index kNone = ~Index{0};
  enum class Flank : std::uint8_t { left, right };

  // A part of the region between two sides that the sweep has reached, with the corners that are
  // not yet in triangles. Side i goes from corner i to the next.
  struct Region {
    Index left = kNone, right = kNone;  ///< sides
    std::vector<Index> chain;           ///< upwards; all but the first are on one flank
    Flank flank = Flank::left;
    Index pending = kNone;  ///< the part to the right of a corner where two regions met
  };

  bool is_below(Index a, Index b) const {
    if (p_[a].y != p_[b].y) return p_[a].y < p_[b].y;
    return p_[a].x != p_[b].x ? p_[a].x < p_[b].x : a < b;
  }
  double turn(Index a, Index b, Index c) const {
    return (p_[b].x - p_[a].x) * (p_[c].y - p_[a].y) - (p_[b].y - p_[a].y) * (p_[c].x - p_[a].x);
  }
  // Positive when the corner is to the left of the side, looking up.
  double left_of(Index corner, Index side) const {
    Index low = side, high = next_[side];
    if (!is_below(low, high)) std::swap(low, high);
    return turn(low, high, corner);
  }

  void triangle(Index a, Index b, Index c) {
    const double twice = turn(a, b, c);
    filled_ += std::abs(twice);
    if (twice >= 0) triangles_.push_back({a, b, c});
    else triangles_.push_back({a, c, b});
  }

  void add(Index region, Index v, Flank flank) {
    Region& r = regions_[region];
    std::vector<Index>& chain = r.chain;
    if (chain.size() > 1 && flank != r.flank) {
      for (std::size_t k = 0; k + 1 < chain.size(); ++k) triangle(chain[k], chain[k + 1], v);
      chain.erase(chain.begin(), chain.end() - 1);
    } else {
      while (chain.size() > 1) {
        const double t = turn(chain[chain.size() - 2], chain.back(), v);
        if (flank == Flank::right ? t <= 0 : t >= 0) break;
        triangle(chain[chain.size() - 2], chain.back(), v);
        chain.pop_back();
      }
    }
    chain.push_back(v);
    r.flank = flank;
  }

  void close(Index region, Index v) {
    const std::vector<Index>& chain = regions_[region].chain;
    for (std::size_t k = 0; k + 1 < chain.size(); ++k) triangle(chain[k], chain[k + 1], v);
  }

  // A corner on the left flank: of two parts the left one ends here.
  void add_left(Index region, Index v) {
    if (const Index other = regions_[region].pending; other != kNone) {
      close(region, v);
      adopt(region, other);
    }
    add(region, v, Flank::left);
  }
  void add_right(Index region, Index v) {
    if (const Index other = regions_[region].pending; other != kNone) {
      close(other, v);
      regions_[region].pending = kNone;
    }
    add(region, v, Flank::right);
  }
  void adopt(Index region, Index part) {
    regions_[region].chain = std::move(regions_[part].chain);
    regions_[region].flank = regions_[part].flank;
    regions_[region].pending = kNone;
  }

  void set_sides(Index region, Index left, Index right) {
    regions_[region].left = left;
    regions_[region].right = right;
    region_of_[left] = region_of_[right] = region;
  }

  /// The first active region with its right side to the right of the corner.
  std::size_t place_of(Index v) const {
    return static_cast<std::size_t>(
        std::partition_point(active_.begin(), active_.end(),
                             [&](Index r) { return left_of(v, regions_[r].right) <= 0; }) -
        active_.begin());
  }

  bool take(Index v) {
    const Index p = previous_[v], n = next_[v];
    const bool p_above = is_below(v, p), n_above = is_below(v, n);
    const bool is_convex = turn(p, v, n) > 0;
    if (p_above && n_above) return is_convex ? start(v) : split(v);
    if (!p_above && !n_above) return is_convex ? end(v) : merge(v);
    const Index ended = n_above ? p : v, begun = n_above ? v : p;
    const Index region = region_of_[ended];
    if (region == kNone) return false;
    if (n_above) {
      if (regions_[region].right != ended) return false;
      add_right(region, v);
      set_sides(region, regions_[region].left, begun);
    } else {
      if (regions_[region].left != ended) return false;
      add_left(region, v);
      set_sides(region, begun, regions_[region].right);
    }
    return true;
  }

  bool start(Index v) {
    const std::size_t place = place_of(v);
    if (place < active_.size() && left_of(v, regions_[active_[place]].left) < 0) return false;
    const auto region = static_cast<Index>(regions_.size());
    regions_.emplace_back();
    regions_[region].chain = {v};
    set_sides(region, previous_[v], v);
    active_.insert(active_.begin() + static_cast<std::ptrdiff_t>(place), region);
    return true;
  }

  bool split(Index v) {
    const std::size_t place = place_of(v);
    if (place == active_.size()) return false;
    const Index left = active_[place];
    if (left_of(v, regions_[left].left) >= 0) return false;
    const auto right = static_cast<Index>(regions_.size());
    regions_.emplace_back();
    const Index outer_right = regions_[left].right;
    if (const Index other = regions_[left].pending; other != kNone) {
      adopt(right, other);
      regions_[left].pending = kNone;
      add(left, v, Flank::right);
      add(right, v, Flank::left);
    } else {
      // A cut to the uppermost corner below; the chain stays with the part on its flank's far side.
      Region &l = regions_[left], &r = regions_[right];
      const Index top = l.chain.back();
      if (l.flank == Flank::left || l.chain.size() == 1) {
        r.chain = std::move(l.chain);
        r.flank = Flank::left;
        l.chain = {top, v};
        l.flank = Flank::right;
        add(right, v, Flank::left);
      } else {
        r.chain = {top, v};
        r.flank = Flank::left;
        add(left, v, Flank::right);
      }
    }
    set_sides(left, regions_[left].left, v);
    set_sides(right, previous_[v], outer_right);
    active_.insert(active_.begin() + static_cast<std::ptrdiff_t>(place) + 1, right);
    return true;
  }

  bool end(Index v) {
    const Index region = region_of_[v];
    if (region == kNone || region_of_[previous_[v]] != region || regions_[region].left != v)
      return false;
    close(region, v);
    if (regions_[region].pending != kNone) close(regions_[region].pending, v);
    return remove(region);
  }

  bool merge(Index v) {
    const Index left = region_of_[previous_[v]], right = region_of_[v];
    if (left == kNone || right == kNone || left == right || regions_[left].right != previous_[v] ||
        regions_[right].left != v)
      return false;
    add_right(left, v);
    add_left(right, v);
    if (!remove(right)) return false;
    regions_[left].pending = right;
    set_sides(left, regions_[left].left, regions_[right].right);
    return true;
  }

  bool remove(Index region) {
    const auto place = std::find(active_.begin(), active_.end(), region);
    if (place == active_.end()) return false;
    active_.erase(place);
    return true;
  }

  const std::vector<PolygonCorner>& p_;
  const std::vector<Index>& next_;
  std::vector<Index> previous_, region_of_;  // region_of_: of sides
  std::vector<Region> regions_;
  std::vector<Index> active_;  // from left to right
  std::vector<std::array<Index, 3>> triangles_;
  double filled_ = 0;  // twice the area
};

}  // namespace

std::optional<std::vector<std::array<std::uint32_t, 3>>> triangulate_polygon(
    const std::vector<PolygonCorner>& corners, const std::vector<std::uint32_t>& next) {
  if (corners.size() < 3) return {};
  return Sweep(corners, next).run();
}

}  // namespace robomosp::csg_occt
