"""Time from the first start of an installation to its first force, with an empty cache of compiled code.

    python tests/benchmarks/windows/first_force.py PYTHON_OR_BUNDLE... [--runs 3]

The program opens the emulated Falcon with physical2's honey, and the simulated hand moves until the force is not zero.
Prints the least time in all and of a core [s], and how many functions were compiled.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FIRST_FORCE = """
import time
from study_app.haptics.kernels.compiled import following_compilation
from study_app import api
with following_compilation(lambda _share: None) as counter:
    with api.open_force("physical2", device="falcon-emulated") as loop:
        loop.set_liquid("honey")
        while not loop.read().device_force_n.any():
            time.sleep(0.002)
print("compiled", counter.compiled, "functions in", round(time.process_time(), 1), "s of a core")
"""


def first_force(program: str) -> tuple[float, float, int]:
    """Return the time in all and of a core [s], and the number of compiled functions, of a start with empty caches."""
    with tempfile.TemporaryDirectory() as folder:
        names = ("NUMBA_CACHE_DIR", "LIQUID_STUDY_CONFIG", "LIQUID_STUDY_WORKSPACE")
        environment = os.environ | dict.fromkeys(names, folder)
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        process = subprocess.run(
            [program, "-c", FIRST_FORCE], env=environment, cwd=folder, check=True, stdout=subprocess.PIPE, text=True
        )
        took_s = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    core_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return took_s, core_s, int(process.stdout.split()[1])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+", help="a Python with the program installed, or the bundle's program")
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    for program in options.programs:
        runs = [first_force(str(Path(program).absolute())) for _ in range(options.runs)]
        took_s, core_s, compiled = (min(values) for values in zip(*runs, strict=True))
        sys.stdout.write(f"{took_s:.1f} s, {core_s:.1f} s of a core, {compiled} functions compiled: {program}\n")


if __name__ == "__main__":
    main()
