// SPDX-License-Identifier: Apache-2.0
// The XML documents of one import: the robot's file and those it includes, each linked to the
// including one (layer: plugin). Input is not trusted: sizes, numbers and cycles are limited.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "xml.h"

namespace robomosp::robot_files {

/// Origin of a document; elements find it through their document.
struct Source {
  std::string name;               ///< for messages; "" = the robot's own file
  std::filesystem::path path;     ///< "" = text without a file
  const Source* asked = nullptr;  ///< the document that includes it
};
/// Of the document that the element is in, or nullptr.
[[nodiscard]] const Source* source_of(const Element& e);

class Documents {
 public:
  explicit Documents(std::shared_ptr<Reach> reach);
  ~Documents();
  /// The root of the robot's own file.
  Result<const Element*> parse(std::string_view text, const std::filesystem::path& path);
  [[nodiscard]] Reach& reach() { return *reach_; }
  /// The root of a file included by the element `asked`; a file out of reach is rejected.
  Result<const Element*> open(const Element& asked, const std::filesystem::path& file);

 private:
  struct One;
  std::shared_ptr<Reach> reach_;
  Result<const Element*> add(std::string_view text, Source source);
  std::vector<std::unique_ptr<One>> all_;
  std::uintmax_t bytes_ = 0;
};

}  // namespace robomosp::robot_files
