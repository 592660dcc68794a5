// SPDX-License-Identifier: Apache-2.0
// The language of types: parsing, text, conditions, literals, what fits, JSON Schema, forms.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "kernel/condition.h"
#include "kernel/literal.h"
#include "kernel/schema.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"

namespace robomosp {
namespace {

using namespace std::string_literals;

std::string step_type() {
  return "variant(step){move: {robot?: member:robot of world; speed?: real @above(0) @max(1); "
         "pose?: string @when(target is absent); target?: pose @when(pose is absent)}; "
         "repeat: {count: int @min(0); steps: list<type:kernel_type_test.step>}}";
}
const NamedType kStep("kernel_type_test.step", "map", step_type);

// Every form of the language.
const std::vector<std::string> kTypes = {
    "any",
    "nil",
    "bool",
    "int",
    "real",
    "string",
    "enum",
    "path",
    "colour",
    "real[]",
    "vec3",
    "pose",
    "matrix",
    "list",
    "map",
    "handle",
    "array",
    "ref:robot",
    "ref:solid|object",
    "ref:any",
    "real [m]",
    "real [rad|m]",
    "vec(4)",
    "vec(radius, angle, z) [m, rad, m]",
    "matrix(4, 4)",
    "matrix(, 2)",
    "path(open: *.csv *.npz)",
    "path(save)",
    "path(folder)",
    "enum(dh: Standard rows. | mdh: Rows of Craig.)",
    "list<real [m]>",
    "list<list<int>>",
    "map<real>",
    "map{name: string; mass?: real [kg] @min(0) \"Of the part.\"; at: vec3 = {0, 0, 1}}",
    "table{name: string; value: real = 0.5 \"A \\\"quoted\\\" word.\"}",
    "variant(kind){box: {x: real [m]}; ball: {radius: real [m] @above(0)}}",
    "real or string",
    "enum(dh: Standard rows. | mdh \"Modified rows\": Craig's rows. | none \"No rows\")",
    "member:link of id or int",
    "member:link",
    "provider:ik",
    "provider:curve|segment|joint_segment",
    "provider:planner(name)",
    "joints",
    "joints(velocity) of robot",
    "expression",
    "any<ref:recording>",
    "any<joints of id or member:pose of id> @advanced",
    "map<real>{name: string; rest?: map<int>{a: int}}",
    "script:lua",
    "type:kernel_type_test.step",
    "real [m] @group(Size) @order(2) @advanced @step(0.01) @log @shown(mm) @since(1.6)",
    "real @label(Damping) @when(mode is pid and (gain is present or not fast is true))",
    "list<vec3> @example({{0, 0, 1}}) @deprecated(Give points.) @effect(Moves the line.)",
};

TEST(TypeTree, EveryFormSurvivesItsOwnText) {
  for (const std::string& text : kTypes) {
    const auto first = parse_type(text);
    ASSERT_TRUE(first.ok()) << text << ": " << first.error().sentence();
    const std::string printed = type_text(**first);
    const auto second = parse_type(printed);
    ASSERT_TRUE(second.ok()) << printed << ": " << second.error().sentence();
    EXPECT_EQ(type_text(**second), printed) << text;
    EXPECT_EQ(type_value(**first), type_value(**second)) << text;
    EXPECT_EQ((*first)->kind, (*second)->kind) << text;
    EXPECT_EQ(type_fault(text), "") << text;
    EXPECT_FALSE(type_words(**first).empty()) << text;
  }
}

TEST(TypeTree, BackslashesWithinQuotedTextsEndNothing) {
  for (const char* text : {"string @example(\"a\\\\\")", "string @example(\"a\\\")b\")"}) {
    const auto parsed = parse_type(text);
    ASSERT_TRUE(parsed.ok()) << text << ": " << parsed.error().sentence();
    EXPECT_EQ(type_text(**parsed), text);
  }
  EXPECT_FALSE(parse_type("string @example(\"a\\").ok());
}

TEST(TypeTree, PlainTypesOfOldStayWhatTheyWere) {
  for (const char* word : {"bool", "int", "real", "string", "enum", "path", "real[]", "vec3",
                           "pose", "matrix", "list", "map", "any", "ref:robot", "ref:solid|object"})
    EXPECT_EQ(plain_type(word), word);
  const std::pair<const char*, const char*> kPlain[] = {
      {"real [m] @step(0.1)", "real"},
      {"ref:robot @advanced", "ref:robot"},
      {"vec(4)", "real[]"},
      {"vec(a, b, c)", "vec3"},
      {"colour", "any"},
      {"list<int>", "list"},
      {"table{a: int}", "list"},
      {"map{a: int}", "map"},
      {"variant(a){b: {}}", "map"},
      {"member:link of id", "string"},
      {"member:link of id or int", "any"},
      {"string or member:tip", "string"},
      {"provider:ik", "any"},
      {"provider:ik(name)", "string"},
      {"joints of id", "any"},
      {"script:lua", "string"},
      {"expression", "any"},
      {"type:kernel_type_test.step", "map"},
      {"ref:robot or ref:robot", "any"},
      {"enum(a|b)", "enum"},
      {"any<ref:robot>", "any"},
      {"any<real [m]>", "any"},
      {"map<real>{a: int}", "map"},
  };
  for (const auto& [text, plain] : kPlain) EXPECT_EQ(plain_type(text), plain) << text;
}

TEST(TypeTree, AMalformedTypeNamesThePlace) {
  const std::pair<const char*, const char*> kWrong[] = {
      {"", "a type is missing at character 1 of the type \"\""},
      {"float", "\"float\" is not a type at character 1 of the type \"float\""},
      {"list<float>", "\"float\" is not a type at character 6 of the type \"list<float>\""},
      {"list<int", "a bracket > is missing at character 9 of the type \"list<int\""},
      {"ref:", "a word is missing behind the colon at character 5 of the type \"ref:\""},
      {"ref", "a colon is missing at character 4 of the type \"ref\""},
      {"real [parsec]", nullptr},
      {"vec(0)",
       "a vector has a count or names of components at character 7 of the type "
       "\"vec(0)\""},
      {"map{a: int; a: int}",
       "\"a\" is given twice at character 14 of the type "
       "\"map{a: int; a: int}\""},
      {"map{a int}", "a colon is missing at character 7 of the type \"map{a int}\""},
      {"enum(a | a)", "\"a\" is twice in the enum at character 12 of the type \"enum(a | a)\""},
      {"real @step(x)", nullptr},
      {"real @colour(x)", nullptr},
      {"real @when(step move)", nullptr},
      {"real @example({1)", nullptr},
      {"real real", "unexpected text at character 6 of the type \"real real\""},
      {"path(read)", nullptr},
      {"joints(torque)", nullptr},
      {"variant(a)", nullptr},
      {"real (", "unexpected text at character 6 of the type \"real (\""},
      {"real @when(a is b", nullptr},
  };
  for (const auto& [text, message] : kWrong) {
    const auto parsed = parse_type(text);
    ASSERT_FALSE(parsed.ok()) << text;
    if (message) {
      EXPECT_EQ(parsed.error().message, message) << text;
    }
    EXPECT_FALSE(type_fault(text).empty()) << text;
  }
  EXPECT_FALSE(parse_type(std::string(100'000, '<')).ok());
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "list<";
  EXPECT_FALSE(parse_type(deep).ok());
}

TEST(TypeTree, FaultsWithinATypeAreFound) {
  EXPECT_EQ(type_fault("list<type:no_such_type>"), "there is no type of the name \"no_such_type\"");
  EXPECT_EQ(type_fault("map{a: int; b: int @when(c is 1)}"),
            "b: its condition names \"c\", which is no field beside it");
  EXPECT_EQ(type_fault("map{a: enum(x|y); b: int @when(a is z)}"),
            "b: its condition compares a with \"z\", which it cannot be");
  EXPECT_EQ(type_fault("real [m] @shown(deg)"), "it is shown in \"deg\", which is not \"m\"");
  EXPECT_EQ(type_fault("list<int> @example({\"a\"})"),
            "its example does not fit: [1]: \"a\" is not an integer");
}

TEST(TypeTree, NamedTypesHaveThePlainTypeThatTheySay) {
  for (const std::string& name : named_types())
    EXPECT_EQ(plain_type("type:" + name), plain_type(type_text(*named_type(name)))) << name;
}

TEST(TypeTree, OneTextIsOneTreeInAllThreads) {
  std::vector<const TypeTree*> seen(8);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < seen.size(); ++i)
    threads.emplace_back([&seen, i] { seen[i] = &type_tree("list<map{thread: int}>"); });
  for (std::thread& t : threads) t.join();
  for (const TypeTree* t : seen) EXPECT_EQ(t, seen[0]);
}

TEST(Condition, HoldsAsItReads) {
  const Map move{{"step", "move"}, {"pose", ""}, {"speed", 0.5}, {"fast", true}, {"n", 3}};
  const std::pair<const char*, bool> kCases[] = {
      {"step is move", true},
      {"step is wait, move", true},
      {"step is not move", false},
      {"step is wait", false},
      {"pose is absent", true},  // an empty text is none
      {"pose is present", false},
      {"target is absent", true},
      {"target is x", false},
      {"target is not x", true},
      {"speed is 0.5", true},
      {"speed is 0.50", true},
      {"fast is true", true},
      {"not fast is true", false},
      {"n is 3", true},
      {"step is wait or step is move and pose is present", false},
      {"(step is wait or step is move) and pose is absent", true},
      {"not (step is wait or pose is present)", true},
  };
  for (const auto& [text, expected] : kCases) {
    const auto c = Condition::parse(text);
    ASSERT_TRUE(c.ok()) << text << ": " << c.error().sentence();
    EXPECT_EQ(c->holds(move), expected) << text;
    EXPECT_EQ(c->text(), text);
  }
  EXPECT_TRUE(Condition().holds(move));
  for (const char* bad : {"step", "step is", "is move", "step is move and", "(step is move",
                          "step is move)", "step == move", "step is a,", "not"})
    EXPECT_FALSE(Condition::parse(bad).ok()) << bad;
  EXPECT_FALSE(Condition::parse(std::string(100'000, '(')).ok());
}

TEST(Literal, ReadsWhatItWrites) {
  for (const char* text :
       {"nil", "true", "12", "0.5", "-3", "1e-300", "inf", "\"a \\\"b\\\" \\\\ c\"", "{}",
        "{1, 2, \"30 mm\"}", "{a = 1, b = {c = {}}}", "{[\"two words\"] = 1}", "nan",
        "{[\"\"] = 1}", "{{1, 0}, {0, 1}}"}) {
    const auto v = read_literal(text);
    ASSERT_TRUE(v.ok()) << text << ": " << v.error().sentence();
    EXPECT_EQ(literal(*v), text);
  }
  EXPECT_EQ(literal(Value(NumericArray({1, 2, 3, 4}, 2, 2))), "{{1, 2}, {3, 4}}");
  EXPECT_EQ(literal(Value(Handle{"robot", 7})), "\"robot#7\"");
  for (const char* bad : {"", "{", "{1", "{a = }", "{a = 1, 2}", "{a = 1, a = 2}", "\"a", "word",
                          "1 2", "{[a] = 1}", "--"})
    EXPECT_FALSE(read_literal(bad).ok()) << bad;
  EXPECT_FALSE(read_literal(std::string(100'000, '{')).ok());
}

TEST(Misfit, NamesThePart) {
  struct Case {
    const char* type;
    const char* value;
    const char* fault;  ///< "" = it fits
  };
  const Case kCases[] = {
      {"int", "3", ""},
      {"int", "3.5", "3.5 is not an integer"},
      {"real [m]", "\"3 mm\"", ""},
      {"real [m]", "true", "true is not a real in m"},
      {"vec(2)", "{1, 2}", ""},
      {"vec(2)", "{1, 2, 3}", "3 numbers are given; 2 are needed"},
      {"list<int>", "{1, \"x\"}", "[2]: \"x\" is not an integer"},
      {"list<int>", "{}", ""},
      {"map<real>", "{a = 1, b = {}}", "b: {} is not a real"},
      {"map{a: int; b?: real}", "{a = 1}", ""},
      {"map{a: int; b?: real}", "{b = 1}", "a: no value is given; an integer is required"},
      {"map{a: int; b?: real}", "{a = 1, c = 1}", "\"c\" is not a parameter"},
      {"map<real>{a: string}", "{a = \"x\", b = 1}", ""},
      {"map<real>{a: string}", "{a = \"x\", b = {}}", "b: {} is not a real"},
      {"table{a: int}", "{{a = 1}, {a = \"x\"}}", "[2].a: \"x\" is not an integer"},
      {"colour", "\"#c0c0c0\"", ""},
      {"colour", "{1, 0, 0}", ""},
      {"colour", "\"red\"", "\"red\" is not a colour"},
      {"pose", "{position = {0, 0, 1}, rpy = {0, 0, 0}}", ""},
      {"pose", "{place = {0, 0, 1}}", "\"place\" is not a field of a pose"},
      {"provider:ik", "\"numeric\"", ""},
      {"provider:ik", "{name = \"numeric\", params = {damping = 0.1}}", ""},
      {"provider:ik", "{nam = 1}", "\"nam\" is not a parameter"},
      {"joints of id", "{0, \"90 deg\", 0.1}", ""},
      {"joints of id", "{{0, 1}, {2, 3}}", ""},
      {"int or string", "\"x\"", ""},
      {"int or string", "{}", "{} is not int or string"},
      {"type:kernel_type_test.step",
       "{step = \"repeat\", count = 2, steps = {{step = \"move\", speed = 0.5}}}", ""},
      {"type:kernel_type_test.step", "{step = \"repeat\", count = 2, steps = {{step = \"jump\"}}}",
       "steps[1].step: \"jump\" is not one of the choices"},
      {"type:kernel_type_test.step", "{speed = 1}",
       "step: no value is given; one of the choices is required"},
  };
  for (const Case& c : kCases) {
    const auto v = read_literal(c.value);
    ASSERT_TRUE(v.ok()) << c.value;
    EXPECT_EQ(misfit(type_tree(c.type), *v, ""), c.fault) << c.type << " " << c.value;
  }
}

ParamSpec param(std::string name, std::string type, std::string doc, bool required = false) {
  ParamSpec p;
  p.name = std::move(name);
  p.type = std::move(type);
  p.doc = std::move(doc);
  p.required = required;
  return p;
}

TEST(Check, ReadsTypesWithDetails) {
  Schema s{param("speed", "real [m/s] @above(0) @step(0.01)", "How fast."),
           param("mode", "enum(fast: Quick. | slow: Careful.)", "How."),
           param("centre", "vec(2) [m]", "Where."), param("links", "list<int>", "Which."),
           param("turn", "vec(4)", "Its plain type is as long.")};
  const auto checked = check(s, Map{{"speed", "100 mm/s"},
                                    {"mode", "slow"},
                                    {"centre", List{"10 mm", 2.0}},
                                    {"links", List{1, 2}}});
  ASSERT_TRUE(checked.ok()) << checked.error().sentence();
  EXPECT_EQ(checked->find("speed")->number(), 0.1);
  EXPECT_EQ((*checked->find("centre")->as_array())[0], 0.01);
  EXPECT_EQ(check(s, Map{{"mode", "quick"}}).error().message,
            "\"quick\" is not one of the choices");
  EXPECT_EQ(check(s, Map{{"centre", List{1, 2, 3}}}).error().message,
            "3 numbers are given; 2 are needed");
  EXPECT_FALSE(check(s, Map{{"links", 3}}).ok());
  EXPECT_EQ(check(s, Map{{"turn", List{1, 0, 0}}}).error().message,
            "3 numbers are given; 4 are needed");
}

TEST(Check, ATableOfAPluginMaySpeakTheWholeLanguage) {
  const rmp_param rows[] = {
      {"gain", "real [N m/rad] @above(0) @log @group(Control) @when(mode is pid)", "", "Stiffness.",
       "10", nullptr, 1, 0},
      {"mode", "enum(pid: Three terms. | lead: A lead filter.)", "", "Law.", "pid", nullptr, 1, 0},
      {"weights", "vec(3)", "", "Of the axes.", "{1, 1, 1}", nullptr, 1, 0},
  };
  const auto schema = schema_from(rows);
  ASSERT_TRUE(schema.ok()) << schema.error().sentence();
  EXPECT_EQ((*schema)[0].unit, "N m/rad");
  EXPECT_EQ((*schema)[0].min, kPositive);
  EXPECT_EQ(notes_of((*schema)[0]).group, "Control");
  EXPECT_EQ((*schema)[1].choices, (std::vector<std::string>{"pid", "lead"}));
  EXPECT_TRUE(check(*schema, Map{{"gain", 3}}).ok());
  EXPECT_FALSE(check(*schema, Map{{"gain", 0}}).ok());
  const rmp_param wrong[] = {{"a", "list<float>", "", "A.", "x", nullptr, 1, 0}};
  EXPECT_EQ(schema_from(wrong).error().message,
            "parameter \"a\" has the unknown type \"list<float>\": \"float\" is not a type at "
            "character 6 of the type \"list<float>\"");
  const rmp_param elsewhere[] = {{"a", "real @when(b is 1)", "", "A.", "1", nullptr, 1, 0}};
  EXPECT_EQ(schema_from(elsewhere).error().message,
            "parameter a: its condition names \"b\", which is no field beside it");
}

TEST(ParamValue, DropsNothing) {
  ParamSpec p = param("gain",
                      "real @log @step(0.1) @group(Control) @order(2) @advanced "
                      "@when(mode is pid) @example(0.5) @since(1.6) @effect(Stiffer.) "
                      "@deprecated(Give k.) @shown(deg)",
                      "Stiffness.");
  p.unit = "rad";
  p.label = "Gain";
  p.min = 0;
  p.max = 5;
  p.infinite = true;
  p.default_value = Value(1.0);
  const Map m = param_value(p);
  for (const char* name :
       {"name",    "type",     "declared",   "unit",     "doc",         "required",
        "default", "min",      "max",        "infinite", "label",       "group",
        "order",   "advanced", "when",       "step",     "logarithmic", "shown_unit",
        "example", "since",    "deprecated", "effect"})
    EXPECT_NE(m.find(name), nullptr) << name;
  EXPECT_EQ(*m.find("type"), Value("real"));
}

TEST(TypeTree, AnOwnerIsNamedOnlyIfTheTypeNamesIt) {
  const auto words = [](const char* text) { return type_words(type_tree(text)); };
  EXPECT_EQ(words("member:link of id"), "name of a link of `id`");
  EXPECT_EQ(words("list<member:kind>"), "list of name of a kind");
  EXPECT_EQ(words("joints(velocity) of robot"), "joint velocity of `robot`");
  EXPECT_EQ(words("map<joints>"), "map of joint values");
  EXPECT_EQ(literal(type_value(type_tree("member:command"))),
            "{kind = \"member\", member = \"command\"}");
  EXPECT_EQ(literal(type_value(type_tree("member:link of id"))),
            "{kind = \"member\", member = \"link\", of = \"id\"}");
}

TEST(Words, HaveLabelsOfTheDeclarationOrMadeOfThem) {
  const auto label = [](const char* word) { return word_label({word}); };
  EXPECT_EQ(label("best_effort"), "Best effort");
  EXPECT_EQ(label("s_curve"), "S curve");
  EXPECT_EQ(label("mdh"), "MDH");
  EXPECT_EQ(label("ap203"), "AP203");
  EXPECT_EQ(label("dh_rows"), "DH rows");
  EXPECT_EQ(label("OType"), "OType");
  EXPECT_EQ(label("-x"), "-x");
  EXPECT_EQ(label("mm"), "mm");
  EXPECT_EQ(word_label({"krl", "", "KUKA"}), "KUKA");
  const char* type = "enum(none | mdh \"Modified rows\": Craig's rows.)";
  const auto words = words_of(param("rows", type, ""));
  ASSERT_EQ(words.size(), 2U);
  EXPECT_EQ(words[1].word, "mdh");
  EXPECT_EQ(words[1].label, "Modified rows");
  EXPECT_EQ(words[1].doc, "Craig's rows.");
  const std::string as_data =
      "{{word = \"none\", label = \"None\"}, {word = \"mdh\", label = \"Modified rows\", doc = "
      "\"Craig's rows.\"}}";
  const Map described = param_value(param("rows", type, ""));
  EXPECT_EQ(literal(*described.find("words")), as_data);
  EXPECT_EQ(literal(*described.find("form")->as_map()->find("choices")), as_data);
  // A front end that gets the description has the same labels.
  const auto again = param_from(Value(described));
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(word_label(words_of(*again)[1]), "Modified rows");
  // Words of the parameter have labels, too.
  ParamSpec p = param("law", "enum", "");
  p.choices = {"s_curve"};
  EXPECT_EQ(literal(*param_value(p).find("words")), "{{word = \"s_curve\", label = \"S curve\"}}");
  EXPECT_FALSE(parse_type("enum(a \"A: x. | b)").ok());
  EXPECT_FALSE(parse_type("enum(a \"\" | b)").ok());
}

TEST(JsonSchema, AnnotatesWords) {
  const Map m = json_schema({param("rows", "enum(none | mdh: Craig's rows.)", "Which.")}, "t", "");
  EXPECT_EQ(literal(*m.find("properties")->as_map()->find("rows")),
            "{enum = {\"none\", \"mdh\"}, oneOf = {{const = \"none\", title = \"None\"}, {const = "
            "\"mdh\", title = \"MDH\", "
            "description = \"Craig's rows.\"}}, description = \"Which.\"}");
}

TEST(JsonSchema, SaysWhatItCan) {
  Schema s{param("id", "ref:robot", "The robot.", true), param("tip", "member:tip of id", "Where."),
           param("step", "type:kernel_type_test.step", "What."),
           param("links", "list<map{name: string; a?: real [m]}>", "Rows.")};
  const Map m = json_schema(s, "robot.test", "A test.");
  EXPECT_EQ(literal(*m.find("required")), "{\"id\"}");
  EXPECT_EQ(*m.find("additionalProperties"), Value(false));
  const Map& properties = *m.find("properties")->as_map();
  EXPECT_EQ(literal(*properties.find("tip")),
            "{type = \"string\", [\"x-member\"] = \"tip\", [\"x-of\"] = \"id\", description = "
            "\"Where.\"}");
  EXPECT_EQ(literal(*properties.find("step")),
            "{[\"$ref\"] = \"#/$defs/kernel_type_test.step\", description = \"What.\"}");
  ASSERT_NE(m.find("$defs"), nullptr);
  EXPECT_NE(m.find("$defs")->as_map()->find("kernel_type_test.step"), nullptr);
}

TEST(FormText, ShowsWhatMatters) {
  Schema s{param("step", "enum(move|wait)", "What it does.", true),
           param("pose", "string @when(step is move)", "Where to."),
           param("time", "real [s] @when(step is wait) @group(Timing)", "How long.")};
  EXPECT_EQ(form_text(s, Map{{"step", "move"}, {"pose", "home"}}),
            "* step: move|wait = \"move\"  What it does.\n"
            "  pose: string = \"home\"  Where to.\n");
  EXPECT_EQ(form_text(s, Map{{"step", "wait"}, {"time", 2}}),
            "* step: move|wait = \"wait\"  What it does.\n"
            "Timing\n"
            "  time: real [s] = 2  How long.\n");
}

}  // namespace
}  // namespace robomosp
