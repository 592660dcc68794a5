// SPDX-License-Identifier: Apache-2.0
// Commands of one's own: how much of its torque limits a robot has left when it holds a payload
// still, anywhere within its joint limits, and the greatest payload that it holds everywhere. With
// settings that are saved with the document, and a hook that refuses simulations of robots that
// would not hold what they are meant to carry.
//
// The torques of rest are g(q) + m w(q): those of the robot's own weight, and those of a weight of
// 1 kg at its tool, which pulls with the wrench (gravity, 0). Both are asked of the program's
// inverse dynamics, for many configurations a call.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/host.h>
#include <robomosp/sdk/module.h>
#include <robomosp/sdk/params.h>

namespace {

using namespace robomosp;

/// The solver's parameters are left as they are where none are given.
class NoParams final : public Params {
 public:
  bool has(std::string_view) const override { return false; }
  double real(std::string_view) const override { return 0; }
  long long integer(std::string_view) const override { return 0; }
  bool boolean(std::string_view) const override { return false; }
  std::string_view text(std::string_view) const override { return {}; }
  std::span<const double> reals(std::string_view) const override { return {}; }
  Pose pose(std::string_view) const override { return {}; }
};

/// Number i of the van der Corput sequence of a base: evenly spread in 0..1 for any count.
double spread(std::size_t i, unsigned base) {
  double x = 0, digit = 1;
  for (; i > 0; i /= base) x += static_cast<double>(i % base) * (digit /= base);
  return x;
}
constexpr unsigned kPrimes[] = {2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53};
constexpr std::size_t kBatch = 256;

class PayloadMargin final : public Module {
 public:
  explicit PayloadMargin(const rmp_host* host) : host_(host) {}
  const ModuleTable& table() const override;
  Result<void> before_run(const ModuleRunNotice&, ModuleCall&) const override;

  /// Calls take(q, own, of_one_kg) for `samples` configurations of a robot. What it takes of the
  /// call it takes here: progress, cancellation, the model.
  template <class Take>
  Result<void> hold(const ModuleValue& robot, std::size_t samples, ModuleCall& call,
                    std::shared_ptr<const RobotModel>& model, Take&& take) const {
    RMP_TRY_ASSIGN(model, call.robot_model(robot));
    const std::string where = "robot \"" + model->name + "\"";
    if (!model->is_simple() || !model->loops.empty())
      return error(ErrorCode::unsupported,
                   "it has followers, loops or joints with several coordinates",
                   "Payloads of open chains are studied only.", where);
    if (model->dof() > std::size(kPrimes))
      return error(ErrorCode::unsupported, "it has more than 16 joints", {}, where);
    if (std::none_of(model->joints.begin(), model->joints.end(),
                     [](const JointModel& j) { return std::isfinite(j.max_force); }))
      return error(ErrorCode::unsupported, "none of its joints has a torque limit",
                   "Give its drives limits.", where);
    RMP_TRY_ASSIGN(const auto dynamics, host_.create<InverseDynamics>());
    RMP_TRY(dynamics->prepare(*model, NoParams()));
    const std::size_t n = model->dof();
    std::vector<double> q(kBatch * n), own(kBatch * n), one(kBatch * n),
        scratch(dynamics->scratch_size());
    const TipWrench weight{model->gravity, {}};
    for (std::size_t done = 0; done < samples;) {
      if (call.progress().cancelled())
        return error(ErrorCode::cancelled, "the study was cancelled");
      call.progress().report(static_cast<double>(done) / static_cast<double>(samples),
                             "holding the payload");
      DynamicsBatch batch;
      batch.count = std::min(kBatch, samples - done);
      for (std::size_t i = 0; i < batch.count; ++i)
        for (std::size_t j = 0; j < n; ++j) {
          const JointModel& joint = model->joints[j];
          const double reach = joint.type == JointType::prismatic ? 1.0 : 3.14159265358979323846;
          const double lower = std::isfinite(joint.lower) ? joint.lower : -reach;
          const double upper = std::isfinite(joint.upper) ? joint.upper : reach;
          q[i * n + j] = lower + (upper - lower) * spread(done + i, kPrimes[j]);
        }
      const auto count = batch.count * n;
      batch.q = {q.data(), count};
      batch.scratch = scratch;
      batch.terms = kGravityTerm | kSpringTerm;
      RMP_TRY(dynamics->torques(batch, {own.data(), count}, call.progress()));
      batch.terms = kExternalTerm;
      batch.tip = {&weight, 1};
      RMP_TRY(dynamics->torques(batch, {one.data(), count}, call.progress()));
      for (std::size_t i = 0; i < batch.count; ++i) take(&q[i * n], &own[i * n], &one[i * n]);
      done += batch.count;
    }
    return {};
  }

 private:
  Host host_;
};

Result<std::size_t> samples_of(const ModuleValue& args, ModuleCall& call) {
  if (args.has("samples")) return static_cast<std::size_t>(args["samples"].integer());
  RMP_TRY_ASSIGN(const ModuleValue given, call.setting("samples"));
  return static_cast<std::size_t>(given.integer());
}

Result<ModuleValue> margin(const Module& module, const ModuleValue& args, ModuleCall& call) {
  RMP_TRY_ASSIGN(const std::size_t samples, samples_of(args, call));
  ModuleValue payload = args["payload"];
  if (payload.is_none()) {
    RMP_TRY_ASSIGN(payload, call.setting("payload"));
  }
  const double mass = payload.real();
  double least = std::numeric_limits<double>::infinity();
  std::size_t worst = 0;
  double torque = 0;
  std::vector<double> at;
  std::shared_ptr<const RobotModel> model;
  RMP_TRY(static_cast<const PayloadMargin&>(module).hold(
      args["id"], samples, call, model, [&](const double* q, const double* own, const double* one) {
        for (std::size_t j = 0; j < model->dof(); ++j) {
          const double limit = model->joints[j].max_force, tau = own[j] + mass * one[j];
          if (!std::isfinite(limit) || 1 - std::abs(tau) / limit >= least) continue;
          least = 1 - std::abs(tau) / limit;
          worst = j;
          torque = tau;
          at.assign(q, q + model->dof());
        }
      }));
  if (!std::isfinite(least))
    return error(ErrorCode::unsupported, "its torques cannot be compared with its limits",
                 "Look for masses or limits that are zero or too large.",
                 "robot \"" + model->name + "\"");
  return ModuleValue::map()
      .set("margin", least)
      .set("joint", model->joints[worst].name)
      .set("torque", torque)
      .set("q", at);
}

Result<ModuleValue> greatest(const Module& module, const ModuleValue& args, ModuleCall& call) {
  RMP_TRY_ASSIGN(const std::size_t samples, samples_of(args, call));
  RMP_TRY_ASSIGN(const ModuleValue reserve, call.setting("reserve"));
  double most = std::numeric_limits<double>::infinity();
  std::shared_ptr<const RobotModel> model;
  RMP_TRY(static_cast<const PayloadMargin&>(module).hold(
      args["id"], samples, call, model, [&](const double*, const double* own, const double* one) {
        for (std::size_t j = 0; j < model->dof(); ++j) {
          const double limit = model->joints[j].max_force * (1 - reserve.real());
          if (!std::isfinite(limit)) continue;
          if (std::abs(own[j]) > limit) most = 0;
          else if (one[j] != 0)  // |own + m one| grows beyond the limit where own + m one = +-limit
            most = std::min(most, ((one[j] > 0 ? limit : -limit) - own[j]) / one[j]);
        }
      }));
  if (!std::isfinite(most))
    return error(ErrorCode::unsupported, "no payload loads a joint with a limit",
                 "Give the drives of its other joints limits.", "robot \"" + model->name + "\"");
  return ModuleValue(most);
}

const rmp_param kMargin[] = {
    {"id", "ref:robot", "", "The robot.", nullptr, nullptr, 1, 0},
    {"payload", "real", "kg", "Mass at the first tool; the setting `payload` if omitted.", nullptr,
     nullptr, 0, 1e6, RMP_OPTIONAL},
    {"samples", "int", "", "Configurations; the setting `samples` if omitted.", nullptr, nullptr, 1,
     1e7, RMP_OPTIONAL}};
const rmp_param kMarginResult[] = {
    {"margin", "real", "", "Smallest remaining share of a torque limit; below 0 it cannot hold.",
     nullptr, nullptr, 1, 0},
    {"joint", "string", "", "Joint with that limit.", nullptr, nullptr, 1, 0},
    {"torque", "real", "N m", "Its torque (or force).", nullptr, nullptr, 1, 0},
    {"q", "real[]", "", "The configuration.", nullptr, nullptr, 1, 0}};
const rmp_param kGreatest[] = {kMargin[0], kMargin[2]};

const rmp_param kSettings[] = {
    {"payload", "real", "kg", "Payload that the robots are meant to carry.", "0 kg", nullptr, 0,
     1e6},
    {"reserve", "real", "", "Share of each torque limit to keep in reserve.", "0.1", nullptr, 0, 1},
    {"samples", "int", "", "Number of configurations to check.", "2000", nullptr, 1, 1e7},
    {"guard", "bool", "", "Whether simulations of robots without this reserve are refused.",
     "false", nullptr, 1, 0}};

ModuleCommand margin_command() {
  ModuleCommand c;
  c.name = "robot.payload_margin";
  c.summary = "Reports the torque reserve of a robot at rest with a payload.";
  c.details =
      "The smallest reserve over configurations that are spread evenly over its joint limits.";
  c.example =
      "local left = robot(\"iiwa14\"):payload_margin{payload = 14}\n"
      "assert(left.margin > 0 and left.margin < 1)";
  c.sometimes = "processes";  // with a solver that is compiled first
  c.params = kMargin;
  c.result_type = "map";
  c.result_fields = kMarginResult;
  c.run = &margin;
  return c;
}

ModuleCommand greatest_command() {
  ModuleCommand c;
  c.name = "robot.greatest_payload";
  c.summary = "Returns the greatest payload that a robot can hold at rest in every configuration.";
  c.details = "The setting `reserve` is kept free of each torque limit.";
  c.example = "assert(robot(\"iiwa14\"):greatest_payload() > 0)";
  c.sometimes = "processes";
  c.params = kGreatest;
  c.result_type = "real";
  c.result_unit = "kg";
  c.result_doc = "Mass at the first tool; 0 if the robot cannot even hold itself.";
  c.run = &greatest;
  return c;
}

const ModuleTable& PayloadMargin::table() const {
  static const ModuleCommand commands[] = {margin_command(), greatest_command()};
  static const ModuleTable all = [] {
    ModuleTable t;
    t.commands = commands;
    t.command_count = static_cast<std::uint32_t>(std::size(commands));
    t.settings = kSettings;
    t.runs = kModuleRunSimulation | kModuleRunTask;
    return t;
  }();
  return all;
}

std::string shown(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", v);
  return text;
}

/// The robots of a run: its own, or those of its world.
Result<std::vector<ModuleValue>> robots_of(const ModuleValue& args, ModuleCall& call) {
  const ModuleValue& id = args["id"];
  if (id.kind() == "robot") return std::vector<ModuleValue>{id};
  std::vector<ModuleValue> robots;
  if (id.kind() != "world") return robots;
  RMP_TRY_ASSIGN(const ModuleValue members,
                 call.run("world.robots", ModuleValue::map().set("id", id)));
  for (std::size_t i = 0; i < members.size(); ++i) {
    const ModuleValue& one = members.item(i);
    // Of a run of one robot the others stand still.
    if (args["robot"].text().empty() || args["robot"].text() == one["name"].text())
      robots.push_back(one["robot"]);
  }
  return robots;
}

Result<void> PayloadMargin::before_run(const ModuleRunNotice& run, ModuleCall& call) const {
  RMP_TRY_ASSIGN(const ModuleValue guard, call.setting("guard"));
  if (!guard.boolean()) return {};
  RMP_TRY_ASSIGN(const ModuleValue reserve, call.setting("reserve"));
  RMP_TRY_ASSIGN(const ModuleValue payload, call.setting("payload"));
  RMP_TRY_ASSIGN(const auto robots, robots_of(*run.arguments, call));
  for (const ModuleValue& robot : robots) {
    const auto left = call.run("robot.payload_margin", ModuleValue::map().set("id", robot));
    if (!left.ok() && left.error().code == ErrorCode::unsupported) continue;  // nothing to guard
    if (!left.ok()) return left.error();
    if ((*left)["margin"].real() < reserve.real())
      return error(ErrorCode::conflict,
                   "with " + shown(payload.real()) + " kg at its tool its joint " +
                       (*left)["joint"].text() + " has " + shown(100 * (*left)["margin"].real()) +
                       " % of its torque left somewhere, and " + shown(100 * reserve.real()) +
                       " % are to stay free",
                   "Lower the payload, or set plugin.set(\"payload_margin\", \"guard\", false).");
  }
  return {};
}

}  // namespace

RMP_PLUGIN("org.example.payload_margin", "0.1.0", "Apache-2.0",
           "Payloads of robots, as an example of commands that a plugin adds.",
           RMP_PROVIDER_NO_PARAMS(PayloadMargin, "payload_margin",
                                  "Torque reserve of robots with payloads.", ""))
