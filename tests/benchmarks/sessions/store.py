"""How long an answer takes to the disk, and a check of a whole study.

``python tests/benchmarks/sessions/store.py [FOLDER on the disk to measure]``
"""

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from study_app.haptics.model.layout import LIMITER_NAMES, SAMPLE
from study_app.protocol.load import load, source_bytes
from study_app.protocol.orders.schedule import build_schedule
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.rebuild import rebuild
from study_app.store.verification.verify_study import verify

LIMIT_MS = 5.0
LIMIT_VERIFY_S = 20.0
SESSIONS = 100
RECORDED = 10


def measure(action: Callable[[int], None], times: int) -> np.ndarray:
    """Return the duration of each call [ms], shape (times,)."""
    durations = np.empty(times)
    for number in range(times):
        start = time.perf_counter_ns()
        action(number)
        durations[number] = (time.perf_counter_ns() - start) / 1e6
    return durations


def answer_all(store: SessionStore, seed: int) -> int:
    """Journal a whole session of rek2024; return its number of responses."""
    summary = {f"limiter_{name}": 12 for name in LIMITER_NAMES} | {"ticks": 60_000, "force_mean_n": 1.2345678}
    count = 0
    for trial in build_schedule(load("rek2024"), "P001", seed).trials:
        which = {"trial": trial.number, "attempt": 1}
        told = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
        store.append("trial_started", **which, **told)
        for target in range(10):
            store.append("target_reached", trial=trial.number, target=target, t_task_s=target / 3)
        store.append("trial_ended", **which, outcome="complete", **summary)
        items = []
        for number, item in enumerate(trial.items, start=1):
            times = {"onset_s": 1.234567, "first_s": 2.345678, "last_s": 2.345678}
            store.append("item_shown", t_s=times["onset_s"], trial=trial.number, item=item)
            store.append("choice", t_s=times["first_s"], trial=trial.number, item=item, value=4)
            items.append({"item": item, "number": number, "value": 4, **times, "changes": 0})
        store.append("responses", **which, items=items)
        count += len(items)
    return count


def main() -> None:
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else None) as folder:
        given = {"seed": 1, "operator": "", "language": "en", "screens": {}, "simulated": False}
        protocol, source = load("rek2024"), source_bytes("rek2024")
        stores: list[SessionStore] = []
        begun = measure(
            lambda n: stores.append(
                begin(Path(folder), protocol, source, SessionStart(f"P{n:03d}", device={"name": "mouse"}, **given))  # type: ignore[arg-type]
            ),
            20,
        )
        store = stores[0]
        responses = answer_all(store, 1)
        store.write_tables()
        print(f"session of {responses} responses; {folder}")
        print(f"{'':34}{'p50':>9}{'p99':>9}{'worst':>9}   [ms]")

        def answer(number: int) -> None:
            store.append("choice", trial=12, item="different", value=1 + number % 7)

        def tables(number: int) -> None:
            store.append("note", kind="note", text=str(number % 7))
            store.write_tables()

        rows = {
            f"append, to the disk (limit {LIMIT_MS:g})": measure(answer, 2000),
            "append and both tables renewed": measure(tables, 200),
            "begin": begun,
            "finish": measure(lambda n: stores[n].finish("completed"), 20),
        }
        for name, durations in rows.items():
            p50, p99 = np.percentile(durations, [50, 99])
            print(f"{name:34}{p50:9.2f}{p99:9.2f}{durations.max():9.2f}")
    print()
    check_studies(sys.argv[1] if len(sys.argv) > 1 else None)


def check_studies(disk: str | None) -> None:
    """Print how long `verify` and `rebuild` take."""
    with tempfile.TemporaryDirectory(dir=disk) as folder:
        for recorded, count in ((False, SESSIONS), (True, RECORDED)):
            study = Path(folder) / f"recorded-{recorded}"
            for number in range(count):
                store = whole_session(study, f"P{number:03d}", recordings=recorded)
            size = sum(path.stat().st_size for path in study.rglob("*") if path.is_file()) / 1e6
            start = time.perf_counter()
            findings = verify(study)
            took = time.perf_counter() - start
            kind = "sessions with recordings" if recorded else "sessions"
            print(f"verify of {count} {kind} ({size:.1f} MB): {took:.2f} s, sound: {findings.sound}", end="")
            print("" if recorded else f" (limit {LIMIT_VERIFY_S:g} s)")
            store.folder.table("rek2024", "trials").unlink()
            start = time.perf_counter()
            rebuild(store.folder.path)
            print(f"rebuild of one of them: {(time.perf_counter() - start) * 1e3:.1f} ms")


def whole_session(study: Path, participant: str, *, recordings: bool) -> SessionStore:
    """Run a session of rek2024 to its end, with a recording of 35 s a trial if it is to have any."""
    given = {"seed": 1, "operator": "", "language": "en", "device": {"name": "mouse"}, "screens": {}, "simulated": True}
    protocol, source = load("rek2024"), source_bytes("rek2024")
    store = begin(study, protocol, source, SessionStart(participant, recordings=recordings, **given))  # type: ignore[arg-type]
    answer_all(store, 1)
    if store.recorder is not None:
        samples = np.zeros(35_000, SAMPLE)
        generator = np.random.default_rng(1)
        samples["tick"] = np.arange(35_000)
        samples["position_m"] = np.sin(samples["tick"] / 300)[:, None] * generator.uniform(0.01, 0.05, 3)
        samples["velocity_mps"] = generator.normal(0, 0.1, (35_000, 3))
        for trial in range(1, 13):
            store.recorder.start(trial, 1, 1000.0)
            store.recorder.append(samples)
            store.recorder.stop()
    store.write_tables()
    store.finish("completed")
    return store


if __name__ == "__main__":
    main()
