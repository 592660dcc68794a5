# SPDX-License-Identifier: Apache-2.0
"""recording_check.py FOLDER: reads run.json and run.npz there as Python and NumPy do, and compares
them with expected.txt: a line a column, its name and its values' bits as hexadecimal numbers.
Without NumPy the archive is read by its format (zip, NEP 1) alone, which the last line tells."""

import ast
import json
import math
import pathlib
import struct
import sys
import zipfile

folder = pathlib.Path(sys.argv[1])
expected = {}
for line in (folder / "expected.txt").read_text().splitlines():
    name, *bits = line.split()
    expected[name] = [int(b, 16) for b in bits]


def bits_of(value):
    return struct.unpack("<Q", struct.pack("<d", value))[0]


def is_finite(bits):
    return math.isfinite(struct.unpack("<d", struct.pack("<Q", bits))[0])


def compare(what, name, found):
    if found != expected[name]:
        sys.exit(f"{what}: column {name} is {found}, not {expected[name]}")


def plain_array(file):
    """One .npy file: numbers, or texts of four bytes a letter."""
    assert file[:6] == b"\x93NUMPY"
    length = struct.unpack("<H", file[8:10])[0]
    header = ast.literal_eval(file[10 : 10 + length].decode("latin-1"))
    assert not header["fortran_order"] and len(header["shape"]) <= 1
    data = file[10 + length :]
    if header["descr"] == "<f8":
        return list(struct.unpack(f"<{header['shape'][0]}Q", data))
    width = 4 * int(header["descr"].removeprefix("<U"))
    count = header["shape"][0] if header["shape"] else 1
    return [
        data[i * width : (i + 1) * width].decode("utf-32-le").rstrip("\0") for i in range(count)
    ]


with open(folder / "run.json", encoding="utf-8") as file:
    read = json.load(file)
if [c["name"] for c in read["columns"]] != list(expected):
    sys.exit("JSON: other columns")
for column in read["columns"]:
    wanted = [b if is_finite(b) else None for b in expected[column["name"]]]
    found = [None if v is None else bits_of(v) for v in column["values"]]
    if found != wanted:
        sys.exit(f"JSON: column {column['name']} is {found}, not {wanted}")

with zipfile.ZipFile(folder / "run.npz") as archive:
    if archive.testzip():
        sys.exit("npz: a checksum is wrong")
    arrays = {n.removesuffix(".npy"): plain_array(archive.read(n)) for n in archive.namelist()}
for name in expected:
    compare("npz", name, arrays[name])
if arrays["columns"] != list(expected) or arrays["title"] != [read["title"]]:
    sys.exit("npz: other columns or title")
if arrays["units"] != [c["unit"] for c in read["columns"]]:
    sys.exit("npz: other units")

try:
    import numpy
except ImportError:
    print("without NumPy")
    sys.exit()
with numpy.load(folder / "run.npz", allow_pickle=False) as loaded:
    for name in expected:
        compare("NumPy", name, [int(b) for b in loaded[name].view(numpy.uint64)])
    if [str(n) for n in loaded["columns"]] != list(expected):
        sys.exit("NumPy: other columns")
    if str(loaded["title"]) != read["title"]:
        sys.exit("NumPy: another title")
print("with NumPy")
