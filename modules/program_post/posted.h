// SPDX-License-Identifier: Apache-2.0
// What posts write and report (layer: application, program_post).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/post.h>

namespace robomosp::program_post {

using PostedFiles = std::vector<std::pair<std::string, std::string>>;  ///< names and texts

/// What is wrong, or to be known, at a place of the program.
struct PostedFault {
  std::uint32_t severity = 0;  ///< rmp_fault_severity
  rmp_span span{};
  std::string message, hint;
};
/// A line of a written file, and what of the program it is of.
struct PostedLine {
  std::string file;
  std::uint32_t line = 0;
  rmp_span span{};
};
/// What a post has written and said; hints are those that can still be followed.
class Posted final : public PostOutput {
 public:
  bool is_flat = false;    ///< it is posted flattened: no hint says to
  bool has_robot = false;  ///< a robot is named: no hint says to
  void file(std::string_view name, std::string_view bytes) override {
    files.emplace_back(name, bytes);
  }
  void from(std::string_view file, std::uint32_t line, const rmp_span& span) override {
    if (files.empty() || lines.empty() || lines.back().file != file)
      lines.push_back({std::string(file), line, span});
    else lines.push_back({lines.back().file, line, span});
  }
  void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
             std::string_view hint) override;
  [[nodiscard]] std::size_t errors() const;
  PostedFiles files;
  std::vector<PostedLine> lines;
  std::vector<PostedFault> faults;
  std::string form;
};

}  // namespace robomosp::program_post
