# SPDX-License-Identifier: Apache-2.0
set(_robomosp_package_dir "${CMAKE_CURRENT_LIST_DIR}")

# Here and not in the function, whose scope would swallow it.
if(NOT DEFINED BUILD_TESTING OR BUILD_TESTING)
  enable_testing()
endif()

# robomosp_add_plugin(name SOURCES file... [LIBS library...] [TEST file...]
#                     [CONFORMANCE ik|csg|primitive|dynamics|collision|physics|integrator|controller|module|planner|retimer|robot_code|post...]
#                     [MODELS model...] [DYNAMICS plugin-file] [RUNNER command...])
# Makes <name>.so as the loader wants it: hidden symbols, no prefix, robomosp::sdk linked. TEST adds
# a GoogleTest program <name>_test, which finds the plugin in the definition ROBOMOSP_PLUGIN_FILE.
# CONFORMANCE runs the suites of the SDK on every provider of the plugin, by the program that the SDK
# is installed with; -DROBOMOSP_BUILD_SUITES=ON builds that program in this tree (as is done for
# sanitizers and debug modes, which have to be the same in both). MODELS are mechanisms of
# <robomosp/sdk/conformance/all_models.h>, or files of robot.save_model, to run the suites "ik",
# "dynamics", "controller" and "robot_code" on. RUNNER runs generated code for the suite "robot_code"
# (robot_code_suite.h, run_by). DYNAMICS is the plugin whose inverse dynamics the suite "controller"
# asks; the installed dynamics_newton_euler when left out. The suite "post" compiles its programs with
# the installed irl. The suites of segments, curves, motion laws
# and orientations need cases of your own: include <robomosp/sdk/conformance/segment_suite.h>,
# curve_suite.h, motion_law_suite.h or orientation_suite.h in your TEST.
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
  if(NOT arg_CONFORMANCE)
    return()
  endif()
  if("robot_code" IN_LIST arg_CONFORMANCE AND NOT arg_RUNNER)
    message(FATAL_ERROR "robomosp_add_plugin(${name}): the suite \"robot_code\" needs a RUNNER, the command that runs the generated code.")
  endif()
  _robomosp_find_suites(program)
  set(options)
  set(named)
  foreach(model IN LISTS arg_MODELS)
    if(model MATCHES "[./]")
      get_filename_component(file "${model}" ABSOLUTE)
      list(APPEND options --model "${file}")
    else()
      list(APPEND named "${model}")
    endif()
  endforeach()
  if(named)
    list(JOIN named "," named)
    list(APPEND options --models "${named}")
  endif()
  if(NOT arg_DYNAMICS)
    get_filename_component(arg_DYNAMICS
      "${_robomosp_package_dir}/../../robomosp/plugins/dynamics_newton_euler.so" ABSOLUTE)
  endif()
  if(EXISTS "${arg_DYNAMICS}" OR TARGET "${arg_DYNAMICS}")
    if(TARGET "${arg_DYNAMICS}")
      set(arg_DYNAMICS "$<TARGET_FILE:${arg_DYNAMICS}>")
    endif()
    list(APPEND options --dynamics "${arg_DYNAMICS}")
  endif()
  get_filename_component(language "${_robomosp_package_dir}/../../robomosp/plugins/irl.so" ABSOLUTE)
  if(EXISTS "${language}")
    list(APPEND options --language "${language}" --constructs "${_robomosp_constructs}")
  endif()
  foreach(word IN LISTS arg_RUNNER)
    list(APPEND options --runner "${word}")
  endforeach()
  foreach(suite IN LISTS arg_CONFORMANCE)
    add_test(NAME ${name}_conformance_${suite}
      COMMAND "${program}" "$<TARGET_FILE:${name}>" --suite ${suite} ${options})
  endforeach()
endfunction()

# The program with the suites: installed, or a target of this tree.
function(_robomosp_find_suites out)
  set(default OFF)
  if(NOT EXISTS "${_robomosp_suites_program}" OR
     "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_DEBUG}" MATCHES "-fsanitize|_GLIBCXX_DEBUG|_GLIBCXX_USE_CXX11_ABI")
    set(default ON)
  endif()
  option(ROBOMOSP_BUILD_SUITES "Build the suites of the SDK in this tree" ${default})
  if(NOT ROBOMOSP_BUILD_SUITES)
    set(${out} "${_robomosp_suites_program}" PARENT_SCOPE)
    return()
  endif()
  if(NOT TARGET robomosp_plugin_suites)
    add_subdirectory("${_robomosp_suites_source}" "${CMAKE_BINARY_DIR}/robomosp_suites")
  endif()
  set(${out} "$<TARGET_FILE:robomosp_plugin_suites>" PARENT_SCOPE)
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
