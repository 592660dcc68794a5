// SPDX-License-Identifier: Apache-2.0
#include "program_post/robots.h"

#include <map>
#include <optional>
#include <string>

#include "program_post/rewriter.h"
#include "program_post/walk.h"

namespace robomosp::program_post {
namespace {

constexpr const char* kHint =
    "Post a part for each robot (only_robot, --only-robot), or write a program for each.";

class OneRobot final : Rewriter {
 public:
  OneRobot(ProgramTables& t, std::string_view title, std::vector<Remark>& remarks)
      : Rewriter(t), title_(title), remarks_(remarks) {}
  void run() {
    bool is_asked = false;
    for (const rmp_code_attribute& a : t_.attributes)
      is_asked = is_asked || a.attribute == RMP_ATTR_ACT_ROB;
    if (!is_asked) return;
    std::uint32_t only = RMP_NONE, declared = 0;
    for (std::uint32_t s = 0; s < t_.symbols.size(); ++s)
      if (t_.symbols[s].kind == RMP_SYMBOL_ROBOT) only = s, ++declared;
    if (declared != 1) only = RMP_NONE;
    find_mentioned();
    for (std::uint32_t r = 0; r < t_.routines.size(); ++r)
      if (mentioned_[r]) motions_of(t_.routines[r].body, only);
    for (rmp_code_motion& m : t_.motions) take_out(m);
    for (const auto& [symbol, span] : first_)
      if (symbol != RMP_NONE && first_.size() == 1)
        remarks_.push_back({RMP_FAULT_NOTE, t_.symbols[symbol].span,
                            "the description of the robot " + std::string(name(symbol)) +
                                " is not written: all motions belong to it, and it is the "
                                "controller's robot; targets are in its base",
                            ""});
  }

 private:
  [[nodiscard]] std::string_view name(std::uint32_t symbol) const {
    return t_.symbols[symbol].name;
  }
  /// Routine 0, and those that anything names.
  void find_mentioned() {
    mentioned_.assign(t_.routines.size(), false);
    const auto add = [&](std::uint32_t s) {
      s = meant(s);
      if (s == RMP_NONE || s >= t_.symbols.size()) return;
      const rmp_code_symbol& x = t_.symbols[s];
      if (x.routine < mentioned_.size() && t_.routines[x.routine].symbol == s)
        mentioned_[x.routine] = true;
    };
    if (!mentioned_.empty()) mentioned_[0] = true;
    for (const rmp_code_statement& s : t_.statements) add(s.symbol);
    for (const rmp_code_expression& e : t_.expressions)
      if (e.op == RMP_EXPR_CALL) add(e.symbol);
    for (const rmp_code_motion& m : t_.motions)
      if (m.action < mentioned_.size()) mentioned_[m.action] = true;
  }
  [[nodiscard]] std::uint32_t meant(std::uint32_t s) const {
    for (int k = 0; k < 64 && s < t_.symbols.size(); ++k) {
      if (t_.symbols[s].kind != RMP_SYMBOL_IMPORT) return s;
      s = t_.symbols[s].value;
    }
    return RMP_NONE;
  }
  /// The robot that a motion names; nothing = none.
  [[nodiscard]] std::optional<std::uint32_t> named(const rmp_code_motion& m) const {
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      const rmp_code_attribute& a = t_.attributes[m.first_attribute + k];
      if (a.attribute == RMP_ATTR_ACT_ROB) return meant(ex(a.value).symbol);
    }
    return std::nullopt;
  }
  void motions_of(std::uint32_t first, std::uint32_t only) {
    each_statement(t_, first, [&](const rmp_code_statement& s) {
      if (s.op == RMP_STMT_MOVE && s.motion != RMP_NONE) look_at(t_.motions[s.motion], only);
    });
  }
  void look_at(const rmp_code_motion& m, std::uint32_t only) {
    const std::optional<std::uint32_t> robot = named(m);
    const std::uint32_t who = robot.value_or(only);
    if (robot && (who == RMP_NONE || t_.symbols[who].kind != RMP_SYMBOL_ROBOT)) {
      remarks_.push_back(
          {RMP_FAULT_ERROR, m.span, "the robot of this motion is known only at run time", kHint});
      return;
    }
    if (!first_.emplace(who, m.span).second || first_.size() == 1) {
      if (first_.size() == 1) before_ = who;
      return;
    }
    const auto words = [&](std::uint32_t r) {
      return r == RMP_NONE ? std::string("no robot by name") : std::string(name(r));
    };
    remarks_.push_back({RMP_FAULT_ERROR, m.span,
                        "a program of " + std::string(title_) +
                            " moves one robot: this motion belongs to " + words(who) +
                            ", and that in line " + std::to_string(first_.at(before_).line) +
                            " of " + words(before_),
                        kHint});
  }
  void take_out(rmp_code_motion& m) {
    if (!named(m)) return;
    const auto begin = static_cast<std::uint32_t>(t_.attributes.size());
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      const rmp_code_attribute a = t_.attributes[m.first_attribute + k];
      if (a.attribute != RMP_ATTR_ACT_ROB) {
        t_.attributes.push_back(a);
        continue;
      }
      // Nothing names the robot any more.
      rmp_code_expression& e = t_.expressions[a.value];
      const std::uint32_t constant = t_.integer(1, RMP_TYPE_BOOL);
      const rmp_span span = e.span;
      e = {};
      e.op = RMP_EXPR_LITERAL;
      e.type = RMP_TYPE_BOOL;
      e.symbol = RMP_NONE;
      e.constant = constant;
      e.span = span;
    }
    m.first_attribute = begin;
    m.attribute_count = static_cast<std::uint32_t>(t_.attributes.size()) - begin;
  }

  std::string_view title_;
  std::vector<Remark>& remarks_;
  std::vector<bool> mentioned_;
  std::map<std::uint32_t, rmp_span> first_;  ///< first motions by robot; RMP_NONE = not named
  std::uint32_t before_ = RMP_NONE;          ///< whose the very first is
};

}  // namespace

void to_one_robot(ProgramTables& t, std::string_view title, std::vector<Remark>& remarks) {
  OneRobot(t, title, remarks).run();
}

}  // namespace robomosp::program_post
