"""A session that cannot be opened: zero force first, and everything that was open is closed."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.app.session import live_session
from study_app.app.session.live_session import LiveSession
from study_app.errors import SessionError
from study_app.gui.theme.theme import LIGHT
from study_app.session.request import NewSession

CHOSEN = NewSession("demo", "P001", 1, 7, "AK", "en", "scripted", True, None, Path("nowhere"))


class Part:
    """Something open that says when it is closed; one that ``fails`` cannot be."""

    def __init__(self, name: str, closed: list[str], *, fails: bool = False) -> None:
        self._name, self._closed, self._fails = name, closed, fails
        self.servo = SimpleNamespace(now_ns=lambda: 0)

    def close(self) -> None:
        self._closed.append(self._name)
        if self._fails:
            raise RuntimeError("a driver's bug")

    stop = close


def refuse(*_: Any, **__: Any) -> Any:
    raise SessionError("the device sends nothing")


@pytest.mark.usefixtures("qapp")
@pytest.mark.parametrize("fails", ["rig", "videos", "outlets", ""])
def test_the_force_is_zero_first_and_a_part_that_fails_leaves_no_other_open(
    monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    closed: list[str] = []
    made: list[object] = []
    parts = {name: Part(name, closed, fails=name == fails) for name in ("rig", "videos", "outlets")}
    for name, value in {
        "load_windows": lambda: None,
        "check": lambda *_: None,
        "study_settings": lambda *_: None,
        "open_rig": lambda *_, **__: parts["rig"],
        "open_outlets": lambda *_: parts["outlets"],
        "videos_of": lambda *_: parts["videos"],
        "measured": refuse,
    }.items():
        monkeypatch.setattr(live_session, name, value)
    session = LiveSession(CHOSEN, LIGHT)
    session._ready.disconnect()
    session._ready.connect(made.append)
    session._make_ready()
    assert closed == ["rig", "videos", "outlets"]
    assert [str(error) for error in made] == ["the device sends nothing"]
