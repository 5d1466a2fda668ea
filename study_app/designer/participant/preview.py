"""The participant's page of the study that is edited: which page, in which language, with which answers."""

import time
from collections.abc import Mapping
from typing import Final

from PySide6.QtCore import QObject, Qt

from study_app.designer.document.elements import title_of
from study_app.designer.document.study import Study
from study_app.designer.measures.valid_part import valid_part
from study_app.designer.participant.participant_tab import ParticipantTab
from study_app.designer.participant.playable import last_valid, sound_part
from study_app.designer.participant.shown_step import (
    SIZES,
    STANDALONE,
    Found,
    ParticipantView,
    ScreenSize,
    StepPosition,
    moment_words,
    same_step,
    showing,
    side_of,
    step_name,
    step_words,
)
from study_app.designer.place.arrangement import PanePage
from study_app.designer.place.editing import Editing
from study_app.designer.place.view import DesignerPlace
from study_app.gui.display.screens import choose_screens
from study_app.gui.kit.commands import add_commands, tip
from study_app.gui.kit.devices import screen_number, settings_here, text_scale_on
from study_app.gui.widgets.background import delayed
from study_app.number_text import counted
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Trial
from study_app.protocol.questions import Value
from study_app.protocol.source.document import Path, value_at
from study_app.protocol.wording.languages import language_name
from study_app.session.pages import DesignPage, TaskPage
from study_app.session.simulated.observers import ProgrammedBall
from study_app.session.transitions.events import Chosen, Continue, LanguageChosen, Retracted, Submitted
from study_app.session.transitions.page_builder import Moment, moments, preview, previewed_page, tested_condition
from study_app.store.study_settings import keep_setting, kept_language

NO_ANSWERS: Final[Mapping[str, Value]] = {}


class ParticipantPreview(QObject):
    """Shows the participant's page that the selected element is on, and goes from step to step.

    It is drawn with the seed of `session.preview`; no sealed key is read. Answers are kept while the study is open, so
    that an edit does not empty the page, and go nowhere else.
    """

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.editing, self.place = editing, place
        self.tab = tab = ParticipantTab()
        fit, most = tab.fit_aside, lambda: tab.most_px
        page = PanePage("participant", "Participant", tab, tab.aside, fit_aside=fit, most_px=most, tip=tip("page"))
        place.pane.add_page(page, first=True)
        tab.resized.connect(place.pane.make_room)
        self._language = ""
        self._found: Found | None = None
        self._moment: Moment | None = None
        self._side = "questions"
        self._selected: Path = ()
        self._protocol: Protocol | None = None
        self._study: Study | None = None
        self._valid: Study | None = None
        self._answers: dict[tuple[str, int], dict[str, Value]] = {}
        self._ball: ProgrammedBall | None = None
        self._ball_of: object = None
        self._since_s = 0.0
        self._photodiode = True
        self._after_form = delayed(self, 0, self._follow)  # of another selection the form is painted first
        editing.opened_other.connect(self._begin)
        editing.changed.connect(self._after_form.start)
        editing.edited.connect(self._follow)
        place.entered.connect(self._look_at_screen)
        tab.shown.connect(self._follow)
        tab.language_asked.connect(self.show_language)
        tab.step_asked.connect(self.go)
        tab.trial_asked.connect(self.go_to_trial)
        tab.moment_asked.connect(self.show_moment)
        tab.happened.connect(self._hear)
        tab.frame_due.connect(self._move_ball)
        add_commands(place, {"page": self.enter_page, "language": self.show_next_language})
        self._look_at_screen()

    @property
    def position(self) -> StepPosition | None:
        """Where the preview is; None where it shows nothing, or a page that is not in the first session."""
        self.tab.trial.flush()
        self._update()
        found = self._found
        if found is None or found.session:
            return None
        step = found.shown.schedule.steps[found.index]
        trial = step.index if isinstance(step, Trial) else 1
        return StepPosition(step_name(step), trial, self._language, found.shown.schedule.seed)

    # what is asked for

    def enter_page(self) -> None:
        """Give the keyboard to the page."""
        self._come_forward()
        self.tab.page.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _come_forward(self) -> None:
        self.place.sides.chosen.emit("pane")
        self.place.pane.show_tab("participant")

    def show_next_language(self) -> None:
        """Show the pages in the next language; the keyboard stays where it is, if that is not hidden now."""
        form = self.place.form
        hides = form.isVisible()
        self._come_forward()
        if hides and not form.isVisible():
            self.place.pane.tabs.setFocus(Qt.FocusReason.ShortcutFocusReason)
        languages = self.tab.view.languages
        if len(languages) > 1:
            self.show_language(languages[(languages.index(self.tab.view.language) + 1) % len(languages)])

    def show_language(self, language: str) -> None:
        """Show the pages in another language, also when the study is opened again."""
        self._language = language
        if self.editing.opened is not None:
            keep_setting(self.editing.opened.file, "language", language)
        self._show()

    def go(self, by: int) -> None:
        """Show the page of another step, so many steps on."""
        if (found := self._found) is None:
            return
        index = found.index + by
        if 0 <= index < len(found.shown.schedule.steps):
            self._found = Found(found.shown, index, found.session)
            self._moment = None
            self._show()

    def go_to_trial(self, number: int) -> None:
        """Show a trial of the block that is shown; its first or its last one where there is none of that number."""
        found = self._found
        shown = None if found is None else found.shown.schedule.steps[found.index]
        if found is None or not isinstance(shown, Trial):
            return
        number = min(max(number, 1), shown.of)
        steps = enumerate(found.shown.schedule.steps)
        at = next(at for at, one in steps if isinstance(one, Trial) and (one.block, one.index) == (shown.block, number))
        self.go(at - found.index)

    def show_moment(self, moment: Moment) -> None:
        """Show another page of the step: its tank, or its questions."""
        self._moment = moment
        self._side = "tank" if moment.kind == "tank" else "questions"
        self._show()

    def _hear(self, event: object) -> None:
        """Keep an answer for this page; go on where the participant would."""
        if isinstance(event, LanguageChosen):
            self.show_language(event.language)
        elif isinstance(event, Chosen):
            self._answers.setdefault(self._page_key, {})[event.item] = event.value
            if isinstance(self.tab.view.page, DesignPage):
                self._go_on()
        elif isinstance(event, Retracted):
            self._answers.get(self._page_key, {}).pop(event.item, None)
        elif isinstance(event, Submitted | Continue):
            self._go_on()

    def _go_on(self) -> None:
        """Show the next page of the step, or the next step from its beginning."""
        if (found := self._found) is None:
            return
        pages = moments(found.shown, found.index)
        at = pages.index(self._moment) if self._moment in pages else 0
        if at + 1 < len(pages):
            self.show_moment(pages[at + 1])
        elif found.index + 1 < len(found.shown.schedule.steps):
            self._side = "tank"
            self.go(1)

    # following the study

    def _begin(self) -> None:
        self._found = self._moment = self._protocol = self._study = self._valid = None
        opened = self.editing.opened
        self._selected, self._answers = (), {}
        self._language = "" if opened is None else kept_language(opened.file)
        self._side = "questions"
        self._after_form.start()

    def _look_at_screen(self) -> None:
        """Offer this machine's participant screen; it may have been set elsewhere meanwhile."""
        settings, _ = settings_here()
        self._photodiode = settings.photodiode
        screen = choose_screens(screen_number(settings))[0]
        size = screen.size()
        own = ScreenSize("own", f"This machine's, {size.width()} × {size.height()}", size.width(), size.height(),
                         text_scale_on(settings, screen))  # fmt: skip
        self.tab.offer_screens((*SIZES, own))

    def _follow(self) -> None:
        self._after_form.stop()
        if self.editing.opened is not None and self.tab.isVisible():
            self._show()

    def _update(self) -> None:
        """Find the shown step in the study as it is now; another step where another element was selected."""
        opened = self.editing.opened
        if opened is None:
            return
        study, selected = opened.study, opened.history.selected
        if study is not self._study:
            self._study, before = study, self._protocol
            if study.protocol is not None:
                self._valid = study
            elif self._valid is None and before is None:
                self._valid = last_valid(opened)
            valid = {} if self._valid is None else self._valid.document
            self._protocol = sound_part(study, valid) or valid_part(study).protocol
            if self._protocol is None and self._valid is not None:
                self._protocol = self._valid.protocol
            if self._protocol is not None and before is not None and self._found is not None:
                self._found = self._again(self._found)
        if self._protocol is None:
            self._found = None
        elif selected != self._selected or self._found is None:
            found = showing(self._protocol, selected)
            if found is None and self._found is None:
                shown = preview(self._protocol)
                found = Found(shown, 0) if shown.schedule.steps else None
            if found is not None:
                self._found = found if not self._is_shown(found) else self._found
            if (side := side_of(selected)) is not None and selected != self._selected:
                self._side, self._moment = side, None
            self._selected = selected
        if self._protocol is not None and self._language not in self._protocol.study.languages:
            self._language = self._protocol.study.languages[0]

    def _is_shown(self, found: Found) -> bool:
        """Return whether the shown step is of the same block, so that another element of it keeps the trial."""
        now = self._found
        if now is None or now.session != found.session or found.session == STANDALONE:
            return False
        one, other = (here.shown.schedule.steps[here.index] for here in (now, found))
        whole = self._selected[:1] in {("questionnaires",), ("blocks",), ("scales",)}
        return step_name(one) == step_name(other) and (not isinstance(one, Trial) or whole)

    def _again(self, found: Found) -> Found | None:
        assert self._protocol is not None  # noqa: S101 - the caller has looked
        step = found.shown.schedule.steps[found.index]
        if found.session == STANDALONE:
            return showing(self._protocol, self._selected)
        return same_step(self._protocol, step_name(step), step.index if isinstance(step, Trial) else 1, found.session)

    # what is shown

    def _show(self) -> None:
        self._update()
        study, found = self._study, self._found
        if study is None:
            return
        if found is None:
            problem = str(study.problems[0]) if study.problems else "there is no step"
            self.tab.show_view(ParticipantView(note=f"The page cannot be shown: {problem}"))
            return
        shown, index = found.shown, found.index
        pages = moments(shown, index)
        if self._moment not in pages:
            of_side = [moment for moment in pages if (moment.kind == "tank") == (self._side == "tank")]
            self._moment = (of_side or list(pages))[0]
        page = previewed_page(shown, index, self._moment, self._language, self._answers.get(self._page_key, NO_ANSWERS))
        if isinstance(page, TaskPage):
            self._place_ball(page, tested_condition(shown, index))
        now = shown.schedule.steps[index]
        trial, trials = (now.index, now.of) if isinstance(now, Trial) and now.of > 1 else (0, 0)
        step = step_words(shown, now, shown.protocol.study.languages[0])
        if found.session and found.session != STANDALONE:
            step = f"{step} ({found.session})"
        self.tab.show_view(
            ParticipantView(
                page,
                self._language,
                shown.protocol.study.languages,
                step,
                index > 0,
                index + 1 < len(shown.schedule.steps),
                moment_words(pages),
                self._moment,
                self._question(study),
                self._note(study, found),
                self._photodiode,
                trial,
                trials,
            )
        )

    @property
    def _page_key(self) -> tuple[str, int]:
        """What answers are kept by: a form, or a trial of a block."""
        assert self._found is not None  # noqa: S101 - a page is shown
        step = self._found.shown.schedule.steps[self._found.index]
        return step_name(step), step.index if isinstance(step, Trial) else 0

    def _question(self, study: Study) -> str | None:
        """Return the id of the question that is selected."""
        if "items" not in self._selected:
            return None
        item = value_at(study.document, self._selected[: self._selected.index("items") + 2])
        name = item.get("id") if isinstance(item, Mapping) else None
        return name if isinstance(name, str) else None

    def _note(self, study: Study, found: Found) -> str:
        """Return what is not shown as it is written, in the language of the page."""
        first = found.shown.protocol.study.languages[0]
        faults = [fault for fault in study.faults if fault.concerns(self._language, first)]
        count = len(study.problems) - len(study.faults) + len(faults)
        if not count:
            return "This page is in no session." if found.session == STANDALONE else ""
        title = title_of(study.document, self._selected)
        own = [fault for fault in faults if fault.path[: len(self._selected)] == self._selected]
        lacks = [fault for fault in faults if fault.missing_language or fault.in_one_language]
        if own and self._protocol is not None:
            if not self._holds(self._protocol, study):
                return f"{title} cannot be shown: {own[0].message}"
            if own[0] in lacks:
                return f"{title} has no {language_name(self._language)} text; the text of another language is shown."
            value = "an initial value" if self._valid is None else "the last valid value"
            value = "the text as it is written" if own[0].reads_alike else value
            return f"{title} has a problem ({own[0].message}): {value} is shown."
        if len(lacks) == count:
            return f"{counted(count, 'text')} missing in {language_name(self._language)}: shown in another language."
        values = "only valid parts" if self._valid is None else "the last valid values"
        return f"{counted(count, 'problem')} elsewhere: {values} are shown."

    def _holds(self, protocol: Protocol, study: Study) -> bool:
        """Return whether the selected table, or question, is in the protocol that is shown."""
        section, *rest = self._selected
        table = getattr(protocol, str(section), None)
        if not isinstance(table, Mapping) or not rest:
            return True
        question = self._question(study)
        if rest[0] not in table or question is None:
            return rest[0] in table
        return any(item.id == question for item in protocol.questionnaires[str(rest[0])].items)

    def _place_ball(self, page: TaskPage, condition: str | None) -> None:
        """Put the ball at the beginning of its path, where the tank is another one."""
        assert self._found is not None  # noqa: S101 - a page is shown
        hides = condition is not None and self._found.shown.protocol.conditions[condition].ball == "hidden"
        tank = (page.task, page.workspace_m, page.trial, self._moment, hides)
        if tank != self._ball_of:
            self._ball_of = tank
            self._ball = ProgrammedBall(page.task, page.workspace_m, hidden_after_lead=hides)
            self._since_s = time.monotonic()

    def _move_ball(self) -> None:
        if self._ball is not None:
            self.tab.show_tank(self._ball.view(time.monotonic() - self._since_s))
