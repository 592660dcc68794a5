# SPDX-License-Identifier: Apache-2.0
set(_robomosp_package_dir "${CMAKE_CURRENT_LIST_DIR}")

# Here and not in the function, whose scope would swallow it.
if(NOT DEFINED BUILD_TESTING OR BUILD_TESTING)
  enable_testing()
endif()

# robomosp_add_plugin(name SOURCES file... [LIBS library...] [TEST file...]
#                     [CONFORMANCE ik|csg|primitive|dynamics|collision|physics|integrator|controller|robot_code...]
#                     [MODELS model...] [DYNAMICS plugin-file] [RUNNER command...])
# Makes <name>.so as the loader wants it: hidden symbols, no prefix, robomosp::sdk linked. TEST adds
# a GoogleTest program <name>_test, which finds the plugin in the definition ROBOMOSP_PLUGIN_FILE.
# CONFORMANCE runs the suites of the SDK on every provider of the plugin; MODELS are mechanisms of
# <robomosp/sdk/conformance/models.h> to run the suites "ik", "dynamics", "controller" and "robot_code"
# on. RUNNER runs generated code for the suite "robot_code" (robot_code_suite.h, run_by). DYNAMICS
# is the plugin whose inverse dynamics the suite "controller" asks; the installed dynamics_newton_euler
# when left out. The suites of segments, curves, motion laws and orientations need cases of your own:
# include <robomosp/sdk/conformance/segment_suite.h>, curve_suite.h, motion_law_suite.h or
# orientation_suite.h in your TEST.
function(robomosp_add_plugin name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "DYNAMICS" "SOURCES;LIBS;TEST;CONFORMANCE;MODELS;RUNNER")
  if(NOT arg_SOURCES OR arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "robomosp_add_plugin(${name}): give SOURCES; not understood: \"${arg_UNPARSED_ARGUMENTS}\".")
  endif()
  add_library(${name} MODULE ${arg_SOURCES})
  set_target_properties(${name} PROPERTIES PREFIX "" SUFFIX ".so" POSITION_INDEPENDENT_CODE ON
    CXX_VISIBILITY_PRESET hidden C_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON CXX_EXTENSIONS OFF)
  target_link_libraries(${name} PRIVATE robomosp::sdk ${arg_LIBS})
  include(GNUInstallDirs)
  install(TARGETS ${name} LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}/robomosp/plugins")

  if(DEFINED BUILD_TESTING AND NOT BUILD_TESTING)
    return()
  endif()
  if(arg_TEST)
    _robomosp_plugin_test(${name} ${name}_test "${arg_LIBS}" ${arg_TEST})
  endif()
  if(NOT arg_MODELS)
    set(arg_MODELS puma560 pa10)
  endif()
  list(TRANSFORM arg_MODELS APPEND "()")
  list(JOIN arg_MODELS ", " ROBOMOSP_CONFORMANCE_MODELS)
  list(TRANSFORM arg_RUNNER REPLACE "(.+)" "R\"(\\1)\"")
  list(JOIN arg_RUNNER ", " ROBOMOSP_CONFORMANCE_RUNNER)
  if("robot_code" IN_LIST arg_CONFORMANCE AND NOT arg_RUNNER)
    message(FATAL_ERROR "robomosp_add_plugin(${name}): the suite \"robot_code\" needs a RUNNER, the command that runs the generated code.")
  endif()
  set(ROBOMOSP_CONFORMANCE_DYNAMICS "${arg_DYNAMICS}")
  if(NOT ROBOMOSP_CONFORMANCE_DYNAMICS)
    get_filename_component(ROBOMOSP_CONFORMANCE_DYNAMICS
      "${_robomosp_package_dir}/../../robomosp/plugins/dynamics_newton_euler.so" ABSOLUTE)
  endif()
  foreach(suite IN LISTS arg_CONFORMANCE)
    set(source "${_robomosp_package_dir}/conformance_${suite}.cpp.in")
    if(NOT EXISTS "${source}")
      message(FATAL_ERROR "robomosp_add_plugin(${name}): there is no suite \"${suite}\" to run by itself; ik, csg, primitive, dynamics, collision, physics, integrator, controller and robot_code are.")
    endif()
    configure_file("${source}" "${CMAKE_CURRENT_BINARY_DIR}/${name}_conformance_${suite}.cpp" @ONLY)
    _robomosp_plugin_test(${name} ${name}_conformance_${suite} ""
      "${CMAKE_CURRENT_BINARY_DIR}/${name}_conformance_${suite}.cpp")
  endforeach()
endfunction()

# A test program of a plugin: links the SDK and GoogleTest, opens the plugin as the program does.
function(_robomosp_plugin_test plugin test libs)
  find_package(GTest REQUIRED)
  add_executable(${test} ${ARGN})
  target_compile_definitions(${test} PRIVATE "ROBOMOSP_PLUGIN_FILE=\"$<TARGET_FILE:${plugin}>\"")
  target_link_libraries(${test} PRIVATE robomosp::sdk ${libs} GTest::gtest_main ${CMAKE_DL_LIBS})
  add_dependencies(${test} ${plugin})
  add_test(NAME ${test} COMMAND ${test})
endfunction()
