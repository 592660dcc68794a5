/* SPDX-License-Identifier: Apache-2.0
 * The plugin door is a C header: this file only has to compile. */
#include <robomosp/sdk/plugin.h>

extern const uint32_t abi_plugin_struct_size;
const uint32_t abi_plugin_struct_size = sizeof(rmp_plugin);
