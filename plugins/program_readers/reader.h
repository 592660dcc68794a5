// SPDX-License-Identifier: Apache-2.0
// Shared by all readers: tokens, typed expressions, names, routines and the IRL written from them
// (plugin program_readers). Nothing here is shared with post-processors, so that their output is
// read independently.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include <robomosp/sdk/program_reader.h>

#include "maker_words.h"

namespace robomosp::readers {

inline constexpr double kDegree = 57.29577951308232;  ///< degrees in a radian

/// A place in a file that is read; line and column count from 1.
struct At {
  std::uint32_t file = 0, line = 1, column = 1, begin = 0, end = 0;
};

enum class Tk : std::uint8_t { name, number, text, sign, line, end };
struct Token {
  Tk kind = Tk::end;
  std::string_view raw;  ///< as written; of texts the part between the quotes
  std::string low;       ///< lower-case, of names and signs
  double value = 0;
  bool is_integer = false;
  At at;
};

/// Lexical rules of a language.
struct Style {
  std::string_view comment;             ///< begins one, to the end of the line
  std::string_view quotes = "\"";       ///< of texts
  std::string_view name_first = "_";    ///< first character of a name, besides letters
  std::string_view name_rest = "_";     ///< further characters of a name, besides letters and
                                        ///< digits
  std::vector<std::string_view> signs;  ///< of several characters, the longest first
  bool has_lines = true;                ///< ends of lines are tokens
  bool joins_in_brackets = false;       ///< not within ( ) and [ ]
  std::string_view hex = {};            ///< prefix of a hexadecimal number, lower-case: "0x"
};
struct Comment {
  std::uint32_t line;
  std::string text;
};

// ---- types and expressions of IRL ----

enum class K : std::uint8_t {
  none,
  integer,
  real,
  boolean,
  character,
  string,
  position,
  orientation,
  pose,
  joint,
  target,
  record,
  array
};
struct Type {
  K k = K::none;
  std::string record;  ///< name in IRL
  std::vector<std::pair<std::int64_t, std::int64_t>> bounds;
  std::shared_ptr<const Type> element;
  bool operator==(const Type& b) const {
    return k == b.k && record == b.record && bounds == b.bounds && (!element == !b.element) &&
           (!element || *element == *b.element);
  }
};
inline const Type kNone{};
inline const Type kReal{.k = K::real, .record = {}, .bounds = {}, .element = {}};
inline const Type kInt{.k = K::integer, .record = {}, .bounds = {}, .element = {}};
inline const Type kBool{.k = K::boolean, .record = {}, .bounds = {}, .element = {}};
inline const Type kString{.k = K::string, .record = {}, .bounds = {}, .element = {}};
inline const Type kPosition{.k = K::position, .record = {}, .bounds = {}, .element = {}};
inline const Type kOrientation{.k = K::orientation, .record = {}, .bounds = {}, .element = {}};
inline const Type kPose{.k = K::pose, .record = {}, .bounds = {}, .element = {}};
inline const Type kTarget{.k = K::target, .record = {}, .bounds = {}, .element = {}};
inline const Type kJoint{.k = K::joint, .record = {}, .bounds = {}, .element = {}};
[[nodiscard]] bool is_number(const Type&);
[[nodiscard]] Type array_of(Type element, std::vector<std::pair<std::int64_t, std::int64_t>>);

/// Precedences of IRL, loose to tight.
enum : int { kOr = 1, kAnd, kNot, kRel, kSum, kTerm, kSign, kPrimary };
struct Ex {
  std::string s;
  int prec = kPrimary;
  Type type;
  bool ok = true;
  bool is_literal = false;  ///< a known number, `v`
  double v = 0;
  bool is_place = false;     ///< may be assigned
  bool is_constant = false;  ///< consists of numbers only
  bool is_grouped = false;   ///< was in parentheses
  bool of_truths = false;    ///< compares truth values
  std::string setter;        ///< the statement that assigns it, with "%" for the value
};
[[nodiscard]] std::string within(const Ex&, int prec);  ///< in parentheses where needed
[[nodiscard]] Ex integer(std::int64_t);
[[nodiscard]] Ex real(double);
/// The same, without the rounding digits of a unit conversion.
[[nodiscard]] Ex measure(double);
[[nodiscard]] Ex boolean(bool);
[[nodiscard]] Ex string(std::string_view);
[[nodiscard]] Ex place(std::string s, Type);
[[nodiscard]] Ex value(std::string s, Type, int prec = kPrimary);
[[nodiscard]] Ex failed();
[[nodiscard]] Ex scaled(const Ex&, double);
[[nodiscard]] Ex negative(const Ex&);
[[nodiscard]] std::string number_text(double);
[[nodiscard]] std::string lower(std::string_view);
/// Rotation about a vector by its length [rad] as w, x, y, z.
void quaternion_of_vector(const double (&r)[3], double (&q)[4]);

/// Operation of a language's binary operator.
enum class Op : std::uint8_t {
  or_,
  and_,
  exor,
  eq,
  ne,
  lt,
  gt,
  le,
  ge,
  add,
  sub,
  mul,
  div,
  idiv,
  mod,
  compose,
  power
};
struct Binary {
  std::string_view word;  ///< lower-case
  int prec;               ///< of the language, tight is great
  Op op;
};

struct Symbol {
  enum Kind : std::uint8_t {
    variable,
    constant,
    routine,
    input,
    output,
    label,
    data
  } kind = variable;
  std::string irl;
  Type type;  ///< of routines the result
  struct Parameter {
    Type type;
    bool is_out = false;
  };
  std::vector<Parameter> parameters;
  std::map<std::string, Ex> fields;  ///< of data that the reader itself uses
  bool is_in_parameter = false;
};

struct Line {
  std::string s;
  At at;
  bool is_mapped = false;
};
struct Routine {
  std::string key;   ///< its name in the source, lower-case
  std::string head;  ///< without ";"
  std::string end = "ENDPROC";
  At at;
  Type result;
  std::vector<Line> locals, body;
  int indent = 1;
  std::map<std::string, Symbol> symbols;
};

/// Suffix of the warning for a setting that affects neither paths nor signals.
inline constexpr const char* kOtherTimes = "; the path stays the same, and times differ";

/// Marks within lines of the IRL while it is read: a number between them is a use or a change of a
/// setting.
inline constexpr char kUseMark = '\x01', kChangeMark = '\x03', kMarkEnd = '\x02';

/// Facts learned by one pass over the source for the next one.
struct Learned {
  std::map<std::string, Type> types;               ///< of names that are never declared
  std::map<std::string, std::vector<Type>> stubs;  ///< missing routines
  std::map<std::string, Type> stub_results;
  std::map<std::string, std::set<std::string>>
      modal;  ///< settings that are set, and values of names
  std::set<std::string> modal_varies;
  std::set<std::string> flags;                           ///< further facts noted by a reader
  std::map<std::string, std::string> constant_settings;  ///< settings with one value wherever used
  /// Uses of a setting without a previous assignment: its key, file and offset.
  std::set<std::tuple<std::string, std::uint32_t, std::uint32_t>> unset_uses;
  std::map<std::tuple<std::string, std::uint32_t, std::uint32_t>, std::string> known_uses;
  int external_axes = 0;
  int turns = 0;
  int axes = 6;                   ///< of MAIN_JOINT
  bool has_robot_joints = false;  ///< MAIN_JOINT is of the model's joints, not the maker's axes
  bool operator==(const Learned&) const = default;
};

class Output;

/// A pass of a reader over a program, shared by all languages.
class Reader {
 public:
  Reader(std::span<const SourceFile> files, Learned& learned, const Params& params,
         Progress& progress);
  virtual ~Reader() = default;
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  virtual void run() = 0;
  /// Language of the built-in names, which are not routines of users.
  [[nodiscard]] virtual MakerLanguage language() const { return MakerLanguage::none; }
  /// Determines the value of each setting for every motion, and reports targets without a value;
  /// called after run().
  void settle();
  /// The program as files; called once, after settle().
  [[nodiscard]] std::unique_ptr<ReadProgram> finish();
  [[nodiscard]] bool is_cancelled() const { return is_cancelled_; }

 protected:
  // ---- faults ----
  void fault(std::uint32_t severity, const At&, std::string message, std::string hint = {});
  void warn(const At& at, std::string message, std::string hint = {}) {
    fault(RMP_FAULT_WARNING, at, std::move(message), std::move(hint));
  }
  void fail(const At& at, std::string message, std::string hint = {}) {
    fault(RMP_FAULT_ERROR, at, std::move(message), std::move(hint));
  }
  void note(const At& at, std::string message, std::string hint = {}) {
    fault(RMP_FAULT_NOTE, at, std::move(message), std::move(hint));
  }
  /// Drops faults at ignored places, among those after the first `kept`.
  void drop_faults(std::size_t kept, const std::function<bool(const At&)>& is_dropped);
  [[nodiscard]] std::size_t fault_count() const { return faults_.size(); }
  /// Reports why the current statement cannot be read: it becomes a comment with this fault.
  Ex bad(const At&, std::string message, std::string hint = {});
  /// Reads a statement; if it is faulty, the fault is reported and a comment is left.
  void statement(const At& from, const std::function<void()>& read);
  /// The same for a condition, which is then replaced by `otherwise`.
  Ex condition(const At& from, const std::function<Ex()>& read);
  /// Reports that a statement of the source has no equivalent: a comment and a fault.
  void left_out(std::uint32_t severity, const At& at, std::string message, std::string hint = {});
  [[nodiscard]] std::string source_line(const At&) const;

  // ---- tokens ----
  /// A part of a file: bytes, and where its first line is.
  struct Part {
    std::size_t begin = 0, end = std::string_view::npos;
    std::uint32_t line = 1;
  };
  void scan(std::size_t file, const Style&, const Part&);
  void scan(std::size_t file, const Style& style) { scan(file, style, Part{}); }
  [[nodiscard]] const Token& peek(std::size_t n = 0) const;
  Token next();
  [[nodiscard]] bool is(std::string_view word, std::size_t n = 0) const;  ///< name or sign
  bool accept(std::string_view word);
  /// Number of tokens of the current text that are this word.
  [[nodiscard]] std::size_t uses(const std::string& low);
  bool expect(std::string_view word);
  [[nodiscard]] bool at_end() const { return peek().kind == Tk::end; }
  [[nodiscard]] bool at_line_end() const {
    return peek().kind == Tk::line || peek().kind == Tk::end;
  }
  void skip_line();
  /// Skips the rest of a faulty statement.
  virtual void skip_rest();
  /// Skips the rest of a faulty condition, so that the statements it controls are read.
  virtual void skip_condition() {}
  void note_line(const At&, std::string what);  ///< a comment and a note
  /// In a motion without tool or frame: identity.
  static Ex identity();
  [[nodiscard]] At here() const { return peek().at; }

  // ---- expressions ----
  [[nodiscard]] virtual std::span<const Binary> binaries() const { return {}; }
  [[nodiscard]] virtual std::string_view not_word() const { return "not"; }
  /// Origin of the turns of its targets [degrees]: -180, or 0 (R_TURNS_FROM of the cell).
  [[nodiscard]] virtual int turns_from() const { return -180; }
  [[nodiscard]] virtual int not_precedence() const { return 100; }
  [[nodiscard]] virtual bool divides_whole() const { return false; }
  virtual Ex primary() = 0;
  /// The number or string at this position, if there is one.
  std::optional<Ex> literal_here();
  /// The binary number at this position, such as &B101 if `sign` is "&": up to 31 bits.
  std::optional<Ex> binary_here(std::string_view sign);
  /// Hook for special combinations of two operands; nothing = the usual operation.
  virtual std::optional<Ex> special(Op, const Ex&, const Ex&, const At&) { return std::nullopt; }
  Ex expression(int least = 0);
  Ex binary(Op, const Ex&, const Ex&, const At&);
  Ex converted(const Ex&, const Type&, const At&);
  Ex as_integer(const Ex&, const At&);
  Ex as_real(const Ex&, const At&);
  Ex as_pose(const Ex&, const At&);
  std::vector<Ex> arguments(std::string_view close = ")");
  /// A function common to many languages, by its name in IRL; angles in radians or degrees.
  Ex math(std::string_view irl, const std::vector<Ex>& args, const At&, bool radians = false);
  Ex pose(const std::vector<Ex>& xyz, const Ex& orientation);
  Ex position(const std::vector<Ex>& xyz);
  Ex offset(const Ex& place, const Ex& x, const Ex& y, const Ex& z, const At&);
  Ex with_pose(const Ex& target, const Ex& pose);
  /// The pose reached by joints, for motions along paths; others are unchanged.
  Ex as_place(const Ex&);
  Ex orientation(std::string_view function, const std::vector<Ex>& args);
  /// `a` are the axes [deg], then the external ones [mm or deg].
  Ex joints(const std::vector<Ex>& a, const std::vector<Ex>& external);
  Ex target(const Ex& pose, const Ex& status, const std::vector<Ex>& turns,
            const std::vector<Ex>& external);
  [[nodiscard]] Type joint_type() const;

  // ---- names, declarations, routines ----
  [[nodiscard]] std::string irl_name(std::string_view foreign);
  [[nodiscard]] std::string type_text(const Type&) const;
  [[nodiscard]] std::string initial(const Type&) const;  ///< "" = zero is good
  Symbol* find(std::string_view low);
  Symbol& declare(std::string_view foreign, Type, Symbol::Kind = Symbol::variable,
                  bool is_local = false);
  void declare_variable(const Symbol&, std::string value, const At&, bool is_local = false);
  /// False where the language itself gives variables of this kind a value at their declaration.
  [[nodiscard]] virtual bool begins_without_value(K) const { return true; }
  /// Of a target that its declaration gives no value: a motion to it is an error unless the program
  /// gives it one.
  void without_value(const Symbol&);
  /// A variable that its first use declares, of a type that later uses may widen.
  Symbol& implied(std::string_view foreign, const Type&, const At&);
  void learn(std::string_view foreign, const Type&);
  Symbol& signal(bool is_output, std::int64_t number, std::int64_t width = 1);
  /// A signal named by the program; with its number, unless that is -1.
  Symbol& named_signal(std::string_view foreign, bool is_output, const Type&, const At&,
                       std::int64_t number = -1);
  struct Parameter {
    std::string foreign;
    Type type;
    bool is_out = false;
  };
  /// Declares a routine, so that earlier calls of it are understood.
  void announce(std::string_view foreign, const std::vector<Parameter>&, const Type& result);
  /// Begins an announced routine. A modified parameter that is not OUT gets a variable.
  void begin(std::string_view foreign, const std::vector<Parameter>&, const Type& result,
             const At&);
  /// True if an expression calls a routine, so that it cannot be in a declaration.
  [[nodiscard]] bool calls_routine(const std::string& text) const;
  /// Called before a variable is changed.
  void will_write(std::string_view low);
  Routine& open(std::string_view head, std::string_view end, const At&);
  void close();
  Routine& current() { return *current_; }
  void set_current(Routine& r) { current_ = &r; }
  [[nodiscard]] bool is_in_main() const { return current_ == &main_; }
  void emit(std::string s, const At&);
  void indented(int by);
  void comments_until(const At&);
  void assign(const Ex& to, const Ex& from, const At&);
  /// Calls a routine that may be missing: a stub is created then.
  std::string call(std::string_view foreign, const std::vector<Ex>& args, const At&,
                   std::optional<Type> result = std::nullopt);
  std::string helper(std::string_view name);
  /// A pulse that ends by itself: the output is set to `first` now and to `then` after a time,
  /// while the program continues.
  void pulse_of(const Ex& output, const std::string& first, const std::string& then,
                const Ex& seconds, const At&);
  std::string label(std::string_view foreign);
  /// LABEL of this name; a second one of the routine is a fault.
  void place_label(std::string_view foreign, const At&);
  /// True if a name of the scanned text is followed by a colon, or is so at the beginning of a
  /// line.
  [[nodiscard]] bool has_label(const std::string& low, bool begins_line);

  // ---- blocks ----
  /// An open block of the source.
  struct Block {
    std::string word;      ///< its end in the source
    std::string irl;       ///< its end in IRL, without ";"
    bool has_arm = false;  ///< of a CASE: one of its arms is open
    bool has_else = false;
    bool is_dead = false;                     ///< code after an unread branch is within IF FALSE
    std::optional<Ex> tested = std::nullopt;  ///< of a CASE
    bool is_chain = false;                    ///< a CASE that is written as IF and ELSIF
    std::set<std::string> values = {};
    bool is_reported = false;  ///< statements before its first branch were reported
  };
  /// A value of an arm of CASE, or a range.
  struct ArmValue {
    Ex from;
    std::optional<Ex> to = std::nullopt;
  };
  void open_block(std::string_view word, std::string irl);
  /// The innermost block ends with this word.
  [[nodiscard]] bool is_in(std::string_view word) const;
  /// Ends the innermost block; the statement is faulty if another word ends it.
  bool close_block(std::string_view word, const At&,
                   std::string otherwise = "no block is open here");
  /// Closes open blocks at the end of a routine, with a fault each.
  void close_blocks(const At&);
  /// ELSE and ELSIF of the innermost block.
  void between(const std::string& head, const At&);
  /// CASE of the value at this position; a value that is not a whole number is compared by IF and
  /// ELSIF.
  void open_case(std::string_view word, const At& at);
  /// A branch of the innermost block, which is a CASE. Without values it is one that was not read.
  void open_arm(const std::vector<ArmValue>& values, const At& at);
  void open_default(const At& at);
  /// A loop with an unread head: its body is kept and never runs.
  void open_unread_loop(std::string_view word, const At& at);
  /// A condition as text.
  std::string truth(const At& at) {
    return condition(at, [&] { return expression(); }).s;
  }

  // ---- motions and settings ----
  struct Motion {
    std::string_view word = "LIN";
    bool is_incremental = false;
    std::vector<Ex> targets;
    std::vector<std::pair<std::string, Ex>> attributes;
    std::string until;
    bool has_frames = true;         ///< moves to poses in the current frame
    bool has_tool = true;           ///< false = with the robot's default tool, regardless of the
                                    ///< setting
    std::optional<Ex> tool, frame;  ///< of this motion only, overriding the settings
  };
  void move(Motion, const At&);
  /// The robot's pose as a target with its configuration, as a motion with this tool and frame
  /// would name it. Without a tool it is for the robot's default tool.
  Ex present_target(const std::optional<Ex>& tool, const std::optional<Ex>& frame);
  /// The same with the tool and the frame that are set here.
  Ex present_target(const At&);
  /// The robot's current axes.
  Ex present_joints();
  // Settings, such as "tool" and "frame", apply from where they are set. Using one that was not set
  // before is an error, since the controller's value is unknown.
  /// The initial value of a setting, if the language defines it.
  void starts_with(std::string_view modal, const Ex&);
  void set(std::string_view modal, const Ex&, const At&);
  /// From here on, its value is that of the controller, which is unknown.
  void forget(std::string_view modal, const At&);
  /// Assigns a component of a setting: `to` is a component of get().
  void set_part(std::string_view modal, const Ex& to, const Ex& from, const At&);
  /// True if the program sets it anywhere.
  [[nodiscard]] bool is_set(std::string_view modal) const;
  /// True if the program sets it before this place, on some path at least; counts as a use.
  [[nodiscard]] bool is_set_before(std::string_view modal, const At&);
  Ex get(std::string_view modal, const Type&, const At&);
  /// Sets a setting that the reader itself evaluates, as a word, from here on.
  void set_mode(std::string_view modal, const std::string& word, const At&);
  /// Its current word; "" where paths with different words meet.
  std::string mode(std::string_view modal, const std::string& at_start, const At&);
  /// The name of a setting in messages.
  [[nodiscard]] virtual std::string setting_name(const std::string& key) const;

  std::span<const SourceFile> files_;
  Learned& learned_;
  const Params& params_;
  Progress& progress_;
  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  std::vector<Comment> comments_;
  std::size_t next_comment_ = 0;
  std::uint32_t comment_file_ = 0;
  std::string name_ = "program";
  bool strings_are_lists_ = false;
  std::map<std::string, Symbol> globals_;
  std::map<std::string, std::vector<std::pair<std::string, Type>>> records_;  ///< by IRL name
  std::vector<Line> types_, constants_, signals_, variables_;
  Routine main_;
  std::vector<Block> blocks_;  ///< of the routine that is read

 private:
  struct Fault {
    std::uint32_t severity;
    At at;
    std::string message, hint;
  };
  struct SettingUse {
    std::string key;
    At at;
    bool is_relevant = true;   ///< the motion depends on it
    bool is_left_out = false;  ///< omitted if it is not set
  };
  struct SettingChange {
    std::string key, text;
    bool is_constant = false, is_part = false, is_unset = false;
  };
  /// The current tool or frame; nothing if it was not set before.
  std::optional<Ex> setting_here(const std::string& key, const At&, bool is_relevant);
  /// A function call as a statement: a variable receives its value.
  std::string unused(const std::string& call, const Type&, const At&);
  /// Reports jumps that IRL does not allow.
  void check_jumps();
  /// Reports motions to targets that have no value, or only some components.
  void check_targets();
  void open_dead(const At&);
  void close_dead(const At&);
  void declare_modal(const std::string& key, const Type&, const At&);
  void use_setting(const std::string& key, const At&, bool is_relevant, bool is_left_out);
  /// Marks of the uses since the last written line.
  std::string take_marks();
  std::vector<SettingUse> uses_of_settings_;
  std::vector<SettingChange> changes_;
  std::vector<std::size_t> pending_uses_;
  std::map<std::string, std::string> at_start_;
  Ex unary(int least);
  std::vector<Fault> faults_, pending_;
  std::size_t dropped_faults_ = 0;
  Routine* current_ = &main_;
  std::deque<Routine> routines_;
  std::set<std::string> used_names_, begun_, routine_names_;
  std::vector<std::pair<std::string, K>> unvalued_targets_;  ///< by their names in IRL
  std::map<std::string, int> name_counts_;
  std::map<std::string, std::string> labels_;
  std::set<std::pair<const Routine*, std::string>> placed_labels_;
  std::unordered_map<std::string, bool> colons_;  ///< names before colons; true = at the beginning
                                                  ///< of a line
  bool has_colons_ = false;
  std::set<std::string> helpers_;
  std::map<std::string, std::size_t> uses_;  ///< of words, counted on first use
  std::vector<std::vector<std::uint32_t>> line_starts_;
  int depth_ = 0;
  bool is_cancelled_ = false;
};

/// Runs passes of one reader until nothing new is learned.
template <class R>
Result<std::unique_ptr<ReadProgram>> passes(const ProgramReaderTask& task, const Params& params,
                                            Progress& progress);
[[nodiscard]] Result<void> fits(std::span<const SourceFile> files);
[[nodiscard]] Error cancelled();

template <class R>
Result<std::unique_ptr<ReadProgram>> passes(const ProgramReaderTask& task, const Params& params,
                                            Progress& progress) {
  RMP_TRY(fits(task.files));
  Learned learned;
  for (int pass = 0;; ++pass) {
    const Learned before = learned;
    R reader(task.files, learned, params, progress);
    reader.run();
    if (reader.is_cancelled()) return cancelled();
    reader.settle();
    if (pass > 0 && (learned == before || pass == 7)) return reader.finish();
  }
}

/// Parameters of readers that only inspect names.
class NoParams final : public Params {
 public:
  [[nodiscard]] bool has(std::string_view) const override { return false; }
  [[nodiscard]] double real(std::string_view) const override { return 0; }
  [[nodiscard]] long long integer(std::string_view) const override { return 0; }
  [[nodiscard]] bool boolean(std::string_view) const override { return false; }
  [[nodiscard]] std::string_view text(std::string_view) const override { return {}; }
  [[nodiscard]] std::span<const double> reals(std::string_view) const override { return {}; }
  [[nodiscard]] Pose pose(std::string_view) const override { return {}; }
};

/// "x.src" gives "x"; letters and digits only, so that it names a program.
[[nodiscard]] std::string_view stem(std::string_view file);
[[nodiscard]] std::string extension(std::string_view file);
/// True if a line of a text begins with a word, ignoring case.
[[nodiscard]] bool has_line(std::string_view text, std::string_view word);

}  // namespace robomosp::readers
