// SPDX-License-Identifier: Apache-2.0
#include "motion/provider_params.h"

#include <algorithm>
#include <utility>

#include "kernel/fault.h"

namespace robomosp::motion {
namespace {

const FaultCodes kParameterCodes{{"provider.parameter", ErrorCode::invalid_argument,
                                  "A provider refuses the name or value of a parameter."}};

}  // namespace

Value value_of(const model::ProviderChoice::Param& p) {
  return std::visit(
      [](const auto& v) -> Value {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::vector<double>>) return NumericArray(v);
        else return Value(v);
      },
      p);
}

Map values_of(const model::ProviderChoice& choice) {
  Map values;
  for (const auto& [name, value] : choice.params) values.set(name, value_of(value));
  return values;
}

const ParamSpec* find_parameter(const ProviderInfo& provider, std::string_view name) {
  return find_param(provider.schema, name);
}

Result<std::unique_ptr<Params>> checked_values(const ProviderInfo& provider, const Map& given,
                                               std::string_view where) {
  auto checked = check(provider.schema, given);
  if (!checked.ok()) {
    Error e = std::move(checked).error().in(where);
    amend(e, [&](Fault& f) {
      f.cause = std::make_shared<const Fault>(f);
      f.code = "provider.parameter";
      f.subject = {};
      f.subject.provider = provider.name;
      f.subject.interface_id = provider.interface_id;
      f.remedies.clear();
    });
    return e;
  }
  return make_params(std::move(checked).value());
}

Result<std::unique_ptr<Params>> checked_params(const ProviderInfo& provider,
                                               const model::ProviderChoice& choice,
                                               std::string_view where) {
  return checked_values(provider, values_of(choice), where);
}

}  // namespace robomosp::motion
