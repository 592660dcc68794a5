// SPDX-License-Identifier: Apache-2.0
// The sessions that an application knows, and what ends with them.
#include <algorithm>

#include "ioci/core/application.h"
#include "kernel/fault.h"
#include "kernel/permit.h"
#include "kernel/text.h"

namespace robomosp::ioci {

Result<void> Application::own_gesture(Session& session, std::uint64_t gesture) {
  const std::uint64_t own = author(session).session;
  const auto open = document.gestures();
  if (std::none_of(open.begin(), open.end(),
                   [&](const auto& g) { return g.first == gesture && g.second.session == own; }))
    return error(ErrorCode::unknown_name,
                 "there is no open gesture " + std::to_string(gesture) + " of session " +
                     text::quote(session.name()),
                 "Open one with gesture.begin.");
  return {};
}

document::Author Application::author(Session& session) {
  const AppLock::Hold hold(lock, "author");
  if (session.number_ == 0) {
    session.alive_ = told_end(session, next_session_);
    if (sessions_.size() >= most_sessions_) forget_closed_sessions();
    session.number_ = next_session_++;
    sessions_.emplace_hint(
        sessions_.end(), session.number_,
        KnownSession{{session.number_, session.name(), session.kind(), true}, session.alive_, {}});
  }
  return {session.number_, session.name()};
}

std::shared_ptr<const int> Application::told_end(const Session& session, std::uint64_t number) {
  const auto tell = [this, name = session.name(), kind = session.kind(), number](const char* what) {
    events.publish(Topic::session, {what, Map{{"session", name},
                                              {"session_number", static_cast<std::int64_t>(number)},
                                              {"kind", to_string(kind)}}});
  };
  lock.later([tell] { tell("opened"); });
  return {new int(0), [tell, is_there = std::weak_ptr<Jobs>(shared_jobs_)](const int* flag) {
            delete flag;
            if (const auto held = is_there.lock()) tell("closed");
          }};
}

void Application::forget_closed_sessions() {
  constexpr std::size_t kKept = 1000;
  std::vector<std::uint64_t> closed;
  for (const auto& [number, s] : sessions_)
    if (s.alive.expired()) closed.push_back(number);
  end_orphaned_subscriptions();
  for (std::size_t i = 0; i + kKept < closed.size(); ++i) sessions_.erase(closed[i]);
  most_sessions_ = 2 * sessions_.size() + kKept;
}

void Application::keep_subscription(Session& session, std::uint64_t token) {
  const AppLock::Hold hold(lock, "keep_subscription");
  end_orphaned_subscriptions();
  const std::uint64_t number = author(session).session;
  sessions_[number].subscriptions.push_back(token);
  subscribed_.insert(number);
}

bool Application::has_subscription(Session& session, std::uint64_t token) {
  const AppLock::Hold hold(lock, "has_subscription");
  const auto& own = sessions_[author(session).session].subscriptions;
  return std::find(own.begin(), own.end(), token) != own.end();
}

void Application::end_subscription(Session& session, std::uint64_t token) {
  const AppLock::Hold hold(lock, "end_subscription");
  std::erase(sessions_[author(session).session].subscriptions, token);
  events.unsubscribe(token);
}

void Application::end_orphaned_subscriptions() {
  for (auto it = subscribed_.begin(); it != subscribed_.end();) {
    KnownSession& s = sessions_[*it];
    if (!s.alive.expired()) {
      ++it;
      continue;
    }
    for (const std::uint64_t token : s.subscriptions) events.unsubscribe(token);
    s.subscriptions.clear();
    it = subscribed_.erase(it);
  }
}

std::vector<Application::SessionInfo> Application::sessions() const {
  std::vector<SessionInfo> out;
  const AppLock::Hold hold(lock, "sessions");
  for (const auto& [number, s] : sessions_) {
    out.push_back(s.info);
    out.back().is_open = !s.alive.expired();
  }
  return out;
}

void Application::end_orphaned_gestures() {
  const AppLock::Hold hold(lock, "end_orphaned_gestures");
  for (const auto& [number, who] : document.gestures()) {
    const auto at = sessions_.find(who.session);
    if (who.session > 0 && (at == sessions_.end() || at->second.alive.expired())) {
      const PermitScope own(nullptr);
      if (const auto ended = document.cancel_gesture(number); !ended.ok())
        messages.post(Severity::error, "gesture", ended.error().sentence(), "ioci");
    }
  }
}

}  // namespace robomosp::ioci
