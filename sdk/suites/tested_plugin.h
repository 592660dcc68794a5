// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The file that is tested: the program's first argument.
const char* robomosp_tested_plugin();
