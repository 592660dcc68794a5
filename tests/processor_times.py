#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Processor time of each test, the most costly first.

usage: tests/processor_times.py BUILD_FOLDER [-R REGEX] [--keep FILE] [--before FILE]

Runs the tests of a build one by one, as ctest would (its times are those of the clock, which say
little on a machine that does something else), and prints for each its processor time with that of
the processes it starts, and its time by the clock. --keep writes the figures as JSON, --before
prints those of an earlier file beside them. Ends with 1 if a test failed."""

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import time

SKIPPED = 77


def tests_of(folder):
    listed = subprocess.run(["ctest", "--show-only=json-v1"], cwd=folder, check=True, capture_output=True, text=True)
    for test in json.loads(listed.stdout)["tests"]:
        properties = {p["name"]: p["value"] for p in test.get("properties", [])}
        if test.get("command") and not properties.get("DISABLED"):
            yield test["name"], test["command"], properties


def changed(environment, properties):
    """The environment with ENVIRONMENT of a test; operations of ENVIRONMENT_MODIFICATION that only set."""
    out = dict(environment)
    for line in properties.get("ENVIRONMENT", []):
        name, _, value = line.partition("=")
        out[name] = value
    for line in properties.get("ENVIRONMENT_MODIFICATION", []):
        name, _, operation = line.partition("=")
        kind, _, value = operation.partition(":")
        if kind == "set":
            out[name] = value
        elif kind == "unset":
            out.pop(name, None)
        else:
            sys.exit(f"{name}: this script does not know the operation {kind} of ENVIRONMENT_MODIFICATION")
    return out


def run(folder, command, properties):
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    process = subprocess.Popen(command, cwd=properties.get("WORKING_DIRECTORY", folder), stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=changed(os.environ, properties))
    try:
        output, _ = process.communicate(timeout=properties.get("TIMEOUT", 1500))
        code = process.returncode
    except subprocess.TimeoutExpired:
        process.kill()
        output, _ = process.communicate()
        code = "timeout"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if code != 0 and code == properties.get("SKIP_RETURN_CODE", SKIPPED):
        code = "skipped"
    return {"processor": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            "clock": time.monotonic() - started, "code": code, "output": output.decode("utf-8", "replace")}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("-R", default="", help="only tests with a name that matches")
    parser.add_argument("--keep", help="file for the figures, as JSON")
    parser.add_argument("--before", help="such a file of an earlier run")
    given = parser.parse_args()
    before = {}
    if given.before:
        with open(given.before, encoding="utf-8") as file:
            before = json.load(file)
    rows, failed = {}, []
    for name, command, properties in tests_of(given.folder):
        if not re.search(given.R, name):
            continue
        if not os.path.exists(command[0]):
            print(f"{name} is not built", file=sys.stderr)
            continue
        result = run(given.folder, command, properties)
        print(f"{result['processor']:8.1f} s  {name}", file=sys.stderr)
        if result["code"] not in (0, "skipped"):
            failed.append(name)
            print(f"{name} failed ({result['code']}):\n{result['output'][-2000:]}", file=sys.stderr)
        rows[name] = {k: result[k] for k in ("processor", "clock", "code")}
    print("processor s" + ("   before" if before else "") + "   clock s  test")
    for name, row in sorted(rows.items(), key=lambda item: -item[1]["processor"]):
        earlier = f"{before[name]['processor']:9.1f}" if name in before else "        -" if before else ""
        print(f"{row['processor']:11.1f}{earlier}{row['clock']:10.1f}  {name}"
              + ("" if row["code"] == 0 else f" ({row['code']})"))
    total = sum(row["processor"] for row in rows.values())
    print(f"{total:11.1f} s of processor time in {len(rows)} tests, {total / 60:.1f} minutes")
    if given.keep:
        with open(given.keep, "w", encoding="utf-8") as file:
            json.dump(rows, file, indent=1)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
