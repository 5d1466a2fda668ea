"""The shipped files: the wheel works outside the checkout, and the check runs the README's commands."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the package as in its wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    build = [*pip, "wheel", str(ROOT), "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder)]
    subprocess.run(build, check=True)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", "--no-deps", "--target", str(folder / "site"), str(wheel)], check=True)
    return folder / "site"


def test_the_wheel_contains_the_protocols_and_the_typeface(installed: Path) -> None:
    package = installed / "study_app"
    shipped = {path.name for path in (package / "protocols").glob("*.toml")}
    assert shipped == {path.name for path in (ROOT / "protocols").glob("*.toml")}
    assert list((package / "gui" / "assets" / "fonts").glob("Inter-*"))
    assert (package / "py.typed").is_file()
    limits = "haptics/model/slope_limits.csv"
    assert (package / limits).read_bytes() == (ROOT / "study_app" / limits).read_bytes()


def test_the_wheel_contains_the_fluid_solvers_tables(installed: Path) -> None:
    tables = ROOT / "study_app" / "evidence" / "cfd"
    shipped = {path.name for path in (installed / "study_app" / "evidence" / "cfd").glob("*.csv")}
    assert shipped == {path.name for path in tables.glob("*.csv")} >= {"steady.csv", "fits.csv", "honey-600mmps.csv"}


def test_the_wheel_contains_the_pages_of_the_documentation(installed: Path) -> None:
    pages, shipped = ROOT / "docs", installed / "study_app" / "docs"
    for pattern in ("*.md", "pictures/*"):
        assert {path.name for path in shipped.glob(pattern)} == {path.name for path in pages.glob(pattern)}


def test_check_works_far_from_the_checkout(installed: Path, tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(installed), "PYTHONSAFEPATH": "1"}
    program = "import study_app, sys; print(study_app.__file__); from study_app.cli import main; main()"
    words = [sys.executable, "-c", program, "check", "rek2024"]
    finished = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr
    assert Path(finished.stdout.splitlines()[0]).is_relative_to(installed)
    assert "62 per participant" in finished.stdout


def test_the_check_installs_and_tests_as_the_readme_says() -> None:
    readme, check = (ROOT / "README.md").read_text("utf-8"), (ROOT / ".ci" / "run").read_text("utf-8")
    (line,) = [line for line in readme.splitlines() if "-m pytest" in line and "pip install" in line]
    for command in line.split(" && "):
        assert command.replace("pip install", "pip install --quiet") in check or command in check


def test_each_python_gets_a_qt_that_does_not_end_it() -> None:
    """Versions from 6.10 on lose references to None, which end a program before Python 3.12."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    named = [line.rpartition(" ")[2] for line in project["classifiers"] if "Python :: 3." in line]
    ours = SpecifierSet(project["requires-python"])
    assert [version in ours for version in ("3.10.0", *named)] == [False, *[True] * len(named)]
    for version in named:
        needs = [Requirement(line) for line in project["dependencies"] if line.startswith("PySide6-Essentials")]
        (qt,) = [it for it in needs if it.marker and it.marker.evaluate({"python_version": version})]
        assert ("6.9.3" in qt.specifier, "6.12.0" in qt.specifier) == (True, version != "3.11")
