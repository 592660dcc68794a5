/* SPDX-License-Identifier: Apache-2.0
 * The plugin door and what the host offers are C headers: this file only has to compile. */
#include <robomosp/sdk/files.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/threads.h>

extern const uint32_t abi_plugin_struct_size;
const uint32_t abi_plugin_struct_size = sizeof(rmp_plugin);
