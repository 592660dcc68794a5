// SPDX-License-Identifier: Apache-2.0
// A plugin as one in the field: compiled against the headers of frozen/, in which tables and
// structs are shorter and curves, laws, orientations and segments have the interface number before.
#include <cmath>
#include <cstdio>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/render.h>
#include <robomosp/sdk/trajectory.h>

namespace {

using namespace robomosp;

/// Inverse kinematics of one revolute joint about the base's z: the angle of the target's place.
class OneJoint final : public IkSolver {
 public:
  explicit OneJoint(const rmp_host* host) {
    if (host->struct_size < sizeof(rmp_host)) return;
    host->log(1, "older", "an older solver was made");
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    if (model.joints.size() != 1)
      return error(ErrorCode::unsupported,
                   "it has " + std::to_string(model.joints.size()) + " joints");
    model_ = &model;
    offset_ = params.real("offset");
    return {};
  }
  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (progress.cancelled()) return error(ErrorCode::cancelled, "stopped");
      const Vec3& p = batch.targets[i].p;
      results[i].status = IkStatus::solved;
      results[i].q = {std::atan2(p[1], p[0]) + offset_ + model_->joints[0].placement.p[0]};
      results[i].detail = "older";
    }
    return {};
  }

 private:
  const RobotModel* model_ = nullptr;
  double offset_ = 0;
};

/// p = (u, u^2, 0) for u in 0..1.
class Parabola final : public Curve {
 public:
  double end() const override { return 1; }
  void evaluate(std::span<const double> u, std::span<CurveSample> out) const override {
    for (std::size_t i = 0; i < u.size(); ++i)
      out[i] = {{u[i], u[i] * u[i], 0}, {1, 2 * u[i], 0}, {0, 2, 0}, {}};
  }
  std::vector<double> knots() const override { return {0, 1}; }
};
class ParabolaMaker final : public CurveMaker {
 public:
  Result<std::unique_ptr<Curve>> make(std::span<const Pose> points, const Params&) const override {
    if (points.size() != 2) return error(ErrorCode::invalid_argument, "a parabola has two points");
    return std::unique_ptr<Curve>(std::make_unique<Parabola>());
  }
};

/// x^2 (3 - 2 x) of the time, one second a metre.
class CubicLaw final : public MotionLaw {
 public:
  explicit CubicLaw(double duration) : duration_(duration) {}
  double duration() const override { return duration_; }
  void sample(std::span<const double> times, std::span<LawSample> out) const override {
    for (std::size_t i = 0; i < times.size(); ++i) {
      const double x = std::fmin(std::fmax(times[i] / duration_, 0), 1), T = duration_;
      const bool moves = times[i] >= 0 && times[i] <= T;
      out[i] = {x * x * (3 - 2 * x), moves ? 6 * x * (1 - x) / T : 0,
                moves ? (6 - 12 * x) / (T * T) : 0, moves ? -12 / (T * T * T) : 0};
    }
  }

 private:
  double duration_;
};
class CubicLawMaker final : public MotionLawMaker {
 public:
  Result<std::unique_ptr<MotionLaw>> make(const LawTask& task, const Params&) const override {
    return std::unique_ptr<MotionLaw>(std::make_unique<CubicLaw>(task.length + task.turn));
  }
};

/// Turns about z by one radian over the way; asks the curve once, as older ones may.
class Turning final : public Orientation {
 public:
  void evaluate(std::span<const double> w, std::span<const CurveSample>,
                std::span<OrientationSample> out) const override {
    for (std::size_t i = 0; i < w.size(); ++i) {
      const double c = std::cos(w[i]), s = std::sin(w[i]);
      out[i] = {{c, -s, 0, s, c, 0, 0, 0, 1}, {0, 0, 1}, {}};
    }
  }
};
class TurningMaker final : public OrientationMaker {
 public:
  Result<std::unique_ptr<Orientation>> make(const OrientationTask& task,
                                            const Params&) const override {
    CurveSample s;
    const double u = task.curve->end();
    task.curve->evaluate({&u, 1}, {&s, 1});
    if (!std::isfinite(s.p[0]) || task.points.size() != task.shares.size())
      return error(ErrorCode::invalid_argument, "the curve cannot be asked");
    return std::unique_ptr<Orientation>(std::make_unique<Turning>());
  }
};

/// Two seconds along x at constant speed.
class Run final : public Segment {
 public:
  double duration() const override { return 2; }
  double length() const override { return 1; }
  void sample(std::span<const double> times, std::span<PathSample> out) const override {
    for (std::size_t i = 0; i < times.size(); ++i) {
      out[i] = {};
      out[i].pose.p[0] = std::fmin(std::fmax(times[i] / 2, 0), 1);
      if (times[i] >= 0 && times[i] <= 2) out[i].velocity[0] = 0.5;
    }
  }
};
class RunMaker final : public SegmentMaker {
 public:
  Result<std::unique_ptr<Segment>> make(std::span<const Pose>, const Params&) const override {
    return std::unique_ptr<Segment>(std::make_unique<Run>());
  }
};

/// All joints by half the limit of their velocity for one second.
class Drive final : public JointSegment {
 public:
  explicit Drive(std::vector<double> speed) : speed_(std::move(speed)) {}
  double duration() const override { return 1; }
  void sample(std::span<const double> times, const JointSamples& out) const override {
    for (std::size_t i = 0; i < times.size(); ++i)
      for (std::size_t j = 0; j < speed_.size(); ++j) {
        const std::size_t k = i * speed_.size() + j;
        if (!out.q.empty()) out.q[k] = speed_[j] * times[i];
        if (!out.qd.empty()) out.qd[k] = speed_[j];
        if (!out.qdd.empty()) out.qdd[k] = 0;
      }
  }

 private:
  std::vector<double> speed_;
};
class DriveMaker final : public JointSegmentMaker {
 public:
  Result<std::unique_ptr<JointSegment>> make(std::size_t dof, std::span<const double>,
                                             const JointLimits& limits, const JointEnds& ends,
                                             const Params&) const override {
    std::vector<double> speed;
    for (std::size_t j = 0; j < dof; ++j) speed.push_back(limits.velocity[j] / 2);
    if (!ends.start_velocity.empty())
      return error(ErrorCode::unsupported, "it starts at half its speed");
    return std::unique_ptr<JointSegment>(std::make_unique<Drive>(std::move(speed)));
  }
};

/// A picture of one row that says what it was given.
class Counter final : public render::Renderer {
 public:
  Result<render::Image> draw(const render::Scene& s, const render::Options& o,
                             Progress&) const override {
    if (o.look.caption == "fail") return error(ErrorCode::unsupported, "it draws no failures");
    render::Image image;
    image.width = o.width;
    image.height = o.height;
    for (const std::size_t n : {s.items.size(), s.lines.size(), s.triads.size(), s.marks.size(),
                                s.labels.size(), s.legends.size(), s.lights.size()})
      image.rgba.push_back(static_cast<std::uint8_t>(n));
    image.height = o.height;
    image.rgba.resize(4U * static_cast<unsigned>(o.width) * static_cast<unsigned>(o.height));
    image.clip_T_world[0] = s.items.back().pose.p[2] + s.lines.back().width;
    image.clip_T_world[1] = s.triads.back().length + s.marks.back().gyration[1];
    image.clip_T_world[2] = s.labels.back().place[0] + s.legends.back().ticks.back().share;
    image.clip_T_world[3] = s.lights.back().angle + o.look.camera.zoom;
    image.clip_T_world[4] = o.look.section->point[0] + (o.quality == render::Quality::high ? 1 : 0);
    return image;
  }
  Result<std::string> png(const render::Image& image) const override {
    return "\x89PNG\r\n\x1a\n" + std::to_string(image.width);
  }
};

void* make_one_joint(const rmp_host* host, char*, std::uint32_t) {
  return static_cast<IkSolver*>(new OneJoint(host));
}

const rmp_param kParams[] = {
    {"offset", "real", "rad", "Added to every angle.", "90 deg", nullptr, -4, 4},
    {"word", "enum", "", "One of two.", "one", "one|two", 1, 0},
};

}  // namespace

RMP_PLUGIN("org.example.older", "0.9", "MIT", "Built some time ago",
           rmp_provider{IkSolver::kInterfaceId, "one_joint", "One joint.", "serial,dof=1", kParams,
                        2, sizeof(rmp_param), &make_one_joint},
           RMP_PROVIDER_NO_PARAMS(ParabolaMaker, "older_parabola", "A parabola.", ""),
           RMP_PROVIDER_NO_PARAMS(CubicLawMaker, "older_cubic", "A cubic law.", ""),
           RMP_PROVIDER_NO_PARAMS(TurningMaker, "older_turning", "One radian.", ""),
           RMP_PROVIDER_NO_PARAMS(RunMaker, "older_run", "A run.", ""),
           RMP_PROVIDER_NO_PARAMS(DriveMaker, "older_drive", "A drive.", ""),
           RMP_PROVIDER_NO_PARAMS(Counter, "older_counter", "Counts.", ""))
