"""Compilation in the background: a session that begins meanwhile waits and shows its progress."""

import threading
from collections.abc import Sequence
from typing import Any

import pytest

from study_app.app import compilation
from study_app.app.compilation import Compilation
from study_app.workers.server import Crashed


class Client:
    """A worker process that gives one answer at a time, once the one before it is in ``reported``."""

    def __init__(self, *answers: object, reported: Sequence[float] | None = None) -> None:
        self.remaining_answers, self.sent_answers = list(answers), list[object]()
        self.reported = reported
        self.closed = False

    def answers(self) -> list[tuple[int, object]]:
        waits = self.reported is not None and self.sent_answers and self.sent_answers[-1] not in self.reported
        if waits or not self.remaining_answers:
            return []
        self.sent_answers.append(self.remaining_answers.pop(0))
        return [(1, self.sent_answers[-1])]

    def close(self) -> None:
        self.closed = True


def start_compiling(monkeypatch: pytest.MonkeyPatch, client: Client | None) -> Compilation:
    monkeypatch.setattr(compilation, "start_compilation", lambda: client)
    started = Compilation()
    started.start()
    return started


@pytest.mark.parametrize("last", [None, Crashed(1)])
def test_a_session_waits_until_the_process_ends_and_sees_its_progress(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, last: object
) -> None:
    shares: list[float] = []
    client = Client(0.25, 0.75, last, reported=shares)
    background = start_compiling(monkeypatch, client)
    session = threading.Thread(target=background.wait, args=(shares.append, lambda: False))
    session.start()
    qtbot.waitUntil(lambda: not session.is_alive(), timeout=10_000)
    assert sorted(set(shares) - {0.0}) == [0.25, 0.75]
    assert shares == sorted(shares)
    assert background.share == 0.75
    assert client.closed


def test_a_cancelled_session_waits_no_longer(qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    client = Client()
    background = start_compiling(monkeypatch, client)
    background.wait(lambda _share: None, lambda: True)
    assert not client.closed
    background.close()
    assert client.closed


def test_nothing_is_waited_for_if_all_is_compiled_or_no_process_starts(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    shares: list[float] = []
    start_compiling(monkeypatch, None).wait(shares.append, lambda: False)

    def refuse() -> None:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(compilation, "start_compilation", refuse)
    background = Compilation()
    background.start()
    background.wait(shares.append, lambda: False)
    assert shares == []
    assert "Resource temporarily unavailable" in caplog.text
    caplog.clear()
