// SPDX-License-Identifier: Apache-2.0
// Masses of solids and objects (layer: application, evaluation). Internal to modules/evaluation.
// [any thread]
#pragma once

#include <vector>

#include "evaluation/derived.h"
#include "evaluation/solids.h"

namespace robomosp::evaluation {

/// As Derived::mass(); `listed` gets what each solid adds, in order of listing.
[[nodiscard]] Result<BodyMass> body_mass(Solids&, const document::Snapshot&, AnyId solid_or_object,
                                         Progress&, std::vector<PartMass>* listed = nullptr);

}  // namespace robomosp::evaluation
