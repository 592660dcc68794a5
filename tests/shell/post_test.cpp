// SPDX-License-Identifier: Apache-2.0
// Posts of third parties as their authors meet them: exit codes of `robomosp post`, packs of
// templates in folders, and `robomosp post test` with the reader that is filled in.
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "shell/child_program.h"

namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;
using robomosp::test::Folder;
using robomosp::test::Outcome;
using robomosp::test::run;
using robomosp::test::slurp;

const fs::path kExamples = fs::path(ROBOMOSP_SOURCE_DIR) / "sdk" / "examples";
constexpr const char* kLift =
    "PROGRAM lift;\nSIGNAL OUTPUT BOOL: grip AT 2;\n"
    "VAR POSE: place := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));\n"
    "BEGIN\n  MOVE LIN place SPEED := 80.0;\n  grip := TRUE;\nENDPROGRAM;\n";

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
void write(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}
/// A pack of a few templates.
std::string pack(const std::string& name, const std::string& rest = {}) {
  return "robomosp target 1\nname: " + name +
         "\nmotions: lin\nforms: flat\n== program_begin\nBEGIN\n== program_end\nEND\n== lin\n"
         "GO {{x}} {{y}} {{z}} {{a}} {{b}} {{c}} {{speed}}\n== output_on\nON {{number}}\n"
         "== output_off\nOFF {{number}}\n== wait_time\nREST {{seconds}}\n" +
         rest;
}

class PostCommand : public testing::Test {
 protected:
  void SetUp() override { write(at("lift.irl"), kLift); }
  [[nodiscard]] std::string at(const std::string& name) const {
    return (folder_.path / name).string();
  }
  Outcome post(std::vector<std::string> words) const {
    words.insert(words.begin(), {"-q", "post"});
    return run(words);
  }
  /// It ends with `code`, and says this on standard error in one sentence.
  void expect(int code, const std::string& said, const std::vector<std::string>& words) const {
    const Outcome o = post(words);
    std::string all;
    for (const std::string& w : words) all += w + " ";
    EXPECT_EQ(o.code, code) << all << "\n" << o.out << o.err;
    EXPECT_TRUE(has(o.err, said)) << all << "\n" << o.err;
    std::vector<std::string> json{"-q", "--json", "post"};
    json.insert(json.end(), words.begin(), words.end());
    const Outcome again = run(json);
    EXPECT_EQ(again.code, code) << all << again.out;
    if (code != 2) {
      EXPECT_TRUE(Json::accept(again.out)) << all << again.out;
    }
  }
  Folder folder_;
};

TEST_F(PostCommand, ExitCodesTellAProgramsFaultsUsageAndWrongInputApart) {
  const std::string lift = at("lift.irl");
  // 0: it is posted.
  EXPECT_TRUE(has(post({lift, "--target", "krl"}).out, "LIN XPLACE"));
  expect(0, "", {lift, "--target", "krl", "--check"});
  fs::create_directory(at("out"));
  const Outcome written = post({lift, "--target", "krl", "-o", at("out")});
  EXPECT_EQ(written.code, 0) << written.err;
  EXPECT_TRUE(fs::exists(at("out/LIFT.src"))) << written.out;
  // 1: the program is wrong, or the target cannot say it; each fault has its place.
  write(at("bad.irl"), "PROGRAM bad;\nVAR INT: i;\nBEGIN\n  i := 1.5;\n  j := 2;\nENDPROGRAM;\n");
  expect(1, "", {at("bad.irl"), "--target", "krl"});
  const std::string both = post({at("bad.irl"), "--target", "krl"}).err;
  EXPECT_TRUE(has(both, "bad.irl:4:") && has(both, "bad.irl:5:")) << both;
  write(at("file.irl"), "PROGRAM file;\nVAR FILE: f;\nBEGIN\n  OPEN(f, 'x', 'R');\nENDPROGRAM;\n");
  const Outcome refused = run({"post", at("file.irl"), "--target", "krl"});
  EXPECT_EQ(refused.code, 1) << refused.err;
  EXPECT_TRUE(has(refused.err, "file.irl:4:3: error: KUKA KRL has no OPEN")) << refused.err;
  EXPECT_TRUE(has(refused.err, "file.irl:4:3: note: the program cannot be flattened either"))
      << refused.err;
  expect(1, "file.irl:4:3: error: the flow depends on the file x",
         {at("file.irl"), "--target", "gcode"});
  // 2: usage.
  expect(2, "post needs a program", {});
  expect(2, "", {lift, "--target", "krl", "--form", "round"});
  expect(2, "", {lift, "--no-such"});
  // 3: wrong input.
  expect(2, "Targets are as, c, ", {lift});
  expect(2, "Targets are as, c, ", {"test"});
  expect(3, "\"kurl\"", {lift, "--target", "kurl"});
  expect(3, "nobody.irl", {at("nobody.irl"), "--target", "krl"});
  expect(3, "out", {at("out"), "--target", "krl"});
  expect(3, "\"nobody\"", {lift, "--target", "krl", "--robot", "nobody"});
  expect(3, "\"nobody\"", {lift, "--profile", "nobody"});
  expect(3, "nobody.ctl", {lift, "--profile", at("nobody.ctl")});
  expect(3, "there is no folder", {lift, "--target", "krl", "-o", at("nowhere")});
  expect(3, "there is no folder", {lift, "--target", "krl", "-o", lift});
  expect(3, "LIFT.src\" already", {lift, "--target", "krl", "-o", at("out")});
  expect(0, "", {lift, "--target", "krl", "-o", at("out"), "--overwrite"});
  // Nobody writes there, whoever asks.
  expect(3, "/proc/self/task/LIFT.src", {lift, "--target", "krl", "-o", "/proc/self/task"});
  // Packs.
  expect(3, "nobody.post", {lift, "--templates", at("nobody.post")});
  expect(3, "pack.post", {lift, "--templates", at("out")});
  write(at("good.post"), pack("acme"));
  expect(0, "", {lift, "--templates", at("good.post")});
  write(at("broken.post"), pack("acme", "== halt\nSTOP {{now}}\n== fly\n"));
  const Outcome broken = post({lift, "--templates", at("broken.post")});
  EXPECT_EQ(broken.code, 3);
  EXPECT_EQ(broken.err,
            "broken.post:18:8: error: \"halt\" has no variable \"now\".\n"
            "broken.post:19:4: error: there is no construct \"fly\". "
            "docs/plugin_author/post_templates.md lists them.\n");
  // The table stands in the help and on the page.
  EXPECT_TRUE(has(run({"post", "--help"}).out, "Exit codes: 0 posted"));
}

TEST(Post, PostsThePartOfOneRobotOrSaysWhichLinesItNeeds) {
  const std::string both = std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/programs/two_robots.irl";
  const Outcome none =
      run({"post", both, "--target", "krl", "--only-robot", "left", "--form", "structured"});
  EXPECT_EQ(none.code, 1) << none.err;
  EXPECT_TRUE(has(none.err, "two_robots.irl:33:5: error: the semaphore table_free")) << none.err;
  EXPECT_TRUE(has(none.err, "part_there_released")) << none.err;
  const Outcome whole = run({"post", both, "--target", "krl", "--robot", "ur5"});
  EXPECT_EQ(whole.code, 1) << whole.err;
  EXPECT_TRUE(has(whole.err, "--only-robot")) << whole.err;
  const Outcome middle = run({"post", both, "--target", "krl", "--only-robot", "middle"});
  EXPECT_EQ(middle.code, 3) << middle.err;
  EXPECT_TRUE(has(middle.err, "It declares left, right.")) << middle.err;
}

/// Short texts are kept within their string, and move along with it.
TEST_F(PostCommand, TextsOfAControllersRecordAreWrittenWhateverTheirLength) {
  const std::string lift = at("lift.irl");
  std::string tooled = pack("acme");
  tooled.replace(tooled.find("BEGIN\n"), 6, "BEGIN {{tool}} {{frame}}\n");
  write(at("tooled.post"), tooled);
  const auto record = [&](const std::string& target, const std::string& line) {
    write(at("r.ctl"), "robomosp controller 1\nname \"c\"\ntarget \"" + target +
                           "\"\nprogram \"P1\"\nprologue \"" + line + "\"\nepilogue \"E" + line +
                           "\"\nsignal grip { target \"G9\" number 9 }\n"
                           "tool t { number 4 }\nframe f { number 5 }\n"
                           "default_tool \"t\"\ndefault_frame \"f\"\n");
  };
  for (std::size_t length = 1; length < 40; length += length < 20 ? 1 : 7) {
    std::string line;
    for (std::size_t i = 0; i < length; ++i) line += static_cast<char>('A' + i % 26);
    record("krl", line);
    const Outcome krl = post({lift, "--profile", at("r.ctl"), "--robot", "ur5"});
    EXPECT_EQ(krl.code, 0) << krl.err;
    EXPECT_TRUE(has(krl.out, line + "\n") && has(krl.out, "E" + line + "\n")) << krl.out;
    EXPECT_FALSE(has(krl.out, std::string(1, '\0'))) << length;
    record("acme", line);
    const Outcome acme = post({lift, "--templates", at("tooled.post"), "--profile", at("r.ctl")});
    EXPECT_EQ(acme.code, 0) << acme.err;
    EXPECT_EQ(acme.out, "=== P1.txt\nBEGIN 4 5\n  " + line +
                            "\n  GO 500 0 120 180 0 180 80\n  ON 9\n  E" + line + "\nEND\n");
  }
}

TEST_F(PostCommand, ACircleIsWrittenByThePacksTemplate) {
  write(at("arc.irl"),
        "PROGRAM arc;\nVAR POSE: a := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0)),\n"
        "  b := POSE(POSITION(550.0, 50.0, 120.0), ORIZYX(0.0, 180.0, 0.0)),\n"
        "  c := POSE(POSITION(600.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));\n"
        "BEGIN\n  MOVE LIN a;\n  MOVE CIRCLE b, c SPEED := 40.0;\nENDPROGRAM;\n");
  std::string round =
      pack("acme",
           "== circle\nARC {{via_x}} {{via_y}} {{via_z}} TO {{x}} {{y}} {{z}} {{a}} "
           "{{b}} {{c}} AT {{speed}}\n");
  round.replace(round.find("motions: lin"), 12, "motions: lin circle");
  write(at("round.post"), round);
  const Outcome with = post({at("arc.irl"), "--templates", at("round.post")});
  EXPECT_EQ(with.code, 0) << with.err;
  EXPECT_EQ(with.err, "");
  EXPECT_TRUE(has(with.out, "ARC 550 50 120 TO 600 0 120 180 0 180 AT 40\n")) << with.out;
  // Without, it is straight pieces, and said to be.
  write(at("good.post"), pack("acme"));
  const Outcome without = run({"post", at("arc.irl"), "--templates", at("good.post")});
  EXPECT_TRUE(has(without.err, "straight pieces")) << without.err;
}

TEST_F(PostCommand, APackAndAnotherTargetAreNotTakenAtOnce) {
  write(at("good.post"), pack("acme"));
  expect(3, "the target \"krl\" is requested, but the pack is \"acme\"",
         {at("lift.irl"), "--target", "krl", "--templates", at("good.post")});
  expect(0, "", {at("lift.irl"), "--target", "acme", "--templates", at("good.post")});
}

/// What is flattened already is no way out, and what stands in its way is told with the other.
TEST_F(PostCommand, NobodySendsAFlattenedProgramToItself) {
  write(at("search.irl"),
        "PROGRAM search;\nSIGNAL INPUT BOOL: touched AT 1;\n"
        "VAR POSE: a := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));\n"
        "BEGIN\n  MOVE LIN a;\n  MOVE LIN a UNTIL touched;\n  MOVE_INC LIN POSITION(0.0, 0.0, "
        "5.0);\nENDPROGRAM;\n");
  std::string both = pack("acme");
  both.replace(both.find("forms: flat\n"), 12, "");
  write(at("both.post"), both);
  const Outcome flat =
      run({"post", at("search.irl"), "--templates", at("both.post"), "--form", "flat"});
  EXPECT_EQ(flat.code, 1) << flat.out;
  EXPECT_TRUE(has(flat.err, "acme has no motions that end on a condition")) << flat.err;
  EXPECT_FALSE(has(flat.err, "flattened program")) << flat.err;
  const Outcome automatic = run({"post", at("search.irl"), "--templates", at("both.post")});
  EXPECT_EQ(automatic.code, 1) << automatic.out;
  EXPECT_TRUE(has(automatic.err, "note: the flattened program is refused, too: ")) << automatic.err;
}

TEST_F(PostCommand, APackIsReadAsItIsAndItsFaultsHaveAPlace) {
  const std::string lift = at("lift.irl");
  const auto told = [&](const std::string& text) {
    write(at("one.post"), text);
    const Outcome o = post({lift, "--templates", at("one.post")});
    EXPECT_EQ(o.code, 3) << o.out << o.err;
    return o.err;
  };
  const auto begins = [](const std::string& text, const std::string& with) {
    EXPECT_TRUE(text.starts_with(with)) << text;
  };
  begins(told(""), "one.post:1:1: error: the first line is not \"robomosp target 1\".");
  begins(told(std::string("\xff\xfer\0o\0", 6)), "one.post:1:1: error: the file is UTF-16. Save");
  begins(told(pack("acme", "== comment\n; \xe4 {{text}}\n")),
         "one.post:18:3: error: the byte 0xE4 here is not UTF-8. Save the file as UTF-8;");
  begins(told(pack("acme") + std::string(5 << 20, 'x')), "error: ");
  begins(told("robomosp target 1\nname: acme\n"),
         "one.post:1:1: error: it has no motions: motions: ptp_joints lin.");
  begins(told(pack("acme", "== comment\n; {{text|uper}}\n")),
         "one.post:18:10: error: there is no filter \"uper\". Did you mean \"upper\"?");
  begins(told(pack("acme", "== comment\n; {{text\n")),
         "one.post:18:3: error: {{ is not closed by }}. Write {{open}} for the character itself.");
  begins(told(pack("acme", "== wait_time\nREST\n")),
         "one.post:17:4: error: the construct \"wait_time\" already has a template");
  std::string drops = pack("acme");
  drops.replace(drops.find(" {{seconds}}"), 12, "");
  begins(told(drops),
         "one.post:15:4: error: the template \"wait_time\" does not write one of {{seconds}} and "
         "{{milliseconds}}, which would be lost.");
  drops = pack("acme");
  drops.replace(drops.find("ON {{number}}\n"), 14, "");
  begins(told(drops),
         "one.post:11:4: error: the template \"output_on\" writes nothing, so the statement would "
         "be lost. Write the controller's line for it.");
  // Lines that end with CR LF are lines.
  std::string crlf;
  for (const char c : pack("acme")) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  write(at("crlf.post"), crlf);
  write(at("lf.post"), pack("acme"));
  const Outcome of_crlf = post({lift, "--templates", at("crlf.post")});
  EXPECT_EQ(of_crlf.code, 0) << of_crlf.err;
  EXPECT_EQ(of_crlf.out, post({lift, "--templates", at("lf.post")}).out);
  // An attribute that the template drops is told at its line.
  std::string slow = pack("acme");
  slow.replace(slow.find(" {{speed}}"), 10, "");
  write(at("slow.post"), slow);
  const Outcome dropped = run({"post", lift, "--templates", at("slow.post")});
  EXPECT_EQ(dropped.code, 0) << dropped.err;
  EXPECT_TRUE(has(dropped.err,
                  "lift.irl:5:3: warning: SPEED is not written: the template \"lin\" has no "
                  "{{speed}}. Remove it here, or add it to the template."))
      << dropped.err;
}

// ---- packs in folders ----

/// Targets that are made of templates, "name origin" a line, and what was said at the start.
Outcome listed(const std::vector<fs::path>& folders) {
  std::vector<std::string> words;
  for (const fs::path& f : folders) words.insert(words.end(), {"--plugin-path", f.string()});
  words.insert(words.end(), {"eval",
                             "for _, t in ipairs(program.targets()) do if t.by == 'templates' then "
                             "print(t.name, t.origin) end end"});
  return run(words);
}

TEST(PostPacks, FilesFoldersAndLinksAreTargetsAndTheFirstOfANameIsTaken) {
  const Folder a, b;
  write(a.path / "one.post", pack("one"));
  fs::create_directory(a.path / "two");
  write(a.path / "two" / "pack.post", "robomosp target 1\nname: two\ninclude: rest.part\n");
  const std::string rest = pack("two");
  write(a.path / "two" / "rest.part", rest.substr(rest.find("motions")));
  fs::create_directory(a.path / "no_pack");
  fs::create_symlink(a.path / "one.post", b.path / "linked.post");  // of the name one: a second one
  write(b.path / "three.post", pack("three"));
  fs::create_directory_symlink(a.path / "two", b.path / "two");  // hidden by the first
  fs::create_symlink(b.path / "three.post", b.path / "again.post");
  const Outcome o = listed({a.path, b.path});
  EXPECT_EQ(o.code, 0) << o.err;
  for (const auto& [name, origin] :
       std::vector<std::pair<std::string, fs::path>>{{"one", a.path / "one.post"},
                                                     {"two", a.path / "two" / "pack.post"},
                                                     {"three", b.path / "again.post"}})
    EXPECT_TRUE(has(o.out, name + "\t" + origin.string())) << o.out;
  EXPECT_TRUE(has(o.err,
                  "linked.post\" was left out: there is a target \"one\" "
                  "already, from \"" +
                      (a.path / "one.post").string() + "\". Give the pack another name."))
      << o.err;
  EXPECT_TRUE(has(o.err, "three.post\" was left out: there is a target \"three\"")) << o.err;
  EXPECT_FALSE(has(o.err, "no_pack")) << o.err;  // a folder is a pack where it has pack.post
}

TEST(PostPacks, NoneTakesThePlaceOfAShippedTarget) {
  const Folder a;
  write(a.path / "mine.post", pack("krl"));
  const Outcome o = listed({a.path});
  EXPECT_EQ(o.code, 0);
  EXPECT_FALSE(has(o.out, "krl")) << o.out;
  EXPECT_TRUE(has(o.err, "mine.post\" was left out: there is a target \"krl\" already")) << o.err;
  const Outcome by_hand = run({"-q", "post", "test", (a.path / "mine.post").string()});
  EXPECT_EQ(by_hand.code, 3) << by_hand.out;
  EXPECT_TRUE(has(by_hand.err, "Give the pack another name.")) << by_hand.err;
}

TEST(PostPacks, WhatCannotBeReadIsSaidAndTheOthersAreThere) {
  const Folder a;
  write(a.path / "good.post", pack("good"));
  write(a.path / "empty.post", "");
  write(a.path / "huge.post", std::string(5 << 20, '#'));
  write(a.path / "broken.post", pack("broken", "== halt\nSTOP {{now}}\n"));
  fs::create_symlink(a.path / "gone", a.path / "dangling.post");
  fs::create_symlink(a.path / "round.post", a.path / "round.post");
  fs::create_directory(a.path / "folder.post");
  ASSERT_EQ(::mkfifo((a.path / "pipe.post").c_str(), 0600), 0);
  fs::create_directory(a.path / "outer");
  write(a.path / "outer" / "pack.post",
        "robomosp target 1\nname: outer\ninclude: ../good.post\nmotions: lin\n");
  const Outcome o = listed({a.path});
  EXPECT_EQ(o.code, 0);
  EXPECT_TRUE(has(o.out, "good\t")) << o.out << o.err;
  EXPECT_EQ(std::count(o.out.begin(), o.out.end(), '\n'), 1) << o.out;
  for (const char* said :
       {"empty.post\" was left out: line 1, column 1: the first line is not",
        "huge.post\" was left out: it is larger than 4 MiB. A pack contains one template per "
        "construct;",
        "broken.post\" was left out: line 18, column 8: \"halt\" has no variable \"now\".",
        "dangling.post\" was left out: it does not lead to a readable file",
        "round.post\" was left out: it does not lead",
        "folder.post\" was left out: it is a folder without a file pack.post.",
        "pipe.post\" was left out: it is not a file", "is not in the pack's folder"})
    EXPECT_TRUE(has(o.err, said)) << said << "\n" << o.err;
}

// ---- robomosp post test ----

TEST(PostTest, ExitCodesTellWhatIsWrongFromWhatCouldNotBeTested) {
  const Folder a;
  const auto test = [](std::vector<std::string> words) {
    words.insert(words.begin(), {"-q", "post", "test"});
    return run(words);
  };
  const Outcome good = test({(kExamples / "tern_pack").string(), "--brief"});
  EXPECT_EQ(good.code, 0) << good.out << good.err;
  EXPECT_TRUE(has(good.out, "Tern TDL (tern)")) << good.out;
  EXPECT_TRUE(has(good.out, "LOST 0.")) << good.out;
  EXPECT_TRUE(has(good.out, "Nothing is wrong.")) << good.out;
  const Outcome whole = test({(kExamples / "tern_pack" / "pack.post").string()});
  EXPECT_GT(whole.out.size(), good.out.size());  // with what is said, too
  // The same as data.
  const Outcome data = run({"-q", "--json", "post", "test", (kExamples / "tern_pack").string()});
  EXPECT_EQ(data.code, 0);
  const Json one = Json::parse(data.out).at("value").at("targets").at(0);
  EXPECT_EQ(one.at("target"), "tern");
  EXPECT_EQ(one.at("counts").at("LOST"), 0);
  EXPECT_GE(one.at("constructs").size(), 300U);
  EXPECT_TRUE(one.at("wrong").empty());
#ifdef FAULTY_POSTS
  // A post that loses outputs, and one that is never the same.
  const Outcome lost = test({FAULTY_POSTS, "--brief"});
  EXPECT_EQ(lost.code, 1) << lost.out << lost.err;
  EXPECT_TRUE(has(lost.out, "wrong: \"grip := TRUE;\" is lost: the files are the same without it"))
      << lost.out;
  EXPECT_TRUE(has(lost.out, "gives different files the second time.")) << lost.out;
#endif
  // Nothing could be tested.
  fs::create_directory(a.path / "none");
  write(a.path / "broken.post", pack("broken", "== fly\n"));
  write(a.path / "text.txt", "hello\n");
  write(a.path / "no.so", "no library\n");
  const std::pair<std::string, const char*> kWrong[] = {
      {"kurl", "\"kurl\""},
      {(a.path / "none").string(), "has no pack of templates"},
      {(a.path / "broken.post").string(), "broken.post:17:4: error: there is no construct \"fly\""},
      {(a.path / "nobody.post").string(), "nobody.post"},
      {(a.path / "nobody.ctl").string(), "nobody.ctl"},
      {(a.path / "text.txt").string(), "is not a target that can be tested"},
      {(a.path / "no.so").string(), "no.so"}};
  for (const auto& [what, said] : kWrong) {
    const Outcome o = test({what});
    EXPECT_EQ(o.code, 3) << what << o.out << o.err;
    EXPECT_TRUE(has(o.err, said)) << what << "\n" << o.err;
  }
  EXPECT_EQ(test({"krl", "--robot", "nobody"}).code, 3);
  EXPECT_EQ(test({"krl", "--profile", "nobody"}).code, 3);
  EXPECT_EQ(test({"krl", "--program", (a.path / "nobody.irl").string()}).code, 3);
  EXPECT_EQ(test({}).code, 2);
  EXPECT_EQ(test({"krl", "--no-such"}).code, 2);
  EXPECT_TRUE(has(run({"post", "test", "--help"}).out, "Exit codes: 0 nothing is wrong"));
}

/// What the page shows is what the example writes.
TEST_F(PostCommand, ThePageShowsWhatThePackWrites) {
  const Outcome o = post({(kExamples / "tern_pack" / "lift.irl").string(), "--templates",
                          (kExamples / "tern_pack").string(), "--robot", "ur5"});
  ASSERT_EQ(o.code, 0) << o.err;
  const std::string page =
      slurp(fs::path(ROBOMOSP_SOURCE_DIR) / "docs" / "plugin_author" / "post_templates.md");
  EXPECT_TRUE(has(page, "```text\n" + o.out + "```\n")) << o.out;
}

TEST(PostTest, AReaderIsComparedWithWhatTheInterpreterDid) {
  if (std::system("python3 -c 'import sys' >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "there is no python3";
  const Folder a;
  const fs::path folder = a.path / "back";
  const auto test = [&](const std::string& what) {
    return run({"-q", "post", "test", what, "--brief", "--reader", folder.string()});
  };
  const Outcome made = test((kExamples / "tern_pack").string());
  ASSERT_EQ(made.code, 0) << made.out << made.err;
  EXPECT_TRUE(has(made.out, "Complete reader.py.")) << made.out;
  for (const char* file :
       {"compare.py", "reader.py", "robot.model", "programs/straight.trace.json"})
    EXPECT_TRUE(fs::is_regular_file(folder / file)) << file;
  EXPECT_TRUE(fs::is_regular_file(folder / "programs" / "straight" / "flat" / "straight.tdl"));
  // Every form that the target takes, and all of its files.
  for (const char* one : {"straight", "waits", "timeouts", "transitions", "texts", "rounds"})
    for (const char* form : {"flat", "structured"})
      EXPECT_TRUE(
          fs::is_regular_file(folder / "programs" / one / form / (std::string(one) + ".tdl")))
          << one << " " << form;
  const auto compare = [&](const std::string& programs = "") {
    const int status = std::system(("python3 '" + (folder / "compare.py").string() + "' " +
                                    programs + " >'" + (a.path / "said").string() + "' 2>&1")
                                       .c_str());
    return std::pair(WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(a.path / "said"));
  };
  const auto empty = compare();
  EXPECT_EQ(empty.first, 1);
  EXPECT_TRUE(has(empty.second, "fill in read()")) << empty.second;
  EXPECT_FALSE(has(empty.second, "Traceback")) << empty.second;
  // Filled in as the example is.
  const std::string reader = slurp(kExamples / "tern_pack" / "reader.py");
  write(folder / "reader.py", reader);
  const auto good = compare();
  EXPECT_EQ(good.first, 0) << good.second;
  EXPECT_TRUE(has(good.second, "straight, structured: 18 actions are equal")) << good.second;
  EXPECT_FALSE(has(good.second, "instead of")) << good.second;
  // Wrong ones, each by a sentence with the place.
  const auto spoilt = [&](const std::string& what, const std::string& by,
                          const std::string& programs = "straight") {
    std::string text = reader;
    const std::size_t begin = text.find(what);
    EXPECT_NE(begin, std::string::npos) << what;
    write(folder / "reader.py", text.replace(begin, what.size(), by));
    return compare(programs);
  };
  const std::pair<std::pair<std::string, std::string>, const char*> kSpoilt[] = {
      {{"1000 * n[0], 1000 * n[1]", "1000 * n[1], 1000 * n[0]"}, "of the IRL, lin): "},
      {{"quaternion(*n[3:])", "quaternion(n[4], n[3], n[5], n[6])"}, "turned by "},
      {{"1000 * float(speed), blend", "float(speed), blend"}, "speed 0."},
      {{"{\"= on\": 1, \"= off\": 0}[rest]", "0"}, "output 3 := 0 instead of 3 := 1"},
      {{"/ 1000)", ")"}, "250.0 s instead of 0.25 s"},
      {{"            yield wait(float", "            wait(float"},
       "lin was read, and wait is meant"},
      {{"import re", "import re, nothing_of_this_name"}, "reader.py cannot be used: "},
      {{"    run = Run(", "    return\n    run = Run("}, "0 actions were read, and"},
      {{"    run = Run(", "    return 5\n    run = Run("}, "0 actions were read, and"},
      {{"self.points[p] for", "self.points[p + \"x\"] for"}, "reader.py stopped: KeyError"},
      {{"yield output(", "yield (1, "}, "reader.py yields what is no action: "},
      {{"1000 * n[0], 1000", "\"here\", 1000"}, "reader.py stopped: ValueError"},
      {{"1000 * n[0], 1000", "float(\"nan\"), 1000"}, "mm from"}};
  for (const auto& [change, said] : kSpoilt) {
    const auto o = spoilt(change.first, change.second);
    EXPECT_EQ(o.first, 1) << change.second << "\n" << o.second;
    EXPECT_TRUE(has(o.second, said)) << change.second << "\n" << o.second;
    EXPECT_FALSE(has(o.second, "Traceback")) << change.second << "\n" << o.second;
  }
  // Conditions, the ends of waits, transitions and texts count.
  const struct {
    const char *what, *by, *programs, *said;
  } kLeftOut[] = {
      {"yield wait_for(self.python(condition),", "yield wait_for(None,", "waits",
       "the condition was not read, and ready is meant"},
      {"yield wait_for(self.python(condition),",
       "yield wait_for('not (' + self.python(condition) + ')',", "waits",
       "instead of ready: they differ at input 1 = 0"},
      {"yield wait_for(self.python(condition),", "yield wait_for('i[3]',", "waits",
       "input 3 is asked, and is not in the condition that is meant: ready"},
      {"yield wait_for(self.python(condition),", "yield wait_for('i[1',", "waits",
       "the condition 'i[1' cannot be computed: SyntaxError"},
      {"float(re.fullmatch(r\"(\\S+) s\", time).group(1)) if time else None)", "None)", "timeouts",
       "it ends after no time instead of 2.5 s"},
      {"self.motion(one, 0 if not blend else", "self.motion(one, 0 if True else", "transitions",
       "transition 0 instead of 12.5"},
      {"1 if blend.group(2) == \"%\" else 1000", "2", "transitions", "instead of 12.5"},
      {".replace('\"\"', '\"'))", ".upper())", "texts", "'PART 1 IS THERE' instead of"},
      {"yield pause() if", "yield halt() if", "texts", "halt was read, and pause is meant"}};
  for (const auto& one : kLeftOut) {
    const auto o = spoilt(one.what, one.by, one.programs);
    EXPECT_EQ(o.first, 1) << one.by << "\n" << o.second;
    EXPECT_TRUE(has(o.second, one.said)) << one.by << "\n" << o.second;
  }
  // A form may be left out.
  write(folder / "reader.py", reader);
  EXPECT_FALSE(has(compare("--flat rounds").second, "structured"));
  EXPECT_TRUE(has(compare("--structured rounds").second, "rounds, structured: 28 actions"))
      << compare("--structured rounds").second;
  EXPECT_EQ(compare("nobody").first, 1);
  // What was filled in stays.
  write(folder / "reader.py", reader);
  const Outcome again = test((kExamples / "tern_pack").string());
  EXPECT_TRUE(has(again.out, "reader.py is kept unchanged.")) << again.out;
  EXPECT_EQ(slurp(folder / "reader.py"), reader);
  EXPECT_EQ(compare().first, 0);
  // Damaged files are not equal: a digit, a line, a word of a condition of each construct.
  const int status =
      std::system(("python3 '" ROBOMOSP_SOURCE_DIR "/tests/shell/damaged_files.py' '" +
                   folder.string() + "' >'" + (a.path / "said").string() + "' 2>&1")
                      .c_str());
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0) << slurp(a.path / "said");
  // A folder that cannot be made, or is none.
  EXPECT_EQ(run({"-q", "post", "test", "krl", "--brief", "--reader", "/proc/self/back"}).code, 3);
  EXPECT_EQ(
      run({"-q", "post", "test", "krl", "--brief", "--reader", (a.path / "said").string()}).code,
      3);
}

}  // namespace
