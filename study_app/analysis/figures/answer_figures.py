"""The figures of a study: agreement for each liquid, and answers over delay; by code until the key is opened."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from matplotlib.figure import Figure

from study_app import figure_style as style
from study_app.analysis.figures import captions, diverging_bars, small_multiples
from study_app.analysis.figures.page_layout import Mark
from study_app.analysis.tables.compared_blocks import Block, Kind
from study_app.analysis.tables.measures import by_participant
from study_app.analysis.tables.study_tables import Study
from study_app.errors import AnalysisError


def liquids(study: Study, block: Block | None = None, *, fonts: Sequence[str] | None = None) -> Figure:
    """Draw the counts of answers as diverging bars, a panel per setting.

    Parameters
    ----------
    block : Block, optional
        One of ``study.blocks``; by default the first that compares liquids.
    fonts : sequence of str, optional
        Font families, best first; by default those for screens.

    Raises
    ------
    AnalysisError
        No such block, or no session was completed.
    """
    block = block or _only(study, "liquids")
    _require_answers(study, block)
    table = study.aggregate(block)
    panels = [
        diverging_bars.Panel(
            setting.code, block.name(setting), table[table["code"] == setting.code].reset_index(drop=True)
        )
        for setting in block.settings
    ]
    return diverging_bars.draw(
        panels,
        [item.short for item in block.items],
        block.labels,
        title=captions.title(block),
        marks=marks(study),
        counts=captions.counts(study, block),
        fonts=fonts or style.screen_fonts(),
    ).figure


def delays(
    study: Study,
    block: Block | None = None,
    *,
    fonts: Sequence[str] | None = None,
    lowest: Mapping[str, float] = MappingProxyType({}),
) -> Figure:
    """Draw the answers over the delay that was asked for, a small plot per statement; by code while blinded.

    Parameters and errors as in :func:`liquids`. A participant's repeated answers are drawn as their median. ``lowest``
    maps items to the lowest delay at which a trend shows [ms], which is marked.
    """
    block = block or _only(study, "delays")
    _require_answers(study, block)
    answers = study.answers(block)
    people = sorted(answers["participant"].unique())
    plots = [
        small_multiples.Plot(item.short, by_participant(answers, people, block.columns, item.id), lowest.get(item.id))
        for item in block.items
    ]
    return small_multiples.draw(
        plots,
        block.codes,
        block.delays_ms if block.revealed else None,
        title=captions.title(block),
        marks=marks(study),
        counts=captions.counts(study, block),
        foot=captions.foot(block),
        fonts=fonts or style.screen_fonts(),
    ).figure


def render(study: Study, block: Block, form: str, lowest: Mapping[str, float] = MappingProxyType({})) -> bytes:
    """Return the figure of a block as a file of ``form`` (png, svg or pdf); ``lowest`` as in :func:`delays`.

    Raises
    ------
    AnalysisError
        No session was completed.
    """
    fonts = style.fonts_for(form)
    drawn = (
        delays(study, block, fonts=fonts, lowest=lowest)
        if block.kind == "delays"
        else liquids(study, block, fonts=fonts)
    )
    return style.file_bytes(drawn, form, f"{study.name}: {captions.title(block)}")


def _only(study: Study, kind: Kind) -> Block:
    blocks = study.blocks_of(kind)
    if not blocks:
        raise AnalysisError(f"{study.folder}: the study {study.name!r} has no part that compares {kind}")
    return blocks[0]


def _require_answers(study: Study, block: Block) -> None:
    if not len(study.answers(block)):
        columns = ["participant", "session", "status", "excluded"]
        states = ", ".join(
            f"{participant} session {session} {'excluded' if excluded else status}"
            for participant, session, status, excluded in study.participants[columns].head(5).itertuples(index=False)
        )
        raise AnalysisError(
            f"{study.folder}: no completed session with answers in {block.id!r} yet ({states}): figures are drawn from "
            "completed sessions; export writes what there is"
        )


def marks(study: Study) -> list[Mark]:
    """Return what must not be overlooked in a figure of a study."""
    found = []
    if study.simulated:
        found.append(Mark("SIMULATED participants", style.WARN, style.WARN_GROUND))
    if study.pilot:
        found.append(Mark("PILOT", style.WARN, style.WARN_GROUND))
    if not study.revealed:
        found.append(Mark("Blinded: by code", style.SEALED, style.SEALED_GROUND))
    return found
