// SPDX-License-Identifier: Apache-2.0
// robomosp-plugin-suites FILE [options] [GoogleTest options]: runs the suites of the SDK on every
// provider of one plugin file. Exit code 0 all passed, 1 something failed, 2 wrong usage, 3 nothing
// was judged: there is no suite for what the plugin offers, or all tests of a provider were
// skipped.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/all_models.h>
#include <robomosp/sdk/conformance/count_allocations.h>
#include <robomosp/sdk/model_file.h>

#include "subject.h"

namespace robomosp::suites {

Subject& subject() {
  static Subject s;
  return s;
}

std::set<std::string>& known_suites() {
  static std::set<std::string> known;
  return known;
}

namespace {

constexpr const char* kUsage =
    "usage: robomosp-plugin-suites FILE [options] [GoogleTest options]\n"
    "  --suite NAME      run this suite only (may be repeated)\n"
    "  --models A,B,...  mechanisms of robomosp/sdk/conformance/all_models.h for solvers,\n"
    "                    puma560,pa10 by default\n"
    "  --model FILE      a mechanism from a file of robot.save_model (may be repeated)\n"
    "  --dynamics FILE   plugin whose inverse dynamics controllers ask, and forward dynamics\n"
    "                    that have no inverse are compared with\n"
    "  --runner WORD     command that runs generated code, a word each (may be repeated)\n"
    "  --sample FILE     a program without errors for languages (may be repeated); what it names\n"
    "                    is taken from its folder\n"
    "  --language FILE   plugin whose language compiles the programs that posts are judged by\n"
    "  --constructs FILE catalogue of these programs: share/robomosp/post_test/constructs.txt\n";

int wrong(const std::string& what) {
  std::fprintf(stderr, "%s\n%s", what.c_str(), kUsage);
  return 2;
}

/// Reads the options that are ours; the rest stays for GoogleTest. 0 or an exit code.
int read(int argc, char** argv, std::vector<char*>& rest) {
  Subject& s = subject();
  rest = {argv[0]};
  if (argc < 2) return wrong("Which plugin file?");
  s.file = argv[1];
  for (int i = 2; i < argc; ++i) {
    std::string word = argv[i];
    if (word.rfind("--gtest", 0) == 0) {
      rest.push_back(argv[i]);
      continue;
    }
    std::string value;
    if (const std::size_t equals = word.find('='); equals != std::string::npos) {
      value = word.substr(equals + 1);
      word.resize(equals);
    } else if (++i < argc) {
      value = argv[i];
    } else {
      return wrong("\"" + word + "\" needs a value, or is no option.");
    }
    if (word == "--suite") {
      if (!known_suites().contains(value)) {
        std::string all;
        for (const std::string& known : known_suites()) all += (all.empty() ? "" : ", ") + known;
        return wrong("There is no suite \"" + value + "\"; there are " + all + ".");
      }
      s.suites.insert(value);
    } else if (word == "--models") {
      s.are_models_chosen = true;
      std::istringstream names(value);
      for (std::string name; std::getline(names, name, ',');) {
        auto model = conformance::named_model(name);
        if (!model) return wrong("There is no mechanism \"" + name + "\".");
        s.models.push_back(std::move(*model));
      }
    } else if (word == "--model") {
      s.are_models_chosen = true;
      auto model = read_model(value);
      if (!model.ok()) return wrong(model.error().sentence());
      s.models.push_back(std::move(model).value());
    } else if (word == "--dynamics") {
      s.dynamics = value;
    } else if (word == "--runner") {
      s.runner.push_back(value);
    } else if (word == "--sample") {
      s.samples.push_back(value);
    } else if (word == "--language") {
      s.language = value;
    } else if (word == "--constructs") {
      s.constructs = value;
    } else {
      return wrong("\"" + word + "\" is no option.");
    }
  }
  if (!s.are_models_chosen) s.models = {conformance::puma560(), conformance::pa10()};
  std::map<std::string, int> names;  // two robots of one name have to be told apart
  for (RobotModel& m : s.models)
    if (const int n = ++names[m.name]; n > 1) m.name += " " + std::to_string(n);
  std::error_code failed;
  s.work = (std::filesystem::temp_directory_path(failed) /
            ("robomosp-suites-" + std::to_string(::getpid())))
               .string();
  return 0;
}

/// rmp_host::run for providers that start programs such as a compiler: within the time given.
std::int32_t run_for_provider(const rmp_program* p, char* error, std::uint32_t error_size) {
  std::vector<char*> words{const_cast<char*>(p->name)};
  for (std::uint32_t i = 0; i < p->argument_count; ++i)
    words.push_back(const_cast<char*>(p->arguments[i]));
  words.push_back(nullptr);
  FILE* input = std::tmpfile();
  FILE* output = std::tmpfile();
  bool is_well = input && output &&
                 std::fwrite(p->input, 1, p->input_size, input) == p->input_size &&
                 std::fflush(input) == 0;
  if (is_well) {
    std::rewind(input);
    const pid_t child = ::fork();
    if (child == 0) {
      ::dup2(::fileno(input), 0);
      ::dup2(::fileno(output), 1);
      ::execvp(words[0], words.data());
      ::_exit(127);
    }
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::duration<double>(p->seconds > 0 ? p->seconds : 60);
    int status = -1;
    while (child > 0 && ::waitpid(child, &status, WNOHANG) == 0) {
      if (Clock::now() > end) ::kill(child, SIGKILL);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    is_well = child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }
  if (is_well && p->output) {
    std::string said;
    char part[4096];
    std::rewind(output);
    while (const std::size_t n = std::fread(part, 1, sizeof part, output)) said.append(part, n);
    p->output(p->context, said.data(), said.size());
  }
  if (input) std::fclose(input);
  if (output) std::fclose(output);
  if (!is_well) std::snprintf(error, error_size, "the program %s failed", p->name);
  return is_well ? 0 : 2;
}

/// Of each suite and provider: how many tests ran, and how many of them were skipped.
std::map<std::string, std::pair<int, int>> counts() {
  std::map<std::string, std::pair<int, int>> out;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int k = 0; k < suite.total_test_count(); ++k) {
      const testing::TestInfo& test = *suite.GetTestInfo(k);
      if (!test.should_run() || !test.value_param()) continue;
      const std::string who = test.value_param();
      std::string name = suite.name();
      name.erase(0, name.find('/') + 1);
      auto& [ran, skipped] = out[name + " on " + who.substr(0, who.find(' '))];
      ++ran;
      if (test.result()->Skipped()) ++skipped;
    }
  }
  return out;
}

int judge(int failed) {
  bool is_all_judged = true;
  for (const std::string& suite : subject().suites)
    if (!subject().found.contains(suite))
      subject().notes.insert("The plugin offers nothing that the suite \"" + suite + "\" judges.");
  for (const std::string& note : subject().notes) {
    std::fprintf(stderr, "%s\n", note.c_str());
    is_all_judged = false;
  }
  for (const auto& [what, numbers] : counts())
    if (numbers.first == numbers.second) {
      std::fprintf(stderr, "Nothing was judged by %s: all %d tests were skipped.\n", what.c_str(),
                   numbers.first);
      is_all_judged = false;
    }
  if (failed) return 1;
  if (!is_all_judged) return 3;
  if (testing::UnitTest::GetInstance()->test_to_run_count() > 0) return 0;
  std::fputs(
      "There is no suite here for what this plugin offers. The suites of curves, motion laws, "
      "orientations and segments need cases of your own: see robomosp/sdk/conformance.\n",
      stderr);
  return 3;
}

}  // namespace
}  // namespace robomosp::suites

int main(int argc, char** argv) {
  std::vector<char*> rest;
  robomosp::conformance::host().run = &robomosp::suites::run_for_provider;
  if (const int code = robomosp::suites::read(argc, argv, rest)) return code;
  int count = static_cast<int>(rest.size());
  rest.push_back(nullptr);
  testing::InitGoogleTest(&count, rest.data());
  if (count > 1) return robomosp::suites::wrong("\"" + std::string(rest[1]) + "\" is no option.");
  const int failed = RUN_ALL_TESTS();
  std::error_code ignored;
  std::filesystem::remove_all(robomosp::suites::subject().work, ignored);
  return GTEST_FLAG_GET(list_tests) ? 0 : robomosp::suites::judge(failed);
}
