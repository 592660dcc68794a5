// SPDX-License-Identifier: Apache-2.0
// G-code (RS274): .ngc, .nc, .tap, .gcode.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

struct Word {
  char letter;
  double value;
  At at;
};

class GcodeReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    name_ = std::string(stem(files_[0].name));
    is_printer_ = extension(files_[0].name) == "gcode";
    const std::string_view text = files_[0].text;
    std::size_t at = 0;
    std::uint32_t line = 1;
    comment_file_ = static_cast<std::uint32_t>(-1);
    while (at < text.size() && !is_over_) {
      std::size_t end = text.find('\n', at);
      if (end == std::string_view::npos) end = text.size();
      const At from{0, line, 1, static_cast<std::uint32_t>(at), static_cast<std::uint32_t>(end)};
      statement(from, [&] { block(text.substr(at, end - at), from); });
      if (is_cancelled()) return;
      at = end + 1;
      ++line;
    }
    if (is_over_ && at < text.size() &&
        text.find_first_not_of(" \t\r\n%", at) != std::string_view::npos)
      note({0, line, 1, static_cast<std::uint32_t>(at), static_cast<std::uint32_t>(at)},
           "text after the end of the program is not read");
    // Programs of printers have no such word.
    const std::size_t last = text.find_last_not_of(" \t\r\n");
    if (!is_over_ && !is_printer_ && last != std::string_view::npos && text[last] != '%') {
      const auto end = static_cast<std::uint32_t>(last + 1);
      const auto before = text.substr(0, last);
      const std::size_t begin =
          before.rfind('\n') == std::string_view::npos ? 0 : before.rfind('\n') + 1;
      warn({0, 1 + static_cast<std::uint32_t>(std::count(before.begin(), before.end(), '\n')),
            static_cast<std::uint32_t>(last - begin + 1), end - 1, end},
           "the program has no end (M2, M30 or %)", "Check that the file is complete.");
    }
  }

 private:
  Ex primary() override { return failed(); }

  void block(std::string_view l, const At& from) {
    std::vector<Word> words;
    std::size_t i = 0;
    const auto place_of = [&](std::size_t k) {
      return At{0, from.line, static_cast<std::uint32_t>(k + 1),
                static_cast<std::uint32_t>(from.begin + k), from.end};
    };
    while (i < l.size()) {
      const char c = l[i];
      if (c == ' ' || c == '\t' || c == '\r') {
        ++i;
        continue;
      }
      if (c == ';') {
        say(l.substr(i + 1), from);
        break;
      }
      if (c == '(') {
        const std::size_t end = l.find(')', i);
        if (end == std::string_view::npos) warn(place_of(i), "this comment does not end");
        say(l.substr(i + 1, end == std::string_view::npos ? end : end - i - 1), from);
        if (end == std::string_view::npos) break;
        i = end + 1;
        continue;
      }
      if (c == '%' || (c == '/' && words.empty())) {
        if (c == '/') warn(place_of(i), "an optional block (/) is always executed in IRL");
        ++i;
        continue;
      }
      const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
      const char letter = is_letter && c >= 'a' ? static_cast<char>(c - 32) : c;
      std::size_t k = i + 1;
      while (k < l.size() && (l[k] == ' ' || l[k] == '\t')) ++k;
      if (k < l.size() && l[k] == '+') ++k;
      double v = 0;
      const auto r =
          std::from_chars(l.data() + k, l.data() + l.size(), v, std::chars_format::fixed);
      if (!is_letter || letter == 'O' || r.ec != std::errc() || r.ptr == l.data() + k) {
        bad(place_of(i),
            letter == 'O' || c == '#' || (k < l.size() && (l[k] == '#' || l[k] == '['))
                ? "parameters, expressions and subroutines of G-code are not read"
                : "a word must be a letter and a number",
            "Expand the program with its interpreter first, so that it contains plain motions "
            "only.");
        return;
      }
      if (!(std::fabs(v) < 1e9)) {
        bad(place_of(i), "this number is out of range");
        return;
      }
      words.push_back({letter, v, place_of(i)});
      i = static_cast<std::size_t>(r.ptr - l.data());
    }
    if (!words.empty()) act(words, from);
  }
  void say(std::string_view s, const At& at) {
    std::string clean;
    for (const char c : s)
      clean += c == '{' ? '(' : c == '}' ? ')' : static_cast<unsigned char>(c) < 32 ? ' ' : c;
    if (clean.find_first_not_of(' ') != std::string::npos) emit("{ " + clean + " }", at);
  }
  static const Word* find_word(const std::vector<Word>& words, char letter) {
    for (const Word& w : words)
      if (w.letter == letter) return &w;
    return nullptr;
  }
  /// False, with a fault, if the line has a word that none of its codes uses.
  bool uses_all_words(const std::vector<Word>& words) {
    const auto has_g = [&](std::initializer_list<double> codes) {
      return std::any_of(words.begin(), words.end(), [&](const Word& w) {
        return w.letter == 'G' && std::find(codes.begin(), codes.end(), w.value) != codes.end();
      });
    };
    int mode = mode_;
    for (const Word& w : words)
      if (w.letter == 'G' && (w.value == 0 || w.value == 1 || w.value == 2 || w.value == 3))
        mode = static_cast<int>(w.value);
    const bool is_arc = mode >= 2, is_dwell = has_g({4});
    const bool is_input = find_m(words, 66);
    const bool is_output =
        find_m(words, 62) || find_m(words, 63) || find_m(words, 64) || find_m(words, 65);
    for (const Word& w : words) {
      bool is_used = true;
      switch (w.letter) {
        case 'I':
        case 'J':
        case 'K':
        case 'R': is_used = is_arc; break;
        case 'P': is_used = is_dwell || is_input || is_output || has_g({64}) || is_arc; break;
        case 'Q': is_used = is_input || has_g({64}); break;
        case 'L': is_used = is_input; break;
        case 'D':
        case 'H': is_used = false; break;
        default: break;
      }
      if (is_used) continue;
      bad(w.at,
          std::string(1, w.letter) + number(w.value) + " does not belong to any code of this line");
      return false;
    }
    return true;
  }
  void act(const std::vector<Word>& words, const At& at) {
    bool has_dwell = false;
    for (const Word& w : words) {
      if (w.letter != 'G') continue;
      const int g = static_cast<int>(std::lround(w.value * 10));
      switch (g) {
        case 0:
        case 10:
        case 20:
        case 30: mode_ = g / 10; break;
        case 40: has_dwell = true; break;
        case 170: plane_ = 0; break;
        case 180: plane_ = 1; break;
        case 190: plane_ = 2; break;
        case 200: unit_ = 25.4; break;
        case 210: unit_ = 1; break;
        case 900: is_absolute_ = true; break;
        case 910: is_absolute_ = false; break;
        case 901: is_arc_absolute_ = true; break;
        case 911: is_arc_absolute_ = false; break;
        case 800:  // ends a cycle, and whatever moves
          mode_ = -1;
          break;
        case 940:  // feed a minute
        case 400:
        case 490:
        case 540:
        case 970:
        case 980:
        case 990: break;
        case 610:
        case 611:
          blend_ = 0;
          passes_ = false;
          break;
        case 640: {
          const Word* p = find_word(words, 'P');
          blend_ = p ? p->value * unit_ : 0;
          passes_ = !p;
          break;
        }
        case 920:
        case 921:
        case 922:
        case 923:
        case 100:
        case 280:
        case 300:
        case 281:
        case 301:
        case 530:
          bad(w.at, "offsets and homes of the machine (G" + number(w.value) + ") are not read");
          return;
        case 550:
        case 560:
        case 570:
        case 580:
        case 590:
        case 591:
        case 592:
        case 593:
          bad(w.at, "the work coordinates G" + number(w.value) + " are set on the machine",
              "Write the program in those of G54.");
          return;
        default:
          // What moves until another code does, as cycles do, is no G0 to G3.
          if (g == 331 || g == 330 || (g >= 380 && g < 390) || (g >= 50 && g < 60) || g == 730 ||
              g == 760 || (g > 800 && g < 900))
            mode_ = -1;
          bad(w.at, "G" + number(w.value) + " is not read");
          return;
      }
    }
    for (const Word& w : words)
      if (w.letter == 'M' && !is_read_m(static_cast<int>(std::lround(w.value)))) {
        bad(w.at, "M" + number(w.value) + " is not read");
        return;
      }
    if (!uses_all_words(words)) return;
    std::array<double, 6> to = at_place_;
    std::array<bool, 6> is_given{};
    static constexpr char kAxes[] = {'X', 'Y', 'Z', 'A', 'B', 'C'};
    bool moves = false;
    for (const Word& w : words) {
      for (std::size_t a = 0; a < 6; ++a) {
        if (w.letter != kAxes[a]) continue;
        if (is_given[a]) {
          bad(w.at, "the axis appears twice in this line");
          return;
        }
        is_given[a] = moves = true;
        const double v = a < 3 ? w.value * unit_ : w.value;
        to[a] = is_absolute_ ? v : at_place_[a] + v;
        if (a >= 3) learned_.flags.insert("turns");
      }
      if (w.letter == 'F') feed_ = w.value * unit_ / 60;
      if (w.letter == 'U' || w.letter == 'V' || w.letter == 'W') {
        bad(w.at, "the axes U, V and W are not read");
        return;
      }
      if (w.letter == 'E' && !std::exchange(told_extruder_, true))
        fail(w.at, "IRL has no extruder (E); it is left out here and in all later lines");
      if (w.letter == 'T' && !find_m(words, 6)) note(w.at, "the tool is not changed without M6");
    }
    if (find_word(words, 'F') && feed_ <= 0) {
      bad(at, "a feed must be above zero");
      return;
    }
    // In the order of RS274: switches, dwell, motion, stop.
    if (const Word* s = has_dwell ? nullptr : find_word(words, 'S')) spindle_speed(*s);
    for (const Word& w : words)
      if (w.letter == 'M' && !switches(w, words)) return;
    if (has_dwell) {
      const Word* p = find_word(words, 'P');
      const Word* s = find_word(words, 'S');
      const double t = s ? s->value : p ? p->value * (is_printer_ ? 0.001 : 1) : -1;
      if (!s && p && !is_printer_ && p->value >= 10 && !std::exchange(told_dwell_, true))
        warn(p->at, "P of a dwell is taken as seconds, as in LinuxCNC and Grbl",
             "Fanuc and similar controls use milliseconds; divide it by 1000 for these.");
      if (t < 0) bad(at, "a dwell needs a time");
      else emit("WAIT " + number_text(t) + " SEC;", at);
      return;
    }
    // An arc that says its centre and no end goes all the way round to where it began
    // (RS274/NGC, 3.5.3).
    const bool has_centre = find_word(words, 'I') || find_word(words, 'J') || find_word(words, 'K');
    if (moves || (mode_ >= 2 && (has_centre || find_word(words, 'R'))))
      motion(to, is_given, words, at);
    for (const Word& w : words) {
      if (w.letter != 'M') continue;
      const int m = static_cast<int>(w.value);
      if (m == 0 || m == 1 || m == 60) emit("PAUSE;", at);
      if (m == 2 || m == 30) {
        emit("RETURN;", at);
        is_over_ = true;
      }
    }
  }
  static bool is_read_m(int m) {
    static const std::set<int> kRead{0, 1, 2, 30, 60, 48, 49, 3, 4, 5, 7, 8, 9, 62, 63, 64, 65, 66};
    return kRead.contains(m);
  }
  static bool find_m(const std::vector<Word>& words, double m) {
    for (const Word& w : words)
      if (w.letter == 'M' && w.value == m) return true;
    return false;
  }
  static std::string number(double v) {
    std::string s = number_text(v);
    if (s.ends_with(".0")) s.resize(s.size() - 2);
    return s;
  }
  /// S: revolutions a minute.
  void spindle_speed(const Word& s) {
    if (s.value < 0) {
      bad(s.at, "a spindle speed must not be negative");
      return;
    }
    const Symbol& out = named_signal("spindle_speed", true, kReal, s.at, 1005);
    if (!std::exchange(told_spindle_, true))
      note(s.at, "spindle_speed is taken as output 1005, in 1/min");
    emit(out.irl + " := " + real(s.value).s + ";", s.at);
  }
  void switch_output(const char* name, int n, bool on, const At& at) {
    Symbol* s = find(name);
    if (!s) {
      s = &declare(name, kBool, Symbol::output);
      signals_.push_back({"OUTPUT BOOL: " + s->irl + " AT " + std::to_string(n) + ";", at, true});
      note(at, std::string(name) + " is taken as output " + std::to_string(n));
    }
    emit(s->irl + (on ? " := TRUE;" : " := FALSE;"), at);
  }
  bool switches(const Word& w, const std::vector<Word>& words) {
    const Word* p = find_word(words, 'P');
    const int m = static_cast<int>(std::lround(w.value));
    switch (m) {
      case 0:
      case 1:
      case 2:
      case 30:
      case 60:
      case 48:
      case 49: return true;
      case 3:
      case 4:
      case 5:
        if (m == 4) learned_.flags.insert("spindle turns back");
        if (learned_.flags.contains("spindle turns back"))
          switch_output("spindle_back", 1004, m == 4, w.at);
        switch_output("spindle", 1001, m != 5, w.at);
        return true;
      case 7:
      case 8:
        switch_output(m == 7 ? "mist" : "flood", m == 7 ? 1002 : 1003, true, w.at);
        return true;
      case 9:
        switch_output("mist", 1002, false, w.at);
        switch_output("flood", 1003, false, w.at);
        return true;
      case 62:
      case 63:
      case 64:
      case 65: {
        if (!p || p->value < 0 || p->value > 10000) break;
        const Symbol& s = signal(true, static_cast<std::int64_t>(p->value));
        emit(s.irl + (m % 2 == 0 ? " := TRUE;" : " := FALSE;"), w.at);
        return true;
      }
      case 66: {
        const Word* how = find_word(words, 'L');
        const Word* q = find_word(words, 'Q');
        if (!p || p->value < 0 || p->value > 10000 || !how || (how->value != 3 && how->value != 4))
          break;
        const Symbol& s = signal(false, static_cast<std::int64_t>(p->value));
        // Q has to be there: a million seconds and more are a wait without an end.
        if (q && q->value >= 1e6)
          note(w.at, "a wait of " + number(q->value) + " s is taken as an unlimited wait");
        emit("WAIT FOR " + s.irl + (how->value == 3 ? " = TRUE" : " = FALSE") +
                 (q && q->value > 0 && q->value < 1e6 ? " TIMEOUT " + number_text(q->value)
                                                      : std::string()) +
                 ";",
             w.at);
        return true;
      }
      default: break;
    }
    bad(w.at, "M" + number(w.value) + " is not read without its P, L and Q");
    return false;
  }
  Ex target_at(const std::array<double, 6>& p) {
    std::vector<Ex> xyz;
    for (std::size_t a = 0; a < 3; ++a) {
      if (is_known_[a]) {
        xyz.push_back(measure(p[a]));
        continue;
      }
      // From where the robot is, by the step of this line.
      const std::string now =
          std::string("R_ROBTARGET_ACT.PSE.POS.") + static_cast<char>('X' + static_cast<char>(a));
      const double by = p[a] - at_place_[a];
      xyz.push_back(
          by == 0 ? value(now, kReal)
                  : value(now + (by < 0 ? " - " : " + ") + measure(std::fabs(by)).s, kReal, kSum));
    }
    if (!learned_.flags.contains("turns")) return position(xyz);
    return pose(xyz, orientation("ORIZYX", {measure(p[5]), measure(p[4]), measure(p[3])}));
  }
  void finish_motion(Motion m, const At& at) {
    if (m.word != "PTP") {
      if (feed_ > 0) m.attributes.emplace_back("SPEED", measure(feed_));
      else if (!std::exchange(told_feed_, true))
        warn(at, "no F is given before this motion", "R_SPEED counts.");
      if (blend_ > 0) m.attributes.emplace_back("C_CP", measure(blend_));
      if (passes_) m.attributes.emplace_back("C_PASS", boolean(true));
    }
    move(std::move(m), at);
  }
  void motion(const std::array<double, 6>& to, const std::array<bool, 6>& is_given,
              const std::vector<Word>& words, const At& at) {
    if (mode_ < 0) {
      bad(at, "no G0, G1, G2 or G3 sets the type of this motion");
      return;
    }
    const bool is_start_known = is_known_[0] && is_known_[1] && is_known_[2];
    for (std::size_t a = 0; a < 3; ++a) {
      if (is_given[a] && is_absolute_) is_known_[a] = true;
      if (!is_known_[a] && !std::exchange(told_start_, true))
        note(at, "the program has not set X, Y and Z before: the robot's present position applies");
    }
    if (mode_ < 2) {
      Motion m;
      m.word = mode_ == 0 ? "PTP" : "LIN";
      m.targets.push_back(target_at(to));
      finish_motion(std::move(m), at);
    } else {
      if (is_start_known) arc(to, words, at);
      else
        bad(at, "the start of this arc is unknown",
            "Give X, Y and Z with G90 before the first arc.");
    }
    at_place_ = to;  // also where the line was not read
  }
  void arc(const std::array<double, 6>& to, const std::vector<Word>& words, const At& at) {
    Motion m;
    // The axes of the plane, and the one across.
    static constexpr std::size_t kPlanes[3][3] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}};
    static constexpr char kCentre[] = {'I', 'J', 'K'};
    const std::size_t u = kPlanes[plane_][0], v = kPlanes[plane_][1], n = kPlanes[plane_][2];
    const bool is_clockwise = mode_ == 2;
    double cu = at_place_[u], cv = at_place_[v];
    if (to[n] != at_place_[n]) {
      bad(at, "a helix has no counterpart in IRL", "Write it as short line segments.");
      return;
    }
    if (find_word(words, 'P')) {
      bad(at, "arcs of several turns are not read");
      return;
    }
    const Word* wu = find_word(words, kCentre[u]);
    const Word* wv = find_word(words, kCentre[v]);
    const Word* radius = find_word(words, 'R');
    if (radius) {
      const double du = to[u] - cu, dv = to[v] - cv, d = std::hypot(du, dv);
      const double r = std::fabs(radius->value) * unit_;
      if (d == 0 || d > 2 * r * (1 + 1e-6)) {
        bad(at, "no arc with this radius reaches the end point");
        return;
      }
      const double h = std::sqrt(std::max(0.0, r * r - d * d / 4));
      const double side = (is_clockwise == (radius->value > 0)) ? -1 : 1;
      cu += du / 2 - side * h * dv / d;
      cv += dv / 2 + side * h * du / d;
    } else if (wu || wv) {
      cu = (is_arc_absolute_ ? 0 : cu) + (wu ? wu->value * unit_ : is_arc_absolute_ ? cu : 0);
      cv = (is_arc_absolute_ ? 0 : cv) + (wv ? wv->value * unit_ : is_arc_absolute_ ? cv : 0);
    } else {
      bad(at, "an arc needs its centre (I, J, K) or its radius (R)");
      return;
    }
    const double r0 = std::hypot(at_place_[u] - cu, at_place_[v] - cv),
                 r1 = std::hypot(to[u] - cu, to[v] - cv);
    if (r0 == 0 || std::fabs(r0 - r1) > 0.01 + 0.001 * r0) {
      bad(at, "start and end of this arc have different distances from its centre");
      return;
    }
    const double a0 = std::atan2(at_place_[v] - cv, at_place_[u] - cu);
    double sweep = std::atan2(to[v] - cv, to[u] - cu) - a0;
    constexpr double kTurn = 6.283185307179586;
    if (is_clockwise && sweep >= -1e-9) sweep -= kTurn;
    if (!is_clockwise && sweep <= 1e-9) sweep += kTurn;
    const auto on_arc = [&](double part) {
      std::array<double, 6> p = to;
      for (std::size_t a = 3; a < 6; ++a) p[a] = at_place_[a] + part * (to[a] - at_place_[a]);
      p[u] = cu + r0 * std::cos(a0 + part * sweep);
      p[v] = cv + r0 * std::sin(a0 + part * sweep);
      return p;
    };
    // Three points make an arc of IRL; one of a whole turn is two.
    const bool is_whole = std::fabs(sweep) > 6.2;
    if (is_whole) {
      Motion half;
      half.word = "CIRCLE";
      half.targets = {target_at(on_arc(0.25)), target_at(on_arc(0.5))};
      finish_motion(std::move(half), at);
    }
    m.word = "CIRCLE";
    m.targets = {target_at(on_arc(is_whole ? 0.75 : 0.5)), target_at(to)};
    finish_motion(std::move(m), at);
  }

  int mode_ = -1, plane_ = 0;
  double unit_ = 1, feed_ = 0, blend_ = 0;
  bool is_absolute_ = true, is_arc_absolute_ = false, passes_ = false, is_over_ = false,
       is_printer_ = false;
  bool told_extruder_ = false, told_spindle_ = false, told_feed_ = false, told_dwell_ = false,
       told_start_ = false;
  std::array<double, 6> at_place_{};
  std::array<bool, 3> is_known_{};
};

}  // namespace

Made read_gcode(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<GcodeReader>(task, params, progress);
}

}  // namespace robomosp::readers
