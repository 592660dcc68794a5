// SPDX-License-Identifier: Apache-2.0
// Forms as a window uses them: drawn from schemas alone, filled with the arguments of an example
// and run through the client of a session, which gives the example's result; and results as their
// declared types say.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "docs/example_arguments.h"
#include "docs/examples.h"
#include "ioci/client/client.h"
#include "ioci/core/application.h"
#include "ioci/core/result_types.h"
#include "kernel/literal.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"
#include "model/field_types.h"

namespace robomosp::ioci {
namespace {

Application& host() { return test::examples_app(); }

/// What a command gave when its example called it.
struct Gave {
  Result<Value> (*run)(CommandContext&, const Map&) = nullptr;
  std::optional<Value> result;
};
Gave& gave() {
  static Gave one;
  return one;
}
Result<Value> run_and_keep(CommandContext& ctx, const Map& args) {
  Result<Value> result = gave().run(ctx, args);
  if (result.ok() && !gave().result) gave().result = *result;
  return result;
}

/// The result of the first call of a command that succeeds in its example.
std::optional<Value> result_of(const CommandSpec& spec) {
  host().document.clear();
  for (const auto& [number, recording] : host().recordings.list()) host().recordings.remove(number);
  auto& open = const_cast<CommandSpec&>(spec);  // the table is this test's own
  gave() = {open.run, std::nullopt};
  open.run = run_and_keep;
  {
    Session session("example");
    lua::LuaState lua(
        host(), session,
        {.print = [](std::string_view) {},
         .module_path = {std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/lib"}});
    // An example may end early here, as files and servers of the one before are there.
    (void)lua.run_string(spec.example, spec.name).ok();
    open.run = gave().run;
  }
  return gave().result;
}

bool has_example(const CommandSpec& spec) {
  return !test::cannot_draw(spec) && spec.plugin.empty() && spec.run != nullptr;
}

TEST(SchemaResults, AreOfTheirDeclaredTypes) {
  const test::ExamplesFolder folder("results");
  std::size_t compared = 0, trees = 0;
  for (const CommandSpec* spec : host().commands.list()) {
    if (!has_example(*spec)) continue;
    const auto result = result_of(*spec);
    if (!result) continue;
    ++compared;
    const std::string type = result_type(spec->returns);
    trees += type != spec->returns.type;
    EXPECT_EQ(type_fault(type), "") << spec->name;
    if (spec->name == "event.take") continue;  // events have the fields of their topic
    const std::string bad = misfit(type_tree(type), *result, "");
    EXPECT_EQ(bad, "") << spec->name << " returns " << type;
  }
  EXPECT_GT(compared, 480U);
  std::cout << "Note: " << compared << " results compared with their types.\n";
}

/// Paths of the parts in which two results differ; numbers by much more than rounding.
void compare(const Value& a, const Value& b, const std::string& path, std::set<std::string>& out) {
  if (a.is_number() && b.is_number()) {
    const double x = a.number(), y = b.number();
    const double slack = 1e-9 * std::max({1.0, std::fabs(x), std::fabs(y)});
    if (!(std::fabs(x - y) <= slack) && !(std::isnan(x) && std::isnan(y)) && x != y)
      out.insert(path);
    return;
  }
  const List *la = a.as_list(), *lb = b.as_list();
  const Map *ma = a.as_map(), *mb = b.as_map();
  const NumericArray *na = a.as_array(), *nb = b.as_array();
  if (na && nb) {
    if (na->size() != nb->size()) out.insert(path);
    for (std::size_t i = 0; i < std::min(na->size(), nb->size()); ++i)
      compare(Value((*na)[i]), Value((*nb)[i]), path, out);
  } else if (la && lb) {
    if (la->size() != lb->size()) out.insert(path);
    for (std::size_t i = 0; i < std::min(la->size(), lb->size()); ++i)
      compare((*la)[i], (*lb)[i], path + "[]", out);
  } else if (ma && mb) {
    for (const auto& [name, value] : *ma)
      if (const Value* other = mb->find(name)) compare(value, *other, path + "." + name, out);
      else out.insert(path + "." + name);
    for (const auto& [name, value] : *mb)
      if (!ma->find(name)) out.insert(path + "." + name);
  } else if (a.as_handle() && b.as_handle()) {
    if (a.as_handle()->kind != b.as_handle()->kind) out.insert(path);
  } else if (literal(a) != literal(b)) {
    out.insert(path);
  }
}
std::set<std::string> differences(const Value& a, const Value& b) {
  std::set<std::string> out;
  compare(a, b, "", out);
  return out;
}

/// Fills a form of plain text: each value is written as text into the line of its field, and read
/// from it again.
std::string filled_form(const CommandSpec& spec, const Map& example, Map& args) {
  const std::string form = form_text(spec.params, Map(example));
  for (const auto& [name, value] : example) {
    const auto it = std::find_if(spec.params.begin(), spec.params.end(),
                                 [&name = name](const ParamSpec& p) { return p.name == name; });
    if (it == spec.params.end()) return "there is no field " + name;
    const std::string label = notes_of(*it).label;
    const std::string line = (label.empty() ? name : label) + ": ";
    if (form.find(line) == std::string::npos) return "the form has no line " + line;
    if (value.as_array() || value.as_handle()) {
      args.set(name, value);  // chosen, not typed
      continue;
    }
    const auto typed = read_literal(literal(value));
    if (!typed.ok()) return name + ": " + typed.error().sentence();
    args.set(name, *typed);
  }
  return {};
}

TEST(SchemaForms, EveryExampleRunsThroughTheClient) {
  const test::ExamplesFolder folder("client");
  // What these work on belongs to the session that began it, is another at every moment, or is
  // numbered anew.
  const auto may_differ = [](std::string_view name) {
    for (const std::string_view begin : {"draft.", "gesture.", "event.", "job.", "run."})
      if (name.starts_with(begin)) return true;
    return name == "document.undo" || name == "document.redo" || name == "document.history" ||
           name == "fault.picture" || name == "world.pack";
  };
  std::size_t same = 0;
  std::string others;
  for (const CommandSpec* spec : host().commands.list()) {
    if (!has_example(*spec)) continue;
    const auto first = result_of(*spec);
    const auto second = result_of(*spec);
    if (!first || !second) continue;
    // What is another from run to run: times, numbers of jobs, names of temporary files.
    const std::set<std::string> loose = differences(*first, *second);
    const auto example = test::arguments_of(*spec);  // the document is as the command found it
    if (!example) continue;
    Map args;
    ASSERT_EQ(filled_form(*spec, *example, args), "") << spec->name;
    auto opened = Client::open(host(), {});
    ASSERT_TRUE(opened.ok());
    std::unique_ptr<Client> client = std::move(*opened);
    std::optional<Result<Value>> got;
    client->call(spec->name, args, [&got](const Result<Value>& r) { got = r; });
    for (int i = 0; i < 30'000 && !got; ++i) {
      client->deliver();
      if (!got) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_TRUE(got) << spec->name << " gave no answer";
    bool is_same = got->ok();
    std::string why = is_same ? std::string() : got->error().message;
    if (is_same)
      for (const std::string& path : differences(*first, **got))
        if (!loose.contains(path)) {
          is_same = false;
          why += " " + path;
        }
    same += is_same;
    if (is_same) continue;
    EXPECT_TRUE(may_differ(spec->name)) << spec->name << ": " << why;
    others += "\n  " + spec->name + ": " + why;
  }
  EXPECT_GT(same, 500U);
  std::cout << "Note: " << same << " examples ran through the client; not the same:" << others
            << "\n";
}

/// Calls see for each table of fields: of commands, providers, kinds of records and named types,
/// with the tables within them.
void each_table(const std::function<void(const std::string&, const Schema&)>& see) {
  std::set<std::string> names;
  std::function<void(const std::string&, const TypeTree&)> within;
  std::function<void(const std::string&, const Schema&)> table = [&](const std::string& where,
                                                                     const Schema& fields) {
    if (fields.empty()) return;
    see(where, fields);
    for (const ParamSpec& p : fields) within(where + "." + p.name, type_tree(p.type));
  };
  within = [&](const std::string& where, const TypeTree& t) {
    table(where, t.fields);
    for (const auto& [word, fields] : t.cases) {
      Schema all = fields;
      ParamSpec decides;
      decides.name = t.decided_by;
      decides.type = "string";
      all.push_back(std::move(decides));
      table(where + "(" + word + ")", all);
    }
    if (t.element) within(where + "[]", *t.element);
    for (const auto& option : t.options) within(where, *option);
    if (t.kind == TypeKind::named && names.insert(t.word).second)
      if (const TypeTree* named = named_type(t.word)) within(t.word, *named);
  };
  for (const CommandSpec* spec : host().commands.list()) table(spec->name, spec->params);
  for (const ProviderInfo& p : host().registry.list())
    table(p.interface_id + " " + p.name, p.schema);
  for (const Kind k : all_kinds())
    table(std::string(to_string(k)), model::record_fields(model::info(k)));
}

// Each condition can hold and can fail, and the form shows its field in the first case only.
TEST(SchemaForms, EveryConditionShowsAndHidesItsField) {
  std::size_t conditions = 0;
  each_table([&](const std::string& where, const Schema& fields) {
    for (const ParamSpec& p : fields) {
      const TypeNotes notes = notes_of(p);
      if (notes.when.is_always()) continue;
      ++conditions;
      // Each field that it compares is absent, or has one of the words, or another value.
      std::vector<std::pair<std::string, std::vector<Value>>> states;
      for (const Condition::Test& t : notes.when.tests()) {
        auto at = std::find_if(states.begin(), states.end(),
                               [&](const auto& s) { return s.first == t.field; });
        if (at == states.end()) at = states.insert(states.end(), {t.field, {Value(), Value("x")}});
        for (const std::string& word : t.words) at->second.emplace_back(word);
        if (t.state == "true" || t.state == "false") at->second = {Value(true), Value(false)};
      }
      bool was_shown = false, was_hidden = false;
      std::function<void(std::size_t, Map)> each = [&](std::size_t i, Map given) {
        if (i < states.size()) {
          for (const Value& v : states[i].second) {
            Map next = given;
            const auto dot = states[i].first.find('.');
            if (v.is_nil()) {
            } else if (dot == std::string::npos) {
              next.set(states[i].first, v);
            } else {
              next.set(states[i].first.substr(0, dot), Map{{states[i].first.substr(dot + 1), v}});
            }
            each(i + 1, std::move(next));
          }
          return;
        }
        Map full = given;
        for (const ParamSpec& other : fields)
          if (other.default_value && !given.find(other.name) && other.name != p.name)
            full.set(other.name, *other.default_value);
        const bool holds = notes.when.holds(full);
        const std::string label = notes.label.empty() ? p.name : notes.label;
        const std::string form = "\n" + form_text(fields, given);
        const bool is_shown = form.find("\n  " + label + ": ") != std::string::npos ||
                              form.find("\n* " + label + ": ") != std::string::npos;
        EXPECT_EQ(is_shown, holds) << where << "." << p.name << " with " << literal(Value(given));
        (holds ? was_shown : was_hidden) = true;
      };
      each(0, {});
      EXPECT_TRUE(was_shown) << where << "." << p.name << " never counts: " << notes.when.text();
      EXPECT_TRUE(was_hidden) << where << "." << p.name << " always counts: " << notes.when.text();
    }
  });
  EXPECT_GT(conditions, 60U);
  std::cout << "Note: " << conditions << " conditions.\n";
}

/// A part of an argument: its path, its type, and the arguments that it needs around it.
using SeePart =
    std::function<void(const std::string& path, const TypeTree& type, const Map& given)>;

/// Calls see for the type at a path and all types within it; types with names once in `names`.
/// `around` makes the arguments of those that a part needs beside it.
void each_part(const std::string& path, const TypeTree& t,
               const std::function<Map(const Map&)>& around, std::set<std::string>& names,
               const SeePart& see) {
  see(path, t, around({}));
  if (t.kind == TypeKind::named) {
    const TypeTree* named = named_type(t.word);
    if (named && names.insert(t.word).second) each_part(path, *named, around, names, see);
    return;
  }
  if (t.element)
    each_part(
        path + "[1]", *t.element,
        [&](const Map& inner) {  // an element that needs nothing needs no list
          return inner.empty() ? Map() : around(Map{{"", List{Value(inner)}}});
        },
        names, see);
  for (const auto& option : t.options) each_part(path, *option, around, names, see);
  const auto fields = [&](const Schema& schema, const Map& with) {
    for (const ParamSpec& p : schema)
      each_part(
          path + "." + p.name, type_tree(p.type),
          [&, name = p.name](const Map& inner) {
            Map out = with;
            if (const Value* whole = inner.find("")) out.set(name, *whole);
            else if (!inner.empty()) out.set(name, Value(inner));
            return around(out);
          },
          names, see);
  };
  fields(t.fields, {});
  for (const auto& [word, own] : t.cases) fields(own, Map{{t.decided_by, word}});
}

// Each word behind `member:`, each kind of record and each interface gives choices in a document
// that has one of everything, also in tables within arguments, providers' parameters and records.
TEST(SchemaSources, EachHasChoices) {
  host().document.clear();
  Session session("choices");
  lua::LuaState lua(host(), session, {.print = [](std::string_view) {}, .module_path = {}});
  const auto done = lua.run_string(
      "material.create{name = \"steel\", density = 7850}\n"
      "local bar = robot.create{name = \"bar\", links = {{name = \"crank\", a = 0.1}, "
      "{name = \"coupler\", a = 0.35, passive = true}, {name = \"rocker\", parent = \"base\", "
      "origin = {0.4, 0, 0}, passive = true}}, poses = {home = {0.6, 0.7, 1.8}}}\n"
      "bar:add_loop{name = \"pin\", kind = \"planar\", a = {link = \"coupler\"}, "
      "b = {link = \"rocker\", position = {0.25, 0, 0}}}\n"
      "solid.create{name = \"pin\", root = {kind = \"box\", x = 0.1, y = 0.1, z = 0.1}, parameters "
      "= {bore = \"20 mm\"}}\n"
      "object.create{name = \"gun\", parts = {{what = \"pin\"}}, tcps = {{name = \"tip\"}}}\n"
      "local arm = robot.create{name = \"arm\", links = {{name = \"a1\", a = 0.3}, {name = \"a2\", "
      "a = 0.2}}, poses = {home = {0, 0}}}\n"
      "arm:set_axes{axes = {{name = \"J1\", link = \"a1\"}, {name = \"J2\", link = \"a2\"}}}\n"
      "arm:add_tool{name = \"camera\", link = \"a1\"}\n"
      "arm:attach{tool = \"gun\", name = \"torch\"}\n"
      "trajectory.create{name = \"seam\", segments = {{shape = \"line\", points = {{0, 0, 0}, "
      "{0.1, "
      "0, 0}}}}}\n"
      "task.create{name = \"job\", steps = {{step = \"message\", text = \"hello\"}}}\n"
      "program.create{name = \"rest\", source = \"PROGRAM rest; BEGIN HALT; ENDPROGRAM;\"}\n"
      "record.create{kind = \"controller\", name = \"press\", fields = {target = \"krl\"}}\n"
      "local cell = world.create{name = \"cell\"}\n"
      "cell:add_robot{robot = arm, name = \"left\"}\ncell:add_object{what = \"pin\"}\n"
      "cell:add_trajectory{trajectory = \"seam\"}\ncell:add_frame{name = \"bench\"}\n"
      "cell:add_light{name = \"lamp\"}\ncell:add_task{task = \"job\"}\n"
      "cell:add_program{program = \"rest\", name = \"rest\"}\ncell:add_signal{name = \"go\"}\n"
      "cell:attach{object = \"pin\", robot = \"left\"}\n"
      "recording.create{columns = {{name = \"height\", values = {1, 2}}}, title = \"drops\"}\n"
      "start(\"world.list\"):wait()\n"
      "solid.create{name = \"cube\", material = \"steel\", root = {kind = \"box\", x = 0.1, y = "
      "0.1, z = 0.1}}\n"
      "local fall = world.create{name = \"fall\"}\nfall:add_object{what = \"cube\"}\n"
      "fall:start_run(\"physics\", {duration = 0.1})\n",
      "one of everything");
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  std::set<std::string> asked, words;
  const auto ask = [&](const Map& form, const std::string& name, const Schema& schema) {
    // Parts of types with names are looked at once for each form.
    std::set<std::string> here;
    for (const ParamSpec& p : schema)
      each_part(
          p.name, type_tree(p.type),
          [&](const Map& inner) {
            Map out;
            if (const Value* whole = inner.find("")) out.set(p.name, *whole);
            else if (!inner.empty()) out.set(p.name, Value(inner));
            return out;
          },
          here,
          [&](const std::string& path, const TypeTree& t, const Map& given) {
            std::string source;
            if (t.kind == TypeKind::member) source = "member:" + t.word;
            if (t.kind == TypeKind::reference) source = "ref:" + text::join(t.words, "|");
            if (t.kind == TypeKind::provider) source = "provider:" + text::join(t.words, "|");
            // A plugin has these; none that is shipped does.
            if (source.empty() || source == "member:setting" || source == "member:module" ||
                source == "provider:primitive")
              return;
            words.insert(source);
            // Once for each source and place of it: an argument, or a path within one.
            const std::size_t dot = path.find_first_of(".[");
            if (!asked.insert(source + " " + (dot == path.npos ? "" : path.substr(dot))).second)
              return;
            Map args = form;
            args.set("argument", path);
            args.set("given", Value(given));
            const auto found = host().dispatch(session, "schema.choices", args);
            ASSERT_TRUE(found.ok()) << name << " " << path << " " << literal(Value(given)) << ": "
                                    << found.error().sentence();
            EXPECT_FALSE(found->as_list()->empty())
                << source << " at " << path << " of " << name << " has no choices";
          });
  };
  for (const CommandSpec* spec : host().commands.list())
    ask({{"command", spec->name}}, spec->name, spec->params);
  for (const ProviderInfo& p : host().registry.list()) {
    std::string interface = p.interface_id.substr(0, p.interface_id.find('/'));
    interface.erase(0, interface.rfind('.') + 1);
    ask({{"interface", interface}, {"provider", p.name}}, p.interface_id + " " + p.name, p.schema);
  }
  for (const Kind k : all_kinds())
    ask({{"kind", std::string(to_string(k))}}, std::string(to_string(k)),
        model::record_fields(model::info(k)));
  for (const char* source : {"ref:recording", "ref:run", "ref:job", "member:column"})
    EXPECT_TRUE(words.contains(source)) << source;
  std::cout << "Note: " << asked.size() << " places of " << words.size() << " sources.\n";
  EXPECT_GT(words.size(), 30U);
  EXPECT_GT(asked.size(), 100U);
  // Commands that edit load records of the library by name, others do not.
  const auto names = [&](const char* command) {
    std::set<std::string> out;
    const auto found =
        host().dispatch(session, "schema.choices", Map{{"command", command}, {"argument", "id"}});
    if (found.ok())
      for (const Value& v : *found->as_list()) out.insert(v.as_map()->find("value")->text());
    return out;
  };
  EXPECT_TRUE(names("robot.set_link").contains("pa10"));
  EXPECT_FALSE(names("robot.fk").contains("pa10"));
  EXPECT_TRUE(names("robot.fk").contains("arm"));
  for (const auto& [number, recording] : host().recordings.list()) host().recordings.remove(number);
  (void)lua.run_string("for _, r in ipairs(run.list()) do r.id:remove() end", "end").ok();
  host().document.clear();
}

}  // namespace
}  // namespace robomosp::ioci
