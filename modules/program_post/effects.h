// SPDX-License-Identifier: Apache-2.0
// Determines whether two values of a program depend on their order of evaluation (layer: data
// processing, program_post).
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include <robomosp/sdk/program_tables.h>

namespace robomosp::program_post {

/// Effects of functions, including those of the functions they call: variables, their arguments,
/// and the world (motions, waits, signals, texts). Modified parameters may alias any variable of
/// the program. Built from the original tables; rows added later must not be queried.
class Effects {
 public:
  explicit Effects(const ProgramTables& tables);
  /// True if a function called by an expression has any lasting effect.
  [[nodiscard]] bool is_any() const { return is_any_; }
  /// True if the evaluation of a value changes anything.
  bool changes(std::uint32_t e);
  /// True if one of two values changes what the other reads or changes.
  bool depend(std::uint32_t a, std::uint32_t b);

 private:
  /// Symbols; RMP_NONE = the world.
  struct Touched {
    std::set<std::uint32_t> read, changed;
  };
  [[nodiscard]] Touched of(std::uint32_t e);
  /// Lasting effects of a routine, including those of the routines it calls.
  const Touched& outlasting(std::uint32_t routine);
  void add_routine(std::uint32_t r, Touched& to, std::set<std::uint32_t>& calls) const;
  /// Effects of an expression itself; `calls` receives the routines it calls.
  void add_expression(std::uint32_t e, Touched& to, std::set<std::uint32_t>& calls) const;
  void add_place(std::uint32_t e, Touched& to) const;
  void touch(std::uint32_t symbol, std::set<std::uint32_t>& to) const;
  [[nodiscard]] bool is_reference(std::uint32_t symbol) const;
  [[nodiscard]] bool meet(const std::set<std::uint32_t>& a, const std::set<std::uint32_t>& b) const;
  [[nodiscard]] std::uint32_t operand(std::uint32_t e, std::uint32_t k) const;

  const ProgramTables& t_;
  // Of routines called by expressions, and those they call; others are irrelevant here.
  std::vector<Touched> own_;  ///< lasting effects
  std::vector<std::set<std::uint32_t>> calls_;
  std::vector<std::uint32_t> component_;  ///< routines that call each other recursively
  std::vector<std::vector<std::uint32_t>> members_;
  std::vector<bool> changes_any_;                ///< by component, including the routines it calls
  std::map<std::uint32_t, Touched> outlasting_;  ///< by component, computed on demand
  std::vector<std::vector<bool>> is_changed_;    ///< parameters of each routine
  std::vector<std::uint8_t> changes_;            ///< 0 = unknown, 1 = no, 2 = yes
  bool is_any_ = false;
};

}  // namespace robomosp::program_post
