// SPDX-License-Identifier: Apache-2.0
#include "files.h"

#include <array>
#include <atomic>
#include <fstream>
#include <iterator>

#include <robomosp/sdk/files.h>
#include <robomosp/sdk/host.h>

namespace robomosp::robot_files::files {
namespace {

namespace fs = std::filesystem;

std::atomic<const rmp_files*> door{nullptr};  ///< constant data of the host

enum Kind : std::int32_t { kNothing = 0, kFile = 1, kFolder = 2, kOther = 3 };

std::int32_t kind(const fs::path& path) {
  if (const rmp_files* f = door.load(std::memory_order_acquire)) return f->kind(path.c_str());
  std::error_code failed;
  const fs::file_status s = fs::status(path, failed);
  return fs::is_regular_file(s) ? kFile
         : fs::is_directory(s)  ? kFolder
         : fs::exists(s)        ? kOther
                                : kNothing;
}

}  // namespace

void use(const rmp_host* host) noexcept {
  const auto* f = static_cast<const rmp_files*>(Host(host).extension(RMP_FILES));
  if (f && RMP_HAS(f, read) && f->kind && f->read) door.store(f, std::memory_order_release);
}

bool exists(const fs::path& path) { return kind(path) != kNothing; }
bool is_file(const fs::path& path) { return kind(path) == kFile; }
bool is_folder(const fs::path& path) { return kind(path) == kFolder; }

Result<std::string> read(const fs::path& path, std::uint64_t most) {
  std::string bytes;
  if (const rmp_files* f = door.load(std::memory_order_acquire)) {
    std::array<char, 512> why{};
    const auto take = [](void* to, const char* some, std::uint64_t size) {
      static_cast<std::string*>(to)->assign(some, static_cast<std::size_t>(size));
    };
    if (f->read(path.c_str(), most, &bytes, take, why.data(), why.size()) == 0) return bytes;
    return error(ErrorCode::io, why.data());
  }
  std::error_code failed;
  if (fs::file_size(path, failed) > most || failed)
    return error(ErrorCode::io,
                 "it cannot be read, or has more than " + std::to_string(most >> 20) + " MiB");
  std::ifstream in(path, std::ios::binary);
  bytes.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  if (!in.good() && !in.eof()) return error(ErrorCode::io, "it cannot be read");
  return bytes;
}

}  // namespace robomosp::robot_files::files
