// SPDX-License-Identifier: Apache-2.0
#include "document/state.h"

#include <algorithm>

#include "kernel/text.h"

namespace robomosp::document {

namespace {

std::uint64_t name_hash(std::string_view s) {  // FNV-1a, 64 bits
  std::uint64_t h = 14695981039346656037ULL;
  for (const char c : s) h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return h ^ (h >> 32);
}

}  // namespace

std::vector<AnyId> references(const model::Body& body) {
  std::vector<AnyId> ids;
  model::for_each_reference(body, [&ids](AnyId id, std::string_view) { ids.push_back(id); });
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

const Snapshot::State::Slot* Snapshot::State::slot(std::uint64_t number) const {
  const std::uint64_t c = number / kChunk;
  if (c >= chunks.size() || !chunks[static_cast<std::size_t>(c)]) return nullptr;
  return &chunks[static_cast<std::size_t>(c)]->slots[static_cast<std::size_t>(number % kChunk)];
}

const RecordPtr* Snapshot::State::find(AnyId id) const {
  const Slot* s = slot(id.number);
  return s && s->record && s->record->kind() == id.kind ? &s->record : nullptr;
}

std::optional<AnyId> Snapshot::State::find(Kind kind, std::string_view name) const {
  const auto& table = names[static_cast<std::size_t>(kind)];
  if (!table) return std::nullopt;
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
  const auto c = static_cast<std::size_t>(number / kChunk);
  if (c >= chunks.size()) chunks.resize(c + 1);
  return unique(chunks[c]).slots[static_cast<std::size_t>(number % kChunk)];
}

void Snapshot::State::add_name(AnyId id, std::string_view name) {
  const std::uint64_t hash = name_hash(name);
  unique(unique(names[static_cast<std::size_t>(id.kind)]).buckets[hash % kBuckets])
      .push_back({hash, id.number});
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
  note_use_of_worlds(id, old && !model::world_mentions(old->body).empty(),
                     record && !model::world_mentions(record->body).empty());
  const auto before = old ? references(old->body) : std::vector<AnyId>{};
  const auto after = record ? references(record->body) : std::vector<AnyId>{};
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
  for (const AnyId target : gone) {
    if (!slot(target.number)) continue;
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

Snapshot::Snapshot() : state_(std::make_shared<State>()) {}
Snapshot::~Snapshot() = default;

std::uint64_t Snapshot::revision() const { return state_->revision; }
std::size_t Snapshot::size() const { return state_->count; }

const Record* Snapshot::find(AnyId id) const {
  const RecordPtr* r = state_->find(id);
  return r ? r->get() : nullptr;
}

RecordPtr Snapshot::share(AnyId id) const {
  const RecordPtr* r = state_->find(id);
  return r ? *r : nullptr;
}

std::optional<AnyId> Snapshot::find(Kind kind, std::string_view name) const {
  return state_->find(kind, name);
}

std::vector<AnyId> Snapshot::list() const {
  std::vector<AnyId> ids;
  ids.reserve(state_->count);
  std::uint64_t number = 0;
  for (const auto& chunk : state_->chunks) {
    if (chunk)
      for (std::size_t i = 0; i < State::kChunk; ++i)
        if (const auto& r = chunk->slots[i].record) ids.push_back({r->kind(), number + i});
    number += State::kChunk;
  }
  return ids;
}

std::vector<AnyId> Snapshot::list(Kind kind) const {
  std::vector<AnyId> ids = list();
  std::erase_if(ids, [kind](AnyId id) { return id.kind != kind; });
  return ids;
}

std::vector<AnyId> Snapshot::referrers(AnyId id) const {
  if (!find(id)) return {};
  const State::Slot* s = state_->slot(id.number);
  return s->referrers ? *s->referrers : std::vector<AnyId>{};
}

std::vector<AnyId> Snapshot::users_of_worlds() const {
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

std::string Snapshot::describe(AnyId id) const {
  const std::string kind(to_string(id.kind));
  if (const Record* r = find(id)) return kind + " " + text::quote(r->name);
  return kind + " #" + std::to_string(id.number) + " (deleted)";
}

}  // namespace robomosp::document
