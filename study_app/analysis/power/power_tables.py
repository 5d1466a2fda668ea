"""The power of a study as tables: a row a test and size as CSV, and Markdown to read and to paste."""

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from study_app import __version__
from study_app.analysis.power.batch_counts import EFFECTS
from study_app.analysis.power.permutation_tests import DRAWS
from study_app.analysis.power.power_curves import WANTED, Curve, Powers, Question, interval
from study_app.analysis.results.words import enough
from study_app.store.tables.csv_files import Column, csv_bytes, optional

COLUMNS: Final = (
    Column("study", "text", "Short name of the study, from its protocol."),
    Column("simulated", "flag", "true: all of these answers come from a model, none from people."),
    Column("block", "text", "Id of the block of trials."),
    Column("question", "text", "What is tested."),
    optional("item", "text", "Id of the statement; n/a where the test is over several."),
    optional("over", "text", "Over what, where not over one statement."),
    optional("setting", "text", "The delay that the test is about; n/a where it is about all."),
    Column("participants", "integer", "Participants of each study.", minimum=2),
    Column("studies", "integer", "Simulated studies.", minimum=1),
    Column("power", "number", "Share of the studies that show it, under the answer model.", minimum=0, maximum=1),
    Column("power_low", "number", "Lower end of the 95 % interval of that share (Wilson).", minimum=0, maximum=1),
    Column("power_high", "number", "Upper end of it.", minimum=0, maximum=1),
    optional(
        "without_effect",
        "number",
        "The same share where settings do not differ at all: false alarms; of equivalence, its power.",
        minimum=0,
        maximum=1,
    ),
    optional("effect_points", "number", "The difference of mean answers in the model, in points."),
    optional(
        "detectable_points",
        "number",
        "The smallest difference of mean answers that 80 % of such studies show, in points.",
    ),
)

EQUAL: Final = "if truly equal"

_HEADS: Final[dict[Question, tuple[str, str]]] = {
    "settings differ": ("Do the settings differ?", "statement"),
    "trend": ("Do answers follow the delay?", "statement"),
    "lowest delay": ("Is a trend shown up to this delay, or a shorter one?", "statement, delay"),
    "equivalence": ("Is a delay shown to be equivalent to the shortest?", "statement, delay"),
}


def power_csv(found: Powers) -> bytes:
    """Return a row for every test and size."""
    return csv_bytes(COLUMNS, _rows(found))


def _rows(found: Powers) -> Iterator[dict[str, Any]]:
    for curve in found.curves:
        for place, size in enumerate(found.sizes):
            low, high = interval(curve.power[place], found.studies)
            yield {
                "study": found.plan.name,
                "simulated": True,
                "block": curve.block,
                "question": curve.question,
                "item": curve.item,
                "over": curve.over or None,
                "setting": curve.setting,
                "participants": size,
                "studies": found.studies,
                "power": round(curve.power[place], 6),
                "power_low": round(low, 4),
                "power_high": round(high, 4),
                "without_effect": None if curve.alarms is None else round(curve.alarms[place], 6),
                "effect_points": None if curve.effect is None else round(curve.effect, 3),
                "detectable_points": _points(curve, place),
            }


def _points(curve: Curve, place: int) -> float | None:
    points = None if curve.detectable is None else curve.detectable[place]
    return None if points is None else round(points, 3)


def power_markdown(found: Powers) -> str:
    """Return the tables in Markdown, with what they rest on and what they cannot tell."""
    lines = [f"# Power of {found.plan.title} ({found.plan.name} {found.plan.version})", "", *_preface(found)]
    for block in found.plan.blocks:
        for question, (head, first) in _HEADS.items():
            curves = [one for one in found.curves if (one.block, one.question) == (block.id, question)]
            if curves:
                lines += ["", f"## {block.title}: {head[:1].lower()}{head[1:]}", "", *_explained(question, found), ""]
                shown = [*curves, *_truly_equal(curves)] if question == "equivalence" else curves
                lines += _table(shown, found, first, lambda curve, at: f"{curve.power[at]:.0%}", needed=True)
            if any(one.detectable for one in curves):
                lines += ["", "The smallest difference of mean answers that 80 % of studies show, in points:", ""]
                lines += _table([one for one in curves if one.detectable], found, first, _detectable_cell)
    return "\n".join(lines) + "\n"


def _preface(found: Powers) -> list[str]:
    decided = found.plan.decided
    low, high = interval(WANTED, found.studies)
    lines = [
        f"**SIMULATED.** {found.studies} studies of each size were answered by the rehearsals' answer model (seed "
        f"{found.seed}, liquid-study {__version__}), whose shapes and constants are plausible and not measured: real "
        "effects may be smaller. Read the tables of the smallest detectable difference together with those of power.",
        "",
        f"Tests at α = {decided.alpha:g}; p from {DRAWS} random rearrangements of each participant's answers. "
        "Statements that the protocol calls primary are corrected by Holm, the others by Benjamini and Hochberg. "
        f"Effects of {EFFECTS[1]:g} to {EFFECTS[-1]:g} times the model's were tried. A power of 80 % is uncertain by "
        f"±{50 * (high - low):.1f} percentage points.",
    ]
    if not found.complete:
        lines += ["", f"**Ended early: {found.studies} of {found.asked} studies.**"]
    if found.plan.unknown:
        named = ", ".join(found.plan.unknown)
        lines += ["", f"The model knows nothing of {named}: no effect is simulated there, and what is found is chance."]
    lines += [
        line
        for block in found.plan.blocks
        if block.groups
        for line in (
            "",
            f"{block.title}: n counts participants of {' and '.join(block.groups)}; no other group has it.",
        )
    ]
    return lines


def _truly_equal(curves: list[Curve]) -> list[Curve]:
    """Return for every statement the power of equivalence where no delay makes a difference: the mean over delays."""
    items = {curve.item: [one.alarms for one in curves if one.item == curve.item and one.alarms] for curve in curves}
    return [
        Curve(
            curves[0].block, "equivalence", item, "", EQUAL, tuple(np.mean(alarms, axis=0).tolist()), None, None, None
        )
        for item, alarms in items.items()
    ]


def _explained(question: Question, found: Powers) -> list[str]:
    match question:
        case "settings differ":
            return ["Friedman's permutation test, or signed ranks where two settings are compared."]
        case "trend":
            return ["Page's test in the direction that the protocol states."]
        case "lowest delay":
            return [
                "Page's test stepping down from the longest delay: what it finds bounds the noticeable one from above."
            ]
        case "equivalence":
            return [
                f"Two one-sided t tests within ±{found.plan.decided.equivalence_bound} points, with which changing "
                "signs, signed ranks and the bootstrap-t must agree, and with "
                f"{enough(found.plan.decided.alpha)}. Where the model's difference is near the bound or beyond it, "
                "finding equivalence would be wrong, and few should."
            ]


def _table(
    curves: list[Curve], found: Powers, first: str, cell: Callable[[Curve, int], str], *, needed: bool = False
) -> list[str]:
    """Return a table of a row a curve and a column a size; ``needed`` adds from which size on the power is 80 %."""
    heads = [first, *(f"n = {size}" for size in found.sizes), *(["80 % from"] if needed else [])]
    lines = [f"| {' | '.join(heads)} |", f"|---|{'---:|' * (len(heads) - 1)}"]
    for curve in curves:
        cells = [_name(curve, found), *(cell(curve, at) for at in range(len(found.sizes)))]
        if needed:
            cells.append(str(curve.needed(found.sizes) or "–"))
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _detectable_cell(curve: Curve, at: int) -> str:
    points = None if curve.detectable is None else curve.detectable[at]
    return "beyond" if points is None else f"{points:.2f}"


def _name(curve: Curve, found: Powers) -> str:
    if curve.item is None:
        return f"*{curve.over}*"
    short = {item.id: item.short for block in found.plan.blocks for item in block.items}[curve.item]
    return short if curve.setting is None else f"{short}, {curve.setting}"
