// SPDX-License-Identifier: Apache-2.0
// What the faults of a call that failed are about: its command, argument and record (layer:
// application, ioci only).
#pragma once

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::ioci {

struct FailedCall {
  CommandContext& ctx;
  const document::Snapshot& records;  ///< that stay, without what the call wanted to edit
  const CommandSpec& spec;
  const Map& given;  ///< its arguments
  bool may_try;      ///< remedies may be tried; else they are offered untried
};
/// Completes the faults of the error of a call: command, argument and the record `id`, where they
/// name none; remedies get their command, and those that would repeat a call within it are dropped.
/// A subject that cannot be opened (a record that the call wanted to make) is cleared.
void complete_faults(Error& e, const FailedCall& call);

}  // namespace robomosp::ioci
