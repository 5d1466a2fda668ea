"""Sites of one protocol, and a study merged from them."""

from pathlib import Path

import pytest

from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.sites.merge import merge
from tests.studies import made_up


@pytest.fixture(scope="module")
def labs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the folders of three sites, each with its own key; do not change them."""
    root = tmp_path_factory.mktemp("labs")
    felt = made_up("demo")
    return {
        site: rehearse_answers("demo", participants=2, seed=seed, results=root / site / "demo", features=felt)
        for seed, site in enumerate("ABC", start=1)
    }


@pytest.fixture
def pooled(labs: dict[str, Path], results: Path) -> Path:
    """Return a merged study of sites A and B."""
    merge({site: labs[site] for site in "AB"}, results / "pooled")
    return results / "pooled"


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the results folder of the workspace."""
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    return tmp_path / "results"
