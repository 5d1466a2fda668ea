"""The precision of thresholds, d′, d_a and exponents as tables: CSV with a row for each pair of sizes, and Markdown."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from study_app import __version__
from study_app.analysis.power.power_curves import interval
from study_app.analysis.power.threshold_studies import Found, Plan, plans
from study_app.analysis.tables.compared_blocks import spoken
from study_app.protocol.checks.expected_precision import RatingPlan, SensitivityPlan, ThresholdPlan
from study_app.protocol.model import Protocol
from study_app.protocol.table import text_in
from study_app.psychophysics.precision import BETWEEN_PEOPLE, ESTIMATE_NOISE
from study_app.store.tables.csv_files import Column, csv_bytes, optional

COLUMNS: Final = (
    Column("study", "text", "Short name of the study, from its protocol."),
    Column("simulated", "flag", "true: all of these answers come from a model, none from people."),
    Column("block", "text", "Id of the block of trials."),
    Column(
        "trials",
        "integer",
        "Trials of each standard, comparison or rated level; of magnitude estimation, all.",
        minimum=1,
    ),
    Column("participants", "integer", "Participants of each study.", minimum=2),
    Column("studies", "integer", "Simulated studies.", minimum=1),
    optional(
        "spread",
        "number",
        "Standard deviation of the logarithm of one participant's threshold; of d′, d_a and exponents, as a share of "
        "them; empty where limits clip the levels.",
        minimum=0,
    ),
    optional(
        "half_interval",
        "number",
        "Half the 95 % interval of the group's mean, as a share of it: median of the studies.",
        minimum=0,
    ),
    optional("precision", "number", "The planned half interval; n/a: none.", minimum=0),
    optional("within", "number", "Share of the studies that reach it.", minimum=0, maximum=1),
    optional("within_low", "number", "Lower end of the share's 95 % interval.", minimum=0, maximum=1),
    optional("within_high", "number", "Upper end of it.", minimum=0, maximum=1),
)


@dataclass(frozen=True)
class Precisions:
    """What so many simulated studies of each size found.

    ``found`` is by block and trials of each standard; ``asked`` says how many studies were to be simulated.
    """

    protocol: Protocol
    sizes: tuple[int, ...]
    studies: int
    asked: int
    seed: int
    found: Mapping[tuple[str, int], Found]

    @property
    def precision(self) -> float | None:
        """The planned half interval, as a share of the mean."""
        decided = self.protocol.analysis
        return None if decided is None else decided.precision


def threshold_csv(precisions: Precisions) -> bytes:
    """Return a row for every block, number of trials and size."""
    return csv_bytes(COLUMNS, _rows(precisions))


def _rows(all_of_it: Precisions) -> Iterator[dict[str, Any]]:
    precision = all_of_it.precision
    for (block, trials), found in all_of_it.found.items():
        for place, size in enumerate(all_of_it.sizes):
            half = found.half(place)
            known = precision is not None and not math.isnan(half)
            within = found.within(place, precision) if precision is not None and known else None
            low, high = (None, None) if within is None else interval(within, all_of_it.studies)
            yield {
                "study": all_of_it.protocol.study.name,
                "simulated": True,
                "block": block,
                "trials": trials,
                "participants": size,
                "studies": all_of_it.studies,
                "spread": round(found.spread, 4) if math.isfinite(found.spread) else None,
                "half_interval": round(half, 4) if math.isfinite(half) else None,
                "precision": precision,
                "within": None if within is None else round(within, 4),
                "within_low": None if low is None else round(low, 4),
                "within_high": None if high is None else round(high, 4),
            }


def threshold_markdown(precisions: Precisions) -> str:
    """Return a table for each block, with what it is based on."""
    study, precision = precisions.protocol.study, precisions.precision
    language = spoken({"study": {"languages": study.languages}})
    lines = [
        f"# Expected precision of {text_in(study.title, language)} ({study.name} {study.version})",
        "",
        f"**SIMULATED.** {precisions.studies} studies for each row (seed {precisions.seed}, liquid-study "
        f"{__version__}). People differ by a factor of {BETWEEN_PEOPLE:g}. Results are estimated as in the report.",
    ]
    if precisions.studies < precisions.asked:
        lines += ["", f"**Ended early: {precisions.studies} of {precisions.asked} studies.**"]
    wanted = [] if precision is None else [f"studies within ±{100 * precision:g} %"]
    heads = ["participants", "SD of one participant", "half the group's 95 % interval", *wanted]
    planned = plans(precisions.protocol, ())
    blocks = precisions.protocol.blocks
    for block in dict.fromkeys(block for block, _ in precisions.found):
        lines += ["", f"## {text_in(blocks[block].title, language)} (block {block})", "", _assumed(planned[block]), ""]
        trials_of = "trials" + next(iter(planned[block].values())).per
        lines += [f"| {' | '.join((trials_of, *heads))} |", "|---:" * (1 + len(heads)) + "|"]
        for (of_block, trials), found in precisions.found.items():
            if of_block != block:
                continue
            for place, size in enumerate(precisions.sizes):
                half = found.half(place)
                share = "–" if math.isnan(half) else f"{found.within(place, precision or 0.0):.0%}"
                spread = f"{found.spread:.0%}" if math.isfinite(found.spread) else "–"
                cells = (str(trials), str(size), spread, f"±{half:.0%}" if math.isfinite(half) else "–")
                lines.append(f"| {' | '.join((*cells, *([share] if wanted else [])))} |")
    return "\n".join(lines) + "\n"


def _assumed(plans_of_block: Mapping[int, Plan]) -> str:
    """Return what the simulated people of a block are like, and what the group's interval is."""
    plan = next(iter(plans_of_block.values()))
    if isinstance(plan, ThresholdPlan):
        return (
            "Observers answer by a psychometric function with a lapse rate of 2 %; the mean of their thresholds is in "
            "the middle half of the levels. The group's interval is that of the mean over all standards "
            "(Hartung–Knapp)."
        )
    group = "The group's interval is that of the mean (Student)."
    if isinstance(plan, SensitivityPlan):
        return f"Observers are unbiased, with a mean d′ of {plan.value:g}; SD as a share of it. {group}"
    if isinstance(plan, RatingPlan):
        return (
            f"Observers have a mean d_a of {plan.value:g} between a level and the lowest, and use all {plan.points} "
            f"points of the scale about equally often; SD as a share of d_a. {group}"
        )
    return (
        f"Observers follow a power law with a mean exponent of {plan.value:g}; ln answers have a standard deviation of "
        f"{ESTIMATE_NOISE:g}; SD as a share of the exponent. {group}"
    )
