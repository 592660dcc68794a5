// SPDX-License-Identifier: Apache-2.0
// ProviderProcess: a plugin in a process of its own, robomosp-provider, whose providers are called
// across shared memory. What they do to their process is an error that names them, and the next
// call starts another (layer: core).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

namespace apart {
struct PluginWire;
}

/// What a plugin's process may use.
struct ApartLimits {
  /// A call that says nothing for so long (no answer, no progress, no question) has its process
  /// ended [s].
  double seconds = 60;
  std::uint64_t memory = std::uint64_t{4} << 30;  ///< address space, at least 256 MiB [bytes]
  /// Opens no file but libraries and what comes with the plugin, starts nothing and has no network.
  bool confined = true;
  bool operator==(const ApartLimits&) const = default;
};

class ProviderProcess {
 public:
  /// Names of the parameters of any provider of the program, by interface and name.
  using ParamNames =
      std::function<std::vector<std::string>(std::string_view interface_id, std::string_view name)>;
  /// Starts nothing yet. `host` is what the plugin is offered, and outlives all that it makes.
  ProviderProcess(std::filesystem::path plugin, ApartLimits limits, const rmp_host* host,
                  ParamNames params);
  ~ProviderProcess();  ///< what was made keeps the process until it is gone
  ProviderProcess(const ProviderProcess&) = delete;
  ProviderProcess& operator=(const ProviderProcess&) = delete;

  /// What the plugin's tables say. Starts a process if none runs.
  [[nodiscard]] Result<apart::PluginWire> describe();
  /// A provider, by its row: a proxy of the class of the interface. Its functions may be called
  /// by several threads at once, as the interface says. [any thread]
  [[nodiscard]] Result<void*> create(std::uint32_t row, const std::string& interface_id,
                                     const std::string& name, std::vector<std::string> params);
  /// Ends the process. The next call starts another.
  void end();
  /// Of the process that runs; 0 = none.
  [[nodiscard]] int process() const;
  /// How many were started.
  [[nodiscard]] std::uint64_t starts() const;
  [[nodiscard]] const ApartLimits& limits() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace robomosp
