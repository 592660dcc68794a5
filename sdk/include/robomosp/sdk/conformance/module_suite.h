// SPDX-License-Identifier: Apache-2.0
// What every module (robomosp.module/1) has to hold: tables that read well, and commands and hooks
// that answer or refuse whatever they are given (layer: contract helper for tests, header-only).
//
//   INSTANTIATE_TEST_SUITE_P(Mine, ModuleConformance,
//                            testing::Values(ModuleCase{"my_module.so", "my_module"}),
//                            module_case_name);
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/module.h>

namespace robomosp::conformance {

struct ModuleCase {
  std::string file;      ///< the plugin
  std::string provider;  ///< its name there
};
inline std::string module_case_name(const testing::TestParamInfo<ModuleCase>& info) {
  return info.param.provider;
}
inline void PrintTo(const ModuleCase& c, std::ostream* out) { *out << c.provider; }

/// A row of a table, whatever SDK its plugin was built with.
[[nodiscard]] inline rmp_param row_of(const ModuleFields& fields, std::uint32_t i) {
  rmp_provider table{};
  table.params = fields.rows;
  table.param_count = fields.count;
  table.param_size = fields.row_size;
  return rmp_param_at(table, i);
}
[[nodiscard]] inline ModuleCommand command_of(const ModuleTable& table, std::uint32_t i) {
  ModuleCommand row;
  std::memcpy(static_cast<void*>(&row),
              reinterpret_cast<const char*>(table.commands) +
                  static_cast<std::size_t>(i) * table.command_size,
              std::min<std::size_t>(table.command_size, sizeof row));
  return row;
}

/// A value that fits a row: its default, else something small.
[[nodiscard]] inline ModuleValue value_for(const rmp_param& row) {
  const std::string_view type = row.type;
  const std::string text = row.default_text ? TableParams::si_text(row.default_text) : "";
  const double number = row.default_text     ? std::strtod(text.c_str(), nullptr)
                        : row.min <= row.max ? row.min
                                             : 1.0;
  if (type == "bool") return ModuleValue(text == "true");
  if (type == "int") return ModuleValue(static_cast<std::int64_t>(number));
  if (type == "real") return ModuleValue(number);
  if (type == "real[]" || type == "vec3") return ModuleValue(std::vector<double>{0, 0, 0});
  if (type == "pose")
    return ModuleValue::matrix({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, 4, 4);
  if (type == "matrix") return ModuleValue::matrix({1, 0, 0, 1}, 2, 2);
  if (type == "list") return ModuleValue::list();
  if (type == "map") return ModuleValue::map();
  if (type.starts_with("ref:"))
    return ModuleValue::reference(std::string(type.substr(4, type.find('|') - 4)), 1);
  if (type == "enum" && !row.default_text)
    return ModuleValue(
        std::string_view(row.choices).substr(0, std::string_view(row.choices).find('|')));
  if (type == "any") return {};
  return ModuleValue(row.default_text ? row.default_text : "x");
}

/// A program that knows no other command, and one robot.
class LonelyCall final : public ModuleCall {
 public:
  LonelyCall(const ModuleTable& table, bool is_cancelled) : table_(table) {
    progress_.is_cancelled = is_cancelled;
  }
  Result<ModuleValue> run(std::string_view command, const ModuleValue&) override {
    return error(ErrorCode::unknown_name, "there is no command \"" + std::string(command) + "\"");
  }
  Result<ModuleValue> setting(std::string_view name) const override {
    for (std::uint32_t i = 0; i < table_.settings.count; ++i)
      if (const rmp_param row = row_of(table_.settings, i); name == row.name) return value_for(row);
    return error(ErrorCode::unknown_name, "there is no setting \"" + std::string(name) + "\"");
  }
  Result<std::string> name(const ModuleValue&) const override { return std::string("thing"); }
  Result<std::shared_ptr<const RobotModel>> robot_model(const ModuleValue&) override {
    return std::shared_ptr<const RobotModel>(std::make_shared<RobotModel>(puma560()));
  }
  Progress& progress() override { return progress_; }
  void say(std::int32_t, std::string_view) override {}
  std::string_view session() const override { return "suite"; }

 private:
  struct Stop final : Progress {
    void report(double, std::string_view) override {}
    bool cancelled() const override { return is_cancelled; }
    bool is_cancelled = false;
  };
  const ModuleTable& table_;
  Stop progress_;
};

class ModuleConformance : public testing::TestWithParam<ModuleCase> {
 protected:
  void SetUp() override {
    const auto provider = find_provider<Module>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(provider.ok()) << provider.error().sentence();
    module_ = create<Module>(**provider);
    ASSERT_TRUE(module_);
    table_ = &module_->table();
  }
  [[nodiscard]] static ModuleValue arguments(const ModuleCommand& c) {
    ModuleValue args = ModuleValue::map();
    for (std::uint32_t i = 0; i < c.params.count; ++i) {
      const rmp_param row = row_of(c.params, i);
      if (row.default_text || !(row.flags & RMP_OPTIONAL)) args.set(row.name, value_for(row));
    }
    return args;
  }
  /// Runs a command; what it threw, else "".
  std::string thrown_by(const ModuleCommand& c, bool is_cancelled) const {
    try {
      LonelyCall call(*table_, is_cancelled);
      const auto done = c.run(*module_, arguments(c), call);
      if (!done.ok() && done.error().message.empty()) return "an error without a sentence";
      return "";
    } catch (const std::exception& e) {
      return e.what();
    } catch (...) {
      return "something unknown";
    }
  }
  static void expect_rows(const ModuleFields& fields, const char* where) {
    ASSERT_TRUE(fields.count == 0 || fields.rows) << where;
    ASSERT_GE(fields.row_size, offsetof(rmp_param, flags)) << where;
    std::set<std::string> names;
    for (std::uint32_t i = 0; i < fields.count; ++i) {
      const rmp_param row = row_of(fields, i);
      ASSERT_TRUE(row.name && row.type && row.unit && row.doc) << where << " row " << i;
      EXPECT_TRUE(names.insert(row.name).second) << where << ": " << row.name << " twice";
      EXPECT_TRUE(*row.doc && row.doc[std::strlen(row.doc) - 1] == '.') << where << ": " << row.doc;
    }
  }

  std::unique_ptr<Module> module_;
  const ModuleTable* table_ = nullptr;
};

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ModuleConformance);

TEST_P(ModuleConformance, TablesReadWell) {
  const ModuleTable& t = *table_;
  EXPECT_EQ(&t, &module_->table()) << "constant data";
  ASSERT_TRUE(t.command_count == 0 || t.commands);
  expect_rows(t.settings, "settings");
  for (std::uint32_t i = 0; i < t.settings.count; ++i)
    EXPECT_TRUE(row_of(t.settings, i).default_text) << row_of(t.settings, i).name;
  EXPECT_EQ(t.runs & ~(kModuleRunSimulation | kModuleRunTask | kModuleRunJob), 0U);
  std::set<std::string> names;
  for (std::uint32_t i = 0; i < t.command_count; ++i) {
    const ModuleCommand c = command_of(t, i);
    ASSERT_TRUE(c.name && c.summary && c.details && c.example && c.effects && c.sometimes &&
                c.result_type && c.result_unit && c.result_doc && c.run)
        << "command " << i;
    EXPECT_TRUE(names.insert(c.name).second) << c.name << " twice";
    EXPECT_NE(std::string_view(c.name).find('.'), std::string_view::npos) << c.name;
    EXPECT_TRUE(*c.summary && c.summary[std::strlen(c.summary) - 1] == '.') << c.summary;
    EXPECT_TRUE(*c.example) << c.name;
    expect_rows(c.params, c.name);
    expect_rows(c.result_fields, c.name);
  }
}

TEST_P(ModuleConformance, EveryCommandAnswersOrRefuses) {
  for (std::uint32_t i = 0; i < table_->command_count; ++i) {
    const ModuleCommand c = command_of(*table_, i);
    EXPECT_EQ(thrown_by(c, false), "") << c.name;
  }
}

TEST_P(ModuleConformance, EveryCommandEndsSoonOnceCancelled) {
  for (std::uint32_t i = 0; i < table_->command_count; ++i) {
    const ModuleCommand c = command_of(*table_, i);
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(thrown_by(c, true), "") << c.name;
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2)) << c.name;
  }
}

TEST_P(ModuleConformance, CommandsRunSeveralAtOnce) {
  for (std::uint32_t i = 0; i < table_->command_count; ++i) {
    const ModuleCommand c = command_of(*table_, i);
    std::vector<std::string> thrown(4);
    std::vector<std::thread> threads;
    for (std::string& one : thrown) threads.emplace_back([&] { one = thrown_by(c, false); });
    for (std::thread& t : threads) t.join();
    EXPECT_EQ(thrown, std::vector<std::string>(4)) << c.name;
  }
}

TEST_P(ModuleConformance, HooksAnswerForRunsOfAnyKind) {
  for (const ModuleRun kind : {kModuleRunSimulation, kModuleRunTask, kModuleRunJob})
    for (const ModuleValue& id : {ModuleValue(), ModuleValue::reference("robot", 1),
                                  ModuleValue::reference("world", 2), ModuleValue("text")}) {
      const ModuleValue args = ModuleValue::map().set("id", id);
      ModuleRunNotice notice;
      notice.kind = kind;
      notice.number = 1;
      notice.command = "suite.run";
      notice.session = "suite";
      notice.arguments = &args;
      LonelyCall call(*table_, false);
      EXPECT_NO_THROW({
        const auto let = module_->before_run(notice, call);
        EXPECT_TRUE(let.ok() || !let.error().message.empty());
        const ModuleValue nothing;
        ModuleRunEnd end;
        end.error = let.ok() ? "" : "it was refused";
        end.result = &nothing;
        const auto heard = module_->after_run(notice, end, call);
        EXPECT_TRUE(heard.ok() || !heard.error().message.empty());
      });
    }
}

}  // namespace robomosp::conformance
