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
  EXPECT_EQ(*fault.find("message")->as_string(), "there is no name j.");
  // What needs a correct program says the first fault.
  const Error e = fails("program.code", {{"id", id}});
  EXPECT_EQ(e.sentence(), "program \"p\", p.irl:3:3: there is no name j.");
  call("document.undo");
  EXPECT_EQ(at(call("program.check", {{"id", id}}), "correct").text(), "true");
}

TEST_F(ProgramCommands, OnlyProgramsArePlacedInWorldsAsPrograms) {
  const Value cell = call("world.create", {{"name", "cell"}});
  const Value p =
      call("program.create", {{"name", "p"}, {"source", "PROGRAM p;\nBEGIN\nENDPROGRAM;\n"}});
  const Value column = Map{{"name", "time"}, {"values", List{0.0, 1.0}}};
  const Value run = call("recording.create", {{"columns", List{column}}});
  call("material.create", {{"name", "m"}, {"density", 1000}});
  for (const Value& other : {run, Value("recording#1"), cell, Value("m")})
    EXPECT_NE(
        fails("world.add_program", {{"id", cell}, {"program", other}}).sentence().find("program"),
        std::string::npos)
        << other.text();
  EXPECT_EQ(call("world.add_program", {{"id", cell}, {"program", p}}).text(), "p");
  EXPECT_NE(fails("record.set", {{"id", cell}, {"path", "programs[1].program"}, {"value", run}})
                .sentence()
                .find("is a recording, not a program"),
            std::string::npos);
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

TEST_F(ProgramCommands, TheListOfDataBesideAProgramThatNamesNoneIsTaken) {
  write("p.irl", "PROGRAM p;\nVAR INT: n;\nBEGIN\nTEACH n;\nENDPROGRAM;\n");
  write("datalist.dls", "n := 7;\n");
  const Value id = call("program.import", {{"file", (folder_ / "p.irl").string()}});
  EXPECT_EQ(*call("program.source", {{"id", id}, {"name", "datalist.dls"}}).as_string(),
            "n := 7;\n");
  EXPECT_EQ(at(call("program.check", {{"id", id}}), "errors").text(), "0");
  // One that it names is its own.
  write("q.irl", "PROGRAM q;\nDATALIST 'own.dls';\nVAR INT: n;\nBEGIN\nTEACH n;\nENDPROGRAM;\n");
  write("own.dls", "n := 8;\n");
  const Value own = call("program.import", {{"file", (folder_ / "q.irl").string()}});
  EXPECT_NE(fails("program.source", {{"id", own}, {"name", "datalist.dls"}}).message, "");
}

TEST_F(ProgramCommands, AListOfAnotherProgramInTheFolderBreaksNoProgram) {
  // Two programs share a folder, and datalist.dls is of the first.
  write("p.irl", "PROGRAM p;\nVAR INT: n;\nBEGIN\nTEACH n;\nENDPROGRAM;\n");
  write("q.irl", "PROGRAM q;\nVAR REAL: k; STRING: n;\nBEGIN\nk := 2.0;\nENDPROGRAM;\n");
  write("datalist.dls", "n := 7;\nplace := 3;\n");
  const auto checked = [&](const char* file) {
    call("document.clear");
    const Value id = call("program.import", {{"file", (folder_ / file).string()}});
    return call("program.check", {{"id", id}});
  };
  const auto faults = [](const Value& check) {
    std::string all;
    for (const Value& f : *at(check, "faults").as_list())
      all += *at(f, "severity").as_string() + " " + *at(f, "file").as_string() + ":" +
             at(f, "line").text() + " " + *at(f, "message").as_string() + "\n";
    return all;
  };
  const std::string ignored =
      "note datalist.dls:1 values of place are ignored: the program declares no such variable.\n";
  EXPECT_EQ(faults(checked("p.irl")), ignored);
  EXPECT_EQ(faults(checked("q.irl")), ignored) << "n of q is another one, and is not taught";

  // A list that is none: one fault, an error only for the program that needs it.
  write("datalist.dls", "n := 7;\n%% not a list\n)(\nPROGRAM\n");
  const Value needs_it = checked("p.irl"), does_not = checked("q.irl");
  EXPECT_EQ(at(needs_it, "errors").text(), "1") << faults(needs_it);
  EXPECT_NE(faults(needs_it).find("error datalist.dls:2 the data list 'datalist.dls' cannot be "
                                  "read: "),
            std::string::npos)
      << faults(needs_it);
  EXPECT_EQ(at(does_not, "errors").text(), "0") << faults(does_not);
  EXPECT_EQ(at(does_not, "faults").as_list()->size(), 1U) << faults(does_not);
  EXPECT_EQ(at(does_not, "warnings").text(), "1") << faults(does_not);
}

TEST_F(ProgramCommands, AnUnreadableFileBesideAProgramIsAWarningAndTheOthersAreRead) {
  write("q.irl", "PROGRAM q;\nIMPORT k FROM tools;\nVAR INT: i;\nBEGIN\ni := k;\nENDPROGRAM;\n");
  write("tools.irl", "MODULE tools;\nEXPORT k;\nCONST INT: k := 2;\nENDMODULE;\n");
  write("datalist.dls", std::string("n := 7;\n\0\0\x01", 11));
  const Value id = call("program.import", {{"file", (folder_ / "q.irl").string()}});
  EXPECT_EQ(call("program.files", {{"id", id}}).as_list()->size(), 2U);
  EXPECT_EQ(at(call("program.check", {{"id", id}}), "errors").text(), "0");
  const auto warnings = [&] {
    std::string all;
    for (const Message& m : app().messages.recent())
      if (m.code == "unreadable_file") all += m.text + "\n";
    return all;
  };
  EXPECT_NE(warnings().find("The program is taken without \"datalist.dls\", which cannot be read"),
            std::string::npos)
      << warnings();
  // Of a named file the program then says that it is missing, and only that.
  write("tools.irl", std::string("MODULE\0", 7));
  const Value without =
      call("program.import", {{"file", (folder_ / "q.irl").string()}, {"name", "without"}});
  EXPECT_NE(warnings().find("without \"tools.irl\""), std::string::npos) << warnings();
  EXPECT_NE(at(call("program.check", {{"id", without}}), "errors").text(), "0");
  // A controller's program, too.
  write("weld.src", "DEF weld()\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nEND\n");
  write("weld.dat", std::string("DEFDAT\0weld", 11));
  const Value read = call("program.read_foreign", {{"file", (folder_ / "weld.src").string()}});
  EXPECT_EQ(at(read, "read").as_list()->size(), 1U);
  EXPECT_NE(warnings().find("without \"weld.dat\""), std::string::npos) << warnings();
}

TEST_F(ProgramCommands, AFileThatIsMissingIsReportedAndThenAFault) {
  write("p.irl", "PROGRAM p;\nDATALIST 'values.dls';\nBEGIN\nENDPROGRAM;\n");
  const Value id = call("program.import", {{"file", (folder_ / "p.irl").string()}});
  const Value found = call("program.check", {{"id", id}});
  EXPECT_EQ(*(*at(found, "faults").as_list())[0].as_map()->find("message")->as_string(),
            "the data list 'values.dls' is not among the program's files.");
  call("program.set_file", {{"id", id}, {"name", "values.dls"}, {"text", ""}});
  EXPECT_EQ(at(call("program.check", {{"id", id}}), "errors").text(), "0");
  call("program.remove_file", {{"id", id}, {"name", "values.dls"}});
  EXPECT_NE(fails("program.remove_file", {{"id", id}, {"name", "p.irl"}}).message.find("itself"),
            std::string::npos);
  EXPECT_NE(fails("program.set_file", {{"id", id}, {"name", "../p.irl"}, {"text", ""}})
                .message.find("not the name of a file"),
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

TEST_F(ProgramCommands, SourceInOtherEncodingsIsReadAndSaid) {
  const auto told = [&](const std::string& code) {
    std::string all;
    for (const Message& m : app().messages.recent(1000))
      if (m.code == code) all = m.text;
    return all;
  };
  const std::string ascii = "PROGRAM p;\n{ x }\nBEGIN\nENDPROGRAM;\n";
  const std::string utf8 =
      "PROGRAM p;\n{ \xc3\xa4 \xe2\x82\xac \xf0\x9f\xa4\x96 }\nBEGIN\nENDPROGRAM;\n";
  // a umlaut, euro, robot: one, one, two units.
  const std::u16string wide = u"PROGRAM p;\n{ \u00e4 \u20ac \U0001F916 }\nBEGIN\nENDPROGRAM;\n";
  std::string little = "\xff\xfe", big = "\xfe\xff";
  for (const char16_t c : wide) {
    little += static_cast<char>(c & 0xff);
    little += static_cast<char>(c >> 8);
    big += static_cast<char>(c >> 8);
    big += static_cast<char>(c & 0xff);
  }
  int n = 0;
  for (const std::string& bytes : {little, big, "\xef\xbb\xbf" + utf8, utf8}) {
    const std::string name = "e" + std::to_string(n++);
    write(name + ".irl", bytes);
    const Value id = call("program.import", {{"file", (folder_ / (name + ".irl")).string()}});
    EXPECT_EQ(call("program.source", {{"id", id}}).text(), utf8);
    EXPECT_EQ(at(call("program.check", {{"id", id}}), "errors").text(), "0");
    EXPECT_EQ(told("encoding"), n <= 2 ? name +
                                             ".irl: the file is in UTF-16 and was read so; it is "
                                             "kept in UTF-8."
                                       : "e1.irl: the file is in UTF-16 and was read so; it is "
                                         "kept in UTF-8.");
    // The editor's services see what is kept.
    EXPECT_EQ(at(*call("program.tokens", {{"id", id}}).as_list()->begin(), "column").text(), "1");
  }
  // Latin-1 is read, and the first line that is so is told.
  write("latin.irl", "PROGRAM p;\n\n{ m\xe1ximo }\nBEGIN\nENDPROGRAM;\n");
  call("program.import", {{"file", (folder_ / "latin.irl").string()}});
  EXPECT_EQ(told("encoding"),
            "latin.irl: line 3 is no UTF-8, so that the file was read as ISO 8859-1 (Latin-1); it "
            "is kept in UTF-8.");
  // So are programs of controllers.
  write("weld.src",
        "DEF weld( )\n; \xfc"
        "ber\nHALT\nEND\n");
  call("program.import", {{"file", (folder_ / "weld.src").string()}});
  EXPECT_EQ(told("encoding").substr(0, 16), "weld.src: line 2");
  call("program.read_foreign", {{"file", (folder_ / "weld.src").string()}});
  // A controller's file may have a name that a record has not.
  write("3-weld#1.src", "DEF weld( )\nHALT\nEND\n");
  const Value odd = call("program.import", {{"file", (folder_ / "3-weld#1.src").string()}});
  EXPECT_EQ(call("program.source", {{"id", odd}, {"name", "x3-weld_1.src"}}).text(),
            "DEF weld( )\nHALT\nEND\n");
  // Bytes that are no text, UTF-16 without its mark among them.
  write("binary.irl", std::string("PROGRAM p;\n\0\1\2", 14));
  write("bare.irl", little.substr(2));
  write("binary.src", std::string("DEF p( )\n\n\0END", 14));
  EXPECT_EQ(fails("program.import", {{"file", (folder_ / "binary.irl").string()}}).sentence(),
            "binary.irl: line 2 has a zero byte, which is not allowed in a text. A program must be "
            "a text file. If this one is in UTF-16, save it as UTF-8, or with a byte order mark.");
  EXPECT_EQ(fails("program.import", {{"file", (folder_ / "bare.irl").string()}}).where, "bare.irl");
  EXPECT_EQ(fails("program.import", {{"file", (folder_ / "binary.src").string()}})
                .sentence()
                .substr(0, 18),
            "binary.src: line 3");
  EXPECT_NE(fails("program.create", {{"name", "z"}, {"source", std::string("a\0b", 3)}})
                .sentence()
                .find("zero byte"),
            std::string::npos);
  // Half a pair, and half a letter at the end.
  write("half.irl", std::string("\xff\xfe{\0\x00\xd8}\0x", 9));
  const Value half = call("program.import", {{"file", (folder_ / "half.irl").string()}});
  EXPECT_EQ(call("program.source", {{"id", half}}).text(), "{\xef\xbf\xbd}\xef\xbf\xbd");
}

TEST_F(ProgramCommands, MakersFilesWithoutAProgramsTextAreNamed) {
  const std::string packed("\x1f\x8b\x08\0\0", 5);
  for (const char* name : {"weld.urp", "weld.tp", "POSREG.VA", "options.kop", "cell.rspag",
                           "cell.kl", "backup.zip", "SYSVARS.SV"})
    write(name, packed);
  const auto said = [&](const std::string& command, const std::string& name) {
    return fails(command, {{"file", (folder_ / name).string()}}).sentence();
  };
  for (const char* command : {"program.import", "program.read_foreign"}) {
    EXPECT_EQ(
        said(command, "weld.urp"),
        "weld.urp: it is a program of PolyScope (Universal Robots), packed XML of its tree. Give "
        "the .script of the same name, which PolyScope saves beside it: it is what runs.");
    EXPECT_EQ(
        said(command, "weld.tp"),
        "weld.tp: it is a TP program of FANUC in the controller's binary form. Give its listing "
        ".ls: save the programs as ASCII on the pendant, or print them by PRINTTP or ROBOGUIDE.");
    EXPECT_EQ(
        said(command, "POSREG.VA"),
        "POSREG.VA: it is the variables of a FANUC backup, and no program. Leave it beside the "
        "listing .ls, and give that: POSREG.VA, NUMREG.VA and SYSFRAME.VA are read with it.");
    EXPECT_EQ(said(command, "backup.zip"),
              "backup.zip: it is an archive. Unpack it, and give the program's own file, with what "
              "belongs to it beside it.");
    for (const char* name : {"options.kop", "cell.rspag", "cell.kl", "SYSVARS.SV"})
      EXPECT_EQ(said(command, name).find(std::string(name) + ": it is "), 0U)
          << said(command, name);
  }
}

// A backup of a KUKA controller: KRC/R1/Program/... and KRC/R1/System/$config.dat, in any letters.
TEST_F(ProgramCommands, ABackupOfKukaGivesItsConfiguration) {
  const std::filesystem::path cell = folder_ / "KRC" / "R1" / "PROGRAM" / "Cell";
  std::filesystem::create_directories(cell);
  std::filesystem::create_directories(folder_ / "KRC" / "R1" / "SYSTEM");
  const std::string r1 = "KRC/R1/";
  write(r1 + "PROGRAM/Cell/pick.src",
        "DEF pick( )\nFDAT_ACT={TOOL_NO 2,BASE_NO 0,IPO_FRAME #BASE}\nBAS(#FRAMES)\nLIN {X 1,Y "
        "2,Z 3,A 0,B 0,C 0}\nEND\n");
  write(r1 + "SYSTEM/$Config.dat",
        "DEFDAT $CONFIG\nDECL STRANGE_T nothing={A 1}\nDECL FRAME TOOL_DATA[16]\nTOOL_DATA[2]={X "
        "0,Y 0,Z 70,A 0,B 0,C 0}\nENDDAT\n");
  const Value read = call("program.read_foreign", {{"file", (cell / "pick.src").string()}});
  EXPECT_EQ(at(read, "read").text(), R"({"pick.src", "$Config.dat"})") << read.text();
  EXPECT_EQ(*at(read, "errors").as_int(), 0) << at(read, "faults").text();
  const std::string irl = *at(at(read, "files").as_list()->at(0), "text").as_string();
  EXPECT_NE(irl.find("TOOL_DATA[2] := POSE(POSITION(0.0, 0.0, 70.0)"), std::string::npos) << irl;
  // Beside the program it comes first.
  write(r1 + "PROGRAM/Cell/$config.dat",
        "DEFDAT $CONFIG\nDECL FRAME TOOL_DATA[16]\nTOOL_DATA[2]={X 0,Y 0,Z 71,A 0,B 0,C "
        "0}\nENDDAT\n");
  const Value near = call("program.read_foreign", {{"file", (cell / "pick.src").string()}});
  EXPECT_NE(at(at(near, "files").as_list()->at(0), "text").as_string()->find("0.0, 71.0)"),
            std::string::npos);
}

// Programs of a backup that call each other: in folders of Program, by the routine's name.
TEST_F(ProgramCommands, ProgramsOfABackupThatAreCalledAreReadWithIt) {
  const std::string program = "KRC/R1/Program/";
  std::filesystem::create_directories(folder_ / "KRC/R1/Program/Cell");
  std::filesystem::create_directories(folder_ / "KRC/R1/Program/Lib/Deep");
  std::filesystem::create_directories(folder_ / "KRC/R1/System");
  const std::string frames = "$TOOL={X 0,Y 0,Z 0,A 0,B 0,C 0}\n$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\n";
  write(program + "Cell/main.src",
        "DEF main( )\n" + frames + "PTP XP1\nweld( )\ngrip(TRUE)\nLIN above\nEND\n");
  write(program + "Cell/main.dat",
        "DEFDAT main\nDECL FRAME XP1={X 500,Y 0,Z 300,A 0,B 90,C 0}\nENDDAT\n");
  write(program + "weld.src", "DEF weld( )\nLIN XP1\nEND\n");
  write(program + "weld.dat",
        "DEFDAT weld\nDECL FRAME XP1={X 600,Y 0,Z 200,A 0,B 90,C 0}\nENDDAT\n");
  write(program + "Lib/Deep/tools.src",
        "DEF tools( )\nEND\nGLOBAL DEF grip(on:IN)\nDECL BOOL on\n$OUT[1]=on\nEND\n");
  write(program + "Lib/points.dat",
        "DEFDAT points PUBLIC\nDECL GLOBAL FRAME above={X 500,Y 0,Z 450,A 0,B 90,C 0}\nENDDAT\n");
  write(program + "Lib/other.src", "DEF other( )\nTRIGGER\nEND\n");
  const std::string file = (folder_ / "KRC/R1/Program/Cell/main.src").string();
  const Value read = call("program.read_foreign", {{"file", file}});
  EXPECT_EQ(at(read, "read").text(),
            R"({"main.src", "main.dat", "points.dat", "tools.src", "weld.src", "weld.dat"})");
  EXPECT_EQ(*at(read, "errors").as_int(), 0) << at(read, "faults").text();
  const std::string irl = *at(at(read, "files").as_list()->at(0), "text").as_string();
  EXPECT_NE(irl.find("MOVE LIN XP1_weld"), std::string::npos) << irl;
  // The nearest of two that offer a name; where they are equally near, a warning.
  write(program + "Cell/tools2.src",
        "DEF tools2( )\nEND\nGLOBAL DEF grip(on:IN)\nDECL BOOL on\n$OUT[2]=on\nEND\n");
  const Value near = call("program.read_foreign", {{"file", file}});
  EXPECT_NE(at(near, "read").text().find("tools2.src"), std::string::npos);
  write(program + "Cell/tools3.src", "GLOBAL DEF grip(on:IN)\nDECL BOOL on\nEND\n");
  call("program.read_foreign", {{"file", file}});
  std::string told;
  for (const Message& m : app().messages.recent(1000))
    if (m.code == "offered_twice") told = m.text;
  EXPECT_NE(told.find("\"grip\" is declared in "), std::string::npos) << told;
  // What is not in the backup is an error at its line.
  std::filesystem::remove(folder_ / "KRC/R1/Program/weld.src");
  const Value without = call("program.read_foreign", {{"file", file}});
  EXPECT_EQ(*at(without, "errors").as_int(), 1) << at(without, "faults").text();
  EXPECT_EQ(*at(at(without, "faults").as_list()->at(0), "line").as_int(), 5);
}

TEST_F(ProgramCommands, AnExtensionOfSeveralReadersSaysWhichTookIt) {
  const auto told = [&] {
    std::string all;
    for (const Message& m : app().messages.recent(1000))
      if (m.code == "reader") all = m.text;
    return all;
  };
  write("a.prg", "MODULE m\nPROC main()\nWaitTime 1;\nENDPROC\nENDMODULE\n");
  write("b.prg", "10 Ovrd 50\n20 Dly 1\n30 End\n");
  call("program.import", {{"file", (folder_ / "a.prg").string()}});
  EXPECT_EQ(told(),
            "a.prg was taken by the reader rapid, since its words are of that language; language = "
            "\"melfa\" chooses another.");
  call("program.import", {{"file", (folder_ / "b.prg").string()}});
  EXPECT_EQ(told(),
            "b.prg was taken by the reader melfa, since its words are of that language; language = "
            "\"rapid\" chooses another.");
  // Named, it is taken so, and nothing is told.
  call("program.import",
       {{"file", (folder_ / "a.prg").string()}, {"name", "named"}, {"language", "rapid"}});
  EXPECT_EQ(told().substr(0, 5), "b.prg");
  write("c.prg", "what is this\n");
  EXPECT_EQ(fails("program.import", {{"file", (folder_ / "c.prg").string()}}).sentence(),
            "c.prg: its extension is used by several controllers, and the text does not show which "
            "one applies. "
            "Give language = rapid or melfa.");
}

}  // namespace
}  // namespace robomosp
