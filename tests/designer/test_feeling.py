""" "Feel it": from the form to the lab with unsaved values, and back into the study as one step."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QApplication

from study_app.app.main_controller import MainController
from study_app.designer.document.toml_edits import Set
from study_app.protocol.source.files import shipped_file
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo]

OPENS_MS = 60_000


@pytest.fixture
def visit(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[MainController]:
    """Yield the main controller, with a copy of the demo open in the designer."""
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    file = tmp_path / "protocols" / "kitchen.toml"
    file.parent.mkdir()
    file.write_bytes(shipped_file("demo").read_bytes().replace(b'name = "demo"', b'name = "kitchen"'))
    main = MainController(tmp_path / "results")
    main.window.resize(1600, 1000)
    main.window.show()
    main.open_designer("kitchen")
    qtbot.waitUntil(lambda: main.designer is not None and main.designer.editing.opened is not None, timeout=OPENS_MS)
    yield main
    main.window.close()
    main.end()
    assert main.designer is not None
    main.designer.deleteLater()
    main.window.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def feel(qtbot: Any, visit: MainController, *path: str) -> Any:
    """Select an element, press its button, and return the lab once it presents the liquid."""
    assert visit.designer is not None
    visit.designer.editing.select(path)
    head = visit.designer.place.form.head
    qtbot.mouseClick(head.feel, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: visit.lab is not None and visit.lab.live is not None, timeout=OPENS_MS)
    assert visit.window.here == "lab"
    return visit.lab


def test_a_liquid_is_felt_with_unsaved_values_and_put_back_as_one_step(qtbot: Any, visit: MainController) -> None:
    assert visit.designer is not None
    editing = visit.designer.editing
    assert editing.opened is not None
    saved = editing.opened.file.read_bytes()
    editing.make_step("Denser", Set(("liquids", "thick", "density_kg_m3"), 1500))
    assert visit.designer.place.form.head.feel.isHidden()  # the first step is a page
    lab = feel(qtbot, visit, "liquids", "thick")
    assert visit.designer.place.form.head.feel.accessibleName() == "Feel Thick"
    assert (lab.bench.a.name, lab.bench.a.value("liquid.density_kg_m3")) == ("Thick", 1500)
    lab.place.ask("change", "liquid.density_kg_m3", 1234.5, False)
    lab.place.ask("change", "effects.added_mass", "on", False)
    qtbot.waitUntil(lambda: lab.place.view.workbench == lab.bench)
    assert lab.place.form.back.isVisible()
    steps = len(editing.opened.done)
    qtbot.mouseClick(lab.place.form.back, Qt.MouseButton.LeftButton)
    assert visit.window.here == "designer"
    assert editing.selected == ("liquids", "thick")
    assert [step.title for step in editing.opened.done[steps:]] == ["Put Thick back from the lab"]
    liquid = editing.opened.study.document["liquids"]["thick"]
    assert liquid["density_kg_m3"] == 1234.5
    assert set(liquid["effects"]) == {"drag", "added_mass"}
    assert "density_kg_m3 = 1000         # Density [kg/m³]." in editing.opened.study.text
    assert editing.opened.study.protocol is not None
    assert editing.opened.study.protocol.scene_of("thick").liquids[0] == lab.bench.a.scene.liquids[0]
    assert editing.opened.file.read_bytes() == saved
    editing.undo()
    assert editing.opened.study.document["liquids"]["thick"]["density_kg_m3"] == 1500


def test_a_block_is_felt_as_two_liquids_and_each_goes_back_to_its_own(qtbot: Any, visit: MainController) -> None:
    lab = feel(qtbot, visit, "blocks", "liquids")
    assert visit.designer is not None
    assert (lab.bench.a.name, lab.bench.b.name) == ("Thin", "Thick")
    lab.place.ask("switch")
    lab.place.ask("change", "liquid.density_kg_m3", 1700.0, False)
    qtbot.waitUntil(lambda: lab.place.view.workbench.presented == "B" and lab.place.view.workbench.b.is_edited)
    qtbot.mouseClick(lab.place.form.back, Qt.MouseButton.LeftButton)
    assert visit.designer.editing.opened is not None
    liquids = visit.designer.editing.opened.study.document["liquids"]
    assert (liquids["thin"]["density_kg_m3"], liquids["thick"]["density_kg_m3"]) == (1000, 1700)


def test_a_study_that_ships_is_felt_and_takes_nothing_back(qtbot: Any, visit: MainController) -> None:
    visit.open_designer("rek2024")
    lab = feel(qtbot, visit, "conditions", "honey")
    assert lab.bench.a.name == "Honey"
    qtbot.waitUntil(lambda: lab.place.view is not None and lab.place.view.workbench == lab.bench)
    assert not lab.place.form.back.isVisible()


def test_the_lab_puts_nothing_back_once_another_study_is_open(qtbot: Any, visit: MainController) -> None:
    lab = feel(qtbot, visit, "liquids", "thick")
    qtbot.waitUntil(lab.place.form.back.isVisible)
    visit.open_designer("demo")
    visit.window.go("lab")
    qtbot.waitUntil(lambda: not lab.place.form.back.isVisible(), timeout=OPENS_MS)


def test_home_shows_saved_and_kept_studies_and_a_signal_ends_playing(visit: MainController) -> None:
    events: list[object] = []
    visit.window.place("home").show_studies = lambda: events.append("shown")  # type: ignore[attr-defined]
    assert visit.designer is not None
    assert visit.playing is not None
    visit.playing.end_by_signal = events.append  # type: ignore[method-assign]
    visit.designer.saving.saved.emit(visit.results)
    visit.playing.kept.emit(visit.results)
    visit.end_by_signal(15)
    assert events == ["shown", "shown", 15]
