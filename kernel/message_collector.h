// SPDX-License-Identifier: Apache-2.0
// The messages that a thread posts while it runs a command (layer: core).
#pragma once

#include <vector>

#include "kernel/messages.h"

namespace robomosp {

/// Keeps a copy of each message that this thread posts while the collector lives. Within another
/// collector of the thread only the inner one receives them. [one thread]
class MessageCollector {
 public:
  MessageCollector();
  ~MessageCollector();
  MessageCollector(const MessageCollector&) = delete;
  MessageCollector& operator=(const MessageCollector&) = delete;
  [[nodiscard]] const std::vector<Message>& messages() const { return messages_; }

  /// Gives a message to this thread's collector, if it has one.
  static void collect(const Message& message);

 private:
  static constexpr std::size_t kMost = 100;  ///< later ones are left out
  MessageCollector* outer_;
  std::vector<Message> messages_;
};

}  // namespace robomosp
