// SPDX-License-Identifier: Apache-2.0
// A run without a world: the actions of a program, in order, for posts and proofs (layer: data
// processing, program).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "program/machine.h"
#include "program/world.h"

namespace robomosp::program {

/// A condition on signals with its variables replaced by their values, as a flat tree: operands
/// precede their operators; the last node is the root.
struct ConditionNode {
  std::uint32_t op = RMP_EXPR_LITERAL;  ///< rmp_expression_op: LITERAL, SYMBOL (a signal),
                                        ///< CONVERT, NEGATE, NOT, ADD .. EXOR
  std::uint32_t type = RMP_TYPE_BOOL;
  std::uint32_t symbol = RMP_NONE;           ///< SYMBOL: row of the program's symbols
  std::int64_t integer = 0;                  ///< LITERAL: INT, BOOL, CHAR
  double real = 0;                           ///< LITERAL: REAL
  std::uint32_t a = RMP_NONE, b = RMP_NONE;  ///< operands
  friend bool operator==(const ConditionNode&, const ConditionNode&) = default;
};
struct Condition {
  std::vector<ConditionNode> nodes;
  [[nodiscard]] std::string text(const rmp_code&) const;  ///< as IRL writes it
  friend bool operator==(const Condition&, const Condition&) = default;
};

/// A motion with all known data.
struct TracedMotion {
  Motion motion;
  /// base_T_tool at the end of each target, if known: absolute poses, increments added, frames
  /// applied. Nothing = joints, or an increment after an unknown pose.
  std::vector<std::optional<PlainPose>> absolute;
  std::optional<Condition> until;
};
struct TracedWrite {
  std::uint32_t symbol = RMP_NONE;
  SignalValue value;
};
/// WAIT t SEC, or WAIT FOR with its condition.
struct TracedWait {
  double seconds = -1;  ///< of WAIT t SEC; of WAIT FOR its TIMEOUT, negative = none
  std::optional<Condition> condition;
};
struct TracedText {
  std::string text;
};
struct TracedPause {
  std::string message;
};
struct TracedHalt {};
struct TraceEntry {
  std::uint32_t process = 0;
  rmp_span span{};
  std::variant<TracedMotion, TracedWrite, TracedWait, TracedText, TracedPause, TracedHalt> what;
};

struct TraceOptions {
  /// Values of inputs by name (any case); others are unknown.
  std::map<std::string, SignalValue> inputs;
  std::size_t most_entries = 100'000;
  std::uint64_t most_instructions = 2'000'000'000;
  Limits limits{};
};
struct Trace {
  std::shared_ptr<const CompiledProgram> program;  ///< the program of the row numbers
  std::vector<TraceEntry> entries;
  [[nodiscard]] std::size_t motion_count() const;
};

/// Runs a program through: motions take no time and reach their targets, waits end at once, pauses
/// are skipped, texts and outputs are recorded. Inputs without a value are allowed in WAIT FOR and
/// UNTIL; control flow that depends on one otherwise is an error with its line. So are robot state
/// and TRAFOINV, which need a robot, and several processes with motions.
Result<Trace> trace(std::shared_ptr<const CompiledProgram>, const TraceOptions& = {},
                    const Progress* = nullptr);

}  // namespace robomosp::program
