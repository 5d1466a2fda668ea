"""What the first-run check says of a computer."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from study_app.devices.descriptor import NOT_AVAILABLE, READY, Backend
from study_app.gui.preflight.window import OF_THE_COMPUTER, computer_checks
from study_app.haptics.runtime.clocks.grants import Grant
from study_app.session.preflight import Check, Screen
from tests.session import small

FALCON = Backend("falcon", "libusb", "connected: 1", "force")
NO_LIBRARY = Backend("force-dimension", "libdrd", NOT_AVAILABLE, "force", "install it")


def looked(
    devices: list[Backend], cache: Path | None = Path("c"), compiled: int = 0, **changed: Any
) -> dict[str, Check]:
    found = computer_checks(replace(small.WELL, **changed), small.protocol(), devices, cache=cache, compiled=compiled)
    return {check.name: check for check in found}


def test_all_of_a_good_computer_passes_and_nothing_of_a_study_is_judged() -> None:
    found = looked([FALCON])
    assert tuple(found) == (*OF_THE_COMPUTER, "Haptic devices", "Compiled code")
    assert {check.verdict for check in found.values()} == {"ok"}
    assert found["Haptic devices"].value == "falcon"
    assert found["Compiled code"].value == "stored"


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"grant": Grant("normal", "refused", locked=False, advice=("do this",))}, "Priority"),
        ({"screen": Screen(30.0, 1.0)}, "Screen"),
        ({"probe_s": 0.5}, "Results folder"),
        ({"free_bytes": 10**6}, "Free space"),
        ({"devices": [Backend("falcon", "libusb", READY, "force"), NO_LIBRARY]}, "Haptic devices"),
        ({"cache": None}, "Compiled code"),
    ],
)
def test_what_is_not_fit_says_what_to_do(changed: dict[str, Any], name: str) -> None:
    found = looked(**{"devices": [FALCON], **changed})
    assert found[name].verdict != "ok"
    assert found[name].advice
    assert [check.name for check in found.values() if check.verdict != "ok"] == [name]


def test_missing_libraries_and_compiled_functions_are_stated() -> None:
    found = looked([FALCON, NO_LIBRARY], compiled=194)
    assert "force-dimension" in found["Haptic devices"].about
    assert found["Compiled code"].value == "194 functions compiled"
