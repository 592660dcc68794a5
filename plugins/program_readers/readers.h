// SPDX-License-Identifier: Apache-2.0
// The readers of this plugin, a function each.
#pragma once

#include <robomosp/sdk/program_reader.h>

namespace robomosp::readers {

using Made = Result<std::unique_ptr<ReadProgram>>;
[[nodiscard]] Made read_krl(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_rapid(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_urscript(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_melfa(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_tp(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_val3(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_gcode(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_as(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_pdl2(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_pacscript(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_movemaster(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_crcl(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_inform(const ProgramReaderTask&, const Params&, Progress&);
[[nodiscard]] Made read_joint_trajectory(const ProgramReaderTask&, const Params&, Progress&);
/// Files of a KUKA backup that belong to one, and names that others have to offer ("@weld").
[[nodiscard]] std::vector<std::string> krl_needs(const SourceFile&);
/// Routines and data that a file of a KUKA backup offers to the others.
[[nodiscard]] std::vector<std::string> krl_offers(const SourceFile&);
/// Modules of an ABB backup that a module needs, and names that it offers to the others.
[[nodiscard]] std::vector<std::string> rapid_needs(const SourceFile&);
[[nodiscard]] std::vector<std::string> rapid_offers(const SourceFile&);
/// Whether a .prg is one of MELFA-BASIC, by its first lines.
[[nodiscard]] bool looks_like_melfa(std::string_view text);
/// Files that the project of a VAL3 application names.
[[nodiscard]] std::vector<std::string> val3_needs(const SourceFile&);
/// Jobs that a job of INFORM calls, and conditions of its controller.
[[nodiscard]] std::vector<std::string> inform_needs(const SourceFile&);
/// Trajectories that a sequence names.
[[nodiscard]] std::vector<std::string> trajectory_needs(const SourceFile&);
/// Whether a text has the keys of a JointTrajectory or of a sequence of them.
[[nodiscard]] bool looks_like_trajectory(std::string_view text);

}  // namespace robomosp::readers
