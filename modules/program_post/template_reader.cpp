// SPDX-License-Identifier: Apache-2.0
// The form of packs, and all that can be wrong with one. The form is told in
// docs/plugin_author/post_templates.md.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "kernel/text.h"
#include "kernel/utf8.h"
#include "program_post/template_pack.h"

namespace robomosp::program_post {
namespace {

constexpr std::size_t kMostBytes = std::size_t{4} << 20;
constexpr std::size_t kMostFaults = 100;
constexpr int kDeepest = 8;  ///< of files that include files

struct Construct {
  std::string_view name;
  std::string_view variables;  ///< separated by blanks
  std::string_view feature;    ///< that needs it; "" = all packs do; "-" = none does
  /// Variables that its template writes, or something would be lost: groups separated by blanks, of
  /// each one of those separated by |, q and e standing for all joints. "!" = it writes something.
  std::string_view needs;
};
constexpr std::string_view kMotion =
    "point x y z a b c d joints speed speed_changed speed_m speed_ori speed_ptp acc blend "
    "blend_ptp "
    "passes time status turns speed_percent point_number ";
constexpr std::string_view kTarget = "point|point_number|x|y|z|joints|q";
constexpr Construct kConstructs[] = {
    {"program_begin", "name program tool frame", "", ""},
    {"program_end", "name program", "", ""},
    {"points_begin", "name points", "-", ""},
    {"point", "name x y z a b c d joints status turns number", "-", "x|y|z|joints|q"},
    {"point_joints", "name joints number", "-", "joints|q"},
    {"points_end", "name points", "-", ""},
    {"comment", "text", "-", ""},
    {"ptp_joints", kMotion, "ptp_joints", "point|point_number|joints|q"},
    {"ptp_pose", kMotion, "ptp_pose", kTarget},
    {"lin", kMotion, "lin", kTarget},
    {"circle",
     "via end point via_x via_y via_z via_a via_b via_c via_d x y z a b c d speed speed_changed "
     "speed_m "
     "speed_ori acc blend passes time speed_percent point_number via_number",
     "circle", "via|via_number|via_x|via_y|via_z end|point|point_number|x|y|z"},
    {"output_on", "signal number", "", "!"},
    {"output_off", "signal number", "", "!"},
    {"output_value", "signal number value", "-", "value"},
    {"input", "signal number", "inputs", "!"},
    {"wait_time", "seconds milliseconds", "", "seconds|milliseconds"},
    {"wait_for", "condition", "wait_for", "condition"},
    {"wait_for_timeout", "condition seconds milliseconds timed_out", "wait_timeout",
     "condition seconds|milliseconds"},
    {"declare_int", "name value", "variables", ""},
    {"declare_real", "name value", "variables", ""},
    {"declare_bool", "name value", "variables", ""},
    {"assign", "name value", "variables", "name value"},
    {"if_begin", "condition", "if", "condition"},
    {"else_if", "condition", "elsif", "condition"},
    {"else", "", "if", "!"},
    {"if_end", "", "if", ""},
    {"while_begin", "condition", "while", "condition"},
    {"while_end", "", "while", ""},
    {"repeat_begin", "", "repeat", ""},
    {"repeat_end", "condition", "repeat", "condition"},
    {"loop_begin", "", "loop", ""},
    {"loop_end", "", "loop", ""},
    {"exit", "", "exit", "!"},
    {"for_begin", "name from to step", "for", "from to"},
    {"for_end", "name", "for", ""},
    {"goto", "label label_line number", "goto", "label|label_line|number"},
    {"label", "label label_line number", "goto", ""},
    {"jump_if", "condition label label_line number", "jumps", "condition label|label_line|number"},
    {"jump_unless", "condition label label_line number", "-", "condition label|label_line|number"},
    {"procedure_begin", "name number", "procedures", ""},
    {"procedure_end", "name number", "procedures", ""},
    {"call", "name routine_line number", "procedures", "name|routine_line|number"},
    {"return", "", "procedures", "!"},
    {"message", "text values", "messages", "text|values"},
    {"pause", "text values", "pause", "!"},
    {"halt", "", "-", "!"}};
constexpr std::pair<std::string_view, std::uint64_t> kFeatures[] = {
    {"inputs", 0},
    {"wait_for", kPostWaitFor},
    {"wait_timeout", kPostWaitTimeout},
    {"variables", kPostIntegers | kPostReals | kPostBooleans},
    {"if", kPostIf},
    {"elsif", kPostElsif},
    {"while", kPostWhile},
    {"repeat", kPostRepeat},
    {"loop", kPostLoop},
    {"exit", kPostExit},
    {"for", kPostFor},
    {"goto", kPostGoto},
    {"jumps", kPostIf | kPostWhile},
    {"procedures", kPostProcedures | kPostReturn},
    {"messages", kPostMessages},
    {"pause", kPostPause}};
constexpr std::pair<std::string_view, std::uint32_t> kMotions[] = {{"ptp_joints", kPostPtpJoints},
                                                                   {"ptp_pose", kPostPtpPose},
                                                                   {"lin", kPostLinPose},
                                                                   {"circle", kPostCircle}};
constexpr std::pair<std::string_view, post::Orientation> kOrientations[] = {
    {"zyx", post::Orientation::zyx},
    {"fixed_xyz", post::Orientation::fixed_xyz},
    {"xyz", post::Orientation::xyz},
    {"zyz", post::Orientation::zyz},
    {"quaternion", post::Orientation::quaternion},
    {"rotation_vector", post::Orientation::rotation_vector}};
constexpr std::pair<std::string_view, std::uint32_t> kOperators[] = {
    {"-x", RMP_EXPR_NEGATE},    {"NOT", RMP_EXPR_NOT},          {"+", RMP_EXPR_ADD},
    {"-", RMP_EXPR_SUBTRACT},   {"*", RMP_EXPR_MULTIPLY},       {"/", RMP_EXPR_DIVIDE},
    {"DIV", RMP_EXPR_DIV},      {"MOD", RMP_EXPR_MOD},          {"=", RMP_EXPR_EQUAL},
    {"<>", RMP_EXPR_NOT_EQUAL}, {"<", RMP_EXPR_LESS},           {"<=", RMP_EXPR_LESS_EQUAL},
    {">", RMP_EXPR_GREATER},    {">=", RMP_EXPR_GREATER_EQUAL}, {"AND", RMP_EXPR_AND},
    {"OR", RMP_EXPR_OR},        {"EXOR", RMP_EXPR_EXOR}};
constexpr std::string_view kFilters[] = {"fixed", "trimmed", "times", "plus",  "upper", "lower",
                                         "pad",   "left",    "zeros", "first", "sign"};
constexpr std::string_view kKeys[] = {
    "name",          "title",          "file",        "reserved",        "longest_name",
    "max_points",    "max_lines",      "digits",      "indent",          "length_unit",
    "angle_unit",    "between_joints", "true",        "false",           "line_ending",
    "case",          "points",         "points_file", "forms",           "orientation",
    "features",      "motions",        "include",     "line_numbers",    "line_number",
    "longest_line",  "characters",     "angles",      "points_numbered", "between_values",
    "text_sign",     "quotes",         "name_signs",  "case_matters",    "decimal_sign",
    "real_exponent", "real_point",     "real_digits"};
/// Variables that are texts whatever the program is, and those that stand for the number of a line
/// that may not be written yet.
constexpr std::string_view kTexts[] = {"name",  "program", "text",      "condition",
                                       "label", "signal",  "point",     "via",
                                       "end",   "joints",  "timed_out", "values"};
constexpr std::string_view kMarks[] = {"label_line", "routine_line"};

std::string_view trim(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t' || s.back() == '\r'))
    s.remove_suffix(1);
  return s;
}
std::vector<std::string_view> words(std::string_view s) {
  std::vector<std::string_view> out;
  while (!(s = trim(s)).empty()) {
    const std::size_t end = std::min(s.find_first_of(" \t,"), s.size());
    if (end > 0) out.push_back(s.substr(0, end));
    s.remove_prefix(std::min(end + 1, s.size()));
  }
  return out;
}
template <class T>
std::optional<T> number(std::string_view s) {
  T v{};
  const auto r = std::from_chars(s.data(), s.data() + s.size(), v);
  if (s.empty() || r.ec != std::errc() || r.ptr != s.data() + s.size()) return std::nullopt;
  return v;
}

/// `Did you mean "x"?`, or all of them.
template <class Names>
std::string instead(std::string_view word, const Names& names) {
  const std::vector<std::string> all(std::begin(names), std::end(names));
  const std::string near = text::did_you_mean(word, all);
  return near.empty() ? "There are " + text::enumerate(all) + "." : near;
}
template <class Rows>
std::vector<std::string> first_of(const Rows& rows) {
  std::vector<std::string> out;
  for (const auto& row : rows) out.emplace_back(row.first);
  return out;
}

class Reader {
 public:
  explicit Reader(const PackFiles& files) : files_(files) {}

  Result<std::shared_ptr<const TemplatePack>> read(std::string_view text, const std::string& where,
                                                   std::vector<PackFault>* told) {
    one_file(text, where, 0);
    if (is_readable_) finish(where);
    if (faults_.empty()) return std::shared_ptr<const TemplatePack>(std::move(pack_));
    if (told) *told = faults_;
    std::string all;
    for (const PackFault& f : faults_)
      all += (all.empty() ? "" : "; ") + f.place() + ": " + f.message;
    return error(ErrorCode::syntax, all,
                 faults_.size() == 1 && !faults_.front().hint.empty()
                     ? faults_.front().hint
                     : "See docs/plugin_author/post_templates.md for the format.");
  }

 private:
  struct Place {
    std::string file;
    std::uint32_t line = 1, column = 1;
  };
  /// The place of `part`, which is a piece of the present line.
  [[nodiscard]] Place place_of(std::string_view part) const {
    Place p{file_, line_, 1};
    if (part.data() >= whole_.data() && part.data() <= whole_.data() + whole_.size())
      for (const char* c = whole_.data(); c < part.data(); ++c)
        if ((static_cast<unsigned char>(*c) & 0xC0U) != 0x80) ++p.column;
    return p;
  }
  void say(const Place& at, std::string what, std::string hint = {}) {
    if (faults_.size() < kMostFaults)
      faults_.push_back({at.file, at.line, at.column, std::move(what), std::move(hint)});
  }
  void say(std::string_view part, std::string what, std::string hint = {}) {
    say(place_of(part), std::move(what), std::move(hint));
  }
  static const Construct* construct(std::string_view name) {
    for (const Construct& c : kConstructs)
      if (c.name == name) return &c;
    return nullptr;
  }

  // ---- files ----
  /// Whether these bytes are text that can be read.
  bool is_text(std::string_view& text) {
    bytes_ += text.size();
    if (bytes_ > kMostBytes) {
      say(Place{file_}, "the pack is larger than " + std::to_string(kMostBytes >> 20) + " MiB",
          "A pack contains one template per construct; programs do not belong in it.");
      return false;
    }
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
      say(Place{file_}, "the file is UTF-16", "Save it as UTF-8.");
      return false;
    }
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    const std::size_t bad = text::first_bad_byte(text);
    if (bad == std::string_view::npos) return true;
    const std::size_t begin = bad == 0 ? 0 : text.rfind('\n', bad - 1) + 1;
    Place at{file_};
    at.line += static_cast<std::uint32_t>(
        std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(bad), '\n'));
    whole_ = text.substr(begin, bad - begin + 1);
    at.column = place_of(text.substr(bad)).column;
    char byte[8];
    std::snprintf(byte, sizeof byte, "0x%02X", static_cast<unsigned char>(text[bad]));
    say(at, std::string("the byte ") + byte + " here is not UTF-8",
        "Save the file as UTF-8; it may be in Latin-1.");
    return false;
  }
  void one_file(std::string_view text, const std::string& name, int depth) {
    const auto saved = std::tuple(file_, line_, whole_, depth_);
    file_ = name;
    line_ = 0;
    depth_ = depth;
    open_.push_back(name);
    if (!is_text(text)) is_readable_ = false;
    else lines_of(text);
    open_.pop_back();
    std::tie(file_, line_, whole_, depth_) = saved;
  }
  void lines_of(std::string_view text) {
    std::string section;
    const Construct* known = nullptr;
    bool is_first = true;
    while (!text.empty() || is_first) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      std::string_view line = text.substr(0, end);
      text.remove_prefix(std::min(end + 1, text.size()));
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      whole_ = line;
      ++line_;
      if (std::exchange(is_first, false)) {
        if (trim(line) == "robomosp target 1") continue;
        if (depth_ == 0) {
          say(line, "the first line is not \"robomosp target 1\"",
              "Begin the file with this line.");
          is_readable_ = false;
          return;
        }
      }
      if (line.starts_with("#")) {
        if (known && line.find("{{") != std::string_view::npos)
          say(line, "a line that begins with # is a comment of the pack",
              "Begin it with \\ if the controller's line begins with #.");
        continue;
      }
      if (line.starts_with("==")) {
        const std::string_view word = trim(line.substr(2));
        section = word;
        known = begin(section, word);
        continue;
      }
      if (section.empty()) header(line);
      else if (is_like_section(line)) continue;
      else if (section == "operators") operation(line);
      else if (known && !trim(line).empty()) {
        const auto parsed = parse(line, known->variables, section);
        if (owners_[section].file == file_) pack_->templates[section].push_back(parsed);
      }
    }
  }
  /// What looks like the beginning of a section and is none, by mistake: said.
  bool is_like_section(std::string_view line) {
    std::string_view rest = trim(line);
    if (!rest.starts_with('=')) return false;
    rest.remove_prefix(std::min(rest.find_first_not_of('='), rest.size()));
    const std::string word(trim(rest));
    if (!construct(word) && word != "operators") return false;
    say(trim(line), "this line looks like the beginning of a section, but is not one",
        "Write == " + word + " at the line's beginning, or \\ before the controller's own line.");
    return true;
  }
  void include(std::string_view value) {
    const std::string name(value);
    if (name.empty()) return say(value, "include names no file", "Such as include: common.part");
    if (name.front() == '/' || name.find("..") != std::string::npos ||
        name.find('\\') != std::string::npos)
      return say(value, "the included file " + text::quote(name) + " is not in the pack's folder",
                 "Copy it next to the pack, and give only its name.");
    // The first is told with its folder, as its place is.
    const auto of_folder = [](const std::string& f) { return f.substr(f.rfind('/') + 1); };
    const auto is_it = [&](const std::string& f) { return of_folder(f) == name; };
    if (std::any_of(open_.begin(), open_.end(), is_it)) {
      is_readable_ = false;
      if (open_.size() == 1) return say(value, "the file includes itself", "Remove the line.");
      std::string way;
      for (const std::string& f : open_) way += of_folder(f) + " includes ";
      return say(value, "files include each other in a circle: " + way + name,
                 "Remove one of these lines.");
    }
    if (depth_ + 1 >= kDeepest)
      return say(value, "files include each other more than " + std::to_string(kDeepest) + " deep",
                 "Put them into fewer files.");
    if (!files_)
      return say(value, "this pack has no folder to read " + text::quote(name) + " from");
    const Place at = place_of(value);
    auto text = files_(name);
    if (!text.ok()) {
      is_readable_ = false;  // what is missing may be in there
      return say(
          at, "the included file " + text::quote(name) + " cannot be read: " + text.error().message,
          text.error().hint);
    }
    one_file(*text, name, depth_ + 1);
  }

  // ---- head ----
  void header(std::string_view line) {
    if (trim(line).empty()) return;
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos)
      return say(line, "a line of the head is KEY: VALUE, and templates begin with == CONSTRUCT",
                 "Such as name: acme, or == lin.");
    const std::string_view key = trim(line.substr(0, colon)), value = trim(line.substr(colon + 1));
    const std::string_view at = value.empty() ? line.substr(line.size()) : value;
    TemplatePack& p = *pack_;
    const auto whole = [&](auto& to, int least, int most) {
      const auto v = number<int>(value);
      if (!v || *v < least || *v > most)
        return say(at, "\"" + std::string(key) + "\" must be a number from " +
                           std::to_string(least) + " to " + std::to_string(most));
      to = *v;
    };
    const auto real = [&](double& to, const char* what) {
      const auto v = number<double>(value);
      if (!v || !std::isfinite(*v) || *v == 0)
        return say(at, "\"" + std::string(key) + "\" must be a number other than 0", what);
      to = *v;
    };
    if (std::find(std::begin(kKeys), std::end(kKeys), key) == std::end(kKeys))
      return say(key, "there is no key \"" + std::string(key) + "\"", instead(key, kKeys));
    const bool adds_up =
        key == "reserved" || key == "features" || key == "motions" || key == "include";
    if (!adds_up && !keys_.emplace(file_, key).second)
      return say(key, "\"" + std::string(key) + "\" is given twice", "Keep one of them.");
    // A file's own keys take the place of those of the files that it includes, wherever they stand.
    const auto [owner, is_new] = key_depths_.try_emplace(std::string(key), depth_);
    if (!adds_up && !is_new && owner->second < depth_) return;
    owner->second = std::min(owner->second, depth_);
    keys_at_[std::string(key)] = place_of(at);
    const auto yes_or_no = [&](bool& to) {
      if (value != "yes" && value != "no")
        return say(at, "\"" + std::string(key) + "\" must be yes or no");
      to = value == "yes";
    };
    if (key == "name") {
      p.name = value;
      name_at_ = place_of(at);
    } else if (key == "include") {
      include(at);
    } else if (key == "title") {
      p.title = value;
    } else if (key == "file" || key == "points_file") {
      const TemplateLine parsed = parse(at, "name", std::string(key));
      if (value.find("..") != std::string_view::npos || value.starts_with("/") ||
          value.find('\\') != std::string_view::npos || value.empty())
        return say(
            at, "\"" + std::string(key) +
                    "\" must be the name of a file in the program's folder, such as {{name}}.acl");
      (key == "file" ? p.file_name : p.points_file) = parsed;
      if (key == "file") file_text_ = value;
    } else if (key == "reserved") {
      for (const auto w : words(value)) p.reserved += " " + std::string(w);
    } else if (key == "longest_name") {
      whole(p.caps.max_name, 4, 1000);
    } else if (key == "max_points") {
      whole(p.caps.max_points, 0, 100000000);
    } else if (key == "max_lines") {
      whole(p.caps.max_lines, 0, 100000000);
    } else if (key == "longest_line") {
      whole(p.longest_line, 0, 100000);
    } else if (key == "digits") {
      whole(p.digits, 0, 12);
    } else if (key == "indent") {
      whole(p.indent, 0, 16);
    } else if (key == "length_unit") {
      real(
          p.length,
          "How much a mm is in the controller's unit: 0.001 for metres, 0.03937007874 for inches.");
    } else if (key == "angle_unit") {
      real(p.angle, "How much a degree is in the controller's unit: 0.01745329252 for radians.");
    } else if (key == "between_joints") {
      p.separator = unquoted(value);
    } else if (key == "between_values") {
      p.between_values = unquoted(value);
    } else if (key == "text_sign") {
      p.text_sign = value;
    } else if (key == "true") {
      p.true_word = value;
    } else if (key == "false") {
      p.false_word = value;
    } else if (key == "points_numbered") {
      yes_or_no(p.are_points_numbered);
    } else if (key == "case_matters") {
      yes_or_no(p.caps.case_matters);
    } else if (key == "real_exponent") {
      yes_or_no(p.has_exponents);
    } else if (key == "real_point") {
      yes_or_no(p.has_real_point);
    } else if (key == "real_digits") {
      whole(p.real_digits, 0, 17);
    } else if (key == "decimal_sign") {
      if (value != "." && value != ",") return say(at, "\"decimal_sign\" is . or ,");
      p.decimal_sign = value.front();
    } else if (key == "quotes") {
      using Quotes = TemplatePack::Quotes;
      if (value == "doubled") p.quotes = Quotes::doubled;
      else if (value == "backslash") p.quotes = Quotes::backslash;
      else if (value == "refused") p.quotes = Quotes::refused;
      else say(at, "\"quotes\" must be doubled, backslash or refused");
      quotes_at_ = place_of(at);
    } else if (key == "name_signs") {
      name_signs(at);
    } else if (key == "angles") {
      angles_at_ = place_of(at);
      p.angles.clear();
      for (const auto w : words(value)) {
        if (w == "none") continue;
        if (w.size() != 1 || w[0] < 'a' || w[0] > 'd')
          return say(w, "\"angles\" are those of a, b, c and d that are written, or none",
                     "Such as angles: c, for a controller that only turns about one axis.");
        p.angles += w;
      }
    } else if (key == "line_numbers") {
      has_line_numbers_ = true;
      const auto both = words(value);
      const bool is_pair = both.size() == 2;
      const int first = is_pair ? number<int>(both[0]).value_or(-1) : -1;
      const int step = is_pair ? number<int>(both[1]).value_or(-1) : -1;
      if (first < 0 || step < 1 || first > 1000000 || step > 1000000)
        return say(at, "\"line_numbers\" is the first number and the step, such as 10 10");
      p.first_number = first;
      p.number_step = step;
    } else if (key == "line_number") {
      // A name of the target would not stand in quotes; blanks at the end of a line would be lost.
      const bool is_quoted = value.size() >= 2 && value.front() == '"' && value.back() == '"';
      p.line_number =
          parse(is_quoted ? value.substr(1, value.size() - 2) : at, "line", "line_number");
      has_line_number_ = true;
    } else if (key == "line_ending") {
      if (value != "lf" && value != "crlf") return say(at, "\"line_ending\" must be lf or crlf");
      p.caps.crlf = value == "crlf";
    } else if (key == "characters") {
      if (value == "ascii") p.caps.charset = PostCharset::ascii;
      else if (value == "utf8") p.caps.charset = PostCharset::utf8;
      else say(at, "\"characters\" must be ascii or utf8");
    } else if (key == "case") {
      if (value == "upper") p.caps.name_case = PostCase::upper;
      else if (value == "lower") p.caps.name_case = PostCase::lower;
      else if (value == "kept") p.caps.name_case = PostCase::kept;
      else say(at, "\"case\" must be kept, upper or lower");
    } else if (key == "points") {
      if (value == "before") p.points = TemplatePack::Points::before;
      else if (value == "behind") p.points = TemplatePack::Points::behind;
      else if (value == "file") p.points = TemplatePack::Points::file;
      else say(at, "\"points\" must be before, behind or file");
    } else if (key == "forms") {
      p.caps.forms = 0;
      for (const auto w : words(value)) {
        if (w == "structured") p.caps.forms |= kPostStructured;
        else if (w == "flat") p.caps.forms |= kPostFlat;
        else
          say(w, "there is no form \"" + std::string(w) + "\"", "Forms are structured and flat.");
      }
      if (p.caps.forms == 0) say(at, "it has no form: forms: structured, flat");
    } else if (key == "orientation") {
      for (const auto& [word, o] : kOrientations)
        if (word == value) {
          p.orientation = o;
          return;
        }
      say(at, "there is no orientation \"" + std::string(value) + "\"",
          instead(value, first_of(kOrientations)));
    } else if (key == "features") {
      for (const auto w : words(value)) {
        bool found = false;
        for (const auto& [word, bits] : kFeatures)
          if (word == w) {
            p.caps.features |= bits;
            features_.try_emplace(std::string(w), place_of(w));
            found = true;
          }
        if (!found)
          say(w, "there is no feature \"" + std::string(w) + "\"", instead(w, first_of(kFeatures)));
      }
    } else if (key == "motions") {
      for (const auto w : words(value)) {
        bool found = false;
        for (const auto& [word, bits] : kMotions)
          if (word == w) {
            p.caps.motions |= bits;
            if (bits == kPostCircle) p.caps.circle = PostCircle::via;
            features_.try_emplace(std::string(w), place_of(w));
            found = true;
          }
        if (!found)
          say(w, "there is no motion \"" + std::string(w) + "\"", instead(w, first_of(kMotions)));
      }
    }
  }
  /// What names are made of: `letters digits _`.
  void name_signs(std::string_view value) {
    constexpr std::string_view kSigns = "_-.$#@%&!?~^*+<>=";
    TemplatePack& p = *pack_;
    p.name_signs.clear();
    p.have_names_digits = false;
    bool has_letters = false;
    for (std::string_view rest = value; !(rest = trim(rest)).empty();) {
      const std::string_view w = rest.substr(0, std::min(rest.find_first_of(" \t"), rest.size()));
      rest.remove_prefix(w.size());
      if (w == "letters") has_letters = true;
      else if (w == "digits") p.have_names_digits = true;
      else if (w.size() != 1 || kSigns.find(w) == std::string_view::npos)
        say(w, text::quote(std::string(w)) + " cannot be in names",
            "\"name_signs\" are letters, digits and the signs _ - . $ # @ % & ! ? ~ ^ * + < > =, "
            "with blanks between them.");
      else if (p.name_signs.find(w) == std::string::npos) p.name_signs += w;
    }
    if (!has_letters)
      say(value, "names without letters are impossible",
          "Such as name_signs: letters digits _, or write {{number}} in place of names.");
  }
  static std::string unquoted(std::string_view s) {
    if (s.size() >= 2 && s.front() == '"' && s.back() == '"') s = s.substr(1, s.size() - 2);
    return std::string(s);
  }

  // ---- sections ----
  const Construct* begin(const std::string& section, std::string_view at) {
    if (section == "operators") return nullptr;
    const Construct* known = construct(section);
    if (!known) {
      std::vector<std::string> all;
      for (const Construct& c : kConstructs) all.emplace_back(c.name);
      all.emplace_back("operators");
      const std::string near = text::did_you_mean(section, all);
      say(at, "there is no construct \"" + section + "\"",
          near.empty() ? "docs/plugin_author/post_templates.md lists them." : near);
      return nullptr;
    }
    const auto [it, is_new] = owners_.try_emplace(section, Owner{file_, depth_, place_of(at)});
    if (!is_new) {
      // A file's own template takes the place of what the files that it includes have.
      if (it->second.file == file_ || it->second.depth <= depth_) {
        say(at, "the construct \"" + section + "\" already has a template",
            it->second.file == file_ ? std::string("Keep one of them.")
                                     : "The other one is in " + it->second.file + ".");
        return it->second.file == file_ ? known : nullptr;
      }
      it->second = {file_, depth_, place_of(at)};
    }
    pack_->templates[section].clear();
    return known;
  }
  /// OPERATOR "spelling" BINDING [prefix|call]
  void operation(std::string_view line) {
    line = trim(line);
    if (line.empty()) return;
    const std::size_t blank = std::min(line.find(' '), line.size());
    const std::string_view word = line.substr(0, blank);
    std::string_view rest = trim(line.substr(blank));
    const std::size_t quote = rest.size() > 1 ? rest.find('"', 1) : std::string_view::npos;
    if (rest.empty() || rest.front() != '"' || quote == std::string_view::npos)
      return say(line, "an operator must be: OPERATOR \"SPELLING\" BINDING, such as + \" + \" 50");
    std::string spelling(rest.substr(1, quote - 1));
    const std::string_view own = rest.substr(1, quote - 1);
    const bool is_pattern = own.find("{{") != std::string_view::npos;
    const auto behind = words(rest.substr(quote + 1));
    auto binding = behind.empty() ? std::nullopt : number<int>(behind[0]);
    if (is_pattern && behind.empty()) binding = 99;
    if (!binding || *binding < 1 || *binding > 99)
      return say(behind.empty() ? line.substr(line.size()) : behind[0],
                 "how strongly " + std::string(word) + " binds is a number from 1 to 99");
    post::Operator o;
    o.binding = *binding;
    if (behind.size() > 1 && behind[1] == "prefix") o.form = post::Operator::prefix_group;
    else if (behind.size() > 1 && behind[1] == "call") o.form = post::Operator::call;
    else if (behind.size() > 1) return say(behind[1], "only prefix or call may follow the binding");
    TemplateLine pattern;
    if (is_pattern) {
      pattern = parse(own, "a b", "operators");
      const bool is_one = word == "-x" || word == "NOT";
      const Template all{pattern};
      if (!uses(&all, {"a"}) || uses(&all, {"b"}) == is_one)
        return say(own,
                   std::string(word) +
                       (is_one ? " has one operand: {{a}}" : " has two operands: {{a}} and {{b}}"),
                   is_one ? "Such as \"(not {{a}})\"." : "Such as \"(+ {{a}} {{b}})\".");
      if (behind.size() > 1)
        return say(behind[1], "only the binding may follow an operator with {{a}}");
    }
    // Words between names and numbers stand by themselves.
    const auto is_letter = [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_';
    };
    if (o.form == post::Operator::infix && !is_pattern && !spelling.empty()) {
      if (is_letter(spelling.front())) spelling.insert(0, 1, ' ');
      if (is_letter(spelling.back())) spelling += ' ';
    }
    o.spelling = pack_->spellings.emplace_back(spelling).c_str();
    for (const auto& [name, op] : kOperators)
      if (name == word) {
        o.op = op;
        const auto [it, is_new] = operator_owners_.try_emplace(op, Owner{file_, depth_, {}});
        // A file's own takes the place of what the files that it includes have.
        if (!is_new && it->second.depth <= depth_)
          return say(word, "the operator \"" + std::string(word) + "\" is given twice",
                     it->second.file == file_ ? std::string("Keep one of them.")
                                              : "The other one is in " + it->second.file + ".");
        it->second = Owner{file_, depth_, {}};
        std::erase_if(pack_->operators,
                      [&](const post::Operator& other) { return other.op == o.op; });
        pack_->operators.push_back(o);
        pack_->patterns.erase(o.op);
        if (is_pattern) pack_->patterns[o.op] = {std::move(pattern), o.binding};
        return;
      }
    say(word, "there is no operator \"" + std::string(word) + "\"",
        "There are " + text::enumerate(first_of(kOperators)) + ".");
  }

  // ---- templates ----
  static bool is_variable(std::string_view name, std::string_view variables) {
    for (const auto w : words(variables))
      if (w == name) return true;
    if (name == "open" || name == "close") return true;  // {{ and }} themselves
    // joints are also there one by one.
    return name.size() > 1 && (name[0] == 'q' || name[0] == 'e') &&
           number<int>(name.substr(1)).value_or(0) > 0 &&
           variables.find("joints") != std::string_view::npos;
  }
  static std::vector<std::string> names_of(std::string_view variables) {
    std::vector<std::string> out;
    for (const auto w : words(variables)) out.emplace_back(w);
    return out;
  }
  /// Whether one of the words is a variable that may be asked for: then it is meant as a condition.
  static bool is_about(std::string_view inner, const std::vector<std::string>& variables) {
    if (inner.find("{{") != std::string_view::npos) return false;
    for (const auto w : words(inner))
      if (w.size() > 1 && std::find(variables.begin(), variables.end(), w) != variables.end())
        return true;
    return false;
  }
  void condition(std::string_view& line, std::string_view variables, TemplateLine& out) {
    const std::size_t end = line.find(']');
    std::string_view inner = line.substr(1, std::min(end, line.size()) - 1);
    if (end == std::string_view::npos)
      inner = inner.substr(0, inner.find(' ', inner.starts_with("not ") ? 4 : 0));
    std::string_view name = inner;
    const bool is_not = name.starts_with("not ");
    if (is_not) name = trim(name.substr(4));
    const bool is_word = !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || c == '_' || (c >= '0' && c <= '9');
    });
    const auto all = names_of(variables);
    const bool is_known = std::find(all.begin(), all.end(), name) != all.end();
    if (end != std::string_view::npos && is_known) {
      out.is_not = is_not;
      out.condition = name;
      line.remove_prefix(end + 1);
      if (line.starts_with(" ")) line.remove_prefix(1);
      if (line.starts_with("\\")) return line.remove_prefix(1);
      const std::string_view second = line.substr(0, std::min(line.find(']'), line.size()));
      if (line.starts_with("[") && second.size() < line.size() && is_about(second.substr(1), all))
        say(second, "a line can have only one condition",
            "Write two lines, or \\ before a [ of the controller's language.");
      return;
    }
    // [ may be the controller's own; what looks like a condition is none by mistake.
    const auto near = is_word ? text::nearest(name, all) : std::nullopt;
    if (end == std::string_view::npos && is_known)
      say(line, "[ is not closed by ]", "Write [" + std::string(inner) + "] before the text.");
    else if (is_not || near || is_about(inner, all))
      say(name,
          "\"" + std::string(name) +
              "\" is not a variable of this construct, so it cannot be a condition",
          (near ? "Did you mean [" + *near + "]? " : std::string()) +
              "Begin the line with \\ if the controller's line begins with [.");
  }
  TemplateLine parse(std::string_view line, std::string_view variables,
                     const std::string& section) {
    TemplateLine out;
    if (line.starts_with("\\")) line.remove_prefix(1);
    else if (line.starts_with("[")) condition(line, variables, out);
    while (!line.empty()) {
      const std::size_t open = line.find("{{"), close = line.find("}}");
      if (close < open) {
        say(line.substr(close), "}} has no {{ before it",
            "Write {{close}} for the character itself.");
        line.remove_prefix(close + 2);
        continue;
      }
      if (open != 0) {
        out.pieces.push_back({std::string(line.substr(0, open)), false, {}});
        line.remove_prefix(std::min(open, line.size()));
        continue;
      }
      const std::size_t next = line.find("{{", 2);
      if (close == std::string_view::npos || next < close) {
        say(line, "{{ is not closed by }}", "Write {{open}} for the character itself.");
        break;
      }
      std::string_view inner = line.substr(2, close - 2);
      line.remove_prefix(close + 2);
      out.pieces.push_back(piece(inner, variables, section));
    }
    return out;
  }
  Piece piece(std::string_view inner, std::string_view variables, const std::string& section) {
    Piece piece;
    piece.is_variable = true;
    std::size_t bar = std::min(inner.find('|'), inner.size());
    const std::string_view name = trim(inner.substr(0, bar));
    piece.text = name;
    if (name == "open" || name == "close") return {name == "open" ? "{{" : "}}", false, {}};
    if (!is_variable(name, variables)) {
      const auto all = names_of(variables);
      std::string near = text::did_you_mean(name, all);
      if (name.starts_with("end_") && section == "circle")
        near = "The end's are point, point_number, x, y, z, a, b, c and d.";
      if (near.empty() && !all.empty()) near = "It has " + text::enumerate(all) + ".";
      say(name.empty() ? inner : name,
          "\"" + section + "\" has no variable \"" + std::string(name) + "\"", near);
    }
    while (bar < inner.size()) {
      inner.remove_prefix(bar + 1);
      bar = std::min(inner.find('|'), inner.size());
      const std::string_view f = trim(inner.substr(0, bar));
      const std::size_t colon = std::min(f.find(':'), f.size());
      Filter filter{std::string(f.substr(0, colon)), 0};
      if (std::find(std::begin(kFilters), std::end(kFilters), filter.name) == std::end(kFilters)) {
        say(f.empty() ? inner : f, "there is no filter \"" + filter.name + "\"",
            instead(filter.name, kFilters));
        continue;
      }
      const auto is_in = [&](const auto& list) {
        return std::find(std::begin(list), std::end(list), name) != std::end(list);
      };
      if (!is_of_text(filter.name) && is_in(kTexts))
        say(f,
            "the filter " + filter.name + " needs a number, and " + std::string(name) +
                " is a text",
            name == "joints" ? "Write {{q1|fixed:2}}, {{q2|fixed:2}} and so on."
                             : "Remove the filter.");
      if (is_in(kMarks))
        say(f, std::string(name) + " has no filters: it is a number known only at the end",
            "Remove the filter.");
      const bool wants = filter.name != "upper" && filter.name != "lower" && filter.name != "sign";
      const auto by = colon < f.size() ? number<double>(f.substr(colon + 1)) : std::nullopt;
      if (!wants && colon < f.size()) say(f, "the filter " + filter.name + " has no number");
      if (wants && !by) {
        say(f, "the filter " + filter.name + " needs a number: " + filter.name + ":2");
      } else if (wants) {
        const bool is_real = filter.name == "times" || filter.name == "plus";
        const double most = is_real ? 1e12 : is_of_text(filter.name) ? 200 : 12;
        if (!(std::fabs(*by) <= most) || (!is_real && (*by < 0 || *by != std::floor(*by))))
          say(f, "the filter " + filter.name + " takes " +
                     (is_real ? "a number up to 1e12"
                              : "a whole number from 0 to " + text::print_rounded(most)));
        filter.by = *by;
      }
      piece.filters.push_back(filter);
    }
    return piece;
  }

  // ---- the whole ----
  static std::string of(const Construct& c) {
    const bool is_motion = std::any_of(std::begin(kMotions), std::end(kMotions),
                                       [&](const auto& m) { return m.first == c.feature; });
    return (is_motion ? "the motion " : "the feature ") + std::string(c.feature);
  }
  /// A place that is written by numbers has all of them.
  void whole_place(const Construct& c, const Template& t, std::string_view group, const Place& at) {
    const auto writes = [&](std::string_view variable) {
      for (const TemplateLine& l : t)
        for (const Piece& p : l.pieces)
          if (p.is_variable && p.text == variable) return true;
      return false;
    };
    const auto lost = [&](const std::string& variable) {
      say(at,
          "the template \"" + std::string(c.name) + "\" does not write {{" + variable +
              "}}, which would be lost",
          variable.size() == 1 && variable[0] <= 'd'
              ? "Write it, or list the controller's angles in the head: angles: none."
              : "Write it where the controller's line needs it.");
    };
    bool is_by_joints = false;
    for (const char kind : {'q', 'e'}) {
      std::size_t last = 0;
      for (const TemplateLine& l : t)
        for (const Piece& p : l.pieces)
          if (p.is_variable) last = std::max(last, joint_number(p.text, kind));
      is_by_joints = is_by_joints || last > 0;
      for (std::size_t i = 1; i < last; ++i)
        if (!writes(kind + std::to_string(i))) lost(kind + std::to_string(i));
    }
    const bool is_via = group.starts_with("via");
    if (is_by_joints || writes("joints") ||
        (is_via ? writes("via") || writes("via_number")
                : writes("point") || writes("point_number") || writes("end")))
      return;
    const std::string before = is_via ? "via_" : "";
    for (const char axis : {'x', 'y', 'z'})
      if (!writes(before + axis)) lost(before + axis);
    if (!is_via)  // that of an arc is between its ends' anyway
      for (const char angle : pack_->angles)
        if (!writes(std::string(1, angle))) lost(std::string(1, angle));
  }
  /// Names of points say where they are elsewhere.
  void names_are_told(const Construct& c, const Place& at) {
    const Template* t = pack_->find(c.name);
    const bool is_joints = c.name == "ptp_joints";
    const char* of = is_joints ? "point_joints" : "point";
    if (!t || pack_->find(of)) return;
    for (const TemplateLine& l : *t)
      for (const Piece& p : l.pieces)
        if (p.is_variable && (p.text == "point" || p.text == "point_number" || p.text == "via" ||
                              p.text == "via_number" || p.text == "end"))
          return say(at,
                     "the template \"" + std::string(c.name) + "\" writes {{" + p.text +
                         "}}, and there is no template \"" + of + "\" that writes its position",
                     std::string("Write the section == ") + of + ", or the numbers themselves.");
  }
  /// Says what a template does not write of its construct.
  void loses_nothing(const Construct& c, const Place& at) {
    const Template* t = pack_->find(c.name);
    if (!t || c.needs.empty()) return;
    if (t->empty())
      return say(at,
                 "the template \"" + std::string(c.name) +
                     "\" writes nothing, so the statement would be lost",
                 "Write the controller's line for it.");
    const auto is_one = [](std::string_view variable, std::string_view group) {
      if (variable.size() > 1 && (variable[0] == 'q' || variable[0] == 'e') &&
          number<int>(variable.substr(1)))
        variable = "q";
      for (const auto word : text::split(group, '|'))
        if (word == variable) return true;
      return false;
    };
    for (const auto group : words(c.needs)) {
      bool is_there = group == "!";
      for (const TemplateLine& l : *t)
        for (const Piece& piece : l.pieces)
          is_there = is_there || (piece.is_variable && is_one(piece.text, group));
      if (is_there) {
        if (group.starts_with("via") || group.ends_with("|q") || group.ends_with("|z"))
          whole_place(c, *t, group, at);
        continue;
      }
      std::vector<std::string> all;
      for (const auto word : text::split(group, '|'))
        all.push_back("{{" + (word == "q" ? std::string("q1") : std::string(word)) + "}}");
      const std::string either = all.size() == 1 ? all[0] : "one of " + text::enumerate(all);
      say(at,
          "the template \"" + std::string(c.name) + "\" does not write " + either +
              ", which would be lost",
          "Write it where the controller's line needs it.");
    }
  }
  // ---- what could be read in two senses ----
  /// Place of a key of the head; of the head itself where the pack leaves it out.
  [[nodiscard]] Place place_of_key(const std::string& key, const Place& head) const {
    const auto it = keys_at_.find(key);
    return it == keys_at_.end() ? head : it->second;
  }
  static bool is_digit_sign(char c) { return c >= '0' && c <= '9'; }
  static bool is_letter_sign(char c) { return (c | 32) >= 'a' && (c | 32) <= 'z'; }
  /// Whether a character may be the first or last one of a number.
  [[nodiscard]] bool is_of_number(char c) const {
    return is_digit_sign(c) || c == '+' || c == '-' || c == pack_->decimal_sign;
  }
  [[nodiscard]] bool is_of_name(char c) const {
    return is_letter_sign(c) || is_digit_sign(c) || pack_->name_signs.find(c) != std::string::npos;
  }
  /// Variables that are always numbers.
  static bool is_number(std::string_view variable) {
    constexpr std::string_view kNumbers[] = {
        "speed",        "speed_m", "speed_ori",    "speed_ptp", "speed_percent",
        "acc",          "blend",   "blend_ptp",    "time",      "seconds",
        "milliseconds", "number",  "point_number", "line"};
    if (joint_number(variable, 'q') > 0 || joint_number(variable, 'e') > 0) return true;
    if (variable.starts_with("via_")) variable.remove_prefix(4);
    return (variable.size() == 1 && std::string_view("xyzabcd").find(variable) != variable.npos) ||
           std::find(std::begin(kNumbers), std::end(kNumbers), variable) != std::end(kNumbers);
  }
  static bool has_filter(const Piece& p, std::initializer_list<std::string_view> names) {
    return std::any_of(p.filters.begin(), p.filters.end(), [&](const Filter& f) {
      return std::find(names.begin(), names.end(), f.name) != names.end();
    });
  }
  [[nodiscard]] bool some_writes(std::string_view variable) const {
    return std::any_of(pack_->templates.begin(), pack_->templates.end(),
                       [&](const auto& t) { return uses(&t.second, {variable}); });
  }
  /// Why numbers with `between` between them cannot be told apart; "" = they can.
  [[nodiscard]] std::string joins_numbers(std::string_view between) const {
    if (between.empty()) return "nothing is between two numbers";
    const std::string_view core = trim(between);
    if (core.empty()) return {};
    for (const char c : {core.front(), core.back()})
      if (is_of_number(c)) {
        const std::string sign = text::quote(std::string(1, c));
        return c == pack_->decimal_sign ? sign + " is also the decimal sign"
                                        : sign + " may be part of a number";
      }
    return {};
  }
  void ambiguous_separators(const Place& head) {
    const TemplatePack& p = *pack_;
    if (some_writes("joints"))
      if (const std::string why = joins_numbers(p.separator); !why.empty())
        say(place_of_key("between_joints", head),
            "\"between_joints\" is " + text::quote(p.separator) + ", and " + why,
            "Such as between_joints: \"; \".");
    if (some_writes("values")) {
      std::string why = joins_numbers(p.between_values);
      const std::string_view core = trim(p.between_values);
      if (why.empty() && !core.empty() && (is_of_name(core.front()) || is_of_name(core.back())))
        why = "names also contain such characters";
      if (why.empty() && !p.text_sign.empty() &&
          p.between_values.find(p.text_sign) != std::string::npos)
        why = "text_sign " + text::quote(p.text_sign) + " is in it";
      if (!why.empty())
        say(place_of_key("between_values", head),
            "\"between_values\" is " + text::quote(p.between_values) + ", and " + why,
            "Such as between_values: \"; \".");
    }
    if (std::any_of(p.text_sign.begin(), p.text_sign.end(),
                    [&](char c) { return is_of_name(c) || c == ' ' || is_of_number(c); }))
      say(place_of_key("text_sign", head),
          "\"text_sign\" is " + text::quote(p.text_sign) +
              ", which numbers or names may also contain",
          "Such as text_sign: '.");
    const auto folded = [&](const std::string& s) {
      return p.caps.case_matters ? s : post::upper(s);
    };
    if (folded(p.true_word) == folded(p.false_word))
      say(place_of_key("true", place_of_key("false", head)),
          "\"true\" and \"false\" are both " + text::quote(p.true_word), "Give two words.");
  }
  void ambiguous_line_numbers(const Place& head) {
    if (!has_line_numbers_) return;
    const TemplatePack& p = *pack_;
    const Place at = place_of_key("line_number", head);
    const std::vector<Piece>& pieces = p.line_number.pieces;
    const auto number = std::find_if(pieces.begin(), pieces.end(),
                                     [](const Piece& piece) { return piece.is_variable; });
    if (number == pieces.end())
      return say(at, "\"line_number\" does not write {{line}}",
                 "Such as line_number: \"N{{line}} \".");
    if (number != pieces.begin() && is_of_number(std::prev(number)->text.back()))
      return say(at,
                 "\"line_number\" has " + text::quote(std::prev(number)->text) +
                     " before {{line}}, which would become part of the number",
                 "Such as line_number: \"N{{line}} \".");
    if (const auto behind = std::next(number); behind != pieces.end()) {
      if (behind->is_variable || is_of_number(behind->text.front()))
        say(at,
            "\"line_number\" has " + text::quote(behind->text) +
                " behind {{line}}, which would become part of the number",
            "Such as line_number: \"N{{line}} \".");
      return;
    }
    for (const auto& [name, lines] : p.templates)
      for (const TemplateLine& l : lines)
        if (!l.pieces.empty() &&
            (l.pieces.front().is_variable || is_of_number(l.pieces.front().text.front())))
          return say(at,
                     "\"line_number\" has nothing behind {{line}}, and a line of the template \"" +
                         name + "\" may begin with a digit",
                     "Write a blank behind it: line_number: \"{{line}} \".");
  }
  void ambiguous_operators(const Place& head) {
    const TemplatePack& p = *pack_;
    const auto word_of = [](std::uint32_t op) {
      for (const auto& [word, o] : kOperators)
        if (o == op) return std::string(word);
      return std::string("?");
    };
    const auto may_share = [](std::uint32_t a, std::uint32_t b) {
      const auto is_pair = [&](std::uint32_t x, std::uint32_t y) {
        return (a == x && b == y) || (a == y && b == x);
      };
      // Their operands tell them apart: INT or REAL; numbers or BOOL.
      return is_pair(RMP_EXPR_DIVIDE, RMP_EXPR_DIV) || is_pair(RMP_EXPR_NOT_EQUAL, RMP_EXPR_EXOR);
    };
    for (auto a = p.operators.begin(); a != p.operators.end(); ++a) {
      if (p.patterns.contains(a->op)) continue;
      const std::string_view spelling = a->spelling;
      if (a->form == post::Operator::call && p.decimal_sign == ',')
        say(head,
            "the operator \"" + word_of(a->op) +
                "\" is a call, with commas between operands, but the decimal sign is also a comma",
            "Write it with {{a}} and {{b}}: \"" + std::string(trim(spelling)) +
                "({{a}}; {{b}})\".");
      if (a->form != post::Operator::infix || spelling.empty()) continue;
      for (const char c : {spelling.front(), spelling.back()})
        if (p.name_signs.find(c) != std::string::npos) {
          say(head,
              "the operator \"" + word_of(a->op) + "\" is written " +
                  text::quote(std::string(spelling)) + ", but names may contain " +
                  text::quote(std::string(1, c)) + " as well",
              "Write blanks around it: \" " + std::string(trim(spelling)) + " \".");
          break;
        }
      for (auto b = std::next(a); b != p.operators.end(); ++b)
        if (b->form == a->form && !p.patterns.contains(b->op) && !may_share(a->op, b->op) &&
            trim(b->spelling) == trim(spelling))
          say(head,
              "the operators \"" + word_of(a->op) + "\" and \"" + word_of(b->op) +
                  "\" are both written " + text::quote(std::string(trim(spelling))),
              "Give each a different spelling.");
    }
  }
  void ambiguous_templates() {
    const TemplatePack& p = *pack_;
    for (const auto& [name, lines] : p.templates) {
      const Place& at = owners_[name].at;
      const auto no = [&](const std::string& what, std::string hint) {
        say(at, "the template \"" + name + "\" " + what, std::move(hint));
      };
      for (const TemplateLine& l : lines)
        for (std::size_t i = 0; i < l.pieces.size(); ++i) {
          const Piece& a = l.pieces[i];
          if (!a.is_variable || !is_number(a.text)) continue;
          const bool is_next = i + 1 < l.pieces.size() && l.pieces[i + 1].is_variable;
          const std::size_t second = i + (is_next ? 1 : 2);
          if (second >= l.pieces.size() || !l.pieces[second].is_variable ||
              !is_number(l.pieces[second].text))
            continue;
          const Piece& b = l.pieces[second];
          const std::string both = "{{" + a.text + "}} and {{" + b.text + "}}";
          if (is_next && !has_filter(b, {"pad", "zeros", "sign"}) && !has_filter(a, {"left"})) {
            no("writes " + both + " without a separator",
               "Write a separator, or give them a width (pad:8).");
            return;
          }
          if (is_next) continue;
          const std::string_view core = trim(l.pieces[i + 1].text);
          if (!core.empty() && core.size() == 1 && core.front() == p.decimal_sign) {
            no("writes " + text::quote(std::string(core)) + " between " + both +
                   ", which is the decimal sign",
               "Write another separator, such as a semicolon, or decimal_sign: .");
            return;
          }
        }
      if (name != "comment") continue;
      for (const TemplateLine& l : lines) {
        if (l.pieces.empty()) continue;
        const Piece& first = l.pieces.front();
        if (first.is_variable && first.text == "text")
          no("begins with its text, which would be read as a statement",
             "Write the controller's comment sign before it.");
        else if (!p.text_sign.empty() && trim(first.text) == p.text_sign)
          no("begins with " + text::quote(p.text_sign) + ", which is text_sign",
             "Use the controller's comment sign and text sign.");
      }
    }
  }
  /// Refuses packs whose text a controller, or a person, could read in two senses.
  void ambiguous(const Place& head) {
    ambiguous_separators(head);
    ambiguous_line_numbers(head);
    ambiguous_operators(head);
    ambiguous_templates();
  }
  void finish(const std::string& where) {
    TemplatePack& p = *pack_;
    const Place head{where};
    if (p.name.empty()) say(head, "it has no name: name: acme");
    for (const char c : p.name)
      if (!((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_')) {
        say(name_at_,
            "the name \"" + p.name + "\" must consist of lower-case letters, digits and _");
        break;
      }
    if (p.title.empty()) p.title = p.name.empty() ? "?" : p.name;
    if (p.caps.motions == 0) say(head, "it has no motions: motions: ptp_joints lin");
    for (const Construct& c : kConstructs) {
      const auto feature = features_.find(std::string(c.feature));
      const auto owner = owners_.find(std::string(c.name));
      if (c.feature == "-") continue;
      if (!c.feature.empty() && feature == features_.end()) {
        if (owner != owners_.end() && owner->second.depth == 0)
          say(owner->second.at,
              "the template \"" + std::string(c.name) + "\" is of " + of(c) +
                  ", which the head does not list",
              "Add it there, or remove the template.");
        continue;
      }
      if (owner == owners_.end())
        say(c.feature.empty() ? head : feature->second,
            "there is no template \"" + std::string(c.name) + "\", which " +
                (c.feature.empty() ? std::string("every target needs") : of(c) + " needs"),
            "Write the section == " + std::string(c.name) + ".");
    }
    if (p.orientation == post::Orientation::quaternion && !angles_at_) p.angles = "abcd";
    if (p.angles.find('d') != std::string::npos && p.orientation != post::Orientation::quaternion)
      say(*angles_at_, "d is the fourth number of a quaternion",
          "Remove it, or write orientation: quaternion.");
    for (const auto& [name, owner] : owners_)
      if (const Construct* c = construct(name)) {
        loses_nothing(*c, owner.at);
        names_are_told(*c, owner.at);
      }
    if (const auto f = features_.find("variables"); f != features_.end() && p.operators.empty())
      say(f->second, "there is no section \"operators\", which the feature variables needs");
    if (const auto f = features_.find("elsif"); f != features_.end() && !features_.contains("if"))
      say(f->second, "the feature elsif needs the feature if", "Write features: if elsif.");
    if (const auto f = features_.find("jumps"); f != features_.end() && !features_.contains("goto"))
      say(f->second, "the feature jumps needs the feature goto, since it also writes its templates",
          "Write features: goto jumps.");
    if (const auto f = features_.find("inputs"); f != features_.end())
      if (const Template* input = p.find("input"); input && input->size() != 1)
        say(owners_["input"].at,
            "the template \"input\" must be one line, since expressions contain it");
    if (p.find("point") && (p.caps.motions & kPostPtpJoints) && !p.find("point_joints"))
      say(owners_["point"].at,
          "there is no template \"point_joints\", which \"point\" needs beside it");
    if (p.points == TemplatePack::Points::file && !p.find("point"))
      say(head, "points are in a separate file, but there is no template \"point\"",
          "Write the section == point, or remove points: file.");
    if ((p.points == TemplatePack::Points::file) != !p.points_file.pieces.empty())
      say(head, "\"points: file\" and \"points_file\" belong together",
          "Such as points: file and points_file: {{name}}.pts.");
    if (p.quotes != TemplatePack::Quotes::refused && p.text_sign.empty())
      say(quotes_at_, "\"quotes\" sets how text_sign is written in a text, but text_sign is empty",
          "Give text_sign, or remove quotes.");
    if (has_line_number_ && !has_line_numbers_)
      say(head, "\"line_number\" needs \"line_numbers\": line_numbers: 10 10");
    std::tie(file_, whole_) = std::pair(where, std::string_view());
    line_ = 1;
    if (!has_line_number_) p.line_number = parse("{{line}} ", "line", "line_number");
    if (file_text_.empty()) {
      file_text_ = "{{name}}.txt";
      p.file_name = parse(file_text_, "name", "file");
    }
    ambiguous(head);
    const std::size_t dot = file_text_.rfind('.');
    p.extensions = dot == std::string::npos ? "" : file_text_.substr(dot + 1);
    if (p.extensions.find_first_of("{}|") != std::string::npos) p.extensions.clear();
    p.extensions = post::lower(p.extensions);
    p.caps.title = p.title;
    p.caps.reserved = p.reserved;
    p.caps.extensions = p.extensions;
  }

  struct Owner {
    std::string file;
    int depth = 0;
    Place at;
  };
  const PackFiles& files_;
  std::string file_;
  std::string_view whole_;  ///< the present line
  std::uint32_t line_ = 0;
  int depth_ = 0;
  std::size_t bytes_ = 0;
  bool is_readable_ = true, has_line_number_ = false, has_line_numbers_ = false;
  std::optional<Place> angles_at_;  ///< where the head has them
  std::vector<std::string> open_;   ///< files that are being read, the including ones first
  std::string file_text_;
  Place name_at_, quotes_at_;
  std::set<std::pair<std::string, std::string>> keys_;  ///< file, key
  std::map<std::string, int> key_depths_;               ///< of the file that a key holds of
  std::map<std::string, Place> keys_at_;                ///< values of the head's keys
  std::map<std::string, Place> features_;               ///< and motions
  std::map<std::string, Owner> owners_;                 ///< of the templates
  std::map<std::uint32_t, Owner> operator_owners_;
  std::vector<PackFault> faults_;
  std::shared_ptr<TemplatePack> pack_ = std::make_shared<TemplatePack>();
};

}  // namespace

std::string within_signs(const TemplatePack& p, std::string_view text) {
  if (p.quotes == TemplatePack::Quotes::refused || p.text_sign.empty()) return std::string(text);
  const bool doubles = p.quotes == TemplatePack::Quotes::doubled;
  std::string out;
  while (!text.empty()) {
    const bool is_sign = text.starts_with(p.text_sign);
    if (is_sign) out += doubles ? p.text_sign : "\\";
    else if (!doubles && text.front() == '\\') out += '\\';
    const std::size_t n = is_sign ? p.text_sign.size() : 1;
    out += text.substr(0, n);
    text.remove_prefix(n);
  }
  return out;
}

// ---- names ----

PackNames::PackNames(const TemplatePack& p) : pack_(p) {
  for (const auto w : words(p.reserved)) used_.insert(folded(w));
}
const std::string& PackNames::of(std::uint64_t key, std::string_view wish) {
  const auto [it, is_new] = names_.try_emplace(key);
  if (is_new) it->second = unique(wish);
  return it->second;
}
std::string PackNames::folded(std::string_view s) const {
  return pack_.caps.case_matters ? std::string(s) : post::upper(s);
}
/// What tells the n-th name from the first: digits, or letters where names have none.
std::string PackNames::tail(std::uint64_t n) const {
  if (pack_.have_names_digits) return std::to_string(n);
  std::string out;
  for (; n > 0; n = (n - 1) / 26)
    out.insert(out.begin(),
               static_cast<char>((pack_.caps.name_case == PostCase::upper ? 'A' : 'a') +
                                 static_cast<int>((n - 1) % 26)));
  return out;
}
std::string PackNames::unique(std::string_view wish) {
  const auto is_letter = [](char c) { return (c | 32) >= 'a' && (c | 32) <= 'z'; };
  std::string base;
  for (const char c : wish) {
    const bool is_digit = c >= '0' && c <= '9';
    if (is_letter(c) || (is_digit && pack_.have_names_digits) ||
        pack_.name_signs.find(c) != std::string::npos)
      base += c;
    else if (!is_digit && !pack_.name_signs.empty()) base += pack_.name_signs.front();
  }
  if (base.empty() || !is_letter(base[0])) base = "x" + base;
  if (pack_.caps.name_case == PostCase::upper) base = post::upper(base);
  if (pack_.caps.name_case == PostCase::lower) base = post::lower(base);
  const auto most = static_cast<std::size_t>(std::max(pack_.caps.max_name, 4));
  std::string name = base.substr(0, most);
  if (used_.insert(folded(name)).second) return name;
  // Tails that were given once are not tried again.
  std::uint64_t& n = numbers_.try_emplace(folded(name), 1).first->second;
  do {
    const std::string behind = tail(++n);
    name = base.substr(0, most - std::min(most - 1, behind.size())) + behind;
  } while (!used_.insert(folded(name)).second);
  return name;
}

bool must_say(std::string_view construct) {
  return std::any_of(std::begin(kConstructs), std::end(kConstructs),
                     [&](const Construct& c) { return c.name == construct && !c.needs.empty(); });
}

Result<std::shared_ptr<const TemplatePack>> read_templates(std::string_view text,
                                                           const std::string& where,
                                                           const PackFiles& files,
                                                           std::vector<PackFault>* faults) {
  return Reader(files).read(text, where, faults);
}

}  // namespace robomosp::program_post
