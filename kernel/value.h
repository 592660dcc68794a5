// SPDX-License-Identifier: Apache-2.0
// Value: what commands take and return; every front end translates to and from it (layer: core).
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace robomosp {

class Value;

/// Names something that lives in the program: a record ("robot", "solid", ...), a "recording", a
/// "job". A handle never dangles: it is looked up at each use, and a deleted target gives
/// ErrorCode::stale_handle. Numbers are never reused.
struct Handle {
  std::string kind;
  std::uint64_t number = 0;
  bool operator==(const Handle&) const = default;
};

/// A vector (cols == 0) or a row-major matrix of doubles, cheap to copy, with an optional unit for
/// display ("N m"; SI).
class NumericArray {
 public:
  NumericArray() = default;
  explicit NumericArray(std::vector<double> v, std::string unit = {})
      : rows_(v.size()),
        data_(std::make_shared<const std::vector<double>>(std::move(v))),
        unit_(std::move(unit)) {}
  NumericArray(std::vector<double> v, std::size_t rows, std::size_t cols, std::string unit = {})
      : rows_(rows),
        cols_(cols),
        data_(std::make_shared<const std::vector<double>>(std::move(v))),
        unit_(std::move(unit)) {}
  [[nodiscard]] bool is_matrix() const { return cols_ != 0; }
  [[nodiscard]] std::size_t rows() const { return rows_; }
  [[nodiscard]] std::size_t cols() const { return cols_; }  ///< 0 for a vector
  [[nodiscard]] std::size_t size() const { return data_ ? data_->size() : 0; }
  [[nodiscard]] const std::vector<double>& data() const {
    static const std::vector<double> none;
    return data_ ? *data_ : none;
  }
  [[nodiscard]] double operator[](std::size_t i) const { return (*data_)[i]; }
  [[nodiscard]] double at(std::size_t r, std::size_t c) const { return (*data_)[r * cols_ + c]; }
  [[nodiscard]] const std::string& unit() const { return unit_; }
  bool operator==(const NumericArray& o) const {
    return rows_ == o.rows_ && cols_ == o.cols_ && data() == o.data();
  }

 private:
  std::size_t rows_ = 0, cols_ = 0;
  std::shared_ptr<const std::vector<double>> data_;
  std::string unit_;
};

using List = std::vector<Value>;

/// String keys in order of insertion.
class Map {
 public:
  using Entry = std::pair<std::string, Value>;
  Map() = default;
  Map(std::initializer_list<Entry> entries);
  [[nodiscard]] const Value* find(std::string_view key) const;
  [[nodiscard]] Value* find(std::string_view key);
  void set(std::string key, Value value);  ///< replaces or appends
  bool erase(std::string_view key);
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] auto begin() const { return entries_.begin(); }
  [[nodiscard]] auto end() const { return entries_.end(); }
  bool operator==(const Map& o) const;

 private:
  std::vector<Entry> entries_;
};

/// nil, bool, int, real, string, numeric array, list, map or handle.
class Value {
 public:
  enum class Type : std::uint8_t { nil, boolean, integer, real, string, array, list, map, handle };
  Value() = default;
  Value(std::nullptr_t) {}                            // NOLINT: implicit by design, here and below
  Value(bool v) : v_(v) {}                            // NOLINT
  Value(int v) : v_(static_cast<std::int64_t>(v)) {}  // NOLINT
  Value(std::int64_t v) : v_(v) {}                    // NOLINT
  Value(std::size_t v) : v_(static_cast<std::int64_t>(v)) {}  // NOLINT
  Value(double v) : v_(v) {}                                  // NOLINT
  Value(const char* v) : v_(std::string(v)) {}                // NOLINT
  Value(std::string_view v) : v_(std::string(v)) {}           // NOLINT
  Value(std::string v) : v_(std::move(v)) {}                  // NOLINT
  Value(NumericArray v) : v_(std::move(v)) {}                 // NOLINT
  Value(List v) : v_(std::move(v)) {}                         // NOLINT
  Value(Map v) : v_(std::move(v)) {}                          // NOLINT
  Value(Handle v) : v_(std::move(v)) {}                       // NOLINT

  [[nodiscard]] Type type() const { return static_cast<Type>(v_.index()); }
  [[nodiscard]] std::string_view type_name() const;  ///< "nil", "bool", "int", "real", ...
  [[nodiscard]] bool is_nil() const { return type() == Type::nil; }
  [[nodiscard]] bool is_number() const { return type() == Type::integer || type() == Type::real; }
  /// Pointers to the content, or nullptr when the type is another.
  [[nodiscard]] const bool* as_bool() const { return std::get_if<bool>(&v_); }
  [[nodiscard]] const std::int64_t* as_int() const { return std::get_if<std::int64_t>(&v_); }
  [[nodiscard]] const double* as_real() const { return std::get_if<double>(&v_); }
  [[nodiscard]] const std::string* as_string() const { return std::get_if<std::string>(&v_); }
  [[nodiscard]] const NumericArray* as_array() const { return std::get_if<NumericArray>(&v_); }
  [[nodiscard]] const List* as_list() const { return std::get_if<List>(&v_); }
  [[nodiscard]] const Map* as_map() const { return std::get_if<Map>(&v_); }
  [[nodiscard]] Map* as_map() { return std::get_if<Map>(&v_); }
  [[nodiscard]] const Handle* as_handle() const { return std::get_if<Handle>(&v_); }
  /// Number of an int or real; 0 otherwise.
  [[nodiscard]] double number() const;
  bool operator==(const Value& o) const { return v_ == o.v_; }

  /// One line that reads well: `{1, 2, 3}`, `robot#17`. Numbers shortest round trip.
  [[nodiscard]] std::string text() const;

 private:
  std::variant<std::monostate, bool, std::int64_t, double, std::string, NumericArray, List, Map,
               Handle>
      v_;
};

}  // namespace robomosp
