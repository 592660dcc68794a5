// SPDX-License-Identifier: Apache-2.0
// Equality of records by fingerprint and comparison, as declared by their fields, and their size in
// memory (layer: application).
#pragma once

#include <cstddef>
#include <vector>

#include "kernel/fingerprint.h"
#include "model/data.h"
#include "model/records.h"

namespace robomosp::document {

/// Feeds kind and every field of the body, in a fixed order.
void feed(Fingerprinter& fp, const model::Body& body, const model::FeedReference& reference);
/// Feeds the solvers kept with a record; nothing if there are none.
void feed(Fingerprinter& fp, const std::vector<model::KeptSolver>& solvers);
/// Fingerprint of name, file and content, references by id.
[[nodiscard]] Fingerprint record_fingerprint(const model::Record& record);
/// True if two records are equal in everything, including what is known of their files.
[[nodiscard]] bool equal(const model::Record&, const model::Record&);
/// The same except for their files, which are not part of the history.
[[nodiscard]] bool same_content(const model::Record&, const model::Record&);
/// Approximate size of a record without what it shares with `other`, another version of it [bytes].
[[nodiscard]] std::size_t record_bytes(const model::Record& record,
                                       const model::Record* other = nullptr);

}  // namespace robomosp::document
