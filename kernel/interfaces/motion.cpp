// SPDX-License-Identifier: Apache-2.0
// Guards of curves, motion laws, orientations and segments: what is made is sampled once when it is
// made (numbers, order, ends, and whether rates are the derivatives), and every answer after that
// is finite or an error that names the provider.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

/// Places that are looked at when something is made.
constexpr std::size_t kProbes = 48;
/// Half the distance of the two samples whose difference is held against the rate, as a share of
/// the whole.
constexpr double kStep = 1e-7;
/// How far a difference may be from the rate, as a share of the greatest rate: what kinks and
/// rounding leave is far below, and a rate in other units or of another parameter far above.
constexpr double kRateSlack = 1e-2;
/// A rate may jump between segments of a law or curve; only where it is wrong at this share of the
/// places it is not the derivative.
constexpr double kMostWrong = 0.25;
constexpr double kShareSlack = 1e-9;

bool finite(double x) { return std::isfinite(x); }
bool finite(const Vec3& v) { return finite(v[0]) && finite(v[1]) && finite(v[2]); }
bool finite(const LawSample& s) {
  return finite(s.share) && finite(s.rate) && finite(s.acceleration) && finite(s.jerk);
}
bool finite(const CurveSample& s) {
  return finite(s.p) && finite(s.d1) && finite(s.d2) && finite(s.d3);
}
double distance(const Vec3& a, const Vec3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}
double norm(const Vec3& a) { return std::hypot(a[0], a[1], a[2]); }

/// Evenly apart within 0..end, clear of the ends and of the places where pieces mostly join.
std::array<double, kProbes> probes(double end) {
  std::array<double, kProbes> at{};
  for (std::size_t i = 0; i < kProbes; ++i)
    at[i] = end * (static_cast<double>(i) + 0.618) / static_cast<double>(kProbes);
  return at;
}

/// Whether differences of a value are its rates at most of the places: `difference(i)` says by how
/// much the two differ at place i, and the size of the difference, `rate(i)` the size of the rate.
/// Differences are known to `noise`, what rounding of the values leaves.
template <class Difference, class Rate>
bool agree(std::size_t count, double noise, Difference&& difference, Rate&& rate) {
  double greatest = 0;
  for (std::size_t i = 0; i < count; ++i) greatest = std::max(greatest, rate(i));
  std::size_t wrong = 0;
  double moved = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [gap, size] = difference(i);
    moved = std::max(moved, size);
    if (!(gap <= kRateSlack * std::max(greatest, size) + noise)) ++wrong;
  }
  // What neither moves nor says that it does agrees.
  return std::max(greatest, moved) < 1e-12 ||
         static_cast<double>(wrong) <= kMostWrong * static_cast<double>(count);
}

/// What rounding of values of this size leaves in a difference over 2 h.
double rounding(double size, double h) { return 1e-14 * (1 + std::fabs(size)) / h; }

/// Base of what a maker made: the provider's name for sentences.
class Made {
 public:
  explicit Made(std::string name) : name_(std::move(name)) {}

 protected:
  [[nodiscard]] Error broken(const std::string& what) const { return broken_answer(name_, what); }
  template <class Call>
  auto call(Call&& what) const -> decltype(what()) {
    return asked(name_, std::forward<Call>(what));
  }
  [[nodiscard]] Error at(const std::string& what, double place, const char* unit) const {
    return broken(what + " at " + text::print_rounded(place) + unit);
  }
  std::string name_;
};

class GuardedLaw final : public MotionLaw, private Made {
 public:
  GuardedLaw(std::string name, std::unique_ptr<MotionLaw> inner)
      : Made(std::move(name)), inner_(std::move(inner)), duration_(inner_->duration()) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  [[nodiscard]] double duration() const override { return duration_; }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    RMP_TRY(call([&] { return inner_->sample(times, out); }));
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (!finite(out[i])) return at("returned a law that is not a number", times[i], " s");
      if (out[i].share < -kShareSlack || out[i].share > 1 + kShareSlack)
        return at("returned a law that leaves its path, to a share of " +
                      text::print_rounded(out[i].share),
                  times[i], " s");
    }
    return {};
  }
  Result<void> check() const {
    if (!(duration_ > 0) || !finite(duration_))
      return broken("made a law without a positive duration");
    const auto inner = probes(duration_);
    const double h = kStep * duration_;
    std::vector<double> times{0};
    for (const double t : inner)
      for (const double side : {-h, 0.0, h}) times.push_back(t + side);
    times.insert(times.end(), {duration_, 1.5 * duration_});
    std::vector<LawSample> s(times.size());
    RMP_TRY(sample(times, s));
    for (std::size_t i = 1; i < s.size(); ++i)
      if (s[i].share < s[i - 1].share - kShareSlack)
        return at("made a law that runs backwards", times[i], " s");
    const LawSample &last = s[s.size() - 2], &beyond = s.back();
    if (std::fabs(s[0].share) > kShareSlack || std::fabs(last.share - 1) > kShareSlack)
      return broken("made a law that runs from a share of " + text::print_rounded(s[0].share) +
                    " to " + text::print_rounded(last.share) + " of its path, not from 0 to 1");
    if (std::fabs(beyond.share - 1) > kShareSlack || beyond.rate != 0)
      return broken("made a law that moves past its end");
    const bool rates = agree(
        kProbes, rounding(1, h),
        [&](std::size_t i) {
          const double d = (s[3 * i + 3].share - s[3 * i + 1].share) / (2 * h);
          return std::pair(std::fabs(d - s[3 * i + 2].rate), std::fabs(d));
        },
        [&](std::size_t i) { return std::fabs(s[3 * i + 2].rate); });
    if (!rates)
      return broken("made a law with a rate that is not the derivative of its path parameter");
    const bool accelerations = agree(
        kProbes, rounding(s[kProbes].rate, h),
        [&](std::size_t i) {
          const double d = (s[3 * i + 3].rate - s[3 * i + 1].rate) / (2 * h);
          return std::pair(std::fabs(d - s[3 * i + 2].acceleration), std::fabs(d));
        },
        [&](std::size_t i) {
          // Accelerations far below what the speed needs over the run are none.
          return std::max(std::fabs(s[3 * i + 2].acceleration),
                          1e-3 * std::fabs(s[3 * i + 2].rate) / duration_);
        });
    if (!accelerations)
      return broken("made a law with an acceleration that is not the derivative of its rate");
    return {};
  }

 private:
  std::unique_ptr<MotionLaw> inner_;
  double duration_;
};

class GuardedCurve final : public Curve, private Made {
 public:
  GuardedCurve(std::string name, std::unique_ptr<Curve> inner)
      : Made(std::move(name)),
        inner_(std::move(inner)),
        end_(inner_->end()),
        knots_(inner_->knots()),
        is_timed_(inner_->is_timed()),
        is_even_(inner_->is_even()) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  [[nodiscard]] double end() const override { return end_; }
  [[nodiscard]] std::vector<double> knots() const override { return knots_; }
  [[nodiscard]] bool is_timed() const override { return is_timed_; }
  [[nodiscard]] bool is_even() const override { return is_even_; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    RMP_TRY(call([&] { return inner_->evaluate(u, out); }));
    for (std::size_t i = 0; i < u.size(); ++i)
      if (!finite(out[i]))
        return at("returned a curve that is not a number", u[i], " of its parameter");
    return {};
  }
  Result<void> check() const {
    if (!(end_ > 0) || !finite(end_)) return broken("made a curve without a positive end");
    double before = 0;
    for (const double k : knots_) {
      if (!(k >= before) || !(k <= end_ * (1 + kShareSlack)))
        return broken("made a curve with knots that do not increase within 0 to its end");
      before = k;
    }
    const double h = kStep * end_;
    std::vector<double> u;
    for (const double x : probes(end_))
      for (const double side : {-h, 0.0, h}) u.push_back(x + side);
    std::vector<CurveSample> s(u.size());
    RMP_TRY(evaluate(u, s));
    const auto differs = [&](const Vec3 CurveSample::*of, const Vec3 CurveSample::*rate) {
      return [&, of, rate](std::size_t i) {
        Vec3 d;
        for (std::size_t k = 0; k < 3; ++k)
          d[k] = ((s[3 * i + 2].*of)[k] - (s[3 * i].*of)[k]) / (2 * h);
        return std::pair(distance(d, s[3 * i + 1].*rate), norm(d));
      };
    };
    if (!agree(kProbes, rounding(norm(s[0].p), h), differs(&CurveSample::p, &CurveSample::d1),
               [&](std::size_t i) { return norm(s[3 * i + 1].d1); }))
      return broken("made a curve with a first derivative that is not that of its points");
    if (!agree(kProbes, rounding(norm(s[0].d1), h), differs(&CurveSample::d1, &CurveSample::d2),
               [&](std::size_t i) {
                 return std::max(norm(s[3 * i + 1].d2), 1e-3 * norm(s[3 * i + 1].d1) / end_);
               }))
      return broken("made a curve with a second derivative that is not that of the first");
    if (is_even_) {
      double least = INFINITY, most = 0;
      for (const CurveSample& c : s) {
        least = std::min(least, norm(c.d1));
        most = std::max(most, norm(c.d1));
      }
      if (most - least > 1e-6 * most)
        return broken("made a curve that claims even speed and does not have it");
    }
    return {};
  }

 private:
  std::unique_ptr<Curve> inner_;
  double end_;
  std::vector<double> knots_;
  bool is_timed_, is_even_;
};

class GuardedOrientation final : public Orientation, private Made {
 public:
  GuardedOrientation(std::string name, std::unique_ptr<Orientation> inner)
      : Made(std::move(name)), inner_(std::move(inner)) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample> along,
                        std::span<OrientationSample> out) const override {
    RMP_TRY(call([&] { return inner_->evaluate(w, along, out); }));
    for (std::size_t i = 0; i < w.size(); ++i) {
      if (!is_rotation_matrix(out[i].R))
        return at("returned an orientation that is not a rotation", w[i], " of the path");
      if (!finite(out[i].turn) || !finite(out[i].bend))
        return at("returned rates of an orientation that are not numbers", w[i], " of the path");
    }
    return {};
  }

 private:
  std::unique_ptr<Orientation> inner_;
};

class GuardedSegment final : public Segment, private Made {
 public:
  GuardedSegment(std::string name, std::unique_ptr<Segment> inner)
      : Made(std::move(name)),
        inner_(std::move(inner)),
        duration_(inner_->duration()),
        length_(inner_->length()) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  [[nodiscard]] double duration() const override { return duration_; }
  [[nodiscard]] double length() const override { return length_; }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    RMP_TRY(call([&] { return inner_->sample(times, out); }));
    for (std::size_t i = 0; i < times.size(); ++i) {
      const PathSample& s = out[i];
      if (!finite(s.pose.p) || !finite(s.velocity) || !finite(s.acceleration) ||
          !finite(s.angular_velocity) || !finite(s.angular_acceleration))
        return at("returned a motion that is not a number", times[i], " s");
      if (!is_rotation_matrix(s.pose.R))
        return at("returned an orientation that is not a rotation", times[i], " s");
    }
    return {};
  }
  Result<void> check() const {
    if (!(duration_ > 0) || !finite(duration_))
      return broken("made a segment without a positive duration");
    if (!(length_ >= 0) || !finite(length_))
      return broken("made a segment with a length that is not a number");
    const double h = kStep * duration_;
    std::vector<double> times{0};
    for (const double t : probes(duration_))
      for (const double side : {-h, 0.0, h}) times.push_back(t + side);
    times.insert(times.end(), {duration_, 1.5 * duration_});
    std::vector<PathSample> s(times.size());
    RMP_TRY(sample(times, s));
    if (distance(s.back().pose.p, s[s.size() - 2].pose.p) > 1e-9 || norm(s.back().velocity) > 0)
      return broken("made a segment that moves past its end");
    if (!agree(
            kProbes, rounding(norm(s[0].pose.p), h),
            [&](std::size_t i) {
              Vec3 d;
              for (std::size_t k = 0; k < 3; ++k)
                d[k] = (s[3 * i + 3].pose.p[k] - s[3 * i + 1].pose.p[k]) / (2 * h);
              return std::pair(distance(d, s[3 * i + 2].velocity), norm(d));
            },
            [&](std::size_t i) { return norm(s[3 * i + 2].velocity); }))
      return broken("made a segment with a velocity that is not the derivative of its position");
    return {};
  }

 private:
  std::unique_ptr<Segment> inner_;
  double duration_, length_;
};

class GuardedJointSegment final : public JointSegment, private Made {
 public:
  GuardedJointSegment(std::string name, std::unique_ptr<JointSegment> inner, std::size_t dof)
      : Made(std::move(name)), inner_(std::move(inner)), dof_(dof), duration_(inner_->duration()) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  [[nodiscard]] double duration() const override { return duration_; }
  Result<void> sample(std::span<const double> times, const JointSamples& out) const override {
    RMP_TRY(call([&] { return inner_->sample(times, out); }));
    for (const std::span<double> table : {out.q, out.qd, out.qdd, out.qddd})
      for (std::size_t i = 0; i < std::min(table.size(), times.size() * dof_); ++i)
        if (!finite(table[i]))
          return at("returned a motion of joint " + std::to_string(i % dof_ + 1) +
                        " that is not a number",
                    times[i / dof_], " s");
    return {};
  }
  Result<void> check() const {
    if (!(duration_ > 0) || !finite(duration_))
      return broken("made a joint motion without a positive duration");
    const double h = kStep * duration_;
    std::vector<double> times;
    for (const double t : probes(duration_))
      for (const double side : {-h, 0.0, h}) times.push_back(t + side);
    std::vector<double> q(times.size() * dof_), qd(q.size());
    RMP_TRY(sample(times, {q, qd, {}, {}}));
    for (std::size_t j = 0; j < dof_; ++j) {
      const auto of = [&](const std::vector<double>& table, std::size_t i) {
        return table[i * dof_ + j];
      };
      if (!agree(
              kProbes, rounding(of(q, 0), h),
              [&](std::size_t i) {
                const double d = (of(q, 3 * i + 2) - of(q, 3 * i)) / (2 * h);
                return std::pair(std::fabs(d - of(qd, 3 * i + 1)), std::fabs(d));
              },
              [&](std::size_t i) { return std::fabs(of(qd, 3 * i + 1)); }))
        return broken("made a joint motion whose velocity of joint " + std::to_string(j + 1) +
                      " is not the derivative of its position");
    }
    return {};
  }

 private:
  std::unique_ptr<JointSegment> inner_;
  std::size_t dof_;
  double duration_;
};

// --- makers --------------------------------------------------------------------------------------

/// Calls a maker, refuses nothing made, puts what is made behind its guard and looks at it.
template <class Guard, class Object, class Call, class... More>
Result<std::unique_ptr<Object>> made_by(const std::string& name, Call&& call, More... more) {
  auto made = asked(name, std::forward<Call>(call));
  if (!made.ok()) return std::move(made).error();
  if (!*made) return broken_answer(name, "made nothing");
  // Constructors ask the object for its duration: that may throw as well.
  return asked(name, [&]() -> Result<std::unique_ptr<Object>> {
    auto guard = std::make_unique<Guard>(name, std::move(*made), more...);
    if constexpr (requires { guard->check(); }) RMP_TRY(guard->check());
    return std::unique_ptr<Object>(std::move(guard));
  });
}

template <class Interface>
class GuardedFactory : public Interface {
 public:
  GuardedFactory(const ProviderInfo& info, Interface* inner) : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }

 protected:
  std::string name_;
  std::unique_ptr<Interface> inner_;
};

class GuardedLawFactory final : public GuardedFactory<MotionLawFactory> {
 public:
  using GuardedFactory::GuardedFactory;
  Result<std::unique_ptr<MotionLaw>> make(const LawTask& t, const Params& p) const override {
    return made_by<GuardedLaw, MotionLaw>(name_, [&] { return inner_->make(t, p); });
  }
};
class GuardedCurveFactory final : public GuardedFactory<CurveFactory> {
 public:
  using GuardedFactory::GuardedFactory;
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& p) const override {
    return made_by<GuardedCurve, Curve>(name_, [&] { return inner_->make(points, p); });
  }
};
class GuardedOrientationFactory final : public GuardedFactory<OrientationFactory> {
 public:
  using GuardedFactory::GuardedFactory;
  Result<std::unique_ptr<Orientation>> make(const OrientationTask& t,
                                            const Params& p) const override {
    return made_by<GuardedOrientation, Orientation>(name_, [&] { return inner_->make(t, p); });
  }
};
class GuardedSegmentFactory final : public GuardedFactory<SegmentFactory> {
 public:
  using GuardedFactory::GuardedFactory;
  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& p) const override {
    return made_by<GuardedSegment, Segment>(name_, [&] { return inner_->make(points, p); });
  }
};
class GuardedJointFactory final : public GuardedFactory<JointSegmentFactory> {
 public:
  using GuardedFactory::GuardedFactory;
  Result<std::unique_ptr<JointSegment>> make(std::size_t dof, std::span<const double> points,
                                             const JointLimits& limits, const JointEnds& ends,
                                             const Params& p) const override {
    return made_by<GuardedJointSegment, JointSegment>(
        name_, [&] { return inner_->make(dof, points, limits, ends, p); }, dof);
  }
};

}  // namespace

RMP_INTERFACES(motion, guarded_interface<MotionLawFactory, GuardedLawFactory>("constant_speed"),
               guarded_interface<CurveFactory, GuardedCurveFactory>(),
               guarded_interface<OrientationFactory, GuardedOrientationFactory>("slerp"),
               guarded_interface<SegmentFactory, GuardedSegmentFactory>(),
               guarded_interface<JointSegmentFactory, GuardedJointFactory>());

}  // namespace robomosp
