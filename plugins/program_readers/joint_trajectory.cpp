// SPDX-License-Identifier: Apache-2.0
// ROS trajectory_msgs/JointTrajectory as YAML or JSON, in a goal of FollowJointTrajectory or by
// itself; and sequences of them with what comes between.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

constexpr int kDeepestNode = 60;
constexpr std::size_t kMostNodes = 4'000'000;

/// A value of YAML or JSON.
struct YamlNode {
  enum Kind : std::uint8_t { scalar, list, map } kind = scalar;
  std::string text;        ///< of a scalar
  bool is_quoted = false;  ///< then it is a text, whatever it looks like
  std::vector<YamlNode> items;
  std::vector<std::string> keys;  ///< of a map, beside `items`
  At at;
  [[nodiscard]] const YamlNode* find(std::string_view key) const {
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (keys[i] == key) return &items[i];
    return nullptr;
  }
};

/// The part of YAML that messages are written in: maps and lists in blocks or in brackets, plain
/// and quoted scalars, comments. A sentence where a text has more than that.
class YamlText {
 public:
  YamlText(std::string_view text, std::uint32_t file) : text_(text), file_(file) {}
  std::string message;
  At where;

  std::optional<YamlNode> read() {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3, line_begin_ = 3;
    skip_lines();
    while (starts("%") || is_marker("---")) {
      if (starts("%")) skip_rest_of_line();
      else at_ += 3;
      skip_lines();
    }
    if (at_ >= text_.size()) return fail("it is empty");
    YamlNode root;
    if (!node(root, -1, 0)) return std::nullopt;
    skip_lines();
    if (is_marker("...") || is_marker("---")) {
      at_ += 3;
      skip_lines();
      while (is_marker("---") || is_marker("...")) {
        at_ += 3;
        skip_lines();
      }
    }
    if (at_ < text_.size())
      return fail("text follows the message; a YAML file must contain one message");
    return root;
  }

 private:
  std::nullopt_t fail(std::string what) {
    if (message.empty()) message = std::move(what), where = place();
    return std::nullopt;
  }
  bool failed(std::string what) {
    (void)fail(std::move(what));
    return false;
  }
  [[nodiscard]] At place() const {
    return {file_, line_, static_cast<std::uint32_t>(at_ - line_begin_ + 1),
            static_cast<std::uint32_t>(at_), static_cast<std::uint32_t>(at_)};
  }
  [[nodiscard]] bool starts(std::string_view s) const { return text_.substr(at_).starts_with(s); }
  [[nodiscard]] bool is_marker(std::string_view s) const {
    return at_ == line_begin_ && starts(s) &&
           (at_ + 3 >= text_.size() ||
            std::string_view(" \t\r\n").find(text_[at_ + 3]) != std::string_view::npos);
  }
  [[nodiscard]] char now() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  [[nodiscard]] int column() const { return static_cast<int>(at_ - line_begin_); }
  void new_line() {
    ++at_;
    ++line_;
    line_begin_ = at_;
  }
  void skip_rest_of_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }
  /// Blanks, ends of lines and comments.
  void skip_lines() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\n') new_line();
      else if (c == ' ' || c == '\t' || c == '\r') ++at_;
      else if (c == '#') skip_rest_of_line();
      else return;
    }
  }
  void skip_blanks() {
    while (now() == ' ' || now() == '\t' || now() == '\r') ++at_;
    if (now() == '#') skip_rest_of_line();
  }
  /// A value to the right of column `outer`.
  bool node(YamlNode& out, int outer, int depth) {
    skip_lines();
    out.at = place();
    if (depth > kDeepestNode) return failed("values are nested too deeply");
    if (++count_ > kMostNodes) return failed("there are too many values");
    const char c = now();
    if (c == '{' || c == '[') return flow(out, depth);
    if (c == '&' || c == '*' || c == '!' || c == '|' || c == '>' || c == '?' || c == '`' ||
        c == '@')
      return failed(std::string("the sign ") + c + " of YAML is not read in messages");
    if (at_ >= text_.size() || column() <= outer) return true;  // nothing: an empty scalar
    if (is_item()) return block_list(out, column(), depth);
    // A key, or a scalar.
    const std::size_t before = at_;
    const std::uint32_t line = line_;
    std::string key;
    bool is_quoted = false;
    if (!scalar(key, is_quoted, false)) return false;
    if (is_key_sign()) {
      at_ = before;
      line_ = line;
      return block_map(out, column(), depth);
    }
    out.text = std::move(key);
    out.is_quoted = is_quoted;
    return true;
  }
  [[nodiscard]] bool is_item() const {
    return now() == '-' &&
           (at_ + 1 >= text_.size() ||
            std::string_view(" \t\r\n").find(text_[at_ + 1]) != std::string_view::npos);
  }
  [[nodiscard]] bool is_key_sign() const {
    return now() == ':' &&
           (at_ + 1 >= text_.size() ||
            std::string_view(" \t\r\n").find(text_[at_ + 1]) != std::string_view::npos);
  }
  bool block_list(YamlNode& out, int indent, int depth) {
    out.kind = YamlNode::list;
    while (at_ < text_.size() && column() == indent && is_item()) {
      ++at_;
      YamlNode item;
      if (!node(item, indent, depth + 1)) return false;
      out.items.push_back(std::move(item));
      skip_lines();
    }
    return is_left(indent);
  }
  bool block_map(YamlNode& out, int indent, int depth) {
    out.kind = YamlNode::map;
    while (at_ < text_.size() && column() == indent && !is_item() && !is_marker("---") &&
           !is_marker("...")) {
      std::string key;
      bool is_quoted = false;
      if (!scalar(key, is_quoted, false)) return false;
      if (!is_key_sign()) return failed("a key of a map must be followed by a colon");
      ++at_;
      if (std::find(out.keys.begin(), out.keys.end(), key) != out.keys.end())
        return failed("the key " + key.substr(0, 40) + " appears twice");
      YamlNode v;
      // A list may begin in the column of its key.
      skip_lines();
      const bool is_list_here = column() == indent && is_item();
      if (is_list_here) {
        v.at = place();
        if (!block_list(v, indent, depth + 1)) return false;
      } else if (!node(v, indent, depth + 1)) {
        return false;
      }
      out.keys.push_back(std::move(key));
      out.items.push_back(std::move(v));
      skip_lines();
    }
    return is_left(indent);
  }
  bool is_left(int indent) {
    if (at_ < text_.size() && column() > indent) return failed("this is indented too far");
    return true;
  }
  bool flow(YamlNode& out, int depth) {
    const bool is_map = now() == '{';
    const char end = is_map ? '}' : ']';
    out.kind = is_map ? YamlNode::map : YamlNode::list;
    ++at_;
    for (;;) {
      skip_lines();
      if (at_ >= text_.size()) return failed(std::string("a ") + end + " is missing");
      if (now() == end) {
        ++at_;
        return true;
      }
      if (is_map) {
        std::string key;
        bool is_quoted = false;
        if (!scalar(key, is_quoted, true)) return false;
        skip_lines();
        if (now() != ':') return failed("a key of a map must be followed by a colon");
        ++at_;
        if (std::find(out.keys.begin(), out.keys.end(), key) != out.keys.end())
          return failed("the key " + key.substr(0, 40) + " appears twice");
        out.keys.push_back(std::move(key));
      }
      YamlNode v;
      skip_lines();
      v.at = place();
      if (depth + 1 > kDeepestNode) return failed("values are nested too deeply");
      if (++count_ > kMostNodes) return failed("there are too many values");
      if (now() == '{' || now() == '[') {
        if (!flow(v, depth + 1)) return false;
      } else if (!scalar(v.text, v.is_quoted, true)) {
        return false;
      }
      out.items.push_back(std::move(v));
      skip_lines();
      if (now() == ',') ++at_;
      else if (now() != end) return failed(std::string("a comma or ") + end + " is expected here");
    }
  }
  /// A scalar of one line.
  bool scalar(std::string& out, bool& is_quoted, bool is_in_flow) {
    const char q = now();
    if (q == '"' || q == '\'') {
      is_quoted = true;
      ++at_;
      while (at_ < text_.size() && text_[at_] != '\n') {
        char c = text_[at_++];
        if (c == q) {
          if (q == '\'' && now() == '\'') {
            ++at_;
            out += c;
            continue;
          }
          while (now() == ' ' || now() == '\t' || now() == '\r') ++at_;
          return true;
        }
        if (c == '\\' && q == '"' && at_ < text_.size()) {
          c = text_[at_++];
          c = c == 'n' ? '\n' : c == 't' ? '\t' : c;
        }
        out += c;
      }
      return failed("a quoted text does not end on its line");
    }
    const std::size_t from = at_;
    while (at_ < text_.size() && text_[at_] != '\n') {
      const char c = text_[at_];
      if (is_in_flow && (c == ',' || c == ']' || c == '}' || c == '[' || c == '{')) break;
      if (c == '#' && at_ > from && (text_[at_ - 1] == ' ' || text_[at_ - 1] == '\t')) break;
      if (c == ':' &&
          (at_ + 1 >= text_.size() ||
           std::string_view(" \t\r\n,]}").find(text_[at_ + 1]) != std::string_view::npos))
        break;
      ++at_;
    }
    std::string_view s = text_.substr(from, at_ - from);
    while (!s.empty() && (s.back() == ' ' || s.back() == '\t' || s.back() == '\r'))
      s.remove_suffix(1);
    out = std::string(s);
    return true;
  }

  std::string_view text_;
  std::uint32_t file_;
  std::size_t at_ = 0, line_begin_ = 0, count_ = 0;
  std::uint32_t line_ = 1;
};

class TrajectoryReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    name_ = std::string(stem(files_[0].name));
    comment_file_ = static_cast<std::uint32_t>(-1);
    learned_.has_robot_joints = true;
    // A sequence says which trajectories there are, wherever it is among the files.
    const std::string kind = extension(files_[0].name);
    std::size_t first = 0;
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (extension(files_[f].name) == kind &&
          std::string_view(files_[f].text).substr(0, 200).find("sequence") != std::string::npos)
        first = f;
    std::optional<YamlNode> root = read_file(first);
    if (!root) return;
    if (root->find("sequence")) {
      name_ = std::string(stem(files_[first].name));
      sequence(*root, kind);
    } else {
      trajectory(*root);
    }
  }

 private:
  Ex primary() override { return failed(); }

  std::optional<YamlNode> read_file(std::size_t f) {
    YamlText yaml(files_[f].text, static_cast<std::uint32_t>(f));
    auto root = yaml.read();
    if (!root)
      fail(yaml.where, "this YAML or JSON cannot be read: " + yaml.message,
           "A message has maps, lists, numbers and texts only.");
    return root;
  }
  std::optional<double> number_of(const YamlNode& n) {
    double v = 0;
    const char* begin = n.text.data();
    const char* end = begin + n.text.size();
    if (n.kind == YamlNode::scalar && !n.is_quoted && !n.text.empty()) {
      if (*begin == '+') ++begin;
      const auto r = std::from_chars(begin, end, v);
      if (r.ec == std::errc() && r.ptr == end && std::fabs(v) < 1e12) return v;
    }
    bad(n.at, "a number is expected here" +
                  (n.text.empty() ? std::string() : ", not \"" + n.text.substr(0, 40) + "\""));
    return std::nullopt;
  }

  // ---- trajectories ----

  /// The map with joint_names and points; a goal has it within.
  const YamlNode* message_in(const YamlNode& n) {
    if (n.kind != YamlNode::map) return nullptr;
    if (n.find("points") && n.find("joint_names")) return &n;
    for (const char* key : {"goal", "trajectory", "joint_trajectory"})
      if (const YamlNode* inner = n.find(key))
        if (const YamlNode* found = message_in(*inner)) return found;
    return nullptr;
  }
  void trajectory(const YamlNode& root) {
    const YamlNode* m = message_in(root);
    if (!m) {
      fail(root.at, "this is not a JointTrajectory: it has no map with joint_names and points",
           "A message is trajectory_msgs/JointTrajectory, or a goal of FollowJointTrajectory.");
      return;
    }
    const YamlNode& names = *m->find("joint_names");
    std::vector<std::string> joints_there;
    for (const YamlNode& n : names.items) joints_there.push_back(n.text);
    bool is_good =
        names.kind == YamlNode::list && !joints_there.empty() && joints_there.size() <= 60;
    for (const std::string& n : joints_there) is_good = is_good && !n.empty();
    if (!is_good) {
      fail(names.at, "joint_names must be a list of 1 to 60 names");
      return;
    }
    const auto order = order_of(joints_there, names.at);
    if (!order) return;
    learned_.axes = static_cast<int>(joints_there.size());
    const YamlNode& points = *m->find("points");
    if (points.kind != YamlNode::list) {
      fail(points.at, "points must be a list");
      return;
    }
    double before = 0;
    for (std::size_t i = 0; i < points.items.size(); ++i) {
      if (is_cancelled()) return;
      statement(points.items[i].at, [&] {
        before = point(points.items[i], *order, before, i == 0, i + 1 == points.items.size());
      });
    }
  }
  /// Names between commas.
  static std::vector<std::string> names_in(std::string_view list) {
    std::vector<std::string> out;
    while (!list.empty()) {
      const std::size_t to = std::min(list.find(','), list.size());
      std::string one(list.substr(0, to));
      while (!one.empty() && one.front() == ' ') one.erase(0, 1);
      while (!one.empty() && one.back() == ' ') one.pop_back();
      if (!one.empty()) out.push_back(std::move(one));
      list.remove_prefix(std::min(to + 1, list.size()));
    }
    return out;
  }
  /// Where each joint of the robot is in the message.
  std::optional<std::vector<std::size_t>> order_of(const std::vector<std::string>& there,
                                                   const At& at) {
    std::vector<std::size_t> out;
    linear_.clear();
    for (const std::string& one : names_in(params_.text("linear"))) {
      const auto found = std::find(there.begin(), there.end(), one);
      if (found != there.end()) linear_.push_back(static_cast<std::size_t>(found - there.begin()));
    }
    const std::vector<std::string> wanted = names_in(params_.text("joints"));
    if (wanted.empty()) {
      std::string all;
      for (std::size_t i = 0; i < there.size(); ++i) {
        out.push_back(i);
        if (i < 12) all += (i ? ", " : "") + there[i].substr(0, 40);
      }
      if (there.size() > 12) all += " and others";
      if (!std::exchange(told_order_, true))
        note(at, "the robot's joints are assumed to be in the order of joint_names: " + all,
             "settings = {joints = \"first, second, ...\"} sets the robot's order.");
      return out;
    }
    for (const std::string& one : wanted) {
      const auto found = std::find(there.begin(), there.end(), one);
      if (found == there.end()) {
        fail(at,
             "the joint \"" + one.substr(0, 40) + "\" of settings.joints is not in joint_names");
        return std::nullopt;
      }
      out.push_back(static_cast<std::size_t>(found - there.begin()));
    }
    if (out.size() != there.size()) {
      fail(at, "joint_names has " + std::to_string(there.size()) + " joints, and settings.joints " +
                   std::to_string(out.size()));
      return std::nullopt;
    }
    return out;
  }
  std::optional<double> time_of(const YamlNode& n) {
    if (n.kind == YamlNode::scalar) return number_of(n);
    double out = 0;
    for (std::size_t i = 0; i < n.keys.size(); ++i) {
      const auto v = number_of(n.items[i]);
      if (!v) return std::nullopt;
      if (n.keys[i] == "sec" || n.keys[i] == "secs") out += *v;
      else if (n.keys[i] == "nanosec" || n.keys[i] == "nsecs") out += *v * 1e-9;
      else return bad(n.items[i].at, "a time must have sec and nanosec"), std::nullopt;
    }
    return out;
  }
  /// Gives its time.
  double point(const YamlNode& p, const std::vector<std::size_t>& order, double before,
               bool is_first, bool is_last) {
    if (p.kind != YamlNode::map) {
      bad(p.at, "a point must have positions and time_from_start");
      return before;
    }
    for (std::size_t i = 0; i < p.keys.size(); ++i) {
      const std::string& k = p.keys[i];
      if (k == "positions" || k == "time_from_start") continue;
      if (k != "velocities" && k != "accelerations" && k != "effort") {
        bad(p.items[i].at, "a point has no " + k.substr(0, 40));
        return before;
      }
      if (p.items[i].items.empty()) continue;
      if (k == "effort") {
        bad(p.items[i].at, "IRL has no efforts");
        return before;
      }
      bool is_zero = true;
      for (const YamlNode& v : p.items[i].items) {
        const auto x = number_of(v);
        if (!x) return before;
        is_zero = is_zero && *x == 0;
      }
      if (!is_zero && !std::exchange(told_rates_, true))
        warn(p.items[i].at, k.substr(0, 40) +
                                " are not written: a run passes through the points at their times "
                                "on its own cubics");
      if (k == "velocities" && is_zero && !is_last) stands_.insert(p.at.begin);
    }
    const YamlNode* positions = p.find("positions");
    const YamlNode* time = p.find("time_from_start");
    if (!positions || positions->kind != YamlNode::list || !time) {
      bad(p.at, "a point must have positions and time_from_start");
      return before;
    }
    if (positions->items.size() != order.size()) {
      bad(positions->at, "this point has " + std::to_string(positions->items.size()) +
                             " positions, and joint_names " + std::to_string(order.size()));
      return before;
    }
    const auto t = time_of(*time);
    if (!t) return before;
    if (*t < 0 || (!is_first && !(*t > before))) {
      bad(time->at, "times of points must increase, but this one is " + number_text(*t) +
                        " s after " + number_text(before) + " s");
      return before;
    }
    std::vector<Ex> q;
    for (const std::size_t k : order) {
      const auto v = number_of(positions->items[k]);
      if (!v) return before;
      const bool is_linear = std::find(linear_.begin(), linear_.end(), k) != linear_.end();
      q.push_back(measure(*v * (is_linear ? 1000 : kDegree)));
    }
    Motion m;
    m.word = "PTP";
    m.targets.push_back(joints(q, {}));
    m.has_frames = false;
    const double by = *t - before;
    if (by > 0) m.attributes.emplace_back("TIME", measure(by));
    else note(p.at, "this point is at time 0: the robot first moves there if it is elsewhere");
    if (!is_last && by > 0 && !stands_.contains(p.at.begin))
      m.attributes.emplace_back("C_PASS", boolean(true));
    move(std::move(m), p.at);
    return *t;
  }

  // ---- sequences ----

  void sequence(const YamlNode& root, const std::string& kind) {
    const YamlNode* steps = root.find("steps");
    if (!steps || steps->kind != YamlNode::list) {
      fail(root.at, "a sequence must have a list of steps");
      return;
    }
    for (const YamlNode& s : steps->items) {
      if (is_cancelled()) return;
      if (const YamlNode* t = s.find("trajectory"); t && s.keys.size() == 1) {
        part(*t, kind);
        continue;
      }
      statement(s.at, [&] { step(s); });
    }
  }
  void part(const YamlNode& name, const std::string& kind) {
    for (std::size_t f = 0; f < files_.size(); ++f) {
      if (lower(files_[f].name) != lower(name.text + "." + kind)) continue;
      const auto root = read_file(f);
      if (root) trajectory(*root);
      return;
    }
    statement(name.at, [&] {
      bad(name.at, "the trajectory \"" + name.text.substr(0, 100) + "\" is not among the files",
          "Put it beside the sequence, as a file ." + kind + ".");
    });
  }
  /// The one key that says what a step is, with those that it may have besides.
  bool has_keys(const YamlNode& s, std::initializer_list<std::string_view> known) {
    for (std::size_t i = 0; i < s.keys.size(); ++i)
      if (std::find(known.begin(), known.end(), s.keys[i]) == known.end()) {
        bad(s.items[i].at, "a step has no " + s.keys[i].substr(0, 40) + " here");
        return false;
      }
    return true;
  }
  void step(const YamlNode& s) {
    if (s.kind != YamlNode::map || s.keys.empty()) {
      bad(s.at, "a step must be a map");
      return;
    }
    const std::string& what = s.keys[0];
    const YamlNode& v = s.items[0];
    if (what == "wait" && has_keys(s, {"wait"})) {
      const auto t = number_of(v);
      if (t) emit("WAIT " + measure(*t).s + " SEC;", s.at);
    } else if (what == "set" && has_keys(s, {"set", "number", "width", "value"})) {
      output(s);
    } else if (what == "wait_for" && has_keys(s, {"wait_for", "timeout"})) {
      const Ex c = converted(asked(v, 0), kBool, s.at);
      if (!c.ok) return;
      std::string until;
      if (const YamlNode* t = s.find("timeout")) {
        const auto seconds = number_of(*t);
        if (!seconds) return;
        until = " TIMEOUT " + measure(*seconds).s;
      }
      emit("WAIT FOR " + c.s + until + ";", s.at);
    } else if (what == "text" && has_keys(s, {"text", "ends_line"})) {
      const YamlNode* ends = s.find("ends_line");
      emit((ends && ends->text == "false" ? "WRITE(" : "WRITELN(") + string(v.text).s + ");", s.at);
    } else if (what == "pause" && has_keys(s, {"pause"})) {
      emit(v.text.empty() ? "PAUSE;" : "PAUSE " + string(v.text).s + ";", s.at);
    } else if (what == "halt" && has_keys(s, {"halt"})) {
      emit("HALT;", s.at);
    } else {
      bad(s.at, "the step \"" + what.substr(0, 40) + "\" is not known");
    }
  }
  /// A signal of a sequence, with its number; INT ones have a width.
  Ex signal_of(const std::string& name, bool is_output, const YamlNode* number,
               const YamlNode* width, const Type& otherwise) {
    if (const Symbol* s = find(lower(name))) return place(s->irl, s->type);
    const auto n = number ? number_of(*number) : std::optional<double>(0);
    const auto w = width ? number_of(*width) : std::optional<double>(0);
    if (!n || !w) return failed();
    if (!(*n >= 0 && *n < 1e6) || (width && !(*w >= 1 && *w <= 64)))
      return bad(number ? number->at : At{},
                 "a signal must have a number and, as a group, 1 to 64 bits");
    const Type t = width ? kInt : otherwise;
    const Symbol& s = declare(name, t, is_output ? Symbol::output : Symbol::input);
    signals_.push_back({std::string(is_output ? "OUTPUT " : "INPUT ") + type_text(t) + ": " +
                            s.irl + " AT " + std::to_string(static_cast<std::int64_t>(*n)) +
                            (width ? ", " + std::to_string(static_cast<std::int64_t>(*w)) : "") +
                            ";",
                        number ? number->at : At{}, true});
    return place(s.irl, s.type);
  }
  void output(const YamlNode& s) {
    const YamlNode* value = s.find("value");
    if (!value || !s.find("number")) {
      bad(s.at, "a step that switches an output needs its number and value");
      return;
    }
    const bool is_bool = !value->is_quoted && (value->text == "true" || value->text == "false");
    Ex v = boolean(value->text == "true");
    if (!is_bool) {
      const auto n = number_of(*value);
      if (!n) return;
      v = s.find("width") ? integer(static_cast<std::int64_t>(*n)) : real(*n);
    }
    const Ex to = signal_of(s.items[0].text, true, s.find("number"), s.find("width"),
                            is_bool ? kBool : kReal);
    if (to.ok) assign(to, v, s.at);
  }
  /// A condition: a value, or a list with its operator first.
  Ex asked(const YamlNode& n, int depth) {
    if (depth > kDeepestNode) return bad(n.at, "this condition is nested too deeply");
    if (n.kind == YamlNode::scalar) {
      if (!n.is_quoted && (n.text == "true" || n.text == "false")) return boolean(n.text == "true");
      const auto v = number_of(n);
      if (!v) return failed();
      const bool is_whole = n.text.find_first_of(".eE") == std::string::npos;
      return is_whole && std::fabs(*v) < 2e9 ? integer(static_cast<std::int64_t>(*v)) : real(*v);
    }
    if (n.kind != YamlNode::list || n.items.empty())
      return bad(n.at, "a condition must be a list that starts with its operator");
    const std::string& op = n.items[0].text;
    if (op == "input" || op == "output") {
      if (n.items.size() < 3 || n.items.size() > 4)
        return bad(n.at, "a signal must have a name, a number and optionally a width");
      return signal_of(n.items[1].text, op == "output", &n.items[2],
                       n.items.size() > 3 ? &n.items[3] : nullptr, kBool);
    }
    std::vector<Ex> parts;
    for (std::size_t i = 1; i < n.items.size(); ++i) {
      parts.push_back(asked(n.items[i], depth + 1));
      if (!parts.back().ok) return failed();
    }
    if (op == "not" && parts.size() == 1) {
      const Ex b = converted(parts[0], kBool, n.at);
      return b.ok ? value("NOT " + within(b, kRel), kBool, kNot) : failed();
    }
    if (op == "negate" && parts.size() == 1) return negative(parts[0]);
    static constexpr std::pair<std::string_view, Op> kOps[] = {
        {"and", Op::and_}, {"or", Op::or_}, {"xor", Op::exor}, {"=", Op::eq},
        {"<>", Op::ne},    {"<", Op::lt},   {"<=", Op::le},    {">", Op::gt},
        {">=", Op::ge},    {"+", Op::add},  {"-", Op::sub},    {"*", Op::mul}};
    for (const auto& [word, o] : kOps) {
      if (word != op || parts.size() < 2) continue;
      Ex e = parts[0];
      for (std::size_t i = 1; i < parts.size(); ++i) e = binary(o, e, parts[i], n.at);
      return e;
    }
    return bad(n.at, "the operator \"" + op.substr(0, 40) + "\" is not known");
  }

  std::vector<std::size_t> linear_;  ///< joints in m, by their place in the message
  std::set<std::uint32_t> stands_;   ///< points at which every rate is zero
  bool told_order_ = false, told_rates_ = false;
};

}  // namespace

std::vector<std::string> trajectory_needs(const SourceFile& file) {
  std::vector<std::string> out;
  const std::string kind = extension(file.name);
  YamlText yaml(file.text, 0);
  const auto root = yaml.read();
  const YamlNode* steps = root && root->find("sequence") ? root->find("steps") : nullptr;
  if (!steps) return out;
  for (const YamlNode& s : steps->items)
    if (const YamlNode* t = s.find("trajectory"); t && !t->text.empty() && t->text.size() < 200)
      out.push_back(t->text + "." + kind);
  return out;
}
bool looks_like_trajectory(std::string_view text) {
  return (text.find("joint_names") != std::string_view::npos &&
          text.find("points") != std::string_view::npos) ||
         (text.find("sequence") != std::string_view::npos &&
          text.find("steps") != std::string_view::npos);
}

Made read_joint_trajectory(const ProgramReaderTask& task, const Params& params,
                           Progress& progress) {
  return passes<TrajectoryReader>(task, params, progress);
}

}  // namespace robomosp::readers
