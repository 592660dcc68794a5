// SPDX-License-Identifier: Apache-2.0
// Runs a program without a robot, with an operator and files (layer: data processing, program).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "program/machine.h"
#include "program/presets.h"

namespace robomosp::program {

/// User interface of such a program. An error ends the program at the line of the call. [the thread
/// that runs it]
class Operator {
 public:
  virtual ~Operator() = default;
  /// WRITE: a piece of text; WRITELN ends with '\n'.
  virtual Result<void> says(std::string_view) = 0;
  /// READ: a line without its end.
  virtual Result<std::string> line() = 0;
  /// PAUSE; returns when the program should continue.
  virtual Result<void> pause(std::string_view message) = 0;
  /// The program's time reaches `now` [s]; may wait that long.
  virtual Result<void> time(double now) = 0;
  /// Reports an action: a motion, an output, a wait; `what` is in terms of the language.
  virtual Result<void> does(double now, const std::string& file, std::uint32_t line,
                            const std::string& what) = 0;
  /// OPEN and CLOSE: names are those of the program.
  virtual Result<std::string> read_file(std::string_view name) = 0;
  virtual Result<void> write_file(std::string_view name, std::string_view bytes, bool adds) = 0;
};

struct AloneOptions {
  std::map<std::string, SignalValue> inputs;  ///< by name, any case
  std::vector<Preset> values;
  bool is_traced = false;  ///< call Operator::does
  Limits limits{};
};
struct Ended {
  bool is_halted = false;
  double time = 0;  ///< of the program [s]
  std::uint64_t instructions = 0;
  std::uint64_t motions = 0;
  /// Outputs that it has set, by name as declared.
  std::vector<std::pair<std::string, std::string>> outputs;
};

/// Runs a program to its end. Motions take no time and reach their targets; WAIT t SEC lasts as
/// long as the operator decides. The robot's pose is known after a motion to a place, its joints
/// never. Faults are errors with file, line and column, and so are reading an input without a
/// value, and a wait that nothing can end.
Result<Ended> run_alone(std::shared_ptr<const CompiledProgram>, const AloneOptions&, Operator&,
                        const Progress&);

}  // namespace robomosp::program
