// SPDX-License-Identifier: Apache-2.0
#include <robomosp/sdk/conformance/language_suite.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "subject.h"

namespace robomosp::conformance {
namespace {

namespace fs = std::filesystem;

const suites::Suite here("language");

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The program of a file with what it names, and what that names.
LanguageSample sample_of(const Language& language, const fs::path& file) {
  LanguageSample out{file.filename().string(), {{file.filename().string(), text_of(file)}}};
  for (std::size_t i = 0; i < out.files.size() && i < 100; ++i) {
    const auto needs = language.needs({out.files[i].first, out.files[i].second, {}});
    if (!needs.ok()) continue;
    for (const std::string& name : *needs) {
      const bool is_known = std::any_of(out.files.begin(), out.files.end(),
                                        [&](const auto& f) { return f.first == name; });
      const fs::path beside = file.parent_path() / name;
      if (!is_known && fs::is_regular_file(beside)) out.files.emplace_back(name, text_of(beside));
    }
  }
  return out;
}

std::vector<LanguageCase> cases() {
  suites::Subject& s = suites::subject();
  std::vector<LanguageCase> all;
  for (const std::string& name : suites::providers_for<Language>("language")) {
    LanguageCase one{s.file, name, {}};
    const auto found = find_provider<Language>(s.file, name);
    for (const std::string& file : s.samples) {
      if (!fs::is_regular_file(file)) {
        s.notes.insert("There is no file \"" + file + "\".");
        continue;
      }
      if (found.ok()) one.samples.push_back(sample_of(*create<Language>(**found), file));
    }
    if (s.samples.empty())
      s.notes.insert("Languages were judged without a program of theirs: --sample gives one.");
    all.push_back(std::move(one));
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Plugin, LanguageConformance, testing::ValuesIn(cases()),
                         [](const auto& one) { return suites::as_name(one.param.provider); });

}  // namespace
}  // namespace robomosp::conformance
