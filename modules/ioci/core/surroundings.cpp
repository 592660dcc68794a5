// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/surroundings.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "io/recovery_journal.h"
#include "ioci/core/application.h"
#include "ioci/core/modules.h"
#include "kernel/executor.h"
#include "kernel/permit.h"
#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

constexpr std::chrono::seconds kMemoryEvery{1};
/// Edits that come within this time, such as those of a drag, are compared together.
constexpr std::chrono::milliseconds kGather{50};
constexpr double kLow = 0.1, kCritical = 0.05, kAgain = 1.5;

std::string content_of(const char* file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::optional<std::uint64_t> number_in(std::string_view s) {
  s = text::trim(s);
  const auto n = text::read_int(s.substr(0, s.find_first_of(" \t\n")));
  return n && *n >= 0 ? std::optional(static_cast<std::uint64_t>(*n)) : std::nullopt;
}

/// Of a line such as "MemTotal:       16316412 kB". [bytes]
std::optional<std::uint64_t> field_of(std::string_view meminfo, std::string_view name) {
  const auto at = meminfo.find(name);
  if (at == std::string_view::npos) return std::nullopt;
  const auto kib = number_in(meminfo.substr(at + name.size()));
  return kib ? std::optional(*kib << 10) : std::nullopt;
}

List handles_of(const std::vector<AnyId>& ids) {
  List out;
  for (const AnyId id : ids) out.emplace_back(Application::handle(id));
  return out;
}

}  // namespace

std::optional<MemoryState> parse_memory(std::string_view meminfo, std::string_view statm,
                                        std::uint64_t page_bytes, std::string_view group_limit,
                                        std::string_view group_used) {
  const auto total = field_of(meminfo, "MemTotal:"), available = field_of(meminfo, "MemAvailable:");
  if (!total || !available || *total == 0) return std::nullopt;
  MemoryState out{*total, std::min(*available, *total), 0};
  const auto blank = statm.find(' ');
  if (blank != std::string_view::npos)
    if (const auto pages = number_in(statm.substr(blank))) out.used = *pages * page_bytes;
  const auto limit = number_in(group_limit), used = number_in(group_used);
  if (limit && used && *limit > 0 && *limit < out.total) {
    out.total = *limit;
    out.available = std::min(out.available, *limit - std::min(*used, *limit));
  }
  return out;
}

std::optional<MemoryState> read_memory() {
  const long page = ::sysconf(_SC_PAGESIZE);
  return parse_memory(content_of("/proc/meminfo"), content_of("/proc/self/statm"),
                      page > 0 ? static_cast<std::uint64_t>(page) : 4096,
                      content_of("/sys/fs/cgroup/memory.max"),
                      content_of("/sys/fs/cgroup/memory.current"));
}

std::string_view to_string(MemoryLevel level) {
  switch (level) {
    case MemoryLevel::fine: return "fine";
    case MemoryLevel::low: return "low";
    case MemoryLevel::critical: return "critical";
  }
  return "fine";
}

MemoryLevel level_of(const MemoryState& state, MemoryLevel before) {
  if (state.total == 0) return before;
  const double part = static_cast<double>(state.available) / static_cast<double>(state.total);
  if (part < kCritical) return MemoryLevel::critical;
  if (part < kLow)
    return before == MemoryLevel::critical && part < kAgain * kCritical ? MemoryLevel::critical
                                                                        : MemoryLevel::low;
  return before != MemoryLevel::fine && part < kAgain * kLow ? MemoryLevel::low : MemoryLevel::fine;
}

Surroundings::Surroundings(Application& app) : app_(app) {}

Surroundings::~Surroundings() {
  std::unique_lock lock(mutex_);
  is_ending_ = true;
  wake_.notify_all();
  wake_.wait(lock, [this] { return !is_comparing_; });
}

void Surroundings::prepare(std::uint32_t topics) {
  if (!(topics & bit(Topic::provider))) return;
  if (app_.events.topics() & bit(Topic::provider)) return look_at_providers();
  const std::lock_guard lock(mutex_);
  // What was known then is still true if nothing has been registered or chosen since.
  if (registry_revision_ != app_.registry.revision()) registry_revision_.reset();
}

void Surroundings::begin(std::uint32_t topics) {
  if (!(topics & bit(Topic::unsaved))) return look();
  {
    const std::lock_guard lock(mutex_);
    is_whole_ = true;  // others hear again what is not saved
  }
  committed({});
}

void Surroundings::look() {
  const std::uint32_t topics = app_.events.topics();
  if (topics & bit(Topic::provider)) look_at_providers();
  if (topics & bit(Topic::memory)) look_at_memory();
}

void Surroundings::look_at_providers() {
  const std::uint64_t revision = app_.registry.revision();
  std::vector<Notice> told;
  {
    const std::lock_guard lock(mutex_);
    if (registry_revision_ == revision) return;
    const bool is_first = !std::exchange(registry_revision_, revision).has_value();
    Providers now;
    for (const ProviderInfo& p : app_.registry.list())
      now[{p.interface_id, p.name}] = {p.enabled, p.origin};
    auto chosen = app_.registry.chosen();
    const auto note = [&](const char* what, const auto& key, const Provider& p) {
      told.push_back(
          {what, Map{{"interface", key.first}, {"name", key.second}, {"origin", p.origin}}});
    };
    for (const auto& [key, p] : providers_)
      if (!now.contains(key)) note("withdrawn", key, p);
    for (const auto& [key, p] : now) {
      const auto old = providers_.find(key);
      if (old == providers_.end()) note("registered", key, p);
      else if (old->second.enabled != p.enabled) note(p.enabled ? "enabled" : "disabled", key, p);
      else if (old->second != p) note("replaced", key, p);
    }
    const auto tell_default = [&](const std::string& interface, const Registry::Choice& c) {
      told.push_back({"default", Map{{"interface", interface}, {"name", c.name}, {"by", c.by}}});
    };
    for (const auto& [interface, c] : chosen_)
      if (!chosen.contains(interface)) tell_default(interface, {"", ""});
    for (const auto& [interface, c] : chosen) {
      const auto old = chosen_.find(interface);
      if (old == chosen_.end() || old->second.name != c.name || old->second.by != c.by)
        tell_default(interface, c);
    }
    providers_ = std::move(now);
    chosen_ = std::move(chosen);
    if (is_first) told.clear();  // what was there before anybody asked
  }
  for (Notice& n : told) app_.events.publish(Topic::provider, std::move(n));
}

void Surroundings::look_at_memory() {
  const auto now = std::chrono::steady_clock::now();
  {
    const std::lock_guard lock(mutex_);
    if (now < next_look_) return;
    next_look_ = now + kMemoryEvery;
  }
  const auto state = read_memory();
  if (!state) return;
  MemoryLevel level{};
  {
    const std::lock_guard lock(mutex_);
    level = level_of(*state, level_);
    if (level == std::exchange(level_, level)) return;
  }
  app_.events.publish(Topic::memory,
                      {std::string(to_string(level)),
                       Map{{"available", static_cast<std::int64_t>(state->available)},
                           {"total", static_cast<std::int64_t>(state->total)},
                           {"used", static_cast<std::int64_t>(state->used)}},
                       true});
}

void Surroundings::committed(const document::Commit& commit) {
  const std::uint32_t topics = app_.events.topics();
  look();
  if (topics & bit(Topic::setting))
    for (const document::RecordChange& c : commit.records)
      if (c.id.kind == settings_kind())
        app_.events.publish(Topic::setting,
                            {"document", Map{{"name", (c.after ? c.after : c.before)->name},
                                             {"session", commit.author.name},
                                             {"session_number",
                                              static_cast<std::int64_t>(commit.author.session)}}});
  {
    const std::lock_guard lock(mutex_);
    if (!(topics & bit(Topic::unsaved))) {
      is_whole_ = true;  // who begins to listen later hears of everything
      return;
    }
    if (!is_whole_) changed_.insert(commit.changed.begin(), commit.changed.end());
    if (is_ending_ || is_comparing_ || (!is_whole_ && changed_.empty())) return;
    is_comparing_ = true;
  }
  Executor::of_process().run([this] { compare(); });
}

void Surroundings::compare() {
  const PermitScope own(nullptr);
  std::unique_lock lock(mutex_);
  while (!is_ending_ && (is_whole_ || !changed_.empty())) {
    wake_.wait_for(lock, kGather, [this] { return is_ending_; });
    if (is_ending_) break;
    const bool is_whole = std::exchange(is_whole_, false);
    std::set<AnyId> changed = std::exchange(changed_, {});
    lock.unlock();
    const document::SnapshotPtr now = app_.document.now();
    std::set<AnyId> after = is_whole ? std::set<AnyId>() : unsaved_;
    if (is_whole) {
      for (const AnyId id : io::unsaved_records(*now, app_.library)) after.insert(id);
    } else {
      for (const AnyId id : changed)
        if (now->find(id) && io::is_unsaved(*now, id, app_.library)) after.insert(id);
        else after.erase(id);
    }
    std::vector<AnyId> became, saved;
    if (is_whole) became.assign(after.begin(), after.end());
    else
      std::set_difference(after.begin(), after.end(), unsaved_.begin(), unsaved_.end(),
                          std::back_inserter(became));
    std::set_difference(unsaved_.begin(), unsaved_.end(), after.begin(), after.end(),
                        std::back_inserter(saved));
    unsaved_ = std::move(after);
    if (!became.empty() || !saved.empty())
      app_.events.publish(
          Topic::unsaved,
          {"changed", Map{{"count", unsaved_.size()},
                          {"unsaved", handles_of(became)},
                          {"saved", handles_of(saved)},
                          {"revision", static_cast<std::int64_t>(now->revision())}}});
    lock.lock();
  }
  is_comparing_ = false;
  wake_.notify_all();
}

void tell_setting(Application& app, Session& session, std::string_view name, Value value) {
  if (!(app.events.topics() & bit(Topic::setting))) return;
  const document::Author who = app.author(session);
  app.events.publish(Topic::setting,
                     {"program", Map{{"name", name},
                                     {"value", std::move(value)},
                                     {"session", who.name},
                                     {"session_number", static_cast<std::int64_t>(who.session)}}});
}

}  // namespace robomosp::ioci
