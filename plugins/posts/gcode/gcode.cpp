// SPDX-License-Identifier: Apache-2.0
// RS274 as NIST and LinuxCNC have it: mm, mm/min, absolute positions; arcs by their centre in one
// of three planes, others as chords. Three axes; the option rotary = ABC writes the orientation.
#include "gcode.h"

#include "../common/straight.h"

namespace robomosp::post {
namespace {

class GWriter final : public StraightWriter {
 public:
  using StraightWriter::StraightWriter;

 private:
  void begin() override {
    out_ = &lines_;
    rotary_ = upper(option("rotary")) == "ABC";
    if (!option("rotary").empty() && !rotary_)
      fail("the profile's option rotary is \"" + std::string(option("rotary")) + "\"",
           "Give ABC, or leave it out.");
    chord_mm_ = number_option("chord_mm", 0.01);
    if (!(chord_mm_ >= 1e-4)) {
      fail("the profile's option chord_mm is at least 0.0001", "Give another value.");
      chord_mm_ = 0.01;
    }
    line("(" + plain_text(task_.name, '(') + ")");
    line("G21 G90 G94 G17 G40 G49");
    if (profile_.frame >= 0)
      note("positions are written in the robot's base: no coordinate system is selected");
    if (!profile_.prologue.empty()) lines_.add_lines(profile_.prologue);
  }
  void finish() override {
    if (!profile_.epilogue.empty()) lines_.add_lines(profile_.epilogue);
    line("M2");
    lines_.give(output_, std::string(task_.name) + ".ngc", false);
  }
  void declare(std::uint32_t s, std::uint32_t) override {
    at_ = symbol(s).span;
    cannot("variables with names", "Post the flattened program (form = \"flat\").");
  }
  static double way(const Pose& a, const Pose& b) {
    return 1000 * std::hypot(a.p[0] - b.p[0], a.p[1] - b.p[1], a.p[2] - b.p[2]);
  }
  std::string words(const Pose& p) {
    static constexpr std::array<const char*, 6> kNames{"X", " Y", " Z", " A", " B", " C"};
    const Placed at = placed(p, Orientation::fixed_xyz);
    std::string out;
    for (std::size_t i = 0; i < 3; ++i) out += kNames[i] + length(at.mm[i]);
    if (rotary_) turn_near({at.ori[0], at.ori[1], at.ori[2]});
    for (std::size_t i = 0; rotary_ && i < 3; ++i) out += kNames[i + 3] + angle(turned_[i]);
    return out;
  }
  /// Axes go from number to number, so that 180 to -135 would be nearly a turn: of all angles of an
  /// orientation, those nearest to where the axes are.
  void turn_near(const std::array<double, 3>& ori) {
    const auto near = [&](std::array<double, 3> a) {
      for (std::size_t i = 0; i < 3; ++i) a[i] += 360 * std::round((turned_[i] - a[i]) / 360);
      return a;
    };
    const auto way_to = [&](const std::array<double, 3>& a) {
      double sum = 0;
      for (std::size_t i = 0; i < 3; ++i) sum += std::fabs(a[i] - turned_[i]);
      return sum;
    };
    if (!std::exchange(is_turned_, true)) {
      turned_ = ori;
      return;
    }
    const std::array<double, 3> one = near(ori);
    const std::array<double, 3> other = near({ori[0] + 180, 180 - ori[1], ori[2] + 180});
    constexpr double kTie = 1e-6;
    turned_ = way_to(other) < way_to(one) - kTie ? other : one;
  }
  /// Whether the machine may hold this orientation.
  bool held(const Pose& p) {
    if (rotary_) return true;
    if (!orientation_) {
      orientation_ = p.R;
      note("the orientation is not written: it is the same for all targets",
           "The profile's option rotary = ABC writes it.");
      return true;
    }
    for (std::size_t i = 0; i < 9; ++i)
      if (!(std::fabs(p.R[i] - (*orientation_)[i]) < 1e-5)) {
        cannot("orientation changes on three axes",
               "Keep the orientation, or give the profile the option rotary = ABC.");
        return false;
      }
    return true;
  }
  bool prepare(const Motion& m, bool is_ptp) {
    if (!plain(m) || !no_until(m) || !no_tool(m)) return false;
    for (const Target& t : m.targets) no_turns(t.point);
    const double r = certain(m, is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP, "C_CP and C_PTP", 0);
    std::string mode = "G61.1";  // each target is a stop; G61 goes on where two are in line
    if (r > 0 && !is_ptp) {
      mode = "G64 P" + length(r);
      note("C_CP is written as the tolerance of G64: the largest deviation from the path");
    } else if (r > 0 || m[RMP_ATTR_C_PASS].known.value_or(0) != 0) {
      mode = "G64";
      note(
          "the transition is written as G64: the machine chooses how far it deviates from the "
          "path");
    }
    if (blend_.changes(mode)) line(mode);
    const std::uint32_t acc = is_ptp && !m[RMP_ATTR_ACC].given ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC;
    if (certain(m, acc, "the acceleration", 100) != 100)
      warn("accelerations are not written: the machine uses its own", "Take ACC out.");
    return true;
  }
  void ptp(const Motion& m) override {
    if (!prepare(m, true)) return;
    if (m[RMP_ATTR_SPEED_PTP].given && certain(m, RMP_ATTR_SPEED_PTP, "SPEED_PTP", 100) != 100)
      warn("SPEED_PTP is not written: G0 moves at the machine's rapid speed",
           "Use LIN with SPEED.");
    if (has_time(m)) {
      cannot("TIME of PTP motions", "Use LIN.");
      return;
    }
    no_external(m.targets[0].point);
    const auto at = certain_goal(m, m.targets[0]);
    if (!at || !held(*at)) return;
    line("G0 " + words(*at));
    arrived(at);
  }
  /// " F..." of a path of this length; with TIME in inverse time.
  std::string feed(const Motion& m) {
    if (has_time(m)) {
      const auto t = time_of(m);
      if (!t) {
        cannot("a computed TIME", "Post the flattened program (form = \"flat\").");
        return "";
      }
      if (!inverse_) line("G93");
      inverse_ = true;
      return " F" + fixed(60 / *t, 4);
    }
    if (inverse_) line("G94");
    inverse_ = false;
    if (m[RMP_ATTR_SPEED_ORI].given)
      warn("SPEED_ORI is not written: the tool rotates with the path", "Give a lower SPEED.");
    return " F" +
           number(60 * certain(m, RMP_ATTR_SPEED, "SPEED", 250, 0.001, 1e6), profile_.speed_digits);
  }
  void lin(const Motion& m) override {
    if (!prepare(m, false)) return;
    no_external(m.targets[0].point);
    const auto at = certain_goal(m, m.targets[0]);
    if (!at || !held(*at)) return;
    const std::string f = feed(m);
    line("G1 " + words(*at) + f);
    arrived(at);
  }
  /// The orientation that words() of it writes, when A, B and C are so much of their way.
  std::array<double, 9> turned(const Pose& from, const Pose& to, double share) {
    const auto a = placed(from, Orientation::fixed_xyz).ori,
               b = placed(to, Orientation::fixed_xyz).ori;
    Pose all;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double t = (a[axis] + share * (b[axis] - a[axis])) / kDegree;
      const std::size_t i = (axis + 1) % 3, k = (axis + 2) % 3;
      Pose one;
      one.R[4 * i] = one.R[4 * k] = std::cos(t);
      one.R[3 * i + k] = -std::sin(t);
      one.R[3 * k + i] = std::sin(t);
      all = product(one, all);
    }
    return all.R;
  }
  void circle(const Motion& m) override {
    if (!prepare(m, false)) return;
    if (m.incremental) {
      cannot("circles through increments", "Give poses.");
      return;
    }
    const auto via = certain_goal(m, m.targets[0]), to = certain_goal(m, m.targets[1]);
    if (!via || !to || !held(*via) || !held(*to)) return;
    if (!last()) {
      fail("the start of this circle is unknown", "Begin with a motion to a pose.");
      return;
    }
    // Centre of the circle through three points, in mm.
    const auto minus = [](const Vec3& a, const Vec3& b) {
      return Vec3{1000 * (a[0] - b[0]), 1000 * (a[1] - b[1]), 1000 * (a[2] - b[2])};
    };
    const auto dot = [](const Vec3& a, const Vec3& b) {
      return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const auto cross = [](const Vec3& a, const Vec3& b) {
      return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const Vec3 u = minus(via->p, last()->p), v = minus(to->p, last()->p), n = cross(u, v);
    const double area = dot(n, n);
    if (!(area > 1e-6 * dot(u, u) * dot(v, v)) || !(dot(u, u) > 1e-6) || !(dot(v, v) > 1e-6)) {
      fail("start, via and end of this circle lie on a line", "Move the via point.");
      return;
    }
    // Centre from the start: (|u|^2 (v x n) + |v|^2 (n x u)) / (2 |n|^2).
    const Vec3 vn = cross(v, n), nu = cross(n, u);
    Vec3 c{};
    for (std::size_t i = 0; i < 3; ++i) c[i] = (dot(u, u) * vn[i] + dot(v, v) * nu[i]) / (2 * area);
    const double size = std::sqrt(area);
    if (rotary_) {
      // The machine turns evenly from end to end: what is asked for on the way has to lie there.
      const auto angle = [&](const Vec3& from_start) {
        Vec3 r{}, x{};
        for (std::size_t i = 0; i < 3; ++i) r[i] = from_start[i] - c[i], x[i] = -c[i];
        const Vec3 y = cross(n, x);
        const double t = std::atan2(dot(r, y) / size, dot(r, x));
        return t > 0 ? t : t + 2 * 3.141592653589793;
      };
      const auto there = turned(*last(), *to, angle(u) / angle(v));
      double trace = 0;
      for (std::size_t i = 0; i < 9; ++i) trace += there[i] * via->R[i];
      if (!(std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)) * kDegree < 0.01)) {
        cannot("circles with a separate orientation at the via point",
               "Give all three points the same orientation, or write it as LIN.");
        return;
      }
    }
    const std::string f = feed(m);
    const auto offset = [&](const char* word, double x) { return word + length(x); };
    for (std::size_t i = 0; i < 3; ++i) {
      if (std::fabs(std::fabs(n[i]) / size - 1) > 1e-12 || inverse_) continue;
      // Planes and their offsets: x-y about z, z-x about y, y-z about x.
      static constexpr std::array<const char*, 3> kPlanes{"G19", "G18", "G17"};
      if (plane_.changes(kPlanes[i])) line(kPlanes[i]);
      std::string s = n[i] > 0 ? "G3 " : "G2 ";
      s += words(*to);
      if (i != 0) s += offset(" I", c[0]);
      if (i != 1) s += offset(" J", c[1]);
      if (i != 2) s += offset(" K", c[2]);
      line(s + f);
      arrived(to);
      return;
    }
    chords(*to, c, n, size, f);
  }
  void chords(const Pose& to, const Vec3& c, const Vec3& n, double size, const std::string& f) {
    if (rotary_ || inverse_) {
      cannot("circles outside the three coordinate planes with rotary axes or TIME",
             "Write them as LIN.");
      return;
    }
    const double r = std::hypot(c[0], c[1], c[2]);
    const Pose from = *last();
    const auto radial = [&](const Vec3& p) {
      return Vec3{1000 * (p[0] - from.p[0]) - c[0], 1000 * (p[1] - from.p[1]) - c[1],
                  1000 * (p[2] - from.p[2]) - c[2]};
    };
    const Vec3 e1{-c[0] / r, -c[1] / r, -c[2] / r};
    const Vec3 z{n[0] / size, n[1] / size, n[2] / size};
    const Vec3 e2{z[1] * e1[2] - z[2] * e1[1], z[2] * e1[0] - z[0] * e1[2],
                  z[0] * e1[1] - z[1] * e1[0]};
    const Vec3 end = radial(to.p);
    double angle = std::atan2(end[0] * e2[0] + end[1] * e2[1] + end[2] * e2[2],
                              end[0] * e1[0] + end[1] * e1[1] + end[2] * e1[2]);
    if (angle <= 0) angle += 2 * 3.141592653589793;
    const double one = 2 * std::acos(std::max(0.0, 1 - chord_mm_ / r));
    const double pieces = std::ceil(angle / std::max(one, 1e-4));
    note("the circle is written as " + fixed(pieces, 0) + " straight pieces, at most " +
             trimmed(chord_mm_, 4) + " mm away from it",
         "The profile's option chord_mm sets this deviation.");
    for (double k = 1; k <= pieces; ++k) {
      const double a = angle * k / pieces;
      Pose p = to;
      if (k < pieces)
        for (std::size_t i = 0; i < 3; ++i)
          p.p[i] = from.p[i] + (c[i] + r * (std::cos(a) * e1[i] + std::sin(a) * e2[i])) / 1000;
      line("G1 " + words(p) + f);
    }
    arrived(to);
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    for (const auto& [n, on] : bits(s, value)) {
      if (n < 0 || n > 63) {
        fail("signal " + std::to_string(n) + " is not one of the digital signals, 0 to 63",
             "Give the profile a number for it.");
        return;
      }
      line((on ? "M64 P" : "M65 P") + std::to_string(n));
    }
  }
  void wait_time(std::uint32_t e) override {
    if (const auto v = seconds(e, 1e6)) line("G4 P" + trimmed(*v, 6, 1));
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    const auto t = signal_test(c);
    if (!t || t->signal.type != RMP_TYPE_BOOL || t->signal.is_output || t->signal.number < 0 ||
        t->signal.number > 63) {
      cannot("WAIT FOR with conditions other than one BOOL input, 0 to 63",
             "Use one signal for the condition, and set its number in the profile.");
      return;
    }
    double most = 1e6;
    if (timeout != RMP_NONE) {
      const auto v = seconds(timeout, 1e6);
      if (!v) return;
      most = *v;
    } else {
      note("a wait without TIMEOUT ends after 1000000 s: M66 requires a time");
    }
    line("M66 P" + std::to_string(t->signal.number) + (wanted(*t) ? " L3 Q" : " L4 Q") +
         trimmed(most, 3));
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    if (const auto s = constant_text(values)) {
      std::string safe = *s;
      for (char& ch : safe)
        if (ch == '(' || ch == ')') ch = '/';
      line("(MSG, " + safe.substr(0, 200) + ")");
      if (safe.size() > 200) warn("the message is cut to 200 characters", "Write a shorter text.");
    }
  }
  void pause(std::uint32_t text_of) override {
    if (text_of != RMP_NONE) {
      const std::uint32_t one[] = {text_of};
      message(one, true);
    }
    line("M0");
  }
  void halt() override { line("M2"); }

  File lines_{0};
  Modal<std::string> blend_, plane_{};
  std::optional<std::array<double, 9>> orientation_;
  std::array<double, 3> turned_{};  ///< where A, B and C are [degrees]
  bool rotary_ = false, inverse_ = false, is_turned_ = false;
  double chord_mm_ = 0.01;
};

}  // namespace

const PostCapabilities& GCode::capabilities() const {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.forms = kPostFlat;
    c.features = kPostWaitFor | kPostWaitTimeout | kPostMessages | kPostPause | kPostReturn |
                 kPostFrames | kPostTime;
    c.motions = kPostPtpPose | kPostLinPose | kPostCircle;
    c.circle = PostCircle::centre;
    c.blending = PostBlending::accuracy;
    c.speed = PostSpeed::mm_per_min;
    c.max_name = 64;
    c.extensions = "ngc";
    c.title = "G-code";
    return c;
  }();
  return kAll;
}

Result<void> GCode::write(const PostTask& task, const Params&, PostOutput& output,
                          Progress& progress) const {
  return GWriter(task, output, capabilities(), progress).run();
}

}  // namespace robomosp::post
