// SPDX-License-Identifier: Apache-2.0
// What is derived from the declarations beside the records' structs: every field of every kind is
// found by its declaration, changed, and must be seen by the fingerprint, the differences, the file
// and describe; undo must bring its bits back.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

#include "document/digest.h"
#include "io/native.h"
#include "ioci/core/commands.h"
#include "kernel/text.h"
#include "model/controller.h"
#include "model/data.h"
#include "model/declare.h"
#include "support/field_walk.h"
#include "support/sample_records.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using document::Document;
using document::Snapshot;
using test::Leaf;
using test::SampleRecords;

/// Content with references by kind and name, so that equal content of two documents is equal.
Fingerprint content_of(const Snapshot& s, AnyId id) {
  Fingerprinter fp("content");
  fp.add(std::string_view(s.find(id)->name));
  document::feed(fp, s.find(id)->body, [&s](Fingerprinter& f, AnyId target) {
    const auto* record = s.find(target);
    f.add(to_string(target.kind)).add(std::string_view(record ? record->name : "none"));
  });
  return fp.finish();
}

/// Every number by its bits.
std::string bits_of(const Snapshot& s, AnyId id) {
  std::string out;
  for (const Leaf& leaf : test::leaves(s.find(id)->body)) {
    model::Body body = s.find(id)->body;
    const void* p = leaf.in(body);
    out += leaf.path + "=";
    if (leaf.type->shape == model::Shape::real || leaf.type->shape == model::Shape::numbers)
      out.append(static_cast<const char*>(p), leaf.type->size);
    out += "\n";
  }
  return out + document::record_fingerprint(*s.find(id)).hex();
}

struct EveryField : testing::Test {
  SampleRecords samples;
  fs::path folder = fs::temp_directory_path() / ("fields-" + std::to_string(::getpid()));
  std::vector<std::string> texts;
  std::vector<AnyId> targets;  ///< of references

  void SetUp() override {
    fs::create_directories(folder);
    auto tx = samples.document.begin("save");
    targets = samples.ids;
    targets.insert(targets.end(), samples.programs.begin(), samples.programs.end());
    for (const AnyId id : targets) {
      const std::string& name = tx->now().find(id)->name;
      const auto saved =
          io::save(*tx, id, folder / (name + std::string(io::extension(id.kind))), {});
      ASSERT_TRUE(saved.ok()) << saved.error().sentence();
    }
    ASSERT_TRUE(tx->commit().ok());
    texts = {"another",      "half_2", "1 + 2",        "rad", "",  "bore/2", "m",
             "bottom",       "part",   "rack",         "arm", "0", "home",   "camera",
             "time_optimal", "spare",  "bore - bore/2"};
  }
  void TearDown() override { fs::remove_all(folder); }

  /// What the file of the record becomes when it is loaded into another document.
  std::string read_back(AnyId id, std::string& text) {
    const auto now = samples.document.now();
    const fs::path file = now->find(id)->file;
    auto printed = io::print(*now, id, file, {});
    if (!printed.ok()) return printed.error().sentence();
    text = *printed;
    Document other;
    auto tx = other.begin("load");
    // Geometries stand beside the solid.
    auto loaded = io::load_text(*tx, text, file.string(), file.parent_path(), {});
    if (!loaded.ok()) return loaded.error().sentence();
    return content_of(tx->now(), loaded->id).hex();
  }
};

TEST_F(EveryField, IsSeenByFingerprintDifferencesFileAndDescribeAndUndoBringsItBack) {
  std::set<const model::Field*> done;
  std::map<const model::Field*, std::string> refusals;
  Document& d = samples.document;
  for (const AnyId id : samples.ids) {
    const auto before = d.now();
    const model::Body body = before->find(id)->body;
    std::string old_text;
    ASSERT_EQ(read_back(id, old_text), content_of(*before, id).hex()) << old_text;
    const std::string old_described = Value(ioci::describe_record(*before, id)).text();
    const std::string old_bits = bits_of(*before, id);
    for (const Leaf& leaf : test::leaves(body)) {
      SCOPED_TRACE(before->describe(id) + leaf.path);
      // A placement is one type and stands in many fields: each of these must be seen.
      bool is_new = std::any_of(leaf.way.begin(), leaf.way.end(), [&](const Leaf::Step& step) {
        return step.field && !done.contains(step.field);
      });
      for (const test::Change& change : test::changes(*leaf.type, texts, targets)) {
        model::Body changed = body;
        change(*leaf.type, leaf.in(changed));
        const bool is_same = model::equal(body, changed);
        model::Record a{"r", "", body}, b{"r", "", changed};
        EXPECT_EQ(document::record_fingerprint(a) == document::record_fingerprint(b), is_same);
        const auto differences = model::differences(body, changed);
        EXPECT_EQ(differences.empty(), is_same);
        if (is_same) continue;
        if (!is_new) break;  // the rest was seen for another value of the field
        auto tx = d.begin("change");
        const auto edited = tx->edit(id, [&](model::Record& r) -> Result<void> {
          r.body = changed;
          return {};
        });
        if (!edited.ok()) {
          refusals[leaf.field] = edited.error().sentence();
          continue;
        }
        const auto commit = tx->commit();
        if (!commit.ok()) {
          refusals[leaf.field] = commit.error().sentence();
          continue;
        }
        if (commit->changed.empty()) {  // an expression gave the number its value again
          refusals[leaf.field] = "the edit was dropped";
          continue;
        }
        std::string text;
        const std::string back = read_back(id, text);
        const std::string described = Value(ioci::describe_record(*d.now(), id)).text();
        const bool is_told = text != old_text && back == content_of(*d.now(), id).hex() &&
                             described != old_described;
        if (!is_told)
          refusals[leaf.field] =
              (text == old_text             ? "the file is the same"
               : described == old_described ? "describe is the same"
                                            : "read back: " + back + "\n" + text);
        ASSERT_TRUE(d.undo().ok());
        EXPECT_EQ(bits_of(*d.now(), id), old_bits);
        if (!is_told) continue;
        for (const Leaf::Step& step : leaf.way)  // what holds it is seen with it
          if (step.field) done.insert(step.field);
        is_new = false;
        break;
      }
    }
  }
  for (const Kind kind : all_kinds().first(kNamedKinds)) {  // others are those of other tests
    std::vector<std::pair<const model::Field*, std::string>> all;
    test::declared(*model::info(kind).type, std::string(to_string(kind)), all);
    for (const auto& [field, name] : all) {
      // Form and digest of a geometry follow from its content, which is no field.
      // The unit of an axis is that of its joint, and changes with it alone (maker_axes_test).
      EXPECT_TRUE(field->is_read_only || name == "robot.axes.unit" || done.contains(field))
          << name << ": " << (refusals.contains(field) ? refusals[field] : "no sample has it");
    }
  }
}

TEST(Declarations, SayWhatEachFieldIs) {
  for (const Kind kind : all_kinds()) {
    std::vector<std::pair<const model::Field*, std::string>> all;
    test::declared(*model::info(kind).type, std::string(to_string(kind)), all);
    for (const auto& [field, name] : all) {
      EXPECT_TRUE(field->sentence.ends_with('.')) << name;
      EXPECT_LE(field->min, field->max) << name;
      const bool is_word = field->type->shape == model::Shape::word;
      EXPECT_TRUE(!is_word || !field->type->words.empty()) << name;
    }
  }
}

TEST(Declarations, NoTwoFieldsOfAStructShareAWordInFiles) {
  (void)model::register_kind_of<model::Controller>("controller", ".ctl", "controllers");
  std::set<const model::Type*> seen;
  const std::function<void(const model::Type&, const std::string&)> look =
      [&](const model::Type& t, const std::string& name) {
        if (t.element) return look(*t.element, name);
        if (!seen.insert(&t).second) return;
        std::set<std::string_view> words;
        for (const model::Field& f : t.fields) {
          EXPECT_TRUE(words.insert(f.word_in_files()).second) << name << ": " << f.word_in_files();
          look(*f.type, name + "." + std::string(f.name));
        }
      };
  // The others have files of their own.
  for (const Kind kind : all_kinds().subspan(kNamedKinds))
    look(*model::info(kind).type, std::string(to_string(kind)));
}

/// All fields of a controller have another value than the usual one, and come back.
TEST(ControllerFile, HasEveryFieldOfAControllerAndIsReadBack) {
  const Kind kind = model::register_kind_of<model::Controller>("controller", ".ctl", "controllers");
  model::Controller c;
  c.description = "cell 3";
  c.target = "krl";
  c.program = "MAIN";
  c.axes = {{"A1", 2, true, true, -1, 5, 1000, -10, 10}};
  c.signals = {{"grip", "$OUT", 17, "hand", true}};
  c.tools.resize(2);
  c.tools[0].name = "hand";
  c.tools[1] = {"torch", 3, {}, 2.5};
  c.tools[1].placement.position = {0.1, 0.2, 0.3};
  c.frames = c.tools;
  c.frames[1].mass = 0;
  c.tool = "torch";
  c.frame = "hand";
  c.prologue = {"ABC", "a longer line than fits into a string itself"};
  c.epilogue = {"X", ""};
  c.length_digits = 1;
  c.angle_digits = 2;
  c.speed_digits = 5;
  c.max_points = 10;
  c.max_lines = 20;
  c.max_bytes = 30;
  c.max_speed = 0.5;
  c.max_speed_ori = 1.5;
  c.options = {{"acc_cp", "1.5"}};
  c.parametric.parameters = {{"step", "", "m", 1, "in two seconds"}};
  c.parametric.expressions = {{"max_speed", "step / (2 s)"}};
  const model::Controller usual;
  const model::Body body = model::OtherContent(kind, c), plain = model::OtherContent(kind, usual);
  // Parameters and expressions are one field, and differ each by itself.
  EXPECT_EQ(model::differences(body, plain).size(), model::info(kind).type->fields.size() + 1);
  const auto read = [&](const std::string& text) {
    Document d;
    auto tx = d.begin("load");
    auto loaded = io::load_text(*tx, text, "cell.ctl", fs::temp_directory_path(), {});
    EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : loaded.error().sentence()) << "\n" << text;
    return loaded.ok() ? tx->now().find(loaded->id)->body : model::Body{};
  };
  Document d;
  auto tx = d.begin("add");
  const auto id = tx->add({"cell", "", body});
  ASSERT_TRUE(id.ok()) << id.error().sentence();
  const auto text = io::print(tx->now(), *id, "cell.ctl", {});
  ASSERT_TRUE(text.ok()) << text.error().sentence();
  EXPECT_NE(text->find("default_tool \"torch\""), std::string::npos) << *text;
  const auto back = read(*text);
  EXPECT_TRUE(model::equal(back, body)) << *text << text::join(model::differences(back, body), " ");
  // As they were written before the chosen ones had words of their own.
  const auto old = read("robomosp controller 1\nname cell\ntarget \"krl\"\ntool hand { }\n");
  EXPECT_EQ(std::get<model::OtherContent>(old).as<model::Controller>().tools.size(), 1U);
}

TEST(Differences, NameThePathsOfWhatDiffers) {
  model::Body a = SampleRecords::a_closed_robot(), b = a;
  EXPECT_TRUE(model::differences(a, b).empty());
  std::get<model::Robot>(b).links[1].drive.viscous = 3;
  std::get<model::Robot>(b).tool.position[2] = 1;
  EXPECT_EQ(model::differences(a, b),
            (std::vector<std::string>{"links[2].drive.viscous", "tool.position"}));
  std::get<model::Robot>(b).links.pop_back();
  EXPECT_EQ(model::differences(a, b), (std::vector<std::string>{"links", "tool.position"}));
  EXPECT_EQ(model::differences(a, model::Material{}), std::vector<std::string>{""});
}

}  // namespace
}  // namespace robomosp
