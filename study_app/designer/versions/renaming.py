"""What a new id does: how many references follow, answers recorded under the old one, comments that mention it."""

from typing import Final

from PySide6.QtCore import QObject

from study_app.designer.document.names import references_to
from study_app.designer.document.steps import RenameElement, Request
from study_app.designer.document.toml_text import Comment, comments_naming
from study_app.designer.place.editing import Editing
from study_app.designer.place.view import DesignerPlace
from study_app.designer.versions.changes import CommentsCard, UnlockCard, title_of
from study_app.designer.versions.known_runs import KnownRuns
from study_app.number_text import counted
from study_app.protocol.source.document import Path, value_at

BREAKS: Final = (
    "answers before and after are in different columns of the tables",
    "figures and tests take them as two questions",
    "an analysis that was decided before and names the old id does not find the new one",
)


class Renaming(QObject):
    """Locks the ids of questions with recorded answers; after a rename counts references, and offers comments.

    It notes a rename before `Editing` makes it: construct it before requests are connected to that.
    """

    def __init__(self, editing: Editing, place: DesignerPlace, runs: KnownRuns) -> None:
        super().__init__(editing)
        self.editing, self.place, self.runs = editing, place, runs
        self._unlocked: Path = ()
        self._renamed: tuple[str, int] | None = None
        self._listed: tuple[Path, str, tuple[Comment, ...]] = ((), "", ())
        editing.recorded = self._recorded
        place.asked.connect(self._note)
        editing.changed.connect(self._lock)
        editing.edited.connect(self._tell)
        editing.refused.connect(self._forget)
        runs.changed.connect(self._lock)
        place.form.head.unlock_asked.connect(self._explain)
        place.form.head.comments_asked.connect(self._list_comments)

    def _id(self, path: Path) -> str:
        """Return the id of an element, "" where it has none."""
        opened = self.editing.opened
        value = None if opened is None else value_at(opened.study.document, path)
        if not isinstance(value, dict):
            return ""
        return str(value.get("id", path[-1]))

    def _why(self, path: Path) -> str:
        """Return why an id is locked, "" where it is not."""
        if len(path) != 4 or path[2] != "items" or path == self._unlocked:
            return ""
        sessions = self.runs.items.get((str(path[1]), self._id(path)), 0)
        return f"Answers of {counted(sessions, 'session')} are recorded under this id." if sessions else ""

    def _recorded(self, element: Path) -> frozenset[str]:
        """Return the ids of a question's questionnaire under which answers are recorded."""
        known = self.runs.items if element[2:3] == ("items",) else ()
        return frozenset(name for form, name in known if form == element[1])

    def _lock(self) -> None:
        path = self.editing.selected
        if path != self._unlocked:
            self._unlocked = ()
        if path != self._listed[0]:
            self._listed = ((), "", ())
            self.place.form.head.show_comments("")
            self.place.form.head.show_followed("")
        self.place.form.head.show_lock(path, self._why(path))

    def _explain(self) -> None:
        path = self.editing.selected
        card = UnlockCard(self._id(path), self._why(path), BREAKS)
        card.answered.connect(lambda _id: self._unlock(path))
        self.place.show_prompt(card, card.first)

    def _unlock(self, path: Path) -> None:
        self._unlocked = path
        self._lock()
        self.place.form.head.edit_id()

    def _note(self, asked: Request) -> None:
        self._renamed, opened = None, self.editing.opened
        if isinstance(asked, RenameElement) and opened is not None:
            self._renamed = (self._id(asked.path), len(references_to(opened.study.document, asked.path)))

    def _forget(self) -> None:
        """Forget a rename that was refused: the next step is another one."""
        self._renamed = None

    def _tell(self) -> None:
        """Say how many references followed a rename, and which comments mention the old id."""
        renamed, self._renamed = self._renamed, None
        opened, head = self.editing.opened, self.place.form.head
        if renamed is None or opened is None:
            head.show_followed("")
            return
        name, references = renamed
        head.show_followed(f"{counted(references, 'place')} updated" if references else "")
        found = comments_naming(opened.study.text, name)
        if found:
            self._listed = (self.editing.selected, name, found)
            head.show_comments(title_of(name, found))

    def _list_comments(self) -> None:
        card = CommentsCard(*self._listed[1:])
        card.line_asked.connect(self._go_to)
        self.place.show_prompt(card, card.first)

    def _go_to(self, line: int) -> None:
        self.place.show_tab("file")
        self.place.file.editor.go_to(line - 1)
