"""The bundle's own files: its start runs commands and modules, its recipe finds every library, its sizes are sums."""

import os
import runpy
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtGui import QColor, QImage

from study_app import __version__, documentation
from study_app.gui.theme.theme import LIGHT

pytestmark = pytest.mark.slow

PACKAGING = Path(__file__).resolve().parents[2] / "packaging"


def started(*words: str, code: int = 0, send: bytes = b"", **variables: str) -> str:
    environment = os.environ | variables | {"PYTHONPATH": str(PACKAGING.parent)}
    command = [sys.executable, str(PACKAGING / "start.py"), *words]
    process = subprocess.run(command, env=environment, input=send, capture_output=True, check=False, timeout=120)
    assert process.returncode == code, process.stderr
    return process.stdout.decode()


@pytest.fixture
def bundle(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return the functions of packaging/bundle.py."""
    monkeypatch.syspath_prepend(PACKAGING)
    return runpy.run_path(str(PACKAGING / "bundle.py"))


def test_its_start_is_the_commands() -> None:
    assert started("--version").split()[-1] == __version__
    started("check", "nothing-like-this", code=2)


def test_its_start_runs_modules_and_code_as_python_does() -> None:
    """A guard is `sys.executable -P -m`, the load of a timing `-S -c`."""
    guard = "study_app.devices.guard"
    words = ("falcon", "study_app.devices.falcon.transport:end_torque", "falcon:NOWHERE")
    assert started("-P", "-m", guard, *words, send=b"done\n") == "ready\n"
    assert started("-S", "-c", "import sys; print(sys.argv[1:], __name__)", "a") == "['a'] __main__\n"


def test_only_equal_copies_of_a_library_are_dropped_and_links_are_kept(bundle: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "pyarrow").mkdir()
    for name, there, inside in (("same", b"x", b"x"), ("other", b"x", b"y")):
        (tmp_path / name).write_bytes(there)
        (tmp_path / "pyarrow" / name).write_bytes(inside)
    (tmp_path / "pyarrow" / "alone").write_bytes(b"z")
    (tmp_path / "alone").symlink_to("pyarrow/alone")
    (tmp_path / "pyarrow" / "link").symlink_to("../other")
    (tmp_path / "link").write_bytes(b"x")
    assert bundle["drop_twins"](tmp_path) == 1
    assert sorted(path.name for path in (tmp_path / "pyarrow").iterdir()) == ["alone", "link", "other"]
    assert (tmp_path / "alone").read_bytes() == b"z"


@pytest.mark.nightly
@pytest.mark.timeout(3600)
def test_with_the_newest_libraries_it_opens_a_sessions_windows_in_an_empty_root(tmp_path: Path) -> None:
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("an empty root needs Linux and root")
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    pip = [python, "-m", "pip", "install", "--quiet", "--upgrade", "--upgrade-strategy", "eager"]
    if subprocess.run([*pip, "pip"], check=False).returncode:
        pytest.skip("there is no package index here")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    for command in (
        [*pip, f"{PACKAGING.parent}[bundle]"],
        [python, PACKAGING / "bundle.py", "--no-archive", "--to", tmp_path],
        [python, PACKAGING / "try_in_empty_root.py", tmp_path / "liquid-study", "--window"],
    ):
        subprocess.run(command, check=True, env=environment)


@pytest.fixture
def recipe(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, qapp: object) -> dict[str, Any]:
    """Return the options that the recipe passes to PyInstaller's Analysis and EXE."""
    hooks = types.ModuleType("PyInstaller.utils.hooks")
    hooks.copy_metadata = lambda _name: []  # type: ignore[attr-defined]
    for name in ("PyInstaller", "PyInstaller.utils"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    monkeypatch.setitem(sys.modules, hooks.__name__, hooks)
    requests: dict[str, Any] = {}

    def make(*_words: object, **options: Any) -> Any:
        requests.update(options)
        return types.SimpleNamespace(pure=[], scripts=[], binaries=[], datas=requests["datas"])

    globals_given = {"SPECPATH": str(PACKAGING), "workpath": str(tmp_path)}
    runpy.run_path(
        str(PACKAGING / "liquid-study.spec"),
        init_globals=globals_given | dict.fromkeys(("Analysis", "PYZ", "EXE", "COLLECT"), make),
    )
    return requests


def test_the_recipe_contains_the_pages_of_help(recipe: dict[str, Any]) -> None:
    shipped = {(Path(to) / Path(source).name).as_posix() for source, to in recipe["datas"]}
    top = documentation.folder()
    pages = {f"study_app/docs/{path.name}" for path in top.iterdir() if path.suffix in {".md", ".txt"}}
    pages |= {f"study_app/docs/{name}.md" for name in documentation.names()}
    pictures = {f"study_app/docs/pictures/{path.name}" for path in (top / "pictures").iterdir()}
    assert (pages | pictures) - shipped == set()


def test_the_program_for_windows_has_an_icon_and_its_version_and_hides_its_console(recipe: dict[str, Any]) -> None:
    icon = QImage(recipe["icon"])
    assert (icon.width(), icon.height(), icon.pixelColor(0, 0).alpha()) == (256, 256, 0)
    assert icon.pixelColor(128, 20) == QColor(LIGHT.accent)
    version = Path(recipe["version"]).read_text("utf-8")
    assert f"StringStruct('FileVersion', '{__version__}')" in version
    assert f"filevers=({__version__.replace('.', ', ')}, 0)" in version
    assert (recipe["console"], recipe["hide_console"]) == (True, "hide-early")


def test_the_recipe_names_every_library_whose_version_a_receipt_or_a_report_states() -> None:
    from study_app.analysis.report.write_report import LIBRARIES

    recipe = (PACKAGING / "liquid-study.spec").read_text("utf-8")
    assert 'project["optional-dependencies"]["analysis"]' in recipe
    with (PACKAGING.parent / "pyproject.toml").open("rb") as file:
        import tomllib

        project = tomllib.load(file)["project"]
    needed = " ".join((*project["dependencies"], *project["optional-dependencies"]["analysis"])).lower()
    assert [name for name in LIBRARIES if name.lower() not in needed] == []
