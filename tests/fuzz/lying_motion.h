// SPDX-License-Identifier: Apache-2.0
// Lying providers of curves, laws, orientations and segments.
#pragma once

#include <memory>
#include <vector>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/trajectory.h>

#include "fuzz/lying_solvers.h"

namespace robomosp::test {

/// What a maker made, to be passed on.
template <class Made>
class LyingMade : public Made {
 public:
  explicit LyingMade(std::unique_ptr<Made> inner) : inner_(std::move(inner)) {}

 protected:
  std::unique_ptr<Made> inner_;
};

inline double duration_of(const std::string& who, double honest) {
  return liar().value<double>(
      who, [&] { return honest; },
      {{"no number", Seen::surely, [](double& t) { t = liar().no_number(); }},
       {"not positive", Seen::surely, [](double& t) { t = liar().pick(2) ? 0 : -t; }},
       {"a wild one", Seen::maybe, [](double& t) { t = 1e300; }},
       {"twice as long", Seen::maybe, [](double& t) { t *= 2; }}});
}
template <class Sample>
Lie<Nothing> spoiled_sample(std::span<Sample> out, const char* what, Seen seen,
                            std::function<void(Sample&)> spoil) {
  return {what, seen, [out, spoil](Nothing&) {
            if (!out.empty()) spoil(out[liar().pick(out.size())]);
          }};
}
template <class Sample>
Lie<Nothing> unfilled_samples(std::span<Sample> out, Seen seen) {
  return {"nothing filled in", seen, [out](Nothing&) {
            for (Sample& s : out) s = {};
          }};
}
/// Makes what the inner one makes, and passes it on wrapped; or makes nothing.
template <class Wrapped, class Made, class Call>
Result<std::unique_ptr<Made>> made_lying(const std::string& who, Call&& honest) {
  return liar().answer<std::unique_ptr<Made>>(
      who, nullptr,
      [&]() -> Result<std::unique_ptr<Made>> {
        RMP_TRY_ASSIGN(auto made, honest());
        return std::unique_ptr<Made>(std::make_unique<Wrapped>(std::move(made)));
      },
      {{"made nothing", Seen::surely, [](std::unique_ptr<Made>& m) { m.reset(); }}});
}

class LyingLaw final : public LyingMade<MotionLaw> {
 public:
  using LyingMade::LyingMade;
  double duration() const override { return duration_of("law.duration", inner_->duration()); }
  Result<void> sample(std::span<const double> t, std::span<LawSample> out) const override {
    return liar().fill(
        "law.sample", nullptr, [&] { return inner_->sample(t, out); },
        {spoiled_sample<LawSample>(
             out, "no number", Seen::surely,
             [](LawSample& s) {
               double* const all[] = {&s.share, &s.rate, &s.acceleration, &s.jerk};
               *all[liar().pick(4)] = liar().no_number();
             }),
         spoiled_sample<LawSample>(out, "off its path", Seen::surely,
                                   [](LawSample& s) { s.share = liar().pick(2) ? -0.5 : 1.5; }),
         spoiled_sample<LawSample>(out, "a wild rate", Seen::maybe,
                                   [](LawSample& s) { s.rate = liar().wild(); }),
         unfilled_samples(out, Seen::maybe)});
  }
};
class LyingLawFactory final : public Lying<MotionLawFactory> {
 public:
  using Lying::Lying;
  Result<std::unique_ptr<MotionLaw>> make(const LawTask& t, const Params& p) const override {
    return made_lying<LyingLaw, MotionLaw>("law.make", [&] { return inner_->make(t, p); });
  }
};

class LyingCurve final : public LyingMade<Curve> {
 public:
  using LyingMade::LyingMade;
  double end() const override { return duration_of("curve.end", inner_->end()); }
  std::vector<double> knots() const override {
    using Knots = std::vector<double>;
    return liar().value<Knots>(
        "curve.knots", [&] { return inner_->knots(); },
        {{"none", Seen::maybe, [](Knots& k) { k.clear(); }},
         {"too many", Seen::maybe, [](Knots& k) { k.insert(k.begin(), 1'000'000, 0.0); }},
         {"falling", Seen::surely,
          [](Knots& k) {
            k = {0.7, 0.1};
          }},
         {"no number", Seen::surely, [](Knots& k) { k.assign(2, liar().no_number()); }},
         {"beyond the end", Seen::surely, [](Knots& k) {
            k = {0, 1e300};
          }}});
  }
  bool is_timed() const override {
    return liar().value<bool>("curve.is_timed", [&] { return inner_->is_timed(); },
                              {{"the other", Seen::maybe, [](bool& b) { b = !b; }}});
  }
  bool is_even() const override {
    return liar().value<bool>("curve.is_even", [&] { return inner_->is_even(); },
                              {{"the other", Seen::maybe, [](bool& b) { b = !b; }}});
  }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    return liar().fill(
        "curve.evaluate", nullptr, [&] { return inner_->evaluate(u, out); },
        {spoiled_sample<CurveSample>(out, "no number", Seen::surely,
                                     [](CurveSample& s) {
                                       Vec3* const all[] = {&s.p, &s.d1, &s.d2, &s.d3};
                                       (*all[liar().pick(4)])[liar().pick(3)] = liar().no_number();
                                     }),
         spoiled_sample<CurveSample>(out, "a wild place", Seen::maybe,
                                     [](CurveSample& s) { s.p[1] = liar().wild(); }),
         unfilled_samples(out, Seen::maybe)});
  }
};
class LyingCurveFactory final : public Lying<CurveFactory> {
 public:
  using Lying::Lying;
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& p) const override {
    return made_lying<LyingCurve, Curve>("curve.make", [&] { return inner_->make(points, p); });
  }
};

class LyingOrientation final : public LyingMade<Orientation> {
 public:
  using LyingMade::LyingMade;
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample> along,
                        std::span<OrientationSample> out) const override {
    using S = OrientationSample;
    return liar().fill(
        "orientation.evaluate", nullptr, [&] { return inner_->evaluate(w, along, out); },
        {spoiled_sample<S>(out, "no rotation", Seen::surely,
                           [](S& s) { s.R[liar().pick(9)] += 0.3; }),
         spoiled_sample<S>(out, "a mirror", Seen::surely,
                           [](S& s) {
                             for (std::size_t i : {0U, 3U, 6U}) s.R[i] = -s.R[i];
                           }),
         spoiled_sample<S>(out, "all zeros", Seen::surely, [](S& s) { s.R.fill(0); }),
         spoiled_sample<S>(
             out, "no number", Seen::surely,
             [](S& s) { (liar().pick(2) ? s.turn : s.bend)[1] = liar().no_number(); }),
         spoiled_sample<S>(out, "a wild turn", Seen::maybe, [](S& s) { s.turn[0] = 1e300; }),
         unfilled_samples(out, Seen::maybe)});
  }
};
class LyingOrientationFactory final : public Lying<OrientationFactory> {
 public:
  using Lying::Lying;
  Result<std::unique_ptr<Orientation>> make(const OrientationTask& t,
                                            const Params& p) const override {
    return made_lying<LyingOrientation, Orientation>("orientation.make",
                                                     [&] { return inner_->make(t, p); });
  }
};

/// A straight segment of one second, as no plugin of the program brings any.
class StraightSegment final : public Segment {
 public:
  StraightSegment(const Pose& a, const Pose& b) : a_(a), b_(b) {}
  double duration() const override { return duration_of("segment.duration", 1); }
  double length() const override {
    const double honest = std::hypot(b_.p[0] - a_.p[0], b_.p[1] - a_.p[1], b_.p[2] - a_.p[2]);
    return liar().value<double>(
        "segment.length", [&] { return honest; },
        {{"no number", Seen::surely, [](double& x) { x = liar().no_number(); }},
         {"negative", Seen::surely, [](double& x) { x = -1; }},
         {"a wild one", Seen::maybe, [](double& x) { x = 1e300; }}});
  }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    using S = PathSample;
    return liar().fill(
        "segment.sample", nullptr,
        [&]() -> Result<void> {
          for (std::size_t i = 0; i < times.size(); ++i) {
            const double x = std::min(1.0, std::max(0.0, times[i]));
            out[i] = {};
            out[i].pose = a_;
            for (std::size_t k = 0; k < 3; ++k) {
              const double d = b_.p[k] - a_.p[k];
              out[i].pose.p[k] += x * x * (3 - 2 * x) * d;
              if (x <= 0 || x >= 1) continue;
              out[i].velocity[k] = 6 * x * (1 - x) * d;
              out[i].acceleration[k] = (6 - 12 * x) * d;
            }
          }
          return {};
        },
        {spoiled_sample<S>(out, "no number", Seen::surely,
                           [](S& s) {
                             Vec3* const all[] = {&s.pose.p, &s.velocity, &s.angular_velocity,
                                                  &s.acceleration, &s.angular_acceleration};
                             (*all[liar().pick(5)])[liar().pick(3)] = liar().no_number();
                           }),
         spoiled_sample<S>(out, "no rotation", Seen::surely,
                           [](S& s) { s.pose.R[liar().pick(9)] += 0.3; }),
         spoiled_sample<S>(out, "a wild place", Seen::maybe,
                           [](S& s) { s.pose.p[0] = liar().wild(); }),
         unfilled_samples(out, Seen::maybe)});
  }

 private:
  Pose a_, b_;
};
class LyingSegmentFactory final : public SegmentFactory {
 public:
  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params&) const override {
    return liar().answer<std::unique_ptr<Segment>>(
        "segment.make", nullptr,
        [&]() -> Result<std::unique_ptr<Segment>> {
          if (points.size() != 2)
            return error(ErrorCode::invalid_argument, "a straight segment has two points");
          return std::unique_ptr<Segment>(std::make_unique<StraightSegment>(points[0], points[1]));
        },
        {{"made nothing", Seen::surely, [](std::unique_ptr<Segment>& m) { m.reset(); }}});
  }
};

class LyingJointSegment final : public LyingMade<JointSegment> {
 public:
  using LyingMade::LyingMade;
  double duration() const override {
    return duration_of("joint_segment.duration", inner_->duration());
  }
  Result<void> sample(std::span<const double> t, const JointSamples& out) const override {
    const std::span<double> all[] = {out.q, out.qd, out.qdd, out.qddd};
    std::vector<std::span<double>> wanted;
    for (const std::span<double> x : all)
      if (!x.empty()) wanted.push_back(x);
    return liar().fill(
        "joint_segment.sample", nullptr, [&] { return inner_->sample(t, out); },
        about_numbers(wanted.empty() ? std::span<double>() : wanted[liar().pick(wanted.size())]));
  }
};
class LyingJointFactory final : public Lying<JointSegmentFactory> {
 public:
  using Lying::Lying;
  Result<std::unique_ptr<JointSegment>> make(std::size_t dof, std::span<const double> points,
                                             const JointLimits& limits, const JointEnds& ends,
                                             const Params& p) const override {
    return made_lying<LyingJointSegment, JointSegment>(
        "joint_segment.make", [&] { return inner_->make(dof, points, limits, ends, p); });
  }
};

}  // namespace robomosp::test
