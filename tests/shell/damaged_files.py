# SPDX-License-Identifier: Apache-2.0
"""Damages each file of a folder of `robomosp post test --reader` that has its reader: one digit, one
line, one word of a condition at a time. What is compared must not be equal any more.

python3 damaged_files.py FOLDER   prints how many were found, and those that were not; ends with 1
where one was not.
"""
import importlib
import json
import pathlib
import re
import sys


# Variables of the program rounds that are set before they are read.
SET_BEFORE = re.compile(r"\s*var (i|counter) = 0;\s*$")


def damaged(text):
    """Texts with one damage each: what it is, its line, and the text."""
    lines = text.splitlines(keepends=True)
    for k, line in enumerate(lines):
        def put(new):
            return "".join(lines[:k] + new + lines[k + 1:])
        yield "without its line", line, put([])
        if SET_BEFORE.match(line):
            continue
        for m in re.finditer(r"\d+(?:\.\d+)?", line):
            # The first digit that counts; of a name it is another name.
            at = next((i for i in range(m.start(), m.end()) if line[i] in "123456789"), m.start())
            digit = str((int(line[at]) + 1) % 10)
            yield "another digit", line, put([line[:at] + digit + line[at + 1:]])
        for a, b in (("&&", "||"), ("||", "&&"), ("!in", "in"), ("(in", "(!in"), ("await in", "await !in"),
                     (" < ", " <= "), (" > ", " >= "), ("= on", "= off"), ("= off", "= on"),
                     ("drive", "swing"), ("swing", "drive"), ("say \"", "say \"x")):
            if a in line:
                yield f"{b} for {a}", line, put([line.replace(a, b, 1)])


def main(folder):
    sys.path.insert(0, str(folder))
    compare = importlib.import_module("compare")
    reader = importlib.import_module("reader")
    model = folder / "robot.model"
    robot = compare.Robot(model) if model.exists() else None
    found = missed = 0
    for trace in sorted((folder / "programs").glob("*.trace.json")):
        meant = json.loads(trace.read_text())
        for own in sorted((folder / "programs" / trace.name[:-len(".trace.json")]).iterdir()):
            files = compare.files_of(own)
            if compare.compared(meant, files, reader, robot):
                print(f"{own} is not equal undamaged")
                return 1
            for name, text in files.items():
                for what, line, other in damaged(text):
                    if compare.compared(meant, {**files, name: other}, reader, robot):
                        found += 1
                    else:
                        missed += 1
                        print(f"{own.parent.name}, {own.name}: {what}: {line.strip()}")
    print(f"{found} damages were found, {missed} were not")
    return 1 if missed or not found else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]).resolve()))
