// SPDX-License-Identifier: GPL-3.0-or-later
// The signature of the command that is typed in the console (layer: GUI).
#pragma once

#include <string>

#include <QString>

namespace robomosp::viewer {

/// The call around a place of Lua, by its opening brace or parenthesis: "robot.fk", ":fk"; "" =
/// none. Texts and comments are skipped.
[[nodiscard]] QString call_around(const QString& lua, int place);
/// The argument that is typed at the place: the last "name =" inside the call; "" = none.
[[nodiscard]] QString argument_at(const QString& lua, int place);

}  // namespace robomosp::viewer
