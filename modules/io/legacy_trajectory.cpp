// SPDX-License-Identifier: Apache-2.0
// Trajectories of the 2006 program. What the codes of a section mean was found by comparing
// sections with their points, speeds and times; what has no such evidence is refused.
#include <array>
#include <cmath>
#include <numbers>

#include "io/legacy_motion.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::io {

namespace {

using namespace model;
using text::print;
using text::quote;

/// Lengths and times that a file repeats agree to this share, or to this [m or s]: it has eight
/// decimals.
constexpr double kAgreement = 1e-6;
constexpr double kDegree = std::numbers::pi / 180;

bool agree(double a, double b) {
  return std::fabs(a - b) <= kAgreement * std::max(1.0, std::max(std::fabs(a), std::fabs(b)));
}

constexpr std::int64_t kLine = 1, kArc = 2;
constexpr std::array<std::int64_t, 3> kTrapezoidal{4, 5, 1};
/// How the tool turns: it keeps its orientation, or its three angles change in proportion with a
/// constant acceleration.
constexpr std::array<std::int64_t, 2> kNoTurn{0, 0}, kAngles{1, 2};

/// The numbers of a section behind its codes, in order.
struct Timing {
  double duration = 0;               ///< [s]
  double speed = 0;                  ///< greatest along the curve [m/s]
  double start_speed = 0, rate = 0;  ///< of laws that no known file uses for the position
  double turn_speed = 0, turn_start_speed = 0, turn_rate = 0;  ///< of the angles [deg/s, deg/s^2]
  double share = 0, other_share = 0;  ///< of the duration to speed up and to slow down
};

/// What a control point repeats or says besides its frame: position [m], angles as written [deg]
/// and their rates [deg/s].
struct PointNumbers {
  Vec3 position{}, angles{}, rates{};
};

class TrajectoryBinder {
 public:
  TrajectoryBinder(LegacyReader& in, const Syntax& s, LegacyBound& out)
      : in_(in), s_(s), out_(out) {}

  Result<void> whole() {
    RMP_TRY_ASSIGN(trajectory_.description, in_.text("the description"));
    const std::uint32_t flag_at = in_.offset();
    RMP_TRY_ASSIGN(const auto flag, in_.whole("the trajectory's code"));
    if (flag != 0)
      return unknown(flag_at, "the trajectory's code", flag, "In all known files it is 0.");
    const std::uint32_t total_at = in_.offset();
    RMP_TRY_ASSIGN(const auto samples, in_.whole("the number of samples"));
    RMP_TRY_ASSIGN(const double time, in_.number("the total time"));
    RMP_TRY(in_.units(2));
    RMP_TRY_ASSIGN(const auto frame, in_.frame("the frame of the trajectory"));
    frame_ = model::pose(frame.placement);
    is_placed_ = frame.placement.position != Vec3{} || frame.placement.angles != Vec3{};
    do {
      RMP_TRY(section());
      (void)in_.accept(',');
    } while (in_.next() == '{');
    if (samples != samples_ + 1 || !agree(time, time_))
      out_.notes.push_back(s_.place(total_at) + ": the file says " + std::to_string(samples) +
                           " samples in " + print(time) + " s; its sections give " +
                           std::to_string(samples_ + 1) + " in " + print(time_) + " s.");
    return done();
  }

  Result<void> alone() {
    out_.notes.push_back(quote(s_.file) +
                         ": no .stn file of the 2006 program is known; it is read as a section of "
                         "a trajectory.");
    RMP_TRY(section());
    return done();
  }

 private:
  Result<void> done() {
    out_.record.body = std::move(trajectory_);
    return {};
  }

  Error unknown(std::uint32_t at, const std::string& what, std::int64_t code,
                std::string hint) const {
    return s_.at(at, ErrorCode::unsupported, what + " " + std::to_string(code) + " is not known",
                 std::move(hint));
  }

  /// Codes that have one meaning together; the first that differs is told.
  template <std::size_t N>
  Result<void> codes(const char* what, const std::array<std::int64_t, N>& known,
                     const std::array<const char*, N>& names, const char* hint) {
    for (std::size_t i = 0; i < N; ++i) {
      const std::uint32_t at = in_.offset();
      RMP_TRY_ASSIGN(const auto code, in_.whole(names[i]));
      if (code != known[i]) return unknown(at, std::string(what) + ": " + names[i], code, hint);
    }
    return {};
  }

  Result<void> section() {
    const std::size_t index = trajectory_.segments.size();
    RMP_TRY(in_.expect('{', "{"));
    const std::uint32_t start = in_.offset();
    out_.places[{"segment", index}] = start;
    RMP_TRY_ASSIGN(const std::string name, in_.text("the section's name"));
    const std::string what =
        "section " + std::to_string(index + 1) + (name.empty() ? "" : " " + quote(name));
    const char* what_text = what.c_str();
    RMP_TRY(codes<2>(what_text, {0, 0}, {"the first code", "the second code"},
                     "In all known files the first two codes of a section are 0."));
    const std::uint32_t curve_at = in_.offset();
    RMP_TRY_ASSIGN(const auto curve, in_.whole("the curve's code"));
    if (curve != kLine && curve != kArc)
      return unknown(curve_at, what + ": the curve's code", curve,
                     "Known are 1 (line) and 2 (arc through three points).");
    RMP_TRY(codes<3>(what_text, kTrapezoidal,
                     {"the fourth code (motion law)", "the fifth code (motion law)",
                      "the sixth code (motion law)"},
                     "Known is 4 5 1: the speed is a trapezoid in time."));
    const std::uint32_t turn_at = in_.offset();
    std::array<std::int64_t, 2> turn{};
    for (std::int64_t& code : turn) {
      RMP_TRY_ASSIGN(code, in_.whole("a code of the orientation"));
    }
    if (turn != kNoTurn && turn != kAngles)
      return s_.at(turn_at, ErrorCode::unsupported,
                   what + ": the seventh and eighth code (orientation) " + std::to_string(turn[0]) +
                       " " + std::to_string(turn[1]) + " are not known",
                   "Known are 0 0 (the tool keeps its orientation) and 1 2 (its angles change in "
                   "proportion, with a constant acceleration).");
    if (turn == kAngles && curve != kLine)
      return s_.at(
          turn_at, ErrorCode::unsupported,
          what + ": the seventh and eighth code (orientation) 1 2 are only known of a line",
          "What an arc does with the angles of its middle point is not.");
    const std::uint32_t samples_at = in_.offset();
    RMP_TRY_ASSIGN(const auto samples, in_.whole("the number of samples"));
    if (samples < 1)
      return in_.at(samples_at, "the number of samples is " + std::to_string(samples) +
                                    "; it must be at least 1");
    const std::uint32_t count_at = in_.offset();
    RMP_TRY_ASSIGN(const auto count, in_.whole("the number of points"));
    if (count != (curve == kLine ? 2 : 3))
      return in_.at(count_at, what + " has " + std::to_string(count) + " points",
                    curve == kLine ? "A line has 2." : "An arc has 3.");
    const std::uint32_t timing_at = in_.offset();
    Timing t;
    for (double* x : {&t.duration, &t.speed, &t.start_speed, &t.rate, &t.turn_speed,
                      &t.turn_start_speed, &t.turn_rate, &t.share, &t.other_share}) {
      RMP_TRY_ASSIGN(*x, in_.number("a speed or time of the section"));
    }
    const std::uint32_t space_at = in_.offset();
    RMP_TRY_ASSIGN(const std::string_view space, in_.word("the space, such as Cartesian"));
    if (space != "Cartesian")
      return s_.at(space_at, ErrorCode::unsupported,
                   what + ": the space " + quote(space) + " is not known",
                   "In all known files it is Cartesian.");

    TrajectorySegment segment;
    segment.transition.is_smooth = false;  // sections begin and end at rest; a gap is a fault
    std::vector<PointNumbers> numbers;
    RMP_TRY(points(what, static_cast<std::size_t>(count), segment, numbers));
    RMP_TRY(in_.expect('}', "}"));
    for (const Placement& p : segment.points)
      if (turn == kNoTurn && !agree_in_orientation(p, segment.points.front()))
        return in_.at(start, what + " has points of different orientations",
                      "By its seventh and eighth code (0 0) the tool keeps its orientation.");
    RMP_TRY_ASSIGN(const double length, length_of(segment.points, start, what));
    RMP_TRY_ASSIGN(const double duration, trapezoid(what, t, length, samples, timing_at, segment));
    segment.shape.name = curve == kLine ? "line" : "arc";
    segment.orientation.name = "fixed";
    if (turn == kAngles)
      RMP_TRY(angles(what, t.turn_start_speed, duration, numbers, turn_at, segment));
    if (is_placed_)
      for (Placement& p : segment.points) p = placement(spatial::compose(frame_, pose(p)));
    trajectory_.segments.push_back(std::move(segment));
    return {};
  }

  Result<void> points(const std::string& what, std::size_t count, TrajectorySegment& out,
                      std::vector<PointNumbers>& numbers) {
    RMP_TRY(in_.expect('[', "["));
    while (out.points.size() < count) {
      if (!out.points.empty()) (void)in_.accept(',');
      const std::uint32_t at = in_.offset();
      RMP_TRY_ASSIGN(const auto frame, in_.frame("the frame of a point"));
      if (frame.is_global)
        return in_.at(at, "the reference's type 1 (global) is not known for a point",
                      "In all known files points are relative (0).");
      // Position and orientation again, then rates that follow from the law.
      PointNumbers& number = numbers.emplace_back();
      Vec3 unused{};
      for (Vec3* target : {&number.position, &number.angles, &number.rates, &unused, &unused}) {
        const std::uint32_t numbers_at = in_.offset();
        RMP_TRY_ASSIGN(const auto v, in_.tuple("three numbers of a point"));
        if (v.size() != 3)
          return in_.at(numbers_at, "a point has " + std::to_string(v.size()) +
                                        " numbers in parentheses, not 3");
        *target = {v[0], v[1], v[2]};
        if (target != &number.position) continue;
        const Vec3 p = position(frame.placement);
        for (std::size_t k = 0; k < 3; ++k)
          if (!agree(p[k], v[k]))
            return in_.at(numbers_at,
                          what + ": point " + std::to_string(out.points.size() + 1) +
                              " has a frame at one place and a position at another",
                          "In all known files the two are the same.");
      }
      RMP_TRY_ASSIGN([[maybe_unused]] const double time, in_.number("the time of a point"));
      out.points.push_back(frame.placement);
    }
    return in_.expect(']', "]");
  }

  static bool agree_in_orientation(const Placement& a, const Placement& b) {
    const Pose p = pose(a), q = pose(b);
    for (std::size_t i = 0; i < 9; ++i)
      if (!agree(p.R[i], q.R[i])) return false;
    return true;
  }

  Result<double> length_of(const std::vector<Placement>& points, std::uint32_t at,
                           const std::string& what) {
    const Vec3 first = position(points.front()), last = position(points.back());
    const double chord = spatial::norm(spatial::sub(last, first));
    if (points.size() == 2) {
      if (chord > 0) return chord;
      return in_.at(at, what + " is a line of no length");
    }
    // The angle at the middle point stands on the rest of the circle.
    const Vec3 back = spatial::sub(first, position(points[1])),
               ahead = spatial::sub(last, position(points[1]));
    const double sine = spatial::norm(spatial::cross(back, ahead));
    const double angle = std::atan2(sine, spatial::dot(back, ahead));
    if (!(chord > 0) || !(std::sin(angle) > 1e-9))
      return in_.at(at, what + " is an arc, but its points do not lie on a circle",
                    "The three points must differ and must not be on one line.");
    return chord * (std::numbers::pi - angle) / std::sin(angle);
  }

  /// The three angles change in proportion; how fast, by a constant acceleration from the rate in
  /// the section's times. The rates that the points repeat must be these.
  Result<void> angles(const std::string& what, double start_rate, double duration,
                      const std::vector<PointNumbers>& numbers, std::uint32_t at,
                      TrajectorySegment& out) {
    const auto refuse = [&](const char* fault) {
      return s_.at(at, ErrorCode::unsupported, what + ": " + fault,
                   "This is not so in the only known section with the orientation's codes 1 2.");
    };
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const Placement& p = out.points[i];
      const Vec3& written = numbers[i].angles;  // yaw, pitch, roll
      for (std::size_t k = 0; k < 3; ++k)
        if (p.notation != AngleNotation::rpy || !agree(p.angles[k], written[2 - k] * kDegree))
          return refuse("the angles of a point are not roll, pitch and yaw, written twice");
    }
    const Vec3 change = spatial::sub(numbers.back().angles, numbers.front().angles);
    const double whole = spatial::norm(change);
    if (!(whole > 0)) return {};
    const double mean = whole / duration, end_rate = 2 * mean - start_rate;
    if (!(start_rate >= 0) || !(end_rate >= 0))
      return in_.at(at,
                    what + " turns by " + print(whole) + " degrees in " + print(duration) +
                        " s, but starts at " + print(start_rate) + " degrees/s",
                    "The rate must be between 0 and twice the mean.");
    for (const auto& [number, rate] :
         {std::pair(&numbers.front(), start_rate), std::pair(&numbers.back(), end_rate)})
      for (std::size_t k = 0; k < 3; ++k)
        if (!agree(number->rates[k], change[k] * rate / whole))
          return refuse(
              "the rates of the angles at its points are not those of a constant acceleration");
    const Vec3 &first = out.points.front().angles, &last = out.points.back().angles;
    out.orientation.name = "angles";
    out.orientation.params["first"] = std::vector<double>(first.begin(), first.end());
    out.orientation.params["last"] = std::vector<double>(last.begin(), last.end());
    out.turning.name = "constant_acceleration";
    out.turning.params["duration"] = duration;
    if (start_rate > 0) out.turning.params["start_ratio"] = start_rate / mean;
    return {};
  }

  /// The speed rises for a share of the duration, stays, and falls for the same share. Gives the
  /// duration.
  Result<double> trapezoid(const std::string& what, const Timing& t, double length,
                           std::int64_t samples, std::uint32_t at, TrajectorySegment& out) {
    if (t.share != t.other_share)
      return s_.at(at, ErrorCode::unsupported,
                   what + ": the last two numbers of its times, " + print(t.share) + " and " +
                       print(t.other_share) + ", differ",
                   "In all known files they are the same, so it is not known which is which.");
    if (!(t.share > 0) || t.share > 0.5)
      return in_.at(at, what + " speeds up for " + print(t.share) + " of its time",
                    "It must be above 0 and at most 0.5.");
    if (!(t.speed > 0) || !(t.duration > 0))
      return in_.at(
          at,
          what + " has a speed of " + print(t.speed) + " m/s and takes " + print(t.duration) + " s",
          "Both must be above 0.");
    const double way = t.speed * t.duration * (1 - t.share);
    if (!agree(way, length))
      return in_.at(at,
                    what + " is " + print(length) + " m long, but its speed of " + print(t.speed) +
                        " m/s and its time of " + print(t.duration) + " s are those of " +
                        print(way) + " m",
                    "Speed x time x (1 - share of the time to speed up) must be the length.");
    // The file's time is rounded; this one fits the speed.
    const double duration = length / (t.speed * (1 - t.share));
    out.law.name = "trapezoidal";
    out.shape.params["speed"] = t.speed;
    out.shape.params["acceleration"] = t.speed / (t.share * duration);
    const double step = duration / static_cast<double>(samples);
    if (trajectory_.segments.empty()) trajectory_.sample_time = step;
    else if (!agree(step, trajectory_.sample_time))
      out_.notes.push_back(s_.place(at) + ": " + what + " has samples every " + print(step) +
                           " s, but the trajectory keeps the " + print(trajectory_.sample_time) +
                           " s of its first section.");
    time_ += duration;
    samples_ += samples;
    return duration;
  }

  LegacyReader& in_;
  const Syntax& s_;
  LegacyBound& out_;
  Trajectory trajectory_;
  Pose frame_;
  bool is_placed_ = false;
  double time_ = 0;
  std::int64_t samples_ = 0;
};

}  // namespace

Result<void> bind_legacy_trajectory(LegacyReader& in, const Syntax& s, LegacyBound& out) {
  return TrajectoryBinder(in, s, out).whole();
}

Result<void> bind_legacy_section(LegacyReader& in, const Syntax& s, LegacyBound& out) {
  return TrajectoryBinder(in, s, out).alone();
}

}  // namespace robomosp::io
