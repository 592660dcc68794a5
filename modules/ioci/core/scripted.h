// SPDX-License-Identifier: Apache-2.0
// ScriptedCalls: whether a command is called by Lua or by the program itself (layer: commands).
#pragma once

namespace robomosp::ioci {

/// While one exists, commands that this thread calls are those of a script or console, and their
/// events report it (CommandRun::is_scripted). May be nested.
class ScriptedCalls {
 public:
  ScriptedCalls() { ++count(); }
  ~ScriptedCalls() { --count(); }
  ScriptedCalls(const ScriptedCalls&) = delete;
  ScriptedCalls& operator=(const ScriptedCalls&) = delete;
  [[nodiscard]] static bool here() { return count() > 0; }

 private:
  static int& count() {
    thread_local int calls = 0;
    return calls;
  }
};

}  // namespace robomosp::ioci
