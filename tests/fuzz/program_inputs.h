// SPDX-License-Identifier: Apache-2.0
// Programs that are damaged at random, for the tests that read, compile, run and post them: what is
// asked of each fault, how long an input may take, and how much memory all may.
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "program/machine.h"
#include "support/program_world.h"
#include "support/random_program.h"

namespace robomosp::test {

using Clock = std::chrono::steady_clock;
inline double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}
/// Of one input; sanitizers and a loaded machine are within it.
constexpr double kMostSeconds = 20;
/// MiB that this process has held at most.
inline long most_megabytes() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return u.ru_maxrss / 1024;
}
#if defined(__SANITIZE_ADDRESS__)  // keeps what is given back for a while
constexpr long kMostMegabytes = 1500;
#else
constexpr long kMostMegabytes = 300;
#endif
/// What it was in the end, of all that has run so far.
inline void expect_memory() {
  const long held = most_megabytes();
  std::cout << "at most " << held << " MiB\n";
  EXPECT_LT(held, kMostMegabytes);
}

/// A fault stands in a file, at a line and a column that its bytes begin at, and is a sentence.
inline void expect_place(const rmp_code_fault& f, std::string_view text) {
  ASSERT_STRNE(f.message, "");
  ASSERT_LT(std::strlen(f.message), 2000U);
  ASSERT_LT(std::strlen(f.hint), 2000U) << f.message;
  ASSERT_TRUE(f.span.line >= 1 && f.span.column >= 1) << f.message;
  ASSERT_TRUE(f.span.begin <= f.span.end && f.span.end <= text.size()) << f.message;
  const std::string_view before = text.substr(0, f.span.begin);
  const std::size_t line = before.rfind('\n') + 1;  // npos + 1 is the first
  ASSERT_EQ(f.span.line,
            static_cast<std::uint32_t>(std::count(before.begin(), before.end(), '\n')) + 1)
      << f.message;
  ASSERT_EQ(f.span.column, before.size() - line + 1) << f.message;
}
using Texts = std::vector<std::pair<std::string, std::string>>;
/// ROBOMOSP_FUZZ_KEEP names a file that holds each input before it is tried, so that a crash leaves
/// it.
inline void keep(const Texts& texts) {
  static const char* const file = std::getenv("ROBOMOSP_FUZZ_KEEP");
  if (!file) return;
  std::ofstream out(file, std::ios::binary);
  for (const auto& [name, text] : texts) out << "==== " << name << "\n" << text;
}
/// `hints` = of how many errors, and how many of them say what to do.
inline std::shared_ptr<const CompiledProgram> compiled(
    const Texts& texts, std::pair<std::size_t, std::size_t>* hints = nullptr) {
  keep(texts);
  std::vector<SourceFile> files;
  for (const auto& [name, text] : texts) files.push_back({name, text, {}});
  NoProgress progress;
  auto made = irl::compile(files, progress);
  EXPECT_TRUE(made.ok());
  if (!made.ok()) return nullptr;
  for (const rmp_code_fault& f : (*made)->faults) {
    // Files are numbered as they are read; those of the language have no faults.
    const std::string name =
        f.span.file < (*made)->files.size() ? (*made)->files[f.span.file].name : "";
    const auto of =
        std::find_if(texts.begin(), texts.end(), [&](const auto& t) { return t.first == name; });
    EXPECT_NE(of, texts.end()) << f.message << " in " << name;
    if (of != texts.end()) expect_place(f, of->second);
    if (hints && f.severity == RMP_FAULT_ERROR) {
      ++hints->first;
      hints->second += *f.hint != 0;
    }
  }
  (*made)->seal();
  return std::shared_ptr<const CompiledProgram>(std::move(*made));
}
inline std::shared_ptr<const CompiledProgram> compiled(const std::string& text) {
  return compiled(Texts{{"p.irl", text}});
}
inline program::Limits limits() {
  program::Limits l;
  l.most_bytes = 8 << 20;
  l.slice = 20'000;
  l.most_instructions = 60'000;
  l.most_frames = 400;
  return l;
}
inline void run_a_while(program::Machine& m) {
  program::testing::TestWorld w;
  w.motion_seconds = 0.02;
  for (int step = 0; step < 100; ++step) {
    const program::Status& s = m.run(w.now, w);
    if (s.state == program::RunState::over || s.state == program::RunState::fault) {
      if (s.fault) {
        EXPECT_FALSE(s.fault->message.empty());
      }
      break;
    }
    if (step % 20 == 7) w.inputs["in1"] = {step % 40 == 7, 0};
    m.resume_pause();
    w.now += 0.05;
  }
  (void)m.globals();
  (void)m.call_stack();
}
inline std::string random_text(std::uint32_t seed) { return RandomProgram(seed).text(); }

inline constexpr const char* kTokens[] = {"MOVE LIN ",
                                          "MOVE_INC ",
                                          "UNTIL ",
                                          "ENDIF;",
                                          "IF ",
                                          "CASE ",
                                          "LABEL x:",
                                          "GOTO x;",
                                          "RETURN ",
                                          "PTP ",
                                          ":=",
                                          "(",
                                          ")",
                                          "[",
                                          "]",
                                          "{",
                                          "}",
                                          "'",
                                          "..",
                                          "99999999999",
                                          "1e999",
                                          "-1",
                                          "0",
                                          "TRUE",
                                          "LIST OF ",
                                          "RECORD ",
                                          "ENDRECORD",
                                          "@",
                                          ";",
                                          "\xff",
                                          "INOUT ",
                                          "POSE",
                                          "n0",
                                          "WAIT ",
                                          "START side;",
                                          "EXIT;",
                                          "HALT;",
                                          "C_CP :=",
                                          "TOOL :=",
                                          "\n",
                                          "ARRAY [1..1000000000] OF "};

/// Changes that often leave a program right: other numbers and names, lines twice, elsewhere or not
/// at all.
inline std::string changed_gently(std::string s, std::mt19937& random) {
  static constexpr const char* kNumbers[] = {
      "0",     "1",       "-1",    "2147483647", "2147483648", "65536", "0.0",
      "1e308", "-1e-308", "400.0", "4294967296", "12.5",       "3"};
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const auto is_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
  };
  const auto word_at = [&](std::size_t at) {
    std::size_t begin = at, end = at;
    while (begin > 0 && is_word(s[begin - 1])) --begin;
    while (end < s.size() && is_word(s[end])) ++end;
    return std::pair{begin, end - begin};
  };
  const auto line_at = [&](std::size_t at) {
    const std::size_t begin = at == 0 ? 0 : s.rfind('\n', at - 1) + 1;
    const std::size_t end = s.find('\n', at);
    return std::pair{begin, (end == std::string::npos ? s.size() : end + 1) - begin};
  };
  for (std::size_t k = 1 + pick(3); k > 0 && !s.empty(); --k) {
    const auto [word, length] = word_at(pick(s.size()));
    const bool is_number = length > 0 && std::isdigit(static_cast<unsigned char>(s[word])) != 0;
    switch (pick(4)) {
      case 0:
      case 1: {
        if (is_number) {
          s.replace(word, length, kNumbers[pick(std::size(kNumbers))]);
        } else if (const auto [other, n] = word_at(pick(s.size())); length > 0 && n > 0) {
          s.replace(word, length, std::string(s, other, n));
        }
        break;
      }
      case 2: {
        const auto [line, n] = line_at(pick(s.size()));
        const std::string text = s.substr(line, n);
        if (pick(2)) s.erase(line, n);
        if (!s.empty()) s.insert(line_at(pick(s.size())).first, text);
        break;
      }
      default: {
        const auto [line, n] = line_at(pick(s.size()));
        s.erase(line, n);
      }
    }
  }
  return s;
}

}  // namespace robomosp::test
