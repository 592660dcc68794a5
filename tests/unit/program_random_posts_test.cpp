// SPDX-License-Identifier: Apache-2.0
// Random programs: they compile, run, are posted to every target, and the seven readers make of the
// files what the programs do, motion by motion. What a target cannot say is a sentence with a line.
// ROBOMOSP_RANDOM_PROGRAMS says how many (CI: 60), ROBOMOSP_RANDOM_PROGRAM one seed to look at,
// ROBOMOSP_RANDOM_KEEP a folder for what differs.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_reader.h>

#include "motion/provider_params.h"
#include "program/trace.h"
#include "support/program.h"
#include "support/program_events.h"
#include "support/random_program.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::Event, test::RandomProgram, test::Signals;

/// A language that is read, and where its signals have names.
struct RandomRead {
  const char* target;
  const char* reader;
  bool is_named, has_groups;
};
constexpr RandomRead kRandomRead[] = {
    {"krl", "krl", false, false},          {"rapid", "rapid", true, true},
    {"urscript", "urscript", true, false}, {"melfa5", "melfa", false, false},
    {"melfa4", "melfa", false, false},     {"fanuc_tp", "tp", false, false},
    {"val3", "val3", true, false},         {"gcode", "gcode", false, false}};
/// Profiles of targets that say little without.
const std::map<std::string, std::string> kRandomProfiles{{"gcode", "linuxcnc_abc"},
                                                         {"inform", "yaskawa_dx200"},
                                                         {"joint_trajectory", "ros2_trajectory"},
                                                         {"movemaster", "mitsubishi_rv_m1"},
                                                         {"pacscript", "denso_rc8"}};

class Silent final : public Progress {
 public:
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return false; }
};
struct File {
  std::string name, text;
};
/// What came of one post.
struct Outcome {
  enum class Kind {
    refused,   ///< with a sentence
    posted,    ///< a language that is not read
    told,      ///< its reader says that the IRL means something else
    untraced,  ///< what was read depends on what only a run knows
    equal,
    different,  ///< a fault of ours
  } kind = Kind::refused;
  std::string why;
  std::vector<File> files, read;
};

class RandomPosts : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    for (const ProviderInfo& info : app().registry.list(Post::kInterfaceId))
      targets_.push_back(info.name);
    auto language = app().registry.create<Language>("irl");
    ASSERT_TRUE(language.ok());
    language_ = std::move(*language);
    const auto info = app().registry.find(Language::kInterfaceId, "irl");
    auto params = motion::checked_params(*info, {}, "irl");
    ASSERT_TRUE(params.ok());
    language_params_ = std::move(*params);
  }
  /// The program, or what is wrong with it.
  std::shared_ptr<const CompiledProgram> compiled(const std::vector<File>& files,
                                                  std::string& why) {
    std::vector<SourceFile> sources;
    for (const File& f : files) sources.push_back({f.name, f.text, {}});
    LanguageTask task;
    task.files = sources;
    auto made = language_->compile(task, *language_params_, progress_);
    EXPECT_TRUE(made.ok());
    if (!made.ok()) return nullptr;
    std::shared_ptr<const CompiledProgram> p = std::move(*made);
    const rmp_code& c = p->code();
    for (std::uint32_t i = 0; i < c.faults.count && why.empty(); ++i) {
      const auto& f = row<rmp_code_fault>(c.faults, i);
      if (f.severity == RMP_FAULT_ERROR) why = std::to_string(f.span.line) + ": " + f.message;
    }
    return c.has_errors ? nullptr : p;
  }
  /// Its events, with the values of inputs that its flow depends on; nothing = why not.
  static std::optional<std::vector<Event>> events_of(
      const std::shared_ptr<const CompiledProgram>& p, bool has_groups, bool are_named,
      std::string& why) {
    program::TraceOptions options;
    options.most_entries = 20'000;
    options.most_instructions = 2'000'000;
    const rmp_code& c = p->code();
    for (std::uint32_t s = 0; s < c.symbols.count; ++s) {
      const auto& x = row<rmp_code_symbol>(c.symbols, s);
      if (x.kind != RMP_SYMBOL_INPUT) continue;
      // mode1 is input 3, mode2 is 4, however a controller calls them.
      const std::string name = x.name;
      const bool is_one = are_named ? name == "mode1" || name.ends_with("3") : x.address == 3;
      const bool is_two = are_named ? name == "mode2" || name.ends_with("4") : x.address == 4;
      if (is_one) options.inputs[name] = {1, 1};
      if (is_two) options.inputs[name] = {0, 0};
    }
    auto t = program::trace(p, options);
    if (!t.ok()) {
      why = t.error().message;
      return std::nullopt;
    }
    return test::events(*t, has_groups);
  }
  /// Values of the inputs that the flow of a program depends on.
  static Map flow_of(const std::string& text) {
    Map out;
    if (text.find("BOOL: mode1") != std::string::npos) out.set("mode1", true);
    if (text.find("BOOL: mode2") != std::string::npos) out.set("mode2", false);
    return out;
  }
  Outcome post(const Value& id, const std::string& target, const std::string& form, bool has_robot,
               const Map& flow) {
    Outcome out;
    Map args{{"id", id}, {"target", target}, {"form", form}};
    if (has_robot) args.set("robot", "puma560");
    if (const auto with = kRandomProfiles.find(target); with != kRandomProfiles.end())
      args.set("profile", call("controller.get", {{"name", with->second}}));
    if (form == "flat") args.set("inputs", flow);
    const auto r = app().dispatch(session_, "program.post", args);
    if (!r.ok()) {
      const Error& e = r.error();
      out.why = e.sentence();
      // A sentence at a line of the program, or what is said of the form.
      const std::size_t at = out.why.find("rnd.irl:");
      const bool has_line = at != std::string::npos && std::atoi(out.why.c_str() + at + 8) > 0;
      if (!has_line && out.why.find("takes no structured program") == std::string::npos)
        out.kind = Outcome::Kind::different;
      return out;
    }
    for (const Value& f : *at(*r, "files").as_list())
      out.files.push_back({*at(f, "name").as_string(), *at(f, "text").as_string()});
    out.kind = Outcome::Kind::posted;
    if (out.files.empty() || out.files[0].text.empty()) {
      out.kind = Outcome::Kind::different;
      out.why = "no files";
    }
    for (const File& f : out.files)
      for (const char* word : {"nan", "inf"})
        for (std::size_t at = 0; (at = f.text.find(word, at)) != std::string::npos; ++at) {
          const auto letter = [&](std::size_t k) {
            return k < f.text.size() &&
                   (std::isalnum(static_cast<unsigned char>(f.text[k])) || f.text[k] == '_');
          };
          if ((at > 0 && letter(at - 1)) || letter(at + 3)) continue;
          out.kind = Outcome::Kind::different;
          out.why = "a number that is none";
        }
    return out;
  }
  /// What the reader of a language makes of posted files, held against what the program does.
  void read_back(const RandomRead& language, const std::vector<Event>& wanted, Outcome& out) {
    auto reader = app().registry.create<ProgramReader>(language.reader);
    ASSERT_TRUE(reader.ok());
    const auto info = app().registry.find(ProgramReader::kInterfaceId, language.reader);
    auto params = motion::checked_params(*info, {}, language.reader);
    ASSERT_TRUE(params.ok());
    std::vector<SourceFile> sources;
    std::vector<std::string> names;
    names.reserve(out.files.size());
    for (const File& f : out.files) {
      names.push_back(fs::path(f.name).filename().string());
      sources.push_back({names.back(), f.text, {}});
    }
    ProgramReaderTask task;
    task.files = sources;
    auto made = (*reader)->read(task, **params, progress_);
    out.kind = Outcome::Kind::different;
    if (!made.ok()) {
      out.why = made.error().sentence();
      return;
    }
    for (const ReadFile& f : (*made)->files())
      out.read.push_back({std::string(f.name), std::string(f.text)});
    std::string told;
    for (const rmp_code_fault& f : (*made)->faults())
      if (told.empty() && f.severity == RMP_FAULT_ERROR) told = f.message;
    compare(language, wanted, out);
    // What a reader says it does not understand may yet be equal, and else it was said.
    if (out.kind != Outcome::Kind::equal && !told.empty()) {
      out.kind = Outcome::Kind::told;
      out.why = told;
    }
  }
  void compare(const RandomRead& language, const std::vector<Event>& wanted, Outcome& out) {
    out.why.clear();
    const auto p = compiled(out.read, out.why);
    if (!p) {
      out.why = "what was read without an error does not compile: " + out.why;
      return;
    }
    std::string why;
    const auto got = events_of(p, language.has_groups, language.is_named, why);
    if (!got) {
      out.kind = Outcome::Kind::untraced;
      out.why = why;
      return;
    }
    Signals signals(language.is_named);
    std::size_t k = 0, g = 0;
    // G-code has places only: joints are where the robot is then, which other tests look at.
    const auto is_place_of_joints = [&](const Event& a, const Event& b) {
      return std::string_view(language.target) == "gcode" && a.kind == Event::Kind::joints &&
             b.kind == Event::Kind::pose && a.interpolation == b.interpolation;
    };
    const auto is_place = [](const Event& e) {
      return e.kind == Event::Kind::pose || e.kind == Event::Kind::position;
    };
    // A path that begins where the tool is has no piece to there.
    const auto stays = [&](const Event& before, const Event& at) {
      if (!is_place(before) || before.numbers.size() != at.numbers.size()) return false;
      for (std::size_t i = 0; i < at.numbers.size(); ++i)
        if (std::fabs(before.numbers[i] - at.numbers[i]) > 1e-6) return false;
      return true;
    };
    // G-code has the centre of an arc, and no place on its way: any of the same arc will do.
    const auto is_same_arc = [&] {
      const Event &a = wanted[k], &b = (*got)[g];
      return std::string_view(language.target) == "gcode" && k > 0 && k + 1 < wanted.size() &&
             a.interpolation == RMP_MOVE_CIRCLE && a.target == 0 &&
             b.interpolation == a.interpolation && b.target == 0 && is_place(wanted[k - 1]) &&
             is_place(a) && is_place(wanted[k + 1]) && is_place(b) &&
             test::is_on_arc(wanted[k - 1].numbers.data(), a.numbers.data(),
                             wanted[k + 1].numbers.data(), b.numbers.data());
    };
    while (k < wanted.size() && g < got->size()) {
      Event want = wanted[k];
      const Event& found = (*got)[g];
      // A curve that a language lacks is lines from place to place, with others between them; how
      // near they are to the curve is legalise_test's.
      const bool is_piece =
          is_place(want) && is_place(found) && found.interpolation == RMP_MOVE_LIN &&
          (want.interpolation == RMP_MOVE_PATH || want.interpolation == RMP_MOVE_CIRCLE);
      if (is_piece) want.interpolation = RMP_MOVE_LIN;
      // So it knows where a step from there leads; what is seen of both ends is as long.
      const auto last =
          std::find_if(wanted.rbegin() + static_cast<std::ptrdiff_t>(wanted.size() - k),
                       wanted.rend(), [](const Event& e) { return e.kind <= Event::Kind::step; });
      const auto from = std::find_if(last, wanted.rend(), [](const Event& e) {
        return e.kind == Event::Kind::joints || e.kind == Event::Kind::pose;
      });
      if (want.kind == Event::Kind::step && found.kind == Event::Kind::pose &&
          from != wanted.rend() && from->kind == Event::Kind::joints) {
        bool is_it = g == 0 || !is_place((*got)[g - 1]);
        for (std::size_t i = 0; !is_it && i < 3; ++i) {
          if (!(std::fabs(found.numbers[i] - (*got)[g - 1].numbers[i] - want.numbers[i]) <=
                test::kMm))
            break;
          is_it = i == 2;
        }
        if (is_it) {
          want.kind = found.kind;
          want.numbers = found.numbers;
        }
      }
      // Behind joints the post knows by its robot how the tool is turned, and this run does not.
      if (want.kind == Event::Kind::position && found.kind == Event::Kind::pose) {
        want.kind = found.kind;
        want.numbers = {want.numbers[0],  want.numbers[1],  want.numbers[2], found.numbers[3],
                        found.numbers[4], found.numbers[5], found.numbers[6]};
      }
      if (is_place_of_joints(want, found) || test::same(want, found, signals) || is_same_arc())
        ++k, ++g;
      else if (is_piece && last != wanted.rend() && stays(*last, want)) ++k;
      else if (is_piece) ++g;
      else break;
    }
    if (k == wanted.size() && g == got->size()) {
      out.kind = Outcome::Kind::equal;
      return;
    }
    out.why = std::to_string(k) + " of " + std::to_string(wanted.size()) + "/" +
              std::to_string(got->size()) + ": " + (k < wanted.size() ? wanted[k].text() : "end") +
              " | " + (g < got->size() ? (*got)[g].text() : "end");
  }
  /// A program, posted to one target in one form; nothing = it does not compile.
  std::optional<Outcome> whole(const std::string& text, const std::string& target,
                               const std::string& form, bool has_robot) {
    std::string why;
    const auto p = compiled({{"rnd.irl", text}}, why);
    if (!p) return std::nullopt;
    const Value id = call("program.create", {{"name", "rnd"}, {"source", text}});
    Outcome out = post(id, target, form, has_robot, flow_of(text));
    call("document.undo");
    if (out.kind != Outcome::Kind::posted) return out;
    for (const RandomRead& language : kRandomRead)
      if (target == language.target) {
        const auto wanted = events_of(p, language.has_groups, false, why);
        if (!wanted) {
          out.kind = Outcome::Kind::untraced;
          out.why = why;
        } else {
          read_back(language, *wanted, out);
        }
      }
    return out;
  }
  /// The program without the lines that its difference does not need.
  std::string shrunk(std::string text, const std::string& target, const std::string& form,
                     bool has_robot) {
    const auto joined = [](const std::vector<std::string>& lines) {
      std::string all;
      for (const std::string& l : lines) all += l + "\n";
      return all;
    };
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string l; std::getline(in, l);) lines.push_back(l);
    for (std::size_t size = std::max<std::size_t>(1, lines.size() / 2); size > 0;) {
      bool is_shorter = false;
      for (std::size_t at = 0; at + size <= lines.size();) {
        std::vector<std::string> less = lines;
        less.erase(less.begin() + static_cast<std::ptrdiff_t>(at),
                   less.begin() + static_cast<std::ptrdiff_t>(at + size));
        const auto out = whole(joined(less), target, form, has_robot);
        if (out && out->kind == Outcome::Kind::different) {
          lines = std::move(less);
          is_shorter = true;
        } else {
          ++at;
        }
      }
      if (!is_shorter || size > 1) {
        if (size == 1) break;
        size /= 2;
      }
    }
    return joined(lines);
  }
  /// What is said of a program without its place.
  static std::string sentence_of(const std::string& said) {
    std::size_t at = said.find("rnd.irl:");
    for (int k = 0; k < 3 && at != std::string::npos; ++k) at = said.find(':', at + 1);
    return at == std::string::npos ? said : said.substr(at + 2);
  }
  static void keep(const std::string& name, const std::string& text, const Outcome& out) {
    const char* folder = std::getenv("ROBOMOSP_RANDOM_KEEP");
    if (!folder) return;
    fs::create_directories(folder);
    std::ofstream file(fs::path(folder) / (name + ".txt"));
    file << text << "\n==== " << out.why << "\n";
    for (const File& f : out.files) file << "\n==== " << f.name << "\n" << f.text;
    for (const File& f : out.read) file << "\n==== " << f.name << "\n" << f.text;
  }

  std::vector<std::string> targets_;
  std::shared_ptr<Language> language_;
  std::unique_ptr<Params> language_params_;
  Silent progress_;
};

TEST_F(RandomPosts, WhatIsReadBackDoesTheSameOrAFaultSaysWhyNot) {
  const char* given = std::getenv("ROBOMOSP_RANDOM_PROGRAMS");
  const std::size_t count = given ? std::strtoul(given, nullptr, 10) : 60;
  const std::uint32_t seed = test::seed();
  const char* single = std::getenv("ROBOMOSP_RANDOM_PROGRAM");
  struct Tally {
    std::map<Outcome::Kind, std::size_t> of;
    std::map<std::string, std::size_t> why;
  };
  std::map<std::string, Tally> tallies;
  std::map<std::string, std::size_t> differences;
  std::size_t runs = 0, run_faults = 0;
  call("robot.set_axes", {{"id", call("robot.get", {{"name", "puma560"}})}, {"axes", List{}}});
  for (std::size_t k = 0; k < (single ? 1 : count); ++k) {
    const std::uint32_t own = single ? static_cast<std::uint32_t>(std::strtoul(single, nullptr, 10))
                                     : seed * 1'000'003U + static_cast<std::uint32_t>(k);
    const std::string text = RandomProgram(own).text();
    const bool has_robot = own % 3 != 0, is_parallel = text.find("START ") != std::string::npos;
    std::string why;
    const auto p = compiled({{"rnd.irl", text}}, why);
    ASSERT_TRUE(p) << "program " << own << ": " << why << "\n" << text;
    std::map<bool, std::optional<std::vector<Event>>> wanted;
    std::string run_fault;
    for (const bool has_groups : {false, true})
      wanted[has_groups] = events_of(p, has_groups, false, run_fault);
    if (wanted[false]) ++runs;
    else {
      ++run_faults;
      // Interrupts and conditions of functions need a world; nothing else keeps it from running.
      if (run_fault.find("stop_wish") == std::string::npos) ++tallies["run"].why[run_fault];
    }
    const Value id = call("program.create", {{"name", "rnd"}, {"source", text}});
    struct Found {
      std::string target, form;
      Outcome out;
    };
    std::vector<Found> found;
    for (const std::string& target : targets_)
      for (const char* form : {"structured", "flat"}) {
        Outcome out = post(id, target, form, has_robot, flow_of(text));
        for (const RandomRead& language : kRandomRead)
          if (out.kind == Outcome::Kind::posted && target == language.target) {
            // Which of two processes is first is not a matter of the files.
            if (const auto& w = wanted[language.has_groups]; w && !is_parallel)
              read_back(language, *w, out);
            else out.kind = Outcome::Kind::untraced;
          }
        Tally& tally = tallies[target + " " + form];
        ++tally.of[out.kind];
        if (out.kind == Outcome::Kind::told || out.kind == Outcome::Kind::untraced)
          ++tally.why[out.why];
        if (out.kind == Outcome::Kind::refused) ++tally.why["refused: " + sentence_of(out.why)];
        if (out.kind != Outcome::Kind::different) continue;
        if (differences[target + " " + form]++ < 3) found.push_back({target, form, out});
      }
    call("document.undo");
    for (auto& [target, form, out] : found) {
      std::string less = shrunk(text, target, form, has_robot);
      const auto again = whole(less, target, form, has_robot);
      if (again && again->kind == Outcome::Kind::different) out = *again;
      else less = text;
      keep(target + "-" + form + "-" + std::to_string(own), less, out);
      ADD_FAILURE() << "program " << own << ", " << target << ", " << form
                    << (has_robot ? ", puma560" : "") << ": " << out.why << "\n"
                    << less << (out.files.empty() ? "" : out.files[0].text.substr(0, 3000)) << "\n"
                    << (out.read.empty() ? "" : out.read[0].text.substr(0, 3000));
    }
    if (k % 100 == 99) {
      app().document.clear();
      call("robot.set_axes", {{"id", call("robot.get", {{"name", "puma560"}})}, {"axes", List{}}});
    }
  }
  std::cout << runs << " programs run without a world, " << run_faults << " need one\n";
  for (const auto& [what, tally] : tallies) {
    const auto number = [&](Outcome::Kind kind) {
      const auto it = tally.of.find(kind);
      return it == tally.of.end() ? std::size_t{0} : it->second;
    };
    using Kind = Outcome::Kind;
    std::cout << what << ": " << number(Kind::refused) << " refused, " << number(Kind::posted)
              << " posted, " << number(Kind::equal) << " read back equal, " << number(Kind::told)
              << " with a fault of the reader, " << number(Kind::untraced) << " need a run, "
              << number(Kind::different) << " different\n";
    std::vector<std::pair<std::size_t, std::string>> reasons;
    for (const auto& [why, n] : tally.why) reasons.emplace_back(n, why);
    std::sort(reasons.rbegin(), reasons.rend());
    for (std::size_t i = 0; i < std::min<std::size_t>(reasons.size(), given || single ? 12 : 0);
         ++i)
      std::cout << "    " << reasons[i].first << " " << reasons[i].second << "\n";
  }
  for (const auto& [what, n] : differences) ADD_FAILURE() << n << " different in " << what;
  if (single) return;
  // It looks at something.
  for (const RandomRead& language : kRandomRead) {
    std::size_t equal = 0;
    for (const char* form : {" structured", " flat"})
      equal += tallies[language.target + std::string(form)].of[Outcome::Kind::equal];
    EXPECT_GT(equal, count / 10) << language.target;
  }
}

/// What the random programs have found, in short.
TEST_F(RandomPosts, WhatWasReadBackAsSomethingElseOnce) {
  call("robot.set_axes", {{"id", call("robot.get", {{"name", "puma560"}})}, {"axes", List{}}});
  struct Once {
    const char *target, *form, *text;
  };
  for (const Once& once :
       {Once{"krl", "structured",
             "PROGRAM rnd;\nSIGNAL OUTPUT BOOL: out1 AT 1;\n"
             "VAR BOOL: c := TRUE; ARRAY [0..1] OF BOOL: seen := [TRUE, FALSE];\n"
             "BEGIN\n  out1 := (c OR seen[1]) <> (seen[1] OR c);\n"
             "  out1 := (c AND seen[1]) = (seen[1] AND c);\nENDPROGRAM;\n"},
        Once{"urscript", "flat",
             "PROGRAM rnd;\nVAR JOINT: j := JOINT(MAIN_JOINT(89.62, -78.1, 100.7, 47.30, 66.81, "
             "-47.3), ADD_JOINT(0.0));\nBEGIN\n  MOVE PTP j;\n"
             "  MOVE PTP POSITION(511.7, -208.70, 68.1), FRAME := POSE(POSITION(5.2, 5.48, 20.0), "
             "ORIZYX(-16.37, 0.0, 0.0));\nENDPROGRAM;\n"}}) {
    const auto out = whole(once.text, once.target, once.form, true);
    ASSERT_TRUE(out) << once.text;
    EXPECT_EQ(out->kind, Outcome::Kind::equal) << out->why << "\n" << once.text;
  }
}

}  // namespace
}  // namespace robomosp
