// SPDX-License-Identifier: Apache-2.0
#include "crcl.h"

#include <memory>

#include "../brand/brand_writer.h"

namespace robomosp::post::crcl {
namespace {

const PostCapabilities& crcl_capabilities() {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.forms = kPostFlat;
    c.features = kPostMessages | kPostTools | kPostFrames;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose;
    c.blending = PostBlending::accuracy;
    c.speed = PostSpeed::mm_per_s;
    c.max_name = 64;
    c.case_matters = true;
    c.charset = PostCharset::utf8;
    c.extensions = "xml";
    c.title = "CRCL";
    return c;
  }();
  return kAll;
}

class CrclWriter final : public brand::BrandWriter {
 public:
  CrclWriter(const PostTask& t, PostOutput& o, Progress& p)
      : BrandWriter(t, o, crcl_capabilities(), p) {}

 private:
  using Kind = brand::Kind;

  // ---- commands ----
  std::string xml(std::string_view s) {
    std::string out;
    for (const char c : s) {
      const auto u = static_cast<unsigned char>(c);
      if (u < 32 && c != '\t') {
        fail("a message has a character that XML does not allow", "Take it out.");
        return {};
      }
      out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
    }
    return out;
  }
  void element(const std::string& name, const std::string& value) {
    line("<" + name + ">" + value + "</" + name + ">");
  }
  void begin_command(const char* type) {
    open(std::string("<MiddleCommand xsi:type=\"") + type + "\">");
    element("CommandID", std::to_string(++id_));
  }
  void end_command() { close("</MiddleCommand>"); }
  void setting(const char* type, const char* name, const std::string& value) {
    begin_command(type);
    element(name, value);
    end_command();
  }
  void nested(const char* type, const std::string& name, const std::string& value_type,
              const char* field, const std::string& value) {
    begin_command(type);
    open("<" + name + " xsi:type=\"" + value_type + "\">");
    element(field, value);
    close("</" + name + ">");
    end_command();
  }
  void begin() override {
    out_ = &file_;
    for (const char* l : {"<?xml version=\"1.0\" encoding=\"UTF-8\"?>",
                          "<CRCLProgram xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">"})
      file_.add(l);
    file_.in();
    element("Name", routine_name(0));
    open("<InitCanon>");
    element("CommandID", std::to_string(++id_));
    close("</InitCanon>");
    setting("SetLengthUnitsType", "UnitName", "millimeter");
    setting("SetAngleUnitsType", "UnitName", "degree");
    if (!profile_.prologue.empty() || !profile_.epilogue.empty())
      warn("the profile's prologue and epilogue are omitted: CRCL has commands only");
  }
  void routine_begin(std::uint32_t r) override {
    if (r != 0) cannot("procedures, functions or processes");
  }
  void declare(std::uint32_t s, std::uint32_t) override {
    at_ = home(s);
    cannot("variables", "Post the flattened program (form = \"flat\").");
  }
  void routine_end(std::uint32_t) override {}
  void finish() override {
    open("<EndCanon>");
    element("CommandID", std::to_string(++id_));
    close("</EndCanon>");
    close("</CRCLProgram>");
    file_.give(output_, routine_name(0) + ".xml", false);
  }

  // ---- what it has none of ----
  [[nodiscard]] std::span<const Operator> operators() const override { return {}; }
  std::string transform(const Pose&) override { return "pose"; }
  std::string translation(const std::string&, const std::string&, const std::string&) override {
    return "position";
  }
  std::string rotation(std::size_t, const std::string&) override { return "rotation"; }
  Text product(const Text& a, const Text&) override {
    cannot("operator @");
    return a;
  }
  Text inverse_of(const Text& a) override {
    cannot("INV()");
    return a;
  }
  std::string component(const std::string& of, std::size_t) override {
    cannot("parts of poses");
    return of;
  }
  void set_component(const std::string&, std::size_t, const std::string&) override {
    cannot("assignments");
  }
  std::string element(const std::string& n, const std::vector<std::string>&,
                      const std::vector<brand::Bounds>&) override {
    cannot("arrays");
    return n;
  }
  void assign_text(const std::string&, Kind, const std::string&) override { cannot("assignments"); }
  void declare_leaf(const std::string&, Kind, const std::vector<brand::Bounds>&,
                    std::uint32_t) override {}
  void assign(std::uint32_t, std::uint32_t) override { cannot("assignments"); }
  void call(std::uint32_t, std::span<const std::uint32_t>) override { cannot("calls"); }
  Text call_function(std::uint32_t, std::span<const std::uint32_t>) override {
    cannot("functions");
    return {};
  }
  Text variable(std::uint32_t) override {
    cannot("variables");
    return {};
  }
  Text string_literal(std::string_view s) override { return {std::string(s)}; }

  // ---- statements ----
  void wait_time(std::uint32_t seconds) override {
    const auto k = known(seconds);
    if (!k) cannot("computed times");
    else setting("DwellType", "DwellTime", number(*k, 6));
  }
  void halt() override {
    begin_command("StopMotionType");
    element("StopCondition", "Normal");
    end_command();
    warn("commands after HALT remain in the file: CRCL ends only with its last command");
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    std::string all;
    for (const std::uint32_t v : values) {
      if (expression(v).constant == RMP_NONE) {
        cannot("messages with computed values", "Post the flattened program (form = \"flat\").");
        return;
      }
      all += text(v);
    }
    setting("MessageType", "Message", xml(all));
  }
  /// A signal that is switched is a parameter of the robot, by its name.
  void set_output(const Signal& s, std::uint32_t value) override {
    const auto k = known(value);
    if (!k) {
      cannot("computed outputs", "Post the flattened program (form = \"flat\").");
      return;
    }
    if (s.kind == "gripper" && s.type == RMP_TYPE_BOOL) {
      setting("SetEndEffectorType", "Setting", ((*k != 0) != s.inverted) ? "1.0" : "0.0");
      return;
    }
    begin_command("SetRobotParametersType");
    open("<ParameterSetting>");
    element("ParameterName",
            xml(s.target.empty() ? "output " + std::to_string(s.number) : s.target));
    element("ParameterValue", s.type == RMP_TYPE_BOOL
                                  ? (((*k != 0) != s.inverted) ? "true" : "false")
                              : s.type == RMP_TYPE_INT ? trimmed(*k, 0)
                                                       : trimmed(*k, 9, 1));
    close("</ParameterSetting>");
    end_command();
    if (!told_)
      note("outputs are posted as robot parameters, which the robot interprets",
           "In the profile, target is the parameter's name; kind = \"gripper\" makes one a "
           "gripper's.");
    told_ = true;
  }

  // ---- motions ----
  bool has_speed_ori() const override { return true; }
  void circle(const Motion&) override {
    cannot("circles", "Post it as chords: a PATH or LIN motions.");
  }
  void pose(const Pose& p) {
    const auto three = [&](const char* name, const char* words, double a, double b, double c,
                           int digits) {
      open(std::string("<") + name + ">");
      const double v[3] = {a, b, c};
      for (std::size_t i = 0; i < 3; ++i) element(std::string(1, words[i]), number(v[i], digits));
      close(std::string("</") + name + ">");
    };
    three("Point", "XYZ", p.p[0] * 1000, p.p[1] * 1000, p.p[2] * 1000,
          std::max(profile_.length_digits, 3));
    three("XAxis", "IJK", p.R[0], p.R[3], p.R[6], 9);
    three("ZAxis", "IJK", p.R[2], p.R[5], p.R[8], 9);
  }
  void write_move(const Motion& m, const brand::Move& x) override {
    if (m.until != RMP_NONE || x.incremental || x.goals.size() != 1) {
      cannot(m.until != RMP_NONE ? "motions that end early (UNTIL)" : "increments",
             "Post the flattened program (form = \"flat\").");
      return;
    }
    const brand::Goal& g = x.goals[0];
    if ((!g.pose && !g.is_joints) || !x.speed.known || !x.speed_ori.known || !x.acc.known ||
        !x.blend.known || !x.tool.text.empty() || !x.frame.text.empty()) {
      cannot("computed motions", "Post the flattened program (form = \"flat\").");
      return;
    }
    // The controlled point is the tool's; poses are in the workstation.
    const Pose tool = x.tool.pose.value_or(Pose{});
    if (tools_.changes(tool_text(tool)) && !is_identity(tool))
      note("CRCL has no command for a tool: set its tip as the robot's controlled point");
    if (g.is_joints) {
      joints(g, x);
      return;
    }
    const Pose all = post::product(x.frame.pose.value_or(Pose{}), *g.pose);
    if (x.is_ptp) {
      const std::string v = number(*x.speed.known / 100, 6);
      if (speed_.changes("%" + v))
        nested("SetTransSpeedType", "TransSpeed", "TransSpeedRelativeType", "Fraction", v);
    } else {
      const std::string v = number(*x.speed.known, std::max(profile_.speed_digits, 3));
      if (speed_.changes(v))
        nested("SetTransSpeedType", "TransSpeed", "TransSpeedAbsoluteType", "Setting", v);
      const std::string w = number(*x.speed_ori.known, std::max(profile_.speed_digits, 3));
      if (rotation_.changes(w))
        nested("SetRotSpeedType", "RotSpeed", "RotSpeedAbsoluteType", "Setting", w);
    }
    const std::string a = number(*x.acc.known / 100, 6);
    if (acc_.changes(a))
      nested("SetTransAccelType", "TransAccel", "TransAccelRelativeType", "Fraction", a);
    const double mm = x.passes ? *blend_mm(x).known : number_option("tolerance", 0.1);
    const std::string t = number(std::max(mm, 1e-3), 3);
    if (tolerance_.changes(t)) {
      begin_command("SetEndPoseToleranceType");
      open("<Tolerance>");
      for (const char* n : {"XPointTolerance", "YPointTolerance", "ZPointTolerance"}) element(n, t);
      close("</Tolerance>");
      end_command();
    }
    begin_command("MoveToType");
    element("MoveStraight", x.is_ptp ? "false" : "true");
    open("<EndPosition>");
    pose(all);
    close("</EndPosition>");
    end_command();
  }
  static std::string tool_text(const Pose& p) {
    std::string out;
    for (const double v : p.p) out += with_unit_digits(v) + " ";
    for (const double v : p.R) out += with_unit_digits(v) + " ";
    return out;
  }
  void joints(const brand::Goal& g, const brand::Move& x) {
    // Speeds of joints are degrees/s; the share of the greatest needs the robot's.
    begin_command("ActuateJointsType");
    for (std::size_t i = 0; i < g.axes.size(); ++i) {
      open("<ActuateJoint>");
      element("JointNumber", std::to_string(i + 1));
      element("JointPosition", number(g.axes[i], std::max(profile_.angle_digits, 4)));
      open("<JointDetails xsi:type=\"JointSpeedAccelType\">");
      if (task_.robot && i < task_.robot->joints.size() &&
          std::isfinite(task_.robot->joints[i].max_velocity) &&
          task_.robot->joints[i].max_velocity > 0)
        element("JointSpeed",
                number(task_.robot->joints[i].max_velocity * *x.speed.known / 100 *
                           (task_.robot->joints[i].type == JointType::prismatic ? 1000 : kDegree),
                       4));
      else if (*x.speed.known != 100 && i == 0)
        warn("SPEED_PTP is left to the robot, since its joint speed limits are unknown",
             "Name a robot with joint speed limits.");
      close("</JointDetails>");
      close("</ActuateJoint>");
    }
    end_command();
  }

  File file_{2};
  Modal<std::string> speed_, rotation_, acc_, tolerance_, tools_;
  std::size_t id_ = 0;
  bool told_ = false;
};

}  // namespace

const PostCapabilities& Crcl::capabilities() const { return crcl_capabilities(); }

Result<void> Crcl::write(const PostTask& task, const Params&, PostOutput& output,
                         Progress& progress) const {
  return CrclWriter(task, output, progress).run();
}

}  // namespace robomosp::post::crcl
