"""What this machine sends to other programs is printed and changed by a command."""

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import OutletError, StudyError
from study_app.store.workstation import DEFAULTS, MachineSettings, load, save
from study_app.user_folder import settings_file

OFF = ["markers over LSL: off", "samples over LSL: off", "triggers: off"]


def outlets(*words: str) -> list[str]:
    found = CliRunner().invoke(commands, ["outlets", *words], catch_exceptions=False)
    assert found.exit_code == 0
    return found.output.splitlines()


def test_without_options_it_prints_what_is_set_and_writes_nothing() -> None:
    assert outlets() == OFF
    assert not settings_file().exists()


def test_options_are_kept_and_others_stay() -> None:
    save(MachineSettings(viewing_distance_mm=600))
    assert outlets("--markers", "on", "--triggers", "serial:/dev/ttyUSB0") == [
        "markers over LSL: on",
        "samples over LSL: off",
        "triggers: serial:/dev/ttyUSB0",
    ]
    assert outlets("--samples", "single-blind")[1] == "samples over LSL: single-blind"
    assert load() == MachineSettings(
        viewing_distance_mm=600, lsl_markers=True, lsl_samples="single-blind", triggers="serial:/dev/ttyUSB0"
    )
    assert load().marker_addresses == ("lsl", "serial:/dev/ttyUSB0")
    assert outlets("--markers", "off", "--samples", "off", "--triggers", "off") == OFF
    assert load().marker_addresses == ()


@pytest.mark.parametrize("port", ["COM3", "usb:1", "serial:", "lsl", "", "serial:/dev/\x00"])
def test_a_port_that_is_none_is_refused_in_a_line(port: str) -> None:
    with pytest.raises(
        OutletError, match="use one like parallel:/dev/parport0 or serial:/dev/ttyUSB0, or off"
    ) as found:
        CliRunner().invoke(commands, ["outlets", "--triggers", port], catch_exceptions=False)
    assert isinstance(found.value, StudyError)
    assert load() == DEFAULTS
