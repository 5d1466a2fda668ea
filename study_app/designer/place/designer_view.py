"""Everything that the study designer shows at one moment."""

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from study_app.designer.form.rows import Form
from study_app.designer.place.file import FileText
from study_app.designer.problems.problems import ProblemRow
from study_app.designer.versions.version_rows import VersionChip
from study_app.gui.theme.theme import Tone
from study_app.number_text import counted

BETWEEN: Final = "  ·  "
"""What is between the title of a study and its file."""
BEFORE_ORIGIN: Final = "  ("
"""What is between its file and where it is from."""
NO_FILE: Final = FileText()
NO_VERSION: Final = VersionChip()
BannerAction: TypeAlias = Literal["copy", "keep", "take", "compare", "discard", "problems", "close"]


@dataclass(frozen=True, slots=True)
class StudyChoice:
    """A study that can be opened."""

    # what it is called, the name of its file, and what it is opened by
    title: str
    file: str
    source: str
    # whether it ships with the program, and whether a draft of it was kept that is not saved
    shipped: bool = False
    drafted: bool = False
    original: str = ""  # the name of the study that it is a copy of; "" where it is not known to be one

    @property
    def words(self) -> str:
        origin = "shipped" if self.shipped else self.original and f"copy of {self.original}"
        return f"{self.title}{BETWEEN}{self.file}" + (f"{BEFORE_ORIGIN}{origin})" if origin else "")


@dataclass(frozen=True, slots=True)
class Banner:
    """One line above the form, with its buttons: what each asks for, and its words.

    ``closes`` says that it needs no answer and can be closed.
    """

    words: str
    actions: tuple[tuple[BannerAction, str], ...] = ()
    closes: bool = False

    @property
    def only_offers_copy(self) -> bool:
        """Whether it only says why the study is read-only."""
        return [action for action, _ in self.actions] == ["copy"]


@dataclass(frozen=True, slots=True)
class HeaderState:
    """The header."""

    studies: tuple[StudyChoice, ...] = ()  # what can be opened
    chosen: str = ""  # what is open, by its source; "" where nothing is
    problems: tuple[Tone, str, str] = ("ok", "check", "No problems")  # tone, icon and words of the chip
    draft: str = ""  # what is said of the draft, "" where nothing is
    # what would be undone and redone; "" where nothing is
    undo: str = ""
    redo: str = ""
    can_save: bool = False  # whether the file differs and may be written
    read_only: bool = False  # whether the study cannot be changed
    version: VersionChip = NO_VERSION  # the chip of the version, and what the button that saves says


@dataclass(frozen=True, slots=True)
class DesignerView:
    """What the place shows, but the outline, which follows a moment later; without a form no study is open."""

    header: HeaderState = HeaderState()
    form: Form | None = None
    file: FileText = NO_FILE
    problems: tuple[ProblemRow, ...] = ()
    banner: Banner | None = None


def problems_chip(count: int, warnings: int) -> tuple[Tone, str, str]:
    """Return tone, icon and words of the chip of problems."""
    if count:
        return "bad", "warning", counted(count, "problem")
    if warnings:
        return "warn", "warning", counted(warnings, "warning")
    return "ok", "check", "No problems"
