// SPDX-License-Identifier: Apache-2.0
// Importers and exporters by the extensions of files, and their parameters (layer: application,
// exchange).
#pragma once

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/io.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "evaluation/sources.h"
#include "kernel/messages.h"
#include "kernel/registry.h"
#include "kernel/text.h"
#include "kernel/value.h"

namespace robomosp::exchange {

/// What imports and exports use. Refers to parts of the caller, which outlive it.
struct Exchange {
  evaluation::Sources from;
  Messages& messages;  ///< for what a user should know and no caller acts on
  const std::vector<std::filesystem::path>& library;  ///< folders of the shipped files
  Progress& progress;
};

/// Values for parameters of the provider of a format.
struct FormatValues {
  Map given{};    ///< of the command; one that the provider does not have is an error
  Map options{};  ///< those of the format alone, by name
};

/// The extension in lower case, without the dot.
[[nodiscard]] std::string extension_of(const std::string& file);

template <class I>
struct Chosen {
  ProviderInfo info;
  std::shared_ptr<I> provider;
};

/// The first enabled provider that knows the extension.
template <class I>
[[nodiscard]] Result<Chosen<I>> provider_for(const Exchange& with, const std::string& wanted,
                                             const char* verb) {
  std::vector<std::string> known;
  for (const ProviderInfo& info : with.from.registry.list(I::kInterfaceId)) {
    if (!info.enabled) continue;
    auto provider = with.from.registry.create<I>(info.name);
    if (!provider.ok()) {  // the others are of use all the same
      with.messages.post(Severity::warning, "provider_left_out", provider.error().sentence(),
                         "plugin");
      continue;
    }
    for (const std::string_view e : text::split((*provider)->extensions(), ',')) {
      if (text::trim(e) == wanted) return Chosen<I>{info, std::move(*provider)};
      known.emplace_back(text::trim(e));
    }
  }
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  if (known.empty())
    return error(ErrorCode::unsupported, std::string("no plugin can ") + verb + " foreign files",
                 "plugin.list lists the plugins that were found.");
  return error(ErrorCode::invalid_argument,
               wanted.empty()
                   ? std::string("the format of the file cannot be determined from its extension")
                   : "files with the extension ." + wanted + " cannot be " + verb + "ed",
               "Known: " + text::enumerate(known) + ".", "file");
}

/// The parameters of a provider: `values`, and over them those that were asked for. `materials` is
/// left out where the provider does not have it. An error names the value.
[[nodiscard]] Result<std::unique_ptr<Params>> params_for(const ProviderInfo&, const FormatValues&,
                                                         Map values, const std::string& file);

}  // namespace robomosp::exchange
