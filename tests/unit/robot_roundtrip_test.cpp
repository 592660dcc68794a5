// SPDX-License-Identifier: Apache-2.0
// Every shipped robot, and one with every kind of joint, out as URDF and in again: poses of all
// links, masses, torques and limits stay. The two models are compared in the world's frame, joint
// by joint by their names; a ball joint's three angles are turned into its quaternion and angular
// velocity by formulas written out here.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/io.h>

#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/kinematics.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "support/library_robots.h"
#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

constexpr double kPoses = 1e-12, kDynamics = 1e-10;

struct Side {
  const model::Robot* robot = nullptr;
  std::shared_ptr<const RobotModel> model;
  std::vector<std::int32_t> link_of;  ///< of every joint

  std::vector<Pose> joint_frames(const std::vector<double>& q) const {
    std::vector<Pose> frames(model->joints.size());
    robotics::forward_kinematics(*model, q, frames);
    for (Pose& t : frames) t = spatial::compose(model->base, t);
    return frames;
  }
  /// The world's poses of the links by name.
  std::map<std::string, Pose> links(const std::vector<Pose>& joints) const {
    std::vector<Pose> poses(robot->links.size());
    const auto at = robotics::link_frames(*robot);
    std::map<std::string, Pose> out;
    for (std::size_t i = 0; i < at.size(); ++i)
      out[robot->links[i].name] = spatial::compose(
          at[i].joint < 0 ? model->base : joints[static_cast<std::size_t>(at[i].joint)],
          at[i].joint_T_link);
    return out;
  }
};

class RobotRoundTrip : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-urdf-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Side side(const std::string& name) {
    Side s;
    const auto snapshot = app().document.now();
    const AnyId id = snapshot->find(Kind::robot, name).value_or(AnyId{});
    s.robot = snapshot->get(RobotId{id.number});
    NoProgress progress;
    auto made =
        app().derived.robot_model(*snapshot, RobotId{id.number}, {0.3, -0.2, -9.7}, progress);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
    if (made.ok()) s.model = *made;
    if (s.robot) s.link_of = robotics::moving_links(*s.robot);
    return s;
  }

  /// Writes the robot and reads it as `back`; the report.
  std::string there_and_back(const std::string& name, bool bodies = false) {
    const std::string file = (folder_ / (name + ".urdf")).string();
    const Value out = call("robot.export_urdf", {{"id", name}, {"file", file}, {"bodies", bodies}});
    std::string notes;
    if (const List* list = at(out, "notes").as_list())
      for (const Value& n : *list) notes += n.text() + "\n";
    std::ifstream in(file);
    xml_.assign(std::istreambuf_iterator<char>(in), {});
    call("import", {{"file", file}, {"name", "back"}});
    return notes;
  }

  /// Link that the URDF's joint of this name moves.
  std::string child_of(const std::string& joint) const {
    const auto between = [&](std::size_t from, const std::string& before) {
      const auto a = xml_.find(before, from) + before.size();
      return xml_.substr(a, xml_.find('"', a) - a);
    };
    const auto start = xml_.find("<joint name=\"" + joint + "\"");
    if (start == std::string::npos) return {};
    return between(start, "<child link=\"");
  }

  void compare(const Side& a, const Side& b, unsigned seed);
  std::vector<double> torques(const Side& s, const std::vector<double>& q,
                              const std::vector<double>& qd, const std::vector<double>& qdd) {
    auto solver = app().registry.create<InverseDynamics>("newton_euler");
    EXPECT_TRUE(solver.ok());
    const auto params = make_params({});
    EXPECT_TRUE((*solver)->prepare(*s.model, *params).ok());
    std::vector<double> scratch((*solver)->scratch_size()), tau(s.model->dof());
    DynamicsBatch batch;
    batch.count = 1;
    batch.q = q;
    batch.qd = qd;
    batch.qdd = qdd;
    batch.scratch = scratch;
    NoProgress progress;
    EXPECT_TRUE((*solver)->torques(batch, tau, progress).ok());
    return tau;
  }

  fs::path folder_;
  std::string xml_;
};

void expect_close(const Pose& a, const Pose& b, double tolerance, const std::string& what) {
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(std::isfinite(a.p[i]) && std::isfinite(b.p[i])) << what;
    EXPECT_NEAR(a.p[i], b.p[i], tolerance) << what;
  }
  for (std::size_t i = 0; i < 9; ++i) {
    ASSERT_TRUE(std::isfinite(a.R[i]) && std::isfinite(b.R[i])) << what;
    EXPECT_NEAR(a.R[i], b.R[i], tolerance) << what;
  }
}
/// Relative to the greater of 1 and the value.
void expect_close(double a, double b, double tolerance, const std::string& what) {
  ASSERT_TRUE(std::isfinite(a) && std::isfinite(b)) << what;
  EXPECT_NEAR(a, b, tolerance * std::max(1.0, std::fabs(a))) << what;
}
void expect_close(const MassProperties& a, const MassProperties& b, const std::string& what) {
  const auto x = spatial::inertial_parameters(a), y = spatial::inertial_parameters(b);
  for (std::size_t i = 0; i < x.size(); ++i)
    expect_close(x[i], y[i], kDynamics, what + " inertial parameter " + std::to_string(i));
}

void RobotRoundTrip::compare(const Side& a, const Side& b, unsigned seed) {
  ASSERT_TRUE(a.model && b.model);
  std::map<std::string, std::size_t> joint_on;  // of b, by the link it moves
  for (std::size_t j = 0; j < b.model->joints.size(); ++j)
    joint_on[b.robot->links[static_cast<std::size_t>(b.link_of[j])].name] = j;
  // Which joint of b stands for a's; of a ball joint the last of the three.
  std::vector<std::size_t> stands(a.model->joints.size());
  for (std::size_t j = 0; j < stands.size(); ++j) {
    const JointModel& m = a.model->joints[j];
    const std::string child = child_of(m.name);
    ASSERT_TRUE(joint_on.contains(child)) << m.name << " moves \"" << child << "\"";
    stands[j] = joint_on[child];
    const JointModel& w = b.model->joints[stands[j]];
    SCOPED_TRACE(m.name);
    EXPECT_EQ(m.passive, w.passive);
    if (m.type == JointType::spherical) continue;
    EXPECT_EQ(m.type, w.type);
    EXPECT_EQ(m.lower, w.lower);
    EXPECT_EQ(m.upper, w.upper);
    EXPECT_EQ(m.max_velocity, w.max_velocity);
    EXPECT_EQ(m.max_acceleration, w.max_acceleration);
    EXPECT_EQ(m.max_jerk, w.max_jerk);
    EXPECT_EQ(m.max_force, w.max_force);
    EXPECT_EQ(m.is_coupled(), w.is_coupled());
    if (m.is_coupled() && w.is_coupled()) {
      EXPECT_EQ(stands[static_cast<std::size_t>(m.coupling.of)],
                static_cast<std::size_t>(w.coupling.of));
      EXPECT_EQ(m.coupling.ratio, w.coupling.ratio);
      EXPECT_EQ(m.coupling.offset, w.coupling.offset);
    }
  }
  std::mt19937 random(seed);
  const auto any = [&] { return static_cast<double>(random()) / 4294967296.0 * 2 - 1; };
  for (int sample = 0; sample < 5; ++sample) {
    std::vector<double> q(a.model->coordinate_count()), qd(a.model->dof()), qdd(a.model->dof());
    std::vector<double> p(b.model->coordinate_count()), pd(b.model->dof()), pdd(b.model->dof());
    for (double& v : qd) v = any();
    for (double& v : qdd) v = 2 * any();
    struct Ball {
      std::size_t v = 0, w = 0;      ///< where they stand in a's qd and in b's
      std::array<double, 9> rate{};  ///< angular velocity = rate * the angles' rates
    };
    std::vector<Ball> balls;
    for (std::size_t j = 0; j < stands.size(); ++j) {
      const JointModel &m = a.model->joints[j], &w = b.model->joints[stands[j]];
      if (m.is_coupled()) continue;
      const auto qi = static_cast<std::size_t>(m.q_index), vi = static_cast<std::size_t>(m.v_index),
                 pi = static_cast<std::size_t>(w.q_index), wi = static_cast<std::size_t>(w.v_index);
      if (m.type == JointType::spherical) {
        // R = Rz(u) Ry(v) Rx(w); the body's angular velocity is w' x + Rx^T (v' y + Ry^T u' z).
        const double angles[] = {3 * any(), 1.2 * any(), 3 * any()};
        const double rates[] = {any(), any(), any()}, second[] = {any(), any(), any()};
        const auto half = [](double t, std::size_t axis) {
          std::array<double, 4> h{std::cos(t / 2), 0, 0, 0};
          h[axis] = std::sin(t / 2);
          return h;
        };
        const auto times = [](const std::array<double, 4>& x, const std::array<double, 4>& y) {
          return std::array<double, 4>{x[0] * y[0] - x[1] * y[1] - x[2] * y[2] - x[3] * y[3],
                                       x[0] * y[1] + x[1] * y[0] + x[2] * y[3] - x[3] * y[2],
                                       x[0] * y[2] - x[1] * y[3] + x[2] * y[0] + x[3] * y[1],
                                       x[0] * y[3] + x[1] * y[2] - x[2] * y[1] + x[3] * y[0]};
        };
        const auto quaternion =
            times(half(angles[0], 3), times(half(angles[1], 2), half(angles[2], 1)));
        std::copy(quaternion.begin(), quaternion.end(), q.begin() + static_cast<long>(qi));
        const double sv = std::sin(angles[1]), cv = std::cos(angles[1]), sw = std::sin(angles[2]),
                     cw = std::cos(angles[2]);
        Ball ball{vi, wi - 2, {-sv, 0, 1, cv * sw, cw, 0, cv * cw, -sw, 0}};
        const double dv = rates[1], dw = rates[2];
        const double change[9] = {
            -cv * dv, 0, 0, -sv * dv * sw + cv * cw * dw, -sw * dw, 0, -sv * dv * cw - cv * sw * dw,
            -cw * dw, 0};
        for (std::size_t r = 0; r < 3; ++r) {
          qd[vi + r] = qdd[vi + r] = 0;
          for (std::size_t c = 0; c < 3; ++c) {
            qd[vi + r] += ball.rate[3 * r + c] * rates[c];
            qdd[vi + r] += ball.rate[3 * r + c] * second[c] + change[3 * r + c] * rates[c];
            p[pi - 2 + c] = angles[c];
            pd[ball.w + c] = rates[c];
            pdd[ball.w + c] = second[c];
          }
        }
        balls.push_back(ball);
        continue;
      }
      const auto coordinates = static_cast<std::size_t>(coordinate_count(m.type));
      double length = 0;
      for (std::size_t k = 0; k < coordinates; ++k) {
        q[qi + k] = any() + (coordinates == 7 && k == 3 ? 2 : 0);
        if (k >= 3) length = std::hypot(length, q[qi + k]);
      }
      for (std::size_t k = 0; k < coordinates; ++k) {
        if (k >= 3) q[qi + k] /= length;
        p[pi + k] = q[qi + k];
      }
      for (std::size_t k = 0; k < static_cast<std::size_t>(velocity_count(m.type)); ++k) {
        pd[wi + k] = qd[vi + k];
        pdd[wi + k] = qdd[vi + k];
      }
    }
    const auto frames_a = a.joint_frames(q), frames_b = b.joint_frames(p);
    const auto links_a = a.links(frames_a), links_b = b.links(frames_b);
    for (const auto& [name, pose] : links_a) {
      ASSERT_TRUE(links_b.contains(name)) << name;
      expect_close(pose, links_b.at(name), kPoses, name);
    }
    for (std::size_t j = 0; j < stands.size(); ++j) {
      const std::string& name = a.model->joints[j].name;
      const Pose &x = frames_a[j], &y = frames_b[stands[j]];
      // Frames are on the joints' axes: the origin may be elsewhere along it, and x and y are of
      // no meaning. Of a ball joint that is the last of three axes, so that the centre counts.
      if (a.model->joints[j].type == JointType::free) {
        expect_close(x, y, kPoses, name);
      } else if (a.model->joints[j].type == JointType::spherical) {
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(x.p[k], y.p[k], kPoses) << name;
      } else {
        const Vec3 z{x.R[2], x.R[5], x.R[8]}, gap = spatial::sub(y.p, x.p);
        const Vec3 across = spatial::sub(gap, spatial::scale(z, spatial::dot(z, gap)));
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_NEAR(y.R[3 * k + 2], z[k], kPoses) << name;
          if (a.model->joints[j].type == JointType::revolute) {
            EXPECT_NEAR(across[k], 0, kPoses) << name;
          }
        }
      }
      expect_close(spatial::in_frame(a.model->joints[j].body, x),
                   spatial::in_frame(b.model->joints[stands[j]].body, y), name);
    }
    // Torques of the ball joints belong to other rates: tau_angles = rate^T tau.
    std::vector<double> tau = torques(a, q, qd, qdd), back = torques(b, p, pd, pdd);
    for (std::size_t j = 0; j < stands.size(); ++j) {
      const JointModel &m = a.model->joints[j], &w = b.model->joints[stands[j]];
      if (m.is_coupled() || m.type == JointType::spherical) continue;
      for (std::int32_t k = 0; k < velocity_count(m.type); ++k)
        expect_close(tau[static_cast<std::size_t>(m.v_index + k)],
                     back[static_cast<std::size_t>(w.v_index + k)], kDynamics, m.name + " torque");
    }
    for (const Ball& ball : balls)
      for (std::size_t c = 0; c < 3; ++c) {
        double expected = 0;
        for (std::size_t r = 0; r < 3; ++r) expected += ball.rate[3 * r + c] * tau[ball.v + r];
        expect_close(expected, back[ball.w + c], kDynamics, "torque of a ball joint");
      }
  }
}

TEST_F(RobotRoundTrip, EveryShippedRobotComesBackAsItWent) {
  const std::vector<std::string> names = test::library_robots();
  ASSERT_GE(names.size(), 22U);
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    app().document.clear();
    call("robot.load", {{"file", "robots/" + name + ".rbt"}});
    const std::string notes = there_and_back(name);
    const Side a = side(name), b = side("back");
    ASSERT_TRUE(a.robot && b.robot);
    compare(a, b, 7);
    // The whole robot as it stands, with its base and what is fixed to that.
    const Value here = call("robot.mass", {{"id", name}});
    const Value back = call("robot.mass", {{"id", std::string("back")}});
    for (const char* what : {"mass", "standing"})
      expect_close(at(here, what).number(), at(back, what).number(), kDynamics, what);
    for (const char* what : {"com", "inertia"}) {
      const auto& x = at(here, what).as_array()->data();
      const auto& y = at(back, what).as_array()->data();
      ASSERT_EQ(x.size(), y.size()) << what;
      for (std::size_t i = 0; i < x.size(); ++i) expect_close(x[i], y[i], kDynamics, what);
    }
    // What URDF cannot say is said.
    const auto told = [&](const char* what) {
      EXPECT_NE(notes.find(what), std::string::npos) << what << " in\n" << notes;
    };
    for (const model::LoopClosure& l : a.robot->loops) told(("\"" + l.name + "\"").c_str());
    if (!a.robot->loops.empty()) told("no closed loops");
    if (!a.robot->poses.empty()) told("Named poses");
    for (const JointModel& m : a.model->joints) {
      if (m.armature != 0) told("Motor inertia");
      if (m.spring.stiffness != 0) told("A spring");
      if (m.passive) told("absence of a motor");
      if (std::isfinite(m.max_acceleration)) told("acceleration or jerk");
      if (m.friction.coulomb_negative != -m.friction.coulomb_positive) told("differs by direction");
    }
  }
}

/// A chain with every kind of joint, each off its link's axis by a row or an origin.
TEST_F(RobotRoundTrip, EveryKindOfJointComesBackAsSingleOnes) {
  const std::string file = (folder_ / "zoo.rbt").string();
  std::ofstream(file) << R"(robomosp robot 1
name zoo
convention dh
base { at (0.1, 0.2, 0.3)  rpy (0.4, -0.3, 0.2) }
link ship {
  joint free
  origin { at (0.5, 0, 0.2)  rpy (0.3, 0.1, -0.2) }
  passive true
  given { mass 5  com (0.1, 0, 0)  inertia (1, 2, 3, 0.1, 0.2, 0.3) }
}
link shoulder {
  joint spherical
  row { a 0.3  alpha 20 deg  d 0.2  theta 10 deg }
  passive true
  given { mass 2  com (0, 0.1, 0.2)  inertia (0.2, 0.3, 0.4, 0.01, 0, 0.02) }
}
link crossing {
  joint universal
  row { a 0.1  alpha -30 deg  d 0.4  theta 5 deg }
  limits (-2, 2)
  given { mass 1  com (0.1, 0, 0)  inertia (0.1, 0.1, 0.1, 0, 0, 0) }
}
link quill {
  joint cylindrical
  origin { at (0.2, 0, 0.1)  rpy (0, 0.5, 0) }
  axis (0, 1, 0)
  given { mass 1.5  com (0, 0.3, 0)  inertia (0.2, 0.1, 0.2, 0, 0, 0) }
}
link plate {
  parent ship
  joint planar
  origin { at (0, 0.3, 0) }
  given { mass 0.5  com (0, 0, 0.1)  inertia (0.02, 0.02, 0.02, 0, 0, 0) }
}
link ball {
  parent plate
  joint spherical
  origin { at (0, 0, 0.2)  rpy (0, 0, 0.3) }
  given { mass 0.3  com (0, 0.1, 0)  inertia (0.01, 0.02, 0.03, 0, 0, 0) }
}
link wheel {
  parent plate
  origin { at (0.1, 0, 0) }
  axis (0, 1, 0)
  max_jerk 9
  drive { motor_inertia 0.001  gear_ratio 10  viscous 0.01  coulomb (0.1, -0.2) }
  spring { stiffness 3  rest 0.2 }
  given { mass 0.2  com (0, 0, 0.1)  inertia (0.01, 0.01, 0.01, 0, 0, 0) }
}
link fellow {
  parent ship
  joint prismatic
  origin { at (0, 0, 0.4) }
  axis (0, 0.6, 0.8)
  mimic { link wheel  ratio -0.3  offset 0.05 }
  given { mass 0.4  com (0, 0.1, 0)  inertia (0.01, 0.01, 0.01, 0, 0, 0) }
}
link lid {
  joint fixed
  origin { at (0, 0, 0.1) }
  given { mass 0.7  com (0, 0, 0.1)  inertia (0.01, 0.01, 0.01, 0, 0, 0) }
}
)";
  call("robot.load", {{"file", file}});
  const std::string notes = there_and_back("zoo");
  const Side a = side("zoo"), b = side("back");
  ASSERT_TRUE(a.robot && b.robot);
  compare(a, b, 11);
  EXPECT_EQ(b.model->dof(), a.model->dof());
  for (const char* what : {"no ball joint", "\"shoulder\" and \"ball\"", "sequences of joints",
                           "\"crossing\", \"quill\" and \"plate\"", "\"mounting\"",
                           "absence of a motor", "1 fixed link"})
    EXPECT_NE(notes.find(what), std::string::npos) << what << " in\n" << notes;
}

TEST_F(RobotRoundTrip, BodiesComeBackWhereTheyWere) {
  call("robot.load", {{"file", "robots/gripper.rbt"}});
  there_and_back("gripper", true);
  const Side a = side("gripper"), b = side("back");
  ASSERT_TRUE(a.robot && b.robot);
  compare(a, b, 3);
  std::size_t parts = 0;
  for (const model::Link& l : b.robot->links) parts += l.parts.size();
  EXPECT_GE(parts, 4U);
  // A message names every file that was read.
  std::string read;
  for (const Message& m : app().messages.recent())
    if (m.code == "import_files") read = m.text;
  EXPECT_NE(read.find("files were read: "), std::string::npos) << read;
  EXPECT_NE(read.find("/gripper.urdf\""), std::string::npos) << read;
  std::size_t named = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    if (entry.is_regular_file() && entry.path().extension() != ".urdf") {
      ++named;
      EXPECT_NE(read.find(entry.path().filename().string()), std::string::npos)
          << entry.path() << " is not in " << read;
    }
  EXPECT_GE(named, 4U);
}

/// An exporter of whole robots as a third party writes one: two files.
class Skeleton final : public Exporter {
 public:
  std::string_view extensions() const override { return "skeleton"; }
  bool is_exact(std::string_view) const override { return false; }
  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params&,
                                          Progress&) const override {
    std::string main, bodies;
    for (const ExportRobot& r : task.robots) {
      main += "robot " + r.name + "\n";
      for (const JointModel& j : r.model->joints)
        main += "joint " + j.name + " on " + std::to_string(j.parent) + "\n";
    }
    // Whose link an item is, by the nearest of its parents that stands for one.
    for (std::size_t i = 0; i < task.items.size(); ++i) {
      if (!task.items[i].mesh) continue;
      for (auto at = static_cast<std::int32_t>(i); at >= 0;) {
        const ExportItem& item = task.items[static_cast<std::size_t>(at)];
        if (const auto part = robot_part(item)) {
          bodies += std::to_string(part->robot) + " " + std::to_string(part->joint) + " " +
                    item.name + "\n";
          break;
        }
        at = item.parent;
      }
    }
    return std::vector<ExportedFile>{{std::string(task.name), main}, {"parts/bodies.txt", bodies}};
  }
};

TEST_F(RobotRoundTrip, AnExporterOfOthersSeesTheWholeRobotAndWhoseBodiesAreWhat) {
  ProviderInfo info;
  info.interface_id = Exporter::kInterfaceId;
  info.name = "skeleton";
  ASSERT_TRUE(app()
                  .registry
                  .add(info,
                       []() -> Result<void*> {
                         return static_cast<void*>(static_cast<Exporter*>(new Skeleton));
                       })
                  .ok());
  call("robot.load", {{"file", "robots/gripper.rbt"}});
  const fs::path file = folder_ / "gripper.skeleton";
  call("export", {{"what", "gripper"}, {"file", file.string()}});
  app().registry.remove(Exporter::kInterfaceId, "skeleton");
  const Side a = side("gripper");
  std::ifstream main(file), bodies(folder_ / "parts/bodies.txt");
  ASSERT_TRUE(main && bodies) << "two files";
  std::string line;
  ASSERT_TRUE(std::getline(main, line));
  EXPECT_EQ(line, "robot gripper");
  std::size_t joints = 0;
  while (std::getline(main, line)) ++joints;
  EXPECT_EQ(joints, a.model->joints.size());
  const auto frames = robotics::link_frames(*a.robot);
  std::size_t count = 0;
  int robot = -1, joint = -2;
  for (std::string name; bodies >> robot >> joint && std::getline(bodies >> std::ws, name);) {
    ++count;
    EXPECT_EQ(robot, 0);
    std::int32_t expected = -1;
    for (std::size_t i = 0; i < frames.size(); ++i)
      if (a.robot->links[i].name == name) expected = frames[i].joint;
    EXPECT_EQ(joint, expected) << name;
  }
  EXPECT_GE(count, 4U);
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_F(RobotRoundTrip, ExportWritesUrdfAsTheRobotsOwnCommandDoes) {
  call("robot.load", {{"file", "robots/gripper.rbt"}});
  fs::create_directories(folder_ / "a");
  fs::create_directories(folder_ / "b");
  const std::string a = (folder_ / "a" / "g.urdf").string(),
                    b = (folder_ / "b" / "g.urdf").string();
  const Value own = call("robot.export_urdf", {{"id", "gripper"}, {"file", a}, {"package", "p"}});
  const Value general =
      call("export", {{"what", "gripper"}, {"file", b}, {"options", Map{{"package", "p"}}}});
  EXPECT_FALSE(bytes_of(a).empty());
  EXPECT_EQ(bytes_of(a), bytes_of(b));
  EXPECT_EQ(at(own, "notes"), at(general, "notes"));
  EXPECT_EQ(at(own, "meshes").as_list()->size(), at(general, "others").as_list()->size());
  for (const Value& mesh : *at(own, "meshes").as_list())
    EXPECT_GT(bytes_of(*mesh.as_string()).size(), 84U) << mesh.text();
}

TEST_F(RobotRoundTrip, BodiesThatAreNotWantedAreNotMade) {
  call("robot.create", {{"name", "bare"}, {"links", List{Map{{"name", "one"}, {"a", 1}}}}});
  const Value with = call(
      "export", {{"what", "bare"}, {"file", (folder_ / "with.urdf").string()}, {"chord", 1e-3}});
  EXPECT_GT(at(with, "parts").number(), 0);
  EXPECT_NE(at(with, "notes").text().find("The chord does not hold"), std::string::npos)
      << at(with, "notes").text();
  const Value without = call("export", {{"what", "bare"},
                                        {"file", (folder_ / "without.urdf").string()},
                                        {"options", Map{{"bodies", false}}}});
  EXPECT_EQ(at(without, "parts").number(), 0);
  EXPECT_TRUE(at(without, "others").as_list()->empty());
}

TEST_F(RobotRoundTrip, AUrdfFileHoldsOneRobotAndSaysWhatItLeavesOut) {
  const std::string file = (folder_ / "w.urdf").string();
  call("robot.load", {{"file", "robots/gripper.rbt"}});
  call("solid.create",
       {{"name", "block"}, {"root", Map{{"kind", "box"}, {"x", 1}, {"y", 1}, {"z", 1}}}});
  call("world.create", {{"name", "cell"}});
  EXPECT_NE(fails("export", {{"what", "block"}, {"file", file}})
                .message.find("contains one robot, but here are 0"),
            std::string::npos);
  call("world.add_robot", {{"id", "cell"}, {"robot", "gripper"}});
  call("world.add_object", {{"id", "cell"}, {"what", "block"}, {"name", "table"}});
  const Value out = call("export", {{"what", "cell"}, {"file", file}});
  EXPECT_NE(at(out, "notes").text().find("1 part that is no part of the robot"), std::string::npos)
      << at(out, "notes").text();
  call("world.add_robot", {{"id", "cell"}, {"robot", "gripper"}, {"name", "second"}});
  EXPECT_NE(fails("export", {{"what", "cell"}, {"file", file}}).message.find("here are 2"),
            std::string::npos);
}

}  // namespace
}  // namespace robomosp
