// SPDX-License-Identifier: Apache-2.0
// Records as data: what their declarations give without knowing any kind: fingerprint, memory,
// equality, differences, references (layer: data processing, model). [any thread]
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "kernel/fingerprint.h"
#include "model/records.h"

namespace robomosp::model {

/// A value and its type. The value must outlive it.
struct Content {
  const Type* type = nullptr;
  const void* data = nullptr;
};
struct MutableContent {
  const Type* type = nullptr;
  void* data = nullptr;
  operator Content() const { return {type, data}; }  // NOLINT: as T* becomes const T*
};
[[nodiscard]] Content content(const Body&);
[[nodiscard]] MutableContent content(Body&);
/// A default-constructed record of a kind.
[[nodiscard]] Body empty_body(Kind);

/// The name of an element of a list: its field "name", when that is a text; else null.
[[nodiscard]] const std::string* name_of(const Type&, const void* element);

/// Feeds one reference: by id, or by kind and name.
using FeedReference = std::function<void(Fingerprinter&, AnyId)>;
/// Feeds every field, in order of declaration.
void feed(Fingerprinter&, const Content&, const FeedReference&);

/// Bytes behind the value's own, about. What versions of a record share counts for none of them,
/// nor do blocks that it shares with `other`, another version (data null = none is looked at).
[[nodiscard]] std::size_t heap_bytes(const Content&, const Content& other = {});

/// Whether two values of one type have equal fingerprints: numbers by bits, but -0 is 0 and there
/// is one NaN.
[[nodiscard]] bool equal(const Content&, const Content&);
[[nodiscard]] bool equal(const Body&, const Body&);

/// Paths of what differs between two records of one kind: "links[3].given.mass". A list of another
/// length is one difference, as is a value that only one of the two has.
[[nodiscard]] std::vector<std::string> differences(const Body& before, const Body& after);

/// Kinds that a reference may have: as declared, or the registered kind that has the field's name;
/// none = any. Stays as long as the program. [any thread]
[[nodiscard]] std::span<const Kind> kinds_of(const Field&, const Type& reference);
/// A reference of a record: who holds it, and which kinds its declaration allows (none = any).
struct HeldReference {
  AnyId id;
  std::string_view where;  ///< name of the innermost element that has one, else of the field
  std::span<const Kind> kinds;
};
/// Those that stand in what `before` (data null = nothing) does not share with it are seen; all are
/// of a record that shares none.
void for_each_held_reference(const Content&, const std::function<void(const HeldReference&)>&,
                             const Content& before = {});

}  // namespace robomosp::model
