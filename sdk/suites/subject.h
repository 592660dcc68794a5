// SPDX-License-Identifier: Apache-2.0
// What the program of suites is run on, from its command line.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/conformance/all_providers.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp::suites {

struct Subject {
  std::string file;                  ///< the plugin
  std::set<std::string> suites;      ///< to be run; empty = all
  std::vector<RobotModel> models;    ///< mechanisms for solvers
  bool are_models_chosen = false;    ///< then a solver has to take each of them
  std::string dynamics;              ///< plugin with inverse dynamics; empty = none
  std::vector<std::string> runner;   ///< runs generated code; empty = none
  std::vector<std::string> samples;  ///< files of programs for languages
  std::string language;              ///< plugin that compiles programs for posts; empty = none
  std::string constructs;            ///< file of the catalogue that posts are tried with
  std::string work;                  ///< folder for files
  std::set<std::string> notes;       ///< why a suite that has providers here is not run
  std::set<std::string> found;       ///< suites that have providers here
};

[[nodiscard]] Subject& subject();

/// The suites that there are. A source registers its own by `const Suite here("retimer");`
[[nodiscard]] std::set<std::string>& known_suites();
struct Suite {
  explicit Suite(const char* name) { known_suites().insert(name); }
};

/// Names of the providers of an interface when `suite` is to be run on them.
template <class Interface>
[[nodiscard]] std::vector<std::string> providers_for(const std::string& suite) {
  Subject& s = subject();
  if (!s.suites.empty() && !s.suites.contains(suite)) return {};
  auto names = conformance::provider_names<Interface>(s.file.c_str());
  if (!names.empty()) s.found.insert(suite);
  return names;
}

/// Whether the tags of a provider, separated by commas, have this one.
template <class Interface>
[[nodiscard]] bool has_tag(const std::string& file, const std::string& provider,
                           std::string_view tag) {
  const auto found = conformance::find_provider<Interface>(file, provider);
  if (!found.ok() || !(*found)->tags) return false;
  const std::string_view tags = (*found)->tags;
  for (std::size_t from = 0; from <= tags.size();) {
    const std::size_t to = std::min(tags.find(',', from), tags.size());
    if (tags.substr(from, to - from) == tag) return true;
    from = to + 1;
  }
  return false;
}

/// `text` as a part of a test's name.
[[nodiscard]] inline std::string as_name(std::string text) {
  for (char& c : text)
    if (!((c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'))) c = '_';
  return text;
}

}  // namespace robomosp::suites
