// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/handle_kinds.h"

#include <algorithm>

#include "kernel/text.h"
#include "model/kind.h"

namespace robomosp::ioci {

Result<void> HandleKinds::add(std::string kind, NameOf name_of) {
  if (find(kind) || kind_from(kind))
    return error(ErrorCode::invalid_argument,
                 "there are handles of kind " + text::quote(kind) + " already",
                 "Choose another word.");
  entries_.push_back({std::move(kind), std::move(name_of)});
  return {};
}

const HandleKinds::Entry* HandleKinds::find(std::string_view kind) const {
  const auto at = std::find_if(entries_.begin(), entries_.end(),
                               [&](const Entry& e) { return e.kind == kind; });
  return at == entries_.end() ? nullptr : &*at;
}

}  // namespace robomosp::ioci
