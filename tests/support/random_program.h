// SPDX-License-Identifier: Apache-2.0
// Random programs in IRL that compile, end and have values throughout: motions of all kinds with
// all attributes, signals, waits, processes, interrupts, records, arrays, lists, strings, routines
// with IN, OUT and INOUT, recursion, loops, CASE and GOTO. Each program has some of these only, so
// that every target takes a share of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <random>
#include <string>
#include <vector>

namespace robomosp::test {

class RandomProgram {
 public:
  explicit RandomProgram(std::uint32_t seed) : random_(seed) {
    static constexpr double kShares[] = {0.04, 0.12, 0.3, 0.6};
    const double share = kShares[pick(4)];
    for (bool& f : has_) f = chance(share);
    // What nearly every program has.
    for (const Part p : {kConditions, kIf, kVariables, kOutputs, kWaits})
      has_[p] = chance(0.3 + share);
    if (has_[kRecursion] || has_[kOutParameters]) has_[kRoutines] = true;
    if (has_[kLists] || has_[kStrings] || has_[kRecords] || has_[kArrays] || has_[kRoutines] ||
        has_[kLoops] || has_[kCase] || has_[kGoto] || has_[kComputed] || has_[kTruths])
      has_[kVariables] = true;
  }

  /// Names of the inputs that its flow depends on; the others are in WAIT FOR and UNTIL only.
  static constexpr std::array<const char*, 2> kFlowInputs{"mode1", "mode2"};

  std::string text() {
    const std::string main = routine_less_main();
    std::string out = "PROGRAM rnd;\nSIGNAL\n  INPUT BOOL: in1 AT 1;\n  INPUT BOOL: in2 AT 2;\n";
    if (has_[kFlow]) out += "  INPUT BOOL: mode1 AT 3;\n  INPUT BOOL: mode2 AT 4;\n";
    if (has_[kInterrupts]) out += "  INPUT BOOL: stop_wish AT 5;\n";
    out += "  OUTPUT BOOL: out1 AT 1;\n  OUTPUT BOOL: out2 AT 2;\n";
    if (has_[kGroups]) out += "  OUTPUT INT: lamp AT 4, 3;\n";
    if (has_[kAnalogue]) out += "  OUTPUT REAL: level AT 1;\n";
    if (has_[kRecords])
      out += "TYPE\n  RECORD INT: n; REAL: h; BOOL: done; POSITION: foot; ENDRECORD: SLOT;\n";
    if (has_[kConstants]) out += "CONST\n  INT: LIMIT := 4;\n  REAL: WIDE := 12.5;\n";
    out += "VAR\n  ORIENTATION: down := ORIZYX(0.0, 180.0, 0.0);\n";
    for (std::size_t k = 0; k < kPoses; ++k)
      out += "  POSE: p" + std::to_string(k) + " := " + literal_pose() + ";\n";
    out += joined({"  POSE: shift := POSE(POSITION(", number(-30, 30), ", ", number(-30, 30), ", ",
                   number(-60, 0), "), ORIZYX(", number(-20, 20), ", 0.0, 0.0));\n"});
    if (has_[kRobtargets])
      out += joined({"  ROBTARGET: t0 := ROBTARGET(", literal_pose(), ", ", std::to_string(pick(8)),
                     ", [0, 0], ADD_JOINT(0.0));\n"});
    if (has_[kJoints]) out += "  JOINT: j0 := JOINT(" + literal_joints() + ", ADD_JOINT(0.0));\n";
    if (has_[kVariables]) {
      out += joined({"  INT: i, j := ", whole_literal(), ", k := ", whole_literal(), ";\n"});
      out += joined({"  REAL: r := ", number(-9, 9), ", q := ", number(0, 9), ";\n"});
      out += "  BOOL: b, c := TRUE;\n";
    }
    if (has_[kComputed]) out += "  POSE: pv := " + literal_pose() + ";\n  POSITION: ps;\n";
    if (has_[kArrays])
      out += "  ARRAY [" + std::to_string(lower_) + ".." + std::to_string(lower_ + 3) +
             "] OF INT: a := [1, -2, 3, 5];\n" +
             (lower_ > 0 ? "  ARRAY [1..2, 0..2] OF REAL: grid;\n" : "");
    if (has_[kRecords])
      out +=
          "  SLOT: cell;\n  ARRAY [1..2] OF SLOT: cells := [SLOT(2, 0.5, FALSE, "
          "POSITION(400.0, 10.0, 200.0)), SLOT(-1, 2.25, TRUE, POSITION(420.0, -10.0, "
          "220.0))];\n";
    if (has_[kTruths]) out += "  ARRAY [0..3] OF BOOL: seen := [TRUE, FALSE, TRUE, FALSE];\n";
    if (has_[kLists]) out += "  LIST OF INT: l;\n";
    if (has_[kStrings]) out += "  STRING: s := 'ab';\n  CHAR: letter := 'k';\n";
    if (main_counters_ > 0) {
      out += "  INT: ";
      for (std::size_t n = 0; n < main_counters_; ++n) out += (n ? ", n" : "n") + std::to_string(n);
      out += ";\n";
    }
    return out + routines_ + "BEGIN\n" + main + "ENDPROGRAM;\n";
  }

 private:
  enum Part : std::size_t {
    kVariables,
    kConstants,
    kConditions,
    kIf,
    kLoops,
    kCase,
    kGoto,
    kExit,
    kArrays,
    kRecords,
    kLists,
    kStrings,
    kRoutines,
    kOutParameters,
    kRecursion,
    kPoseFunctions,
    kComputed,
    kOutputs,
    kGroups,
    kAnalogue,
    kWaits,
    kTimeouts,
    kUntil,
    kFlow,
    kProcesses,
    kInterrupts,
    kCircles,
    kPaths,
    kJoints,
    kRobtargets,
    kIncrements,
    kPositions,
    kSeveral,
    kBlends,
    kTimes,
    kTools,
    kFrames,
    kSpeeds,
    kAccelerations,
    kWeaving,
    kMessages,
    kPauses,
    kHalts,
    kMath,
    kReadOutputs,
    kSystem,
    kEffects,  // functions that change values used beside their calls
    kTruths,   // BOOL in arrays, as parameters and results, compared
    kParts
  };
  static constexpr std::size_t kPoses = 4;
  /// What is visible in a routine.
  struct Scope {
    std::vector<std::string> ints, int_places, reals, real_places, truths, truth_places, poses;
    bool is_routine = false, returns = false;
    std::string result;  ///< a statement that leaves the routine
    std::size_t counters = 0;
  };

  /// Joins the parts. Random draws are written in such lists, which are evaluated from left to
  /// right, and never on both sides of a +, so that a seed gives the same program for every
  /// compiler.
  static std::string joined(std::initializer_list<std::string> parts) {
    std::string all;
    for (const std::string& part : parts) all += part;
    return all;
  }
  /// From 0 to 1.
  double fraction() { return static_cast<double>(random_()) / 4294967295.0; }
  std::size_t pick(std::size_t n) { return random_() % n; }
  bool chance(double share) { return fraction() < share; }
  const std::string& one(const std::vector<std::string>& of) { return of[pick(of.size())]; }
  /// A number with one or two digits behind the point.
  std::string number(double lower, double upper) {
    const double v = lower + (upper - lower) * fraction();
    char text[40];
    std::snprintf(text, sizeof text, pick(2) ? "%.1f" : "%.2f", v);
    return text[0] == '-' && std::string(text).find_first_of("123456789") == std::string::npos
               ? text + 1
               : text;
  }
  std::string whole_literal() {
    return pick(4) == 0 ? "-" + std::to_string(1 + pick(9)) : std::to_string(pick(12));
  }

  // ---- geometry ----
  std::string literal_position() {
    return joined(
        {"POSITION(", number(380, 560), ", ", number(-260, 260), ", ", number(60, 330), ")"});
  }
  std::string literal_pose() {
    switch (pick(7)) {
      case 0:
        return joined({"POSE(", literal_position(), ", ORIZYX(", number(-80, 80), ", ",
                       number(150, 179), ", ", number(-25, 25), "))"});
      case 1:
        return joined({"POSE(", literal_position(), ", ORIXYZ(", number(150, 179), ", ",
                       number(-25, 25), ", ", number(-80, 80), "))"});
      case 2:
        return joined({"POSE(", literal_position(), ", ORIVANG(POSITION(0.0, 1.0, 0.0), ",
                       number(140, 180), "))"});
      case 3: return "POSE(" + literal_position() + ", ORIQUAT(0.0, 0.6, 0.8, 0.0))";
      default:
        return joined(
            {"POSE(", literal_position(), ", ORIZYX(", number(-90, 90), ", 180.0, 0.0))"});
    }
  }
  std::string literal_joints() {
    return joined({"MAIN_JOINT(", number(-90, 90), ", ", number(-80, -20), ", ", number(40, 110),
                   ", ", number(-60, 60), ", ", number(15, 80), ", ", number(-90, 90), ")"});
  }
  /// A pose that is known before it runs, or a computed one.
  std::string pose(const Scope& s, int depth) {
    const std::string known = "p" + std::to_string(pick(kPoses));
    switch (pick(9)) {
      case 0: return literal_pose();
      case 1: return depth > 0 ? pose(s, depth - 1) + " @ shift" : known;
      case 2:
        if (has_[kComputed]) return "pv";
        return known;
      case 3:
        if (has_[kComputed])
          return joined({"POSE(POSITION(", number(380, 520), " + 2.0 * ", one(s.ints), ", ",
                         number(-200, 200), ", ", number(100, 300), "), down)"});
        return known;
      case 4:
        if (has_[kPoseFunctions] && !s.is_routine)
          return joined({"spot(", std::to_string(1 + pick(3)), ", ", number(0, 90), ")"});
        return known;
      case 5:
        if (has_[kRecords] && has_[kComputed])
          return "POSE(cells[" + std::to_string(1 + pick(2)) + "].foot, down)";
        return known;
      default: return s.poses.empty() || pick(2) ? known : one(s.poses);
    }
  }

  // ---- expressions ----
  std::string integer(const Scope& s, int depth) {
    if (depth <= 0 || pick(4) == 0) {
      switch (pick(8)) {
        case 0:
        case 1: return std::to_string(pick(10));
        case 2:
          if (has_[kArrays]) return "a[" + std::to_string(lower_ + static_cast<int>(pick(4))) + "]";
          break;
        case 3:
          if (has_[kRecords])
            return pick(2) ? "cell.n" : "cells[" + std::to_string(1 + pick(2)) + "].n";
          break;
        case 4:
          if (has_[kConstants]) return "LIMIT";
          break;
        case 5:
          if (has_[kReadOutputs] && has_[kGroups]) return "lamp";
          break;
        default: break;
      }
      return one(s.ints);
    }
    const auto next = [&] { return integer(s, depth - 1); };
    switch (pick(14)) {
      case 0:
      case 1: return joined({"(", next(), " + ", next(), ")"});
      case 2: return joined({"(", next(), " - ", next(), ")"});
      case 3:
        return joined(
            {next(), " MOD ", std::to_string(2 + pick(5)), " * ", std::to_string(pick(4))});
      case 4: return joined({"(", next(), ") DIV ", std::to_string(1 + pick(6))});
      case 5: return joined({"(", next(), ") MOD ", std::to_string(2 + pick(8))});
      case 6: return "-(" + next() + ")";
      case 7:
        if (has_[kMath]) return "ABS(" + next() + ")";
        return next();
      case 8:
        if (has_[kMath]) return joined({(pick(2) ? "ROUND(" : "TRUNC("), real(s, depth - 1), ")"});
        return next();
      case 9:
        if (has_[kArrays]) return "a[" + std::to_string(lower_) + " + ABS(" + next() + " MOD 4)]";
        return next();
      case 10:
        if (has_[kLists]) return pick(2) ? "SIZEOF(l)" : "l[1 + ABS(" + next() + " MOD SIZEOF(l))]";
        return next();
      case 11:
        if (has_[kStrings]) {
          static const char* const kForms[] = {"LENGTH(s)", "COMPARE(s, 'abx')", "LOCATE(s, 'b')",
                                               "ORD(letter)"};
          return kForms[pick(4)];
        }
        return next();
      case 12:
        if (has_[kRoutines] && !s.is_routine)
          return "twice(" + next() + (has_[kEffects] ? ", j)" : ")");
        return next();
      default:
        if (has_[kRecursion] && !s.is_routine) {
          const std::string n = std::to_string(pick(6));
          switch (pick(has_[kEffects] ? 3 : 2)) {
            case 0: return "sum(" + n + ")";
            case 1: return (pick(2) ? "there(" : "back(") + n + ")";
            default: return "ways(" + n + ", k)";
          }
        }
        return next();
    }
  }
  std::string real(const Scope& s, int depth) {
    if (depth <= 0 || pick(4) == 0) {
      switch (pick(5)) {
        case 0: return number(0, 20);
        case 1:
          if (has_[kConstants]) return "WIDE";
          break;
        case 2:
          if (has_[kRecords]) return pick(2) ? "cell.h" : "cells[2].h";
          break;
        case 3:
          if (has_[kArrays] && lower_ > 0)
            return joined(
                {"grid[", std::to_string(1 + pick(2)), ", ", std::to_string(pick(3)), "]"});
          break;
        default: break;
      }
      return one(s.reals);
    }
    const auto next = [&] { return real(s, depth - 1); };
    switch (pick(8)) {
      case 0: return joined({"(", next(), " + ", next(), ")"});
      case 1: return joined({"(", next(), " - ", next(), ")"});
      case 2: return "(" + next() + ") * 0.5";
      case 3: return joined({"(", next(), ") / ", number(1, 9)});
      case 4: return "-(" + next() + ")";
      case 5: return "(" + integer(s, depth - 1) + ") / 4";
      case 6:
        if (has_[kMath]) {
          static const char* const kForms[] = {"SIN(", "COS(", "ABS(", "ATAN("};
          return joined({kForms[pick(4)], next(), ")"});
        }
        return next();
      default:
        if (has_[kMath]) return "SQRT(ABS(" + next() + "))";
        if (has_[kComputed]) return pick(2) ? "pv.POS.X / 100.0" : "ps.Y / 50.0";
        return next();
    }
  }
  std::string truth(const Scope& s, int depth) {
    if (depth <= 0 || pick(5) == 0) {
      switch (pick(6)) {
        case 0:
          if (has_[kFlow]) return kFlowInputs[pick(2)];
          break;
        case 1:
          if (has_[kReadOutputs]) return pick(2) ? "out1" : "NOT out2";
          break;
        case 2:
          if (has_[kRecords]) return "cell.done";
          break;
        case 3:
          if (has_[kStrings]) return pick(2) ? "s = 'ab'" : "letter > 'f'";
          break;
        case 4:
          if (has_[kTruths]) return "seen[ABS(" + one(s.ints) + " MOD 4)]";
          break;
        default: break;
      }
      return one(s.truths);
    }
    static const char* const kSigns[] = {" = ", " <> ", " < ", " <= ", " > ", " >= "};
    const auto next = [&] { return truth(s, depth - 1); };
    switch (pick(has_[kTruths] ? 9 : 7)) {
      case 8:
        if (has_[kRoutines] && !s.is_routine)
          return joined({"is_set(", next(), ", ", integer(s, depth - 1), ")"});
        [[fallthrough]];
      case 7: return joined({"((", next(), ")", kSigns[pick(2)], "(", next(), "))"});
      case 0:
      case 1:
      case 2: return joined({integer(s, depth - 1), kSigns[pick(6)], integer(s, depth - 1)});
      case 3: return joined({real(s, depth - 1), kSigns[2 + pick(4)], real(s, depth - 1)});
      case 4: return joined({"(", next(), (pick(2) ? " AND " : " OR "), next(), ")"});
      case 5: return "NOT (" + next() + ")";
      default:
        if (has_[kMath]) return joined({"(", next(), " EXOR ", next(), ")"});
        return joined({"(", next(), " OR ", next(), ")"});
    }
  }
  /// Of WAIT FOR and UNTIL: inputs only.
  std::string condition(int depth) {
    if (depth <= 0 || !has_[kConditions]) switch (pick(4)) {
        case 0: return "NOT in1";
        case 1: return "in2 = " + std::string(pick(2) ? "TRUE" : "FALSE");
        default: return pick(2) ? "in1" : "in2";
      }
    switch (pick(5)) {
      case 0: return joined({condition(0), " AND ", condition(0)});
      case 1: return joined({condition(0), " OR ", condition(0)});
      case 2: return "NOT (" + condition(depth - 1) + ")";
      case 3: return joined({"(", condition(0), " OR ", condition(0), ") AND ", condition(0)});
      default: return condition(0);
    }
  }

  // ---- statements ----
  std::string block(Scope& s, int most, int depth, int indent) {
    std::string out;
    for (std::size_t n = 1 + pick(static_cast<std::size_t>(most)); n > 0; --n)
      out += statement(s, depth, indent);
    return out;
  }
  std::string pad(int indent) const {
    return std::string(static_cast<std::size_t>(2 * indent), ' ');
  }
  std::string counter(Scope& s) { return "n" + std::to_string(s.counters++); }
  std::string assignment(const Scope& s, const std::string& p) {
    switch (pick(10)) {
      case 0: return joined({p, one(s.real_places), " := ", bounded_real(s), ";\n"});
      case 1: return joined({p, one(s.truth_places), " := ", truth(s, 2), ";\n"});
      case 2:
        if (has_[kArrays])
          return joined({p, "a[",
                         (pick(2) ? std::to_string(lower_ + static_cast<int>(pick(4)))
                                  : std::to_string(lower_) + " + ABS(" + one(s.ints) + " MOD 4)"),
                         "] := ", bounded(s), ";\n"});
        break;
      case 3:
        if (has_[kRecords]) switch (pick(5)) {
            case 0: return p + "cell.n := " + bounded(s) + ";\n";
            case 1: return p + "cell := cells[" + std::to_string(1 + pick(2)) + "];\n";
            case 2: return p + "cells[1].h := " + bounded_real(s) + ";\n";
            case 3: return p + "cell.done := " + truth(s, 1) + ";\n";
            default: return p + "cells[2].foot.Z := 200.0 + 2.0 * " + one(s.ints) + ";\n";
          }
        break;
      case 4:
        if (has_[kLists]) switch (pick(4)) {
            case 0: return p + "LIST_ADD(l, " + bounded(s) + ");\n";
            case 1: return p + "LIST_INSERT(l, 1, " + bounded(s) + ");\n";
            case 2: return p + "LIST_ADD(l, 4);\n" + p + "LIST_DELETE(l, 1);\n";
            default:
              return joined({p, one(s.int_places), " := LIST_INDEX(l, ", bounded(s), ");\n"});
          }
        break;
      case 5:
        if (has_[kStrings]) switch (pick(4)) {
            case 0: return p + "s := CONCAT(s, 'x');\n";
            case 1: return p + "s := EXTRACT(CONCAT(s, 'yz'), 1, 2);\n";
            case 2: return p + "letter := CHR(97 + ABS(" + one(s.ints) + " MOD 20));\n";
            default: return p + "s[1] := 'c';\n";
          }
        break;
      case 6:
        if (has_[kComputed]) switch (pick(5)) {
            case 0: return p + "pv := " + pose(s, 1) + ";\n";
            case 1: return p + "pv.POS.Z := 200.0 + 2.0 * " + one(s.ints) + ";\n";
            case 2: return p + "ps := pv.POS;\n";
            case 3: return p + "pv := p" + std::to_string(pick(kPoses)) + " @ shift;\n";
            default:
              return joined(
                  {p, "ps := POSITION(", number(400, 500), ", ", one(s.reals), ", 200.0);\n"});
          }
        break;
      case 7:
        if (has_[kArrays] && lower_ > 0)
          return joined({p, "grid[", std::to_string(1 + pick(2)), ", ", std::to_string(pick(3)),
                         "] := ", bounded_real(s), ";\n"});
        break;
      default: break;
    }
    return joined({p, one(s.int_places), " := ", bounded(s), ";\n"});
  }
  std::string bounded(const Scope& s) { return "(" + integer(s, 3) + ") MOD 40"; }
  std::string bounded_real(const Scope& s) {
    switch (pick(3)) {
      case 0: return joined({"(", integer(s, 2), ") MOD 30 + ", number(0, 1)});
      case 1: return number(-20, 20);
      default: {
        // Within 30 of zero, whatever it is.
        const std::string x = real(s, 2);
        if (has_[kMath]) return "30.0 * SIN(" + x + ")";
        return "(" + integer(s, 2) + ") MOD 30 / 8";
      }
    }
  }
  std::string output(const Scope& s, const std::string& p) {
    switch (pick(6)) {
      case 0:
        if (has_[kGroups] && has_[kVariables])
          return p + "lamp := ABS(" + integer(s, 2) + ") MOD 8;\n";
        [[fallthrough]];
      case 1:
        if (has_[kGroups]) return p + "lamp := " + std::to_string(pick(8)) + ";\n";
        break;
      case 2:
        if (has_[kAnalogue]) return p + "level := " + number(0, 1) + ";\n";
        break;
      case 3:
        if (has_[kVariables]) return p + "out1 := " + truth(s, 2) + ";\n";
        break;
      default: break;
    }
    return joined({p, (pick(2) ? "out1" : "out2"), " := ", (pick(2) ? "TRUE" : "FALSE"), ";\n"});
  }
  std::string attributes(const Scope& s, bool is_ptp, bool may_compute) {
    std::string out;
    const auto add = [&](const std::string& name, const std::string& value) {
      out += (pick(2) ? " " : ", ") + name + " := " + value;
    };
    if (!is_ptp && chance(0.6))
      add("SPEED", has_[kSpeeds] && has_[kVariables] && may_compute && pick(3) == 0
                       ? "20.0 + ABS(" + one(s.ints) + ")"
                       : number(5, 400));
    if (is_ptp && has_[kSpeeds] && chance(0.5))
      add("SPEED_PTP", std::to_string(5 + pick(95)) + ".0");
    if (!is_ptp && has_[kSpeeds] && chance(0.3))
      add("SPEED_ORI", std::to_string(5 + pick(80)) + ".0");
    if (has_[kAccelerations] && chance(0.3))
      add(is_ptp ? "ACC_PTP" : "ACC", std::to_string(10 + pick(91)) + ".0");
    if (has_[kTimes] && chance(0.3)) add("TIME", number(1, 9));
    if (has_[kBlends] && chance(0.4)) {
      if (is_ptp) add("C_PTP", std::to_string(pick(50)) + ".0");
      else add("C_CP", std::to_string(1 + pick(9)) + ".0");
    }
    if (has_[kBlends] && chance(0.1)) add("C_PASS", pick(2) ? "TRUE" : "FALSE");
    if (has_[kWeaving] && !is_ptp && chance(0.2)) add("WOBBLE", "TRUE");
    if (has_[kTools] && chance(0.4))
      add("TOOL", "POSE(POSITION(0.0, 0.0, " + number(10, 60) + "), ORIZYX(0.0, 0.0, 0.0))");
    if (has_[kFrames] && chance(0.3))
      add("FRAME", joined({"POSE(POSITION(", number(-40, 40), ", ", number(-40, 40),
                           ", 20.0), ORIZYX(", number(-20, 20), ", 0.0, 0.0))"}));
    return out;
  }
  std::string motion(const Scope& s, const std::string& p) {
    std::string out;
    bool is_ptp = pick(2) == 0;
    if (has_[kIncrements] && chance(0.15)) {
      out = joined({p, "MOVE_INC ", (pick(4) ? "LIN" : "PTP"), " POSE(POSITION(", number(-20, 20),
                    ", ", number(-20, 20), ", ", number(-20, 20), "), ORIZYX(",
                    (pick(3) ? "0.0" : number(-9, 9)), ", 0.0, 0.0))"});
      is_ptp = out.find(" PTP ") != std::string::npos;
    } else if (has_[kCircles] && chance(0.25)) {
      // A via point away from the line to the end.
      const std::string x = number(400, 440), z = number(100, 300);
      out = joined({p,
                    "MOVE LIN POSE(POSITION(",
                    x,
                    ", -40.0, ",
                    z,
                    "), down);\n",
                    p,
                    "MOVE CIRCLE POSE(POSITION(",
                    number(460, 520),
                    ", ",
                    number(-10, 10),
                    ", ",
                    (pick(2) ? z : number(90, 310)),
                    "), down), POSE(POSITION(",
                    x,
                    ", ",
                    number(30, 90),
                    ", ",
                    z,
                    "), down)"});
      is_ptp = false;
    } else if (has_[kPaths] && chance(0.2)) {
      out = joined(
          {p, "MOVE PATH ", pose(s, 0), ", p", std::to_string(pick(kPoses)), ", ", literal_pose()});
      is_ptp = false;
    } else if (has_[kJoints] && chance(0.25)) {
      out = p + "MOVE PTP " + (pick(2) ? "j0" : literal_joints());
      is_ptp = true;
    } else if (has_[kRobtargets] && chance(0.25)) {
      out = p + "MOVE " + (is_ptp ? "PTP" : "LIN") + " t0" + (pick(3) ? "" : ".PSE @ shift");
    } else if (has_[kPositions] && chance(0.25)) {
      out = p + "MOVE " + (is_ptp ? "PTP " : "LIN ") + literal_position();
    } else {
      out = p + "MOVE " + (is_ptp ? "PTP " : "LIN ") + pose(s, 1);
      if (has_[kSeveral] && chance(0.3)) out += ", p" + std::to_string(pick(kPoses));
    }
    out += attributes(s, is_ptp, true);
    if (has_[kUntil] && chance(0.25))
      out +=
          joined({" UNTIL ", condition(1), (has_[kRoutines] && pick(12) == 0 ? " DO beep" : "")});
    return out + ";\n";
  }
  std::string statement(Scope& s, int depth, int indent) {
    const std::string p = pad(indent);
    const bool nests = depth > 0 && has_[kVariables];
    const auto inner = [&](int most) { return block(s, most, depth - 1, indent + 1); };
    switch (pick(20)) {
      case 0:
      case 1:
      case 2:
      case 3: return motion(s, p);
      case 4:
        if (has_[kOutputs]) return output(s, p);
        break;
      case 5:
      case 6:
      case 7:
        if (has_[kVariables]) return assignment(s, p);
        break;
      case 8:
        if (has_[kWaits]) {
          if (has_[kVariables] && pick(4) == 0)
            return p + "WAIT 0.1 + 0.05 * ABS(" + one(s.ints) + ") SEC;\n";
          return joined(
              {p, "WAIT ", std::to_string(pick(3)), ".", std::to_string(1 + pick(9)), " SEC;\n"});
        }
        break;
      case 9:
        return joined({p, "WAIT FOR ", condition(2),
                       (has_[kTimeouts] && pick(2) ? " TIMEOUT " + number(1, 9) : ""), ";\n"});
      case 10:
        if (nests && has_[kIf]) {
          std::string out = joined({p, "IF ", truth(s, 2), " THEN\n", inner(2)});
          if (pick(3) == 0) out += joined({p, "ELSIF ", truth(s, 1), " THEN\n", inner(1)});
          if (pick(2)) out += p + "ELSE\n" + inner(2);
          return out + p + "ENDIF;\n";
        }
        break;
      case 11:
        if (nests && has_[kLoops]) {
          const std::string n = counter(s);
          const bool is_down = pick(3) == 0;
          const std::size_t from = pick(4), count = pick(4);
          return joined({p, "FOR ", n, " := ", std::to_string(is_down ? from + count : from),
                         (is_down ? " DOWNTO " : " TO "),
                         std::to_string(is_down ? from : from + count),
                         (pick(4) == 0 ? " STEP 2" : ""), " DO\n", with(s, n, inner(2), indent), p,
                         "ENDFOR;\n"});
        }
        break;
      case 12:
        if (nests && has_[kLoops]) {
          const std::string n = counter(s), most = std::to_string(1 + pick(3));
          switch (pick(3)) {
            case 0:
              return joined({p, n, " := 0;\n", p, "WHILE ", n, " < ", most,
                             (pick(3) ? "" : " AND " + truth(s, 1)), " DO\n", p, "  ", n, " := ", n,
                             " + 1;\n", inner(2), p, "ENDWHILE;\n"});
            case 1:
              return joined({p, n, " := 0;\n", p, "REPEAT\n", p, "  ", n, " := ", n, " + 1;\n",
                             inner(2), p, "UNTIL ", n, " >= ", most,
                             (pick(3) ? "" : " OR " + truth(s, 1)), ";\n"});
            default:
              if (!has_[kExit]) return motion(s, p);
              return joined(
                  {p,        n,       " := 0;\n",  p,     "LOOP\n",  p,
                   "  ",     n,       " := ",      n,     " + 1;\n", inner(1),
                   p,        "  IF ", n,           " > ", most,      " THEN EXIT; ENDIF;\n",
                   inner(1), p,       "ENDLOOP;\n"});
          }
        }
        break;
      case 13:
        if (nests && has_[kCase])
          return joined({p, "CASE ABS(", integer(s, 1), ") MOD 5 OF\n", p, "WHEN 0:\n", inner(1), p,
                         "WHEN 1, 3:\n", inner(1), (pick(2) ? p + "DEFAULT:\n" + inner(1) : ""), p,
                         "ENDCASE;\n"});
        break;
      case 14:
        if (has_[kGoto] && has_[kVariables]) {
          const std::string label = "mark" + std::to_string(labels_++);
          if (pick(2))
            return joined({p, "IF ", truth(s, 1), " THEN GOTO ", label, "; ENDIF;\n",
                           (depth > 0 ? block(s, 2, depth - 1, indent) : motion(s, p)), p, "LABEL ",
                           label, ":\n", motion(s, p)});
          const std::string n = counter(s);
          return p + n + " := 0;\n" + p + "LABEL " + label + ":\n" + p + n + " := " + n +
                 " + 1;\n" + (depth > 0 ? block(s, 2, depth - 1, indent) : motion(s, p)) + p +
                 "IF " + n + " < 3 THEN GOTO " + label + "; ENDIF;\n";
        }
        break;
      case 15:
        if (has_[kRecursion] && !s.is_routine && pick(3) == 0)
          return p + "hop(" + std::to_string(pick(5)) + ", " + integer(s, 1) + ");\n";
        if (has_[kRoutines] && !s.is_routine) {
          switch (pick(4)) {
            case 0:
              return joined({p, "act(", integer(s, 1), ", ", number(0, 9), ", p",
                             std::to_string(pick(kPoses)), ");\n"});
            case 1:
              if (has_[kOutParameters]) return p + "change(i, " + (pick(2) ? "j" : "k") + ");\n";
              return p + "beep;\n";
            case 2: return p + "beep();\n";
            default:
              return joined({p, one(s.int_places), " := (", integer(s, 2), " + twice(",
                             integer(s, 1), (has_[kEffects] ? ", j" : ""), ")) MOD 40;\n"});
          }
        }
        break;
      case 16:
        if (has_[kMessages])
          return has_[kVariables] && pick(2) ? p + "WRITELN('at ', " + one(s.ints) + ");\n"
                                             : p + "WRITE('go');\n";
        if (has_[kPauses]) return p + (pick(2) ? "PAUSE;\n" : "PAUSE 'look';\n");
        break;
      case 17:
        if (s.is_routine && has_[kIf] && pick(2))
          return p + "IF " + truth(s, 1) + " THEN " + s.result + " ENDIF;\n";
        if (has_[kHalts] && !s.is_routine && pick(4) == 0)
          return p + "IF " + (has_[kVariables] ? truth(s, 1) : "in_never()") +
                 " THEN HALT; ENDIF;\n";
        break;
      case 18:
        if (has_[kProcesses] && !s.is_routine && indent == 1 && !is_started_) {
          is_started_ = true;
          return p + "START side;\n" + motion(s, p);
        }
        if (has_[kInterrupts] && !s.is_routine && indent == 1)
          return p + "ENABLE alarm;\n" + motion(s, p) + p + "DISABLE alarm;\n";
        break;
      case 19:
        if (has_[kSystem] && pick(2)) return p + "R_SPEED := " + number(50, 300) + ";\n";
        break;
      default: break;
    }
    return motion(s, p);
  }
  /// The body of a loop over `n`, with something that depends on it.
  std::string with(const Scope& s, const std::string& n, std::string body, int indent) {
    const std::string p = pad(indent + 1);
    if (has_[kComputed] && pick(2))
      return body + p + "MOVE LIN POSE(POSITION(420.0 + 5.0 * " + n + ", " + number(-100, 100) +
             ", 200.0), down);\n";
    if (has_[kOutputs]) return body + p + "out2 := " + n + " MOD 2 = 0;\n";
    return joined({body, p, one(s.int_places), " := (", one(s.ints), " + ", n, ") MOD 40;\n"});
  }
  Scope globals() const {
    Scope s;
    if (has_[kVariables]) {
      s.ints = s.int_places = {"i", "j", "k"};
      s.reals = s.real_places = {"r", "q"};
      s.truths = s.truth_places = {"b", "c"};
    }
    if (has_[kTruths]) {
      s.truths.emplace_back("seen[1]");
      s.truth_places.emplace_back("seen[2]");
    }
    return s;
  }
  static std::string local_counters(const Scope& s) {
    std::string out;
    for (std::size_t n = 0; n < s.counters; ++n) out += ", n" + std::to_string(n);
    return out;
  }
  std::string routine_less_main() {
    lower_ = pick(3) == 0 ? -1 : static_cast<int>(pick(3));
    if (has_[kPoseFunctions])
      routines_ +=
          "FUNCTION spot (IN INT: place; IN REAL: z): POSE;\nBEGIN\n  RETURN "
          "POSE(POSITION(400.0 + 20.0 * place, 15.0, 100.0 + z), down);\nENDFCT;\n";
    if (has_[kRecursion])
      routines_ +=
          "FUNCTION sum (IN INT: n): INT;\nBEGIN\n  IF n <= 0 THEN RETURN 0; ENDIF;\n  "
          "RETURN n + sum(n - 1);\nENDFCT;\n"
          "FUNCTION there (IN INT: n): INT;\nBEGIN\n  IF n <= 0 THEN RETURN 1; ENDIF;\n  "
          "RETURN 2 * back(n - 1) + there(n - 2);\nENDFCT;\n"
          "FUNCTION back (IN INT: n): INT;\nVAR INT: t;\nBEGIN\n  IF n <= 0 THEN RETURN 0; "
          "ENDIF;\n  t := n MOD 3;\n  RETURN there(n - 1) - t;\nENDFCT;\n";
    if (has_[kRecursion] && has_[kEffects])
      routines_ +=
          "FUNCTION ways (IN INT: n; INOUT INT: calls): INT;\nVAR INT: m, all;\nBEGIN\n"
          "  calls := (calls + 1) MOD 40;\n  IF n <= 0 THEN RETURN 1; ENDIF;\n"
          "  FOR m := 1 TO n\n    IF m < 4 THEN all := all + ways(n - m - 1, calls) * m; ENDIF;\n"
          "  ENDFOR;\n  RETURN all MOD 50;\nENDFCT;\n";
    if (has_[kRecursion])
      routines_ +=
          "PROCEDURE hop (IN INT: n; IN INT: at);\nBEGIN\n  IF n <= 0 THEN RETURN; ENDIF;\n"
          "  hop(n - 1, at + 1);\n  out1 := at MOD 2 = 0;\n  WAIT 0.1 SEC;\n" +
          std::string(has_[kComputed] ? "  MOVE LIN POSE(POSITION(400.0 + 4.0 * at, -20.0, 150.0 + "
                                        "10.0 * n), down);\n"
                                      : "") +
          "  hop(n - 2, at + 3);\nENDPROC;\n";
    if (has_[kRoutines]) {
      routines_ += std::string("FUNCTION twice (IN INT: x") +
                   (has_[kEffects] ? "; INOUT INT: w" : "") + "): INT;\nVAR INT: m;\nBEGIN\n" +
                   (has_[kEffects] ? "  w := (w + 1) MOD 9;\n  k := (k + 3) MOD 7;\n" : "") +
                   "  m := 2 * (x MOD 50);\n  RETURN m;\nENDFCT;\n";
      if (has_[kTruths])
        routines_ +=
            "FUNCTION is_set (IN BOOL: sure; IN INT: n): BOOL;\nBEGIN\n  IF sure THEN RETURN n > "
            "2; "
            "ENDIF;\n  RETURN seen[ABS(n MOD 4)] = TRUE;\nENDFCT;\n";
      routines_ +=
          "PROCEDURE beep;\nBEGIN\n  out1 := TRUE;\n  WAIT 0.2 SEC;\n  out1 := FALSE;\n"
          "ENDPROC;\n";
      Scope s = globals();
      s.is_routine = true;
      s.result = "RETURN;";
      s.ints = {"x", "m", "i"};
      s.int_places = {"m", "j"};
      s.reals = {"z", "r"};
      s.real_places = {"q"};
      s.poses = {"there"};
      const std::string body = block(s, 4, 1, 1);
      routines_ += "PROCEDURE act (IN INT: x; IN REAL: z; IN POSE: there);\nVAR INT: m" +
                   local_counters(s) + ";\nBEGIN\n  m := x MOD 7;\n" + body +
                   "  MOVE LIN there SPEED := 55.0;\nENDPROC;\n";
      if (has_[kOutParameters]) {
        Scope t = globals();
        t.is_routine = true;
        t.result = "RETURN;";
        t.ints = {"x", "y"};
        t.int_places = {"x", "y"};
        const std::string changes = block(t, 3, 1, 1);
        routines_ +=
            "PROCEDURE change (INOUT INT: x; OUT INT: y);\n" +
            (t.counters > 0 ? "VAR INT: " + local_counters(t).substr(2) + ";\n" : std::string()) +
            "BEGIN\n  y := 3;\n  x := (x + 2) MOD 9;\n" + changes + "ENDPROC;\n";
      }
    }
    if (has_[kProcesses])
      routines_ +=
          "PROCESS side PRIORITY 1;\nBEGIN\n  WAIT 0.5 SEC;\n  out2 := TRUE;\nENDPROCESS;\n";
    if (has_[kInterrupts])
      routines_ += "INTERRUPT alarm WHEN stop_wish;\nBEGIN\n  out2 := FALSE;\nENDINTERRUPT;\n";
    if (!has_[kVariables]) has_[kHalts] = false;
    Scope s = globals();
    std::string out = "  MOVE PTP p0;\n";
    if (has_[kReadOutputs])
      out += std::string("  out1 := FALSE;\n  out2 := TRUE;\n") +
             (has_[kGroups] ? "  lamp := 2;\n" : "");
    if (has_[kLists]) out += "  LIST_ADD(l, 3);\n";
    for (std::size_t n = 3 + pick(10); n > 0; --n) out += statement(s, 2, 1);
    if (has_[kVariables] && has_[kOutputs])
      out += "  out1 := i > j;\n  out2 := r > q;\n  WAIT 0.5 + 0.01 * ABS(i) SEC;\n";
    out += "  MOVE LIN p1 SPEED := 120.0;\n";
    main_counters_ = s.counters;
    return out;
  }

  std::mt19937 random_;
  std::array<bool, kParts> has_{};
  std::string routines_;
  std::size_t main_counters_ = 0, labels_ = 0;
  int lower_ = 0;
  bool is_started_ = false;
};

}  // namespace robomosp::test
