// SPDX-License-Identifier: Apache-2.0
// Posts: what they write of programs (files in tests/unit/posts, read line by line against the
// rules of each controller), what they refuse, and the parts that they are made of.
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <tuple>
#include <utility>

#include "support/posts.h"

#include "krl.h"
#include "program/flatten.h"
#include "program/trace.h"
#include "program_post/templates.h"
#include "rapid.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::expect_golden;
using test::post_source;
using test::Posted;

const fs::path kPrograms = fs::path(ROBOMOSP_SOURCE_DIR) / "tests/unit/posts";

std::array<double, 9> rotation(double z, double y, double x) {
  const double d = post::kDegree;
  const double a = std::cos(z / d), b = std::sin(z / d), c = std::cos(y / d), e = std::sin(y / d),
               f = std::cos(x / d), g = std::sin(x / d);
  return {a * c,
          a * e * g - b * f,
          a * e * f + b * g,
          b * c,
          b * e * g + a * f,
          b * e * f - a * g,
          -e,
          c * g,
          c * f};
}

TEST(PostHelp, OrientationsAreWhatControllersPrint) {
  // The table of the reference: Rz(30) Ry(20) Rx(10), solved there with the converters of others.
  const auto r = rotation(30, 20, 10);
  using post::Orientation;
  const struct {
    Orientation how;
    std::array<double, 4> is;
    double within;
  } kTable[] = {{Orientation::zyx, {30, 20, 10, 0}, 1e-9},
                {Orientation::fixed_xyz, {10, 20, 30, 0}, 1e-9},
                {Orientation::xyz, {-1.116, 22.242, 28.452, 0}, 6e-4},
                {Orientation::zyz, {2.727, 22.269, 25.506, 0}, 6e-4},
                {Orientation::quaternion, {.9515, .0381, .1893, .2393}, 6e-5},
                {Orientation::rotation_vector, {.0775, .3849, .4865, 0}, 6e-5}};
  for (const auto& row : kTable) {
    const auto got = post::orientation(r, row.how);
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_NEAR(got[i], row.is[i], row.within) << static_cast<int>(row.how) << " " << i;
  }
}

using M = std::array<double, 9>;
M times(const M& a, const M& b) {
  M out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) out[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return out;
}
M about(char axis, double degrees) {
  return axis == 'x'   ? rotation(0, 0, degrees)
         : axis == 'y' ? rotation(0, degrees, 0)
                       : rotation(degrees, 0, 0);
}
/// What the numbers of a convention mean, by the definition of each.
M meaning(post::Orientation how, const std::array<double, 4>& v) {
  using post::Orientation;
  switch (how) {
    case Orientation::zyx:
      return times(times(about('z', v[0]), about('y', v[1])), about('x', v[2]));
    case Orientation::fixed_xyz:
      return times(times(about('z', v[2]), about('y', v[1])), about('x', v[0]));
    case Orientation::xyz:
      return times(times(about('x', v[0]), about('y', v[1])), about('z', v[2]));
    case Orientation::zyz:
      return times(times(about('z', v[0]), about('y', v[1])), about('z', v[2]));
    default: return {};
  }
}
TEST(PostHelp, AnglesGiveTheMatrixAgainAlsoWhereTheyAreSingular) {
  using post::Orientation;
  for (const auto how :
       {Orientation::zyx, Orientation::fixed_xyz, Orientation::xyz, Orientation::zyz})
    for (const double a : {-180.0, -90.0, 0.0, 33.0, 90.0, 180.0})
      for (const double b : {-180.0, -90.0, 0.0, 20.0, 90.0, 180.0})
        for (const double c : {-120.0, 0.0, 90.0, 180.0}) {
          const M r = rotation(a, b, c);
          const M again = meaning(how, post::orientation(r, how));
          for (std::size_t i = 0; i < 9; ++i)
            ASSERT_NEAR(r[i], again[i], 1e-8)
                << static_cast<int>(how) << " of " << a << " " << b << " " << c;
        }
}
TEST(PostHelp, HalfTurnsHaveAQuaternionAndARotationVector) {
  for (const char axis : {'x', 'y', 'z'}) {
    const auto q = post::quaternion(about(axis, 180));
    double n = 0;
    for (const double x : q) n += x * x;
    EXPECT_NEAR(n, 1, 1e-12);
    EXPECT_GE(q[0], 0);
    const auto v = post::orientation(about(axis, 180), post::Orientation::rotation_vector);
    EXPECT_NEAR(std::hypot(v[0], v[1], v[2]), 3.141592653589793, 1e-9);
  }
}

TEST(PostHelp, NumbersHaveNoMinusZeroAndNoLocale) {
  EXPECT_EQ(post::fixed(-0.0004, 3), "0.000");
  EXPECT_EQ(post::fixed(-0.0006, 3), "-0.001");
  EXPECT_EQ(post::fixed(-0.0, 0), "0");
  EXPECT_EQ(post::fixed(1e300, 1).size(), 303U);
  EXPECT_EQ(post::fixed(std::numeric_limits<double>::infinity(), 2), "nan");
  EXPECT_EQ(post::trimmed(12.5, 3), "12.5");
  EXPECT_EQ(post::trimmed(12, 3), "12");
  EXPECT_EQ(post::trimmed(12, 3, 1), "12.0");
  EXPECT_EQ(post::trimmed(100, 0), "100");
  EXPECT_EQ(post::shortest(-0.0), "0.0");
  EXPECT_EQ(post::shortest(1e-7), "1.0E-07");
  EXPECT_EQ(post::shortest(0.1), "0.1");
  EXPECT_EQ(post::shortest(5), "5.0");
  if (std::setlocale(LC_ALL, "de_DE.UTF-8")) {
    EXPECT_EQ(post::fixed(0.5, 1), "0.5");
    std::setlocale(LC_ALL, "C");
  }
}

TEST(PostHelp, DigitsBelowTheMeaningAreNotPrinted) {
  // Quotients and sines whose last digits depend on the processor.
  EXPECT_EQ(post::shortest(123.4 / 1000), "0.1234");
  EXPECT_EQ(post::shortest(0.12340000000000001), "0.1234");
  EXPECT_EQ(post::shortest(57.29577951308232), "57.2957795131");
  EXPECT_EQ(post::shortest(-62.609059645193994), post::shortest(-62.60905964519401));
  EXPECT_EQ(post::with_unit_digits(-62.609059645193994), "-62.609059645");
  EXPECT_EQ(post::with_unit_digits(-62.60905964519401), "-62.609059645");
  EXPECT_EQ(post::with_unit_digits(449.99999999999994), "450.0");
  EXPECT_EQ(post::with_unit_digits(-3.06e-17), "0.0");
  // Half a last digit: what is computed falls on the side of what was meant.
  for (const double v : {12.3455, 0.0005, 8.0625, -77.7775, 1234.5678905})
    for (const double error : {-2e-13, 0.0, 2e-13})
      for (int digits = 0; digits < post::kUnitDigits; ++digits)
        EXPECT_EQ(post::fixed(v + error, digits), post::fixed(v, digits)) << v << ", " << digits;
  EXPECT_EQ(post::fixed(449.99999999999994, 0), "450");
  EXPECT_EQ(post::fixed(0.9238795325112867, 12), "0.923879532511");
  EXPECT_EQ(post::without_exponent(1e-7 / 3), "0.0000000333333333333");
  EXPECT_EQ(post::without_exponent(2.5e20), "250000000000000000000.0");
  // What a program says itself stays: few digits, whole numbers, great and small ones.
  for (const auto& [v, text] : std::initializer_list<std::pair<double, const char*>>{
           {1e-12, "1.0E-12"},
           {1.5e-300, "1.5E-300"},
           {5e-324, "5.0E-324"},
           {123456.789012, "123456.789012"},
           {1234567.123456789, "1234567.12345679"},
           {4503599627370497, "4503599627370497.0"},
           {-9007199254740991, "-9007199254740991.0"},
           {1e20, "1.0E20"},
           {1.7976931348623157e308, "1.7976931348623157E308"}}) {
    EXPECT_EQ(post::shortest(v), text);
    EXPECT_EQ(post::shortest(std::strtod(text, nullptr)), text);
  }
  for (const double v : {std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_EQ(post::shortest(v), "nan");
    EXPECT_EQ(post::with_unit_digits(v), "nan");
    EXPECT_EQ(post::without_exponent(v), "nan");
  }
}

TEST(PostHelp, NamesAreCutUniqueAndNeverReserved) {
  PostCapabilities c;
  c.max_name = 6;
  c.name_case = PostCase::upper;
  c.reserved = "IF  LOOP";
  post::Names names(c);
  EXPECT_EQ(names.unique("loop"), "LOOP2");
  EXPECT_EQ(names.unique("position_of_a"), "POSITI");
  EXPECT_EQ(names.unique("position_of_b"), "POSIT2");
  EXPECT_EQ(names.unique("positi"), "POSIT3");
  EXPECT_EQ(names.unique("9lives"), "X9LIVE");
  EXPECT_EQ(names.unique(""), "X");
  EXPECT_EQ(names.unique("gr\xc3\xbc"), "GR__");
  EXPECT_EQ(names.of(7, "a"), "A");
  EXPECT_EQ(names.of(7, "b"), "A");
}

TEST(PostHelp, ModalValuesAreWrittenWhereTheyChange) {
  post::Modal<int> m;
  EXPECT_TRUE(m.changes(1));
  EXPECT_FALSE(m.changes(1));
  EXPECT_TRUE(m.changes(2));
  m.forget();
  EXPECT_TRUE(m.changes(2));
}

// ---- the walk ----

/// A language that has begin and end of routines only.
class Bare final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override {
    static const PostCapabilities c = [] {
      PostCapabilities all;
      all.features = ~0ULL;
      all.motions = ~0U;
      all.title = "Bare";
      return all;
    }();
    return c;
  }
  Result<void> write(const PostTask& task, const Params&, PostOutput& out,
                     Progress& progress) const override {
    class W final : public post::Writer {
     public:
      using Writer::Writer;

     private:
      void begin() override { out_ = &f_; }
      void routine_begin(std::uint32_t) override { line("begin"); }
      void routine_end(std::uint32_t) override { line("end"); }
      void finish() override { f_.give(output_, "bare.txt", false); }
      std::span<const post::Operator> operators() const override { return {}; }
      post::File f_;
    };
    return W(task, out, capabilities(), progress).run();
  }
};

TEST(PostWriter, WhatAPostDoesNotOverrideIsAnErrorAtItsLine) {
  const std::string head =
      "PROGRAM p;\nSIGNAL INPUT BOOL: s AT 1;\nOUTPUT BOOL: o AT 2;\nVAR INT: i;\nREAL: x;\n"
      "POSE: a;\nPROCEDURE q ();\nBEGIN\nENDPROC;\nPROCESS w;\nBEGIN\nENDPROCESS;\n"
      "INTERRUPT z WHEN s;\nBEGIN\nENDINTERRUPT;\nBEGIN\n";  // 16 lines
  const std::pair<const char*, const char*> kEach[] = {
      {"i := 1;", "assignments"},
      {"o := TRUE;", "outputs"},
      {"q();", "calls of procedures"},
      {"WRITELN('a');", "messages (WRITE)"},
      {"IF s THEN ENDIF;", "IF"},
      {"WHILE s ENDWHILE;", "WHILE"},
      {"REPEAT UNTIL s;", "REPEAT"},
      {"LOOP EXIT; ENDLOOP;", "EXIT"},
      {"FOR i := 1 TO 2 ENDFOR;", "FOR"},
      {"CASE i OF WHEN 1: ENDCASE;", "CASE"},
      {"GOTO l; LABEL l:", "GOTO"},
      {"RETURN;", "RETURN"},
      {"WAIT 1.0 SEC;", "WAIT ... SEC"},
      {"WAIT FOR s;", "WAIT FOR"},
      {"WAIT FOR s TIMEOUT 1.0;", "WAIT FOR with a TIMEOUT"},
      {"PAUSE;", "PAUSE"},
      {"HALT;", "HALT"},
      {"MOVE PTP a;", "PTP motions"},
      {"MOVE LIN a;", "LIN motions"},
      {"MOVE CIRCLE a, a;", "CIRCLE motions"},
      {"MOVE PATH a, a;", "PATH motions"},
      {"START w;", "parallel processes"},
      {"ENABLE z;", "interrupts"}};
  for (const auto& [statement, what] : kEach) {
    const Posted got = post_source(Bare(), head + statement + "\nENDPROGRAM;\n");
    EXPECT_NE(got.faults.find("error 17: Bare has no " + std::string(what) + "."),
              std::string::npos)
        << statement << "\n"
        << got.faults;
  }
}

TEST(PostWriter, AnEmptyProgramAndALongOneAreWritten) {
  EXPECT_EQ(post_source(Bare(), "PROGRAM p;\nBEGIN\nENDPROGRAM;\n").files.at("bare.txt"),
            "begin\nend\n");
}

TEST(Krl, WhatALaterMotionOfALoopSetsIsTakenBackAtItsBegin) {
  const std::string source =
      "PROGRAM p;\nVAR INT: i;\nPOSE: a := POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 180.0, "
      "0.0));\nBEGIN\nFOR i := 1 TO 2\nMOVE LIN a;\n"
      "MOVE LIN a ACC := 50.0 TOOL := a FRAME := a;\nENDFOR;\nENDPROGRAM;\n";
  const std::string krl = post_source(posts::Krl(), source).files.at("P.src");
  const std::string body = krl.substr(krl.find("FOR "));
  const std::string before = body.substr(0, body.find("LIN "));
  for (const char* each : {"$TOOL=$NULLFRAME", "$BASE=$NULLFRAME", "$ACC.CP=2.3"})
    EXPECT_NE(before.find(each), std::string::npos) << each << "\n" << krl;
  const std::string rapid = post_source(posts::Rapid(), source).files.at("p.mod");
  const std::string loop = rapid.substr(rapid.find("FOR "));
  const std::string ahead = loop.substr(0, loop.find("MoveL "));
  for (const char* each : {"RmpTool.tframe:=", "RmpFrame.uframe:=", "AccSet 100,100"})
    EXPECT_NE(ahead.find(each), std::string::npos) << each << "\n" << rapid;
}

// ---- passes ----

TEST(Legalise, WhatATargetLacksIsSaidWithWhatItHas) {
  // RAPID has no REPEAT, LOOP and EXIT, KRL no ELSIF: the files of words.irl show each.
  const std::string words = test::read_text(kPrograms / "words.irl");
  const std::string rapid = post_source(posts::Rapid(), words).files.at("words.mod");
  EXPECT_EQ(rapid.find("REPEAT"), std::string::npos);
  EXPECT_NE(rapid.find("WHILE TRUE DO"), std::string::npos);
  EXPECT_NE(rapid.find("GOTO loop_end;"), std::string::npos);
  const std::string krl = post_source(posts::Krl(), words).files.at("WORDS.src");
  EXPECT_EQ(krl.find("ELSIF"), std::string::npos);
}

/// KRL without some of its features.
class Less final : public Post {
 public:
  explicit Less(std::uint64_t features) : caps_(krl_.capabilities()) {
    caps_.features &= ~features;
  }
  [[nodiscard]] const PostCapabilities& capabilities() const override { return caps_; }
  Result<void> write(const PostTask& task, const Params& params, PostOutput& out,
                     Progress& progress) const override {
    return krl_.write(task, params, out, progress);
  }

 private:
  posts::Krl krl_;
  PostCapabilities caps_;
};
TEST(Legalise, ForBecomesWhileAndItsVariableKeepsTheLastValue) {
  const std::string src = post_source(Less(kPostFor),
                                      "PROGRAM p;\nVAR INT: i, n;\nBEGIN\nFOR i := 1 TO n STEP 2\n"
                                      "IF i = 3 THEN EXIT; ENDIF;\nENDFOR;\nENDPROGRAM;\n")
                              .files.at("P.src");
  const std::string loop =
      "  LAST=N\n  I=1\n  COUNTER=I\n  WHILE COUNTER<=LAST\n    I=COUNTER\n    IF I==3 THEN\n"
      "      EXIT\n    ENDIF\n    COUNTER=COUNTER+2\n  ENDWHILE\n";
  EXPECT_NE(src.find(loop), std::string::npos) << src;
}
/// Controllers leave a FOR's variable elsewhere than IRL does: 4 behind FOR I=1 TO 3.
TEST(Legalise, AForWhoseVariableIsReadBehindItBecomesAWhileThatKeepsIt) {
  const auto text = [](const std::string& declarations, const std::string& statements) {
    const Posted p = post_source(posts::Krl(),
                                 "PROGRAM p;\nSIGNAL OUTPUT BOOL: o AT 1;\nVAR INT: "
                                 "i, n;\n" +
                                     declarations + "BEGIN\n" + statements + "\nENDPROGRAM;\n");
    EXPECT_EQ(p.faults, "");
    return p.files.at("P.src");
  };
  const std::string loop = "FOR i := 1 TO 3 o := TRUE; ENDFOR; ";
  const std::string kKept[] = {loop + "n := i;", loop + "IF i = 3 THEN o := FALSE; ENDIF;",
                               // It runs again, and reads what the run before left.
                               "FOR n := 1 TO 2 o := i = 3; " + loop + "ENDFOR;",
                               "LABEL l: o := i = 3; " + loop + "IF o THEN GOTO l; ENDIF;",
                               // The head of another loop over it.
                               loop + "FOR i := i TO 5 o := TRUE; ENDFOR;"};
  for (const std::string& each : kKept) {
    const std::string got = text("", each);
    EXPECT_NE(got.find("WHILE COUNTER"), std::string::npos) << each << "\n" << got;
  }
  EXPECT_NE(text("PROCEDURE q; BEGIN o := i = 3; ENDPROC;\n", loop + "q;").find("WHILE COUNTER"),
            std::string::npos);
  const std::string kPlain[] = {loop, "n := i; i := 2; " + loop, loop + loop,
                                "FOR i := 1 TO 3 n := n + i; ENDFOR;",
                                "FOR n := 1 TO 2 FOR i := 1 TO 3 o := i = n; ENDFOR; ENDFOR;"};
  for (const std::string& each : kPlain) {
    const std::string got = text("", each);
    EXPECT_EQ(got.find("WHILE"), std::string::npos) << each << "\n" << got;
    EXPECT_NE(got.find("FOR I=1 TO 3"), std::string::npos) << each << "\n" << got;
  }
}

/// A search ends at once where the signal is as asked already; \NegFlank would wait for the edge.
TEST(Rapid, ASearchForAnInvertedSignalLooksForItsLevel) {
  const std::string source =
      "PROGRAM p;\nSIGNAL INPUT BOOL: s AT 1;\nVAR POSE: q := POSE(POSITION(500.0, 0.0, 300.0), "
      "ORIZYX(0.0, 180.0, 0.0));\nBEGIN\nMOVE LIN q UNTIL s;\nENDPROGRAM;\n";
  for (const bool inverted : {false, true}) {
    PostSignal signal;
    signal.name = "s";
    signal.number = 7;
    signal.inverted = inverted;
    test::PostWith with;
    with.profile.signals = {&signal, 1};
    const Posted p = post_source(posts::Rapid(), source, with);
    EXPECT_EQ(p.faults.find("error"), std::string::npos) << p.faults;
    const std::string& text = p.files.begin()->second;
    EXPECT_NE(
        text.find(inverted ? "SearchL\\SStop,di7\\LowLevel,RmpHit," : "SearchL\\SStop,di7,RmpHit,"),
        std::string::npos)
        << text;
  }
}

TEST(Legalise, CaseBecomesIfAndLooksAtItsSelectorOnce) {
  const std::string src =
      post_source(Less(kPostCase),
                  "PROGRAM p;\nVAR INT: i;\nBEGIN\nCASE i + 1 OF\nWHEN 1, 2: i := 5;\n"
                  "DEFAULT: i := 6;\nENDCASE;\nENDPROGRAM;\n")
          .files.at("P.src");
  const std::string chain =
      "  SELECTOR=I+1\n  IF (SELECTOR==1) OR (SELECTOR==2) THEN\n    I=5\n  ELSE\n    I=6\n  "
      "ENDIF\n";
  EXPECT_NE(src.find(chain), std::string::npos) << src;
}

TEST(Legalise, RecursionThatATargetHasNotIsALoopOrAnErrorAtItsRoutine) {
  PostCapabilities c = posts::Krl().capabilities();
  c.features &= ~static_cast<std::uint64_t>(kPostRecursion);
  const std::string source = test::read_text(kPrograms / "hanoi.irl");
  const SourceFile file{"hanoi.irl", source, {}};
  NoProgress progress;
  const auto made = irl::compile(std::span(&file, 1), progress);
  ASSERT_TRUE(made.ok());
  const auto legal = program_post::legalise((*made)->code(), c);
  ASSERT_EQ(legal.remarks.size(), 1U);
  EXPECT_EQ(legal.remarks[0].severity, std::uint32_t{RMP_FAULT_NOTE});
  EXPECT_EQ(legal.remarks[0].message,
            "KUKA KRL has no recursive routines, such as solve does: it is a loop with a "
            "stack there, for at most 32 nested calls");
  c.features &= ~static_cast<std::uint64_t>(kPostArrays);
  const auto without = program_post::legalise((*made)->code(), c);
  ASSERT_EQ(without.remarks.size(), 1U);
  EXPECT_EQ(without.remarks[0].severity, std::uint32_t{RMP_FAULT_ERROR});
  EXPECT_EQ(without.remarks[0].message,
            "KUKA KRL has no recursive routines, such as solve does, and lacks the features needed "
            "for a stack (arrays)");
}

// ---- points ----

TEST(KnownPoints, AreTheValuesOfConstantsAndOfVariablesThatNothingAssigns) {
  const std::string source =
      "PROGRAM p;\nVAR\n"
      "POSE: a := POSE(POSITION(100.0, 0.0, 0.0), ORIZYX(90.0, 0.0, 0.0));\n"
      "POSE: b := POSE(POSITION(10.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 30.0));\n"
      "POSE: c;\nBEGIN\n"
      "MOVE LIN a @ b;\nMOVE LIN INV(a);\nc := a;\nMOVE LIN c;\n"
      "MOVE LIN POSE(a.POS, ORIMULT(a.ORI, b.ORI));\nENDPROGRAM;\n";
  const SourceFile file{"p.irl", source, {}};
  NoProgress progress;
  const auto made = irl::compile(std::span(&file, 1), progress);
  ASSERT_TRUE(made.ok());
  const auto known = program_post::known_points((*made)->code(), nullptr, nullptr);
  std::vector<const PostPoint*> targets;
  for (const PostPoint& p : known.points)
    if (p.motion != RMP_NONE) targets.push_back(&p);
  ASSERT_EQ(targets.size(), 3U);  // c is assigned
  const auto first = post::placed(targets[0]->pose, post::Orientation::zyx);
  EXPECT_NEAR(first.mm[0], 100, 1e-9);
  EXPECT_NEAR(first.mm[1], 10, 1e-9);
  EXPECT_NEAR(first.ori[0], 90, 1e-9);
  EXPECT_NEAR(first.ori[2], 30, 1e-9);
  const auto second = post::placed(targets[1]->pose, post::Orientation::zyx);
  EXPECT_NEAR(second.mm[0], 0, 1e-9);
  EXPECT_NEAR(second.mm[1], 100, 1e-9);
  EXPECT_NEAR(second.ori[0], -90, 1e-9);
  EXPECT_STREQ(targets[0]->q_missing,
               "the joint values of this target are unknown, since no robot is named");
}

// ---- files of controllers ----

class Golden : public testing::TestWithParam<const char*> {};
TEST_P(Golden, Krl) {
  const std::string name = GetParam();
  expect_golden(post_source(posts::Krl(), test::read_text(kPrograms / (name + ".irl"))),
                kPrograms / "krl" / name);
}
TEST_P(Golden, Rapid) {
  const std::string name = GetParam();
  expect_golden(post_source(posts::Rapid(), test::read_text(kPrograms / (name + ".irl"))),
                kPrograms / "rapid" / name);
}
INSTANTIATE_TEST_SUITE_P(Programs, Golden,
                         testing::Values("hanoi", "pickplace", "pallet", "weld", "words"));

TEST(Krl, NoLineIsLongerNoNameIsOverAndDeclarationsComeFirst) {
  for (const char* name : {"hanoi", "pickplace", "pallet", "weld", "words"}) {
    const Posted got =
        post_source(posts::Krl(), test::read_text(kPrograms / (std::string(name) + ".irl")));
    for (const auto& [file, text] : got.files) {
      std::istringstream all(text);
      std::string line;
      bool has_begun = false;
      while (std::getline(all, line)) {
        const std::string word = line.substr(std::min(line.find_first_not_of(' '), line.size()));
        if (word.starts_with("DEF")) has_begun = false;
        else if (word.starts_with("DECL "))
          EXPECT_FALSE(has_begun && file.ends_with(".src")) << line;
        else if (!word.empty()) has_begun = true;
        std::size_t run = 0;
        for (const char c : line) {
          const bool is_part = (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
          run = is_part ? run + 1 : 0;
          EXPECT_LE(run, 24U) << line;
        }
      }
    }
  }
}

TEST(Krl, TheSourceMapLeadsBackToTheLineOfEachMotion) {
  const std::string source = test::read_text(kPrograms / "pickplace.irl");
  const Posted got = post_source(posts::Krl(), source);
  std::istringstream all(got.files.at("PICKPLACE.src")), irl(source);
  std::vector<std::string> lines;
  for (std::string l; std::getline(irl, l);) lines.push_back(l);
  std::string line;
  int motions = 0;
  for (std::uint32_t n = 1; std::getline(all, line); ++n) {
    if (line.find("LIN X") == std::string::npos && line.find("PTP X") == std::string::npos)
      continue;
    ++motions;
    const std::uint32_t from = got.map.at("PICKPLACE.src").at(n);
    EXPECT_NE(lines.at(from - 1).find("MOVE"), std::string::npos) << line;
  }
  EXPECT_EQ(motions, 6);
}

TEST(Krl, BrakeHoldsTheMotionInAnInterruptAndOtherFormsAreErrors) {
  const auto posted = [](const std::string& routine, const std::string& body) {
    return post_source(posts::Krl(),
                       "PROGRAM p;\nVAR POSE: a := POSE(POSITION(400.0, 0.0, 300.0), "
                       "ORIZYX(0.0, 180.0, 0.0)); JOINT: j;\nSIGNAL INPUT BOOL: near AT 2;\n"
                       "INTERRUPT hold WHEN near; BEGIN " +
                           routine + " ENDINTERRUPT;\nBEGIN\nENABLE hold;\nMOVE LIN a;\n" + body +
                           "ENDPROGRAM;\n");
  };
  const Posted good = posted("BRAKE(1); WAIT FOR NOT near;", "");
  EXPECT_EQ(good.faults.find("error"), std::string::npos) << good.faults;
  const std::string& src = good.files.at("P.src");
  EXPECT_NE(src.find("DEF HOLD( )\n  BRAKE\n  WAIT FOR NOT $IN[2]\n"), std::string::npos) << src;
  for (const auto& [routine, body, said] :
       {std::tuple("BRAKE;", "", "error 4: KUKA KRL has no BRAKE that ends a motion"),
        {"WAIT 0.1 SEC;", "BRAKE(1);\n", "error 8: KUKA KRL has no BRAKE outside an interrupt"},
        {"WAIT 0.1 SEC;", "j := R_JOINT_ACT;\n", "error 8: KUKA KRL has no R_JOINT_ACT()"}}) {
    const Posted got = posted(routine, body);
    EXPECT_NE(got.faults.find(said), std::string::npos) << got.faults;
  }
}

TEST(Krl, ComputedSpeedsAreSetAgain) {
  const Posted got = post_source(
      posts::Krl(),
      "PROGRAM p;\nVAR REAL: v;\nPOSE: a := POSE(POSITION(1.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\n"
      "BEGIN\nv := 100.0;\nMOVE LIN a SPEED := v;\nv := 200.0;\nMOVE LIN a SPEED := v;\n"
      "MOVE LIN a SPEED := 50.0;\nMOVE LIN a SPEED := 50.0;\nENDPROGRAM;\n");
  const std::string& src = got.files.at("P.src");
  std::size_t n = 0;
  for (std::size_t at = src.find("$VEL.CP="); at != std::string::npos;
       at = src.find("$VEL.CP=", at + 1))
    ++n;
  EXPECT_EQ(n, 3U) << src;
}

TEST(Krl, AxesOfTheProfileGiveTheControllersAngles) {
  const PostAxis axes[] = {{"A1", 0, false, false, -1, 10, 0, 0, 0, {}, {}, 0, {}},
                           {"A2", 1, false, false, 1, 0, 0, -20, 20, {}, {}, 0, {}},
                           {"E1", 0, true, true, 2, 1, 0, 0, 0, {}, {}, 0, {}}};
  test::PostWith with;
  with.profile.axes = axes;
  const std::string head = "PROGRAM p;\nBEGIN\nMOVE PTP JOINT(MAIN_JOINT(30.0, ";
  const std::string tail = ", 0.0, 0.0, 0.0, 0.0), ADD_JOINT(5.0));\nENDPROGRAM;\n";
  EXPECT_NE(post_source(posts::Krl(), head + "15.0" + tail, with)
                .files.at("P.dat")
                .find("{A1 -20.0000,A2 15.0000,E1 11.000}"),
            std::string::npos);
  EXPECT_EQ(post_source(posts::Krl(), head + "25.0" + tail, with).faults,
            "error 3: axis A2 would be at 25, outside its limits of -20 to 20. Move the target, or "
            "choose another configuration.\n");
}

// Additional joints were dropped without a word where the profile names no external axis.
TEST(Posts, AdditionalJointsAreWrittenWhereTheTargetHasThem) {
  const std::string source =
      "PROGRAM p;\nBEGIN\nMOVE PTP JOINT(MAIN_JOINT(10.0, 20.0, 30.0, 40.0, 50.0, 60.0), "
      "ADD_JOINT(12.5));\nMOVE LIN ROBTARGET(POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 180.0, "
      "0.0)), 0, [0, 0], ADD_JOINT(0.5));\nENDPROGRAM;\n";
  const auto krl = post_source(posts::Krl(), source);
  EXPECT_NE(krl.files.at("P.dat").find("A6 60.0000,E1 12.500}"), std::string::npos)
      << krl.files.at("P.dat");
  EXPECT_NE(krl.files.at("P.dat").find(",E1 0.500}"), std::string::npos) << krl.files.at("P.dat");
  EXPECT_NE(krl.faults.find("note 3: additional joints are written as the external axes"),
            std::string::npos)
      << krl.faults;
  const auto rapid = post_source(posts::Rapid(), source);
  const std::string& module = rapid.files.at("p.mod");
  EXPECT_NE(module.find("[12.5,9E9,9E9,9E9,9E9,9E9]]"), std::string::npos) << module;
  EXPECT_NE(module.find("[0.5,9E9,9E9,9E9,9E9,9E9]]"), std::string::npos) << module;
  // A profile that has other external axes does not lose it either.
  const PostAxis axes[] = {{"E1", 1, true, true, 1, 0, 0, 0, 0, {}}};
  test::PostWith with;
  with.profile.axes = axes;
  EXPECT_NE(
      post_source(posts::Krl(), source, with)
          .faults.find("error 3: additional joint 1 of this target is at 12.5, and the profile "
                       "has no external axis for it"),
      std::string::npos);
  // Joints that are 0 everywhere are no axes.
  const auto none = post_source(posts::Krl(),
                                "PROGRAM p;\nBEGIN\nMOVE LIN ROBTARGET(POSE(POSITION(500.0, 0.0, "
                                "300.0), ORIZYX(0.0, 180.0, 0.0)), 0, [0, 0], ADD_JOINT(0.0));\n"
                                "ENDPROGRAM;\n");
  EXPECT_EQ(none.files.at("P.dat").find("E1"), std::string::npos);
}

TEST(Posts, ConfigurationsThatAreGuessedAreNotHeldTo) {
  const std::string head = "PROGRAM p;\nBEGIN\nMOVE PTP ", tail = ";\nENDPROGRAM;\n";
  const auto module = [&](const std::string& target) {
    return post_source(posts::Rapid(), head + target + tail).files.at("p.mod");
  };
  EXPECT_NE(
      module("POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0))").find("ConfJ\\Off;"),
      std::string::npos);
  EXPECT_NE(module("MAIN_JOINT(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)").find("ConfJ\\On;"),
            std::string::npos);
}

TEST(Posts, NamesThatChangeAreNoted) {
  const std::string source =
      "PROGRAM p;\nVAR\n  REAL: load, weight;\nBEGIN\nload := 1.0;\nweight := load;\nload := "
      "weight;\nENDPROGRAM;\n";
  const auto rapid = post_source(posts::Rapid(), source);
  EXPECT_EQ(rapid.faults.find("weight"), std::string::npos) << rapid.faults;
  const std::size_t at = rapid.faults.find("note 3: load is called load2 there");
  const bool is_word = rapid.files.at("p.mod").find("VAR num load2;") != std::string::npos;
  EXPECT_EQ(at != std::string::npos, is_word) << rapid.faults << rapid.files.at("p.mod");
  // A word of the language that a variable is called by.
  const auto krl = post_source(posts::Krl(),
                               "PROGRAM p;\nVAR\n  REAL: frame;\nBEGIN\nframe := 1.0;\nframe := "
                               "frame + 1.0;\nENDPROGRAM;\n");
  EXPECT_NE(krl.faults.find("note 3: frame is called FRAME2 there"), std::string::npos)
      << krl.faults << krl.files.at("P.src");
  EXPECT_EQ(krl.faults.find("P is called"), std::string::npos) << krl.faults;
  // The program, too: C is a word of KRL.
  const auto c = post_source(posts::Krl(), "PROGRAM c;\nBEGIN\nWAIT 1.0 SEC;\nENDPROGRAM;\n");
  EXPECT_TRUE(c.files.contains("C2.src"));
  EXPECT_NE(c.faults.find("c is called C2 there"), std::string::npos) << c.faults;
}

TEST(Posts, NumbersArePrintedToTheirMeaning) {
  const std::string source =
      "PROGRAM p;\nBEGIN\nMOVE LIN POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0)) "
      "SPEED "
      ":= 123.4;\nENDPROGRAM;\n";
  EXPECT_NE(post_source(posts::Krl(), source).files.at("P.src").find("$VEL.CP=0.1234\n"),
            std::string::npos);
}

TEST(Posts, WhatTheyCannotSayIsAnErrorAtItsLine) {
  const std::string source =
      "PROGRAM p;\nVAR STRING: s;\nLIST OF INT: l;\nPOSE: a;\nBEGIN\ns := 'a';\nLIST_ADD(l, 1);\n"
      "MOVE LIN a WOBBLE := TRUE;\nMOVE LIN a TIME := 2.0;\nENDPROGRAM;\n";
  const std::string krl = post_source(posts::Krl(), source).faults;
  for (const char* each : {"error 2: KUKA KRL has no variables of STRING",
                           "error 7: KUKA KRL has no LIST_ADD", "error 8: KUKA KRL has no weaving",
                           "error 9: KUKA KRL has no motions with a given duration"})
    EXPECT_NE(krl.find(each), std::string::npos) << each << "\n" << krl;
  const std::string rapid = post_source(posts::Rapid(), source).faults;
  EXPECT_NE(rapid.find("error 7: ABB RAPID has no LIST_ADD"), std::string::npos) << rapid;
  EXPECT_NE(rapid.find("error 8: ABB RAPID has no weaving"), std::string::npos) << rapid;
  EXPECT_EQ(rapid.find("error 9"), std::string::npos) << rapid;  // it has \T
}

// ---- flattened programs ----

struct Flat {
  program::Trace trace;
  Posted posted;
};
Flat flat_of(const Post& post, const std::string& source, const program::TraceOptions& options) {
  Flat out;
  const SourceFile file{"p.irl", source, {}};
  NoProgress progress;
  auto made = irl::compile(std::span(&file, 1), progress);
  EXPECT_TRUE(made.ok());
  auto trace = program::trace(std::shared_ptr<const CompiledProgram>(std::move(*made)), options);
  EXPECT_TRUE(trace.ok()) << (trace.ok() ? "" : trace.error().sentence());
  if (!trace.ok()) return out;
  out.trace = std::move(*trace);
  auto tables = program::flatten(out.trace);
  EXPECT_TRUE(tables.ok()) << (tables.ok() ? "" : tables.error().sentence());
  if (tables.ok()) out.posted = test::post_code(post, (*tables)->code());
  return out;
}

/// "PTP X Y Z A B C" of each motion of a program in KRL, by the .dat's points: what is written, not
/// how it was made.
std::vector<std::pair<std::string, std::array<double, 6>>> krl_motions(const Posted& p,
                                                                       const std::string& name) {
  std::map<std::string, std::array<double, 6>> points;
  std::istringstream dat(p.files.at(name + ".dat")), src(p.files.at(name + ".src"));
  for (std::string l; std::getline(dat, l);) {
    if (!l.starts_with("DECL E6POS ")) continue;
    std::array<double, 6> v{};
    const std::size_t eq = l.find('=');
    if (std::sscanf(l.c_str() + eq, "={X %lf,Y %lf,Z %lf,A %lf,B %lf,C %lf", v.data(), &v[1], &v[2],
                    &v[3], &v[4], &v[5]) == 6)
      points[l.substr(11, eq - 11)] = v;
  }
  std::vector<std::pair<std::string, std::array<double, 6>>> out;
  for (std::string l; std::getline(src, l);) {
    std::istringstream words(l);
    std::string word, point;
    words >> word >> point;
    if (word == "PTP" || word == "LIN") out.emplace_back(word, points.at(point));
  }
  return out;
}

TEST(Flat, KrlSaysWhatTheInterpreterDid) {
  // Numbers of motions by hand: 7 transfers of 2 PTP and 4 LIN; 24 cells of 2 PTP and 2 LIN.
  const std::tuple<const char*, const char*, std::size_t, std::size_t> kEach[] = {
      {"hanoi", "TOWERS", 14, 28}, {"pallet", "PALLET", 48, 48}};
  for (const auto& [file, name, ptp, lin] : kEach) {
    const Flat flat =
        flat_of(posts::Krl(), test::read_text(kPrograms / (std::string(file) + ".irl")), {});
    const auto motions = krl_motions(flat.posted, name);
    std::size_t n = 0, is_ptp = 0;
    for (const auto& entry : flat.trace.entries) {
      const auto* moved = std::get_if<program::TracedMotion>(&entry.what);
      if (!moved) continue;
      ASSERT_LT(n, motions.size());
      ASSERT_TRUE(moved->absolute.at(0).has_value());
      const auto& wanted = *moved->absolute[0];
      const auto& [word, got] = motions[n++];
      is_ptp += word == "PTP";
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(got[i], wanted.position[i], 0.01);
      const M r = rotation(got[3], got[4], got[5]);
      const auto& [w, x, y, z] = wanted.quaternion;
      const M by{1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                 2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                 2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
      for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(r[i], by[i], 1e-5);
    }
    EXPECT_EQ(n, motions.size());
    EXPECT_EQ(is_ptp, ptp);
    EXPECT_EQ(n, ptp + lin);
  }
}
TEST(Flat, SpeedsOfTheSystemCountWhereNoneIsGiven) {
  const Flat flat = flat_of(posts::Krl(),
                            "PROGRAM p;\nVAR POSE: a := POSE(POSITION(1.0, 0.0, 0.0), ORIZYX(0.0, "
                            "0.0, 0.0));\nBEGIN\nMOVE LIN a SPEED := 100.0;\nMOVE LIN a;\n"
                            "ENDPROGRAM;\n",
                            {});
  const std::string& src = flat.posted.files.at("P.src");
  EXPECT_LT(src.find("$VEL.CP=0.1\n"), src.find("$VEL.CP=0.25\n")) << src;
  EXPECT_NE(src.find("$VEL.CP=0.25\n"), std::string::npos);
}

// ---- templates ----

const char* const kPack = R"(robomosp target 1
name: acme
title: Acme ACL
file: {{name|lower}}.acl
longest_name: 8
case: upper
orientation: fixed_xyz
features: inputs wait_for variables if while procedures
motions: ptp_joints ptp_pose lin
== operators
+ "+" 50
- "-" 50
<> "<>" 30
= "=" 30
< "<" 30
AND " and " 20
NOT "not " 25 prefix
== program_begin
begin {{name}}
== program_end
end
== point
{{name}} = ({{x|fixed:2}}, {{y|fixed:2}}, {{z|fixed:2}} / {{a|fixed:2}}, {{b|fixed:2}}, {{c|fixed:2}})
== point_joints
{{name}} = [{{joints}}]
== ptp_joints
[speed_changed] rate {{speed|fixed:0}}%
go {{point}}
== ptp_pose
[speed_changed] rate {{speed|fixed:0}}%
go {{point}}
== lin
[speed_changed] rate {{speed|times:0.06|fixed:1}} m/min
line {{point}}[passes]
[passes] round {{blend}}
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
== else
else
== if_end
endif
== while_begin
while {{condition}}
== while_end
endwhile
== procedure_begin
sub {{name}}
== procedure_end
endsub
== call
call {{name}}
== return
back
== halt
stop
)";

TEST(Templates, AMadeUpControllerIsWrittenByTheFormAlone) {
  const auto pack = program_post::read_templates(kPack, "acme.post");
  ASSERT_TRUE(pack.ok()) << pack.error().sentence();
  const auto post = program_post::make_template_post(*pack);
  const Posted got = post_source(*post, R"(PROGRAM stacking;
SIGNAL
  INPUT BOOL: part_here AT 4;
  OUTPUT BOOL: gripper AT 3;
  OUTPUT INT: lamp AT 8, 4;
VAR
  INT: rounds;
  BOOL: done;
  JOINT: home := JOINT(MAIN_JOINT(0.0, -90.0, 90.5, 0.0, 0.0, 0.0), ADD_JOINT(0.0));
  POSE: place := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(30.0, 20.0, 10.0));
PROCEDURE grip ();
BEGIN
  gripper := TRUE;
  WAIT 0.25 SEC;
ENDPROC;
BEGIN
  MOVE PTP home SPEED_PTP := 50.0;
  WHILE rounds < 3 AND NOT done
    WAIT FOR part_here;
    MOVE LIN place SPEED := 100.0;
    grip();
    MOVE LIN place SPEED := 100.0 C_CP := 5.0;
    IF rounds = 2 THEN lamp := 5; ELSE rounds := rounds + 1; ENDIF;
  ENDWHILE;
  WRITELN('ready');
ENDPROGRAM;
)");
  EXPECT_EQ(got.files.begin()->first, "stacking.acl");
  EXPECT_EQ(got.files.begin()->second, R"(HOME = [0, -90, 90.5, 0, 0, 0]
PLACE = (500.00, 0.00, 120.00 / 10.00, 20.00, 30.00)
begin STACKING
  int ROUNDS = 0
  flag DONE = FALSE
  rate 50%
  go HOME
  while ROUNDS<3 and not (DONE)
    until in(4)
    rate 6.0 m/min
    line PLACE[passes]
    call GRIP
    rate 6.0 m/min
    line PLACE[passes]
    round 5
    if ROUNDS=2
      put 8, 5
    else
      ROUNDS = ROUNDS+1
    endif
  endwhile
  ; ready
end
sub GRIP
  on 3
  rest 250
endsub
)");
  EXPECT_EQ(got.faults, "warning 25: Acme ACL cannot write texts; this one becomes a comment.\n");
}

TEST(Templates, WhatIsMissingOrUnknownIsSaidAtOnceASentenceEach) {
  const auto said = [](const std::string& text) {
    const auto pack = program_post::read_templates(text, "acme.post");
    return pack.ok() ? std::string("fine") : pack.error().message;
  };
  const std::string head = "robomosp target 1\nname: a\nmotions: lin\n";
  const std::string body =
      "== program_begin\n== program_end\n== lin\nGO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}}\n== "
      "output_on\nON\n== output_off\nOFF\n"
      "== wait_time\nREST {{seconds}}\n";
  EXPECT_EQ(said(head + body), "fine");
  EXPECT_EQ(said(""), "acme.post:1:1: the first line is not \"robomosp target 1\"");
  EXPECT_EQ(said("robomosp target 1\n"),
            "acme.post:1:1: it has no name: name: acme; acme.post:1:1: it has no motions: motions: "
            "ptp_joints lin; acme.post:1:1: there is no template \"program_begin\", which every "
            "target needs; acme.post:1:1: there is no template \"program_end\", which every "
            "target needs; acme.post:1:1: there is no template \"output_on\", which every target "
            "needs; acme.post:1:1: there is no template \"output_off\", which every target needs; "
            "acme.post:1:1: there is no template \"wait_time\", which every target needs");
  const std::pair<std::string, const char*> kWrong[] = {
      {"hello\n", "acme.post:1:1: the first line is not \"robomosp target 1\""},
      {head + "features: if\n" + body,
       "acme.post:4:11: there is no template \"if_begin\", which the feature if needs"},
      {head + "features: wings\n" + body, "acme.post:4:11: there is no feature \"wings\""},
      {head + "colour: red\n" + body, "acme.post:4:1: there is no key \"colour\""},
      {head + "digits: many\n" + body, "acme.post:4:9: \"digits\" must be a number from 0 to 12"},
      {head + body + "== fly\n", "acme.post:14:4: there is no construct \"fly\""},
      {head + body + "== lin\n", "the construct \"lin\" already has a template"},
      {head + body + "== halt\n{{speed}}\n", "15:3: \"halt\" has no variable \"speed\""},
      {head + body + "== comment\n; {{text\n", "15:3: {{ is not closed by }}"},
      {head + body + "== comment\ntext}}\n", "15:5: }} has no {{ before it"},
      {head + body + "== comment\n{{te{{text}}\n", "15:1: {{ is not closed by }}"},
      {head + body + "== comment\n{{text|shout}}\n", "15:8: there is no filter \"shout\""},
      {head + body + "== comment\n{{text|fixed}}\n", "the filter fixed needs a number: fixed:2"},
      {head + body + "== output_value\n{{value|fixed:99}}\n", "takes a whole number from 0 to 12"},
      {head + body + "== comment\n{{text|upper:2}}\n", "the filter upper has no number"},
      {head + body + "== comment\n# {{text}}\n", "a line that begins with # is a comment"},
      {head + body + "== comment\n[texd] {{text}}\n", "15:2: \"texd\" is not a variable"},
      {head + body + "== comment\n[not there] {{text}}\n", "\"there\" is not a variable"},
      {head + body + "== comment\n[text {{text}}\n", "[ is not closed by ]"},
      {head + body + "== if_begin\nif\n",
       "14:4: the template \"if_begin\" is of the feature if, which the head does not list"},
      {head + "name: b\n" + body, "4:1: \"name\" is given twice"},
      {head + "file: ../{{name}}\n" + body, "\"file\" must be the name of a file in the program"},
      {head + "points: file\n" + body, "there is no template \"point\""},
      {head + "line_numbers: 10\n" + body, "\"line_numbers\" is the first number and the step"},
      {head + "line_number: N{{line}}\n" + body, "\"line_number\" needs \"line_numbers\""},
      {head + "forms: flat, round\n" + body, "4:14: there is no form \"round\""},
      {head + "title: \xe4\n" + body, "4:8: the byte 0xE4 here is not UTF-8"},
      {"\xff\xfer\0" + head, "the file is UTF-16"},
      {head + body + std::string(5 << 20, '#'), "the pack is larger than 4 MiB"},
      {head + body + "== operators\n+ plus\n",
       "an operator must be: OPERATOR \"SPELLING\" BINDING"},
      {head + body + "== operators\n** \"^\" 5\n", "15:1: there is no operator \"**\""}};
  for (const auto& [text, what] : kWrong)
    EXPECT_NE(said(text).find(what), std::string::npos) << what << "\n" << said(text);
  EXPECT_EQ(said("\xef\xbb\xbf" + head + body), "fine");  // a mark that some editors write
  // What helps is told with the fault.
  std::vector<program_post::PackFault> faults;
  (void)program_post::read_templates(head + body + "== comment\n{{txt}}\n", "a.post", {}, &faults);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].place(), "a.post:15:3");
  EXPECT_EQ(faults[0].hint, "Did you mean \"text\"?");
}

/// A pack of several files, and one program through it.
Posted from_files(const std::map<std::string, std::string>& files, const std::string& source,
                  const test::PostWith& with = {}) {
  const auto pack =
      program_post::read_templates(files.at("pack"), "pack", [&](const std::string& name) {
        const auto it = files.find(name);
        if (it == files.end()) return Result<std::string>(error(ErrorCode::not_found, "none"));
        return Result<std::string>(it->second);
      });
  if (!pack.ok()) {
    Posted out;
    out.faults = pack.error().message;
    return out;
  }
  return post_source(*program_post::make_template_post(*pack), source, with);
}
const char* const kBase =
    "motions: lin\nforms: flat\n== program_begin\nBEGIN\n== program_end\nEND\n== lin\n"
    "GO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}}\n== output_on\nON {{number}}\n== output_off\nOFF "
    "{{number}}\n== wait_time\nREST {{seconds}}\n";
const char* const kTwoMoves =
    "PROGRAM p;\nSIGNAL OUTPUT BOOL: o AT 7;\nVAR POSE: a := POSE(POSITION(12.5, 0.0, 0.0), "
    "ORIZYX(0.0, 0.0, 0.0));\nBEGIN\nMOVE LIN a;\no := TRUE;\nENDPROGRAM;\n";

TEST(Templates, FilesOfAPackIncludeEachOtherAndTheOuterOneHolds) {
  const Posted got = from_files({{"pack",
                                  "robomosp target 1\nname: dialect\ninclude: base.part\n== "
                                  "output_on\nSET {{number|zeros:3}}\n"},
                                 {"base.part", kBase}},
                                kTwoMoves);
  ASSERT_EQ(got.files.size(), 1U) << got.faults;
  EXPECT_EQ(got.files.begin()->second, "BEGIN\n  GO 12.5 0 0 0 0 0\n  SET 007\nEND\n");
  const auto wrong = [](std::map<std::string, std::string> files) {
    return from_files(files, kTwoMoves).faults;
  };
  const std::string head = "robomosp target 1\nname: a\ninclude: ";
  EXPECT_NE(wrong({{"pack", head + "b.part\n"}, {"b.part", "include: pack\n"}})
                .find("b.part:1:10: files include each other in a circle: pack includes b.part "
                      "includes pack"),
            std::string::npos);
  EXPECT_NE(wrong({{"pack", head + "c.part\n"}})
                .find("pack:3:10: the included file \"c.part\" cannot be read"),
            std::string::npos);
  EXPECT_NE(wrong({{"pack", head + "../c.part\n"}}).find("is not in the pack's folder"),
            std::string::npos);
  EXPECT_NE(wrong({{"pack", head + "b.part\n"}, {"b.part", std::string(kBase) + "== fly\n"}})
                .find("b.part:15:4: there is no construct \"fly\""),
            std::string::npos);
  EXPECT_NE(
      wrong({{"pack", head + "b.part\ninclude: c.part\n"}, {"b.part", kBase}, {"c.part", kBase}})
          .find("the construct \"lin\" already has a template"),
      std::string::npos);
  std::map<std::string, std::string> deep{{"pack", head + "1\n"}};
  for (int i = 1; i < 20; ++i) deep[std::to_string(i)] = "include: " + std::to_string(i + 1) + "\n";
  EXPECT_NE(wrong(deep).find("files include each other more than 8 deep"), std::string::npos);
}

TEST(Templates, LinesAreNumberedAndJumpsKnowTheirNumbers) {
  const Posted got = from_files(
      {{"pack",
        "robomosp target 1\nname: basic\nfile: {{name|upper}}.BAS\nline_numbers: 10 "
        "5\nline_number: \"{{line|zeros:4}} \"\nindent: 0\nfeatures: goto procedures\nmotions: "
        "lin\npoints: file\npoints_file: {{name|upper}}.PTS\nangles: none\n== "
        "point\n{{number|pad:3}} "
        "{{x|fixed:1|sign|left:8}}{{y}} {{z}};\n== program_begin\nREM {{name}}\n== "
        "program_end\nEND\n== "
        "lin\nMOVE P{{point_number}}\n== output_on\nON\n== output_off\nOFF\n== wait_time\nREST "
        "{{seconds}}\n== "
        "goto\nGOTO {{label_line}}\n== label\n== procedure_begin\n== procedure_end\nRETURN\n== "
        "call\nGOSUB {{routine_line}}\n== return\nRETURN\n"}},
      "PROGRAM p;\nVAR POSE: a := POSE(POSITION(12.5, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\n"
      "PROCEDURE go; BEGIN MOVE LIN a; ENDPROC;\nBEGIN\nGOTO over;\ngo;\nLABEL over: MOVE LIN "
      "a;\ngo;\nENDPROGRAM;\n");
  ASSERT_EQ(got.files.size(), 2U) << got.faults;
  EXPECT_EQ(got.files.at("P.BAS"),
            "0010 REM p\n0015 GOTO 25\n0020 GOSUB 40\n0025 MOVE P1\n0030 GOSUB 40\n0035 END\n"
            "0040 MOVE P1\n0045 RETURN\n");
  EXPECT_EQ(got.files.at("P.PTS"), "  1 +12.5   0 0;\n");
}

TEST(Templates, NothingIsSpoiltByTextsNumbersAndLengths) {
  const std::string head = "robomosp target 1\nname: a\nfeatures: messages\n" + std::string(kBase);
  const auto said = [&](const std::string& pack, const std::string& statement) {
    return from_files({{"pack", pack}}, "PROGRAM p;\nBEGIN\n" + statement + "\nENDPROGRAM;\n");
  };
  const std::string print = head + "== message\nPRINT \"{{text}}\"\n";
  EXPECT_EQ(said(print, "WRITELN('so it is');").files.at("p.txt"),
            "BEGIN\n  PRINT \"so it is\"\nEND\n");
  EXPECT_NE(said(print, "WRITELN('a \"b\"');").faults.find("error 3: a has no notation for \""),
            std::string::npos);
  const std::string far = "MOVE LIN POSE(POSITION(1.0E300, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));";
  EXPECT_NE(said(print, far).faults.find("error 3: the number x here is beyond"),
            std::string::npos);
  const std::string narrow = "longest_line: 9\n";
  const auto at = print.find("features");
  EXPECT_NE(said(print.substr(0, at) + narrow + print.substr(at), "WRITELN('so it is');")
                .faults.find("error 3: a line here has 18 characters, and a takes 9"),
            std::string::npos);
  // Lines of the controller's record are not lost.
  test::PostWith with;
  with.profile.prologue = "INIT\n";
  with.profile.epilogue = "DONE\n";
  EXPECT_EQ(from_files({{"pack", print}}, "PROGRAM p;\nBEGIN\nWAIT 1.0 SEC;\nENDPROGRAM;\n", with)
                .files.at("p.txt"),
            "BEGIN\n  INIT\n  REST 1\n  DONE\nEND\n");
}
/// A pack whose sections, and lines of its head, are those of a few and the given ones.
std::string small_pack(
    const std::string& head, const std::string& sections,
    const std::string& lin = "GO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}} {{speed}}") {
  std::string base = "robomosp target 1\nname: a\nmotions: lin\n" + head +
                     "== program_begin\nBEGIN\n== program_end\nEND\n== output_on\nON {{number}}\n"
                     "== output_off\nOFF {{number}}\n== wait_time\nREST {{seconds}}\n";
  if (!lin.empty()) base += "== lin\n" + lin + "\n";
  return base + sections;
}
const char* const kVariables =
    "== declare_int\nINT {{name}}={{value}}\n== declare_real\nREAL {{name}}={{value}}\n"
    "== declare_bool\nBOOL {{name}}={{value}}\n== assign\n{{name}}={{value}}\n"
    "== operators\n+ \"+\" 50\n* \"*\" 60\n< \"<\" 30\nNOT \"not\" 25 prefix\n";
Posted of_small(const std::string& pack, const std::string& declared, const std::string& statements,
                const test::PostWith& with = {}) {
  return from_files({{"pack", pack}},
                    "PROGRAM p;\n" + declared + "\nBEGIN\n" + statements + "\nENDPROGRAM;\n", with);
}
std::string said_of(const std::string& pack) {
  const auto read = program_post::read_templates(pack, "a.post");
  return read.ok() ? std::string("fine") : read.error().message;
}

TEST(Templates, WhetherAWaitRanOutOfTimeIsSetByTheTemplateOrRefused) {
  const std::string signals = "SIGNAL INPUT BOOL: ready AT 1; OUTPUT BOOL: g AT 3;";
  const std::string asks = "WAIT FOR ready TIMEOUT 2.0; IF R_TIMEOUT THEN g := TRUE; ENDIF;";
  const std::string head = "features: inputs wait_for wait_timeout variables if\n";
  const std::string rest = std::string(kVariables) +
                           "== input\nDI{{number}}\n== wait_for\nUNTIL {{condition}}\n"
                           "== if_begin\nIF {{condition}}\n== else\nELSE\n== if_end\nENDIF\n"
                           "== wait_for_timeout\nUNTIL {{condition}} MAX {{seconds}}\n";
  EXPECT_NE(
      of_small(small_pack(head, rest), signals, asks)
          .faults.find("error 4: a has no outcome of WAIT FOR with a TIMEOUT (R_TIMEOUT): the "
                       "template \"wait_for_timeout\" does not set {{timed_out}}"),
      std::string::npos);
  const std::string sets = rest + "[timed_out] {{timed_out}}=not ({{condition}})\n";
  Posted got = of_small(small_pack(head, sets), signals, asks);
  EXPECT_EQ(got.files["p.txt"],
            "BEGIN\n  BOOL R_TIMEOUT=FALSE\n  UNTIL DI1 MAX 2\n  R_TIMEOUT=not (DI1)\n"
            "  IF R_TIMEOUT\n    ON 3\n  ENDIF\nEND\n")
      << got.faults;
  // Where nothing asks for it, nothing is set.
  EXPECT_EQ(of_small(small_pack(head, sets), signals, "WAIT FOR ready TIMEOUT 2.0;").files["p.txt"],
            "BEGIN\n  UNTIL DI1 MAX 2\nEND\n");
}

TEST(Templates, ValuesOfMessagesAreWrittenAsValuesOrRefused) {
  const std::string declared = "VAR INT: n := 6;";
  const std::string says = "n := n + 1; WRITELN('n is ', n, ' now');";
  const std::string head = "features: variables messages pause\n";
  const std::string pause = std::string(kVariables) + "== pause\nSTOP\n";
  const Posted lost =
      of_small(small_pack(head, pause + "== message\nSAY \"{{text}}\"\n"), declared, says);
  EXPECT_NE(lost.faults.find("error 4: a has no notation for values within texts: the template "
                             "\"message\" has no {{values}}"),
            std::string::npos)
      << lost.faults;
  EXPECT_EQ(of_small(small_pack(head + "between_values: \"; \"\ntext_sign: '\n",
                                pause + "== message\nSAY {{values}}\n"),
                     declared, says)
                .files["p.txt"],
            "BEGIN\n  INT n=6\n  n=n+1\n  SAY 'n is '; n; ' now'\nEND\n");
  EXPECT_NE(
      of_small(small_pack(head, pause + "== message\nSAY {{values}}\n"), "", "WRITELN('a \"b\"');")
          .faults.find("a has no notation for \""),
      std::string::npos);
}

TEST(Templates, TheTextOfAPauseIsWrittenOrSaidToBeLost) {
  const std::string head = "features: pause\n", says = "PAUSE 'look';";
  EXPECT_EQ(of_small(small_pack(head, "== pause\nSTOP \"{{text}}\"\n"), "", says).files["p.txt"],
            "BEGIN\n  STOP \"look\"\nEND\n");
  EXPECT_EQ(of_small(small_pack("features: pause messages\n",
                                "== pause\nSTOP\n== message\nSAY {{text}}\n"),
                     "", says)
                .files["p.txt"],
            "BEGIN\n  SAY look\n  STOP\nEND\n");
  Posted lost = of_small(small_pack(head, "== pause\nSTOP\n"), "", says);
  EXPECT_EQ(lost.files["p.txt"], "BEGIN\n  STOP\nEND\n");
  EXPECT_NE(lost.faults.find("warning 4: the text of PAUSE is not written"), std::string::npos)
      << lost.faults;
}

TEST(Templates, WhatIsComputedWhileItRunsIsWrittenAsItStands) {
  const std::string declared =
      "VAR REAL: r := 5.0; POSE: a := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0));";
  const std::string lin =
      "GO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}} {{speed}}\n[passes] ROUND {{blend}}";
  const std::string pack = small_pack("features: variables\n", kVariables, lin);
  EXPECT_EQ(of_small(pack, declared, "r := r * 2.0; MOVE LIN a C_CP := r; MOVE LIN a; WAIT r SEC;")
                .files["p.txt"],
            "BEGIN\n  REAL r=5.0\n  r=r*2.0\n  GO 1 2 3 0 0 0 250\n  ROUND r\n"
            "  GO 1 2 3 0 0 0 250\n  REST r\nEND\n");
  std::string ms = pack;
  ms.replace(ms.find("{{seconds}}"), 11, "{{milliseconds}}");
  const Posted refused = of_small(ms, declared, "r := r * 2.0; WAIT r SEC;");
  EXPECT_NE(refused.faults.find("error 4: a has no computed times, in milliseconds"),
            std::string::npos)
      << refused.faults;
  EXPECT_EQ(refused.faults.find("name the robot"), std::string::npos) << refused.faults;
}

TEST(Templates, AttributesThatTheSystemsVariablesGiveAreNotDroppedWithoutAWord) {
  const Posted got = of_small(
      small_pack("features: variables\n", kVariables, "GO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}}"),
      "VAR POSE: a := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0));",
      "R_SPEED := 80.0; MOVE LIN a;");
  EXPECT_NE(got.faults.find("warning 4: SPEED is not written"), std::string::npos) << got.faults;
}

TEST(Templates, NothingOfAPlaceIsLost) {
  const auto point = [](const std::string& head, const std::string& line) {
    return small_pack(head, "== point\n" + line + "\n", "GO {{point}}");
  };
  const std::string a = "a.post:16:4: ", lost = "}}, which would be lost";
  EXPECT_EQ(said_of(point("", "{{name}} {{x}} {{y}} {{z}} {{a}} {{b}} {{c}}")), "fine");
  EXPECT_EQ(said_of(point("", "{{name}} {{x}} {{z}} {{a}} {{b}} {{c}}")),
            a + "the template \"point\" does not write {{y" + lost);
  EXPECT_EQ(said_of(point("", "{{name}} {{x}} {{y}} {{z}} {{a}} {{b}}")),
            a + "the template \"point\" does not write {{c" + lost);
  EXPECT_EQ(
      said_of(point("orientation: quaternion\n", "{{name}} {{x}} {{y}} {{z}} {{a}} {{b}} {{c}}")),
      "a.post:17:4: the template \"point\" does not write {{d" + lost);
  EXPECT_EQ(said_of(point("", "{{name}} {{q1}} {{q3}}")),
            a + "the template \"point\" does not write {{q2" + lost);
  EXPECT_EQ(
      said_of(point("angles: d\n", "{{name}} {{x}} {{y}} {{z}}")).find("a.post:4:9: d is the"), 0U);
  EXPECT_EQ(said_of(small_pack("", "", "GO {{point_number}}")),
            "a.post:14:4: the template \"lin\" writes {{point_number}}, and there is no template "
            "\"point\" that writes its position");
  // A controller that turns about no axis takes poses that are all turned alike.
  const std::string flat = point("angles: none\n", "{{name}}={{x}} {{y}} {{z}}");
  const std::string declared =
      "VAR POSE: a := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(10.0, 0.0, 180.0));\n"
      "POSE: b := POSE(POSITION(1.0, 2.0, 4.0), ORIZYX(10.0, 0.0, -180.0));\n"
      "POSE: c := POSE(POSITION(1.0, 2.0, 4.0), ORIZYX(11.0, 0.0, 180.0));";
  EXPECT_EQ(of_small(flat, declared, "MOVE LIN a; MOVE LIN b;").files["p.txt"],
            "a=1 2 3\nb=1 2 4\nBEGIN\n  GO a\n  GO b\nEND\n");
  EXPECT_NE(of_small(flat, declared, "MOVE LIN a;\nMOVE LIN c;")
                .faults.find("error 7: the orientation of this pose is lost: its angle a "
                             "differs from the previous one"),
            std::string::npos);
  // Joints that a robot has, and the template has not.
  const std::string joints =
      "robomosp target 1\nname: a\nmotions: ptp_joints\n== program_begin\nBEGIN\n"
      "== program_end\nEND\n== output_on\nON {{number}}\n== output_off\nOFF {{number}}\n"
      "== wait_time\nREST {{seconds}}\n== ptp_joints\nGO {{q1}} {{q2}} {{q3}} {{q4}} {{q5}} "
      "{{speed}}\n";
  EXPECT_NE(of_small(joints, "",
                     "MOVE PTP JOINT(MAIN_JOINT(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), ADD_JOINT(0.0));")
                .faults.find("error 4: the joint q6 of this target is lost: the template "
                             "\"ptp_joints\" does not write it"),
            std::string::npos);
}

TEST(Templates, LinesThatLookLikeSectionsOrConditionsAreNoText) {
  const auto with = [](const std::string& lines) {
    return said_of(small_pack("", "== comment\n; {{text}}\n" + lines));
  };
  EXPECT_EQ(with("= halt\nSTOP\n"),
            "a.post:18:1: this line looks like the beginning of a section, but is not one");
  EXPECT_NE(with(" == halt\nSTOP\n"), "fine");
  EXPECT_EQ(with("== halt\nSTOP\n"), "fine");
  EXPECT_EQ(with("\\= halt\n= 5\n"), "fine");
  const std::string coord = " {{x}} {{y}} {{z}} {{a}} {{b}} {{c}} {{speed}}";
  const auto lin = [&](const std::string& begin) {
    return said_of(small_pack("", "", begin + " GO" + coord));
  };
  EXPECT_EQ(lin("[no passes]"),
            "a.post:15:2: \"no passes\" is not a variable of this construct, so it cannot be a "
            "condition");
  EXPECT_EQ(lin("[passes] [acc]"), "a.post:15:10: a line can have only one condition");
  EXPECT_EQ(lin("[not passes]"), "fine");
  EXPECT_EQ(lin("\\[no passes]"), "fine");
  EXPECT_EQ(lin("[passes] \\[acc]"), "fine");
  EXPECT_EQ(lin("[AX 1]"), "fine");  // the controller's own
}

TEST(Templates, PointsMayStandWithoutNumbersOfLines) {
  const std::string declared =
      "VAR POSE: a := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0));";
  for (const char* where : {"before", "behind"}) {
    const auto pack = [&](const char* numbered) {
      return small_pack("line_numbers: 10 5\npoints: " + std::string(where) +
                            "\npoints_numbered: " + numbered + "\nangles: none\nindent: 0\n",
                        "== point\n{{name}}={{x}} {{y}} {{z}}\n", "GO {{point}}");
    };
    const bool is_before = std::string(where) == "before";
    EXPECT_EQ(of_small(pack("no"), declared, "MOVE LIN a;").files["p.txt"],
              is_before ? "a=1 2 3\n10 BEGIN\n15 GO a\n20 END\n"
                        : "10 BEGIN\n15 GO a\n20 END\na=1 2 3\n");
    EXPECT_EQ(of_small(pack("yes"), declared, "MOVE LIN a;").files["p.txt"],
              is_before ? "10 a=1 2 3\n15 BEGIN\n20 GO a\n25 END\n"
                        : "10 BEGIN\n15 GO a\n20 END\n25 a=1 2 3\n");
  }
  EXPECT_NE(said_of(small_pack("points_numbered: off\n", "")).find("must be yes or no"),
            std::string::npos);
}

TEST(Templates, OperatorsOfLettersStandByThemselvesAndComeOnce) {
  const std::string more = std::string(kVariables) + "AND \"AND\" 20\nMOD \"mod\" 60\n";
  EXPECT_EQ(of_small(small_pack("features: variables\n", more), "VAR INT: i, j; BOOL: b;",
                     "b := i < 3 AND NOT b; i := i MOD j;")
                .files["p.txt"],
            "BEGIN\n  INT i=0\n  INT j=0\n  BOOL b=FALSE\n  b=i<3 AND not(b)\n  i=i mod j\nEND\n");
  EXPECT_EQ(said_of(small_pack("features: variables\n", more + "AND \"&\" 20\n")),
            "a.post:32:1: the operator \"AND\" is given twice");
  // A file's own takes the place of an included one.
  EXPECT_EQ(from_files({{"pack", small_pack("features: variables\ninclude: o.part\n",
                                            std::string(kVariables) + "AND \"&\" 20\n")},
                        {"o.part", "== operators\nAND \"and\" 20\n"}},
                       "PROGRAM p;\nVAR BOOL: b, c;\nBEGIN\nb := b AND c;\nENDPROGRAM;\n")
                .files["p.txt"],
            "BEGIN\n  BOOL b=FALSE\n  BOOL c=FALSE\n  b=b&c\nEND\n");
}

TEST(Templates, NamesAreOfThePacksSignsInItsCase) {
  const std::string declared = "VAR INT: part_no_1 := 1, part_no_2 := 2, end := 3;";
  const auto names = [&](const std::string& head) {
    Posted got = of_small(small_pack("features: variables\n" + head, kVariables), declared,
                          "part_no_1 := part_no_2 + end;");
    return (got.files.empty() ? std::string() : got.files.begin()->second) + got.faults;
  };
  EXPECT_EQ(names("name_signs: letters digits -\n"),
            "BEGIN\n  INT part-no-1=1\n  INT part-no-2=2\n  INT end=3\n"
            "  part-no-1=part-no-2+end\nEND\n");
  EXPECT_EQ(names("name_signs: letters digits\nlongest_name: 6\ncase: upper\n"),
            "BEGIN\n  INT PARTNO=1\n  INT PARTN2=2\n  INT END=3\n  PARTNO=PARTN2+END\nEND\n");
  // Without digits, letters tell them apart.
  EXPECT_EQ(names("name_signs: letters\nreserved: END, stop\n"),
            "BEGIN\n  INT partno=1\n  INT partnob=2\n  INT endb=3\n  partno=partnob+endb\nEND\n");
  // Whether End and END are two names.
  EXPECT_EQ(names("reserved: END\ncase_matters: yes\n"),
            "BEGIN\n  INT part_no_1=1\n  INT part_no_2=2\n  INT end=3\n"
            "  part_no_1=part_no_2+end\nEND\n");
  EXPECT_EQ(said_of(small_pack("name_signs: digits _\n", "")),
            "a.post:4:13: names without letters are impossible");
  EXPECT_EQ(said_of(small_pack("name_signs: letters \" digits\n", "")),
            "a.post:4:21: \"\\\"\" cannot be in names");
  EXPECT_EQ(said_of(small_pack("name_signs: letters A-Z\n", "")),
            "a.post:4:21: \"A-Z\" cannot be in names");
  EXPECT_EQ(said_of(small_pack("case_matters: true\n", "")),
            "a.post:4:15: \"case_matters\" must be yes or no");
  // A file has none of the signs that files do not take.
  const auto files = of_small(small_pack("name_signs: letters *\n", ""), "", "WAIT 1.0 SEC;").files;
  EXPECT_EQ(files.begin()->first, "p.txt");
  EXPECT_EQ(from_files({{"pack", small_pack("name_signs: letters *\n", "")}},
                       "PROGRAM my_task;\nBEGIN\nWAIT 1.0 SEC;\nENDPROGRAM;\n")
                .files.begin()
                ->first,
            "mytask.txt");
}

TEST(Templates, NumbersAreInThePacksForm) {
  const std::string declared =
      "VAR REAL: r := 0.00000125, s := 2.0, t := 1.0E300;\n"
      "POSE: a := POSE(POSITION(1.5, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0));";
  const auto numbers = [&](const std::string& head) {
    Posted got = of_small(small_pack("features: variables\n" + head, kVariables), declared,
                          "s := s * 2.5;\nr := r + s;\nMOVE LIN a;");
    return got.files["p.txt"] + got.faults;
  };
  EXPECT_EQ(numbers(""),
            "BEGIN\n  REAL r=1.25E-06\n  REAL s=2.0\n  s=s*2.5\n  r=r+s\n"
            "  GO 1.5 2 3 0 0 0 250\nEND\n");
  EXPECT_EQ(numbers("real_exponent: no\nreal_point: no\ndecimal_sign: ,\n"),
            "BEGIN\n  REAL r=0,00000125\n  REAL s=2\n  s=s*2,5\n  r=r+s\n"
            "  GO 1,5 2 3 0 0 0 250\nEND\n");
  EXPECT_EQ(numbers("real_digits: 6\n"),
            "BEGIN\n  REAL r=0.000001\n  REAL s=2.0\n  s=s*2.5\n  r=r+s\n"
            "  GO 1.5 2 3 0 0 0 250\nEND\n"
            "warning 2: the number 1.25E-06 is written as 0.000001. a has 6 decimal places "
            "(real_digits).\n");
  EXPECT_NE(of_small(small_pack("features: variables\nreal_exponent: no\n", kVariables), declared,
                     "t := t * s;")
                .faults.find("error 2: the number 1.0E300 has 301 digits without an exponent, but "
                             "a writes none"),
            std::string::npos);
  // Filters write the sign, too.
  EXPECT_EQ(of_small(small_pack("decimal_sign: ,\n", "",
                                "GO {{x|fixed:2}} {{y|times:0.5}} {{z|plus:0.25|sign}} {{a}} {{b}} "
                                "{{c}} {{speed|times:0.06|fixed:1|zeros:5}}"),
                     declared, "MOVE LIN a;")
                .files["p.txt"],
            "BEGIN\n  GO 1,50 1 +3,25 0 0 0 015,0\nEND\n");
  // Where the digits are too few, it is said.
  const Posted rounded =
      of_small(small_pack("digits: 0\n", ""), declared,
               "MOVE LIN a SPEED := 33.4;\nWAIT 0.25 SEC;\nMOVE LIN a SPEED := 250.4;");
  EXPECT_EQ(rounded.faults,
            "warning 5: the speed 33.4 is written as 33. Give the template more digits (fixed:3), "
            "or the pack's head (digits), or use a number that can be written exactly.\n"
            "warning 6: the seconds 0.25 is written as 0. Give the template more digits (fixed:3), "
            "or the pack's head (digits), or use a number that can be written exactly.\n");
  EXPECT_EQ(said_of(small_pack("decimal_sign: ;\n", "")),
            "a.post:4:15: \"decimal_sign\" is . or ,");
  EXPECT_EQ(said_of(small_pack("real_digits: -1\n", "")),
            "a.post:4:14: \"real_digits\" must be a number from 0 to 17");
}

TEST(Templates, SignsWithinTextsAreWrittenAsThePackSays) {
  const auto texts = [](const std::string& head, const std::string& message) {
    Posted got = of_small(small_pack("features: messages\n" + head,
                                     "== message\n" + message + "\n== comment\n; {{text}}\n"),
                          "", R"(WRITELN('a "b" \ c');)");
    return got.files["p.txt"] + got.faults;
  };
  EXPECT_EQ(texts("quotes: doubled\n", "SAY \"{{text|first:5}}\""),
            "BEGIN\n  SAY \"a \"\"b\"\"\"\nEND\n");
  EXPECT_EQ(texts("quotes: backslash\n", "SAY \"{{text}}\""),
            "BEGIN\n  SAY \"a \\\"b\\\" \\\\ c\"\nEND\n");
  EXPECT_EQ(texts("quotes: doubled\n", "SAY {{values}}"),
            "BEGIN\n  SAY \"a \"\"b\"\" \\ c\"\nEND\n");
  EXPECT_NE(texts("", "SAY \"{{text}}\"").find("a has no notation for \" within a text"),
            std::string::npos);
  // Where it does not stand within the signs, it is as it is; other signs have no way.
  EXPECT_EQ(texts("quotes: doubled\n", "SAY {{text}}"), "BEGIN\n  SAY a \"b\" \\ c\nEND\n");
  EXPECT_EQ(texts("quotes: doubled\ntext_sign: '\n", "SAY '{{text}}'"),
            "BEGIN\n  SAY 'a \"b\" \\ c'\nEND\n");
  EXPECT_NE(texts("quotes: doubled\ntext_sign: '\n", "SAY \"{{text}}\"").find("no notation for \""),
            std::string::npos);
  EXPECT_EQ(said_of(small_pack("quotes: twice\n", "")),
            "a.post:4:9: \"quotes\" must be doubled, backslash or refused");
  EXPECT_EQ(
      said_of(small_pack("quotes: doubled\ntext_sign:\n", "")),
      "a.post:4:9: \"quotes\" sets how text_sign is written in a text, but text_sign is empty");
}

TEST(Templates, APackWhoseTextCouldBeReadInTwoSensesIsRefused) {
  const std::string joints = "== ptp_joints\nAT {{joints}}\n",
                    values = "== message\nSAY {{values}}\n";
  const std::string ptp = "motions: ptp_joints\n", says = "features: messages\n";
  const auto operators = [](const std::string& rows) {
    return std::string(
               "== declare_int\nINT {{name}}={{value}}\n== declare_real\nREAL "
               "{{name}}={{value}}\n== declare_bool\nBOOL {{name}}={{value}}\n== "
               "assign\n{{name}}={{value}}\n== operators\n") +
           rows;
  };
  const std::string variables = "features: variables\n";
  struct Case {
    std::string head, sections, said;  ///< a part of what is said; "" = nothing
    std::string lin = "GO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}} {{speed}}";
  };
  const Case kCases[] = {
      // Numbers in a row: joints and values.
      {ptp + "decimal_sign: ,\n", joints,
       "\"between_joints\" is \", \", and \",\" is also the decimal sign"},
      {ptp + "decimal_sign: ,\nbetween_joints: \"; \"\n", joints, ""},
      {ptp + "between_joints: \"\"\n", joints, "nothing is between two numbers"},
      {ptp + "between_joints: \" \"\n", joints, ""},
      {ptp + "between_joints: .\n", joints, "\".\" is also the decimal sign"},
      {ptp + "between_joints: -\n", joints, "\"-\" may be part of a number"},
      {ptp + "between_joints: \" 0 \"\n", joints, "\"0\" may be part of a number"},
      {"between_joints: -\n", "", ""},  // nothing writes joints
      {says + "decimal_sign: ,\n", values,
       "\"between_values\" is \", \", and \",\" is also the decimal sign"},
      {says + "between_values: \"_\"\n", values, "names also contain such characters"},
      {says + "between_values: \"\"\n", values, "nothing is between two numbers"},
      {says + "between_values: ' '\ntext_sign: '\n", values, "text_sign \"'\" is in it"},
      {says + "between_values: \";\"\n", values, ""},
      // Signs of texts, and the words of BOOL.
      {says + "text_sign: x\n", values, "\"text_sign\" is \"x\""},
      {says + "text_sign: 1\n", values, "which numbers or names may also contain"},
      {"true: on\nfalse: ON\n", "", "\"true\" and \"false\" are both \"on\""},
      {"true: on\nfalse: ON\ncase_matters: yes\n", "", ""},
      {"true: 1\nfalse: 0\n", "", ""},
      // Numbers of lines.
      {"line_numbers: 10 10\nline_number: \"{{line}}0\"\n", "",
       "\"line_number\" has \"0\" behind {{line}}, which would become part of the number"},
      {"line_numbers: 10 10\nline_number: \"{{line}}. \"\n", "", "behind {{line}}"},
      {"line_numbers: 10 10\nline_number: \"1{{line}} \"\n", "", "before {{line}}"},
      {"line_numbers: 10 10\nline_number: \"N \"\n", "", "does not write {{line}}"},
      {"line_numbers: 10 10\nline_number: \"N{{line}}\"\n", "", ""},
      {"line_numbers: 10 10\nline_number: \"N{{line}}\"\n", "== comment\n2: {{text}}\n",
       "a line of the template \"comment\" may begin with a digit"},
      {"line_numbers: 10 10\nline_number: \"N{{line}} \"\n", "== comment\n2: {{text}}\n", ""},
      // Comments.
      {"", "== comment\n{{text}}\n", "begins with its text"},
      {"text_sign: '\n", "== comment\n' {{text}}\n", "begins with \"'\", which is text_sign"},
      {"", "== comment\n' {{text}}\n", ""},
      // Operators.
      {variables + "name_signs: letters digits -\n", operators("- \"-\" 50\n"),
       "the operator \"-\" is written \"-\", but names may contain \"-\" as well"},
      {variables + "name_signs: letters digits -\n", operators("- \" - \" 50\n"), ""},
      {variables, operators("< \"<\" 30\n<= \"<\" 30\n"),
       "the operators \"<\" and \"<=\" are both written \"<\""},
      {variables, operators("/ \"/\" 60\nDIV \"/\" 60\n"), ""},
      {variables + "decimal_sign: ,\n", operators("MOD \"MOD\" 99 call\n"),
       "the operator \"MOD\" is a call, with commas between operands"},
      {variables, operators("MOD \"MOD\" 99 call\n"), ""},
      // Numbers of a template.
      {"", "", "the template \"lin\" writes {{x}} and {{y}} without a separator",
       "GO {{x}}{{y}} {{z}} {{a}} {{b}} {{c}}"},
      {"", "", "", "GO {{x|pad:9}}{{y|pad:9}} {{z}} {{a}} {{b}} {{c}}"},
      {"", "", "", "GO X{{x|sign}}{{y|sign}} {{z}} {{a}} {{b}} {{c}}"},
      {"decimal_sign: ,\n", "", "writes \",\" between {{x}} and {{y}}, which is the decimal sign",
       "GO {{x}}, {{y}}, {{z}}, {{a}}, {{b}}, {{c}}"},
      {"", "", "", "GO {{x}},{{y}},{{z}},{{a}},{{b}},{{c}}"}};
  for (const Case& c : kCases) {
    const std::string got = said_of(small_pack(c.head, c.sections, c.lin));
    if (c.said.empty()) EXPECT_EQ(got, "fine") << c.head << c.sections << c.lin;
    else EXPECT_NE(got.find(c.said), std::string::npos) << c.said << "\n" << got;
    // One fault each, at a place, with what to do.
    std::vector<program_post::PackFault> faults;
    (void)program_post::read_templates(small_pack(c.head, c.sections, c.lin), "a.post", {},
                                       &faults);
    EXPECT_EQ(faults.size(), c.said.empty() ? 0U : 1U) << got;
    for (const auto& f : faults) EXPECT_FALSE(f.hint.empty()) << f.message;
  }
}

TEST(Templates, BlocksAreMadeOfJumpsWhereThereIsNothingElse) {
  const std::string declared = "SIGNAL OUTPUT BOOL: g AT 3; VAR INT: n;";
  const std::string body =
      "WHILE n < 3\nIF n < 2 THEN g := TRUE; ELSE g := FALSE; ENDIF;\nn := n + 1;\nENDWHILE;";
  const std::string jumps = std::string(kVariables) +
                            "== goto\nGO L{{number}}\n== label\nL{{number}}:\n"
                            "== jump_if\nIF {{condition}} GO L{{number}}\n";
  EXPECT_EQ(of_small(small_pack("features: variables goto jumps\n", jumps), declared, body)
                .files["p.txt"],
            "BEGIN\n  INT n=0\n  L1:\n  IF n<3 GO L2\n  GO L3\n  L2:\n  IF n<2 GO L4\n  GO L5\n"
            "  L4:\n  ON 3\n  GO L6\n  L5:\n  OFF 3\n  L6:\n  n=n+1\n  GO L1\n  L3:\nEND\n");
  // By names, and with the other jump; by numbers of lines.
  std::string unless = jumps + "== jump_unless\nUNLESS {{condition}} GO L{{number}}\n";
  for (std::size_t at; (at = unless.find("L{{number}}")) != std::string::npos;)
    unless.replace(at, 11, "{{label}}");
  EXPECT_EQ(
      of_small(small_pack("features: variables goto jumps\nreserved: L1\n", unless), declared, body)
          .files["p.txt"],
      "BEGIN\n  INT n=0\n  L12:\n  UNLESS n<3 GO L2\n  UNLESS n<2 GO L3\n  ON 3\n  GO L4\n"
      "  L3:\n  OFF 3\n  L4:\n  n=n+1\n  GO L12\n  L2:\nEND\n");
  const std::string lines = std::string(kVariables) +
                            "== goto\nGO {{label_line}}\n== label\n== jump_if\n"
                            "IF {{condition}} GO {{label_line}}\n";
  EXPECT_EQ(of_small(small_pack("features: variables goto jumps\nline_numbers: 10 10\nindent: 0\n",
                                lines),
                     declared, "WHILE n < 3\nn := n + 1;\nENDWHILE;")
                .files["p.txt"],
            "10 BEGIN\n20 INT n=0\n30 IF n<3 GO 50\n40 GO 70\n50 n=n+1\n60 GO 30\n70 END\n");
  EXPECT_EQ(
      said_of(small_pack("features: variables jumps\n",
                         std::string(kVariables) + "== jump_if\nIF {{condition}} {{label}}\n")),
      "a.post:4:21: the feature jumps needs the feature goto, since it also writes its templates");
}

TEST(Templates, ALoopOfJumpsIsLeftByAJumpWhateverExitTheOthersHave) {
  const std::string pack = small_pack(
      "features: variables for exit goto jumps\n",
      std::string(kVariables) +
          "== for_begin\nFOR {{name}}={{from}} TO {{to}}\n== for_end\nNEXT\n== exit\nBREAK\n"
          "== goto\nGO {{label}}\n== label\n{{label}}:\n"
          "== jump_if\nIF {{condition}} GO {{label}}\n");
  EXPECT_EQ(of_small(pack, "VAR INT: i, n;",
                     "WHILE n < 3\nFOR i := 1 TO 9\nEXIT;\nENDFOR;\nEXIT;\nENDWHILE;")
                .files["p.txt"],
            "BEGIN\n  INT i=0\n  INT n=0\n  L1:\n  IF n<3 GO L2\n  GO L3\n  L2:\n  FOR i=1 TO 9\n"
            "    BREAK\n  NEXT\n  GO L3\n  GO L1\n  L3:\nEND\n");
  EXPECT_EQ(said_of(small_pack("features: elsif\n", "== else_if\nELIF {{condition}}\n")),
            "a.post:4:11: the feature elsif needs the feature if");
}

TEST(Templates, OperatorsMayStandBeforeOrBehindTheirOperands) {
  const auto written = [](const std::string& operators, const std::string& head = "") {
    std::string variables = kVariables;
    variables.resize(variables.find("== operators"));
    Posted got = of_small(
        small_pack("features: variables\n" + head, variables + "== operators\n" + operators),
        "VAR INT: i, j; BOOL: b;",
        "i := (i + 1) * (j - i * 2); b := NOT (i < j) AND b; i := -(i + j);");
    const std::string all = got.files["p.txt"] + got.faults;
    return all.substr(std::min(all.find("  i="), all.size()));
  };
  EXPECT_EQ(written("+ \"(+ {{a}} {{b}})\"\n- \"(- {{a}} {{b}})\"\n* \"(* {{a}} {{b}})\"\n"
                    "< \"(< {{a}} {{b}})\"\nNOT \"(not {{a}})\"\nAND \"(and {{a}} {{b}})\"\n"
                    "-x \"(- {{a}})\"\n"),
            "  i=(* (+ i 1) (- j (* i 2)))\n  b=(and (not (< i j)) b)\n  i=(- (+ i j))\nEND\n");
  EXPECT_EQ(written("+ \"{{a}} {{b}} +\"\n- \"{{a}} {{b}} -\"\n* \"{{a}} {{b}} *\"\n"
                    "< \"{{a}} {{b}} <\"\nNOT \"{{a}} not\"\nAND \"{{a}} {{b}} and\"\n"
                    "-x \"{{a}} neg\"\n"),
            "  i=i 1 + j i 2 * - *\n  b=i j < not b and\n  i=i j + neg\nEND\n");
  // Beside others: how strongly the whole binds decides on parentheses around it.
  EXPECT_EQ(written("+ \"plus({{a}}; {{b}})\"\n- \"-\" 50\n* \"*\" 60\n< \"{{a}} under {{b}}\" 30\n"
                    "NOT \"not \" 40 prefix\nAND \" and \" 20\n-x \"-\" 70 prefix\n"),
            "  i=plus(i; 1)*(j-i*2)\n  b=not (i under j) and b\n  i=-(plus(i; j))\nEND\n");
  const auto said = [](const std::string& line) {
    return said_of(small_pack("features: variables\n", std::string(kVariables) + line));
  };
  EXPECT_EQ(said("- \"(- {{a}})\"\n"), "a.post:30:4: - has two operands: {{a}} and {{b}}");
  EXPECT_EQ(said("-x \"({{a}} {{b}})\"\n"), "a.post:30:5: -x has one operand: {{a}}");
  EXPECT_EQ(said("- \"(- {{a}} {{c}})\"\n"),
            "a.post:30:15: \"operators\" has no variable \"c\"; a.post:30:4: - has two operands: "
            "{{a}} and {{b}}");
  EXPECT_EQ(said("- \"(- {{a}} {{b}})\" 50 prefix\n"),
            "a.post:30:24: only the binding may follow an operator with {{a}}");
}

TEST(Templates, ProceduresHaveNumbers) {
  const std::string pack =
      small_pack("features: procedures\n",
                 "== procedure_begin\nSUB {{number}}\n== procedure_end\nRET {{number}}\n"
                 "== call\nGOSUB {{number}}\n== return\nRET\n");
  EXPECT_EQ(from_files({{"pack", pack}},
                       "PROGRAM p;\nSIGNAL OUTPUT BOOL: g AT 3;\n"
                       "PROCEDURE one; BEGIN g := TRUE; ENDPROC;\n"
                       "PROCEDURE two; BEGIN g := FALSE; ENDPROC;\n"
                       "BEGIN\ntwo(); one(); two();\nENDPROGRAM;\n")
                .files["p.txt"],
            "BEGIN\n  GOSUB 1\n  GOSUB 2\n  GOSUB 1\nEND\nSUB 2\n  ON 3\nRET 2\nSUB 1\n  OFF 3\n"
            "RET 1\n");
}

TEST(Templates, WhatBecomesOfCPassAloneIsSaid) {
  const std::string coord = "GO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}} {{speed}}";
  const std::string declared =
      "VAR POSE: a := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)); BOOL: b;";
  const auto said = [&](const std::string& lin, const std::string& attributes) {
    return of_small(small_pack("features: variables\n", kVariables, coord + lin), declared,
                    "MOVE LIN a " + attributes + ";")
        .faults;
  };
  EXPECT_EQ(said("", "C_PASS := TRUE"),
            "note 4: C_PASS is written as a stop, as in a run: the template \"lin\" has no "
            "{{passes}}. Remove it here, or add it to the template.\n");
  EXPECT_EQ(said("\n[blend] ROUND {{blend}}", "C_PASS := TRUE"),
            "note 4: C_PASS without a distance is written as a stop, as in a run: the "
            "template \"lin\" has no {{passes}}. Give C_CP, or add it to the template.\n");
  EXPECT_EQ(said("\n[passes] ROUND", "C_PASS := TRUE"),
            "note 4: C_PASS without a distance is written as the template \"lin\" has it: the "
            "controller chooses the distance, and the simulated robot stops here. Give C_CP.\n");
  EXPECT_EQ(said("\n[blend] ROUND {{blend}}", "C_PASS := TRUE C_CP := 5.0"), "");
  EXPECT_EQ(said("\n[passes] ROUND", "C_PASS := FALSE"), "");
  EXPECT_NE(said("", "C_CP := 5.0").find("warning 4: C_CP is not written"), std::string::npos);
}

/// As program_run_test has it: PTP of one target with a TIME pass their targets, nothing else does.
TEST(Posts, WhatARunMakesOfCPassAloneIsSaidAsItIs) {
  const std::string head =
      "PROGRAM p;\nVAR POSE: a := POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0));\n"
      "VAR POSE: b := POSE(POSITION(500.0, 90.0, 300.0), ORIZYX(0.0, 180.0, 0.0));\nBEGIN\n";
  const std::string passes =
      "the simulated robot passes this target at its TIME, each joint by a cubic, if a PTP of one "
      "target with a TIME follows at once. Give C_PTP; the profile's option zone_pass sets";
  const std::string stops = "the simulated robot stops here. Give ";
  const auto said = [&](const std::string& move) {
    return post_source(posts::Rapid(), head + move + " C_PASS := TRUE;\nMOVE PTP b TIME := 1.0;\n" +
                                           "ENDPROGRAM;\n")
        .faults;
  };
  const auto is_said = [&](const std::string& move, const std::string& what) {
    const std::string faults = said(move);
    const bool is_pass = faults.find(passes) != std::string::npos;
    const bool is_stop = faults.find(stops) != std::string::npos;
    EXPECT_EQ(is_pass, what == passes) << move << "\n" << faults;
    EXPECT_EQ(is_stop, what == stops) << move << "\n" << faults;
  };
  is_said("MOVE PTP a TIME := 0.5", passes);
  is_said("R_MOVE_TIME := 0.5; MOVE PTP a", passes);
  is_said("MOVE PTP a", stops);
  is_said("MOVE PTP a TIME := -1.0", stops);
  is_said("MOVE PTP a, b TIME := 0.5", stops);  // taken apart by the post, not by the run
  is_said("MOVE LIN a TIME := 0.5", stops);
  is_said("MOVE PTP a TIME := 0.5 C_PTP := 20.0", "");
  // A stop that is written is none in a run: templates say it in the same words.
  const std::string coords = "{{x}} {{y}} {{z}} {{a}} {{b}} {{c}} {{speed}} {{time}}\n";
  std::string pack = small_pack("", "== ptp_pose\nJUMP " + coords, "GO " + coords);
  pack.replace(pack.find("motions: lin"), 12, "motions: lin ptp_pose");
  const auto of_pack = [&](const std::string& move) {
    return from_files({{"pack", pack}}, head + move + " C_PASS := TRUE;\nENDPROGRAM;\n").faults;
  };
  const std::string timed = of_pack("MOVE PTP a TIME := 0.5");
  EXPECT_NE(timed.find("C_PASS is written as a stop, and the simulated robot passes this target at "
                       "its TIME, each joint by a cubic, if a PTP of one target with a TIME "
                       "follows at once: the template \"ptp_pose\" has no {{passes}}"),
            std::string::npos)
      << timed;
  const std::string plain = of_pack("MOVE PTP a");
  EXPECT_NE(plain.find("C_PASS is written as a stop, as in a run: the template"), std::string::npos)
      << plain;
}

TEST(Templates, AFileThatIncludesItselfIsSaidOnceAndWhatItLacksIsNot) {
  const auto said = [](const std::string& include,
                       const std::map<std::string, std::string>& files) {
    const auto read = program_post::read_templates(
        "robomosp target 1\nname: a\ninclude: " + include + "\n", "acme/pack.post",
        [&](const std::string& name) -> Result<std::string> {
          const auto it = files.find(name);
          if (it == files.end()) return error(ErrorCode::io, "there is none", "");
          return it->second;
        });
    return read.ok() ? std::string("fine") : read.error().message;
  };
  EXPECT_EQ(said("pack.post", {}), "acme/pack.post:3:10: the file includes itself");
  EXPECT_EQ(said("b.part", {{"b.part", "include: pack.post\n"}}),
            "b.part:1:10: files include each other in a circle: pack.post includes b.part includes "
            "pack.post");
  EXPECT_EQ(said("c.part", {}),
            "acme/pack.post:3:10: the included file \"c.part\" cannot be read: there is none");
}

TEST(Templates, KeysOfThePackHoldWhereverTheIncludeStands) {
  for (const bool is_first : {true, false}) {
    const std::string head =
        is_first ? "digits: 1\ninclude: o.part\n" : "include: o.part\ndigits: 1\n";
    EXPECT_EQ(from_files({{"pack", small_pack(head, "")}, {"o.part", "digits: 4\n"}},
                         "PROGRAM p;\nBEGIN\nWAIT 1.2345 SEC;\nENDPROGRAM;\n")
                  .files["p.txt"],
              "BEGIN\n  REST 1.2\nEND\n")
        << is_first;
  }
}

TEST(Templates, SentencesNameTheWayOutThatThereIs) {
  const auto hints = [](const std::string& pack) {
    std::vector<program_post::PackFault> faults;
    (void)program_post::read_templates(pack, "a.post", {}, &faults);
    std::string all;
    for (const auto& f : faults) all += f.message + ". " + f.hint + "\n";
    return all;
  };
  EXPECT_EQ(hints(small_pack("line_numbers: 5\nline_number: N{{line}}\n", "")),
            "\"line_numbers\" is the first number and the step, such as 10 10. \n");
  EXPECT_EQ(
      hints(small_pack("length_unit: inch\n", "")),
      "\"length_unit\" must be a number other than 0. How much a mm is in the controller's unit: "
      "0.001 for metres, 0.03937007874 for inches.\n");
  EXPECT_EQ(hints(small_pack("", "== comment\n; {{text|fixed:2}}\n")),
            "the filter fixed needs a number, and text is a text. Remove the filter.\n");
  const std::string round =
      "robomosp target 1\nname: a\nmotions: lin circle\n== point\n{{name}} {{x}} {{y}} {{z}} {{a}} "
      "{{b}} {{c}}\n== circle\nARC {{via_number}} {{end_number}} {{point}}\n";
  EXPECT_NE(hints(small_pack("", "") + round.substr(round.find("== point")))
                .find("\"circle\" has no variable \"end_number\". The end's are point, "
                      "point_number, x, y, z, a, b, c and d."),
            std::string::npos);
}

TEST(Templates, WhatAPackHasNotIsAnErrorAtItsLine) {
  const auto pack = program_post::read_templates(
      "robomosp target 1\nname: a\nmotions: lin\n== program_begin\n== program_end\n== lin\nGO "
      "{{x}} {{q1}}\n== output_on\nON\n== output_off\nOFF\n== wait_time\nREST {{seconds}}\n",
      "a.post");
  ASSERT_TRUE(pack.ok());
  const auto post = program_post::make_template_post(*pack);
  const Posted got = post_source(*post,
                                 "PROGRAM p;\nVAR POSE: a := POSE(POSITION(1.0, 0.0, 0.0), "
                                 "ORIZYX(0.0, 0.0, 0.0));\nINT: i;\nBEGIN\nMOVE LIN a;\n"
                                 "MOVE PTP a;\nHALT;\ni := 1;\nENDPROGRAM;\n");
  for (const char* each :
       {"error 3: a has no declare_int", "error 5: the template's variable q1 has no value here",
        "error 6: ", "error 7: a has no halt", "error 8: a has no assign"})
    EXPECT_NE(got.faults.find(each), std::string::npos) << each << "\n" << got.faults;
}

TEST(Posts, EqualProgramsGiveEqualFiles) {
  const std::string source = test::read_text(kPrograms / "words.irl");
  EXPECT_EQ(post_source(posts::Krl(), source).files, post_source(posts::Krl(), source).files);
}

double seconds_of(const Post& post, int motions) {
  std::string source = "PROGRAM p;\nBEGIN\n";
  for (int i = 0; i < motions; ++i)
    source += "MOVE LIN POSE(POSITION(" + std::to_string(i) + ".5, 0.0, 0.0), ORIZYX(0.0, 90.0, " +
              std::to_string(i % 90) + ".0));\n";
  const std::clock_t start = std::clock();  // whatever else runs on the machine
  const Posted got = post_source(post, source + "ENDPROGRAM;\n");
  EXPECT_EQ(got.files.size(), post.capabilities().title == "KUKA KRL" ? 2U : 1U);
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}
TEST(Posts, TimeGrowsWithTheProgram) {
  // Ten times the motions take about ten times as long; a square would be a hundred.
  const posts::Krl krl;
  const posts::Rapid rapid;
  for (const Post* p : {static_cast<const Post*>(&krl), static_cast<const Post*>(&rapid)}) {
    const double few = seconds_of(*p, 2000), many = seconds_of(*p, 20000);
    EXPECT_LT(many, 35 * few + 0.1) << p->capabilities().title;
    std::printf("%s: 20000 motions in %.2f s with compiling\n",
                std::string(p->capabilities().title).c_str(), many);
  }
}

}  // namespace
}  // namespace robomosp
