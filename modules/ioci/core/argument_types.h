// SPDX-License-Identifier: Apache-2.0
// What arguments of one name mean in all commands: `q` is joint values or a named pose of the robot
// `id`, `section` is a plane (layer: application, ioci only).
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "ioci/core/command.h"

namespace robomosp::ioci {

inline constexpr std::string_view kInertiaType =
    "vec(Ixx, Iyy, Izz, Ixy, Iyz, Ixz) or matrix(3, 3)";

/// One meaning: of an argument in some commands, and the type that says it.
struct ArgumentType {
  std::string_view argument;
  /// Names of commands with `*` for any text, separated by blanks.
  std::string_view commands;
  std::string_view type;  ///< kernel/type.h
};

/// In the order in which they are looked for: the first that fits counts.
[[nodiscard]] std::span<const ArgumentType> argument_types();

/// Gives the arguments of a command that are declared without a form (any, map, list, string) the
/// type of their name: the first one with the declared type as its plain type.
void give_argument_types(CommandSpec&);

/// An argument that stays without a form, and why.
struct UntypedArgument {
  std::string_view argument;
  std::string_view commands;
  std::string_view reason;
};
[[nodiscard]] std::span<const UntypedArgument> untyped_arguments();

/// Whether a command is among `commands` of an ArgumentType.
[[nodiscard]] bool is_command_among(std::string_view command, std::string_view commands);

}  // namespace robomosp::ioci
