// SPDX-License-Identifier: Apache-2.0
// Plugin post_as: programs for Kawasaki controllers behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "as.h"

RMP_PLUGIN("org.robomosp.post_as", "1.0.0", "Apache-2.0", "Post-processor for Kawasaki AS.",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::as::As, "as",
                                  "Kawasaki AS: programs and points in one file.", "carried_base"))
