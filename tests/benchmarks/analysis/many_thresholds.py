"""What the analysis of levels takes: 100 participants of 500 trials in four tracks, seconds of the processor.

Run it by itself: ``python tests/benchmarks/analysis/many_thresholds.py [PARTICIPANTS] [FOLDER]``. Without an unblinded
results folder, participants answer first, which takes minutes and is not measured. At most 10 s and 1 GB.
"""

import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from study_app.analysis.designs.level_summaries import levels_found
from study_app.analysis.tables.study_tables import load_study
from study_app.analysis.tables.tracks import tracks
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.unblinding import unblind
from tests.protocol.trials.level_studies import text_of_damper

BLOCK = """
[methods.quest]
kind = "questplus"
trials = 125

[blocks.thicker]
stimulus = "damping"
design = "2ifc"
method = "quest"
"""
MOST_S = 10.0
MOST_GB = 1.0
T = TypeVar("T")


def timed(what: str, make: Callable[[], T]) -> tuple[T, float]:
    """Return what ``make`` returns and the processor's seconds; print them with those of the clock."""
    began, at = time.process_time(), time.perf_counter()
    found = make()
    took_s = time.process_time() - began
    print(f"{what:<24} {took_s:11.1f} {time.perf_counter() - at:8.1f}", flush=True)
    return found, took_s


def main(participants: str = "100", folder: str = "") -> int:
    """Print a row for each part; return the exit code."""
    with tempfile.TemporaryDirectory() as scratch:
        results = Path(folder) if folder else Path(scratch) / "results"
        if not folder:
            protocol = Path(scratch) / "many.toml"
            protocol.write_text(text_of_damper("many", BLOCK, (4, 6, 8, 10)))
            rehearse_answers(protocol, participants=int(participants), seed=1, results=results, felt={})
            unblind(results, "AB", "a benchmark")
        print("part                     processor s   wall s")
        study, read_s = timed("reading tables", lambda: load_study(results))
        rows, tracks_s = timed("tracks", lambda: tracks(study))
        found, levels_s = timed("thresholds and the rest", lambda: levels_found(study, rows))
    total_s = read_s + tracks_s + levels_s
    print(f"{study.n} participants, {len(rows)} trials, {sum(len(one.own_thresholds) for one in found)} thresholds: ")
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    print(f"{total_s:.1f} s of the processor (at most {MOST_S:g} for 100 participants)")
    print(f"{peak_gb:.2f} GB of memory at most (at most {MOST_GB:g})")
    return 0 if total_s <= MOST_S and peak_gb <= MOST_GB else 3


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
