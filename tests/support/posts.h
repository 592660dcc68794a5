// SPDX-License-Identifier: Apache-2.0
// Posts a program in IRL without the host: its output and its messages.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <robomosp/sdk/post_writer.h>

#include "compile.h"
#include "program_post/legalise.h"
#include "program_post/points.h"

namespace robomosp::test {

struct Posted {
  std::map<std::string, std::string> files;
  std::string faults;  ///< "error 3: sentence. hint" a line
  std::map<std::string, std::map<std::uint32_t, std::uint32_t>> map;  ///< file, line -> line of IRL
};

class NoParams final : public Params {
 public:
  [[nodiscard]] bool has(std::string_view) const override { return false; }
  [[nodiscard]] double real(std::string_view) const override { return 0; }
  [[nodiscard]] long long integer(std::string_view) const override { return 0; }
  [[nodiscard]] bool boolean(std::string_view) const override { return false; }
  [[nodiscard]] std::string_view text(std::string_view) const override { return ""; }
  [[nodiscard]] std::span<const double> reals(std::string_view) const override { return {}; }
  [[nodiscard]] Pose pose(std::string_view) const override { return {}; }
};

class PostSink final : public PostOutput {
 public:
  explicit PostSink(Posted& to) : to_(to) {}
  void file(std::string_view name, std::string_view bytes) override {
    EXPECT_TRUE(to_.files.emplace(name, bytes).second) << name << " is written twice";
  }
  void from(std::string_view file, std::uint32_t line, const rmp_span& span) override {
    to_.map[std::string(file)][line] = span.line;
  }
  void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
             std::string_view hint) override {
    static constexpr const char* kWords[] = {"error ", "warning ", "note "};
    to_.faults += kWords[severity] + std::to_string(span.line) + ": " + std::string(message) + "." +
                  (hint.empty() ? "" : " " + std::string(hint)) + "\n";
  }

 private:
  Posted& to_;
};

struct PostWith {
  PostProfile profile{};
  const RobotModel* robot = nullptr;
  const PostKinematics* kinematics = nullptr;
};

inline Posted post_code(const Post& post, const rmp_code& code, const PostWith& with = {}) {
  Posted out;
  PostSink sink(out);
  NoProgress progress;
  const auto before = program_post::known_points(code, with.robot, with.kinematics);
  program_post::LegaliseOptions options;
  options.points = before.points;
  const auto legal = program_post::legalise(code, post.capabilities(), options);
  for (const auto& r : legal.remarks) sink.fault(r.severity, r.span, r.message, r.hint);
  const auto points = program_post::known_points(legal.tables->code(), with.robot, with.kinematics);
  PostTask task;
  task.code = &legal.tables->code();
  task.name = code.name;
  task.points = points.points;
  task.robot = with.robot;
  task.kinematics = with.kinematics;
  task.profile = &with.profile;
  const NoParams params;
  const auto written = post.write(task, params, sink, progress);
  EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().sentence());
  return out;
}
inline Posted post_source(const Post& post, const std::string& source, const PostWith& with = {}) {
  const SourceFile file{"p.irl", source, {}};
  NoProgress progress;
  const auto made = irl::compile(std::span(&file, 1), progress);
  if (!made.ok()) {
    ADD_FAILURE() << made.error().sentence();
    return {};
  }
  const rmp_code& code = (*made)->code();
  for (std::uint32_t i = 0; i < code.faults.count; ++i) {
    const auto& f = row<rmp_code_fault>(code.faults, i);
    if (f.severity == RMP_FAULT_ERROR) ADD_FAILURE() << f.span.line << ": " << f.message;
  }
  if (code.has_errors) return {};
  return post_code(post, code, with);
}

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
/// Compares the files of a post with those in a folder, which ROBOMOSP_UPDATE_GOLDEN=1 rewrites;
/// its messages are in faults.txt.
inline void expect_golden(const Posted& posted, const std::filesystem::path& folder) {
  auto files = posted.files;
  files["faults.txt"] = posted.faults;
  if (std::getenv("ROBOMOSP_UPDATE_GOLDEN")) {
    std::filesystem::create_directories(folder);
    for (const auto& [name, text] : files) std::ofstream(folder / name, std::ios::binary) << text;
    return;
  }
  for (const auto& [name, text] : files)
    EXPECT_EQ(text, read_text(folder / name)) << (folder / name).string();
  std::size_t there = 0;
  for (const auto& e : std::filesystem::directory_iterator(folder)) there += e.is_regular_file();
  EXPECT_EQ(there, files.size()) << folder.string();
}

}  // namespace robomosp::test
