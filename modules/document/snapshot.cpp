// SPDX-License-Identifier: Apache-2.0
#include "document/each_record.h"
#include "document/state.h"

#include <algorithm>

#include "document/digest.h"
#include "document/graph.h"
#include "kernel/text.h"

namespace robomosp::document {

namespace {

std::uint64_t name_hash(std::string_view s) {  // FNV-1a, 64 bits
  std::uint64_t h = 14695981039346656037ULL;
  for (const char c : s) h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return h ^ (h >> 32);
}

}  // namespace

const Snapshot::State::Slot* Snapshot::State::slot(std::uint64_t number) const {
  const std::uint64_t c = number / kChunk, p = c / kPage;
  if (p >= pages.size() || !pages[static_cast<std::size_t>(p)]) return nullptr;
  const auto& chunk =
      pages[static_cast<std::size_t>(p)]->chunks[static_cast<std::size_t>(c % kPage)];
  return chunk ? &chunk->slots[static_cast<std::size_t>(number % kChunk)] : nullptr;
}

const RecordPtr* Snapshot::State::find(AnyId id) const {
  const Slot* s = slot(id.number);
  return s && s->record && s->record->kind() == id.kind ? &s->record : nullptr;
}

std::optional<AnyId> Snapshot::State::find(Kind kind, std::string_view name) const {
  const auto k = static_cast<std::size_t>(kind);
  if (k >= names.size() || !names[k]) return std::nullopt;
  const auto& table = names[k];
  const std::uint64_t hash = name_hash(name);
  const auto& bucket = table->buckets[hash % kBuckets];
  if (!bucket) return std::nullopt;
  for (const Name& n : *bucket) {
    if (n.hash != hash) continue;
    const AnyId id{kind, n.number};
    if (const RecordPtr* r = find(id); r && (*r)->name == name) return id;
  }
  return std::nullopt;
}

Snapshot::State::Slot& Snapshot::State::slot_for_change(std::uint64_t number) {
  const auto c = static_cast<std::size_t>(number / kChunk), p = c / kPage;
  if (p >= pages.size()) pages.resize(p + 1);
  return unique(unique(pages[p]).chunks[c % kPage])
      .slots[static_cast<std::size_t>(number % kChunk)];
}

void Snapshot::State::add_name(AnyId id, std::string_view name) {
  const std::uint64_t hash = name_hash(name);
  const auto k = static_cast<std::size_t>(id.kind);
  if (k >= names.size()) names.resize(k + 1);
  unique(unique(names[k]).buckets[hash % kBuckets]).push_back({hash, id.number});
}

void Snapshot::State::remove_name(AnyId id, std::string_view name) {
  const std::uint64_t hash = name_hash(name);
  auto& bucket = unique(unique(names[static_cast<std::size_t>(id.kind)]).buckets[hash % kBuckets]);
  std::erase_if(bucket, [&](const Name& n) { return n.number == id.number; });
}

void Snapshot::State::note_use_of_worlds(AnyId id, bool was, bool is) {
  if (was == is) return;
  auto& ids = unique(users_of_worlds);
  const auto at = std::lower_bound(ids.begin(), ids.end(), id);
  if (is) ids.insert(at, id);
  else ids.erase(at);
  if (ids.empty()) users_of_worlds.reset();
}

void Snapshot::State::put(AnyId id, RecordPtr record) {
  Slot& own = slot_for_change(id.number);
  const RecordPtr old = own.record;
  if (!old || !record || old->name != record->name) {
    if (old) remove_name(id, old->name);
    if (record) add_name(id, record->name);
  }
  count = count + (record ? 1U : 0U) - (old ? 1U : 0U);
  note_use_of_worlds(id, old && model::mentions_worlds(old->body),
                     record && model::mentions_worlds(record->body));
  // Of what the two share nothing comes or goes.
  const bool is_edit = old && record;
  const auto before =
      old ? references(old->body, is_edit ? &record->body : nullptr) : std::vector<AnyId>{};
  const auto after =
      record ? references(record->body, is_edit ? &old->body : nullptr) : std::vector<AnyId>{};
  own.record = std::move(record);
  own.names = nullptr;
  if (own.record && own.record->kind() == Kind::world) {
    own.names = std::make_shared<WorldNames>();
    own.names->record = own.record;
  }

  std::vector<AnyId> gone, come;
  std::set_difference(before.begin(), before.end(), after.begin(), after.end(),
                      std::back_inserter(gone));
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(),
                      std::back_inserter(come));
  const auto all = is_edit && !gone.empty() ? references(own.record->body) : std::vector<AnyId>{};
  for (const AnyId target : gone) {
    if (!slot(target.number)) continue;
    if (std::binary_search(all.begin(), all.end(), target)) continue;  // elsewhere in the record
    auto& list = slot_for_change(target.number).referrers;
    if (!list) continue;
    auto& ids = unique(list);
    std::erase(ids, id);
    if (ids.empty()) list.reset();
  }
  for (const AnyId target : come) {
    if (!find(target)) continue;  // dangling: the commit will refuse it
    auto& ids = unique(slot_for_change(target.number).referrers);
    const auto at = std::lower_bound(ids.begin(), ids.end(), id);
    if (at == ids.end() || *at != id) ids.insert(at, id);
  }
}

void Snapshot::State::relink(const std::vector<AnyId>& ids) {
  for (const AnyId id : ids) {
    const RecordPtr* record = find(id);
    if (!record) continue;
    for (const AnyId target : references((*record)->body)) {
      if (!find(target)) continue;
      auto& list = slot_for_change(target.number).referrers;
      if (list && std::binary_search(list->begin(), list->end(), id)) continue;
      auto& known = unique(list);
      known.insert(std::lower_bound(known.begin(), known.end(), id), id);
    }
  }
}

bool Snapshot::State::refers(AnyId from, AnyId to) const {
  const Slot* s = find(to) ? slot(to.number) : nullptr;
  return s && s->referrers && std::binary_search(s->referrers->begin(), s->referrers->end(), from);
}

std::vector<AnyId> Snapshot::State::dangling(AnyId id) const {
  const Slot* s = slot(id.number);
  if (!s || !s->referrers || s->record) return {};
  return *s->referrers;
}

Snapshot::Snapshot() : state_(std::make_shared<State>()) {}
Snapshot::~Snapshot() = default;

std::uint64_t Snapshot::revision() const { return state_->revision; }
std::size_t Snapshot::size() const { return state_->count; }

const Record* Snapshot::find(AnyId id) const {
  if (reads_) reads_->record(id);
  const RecordPtr* r = state_->find(id);
  return r ? r->get() : nullptr;
}

RecordPtr Snapshot::share(AnyId id) const {
  if (reads_) reads_->record(id);
  const RecordPtr* r = state_->find(id);
  return r ? *r : nullptr;
}

std::optional<AnyId> Snapshot::find(Kind kind, std::string_view name) const {
  if (reads_) reads_->name(kind, name);
  return state_->find(kind, name);
}

template <class See>
void Snapshot::State::each(std::uint32_t kinds, const See& see) const {
  for (std::size_t p = 0; p < pages.size(); ++p)
    for (std::size_t c = 0; pages[p] && c < kPage; ++c)
      for (std::size_t i = 0; pages[p]->chunks[c] && i < kChunk; ++i) {
        const auto& r = pages[p]->chunks[c]->slots[i].record;
        if (!r || (kinds & bit(r->kind())) == 0) continue;
        if (!see(AnyId{r->kind(), (p * kPage + c) * kChunk + i}, *r)) return;
      }
}

std::vector<AnyId> Snapshot::State::list(std::uint32_t kinds) const {
  std::vector<AnyId> ids;
  each(kinds, [&ids](AnyId id, const Record&) {
    ids.push_back(id);
    return true;
  });
  return ids;
}

void Snapshot::State::visit(const Snapshot& snapshot, std::uint32_t kinds,
                            const std::function<bool(AnyId, const Record&)>& see) {
  if (snapshot.reads_) snapshot.reads_->list(kinds);
  of(snapshot).each(kinds, [&](AnyId id, const Record& r) {
    if (snapshot.reads_) snapshot.reads_->record(id);
    return see(id, r);
  });
}

void each_record(const Snapshot& snapshot, std::span<const Kind> kinds,
                 const std::function<bool(AnyId, const Record&)>& see) {
  visit_records(snapshot, kinds, see);
}

std::vector<AnyId> Snapshot::list() const {
  if (reads_) reads_->list(Reads::kAllLists);
  return state_->list(Reads::kAllLists);
}

std::vector<AnyId> Snapshot::list(Kind kind) const {
  if (reads_) reads_->list(State::bit(kind));
  return state_->list(State::bit(kind));
}

std::vector<AnyId> Snapshot::referrers(AnyId id) const {
  if (reads_) reads_->referrers_of(id);
  if (!find(id)) return {};
  const State::Slot* s = state_->slot(id.number);
  return s->referrers ? *s->referrers : std::vector<AnyId>{};
}

std::vector<AnyId> Snapshot::users_of_worlds() const {
  if (reads_) reads_->users_of_worlds();
  return state_->users_of_worlds ? *state_->users_of_worlds : std::vector<AnyId>{};
}

model::WorldParameters Snapshot::world_parameters() const {
  return [this](const Expression::Name& n) -> std::optional<Quantity> {
    const auto id = find(Kind::world, n.scope);
    if (!id) return std::nullopt;
    const auto& world = std::get<model::World>(find(*id)->body);
    const model::Parameter* p = model::find_parameter(world.parametric, n.name);
    return p ? std::optional(model::quantity_of(*p)) : std::nullopt;
  };
}

void Snapshot::Reads::record(AnyId id) {
  const std::lock_guard lock(mutex_);
  const auto n = static_cast<std::size_t>(id.number);
  if (n >= is_known_.size()) {
    constexpr std::size_t kMostNumbers = std::size_t{1} << 26;  // what nobody has is not kept apart
    if (n > kMostNumbers) return;
    is_known_.resize(n + 1);
  }
  if (is_known_[n]) return;
  is_known_[n] = true;
  records_.push_back(id);
}
void Snapshot::Reads::name(Kind kind, std::string_view name) {
  const std::lock_guard lock(mutex_);
  names_.emplace(kind, name);
}
void Snapshot::Reads::referrers_of(AnyId id) {
  const std::lock_guard lock(mutex_);
  referrers_.push_back(id);
}
void Snapshot::Reads::list(std::uint32_t kinds) {
  const std::lock_guard lock(mutex_);
  lists_ |= kinds;
}
void Snapshot::Reads::users_of_worlds() {
  const std::lock_guard lock(mutex_);
  users_of_worlds_ = true;
}

void Snapshot::Reads::join(const Reads& more) {
  if (&more == this) return;
  const std::scoped_lock lock(mutex_, more.mutex_);
  if (is_known_.size() < more.is_known_.size()) is_known_.resize(more.is_known_.size());
  for (const AnyId id : more.records_) {
    const auto n = static_cast<std::size_t>(id.number);
    if (is_known_[n]) continue;
    is_known_[n] = true;
    records_.push_back(id);
  }
  referrers_.insert(referrers_.end(), more.referrers_.begin(), more.referrers_.end());
  std::sort(referrers_.begin(), referrers_.end());
  referrers_.erase(std::unique(referrers_.begin(), referrers_.end()), referrers_.end());
  names_.insert(more.names_.begin(), more.names_.end());
  lists_ |= more.lists_;
  users_of_worlds_ = users_of_worlds_ || more.users_of_worlds_;
}

std::optional<Snapshot::Reads::Difference> Snapshot::Reads::difference(const State& before,
                                                                       const State& now) const {
  const auto called = [](const State& s, AnyId id) {
    const RecordPtr* r = s.find(id);
    return std::string(to_string(id.kind)) + " " +
           (r ? text::quote((*r)->name) : "#" + std::to_string(id.number));
  };
  const std::lock_guard lock(mutex_);
  for (const AnyId id : records_) {
    // A number belongs to one record for ever, whatever kind was asked for.
    const State::Slot *was = before.slot(id.number), *is = now.slot(id.number);
    const RecordPtr none;
    const RecordPtr &a = was ? was->record : none, &b = is ? is->record : none;
    if (a == b || (a && b && same_content(*a, *b))) continue;
    const AnyId own{a ? a->kind() : b->kind(), id.number};
    return Difference{
        called(a ? before : now, own) + (a ? b ? " was changed" : " was removed" : " was added"),
        own};
  }
  for (const auto& [kind, name] : names_) {
    const auto was = before.find(kind, name), is = now.find(kind, name);
    if (was != is)
      return Difference{std::string(to_string(kind)) + " " + text::quote(name) +
                            (was ? " was removed or renamed" : " was added"),
                        is ? *is : *was};
  }
  for (const AnyId id : referrers_) {
    const auto of = [&](const State& s) {
      const State::Slot* slot = s.slot(id.number);
      return slot && slot->referrers ? *slot->referrers : std::vector<AnyId>{};
    };
    if (of(before) != of(now))
      return Difference{"what refers to " + called(before, id) + " was changed", {}};
  }
  if (lists_ != 0 && before.list(lists_) != now.list(lists_))
    return Difference{"records were added or removed", {}};
  const auto users = [](const State& s) {
    return s.users_of_worlds ? *s.users_of_worlds : std::vector<AnyId>{};
  };
  if (users_of_worlds_ && users(before) != users(now))
    return Difference{"the use of world parameters was changed", {}};
  return std::nullopt;
}

std::string Snapshot::describe(AnyId id) const {
  const std::string kind(to_string(id.kind));
  if (const Record* r = find(id)) return kind + " " + text::quote(r->name);
  return kind + " #" + std::to_string(id.number) + " (deleted)";
}

}  // namespace robomosp::document
