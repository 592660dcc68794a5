// SPDX-License-Identifier: Apache-2.0
// A helper program that crashes, hangs, floods or eats memory ends as one sentence.
#include "kernel/process.h"

#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

ProcessSpec shell(const std::string& script) {
  ProcessSpec spec;
  spec.program = "/bin/sh";
  spec.arguments = {"-c", script};
  return spec;
}

std::string process_fault(const ProcessSpec& spec) {
  NoProgress progress;
  const auto r = run_process(spec, progress);
  return r.ok() ? "it went well" : r.error().sentence();
}

TEST(Process, InputGoesThroughAndLinesOfStandardErrorAreHeard) {
  ProcessSpec spec = shell("cat; echo one >&2; printf two >&2");
  const std::string big(3'000'000, 'x');  // more than any pipe holds
  spec.input = big;
  std::vector<std::string> lines;
  spec.line = [&](std::string_view l) { lines.emplace_back(l); };
  NoProgress progress;
  const auto r = run_process(spec, progress);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  EXPECT_EQ(*r, big);
  EXPECT_EQ(lines, (std::vector<std::string>{"one", "two"}));
}

TEST(Process, LinesAreAnsweredAndAProgramThatWaitsForAnAnswerIsStopped) {
  ProcessSpec spec = shell(
      "i=0; while [ $i -lt 2000 ]; do echo $i >&2; read x || exit 4; echo $x; i=$((i+1)); done");
  spec.answer = [](std::string_view l) { return "got " + std::string(l) + "\n"; };
  NoProgress progress;
  const auto r = run_process(spec, progress);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  EXPECT_TRUE(r->starts_with("got 0\ngot 1\n"));
  EXPECT_TRUE(r->ends_with("got 1999\n"));
  ProcessSpec waits = shell("echo a >&2; read x; read y");
  waits.answer = [](std::string_view) { return std::string("one\n"); };
  waits.seconds = 0.3;
  EXPECT_NE(process_fault(waits).find("longer than 0.3 s"), std::string::npos);
  // One that ends before it reads what it is answered.
  ProcessSpec leaves = shell("echo a >&2; exit 0");
  leaves.answer = [](std::string_view) { return std::string(3'000'000, 'x'); };
  EXPECT_EQ(process_fault(leaves), "it went well");
}

TEST(Process, AProgramThatReadsNothingDoesNotBreakUs) {
  ProcessSpec spec = shell("exit 0");
  const std::string big(3'000'000, 'x');
  spec.input = big;
  EXPECT_EQ(process_fault(spec), "it went well");
}

TEST(Process, EveryEndIsToldApart) {
  EXPECT_EQ(process_fault(shell("exit 3")), "it ended with exit code 3.");
  EXPECT_EQ(process_fault(shell("kill -SEGV $$")), "it crashed (signal SIGSEGV).");
  ProcessSpec absent;
  absent.program = "/nowhere/at/all";
  EXPECT_EQ(
      process_fault(absent),
      "the program \"/nowhere/at/all\" is missing. Install the program again; it is a part of "
      "it.");
}

TEST(Process, AHangAndAFloodAreStoppedWithAllTheyStarted) {
  ProcessSpec hang = shell("sleep 600 & sleep 600");
  hang.seconds = 0.2;
  EXPECT_NE(process_fault(hang).find("longer than 0.2 s"), std::string::npos);
  // It closes its streams and stays.
  ProcessSpec deaf = shell("exec >&- 2>&-; sleep 600");
  deaf.seconds = 0.2;
  EXPECT_NE(process_fault(deaf).find("longer than 0.2 s"), std::string::npos);
  ProcessSpec flood = shell("yes");
  flood.most_output = 1 << 20;
  EXPECT_NE(process_fault(flood).find("more than 1 MiB"), std::string::npos);
}

TEST(Process, CancellingKillsAndIsToldAsSuch) {
  class Cancelled final : public Progress {
   public:
    void report(double, std::string_view) override {}
    bool cancelled() const override { return true; }
  } progress;
  const auto r = run_process(shell("sleep 600"), progress);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
}

#if !defined(__SANITIZE_ADDRESS__)
TEST(Process, MemoryIsLimited) {
  // The shell builds a word of ever doubling length; without a limit it would take all there is.
  ProcessSpec bomb = shell("a=xxxxxxxxxxxxxxxx; while :; do a=$a$a; done");
  bomb.memory = std::uint64_t{64} << 20;
  EXPECT_NE(process_fault(bomb), "it went well");
}
#endif

TEST(Process, ProgramsOfTheSystemAreFoundByThePath) {
  const auto shell_program = program_on_path("sh");
  ASSERT_FALSE(shell_program.empty());
  EXPECT_EQ(shell_program.filename(), "sh");
  EXPECT_TRUE(shell_program.is_absolute());
  EXPECT_TRUE(program_on_path("a-program-that-nobody-has").empty());
}

}  // namespace
}  // namespace robomosp
