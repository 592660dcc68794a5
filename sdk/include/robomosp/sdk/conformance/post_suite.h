// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.post/1 (layer: contract helper for tests, GoogleTest, header-only):
// every construct of the catalogue is written or refused at its line, none is lost; equal programs
// give equal files on any thread; files have legal names, and lines that come from the program;
// values that no controller takes are refused; a wish to stop is heard; answers are bounded.
// Programs are compiled by a plugin of a language, as the host compiles them, but not rewritten by
// the capabilities: what the target does not have is an error at its line here. Include it in one
// file of a test program and instantiate PostConformance with PostSubject values.
#pragma once

#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/all_providers.h>
#include <robomosp/sdk/conformance/post_points.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/stop_after.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/language.h>
#include <robomosp/sdk/post.h>
#include <robomosp/sdk/post_constructs.h>
#include <robomosp/sdk/post_files.h>
#include <robomosp/sdk/program_tables.h>

namespace robomosp::conformance {

struct PostSubject {
  std::string file, provider;
  std::string language;    ///< plugin with the language of the programs: irl.so; "" = none
  std::string constructs;  ///< the catalogue: share/robomosp/post_test/constructs.txt
  /// Makes a post that is in no plugin file; empty = by `file` and `provider`.
  std::function<std::shared_ptr<Post>()> make;
};
inline void PrintTo(const PostSubject& c, std::ostream* os) { *os << c.provider; }

class PostConformance : public testing::TestWithParam<PostSubject> {
 protected:
  struct Fault {
    std::uint32_t severity = 0;
    rmp_span span{};
    std::string message, hint;
  };
  /// What a post wrote and said, and what the host would have refused of it.
  class Written final : public PostOutput {
   public:
    explicit Written(std::uint32_t files_of_program) : files_of_program_(files_of_program) {}
    void file(std::string_view name, std::string_view bytes) override {
      if (const auto bad = post::file_name_fault(name); !bad.empty()) refuse(std::string(bad));
      else if (!files.emplace(name, bytes).second)
        refuse("wrote the file " + std::string(name) + " twice");
      else lines_.emplace(name, lines_of(bytes));
    }
    void from(std::string_view file, std::uint32_t line, const rmp_span& span) override {
      const auto it = lines_.find(file);
      if (it == lines_.end()) return refuse("reported a line of a missing file");
      if (line < 1 || line > it->second || span.file >= files_of_program_)
        return refuse("reported the origin of a missing line");
      ++mapped;
    }
    void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
               std::string_view hint) override {
      if (severity > RMP_FAULT_NOTE) return refuse("said something of no known severity");
      faults.push_back({severity, span, std::string(message), std::string(hint)});
      if (severity == RMP_FAULT_ERROR) ++errors;
    }
    /// All files behind each other.
    [[nodiscard]] std::string text() const {
      std::string all;
      for (const auto& [name, bytes] : files) all += name + "\n" + bytes;
      return all;
    }
    [[nodiscard]] std::string said() const {
      std::string all;
      for (const Fault& f : faults)
        all += std::to_string(f.severity) + " " + std::to_string(f.span.line) + ": " + f.message +
               ". " + f.hint + "\n";
      return all;
    }
    [[nodiscard]] std::size_t bytes() const {
      std::size_t n = 0;
      for (const auto& [name, text] : files) n += text.size();
      return n;
    }
    std::map<std::string, std::string, std::less<>> files;
    std::vector<Fault> faults;
    std::size_t errors = 0, mapped = 0;
    std::string refused;  ///< "" = nothing

   private:
    static std::size_t lines_of(std::string_view text) {
      const auto ends = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
      return ends + (text.empty() || text.back() == '\n' ? 0 : 1);
    }
    void refuse(std::string what) {
      if (refused.empty()) refused = std::move(what);
    }
    std::uint32_t files_of_program_;
    std::map<std::string, std::size_t, std::less<>> lines_;
  };
  using Spoil = std::function<void(std::vector<PostPoint>&)>;

  void SetUp() override {
    const PostSubject& c = GetParam();
    if (c.language.empty())
      GTEST_SKIP() << "posts are judged by programs, and there is no language to compile them";
    if (c.make) {
      post_ = c.make();
    } else {
      const auto found = find_provider<Post>(c.file, c.provider);
      ASSERT_TRUE(found.ok()) << found.error().sentence();
      post_ = create<Post>(**found);
      params_ = TableParams(**found);
    }
    ASSERT_NE(post_, nullptr) << "it cannot be made";
    const auto names = provider_names<Language>(c.language.c_str());
    ASSERT_FALSE(names.empty()) << c.language << " has no language";
    const auto found = find_provider<Language>(c.language, names.front());
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    language_ = create<Language>(**found);
    language_params_ = TableParams(**found);
    for (int i = 0; i < 6; ++i) {
      PostAxis a;
      a.name = kAxes[i];
      a.joint = i;
      a.pulses = 1000;
      axes_.push_back(a);
    }
    profile_.name = "suite";
    profile_.axes = axes_;
    profile_.max_speed = 2000;
    profile_.max_speed_ori = 180;
  }

  [[nodiscard]] bool takes_structure() const {
    return (post_->capabilities().forms & kPostStructured) != 0;
  }
  /// A program of the language; nullptr where it has errors.
  std::unique_ptr<CompiledProgram> compiled(const std::string& source) const {
    const SourceFile file{"suite.irl", source, {}};
    LanguageTask task;
    task.files = std::span<const SourceFile>(&file, 1);
    NoProgress none;
    auto made = language_->compile(task, language_params_, none);
    if (!made.ok() || (*made)->code().has_errors) return nullptr;
    return std::move(made).value();
  }
  Result<void> ask(const CompiledProgram& p, Written& out, Progress& progress,
                   const Spoil& spoil = {}, bool with_robot = true,
                   const std::string& name = "suite") const {
    plain::Points points(p.code(), with_robot);
    if (spoil) spoil(points.points);
    const RobotModel robot = plain::six_joints();
    PostTask task;
    task.code = &p.code();
    task.form = takes_structure() ? kPostStructured : kPostFlat;
    task.name = name;
    task.points = points.points;
    task.profile = &profile_;
    if (with_robot) {
      task.robot = &robot;
      task.kinematics = &points.kinematics;
    }
    return post_->write(task, params_, out, progress);
  }
  /// The same to its end, with what holds of every answer.
  Written written(const CompiledProgram& p, const std::string& source, const Spoil& spoil = {},
                  bool with_robot = true, const std::string& name = "suite") const {
    Written out(p.code().files.count);
    NoProgress none;
    const auto done = ask(p, out, none, spoil, with_robot, name);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence()) << "\n" << source;
    expect_sound(out, source);
    return out;
  }
  void expect_sound(const Written& out, const std::string& source) const {
    EXPECT_EQ(out.refused, "") << source;
    EXPECT_TRUE(out.errors > 0 || !out.files.empty()) << "neither a file nor an error\n" << source;
    const auto lines = static_cast<std::uint32_t>(std::count(source.begin(), source.end(), '\n'));
    for (const Fault& f : out.faults) {
      EXPECT_GE(f.span.line, 1U) << f.message << "\n" << source;
      if (f.span.file != 0) continue;  // what the language has itself
      EXPECT_LE(f.span.line, lines + 1) << f.message;
      EXPECT_GE(f.span.column, 1U) << f.message;
      EXPECT_LE(f.span.begin, f.span.end) << f.message;
      EXPECT_LE(f.span.end, source.size()) << f.message;
      EXPECT_FALSE(f.message.empty()) << source;
      EXPECT_LT(f.message.size(), 2000U) << source;
      EXPECT_FALSE(f.message.ends_with('.')) << "a message has no trailing period: " << f.message;
      for (const std::string* said : {&f.message, &f.hint})
        EXPECT_TRUE(std::none_of(said->begin(), said->end(), [](char c) {
          return static_cast<unsigned char>(c) < 32;
        })) << *said;
    }
    if (out.errors > 0) return;  // no file of them is kept
    const PostCapabilities& caps = post_->capabilities();
    for (const auto& [name, text] : out.files) {
      if (caps.charset == PostCharset::ascii) {
        EXPECT_TRUE(std::none_of(text.begin(), text.end(),
                                 [](char c) { return static_cast<unsigned char>(c) > 127; }))
            << name << " is not ASCII\n"
            << source;
      }
      EXPECT_EQ(text.find('\0'), std::string::npos) << name;
      for (std::size_t at = text.find('\n'); caps.crlf && at != std::string::npos;
           at = text.find('\n', at + 1))
        if (at == 0 || text[at - 1] != '\r') {
          ADD_FAILURE() << name << " has a line that does not end with CR LF\n" << source;
          break;
        }
    }
  }
  /// Whether a text has a number that is none: nan or inf as a word, in any case.
  static bool has_no_number(const std::string& text) {
    std::string word;
    for (const char c : text + " ") {
      if ((c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || c == '_' || (c >= 'A' && c <= 'Z')) {
        word += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
        continue;
      }
      if (word == "nan" || word == "inf" || word == "infinity") return true;
      word.clear();
    }
    return false;
  }
  static std::string pose(double x) {
    return "POSE(POSITION(" + std::to_string(x) + ", 100.0, 300.0), ORIZYX(0.0, 180.0, 0.0))";
  }
  static std::string program(const std::string& statements, const std::string& declared = {}) {
    return "PROGRAM suite;\nSIGNAL OUTPUT BOOL: grip AT 2;\n" + declared + "BEGIN\n" + statements +
           "\nENDPROGRAM;\n";
  }
  /// Motions in a row, which every post takes of which the target has any.
  std::string straight(std::size_t motions) const {
    const std::uint32_t has = post_->capabilities().motions;
    std::string all;
    for (std::size_t i = 0; i < motions; ++i) {
      const std::string number = std::to_string(i % 1000);
      if (has & kPostLinPose)
        all += "MOVE LIN " + pose(400 + 0.1 * static_cast<double>(i % 1000)) + " SPEED := 80.0;\n";
      else
        all += "MOVE PTP JOINT(MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 90.0, " + number +
               ".0E-2), ADD_JOINT(0.0)) SPEED_PTP := 50.0;\n";
    }
    return program(all);
  }
  /// The catalogue; of posts that take straight programs only, what these are made of.
  std::vector<post::ConstructCase> constructs() const {
    std::vector<post::ConstructCase> all;
    if (takes_structure()) {
      std::ifstream in(GetParam().constructs, std::ios::binary);
      auto read = post::read_constructs(std::string(std::istreambuf_iterator<char>(in), {}));
      if (read.ok()) return std::move(read).value();
      ADD_FAILURE() << GetParam().constructs << ": " << read.error().sentence();
      return all;
    }
    for (const std::string& text :
         {"MOVE LIN " + pose(400) + " SPEED := 80.0;", "MOVE LIN " + pose(400) + " C_CP := 5.0;",
          "MOVE PTP " + pose(400) + " SPEED_PTP := 20.0;",
          "MOVE CIRCLE " + pose(450) + ", " + pose(500) + ";",
          "MOVE PATH " + pose(450) + ", " + pose(500) + ";",
          "MOVE LIN " + pose(400) + " TIME := 2.0;", "MOVE LIN " + pose(400) + " WOBBLE := TRUE;",
          std::string("MOVE PTP MAIN_JOINT(0.0, -80.0, 90.0, 0.0, 90.0, 5.0);"),
          std::string("grip := TRUE;"), std::string("WAIT 0.25 SEC;"),
          std::string("WAIT FOR grip;"), std::string("WRITELN('here');"), std::string("PAUSE;"),
          std::string("HALT;")}) {
      post::ConstructCase c{text, program(pose_first() + text), program(pose_first()), {}, 5};
      if (const std::string bare = post::without_attributes(text); !bare.empty())
        c.bare = program(pose_first() + bare);
      all.push_back(std::move(c));
    }
    return all;
  }
  /// Most motions lead from somewhere.
  std::string pose_first() const {
    return post_->capabilities().motions & kPostPtpJoints
               ? "MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 90.0, 0.0) SPEED_PTP := 50.0;\n"
               : "MOVE LIN " + pose(300) + " SPEED := 80.0;\n";
  }

  static constexpr const char* kAxes[] = {"A1", "A2", "A3", "A4", "A5", "A6"};
  std::shared_ptr<Post> post_;
  std::shared_ptr<Language> language_;
  TableParams params_, language_params_;
  std::vector<PostAxis> axes_;
  PostProfile profile_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(PostConformance);

TEST_P(PostConformance, SaysWhatItsLanguageHas) {
  const PostCapabilities& c = post_->capabilities();
  EXPECT_GE(c.struct_size, sizeof(PostCapabilities));
  EXPECT_NE(c.forms & (kPostStructured | kPostFlat), 0U) << "it takes no form of a program";
  EXPECT_GT(c.motions, 0U) << "it has no motions";
  EXPECT_LT(c.motions, 256U);
  EXPECT_EQ(c.features & ~(2 * static_cast<std::uint64_t>(kPostParts) - 1), 0U)
      << "features that are none";
  EXPECT_TRUE(c.circle >= PostCircle::none && c.circle <= PostCircle::centre);
  EXPECT_TRUE(c.blending >= PostBlending::none && c.blending <= PostBlending::accuracy);
  EXPECT_TRUE(c.speed >= PostSpeed::mm_per_s && c.speed <= PostSpeed::time);
  EXPECT_TRUE(c.name_case >= PostCase::kept && c.name_case <= PostCase::lower);
  EXPECT_TRUE(c.charset >= PostCharset::ascii && c.charset <= PostCharset::utf8);
  EXPECT_GE(c.external_axes, 0);
  EXPECT_GE(c.max_name, 4);
  for (const std::int32_t most : {c.max_points, c.max_lines, c.max_nesting}) EXPECT_GE(most, 0);
  EXPECT_FALSE(c.title.empty());
  EXPECT_FALSE(c.extensions.empty());
  for (const char e : c.extensions)
    EXPECT_TRUE((e >= 'a' && e <= 'z') || (e >= '0' && e <= '9') || e == ',' || e == '_')
        << "extensions are lower-case, without dots, separated by commas: " << c.extensions;
  for (const char r : c.reserved) EXPECT_GE(r, ' ') << "reserved words are separated by blanks";
  EXPECT_EQ(&post_->capabilities(), &c) << "they are constant data";
}

TEST_P(PostConformance, EveryConstructIsSaidOrRefusedAtItsLine) {
  std::map<std::string, std::string> without;
  std::size_t said = 0;
  const auto all = constructs();
  for (const post::ConstructCase& c : all) {
    SCOPED_TRACE(c.text);
    const auto p = compiled(c.source);
    ASSERT_NE(p, nullptr) << "the language refuses a program of the catalogue\n" << c.source;
    const Written out = written(*p, c.source);
    if (out.errors > 0) continue;
    ++said;
    const auto text_of = [&](const std::string& source) {
      const auto other = compiled(source);
      return other ? written(*other, source).text() : std::string();
    };
    const auto [it, is_new] = without.try_emplace(c.without);
    if (is_new) it->second = text_of(c.without);
    // At the end of a program HALT and RETURN may have the effect of the end anyway.
    const bool is_lost = out.text() == it->second && out.faults.empty() &&
                         text_of(post::followed(c.source)) == text_of(post::followed(c.without));
    EXPECT_FALSE(is_lost) << "lost: the files are as without it, and nothing is said";
    if (c.bare.empty() || !out.faults.empty()) continue;
    EXPECT_NE(out.text(), text_of(c.bare))
        << "lost: the files are as without its attributes, and nothing is said";
  }
  EXPECT_GT(said, 0U) << "all " << all.size() << " constructs are refused";
}

TEST_P(PostConformance, AnEmptyProgramIsAProgram) {
  const std::string source = program("");
  const auto p = compiled(source);
  ASSERT_NE(p, nullptr);
  (void)written(*p, source);
  (void)written(*p, source, {}, true, "n" + std::string(300, 'n'));
}

TEST_P(PostConformance, WithoutARobotThereAreFilesOrErrors) {
  for (const post::ConstructCase& c : constructs()) {
    if (c.text.find("MOVE") == std::string::npos) continue;
    const auto p = compiled(c.source);
    ASSERT_NE(p, nullptr);
    (void)written(*p, c.source, {}, false);
  }
}

TEST_P(PostConformance, EqualProgramsGiveEqualFilesOnAnyThread) {
  const auto all = constructs();
  std::vector<std::pair<std::unique_ptr<CompiledProgram>, std::string>> programs;
  for (std::size_t i = 0; i < all.size(); i += 7)
    programs.emplace_back(compiled(all[i].source), all[i].source);
  const std::string many = straight(200);
  programs.emplace_back(compiled(many), many);
  for (const auto& [p, source] : programs) {
    ASSERT_NE(p, nullptr) << source;
    const Written first = written(*p, source);
    std::vector<std::string> texts(4);
    at_once(texts.size(), [&, code = p.get()](std::size_t thread) {
      Written out(code->code().files.count);
      NoProgress none;
      const auto done = ask(*code, out, none);
      texts[thread] = done.ok() ? out.text() + out.said() : done.error().sentence();
    });
    for (const std::string& one : texts) EXPECT_EQ(one, first.text() + first.said()) << source;
  }
}

TEST_P(PostConformance, ValuesThatNoControllerTakesAreRefused) {
  const std::string source = straight(3);
  const auto p = compiled(source);
  ASSERT_NE(p, nullptr);
  const Written good = written(*p, source);
  EXPECT_EQ(good.errors, 0U) << "three motions in a row are refused: " << good.said();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double x : {std::nan(""), kInfinity, -kInfinity, 1e300, -1e300}) {
    std::vector<double> q(6, x);
    const Written out = written(*p, source, [&](std::vector<PostPoint>& all) {
      for (PostPoint& one : all) {
        if (one.has_pose) one.pose.p[0] = one.pose.R[4] = x;
        if (!one.q.empty()) one.q = q;
      }
    });
    EXPECT_GT(out.errors, 0U) << "a target at " << x << " is written:\n" << out.text();
  }
  // What the program itself can say.
  for (const char* speed : {"0.0", "-1.0", "1.0E300", "1.0E-300"}) {
    const std::string own =
        program(pose_first() + "MOVE LIN " + pose(400) + " SPEED := " + std::string(speed) + ";");
    const auto other = compiled(own);
    if (!other) continue;
    const Written out = written(*other, own);
    EXPECT_FALSE(out.errors == 0 && has_no_number(out.text())) << speed << "\n" << out.text();
  }
}

TEST_P(PostConformance, NamesAreThoseOfTheTarget) {
  const PostCapabilities& c = post_->capabilities();
  if (!takes_structure() || !(c.features & kPostIntegers)) GTEST_SKIP() << "it has no variables";
  const auto source_of = [&](const std::string& a, const std::string& b) {
    return program(a + " := 5; " + b + " := " + a + " + 1;", "VAR INT: " + a + ", " + b + ";\n");
  };
  const std::string many(200, 'n');
  const std::string source = source_of(many + "a", many + "b");
  const auto p = compiled(source);
  ASSERT_NE(p, nullptr);
  const Written out = written(*p, source);
  EXPECT_EQ(out.errors, 0U) << out.said();
  const std::string longer(static_cast<std::size_t>(c.max_name) + 1, 'n');
  for (const auto& [name, text] : out.files)
    EXPECT_EQ(text.find(longer), std::string::npos) << "a name is too long in " << name;
  // A variable that is called as a reserved word makes that word no more frequent.
  const auto words = [&](const std::string& text) {
    std::map<std::string, std::size_t> all;
    std::string word;
    for (char x : text + " ") {
      const bool is_upper = x >= 'A' && x <= 'Z';
      if (is_upper || (x >= '0' && x <= '9') || (x >= 'a' && x <= 'z') || x == '_') {
        word += !c.case_matters && is_upper ? static_cast<char>(x - 'A' + 'a') : x;
        continue;
      }
      ++all[word];
      word.clear();
    }
    return all;
  };
  const std::string neutral = source_of("qq_one", "qq_two");
  const auto plain_words = words(written(*compiled(neutral), neutral).text());
  std::size_t tried = 0;
  for (std::size_t from = 0; from < c.reserved.size() && tried < 40;) {
    const std::size_t end = std::min(c.reserved.find(' ', from), c.reserved.size());
    const std::string word(c.reserved.substr(from, end - from));
    from = end + 1;
    if (word.empty()) continue;
    const std::string own = source_of(word, "qq_two");
    const auto other = compiled(own);
    if (!other) continue;  // no name in the language either
    ++tried;
    const auto found = words(written(*other, own).text());
    std::string folded = word;
    if (!c.case_matters)
      for (char& x : folded)
        if (x >= 'A' && x <= 'Z') x = static_cast<char>(x - 'A' + 'a');
    const auto now = found.find(folded), before = plain_words.find(folded);
    EXPECT_LE(now == found.end() ? 0 : now->second,
              before == plain_words.end() ? 0 : before->second)
        << "the reserved word " << word << " is a name";
  }
}

TEST_P(PostConformance, TextsAreInItsCharactersOrRefused) {
  const std::string source = program(
      "WRITELN('Gr\xc3\xb6\xc3\x9f"
      "e');");
  const auto p = compiled(source);
  if (!p) GTEST_SKIP() << "the language has no such texts";
  (void)written(*p, source);  // expect_sound looks at the bytes
}

TEST_P(PostConformance, AWishToStopIsHeard) {
  const std::string source = straight(20'000);
  const auto p = compiled(source);
  ASSERT_NE(p, nullptr);
  {
    StopAfter at_once(0);
    Written out(1);
    const auto done = ask(*p, out, at_once);
    ASSERT_FALSE(done.ok()) << "it was cancelled before it began, and went on";
    EXPECT_EQ(done.error().code, ErrorCode::cancelled) << done.error().sentence();
  }
  StopAfter soon(0.02);
  Written out(1);
  const auto done = ask(*p, out, soon);
  EXPECT_TRUE(done.ok() || done.error().code == ErrorCode::cancelled) << done.error().sentence();
  EXPECT_LT(soon.since_told(), 0.5) << "it goes on for long";
}

TEST_P(PostConformance, AnswersGrowWithTheProgramAndNoFaster) {
  // Bytes of a program; 0 = it is refused.
  const auto size = [&](std::size_t motions) {
    const std::string source = straight(motions);
    const auto p = compiled(source);
    if (!p) return std::size_t{0};
    const Written out = written(*p, source);
    EXPECT_LE(out.faults.size(), 2 * motions + 100);
    return out.errors > 0 ? std::size_t{0} : out.bytes();
  };
  const std::size_t small = size(100);
  EXPECT_GT(small, 0U) << "100 motions in a row are refused";
  // Some controllers take no more than a thousand lines.
  for (const std::size_t motions : {std::size_t{5000}, std::size_t{500}}) {
    const std::size_t large = size(motions);
    if (large == 0) continue;
    EXPECT_LE(large, 2 * motions / 100 * small);
    EXPECT_LE(large, motions * 4000);
    break;
  }
  // Wrong ones are named, but not without end.
  const std::string source = straight(2000);
  const auto p = compiled(source);
  ASSERT_NE(p, nullptr);
  const Written out = written(*p, source, [](std::vector<PostPoint>& all) {
    for (PostPoint& one : all) one.pose.p[0] = std::nan("");
  });
  EXPECT_LE(out.faults.size(), 4U * 2000U + 100U);
}

}  // namespace robomosp::conformance
