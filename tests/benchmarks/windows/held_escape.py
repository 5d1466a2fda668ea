"""Count how often held Esc stops the force on a real X server: python -m tests.benchmarks.windows.held_escape [N].

In a session and in the lab, each with the emulated Falcon, N attempts (20) per delay of the keyboard's repeats.
"""

import sys
import tempfile
from pathlib import Path

from tests.end_to_end.held_escape import DELAYS_MS, LabBench, SessionBench, count_stops, opened_bench


def main() -> None:
    attempts = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    print("| where | key repeat | force stopped |\n| --- | --- | --- |")
    for name, bench in (("session", SessionBench), ("lab", LabBench)):
        for delay_ms in DELAYS_MS:
            with tempfile.TemporaryDirectory() as folder, opened_bench(bench, Path(folder)) as escape_bench:
                stops = count_stops(escape_bench, delay_ms, attempts)
            repeat = "off" if delay_ms is None else f"{delay_ms} ms"
            print(f"| {name} | {repeat} | {stops} of {attempts} |", flush=True)


if __name__ == "__main__":
    main()
