// SPDX-License-Identifier: Apache-2.0
// Approximates arcs and smooth curves by straight pieces (layer: data processing, program_post).
#pragma once

#include <span>
#include <vector>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Rewrites CIRCLE, if the target lacks it (no kPostCircle in its motions, or PostCircle::none),
/// and PATH (no kPostPath) to LIN, with every piece but the last passed. The points of pieces lie
/// on the arc through the three points, or on the natural cubic spline through the targets by their
/// distances, as when the program runs; between them the tool deviates by at most `chord_mm`.
/// Orientations are interpolated evenly from target to target. TIME is divided by length. A warning
/// at the motion gives the number of pieces and the deviation. Motions that start or pass at
/// unknown points are kept: a CIRCLE is then an error, a PATH remains and moves straight from
/// target to target. `points` are the known points of these tables.
void to_chords(ProgramTables&, const PostCapabilities&, std::span<const PostPoint> points,
               double chord_mm, std::vector<Remark>&);

}  // namespace robomosp::program_post
