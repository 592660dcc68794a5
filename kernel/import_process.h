// SPDX-License-Identifier: Apache-2.0
// Importers with the tag "process" read in a process of their own, so that a file that crashes or
// hangs them ends in a sentence and not with the program (layer: core).
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
  /// Hears what the importer logs, as rmp_host::log does; may be empty.
  std::function<void(std::int32_t severity, const char* source, const char* text)> log;
  bool only_confined = false;  ///< as is, unless the session's files lie in a folder
};

/// `own` is asked for its extensions only (and reads, where `only_confined` says so); files are
/// read by robomosp-importer. A file may take 10 minutes and 8 GiB. Reading needs the permit of
/// Effect::processes where the session is denied it.
[[nodiscard]] std::unique_ptr<Importer> importer_in_process(std::unique_ptr<Importer> own,
                                                            ImportProcess);

}  // namespace robomosp
