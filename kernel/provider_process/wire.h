// SPDX-License-Identifier: Apache-2.0
// Messages between this program and the process of a plugin: values in native byte order, both ends
// of one build. A single function, fields(), measures (Sizer), writes in place (Writer) and reads
// (Reader) a value (layer: core, header-only).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp::apart {

class Peer;

/// Numbers, and structs of numbers, for which any bytes are valid: copied unchanged.
template <class T>
struct IsPlain : std::bool_constant<(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) ||
                                    std::is_enum_v<T>> {};
template <class T, std::size_t N>
struct IsPlain<std::array<T, N>> : IsPlain<T> {};
template <>
struct IsPlain<Pose> : std::true_type {};
template <>
struct IsPlain<Sym3> : std::true_type {};
template <>
struct IsPlain<MassProperties> : std::true_type {};
template <>
struct IsPlain<Colour> : std::true_type {};
template <>
struct IsPlain<Mesh::Face> : std::true_type {};
template <class T>
concept Plain = IsPlain<std::remove_const_t<T>>::value;

/// Alignment of arrays, sufficient for any of their numbers.
inline constexpr std::uint64_t kArrayAlign = 16;
/// Greatest nesting of values.
inline constexpr int kDeepest = 64;

class Sizer {
 public:
  static constexpr bool is_reader = false, is_writer = false;
  void bytes(const void*, std::uint64_t n) { at_ += n; }
  void align() { at_ = (at_ + kArrayAlign - 1) / kArrayAlign * kArrayAlign; }
  [[nodiscard]] std::uint64_t size() const { return at_; }
  int depth = 0;

 private:
  std::uint64_t at_ = 0;
};

class Writer {
 public:
  static constexpr bool is_reader = false, is_writer = true;
  Writer(Peer& peer, char* base, std::uint64_t size) : peer_(peer), base_(base), size_(size) {}
  void bytes(const void* from, std::uint64_t n) {
    if (n > size_ - at_)
      n = size_ - at_;  // the value changed since it was measured: the reader rejects it
    if (n) std::memcpy(base_ + at_, from, n);
    at_ += n;
  }
  void align() {
    const std::uint64_t to = (at_ + kArrayAlign - 1) / kArrayAlign * kArrayAlign;
    if (to <= size_) at_ = to;
  }
  /// Numbers that the other side fills: they come back from where they are written. They are sent
  /// only if the function modifies them (`is_in_out`).
  void filled(void* to, std::uint64_t n) {
    align();
    if (n > size_ - at_) n = size_ - at_;
    filled_.push_back({at_, to, n});
    if (is_in_out) bytes(to, n);
    else at_ += n;
  }
  void take_back() const {
    for (const Filled& f : filled_)
      if (f.size) std::memcpy(f.to, base_ + f.at, f.size);
  }
  [[nodiscard]] Peer& peer() const { return peer_; }
  /// Objects lent for the call; with `is_lasting`, for the lifetime of their proxy.
  std::vector<std::uint64_t> lent;
  bool is_lasting = false;
  bool is_in_out = false;
  int depth = 0;

 private:
  struct Filled {
    std::uint64_t at;
    void* to;
    std::uint64_t size;
  };
  Peer& peer_;
  char* base_;
  std::uint64_t size_, at_ = 0;
  std::vector<Filled> filled_;
};

class Reader {
 public:
  static constexpr bool is_reader = true, is_writer = false;
  /// `copies`: copy all values out of the message, which the other side may change.
  Reader(Peer& peer, char* base, std::uint64_t size, bool copies)
      : peer_(&peer), base_(base), size_(size), copies_(copies) {}
  void bytes(void* to, std::uint64_t n) {
    if (n > left()) return fail();
    if (n) std::memcpy(to, base_ + at_, n);
    at_ += n;
  }
  void align() {
    const std::uint64_t to = (at_ + kArrayAlign - 1) / kArrayAlign * kArrayAlign;
    if (to > size_) return fail();
    at_ = to;
  }
  /// A count of elements of at least `each` bytes.
  std::uint64_t count(std::uint64_t each) {
    std::uint64_t n = 0;
    bytes(&n, sizeof n);
    if (is_broken_ || n > left() / each) fail();
    return is_broken_ ? 0 : n;
  }
  /// Numbers in place, or a copy. `is_filled`: their values are sent back; unless values were sent,
  /// they are NaN until written.
  template <class T>
  std::span<T> view(bool is_filled) {
    const std::uint64_t n = count(sizeof(T));
    std::uint8_t is_given = 1;
    if (is_filled) bytes(&is_given, 1);
    align();
    if (is_broken_ || n > left() / sizeof(T)) {
      fail();
      return {};
    }
    char* from = base_ + at_;
    at_ += n * sizeof(T);
    constexpr int kNoNumber = 0xff;
    if (!copies_) {
      if (!is_given) std::memset(static_cast<void*>(from), kNoNumber, n * sizeof(T));
      return {reinterpret_cast<T*>(from), static_cast<std::size_t>(n)};
    }
    auto own = std::make_unique_for_overwrite<T[]>(n);
    if (!is_given) std::memset(static_cast<void*>(own.get()), kNoNumber, n * sizeof(T));
    else if (n) std::memcpy(static_cast<void*>(own.get()), from, n * sizeof(T));
    const std::span<T> out(own.get(), static_cast<std::size_t>(n));
    if (is_filled && n) back_.push_back({from, own.get(), n * sizeof(T)});
    keep(std::shared_ptr<T[]>(std::move(own)));
    return out;
  }
  /// Copies filled numbers to where the other side reads them.
  void bring_back() const {
    for (const Back& b : back_) std::memcpy(b.to, b.from, b.size);
  }
  void keep(std::shared_ptr<const void> what) { kept_.push_back(std::move(what)); }
  [[nodiscard]] std::vector<std::shared_ptr<const void>> take_kept() { return std::move(kept_); }
  void fail() {
    is_broken_ = true;
    at_ = size_;
  }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] bool is_broken() const { return is_broken_; }
  [[nodiscard]] Peer& peer() const { return *peer_; }
  int depth = 0;

 private:
  struct Back {
    char* to;
    const void* from;
    std::uint64_t size;
  };
  [[nodiscard]] std::uint64_t left() const { return size_ - at_; }
  Peer* peer_;
  char* base_;
  std::uint64_t size_, at_ = 0;
  bool copies_, is_broken_ = false;
  std::vector<Back> back_;
  std::vector<std::shared_ptr<const void>> kept_;
};

// --- values ---

template <class V, Plain T>
void fields(V& v, T& x) {
  v.bytes(&x, sizeof x);
}
template <class V>
void fields(V& v, bool& x) {
  std::uint8_t byte = x ? 1 : 0;
  v.bytes(&byte, 1);
  x = byte != 0;
}
/// The number of elements that follow; a reader gets 0 if the message is too short for them.
template <class V>
std::uint64_t count_of(V& v, std::uint64_t n, std::uint64_t each) {
  if constexpr (V::is_reader) return v.count(each);
  else v.bytes(&n, sizeof n);
  return n;
}
template <class V>
void fields(V& v, std::string& s) {
  const std::uint64_t n = count_of(v, s.size(), 1);
  if constexpr (V::is_reader) s.resize(n);
  v.bytes(s.data(), n);
}
template <class V>
void fields(V& v, std::string_view& s) {
  const std::uint64_t n = count_of(v, s.size(), 1);
  if constexpr (V::is_reader) {
    auto own = std::make_shared<std::string>(n, '\0');
    v.bytes(own->data(), n);
    s = *own;
    v.keep(std::move(own));
  } else {
    v.bytes(s.data(), n);
  }
}
template <class V, class A, class B>
void fields(V& v, std::pair<A, B>& p);
template <class V, class T>
void fields(V& v, std::vector<T>& all);
template <class V, class T>
requires(!Plain<T>) void fields(V& v, std::array<T, 2>& all) {
  for (T& one : all) fields(v, one);
}
template <class V, class T>
void fields(V& v, std::optional<T>& x) {
  bool has = x.has_value();
  fields(v, has);
  if constexpr (V::is_reader) {
    if (has) x.emplace();
    else x.reset();
  }
  if (has) fields(v, *x);
}
template <class V, class T>
void fields(V& v, std::span<T>& all) {
  if constexpr (Plain<T>) {
    if constexpr (V::is_reader) {
      all = v.template view<std::remove_const_t<T>>(!std::is_const_v<T>);
    } else {
      std::uint64_t n = all.size();
      v.bytes(&n, sizeof n);
      if constexpr (!std::is_const_v<T>) {
        std::uint8_t is_given = 1;
        if constexpr (V::is_writer) is_given = v.is_in_out ? 1 : 0;
        v.bytes(&is_given, 1);
      }
      v.align();
      if constexpr (V::is_writer && !std::is_const_v<T>) v.filled(all.data(), all.size_bytes());
      else v.bytes(all.data(), all.size_bytes());
    }
  } else {
    static_assert(std::is_const_v<T>);
    using Own = std::remove_const_t<T>;
    if constexpr (V::is_reader) {
      auto own = std::make_shared<std::vector<Own>>();
      fields(v, *own);
      all = *own;
      v.keep(std::move(own));
    } else {
      std::uint64_t n = all.size();
      v.bytes(&n, sizeof n);
      for (T& one : all) fields(v, const_cast<Own&>(one));
    }
  }
}
template <class V, class T>
void fields(V& v, std::shared_ptr<const T>& x) {
  bool has = x != nullptr;
  fields(v, has);
  if constexpr (V::is_reader) {
    x = nullptr;
    if (!has) return;
    auto own = std::make_shared<T>();
    fields(v, *own);
    x = std::move(own);
  } else if (has) {
    fields(v, const_cast<T&>(*x));
  }
}
/// An optional value behind a pointer.
template <class V, class T>
void pointee(V& v, const T*& x) {
  bool has = x != nullptr;
  fields(v, has);
  if constexpr (V::is_reader) {
    x = nullptr;
    if (!has) return;
    auto own = std::make_shared<T>();
    fields(v, *own);
    x = own.get();
    v.keep(std::move(own));
  } else if (has) {
    fields(v, const_cast<T&>(*x));
  }
}
template <class V, class T>
void fields(V& v, std::vector<T>& all) {
  if constexpr (Plain<T>) {
    const std::uint64_t n = count_of(v, all.size(), sizeof(T));
    v.align();
    if constexpr (V::is_reader) all.resize(v.is_broken() ? 0 : n);
    v.bytes(all.data(), all.size() * sizeof(T));
  } else if constexpr (V::is_reader) {
    const std::uint64_t n = v.count(1);
    all.clear();
    for (std::uint64_t i = 0; i < n && !v.is_broken(); ++i) fields(v, all.emplace_back());
  } else {
    std::uint64_t n = all.size();
    v.bytes(&n, sizeof n);
    for (T& one : all) fields(v, one);
  }
}
template <class V, class A, class B>
void fields(V& v, std::pair<A, B>& p) {
  fields(v, p.first);
  fields(v, p.second);
}
template <class V>
void fields(V& v, Error& e) {
  fields(v, e.code);
  fields(v, e.message);
  fields(v, e.where);
  fields(v, e.hint);
}

}  // namespace robomosp::apart
