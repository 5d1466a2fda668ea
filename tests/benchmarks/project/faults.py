"""How many faults the tests notice: one fault in each of some functions drawn at random, and the tests that cover it.

Once, hours before: the contexts of the quick and of the slow tests (``NUMBA_DISABLE_JIT=1`` covers compiled code)::

    COVERAGE_FILE=FOLDER/quick.coverage python -m pytest -n 2 --dist loadfile --by-marks \
        -m "not slow and not nightly" --cov --cov-context=test --cov-report= --junitxml=FOLDER/quick.xml
    COVERAGE_FILE=FOLDER/slow.coverage python -m pytest -n 2 --dist loadfile --by-marks \
        -m "slow and not nightly" --cov --cov-context=test --cov-report= --junitxml=FOLDER/slow.xml

Then ``python tests/benchmarks/project/faults.py FOLDER [--functions 100] [--seed 1] [--package haptics]``. Each fault
runs in a copy of the work tree, with the quick tests first; the first failure ends it. The tests write recorded outputs
anew (``--regenerate``), so that only an assertion notices a fault. Neither mutmut nor cosmic-ray exchanges arguments or
columns, or chooses tests by contexts, so the faults are made here. A test counts for the circle in which
`tests/circles.txt` has it run; those of the nightly circle are left out.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from pathlib import Path
from queue import Queue
from tempfile import TemporaryDirectory
from typing import NamedTuple
from xml.etree import ElementTree

from coverage import CoverageData

ROOT = Path(__file__).resolve().parents[3]
CIRCLES = ("quick", "slow")
LIMIT_S = 90.0
"""Longest run of the tests of a fault in one circle; a run that exceeds it although its tests usually fit hangs."""
FILL = 0.5
"""Share of `LIMIT_S` that the chosen tests usually take."""
SWAPPED: dict[type[ast.AST], str] = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "*", ast.Mod: "*", ast.And: "or",
    ast.Or: "and", ast.Lt: ">=", ast.LtE: ">", ast.Gt: "<=", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "==",
    ast.In: "not in", ast.NotIn: "in", ast.Is: "is not", ast.IsNot: "is",
}  # fmt: skip


class Fault(NamedTuple):
    """One replacement in the source of a function; offsets are bytes of the file."""

    path: str
    function: str
    lines: tuple[int, int]
    line: int
    kind: str
    edits: tuple[tuple[int, int, bytes], ...]

    def apply(self, source: bytes) -> bytes:
        """Return the source with this fault."""
        for begin, end, text in sorted(self.edits, reverse=True):
            source = source[:begin] + text + source[end:]
        return source


class Source:
    """A module's text and places in it."""

    def __init__(self, path: Path) -> None:
        self.path = path.relative_to(ROOT).as_posix()
        self.bytes = path.read_bytes()
        self.tree = ast.parse(self.bytes)
        self._starts = [0]
        for line in self.bytes.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))

    def span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        """Return the first byte of a node and the one after it."""
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return (
            self._starts[node.lineno - 1] + node.col_offset,
            self._starts[node.end_lineno - 1] + node.end_col_offset,
        )

    def text(self, node: ast.expr | ast.stmt) -> bytes:
        """Return the source of a node."""
        begin, end = self.span(node)
        return self.bytes[begin:end]

    def functions(self) -> Iterator[tuple[str, ast.FunctionDef]]:
        """Yield each function with its qualified name."""

        def below(node: ast.AST, prefix: str) -> Iterator[tuple[str, ast.FunctionDef]]:
            for child in ast.iter_child_nodes(node):
                if isinstance(child, ast.FunctionDef):
                    yield prefix + child.name, child
                if isinstance(child, ast.FunctionDef | ast.ClassDef):
                    yield from below(child, f"{prefix}{child.name}.")

        return below(self.tree, "")

    def faults(self, name: str, function: ast.FunctionDef) -> list[Fault]:
        """Return all faults of a function's body, those of texts that only people read left out."""
        assert function.end_lineno is not None
        lines = function.lineno, function.end_lineno
        return [
            Fault(self.path, name, lines, node.lineno, kind, edits)
            for node in _walk(function.body)
            for kind, edits in self._edits(node)
        ]

    def _edits(self, node: ast.expr | ast.stmt) -> Iterator[tuple[str, tuple[tuple[int, int, bytes], ...]]]:
        match node:
            case ast.BinOp(left, op, right) if type(op) in SWAPPED:
                yield "operator", (self._between(left, right, SWAPPED[type(op)]),)
            case ast.BoolOp(op, values):
                yield "operator", tuple(self._between(one, two, SWAPPED[type(op)]) for one, two in pairwise(values))
            case ast.Compare(left, [op], [right]):
                yield "operator", (self._between(left, right, SWAPPED[type(op)]),)
            case ast.Constant(bool(value)):
                yield "bound", ((*self.span(node), str(not value).encode()),)
            case ast.Constant(int(value)):
                yield "bound", ((*self.span(node), str(value + 1).encode()),)
            case ast.Constant(float(value)):
                yield "bound", ((*self.span(node), repr(value * 1.5 if value else 1.0).encode()),)
            case ast.If(test) | ast.IfExp(test):
                yield "branch", ((*self.span(test), b"False"),)
            case ast.Expr(ast.Call()):
                yield "call", ((*self.span(node), b"pass"),)
        arguments = node.args if isinstance(node, ast.Call) else []
        for one, two in pairwise(arguments):
            if not isinstance(one, ast.Starred) and not isinstance(two, ast.Starred) and ast.dump(one) != ast.dump(two):
                yield "argument", self._exchange(one, two)
        for one, two in pairwise(keyword.value for keyword in getattr(node, "keywords", []) if keyword.arg):
            if ast.dump(one) != ast.dump(two):
                yield "keyword", self._exchange(one, two)
        for condition in (test for loop in getattr(node, "generators", []) for test in loop.ifs):
            yield "filter", ((*self.span(condition), b"True"),)
        elements = node.keys if isinstance(node, ast.Dict) else getattr(node, "elts", [])
        for one, two in pairwise(elements):
            last = [part.elts[-1] if isinstance(part, ast.Tuple) and part.elts else part for part in (one, two)]
            if all(isinstance(part, ast.Constant) for part in last) and ast.dump(last[0]) != ast.dump(last[1]):
                yield "column", self._exchange(*last)

    def _between(self, left: ast.expr, right: ast.expr, operator: str) -> tuple[int, int, bytes]:
        begin, end = self.span(left)[1], self.span(right)[0]
        closing = self.bytes[begin:end]
        before = closing[: len(closing) - len(closing.lstrip(b") \n"))]
        after = closing[len(closing.rstrip(b"( \n")) :]
        return begin, end, before.rstrip(b" ") + f" {operator} ".encode() + after.lstrip(b" ")

    def _exchange(self, one: ast.expr, two: ast.expr) -> tuple[tuple[int, int, bytes], ...]:
        return (*self.span(one), self.text(two)), (*self.span(two), self.text(one))


def _walk(nodes: list[ast.stmt]) -> Iterator[ast.expr | ast.stmt]:
    """Yield statements and expressions, without functions within, annotations, messages of errors and f-strings."""
    queue: list[ast.AST] = list(nodes)
    while queue:
        node = queue.pop()
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.FunctionDef | ast.Assert):
            continue
        if isinstance(node, ast.expr | ast.stmt):
            yield node
        queue += [
            child
            for field, value in ast.iter_fields(node)
            if field not in ("annotation", "returns", "decorator_list")
            for child in (value if isinstance(value, list) else [value])
            if isinstance(child, ast.AST)
        ]


def draw(count: int, seed: int, package: str) -> list[Fault]:
    """Return one fault in each of ``count`` functions, drawn by ``seed``: first a kind, then a place."""
    sources = [Source(path) for path in sorted((ROOT / "study_app" / package).rglob("*.py"))]
    functions = [faults for source in sources for each in source.functions() if (faults := source.faults(*each))]
    generator = random.Random(seed)  # noqa: S311
    drawn = []
    for faults in generator.sample(functions, min(count, len(functions))):
        kind = generator.choice(sorted({fault.kind for fault in faults}))
        drawn.append(generator.choice([fault for fault in faults if fault.kind == kind]))
    return drawn


@cache
def durations(folder: Path, circle: str) -> dict[str, float]:
    """Return how long each test took [s], by its name in the contexts."""
    found = {}
    for case in ElementTree.parse(folder / f"{circle}.xml").iter("testcase"):  # noqa: S314
        module, _, group = case.attrib["classname"].partition(".Test")
        within = f"Test{group}::" if group else ""
        found[f"{module.replace('.', '/')}.py::{within}{case.attrib['name']}"] = float(case.attrib["time"])
    return found


@cache
def _listed() -> dict[str, str]:
    lines = (ROOT / "tests" / "circles.txt").read_text(encoding="utf-8").splitlines()
    return {name: circle for circle, _, name in (line.partition(" ") for line in lines)}


def circle_of(test: str, recorded: str) -> str:
    """Return the circle in which a test runs; ``recorded`` is the one of its marks."""
    names = test.partition("::")[0], test.partition("[")[0], test
    return next((_listed()[name] for name in names if name in _listed()), recorded)


@cache
def _is_left(test: str) -> bool:
    """Return whether a test of the contexts still exists: pytest runs none where one of those named does not."""
    module, _, name = test.partition("::")
    function = name.split("[")[0].rsplit("::", 1)[-1]
    return (ROOT / module).is_file() and f"def {function}(" in (ROOT / module).read_text(encoding="utf-8")


def covering(folder: Path, circle: str, fault: Fault) -> list[str]:
    """Return tests of a circle that run the function: first those of the faulty line, of its package, quick ones."""
    times_s = durations(folder, "quick") | durations(folder, "slow")
    tests_of: dict[int, set[str]] = {}
    for recorded in CIRCLES:
        data = CoverageData(str(folder / f"{recorded}.coverage"))
        data.read()
        for line, contexts in data.contexts_by_lineno(fault.path).items():
            names = {name.split("|")[0] for name in contexts if name}
            tests_of.setdefault(line, set()).update(name for name in names if circle_of(name, recorded) == circle)

    def at(*lines: int) -> set[str]:
        return {test for line in lines for test in tests_of.get(line, ()) if _is_left(test)}

    at_fault, package = at(fault.line), f"tests/{Path(fault.path).parts[1]}/"
    total_s, chosen = 0.0, []
    for test in sorted(
        at(*range(fault.lines[0], fault.lines[1] + 1)),
        key=lambda test: (test not in at_fault, not test.startswith(package), times_s.get(test, 1.0), test),
    ):
        total_s += times_s.get(test, 1.0)
        if chosen and total_s > FILL * LIMIT_S:
            break
        chosen.append(test)
    return chosen


def cache_of(copy: Path, environment: dict[str, str]) -> Path:
    """Return the folder of compiled code of a work tree as it stands: its name follows from all its modules."""
    command = [sys.executable, "-c", "import study_app.haptics.kernels.compiled, numba; print(numba.config.CACHE_DIR)"]
    return Path(subprocess.check_output(command, cwd=copy, env=environment, text=True).strip())


def noticed_by(fault: Fault, folder: Path, copy: Path) -> str:
    """Return the circle whose tests fail with the fault, or "none"; a test that fails without it does not count.

    A module with kernels runs uncompiled; with a fault in any other one, what is compiled stays.
    """
    faulty = copy / fault.path
    sound = faulty.read_bytes()
    compiled = b"kernels.compiled import" not in sound
    environment = os.environ | {
        "PYTHONPATH": str(copy),
        "LIQUID_STUDY_WORKSPACE": str(copy),
        "LIQUID_STUDY_CONFIG": str(copy / "config"),
        "NUMBA_DISABLE_JIT": "0" if compiled else "1",
    }
    cache = cache_of(copy, environment)
    faulty.write_bytes(fault.apply(sound))
    cache_with_fault = cache_of(copy, environment)
    faulty.write_bytes(sound)
    if compiled and cache_with_fault != cache:
        shutil.copytree(cache, cache_with_fault, dirs_exist_ok=True)

    def failed(tests: list[str]) -> list[str]:
        options = ["-x", "-q", "--no-header", "-p", "no:cacheprovider", "--regenerate"]
        command, begun_s = [sys.executable, "-m", "pytest", *options, *tests], time.time()
        try:
            done = subprocess.run(
                command, check=False, cwd=copy, env=environment, capture_output=True, text=True, timeout=LIMIT_S
            )
        except subprocess.TimeoutExpired:
            return tests[:1]
        finally:
            restore_recordings(copy, begun_s)
        if done.returncode in (0, 5):
            return []
        named = [line.split()[1] for line in done.stdout.splitlines() if line.startswith(("FAILED ", "ERROR "))]
        return [test for test in tests if any(test.startswith(name) for name in named)][:1] or tests[:1]

    found = "none"
    for circle in CIRCLES:
        if not (tests := covering(folder, circle, fault)):
            continue
        faulty.write_bytes(fault.apply(sound))
        first = failed(tests)
        faulty.write_bytes(sound)
        if first and not failed(first):
            found = circle
            break
    if cache_with_fault != cache:
        shutil.rmtree(cache_with_fault, ignore_errors=True)
    return found


def restore_recordings(copy: Path, since_s: float) -> None:
    """Restore the files of the tests that were written since a time [s since the epoch]."""
    for path in (copy / "tests").rglob("*"):
        if path.suffix != ".pyc" and path.is_file() and path.stat().st_mtime >= since_s:
            recorded = ROOT / path.relative_to(copy)
            shutil.copy2(recorded, path) if recorded.is_file() else path.unlink()


def main() -> None:
    """Print a row for each fault, then the shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--functions", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--package", default="")
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    faults = draw(given.functions, given.seed, given.package)
    counts: Counter[str] = Counter()
    with TemporaryDirectory() as temporary, ThreadPoolExecutor(given.workers) as workers:
        copies: Queue[Path] = Queue()
        for number in range(given.workers):
            copies.put(_copy(Path(temporary) / str(number)))

        def judge(fault: Fault) -> tuple[Fault, str, float]:
            copy, begun = copies.get(), time.perf_counter()
            try:
                return fault, noticed_by(fault, given.folder.resolve(), copy), time.perf_counter() - begun
            finally:
                copies.put(copy)

        for fault, circle, took_s in workers.map(judge, faults):
            counts[circle] += 1
            change = " ".join(text.decode() for *_, text in fault.edits)
            print(
                f"{circle:6} {took_s:4.0f} s  {fault.kind:9} {fault.path}:{fault.line} {fault.function}: {change[:60]}",
                flush=True,
            )
    total = counts.total()
    shares = ", ".join(f"{name} {counts[name]} ({counts[name] / total:.0%})" for name in (*CIRCLES, "none"))
    print(f"seed {given.seed}, {total} faults: {shares}; noticed {1 - counts['none'] / total:.0%}")


def _copy(folder: Path) -> Path:
    """Copy what Git tracks, as it stands in the work tree."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in listed.splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


if __name__ == "__main__":
    main()
