// SPDX-License-Identifier: Apache-2.0
// A library that the plugin "missing_library" needs and does not find.
__attribute__((visibility("default"))) int absent_helper();
int absent_helper() { return 7; }
