// SPDX-License-Identifier: Apache-2.0
// Masses of solids and objects (layer: application, evaluation). Internal to modules/evaluation.
// [any thread]
#pragma once

#include <span>
#include <vector>

#include "evaluation/derived.h"
#include "evaluation/solids.h"

namespace robomosp::evaluation {

/// As Derived::mass(); `listed` gets what each solid adds, in order of listing.
[[nodiscard]] Result<BodyMass> body_mass(Solids&, const document::Snapshot&, AnyId solid_or_object,
                                         Progress&, std::vector<PartMass>* listed = nullptr);

/// As Derived::mass() of parts.
[[nodiscard]] Result<BodyMass> parts_mass(Solids&, const document::Snapshot&,
                                          std::span<const model::BodyPart>, Progress&);

}  // namespace robomosp::evaluation
