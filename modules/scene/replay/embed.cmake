# SPDX-License-Identifier: Apache-2.0
# cmake -D OUTPUT=replay_files.cpp -P embed.cmake: the files of this folder as constants of C++, so
# that the program needs none of them when it runs.
function(constant name)
  string(APPEND source "const std::string_view ${name} =")
  foreach(file ${ARGN})
    file(READ "${CMAKE_CURRENT_LIST_DIR}/${file}" text)
    string(APPEND source "\nR\"replay(${text})replay\"")
  endforeach()
  set(source "${source};\n" PARENT_SCOPE)
endfunction()
set(source "// Made by modules/scene/replay/embed.cmake.\n#include \"scene/replay_files.h\"\nnamespace robomosp::scene {\n")
constant(kReplayPage page.html)
constant(kReplayStyle style.css)
constant(kReplayScript linear.js decode.js camera.js renderer.js plots.js player.js start.js)
string(APPEND source "}\n")
file(WRITE "${OUTPUT}" "${source}")
