// SPDX-License-Identifier: Apache-2.0
#include "kernel/file_stamp.h"

#include <cstdint>

#include <sys/stat.h>

namespace robomosp {

bool add_file_stamp(Fingerprinter& fp, const std::filesystem::path& file) {
  struct stat s {};
  const bool is_file = ::stat(file.c_str(), &s) == 0 && S_ISREG(s.st_mode);
  fp.add(is_file);
  if (is_file)
    fp.add(static_cast<std::int64_t>(s.st_size))
        .add(static_cast<std::int64_t>(s.st_mtim.tv_sec))
        .add(static_cast<std::int64_t>(s.st_mtim.tv_nsec));
  return is_file;
}

}  // namespace robomosp
