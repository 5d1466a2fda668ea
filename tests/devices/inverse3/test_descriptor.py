"""The Inverse3 as the program lists it: loaded without a compiler, rehearsed on where it is emulated."""

import pytest

from study_app.devices.descriptor import READY
from study_app.devices.inverse3.failures import FAILURES
from study_app.devices.registry import descriptor_of
from study_app.errors import DeviceNotFound


@pytest.mark.parametrize(
    ("name", "by_itself"), [("inverse3", False), ("inverse3:lab:10001:049D", False), ("inverse3-emulated", True)]
)
def test_descriptor_says_who_moves_the_handle_and_what_examines_it(name: str, by_itself: bool) -> None:
    device = descriptor_of(name)
    assert (device.moves_by_itself, device.simulated) == (by_itself, by_itself)
    assert device.doctor is not None
    assert len(device.doctor.findings()) == len(FAILURES.modes)
    assert not device.motion_shows_force


def test_the_emulated_one_is_ready_and_takes_no_argument() -> None:
    (backend,) = descriptor_of("inverse3-emulated").probe()
    assert backend.state == READY
    with pytest.raises(DeviceNotFound):
        descriptor_of("inverse3-emulated:x")


def test_every_mode_has_a_cause_a_cure_and_a_sentence_in_one_line() -> None:
    assert len({mode.id for mode in FAILURES.modes}) == len(FAILURES.modes)
    for mode in FAILURES.modes:
        assert mode.cause
        assert mode.cure
        assert "\n" not in FAILURES.sentence(mode.id, "seen")
        assert str(FAILURES.failure(mode.id)).startswith("the Inverse3 cannot be used: ")
    assert [one.state for one in FAILURES.findings("no-device", ["no-service"])][:4] == [
        "ok",
        "not checked",
        "not checked",
        "found",
    ]
