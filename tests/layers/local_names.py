#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that a name local to a source file is unique in its folder.

The sources of a folder are compiled together (docs/decisions/0072-unity-builds.md), so two files that
declare the same name in an anonymous namespace, or as static, collide. The compiler reports only pairs
that happen to share a unit today; this test reports every pair.

ROOMS is the folder with the lists of the programs that many tests share (robomosp_make_rooms in
cmake/RobomospProject.cmake): their names are unique in a program.

usage: local_names.py ROOT [ROOMS] | --self-test
"""
import collections
import os
import re
import sys

FOLDERS = ("kernel", "modules", "plugins", "viewer", "tests")
# Compiled as units of their own: programs' main files, lanes (once an instruction set), plugins of tests.
ALONE = re.compile(r"(^|/)(main|.*_kernels?|recursion_derivatives|lanes_\w+)\.cpp$")


def without_comments_and_text(source):
    """The source with comments, strings and characters blanked; lines keep their numbers."""
    pattern = re.compile(
        r'//[^\n]*|/\*.*?\*/|(?<![\w])R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"'
        r"|(?<![\w])'(?:\\.|[^'\\\n])*'", re.S)

    def blank(match):
        text = match.group(0)
        lines = "\n" * text.count("\n")
        return lines if text.startswith("/") else '""' + lines

    source = pattern.sub(blank, source)
    return re.sub(r"^[ \t]*#(?:\\\n|[^\n])*", lambda m: "\n" * m.group(0).count("\n"), source, flags=re.M)


def without_angles(text):
    """The text with template arguments removed, innermost first."""
    while True:
        shorter = re.sub(r"<[^<>()]*>", "", text)
        if shorter == text:
            return text
        text = shorter


def declared(statement, has_body):
    """What a statement at namespace scope declares: [(name, kind)]."""
    s = re.sub(r"\[\[.*?\]\]", "", " ".join(statement.split()))
    if s.startswith(("using namespace", "static_assert", "friend", "template class", "template struct",
                     "extern template", "RMP_", "Handle(",  # Handle() is a macro of Open CASCADE
                     "TEST(", "TEST_F(", "TEST_P(", "INSTANTIATE_TEST_SUITE_P(")):
        return []
    if s.startswith("template"):
        depth = 0
        for i, c in enumerate(s):
            depth += (c == "<") - (c == ">")
            if c == ">" and depth == 0:
                s = s[i + 1:].strip()
                break
    match = re.match(r"(?:enum class|enum struct|enum|struct|class|union|concept) (?:alignas\(.*?\) )?([\w:]+)", s)
    if match and "(" not in match.group(0):
        return [(match.group(1), "type")] if has_body or s.startswith("concept") else []
    match = re.match(r"using (\w+) ?=", s) or re.match(r"namespace (\w+) ?=", s)
    if match:
        return [(match.group(1), "alias " + s)]
    if s.startswith("using "):
        return []
    plain = without_angles(re.sub(r"\b(?:alignas|decltype|noexcept|__attribute__)\s*\([^()]*\)", "", s))
    equals = plain.find("=")
    call = re.search(r"([A-Za-z_][\w:]*|operator ?[^\s(]+) ?\(", plain)
    if call and (equals < 0 or call.start() < equals or "operator" in plain):
        return [(call.group(1), "function")]
    out = []
    for part in re.split(r",(?![^({\[]*[)}\]])", plain):  # const int a = 1, b = 2
        match = re.match(r".*?([A-Za-z_]\w*)\s*(?:\[[^\]]*\]\s*)*(?:=|\{|$)", part.strip())
        if match:
            out.append((match.group(1), "variable"))
    return out


def local_names(source):
    """Names that are local to a source: [(name, kind, line)]."""
    text = without_comments_and_text(source)
    out, scopes, statement, parentheses, line, first = [], [], "", 0, 1, 1

    def note(has_body):
        local = "anonymous" in scopes or re.search(r"\bstatic\b", statement.split("(")[0])
        for name, kind in declared(statement, has_body):
            if local and "::" not in name:
                out.append((name, kind, first))

    for c in text:
        line += c == "\n"
        if "body" in scopes:
            if c == "{":
                scopes.append("body")
            elif c == "}":
                scopes.pop()
            continue
        parentheses += (c in "([") - (c in ")]")
        if c == "{" and parentheses == 0:
            match = re.match(r"(?:inline )?namespace ?([\w:]*)$", " ".join(statement.split()))
            if match:
                scopes.append(match.group(1) or "anonymous")
                statement = ""
            elif " ".join(statement.split()) == 'extern ""':
                scopes.append("extern")
                statement = ""
            else:
                note(True)
                scopes.append("body")
                statement += " {}"
        elif c == "{":
            scopes.append("body")
            statement += "{}"
        elif c == "}" and parentheses == 0:
            if scopes:
                scopes.pop()
            statement = ""
        elif c == ";" and parentheses == 0:
            if statement.strip() and not statement.rstrip().endswith("{}"):
                note(False)
            statement = ""
        else:
            if statement.rstrip().endswith("{}") and not c.isspace() and c not in ",=)":
                statement = ""
            if not statement.strip() and not c.isspace():
                first = line
            statement += c
    return out


def collisions(files):
    """Messages about names that two of the files {path: source} declare."""
    places = collections.defaultdict(dict)
    for path, source in files.items():
        for name, kind, line in local_names(source):
            places[name].setdefault(path, (kind, line))
    out = []
    for name, found in sorted(places.items()):
        kinds = {kind for kind, _ in found.values()}
        if len(found) < 2 or (len(kinds) == 1 and next(iter(kinds)).startswith("alias")):
            continue  # the same alias twice is allowed
        where = " and ".join(f"{path}:{line}" for path, (_, line) in sorted(found.items()))
        out.append(f"{name} is local to {where}: name each after what it is for, or share it in a header")
    return out


def self_test():
    a = """namespace x { namespace {
constexpr int kOne = 1, kTwo = f(2, 3);
const char* const text = R"(} namespace y { int hidden;)";
template <class T, class U = std::map<int, T>> std::vector<T> made(const T& t) { if (t) { int inside; } }
using Id = int; struct Only { int member; }; static_assert(true);
} static void helper() {} int visible() { return 1; } }"""
    b = a.replace("using Id = int", "using Id = long").replace("Only", "Other")
    names = {name for name, _, _ in local_names(a)}
    assert names == {"kOne", "kTwo", "text", "made", "Id", "Only", "helper"}, names
    found = [m.split()[0] for m in collisions({"a.cpp": a, "b.cpp": b})]
    assert found == ["Id", "helper", "kOne", "kTwo", "made", "text"], found
    assert not [m for m in collisions({"a.cpp": "using Id = int;", "b.cpp": "using Id = int;"})]


def rooms_of(rooms):
    """The room of each test source: {name: room}."""
    out = {}
    for name in sorted(os.listdir(rooms)) if rooms else []:
        with open(os.path.join(rooms, name), encoding="utf-8") as f:
            out.update((source, name) for source in re.findall(r'\{"\w+", "([\w.]+)"\}', f.read()))
    return out


def main(root, rooms=None):
    self_test()
    room_of = rooms_of(rooms)
    folders = collections.defaultdict(dict)
    for top in FOLDERS:
        for folder, _, names in os.walk(os.path.join(root, top)):
            for name in names:
                path = os.path.relpath(os.path.join(folder, name), root)
                if not name.endswith(".cpp") or ALONE.search(path):
                    continue
                together = os.path.dirname(path)
                if path.startswith("tests/"):
                    if together != "tests/unit" or name not in room_of:
                        continue
                    together = room_of[name]
                with open(os.path.join(root, path), encoding="utf-8") as f:
                    folders[together][path] = f.read()
    faults = [m for files in folders.values() for m in collisions(files)]
    print("\n".join(faults) or f"{sum(map(len, folders.values()))} sources in {len(folders)} folders: no name twice")
    return 1 if faults or len(folders) < 20 else 0


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    else:
        sys.exit(main(*sys.argv[1:]))
