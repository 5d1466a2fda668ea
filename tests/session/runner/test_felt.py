"""What the hand feels on the real servo and simulated devices, on a virtual clock, as files that people review."""

from functools import partial
from pathlib import Path

import pytest

from study_app.devices.rig import open_rig, study_settings
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import stream
from tests.compiled import needs_servo
from tests.golden import compare
from tests.session.runner.bench import player
from tests.transcripts import played

pytestmark = [needs_servo, pytest.mark.slow]

PLAYED = (
    ("intervals", "scripted"),
    ("intervals", "falcon-emulated"),
    ("settings", "scripted"),
    ("settings", "falcon-emulated"),
    ("small", "scripted"),
)


def rig_of(device: str, protocol: Protocol) -> object:
    return open_rig(device, study_settings(protocol, stream(1, "hand")), clock=VirtualClock())


@pytest.mark.parametrize(("name", "device"), PLAYED)
def test_forces_and_pages_of_a_session_are_as_recorded(name: str, device: str, pytestconfig: pytest.Config) -> None:
    file = Path(__file__).parent / "felt" / f"{name}.txt"
    compare(file, played(file, player(partial(rig_of, device))), pytestconfig)
