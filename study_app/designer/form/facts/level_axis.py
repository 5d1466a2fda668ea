"""The levels of a stimulus along an axis: their ends and steps, and where limits take part of the force away."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from pydantic import ValidationError

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import Row
from study_app.designer.form.row_facts import RowFacts
from study_app.designer.measures.level_plots import level_block
from study_app.designer.measures.level_words import LevelWords, even_ticks, log_ticks, rounded
from study_app.designer.measures.measures_view import focus_of
from study_app.designer.measures.number_cards import LIMIT_NAMES, Limit, Ticks
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import Stimulus

FARTHEST: Final = 3.0
"""A limit is drawn up to so many times the highest level, or spans above it."""
ROOM: Final = 1.3
MOST_TICKS: Final = 6


@dataclass(frozen=True, slots=True)
class AxisLimit:
    """A limit: its name with its value, and the level that reaches it."""

    words: str
    level: float


@dataclass(frozen=True, slots=True)
class LevelAxis:
    """An axis of levels.

    Attributes
    ----------
    low, high : float
        The ends of the levels.
    least, most : float
        The ends of the axis.
    logarithmic : bool
        Whether levels are in ratio, not even.
    levels : tuple of float
        The levels between which a method chooses.
    factor : float
        What a level is multiplied by where it is written.
    unit : str
        The unit of a written level.
    caption : str
        What a level is, and how the levels are spaced.
    standard : str
        The highest standard in words, "" without one.
    limits : mapping
        Where the force limit ("norm") and the slope limit begin, if that is near the levels.
    ticks : tuple of (float, str)
        Levels at which the axis is written at.
    sentence : str
        The axis in a sentence.
    """

    low: float
    high: float
    least: float
    most: float
    logarithmic: bool
    levels: tuple[float, ...]
    factor: float
    unit: str
    caption: str
    standard: str
    limits: Mapping[Limit, AxisLimit]
    ticks: Ticks
    sentence: str


def level_axis(study: Study, row: Row) -> LevelAxis | None:
    """Return the axis of a stimulus' levels; None where they make no sense."""
    table: Any = study.document
    for step in row.path[:-1]:
        table = table.get(step) if isinstance(table, Mapping) else None
    try:
        stimulus = Stimulus.model_validate(table)
    except ValidationError:
        return None
    words = LevelWords(stimulus, default_design("2ifc"))
    low, high = stimulus.levels
    standard, limits = _limits(study, row, words)
    log = stimulus.spacing == "log"
    near = [
        one.level
        for one in limits.values()
        if one.level <= (FARTHEST * high if log else high + FARTHEST * (high - low))
    ]
    top = max(high, *near) if near else high
    least, most = (low / ROOM**2, top * ROOM) if log else (low - 0.1 * (top - low), top + 0.15 * (top - low))
    if not log and stimulus.level_kind != "value":
        least = max(0.0, least)
    factor = words.factor
    ticks = (log_ticks if log else even_ticks)(least * factor, most * factor, MOST_TICKS)
    shown = {name: one for name, one in limits.items() if one.level <= most}
    spacing = "in ratio" if log else "even"
    beyond = "".join(f" {one.words[:1].upper()}{one.words[1:]}." for one in shown.values())
    return LevelAxis(
        low,
        high,
        least,
        most,
        log,
        stimulus.grid,
        factor,
        words.unit,
        f"{words.kind}{f', {words.unit}' if words.unit else ''}, {'logarithmic' if log else 'linear'}",
        standard,
        shown,
        tuple((value / factor, rounded(value)) for value in ticks),
        f"{stimulus.steps} levels from {words.words(low)} to {words.words(high)}, {spacing}.{beyond}",
    )


def _limits(study: Study, row: Row, words: LevelWords) -> tuple[str, dict[Limit, AxisLimit]]:
    """Return the highest standard in words, and the limits of the block that presents the levels."""
    protocol = study.formed
    focus = focus_of(protocol, row.path[:-1])
    of = None if protocol is None or focus.block is None else level_block(protocol, focus.block)
    if of is None:
        return "", {}
    standard = "" if of.standard is None else f"standard {rounded(of.standard)} {words.value_unit}".rstrip()
    found: dict[Limit, AxisLimit] = {}
    if of.limits is not None:
        values: dict[Limit, float | None] = {"norm": of.limits.force, "slope": of.limits.loop}
        for name, value in values.items():
            if value is not None:
                level = words.stimulus.level_between(of.standard, value)
                if math.isfinite(level) and level > 0:
                    found[name] = AxisLimit(f"{LIMIT_NAMES[name]} {rounded(value)} {words.value_unit}".rstrip(), level)
    return standard, found


FACTS: Final = RowFacts((("Stimulus", "levels"),), level_axis)
