// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.module/1: commands, settings and hooks around runs that a plugin adds to the
// program (layer: contract, std only).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// What commands take and give: nothing, a bool, a number, a text, numbers as a vector or matrix, a
/// list, a map in the order it was filled, or a reference to a record, recording, job or run.
/// Numbers are SI and radians. A type that a later SDK adds has a number behind the last one here;
/// its content is then in the existing fields or in `room`.
class ModuleValue {
 public:
  enum class Type : std::uint32_t {
    none = 0,
    boolean = 1,
    integer = 2,
    real = 3,
    text = 4,
    numbers = 5,
    list = 6,
    map = 7,
    reference = 8
  };

  ModuleValue() = default;
  ModuleValue(bool v) : type_(Type::boolean), integer_(v ? 1 : 0) {}  // NOLINT: implicit
  ModuleValue(int v) : type_(Type::integer), integer_(v) {}           // NOLINT
  ModuleValue(std::int64_t v) : type_(Type::integer), integer_(v) {}  // NOLINT
  ModuleValue(std::size_t v)                                          // NOLINT
      : type_(Type::integer), integer_(static_cast<std::int64_t>(v)) {}
  ModuleValue(double v) : type_(Type::real), real_(v) {}                  // NOLINT
  ModuleValue(const char* v) : type_(Type::text), text_(v) {}             // NOLINT
  ModuleValue(std::string_view v) : type_(Type::text), text_(v) {}        // NOLINT
  ModuleValue(std::string v) : type_(Type::text), text_(std::move(v)) {}  // NOLINT
  ModuleValue(std::vector<double> v, std::string unit = {})               // NOLINT
      : type_(Type::numbers), text_(std::move(unit)), numbers_(std::move(v)) {
    rows_ = numbers_.size();
  }
  ModuleValue(const Vec3& v) : ModuleValue(std::vector<double>(v.begin(), v.end())) {}  // NOLINT

  /// Row-major, rows * columns numbers.
  [[nodiscard]] static ModuleValue matrix(std::vector<double> v, std::size_t rows,
                                          std::size_t columns, std::string unit = {}) {
    ModuleValue m(std::move(v), std::move(unit));
    m.rows_ = rows;
    m.columns_ = columns;
    return m;
  }
  [[nodiscard]] static ModuleValue list(std::vector<ModuleValue> items = {}) {
    ModuleValue v;
    v.type_ = Type::list;
    v.items_ = std::move(items);
    return v;
  }
  [[nodiscard]] static ModuleValue map() {
    ModuleValue v;
    v.type_ = Type::map;
    return v;
  }
  /// Of what lives in the program: "robot" and its number, as an argument or a result gave it.
  [[nodiscard]] static ModuleValue reference(std::string kind, std::uint64_t number) {
    ModuleValue v;
    v.type_ = Type::reference;
    v.text_ = std::move(kind);
    v.integer_ = static_cast<std::int64_t>(number);
    return v;
  }

  [[nodiscard]] Type type() const { return type_; }
  [[nodiscard]] bool is_none() const { return type_ == Type::none; }
  /// The content; of another type the value that a new one would have.
  [[nodiscard]] bool boolean() const { return type_ == Type::boolean && integer_ != 0; }
  [[nodiscard]] std::int64_t integer() const { return type_ == Type::integer ? integer_ : 0; }
  /// Of an integer or a real.
  [[nodiscard]] double real() const {
    return type_ == Type::real      ? real_
           : type_ == Type::integer ? static_cast<double>(integer_)
                                    : 0.0;
  }
  [[nodiscard]] const std::string& text() const { return type_ == Type::text ? text_ : no_text(); }
  [[nodiscard]] const std::vector<double>& numbers() const { return numbers_; }
  [[nodiscard]] std::size_t rows() const { return type_ == Type::numbers ? rows_ : 0; }
  /// 0 of a vector.
  [[nodiscard]] std::size_t columns() const { return type_ == Type::numbers ? columns_ : 0; }
  /// Unit of numbers; "" = none is given.
  [[nodiscard]] const std::string& unit() const {
    return type_ == Type::numbers ? text_ : no_text();
  }
  /// Kind and number of a reference.
  [[nodiscard]] const std::string& kind() const {
    return type_ == Type::reference ? text_ : no_text();
  }
  [[nodiscard]] std::uint64_t number() const {
    return type_ == Type::reference ? static_cast<std::uint64_t>(integer_) : 0;
  }

  /// Items of a list, values of a map.
  [[nodiscard]] std::size_t size() const { return items_.size(); }
  [[nodiscard]] const ModuleValue& item(std::size_t i) const { return items_.at(i); }
  [[nodiscard]] const std::string& key(std::size_t i) const { return keys_.at(i); }
  void add(ModuleValue item) { items_.push_back(std::move(item)); }
  /// Of a map; replaces or appends.
  ModuleValue& set(std::string key, ModuleValue value) {
    for (std::size_t i = 0; i < keys_.size(); ++i)
      if (keys_[i] == key) {
        items_[i] = std::move(value);
        return *this;
      }
    keys_.push_back(std::move(key));
    items_.push_back(std::move(value));
    return *this;
  }
  [[nodiscard]] const ModuleValue* find(std::string_view key) const {
    for (std::size_t i = 0; i < keys_.size(); ++i)
      if (keys_[i] == key) return &items_[i];
    return nullptr;
  }
  /// Entries of a map; of one that is not there, what a new value has.
  [[nodiscard]] bool has(std::string_view key) const { return find(key) != nullptr; }
  [[nodiscard]] const ModuleValue& operator[](std::string_view key) const {
    static const ModuleValue none;
    const ModuleValue* v = find(key);
    return v ? *v : none;
  }

 private:
  static const std::string& no_text() {
    static const std::string none;
    return none;
  }
  Type type_ = Type::none;
  std::int64_t integer_ = 0;
  double real_ = 0;
  std::uint64_t rows_ = 0, columns_ = 0;
  std::string text_;  ///< text; unit of numbers; kind of a reference
  std::vector<double> numbers_;
  std::vector<ModuleValue> items_;
  std::vector<std::string> keys_;  ///< of a map, one an item
  Room room_{};
};

/// A table of rmp_param: what a command takes, what its result holds, what can be set. Types are
/// those of rmp_param (plugin.h) and vec3, matrix, list, map and any; those have no default here.
struct ModuleFields {
  const rmp_param* rows = nullptr;
  std::uint32_t count = 0;
  std::uint32_t row_size = sizeof(rmp_param);
  constexpr ModuleFields() = default;
  template <std::uint32_t N>
  constexpr ModuleFields(const rmp_param (&table)[N])
      : rows(table), count(N) {}  // NOLINT: implicit
};

class Module;
class ModuleCall;

/// One command; constant data. Rows of ModuleTable::commands, which has their length.
struct ModuleCommand {
  /// "topic.verb", lower case: "payload.study". The topic may be one of the program's own; with a
  /// first parameter `id` of type ref:<topic> it is a method of such records: robot:reach{...}.
  const char* name = "";
  const char* summary = "";  ///< one sentence with its period
  const char* details = "";  ///< more; may be empty
  const char* example = "";  ///< Lua that works in a new session
  /// All that it does besides giving a result, and what it does with some arguments only, by
  /// commas: reads edits simulates files_read files_write processes providers loads_code stops.
  /// What it asks other commands for is bound to these, and to what its session may do.
  const char* effects = "reads";
  const char* sometimes = "";
  ModuleFields params;
  /// nil bool int real string real[] vec3 pose matrix list map any handle (a reference). A result
  /// of another type, and one with a number that is not finite, is an error that names the plugin.
  const char* result_type = "nil";
  const char* result_unit = "";
  const char* result_doc = "";
  ModuleFields result_fields;  ///< of a map, or of each map in a list
  /// [any thread, several at once] It holds no lock; what takes longer than 50 ms reports to
  /// call.progress() and ends with ErrorCode::cancelled once that requests it.
  Result<ModuleValue> (*run)(const Module& module, const ModuleValue& arguments,
                             ModuleCall& call) = nullptr;
};

/// What a run is, to be summed by `|` for the runs that a module is notified of.
enum ModuleRun : std::uint32_t {
  kModuleRunSimulation = 1,  ///< a command that simulates: along trajectories, under forces, live
  kModuleRunTask = 2,        ///< of tasks of a world
  kModuleRunJob = 4,         ///< any other command that runs as a job
};

/// All that a module adds; constant data that lives as long as the module.
struct ModuleTable {
  std::uint32_t struct_size = sizeof(ModuleTable);
  const ModuleCommand* commands = nullptr;
  std::uint32_t command_count = 0;
  std::uint32_t command_size = sizeof(ModuleCommand);
  /// Saved with the document, each with a default. Types: bool int real string enum real[].
  ModuleFields settings;
  std::uint32_t runs = 0;  ///< ModuleRun: those that before_run and after_run are called for
};

/// What is about to run, or has run. Made by the host; may gain fields at the end.
struct ModuleRunNotice {
  std::uint32_t struct_size = sizeof(ModuleRunNotice);
  std::uint32_t kind = 0;                  ///< one of ModuleRun
  std::uint64_t number = 0;                ///< the same before and after
  std::string_view command;                ///< "world.simulate"
  std::string_view session;                ///< its session
  const ModuleValue* arguments = nullptr;  ///< a map, checked, with defaults; never null
  bool is_job = false;                     ///< it runs as a job
};
/// How it ended. Made by the host; may gain fields at the end.
struct ModuleRunEnd {
  std::uint32_t struct_size = sizeof(ModuleRunEnd);
  double seconds = 0;                   ///< how long it took
  std::string_view error;               ///< the sentence; "" when it went well
  const ModuleValue* result = nullptr;  ///< a reference to the recording, in most cases; never null
};

/// What the program does for a command or hook of a module, while that runs and on its thread only.
/// Implemented by the host.
class ModuleCall {
 public:
  virtual ~ModuleCall() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Another command, with a map of its arguments: call.run("robot.fk", {{...}}). It is a part of
  /// this one: its edits are of the same undo step, its progress is shown here. One with an effect
  /// that this command does not declare is refused; hooks may run what only reads.
  virtual Result<ModuleValue> run(std::string_view command, const ModuleValue& arguments) = 0;
  /// A setting of this module as the document has it, or its default. What the document has is an
  /// error when it does not fit the table of settings.
  [[nodiscard]] virtual Result<ModuleValue> setting(std::string_view name) const = 0;
  /// What a referenced record or recording is called.
  [[nodiscard]] virtual Result<std::string> name(const ModuleValue& reference) const = 0;
  /// A robot as solvers see it, under standard gravity; `robot` is a reference.
  virtual Result<std::shared_ptr<const RobotModel>> robot_model(const ModuleValue& robot) = 0;
  virtual Progress& progress() = 0;
  /// A message to the user: 0 debug, 1 info, 2 warning, 3 error.
  virtual void say(std::int32_t severity, std::string_view text) = 0;
  [[nodiscard]] virtual std::string_view session() const = 0;
};

/// Interface robomosp.module/1. One object a program; its functions are called on any thread,
/// several at once.
class Module {
 public:
  using Interface = Module;
  static constexpr const char* kInterfaceId = "robomosp.module/1";
  virtual ~Module() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Called once, when the plugin is loaded. A command with a name that is taken, by the program or
  /// by another plugin, is left out with a remark; the others are available.
  [[nodiscard]] virtual const ModuleTable& table() const = 0;
  /// An error refuses the run with its sentence.
  virtual Result<void> before_run(const ModuleRunNotice&, ModuleCall&) const { return {}; }
  /// Called for every run that before_run permitted, however it ended. An error becomes a message;
  /// the run and its result stay as they are.
  virtual Result<void> after_run(const ModuleRunNotice&, const ModuleRunEnd&, ModuleCall&) const {
    return {};
  }
};

}  // namespace robomosp
