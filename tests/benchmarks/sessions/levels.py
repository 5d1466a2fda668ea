"""What a session of 500 trials of levels costs: lines of its journal, tables, the next level, memory.

Run it by itself: ``python tests/benchmarks/sessions/levels.py [TRIALS]``. The session is rehearsed with its servo, and
QUEST+ chooses its levels. Times are by the clock, in brackets those of this thread on the processor.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from study_app.protocol.load import parse
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.trials.kinds import default_design
from study_app.protocol.trials.psychometric import LAPSES, assumed_for, running_grid
from study_app.psychophysics.questplus import Search
from study_app.session.resume import REHEARSED_SCREENS
from study_app.session.simulated.rehearsed_session import RehearsedSession, rehearsal_rig
from study_app.session.transitions import state
from study_app.store.clock import SessionClock
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.sessions.open_session import SessionStore
from tests.protocol.trials.level_studies import text_of_damper

TRIALS = 500
BLOCK = """
[methods.quest]
kind = "questplus"
trials = {trials}

[blocks.thicker]
stimulus = "damping"
design = "2ifc"
method = "quest"
"""
LIMITS_MS = {"a line of the journal": 5.0, "all tables": 60.0, "the next level": 2.0}
MEMORY_MB = 30.0


def timed(where: Any, name: str, taken: list[tuple[float, float]]) -> None:
    """Keep how long every call of a function takes, by the clock and on the processor [ms]."""
    function: Callable[..., Any] = getattr(where, name)

    @wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        began = time.perf_counter(), time.thread_time()
        try:
            return function(*given, **named)
        finally:
            taken.append((1e3 * (time.perf_counter() - began[0]), 1e3 * (time.thread_time() - began[1])))

    setattr(where, name, call)


def main(trials: int = TRIALS) -> None:
    """Rehearse the session and print a row for each part."""
    study = parse(text_of_damper("long", BLOCK.format(trials=trials)).encode(), "long.toml")
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in LIMITS_MS}
    for (where, name), held in zip(
        ((SessionStore, "append"), (SessionStore, "write_tables"), (state, "next_level")), taken.values(), strict=True
    ):
        timed(where, name, held)
    process, memory_mb = psutil.Process(), []
    with tempfile.TemporaryDirectory() as folder, rehearsal_rig(study, "P001", 1, "scripted") as machine:
        given = SessionStart(
            "P001",
            seed=1,
            operator="",
            language="en",
            device=machine.described,
            screens=REHEARSED_SCREENS,
            simulated=True,
        )
        kept = begin(Path(folder) / "long", study, b"", given, clock=SessionClock(machine.servo.now_ns))
        with kept as store:
            felt = lambda _trial, _felt: memory_mb.append(process.memory_info().rss / 1e6)  # noqa: E731
            RehearsedSession(study, build_schedule(study, "P001", 1), machine, store, felt=felt).run()
    print(f"{len(memory_mb) // 2} trials{'':22}{'p50':>16}{'p99':>16}{'worst':>16}   [ms, on the processor]")
    for name, held in taken.items():
        quantiles = np.quantile(held, (0.5, 0.99, 1.0), axis=0)
        cells = (f"{clock:.2f} ({cpu:.2f})" for clock, cpu in quantiles)
        print(f"{f'{name} (limit {LIMITS_MS[name]:g})':34}", *(f"{cell:>15}" for cell in cells))
    (stimulus, design), began = (study.stimuli["damping"], default_design("2ifc")), time.thread_time()
    levels = tuple(stimulus.coordinate(level) for level in stimulus.spaced(stimulus.steps))
    search = Search(running_grid(stimulus, design, assumed_for(stimulus, design), LAPSES), levels)
    size = search.psi.nbytes + sum(one.nbytes for one in search.logarithms)
    print(
        f"tables of the method: {1e3 * (time.thread_time() - began):.1f} ms (limit 20), {size / 1e6:.2f} MB (limit 1)"
    )
    tenth = len(memory_mb) // 10
    print(f"memory after the first tenth: {memory_mb[-1] - memory_mb[tenth]:+.1f} MB (limit {MEMORY_MB:g})")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
