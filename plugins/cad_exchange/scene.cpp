// SPDX-License-Identifier: Apache-2.0
#include "scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "spatial/pose.h"

namespace robomosp::cad_exchange {
namespace {

constexpr std::string_view kMagic = "RMPXCHG1", kEnd = "RMPXEND.";
enum class Kind : std::uint8_t { error = 0, scene = 1, file = 2 };
/// More of anything is a damaged count, not a model.
constexpr std::uint64_t kMostNodes = 1'000'000;
constexpr double kFarthestVertex = 1e9;  // [m]
constexpr double kRigidTolerance = 1e-6;

class Writer {
 public:
  explicit Writer(Kind kind) : out_(kMagic) { u8(static_cast<std::uint8_t>(kind)); }
  void u8(std::uint8_t v) { out_ += static_cast<char>(v); }
  void u64(std::uint64_t v) {
    for (int i = 0; i < 8; ++i) out_ += static_cast<char>((v >> (8 * i)) & 0xFFU);
  }
  void i32(std::int32_t v) { u64(static_cast<std::uint64_t>(static_cast<std::int64_t>(v))); }
  void real(double v) {
    std::uint64_t w = 0;
    std::memcpy(&w, &v, 8);
    u64(w);
  }
  void text(std::string_view s) {
    u64(s.size());
    out_ += s;
  }
  void reals(const std::vector<double>& v) {
    u64(v.size());
    for (const double x : v) real(x);
  }
  void indices(const std::vector<std::uint32_t>& v) {
    u64(v.size());
    for (const std::uint32_t x : v)
      for (int i = 0; i < 4; ++i) out_ += static_cast<char>((x >> (8 * i)) & 0xFFU);
  }
  void paint(const Paint& p) {
    u8(p.known ? 1 : 0);
    for (const float c : {p.colour.r, p.colour.g, p.colour.b, p.colour.a})
      real(static_cast<double>(c));
  }
  void pose(const Pose& t) {
    for (const double x : t.R) real(x);
    for (const double x : t.p) real(x);
  }
  std::string finish() {
    out_ += kEnd;
    return std::move(out_);
  }

 private:
  std::string out_;
};

/// Reads within its bounds; once something is missing, everything reads as zero and ok() is false.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] bool at_end() const { return ok_ && rest_.empty(); }
  std::string_view take(std::uint64_t n) {
    if (n > rest_.size()) {
      ok_ = false;
      rest_ = {};
      return {};
    }
    const std::string_view part = rest_.substr(0, static_cast<std::size_t>(n));
    rest_.remove_prefix(static_cast<std::size_t>(n));
    return part;
  }
  std::uint8_t u8() {
    const auto b = take(1);
    return b.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(b[0]);
  }
  std::uint64_t u64() { return word(8); }
  std::int32_t i32() {
    const auto v = static_cast<std::int64_t>(u64());
    if (v < INT32_MIN || v > INT32_MAX) ok_ = false;
    return static_cast<std::int32_t>(v);
  }
  double real() {
    const std::uint64_t w = u64();
    double v = 0;
    std::memcpy(&v, &w, 8);
    return v;
  }
  std::string text() { return std::string(take(u64())); }
  /// A count of things of at least `size` bytes each; never more than there are bytes for.
  std::size_t count(std::size_t size) {
    const std::uint64_t n = u64();
    if (n > rest_.size() / size) {
      ok_ = false;
      return 0;
    }
    return static_cast<std::size_t>(n);
  }
  std::vector<double> reals() {
    std::vector<double> v(count(8));
    for (double& x : v) x = real();
    return v;
  }
  std::vector<std::uint32_t> indices() {
    std::vector<std::uint32_t> v(count(4));
    for (std::uint32_t& x : v) x = static_cast<std::uint32_t>(word(4));
    return v;
  }
  Paint paint() {
    Paint p;
    p.known = u8() == 1;
    for (float* c : {&p.colour.r, &p.colour.g, &p.colour.b, &p.colour.a}) {
      const double v = real();
      *c = std::isfinite(v) ? static_cast<float>(std::clamp(v, 0.0, 1.0)) : 0.0F;
    }
    return p;
  }
  Pose pose() {
    Pose t;
    for (double& x : t.R) x = real();
    for (double& x : t.p) x = real();
    return t;
  }

 private:
  std::uint64_t word(unsigned size) {
    std::uint64_t v = 0;
    const auto b = take(size);
    for (unsigned i = 0; i < b.size(); ++i)
      v |= std::uint64_t{static_cast<std::uint8_t>(b[i])} << (8 * i);
    return v;
  }
  std::string_view rest_;
  bool ok_ = true;
};

Error broken(const std::string& why) {
  return error(ErrorCode::plugin_failed, "the reader's output is damaged: " + why,
               "Report it with the file.");
}

void write_profile(Writer& w, const CsgProfile& profile) {
  w.u64(profile.loops.size());
  for (const CsgLoop& loop : profile.loops) {
    w.real(loop.start[0]);
    w.real(loop.start[1]);
    w.u64(loop.curves.size());
    for (const CsgCurve& c : loop.curves) {
      w.i32(static_cast<std::int32_t>(c.kind));
      w.u64(c.points.size());
      for (const auto& p : c.points) {
        w.real(p[0]);
        w.real(p[1]);
      }
    }
  }
}

CsgProfile read_profile(Reader& r) {
  CsgProfile profile;
  profile.loops.resize(r.count(24));
  for (CsgLoop& loop : profile.loops) {
    loop.start = {r.real(), r.real()};
    loop.curves.resize(r.count(16));
    for (CsgCurve& c : loop.curves) {
      c.kind = static_cast<CsgCurve::Kind>(r.i32());
      c.points.resize(r.count(16));
      for (auto& p : c.points) p = {r.real(), r.real()};
    }
  }
  return profile;
}

Scene read_scene(Reader& r) {
  Scene s;
  s.shapes.resize(r.count(24));
  for (Shape& shape : s.shapes) {
    shape.name = r.text();
    shape.brep = r.text();
    shape.size = r.real();
    shape.points = r.reals();
    shape.triangles = r.indices();
    shape.paint = r.paint();
  }
  s.nodes.resize(r.count(24));
  for (Node& n : s.nodes) {
    n.name = r.text();
    n.parent = r.i32();
    n.pose = r.pose();
    n.shape = r.i32();
    n.paint = r.paint();
  }
  s.profile = read_profile(r);
  s.notes.resize(r.count(8));
  for (std::string& note : s.notes) note = r.text();
  return s;
}

bool near_enough(double x) { return std::isfinite(x) && std::abs(x) <= kFarthestVertex; }

Result<void> check_shape(const Shape& shape) {
  if (!shape.brep.empty()) {
    if (!shape.points.empty() || !shape.triangles.empty())
      return broken("a part is both exact and a mesh");
    if (!(shape.size >= 0) || !near_enough(shape.size)) return broken("a part has no size");
    return {};
  }
  if (shape.points.empty() || shape.points.size() % 3 != 0 || shape.triangles.empty() ||
      shape.triangles.size() % 3 != 0)
    return broken("a mesh has " + std::to_string(shape.points.size()) + " coordinates and " +
                  std::to_string(shape.triangles.size()) + " indices");
  if (!std::all_of(shape.points.begin(), shape.points.end(), near_enough))
    return broken("a coordinate is not a number, or is farther than 1e9 m");
  const std::size_t vertices = shape.points.size() / 3;
  if (std::any_of(shape.triangles.begin(), shape.triangles.end(),
                  [&](std::uint32_t i) { return i >= vertices; }))
    return broken("a triangle refers to a missing corner");
  return {};
}

Result<void> check_curve(const CsgCurve& c, std::size_t curves) {
  std::size_t least = 1, most = 1;
  switch (c.kind) {
    case CsgCurve::Kind::line: break;
    case CsgCurve::Kind::arc: least = most = 2; break;
    case CsgCurve::Kind::spline: most = kMostNodes; break;
    case CsgCurve::Kind::circle:
      least = most = 2;
      if (curves != 1) return broken("a circle is not alone in its loop");
      break;
    default: return broken("a curve has an unknown kind");
  }
  if (c.points.size() < least || c.points.size() > most)
    return broken("a curve has the wrong number of points");
  for (const auto& p : c.points)
    if (!near_enough(p[0]) || !near_enough(p[1])) return broken("a point is not a number");
  return {};
}

}  // namespace

std::string encode(const Scene& s) {
  Writer w(Kind::scene);
  w.u64(s.shapes.size());
  for (const Shape& shape : s.shapes) {
    w.text(shape.name);
    w.text(shape.brep);
    w.real(shape.size);
    w.reals(shape.points);
    w.indices(shape.triangles);
    w.paint(shape.paint);
  }
  w.u64(s.nodes.size());
  for (const Node& n : s.nodes) {
    w.text(n.name);
    w.i32(n.parent);
    w.pose(n.pose);
    w.i32(n.shape);
    w.paint(n.paint);
  }
  write_profile(w, s.profile);
  w.u64(s.notes.size());
  for (const std::string& note : s.notes) w.text(note);
  return w.finish();
}

std::string encode_file(std::string_view bytes) {
  Writer w(Kind::file);
  w.text(bytes);
  return w.finish();
}

std::string encode(const Error& e) {
  Writer w(Kind::error);
  w.i32(static_cast<std::int32_t>(e.code));
  w.text(e.message);
  w.text(e.where);
  w.text(e.hint);
  return w.finish();
}

Result<void> check(const Scene& s) {
  if (s.nodes.size() > kMostNodes || s.shapes.size() > kMostNodes)
    return broken("it has more than a million parts");
  for (const Shape& shape : s.shapes) RMP_TRY(check_shape(shape));
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {
    const Node& n = s.nodes[i];
    if (n.parent < -1 || n.parent >= static_cast<std::int32_t>(i))
      return broken("a part precedes its assembly");
    if (n.parent >= 0 && s.nodes[static_cast<std::size_t>(n.parent)].shape >= 0)
      return broken("a part is inside a part");
    if (n.shape < -1 || n.shape >= static_cast<std::int32_t>(s.shapes.size()))
      return broken("a part refers to a missing shape");
    if (!spatial::is_rigid(n.pose, kRigidTolerance) ||
        !std::all_of(n.pose.p.begin(), n.pose.p.end(), near_enough))
      return broken("a placement is not a rigid motion");
  }
  for (const CsgLoop& loop : s.profile.loops) {
    if (!near_enough(loop.start[0]) || !near_enough(loop.start[1]))
      return broken("a point is not a number");
    if (loop.curves.empty()) return broken("a loop is empty");
    for (const CsgCurve& c : loop.curves) RMP_TRY(check_curve(c, loop.curves.size()));
  }
  return {};
}

/// Messages quote broken files, whose bytes may be anything: what no terminal or JSON takes becomes
/// a question mark.
std::string legible(std::string s) {
  for (std::size_t i = 0; i < s.size();) {
    const auto c = static_cast<unsigned char>(s[i]);
    const std::size_t more = c >= 0xC2 && c < 0xE0   ? 1
                             : c >= 0xE0 && c < 0xF0 ? 2
                             : c >= 0xF0 && c < 0xF5 ? 3
                                                     : 0;
    bool good = c >= 0x20 && c != 0x7F && (c < 0x80 || more > 0) && i + more < s.size();
    for (std::size_t k = 1; good && k <= more; ++k)
      good = (static_cast<unsigned char>(s[i + k]) & 0xC0U) == 0x80U;
    // Overlong forms, surrogates, and the control characters behind ASCII.
    const auto next = static_cast<unsigned char>(good && more > 0 ? s[i + 1] : 0xA0);
    good &= !(c == 0xC2 && next < 0xA0) && !(c == 0xE0 && next < 0xA0) &&
            !(c == 0xED && next >= 0xA0) && !(c == 0xF0 && next < 0x90) &&
            !(c == 0xF4 && next >= 0x90);
    if (good) {
      i += more + 1;
    } else {
      s[i++] = '?';
    }
  }
  return s;
}

Result<Answer> decode(std::string_view bytes) {
  Reader r(bytes);
  if (r.take(kMagic.size()) != kMagic) return broken("its beginning is not valid");
  const auto kind = static_cast<Kind>(r.u8());
  Answer answer;
  Error told;
  if (kind == Kind::error) {
    const std::int32_t code = r.i32();
    told.message = legible(r.text());
    told.where = legible(r.text());
    told.hint = r.text();
    told.code = code >= static_cast<std::int32_t>(ErrorCode::invalid_argument) &&
                        code <= static_cast<std::int32_t>(ErrorCode::script_failed)
                    ? static_cast<ErrorCode>(code)
                    : ErrorCode::plugin_failed;
  } else if (kind == Kind::scene) {
    answer.scene = read_scene(r);
    for (std::string& note : answer.scene.notes) note = legible(std::move(note));
  } else if (kind == Kind::file) {
    answer.file = r.text();
  } else {
    return broken("it is of an unknown kind");
  }
  if (!r.ok() || r.take(kEnd.size()) != kEnd || !r.at_end()) return broken("it is cut off");
  if (kind == Kind::error) return told;
  RMP_TRY(check(answer.scene));
  return answer;
}

}  // namespace robomosp::cad_exchange
