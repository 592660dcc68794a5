// SPDX-License-Identifier: Apache-2.0
// Settings of a plugin's module, saved as a record of the module's name (layer: data processing).
#pragma once

#include "model/basics.h"

namespace robomosp::model {

struct PluginSettings {
  ProviderChoice of;  ///< name of the module, and what was set; what was not has its default
};
template <class V>
constexpr void fields(V& v, Of<PluginSettings>) {
  v("of", &PluginSettings::of).needed().doc("The plugin's module, with the values that were set.");
}

}  // namespace robomosp::model
