// SPDX-License-Identifier: Apache-2.0
// ProviderProcess: a plugin in a separate process, robomosp-provider; its providers are called over
// shared memory. If they crash or hang it, the call fails with an error that names them, and the
// next call starts another process (layer: core).
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

/// Resource limits of a plugin's process.
struct ApartLimits {
  /// A process without any sign of life (reply, progress or request) for this long during a call is
  /// ended [s].
  double seconds = 60;
  std::uint64_t memory = std::uint64_t{4} << 30;  ///< address space, at least 256 MiB [bytes]
  /// The process opens no files but libraries and those shipped with the plugin, starts no process
  /// and has no network.
  bool confined = true;
  bool operator==(const ApartLimits&) const = default;
};

class ProviderProcess {
 public:
  /// Names of the parameters of any provider of the program, by interface and name.
  using ParamNames =
      std::function<std::vector<std::string>(std::string_view interface_id, std::string_view name)>;
  /// Does not start a process yet. `host` is passed to the plugin, and must outlive all objects it
  /// creates.
  ProviderProcess(std::filesystem::path plugin, ApartLimits limits, const rmp_host* host,
                  ParamNames params);
  ~ProviderProcess();  ///< objects created before keep the process alive
  ProviderProcess(const ProviderProcess&) = delete;
  ProviderProcess& operator=(const ProviderProcess&) = delete;

  /// The plugin's tables. Starts a process if none is running.
  [[nodiscard]] Result<apart::PluginWire> describe();
  /// Creates the provider of a row: a proxy of the interface class. Several threads may call its
  /// functions at once, as the interface defines. [any thread]
  [[nodiscard]] Result<void*> create(std::uint32_t row, const std::string& interface_id,
                                     const std::string& name, std::vector<std::string> params);
  /// Ends the process. The next call starts another.
  void end();
  /// Id of the running process; 0 = none.
  [[nodiscard]] int process() const;
  /// Number of processes started so far.
  [[nodiscard]] std::uint64_t starts() const;
  [[nodiscard]] const ApartLimits& limits() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace robomosp
