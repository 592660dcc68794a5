// SPDX-License-Identifier: Apache-2.0
#include "evaluation/kept.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <type_traits>
#include <utility>

namespace robomosp::evaluation {
namespace {

class Writer {
 public:
  template <class T>
  void number(T v) {
    static_assert(std::is_arithmetic_v<T>);
    out_.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  template <class... T>
  void numbers(T... v) {
    (number(v), ...);
  }
  void vec(const Vec3& v) {
    for (const double x : v) number(x);
  }
  void sym(const Sym3& s) { numbers(s.xx, s.yy, s.zz, s.xy, s.yz, s.xz); }
  template <class T>
  void array(const std::vector<T>& v) {
    number(std::uint64_t{v.size()});
    out_.append(reinterpret_cast<const char*>(v.data()), v.size() * sizeof(T));
  }
  void text(std::string_view s) {
    number(std::uint64_t{s.size()});
    out_.append(s);
  }
  [[nodiscard]] std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

/// Every read says whether there was something to read; a value is checked with it.
class Reader {
 public:
  explicit Reader(std::string_view s) : rest_(s) {}
  template <class T>
  [[nodiscard]] bool number(T& v) {
    if (rest_.size() < sizeof v) return false;
    std::memcpy(&v, rest_.data(), sizeof v);
    rest_.remove_prefix(sizeof v);
    if constexpr (std::is_floating_point_v<T>) return std::isfinite(v);
    return true;
  }
  template <class... T>
  [[nodiscard]] bool numbers(T&... v) {
    return (number(v) && ...);
  }
  [[nodiscard]] bool flag(bool& v) {
    std::uint8_t byte = 0;
    if (!number(byte) || byte > 1) return false;
    v = byte == 1;
    return true;
  }
  [[nodiscard]] bool vec(Vec3& v) { return numbers(v[0], v[1], v[2]); }
  [[nodiscard]] bool sym(Sym3& s) { return numbers(s.xx, s.yy, s.zz, s.xy, s.yz, s.xz); }
  /// A number of things that take at least `least` bytes each.
  [[nodiscard]] bool count(std::size_t& n, std::size_t least) {
    std::uint64_t size = 0;
    if (!number(size) || size > rest_.size() / least) return false;
    n = static_cast<std::size_t>(size);
    return true;
  }
  template <class T>
  [[nodiscard]] bool array(std::vector<T>& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::size_t n = 0;
    if (!count(n, sizeof(T))) return false;
    v.resize(n);
    if (n > 0) std::memcpy(v.data(), rest_.data(), n * sizeof(T));
    rest_.remove_prefix(n * sizeof(T));
    if constexpr (std::is_floating_point_v<T>)
      for (const T x : v)
        if (!std::isfinite(x)) return false;
    return true;
  }
  [[nodiscard]] bool text(std::string& s) {
    std::size_t n = 0;
    if (!count(n, 1)) return false;
    s.assign(rest_.substr(0, n));
    rest_.remove_prefix(n);
    return true;
  }
  [[nodiscard]] bool is_at_end() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

void put(Writer& w, const Mesh& m) {
  static_assert(sizeof(Mesh::Face) == 16);  // without holes: its bytes are its value
  w.array(m.positions);
  w.array(m.normals);
  w.array(m.triangles);
  w.array(m.faces);
  w.array(m.edge_points);
  w.array(m.edge_sizes);
}

bool get(Reader& r, Mesh& m) {
  if (!r.array(m.positions) || !r.array(m.normals) || !r.array(m.triangles) || !r.array(m.faces) ||
      !r.array(m.edge_points) || !r.array(m.edge_sizes))
    return false;
  if (m.positions.size() % 3 != 0 || m.triangles.size() % 3 != 0 || m.triangles.empty() ||
      m.normals.size() != m.positions.size())
    return false;
  const std::size_t vertices = m.vertex_count(), triangles = m.triangle_count();
  for (const std::uint32_t i : m.triangles)
    if (i >= vertices) return false;
  for (const Mesh::Face& f : m.faces)
    if (std::uint64_t{f.first_triangle} + f.triangle_count > triangles) return false;
  std::uint64_t points = 0;
  for (const std::uint32_t n : m.edge_sizes) points += n;
  return points * 3 == m.edge_points.size();
}

void put(Writer& w, const Moments& m) {
  w.numbers(m.volume, m.area);
  w.vec(m.first);
  w.sym(m.second);
  w.number(static_cast<std::uint8_t>(m.exact));
  w.number(m.relative_error);
}

bool get(Reader& r, Moments& m) {
  return r.numbers(m.volume, m.area) && r.vec(m.first) && r.sym(m.second) && r.flag(m.exact) &&
         r.number(m.relative_error);
}

void put(Writer& w, const Pose& p) {
  for (const double x : p.R) w.number(x);
  w.vec(p.p);
}

bool get(Reader& r, Pose& p) {
  for (double& x : p.R)
    if (!r.number(x)) return false;
  return r.vec(p.p);
}

void put(Writer& w, const std::optional<Vec3>& v) {
  w.number(static_cast<std::uint8_t>(v.has_value()));
  if (v) w.vec(*v);
}

bool get(Reader& r, std::optional<Vec3>& v) {
  bool is_there = false;
  if (!r.flag(is_there)) return false;
  if (!is_there) return true;
  v.emplace();
  return r.vec(*v);
}

template <class T, class Get>
bool whole(std::string_view bytes, T& out, Get&& get) {
  Reader r(bytes);
  T made{};
  if (!get(r, made) || !r.is_at_end()) return false;
  out = std::move(made);
  return true;
}

}  // namespace

std::string to_bytes(const SolidFacts& f) {
  Writer w;
  for (const Vec3& corner : f.bounds) w.vec(corner);
  w.number(std::uint64_t{f.notes.size()});
  for (const std::string& note : f.notes) w.text(note);
  return w.take();
}

bool from_bytes(std::string_view bytes, SolidFacts& out) {
  return whole(bytes, out, [](Reader& r, SolidFacts& f) {
    std::size_t notes = 0;
    if (!r.vec(f.bounds[0]) || !r.vec(f.bounds[1]) || !r.count(notes, sizeof(std::uint64_t)))
      return false;
    f.notes.resize(notes);
    for (std::string& note : f.notes)
      if (!r.text(note)) return false;
    for (std::size_t k = 0; k < 3; ++k)
      if (f.bounds[0][k] > f.bounds[1][k]) return false;
    return true;
  });
}

std::string to_bytes(const Mesh& m) {
  Writer w;
  put(w, m);
  return w.take();
}

bool from_bytes(std::string_view bytes, Mesh& out) {
  return whole(bytes, out, [](Reader& r, Mesh& m) { return get(r, m); });
}

std::string to_bytes(const Moments& m) {
  Writer w;
  put(w, m);
  return w.take();
}

bool from_bytes(std::string_view bytes, Moments& out) {
  return whole(bytes, out, [](Reader& r, Moments& m) { return get(r, m); });
}

std::string to_bytes(const std::vector<CsgFeature>& all) {
  Writer w;
  w.number(std::uint64_t{all.size()});
  for (const CsgFeature& f : all) {
    w.number(static_cast<std::int32_t>(f.kind));
    w.vec(f.point);
    w.vec(f.direction);
    w.numbers(f.radius, f.size, static_cast<std::uint8_t>(f.inward));
  }
  return w.take();
}

bool from_bytes(std::string_view bytes, std::vector<CsgFeature>& out) {
  return whole(bytes, out, [](Reader& r, std::vector<CsgFeature>& all) {
    constexpr std::size_t kBytes = 4 + 8 * sizeof(double) + 1;
    std::size_t n = 0;
    if (!r.count(n, kBytes)) return false;
    all.resize(n);
    for (CsgFeature& f : all) {
      std::int32_t kind = 0;
      if (!r.number(kind) || kind < 0 || kind > static_cast<std::int32_t>(CsgFeature::Kind::other))
        return false;
      f.kind = static_cast<CsgFeature::Kind>(kind);
      if (!r.vec(f.point) || !r.vec(f.direction) || !r.numbers(f.radius, f.size) ||
          !r.flag(f.inward))
        return false;
    }
    return true;
  });
}

std::string to_bytes(const CsgEngine::Partition& p) {
  Writer w;
  w.number(p.overlap);
  w.number(std::uint64_t{p.parts.size()});
  for (const Moments& m : p.parts) put(w, m);
  return w.take();
}

bool from_bytes(std::string_view bytes, CsgEngine::Partition& out) {
  return whole(bytes, out, [](Reader& r, CsgEngine::Partition& p) {
    std::size_t n = 0;
    if (!r.number(p.overlap) || !r.count(n, 12 * sizeof(double))) return false;
    p.parts.resize(n);
    for (Moments& m : p.parts)
      if (!get(r, m)) return false;
    return true;
  });
}

std::string to_bytes(const std::vector<ShapePiece>& pieces) {
  Writer w;
  std::map<const void*, std::uint64_t> known;
  std::vector<const Mesh*> meshes;
  std::vector<const std::vector<Vec3>*> corners;
  for (const ShapePiece& p : pieces) {
    if (p.mesh && known.emplace(p.mesh.get(), meshes.size()).second) meshes.push_back(p.mesh.get());
    if (p.corners && known.emplace(p.corners.get(), corners.size()).second)
      corners.push_back(p.corners.get());
  }
  w.number(std::uint64_t{meshes.size()});
  for (const Mesh* m : meshes) put(w, *m);
  w.number(std::uint64_t{corners.size()});
  for (const auto* c : corners) w.array(*c);
  // 0 = none, else the number in its list and 1.
  const auto number_of = [&](const void* p) { return p ? known.at(p) + 1 : std::uint64_t{0}; };
  w.number(std::uint64_t{pieces.size()});
  for (const ShapePiece& p : pieces) {
    w.number(static_cast<std::int32_t>(p.kind));
    w.vec(p.sizes);
    put(w, p.pose);
    w.numbers(number_of(p.mesh.get()), number_of(p.corners.get()));
    put(w, p.cone);
    put(w, p.ellipsoid);
    w.number(std::uint64_t{p.sides});
    w.number(static_cast<std::uint8_t>(p.outside != nullptr));
    if (!p.outside) continue;
    put(w, p.outside->pose);
    w.number(p.outside->sphere);
    w.array(p.outside->profile);
  }
  return w.take();
}

bool from_bytes(std::string_view bytes, std::vector<ShapePiece>& out) {
  return whole(bytes, out, [](Reader& r, std::vector<ShapePiece>& pieces) {
    std::vector<std::shared_ptr<const Mesh>> meshes;
    std::vector<std::shared_ptr<const std::vector<Vec3>>> corners;
    std::size_t n = 0;
    if (!r.count(n, 6 * sizeof(std::uint64_t))) return false;
    for (std::size_t i = 0; i < n; ++i) {
      Mesh m;
      if (!get(r, m)) return false;
      meshes.push_back(std::make_shared<const Mesh>(std::move(m)));
    }
    if (!r.count(n, sizeof(std::uint64_t))) return false;
    for (std::size_t i = 0; i < n; ++i) {
      std::vector<Vec3> all;
      if (!r.array(all)) return false;
      for (const Vec3& p : all)
        for (const double x : p)
          if (!std::isfinite(x)) return false;
      corners.push_back(std::make_shared<const std::vector<Vec3>>(std::move(all)));
    }
    if (!r.count(n, 17 * sizeof(double))) return false;
    pieces.resize(n);
    for (ShapePiece& p : pieces) {
      std::int32_t kind = 0;
      std::uint64_t mesh = 0, corner = 0;
      if (!r.number(kind) || kind < 0 || kind > static_cast<std::int32_t>(ShapeKind::ellipsoid) ||
          !r.vec(p.sizes) || !get(r, p.pose) || !r.numbers(mesh, corner) || mesh > meshes.size() ||
          corner > corners.size() || !get(r, p.cone) || !get(r, p.ellipsoid))
        return false;
      bool is_round = false;
      std::uint64_t sides = 0;
      if (!r.number(sides)) return false;
      p.sides = static_cast<std::size_t>(sides);
      if (!r.flag(is_round)) return false;
      if (is_round) {
        RoundOutside o;
        if (!get(r, o.pose) || !r.number(o.sphere) || !r.array(o.profile)) return false;
        for (const auto& circle : o.profile)
          if (!std::isfinite(circle[0]) || !std::isfinite(circle[1])) return false;
        p.outside = std::make_shared<const RoundOutside>(std::move(o));
      }
      p.kind = static_cast<ShapeKind>(kind);
      if (mesh > 0) p.mesh = meshes[mesh - 1];
      if (corner > 0) p.corners = corners[corner - 1];
      const bool needs_mesh = p.kind == ShapeKind::mesh || p.kind == ShapeKind::convex;
      if (needs_mesh && !p.mesh) return false;
    }
    return true;
  });
}

}  // namespace robomosp::evaluation
