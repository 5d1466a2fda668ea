"""Power by number of participants, for the main kind of participants and as a range: curves, tables, figures, files.

For delays, a figure also has plots of the lowest delay with a trend and of equivalence, with one line for each delay.
"""

import math
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from study_app import __version__
from study_app import figure_style as style
from study_app.analysis.data.blocks import TRENDS
from study_app.analysis.data.measures import Array
from study_app.analysis.page_layout import SMALL, Style
from study_app.analysis.planning import WANTED
from study_app.analysis.planning.simulated_studies import (
    EFFECTS,
    FULL,
    IF_EQUAL,
    PLANNED_DRAWS,
    Counts,
    Plan,
    PlannedBlock,
    contrast_sides,
    draw_opinions,
)
from study_app.analysis.planning.smallest_differences import question_differences, size_text, smallest_differences
from study_app.analysis.results import min_sample_reason
from study_app.analysis.statistics.equivalence import STEPS
from study_app.analysis.wording import bound_text, inclusion_text, listed, whole_percent
from study_app.protocol.participants import CONSISTENT, NOISY, STATED
from study_app.psychophysics.grid import Z_95
from study_app.store.files import Column, csv_bytes, optional, write_files

Question: TypeAlias = Literal["conditions differ", "trend", "lowest delay", "equivalence", "contrast"]

_MANY: Final = 200
"""Simulated participants from which differences between people are estimated."""

_OVER_ALL: Final = "all statements at once"


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """The power of one test as a function of sample size.

    ``item`` is None for tests over several statements, whose scope is ``over``; ``setting`` is the delay of tests of
    one delay. ``power`` has the proportions of studies that detect the effect, and ``alarms`` the proportions without
    any effect (for equivalence: the power if there is no difference). ``effect`` is the simulated effect, in scale
    points, between the two settings whose mean answers differ most. ``detectable`` is the smallest effect in the same
    unit that 80 % of studies find, None if it exceeds eight times the simulated one.
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

    @property
    def test(self) -> tuple[str | None, ...]:
        """The key that identifies the test within a study."""
        return self.block, self.question, self.item, self.over, self.setting

    def points(self, place: int) -> float | None:
        """Return the smallest detectable effect at the sample size with this index, or None."""
        return None if self.detectable is None else self.detectable[place]

    def needed_size(self, sizes: Sequence[int]) -> int | None:
        """Return the smallest sample size from which the power is at least 80 %."""
        enough = [proportion >= WANTED for proportion in self.power]
        for place, size in enumerate(sizes):
            if all(enough[place:]):
                return size
        return None


@dataclass(frozen=True, kw_only=True)
class Powers:
    """The results of simulated studies of each size, for each kind of participants; the main kind comes first."""

    plan: Plan
    sizes: tuple[int, ...]
    studies: int
    asked: int
    seed: int
    kinds: Mapping[str, tuple[Curve, ...]]

    @property
    def complete(self) -> bool:
        """Whether all requested studies were simulated."""
        return self.studies == self.asked

    @property
    def curves(self) -> tuple[Curve, ...]:
        """The curves for the main kind of participants."""
        return next(iter(self.kinds.values()))

    def curves_by_kind(self, curve: Curve) -> tuple[Curve, ...]:
        """Return the curves of a test for every kind of participants, in the order of ``kinds``."""
        none = replace(curve, power=(0.0,) * len(self.sizes), detectable=None)
        return tuple(
            next((other for other in curves if other.test == curve.test), none) for curves in self.kinds.values()
        )


def powers(
    plan: Plan, sizes: Sequence[int], studies: int, asked: int, seed: int, counts: Mapping[str, Counts]
) -> Powers:
    """Return the power for each kind of participants from counts in ``studies`` of the requested ``asked`` studies."""
    kinds = {}
    for kind, counted in counts.items():
        curves = [curve for block in plan.blocks for curve in _block_curves(block, counted, studies)]
        kinds[kind] = (*curves, *_contrast_curves(plan, counted, studies))
    return Powers(plan=plan, sizes=tuple(sizes), studies=studies, asked=asked, seed=seed, kinds=kinds)


def interval(share: float, studies: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a proportion of simulated studies (Wilson 1927)."""
    middle = (share + Z_95**2 / (2 * studies)) / (1 + Z_95**2 / studies)
    reach = Z_95 / (1 + Z_95**2 / studies) * math.sqrt(share * (1 - share) / studies + Z_95**2 / (4 * studies**2))
    return max(0.0, middle - reach), min(1.0, middle + reach)


def _block_curves(block: PlannedBlock, counts: Counts, studies: int) -> Iterator[Curve]:
    question: Question = "trend" if block.kind == "delays" else "conditions differ"
    means = counts[block.id, "means"] / studies
    for scope, over in (("any", "at least one statement"), ("all", _OVER_ALL)):
        if (block.id, scope) in counts:
            power, alarms = _power_and_alarms(counts[block.id, scope] / studies)
            yield Curve(
                block=block.id,
                question=question,
                item=None,
                over=over,
                setting=None,
                power=power,
                alarms=alarms,
                effect=None,
                detectable=None,
            )
    if (block.id, "found") in counts:
        proportions = counts[block.id, "found"] / studies
        for place, item in enumerate(block.items):
            effects = _effects_in_points(block, means[:, :, place])
            known = effects[FULL] - effects[0] > 0.05
            power, alarms = _power_and_alarms(proportions[:, :, place])
            yield Curve(
                block=block.id,
                question=question,
                item=item.id,
                over="",
                setting=None,
                power=power,
                alarms=alarms,
                effect=float(effects[FULL]),
                detectable=tuple(
                    _detectable_effect(proportions[size, :, place], effects) for size in range(len(proportions))
                )
                if known
                else None,
            )
    yield from _lowest_curves(block, counts, studies)
    equivalence = list(_equivalence_curves(block, counts, studies))
    yield from (*equivalence, *_equality_curves(equivalence))


def _contrast_curves(plan: Plan, counts: Counts, studies: int) -> Iterator[Curve]:
    for contrast in plan.contrasts:
        power, alarms = _power_and_alarms(counts[contrast.described(), "contrast"] / studies)
        within = None if len(contrast.blocks) == 2 else alarms  # simulated effects are within blocks
        yield Curve(
            block=contrast.blocks[0],
            question="contrast",
            item=None,
            over=contrast.described(),
            setting=None,
            power=power,
            alarms=within,
            effect=None,
            detectable=None,
        )
        if contrast.bound is not None:
            equal = f"{contrast.described()}, {IF_EQUAL}"
            power, _ = _power_and_alarms(counts[equal, "contrast"] / studies)
            yield Curve(
                block=contrast.blocks[0],
                question="contrast",
                item=None,
                over=equal,
                setting=None,
                power=power,
                alarms=None,
                effect=None,
                detectable=None,
            )


def _power_and_alarms(shares: Array) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(shares[:, FULL].tolist()), tuple(shares[:, 0].tolist())


def _effects_in_points(block: PlannedBlock, means: Array) -> Array:
    """Return the effects (effects,) of mean answers (effects, settings): last − first for delays, else the range."""
    if block.kind == "delays":
        return np.asarray(np.abs(means[:, -1] - means[:, 0]))
    return np.asarray(np.ptp(means, axis=1))


def _detectable_effect(shares: Array, effects: Array) -> float | None:
    """Return the effect that 80 % of studies find, interpolated between the simulated effects."""
    rising = np.maximum.accumulate(shares)
    reached = np.flatnonzero(rising >= WANTED)
    if not len(reached):
        return None
    index = int(reached[0])
    if index == 0:
        return float(effects[0])
    fraction = (WANTED - rising[index - 1]) / (rising[index] - rising[index - 1])
    return float(effects[index - 1] + fraction * (effects[index] - effects[index - 1]))


def _longer_delays(block: PlannedBlock) -> list[int]:
    """Return the indices of the settings with a longer delay than the shortest one."""
    return [delay for delay in range(1, block.k) if block.names[delay] != block.names[0]]


def _lowest_curves(block: PlannedBlock, counts: Counts, studies: int) -> Iterator[Curve]:
    if (block.id, "lowest") not in counts:
        return
    proportions = counts[block.id, "lowest"] / studies
    for place, item in enumerate(block.items):
        if proportions[:, place].any():
            for delay in _longer_delays(block):
                power = tuple(proportions[:, place, delay].tolist())
                yield Curve(
                    block=block.id,
                    question="lowest delay",
                    item=item.id,
                    over="",
                    setting=block.names[delay],
                    power=power,
                    alarms=None,
                    effect=None,
                    detectable=None,
                )


def _equivalence_curves(block: PlannedBlock, counts: Counts, studies: int) -> Iterator[Curve]:
    if (block.id, "equivalent") not in counts:
        return
    proportions = counts[block.id, "equivalent"] / studies
    means = counts[block.id, "means"][FULL] / studies
    for place, item in enumerate(block.items):
        for delay in _longer_delays(block):
            none, full = (tuple(proportions[:, effect, place, delay - 1].tolist()) for effect in (0, 1))
            difference = float(means[delay, place] - means[0, place])
            yield Curve(
                block=block.id,
                question="equivalence",
                item=item.id,
                over="",
                setting=block.names[delay],
                power=full,
                alarms=none,
                effect=difference,
                detectable=None,
            )


OF_BLOCK: Final = (
    Column("study", "text", "Short name of the study, from its protocol."),
    Column("simulated", "flag", "Always true, because all answers come from a model and not from people."),
    Column("block", "text", "ID of the block of trials."),
)
OF_STUDIES: Final = (
    Column("participants", "integer", "Number of participants in each simulated study.", minimum=2),
    Column("studies", "integer", "Number of simulated studies.", minimum=1),
)
"""Columns that all tables of power have, as has `OF_BLOCK`."""

COLUMNS: Final = (
    *OF_BLOCK,
    Column("question", "text", "Question that is tested."),
    optional("item", "text", "ID of the statement; n/a if the test covers several statements."),
    optional("over", "text", "Scope of the test, if it covers more than one statement."),
    optional("setting", "text", "The delay that is tested; n/a if the test covers all delays."),
    Column("people", "text", "Type of simulated participant."),
    *OF_STUDIES,
    Column(
        "power",
        "number",
        "Proportion of simulated studies that detect the effect under the answer model.",
        minimum=0,
        maximum=1,
    ),
    Column(
        "power_low",
        "number",
        "Lower end of the 95 % confidence interval for that proportion (Wilson).",
        minimum=0,
        maximum=1,
    ),
    Column(
        "power_high",
        "number",
        "Upper end of the 95 % confidence interval for that proportion (Wilson).",
        minimum=0,
        maximum=1,
    ),
    optional(
        "without_effect",
        "number",
        "The same proportion if the conditions do not differ, that is, the false-positive rate (for equivalence, the "
        "power).",
        minimum=0,
        maximum=1,
    ),
    optional("effect_points", "number", "Difference between the mean answers assumed in the model, in points."),
    optional(
        "detectable_points",
        "number",
        "The smallest difference between mean answers that 80 % of such studies detect, in points.",
    ),
)

_HEADS: Final[dict[Question, tuple[str, str]]] = {
    "conditions differ": ("Do the conditions differ?", "statement"),
    "trend": ("Do answers change with the delay?", "statement"),
    "lowest delay": ("Is a trend found up to this delay or a shorter one?", "statement, delay"),
    "equivalence": ("Can any delay be shown to be equivalent to the shortest one?", "statement, delay"),
    "contrast": ("Can the study support the hypothesis?", "hypothesis"),
}


def power_csv(power: Powers) -> bytes:
    """Return a CSV row for every test and size."""
    return csv_bytes(COLUMNS, _csv_rows(power))


def _csv_rows(power: Powers) -> Iterator[dict[str, Any]]:
    for curve, kind in ((curve, kind) for kind, curves in power.kinds.items() for curve in curves):
        for place, size in enumerate(power.sizes):
            low, high = interval(curve.power[place], power.studies)
            yield {
                "study": power.plan.name,
                "simulated": True,
                "block": curve.block,
                "question": curve.question,
                "item": curve.item,
                "over": curve.over or None,
                "setting": curve.setting,
                "people": kind,
                "participants": size,
                "studies": power.studies,
                "power": round(curve.power[place], 6),
                "power_low": round(low, 4),
                "power_high": round(high, 4),
                "without_effect": None if curve.alarms is None else round(curve.alarms[place], 6),
                "effect_points": None if curve.effect is None else round(curve.effect, 3),
                "detectable_points": None if (points := curve.points(place)) is None else round(points, 3),
            }


def power_markdown(power: Powers) -> str:
    """Return the tables in Markdown, with their assumptions and limitations."""
    lines = [f"# Power for {power.plan.title} ({power.plan.name} {power.plan.version})", "", *_preface_lines(power)]
    lines += _summary_lines(power)
    for block in power.plan.blocks:
        for question, (head, first) in _HEADS.items():
            curves = [curve for curve in power.curves if (curve.block, curve.question) == (block.id, question)]
            if curves:
                lines += [
                    "",
                    f"## {block.title}: {head[:1].lower()}{head[1:]}",
                    "",
                    *_test_sentences(question, power),
                    "",
                ]
                lines += _markdown_table(
                    curves, power, first, lambda curve, at: whole_percent(curve.power[at]), needed=True
                )
            if any(curve.detectable for curve in curves):
                lines += [
                    "",
                    "The smallest difference between mean answers that 80 % of studies detect, in points (“none”: "
                    "fewer than 80 % of studies detect even the largest simulated difference):",
                    "",
                ]
                lines += _markdown_table(
                    [curve for curve in curves if curve.detectable],
                    power,
                    first,
                    lambda curve, at: _difference_text(curve.points(at), 2),
                )
    return "\n".join([*lines, *_untested_contrasts(power)]) + "\n"


def _preface_lines(power: Powers) -> list[str]:
    decided = power.plan.decided
    low, high = interval(WANTED, power.studies)
    look_levels = ", ".join(f"{n}: {level:.2g}" for n, level in zip(decided.looks, decided.alphas, strict=False))
    looks = (
        f" across all looks ({look_levels}; an effect counts as detected from the first look that detects it)"
        if look_levels
        else ""
    )
    lines = [
        f"**SIMULATED.** {power.studies} studies of each size were simulated with the answer model that rehearsals use "
        f"(seed {power.seed}, liquid-study {__version__}). The model's effects are plausible but have not been "
        "measured, so real effects may be smaller. Read the tables of smallest detectable differences together with "
        "the power tables.",
        "",
        f"Tests use α = {decided.alpha:g}{looks}; p values are based on {PLANNED_DRAWS} random permutations of each "
        "participant's answers. Tests of primary statements are Holm-corrected; for the others, the false discovery "
        f"rate is controlled (Benjamini–Hochberg). Effects from {EFFECTS[1]:g} to {EFFECTS[-1]:g} times those of the "
        f"model were simulated. A power of 80 % has an uncertainty of ±{50 * (high - low):.1f} percentage points.",
        "",
        f"The numbers are for {_participants_phrase(next(iter(power.kinds)))}, with the lowest and highest values "
        "across all types of participant in parentheses. The types are "
        + listed([f"**{kind}** ({people.described()})" for kind, people in power.plan.kinds.items()])
        + f". {_SOURCES}",
    ]
    if not power.complete:
        lines += ["", f"**Preliminary: {power.studies} of {power.asked} studies were simulated.**"]
    if power.plan.unknown:
        items = ", ".join(power.plan.unknown)
        these = "this statement" if len(power.plan.unknown) == 1 else "these statements"
        lines += [
            "",
            f"The model does not assume any effects for {items}, so any effects detected for {these} are due "
            "to chance.",
        ]
    lines += [
        line
        for block in power.plan.blocks
        if block.groups
        for line in (
            "",
            f"{block.title}: n counts only the participants in {' and '.join(block.groups)}, because other groups do "
            "not complete this block.",
        )
    ]
    return lines


_SOURCES: Final = (
    "The values for consistent, typical and noisy participants come from published ratings, in points on a seven-point "
    "scale. Consistent: a trained panel (data set TVbo, R package lmerTest, Kuznetsova, Brockhoff and Christensen "
    "2017; medians across 15 attributes). Typical: panellists who rated chocolates (data set sensochoc, R package "
    "SensoMineR, Lê and Husson 2008; medians across 14 descriptors). Noisy: the largest of these 14 values. The noise "
    "SD is the SD between identical trials; the slope SD is the between-person SD of effects, relative to the mean "
    "effect."
)
"""The sources of the values in `raters.PUBLISHED`."""
_NONE: Final = "none"


def _participants_phrase(kind: str) -> str:
    """Return a kind of participants as a phrase."""
    return f"participants {kind}" if kind == STATED else f"{kind} participants"


def _summary_lines(power: Powers) -> Iterator[str]:
    """Yield the power of the primary tests at the planned sample size, for each kind of participants."""
    plan, sizes = power.plan, power.sizes
    place = sizes.index(plan.participants) if plan.participants in sizes else len(sizes) - 1
    planned_word = "the planned " if plan.participants in sizes else ""
    main = next(iter(power.kinds))
    titles = {block.id: block.title for block in plan.blocks}
    lines = []
    for curve in power.curves:
        primary = (
            curve.item is not None
            and curve.item not in plan.unknown
            and (not plan.decided.made or plan.decided.is_primary(curve.item))
        )
        if curve.question == "contrast" or (primary and curve.question in ("conditions differ", "trend")):
            proportions = dict(
                zip(power.kinds, (kind.power[place] for kind in power.curves_by_kind(curve)), strict=True)
            )
            where = f" in {titles[curve.block]}" if len(titles) > 1 else ""
            question = "" if curve.question == "contrast" else f" ({HEADS[curve.question]}{where})"
            shown = "show equivalence" if curve.over.endswith(IF_EQUAL) else "detect the effect"
            lines.append(
                f"- {_curve_name(curve, power).strip('*')}{question}: {whole_percent(proportions[CONSISTENT])} of "
                f"studies {shown} if participants are {CONSISTENT}, {whole_percent(proportions[main])} if they are "
                f"{main}, and {whole_percent(proportions[NOISY])} if they are {NOISY}."
            )
    if lines:
        yield from ("", f"## Power with {planned_word}{sizes[place]} participants", "", *lines)


def _untested_contrasts(power: Powers) -> Iterator[str]:
    """Yield tables of the contrasts without a simulated effect: between groups, and of forms."""
    plan = power.plan
    titles = {block.id: block.title for block in plan.blocks}
    opinions = draw_opinions(plan, _MANY, power.seed, 0) if plan.between else ()
    for contrast, proportions in plan.between:
        spreads = {}
        for name, kind in plan.kinds.items():
            answers = [block_opinions.answers(1.0, kind)[None, None] for block_opinions in opinions]
            first, second = contrast_sides(plan, answers, contrast)
            numbers = first if contrast.within is None else first - second
            spreads[name] = float(numbers.std(ddof=1))
        values_noun = "mean answers" if contrast.within is None else "within-participant differences"
        description = f"SD is the standard deviation of the simulated participants' {values_noun}, in points."
        rows = [
            (f"{contrast.measure}, {_participants_phrase(name)}", f"{spread:.2f}", spread)
            for name, spread in spreads.items()
        ]
        yield from smallest_differences(
            contrast, power.sizes, plan.decided.alphas[-1], len(plan.contrasts) + plan.untested, rows, "statement",
            description, "±{:.2f}".format, proportions, contrast.bound, bounds=_count_bounds(plan),
            largest=contrast.largest_difference, planned=plan.participants, unit=" points",
            titles=titles,
        )  # fmt: skip
    for contrast, of_groups in plan.of_questions:
        members = len(plan.contrasts) + plan.untested
        alpha, planned = plan.decided.alphas[-1], plan.participants
        yield from question_differences(
            contrast, power.sizes, alpha, members, of_groups, planned, titles, bounds=_count_bounds(plan)
        )


def _count_bounds(plan: Plan) -> int:
    """Return the number of hypotheses that state an equivalence bound."""
    return sum(contrast.bound is not None for contrast in plan.contrasts) + plan.untested_bounds


def _equality_curves(curves: Sequence[Curve]) -> list[Curve]:
    """Return a curve for each statement: the power of equivalence without an effect of delay, averaged over delays."""
    items = {
        curve.item: [other.alarms for other in curves if other.item == curve.item and other.alarms] for curve in curves
    }
    return [
        Curve(
            block=curves[0].block,
            question="equivalence",
            item=item,
            over="",
            setting=IF_EQUAL,
            power=tuple(np.mean(alarms, axis=0).tolist()),
            alarms=None,
            effect=None,
            detectable=None,
        )
        for item, alarms in items.items()
    ]


def _test_sentences(question: Question, powers: Powers) -> list[str]:
    match question:
        case "conditions differ":
            return [
                "Differences are tested with Friedman's test (permutation), or with Wilcoxon's signed-rank test if "
                "there are two conditions."
            ]
        case "trend":
            trend_test = TRENDS[powers.plan.decided.trends]
            return [f"Trends are tested with {trend_test}; the test is one-sided if the protocol states a direction."]
        case "lowest delay":
            return [
                "If there is a trend, the longest delay is dropped and the rank correlations are tested again, until "
                "no trend remains; the result is an upper bound for the shortest noticeable delay."
            ]
        case "equivalence":
            bound = powers.plan.decided.equivalence_bound or STEPS
            return [
                f"Equivalence is tested with two one-sided t tests (bounds {bound_text(bound)}) and a bootstrap; both "
                "must show equivalence. Equivalence also requires "
                f"{min_sample_reason(powers.plan.decided.alphas[-1], bound)}. If the difference in the model is near "
                "or outside the bounds, few studies should find equivalence; if it is outside the bounds, such a "
                "finding is wrong."
            ]
        case "contrast":
            return [
                "Hypotheses are tested with paired t tests on each participant's answers (medians of repeated ones), "
                "Holm-corrected across "
                "the hypotheses; the bootstrap and the t test corrected for skewness must also be significant. "
                f"Equivalence is tested in the same way as in the report. {inclusion_text([])}"
            ]


def _markdown_table(
    curves: list[Curve], powers: Powers, first: str, cell: Callable[[Curve, int], str], *, needed: bool = False
) -> list[str]:
    """Return a table with one row per curve and one column per size.

    A cell has the range over all kinds of participants in parentheses; ``needed`` adds the size from which the power is
    at least 80 %.
    """
    planned = powers.plan.participants
    heads = [
        first,
        *(f"n = {size_text(size, planned)}" for size in powers.sizes),
        *(["n for 80 % power"] if needed else []),
    ]
    lines = [f"| {' | '.join(heads)} |", f"|---|{'---:|' * (len(heads) - 1)}"]
    for curve in curves:
        kinds = powers.curves_by_kind(curve)
        cells = [
            _curve_name(curve, powers),
            *(_with_range([cell(kind, at) for kind in kinds]) for at in range(len(powers.sizes))),
        ]
        if needed:
            cells.append(
                _with_range([str(kind.needed_size(powers.sizes) or f"> {powers.sizes[-1]}") for kind in kinds])
            )
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _difference_text(points: float | None, decimals: int) -> str:
    """Return a smallest difference as text; None: fewer than 80 % of studies detect any simulated difference."""
    return _NONE if points is None else f"{points:.{decimals}f}"


def _with_range(numbers: Sequence[str]) -> str:
    """Return the first number, followed by the range of all numbers in parentheses if they differ."""
    lowest, *_, highest = sorted(numbers, key=_range_key)
    joint = "–" if highest.removesuffix(" %").replace(".", "").isdigit() else " to "
    return numbers[0] if lowest == highest else f"{numbers[0]} ({lowest.removesuffix(' %')}{joint}{highest})"


def _range_key(number: str) -> tuple[bool, float]:
    """Return the sort key of a number as text; "none" comes last."""
    return number == _NONE or ">" in number, 0.0 if number == _NONE else float(number.strip("%> "))


def _curve_name(curve: Curve, power: Powers) -> str:
    if curve.item is None:
        return f"*{curve.over}*"
    short = {item.id: item.short for block in power.plan.blocks for item in block.items}[curve.item]
    return short if curve.setting is None else f"{short}, {curve.setting}"


_PLOTS_A_ROW: Final = 5
_TITLE_LETTERS: Final = 21
HEADS: Final[dict[Question, str]] = {
    "conditions differ": "conditions differ",
    "trend": "trend over delay",
    "lowest delay": "trend up to this delay",
    "equivalence": "equivalent to the control",
}
"""Labels of the vertical axes of plots."""

DELAYS: Final = LinearSegmentedColormap.from_list("delays", ("#9dc3de", "#02256d"))
"""Colours of delays, from the shortest to the longest."""

_Plot: TypeAlias = tuple[str, Question, tuple[Curve, ...]]
"""Title, question and curves of a plot."""


def _plot_rows(power: Powers, block: PlannedBlock) -> Iterator[list[_Plot]]:
    """Yield the rows of plots of a block: one plot per statement and one for the global test."""
    for question in HEADS:
        curves = [
            curve
            for curve in power.curves
            if (curve.block, curve.question) == (block.id, question) and curve.setting != IF_EQUAL
        ]
        plots: list[_Plot] = [
            (item.short, question, item_curves)
            for item in block.items
            if (item_curves := tuple(curve for curve in curves if curve.item == item.id))
        ]
        plots += [(curve.over.capitalize(), question, (curve,)) for curve in curves if curve.over == _OVER_ALL]
        yield from (plots[first : first + _PLOTS_A_ROW] for first in range(0, len(plots), _PLOTS_A_ROW))


@style.own_settings(style.PLOT_SETTINGS)
def draw_power(power: Powers, block: PlannedBlock) -> Figure:
    """Draw the power of one block against the number of participants."""
    rows = list(_plot_rows(power, block))
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, 0.7 + 1.45 * len(rows)), layout="constrained")
    figure.suptitle(
        f"{block.title}: proportion of {power.studies} studies with SIMULATED participants, by number of participants\n"
        f"α = {power.plan.decided.alpha:g}; line: {_participants_phrase(next(iter(power.kinds)))}; band: range across "
        "all types of participant; dashed line: no effect",
        fontsize=7.5,
    )
    for row, plots in enumerate(rows):
        for column, (title, question, curves) in enumerate(plots):
            axes = figure.add_subplot(len(rows), _PLOTS_A_ROW, row * _PLOTS_A_ROW + column + 1)
            axes.set_title(textwrap.fill(title, _TITLE_LETTERS))
            axes.set_ylim(-0.02, 1.04)
            axes.yaxis.set_major_formatter(PercentFormatter(1.0))
            axes.set_yticks((0.0, 0.5, WANTED, 1.0))
            axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
            axes.tick_params(labelleft=column == 0, labelsize=SMALL)
            if column == 0:
                axes.set_ylabel(HEADS[question], fontsize=SMALL)
            _draw_curves(axes, power, curves)
    delays = {str(line.get_label()): line for axes in figure.axes for line in axes.lines if line.get_gid() == "delay"}
    if delays:
        figure.legend(delays.values(), delays, loc="outside lower center", ncols=len(delays), frameon=False)
    return figure


def _draw_curves(axes: Axes, powers: Powers, curves: Sequence[Curve]) -> None:
    """Draw a curve, its range over kinds of participants, and that without any effect; one line per delay."""
    for place, curve in enumerate(curves):
        if curve.setting is not None:
            proportion = place / max(len(curves) - 1, 1)
            label: Style = {"label": curve.setting, "gid": "delay", "markersize": 3}
            axes.plot(powers.sizes, curve.power, color=DELAYS(proportion), marker=".", **label)
            continue
        kinds = [kind.power for kind in powers.curves_by_kind(curve)]
        low, high = np.min(kinds, axis=0), np.max(kinds, axis=0)
        axes.fill_between(powers.sizes, low, high, color=style.BAND, linewidth=0)
        axes.plot(powers.sizes, curve.power, color=style.ACCENT, marker=".", markersize=3)
        if curve.alarms is not None:
            axes.plot(powers.sizes, curve.alarms, color=style.PARTICIPANT, linewidth=0.9, linestyle="--")


def write_power(power: Powers, to: Path) -> tuple[Path, ...]:
    """Write tables (CSV, Markdown) and one figure per block (PNG, SVG, PDF) into ``to``; return the files.

    Raises
    ------
    AnalysisError
        ``to`` cannot be written; nothing was written.
    """
    files = {"power.md": power_markdown(power).encode(), "power.csv": power_csv(power)}
    for block in power.plan.blocks:
        title = f"{power.plan.name}: power of {block.title}"
        figure = draw_power(power, block)
        for form in style.FORMATS:
            files[f"power-{block.id}.{form}"] = style.file_bytes(figure, form, title, style.PLOT_SETTINGS)
    return write_files(Path(to), files)
