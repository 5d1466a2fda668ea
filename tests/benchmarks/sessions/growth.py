"""Time and memory of the commands on studies of more and more simulated sessions, with groups and exclusions.

Run as ``python -m tests.benchmarks.sessions.growth [--sizes 30,300]``. Each command runs in a fork of a process that
has loaded everything. Prints processor time [s] and peak memory [MB] for each size, and the exponent of time between
the two largest; ends with exit code 1 if one is above 1.1 where the command takes more than a second.
"""

import argparse
import json
import math
import os
import resource
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.export_study import export
from study_app.analysis.report.write_report import report
from study_app.protocol.simulated import NO_FEATURES
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import Exclusion, exclude, exclusion_bytes, include
from study_app.store.files.folders import StudyFolder
from study_app.store.sites.merge import merge_sites
from study_app.store.tables.study_files import participants_of
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import withdraw
from tests.protocol.groups.grouped import GROUPS, STUDY, grouped

MOST_EXPONENT: Final = 1.1
JUDGED_S: Final = 1.0
"""Shorter commands are not judged: their time is that of a start."""
WHO: Final = {"by": "AB", "reason": "a benchmark"}


class Cost(NamedTuple):
    """Processor time [s] and peak memory [MB] of a command."""

    time_s: float
    memory_mb: float


def rehearse(folder: Path, people: int, seed: int = 1) -> None:
    """Answer the study as so many participants do."""
    study = folder.parent / "grouped.toml"
    study.write_text(STUDY + GROUPS, encoding="utf-8", newline="\n")
    protocol = grouped()
    features = {(block.id, name): (NO_FEATURES,) for block in protocol.blocks.values() for name in block.conditions}
    rehearse_answers(str(study), participants=people, seed=seed, results=folder, features=features)


def exclude_a_tenth(folder: Path, people: int) -> None:
    rows = tuple(
        Exclusion(
            participant=f"P{number:03d}",
            session=1,
            trial=None,
            rule_or_person="AB",
            reason="a benchmark",
            excluded_at="2026-03-02T09:30:00.000+01:00",
            key_open=False,
        )
        for number in range(10, people + 1, 10)
    )
    StudyFolder(folder).exclusions.write_bytes(exclusion_bytes(rows))


def cost_of(command: Callable[[], object]) -> Cost:
    """Run a command in a fork; return its time and memory."""
    reads, writes = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            began_s = time.process_time()
            command()
            held = time.process_time() - began_s, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            os.write(writes, json.dumps(held).encode())
        except Exception:  # noqa: BLE001 - the fork must not go on as its parent
            traceback.print_exc()
        finally:
            os._exit(0)
    os.close(writes)
    with os.fdopen(reads, "rb") as pipe:
        content = pipe.read()
    os.waitpid(child, 0)
    return Cost(*json.loads(content))


def costs(root: Path, people: int) -> dict[str, Cost]:
    """Return the cost of each command on a study of so many participants."""
    root.mkdir()
    study, second, pooled = root / "study", root / "second", root / "pooled"
    measured = {"rehearse --answers-only": cost_of(lambda: rehearse(study, people))}
    exclude_a_tenth(study, people)
    rehearse(second, people, seed=2)
    commands: dict[str, Callable[[], object]] = {
        "sessions": lambda: participants_of(study),
        "read the study": lambda: load_study(study),
        "verify": lambda: verify_study(study),
        "exclude": lambda: exclude(study, "P001", 1, **WHO),
        "include": lambda: include(study, "P001", 1, **WHO),
        "export --wide --parquet": lambda: export(study, root / "tables", extras=("wide", "parquet")),
        "report": lambda: report(study, root / "report"),
        "merge of two": lambda: merge_sites({"A": study, "B": second}, pooled),
        "verify, merged": lambda: verify_study(pooled),
        "unblind": lambda: unblind(study, **WHO),
        "report, unblinded": lambda: report(study, root / "opened"),
        "withdraw": lambda: withdraw(study, "P002", **WHO),
    }
    return measured | {name: cost_of(command) for name, command in commands.items()}


def main() -> None:
    """Print the costs and the exponents."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="30,300")
    sizes = [int(size) for size in parser.parse_args().sizes.split(",")]
    with tempfile.TemporaryDirectory() as kept:
        os.environ["LIQUID_STUDY_DATA"] = str(Path(kept, "data"))
        costs(Path(kept, "warm"), 3)
        table = [costs(Path(kept, str(size)), size) for size in sizes]
    failed = False
    for name, last in table[-1].items():
        columns = "  ".join(f"{row[name].time_s:8.2f} s {row[name].memory_mb:5.0f} MB" for row in table)
        grown = math.log(last.time_s / table[-2][name].time_s) / math.log(sizes[-1] / sizes[-2])
        failed |= grown > MOST_EXPONENT and last.time_s > JUDGED_S
        sys.stdout.write(f"{name:26}{columns}  exponent {grown:.2f}\n")
    raise SystemExit(failed)


if __name__ == "__main__":
    main()
