// SPDX-License-Identifier: Apache-2.0
// Types and fields of the structs of records (layer: data processing, model). Beside each struct,
// one `fields(...)` names its members; all code that treats records as data (fingerprints,
// differences, files, values, paths, schemas) uses Type and Field. How to declare:
// docs/decisions/0023-one-declaration-a-record.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "model/kind.h"

namespace robomosp::model {

/// The tag for finding `fields` and `words`: `fields(v, Of<Material>{})`.
template <class T>
struct Of {};

/// Kind of a value, as far as it can be handled without its C++ type.
enum class Shape : std::uint8_t {
  boolean,    ///< bool
  integer,    ///< std::int32_t or std::int64_t
  real,       ///< double
  text,       ///< std::string
  word,       ///< an enum; Type::words names its values
  numbers,    ///< Type::count doubles in a row: Vec3, Sym3, std::array
  reals,      ///< std::vector<double>
  colour,     ///< Colour
  digest,     ///< two std::uint64_t that identify some content
  reference,  ///< AnyId or Id<K>
  setting,    ///< ProviderChoice::Param
  structure,  ///< a struct with fields
  list,       ///< std::vector or LongList of Type::element
  optional,   ///< std::optional of Type::element
  shared,     ///< std::shared_ptr<const T> of Type::element, may be null; never changed in place
  table,      ///< std::map by std::string of Type::element
};

/// Of joint coordinates: an angle or a length by the kind of joint.
inline constexpr std::string_view kByJoint = "rad|m";

struct Type;
/// The type of a member or of a record's content; defined in model/kinds.cpp, or where
/// model/declare.h is included. [any thread]
template <class T>
const Type& type_of();

/// One member of a struct, as declared.
struct Field {
  std::string_view name;   ///< in values, paths and, unless `file` says otherwise, files
  std::string_view title;  ///< for people; "" = the name with spaces
  std::string_view sentence;
  /// SI; "" = dimensionless; "rad|m" = by Type::alternative of the struct around it.
  std::string_view si_unit;
  std::string_view (*unit_at)(const void*, std::size_t) = nullptr;       ///< of owner and component
  std::string_view (*component_at)(const void*, std::size_t) = nullptr;  ///< its name; "" = none
  const Type* type = nullptr;
  std::size_t offset = 0;  ///< in its struct
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool is_above_min = false;           ///< min itself is refused
  bool may_be_infinite = false;        ///< NaN never may
  bool is_needed = false;              ///< a file without it is rejected
  bool is_read_only = false;           ///< computed from content that is not a field
  bool is_path_flat = false;           ///< its fields are addressed without its name
  bool is_addressed_by_names = false;  ///< a list: elements are addressed by name without its own
  std::string_view (*path_word)(const void*) = nullptr;  ///< of owner: instead of its name in paths
  std::string_view index_in;  ///< an integer: place in this list of the record; -1 = none
  /// Of the owner: whether the field applies; null = always. Values and files omit fields that do
  /// not.
  bool (*counts)(const void*) = nullptr;
  bool is_value_flat = false;       ///< its fields are among the owner's in values
  std::string_view file_word;       ///< in files instead of its name; for lists the default is the
                                    ///< name without its last s
  bool is_always_written = false;   ///< written to files even if it has its default
  bool is_unit_written = false;     ///< written to files even if it is the SI unit
  bool is_written_by_kind = false;  ///< a reference: the kind is its word in files
  std::vector<Kind> kinds;          ///< allowed for a reference; empty = any
  int since_version = 1;            ///< of the files

  // Setters for declarations.
  Field& label(std::string_view v) { return title = v, *this; }
  Field& doc(std::string_view v) { return sentence = v, *this; }
  Field& unit(std::string_view v) { return si_unit = v, *this; }
  Field& unit_by(std::string_view (*f)(const void*, std::size_t)) { return unit_at = f, *this; }
  Field& component_by(std::string_view (*f)(const void*, std::size_t)) {
    return component_at = f, *this;
  }
  Field& in_paths(std::string_view (*f)(const void*)) { return path_word = f, *this; }
  Field& range(double low, double high) { return min = low, max = high, *this; }
  Field& at_least(double low) { return min = low, *this; }
  Field& above(double low) { return min = low, is_above_min = true, *this; }
  Field& infinite() { return may_be_infinite = true, *this; }
  Field& needed() { return is_needed = true, *this; }
  Field& read_only() { return is_read_only = true, *this; }
  Field& flat() { return is_path_flat = true, *this; }
  Field& by_names() { return is_addressed_by_names = true, *this; }
  Field& index_of(std::string_view list) { return index_in = list, *this; }
  Field& refers_to(std::initializer_list<Kind> k) { return kinds = k, *this; }
  Field& counts_if(bool (*f)(const void*)) { return counts = f, *this; }
  Field& flat_value() { return is_value_flat = true, *this; }
  Field& file(std::string_view word) { return file_word = word, *this; }
  Field& always_written() { return is_always_written = true, *this; }
  Field& with_unit() { return is_unit_written = true, *this; }
  Field& by_kind() { return is_written_by_kind = true, *this; }
  Field& since(int version) { return since_version = version, *this; }

  /// "motor inertia"
  [[nodiscard]] std::string shown_name() const;
  /// Of component `i` of this field of the struct at `owner`; SI.
  [[nodiscard]] std::string_view unit_of(const void* owner, std::size_t i = 0,
                                         std::size_t alternative = 0) const;
  /// The word of a field in files: its own, or for a list of structs its name without the last s.
  [[nodiscard]] std::string_view word_in_files() const;
  [[nodiscard]] void* in(void* owner) const { return static_cast<std::byte*>(owner) + offset; }
  [[nodiscard]] const void* in(const void* owner) const {
    return static_cast<const std::byte*>(owner) + offset;
  }
};

/// A C++ type with its operations; those that do not apply to a shape are null.
struct Type {
  Shape shape = Shape::structure;
  std::size_t size = 0;
  std::vector<Field> fields;      ///< structure, in order of declaration
  const Type* element = nullptr;  ///< list, optional, shared, table
  std::size_t count = 0;          ///< numbers: how many
  struct Word {
    std::string_view word;
    std::int64_t value = 0;
  };
  std::vector<Word> words;  ///< word
  std::vector<Kind> kinds;  ///< reference: what the C++ type allows; empty = any
  /// structure: the part of a unit such as "rad|m" that applies within.
  std::size_t (*alternative)(const void*) = nullptr;
  bool has_references = false;
  bool has_heap = false;                 ///< has memory behind a pointer, so its size varies
  std::shared_ptr<const void> standard;  ///< a default-constructed value

  void (*assign)(void* to, const void* from) = nullptr;
  std::shared_ptr<void> (*clone)(const void*) = nullptr;
  std::int64_t (*whole)(const void*) = nullptr;      ///< integer, word
  void (*set_whole)(void*, std::int64_t) = nullptr;  ///< integer, word
  AnyId (*id)(const void*) = nullptr;                ///< reference
  void (*set_id)(void*, AnyId) = nullptr;            ///< reference
  std::size_t (*length)(const void*) = nullptr;      ///< list
  const void* (*data)(const void*) = nullptr;        ///< of a std::vector: contiguous elements
  /// Of a LongList instead: an element, for reading and for changing, and the number of elements
  /// per block; 0 = not a LongList.
  const void* (*item)(const void*, std::size_t) = nullptr;
  void* (*item_for_change)(void*, std::size_t) = nullptr;
  std::size_t block = 0;
  void (*resize)(void*, std::size_t) = nullptr;    ///< list
  void (*take_out)(void*, std::size_t) = nullptr;  ///< list: removes an element
  const void* (*held)(const void*) = nullptr;      ///< optional, shared: null = empty
  void* (*hold)(void*) = nullptr;  ///< the held value for modification (a copy if shared), else a
                                   ///< new one
  void (*drop)(void*) = nullptr;   ///< optional, shared
  /// table
  void (*each)(const void*, const std::function<void(const std::string&, const void*)>&) = nullptr;
  void* (*entry)(void*, const std::string&) = nullptr;  ///< created if missing
  void (*erase)(void*, const std::string&) = nullptr;

  [[nodiscard]] const Field* field(std::string_view name) const;
  /// An element of a list.
  [[nodiscard]] const void* at(const void* list, std::size_t i) const {
    return block ? item(list, i) : static_cast<const std::byte*>(data(list)) + i * element->size;
  }
  /// The same for changing.
  [[nodiscard]] void* at(void* list, std::size_t i) const {
    if (block) return item_for_change(list, i);
    return const_cast<void*>(at(static_cast<const void*>(list), i));  // the list is not const
  }
  /// The number of elements from `i` on that `list` and `before` (null = none), a possible
  /// ancestor, share in memory, so that they are equal and need no comparison.
  [[nodiscard]] std::size_t shared_from(const void* list, const void* before, std::size_t i) const {
    if (!block || !before || i % block != 0 || i >= length(list) || i >= length(before)) return 0;
    if (item(list, i) != item(before, i)) return 0;
    return length(list) - i < block ? length(list) - i : block;
  }
  /// "dh" for a word's value; "" if there is no word for it.
  [[nodiscard]] std::string_view word_of(const void*) const;
};

/// A registered kind of record.
struct KindInfo {
  std::string_view name;       ///< "robot"
  std::string_view extension;  ///< of its files: ".rbt"
  std::string_view folder;     ///< of a library that holds it: "robots"
  const Type* type = nullptr;
};

/// [any thread]
[[nodiscard]] const KindInfo& info(Kind);
/// Registers a kind that is not built in. Kinds are never removed, so that ids stay valid; the
/// texts must outlive the program. An existing name returns its kind. [any thread]
Kind register_kind(const KindInfo&);

}  // namespace robomosp::model
