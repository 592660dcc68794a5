# SPDX-License-Identifier: Apache-2.0
# What every target of the project shares: warnings as errors, sanitizers, ccache, and one short
# function each for modules, plugins and tests.

# The compiler cache is keyed without the folder's path, and takes precompiled headers (its manual,
# "Precompiled headers").
find_program(ROBOMOSP_CCACHE ccache)
if(ROBOMOSP_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(launcher "${CMAKE_BINARY_DIR}/compiler_cache")
  file(CONFIGURE OUTPUT "${launcher}" @ONLY CONTENT [=[#!/bin/sh
# A precompiled header is made without the cache, which would read the one that it replaces as what
# it is made of. What is compiled with it knows it by the checksum of its text and macros.
case " $* " in
*" c++-header "*)
  for word do
    [ "$last" != -o ] || header=$word
    last=$word
  done
  rm -f "$header" "$header.sum"
  (
    for word do
      shift
      [ -z "$skip" ] || { skip=; continue; }
      case $word in
      -o | -MT | -MF) skip=1 ;;
      -c | -MD) ;;
      *) set -- "$@" "$word" ;;
      esac
    done
    exec "$@" -E -dD -P
  ) >"$header.text" || exit
  sha256sum <"$header.text" >"$header.sum" && rm "$header.text"
  exec "$@" ;;
esac
export CCACHE_BASEDIR="@PROJECT_SOURCE_DIR@" CCACHE_NOHASHDIR=1 CCACHE_PCH_EXTSUM=1
export CCACHE_IGNOREOPTIONS='--param=ggc-*'  # changes no code
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
exec "@ROBOMOSP_CCACHE@" "$@"
]=])
  file(CHMOD "${launcher}" PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
  set(CMAKE_C_COMPILER_LAUNCHER "${launcher}")
  set(CMAKE_CXX_COMPILER_LAUNCHER "${launcher}")
endif()

# mold links a test program in a tenth of GNU ld's time.
find_program(ROBOMOSP_MOLD mold)
if(ROBOMOSP_MOLD)
  add_link_options(-fuse-ld=mold)
endif()

# GCC begins to look for garbage at 128 MB, which costs it 7 to 15 % of the time of a unit. Where each
# core has 3 GB, it may keep 800 MB first.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  cmake_host_system_information(RESULT megabytes QUERY TOTAL_PHYSICAL_MEMORY)
  cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
  math(EXPR needed "3000 * ${cores}")
  if(NOT megabytes LESS needed)
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-heapsize=800000>)
  endif()
endif()

# Release is -O2; what computes a sample (hot) is -O3, what runs once a command or a test that computes
# (cold) is -O1: a third of the time to compile and no difference to a user. A test that asks the
# programs and the libraries only (asking) is -O0: two fifths less again than -O1.
string(REPLACE "-O3" "-O2" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")
function(robomosp_speed target speed)
  if(speed STREQUAL "hot")
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O3>)
  elseif(speed STREQUAL "cold")
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  elseif(speed STREQUAL "asking")
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O0>)
  endif()
endfunction()

# robomosp_precompile(target set [speed]): compiles a target with the precompiled header
# cmake/precompiled/<set>.h, which all targets of the set share; those of the speed `asking` have one of
# their own, as the compiler takes none made for another kind of code. A source still includes what it
# uses: -DROBOMOSP_PRECOMPILE=OFF shows what is missing.
option(ROBOMOSP_PRECOMPILE "Share precompiled headers" ON)
function(robomosp_precompile target set)
  if(NOT ROBOMOSP_PRECOMPILE)
    return()
  endif()
  get_target_property(type ${target} TYPE)
  set(owner robomosp_precompiled_${set})
  if(type STREQUAL "EXECUTABLE")  # compiled with -fPIE, the others with -fPIC
    set(owner ${owner}_pie)
  endif()
  if("${ARGN}" STREQUAL "asking")
    set(owner ${owner}_asking)
  endif()
  if(NOT TARGET ${owner})
    set(source "${CMAKE_BINARY_DIR}/precompiled/${owner}.cpp")
    file(CONFIGURE OUTPUT "${source}" CONTENT "int main() {}\n")
    if(type STREQUAL "EXECUTABLE")
      add_executable(${owner} EXCLUDE_FROM_ALL "${source}")
    else()
      add_library(${owner} OBJECT EXCLUDE_FROM_ALL "${source}")
    endif()
    target_include_directories(${owner} PRIVATE "${PROJECT_SOURCE_DIR}" "${PROJECT_SOURCE_DIR}/modules"
      "${PROJECT_SOURCE_DIR}/sdk/include")
    target_link_libraries(${owner} PRIVATE robomosp_flags)
    if("${ARGN}" STREQUAL "asking")
      robomosp_speed(${owner} asking)
    endif()
    if(set MATCHES "tests$")
      target_link_libraries(${owner} PRIVATE GTest::gtest)
    endif()
    # In brackets: a name without the folder, for the compiler cache.
    target_precompile_headers(${owner} PRIVATE "<cmake/precompiled/${set}.h>")
  endif()
  target_precompile_headers(${target} REUSE_FROM ${owner})
endfunction()

# robomosp_unite(target [bytes]): compiles the sources of a target as fewer translation units, each of which
# includes sources of one folder that are compiled alike, up to some 200 kB (or `bytes`): headers are read and
# templates instantiated once for all of them (docs/decisions/0072-unity-builds.md). Names that are local to
# a file are therefore unique in their folder (tests/layers). Called at the end of the target's folder, when
# all properties of the sources are set. Paths are relative, so that clones share the compiler cache.
option(ROBOMOSP_UNITY "Compile the sources of a folder together; OFF to rebuild less after an edit" ON)
function(robomosp_unite target)
  if(ROBOMOSP_UNITY)
    cmake_language(EVAL CODE "cmake_language(DEFER CALL robomosp_unite_now [[${target}]] [[${ARGN}]])")
  endif()
endfunction()
function(robomosp_unite_now target most_bytes)
  if(NOT most_bytes)
    set(most_bytes 200000)
  endif()
  get_target_property(sources ${target} SOURCES)
  set(into "${CMAKE_CURRENT_BINARY_DIR}/units/${target}")
  set(units "")
  set(keys "")
  foreach(source ${sources})
    cmake_path(ABSOLUTE_PATH source NORMALIZE OUTPUT_VARIABLE path)
    cmake_path(IS_PREFIX PROJECT_BINARY_DIR "${path}" is_generated)
    if(is_generated OR NOT path MATCHES "\\.cpp$")
      list(APPEND units "${source}")
      continue()
    endif()
    cmake_path(GET path PARENT_PATH folder)
    cmake_path(RELATIVE_PATH folder BASE_DIRECTORY "${PROJECT_SOURCE_DIR}")
    set(key "${folder}")
    foreach(property COMPILE_OPTIONS COMPILE_DEFINITIONS SKIP_PRECOMPILE_HEADERS)
      get_source_file_property(value "${source}" ${property})
      string(APPEND key "|${value}")
    endforeach()
    string(MD5 key "${key}")
    list(APPEND keys ${key})
    list(APPEND sources_${key} "${source}")
    set(folder_${key} "${folder}")
  endforeach()
  list(REMOVE_DUPLICATES keys)
  foreach(key ${keys})
    list(LENGTH sources_${key} count)
    if(count EQUAL 1)
      list(APPEND units "${sources_${key}}")
      continue()
    endif()
    string(REPLACE "/" "_" stem "${folder_${key}}")
    set(bytes 0)
    set(text "")
    foreach(source ${sources_${key}} "")
      if(text AND (source STREQUAL "" OR bytes GREATER most_bytes))
        # Numbered by folder: a new source changes the units of its own folder only.
        string(APPEND count_${stem} "x")
        string(LENGTH "${count_${stem}}" number)
        set(unit "${into}/${stem}_${number}.cpp")
        file(CONFIGURE OUTPUT "${unit}" CONTENT "${text}" @ONLY)
        foreach(property COMPILE_OPTIONS COMPILE_DEFINITIONS SKIP_PRECOMPILE_HEADERS)
          get_source_file_property(value "${first}" ${property})
          if(NOT value STREQUAL "NOTFOUND")
            set_source_files_properties("${unit}" PROPERTIES ${property} "${value}")
          endif()
        endforeach()
        list(APPEND units "${unit}")
        set(bytes 0)
        set(text "")
      endif()
      if(NOT source STREQUAL "")
        if(NOT text)
          set(first "${source}")
        endif()
        cmake_path(ABSOLUTE_PATH source NORMALIZE OUTPUT_VARIABLE path)
        file(SIZE "${path}" size)
        math(EXPR bytes "${bytes} + ${size}")
        cmake_path(RELATIVE_PATH path BASE_DIRECTORY "${into}")
        string(APPEND text "#include \"${path}\"\n")
      endif()
    endforeach()
  endforeach()
  set_target_properties(${target} PROPERTIES SOURCES "${units}")
endfunction()

add_library(robomosp_flags INTERFACE)
target_compile_options(robomosp_flags INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # -Wrestrict, -Warray-bounds and -Wstringop-* are wrong in GCC 12 for `"text" + std::string`
  # (GCC bugs 105651, 105329); the sanitizers look for the same faults.
  target_compile_options(robomosp_flags INTERFACE -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow
    -Wno-stringop-overread)
  if(ROBOMOSP_UNITY)  # for a source that is included, the compiler takes local types for those of a header
    target_compile_options(robomosp_flags INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>)
  endif()
endif()
if(ROBOMOSP_SANITIZE)
  # GCC 12 sees uninitialised std::variant members in instrumented code that are not (bug 105562).
  target_compile_options(robomosp_flags INTERFACE -Wno-maybe-uninitialized)
  # Applied to everything, so that libraries of ours and tests agree.
  if(ROBOMOSP_SANITIZE STREQUAL "thread")
    add_compile_options(-fsanitize=thread -fno-omit-frame-pointer)
    add_link_options(-fsanitize=thread)
  else()
    # Checks of null and alignment are a quarter of the time to compile; such a pointer faults by itself.
    add_compile_options(-fsanitize=address,undefined -fno-sanitize=null,alignment
      -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
    add_link_options(-fsanitize=address,undefined)
  endif()
endif()

# robomosp_module(name SOURCES ... [PUBLIC libs] [PRIVATE libs] [WHOLE]): static library robomosp::name
# whose headers are included as "<folder>/<file>.h" from modules/, kernel/ as "kernel/<file>.h". WHOLE:
# programs get all of its objects, also those that nothing names because they register themselves.
function(robomosp_module name)
  cmake_parse_arguments(arg "WHOLE" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(robomosp_${name} STATIC ${arg_SOURCES})
  robomosp_unite(robomosp_${name})
  if(arg_WHOLE)
    add_library(robomosp_${name}_whole INTERFACE)
    target_link_libraries(robomosp_${name}_whole INTERFACE "$<LINK_LIBRARY:WHOLE_ARCHIVE,robomosp_${name}>")
    add_library(robomosp::${name} ALIAS robomosp_${name}_whole)
  else()
    add_library(robomosp::${name} ALIAS robomosp_${name})
  endif()
  # In the build tree only: what is installed (sdk/cmake/package.cmake) has folders of its own.
  target_include_directories(robomosp_${name} PUBLIC
    "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>" "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/modules>")
  target_link_libraries(robomosp_${name} PUBLIC robomosp::sdk ${arg_PUBLIC}
    PRIVATE "$<BUILD_INTERFACE:robomosp_flags>" ${arg_PRIVATE})
endfunction()

# robomosp_lanes(target source...): sources that include spatial/lanes.h, compiled once an instruction
# set, each time in a namespace of that name (RMP_LANES). The program chooses at run time
# (spatial/instruction_set.h), so the levels are those of the x86-64 psABI.
function(robomosp_lanes target)
  set(baseline_flags "-DRMP_LANES=baseline" "-DRMP_LANE_COUNT=2")
  set(avx2_flags "-DRMP_LANES=avx2" "-DRMP_LANE_COUNT=4" "-march=x86-64-v3")
  set(avx512_flags "-DRMP_LANES=avx512" "-DRMP_LANE_COUNT=8" "-march=x86-64-v4"
    "-mprefer-vector-width=512")
  set(sets baseline)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND sets avx2)
    if(NOT ROBOMOSP_SANITIZE)  # RMP_HAS_AVX512 of spatial/instruction_set.h
      list(APPEND sets avx512)
    endif()
  endif()
  foreach(source ${ARGN})
    get_filename_component(stem "${source}" NAME_WE)
    foreach(set ${sets})
      set(file "${CMAKE_CURRENT_BINARY_DIR}/${stem}_${set}.cpp")
      file(CONFIGURE OUTPUT "${file}" CONTENT "#include \"${CMAKE_CURRENT_SOURCE_DIR}/${source}\"\n")
      set_source_files_properties("${file}" PROPERTIES
        COMPILE_OPTIONS "${${set}_flags};$<$<CONFIG:Release>:-O3>;-ffp-contract=fast;-fno-math-errno;-fno-trapping-math;$<$<CXX_COMPILER_ID:GNU>:-fno-tree-loop-distribute-patterns>"
        SKIP_PRECOMPILE_HEADERS ON  # other instructions, other headers
        OBJECT_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${source}")
      target_sources(${target} PRIVATE "${file}")
    endforeach()
  endforeach()
endfunction()

# robomosp_plugin(name SOURCES ... [LIBS libs] [LAZY entry.cpp] [SPEED hot|cold]): a loadable plugin of
# the project, built as a third-party one is: it sees the SDK and, if asked for, the helper library
# robomosp::spatial. LAZY names the source with RMP_PLUGIN: the plugin is then a door of that source
# alone, and all sources and LIBS are the target name_lazy, which is opened with the first provider
# that is made (sdk/lazy_door.h).
function(robomosp_plugin name)
  cmake_parse_arguments(arg "" "LAZY;SPEED" "SOURCES;LIBS" ${ARGN})
  if(arg_LAZY)
    add_library(${name}_lazy MODULE ${arg_SOURCES})
    robomosp_unite(${name}_lazy)
    set_target_properties(${name}_lazy PROPERTIES PREFIX "" OUTPUT_NAME ${name}
      LIBRARY_OUTPUT_DIRECTORY "${ROBOMOSP_PLUGIN_OUTPUT_DIR}/lazy")
    target_link_libraries(${name}_lazy PRIVATE robomosp::sdk robomosp_flags ${arg_LIBS})
    robomosp_speed(${name}_lazy "${arg_SPEED}")
    robomosp_precompile(${name}_lazy sdk)
    install(TARGETS ${name}_lazy LIBRARY DESTINATION "${ROBOMOSP_PLUGIN_INSTALL_DIR}/lazy")
    add_library(${name} MODULE ${arg_LAZY})
    target_compile_definitions(${name} PRIVATE RMP_LAZY_DOOR)
    target_link_libraries(${name} PRIVATE ${CMAKE_DL_LIBS})
    if(NOT ROBOMOSP_SANITIZE)  # the sanitizers' own symbols are in the program
      target_link_options(${name} PRIVATE -Wl,--no-undefined)
    endif()
    add_dependencies(${name} ${name}_lazy)
  else()
    add_library(${name} MODULE ${arg_SOURCES})
    robomosp_unite(${name})
    target_link_libraries(${name} PRIVATE ${arg_LIBS})
  endif()
  set_target_properties(${name} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY "${ROBOMOSP_PLUGIN_OUTPUT_DIR}")
  target_link_libraries(${name} PRIVATE robomosp::sdk robomosp_flags)
  robomosp_speed(${name} "${arg_SPEED}")
  if(NOT arg_LAZY)  # a door reads sdk/plugin.h in its own way
    robomosp_precompile(${name} sdk)
  endif()
  set_property(GLOBAL APPEND PROPERTY ROBOMOSP_PLUGIN_TARGETS ${name})
  install(TARGETS ${name} LIBRARY DESTINATION "${ROBOMOSP_PLUGIN_INSTALL_DIR}")
endfunction()

# robomosp_test(name SOURCES ... [LIBS libs] [LABELS labels] [INCLUDES folders]): one GoogleTest program,
# one CTest entry. Those that compute much themselves match ROBOMOSP_COMPUTING_TESTS (tests/CMakeLists.txt),
# the others are not optimised. Tests that need files find them through the compile
# definitions ROBOMOSP_SOURCE_DIR, ROBOMOSP_BUILD_DIR (programs in bin/, plugins in ROBOMOSP_PLUGIN_DIR).
# Where ROBOMOSP_TEST_ROOMS is set, tests that link alike share one program: `name` is then a link to it,
# and runs the tests of its own sources (tests/support/room_main.h). Those that need definitions of their
# own, or replace what a program has once, stand in ROBOMOSP_ALONE_TESTS.
function(robomosp_test name)
  cmake_parse_arguments(arg "" "" "SOURCES;LIBS;LABELS;INCLUDES" ${ARGN})
  set(speed asking)
  if(ROBOMOSP_SANITIZE OR name MATCHES "${ROBOMOSP_COMPUTING_TESTS}")
    set(speed cold)
  endif()
  robomosp_room(room ${name} "${arg_LIBS}")
  set(path "${CMAKE_BINARY_DIR}/tests/${name}")
  if(IS_SYMLINK "${path}")
    file(REMOVE "${path}")
  endif()
  if(room)
    if(speed STREQUAL "cold")
      string(APPEND room _computing)
    endif()
    string(APPEND room _tests)
    set_property(DIRECTORY APPEND PROPERTY ROBOMOSP_ROOMS ${room})
    set_property(DIRECTORY APPEND PROPERTY ${room}_SOURCES ${arg_SOURCES})
    set_property(DIRECTORY APPEND PROPERTY ${room}_LIBS ${arg_LIBS})
    set_property(DIRECTORY APPEND PROPERTY ${room}_INCLUDES ${arg_INCLUDES})
    foreach(source ${arg_SOURCES})
      set_property(DIRECTORY APPEND_STRING PROPERTY ${room}_TABLE "    {\"${name}\", \"${source}\"},\n")
    endforeach()
    file(MAKE_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
    file(CREATE_LINK "${room}" "${path}" SYMBOLIC)
    add_custom_target(${name})
    add_dependencies(${name} ${room})
  else()
    robomosp_test_program(${name} ${speed} SOURCES ${arg_SOURCES} LIBS ${arg_LIBS} GTest::gtest_main
      INCLUDES ${arg_INCLUDES})
    robomosp_unite(${name})
  endif()
  add_test(NAME ${name} COMMAND "${path}")
  if(name IN_LIST ROBOMOSP_SANITIZED_TESTS)
    list(APPEND arg_LABELS sanitized)
    add_dependencies(sanitized_tests ${name})
  endif()
  if(name IN_LIST ROBOMOSP_THREAD_TESTS)
    list(APPEND arg_LABELS threads)
    add_dependencies(thread_tests ${name})
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT 300 LABELS "${arg_LABELS}")
  if(name IN_LIST ROBOMOSP_SERIAL_TESTS)
    set_tests_properties(${name} PROPERTIES RUN_SERIAL ON)
  endif()
  # Compiled robots stay in the build folder, and no test needs a home it can write to. None finds
  # geometry that another one computed.
  set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT "XDG_CACHE_HOME=${CMAKE_BINARY_DIR}/cache"
    "XDG_STATE_HOME=${CMAKE_BINARY_DIR}/state" "ROBOMOSP_CACHE=off")
  if(ROBOMOSP_SANITIZE STREQUAL "thread")
    set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT
      "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/support/tsan.supp:halt_on_error=0:second_deadlock_stack=1")
  elseif(ROBOMOSP_SANITIZE)
    set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT
      "LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/support/lsan.supp:print_suppressions=0")
  endif()
endfunction()

# The program with the sources of a test, or of many.
function(robomosp_test_program target speed)
  cmake_parse_arguments(arg "" "" "SOURCES;LIBS;INCLUDES" ${ARGN})
  add_executable(${target} ${arg_SOURCES})
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  target_include_directories(${target} PRIVATE "${PROJECT_SOURCE_DIR}" "${PROJECT_SOURCE_DIR}/modules"
    "${PROJECT_SOURCE_DIR}/tests" ${arg_INCLUDES})
  target_compile_definitions(${target} PRIVATE
    ROBOMOSP_SOURCE_DIR="${PROJECT_SOURCE_DIR}" ROBOMOSP_BUILD_DIR="${CMAKE_BINARY_DIR}"
    ROBOMOSP_PLUGIN_DIR="${ROBOMOSP_PLUGIN_OUTPUT_DIR}")
  target_link_libraries(${target} PRIVATE robomosp_flags robomosp::sdk ${arg_LIBS})
  robomosp_speed(${target} ${speed})
  if("${arg_LIBS}" MATCHES "robomosp::(document|evaluation|io|collision|recording|sim|scene|task|ioci|lua|remote|shell)")
    robomosp_precompile(${target} application_tests ${speed})
  else()
    robomosp_precompile(${target} tests ${speed})
  endif()
endfunction()

# robomosp_room(out name libs): the room whose program a test is part of, by what it links; empty: none.
function(robomosp_room out name libs)
  set(${out} "" PARENT_SCOPE)
  if(NOT ROBOMOSP_UNITY OR ROBOMOSP_SANITIZE OR NOT ROBOMOSP_TEST_ROOMS OR name IN_LIST ROBOMOSP_ALONE_TESTS)
    return()
  endif()
  set(room base)
  foreach(lib ${libs})
    if(lib MATCHES "^robomosp::(shell|remote|lua|ioci)$")
      set(room ${CMAKE_MATCH_1})
      if(room STREQUAL "remote")  # what is above them links it, too
        set(room shell)
      endif()
      break()
    elseif(lib MATCHES "^(irl|post_.*|program_readers)_core$|^robomosp::program")
      set(room language)
    elseif(lib MATCHES "^robomosp::(document|evaluation|io|collision|recording|motion|sim|scene|task)$")
      set(room engine)
    elseif(NOT lib MATCHES "^robomosp::(kernel|spatial|geometry|robotics)$|^(Eigen3::Eigen|nlohmann_json::nlohmann_json)$")
      return()
    endif()
  endforeach()
  if(room STREQUAL "ioci" AND "robomosp::lua" IN_LIST libs)
    set(room lua)
  endif()
  set(${out} ${room} PARENT_SCOPE)
endfunction()

# Makes the programs of the rooms of a folder, at its end.
function(robomosp_make_rooms)
  get_property(rooms DIRECTORY PROPERTY ROBOMOSP_ROOMS)
  list(REMOVE_DUPLICATES rooms)
  file(GLOB kept RELATIVE "${CMAKE_CURRENT_BINARY_DIR}/rooms" "${CMAKE_CURRENT_BINARY_DIR}/rooms/*")
  foreach(file ${kept})  # of rooms that are no more; local_names_test reads the folder
    string(REGEX REPLACE "\\.cpp$" "" room "${file}")
    if(NOT room IN_LIST rooms)
      file(REMOVE "${CMAKE_CURRENT_BINARY_DIR}/rooms/${file}")
    endif()
  endforeach()
  foreach(room ${rooms})
    foreach(what SOURCES LIBS INCLUDES TABLE)
      get_property(${what} DIRECTORY PROPERTY ${room}_${what})
    endforeach()
    list(REMOVE_DUPLICATES LIBS)
    list(REMOVE_DUPLICATES INCLUDES)
    set(main "${CMAKE_CURRENT_BINARY_DIR}/rooms/${room}.cpp")
    cmake_path(RELATIVE_PATH PROJECT_SOURCE_DIR BASE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/rooms" OUTPUT_VARIABLE up)
    file(CONFIGURE OUTPUT "${main}" @ONLY CONTENT "\
#include <string_view>
#include <utility>
inline constexpr std::pair<std::string_view, std::string_view> kTestsAndSources[] = {
@TABLE@};
#include \"@up@/tests/support/room_main.h\"
")
    set(speed asking)
    if(room MATCHES "_computing_tests$")
      set(speed cold)
    endif()
    robomosp_test_program(${room} ${speed} SOURCES ${SOURCES} "${main}" LIBS ${LIBS} GTest::gtest INCLUDES ${INCLUDES})
    robomosp_unite_now(${room} "")
  endforeach()
endfunction()
