// SPDX-License-Identifier: Apache-2.0
// Trajectories of the 2006 program. What the codes of a section mean was found by comparing
// sections with their points, speeds and times; what has no such evidence is refused.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "io/legacy_motion.h"
#include "io/legacy_syntax.h"
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

bool agree(double a, double b) {
  return std::fabs(a - b) <= kAgreement * std::max(1.0, std::max(std::fabs(a), std::fabs(b)));
}

constexpr std::int64_t kLine = 1, kArc = 2, kCircle = 3;
/// What that program called curves and laws that no known file has.
constexpr std::array<const char*, 9> kCurveNames{"none",    "line",          "arc",
                                                 "circle",  "natural cubic", "cubic",
                                                 "quartic", "Bezier curve",  "serpenoid"};
constexpr std::array<const char*, 5> kLawNames{"constant speed", "constant acceleration",
                                               "trapezoid that only speeds up",
                                               "trapezoid that only slows down", "trapezoid"};
/// A law with what it is given by: time, time and first speed, time and share, speed and share.
using LawCodes = std::array<std::int64_t, 2>;
constexpr LawCodes kConstantSpeed{0, 0}, kConstantAcceleration{1, 2}, kTrapezoidByTime{4, 4},
    kTrapezoidBySpeed{4, 5};
/// How the tool turns: it keeps its orientation (nothing said, or as said by its points, which have
/// the same); its three angles change in proportion with a constant acceleration; or on the spot.
using TurnCodes = std::array<std::int64_t, 3>;
constexpr TurnCodes kNoTurn{10, 10, 10}, kSameTurn{1, 0, 0}, kAngles{1, 1, 2}, kOnTheSpot{1, 4, 4};

/// The numbers of a section behind its codes, in order.
struct Timing {
  double duration = 0;     ///< [s]
  double speed = 0;        ///< greatest along the curve [m/s]
  double start_speed = 0;  ///< of kConstantAcceleration [m/s]
  double rate = 0;         ///< of laws that no known file uses for the position
  double turn_speed = 0, turn_start_speed = 0, turn_rate = 0;  ///< of the angles [deg/s, deg/s^2]
  double share = 0, other_share = 0;  ///< of the duration to speed up and to slow down
};

/// What a control point repeats or says besides its frame: position [m], angles as written [deg]
/// their rates [deg/s], and the velocity [m/s].
struct PointNumbers {
  Vec3 position{}, angles{}, rates{}, velocity{};
};

/// A section as read: what unions need of it besides the segment.
struct Section {
  TrajectorySegment segment;
  std::string what;          ///< for messages
  std::uint32_t offset = 0;  ///< in the text
  double duration = 0;       ///< [s]
  std::int64_t samples = 0;
  /// Along a straight line, at its ends, with one orientation; else unions there are not known.
  struct Straight {
    Vec3 start{}, end{};  ///< velocities [m/s]
    bool is_even = false;
  };
  std::optional<Straight> straight;
  std::int64_t cut_before = 0, cut_after = 0;  ///< samples that unions replace

  [[nodiscard]] double step() const { return duration / static_cast<double>(samples); }
};

/// What joins a section to the next: in place of the ends of both, or between them.
struct Union {
  std::string what;
  std::uint32_t offset = 0;
  bool replaces = false;
  double duration = 0;  ///< [s]
  double size = 0;      ///< share of each neighbour's samples that it replaces
  std::int64_t samples = 0;
};

class TrajectoryBinder {
 public:
  TrajectoryBinder(LegacyReader& in, const Syntax& s, LegacyBound& out)
      : in_(in), s_(s), out_(out) {}

  Result<void> whole() {
    RMP_TRY_ASSIGN(trajectory_.description, in_.text("the description"));
    const std::uint32_t flag_at = in_.offset();
    RMP_TRY_ASSIGN(const auto flag, in_.whole("the trajectory's code"));
    if (flag != 0 && flag != 1)
      return unknown(flag_at, "the trajectory's code", flag,
                     "0 means sections only, 1 means sections followed by unions.");
    const std::uint32_t total_at = in_.offset();
    RMP_TRY_ASSIGN(const auto samples, in_.whole("the number of samples"));
    RMP_TRY_ASSIGN(const double time, in_.number("the total time"));
    RMP_TRY(in_.units({LegacyReader::Unit::length, LegacyReader::Unit::angle}));
    RMP_TRY_ASSIGN(const auto frame, in_.frame("the frame of the trajectory"));
    frame_ = model::pose(frame.placement);
    is_placed_ = frame.placement.position != Vec3{} || frame.placement.angles != Vec3{};
    // Unions follow the section that no comma follows.
    bool has_more = false;
    do {
      RMP_TRY(section());
      has_more = in_.accept(',');
    } while (has_more || (flag == 0 && in_.next() == '{'));
    if (flag == 1) RMP_TRY(unions());
    RMP_TRY(build());
    if (samples != samples_ + 1 || !agree(time, time_))
      out_.notes.push_back(
          s_.place(total_at) + ": the file says " + std::to_string(samples) + " samples in " +
          print(time) + " s; its sections give " + std::to_string(samples_ + 1) + " in " +
          print(time_) + " s" +
          (samples == samples_ + 1 + twice_ && agree(time, time_ + time_twice_)
               ? ", since it counts the samples at both ends of the replaced part of a union twice."
               : "."));
    return done();
  }

  Result<void> alone(bool is_braced) {
    if (is_braced)
      out_.notes.push_back(quote(s_.file) +
                           ": no .stn file of the 2006 program is in braces; it is read as a "
                           "section of a trajectory.");
    if (is_braced) RMP_TRY(in_.expect('{', "{"));
    RMP_TRY(bare_section());
    if (is_braced) RMP_TRY(in_.expect('}', "}"));
    RMP_TRY(build());
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

  template <std::size_t N>
  static std::string list(const std::array<std::int64_t, N>& codes) {
    std::string out;
    for (const std::int64_t c : codes) out += (out.empty() ? "" : " ") + std::to_string(c);
    return out;
  }

  /// What a section does: the codes behind its name.
  struct Codes {
    std::int64_t curve = 0;
    LawCodes law{};
    TurnCodes turn{};
    bool turn_leads = false;
    std::uint32_t turn_at = 0;  ///< offset of `turn`
  };

  Result<Codes> codes(const std::string& what) {
    Codes out;
    const std::uint32_t space_at = in_.offset();
    RMP_TRY_ASSIGN(const auto space, in_.whole("the first code"));
    if (space != 0)
      return unknown(space_at, what + ": the first code", space, "In all known files it is 0.");
    const std::uint32_t lead_at = in_.offset();
    RMP_TRY_ASSIGN(const auto lead, in_.whole("the second code"));
    if (lead != 0 && lead != 1)
      return unknown(lead_at, what + ": the second code", lead,
                     "Known are 0 (timed by the path) and 1 (timed by the rotation).");
    out.turn_leads = lead == 1;
    const std::uint32_t curve_at = in_.offset();
    RMP_TRY_ASSIGN(out.curve, in_.whole("the curve's code"));
    if (out.curve < kLine || out.curve > kCircle)
      return not_read(curve_at, what + ": the curve's code", std::to_string(out.curve),
                      name_of(kCurveNames, out.curve),
                      "Known are 1 (line), 2 (arc through three points) and 3 (full circle through "
                      "three points).");
    const std::uint32_t law_at = in_.offset();
    for (std::int64_t& code : out.law) {
      RMP_TRY_ASSIGN(code, in_.whole("a code of the motion law"));
    }
    if (out.law != kConstantSpeed && out.law != kConstantAcceleration &&
        out.law != kTrapezoidByTime && out.law != kTrapezoidBySpeed)
      return not_read(law_at, what + ": the fourth and fifth code (motion law)", list(out.law),
                      name_of(kLawNames, out.law[0]),
                      "Known are 0 0 (constant speed), 1 2 (constant acceleration), 4 4 and 4 5 "
                      "(the speed is a trapezoid in time).");
    out.turn_at = in_.offset();
    for (std::int64_t& code : out.turn) {
      RMP_TRY_ASSIGN(code, in_.whole("a code of the orientation"));
    }
    const std::string turn = what + ": the sixth to eighth code (orientation) " + list(out.turn);
    const auto refuse = [&](const std::string& fault, const char* hint) {
      return s_.at(out.turn_at, ErrorCode::unsupported, fault, hint);
    };
    if (out.turn != kNoTurn && out.turn != kSameTurn && out.turn != kAngles &&
        out.turn != kOnTheSpot)
      return refuse(turn + " are not known",
                    "Known are 10 10 10 and 1 0 0 (the tool keeps its orientation), 1 1 2 (its "
                    "angles change in proportion, with a constant acceleration) and 1 4 4 (it "
                    "rotates in place, with a trapezoidal rate).");
    if (out.turn == kAngles && out.curve != kLine)
      return refuse(turn + " are known for lines only",
                    "The use of the angles of an arc's middle point is unknown.");
    const bool is_on_the_spot = out.turn == kOnTheSpot;
    if (out.turn_leads != is_on_the_spot ||
        (is_on_the_spot && (out.curve != kLine || out.law != kConstantSpeed)))
      return refuse(what + ": the codes " + std::to_string(space) + " " + std::to_string(lead) +
                        " " + std::to_string(out.curve) + " " + list(out.law) + " " +
                        list(out.turn) + " are not known together",
                    "A rotation in place is 0 1 1 0 0 1 4 4; everything else begins with 0 0.");
    return out;
  }

  template <std::size_t N>
  static std::string name_of(const std::array<const char*, N>& names, std::int64_t code) {
    return code >= 0 && code < static_cast<std::int64_t>(N) ? names[static_cast<std::size_t>(code)]
                                                            : std::string();
  }

  /// Of codes that have a name but no file to learn their numbers from.
  Error not_read(std::uint32_t at, const std::string& what, const std::string& code,
                 const std::string& name, const char* hint) const {
    return s_.at(at, ErrorCode::unsupported,
                 what + " " + code + (name.empty() ? "" : " (" + name + ")") +
                     (code.find(' ') == std::string::npos ? " is not known" : " are not known"),
                 hint);
  }

  Result<void> section() {
    RMP_TRY(in_.expect('{', "{"));
    RMP_TRY(bare_section());
    return in_.expect('}', "}");
  }

  Result<void> bare_section() {
    Section out;
    out.offset = in_.offset();
    RMP_TRY_ASSIGN(const std::string name, in_.text("the section's name"));
    out.what =
        "section " + std::to_string(sections_.size() + 1) + (name.empty() ? "" : " " + quote(name));
    const std::string& what = out.what;
    const std::uint32_t start = out.offset;
    RMP_TRY_ASSIGN(const Codes codes, this->codes(what));
    const auto curve = codes.curve;
    const std::uint32_t samples_at = in_.offset();
    RMP_TRY_ASSIGN(out.samples, in_.whole("the number of samples"));
    if (out.samples < 1)
      return in_.at(samples_at, "the number of samples is " + std::to_string(out.samples) +
                                    "; it must be at least 1");
    const std::uint32_t count_at = in_.offset();
    RMP_TRY_ASSIGN(const auto count, in_.whole("the number of points"));
    if (count != (curve == kLine ? 2 : 3))
      return in_.at(count_at, what + " has " + std::to_string(count) + " points",
                    curve == kLine  ? "A line has 2."
                    : curve == kArc ? "An arc has 3."
                                    : "A circle has 3.");
    const std::uint32_t timing_at = in_.offset();
    Timing t;
    for (double* x : {&t.duration, &t.speed, &t.start_speed, &t.rate, &t.turn_speed,
                      &t.turn_start_speed, &t.turn_rate, &t.share, &t.other_share}) {
      RMP_TRY_ASSIGN(*x, in_.number("a speed or time of the section"));
    }
    for (double* x : {&t.speed, &t.start_speed}) *x = in_.metres(*x);
    const std::uint32_t space_at = in_.offset();
    RMP_TRY_ASSIGN(const std::string_view space, in_.word("the space, such as Cartesian"));
    if (space != "Cartesian")
      return s_.at(space_at, ErrorCode::unsupported,
                   what + ": the space " + quote(space) + " is not known",
                   "In all known files it is Cartesian.");

    TrajectorySegment& segment = out.segment;
    segment.transition.is_smooth = false;  // sections must meet; the speed may jump
    std::vector<PointNumbers> numbers;
    RMP_TRY(points(what, static_cast<std::size_t>(count), segment, numbers));
    if (codes.turn == kNoTurn || codes.turn == kSameTurn)
      for (std::size_t i = 1; i < segment.points.size(); ++i) {
        // A circle keeps its orientation whatever its middle point says.
        if (curve == kCircle && i == 1) continue;
        if (!agree_in_orientation(segment.points[i], segment.points.front()))
          return in_.at(start, what + " has points of different orientations",
                        "By its sixth to eighth code (" + list(codes.turn) +
                            ") the tool keeps its orientation.");
      }
    RMP_TRY_ASSIGN(const double length, length_of(codes, segment.points, start, what));
    segment.shape.name = curve == kLine ? "line" : curve == kArc ? "arc" : "circle";
    segment.orientation.name = "fixed";
    out.duration = t.duration;
    Section::Straight straight;
    if (codes.law == kTrapezoidBySpeed) {
      RMP_TRY_ASSIGN(out.duration, trapezoid_by_speed(what, t, length, timing_at, segment));
    } else if (!(t.duration > 0)) {
      return in_.at(timing_at, what + " takes " + print(t.duration) + " s",
                    "Its time must be above 0.");
    } else if (codes.law == kTrapezoidByTime) {
      RMP_TRY(trapezoid_by_time(what, t, length, timing_at, segment));
    } else if (codes.law == kConstantAcceleration) {
      RMP_TRY(constant_acceleration(what, t, length, numbers.front(), timing_at, segment));
    } else if (length > 0) {
      segment.law.name = "constant_speed";
      segment.shape.params["duration"] = t.duration;
    }
    if (codes.law == kConstantAcceleration || codes.law == kConstantSpeed) {
      const double mean = length / t.duration;
      straight.is_even = codes.law == kConstantSpeed;
      const Vec3 way =
          spatial::sub(position(segment.points.back()), position(segment.points.front()));
      const auto along = [&](double speed) {
        return length > 0 ? spatial::scale(way, speed / length) : Vec3{};
      };
      straight.start = along(straight.is_even ? mean : t.start_speed);
      straight.end = along(straight.is_even ? mean : 2 * mean - t.start_speed);
    }
    if (codes.turn == kAngles) {
      RMP_TRY(angles(what, t.turn_start_speed, out.duration, numbers, codes.turn_at, segment));
    } else if (codes.turn == kOnTheSpot) {
      RMP_TRY(turn_on_the_spot(what, t, numbers, codes.turn_at, timing_at, segment));
    }
    if (!(length > 0) && segment.orientation.name == "fixed") wait(out.duration, segment);
    if (curve == kLine && segment.orientation.name == "fixed") out.straight = straight;
    sections_.push_back(std::move(out));
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
      for (Vec3* target :
           {&number.position, &number.angles, &number.rates, &number.velocity, &unused}) {
        const std::uint32_t numbers_at = in_.offset();
        RMP_TRY_ASSIGN(const auto v, in_.tuple("three numbers of a point"));
        if (v.size() != 3)
          return in_.at(numbers_at, "a point has " + std::to_string(v.size()) +
                                        " numbers in parentheses, not 3");
        *target = {v[0], v[1], v[2]};
        if (target == &number.position || target == &number.velocity)
          for (double& x : *target) x = in_.metres(x);
        if (target != &number.position) continue;
        const Vec3 p = position(frame.placement);
        for (std::size_t k = 0; k < 3; ++k)
          if (!agree(p[k], number.position[k]))
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

  Result<double> length_of(const Codes& codes, const std::vector<Placement>& points,
                           std::uint32_t at, const std::string& what) {
    const Vec3 first = position(points.front()), last = position(points.back());
    const double chord = spatial::norm(spatial::sub(last, first));
    if (points.size() == 2) {
      if (codes.turn == kOnTheSpot && chord > 0)
        return s_.at(codes.turn_at, ErrorCode::unsupported,
                     what + " moves by " + print(chord) + " m while it is timed by the rotation",
                     "Only a rotation in place is known.");
      // At constant speed over a given time, no length is a wait.
      if (chord > 0 || codes.law == kConstantSpeed) return chord;
      return in_.at(at, what + " is a line of no length");
    }
    const char* shape = codes.curve == kArc ? " is an arc" : " is a circle";
    // The angle at the middle point stands on the rest of the circle.
    const Vec3 back = spatial::sub(first, position(points[1])),
               ahead = spatial::sub(last, position(points[1]));
    const double sine = spatial::norm(spatial::cross(back, ahead));
    const double angle = std::atan2(sine, spatial::dot(back, ahead));
    if (!(chord > 0) || !(std::sin(angle) > 1e-9))
      return in_.at(at, what + shape + ", but its points do not lie on a circle",
                    "The three points must differ and must not be on one line.");
    const double diameter = chord / std::sin(angle);
    return diameter * (codes.curve == kArc ? std::numbers::pi - angle : std::numbers::pi);
  }

  Error other_angles(const std::string& what, std::uint32_t at, const char* fault) const {
    return s_.at(at, ErrorCode::unsupported, what + ": " + fault,
                 "No known section with these orientation codes does this.");
  }

  /// Angles as rotations about z, y and x, the same twice.
  Result<void> check_angles(const std::string& what, const std::vector<PointNumbers>& numbers,
                            std::uint32_t at, const TrajectorySegment& out) const {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const Placement& p = out.points[i];
      const Vec3& written = numbers[i].angles;  // yaw, pitch, roll
      for (std::size_t k = 0; k < 3; ++k)
        if (p.notation != AngleRepresentation::rpy || !agree(p.angles[k], written[2 - k] * kDegree))
          return other_angles(what, at,
                              "the angles of a point are not roll, pitch and yaw, written twice");
    }
    return {};
  }

  static void set_angles(TrajectorySegment& out) {
    const Vec3 &first = out.points.front().angles, &last = out.points.back().angles;
    out.orientation.name = "angles";
    out.orientation.params["first"] = std::vector<double>(first.begin(), first.end());
    out.orientation.params["last"] = std::vector<double>(last.begin(), last.end());
  }

  /// The three angles change in proportion; how fast, by a constant acceleration from the rate in
  /// the section's times. The rates that the points repeat must be these.
  Result<void> angles(const std::string& what, double start_rate, double duration,
                      const std::vector<PointNumbers>& numbers, std::uint32_t at,
                      TrajectorySegment& out) {
    RMP_TRY(check_angles(what, numbers, at, out));
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
          return other_angles(
              what, at,
              "the rates of the angles at its points are not those of a constant acceleration");
    set_angles(out);
    out.turning.name = "constant_acceleration";
    out.turning.params["duration"] = duration;
    if (start_rate > 0) out.turning.params["start_ratio"] = start_rate / mean;
    return {};
  }

  /// The share of the time to speed up and to slow down again.
  Result<void> check_share(const std::string& what, double share, std::uint32_t at) {
    if (share > 0 && share <= 0.5) return {};
    return in_.at(at, what + " speeds up for " + print(share) + " of its time",
                  "It must be above 0 and at most 0.5.");
  }

  Error shares_differ(const std::string& what, const Timing& t, std::uint32_t at) const {
    return s_.at(at, ErrorCode::unsupported,
                 what + ": the last two numbers of its times, " + print(t.share) + " and " +
                     print(t.other_share) + ", differ",
                 "In all known files they are the same, so their meaning is unclear.");
  }

  /// The speed rises for a share of the duration, stays, and falls for the same share. Gives the
  /// duration.
  Result<double> trapezoid_by_speed(const std::string& what, const Timing& t, double length,
                                    std::uint32_t at, TrajectorySegment& out) {
    if (t.share != t.other_share) return shares_differ(what, t, at);
    RMP_TRY(check_share(what, t.share, at));
    if (!(t.speed > 0) || !(t.duration > 0))
      return in_.at(
          at,
          what + " has a speed of " + print(t.speed) + " m/s and takes " + print(t.duration) + " s",
          "Both must be above 0.");
    const double way = t.speed * t.duration * (1 - t.share);
    if (!agree(way, length))
      return in_.at(
          at,
          what + " is " + print(length) + " m long, but its speed of " + print(t.speed) +
              " m/s and its time of " + print(t.duration) + " s are those of " + print(way) + " m",
          "Speed x time x (1 - fraction of the time for acceleration) must be the length.");
    // The file's time is rounded; this one fits the speed.
    const double duration = length / (t.speed * (1 - t.share));
    RMP_TRY(set_trapezoid(what, t.speed, t.share * duration, at, out));
    return duration;
  }

  Result<void> set_trapezoid(const std::string& what, double speed, double ramp, std::uint32_t at,
                             TrajectorySegment& out) {
    RMP_TRY(check_rates(what, speed, speed / ramp, at));
    out.law.name = "trapezoidal";
    out.shape.params["speed"] = speed;
    out.shape.params["acceleration"] = speed / ramp;
    return {};
  }

  /// Of very long, short or fast sections.
  Result<void> check_rates(const std::string& what, double rate, double change, std::uint32_t at) {
    if (rate > 0 && change > 0 && std::isfinite(change)) return {};
    return in_.at(
        at, what + " has a speed of " + print(rate) + " and an acceleration of " + print(change),
        "Check its time, and the fraction of it for acceleration.");
  }

  /// The same by the time; the eighth number is the share of both ends, the ninth is not used.
  Result<void> trapezoid_by_time(const std::string& what, const Timing& t, double length,
                                 std::uint32_t at, TrajectorySegment& out) {
    RMP_TRY(check_share(what, t.share, at));
    const double speed = length / (t.duration * (1 - t.share));
    return set_trapezoid(what, speed, t.share * t.duration, at, out);
  }

  Result<void> constant_acceleration(const std::string& what, const Timing& t, double length,
                                     const PointNumbers& first, std::uint32_t at,
                                     TrajectorySegment& out) {
    if (!agree(t.start_speed, spatial::norm(first.velocity)))
      return s_.at(at, ErrorCode::unsupported,
                   what + " starts at " + print(t.start_speed) +
                       " m/s by the third number of its times, but at " +
                       print(spatial::norm(first.velocity)) + " m/s by its first point",
                   "In all known files the two are the same.");
    const double most = 2 * length / t.duration;
    if (!(t.start_speed >= 0) || t.start_speed > most)
      return in_.at(at,
                    what + " is " + print(length) + " m long in " + print(t.duration) +
                        " s, but starts at " + print(t.start_speed) + " m/s",
                    "The speed must be between 0 and twice the mean.");
    out.law.name = "constant_acceleration";
    out.shape.params["duration"] = t.duration;
    if (t.start_speed > 0) out.shape.params["start_speed"] = t.start_speed;
    return {};
  }

  Result<void> turn_on_the_spot(const std::string& what, const Timing& t,
                                const std::vector<PointNumbers>& numbers, std::uint32_t turn_at,
                                std::uint32_t timing_at, TrajectorySegment& out) {
    // Of the way it is the eighth number; whether of the turn too is not known.
    if (t.share != t.other_share) return shares_differ(what, t, timing_at);
    RMP_TRY(check_share(what, t.share, timing_at));
    RMP_TRY(check_angles(what, numbers, turn_at, out));
    const Vec3 &first = out.points.front().angles, &last = out.points.back().angles;
    const Vec3 change = spatial::sub(last, first);
    if (std::count(change.begin(), change.end(), 0.0) < 2)
      return s_.at(turn_at, ErrorCode::unsupported,
                   what + " rotates in place by more than one of its angles",
                   "Only a rotation by one angle is known.");
    const double turn = spatial::norm(change);
    if (!(turn > 0)) return {};
    set_angles(out);
    const double rate = turn / (t.duration * (1 - t.share)),
                 change_of_rate = rate / (t.share * t.duration);
    RMP_TRY(check_rates(what, rate, change_of_rate, timing_at));
    out.turning.name = "trapezoidal";
    out.turning.params["angular_speed"] = rate;
    out.turning.params["angular_acceleration"] = change_of_rate;
    return {};
  }

  /// A curve with times of its own whose points are one place.
  static void wait(double duration, TrajectorySegment& out) {
    out.shape.name = "cubic_spline";
    out.shape.params["times"] = std::vector<double>{0, duration};
  }

  /// One for each two sections that follow each other.
  Result<void> unions() {
    bool has_more = false;
    do {
      RMP_TRY(in_.expect('{', "{ before a union section"));
      if (unions_.size() + 1 >= sections_.size())
        return in_.at(in_.offset(), "a union section has no two sections to join",
                      "The first joins the first two sections, and so on.");
      Union u;
      u.offset = in_.offset();
      RMP_TRY_ASSIGN(const std::string name, in_.text("the kind of a union section"));
      u.what = "union section " + std::to_string(unions_.size() + 1);
      if (name != "SUSG" && name != "NUSG")
        return s_.at(u.offset, ErrorCode::unsupported,
                     u.what + ": the kind " + quote(name) + " is not known",
                     "Known are SUSG (in place of the ends of two sections) and NUSG (between "
                     "them).");
      u.replaces = name == "SUSG";
      const std::uint32_t kind_at = in_.offset();
      RMP_TRY_ASSIGN(const auto kind, in_.whole("the union's code"));
      if (kind != 0)
        return unknown(kind_at, u.what + ": the code", kind, "In all known files it is 0.");
      RMP_TRY_ASSIGN(u.duration, in_.number("the union's time"));
      RMP_TRY_ASSIGN(u.size, in_.number("the union's size"));
      RMP_TRY_ASSIGN(u.samples, in_.whole("the union's samples"));
      if (!(u.duration > 0) || u.samples < 1)
        return in_.at(u.offset,
                      u.what + " takes " + print(u.duration) + " s and has " +
                          std::to_string(u.samples) + " samples",
                      "Its time must be above 0, and it has at least 1.");
      RMP_TRY(in_.expect('}', "}"));
      has_more = in_.accept(',');
      const std::size_t i = unions_.size();
      RMP_TRY(check_neighbours(u, sections_[i], sections_[i + 1]));
      if (u.replaces) RMP_TRY(cut(u, sections_[i], sections_[i + 1]));
      unions_.push_back(std::move(u));
    } while (has_more || unions_.size() + 1 < sections_.size());
    return {};
  }

  /// Known are unions of straight sections, of one orientation, that have a speed at their ends.
  Result<void> check_neighbours(const Union& u, const Section& before, const Section& after) {
    for (const Section* s : {&before, &after}) {
      if (!s->straight)
        return s_.at(u.offset, ErrorCode::unsupported,
                     u.what + " joins " + s->what + ", which is not a line, or rotates",
                     "Only unions of lines with constant orientation are known.");
      if (u.replaces && !s->straight->is_even)
        return s_.at(u.offset, ErrorCode::unsupported,
                     u.what + " takes a part of " + s->what + ", which has no constant speed",
                     "Only unions of kind SUSG between lines at constant speed are known.");
    }
    if (!agree_in_orientation(before.segment.points.back(), after.segment.points.front()))
      return s_.at(u.offset, ErrorCode::unsupported,
                   u.what + " joins sections of different orientations",
                   "In all known files they are the same.");
    return {};
  }

  /// Its size is the share of the samples of each neighbour, to whole ones, and its time is theirs.
  Result<void> cut(Union& u, Section& before, Section& after) {
    if (!(u.size > 0 && u.size < 1))
      return in_.at(u.offset, u.what + " replaces " + print(u.size) + " of its neighbours",
                    "It must be above 0 and below 1.");
    const auto samples = [&](const Section& s, bool is_up) {
      const double n = u.size * static_cast<double>(s.samples);
      return static_cast<std::int64_t>(is_up ? std::ceil(n) : std::floor(n));
    };
    const auto time = [&](std::int64_t a, std::int64_t b) {
      return static_cast<double>(a) * before.step() + static_cast<double>(b) * after.step();
    };
    for (const bool up_before : {true, false})
      for (const bool up_after : {true, false}) {
        const auto a = samples(before, up_before), b = samples(after, up_after);
        if (!agree(time(a, b), u.duration)) continue;
        before.cut_after = a;
        after.cut_before = b;
        u.duration = time(a, b);  // the file's is rounded
        for (const Section* s : {&before, &after})
          if (s->cut_before + s->cut_after >= s->samples)
            return in_.at(u.offset, u.what + " leaves nothing of " + s->what,
                          "Lower its size, the fraction of the section that it replaces.");
        return {};
      }
    return s_.at(u.offset, ErrorCode::unsupported,
                 u.what + " takes " + print(u.duration) + " s, but what it replaces of " +
                     before.what + " and " + after.what + " takes " +
                     text::print_rounded(time(samples(before, true), samples(after, true))) + " s",
                 "In all known files the two are the same.");
  }

  /// What unions leave of a section: of a line at constant speed, so a part of it is one too.
  static void shorten(Section& s) {
    if (s.cut_before == 0 && s.cut_after == 0) return;
    const auto n = static_cast<double>(s.samples);
    const Vec3 from = position(s.segment.points.front()), to = position(s.segment.points.back());
    const auto set = [&](Placement& p, double share) {
      p.position = spatial::add(from, spatial::scale(spatial::sub(to, from), share));
      p.coordinates = PositionRepresentation::cartesian;
    };
    set(s.segment.points.front(), static_cast<double>(s.cut_before) / n);
    set(s.segment.points.back(), static_cast<double>(s.samples - s.cut_after) / n);
    s.samples -= s.cut_before + s.cut_after;
    s.duration *= static_cast<double>(s.samples) / n;
    if (s.segment.shape.params.contains("times")) wait(s.duration, s.segment);
    else s.segment.shape.params["duration"] = s.duration;
  }

  /// A polynomial of third degree in time with the places and velocities of its neighbours.
  [[nodiscard]] static TrajectorySegment joining(const Union& u, const Section& before,
                                                 const Section& after, const Pose& frame) {
    TrajectorySegment out;
    out.transition.is_smooth = false;
    out.points = {before.segment.points.back(), after.segment.points.front()};
    wait(u.duration, out);
    out.orientation.name = "fixed";
    out.shape.params["ends"] = std::string("clamped");
    for (const auto& [name, v] : {std::pair("start_velocity", before.straight->end),
                                  std::pair("end_velocity", after.straight->start)}) {
      const Vec3 seen = spatial::rotate(frame, v);
      out.shape.params[name] = std::vector<double>(seen.begin(), seen.end());
    }
    return out;
  }

  /// The sections in order with the unions between them.
  Result<void> build() {
    for (std::size_t i = 0; i < unions_.size(); ++i)
      if (unions_[i].replaces) {
        twice_ += 2;
        time_twice_ += sections_[i].step() + sections_[i + 1].step();
      }
    for (Section& s : sections_) shorten(s);
    for (std::size_t i = 0; i < sections_.size(); ++i) {
      const Section& s = sections_[i];
      add(s.segment, s.what, s.offset, s.duration, s.samples);
      if (i >= unions_.size()) continue;
      const Union& u = unions_[i];
      add(joining(u, s, sections_[i + 1], frame_), u.what, u.offset, u.duration, u.samples);
    }
    return {};
  }

  void add(TrajectorySegment segment, const std::string& what, std::uint32_t offset,
           double duration, std::int64_t samples) {
    if (is_placed_)
      for (Placement& p : segment.points) p = placement(spatial::compose(frame_, pose(p)));
    out_.places[{"segment", trajectory_.segments.size()}] = offset;
    const double step = duration / static_cast<double>(samples);
    if (trajectory_.segments.empty()) trajectory_.sample_time = step;
    else if (!agree(step, trajectory_.sample_time))
      out_.notes.push_back(s_.place(offset) + ": " + what + " has samples every " + print(step) +
                           " s, but the trajectory keeps the " + print(trajectory_.sample_time) +
                           " s of its first section.");
    trajectory_.segments.push_back(std::move(segment));
    time_ += duration;
    samples_ += samples;
  }

  LegacyReader& in_;
  const Syntax& s_;
  LegacyBound& out_;
  Trajectory trajectory_;
  Pose frame_;
  bool is_placed_ = false;
  std::vector<Section> sections_;
  std::vector<Union> unions_;  ///< the first joins the first two sections
  double time_ = 0;
  std::int64_t samples_ = 0;
  /// What the file's total counts twice at unions that replace ends.
  std::int64_t twice_ = 0;
  double time_twice_ = 0;
};

}  // namespace

Result<void> bind_legacy_trajectory(LegacyReader& in, const Syntax& s, LegacyBound& out) {
  return TrajectoryBinder(in, s, out).whole();
}

Result<void> bind_legacy_section(LegacyReader& in, const Syntax& s, bool is_braced,
                                 LegacyBound& out) {
  return TrajectoryBinder(in, s, out).alone(is_braced);
}

}  // namespace robomosp::io
