"""Make a wheel for this system and Python that comes with the compiled force model: its first start need not compile.

    python packaging/compiled_wheel.py [--to dist]

Needs an environment with the extra ``bundle``, installed from this folder. The caches fit the versions of numba and
llvmlite installed here; with others, and on other processors, the program compiles at the first start.
"""

import argparse
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from shipped_caches import ship_caches

ROOT = Path(__file__).resolve().parents[1]


def run_python(*words: str | Path) -> None:
    """Run a module of this Python."""
    subprocess.run([sys.executable, "-m", *words], check=True, stdout=subprocess.DEVNULL)


def main() -> None:
    """Make the wheel and print its size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--to", type=Path, default=ROOT / "dist", help="the folder of the wheel (default: dist)")
    to = parser.parse_args().to.resolve()
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    with tempfile.TemporaryDirectory() as folder:
        run_python("build", "--wheel", "--no-isolation", "--outdir", folder, ROOT)
        (plain,) = Path(folder).glob("*.whl")
        run_python("wheel", "unpack", "--dest", folder, plain)
        (unpacked,) = [path for path in Path(folder).iterdir() if path.is_dir()]
        ship_caches(sys.executable, unpacked / "study_app")
        plain.unlink()
        to.mkdir(parents=True, exist_ok=True)
        run_python("wheel", "pack", "--dest-dir", folder, unpacked)
        (packed,) = Path(folder).glob("*.whl")
        tags = ("--python-tag", python, "--abi-tag", "none", "--platform-tag", platform)
        run_python("wheel", "tags", *tags, packed)
        (tagged,) = Path(folder).glob(f"*-{python}-none-*.whl")
        wheel = Path(shutil.copy(tagged, to))
    print(f"{wheel}: {wheel.stat().st_size / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
