// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/image.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include <png.h>

namespace robomosp::viewer {
namespace {

Error cannot_write(const std::string& path, const std::string& reason) {
  return error(ErrorCode::io, "cannot write the picture \"" + path + "\": " + reason,
               "Choose another file or free some space.");
}

}  // namespace

Result<std::string> png_of(const render::Image& image) {
  const auto wanted = 4 * static_cast<std::size_t>(image.width > 0 ? image.width : 0) *
                      static_cast<std::size_t>(image.height > 0 ? image.height : 0);
  if (wanted == 0 || image.rgba.size() != wanted)
    return error(ErrorCode::invalid_argument, "the picture has no pixels",
                 "Give a width and a height of at least one pixel.");
  bool is_opaque = true;
  for (std::size_t i = 3; i < wanted; i += 4) is_opaque = is_opaque && image.rgba[i] == 255;
  std::vector<std::uint8_t> rgb;
  if (is_opaque) {
    rgb.reserve(wanted / 4 * 3);
    for (std::size_t i = 0; i < wanted; ++i)
      if (i % 4 != 3) rgb.push_back(image.rgba[i]);
  }
  png_image header;
  std::memset(&header, 0, sizeof header);
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = is_opaque ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  const void* pixels = is_opaque ? rgb.data() : image.rgba.data();
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(header), '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, pixels, 0, nullptr) == 0)
    return error(ErrorCode::internal,
                 std::string("the picture cannot be packed as PNG: ") + header.message,
                 "Try a smaller picture.");
  bytes.resize(size);
  return bytes;
}

Result<void> write_png(const Image& image, const std::string& path) {
  const auto wanted = 3 * static_cast<std::size_t>(image.width > 0 ? image.width : 0) *
                      static_cast<std::size_t>(image.height > 0 ? image.height : 0);
  if (wanted == 0 || image.rgb.size() != wanted) {
    return error(ErrorCode::invalid_argument, "the picture for \"" + path + "\" has no pixels",
                 "Give a width and a height of at least one pixel.");
  }
  const auto folder = std::filesystem::path(path).parent_path();
  std::error_code ignored;
  if (!folder.empty() && !std::filesystem::is_directory(folder, ignored)) {
    return error(
        ErrorCode::not_found,
        "cannot write the picture \"" + path + "\": there is no folder \"" + folder.string() + "\"",
        "Create the folder or choose another one.");
  }

  png_image header;
  std::memset(&header, 0, sizeof header);
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGB;

  const std::string partial = path + ".part";
  {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(partial.c_str(), "wb"),
                                                               &std::fclose);
    if (!file) return cannot_write(path, std::strerror(errno));
    const bool is_written =
        png_image_write_to_stdio(&header, file.get(), 0, image.rgb.data(), 0, nullptr) != 0 &&
        std::fflush(file.get()) == 0;
    if (!is_written) {
      const std::string reason = header.message[0] != '\0' ? header.message : std::strerror(errno);
      std::filesystem::remove(partial, ignored);
      return cannot_write(path, reason);
    }
  }
  std::error_code failure;
  std::filesystem::rename(partial, path, failure);
  if (failure) {
    std::filesystem::remove(partial, ignored);
    return cannot_write(path, failure.message());
  }
  return {};
}

}  // namespace robomosp::viewer
