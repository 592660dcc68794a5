// SPDX-License-Identifier: Apache-2.0
// Every ```lua block of the documentation is typed into a console, block after block, one session a
// page; a ```text block after it is what the console must answer. What is meant to end in an error
// says so by a comment `-- refused`; any other error is a fault of the page. A first line `-- not
// run` exempts a block (for blocks that only show a shape). With ROBOMOSP_UPDATE_DOCS=1 the answers
// are written into the page instead: read them before you commit.
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "kernel/text.h"
#include "lua/lua_state.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

struct Block {
  std::string language, body;
  int line = 0;  ///< of the body's first line, from 1
};

std::vector<Block> blocks_of(const fs::path& page) {
  std::ifstream in(page);
  EXPECT_TRUE(in) << page;
  std::vector<Block> blocks;
  std::string line;
  int number = 0;
  bool inside = false;
  while (std::getline(in, line)) {
    ++number;
    if (line.starts_with("```")) {
      if (!inside)
        blocks.push_back(
            {std::string(text::trim(std::string_view(line).substr(3))), "", number + 1});
      inside = !inside;
    } else if (inside) {
      blocks.back().body += line + "\n";
    }
  }
  EXPECT_FALSE(inside) << page << " ends inside a block";
  return blocks;
}

/// Lines without trailing blanks and without empty lines at the end.
std::string tidy(const std::string& s) {
  std::string out;
  std::istringstream in(s);
  for (std::string line; std::getline(in, line);) {
    while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.pop_back();
    out += line + "\n";
  }
  while (out.ends_with("\n\n")) out.pop_back();
  return out == "\n" ? "" : out;
}

/// The page with the bodies of some blocks replaced.
void rewrite(const fs::path& page, const std::vector<Block>& blocks) {
  std::ifstream in(page);
  std::string out;
  std::size_t next = 0;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("```")) {
      if (!inside) {
        out += line + "\n" + blocks[next++].body;
      } else {
        out += line + "\n";
      }
      inside = !inside;
    } else if (!inside) {
      out += line + "\n";
    }
  }
  in.close();
  std::ofstream(page, std::ios::trunc) << out;
}

class Page : public ::testing::TestWithParam<std::string> {};

TEST_P(Page, DoesWhatItShows) {
  const auto folder = fs::temp_directory_path() / ("robomosp-docs-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  fs::current_path(folder);                        // pages write files by relative names
  ::setenv("XDG_CONFIG_HOME", folder.c_str(), 1);  // what pages choose for good
  auto app =
      ioci::Application::create({.plugin_path = {ROBOMOSP_PLUGIN_DIR},
                                 .library = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"}});
  ASSERT_TRUE(app.ok()) << app.error().sentence();
  ioci::Session session("docs");
  std::string printed;
  lua::LuaState lua(**app, session,
                    {.print = [&](std::string_view s) { printed += s; },
                     .module_path = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/lib"}});
  auto blocks = blocks_of(fs::path(ROBOMOSP_SOURCE_DIR) / GetParam());
  const bool update = std::getenv("ROBOMOSP_UPDATE_DOCS") != nullptr;
  const bool draws = !(*app)->registry.list("robomosp.renderer/2").empty();
  int ran = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Block& block = blocks[b];
    if (block.language != "lua" || block.body.starts_with("-- not run")) continue;
    // A build without the viewer has nothing that draws.
    if (!draws && block.body.find(":render{") != std::string::npos) continue;
    ++ran;
    std::string answer, input;
    std::istringstream lines(block.body);
    const std::string where = GetParam() + ":" + std::to_string(block.line);
    for (std::string line; std::getline(lines, line);) {
      input += line + "\n";
      if (text::trim(input).empty() || lua.is_incomplete(input)) continue;
      printed.clear();
      auto result = lua.eval(input);
      answer += printed;
      if (result.ok()) answer += *result + (result->empty() || result->ends_with('\n') ? "" : "\n");
      else answer += "error: " + result.error().sentence() + "\n";
      EXPECT_EQ(!result.ok(), input.find("-- refused") != std::string::npos)
          << where << ": an error is marked by \"-- refused\", and nothing else is\n"
          << input << answer;
      input.clear();
    }
    EXPECT_TRUE(text::trim(input).empty()) << where << ": the block ends inside a statement";
    const bool has_answer = b + 1 < blocks.size() && blocks[b + 1].language == "text";
    if (has_answer && update) blocks[b + 1].body = tidy(answer);
    else if (has_answer) EXPECT_EQ(tidy(answer), tidy(blocks[b + 1].body)) << where;
    else EXPECT_EQ(answer.find("error: "), std::string::npos) << where << "\n" << answer;
  }
  EXPECT_GT(ran, 0);
  for (const Message& m : (*app)->messages.recent(1000))
    EXPECT_NE(m.code, "hidden_name") << GetParam() << ": " << m.text;
  if (update) rewrite(fs::path(ROBOMOSP_SOURCE_DIR) / GetParam(), blocks);
  fs::current_path(fs::temp_directory_path());
  fs::remove_all(folder);
}

/// Pages with code for a server, which tests/clients runs.
const std::set<std::string> kOfClients{"docs/user/remote/student.md"};

/// All pages that have a block that is run.
std::vector<std::string> pages_with_code() {
  const fs::path root(ROBOMOSP_SOURCE_DIR);
  std::vector<std::string> out{"README.md"};
  for (const char* folder : {"docs/user", "docs/plugin_author"})
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string page = fs::relative(entry.path(), root).generic_string();
      if (entry.path().extension() != ".md" || kOfClients.contains(page)) continue;
      for (const Block& b : blocks_of(entry.path()))
        if (b.language == "lua" && !b.body.starts_with("-- not run")) {
          out.push_back(page);
          break;
        }
    }
  std::sort(out.begin() + 1, out.end());
  return out;
}

TEST(Pages, ThePageOfPluginsNamesEveryInterfaceOfTheSdkAndNoOther) {
  const std::regex id("robomosp\\.[a-z_.]+/[0-9]+");
  const auto ids_of = [&id](const fs::path& file) {
    std::ifstream in(file);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    return std::set<std::string>(std::sregex_token_iterator(text.begin(), text.end(), id),
                                 std::sregex_token_iterator());
  };
  std::set<std::string> known;
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) / "sdk/include"))
    if (entry.is_regular_file()) known.merge(ids_of(entry.path()));
  EXPECT_GT(known.size(), 20U);
  const auto named = ids_of(fs::path(ROBOMOSP_SOURCE_DIR) / "docs/plugin_author/README.md");
  for (const std::string& one : known) EXPECT_TRUE(named.contains(one)) << one << " is missing";
  for (const std::string& one : named) EXPECT_TRUE(known.contains(one)) << one << " is none";
}

/// A sentence that claims that something is missing or impossible.
const std::regex kAbsent(
    "Not yet|such \\w+ yet|cannot [^.]{0,40} yet|no command (for|that|to) |"
    "(is|are) not (written|supported|possible|implemented|available|there|planned|made|read|served)"
    "[^.]{0,40} yet|"
    "(You|Programs|Robots) cannot [a-z]+ |[Dd]erivatives of [a-z ]+ are not ");

/// Claims of absence grow stale: each has, in its section, a block that is refused (and is run
/// above), or a comment `<!-- absent: world.plan_paths, world.plan_path.keep_orientation -->` with
/// the commands or arguments that would make it untrue.
TEST(Pages, ClaimsOfAbsenceHoldInTheTableOfCommands) {
  ioci::CommandTable table;
  ioci::register_commands(table);
  int claims = 0;
  for (const char* folder : {"docs/user", "docs/plugin_author"})
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".md") continue;
      std::ifstream in(entry.path());
      std::vector<std::string> open;  // of this section, "line: sentence"
      bool inside = false, is_refused = false, is_checked = false;
      int number = 0;
      const auto end_section = [&] {
        claims += static_cast<int>(open.size());
        for (const std::string& claim : open)
          EXPECT_TRUE(is_refused || is_checked)
              << entry.path() << ":" << claim
              << "\nshow it by a block with -- refused, or name the "
              << "commands that would make it untrue: <!-- absent: NAME -->";
        open.clear();
        is_refused = is_checked = false;
      };
      for (std::string line; std::getline(in, line);) {
        ++number;
        if (line.starts_with("```")) inside = !inside;
        else if (inside) is_refused = is_refused || line.find("-- refused") != std::string::npos;
        if (inside || line.starts_with("```")) continue;
        if (line.starts_with("#")) end_section();
        if (std::regex_search(line, kAbsent)) open.push_back(std::to_string(number) + ": " + line);
        constexpr std::string_view kMark = "<!-- absent: ";
        if (!line.starts_with(kMark)) continue;
        is_checked = true;
        const std::string_view names =
            std::string_view(line).substr(kMark.size(), line.find(" -->") - kMark.size());
        for (const std::string_view each : text::split(names, ',')) {
          const std::string name(text::trim(each));
          const auto dot = name.rfind('.');
          const ioci::CommandSpec* of = table.find(name.substr(0, dot));
          const bool is_argument =
              of && std::any_of(of->params.begin(), of->params.end(), [&](const ParamSpec& param) {
                return param.name == name.substr(dot + 1);
              });
          EXPECT_FALSE(table.find(name) || is_argument)
              << entry.path() << ":" << number << " says that there is no " << name
              << ", and there is";
        }
      }
      end_section();
    }
  EXPECT_GE(claims, 5) << "the words of claims are not found any more";
}

/// A construct, by the names that pages give it, and a program that has it.
struct Construct {
  std::vector<std::string> names;
  const char* variables;
  const char* statements;
  const char* routines = "";
};

const std::vector<Construct>& constructs() {
  static const std::vector<Construct> kAll{
      {{"lists"}, "LIST OF INT: l;", "LIST_ADD(l, 1); IF SIZEOF(l) > 1 THEN r := 1.0; ENDIF;"},
      {{"files"}, "FILE: f;", "OPEN(f, 'a.txt', 'W'); WRITELN(f, 1); CLOSE(f);"},
      {{"functions of strings", "strings"},
       "STRING: s := 'a';",
       "IF go THEN s := CONCAT(s, 'b'); ENDIF; IF s = 'ab' THEN r := 1.0; ENDIF;"},
      {{"parallel processes"},
       "",
       "START other; WAIT 1.0 SEC;",
       "PROCESS other; BEGIN done := TRUE; ENDPROCESS;"},
      {{"interrupts"},
       "",
       "ENABLE stopper; MOVE LIN p2;",
       "INTERRUPT stopper WHEN go; BEGIN done := TRUE; ENDINTERRUPT;"},
      {{"semaphores"}, "SEMAPHORE: s := 1;", "ACQUIRE(s); RELEASE(s);"},
      {{"weaving"}, "", "MOVE LIN p2 WOBBLE := TRUE;"},
      {{"TIME"}, "", "MOVE LIN p2 TIME := 2.0;"},
      {{"UNTIL"}, "", "MOVE LIN p2 UNTIL go;"},
      {{"circles"}, "", "MOVE CIRCLE p2, p3;"},
      {{"analogue signals"}, "", "level := 0.5;"},
      {{"GOTO"}, "INT: k;", "IF go THEN GOTO last; ENDIF; MOVE PTP p2; LABEL last: k := 1;"},
      {{"EXIT"}, "", "LOOP MOVE PTP p2; IF NOT go THEN EXIT; ENDIF; ENDLOOP;"},
      {{"CASE"}, "INT: k;", "IF go THEN k := 1; ENDIF; CASE k OF WHEN 1: MOVE PTP p2; ENDCASE;"},
      {{"PAUSE"}, "", "PAUSE;"},
      {{"ROUND"},
       "INT: k;",
       "IF go THEN r := 3.0; ENDIF; k := ROUND(r); IF k > 1 THEN r := 1.0; ENDIF;"},
      {{"TRUNC"},
       "INT: k;",
       "IF go THEN r := 3.0; ENDIF; k := TRUNC(r); IF k > 1 THEN r := 1.0; ENDIF;"},
  };
  return kAll;
}

/// The items of the lists that begin with `Not supported: ` or `Errors: `, up to the sentence's
/// end.
std::set<std::string> not_supported(const fs::path& page) {
  std::ifstream in(page);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  for (char& c : text)
    if (c == '\n') c = ' ';
  const std::regex claim("(Not supported|Errors at their line|Errors): ([^.]*)[.]");
  std::set<std::string> items;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), claim);
       it != std::sregex_iterator(); ++it) {
    const std::string list =
        std::regex_replace((*it)[2].str(), std::regex(" \\([^)]*\\)|,? and (?=[^,;]*$)"), ",");
    static const std::regex kBetween("\\s*[,;]\\s*");
    for (auto item = std::sregex_token_iterator(list.begin(), list.end(), kBetween, -1);
         item != std::sregex_token_iterator(); ++item)
      items.insert(std::regex_replace(item->str(), std::regex("\\s+"), " "));
  }
  return items;
}

/// What pages of targets call unsupported is refused, and what is refused they call so.
TEST(Pages, ThePagesOfTargetsClaimAsUnsupportedWhatTheirPostsRefuse) {
  auto app =
      ioci::Application::create({.plugin_path = {ROBOMOSP_PLUGIN_DIR},
                                 .library = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"}});
  ASSERT_TRUE(app.ok()) << app.error().sentence();
  ioci::Session session("docs");
  lua::LuaState lua(**app, session, {.print = [](std::string_view) {}, .module_path = {}});
  // The target of a page, its profile in the library, and whether programs have to be flattened.
  struct Target {
    const char *page, *name, *profile;
    bool is_flat;
  };
  std::size_t refused = 0;
  for (const Target& t : {Target{"as", "as", "kawasaki_e", false},
                          {"c", "c", "robomosp_c", false},
                          {"crcl", "crcl", "nist_crcl", true},
                          {"fanuc_tp", "fanuc_tp", "fanuc_r30ib", false},
                          {"gcode", "gcode", "linuxcnc_abc", true},
                          {"inform", "inform", "yaskawa_dx200", true},
                          {"joint_trajectory", "joint_trajectory", "ros2_trajectory", true},
                          {"krl", "krl", "kuka_krc", false},
                          {"melfa", "melfa5", "melfa_cr800", false},
                          {"movemaster", "movemaster", "mitsubishi_rv_m1", true},
                          {"pacscript", "pacscript", "denso_rc8", false},
                          {"pdl2", "pdl2", "comau_c5g", false},
                          {"rapid", "rapid", "abb_irc5", false},
                          {"urscript", "urscript", "universal_robots", false},
                          {"val3", "val3", "staubli_cs8", false}}) {
    const fs::path page = fs::path(ROBOMOSP_SOURCE_DIR) / "docs/user/irl/targets" / t.page;
    const std::set<std::string> claims = not_supported(page.string() + ".md");
    for (const Construct& c : constructs()) {
      // Without its condition a motion of a flattened program has no UNTIL.
      if (t.is_flat && c.names[0] == "UNTIL") continue;
      const std::string source =
          "PROGRAM probe; SIGNAL INPUT BOOL: go AT 1; OUTPUT BOOL: done AT 2; OUTPUT REAL: level "
          "AT 1; VAR POSE: p1 := POSE(POSITION(400.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0)); "
          "POSE: p2 := POSE(POSITION(450.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0)); "
          "POSE: p3 := POSE(POSITION(400.0, 0.0, 250.0), ORIZYX(0.0, 180.0, 0.0)); REAL: r; " +
          std::string(c.variables) + c.routines + " BEGIN r := 2.5; MOVE PTP p1; " + c.statements +
          " MOVE LIN p1; ENDPROGRAM;";
      const auto asked = lua.eval(
          "probe = program.create{ name = 'probe', source = [[" + source + "]] }\n" +
          "assert(probe:check().correct)\n_, outcome = pcall(probe.post, probe, { target = '" +
          t.name + "', check = true, form = '" + (t.is_flat ? "flat" : "structured") +
          "', robot = 'ur5', profile = controller.get('" + t.profile +
          "'), inputs = {go = false} })\nfault = type(outcome) ~= 'table' and tostring(outcome) or "
          "''\n"
          "if fault == '' then for _, f in ipairs(outcome.faults or {}) do\n"
          "  if f.severity == 'error' then fault = f.message end end end\nprobe:remove()\nreturn "
          "fault");
      ASSERT_TRUE(asked.ok()) << t.name << " " << c.names[0] << ": " << asked.error().sentence();
      const bool is_refused = text::trim(*asked) != "";
      const bool is_claimed = std::any_of(c.names.begin(), c.names.end(),
                                          [&](const std::string& n) { return claims.contains(n); });
      EXPECT_EQ(is_refused, is_claimed)
          << t.page << ".md: " << c.names[0] << (is_claimed ? " is supported" : " is refused: ")
          << *asked;
      refused += is_refused ? 1 : 0;
    }
  }
  EXPECT_GT(refused, 50U);
}

INSTANTIATE_TEST_SUITE_P(Documentation, Page, ::testing::ValuesIn(pages_with_code()),
                         [](const auto& param) {
                           std::string name;
                           for (const char c : param.param)
                             name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                           return name;
                         });

/// Where the links and pictures of a page lead, without those of its code and to other sites.
std::vector<std::string> links_of(const fs::path& page) {
  std::ifstream in(page);
  std::vector<std::string> links;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("```")) inside = !inside;
    for (std::size_t at = line.find("]("); !inside && at != std::string::npos;
         at = line.find("](", at + 2)) {
      const std::string to = line.substr(at + 2, line.find_first_of(")#", at + 2) - at - 2);
      if (!to.empty() && to.find("://") == std::string::npos) links.push_back(to);
    }
  }
  return links;
}

/// Words between backticks outside of blocks.
std::vector<std::string> code_words_of(const fs::path& page) {
  std::ifstream in(page);
  std::vector<std::string> words;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("```")) inside = !inside;
    if (inside) continue;
    for (std::size_t at = line.find('`'); at != std::string::npos;) {
      const std::size_t end = line.find('`', at + 1);
      if (end == std::string::npos) break;
      std::istringstream between(line.substr(at + 1, end - at - 1));
      for (std::string word; between >> word;) words.push_back(word);
      at = line.find('`', end + 1);
    }
  }
  return words;
}

TEST(Documentation, ScriptsAndExamplesThatPagesNameAreThere) {
  const fs::path root(ROBOMOSP_SOURCE_DIR);
  std::size_t count = 0;
  for (const char* folder : {"docs/user", "docs/user/irl", "docs/user/irl/brands",
                             "docs/user/remote", "docs/user/stories", "docs/plugin_author"})
    for (const auto& entry : fs::directory_iterator(root / folder)) {
      if (entry.path().extension() != ".md") continue;
      for (std::string word : code_words_of(entry.path())) {
        fs::path file;
        // "13_own_closed_form.lua" is an example; so it is said on the pages.
        const bool is_example = word.ends_with(".lua") && word.size() > 3 && word[2] == '_' &&
                                std::isdigit(static_cast<unsigned char>(word[0]));
        if (is_example) file = fs::path("scripts/examples") / word;
        else if (word.starts_with("scripts/")) file = word;
        else if (word.starts_with("share/robomosp/examples/"))
          file = "sdk/examples" + word.substr(std::string("share/robomosp/examples").size());
        if (file.empty() || word.find_first_of("*<{") != std::string::npos) continue;
        ++count;
        EXPECT_TRUE(fs::exists(root / file)) << entry.path() << " names " << word;
      }
    }
  EXPECT_GT(count, 20U);
}

/// The text of all files below a folder with one of these names or endings.
std::string texts_below(const fs::path& folder, const std::vector<std::string>& endings) {
  std::string all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (std::none_of(endings.begin(), endings.end(),
                     [&](const std::string& ending) { return name.ends_with(ending); }))
      continue;
    std::ifstream in(entry.path());
    all.append(std::istreambuf_iterator<char>(in), {});
    all += '\n';
  }
  return all;
}

TEST(Documentation, TestsAndFoldersThatPagesOfDevelopersNameAreThere) {
  const fs::path root(ROBOMOSP_SOURCE_DIR);
  const std::string sources = texts_below(root / "tests", {"_test.cpp"});
  const std::string programs = texts_below(root / "tests", {"CMakeLists.txt"});
  const std::regex suites(R"(suites? `(\w+)`)"), test(R"(\w+_test)"), folder(R"([a-z_/]+/)");
  std::size_t count = 0;
  std::vector<fs::path> pages{root / "docs/architecture.md"};
  for (const auto& entry : fs::directory_iterator(root / "docs/developer"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  for (const fs::path& page : pages) {
    std::ifstream in(page);
    const std::string text(std::istreambuf_iterator<char>(in), {});
    for (std::sregex_iterator it(text.begin(), text.end(), suites), end; it != end; ++it, ++count)
      EXPECT_TRUE(std::regex_search(sources, std::regex("TEST(_F|_P)?\\(" + it->str(1) + ",")))
          << page << " names the suite " << it->str(1);
    for (const std::string& word : code_words_of(page)) {
      // A program of tests, not one of its sources.
      if (std::regex_match(word, test)) {
        ++count;
        const bool is_listed = std::regex_search(programs, std::regex("\\b" + word + "\\b(?!\\.)"));
        // viewer_fields_test is made of tests/viewer/fields_test.cpp.
        const bool is_of_window = word.starts_with("viewer_") &&
                                  fs::exists(root / "tests/viewer" / (word.substr(7) + ".cpp"));
        EXPECT_TRUE(is_listed || is_of_window) << page << " names " << word;
      }
      if (std::regex_match(word, folder) && word.find('/') + 1 < word.size()) {
        ++count;
        EXPECT_TRUE(fs::is_directory(root / word) || fs::is_directory(root / "modules" / word))
            << page << " names " << word;
      }
    }
  }
  EXPECT_GT(count, 50U);
}

TEST(Documentation, EveryFolderOfSourcesIsInTheListOfTheArchitecture) {
  const fs::path root(ROBOMOSP_SOURCE_DIR);
  const std::vector<std::string> words = code_words_of(root / "docs/architecture.md");
  const auto is_named = [&](const std::string& folder) {
    return std::find(words.begin(), words.end(), folder) != words.end();
  };
  for (const char* above : {"modules", "modules/ioci", "viewer", "tests"})
    for (const auto& entry : fs::directory_iterator(root / above)) {
      const std::string name = entry.path().filename().string();
      if (!entry.is_directory() || name.starts_with('.')) continue;
      const std::string path = (fs::path(above) / name).string();
      const std::string in_ioci = "ioci/" + name + "/";
      EXPECT_TRUE(is_named(path + "/") || is_named(path) || is_named(in_ioci) ||
                  (std::string(above) == "viewer" && is_named(name + "/")))
          << path << " is not in docs/architecture.md";
    }
}

TEST(Documentation, LinksAndPicturesLeadToFilesThatAreThere) {
  const fs::path root(ROBOMOSP_SOURCE_DIR);
  std::vector<fs::path> pages{root / "README.md"};
  for (const auto& entry : fs::recursive_directory_iterator(root / "docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  std::size_t count = 0;
  for (const fs::path& page : pages)
    for (const std::string& link : links_of(page)) {
      ++count;
      EXPECT_TRUE(fs::exists(page.parent_path() / link)) << page << " links to " << link;
    }
  EXPECT_GT(count, 300U);
}

/// Every page for readers: nobody has to guess that one exists.
TEST(Documentation, EveryPageIsReachedFromTheReadmeAndFromTheListOfPages) {
  const fs::path root = fs::canonical(ROBOMOSP_SOURCE_DIR);
  std::vector<fs::path> pages;
  for (const char* folder : {"docs", "modules", "plugins", "sdk", "scripts"})
    for (const auto& entry : fs::recursive_directory_iterator(root / folder))
      if (entry.path().extension() == ".md") pages.push_back(entry.path());
  EXPECT_GT(pages.size(), 60U);
  for (const char* start : {"README.md", "docs/README.md"}) {
    std::set<fs::path> reached;
    std::vector<fs::path> open{root / start};
    while (!open.empty()) {
      const fs::path page = open.back();
      open.pop_back();
      if (page.extension() != ".md" || !fs::exists(page) || !reached.insert(page).second) continue;
      for (const std::string& link : links_of(page))
        open.push_back((page.parent_path() / link).lexically_normal());
    }
    for (const fs::path& page : pages)
      EXPECT_TRUE(reached.contains(page))
          << "no way of links leads from " << start << " to " << page.lexically_relative(root);
  }
}

}  // namespace
}  // namespace robomosp
