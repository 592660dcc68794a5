// SPDX-License-Identifier: Apache-2.0
// Arcs and smooth curves as straight pieces (layer: data processing, program_post).
#pragma once

#include <span>
#include <vector>

#include "program_post/legalise.h"

namespace robomosp::program_post {

/// Rewrites CIRCLE, where the target has none (no kPostCircle in its motions, or PostCircle::none),
/// and PATH (no kPostPath) to LIN, each piece passed but the last. The places of pieces lie on the
/// arc through the three places, or on the natural cubic spline through the targets by their
/// distances, which is what both mean when they run; between them the tool is at most `chord_mm`
/// away. Orientations are turned evenly from target to target. TIME is shared by length.
/// How many pieces and how far is a warning at the motion. What begins or leads where it is not
/// known stays: a CIRCLE is an error then, a PATH is left to go straight from target to target.
/// `points` are the known points of these tables.
void to_chords(ProgramTables&, const PostCapabilities&, std::span<const PostPoint> points,
               double chord_mm, std::vector<Remark>&);

}  // namespace robomosp::program_post
