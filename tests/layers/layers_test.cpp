// SPDX-License-Identifier: Apache-2.0
// The layer rule: reads every #include of the tree and compares it with modules/layers.txt.
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <fnmatch.h>

namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

bool contains(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

constexpr std::array kStandard = {"algorithm",
                                  "any",
                                  "array",
                                  "atomic",
                                  "barrier",
                                  "bit",
                                  "bitset",
                                  "cassert",
                                  "cctype",
                                  "cerrno",
                                  "cfenv",
                                  "cfloat",
                                  "charconv",
                                  "chrono",
                                  "cinttypes",
                                  "climits",
                                  "clocale",
                                  "cmath",
                                  "codecvt",
                                  "compare",
                                  "complex",
                                  "concepts",
                                  "condition_variable",
                                  "coroutine",
                                  "csetjmp",
                                  "csignal",
                                  "cstdarg",
                                  "cstddef",
                                  "cstdint",
                                  "cstdio",
                                  "cstdlib",
                                  "cstring",
                                  "ctime",
                                  "cuchar",
                                  "cwchar",
                                  "cwctype",
                                  "deque",
                                  "exception",
                                  "execution",
                                  "filesystem",
                                  "forward_list",
                                  "fstream",
                                  "functional",
                                  "future",
                                  "initializer_list",
                                  "iomanip",
                                  "ios",
                                  "iosfwd",
                                  "iostream",
                                  "istream",
                                  "iterator",
                                  "latch",
                                  "limits",
                                  "list",
                                  "locale",
                                  "map",
                                  "memory",
                                  "memory_resource",
                                  "mutex",
                                  "new",
                                  "numbers",
                                  "numeric",
                                  "optional",
                                  "ostream",
                                  "queue",
                                  "random",
                                  "ranges",
                                  "ratio",
                                  "regex",
                                  "scoped_allocator",
                                  "semaphore",
                                  "set",
                                  "shared_mutex",
                                  "source_location",
                                  "span",
                                  "sstream",
                                  "stack",
                                  "stdexcept",
                                  "stop_token",
                                  "streambuf",
                                  "string",
                                  "string_view",
                                  "syncstream",
                                  "system_error",
                                  "thread",
                                  "tuple",
                                  "type_traits",
                                  "typeindex",
                                  "typeinfo",
                                  "unordered_map",
                                  "unordered_set",
                                  "utility",
                                  "valarray",
                                  "variant",
                                  "vector",
                                  "version",
                                  "stdint.h",
                                  "stddef.h"};

/// modules/layers.txt, read.
struct Rules {
  std::map<std::string, int> layer;  // of a module
  std::map<std::string, Names> edges;
  std::map<std::string, Names> rooms;  // "ioci/core" -> rooms of its module
  Names sdk_only;
  Names viewer;  // all that viewer/ may include: modules, or folders of them
  std::vector<std::pair<std::string, Names>>
      homes;              // in order; the first pattern that matches decides
  Names thread_starters;  // what their paths begin with
  Names file_openers;     // the same
  Names faults;

  static Rules read(std::istream& in) {
    Rules rules;
    for (std::string line; std::getline(in, line);) {
      const auto colon = line.find(':');
      if (line.empty() || line[0] == '#') continue;
      std::istringstream head(line.substr(0, colon)),
          tail(colon == std::string::npos ? "" : line.substr(colon + 1));
      std::string word, subject;
      head >> word >> subject;
      Names names;
      for (std::string name; tail >> name;) names.push_back(name);
      if (word == "layer") {
        for (const std::string& name : names) rules.layer[name] = std::stoi(subject);
      } else if (word == "edge") {
        rules.edges[subject] = names;
      } else if (word == "room") {
        rules.rooms[subject] = names;
      } else if (word == "sdk_only") {
        rules.sdk_only = names;
      } else if (word == "viewer" && subject == "may_include") {
        rules.viewer = names;
      } else if (word == "home") {
        rules.homes.emplace_back(subject, names);
      } else if (word == "thread" && !names.empty()) {  // with a reason
        rules.thread_starters.push_back(subject);
      } else if (word == "file" && !names.empty()) {  // with a reason
        rules.file_openers.push_back(subject);
      } else {
        rules.faults.push_back(line);
      }
    }
    return rules;
  }
};

/// One include line: who, what, and whether it is a file beside the one that includes it.
struct Include {
  std::string file;  // from the root: "modules/io/bind.cpp"
  std::string target;
  bool angled = false;
  bool neighbour = false;
};

std::string top(const std::string& path) { return path.substr(0, path.find('/')); }
std::string second(const std::string& path) {
  const auto slash = path.find('/');
  return slash == std::string::npos ? "" : top(path.substr(slash + 1));
}
bool is_under(const std::string& file, const std::string& folder) {
  return file == folder || file.starts_with(folder + "/");
}

std::optional<std::string> fault_of_library(const Rules& rules, const Include& i) {
  for (const auto& [pattern, folders] : rules.homes) {
    if (::fnmatch(pattern.c_str(), i.target.c_str(), 0) != 0) continue;
    for (const std::string& folder : folders)
      if (is_under(i.file, folder)) return std::nullopt;
    std::string homes;
    for (const std::string& folder : folders) homes += " " + folder;
    return "<" + i.target + "> may be included only in" + homes;
  }
  return "<" + i.target + "> is neither standard nor has a home in modules/layers.txt";
}

std::optional<std::string> fault_of_module(const Rules& rules, const std::string& from,
                                           const std::string& to) {
  const auto a = rules.layer.find(from), b = rules.layer.find(to);
  if (a == rules.layer.end()) return "module \"" + from + "\" has no layer in modules/layers.txt";
  if (b == rules.layer.end()) return "\"" + to + "/\" is not a module of modules/layers.txt";
  if (from == to) return std::nullopt;
  if (contains(rules.sdk_only, from))
    return "\"" + from + "\" may include the SDK only, not \"" + to + "/\"";
  if (b->second > a->second) return "\"" + to + "/\" is in an outer layer";
  if (b->second < a->second) return std::nullopt;
  const auto edge = rules.edges.find(from);
  if (edge != rules.edges.end() && contains(edge->second, to)) return std::nullopt;
  return "modules/layers.txt has no edge from \"" + from + "\" to \"" + to + "\"";
}

/// Room of a file given from modules/: "ioci/core" of "ioci/core/command.h"; "" = it is in none.
std::string room_of(const std::string& file) {
  const auto first = file.find('/');
  const auto next = first == std::string::npos ? first : file.find('/', first + 1);
  return next == std::string::npos ? "" : file.substr(0, next);
}
/// Inside a module that has rooms: why a file of one may not include a file of another.
std::optional<std::string> fault_of_room(const Rules& rules, const std::string& from,
                                         const std::string& to) {
  const std::string a = room_of(from), b = room_of(to), module = top(from);
  const auto has_rooms = std::any_of(rules.rooms.begin(), rules.rooms.end(), [&](const auto& room) {
    return room.first.starts_with(module + "/");
  });
  if (!has_rooms || module != top(to) || a == b) return std::nullopt;
  for (const std::string& room : {a, b})
    if (!rules.rooms.contains(room))
      return "\"" + (room.empty() ? module : room) + "\" is no room of modules/layers.txt";
  if (contains(rules.rooms.at(a), second(b))) return std::nullopt;
  return "modules/layers.txt has no edge from room \"" + a + "\" to \"" + second(b) + "\"";
}

/// Why this include breaks the rule; nullopt when it does not.
std::optional<std::string> fault(const Rules& rules, const Include& i) {
  const std::string area = top(i.file);
  if (std::find(kStandard.begin(), kStandard.end(), i.target) != kStandard.end())
    return std::nullopt;
  if (i.target.starts_with("robomosp/sdk/")) {
    if (i.target.starts_with("robomosp/sdk/conformance/") && area != "sdk")
      return "conformance suites are for tests";
    return std::nullopt;
  }
  if (i.angled) return fault_of_library(rules, i);
  if (i.neighbour) return std::nullopt;
  const std::string to = top(i.target);
  if (area == "viewer") {
    if (to == area || contains(rules.viewer, to) || contains(rules.viewer, room_of(i.target)))
      return std::nullopt;
    std::string allowed;
    for (const std::string& name : rules.viewer) allowed += " " + name + "/";
    return "viewer/ may include only its own files and" + allowed;
  }
  // Plugins made outside of the tree may use what is installed with the SDK.
  if (i.file.starts_with("sdk/examples/") && contains(rules.sdk_only, to)) return std::nullopt;
  if (area == "sdk") return "the SDK includes only the standard library and itself";
  if (area == "plugins")
    return to == "spatial"
               ? std::nullopt
               : std::optional("a plugin includes the SDK, \"spatial/\" and its own files only");
  if (area == "modules")
    if (auto why = fault_of_room(rules, i.file.substr(area.size() + 1), i.target)) return why;
  return fault_of_module(rules, area == "kernel" ? "kernel" : second(i.file), to);
}

/// All include lines of a text.
std::vector<Include> includes_of(std::istream& in, const std::string& file) {
  static const std::regex kLine(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<Include> found;
  std::smatch match;
  for (std::string line; std::getline(in, line);)
    if (std::regex_search(line, match, kLine))
      found.push_back({file, match[2], match[1] == "<", false});
  return found;
}

Rules project_rules() {
  std::ifstream in(fs::path(ROBOMOSP_SOURCE_DIR) / "modules/layers.txt");
  return Rules::read(in);
}

TEST(Layers, EveryIncludeOfTheTreeFollowsTheRule) {
  const fs::path root = ROBOMOSP_SOURCE_DIR;
  const Rules rules = project_rules();
  const std::set<std::string> kinds = {".h", ".hpp", ".cpp", ".c", ".inl", ".in"};
  std::size_t count = 0;
  for (const char* area : {"sdk", "kernel", "modules", "plugins", "viewer"}) {
    if (!fs::is_directory(root / area)) continue;  // viewer/ may be left out
    for (const auto& entry : fs::recursive_directory_iterator(root / area)) {
      if (!entry.is_regular_file() || !kinds.contains(entry.path().extension().string())) continue;
      std::ifstream in(entry.path());
      for (Include& i : includes_of(in, entry.path().lexically_relative(root).generic_string())) {
        ++count;
        i.neighbour = !i.angled && fs::exists(entry.path().parent_path() / i.target);
        const auto why = fault(rules, i);
        EXPECT_FALSE(why.has_value()) << i.file << " includes " << i.target << ": " << *why << ".";
      }
    }
  }
  EXPECT_GT(count, 500U) << "the tree was not read";
}

/// Lines that `is_one` finds stand only in files whose path begins with one of `known`, and each of
/// these has one. What is said of others: their path, `does`, the line, and the way out.
void check_lines(const std::vector<const char*>& areas, bool (*is_one)(const std::string&),
                 const Names& known, const std::string& does, const std::string& way_out,
                 const std::string& does_not) {
  const fs::path root = ROBOMOSP_SOURCE_DIR;
  std::set<std::string> used;
  for (const char* area : areas) {
    if (!fs::is_directory(root / area)) continue;  // viewer/ may be left out
    for (const auto& entry : fs::recursive_directory_iterator(root / area)) {
      const std::string kind = entry.path().extension().string();
      if (kind != ".h" && kind != ".cpp" && kind != ".c") continue;
      const std::string file = entry.path().lexically_relative(root).generic_string();
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);) {
        if (!is_one(line)) continue;
        const auto at = std::find_if(known.begin(), known.end(), [&](const std::string& begin) {
          return file.starts_with(begin);
        });
        if (at != known.end()) used.insert(*at);
        else
          ADD_FAILURE() << file << " " << does << ": " << line << "\n"
                        << way_out << ", or write the reason into modules/layers.txt.";
      }
    }
  }
  for (const std::string& begin : known)
    if (fs::is_directory(root / begin.substr(0, begin.find('/')))) {
      EXPECT_TRUE(used.contains(begin)) << begin << " " << does_not;
    }
}

/// Whether a line holds, starts or asks the system for a thread.
bool starts_thread(const std::string& line) {
  static const std::regex kStart(
      R"((std::j?thread\b(?!::)|std::async\b|\bpthread_create\b|\bthrd_create\b|\bQThread\b|QtConcurrent))");
  const auto comment = line.find("//");
  return std::regex_search(line.substr(0, comment), kStart);
}

TEST(Layers, ThreadsAreStartedByTheExecutorOrForAWrittenReason) {
  for (const char* line : {"std::thread t(work);", "  std::vector<std::jthread> all;",
                           "auto f = std::async(work);", "pthread_create(&t, 0, work, 0);"})
    EXPECT_TRUE(starts_thread(line)) << line;
  for (const char* line : {"std::thread::hardware_concurrency()", "const std::thread::id id;",
                           "std::this_thread::yield();", "// a std::thread"})
    EXPECT_FALSE(starts_thread(line)) << line;
  check_lines({"sdk", "kernel", "modules", "plugins", "viewer"}, starts_thread,
              project_rules().thread_starters, "starts a thread of its own",
              "Take it from the executor (Host::spread() in plugins)", "starts no thread any more");
}

/// Whether a line opens, makes, lists or removes a file by its name.
bool opens_file(const std::string& line) {
  static const std::regex kOpen(
      R"((std::(basic_)?[io]?fstream\b|\bfopen\(|::open\(|::openat\(|::creat\(|\bopendir\(|directory_iterator\(?\b|\bfreopen\()"
      R"(|(fs|filesystem)::(remove|remove_all|rename|copy|copy_file|create_directory|create_directories|create_symlink|resize_file)\()"
      R"(|::(unlink|rename|mkdir|rmdir|symlink|link|truncate)\(|zip_open\(|\bReadFile\())");
  // Functions of classes of our own that have such a name.
  static const std::regex kOwn(R"(\b[A-Z][A-Za-z0-9]*::open(at)?\()");
  return std::regex_search(std::regex_replace(line.substr(0, line.find("//")), kOwn, ""), kOpen);
}

// Sessions may have a folder that their files lie in: what a user or a file names is opened through
// kernel/file_root.h, and elsewhere only for a written reason.
TEST(Layers, FilesAreOpenedThroughTheDoorOrForAWrittenReason) {
  for (const char* line :
       {"std::ifstream in(file);", "  std::ofstream out;", "FILE* f = std::fopen(name, \"r\");",
        "const int fd = ::open(name, O_RDONLY);", "std::filesystem::remove(file, ec);",
        "fs::create_directories(folder);", "for (fs::directory_iterator it(folder), end;",
        "::unlink(name);"})
    EXPECT_TRUE(opens_file(line)) << line;
  for (const char* line : {"Result<Package> Package::open(const std::string& path) {",
                           "// std::ifstream", "files::is_file(p)", "calls->open();",
                           "document::remove(id);", "#include <fstream>", "reopen();"})
    EXPECT_FALSE(opens_file(line)) << line;
  check_lines(
      {"kernel", "modules", "plugins", "viewer"}, opens_file, project_rules().file_openers,
      "opens files of its own",
      "Open what a user or a file names through kernel/file_root.h (robomosp/sdk/files.h in "
      "plugins)",
      "opens no file any more");
}

TEST(Layers, TheTableIsWellFormedAndItsEdgesStayInTheirLayerWithoutACircle) {
  const Rules rules = project_rules();
  EXPECT_TRUE(rules.faults.empty()) << rules.faults.front();
  Names placed;  // modules all of whose edges lead to placed ones
  bool grew = true;
  while (grew) {
    grew = false;
    for (const auto& [name, layer] : rules.layer) {
      if (contains(placed, name)) continue;
      const auto edge = rules.edges.find(name);
      const bool ready = edge == rules.edges.end() ||
                         std::all_of(edge->second.begin(), edge->second.end(),
                                     [&](const std::string& to) { return contains(placed, to); });
      if (!ready) continue;
      placed.push_back(name);
      grew = true;
    }
  }
  EXPECT_EQ(placed.size(), rules.layer.size()) << "the edges of modules/layers.txt run in a circle";
  for (const auto& [from, targets] : rules.edges)
    for (const std::string& to : targets) {
      ASSERT_TRUE(rules.layer.contains(from) && rules.layer.contains(to)) << from << ": " << to;
      EXPECT_EQ(rules.layer.at(from), rules.layer.at(to)) << from << ": " << to;
    }
}

/// Rooms that cannot be ordered so that each includes earlier ones only.
Names rooms_in_circles(const std::map<std::string, Names>& rooms) {
  Names placed, left;
  for (std::size_t before = placed.size() + 1; before != placed.size();) {
    before = placed.size();
    for (const auto& [room, names] : rooms)
      if (!contains(placed, room) &&
          std::all_of(names.begin(), names.end(), [&, module = top(room)](const std::string& name) {
            return contains(placed, module + "/" + name);
          }))
        placed.push_back(room);
  }
  for (const auto& [room, names] : rooms)
    if (!contains(placed, room)) left.push_back(room);
  return left;
}

TEST(Layers, RoomsHaveNoCircleAndTheirLinesNameWhatIsUsed) {
  const Rules rules = project_rules();
  for (const std::string& room : rooms_in_circles(rules.rooms))
    ADD_FAILURE() << room << " includes a room that includes it, or one that has no line";
  EXPECT_TRUE(rules.rooms.at("ioci/core").empty()) << "core includes no other room";
  std::map<std::string, std::set<std::string>> used;
  const fs::path root = fs::path(ROBOMOSP_SOURCE_DIR) / "modules";
  std::set<std::string> modules;
  for (const auto& [room, names] : rules.rooms) modules.insert(top(room));
  for (const std::string& module : modules)
    for (const auto& folder : fs::directory_iterator(root / module)) {
      if (!folder.is_directory()) continue;
      const std::string room = module + "/" + folder.path().filename().string();
      EXPECT_TRUE(rules.rooms.contains(room)) << room << " has no line in modules/layers.txt";
      for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        std::ifstream in(entry.path());
        for (const Include& i : includes_of(in, room))
          if (top(i.target) == module) used[room].insert(second(room_of(i.target)));
      }
    }
  for (const auto& [room, names] : rules.rooms)
    for (const std::string& name : names)
      EXPECT_TRUE(used[room].contains(name))
          << "no file of " << room << " includes " << name << ": take it out of modules/layers.txt";
  EXPECT_EQ(rooms_in_circles({{"m/a", {"b"}}, {"m/b", {"a"}}, {"m/c", {}}}), (Names{"m/a", "m/b"}));
}

TEST(Layers, EachBrokenRuleIsDetected) {
  const Rules rules = project_rules();
  const auto check = [&](const std::string& file, const std::string& line) {
    std::istringstream text("// a comment\n" + line + "\n");
    const auto found = includes_of(text, file);
    if (found.size() != 1) return std::string("not an include");
    return fault(rules, found[0]).value_or("fine");
  };
  EXPECT_EQ(check("kernel/jobs.cpp", "#include \"model/records.h\""),
            "\"model/\" is in an outer layer");
  EXPECT_EQ(check("modules/geometry/mesh.cpp", "  #  include \"robotics/kinematics.h\""),
            "modules/layers.txt has no edge from \"geometry\" to \"robotics\"");
  EXPECT_EQ(check("modules/model/records.h", "#include \"document/document.h\""),
            "\"document/\" is in an outer layer");
  EXPECT_EQ(check("modules/io/bind.cpp", "#include \"viewer/frame.h\""),
            "\"viewer/\" is not a module of modules/layers.txt");
  EXPECT_EQ(check("modules/ioci/core/command.cpp", "#include \"plugins/csg_occt/engine.h\""),
            "\"plugins/\" is not a module of modules/layers.txt");
  EXPECT_EQ(check("modules/spatial/pose.h", "#include \"kernel/text.h\""),
            "\"spatial\" may include the SDK only, not \"kernel/\"");
  EXPECT_EQ(check("modules/unheard/x.cpp", "#include \"kernel/text.h\""),
            "module \"unheard\" has no layer in modules/layers.txt");
  for (const char* file : {"sdk/include/robomosp/sdk/ik.h", "sdk/examples/mine/mine.cpp"})
    EXPECT_EQ(check(file, "#include \"kernel/value.h\""),
              "the SDK includes only the standard library and itself");
  EXPECT_EQ(check("sdk/examples/mine/mine.cpp", "#include \"spatial/pose.h\""), "fine");
  EXPECT_NE(check("sdk/include/robomosp/sdk/ik.h", "#include \"spatial/pose.h\""), "fine");
  for (const char* line : {"#include <Eigen/Core>", "#include <gtest/gtest.h>",
                           "#include <fmt/format.h>", "#include <unistd.h>", "#include <dlfcn.h>"})
    EXPECT_NE(check("sdk/include/robomosp/sdk/ik.h", line), "fine") << line;
  EXPECT_EQ(check("plugins/ik_numeric/search.cpp", "#include \"kernel/text.h\""),
            "a plugin includes the SDK, \"spatial/\" and its own files only");
  EXPECT_EQ(check("plugins/ik_numeric/search.cpp", "#include <robomosp/sdk/conformance/models.h>"),
            "conformance suites are for tests");
  EXPECT_NE(check("plugins/ik_numeric/search.cpp", "#include <gp_Pnt.hxx>"), "fine");
  EXPECT_NE(check("modules/ioci/core/command.cpp", "#include <lua.hpp>"), "fine");
  EXPECT_NE(check("modules/ioci/core/command.cpp", "#include <nlohmann/json.hpp>"), "fine");
  EXPECT_NE(check("modules/shell/main.cpp", "#include <osg/Node>"), "fine");
  EXPECT_NE(check("modules/shell/main.cpp", "#include <QApplication>"), "fine");
  EXPECT_EQ(check("modules/shell/main.cpp", "#include <boost/any>"),
            "<boost/any> is neither standard nor has a home in modules/layers.txt");

  EXPECT_EQ(check("modules/ioci/core/command.cpp", "#include \"ioci/robot/robots.h\""),
            "modules/layers.txt has no edge from room \"ioci/core\" to \"robot\"");
  EXPECT_EQ(check("modules/ioci/kitchen/pan.cpp", "#include \"ioci/core/command.h\""),
            "\"ioci/kitchen\" is no room of modules/layers.txt");
  EXPECT_EQ(check("modules/ioci/world/world.cpp", "#include \"ioci/robot/robots.h\""), "fine");
  EXPECT_EQ(check("modules/lua/call.cpp", "#include \"ioci/robot/robots.h\""), "fine");

  EXPECT_EQ(check("modules/shell/main.cpp", "#include \"lua/lua_state.h\""), "fine");
  EXPECT_EQ(check("modules/lua/call.cpp", "#include <lua.hpp>"), "fine");
  EXPECT_EQ(check("plugins/csg_occt/engine.cpp", "#include <gp_Pnt.hxx>"), "fine");
  EXPECT_EQ(check("plugins/ik_numeric/search.cpp", "#include \"spatial/pose.h\""), "fine");
  EXPECT_EQ(check("sdk/include/robomosp/sdk/eigen.h", "#include <Eigen/Core>"), "fine");
  EXPECT_EQ(check("viewer/main.cpp", "#include <QApplication>"), "fine");
  for (const char* line :
       {"#include \"viewer/frame.h\"", "#include \"kernel/text.h\"", "#include \"scene/frame.h\"",
        "#include \"ioci/client/live_view.h\"", "#include <CLI/CLI.hpp>", "#include <unistd.h>"})
    EXPECT_EQ(check("viewer/main.cpp", line), "fine") << line;
  for (const char* line :
       {"#include \"sim/simulate.h\"", "#include \"model/placement.h\"",
        "#include \"ioci/core/application.h\"", "#include \"ioci/view/picture.h\"",
        "#include \"lua/lua_state.h\"", "#include \"document/document.h\""})
    EXPECT_EQ(check("viewer/main.cpp", line),
              "viewer/ may include only its own files and kernel/ scene/ ioci/client/")
        << line;
  EXPECT_NE(check("viewer/main.cpp", "#include <lua.hpp>"), "fine");
  EXPECT_NE(check("viewer/main.cpp", "#include <nlohmann/json.hpp>"), "fine");
}

}  // namespace
