// SPDX-License-Identifier: Apache-2.0
#include "shell/post_test.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <system_error>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/post.h>
#include <robomosp/sdk/post_constructs.h>
#include <robomosp/sdk/program_tables.h>

#include "kernel/plugin_loader.h"
#include "kernel/text.h"
#include "program/trace.h"
#include "remote/json.h"

namespace robomosp::shell {
namespace {

namespace fs = std::filesystem;
using Line = std::function<void(const std::string&)>;

constexpr std::int64_t kSteps = 200'000;  ///< of a construct that is flattened; some run for ever
constexpr std::size_t kWidth = 50;        ///< of a construct in the table

std::string string_in(const Map& m, const char* key) {
  const Value* v = m.find(key);
  return v && v->as_string() ? *v->as_string() : std::string();
}
std::int64_t int_in(const Map& m, const char* key) {
  const Value* v = m.find(key);
  return v && v->as_int() ? *v->as_int() : 0;
}
const List& list_in(const Map& m, const char* key) {
  static const List kNone;
  const Value* v = m.find(key);
  return v && v->as_list() ? *v->as_list() : kNone;
}
Result<std::string> text_of_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    return error(ErrorCode::io, "the file " + text::quote(file.string()) + " cannot be read",
                 "Check its name and permissions.");
  return std::string{std::istreambuf_iterator<char>(in), {}};
}
Result<void> write_text(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (out) return {};
  return error(ErrorCode::io, "the file " + text::quote(file.string()) + " cannot be written",
               "Check the folder's permissions.");
}
/// In any case: names of IRL are those of letters.
bool is_same_name(std::string_view a, std::string_view b) {
  const auto folded = [](char c) { return c >= 'a' && c <= 'z' ? c - 'a' + 'A' : +c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return folded(x) == folded(y); });
}
std::string wide(std::string s, std::size_t width) {
  if (s.size() > width) {
    s.resize(width - 3);
    s += "...";
  }
  return s + std::string(width - s.size(), ' ');
}

/// What program.post gave.
struct Posted {
  bool is_correct = false;
  std::string form;
  std::map<std::string, std::string> files;
  std::string all;        ///< of the faults, to be compared
  std::string said;       ///< the first error, or else the first warning; "" = none
  std::int64_t line = 0;  ///< of that
  bool has_error_without_place = false;
  std::size_t lines() const {
    std::size_t n = 0;
    for (const auto& [name, text] : files)
      n += static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
    return n;
  }
};

class Tester {
 public:
  Tester(ioci::Application& app, const Ask& ask, const PostTest& how, const Line& line, Map& report)
      : app_(app), ask_(ask), how_(how), line_(line), report_(report) {}

  Result<int> run() {
    if (!how_.robot.empty() && how_.robot != "none") {
      RMP_TRY_ASSIGN(robot_, record("robot", ".rbt", how_.robot));
    }
    if (!how_.profile.empty()) {
      RMP_TRY_ASSIGN(profile_, record("controller", ".ctl", how_.profile));
    }
    RMP_TRY_ASSIGN(const std::vector<std::string> targets, targets_of());
    RMP_TRY_ASSIGN(const std::string text,
                   text_of_file(app_.share / "post_test" / "constructs.txt"));
    RMP_TRY_ASSIGN(cases_, post::read_constructs(text));
    RMP_TRY_ASSIGN(programs_, sample_programs());
    List all;
    for (std::size_t i = 0; i < targets.size(); ++i) {
      if (i > 0) line_("");
      Map one;
      RMP_TRY(test(targets[i], one));
      all.emplace_back(std::move(one));
    }
    report_.set("targets", std::move(all));
    return wrong_ > 0 ? 1 : 0;
  }

 private:
  Result<Value> record(const char* kind, const char* extension, const std::string& name) {
    if (name.ends_with(extension)) return ask_("file.load", Map{{"file", name}});
    return ask_((std::string(kind) + ".get").c_str(), Map{{"name", name}});
  }

  // ---- what is tested ----
  Result<std::vector<std::string>> targets_of() {
    const fs::path file = how_.what;
    std::error_code none;
    const auto is_there = [&] { return fs::exists(file, none); };
    const auto from = [&](const fs::path& plugin) {
      std::vector<std::string> out;
      for (const ProviderInfo& info : app_.registry.list(Post::kInterfaceId))
        if (fs::equivalent(fs::path(info.origin), plugin, none)) out.push_back(info.name);
      return out;
    };
    if (file.extension() == ".so") {
      RMP_TRY_ASSIGN(const Value loaded, ask_("plugin.load", Map{{"file", file.string()}}));
      const std::string origin = string_in(*loaded.as_map(), "file");
      auto out = from(origin);
      if (out.empty())
        return error(ErrorCode::invalid_argument,
                     "the plugin " + text::quote(file.string()) + " has no post",
                     "robomosp plugin check lists what it offers.");
      return out;
    }
    if (file.extension() == ".ctl") {
      RMP_TRY_ASSIGN(profile_, ask_("file.load", Map{{"file", file.string()}}));
      return std::vector<std::string>{""};  // the profile's own
    }
    if (file.extension() == ".post") {
      RMP_TRY_ASSIGN(const Value name, ask_("program.add_target", Map{{"file", file.string()}}));
      return std::vector<std::string>{*name.as_string()};
    }
    if (fs::is_directory(file, none)) {
      std::vector<fs::path> packs;
      if (fs::is_regular_file(file / "pack.post", none)) packs.push_back(file);
      else
        for (const auto& entry : fs::directory_iterator(file, none))
          if (entry.path().extension() == ".post" ||
              (entry.is_directory(none) && fs::is_regular_file(entry.path() / "pack.post", none)))
            packs.push_back(entry.path());
      std::sort(packs.begin(), packs.end());
      if (packs.empty())
        return error(ErrorCode::not_found,
                     "the folder " + text::quote(file.string()) + " has no pack of templates",
                     "A pack is a file that ends with .post, or a folder with a file pack.post.");
      std::vector<std::string> out;
      for (const fs::path& pack : packs) {
        RMP_TRY_ASSIGN(const Value name, ask_("program.add_target", Map{{"file", pack.string()}}));
        out.push_back(*name.as_string());
      }
      return out;
    }
    const auto found = app_.registry.find(Post::kInterfaceId, how_.what);
    if (found.ok()) return std::vector<std::string>{found->name};
    if (is_there() || file.has_parent_path())
      return error(ErrorCode::invalid_argument,
                   text::quote(how_.what) + " is not a target that can be tested",
                   "Give the name of a target, a plugin (.so), a pack (.post), its folder, or a "
                   "controller (.ctl).");
    return found.error();
  }
  struct Sample {
    std::string name;
    Value id;
    std::vector<SourceFile> files;
    std::vector<std::string> texts;
  };
  Result<std::vector<Sample>> sample_programs() {
    std::vector<fs::path> files;
    std::error_code failed;
    for (const char* folder : {"post_test", "programs"})
      for (fs::directory_iterator it(app_.share / folder, failed), end; !failed && it != end;
           it.increment(failed))
        if (it->path().extension() == ".irl") files.push_back(it->path());
    std::sort(files.begin(), files.end(),
              [](const fs::path& a, const fs::path& b) { return a.filename() < b.filename(); });
    for (const std::string& own : how_.programs) files.emplace_back(own);
    std::vector<Sample> out;
    for (const fs::path& file : files) {
      RMP_TRY_ASSIGN(const Value id, ask_("program.import", Map{{"file", file.string()}}));
      out.push_back({file.stem().string(), id, {}, {}});
    }
    return out;
  }

  // ---- posting ----
  Result<Posted> post(const std::string& target, const Value& program, const char* form) {
    Map args{{"id", program}, {"check", true}, {"form", form}, {"most_steps", kSteps}};
    if (!target.empty()) args.set("target", target);
    if (robot_) args.set("robot", *robot_);
    if (profile_) args.set("profile", *profile_);
    const auto posted = ask_("program.post", args);
    Posted out;
    if (!posted.ok()) {
      // A program that does not even run through has a place, too.
      const Error& e = posted.error();
      if (e.code == ErrorCode::cancelled) return e;
      const auto parts = text::split(e.where, ':');
      if (parts.size() > 2) out.line = text::read_int(parts[parts.size() - 2]).value_or(0);
      out.said = e.message + ".";
      out.all = e.sentence();
      if (e.code == ErrorCode::plugin_failed) blame(e.sentence());
      return out;
    }
    const Map& m = *posted->as_map();
    const Value* correct = m.find("correct");
    out.is_correct = correct && correct->as_bool() && *correct->as_bool();
    out.form = string_in(m, "form");
    for (const Value& f : list_in(m, "files"))
      out.files[string_in(*f.as_map(), "name")] = string_in(*f.as_map(), "text");
    bool has_error = false;
    for (const Value& each : list_in(m, "faults")) {
      const Map& f = *each.as_map();
      const bool is_error = string_in(f, "severity") == "error";
      const std::int64_t at = int_in(f, "line");
      out.all += string_in(f, "severity") + " " + std::to_string(at) + " " +
                 string_in(f, "message") + "\n";
      out.has_error_without_place = out.has_error_without_place || (is_error && at < 1);
      if (out.said.empty() || (is_error && !has_error)) {
        out.said = string_in(f, "message");
        out.line = at;
      }
      has_error = has_error || is_error;
    }
    return out;
  }
  void blame(const std::string& what) {
    ++wrong_;
    faults_.emplace_back(what);
  }

  Result<void> test(const std::string& target, Map& one) {
    faults_.clear();
    const std::size_t before = wrong_;
    RMP_TRY_ASSIGN(const Value listed, ask_("program.targets", Map{}));
    Map about;
    for (const Value& t : *listed.as_list())
      if (string_in(*t.as_map(), "name") == target) about = *t.as_map();
    forms_.clear();
    for (const char* form : {"flat", "structured"}) {
      const Value* has = about.find(form);
      if (!has || !has->as_bool() || *has->as_bool()) forms_.emplace_back(form);
    }
    const std::string title =
        target.empty() ? how_.what : string_in(about, "title") + " (" + target + ")";
    line_(title +
          (string_in(about, "origin").empty() ? "" : ", from " + string_in(about, "origin")));
    line_("Robot " + (robot_ ? how_.robot : "none") + ", controller " +
          (profile_ ? (how_.profile.empty() ? how_.what : how_.profile) : "without a record") +
          ".");
    one.set("target", target);
    one.set("origin", string_in(about, "origin"));
    RMP_TRY(test_programs(target, one));
    RMP_TRY(test_constructs(target, one));
    line_("");
    if (wrong_ == before) line_("Nothing is wrong.");
    for (const Value& f : faults_) line_("wrong: " + *f.as_string());
    one.set("wrong", faults_);
    if (!how_.reader.empty()) {
      RMP_TRY(write_reader(target));
    }
    return {};
  }

  Result<void> test_programs(const std::string& target, Map& one) {
    line_("");
    line_(wide("program", kWidth) + "form        what becomes of it");
    List all;
    for (const Sample& s : programs_) {
      RMP_TRY_ASSIGN(const Posted p, post(target, s.id, "automatic"));
      RMP_TRY_ASSIGN(const Posted again, post(target, s.id, "automatic"));
      if (p.files != again.files || p.all != again.all)
        blame("the program " + s.name + " gives different files the second time.");
      if (p.has_error_without_place) blame("an error in " + s.name + " has no line: " + p.said);
      std::string names;
      for (const auto& [name, text] : p.files) names += (names.empty() ? "" : ", ") + name;
      const std::string what = p.is_correct ? names + ", " + std::to_string(p.lines()) + " lines"
                                            : "line " + std::to_string(p.line) + ": " + p.said;
      line_("  " + wide(s.name, kWidth - 2) + wide(p.is_correct ? p.form : "refused", 12) + what);
      all.emplace_back(Map{{"name", s.name},
                           {"outcome", p.is_correct ? p.form : "refused"},
                           {"line", p.line},
                           {"message", p.said}});
    }
    one.set("programs", std::move(all));
    return {};
  }

  Result<void> test_constructs(const std::string& target, Map& one) {
    line_("");
    line_(wide("construct", kWidth) + "outcome     at line, and why");
    RMP_TRY_ASSIGN(
        const Value scratch,
        ask_("program.create",
             Map{{"name", "post_test_construct"}, {"source", ""}, {"file_name", "construct.irl"}}));
    std::map<std::string, std::string> without;  // texts by source
    std::map<std::string, std::int64_t> counts;
    List all;
    const auto posted = [&](const std::string& source, const char* form) -> Result<Posted> {
      RMP_TRY(ask_("program.set_file",
                   Map{{"id", scratch}, {"name", "construct.irl"}, {"text", source}}));
      return post(target, scratch, form);
    };
    const auto whole = [](const Posted& p) {
      std::string out;
      for (const auto& [name, text] : p.files) out += name + "\n" + text;
      return out;
    };
    for (const post::ConstructCase& c : cases_) {
      RMP_TRY_ASSIGN(const Posted p, posted(c.source, "automatic"));
      std::string outcome = "refused";
      if (p.is_correct) {
        outcome = p.form == "flat" ? "flat" : "said";
        const auto [it, is_new] = without.try_emplace(p.form + c.without);
        if (is_new) {
          auto nothing = posted(c.without, p.form == "flat" ? "flat" : "structured");
          if (nothing.ok() && nothing->is_correct) it->second = whole(*nothing);
        }
        bool leaves_nothing = whole(p) == it->second;
        if (leaves_nothing && p.form != "flat") {
          // At the end of a program, HALT and RETURN may say what its end says anyway.
          RMP_TRY_ASSIGN(const Posted a, posted(post::followed(c.source), "structured"));
          RMP_TRY_ASSIGN(const Posted b, posted(post::followed(c.without), "structured"));
          leaves_nothing = whole(a) == whole(b);
        }
        // Values that are computed may be the usual ones in a run.
        const bool is_asked = p.form != "flat" || c.text.find(" := r") == std::string::npos;
        if (!leaves_nothing && !c.bare.empty() && p.all.empty() && is_asked) {
          const auto bare = posted(c.bare, p.form == "flat" ? "flat" : "structured");
          if (bare.ok() && bare->is_correct && whole(*bare) == whole(p)) {
            outcome = "LOST";
            blame("attributes of \"" + c.text +
                  "\" are lost: the files are the same without them, and no fault is reported.");
          }
        }
        // What a flattened program computes is done before it is posted.
        if (leaves_nothing && p.form == "flat") outcome = "computed";
        if (leaves_nothing && p.form != "flat" && p.all.empty()) {
          outcome = "LOST";
          blame("\"" + c.text +
                "\" is lost: the files are the same without it, and no fault is reported.");
        }
      }
      if (p.has_error_without_place) blame("an error at \"" + c.text + "\" has no line: " + p.said);
      if (!p.is_correct && p.said.empty())
        blame("\"" + c.text + "\" is rejected without a message.");
      ++counts[outcome];
      const std::string why =
          p.said.empty() || outcome == "flat" || outcome == "computed" ? "" : p.said;
      if (!how_.brief || outcome == "refused" || outcome == "LOST")
        line_("  " + wide(c.text, kWidth - 2) + wide(outcome, 12) +
              (why.empty() ? "" : std::to_string(p.line) + ": " + why));
      all.emplace_back(
          Map{{"construct", c.text}, {"outcome", outcome}, {"line", p.line}, {"message", p.said}});
    }
    one.set("constructs", std::move(all));
    RMP_TRY(ask_("program.remove", Map{{"id", scratch}}));
    std::string sum;
    Map numbers;
    for (const char* word : {"said", "flat", "computed", "refused", "LOST"}) {
      numbers.set(word, counts[word]);
      sum += (sum.empty() ? "" : ", ") + std::string(word) + " " + std::to_string(counts[word]);
    }
    line_(std::to_string(cases_.size()) + " constructs: " + sum + ".");
    one.set("counts", std::move(numbers));
    return {};
  }

  // ---- a reader's skeleton ----
  static List numbers(std::span<const double> v) {
    List out;
    for (const double x : v) out.emplace_back(x);
    return out;
  }
  static Map place(const program::PlainPose& p) {
    const auto& q = p.quaternion;
    return Map{{"position", numbers(p.position)}, {"quaternion", numbers(q)}};
  }
  /// A signal as the controller has it: its number, and whether it is the other way round.
  struct Wire {
    std::int64_t number = 0;
    bool is_inverted = false;
  };
  Wire wire_of(const rmp_code_symbol& s) const {
    Wire out{s.address, false};
    for (const Value& each : signals_) {
      const Map& m = *each.as_map();
      if (!is_same_name(string_in(m, "name"), s.name)) continue;
      if (int_in(m, "number") >= 0) out.number = int_in(m, "number");
      const Value* inverted = m.find("is_inverted");
      out.is_inverted = inverted && inverted->as_bool() && *inverted->as_bool();
    }
    return out;
  }
  /// A condition as lists: {"and", a, b}, {"input", NUMBER, BITS}, {"value", v}.
  Value tree(const program::Condition& c, const rmp_code& code) const {
    static const std::map<std::uint32_t, const char*> kWords{
        {RMP_EXPR_NEGATE, "negative"}, {RMP_EXPR_NOT, "not"},          {RMP_EXPR_ADD, "+"},
        {RMP_EXPR_SUBTRACT, "-"},      {RMP_EXPR_MULTIPLY, "*"},       {RMP_EXPR_DIVIDE, "/"},
        {RMP_EXPR_DIV, "div"},         {RMP_EXPR_MOD, "mod"},          {RMP_EXPR_EQUAL, "="},
        {RMP_EXPR_NOT_EQUAL, "<>"},    {RMP_EXPR_LESS, "<"},           {RMP_EXPR_LESS_EQUAL, "<="},
        {RMP_EXPR_GREATER, ">"},       {RMP_EXPR_GREATER_EQUAL, ">="}, {RMP_EXPR_AND, "and"},
        {RMP_EXPR_OR, "or"},           {RMP_EXPR_EXOR, "exor"}};
    std::vector<Value> made;
    for (const program::ConditionNode& n : c.nodes) {
      if (n.op == RMP_EXPR_LITERAL) {
        made.emplace_back(n.type == RMP_TYPE_REAL ? List{"value", n.real}
                                                  : List{"value", n.integer});
      } else if (n.op == RMP_EXPR_SYMBOL) {
        const auto& s = robomosp::row<rmp_code_symbol>(code.symbols, n.symbol);
        const Wire w = wire_of(s);
        const bool is_output = s.kind == RMP_SYMBOL_OUTPUT;
        List one{is_output ? "output" : "input", w.number,
                 s.type == RMP_TYPE_REAL   ? std::int64_t{0}
                 : s.type == RMP_TYPE_BOOL ? std::int64_t{1}
                                           : static_cast<std::int64_t>(std::max(1, s.width))};
        if (w.is_inverted) made.emplace_back(List{"not", std::move(one)});
        else made.emplace_back(std::move(one));
      } else if (n.op == RMP_EXPR_CONVERT) {
        made.push_back(made[n.a]);
      } else {
        const auto word = kWords.find(n.op);
        List one{word == kWords.end() ? "?" : word->second, made[n.a]};
        if (n.b != RMP_NONE) one.push_back(made[n.b]);
        made.emplace_back(std::move(one));
      }
    }
    return made.empty() ? Value(List{"value", std::int64_t{1}}) : made.back();
  }
  Result<List> actions(const program::Trace& trace) const {
    List out;
    const rmp_code& code = trace.program->code();
    for (const program::TraceEntry& e : trace.entries) {
      Map a;
      if (const auto* m = std::get_if<program::TracedMotion>(&e.what)) {
        static constexpr const char* kWords[] = {"ptp", "lin", "circle", "path"};
        const auto& motion = m->motion;
        a.set("do", kWords[std::min<std::uint32_t>(motion.interpolation, 3)]);
        List targets;
        for (std::size_t i = 0; i < motion.targets.size(); ++i) {
          const program::Target& t = motion.targets[i];
          Map one;
          if (i < m->absolute.size() && m->absolute[i]) one = place(*m->absolute[i]);
          if (!t.joints.empty()) one.set("joints", numbers(t.joints));
          if (!t.additional.empty()) one.set("additional", numbers(t.additional));
          targets.emplace_back(std::move(one));
        }
        a.set("targets", std::move(targets));
        const bool is_ptp = motion.interpolation == RMP_MOVE_PTP;
        a.set("speed", is_ptp ? motion.attributes.speed_ptp : motion.attributes.speed);
        a.set("blend", is_ptp ? motion.attributes.c_ptp : motion.attributes.c_cp);
        a.set("passes", motion.attributes.passes);
        if (m->until) {
          a.set("until", m->until->text(code));
          a.set("until_tree", tree(*m->until, code));
        }
      } else if (const auto* w = std::get_if<program::TracedWrite>(&e.what)) {
        const auto& s = robomosp::row<rmp_code_symbol>(code.symbols, w->symbol);
        const Wire wire = wire_of(s);
        a.set("do", "output");
        a.set("name", s.name);
        a.set("number", wire.number);
        if (s.type == RMP_TYPE_REAL) a.set("value", w->value.real);
        else if (s.type == RMP_TYPE_BOOL && wire.is_inverted)
          a.set("value", std::int64_t{w->value.integer == 0 ? 1 : 0});
        else a.set("value", w->value.integer);
      } else if (const auto* t = std::get_if<program::TracedWait>(&e.what)) {
        a.set("do", t->condition ? "wait_for" : "wait");
        if (t->condition) {
          a.set("condition", t->condition->text(code));
          a.set("tree", tree(*t->condition, code));
        }
        if (t->seconds >= 0) a.set("seconds", t->seconds);
      } else if (const auto* x = std::get_if<program::TracedText>(&e.what)) {
        a.set("do", "message");
        a.set("text", x->text);
      } else if (const auto* p = std::get_if<program::TracedPause>(&e.what)) {
        a.set("do", "pause");
        a.set("text", p->message);
      } else {
        a.set("do", "halt");
      }
      a.set("line", static_cast<std::int64_t>(e.span.line));
      out.emplace_back(std::move(a));
    }
    return out;
  }
  /// The program's files by program.files and program.source, compiled again for its trace.
  Result<program::Trace> trace_of(const Sample& s) {
    RMP_TRY_ASSIGN(const Value files, ask_("program.files", Map{{"id", s.id}}));
    std::vector<std::string> names, texts;
    for (const Value& f : *files.as_list()) {
      names.push_back(string_in(*f.as_map(), "name"));
      RMP_TRY_ASSIGN(const Value text,
                     ask_("program.source", Map{{"id", s.id}, {"name", names.back()}}));
      texts.push_back(*text.as_string());
    }
    std::vector<SourceFile> all;
    for (std::size_t i = 0; i < names.size(); ++i) all.push_back({names[i], texts[i], {}});
    LanguageTask task;
    task.files = all;
    NoProgress none;
    RMP_TRY_ASSIGN(const auto language, app_.registry.create<Language>("irl"));
    const NoParams params;
    RMP_TRY_ASSIGN(auto compiled, language->compile(task, params, none));
    program::TraceOptions options;
    options.most_instructions = kSteps * 10;
    return program::trace(std::shared_ptr<const CompiledProgram>(std::move(compiled)), options);
  }
  class NoParams final : public Params {
   public:
    [[nodiscard]] bool has(std::string_view) const override { return false; }
    [[nodiscard]] double real(std::string_view) const override { return 0; }
    [[nodiscard]] long long integer(std::string_view) const override { return 0; }
    [[nodiscard]] bool boolean(std::string_view) const override { return false; }
    [[nodiscard]] std::string_view text(std::string_view) const override { return ""; }
    [[nodiscard]] std::span<const double> reals(std::string_view) const override { return {}; }
    [[nodiscard]] Pose pose(std::string_view) const override { return {}; }
  };

  Result<void> write_reader(const std::string& target) {
    const fs::path folder = how_.reader;
    std::error_code failed;
    fs::create_directories(folder / "programs", failed);
    if (failed)
      return error(ErrorCode::io, "the folder " + text::quote(folder.string()) + " cannot be made",
                   "Give another one.", "--reader");
    signals_.clear();
    if (profile_) {
      RMP_TRY_ASSIGN(const Value c, ask_("controller.describe", Map{{"id", *profile_}}));
      signals_ = list_in(*c.as_map(), "signals");
    }
    // What another target wrote there, or this one before, is none of its files.
    for (const Sample& s : programs_) {
      for (const char* form : {"flat", "structured"})
        fs::remove_all(folder / "programs" / s.name / form, failed);
      fs::remove(folder / "programs" / (s.name + ".trace.json"), failed);
    }
    std::vector<std::string> written, left_out;
    for (const Sample& s : programs_) {
      auto trace = trace_of(s);
      if (!trace.ok()) {
        left_out.push_back(s.name + " (" + trace.error().message + ")");
        continue;
      }
      std::string forms;
      for (const char* form : {"flat", "structured"}) {
        if (std::find(forms_.begin(), forms_.end(), form) == forms_.end()) continue;
        const auto posted = post(target, s.id, form);
        if (!posted.ok() || !posted->is_correct) {
          left_out.push_back(s.name + ", " + form + " (" +
                             (posted.ok() ? posted->said : posted.error().message) + ")");
          continue;
        }
        const fs::path own = folder / "programs" / s.name / form;
        for (const auto& [name, text] : posted->files) {
          fs::create_directories((own / name).parent_path(), failed);
          RMP_TRY(write_text(own / name, text));
        }
        forms += (forms.empty() ? "" : " and ") + std::string(form);
      }
      if (forms.empty()) continue;
      RMP_TRY_ASSIGN(List all, actions(*trace));
      std::string lines = "[\n";
      for (std::size_t i = 0; i < all.size(); ++i)
        lines += remote::to_json(all[i]) + (i + 1 < all.size() ? ",\n" : "\n");
      RMP_TRY(write_text(folder / "programs" / (s.name + ".trace.json"), lines + "]\n"));
      written.push_back(s.name + " (" + forms + ")");
    }
    if (robot_) {
      const std::string model = (folder / "robot.model").string();
      RMP_TRY(ask_("robot.save_model", Map{{"id", *robot_}, {"file", model}}));
    }
    const fs::path share = app_.share / "post_test";
    RMP_TRY_ASSIGN(const std::string compare, text_of_file(share / "compare.py"));
    RMP_TRY(write_text(folder / "compare.py", compare));
    const bool is_there = fs::exists(folder / "reader.py", failed);
    if (!is_there) {
      RMP_TRY_ASSIGN(const std::string reader, text_of_file(share / "reader.py"));
      RMP_TRY(write_text(folder / "reader.py", reader));
    }
    line_("");
    line_("To be read back: " + (written.empty() ? "nothing" : text::join(written, ", ")) +
          ", in " + (folder / "programs").string() + ".");
    for (const std::string& l : left_out) line_("  not " + l);
    line_(is_there ? "reader.py is kept unchanged." : "Complete reader.py.");
    line_("python3 " + (folder / "compare.py").string() + " compares it with the interpreter.");
    return {};
  }

  ioci::Application& app_;
  const Ask& ask_;
  const PostTest& how_;
  const Line& line_;
  Map& report_;
  std::optional<Value> robot_, profile_;
  std::vector<post::ConstructCase> cases_;
  std::vector<Sample> programs_;
  std::vector<std::string> forms_;  ///< that the target takes
  List signals_;                    ///< of the controller's record
  List faults_;
  std::size_t wrong_ = 0;
};

}  // namespace

Result<int> test_post(ioci::Application& app, const Ask& ask, const PostTest& how,
                      const std::function<void(const std::string&)>& line, Map& report) {
  return Tester(app, ask, how, line, report).run();
}

}  // namespace robomosp::shell
