// SPDX-License-Identifier: Apache-2.0
// The language of types: what an argument, a field of a record or a parameter of a provider is,
// written as a short text and parsed once into an immutable tree (layer: core).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/condition.h"
#include "kernel/schema.h"
#include "kernel/value.h"

namespace robomosp {

/// Kinds of types. Their notation is in brackets.
enum class TypeKind : std::uint8_t {
  any,        ///< any value (`any`); `any<T>` is T, read by the command instead of the schema
  nothing,    ///< no value; of results (`nil`)
  boolean,    ///< (`bool`)
  integer,    ///< (`int`)
  real,       ///< (`real`, `real [m]`)
  text,       ///< (`string`)
  word,       ///< one of a few words (`enum`, `enum(dh: Standard rows. | mdh: Craig's rows.)`)
  path,       ///< a file (`path`, `path(open: *.csv *.npz)`, `path(save)`, `path(folder)`)
  colour,     ///< "#rrggbb", "#rrggbbaa" or {r, g, b[, a]} from 0 to 1 (`colour`)
  vector,     ///< numbers (`real[]`; `vec3`, `vec(4)`, `vec(radius, angle, z)` of a fixed count)
  pose,       ///< position and orientation in any representation (`pose`)
  matrix,     ///< rows of numbers (`matrix`, `matrix(4, 4)`, `matrix(, 2)`)
  list,       ///< (`list`, `list<real [m]>`)
  map,        ///< names and values (`map`, `map<real>`, `map{name: string; mass?: real [kg]}`;
              ///< `map<real>{name: string}`: further names have reals)
  table,      ///< rows of the same fields (`table{name: string; value: real}`)
  variant,    ///< a map with fields that depend on one of them (`variant(step){move: {...}; wait:
              ///< {...}}`)
  one_of,     ///< one of several types (`real or string`)
  reference,  ///< a record by name or handle (`ref:robot`, `ref:solid|object`, `ref:any`)
  handle,     ///< of results (`handle`)
  array,      ///< of results: numbers of any shape (`array`)
  member,     ///< a name within what another argument names (`member:link of id`)
  provider,  ///< a solver or its like, with parameters (`provider:ik`, `provider:ik(name)` without)
  joints,    ///< a number for each joint (`joints of id`, `joints(velocity) of id`)
  expression,  ///< a number, or an expression over parameters (`expression`)
  script,      ///< text in a language (`script:lua`, `script:irl`, `script:condition`)
  named,       ///< a type that has a name (`type:step`), which may contain itself
};

/// A word of an enum: `mdh "Modified DH": Craig's rows.`
struct WordInfo {
  std::string word;     ///< the value
  std::string doc{};    ///< one sentence; may be empty
  std::string label{};  ///< as declared; may be empty, see word_label()
};
/// What a form shows instead of the word: the declared label, or one made of the word, such as
/// "Best effort" of best_effort.
[[nodiscard]] std::string word_label(const WordInfo&);

/// Facts about a value beside its type, written behind it: `real [m] @step(0.01) @advanced`.
struct TypeNotes {
  std::string label;             ///< @label(Damping)
  std::string group;             ///< @group(Limits): heading that it is shown under
  int order = 0;                 ///< @order(3): place within the group; 0 = as declared
  bool is_advanced = false;      ///< @advanced: hidden until it is asked for
  Condition when;                ///< @when(step is move): when it applies; empty = always
  double step = 0;               ///< @step(0.01): sensible change [SI]; 0 = none
  bool is_logarithmic = false;   ///< @log: changed by factors
  std::string shown_unit;        ///< @shown(mm): usual unit in user interfaces
  std::optional<Value> example;  ///< @example({0, 0.5, 0})
  std::string since;             ///< @since(1.6): version of the program
  std::string deprecated;        ///< @deprecated(Give tip instead.)
  std::string effect;            ///< @effect(...): how it changes the result
  /// @min(0), @above(0), @max(1), @infinite: of parts; an argument's limits are in its ParamSpec.
  std::optional<double> min, max;
  bool is_infinite = false;
};

/// A parsed type. Immutable. [any thread]
struct TypeTree {
  TypeKind kind = TypeKind::any;
  /// member: kind of member ("link"); script: its language; path: "open", "save", "folder" or "";
  /// joints: "position", "velocity", "acceleration" or "force"; named: its name.
  std::string word;
  /// reference: kinds; provider: interfaces; path: patterns of files; vector: names of components.
  std::vector<std::string> words;
  std::vector<WordInfo> choices;  ///< word; empty = those of the ParamSpec
  /// member, joints: the argument or field with the owner; "" = none is named: choices are then
  /// those of `id`, or members of the program, such as commands.
  std::string of;
  std::string unit;                         ///< real, vector, matrix: SI, if the text has a unit
  std::size_t count = 0;                    ///< vector: numbers; 0 = any count
  std::size_t rows = 0, cols = 0;           ///< matrix; 0 = any count
  bool is_name_only = false;                ///< provider: a name, without parameters
  bool is_unchecked = false;                ///< `any<T>`: the command reads it, not the schema
  std::shared_ptr<const TypeTree> element;  ///< list, map of one type; null = of any
  Schema fields;                            ///< map, table
  std::string decided_by;                   ///< variant: the field that decides
  std::vector<std::pair<std::string, Schema>> cases;     ///< variant: by the word of that field
  std::vector<std::shared_ptr<const TypeTree>> options;  ///< one_of
  TypeNotes notes;
};

/// Parses a type; the tree lives as long as the program. The error names the position in the text.
[[nodiscard]] Result<std::shared_ptr<const TypeTree>> parse_type(std::string_view text);
/// The tree of a type that is known to be well formed, parsed once; aborts on a malformed one.
/// Lives as long as the program. [any thread]
[[nodiscard]] const TypeTree& type_tree(std::string_view text);
/// "" or the fault of a type, including the types within it: unknown names of `type:`, conditions
/// over missing fields, examples that do not fit.
[[nodiscard]] std::string type_fault(std::string_view text);
/// The same for a whole table of parameters.
[[nodiscard]] std::string schema_fault(const Schema&);

/// The word by which a type is checked and shown without its parts: "list" of list<real>, "any" of
/// `real or string`, "string" of member:link, the whole text of "ref:robot". Lives as long as the
/// program or `text`. [any thread]
[[nodiscard]] std::string_view plain_type(std::string_view text);

/// The text of a tree, which parses to the same tree.
[[nodiscard]] std::string type_text(const TypeTree&);
/// A description for users: "list of real [m]", "name of a link of `id`", "map".
[[nodiscard]] std::string type_words(const TypeTree&);

/// The types `map{...}`, `table{...}` and `list<...>` built from tables of parameters.
[[nodiscard]] std::string map_type(const Schema& fields);
[[nodiscard]] std::string table_type(const Schema& fields);
/// `variant(step){...}`.
[[nodiscard]] std::string variant_type(std::string_view decided_by,
                                       const std::vector<std::pair<std::string, Schema>>& cases);

/// Names a type, for `type:name`; each name once. `plain` is its plain_type(), so that command
/// tables can be read without parsing it; `text` is called on first use. [any thread]
class NamedType {
 public:
  using Text = std::string (*)();
  NamedType(const char* name, const char* plain, Text text);
};
/// The tree of a named type; null = there is none.
[[nodiscard]] const TypeTree* named_type(std::string_view name);
/// All names, sorted.
[[nodiscard]] std::vector<std::string> named_types();

// --- parameters with notes -----------------------------------------------------------------

/// Adds a note to a parameter: noted(optional("gain", "real", "", "..."), "@log @step(0.1)").
[[nodiscard]] ParamSpec noted(ParamSpec p, std::string_view notes);
/// Changes the type of a parameter in a table; aborts if the name is unknown.
void retype(Schema&, std::string_view name, std::string_view type);
/// The notes of a parameter, with its own label and group.
[[nodiscard]] TypeNotes notes_of(const ParamSpec&);
/// Words of an enum with labels and descriptions, from the type or the choices of the parameter.
[[nodiscard]] std::vector<WordInfo> words_of(const ParamSpec&);
/// "m" for a parameter with that unit, from the parameter or its type.
[[nodiscard]] std::string unit_of(const ParamSpec&);
/// The usual unit for quantities of an SI unit: mm for m, deg for rad; else the same.
[[nodiscard]] std::string_view shown_unit_of(std::string_view si_unit);

}  // namespace robomosp
