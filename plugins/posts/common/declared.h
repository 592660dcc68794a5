// SPDX-License-Identifier: Apache-2.0
// DeclaredWriter: shared by posts of languages with records and arrays (KRL, RAPID): elements
// counted from 1 in one pair of brackets, initial values, branches of CASE, helper routines (layer:
// plugin helper).
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_writer.h>

namespace robomosp::post {

/// A routine that is written if its name is called.
struct Helper {
  const char* name;
  const char* text;
};

class DeclaredWriter : public Writer {
 public:
  /// Syntax of elements and assignments: a[1] and "=" or a{1} and ":=" with ";".
  struct Spelling {
    char open, close;
    const char *assign, *end, *record;  ///< record: name of one that has none
    int index;                          ///< precedence of an index for appended terms
  };
  DeclaredWriter(const PostTask& task, PostOutput& output, const PostCapabilities& capabilities,
                 Progress& progress, const Spelling& spelling)
      : Writer(task, output, capabilities, progress), spelling_(spelling) {}

 protected:
  /// Initialises an array with the value of another one.
  virtual void begins_with(const std::string& to, std::uint32_t value) = 0;
  virtual std::string zero(std::uint32_t type) = 0;
  virtual std::string first_value(std::uint32_t value) = 0;
  /// The text of a place.
  virtual std::string place(std::uint32_t e) = 0;

  std::string struct_name(std::uint32_t t) {
    return names_.of((1ULL << 41U) + t, *type(t).name ? type(t).name : spelling_.record);
  }
  std::string dimensions(std::uint32_t t) {
    std::string out;
    int n = 0;
    for (; type(t).kind == RMP_TYPE_ARRAY; t = type(t).element, ++n)
      out += (n ? "," : "") + std::to_string(std::int64_t{type(t).upper} - type(t).lower + 1);
    if (n > 3) cannot("arrays of more than three dimensions");
    return n ? spelling_.open + out + spelling_.close : "";
  }
  void set(const std::string& to, const std::string& value) {
    line(to + spelling_.assign + value + spelling_.end);
  }
  /// Assigns a variable its initial value.
  void initial(const std::string& to, std::uint32_t t, std::uint32_t value) {
    constexpr std::int64_t kMost = 10000;
    const auto& x = type(t);
    const bool is_made = value != RMP_NONE && expression(value).op == RMP_EXPR_MAKE;
    const auto of = is_made ? links(expression(value).first, expression(value).count)
                            : std::span<const std::uint32_t>();
    if (x.kind == RMP_TYPE_ARRAY) {
      const std::int64_t n = std::int64_t{x.upper} - x.lower + 1;
      if (n > kMost) {
        fail("an array of " + std::to_string(n) + " elements would be assigned one by one",
             "At most 10000 are supported.");
        return;
      }
      if (value != RMP_NONE && !is_made) {
        begins_with(to, value);
        return;
      }
      const std::string start =
          to.back() == spelling_.close ? to.substr(0, to.size() - 1) + "," : to + spelling_.open;
      for (std::int64_t i = 0; i < n; ++i)
        initial(
            start + std::to_string(i + 1) + spelling_.close, x.element,
            static_cast<std::size_t>(i) < of.size() ? of[static_cast<std::size_t>(i)] : RMP_NONE);
      return;
    }
    if (x.kind == RMP_TYPE_RECORD && x.role == RMP_ROLE_NONE && (is_made || value == RMP_NONE)) {
      for (std::uint32_t k = 0; k < x.field_count; ++k)
        initial(to + "." + field_name(t, k), field_row(x.first_field + k).type,
                k < of.size() ? of[k] : RMP_NONE);
      return;
    }
    set(to, value == RMP_NONE ? zero(t) : first_value(value));
  }
  /// Initial values of the declarations in this routine.
  void set_initial(std::uint32_t r) {
    for (const std::uint32_t s : std::exchange(init_, {})) {
      at_ = symbol(s).span;
      initial(name(s), symbol(s).type, symbol(s).value);
    }
    at_ = routine(r).span;
  }
  /// a[i][j] is a[i,j], counted from 1.
  std::string indexed(std::uint32_t e) {
    std::vector<std::uint32_t> chain;
    while (expression(e).op == RMP_EXPR_INDEX) {
      chain.push_back(e);
      e = links(expression(e).first, expression(e).count)[0];
    }
    if (type(expression(e).type).kind != RMP_TYPE_ARRAY) {
      cannot("elements of " + type_name(expression(e).type));
      return "0";
    }
    std::string out = place(e) + spelling_.open;
    for (std::size_t k = chain.size(); k-- > 0;) {
      const auto& x = expression(chain[k]);
      const auto of = links(x.first, x.count);
      const std::int64_t shift = 1 - std::int64_t{type(expression(of[0]).type).lower};
      if (const auto value = known(of[1]))
        out += std::to_string(static_cast<std::int64_t>(*value) + shift);
      else if (shift == 0) out += text(of[1]);
      else
        out += within(expr(of[1]), spelling_.index) + (shift > 0 ? "+" : "-") +
               std::to_string(shift > 0 ? shift : -shift);
      out += k ? ',' : spelling_.close;
    }
    return out;
  }
  Text index(std::uint32_t, std::uint32_t, const rmp_code_expression& x) override {
    return {indexed(row_of(x))};
  }
  [[nodiscard]] std::uint32_t row_of(const rmp_code_expression& x) const {
    return static_cast<std::uint32_t>(
        static_cast<std::size_t>(reinterpret_cast<const char*>(&x) -
                                 static_cast<const char*>(c_.expressions.rows)) /
        c_.expressions.row_size);
  }
  /// Branches of CASE are indented deeper than its first and last line.
  void case_opens(const std::string& head) {
    line(head);
    arms_.push_back(false);
  }
  void arm(const std::string& head) {
    if (arms_.back()) out_->out();
    open(head);
    arms_.back() = true;
  }
  void case_closes(const std::string& tail) {
    if (arms_.back()) out_->out();
    arms_.pop_back();
    line(tail);
  }
  /// True if any motion has this attribute itself: in a loop, settings of later motions apply to
  /// earlier ones.
  [[nodiscard]] bool is_anywhere(std::uint32_t attribute) const {
    for (std::uint32_t i = 0; i < c_.attributes.count; ++i)
      if (row<rmp_code_attribute>(c_.attributes, i).attribute == attribute) return true;
    return false;
  }
  /// Adds the helpers called in the text, and those they need: the second of a pair.
  static void add_helpers(const std::string& used, std::span<const Helper> all,
                          std::span<const std::pair<const char*, const char*>> needs, File& to) {
    std::set<std::string> wanted;
    for (const Helper& h : all)
      if (used.find(std::string(h.name) + "(") != std::string::npos) wanted.insert(h.name);
    for (const auto& [one, other] : needs)
      if (wanted.contains(one)) wanted.insert(other);
    for (const Helper& h : all) {
      if (!wanted.contains(h.name)) continue;
      to.add("");
      to.add_lines(h.text);
    }
  }
  static std::string joined(const File& f) {
    std::string all;
    for (const std::string& l : f.lines()) all += l + "\n";
    return all;
  }

  std::vector<std::uint32_t> init_;  ///< declared, and not yet set

 private:
  Spelling spelling_;
  std::vector<bool> arms_;  ///< of the enclosing CASEs: whether a branch is open
};

}  // namespace robomosp::post
