"""Finished cases of an interrupted computation: stored, reused, and removed when the computation ends."""

import logging
import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from study_app.workers import kept_cases
from study_app.workers.kept_cases import OLD_S, KeptCases
from study_app.workers.processes import CancellingExecutor
from tests.workers.worker_cases import counted_draw, draw

pytestmark = pytest.mark.slow


class Threads(CancellingExecutor):
    """One thread in place of processes."""

    workers = 1

    def __init__(self) -> None:
        self._executor = ThreadPoolExecutor(1)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        return self._executor.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._executor.shutdown(wait, cancel_futures=cancel_futures)


@pytest.fixture
def computed(tmp_path: Path) -> Path:
    folder = tmp_path / "computed"
    folder.mkdir()
    return folder


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "cases"


def compute(store: Path, computed: Path, seeds: range, stop_after: int | None = None) -> KeptCases:
    """Compute seeds in their order; the first ``stop_after`` are finished when the computation is interrupted."""
    kept = KeptCases(Threads(), store)
    try:
        with kept:
            many = len(seeds) if stop_after is None else stop_after
            found = [kept.submit(partial(counted_draw, computed), seed).result() for seed in seeds[:many]]
            if stop_after is not None:
                interrupt()
            assert found == [draw(seed) for seed in seeds]
    except KeyboardInterrupt:
        assert stop_after is not None
    return kept


def interrupt() -> None:
    raise KeyboardInterrupt


def times(computed: Path) -> dict[int, int]:
    """Return how often each seed was computed."""
    return {int(path.name): len(path.read_text().splitlines()) for path in computed.iterdir()}


def files(store: Path) -> list[Path]:
    return sorted(store.rglob("*.cases"))


def test_an_interrupted_computation_continues_with_what_was_finished(store: Path, computed: Path) -> None:
    first = compute(store, computed, range(10), stop_after=4)
    assert (first.reused, first.stored) == (0, 4)
    second = compute(store, computed, range(10), stop_after=7)
    assert (second.reused, second.stored) == (4, 7)
    last = compute(store, computed, range(10))
    assert (last.reused, last.stored) == (7, 10)
    assert times(computed) == dict.fromkeys(range(10), 1)
    assert files(store) == []


def test_a_computation_that_ended_is_computed_again(store: Path, computed: Path) -> None:
    for _ in range(2):
        assert compute(store, computed, range(3)).reused == 0
    assert times(computed) == dict.fromkeys(range(3), 2)


def test_the_end_of_another_computation_removes_nothing(store: Path, computed: Path) -> None:
    compute(store, computed, range(10), stop_after=4)
    assert compute(store, computed, range(100, 103)).reused == 0
    assert compute(store, computed, range(10)).reused == 4


@pytest.mark.parametrize("cut", [1, 30, 50])
def test_a_file_that_was_cut_is_used_as_far_as_it_is_whole(store: Path, computed: Path, cut: int) -> None:
    compute(store, computed, range(10), stop_after=4)
    (file,) = files(store)
    file.write_bytes(file.read_bytes()[:-cut])
    assert compute(store, computed, range(10)).reused == 3


def test_a_changed_byte_is_not_believed(store: Path, computed: Path) -> None:
    compute(store, computed, range(10), stop_after=1)
    (file,) = files(store)
    content = bytearray(file.read_bytes())
    content[-3] ^= 1
    file.write_bytes(content)
    assert compute(store, computed, range(10)).reused == 0


def test_another_program_or_library_has_other_cases(
    store: Path, computed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute(store, computed, range(10), stop_after=4)
    monkeypatch.setattr(kept_cases, "environment_digest", lambda: "another")
    assert compute(store, computed, range(10)).reused == 0
    assert len(files(store)) == 1


def test_other_arguments_are_another_case(store: Path, computed: Path, tmp_path: Path) -> None:
    compute(store, computed, range(4), stop_after=4)
    assert compute(store, tmp_path, range(4)).reused == 0


def test_a_case_is_the_same_with_other_hashes() -> None:
    """A protocol holds sets of names, whose order differs from one start to the next."""
    program = (
        "from study_app.protocol.load import load; from study_app.workers.kept_cases import _key_of;"
        "print(_key_of((load('viscosityjnd'), frozenset('abc'))).hex(), list(set('abcdefgh')))"
    )
    keys, orders = zip(
        *(
            subprocess.run(
                [sys.executable, "-c", program],
                capture_output=True,
                text=True,
                check=True,
                cwd=Path(__file__).parents[2],
                env={**os.environ, "PYTHONHASHSEED": seed},
            ).stdout.split(maxsplit=1)
            for seed in ("1", "2")
        ),
        strict=True,
    )
    assert orders[0] != orders[1]
    assert keys[0] == keys[1]


def test_cases_that_nothing_asked_for_in_a_month_are_removed(store: Path, computed: Path) -> None:
    compute(store, computed, range(4), stop_after=4)
    (file,) = files(store)
    for path in (file, file.parent):
        os.utime(path, (time.time() - OLD_S - 60,) * 2)
    assert compute(store, computed, range(4)).reused == 0
    assert not file.exists()


def test_without_a_folder_that_can_be_written_the_cases_are_computed(
    store: Path, computed: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store.write_text("a file")
    with caplog.at_level(logging.CRITICAL, "study_app.workers.kept_cases"):
        assert compute(store, computed, range(4)).stored == 0
    assert times(computed) == dict.fromkeys(range(4), 1)
