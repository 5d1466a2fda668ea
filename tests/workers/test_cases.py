"""Executors of cases without processes or a cluster: versions, addresses, greetings and error messages."""

import os
from concurrent.futures import CancelledError
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.errors import WorkerError
from study_app.workers import cases
from study_app.workers.cases import ClusterExecutor
from study_app.workers.executors import Workers, open_executor
from study_app.workers.server import Crashed


@pytest.mark.parametrize(
    ("workers", "kind", "given"),
    [
        (Workers(3), "processes", 3),
        (Workers(), "processes", 5),
        (Workers(0), "processes", 5),
        (Workers(3, cluster="tcp://lab:9"), "cluster", "tcp://lab:9"),
    ],
)
def test_cases_are_computed_by_so_many_processes_or_by_the_cluster(
    monkeypatch: pytest.MonkeyPatch, workers: Workers, kind: str, given: object
) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 5)
    monkeypatch.setattr(cases, "ProcessExecutor", lambda count: ("processes", count))
    monkeypatch.setattr(cases, "ClusterExecutor", lambda address: ("cluster", address))
    assert open_executor(workers) == (kind, given)


@pytest.mark.parametrize(
    ("code", "sentence"),
    [
        (-9, "the process was ended by signal 9"),
        (0, "the process ended with exit code 0; the terminal may show why"),
        (1, "the process ended with exit code 1; the terminal may show why"),
        (None, "the process ended with exit code None; the terminal may show why"),
    ],
)
def test_an_ended_process_is_reported_with_its_signal_or_exit_code(code: int | None, sentence: str) -> None:
    assert Crashed(code).sentence == sentence


def test_a_worker_computes_only_with_the_versions_of_this_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {"Python": "3.11.7", "numpy": "2.1.0", "scipy": "1.14"}
    monkeypatch.setattr(cases, "environment", lambda: versions)
    monkeypatch.setattr("socket.gethostname", lambda: "lab1")
    divided = cases._compute(dict(versions), divmod, (17, 5), {})
    assert divided == (3, 2)
    assert cases._compute(dict(versions), int, ("ff",), {"base": 16}) == 255
    expected = {"Python": "3.12.1", "numpy": "2.1.0", "numba": "0.60"}
    with pytest.raises(WorkerError) as error:
        cases._compute(expected, divmod, (17, 5), {})
    assert str(error.value) == (
        "the worker on lab1 has Python 3.11.7 instead of 3.12.1; numba missing instead of 0.60; scipy 1.14 instead of "
        "missing: install the same versions on every worker, because results could otherwise differ"
    )


@pytest.mark.parametrize(
    ("address", "target", "greets"),
    [
        ("tcp://lab1:8786", ("lab1", 8786), True),
        ("tls://lab1:8786", ("lab1", 8786), False),
        ("tcp://[fe80::1]:99999", ("fe80::1", 99999), True),
    ],
)
def test_a_scheduler_is_greeted_at_its_host_and_port(
    monkeypatch: pytest.MonkeyPatch, address: str, target: tuple[str, int], greets: bool
) -> None:
    class Connection:
        def __enter__(self) -> "Connection":
            return self

        def __exit__(self, *_: object) -> None:
            addresses.append("closed")

    addresses: list[Any] = []
    monkeypatch.setattr(
        "socket.create_connection", lambda place, timeout: addresses.append((place, timeout)) or Connection()
    )
    monkeypatch.setattr(cases, "_receive_greeting", lambda connection: addresses.append(type(connection).__name__))
    cases._check_responds(address)
    assert addresses == [(target, 10.0), *["Connection"] * greets, "closed"]


@pytest.mark.parametrize("address", ["lab1:8786", "http://lab1:8786", "tcp://lab1", "tcp://lab 1:8786", "tcp://:1", ""])
def test_an_invalid_address_is_refused_with_an_example(address: str) -> None:
    with pytest.raises(WorkerError) as error:
        cases._check_responds(address)
    assert str(error.value) == (
        f"{address!r} is not the address of a Dask scheduler: specify tcp://HOST:PORT, such as tcp://lab1:8786"
    )


def test_an_unreachable_scheduler_is_reported_with_address_and_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise ConnectionRefusedError(111, "Connection refused")

    monkeypatch.setattr("socket.create_connection", refuse)
    with pytest.raises(WorkerError, match=r"^no Dask scheduler responds at tcp://lab1:8786 \(Connection refused\):"):
        cases._check_responds("tcp://lab1:8786")


class Pieces:
    """A connection that sends these pieces, each cut to the requested length."""

    def __init__(self, *pieces: bytes) -> None:
        self.pieces = list(pieces)
        self.asked: list[int] = []

    def settimeout(self, seconds: float) -> None:
        assert 0.0 < seconds <= 10.0

    def recv(self, size: int) -> bytes:
        self.asked.append(size)
        return self.pieces.pop(0) if self.pieces else b""


def test_a_greeting_is_as_long_as_its_first_eight_bytes_say() -> None:
    length = (5).to_bytes(8, "little")
    whole: Any = Pieces(length[:3], length[3:], b"he", b"llo")
    cases._receive_greeting(whole)
    assert whole.asked == [8, 5, 5, 3]
    longest: Any = Pieces(((1 << 16) - 8).to_bytes(8, "little"), b"x" * ((1 << 16) - 8))
    cases._receive_greeting(longest)
    for pieces in ((length, b"he"), (((1 << 16) - 7).to_bytes(8, "little"), b"x"), ()):
        other: Any = Pieces(*pieces)
        with pytest.raises(ConnectionError, match="another program is listening there"):
            cases._receive_greeting(other)


class KilledWorker(Exception):
    """Dask's error of a case that ended several workers."""


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (CancelledError(), "the cluster at tcp://lab1:9 is no longer available: restart it, then repeat the command"),
        (
            KilledWorker(),
            "several workers at tcp://lab1:9 failed on the same case: allocate more memory to each worker",
        ),
        (
            ModuleNotFoundError("none", name="study_app.errors"),
            "liquid-study is not installed on the worker at tcp://lab1:9: install this version there",
        ),
        (ModuleNotFoundError("none", name="pandas"), None),
        (ValueError("case 3"), None),
        (None, None),
    ],
)
def test_cluster_errors_are_reported_and_errors_of_a_case_are_raised_unchanged(
    error: Exception | None, sentence: str | None
) -> None:
    ended: list[Any] = []
    executor: Any = SimpleNamespace(address="tcp://lab1:9", shutdown=lambda **options: ended.append(options))
    kind = None if error is None else type(error)
    if sentence is None:
        ClusterExecutor.__exit__(executor, kind, error, None)
    else:
        with pytest.raises(WorkerError) as refusal:
            ClusterExecutor.__exit__(executor, kind, error, None)
        assert (str(refusal.value), refusal.value.__cause__) == (sentence, error)
    assert ended == [{"cancel_futures": error is not None}]
