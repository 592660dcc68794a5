// SPDX-License-Identifier: Apache-2.0
#include "kernel/messages.h"

#include <algorithm>

#include "kernel/fault.h"
#include "kernel/message_collector.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

thread_local MessageCollector* t_collector = nullptr;

}  // namespace

MessageCollector::MessageCollector() : outer_(t_collector) { t_collector = this; }
MessageCollector::~MessageCollector() { t_collector = outer_; }
void MessageCollector::collect(const Message& message) {
  if (t_collector && t_collector->messages_.size() < kMost)
    t_collector->messages_.push_back(message);
}

std::string_view to_string(Severity s) {
  switch (s) {
    case Severity::debug: return "debug";
    case Severity::info: return "info";
    case Severity::warning: return "warning";
    case Severity::error: return "error";
  }
  return "info";
}

void Messages::post(Severity severity, std::string_view code, std::string_view text,
                    std::string_view source) {
  post(Message{{}, severity, std::string(code), std::string(text), std::string(source)});
}

void Messages::post(const Fault& fault, std::string_view source) {
  post(Message{{},
               fault.severity,
               fault.code,
               sentence(fault),
               std::string(source),
               0,
               std::make_shared<const Fault>(fault)});
}

void Messages::post(Message&& message) {
  constexpr auto kWindow = std::chrono::seconds(1);
  message.time = std::chrono::system_clock::now();
  message.text = robomosp::text::shortened(std::move(message.text));
  std::vector<Subscriber> receivers;
  {
    const std::lock_guard lock(mutex_);
    const auto now = clock_ ? clock_() : std::chrono::steady_clock::now();
    std::string key = message.code + '\n' + message.text;
    const auto [entry, is_new] = seen_.try_emplace(std::move(key));
    Seen& seen = entry->second;
    if (seen.count == 0 || now - seen.since >= kWindow) {
      message.repeated = seen.suppressed;
      seen = {now, 1, 0};
    } else if (++seen.count > kRateLimit) {
      ++seen.suppressed;
      return;
    }
    // Gone through once for as many new ones, so that each costs the same however many there are.
    const std::size_t room = std::max<std::size_t>(capacity_, 16);
    if (is_new && seen_.size() >= 4 * room) seen_.clear();
    else if (is_new && seen_.size() % room == 0)
      std::erase_if(seen_, [&](const auto& old) { return now - old.second.since >= kWindow; });
    MessageCollector::collect(message);
    ring_.push_back(message);
    while (ring_.size() > capacity_) ring_.pop_front();
    for (const auto& [id, subscriber] : subscribers_) receivers.push_back(subscriber);
    // Within the lock, so that they hear of it in the order of the ring.
    if (!receivers.empty())
      lock_->later([message = std::move(message), receivers = std::move(receivers)] {
        for (const Subscriber& receive : receivers) {
          try {
            receive(message);
          } catch (...) {  // NOLINT: a listener's fault must not become the speaker's
          }
        }
      });
  }
  lock_->flush();
}

std::vector<Message> Messages::recent(std::size_t at_most) const {
  const std::lock_guard lock(mutex_);
  const std::size_t count = std::min(at_most, ring_.size());
  return {ring_.end() - static_cast<std::ptrdiff_t>(count), ring_.end()};
}

std::uint64_t Messages::subscribe(Subscriber subscriber) {
  const std::lock_guard lock(mutex_);
  subscribers_.emplace(next_, std::move(subscriber));
  return next_++;
}

void Messages::unsubscribe(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  subscribers_.erase(id);
}

}  // namespace robomosp
