"""What it takes to compute cases by other processes: two workers against two programs, time per case, 1,000 workers.

Run it by itself: ``python tests/benchmarks/workers/executors.py [ROUNDS]``; about two minutes on two free cores. With
the extra ``cluster`` it starts a Dask cluster of two worker processes here.
"""

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import psutil

from study_app.analysis.planning.simulated_studies import BATCH, Plan, count, plan
from study_app.protocol.load import load
from study_app.protocol.simulated_observer import TrialFeatures
from study_app.workers.cases import environment
from study_app.workers.executors import Workers, open_executor
from tests.workers.local_cluster import INSTALLED, local_cluster

ROUNDS = 20
CASES = 6
"""Of each of two workers in a round."""
EMPTY = 1000
VERDICT_S = 0.011
"""Processor time of a verdict on stability, measured over twenty cases."""
PROJECTED = (10_000, 100_000, 1_000_000)
WORKERS = (1, 2, 10, 100, 1000)
ROOT = Path(__file__).parents[3]


class Parts(NamedTuple):
    """Seconds per case: all of it, and of that the processor time of client, scheduler and workers."""

    wall_s: float
    client_s: float
    scheduler_s: float
    workers_s: float


def planned() -> Plan:
    """Return what power estimation computes with, without rehearsals."""
    protocol = load("rek2024")
    features = {
        (block.id, name): (TrialFeatures(0.3 + 0.6 * number, 4.0, 0.1, 0.01, 0.03, 0.006 + protocol.delay_s(name)),)
        for block in protocol.main_blocks
        for number, name in enumerate(block.conditions)
    }
    return plan(protocol, features)


def real_case(study: Plan) -> Callable[[int], object]:
    """Return a case of ``power``: a batch of simulated studies of twelve participants."""
    return partial(_count, study)


def _count(study: Plan, batch: int) -> object:
    return count(study, (12,), 1, batch, BATCH)


def empty_case(_study: Plan, number: int) -> int:
    """Return at once; the arguments are those of a real case."""
    return number


def program(workers: int) -> None:
    """For each line (first case, number of cases) on standard input, compute them and print a line."""
    case = real_case(planned())
    with open_executor(Workers(workers)) as executor:
        list(executor.map(case, range(1000, 1000 + 4 * workers)))  # every process has begun
        print("ready", flush=True)
        for line in sys.stdin:
            first, cases = map(int, line.split())
            list(executor.map(case, range(first, first + cases)))
            print("done", flush=True)


def began(workers: int) -> subprocess.Popen[str]:
    """Start a program that computes cases, and wait until its workers have begun."""
    words = [sys.executable, "-m", "tests.benchmarks.workers.executors", "--program", str(workers)]
    running = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert running.stdout is not None
    assert running.stdout.readline() == "ready\n"
    return running


def seconds(cases: int, *programs: subprocess.Popen[str]) -> float:
    """Have programs share cases, started together; return the seconds until the last one is done."""
    each = cases // len(programs)
    started = time.perf_counter()
    for number, one in enumerate(programs):
        assert one.stdin is not None
        one.stdin.write(f"{number * each} {each}\n")
        one.stdin.flush()
    for one in programs:
        assert one.stdout is not None
        assert one.stdout.readline() == "done\n"
    return time.perf_counter() - started


def used_s(*programs: subprocess.Popen[str]) -> float:
    """Return the processor time of programs and their workers."""
    parents = [psutil.Process(one.pid) for one in programs]
    return sum(sum(it.cpu_times()[:2]) for parent in parents for it in (parent, *parent.children(recursive=True)))


def two_workers(rounds: int) -> None:
    """Compare one program with two workers and two unrelated programs with one worker each, in turns."""
    one, two = (began(2),), (began(1), began(1))
    before = used_s(*one), used_s(*two)
    took = [(seconds(2 * CASES, *one), seconds(2 * CASES, *two)) for _ in range(rounds)]
    used = used_s(*one) - before[0], used_s(*two) - before[1]
    for running in (*one, *two):
        running.communicate()
    ratios = [apart_s / together_s for together_s, apart_s in took]
    print(
        f"  {rounds} rounds of {2 * CASES} cases; ratio of throughput in each: {min(ratios):.2f} to {max(ratios):.2f}"
    )
    sums = [sum(one) for one in zip(*took, strict=True)]
    print(f"  seconds: {sums[0]:.1f} and {sums[1]:.1f}; of processor time {used[0]:.1f} and {used[1]:.1f}")
    print(
        f"  two workers / two programs, throughput: {sums[1] / sums[0]:.3f} over all rounds, "
        f"{statistics.median(ratios):.3f} median (goal ≥ 0.9); by processor time {used[1] / used[0]:.3f}\n"
    )


def parts_of(executor: Executor, study: Plan, scheduler: psutil.Process | None = None) -> Parts:
    """Measure what an empty case takes."""
    list(executor.map(partial(empty_case, study), range(100)))
    own = psutil.Process()
    workers = [one for one in (scheduler or own).children(recursive=True) if "spawn_main" in " ".join(one.cmdline())]

    def used() -> tuple[float, float, float, float]:
        times = [sum(it.cpu_times()[:2]) for it in (own, *([scheduler] if scheduler else []))]
        of_workers = sum(sum(it.cpu_times()[:2]) for it in workers)
        return time.perf_counter(), times[0], times[1] if scheduler else 0.0, of_workers

    before = used()
    assert list(executor.map(partial(empty_case, study), range(EMPTY))) == list(range(EMPTY))
    return Parts(*((after - earlier) / EMPTY for after, earlier in zip(used(), before, strict=True)))


def print_parts(name: str, parts: Parts) -> None:
    """Print one line of the table of times per case."""
    print(f"  {name:34}" + "".join(f"{1e3 * part:10.3f}" for part in parts))


def begin_s(executor: Executor, study: Plan) -> float:
    """Return the seconds from the first case to its result, where no process has begun."""
    started = time.perf_counter()
    executor.submit(_count, study, 0).result()
    return time.perf_counter() - started


def case_s(study: Plan) -> float:
    """Return the processor time of one case here [s]."""
    _count(study, 0)
    started = time.process_time()
    for batch in range(1, 5):
        _count(study, batch)
    return (time.process_time() - started) / 4


def project(name: str, parts: Parts, case_s: float, begin_s: float) -> None:
    """Print how long many cases would take with up to 1,000 workers, from the measured parts.

    Cases come from one client through one scheduler, each at most as fast as its processor time per case allows.
    """
    serial_s = max(parts.client_s, parts.scheduler_s)
    busy = f"client and scheduler busy with {(case_s + parts.workers_s) / serial_s:.0f} workers"
    print(f"  {name}: {1e3 * case_s:.0f} ms per case, {1e3 * serial_s:.2f} ms of one processor for each, {busy};")
    print(f"  1,000 workers stay busy with cases of {1000 * serial_s:.1f} s and more")
    print(f"    {'cases':>10}" + "".join(f"{f'{workers} workers':>22}" for workers in WORKERS))
    for cases in PROJECTED:
        cells = []
        for workers in WORKERS:
            took_s = begin_s + max(cases * (case_s + parts.workers_s) / workers, cases * serial_s) + case_s
            cells.append(f"{took_s:12.0f} s ({cases * case_s / workers / took_s:4.0%})")
        print(f"    {cases:10}" + "".join(f"{cell:>22}" for cell in cells))


def main() -> None:
    """Print the tables."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS
    study = planned()
    taken_s = case_s(study)
    print(", ".join(f"{name} {version}" for name, version in environment().items()))
    print(f"a case: {BATCH} studies of twelve participants, {1e3 * taken_s:.0f} ms of processor time\n")
    print("Two workers of one program, and two unrelated programs with one worker each, started together")
    two_workers(rounds)
    print(f"Time per case [ms], {EMPTY} empty cases with the arguments of real ones (goal ≤ 5)")
    print(f"  {'':34}" + "".join(f"{name:>10}" for name in ("wall", "client", "scheduler", "workers")))
    for workers in (1, 2):
        with open_executor(Workers(workers)) as executor:
            began_s = begin_s(executor, study)
            here = parts_of(executor, study)
            print_parts(f"{workers} worker process{'es' if workers > 1 else ''}", here)
    print(f"  first case of a new process after {began_s:.1f} s")
    if not INSTALLED:
        print("\nno projection: the extra cluster (distributed) is not installed")
        return
    with local_cluster() as (address, scheduler), open_executor(Workers(cluster=address)) as executor:
        began_s = begin_s(executor, study)
        there = parts_of(executor, study, scheduler)
        print_parts("Dask, 2 workers on this computer", there)
    print(f"  first case of a new worker after {began_s:.1f} s")
    print("\nProjection from these parts: seconds, and the share of them in which every worker computes")
    project("power", there, taken_s, began_s)
    project("a case as short as a verdict on stability", there, VERDICT_S, began_s)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--program"]:
        program(int(sys.argv[2]))
    else:
        main()
