"""A rehearsed study with a block of every reply: choices, a rating, numbers, and conditions that are compared."""

import shutil
from pathlib import Path

import pytest

from study_app.analysis.report.write_report import report
from study_app.protocol.forms.simulated_observer import NO_FEATURES
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.unblinding import unblind
from tests.protocol.trials.level_studies import FIVE_POINTS, SHORT, text_of, text_of_damper
from tests.studies import once, quick_pdfs

MORE = """
[stimuli.around]
condition = "oil"
vary = "viscosity_pa_s"
level = "value"
standards = [2]
levels = [0.5, 8]

[designs.numbered]
kind = "estimation"
modulus = { level = 2, number = 10 }

[methods.five]
kind = "constant"
levels = [0.5, 2, 8]
repetitions = 2

[blocks.detect]
task = "stir"
stimulus = "viscosity"
standards = [1]
design = "yesno"
method = "few"

[blocks.rate]
task = "stir"
stimulus = "value"
design = "rated"
method = "five"

[blocks.number]
task = "stir"
stimulus = "value"
design = "numbered"
method = "five"

[blocks.equal]
task = "stir"
stimulus = "around"
design = "2ifc"
method = "five"

[blocks.odd]
task = "stir"
stimulus = "around"
design = "oddity"
method = "five"

[blocks.pairs]
task = "stir"
design = "2ifc"
conditions = ["oil", "other", "late"]
standard = "oil"
repetitions = 4
"""
SEQUENCE = ('sequence = ["viscosity"]', 'sequence = ["viscosity", "detect", "rate", "number", "equal", "odd", "pairs"]')
ADAPTIVE = """
[methods.steps]
kind = "updown"
tracks = 2
trials = 24
step_up = 2

[methods.quest]
kind = "questplus"
trials = 9

[blocks.staircase]
stimulus = "damping"
design = "2ifc"
method = "steps"

[blocks.quest]
stimulus = "damping"
standards = [8]
design = "3ifc"
method = "quest"

[[analysis.published]]
block = "staircase"
measure = "weber"
value = 0.1917
percent = 71
n = 10
source = "Jones et al. 1997"
"""


@pytest.fixture(scope="session")
def opened_adaptive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of up–down tracks at two standards and of QUEST+ at one, its key open."""

    def make(folder: Path) -> None:
        (folder / "adaptive.toml").write_text(text_of_damper("adaptive", ADAPTIVE, (4, 8)))
        study = rehearse_answers(folder / "adaptive.toml", participants=3, seed=1, results=folder / "study", felt={})
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
    (folder / "catch.toml").write_text(text_of_damper("catch", more, (4, 8)))
    study = rehearse_answers(folder / "catch.toml", participants=2, seed=1, results=folder / "study", felt={})
    assert unblind(study, "AB", "to analyse").left == ()
    return study


@pytest.fixture(scope="session")
def sealed_levels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    def make(folder: Path) -> None:
        (folder / "levels.toml").write_text(text_of(SEQUENCE, *SHORT, more=FIVE_POINTS + MORE))
        felt = {("pairs", name): (NO_FEATURES,) for name in ("oil", "other", "late")}
        rehearse_answers(folder / "levels.toml", participants=3, seed=2, results=folder / "study", felt=felt)

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
