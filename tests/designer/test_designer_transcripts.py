"""The designer's window: what it tells of each kind of element and in each state, compared with a reviewed text.

Every act of the flows is checked as well (`Story.check`); each tab shows each element.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication

from study_app.designer.document.steps import ChangeLanguage, RetypeFile, SetValue
from study_app.protocol.source.document import Path
from tests.designer.document.test_commands import elements, generic, studies
from tests.designer.support.story import Story
from tests.gui.transcript import compare, widget_lines
from tests.protocol.edited_studies import text_of

TABS = ("measures", "file", "changes", "participant")
LISTED = ("blocks", "liquids", "conditions")


def one_of_each(document: Any, but: Mapping[str, Any] = MappingProxyType({})) -> list[Path]:
    """Return the first element of each kind, without the kinds that another study has."""
    first_paths: dict[Path, Path] = {}
    for path in elements(document):
        first_paths.setdefault(generic(path), path)
    known = {generic(path) for path in elements(but)} if but else set()
    return [path for kind, path in first_paths.items() if kind not in known and path != ("format",)]


def each_element(story: Story) -> None:
    for path in one_of_each(story.designer.study.document):
        story.select(*path)
    story.act("measures", lambda: story.designer.place.show_tab("measures"))


def by_keys(story: Story) -> None:
    story.play("ctrl+1 Down Down alt+Down alt+Up ctrl+d ctrl+z ctrl+shift+z ctrl+z F2 'fluids' Return ctrl+2 Tab Tab")
    story.play("ctrl+3 Right ctrl+e ctrl+e alt+Left ctrl+5 F6 shift+F6 ctrl+f 'honey' Escape shift+F1 shift+F1")
    story.play("ctrl+l ctrl+s")


def adding_and_deleting(story: Story) -> None:
    story.play("ctrl+1 Insert 'question' Down Return ctrl+z ctrl+shift+d")
    story.play("@conditions.late ctrl+shift+d '50 100 x' Return Escape")
    story.play("@liquids.thin ctrl+1 Delete Escape Delete Return ctrl+z shift+Down ctrl+d Delete")


def problems(story: Story) -> None:
    text = story.text.replace('liquid = "thick"', 'liquid = "thik"').replace("blinding", "blindin", 1)
    text = text.replace("force_limit_n = 6", "force_limit_n = 60").replace("min_s = 5", 'min_s = "5"')
    story.act("break", lambda: story.designer.editing.handle_request(RetypeFile(text)))
    story.play('ctrl+4 F8 F8 F8 F8 F8 ctrl+4 Tab Tab Return [Use "blinding": Study, Blindin]')
    story.act("no TOML", lambda: story.designer.editing.handle_request(RetypeFile("[study")))
    story.play("F8 ctrl+z ctrl+z")


def new_study(story: Story) -> None:
    story.play("ctrl+n")
    page = story.designer.place.new_page
    for button in page.buttons[:6]:
        story.act(f"choose {button.accessibleName()}", lambda button=button: button.setChecked(True))
    story.act("make", page.card.make.click)
    story.act("title", lambda: page.card.questions.title.setText("Which is thicker?"))
    story.act("make", page.card.make.click)


def on_disk(story: Story) -> None:
    designer = story.designer
    story.act("edit", lambda: designer.editing.handle_request(SetValue(("blocks", "liquids", "repetitions"), 3)))
    story.act("changes", lambda: designer.place.show_tab("changes"))
    designer.change(("rate_hz = 1000", "rate_hz = 900"))
    story.act("changed outside", designer.controller.enter)
    story.act("save", designer.saving.save)
    for action in ("compare", "keep"):
        story.act(f"banner {action}", lambda action=action: designer.place.ask("banner", action))
    designer.file.unlink()
    story.act("deleted outside", designer.controller.enter)
    story.act("open another", lambda: designer.controller.open("rek2024"))
    story.act("open none", lambda: designer.controller.open("nonesuch"))
    story.act("open again", lambda: designer.controller.open("kitchen"))


def series(story: Story) -> None:
    story.act("list one", lambda: story.designer.editing.handle_request(SetValue(LISTED, ["thin"])))
    story.play("@conditions.thin ctrl+shift+d '5000' Return ctrl+a '60 120 240' Return ctrl+z")
    story.play(" ".join(f"@{path} ctrl+shift+d Escape" for path in ("study", "blocks.liquids", "blocks")))


def entries(story: Story) -> None:
    story.select(*LISTED[:2])
    story.act("first entry", story.designer.field(*LISTED).rows[0].setFocus)
    story.play("alt+Down shift+Up alt+Down Delete ctrl+z ctrl+z Return alt+Left")


def finding(story: Story) -> None:
    story.play("ctrl+f 'force limit' Return ctrl+f 'williams' Return ctrl+f 'xyzzy' Escape ctrl+f 'delay' Down Down")
    story.play("Return ctrl+f 'honey' Return Return ctrl+f 'break every' Return space ctrl+z")


def languages(story: Story) -> None:
    story.act("add", lambda: story.designer.editing.handle_request(ChangeLanguage("add", "nl")))
    story.play("@pages.welcome ctrl+l ctrl+4 F8")
    story.act("copy", lambda: story.designer.editing.handle_request(ChangeLanguage("copy", "nl")))
    story.select("pages", "welcome")
    story.act("title", story.designer.field("pages", "welcome", "title").lines["nl"].setFocus)
    story.play("'Een blik' Return ctrl+l ctrl+s @study")
    story.act("remove", lambda: story.designer.editing.handle_request(ChangeLanguage("remove", "nl")))


def small_window(story: Story) -> None:
    story.act("small", lambda: story.designer.window.resize(1024, 640))
    story.play("ctrl+1 Down Down Return ctrl+3 ctrl+3 ctrl+2 ctrl+e ctrl+e ctrl+l F6 ctrl+1 ctrl+f 'honey' Return")
    story.play("Return ctrl+1 Escape ctrl+d shift+F1 ctrl+2")


def editing(story: Story) -> None:
    story.play("ctrl+1 Insert Down Return ctrl+z @liquids.thin ctrl+1 Delete Return ctrl+d alt+Up F2 'water 2'")
    story.act(
        "break", lambda: story.designer.editing.handle_request(RetypeFile(story.text.replace("blinding", "blindin", 1)))
    )
    story.play("F8 Return ctrl+z shift+F1")


FLOWS: tuple[Callable[[Story], None], ...] = (
    each_element, problems, new_study, on_disk, adding_and_deleting, languages, by_keys, series, entries, finding,
    small_window, editing,
)  # fmt: skip


@pytest.mark.slow
def test_spoken_texts_of_the_designer(story: Callable[..., Story], pytestconfig: pytest.Config) -> None:
    played = story()
    text, lines = played.text, list[str]()
    played.drafts_are_kept = False  # the file is written anew before each flow
    for flow in FLOWS[:6]:
        played.text = text
        played.designer.file.write_text(text, encoding="utf-8", newline="\n")
        played.designer.window.resize(1600, 1000)
        played.act("open", played.designer.open)
        played.lines = []
        flow(played)
        lines += [f"== {flow.__name__}", *played.lines]
        played.lines = None
    compare("designer", lines, pytestconfig)


@pytest.mark.nightly
@pytest.mark.parametrize("flow", FLOWS)
def test_each_act_of_a_flow_leaves_the_window_consistent(
    story: Callable[..., Story], flow: Callable[[Story], None]
) -> None:
    acted = story()
    flow(acted)
    acted.undo_and_redo()


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "but"), [("rek2024", None), ("viscosityjnd", "rek2024")])
def test_each_tab_shows_each_element(story: Callable[..., Story], name: str, but: str | None) -> None:
    acted = story(text_of(name))
    designer, place = acted.designer, acted.designer.place
    known = {} if but is None else dict(studies((but,)))[but].document
    for path in one_of_each(designer.study.document, known):
        acted.select(*path)
        assert place.form.head.title.text(), path
        for tab in TABS:
            acted.act(f"tab {tab}", lambda tab=tab: place.show_tab(tab))
            assert len(widget_lines(place.pane)) > len(widget_lines(place.pane.tabs)), (path, tab)
        assert place.file.editor.toPlainText() == designer.text
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
