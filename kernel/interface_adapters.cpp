// SPDX-License-Identifier: Apache-2.0
// The interfaces /1 of curves, motion laws, orientations and segments as they were: what samples
// returned nothing and could not fail, tasks had no size, and there were no extensions. Their
// classes are kept here, so that what was built against them runs; tests/abi/frozen has the headers
// that plugins saw.
#include "kernel/interface_adapters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/render.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/plugin_loader.h"
#include "kernel/renderer_v1.h"

namespace robomosp {
namespace v1 {

class Curve {
 public:
  virtual ~Curve() = default;
  [[nodiscard]] virtual double end() const = 0;
  virtual void evaluate(std::span<const double> u, std::span<CurveSample> out) const = 0;
  [[nodiscard]] virtual std::vector<double> knots() const = 0;
  [[nodiscard]] virtual bool is_timed() const { return false; }
  [[nodiscard]] virtual bool is_even() const { return false; }
};
class CurveFactory {
 public:
  virtual ~CurveFactory() = default;
  virtual Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                              const Params&) const = 0;
};

struct LawTask {
  double length = 0, turn = 0;
};
class MotionLaw {
 public:
  virtual ~MotionLaw() = default;
  [[nodiscard]] virtual double duration() const = 0;
  virtual void sample(std::span<const double> times, std::span<LawSample> out) const = 0;
};
class MotionLawFactory {
 public:
  virtual ~MotionLawFactory() = default;
  virtual Result<std::unique_ptr<MotionLaw>> make(const LawTask&, const Params&) const = 0;
};

struct OrientationTask {
  std::span<const Pose> points;
  std::span<const double> shares;
  const Curve* curve = nullptr;
};
class Orientation {
 public:
  virtual ~Orientation() = default;
  virtual void evaluate(std::span<const double> w, std::span<const CurveSample> along,
                        std::span<OrientationSample> out) const = 0;
};
class OrientationFactory {
 public:
  virtual ~OrientationFactory() = default;
  virtual Result<std::unique_ptr<Orientation>> make(const OrientationTask&,
                                                    const Params&) const = 0;
};

class Segment {
 public:
  virtual ~Segment() = default;
  [[nodiscard]] virtual double duration() const = 0;
  [[nodiscard]] virtual double length() const = 0;
  virtual void sample(std::span<const double> times, std::span<PathSample> out) const = 0;
};
class SegmentFactory {
 public:
  virtual ~SegmentFactory() = default;
  virtual Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                                const Params&) const = 0;
};

struct JointLimits {
  std::span<const double> lower, upper, velocity, acceleration, jerk;
};
struct JointEnds {
  std::span<const double> start_velocity, end_velocity, start_acceleration, end_acceleration;
};
class JointSegment {
 public:
  virtual ~JointSegment() = default;
  [[nodiscard]] virtual double duration() const = 0;
  virtual void sample(std::span<const double> times, const JointSamples& out) const = 0;
};
class JointSegmentFactory {
 public:
  virtual ~JointSegmentFactory() = default;
  virtual Result<std::unique_ptr<JointSegment>> make(std::size_t dof,
                                                     std::span<const double> points,
                                                     const JointLimits&, const JointEnds&,
                                                     const Params&) const = 0;
};

}  // namespace v1

namespace {

/// What an older factory made, as an object of today.
template <class Object, class Adapter, class Old>
Result<std::unique_ptr<Object>> as_now(Result<std::unique_ptr<Old>> made) {
  if (!made.ok()) return std::move(made).error();
  if (!*made) return std::unique_ptr<Object>();
  return std::unique_ptr<Object>(std::make_unique<Adapter>(std::move(*made)));
}

class CurveNow final : public Curve {
 public:
  explicit CurveNow(std::unique_ptr<v1::Curve> old) : old_(std::move(old)) {}
  [[nodiscard]] double end() const override { return old_->end(); }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    old_->evaluate(u, out);
    return {};
  }
  [[nodiscard]] std::vector<double> knots() const override { return old_->knots(); }
  [[nodiscard]] bool is_timed() const override { return old_->is_timed(); }
  [[nodiscard]] bool is_even() const override { return old_->is_even(); }

 private:
  std::unique_ptr<v1::Curve> old_;
};
class CurveFactoryNow final : public CurveFactory {
 public:
  explicit CurveFactoryNow(v1::CurveFactory* old) : old_(old) {}
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points,
                                      const Params& p) const override {
    return as_now<Curve, CurveNow>(old_->make(points, p));
  }

 private:
  std::unique_ptr<v1::CurveFactory> old_;
};

class LawNow final : public MotionLaw {
 public:
  explicit LawNow(std::unique_ptr<v1::MotionLaw> old) : old_(std::move(old)) {}
  [[nodiscard]] double duration() const override { return old_->duration(); }
  Result<void> sample(std::span<const double> times, std::span<LawSample> out) const override {
    old_->sample(times, out);
    return {};
  }

 private:
  std::unique_ptr<v1::MotionLaw> old_;
};
class LawFactoryNow final : public MotionLawFactory {
 public:
  explicit LawFactoryNow(v1::MotionLawFactory* old) : old_(old) {}
  Result<std::unique_ptr<MotionLaw>> make(const LawTask& t, const Params& p) const override {
    return as_now<MotionLaw, LawNow>(old_->make({t.length, t.turn}, p));
  }

 private:
  std::unique_ptr<v1::MotionLawFactory> old_;
};

/// A curve of today as an older orientation sees it. It is borrowed for the call only.
class CurveThen final : public v1::Curve {
 public:
  explicit CurveThen(const robomosp::Curve& now) : now_(now) {}
  [[nodiscard]] double end() const override { return now_.end(); }
  void evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    // It has no word for a failure: what has no value is no number, which its user refuses.
    if (now_.evaluate(u, out).ok()) return;
    for (CurveSample& s : out.first(std::min(u.size(), out.size()))) s.p.fill(std::nan(""));
  }
  [[nodiscard]] std::vector<double> knots() const override { return now_.knots(); }
  [[nodiscard]] bool is_timed() const override { return now_.is_timed(); }
  [[nodiscard]] bool is_even() const override { return now_.is_even(); }

 private:
  const robomosp::Curve& now_;
};
class OrientationNow final : public Orientation {
 public:
  explicit OrientationNow(std::unique_ptr<v1::Orientation> old) : old_(std::move(old)) {}
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample> along,
                        std::span<OrientationSample> out) const override {
    old_->evaluate(w, along, out);
    return {};
  }

 private:
  std::unique_ptr<v1::Orientation> old_;
};
class OrientationFactoryNow final : public OrientationFactory {
 public:
  explicit OrientationFactoryNow(v1::OrientationFactory* old) : old_(old) {}
  Result<std::unique_ptr<Orientation>> make(const OrientationTask& t,
                                            const Params& p) const override {
    if (!t.curve) return as_now<Orientation, OrientationNow>(old_->make({t.points, t.shares}, p));
    const CurveThen curve(*t.curve);
    return as_now<Orientation, OrientationNow>(old_->make({t.points, t.shares, &curve}, p));
  }

 private:
  std::unique_ptr<v1::OrientationFactory> old_;
};

class SegmentNow final : public Segment {
 public:
  explicit SegmentNow(std::unique_ptr<v1::Segment> old) : old_(std::move(old)) {}
  [[nodiscard]] double duration() const override { return old_->duration(); }
  [[nodiscard]] double length() const override { return old_->length(); }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    old_->sample(times, out);
    return {};
  }

 private:
  std::unique_ptr<v1::Segment> old_;
};
class SegmentFactoryNow final : public SegmentFactory {
 public:
  explicit SegmentFactoryNow(v1::SegmentFactory* old) : old_(old) {}
  Result<std::unique_ptr<Segment>> make(std::span<const Pose> points,
                                        const Params& p) const override {
    return as_now<Segment, SegmentNow>(old_->make(points, p));
  }

 private:
  std::unique_ptr<v1::SegmentFactory> old_;
};

class JointSegmentNow final : public JointSegment {
 public:
  explicit JointSegmentNow(std::unique_ptr<v1::JointSegment> old) : old_(std::move(old)) {}
  [[nodiscard]] double duration() const override { return old_->duration(); }
  Result<void> sample(std::span<const double> times, const JointSamples& out) const override {
    old_->sample(times, out);
    return {};
  }

 private:
  std::unique_ptr<v1::JointSegment> old_;
};
class JointSegmentFactoryNow final : public JointSegmentFactory {
 public:
  explicit JointSegmentFactoryNow(v1::JointSegmentFactory* old) : old_(old) {}
  Result<std::unique_ptr<JointSegment>> make(std::size_t dof, std::span<const double> points,
                                             const JointLimits& l, const JointEnds& e,
                                             const Params& p) const override {
    const v1::JointLimits limits{l.lower, l.upper, l.velocity, l.acceleration, l.jerk};
    const v1::JointEnds ends{e.start_velocity, e.end_velocity, e.start_acceleration,
                             e.end_acceleration};
    return as_now<JointSegment, JointSegmentNow>(old_->make(dof, points, limits, ends, p));
  }

 private:
  std::unique_ptr<v1::JointSegmentFactory> old_;
};

template <class Now, class Adapter, class Old>
void* adapt(void* made) {
  return static_cast<Now*>(new Adapter(static_cast<Old*>(made)));
}

struct Older {
  std::string_view id;
  const char* now;
  void* (*adapt)(void*);
};
constexpr std::array kOlder{
    Older{"robomosp.curve/1", CurveFactory::kInterfaceId,
          &adapt<CurveFactory, CurveFactoryNow, v1::CurveFactory>},
    Older{"robomosp.motion_law/1", MotionLawFactory::kInterfaceId,
          &adapt<MotionLawFactory, LawFactoryNow, v1::MotionLawFactory>},
    Older{"robomosp.orientation/1", OrientationFactory::kInterfaceId,
          &adapt<OrientationFactory, OrientationFactoryNow, v1::OrientationFactory>},
    Older{"robomosp.segment/1", SegmentFactory::kInterfaceId,
          &adapt<SegmentFactory, SegmentFactoryNow, v1::SegmentFactory>},
    Older{"robomosp.joint_segment/1", JointSegmentFactory::kInterfaceId,
          &adapt<JointSegmentFactory, JointSegmentFactoryNow, v1::JointSegmentFactory>},
    Older{"robomosp.renderer/1", render::Renderer::kInterfaceId, &renderer_of_1},
};

}  // namespace

std::string current_interface(std::string_view interface_id) {
  for (const Older& older : kOlder)
    if (older.id == interface_id) return older.now;
  for (const std::string& known : known_interfaces())
    if (known == interface_id) return known;
  return {};
}

void* adapted(std::string_view interface_id, void* made) {
  for (const Older& older : kOlder)
    if (older.id == interface_id) return older.adapt(made);
  return made;
}

}  // namespace robomosp
