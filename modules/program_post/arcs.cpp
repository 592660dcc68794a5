// SPDX-License-Identifier: Apache-2.0
#include "program_post/arcs.h"

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include <robomosp/sdk/post_writer.h>

#include "program_post/pose_rewriter.h"
#include "program_post/vectors.h"

namespace robomosp::program_post {
namespace {

using Id = std::uint32_t;
constexpr double kPi = 3.141592653589793;
constexpr std::size_t kMostPieces = 10'000;

Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3 plus(const Vec3& a, const Vec3& b, double s) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
double size(const Vec3& a) { return std::sqrt(dot(a, a)); }
/// From one orientation to another by the shorter way, at 0 <= u <= 1.
std::array<double, 9> between(const std::array<double, 9>& a, const std::array<double, 9>& b,
                              double u) {
  const Quaternion p = post::quaternion(a);
  Quaternion q = post::quaternion(b);
  double c = 0;
  for (std::size_t i = 0; i < 4; ++i) c += p[i] * q[i];
  if (c < 0) {
    c = -c;
    for (double& x : q) x = -x;
  }
  const double angle = std::acos(std::min(1.0, c));
  double f = 1 - u, g = u;
  if (angle > 1e-9) {
    f = std::sin((1 - u) * angle) / std::sin(angle);
    g = std::sin(u * angle) / std::sin(angle);
  }
  Quaternion out{};
  double n = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    out[i] = f * p[i] + g * q[i];
    n += out[i] * out[i];
  }
  for (double& x : out) x /= std::sqrt(n);
  return matrix(out);
}

/// A curve by places: pieces so many that none is farther from it than asked for.
struct Pieces {
  std::vector<Pose> ends;  ///< of the pieces, the last one's too
  double deviation = 0;    ///< [m]
};

/// The arc from a through b to c; nothing = they lie on a line.
std::optional<Pieces> arc(const Pose& a, const Pose& b, const Pose& c, double most) {
  const Vec3 u = minus(b.p, a.p), v = minus(c.p, a.p), n = cross(u, v);
  const double area = dot(n, n);
  if (!(area > 1e-12 * dot(u, u) * dot(v, v)) || !(dot(u, u) > 1e-18) || !(dot(v, v) > 1e-18))
    return std::nullopt;
  const Vec3 vn = cross(v, n), nu = cross(n, u);
  Vec3 centre{};
  for (std::size_t i = 0; i < 3; ++i)
    centre[i] = (dot(u, u) * vn[i] + dot(v, v) * nu[i]) / (2 * area);  // from a
  const double r = size(centre);
  Vec3 x{}, z{};
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = -centre[i] / r;
    z[i] = n[i] / std::sqrt(area);
  }
  const Vec3 y = cross(z, x);
  const auto angle_of = [&](const Vec3& from_a) {
    const Vec3 d = minus(from_a, centre);
    const double angle = std::atan2(dot(d, y), dot(d, x));
    return angle > 1e-12 ? angle : angle + 2 * kPi;
  };
  const double via = angle_of(u), all = angle_of(v);
  const double one = 2 * std::acos(std::max(-1.0, 1 - most / r));
  const double count = std::ceil(all / std::max(one, 1e-6) - 1e-9);
  if (!(count <= kMostPieces)) return std::nullopt;
  const auto pieces = static_cast<std::size_t>(std::max(1.0, count));
  Pieces out;
  for (std::size_t k = 1; k <= pieces; ++k) {
    const double t = all * static_cast<double>(k) / static_cast<double>(pieces);
    Pose p;
    p.p = plus(plus(plus(a.p, centre, 1), x, r * std::cos(t)), y, r * std::sin(t));
    p.R = t <= via ? between(a.R, b.R, t / via) : between(b.R, c.R, (t - via) / (all - via));
    out.ends.push_back(p);
  }
  out.ends.back() = c;
  out.deviation = r * (1 - std::cos(all / static_cast<double>(pieces) / 2));
  return out;
}

/// The natural cubic spline through places, by their distances.
std::optional<Pieces> spline(const std::vector<Pose>& through, double most) {
  const std::size_t n = through.size();
  std::vector<double> at{0};
  for (std::size_t i = 1; i < n; ++i) {
    const double d = size(minus(through[i].p, through[i - 1].p));
    if (!(d > 1e-9)) return std::nullopt;
    at.push_back(at.back() + d);
  }
  // Second derivatives: a row for each inner place, solved from the front to the back.
  std::vector<Vec3> second(n, Vec3{});
  std::vector<double> over(n, 0.0);
  std::vector<Vec3> right(n, Vec3{});
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = at[i] - at[i - 1], behind = at[i + 1] - at[i];
    const double middle = 2 * (before + behind) - before * over[i - 1];
    over[i] = behind / middle;
    for (std::size_t k = 0; k < 3; ++k) {
      const double bend = 6 * ((through[i + 1].p[k] - through[i].p[k]) / behind -
                               (through[i].p[k] - through[i - 1].p[k]) / before);
      right[i][k] = (bend - before * right[i - 1][k]) / middle;
    }
  }
  for (std::size_t i = n - 1; i-- > 1;) second[i] = plus(right[i], second[i + 1], -over[i]);
  Pieces out;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double h = at[i + 1] - at[i];
    const auto place = [&](double u) {
      Vec3 p{};
      const double w = 1 - u;
      for (std::size_t k = 0; k < 3; ++k)
        p[k] = w * through[i].p[k] + u * through[i + 1].p[k] +
               h * h / 6 * ((w * w * w - w) * second[i][k] + (u * u * u - u) * second[i + 1][k]);
      return p;
    };
    // A chord over du leaves a curve of second derivative s by at most s (h du)^2 / 8.
    const double bend = std::max(size(second[i]), size(second[i + 1]));
    const double count = std::ceil(h * std::sqrt(bend / (8 * most)) - 1e-9);
    if (!(count <= kMostPieces) || out.ends.size() > kMostPieces) return std::nullopt;
    const auto pieces = static_cast<std::size_t>(std::max(1.0, count));
    const double step = h / static_cast<double>(pieces);
    out.deviation = std::max(out.deviation, bend * step * step / 8);
    for (std::size_t k = 1; k <= pieces; ++k) {
      const double u = static_cast<double>(k) / static_cast<double>(pieces);
      Pose p;
      p.p = place(u);
      p.R = between(through[i].R, through[i + 1].R, u);
      out.ends.push_back(p);
    }
    out.ends.back() = through[i + 1];
  }
  return out;
}

class Arcs final : public PoseRewriter {
 public:
  Arcs(ProgramTables& t, const PostCapabilities& caps, std::span<const PostPoint> points,
       double chord_mm, std::vector<Remark>& remarks)
      : PoseRewriter(t),
        title_(caps.title),
        remarks_(remarks),
        no_circle_((caps.motions & kPostCircle) == 0 || caps.circle == PostCircle::none),
        no_path_((caps.motions & kPostPath) == 0),
        most_(chord_mm / 1000) {
    by_expression_.assign(t_.expressions.size(), nullptr);
    for (const PostPoint& p : points)
      if (p.expression < by_expression_.size()) by_expression_[p.expression] = &p;
    if ((caps.motions & kPostLinPose) == 0) no_circle_ = no_path_ = false;
  }
  void run() {
    bool is_any = false;
    for (const auto& m : t_.motions) is_any = is_any || is_meant(m);
    if (!is_any || !has_poses()) return;
    for (std::size_t r = 0; r < t_.routines.size(); ++r) {
      forget();
      block(t_.routines[r].body);
    }
  }

 private:
  [[nodiscard]] bool is_meant(const rmp_code_motion& m) const {
    return (m.interpolation == RMP_MOVE_CIRCLE && no_circle_) ||
           (m.interpolation == RMP_MOVE_PATH && no_path_);
  }
  void forget() { last_.reset(); }

  bool calls(Id e) {
    if (e == RMP_NONE) return false;
    if (ex(e).op == RMP_EXPR_CALL) return true;
    if (is_known(e)) return false;
    for (Id k = 0; k < ex(e).count; ++k)
      if (calls(operand(e, k))) return true;
    return false;
  }
  void block(Id first) {
    if (++depth_ > 1200) {
      --depth_;
      return;
    }
    for (Id i = first; i != RMP_NONE;) {
      const Id next = st(i).next;
      one(i);
      i = next;
    }
    --depth_;
  }
  void one(Id i) {
    const rmp_code_statement s = st(i);
    switch (s.op) {
      case RMP_STMT_MOVE: move(i); return;
      case RMP_STMT_IF:
      case RMP_STMT_CASE: {
        const auto before = last_;
        for (Id a = s.body; a != RMP_NONE; a = st(a).next) {
          last_ = before;
          if (calls(st(a).a)) forget();
          block(st(a).body);
        }
        forget();
        return;
      }
      case RMP_STMT_WHILE:
      case RMP_STMT_REPEAT:
      case RMP_STMT_LOOP:
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN:
        forget();
        block(s.body);
        forget();
        return;
      case RMP_STMT_LABEL: forget(); return;
      default:
        for (const Id e : {s.a, s.b, s.c})
          if (calls(e)) forget();
        return;
    }
  }

  [[nodiscard]] const PostPoint* point(Id e) const {
    return e < by_expression_.size() ? by_expression_[e] : nullptr;
  }
  [[nodiscard]] Id attribute(const rmp_code_motion& m, std::uint32_t which) const {
    for (Id k = m.attribute_count; k-- > 0;)
      if (t_.attributes[m.first_attribute + k].attribute == which)
        return t_.attributes[m.first_attribute + k].value;
    return RMP_NONE;
  }
  struct At {
    Pose base_T_tip;
    std::optional<Pose> tool;  ///< of the motion that went there
  };
  static bool same(const std::optional<Pose>& a, const std::optional<Pose>& b) {
    if (a.has_value() != b.has_value()) return false;
    return !a || (a->p == b->p && a->R == b->R);
  }
  /// base_T_tip at a target, where it is known.
  std::optional<Pose> goal(const rmp_code_motion& m, Id target, const std::optional<Pose>& frame) {
    const PostPoint* p = point(target);
    if (!p || !p->has_pose || p->role == RMP_ROLE_ADD_JOINT) return std::nullopt;
    if (m.is_incremental) {
      if (!last_ || !frame) return std::nullopt;
      Pose by = p->pose, turn;
      if (p->role == RMP_ROLE_POSITION) by.R = Pose{}.R;
      turn.R = frame->R;
      by = post::product(post::product(turn, by), post::inverse(turn));
      Pose out = last_->base_T_tip;
      for (std::size_t k = 0; k < 3; ++k) out.p[k] += by.p[k];
      out.R = post::product(by, last_->base_T_tip).R;
      return out;
    }
    if (p->role == RMP_ROLE_JOINT || p->role == RMP_ROLE_MAIN_JOINT) return p->pose;
    if (!frame) return std::nullopt;
    Pose out = post::product(*frame, p->pose);
    if (p->role == RMP_ROLE_POSITION) {
      if (!last_) return std::nullopt;
      out.R = last_->base_T_tip.R;
    }
    return out;
  }
  void move(Id i) {
    const rmp_code_motion m = t_.motions[st(i).motion];
    bool has_call = calls(m.until);
    for (Id k = 0; k < m.target_count; ++k) has_call |= calls(t_.links[m.first_target + k]);
    if (has_call) forget();
    std::optional<Pose> frame = Pose{}, tool;
    bool is_tool_known = true;
    if (const Id f = attribute(m, RMP_ATTR_FRAME); f != RMP_NONE) {
      frame.reset();
      if (const PostPoint* p = point(f); p && p->has_pose) frame = p->pose;
    }
    if (const Id t = attribute(m, RMP_ATTR_TOOL); t != RMP_NONE) {
      const PostPoint* p = point(t);
      is_tool_known = p && p->has_pose;
      if (is_tool_known) tool = p->pose;
    }
    // Another tool has its tip elsewhere.
    if (last_ && !(is_tool_known && same(last_->tool, tool))) last_.reset();
    const std::optional<At> start = last_;
    const bool has_start = last_.has_value();
    std::vector<Pose> goals;
    std::optional<At> end;
    for (Id k = 0; k < m.target_count; ++k) {
      const auto g = goal(m, t_.links[m.first_target + k], frame);
      if (g) goals.push_back(*g);
      end.reset();
      if (g && is_tool_known) end = At{*g, tool};
      last_ = end;  // increments, and positions without an orientation, go on from there
    }
    if (m.until != RMP_NONE) forget();
    if (is_meant(m)) pieces(i, m, has_start, start, goals, frame);
  }
  void pieces(Id i, const rmp_code_motion& m, bool has_start, const std::optional<At>& from,
              const std::vector<Pose>& goals, const std::optional<Pose>& frame) {
    const bool is_circle = m.interpolation == RMP_MOVE_CIRCLE;
    const rmp_span span = m.span;
    const std::string what = is_circle ? "CIRCLE" : "PATH";
    const auto no = [&](const std::string& why, const char* hint) {
      if (is_circle)
        remarks_.push_back({RMP_FAULT_ERROR, span,
                            title_ +
                                " has no circles, and this one cannot be written as straight "
                                "pieces: " +
                                why,
                            hint});
      else
        remarks_.push_back({RMP_FAULT_WARNING, span,
                            "PATH is written as straight pieces from target to target, without the "
                            "curve between them: " +
                                why,
                            hint});
    };
    static constexpr const char* kFlat =
        "Begin with a MOVE to a POSE of constants, or post the flattened program (form = "
        "\"flat\").";
    if (m.until != RMP_NONE)
      return no("it ends on a condition (UNTIL)", "Write the pieces as MOVE LIN, each with UNTIL.");
    if (!has_start || !from || goals.size() != m.target_count || !frame)
      return no("its start or end is unknown before run time", kFlat);
    if (is_circle && goals.size() != 2) return no("it has no via point and end", kFlat);
    double time = -1;  // none
    if (const Id t = attribute(m, RMP_ATTR_TIME); t != RMP_NONE) {
      if (!is_known(t)) return no("its TIME is computed", "Give a constant, or SPEED.");
      const auto& k = t_.constants[ex(t).constant];
      time = k.kind == RMP_CONSTANT_INT ? static_cast<double>(k.integer) : k.real;
    }
    const Pose& start = from->base_T_tip;
    std::optional<Pieces> made;
    if (is_circle) {
      made = arc(start, goals[0], goals[1], most_);
      if (!made)
        return no("start, via and end lie on a line, or the arc is too long",
                  "Move the via point.");
    } else {
      std::vector<Pose> through{start};
      for (const Pose& g : goals)
        if (size(minus(g.p, through.back().p)) > 1e-9) through.push_back(g);
      if (through.size() > 1) made = spline(through, most_);
      if (!made) return no("it has no length, or is too long", "Check its targets.");
    }
    remarks_.push_back({RMP_FAULT_WARNING, span,
                        what + " is written as " + std::to_string(made->ends.size()) +
                            " straight pieces, at most " +
                            post::trimmed(made->deviation * 1000, 4, 1) + " mm away from it",
                        "The profile's option chord_mm sets the largest distance."});
    const Pose into = post::inverse(*frame);
    double whole = 0;
    std::vector<double> ways;
    Vec3 before = start.p;
    for (const Pose& p : made->ends) {
      ways.push_back(size(minus(p.p, before)));
      whole += ways.back();
      before = p.p;
    }
    const Id next = st(i).next;
    Id last = i;
    for (std::size_t k = 0; k < made->ends.size(); ++k) {
      const bool is_last = k + 1 == made->ends.size();
      Id target = t_.links[m.first_target + m.target_count - 1];
      if (!is_last || m.is_incremental) target = pose(post::product(into, made->ends[k]), span);
      rmp_code_motion part = m;
      part.interpolation = RMP_MOVE_LIN;
      part.is_incremental = 0;
      part.first_target = static_cast<Id>(t_.links.size());
      part.target_count = 1;
      t_.links.push_back(target);
      if (!is_last || time >= 0) {
        const Id first = static_cast<Id>(t_.attributes.size());
        for (Id a = 0; a < m.attribute_count; ++a) {
          const rmp_code_attribute other = t_.attributes[m.first_attribute + a];
          if ((other.attribute == RMP_ATTR_C_PASS && !is_last) ||
              (other.attribute == RMP_ATTR_TIME && time >= 0))
            continue;
          t_.attributes.push_back(other);
        }
        if (!is_last) t_.attributes.push_back({RMP_ATTR_C_PASS, truth(true, span), span});
        if (time >= 0)
          t_.attributes.push_back(
              {RMP_ATTR_TIME, real(time * ways[k] / std::max(whole, 1e-12), span), span});
        part.first_attribute = first;
        part.attribute_count = static_cast<Id>(t_.attributes.size()) - first;
      }
      t_.motions.push_back(part);
      Id s = i;
      if (k > 0) {
        s = statement(RMP_STMT_MOVE, st(i).span);
        st(last).next = s;
      }
      st(s).motion = static_cast<Id>(t_.motions.size() - 1);
      last = s;
    }
    st(last).next = next;
  }

  std::string title_;
  std::vector<Remark>& remarks_;
  bool no_circle_, no_path_;
  double most_;  ///< [m]
  std::vector<const PostPoint*> by_expression_;
  std::optional<At> last_;
  int depth_ = 0;
};

}  // namespace

void to_chords(ProgramTables& tables, const PostCapabilities& caps,
               std::span<const PostPoint> points, double chord_mm, std::vector<Remark>& remarks) {
  Arcs(tables, caps, points, chord_mm, remarks).run();
}

}  // namespace robomosp::program_post
