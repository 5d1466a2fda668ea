"""The designer's window, compared with reviewed texts: each kind of element in every tab, each field used once."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication, QWidget

from study_app.designer.document.steps import ChangeLanguage, RetypeFile, SetValue
from study_app.protocol.source.document import Path
from tests.designer.document.test_study_transcripts import elements, generic, studies
from tests.designer.support.record import Record, settle
from tests.gui.transcript import CONTROLS, is_usable, told, use
from tests.protocol.edited_studies import text_of

TABS = ("measures", "file", "changes", "participant")
LISTED = ("blocks", "liquids", "conditions")


def one_of_each(document: Any, but: Mapping[str, Any] = MappingProxyType({})) -> list[Path]:
    """Return the first element of each kind, without the kinds that another study has."""
    found: dict[Path, Path] = {}
    for path in elements(document):
        found.setdefault(generic(path), path)
    known = {generic(path) for path in elements(but)} if but else set()
    return [path for kind, path in found.items() if kind not in known and path != ("format",)]


def each_element(record: Record) -> None:
    for path in one_of_each(record.designer.study.document):
        record.select(*path, paints=len(path) > 1 and path[0] in ("blocks", "conditions"))
    record.note("measures", lambda: record.designer.place.show_tab("measures"), paints=True)


def each_tab(record: Record, but: Mapping[str, Any]) -> None:
    place = record.designer.place
    for path in one_of_each(record.designer.study.document, but):
        record.select(*path, paints=path[0] in ("blocks", "stimuli", "liquids"))
        for tab in TABS:
            record.note(f"tab {tab}", lambda tab=tab: place.show_tab(tab), of=place.pane)


def by_keys(record: Record) -> None:
    record.play("ctrl+1 Down Down alt+Down alt+Up ctrl+d ctrl+z ctrl+shift+z ctrl+z F2 'fluids' Return ctrl+2 Tab Tab")
    record.play("ctrl+3 Right ctrl+e ctrl+e alt+Left ctrl+5 F6 shift+F6 ctrl+f 'honey' Escape shift+F1 shift+F1")
    record.play("ctrl+l ctrl+s")


def adding_and_deleting(record: Record) -> None:
    record.play("ctrl+1 Insert 'question' Down Return ctrl+z ctrl+shift+d")
    record.play("@conditions.late ctrl+shift+d '50 100 x' Return Escape")
    record.play("@liquids.thin ctrl+1 Delete Escape Delete Return ctrl+z shift+Down ctrl+d Delete")


def problems(record: Record) -> None:
    text = record.text.replace('liquid = "thick"', 'liquid = "thik"').replace("blinding", "blindin", 1)
    text = text.replace("force_limit_n = 6", "force_limit_n = 60").replace("min_s = 5", 'min_s = "5"')
    record.note("break", lambda: record.designer.editing.handle_request(RetypeFile(text)))
    record.play('ctrl+4 F8 F8 F8 F8 F8 ctrl+4 Tab Tab Return [Use "blinding": Study, Blindin]')
    record.note("no TOML", lambda: record.designer.editing.handle_request(RetypeFile("[study")))
    record.play("F8 ctrl+z ctrl+z")


def new_study(record: Record) -> None:
    record.play("ctrl+n")
    page = record.designer.place.new_page
    for one in page.buttons[:6]:
        record.note(f"choose {one.accessibleName()}", lambda one=one: one.setChecked(True))
    record.note("make", page.card.make.click)
    record.note("title", lambda: page.card.questions.title.setText("Which is thicker?"))
    record.note("make", page.card.make.click)


def on_disk(record: Record) -> None:
    designer = record.designer
    record.note("edit", lambda: designer.editing.handle_request(SetValue(("blocks", "liquids", "repetitions"), 3)))
    record.note("changes", lambda: designer.place.show_tab("changes"))
    designer.change(("rate_hz = 1000", "rate_hz = 900"))
    record.note("changed outside", designer.controller.enter, paints=True)
    record.note("save", designer.saving.save)
    for action in ("compare", "mine", "outside"):
        record.note(f"banner {action}", lambda action=action: designer.place.ask("banner", action))
    designer.file.unlink()
    record.note("deleted outside", designer.controller.enter)
    record.note("open another", lambda: designer.controller.open("rek2024"))
    record.note("open none", lambda: designer.controller.open("nonesuch"))
    record.note("open again", lambda: designer.controller.open("kitchen"))


def series(record: Record) -> None:
    record.note("list one", lambda: record.designer.editing.handle_request(SetValue(LISTED, ["thin"])))
    record.play("@conditions.thin ctrl+shift+d '5000' Return ctrl+a '60 120 240' Return ctrl+z")
    record.play(" ".join(f"@{path} ctrl+shift+d Escape" for path in ("study", "blocks.liquids", "blocks")))


def entries(record: Record) -> None:
    record.select(*LISTED[:2])
    record.note("first entry", record.designer.field(*LISTED).rows[0].setFocus)
    record.play("alt+Down shift+Up alt+Down Delete ctrl+z ctrl+z Return alt+Left")


def finding(record: Record) -> None:
    record.play("ctrl+f 'force limit' Return ctrl+f 'williams' Return ctrl+f 'xyzzy' Escape ctrl+f 'delay' Down Down")
    record.play("Return ctrl+f 'honey' Return Return ctrl+f 'break every' Return space ctrl+z")


def languages(record: Record) -> None:
    record.note("add", lambda: record.designer.editing.handle_request(ChangeLanguage("add", "nl")))
    record.play("@pages.welcome ctrl+l ctrl+4 F8 Return ctrl+z")
    record.note("copy", lambda: record.designer.editing.handle_request(ChangeLanguage("copy", "nl")))
    record.select("pages", "welcome")
    record.note("title", record.designer.field("pages", "welcome", "title").lines["nl"].setFocus)
    record.play("'Een blik' Return ctrl+l ctrl+s @study")
    record.note("remove", lambda: record.designer.editing.handle_request(ChangeLanguage("remove", "nl")))


def small_window(record: Record) -> None:
    record.note("small", lambda: record.designer.window.resize(1024, 640))
    record.play("ctrl+1 Down Down Return ctrl+3 ctrl+3 ctrl+2 ctrl+e ctrl+e ctrl+l F6 ctrl+1 ctrl+f 'honey' Return")
    record.play("Return ctrl+1 Escape ctrl+d shift+F1 ctrl+2")


def editing(record: Record) -> None:
    record.play("ctrl+1 Insert Down Return ctrl+z @liquids.thin ctrl+1 Delete Return ctrl+d alt+Up F2 'water 2'")
    record.note(
        "break",
        lambda: record.designer.editing.handle_request(RetypeFile(record.text.replace("blinding", "blindin", 1))),
    )
    record.play("F8 Return ctrl+z shift+F1")


QUICK = (editing, new_study)
FLOWS = (
    each_element, on_disk, by_keys, adding_and_deleting, problems, series, entries, finding, languages, small_window,
)  # fmt: skip


@pytest.mark.parametrize("flow", [*QUICK, *(pytest.param(one, marks=pytest.mark.slow) for one in FLOWS)])
def test_what_steps_change(record: Any, flow: Callable[[Record], None], pytestconfig: pytest.Config) -> None:
    made = record()
    flow(made)
    made.compare(flow.__name__, pytestconfig)


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "but"), [("rek2024", None), ("viscosityjnd", "rek2024")])
def test_what_each_tab_shows(record: Any, name: str, but: str | None, pytestconfig: pytest.Config) -> None:
    made = record(text_of(name))
    each_tab(made, {} if but is None else dict(studies((but,)))[but].document)
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    made.compare(name, pytestconfig)


FIELDS = {"rek2024": ("tasks", "scales"), "viscosityjnd": ("designs",)}


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "section"), [(name, one) for name, sections in FIELDS.items() for one in sections])
def test_each_field_of_a_form_used_once(record: Any, name: str, section: str, pytestconfig: pytest.Config) -> None:
    made = record(text_of(name))
    designer = made.designer
    made.lines.clear()
    for path in one_of_each(designer.study.document):
        used: set[str] = set()
        while path[0] == section:
            designer.undo_all()
            designer.go_to(*path)
            settle(designer)
            made.texts[designer.file] = designer.text
            free = [
                one for one in designer.place.form.findChildren(QWidget) if isinstance(one, CONTROLS) and is_usable(one)
            ]
            named = {f"{type(one).__name__} {one.accessibleName() or one.property('text')!r}": one for one in free}
            key = next((key for key in named if key not in used), None)
            if key is None:
                break
            used.add(key)
            made.lines.append(f"== {path}, {key}")
            use(named[key])
            settle(designer)
            made.lines += [*made.said(), *(row.message for row in designer.place.view.problems)]
            made.lines += told(popup) if (popup := QApplication.activePopupWidget()) else ()
            if popup is not None:
                popup.close()
    assert designer.text == text_of(name)
    made.compare(f"fields of {section} in {name}", pytestconfig)
