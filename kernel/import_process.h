// SPDX-License-Identifier: Apache-2.0
// Importers with the tag "process" read files in a separate process, so that a file that crashes or
// hangs them causes an error rather than the end of the program (layer: core).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

namespace robomosp {

struct ImportProcess {
  std::string plugin;               ///< its file
  std::string provider;             ///< name
  std::vector<std::string> params;  ///< names of its parameters
  /// Receives what the importer logs, as rmp_host::log does; may be empty.
  std::function<void(std::int32_t severity, const char* source, const char* text)> log;
  bool only_confined = false;  ///< use the separate process only if the session is confined to a
                               ///< folder
};

/// Wraps `own`, which is only used for its file extensions (and for reading where `only_confined`
/// permits); robomosp-importer reads the files. Limits per file: 10 minutes and 8 GiB. Reading
/// needs the permit of Effect::processes if the session is denied it.
[[nodiscard]] std::unique_ptr<Importer> importer_in_process(std::unique_ptr<Importer> own,
                                                            ImportProcess);

}  // namespace robomosp
