"""Trials: studies whose edits are tried without writing their text."""

from pathlib import Path

import pytest

from study_app.authoring.edited_study import read
from study_app.authoring.writer.edits import Duplicate, Edit, Insert, Move, Rename, Set, Unset
from study_app.authoring.writer.refused import Refused
from tests.authoring.grown import PROTOCOLS

pytestmark = pytest.mark.slow

BLOCK = ("blocks", "delays", "conditions")
EDITS: tuple[Edit, ...] = (
    Set(("conditions", "water", "delay_ms"), 5000),
    Duplicate(("conditions", "water"), "sea"),
    Insert((*BLOCK, 1), "sea"),
    Move((*BLOCK, 1), 3),
    Rename(("conditions", "delay_50"), "late", ((*BLOCK, 1),)),
    Unset((*BLOCK, 4)),
    Set(("liquids", "brine"), {"density_kg_m3": 1200, "effects": ["drag"], "wake": {"length": 40}}),
    Unset(("study", "title")),
)


def test_a_trial_has_the_document_and_the_faults_of_the_text() -> None:
    study = read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)
    tried = study.trial
    for edit in EDITS:
        written, (tried, _) = study.edited(edit)[0], tried.edited(edit)
        assert tried.document == written.document
        assert tried.faults == written.faults
        study = written
    assert study.faults


def test_the_study_before_keeps_its_document() -> None:
    study = read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)
    before = repr(study.document)
    study.trial.edited(*EDITS)
    study.edited(*EDITS)
    assert repr(study.document) == before


def test_an_edit_that_makes_no_sense_is_refused_and_so_is_a_text_that_is_not_toml() -> None:
    study = read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)
    with pytest.raises(Refused):
        study.trial.edited(Unset(("liquids", "tar")))
    with pytest.raises(Refused):
        _ = study.typed("[")[0].trial


def test_liquid_files_stay_known(tmp_path: Path) -> None:
    (tmp_path / "thick.toml").write_text("[liquids.any]\ndensity_kg_m3 = 1400\n")
    own = '[liquids.thick]\ndensity_kg_m3 = 1400\neffects = ["drag"]'
    text = (PROTOCOLS / "demo.toml").read_text().replace(own, '[liquids.thick]\nfile = "thick.toml"')
    trial = read(text.encode(), tmp_path).trial.edited(Set(("study", "title"), "Other"))[0]
    assert trial.faults == ()
    assert trial.document["liquids"]["thick"] == {"file": "thick.toml"}
    assert set(trial.document) == set(read(text.encode(), tmp_path).document)
