"""The examples and notebooks of the documentation run with their stated results."""

import json
import runpy
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.documented import ROOT
from tests.protocol.trials import level_studies

pytestmark = [pytest.mark.slow, needs_servo]

EXAMPLES = ROOT / "docs" / "examples"
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def example(name: str) -> dict[str, Any]:
    """Return the names of an example, which has at most 60 lines."""
    assert len((EXAMPLES / name).read_text(encoding="utf-8").splitlines()) <= 60
    return runpy.run_path(str(EXAMPLES / name))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_from_top_to_bottom(path: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    cells = [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert [cell["outputs"] for cell in cells] == [[]] * len(cells), "outputs are made where the pages are built"
    names: dict[str, Any] = {}
    for cell in cells:
        exec("".join(cell["source"]), names)  # noqa: S102 - a page of this documentation
    assert sum(len(cell["source"]) for cell in cells) <= 60
    if path.stem == "threshold":
        assert names["one"]["low"] < 0.15 < names["one"]["high"]
    if path.stem == "force":
        assert 0.05 < -min(names["forces_n"]) <= 2.0
        assert names["lost"] == 0


@pytest.mark.parametrize(
    "study", ["short", pytest.param("viscosityjnd", marks=[pytest.mark.nightly, pytest.mark.timeout(900)])]
)
def test_an_own_observer_runs_a_session_whose_thresholds_follow_its_noise(tmp_path: Path, study: str) -> None:
    if study == "short":
        study = str(tmp_path / "short.toml")
        Path(study).write_text(level_studies.text_of(*level_studies.SHORT), encoding="utf-8", newline="\n")
    thresholds = example("own_observer.py")["main"](tmp_path / "results", study)
    assert verify_study(tmp_path / "results").errors == ()
    assert len(thresholds) > 0
    if study == "viscosityjnd":
        assert ((thresholds["low"] < 0.2) & (thresholds["high"] > 0.08)).all()


def test_an_own_loop_feels_the_liquid_sixty_times_a_second() -> None:
    samples = example("own_loop.py")["main"](frames=45)
    times_s, places_m, forces_n = (np.array(each) for each in zip(*samples, strict=True))
    assert np.median(np.diff(times_s)) == pytest.approx(1 / 60, rel=0.2)
    assert np.ptp(places_m[:, 0]) > 0.02
    assert 0.05 < np.linalg.norm(forces_n, axis=1).max() <= 2.0
