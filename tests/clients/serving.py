# SPDX-License-Identifier: Apache-2.0
"""The program under test, and `robomosp serve` while a test needs it."""
import os
import subprocess

PROGRAM = os.environ.get("ROBOMOSP_PROGRAM", "robomosp")


def listening(command, **options):
    """A server as a process that listens, and its address."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    line = process.stdout.readline()
    if not line.startswith("Listening"):
        raise RuntimeError(line + process.stdout.read())
    return process, line.split()[2].rstrip(",")


def end(process):
    if process.poll() is None:
        process.terminate()
        process.wait(20)
    process.stdout.close()


class Serving:
    """`robomosp serve` with options."""

    def __init__(self, *options, effects="reads,edits,simulates,files_read"):
        self.process, self.address = listening([PROGRAM, "serve", "--allow", effects, *options])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        end(self.process)
