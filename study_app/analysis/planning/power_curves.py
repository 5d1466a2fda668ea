"""Power by number of participants: curves, tables, figure and files.

Upper plots: the share of simulated studies that show it, with its Monte Carlo band; the line at 80 %; dashed, the same
without any effect. Under them the smallest difference that 80 % of studies show. Where the study has delays there is a
row for the lowest delay that shows and one for equivalence, a line a delay.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from matplotlib.axes import Axes

from study_app import __version__
from study_app import figure_style as style
from study_app.analysis.data.measures import Array
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet
from study_app.analysis.planning.simulated_studies import EFFECTS, FULL, PLANNED_DRAWS, Counts, Plan, Planned
from study_app.analysis.results import enough
from study_app.store.output_files import write_files
from study_app.store.tables.csv_files import Column, csv_bytes, optional

Question: TypeAlias = Literal["settings differ", "trend", "lowest delay", "equivalence"]

WANTED: Final = 0.8
"""The power that "smallest detectable effect" and "participants needed" are about."""

OVER_ALL: Final = "all statements at once"
Z95: Final = 1.959964


@dataclass(frozen=True, slots=True)
class Curve:
    """The power of one test over the sizes.

    ``item`` is None for tests over several statements, which ``over`` then names; ``setting`` the delay that a test is
    about, where it is about one. ``power`` holds shares of studies, ``alarms`` the same without any effect, which for
    equivalence is the power where there is truly no difference. ``effect`` is the effect that was simulated, in points
    of the scale: between the two settings whose mean answers differ most. ``detectable`` is the smallest one, in the
    same points, that is found in 80 % of studies, None where it is beyond eight times the simulated one.
    """

    block: str
    question: Question
    item: str | None
    over: str
    setting: str | None
    power: tuple[float, ...]
    alarms: tuple[float, ...] | None
    effect: float | None
    detectable: tuple[float | None, ...] | None

    def points(self, place: int) -> float | None:
        """Return ``detectable`` at one of the sizes."""
        return None if self.detectable is None else self.detectable[place]

    def needed(self, sizes: Sequence[int]) -> int | None:
        """Return the smallest of the sizes from which on the power is 80 %."""
        enough = [share >= WANTED for share in self.power]
        for place, size in enumerate(sizes):
            if all(enough[place:]):
                return size
        return None


@dataclass(frozen=True)
class Powers:
    """What so many simulated studies of each size found."""

    plan: Plan
    sizes: tuple[int, ...]
    studies: int
    asked: int
    seed: int
    curves: tuple[Curve, ...]

    @property
    def complete(self) -> bool:
        """Whether all studies that were asked for were simulated."""
        return self.studies == self.asked


def powers(plan: Plan, sizes: Sequence[int], studies: int, asked: int, seed: int, counts: Counts) -> Powers:
    """Return what ``studies`` of ``asked`` studies found, from their counts."""
    curves = tuple(curve for block in plan.blocks for curve in _curves(block, counts, studies))
    return Powers(plan, tuple(sizes), studies, asked, seed, curves)


def interval(share: float, studies: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share of simulated studies (Wilson 1927)."""
    middle = (share + Z95**2 / (2 * studies)) / (1 + Z95**2 / studies)
    reach = Z95 / (1 + Z95**2 / studies) * math.sqrt(share * (1 - share) / studies + Z95**2 / (4 * studies**2))
    return max(0.0, middle - reach), min(1.0, middle + reach)


def _curves(block: Planned, counts: Counts, studies: int) -> Iterator[Curve]:
    question: Question = "trend" if block.kind == "delays" else "settings differ"
    means = counts[block.id, "means"] / studies
    for what, over in (("any", "at least one statement"), ("all", OVER_ALL)):
        if (block.id, what) in counts:
            shares = counts[block.id, what] / studies
            yield Curve(block.id, question, None, over, None, *_shares(shares), None, None)
    if (block.id, "found") in counts:
        found = counts[block.id, "found"] / studies
        for place, item in enumerate(block.items):
            effects = _effects(block, means[:, :, place])
            known = effects[FULL] - effects[0] > 0.05
            yield Curve(
                block.id,
                question,
                item.id,
                "",
                None,
                *_shares(found[:, :, place]),
                float(effects[FULL]),
                tuple(_detectable(found[at, :, place], effects) for at in range(len(found))) if known else None,
            )
    yield from _lowest_curves(block, counts, studies)
    yield from _equivalence_curves(block, counts, studies)


def _shares(shares: Array) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(shares[:, FULL].tolist()), tuple(shares[:, 0].tolist())


def _effects(block: Planned, means: Array) -> Array:
    """Return the difference of mean answers (effects, settings) that is the effect: first to last, or the largest."""
    if block.kind == "delays":
        return np.asarray(np.abs(means[:, -1] - means[:, 0]))
    return np.asarray(np.ptp(means, axis=1))


def _detectable(found: Array, effects: Array) -> float | None:
    """Return the effect at which the share of studies that find it reaches 80 %, between those that were simulated."""
    rising = np.maximum.accumulate(found)
    reached = np.flatnonzero(rising >= WANTED)
    if not len(reached):
        return None
    at = int(reached[0])
    if at == 0:
        return float(effects[0])
    part = (WANTED - rising[at - 1]) / (rising[at] - rising[at - 1])
    return float(effects[at - 1] + part * (effects[at] - effects[at - 1]))


def _lowest_curves(block: Planned, counts: Counts, studies: int) -> Iterator[Curve]:
    if (block.id, "lowest") not in counts:
        return
    shares = counts[block.id, "lowest"] / studies
    for place, item in enumerate(block.items):
        if shares[:, place].any():
            for delay in range(1, block.k):
                power = tuple(shares[:, place, delay].tolist())
                yield Curve(block.id, "lowest delay", item.id, "", block.names[delay], power, None, None, None)


def _equivalence_curves(block: Planned, counts: Counts, studies: int) -> Iterator[Curve]:
    if (block.id, "equivalent") not in counts:
        return
    shares = counts[block.id, "equivalent"] / studies
    means = counts[block.id, "means"][FULL] / studies
    for place, item in enumerate(block.items):
        for delay in range(1, block.k):
            none, full = (tuple(shares[:, effect, place, delay - 1].tolist()) for effect in (0, 1))
            away = float(means[delay, place] - means[0, place])
            yield Curve(block.id, "equivalence", item.id, "", block.names[delay], full, none, away, None)


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
    return csv_bytes(COLUMNS, _csv_rows(found))


def _csv_rows(found: Powers) -> Iterator[dict[str, Any]]:
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
                "detectable_points": None if (points := curve.points(place)) is None else round(points, 3),
            }


def power_markdown(found: Powers) -> str:
    """Return the tables in Markdown, with what they rest on and what they cannot tell."""
    lines = [f"# Power of {found.plan.title} ({found.plan.name} {found.plan.version})", "", *_preface(found)]
    for block in found.plan.blocks:
        for question, (head, first) in _HEADS.items():
            curves = [one for one in found.curves if (one.block, one.question) == (block.id, question)]
            if curves:
                lines += ["", f"## {block.title}: {head[:1].lower()}{head[1:]}", "", *_explained(question, found), ""]
                shown = [*curves, *_truly_equal(curves)] if question == "equivalence" else curves
                lines += _markdown_table(shown, found, first, lambda curve, at: f"{curve.power[at]:.0%}", needed=True)
            if any(one.detectable for one in curves):
                lines += ["", "The smallest difference of mean answers that 80 % of studies show, in points:", ""]
                lines += _markdown_table(
                    [one for one in curves if one.detectable],
                    found,
                    first,
                    lambda curve, at: "beyond" if (points := curve.points(at)) is None else f"{points:.2f}",
                )
    return "\n".join(lines) + "\n"


def _preface(found: Powers) -> list[str]:
    decided = found.plan.decided
    low, high = interval(WANTED, found.studies)
    lines = [
        f"**SIMULATED.** {found.studies} studies of each size were answered by the rehearsals' answer model (seed "
        f"{found.seed}, liquid-study {__version__}), whose shapes and constants are plausible and not measured: real "
        "effects may be smaller. Read the tables of the smallest detectable difference together with those of power.",
        "",
        f"Tests at α = {decided.alpha:g}; p from {PLANNED_DRAWS} random rearrangements of each participant's answers. "
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


def _markdown_table(
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


def _name(curve: Curve, found: Powers) -> str:
    if curve.item is None:
        return f"*{curve.over}*"
    short = {item.id: item.short for block in found.plan.blocks for item in block.items}[curve.item]
    return short if curve.setting is None else f"{short}, {curve.setting}"


PLOTS_A_ROW: Final = 5
POWER_PT: Final = 74.0
POINTS_PT: Final = 34.0
BETWEEN_PT: Final = 9.0
GAP_PT: Final = 22.0
SCALE_PT: Final = 26.0
TICKS_PT: Final = 12.0
TOP_PT: Final = 30.0
LINE_PT: Final = 9.0
HEAD_PT: Final = 17.0
FOOT_PT: Final = 20.0
SHADES: Final = ("#9dc3de", "#02256d")
"""Of delays, from the shortest to the longest."""

HEADS: Final[dict[Question, str]] = {
    "settings differ": "Studies that show that settings differ; below, the smallest difference that 80 % show [points]",
    "trend": "Studies that show a trend over delay; below, the smallest difference that 80 % show [points]",
    "lowest delay": "Studies that show a trend up to this delay [ms] or a shorter one",
    "equivalence": "Studies that find this delay [ms] equivalent to the shortest, under the model's differences",
}


@dataclass(frozen=True, slots=True)
class _Row:
    """A row of plots: its heading, and for each plot a title and curves."""

    head: str
    plots: tuple[tuple[str, tuple[Curve, ...]], ...]
    points: bool

    @property
    def height_pt(self) -> float:
        return POWER_PT + TICKS_PT + (POINTS_PT + BETWEEN_PT if self.points else 0)


@style.own_settings()
def draw_power(found: Powers, block: Planned, fonts: Sequence[str]) -> Sheet:
    """Draw the power of one block."""
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, fonts)
    rows = _figure_rows(found, block)
    width = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - SCALE_PT - PLOTS_A_ROW * GAP_PT + 8) / PLOTS_A_ROW
    titles = [[ruler.wrap(title, width + GAP_PT - 6, 7.5, "bold") for title, _ in row.plots] for row in rows]
    heights = [
        (HEAD_PT if row.head else 0) + max(map(len, lines)) * LINE_PT + row.height_pt + 8
        for row, lines in zip(rows, titles, strict=True)
    ]
    sheet = Sheet(style.PAGE_WIDTH_PT, TOP_PT + sum(heights) + FOOT_PT, fonts)
    mark = Mark("SIMULATED participants", style.WARN, style.WARN_GROUND)
    sheet.heading(
        f"Power: {block.title}",
        [mark],
        [f"{found.studies} studies of each size, α = {found.plan.decided.alpha:g}", f"{found.studies} studies"],
    )
    top = TOP_PT
    for row, lines, height in zip(rows, titles, heights, strict=True):
        _draw_row(sheet, found, row, lines, top, width)
        top += height
    sheet.text(MARGIN_PT, sheet.height_pt - 6, _foot(found, rows), size=6.5, colour=style.TEXT_SOFT)
    return sheet


def _figure_rows(found: Powers, block: Planned) -> list[_Row]:
    rows: list[_Row] = []
    for question, head in HEADS.items():
        curves = [one for one in found.curves if (one.block, one.question) == (block.id, question)]
        plots: list[tuple[str, tuple[Curve, ...]]] = [
            (item.short, mine) for item in block.items if (mine := tuple(one for one in curves if one.item == item.id))
        ]
        plots += [(one.over.capitalize(), (one,)) for one in curves if one.over == OVER_ALL]
        points = any(one.detectable for one in curves)
        for first in range(0, len(plots), PLOTS_A_ROW):
            cut = tuple(plots[first : first + PLOTS_A_ROW])
            rows.append(_Row("" if first else head, cut, points and any(one[0].item for _, one in cut)))
    return rows


def _draw_row(
    sheet: Sheet, found: Powers, row: _Row, titles: Sequence[Sequence[str]], top: float, width: float
) -> None:
    if row.head:
        sheet.text(MARGIN_PT, top + 6, row.head, size=7.5, colour=style.TEXT_SOFT)
        top += HEAD_PT
    title_pt = max(map(len, titles)) * LINE_PT
    highest = max(
        [points for _, curves in row.plots for one in curves for points in one.detectable or () if points], default=1.0
    )
    for place, (_, curves) in enumerate(row.plots):
        x = MARGIN_PT + SCALE_PT + place * (width + GAP_PT)
        for number, line in enumerate(titles[place]):
            sheet.text(x, top + 6 + number * LINE_PT, line, size=7.5, weight="bold")
        axes = sheet.axes(x, top + title_pt + 2, width, POWER_PT)
        _power_plot(sheet, axes, found, curves, numbers=place == 0)
        if row.points and curves[0].detectable:
            below = sheet.axes(x, top + title_pt + 2 + POWER_PT + BETWEEN_PT, width, POINTS_PT)
            _draw_points(sheet, below, found, curves[0], 1.18 * highest)
            _sizes(sheet, below, found, width)
        else:
            _sizes(sheet, axes, found, width)


def _power_plot(sheet: Sheet, axes: Axes, found: Powers, curves: Sequence[Curve], *, numbers: bool) -> None:
    sizes = np.array(found.sizes, dtype=float)
    axes.set_ylim(-2, 104)
    for share in (0, 50, 100):
        axes.axhline(share, color=style.GRID, linewidth=0.6, zorder=0)
    axes.axhline(100 * WANTED, color=style.AXIS, linewidth=0.6, linestyle=(0, (1, 2)), zorder=1)
    if numbers:
        axes.set_yticks((0, 50, 80, 100), ("0", "50", "80", "100 %"), fontproperties=sheet.font(6.5))
    if curves[0].setting is not None:
        _delays_plot(sheet, axes, sizes, curves)
        return
    (curve,) = curves
    power = np.array(curve.power)
    low, high = np.array([interval(share, found.studies) for share in curve.power]).T
    axes.fill_between(sizes, 100 * low, 100 * high, color=style.BAND, linewidth=0, zorder=2)
    axes.plot(sizes, 100 * power, color=style.ACCENT, linewidth=1.5, marker="o", markersize=2.6, zorder=4)
    if curve.alarms is not None:
        axes.plot(
            sizes, 100 * np.array(curve.alarms), color=style.PARTICIPANT, linewidth=0.9, linestyle=(0, (3, 2)), zorder=3
        )


def _delays_plot(sheet: Sheet, axes: Axes, sizes: Array, curves: Sequence[Curve]) -> None:
    """Draw a line a delay, named at its right end, names kept apart."""
    light, dark = (np.array([int(shade[at : at + 2], 16) for at in (1, 3, 5)]) / 255 for shade in SHADES)
    ends = [100 * curve.power[-1] for curve in curves]
    for place, curve in enumerate(curves):
        part = place / max(len(curves) - 1, 1)
        colour = tuple(light + part * (dark - light))
        axes.plot(
            sizes, 100 * np.array(curve.power), color=colour, linewidth=1.3, marker="o", markersize=2, zorder=3 + part
        )
    for curve, y in zip(curves, _apart(ends, 8.4, longest_first=curves[0].question == "lowest delay"), strict=True):
        axes.annotate(
            (curve.setting or "").removesuffix(" ms"),
            (float(sizes[-1]), y),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontproperties=sheet.font(5.6),
            color=style.TEXT,
            annotation_clip=False,
        )


def _apart(ends: Sequence[float], least: float, *, longest_first: bool) -> list[float]:
    """Return heights near ``ends``, ``least`` apart; of equal ones the longest delay is on top, or the shortest."""
    order = sorted(range(len(ends)), key=lambda place: (-ends[place], -place if longest_first else place))
    placed = [0.0] * len(ends)
    ceiling = 104.0
    for place in order:
        placed[place] = min(ends[place], ceiling)
        ceiling = placed[place] - least
    floor = -4.0
    for place in reversed(order):
        placed[place] = max(placed[place], floor)
        floor = placed[place] + least
    return placed


def _draw_points(sheet: Sheet, axes: Axes, found: Powers, curve: Curve, highest: float) -> None:
    sizes = np.array(found.sizes, dtype=float)
    points = np.array([np.nan if one is None else one for one in curve.detectable or ()])
    axes.set_ylim(0, highest)
    axes.axhline(0, color=style.GRID, linewidth=0.6, zorder=0)
    axes.plot(sizes, points, color=style.TEXT, linewidth=1.0, marker="o", markersize=2.2, zorder=3)
    known = np.flatnonzero(~np.isnan(points))
    for at in dict.fromkeys((known[0], known[-1])) if len(known) else ():
        axes.annotate(
            f"{points[at]:.1f}",
            (sizes[at], points[at]),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            fontproperties=sheet.font(6),
            color=style.TEXT,
        )


def _sizes(sheet: Sheet, axes: Axes, found: Powers, width: float) -> None:
    """Put the sizes under a plot, leaving out those that have no room."""
    for other in axes.figure.axes:
        _limits(other, found)
    low, high = axes.get_xlim()
    shown: list[int] = []
    for size in sorted(found.sizes, key=lambda one: (one not in (found.sizes[0], found.sizes[-1]), one)):
        room = sheet.text_width(str(size), 6.5) + 3
        if all(abs(size - other) / (high - low) * width >= room for other in shown):
            shown.append(size)
    axes.set_xticks(shown, [str(size) for size in shown], fontproperties=sheet.font(6.5))


def _limits(axes: Axes, found: Powers) -> None:
    reach = max(found.sizes[-1] - found.sizes[0], 1)
    axes.set_xlim(found.sizes[0] - 0.05 * reach, found.sizes[-1] + 0.05 * reach)


def _foot(found: Powers, rows: Sequence[_Row]) -> str:
    words = "Over participants. Band: Monte Carlo 95 %. Dashed: without any effect. "
    if not any(curve.setting for row in rows for _, curves in row.plots for curve in curves):
        return f"{words}Answers of a model, not of people: real effects may be smaller."
    bound = found.plan.decided.equivalence_bound
    return f"{words}Equivalent: within ±{bound:g} points. Answers of a model, not of people." if bound else words


def write_power(found: Powers, to: Path) -> tuple[Path, ...]:
    """Write tables (CSV, Markdown) and a figure a block (PNG, SVG, PDF) into ``to``; return the files.

    Raises
    ------
    AnalysisError
        ``to`` cannot be written; nothing was.
    """
    files = {"power.md": power_markdown(found).encode(), "power.csv": power_csv(found)}
    for block in found.plan.blocks:
        title = f"{found.plan.name}: power of {block.title}"
        for form in style.FORMATS:
            drawn = draw_power(found, block, style.fonts_for(form)).figure
            files[f"power-{block.id}.{form}"] = style.file_bytes(drawn, form, title)
    return write_files(Path(to), files)
