"""Make the one-folder program: no Python is needed where it runs, and its force model is compiled already.

    python packaging/bundle.py [--to dist]

Needs an environment with the extras ``analysis`` and ``bundle``. Prints the size by library, and of the archive.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections import Counter
from pathlib import Path

from shipped_caches import ship_caches

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
NAME = "liquid-study"
PROGRAM = f"{NAME}.exe" if sys.platform == "win32" else NAME
LARGEST = 14
PRESET = 3
"""Of the xz compression: higher ones take minutes for a few percent."""


def freeze(to: Path, work: Path) -> Path:
    """Let PyInstaller make the folder; return it."""
    words = ["--noconfirm", "--log-level", "ERROR", "--distpath", str(to), "--workpath", str(work)]
    command = [sys.executable, "-m", "PyInstaller", *words, str(HERE / f"{NAME}.spec")]
    subprocess.run(command, check=True, env=os.environ | {"QT_QPA_PLATFORM": "offscreen"})  # the recipe draws the icon
    return to / NAME


def drop_twins(inside: Path) -> int:
    """Remove a package's copy of each shared library that lies in the program's own folder, too; return the bytes.

    A symbolic link is no copy: where the program's own folder has one, the package has the only file.
    """
    saved = 0
    for path in sorted(inside.glob("pyarrow/*")):
        twin = inside / path.name
        if path.is_symlink() or twin.is_symlink() or not (path.is_file() and twin.is_file()):
            continue
        if path.read_bytes() == twin.read_bytes():
            saved += path.stat().st_size
            path.unlink()
    return saved


def sizes(bundle: Path) -> Counter[str]:
    """Return the bytes by library: the folder, or the first part of a shared library's name."""
    inside = bundle / "_internal"
    counted: Counter[str] = Counter()
    for path in bundle.rglob("*"):
        if path.is_file() and not path.is_symlink():
            parts = path.relative_to(inside).parts if path.is_relative_to(inside) else ("program",)
            name = parts[0].removesuffix(".libs") if len(parts) > 1 or parts[0] == "program" else library(parts[0])
            if parts[:2] == ("study_app", "compiled"):
                name = "compile cache"
            counted[name] += path.stat().st_size
    return counted


def library(file: str) -> str:
    """Return to which library a file of the program's own folder belongs."""
    owners = {"libarrow": "pyarrow", "libparquet": "pyarrow", "libQt6": "PySide6", "libicu": "PySide6"}
    owners |= {"libpython": "Python", "python3": "Python", "base_library": "Python", "libpyside": "PySide6"}
    owners |= {"libscipy_openblas64": "numpy", "libscipy_openblas": "scipy"}
    return next((owner for start, owner in owners.items() if file.startswith(start)), "other shared libraries")


def packed(bundle: Path, to: Path) -> Path:
    """Write the archive that is downloaded: zip on Windows, otherwise tar.xz."""
    if sys.platform == "win32":
        archive = to / f"{NAME}.zip"
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as zipped:
            for path in sorted(bundle.rglob("*")):
                zipped.write(path, path.relative_to(to))
        return archive
    archive = to / f"{NAME}.tar.xz"
    with tarfile.open(archive, "w:xz", preset=PRESET) as tar:
        tar.add(bundle, NAME)
    return archive


def main() -> None:
    """Make the folder and its archive, and print their sizes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--to", type=Path, default=ROOT / "dist", help="the folder of both (default: dist)")
    parser.add_argument("--no-archive", action="store_true", help="make the folder alone")
    asked = parser.parse_args()
    to = asked.to.resolve()
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as work:
        bundle = freeze(to, Path(work))
    drop_twins(bundle / "_internal")
    ship_caches(str(bundle / PROGRAM), bundle / "_internal" / "study_app")
    counted = sizes(bundle)
    print("\n| library | MB |\n| --- | --: |")
    shown = counted.most_common(LARGEST)
    for name, size in shown:
        print(f"| {name} | {size / 1e6:.0f} |")
    rest = counted.total() - sum(size for _, size in shown)
    print(f"| others | {rest / 1e6:.0f} |\n| installed | {counted.total() / 1e6:.0f} |")
    if not asked.no_archive:
        archive = packed(bundle, to)
        print(f"| compressed ({archive.name}) | {archive.stat().st_size / 1e6:.0f} |")
    print(f"\n{bundle}, made in {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
