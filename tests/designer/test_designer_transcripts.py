"""The designer's window, compared with reviewed texts: each kind of element in every tab, each field used once."""

import re
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType, SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QTimer
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from study_app.designer.document.steps import ChangeLanguage, RetypeFile, SetValue
from study_app.gui.widgets.background import wait_for_jobs
from study_app.protocol.source.document import Path
from tests.designer.document.test_study_transcripts import elements, generic, studies
from tests.designer.support.designer import DEMO
from tests.golden_values import changed
from tests.gui.transcript import CONTROLS, compare, is_usable, painted, told, use
from tests.protocol.edited_studies import text_of

TABS = ("measures", "file", "changes", "participant")
LISTED = ("blocks", "liquids", "conditions")
NEVER_MS = 10**8
TIME = re.compile(r"\b\d\d:\d\d\b")
TIP = re.compile(r"^(StaticText readOnly .+) \| = \|  \| =$")
"""A text with itself as its tip, which it has where it is cut."""


@pytest.fixture(autouse=True)
def no_time_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the participant's page stand still, typing be one step, and drafts be due."""
    for module in ("document.document", "place.editing", "participant.preview"):
        monkeypatch.setattr(f"study_app.designer.{module}.time", SimpleNamespace(monotonic=lambda: 1000.0))
    monkeypatch.setattr("study_app.designer.place.saving.time", SimpleNamespace(monotonic=lambda: 2000.0))


def settle(designer: Any) -> None:
    """Let all be done now that a timer would do later, or a job in the background."""
    quiet = 0
    while quiet < 2:
        wait_for_jobs(60)
        QApplication.processEvents()
        found = (*designer.controller.findChildren(QTimer), *designer.window.findChildren(QTimer))
        single = [timer for timer in found if timer.isSingleShot()]
        due = [timer for timer in single if timer.isActive()]
        for timer in single:
            timer.setInterval(NEVER_MS)  # else a slow machine changes the order
        for timer in due:
            timer.stop()
            timer.timeout.emit()
        quiet = 0 if due else quiet + 1


class Record:
    """A designer, and what changes in its window, its study and its messages with each act."""

    def __init__(self, designer: Any, text: str = DEMO) -> None:
        self.designer, self.lines, self.text = designer, list[str](), text
        designer.file.write_text(text, encoding="utf-8")
        self.before: dict[str, list[str]] = {}
        self.note("open", designer.open)

    def note(self, name: str, act: Callable[[], Any], *, paints: bool = False, of: QWidget | None = None) -> None:
        """Do something, and note what it changes: in the window, or in a part since the last act of that name.

        Only the form is painted: the cards beside it keep a height that depends on when they are laid out.
        """
        if QApplication.activePopupWidget() is None and not self.designer.window.isActiveWindow():
            self.designer.window.activateWindow()
            QApplication.processEvents()
        act()
        settle(self.designer)
        self.lines += [f"-- {name}", *self.said()]
        shown, key = (of, name) if of else (QApplication.activePopupWidget() or self.designer.window, "")
        heard = [TIP.sub(r"\1", line) for line in told(shown) if not line.startswith("ScrollBar")]
        seen = {f"{key} told": heard} | ({"painted": painted(self.designer.place.form)} if paints else {})
        for way, lines in seen.items():
            after = [TIME.sub("HH:MM", line) for line in lines]
            self.lines += changed(self.before.get(way, []), after)
            self.before[way] = after

    def said(self) -> Iterator[str]:
        """Yield messages, what is selected, and what changed in the text since the last time."""
        designer = self.designer
        yield from (f"message {title}: {sentence!r}" for title, sentence in designer.messages)
        designer.messages.clear()
        if designer.editing.opened is None:
            yield "no study"
            return
        focus = QApplication.focusWidget()
        at = f"{type(focus).__name__} {focus.accessibleName()!r}" if focus else "nothing"
        yield f"selected {'.'.join(map(str, designer.editing.selected))}, steps {designer.steps}, keyboard at {at}"
        yield from changed(self.text.split("\n"), designer.text.split("\n"), numbered=True)
        self.text = designer.text

    def compare(self, name: str, config: pytest.Config) -> None:
        """Compare what was noted with the golden file of a name."""
        compare(f"designer, {name}", [" / ".join(line.splitlines()) for line in self.lines], config)

    def select(self, *path: str | int, paints: bool = False) -> None:
        self.note(f"select {path}", lambda: self.designer.go_to(*path), paints=paints)

    def hit(self, *keys: str) -> None:
        for one in keys:
            self.note(f"key {one}", lambda one=one: self.designer.key(one))

    def type(self, text: str) -> None:
        self.note(f"type {text!r}", lambda: self.designer.type(text))

    def press(self, name: str) -> None:
        self.note(f"press {name}", lambda: self.designer.click_on(self.designer.part(name, QAbstractButton)))


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
    record.hit("ctrl+1", "Down", "Down", "alt+Down", "alt+Up", "ctrl+d", "ctrl+z", "ctrl+shift+z", "ctrl+z", "F2")
    record.type("fluids")
    record.hit(
        "Return", "ctrl+2", "Tab", "Tab", "ctrl+3", "Right", "ctrl+e", "ctrl+e", "alt+Left", "ctrl+5", "F6", "shift+F6"
    )
    record.hit("ctrl+f")
    record.type("honey")
    record.hit("Escape", "shift+F1", "shift+F1", "ctrl+l", "ctrl+s")


def adding_and_deleting(record: Record) -> None:
    record.hit("ctrl+1", "Insert")
    record.type("question")
    record.hit("Down", "Return", "ctrl+z", "Insert")
    record.type("Language: Du")
    record.hit("Return", "ctrl+z", "ctrl+shift+d")
    record.select("conditions", "late")
    record.hit("ctrl+shift+d")
    record.type("50 100 x")
    record.hit("Return", "Escape")
    record.select("liquids", "thin")
    record.hit("ctrl+1", "Delete", "Escape", "Delete", "Return")
    record.hit("ctrl+z", "ctrl+c", "ctrl+v", "shift+Down", "ctrl+d", "Delete")


def problems(record: Record) -> None:
    text = record.text.replace('liquid = "thick"', 'liquid = "thik"').replace("blinding", "blindin", 1)
    text = text.replace("force_limit_n = 6", "force_limit_n = 60").replace("min_s = 5", 'min_s = "5"')
    record.note("break", lambda: record.designer.editing.ask(RetypeFile(text)))
    record.hit("ctrl+4", "F8", "F8", "F8", "F8", "F8", "ctrl+4", "Tab", "Tab", "Return")
    record.press('Use "blinding": Study, Blindin')
    record.note("no TOML", lambda: record.designer.editing.ask(RetypeFile("[study")))
    record.hit("F8", "ctrl+z", "ctrl+z")


def new_study(record: Record) -> None:
    record.hit("ctrl+n")
    page = record.designer.place.new_page
    for one in page.buttons[:6]:
        record.note(f"choose {one.accessibleName()}", lambda one=one: one.setChecked(True))
    record.note("make", page.card.make.click)
    record.note("title", lambda: page.card.questions.title.setText("Which is thicker?"))
    record.note("make", page.card.make.click)


def on_disk(record: Record) -> None:
    designer = record.designer
    record.note("edit", lambda: designer.editing.ask(SetValue(("blocks", "liquids", "repetitions"), 3)))
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
    record.note("list one", lambda: record.designer.editing.ask(SetValue(LISTED, ["thin"])))
    record.select("conditions", "thin")
    record.hit("ctrl+shift+d")
    record.type("5000")
    record.hit("Return", "Up")
    record.type("60")
    record.hit("Return")
    record.type("120 240")
    record.hit("Return")
    record.press("Make the copies")
    record.hit("ctrl+z", "Insert")
    record.type("series of thin")
    record.hit("Return")
    record.type("x")
    record.hit("Return", "Escape", "Escape")
    for path in (("study",), LISTED[:2], LISTED[:1]):
        record.select(*path)
        record.hit("ctrl+shift+d", "Escape")


def copies(record: Record) -> None:
    record.select("conditions", "late")
    record.hit("ctrl+1", "ctrl+c")
    record.lines += QApplication.clipboard().text().splitlines()
    record.hit("ctrl+v", "ctrl+z")
    questions, item = "1. How cold was it?\n- Did it smell?\n", ("questionnaires", "liquid", "items", 1)
    liquid = "[liquids.thin]\n# own\ndensity_kg_m3 = 1000\n"
    for text, path in ((questions, item), (questions, ("study",)), (liquid, item), ("[study", ("study",))):
        QApplication.clipboard().setText(text)
        record.select(*path)
        record.hit("ctrl+1", "ctrl+v", "ctrl+z")
    record.select(*LISTED[:2])
    record.note("first entry", record.designer.field(*LISTED).rows[0].setFocus)
    record.hit("alt+Down", "shift+Up", "ctrl+c", "alt+Down", "Delete", "ctrl+z", "ctrl+z", "Return", "alt+Left")


def finding(record: Record) -> None:
    for words, *keys in (
        ("force limit", "Return"), ("williams", "Return"), ("xyzzy", "Escape"), ("delay", "Down", "Down", "Return"),
        ("honey", "Return", "Return"), ("break every", "Return", "space", "ctrl+z"),
    ):  # fmt: skip
        record.hit("ctrl+f")
        record.type(words)
        record.hit(*keys)


def languages(record: Record) -> None:
    record.note("add", lambda: record.designer.editing.ask(ChangeLanguage("add", "nl")))
    record.select("pages", "welcome")
    record.hit("ctrl+l", "ctrl+4", "F8", "Return", "ctrl+z")
    record.note("copy", lambda: record.designer.editing.ask(ChangeLanguage("copy", "nl")))
    record.select("pages", "welcome")
    record.note("title", record.designer.field("pages", "welcome", "title").lines["nl"].setFocus)
    record.type("Een blik")
    record.hit("Return", "ctrl+l", "ctrl+s")
    record.select("study")
    record.note("remove", lambda: record.designer.editing.ask(ChangeLanguage("remove", "nl")))


def small_window(record: Record) -> None:
    record.note("small", lambda: record.designer.window.resize(1024, 640))
    record.hit("ctrl+1", "Down", "Down", "Return", "ctrl+3", "ctrl+3", "ctrl+2", "ctrl+e", "ctrl+e", "ctrl+l", "F6")
    record.hit("ctrl+1", "ctrl+f")
    record.type("honey")
    record.hit("Return", "Return", "ctrl+1", "Escape", "ctrl+d", "shift+F1", "ctrl+2")


def editing(record: Record) -> None:
    record.hit("ctrl+1", "Insert", "Down", "Return", "ctrl+z")
    record.select("liquids", "thin")
    record.hit("ctrl+1", "Delete", "Return", "ctrl+d", "alt+Up", "F2")
    record.type("water 2")
    record.note("break", lambda: record.designer.editing.ask(RetypeFile(record.text.replace("blinding", "blindin", 1))))
    record.hit("F8", "Return", "ctrl+z", "shift+F1")


QUICK = (editing, new_study)
FLOWS = (
    each_element, on_disk, by_keys, adding_and_deleting, problems, series, copies, finding, languages, small_window,
)  # fmt: skip


@pytest.mark.parametrize("flow", [*QUICK, *(pytest.param(one, marks=pytest.mark.slow) for one in FLOWS)])
def test_what_steps_change(designer: Any, flow: Callable[[Record], None], pytestconfig: pytest.Config) -> None:
    record = Record(designer)
    flow(record)
    record.compare(flow.__name__, pytestconfig)


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "but"), [("rek2024", None), ("viscosityjnd", "rek2024")])
def test_what_each_tab_shows(designer: Any, name: str, but: str | None, pytestconfig: pytest.Config) -> None:
    record = Record(designer, text_of(name))
    each_tab(record, {} if but is None else dict(studies((but,)))[but].document)
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    record.compare(name, pytestconfig)


FIELDS = {"rek2024": ("tasks", "scales"), "viscosityjnd": ("designs",)}


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "section"), [(name, one) for name, sections in FIELDS.items() for one in sections])
def test_each_field_of_a_form_used_once(designer: Any, name: str, section: str, pytestconfig: pytest.Config) -> None:
    record = Record(designer, text_of(name))
    record.lines.clear()
    for path in one_of_each(designer.study.document):
        used: set[str] = set()
        while path[0] == section:
            designer.undo_all()
            designer.go_to(*path)
            settle(designer)
            record.text = designer.text
            free = [
                one for one in designer.place.form.findChildren(QWidget) if isinstance(one, CONTROLS) and is_usable(one)
            ]
            named = {f"{type(one).__name__} {one.accessibleName() or one.property('text')!r}": one for one in free}
            key = next((key for key in named if key not in used), None)
            if key is None:
                break
            used.add(key)
            record.lines.append(f"== {path}, {key}")
            use(named[key])
            settle(designer)
            record.lines += [*record.said(), *(row.message for row in designer.place.view.problems)]
            record.lines += told(popup) if (popup := QApplication.activePopupWidget()) else ()
            if popup is not None:
                popup.close()
    assert designer.text == text_of(name)
    record.compare(f"fields of {section} in {name}", pytestconfig)
