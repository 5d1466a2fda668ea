"""Settings of all tests: no screen, no Qt if its libraries are missing, and no unexpected warnings."""

import functools
import gc
import itertools
import logging
import os
import re
import signal
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import hypothesis
import pytest

from study_app.evidence.outlets.localhost import localhost_only
from study_app.workers.executors import Workers
from study_app.workers.one_thread import compute_in_one_thread
from tests import golden

# An example may compile on a fresh machine: how long one takes is no failure.
hypothesis.settings.register_profile("unhurried", deadline=None)
hypothesis.settings.load_profile("unhurried")

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
# The program's own fonts alone (on Linux, elsewhere): what a window paints must not depend on the machine's.
os.environ["FONTCONFIG_FILE"] = str(Path(__file__).with_name("fonts.conf"))
os.environ["QT_QPA_FONTDIR"] = str(Path(__file__).parents[1] / "study_app" / "gui" / "assets" / "fonts")
# No test uses the settings or the workspace of this machine's user: its workspace is its working folder.
# Set here because fixtures of modules and sessions begin before those of a test.
os.environ["LIQUID_STUDY_CONFIG"] = str(Path(tempfile.gettempdir(), f"liquid-study-tests-{os.getpid()}", "settings"))
os.environ["LIQUID_STUDY_DATA"] = str(Path(tempfile.gettempdir(), f"liquid-study-tests-{os.getpid()}", "data"))
os.environ["LIQUID_STUDY_WORKSPACE"] = "."
# The library reads its settings once in a process: those of the first test that uses it hold for all after it.
localhost_only()
compute_in_one_thread()

NEED_QT = ("app", "designer", "gui")
"""Folders of tests that all need Qt."""
try:
    import PySide6.QtWidgets  # noqa: F401
except ImportError as missing:
    QT_MISSING = f"Qt cannot be loaded here: {missing}"
else:
    QT_MISSING = ""
QT_IS_HERE = not QT_MISSING


@contextmanager
def skipping_without_qt() -> Iterator[None]:
    """Skip a test that fails because Qt's system libraries are missing."""
    try:
        yield
    except Exception as error:
        cause: BaseException | None = error
        while QT_MISSING and cause is not None:
            if isinstance(cause, ImportError) and "PySide6" in str(cause.path):
                pytest.skip(QT_MISSING, allow_module_level=True)
            cause = cause.__cause__ or cause.__context__
        raise


class FolderWithoutQt(pytest.File):
    """A folder whose tests cannot be imported; to pytest a file, since it imports the conftest of a folder."""

    def collect(self) -> NoReturn:
        pytest.skip(QT_MISSING, allow_module_level=True)


class ModuleWithoutQt(pytest.Module):
    """A module that may need Qt."""

    def collect(self) -> Iterable[pytest.Item | pytest.Collector]:
        with skipping_without_qt():
            return list(super().collect())


def pytest_collect_directory(path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Do not collect the folders of window tests if Qt is missing."""
    if QT_MISSING and path.parent == Path(__file__).parent and path.name in NEED_QT:
        return FolderWithoutQt.from_parent(parent, path=path)
    return None


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    """Skip modules that need Qt where it cannot be loaded."""
    return ModuleWithoutQt.from_parent(parent, path=module_path) if QT_MISSING else None


@functools.cache
def listed_circles(config: pytest.Config) -> dict[str, str]:
    """Return the circle of each test that runs in a later circle than its markers indicate.

    `tests/benchmarks/project/circles.py` writes this list.
    """
    if config.getoption("by_marks"):
        return {}
    lines = Path(__file__).with_name("circles.txt").read_text(encoding="utf-8").splitlines()
    return {name: circle for circle, _, name in (line.partition(" ") for line in lines)}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options that rewrite golden files and that ignore the list of circles."""
    parser.addoption("--regenerate", action="store_true", help="rewrite golden files; review the difference")
    parser.addoption("--by-marks", action="store_true", help="choose circles by the marks alone, not by circles.txt")


def pytest_plugin_registered(plugin: object, manager: pytest.PytestPluginManager) -> None:
    """Unregister pytest-qt without Qt, since it cannot start then and would prevent all tests."""
    if not QT_IS_HERE and manager.get_name(plugin) == "pytest-qt":
        manager.unregister(plugin)


def pytest_sessionstart() -> None:
    """Collect garbage only between tests: a collecting thread would destroy widgets whose timers then crash Qt."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # as in a job that a script starts in the background
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if QT_IS_HERE:
        gc.disable()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Do not import modules of slow tests that `-m` leaves out."""
    if "not slow" not in config.option.markexpr or collection_path.suffix != ".py":
        return None
    if collection_path.relative_to(config.rootpath).as_posix() in listed_circles(config):
        return True
    slow = re.search(
        r"^pytestmark = (\[[^\]]*)?pytest\.mark\.slow\b", collection_path.read_text(encoding="utf-8"), re.M
    )
    return slow is not None or None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests that `circles.txt` lists, and as nightly all but n variants, evenly spread, of `variants(n)`.

    Modules with a longer time limit come first, so that at the end no worker is alone with one.
    """
    limits_s: dict[Path, float] = {}
    for item in items:
        marker = item.get_closest_marker("timeout")
        limits_s[item.path] = max(limits_s.get(item.path, 0.0), marker.args[0] if marker else 0.0)
    items.sort(key=lambda item: -limits_s[item.path])
    listed = listed_circles(config)
    for item in items:
        names = item.nodeid.partition("::")[0], item.nodeid.partition("[")[0], item.nodeid
        for circle in {listed[name] for name in names if name in listed}:
            item.add_marker(circle)
    collected: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("variants"):
            collected.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for variants in collected.values():
        (count,) = variants[0].get_closest_marker("variants").args
        kept = {len(variants) * place // count for place in range(count)}
        for place, item in enumerate(variants):
            if place not in kept:
                item.add_marker("nightly")


def pytest_collection_finish() -> None:
    """Freeze the modules that were imported while tests were collected."""
    if QT_IS_HERE:
        gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup() -> Iterator[None]:
    """Skip a test whose fixtures need Qt where it cannot be loaded."""
    with skipping_without_qt():
        yield


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Iterator[None]:
    """Fail if a window or dialog contains program text after a test, also in tips and names."""
    with skipping_without_qt():
        yield
    widgets = sys.modules.get("PySide6.QtWidgets")
    if widgets is not None and isinstance(widgets.QApplication.instance(), widgets.QApplication):
        from tests.program_text import printed_in_windows

        assert not (texts := printed_in_windows()), texts


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown() -> None:
    """Collect garbage if due; freeze the objects that survive a full collection, mostly modules."""
    if QT_IS_HERE:
        from study_app.app.timing import collect_if_due

        if collect_if_due() == 2:
            gc.freeze()


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Wait for threads of windows: Python aborts if it ends while one of them loads a module."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["changed_texts"] = dict(golden.CHANGED)
    if (background := sys.modules.get("study_app.gui.widgets.background")) is not None:
        background.wait_for_jobs(60)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Add the changed texts of a worker process."""
    golden.CHANGED.update(getattr(node, "workeroutput", {}).get("changed_texts", {}))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print each text that ``--regenerate`` changed, and why a test ran again."""
    if golden.CHANGED:
        terminalreporter.section(
            "texts that recordings no longer have (-) and have now (+), with their places", sep="-"
        )
        for text, count in sorted(golden.CHANGED.items(), key=lambda item: (item[0][2:], item[0])):
            terminalreporter.line(f"{text}  ({count})")
    for report in terminalreporter.stats.get("rerun", []):
        terminalreporter.section(f"ran again: {report.nodeid} ({report.when})", sep="-")
        terminalreporter.line(report.longreprtext)


_settings = itertools.count()


@pytest.fixture(autouse=True)
def settings_of_nobody(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep tests away from the settings of this machine's user; the folder is created with the first setting."""
    settings = tmp_path_factory.getbasetemp() / f"settings-{next(_settings)}"
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(settings))
    monkeypatch.setenv("LIQUID_STUDY_DATA", str(settings.with_name(f"{settings.name}-data")))


@pytest.fixture(scope="session")
def rehearsal_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return a function that rehearses a shipped study with two participants and seed 1, once for all tests."""
    from study_app.session.simulated.rehearsal import rehearse
    from tests.studies import once

    def rehearsal_of(name: str) -> Path:
        def make(folder: Path) -> None:
            said: list[str] = []
            assert rehearse(name, participants=2, seed=1, results=folder / name, progress=said.append) == folder / name
            assert [line[:4] for line in said] == ["P001", "P002"]

        return once(tmp_path_factory, f"rehearsal-{name}", make) / name

    return rehearsal_of


@pytest.fixture(scope="module")
def quick_pdf() -> Iterator[None]:
    """Embed the fonts of PDF figures as type 3 (`quick_pdfs`)."""
    from tests.studies import quick_pdfs

    with quick_pdfs():
        yield


@pytest.fixture(scope="session")
def dask_cluster() -> Iterator[str]:
    """Return the address of a Dask cluster of two worker processes."""
    from tests.workers.local_cluster import INSTALLED, MISSING, local_cluster

    if not INSTALLED:
        pytest.skip(MISSING)
    with local_cluster() as (address, _):
        yield address


@pytest.fixture
def worker_options(request: pytest.FixtureRequest) -> tuple[tuple[str, str], ...]:
    """Return worker options that must not change a result: one worker, two, and a cluster if possible."""
    from tests.workers.local_cluster import INSTALLED

    here = (("--workers", "1"), ("--workers", "2"))
    return (*here, ("--cluster", request.getfixturevalue("dask_cluster"))) if INSTALLED else here


@pytest.fixture
def all_workers(worker_options: tuple[tuple[str, str], ...]) -> tuple[Workers, ...]:
    """Return the workers of these options."""
    return tuple(Workers(cluster=it) if name == "--cluster" else Workers(int(it)) for name, it in worker_options)


@pytest.fixture(autouse=True)
def no_unexpected_log(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """Fail on a warning in the log."""
    yield
    unexpected = [
        record.getMessage()
        for when in ("setup", "call")
        for record in caplog.get_records(when)
        if record.levelno >= logging.WARNING
    ]
    assert not unexpected, unexpected


@pytest.fixture(autouse=True)
def no_window_left() -> Iterator[None]:
    """Fail if a test leaves a window on the screen, and close it before the next test."""
    yield
    widgets = sys.modules.get("PySide6.QtWidgets")
    if widgets is None or not isinstance(widgets.QApplication.instance(), widgets.QApplication):
        return
    left = [widget for widget in widgets.QApplication.topLevelWidgets() if widget.isVisible()]
    named = [f"{type(widget).__name__} {widget.windowTitle()!r}" for widget in left]
    for widget in left:
        widget.hide()
    assert not named, f"left on the screen: {', '.join(named)}"


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return a folder that packages with plug-ins can be installed into."""
    from tests.plug_in_packages import forget_plug_ins  # loads the model of studies, which most tests need not

    folder = tmp_path / "packages"
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    forget_plug_ins()
    yield folder
    forget_plug_ins("toy_")
