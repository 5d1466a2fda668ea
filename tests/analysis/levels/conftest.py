"""A rehearsed study with a block of every reply: choices, a rating, numbers, and conditions that are compared."""

import shutil
from pathlib import Path

import pytest

from study_app.analysis.report.write_report import report
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.unblinding import unblind
from tests.analysis.levels.level_studies import ADAPTIVE, levels_file
from tests.protocol.trials.level_studies import text_of_damper
from tests.studies import made_up, once, quick_pdfs


@pytest.fixture(scope="session")
def opened_adaptive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an unblinded study of up–down tracks at two standards and of QUEST+ at one."""

    def make(folder: Path) -> None:
        (folder / "adaptive.toml").write_text(
            text_of_damper("adaptive", ADAPTIVE, (4, 8)), encoding="utf-8", newline="\n"
        )
        study = rehearse_answers(
            folder / "adaptive.toml", participants=3, seed=1, results=folder / "study", features={}
        )
        assert unblind(study, "AB", "to analyse").left == ()

    return once(tmp_path_factory, "adaptive", make) / "study"


@pytest.fixture(scope="session")
def reported_adaptive(opened_adaptive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    with quick_pdfs():
        return once(tmp_path_factory, "reported-adaptive", lambda to: report(opened_adaptive, to, failed=pytest.fail))


@pytest.fixture(scope="session")
def opened_catch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the study of adaptive tracks with catch trials, answered without servo, its key open."""
    folder = tmp_path_factory.mktemp("catch")
    more = ADAPTIVE.replace('method = "', 'catch = { share = 0.2, wrong_most = 1 }\nmethod = "').replace("24", "48")
    (folder / "catch.toml").write_text(text_of_damper("catch", more, (4, 8)), encoding="utf-8", newline="\n")
    study = rehearse_answers(folder / "catch.toml", participants=2, seed=1, results=folder / "study", features={})
    assert unblind(study, "AB", "to analyse").left == ()
    return study


@pytest.fixture(scope="session")
def sealed_levels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    def make(folder: Path) -> None:
        file = levels_file(folder)
        rehearse_answers(file, participants=3, seed=2, results=folder / "study", features=made_up(str(file)))

    return once(tmp_path_factory, "levels", make) / "study"


@pytest.fixture(scope="session")
def opened_levels(sealed_levels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("opened") / "study"
    shutil.copytree(sealed_levels, folder)
    assert unblind(folder, "AB", "to analyse").left == ()
    return folder


@pytest.fixture(scope="session")
def reported_levels(opened_levels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    with quick_pdfs():
        return once(tmp_path_factory, "reported-levels", lambda to: report(opened_levels, to, failed=pytest.fail))
