# SPDX-License-Identifier: Apache-2.0
"""What the suite runs: run.py FOLDER NAME FUNCTION, a sample a line in, its answer a line out."""
import importlib
import sys


def flat(x):
    if isinstance(x, (list, tuple)):
        for y in x:
            yield from flat(y)
    else:
        yield float(x)


sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[1])
module = importlib.import_module(sys.argv[2])
function, n = getattr(module, sys.argv[3]), len(module.JOINTS)
for line in sys.stdin:
    numbers = [float(word) for word in line.split()]
    answer = function(*[numbers[k:k + n] for k in range(0, len(numbers), n)])
    print(*map(repr, flat(answer)))
