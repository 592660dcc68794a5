// SPDX-License-Identifier: Apache-2.0
// Default providers that are kept with the document, as records of the kind default_provider
// (layer: application, ioci).
#pragma once

#include <string>

#include <robomosp/sdk/result.h>

#include "model/kind.h"

namespace robomosp::ioci {

class Application;
class CommandContext;

/// The kind, registered when first asked for.
[[nodiscard]] Kind default_provider_kind();

/// From now on the registry follows the document's records of that kind; a provider that is not
/// there is posted as a warning.
void follow_document_providers(Application&);

/// Edits the document's choice; an empty name takes it back. An error when there is no such
/// provider.
Result<void> keep_document_provider(CommandContext&, const std::string& interface_id,
                                    const std::string& name);

}  // namespace robomosp::ioci
