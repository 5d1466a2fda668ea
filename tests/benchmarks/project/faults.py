"""How many faults the tests notice: one fault in each of some functions drawn at random, and the tests that run it.

``python tests/benchmarks/project/faults.py probe FOLDER --seeds 1 2 3 [--functions 100] [--package haptics]`` draws the
faults and runs the quick and the slow tests once (about 25 minutes on two cores) in a copy of the work tree. In the
copy, each function with a fault, and the statement with the fault, record which test runs them, also in programs that
the test starts. Compiled functions cannot record anything; the quick tests of their package therefore run again as
plain Python. These tests judge them first, and then, compiled with the fault, the tests of their folder and package.

``python tests/benchmarks/project/faults.py judge FOLDER [--workers 2] [--seed 1]`` then runs the recorded tests with
each fault, the quick ones first; the first failure ends it. ``FOLDER/verdicts.jsonl`` holds the verdicts; the command
continues after an interruption. If module and session fixtures run the function, all tests of the test module count; if
an import runs it, the tests of the package. Each run is a fork of a process that has loaded the libraries, but nothing
of the program. The tests rewrite recorded outputs (``--regenerate``), so that only an assertion notices a fault; other
exceptions, crashes and hanging tests are counted separately. Compiled code is not compiled again for a fault elsewhere.
Faults that mypy reports are counted separately too, and no tests are run with them.

Neither mutmut nor cosmic-ray exchanges arguments or columns, or chooses tests by function, so the faults are made here.
Tests of the nightly circle are left out.
"""

import argparse
import ast
import contextlib
import importlib.util
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple, NoReturn
from xml.etree import ElementTree

import psutil
import pytest

ROOT = Path(__file__).resolve().parents[3]
CIRCLES = ("quick", "slow")
UNCOMPILED = "uncompiled"
"""The run of the tests of compiled functions, as plain Python."""
LIMIT_S = 240.0
"""A test that takes longer hangs, also on a machine that computes something else; the first one includes the start."""
COMPILING_S = 600.0
"""This limit where the first test compiles the force model."""
MEMORY_B = 8 * 2**30
"""Most memory that a process may use; a fault may fill all of it."""
USUAL_S = 45.0
"""How long the tests chosen for a fault usually take in a circle."""
LIBRARIES = (
    "numba", "numpy", "pandas", "scipy.optimize", "scipy.stats", "matplotlib.figure", "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_pdf", "matplotlib.backends.backend_svg", "pydantic", "click", "jinja2", "tomlkit",
    "PySide6.QtWidgets", "PySide6.QtSvg", "PySide6.QtTest",
)  # fmt: skip
"""What the process loads whose forks run the tests."""
DECORATORS = ("@kernel", "@part", "@evidence_kernel")
"""What compiles a function; it is the last decorator."""
PASSED = re.compile(r"(?<!def )\b(?:kernel|part|evidence_kernel|c_function|device_functions)\(([^()]*)\)")
"""What is passed to a function that compiles it."""
PROBE = """
import builtins, os


def _record(name, tests=os.environ._data, known=set(), open=os.open, write=os.write, close=os.close):
    test = tests.get(b"PYTEST_CURRENT_TEST", b"")
    if (name, test) in known:
        return
    known.add((name, test))
    try:
        file = open(f"{HITS}/{name}.txt", os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        write(file, test + b"\\n")
        close(file)
    except Exception:
        pass


builtins.record_fault = _record
"""
"""What ``study_app/__init__.py`` gets: a function that records the running test once in a process."""
SWAPPED: dict[type[ast.AST], str] = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "*", ast.Mod: "*", ast.And: "or",
    ast.Or: "and", ast.Lt: ">=", ast.LtE: ">", ast.Gt: "<=", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "==",
    ast.In: "not in", ast.NotIn: "in", ast.Is: "is not", ast.IsNot: "is",
}  # fmt: skip
COMMUTATIVE = {"max", "min", "maximum", "minimum", "hypot", "gcd", "isclose", "allclose"}
"""Functions whose arguments can be exchanged without an effect."""


class Fault(NamedTuple):
    """One replacement in the source of a function; offsets are bytes of the file."""

    path: str
    function: str
    lines: tuple[int, int]
    line: int
    kind: str
    edits: tuple[tuple[int, int, bytes], ...]

    @property
    def package(self) -> str:
        """Return the package or module of the program by which tests are grouped."""
        return Path(self.path).parts[1].removesuffix(".py")


class Source:
    """The source text of a module, and positions in it."""

    def __init__(self, path: Path, root: Path) -> None:
        self.path = path.relative_to(root).as_posix()
        self.bytes = path.read_bytes()
        self.tree = ast.parse(self.bytes)
        self._starts = [0]
        for line in self.bytes.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))

    def span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        """Return the byte range of a node: its start and its end."""
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

    def probes(self, fault: Fault, name: str) -> Iterator[tuple[int, int, bytes]]:
        """Yield the edits that record the tests of a fault: at the beginning of its function, before its statement."""
        function = next(node for _, node in self.functions() if node.lineno == fault.lines[0])
        yield self._before(function.body[1 if ast.get_docstring(function) is not None else 0], name)
        begin, end = min(edit[0] for edit in fault.edits), max(edit[1] for edit in fault.edits)
        statement = min(
            (
                node
                for node in ast.walk(function)
                if isinstance(node, ast.stmt) and _is_within(self.span(node), begin, end)
            ),
            key=lambda node: self.span(node)[1] - self.span(node)[0],
        )
        if not self.text(statement).startswith(b"elif"):
            yield self._before(statement, f"{name}-statement")

    def _before(self, node: ast.stmt, name: str) -> tuple[int, int, bytes]:
        line = min([node.lineno, *(decorator.lineno for decorator in getattr(node, "decorator_list", []))])
        begin = self._starts[line - 1] + node.col_offset
        indent = self.bytes[self._starts[line - 1] : begin]
        return begin, begin, f'record_fault("{name}")'.encode() + (b"; " if indent.strip() else b"\n" + indent)

    def _edits(self, node: ast.expr | ast.stmt) -> Iterator[tuple[str, tuple[tuple[int, int, bytes], ...]]]:
        match node:
            case ast.BinOp(left, op, right) if type(op) in SWAPPED:
                yield "operator", (self._between(left, right, SWAPPED[type(op)]),)
            case ast.BoolOp(op, values):
                yield (
                    "operator",
                    tuple(self._between(first, second, SWAPPED[type(op)]) for first, second in pairwise(values)),
                )
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
        arguments = node.args if isinstance(node, ast.Call) and _name_of(node.func) not in COMMUTATIVE else []
        for first, second in pairwise(arguments):
            if (
                not isinstance(first, ast.Starred)
                and not isinstance(second, ast.Starred)
                and ast.dump(first) != ast.dump(second)
            ):
                yield "argument", self._exchange(first, second)
        for first, second in pairwise(keyword.value for keyword in getattr(node, "keywords", []) if keyword.arg):
            if ast.dump(first) != ast.dump(second):
                yield "keyword", self._exchange(first, second)
        for condition in (test for loop in getattr(node, "generators", []) for test in loop.ifs):
            yield "filter", ((*self.span(condition), b"True"),)
        listed: list[Any] = node.elts if isinstance(node, ast.List | ast.Tuple) else []
        for first, second in pairwise(node.keys if isinstance(node, ast.Dict) else listed):
            last = [part.elts[-1] if isinstance(part, ast.Tuple) and part.elts else part for part in (first, second)]
            if all(isinstance(part, ast.Constant) for part in last) and ast.dump(last[0]) != ast.dump(last[1]):
                yield "column", self._exchange(*last)

    def _between(self, left: ast.expr, right: ast.expr, operator: str) -> tuple[int, int, bytes]:
        begin, end = self.span(left)[1], self.span(right)[0]
        closing = self.bytes[begin:end]
        before = closing[: len(closing) - len(closing.lstrip(b") \n"))]
        after = closing[len(closing.rstrip(b"( \n")) :]
        return begin, end, before.rstrip(b" ") + f" {operator} ".encode() + after.lstrip(b" ")

    def _exchange(self, first: ast.expr, two: ast.expr) -> tuple[tuple[int, int, bytes], ...]:
        return (*self.span(first), self.text(two)), (*self.span(two), self.text(first))


def _name_of(function: ast.expr) -> str:
    """Return the last name of a called function; "" without a name."""
    return str(getattr(function, "attr", getattr(function, "id", "")))


def _is_within(span: tuple[int, int], begin: int, end: int) -> bool:
    return span[0] <= begin and end <= span[1]


def _walk(nodes: list[ast.stmt]) -> Iterator[ast.expr | ast.stmt]:
    """Yield statements and expressions, without functions within, annotations, messages of errors and f-strings.

    `strict=` of zip is left out as well: it has no effect if the lengths are right.
    """
    queue: list[ast.AST] = list(nodes)
    while queue:
        node = queue.pop()
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.FunctionDef | ast.Assert):
            continue
        if isinstance(node, ast.keyword) and node.arg == "strict":
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


def apply_edits(source: bytes, edits: Iterable[tuple[int, int, bytes]]) -> bytes:
    """Return the source with each span replaced."""
    for begin, end, text in sorted(edits, reverse=True):
        source = source[:begin] + text + source[end:]
    return source


@cache
def _faults_of_functions(root: Path, package: str) -> list[list[Fault]]:
    sources = [Source(path, root) for path in sorted((root / "study_app" / package).rglob("*.py"))]
    return [faults for source in sources for function in source.functions() if (faults := source.faults(*function))]


def draw(root: Path, count: int, seed: int, package: str) -> list[Fault]:
    """Return one fault in each of ``count`` functions, drawn by ``seed``: first a kind, then a place."""
    functions = _faults_of_functions(root, package)
    generator = random.Random(seed)  # noqa: S311
    drawn = []
    for faults in generator.sample(functions, min(count, len(functions))):
        kind = generator.choice(sorted({fault.kind for fault in faults}))
        drawn.append(generator.choice([fault for fault in faults if fault.kind == kind]))
    return drawn


@cache
def drawn_faults(folder: Path) -> dict[str, Fault]:
    """Return the faults of a folder by their names, SEED-NUMBER."""
    options = json.loads((folder / "draw.json").read_text(encoding="utf-8"))
    return {
        f"{seed}-{number:03}": fault
        for seed in options["seeds"]
        for number, fault in enumerate(draw(folder / "sound", options["functions"], seed, options["package"]))
    }


def is_compiled(folder: Path, fault: Fault) -> bool:
    """Return whether the function of a fault is compiled: by a decorator, or passed on in its module or as M.NAME."""
    source = (folder / "sound" / fault.path).read_text(encoding="utf-8")
    has_decorator = source.splitlines()[fault.lines[0] - 2].strip() in DECORATORS
    is_passed = fault.function in re.findall(r"\w+", " ".join(PASSED.findall(source)))
    return has_decorator or is_passed or (fault.package == "haptics" and fault.function in _names_of_members(folder))


@cache
def _names_of_members(folder: Path) -> frozenset[str]:
    sources = [path.read_text(encoding="utf-8") for path in (folder / "sound/study_app/haptics").rglob("*.py")]
    return frozenset(re.findall(r"\w+\.(\w+)", " ".join(text for source in sources for text in PASSED.findall(source))))


def environment_of(folder: Path, copy: Path, run: str, compiled: Path | None = None) -> dict[str, str]:
    """Return the environment of tests in a copy of the program; ``compiled`` is its folder of compiled code."""
    return {
        "PYTHONPATH": str(copy),
        "LIQUID_STUDY_WORKSPACE": str(copy),
        "LIQUID_STUDY_CONFIG": str(copy / "config"),
        "NUMBA_CACHE_DIR": str(compiled or folder / "compiled"),
        "NUMBA_DISABLE_JIT": str(int(run == UNCOMPILED)),
    }


def record_tests(folder: Path, tests: list[str]) -> None:
    """Run the tests once in copies whose functions record them."""
    faults = drawn_faults(folder)
    (folder / "hits").mkdir()
    marks = {"quick": "not slow and not nightly", "slow": "slow and not nightly"}
    compiled = {name: fault for name, fault in faults.items() if is_compiled(folder, fault)}
    copy = _probed_copy(folder, "probed", {name: fault for name, fault in faults.items() if name not in compiled})
    for circle in CIRCLES:
        _run_recorded(folder, copy, circle, ["-m", marks[circle], *tests])
    if compiled:
        copy = _probed_copy(folder, "probed-uncompiled", compiled)
        packages = sorted({f"tests/{fault.package}" for fault in compiled.values()})
        _run_recorded(folder, copy, UNCOMPILED, ["-m", f"{marks['quick']} and not compiled", *(tests or packages)])


def _probed_copy(folder: Path, name: str, faults: dict[str, Fault]) -> Path:
    """Return a copy of the sound program in which the functions of these faults record the tests."""
    copy = copy_program(folder, folder / name)
    with (copy / "study_app" / "__init__.py").open("ab") as module:
        module.write(PROBE.replace("{HITS}", str(folder / "hits")).encode())
    for path in {fault.path for fault in faults.values()}:
        source = Source(copy / path, copy)
        edits = [edit for name, fault in faults.items() if fault.path == path for edit in source.probes(fault, name)]
        write_source(copy / path, apply_edits(source.bytes, edits))
    return copy


def _run_recorded(folder: Path, copy: Path, run: str, options: list[str]) -> None:
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-n",
        "2",
        "--dist",
        "loadfile",
        "-p",
        "no:cacheprovider",
        "--timeout=1800",
    ]
    with (folder / f"{run}.log").open("wb") as log:
        subprocess.run(
            [*command, "--regenerate", f"--junitxml={folder / run}.xml", *options],
            check=False, cwd=copy, env=os.environ | environment_of(folder, copy, run), stdout=log, stderr=log,
        )  # fmt: skip
    print(f"{run}: {(folder / f'{run}.log').read_text(encoding='utf-8').splitlines()[-1]}", flush=True)


@cache
def durations(folder: Path, run: str) -> dict[str, float]:
    """Return how long each test took [s], by its name."""
    times_s = {}
    for case in ElementTree.parse(folder / f"{run}.xml").iter("testcase"):  # noqa: S314
        module, _, group = case.attrib["classname"].partition(".Test")
        within = f"Test{group}::" if group else ""
        times_s[f"{module.replace('.', '/')}.py::{within}{case.attrib['name']}"] = float(case.attrib["time"])
    return times_s


def read_hits(folder: Path, name: str) -> dict[str, set[str]]:
    """Return the phases ("setup", "call", "teardown") in which each test ran a probe; "" is an import."""
    path = folder / "hits" / f"{name}.txt"
    phases: dict[str, set[str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        test, _, phase = line.rpartition(" ")
        phases.setdefault(test, set()).add(phase.strip("()"))
    return phases


def choose_tests(folder: Path, name: str, fault: Fault, run: str) -> list[str]:
    """Return tests that run the function: first those of its statement, folder, package, and short ones."""
    times_s, hits = durations(folder, run), read_hits(folder, name)
    at_statement = read_hits(folder, f"{name}-statement")
    modules = {test.partition("::")[0] for test, phases in hits.items() if "setup" in phases}
    package = (f"tests/{fault.package}/", f"tests/test_{fault.package}.py")
    folder_of_tests = f"tests/{Path(fault.path).parent.relative_to('study_app').as_posix()}/"
    tests = {test for test in times_s if test in hits or test.partition("::")[0] in modules}
    if "" in hits or (is_compiled(folder, fault) and run != UNCOMPILED):
        tests |= {test for test in times_s if test.startswith(package)}

    def rank(test: str) -> tuple[bool, bool, bool, bool, float, str]:
        is_near = test.startswith(folder_of_tests)
        return (
            test not in at_statement,
            test not in hits,
            not is_near,
            not test.startswith(package),
            times_s[test],
            test,
        )

    total_s, chosen = 0.0, list[str]()
    for test in sorted(tests, key=rank):
        total_s += times_s[test]
        if chosen and total_s > USUAL_S:
            break
        chosen.append(test)
    order = list(dict.fromkeys(test.partition("::")[0] for test in chosen))
    return sorted(chosen, key=lambda test: order.index(test.partition("::")[0]))


class FirstFailure:
    """A plug-in of pytest that writes the running test to a file, and how it failed: "crash" until it has ended."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.test = self.how = ""

    def write(self) -> None:
        """Write the test and how it failed."""
        self._file.write_bytes(f"{self.how}\n{self.test}".encode())

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Note which test begins."""
        self.test, self.how = nodeid, "crash"
        self.write()

    def pytest_exception_interact(self, node: pytest.Item | pytest.Collector, call: pytest.CallInfo[Any]) -> None:
        """Note the first exception of a test, or of an import."""
        if (self.test, self.how) == (node.nodeid, "crash") or self.test != node.nodeid:
            assert call.excinfo is not None
            is_assertion = isinstance(call.excinfo.value, AssertionError | pytest.fail.Exception)
            self.test, self.how = node.nodeid, "assertion" if is_assertion else "exception"
            self.write()


def first_failure(copy: Path, tests: list[str], environment: dict[str, str], limit_s: float) -> tuple[str, str]:
    """Return which of the tests failed first in a fork of this process, and how: ("", "") if all passed."""
    temporary = copy.parent / "t"
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir()
    file = temporary / "failure"
    file.write_bytes(f"crash\n{tests[0]}".encode())
    if (child := os.fork()) == 0:
        _run_tests(copy, tests, environment, file)
    status = None
    while status is None and time.time() - file.stat().st_mtime < limit_s:
        time.sleep(0.05)
        ended, code = os.waitpid(child, os.WNOHANG)
        status = code if ended else None
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    how, _, test = file.read_text(encoding="utf-8").partition("\n")
    if status is None:
        os.waitpid(child, 0)
        how = "timeout"
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if process.environ().get("TMPDIR") == str(temporary):  # also in a session of its own
                process.kill()
    return test, how


def _run_tests(copy: Path, tests: list[str], environment: dict[str, str], file: Path) -> NoReturn:
    """Run tests in this process, a fork, and end it."""
    try:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_B, MEMORY_B))
        log = os.open(file.with_name("log"), os.O_WRONLY | os.O_CREAT)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.chdir(copy)
        os.environ.update(environment, TMPDIR=str(file.parent))
        tempfile.tempdir = None
        sys.path[0] = str(copy)
        sys.modules["__main__"] = importlib.import_module("pytest.__main__")  # for processes that the tests start
        importlib.import_module("numba").config.reload_config()
        sys.argv = ["pytest", "-x", "-q", "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning"]
        sys.argv += ["--timeout=0", "--regenerate", f"--basetemp={file.parent / 'base'}", *tests]
        failure = FirstFailure(file)
        code = pytest.main(sys.argv[1:], plugins=[failure])
        if code in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
            failure.test = failure.how = ""
        elif failure.how in ("", "crash"):
            failure.test, failure.how = failure.test or tests[0], "exception"
        failure.write()
        sys.stdout.flush()
    finally:
        os._exit(0)


def judge_fault(folder: Path, temporary: Path, name: str) -> dict[str, Any]:
    """Return the circle whose tests detect a fault and how, or "none"; ignore tests that fail without the fault.

    The circle is "types" if mypy reports the fault.
    """
    copy, fault, begun_s = _own_copy(folder, temporary), drawn_faults(folder)[name], time.perf_counter()
    sound, compiles = (copy / fault.path).read_bytes(), is_compiled(folder, fault)
    own_cache = copy.parent / "compiled"
    shutil.rmtree(own_cache, ignore_errors=True)
    verdict = {"fault": name, "circle": "none", "how": "not run", "test": ""}
    write_source(copy / fault.path, apply_edits(sound, fault.edits))
    if check_types(copy):
        verdict |= {"circle": "types", "how": "types"}
    write_source(copy / fault.path, sound)

    def failure(tests: list[str], run: str, source: bytes) -> tuple[str, str]:
        uses_own = compiles and run != UNCOMPILED and source != sound
        environment = environment_of(folder, copy, run, own_cache if uses_own else None)
        write_source(copy / fault.path, source)
        since_s = time.time()
        try:
            return first_failure(copy, tests, environment, COMPILING_S if uses_own else LIMIT_S)
        finally:
            write_source(copy / fault.path, sound)
            restore_recordings(folder, copy, since_s)

    circles = (UNCOMPILED, *CIRCLES) if compiles else CIRCLES
    for run in circles if verdict["circle"] == "none" else ():
        tests = choose_tests(folder, name, fault, run)
        while tests and verdict["circle"] == "none":
            verdict["how"] = "passed"
            failed, how = failure(tests, run, apply_edits(sound, fault.edits))
            if not how:
                break
            named = [test for test in tests if test.startswith(failed)][:1] or tests[:1]
            if failure(named, run, sound)[1]:
                tests = [test for test in tests if test not in named]
            else:
                verdict |= {"circle": run, "how": how, "test": failed}
    return verdict | {"took_s": round(time.perf_counter() - begun_s, 1)}


def check_types(copy: Path) -> bool:
    """Return whether mypy reports an error in a copy of the program; it does not report a condition `False`."""
    command = [sys.executable, "-m", "mypy", "--no-warn-unreachable", "--no-error-summary"]
    completed = subprocess.run(command, check=False, cwd=copy, capture_output=True, text=True)
    if completed.returncode > 1:
        raise RuntimeError(f"mypy did not run in {copy}: {completed.stdout}{completed.stderr}")
    return completed.returncode == 1


@cache
def _own_copy(folder: Path, temporary: Path) -> Path:
    """Return the copy of this process."""
    return copy_program(folder, temporary / str(os.getpid()) / "program")


def copy_program(folder: Path, target: Path) -> Path:
    """Copy the sound program; the copy keeps its compiled code in one folder, whatever the sources."""
    shutil.copytree(folder / "sound", target)
    module = target / "study_app" / "haptics" / "kernels" / "compiled.py"
    digest = b"digest_of(SOURCES, _processor(), versions())"
    source = module.read_bytes()
    assert digest in source
    write_source(module, source.replace(digest, b'"fa175fa175fa175f"'.ljust(len(digest))))  # no place moves
    return target


def write_source(path: Path, source: bytes) -> None:
    """Write a module, and remove its bytecode, which Python would use if length and second were the same."""
    path.write_bytes(source)
    Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)


def restore_recordings(folder: Path, copy: Path, since_s: float) -> None:
    """Restore the files of the tests that were written since a time [s since the epoch]."""
    for path in (copy / "tests").rglob("*"):
        if path.suffix != ".pyc" and path.is_file() and path.stat().st_mtime >= since_s:
            recorded = folder / "sound" / path.relative_to(copy)
            shutil.copy2(recorded, path) if recorded.is_file() else path.unlink()


def judge(folder: Path, workers: int, seed: int | None) -> None:
    """Judge the faults that have no verdict; print a row for each, then the shares."""
    faults = {
        name: fault for name, fault in drawn_faults(folder).items() if seed in (None, int(name.partition("-")[0]))
    }
    file = folder / "verdicts.jsonl"
    verdicts = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()] if file.exists() else []
    left = sorted(faults.keys() - {verdict["fault"] for verdict in verdicts})
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    for library in LIBRARIES:
        importlib.import_module(library)
    with tempfile.TemporaryDirectory() as temporary, ProcessPoolExecutor(workers, get_context("fork")) as pool:
        for future in as_completed([pool.submit(judge_fault, folder, Path(temporary), name) for name in left]):
            verdicts.append(future.result())
            with file.open("ab") as lines:
                lines.write(f"{json.dumps(verdicts[-1])}\n".encode())
            print(_row(verdicts[-1], faults[verdicts[-1]["fault"]]), flush=True)
    verdicts = [verdict for verdict in verdicts if verdict["fault"] in faults]
    for group in sorted({fault.package for fault in faults.values()}):
        chosen = [verdict for verdict in verdicts if faults[verdict["fault"]].package == group]
        print(f"{group}: {_shares(chosen)}")
        for verdict in chosen:
            if verdict["circle"] == "none":
                print(f"    {_row(verdict, faults[verdict['fault']])}")
    for group in sorted({name.partition("-")[0] for name in faults}):
        print(f"seed {group}: {_shares([verdict for verdict in verdicts if verdict['fault'].startswith(f'{group}-')])}")
    print(f"all: {_shares(verdicts)}")


def _row(verdict: dict[str, Any], fault: Fault) -> str:
    change = " ".join(text.decode() for *_, text in fault.edits)[:60]
    judged = f"{verdict['circle']:10} {verdict['how']:9} {verdict['took_s']:5.0f} s  {verdict['fault']}"
    return f"{judged} {fault.kind:8} {fault.path}:{fault.line} {fault.function}: {change}"


def _shares(verdicts: list[dict[str, Any]]) -> str:
    circles, ways = (Counter(verdict[key] for verdict in verdicts) for key in ("circle", "how"))
    total = len(verdicts) - circles["types"]
    counts = ", ".join(f"{name} {count}" for counter in (circles, ways) for name, count in sorted(counter.items()))
    if not total:
        return f"no faults but those that mypy reports ({counts})"
    return (
        f"{total} faults that mypy does not report, noticed {1 - circles['none'] / total:.0%},"
        f" by an assertion {ways['assertion'] / total:.0%} ({counts})"
    )


def main() -> None:
    """Record the tests of drawn faults, or judge these faults."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    probing, judging = commands.add_parser("probe"), commands.add_parser("judge")
    for command in (probing, judging):
        command.add_argument("folder", type=Path)
    probing.add_argument("--seeds", type=int, nargs="+", default=[1])
    probing.add_argument("--functions", type=int, default=100)
    probing.add_argument("--package", default="")
    probing.add_argument("--tests", nargs="+", default=[], help="only these folders or files")
    judging.add_argument("--workers", type=int, default=1)
    judging.add_argument("--seed", type=int)
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    if arguments.command == "judge":
        judge(folder, arguments.workers, arguments.seed)
        return
    if folder.exists():
        parser.error(f"{folder} exists already: name a new folder, or judge its faults")
    folder.mkdir(parents=True)
    copy_work_tree(folder / "sound")
    if check_types(folder / "sound"):  # also fills mypy's cache, which the copies get
        parser.error("mypy reports faults in the program as it stands")
    options = {"seeds": arguments.seeds, "functions": arguments.functions, "package": arguments.package}
    (folder / "draw.json").write_bytes(json.dumps(options).encode())
    record_tests(folder, arguments.tests)


def copy_work_tree(folder: Path) -> None:
    """Copy what Git tracks, as it stands in the work tree."""
    process = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in process.splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


if __name__ == "__main__":
    main()
