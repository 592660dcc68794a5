// SPDX-License-Identifier: Apache-2.0
// LongList: a list with copies that share unchanged blocks, for lists of thousands in records
// (layer: data processing, model). Why: docs/decisions/0023-one-declaration-a-record.md.
#pragma once

#include <compare>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "kernel/unique.h"

namespace robomosp::model {

/// Used like a vector that is read through iterators and changed through operator[] and back(),
/// which copy the element's block if it is shared: references and iterators are valid until the
/// next change. Copying and comparing copies costs one pointer per block. [as std::vector]
template <class T>
class LongList {
 public:
  static constexpr std::size_t kBlock = 64;  ///< elements a block; all but the last are full
  using value_type = T;

  class const_iterator {
   public:
    using iterator_category = std::random_access_iterator_tag;
    using value_type = T;
    using difference_type = std::ptrdiff_t;
    using pointer = const T*;
    using reference = const T&;

    const_iterator() = default;
    reference operator*() const { return (*list_)[index_]; }
    pointer operator->() const { return &(*list_)[index_]; }
    reference operator[](difference_type n) const { return *(*this + n); }
    const_iterator& operator++() { return ++index_, *this; }
    const_iterator& operator--() { return --index_, *this; }
    const_iterator operator++(int) { return std::exchange(*this, *this + 1); }
    const_iterator operator--(int) { return std::exchange(*this, *this - 1); }
    const_iterator& operator+=(difference_type n) {
      index_ = static_cast<std::size_t>(static_cast<difference_type>(index_) + n);
      return *this;
    }
    const_iterator& operator-=(difference_type n) { return *this += -n; }
    friend const_iterator operator+(const_iterator i, difference_type n) { return i += n; }
    friend const_iterator operator+(difference_type n, const_iterator i) { return i += n; }
    friend const_iterator operator-(const_iterator i, difference_type n) { return i -= n; }
    friend difference_type operator-(const const_iterator& a, const const_iterator& b) {
      return static_cast<difference_type>(a.index_) - static_cast<difference_type>(b.index_);
    }
    friend bool operator==(const const_iterator& a, const const_iterator& b) {
      return a.index_ == b.index_;
    }
    friend auto operator<=>(const const_iterator& a, const const_iterator& b) {
      return a.index_ <=> b.index_;
    }

   private:
    friend class LongList;
    const_iterator(const LongList* list, std::size_t index) : list_(list), index_(index) {}
    const LongList* list_ = nullptr;
    std::size_t index_ = 0;
  };
  using iterator = const_iterator;

  LongList() = default;
  LongList(std::initializer_list<T> items) {
    for (const T& item : items) push_back(item);
  }
  LongList(std::vector<T> items) {  // NOLINT: as wide as the vector
    for (T& item : items) push_back(std::move(item));
  }
  LongList(const LongList&) = default;
  LongList(LongList&& from) noexcept
      : blocks_(std::move(from.blocks_)), size_(std::exchange(from.size_, 0)) {}
  LongList& operator=(LongList from) noexcept {
    blocks_.swap(from.blocks_);
    std::swap(size_, from.size_);
    return *this;
  }
  ~LongList() = default;

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] const_iterator begin() const { return {this, 0}; }
  [[nodiscard]] const_iterator end() const { return {this, size_}; }
  [[nodiscard]] const T& operator[](std::size_t i) const {
    return (*blocks_[i / kBlock])[i % kBlock];
  }
  [[nodiscard]] const T& front() const { return (*this)[0]; }
  [[nodiscard]] const T& back() const { return (*this)[size_ - 1]; }

  [[nodiscard]] T& operator[](std::size_t i) { return unique(blocks_[i / kBlock])[i % kBlock]; }
  [[nodiscard]] T& front() { return (*this)[0]; }
  [[nodiscard]] T& back() { return (*this)[size_ - 1]; }
  void push_back(T item) {
    if (size_ % kBlock == 0) blocks_.emplace_back();
    unique(blocks_.back()).push_back(std::move(item));
    ++size_;
  }
  void pop_back() { resize(size_ - 1); }
  void clear() { *this = LongList(); }
  void resize(std::size_t n) {
    const std::size_t blocks = (n + kBlock - 1) / kBlock;
    if (n < size_) {
      blocks_.resize(blocks);
      if (n % kBlock != 0) unique(blocks_.back()).resize(n % kBlock);
      size_ = n;
    }
    while (size_ < n) push_back(T());
  }
  void erase(const_iterator at) { erase(at.index_); }
  void erase(std::size_t i) {
    for (; i + 1 < size_; ++i) (*this)[i] = std::as_const(*this)[i + 1];
    pop_back();
  }

  /// True if both share the block of element `i`.
  [[nodiscard]] bool shares_block(const LongList& other, std::size_t i) const {
    const std::size_t b = i / kBlock;
    return b < blocks_.size() && b < other.blocks_.size() && blocks_[b] == other.blocks_[b];
  }
  bool operator==(const LongList& other) const {
    if (size_ != other.size_) return false;
    for (std::size_t b = 0; b < blocks_.size(); ++b)
      if (blocks_[b] != other.blocks_[b] && *blocks_[b] != *other.blocks_[b]) return false;
    return true;
  }

 private:
  std::vector<std::shared_ptr<std::vector<T>>> blocks_;
  std::size_t size_ = 0;
};

/// Returns the number of removed elements.
template <class T, class Predicate>
std::size_t erase_if(LongList<T>& list, Predicate&& goes) {
  const auto& all = std::as_const(list);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (goes(all[i])) continue;
    if (kept != i) list[kept] = all[i];
    ++kept;
  }
  const std::size_t gone = list.size() - kept;
  if (gone) list.resize(kept);
  return gone;
}

}  // namespace robomosp::model
