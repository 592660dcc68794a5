// SPDX-License-Identifier: Apache-2.0
// MP4 files: H.264 by the library OpenH264, which is opened with the first film, in a container
// written here (layer: application, scene). [one thread at a time]
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include <robomosp/sdk/result.h>

namespace robomosp::scene {

/// Writes a film of pictures of equal duration that every player and browser shows.
class Mp4Writer {
 public:
  /// Sizes 16..3840 x 16..2160 px; odd ones get a row or column more, as the format needs. `fps`
  /// 0.1..240 [Hz]. Fails where the library is missing, in a sentence that names its package.
  [[nodiscard]] static Result<Mp4Writer> create(std::size_t width, std::size_t height, double fps);
  Mp4Writer(Mp4Writer&&) noexcept;
  Mp4Writer& operator=(Mp4Writer&&) noexcept;
  ~Mp4Writer();
  /// Adds width x height pixels: bytes red, green, blue, opacity, which does not count.
  [[nodiscard]] Result<void> add(std::span<const std::uint8_t> rgba);
  /// The file; no frame can follow.
  [[nodiscard]] Result<std::string> finish();

 private:
  struct Impl;
  explicit Mp4Writer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::scene
