// SPDX-License-Identifier: Apache-2.0
// Plugin post_crcl: commands of the Canonical Robot Command Language behind robomosp.post/1.
#include <robomosp/sdk/plugin.h>

#include "crcl.h"

RMP_PLUGIN("org.robomosp.post_crcl", "1.0.0", "Apache-2.0",
           "Post-processor for the Canonical Robot Command Language (CRCL).",
           RMP_PROVIDER_NO_PARAMS(robomosp::post::crcl::Crcl, "crcl",
                                  "NIST CRCL: a program in XML.", ""))
