// SPDX-License-Identifier: Apache-2.0
// An interface of its own, of this file and its header alone: with a guard, a default, providers
// from a plugin and from a script; nothing else knows of it. And none of the program's own files of
// interfaces is lost by the linker.
#include "own_interface.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"
#include "kernel/provider_process/proxies.h"
#include "lua/provide.h"
#include "shell/plugin_check.h"
#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::Taster;

// --- what a file of kernel/interfaces holds --------------------------------------------------

class GuardedTaster final : public Taster {
 public:
  GuardedTaster(const ProviderInfo& info, Taster* inner) : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<double> taste(double salt) const override {
    auto said = guarded(name_, [&] { return inner_->taste(salt); });
    if (said.ok() && !(*said >= 0 && *said <= 1))
      return broken_answer(name_, "gave a taste outside 0..1");
    return said;
  }

 private:
  std::string name_;
  std::unique_ptr<Taster> inner_;
};

RMP_INTERFACES(taste, guarded_interface<Taster, GuardedTaster>("sweet"));

// --- what a file modules/lua/provide_*.cpp holds ---------------------------------------------

class LuaTaster final : public Taster {
 public:
  explicit LuaTaster(lua::ProviderPtr p) : p_(std::move(p)) {}
  Result<double> taste(double salt) const override {
    double said = 0;
    lua::Call call(*p_);
    RMP_TRY(call.run([&](lua::Impl& impl, lua_State* L) -> Result<void> {
      call.push_function(L, "taste");
      lua_pushnumber(L, salt);
      RMP_TRY(lua::call(impl, L, 1, 1));
      said = lua_tonumber(L, -1);
      return {};
    }));
    return said;
  }

 private:
  lua::ProviderPtr p_;
};

RMP_LUA_PROVIDER(Taster, LuaTaster, "taste");

// ---------------------------------------------------------------------------------------------

class OwnInterface : public test::CommandTest {
 protected:
  Result<double> taste(const char* provider, double salt) {
    auto made = app().registry.create<Taster>(provider);
    if (!made.ok()) return std::move(made).error();
    return (*made)->taste(salt);
  }
};

TEST_F(OwnInterface, HasProvidersFromAPluginBehindItsGuardAndADefault) {
  const Value report = call("plugin.load", {{"file", TASTER_PLUGIN}});
  EXPECT_EQ(report.as_map()->find("providers")->as_list()->size(), 2U) << report.text();
  EXPECT_EQ(*taste("sweet", 0.25), 0.75);
  EXPECT_EQ(taste("odd", 0).error().sentence(),
            "provider \"odd\" gave a taste outside 0..1. Report it to the provider's author or "
            "choose another provider.");
  EXPECT_NE(taste("odd", 1).error().sentence().find("provider \"odd\" threw: too salty"),
            std::string::npos);
  // What was found is no default, not even of the standard's name; what came with the program is.
  EXPECT_EQ(standard_provider(Taster::kInterfaceId), "sweet");
  EXPECT_FALSE(taste("", 0).ok());
  ProviderInfo info;
  info.interface_id = Taster::kInterfaceId;
  info.origin = "test";
  info.shipped = true;
  struct Fixed final : Taster {
    explicit Fixed(double v) : value(v) {}
    Result<double> taste(double) const override { return value; }
    double value;
  };
  info.name = "bitter";
  ASSERT_TRUE(app()
                  .registry
                  .add(info, []() -> Result<void*> { return static_cast<Taster*>(new Fixed(0.5)); })
                  .ok());
  EXPECT_EQ(*taste("", 0), 0.5) << "the only one that came with the program";
  info.name = "sweet";
  ASSERT_TRUE(
      app()
          .registry
          .add(
              info, []() -> Result<void*> { return static_cast<Taster*>(new Fixed(0.125)); }, true)
          .ok());
  EXPECT_EQ(*taste("", 0), 0.125) << "the standard";
  EXPECT_EQ(call("provider.default", {{"interface", "taste"}}).text(), "sweet");
  EXPECT_EQ(call("provider.list", {{"interface", "taste"}}).as_list()->size(), 3U);
  const shell::PluginCheck checked = shell::check_plugin(TASTER_PLUGIN);
  EXPECT_EQ(checked.exit_code, 0) << checked.text;
  EXPECT_NE(checked.text.find("robomosp.taste/1 sweet: Likes no salt."), std::string::npos);
}

TEST_F(OwnInterface, IsProvidedByAScript) {
  lua::LuaState state(app(), session_);
  const auto run = [&](const char* code) {
    auto r = state.eval(code);
    return r.ok() ? *r : r.error().sentence();
  };
  EXPECT_EQ(run("ioci.provide('robomosp.taste/1', 'salty', function(salt) return salt end)"), "");
  EXPECT_EQ(*taste("salty", 0.75), 0.75);
  EXPECT_NE(taste("salty", 2).error().sentence().find("\"salty\" gave a taste outside 0..1"),
            std::string::npos);
  EXPECT_NE(run("ioci.provide('robomosp.taste/1', 'x', {toste = print})")
                .find("the table has no function taste"),
            std::string::npos);
}

/// Names of the files below a folder that contain a line, and those that registered themselves.
std::set<std::string> sources_with(const char* folder, const std::string& line) {
  std::set<std::string> found;
  for (const auto& entry : fs::directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) / folder)) {
    if (entry.path().extension() != ".cpp") continue;
    std::stringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    if (text.str().find("\n" + line) != std::string::npos)
      found.insert(entry.path().filename().string());
  }
  return found;
}
std::set<std::string> names_of(const std::vector<std::string>& files) {
  std::set<std::string> names;
  for (const std::string& file : files) names.insert(fs::path(file).filename().string());
  names.erase("own_interface_test.cpp");
  return names;
}

TEST_F(OwnInterface, NoFileOfInterfacesIsLost) {
  const auto interfaces = sources_with("kernel/interfaces", "RMP_INTERFACES(");
  EXPECT_GE(interfaces.size(), 8U);
  EXPECT_EQ(names_of(InterfaceFile::files()), interfaces);
  const auto adapters = sources_with("modules/lua", "RMP_LUA_PROVIDER(");
  EXPECT_GE(adapters.size(), 8U);
  EXPECT_EQ(names_of(lua::LuaInterfaceFile::files()), adapters);
  // Each default is there and came with the program.
  for (const InterfaceEntry* entry : InterfaceFile::all()) {
    if (entry->standard.empty() || entry->id == Taster::kInterfaceId) continue;
    const auto info = app().registry.find(entry->id, entry->standard);
    EXPECT_TRUE(!info.ok() || info->shipped) << entry->id;
  }
}

TEST_F(OwnInterface, EveryInterfaceRunsApartOrSaysWhyNot) {
  for (const InterfaceEntry* entry : InterfaceFile::all()) {
    const bool runs_apart = apart::interface_wire(entry->id) != nullptr;
    const bool is_own = entry->id == Taster::kInterfaceId;
    EXPECT_NE(runs_apart, apart::runs_in_program_only(entry->id) || is_own)
        << entry->id << " needs a proxy or a reason in kernel/provider_process/proxies.cpp";
  }
  EXPECT_EQ(apart::not_apart(Taster::kInterfaceId),
            "the interface robomosp.taste/1 has no form between processes");
}

// Files that take part in an interface, as far as they are not its users, against the page.
TEST_F(OwnInterface, ThePageNamesAllPlaces) {
  const fs::path root = ROBOMOSP_SOURCE_DIR;
  std::stringstream text;
  text << std::ifstream(root / "docs/developer/add_an_interface.md").rdbuf();
  const std::string page = text.str();
  std::size_t places = 0;
  for (const std::string name : {"controller", "integrator", "planner", "retimer"})
    for (const char* folder : {"sdk", "kernel", "modules/lua", "tests/abi", "tests/fuzz"})
      for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
        const fs::path path = fs::relative(entry.path(), root);
        const std::string extension = path.extension();
        if (extension != ".cpp" && extension != ".h") continue;
        std::stringstream source;
        source << std::ifstream(entry.path()).rdbuf();
        const std::string file = source.str();
        if (path.filename() != name + ".h" &&
            file.find("<robomosp/sdk/" + name + ".h>") == std::string::npos)
          continue;
        // By its path, by that of any interface, or by its folder.
        std::string any = path.string();
        if (const auto at = any.rfind(name); at != std::string::npos)
          any.replace(at, name.size(), "<name>");
        bool is_named =
            page.find(path.string()) != std::string::npos || page.find(any) != std::string::npos;
        for (fs::path up = path.parent_path();
             !is_named && up.string().find('/') != std::string::npos; up = up.parent_path())
          is_named = page.find("`" + up.string() + "`") != std::string::npos ||
                     page.find("`" + up.string() + "/`") != std::string::npos;
        EXPECT_TRUE(is_named) << path << " takes part in the interface " << name
                              << ": name it in docs/developer/add_an_interface.md";
        ++places;
      }
  EXPECT_GE(places, 20U);
}

}  // namespace
}  // namespace robomosp
