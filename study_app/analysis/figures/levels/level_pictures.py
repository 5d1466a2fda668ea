"""The figures of blocks of levels, each in every form with its caption."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final, TypeAlias

from study_app import figure_style as style
from study_app.analysis.figures.levels import level_figure, settings_figure, track_figure, weber_figure
from study_app.analysis.figures.picture import Picture, attempted
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.results.section_failures import Failures
from study_app.analysis.tables.study_tables import Study

Draw: TypeAlias = Callable[[Study, LevelsFound, Sequence[str], str], Picture]

FIGURES: Final[tuple[tuple[str, Callable[[LevelsFound], object], Draw], ...]] = (
    ("levels", lambda found: found.answers, level_figure.picture),
    ("tracks", lambda found: found.adaptive and found.own_thresholds, track_figure.picture),
    ("weber", lambda found: len(weber_figure.weber_fractions(found, None)) >= 2, weber_figure.picture),
    ("settings", lambda found: found.own_settings, settings_figure.picture),
)
"""What a figure is called, of which blocks there is one, and what draws it."""


def level_pictures(
    study: Study, levels: Sequence[LevelsFound], forms: Sequence[str] = style.FORMATS, failures: Failures | None = None
) -> Iterator[Picture]:
    """Draw every figure of every block that has one, in each of ``forms``.

    A figure that fails is left out, and kept in ``failures``.
    """
    yield from attempted(
        (
            (found.block, f"{what}-{found.block}", partial(draw, study, found, forms))
            for what, applies, draw in FIGURES
            for found in levels
            if applies(found)
        ),
        failures,
    )
