"""A session held with the scripted hand: what is seen before it, by the participant and by the operator."""

import signal
from pathlib import Path
from typing import Final, Self

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget

from study_app.app.session.bridge import SessionBridge
from study_app.app.session.live_session import LiveSession
from study_app.gui.preflight.window import PreflightWindow
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.theme.themed import apply_theme
from study_app.protocol.model import Reach
from study_app.session.pages import Page, QuestionnairePage, TaskPage, TextPage
from study_app.session.start import NewSession
from tools.screenshots.capture import Camera, shown
from tools.screenshots.example_study import SEED

COCKPIT: Final = (1600, 900)
FULL: Final = (1920, 1080)
SMALL: Final = (1366, 768)
TRACED_MS: Final = 10_500  # the cockpit shows the last ten seconds
ANSWERS: Final = (6, 5, 6, None, 3, 7, 2, None, 1)


def take_session(camera: Camera, protocol: Path, results: Path) -> None:
    """Take the pre-flight, every kind of page, and the cockpit of a double-blind study."""
    with PicturedSession(camera, protocol, results) as held:
        held.take_pictures()


def take_single_blind(camera: Camera, protocol: Path, results: Path) -> None:
    """Take the cockpit of a study whose operator sees the force."""
    with PicturedSession(camera, protocol, results) as held:
        held.begin(pictures=False)
        held.to_the_liquids()
        camera.wait(TRACED_MS)
        held.take_cockpit("cockpit-single-blind")
        held.end()


class PicturedSession:
    """One session, gone through page by page; whatever ends it, device and servo are let go of."""

    def __init__(self, camera: Camera, protocol: Path, results: Path) -> None:
        chosen = NewSession(
            source=str(protocol),
            participant="P013",
            session=1,
            seed=SEED,
            operator="AK",
            language="en",
            device="scripted",
            windowed=True,
            screen=None,
            results=results,
            recordings=False,
        )
        self._camera = camera
        self._live = LiveSession(chosen, LIGHT, asks=True)
        self._taken: set[str] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._live.end_by_signal(signal.SIGINT)  # nothing, where it has ended already
        self._live.wait()

    @property
    def _bridge(self) -> SessionBridge:
        assert self._live.bridge is not None  # noqa: S101 - the windows are open
        return self._live.bridge

    @property
    def _page(self) -> Page | None:
        return self._bridge.participant.page

    def take_pictures(self) -> None:
        """Go through the first part and into the second, and take what is new."""
        self.begin(pictures=True)
        self.to_the_liquids()
        self._camera.wait(TRACED_MS)
        self.take_cockpit("cockpit")
        self._take("participant-exploring", FULL)
        self._bridge.operator.ask("pause")
        self._take("participant-pause", SMALL)
        self._bridge.operator.ask("resume")
        self._go_until(QuestionnairePage)
        self._take("participant-questionnaire-empty", SMALL)
        self._answer_in_part()
        self._take("participant-questionnaire", SMALL)
        self._go_until(TaskPage, part=2)
        self._bridge.participant.resize(*FULL)
        self._camera.until(lambda: self._dwelling, "a target being held")
        self._camera.take(self._bridge.participant, "participant-reaching", at_once=True)
        self.end()

    def begin(self, *, pictures: bool) -> None:
        """Open the session; take what was found before it."""
        self._live.open()
        asked = self._camera.until(lambda: shown(PreflightWindow), "the pre-flight")
        if pictures:
            self._camera.until(lambda: "measuring …" not in [row.text() for row in asked.values()], "the scenes' error")
            for theme in (DARK, LIGHT):
                apply_theme(asked, theme)
                self._camera.take(asked, f"preflight-{theme.name}", (1200, 800))
        asked.start.click()
        self._camera.until(lambda: self._live.bridge is not None and self._page is not None, "the first page")

    def to_the_liquids(self) -> None:
        """Read on and practise until the first liquid is felt."""
        self._go_until(TaskPage, part=1)

    def take_cockpit(self, name: str) -> None:
        """Take the operator's window in both themes."""
        operator = self._bridge.operator
        for theme in (DARK, LIGHT):
            if operator.theme is not theme:
                operator.header.theme_button.click()
            self._camera.take(operator, f"{name}-{theme.name}", COCKPIT)

    def end(self) -> None:
        """Withdraw the participant, take what stands at the end, and close."""
        over: list[bool] = []
        self._live.over.connect(lambda: over.append(True))
        operator = self._bridge.operator
        operator.ask("end", "withdrawn", "")
        self._take("participant-end", SMALL)
        operator.close()
        self._camera.until(lambda: over, "the session's end")
        self._live.wait()

    def _go_until(self, kind: type[Page], part: int | None = None) -> None:
        """Read, answer and move on until such a page is there; take every page of text on the way."""

        def there() -> bool:
            page = self._page
            if isinstance(page, kind) and (part is None or _part(page) == part):
                return True
            self._go_on(page)
            return False

        self._camera.until(there, f"a {kind.__name__} of part {part}")

    def _go_on(self, page: Page | None) -> None:
        participant = self._bridge.participant
        if isinstance(page, TextPage):
            self._take(f"participant-{page.kind}", SMALL)
            self._key(participant.widget, Qt.Key.Key_Return)
        elif isinstance(page, QuestionnairePage):
            for number in range(len(page.items)):
                self._key(participant.focusWidget(), Qt.Key(Qt.Key.Key_1 + number % 7))
            self._key(participant.focusWidget(), Qt.Key.Key_Return)

    def _answer_in_part(self) -> None:
        """Answer most statements, and go on: what is missing is named."""
        participant = self._bridge.participant
        for answer in ANSWERS:
            key = Qt.Key.Key_Down if answer is None else Qt.Key(Qt.Key.Key_0 + answer)
            self._key(participant.focusWidget(), key)
        self._key(participant.focusWidget(), Qt.Key.Key_Return)

    @property
    def _dwelling(self) -> bool:
        view = self._bridge.runner.view(self._bridge.parts.servo.now_ns())
        return view is not None and 0.5 < view.task.dwell < 0.9

    def _take(self, name: str, size: tuple[int, int]) -> None:
        if name not in self._taken:
            self._taken.add(name)
            self._camera.take(self._bridge.participant, name, size)

    @staticmethod
    def _key(widget: QWidget | None, key: Qt.Key) -> None:
        if widget is not None:
            QTest.keyClick(widget, key)


def _part(page: Page) -> int | None:
    """Return the part a task belongs to; practice and baseline belong to none."""
    if not isinstance(page, TaskPage) or page.progress is None:
        return None
    return None if isinstance(page.task, Reach) and page.task.count is None else page.progress.part
