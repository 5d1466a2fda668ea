"""Choose which tests the quick and the full circle run, by what they cover in how much time; the others run less often.

Record the contexts and times of the quick and of the slow tests (``NUMBA_DISABLE_JIT=1`` covers compiled code)::

    COVERAGE_FILE=FOLDER/quick.coverage python -m pytest -n 2 --dist loadfile --by-marks \
        -m "not slow and not nightly" --cov --cov-context=test --cov-report= --junitxml=FOLDER/quick.xml
    COVERAGE_FILE=FOLDER/slow.coverage python -m pytest -n 2 --dist loadfile --by-marks \
        -m "slow and not nightly" --cov --cov-context=test --cov-report= --junitxml=FOLDER/slow.xml

Then ``python tests/benchmarks/project/circles.py FOLDER [--quick 54] [--full 640]`` writes `tests/circles.txt`. A
budget is processor time of the tests of a circle [s], without the start of the workers. A circle gets the tests that
cover most lines of the program per second which no test before covers, and then the shortest ones. The full circle runs
all tests of safety, of blinding and of the project.
"""

import argparse
import heapq
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from coverage import CoverageData
from faults import CIRCLES, ROOT, durations

LIST = ROOT / "tests" / "circles.txt"
SAFETY = re.compile(
    r"tests/(faults|end_to_end|project|session/sealed|haptics/runtime|devices/test_c|store/test_released)"
    r"|zero_force|stops_the_force|force_stop|lost_device|killed|sealed|blind|hidden"
)
SHORTEST_S = 0.003
"""A test takes at least this long: its fixtures are set up."""

SHORT_SHARE = 0.5
"""Share of the budget that goes to the shortest tests first: they check values of what others only run."""
LEAST_PER_S = 10.0
"""A test that adds fewer lines per second is chosen as a short one, if at all."""

Covered = Mapping[str, frozenset[int]]


def covered(folder: Path, circle: str) -> dict[str, frozenset[int]]:
    """Return the lines of the program that each test runs, as hashes."""
    data = CoverageData(str(folder / f"{circle}.coverage"))
    data.read()
    covered_lines: dict[str, set[int]] = {}
    for path in data.measured_files():
        for line, names in data.contexts_by_lineno(path).items():
            for name in names:
                if name:
                    covered_lines.setdefault(name.split("|")[0], set()).add(hash((path, line)))
    return {test: frozenset(lines) for test, lines in covered_lines.items()}


def collected() -> set[str]:
    """Return the names of all tests as they are now."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q"]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return {line for line in process.splitlines() if "::" in line}


def chosen_tests(tests: Covered, times_s: Mapping[str, float], known: set[int], budget_s: float) -> set[str]:
    """Return the tests of a circle: greedily those that add most lines to ``known`` per second, then the shortest."""
    cost = {test: max(took_s, SHORTEST_S) for test, took_s in times_s.items()}
    queue = [(-len(lines) / cost[test], test) for test, lines in tests.items()]
    heapq.heapify(queue)
    kept, spent_s = set[str](), 0.0

    def keep(test: str) -> bool:
        nonlocal spent_s
        if test in kept or spent_s + cost[test] > budget_s:
            return False
        kept.add(test)
        spent_s += cost[test]
        return True

    by_cost = sorted(cost, key=cost.__getitem__)
    for test in by_cost:
        if spent_s < budget_s * SHORT_SHARE:
            keep(test)
            known |= tests.get(test, frozenset())
    while queue:
        gain, test = heapq.heappop(queue)
        rate = -len(tests[test] - known) / cost[test]
        if rate > gain:
            heapq.heappush(queue, (rate, test))
        elif rate < -LEAST_PER_S and keep(test):
            known |= tests[test]
    for test in by_cost:
        keep(test)
    return kept


def short(moved: set[str], stays: set[str]) -> list[str]:
    """Return the names of tests; name a module or function as a whole if all its tests are listed."""
    left, names = set(moved), list[str]()
    for parts in (lambda test: test.partition("::")[0], lambda test: test.partition("[")[0], str):
        partly = {parts(test) for test in stays}
        whole = {parts(test) for test in left} - partly
        names += whole
        left = {test for test in left if parts(test) not in whole}
    return sorted(names)


def main() -> None:
    """Write the list."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--quick", type=float, default=54.0)
    parser.add_argument("--full", type=float, default=640.0)
    options = parser.parse_args()
    present = collected()
    times = {
        circle: {test: took_s for test, took_s in durations(options.folder, circle).items() if test in present}
        for circle in CIRCLES
    }
    lines_of = {circle: covered(options.folder, circle) for circle in CIRCLES}
    lines_of["quick"] = {test: lines for test, lines in lines_of["quick"].items() if test in times["quick"]}
    quick = chosen_tests(lines_of["quick"], times["quick"], set(), options.quick)
    known = set[int]().union(*(lines_of["quick"].get(test, frozenset()) for test in quick))
    times_s = {test: took_s for circle in CIRCLES for test, took_s in times[circle].items() if test not in quick}
    rest = {test: lines for circle in CIRCLES for test, lines in lines_of[circle].items() if test in times_s}
    safe = {test for test in times_s if SAFETY.search(test)}
    spent_s = sum(times_s[test] for test in safe)
    known = known.union(*(rest.get(test, frozenset()) for test in safe))
    others = {test: took_s for test, took_s in times_s.items() if test not in safe}
    slow = safe | chosen_tests(
        {test: rest[test] for test in others if test in rest}, others, known, options.full - spent_s
    )
    nightly, every = set(times_s) - slow, times["quick"] | times["slow"]
    lines = [f"slow {name}" for name in short(slow & set(times["quick"]), quick)]
    lines += [f"nightly {name}" for name in short(nightly, quick | slow)]
    LIST.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    for circle, tests in (("quick", quick), ("slow", slow), ("nightly", nightly)):
        print(f"{circle:8}{len(tests):6} tests {sum(every[test] for test in tests):6.0f} s")


if __name__ == "__main__":
    main()
