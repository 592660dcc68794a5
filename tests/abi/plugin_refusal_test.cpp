// SPDX-License-Identifier: Apache-2.0
// Each way in which a plugin can be wrong gives its own sentence, and none stops the program.
#include "kernel/plugin_loader.h"

#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>
#include <robomosp/sdk/ik.h>

#include <unistd.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;

fs::path plugin_file(const std::string& name) {
  return fs::canonical(ABI_PLUGIN_DIR) / ("abi_" + name + ".so");
}

/// A folder that is gone again at the end of the test.
class TempFolder {
 public:
  TempFolder() {
    std::string pattern = (fs::temp_directory_path() / "rmp-abi-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~TempFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// The refusal's sentence without the file's name in front.
std::string refusal_of(const std::string& name) {
  Registry registry;
  PluginLoader loader(registry);
  const PluginReport& report = loader.load(plugin_file(name).string());
  EXPECT_FALSE(report.loaded);
  EXPECT_TRUE(registry.list().empty());
  if (!report.refusal) return "not refused";
  EXPECT_EQ(report.refusal->where, "plugin \"" + plugin_file(name).string() + "\"");
  return report.refusal->sentence().substr(report.refusal->where.size() + 2);
}

TEST(PluginRefusal, ANameThatIsNowhereListsTheFolders) {
  Registry registry;
  PluginLoader loader(registry);
  loader.set_search_path({"/nowhere/a", "/nowhere/b"});
  EXPECT_EQ(loader.load("ik_dls").refusal->sentence(),
            "there is no plugin \"ik_dls\"; looked in \"/nowhere/a\" and \"/nowhere/b\". "
            "Check the name, or add its folder with --plugin-path or ROBOMOSP_PLUGIN_PATH.");
  EXPECT_EQ(loader.load("/nowhere/x.so").refusal->sentence(),
            "there is no plugin file \"/nowhere/x.so\". Check the path, or give the plugin's name "
            "to look it up.");
  EXPECT_EQ(loader.load("ik_dls").refusal->code, ErrorCode::not_found);
  EXPECT_EQ(loader.reports().size(), 2U);  // one a name
}

TEST(PluginRefusal, AFileThatIsNoLibrary) {
  const TempFolder folder;
  const fs::path file = fs::canonical(folder.path()) / "text.so";
  std::ofstream(file)
      << "this is not a shared library, whatever its name says, and long enough to have a header\n";
  Registry registry;
  PluginLoader loader(registry);
  EXPECT_EQ(loader.load(file.string()).refusal->sentence(),
            "plugin \"" + file.string() +
                "\": the dynamic linker cannot open it (invalid ELF header). "
                "Check that it is a shared library of this machine's kind.");
}

TEST(PluginRefusal, AMissingLibraryIsNamed) {
  EXPECT_EQ(
      refusal_of("missing_library"),
      "the dynamic linker cannot open it (libabi_absent_helper.so: cannot open shared object file: "
      "No such file or directory). Install the library \"libabi_absent_helper.so\", which it "
      "needs.");
}

TEST(PluginRefusal, AnUndefinedSymbolIsNamedAsInTheSource) {
  EXPECT_EQ(
      refusal_of("undefined_symbol"),
      "the dynamic linker cannot open it (undefined symbol: _ZN9elsewhere15needed_functionEi). "
      "Link it with the library that defines \"elsewhere::needed_function(int)\".");
}

TEST(PluginRefusal, ALibraryWithoutEntry) {
  EXPECT_EQ(
      refusal_of("no_entry"),
      "it is not a robomosp plugin: it does not export rmp_plugin_entry_v1. "
      "Build it with robomosp_add_plugin() and RMP_PLUGIN, or take it out of the plugin folder.");
}

TEST(PluginRefusal, AnEntryOfANewerSdk) {
  EXPECT_EQ(refusal_of("future_entry"),
            "it was built with a newer SDK (entry v2); this program offers v1. "
            "Rebuild it with SDK " RMP_SDK_VERSION " or update this program.");
}

TEST(PluginRefusal, AnotherAbiTagShowsBothAndTheDifference) {
  EXPECT_EQ(
      refusal_of("wrong_tag"),
      "its ABI tag \"rmp1000;itanium;libstdc++;cxx11=0;debug\" differs from this program's "
      "\"rmp1;itanium;libstdc++;cxx11=1\": rmp1000 instead of rmp1, cxx11=0 instead of cxx11=1, "
      "debug instead of nothing. Rebuild it with SDK " RMP_SDK_VERSION
      ", libstdc++ with its new strings, and without debug mode.");
  EXPECT_NE(refusal_of("no_tag").find("its ABI tag \"\" differs"), std::string::npos);
}

TEST(PluginRefusal, ATableThatIsTooSmall) {
  EXPECT_EQ(refusal_of("small_struct"),
            "its rmp_plugin has 16 bytes; at least " + std::to_string(sizeof(rmp_plugin)) +
                " are needed. Set struct_size = sizeof(rmp_plugin), or use the RMP_PLUGIN macro.");
}

TEST(PluginRefusal, AnEntryThatThrowsOrReturnsNothing) {
  EXPECT_EQ(refusal_of("entry_throws"),
            "its entry function threw: thrown by the entry. Report it to the plugin's author.");
  EXPECT_EQ(refusal_of("entry_null"),
            "its entry function returned nothing. Report it to the plugin's author.");
}

/// Remarks of a plugin of which only the providers named "sound" are usable.
std::vector<std::string> remarks_of(const std::string& name, std::vector<std::string> usable) {
  Registry registry;
  PluginLoader loader(registry);
  const PluginReport& report = loader.load(plugin_file(name).string());
  EXPECT_TRUE(report.loaded) << (report.refusal ? report.refusal->sentence() : "");
  EXPECT_EQ(report.providers, usable);
  EXPECT_EQ(registry.list().size(), usable.size());
  return report.remarks;
}

TEST(PluginRefusal, AnUnknownInterfaceIsSkippedAndTheRestLoads) {
  EXPECT_EQ(
      remarks_of("unknown_interface", {"robomosp.ik/1 sound"}),
      (std::vector<std::string>{
          "provider \"later\" is skipped: this program knows \"robomosp.ik/1\", not "
          "\"robomosp.ik/7\".",
          "provider \"pot\" is skipped: this program knows no interface \"robomosp.teapot/1\"; it "
          "knows "
          "robomosp.collision/1, robomosp.controller/1, robomosp.csg/1, robomosp.curve/2, "
          "robomosp.exporter/1, robomosp.forward_dynamics/1, robomosp.ik/1, "
          "robomosp.importer/1, robomosp.integrator/1, robomosp.inverse_dynamics/1, "
          "robomosp.joint_segment/2, robomosp.language/1, robomosp.module/1, "
          "robomosp.motion_law/2, "
          "robomosp.orientation/2, robomosp.physics/1, robomosp.planner/1, "
          "robomosp.post/1, robomosp.primitive/1, robomosp.program_reader/1, "
          "robomosp.renderer/2, robomosp.retimer/1, "
          "robomosp.robot_code/1, robomosp.segment/2 and robomosp.tip_force/1."}));
}

TEST(PluginRefusal, ProvidersWithoutNameInterfaceOrCreateAreSkipped) {
  EXPECT_EQ(remarks_of("null_names", {"robomosp.ik/1 sound"}),
            (std::vector<std::string>{
                "provider number 1 is skipped: it has no name.",
                "provider \"homeless\" is skipped: it names no interface.",
                "provider \"uncreatable\" is skipped: it has no create function."}));
}

TEST(PluginRefusal, ASecondProviderOfTheSameNameIsSkipped) {
  EXPECT_EQ(remarks_of("duplicates", {"robomosp.ik/1 twin"}),
            (std::vector<std::string>{
                "provider \"twin\" is skipped: ik provider \"twin\" exists already, from \"" +
                plugin_file("duplicates").string() + "\"."}));
}

TEST(PluginRefusal, ABrokenParameterTableSkipsItsProvider) {
  EXPECT_EQ(remarks_of("bad_table", {}),
            (std::vector<std::string>{
                "provider \"misdefault\" is skipped: parameter \"speed\" has a bad default: "
                "90 deg is an angle; a speed (m/s) is expected.",
                "provider \"tableless\" is skipped: its parameter table is broken.",
                "provider \"cut_short\" is skipped: its parameter table is broken."}));
}

TEST(PluginRefusal, ACreateThatFailsIsAnErrorOfTheProvider) {
  Registry registry;
  PluginLoader loader(registry);
  ASSERT_TRUE(loader.load(plugin_file("create_fails").string()).loaded);
  EXPECT_EQ(registry.create<IkSolver>("thrower").error().sentence(),
            "provider \"ik thrower\" threw: thrown by create. Report it to the provider's author "
            "or choose another provider.");
  EXPECT_EQ(registry.create<IkSolver>("unlicensed").error().sentence(),
            "provider \"robomosp.ik/1 unlicensed\" could not be made: no licence file was found. "
            "Choose another provider or see the documentation of this one.");
  EXPECT_EQ(registry.create<IkSolver>("silent").error().sentence(),
            "provider \"robomosp.ik/1 silent\" could not be made and gave no reason. "
            "Choose another provider or see the documentation of this one.");
}

TEST(PluginLoading, AGoodPluginGivesItsProviderSchemaAndLog) {
  Registry registry;
  Messages messages;
  PluginLoader loader(registry, &messages);
  const PluginReport& report = loader.load(plugin_file("good").string());
  ASSERT_TRUE(report.loaded);
  EXPECT_EQ(report.id, "org.robomosp.abi");
  EXPECT_EQ(report.version, "1.2.3");
  EXPECT_TRUE(report.remarks.empty());
  const auto info = registry.find("robomosp.ik/1", "abi_good");
  ASSERT_TRUE(info.ok());
  EXPECT_EQ(info->tags, (std::vector<std::string>{"serial", "dof=6"}));
  ASSERT_EQ(info->schema.size(), 1U);
  EXPECT_EQ(info->schema[0].default_value, Value(0.01));
  auto ik = registry.create<IkSolver>("");
  ASSERT_TRUE(ik.ok());
  EXPECT_TRUE((*ik)->prepare(RobotModel{}, *make_params({})).ok());
  ASSERT_EQ(messages.recent().size(), 1U);
  EXPECT_EQ(messages.recent()[0].text, "an idle solver was made");
  EXPECT_EQ(messages.recent()[0].source, "abi_good");
}

TEST(PluginLoading, AFileIsLoadedOnceAlsoThroughALink) {
  const TempFolder folder;
  fs::create_symlink(plugin_file("good"), folder.path() / "linked.so");
  Registry registry;
  PluginLoader loader(registry);
  loader.set_search_path({folder.path()});
  ASSERT_TRUE(loader.load("linked").loaded);
  EXPECT_EQ(loader.reports()[0].file, plugin_file("good"));
  EXPECT_TRUE(loader.load(plugin_file("good").string()).loaded);
  EXPECT_EQ(loader.reports().size(), 1U);
  EXPECT_EQ(registry.list().size(), 1U);
}

TEST(PluginLoading, TheFirstFolderWinsAndBadFilesDoNotStopTheOthers) {
  const TempFolder first, second;
  fs::create_symlink(plugin_file("good"), first.path() / "a.so");
  fs::create_symlink(plugin_file("no_entry"), second.path() / "a.so");
  fs::create_symlink(plugin_file("wrong_tag"), second.path() / "b.so");
  fs::create_symlink(plugin_file("null_names"), second.path() / "c.so");
  std::ofstream(second.path() / "readme.txt") << "not looked at\n";
  fs::create_symlink("/nowhere/x.so", second.path() / "dangling.so");
  Registry registry;
  Messages messages;
  PluginLoader loader(registry, &messages);
  loader.set_search_path({first.path(), "/nowhere", second.path()});
  loader.load_all();
  ASSERT_EQ(loader.reports().size(), 3U);
  EXPECT_TRUE(loader.reports()[0].loaded);
  EXPECT_FALSE(loader.reports()[1].loaded);
  EXPECT_TRUE(loader.reports()[2].loaded);
  EXPECT_EQ(registry.list().size(), 2U);
  EXPECT_EQ(messages.recent().size(), 5U);  // one hidden, one refused, three skipped providers
}

TEST(PluginLoading, TheSearchPathFollowsItsOrderOfPrecedence) {
  ::setenv("ROBOMOSP_PLUGIN_PATH", "/env/a:/env/b", 1);
  ::setenv("HOME", "/home/someone", 1);
  ::unsetenv("XDG_DATA_HOME");
  const auto path = PluginLoader::search_path({"/given", "/env/b"});
  ::unsetenv("ROBOMOSP_PLUGIN_PATH");
  ASSERT_EQ(path.size(), 6U);
  EXPECT_EQ(path[0], "/given");
  EXPECT_EQ(path[1], "/env/b");
  EXPECT_EQ(path[2], "/env/a");
  EXPECT_EQ(path[3], fs::path(ROBOMOSP_PLUGIN_DIR));  // this program stands in <build>/tests
  EXPECT_EQ(path[4], "/home/someone/.local/share/robomosp/plugins");
  EXPECT_EQ(path[5], "/home/someone/.local/lib/robomosp/plugins");
}

}  // namespace
}  // namespace robomosp
