// SPDX-License-Identifier: Apache-2.0
// What says whether two records are the same: fingerprints and comparison, as the declarations of
// their fields give them; and what they weigh in memory (layer: application).
#pragma once

#include <cstddef>
#include <vector>

#include "kernel/fingerprint.h"
#include "model/data.h"
#include "model/records.h"

namespace robomosp::document {

/// Feeds kind and every field of the body, in a fixed order.
void feed(Fingerprinter& fp, const model::Body& body, const model::FeedReference& reference);
/// Feeds the solvers kept with a record; nothing where there are none.
void feed(Fingerprinter& fp, const std::vector<model::KeptSolver>& solvers);
/// Fingerprint of name, file and content, references by id.
[[nodiscard]] Fingerprint record_fingerprint(const model::Record& record);
/// Whether two records are equal in all, what is known of their files included.
[[nodiscard]] bool equal(const model::Record&, const model::Record&);
/// The same but for where they are kept: what the history knows of them.
[[nodiscard]] bool same_content(const model::Record&, const model::Record&);
/// Bytes a record occupies, about, without what it shares with `other`, another version of it.
[[nodiscard]] std::size_t record_bytes(const model::Record& record,
                                       const model::Record* other = nullptr);

}  // namespace robomosp::document
