// SPDX-License-Identifier: Apache-2.0
// TEACH as assignments of what the program's lists of data say (layer: data processing,
// program_post).
#pragma once

#include <vector>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Rewrites the tables in place. TEACH gives a variable the value that its list of data has for it,
/// which is known. A variable that nothing else assigns, and that nobody reads before, has it from
/// the beginning, so that targets made of it are known; else TEACH becomes an assignment. One
/// without a value is an error among the remarks. Gives whether any variable has its value from the
/// beginning now. Linear in the size of the tables and, for those, in the number of variables.
bool to_taught_values(ProgramTables&, std::vector<Remark>&);

}  // namespace robomosp::program_post
