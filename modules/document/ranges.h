// SPDX-License-Identifier: Apache-2.0
// What the declarations of the records' fields allow: finite numbers in their ranges, known words,
// places in lists that there are, names (layer: application). Internal to modules/document.
#pragma once

#include <robomosp/sdk/result.h>

#include "document/validate.h"
#include "model/data.h"

namespace robomosp::document {

/// `subject` becomes the element of the record that a fault is about. What the record shares with
/// `before` (data null = none) is not looked at.
[[nodiscard]] Result<void> check_ranges(const model::Content&, Subject& subject, const Watch&,
                                        const model::Content& before = {});

/// Every element of the record's lists that has a name has one of its own.
[[nodiscard]] Result<void> check_names(const model::Content&, Subject& subject);

}  // namespace robomosp::document
