// SPDX-License-Identifier: Apache-2.0
// Faults: a failure or remark as data: its subject, extent, witness, cause and remedies (layer:
// core).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/messages.h"
#include "kernel/value.h"

namespace robomosp {

/// What a fault is about. Members that do not apply are empty or 0.
struct FaultSubject {
  Handle record{};             ///< number 0 = no record
  std::string name{};          ///< of the record
  std::string path{};          ///< within the record, as record.set takes it
  std::string command{};       ///< "robot.create"
  std::string argument{};      ///< of the command, as a path: "q[2]", "pose.rpy[1]"
  std::string provider{};      ///< name of a provider or plugin
  std::string interface_id{};  ///< of the provider: "robomosp.ik/1"
  std::string file{};          ///< a file, or the name of a file of a program
  /// Position in the file, from 1; the end is the first column after it. 0 = unknown.
  std::uint32_t line = 0, column = 0, end_line = 0, end_column = 0;
  bool operator==(const FaultSubject&) const = default;
};

/// The part of a motion, run or table that has the fault. All numbers count from 1; 0 = does not
/// apply.
struct FaultExtent {
  std::size_t first = 0, last = 0;       ///< rows or samples
  std::size_t worst = 0;                 ///< the row or sample that the sentence is about
  std::optional<double> from, to, at{};  ///< [s]
  std::size_t segment = 0, step = 0, motion = 0;
  [[nodiscard]] bool is_empty() const { return *this == FaultExtent(); }
  bool operator==(const FaultExtent&) const = default;
};

/// A joint of the witness.
struct FaultJoint {
  std::string name{};           ///< of its link, or "joint 3"
  std::size_t number = 0;       ///< from 1; 0 = unknown
  std::optional<double> value;  ///< [unit]
  std::optional<double> limit;  ///< the limit it exceeds [unit]
  std::string unit{};           ///< SI
  bool operator==(const FaultJoint&) const = default;
};
/// A point of the witness in the frame of its scene.
struct FaultPoint {
  std::string label{};
  double x = 0, y = 0, z = 0;  ///< [m]
  bool operator==(const FaultPoint&) const = default;
};
/// Evidence of the fault: enough to draw it.
struct FaultWitness {
  Handle scene{};                     ///< world, robot, solid or object that it is drawn in
  std::string robot{};                ///< member of the world
  std::vector<double> q{};            ///< values of its joints; empty = as they are in the scene
  std::vector<FaultJoint> joints{};   ///< that have the fault
  std::vector<std::string> bodies{};  ///< "arm.forearm", "table"
  std::vector<FaultPoint> points{};
  /// The quantity at fault and its bound [unit].
  std::optional<double> value, limit, excess{};
  std::string unit{};  ///< SI
  [[nodiscard]] bool is_empty() const { return *this == FaultWitness(); }
  bool operator==(const FaultWitness&) const = default;
};

/// A command that may fix a fault.
struct FaultRemedy {
  std::string label{};    ///< "Set speed to 0.5 m/s"
  std::string command{};  ///< empty = the command that failed; the dispatcher fills it in
  Map args{};
  /// Repeats the failed call: its arguments, replaced by those of `args` and without `without`.
  bool repeats = false;
  std::vector<std::string> without{};  ///< arguments to leave out
  /// The new value was checked and does not have this fault. Otherwise it is a guess.
  bool is_tried = false;
  /// Why it was not tried, a sentence; empty if it was.
  std::string untried{};
  bool operator==(const FaultRemedy&) const = default;
};
/// FaultRemedy::untried of faults found below the commands; fault.list tries their remedies.
inline constexpr const char* kUntriedByList = "fault.list tries it.";

struct Fault {
  std::string code{};  ///< stable word of the table of codes: "argument.out_of_range"
  ErrorCode error = ErrorCode::invalid_argument;
  Severity severity = Severity::error;
  std::string message{};  ///< without the place and without a trailing period
  std::string where{};    ///< as Error::where
  std::string hint{};     ///< as Error::hint
  FaultSubject subject{};
  FaultExtent extent{};
  FaultWitness witness{};
  std::shared_ptr<const Fault> cause{};  ///< the underlying fault; null = none
  std::vector<FaultRemedy> remedies{};
};
/// Compares all members, causes by their content.
[[nodiscard]] bool operator==(const Fault& a, const Fault& b);

/// `where: message. hint`
[[nodiscard]] std::string sentence(const Fault&);
/// The class or severity of a word that to_string() writes; nullopt = of none. [any thread]
[[nodiscard]] std::optional<ErrorCode> error_code_from(std::string_view word);
[[nodiscard]] std::optional<Severity> severity_from(std::string_view word);
/// Adds a number and the bound that it exceeds [unit]; an infinite bound is left out.
void set_bound(FaultWitness&, double value, double limit, std::string_view unit);

/// The faults that an error carries, by Error::fault_set; null = none, or they were given up for
/// many newer ones. [any thread]
[[nodiscard]] std::shared_ptr<const std::vector<Fault>> kept_faults(const Error&);
/// The faults that an error carries, at least one. Each has the outer context that was added to the
/// error (`in()`); an error without faults is one fault with the code "error.<class>".
[[nodiscard]] std::vector<Fault> faults_of(const Error&);
/// One error of several faults: of one, its text; of more, their sentences. A hint that the next
/// fault repeats is given once. None is a defect of the caller.
[[nodiscard]] Error error_of(std::vector<Fault>);
[[nodiscard]] Error error_of(Fault);
/// Adds structured data to `e`: `amend` completes its faults one by one. An error without faults
/// gets one first. The text of the error does not change.
void amend(Error& e, const std::function<void(Fault&)>& amend);
/// Changes every user-visible text in an error and its faults, causes and remedies, such as names
/// of files that a session may not see.
void edit_texts(Error& e, const std::function<std::string(std::string)>& edit);

/// A fault as sent to commands and remote peers: code, class, severity, message, where, hint, text
/// (the sentence), and subject, extent, witness, cause, remedies if present.
[[nodiscard]] Map fault_map(const Fault&);
/// The faults of an error, at most `most`, as maps.
[[nodiscard]] List fault_list(const Error&, std::size_t most = 100);
/// Reads the result of fault_map(). Members of another type and unknown ones are ignored; nullopt =
/// not a map with a code and a message. For data of peers: limited in depth and size.
[[nodiscard]] std::optional<Fault> fault_from(const Value&);
/// Gives an error that was received as text the faults of the list of maps that came with it.
void adopt_faults(Error& e, const Value& list);

/// A row of the table of codes.
struct FaultCode {
  const char* code;  ///< "argument.out_of_range": area and fault, both in snake_case
  ErrorCode error;   ///< the usual class
  const char* doc;   ///< one sentence
};
/// Registers codes; each once in the program.
///   const FaultCodes kCodes{{"solid.node_failed", ErrorCode::plugin_failed, "..."}};
class FaultCodes {
 public:
  FaultCodes(std::initializer_list<FaultCode> rows);
};
/// The row of a code; null = not registered. [any thread]
[[nodiscard]] const FaultCode* find_fault_code(std::string_view code);
/// All codes in alphabetical order. [any thread]
[[nodiscard]] std::vector<FaultCode> fault_codes();
/// A fault with a registered code, its class and a text; aborts on an unknown code.
[[nodiscard]] Fault make_fault(std::string_view code, std::string message, std::string hint = {},
                               std::string where = {});

}  // namespace robomosp
