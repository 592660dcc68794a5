#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Keeps retired words out of the pages, of messages, of the help of commands and of providers, and of
comments in headers. Why they are retired: docs/style.md.

usage: plain_english_test.py [--list] [WORD]   --list prints every place that is found, of WORD only
"""
import os
import re
import sys
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))

# Phrase (a regular expression), and what to write instead.
RETIRED = [
    (r"half-way|halfway", None),  # these two are English; not counted below
    (r"ways?", "the noun: path, method, option, direction, distance, workaround"),
    (r"tells?|told|telling", "reports, returns, prints, shows, gives"),
    (r"stands?(?!-)|standing|stood", "is, is written, is at"),
    (r"deeds?", "action, step"),
    (r"things?", "the noun: object, part, body"),
    (r"doors?", "interface, access"),
    (r"rooms?", "space, memory, environment"),
    (r"of (?:its|their|his|one's) own", "its own ..., a separate ..."),
    (r"in words", "as an error, as text"),
    (r"goes on|go on|going on|went on", "continues"),
    (r"comes? along|came along", "is included"),
    (r"(?:what|who|all|those|one|ones) that there (?:is|are)|that there (?:is|are)",
     "existing, available"),
    (r"(?:nobody|who|whoever) ask(?:s|ed)", "the caller; was not requested"),
    (r"(?:is|are|was|were|be|been|not) said|said of", "is reported, is set, is given"),
    (r"says? so|say so|says? how|says? which|says? what|says? why|says? when",
     "reports, gives, names"),
    (r"lets? go|letting go", "releases"),
    (r"(?:is|are|be) led|leads? (?:the|all|every) moves?", "is guided"),
    (r"whose", "with ..., its ..."),
    (r"over there", "on the server"),
    (r"hears? (?:of|from)", "receives"),
    (r"without a word", "silently"),
    (r"where it (?:is|does) not|where there (?:is|are) (?:none|one|some|any)", "if ..."),
]

# Pages that need such a word for what they describe, and why.
ALLOWED = {
    ("docs/user/remote/cooperation.md", "stand"): "the stand that a bar lies on",
}

# Offenders in messages: clear ones only, as the sentences around them are not read here.
OFFENDERS = [
    r"(?:is|are|was|were) (?:not )?said", r"in words", r"nobody asked", r"(?:is|are) told",
    r"(?:stands?|standing) (?:in|at|on|beside|behind|before|for|outside|where|within|there|no)",
    r"goes on", r"go on", r"lets? go", r"let go", r"comes? along", r"deeds?",
    r"that there (?:is|are)", r"says? (?:so|which|how|what|it)", r"over there", r"things?",
    r"of (?:its|their|one's) own", r"ways?", r"tells?", r"whose", r"hangs? on",
    r"is (?:declared )?nowhere", r"(?:is|are) looked at", r"is none of", r"has no word for",
    r"(?:this|it) is no \w+", r"lead(?:s|ing)? nowhere", r"which there is not", r"there already",
    r"is there twice", r"is not there(?: any more)?", r"that is meant", r"where the robot is",
    r"while it runs", r"motions? of the joints", r"motions? of joints", r"(?:by|of) so much",
    r"(?:share|shares) of the greatest", r"(?:number|value|row|force|requests|one)"
    r" a (?:second|joint|sample|state|degree|vector|target)(?=[.,;]|$)",
]

# Pages that are not wrapped yet.
WITH_LONG_LINES = ("docs/user/irl/readers.md", "docs/user/irl/read_back.md")

FOLDERS_OF_MESSAGES = ("kernel", "modules", "plugins", "sdk", "viewer")

FOLDERS_OF_HEADERS = ("kernel", "modules", "plugins", "sdk/include", "viewer", "tests/support")


def plain(lines):
    """Number and text of the lines of a page that are prose: no blocks, no code, no link targets."""
    inside = False
    out = []
    for number, line in enumerate(lines, 1):
        if line.lstrip().startswith("```"):
            inside = not inside
        elif not inside and not line.startswith("    ") and not line.startswith("<!--"):
            out.append((number, line.rstrip("\n")))
    # Code may begin in one line and end in the next one of its paragraph.
    text = "\n".join(line for _, line in out)
    text = re.sub(r"``[^`]+``|`[^`\n]*(?:\n(?!\n)[^`\n]*)?`", lambda m: "`" + "\n" * m.group().count("\n"), text)
    text = re.sub(r"\]\([^)\s]*\)", "]", text)
    text = re.sub(r"\*[^*\n]+\*(?= \(|,)", "*", text)  # titles of papers and books
    return list(zip((number for number, _ in out), text.split("\n")))


def retired_in(lines):
    """(line, phrase, what to write) of a page; phrases may span two lines."""
    prose = plain(lines)
    text, starts, length = "", [], 0
    for number, line in prose:
        starts.append((length, number))
        text += line + "\n"
        length += len(line) + 1
    free = bytearray(len(text))
    found = []
    for pattern, instead in RETIRED:
        words = re.compile(r"\b(?:" + pattern.replace(" ", r"\s+") + r")(?!\w)", re.IGNORECASE)
        for match in words.finditer(text):
            if instead is None:
                free[match.start():match.end()] = b"\1" * (match.end() - match.start())
            elif not any(free[match.start():match.end()]):
                line = max(n for start, n in starts if start <= match.start())
                found.append((match.start(), line, " ".join(match.group().split()), instead))
    return [place[1:] for place in sorted(found)]


def literals_of_messages(source):
    """Line and text of the literals within calls that make a message, adjacent ones together."""
    calls = re.compile(r"\b(?:error|fail|invalid|refuse|refused|fault|warn|warning|note|report)\s*\(")
    token = re.compile(r'"((?:[^"\\\n]|\\.)*)"|\'(?:[^\'\\\n]|\\.)*\'|[()]')
    comment = re.compile(r'("(?:[^"\\\n]|\\.)*")|//[^\n]*|/\*.*?\*/', re.DOTALL)
    source = comment.sub(lambda m: m.group(1) or "\n" * m.group().count("\n"), source)
    seen = set()
    for call in calls.finditer(source):
        depth, before = 0, None
        for t in token.finditer(source, call.end() - 1):
            if t.group() == "(":
                depth += 1
            elif t.group() == ")":
                depth -= 1
                if depth == 0:
                    break
            elif t.group(1) is not None and t.start() not in seen:
                seen.add(t.start())
                text = t.group(1)
                if before and not source[before[1]:t.start()].strip():
                    text = before[2] + text
                    before = (before[0], t.end(), text)
                else:
                    if before:
                        yield before[0], before[2]
                    before = (source.count("\n", 0, t.start()) + 1, t.end(), text)
        if before:
            yield before[0], before[2]


def offenders_in(source):
    words = re.compile(r"\b(?:" + "|".join(OFFENDERS) + r")\b", re.IGNORECASE)
    return [(line, match.group()) for line, text in literals_of_messages(source)
            for match in words.finditer(text)]


def pages():
    yield "README.md"
    yield "docs/README.md"
    for folder, _, names in os.walk(os.path.join(ROOT, "docs", "user")):
        for name in sorted(names):
            if name.endswith(".md"):
                yield os.path.relpath(os.path.join(folder, name), ROOT).replace(os.sep, "/")
    for folder in ("plugin_author", "developer"):
        for name in sorted(os.listdir(os.path.join(ROOT, "docs", folder))):
            yield f"docs/{folder}/{name}"
    for name in ("architecture", "glossary", "performance", "security", "style", "decisions/README"):
        yield f"docs/{name}.md"


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as f:
        return f.read()


def faults_of(page):
    return [f"{page}:{line}: \"{phrase}\"; write: {instead}"
            for line, phrase, instead in retired_in(read(page).split("\n"))
            if (page, phrase.lower()) not in ALLOWED]


def faults_of_messages(folder):
    out = []
    for at, _, names in os.walk(os.path.join(ROOT, folder)):
        for name in sorted(names):
            if name.endswith((".cpp", ".h")):
                path = os.path.relpath(os.path.join(at, name), ROOT)
                out += [f"{path}:{line}: \"{phrase}\"" for line, phrase in offenders_in(read(path))]
    return out


def parameters_in(source):
    """Line and text of the literals in tables of providers' parameters (rmp_param)."""
    for table in re.finditer(r"\brmp_param\b[^;{]*[\[{].*?;\n", source, re.DOTALL):
        for text in re.finditer(r'"(?:[^"\\\n]|\\.)*"(?:\s*\\?\s*"(?:[^"\\\n]|\\.)*")*', table.group()):
            line = source.count("\n", 0, table.start() + text.start()) + 1
            yield line, re.sub(r'"\s*\\?\s*"', "", text.group())[1:-1]


def comments_in(source):
    """Line and text of the comments of C++; those of adjacent lines together."""
    token = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\'|(//[^\n]*|/\*.*?\*/)', re.DOTALL)
    before = None
    for t in token.finditer(source):
        if t.group(1) is None:
            continue
        text = re.sub(r"^[ \t]*(?:///?<?|/\*+|\*/|\*)|\*/$", "", t.group(1), flags=re.MULTILINE)
        if before and re.fullmatch(r"[ \t]*\n[ \t]*", source[before[1]:t.start()]):
            before = (before[0], t.end(), before[2] + "\n" + text)
        else:
            if before:
                yield before[0], before[2]
            before = (source.count("\n", 0, t.start()) + 1, t.end(), text)
    if before:
        yield before[0], before[2]


def faults_of_comments(path):
    return [f"{path}:{start + line - 1}: \"{phrase}\"; write: {instead}"
            for start, text in comments_in(read(path))
            for line, phrase, instead in retired_in([t.strip() for t in text.split("\n")])]


def files(folder, endings):
    for at, _, names in os.walk(os.path.join(ROOT, folder)):
        for name in sorted(names):
            if name.endswith(endings):
                yield os.path.relpath(os.path.join(at, name), ROOT).replace(os.sep, "/")


def faults_of_headers(folder):
    return [fault for path in sorted(files(folder, ".h")) for fault in faults_of_comments(path)]


def faults_of_parameters():
    return [f"{path}:{line}: \"{phrase}\"" for folder in ("plugins", "sdk", "viewer")
            for path in sorted(files(folder, (".cpp", ".h")))
            for line, text in parameters_in(read(path)) if " " in text
            for _, phrase, _ in retired_in([text])]


def faults_of_help():
    return [fault for name in sorted(os.listdir(os.path.join(ROOT, "docs", "ioci")))
            for fault in faults_of("docs/ioci/" + name)]


class TheTest(unittest.TestCase):
    """It finds what is wrong, and only that."""

    def found(self, text):
        return [phrase for _, phrase, _ in retired_in(text.split("\n"))]

    def test_finds_retired_words_in_prose(self):
        self.assertEqual(self.found("What it answers stands\nunder each block."), ["stands"])
        self.assertEqual(self.found("A message tells which, and the run goes\non."), ["tells", "goes on"])
        self.assertEqual(self.found("| `x` | it is not said |"), ["not said"])
        self.assertEqual(self.found("programs that come along"), ["come along"])

    def test_passes_code_links_and_titles(self):
        for text in ("```lua\nway = 1 -- stands\n```", "`stand_off` and `way`", "    way = 1",
                     "[decision](0078-searches-that-tell.md)", "a stand-off of 2 mm, half-way",
                     "`one\nway` two", "*A way to go* (1980)"):
            self.assertEqual(self.found(text), [], text)

    def test_finds_offenders_in_messages_only(self):
        code = 'return error(Code::x,\n  "it is not " "said where",\n  quoted(")") + " stands in a line");'
        self.assertEqual([word for _, word in offenders_in(code)], ["is not said", "stands in"])
        self.assertEqual(offenders_in('// error("it stands in a line")\nauto s = "it goes on";'), [])

    def test_finds_retired_words_in_comments_and_parameters(self):
        code = '/// It stands\n/// at a place that tells.\nint x;  ///< a way\nauto s = "// way";'
        found = [(line, phrase) for start, text in comments_in(code)
                 for line, phrase, _ in retired_in(text.split("\n"))]
        self.assertEqual([phrase for _, phrase in found], ["stands", "tells", "way"])
        table = 'const rmp_param kParams[] = {\n    {"to", "real", "", "The way "\n     "of it.", "1"}};\n'
        self.assertIn((2, "The way of it."), list(parameters_in(table)))


class Pages(unittest.TestCase):
    maxDiff = None

    def test_have_no_retired_words(self):
        for page in pages():
            found = faults_of(page)
            self.assertEqual(found, [], "\n".join(found))

    def test_of_allowed_words_use_them(self):
        for page, word in ALLOWED:
            self.assertRegex(read(page), re.compile(word, re.IGNORECASE), page)

    def test_lines_of_prose_have_at_most_100_characters(self):
        long = []
        for page in pages():
            if page in WITH_LONG_LINES:
                continue
            inside = False
            for number, line in enumerate(read(page).split("\n"), 1):
                inside ^= line.lstrip().startswith("```")
                # Tables, headings and pictures are one line each; a link cannot be broken.
                if inside or len(line) <= 100 or re.match(r"\s*[|#!]|    |<!--", line):
                    continue
                if max(map(len, line.split())) < 60 and line.count("`") < 2:
                    long.append(f"{page}:{number}: {len(line)}")
        self.assertEqual(long, [])

    def test_links_lead_to_headings_that_exist(self):
        def name(heading):
            heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.replace("`", ""))
            return re.sub(r"[^\w\- ]", "", heading.strip("# ").lower()).replace(" ", "-")

        headings, links = {}, []
        for folder, folders, names in os.walk(ROOT):
            folders[:] = [f for f in folders if f not in ("build", "out", ".git", "node_modules")]
            for each in names:
                if not each.endswith(".md"):
                    continue
                path = os.path.realpath(os.path.join(folder, each))
                headings[path] = set()
                inside = False
                with open(path, encoding="utf-8") as f:
                    for number, line in enumerate(f, 1):
                        inside ^= line.lstrip().startswith("```")
                        if inside:
                            continue
                        if line.startswith("#"):
                            headings[path].add(name(line))
                        for to, part in re.findall(r"\]\(([^)#\s]*)#([^)\s]*)\)", line):
                            if "://" not in to:
                                target = os.path.join(folder, to) if to else path
                                links.append((path, number, os.path.realpath(target), part))
        self.assertGreater(len(links), 80)
        self.assertEqual([f"{os.path.relpath(path, ROOT)}:{number}: #{part}"
                          for path, number, to, part in links
                          if to in headings and part not in headings[to]], [])


class Messages(unittest.TestCase):
    def test_have_no_offenders(self):
        for folder in FOLDERS_OF_MESSAGES:
            found = faults_of_messages(folder)
            self.assertEqual(found, [], "\n".join(found))

    def test_comments_of_headers_have_no_retired_words(self):
        for folder in FOLDERS_OF_HEADERS:
            found = faults_of_headers(folder)
            self.assertEqual(found, [], "\n".join(found))

    def test_parameters_of_providers_have_no_retired_words(self):
        self.assertGreater(len([text for path in files("plugins", ".cpp")
                                for _, text in parameters_in(read(path)) if " " in text]), 100)
        self.assertEqual(faults_of_parameters(), [])

    def test_the_help_of_commands_has_no_retired_words(self):
        found = faults_of_help()
        self.assertEqual(found, [], "\n".join(found))


if __name__ == "__main__":
    if "--list" in sys.argv:
        word = sys.argv[-1] if sys.argv[-1] != "--list" else ""
        for fault in ([f for page in pages() for f in faults_of(page)] + faults_of_help() +
                      [f for folder in FOLDERS_OF_MESSAGES for f in faults_of_messages(folder)] +
                      faults_of_parameters() +
                      [f for folder in FOLDERS_OF_HEADERS for f in faults_of_headers(folder)]):
            if f"\"{word}" in fault:
                print(fault)
    else:
        unittest.main(verbosity=2)
