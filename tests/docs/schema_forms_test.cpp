// SPDX-License-Identifier: Apache-2.0
// Forms drawn from schemas alone: every command, provider and kind of record has one, every example
// fits it, every member and provider has a source of choices, and few arguments are without a type.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "docs/example_arguments.h"
#include "docs/examples.h"
#include "ioci/core/application.h"
#include "ioci/core/argument_types.h"
#include "ioci/core/example_arguments.h"
#include "ioci/core/interface_words.h"
#include "ioci/schema/choices.h"
#include "kernel/literal.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"
#include "kernel/units.h"
#include "model/data.h"
#include "model/field_types.h"

namespace robomosp::ioci {
namespace {

Application& program() { return test::examples_app(); }

/// Calls fn for a type and all types within it; types with names once.
void walk(const TypeTree& t, const std::function<void(const TypeTree&)>& fn,
          std::set<std::string>& names) {
  fn(t);
  if (t.element) walk(*t.element, fn, names);
  for (const auto& option : t.options) walk(*option, fn, names);
  for (const ParamSpec& p : t.fields) walk(type_tree(p.type), fn, names);
  for (const auto& [word, fields] : t.cases)
    for (const ParamSpec& p : fields) walk(type_tree(p.type), fn, names);
  if (t.kind == TypeKind::named && names.insert(t.word).second)
    if (const TypeTree* named = named_type(t.word)) walk(*named, fn, names);
}
void walk_commands(const std::function<void(const std::string& where, const TypeTree&)>& fn) {
  std::set<std::string> names;
  for (const CommandSpec* spec : program().commands.list()) {
    for (const ParamSpec& p : spec->params)
      walk(
          type_tree(p.type), [&](const TypeTree& t) { fn(spec->name + "{" + p.name + "=}", t); },
          names);
    for (const ParamSpec& p : spec->returns.fields)
      walk(
          type_tree(p.type), [&](const TypeTree& t) { fn(spec->name + "." + p.name, t); }, names);
  }
}

TEST(SchemaForms, EveryTypeIsWellFormed) {
  for (const CommandSpec* spec : program().commands.list()) {
    EXPECT_EQ(schema_fault(spec->params), "") << spec->name;
    EXPECT_EQ(schema_fault(spec->returns.fields), "") << spec->name;
    EXPECT_EQ(type_fault(spec->returns.type), "") << spec->name;
  }
  for (const ProviderInfo& p : program().registry.list())
    EXPECT_EQ(schema_fault(p.schema), "") << p.interface_id << " " << p.name;
  for (const std::string& name : named_types()) {
    const TypeTree* t = named_type(name);
    ASSERT_NE(t, nullptr) << name;
    EXPECT_EQ(type_fault(type_text(*t)), "") << name;
    EXPECT_EQ(plain_type("type:" + name), plain_type(type_text(*t))) << name;
  }
}

TEST(SchemaForms, EveryExampleFitsAndFillsTheFormOfItsCommand) {
  const test::ExamplesFolder folder("forms");
  std::size_t with_arguments = 0;
  for (const CommandSpec* spec : program().commands.list()) {
    if (test::cannot_draw(*spec)) continue;
    const auto args = test::arguments_of(*spec);
    if (!args) continue;
    ++with_arguments;
    EXPECT_EQ(misfit(spec->params, *args), "") << spec->name << literal(Value(*args)) << "\n"
                                               << form_text(spec->params, *args);
    const std::string form = form_text(spec->params, *args);
    for (const auto& [name, value] : *args) {
      const auto it = std::find_if(spec->params.begin(), spec->params.end(),
                                   [&name = name](const ParamSpec& p) { return p.name == name; });
      ASSERT_NE(it, spec->params.end()) << spec->name << " " << name;
      const std::string label = notes_of(*it).label;
      EXPECT_NE(form.find((label.empty() ? name : label) + ": "), std::string::npos)
          << spec->name << "\n"
          << form;
    }
  }
  EXPECT_GT(with_arguments, 480U);
  std::cout << "Note: " << with_arguments << " examples fill a form.\n";
}

/// Handles as the names that commands take, in all parts; numbers of files and the like stay.
Value with_names(const Value& v) {
  if (const Handle* h = v.as_handle()) {
    const auto name = program().name_of(*h);
    return h->kind == "recording" || !name || name->empty()
               ? Value(h->kind + "#" + std::to_string(h->number))
               : Value(*name);
  }
  if (const List* list = v.as_list()) {
    List out;
    for (const Value& each : *list) out.push_back(with_names(each));
    return out;
  }
  if (const Map* m = v.as_map()) {
    Map out;
    for (const auto& [name, each] : *m) out.set(name, with_names(each));
    return out;
  }
  return v;
}

// Examples as arguments: recorded from the examples in Lua, so that forms can be filled from them.
TEST(SchemaForms, ExamplesAsArgumentsAreThoseOfTheExamples) {
  constexpr std::size_t kLongestExample = 1500;
  const test::ExamplesFolder folder("recorded");
  const std::string here = folder.path().string();
  std::map<std::string, std::string> recorded;
  const auto text_of_example = [](const CommandSpec& spec) {
    const auto args = test::arguments_of(spec);
    return args && !args->empty() ? literal(with_names(Value(*args))) : std::string();
  };
  for (const CommandSpec* spec : program().commands.list()) {
    if (test::cannot_draw(*spec) || !spec->plugin.empty()) continue;
    if (spec->name.starts_with("job.")) continue;  // a job that has ended has its command's name
    std::string text = text_of_example(*spec);
    if (text.empty() || text.size() > kLongestExample || text.find(here) != std::string::npos)
      continue;
    // Names of temporary files, and numbers that count up, are those of one run.
    if (text == text_of_example(*spec)) recorded[spec->name] = std::move(text);
  }
  if (std::getenv("ROBOMOSP_UPDATE_DOCS")) {
    const std::filesystem::path file =
        std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "modules/ioci/examples/example_arguments.cpp";
    std::ifstream in(file);
    std::stringstream all;
    all << in.rdbuf();
    std::string source = all.str();
    const std::string begin = "kExampleArguments[] = {\n";
    const std::size_t from = source.find(begin) + begin.size();
    const std::size_t to = source.find("};\n// clang-format on", from);
    ASSERT_NE(to, std::string::npos);
    std::string rows;
    for (const auto& [name, text] : recorded)
      rows += "    {\"" + name + "\", R\"lua({" + text.substr(1, text.size() - 2) + "})lua\"},\n";
    source.replace(from, to - from, rows);
    std::ofstream(file) << source;
    return;
  }
  for (const auto& [name, text] : recorded) {
    const auto kept = read_literal(example_arguments(name));
    ASSERT_TRUE(kept.ok() && kept->as_map())
        << name
        << " has no arguments as data; ROBOMOSP_UPDATE_DOCS=1 ioci_examples_test writes them";
    const CommandSpec* spec = program().commands.find(name);
    EXPECT_EQ(misfit(spec->params, *kept->as_map()), "") << name;
    const auto now = read_literal(text);
    ASSERT_TRUE(now.ok()) << text;
    for (const auto& [argument, value] : *now->as_map())
      EXPECT_NE(kept->as_map()->find(argument), nullptr)
          << name << " {" << argument << "=}; ROBOMOSP_UPDATE_DOCS=1 ioci_examples_test writes it";
  }
  EXPECT_GT(recorded.size(), 400U);
  std::cout << "Note: " << recorded.size() << " examples are kept as arguments.\n";
}

TEST(SchemaForms, EveryProviderHasAFormFilledWithItsDefaults) {
  for (const ProviderInfo& p : program().registry.list()) {
    Map defaults;
    for (const ParamSpec& s : p.schema)
      if (s.default_value && !s.default_value->is_nil()) defaults.set(s.name, *s.default_value);
    std::size_t lines = 0;
    for (const char c : form_text(p.schema, defaults)) lines += c == '\n';
    EXPECT_GE(lines, p.schema.size()) << p.interface_id << " " << p.name;
    for (const ParamSpec& s : p.schema)
      if (s.default_value && !plain_type(s.type).starts_with("ref:")) {
        EXPECT_EQ(misfit(type_tree(s.type), *s.default_value, s.name), "")
            << p.interface_id << " " << p.name;
      }
  }
}

TEST(SchemaForms, MembersProvidersAndUnitsHaveSources) {
  const std::vector<std::string> members = member_words();
  std::set<std::string> used;
  walk_commands([&](const std::string& where, const TypeTree& t) {
    if (t.kind == TypeKind::member) {
      used.insert(t.word);
      EXPECT_TRUE(std::binary_search(members.begin(), members.end(), t.word))
          << where << ": no choices for member:" << t.word;
    }
    if (t.kind == TypeKind::provider) {
      for (const std::string& word : t.words) {
        const auto id = interface_of_word(word);
        EXPECT_TRUE(id.ok()) << where << ": " << word;
      }
    }
    if (t.kind == TypeKind::reference) {
      for (const std::string& kind : t.words)
        EXPECT_TRUE(kind == "any" || kind_from(kind) || kind == "recording" || kind == "run" ||
                    kind == "job")
            << where << ": " << kind;
    }
  });
  for (const CommandSpec* spec : program().commands.list())
    for (const ParamSpec& p : spec->params) {
      const std::string unit = unit_of(p);
      const auto own = units::parse(unit), shown = units::parse(shown_unit_of(unit));
      if (own.ok() && shown.ok()) {
        EXPECT_EQ(own->dimension, shown->dimension) << spec->name << " " << p.name;
      }
    }
}

// Lists kept by hand against what they are about.
TEST(SchemaForms, MeaningsOfArgumentsAreAllUsed) {
  for (const ArgumentType& t : argument_types()) {
    bool is_used = false;
    for (const CommandSpec* spec : program().commands.list())
      if (is_command_among(spec->name, t.commands))
        for (const ParamSpec& p : spec->params)
          is_used = is_used || (p.name == t.argument && p.type == t.type);
    EXPECT_TRUE(is_used) << t.argument << " of " << t.commands << ": " << t.type;
  }
}

TEST(SchemaForms, FewArgumentsAreWithoutAType) {
  constexpr std::size_t kMostUntyped = 30;  // it only falls
  std::size_t count = 0;
  std::set<const UntypedArgument*> used;
  for (const CommandSpec* spec : program().commands.list()) {
    if (!spec->plugin.empty()) continue;
    for (const ParamSpec& p : spec->params) {
      if (p.type != "any" && p.type != "map" && p.type != "list") continue;
      ++count;
      bool has_reason = false;
      for (const UntypedArgument& u : untyped_arguments())
        if (u.argument == p.name && is_command_among(spec->name, u.commands)) {
          used.insert(&u);
          has_reason = true;
        }
      EXPECT_TRUE(has_reason) << spec->name << "{" << p.name << "=} is " << p.type
                              << " and needs a type or a reason";
    }
  }
  for (const UntypedArgument& u : untyped_arguments())
    EXPECT_TRUE(used.contains(&u)) << u.argument << " of " << u.commands << " has a type now";
  EXPECT_LE(count, kMostUntyped);
  std::cout << "Note: " << count << " arguments are without a type.\n";
}

// The conditions of fields in words against the functions by which files and values leave them out.
TEST(SchemaForms, ConditionsOfFieldsSayWhatTheModelDoes) {
  std::size_t compared = 0;
  std::set<const model::Field*> noted;
  for (const model::FieldNote& note : model::field_notes()) {
    const model::NotedField at = model::noted_field(note);
    ASSERT_NE(at.field, nullptr) << note.kind << " has no " << note.path;
    const std::string text = note.type.empty() || note.type.starts_with('@')
                                 ? "any " + std::string(note.type)
                                 : std::string(note.type);
    const auto parsed = parse_type(text);
    ASSERT_TRUE(parsed.ok()) << note.path << ": " << parsed.error().sentence();
    noted.insert(at.field);
    if (!at.field->counts) continue;
    const Condition& when = (*parsed)->notes.when;
    ASSERT_FALSE(when.is_always()) << note.kind << " " << note.path;
    // All states of the fields that it compares.
    std::vector<std::string> names;
    for (const Condition::Test& t : when.tests())
      if (std::find(names.begin(), names.end(), t.field) == names.end()) names.push_back(t.field);
    std::function<void(std::size_t, std::vector<std::pair<std::string, std::size_t>>)> each =
        [&](std::size_t i, std::vector<std::pair<std::string, std::size_t>> states) {
          if (i < names.size()) {
            const model::Type* t = at.owner;
            std::size_t count = 2;
            for (const std::string_view name : text::split(names[i], '.')) {
              const model::Field* f = t->field(name);
              ASSERT_NE(f, nullptr) << names[i];
              t = f->type;
              if (t->shape == model::Shape::word) count = t->words.size();
            }
            for (std::size_t s = 0; s < count; ++s) {
              auto next = states;
              next.emplace_back(names[i], s);
              each(i + 1, std::move(next));
            }
            return;
          }
          const auto sample = at.owner->clone(at.owner->standard.get());
          Map values;
          for (const auto& [path, state] : states) {
            void* p = sample.get();
            const model::Type* t = at.owner;
            for (const std::string_view name : text::split(path, '.')) {
              const model::Field* f = t->field(name);
              p = f->in(p);
              t = f->type;
            }
            const bool is_nested = path.find('.') != std::string::npos;
            const auto set = [&](Value v) {
              if (!is_nested) values.set(path, std::move(v));
              else
                values.set(path.substr(0, path.find('.')),
                           Map{{path.substr(path.find('.') + 1), std::move(v)}});
            };
            switch (t->shape) {
              case model::Shape::word:
                t->set_whole(p, t->words[state].value);
                set(std::string(t->words[state].word));
                break;
              case model::Shape::boolean:
                *static_cast<bool*>(p) = state == 1;
                set(state == 1);
                break;
              case model::Shape::text:
                *static_cast<std::string*>(p) = state ? "x" : "";
                if (state) set("x");
                break;
              case model::Shape::reference:
                t->set_id(p, state ? AnyId{Kind::robot, 7} : AnyId{});
                if (state) set("x");
                break;
              case model::Shape::optional:
                if (state) {
                  (void)t->hold(p);
                  set(true);
                } else {
                  t->drop(p);
                }
                break;
              default: FAIL() << path << " cannot be varied";
            }
          }
          EXPECT_EQ(when.holds(values), at.field->counts(sample.get()))
              << note.kind << " " << note.path << " when " << literal(Value(values));
          ++compared;
        };
    each(0, {});
  }
  EXPECT_GT(compared, 100U);
  // Each field that counts under a condition has it in words.
  std::function<void(const model::Type&, const std::string&, std::set<const model::Type*>&)> look =
      [&](const model::Type& t, const std::string& path, std::set<const model::Type*>& seen) {
        const model::Type* held = &t;
        while (held->element) held = held->element;
        if (!seen.insert(held).second) return;
        for (const model::Field& f : held->fields) {
          EXPECT_TRUE(!f.counts || noted.contains(&f)) << path << "." << f.name;
          look(*f.type, path + "." + std::string(f.name), seen);
        }
      };
  for (const Kind k : all_kinds()) {
    std::set<const model::Type*> seen;
    look(*model::info(k).type, std::string(to_string(k)), seen);
  }
}

TEST(SchemaForms, EveryKindOfRecordHasAForm) {
  for (const Kind k : all_kinds()) {
    const Schema fields = model::record_fields(model::info(k));
    EXPECT_EQ(schema_fault(fields), "") << to_string(k);
    const std::string form = form_text(fields, Map());
    for (const ParamSpec& p : fields)
      if (notes_of(p).when.is_always()) {
        const std::string label = notes_of(p).label;
        EXPECT_NE(form.find((label.empty() ? p.name : label) + ": "), std::string::npos)
            << to_string(k) << "\n"
            << form;
      }
  }
}

class SchemaChoices : public testing::Test {
 protected:
  void SetUp() override {
    program().document.clear();
    lua::LuaState lua(program(), session_, {.print = [](std::string_view) {}, .module_path = {}});
    const auto done = lua.run_string(
        "local arm = robot.create{name = \"arm\", links = {{name = \"a1\", a = 0.3}, {name = "
        "\"a2\", a = 0.2, mimic = {link = \"a1\"}}, {name = \"flange\", joint = \"fixed\"}}, "
        "poses = {home = {0}, up = {1}}}\n"
        "arm:add_tool{name = \"camera\", link = \"a1\"}\n"
        "local two = robot.create{name = \"two\", links = {{name = \"b1\", a = 0.3}}, poses = "
        "{rest = {0}}}\n"
        "local cell = world.create{name = \"cell\"}\n"
        "cell:add_robot{robot = arm, name = \"left\"}\n"
        "cell:add_robot{robot = two, name = \"right\"}\n"
        "cell:add_signal{name = \"go\"}\n",
        "scene");
    ASSERT_TRUE(done.ok()) << done.error().sentence();
  }
  void TearDown() override { program().document.clear(); }

  std::vector<std::string> values(const char* command, const char* argument, const char* given,
                                  const char* prefix = "") {
    std::vector<std::string> out;
    const auto args = read_literal(given);
    const auto found = program().dispatch(
        session_, "schema.choices",
        Map{{"command", command}, {"argument", argument}, {"given", *args}, {"prefix", prefix}});
    EXPECT_TRUE(found.ok()) << found.error().sentence();
    if (found.ok())
      for (const Value& v : *found->as_list()) out.push_back(v.as_map()->find("value")->text());
    return out;
  }
  using Words = std::vector<std::string>;
  Session session_{"forms"};
};

TEST_F(SchemaChoices, FollowWhatTheOtherArgumentsName) {
  EXPECT_EQ(values("robot.link", "link", "{id = \"arm\"}"), (Words{"a1", "a2", "flange"}));
  EXPECT_EQ(values("robot.link", "link", "{id = \"two\"}"), (Words{"b1"}));
  EXPECT_EQ(values("robot.add_tool", "link", "{id = \"two\"}"), (Words{"b1", "base"}));
  EXPECT_EQ(values("robot.fk", "q", "{id = \"arm\"}"), (Words{"home", "up"}));
  EXPECT_EQ(values("robot.fk", "q", "{id = \"arm\"}", "U"), (Words{"up"}));
  EXPECT_EQ(values("world.plan_path", "robot", "{id = \"cell\"}"), (Words{"left", "right"}));
  EXPECT_EQ(values("world.plan_path", "to", "{id = \"cell\", robot = \"left\"}"),
            (Words{"home", "up"}));
  EXPECT_EQ(values("world.plan_path", "to", "{id = \"cell\", robot = \"right\"}"), (Words{"rest"}));
  EXPECT_EQ(values("robot.joint_limit", "joint", "{id = \"arm\"}"), (Words{"a1", "a2"}));
  EXPECT_EQ(values("world.set_signal", "signal", "{id = \"cell\"}"), (Words{"go"}));
  EXPECT_EQ(values("program.from_trajectory", "robot", "{world = \"cell\"}"),
            (Words{"left", "right"}));
  // The only robot of a world need not be named.
  ASSERT_TRUE(program().dispatch(session_, "world.create", Map{{"name", "one"}}).ok());
  ASSERT_TRUE(
      program().dispatch(session_, "world.add_robot", Map{{"id", "one"}, {"robot", "two"}}).ok());
  EXPECT_EQ(values("world.clearance", "q", "{id = \"one\"}"), (Words{"rest"}));
  // Nothing is given that decides: all there are.
  EXPECT_EQ(values("robot.fk", "q", "{}"), (Words{"home", "up", "rest"}));
}

/// "member:task of world" needs an argument `world`, or the choices are those of all worlds.
TEST_F(SchemaChoices, TheOwnersOfMembersAreArguments) {
  for (const CommandSpec* c : program().commands.list())
    for (const ParamSpec& p : c->params)
      for (std::string_view rest = p.type;;) {
        const std::size_t at = rest.find("member:");
        if (at == std::string_view::npos) break;
        rest.remove_prefix(at + 7);
        const std::string_view words = rest.substr(0, rest.find_first_of("|>,;){} "));
        const std::string_view behind = rest.substr(words.size());
        if (!behind.starts_with(" of ")) continue;
        const std::string_view owner = behind.substr(4, behind.find_first_of("|>,;){} ", 4) - 4);
        const auto has = [&](std::string_view name) {
          return std::any_of(c->params.begin(), c->params.end(),
                             [&](const ParamSpec& o) { return o.name == name; });
        };
        EXPECT_TRUE(has(owner)) << c->name << " " << p.name << ": " << p.type;
      }
}

TEST_F(SchemaChoices, GoIntoParts) {
  EXPECT_EQ(values("task.add_step", "step.step", "{}", "w"), (Words{"wait"}));
  EXPECT_EQ(values("task.add_step", "step.robot", "{step = {step = \"move\"}}"),
            (Words{"left", "right"}));
  EXPECT_EQ(values("task.add_step", "step.pose", "{step = {step = \"move\", robot = \"right\"}}"),
            (Words{"rest"}));
  EXPECT_EQ(values("task.add_step", "step.profile", "{step = {step = \"move\"}}", "q"),
            (Words{"quintic"}));
  EXPECT_EQ(values("robot.create", "links[1].joint", "{links = {{}}}", "pr"), (Words{"prismatic"}));
  EXPECT_FALSE(values("trajectory.add_segment", "segment.shape", "{segment = {}}").empty());
  Map args{{"command", "task.add_step"},
           {"argument", "step.robt"},
           {"given", *read_literal("{step = {step = \"move\"}}")}};
  const auto wrong = program().dispatch(session_, "schema.choices", args);
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().hint, "Did you mean \"robot\"?");
  args.set("given", Map());
  const auto undecided = program().dispatch(session_, "schema.choices", args);
  ASSERT_FALSE(undecided.ok());
  EXPECT_EQ(undecided.error().hint, "Give step first.");
  // Paths that end early, or go on without a dot.
  for (const char* path : {"id.", "id.x", "links", "links.", "links[1]", "links[1].", "links[1]x",
                           "links[1]joint", "links[", "links[]", "links[1][1]", ".", "", "["}) {
    const auto found = program().dispatch(session_, "schema.choices",
                                          Map{{"command", "robot.create"}, {"argument", path}});
    EXPECT_TRUE(found.ok() || !found.error().message.empty()) << path;
  }
  for (const char* path : {"links[1].", "links[1]joint"}) {
    const auto found = program().dispatch(session_, "schema.choices",
                                          Map{{"command", "robot.create"}, {"argument", path}});
    EXPECT_FALSE(found.ok()) << path;
  }
}

TEST_F(SchemaChoices, SayWhyNot) {
  const auto found = program().dispatch(
      session_, "schema.choices",
      Map{{"command", "robot.joint_limit"}, {"argument", "joint"}, {"given", Map{{"id", "arm"}}}});
  ASSERT_TRUE(found.ok());
  const Map& follower = *(*found->as_list())[1].as_map();
  EXPECT_EQ(*follower.find("why_not"), Value("It follows the joint of link \"a1\"."));
}

TEST_F(SchemaChoices, WordsProvidersAndUnits) {
  EXPECT_EQ(values("world.run_task", "id", "{}"), (Words{"cell"}));
  const Words solvers = values("robot.solve_ik", "provider", "{}");
  EXPECT_NE(std::find(solvers.begin(), solvers.end(), "numeric"), solvers.end());
  const Words lengths = values("trajectory.along_edges", "stand_off", "{}", "12");
  EXPECT_NE(std::find(lengths.begin(), lengths.end(), "12 mm"), lengths.end());
  EXPECT_EQ(std::find(lengths.begin(), lengths.end(), "12 deg"), lengths.end());
  const Words commands = values("ioci.describe", "command", "{}", "schema.");
  EXPECT_EQ(commands.size(), 5U);
}

TEST_F(SchemaChoices, WordsHaveLabels) {
  const auto labels = [this](const char* command, const char* argument) {
    const auto found = program().dispatch(session_, "schema.choices",
                                          Map{{"command", command}, {"argument", argument}});
    Words out;
    if (found.ok())
      for (const Value& choice : *found->as_list())
        out.push_back(*choice.as_map()->find("label")->as_string());
    return out;
  };
  EXPECT_EQ(labels("robot.create", "convention"), (Words{"DH", "MDH"}));
  const Words steps = labels("task.add_step", "step.step");
  EXPECT_NE(std::find(steps.begin(), steps.end(), "Move"), steps.end());
  const Words speeds = labels("run.continue", "speed");
  EXPECT_NE(std::find(speeds.begin(), speeds.end(), "Max"), speeds.end());
}

// Every argument of every command; one that takes a record, member or provider of which the scene
// has some has choices. How long the answers take is measured by slowest_choices_of_any_argument in
// tests/bench.
TEST_F(SchemaChoices, EveryArgumentHasAnAnswer) {
  const test::ExamplesFolder folder("choices");
  const auto has = [](const std::vector<std::string>& words,
                      std::initializer_list<const char*> any) {
    return std::any_of(any.begin(), any.end(), [&](const char* word) {
      return std::find(words.begin(), words.end(), word) != words.end();
    });
  };
  /// Of what the scene has.
  const std::function<bool(const TypeTree&)> has_some = [&](const TypeTree& t) {
    switch (t.kind) {
      case TypeKind::boolean: return true;
      case TypeKind::word: return true;
      case TypeKind::reference: return has(t.words, {"robot", "world", "any"});
      case TypeKind::member:
        return has({t.word}, {"link", "link_or_base", "joint", "pose", "robot", "signal", "command",
                              "kind", "interface"});
      case TypeKind::provider:
        return std::any_of(t.words.begin(), t.words.end(), [](const std::string& word) {
          const auto id = interface_of_word(word);
          return id.ok() && !program().registry.list(*id).empty();
        });
      case TypeKind::list: return t.element && has_some(*t.element);
      case TypeKind::one_of:
        return std::any_of(t.options.begin(), t.options.end(),
                           [&](const auto& option) { return has_some(*option); });
      default: return false;
    }
  };
  std::size_t with_some = 0;
  for (const CommandSpec* spec : program().commands.list())
    for (const ParamSpec& p : spec->params) {
      const auto found = program().dispatch(session_, "schema.choices",
                                            Map{{"command", spec->name}, {"argument", p.name}});
      ASSERT_TRUE(found.ok()) << spec->name << " " << p.name << ": " << found.error().sentence();
      if (has_some(type_tree(p.type))) {
        ++with_some;
        EXPECT_FALSE(found->as_list()->empty()) << spec->name << " " << p.name << ": " << p.type;
      }
      std::set<std::string> values;
      for (const Value& choice : *found->as_list())
        EXPECT_TRUE(values.insert(literal(*choice.as_map()->find("value"))).second)
            << spec->name << " " << p.name << " twice: " << literal(choice);
    }
  EXPECT_GT(with_some, 600U);
}

TEST(SchemaForms, JsonSchemasResolve) {
  std::function<void(const Value&, const Map&, const std::string&)> look =
      [&](const Value& v, const Map& defs, const std::string& where) {
        if (const List* list = v.as_list())
          for (const Value& each : *list) look(each, defs, where);
        const Map* m = v.as_map();
        if (!m) return;
        for (const auto& [name, value] : *m) {
          if (name == "$ref" && value.as_string()) {
            constexpr std::string_view kStart = "#/$defs/";
            ASSERT_TRUE(value.as_string()->starts_with(kStart)) << where;
            EXPECT_NE(defs.find(value.as_string()->substr(kStart.size())), nullptr) << where;
          }
          look(value, defs, where);
        }
      };
  for (const CommandSpec* spec : program().commands.list()) {
    const Map m = json_schema(spec->params, spec->name, spec->summary);
    const Value* defs = m.find("$defs");
    look(Value(m), defs ? *defs->as_map() : Map(), spec->name);
    EXPECT_EQ(m.find("properties")->as_map()->size(), spec->params.size()) << spec->name;
  }
}

TEST(SchemaForms, DescribeDropsNothing) {
  Session session("describe");
  const auto begun = std::chrono::steady_clock::now();
  const auto all = program().dispatch(session, "ioci.describe", Map());
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count();
  ASSERT_TRUE(all.ok());
  std::cout << "Note: ioci.describe of all commands took " << ms << " ms.\n";
  for (const Value& each : *all->as_list()) {
    const Map& command = *each.as_map();
    const CommandSpec* spec = program().commands.find(*command.find("name")->as_string());
    ASSERT_NE(spec, nullptr);
    const List& params = *command.find("params")->as_list();
    ASSERT_EQ(params.size(), spec->params.size());
    for (std::size_t i = 0; i < params.size(); ++i) {
      const Map& m = *params[i].as_map();
      const ParamSpec& p = spec->params[i];
      const auto text = [&m](const char* name) {
        const Value* v = m.find(name);
        return v && v->as_string() ? *v->as_string() : std::string();
      };
      EXPECT_EQ(text("declared").empty() ? text("type") : text("declared"), p.type);
      EXPECT_EQ(text("label"), notes_of(p).label);
      EXPECT_EQ(text("group"), notes_of(p).group);
      EXPECT_EQ(text("when"), notes_of(p).when.text());
      EXPECT_EQ(m.find("infinite") != nullptr, p.infinite);
      EXPECT_EQ(text("unit"), unit_of(p));
    }
    EXPECT_EQ(*command.find("takes_expressions"), Value(spec->takes_expressions));
  }
}

}  // namespace
}  // namespace robomosp::ioci
