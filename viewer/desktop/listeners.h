// SPDX-License-Identifier: GPL-3.0-or-later
// Listeners: callbacks of objects of the window, which end with their owners (layer: GUI).
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include <QObject>
#include <QPointer>

namespace robomosp::viewer {

/// [GUI thread]
template <class... A>
class Listeners {
 public:
  /// `call` is called as long as `owner` lives.
  void add(QObject* owner, std::function<void(A...)> call) {
    std::erase_if(all_, [](const auto& each) { return each.first.isNull(); });
    all_.emplace_back(owner, std::move(call));
  }
  /// Listeners that are added meanwhile are called the next time.
  void operator()(A... arguments) const {
    const auto now = all_;
    for (const auto& [owner, call] : now)
      if (owner) call(arguments...);
  }

 private:
  std::vector<std::pair<QPointer<QObject>, std::function<void(A...)>>> all_;
};

}  // namespace robomosp::viewer
