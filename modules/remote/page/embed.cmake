# SPDX-License-Identifier: Apache-2.0
# cmake -D OUTPUT=web_page_files.cpp -D SCRIPTS=a.js;b.js -P embed.cmake: the page of the server as
# constants of C++. The first script is the client, which is served by itself as well; page.js of this
# folder comes last.
function(constant name)
  string(APPEND source "const std::string_view ${name} =")
  foreach(file ${ARGN})
    file(READ "${file}" text)
    string(APPEND source "\nR\"page(${text})page\"")
  endforeach()
  set(source "${source};\n" PARENT_SCOPE)
endfunction()
set(here "${CMAKE_CURRENT_LIST_DIR}")
list(GET SCRIPTS 0 client)
set(source "// Made by modules/remote/page/embed.cmake.\n#include \"remote/web_page.h\"\nnamespace robomosp::remote {\n")
constant(kWebPage "${here}/page.html")
constant(kWebStyle "${here}/style.css")
constant(kWebScript ${SCRIPTS} "${here}/page.js")
constant(kWebClient "${client}")
string(APPEND source "}\n")
file(WRITE "${OUTPUT}" "${source}")
