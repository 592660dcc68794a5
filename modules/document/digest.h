// SPDX-License-Identifier: Apache-2.0
// The content of a record as canonical bytes for a fingerprint (layer: application).
#pragma once

#include <cstdint>
#include <functional>

#include "kernel/fingerprint.h"
#include "model/records.h"

namespace robomosp::document {

/// Feeds one reference: by id, or by kind and name.
using FeedReference = std::function<void(Fingerprinter&, AnyId)>;

/// Feeds every field of the body, in a fixed order.
void feed(Fingerprinter& fp, const model::Body& body, const FeedReference& reference);
/// Fingerprint of name, file and content, references by id.
[[nodiscard]] Fingerprint record_fingerprint(const model::Record& record);
/// Bytes a record occupies, about.
[[nodiscard]] std::size_t record_bytes(const model::Record& record);

}  // namespace robomosp::document
