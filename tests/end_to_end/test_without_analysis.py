"""Sessions run where the extra ``analysis`` is not installed; what needs it says so in one line."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from study_app.errors import ANALYSIS_LIBRARIES, MissingExtra, naming_the_extra
from tests.compiled import needs_servo

ROOT = Path(__file__).resolve().parents[2]

BLOCK = f"import sys\nsys.modules.update(dict.fromkeys({sorted(ANALYSIS_LIBRARIES)}))\n"
"""None among the modules: an import of it, or of a part of it, fails as that of a missing library."""

PLACES = """
import sys
from pathlib import Path
from PySide6.QtCore import QTimer
from study_app.app.main_controller import run_home_window

def visit_all(visit):
    def step():
        place = visit.results_place
        if place is None or place.view.trouble is None:
            return
        view = place.view
        if not visit.asked:
            visit.asked = True
            place.exclusions.leave_out.click()
            dialog = place.dialog
            dialog.editors["session"].show_value(("P001", 1))
            dialog.editors["by"].show_value("AB")
            dialog.editors["reason"].show_value("asleep")
            dialog.accept()
        if not view.left_out:
            return
        print(view.trouble)
        print(*sorted(session.participant for session in view.sessions))
        print("excluded:", *(session.participant for session in view.left_out))
        visit.window.close()
    visit.asked = False
    for place in ("designer", "lab", "devices", "machine", "home", "results"):
        visit.window.go(place)
        assert visit.window.here == place, place
    visit.timer = QTimer(interval=20)
    visit.timer.timeout.connect(step)
    visit.timer.start()

sys.exit(run_home_window(Path(sys.argv[1]), then=visit_all))
"""


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """Return the environment of processes, also of those that they start, without the libraries."""
    (tmp_path / "blocked").mkdir()
    (tmp_path / "blocked" / "sitecustomize.py").write_text(BLOCK, encoding="utf-8", newline="\n")
    path = os.pathsep.join([str(tmp_path / "blocked"), str(ROOT)])
    own = {"LIQUID_STUDY_WORKSPACE": str(tmp_path), "LIQUID_STUDY_CONFIG": str(tmp_path / "settings")}
    return os.environ | own | {"PYTHONPATH": path, "QT_QPA_PLATFORM": "offscreen"}


def run(environment: dict[str, str], *words: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "study_app", *words]
    process = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False)
    assert process.returncode == code, process.stderr
    return process


@pytest.mark.nightly
@pytest.mark.slow
@needs_servo
def test_a_study_is_rehearsed_verified_and_replayed_without_them(environment: dict[str, str], tmp_path: Path) -> None:
    assert "62 per participant" in run(environment, "check", "rek2024").stdout
    study = tmp_path / "demo"
    run(environment, "rehearse", "demo", "--participants", "1", "--results", str(study))
    assert run(environment, "verify", str(study)).stdout.endswith("1 session: sound\n")
    session = str(study / "data" / "sub-P001" / "ses-01")
    assert "all compared forces are equal" in run(environment, "replay", session).stdout
    assert "reproduced" in run(environment, "reproduce", session).stdout
    assert "demo" in run(environment, "studies").stdout
    for words in (("export", str(study), "--to", "x"), ("report", str(study), "--to", "x"), ("power", "rek2024")):
        failed = run(environment, *words, code=2).stderr
        assert failed.startswith("liquid-study: this needs ")
        assert failed.count("\n") == 1
        assert "pip install 'liquid-study[analysis]'" in failed


@pytest.mark.nightly
@pytest.mark.slow
@needs_servo
def test_every_page_opens_without_the_analysis_libraries_and_results_names_the_extra(
    environment: dict[str, str], tmp_path: Path
) -> None:
    shutil.copytree(ROOT / "tests" / "store" / "releases" / "0.1" / "rek2024", tmp_path / "results" / "rek2024")
    command = [sys.executable, "-c", PLACES, str(tmp_path / "results")]
    process = subprocess.run(
        command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False, timeout=150
    )
    assert process.returncode == 0, process.stderr
    assert "title='Your data are complete', sentence=\"Figures need pandas, which is not installed" in process.stdout
    assert "pip install 'liquid-study[analysis]'" in process.stdout
    assert "P001 P002\nexcluded: P001" in process.stdout


def test_another_missing_module_stays_the_bug_that_it_is() -> None:
    with pytest.raises(ModuleNotFoundError, match="numpy_x"), naming_the_extra():
        raise ModuleNotFoundError("No module named 'numpy_x'", name="numpy_x")
    with pytest.raises(MissingExtra, match="needs scipy"), naming_the_extra():
        raise ModuleNotFoundError("No module named 'scipy.stats'", name="scipy.stats")


def test_the_blocked_libraries_are_the_analysis_extra_and_not_dependencies() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    extra = {Requirement(line).name.lower() for line in project["optional-dependencies"]["analysis"]}
    assert extra == {library.lower() for library in ANALYSIS_LIBRARIES}
    assert not extra & {Requirement(line).name.lower() for line in project["dependencies"]}
    for name in ("test", "cfd", "docs"):
        assert any(line.startswith("liquid-study[analysis") for line in project["optional-dependencies"][name])
