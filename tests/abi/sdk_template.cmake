# SPDX-License-Identifier: Apache-2.0
# The SDK as a stranger gets it: installs its component to a fresh prefix, and copies the template, or
# all examples, out of the installed tree, builds them there, runs their tests and uses them.
# cmake -D WHAT=template|examples -D BUILD_DIR=... -D SOURCE_DIR=... -D LAUNCHER=... -P sdk_template.cmake

function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(failed)
    message(FATAL_ERROR "${what} failed (work folder ${work}):\n${output}")
  endif()
  string(TIMESTAMP now "%s")
  get_property(last GLOBAL PROPERTY last)
  math(EXPR took "${now} - ${last}")
  set_property(GLOBAL PROPERTY last "${now}")
  message(STATUS "${what}: done (${took} s)")
endfunction()
string(TIMESTAMP now "%s")
set_property(GLOBAL PROPERTY last "${now}")

set(temp "$ENV{TMPDIR}")
if(NOT temp)
  set(temp "/tmp")
endif()
string(RANDOM LENGTH 10 suffix)
set(work "${temp}/robomosp-sdk-${suffix}")
file(MAKE_DIRECTORY "${work}")
# Optimised as little as serves: most of the time is the compiler's.
set(generator -G Ninja "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG" "-DCMAKE_PREFIX_PATH=${work}/prefix"
  "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}")

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

set(program "${BUILD_DIR}/bin/robomosp")
if(WHAT STREQUAL "template")
  file(COPY "${work}/prefix/share/robomosp/template" DESTINATION "${work}")
  run("Configuring the template" ${CMAKE_COMMAND} -S "${work}/template" -B "${work}/build" ${generator})
  run("Building the template" ${CMAKE_COMMAND} --build "${work}/build" -j 2)
  run("Testing the template" ${CMAKE_CTEST_COMMAND} --test-dir "${work}/build" --output-on-failure --no-tests=error)
  if(NOT EXISTS "${work}/build/my_ik.so")
    message(FATAL_ERROR "the plugin is not called my_ik.so")
  endif()
  # The program finds it by its folder and uses it: the PA-10's pose with both sets of lengths.
  run("Checking the plugin" "${program}" plugin check "${work}/build/my_ik.so")
  run("Testing the plugin by its file" ${CMAKE_COMMAND} -E env "XDG_CACHE_HOME=${work}/cache" "${program}" plugin test "${work}/build/my_ik.so" --sdk "${work}/prefix" --models puma560,scara --gtest_brief=1)
  # On a robot that the suites were not compiled with.
  run("Saving a robot's model" "${program}" eval "robot('panda'):save_model{file = '${work}/panda.model'}")
  run("Testing the plugin on it" "${program}" plugin test "${work}/build/my_ik.so" --sdk "${work}/prefix" --model "${work}/panda.model" --gtest_brief=1)
  foreach(file lib/pkgconfig/robomosp-sdk.pc share/doc/Robomosp/LICENSE share/doc/Robomosp/plugin_author/README.md)
    if(NOT EXISTS "${work}/prefix/${file}")
      message(FATAL_ERROR "the installed tree has no ${file}")
    endif()
  endforeach()
  run("Solving with the plugin from a script" "${program}" --plugin-path "${work}/build" run
    "${SOURCE_DIR}/scripts/examples/08_pa10_pose.lua" my_ik)
  file(REMOVE_RECURSE "${work}")
  return()
endif()

# The examples of providers of one's own, each copied out of the installed tree, built, tested by
# itself and with the suites of the SDK, and then used by the program: example(FOLDER what ARGUMENTS...).
function(example folder what)
  file(COPY "${work}/prefix/share/robomosp/examples/${folder}" DESTINATION "${work}")
  run("Configuring the ${what}" ${CMAKE_COMMAND} -S "${work}/${folder}" -B "${work}/${folder}/build" ${generator})
  run("Building the ${what}" ${CMAKE_COMMAND} --build "${work}/${folder}/build" -j 2)
  run("Testing the ${what}" ${CMAKE_CTEST_COMMAND} --test-dir "${work}/${folder}/build" --output-on-failure --no-tests=error)
  run("Using the ${what}" "${program}" --plugin-path "${work}/${folder}/build" ${ARGN})
endfunction()

example(involute_gear "gear" run "${SOURCE_DIR}/scripts/examples/10_gear.lua")
example(scara_ik "SCARA solver" run "${SOURCE_DIR}/scripts/examples/11_scara.lua")
example(feed_forward "controller" eval
  "local e = robot('planar2rods'):simulate{q = {0.1, 0}, reference = {0, 0}, controller = 'feed_forward', duration = 2}:values('tip_error') assert(e[#e] < 1e-6)")
# The same torques as the default's.
example(kane_dynamics "dynamics" eval
  "local p, s = robot('puma560'), {q = {0.1, -0.5, 0.7, 0.2, 0.9, -0.4}, qd = {1, -1, 0.5, 2, -2, 1}, qdd = {3, 1, -2, 0, 1, 4}} local a = p:inverse_dynamics(s) s.provider = 'kane' local b = p:inverse_dynamics(s) for j = 1, 6 do assert(math.abs(a[j] - b[j]) < 1e-9) end")
# The energy of a free swing, and its end as another method finds it.
example(gauss_legendre "integrator" eval
  "local run = {q = {0, 0.5}, duration = 2, limits = 'ignore', friction = false, integrator = 'dormand_prince'} local p = robot('planar2rods') local a = p:simulate(run):values('q1') run.integrator, run.step = 'gauss_legendre', 0.002 local swing = p:simulate(run) local b, e = swing:values('q1'), swing:values('energy') assert(math.abs(a[#a] - b[#b]) < 1e-6) assert(math.abs(e[#e] - e[1]) < 1e-6)")
# The box around each link leaves no more room than there is; what is refused does not come first.
example(rounded_boxes "collision engine" eval
  "local p = robot('puma560') assert(provider.default('collision') == 'fcl') local a = p:clearance{q = 'ready', exact = true} provider.default('collision', 'boxes_around') local b = p:clearance{q = 'ready'} assert(b.distance <= a.distance + 1e-9 and b.distance > a.distance - 0.1)")
# A box that falls on an edge lies flat in the end.
example(sequential_impulses "physics engine" eval
  "material.create{name = 'wood', density = 600} solid.create{name = 'slab', root = {kind = 'box', x = 2, y = 2, z = 0.1}} solid.create{name = 'box', material = 'wood', root = {kind = 'box', x = 0.1, y = 0.1, z = 0.1}} local cell = world.create{name = 'cell'} cell:add_object{what = 'slab', position = {0, 0, -0.1}} cell:add_object{what = 'box', position = {0, 0, 0.25}, rpy = {0.3, 0.2, 0}} local z = cell:simulate_physics{duration = 1, engine = 'sequential_impulses'}:values('box.z') assert(math.abs(z[#z]) < 1e-4)")
# A way through a clothoid, run by a law, with the tool along it.
example(clothoid "curve" eval
  "local t = trajectory.create{name = 'ramp', segments = {{shape = 'clothoid', points = {{0.5, 0, 0.3, 0, 0, 0}}, length = '200 mm', end_curvature = 10, law = 's_curve', orientation = 'tangent'}}} assert(math.abs(t:length() - 0.2) < 1e-12)")
# A bar of 1 kg and 1 m on a joint of 20 N m holds (20 - g/2)/g kg; its guard refuses what it cannot.
example(payload_margin "commands" eval
  "plugin.set('payload_margin', 'reserve', 0) local a = robot.create{name = 'arm', convention = 'dh', base = {rpy = {math.pi/2, 0, 0}}, links = {{a = 1, mass = 1, com = {-0.5, 0, 0}, max_force = 20}}} assert(math.abs(a:greatest_payload() - (20 - 9.81/2)/9.81) < 2e-3) plugin.set('payload_margin', 'guard', true) plugin.set('payload_margin', 'payload', '5 kg') local ok, e = pcall(a.simulate, a, {q = {0}, duration = 0.01}) assert(not ok and tostring(e):find('refused by the plugin'))")
run("Testing the commands by their file" ${CMAKE_COMMAND} -E env "XDG_CACHE_HOME=${work}/cache" "${program}" plugin test "${work}/payload_margin/build/payload_margin.so" --sdk "${work}/prefix" --gtest_brief=1)
# Python's torques are the program's.
example(python_code "code generator" eval
  "local p, f = robot('puma560'), io.open('${work}/check.py', 'w') p:generate_code{folder = '${work}', name = 'puma', provider = 'python'} local tau = p:inverse_dynamics{q = {0.1, -0.5, 0.7, 0.2, 0.9, -0.4}, qd = {1, -1, 0.5, 2, -2, 1}, qdd = {3, 1, -2, 0, 1, 4}} f:write('import puma\\ntau = puma.inverse_dynamics([0.1, -0.5, 0.7, 0.2, 0.9, -0.4], [1, -1, 0.5, 2, -2, 1], [3, 1, -2, 0, 1, 4])\\nassert all(abs(a - b) < 1e-9 for a, b in zip(tau, [' .. table.concat({table.unpack(tau)}, ', ') .. ']))\\n') f:close()")
run("Using the code" python3 "${work}/check.py")

# A post and a pack of templates, each for a controller that does not exist: nothing of a program is
# lost, and their readers, which know the language and not the post, read what the interpreter did.
function(read_back what folder target)
  run("Testing ${what}" "${program}" ${ARGN} post test "${target}" --brief --reader "${work}/${folder}_back")
  file(COPY "${work}/prefix/share/robomosp/examples/${folder}/reader.py" DESTINATION "${work}/${folder}_back")
  run("Reading ${what} back" python3 "${work}/${folder}_back/compare.py")
endfunction()
example(kestrel_post "post" eval
  "local lift = program.create{name = 'lift', source = [[PROGRAM lift; SIGNAL OUTPUT BOOL: grip AT 3; VAR INT: n; BEGIN WHILE n < 2 DO grip := TRUE; WAIT 0.25 SEC; n := n + 1; ENDWHILE; ENDPROGRAM;]]} local text = lift:post{target = 'kestrel'}.files[1].text assert(text:find('S0002 IFNOT R1 < 2 JUMP S0007', 1, true), text)")
# The page shows what it writes.
file(MAKE_DIRECTORY "${work}/lift")
run("Posting the page's program" "${program}" --plugin-path "${work}/kestrel_post/build" post "${work}/kestrel_post/lift.irl" --target kestrel --robot ur5 -o "${work}/lift")
run("Looking at the page" "${program}" eval
  "local function all(f) return (io.open(f):read('a'):gsub('\\r', '')) end local page = all('${SOURCE_DIR}/docs/plugin_author/post.md') for _, f in ipairs{'KSL', 'KPT'} do assert(page:find(all('${work}/lift/LIFT.' .. f), 1, true), f) end")
read_back("the post" kestrel_post kestrel --plugin-path "${work}/kestrel_post/build")
run("Testing the post by its file" ${CMAKE_COMMAND} -E env "XDG_CACHE_HOME=${work}/cache" "${program}" plugin test "${work}/kestrel_post/build/kestrel_post.so" --sdk "${work}/prefix" --gtest_brief=1)
file(COPY "${work}/prefix/share/robomosp/examples/tern_pack" DESTINATION "${work}/packs")
run("Finding the pack in its folder" "${program}" --plugin-path "${work}/packs" eval
  "for _, t in ipairs(program.targets()) do if t.name == 'tern' then return end end error('there is no target tern')")
read_back("the pack" tern_pack "${work}/packs/tern_pack")

if(EXISTS "${work}/prefix/include/robomosp/helper/spatial")
  file(COPY "${SOURCE_DIR}/tests/abi/helper_plugin" DESTINATION "${work}")
  run("Configuring a plugin with the helper library" ${CMAKE_COMMAND} -S "${work}/helper_plugin" -B "${work}/helper_plugin/build" ${generator})
  run("Building it" ${CMAKE_COMMAND} --build "${work}/helper_plugin/build" -j 2)
endif()
file(REMOVE_RECURSE "${work}")
