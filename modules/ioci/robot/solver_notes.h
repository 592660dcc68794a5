// SPDX-License-Identifier: Apache-2.0
// Says which solver of inverse kinematics serves a robot that names none, when the robot comes and
// when an edit changes it (layer: application). Internal to modules/ioci.
#pragma once

namespace robomosp::ioci {

class Application;

/// Posts a message after each commit, undo and load that makes a robot with another solver than
/// before; `ik` given by name is left alone.
void follow_ik_choices(Application&);

}  // namespace robomosp::ioci
