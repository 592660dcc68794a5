// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_guard.h"

#include "kernel/text.h"

namespace robomosp {

void* guard_provider(const ProviderInfo& info, void* made) {
  for (const auto& guard : {&guard_solver, &guard_motion, &guard_run})
    if (void* guarded_one = guard(info, made)) return guarded_one;
  return made;
}

Error broken_answer(const std::string& provider, const std::string& what) {
  return error(ErrorCode::plugin_failed, "provider " + text::quote(provider) + " " + what,
               "Report it to the provider's author or choose another provider.");
}

}  // namespace robomosp
