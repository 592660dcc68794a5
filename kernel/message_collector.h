// SPDX-License-Identifier: Apache-2.0
// The messages that a thread posts while it runs a command (layer: core).
#pragma once

#include <vector>

#include "kernel/messages.h"

namespace robomosp {

/// Keeps a copy of each message that this thread posts during its lifetime. Of nested collectors,
/// only the innermost receives messages. [one thread]
class MessageCollector {
 public:
  MessageCollector();
  ~MessageCollector();
  MessageCollector(const MessageCollector&) = delete;
  MessageCollector& operator=(const MessageCollector&) = delete;
  [[nodiscard]] const std::vector<Message>& messages() const { return messages_; }

  /// Passes a message to this thread's collector, if it has one.
  static void collect(const Message& message);

 private:
  static constexpr std::size_t kMost = 100;  ///< later ones are dropped
  MessageCollector* outer_;
  std::vector<Message> messages_;
};

}  // namespace robomosp
