// SPDX-License-Identifier: Apache-2.0
// Checks of records against the declarations of their fields: finite numbers in their ranges, known
// words, existing indices of lists, names (layer: application). Internal to modules/document.
#pragma once

#include <robomosp/sdk/result.h>

#include "document/validate.h"
#include "model/data.h"

namespace robomosp::document {

/// `subject` is set to the element of the record with the fault. Parts that the record shares with
/// `before` (data null = none) are skipped.
[[nodiscard]] Result<void> check_ranges(const model::Content&, Subject& subject, const Watch&,
                                        const model::Content& before = {});

/// Checks that the names of the elements of each list are unique.
[[nodiscard]] Result<void> check_names(const model::Content&, Subject& subject);

}  // namespace robomosp::document
