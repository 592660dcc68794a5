// SPDX-License-Identifier: Apache-2.0
// A provider that the document takes where none is named (layer: data processing).
#pragma once

#include <string>

#include "model/fields.h"

namespace robomosp::model {

struct DefaultProvider {
  std::string interface;  ///< "robomosp.ik/1"
  std::string provider;   ///< its name, whether it is there or not
};
template <class V>
constexpr void fields(V& v, Of<DefaultProvider>) {
  v("interface", &DefaultProvider::interface).needed().doc("The interface, such as robomosp.ik/1.");
  v("provider", &DefaultProvider::provider).needed().doc("Provider that is used if none is named.");
}

}  // namespace robomosp::model
