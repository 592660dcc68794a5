// SPDX-License-Identifier: Apache-2.0
// IRL in editors: what each question gives at the exact place, on half-typed lines too; layout that
// keeps every token; new names that keep every meaning; broken sources; growth.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "editing.h"
#include "irl_generator.h"
#include "support/mutator.h"
#include "support/seed.h"

namespace robomosp::irl {
namespace {

namespace fs = std::filesystem;

struct EditedFile {
  std::string name, text;
};
std::unique_ptr<EditedProgram> opened(const std::vector<EditedFile>& files) {
  std::vector<SourceFile> all;
  for (const EditedFile& f : files) all.push_back({f.name, f.text, {}});
  return edit(all);
}
/// A text with its place, which is marked by "|".
struct Marked {
  explicit Marked(std::string with_mark) : text(std::move(with_mark)) {
    at = static_cast<std::uint32_t>(text.find('|'));
    text.erase(at, 1);
  }
  std::string text;
  std::uint32_t at = 0;
};
/// Labels in order, separated by blanks.
std::string completed(const std::string& marked, std::vector<EditedFile> more = {}) {
  const Marked m(marked);
  more.insert(more.begin(), {"p.irl", m.text});
  NoProgress progress;
  const auto items = opened(more)->complete(0, m.at, progress);
  EXPECT_TRUE(items.ok()) << (items.ok() ? "" : items.error().sentence());
  std::string out;
  if (!items.ok()) return out;
  for (const SourceCompletion& c : *items) out += (out.empty() ? "" : " ") + c.label;
  return out;
}
bool has(const std::string& labels, const std::string& one) {
  return (" " + labels + " ").find(" " + one + " ") != std::string::npos;
}
constexpr const char* kLift = R"(PROGRAM lift;
SIGNAL
  INPUT BOOL: part_here AT 1;
CONST
  REAL: height := 50.0;  { of a part [mm] }
TYPE
  RECORD POSE: place; INT: count; ENDRECORD: SLOT;
VAR
  INT: rounds := 3, i;
  ARRAY [1..4] OF SLOT: slots;
{ Moves there. }
PROCEDURE go (IN REAL: up; OUT INT: state);
VAR
  INT: tries;
BEGIN
  tries := 0;
  MOVE LIN slots[1].place SPEED := 80.0;
  state := tries;
ENDPROC;
PROCESS watch;
BEGIN
  WAIT FOR part_here;
ENDPROCESS;
BEGIN
  LABEL again:
  FOR i := 1 TO rounds DO
    go(height, rounds);
  ENDFOR;
  GOTO again;
ENDPROGRAM;
)";
std::string lift_with(const std::string& line) {
  std::string s = kLift;
  const std::string before = "  FOR i := 1";
  return s.insert(s.find(before), "  " + line + "\n");
}

TEST(IrlEditing, CompletionKnowsTheFieldsOfAPlaceInAHalfTypedLine) {
  EXPECT_EQ(completed(lift_with("slots[2].|")), "place count");
  EXPECT_EQ(completed(lift_with("slots[2].place.|")), "POS ORI");
  EXPECT_EQ(completed(lift_with("slots[i + (1)].place.POS.|;")), "X Y Z");
  EXPECT_EQ(completed(lift_with("slots[2].c|")), "count place");  // what begins so comes first
  EXPECT_EQ(completed(lift_with("i.|")), "");
  EXPECT_EQ(completed(lift_with("INV(slots[1].place).|")), "POS ORI");
  EXPECT_EQ(completed(lift_with("nobody.|")), "");
}

TEST(IrlEditing, CompletionKnowsWhatAPlaceOfTheGrammarTakes) {
  EXPECT_EQ(completed(lift_with("MOVE |")), "CIRCLE LIN PATH PTP");
  EXPECT_EQ(completed(lift_with("GOTO |")), "again");
  EXPECT_EQ(completed(lift_with("START |"), {}).substr(0, 5), "watch");
  const std::string target = completed(lift_with("MOVE LIN |"));
  EXPECT_TRUE(has(target, "slots")) << target;
  EXPECT_FALSE(has(target, "SPEED")) << target;
  const std::string behind = completed(lift_with("MOVE LIN slots[1].place SPEED := 3.0 |;"));
  EXPECT_TRUE(has(behind, "ACC")) << behind;
  EXPECT_FALSE(has(behind, "SPEED")) << "given already: " << behind;
  EXPECT_FALSE(has(behind, "slots")) << behind;
  // Within its loop a routine's end is none, and within a routine its own names are known.
  const std::string inside = completed(lift_with("FOR i := 1 TO 2 DO |"));
  EXPECT_TRUE(has(inside, "ENDFOR")) << inside;
  EXPECT_FALSE(has(inside, "ENDPROGRAM")) << inside;
  EXPECT_FALSE(has(inside, "tries")) << "local of go: " << inside;
  EXPECT_TRUE(has(inside, "go")) << inside;
  std::string in_routine = kLift;
  in_routine.insert(in_routine.find("  tries := 0;"), "  t|\n");
  EXPECT_EQ(completed(in_routine).substr(0, 5), "tries");
  // Nothing within comments, strings and numbers.
  EXPECT_EQ(completed(lift_with("{ he| }")), "");
  EXPECT_EQ(completed(lift_with("PAUSE 'he|';")), "");
  EXPECT_EQ(completed(lift_with("PAUSE 'he|")), "");
  EXPECT_EQ(completed(lift_with("i := 12|;")), "");
  EXPECT_EQ(completed(lift_with("{ he|")), "");
  // Types where a declaration begins, and none where a new name belongs.
  EXPECT_TRUE(has(completed("PROGRAM p; VAR |"), "POSE"));
  EXPECT_EQ(completed("PROGRAM p; VAR INT: |"), "");
  EXPECT_TRUE(has(completed("PROGRAM p; PROCEDURE f (|"), "INOUT"));
  EXPECT_EQ(completed("PROGRAM p; SYSTEM_SPECIFICATION '|", {{"cell.ssi", ""}, {"a.dls", ""}}),
            "cell.ssi");
  EXPECT_EQ(completed("|"), "MODULE PROGRAM");
}

TEST(IrlEditing, HoverTellsTheDeclarationAndTheCommentBesideIt) {
  const auto hovered = [](const std::string& marked) {
    const Marked m(marked);
    NoProgress progress;
    const auto h = opened({{"p.irl", m.text}})->hover(0, m.at, progress);
    EXPECT_TRUE(h.ok());
    return h->detail + (h->doc.empty() ? "" : " / " + h->doc);
  };
  EXPECT_EQ(hovered(lift_with("i := ROUND(hei|ght);")),
            "CONST REAL: height := 50.0 / of a part [mm]");
  EXPECT_EQ(hovered(lift_with("g|o(1.0, i);")),
            "PROCEDURE go (IN REAL: up; OUT INT: state) / Moves there.");
  EXPECT_EQ(hovered(lift_with("WAIT FOR part_here|;")), "INPUT BOOL: part_here AT 1");
  EXPECT_EQ(hovered(lift_with("i := ROU|ND(height);")),
            "FUNCTION ROUND (REAL): INT / Nearest whole number; halves go away from zero.");
  EXPECT_EQ(hovered(lift_with("slots[1].pla|ce := slots[2].place;")),
            "POSE: place  { field of SLOT }");
  EXPECT_EQ(hovered(lift_with("MOVE LIN slots[1].place SPE|ED := 2.0;")),
            "SPEED := REAL / Speed of the tool along the path [mm/s].");
  EXPECT_EQ(hovered(lift_with("HA|LT;")), "HALT / Ends the program.");
  EXPECT_EQ(hovered(lift_with("i := 4|2;")), "");
  // A line with a fault of another kind is known as well.
  EXPECT_EQ(hovered(lift_with("i := hei|ght;")), "CONST REAL: height := 50.0 / of a part [mm]");
}

TEST(IrlEditing, DefinitionAndReferencesLeadThroughAllFiles) {
  const std::string cell =
      "PROGRAM cell;\nTYPE\n  RECORD REAL: A; ENDRECORD: MAIN_JOINT;\nVAR INT: shared;\n"
      "ENDPROGRAM;\n";
  const std::string tools = "MODULE tools;\nEXPORT k;\nCONST INT: k := 2;\nENDMODULE;\n";
  const Marked m(
      "PROGRAM p;\nSYSTEM_SPECIFICATION 'cell.ssi';\nIMPORT k FROM tools;\nVAR POSE: a;\n"
      "BEGIN\n  shared := |k; TEACH a;\nENDPROGRAM;\n");
  const std::string list = "a := POSE(POSITION(k, 0, 0), ORIZYX(0, 0, 0));\n";
  const std::vector<EditedFile> files = {
      {"p.irl", m.text}, {"cell.ssi", cell}, {"tools.irl", tools}, {"datalist.dls", list}};
  const auto p = opened(files);
  NoProgress progress;
  const auto where = p->definition(0, m.at, progress);
  ASSERT_TRUE(where.ok() && where->size() == 1);
  EXPECT_EQ((*where)[0].file, 2U);
  EXPECT_EQ((*where)[0].begin, tools.find("k :="));
  const auto all = p->references(0, m.at, progress);
  ASSERT_TRUE(all.ok());
  std::string seen;
  for (const SourceReference& r : *all)
    seen += files[r.range.file].name + ":" + std::to_string(r.range.begin) +
            (r.is_declaration ? "d " : " ");
  EXPECT_EQ(seen, "p.irl:" + std::to_string(m.text.find("k FROM")) + " p.irl:" +
                      std::to_string(m.at) + " tools.irl:" + std::to_string(tools.find("k;")) +
                      " tools.irl:" + std::to_string(tools.find("k :=")) +
                      "d datalist.dls:" + std::to_string(list.find("k,")) + " ");
  // The name of a file leads to it; a name of the language leads nowhere.
  const auto file = p->definition(0, static_cast<std::uint32_t>(m.text.find("cell.ssi")), progress);
  ASSERT_TRUE(file.ok() && file->size() == 1);
  EXPECT_EQ((*file)[0].file, 1U);
  const auto none = p->definition(3, static_cast<std::uint32_t>(list.find("ORIZYX")), progress);
  ASSERT_TRUE(none.ok());
  EXPECT_TRUE(none->empty());
  // A file that the program names nowhere is known by itself.
  const auto alone = opened({{"p.irl", "PROGRAM p; BEGIN ENDPROGRAM;"}, {"t.irl", tools}});
  const auto in_it = alone->references(1, static_cast<std::uint32_t>(tools.find("k :=")), progress);
  ASSERT_TRUE(in_it.ok());
  ASSERT_EQ(in_it->size(), 2U);
  EXPECT_EQ((*in_it)[0].range.file, 1U);
}

std::string renamed(const std::string& marked, const std::string& to) {
  const Marked m(marked);
  NoProgress progress;
  const auto edits = opened({{"p.irl", m.text}})->rename(0, m.at, to, progress);
  if (!edits.ok()) return "! " + edits.error().sentence();
  std::string out = m.text;
  for (auto e = edits->rbegin(); e != edits->rend(); ++e)
    out.replace(e->range.begin, e->range.end - e->range.begin, e->text);
  return out;
}

TEST(IrlEditing, ANewNameGoesEverywhereAndChangesNoMeaning) {
  const std::string text =
      "PROGRAM p; VAR INT: a|, b; PROCEDURE f; VAR INT: c, b; BEGIN c := A; ENDPROC; BEGIN a := "
      "b; f; ENDPROGRAM;";
  EXPECT_EQ(renamed(text, "n"),
            "PROGRAM p; VAR INT: n, b; PROCEDURE f; VAR INT: c, b; BEGIN c := n; ENDPROC; BEGIN n "
            ":= b; f; ENDPROGRAM;");
  // Declared already; hidden by a local; hides a function; a word; no name; the language's.
  EXPECT_EQ(renamed(text, "b"),
            "! p.irl:1:24: with the name \"b\" the program has an error: b is already declared. "
            "Choose another name.");
  EXPECT_EQ(renamed(text, "C"),
            "! p.irl:1:66: with the name \"C\", \"C\" would have a different meaning here. Choose "
            "another name.");
  EXPECT_NE(renamed("PROGRAM p; VAR REAL: a|; BEGIN a := SIN(1.0); ENDPROGRAM;", "sin").find("!"),
            std::string::npos);
  EXPECT_NE(renamed(text, "while").find("is a keyword of the language"), std::string::npos);
  EXPECT_NE(renamed(text, "1a").find("\"1a\" is not a name"), std::string::npos);
  EXPECT_NE(renamed("PROGRAM p; VAR POSE|: a; BEGIN ENDPROGRAM;", "x").find("of the language"),
            std::string::npos);
  EXPECT_NE(renamed("PROGRAM p; BEGIN | ENDPROGRAM;", "x").find("no name at this position"),
            std::string::npos);
  // Where a line is not understood, it is not known what its names are.
  EXPECT_NE(renamed("PROGRAM p; VAR INT: a|; BEGIN a := 1; IF a + THEN ENDIF; ENDPROGRAM;", "n")
                .find("it is unknown whether \"a\" here is the same"),
            std::string::npos);
  // A fault elsewhere is no obstacle.
  EXPECT_EQ(renamed("PROGRAM p; VAR INT: a|; BEGIN a := 1; zzz := 2; ENDPROGRAM;", "n"),
            "PROGRAM p; VAR INT: n; BEGIN n := 1; zzz := 2; ENDPROGRAM;");
  // A record that means something to motions keeps its name.
  EXPECT_NE(
      renamed("PROGRAM p; TYPE RECORD REAL: A; ENDRECORD: MAIN_JOINT|; BEGIN ENDPROGRAM;", "AXES")
          .find("has a meaning for motions by its name"),
      std::string::npos);
}

std::string laid_out(const std::string& text, SourceCase words = SourceCase::keep) {
  SourceLayout how;
  how.words = words;
  const auto out = lay_out("p.irl", text, how);
  return out.ok() ? *out : "! " + out.error().sentence();
}

TEST(IrlLayout, IsTheUsualOne) {
  EXPECT_EQ(laid_out("program  p ;\nvar\nint:a,b:=- 1;{ two }\n\n\n\nprocedure f(in int:x);\n"
                     "begin\nif a>b   and\nnot(b=1) then\n{ inner }\na:=f1( 1 ,- b )[ 2 ] . c;\n"
                     "{ last }\nelse\nmove lin q\nspeed:=3.0\nuntil a=b do f;\nendif;\n"
                     "case a of\nwhen 1 , 2 :\nb:=1;\ndefault:\nrepeat\nwait for b;\nuntil a=1;\n"
                     "endcase;\nendproc;\nbegin\nendprogram;",
                     SourceCase::upper),
            "PROGRAM p;\nVAR\n  int: a, b := -1; { two }\n\nPROCEDURE f (IN int: x);\nBEGIN\n"
            "  IF a > b AND\n      NOT (b = 1) THEN\n    { inner }\n    a := f1(1, -b)[2].c;\n"
            "    { last }\n  ELSE\n    MOVE lin q\n        speed := 3.0\n        UNTIL a = b DO "
            "f;\n  ENDIF;\n  CASE a OF\n    WHEN 1, 2:\n      b := 1;\n    DEFAULT:\n      "
            "REPEAT\n        WAIT FOR b;\n      UNTIL a = 1;\n  ENDCASE;\nENDPROC;\nBEGIN\n"
            "ENDPROGRAM;\n");
  EXPECT_EQ(laid_out(""), "");
  EXPECT_EQ(laid_out("PROGRAM p;\r\nBEGIN\r\nENDPROGRAM;\r\n"),
            "PROGRAM p;\r\nBEGIN\r\nENDPROGRAM;\r\n");
  EXPECT_NE(laid_out("PROGRAM p; { no end").find("this comment has no end"), std::string::npos);
}

/// Tokens and comments, words in capitals.
std::string tokens_of(const std::string& text) {
  Source s;
  Names names;
  Faults faults;
  s.text = text;
  scan(s, names, faults);
  std::string out;
  std::uint32_t from = 0;
  for (const Token& t : s.tokens) {
    each_gap(s.text, from, t.begin, [&](Gap g, std::uint32_t b, std::uint32_t e) {
      if (g != Gap::blanks) out += text.substr(b, e - b) + "\n";
    });
    out += (t.kind >= Tok::k_program ? upper(s.word(t)) : std::string(s.word(t))) + "\n";
    from = t.end;
  }
  return out;
}
void expect_sound_layout(const std::string& text) {
  const auto words = text.size() % 2 ? SourceCase::lower : SourceCase::keep;
  const std::string once = laid_out(text, words);
  ASSERT_NE(once.substr(0, 1), "!") << once << "\n" << text;
  ASSERT_EQ(laid_out(once, words), once) << text;
  ASSERT_EQ(tokens_of(once), tokens_of(text)) << once;
}
fs::path edited_data() {
  const char* given = std::getenv("ROBOMOSP_OLD_FILES");
  return (given ? fs::path(given) : fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data/robomosp-1.4") /
         "Saves/IRL";
}
std::string text_of_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(IrlLayout, TwiceIsOnceAndEveryTokenStays) {
  expect_sound_layout(kLift);
  expect_sound_layout(std::string(kPredefined));
  expect_sound_layout(std::string(kStandardCell));
  std::mt19937 random(test::seed());
  Generator generator(random);
  for (int n = 0; n < 500; ++n) {
    std::string text = generator.program();
    // Blanks of other kinds, and comments, anywhere between tokens.
    for (std::size_t i = text.size(); i-- > 0;)
      if (text[i] == ' ' || text[i] == ';') switch (random() % 9) {
          case 0: text.insert(i + 1, "\n"); break;
          case 1: text.insert(i + 1, "\t \n\n\n"); break;
          case 2: text.insert(i + 1, "{ x\n  y }"); break;
          default: break;
        }
    expect_sound_layout(text);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(IrlLayout, TheProgramsOf2006KeepTheirTokens) {
  if (!fs::exists(edited_data())) GTEST_SKIP() << "no files of 2006";
  for (const char* name : {"HanoiPA10.irl", "PA10.ssi", "predefined.irl"})
    expect_sound_layout(text_of_file(edited_data() / name));
}

/// Asks everything at a place; what is given lies within the texts, in order.
void ask_all(const EditedProgram& p, const std::vector<EditedFile>& files, std::uint32_t file,
             std::uint32_t at) {
  NoProgress progress;
  const auto within = [&](const SourceRange& r) {
    ASSERT_LT(r.file, files.size());
    ASSERT_LE(r.begin, r.end);
    ASSERT_LE(r.end, files[r.file].text.size());
  };
  const auto items = p.complete(file, at, progress);
  ASSERT_TRUE(items.ok());
  for (const SourceCompletion& c : *items) within({file, c.begin, c.end});
  const auto hover = p.hover(file, at, progress);
  ASSERT_TRUE(hover.ok());
  within(hover->range);
  const auto where = p.definition(file, at, progress);
  ASSERT_TRUE(where.ok());
  for (const SourceRange& r : *where) within(r);
  const auto all = p.references(file, at, progress);
  ASSERT_TRUE(all.ok());
  for (const SourceReference& r : *all) within(r.range);
  const auto edits = p.rename(file, at, "other_name", progress);
  if (edits.ok())
    for (const SourceEdit& e : *edits) within(e.range);
  else ASSERT_FALSE(edits.error().message.empty());
  const auto signature = p.signature(file, at, progress);
  ASSERT_TRUE(signature.ok());
  for (const std::uint32_t x : signature->parameters) ASSERT_LE(x, signature->label.size());
}
void ask_file(const EditedProgram& p, const std::vector<EditedFile>& files, std::uint32_t file) {
  NoProgress progress;
  const auto tokens = p.tokens(file, progress);
  ASSERT_TRUE(tokens.ok());
  std::uint32_t last = 0;
  for (const SourceToken& t : *tokens) {
    ASSERT_LE(last, t.begin);
    ASSERT_LT(t.begin, t.end);
    last = t.end;
  }
  ASSERT_LE(last, files[file].text.size());
  const auto outline = p.outline(file, progress);
  ASSERT_TRUE(outline.ok());
  for (std::size_t i = 0; i < outline->size(); ++i) {
    const SourceSymbol& s = (*outline)[i];
    ASSERT_TRUE(s.parent == RMP_NONE || s.parent < i);
    ASSERT_LE(s.begin, s.name_begin);
    ASSERT_LE(s.name_begin, s.name_end);
    ASSERT_LE(s.name_end, s.end);
    ASSERT_LE(s.end, files[file].text.size());
  }
  const auto folds = p.folds(file, progress);
  ASSERT_TRUE(folds.ok());
  for (const SourceRange& r : *folds) ASSERT_LE(r.end, files[file].text.size());
  const auto faults = p.faults(progress);
  ASSERT_TRUE(faults.ok());
  for (const SourceFault& f : *faults) ASSERT_LE(f.range.end, files[f.range.file].text.size());
  (void)p.format(file, {}, progress);
}

TEST(IrlEditingRandom, EveryPrefixOfAProgramIsAnswered) {
  const std::string whole = kLift;
  for (std::size_t n = 0; n <= whole.size(); n += 3) {
    const std::vector<EditedFile> files = {{"p.irl", whole.substr(0, n)}};
    const auto p = opened(files);
    ask_all(*p, files, 0, static_cast<std::uint32_t>(n));
    ask_file(*p, files, 0);
    if (testing::Test::HasFatalFailure()) FAIL() << files[0].text;
  }
}

TEST(IrlEditingRandom, BrokenSourcesAreAnsweredAndNeverCrash) {
  std::mt19937 random(test::seed());
  static const char* const kPieces[] = {
      "BEGIN ", "ENDPROC;",  "IF ",     "(",     ")",    "[",      "{",    "}",           "'", ".",
      ";",      "MOVE LIN ", "RECORD ", "GOTO ", "\xff", "UNTIL ", "VAR ", "PROCEDURE f("};
  for (int n = 0; n < 600; ++n) {
    std::vector<EditedFile> files = {{"p.irl", kLift},
                                     {"cell.ssi", "PROGRAM c; CONST INT: q := 1; ENDPROGRAM;"},
                                     {"d.dls", "a := 1;"}};
    EditedFile& f = files[random() % 3];
    for (std::size_t k = 1 + random() % 4; k > 0; --k) {
      const std::size_t at = random() % (f.text.size() + 1);
      if (random() % 3 == 0) f.text.erase(at, random() % 40);
      else f.text.insert(at, kPieces[random() % std::size(kPieces)]);
    }
    if (random() % 2)
      files[0].text.insert(std::min<std::size_t>(14, files[0].text.size()),
                           "SYSTEM_SPECIFICATION 'cell.ssi'; DATALIST 'd.dls';");
    const auto p = opened(files);
    for (std::uint32_t file = 0; file < 3; ++file) {
      ask_file(*p, files, file);
      for (int k = 0; k < 3; ++k)
        ask_all(*p, files, file,
                static_cast<std::uint32_t>(random() % (files[file].text.size() + 1)));
      if (testing::Test::HasFatalFailure()) FAIL() << f.name << "\n" << f.text;
    }
  }
}

TEST(IrlEditing, PlacesOutsideOfTheTextsAreRefused) {
  const auto p = opened({{"p.irl", "PROGRAM p; BEGIN ENDPROGRAM;"}});
  NoProgress progress;
  EXPECT_FALSE(p->complete(0, 1000, progress).ok());
  EXPECT_FALSE(p->hover(3, 0, progress).ok());
  EXPECT_FALSE(opened({})->faults(progress).ok());
  SourceLayout wide;
  wide.indent = 17;
  EXPECT_FALSE(p->format(0, wide, progress).ok());
}

std::string long_program(int lines) {
  std::string out = "PROGRAM p;\nVAR\n  INT: i, k;\n  POSE: place;\n  REAL: r;\n";
  for (int n = 0; n < lines / 10; ++n) {
    const std::string id = std::to_string(n);
    out += "PROCEDURE f" + id + " (IN INT: a);\nVAR\n  INT: local" + id + ";\nBEGIN\n  local" + id +
           " := a + i * 2;\n  IF local" + id +
           " > 3 THEN\n"
           "    MOVE LIN place SPEED := 80.0;\n    r := SIN(r) + 1.5;\n  ENDIF;\nENDPROC;\n";
  }
  return out + "BEGIN\n  i := 1;\nENDPROGRAM;\n";
}

TEST(IrlEditing, TimesGrowWithTheProgram) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::time_point from) {
    return std::chrono::duration<double, std::milli>(Clock::now() - from).count();
  };
  double first[3] = {};
  for (const int lines : {1000, 10'000, 100'000}) {
    std::string text = long_program(lines);
    const std::string typed = "  i := loc";
    text.insert(text.rfind("  i := 1;"), typed + "\n");
    const auto at = static_cast<std::uint32_t>(text.find(typed + "\n") + typed.size());
    double best[3] = {1e9, 1e9, 1e9};
    for (int k = 0; k < 3; ++k) {
      NoProgress progress;
      const auto p = opened({{"p.irl", text}});
      auto from = Clock::now();
      ASSERT_TRUE(p->complete(0, at, progress).ok());
      best[0] = std::min(best[0], ms(from));
      from = Clock::now();
      ASSERT_TRUE(p->faults(progress).ok());
      best[1] = std::min(best[1], ms(from));
      from = Clock::now();
      ASSERT_TRUE(p->hover(0, at, progress).ok());
      best[2] = std::min(best[2], ms(from));
    }
    std::printf("%7d lines: completion %.1f ms, faults %.1f ms, then hover %.2f ms\n", lines,
                best[0], best[1], best[2]);
    if (lines == 1000) std::copy(best, best + 3, first);
    if (lines == 100'000) {
      // A hundred times the lines: what grows with the square takes ten thousand times as long.
      EXPECT_LT(best[0], 1000 * std::max(first[0], 0.2));
      EXPECT_LT(best[1], 1000 * std::max(first[1], 0.2));
    }
  }
}

}  // namespace
}  // namespace robomosp::irl
