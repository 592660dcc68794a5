# SPDX-License-Identifier: Apache-2.0
# The SDK as a stranger gets it: installs its component to a fresh prefix, copies the template out of
# the installed tree, builds it there and runs its tests; then a plugin that uses the helper library.
# cmake -D BUILD_DIR=... -D SOURCE_DIR=... -D LAUNCHER=... -P sdk_template.cmake

function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(failed)
    message(FATAL_ERROR "${what} failed (work folder ${work}):\n${output}")
  endif()
  message(STATUS "${what}: done")
endfunction()

set(temp "$ENV{TMPDIR}")
if(NOT temp)
  set(temp "/tmp")
endif()
string(RANDOM LENGTH 10 suffix)
set(work "${temp}/robomosp-sdk-${suffix}")
file(MAKE_DIRECTORY "${work}")
set(generator -G Ninja "-DCMAKE_PREFIX_PATH=${work}/prefix" "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}"
  "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}" "-DCMAKE_MODULE_LINKER_FLAGS=${CXX_FLAGS}" "-DCMAKE_EXE_LINKER_FLAGS=${CXX_FLAGS}")

run("Installing the SDK" ${CMAKE_COMMAND} --install "${BUILD_DIR}" --component sdk --prefix "${work}/prefix")

# What is installed must not remember where it was built.
file(GLOB_RECURSE package "${work}/prefix/*.cmake" "${work}/prefix/*.h")
foreach(file ${package})
  file(READ "${file}" content)
  foreach(folder "${SOURCE_DIR}/" "${BUILD_DIR}/")
    string(FIND "${content}" "${folder}" at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${file} names the folder ${folder}")
    endif()
  endforeach()
endforeach()

file(COPY "${work}/prefix/share/robomosp/template" DESTINATION "${work}")
run("Configuring the template" ${CMAKE_COMMAND} -S "${work}/template" -B "${work}/build" ${generator})
run("Building the template" ${CMAKE_COMMAND} --build "${work}/build" -j 2)
run("Testing the template" ${CMAKE_CTEST_COMMAND} --test-dir "${work}/build" --output-on-failure --no-tests=error)
if(NOT EXISTS "${work}/build/my_ik.so")
  message(FATAL_ERROR "the plugin is not called my_ik.so")
endif()
# The program finds it by its folder and uses it: the PA-10's pose with both sets of lengths.
set(program "${BUILD_DIR}/bin/robomosp")
run("Checking the plugin" "${program}" plugin check "${work}/build/my_ik.so")
run("Solving with the plugin from a script" "${program}" --plugin-path "${work}/build" run
  "${SOURCE_DIR}/scripts/examples/08_pa10_pose.lua" my_ik)

# The example of a primitive of one's own.
file(COPY "${work}/prefix/share/robomosp/examples/involute_gear" DESTINATION "${work}")
run("Configuring the gear" ${CMAKE_COMMAND} -S "${work}/involute_gear" -B "${work}/involute_gear/build" ${generator})
run("Building the gear" ${CMAKE_COMMAND} --build "${work}/involute_gear/build" -j 2)
run("Testing the gear" ${CMAKE_CTEST_COMMAND} --test-dir "${work}/involute_gear/build" --output-on-failure --no-tests=error)
run("Using the gear" "${program}" --plugin-path "${work}/involute_gear/build" run "${SOURCE_DIR}/scripts/examples/10_gear.lua")

# The example of a closed-form solver of one's own in place of a robot's default.
file(COPY "${work}/prefix/share/robomosp/examples/scara_ik" DESTINATION "${work}")
run("Configuring the SCARA solver" ${CMAKE_COMMAND} -S "${work}/scara_ik" -B "${work}/scara_ik/build" ${generator})
run("Building the SCARA solver" ${CMAKE_COMMAND} --build "${work}/scara_ik/build" -j 2)
run("Testing the SCARA solver" ${CMAKE_CTEST_COMMAND} --test-dir "${work}/scara_ik/build" --output-on-failure --no-tests=error)
run("Using the SCARA solver" "${program}" --plugin-path "${work}/scara_ik/build" run "${SOURCE_DIR}/scripts/examples/11_scara.lua")

# The example of a controller of one's own.
file(COPY "${work}/prefix/share/robomosp/examples/feed_forward" DESTINATION "${work}")
run("Configuring the controller" ${CMAKE_COMMAND} -S "${work}/feed_forward" -B "${work}/feed_forward/build" ${generator})
run("Building the controller" ${CMAKE_COMMAND} --build "${work}/feed_forward/build" -j 2)
run("Testing the controller" ${CMAKE_CTEST_COMMAND} --test-dir "${work}/feed_forward/build" --output-on-failure --no-tests=error)
run("Using the controller" "${program}" --plugin-path "${work}/feed_forward/build" eval
  "local e = robot('planar2rods'):simulate{q = {0.1, 0}, reference = {0, 0}, controller = 'feed_forward', duration = 2}:values('tip_error') assert(e[#e] < 1e-6)")

# The example of dynamics of one's own: the suite of the SDK, and the same torques as the default's.
file(COPY "${work}/prefix/share/robomosp/examples/kane_dynamics" DESTINATION "${work}")
run("Configuring the dynamics" ${CMAKE_COMMAND} -S "${work}/kane_dynamics" -B "${work}/kane_dynamics/build" ${generator})
run("Building the dynamics" ${CMAKE_COMMAND} --build "${work}/kane_dynamics/build" -j 2)
run("Testing the dynamics" ${CMAKE_CTEST_COMMAND} --test-dir "${work}/kane_dynamics/build" --output-on-failure --no-tests=error)
run("Using the dynamics" "${program}" --plugin-path "${work}/kane_dynamics/build" eval
  "local p, s = robot('puma560'), {q = {0.1, -0.5, 0.7, 0.2, 0.9, -0.4}, qd = {1, -1, 0.5, 2, -2, 1}, qdd = {3, 1, -2, 0, 1, 4}} local a = p:inverse_dynamics(s) s.provider = 'kane' local b = p:inverse_dynamics(s) for j = 1, 6 do assert(math.abs(a[j] - b[j]) < 1e-9) end")

if(EXISTS "${work}/prefix/include/robomosp/helper/spatial")
  file(COPY "${SOURCE_DIR}/tests/abi/helper_plugin" DESTINATION "${work}")
  run("Configuring a plugin with the helper library" ${CMAKE_COMMAND} -S "${work}/helper_plugin" -B "${work}/helper_plugin/build" ${generator})
  run("Building it" ${CMAKE_COMMAND} --build "${work}/helper_plugin/build" -j 2)
endif()
file(REMOVE_RECURSE "${work}")
