// SPDX-License-Identifier: Apache-2.0
// Sessions whose files lie in a folder: no command, file, script, job or watch of theirs reads,
// makes, changes or removes anything outside it, and nothing hangs.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "docs/example_arguments.h"
#include "docs/examples.h"
#include "ioci/core/watchers.h"
#include "kernel/base64.h"
#include "kernel/confined_process.h"
#include "kernel/process.h"
#include "kernel/text.h"
#include "lua/lua_state.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;
using test::examples_app;

constexpr const char* kSecret = "THE-SECRET-OF-SOMEBODY-ELSE";

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void put(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// The folder of a session, where the process stands elsewhere; around it what is of others.
class Confined : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::make_unique<test::ExamplesFolder>("confined");
    top_ = fs::canonical(folder_->path());
    root_ = top_ / "root";
    outside_ = top_ / "outside";
    fs::create_directories(root_);
    fs::create_directories(outside_ / "sub");
    put(outside_ / "secret", kSecret);
    fs::current_path(outside_ / "sub");
    app().document.clear();
    auto made = app().file_root(root_);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    guest_ = std::make_unique<Session>("guest", SessionKind::connection);
    guest_->confine(std::move(*made));
  }
  void TearDown() override {
    (void)app().watchers->settle();
    (void)app().watchers->remove([](const WatchStatus&) { return true; });
    guest_.reset();
    app().document.clear();
    folder_.reset();
  }
  static Application& app() { return examples_app(); }
  Result<Value> call(std::string_view name, const Map& args = {}) {
    return app().dispatch(*guest_, name, args);
  }
  Value good(std::string_view name, const Map& args = {}) {
    auto r = call(name, args);
    EXPECT_TRUE(r.ok()) << name << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? std::move(*r) : Value();
  }
  /// Names, kinds, contents and times of all that is not in the folder.
  [[nodiscard]] std::map<std::string, std::string> others() const {
    std::map<std::string, std::string> out;
    for (auto it = fs::recursive_directory_iterator(top_); it != fs::end(it); ++it) {
      if (it->path() == root_) {
        it.disable_recursion_pending();
        continue;
      }
      struct stat s {};
      EXPECT_EQ(::lstat(it->path().c_str(), &s), 0);
      out[it->path().string()] =
          std::to_string(s.st_mode) + " " + std::to_string(s.st_mtim.tv_sec) + "." +
          std::to_string(s.st_mtim.tv_nsec) + (it->is_regular_file() ? content(it->path()) : "");
    }
    return out;
  }

  std::unique_ptr<test::ExamplesFolder> folder_;
  fs::path top_, root_, outside_;
  std::unique_ptr<Session> guest_;
};

bool names_a_file(const ParamSpec& p) {
  return p.type == "path" ||
         (p.type == "string" && (p.name == "file" || p.name == "folder" || p.name == "frames"));
}

// Every command of the table with an argument that names a file, whatever it does with it.
TEST_F(Confined, NoCommandLeavesTheFolderByAnArgument) {
  fs::current_path(root_);  // where the examples make what they read
  std::size_t tried = 0, refused = 0, worked = 0;
  const auto begin = std::chrono::steady_clock::now();
  for (const CommandSpec* spec : app().commands.list()) {
    if (std::none_of(spec->params.begin(), spec->params.end(), names_a_file)) continue;
    if (test::cannot_draw(*spec)) continue;
    // Without a call of its own, such as recovery.restore: any arguments do.
    const Map args = test::arguments_of(*spec).value_or(Map{});
    for (const ParamSpec& p : spec->params) {
      if (!names_a_file(p)) continue;
      const Value* given = args.find(p.name);
      const fs::path usual = given && given->as_string() ? *given->as_string() : std::string();
      const std::string ending = usual.extension().string();
      // What the example reads lies outside as well, so that a command could take it.
      fs::remove_all(outside_ / "there");
      fs::create_directories(outside_ / "there");
      std::error_code ec;
      if (fs::is_regular_file(usual, ec)) fs::copy_file(usual, outside_ / ("there" + ending), ec);
      else if (!fs::exists(outside_ / ("there" + ending)))
        put(outside_ / ("there" + ending), kSecret);
      for (const char* name : {"link", "dir", "fifo", "folder"})
        fs::remove_all(root_ / (name + ending), ec);
      fs::remove(root_ / "dir", ec);
      fs::create_symlink(outside_ / ("there" + ending), root_ / ("link" + ending));
      fs::create_symlink("../outside", root_ / "dir");
      fs::create_directories(root_ / ("folder" + ending));
      ASSERT_EQ(::mkfifo((root_ / ("fifo" + ending)).c_str(), 0600), 0);
      const auto run = [&](const std::string& name) {
        Map with = args;
        with.set(p.name, name);
        ++tried;
        return call(spec->name, with);
      };
      const auto before = others();
      for (const std::string& name :
           {"../outside/there" + ending, "../outside/new" + ending, "../new" + ending,
            (outside_ / ("there" + ending)).string(), (outside_ / ("new" + ending)).string(),
            "link" + ending, "dir/there" + ending, "dir/new" + ending,
            std::string("/proc/self/environ"), std::string("/dev/zero"), "/dev/stdin" + ending}) {
        const auto result = run(name);
        ASSERT_FALSE(result.ok()) << spec->name << " " << p.name << " = " << name;
        const bool is_free = p.type == "string" && spec->name == "recording.unwatch";
        EXPECT_TRUE(is_free || result.error().code == ErrorCode::permission)
            << spec->name << " " << p.name << " = " << name << ": " << result.error().sentence();
        EXPECT_EQ(result.error().sentence().find(kSecret), std::string::npos);
        ++refused;
      }
      for (const std::string& name :
           {"fifo" + ending, "folder" + ending, std::string(), std::string(5000, 'x'),
            std::string(5000, 'x') + ending, std::string("a\0b", 3) + ending,
            "\xff\xfe\x80" + ending, std::string(255, 'y') + ending}) {
        const auto result = run(name);
        if (result.ok()) ++worked;
      }
      EXPECT_EQ(others(), before) << spec->name << " " << p.name;
    }
    app().document.clear();
    if (spec->name == "server.start") (void)call("server.stop", {});
  }
  fs::current_path(outside_ / "sub");
  EXPECT_GT(tried, 500U);
  EXPECT_GT(refused, 300U);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::minutes(3))
      << "something waited";
}

TEST_F(Confined, FilesAreThoseOfTheFolderWhereverTheProgramStands) {
  good("material.create", {{"name", "brass"}, {"density", 8500}});
  good("material.save", {{"id", "brass"}, {"file", "brass.mtr"}});
  EXPECT_TRUE(fs::exists(root_ / "brass.mtr"));
  good("document.clear");
  good("file.load", {{"file", "brass.mtr"}});
  EXPECT_TRUE(call("robot.get", {{"name", "pa10"}}).ok()) << "the library may be read";
  good("document.clear");
  // Results and errors name files as the session does.
  const Value made = good("file.save_all", {{"folder", "."}});
  EXPECT_TRUE(made.as_list()->empty());
  const auto missing = call("file.load", {{"file", "no.mtr"}});
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().message, "there is no file \"no.mtr\"");
  good("file.load", {{"file", (root_ / "brass.mtr").string()}});
  EXPECT_EQ(others().count((outside_ / "sub" / "brass.mtr").string()), 0U);
}

TEST_F(Confined, BytesGoInAndOut) {
  std::string bytes;
  for (int i = 0; i < 300'000; ++i) bytes += static_cast<char>(i * 7);
  std::string coded;
  base64::append(coded, bytes);
  EXPECT_EQ(good("file.write", {{"file", "a.bin"}, {"base64", coded}}).text(), "300000");
  EXPECT_EQ(good("file.write", {{"file", "a.bin"}, {"base64", "AAE="}, {"append", true}}).text(),
            "300002");
  EXPECT_EQ(content(root_ / "a.bin"), bytes + std::string("\0\1", 2));
  std::string back;
  for (std::int64_t at = 0;;) {
    const Value part = good("file.read", {{"file", "a.bin"}, {"offset", at}, {"length", 65'537}});
    ASSERT_TRUE(part.as_map());
    const std::string& text = *part.as_map()->find("base64")->as_string();
    std::string piece(base64::decoded_size(text).value(), '\0');
    ASSERT_TRUE(base64::decode(text, piece.data()));
    back += piece;
    at += static_cast<std::int64_t>(piece.size());
    if (*part.as_map()->find("is_end")->as_bool()) break;
    ASSERT_FALSE(piece.empty());
  }
  EXPECT_EQ(back, content(root_ / "a.bin"));
  const Value behind = good("file.read", {{"file", "a.bin"}, {"offset", 9'000'000'000'000.0}});
  EXPECT_EQ(behind.as_map()->find("base64")->text(), Value("").text());
  EXPECT_TRUE(*behind.as_map()->find("is_end")->as_bool());
  EXPECT_FALSE(call("file.read", {{"file", "a.bin"}, {"length", (1 << 24) + 1}}).ok());
  EXPECT_FALSE(call("file.read", {{"file", "a.bin"}, {"length", 0}}).ok());
  EXPECT_FALSE(call("file.read", {{"file", "a.bin"}, {"offset", -1}}).ok());
  for (const char* wrong : {"AAE", "A===", "AA E=", "AAE=x"})
    EXPECT_FALSE(call("file.write", {{"file", "b.bin"}, {"base64", wrong}}).ok()) << wrong;
  EXPECT_FALSE(
      call("file.write", {{"file", "b.bin"}, {"base64", std::string(4 << 22, 'A') + "AAAA"}})
          .ok() &&
      fs::file_size(root_ / "b.bin") > (1U << 24));
  good("file.write", {{"file", "empty"}, {"base64", ""}});
  EXPECT_EQ(fs::file_size(root_ / "empty"), 0U);
  ASSERT_EQ(::mkfifo((root_ / "fifo").c_str(), 0600), 0);
  EXPECT_FALSE(call("file.read", {{"file", "fifo"}}).ok());
  EXPECT_FALSE(call("file.write", {{"file", "fifo"}, {"base64", "AAE="}, {"append", true}}).ok());
  good("file.remove", {{"file", "a.bin"}});
  EXPECT_EQ(call("file.remove", {{"file", "a.bin"}}).error().code, ErrorCode::not_found);
  // The same in a session without a folder: what waits for another program is not opened.
  Session owner("owner");
  EXPECT_FALSE(app().dispatch(owner, "file.read", {{"file", (root_ / "fifo").string()}}).ok());
  EXPECT_FALSE(app().dispatch(owner, "file.read", {{"file", "/dev/zero"}}).ok());
  EXPECT_TRUE(app().dispatch(owner, "file.read", {{"file", (outside_ / "secret").string()}}).ok());
}

TEST_F(Confined, FilesThatFilesNameAreThoseOfTheFolder) {
  put(outside_ / "steel.mtr", "robomosp 1 material \"steel\" {\n  density = 7850 kg/m^3\n}\n");
  good("material.create", {{"name", "own"}, {"density", 1000}});
  good("solid.create", {{"name", "cube"},
                        {"material", "own"},
                        {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
  good("solid.save", {{"id", "cube"}, {"file", "cube.csg"}});
  std::string text = content(root_ / "cube.csg");
  ASSERT_NE(text.find("own.mtr"), std::string::npos) << text;
  for (const std::string& name :
       {std::string("../outside/steel.mtr"), (outside_ / "steel.mtr").string()}) {
    std::string changed = text;
    changed.replace(changed.find("own.mtr"), 7, name);
    put(root_ / "changed.csg", changed);
    const auto loaded = call("file.load", {{"file", "changed.csg"}});
    ASSERT_FALSE(loaded.ok()) << name;
    EXPECT_EQ(loaded.error().code, ErrorCode::permission) << loaded.error().sentence();
  }
}

/// A tetrahedron as text of an STL file.
std::string tetrahedron() {
  const char* p[4] = {"0 0 0", "0.1 0 0", "0 0.1 0", "0 0 0.1"};
  const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::string out = "solid t\n";
  for (const auto& f : faces) {
    out += "facet normal 0 0 0\nouter loop\n";
    for (const int k : f) out += std::string("vertex ") + p[k] + "\n";
    out += "endloop\nendfacet\n";
  }
  return out + "endsolid t\n";
}

TEST_F(Confined, MeshesOfRobotsAreThoseOfTheFolder) {
  put(root_ / "own.stl", tetrahedron());
  put(outside_ / "their.stl", tetrahedron());
  fs::create_directories(outside_ / "package");
  put(outside_ / "package" / "their.stl", tetrahedron());
  fs::create_symlink(outside_ / "their.stl", root_ / "link.stl");
  const auto import = [&](const std::string& mesh, bool outside) {
    put(root_ / "arm.urdf",
        "<robot name=\"arm\"><link name=\"base\"/><link name=\"hand\"><visual><geometry><mesh "
        "filename=\"" +
            mesh +
            "\"/></geometry></visual></link><joint name=\"j\" type=\"revolute\"><parent "
            "link=\"base\"/><child link=\"hand\"/><axis xyz=\"0 0 1\"/><limit lower=\"-1\" "
            "upper=\"1\" effort=\"1\" velocity=\"1\"/></joint></robot>");
    good("document.clear");
    return call("import", {{"file", "arm.urdf"}, {"options", Map{{"outside", outside}}}});
  };
  const auto solids = [&] { return app().document.now()->list(Kind::solid).size(); };
  if (can_confine_processes()) {
    const auto own = import("own.stl", false);
    ASSERT_TRUE(own.ok()) << own.error().sentence();
    EXPECT_EQ(solids(), 1U);
  }
  for (const std::string& mesh :
       {std::string("../outside/their.stl"), (outside_ / "their.stl").string(),
        std::string("link.stl"), "package://" + top_.filename().string() + "/outside/their.stl",
        std::string("package://outside/their.stl"), std::string("package://package/their.stl"),
        "file://" + (outside_ / "their.stl").string(), std::string("/proc/self/environ")})
    for (const bool outside : {false, true}) {
      EXPECT_TRUE(import(mesh, outside).ok());  // without the shape
      EXPECT_EQ(solids(), 0U) << mesh;
    }
  // Files that are included.
  put(outside_ / "part.xml",
      "<mujoco><worldbody><body name=\"b\"><geom size=\"1\"/></body></worldbody></mujoco>");
  put(root_ / "arm.xml",
      "<mujoco><include file=\"" + (outside_ / "part.xml").string() + "\"/></mujoco>");
  for (const bool outside : {false, true})
    EXPECT_FALSE(
        call("import", {{"file", "arm.xml"}, {"options", Map{{"outside", outside}}}}).ok());
}

TEST_F(Confined, BuffersOfMeshFilesAreThoseOfTheFolder) {
  if (!can_confine_processes()) GTEST_SKIP() << "this system has no Landlock";
  // Four corners and four triangles in a file of their own.
  const float corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::uint16_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  std::string bytes(reinterpret_cast<const char*>(corners), sizeof corners);
  bytes.append(reinterpret_cast<const char*>(faces), sizeof faces);
  put(root_ / "own.bin", bytes);
  put(outside_ / "their.bin", bytes);
  fs::create_symlink(outside_ / "their.bin", root_ / "link.bin");
  const auto import = [&](const std::string& buffer) {
    put(root_ / "part.gltf",
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
        R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3",)"
        R"("min":[0,0,0],"max":[1,1,1]},{"bufferView":1,"componentType":5123,"count":12,)"
        R"("type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},)"
        R"({"buffer":0,"byteOffset":48,"byteLength":24}],"buffers":[{"byteLength":72,"uri":")" +
            buffer + "\"}]}");
    good("document.clear");
    return call("import", {{"file", "part.gltf"}});
  };
  const auto own = import("own.bin");
  ASSERT_TRUE(own.ok()) << own.error().sentence();
  for (const std::string& buffer :
       {std::string("../outside/their.bin"), (outside_ / "their.bin").string(),
        std::string("link.bin"), std::string("/proc/self/environ")})
    EXPECT_FALSE(import(buffer).ok()) << buffer;
  // Exact solids go out and in again by the same program.
  good("document.clear");
  good("material.create", {{"name", "own"}, {"density", 1000}});
  good("solid.create", {{"name", "cube"},
                        {"material", "own"},
                        {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
  good("export", {{"what", "cube"}, {"file", "cube.step"}});
  EXPECT_TRUE(fs::exists(root_ / "cube.step"));
  good("import", {{"file", "cube.step"}});
}

TEST_F(Confined, ScriptsKeepToTheFolder) {
  lua::LuaState lua(app(), *guest_,
                    {.print = [](std::string_view) {},
                     .module_path = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/lib"}});
  put(outside_ / "evil.lua", "return 'loaded from outside'");
  put(root_ / "module.lua", "return {answer = 42}");
  put(root_ / "text", "one\ntwo\n");
  fs::create_symlink(outside_ / "evil.lua", root_ / "link.lua");
  const auto before = others();
  const auto run = [&](const std::string& code) { return lua.run_string(code, "test"); };
  const auto works = [&](const std::string& code) {
    const auto r = run(code);
    EXPECT_TRUE(r.ok()) << code << ": " << (r.ok() ? "" : r.error().sentence());
  };
  const std::string out = outside_.string();
  for (const std::string& code : std::vector<std::string>{
           "assert(io.open('../outside/secret'))", "assert(io.open('" + out + "/secret'))",
           "assert(io.open('" + out + "/new', 'w'))", "assert(io.open('link.lua'))",
           "for l in io.lines('../outside/secret') do end", "io.input('../outside/secret')",
           "io.output('../new')", "assert(os.remove('../outside/secret'))",
           "assert(os.rename('text', '../outside/text'))",
           "assert(os.rename('../outside/secret', 'secret'))", "os.tmpname()", "io.tmpfile()",
           "io.popen('true')", "os.execute('touch " + out + "/x')", "dofile('../outside/evil.lua')",
           "dofile('" + out + "/evil.lua')", "dofile('link.lua')", "dofile()",
           "assert(loadfile('../outside/evil.lua'))", "require('evil')",
           "package.path = '" + out + "/?.lua' require('evil')",
           "package.cpath = '" + out + "/?.so' require('evil')",
           "assert(package.searchpath('evil', '" + out + "/?.lua'))",
           "assert(load(string.dump(function() end)))", "debug.getupvalue(io.open, 1)",
           "debug.getregistry()", "debug.setmetatable({}, {})",
           // The text of a script that a chunk claims to be.
           "load([[ioci.provide('ik', 'x', function() end)]], '@" + out +
               "/secret')() assert(false)",
           "assert(io.open('fifo'))"}) {
    (void)::mkfifo((root_ / "fifo").c_str(), 0600);
    EXPECT_FALSE(run(code).ok()) << code;
  }
  works("local f = assert(io.open('a', 'w')) f:write('x') f:close()");
  works(
      "local f = assert(io.open('a', 'a+b')) f:write('y') f:seek('set') "
      "assert(f:read('a') == 'xy') f:close()");
  works("assert(io.open('nothing') == nil)");
  works("local n = 0 for l in io.lines('text') do n = n + 1 end assert(n == 2)");
  works("io.input('text') assert(io.read() == 'one')");
  works("assert(os.rename('a', 'b') and os.remove('b') and not os.remove('b'))");
  works("package.path = './?.lua' assert(require('module').answer == 42)");
  works("assert(dofile('module.lua').answer == 42 and loadfile('module.lua')().answer == 42)");
  works("assert(package.searchpath('module', './?.lua') == './module.lua')");
  works("assert(load('return 1')() == 1 and load('return x', 'c', 'bt', {x = 2})() == 2)");
  works("assert(debug.traceback() and debug.getinfo(1))");
  works("material.create{name = 'm', density = 1} material.save{id = 'm', file = 'm.mtr'}");
  EXPECT_TRUE(fs::exists(root_ / "m.mtr"));
  EXPECT_EQ(others(), before);
}

TEST_F(Confined, JobsWatchesAndRefreshesKeepToTheFolder) {
  const auto job =
      app().dispatch_async(*guest_, "file.write", {{"file", "by_job"}, {"base64", "AAE="}});
  ASSERT_TRUE(job.ok());
  EXPECT_TRUE(app().jobs.wait(job->number).ok());
  EXPECT_TRUE(fs::exists(root_ / "by_job"));
  const auto bad =
      app().dispatch_async(*guest_, "file.write", {{"file", "../by_job"}, {"base64", "AAE="}});
  EXPECT_FALSE(bad.ok());

  lua::LuaState lua(app(), *guest_, {.print = [](std::string_view) {}, .module_path = {}});
  const auto made = lua.run_string(R"(
    arm = robot.create{name = "arm", convention = "dh", links = {
      {a = 0.5, lower = -3, upper = 3, mass = 1, com = {-0.25, 0, 0}}},
      poses = {ready = {0.3}}}
    run = arm:simulate{q = "ready", duration = 0.1}
    run:plot{file = "run.svg", columns = {"q1"}, watch = true})",
                                   "test");
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  ASSERT_TRUE(fs::exists(root_ / "run.svg"));
  fs::remove(root_ / "run.svg");
  const auto before = others();
  Session owner("owner");  // whoever edits, it is drawn where it was
  ASSERT_TRUE(app().dispatch(owner, "robot.set_payload", {{"id", "arm"}, {"mass", 1}}).ok());
  ASSERT_TRUE(app().watchers->settle());
  EXPECT_TRUE(fs::exists(root_ / "run.svg"));
  // A link that stands there by then leads nowhere.
  fs::remove(root_ / "run.svg");
  fs::create_symlink(outside_ / "drawn.svg", root_ / "run.svg");
  ASSERT_TRUE(app().dispatch(owner, "robot.set_payload", {{"id", "arm"}, {"mass", 2}}).ok());
  ASSERT_TRUE(app().watchers->settle());
  EXPECT_EQ(others(), before);
  const auto watched = app().watchers->list();
  ASSERT_EQ(watched.size(), 1U);
  EXPECT_EQ(watched[0].state, "failed");
  EXPECT_EQ(good("recording.unwatch", {{"file", "run.svg"}}).text(), "1");
}

TEST_F(Confined, WhatIsKeptElsewhereIsNotForThem) {
  for (const auto& [name, args] : std::vector<std::pair<std::string, Map>>{
           {"plugin.load", {{"file", "robot_files"}}},
           {"plugin.check", {{"file", "robot_files"}}},
           {"recovery.list", {}},
           {"provider.default", {{"interface", "ik"}, {"name", "numeric"}, {"keep", "user"}}}}) {
    const auto result = call(name, args);
    ASSERT_FALSE(result.ok()) << name;
    EXPECT_EQ(result.error().code, ErrorCode::permission) << result.error().sentence();
  }
}

// A text of a plot is a text, and nothing that a shell is given.
TEST_F(Confined, WordsInPlotsAreNotRun) {
  lua::LuaState lua(app(), *guest_, {.print = [](std::string_view) {}, .module_path = {}});
  const auto made = lua.run_string(
      "arm = robot.create{name = 'arm', convention = 'dh', links = {{a = 0.5, mass = 1}}}\n"
      "run = arm:simulate{q = {0}, duration = 0.1}\n"
      "pcall(run.plot, run, {file = 'run.png', columns = {'q1'}, title = 'a`touch " +
          (outside_ / "run_by_a_shell").string() + "`b'})",
      "test");
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_EQ(fs::exists(root_ / "run.png"), !program_on_path("gnuplot").empty());
  EXPECT_FALSE(fs::exists(outside_ / "run_by_a_shell"));
}

// Files, exports and removals while another process swaps a folder and a link.
TEST_F(Confined, SwappingALinkInDoesNotLeadOut) {
  const fs::path name = root_ / "swapped", link = root_ / "link";
  fs::create_directories(name);
  fs::create_symlink(outside_, link);
  put(outside_ / "m.mtr", kSecret);
  const auto before = others();
  good("material.create", {{"name", "m"}, {"density", 1000}});
  std::atomic<bool> is_over{false};
  std::thread swaps([&] {
    while (!is_over)  // both are there at every moment, under one name or the other
      (void)::renameat2(AT_FDCWD, name.c_str(), AT_FDCWD, link.c_str(), RENAME_EXCHANGE);
  });
  std::size_t done = 0, refused = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  while (std::chrono::steady_clock::now() < end) {
    const auto written = call("file.write", {{"file", "swapped/a"}, {"base64", "AAE="}});
    done += written.ok();
    refused += !written.ok() && written.error().code == ErrorCode::permission;
    (void)call("file.write", {{"file", "swapped/b"}, {"base64", "AAE="}, {"append", true}}).ok();
    (void)call("material.save", {{"id", "m"}, {"file", "swapped/m.mtr"}, {"overwrite", true}});
    if (const auto read = call("file.read", {{"file", "swapped/m.mtr"}}); read.ok()) {
      EXPECT_NE(read->as_map()->find("size")->text(), std::to_string(std::strlen(kSecret)));
    }
    (void)call("file.remove", {{"file", "swapped/m.mtr"}}).ok();
    (void)call("file.remove", {{"file", "swapped/secret"}}).ok();
    (void)call("file.export_2006", {{"id", "m"}, {"folder", "swapped"}}).ok();
  }
  is_over = true;
  swaps.join();
  EXPECT_GT(done, 0U) << "the folder was never met";
  EXPECT_GT(refused, 0U) << "the link was never met";
  EXPECT_EQ(others(), before);
}

}  // namespace
}  // namespace robomosp::ioci
