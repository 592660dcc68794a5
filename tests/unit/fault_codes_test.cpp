// SPDX-License-Identifier: Apache-2.0
// Every code of the table of faults: a command that provokes it, what the fault names is there, its
// witness can be drawn, and each remedy that it offers removes it.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/render.h>

#include "kernel/argument_faults.h"
#include "kernel/fault.h"
#include "kernel/plugin_entry.h"
#include "model/field_path.h"
#include "model/program.h"
#include "support/lua_program.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

/// Lua that ends with `return "command", {arguments}`.
struct FaultCase {
  const char* code;
  const char* lua;
  /// Remedies that are offered, at least.
  std::size_t remedies = 0;
  const char* path = nullptr;  ///< that it names, where that is of interest
};

constexpr const char* kArm =
    "arm = robot.create{name = 'arm', links = {{a = 0.3}, {a = 0.2}}}\n"
    "cell = world.create{name = 'cell'}\n";

/// A lift of one joint and a line of 2 m upwards, of which it reaches 1 m.
constexpr const char* kLift =
    "lift = robot.create{name = 'lift', links = {{name = 'rail', joint = 'prismatic', lower = 0, "
    "upper = 1}}}\n"
    "cell = world.create{name = 'cell'}\n"
    "cell:add_robot{robot = lift, name = 'lift'}\n"
    "function line(name, top)\n"
    "  trajectory.create{name = name, sample_time = 0.1, segments = {{shape = 'line', points = "
    "{{0, 0, 0, 0, 0, 0}, {0, 0, top, 0, 0, 0}}, speed = 0.5}}}\n"
    "  cell:add_trajectory{trajectory = name}\nend\n"
    "function beam(z)\n"
    "  solid.create{name = 'cube', root = {kind = 'box', x = 0.1, y = 0.1, z = 0.1}}\n"
    "  solid.create{name = 'beam', root = {kind = 'box', x = 1, y = 1, z = 0.1}}\n"
    "  lift:set_link{link = 'rail', parts = {{what = 'cube'}}}\n"
    "  cell:add_object{what = 'beam', name = 'beam', position = {0, 0, z}}\nend\n";

constexpr const char* kUr5 =
    "arm = robot.get('ur5')\n"
    "cell = world.create{name = 'cell'}\n"
    "function use(a) cell:add_robot{robot = a, name = 'ur5'} end\n"
    "function put(body, head)\n"
    "  local p = program.create{name = 'job', source = 'PROGRAM job;\\n' .. (head or '') .. "
    "'BEGIN\\n' .. body .. 'ENDPROGRAM;\\n'}\n"
    "  cell:add_program{program = p}\n  return p\nend\n"
    "function place(x, y, z)\n"
    "  return string.format('POSE(POSITION(%.1f, %.1f, %.1f), ORIZYX(0.0, 180.0, 0.0))', x, y, z)\n"
    "end\n"
    "function arc(speed)\n"
    "  local function at(d)\n"
    "    local a = math.rad(d)\n"
    "    return string.format('POSE(POSITION(%.6f, %.6f, 300.0), ORIZYX(%.1f, 180.0, 0.0))', 500 * "
    "math.cos(a), 500 * math.sin(a), d)\n"
    "  end\n"
    "  return '  MOVE PTP ' .. at(-60) .. ';\\n  MOVE CIRCLE ' .. at(0) .. ', ' .. at(60) .. "
    "string.format(' SPEED := %.1f, SPEED_ORI := 400.0;\\n', speed)\n"
    "end\n"
    "function box(name, x, y, z, at)\n"
    "  solid.create{name = name, root = {kind = 'box', x = x, y = y, z = z}}\n"
    "  cell:add_object{what = name, name = name, position = at}\nend\n"
    "function file(name, text)\n"
    "  program.create{name = 'text', file_name = name, source = text}:export{folder = '.', "
    "overwrite = true}\n  program.remove('text')\nend\n";

const FaultCase kArgumentCases[] = {
    {"argument.missing", "return 'material.create', {density = 1000}"},
    {"argument.unknown", "return 'robot.fk', {id = 'arm', qq = {0, 0}}", 1},
    {"argument.wrong_type", "return 'material.create', {name = 'm', density = {}}"},
    {"argument.wrong_unit", "return 'solid.create', {name = 'cube', chord = '2 kg'}", 1},
    {"argument.wrong_unit", "return 'solid.create', {name = 'cube', chord = '2 mmm'}", 1},
    {"argument.wrong_count", "return 'world.create', {name = 'moon', gravity = {0, 0}}"},
    {"argument.out_of_range", "return 'message.list', {at_most = 0}", 1},
    {"argument.not_a_choice", "return 'message.list', {severity = 'warnin'}", 1},
    {"argument.unknown_record", "return 'robot.fk', {id = 'arn', q = {0, 0}}", 1},
    {"argument.unknown_record", "return 'robot.dh_table', {id = 'kr5'}", 1},
    {"argument.wrong_record", "return 'robot.fk', {id = cell, q = {0, 0}}"},
    {"argument.malformed",
     "return 'robot.solve_ik', {id = 'arm', target = {{2, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, "
     "{0, 0, 0, 1}}}"},
    {"argument.refused",
     "program.create{name = 'p', source = 'PROGRAM p;\\nBEGIN\\nENDPROGRAM;\\n'}\n"
     "return 'program.set_file', {id = 'p', name = 'a/b', text = ''}"},
    {"argument.out_of_range",
     "return 'record.set', {id = material.create{name = 'm', density = 1000}, path = 'density', "
     "value = -5}",
     1},
};

const FaultCase kRecordCases[] = {
    {"record.out_of_range",
     "robot.create{name = 'long', parameters = {p = '0.3 m'}, links = {{a = 'p'}, {a = 0.2}}}\n"
     "return 'record.set_parameter', {id = robot.get('long'), name = 'p', value = '1000000 m'}",
     1},
    {"record.invalid",
     "arm:set_link{link = 2, upper = -1, lower = -2}\n"
     "return 'record.set', {id = arm, path = 'links[2].lower', value = 0}"},
    {"record.duplicate_name",
     "return 'record.set', {id = arm, path = 'links[2].name', value = arm:links()[1].name}"},
    {"solid.failed",
     "solid.create{name = 'rounded', root = {kind = 'union', name = 'body', children = {\n"
     "  {kind = 'box', name = 'foot', x = 0.1, y = 0.1, z = 0.1},\n"
     "  {kind = 'fillet', name = 'round', radius = 0.2, children = {{kind = 'box', x = 0.1, y = "
     "0.1, z = 0.1}}}}}}\n"
     "return 'fault.list', {record = 'rounded'}",
     0, "nodes.3"},
    {"robot.stuck_joint",
     "robot.create{name = 'stuck', links = {{a = 0.3, lower = 0.5, upper = 0.5}, {a = 0.2}}}\n"
     "return 'fault.list', {record = 'stuck'}",
     1},
    {"robot.impossible_inertia",
     "robot.create{name = 'thin', links = {{a = 0.3, mass = 1, inertia = {0, 0.35, 0, 0, 0, 0}}}}\n"
     "return 'fault.list', {record = 'thin'}",
     1},
    {"robot.impossible_inertia",
     "material.create{name = 'steel', density = 7850}\n"
     "solid.create{name = 'bar', material = 'steel', root = {kind = 'box', x = 0.3, y = 0.02, z = "
     "0.02}}\n"
     "robot.create{name = 'designed', links = {{a = 0.3, mass = 1, inertia = {1, 0.35, 0, 0.1, 0, "
     "0}, parts = {{what = 'bar'}}}}}\n"
     "return 'fault.list', {record = 'designed'}",
     2},
    {"robot.impossible_inertia",
     "material.create{name = 'steel', density = 7850}\n"
     "solid.create{name = 'foot', material = 'steel', root = {kind = 'box', x = 0.3, y = 0.3, z = "
     "0.02}}\n"
     "robot.create{name = 'footed', base_mass = {mass = 2, com = {0, 0, 0.1}, inertia = {0, 0.35, "
     "0, 0, 0, 0}}, base_parts = {{what = 'foot'}}, links = {{a = 0.3}}}\n"
     "return 'fault.list', {record = 'footed'}",
     2},
};

const FaultCase kTrajectoryCases[] = {
    {"trajectory.unreachable",
     "line('up', 2)\nreturn 'world.check', {id = 'cell', robot = 'lift', trajectory = 'up'}"},
    {"trajectory.limit",
     "line('up', 0.9)\nlift:set_link{link = 'rail', max_velocity = 0.4}\n"
     "return 'world.check', {id = 'cell', robot = 'lift', trajectory = 'up'}"},
    {"trajectory.start",
     "line('low', 0.5)\nbeam(0.85)\ncell:set_robot_q{robot = 'lift', q = {0.8}}\n"
     "return 'world.check', {id = 'cell', robot = 'lift', trajectory = 'low'}",
     1},
    {"trajectory.collision",
     "line('high', 0.95)\nbeam(0.85)\n"
     "return 'world.check', {id = 'cell', robot = 'lift', trajectory = 'high'}",
     1},
};

const FaultCase kRunCases[] = {
    {"program.reach",
     "use(arm)\nput('  MOVE PTP ' .. place(9000, 0, 100) .. ';\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.joint_limit",
     "use(arm)\nput('  MOVE PTP MAIN_JOINT(0.0, -60.0, 900.0, 0.0, 0.0, 0.0);\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.speed",
     "use(arm)\nput(arc(1800))\nreturn 'program.check_run', {id = 'job', sample_time = 0.002}"},
    {"program.acceleration",
     "quick = arm:duplicate('quick')\nquick:set_link{link = 1, max_acceleration = 4}\n"
     "use(quick)\nput(arc(1000))\n"
     "return 'program.check_run', {id = 'job', sample_time = 0.002}"},
    {"program.torque",
     "weak = arm:duplicate('weak')\n"
     "for i = 1, 6 do weak:set_link{link = i, mass = i == 6 and 5 or 0, com = {0, 0, 0}, inertia = "
     "{0, 0, 0, 0, 0, 0}} end\n"
     "weak:set_link{link = 2, max_force = 30}\nuse(weak)\n"
     "put('  MOVE PTP MAIN_JOINT(0.0, -0.5, 0.0, 0.0, 0.0, 0.0) SPEED_PTP := 1.0, ACC_PTP := "
     "1.0;\\n')\nreturn 'program.check_run', {id = 'job', contacts = false}"},
    {"program.contact",
     "use(arm)\nbox('wall', 0.05, 0.6, 1, {0.45, 0, 0.3})\n"
     "put('  MOVE PTP ' .. place(400, 400, 400) .. ';\\n  MOVE PTP ' .. place(550, -300, 400) .. "
     "';\\n')\nreturn 'program.check_run', {id = 'job'}",
     1},
    {"program.clearance",
     "use(arm)\nbox('wall', 0.05, 0.6, 1, {0.8, 0, 0.3})\n"
     "put('  MOVE PTP ' .. place(400, 200, 400) .. ';\\n  MOVE LIN ' .. place(400, 200, 300) .. "
     "' SPEED := 100.0;\\n')\nreturn 'program.check_run', {id = 'job', clearance = 0.6}",
     1},
    {"program.singularity",
     "use(robot.get('kr5'))\n"
     "put('  place := tray @ POSE(POSITION(0.0, 85.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\\n  MOVE PTP "
     "place @ higher @ grasp;\\n  MOVE LIN place @ grasp SPEED := 150.0;\\n',\n"
     "'VAR\\n  POSE: tray := POSE(POSITION(700.0, -200.0, 20.0), ORIZYX(30.0, 0.0, 0.0));\\n  "
     "POSE: grasp := POSE(POSITION(0.0, 0.0, 0.0), ORIZYX(0.0, 180.0, 0.0));\\n  POSE: higher := "
     "POSE(POSITION(0.0, 0.0, 120.0), ORIZYX(0.0, 0.0, 0.0));\\n  POSE: place;\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.configuration",
     "use(robot.get('kr5'))\n"
     "put('  place := tray @ POSE(POSITION(0.0, 85.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\\n  MOVE PTP "
     "place @ higher @ grasp;\\n  MOVE LIN place @ grasp SPEED := 150.0;\\n',\n"
     "'VAR\\n  POSE: tray := POSE(POSITION(700.0, -200.0, 20.0), ORIZYX(30.0, 0.0, 0.0));\\n  "
     "POSE: grasp := POSE(POSITION(0.0, 0.0, 0.0), ORIZYX(0.0, 180.0, 0.0));\\n  POSE: higher := "
     "POSE(POSITION(0.0, 0.0, 120.0), ORIZYX(0.0, 0.0, 0.0));\\n  POSE: place;\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.motion",
     "use(arm)\nput('  MOVE PTP ' .. place(400, 200, 400) .. ';\\n  MOVE CIRCLE ' .. place(400, "
     "200, 350) .. ', ' .. place(400, 200, 300) .. ';\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.controller",
     "use(arm)\n"
     "cell:set_robot_q{robot = 'ur5', q = {0, -1, 1, -1.5, -1.5, 0}}\narm:set_axes{axes = {}}\n"
     "record.create{kind = 'controller', name = 'narrow', fields = {target = 'krl', axes = {{name "
     "= 'A1', joint = 1, sign = -1, offset = 10.0, lower = -12, upper = 170.0}}}}\n"
     "put('  MOVE PTP MAIN_JOINT(30.0, -60.0, 60.0, -90.0, -90.0, 0.0);\\n')\n"
     "return 'program.check_run', {id = 'job', profile = 'narrow'}"},
    {"program.signal",
     "use(arm)\nput('  ACQUIRE(s);\\n', 'VAR\\n  SEMAPHORE: s := 0;\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.timeout",
     "use(arm)\ncell:add_signal{name = 'go'}\n"
     "put('  WAIT FOR go TIMEOUT 0.5;\\n', 'SIGNAL\\n  INPUT BOOL: go AT 1;\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.grip",
     "use(arm)\ncell:set_robot_q{robot = 'ur5', q = {0, -1.57, -1.57, -1.57, 1.57, 0}}\n"
     "put('  MOVE PTP ' .. place(400, 200, 450) .. ';\\n  MOVE LIN ' .. place(400, 200, 300) .. "
     "';\\n  gripper := TRUE;\\n', 'SIGNAL\\n  OUTPUT BOOL: gripper AT 3;\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.until",
     "use(arm)\ncell:add_signal{name = 'arrived'}\n"
     "put('  MOVE PTP ' .. place(400, 200, 400) .. ';\\n  MOVE LIN ' .. place(400, 200, 300) .. "
     "' SPEED := 50.0 UNTIL arrived;\\n', 'SIGNAL\\n  INPUT BOOL: arrived AT 1;\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.program",
     "use(arm)\nput('  WAIT 0.1 SEC;\\n  a := a DIV b;\\n', 'VAR\\n  INT: a := 1, b := 0;\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"program.ignored",
     "use(arm)\nput('  MOVE PTP ' .. place(400, 200, 400) .. ' C_PASS := TRUE;\\n')\n"
     "return 'program.check_run', {id = 'job'}"},
    {"run.starts_in_contact",
     "arm = robot.get('arm')\nlocal at = arm:fk{q = 'ready'}\n"
     "cell:add_robot{robot = arm, name = 'arm', q = 'ready'}\n"
     "box('wall', 0.2, 0.2, 0.2, at.position)\n"
     "task.create{name = 'rest', steps = {{step = 'wait', time = 0.2}}}\n"
     "cell:add_task{task = 'rest', robot = 'arm'}\n"
     "return 'fault.list', {recording = cell:run_task{task = 'rest'}}",
     1},
    {"run.starts_outside_limits",
     "cell:add_robot{robot = robot.get('kr5'), name = 'arm', q = {0, '60 deg', '75 deg', 0, '30 "
     "deg', 0}}\n"
     "task.create{name = 'rest', steps = {{step = 'wait', time = 0.2}}}\n"
     "cell:add_task{task = 'rest', robot = 'arm'}\n"
     "return 'fault.list', {recording = cell:run_task{task = 'rest'}}"},
    {"run.note",
     "use(arm)\nput('  WRITELN(\\'hello\\');\\n  WAIT 0.2 SEC;\\n')\n"
     "return 'fault.list', {recording = cell:run_task{program = 'job'}}"},
    {"recording.out_of_date",
     "use(arm)\ntask.create{name = 'rest', steps = {{step = 'wait', time = 0.2}}}\n"
     "cell:add_task{task = 'rest', robot = 'ur5'}\nlocal r = cell:run_task{task = 'rest'}\n"
     "cell:set_robot_q{robot = 'ur5', q = {0.1, -1, 1, -1.5, -1.5, 0}}\n"
     "return 'fault.list', {recording = r}",
     1},
};

const FaultCase kTextCases[] = {
    {"program.syntax",
     "program.create{name = 'weld', source = 'PROGRAM weld;\\nVAR\\n  INT: count;\\nBEGIN\\n  "
     "coumt := 1;\\nENDPROGRAM;\\n'}\nreturn 'fault.list', {record = 'weld'}",
     1},
    {"program.not_read",
     "file('m.jbi', '/JOB\\n//NAME M\\n//POS\\n///NPOS 0,0,0,0,0,0\\n//INST\\n///DATE 2020/01/01 "
     "00:00\\n///ATTR SC,RW\\n///GROUP1 RB1\\nNOP\\nCLS\\nEND\\n')\n"
     "program.import{file = 'm.jbi'}\nreturn 'fault.list', {record = 'm'}"},
    {"program.not_posted",
     "put('  IF go THEN\\n    WAIT 1.0 SEC;\\n  ENDIF;\\n', 'SIGNAL\\n  INPUT BOOL: go AT 1;\\n')\n"
     "return 'program.post', {id = 'job', target = 'gcode', check = true}"},
    {"program.posted_otherwise",
     "put('  MOVE PTP ' .. place(400, 200, 400) .. ' C_PASS := TRUE;\\n  WRITELN(\\'a\\');\\n')\n"
     "return 'program.post', {id = 'job', target = 'gcode', check = true}"},
};

const FaultCase kImportCases[] = {
    {"import.left_out",
     "file('broken.stl', 'solid nothing\\nfacet normal 0 0')\nurdf('broken.stl')\n"
     "import{file = 'arm.urdf'}\nreturn 'fault.list', {record = 'arm'}"},
    {"import.no_mass",
     "urdf()\nimport{file = 'arm.urdf'}\n"
     "return 'fault.list', {record = 'arm'}"},
    {"import.note",
     "urdf(nil, '<transmission name=\"t\"/>')\nimport{file = 'arm.urdf'}\n"
     "return 'fault.list', {record = 'arm'}"},
    {"import.open_mesh",
     "file('leaf.stl', 'solid leaf\\nfacet normal 0 0 1\\nouter loop\\nvertex 0 0 0\\nvertex 1 0 "
     "0\\nvertex 0 1 0\\nendloop\\nendfacet\\nfacet normal 0 0 1\\nouter loop\\nvertex 1 0 "
     "0\\nvertex 1 1 0\\nvertex 0 1 0\\nendloop\\nendfacet\\nendsolid\\n')\n"
     "import{file = 'leaf.stl'}\nreturn 'fault.list', {}"},
};

const FaultCase kPluginCases[] = {
    {"plugin.not_found", "return 'plugin.load', {file = './nowhere.so'}"},
    {"plugin.cannot_open",
     "file('text.so', 'this is no library, whatever its name says, and long enough for a head')\n"
     "return 'plugin.load', {file = './text.so'}"},
    {"plugin.refused", "return 'plugin.load', {file = abi .. '/abi_no_entry.so'}"},
    {"plugin.left_out", "return 'plugin.check', {file = abi .. '/abi_unknown_interface.so'}"},
    {"provider.parameter",
     "robot.create{name = 'own', ik = {name = 'numeric', params = {nonsense = 1}}, links = {{a = "
     "0.3}, {a = 0.2}}}\nreturn 'fault.list', {record = 'own'}",
     1},
    {"provider.parameter",
     "robot.create{name = 'own', ik = {name = 'numeric', params = {max_iterations = 0}}, links = "
     "{{a = 0.3}, {a = 0.2}}}\nreturn 'fault.list', {record = 'own'}",
     2},
    {"provider.missing",
     "robot.create{name = 'own', ik = 'numerc', links = {{a = 0.3}, {a = 0.2}}}\n"
     "return 'fault.list', {record = 'own'}",
     2},
    {"provider.failed",
     "robot.create{name = 'own', ik = 'unlicensed', links = {{a = 0.3}, {a = 0.2}}}\n"
     "return 'robot.solve_ik', {id = 'own', target = {0.3, 0.2, 0, 0, 0, 0}}"},
};

/// Errors of commands without a code of their own.
const FaultCase kErrorCases[] = {
    {"error.invalid_argument",
     "return 'program.check_run', {id = program.create{name = 'alone', source = 'PROGRAM "
     "alone;\\nBEGIN\\nENDPROGRAM;\\n'}}"},
    {"error.usage", "return 'draft.start', {draft = draft.open('d'), command = 'document.undo'}"},
    {"error.unknown_name", "return 'draft.discard', {draft = 999}"},
    // Members that do not exist: a tool, a link, one of a world, one within a table.
    {"error.unknown_name", "return 'robot.fk', {id = 'arm', q = {0, 0}, tip = 'torch'}", 1},
    {"error.unknown_name", "return 'robot.link', {id = 'arm', link = 'lnik_1'}", 1},
    {"error.unknown_name",
     "cell:add_robot{robot = arm, name = 'left'}\n"
     "return 'world.set_robot_q', {id = 'cell', robot = 'lfet', q = {0, 0}}",
     1},
    {"error.unknown_name",
     "return 'robot.create', {name = 'twin', links = {{name = 'one', a = 0.3}, {name = 'two', "
     "mimic = {link = 'noe'}}}}"},
    {"error.not_found", "return 'program.import', {file = './nowhere.irl'}"},
    {"error.conflict",
     "local p = program.create{name = 'p', source = 'PROGRAM p;\\nBEGIN\\nENDPROGRAM;\\n'}\n"
     "p:export{folder = '.'}\nreturn 'program.export', {id = p, folder = '.'}"},
    {"error.unreachable", "return 'robot.solve_ik', {id = 'arm', target = {9, 0, 0, 0, 0, 0}}"},
};

std::string folder_of_test() {
  return (fs::temp_directory_path() / ("robomosp-fault-codes-" + std::to_string(::getpid())))
      .string();
}

class FaultCodesTest : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    before_ = fs::current_path();
    fs::remove_all(folder_of_test());
    fs::create_directories(folder_of_test());
    fs::current_path(folder_of_test());
  }
  void TearDown() override {
    fs::current_path(before_);
    fs::remove_all(folder_of_test());
  }

  /// The faults that a call ends with, or that its result lists.
  std::vector<Fault> look(const std::string& command, const Map& args) {
    const auto done = app().dispatch(session_, command, args);
    samples_ = 0;
    if (!done.ok()) return faults_of(done.error());
    if (const Value* n = done->as_map() ? done->as_map()->find("samples") : nullptr)
      samples_ = static_cast<std::size_t>(n->number());
    std::vector<Fault> out;
    const Value* rows = done->as_map() ? done->as_map()->find("faults") : nullptr;
    if (!rows || !rows->as_list()) return out;
    for (const Value& row : *rows->as_list()) {
      const Value* inner = row.as_map()->find("fault");
      auto f = fault_from(inner ? *inner : row);
      EXPECT_TRUE(f) << row.text();
      if (f) out.push_back(std::move(*f));
    }
    return out;
  }

  /// The fault names what a window opens: by its area, a record, an argument, a file or a provider.
  static void expect_subject(const Fault& f) {
    const FaultSubject& s = f.subject;
    const std::string_view area = std::string_view(f.code).substr(0, f.code.find('.'));
    if (area == "argument") {
      EXPECT_NE(s.command, "");
      EXPECT_NE(s.argument, "");
    } else if (area == "plugin") {
      EXPECT_NE(s.provider + s.file, "");
    } else if (area == "import") {
      EXPECT_TRUE(s.record.number || !s.file.empty());
    } else if (area != "error") {
      EXPECT_NE(s.record.number, 0U);
      EXPECT_NE(s.name, "");
    }
    if (area == "record" || area == "solid" || area == "robot") {
      EXPECT_NE(s.path, "");
    }
    if (area == "provider") {
      EXPECT_NE(s.provider, "");
      EXPECT_NE(s.interface_id, "");
    }
  }
  /// Rows, samples and times of the fault are there. `samples` is the number of those that the call
  /// looked at, 0 = it has none.
  static void expect_extent(const Fault& f, std::size_t samples) {
    const FaultExtent& e = f.extent;
    EXPECT_LE(e.first, e.last);
    if (e.worst) {
      EXPECT_GE(e.worst, e.first);
      EXPECT_LE(e.worst, e.last);
    }
    std::vector<double> times;
    for (const auto& t : {e.from, e.at, e.to})
      if (t) times.push_back(*t);
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
    if (f.code.starts_with("trajectory.") && f.code != "trajectory.start") {
      EXPECT_GE(e.first, 1U);
      EXPECT_GE(e.worst, 1U);
      EXPECT_LE(e.last, samples);
      EXPECT_TRUE(e.from && e.at && e.to);
    }
  }

  /// What the fault names exists.
  void expect_open(const Fault& f) {
    ASSERT_NE(find_fault_code(f.code), nullptr) << f.code;
    EXPECT_FALSE(f.message.empty());
    expect_subject(f);
    expect_extent(f, samples_);
    const FaultSubject& s = f.subject;
    const auto now = app().document.now();
    if (s.record.kind == "recording") {
      EXPECT_TRUE(app().recordings.find(s.record.number));
    } else if (s.record.number) {
      const auto id = Application::record_id(*now, s.record);
      ASSERT_TRUE(id.ok()) << s.record.number;
      const model::Record& record = *now->find(*id);
      EXPECT_EQ(s.name, record.name);
      EXPECT_TRUE(s.path.empty() || model::find(model::content(record.body), s.path)) << s.path;
      if (to_string(record.kind()) == "program" && s.line > 0) expect_line(record, s);
    }
    if (!s.command.empty()) {
      const CommandSpec* spec = app().commands.find(s.command);
      ASSERT_NE(spec, nullptr) << s.command;
      const std::string root = s.argument.substr(0, s.argument.find_first_of(".["));
      const bool is_known = std::any_of(spec->params.begin(), spec->params.end(),
                                        [&](const ParamSpec& p) { return p.name == root; });
      EXPECT_TRUE(root.empty() || is_known || f.code == "argument.unknown") << root;
    }
  }
  static void expect_line(const model::Record& record, const FaultSubject& s) {
    const auto& p = std::get<model::OtherContent>(record.body).as<model::Program>();
    const auto file = std::find_if(p.files.begin(), p.files.end(),
                                   [&](const auto& g) { return g.name == s.file; });
    ASSERT_NE(file, p.files.end()) << s.file;
    ASSERT_LE(s.line, file->lines.size());
    EXPECT_GE(s.end_column, s.column);
    const std::string line = std::to_string(s.line);  // as it was made, and as maps have it
    EXPECT_TRUE(s.path.ends_with("lines[" + line + "]") || s.path.ends_with("lines." + line))
        << s.path;
  }

  /// A witness in a scene is drawn. The bodies that it names are in the scene.
  void expect_picture(const Fault& f) {
    if (f.witness.scene.number == 0) {
      EXPECT_TRUE(f.witness.bodies.empty() && f.witness.points.empty() && f.witness.q.empty());
      return;
    }
    if (app().registry.list(render::Renderer::kInterfaceId).empty()) return;
    const auto drawn = app().dispatch(session_, "fault.picture",
                                      {{"fault", fault_map(f)},
                                       {"file", "fault.png"},
                                       {"size", List{64, 48}},
                                       {"quality", "draft"}});
    ASSERT_TRUE(drawn.ok()) << drawn.error().sentence();
    EXPECT_GT(fs::file_size("fault.png"), 100U);
  }

  /// Each remedy removes the fault.
  void expect_mended(const std::string& command, const Map& args, const Fault& f) {
    for (const FaultRemedy& r : f.remedies) {
      SCOPED_TRACE("remedy: " + r.label);
      EXPECT_EQ(r.is_tried, r.untried.empty())
          << "a remedy is tried, or says why not: " << r.untried;
      const auto same = [&](const Fault& o) {
        return o.code == f.code && o.subject.record == f.subject.record &&
               o.subject.path == f.subject.path && o.subject.argument == f.subject.argument &&
               o.subject.line == f.subject.line && o.witness.bodies == f.witness.bodies;
      };
      std::vector<Fault> left;
      if (r.repeats) {
        ASSERT_EQ(r.command, command);
        left = look(command, repeated(r, args));
      } else {
        const auto done = app().dispatch(session_, r.command, r.args);
        ASSERT_TRUE(done.ok()) << done.error().sentence();
        left = look(command, args);
        if (app().commands.find(r.command)->effect.has(Effect::edits)) {
          const auto undone = app().dispatch(session_, "document.undo", {});
          EXPECT_TRUE(undone.ok());
        }
      }
      EXPECT_TRUE(std::none_of(left.begin(), left.end(), same));
      ++mended_;
    }
  }

  void expect_fault(const std::string& code, const std::string& command, const Map& args,
                    std::size_t remedies, const char* path = nullptr) {
    const std::vector<Fault> all = look(command, args);
    const auto it =
        std::find_if(all.begin(), all.end(), [&](const Fault& f) { return f.code == code; });
    std::string seen;
    for (const Fault& f : all) seen += f.code + ": " + sentence(f) + "\n";
    ASSERT_NE(it, all.end()) << command << " gives\n" << seen;
    provoked().insert(code);
    for (const Fault& f : all) {
      SCOPED_TRACE(f.code + ": " + sentence(f));
      expect_open(f);
    }
    EXPECT_GE(it->remedies.size(), remedies) << sentence(*it);
    if (path) {
      EXPECT_EQ(it->subject.path, path);
    }
    expect_picture(*it);
    for (const Fault& f : all) {
      SCOPED_TRACE(f.code + ": " + sentence(f));
      expect_mended(command, args, f);
    }
  }

  void expect_cases(const char* prelude, std::span<const FaultCase> cases) {
    for (const FaultCase& c : cases) {
      SCOPED_TRACE(c.code);
      app().document.clear();
      run(prelude);
      const auto made = state_->eval_values(c.lua);
      ASSERT_TRUE(made.ok()) << c.code << ": " << made.error().sentence();
      ASSERT_EQ(made->size(), 2U);
      const Map* args = (*made)[1].as_map();
      expect_fault(*(*made)[0].as_string(), c, args ? *args : Map{});
    }
  }
  void expect_fault(const std::string& command, const FaultCase& c, const Map& args) {
    expect_fault(c.code, command, args, c.remedies, c.path);
  }

  /// Codes with a case, of all tests.
  static std::set<std::string>& provoked() {
    static std::set<std::string> all;
    return all;
  }
  std::size_t mended_ = 0;
  std::size_t samples_ = 0;  ///< of the last call of look()
  fs::path before_;
};

TEST_F(FaultCodesTest, OfArguments) {
  expect_cases(kArm, kArgumentCases);
  EXPECT_GE(mended_, 7U);
}
TEST_F(FaultCodesTest, OfRecords) {
  expect_cases(kArm, kRecordCases);
  // Commands of the program check what they refer to; those of plugins may not.
  CommandSpec spec;
  spec.name = "fault.refer";
  spec.summary = "Places a robot that is not there.";
  spec.example = "assert(true)";
  spec.plugin = "test";
  spec.effect = Effect::edits;
  spec.plugged = [](CommandContext& ctx, const Map&) -> Result<Value> {
    RMP_TRY(ctx.edit().edit(*ctx.snapshot().find(Kind::world, "cell"),
                            [](model::Record& r) -> Result<void> {
                              model::PlacedRobot placed;
                              placed.name = "ghost";
                              placed.robot = RobotId{999};
                              std::get<model::World>(r.body).robots.push_back(placed);
                              return {};
                            }));
    return Value();
  };
  ASSERT_TRUE(app().commands.add_plugged(std::move(spec)).ok());
  app().document.clear();
  run(kArm);
  expect_fault("record.bad_reference", "fault.refer", {}, 0, "robots");
  EXPECT_GE(mended_, 2U);
}
TEST_F(FaultCodesTest, OfTrajectories) {
  expect_cases(kLift, kTrajectoryCases);
  EXPECT_GE(mended_, 2U);
}

// A fault spans the samples that have it, counted from 1; those are found here from the heights of
// the path alone.
TEST_F(FaultCodesTest, TrajectoryFaultsSpanTheSamplesAtFault) {
  run(kLift);
  run("line('up', 2)\nline('high', 0.95)\nbeam(0.86)");
  const auto expect_rows = [&](const char* code, const char* trajectory, double above) {
    const auto points = app().dispatch(session_, "trajectory.points", {{"id", trajectory}});
    ASSERT_TRUE(points.ok()) << points.error().sentence();
    const NumericArray& rows = *points->as_array();
    std::size_t first = 0, last = 0;
    for (std::size_t i = 0; i < rows.rows(); ++i)
      if (rows[i * rows.cols() + 3] > above) {
        if (first == 0) first = i + 1;
        last = i + 1;
      }
    ASSERT_GT(first, 1U);
    const std::vector<Fault> all =
        look("world.check", {{"id", "cell"}, {"robot", "lift"}, {"trajectory", trajectory}});
    EXPECT_EQ(samples_, rows.rows());
    const auto it =
        std::find_if(all.begin(), all.end(), [&](const Fault& f) { return f.code == code; });
    ASSERT_NE(it, all.end());
    EXPECT_EQ(it->extent.first, first);
    EXPECT_EQ(it->extent.last, last);
    EXPECT_EQ(it->extent.from, rows[(first - 1) * rows.cols()]);
    EXPECT_EQ(it->extent.to, rows[(last - 1) * rows.cols()]);
    EXPECT_EQ(it->extent.at, rows[(it->extent.worst - 1) * rows.cols()]);
  };
  // The joint ends at 1 m; the cube of 0.1 m reaches the lower side of the beam 0.1 m below its
  // middle.
  expect_rows("trajectory.unreachable", "up", 1);
  expect_rows("trajectory.collision", "high", 0.76);
}
TEST_F(FaultCodesTest, OfRuns) {
  expect_cases(kUr5, kRunCases);
  EXPECT_GE(mended_, 4U);
}
TEST_F(FaultCodesTest, OfCompilersReadersAndPosts) {
  expect_cases(kUr5, kTextCases);
  EXPECT_GE(mended_, 1U);
}

TEST_F(FaultCodesTest, OfImports) {
  const std::string prelude =
      kUr5 + std::string(
                 "robot.remove('ur5')\n"
                 "function urdf(mesh, more)\n"
                 "  file('arm.urdf', '<robot name=\"arm\"><link name=\"base\"/><link "
                 "name=\"hand\">' .. (mesh and '<visual><geometry><mesh filename=\"' .. mesh .. "
                 "'\"/></geometry></visual>' or '') .. '</link><joint name=\"turn\" "
                 "type=\"revolute\"><parent link=\"base\"/><child link=\"hand\"/><axis xyz=\"0 0 "
                 "1\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>' .. "
                 "(more or '') .. '</robot>')\nend\n");
  expect_cases(prelude.c_str(), kImportCases);
}

TEST_F(FaultCodesTest, OfPlugins) {
  static const rmp_provider row = [] {
    rmp_provider r{};
    r.interface_id = IkSolver::kInterfaceId;
    r.name = "unlicensed";
    r.summary = "It cannot be made.";
    r.create = [](const rmp_host*, char* error, std::uint32_t size) -> void* {
      if (size > 0) error[std::string("no licence was found").copy(error, size - 1)] = '\0';
      return nullptr;
    };
    return r;
  }();
  ProviderInfo info;
  info.interface_id = IkSolver::kInterfaceId;
  info.name = "unlicensed";
  info.summary = "It cannot be made.";
  ASSERT_TRUE(app()
                  .registry
                  .add(info, [] { return make_provider(row, nullptr, "robomosp.ik/1 unlicensed"); })
                  .ok());
  const std::string prelude =
      kUr5 + std::string("abi = '" ROBOMOSP_BUILD_DIR "/tests/abi/plugins'\n");
  expect_cases(prelude.c_str(), kPluginCases);
  app().registry.remove(IkSolver::kInterfaceId, "unlicensed");
  // The robot of the last case has a solver that is gone.
  expect_fault("provider.missing", "fault.list", {{"record", "own"}}, 1);
}

TEST_F(FaultCodesTest, OfErrorsWithoutACodeOfTheirOwn) {
  expect_cases(kArm, kErrorCases);
  EXPECT_GE(mended_, 3U);
  // The other classes come from commands of plugins and from scripts.
  for (const auto& [name, code] :
       std::map<std::string, ErrorCode>{{"syntax", ErrorCode::syntax},
                                        {"io", ErrorCode::io},
                                        {"stale_handle", ErrorCode::stale_handle},
                                        {"plugin_refused", ErrorCode::plugin_refused},
                                        {"plugin_failed", ErrorCode::plugin_failed},
                                        {"permission", ErrorCode::permission},
                                        {"cancelled", ErrorCode::cancelled},
                                        {"unsupported", ErrorCode::unsupported},
                                        {"internal", ErrorCode::internal},
                                        {"script_failed", ErrorCode::script_failed}}) {
    CommandSpec spec;
    spec.name = "fault.fail_" + name;
    spec.summary = "Fails.";
    spec.example = "assert(true)";
    spec.plugin = "test";
    spec.plugged = [code = code](CommandContext&, const Map&) -> Result<Value> {
      return error(code, "it failed");
    };
    ASSERT_TRUE(app().commands.add_plugged(std::move(spec)).ok());
    expect_fault("error." + name, "fault.fail_" + name, {}, 0);
  }
}

/// After the others: they are in the order of the file.
TEST_F(FaultCodesTest, Zz_EveryCodeOfTheTableHasACase) {
  if (provoked().empty()) GTEST_SKIP() << "the other tests did not run";
  std::string missing;
  for (const FaultCode& c : fault_codes())
    if (!provoked().contains(c.code)) missing += std::string(c.code) + " ";
  EXPECT_EQ(missing, "") << "give each code a command that provokes it";
}

}  // namespace
}  // namespace robomosp::ioci
