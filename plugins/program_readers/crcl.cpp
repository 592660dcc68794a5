// SPDX-License-Identifier: Apache-2.0
// CRCL, the Canonical Robot Command Language of NIST: a CRCLProgram in .xml.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

constexpr int kDeepestElement = 64;
constexpr std::size_t kMostElements = 2'000'000;
constexpr std::size_t kLongestName = 100;  ///< none that CRCL knows is as long

/// An element of XML, without its namespaces.
struct XmlElement {
  std::string name, type, text;  ///< type = xsi:type
  std::vector<XmlElement> children;
  At at;
  [[nodiscard]] const XmlElement* child(std::string_view called) const {
    for (const XmlElement& c : children)
      if (c.name == called) return &c;
    return nullptr;
  }
};
std::string without_prefix(std::string_view name) {
  const std::size_t colon = name.find(':');
  return std::string(colon == std::string_view::npos ? name : name.substr(colon + 1));
}

/// The elements of a text; a sentence where it is no XML that can be read.
class XmlText {
 public:
  explicit XmlText(std::string_view text) : text_(text) {}
  std::optional<XmlElement> read() {
    skip_other();
    XmlElement root;
    if (!element(root, 0)) return std::nullopt;
    skip_other();
    if (at_ < text_.size()) return fail("unexpected text follows the outermost element");
    return root;
  }
  std::string message;
  At where;

 private:
  std::nullopt_t fail(std::string what) {
    if (message.empty()) message = std::move(what), where = place();
    return std::nullopt;
  }
  bool failed(std::string what) {
    (void)fail(std::move(what));
    return false;
  }
  At place() {
    for (; counted_ < at_ && counted_ < text_.size(); ++counted_)
      if (text_[counted_] == '\n') ++line_, line_begin_ = counted_ + 1;
    return {0, line_, static_cast<std::uint32_t>(at_ - line_begin_ + 1),
            static_cast<std::uint32_t>(at_), static_cast<std::uint32_t>(at_)};
  }
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  void skip_blanks() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  }
  bool starts(std::string_view s) const { return text_.substr(at_).starts_with(s); }
  /// Comments, declarations and blanks.
  void skip_other() {
    if (at_ == 0 && starts("\xEF\xBB\xBF")) at_ = 3;
    for (;;) {
      skip_blanks();
      std::string_view end;
      if (starts("<!--")) end = "-->";
      else if (starts("<?")) end = "?>";
      else if (starts("<!DOCTYPE")) end = ">";
      else return;
      const std::size_t to = text_.find(end, at_);
      at_ = to == std::string_view::npos ? text_.size() : to + end.size();
    }
  }
  static std::optional<std::string> plain(std::string_view s) {
    std::string out;
    static constexpr std::pair<std::string_view, char> kNames[] = {
        {"lt;", '<'}, {"gt;", '>'}, {"amp;", '&'}, {"quot;", '"'}, {"apos;", '\''}};
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (s[i] != '&') {
        out += s[i];
        continue;
      }
      const std::string_view rest = s.substr(i + 1);
      bool found = false;
      for (const auto& [name, c] : kNames)
        if (!found && rest.starts_with(name)) {
          out += c;
          i += name.size();
          found = true;
        }
      if (!found && rest.starts_with("#")) {
        const bool is_hex = rest.size() > 1 && (rest[1] == 'x' || rest[1] == 'X');
        std::uint32_t code = 0;
        const char* begin = rest.data() + (is_hex ? 2 : 1);
        const auto r = std::from_chars(begin, rest.data() + rest.size(), code, is_hex ? 16 : 10);
        if (r.ec == std::errc() && r.ptr < rest.data() + rest.size() && *r.ptr == ';') {
          out += code < 0x80 ? static_cast<char>(code) : '?';
          i += static_cast<std::size_t>(r.ptr - rest.data()) + 1;
          found = true;
        }
      }
      if (!found) return std::nullopt;
    }
    return out;
  }
  bool element(XmlElement& out, int depth) {
    if (!starts("<") || at_ + 1 >= text_.size()) return failed("an element is expected here");
    if (depth > kDeepestElement) return failed("elements are nested too deeply");
    if (++count_ > kMostElements) return failed("there are too many elements");
    out.at = place();
    ++at_;
    const auto name = [&] {
      const std::size_t from = at_;
      while (at_ < text_.size() && !is_blank(text_[at_]) && text_[at_] != '>' &&
             text_[at_] != '/' && text_[at_] != '=')
        ++at_;
      return text_.substr(from, at_ - from);
    };
    const std::string full(name());
    if (full.empty()) return failed("an element must have a name");
    out.name = without_prefix(full).substr(0, kLongestName);
    for (;;) {
      skip_blanks();
      if (at_ >= text_.size()) return failed("the element " + out.name + " does not end");
      if (starts("/>")) {
        at_ += 2;
        out.at.end = static_cast<std::uint32_t>(at_);
        return true;
      }
      if (text_[at_] == '>') break;
      const std::string key = without_prefix(name()).substr(0, kLongestName);
      skip_blanks();
      if (key.empty() || at_ >= text_.size() || text_[at_] != '=')
        return failed("an attribute of " + out.name + " has no value");
      ++at_;
      skip_blanks();
      const char quote = at_ < text_.size() ? text_[at_] : ' ';
      const std::size_t to =
          quote == '"' || quote == '\'' ? text_.find(quote, at_ + 1) : std::string_view::npos;
      if (to == std::string_view::npos)
        return failed("the value of attribute " + key + " does not end");
      const auto v = plain(text_.substr(at_ + 1, to - at_ - 1));
      if (!v) return failed("the value of attribute " + key + " has an unknown entity");
      if (key == "type") out.type = without_prefix(*v).substr(0, kLongestName);
      at_ = to + 1;
    }
    ++at_;
    for (;;) {
      const std::size_t to = text_.find('<', at_);
      if (to == std::string_view::npos) {
        at_ = text_.size();
        return failed("the element " + out.name + " does not end");
      }
      const auto words = plain(text_.substr(at_, to - at_));
      if (!words) return failed("the element " + out.name + " has an unknown entity");
      out.text += *words;
      at_ = to;
      if (starts("<!--") || starts("<?")) {
        skip_other();
        continue;
      }
      if (starts("<![CDATA[")) {
        const std::size_t end = text_.find("]]>", at_);
        if (end == std::string_view::npos) return failed("CDATA does not end");
        out.text += text_.substr(at_ + 9, end - at_ - 9);
        at_ = end + 3;
        continue;
      }
      if (starts("</")) {
        at_ += 2;
        if (name() != full) return failed("the element " + out.name + " is not closed here");
        skip_blanks();
        if (!starts(">")) return failed("the end of " + out.name + " is incomplete");
        ++at_;
        out.at.end = static_cast<std::uint32_t>(at_);
        return true;
      }
      XmlElement c;
      if (!element(c, depth + 1)) return false;
      out.children.push_back(std::move(c));
    }
  }

  std::string_view text_;
  std::size_t at_ = 0, counted_ = 0, line_begin_ = 0, count_ = 0;
  std::uint32_t line_ = 1;
};

std::string_view trimmed_text(std::string_view s) {
  const std::size_t b = s.find_first_not_of(" \t\r\n");
  if (b == std::string_view::npos) return {};
  return s.substr(b, s.find_last_not_of(" \t\r\n") - b + 1);
}

class CrclReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    name_ = std::string(stem(files_[0].name));
    comment_file_ = static_cast<std::uint32_t>(-1);
    XmlText xml(files_[0].text);
    const auto root = xml.read();
    if (!root) {
      fail(xml.where, "this XML cannot be read: " + xml.message,
           "Check that the file is complete.");
      return;
    }
    if (root->name != "CRCLProgram" && root->name != "CRCLCommandInstance") {
      fail(root->at, "this is XML, but not CRCL: its outermost element is " + root->name,
           "A CRCL program is a CRCLProgram element.");
      return;
    }
    for (const XmlElement& e : root->children) {
      if (is_cancelled()) return;
      statement(e.at, [&] { outer(e); });
    }
  }

 private:
  Ex primary() override { return failed(); }

  void outer(const XmlElement& e) {
    if (e.name == "Name") {
      const std::string_view name = trimmed_text(e.text);
      if (!name.empty()) name_ = std::string(name);
      return;
    }
    if (e.name == "InitCanon" || e.name == "EndCanon") return only(e, {});
    if (e.name == "MiddleCommand" || e.name == "CRCLCommand") return command(e);
    bad(e.at, "the element " + e.name + " is not known here");
  }

  // ---- what elements hold ----

  /// Whether an element has no other children than these; says which it has.
  bool has_only(const XmlElement& e, std::initializer_list<std::string_view> names) {
    for (const XmlElement& c : e.children) {
      if (c.name == "CommandID" || c.name == "Name") continue;
      if (std::find(names.begin(), names.end(), c.name) != names.end()) continue;
      bad(c.at,
          "the element " + c.name + " of " + (e.type.empty() ? e.name : e.type) + " is not read");
      return false;
    }
    return true;
  }
  void only(const XmlElement& e, std::initializer_list<std::string_view> names) {
    (void)has_only(e, names);
  }
  std::optional<double> number_in(const XmlElement& of, std::string_view name) {
    const XmlElement* e = of.child(name);
    if (!e) {
      bad(of.at, (of.type.empty() ? of.name : of.type) + " has no element " + std::string(name));
      return std::nullopt;
    }
    const std::string_view s = trimmed_text(e->text);
    double v = 0;
    const auto r = std::from_chars(s.data(), s.data() + s.size(), v);
    if (s.empty() || r.ec != std::errc() || r.ptr != s.data() + s.size() || !(std::fabs(v) < 1e9)) {
      bad(e->at,
          std::string(name) + " must be a number, not \"" + std::string(s.substr(0, 40)) + "\"");
      return std::nullopt;
    }
    return v;
  }
  std::string text_in(const XmlElement& of, std::string_view name) {
    const XmlElement* e = of.child(name);
    if (e) return std::string(trimmed_text(e->text));
    bad(of.at, (of.type.empty() ? of.name : of.type) + " has no element " + std::string(name));
    return {};
  }
  std::optional<bool> truth_in(const XmlElement& of, std::string_view name) {
    const std::string s = text_in(of, name);
    if (s == "true" || s == "1") return true;
    if (s == "false" || s == "0") return false;
    bad(of.at, std::string(name) + " must be true or false");
    return std::nullopt;
  }

  // ---- commands ----

  void command(const XmlElement& e) {
    const std::string& t = e.type;
    if (t == "SetLengthUnitsType") return length_units(e);
    if (t == "SetAngleUnitsType") return angle_units(e);
    if (t == "SetTransSpeedType") return speed(e, "TransSpeed", true);
    if (t == "SetRotSpeedType") return speed(e, "RotSpeed", false);
    if (t == "SetTransAccelType") return acceleration(e, "TransAccel");
    if (t == "SetRotAccelType") {
      left_out(RMP_FAULT_WARNING, e.at,
               std::string("IRL has no angular accelerations of the tool") + kOtherTimes);
      return;
    }
    if (t == "SetEndPoseToleranceType") {
      if (!has_only(e, {"Tolerance"})) return;
      note_line(e.at, "motions end exactly at their poses, so all tolerances are met");
      return;
    }
    if (t == "SetIntermediatePoseToleranceType") return between_tolerance(e);
    if (t == "MoveToType") return move_to(e);
    if (t == "MoveThroughToType") return move_through(e);
    if (t == "ActuateJointsType") return actuate(e);
    if (t == "DwellType") {
      if (!has_only(e, {"DwellTime"})) return;
      const auto v = number_in(e, "DwellTime");
      if (v && *v < 0) bad(e.at, "a time must not be negative");
      else if (v) emit("WAIT " + measure(*v).s + " SEC;", e.at);
      return;
    }
    if (t == "MessageType") {
      if (has_only(e, {"Message"})) emit("WRITELN(" + string(text_in(e, "Message")).s + ");", e.at);
      return;
    }
    if (t == "SetEndEffectorType") return end_effector(e);
    if (t == "SetRobotParametersType") return parameters(e);
    if (t == "StopMotionType") {
      if (has_only(e, {"StopCondition"})) emit("HALT;", e.at);
      return;
    }
    if (t == "ConfigureJointReportsType" || t == "GetStatusType" || t == "SetForceUnitsType" ||
        t == "SetTorqueUnitsType" || t == "ConfigureStatusReportType") {
      left_out(RMP_FAULT_WARNING, e.at, t + " neither moves a robot nor switches a signal");
      return;
    }
    bad(e.at, t.empty() ? "a command must have a type (xsi:type)"
                        : t + " is not read: IRL has no counterpart");
  }
  void length_units(const XmlElement& e) {
    if (!has_only(e, {"UnitName"})) return;
    const std::string unit = text_in(e, "UnitName");
    if (unit == "millimeter") mm_ = 1;
    else if (unit == "meter") mm_ = 1000;
    else if (unit == "inch") mm_ = 25.4;
    else
      bad(e.at,
          "a length must be in meter, millimeter or inch, not in \"" + unit.substr(0, 40) + "\"");
  }
  void angle_units(const XmlElement& e) {
    if (!has_only(e, {"UnitName"})) return;
    const std::string unit = text_in(e, "UnitName");
    if (unit == "degree") degrees_ = 1;
    else if (unit == "radian") degrees_ = kDegree;
    else bad(e.at, "an angle must be in radian or degree, not in \"" + unit.substr(0, 40) + "\"");
  }
  /// Modal speeds: of straight motions in mm/s or degrees/s, of others a share.
  void speed(const XmlElement& e, const char* name, bool is_path) {
    if (!has_only(e, {name})) return;
    const XmlElement* v = e.child(name);
    if (!v) {
      bad(e.at, e.type + " has no element " + name);
      return;
    }
    const bool is_share = v->type.ends_with("RelativeType");
    if (!is_share && !v->type.ends_with("AbsoluteType")) {
      bad(v->at, std::string(name) + " must be absolute or relative (xsi:type)");
      return;
    }
    const auto n = number_in(*v, is_share ? "Fraction" : "Setting");
    if (!n) return;
    if (!(*n > 0) || (is_share && *n > 1)) {
      bad(v->at,
          is_share ? "a speed fraction must be above 0 and at most 1" : "a speed must be above 0");
      return;
    }
    if (is_path) {
      const double full = params_.real("tcp_speed") * 1000;
      mm_per_s_ = is_share ? *n * full : *n * mm_;
      share_ = is_share ? *n : std::min(1.0, *n * mm_ / full);
      is_speed_share_ = is_share;
    } else if (is_share) {
      left_out(RMP_FAULT_WARNING, e.at,
               "a fraction of the maximum angular speed has no counterpart in IRL");
    } else {
      degrees_per_s_ = *n * degrees_;
    }
  }
  void acceleration(const XmlElement& e, const char* name) {
    if (!has_only(e, {name})) return;
    const XmlElement* v = e.child(name);
    if (!v || !v->type.ends_with("RelativeType")) {
      left_out(RMP_FAULT_WARNING, e.at,
               std::string("IRL has no accelerations in m/s^2") + kOtherTimes);
      return;
    }
    const auto n = number_in(*v, "Fraction");
    if (!n) return;
    if (!(*n > 0 && *n <= 1)) bad(v->at, "an acceleration fraction must be above 0 and at most 1");
    else acceleration_ = *n * 100;
  }
  void between_tolerance(const XmlElement& e) {
    if (!has_only(e, {"Tolerance"})) return;
    const XmlElement* t = e.child("Tolerance");
    blend_mm_ = 0;
    if (!t) return;
    std::optional<double> least;
    for (const char* axis : {"XPointTolerance", "YPointTolerance", "ZPointTolerance"}) {
      if (!t->child(axis)) continue;
      const auto v = number_in(*t, axis);
      if (!v) return;
      least = std::min(least.value_or(*v), *v);
    }
    blend_mm_ = std::max(0.0, least.value_or(0) * mm_);
  }
  using Columns = std::array<double, 3>;
  std::optional<Columns> three(const XmlElement& of, const char* name, const char* words) {
    const XmlElement* e = of.child(name);
    if (!e) {
      bad(of.at, "the pose " + of.name + " has no " + name);
      return std::nullopt;
    }
    Columns out{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto v = number_in(*e, std::string_view(words + i, 1));
      if (!v) return std::nullopt;
      out[i] = *v;
    }
    return out;
  }
  Ex pose_in(const XmlElement& e) {
    const auto p = three(e, "Point", "XYZ"), x = three(e, "XAxis", "IJK"),
               z = three(e, "ZAxis", "IJK");
    if (!p || !x || !z) return failed();
    const auto dot = [](const Columns& a, const Columns& b) {
      return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const auto unit = [&](Columns v) {
      const double n = std::sqrt(dot(v, v));
      for (double& c : v) c = n > 0 ? c / n : 0;
      return v;
    };
    if (std::fabs(dot(*x, *x) - 1) > 0.01 || std::fabs(dot(*z, *z) - 1) > 0.01 ||
        std::fabs(dot(*x, *z)) > 0.01)
      return bad(e.at, "XAxis and ZAxis must be perpendicular unit vectors");
    // The z axis as it is, and what of the x axis is across it.
    const Columns k = unit(*z);
    Columns i = *x;
    const double along = dot(i, k);
    for (std::size_t c = 0; c < 3; ++c) i[c] -= along * k[c];
    i = unit(i);
    const Columns j{k[1] * i[2] - k[2] * i[1], k[2] * i[0] - k[0] * i[2],
                    k[0] * i[1] - k[1] * i[0]};
    std::string columns;
    for (const Columns& c : {i, j, k})
      columns +=
          (columns.empty() ? "" : ", ") + position({measure(c[0]), measure(c[1]), measure(c[2])}).s;
    Ex ori = value("ORIMAT(" + columns + ")", kOrientation);
    ori.is_constant = true;
    return pose({measure((*p)[0] * mm_), measure((*p)[1] * mm_), measure((*p)[2] * mm_)}, ori);
  }
  void go(const Ex& to, bool is_straight, double blend, const At& at) {
    if (!to.ok) return;
    Motion m;
    m.word = is_straight ? "LIN" : "PTP";
    m.targets.push_back(to);
    if (is_straight) {
      if (mm_per_s_ > 0) m.attributes.emplace_back("SPEED", measure(mm_per_s_));
      if (degrees_per_s_ > 0) m.attributes.emplace_back("SPEED_ORI", measure(degrees_per_s_));
      if (acceleration_ < 100) m.attributes.emplace_back("ACC", measure(acceleration_));
      if (blend > 0) m.attributes.emplace_back("C_CP", measure(blend));
    } else {
      if (share_ > 0) m.attributes.emplace_back("SPEED_PTP", measure(100 * share_));
      if (acceleration_ < 100) m.attributes.emplace_back("ACC_PTP", measure(acceleration_));
      if (blend > 0) m.attributes.emplace_back("C_PASS", boolean(true));
    }
    if (mm_per_s_ > 0 && is_straight == is_speed_share_ && !std::exchange(told_full_, true))
      note(at,
           is_straight ? "a fraction of the maximum speed is taken of " +
                             number_text(params_.real("tcp_speed")) + " m/s"
                       : "a speed in mm/s of a non-straight motion is taken as a fraction of " +
                             number_text(params_.real("tcp_speed")) + " m/s",
           "settings = {tcp_speed = ...} gives another.");
    move(std::move(m), at);
  }
  void move_to(const XmlElement& e) {
    if (!has_only(e, {"MoveStraight", "EndPosition"})) return;
    const auto straight = truth_in(e, "MoveStraight");
    const XmlElement* to = e.child("EndPosition");
    if (!to) bad(e.at, "MoveToType has no element EndPosition");
    else if (straight) go(pose_in(*to), *straight, 0, e.at);
  }
  void move_through(const XmlElement& e) {
    if (!has_only(e, {"MoveStraight", "Waypoint", "NumPositions"})) return;
    const auto straight = truth_in(e, "MoveStraight");
    std::vector<Ex> all;
    for (const XmlElement& c : e.children)
      if (c.name == "Waypoint") all.push_back(pose_in(c));
    if (!straight) return;
    if (const XmlElement* n = e.child("NumPositions"); n && !all.empty()) {
      const auto count = number_in(e, "NumPositions");
      if (!count) return;
      if (*count != static_cast<double>(all.size())) {
        bad(n->at, "NumPositions is " + number_text(*count) + ", but here are " +
                       std::to_string(all.size()) + " waypoints");
        return;
      }
    }
    if (all.empty()) {
      bad(e.at, "MoveThroughToType has no waypoints");
      return;
    }
    if (all.size() > 1 && blend_mm_ == 0)
      note(e.at, "the robot stops at waypoints, since they have no tolerance");
    for (std::size_t i = 0; i < all.size(); ++i)
      go(all[i], *straight, i + 1 < all.size() ? blend_mm_ : 0, e.at);
  }
  void actuate(const XmlElement& e) {
    if (!has_only(e, {"ActuateJoint"})) return;
    std::map<int, double> at;
    double share = 0;
    for (const XmlElement& j : e.children) {
      if (j.name != "ActuateJoint") continue;
      if (!has_only(j, {"JointNumber", "JointPosition", "JointDetails"})) return;
      const auto n = number_in(j, "JointNumber"), v = number_in(j, "JointPosition");
      if (!n || !v) return;
      if (*n != std::floor(*n) || *n < 1 || *n > 6 || at.contains(static_cast<int>(*n))) {
        bad(j.at, "joints must be numbered from 1 to 6, each once");
        return;
      }
      at[static_cast<int>(*n)] = *v * degrees_;
      if (const XmlElement* d = j.child("JointDetails"); d && d->child("JointSpeed")) {
        const auto s = number_in(*d, "JointSpeed");
        if (!s) return;
        share = std::max(share, *s * degrees_ / (params_.real("joint_speed") * kDegree));
      } else if (d && !d->children.empty() && d->type != "JointSpeedAccelType") {
        bad(d->at, "force-controlled joints are not read");
        return;
      }
    }
    if (at.size() != 6) {
      bad(e.at, "a motion of some joints keeps the others in place, which IRL does not support: " +
                    std::to_string(at.size()) + " of 6 are given");
      return;
    }
    std::vector<Ex> q;
    for (const auto& [n, v] : at) q.push_back(measure(v));
    Motion m;
    m.word = "PTP";
    m.targets.push_back(joints(q, {}));
    m.has_frames = false;
    if (share > 0) {
      m.attributes.emplace_back("SPEED_PTP", measure(std::clamp(100 * share, 0.01, 100.0)));
      if (!std::exchange(told_joint_speed_, true))
        note(e.at,
             "joint speeds are taken as fractions of " +
                 number_text(std::round(params_.real("joint_speed") * kDegree * 1e6) / 1e6) +
                 " degrees/s",
             "settings = {joint_speed = ...} gives another.");
    }
    move(std::move(m), e.at);
  }
  /// 0 to 1; where only these two are set, it is a BOOL.
  void end_effector(const XmlElement& e) {
    if (!has_only(e, {"Setting"})) return;
    const auto v = number_in(e, "Setting");
    if (!v) return;
    if (*v != 0 && *v != 1) learned_.flags.insert("gripper between");
    const bool is_bool = !learned_.flags.contains("gripper between");
    const Symbol& s = named_signal("gripper", true, is_bool ? kBool : kReal, e.at);
    assign(place(s.irl, s.type), is_bool ? boolean(*v == 1) : real(*v), e.at);
  }
  /// Parameters that controllers take for outputs: "output 3" has its number.
  void parameters(const XmlElement& e) {
    if (!has_only(e, {"ParameterSetting"})) return;
    for (const XmlElement& p : e.children) {
      if (p.name != "ParameterSetting") continue;
      if (!has_only(p, {"ParameterName", "ParameterValue"})) return;
      const std::string name = text_in(p, "ParameterName"), v = text_in(p, "ParameterValue");
      if (name.empty() || v.empty()) {
        bad(p.at, "a parameter must have a name and a value");
        return;
      }
      std::int64_t number = -1;
      if (const std::size_t digits = name.find_last_not_of("0123456789") + 1;
          lower(name).starts_with("output") && digits < name.size() && name.size() - digits < 6)
        number = std::stoll(name.substr(digits));
      double n = 0;
      const auto r = std::from_chars(v.data(), v.data() + v.size(), n);
      const bool is_number = r.ec == std::errc() && r.ptr == v.data() + v.size();
      if (v == "true" || v == "false") {
        const Symbol& s = named_signal(name, true, kBool, p.at, number);
        if (!is_of(s, kBool, p.at)) return;
        assign(place(s.irl, s.type), boolean(v == "true"), p.at);
      } else if (is_number) {
        const bool is_whole = v.find_first_of(".eE") == std::string::npos;
        const Symbol& s = named_signal(name, true, is_whole ? kInt : kReal, p.at, number);
        assign(place(s.irl, s.type), is_whole ? integer(static_cast<std::int64_t>(n)) : real(n),
               p.at);
      } else {
        bad(p.at, "the parameter \"" + name.substr(0, 40) +
                      "\" has a text value, but IRL can only switch outputs");
        return;
      }
    }
  }
  bool is_of(const Symbol& s, const Type& t, const At& at) {
    if (s.type == t) return true;
    bad(at, "this parameter had a value of a different kind before");
    return false;
  }

  double mm_ = 1000, degrees_ = kDegree;  ///< of the units that are set; SI at the start
  double mm_per_s_ = 0, share_ = 0, degrees_per_s_ = 0, acceleration_ = 100, blend_mm_ = 0;
  bool is_speed_share_ = false, told_full_ = false, told_joint_speed_ = false;
};

}  // namespace

Made read_crcl(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<CrclReader>(task, params, progress);
}

}  // namespace robomosp::readers
