// SPDX-License-Identifier: Apache-2.0
// Value: arguments and results of commands; every front end converts to and from it (layer: core).
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace robomosp {

class Value;

/// Identifies an object of the program: a record ("robot", "solid", ...), a "recording", a "job". A
/// handle never dangles: it is looked up at each use, and a deleted target gives
/// ErrorCode::stale_handle. Numbers are never reused.
struct Handle {
  std::string kind;
  std::uint64_t number = 0;
  bool operator==(const Handle&) const = default;
};

/// A view of the numbers of a NumericArray; converts to a vector by copying.
class Numbers : public std::span<const double> {
 public:
  Numbers() = default;
  Numbers(const double* first, std::size_t count) : span(first, count) {}
  Numbers(const std::vector<double>& v) : span(v) {}  // NOLINT: implicit by design, as below
  /// \throws std::out_of_range
  [[nodiscard]] double at(std::size_t i) const {
    if (i >= size()) throw std::out_of_range("there is no number " + std::to_string(i));
    return (*this)[i];
  }
  operator std::vector<double>() const { return {begin(), end()}; }  // NOLINT
  friend bool operator==(Numbers a, Numbers b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }
};

/// A vector (cols == 0) or a row-major matrix of doubles, cheap to copy, with an optional unit for
/// display ("N m"; SI).
class NumericArray {
 public:
  NumericArray() = default;
  explicit NumericArray(std::vector<double> v, std::string unit = {})
      : NumericArray(std::move(v), kVector, 0, std::move(unit)) {}
  NumericArray(std::vector<double> v, std::size_t rows, std::size_t cols, std::string unit = {})
      : size_(v.size()),
        rows_(rows == kVector ? v.size() : rows),
        cols_(cols),
        unit_(std::move(unit)) {
    if (v.size() <= kFew) {
      data_ = copied(v.data(), v.size());
      return;
    }
    auto kept = std::make_shared<const std::vector<double>>(std::move(v));
    data_ = std::shared_ptr<const double>(kept, kept->data());
  }
  explicit NumericArray(std::initializer_list<double> v, std::string unit = {})
      : size_(v.size()),
        rows_(v.size()),
        data_(copied(v.begin(), v.size())),
        unit_(std::move(unit)) {}
  NumericArray(std::initializer_list<double> v, std::size_t rows, std::size_t cols,
               std::string unit = {})
      : size_(v.size()),
        rows_(rows),
        cols_(cols),
        data_(copied(v.begin(), v.size())),
        unit_(std::move(unit)) {}
  /// `rows` numbers, or rows x cols, in shared memory, so that the arrays of one result need one
  /// allocation. `first` must own (or share) at least that many.
  NumericArray(std::shared_ptr<const double> first, std::size_t rows, std::size_t cols,
               std::string unit)
      : size_(cols ? rows * cols : rows),
        rows_(rows),
        cols_(cols),
        data_(std::move(first)),
        unit_(std::move(unit)) {}
  [[nodiscard]] bool is_matrix() const { return cols_ != 0; }
  [[nodiscard]] std::size_t rows() const { return rows_; }
  [[nodiscard]] std::size_t cols() const { return cols_; }  ///< 0 for a vector
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] Numbers data() const { return {data_.get(), size_}; }  ///< valid as long as this
  [[nodiscard]] double operator[](std::size_t i) const { return data_.get()[i]; }
  [[nodiscard]] double at(std::size_t r, std::size_t c) const { return data_.get()[r * cols_ + c]; }
  [[nodiscard]] const std::string& unit() const { return unit_; }
  bool operator==(const NumericArray& o) const {
    return rows_ == o.rows_ && cols_ == o.cols_ && data() == o.data();
  }

 private:
  static constexpr std::size_t kVector = static_cast<std::size_t>(-1);
  static constexpr std::size_t kFew = 64;  ///< up to this size a copy is cheaper than a second
                                           ///< block
  static std::shared_ptr<const double> copied(const double* first, std::size_t count) {
    auto block = std::make_shared_for_overwrite<double[]>(count);
    std::copy(first, first + count, block.get());
    const double* numbers = block.get();
    return {std::move(block), numbers};
  }

  std::size_t size_ = 0, rows_ = 0, cols_ = 0;
  std::shared_ptr<const double> data_;
  std::string unit_;
};

using List = std::vector<Value>;

/// String keys in order of insertion.
class Map {
 public:
  using Entry = std::pair<std::string, Value>;
  using Iterator = std::vector<Entry>::const_iterator;
  Map() = default;
  Map(std::initializer_list<Entry> entries);
  [[nodiscard]] const Value* find(std::string_view key) const;
  [[nodiscard]] Value* find(std::string_view key);
  void set(std::string key, Value value);  ///< replaces or appends; takes longer the more there are
  void append(std::string key, Value value);  ///< for a key that does not exist yet
  bool erase(std::string_view key);
  // Defined where Value is complete, as the size of an entry is needed.
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] bool empty() const;
  [[nodiscard]] Iterator begin() const;
  [[nodiscard]] Iterator end() const;
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
  /// A map that values share, so that copies of them take constant time. Not null.
  explicit Value(std::shared_ptr<const Map> v) : v_(std::move(v)) {}

  [[nodiscard]] Type type() const {
    return v_.index() == kShared ? Type::map : static_cast<Type>(v_.index());
  }
  [[nodiscard]] std::string_view type_name() const;  ///< "nil", "bool", "int", "real", ...
  [[nodiscard]] bool is_nil() const { return type() == Type::nil; }
  [[nodiscard]] bool is_number() const { return type() == Type::integer || type() == Type::real; }
  /// Pointers to the content, or nullptr if the type differs.
  [[nodiscard]] const bool* as_bool() const { return std::get_if<bool>(&v_); }
  [[nodiscard]] const std::int64_t* as_int() const { return std::get_if<std::int64_t>(&v_); }
  [[nodiscard]] const double* as_real() const { return std::get_if<double>(&v_); }
  [[nodiscard]] const std::string* as_string() const { return std::get_if<std::string>(&v_); }
  [[nodiscard]] const NumericArray* as_array() const { return std::get_if<NumericArray>(&v_); }
  [[nodiscard]] const List* as_list() const { return std::get_if<List>(&v_); }
  [[nodiscard]] const Map* as_map() const {
    return v_.index() == kShared ? std::get<kShared>(v_).get() : std::get_if<Map>(&v_);
  }
  /// For changing it; a shared map is copied first.
  [[nodiscard]] Map* as_map() {
    if (v_.index() == kShared) unshare();
    return std::get_if<Map>(&v_);
  }
  [[nodiscard]] const Handle* as_handle() const { return std::get_if<Handle>(&v_); }
  /// Number of an int or real; 0 otherwise.
  [[nodiscard]] double number() const;
  bool operator==(const Value& o) const;

  /// One readable line: `{1, 2, 3}`, `robot#17`. Numbers in shortest form that reads back.
  [[nodiscard]] std::string text() const;

 private:
  static constexpr std::size_t kShared = 9;
  void unshare();
  std::variant<std::monostate, bool, std::int64_t, double, std::string, NumericArray, List, Map,
               Handle, std::shared_ptr<const Map>>
      v_;
};

inline std::size_t Map::size() const { return entries_.size(); }
inline bool Map::empty() const { return entries_.empty(); }
inline Map::Iterator Map::begin() const { return entries_.begin(); }
inline Map::Iterator Map::end() const { return entries_.end(); }

}  // namespace robomosp
