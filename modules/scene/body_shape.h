// SPDX-License-Identifier: Apache-2.0
// Shapes of solids, objects and materials (layer: application, scene). Internal to modules/scene.
// [any thread]
#pragma once

#include "scene/build.h"
#include "scene/shape.h"

namespace robomosp::scene {

/// The look of something that evaluation draws.
[[nodiscard]] render::Appearance appearance_of(const evaluation::Drawable&);

/// The items of a solid or object, all on body 0. Of a solid that cannot be made the operands in
/// the colour of a warning; where there is nothing at all to draw, the shape has the failure. An
/// error only when cancelled.
[[nodiscard]] Result<ShapePtr> body_shape(const Source&, AnyId solid_or_object, Progress&);
/// The same with meshes of a chord that is `coarser` times the solids' own, which can be there
/// sooner; what cannot be made so is left out.
[[nodiscard]] Result<ShapePtr> coarse_body_shape(const Source&, AnyId solid_or_object,
                                                 double coarser, Progress&);
/// A mark at the centre of mass; none, with a sentence, of what has no mass. An error only when
/// cancelled.
[[nodiscard]] Result<ShapePtr> body_mark(const Source&, AnyId solid_or_object, const Shape& bodies,
                                         Progress&);
/// The frames of an object's parts or a solid's nodes with their names. `length` [m]
[[nodiscard]] ShapePtr body_frames(const document::Snapshot&, AnyId solid_or_object, double length);
/// The lengths of a body's sides along its frame as a box of lines with a text. [mm]
[[nodiscard]] ShapePtr body_dimensions(const Shape& bodies);

/// A material on a sphere and a cone.
[[nodiscard]] ShapePtr material_shape(const model::Material&);

}  // namespace robomosp::scene
