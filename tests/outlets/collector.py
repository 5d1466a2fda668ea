"""Outlets of a session that keep its markers, in place of streams and ports."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from study_app.outlets.markers import Marker
from study_app.session.simulated import rehearsal


class Collector:
    """A stand-in for ``Outlets``; tests set ``lost``."""

    def __init__(self) -> None:
        self.markers: list[Marker] = []
        self.lost: dict[str, str] = {}
        self.described: dict[str, Any] = {}

    def mark(self, marker: Marker) -> None:
        self.markers.append(marker)

    @property
    def events(self) -> list[str]:
        return [marker.event for marker in self.markers]


@contextmanager
def collecting() -> Iterator[Collector]:
    """Collect the markers of sessions that are rehearsed meanwhile."""
    collector = Collector()
    begin = rehearsal.begin_session

    def begun(*given: Any, **named: Any) -> Any:
        store = begin(*given, **named)
        store.attach(collector)
        return store

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rehearsal, "begin_session", begun)
        yield collector
