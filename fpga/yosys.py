#!/usr/bin/env python3
"""Yosys of PyPI's pyosys as a command: yosys -q -l LOG SCRIPT. Stands by itself."""

import subprocess
import sys

RUN = "import sys; from pyosys import libyosys; [libyosys.run_pass(x) for x in sys.argv[1:]]"

OLDER_MAPPING = "scratchpad -set abc9.xaiger 1"
"""Yosys 0.70 hands logic to ABC in a new way, better by far in timing, but an assertion of its own
fails for some designs. Those go the way of before (YosysHQ/yosys#6174)."""


def main() -> int:
    *_, log, script = sys.argv[1:]
    done = run(f"tee -o {log} script {script}")
    if "ERROR: Assert" in done.stdout:
        done = run(OLDER_MAPPING, f"tee -o {log} script {script}")
    print(done.stdout, end="")
    return done.returncode


def run(*commands: str) -> subprocess.CompletedProcess:
    """Yosys by itself, since an error in it ends the process."""
    command = [sys.executable, "-c", RUN, *commands]
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


if __name__ == "__main__":
    sys.exit(main())
