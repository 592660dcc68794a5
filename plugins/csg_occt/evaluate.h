// SPDX-License-Identifier: Apache-2.0
// Evaluates a Plan term by term with a bounded cache of finished terms, so that an edit recomputes
// only the terms above it (layer: plugin).
#pragma once

#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "boolean.h"
#include "topology_gate.h"
#include "tree_plan.h"

namespace robomosp::csg_occt {

/// A remark about an item, located by the path from the term to it, because names are not content.
struct Note {
  std::vector<std::uint32_t> path;  ///< item numbers from the term downwards
  std::string text;
};

/// A finished term in its own frame [mm]. Immutable.
struct Value {
  std::vector<Solid> solids;
  std::vector<Note> notes;
  Lineage lineage;
};
using ValuePtr = std::shared_ptr<const Value>;

/// Least recently used terms are dropped beyond the limit. [any thread]
class TermCache {
 public:
  explicit TermCache(std::size_t limit) : limit_(limit) {}
  ValuePtr find(const Key& key);
  void put(const Key& key, ValuePtr value);
  /// Returns the item keys of the last evaluation of an operation on the same first item, and
  /// replaces them by `now`.
  std::vector<Key> exchange_recent(const Key& context, std::vector<Key> now);

 private:
  struct Entry {
    Key key;
    ValuePtr value;
  };
  std::mutex mutex_;
  std::size_t limit_;
  std::list<Entry> entries_;  // most recent first
  std::unordered_map<Key, std::list<Entry>::iterator, KeyHash> index_;
  std::unordered_map<Key, std::vector<Key>, KeyHash> recent_;
};

/// When to use the shortcut for prisms (prismatic.h). `only` is for tests: a tree that it does not
/// apply to is an error, and its results are checked like those of the general method.
enum class Shortcut { on, off, only };

/// The value of the plan's root term. Errors name the node of `tree`.
Result<ValuePtr> evaluate_plan(const Plan& plan, const CsgTree& tree, TermCache& cache,
                               FaceMemory& faces, TopologyGate& gate, Shortcut shortcut,
                               Progress& progress);

}  // namespace robomosp::csg_occt
