"""A figure of the report: what it is drawn from, and its bytes in each form."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from matplotlib.figure import Figure

from study_app import figure_style as style
from study_app.analysis.data.blocks import Block
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures.answer_figures import marks
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.results import BlockFound, Failure, Failures, Results, counted


@dataclass(frozen=True, slots=True)
class Picture:
    """One figure: the block it is of, its name as a file, its caption, and its bytes by form (png, svg, pdf)."""

    block: str
    name: str
    caption: str
    files: dict[str, bytes]


def attempted(
    pictures: Iterable[tuple[str, str, Callable[[str], Picture]]], failures: Failures | None
) -> Iterator[Picture]:
    """Yield figures from block, name and what draws it by that name; one that fails is kept in ``failures`` instead."""
    held = Failures() if failures is None else failures
    for block, name, draw in pictures:
        drawn = held.attempt(f"figure {name}", partial(draw, name), block=block)
        if not isinstance(drawn, Failure):
            yield drawn


def files_of(draw: Callable[[Sequence[str]], Sheet], forms: Sequence[str], title: str) -> dict[str, bytes]:
    """Return the bytes of a figure in each of its forms; ``draw`` takes the fonts."""
    return {form: style.file_bytes(draw(style.fonts_for(form)).figure, form, title) for form in forms}


def sample_words(study: Study, n: int) -> str:
    """Return what a caption ends with: who took part."""
    return f"{'SIMULATED participants, no people; ' if study.simulated else ''}{counted(n, 'participant')}."


@dataclass(frozen=True, slots=True)
class Drawing:
    """What a figure of a block is drawn from, its name as a file, and its forms."""

    study: Study
    block: Block
    found: BlockFound
    results: Results
    name: str
    forms: Sequence[str]

    @property
    def simulated(self) -> str:
        """What a caption says of simulated participants."""
        return "SIMULATED participants, no people; " if self.study.simulated else ""

    def picture(self, title: str, caption: str, draw: Callable[..., Figure]) -> Picture:
        """Return the figure that ``draw`` draws with ``title``, the study's ``marks`` and each form's ``fonts``."""
        files = {}
        for form in self.forms:
            figure = draw(title=title, marks=marks(self.study), fonts=style.fonts_for(form))
            files[form] = style.file_bytes(figure, form, f"{self.study.name}: {title}")
        return Picture(self.block.id, self.name, caption, files)
