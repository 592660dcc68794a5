// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_guard.h"

#include "kernel/interface_file.h"
#include "kernel/text.h"

namespace robomosp {

void* guard_provider(const ProviderInfo& info, void* made) {
  const InterfaceEntry* entry = InterfaceFile::find(info.interface_id);
  return entry && entry->guard ? entry->guard(info, made) : made;
}

Error broken_answer(const std::string& provider, const std::string& what) {
  return error(ErrorCode::plugin_failed, "provider " + text::quote(provider) + " " + what,
               "Report it to the provider's author or choose another provider.");
}

}  // namespace robomosp
