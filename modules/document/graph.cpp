// SPDX-License-Identifier: Apache-2.0
#include "document/graph.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <utility>

#include "document/changed.h"
#include "document/validate.h"
#include "kernel/fault.h"
#include "kernel/text.h"
#include "model/data.h"

namespace robomosp::document {

namespace {

using text::quote;

/// `cycle`: records each of which refers to the next, the last to the first.
Error cycle_error(const Snapshot& s, std::vector<AnyId> cycle, const std::vector<AnyId>& changed) {
  if (cycle.size() == 1)
    return error(ErrorCode::conflict, s.describe(cycle[0]) + " cannot refer to itself");
  // Told from the record that was changed last: it is the one that got the reference.
  for (auto it = changed.rbegin(); it != changed.rend(); ++it) {
    const auto at = std::find(cycle.begin(), cycle.end(), *it);
    if (at == cycle.end()) continue;
    std::rotate(cycle.begin(), at + 1, cycle.end());
    break;
  }
  std::string path;
  for (const AnyId id : cycle) path += (path.empty() ? "" : " > ") + s.find(id)->name;
  return error(ErrorCode::conflict,
               s.describe(cycle.back()) + " cannot refer to " + s.describe(cycle.front()) +
                   ", which refers to it in turn (" + path + ")",
               "Remove one of these references first.");
}

/// What a changed record refers to and did not before.
std::vector<AnyId> new_references(AnyId id, const Record& now, const Before& before) {
  const Record* old = before.record(id);
  std::vector<AnyId> come = references(now.body, old ? &old->body : nullptr);
  if (old) std::erase_if(come, [&](AnyId to) { return before.refers(id, to); });
  return come;
}

/// `kinds`: empty = any.
bool allows(std::span<const Kind> kinds, Kind kind) {
  return kinds.empty() || std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

/// Extends `path`, that of `p` of the field `field`, to "robots[2].robot", a reference that is
/// refused; false = there is none within `p`. It nests as deep as types do.
bool lead_to_bad_reference(const Snapshot& s, const model::Type& t, const void* p,
                           const model::Field* field, std::string& path) {
  using model::Shape;
  if (!t.has_references) return false;
  const std::size_t length = path.size();
  const auto within = [&](const model::Type& inner, const void* at, const model::Field* of,
                          const std::string& word) {
    path += word;
    if (lead_to_bad_reference(s, inner, at, of, path)) return true;
    path.resize(length);
    return false;
  };
  switch (t.shape) {
    case Shape::reference: {
      const AnyId id = t.id(p);
      return id && (!s.find(id) || !allows(model::kinds_of(*field, t), id.kind));
    }
    case Shape::structure:
      return std::any_of(t.fields.begin(), t.fields.end(), [&](const model::Field& f) {
        return within(*f.type, f.in(p), &f, (length ? "." : "") + std::string(f.name));
      });
    case Shape::list:
      for (std::size_t i = 0; i < t.length(p); ++i)
        if (within(*t.element, t.at(p, i), field, "[" + std::to_string(i + 1) + "]")) return true;
      return false;
    case Shape::optional: {
      const void* inner = t.held(p);
      return inner && within(*t.element, inner, field, "");
    }
    default: return false;
  }
}

}  // namespace

std::vector<AnyId> references(const model::Body& body, const model::Body* before) {
  std::vector<AnyId> ids;
  model::for_each_held_reference(
      model::content(body),
      [&ids](const model::HeldReference& r) {
        if (ids.empty() || ids.back() != r.id) ids.push_back(r.id);
      },
      before ? model::content(*before) : model::Content{});
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

Result<void> check_references(const Snapshot& s, const Record& record, const Record* before) {
  std::optional<Error> fault;
  const auto look = [&](const model::HeldReference& r) {
    if (fault) return;
    const bool is_allowed = allows(r.kinds, r.id.kind);
    if (!s.find(r.id)) {
      fault = error(ErrorCode::stale_handle,
                    quote(r.where) + " refers to " + std::string(to_string(r.id.kind)) + " #" +
                        std::to_string(r.id.number) + ", which does not exist");
    } else if (!is_allowed) {
      std::string kinds;
      for (const Kind k : r.kinds)
        kinds += (kinds.empty() ? "" : " or ") + with_article(to_string(k));
      fault = error(ErrorCode::invalid_argument, quote(r.where) + " refers to " + s.describe(r.id),
                    "Only " + kinds + " can be there.");
    }
  };
  model::for_each_held_reference(model::content(record.body), look,
                                 before ? model::content(before->body) : model::Content{});
  if (!fault) return {};
  amend(*fault, [&](Fault& f) {
    const model::Content all = model::content(record.body);
    lead_to_bad_reference(s, *all.type, all.data, nullptr, f.subject.path);
  });
  return std::move(*fault).in(std::string(to_string(record.kind())) + " " + quote(record.name));
}

Result<void> refuse_cycles(const Snapshot& s, const Before& before,
                           const std::vector<AnyId>& changed) {
  struct Visit {
    AnyId id;
    std::vector<AnyId> inner;
    std::size_t next = 0;
  };
  std::unordered_set<AnyId> done, open;  // done: all that it reaches was seen
  for (const AnyId start : changed) {
    const Record* record = s.find(start);
    if (!record || done.contains(start)) continue;
    std::vector<AnyId> come = new_references(start, *record, before);
    if (come.empty()) continue;
    std::vector<Visit> path;
    path.push_back({start, std::move(come)});
    open.insert(start);
    while (!path.empty()) {
      Visit& top = path.back();
      if (top.next == top.inner.size()) {
        open.erase(top.id);
        if (path.size() > 1) done.insert(top.id);  // of the first only what is new was followed
        path.pop_back();
        continue;
      }
      const AnyId inner = top.inner[top.next++];
      if (open.contains(inner)) {
        std::vector<AnyId> cycle;
        for (auto it = path.rbegin(); it != path.rend(); ++it) {
          cycle.insert(cycle.begin(), it->id);
          if (it->id == inner) break;
        }
        return cycle_error(s, std::move(cycle), changed);
      }
      if (done.contains(inner)) continue;
      open.insert(inner);
      path.push_back({inner, references(s.find(inner)->body)});
    }
  }
  return {};
}

std::vector<AnyId> affected_order(const Snapshot& s, const std::vector<AnyId>& changed) {
  std::vector<AnyId> starts = dependents(s, changed);
  std::sort(starts.begin(), starts.end());
  starts.erase(std::unique(starts.begin(), starts.end()), starts.end());

  std::vector<AnyId> order;
  order.reserve(starts.size());
  for (const AnyId id : starts)
    if (!s.find(id)) order.push_back(id);
  // Post-order over what each refers to, with an explicit stack; of a single record there is none.
  if (starts.size() == 1) return starts;
  const std::unordered_set<AnyId> all(starts.begin(), starts.end());
  std::unordered_set<AnyId> placed(order.begin(), order.end());
  for (const AnyId start : starts) {
    std::vector<std::pair<AnyId, bool>> stack{{start, false}};
    while (!stack.empty()) {
      const auto [id, is_ready] = stack.back();
      stack.pop_back();
      if (placed.contains(id)) continue;
      if (is_ready) {
        placed.insert(id);
        order.push_back(id);
        continue;
      }
      stack.emplace_back(id, true);
      const std::vector<AnyId> inner = references(s.find(id)->body);
      for (auto it = inner.rbegin(); it != inner.rend(); ++it)
        if (all.contains(*it) && !placed.contains(*it)) stack.emplace_back(*it, false);
    }
  }
  return order;
}

}  // namespace robomosp::document
