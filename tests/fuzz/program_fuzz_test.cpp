// SPDX-License-Identifier: Apache-2.0
// Programs of robots that are damaged at random, on their way to controllers and back: source that
// is traced and posted, template packs, and texts of the seven languages that are read, as our own
// posts write them. Nothing crashes, hangs or takes memory without bounds; what is refused is
// refused in words, at a line and a column that there are. Source, with cells, lists and modules,
// and three-address code by themselves are in program_code_fuzz_test.cpp.
#include <algorithm>
#include <chrono>
#include <cstring>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "fanuc_tp.h"
#include "fuzz/program_inputs.h"
#include "gcode.h"
#include "krl.h"
#include "melfa.h"
#include "program/flatten.h"
#include "program/trace.h"
#include "program_post/legalise.h"
#include "program_post/points.h"
#include "program_post/templates.h"
#include "rapid.h"
#include "readers.h"
#include "support/mutator.h"
#include "support/program_world.h"
#include "support/random_program.h"
#include "support/seed.h"
#include "urscript.h"
#include "val3.h"

namespace robomosp {
namespace {

using namespace test;

/// Parameters as the plugins declare them, all at their defaults.
class Settings final : public Params {
 public:
  [[nodiscard]] bool has(std::string_view) const override { return true; }
  [[nodiscard]] double real(std::string_view name) const override {
    return name == "tcp_speed" ? 1.0 : 3.141592653589793;
  }
  [[nodiscard]] long long integer(std::string_view) const override { return 0; }
  [[nodiscard]] bool boolean(std::string_view) const override { return false; }
  [[nodiscard]] std::string_view text(std::string_view) const override { return {}; }
  [[nodiscard]] std::span<const double> reals(std::string_view) const override { return {}; }
  [[nodiscard]] Pose pose(std::string_view) const override { return {}; }
};
class Output final : public PostOutput {
 public:
  void file(std::string_view name, std::string_view bytes) override {
    files.emplace_back(std::string(name), std::string(bytes));
  }
  void from(std::string_view, std::uint32_t, const rmp_span&) override {}
  void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
             std::string_view) override {
    EXPECT_FALSE(message.empty());
    if (severity != RMP_FAULT_ERROR) return;
    ++errors;
    lowest_line = std::min(lowest_line, span.line);
  }
  std::vector<std::pair<std::string, std::string>> files;
  std::size_t errors = 0;
  std::uint32_t lowest_line = 1'000'000;
};
Output posted(const Post& post, const rmp_code& code, std::uint32_t form) {
  Output out;
  const program_post::Legal legal = program_post::legalise(code, post.capabilities());
  for (const auto& r : legal.remarks) out.fault(r.severity, r.span, r.message, r.hint);
  const auto points = program_post::known_points(legal.tables->code(), nullptr, nullptr);
  // Places and turns of G-code; others have no such option.
  PostOption rotary;
  rotary.name = "rotary";
  rotary.value = "ABC";
  PostProfile profile{};
  profile.options = std::span(&rotary, 1);
  PostTask task;
  task.code = &legal.tables->code();
  task.form = form;
  task.name = "prog";
  task.points = points.points;
  task.profile = &profile;
  NoProgress progress;
  const auto done = post.write(task, Settings(), out, progress);
  if (!done.ok()) {
    EXPECT_FALSE(done.error().message.empty());
    ++out.errors;
  }
  return out;
}
/// All posts whose languages are read.
std::vector<std::pair<const char*, std::shared_ptr<Post>>> posts() {
  return {{"krl", std::make_shared<posts::Krl>()},
          {"rapid", std::make_shared<posts::Rapid>()},
          {"urscript", std::make_shared<post::UrScript>()},
          {"melfa", std::make_shared<post::Melfa5>()},
          {"tp", std::make_shared<post::FanucTp>()},
          {"val3", std::make_shared<post::val3::Val3>()},
          {"gcode", std::make_shared<post::GCode>()}};
}

TEST(ProgramFuzz, DamagedSourceIsRefusedOrCompilesRunsAndIsPosted) {
  std::mt19937 random(test::seed());
  std::vector<std::string> all;
  for (std::uint32_t k = 0; k < 40; ++k) all.push_back(random_text(k));
  test::Mutator mutator(random, all, kTokens);
  const auto targets = posts();
  const test::FuzzBudget budget(1500, 0.4);
  std::size_t n = 0, correct = 0, written = 0;
  for (; budget.allows(n); ++n) {
    const std::string& whole = all[random() % all.size()];
    const std::string text = n % 3 == 0 ? mutator.mutate(whole) : changed_gently(whole, random);
    const auto begin = Clock::now();
    const auto p = compiled(text);
    ASSERT_TRUE(p);
    if (!p->code().has_errors) {
      ++correct;
      auto m = program::Machine::load(p, limits());
      if (m.ok()) run_a_while(*m);
      program::TraceOptions options;
      options.most_entries = 2000;
      options.most_instructions = 100'000;
      options.limits = limits();
      const auto t = program::trace(p, options);
      std::unique_ptr<ProgramTables> flat;
      if (t.ok())
        if (auto made = program::flatten(*t); made.ok()) flat = std::move(*made);
      for (const auto& [name, post] : targets) {
        if (post->capabilities().forms & kPostStructured)
          written += posted(*post, p->code(), kPostStructured).errors == 0;
        if (flat && (post->capabilities().forms & kPostFlat))
          written += posted(*post, flat->code(), kPostFlat).errors == 0;
      }
    }
    ASSERT_LT(seconds_since(begin), kMostSeconds) << text;
  }
  std::cout << n << " sources, " << correct << " correct, " << written << " posted\n";
  EXPECT_GT(correct, n / 500);
  expect_memory();
}

const char* const kPack = R"(robomosp target 1
name: acme
file: {{name|lower}}.acl
longest_name: 8
case: upper
orientation: zyz
features: inputs wait_for wait_timeout variables if elsif while repeat loop exit for goto procedures messages pause
motions: ptp_joints ptp_pose lin circle
digits: 4
== operators
+ "+" 50
- "-" 50
* "*" 60
/ "/" 60
DIV "div" 60
MOD "mod" 60
-x "-" 70 prefix
= "=" 30
<> "#" 30
< "<" 30
<= "<=" 30
> ">" 30
>= ">=" 30
AND " and " 20
OR " or " 10
EXOR "xor" 10 call
NOT "not " 25 prefix
== program_begin
begin {{name}}
== program_end
end
== point
{{name}} = ({{x|fixed:2}}, {{y|plus:5|fixed:2}}, {{z|fixed:2}} / {{a|fixed:2}}, {{b|fixed:2}}, {{c|trimmed:2}})
== point_joints
{{name}} = [{{joints}}]
== ptp_joints
[speed_changed] rate {{speed|fixed:0}}%
go {{point}}
[time] take {{time}}
== ptp_pose
go {{point}}
[time] take {{time}}
== lin
[speed_changed] rate {{speed|times:0.06|fixed:1}} m/min
line {{point}}[passes]
[not passes] stop
[passes] round {{blend}}
[time] take {{time}}
== circle
arc {{via}} {{end}} {{speed_m|fixed:3}}
== output_on
on {{number}}
== output_off
off {{number}}
== output_value
put {{number}}, {{value}}
== input
in({{number}})
== wait_time
rest {{seconds}}
== wait_for
until {{condition}}
== wait_for_timeout
until {{condition}}, {{milliseconds}}
== comment
; {{text}}
== declare_int
int {{name}} = {{value}}
== declare_real
num {{name}} = {{value}}
== declare_bool
flag {{name}} = {{value}}
== assign
{{name}} = {{value}}
== if_begin
if {{condition}}
== else_if
elif {{condition}}
== else
else
== if_end
endif
== while_begin
while {{condition}}
== while_end
endwhile
== repeat_begin
repeat
== repeat_end
until {{condition}}
== loop_begin
loop
== loop_end
endloop
== exit
exit
== for_begin
for {{name}} {{from}} {{to}} {{step}}
== for_end
endfor
== goto
jump {{label}}
== label
{{label}}:
== procedure_begin
sub {{name}}
== procedure_end
endsub
== call
call {{name}}
== return
back
== message
say {{values}}
== pause
pause
== halt
halt
)";

TEST(ProgramFuzz, DamagedTemplatePacksAreRefusedOrWrite) {
  std::mt19937 random(test::seed());
  const std::vector<std::string> all{kPack};
  static const char* const kPackTokens[] = {"{{",
                                            "}}",
                                            "|",
                                            "fixed:99",
                                            "times:1e300",
                                            "[",
                                            "]",
                                            "== lin\n",
                                            "name: ",
                                            "features: ",
                                            "digits: ",
                                            "\n",
                                            "{{name}}",
                                            "[not ",
                                            "|upper",
                                            "\"",
                                            "prefix",
                                            "99999999",
                                            "# ",
                                            "\xff",
                                            "max_points: 1\n",
                                            "indent: 12\n",
                                            "plus:-1e308",
                                            "name_signs: letters -\n",
                                            "quotes: backslash\n",
                                            "real_digits: 2\n",
                                            "decimal_sign: ,\n",
                                            "goto jumps",
                                            "== jump_if\nIF {{condition}} {{number}}\n",
                                            "+ \"(+ {{a}} {{b}})\"\n"};
  test::Mutator mutator(random, all, kPackTokens);
  std::vector<std::shared_ptr<const CompiledProgram>> programs, flats;
  for (std::uint32_t k = 0; k < 30; ++k) {
    programs.push_back(compiled(random_text(k)));
    const auto t = program::trace(programs.back());
    if (!t.ok()) continue;
    if (auto made = program::flatten(*t); made.ok()) flats.emplace_back(std::move(*made));
  }
  ASSERT_GT(flats.size(), 10U);
  {
    const auto pack = program_post::read_templates(kPack, "acme.post");
    ASSERT_TRUE(pack.ok()) << pack.error().sentence();
  }
  const test::FuzzBudget budget(2000, 0.2);
  std::size_t n = 0, read = 0, written = 0, said = 0, hints = 0;
  for (; budget.allows(n); ++n) {
    const std::string text = mutator.mutate(kPack);
    const auto begin = Clock::now();
    std::vector<program_post::PackFault> faults;
    const auto pack = program_post::read_templates(text, "acme.post", {}, &faults);
    if (!pack.ok()) {
      ASSERT_FALSE(pack.error().message.empty());
      ASSERT_FALSE(faults.empty()) << pack.error().sentence();
      for (const program_post::PackFault& f : faults) {
        ASSERT_FALSE(f.message.empty());
        ASSERT_TRUE(f.line >= 1 && f.column >= 1) << f.message;
        ASSERT_LE(f.line, std::count(text.begin(), text.end(), '\n') + 1) << f.message;
        ++said;
        hints += !f.hint.empty();
      }
    } else {
      ++read;
      const auto post = program_post::make_template_post(*pack);
      const auto forms = post->capabilities().forms;
      if (forms & kPostStructured)
        written +=
            posted(*post, programs[n % programs.size()]->code(), kPostStructured).errors == 0;
      if (forms & kPostFlat)
        written += posted(*post, flats[n % flats.size()]->code(), kPostFlat).errors == 0;
    }
    ASSERT_LT(seconds_since(begin), kMostSeconds) << text;
  }
  std::cout << n << " packs, " << read << " read, " << written << " programs written; " << hints
            << " of " << said << " faults say what to do\n";
  EXPECT_GT(read, n / 50);
  EXPECT_GT(written, n / 200);
  expect_memory();
}

using Reader = readers::Made (*)(const ProgramReaderTask&, const Params&, Progress&);

TEST(ProgramFuzz, DamagedProgramsOfControllersAreReadOrSaid) {
  const std::pair<const char*, Reader> kReaders[] = {{"krl", readers::read_krl},
                                                     {"rapid", readers::read_rapid},
                                                     {"urscript", readers::read_urscript},
                                                     {"melfa", readers::read_melfa},
                                                     {"tp", readers::read_tp},
                                                     {"val3", readers::read_val3},
                                                     {"gcode", readers::read_gcode}};
  static const char* const kWords[] = {
      "IF ",         "END",     "(",          ")",   "[",    "]",     "{",        "}",
      "=",           ":=",      ",",          ";",   "\n",   "1e999", "-1",       "9E9",
      "TRUE",        "\"",      "'",          "P1",  "LIN ", "WAIT ", "CALL ",    "FOR ",
      "def x():",    "\xff",    "G2",         "$",   "#",    "&",     "]]>",      "<Value ",
      "99999999999", "GoTo *L", "JMP LBL[1]", "M99", "R0",   "I0 J0", "\\WObj:=", "key=\"-1\"",
      "ENDFOR",      "ENDPROC", "until "};
  std::mt19937 random(test::seed());
  const auto targets = posts();
  for (const auto& [name, reader] : kReaders) {
    // Real outputs: each a list of files.
    std::vector<std::vector<std::pair<std::string, std::string>>> outputs;
    std::vector<std::string> texts;
    const Post* post = nullptr;
    for (const auto& [target, made] : targets)
      if (std::string(target) == name) post = made.get();
    ASSERT_TRUE(post);
    for (std::uint32_t k = 0; outputs.size() < 40 && k < 400; ++k) {
      const auto p = compiled(random_text(k));
      for (const std::uint32_t form : {std::uint32_t{kPostStructured}, std::uint32_t{kPostFlat}}) {
        if (!(post->capabilities().forms & form)) continue;
        std::shared_ptr<const CompiledProgram> from = p;
        if (form == kPostFlat) {
          const auto t = program::trace(p);
          if (!t.ok()) continue;
          auto flat = program::flatten(*t);
          if (!flat.ok()) continue;
          from = std::shared_ptr<const CompiledProgram>(std::move(*flat));
        }
        Output out = posted(*post, from->code(), form);
        if (out.errors > 0) continue;
        for (auto& [file, text] : out.files) {
          if (const std::size_t slash = file.rfind('/'); slash != std::string::npos)
            file.erase(0, slash + 1);
          texts.push_back(text);
        }
        outputs.push_back(std::move(out.files));
      }
    }
    ASSERT_GT(outputs.size(), 10U) << name;
    test::Mutator mutator(random, texts, kWords);
    const test::FuzzBudget budget(400, 0.4 / 7);
    std::size_t n = 0, compiling = 0;
    for (; budget.allows(n); ++n) {
      auto files = outputs[n % outputs.size()];
      auto& changed = files[random() % files.size()].second;
      changed = mutator.mutate(changed);
      std::vector<SourceFile> sources;
      for (const auto& [file, text] : files) sources.push_back({file, text, {}});
      ProgramReaderTask task;
      task.files = sources;
      NoProgress progress;
      const auto begin = Clock::now();
      const auto made = reader(task, Settings(), progress);
      ASSERT_TRUE(made.ok()) << made.error().sentence();
      for (const rmp_code_fault& f : (*made)->faults()) {
        ASSERT_LT(f.span.file, files.size());
        expect_place(f, files[f.span.file].second);
        ASSERT_FALSE(HasFailure()) << name << "\n" << files[f.span.file].second;
      }
      std::vector<SourceFile> made_of;
      for (const ReadFile& f : (*made)->files()) made_of.push_back({f.name, f.text, {}});
      auto p = irl::compile(made_of, progress);
      ASSERT_TRUE(p.ok());
      if (!(*p)->code().has_errors) {
        ++compiling;
        (*p)->seal();
        auto m =
            program::Machine::load(std::shared_ptr<const CompiledProgram>(std::move(*p)), limits());
        if (m.ok()) run_a_while(*m);
      }
      ASSERT_LT(seconds_since(begin), kMostSeconds) << name << "\n" << changed;
    }
    std::cout << name << ": " << n << " texts, the IRL of " << compiling << " compiles\n";
    EXPECT_GT(compiling, n / 10) << name;
  }
  expect_memory();
}

}  // namespace
}  // namespace robomosp
