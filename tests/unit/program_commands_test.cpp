// SPDX-License-Identifier: Apache-2.0
// Programs as records: files of source, faults as values, undo, save and load, three-address code.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

class ProgramCommands : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  static std::string read(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  fs::path folder_ = fs::temp_directory_path() / ("programs-" + std::to_string(::getpid()));
};

TEST_F(ProgramCommands, FaultsAreValuesAndUndoBringsTheTextBack) {
  const Value id = call("program.create", {{"name", "p"},
                                           {"source",
                                            "PROGRAM p;\nVAR INT: i;\nBEGIN\ni := 1;\n"
                                            "ENDPROGRAM;\n"}});
  EXPECT_EQ(at(call("program.check", {{"id", id}}), "correct").text(), "true");
  call("program.set_file",
       {{"id", id}, {"name", "p.irl"}, {"text", "PROGRAM p;\nBEGIN\n  j := 1;\nENDPROGRAM;\n"}});
  const Value found = call("program.check", {{"id", id}});
  const Map& fault = *(*at(found, "faults").as_list())[0].as_map();
  EXPECT_EQ(*fault.find("line")->as_int(), 3);
  EXPECT_EQ(*fault.find("column")->as_int(), 3);
  EXPECT_EQ(*fault.find("message")->as_string(), "nothing is named j.");
  // What needs a correct program says the first fault.
  const Error e = fails("program.code", {{"id", id}});
  EXPECT_EQ(e.sentence(), "program \"p\", p.irl:3:3: nothing is named j.");
  call("document.undo");
  EXPECT_EQ(at(call("program.check", {{"id", id}}), "correct").text(), "true");
}

TEST_F(ProgramCommands, ImportTakesTheFilesThatAProgramNames) {
  write("cell.ssi", "PROGRAM cell;\nCONST\n  INT: n := 2;\nENDPROGRAM;\n");
  write("tools.irl", "MODULE tools;\nEXPORT k;\nCONST INT: k := 1;\nENDMODULE;\n");
  // Letters of another time are read as ISO 8859-1.
  write("p.irl",
        "PROGRAM p;\r\nSYSTEM_SPECIFICATION 'cell.ssi';\r\nIMPORT tools;\r\n{ m\xe1ximo }\r\nVAR "
        "INT: i;\r\nBEGIN\r\n  i := n + k;\r\nENDPROGRAM;\r\n");
  const Value id = call("program.import", {{"file", (folder_ / "p.irl").string()}});
  EXPECT_EQ(call("program.files", {{"id", id}}).as_list()->size(), 3U);
  EXPECT_EQ(at(call("program.check", {{"id", id}}), "errors").text(), "0");
  const std::string source = *call("program.source", {{"id", id}}).as_string();
  EXPECT_NE(source.find("m\xc3\xa1ximo"), std::string::npos);
  EXPECT_NE(source.find("\r\n"), std::string::npos);

  // The file holds all of it, and gives the same bytes again.
  const fs::path file = folder_ / "p.prg";
  call("program.save", {{"id", id}, {"file", file.string()}});
  const std::string first = read(file);
  call("document.clear");
  const Value again = call("program.load", {{"file", file.string()}});
  EXPECT_EQ(*call("program.source", {{"id", again}}).as_string(), source);
  call("program.save", {{"id", again}, {"file", (folder_ / "q.prg").string()}});
  EXPECT_EQ(read(folder_ / "q.prg"), first);
  // What is there is not written over unasked.
  EXPECT_NE(
      fails("program.export", {{"id", again}, {"folder", folder_.string()}}).message.find("p.irl"),
      std::string::npos);
  fs::create_directories(folder_ / "out");
  call("program.export", {{"id", again}, {"folder", (folder_ / "out").string()}});
  EXPECT_EQ(read(folder_ / "out" / "cell.ssi"), read(folder_ / "cell.ssi"));
}

TEST_F(ProgramCommands, AFileThatIsMissingIsReportedAndThenAFault) {
  write("p.irl", "PROGRAM p;\nDATALIST 'values.dls';\nBEGIN\nENDPROGRAM;\n");
  const Value id = call("program.import", {{"file", (folder_ / "p.irl").string()}});
  const Value found = call("program.check", {{"id", id}});
  EXPECT_EQ(*(*at(found, "faults").as_list())[0].as_map()->find("message")->as_string(),
            "the list of data 'values.dls' is not among the program's files.");
  call("program.set_file", {{"id", id}, {"name", "values.dls"}, {"text", ""}});
  EXPECT_EQ(at(call("program.check", {{"id", id}}), "errors").text(), "0");
  call("program.remove_file", {{"id", id}, {"name", "values.dls"}});
  EXPECT_NE(fails("program.remove_file", {{"id", id}, {"name", "p.irl"}}).message.find("itself"),
            std::string::npos);
  EXPECT_NE(fails("program.set_file", {{"id", id}, {"name", "../p.irl"}, {"text", ""}})
                .message.find("no name of a file"),
            std::string::npos);
}

TEST_F(ProgramCommands, TheTreeHasRoutinesStatementsAndMotions) {
  const Value id = call(
      "program.create",
      {{"name", "p"},
       {"source",
        "PROGRAM p;\nVAR INT: i := 2; POSE: a;\nPROCEDURE q (INOUT REAL: z);\nBEGIN\n  IF z > 1.0 "
        "THEN\n    MOVE LIN a SPEED := z + 1.0;\n  ENDIF;\nENDPROC;\nBEGIN\nENDPROGRAM;\n"}});
  const Value tree = call("program.tree", {{"id", id}});
  const Value& q = (*at(tree, "routines").as_list())[1];
  EXPECT_EQ(at((*at(q, "parameters").as_list())[0], "mode").text(), "inout");
  const Value& condition = (*at((*at(q, "statements").as_list())[0], "statements").as_list())[0];
  EXPECT_EQ(*at(condition, "a").as_string(), "z > 1.0");
  const Value& move = (*at(condition, "statements").as_list())[0];
  EXPECT_EQ(*at(move, "interpolation").as_string(), "LIN");
  EXPECT_EQ(*at(at(move, "attributes"), "SPEED").as_string(), "z + 1.0");
}

TEST_F(ProgramCommands, FilesOfCodeAreReadAgain) {
  const Value id = call("program.create",
                        {{"name", "p"}, {"source", "PROGRAM p; BEGIN WAIT 1.5 SEC; ENDPROGRAM;"}});
  const fs::path file = folder_ / "p.code";
  call("program.code", {{"id", id}, {"file", file.string()}});
  EXPECT_EQ(read(file), *call("program.code", {{"id", id}}).as_string());
  const Value read_back = call("program.read_code", {{"file", file.string()}});
  EXPECT_EQ(at(read_back, "routines").as_list()->size(), 1U);
  write("bad.code", "robomosp code 1\nROUTINE r0 #0 'p'\nFLY - - -\n");
  EXPECT_EQ(fails("program.read_code", {{"file", (folder_ / "bad.code").string()}}).where,
            "line 3 of three-address code");
}

TEST_F(ProgramCommands, ANewNameAndALayoutAreOneStepEachAndCanBeUndone) {
  const std::string text =
      "PROGRAM p;\nDATALIST 'd.dls';\nVAR POSE: a;\nBEGIN\nMOVE LIN a;\nENDPROGRAM;\n";
  const Value id = call("program.create", {{"name", "p"}, {"source", text}});
  call("program.set_file",
       {{"id", id}, {"name", "d.dls"}, {"text", "a := POSE((1,2,3),ORIZYX(0,0,0));\n"}});
  const Value done =
      call("program.rename_symbol", {{"id", id}, {"line", 5}, {"column", 10}, {"to", "here"}});
  EXPECT_EQ(*at(done, "changed").as_int(), 3);
  EXPECT_EQ(call("program.source", {{"id", id}, {"name", "d.dls"}}).text().substr(0, 9),
            "here := P");
  call("document.undo");
  EXPECT_EQ(call("program.source", {{"id", id}, {"name", "d.dls"}}).text().substr(0, 9),
            "a := POSE");
  // Telling changes nothing; there is nothing to undo behind it but the file.
  EXPECT_EQ(at(call("program.format", {{"id", id}, {"check", true}}), "changed").text(), "true");
  EXPECT_EQ(call("program.source", {{"id", id}}).text(), text);
  call("program.format", {{"id", id}});
  EXPECT_NE(call("program.source", {{"id", id}}).text().find("\n  MOVE LIN a;"), std::string::npos);
  EXPECT_EQ(at(call("program.format", {{"id", id}}), "changed").text(), "false");
  call("document.undo");
  EXPECT_EQ(call("program.source", {{"id", id}}).text(), text);
  // Places outside of the text, files that are not there, names that do not go.
  EXPECT_NE(fails("program.hover", {{"id", id}, {"line", 99}, {"column", 1}})
                .sentence()
                .find("no line 99"),
            std::string::npos);
  EXPECT_NE(fails("program.hover", {{"id", id}, {"line", 1}, {"column", 99}})
                .sentence()
                .find("no column 99"),
            std::string::npos);
  EXPECT_FALSE(fails("program.tokens", {{"id", id}, {"name", "x"}}).message.empty());
  EXPECT_NE(
      fails("program.rename_symbol", {{"id", id}, {"line", 5}, {"column", 10}, {"to", "POSE"}})
          .sentence()
          .find("POSE"),
      std::string::npos);
}

}  // namespace
}  // namespace robomosp
