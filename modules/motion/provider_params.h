// SPDX-License-Identifier: Apache-2.0
// Values given for a provider's parameters, checked against its own table (layer: data processing,
// motion).
#pragma once

#include <memory>
#include <string_view>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/result.h>

#include "kernel/registry.h"
#include "kernel/value.h"
#include "model/records.h"

namespace robomosp::motion {

[[nodiscard]] Value value_of(const model::ProviderChoice::Param&);
[[nodiscard]] Map values_of(const model::ProviderChoice&);

/// A provider's parameter by its name; null = it has none such.
[[nodiscard]] const ParamSpec* find_parameter(const ProviderInfo&, std::string_view name);

/// `where` names the choice in errors.
Result<std::unique_ptr<Params>> checked_values(const ProviderInfo&, const Map& given,
                                               std::string_view where);
Result<std::unique_ptr<Params>> checked_params(const ProviderInfo&, const model::ProviderChoice&,
                                               std::string_view where);

}  // namespace robomosp::motion
