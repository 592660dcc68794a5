// SPDX-License-Identifier: Apache-2.0
// What grows: a program with ten times as much of one thing takes about ten times as long, and ten
// times the memory, through the compiler, the editor's questions, the machine, its debugger, the
// passes before posting, packs of templates, and the readers. Sizes are 1,000 and 10,000;
// ROBOMOSP_LONG=1 goes on to 100,000, and ROBOMOSP_GROWTH names the cases of a run.
#include <malloc.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "editing.h"
#include "program/flatten.h"
#include "program/trace.h"
#include "program_post/legalise.h"
#include "program_post/points.h"
#include "program_post/templates.h"
#include "readers.h"
#include "support/allocations.h"
#include "support/posts.h"
#include "support/program_world.h"
#include "support/reader_settings.h"

namespace robomosp::program {
namespace {

using testing::compiled;
using testing::File;
using testing::TestWorld;
using Files = std::vector<File>;

double processor() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// What one size costs.
struct Spent {
  double seconds = 0;  ///< of the processor
  double bytes = 0;    ///< that were asked for, whether they were given back or not
};
/// `make` prepares n of something and gives what is measured.
using Make = std::function<std::function<void()>(int n)>;

Spent spent(const Make& make, int n) {
  const auto work = make(n);
  const std::size_t bytes = test::allocated_bytes;
  const double begin = processor();
  work();
  return {processor() - begin, static_cast<double>(test::allocated_bytes - bytes)};
}

/// Ten times as much may take 40 times as long: a square would take a hundred times. Both sizes are
/// measured anew when it takes longer, for a machine that did something else meanwhile or that
/// fetched pages of memory for the first time. Times below a few milliseconds say nothing.
void expect_growth(const std::string& name, const Make& make) {
  if (const char* wanted = std::getenv("ROBOMOSP_GROWTH"))
    if (name.find(wanted) == std::string::npos) return;
  const char* is_long = std::getenv("ROBOMOSP_LONG");
  std::vector<int> sizes{1000, 10'000};
  if (is_long && *is_long == '1') sizes.push_back(100'000);
  Spent before;
  std::string line = name;
  line.resize(std::max<std::size_t>(line.size(), 44), ' ');
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const int n = sizes[k];
    Spent now = spent(make, n);
    constexpr int kTries = 5;
    const auto grows_too_fast = [&] { return now.seconds > 40 * before.seconds + 0.02; };
    for (int t = 0; t < kTries && k > 0 && grows_too_fast(); ++t) {
      before.seconds = spent(make, sizes[k - 1]).seconds;
      now.seconds = spent(make, n).seconds;
    }
    char text[80];
    std::snprintf(text, sizeof text, "%8.1f ms %8.1f MB", 1e3 * now.seconds, 1e-6 * now.bytes);
    line += text;
    if (k > 0) {
      EXPECT_FALSE(grows_too_fast())
          << name << ", " << n << ": " << now.seconds << " s after " << before.seconds << " s";
#if ROBOMOSP_COUNTS_MEMORY
      EXPECT_LT(now.bytes, 20 * before.bytes + 1e6) << name << ", " << n;
#endif
    }
    before = now;
  }
  std::puts(line.c_str());
}

/// Memory that was given back stays with this program: each page is fetched from the system once,
/// not again for each try.
[[maybe_unused]] const bool kKeepsMemory =
    ::mallopt(M_MMAP_THRESHOLD, 32 << 20) && ::mallopt(M_TRIM_THRESHOLD, 1 << 30);

std::string numbered(const char* text, int n) {
  // # = the number
  std::string out;
  const std::string_view s(text);
  for (int k = 0; k < n; ++k)
    for (const char c : s)
      if (c == '#') out += std::to_string(k);
      else out += c;
  return out;
}
std::string joined(const char* text, int n, const char* between) {
  std::string out;
  for (int k = 0; k < n; ++k) {
    if (k > 0) out += between;
    for (const char c : std::string_view(text))
      if (c == '#') out += std::to_string(k);
      else out += c;
  }
  return out;
}
std::string repeated(const char* text, int n) {
  std::string out;
  for (int k = 0; k < n; ++k) out += text;
  return out;
}

constexpr const char* kHead =
    "VAR INT: i, j, k; REAL: r; BOOL: b := TRUE; STRING: s;\n"
    "POSE: p := POSE(POSITION(400.0, 0.0, 200.0), ORIZYX(0.0, 180.0, 0.0));\n";
std::string program(const std::string& declared, const std::string& body) {
  return "PROGRAM p;\n" + std::string(kHead) + declared + "BEGIN\n" + body + "ENDPROGRAM;\n";
}

/// Sources with n of something, with or without faults.
struct Source {
  const char* name;
  std::function<Files(int)> files;
  bool is_correct = true;
};
std::vector<Source> sources() {
  const auto one = [](std::string text) { return Files{{"p.irl", std::move(text)}}; };
  return {
      {"statements", [=](int n) { return one(program("", repeated("i := j + 1;\n", n))); }},
      {"statements in one line",
       [=](int n) { return one(program("", repeated("i := j + 1; ", n))); }},
      {"blocks",
       [=](int n) { return one(program("", repeated("IF b THEN\n  i := 1;\nENDIF;\n", n))); }},
      {"blocks 150 deep",
       [=](int n) {
         std::string one_of;
         for (int k = 0; k < 150; ++k) one_of += "IF b THEN\n";
         one_of += "i := 1;\n" + repeated("ENDIF;\n", 150);
         return one(program("", repeated(one_of.c_str(), n / 100)));
       }},
      {"arms of one IF",
       [=](int n) {
         return one(program("", "IF i = 5 THEN\nj := 1;\n" +
                                    numbered("ELSIF i = # + 7 THEN\n  j := #;\n", n) + "ENDIF;\n"));
       }},
      {"arms of one CASE",
       [=](int n) {
         return one(program("", "CASE i OF\n" + numbered("WHEN #: j := #;\n", n) + "ENDCASE;\n"));
       }},
      {"loops",
       [=](int n) {
         return one(program("", repeated("FOR k := 1 TO 2\n  i := k;\nENDFOR;\n", n)));
       }},
      {"labels", [=](int n) { return one(program("", numbered("GOTO l#;\nLABEL l#:\n", n))); }},
      {"parameters of one routine",
       [=](int n) {
         return one(program(
             "PROCEDURE q (" + joined("IN INT: a#", n, "; ") + ");\nBEGIN\n  i := a0;\nENDPROC;\n",
             "q(" + joined("#", n, ", ") + ");\n"));
       }},
      {"parameters of many routines",
       [=](int n) {
         return one(program(
             numbered("PROCEDURE q# (IN INT: a, b; INOUT REAL: c);\nBEGIN\n  c := a;\nENDPROC;\n",
                      n),
             numbered("q#(1, 2, r);\n", n)));
       }},
      {"routines that call each other",
       [=](int n) {
         std::string all = "PROCEDURE q0;\nBEGIN\n  i := 1;\nENDPROC;\n";
         for (int k = 1; k < n; ++k)
           all += "PROCEDURE q" + std::to_string(k) + ";\nBEGIN\n  q" + std::to_string(k / 2) +
                  ";\nENDPROC;\n";
         return one(program(all, "q" + std::to_string(n - 1) + ";\n"));
       }},
      {"variables",
       [=](int n) {
         return one(program(numbered("INT: v# := #;\n", n), numbered("v# := v# + 1;\n", n)));
       }},
      {"variables in one line",
       [=](int n) {
         return one(program("INT: " + joined("v#", n, ", ") + ";\n", numbered("v# := 1;\n", n)));
       }},
      {"constants that use each other",
       [=](int n) {
         std::string all = "CONST\nREAL: c0 := 0.5;\n";
         for (int k = 1; k < n; ++k)
           all += "REAL: c" + std::to_string(k) + " := c" + std::to_string(k - 1) + " + 1.0;\n";
         return one(program(all, "r := c" + std::to_string(n - 1) + ";\n"));
       }},
      {"signals",
       [=](int n) {
         return one(program("SIGNAL\n" + numbered("OUTPUT BOOL: o# AT # + 1;\n", n),
                            numbered("o# := TRUE;\n", n)));
       }},
      {"types",
       [=](int n) {
         return one(program("TYPE\n" + numbered("RECORD INT: a; REAL: b; ENDRECORD: T#;\n", n) +
                                "VAR\n" + numbered("T#: v#;\n", n),
                            numbered("v#.a := 1;\n", n)));
       }},
      {"fields of one record",
       [=](int n) {
         return one(
             program("TYPE\nRECORD\n" + numbered("INT: f#;\n", n) + "ENDRECORD: T;\nVAR T: v;\n",
                     numbered("v.f# := 1;\n", n)));
       }},
      {"records in an array",
       [=](int n) {
         const std::string size = std::to_string(n);
         return one(program(
             "TYPE RECORD INT: n; REAL: x; STRING: t; ENDRECORD: CELL;\nVAR ARRAY [1.." + size +
                 "] OF CELL: a, c;\n",
             "FOR i := 1 TO " + size +
                 "\n  a[i].n := i;\n  a[i].x := i * 0.5;\n  a[i].t := 'ab';\nENDFOR;\nc := a;\n"));
       }},
      {"values of one array",
       [=](int n) {
         return one(program(
             "ARRAY [1.." + std::to_string(n) + "] OF INT: a := [" + joined("#", n, ", ") + "];\n",
             "i := a[5];\n"));
       }},
      {"records of one array",
       [=](int n) {
         return one(program("TYPE RECORD INT: n; REAL: x; ENDRECORD: CELL;\nVAR ARRAY [1.." +
                                std::to_string(n) + "] OF CELL: a := [" +
                                joined("CELL(#, 0.5)", n, ", ") + "];\n",
                            "i := a[5].n;\n"));
       }},
      {"one long string",
       [=](int n) {
         return one(
             program("", "s := '" + std::string(static_cast<std::size_t>(n) * 10, 'a') + "';\n"));
       }},
      {"strings", [=](int n) { return one(program("", numbered("s := 'text #';\n", n))); }},
      {"a string that others use, in loops",
       [=](int n) {
         return one(program(
             "ARRAY [1.." + std::to_string(n) + "] OF STRING: a;\n",
             "FOR i := 1 TO " + std::to_string(n) + "\n  a[i] := CONCAT('ab', 'cd');\nENDFOR;\n"));
       }},
      {"strings beside a large array",
       [=](int n) {
         const std::string size = std::to_string(n);
         return one(program("ARRAY [1.." + std::to_string(n * 10) + "] OF INT: a;\n",
                            "FOR i := 1 TO " + size +
                                "\n  s := CONCAT('abcdefghijklmnopqrstuvwxyz', 'cd');\nENDFOR;\n"));
       }},
      {"elements of a list",
       [=](int n) {
         return one(
             program("LIST OF INT: l;\n", "FOR i := 1 TO " + std::to_string(n) +
                                              "\n  LIST_ADD(l, i);\n  j := l[i];\nENDFOR;\n"));
       }},
      {"motions",
       [=](int n) {
         return one(program("", numbered("MOVE LIN POSE(POSITION(#.0, 0.0, 200.0), ORIZYX(0.0, "
                                         "180.0, 0.0)) SPEED := 80.0;\n",
                                         n)));
       }},
      {"targets of one path",
       [=](int n) {
         return one(program("", "MOVE PATH " +
                                    joined("POSE(POSITION(#.0, 0.0, 200.0), ORIZYX(0.0, 180.0, "
                                           "0.0))",
                                           n, ",\n") +
                                    " SPEED := 80.0;\n"));
       }},
      {"taught points",
       [=](int n) {
         return one(program(numbered("POSE: t# := POSE(POSITION(#.0, 0.0, 9.0), ORIZYX(0.0, 180.0, "
                                     "0.0));\n",
                                     n),
                            numbered("MOVE PTP t#;\n", n)));
       }},
      {"processes",
       [=](int n) {
         return one(program(numbered("PROCESS q#;\nBEGIN\n  WAIT 1.0 SEC;\nENDPROCESS;\n", n),
                            numbered("START q#;\n", n)));
       }},
      {"interrupts",
       [=](int n) {
         return one(
             program("SIGNAL INPUT BOOL: in1 AT 1;\n" +
                         numbered("INTERRUPT q# WHEN in1;\nBEGIN\n  i := 1;\nENDINTERRUPT;\n", n),
                     numbered("ENABLE q#;\n", n) + "WAIT 1.0 SEC;\n"));
       }},
      {"comments", [=](int n) { return one(program("", repeated("{ said }\ni := 1;\n", n))); }},
      {"one long comment",
       [=](int n) {
         return one(program("", "{" + repeated("said at length\n", n) + "}\ni := 1;\n"));
       }},
      {"names that are unknown",
       [=](int n) { return one(program("", numbered("x# := y#;\n", n))); }, false},
      {"signs that are missing", [=](int n) { return one(program("", numbered("i := # 1\n", n))); },
       false},
      {"names that are there twice",
       [=](int n) { return one(program(repeated("INT: twice;\n", n), "")); }, false},
      {"variables, and an unknown name in each line",
       [=](int n) {
         return one(program(numbered("INT: variable#;\n", n), numbered("veriable# := 1;\n", n)));
       },
       false},
      {"signs that are none", [=](int n) { return one(program("", repeated("$ ? \\\n", n))); },
       false},
      {"modules",
       [](int n) {
         Files all{{"p.irl", ""}};
         std::string head, body;
         for (int k = 0; k < n / 10; ++k) {
           const std::string m = "m" + std::to_string(k);
           head += "IMPORT v" + std::to_string(k) + " FROM " + m + ";\n";
           body += "  v" + std::to_string(k) + " := 1;\n";
           all.push_back({m + ".irl", "MODULE " + m + ";\nEXPORT v" + std::to_string(k) +
                                          ";\nVAR INT: v" + std::to_string(k) + ";\nENDMODULE;\n"});
         }
         all[0].text = "PROGRAM p;\n" + head + "BEGIN\n" + body + "ENDPROGRAM;\n";
         return all;
       }},
      {"names of one module",
       [](int n) {
         return Files{
             {"p.irl", "PROGRAM p;\nIMPORT " + joined("v#", n, ", ") + " FROM tools;\nBEGIN\n" +
                           numbered("v# := 1;\n", n) + "ENDPROGRAM;\n"},
             {"tools.irl", "MODULE tools;\nEXPORT " + joined("v#", n, ", ") + ";\nVAR\n" +
                               numbered("INT: v#;\n", n) + "ENDMODULE;\n"}};
       }},
      {"lines of a list of data",
       [](int n) {
         return Files{{"p.irl", "PROGRAM p;\nDATALIST 'p.dls';\nVAR\n" + numbered("INT: v#;\n", n) +
                                    "BEGIN\nTEACH " + joined("v#", n, ", ") + ";\nENDPROGRAM;\n"},
                      {"p.dls", numbered("v# := #;\n", n)}};
       }},
  };
}

class CodeOutput final : public PostOutput {
 public:
  void file(std::string_view, std::string_view bytes) override { size += bytes.size(); }
  void from(std::string_view, std::uint32_t, const rmp_span&) override {}
  void fault(std::uint32_t, const rmp_span&, std::string_view, std::string_view) override {
    ++faults;
  }
  std::size_t size = 0, faults = 0;
};

std::shared_ptr<const CompiledProgram> compiled_quietly(const Files& files) {
  std::vector<SourceFile> all;
  for (const File& f : files) all.push_back({f.name, f.text, {}});
  NoProgress progress;
  auto made = irl::compile(all, progress);
  EXPECT_TRUE(made.ok());
  if (!made.ok()) return nullptr;
  (*made)->seal();
  return std::shared_ptr<const CompiledProgram>(std::move(*made));
}

TEST(ProgramGrowth, CompilingGrowsWithTheSource) {
  for (const Source& s : sources())
    expect_growth(std::string("compile: ") + s.name, [&](int n) {
      const Files files = s.files(n);
      return [files, &s] {
        const auto p = compiled_quietly(files);
        ASSERT_TRUE(p);
        EXPECT_EQ(p->code().has_errors == 0, s.is_correct) << s.name;
        EXPECT_LE(p->code().faults.count, 1000U) << s.name;
        if (s.is_correct && p->code().has_errors)
          std::puts(row<rmp_code_fault>(p->code().faults, 0).message);
      };
    });
}

TEST(ProgramGrowth, WhatEditorsAskGrowsWithTheSource) {
  for (const Source& s : sources())
    expect_growth(std::string("edit: ") + s.name, [&](int n) {
      const Files files = s.files(n);
      return [files, &s] {
        std::vector<SourceFile> all;
        for (const File& f : files) all.push_back({f.name, f.text, {}});
        NoProgress progress;
        const auto p = irl::edit(all);
        EXPECT_TRUE(p->faults(progress).ok());
        EXPECT_TRUE(p->outline(0, progress).ok());
        EXPECT_TRUE(p->tokens(0, progress).ok());
        EXPECT_TRUE(p->folds(0, progress).ok());
        EXPECT_TRUE(p->format(0, {}, progress).ok() || !s.is_correct) << s.name;
        const auto at = static_cast<std::uint32_t>(files[0].text.size() - 14);
        EXPECT_TRUE(p->complete(0, at, progress).ok());
        EXPECT_TRUE(p->references(0, at, progress).ok());
        EXPECT_TRUE(p->hover(0, at, progress).ok());
        EXPECT_TRUE(p->signature(0, at, progress).ok());
        // What stands there may have no other name: that costs as much to find out.
        (void)p->rename(0, at, "other", progress);
      };
    });
}

TEST(ProgramGrowth, RunningGrowsWithWhatIsDone) {
  for (const Source& s : sources()) {
    if (!s.is_correct) continue;
    expect_growth(std::string("run: ") + s.name, [&](int n) {
      const auto p = compiled_quietly(s.files(n));
      return [p, &s] {
        Limits limits;
        limits.slice = std::uint64_t{1} << 40;
        auto m = Machine::load(p, limits);
        ASSERT_TRUE(m.ok()) << s.name << ": " << m.error().sentence();
        TestWorld w;
        w.motion_seconds = 0;
        for (; w.now < 5 && m->run(w.now, w).state != RunState::over; w.now += 0.5)
          if (m->status().fault) FAIL() << s.name << ": " << m->status().fault->message;
      };
    });
  }
}

constexpr const char* kPack = R"(robomosp target 1
name: small
file: {{name|lower}}.sml
longest_name: 8
features: inputs wait_for wait_timeout variables if elsif while repeat for goto procedures messages pause
motions: ptp_joints ptp_pose lin
== operators
+ "+" 50
- "-" 50
* "*" 60
= "=" 30
< "<" 30
<= "<=" 30
> ">" 30
AND " and " 20
NOT "not " 25 prefix
== program_begin
begin {{name}}
== program_end
end
== point
{{name}} = ({{x|fixed:2}}, {{y|fixed:2}}, {{z|fixed:2}}, {{a|fixed:2}}, {{b|fixed:2}}, {{c|fixed:2}})
== point_joints
{{name}} = [{{joints}}]
== ptp_joints
go {{point}}
== ptp_pose
go {{point}}
== lin
line {{point}}
== output_on
on {{number}}
== output_off
off {{number}}
== output_value
put {{number}}, {{value}}
== input
in({{number}})
== wait_time
rest {{milliseconds}}
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
say {{text}}
== pause
pause
== halt
halt
)";

TEST(ProgramGrowth, PassesBeforePostingGrowWithTheProgram) {
  const auto pack = program_post::read_templates(kPack, "small.post");
  ASSERT_TRUE(pack.ok()) << pack.error().sentence();
  const auto post = program_post::make_template_post(*pack);
  for (const Source& s : sources()) {
    if (!s.is_correct) continue;
    const auto write = [&](const rmp_code& code, std::uint32_t form) {
      CodeOutput out;
      const auto before = program_post::known_points(code, nullptr, nullptr);
      program_post::LegaliseOptions options;
      options.points = before.points;
      const auto legal = program_post::legalise(code, post->capabilities(), options);
      const auto points = program_post::known_points(legal.tables->code(), nullptr, nullptr);
      PostProfile profile{};
      PostTask task;
      task.code = &legal.tables->code();
      task.form = form;
      task.name = "prog";
      task.points = points.points;
      task.profile = &profile;
      NoProgress progress;
      const test::NoParams params;
      (void)post->write(task, params, out, progress);
    };
    expect_growth(std::string("post: ") + s.name, [&](int n) {
      const auto p = compiled_quietly(s.files(n));
      return [p, write] { write(p->code(), kPostStructured); };
    });
    expect_growth(std::string("flat: ") + s.name, [&](int n) {
      const auto p = compiled_quietly(s.files(n));
      return [p, write, &s] {
        const auto t = trace(p);
        if (!t.ok()) return;
        const auto flat = flatten(*t);
        if (!flat.ok()) return;
        write((*flat)->code(), kPostFlat);
      };
    });
  }
}

TEST(ProgramGrowth, PacksOfTemplatesGrowWithTheirLines) {
  const auto read = [](const std::string& text) {
    return [text] { (void)program_post::read_templates(text, "small.post"); };
  };
  const auto with_comment = [](const std::string& lines) {
    std::string text = kPack;
    const std::string_view old = "; {{text}}\n";
    return text.replace(text.find(old), old.size(), lines);
  };
  expect_growth("pack: lines of a template",
                [&](int n) { return read(with_comment(numbered("line # {{text}} here\n", n))); });
  expect_growth("pack: one long line",
                [&](int n) { return read(with_comment(repeated("{{text|upper}} ", n) + "\n")); });
  expect_growth("pack: filters of one variable", [&](int n) {
    return read(with_comment("{{text" + repeated("|upper", n) + "}}\n"));
  });
  expect_growth("pack: operators", [&](int n) {
    std::string text = kPack;
    const std::string at = "== operators\n";
    text.insert(text.find(at) + at.size(), repeated("+ \"+\" 50\n", n));
    return read(text);
  });
  expect_growth("pack: constructs that there are not", [&](int n) {
    return read(std::string(kPack) + numbered("== nothing#\nline\n", n));
  });
  expect_growth("pack: faults",
                [&](int n) { return read(with_comment(repeated("{{nobody}} {{\n", n))); });
  expect_growth("pack: words of its head", [&](int n) {
    std::string text = kPack;
    text.insert(text.find("motions:"), "reserved: " + joined("word#", n, " ") + "\n");
    return read(text);
  });
}

/// Lines that do something, each with its number.
std::string lines(int n) { return numbered("i := #;\n", n); }

TEST(ProgramGrowth, BreakpointsCostTheirNumberOnceAndARunNothing) {
  expect_growth("debug: breakpoints set, listed, taken away", [](int n) {
    const auto p = compiled_quietly({{"p.irl", program("", lines(n))}});
    return [p, n] {
      auto m = Machine::load(p);
      ASSERT_TRUE(m.ok());
      std::vector<std::uint32_t> numbers;
      for (int k = 0; k < n; ++k) {
        Breakpoint b;
        b.line = static_cast<std::uint32_t>(5 + k);
        const auto set = m->set_breakpoint(b);
        ASSERT_TRUE(set.ok()) << set.error().sentence();
        ASSERT_EQ(set->line, b.line);
        numbers.push_back(set->number);
      }
      ASSERT_EQ(m->breakpoints().size(), static_cast<std::size_t>(n));
      for (const std::uint32_t number : numbers) ASSERT_TRUE(m->remove_breakpoint(number));
    };
  });
  expect_growth("debug: breakpoints in one line", [](int n) {
    const auto p = compiled_quietly({{"p.irl", program("", lines(n))}});
    return [p, n] {
      auto m = Machine::load(p);
      ASSERT_TRUE(m.ok());
      for (int k = 0; k < n; ++k) {
        Breakpoint b;
        b.line = 7;
        b.condition = "i = 5";
        ASSERT_TRUE(m->set_breakpoint(b).ok());
      }
      TestWorld w;
      EXPECT_EQ(m->run(0, w).state, RunState::over);
    };
  });
  expect_growth("debug: breakpoints of routines", [](int n) {
    const auto p = compiled_quietly(
        {{"p.irl", program(numbered("PROCEDURE q#;\nBEGIN\n  i := #;\nENDPROC;\n", n), "q0;\n")}});
    return [p, n] {
      auto m = Machine::load(p);
      ASSERT_TRUE(m.ok());
      for (int k = 0; k < n; ++k) {
        Breakpoint b;
        b.routine = "Q" + std::to_string(k);
        ASSERT_TRUE(m->set_breakpoint(b).ok());
      }
    };
  });
  expect_growth("debug: a run that stops at each of them", [](int n) {
    const auto p = compiled_quietly({{"p.irl", program("", lines(n))}});
    return [p, n] {
      auto m = Machine::load(p);
      ASSERT_TRUE(m.ok());
      for (int k = 0; k < n; ++k) {
        Breakpoint b;
        b.line = static_cast<std::uint32_t>(5 + k);
        ASSERT_TRUE(m->set_breakpoint(b).ok());
      }
      TestWorld w;
      int stops = 0;
      while (m->run(0, w).state == RunState::stopped) {
        ++stops;
        ASSERT_TRUE(m->place_of(0));
      }
      EXPECT_EQ(stops, n);
    };
  });
  expect_growth("debug: conditions among symbols", [](int n) {
    const auto p = compiled_quietly(
        {{"p.irl", program(numbered("INT: v#;\n", n),
                           "FOR i := 1 TO " + std::to_string(n) + "\n  j := i;\nENDFOR;\n")}});
    return [p, n] {
      auto m = Machine::load(p);
      ASSERT_TRUE(m.ok());
      Breakpoint b;
      b.line = static_cast<std::uint32_t>(5 + n + 1);
      b.condition = "v1 > j AND v7 = 2";
      ASSERT_TRUE(m->set_breakpoint(b).ok());
      TestWorld w;
      EXPECT_EQ(m->run(0, w).state, RunState::over);
      EXPECT_EQ(m->breakpoints()[0].hits, 0U);
    };
  });
  expect_growth("debug: variables", [](int n) {
    const auto p =
        compiled_quietly({{"p.irl", program(numbered("INT: v# := #;\n", n), "i := 1;\n")}});
    return [p, n] {
      auto m = Machine::load(p);
      ASSERT_TRUE(m.ok());
      TestWorld w;
      m->run(0, w);
      EXPECT_GE(m->globals({}).size(), static_cast<std::size_t>(n));
      for (int k = 0; k < n; ++k)
        ASSERT_TRUE(m->evaluate("v" + std::to_string(k) + " + 1", 0, Machine::kNoFrame).ok());
    };
  });
  expect_growth("debug: processes", [](int n) {
    const auto p = compiled_quietly(
        {{"p.irl", program(numbered("PROCESS q#;\nBEGIN\n  WAIT 1.0 SEC;\nENDPROCESS;\n", n),
                           numbered("START q#;\n", n) + "WAIT 1.0 SEC;\n")}});
    return [p] {
      auto m = Machine::load(p);
      ASSERT_TRUE(m.ok());
      TestWorld w;
      m->run(0, w);
      std::size_t frames = 0;
      for (const std::uint32_t process : m->processes()) {
        frames += m->call_stack(process).size();
        (void)m->variables(process, 0, {});
      }
      EXPECT_GE(frames, m->processes().size());
    };
  });
  // Rows of a recording share breakpoints that nobody changes.
  expect_growth("debug: rows beside breakpoints", [](int n) {
    const auto p =
        compiled_quietly({{"p.irl", program("", "LOOP\n  WAIT 0.1 SEC;\nENDLOOP;\n" + lines(n))}});
    return [p, n] {
      auto m = Machine::load(p);
      ASSERT_TRUE(m.ok());
      for (int k = 0; k < n; ++k) {
        Breakpoint b;
        b.line = static_cast<std::uint32_t>(8 + k);
        b.condition = "i = 1";
        ASSERT_TRUE(m->set_breakpoint(b).ok());
      }
      TestWorld w;
      std::vector<Machine> rows;
      for (int k = 0; k < n; ++k) {
        w.now = 0.1 * k;
        m->run(w.now, w);
        rows.push_back(*m);
      }
    };
  });
}

// ---- programs of controllers ----

struct Foreign {
  const char* name;
  readers::Made (*read)(const ProgramReaderTask&, const Params&, Progress&);
  std::function<Files(int)> files;
};

std::vector<Foreign> foreign() {
  using namespace readers;
  const auto krl = [](std::string body) {
    return Files{{"p.src", "DEF p()\n" + std::move(body) + "END\n"}};
  };
  const auto rapid = [](std::string data, std::string body) {
    return Files{{"p.mod", "MODULE m\n" + std::move(data) + "PROC main()\n" + std::move(body) +
                               "ENDPROC\nENDMODULE\n"}};
  };
  const auto ur = [](std::string body) { return Files{{"p.script", std::move(body)}}; };
  const auto tp = [](std::string body, std::string points) {
    return Files{
        {"p.ls", "/PROG P\n/MN\n" + std::move(body) + "/POS\n" + std::move(points) + "/END\n"}};
  };
  const auto melfa = [](std::string body) { return Files{{"p.prg", std::move(body)}}; };
  const auto gcode = [](std::string body) { return Files{{"p.ngc", std::move(body)}}; };
  const auto val3 = [](std::string body, std::string data = {}) {
    return Files{{"start.pgx", "<Programs><Program name=\"start\"><Code><![CDATA[begin\n" +
                                   std::move(body) + "end]]></Code></Program></Programs>"},
                 {"p.dtx", "<Database><Datas>\n" + std::move(data) + "</Datas></Database>\n"}};
  };
  return {
      {"krl: motions", read_krl,
       [=](int n) { return krl(numbered("LIN {X #,Y 0,Z 0,A 0,B 0,C 0}\n", n)); }},
      {"krl: points of the data list", read_krl,
       [=](int n) {
         Files f = krl(numbered("PTP XP#\n", n));
         f.push_back({"p.dat", "DEFDAT p PUBLIC\n" +
                                   numbered("DECL E6POS XP#={X #,Y 2,Z 3,A 0,B 0,C 0}\n", n) +
                                   "ENDDAT\n"});
         return f;
       }},
      {"krl: blocks", read_krl,
       [=](int n) { return krl(repeated("IF $IN[1] THEN\n$OUT[2]=TRUE\nENDIF\n", n)); }},
      {"krl: labels", read_krl, [=](int n) { return krl(numbered("GOTO l#\nl#:\n", n)); }},
      {"krl: variables", read_krl,
       [=](int n) {
         return Files{{"p.src", "DEF p()\n" + numbered("DECL INT v#\n", n) +
                                    numbered("v#=v#+1\n", n) + "END\n"}};
       }},
      {"krl: routines", read_krl,
       [=](int n) {
         return Files{{"p.src", "DEF p()\n" + numbered("q#()\n", n) + "END\n" +
                                    numbered("DEF q#()\n$OUT[1]=TRUE\nEND\n", n)}};
       }},
      {"krl: faults", read_krl, [=](int n) { return krl(numbered("NOBODY KNOWS # THIS\n", n)); }},
      {"krl: one long line", read_krl,
       [=](int n) { return krl("x=1" + repeated("+1", n) + "\n"); }},
      {"rapid: motions", read_rapid,
       [=](int n) {
         return rapid("", numbered("MoveL [[#,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],"
                                   "v100,fine,tool0;\n",
                                   n));
       }},
      {"rapid: points", read_rapid,
       [=](int n) {
         return rapid(numbered("CONST robtarget p#:=[[#,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,"
                               "9E9,9E9]];\n",
                               n),
                      numbered("MoveJ p#,v100,z10,tool0;\n", n));
       }},
      {"rapid: blocks", read_rapid,
       [=](int n) { return rapid("", repeated("IF a=1 THEN\nSet do1;\nENDIF\n", n)); }},
      {"rapid: labels", read_rapid,
       [=](int n) { return rapid("", numbered("GOTO l#;\nl#:\n", n)); }},
      {"rapid: variables", read_rapid,
       [=](int n) { return rapid(numbered("VAR num v#:=1;\n", n), numbered("v#:=v#+1;\n", n)); }},
      {"rapid: routines", read_rapid,
       [=](int n) {
         return rapid(numbered("PROC q#()\nSet do1;\nENDPROC\n", n), numbered("q#;\n", n));
       }},
      {"rapid: faults", read_rapid,
       [=](int n) { return rapid("", numbered("NobodyKnows # \\This;\n", n)); }},
      {"urscript: motions", read_urscript,
       [=](int n) { return ur(numbered("movel(p[#,0,0,0,0,0], v=0.1)\n", n)); }},
      {"urscript: variables", read_urscript,
       [=](int n) {
         return ur("def p():\n" + numbered("  v# = 1\n", n) + numbered("  v# = v# + 1\n", n) +
                   "end\n");
       }},
      {"urscript: blocks", read_urscript,
       [=](int n) {
         return ur("def p():\n" + repeated("  if True:\n    sync()\n  end\n", n) + "end\n");
       }},
      {"urscript: routines", read_urscript,
       [=](int n) {
         return ur(numbered("def q#():\n  set_digital_out(1, True)\nend\n", n) + "def p():\n" +
                   numbered("  q#()\n", n) + "end\n");
       }},
      {"urscript: faults", read_urscript,
       [=](int n) { return ur("def p():\n" + numbered("  nobody#(knows, this)\n", n) + "end\n"); }},
      {"tp: motions", read_tp,
       [=](int n) {
         return tp(repeated(" 1:L P[1] 100mm/sec FINE ;\n", n),
                   "P[1]{ GP1: CONFIG : 'N U T, 0, 0, 0', X = 1 mm, Y = 2 mm, Z = 3 mm, W = 0 deg, "
                   "P = 0 deg, R = 0 deg };\n");
       }},
      {"tp: points", read_tp,
       [=](int n) {
         return tp(numbered(" #:L P[#] 100mm/sec FINE ;\n", n),
                   numbered("P[#]{ GP1: CONFIG : 'N U T, 0, 0, 0', X = # mm, Y = 2 mm, Z = 3 mm, W "
                            "= 0 deg, P = 0 deg, R = 0 deg };\n",
                            n));
       }},
      {"tp: labels", read_tp,
       [=](int n) { return tp(numbered(" 1:JMP LBL[#] ;\n 2:LBL[#] ;\n", n), ""); }},
      {"tp: registers", read_tp, [=](int n) { return tp(numbered(" 1:R[#]=R[#]+1 ;\n", n), ""); }},
      {"tp: faults", read_tp, [=](int n) { return tp(numbered(" 1:NOBODY KNOWS[#] ;\n", n), ""); }},
      {"melfa: motions", read_melfa,
       [=](int n) { return melfa(repeated("Mvs P1\n", n) + "P1=(1,2,3,0,0,0)(7,0)\n"); }},
      {"melfa: points", read_melfa,
       [=](int n) {
         return melfa(numbered("Mov P#\n", n) + numbered("P#=(#,2,3,0,0,0)(7,0)\n", n));
       }},
      {"melfa: labels", read_melfa, [=](int n) { return melfa(numbered("GoTo *L#\n*L#\n", n)); }},
      {"melfa: variables", read_melfa, [=](int n) { return melfa(numbered("MV#=MV#+1\n", n)); }},
      {"melfa: blocks", read_melfa,
       [=](int n) { return melfa(repeated("If M_In(1)=1 Then\nM_Out(2)=1\nEndIf\n", n)); }},
      {"melfa: faults", read_melfa, [=](int n) { return melfa(numbered("Nobody # Knows\n", n)); }},
      {"gcode: motions", read_gcode,
       [=](int n) { return gcode(numbered("G1 X# Y0 Z0 F100\n", n)); }},
      {"gcode: words", read_gcode, [=](int n) { return gcode("G1" + repeated(" X1", n) + "\n"); }},
      {"gcode: arcs", read_gcode,
       [=](int n) {
         return gcode("G17 F100\n" + repeated("G2 X10 Y0 I5 J0\nG2 X0 Y0 I-5 J0\n", n));
       }},
      {"gcode: faults", read_gcode, [=](int n) { return gcode(repeated("Q7 $ G999\n", n)); }},
      {"val3: statements", read_val3, [=](int n) { return val3(repeated("delay(1)\n", n)); }},
      {"val3: points", read_val3,
       [=](int n) {
         return val3(numbered("movej(p#,flange,m)\n", n),
                     "<Data name=\"m\" type=\"mdesc\"><Value key=\"0\" vel=\"80\"/></Data>\n" +
                         numbered("<Data name=\"p#\" type=\"pointRx\" size=\"1\"><Value key=\"0\" "
                                  "x=\"#\" fatherId=\"world[0]\"/></Data>\n",
                                  n));
       }},
      {"val3: values of one variable", read_val3,
       [=](int n) {
         return val3("delay(1)\n", "<Data name=\"v\" type=\"num\" size=\"" + std::to_string(n) +
                                       "\">" + numbered("<Value key=\"#\" value=\"#\"/>", n) +
                                       "</Data>\n");
       }},
      {"val3: blocks", read_val3,
       [=](int n) { return val3(repeated("if true\ndelay(1)\nendIf\n", n)); }},
      {"val3: faults", read_val3, [=](int n) { return val3(numbered("nobody#(knows)\n", n)); }},
  };
}

TEST(ProgramGrowth, ReadersGrowWithTheText) {
  for (const Foreign& f : foreign())
    expect_growth(std::string("read ") + f.name, [&](int n) {
      const Files files = f.files(n);
      return [files, &f] {
        std::vector<SourceFile> all;
        for (const File& one : files) all.push_back({one.name, one.text, {}});
        ProgramReaderTask task;
        task.files = all;
        NoProgress progress;
        const test::ReaderSettings params;
        const auto made = f.read(task, params, progress);
        ASSERT_TRUE(made.ok()) << f.name << ": " << made.error().sentence();
        EXPECT_FALSE((*made)->files().empty());
      };
    });
}

}  // namespace
}  // namespace robomosp::program
