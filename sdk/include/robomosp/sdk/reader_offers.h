// SPDX-License-Identifier: Apache-2.0
// What a reader of robomosp.program_reader/1 can get about backups with files that use names of each
// other: which file offers a routine or a variable (layer: contract, std only).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/program_reader.h>

namespace robomosp {

/// What ProgramReader::extension(kExtensionId) points to, as `const ReaderOffers*`. With it, an
/// entry "@weld" of ProgramReader::needs() is the name of a routine or of data: the host adds the
/// file of the backup that offers it. It lives as long as the reader. [any thread]
class ReaderOffers {
 public:
  static constexpr const char* kExtensionId = "robomosp.reader_offers/1";
  virtual ~ReaderOffers() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Names of folders, in lower case, that lie in the root folder of a backup: {"system"}. The
  /// files of the whole root offer names. Without such a folder at most 8 levels above the program,
  /// the files of the program's folder and of the folders in it do. Constant data.
  [[nodiscard]] virtual std::span<const char* const> folders() const = 0;
  /// Names, in lower case, of routines and data of this file that other files may use. Of two files
  /// that offer a name, the host takes the nearer one to the file that uses it.
  virtual Result<std::vector<std::string>> offers(const SourceFile&) const = 0;
};

}  // namespace robomosp
