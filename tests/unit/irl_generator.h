// SPDX-License-Identifier: Apache-2.0
// Random programs in IRL, typed, for tests.
#pragma once

#include <cstddef>
#include <random>
#include <string>

namespace robomosp::irl {

class Generator {
 public:
  explicit Generator(std::mt19937& random) : random_(random) {}
  std::string program() {
    std::string out =
        "program Q; const int: N := 3, M := -4; type record real: x, y; endrecord: Rectangle;"
        "var int: i, k; real: r; bool: b; array [1..N] of int: a; Rectangle: rec;"
        "pose: pz; string: s;";
    out += "function f (in int: p, q; inout real: z): int; begin if p > q then return " + whole(2) +
           "; else return q; endif; endfct;";
    out += "procedure g; var int: local; begin local := 1; " + block(2) + " endproc;";
    return out + "begin " + block(3) + " endprogram;";
  }

 private:
  std::size_t pick(std::size_t n) { return random_() % n; }
  std::string block(int depth) {
    std::string out;
    for (std::size_t n = pick(4); n > 0; --n) out += statement(depth) + " ";
    return out;
  }
  std::string statement(int depth) {
    switch (pick(depth > 0 ? 14 : 7)) {
      case 0: return "i := " + whole(3) + ";";
      case 1: return "r := " + real(3) + ";";
      case 2: return "b := " + truth(3) + ";";
      case 3: return "a[" + std::to_string(1 + pick(3)) + "] := " + whole(2) + ";";
      case 4: return "rec.x := " + real(2) + ";";
      case 5: return "wait " + std::to_string(pick(9)) + ".5 sec;";
      case 6:
        return "move lin pz speed := " + std::to_string(1 + pick(500)) + ".0" +
               (pick(2) ? " until " + truth(1) : "") + ";";
      case 7:
        return "if " + truth(2) + " then " + block(depth - 1) + "elsif " + truth(1) + " then " +
               block(depth - 1) + "else " + block(depth - 1) + "endif;";
      case 8: return "while " + truth(2) + " " + block(depth - 1) + "endwhile;";
      case 9:
        return "for i := " + whole(1) + " downto " + whole(1) + " step 2 " + block(depth - 1) +
               "endfor;";
      case 10: return "repeat " + block(depth - 1) + "until " + truth(2) + ";";
      case 11: return "loop " + block(depth - 1) + "exit; endloop;";
      case 12:
        return "case " + whole(1) + " of when 1, 2: " + block(depth - 1) +
               "when 3: " + block(depth - 1) + "default: " + block(depth - 1) + "endcase;";
      default: return "k := f(" + whole(1) + ", " + whole(1) + ", r);";
    }
  }
  std::string whole(int depth) {
    static const char* const kOps[] = {" + ", " - ", " * "};
    switch (pick(depth > 0 ? 7 : 4)) {
      case 0: return std::to_string(pick(20));
      case 1: return "i";
      case 2: return "a[k]";
      case 3: return "N";
      case 4: return whole(depth - 1) + kOps[pick(3)] + whole(depth - 1);
      case 5: return "(" + whole(depth - 1) + " - k) div (k + 2)";
      default: return "-" + whole(0);
    }
  }
  std::string real(int depth) {
    switch (pick(depth > 0 ? 6 : 3)) {
      case 0: return std::to_string(pick(20)) + "." + std::to_string(pick(100));
      case 1: return "rec.y";
      case 2: return "1.5e-3";
      case 3: return real(depth - 1) + " / (r + 1.25)";
      case 4: return "sin(" + real(depth - 1) + ")";
      default: return real(depth - 1) + " + " + whole(depth - 1);
    }
  }
  std::string truth(int depth) {
    switch (pick(depth > 0 ? 6 : 2)) {
      case 0: return "b";
      case 1: return "TRUE";
      case 2: return whole(1) + " <= " + real(1);
      case 3: return truth(depth - 1) + " and " + truth(depth - 1);
      case 4: return truth(depth - 1) + " or (" + truth(depth - 1) + ")";
      default: return "(not " + truth(depth - 1) + ")";
    }
  }
  std::mt19937& random_;
};

}  // namespace robomosp::irl
