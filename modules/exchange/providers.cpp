// SPDX-License-Identifier: Apache-2.0
#include "exchange/providers.h"

#include "kernel/schema.h"

namespace robomosp::exchange {

std::string extension_of(const std::string& file) {
  std::string e = std::filesystem::path(file).extension().string();
  if (!e.empty()) e.erase(0, 1);
  std::transform(e.begin(), e.end(), e.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return e;
}

namespace {

/// Parameters of a format's own: `options` of import and export.
Result<void> take_options(const ProviderInfo& info, const Map& options, Map& values) {
  for (const auto& [name, value] : options) {
    if (std::none_of(info.schema.begin(), info.schema.end(),
                     [&, &key = name](const ParamSpec& p) { return p.name == key; })) {
      std::vector<std::string> known;
      for (const ParamSpec& p : info.schema) known.push_back(p.name);
      std::string hint = text::did_you_mean(name, known);
      if (hint.empty())
        hint = known.empty() ? "It has none." : "It has " + text::enumerate(known) + ".";
      return error(ErrorCode::unknown_name,
                   "the provider " + text::quote(info.name) + " has no option " + text::quote(name),
                   hint, "options");
    }
    values.set(name, value);
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Params>> params_for(const ProviderInfo& info, const FormatValues& asked,
                                           Map values, const std::string& file) {
  for (const auto& [name, value] : asked.given) {
    if (value.is_nil()) continue;
    const bool is_known =
        std::any_of(info.schema.begin(), info.schema.end(),
                    [&, &key = name](const ParamSpec& p) { return p.name == key; });
    if (!is_known)
      return error(ErrorCode::invalid_argument, "." + extension_of(file) + " files have no " + name,
                   "Leave it out.", name);
    values.set(name, value);
  }
  RMP_TRY(take_options(info, asked.options, values));
  // What the command itself asks for is left out where the provider does not know it.
  if (std::none_of(info.schema.begin(), info.schema.end(),
                   [](const ParamSpec& p) { return p.name == "materials"; }))
    values.erase("materials");
  RMP_TRY_ASSIGN(Map checked, check(info.schema, values));
  return make_params(std::move(checked));
}

}  // namespace robomosp::exchange
