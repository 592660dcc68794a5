// SPDX-License-Identifier: Apache-2.0
// Foreign files: what is read is checked as files of records are.
#include <robomosp/sdk/io.h>

#include "kernel/interface_file.h"

namespace robomosp {

RMP_INTERFACES(files, plain_interface<Importer>(), plain_interface<Exporter>());

}  // namespace robomosp
