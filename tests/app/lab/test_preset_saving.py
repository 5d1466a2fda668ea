"""Presets saved from the lab, opened again and used in a study."""

import threading
from pathlib import Path
from typing import Any

import pytest

from study_app.app.lab.controller import LabController
from study_app.app.session.termination import Patience
from study_app.lab.presets import save
from study_app.protocol.load import load, load_scene, source_bytes
from tests.app.lab.worlds import SOON_MS
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]


def test_a_setting_is_saved_as_a_preset_that_is_at_hand_from_then_on(
    felt: LabController, qtbot: Any, tmp_path: Path
) -> None:
    felt.place.changed.emit("liquid.density_kg_m3", 1234.5, False)
    path = tmp_path / "mine.toml"
    asked = felt.bench.in_hand
    felt.place.switched.emit()
    felt.place.save_asked.emit(path, asked)
    qtbot.waitUntil(lambda: any(it.source == str(path) for it in felt.liquids), timeout=SOON_MS)
    assert load_scene(path, "honey") == felt.bench.a.scene
    felt.place.save_asked.emit(tmp_path / "nowhere" / "mine.toml", asked)
    qtbot.waitUntil(lambda: "cannot be written" in felt.view().trouble, timeout=SOON_MS)
    assert felt.live is not None


def test_a_preset_is_saved_opened_again_and_used_in_a_study(felt: LabController, qtbot: Any, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_bytes(source_bytes("demo"))
    felt.place.changed.emit("liquid.density_kg_m3", 1234.5, False)
    felt.place.save_asked.emit(tmp_path / "syrup.toml", felt.bench.in_hand)
    qtbot.waitUntil(lambda: felt.view().said == f"Saved as syrup.toml in {tmp_path}", timeout=SOON_MS)
    felt.place.undo_asked.emit()
    assert felt.bench.in_hand.scene.liquids[0].density_kg_m3 != 1234.5
    felt.place.preset_opened.emit(tmp_path / "syrup.toml")
    assert felt.bench.in_hand.scene.liquids[0].density_kg_m3 == 1234.5
    assert felt.view().said == "Opened syrup.toml: Honey"
    felt.place.use_asked.emit(study, felt.bench.in_hand)
    qtbot.waitUntil(lambda: felt.view().said.startswith("Added to study.toml as [liquids.syrup]"), timeout=SOON_MS)
    assert load(study).scene_of("syrup").liquids[0].density_kg_m3 == 1234.5
    assert sorted(path.name for path in tmp_path.glob("*.toml")) == ["study.toml", "syrup.toml"]
    (tmp_path / "broken.toml").write_text("format = 1")
    felt.place.preset_opened.emit(tmp_path / "broken.toml")
    assert "broken.toml" in felt.view().trouble
    assert felt.live is not None


def test_what_was_refused_is_no_longer_shown_once_a_file_is_written(
    felt: LabController, qtbot: Any, tmp_path: Path
) -> None:
    setting, study = felt.bench.in_hand, tmp_path / "study.toml"
    felt.place.save_asked.emit(tmp_path / "syrup.toml", setting)
    qtbot.waitUntil(lambda: felt.view().said.startswith("Saved as syrup.toml"), timeout=SOON_MS)
    study.write_bytes(source_bytes("demo"))
    for asked, path, said in (
        (felt.place.use_asked, study, "Added to study.toml"),
        (felt.place.save_asked, tmp_path / "again.toml", "Saved as again.toml"),
    ):
        felt.place.use_asked.emit(tmp_path / "syrup.toml", setting)
        qtbot.waitUntil(lambda: "syrup.toml is not a study file" in felt.view().trouble, timeout=SOON_MS)
        asked.emit(path, setting)
        qtbot.waitUntil(lambda said=said: felt.view().said.startswith(said), timeout=SOON_MS)
        assert felt.view().trouble == ""


def test_a_preset_is_on_the_disk_before_the_program_ends(
    visit: LabController, monkeypatch: Any, tmp_path: Path
) -> None:
    ended = threading.Event()

    def slowly(path: Path, text: str) -> None:
        ended.wait(30.0)
        save(path, text)

    monkeypatch.setattr("study_app.app.lab.preset_saving.save", slowly)
    for name in ("one.toml", "two.toml"):
        visit.place.save_asked.emit(tmp_path / name, visit.bench.a)
    assert not list(tmp_path.iterdir())
    threading.Timer(0.05, ended.set).start()
    visit.end(Patience(20.0))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.toml", "two.toml"]
    assert str(tmp_path / "two.toml") in [it.source for it in visit.liquids]
