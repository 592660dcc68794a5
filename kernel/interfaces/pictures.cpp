// SPDX-License-Identifier: Apache-2.0
// Pictures of scenes.
#include <robomosp/sdk/render.h>

#include "kernel/interface_file.h"

namespace robomosp {

RMP_INTERFACES(pictures, plain_interface<render::Renderer>("osg"));

}  // namespace robomosp
