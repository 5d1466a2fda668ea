"""An inlet finds a stream by the labels of its channels, on this computer."""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.lab.estimation.sources import LABELS, LslForce
from tests.lab.estimation.measured import WATER, measured, stirring

pylsl = pytest.importorskip("pylsl", reason="pylsl is not installed", exc_type=(ImportError, RuntimeError))

pytestmark = pytest.mark.slow

NAME = "liquid-study-test-force"
WAITS_S = 20.0


def made(labels: tuple[str, ...], name: str, count: int | None = None, kind: str = "double64") -> Any:
    """Return an outlet with labels of its channels, by default as many as there are."""
    info = pylsl.StreamInfo(name, "Force", count or len(labels), 1000.0, kind, name)
    channels = info.desc().append_child("channels")
    for it in labels:
        channels.append_child("channel").append_child_value("label", it)
    return pylsl.StreamOutlet(info)


@pytest.fixture
def outlet() -> Iterator[Any]:
    found = made((*LABELS, "vx_mps", "vy_mps", "vz_mps"), NAME)
    yield found
    del found


def connect(source: LslForce) -> None:
    """Wait until a stream is found; skip the test where none can be."""
    until = time.monotonic() + WAITS_S
    while not source.connected and time.monotonic() < until:
        source.poll()
        time.sleep(0.05)
    if not source.connected:
        pytest.skip("no stream is resolved on this computer: multicast is not permitted here")


def test_rows_come_with_the_times_of_their_stream(outlet: Any) -> None:
    rows = measured(WATER, *stirring(0.2))
    source, until = LslForce(NAME), time.monotonic() + WAITS_S
    connect(source)
    assert outlet.wait_for_consumers(WAITS_S)
    began_s = pylsl.local_clock()
    for k in range(len(rows)):
        sample = np.concatenate([rows.position_m[k], rows.force_n[k], rows.velocity_mps[k]])
        outlet.push_sample(sample.tolist(), began_s + rows.t_s[k])
    found = []
    while sum(map(len, found)) < len(rows) and time.monotonic() < until:
        found.append(source.poll())
        time.sleep(0.01)
    source.close()
    assert np.concatenate([it.t_s for it in found]) == pytest.approx(began_s + rows.t_s, abs=1e-9)
    assert np.array_equal(np.concatenate([it.force_n for it in found]), rows.force_n)
    assert np.array_equal(np.concatenate([it.velocity_mps for it in found]), rows.velocity_mps)


@pytest.mark.parametrize(
    ("labels", "count", "kind"),
    [(("x_m", "y_m"), 2, "double64"), (LABELS, 3, "double64"), (LABELS, len(LABELS), "string")],
    ids=["others", "more labels than channels", "texts"],
)
def test_streams_of_other_channels_are_passed_over(labels: tuple[str, ...], count: int, kind: str) -> None:
    other = made(labels, f"{NAME}-other", count, kind)
    source, until = LslForce(f"{NAME}-other"), time.monotonic() + WAITS_S
    while not source._refused and not source.connected and time.monotonic() < until:
        source.poll()
        time.sleep(0.05)
    assert not source.connected
    if not source._refused:
        pytest.skip("no stream is resolved on this computer: multicast is not permitted here")
    del other


def test_a_stream_that_ends_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    class Ended:
        def pull_chunk(self, **_words: object) -> None:
            raise pylsl.util.LostError("the stream has been lost.")

    source = LslForce(NAME)
    monkeypatch.setattr(source, "_inlet", Ended())
    with pytest.raises(StudyError, match="ended: start it again"):
        source.poll()
