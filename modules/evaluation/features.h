// SPDX-License-Identifier: Apache-2.0
// Features of solids and objects: their list, the choice of one by index or words, and poses of
// parts that are placed on each other by them (layer: application, evaluation).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/document.h"

namespace robomosp::evaluation {

class Derived;

using Features = std::vector<CsgFeature>;

/// Features of a solid, or of all solids of an object, in its frame.
[[nodiscard]] Result<Features> features_of(Derived&, const document::Snapshot&, AnyId what,
                                           Progress&);
/// "plane", "cylinder" ...
[[nodiscard]] std::string_view kind_word(CsgFeature::Kind);

/// What a feature is chosen for, which decides the kinds that fit.
enum class FeatureUse : std::uint8_t {
  face,   ///< planes
  axis,   ///< cylinders, cones, tori, circles, lines
  point,  ///< all that have a point
};
/// An index of the list, from 1, or words such as "largest hole radius 5 mm".
using FeatureSelector = std::variant<double, std::string>;
inline constexpr std::string_view kSelectorHint =
    "A selector is an index of the list of features, or words: top, bottom, left, right, front, "
    "back, largest, smallest, plane, cylinder, hole, shaft, cone, sphere, torus, circle, line, "
    "corner, radius 5 mm, near (x, y, z); or origin, x axis, xy plane and their like.";

/// The one feature that a selector means. `whose` as in faults: `part "pin"`; `path`: the argument
/// that has the selector.
[[nodiscard]] Result<CsgFeature> choose_feature(const Features& all, const FeatureSelector&,
                                                FeatureUse, const std::string& whose,
                                                std::string_view path);
/// The same among the features of a solid or object, in its frame; these are not computed for words
/// such as "origin", which mean the frame itself.
[[nodiscard]] Result<CsgFeature> feature_of(Derived&, const document::Snapshot&, AnyId what,
                                            const FeatureSelector&, FeatureUse,
                                            const std::string& whose, std::string_view path,
                                            Progress&);
/// Rotation of the frame that a feature has: z along its direction (outward normal, axis), turned
/// out of the object's frame by as little as possible; a point has that of the object.
[[nodiscard]] std::array<double, 9> feature_rotation(const CsgFeature&);

/// How a part is placed on a feature.
struct Mate {
  FeatureUse use = FeatureUse::face;
  bool flip = false, centre = true;
  double offset = 0, angle = 0;  ///< along and about the other feature's direction [m, rad]
};
/// Pose of a part in its object, after a mate. `own` is its feature in its frame, `on` the other
/// one in the object's frame.
[[nodiscard]] Pose mated(const Pose& before, const CsgFeature& own, const CsgFeature& on,
                         const Mate&);

}  // namespace robomosp::evaluation
