"""Whether the questions of a study fit on one page: looked at when the keyboard rests, a language at a time."""

from collections import OrderedDict
from dataclasses import replace
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.designer.measures.measures_view import Focus
from study_app.gui.participant.page_widgets import parts_of
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path
from study_app.protocol.wording.languages import words
from study_app.session.pages import Progress, QuestionnairePage
from study_app.session.transitions.page_builder import questions_page

REST_MS: Final = 600
KEPT: Final = 60


class PageFit(QObject):
    """Lays out pages of questions that were never seen; ``found`` follows each."""

    found = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._known: OrderedDict[tuple[QuestionnairePage, str], int] = OrderedDict()
        self._waiting: list[tuple[QuestionnairePage, str]] = []
        self.rest = QTimer(self)
        self.rest.setSingleShot(True)
        self.rest.setInterval(REST_MS)
        self.rest.timeout.connect(self._look)

    def parts(self, protocol: Protocol | None, focus: Focus, path: Path) -> int | None:
        """Return on how many parts the questions of an element stand at most; None: not known yet, or it asks none."""
        pages = [] if protocol is None else _pages(protocol, focus, path)
        self._waiting = [one for one in pages if one not in self._known]
        if self._waiting:
            self.rest.start()
            return None
        return max((self._known[one] for one in pages), default=None)

    def _look(self) -> None:
        if not self._waiting:
            return
        page, language = self._waiting.pop(0)
        self._known[page, language] = parts_of(page, words(language))
        while len(self._known) > KEPT:
            self._known.popitem(last=False)
        if self._waiting:
            QTimer.singleShot(0, self, self._look)
        else:
            self.found.emit()


def _pages(protocol: Protocol, focus: Focus, path: Path) -> list[tuple[QuestionnairePage, str]]:
    """Return the pages of an element's questionnaire in every language, as in the first trial of its block."""
    name = str(path[1]) if path[0] == "questionnaires" and len(path) > 1 else None
    if focus.block is not None and focus.block.design is None:
        name = name or focus.block.questionnaire
    if name is None or name not in protocol.questionnaires:
        return []
    questionnaire, found = protocol.questionnaires[name], []
    for language in protocol.study.languages:
        label, progress = name, None
        if focus.block is not None:
            label = protocol.text(focus.block.setting_label, language)
            progress = Progress(focus.block.part, protocol.parts, label, 1, 2)
        context = questionnaire.context(protocol.scales, language)
        page = questions_page(protocol, questionnaire, questionnaire.items, context, label)
        found.append((replace(page, progress=progress), language))
    return found
