// SPDX-License-Identifier: Apache-2.0
// Records as data, independent of their kind and based on their declarations: fingerprint, memory,
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

/// The name of an element of a list: its field "name" if that is a text; else null.
[[nodiscard]] const std::string* name_of(const Type&, const void* element);

/// Feeds one reference: by id, or by kind and name.
using FeedReference = std::function<void(Fingerprinter&, AnyId)>;
/// Feeds every field, in order of declaration.
void feed(Fingerprinter&, const Content&, const FeedReference&);

/// Approximate size of memory owned by the value, beyond sizeof. Memory shared by versions of a
/// record is not counted, nor blocks shared with `other`, another version (data null = none).
[[nodiscard]] std::size_t heap_bytes(const Content&, const Content& other = {});

/// True if two values of one type have equal fingerprints: numbers by bits, except that -0 is 0 and
/// all NaNs are equal.
[[nodiscard]] bool equal(const Content&, const Content&);
[[nodiscard]] bool equal(const Body&, const Body&);

/// Paths of the differences between two records of one kind: "links[3].given.mass". Lists of
/// different length are one difference, as is a value that only one of them has.
[[nodiscard]] std::vector<std::string> differences(const Body& before, const Body& after);

/// Kinds allowed for a reference: as declared, or the registered kind with the field's name; empty
/// = any. Valid as long as the program. [any thread]
[[nodiscard]] std::span<const Kind> kinds_of(const Field&, const Type& reference);
/// A reference of a record: its location, and the kinds that its declaration allows (empty = any).
struct HeldReference {
  AnyId id;
  std::string_view where;  ///< name of the innermost element that has one, else of the field
  std::span<const Kind> kinds;
};
/// Visits the references in the parts that `before` (data null = nothing) does not share with it;
/// all of them if nothing is shared.
void for_each_held_reference(const Content&, const std::function<void(const HeldReference&)>&,
                             const Content& before = {});

}  // namespace robomosp::model
