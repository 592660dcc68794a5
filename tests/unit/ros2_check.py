# SPDX-License-Identifier: Apache-2.0
"""Checks a package of ROS 2 by the published formats: package.xml (REP 149), URDF with ros2_control, SRDF, the YAML
files of ros2_control and MoveIt, the launch file. Prints a sentence for each fault; check_urdf is asked where it is."""
import os
import py_compile
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

folder = sys.argv[1]
name = os.path.basename(folder)
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


def fault(text):
    print(text)


def need(truth, text):
    if not truth:
        fault(text)


def path(*parts):
    return os.path.join(folder, *parts)


def yaml(file):
    """The part of YAML that is needed: tables by indentation, lists of words, {a: b} on one line."""
    def scalar(s):
        if s in ("true", "false"):
            return s == "true"
        if s == "{}":
            return {}
        if s.startswith("{"):
            return {k.strip(): scalar(v.strip()) for k, v in (p.split(":") for p in s[1:-1].split(","))}
        if re.fullmatch(r"-?\d+", s):
            return int(s)
        if re.fullmatch(r"-?\d+\.\d*(e[+-]?\d+)?", s):
            return float(s)
        need(NAME.match(s.replace("/", "_")), f"{file}: \"{s}\" is no word")
        return s

    rows = []
    for line in open(path("config", file), encoding="utf-8"):
        if line.strip():
            need("\t" not in line and (len(line) - len(line.lstrip())) % 2 == 0, f"{file}: indentation of {line!r}")
            rows.append((len(line) - len(line.lstrip()), line.strip()))

    def block(at, depth):
        if rows[at][1] == "{}":
            return {}, at + 1
        out = [] if rows[at][1].startswith("- ") else {}
        while at < len(rows) and rows[at][0] == depth:
            text = rows[at][1]
            if isinstance(out, list):
                out.append(scalar(text[2:]))
                at += 1
                continue
            key, _, rest = text.partition(":")
            need(key not in out, f"{file}: {key} stands twice")
            if rest.strip():
                out[key], at = scalar(rest.strip()), at + 1
            elif at + 1 < len(rows) and rows[at + 1][0] > depth:
                out[key], at = block(at + 1, rows[at + 1][0])
            else:
                fault(f"{file}: {key} holds nothing")
                at += 1
        return out, at

    value, end = block(0, 0)
    need(end == len(rows), f"{file}: line {end + 1} stands nowhere")
    return value


# package.xml
package = ET.parse(path("package.xml")).getroot()
need(package.tag == "package" and package.get("format") == "3", "package.xml is not of format 3")
order = [child.tag for child in package]
for tag in ("name", "version", "description", "maintainer", "license"):
    need(order.count(tag) == 1, f"package.xml: {tag} stands {order.count(tag)} times")
need(order[:5] == ["name", "version", "description", "maintainer", "license"], f"package.xml: the order is {order}")
need(package.findtext("name") == name, "package.xml has another name than the folder")
need(re.fullmatch(r"\d+\.\d+\.\d+", package.findtext("version")), "package.xml: version")
need("@" in package.find("maintainer").get("email"), "package.xml: email")
need(package.findtext("export/build_type") == "ament_cmake", "package.xml: build type")
need(package.findtext("buildtool_depend") == "ament_cmake", "package.xml: build tool")
depends = {d.text for d in package.findall("exec_depend")}

# CMakeLists.txt
cmake = open(path("CMakeLists.txt")).read()
need(f"project({name})" in cmake and "ament_package()" in cmake, "CMakeLists.txt")
for installed in re.search(r"install\(DIRECTORY ([\w ]+) DESTINATION", cmake).group(1).split():
    need(os.path.isdir(path(installed)), f"CMakeLists.txt installs {installed}, which is not there")
for there in os.listdir(folder):
    need(not os.path.isdir(path(there)) or re.search(rf"\b{there}\b", cmake), f"{there} is not installed")

# URDF
file = path("urdf", name + ".urdf")
urdf = ET.parse(file).getroot()
links = [link.get("name") for link in urdf.findall("link")]
joints = {j.get("name"): j for j in urdf.findall("joint")}
need(len(set(links)) == len(links), "two links have one name")
for each in links + list(joints):
    need(NAME.match(each), f"\"{each}\" is no name")
parent = {j.find("child").get("link"): j.find("parent").get("link") for j in joints.values()}
roots = [link for link in links if link not in parent]
need(len(roots) == 1, f"the roots are {roots}")
need(all(a in links and b in links for a, b in parent.items()), "a joint names a link that is not there")
for mesh in urdf.iter("mesh"):
    uri = mesh.get("filename")
    prefix = f"package://{name}/"
    need(uri.startswith(prefix) and os.path.isfile(path(uri[len(prefix):])), f"the mesh {uri} is not there")
if shutil.which("check_urdf"):
    done = subprocess.run(["check_urdf", file], capture_output=True, text=True)
    need(done.returncode == 0, "check_urdf: " + done.stdout + done.stderr)

# ros2_control
control = urdf.findall("ros2_control")
need(len(control) == 1 and control[0].get("type") == "system" and control[0].get("name"), "ros2_control")
need(re.fullmatch(r"\w+/\w+", control[0].findtext("hardware/plugin")), "ros2_control: plugin")
commands, states = {}, set()
for j in control[0].findall("joint"):
    n = j.get("name")
    need(n in joints and joints[n].get("type") in ("revolute", "continuous", "prismatic"), f"ros2_control: joint {n}")
    states.add(n)
    need({"position", "velocity"} <= {s.get("name") for s in j.findall("state_interface")}, f"{n}: states")
    for c in j.findall("command_interface"):
        commands[n] = c.get("name")
        need(c.get("name") in ("position", "velocity", "effort"), f"{n}: commands")
        low, high = (next((float(p.text) for p in c.findall("param") if p.get("name") == k), None) for k in ("min", "max"))
        limit = joints[n].find("limit")
        if c.get("name") == "position" and low is not None and high is not None:
            need(low == float(limit.get("lower")) and high == float(limit.get("upper")), f"{n}: limits differ")
    if joints[n].find("mimic") is not None:
        need(not j.findall("command_interface"), f"{n} follows another joint and takes commands")
        need(next(p.text for p in j.findall("param") if p.get("name") == "mimic") == joints[n].find("mimic").get("joint"),
             f"{n}: mimic")

# SRDF
srdf = ET.parse(path("config", name + ".srdf")).getroot()
need(srdf.tag == "robot" and srdf.get("name") == urdf.get("name"), "the SRDF is of another robot")
groups = {g.get("name"): g for g in srdf.findall("group")}
for group in groups.values():
    for chain in group.findall("chain"):
        at = chain.get("tip_link")
        need(at in links, f"the tip {at} is no link")
        while at != chain.get("base_link") and at in parent:
            at = parent[at]
        need(at == chain.get("base_link"), f"no chain leads to {chain.get('tip_link')}")
    for part in group.findall("group"):
        need(part.get("name") in groups and part.get("name") != group.get("name"), f"no group {part.get('name')}")
for state in srdf.findall("group_state"):
    need(state.get("group") in groups, f"the pose {state.get('name')} is of no group")
    for j in state.findall("joint"):
        need(j.get("name") in commands and abs(float(j.get("value"))) < 1e9, f"pose {state.get('name')}: {j.get('name')}")
for j in srdf.findall("passive_joint"):
    need(j.get("name") in joints and j.get("name") not in commands, f"passive joint {j.get('name')}")
virtual = srdf.findall("virtual_joint")
need(len(virtual) == 1 and virtual[0].get("child_link") == roots[0] and virtual[0].get("type") == "fixed", "virtual joint")
pairs = set()
for p in srdf.findall("disable_collisions"):
    pair = frozenset((p.get("link1"), p.get("link2")))
    need(len(pair) == 2 and pair <= set(links), f"disabled pair {sorted(pair)}")
    need(pair not in pairs, f"the pair {sorted(pair)} stands twice")
    need(p.get("reason") in ("Adjacent", "Never", "Always", "User"), f"reason {p.get('reason')}")
    pairs.add(pair)

# YAML
controllers = yaml("controllers.yaml")
manager = controllers["controller_manager"]["ros__parameters"]
need(isinstance(manager["update_rate"], int) and manager["update_rate"] > 0, "update_rate")
for controller, about in manager.items():
    if controller == "update_rate":
        continue
    need(about["type"].split("/")[0] in depends, f"package.xml does not name {about['type']}")
    if about["type"].startswith("joint_trajectory"):
        settings = controllers[controller]["ros__parameters"]
        need(settings["joints"] == list(commands), f"{controller}: joints {settings['joints']}")
        need(settings["command_interfaces"] == sorted(set(commands.values())), f"{controller}: commands")
        need(set(settings.get("gains", commands)) == set(commands), f"{controller}: gains")
limits = yaml("joint_limits.yaml")["joint_limits"]
need(set(limits) == states, f"joint_limits.yaml is of {sorted(limits)}")
for n, about in limits.items():
    for what in ("velocity", "acceleration", "jerk"):
        has = about[f"has_{what}_limits"]
        need(isinstance(has, bool) and has == (f"max_{what}" in about), f"joint_limits.yaml: {n}, {what}")
        need(not has or isinstance(about[f"max_{what}"], float), f"joint_limits.yaml: {n}, {what} is no real number")
    if about["has_velocity_limits"]:
        need(about["max_velocity"] == float(joints[n].find("limit").get("velocity")), f"velocity of {n}")
kinematics = yaml("kinematics.yaml")
need(set(kinematics) <= set(groups), f"kinematics.yaml is of {sorted(kinematics)}")

# the launch file
launch = path("launch", "robot.launch.py")
text = open(launch).read()
with tempfile.TemporaryDirectory() as made:
    try:
        py_compile.compile(launch, os.path.join(made, "x.pyc"), doraise=True)
    except py_compile.PyCompileError as e:
        fault(f"the launch file is no Python: {e}")
need(f'"{name}"' in text and f'"{name}.urdf"' in text, "the launch file names other files")
for needed in re.findall(r'package="(\w+)"', text):
    need(needed in depends, f"package.xml does not name {needed}")
for controller in re.findall(r'"(\w+_(?:controller|broadcaster))"', text):
    need(controller in manager, f"the launch file starts {controller}, which controllers.yaml does not know")
