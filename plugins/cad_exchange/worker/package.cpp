// SPDX-License-Identifier: Apache-2.0
#include "package.h"

#include <memory>
#include <utility>

#include <zip.h>

namespace robomosp::cad_exchange {
namespace {

constexpr zip_int64_t kMostParts = 100000;
constexpr std::size_t kPiece = std::size_t{1} << 16;

int hex(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Without the slash it begins with, escapes written out, in lower case.
std::string plain(std::string_view name) {
  while (name.starts_with('/')) name.remove_prefix(1);
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    char c = name[i];
    if (c == '%' && i + 2 < name.size() && hex(name[i + 1]) >= 0 && hex(name[i + 2]) >= 0) {
      c = static_cast<char>(16 * hex(name[i + 1]) + hex(name[i + 2]));
      i += 2;
    }
    if (c == '\\') c = '/';
    out += c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  }
  return out;
}

Error damaged(const std::string& why) {
  return error(ErrorCode::syntax, "the package is damaged: " + why,
               "Check that it is complete; write it again with the program it comes from.");
}

}  // namespace

void Package::Close::operator()(zip* archive) const { zip_discard(archive); }

Result<Package> Package::open(const std::string& path) {
  Package out;
  int why = 0;
  out.zip_.reset(zip_open(path.c_str(), ZIP_RDONLY, &why));
  if (!out.zip_) {
    zip_error_t text;
    zip_error_init_with_code(&text, why);
    const std::string reason = zip_error_strerror(&text);
    zip_error_fini(&text);
    return error(ErrorCode::syntax, "the file is not readable as a ZIP package: " + reason,
                 "Check that it is complete and really of this format.");
  }
  const zip_int64_t count = zip_get_num_entries(out.zip_.get(), 0);
  if (count > kMostParts)
    return error(ErrorCode::unsupported, "the package has more than 100000 parts");
  for (zip_int64_t i = 0; i < count; ++i) {
    const auto index = static_cast<zip_uint64_t>(i);
    const char* name = zip_get_name(out.zip_.get(), index, ZIP_FL_ENC_RAW);
    if (!name) return damaged("its list of parts cannot be read");
    out.names_.emplace_back(name);
    out.parts_.try_emplace(plain(name), Place{index, name});
  }
  return out;
}

std::string Package::find(std::string_view name) const {
  const auto it = parts_.find(plain(name));
  return it == parts_.end() ? std::string() : it->second.name;
}

Result<void> Package::read(const std::string& name,
                           const std::function<Result<void>(std::string_view)>& take) const {
  const auto it = parts_.find(plain(name));
  if (it == parts_.end()) return damaged("the part \"" + name + "\" is missing");
  zip_stat_t stat;
  if (zip_stat_index(zip_.get(), it->second.index, 0, &stat) == 0 &&
      (stat.valid & ZIP_STAT_ENCRYPTION_METHOD) != 0 && stat.encryption_method != ZIP_EM_NONE)
    return error(ErrorCode::unsupported, "the part \"" + name + "\" is encrypted",
                 "Save the file without a password.");
  const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> file(
      zip_fopen_index(zip_.get(), it->second.index, 0), &zip_fclose);
  if (!file)
    return damaged("the part \"" + name + "\" cannot be opened: " + zip_strerror(zip_.get()));
  std::vector<char> piece(kPiece);
  for (zip_int64_t size = 1; size > 0;) {
    size = zip_fread(file.get(), piece.data(), piece.size());
    if (size < 0)
      return damaged("the part \"" + name +
                     "\" cannot be unpacked: " + zip_file_strerror(file.get()));
    RMP_TRY(take({piece.data(), static_cast<std::size_t>(size)}));
  }
  return {};
}

Result<std::string> Package::text(const std::string& name, std::size_t most) const {
  std::string out;
  RMP_TRY(read(name, [&](std::string_view piece) -> Result<void> {
    if (piece.size() > most - out.size())
      return error(ErrorCode::unsupported, "the part \"" + name + "\" is larger than " +
                                               std::to_string(most >> 20) + " MiB");
    out += piece;
    return {};
  }));
  return out;
}

}  // namespace robomosp::cad_exchange
