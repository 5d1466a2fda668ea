"""The published contract: the C header describes the servo's records; the template package runs by entry point."""

import ctypes
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from study_app.devices.registry import open_device
from study_app.haptics.model import layout
from tests.compiled import needs_servo
from tests.devices.subjects import until, write
from tests.plug_in_packages import TEMPLATE

SOURCES = Path("src", "liquid_study_example")
COMPILER = shutil.which("cc")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(COMPILER is None, reason="no C compiler ('cc') is installed"),
    pytest.mark.skipif(sys.platform == "win32", reason="the template's stand-in for a maker's library is POSIX"),
]

OFFSETS = """
#include <stddef.h>
#include <stdio.h>
#include "liquid_study_device.h"
#define FIELD(type, name) printf("\\"%s\\": [%zu, %zu]", #name, offsetof(type, name), sizeof(((type *)0)->name))
int main(void) {{
    printf("{{\\"reading\\": {{"); {reading}
    printf("}}, \\"command\\": {{"); {command}
    printf("}}, \\"exchange\\": {{"); {exchange}
    printf("}}, \\"sizes\\": [%zu, %zu]", sizeof(liquid_study_reading), sizeof(liquid_study_command));
    printf(", \\"constants\\": {{");
    {constants}
    printf("}}}}\\n");
    return 0;
}}
"""


def print_statement(names: tuple[str, ...], of: str) -> str:
    return ' printf(", "); '.join(f"FIELD({of}, {name});" for name in names)


def test_header_and_numpy_records_have_the_same_offsets_sizes_and_constants(tmp_path: Path) -> None:
    from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW, READ_NOTHING_NEW

    constants = {
        "CONTRACT_VERSION": layout.CONTRACT_VERSION,
        "READ_NEW": READ_NEW,
        "READ_NOTHING_NEW": READ_NOTHING_NEW,
        "READ_LOST": READ_LOST,
        "BUTTON_STOP": layout.BUTTON_STOP,
        **{name: value for name, value in vars(layout).items() if name.startswith("MEASURED_")},
    }
    from study_app.devices import driver

    names = {"RUNS", "RELEASED", "FINISHED"}
    constants |= {"LOST": driver.FIRST_CAUSE, **{name: getattr(driver, name) for name in sorted(names)}}
    exchange = np.dtype(driver.COMMON, align=True)
    records = {"reading": layout.READING, "command": layout.COMMAND, "exchange": exchange}
    text = OFFSETS.format(
        **{name: print_statement(dtype.names, f"liquid_study_{name}") for name, dtype in records.items()},
        constants=' printf(", "); '.join(f'printf("\\"{name}\\": %d", LIQUID_STUDY_{name});' for name in constants),
    )
    (tmp_path / "offsets.c").write_text(text, encoding="utf-8", newline="\n")
    program = tmp_path / "offsets"
    include = f"-I{TEMPLATE / SOURCES}"
    subprocess.run(
        [COMPILER, "-std=c11", "-Wall", "-Werror", include, program.with_suffix(".c"), "-o", program], check=True
    )
    offsets = json.loads(subprocess.run([program], capture_output=True, text=True, check=True).stdout)
    for name, dtype in records.items():
        assert offsets[name] == {
            field: [dtype.fields[field][1], dtype.fields[field][0].itemsize] for field in dtype.names
        }
    assert offsets["sizes"] == [layout.READING.itemsize, layout.COMMAND.itemsize]
    assert offsets["constants"] == constants


def maker_force_n(loaded: ctypes.CDLL) -> list[float]:
    """Return the force of the motors."""
    force = (ctypes.c_double * 3)()
    loaded.maker_force_now(force)
    return list(force)


def run_in_servo(name: str):
    """Return the samples of honey on a device, the servo's fault and the last force of the motors."""
    from study_app.haptics.runtime.servo import Servo
    from tests.haptics.scenes import HONEY

    with open_device(name) as device:
        from liquid_study_example.driver import library

        servo = Servo(device)
        servo.start()
        servo.load(HONEY)
        reader = servo.telemetry.reader()
        until(lambda: servo.telemetry.written[0] >= 1500 or servo.fault, "the servo does not tick")
        samples = reader.read()
        fault, force_n = servo.fault, maker_force_n(library())
        servo.stop()
        if name == "example-mailbox":  # the force acts at the library's next tick
            until(lambda: maker_force_n(library()) == [0.0, 0.0, 0.0], "the force does not end")
        assert maker_force_n(library()) == [0.0, 0.0, 0.0]
        return samples, fault, force_n


@pytest.mark.usefixtures("template")
class TestTemplate:
    @needs_servo
    @pytest.mark.flaky(reruns=4)  # on a busy machine the library's thread may stand still for longer than 50 ms
    @pytest.mark.parametrize(("name", "delays"), [("example-direct", {0}), ("example-mailbox", {1, 2, 3, 4})])
    def test_runs_in_the_servo_and_ends_in_zero_force(self, name: str, delays: set[int]):
        samples, fault, force_n = run_in_servo(name)
        assert fault is None
        assert np.abs(force_n).max() > 0.0
        own = samples[(samples.fresh == 1) & (samples.scene == samples.scene[-1])][100:]
        assert len(own) > 200
        assert set(own.delay_ticks.tolist()) <= delays
        position_m, velocity_mps = own.position_m, own.device_velocity_mps
        assert np.ptp(position_m[:, 0]) > 0.01  # the maker's y is the hand's x
        assert np.ptp(position_m[:, 1:], axis=0).max() < 1e-3
        moved_mps = np.gradient(position_m[:, 0], own.device_time_ns * 1e-9)
        assert np.percentile(np.abs(moved_mps - velocity_mps[:, 0])[1:-1], 90) < 0.01  # less certain at gaps
        power_w = (own.device_force_n * velocity_mps).sum(axis=1)
        assert power_w.mean() < 0.0

    def test_force_ends_where_the_servo_is_silent(self):
        """The library's own thread continues without the servo: a hang of this program must not hold a force."""
        with open_device("example-mailbox") as device:
            from liquid_study_example.driver import library

            write(device, (1.0, 0.0, 0.0))
            until(lambda: any(maker_force_n(library())), "the force is not sent")
            until(lambda: not any(maker_force_n(library())), "the force goes on")
