"""What answers-only rehearsals, the export and the report of many participants take: time and memory of each command.

Run it by itself, not on Windows: ``python tests/benchmarks/analysis/analysis.py [PARTICIPANTS] [PROTOCOL] [COMMAND
…]``. Every command is a process of its own, so that its seconds hold the start of the interpreter and its memory is its
own peak. On a busy machine believe the seconds of the processor.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

COMMANDS = ("export", "verify", "report")


def measured(*words: str) -> tuple[float, float, float]:
    """Run a command and return wall seconds, the processor's, and the peak of its memory [MB]."""
    began = time.perf_counter()
    with Path(os.devnull).open("wb") as nowhere:
        process = os.posix_spawn(
            sys.executable,
            [sys.executable, "-m", "study_app", *words],
            os.environ,
            file_actions=[(os.POSIX_SPAWN_DUP2, nowhere.fileno(), 1)],
        )
        _, status, usage = os.wait4(process, 0)
    if os.waitstatus_to_exitcode(status):
        raise SystemExit(f"{' '.join(words)}: exit code {os.waitstatus_to_exitcode(status)}")
    return time.perf_counter() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main(participants: str = "1000", protocol: str = "rek2024", *commands: str) -> None:
    """Answer into a folder that is thrown away, unblind it, and print a row a command."""
    with tempfile.TemporaryDirectory() as scratch:
        results, to = str(Path(scratch) / "results"), str(Path(scratch) / "to")
        asked = ("--participants", participants, "--answers-only", "--results", results)
        rows = {
            "rehearse --answers-only": ("rehearse", protocol, *asked),
            "unblind": ("unblind", results, "--by", "AB", "--reason", "a benchmark"),
            **{name: (name, results, *(() if name == "verify" else ("--to", to))) for name in commands or COMMANDS},
        }
        print(f"{protocol}, {participants} simulated participants")
        print("command                    wall s   processor s   peak MB")
        for name, words in rows.items():
            wall_s, processor_s, peak_mb = measured(*words)
            print(f"{name:<24} {wall_s:8.1f} {processor_s:13.1f} {peak_mb:9.0f}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
