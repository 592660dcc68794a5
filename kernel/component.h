// SPDX-License-Identifier: Apache-2.0
// Components: the parts of the program, in layers, started inside out and stopped in reverse
// (layer: core).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp {

/// The layers of the onion: each may use itself and the layers inside it.
enum class Layer : std::uint8_t { core, data_processing, application, gui };
[[nodiscard]] std::string_view to_string(Layer);

struct ComponentInfo {
  std::string id;  ///< "document", "plugin:csg_occt"
  Layer layer = Layer::core;
  std::vector<std::string> requires_;  ///< ids
};

/// A part of the program that is started and stopped. [application thread]
class Component {
 public:
  virtual ~Component() = default;
  virtual Result<void> start() { return {}; }
  virtual void stop() noexcept {}
};

class Components {
 public:
  Components() = default;
  Components(const Components&) = delete;
  Components& operator=(const Components&) = delete;
  ~Components();  ///< stops the running components

  /// Rejects a second component with the same id.
  Result<void> add(ComponentInfo, std::unique_ptr<Component>);
  /// Starts all components in topological order. Before starting any, it rejects a missing id, a
  /// component that needs an outer layer, and a cycle (with its path), by name. If a start fails,
  /// the components already started are stopped again. A later call starts the components added
  /// since.
  Result<void> start_all();
  void stop_all() noexcept;                               ///< reverse order
  [[nodiscard]] std::vector<ComponentInfo> list() const;  ///< in start order once started

 private:
  struct Entry {
    ComponentInfo info;
    std::unique_ptr<Component> component;
  };
  [[nodiscard]] Result<std::vector<std::vector<std::size_t>>> edges() const;
  [[nodiscard]] Result<std::vector<std::size_t>> start_order() const;
  void stop_down_to(std::size_t count) noexcept;
  std::vector<Entry> entries_;
  std::vector<std::size_t> running_;  ///< in start order
};

}  // namespace robomosp
