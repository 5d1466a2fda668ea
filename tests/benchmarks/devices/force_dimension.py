"""Lateness with Force Dimension's driver: python tests/benchmarks/devices/force_dimension.py [SECONDS] prints a table.

The servo at 1 kHz in honey on the scripted hand, on the emulated device, and on the stand-in library (where a C
compiler is installed), in one run, twice: the computer's load enters all of them.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from study_app.devices.registry import open_device
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load

SOURCE = Path(__file__).parents[2] / "devices" / "force_dimension" / "standin.c"
POLL_S = 0.25


def main(seconds: float) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        devices: list[tuple[str, dict[str, Any]]] = [("scripted", {}), ("force-dimension-emulated", {})]
        if compiler := shutil.which("cc"):
            library = Path(folder) / "libdrd.so"
            options = ["-D_POSIX_C_SOURCE=199309L", "-shared", "-fPIC", "-o", library]
            subprocess.run([compiler, *options, SOURCE, "-lm"], check=True)
            devices.append(("force-dimension", {"options": {"dhd-library": str(library)}}))
        print(f"{'device':<26}lateness p50 / p99 [us]   ticks with a new position")
        for name, how in devices * 2:
            with open_device(name, **how) as device, Servo(device) as servo:
                servo.load(load("rek2024").scene_for("honey"))
                time.sleep(POLL_S)
                reader = servo.telemetry.reader()
                reader.read()
                kept = []
                for _ in range(max(round(seconds / POLL_S), 1)):
                    time.sleep(POLL_S)
                    kept.append(np.asarray(reader.read()).copy())
            samples = np.concatenate(kept)
            middle, late = np.percentile(1e-3 * samples["lateness_ns"], [50, 99])
            print(f"{device.name:<26}{middle:10.0f} / {late:<10.0f}   {100 * samples['fresh'].mean():.1f} %")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 4.0)
