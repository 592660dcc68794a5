// SPDX-License-Identifier: Apache-2.0
// Spellings of commands as lines of the 2006 program (layer: application, ioci only).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace robomosp::ioci {

/// One spelling of CommandSpec::classic. `PRobot GetDOF` takes its words in the order of the
/// schema; `World FwdDynWorldSim(robot, duration, qd)` in the order given; `PRobot LLRL mJacobian
/// Local(frame=tool, q)` sets an argument itself; `~time_delay` is a word of the 2006 program that
/// is no parameter here (classic.cpp), and may be left out.
struct ClassicSpelling {
  std::string words;                                       ///< "World FwdDynWorldSim"
  std::optional<std::vector<std::string>> order;           ///< names of parameters
  std::vector<std::pair<std::string, std::string>> fixed;  ///< parameter and its value
};

/// The spellings of CommandSpec::classic, which are separated by '|'.
[[nodiscard]] std::vector<ClassicSpelling> classic_spellings(std::string_view classic);

/// `PRobot <id> Link <link> Set <value>`: a spelling as help shows it.
[[nodiscard]] std::string classic_usage(const ClassicSpelling& spelling, bool is_method);

/// A line without the `IOIC::` that scripts of the 2006 program write before the noun.
[[nodiscard]] std::string_view without_prefix(std::string_view line);

}  // namespace robomosp::ioci
