// SPDX-License-Identifier: Apache-2.0
#include "remote/connections.h"

#include <algorithm>
#include <chrono>
#include <string>

#include "ioci/core/commands.h"

namespace robomosp::remote {
namespace {

/// At a time, of all sessions.
constexpr std::size_t kMostConnections = 64;

}  // namespace

Result<std::int64_t> Connections::add(std::uint64_t session, std::unique_ptr<Client> client) {
  const auto entry = std::make_shared<Entry>(session);
  entry->client = std::move(client);
  const std::lock_guard lock(mutex_);
  entries_.emplace(next_, entry);
  return next_++;
}

Result<void> Connections::make_room() {
  const auto sessions = app_.sessions();
  const std::lock_guard lock(mutex_);
  std::erase_if(entries_, [&](const auto& e) {
    return std::none_of(sessions.begin(), sessions.end(),
                        [&](const auto& s) { return s.is_open && s.number == e.second->session; });
  });
  if (entries_.size() < kMostConnections) return {};
  return error(ErrorCode::conflict,
               std::to_string(entries_.size()) + " connections are already open",
               "Close one: connection.list() names them.");
}

std::shared_ptr<Connections::Entry> Connections::find(std::int64_t number,
                                                      std::uint64_t session) const {
  const std::lock_guard lock(mutex_);
  const auto it = entries_.find(number);
  return it == entries_.end() || it->second->session != session ? nullptr : it->second;
}

void Connections::remove(std::int64_t number) {
  const std::lock_guard lock(mutex_);
  entries_.erase(number);
}

std::vector<std::pair<std::int64_t, std::shared_ptr<Connections::Entry>>> Connections::of(
    std::uint64_t session) const {
  std::vector<std::pair<std::int64_t, std::shared_ptr<Entry>>> out;
  const std::lock_guard lock(mutex_);
  for (const auto& [number, entry] : entries_)
    if (entry->session == session) out.emplace_back(number, entry);
  return out;
}

Result<ConnectionUse> use_connection(ioci::CommandContext& ctx, const Map& args) {
  const std::int64_t number = ioci::integer(args, "connection");
  ConnectionUse u;
  u.entry = ctx.app.kept<Connections>().find(number, ctx.app.author(ctx.session).session);
  if (!u.entry)
    return error(ErrorCode::unknown_name,
                 "this session has no connection " + std::to_string(number),
                 "Create one with connection.open.", "connection");
  u.lock = std::unique_lock(u.entry->mutex, std::defer_lock);
  while (!u.lock.try_lock_for(std::chrono::milliseconds(50)))
    if (ctx.progress.cancelled())
      return error(ErrorCode::cancelled, "the call was interrupted before it started");
  return u;
}

}  // namespace robomosp::remote
