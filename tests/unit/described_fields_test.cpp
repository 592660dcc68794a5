// SPDX-License-Identifier: Apache-2.0
// What record.describe returns for a field, record.set takes: setting it changes nothing.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include <unistd.h>

#include <gtest/gtest.h>

#include "document/digest.h"
#include "io/native.h"
#include "io/plain_fields.h"
#include "ioci/core/commands.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "model/data.h"
#include "model/step_fields.h"
#include "support/program.h"
#include "support/sample_records.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

class DescribedFields : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    app().document.clear();
    const fs::path folder = fs::temp_directory_path() / ("described-" + std::to_string(::getpid()));
    fs::create_directories(folder);
    test::SampleRecords samples;
    auto from = samples.document.begin("save");
    for (const AnyId id : samples.programs) samples.ids.push_back(id);
    for (const AnyId id : samples.ids) {
      const fs::path file =
          folder / (from->now().find(id)->name + std::string(io::extension(id.kind)));
      const auto saved = io::save(*from, id, file, {});
      ASSERT_TRUE(saved.ok()) << saved.error().sentence();
    }
    ASSERT_TRUE(from->commit().ok());
    for (const AnyId id : samples.ids) {
      const auto loaded =
          app().dispatch(session_, "file.load", {{"file", samples.document.now()->find(id)->file}});
      ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    }
    fs::remove_all(folder);
  }

  /// Sets what is there again.
  void expect_same(AnyId id, const std::string& path, const Value& value) {
    const auto before = app().document.now();
    const std::string digest = app().document.content_digest();
    const auto set =
        app().dispatch(session_, "record.set",
                       {{"id", Application::handle(id)}, {"path", path}, {"value", value}});
    const std::string where = before->describe(id) + ", " + path;
    EXPECT_TRUE(set.ok()) << where << ": " << set.error().sentence() << "\n" << value.text();
    EXPECT_EQ(app().document.content_digest(), digest)
        << where << " differs: "
        << text::join(
               model::differences(before->find(id)->body, app().document.now()->find(id)->body),
               ", ")
        << "\n"
        << value.text();
    if (app().document.now() != before) (void)app().dispatch(session_, "document.undo", {});
    ++sets_;
  }

  Session session_{"test"};
  std::size_t sets_ = 0;
};

TEST_F(DescribedFields, AreTakenBackByRecordSetWithoutAChange) {
  std::set<std::string> kinds;
  for (const AnyId id : app().document.now()->list()) {
    const auto now = app().document.now();
    const Map described = describe_record(*now, id);
    const model::Type& type = *model::info(id.kind).type;
    kinds.insert(std::string(to_string(id.kind)));
    for (const model::Field& f : type.fields) {
      if (f.is_read_only || f.type == &model::type_of<model::Parametric>()) continue;
      const Value* value = described.find(f.name);
      if (!value) continue;
      // A number by itself would take the place of its expression, which is described beside it.
      const Value* texts = described.find("expressions");
      const Value* text = texts ? texts->as_map()->find(f.name) : nullptr;
      expect_same(id, std::string(f.name), text ? *text : *value);
      // Elements have the form that they have in the list.
      const List* elements = value->as_list();
      if (!elements || f.type->shape != model::Shape::list) continue;
      if (f.name == "nodes") continue;  // the list knows what is in what
      for (std::size_t i = 0; i < elements->size(); ++i)
        expect_same(id, std::string(f.name) + "[" + std::to_string(i + 1) + "]", (*elements)[i]);
    }
  }
  for (const char* kind : {"material", "solid", "object", "robot", "trajectory", "world", "task"})
    EXPECT_TRUE(kinds.contains(kind)) << kind;
  EXPECT_GT(sets_, 150U);
}

// {} of Lua may be an empty list: where a table of fields is taken it is an empty one.
TEST_F(DescribedFields, AnEmptyListIsTakenAsATableWithoutFields) {
  ASSERT_TRUE(
      app()
          .dispatch(session_, "robot.create", {{"name", "bare"}, {"links", List{Map{{"a", 0.3}}}}})
          .ok());
  for (const Value& nothing : {Value(Map()), Value(List())}) {
    const auto done = app().dispatch(
        session_, "record.set", {{"id", "robot:bare"}, {"path", "base_mass"}, {"value", nothing}});
    EXPECT_TRUE(done.ok()) << done.error().sentence();
  }
}

/// "name, parent" of all fields that are not among the plain ones.
std::string own_forms(const model::Type& type, const io::PlainFields& plain) {
  std::string out;
  for (const model::Field& f : type.fields)
    if (!f.is_read_only && std::none_of(plain.begin(), plain.end(),
                                        [&](const model::Field* p) { return p->name == f.name; }))
      out += (out.empty() ? "" : ", ") + std::string(f.name);
  return out;
}

/// A value that files leave out would be lost, or make a file that cannot be read again.
TEST_F(DescribedFields, FieldsOfOtherKindsOfStepsAreRefusedAtEveryDoor) {
  const auto run = [&](const char* command, const Map& args) {
    return app().dispatch(session_, command, args);
  };
  const Map message{{"step", "message"}, {"text", "hello"}};
  const auto task = run("task.create", {{"name", "greet"}, {"steps", List{Value(message)}}});
  ASSERT_TRUE(task.ok()) << task.error().sentence();
  const auto fields = [&] {
    const auto all = run("record.describe", {{"id", *task}});
    return *all->as_map()->find("steps")->as_list()->front().as_map();
  };
  Map step = fields();
  step.set("speed", 0.5);
  Map twice = message;
  twice.set("speed", 0.5);
  const std::pair<const char*, Map> doors[] = {
      {"record.set", {{"id", *task}, {"path", "steps[1].speed"}, {"value", 0.5}}},
      {"record.set", {{"id", *task}, {"path", "steps[1]"}, {"value", step}}},
      {"record.set", {{"id", *task}, {"path", "steps"}, {"value", List{Value(step)}}}},
      {"record.create",
       {{"kind", "task"}, {"name", "other"}, {"fields", Map{{"steps", List{Value(step)}}}}}},
      {"task.set_step", {{"id", *task}, {"index", 1}, {"step", twice}}},
  };
  for (const auto& [command, args] : doors) {
    const auto set = run(command, args);
    ASSERT_FALSE(set.ok()) << command;
    EXPECT_NE(set.error().sentence().find("speed"), std::string::npos) << set.error().sentence();
  }
  const auto refused = run("record.set", {{"id", *task}, {"path", "steps[1].count"}, {"value", 2}});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("steps of kind message do not have"), std::string::npos)
      << refused.error().sentence();
  EXPECT_NE(refused.error().hint.find("Steps of kind repeat have it"), std::string::npos)
      << refused.error().hint;
  EXPECT_EQ(fields(), [&] {
    Map m = step;
    m.erase("speed");
    return m;
  }());
  // Each field of a step in steps of each kind: refused, or there again after saving and loading.
  const model::Type& type = model::type_of<model::TaskStep>();
  for (std::size_t kind = 0; kind < model::kStepWords.size(); ++kind) {
    model::TaskStep s;
    s.kind = static_cast<model::StepKind>(kind);
    EXPECT_TRUE(model::foreign_step_fields(s).empty()) << kind;
    s.speed = 0.5;
    s.text = "a";
    s.count = 7;
    const auto foreign = model::foreign_step_fields(s);
    EXPECT_EQ(foreign.size(), 3 - (s.kind == model::StepKind::move) -
                                  (s.kind == model::StepKind::message) -
                                  (s.kind == model::StepKind::repeat))
        << kind;
    for (const model::Field* f : foreign) EXPECT_EQ(f, type.field(f->name));
  }
}

TEST(FieldPlaces, ThePageNamesTheFieldsThatAreWrittenByHand) {
  io::PlainFields steps;  // of any kind
  for (std::size_t i = 0; i < model::kStepWords.size(); ++i)
    for (const model::Field* f : io::file_step_fields(static_cast<model::StepKind>(i)))
      if (!io::is_step_form(f->name)) steps.push_back(f);
  std::ifstream in(ROBOMOSP_SOURCE_DIR "/docs/developer/add_a_record_kind.md");
  const std::string page(std::istreambuf_iterator<char>(in), {});
  ASSERT_FALSE(page.empty());
  const auto expect_row = [&](const char* name, const model::Type& type,
                              const io::PlainFields& plain) {
    const std::string row = "| `" + std::string(name) + "` | " + own_forms(type, plain) + " |\n";
    EXPECT_NE(page.find(row), std::string::npos) << "the page lacks the row\n" << row;
  };
  expect_row("Link", model::type_of<model::Link>(), io::plain_link_fields());
  expect_row("TaskStep", model::type_of<model::TaskStep>(), steps);
  expect_row("TrajectorySegment", model::type_of<model::TrajectorySegment>(),
             io::plain_segment_fields());
  expect_row("SolidNode", model::type_of<model::SolidNode>(), io::plain_node_fields());
}

TEST(FieldPlaces, CommandsTakeEveryPlainFieldAsDeclared) {
  const auto expect_all = [](const char* type, const io::PlainFields& plain, auto&& schema_has) {
    for (const model::Field* f : plain)
      EXPECT_TRUE(schema_has(std::string(f->word_in_files()))) << type << " has no " << f->name;
  };
  const auto in_fields = [](const TypeTree& t) {
    return [&t](const std::string& name) { return find_param(t.fields, name) != nullptr; };
  };
  const auto in_cases = [](const TypeTree& t, std::string_view only) {
    return [&t, only](const std::string& name) {
      return std::all_of(t.cases.begin(), t.cases.end(), [&](const auto& c) {
        return (!only.empty() && c.first != only) || find_param(c.second, name) != nullptr;
      });
    };
  };
  expect_all("node", io::plain_node_fields(), in_cases(*named_type("node"), {}));
  for (std::size_t i = 0; i < model::kStepWords.size(); ++i)
    expect_all("step", io::file_step_fields(static_cast<model::StepKind>(i)),
               in_cases(*named_type("step"), model::kStepWords[i]));
  const TypeTree& link = *named_type("link");
  for (const model::Field* f : io::plain_link_fields()) {
    if (f->type->shape == model::Shape::structure) continue;  // its fields are arguments
    EXPECT_TRUE(in_fields(link)(std::string(f->name))) << "link has no " << f->name;
  }
}

}  // namespace
}  // namespace robomosp::ioci
