// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.language/1 (layer: contract helper for tests, GoogleTest,
// header-only): whatever a source is, there are tables that can be followed, faults in range, and
// the same answer again. Include it in one file of a test program and instantiate
// LanguageConformance with LanguageCase values.
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/language.h>
#include <robomosp/sdk/program_tables.h>

namespace robomosp::conformance {

/// A program in the language: its files, the program first.
struct LanguageSample {
  std::string name;  ///< of the sample
  std::vector<std::pair<std::string, std::string>> files;
};
struct LanguageCase {
  std::string file, provider;
  std::vector<LanguageSample> samples;  ///< programs without errors; may be empty
};
inline void PrintTo(const LanguageCase& c, std::ostream* os) { *os << c.provider; }

class LanguageConformance : public testing::TestWithParam<LanguageCase> {
 protected:
  void SetUp() override {
    auto found = find_provider<Language>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    language_ = create<Language>(**found);
    params_ = TableParams(**found);
  }
  Result<std::unique_ptr<CompiledProgram>> compile(
      const std::vector<std::pair<std::string, std::string>>& files) const {
    std::vector<SourceFile> all;
    for (const auto& [name, text] : files) all.push_back({name, text, {}});
    LanguageTask task;
    task.files = all;
    NoProgress none;
    return language_->compile(task, params_, none);
  }
  /// What a reader of the tables relies on, for a program right or wrong.
  static void expect_sound(const rmp_code& c) {
    ASSERT_GE(c.struct_size, sizeof(rmp_code));
    ASSERT_NE(c.name, nullptr);
    bool has_error = false;
    for (std::uint32_t i = 0; i < c.faults.count; ++i) {
      const auto& f = row<rmp_code_fault>(c.faults, i);
      has_error = has_error || f.severity == RMP_FAULT_ERROR;
      EXPECT_LE(f.severity, static_cast<std::uint32_t>(RMP_FAULT_NOTE));
      ASSERT_LT(f.span.file, c.files.count) << f.message;
      EXPECT_GE(f.span.line, 1U) << f.message;
      EXPECT_GE(f.span.column, 1U) << f.message;
      EXPECT_LE(f.span.begin, f.span.end) << f.message;
      const std::string_view said = f.message;
      EXPECT_FALSE(said.empty());
      EXPECT_FALSE(said.ends_with('.')) << "a message has no trailing period: " << said;
    }
    EXPECT_EQ(has_error, c.has_errors != 0);
    if (c.has_errors) {
      EXPECT_EQ(c.instructions.count, 0U) << "a program with errors has no code";
      return;
    }
    ASSERT_GE(c.routines.count, 1U);
    ASSERT_GT(c.types.count, static_cast<std::uint32_t>(RMP_TYPE_PROCESS));
    for (std::uint32_t t = 0; t <= RMP_TYPE_PROCESS; ++t)
      EXPECT_EQ(row<rmp_code_type>(c.types, t).kind, t);
    for (std::uint32_t i = 0; i < c.expressions.count; ++i) {
      const auto& e = row<rmp_code_expression>(c.expressions, i);
      for (std::uint32_t k = 0; k < e.count; ++k)
        ASSERT_LT(row<std::uint32_t>(c.links, e.first + k), i) << "operands come before";
    }
    // Its code equals its text form, which is read back with its own checks.
    const std::string text = code_text(c);
    const auto again = read_code_text(text);
    ASSERT_TRUE(again.ok()) << again.error().sentence();
    EXPECT_EQ(code_text((*again)->code()), text);
  }
  std::shared_ptr<Language> language_;
  TableParams params_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LanguageConformance);

TEST_P(LanguageConformance, SaysWhichFilesAreItsOwn) {
  const std::string_view all = language_->extensions();
  EXPECT_FALSE(all.empty());
  for (const char c : all)
    EXPECT_TRUE((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == ',' || c == '_')
        << "extensions are lower-case, without dots, separated by commas: " << all;
}

TEST_P(LanguageConformance, WhatIsNoProgramIsAFaultAndNoFailure) {
  std::mt19937 random(7);
  std::vector<std::string> texts{"",
                                 "\n",
                                 " \t\r\n",
                                 std::string(1, '\0'),
                                 "'",
                                 "{",
                                 "(",
                                 "\"",
                                 "\xff\xfe",
                                 std::string(100'000, '('),
                                 std::string(100'000, 'a')};
  for (int n = 0; n < 50; ++n) {
    std::string s(random() % 400, ' ');
    for (char& c : s) c = static_cast<char>(n % 2 ? random() % 256 : 32 + random() % 95);
    texts.push_back(std::move(s));
  }
  for (const std::string& text : texts) {
    const auto made = compile({{"x", text}});
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    ASSERT_NE(*made, nullptr);
    expect_sound((*made)->code());
    const auto needs = language_->needs({"x", text, {}});
    if (!needs.ok()) continue;
    for (const std::string& name : *needs) EXPECT_FALSE(name.empty());
  }
}

TEST_P(LanguageConformance, SamplesAreProgramsAndPiecesOfThemAreNoFailure) {
  if (GetParam().samples.empty()) GTEST_SKIP() << "no sample of the language is given";
  std::mt19937 random(11);
  for (const LanguageSample& sample : GetParam().samples) {
    const auto made = compile(sample.files);
    ASSERT_TRUE(made.ok()) << sample.name << ": " << made.error().sentence();
    const rmp_code& c = (*made)->code();
    for (std::uint32_t i = 0; i < c.faults.count; ++i) {
      const auto& f = row<rmp_code_fault>(c.faults, i);
      EXPECT_NE(f.severity, static_cast<std::uint32_t>(RMP_FAULT_ERROR))
          << sample.name << ":" << f.span.line << ": " << f.message;
    }
    expect_sound(c);
    EXPECT_GT(c.instructions.count, 0U) << sample.name;
    // Cut anywhere, with bytes changed, and with pieces twice.
    for (int n = 0; n < 60; ++n) {
      auto files = sample.files;
      std::string& text = files[0].second;
      if (text.empty()) continue;
      const std::size_t at = random() % text.size(), size = random() % 30;
      if (n % 3 == 0) text.resize(at);
      if (n % 3 == 1) text[at] = static_cast<char>(random() % 256);
      if (n % 3 == 2) text.insert(at, text.substr(random() % text.size(), size));
      const auto other = compile(files);
      ASSERT_TRUE(other.ok()) << other.error().sentence();
      expect_sound((*other)->code());
    }
  }
}

TEST_P(LanguageConformance, EqualSourcesGiveEqualCodeOnAnyThread) {
  if (GetParam().samples.empty()) GTEST_SKIP() << "no sample of the language is given";
  for (const LanguageSample& sample : GetParam().samples) {
    const auto first = compile(sample.files);
    ASSERT_TRUE(first.ok()) << first.error().sentence();
    const std::string expected = code_text((*first)->code());
    std::vector<std::string> all(4);
    at_once(all.size(), [&](std::size_t thread) {
      const auto made = compile(sample.files);
      all[thread] = made.ok() ? code_text((*made)->code()) : made.error().sentence();
    });
    for (const std::string& one : all) EXPECT_EQ(one, expected) << sample.name;
  }
}

}  // namespace robomosp::conformance
