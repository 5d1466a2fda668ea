"""Size and start of the bundle against Python with its libraries as pip installs them, which is Briefcase's layout.

Both start by turns; of each command the least time of a core and the least time in all are printed, since other
programs only add to them. Run by itself, with an environment that has the extra ``analysis``:

    python tests/benchmarks/windows/bundle_start.py [dist/liquid-study]
"""

import argparse
import os
import re
import resource
import subprocess
import sys
import sysconfig
import tempfile
import time
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
ROUNDS = 3
STARTS = {
    "--version": ["--version"],
    "check demo": ["check", "demo"],
    "modules of a session's windows": [
        "-c",
        "from study_app.app.session.live_session import load_windows; load_windows()",
    ],
}


def distributions(names: list[str]) -> set[str]:
    """Return the names of distributions and of all that they need here."""
    included: set[str] = set()
    while names:
        name = names.pop().lower().replace("_", "-")
        if name in included:
            continue
        try:
            needed = distribution(name).requires or []
        except PackageNotFoundError:  # of another system
            continue
        included.add(name)
        names += [re.match(r"[\w.-]+", line).group() for line in needed if "extra ==" not in line]  # type: ignore[union-attr]
    return included


def requirements() -> list[str]:
    """Return the requirements of the program and its extra ``analysis``."""
    import tomllib

    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    lines = (*project["dependencies"], *project["optional-dependencies"]["analysis"])
    return [re.match(r"[\w.-]+", line).group() for line in lines]  # type: ignore[union-attr]


def plain_bytes() -> int:
    """Return the size of Python's library, and of all distributions that the program needs."""
    files = {
        Path(str(file.locate())) for name in distributions(requirements()) for file in distribution(name).files or []
    }
    own = (ROOT / "study_app").rglob("*.py")
    library = Path(sysconfig.get_path("stdlib"))
    python = [path for path in library.rglob("*") if not {"site-packages", "test", "__pycache__"} & set(path.parts)]
    return sum(path.stat().st_size for path in (*files, *own, *python) if path.is_file())


def run_timed(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Run a command; return its time of a core and its time in all [s]."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL, cwd=ROOT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    core_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return core_s, time.perf_counter() - began


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=Path, nargs="?", default=ROOT / "dist" / "liquid-study")
    bundle = parser.parse_args().bundle
    in_bundle = sum(path.stat().st_size for path in bundle.rglob("*") if path.is_file())
    print(f"{'':<34}{'bundle':>20}{'Python and libraries':>24}")
    print(f"{'installed':<34}{in_bundle / 1e6:>17.0f} MB{plain_bytes() / 1e6:>21.0f} MB")
    with tempfile.TemporaryDirectory() as folder:
        own = {"LIQUID_STUDY_CONFIG": folder, "LIQUID_STUDY_WORKSPACE": folder, "NUMBA_CPU_NAME": "generic"}
        environment = os.environ | own | {"QT_QPA_PLATFORM": "offscreen"}
        for title, words in STARTS.items():
            plain = [sys.executable, *words] if words[0] == "-c" else [sys.executable, "-m", "study_app", *words]
            times = [
                (run_timed([str(bundle / "liquid-study"), *words], environment), run_timed(plain, environment))
                for _ in range(ROUNDS)
            ]
            cells = [
                f"{min(core for core, _ in of):.2f} s ({min(whole for _, whole in of):.2f} s)"
                for of in zip(*times, strict=True)
            ]
            print(f"{title:<34}{cells[0]:>20}{cells[1]:>24}")
    print("\ntime of a core (time in all)")


if __name__ == "__main__":
    main()
