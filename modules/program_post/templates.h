// SPDX-License-Identifier: Apache-2.0
// Targets made of text: one template per construct, without a compiler (layer: data processing,
// program_post). Their form is described in docs/plugin_author/post_templates.md.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/post.h>

namespace robomosp::program_post {

/// A parsed pack; constant. [any thread]
class TemplatePack;

/// A fault of a pack, with its place.
struct PackFault {
  std::string file;
  std::uint32_t line = 1, column = 1;
  std::string message, hint;
  [[nodiscard]] std::string place() const {
    return file + ":" + std::to_string(line) + ":" + std::to_string(column);
  }
};
/// The text of another file of the pack, by its name, for `include`.
using PackFiles = std::function<Result<std::string>(const std::string& name)>;

/// Reads a pack; `where` names its file in errors. All faults are in one error, a sentence each
/// with its place: constructs that its features need but that have no template, unknown constructs,
/// variables and filters, syntax errors. `faults`, if given, receives them one by one.
[[nodiscard]] Result<std::shared_ptr<const TemplatePack>> read_templates(
    std::string_view text, const std::string& where, const PackFiles& files = {},
    std::vector<PackFault>* faults = nullptr);
/// The name that the pack declares, used as the provider's.
[[nodiscard]] const std::string& pack_name(const TemplatePack&);
[[nodiscard]] const std::string& pack_title(const TemplatePack&);
[[nodiscard]] std::unique_ptr<Post> make_template_post(std::shared_ptr<const TemplatePack>);

}  // namespace robomosp::program_post
