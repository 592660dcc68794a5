// SPDX-License-Identifier: Apache-2.0
#include "motion/segment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>

#include "kernel/known_provider.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "motion/curve_walk.h"
#include "motion/provider_params.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

using spatial::add;
using spatial::scale;

constexpr const char* kDefaultLaw = "constant_speed";
constexpr const char* kDefaultOrientation = "slerp";
/// A curve of no more than this is no motion.
constexpr double kStandsWithin = 1e-9;  ///< [m]
constexpr double kTurnsWithin = 1e-9;   ///< [rad]

Error bad(std::string message, std::string hint, std::string_view where) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint),
               std::string(where));
}

/// A shape by name, whichever interface provides it.
Result<ProviderInfo> find_shape(const Registry& registry, const std::string& name,
                                std::string_view where) {
  constexpr const char* kShapes[] = {CurveFactory::kInterfaceId, SegmentFactory::kInterfaceId,
                                     JointSegmentFactory::kInterfaceId};
  for (const char* id : kShapes) {
    if (name.empty()) break;
    auto info = registry.find(id, name);
    if (info.ok()) return info;
    if (known_provider(registry, id, name).ok()) return std::move(info).error().in(where);  // disabled
  }
  std::vector<std::string> names;
  for (const char* id : kShapes)
    for (const ProviderInfo& info : registry.list(id))
      if (info.enabled) names.push_back(info.name);
  std::string hint = text::did_you_mean(name, names);
  if (hint.empty())
    hint = names.empty() ? "No shapes are loaded; see plugin.list()."
                         : "Shapes are " + text::enumerate(names) + ".";
  return error(ErrorCode::unknown_name, text::quote(name) + " is not a shape of segments", hint,
               std::string(where));
}

/// The tool along a curve, timed by a law, turned by an orientation; `turning`, when there is one,
/// times the turn, else the law does.
class TimedCurve final : public Segment {
 public:
  TimedCurve(CurveWalk walk, std::shared_ptr<const MotionLaw> law,
             std::shared_ptr<const Orientation> orientation,
             std::shared_ptr<const MotionLaw> turning, double length)
      : walk_(std::move(walk)),
        law_(std::move(law)),
        orientation_(std::move(orientation)),
        turning_(std::move(turning)),
        length_(length) {}

  [[nodiscard]] double duration() const override { return law_->duration(); }
  [[nodiscard]] double length() const override { return length_; }

  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    constexpr std::size_t kChunk = 64;
    std::array<LawSample, kChunk> law;
    std::array<double, kChunk> shares;
    std::array<CurveSample, kChunk> along;
    std::array<OrientationSample, kChunk> turns;
    for (std::size_t first = 0; first < times.size(); first += kChunk) {
      const std::size_t n = std::min(kChunk, times.size() - first);
      const auto w = std::span<const double>(shares).first(n);
      const auto walk_by = [&](const MotionLaw& timing) -> Result<void> {
        RMP_TRY(timing.sample(times.subspan(first, n), std::span(law).first(n)));
        for (std::size_t i = 0; i < n; ++i) shares[i] = law[i].share;
        return walk_.evaluate(w, std::span(along).first(n));
      };
      RMP_TRY(walk_by(*law_));
      for (std::size_t i = 0; i < n; ++i) {
        const LawSample& by = law[i];
        PathSample& s = out[first + i];
        s.pose.p = along[i].p;
        s.velocity = scale(along[i].d1, by.rate);
        s.acceleration =
            add(scale(along[i].d2, by.rate * by.rate), scale(along[i].d1, by.acceleration));
      }
      if (turning_) RMP_TRY(walk_by(*turning_));
      RMP_TRY(orientation_->evaluate(w, std::span<const CurveSample>(along).first(n),
                                     std::span(turns).first(n)));
      for (std::size_t i = 0; i < n; ++i) {
        const LawSample& by = law[i];
        PathSample& s = out[first + i];
        s.pose.R = turns[i].R;
        s.angular_velocity = scale(turns[i].turn, by.rate);
        s.angular_acceleration =
            add(scale(turns[i].bend, by.rate * by.rate), scale(turns[i].turn, by.acceleration));
      }
    }
    return {};
  }

 private:
  CurveWalk walk_;
  std::shared_ptr<const MotionLaw> law_;
  std::shared_ptr<const Orientation> orientation_;
  std::shared_ptr<const MotionLaw> turning_;  ///< as long as law_; null = law_ times the turn too
  double length_;
};

/// A law run more slowly, so that it takes `duration`.
class SlowedLaw final : public MotionLaw {
 public:
  SlowedLaw(std::shared_ptr<const MotionLaw> law, double duration)
      : law_(std::move(law)), duration_(duration), pace_(law_->duration() / duration) {}
  [[nodiscard]] double duration() const override { return duration_; }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    constexpr std::size_t kChunk = 64;
    std::array<double, kChunk> own;
    for (std::size_t first = 0; first < times.size(); first += kChunk) {
      const std::size_t n = std::min(kChunk, times.size() - first);
      for (std::size_t i = 0; i < n; ++i) own[i] = pace_ * times[first + i];
      RMP_TRY(law_->sample(std::span<const double>(own).first(n), out.subspan(first, n)));
      for (LawSample& s : out.subspan(first, n)) {
        s.rate *= pace_;
        s.acceleration *= pace_ * pace_;
        s.jerk *= pace_ * pace_ * pace_;
      }
    }
    return {};
  }

 private:
  std::shared_ptr<const MotionLaw> law_;
  double duration_, pace_;
};

/// Both laws over the duration of the longer one.
void run_together(std::shared_ptr<const MotionLaw>& a, std::shared_ptr<const MotionLaw>& b) {
  auto& shorter = a->duration() < b->duration() ? a : b;
  const double duration = std::max(a->duration(), b->duration());
  if (shorter->duration() < duration) shorter = std::make_shared<SlowedLaw>(shorter, duration);
}

/// The curve's own times.
class OwnTimes final : public MotionLaw {
 public:
  explicit OwnTimes(double duration) : duration_(duration) {}
  [[nodiscard]] double duration() const override { return duration_; }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    // Times this share of the duration beyond an end are that end: callers reach it by sums.
    const double slack = 1e-12 * duration_;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const bool is_moving = times[i] >= -slack && times[i] <= duration_ + slack;
      out[i] = {std::clamp(times[i] / duration_, 0.0, 1.0), is_moving ? 1 / duration_ : 0, 0, 0};
    }
    return {};
  }

 private:
  double duration_;
};

class PlacedSegment final : public Segment {
 public:
  PlacedSegment(const Pose& a_T_b, std::shared_ptr<const Segment> segment)
      : a_T_b_(a_T_b), segment_(std::move(segment)) {}
  [[nodiscard]] double duration() const override { return segment_->duration(); }
  [[nodiscard]] double length() const override { return segment_->length(); }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    RMP_TRY(segment_->sample(times, out));
    for (PathSample& s : out.first(times.size())) {
      s.pose = spatial::compose(a_T_b_, s.pose);
      for (Vec3* v : {&s.velocity, &s.angular_velocity, &s.acceleration, &s.angular_acceleration})
        *v = spatial::rotate(a_T_b_, *v);
    }
    return {};
  }

 private:
  Pose a_T_b_;
  std::shared_ptr<const Segment> segment_;
};

/// The tool stands for a time, which may be zero.
class StandingSegment final : public Segment {
 public:
  StandingSegment(const Pose& pose, double duration) : pose_(pose), duration_(duration) {}
  [[nodiscard]] double duration() const override { return duration_; }
  [[nodiscard]] double length() const override { return 0; }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    for (PathSample& s : out.first(times.size())) s = {pose_, {}, {}, {}, {}};
    return {};
  }

 private:
  Pose pose_;
  double duration_;
};

/// Holds the angular velocity against differences of the orientation; what is not its derivative at
/// a quarter of the places is the provider's fault. (Between pieces it may jump.)
Result<void> check_turning(const CurveWalk& walk, const Orientation& orientation,
                           const ProviderInfo& provider) {
  constexpr std::size_t kProbes = 32;
  constexpr double kStep = 1e-7, kSlack = 1e-2;
  std::vector<double> w;
  for (std::size_t i = 0; i < kProbes; ++i)
    for (const double side : {-kStep, 0.0, kStep})
      w.push_back((static_cast<double>(i) + 0.618) / static_cast<double>(kProbes) + side);
  std::vector<CurveSample> along(w.size());
  std::vector<OrientationSample> s(w.size());
  RMP_TRY(walk.evaluate(w, along));
  RMP_TRY(orientation.evaluate(w, along, s));
  double greatest = 1e-5;  // [rad over the whole way] below this nothing turns
  for (const OrientationSample& o : s) greatest = std::max(greatest, spatial::norm(o.turn));
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < kProbes; ++i) {
    const Vec3 d =
        spatial::scale(spatial::rotation_difference(s[3 * i].R, s[3 * i + 2].R), 1 / (2 * kStep));
    const double gap = spatial::norm(spatial::sub(d, s[3 * i + 1].turn));
    if (!(gap <= kSlack * std::max(greatest, spatial::norm(d)))) ++wrong;
  }
  if (wrong <= kProbes / 4) return {};
  return error(ErrorCode::plugin_failed,
               "provider \"" + provider.name +
                   "\" made an orientation with an angular velocity that is not its derivative",
               "Report it to the provider's author or choose another provider.");
}

/// Greatest |dR/dw| along the way, by dense sampling.
Result<double> greatest_turn(const CurveWalk& walk, const Orientation& orientation) {
  constexpr std::size_t kSamples = 257;
  std::vector<double> w(kSamples);
  for (std::size_t i = 0; i < kSamples; ++i)
    w[i] = static_cast<double>(i) / static_cast<double>(kSamples - 1);
  std::vector<CurveSample> along(kSamples);
  std::vector<OrientationSample> turning(kSamples);
  RMP_TRY(walk.evaluate(w, along));
  RMP_TRY(orientation.evaluate(w, along, turning));
  double most = 0;
  for (const OrientationSample& s : turning) most = std::max(most, spatial::norm(s.turn));
  return most;
}

template <class Made>
Result<std::shared_ptr<const Made>> checked(Result<std::unique_ptr<Made>> made,
                                            const ProviderInfo& provider, std::string_view where) {
  if (!made.ok()) return std::move(made).error().in(where);
  if (!*made)
    return error(ErrorCode::plugin_failed, "provider \"" + provider.name + "\" made nothing",
                 "Report it to the provider's author or choose another provider.",
                 std::string(where));
  return std::shared_ptr<const Made>(std::move(made).value());
}

Result<void> check_duration(double duration, const ProviderInfo& provider, std::string_view where) {
  if (std::isfinite(duration) && duration > 0) return {};
  return error(
      ErrorCode::plugin_failed, "provider \"" + provider.name + "\" returned no positive duration",
      "Report it to the provider's author or choose another provider.", std::string(where));
}

LawTask law_task(double length, double turn) {
  LawTask task;
  task.length = length;
  task.turn = turn;
  return task;
}

Result<std::shared_ptr<const MotionLaw>> run_law(const Registry& registry,
                                                 const ProviderInfo& provider, const LawTask& task,
                                                 const Params& params, std::string_view where) {
  RMP_TRY_ASSIGN(const auto factory, registry.create<MotionLawFactory>(provider.name).in(where));
  RMP_TRY_ASSIGN(auto law,
                 checked(guarded(provider.name, [&] { return factory->make(task, params); }),
                         provider, where));
  RMP_TRY(check_duration(law->duration(), provider, where));
  return law;
}

/// The limits among the parameters of a segment's providers. The turn's own law bounds the turn.
SegmentLimits limits_of(const SegmentProviders& providers, const SegmentParams& params) {
  const auto limit = [](std::initializer_list<std::pair<const ProviderInfo*, const Params*>> from,
                        std::string_view name) {
    for (const auto& [info, values] : from) {
      if (!values || !find_parameter(*info, name)) continue;
      const double value = values->real(name);
      return value > 0 ? value : SegmentLimits::kNone;
    }
    return SegmentLimits::kNone;
  };
  const std::pair<const ProviderInfo*, const Params*> shape{&providers.shape, params.shape.get()},
      law{&providers.law, params.law.get()}, turning{&providers.turning, params.turning.get()};
  SegmentLimits out;
  out.speed = limit({law, shape}, "speed");
  out.acceleration = limit({law, shape}, "acceleration");
  out.jerk = limit({law, shape}, "jerk");
  out.angular_speed = limit({turning, law, shape}, "angular_speed");
  out.angular_acceleration = limit({turning, law, shape}, "angular_acceleration");
  out.angular_jerk = limit({turning, law, shape}, "angular_jerk");
  return out;
}

Result<std::shared_ptr<const Segment>> run_curve(const Registry& registry,
                                                 const SegmentProviders& providers,
                                                 const SegmentParams& params,
                                                 std::span<const Pose> points,
                                                 std::string_view where, SegmentLimits* limits) {
  RMP_TRY_ASSIGN(const auto factory, registry.create<CurveFactory>(providers.shape.name).in(where));
  RMP_TRY_ASSIGN(
      const auto curve,
      checked(guarded(providers.shape.name, [&] { return factory->make(points, *params.shape); }),
              providers.shape, where));
  RMP_TRY(check_duration(curve->end(), providers.shape, where));
  const bool by_own_times = curve->is_timed() && params.is_timed;
  auto walked = by_own_times ? CurveWalk::by_parameter(curve) : CurveWalk::build(curve);
  if (!walked.ok()) return std::move(walked).error().in(where);
  CurveWalk walk = std::move(walked).value();

  RMP_TRY_ASSIGN(const auto turner,
                 registry.create<OrientationFactory>(providers.orientation.name).in(where));
  auto known = walk.knot_shares();
  if (!known.ok()) return std::move(known).error().in(where);
  const std::vector<double> shares = std::move(known).value();
  if (shares.size() != points.size())
    return error(ErrorCode::plugin_failed,
                 "provider \"" + providers.shape.name + "\" gives " +
                     std::to_string(shares.size()) + " knots for " + std::to_string(points.size()) +
                     " points",
                 "Report it to the provider's author.", std::string(where));
  RMP_TRY_ASSIGN(const auto orientation, checked(guarded(providers.orientation.name,
                                                         [&] {
                                                           OrientationTask task;
                                                           task.points = points;
                                                           task.shares = shares;
                                                           task.curve = curve.get();
                                                           return turner->make(task,
                                                                               *params.orientation);
                                                         }),
                                                 providers.orientation, where));

  RMP_TRY(check_turning(walk, *orientation, providers.orientation).in(where));
  const double length = walk.length();
  RMP_TRY_ASSIGN(const double turn, greatest_turn(walk, *orientation).in(where));
  if (limits && !by_own_times) *limits = limits_of(providers, params);
  // A motion to where the tool is: a wait of its duration, or nothing.
  if (!by_own_times && length <= kStandsWithin && turn <= kTurnsWithin) {
    const bool has_duration = find_parameter(providers.law, "duration") != nullptr;
    return std::shared_ptr<const Segment>(std::make_shared<StandingSegment>(
        points.front(), has_duration ? params.law->real("duration") : 0));
  }
  const bool turns_apart = !providers.turning.name.empty() && turn > 0;
  std::shared_ptr<const MotionLaw> law, turning;
  if (turns_apart) {
    RMP_TRY_ASSIGN(turning, run_law(registry, providers.turning, law_task(0, turn), *params.turning,
                                    std::string(where) + ", turning"));
  }
  if (by_own_times) {
    law = std::make_shared<OwnTimes>(curve->end());
  } else if (turns_apart && !(length > 0)) {
    law = turning;
  } else {
    RMP_TRY_ASSIGN(law, run_law(registry, providers.law, law_task(length, turns_apart ? 0 : turn),
                                *params.law, where));
  }
  if (turns_apart) run_together(law, turning);
  return std::shared_ptr<const Segment>(
      std::make_shared<TimedCurve>(std::move(walk), law, orientation, turning, length));
}

}  // namespace

bool SegmentProviders::is_curve() const { return shape.interface_id == CurveFactory::kInterfaceId; }
bool SegmentProviders::is_joint() const {
  return shape.interface_id == JointSegmentFactory::kInterfaceId;
}

const ProviderInfo* SegmentProviders::owner(std::string_view name) const {
  for (const ProviderInfo* info : owners())
    if (find_parameter(*info, name)) return info;
  return nullptr;
}

const ParamSpec* SegmentProviders::parameter(std::string_view name) const {
  const ProviderInfo* info = owner(name);
  return info ? find_parameter(*info, name) : nullptr;
}

Result<SegmentProviders> providers_of(const Registry& registry,
                                      const model::TrajectorySegment& record,
                                      std::string_view where) {
  SegmentProviders out;
  RMP_TRY_ASSIGN(out.shape, find_shape(registry, record.shape.name, where));
  if (!out.is_curve()) {
    for (const auto& [choice, what] : {std::pair(&record.law, "a law"),
                                       {&record.orientation, "an orientation"},
                                       {&record.turning, "a rotation timing law"}})
      if (!choice->name.empty() || !choice->params.empty())
        return bad(
            std::string(what) + " is given, but " + text::quote(out.shape.name) + " has its own",
            "Leave it out; laws and orientations are for curves.", where);
    return out;
  }
  const auto or_default = [](const std::string& name, const char* fallback) {
    return name.empty() ? std::string(fallback) : name;
  };
  RMP_TRY_ASSIGN(
      out.law,
      registry.find(MotionLawFactory::kInterfaceId, or_default(record.law.name, kDefaultLaw))
          .in(where));
  RMP_TRY_ASSIGN(out.orientation,
                 registry
                     .find(OrientationFactory::kInterfaceId,
                           or_default(record.orientation.name, kDefaultOrientation))
                     .in(where));
  if (!record.turning.name.empty()) {
    RMP_TRY_ASSIGN(out.turning,
                   registry.find(MotionLawFactory::kInterfaceId, record.turning.name).in(where));
  }
  return out;
}

Result<SegmentParams> params_of(const SegmentProviders& providers,
                                const model::TrajectorySegment& record, std::string_view where) {
  Map shape, law = values_of(record.law), orientation = values_of(record.orientation);
  for (const auto& [name, value] : record.shape.params) {
    const ProviderInfo* owner = providers.owner(name);
    Map& values = owner == &providers.law           ? law
                  : owner == &providers.orientation ? orientation
                                                    : shape;
    values.set(name, value_of(value));
  }
  SegmentParams out;
  out.is_timed = record.law.name.empty() && law.empty();
  RMP_TRY_ASSIGN(out.shape, checked_values(providers.shape, shape, where));
  if (!providers.is_curve()) return out;
  RMP_TRY_ASSIGN(out.law, checked_values(providers.law, law, where));
  RMP_TRY_ASSIGN(out.orientation, checked_values(providers.orientation, orientation, where));
  if (!providers.turning.name.empty()) {
    // What the turn's own table leaves out is as it is for the way; end speeds are the way's only.
    Map turning = values_of(record.turning);
    for (const auto& [name, value] : law)
      if (name != "start_speed" && name != "end_speed" && !turning.find(name) &&
          find_parameter(providers.turning, name))
        turning.set(name, value);
    RMP_TRY_ASSIGN(out.turning,
                   checked_values(providers.turning, turning, std::string(where) + ", turning"));
  }
  return out;
}

Result<std::shared_ptr<const Segment>> make_segment(const Registry& registry,
                                                    const model::TrajectorySegment& record,
                                                    std::string_view where, SegmentLimits* limits) {
  RMP_TRY_ASSIGN(const SegmentProviders providers, providers_of(registry, record, where));
  if (providers.is_joint())
    return error(ErrorCode::unsupported, text::quote(providers.shape.name) + " moves joints",
                 "It runs on a robot only: see world.inverse_kinematics.", std::string(where));
  if (!record.joints.empty())
    return bad("joint vectors are given, but " + text::quote(providers.shape.name) +
                   " is a shape in space",
               "Give points, or a shape of joint motion such as \"ptp\".", where);
  RMP_TRY_ASSIGN(const SegmentParams params, params_of(providers, record, where));
  std::vector<Pose> points;
  points.reserve(record.points.size());
  for (const auto& p : record.points) points.push_back(model::pose(p));
  if (providers.is_curve()) return run_curve(registry, providers, params, points, where, limits);
  if (limits) *limits = limits_of(providers, params);
  RMP_TRY_ASSIGN(const auto factory,
                 registry.create<SegmentFactory>(providers.shape.name).in(where));
  RMP_TRY_ASSIGN(
      const auto segment,
      checked(guarded(providers.shape.name, [&] { return factory->make(points, *params.shape); }),
              providers.shape, where));
  RMP_TRY(check_duration(segment->duration(), providers.shape, where));
  return segment;
}

std::shared_ptr<const Segment> placed_segment(const Pose& a_T_b,
                                              std::shared_ptr<const Segment> segment) {
  return std::make_shared<PlacedSegment>(a_T_b, std::move(segment));
}

}  // namespace robomosp::motion
