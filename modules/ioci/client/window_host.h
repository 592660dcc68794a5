// SPDX-License-Identifier: Apache-2.0
// WindowHost: a window as the commands window.* drive it. The window registers itself, so that ioci
// knows no widgets (layer: application).
#pragma once

#include <memory>
#include <mutex>
#include <string_view>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp::ioci {

class Application;

/// A window of this program.
class WindowHost {
 public:
  WindowHost() = default;
  WindowHost(const WindowHost&) = delete;
  WindowHost& operator=(const WindowHost&) = delete;
  virtual ~WindowHost() = default;
  /// Carries out one of the commands window.*, named by the part after the dot, on the window's
  /// thread and waits for it. Fails with ErrorCode::cancelled if `progress` is cancelled or the
  /// window closes first. [any thread but the window's]
  virtual Result<Value> act(std::string_view what, const Map& args, Progress& progress) = 0;
};

/// The window of an application, kept by it (Application::kept). [any thread]
class Windows {
 public:
  explicit Windows(Application&) {}
  [[nodiscard]] static Windows& of(Application&);
  /// Replaces the present one; null = no window.
  void set(std::shared_ptr<WindowHost>);
  /// Null without a window.
  [[nodiscard]] std::shared_ptr<WindowHost> current() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<WindowHost> host_;  // guarded by mutex_
};

}  // namespace robomosp::ioci
