# SPDX-License-Identifier: Apache-2.0
# robomosp_post(name SOURCES ...): the library post_name_core, which tests link, and the plugin
# post_name of plugin.cpp.
include_guard(DIRECTORY)
function(robomosp_post name)
  cmake_parse_arguments(arg "" "" "SOURCES" ${ARGN})
  add_library(post_${name}_core STATIC ${arg_SOURCES})
  target_include_directories(post_${name}_core PUBLIC "${CMAKE_CURRENT_SOURCE_DIR}")
  target_link_libraries(post_${name}_core PUBLIC robomosp::sdk PRIVATE robomosp_flags)
  robomosp_speed(post_${name}_core cold)
  robomosp_plugin(post_${name} SPEED cold SOURCES plugin.cpp LIBS post_${name}_core)
endfunction()
