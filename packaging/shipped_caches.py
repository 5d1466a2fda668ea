"""The compiled force model that a wheel and a bundle come with, for each kind of processor."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from study_app.haptics.kernels.compiled import CHECKSUM, PROCESSORS, checksum_of

FILL_CACHE = Path(__file__).with_name("fill_cache.py")


def ship_caches(python: str, package: Path) -> None:
    """Compile with ``python``, which imports the package from elsewhere or here, into the package's own folder."""
    shipped = package / "compiled"
    shutil.rmtree(shipped, ignore_errors=True)
    for processor in PROCESSORS:
        with tempfile.TemporaryDirectory() as folder:
            own = {"NUMBA_CACHE_DIR": folder, "LIQUID_STUDY_CONFIG": folder, "LIQUID_STUDY_WORKSPACE": folder}
            own |= {"NUMBA_CPU_NAME": processor, "QT_QPA_PLATFORM": "offscreen"}
            command = [python, "-c", FILL_CACHE.read_text("utf-8")]
            subprocess.run(command, check=True, env=os.environ | own)
            (filled,) = [path for path in Path(folder).iterdir() if len(path.name) == 16 and path.is_dir()]
            shutil.copytree(filled, shipped / filled.name)
        (shipped / filled.name / CHECKSUM).write_text(
            checksum_of(shipped / filled.name), encoding="ascii", newline="\n"
        )
