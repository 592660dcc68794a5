// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.post/1: three-address code to files for one controller
// (layer: contract, std only).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/compiler.h>

namespace robomosp {

/// One generated file; the host writes it.
struct GeneratedFile {
  std::string name;  ///< relative, without folders
  std::string text;
};

/// Interface robomosp.post/1. [any thread]
class PostProcessor {
 public:
  using Interface = PostProcessor;
  static constexpr const char* kInterfaceId = "robomosp.post/1";
  virtual ~PostProcessor() = default;
  /// Translates; an operation the controller cannot do is an error that names the source line.
  virtual Result<std::vector<GeneratedFile>> generate(const ThreeAddressCode&, const Params&,
                                                      Progress&) const = 0;
};

}  // namespace robomosp
