"""What a tick costs in code for a generic processor, as the bundle has it, against code for the processor at hand.

Two processes, one for each, take batches of 1,000 ticks of the same scenes by turns, so that what else the machine does
strikes both alike; the forces of a motion are compared bit by bit. Run by itself:

    python tests/benchmarks/haptics/generic_cpu.py
"""

import json
import os
import statistics
import subprocess
import sys

BATCHES = 100
NAMES = ("rek2024", "physical_liquids", "physical2", "slime")
PROGRAM = """
import hashlib, json, sys
from study_app.evidence.cost import TickTimer
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.motion import programmed_motion
from study_app.haptics.runtime.offline import simulate
from study_app.protocol.load import load_scenes

benches, forces = {}, {}
for name in json.loads(sys.argv[1]):
    for title, scene in load_scenes(name).items():
        scene = resolve(scene)
        motion = simulate(scene, programmed_motion("stop", rate_hz=scene.rate_hz))
        key = f"{name}: {title}"
        force = b"".join(axis.tobytes() for axis in (motion.fx_n, motion.fy_n, motion.fz_n))
        forces[key] = hashlib.sha256(force).hexdigest()
        benches[key] = TickTimer(scene)
print(json.dumps(forces), flush=True)
for line in sys.stdin:
    benches[line.strip()].run_batch()
    print(benches[line.strip()].costs_ns[-1], flush=True)
"""


def start_process(cpu: str | None) -> subprocess.Popen[str]:
    """Start the process of a processor: "generic", or None for the one at hand."""
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CPU_NAME"}
    environment |= {"NUMBA_CPU_NAME": cpu} if cpu else {}
    command = [sys.executable, "-c", PROGRAM, json.dumps(NAMES)]
    return subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def line_of(program: subprocess.Popen[str]) -> str:
    """Return the next line that a process prints."""
    assert program.stdout is not None
    if not (line := program.stdout.readline()):
        sys.exit("a process ended")
    return line


def batch(program: subprocess.Popen[str], scene: str) -> float:
    """Return the cost of a tick in the next batch [ns]."""
    assert program.stdin is not None
    program.stdin.write(f"{scene}\n")
    program.stdin.flush()
    return float(line_of(program))


def main() -> None:
    """Measure and print."""
    programs = {"generic": start_process("generic"), "native": start_process(None)}
    forces = {cpu: json.loads(line_of(program)) for cpu, program in programs.items()}
    costs: dict[str, dict[str, list[float]]] = {cpu: {scene: [] for scene in forces[cpu]} for cpu in programs}
    for _ in range(BATCHES):
        for scene in forces["generic"]:
            for cpu, program in programs.items():
                costs[cpu][scene].append(batch(program, scene))
    for program in programs.values():
        program.communicate()
    print(f"{'scene':<40}{'generic':>12}{'native':>12}{'ratio':>8}   forces")
    ratios = []
    for scene in forces["generic"]:
        generic_ns, native_ns = (statistics.median(costs[cpu][scene]) for cpu in ("generic", "native"))
        ratios.append(generic_ns / native_ns)
        same = "equal" if forces["generic"][scene] == forces["native"][scene] else "differ"
        print(f"{scene:<40}{generic_ns:>9.0f} ns{native_ns:>9.0f} ns{ratios[-1]:>8.2f}   {same}")
    print(f"{'median':<64}{statistics.median(ratios):>8.2f}")


if __name__ == "__main__":
    main()
