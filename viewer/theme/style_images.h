// SPDX-License-Identifier: GPL-3.0-or-later
// Files of the images that style sheets show (layer: GUI). [GUI thread]
#pragma once

namespace robomosp::viewer {

/// Removes the temporary folder of the images, for a program that ends without the destructors of
/// static objects. A style sheet that is made later has a new one.
void remove_style_images();

}  // namespace robomosp::viewer
