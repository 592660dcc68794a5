// SPDX-License-Identifier: Apache-2.0
// Names in every language, and files whose names, encodings and forms differ from the usual ones.
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <robomosp/sdk/names.h>
#include <robomosp/sdk/utf8_text.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

TEST(NamesOfFiles, BecomeNamesThatAreAllowed) {
  const std::pair<const char*, const char*> all[] = {
      {"Träger", "Träger"},        {"部品", "部品"},     {"front left.link", "front_left_link"},
      {"3parts", "n3parts"},       {"--x--", "x--"},     {"a//b", "a_b"},
      {"\xCC\x81x", "n\xCC\x81x"}, {"\xFF\xFE", "part"}, {"", "part"}};
  for (const auto& [wanted, name] : all) {
    EXPECT_EQ(valid_name(wanted, "part"), name) << wanted;
    EXPECT_TRUE(is_name(name)) << name;
  }
  EXPECT_EQ(valid_name("", "3x"), "n3x");
  std::string many;
  for (int i = 0; i < 100; ++i) many += "部";
  EXPECT_EQ(valid_name(many, "part").size(), 78U) << "whole letters only";
  EXPECT_TRUE(is_name(valid_name(many, "part")));
}

TEST(TextOfFiles, IsUtf8WhateverItWas) {
  EXPECT_EQ(utf8_text("\xEF\xBB\xBFß").text, "ß");
  EXPECT_EQ(utf8_text(std::string("\xFF\xFE"
                                  "d\0\x34\xD8\x1E\xDD",
                                  8))
                .text,
            "d\xF0\x9D\x84\x9E");
  EXPECT_EQ(utf8_text(std::string("\xFE\xFF"
                                  "\0d\xD8\x34\xDD\x1E",
                                  8))
                .text,
            "d\xF0\x9D\x84\x9E");
  EXPECT_EQ(utf8_text("Tr\xE4ger").text, "Träger");
  EXPECT_EQ(utf8_text("Tr\xE4ger").was, TextEncoding::latin1);
}

class Names : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    folder_ = fs::path(testing::TempDir()) / "robomosp_names";
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "meshes");
    run("folder = '" + folder_.string() + "/'");
  }
  void TearDown() override {
    fs::remove_all(folder_);
    LuaProgramTest::TearDown();
  }
  void put(const fs::path& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  /// A tetrahedron with three edges of 1 along the axes, of volume 1/6.
  static std::string stl(std::string head, const std::string& behind, std::uint32_t count = 4) {
    head.resize(80, ' ');
    std::string out = head + std::string(reinterpret_cast<const char*>(&count), 4);
    const float v[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const auto& t : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
      out += std::string(12, '\0');
      for (const int i : t) out.append(reinterpret_cast<const char*>(v[i]), 12);
      out += std::string(2, '\0');
    }
    return out + behind;
  }
  static std::string urdf(const std::string& robot, const std::string& link,
                          const std::string& mesh) {
    return "<?xml version=\"1.0\"?>\n<robot name=\"" + robot +
           "\"><link name=\"base\"/><link name=\"" + link +
           "\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" "
           "ixz=\"0\" iyz=\"0\"/></inertial><visual><geometry><mesh filename=\"" +
           mesh +
           "\"/></geometry></visual></link><joint name=\"j\" type=\"continuous\"><parent "
           "link=\"base\"/><child link=\"" +
           link + "\"/><axis xyz=\"0 0 1\"/></joint></robot>";
  }

  fs::path folder_;
};

TEST_F(Names, OfRecordsAndMembersAreSavedAndFoundAgain) {
  run("m = material.create{name = '鋼', density = 7800}\n"
      "s = solid.create{name = 'Träger', material = m, root = {kind = 'box', name = 'Kasten ü', x "
      "= 1, y "
      "= 1, z = 1}}\n"
      "o = object.create{name = 'Деталь', parts = {{what = s, name = 'Часть'}}}\n"
      "r = robot.create{name = '部品', links = {{name = 'Gelenk Ö', a = 1, mass = 1}, {name = "
      "'थंब', a = "
      "0.5, mass = 1}}}\n"
      "w = world.create{name = 'Мир'}\n"
      "w:add_robot{robot = r, name = 'Арм', q = {0.1, 0.2}}\n"
      "w:add_object{what = o, name = 'Ящик', position = {3, 0, 0}}\n"
      "w:add_frame{name = 'Maß', position = {1, 0, 0}}\n"
      "before = w:text()\n"
      "w:save{file = folder .. 'Мир.wld'}");
  for (const char* file : {"Мир.wld", "部品.rbt", "Деталь.part", "Träger.csg", "鋼.mtr"})
    EXPECT_TRUE(fs::exists(folder_ / file)) << file;
  app().document.clear();
  run("w = world.load{file = folder .. 'Мир.wld'}\n"
      "assert(w:text() == before)\n"
      "assert(robot '部品' and solid 'Träger' and object 'Деталь' and material '鋼')\n"
      "assert(robot('部品'):describe().links[2].name == 'थंब')");
}

TEST_F(Names, GoThroughFilesOfOthersAndBack) {
  run("r = robot.create{name = '部品', links = {{name = 'Gelenk_Ö', a = 1, mass = 1}, {name = "
      "'थंब', a = "
      "0.5, mass = 1}}}\n"
      "export{what = r, file = folder .. 'r.urdf'}\n"
      "o = object.create{name = 'Деталь', parts = {{what = solid.create{name = 'Träger', root = "
      "{kind "
      "= 'box', x = 1, y = 1, z = 1}}, name = 'Часть'}, {what = solid.create{name = 'Achse ß', "
      "root = "
      "{kind = 'sphere', radius = 1}}, name = '軸', position = {3, 0, 0}}}}\n"
      "for _, f in ipairs{'step', 'glb', '3mf'} do export{what = o, file = folder .. 'o.' .. f} "
      "end");
  for (const char* f : {"glb", "3mf", "step"}) {
    app().document.clear();
    run(std::string("import{file = folder .. 'o.") + f +
        "'}\n"
        "names = {}\n"
        "for _, p in ipairs(object('o'):describe().parts) do names[#names + 1] = p.name end\n"
        "names = table.concat(names, ' ')\n"
        "assert(names == 'Часть 軸', names)");
  }
  run("o = object('o')\n"
      "said = export{what = o, file = folder .. 'o.igs'}.notes[1]\n"
      "assert(said:find('ASCII only') and said:find('Часть'), said)");
  app().document.clear();
  run("import{file = folder .. 'r.urdf'}\n"
      "links = robot('部品'):describe().links\n"
      "found = {}\n"
      "for _, l in ipairs(links) do found[l.name] = true end\n"
      "assert(found['Gelenk_Ö'] and found['थंब'])");
}

TEST_F(Names, OfMeshesAreFoundWithAndWithoutEscapes) {
  put("meshes/a b.stl", stl("", ""));
  put("meshes/c%20d.stl", stl("", ""));
  for (const char* mesh : {"meshes/a%20b.stl", "meshes/a b.stl", "meshes/c%20d.stl",
                           "meshes/c%2520d.stl", "file://meshes/a%20b.stl"}) {
    app().document.clear();
    put("r.urdf", urdf("Träger", "部品", mesh));
    run("import{file = folder .. 'r.urdf'}\n"
        "assert(#solid.list() == 1)");
  }
  app().document.clear();
  put("r.urdf", urdf("r", "l", "meshes/%2e%2e/%2e%2e/other.stl"));
  run("import{file = folder .. 'r.urdf'}\nassert(#solid.list() == 0)");
}

TEST_F(Names, AreReadFromUtf16AndLatin1) {
  put("meshes/a.stl", stl("", ""));
  std::string wide("\xFF\xFE", 2);
  const std::string plain = urdf("Tr#ger", "l", "meshes/a.stl");
  for (const char c : plain) {
    wide += c == '#' ? '\xE4' : c;
    wide += '\0';
  }
  put("wide.urdf", wide);
  std::string old = plain;
  old[old.find('#')] = '\xE4';
  put("old.urdf", old);
  for (const char* file : {"wide.urdf", "old.urdf"}) {
    app().document.clear();
    run(std::string("import{file = folder .. '") + file + "'}\nassert(robot 'Träger')");
  }
}

TEST_F(Names, AndHeadersOfStlThatBeginWithSolidAreHeaders) {
  const std::pair<const char*, std::string> files[] = {
      {"plain", stl("made by us", "")},
      {"solid", stl("solid made by us", "")},
      {"solid_behind", stl("solid made by us", "colours of somebody")},
      {"behind", stl("made by us", std::string(10, '\0'))},
      {"two_lines", stl("solid\nfacet normal 0 0 1", std::string(84, ' '))}};
  for (const auto& [name, bytes] : files) {
    app().document.clear();
    put(std::string(name) + ".stl", bytes);
    run(std::string("m = import{file = folder .. '") + name +
        ".stl', unit = 'm'}\n"
        "v = solid.list()[1]:mass().volume\n"
        "assert(math.abs(v - 1 / 6) < 1e-6, v)");
  }
  put("short.stl", stl("solid made by us", "", 5));
  EXPECT_NE(eval("import{file = folder .. 'short.stl'}").find("should hold 5 triangles"),
            std::string::npos);
}

}  // namespace
}  // namespace robomosp::lua
