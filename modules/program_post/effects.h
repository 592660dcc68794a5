// SPDX-License-Identifier: Apache-2.0
// Whether two values of a program may be others when they are computed in the other order
// (layer: data processing, program_post).
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include <robomosp/sdk/program_tables.h>

namespace robomosp::program_post {

/// What functions change when they are called, themselves or by what they call: variables,
/// arguments of theirs, and the world (motions, waits, signals, texts). Parameters that are changed
/// may stand for any variable of the program. Made of the tables as they were; rows that are added
/// later are not asked for.
class Effects {
 public:
  explicit Effects(const ProgramTables& tables);
  /// Whether a function that an expression calls changes anything that outlasts it.
  [[nodiscard]] bool is_any() const { return is_any_; }
  /// Whether a value changes anything while it is computed.
  bool changes(std::uint32_t e);
  /// Whether one of two values changes what the other reads or changes.
  bool depend(std::uint32_t a, std::uint32_t b);

 private:
  /// Symbols; RMP_NONE = the world.
  struct Touched {
    std::set<std::uint32_t> read, changed;
  };
  [[nodiscard]] Touched of(std::uint32_t e);
  /// What a routine touches that outlasts it, itself or by what it calls.
  const Touched& outlasting(std::uint32_t routine);
  void add_routine(std::uint32_t r, Touched& to, std::set<std::uint32_t>& calls) const;
  /// What an expression touches itself; routines that it calls.
  void add_expression(std::uint32_t e, Touched& to, std::set<std::uint32_t>& calls) const;
  void add_place(std::uint32_t e, Touched& to) const;
  void touch(std::uint32_t symbol, std::set<std::uint32_t>& to) const;
  [[nodiscard]] bool is_reference(std::uint32_t symbol) const;
  [[nodiscard]] bool meet(const std::set<std::uint32_t>& a, const std::set<std::uint32_t>& b) const;
  [[nodiscard]] std::uint32_t operand(std::uint32_t e, std::uint32_t k) const;

  const ProgramTables& t_;
  // Of routines that expressions call, and of what they call; the others touch nothing here.
  std::vector<Touched> own_;  ///< that outlasts them
  std::vector<std::set<std::uint32_t>> calls_;
  std::vector<std::uint32_t> component_;  ///< who call each other in a circle
  std::vector<std::vector<std::uint32_t>> members_;
  std::vector<bool> changes_any_;                ///< by component, with what it calls
  std::map<std::uint32_t, Touched> outlasting_;  ///< by component, as far as asked for
  std::vector<std::vector<bool>> is_changed_;    ///< parameters of each routine
  std::vector<std::uint8_t> changes_;            ///< 0 = not looked at, 1 = no, 2 = yes
  bool is_any_ = false;
};

}  // namespace robomosp::program_post
