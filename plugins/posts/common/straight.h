// SPDX-License-Identifier: Apache-2.0
// StraightWriter: for targets that only know one line behind the other. Variables, routines and
// control flow are errors that name the flattened program (layer: plugin helper).
#pragma once

#include "moves.h"

namespace robomosp::post {

class StraightWriter : public MoveWriter {
 public:
  using MoveWriter::MoveWriter;

 protected:
  void routine_begin(std::uint32_t r) override {
    if (r != 0) cannot("routines");
  }
  void routine_end(std::uint32_t) override {}
  std::span<const Operator> operators() const override { return {}; }
  void return_(std::uint32_t) override {
    // At the end of the program it is what happens anyway; elsewhere the rest would still run.
    halt();
  }
  /// Value of an output that is set; nothing = said.
  std::optional<double> output_value(const Signal& s, std::uint32_t value) {
    const auto v = known(value);
    if (!v) {
      cannot("computed values", "Post the flattened program (form = \"flat\").");
      return std::nullopt;
    }
    if (s.type == RMP_TYPE_INT && (*v < 0 || *v >= std::pow(2.0, s.width))) {
      fail("the value " + trimmed(*v, 0) + " does not fit into " + std::to_string(s.width) +
               " signals",
           "Widen the signal or make the value smaller.");
      return std::nullopt;
    }
    return v;
  }
  /// The states of the single signals of an output, the lowest bit first.
  std::vector<std::pair<std::int64_t, bool>> bits(const Signal& s, std::uint32_t value) {
    const auto v = output_value(s, value);
    if (!v) return {};
    if (s.type == RMP_TYPE_REAL) {
      cannot("analogue outputs", "Use an INT over several signals.");
      return {};
    }
    if (s.type == RMP_TYPE_BOOL) return {{s.number, (*v != 0) != s.inverted}};
    std::vector<std::pair<std::int64_t, bool>> out;
    for (int k = 0; k < s.width && k < 31; ++k)
      out.emplace_back(s.number + k, ((static_cast<std::int64_t>(*v) >> k) & 1) != 0);
    return out;
  }
  /// Seconds of a wait; nothing = said.
  std::optional<double> seconds(std::uint32_t e, double most) {
    const auto v = known(e);
    if (!v) {
      cannot("computed times", "Post the flattened program (form = \"flat\").");
      return std::nullopt;
    }
    if (!(*v >= 0 && *v <= most)) {
      fail("a wait of " + shortest(*v) + " s", "Give a time from 0 to " + trimmed(most, 1) + " s.");
      return std::nullopt;
    }
    return v;
  }
  /// The number of an attribute; what is computed is an error.
  double certain(const Motion& m, std::uint32_t a, const char* name, double otherwise,
                 double least = 0, double most = 1e9) {
    if (!m[a].known && m[a].expression != RMP_NONE) {
      cannot(std::string(name) + " that is computed",
             "Post the flattened program (form = \"flat\").");
      return otherwise;
    }
    if (!m[a].known) return otherwise;
    return number_of(m, a, name, least, most).value_or(otherwise);
  }
  /// A text of constants for a comment.
  std::optional<std::string> constant_text(std::span<const std::uint32_t> values) {
    const auto all = told(values);
    return all ? std::optional(plain_text(*all, '\0')) : std::nullopt;
  }
  /// Texts and numbers that are known, one behind the other, with all their letters.
  std::optional<std::string> told(std::span<const std::uint32_t> values) {
    std::string all;
    for (const std::uint32_t v : values) {
      const auto& x = expression(v);
      if (x.constant == RMP_NONE) {
        cannot("values in messages", "Post the flattened program (form = \"flat\").");
        return std::nullopt;
      }
      const auto& k = constant(x.constant);
      all += k.kind == RMP_CONSTANT_TEXT ? std::string(k.text, k.text_size)
                                         : trimmed(known(v).value_or(0), 6);
    }
    return all;
  }
  bool no_until(const Motion& m) {
    if (m.until == RMP_NONE) return true;
    cannot("motions that end on a condition (UNTIL)",
           "Post to a language that has them, or move in steps.");
    return false;
  }
  bool no_tool(const Motion& m) {
    if (!m[RMP_ATTR_TOOL].given) return true;
    cannot("tools (TOOL, or the tool that the robot has in its world)",
           "Give the targets for the flange, or post to a language that has tools.");
    return false;
  }
};

}  // namespace robomosp::post
