// SPDX-License-Identifier: Apache-2.0
#include "kernel/fault.h"

#include <algorithm>
#include <regex>

#include <gtest/gtest.h>

#include "kernel/argument_faults.h"
#include "kernel/message_collector.h"
#include "kernel/schema.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

Fault full_fault() {
  Fault f = make_fault("argument.out_of_range", "2 m is out of range", "Give less.", "gap");
  f.severity = Severity::warning;
  f.subject = {.record = {"robot", 7},
               .name = "arm",
               .path = "links.2.a",
               .command = "robot.set_link",
               .argument = "a",
               .provider = "ik_dls",
               .interface_id = "robomosp.ik/1",
               .file = "main.irl",
               .line = 3,
               .column = 5,
               .end_line = 3,
               .end_column = 9};
  f.extent = {.first = 4,
              .last = 9,
              .worst = 6,
              .from = 0.25,
              .to = 0.5,
              .at = 0.3,
              .segment = 2,
              .step = 3,
              .motion = 8};
  f.witness.scene = {"world", 2};
  f.witness.robot = "left";
  f.witness.q = {0.1, -0.2, 1e-17};
  f.witness.joints = {{.name = "elbow", .number = 2, .value = 2.5, .limit = 2, .unit = "rad"}};
  f.witness.bodies = {"left.elbow", "table"};
  f.witness.points = {{"touch", 0.1, 0.2, 0.3}};
  f.witness.value = 2;
  f.witness.limit = 1.5;
  f.witness.excess = 0.5;
  f.witness.unit = "m";
  f.cause = std::make_shared<const Fault>(make_fault("error.io", "the disk is full"));
  f.remedies = {{.label = "Set gap to 1.5 m",
                 .command = "robot.set_link",
                 .args = {{"a", 1.5}},
                 .repeats = true,
                 .without = {"b"},
                 .is_tried = true,
                 .untried = "It simulates."}};
  return f;
}

TEST(Fault, IsTheSameAfterItsMap) {
  const Fault f = full_fault();
  const auto back = fault_from(Value(fault_map(f)));
  ASSERT_TRUE(back);
  EXPECT_TRUE(*back == f);
  Fault other = f;
  other.remedies[0].is_tried = false;
  EXPECT_FALSE(*back == other);
  Fault without = f;
  without.cause = nullptr;
  EXPECT_FALSE(*back == without);
}

TEST(Fault, AMapOfAPeerIsReadWithoutTrust) {
  EXPECT_FALSE(fault_from(Value(3)));
  EXPECT_FALSE(fault_from(Value(Map{{"code", "x"}})));
  const auto f = fault_from(Value(Map{{"code", "x.y"},
                                      {"message", "m"},
                                      {"class", "no class"},
                                      {"subject", 5},
                                      {"extent", Map{{"first", -3}, {"at", "soon"}, {"last", 4.0}}},
                                      {"witness", Map{{"points", List{Value(Map{})}}}},
                                      {"remedies", Map{}}}));
  ASSERT_TRUE(f);
  EXPECT_EQ(f->error, ErrorCode::invalid_argument);
  EXPECT_EQ(f->extent.first, 0U);
  EXPECT_EQ(f->extent.last, 4U);
  EXPECT_FALSE(f->extent.at);
  EXPECT_TRUE(f->witness.points.empty());
  Value deep(Map{{"code", "x.y"}, {"message", "m"}});
  for (int i = 0; i < 50; ++i)
    deep = Value(Map{{"code", "x.y"}, {"message", "m"}, {"cause", deep}});
  int depth = 0;
  const auto bounded = fault_from(deep);
  for (const Fault* at = &*bounded; at; at = at->cause.get()) ++depth;
  EXPECT_LT(depth, 20);
}

TEST(Fault, AnErrorWithoutFaultsIsOneFaultOfItsText) {
  const Error e = error(ErrorCode::io, "the disk is full", "Free some space.", "file \"a\"");
  const auto all = faults_of(e);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].code, "error.io");
  EXPECT_EQ(all[0].error, ErrorCode::io);
  EXPECT_EQ(sentence(all[0]), e.sentence());
}

TEST(Fault, OuterContextComesBeforeEachFault) {
  Error one = error_of(make_fault("error.usage", "no", {}, "b")).in("a");
  EXPECT_EQ(one.sentence(), "a, b: no.");
  EXPECT_EQ(sentence(faults_of(one).at(0)), "a, b: no.");
  Error two = error_of(std::vector{make_fault("error.usage", "no", {}, "b"),
                                   make_fault("error.usage", "never")})
                  .in("a");
  EXPECT_EQ(two.sentence(), "a: b: no. never.");
  EXPECT_EQ(sentence(faults_of(two).at(0)), "a, b: no.");
  EXPECT_EQ(sentence(faults_of(two).at(1)), "a: never.");
}

TEST(Fault, FaultsThatAreGivenToAnErrorKeepTheirPlaces) {
  Error e = error(ErrorCode::syntax, "first", {}, "program \"p\", p.irl:1:1");
  List list;
  for (const char* place : {"program \"p\", p.irl:1:1", "program \"p\", p.irl:2:1"})
    list.emplace_back(fault_map(make_fault("error.syntax", "first", {}, place)));
  adopt_faults(e, Value(list));
  EXPECT_EQ(faults_of(e).at(1).where, "program \"p\", p.irl:2:1");
  amend(e, [](Fault& f) { f.subject.command = "program.run"; });
  e = std::move(e).in("program.run");
  EXPECT_EQ(faults_of(e).at(0).where, "program.run, program \"p\", p.irl:1:1");
  EXPECT_EQ(faults_of(e).at(1).where, "program.run, program \"p\", p.irl:2:1");
  EXPECT_EQ(faults_of(e).at(1).subject.command, "program.run");
  EXPECT_EQ(e.sentence(), "program.run, program \"p\", p.irl:1:1: first.");
}

TEST(Fault, TextsAreEditedEverywhere) {
  Fault f = full_fault();
  f.message = "secret/a";
  f.subject.file = "secret/b";
  f.cause = std::make_shared<const Fault>(make_fault("error.io", "secret/c"));
  f.remedies[0].args.set("file", "secret/d");
  Error e = error_of(f);
  edit_texts(e, [](std::string s) {
    for (std::size_t at = 0; (at = s.find("secret")) != std::string::npos;) s.replace(at, 6, "*");
    return s;
  });
  EXPECT_EQ(Value(fault_list(e)).text().find("secret"), std::string::npos);
  EXPECT_EQ(kept_faults(e)->at(0).cause->message, "*/c");
}

TEST(Fault, CodesAreWordsOfARoomAndAFaultWithASentence) {
  const auto codes = fault_codes();
  ASSERT_GT(codes.size(), 20U);
  for (const FaultCode& c : codes) {
    EXPECT_TRUE(std::regex_match(c.code, std::regex("[a-z]+\\.[a-z_]+"))) << c.code;
    EXPECT_TRUE(std::string(c.doc).ends_with(".")) << c.code;
    EXPECT_EQ(find_fault_code(c.code)->doc, c.doc);
  }
  EXPECT_EQ(find_fault_code("nothing.like_it"), nullptr);
  for (auto c = 1; c <= static_cast<int>(ErrorCode::script_failed); ++c)
    EXPECT_TRUE(find_fault_code("error." + std::string(to_string(static_cast<ErrorCode>(c)))));
}

TEST(Fault, AMessageCarriesItsFault) {
  Messages messages;
  const Fault f = full_fault();
  messages.post(f, "test");
  messages.post(Severity::info, "plain", "text");
  const auto recent = messages.recent();
  ASSERT_EQ(recent.size(), 2U);
  EXPECT_EQ(recent[0].severity, Severity::warning);
  EXPECT_EQ(recent[0].code, f.code);
  EXPECT_EQ(recent[0].text, sentence(f));
  ASSERT_TRUE(recent[0].fault);
  EXPECT_TRUE(*recent[0].fault == f);
  EXPECT_FALSE(recent[1].fault);
}

ParamSpec typed_param(const char* name, const char* type, const char* unit = "") {
  ParamSpec p;
  p.name = name;
  p.type = type;
  p.unit = unit;
  return p;
}

Schema schema_of_a_weld() {
  Schema s{typed_param("gap", "real", "m"), typed_param("count", "int"),
           typed_param("mode", "enum"),     typed_param("axis", "vec3", "m"),
           typed_param("at", "pose"),       typed_param("q", "real[]", "rad"),
           typed_param("grid", "matrix"),   typed_param("robot", "ref:robot"),
           typed_param("note", "string"),   typed_param("size", "vec(2)", "m")};
  s[0].min = 0.001;
  s[0].max = 0.0149;
  s[1].min = 1;
  s[1].max = 8;
  s[2].choices = {"pulse", "spray"};
  s[5].min = -3;
  s[5].max = 3;
  s[8].required = true;
  return s;
}

const ResolveRef kNobody = [](std::string_view, const Value& v) -> Result<Handle> {
  return error(ErrorCode::unknown_name, "there is no robot " + v.text());
};

TEST(ArgumentFaults, EachComesSeparatelyWithItsArgument) {
  const Map given{{"gap", "20 mm"},
                  {"count", 9},
                  {"mode", "sprey"},
                  {"axis", NumericArray({1, 2})},
                  {"at", Map{{"positon", NumericArray({1, 2, 3})}}},
                  {"q", NumericArray({0, 4, 0})},
                  {"grid", List{Value(NumericArray({1, 2})), Value(NumericArray({1}))}},
                  {"robot", "arm"},
                  {"size", NumericArray({1, 2, 3})},
                  {"gapp", 3}};
  const auto checked = check(schema_of_a_weld(), given, kNobody);
  ASSERT_FALSE(checked.ok());
  std::vector<std::pair<std::string, std::string>> found;
  for (const Fault& f : faults_of(checked.error())) {
    found.emplace_back(f.subject.argument, f.code);
    EXPECT_NE(checked.error().sentence().find(f.message), std::string::npos) << f.message;
  }
  const std::vector<std::pair<std::string, std::string>> expected{
      {"gapp", "argument.unknown"},         {"gap", "argument.out_of_range"},
      {"count", "argument.out_of_range"},   {"mode", "argument.not_a_choice"},
      {"axis", "argument.wrong_count"},     {"at", "argument.malformed"},
      {"q[2]", "argument.out_of_range"},    {"grid[2]", "argument.wrong_count"},
      {"robot", "argument.unknown_record"}, {"note", "argument.missing"},
      {"size", "argument.wrong_count"}};
  EXPECT_EQ(found, expected);
}

TEST(ArgumentFaults, WrongTypesAndUnitsHaveTheirCodes) {
  const Map given{{"gap", "3 kg"}, {"count", 1.5}, {"q", "many"}, {"robot", 3}, {"note", 4}};
  const auto checked = check(schema_of_a_weld(), given, kNobody);
  ASSERT_FALSE(checked.ok());
  std::vector<std::pair<std::string, std::string>> found;
  for (const Fault& f : faults_of(checked.error())) found.emplace_back(f.subject.argument, f.code);
  const std::vector<std::pair<std::string, std::string>> expected{{"gap", "argument.wrong_unit"},
                                                                  {"count", "argument.wrong_type"},
                                                                  {"q[1]", "argument.wrong_type"},
                                                                  {"robot", "argument.wrong_type"},
                                                                  {"note", "argument.wrong_type"}};
  EXPECT_EQ(found, expected);
}

TEST(ArgumentFaults, EachRemedyRemovesItsFault) {
  const Schema schema = schema_of_a_weld();
  const Map given{{"gap", "20 mm"}, {"count", 0},      {"mode", "sprey"}, {"q", List{0, 4, -5}},
                  {"nte", "hello"}, {"note", Value()}, {"robot", "arm"}};
  Map cleaned = given;
  cleaned.erase("note");
  const auto checked = check(schema, cleaned, kNobody);
  ASSERT_FALSE(checked.ok());
  std::vector<std::string> labels;
  for (const Fault& f : faults_of(checked.error()))
    for (const FaultRemedy& r : f.remedies) {
      labels.push_back(r.label);
      EXPECT_TRUE(r.is_tried);
      ASSERT_TRUE(r.repeats);
      const auto again = check(schema, repeated(r, cleaned), kNobody);
      if (again.ok()) continue;
      for (const Fault& left : faults_of(again.error()))
        EXPECT_FALSE(left.code == f.code && left.subject.argument == f.subject.argument) << r.label;
    }
  const std::vector<std::string> expected{"Rename nte to note", "Set gap to 14.9 mm",
                                          "Set count to 1", "Set mode to \"spray\"",
                                          "Set q[2] to 3 rad"};
  EXPECT_EQ(labels, expected);
}

TEST(ArgumentFaults, NothingIsOfferedThatWouldFailOtherwise) {
  Schema schema = schema_of_a_weld();
  schema[0].min = kPositive;
  // No least number above 0, no name that the value fits, no word that is near.
  const Map given{{"gap", -1}, {"cont", "many"}, {"mode", "laser"}, {"note", "n"}};
  const auto checked = check(schema, given);
  ASSERT_FALSE(checked.ok());
  EXPECT_EQ(faults_of(checked.error()).size(), 3U);
  for (const Fault& f : faults_of(checked.error())) EXPECT_TRUE(f.remedies.empty()) << f.message;
}

}  // namespace
}  // namespace robomosp
