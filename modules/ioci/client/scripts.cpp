// SPDX-License-Identifier: Apache-2.0
#include "ioci/client/scripts.h"

namespace robomosp::ioci {
namespace {

ScriptLanguage::Make& registered_language() {
  static ScriptLanguage::Make make = nullptr;
  return make;
}

}  // namespace

ScriptLanguage::ScriptLanguage(Make make) { registered_language() = make; }
ScriptLanguage::Make ScriptLanguage::registered() { return registered_language(); }

}  // namespace robomosp::ioci
