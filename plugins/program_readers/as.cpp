// SPDX-License-Identifier: Apache-2.0
// Kawasaki AS: programs, transformations and joints of a .as or .pg file.
#include <algorithm>
#include <cmath>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kAsStyle{.comment = ";",
                     .quotes = "\"",
                     .name_first = "_.$#",
                     .name_rest = "_.$#",
                     .signs = {"==", "<>", "<=", "=<", ">=", "=>"},
                     .has_lines = true,
                     .joins_in_brackets = false,
                     .hex = "^h"};
// AS Language Reference Manual, D and E series: AND before OR and XOR, comparisons before them, MOD
// behind * and /.
constexpr Binary kAsBinaries[] = {{"or", 10, Op::or_}, {"xor", 10, Op::exor}, {"and", 12, Op::and_},
                                  {"==", 20, Op::eq},  {"<>", 20, Op::ne},    {"<", 20, Op::lt},
                                  {">", 20, Op::gt},   {"<=", 20, Op::le},    {"=<", 20, Op::le},
                                  {">=", 20, Op::ge},  {"=>", 20, Op::ge},    {"+", 30, Op::add},
                                  {"-", 30, Op::sub},  {"mod", 35, Op::mod},  {"*", 40, Op::mul},
                                  {"/", 40, Op::div},  {"^", 50, Op::power}};

class AsReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    name_ = std::string(stem(files_[0].name));
    comment_file_ = 0;
    scan(0, kAsStyle);
    find_sections();
    const std::size_t main = find_main();
    if (main == programs_.size()) return;
    find_reached(main);
    for (std::size_t i = 0; i < programs_.size(); ++i)
      if (programs_[i].is_reached && i != main) announce(key_of(i), parameters(i), kNone);
    main_index_ = main;
    close();
    routine_ = main;
    declare_data();
    body(main);
    for (std::size_t i = 0; i < programs_.size(); ++i) {
      if (!programs_[i].is_reached || i == main) continue;
      if (progress_.cancelled()) return statement(here(), [] {});
      routine_ = i;
      begin(key_of(i), parameters(i), kNone, programs_[i].at);
      body(i);
      close();
    }
    learned_.flags.insert("passed");
  }

 private:
  struct Program {
    std::string name, low;
    At at;
    std::size_t first = 0, end = 0;  ///< tokens
    std::vector<Token> parameters;
    bool is_reached = false;
  };
  struct Data {
    enum Kind : std::uint8_t { places, joints, numbers, texts } kind;
    std::size_t first = 0, end = 0;
  };
  /// A variable as it is written, with its indices.
  struct Named {
    Token name;
    std::string key;  ///< of what is learned of it
    std::vector<Ex> index;
    bool is_local = false;
  };
  /// What a statement says of the next motion only.
  struct Next {
    std::optional<Ex> share, speed, time, turn, accuracy, accel, decel;
    [[nodiscard]] bool is_empty() const {
      return !share && !speed && !time && !turn && !accuracy && !accel && !decel;
    }
  };
  struct Open {
    std::string word;  ///< if, while, do, for, case, scase
    std::string step;  ///< of a FOR: the statement behind its body
    Next before;       ///< what was said of the next motion where the block begins
    bool moved = false, has_else = false, all_moved = true, says = false;
  };

  std::span<const Binary> binaries() const override { return kAsBinaries; }
  std::string_view not_word() const override { return "not"; }
  int not_precedence() const override { return 60; }

  /// A program and a variable may have one name.
  [[nodiscard]] std::string key_of(std::size_t program) const {
    return "!" + programs_[program].name;
  }
  [[nodiscard]] bool is_changed(std::size_t program, const std::string& parameter) const {
    return learned_.flags.contains("written !" + programs_[program].low + "." + parameter);
  }

  // ---- sections ----

  void find_sections() {
    std::set<std::string> others;
    for (std::size_t i = 0; i < tokens_.size();) {
      const std::size_t first = i;
      while (i < tokens_.size() && tokens_[i].kind != Tk::line && tokens_[i].kind != Tk::end) ++i;
      const std::size_t behind = i++;
      if (first == behind) continue;
      const Token& t = tokens_[first];
      if (t.low == ".end" && behind == first + 1) continue;
      if (t.low == "." && tokens_[first + 1].low == "*")
        continue;  // .* is a comment of a saved file
      std::size_t end = behind;
      if (t.low.starts_with(".") && t.low.size() > 1 && t.low != ".end") {
        // To the line .END, or to what begins the next section.
        bool begins = true;
        end = behind;
        while (end < tokens_.size() && tokens_[end].kind != Tk::end) {
          const Tk next = tokens_[std::min(end + 1, tokens_.size() - 1)].kind;
          if (begins && tokens_[end].low == ".end" && (next == Tk::line || next == Tk::end)) break;
          if (begins && tokens_[end].low == ".program") break;
          begins = tokens_[end].kind == Tk::line;
          ++end;
        }
      }
      if (t.low == ".program" || t.low == ".prog") {
        Program p;
        at_ = first + 1;
        p.at = t.at;
        const Token name = next();
        p.name = std::string(name.raw);
        p.low = name.low;
        if (accept("("))
          while (!at_line_end() && !accept(")")) {
            const Token q = next();
            if (is_array_mark(q)) pass_array();
            else if (q.kind == Tk::name) p.parameters.push_back(q);
          }
        p.first = behind;
        p.end = end;
        if (tokens_[std::min(end, tokens_.size() - 1)].low != ".end")
          fail(p.at, "the program " + p.name.substr(0, 60) + " has no .END");
        programs_.push_back(std::move(p));
      } else if (t.low == ".trans") {
        data_.push_back({Data::places, behind, end});
      } else if (t.low == ".joints") {
        data_.push_back({Data::joints, behind, end});
      } else if (t.low == ".reals" || t.low == ".integer") {
        data_.push_back({Data::numbers, behind, end});
      } else if (t.low == ".strings") {
        data_.push_back({Data::texts, behind, end});
      } else if (t.low.starts_with(".") && t.low.size() > 1) {
        if (others.insert(t.low).second)
          note(t.at, "the section " + std::string(t.raw.substr(0, 40)) +
                         " belongs to the controller, not to its programs; it was left out");
      } else {
        fail(t.at, "\"" + std::string(t.raw.substr(0, 40)) + "\" is not expected outside a program",
             "A program begins with .PROGRAM name() and ends with .END.");
        continue;
      }
      i = std::min(end, tokens_.size() - 1);
    }
    at_ = 0;
  }
  std::size_t find_main() {
    if (programs_.empty()) {
      fail({0, 1, 1, 0, 0}, "this file contains no program (.PROGRAM name())",
           "Read the file that the controller saves, or the one with the programs.");
      return 0;
    }
    std::set<std::string> called;
    for (std::size_t i = 0; i + 1 < tokens_.size(); ++i)
      if (tokens_[i].low == "call") called.insert(tokens_[i + 1].low);
    const std::string asked = lower(params_.text("program"));
    for (std::size_t i = 0; i < programs_.size() && !asked.empty(); ++i)
      if (programs_[i].low == asked) return i;
    if (!asked.empty())
      fail({0, 1, 1, 0, 0}, "this file has no program named " + asked.substr(0, 60),
           "The setting program is the name after .PROGRAM.");
    const std::string file = lower(stem(files_[0].name));
    std::size_t first = programs_.size();
    int free = 0;
    for (std::size_t i = 0; i < programs_.size(); ++i) {
      const Program& p = programs_[i];
      if (p.low == file && p.parameters.empty()) return i;
      if (p.low == "main" && p.parameters.empty() && first == programs_.size()) return i;
      if (called.contains(p.low) || !p.parameters.empty() || p.low.starts_with("comment__"))
        continue;
      if (free++ == 0) first = i;
    }
    if (first == programs_.size()) first = 0;
    if (free > 1)
      note(programs_[first].at,
           "several programs of this file are not called by any other; " + programs_[first].name +
               ", the first, is read with the programs it calls",
           "Select another one with settings = {program = ...}.");
    return first;
  }
  /// The programs that the main one calls, and those that they call.
  void find_reached(std::size_t main) {
    std::vector<std::size_t> todo{main};
    programs_[main].is_reached = true;
    while (!todo.empty()) {
      const Program p = programs_[todo.back()];
      todo.pop_back();
      for (std::size_t k = p.first; k + 1 < p.end; ++k) {
        if (tokens_[k].kind == Tk::name) used_.insert(tokens_[k].low);
        if (tokens_[k].low != "call") continue;
        for (std::size_t i = 0; i < programs_.size(); ++i)
          if (programs_[i].low == tokens_[k + 1].low && !programs_[i].is_reached) {
            programs_[i].is_reached = true;
            todo.push_back(i);
          }
      }
      if (p.end > p.first && tokens_[p.end - 1].kind == Tk::name)
        used_.insert(tokens_[p.end - 1].low);
    }
    std::string left;
    std::size_t n = 0;
    for (const Program& p : programs_)
      if (!p.is_reached && ++n <= 5) left += (n > 1 ? ", " : "") + p.name;
    if (n > 0)
      note(programs_[main].at, std::to_string(n) + " programs that " + programs_[main].name +
                                   " does not call were left out: " + left +
                                   (n > 5 ? ", ..." : ""));
  }

  // ---- data ----

  /// Name and indices of a line of data; false = it is none.
  bool data_name(std::string& low, std::vector<std::int64_t>& index) {
    if (peek().kind != Tk::name) return false;
    low = next().low;
    index.clear();
    if (!accept("[")) return true;
    do {
      const Token n = next();
      if (n.kind != Tk::number || !n.is_integer) return false;
      index.push_back(static_cast<std::int64_t>(n.value));
    } while (accept(","));
    return accept("]");
  }
  std::vector<double> data_numbers() {
    std::vector<double> out;
    while (!at_line_end() && out.size() < 100) {
      if (accept(",") || accept("=")) continue;
      const bool is_negative = accept("-");
      if (!is_negative) accept("+");
      const Token n = next();
      if (n.kind != Tk::number) {
        out.clear();
        return out;
      }
      out.push_back(is_negative ? -n.value : n.value);
    }
    return out;
  }
  void declare_data() {
    struct Element {
      std::vector<std::int64_t> index;
      std::string value;
    };
    struct Array {
      std::string low;
      Type type;
      At at;
      std::vector<Element> elements;
    };
    std::vector<Array> arrays;
    std::map<std::string, std::size_t> array_of_name;
    for (const Data& d : data_)
      for (at_ = d.first; at_ < d.end;) {
        if (peek().kind == Tk::line) {
          next();
          continue;
        }
        const At at = here();
        std::string low;
        std::vector<std::int64_t> index;
        const Token name = peek();
        const bool is_name = data_name(low, index);
        if (is_name && !used_.contains(low)) {
          skip_line();
          continue;
        }
        Ex value = failed();
        Type type = kReal;
        if (is_name && d.kind == Data::texts) {
          accept("=");
          type = kString;
          if (peek().kind == Tk::text) value = string(next().raw);
        } else if (is_name) {
          const std::vector<double> n = data_numbers();
          if (d.kind == Data::numbers && n.size() == 1) value = real(n[0]);
          if (d.kind == Data::joints && n.size() >= 3 && n.size() <= 18) {
            std::vector<Ex> axes, outer;
            for (std::size_t k = 0; k < n.size(); ++k) (k < 6 ? axes : outer).push_back(real(n[k]));
            value = joints(axes, outer);
            type = joint_type();
          }
          if (d.kind == Data::places && n.size() >= 6 && n.size() <= 18) {
            std::vector<Ex> all;
            for (const double x : n) all.push_back(real(x));
            value = place_of(all);
            type = value.type;
          }
        }
        if (!value.ok) {
          fail(at, "this line of data is not read", "It must be a name and its numbers.");
          skip_line();
          continue;
        }
        skip_line();
        const std::string key = low;
        learn(key, type);
        std::string element;
        for (const std::int64_t i : index) element += "," + std::to_string(i);
        learned_.flags.insert("valued " + key + element);
        if (index.empty()) {
          if (globals_.contains(key)) {
            fail(at, std::string(name.raw) + " has two values");
            continue;
          }
          Symbol& s = declare(name.raw, learned_.types[key]);
          if (s.type.k == K::target) value = whole(value, name, at);
          declare_variable(s, value.ok ? converted(value, s.type, at).s : std::string(), at);
          continue;
        }
        learn_array(key, type, index);
        learn_element(key, type);
        const auto [it, is_new] = array_of_name.try_emplace(key, arrays.size());
        if (is_new) arrays.push_back({std::string(name.raw), type, at, {}});
        const Type& of = learned_.types[key];
        if (of.element && of.element->k == K::target) value = whole(value, name, at);
        if (!value.ok) continue;
        arrays[it->second].elements.push_back(
            {index, of.element ? converted(value, *of.element, at).s : value.s});
      }
    for (const Array& a : arrays) {
      const std::string key = lower(a.low);
      const Type t = learned_.types[key];
      if (t.k != K::array || !fits_array(t)) {
        fail(a.at, a.low + " has more elements than IRL allows, or a different number of indices");
        continue;
      }
      Symbol& s = declare(a.low, t);
      declare_variable(s, {}, a.at);
      for (const Element& e : a.elements) {
        if (e.index.size() != t.bounds.size()) {
          fail(a.at, "the elements of " + a.low + " have different numbers of indices");
          break;
        }
        std::string i;
        for (const std::int64_t k : e.index) i += (i.empty() ? "" : ", ") + std::to_string(k);
        emit(s.irl + "[" + i + "] := " + e.value + ";", a.at);
      }
    }
  }
  static bool fits_array(const Type& t) {
    double n = 1;
    for (const auto& [lo, hi] : t.bounds) n *= static_cast<double>(hi - lo + 1);
    return n > 0 && n <= 100'000;
  }
  /// Arrays have no size in AS: bounds are those of the indices that are known.
  void learn_array(const std::string& key, const Type& element,
                   const std::vector<std::int64_t>& index) {
    Type& t = learned_.types[key];
    if (t.k != K::array || t.bounds.size() != index.size()) {
      const Type of = t.k == K::array && t.element                                ? *t.element
                      : t.k != K::none && t.k != K::array && element.k == K::real ? t
                                                                                  : element;
      std::vector<std::pair<std::int64_t, std::int64_t>> b;
      for (const std::int64_t i : index) b.emplace_back(i, i);
      t = array_of(of, b);
      return;
    }
    for (std::size_t k = 0; k < index.size(); ++k) {
      t.bounds[k].first = std::min(t.bounds[k].first, index[k]);
      t.bounds[k].second = std::max(t.bounds[k].second, index[k]);
    }
  }
  void learn_element(const std::string& key, const Type& element) {
    const auto it = learned_.types.find(key);
    if (it == learned_.types.end() || it->second.k != K::array || !it->second.element) return;
    const Type& now = *it->second.element;
    if (now == element) return;
    if ((now.k == K::boolean && is_number(element)) ||
        (now.k == K::pose && element.k == K::target) ||
        (now.k == K::real && element.k != K::boolean && element.k != K::integer &&
         !learned_.flags.contains("valued number " + key)))
      it->second = array_of(element, it->second.bounds);
  }
  Ex pose_of(const std::vector<Ex>& xyz, const std::vector<Ex>& oat) {
    return pose(xyz, orientation("ORIZYZ2", oat));
  }

  // ---- additional axes ----

  /// A transformation of six numbers and those of additional axes. It has no configuration.
  Ex place_of(const std::vector<Ex>& n) {
    const Ex p = pose_of({n[0], n[1], n[2]}, {n[3], n[4], n[5]});
    const std::vector<Ex> axes(n.begin() + 6, n.end());
    // Controllers of six axes may write zeros behind the six numbers.
    const bool are_zeros =
        std::all_of(axes.begin(), axes.end(), [](const Ex& e) { return e.is_literal && e.v == 0; });
    if (axes.empty() || (are_zeros && learned_.external_axes == 0)) return p;
    return with_axes(p, axes);
  }
  Ex with_axes(const Ex& p, const std::vector<Ex>& axes, std::optional<Ex> status = std::nullopt) {
    const Ex e = target(p, status ? *status : integer(-1), std::vector<Ex>(6, integer(-128)), axes);
    if (e.ok && !status) made_.insert_or_assign(e.s, std::pair{p, axes});
    return e;
  }
  [[nodiscard]] bool has_axes(const Ex& e) const {
    return learned_.external_axes > 0 && e.ok && (e.type.k == K::target || e.type.k == K::joint);
  }
  /// What a transformation gets: of joints and of where the robot is without the configuration.
  Ex as_location(const Ex& e, const At& at) {
    if (learned_.external_axes == 0) return as_pose(as_place(e), at);
    if (!e.ok || e.type.k != K::joint) return e;
    return value(helper("any_configuration_target") + "(" + as_place(e).s + ")", kTarget);
  }
  Ex present_location(const At& at) {
    const Ex e = present_target(at);
    if (learned_.external_axes == 0 || !e.ok) return as_pose(e, at);
    return value(helper("any_configuration_target") + "(" + e.s + ")", kTarget);
  }
  /// The pose of a place; of one that is written out its own text.
  Ex pose_part(const Ex& e, const At& at) {
    if (const auto it = made_.find(e.s); it != made_.end()) return it->second.first;
    return as_pose(as_place(e), at);
  }
  std::vector<Ex> axes_part(const Ex& e) {
    if (const auto it = made_.find(e.s); it != made_.end()) return it->second.second;
    std::vector<Ex> out;
    for (int k = 1; k <= learned_.external_axes; ++k)
      out.push_back(value(within(e, kPrimary) + ".A_JOINT.AA" + std::to_string(k), kReal));
    return out;
  }
  /// A pose with the additional axes of a place, if it has any.
  Ex carried(const Ex& p, const Ex& of, const At& at) {
    if (!p.ok || !has_axes(of)) return p;
    const Ex e = as_location(of, at);
    return made_.contains(e.s) || e.is_place ? with_axes(p, axes_part(e)) : with_pose(e, p);
  }
  static constexpr const char* kGiveAxes = "Give it a value for each additional axis.";
  static std::string lacks_axes(const Token& name) {
    return "this transformation has no additional axes, but " +
           std::string(name.raw.substr(0, 60)) + " has them elsewhere";
  }
  /// A line of data whose name has additional axes elsewhere: no axis is set to 0 instead.
  Ex whole(const Ex& e, const Token& name, const At& at) {
    if (e.type.k != K::pose) return e;
    fail(at, lacks_axes(name), kGiveAxes);
    return failed();
  }
  /// Of a sum: the additional axes are those of its last transformation.
  Ex sum_of(const Ex& p, const Ex& last, bool is_lost, const At& at) {
    if (!p.ok || has_axes(last)) return carried(p, last, at);
    if (is_lost)
      return bad(at,
                 "the last transformation of this sum has no additional axes, but one before it "
                 "has them",
                 "Give the last one a value for each additional axis.");
    return p;
  }

  // ---- programs ----

  std::vector<Parameter> parameters(std::size_t program) {
    std::vector<Parameter> out;
    for (const Token& t : programs_[program].parameters) {
      const std::string key = programs_[program].low + "|" + t.low;
      const auto it = learned_.types.find(key);
      out.push_back({std::string(t.raw), it != learned_.types.end() ? it->second : guess(t.low),
                     is_changed(program, t.low)});
    }
    return out;
  }
  void body(std::size_t program) {
    const Program& p = programs_[program];
    blocks_.clear();
    open_.clear();
    next_ = {};
    goal_.clear();
    is_passing_ = program_passes();
    labels_.clear();
    for (std::size_t k = p.first; k + 1 < p.end; ++k)
      if (tokens_[k].low == "goto") labels_.insert(label_of(tokens_[k + 1]));
    next_comment_ = 0;
    while (next_comment_ < comments_.size() && comments_[next_comment_].line < p.at.line)
      ++next_comment_;
    at_ = p.first;
    end_ = p.end;
    while (at_ < p.end) {
      if (progress_.cancelled()) return statement(here(), [] {});
      if (peek().kind == Tk::line || peek().kind == Tk::end) {
        ++at_;
        continue;
      }
      const At at = here();
      statement(at, [&] {
        one();
        if (!at_line_end()) {
          bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
          skip_rest();
        }
      });
    }
    at_ = std::min(p.end, tokens_.size() - 1);
    if (!next_.is_empty() && !is_in_main())
      fail(here(), "a setting for the next motion applies to one in another program",
           "Write it before that motion, or with ALWAYS.");
    comments_until(here());
    close_blocks(here());
    open_.clear();
  }
  [[nodiscard]] bool program_passes() const { return learned_.flags.contains("passes"); }
  static std::string label_of(const Token& t) {
    return t.kind == Tk::number ? "line_" + std::string(t.raw) : t.low;
  }

  // ---- statements ----

  void one() {
    const Token t = peek();
    const At at = t.at;
    const bool is_label = (t.kind == Tk::number && t.is_integer) ||
                          (t.kind == Tk::name && is(":", 1) && t.low != "any");
    if (is_label) {
      next();
      accept(":");
      if (labels_.contains(label_of(t))) {
        settings_end(at);
        forget();
        emit("LABEL " + label(label_of(t)) + ":", at);
      }
      if (at_line_end()) return;
      return one();
    }
    if (t.kind != Tk::name) {
      bad(at, "a statement does not begin with \"" + std::string(t.raw.substr(0, 40)) + "\"");
      skip_rest();
      return;
    }
    if (is("=", 1) || is("[", 1)) return assignment(at);
    static const std::map<std::string, void (AsReader::*)(const At&), std::less<>> kWords{
        {"jmove", &AsReader::motion},
        {"lmove", &AsReader::motion},
        {"jappro", &AsReader::motion},
        {"lappro", &AsReader::motion},
        {"jdepart", &AsReader::depart},
        {"ldepart", &AsReader::depart},
        {"c1move", &AsReader::arc},
        {"c2move", &AsReader::arc},
        {"xmove", &AsReader::stopping},
        {"draw", &AsReader::draw},
        {"speed", &AsReader::speed},
        {"accuracy", &AsReader::accuracy},
        {"accel", &AsReader::accel},
        {"decel", &AsReader::accel},
        {"tool", &AsReader::place_},
        {"base", &AsReader::place_},
        {"righty", &AsReader::configure},
        {"lefty", &AsReader::configure},
        {"above", &AsReader::configure},
        {"below", &AsReader::configure},
        {"uwrist", &AsReader::configure},
        {"dwrist", &AsReader::configure},
        {"break", &AsReader::break_},
        {"delay", &AsReader::delay},
        {"stable", &AsReader::delay},
        {"twait", &AsReader::delay},
        {"wait", &AsReader::wait},
        {"swait", &AsReader::swait},
        {"signal", &AsReader::signal_},
        {"pulse", &AsReader::pulse},
        {"bits", &AsReader::bits},
        {"sout", &AsReader::sout},
        {"timer", &AsReader::timer},
        {"point", &AsReader::point},
        {"here", &AsReader::here_},
        {"decompose", &AsReader::decompose},
        {"if", &AsReader::if_},
        {"else", &AsReader::else_},
        {"end", &AsReader::end},
        {"while", &AsReader::while_},
        {"do", &AsReader::do_},
        {"until", &AsReader::until},
        {"for", &AsReader::for_},
        {"case", &AsReader::case_},
        {"value", &AsReader::value_},
        {"any", &AsReader::any},
        {"scase", &AsReader::scase},
        {"svalue", &AsReader::svalue},
        {"goto", &AsReader::jump},
        {"call", &AsReader::call_},
        {"return", &AsReader::return_},
        {"stop", &AsReader::stop},
        {"halt", &AsReader::halt},
        {"pause", &AsReader::pause},
        {"print", &AsReader::print},
        {"type", &AsReader::print},
        {"cp", &AsReader::cp}};
    // What neither moves nor switches: displays, loads for the servo, ways to run a program.
    static const std::set<std::string, std::less<>> kHarmless{
        "weight",    "ifpwprint",   "ifplabel",     "ifptitle",    "ifpwoverwrite", "rep_once",
        "hold.step", "messages",    "disp.exestep", "prog.date",   "qtool",         "screen",
        "abs.speed", "slow_repeat", "autostart.pc", "errstart.pc", "trace",         "flexcomp"};
    next();
    word_ = t.low;
    if (const auto it = kWords.find(t.low); it != kWords.end()) {
      (this->*it->second)(at);
      return;
    }
    if (kHarmless.contains(t.low)) {
      skip_rest();
      left_out(
          RMP_FAULT_WARNING, at,
          std::string(t.raw) + " neither moves a robot nor switches a signal; it was left out");
      return;
    }
    if (t.low == "prefetch.sigins" && is("off")) {
      skip_rest();
      return;
    }
    skip_rest();
    bad(at, std::string(t.raw.substr(0, 40)) + " is specific to the controller and is not read",
        "Write the same in IRL, or remove it.");
  }

  /// Commas between values, and what stands for one that is left out.
  std::vector<Ex> values(std::size_t most) {
    std::vector<Ex> out;
    while (!at_line_end() && out.size() < most) {
      out.push_back(is(",") ? real(0) : expression());
      if (!accept(",")) break;
    }
    return out;
  }

  // ---- settings of motions ----

  /// Where other statements than motions come, settings for the next motion are lost.
  void settings_end(const At& at) {
    if (next_.is_empty()) return;
    fail(at, "a setting for the next motion comes before a jump, a label or a call",
         "Write it before the motion itself, or with ALWAYS.");
    next_ = {};
  }
  /// What the statements above have brought about is not known where others lead here, too.
  void forget() {
    goal_.clear();
    for (auto& each : configuration_) each.reset();
    is_passing_ = program_passes();
  }
  double tcp_speed() const { return params_.real("tcp_speed") * 1000; }
  void speed(const At& at) {
    const Ex v = as_real(expression(), at);
    std::string unit = "%";
    if (accept("mm")) {
      expect("/");
      unit = accept("min") ? "mm/min" : "mm/s";
      if (unit == "mm/s") expect("s");
    } else if (accept("s")) {
      unit = "s";
    } else {
      accept("%");
    }
    Ex turn = failed();
    bool has_turn = false;
    if (accept(",")) {
      turn = as_real(expression(), at);
      has_turn = true;
      expect("deg");
      expect("/");
      expect("s");
    }
    const bool is_always = accept("always");
    if (!v.ok || (has_turn && !turn.ok)) return;
    if (v.is_literal && v.v <= 0) {
      bad(at, "this is not a speed");
      return;
    }
    const Ex mm = unit == "mm/min" ? scaled(v, 1.0 / 60) : v;
    if (!is_always) {
      next_.share.reset(), next_.speed.reset(), next_.time.reset();
      if (unit == "%") next_.share = v;
      else if (unit == "s") next_.time = v;
      else next_.speed = mm;
      if (has_turn) next_.turn = turn;
      return;
    }
    if (unit == "s") {
      bad(at, "a time for all motions (SPEED n S ALWAYS) has no counterpart in IRL");
      return;
    }
    // Both, as the next motion is one of joints or a path.
    learned_.flags.insert(unit == "%" ? "always share" : "always speed");
    set("speed_share", unit == "%" ? v : scaled(mm, 100 / tcp_speed()), at);
    set("speed", unit == "%" ? scaled(v, tcp_speed() / 100) : mm, at);
    if (has_turn) set("speed_turn", turn, at);
  }
  void accuracy(const At& at) {
    const Ex v = as_real(expression(), at);
    bool is_always = false, is_fine = false;
    while (is("always") || is("fine")) (next().low == "always" ? is_always : is_fine) = true;
    if (!v.ok) return;
    const Ex mm = is_fine ? real(0) : v;
    if (is_always) set("accuracy", mm, at);
    else next_.accuracy = mm;
  }
  void accel(const At& at) {
    const bool is_accel = word_ == "accel";
    const Ex v = as_real(expression(), at);
    const bool is_always = accept("always");
    if (!v.ok) return;
    if (v.is_literal && (v.v <= 0 || v.v > 100)) {
      bad(at, "an acceleration must be above 0 and at most 100 % in IRL");
      return;
    }
    if (is_always) set(is_accel ? "accel" : "decel", v, at);
    else (is_accel ? next_.accel : next_.decel) = v;
  }
  void cp(const At& at) {
    if (!is("on") && !is("off")) {
      bad(at, "ON or OFF is expected here");
      return;
    }
    set("cp", boolean(next().low == "on"), at);
  }
  void place_(const At& at) {
    const bool is_tool = word_ == "tool";
    const Ex p = location();
    if (!p.ok) return;
    goal_.clear();
    set(is_tool ? "tool" : "frame", p.type.k == K::joint ? as_pose(p, at) : pose_part(p, at), at);
  }
  void configure(const At& at) {
    const bool is_other = word_ == "lefty" || word_ == "below" || word_ == "dwrist";
    const std::size_t which = word_ == "righty" || word_ == "lefty"  ? 0
                              : word_ == "above" || word_ == "below" ? 1
                                                                     : 2;
    static constexpr const char* kKeys[] = {"shoulder", "elbow", "wrist"};
    configuration_[which] = is_other;
    set(kKeys[which], integer(is_other ? 1 : 0), at);
  }
  /// A place with the configuration that is set; without turns, which AS does not say.
  Ex with_configuration(const Ex& p, const At& at) {
    const bool has[] = {is_set("shoulder"), is_set("elbow"), is_set("wrist")};
    if (!has[0] && !has[1] && !has[2]) return p;
    if (!has[0] || !has[1] || !has[2])
      return bad(at,
                 "the configuration is set only in part: RIGHTY or LEFTY, ABOVE or BELOW, and "
                 "UWRIST or DWRIST belong together",
                 "Write all three before the motion.");
    const Ex s = get("shoulder", kInt, at), e = get("elbow", kInt, at), w = get("wrist", kInt, at);
    Ex status;
    if (configuration_[0] && configuration_[1] && configuration_[2])
      status = integer(*configuration_[0] + 2 * *configuration_[1] + 4 * *configuration_[2]);
    else if (!s.is_place && !e.is_place && !w.is_place)
      status = integer((s.s == "1" ? 1 : 0) + (e.s == "1" ? 2 : 0) + (w.s == "1" ? 4 : 0));
    else
      status = value(within(s, kSum) + " + 2 * " + within(e, kSign) + " + 4 * " + within(w, kSign),
                     kInt, kSum);
    if (p.type.k == K::target) return with_axes(pose_part(p, at), axes_part(p), status);
    // IRL has no target with a configuration that leaves the additional axes where they are.
    if (learned_.external_axes > 0)
      return bad(at, "this transformation has no additional axes, so it cannot get a configuration",
                 kGiveAxes);
    return target(p, status, std::vector<Ex>(6, integer(-128)), {});
  }
  /// The statements that follow wait for the end of this motion (BREAK).
  [[nodiscard]] bool stops_here() const {
    static const std::set<std::string, std::less<>> kSettings{"speed", "accuracy", "accel", "decel",
                                                              "tool",  "base",     "print", "type"};
    std::size_t k = at_;
    while (k < end_) {
      while (k < end_ && tokens_[k].kind != Tk::line) ++k;
      while (k < end_ && tokens_[k].kind == Tk::line) ++k;
      if (k + 1 < end_ && tokens_[k].kind == Tk::number) ++k;  // number of a step
      if (k >= end_) return false;
      if (tokens_[k].low == "break") return true;
      if (!kSettings.contains(tokens_[k].low)) return false;
    }
    return false;
  }
  void attributes(Motion& m, bool is_joint, const At& at) {
    const auto always = [&](const char* key) -> std::optional<Ex> {
      return is_set(key) ? std::optional(get(key, kReal, at)) : std::nullopt;
    };
    const auto converts = [&](const char* what) {
      if (!std::exchange(said_[what], true))
        note(at, what, "100 % is tcp_speed; set it with settings = {tcp_speed = ...}.");
    };
    if (next_.time) {
      m.attributes.emplace_back("TIME", *next_.time);
    } else if (is_joint) {
      std::optional<Ex> v = next_.share;
      if (next_.speed) {
        v = scaled(*next_.speed, 100 / tcp_speed());
        converts("a speed in mm/s of a joint motion becomes a percentage of the maximum");
      } else if (!v) {
        v = always("speed_share");
        if (v && learned_.flags.contains("always speed"))
          converts("a speed in mm/s of a joint motion becomes a percentage of the maximum");
      }
      if (v && v->is_literal && v->v > 100) v = real(100);
      if (v) m.attributes.emplace_back("SPEED_PTP", *v);
    } else {
      std::optional<Ex> v = next_.speed;
      if (next_.share) {
        v = scaled(*next_.share, tcp_speed() / 100);
        converts("a path speed in % is converted to mm/s");
      } else if (!v) {
        v = always("speed");
        if (v && learned_.flags.contains("always share"))
          converts("a path speed in % is converted to mm/s");
      }
      if (v) m.attributes.emplace_back("SPEED", *v);
      const std::optional<Ex> turn = next_.turn ? next_.turn : always("speed_turn");
      if (turn) m.attributes.emplace_back("SPEED_ORI", *turn);
    }
    const std::optional<Ex> accel = next_.accel ? next_.accel : always("accel"),
                            decel = next_.decel ? next_.decel : always("decel");
    if (accel) m.attributes.emplace_back(is_joint ? "ACC_PTP" : "ACC", *accel);
    if (decel && (!accel || accel->s != decel->s) && !std::exchange(said_["decel"], true))
      warn(at,
           std::string("IRL has one number for acceleration and deceleration; the one of ACCEL is "
                       "used") +
               kOtherTimes);
    const std::optional<Ex> mm = next_.accuracy ? next_.accuracy : always("accuracy");
    bool passes = m.until.empty() && !stops_here();
    if (passes && is_set("cp")) {
      const Ex on = get("cp", kBool, at);
      if (on.is_place)
        bad(at, "CP is both ON and OFF in one program", "Write BREAK after the motions.");
      passes = on.s != "FALSE";
    }
    if (passes && mm && !(mm->is_literal && mm->v == 0)) {
      if (is_joint && !std::exchange(said_["zone"], true))
        note(at, "an ACCURACY in mm of a joint motion becomes C_PTP in %");
      Ex zone = *mm;
      if (is_joint && zone.is_literal && zone.v > 100) zone = real(100);
      m.attributes.emplace_back(is_joint ? "C_PTP" : "C_CP", zone);
      learned_.flags.insert("passes");
      is_passing_ = true;
    } else {
      if (passes && !mm && !std::exchange(said_["accuracy"], true))
        note(at,
             "no ACCURACY is set; motions end exactly at their targets in IRL, and within the "
             "controller's default accuracy on the robot");
      is_passing_ = false;
    }
    next_ = {};
    for (Open& o : open_) o.moved = true;
  }

  // ---- motions ----

  void motion(const At& at) {
    const bool is_joint = word_[0] == 'j', is_near = word_.ends_with("appro");
    Ex e = location();
    if (is_near) {
      expect(",");
      const Ex d = as_real(expression(), at);
      if (!e.ok || !d.ok) return;
      e = behind(e, d, at);
    }
    if (accept(",")) {
      bad(at, "clamps of a motion (" + std::string(peek().raw.substr(0, 20)) + ") are not read",
          "Write the output as a statement.");
      skip_rest();
      return;
    }
    if (!e.ok) return;
    go(e, is_joint, at);
  }
  /// At a distance before the place, along its z.
  Ex behind(const Ex& p, const Ex& d, const At& at) {
    const Ex by = pose({real(0), real(0), negative(d)},
                       orientation("ORIQUAT", {real(1), real(0), real(0), real(0)}));
    return carried(binary(Op::compose, pose_part(p, at), by, at), p, at);
  }
  void go(Ex e, bool is_joint, const At& at) {
    Motion m;
    m.word = is_joint ? "PTP" : "LIN";
    if (e.type.k == K::joint) {
      m.has_frames = false;
      goal_.clear();
      if (!is_joint) e = as_place(e);
    } else if (e.type.k == K::pose || e.type.k == K::target) {
      const Ex p = pose_part(e, at);
      goal_ = e.is_place || p.s.size() < 300 ? p.s : "";
      if (is_joint) e = with_configuration(e, at);
    } else {
      bad(at, "this is not a target of a motion");
      return;
    }
    m.targets.push_back(e);
    attributes(m, is_joint, at);
    move(std::move(m), at);
  }
  /// From where the motion above has ended.
  void depart(const At& at) {
    const bool is_joint = word_[0] == 'j';
    const Ex d = as_real(expression(), at);
    if (!d.ok) return;
    if (goal_.empty()) {
      bad(at, "the start of this motion is unknown",
          "Name the position: LAPPRO position, distance.");
      return;
    }
    go(behind(value(goal_, kPose), d, at), is_joint, at);
  }
  void arc(const At& at) {
    const bool is_first = word_ == "c1move";
    const Ex e = as_location(location(), at);
    if (!e.ok) return;
    if (is_first) {
      via_ = e;
      via_next_ = next_;
      next_ = {};
      // The end comes with the next statement of motion, after settings only.
      std::size_t k = at_;
      bool found = false;
      for (int lines = 0; lines < 12 && k < end_ && !found; ++lines) {
        while (k < end_ && tokens_[k].kind != Tk::line) ++k;
        while (k < end_ && tokens_[k].kind == Tk::line) ++k;
        if (k >= end_) break;
        found = tokens_[k].low == "c2move";
        static const std::set<std::string, std::less<>> kSettings{"speed", "accuracy", "accel",
                                                                  "decel"};
        if (!found && !kSettings.contains(tokens_[k].low)) break;
      }
      if (!found) {
        via_.reset();
        bad(at, "an arc is a C1MOVE directly followed by a C2MOVE",
            "IRL's circle has one via point and one end point.");
      }
      return;
    }
    if (!via_) {
      bad(at, "C2MOVE has no C1MOVE before it");
      return;
    }
    Motion m;
    m.word = "CIRCLE";
    m.targets = {*via_, e};
    via_.reset();
    if (next_.is_empty()) next_ = via_next_;
    goal_ = pose_part(e, at).s;
    if (goal_.size() >= 300) goal_.clear();
    attributes(m, false, at);
    move(std::move(m), at);
  }
  void stopping(const At& at) {
    bool is_level = false;
    if (accept("/")) {
      is_level = is("lvl");
      if (!is("lvl") && !is("err")) bad(here(), "LVL or ERR is expected here");
      next();
    }
    const Ex e = as_place(location());
    expect("till");
    const Ex c = signal_condition(at);
    if (!e.ok || !c.ok) return;
    if (!is_level) {
      bad(at, "XMOVE without /LVL waits for a change of the signal; UNTIL of IRL tests its level",
          "Write XMOVE/LVL if the level is intended.");
      return;
    }
    Motion m;
    m.word = "LIN";
    m.targets.push_back(e);
    m.until = c.s;
    goal_.clear();
    attributes(m, false, at);
    move(std::move(m), at);
  }
  void draw(const At& at) {
    std::vector<Ex> by = values(6);
    if (accept(",")) {
      bad(at, "the speed of DRAW is not read", "Write SPEED before it.");
      skip_rest();
      return;
    }
    for (std::size_t k = 0; k < by.size(); ++k) {
      by[k] = as_real(by[k], at);
      if (!by[k].ok) return;
      if (k >= 3 && !(by[k].is_literal && by[k].v == 0)) {
        bad(at, "DRAW that rotates the tool is not read", "Name its end position.");
        return;
      }
    }
    while (by.size() < 3) by.push_back(real(0));
    step("LIN", {by[0], by[1], by[2]}, at);
  }
  void step(const char* word, const std::vector<Ex>& by, const At& at) {
    Motion m;
    m.word = word;
    m.is_incremental = true;
    m.targets.push_back(position(by));
    goal_.clear();
    attributes(m, std::string_view(word) == "PTP", at);
    move(std::move(m), at);
  }
  void break_(const At& at) {
    if (std::exchange(is_passing_, false)) emit("WAIT 0.0 SEC;", at);
  }

  // ---- waits and signals ----

  void delay(const At& at) {
    const Ex t = as_real(expression(), at);
    if (t.is_literal && t.v < 0) bad(at, "a time must not be negative");
    else if (t.ok) emit("WAIT " + within(t, kSum) + " SEC;", at);
    is_passing_ = false;
  }
  /// The condition that stands here, up to a token.
  Ex condition_until(std::size_t end, const At& at) {
    const Token kept = tokens_[end];
    tokens_[end].kind = Tk::line;
    Ex e = converted(expression(), kBool, at);
    if (e.ok && at_ != end) e = bad(here(), "this is not expected here");
    tokens_[end] = kept;
    at_ = end;
    return e;
  }
  void wait(const At& at) {
    const Ex c = converted(expression(), kBool, at);
    if (c.ok) emit("WAIT FOR " + c.s + ";", at);
    is_passing_ = false;
  }
  /// TIMER n = 0 / WAIT c OR TIMER(n) >= t is a WAIT FOR with TIMEOUT.
  void timer(const At& at) {
    const Token n = next();
    std::size_t w = at_;
    if (!is("=") || !(peek(1).kind == Tk::number && peek(1).value == 0) ||
        peek(2).kind != Tk::line) {
      skip_rest();
      bad(at, "IRL has no timers that run in parallel to the program");
      return;
    }
    w = at_ + 2;
    while (w < end_ && tokens_[w].kind == Tk::line) ++w;
    const auto is_timer = [&](std::size_t k) {
      return k + 4 < end_ && tokens_[k].low == "timer" && tokens_[k + 1].low == "(" &&
             tokens_[k + 2].raw == n.raw && tokens_[k + 3].low == ")" && tokens_[k + 4].low == ">=";
    };
    std::size_t or_ = 0;
    if (w < end_ && tokens_[w].low == "wait")
      for (std::size_t k = w + 1; k < end_ && tokens_[k].kind != Tk::line; ++k)
        if (tokens_[k].low == "or" && is_timer(k + 1)) or_ = k;
    if (or_ == 0) {
      skip_rest();
      bad(at, "IRL has no timers that run in parallel to the program",
          "TIMER n = 0 before WAIT condition OR TIMER(n) >= time is read.");
      return;
    }
    at_ = w + 1;
    const Ex c = condition_until(or_, at);
    at_ = or_ + 6;
    const Ex t = as_real(expression(25), at);
    if (!c.ok || !t.ok) return;
    emit("WAIT FOR " + c.s + " TIMEOUT " + within(t, kSum) + ";", tokens_[w].at);
    is_passing_ = false;
    // Whether it was the time: flag = TIMER(n) >= t
    std::size_t k = at_;
    while (k < end_ && tokens_[k].kind == Tk::line) ++k;
    if (!at_line_end() || k + 2 >= end_ || tokens_[k].kind != Tk::name ||
        tokens_[k + 1].low != "=" || !is_timer(k + 2))
      return;
    at_ = k;
    const Named to = named();
    at_ = k + 7;
    (void)expression(25);
    assign_to(to, value("R_TIMEOUT", kBool), at);
  }
  /// A signal by its number, negative where it is off; nothing where it is not known.
  struct SignalHere {
    Symbol* symbol = nullptr;
    bool is_off = false;
  };
  SignalHere signal_here(const At& at, std::int64_t width = 1) {
    SignalHere out;
    out.is_off = accept("-");
    const Ex n = expression(25);
    if (!n.ok) return out;
    const auto number = number_known(n);
    if (!number || *number < 1 || *number > 100'000) {
      bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
      return out;
    }
    out.symbol = &signal_of(static_cast<std::int64_t>(*number), width);
    return out;
  }
  /// Outputs from 1, inputs from 1001, signals within the controller from 2001.
  Symbol& signal_of(std::int64_t number, std::int64_t width = 1) {
    const bool is_input = number > 1000 && number <= 2000;
    return signal(!is_input, is_input ? number - 1000 : number, width);
  }
  /// The number that an expression has in all of the program.
  std::optional<double> number_known(const Ex& e) const {
    if (e.is_literal) return e.v;
    if (const std::size_t k = e.s.find('['); k != std::string::npos)
      if (learned_.modal_varies.contains("=" + e.s.substr(0, k) + "[*]")) return std::nullopt;
    const auto it = learned_.modal.find("=" + e.s);
    if (it != learned_.modal.end() && it->second.size() == 1 &&
        !learned_.modal_varies.contains("=" + e.s))
      return std::strtod(it->second.begin()->c_str(), nullptr);
    return std::nullopt;
  }
  Ex signal_value(const SignalHere& s) {
    if (!s.symbol) return failed();
    Ex e = place(s.symbol->irl, kBool);
    if (!s.is_off) return e;
    return value("NOT " + e.s, kBool, kNot);
  }
  Ex signal_condition(const At& at) {
    Ex all = signal_value(signal_here(at));
    while (accept(",")) all = binary(Op::and_, all, signal_value(signal_here(at)), at);
    return all;
  }
  void swait(const At& at) {
    const Ex c = signal_condition(at);
    if (c.ok) emit("WAIT FOR " + c.s + ";", at);
    is_passing_ = false;
  }
  void switch_to(const SignalHere& s, const std::string& to, const At& at) {
    if (!s.symbol) return;
    if (s.symbol->kind != Symbol::output) {
      bad(at, "an input cannot be assigned");
      return;
    }
    emit(s.symbol->irl + " := " + to + ";", at);
    is_passing_ = false;
  }
  void signal_(const At& at) {
    do {
      if (is(",") || at_line_end()) continue;
      const SignalHere s = signal_here(at);
      switch_to(s, s.is_off ? "FALSE" : "TRUE", at);
    } while (accept(","));
  }
  void pulse(const At& at) {
    const SignalHere s = signal_here(at);
    const Ex t = accept(",") ? as_real(expression(), at) : real(0.2);
    if (!s.symbol || !t.ok) return;
    switch_to(s, "TRUE", at);
    emit("WAIT " + within(t, kSum) + " SEC;", at);
    switch_to(s, "FALSE", at);
    warn(at, "the IRL program waits for the end of this pulse; the controller continues");
  }
  void bits(const At& at) {
    const Ex n = expression(25);
    expect(",");
    const Ex w = expression(25);
    if (!expect("=")) return;
    const Ex v = as_integer(as_number(expression(), at), at);
    if (!n.ok || !w.ok || !v.ok) return;
    const auto number = number_known(n), width = number_known(w);
    if (!number || !width || *width < 1 || *width > 31) {
      bad(at, "IRL has no signals with computed numbers, and at most 31 bits");
      return;
    }
    SignalHere s;
    s.symbol = &signal_of(static_cast<std::int64_t>(*number), static_cast<std::int64_t>(*width));
    switch_to(s, s.symbol->type.k == K::boolean ? "(" + v.s + ") <> 0" : v.s, at);
  }
  void sout(const At& at) {
    const SignalHere s = signal_here(at);
    if (!expect("=")) return;
    const Ex c = converted(expression(), kBool, at);
    if (!c.ok) return;
    if (s.is_off) switch_to(s, "NOT (" + c.s + ")", at);
    else switch_to(s, c.s, at);
  }

  // ---- variables ----

  static Type guess(const std::string& low) {
    const std::size_t b = low.starts_with(".") ? 1 : 0;
    if (low.substr(b).starts_with("$")) return kString;
    if (low.substr(b).starts_with("#"))
      return {.k = K::joint, .record = {}, .bounds = {}, .element = {}};
    return kReal;
  }
  Named named() {
    Named out;
    out.name = next();
    out.is_local = out.name.low.starts_with(".");
    out.key = out.is_local ? programs_[routine_].low + "|" + out.name.low : out.name.low;
    if (is("[")) {
      next();
      const bool hint = std::exchange(wants_place_, false);
      do out.index.push_back(expression());
      while (accept(","));
      wants_place_ = hint;
      expect("]");
    }
    return out;
  }
  /// The place of a variable, declared where it is first met; `of` is its type where nothing is
  /// known yet.
  Ex variable(const Named& v, const Type& of, bool is_written, const At& at) {
    for (const Ex& i : v.index)
      if (!i.ok) return failed();
    if (!learned_.types.contains(v.key) && v.index.empty()) learned_.types[v.key] = of;
    std::string element;
    if (!v.index.empty()) {
      std::vector<std::int64_t> lo, hi;
      bool is_known = true;
      for (const Ex& i : v.index) {
        const auto range = range_of(i);
        if (!range) {
          is_known = false;
          break;
        }
        lo.push_back(range->first);
        hi.push_back(range->second);
        if (range->first == range->second) element += "," + std::to_string(range->first);
      }
      if (is_known) {
        learn_array(v.key, of, lo);
        learn_array(v.key, of, hi);
      }
      if (std::count(element.begin(), element.end(), ',') !=
          static_cast<std::ptrdiff_t>(v.index.size()))
        element = ",*";
    }
    const auto it = learned_.types.find(v.key);
    if (it == learned_.types.end())
      return bad(at, "the size of " + std::string(v.name.raw.substr(0, 40)) + " is not known",
                 "AS has no sizes of arrays; use an element with a number as its index.");
    const Type type = it->second;
    if ((type.k == K::array) != !v.index.empty() ||
        (type.k == K::array && type.bounds.size() != v.index.size()))
      return bad(
          at, std::string(v.name.raw.substr(0, 40)) + " is used with different numbers of indices");
    if (type.k == K::array && !fits_array(type))
      return bad(at, std::string(v.name.raw.substr(0, 40)) + " has more elements than IRL allows");
    if (is_written) {
      will_write(v.name.low);
      learned_.flags.insert("valued " + v.key + element);
    } else if (!has_value(v, element) && unvalued_.insert(v.key + element).second) {
      fail(at,
           std::string(v.name.raw.substr(0, 40)) +
               (element.empty() || element == ",*" ? "" : "[" + element.substr(1) + "]") +
               " has no value in this file; it is zero here",
           "Read the file that the controller saves, with its variables.");
    }
    Symbol* s = find(v.name.low);
    if (s && s->type.k == K::none) s = nullptr;
    if (s && (s->kind == Symbol::routine || s->kind == Symbol::data)) s = nullptr;
    if (!s || (v.is_local && !current().symbols.contains(v.name.low))) {
      s = &declare(v.name.raw, type, Symbol::variable, v.is_local);
      declare_variable(*s, {}, at, v.is_local);
    }
    if (v.index.empty()) return place(s->irl, s->type);
    if (s->type.k != K::array) return failed();
    std::string list;
    for (const Ex& i : v.index) list += (list.empty() ? "" : ", ") + as_integer(i, at).s;
    return place(s->irl + "[" + list + "]", *s->type.element);
  }
  bool has_value(const Named& v, const std::string& element) const {
    const auto& f = learned_.flags;
    if (f.contains("valued " + v.key + element) || f.contains("valued " + v.key + ",*"))
      return true;
    // Of an index that is computed: one of its elements has a value.
    if (element == ",*") {
      const auto it = f.lower_bound("valued " + v.key + ",");
      if (it != f.end() && it->starts_with("valued " + v.key + ",")) return true;
    }
    // The first pass does not know yet what comes below; parameters have theirs.
    return !f.contains("passed") || (v.is_local && is_parameter(v.name.low));
  }
  bool is_parameter(const std::string& low) const {
    const auto& all = programs_[routine_].parameters;
    return std::any_of(all.begin(), all.end(), [&](const Token& t) { return t.low == low; });
  }
  /// The numbers that an index may have: of a literal, or of the variable of a FOR.
  std::optional<std::pair<std::int64_t, std::int64_t>> range_of(const Ex& i) const {
    if (const auto n = number_known(i); n && std::fabs(*n) < 1e6) {
      const auto k = static_cast<std::int64_t>(std::llround(*n));
      return std::pair{k, k};
    }
    for (const auto& [name, range] : loops_) {
      if (i.s == name) return range;
      for (const char* sign : {" + ", " - "}) {
        const std::string head = name + sign;
        if (!i.s.starts_with(head)) continue;
        char* end = nullptr;
        const std::string rest = i.s.substr(head.size());
        const double by = std::strtod(rest.c_str(), &end);
        if (end == rest.c_str() || *end != '\0' || std::fabs(by) > 1e6) continue;
        const auto d = static_cast<std::int64_t>(sign[1] == '+' ? by : -by);
        return std::pair{range.first + d, range.second + d};
      }
    }
    return std::nullopt;
  }
  /// AS counts TRUE as -1 and FALSE as 0.
  Ex as_number(const Ex& e, const At& at) {
    if (!e.ok || e.type.k != K::boolean) return e;
    if (e.is_constant) return real(e.v != 0 ? -1 : 0);
    return bad(at, "a computed truth value cannot be used as a number here",
               "Write IF condition THEN, and set the number there.");
  }
  void keep_number(const std::string& variable, const Ex& e) {
    if (!is_number(e.type) && e.type.k != K::boolean) return;
    auto& values = learned_.modal["=" + variable];
    if (e.is_literal && is_number(e.type) && values.size() < 2) values.insert(e.s);
    if (!e.is_literal || e.type.k == K::boolean) learned_.modal_varies.insert("=" + variable);
  }
  void assign_to(const Named& to, const Ex& e, const At& at) {
    if (!e.ok) return;
    Type t = e.type;
    if (t.k == K::integer) t = kReal;
    if (to.index.empty()) {
      const auto it = learned_.types.find(to.key);
      if (it == learned_.types.end() || !(it->second.k == K::real && t.k == K::boolean))
        learn(to.key, t);
      // A number by guess only becomes what it gets.
      if (it != learned_.types.end() && it->second.k == K::real &&
          (t.k == K::pose || t.k == K::target) &&
          !learned_.flags.contains("valued number " + to.key))
        learned_.types[to.key] = t;
    } else {
      learn_element(to.key, t);
    }
    if (is_number(t)) learned_.flags.insert("valued number " + to.key);
    const Ex v = variable(to, t, true, at);
    if (!v.ok) return;
    keep_number(v.s, e);
    if (is_parameter(to.name.low)) learned_.modal_varies.insert("=" + v.s);
    for (const Ex& i : to.index)
      if (!number_known(i))
        learned_.modal_varies.insert("=" + v.s.substr(0, v.s.find('[')) + "[*]");
    if (v.type.k == K::real && e.type.k == K::boolean && !e.is_constant) {
      emit("IF " + e.s + " THEN " + v.s + " := -1.0; ELSE " + v.s + " := 0.0; ENDIF;", at);
      return;
    }
    if (v.type.k == K::real) {
      assign(v, as_number(e, at), at);
      return;
    }
    if (v.type.k == K::pose) {
      assign(v, pose_part(e, at), at);
      return;
    }
    if (v.type.k == K::target) {
      // The whole of it, and not only its pose.
      const Ex all = as_location(e, at);
      if (all.type.k == K::pose) bad(at, lacks_axes(to.name), kGiveAxes);
      else assign(v, converted(all, kTarget, at), at);
      return;
    }
    if (v.type.k == K::joint && (e.type.k == K::pose || e.type.k == K::target)) {
      bad(at, "only the controller can compute the joint values of a transformation");
      return;
    }
    assign(v, e, at);
  }
  void assignment(const At& at) {
    const Named to = named();
    if (!expect("=")) {
      skip_rest();
      return;
    }
    const std::string low = to.is_local ? to.name.low.substr(1) : to.name.low;
    if (low.starts_with("#")) return assign_to(to, location(), at);
    assign_to(to, expression(), at);
  }
  void point(const At& at) {
    if (accept("/")) {
      const std::string which = next().low;
      const Named to = named();
      expect("=");
      const Ex e = location();
      if (which != "x" && which != "y" && which != "z") {
        bad(at, "POINT of parts other than /X, /Y and /Z is not read");
        skip_rest();
        return;
      }
      learn(to.key, kPose);
      const Ex v = variable(to, kPose, true, at);
      if (!v.ok || !e.ok) return;
      const char c = static_cast<char>(which[0] - 32);
      const Ex p = as_pose(as_place(e), at);
      const std::string place = v.type.k == K::target ? v.s + ".PSE" : v.s;
      if (p.ok) emit(place + ".POS." + c + " := " + within(p, kPrimary) + ".POS." + c + ";", at);
      return;
    }
    const Named to = named();
    const std::string low = to.is_local ? to.name.low.substr(1) : to.name.low;
    if (!expect("=")) {
      skip_rest();
      return;
    }
    Ex e = location();
    if (!e.ok) return;
    if (!low.starts_with("#")) {
      e = as_location(e, at);
      const auto it = learned_.types.find(to.key);
      if (it != learned_.types.end() && to.index.empty() && it->second.k == K::real)
        it->second = e.type;
    }
    goal_.clear();
    assign_to(to, e, at);
  }
  /// HERE place: it gets where the robot is.
  void here_(const At& at) {
    const Named to = named();
    const std::string low = to.is_local ? to.name.low.substr(1) : to.name.low;
    assign_to(to, low.starts_with("#") ? present_joints() : present_location(at), at);
  }
  void decompose(const At& at) {
    Named to = named();
    expect("=");
    const Ex e = location();
    if (!e.ok || to.index.size() != 1) {
      if (e.ok) bad(at, "DECOMPOSE fills an array starting at one of its elements");
      return;
    }
    const auto from = number_known(to.index[0]);
    if (!from) {
      bad(at, "DECOMPOSE must begin at a known element");
      return;
    }
    std::vector<std::string> parts;
    if (e.type.k == K::joint) {
      const std::string p =
          within(e, kPrimary) + (learned_.external_axes > 0 ? ".M_JOINT.A" : ".A");
      for (int k = 1; k <= 6; ++k) parts.push_back(p + std::to_string(k));
    } else {
      const Ex q = pose_part(e, at);
      if (!q.ok) return;
      const std::string p = within(q, kPrimary);
      for (const char c : {'X', 'Y', 'Z'}) parts.push_back(p + ".POS." + c);
      for (const char* a : {"ANGLEZ", "ANGLEY", "ANGLEZ2"})
        parts.push_back(std::string(a) + "('ZYZ2', " + p + ".ORI)");
    }
    if (has_axes(e))
      for (const Ex& x : axes_part(e)) parts.push_back(x.s);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      to.index = {integer(static_cast<std::int64_t>(*from) + static_cast<std::int64_t>(k))};
      assign_to(to, value(parts[k], kReal), at);
    }
  }

  // ---- control flow ----

  void opens(std::string word, std::string irl) {
    open_block("end", std::move(irl));
    Open o;
    o.word = std::move(word);
    o.before = next_;
    open_.push_back(std::move(o));
    forget();
  }
  void if_(const At& at) {
    const std::string c = truth(at);
    if (accept("goto")) {
      const std::string l = label_here(at);
      settings_end(at);
      if (!l.empty()) emit("IF " + c + " THEN GOTO " + l + "; ENDIF;", at);
      return;
    }
    accept("then");
    emit("IF " + c + " THEN", at);
    opens("if", "ENDIF");
  }
  /// An arm ends: what was said of the next motion is what it was before the block.
  void arm_ends(const At& at) {
    Open& o = open_.back();
    if (!next_.is_empty() && (o.moved || !same_next(next_, o.before)))
      fail(at, "a setting for the next motion is within a block, but the motion follows the block",
           "Write it before the motion itself, or with ALWAYS.");
    o.all_moved = o.all_moved && o.moved;
    o.says = o.says || o.moved;
    o.moved = false;
    next_ = o.before;
    forget();
  }
  static bool same_next(const Next& a, const Next& b) {
    const auto same = [](const std::optional<Ex>& x, const std::optional<Ex>& y) {
      return x.has_value() == y.has_value() && (!x || x->s == y->s);
    };
    return same(a.share, b.share) && same(a.speed, b.speed) && same(a.time, b.time) &&
           same(a.turn, b.turn) && same(a.accuracy, b.accuracy) && same(a.accel, b.accel) &&
           same(a.decel, b.decel);
  }
  void else_(const At& at) {
    if (open_.empty() || open_.back().word != "if") {
      bad(at, "ELSE is outside IF");
      return;
    }
    arm_ends(at);
    open_.back().has_else = true;
    between("ELSE", at);
  }
  void end(const At& at) {
    if (open_.empty() || !is_in("end")) {
      bad(at, "END has no open block");
      return;
    }
    if (open_.back().word == "do") {
      bad(at, "DO must end with UNTIL, not with END");
      return;
    }
    closes(at);
    close_block("end", at);
  }
  void closes(const At& at) {
    arm_ends(at);
    const Open o = open_.back();
    open_.pop_back();
    if (!o.step.empty()) emit(o.step, at);
    if (o.word == "for") loops_.pop_back();
    const bool once = o.word == "if" || o.word == "case" || o.word == "scase";
    next_ = o.before;
    if (o.says && !o.before.is_empty()) {
      if (once && o.has_else && o.all_moved) next_ = {};
      else
        fail(at, "it is unknown whether the next motion is within the block or after it",
             "Write its settings before the motion itself, or with ALWAYS.");
    }
    if (o.says && !open_.empty()) open_.back().moved = true;
    if (o.says) next_ = {};
  }
  void while_(const At& at) {
    const std::string c = truth(at);
    accept("do");
    emit("WHILE " + c + " DO", at);
    opens("while", "ENDWHILE");
  }
  void do_(const At& at) {
    emit("REPEAT", at);
    opens("do", "UNTIL TRUE");
  }
  void until(const At& at) {
    const std::string c = truth(at);
    if (open_.empty() || open_.back().word != "do") {
      bad(at, "UNTIL has no open loop");
      return;
    }
    closes(at);
    blocks_.back().irl = "UNTIL " + c;
    close_block("end", at);
  }
  void for_(const At& at) {
    const Named name = named();
    expect("=");
    const Ex from = expression(25);
    expect("to");
    const Ex to = expression(25);
    Ex step = integer(1);
    if (accept("step")) step = expression(25);
    assign_to(name, from, at);
    const Ex v = variable(name, kReal, true, at);
    std::string text, behind;
    if (!from.ok || !to.ok || !step.ok || !v.ok || !step.is_literal || step.v == 0) {
      if (from.ok && to.ok && step.ok && v.ok) bad(at, "the step of this loop is unknown");
      emit("WHILE FALSE DO", at);
    } else {
      learned_.modal_varies.insert("=" + v.s);
      emit("WHILE " + v.s + (step.v < 0 ? " >= " : " <= ") + within(to, kSum) + " DO", at);
      behind = v.s + " := " + v.s + (step.v < 0 ? " - " : " + ") +
               (step.v < 0 ? negative(step) : step).s + ";";
    }
    opens("for", "ENDWHILE");
    open_.back().step = behind;
    const auto a = number_known(from), b = number_known(to);
    if (a && b && std::fabs(*a) < 1e6 && std::fabs(*b) < 1e6)
      loops_.emplace_back(v.s, std::pair{static_cast<std::int64_t>(std::min(*a, *b)),
                                         static_cast<std::int64_t>(std::max(*a, *b))});
    else loops_.emplace_back("?", std::pair{std::int64_t{0}, std::int64_t{0}});
  }
  void case_(const At& at) {
    open_case("end", at);
    expect("of");
    Open o;
    o.word = "case";
    o.before = next_;
    open_.push_back(std::move(o));
    forget();
  }
  void value_(const At& at) {
    if (open_.empty() || open_.back().word != "case") {
      bad(at, "VALUE is outside CASE");
      skip_rest();
      return;
    }
    std::vector<ArmValue> values;
    do {
      values.push_back({expression(25)});
    } while (accept(","));
    accept(":");
    if (blocks_.back().has_arm) arm_ends(at);
    open_arm(values, at);
  }
  void any(const At& at) {
    accept(":");
    if (open_.empty() || (open_.back().word != "case" && open_.back().word != "scase")) {
      bad(at, "ANY is outside CASE");
      return;
    }
    if (open_.back().word == "scase") {
      arm_ends(at);
      open_.back().has_else = true;
      between("ELSE", at);
      return;
    }
    if (blocks_.back().has_arm) arm_ends(at);
    open_.back().has_else = true;
    open_default(at);
  }
  void scase(const At& at) {
    const Ex e = expression();
    expect("of");
    Ex of = e;
    if (!e.ok || e.type.k != K::string) {
      if (e.ok) bad(at, "SCASE must select by a text");
      of = string("");
    }
    emit("IF FALSE THEN", at);
    opens("scase", "ENDIF");
    scases_[open_.size()] = of.s;
  }
  void svalue(const At& at) {
    if (open_.empty() || open_.back().word != "scase") {
      bad(at, "SVALUE is outside SCASE");
      skip_rest();
      return;
    }
    std::string c;
    do {
      const Ex n = expression(25);
      if (n.ok && n.type.k != K::string) bad(at, "SVALUE must be a text");
      c += (c.empty() ? "" : " OR ") + std::string("COMPARE(") + scases_[open_.size()] + ", " +
           (n.ok && n.type.k == K::string ? n.s : "''") + ") = 0";
    } while (accept(","));
    accept(":");
    arm_ends(at);
    between("ELSIF " + c + " THEN", at);
  }
  std::string label_here(const At& at) {
    const Token t = next();
    const std::string l = label_of(t);
    const Program& p = programs_[routine_];
    bool begins = true;
    for (std::size_t k = p.first; k < p.end; ++k) {
      if (begins && ((t.kind == Tk::number && tokens_[k].raw == t.raw) ||
                     (tokens_[k].low == t.low && t.kind == Tk::name && k + 1 < p.end &&
                      tokens_[k + 1].low == ":")))
        return label(l);
      begins = tokens_[k].kind == Tk::line;
    }
    bad(at, "the label " + std::string(t.raw.substr(0, 40)) + " does not exist in this program");
    return {};
  }
  void jump(const At& at) {
    settings_end(at);
    const std::string l = label_here(at);
    goal_.clear();
    if (accept("if")) {
      const std::string c = truth(at);
      if (!l.empty()) emit("IF " + c + " THEN GOTO " + l + "; ENDIF;", at);
      return;
    }
    if (!l.empty()) emit("GOTO " + l + ";", at);
  }
  void call_(const At& at) {
    const Token name = next();
    settings_end(at);
    forget();
    const Program* program = nullptr;
    std::size_t index = 0;
    for (std::size_t i = 0; i < programs_.size(); ++i)
      if (programs_[i].low == name.low) program = &programs_[i], index = i;
    if (program && index == main_index_) {
      bad(at, program->name + " is the program itself, which IRL cannot call");
      skip_rest();
      return;
    }
    std::vector<Ex> args;
    if (accept("(") && !accept(")")) {
      do {
        const Token first = peek();
        const std::string key = program && args.size() < program->parameters.size()
                                    ? program->low + "|" + program->parameters[args.size()].low
                                    : std::string();
        // A variable as it stands may be changed by the program that is called.
        std::size_t k = at_ + 1;
        if (k < tokens_.size() && tokens_[k].low == "[") {
          int depth = 0;
          do {
            depth += tokens_[k].low == "[" ? 1 : tokens_[k].low == "]" ? -1 : 0;
            ++k;
          } while (depth > 0 && k < end_ && tokens_[k].kind != Tk::line);
        }
        const bool is_variable = first.kind == Tk::name && k < tokens_.size() &&
                                 (tokens_[k].low == "," || tokens_[k].low == ")") &&
                                 !is_constant_word(first.low);
        Ex e;
        if (is_variable) {
          const Named v = named();
          const auto known = learned_.types.find(key);
          const Type of = known != learned_.types.end() ? known->second : guess(first.low);
          const bool is_out = program && args.size() < program->parameters.size() &&
                              is_changed(index, program->parameters[args.size()].low);
          if (known != learned_.types.end() && v.index.empty()) {
            const auto own = learned_.types.find(v.key);
            if (own != learned_.types.end() && own->second.k == K::real &&
                !learned_.flags.contains("valued number " + v.key) && of.k != K::real)
              own->second = of;
          }
          e = variable(v, of, is_out, at);
          if (is_out) learned_.modal_varies.insert("=" + e.s);
        } else {
          e = is_place_here() ? location() : expression();
        }
        if (!key.empty() && e.ok) {
          Type t = e.type.k == K::integer ? kReal : e.type;
          if (t.k == K::target) {
            t = kPose;
            if (has_axes(e))
              e = bad(first.at,
                      "a transformation with additional axes is not passed to another program",
                      "Let both programs use one variable, or pass joints.");
          }
          const auto it = learned_.types.find(key);
          if (it == learned_.types.end() ||
              !(is_variable && !learned_.flags.contains("valued number " + key) && t.k == K::real &&
                it->second.k != K::real))
            learn(key, t);
        }
        args.push_back(e);
      } while (accept(","));
      expect(")");
    }
    for (const Ex& e : args)
      if (!e.ok) return;
    if (!program && find(name.low) && find(name.low)->kind != Symbol::routine) {
      bad(at, "the program " + std::string(name.raw) + " is not in this file");
      return;
    }
    const std::string text = call(program ? key_of(index) : std::string(name.raw), args, at);
    if (!text.empty()) emit(text + ";", at);
  }
  void return_(const At& at) { emit("RETURN;", at); }
  void stop(const At& at) { emit(is_in_main() ? "RETURN;" : "HALT;", at); }
  void halt(const At& at) { emit("HALT;", at); }
  void pause(const At& at) { emit("PAUSE;", at); }
  void print(const At& at) {
    if (peek().kind == Tk::number && is(":", 1)) {
      next();
      next();
    }
    std::string list;
    bool ends_line = true, ok = true;
    while (!at_line_end()) {
      if (accept("/")) {
        const Token t = next();
        ends_line = t.low != "s";
        while (!at_line_end() && !is(",")) next();
      } else {
        Ex e;
        if (is("$encode") && is("(", 1)) {
          // A number as a text, which WRITE makes by itself.
          next();
          next();
          if (accept("/")) {
            next();
            while (!at_line_end() && !accept(",")) next();
          }
          e = expression();
          expect(")");
        } else {
          e = is_place_here() ? location() : expression();
        }
        ok = ok && e.ok;
        list += (list.empty() ? "" : ", ") + e.s;
      }
      if (!accept(",")) break;
    }
    if (!ok) return;
    is_passing_ = false;
    if (ends_line) emit("WRITELN(" + (list.empty() ? "''" : list) + ");", at);
    else if (!list.empty()) emit("WRITE(" + list + ");", at);
  }

  // ---- values ----

  static bool is_constant_word(const std::string& low) {
    return low == "true" || low == "false" || low == "on" || low == "off" || low == "pi" ||
           low == "null" || low == "here" || low == "tool" || low == "base";
  }
  /// Whether a location begins here, by what is known of names.
  bool is_place_here() const {
    const Token& t = peek(is("-") ? 1 : 0);
    static const std::set<std::string, std::less<>> kMakers{"trans", "shift", "frame",   "rx", "ry",
                                                            "rz",    "null",  "#ppoint", "#"};
    if (t.kind != Tk::name) return false;
    if (kMakers.contains(t.low)) return true;
    const auto it =
        learned_.types.find(t.low.starts_with(".") ? programs_[routine_].low + "|" + t.low : t.low);
    if (it == learned_.types.end()) return false;
    const Type& of =
        it->second.k == K::array && it->second.element ? *it->second.element : it->second;
    return of.k == K::pose || of.k == K::joint || of.k == K::target;
  }
  /// Places, joined by + and taken back by -.
  Ex location() {
    const bool before = std::exchange(wants_place_, true);
    Ex all = failed(), last = failed();
    bool is_first = true, is_sum = false, is_lost = false;
    const At at = here();
    do {
      bool is_inverse = false;
      if (!is_first) is_inverse = next().low == "-";
      while (accept("-")) is_inverse = !is_inverse;
      Ex e = primary();
      is_lost = is_lost || has_axes(last);
      last = is_inverse ? failed() : e;
      if (e.ok && (is_inverse || !is_first)) {
        e = pose_part(e, at);
        if (is_inverse && e.ok) e = value("INV(" + e.s + ")", kPose);
      }
      if (is_first) all = e;
      else all = binary(Op::compose, pose_part(all, at), e, at);
      is_sum = is_sum || is_inverse || !is_first;
      is_first = false;
      if (all.s.size() > 4000) {
        skip_rest();
        all = bad(at, "this position is too long");
      }
    } while (is("+") || is("-"));
    if (is_sum) all = sum_of(all, last, is_lost, at);
    wants_place_ = before;
    if (all.ok && all.type.k != K::pose && all.type.k != K::joint && all.type.k != K::target)
      return bad(at, "a position is expected here");
    return all;
  }
  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At& at) override {
    const auto is_place_of = [](const Ex& e) {
      return e.type.k == K::pose || e.type.k == K::target;
    };
    if (is_place_of(a) && is_place_of(b) && (op == Op::add || op == Op::sub)) {
      const Ex q = pose_part(b, at);
      if (op == Op::sub)
        return sum_of(binary(Op::compose, pose_part(a, at), value("INV(" + q.s + ")", kPose), at),
                      failed(), has_axes(a), at);
      return sum_of(binary(Op::compose, pose_part(a, at), q, at), b, has_axes(a), at);
    }
    if (op == Op::eq || op == Op::ne)
      for (const auto& [x, y] : {std::pair{&a, &b}, std::pair{&b, &a}})
        if (x->type.k == K::boolean && is_number(y->type)) {
          if (x->is_constant)
            return value(
                within(*y, kSum) + (op == Op::eq ? " = " : " <> ") + (x->v != 0 ? "-1.0" : "0.0"),
                kBool, kRel);
          if (y->is_literal && (y->v == 0 || y->v == -1))
            return value(
                within(*x, kSum) + " = " + ((y->v == -1) == (op == Op::eq) ? "TRUE" : "FALSE"),
                kBool, kRel);
          return bad(at, "a truth value is compared with a number other than -1 or 0");
        }
    return std::nullopt;
  }
  std::vector<Ex> numbers_in_brackets(const char* close, std::size_t most, const At& at) {
    const bool before = std::exchange(wants_place_, false);
    std::vector<Ex> out;
    while (!at_line_end() && !is(close) && out.size() < most) {
      out.push_back(is(",") ? real(0) : as_real(as_number(expression(), at), at));
      if (!accept(",")) break;
    }
    wants_place_ = before;
    expect(close);
    return out;
  }
  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (const auto e = literal_here()) return *e;
    if (accept("(")) {
      if (++depth_here_ > 100) {
        --depth_here_;
        skip_rest();
        return bad(at, "this is nested too deeply");
      }
      Ex e = wants_place_ ? location() : expression();
      --depth_here_;
      expect(")");
      e.is_grouped = true;
      return e;
    }
    if (const auto e = binary_here("^")) return *e;
    if (t.kind != Tk::name) {
      if (!at_line_end()) next();
      return bad(at, "a value is expected here");
    }
    if (t.low.size() > 1 && t.low[0] == '.' && t.low[1] >= '0' && t.low[1] <= '9') {
      next();
      return real(std::strtod(t.low.c_str(), nullptr));
    }
    if (t.low == "true" || t.low == "on") return next(), boolean(true);
    if (t.low == "false" || t.low == "off") return next(), boolean(false);
    if (t.low == "pi") return next(), real(3.141592653589793);
    if (t.low == "null") return next(), identity();
    if (t.low == "tool" && !is("[", 1)) return next(), get("tool", kPose, at);
    if (t.low == "base" && !is("[", 1)) return next(), get("frame", kPose, at);
    if (t.low == "here") return next(), present_location(at);
    if (t.low == "#here") return next(), present_joints();
    if (t.low == "dest" || t.low == "#dest") {
      next();
      return bad(at, "the robot's present position is not read", "Give the position itself.");
    }
    if (t.low == "#" && is("[", 1)) {
      next();
      next();
      return joint_values(numbers_in_brackets("]", 18, at), at);
    }
    if (is_array_mark(t)) {
      next();
      pass_array();
      return bad(at, "an array is not passed to another program",
                 "Let both programs use one array.");
    }
    if (is("(", 1)) return function(at);
    const Named v = named();
    const auto known = learned_.types.find(v.key);
    if (known != learned_.types.end() && wants_place_ && known->second.k == K::real &&
        v.index.empty() && !learned_.flags.contains("valued number " + v.key))
      known->second = kPose;
    if (wants_place_ && !v.index.empty()) learn_element(v.key, kPose);
    const Type of = guess(t.low).k != K::real ? guess(t.low) : wants_place_ ? kPose : kReal;
    return variable(v, of, false, at);
  }
  /// An array as a parameter: .&name[,]
  [[nodiscard]] static bool is_array_mark(const Token& t) { return t.low == "."; }
  void pass_array() {
    accept("&");
    if (!at_line_end()) next();
    if (!accept("[")) return;
    while (!at_line_end() && !accept("]")) next();
  }
  Ex joint_values(const std::vector<Ex>& n, const At& at) {
    for (const Ex& e : n)
      if (!e.ok) return failed();
    if (n.size() < 3) return bad(at, "joint values must be at least three numbers");
    std::vector<Ex> axes, outer;
    for (std::size_t k = 0; k < n.size(); ++k) (k < 6 ? axes : outer).push_back(n[k]);
    return joints(axes, outer);
  }
  Ex function(const At& at) {
    const Token t = next();
    next();
    const std::string& w = t.low;
    if (w == "sig") {
      const Ex e = signal_condition(at);
      expect(")");
      return e;
    }
    if (w == "bits") {
      const Ex n = expression();
      expect(",");
      const Ex b = expression();
      expect(")");
      const auto number = number_known(n), width = number_known(b);
      if (!n.ok || !b.ok) return failed();
      if (!number || !width || *number < 1 || *number > 100'000 || *width < 1 || *width > 31)
        return bad(at, "IRL has no signals with computed numbers, and at most 31 bits");
      const Symbol& s =
          signal_of(static_cast<std::int64_t>(*number), static_cast<std::int64_t>(*width));
      return converted(place(s.irl, s.type), kInt, at);
    }
    if (w == "trans") {
      std::vector<Ex> n = numbers_in_brackets(")", 18, at);
      for (const Ex& e : n)
        if (!e.ok) return failed();
      while (n.size() < 6) n.push_back(real(0));
      return place_of(n);
    }
    if (w == "#ppoint") return joint_values(numbers_in_brackets(")", 18, at), at);
    if (w == "rx" || w == "ry" || w == "rz") {
      const std::vector<Ex> n = numbers_in_brackets(")", 1, at);
      if (n.empty() || !n[0].ok) return n.empty() ? bad(at, "an angle is expected here") : failed();
      std::vector<Ex> a(3, real(0));
      a[static_cast<std::size_t>(w[1] - 'x')] = n[0];
      return pose({real(0), real(0), real(0)}, orientation("ORIXYZ", a));
    }
    if (w == "shift") {
      if (is("here") && is("by", 1)) {
        next();
        next();
        const std::vector<Ex> n = numbers_in_brackets(")", 3, at);
        return step_from_here(n, at);
      }
      const Ex p = location();
      expect("by");
      std::vector<Ex> n = numbers_in_brackets(")", 3, at);
      while (n.size() < 3) n.push_back(real(0));
      const Ex q = pose_part(p, at);
      return q.ok ? carried(offset(q, n[0], n[1], n[2], at), p, at) : failed();
    }
    if (w == "dx" || w == "dy" || w == "dz") {
      const Ex p = as_pose(as_place(location()), at);
      expect(")");
      if (!p.ok) return p;
      return value(within(p, kPrimary) + ".POS." + static_cast<char>(w[1] - 32), kReal);
    }
    if (w == "distance") {
      const Ex a = as_pose(as_place(location()), at);
      expect(",");
      const Ex b = as_pose(as_place(location()), at);
      expect(")");
      if (!a.ok || !b.ok) return failed();
      return value(
          helper("distance") + "(" + within(a, kPrimary) + ".POS, " + within(b, kPrimary) + ".POS)",
          kReal);
    }
    if (w == "timer" || w == "utimer") {
      skip_rest();
      return bad(at, "IRL has no timers that run in parallel to the program");
    }
    const bool before = std::exchange(wants_place_, false);
    const auto a = arguments();
    wants_place_ = before;
    for (const Ex& e : a)
      if (!e.ok) return failed();
    static const std::map<std::string, std::string, std::less<>> kMath{
        {"sin", "SIN"},   {"cos", "COS"},     {"tan", "TAN"},   {"asin", "ASIN"},
        {"acos", "ACOS"}, {"atan2", "ATAN2"}, {"sqrt", "SQRT"}, {"exp", "EXP"},
        {"ln", "LN"},     {"abs", "ABS"},     {"int", "TRUNC"}, {"round", "ROUND"}};
    if (const auto it = kMath.find(w); it != kMath.end()) return math(it->second, a, at);
    if (w == "len" && a.size() == 1 && a[0].type.k == K::string)
      return value("LENGTH(" + a[0].s + ")", kInt);
    if (w == "not" && a.size() == 1) {
      const Ex b = converted(a[0], kBool, at);
      return b.ok ? value("NOT " + within(b, kRel), kBool, kNot) : b;
    }
    return bad(at, std::string(t.raw.substr(0, 40)) + " is a controller function and is not read");
  }
  /// LMOVE SHIFT(HERE BY x, y, z): by so much along the base's axes.
  Ex step_from_here(const std::vector<Ex>& n, const At& at) {
    const bool is_alone =
        at_line_end() && (word_ == "jmove" || word_ == "lmove") && tokens_[at_ - 1].low == ")";
    for (const Ex& e : n)
      if (!e.ok) return failed();
    if (!is_alone)
      return bad(at, "the robot's present position is not read", "Give the position itself.");
    if (is_set("frame"))
      return bad(at, "a step from HERE after BASE is not read", "Give the position itself.");
    std::vector<Ex> by = n;
    while (by.size() < 3) by.push_back(real(0));
    step(word_[0] == 'j' ? "PTP" : "LIN", by, at);
    Ex done = failed();
    return done;
  }

  std::vector<Program> programs_;
  std::vector<Data> data_;
  std::set<std::string> used_, labels_;
  std::size_t routine_ = 0, end_ = 0, main_index_ = 0;
  std::string word_, goal_;  ///< goal_: where the motion above has ended
  Next next_, via_next_;
  std::optional<Ex> via_;
  std::vector<Open> open_;
  std::vector<std::pair<std::string, std::pair<std::int64_t, std::int64_t>>> loops_;
  std::map<std::size_t, std::string> scases_;
  std::map<std::string, bool> said_;
  /// Pose and additional axes of targets that are written out.
  std::map<std::string, std::pair<Ex, std::vector<Ex>>> made_;
  std::set<std::string> unvalued_;
  std::optional<bool> configuration_[3];  ///< as it was set above: other shoulder, elbow, wrist
  bool wants_place_ = false;              ///< names of which nothing is known are places
  bool is_passing_ = false;               ///< the motion above may not have ended yet
  int depth_here_ = 0;
};

}  // namespace

Made read_as(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<AsReader>(task, params, progress);
}

}  // namespace robomosp::readers
