"""The sentences of the methods paragraph about blocks with a design: design, method, function, prior, estimator."""

from collections.abc import Iterator, Sequence
from typing import Final

from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.results.words import listed
from study_app.analysis.statistics.psychometrics.goodness import SETS
from study_app.analysis.statistics.random_effects import FEWEST
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.protocol.trials.stimuli import ANALYSIS_LAPSES

FAMILIES: Final = {"weibull": "Weibull", "normal": "cumulative normal", "logistic": "logistic"}
LEVELS: Final = {"weber": "Weber fractions", "difference": "differences", "value": "values"}


def level_methods(blocks: Sequence[LevelBlock], levels: Sequence[LevelsFound]) -> Iterator[str]:
    """Yield the sentences about blocks whose key is open and that have answers."""
    by_id = {block.id: block for block in blocks}
    opened = [found for found in levels if found.revealed and (found.answers or found.settings)]
    for found in opened:
        yield from _of_block(by_id[found.block], found)
    if any(found.thresholds for found in opened):
        yield (
            "Thresholds are posterior medians over a grid with equal-tailed 95 % intervals, from all counted answers "
            "at the levels delivered to the hand. The deviance was compared with that of "
            f"{SETS} simulated sets of answers, and drift is the correlation of trial number and deviance residual "
            "(Wichmann & Hill 2001). Group means are random-effects means with the between-person variance of Paule "
            f"and Mandel (1982) and, from {FEWEST} participants on, the interval of Hartung and Knapp (2001)."
        )
    if any(found.exponents and found.summary == "geometric mean" for found in opened):
        yield (
            "The exponent of magnitude estimation (Stevens 1957) is the slope of the mean ln answer at each level on "
            "ln level, by least squares for each participant; the group’s is the mean with Student’s 95 % interval."
        )
    if any(found.exponents and found.thresholds for found in opened):
        yield (
            "The Weber exponent is the slope of ln JND on ln standard, by least squares for each participant; the "
            "group’s is the mean with Student’s 95 % interval."
        )
    if any(found.settings for found in opened):
        yield (
            "The point of subjective equality is the mean of a participant’s settings, the just-noticeable difference "
            "their standard deviation, the constant error the difference of mean and standard, and the hysteresis that "
            "of settings that started high and low, all of the logarithm of the level where levels are spaced so "
            "(Gescheider 1997). Group values are means over participants with Student’s 95 % interval."
        )
    if any(one.d_prime is not None for found in opened for one in found.sensitivities):
        yield (
            "Sensitivity is d′ from rates with the log-linear correction (Hautus 1995), by the model of each design "
            "(Macmillan & Creelman 2005)."
        )


def _of_block(block: LevelBlock, found: LevelsFound) -> Iterator[str]:
    stimulus = block.stimulus
    if stimulus is None:
        yield f"In “{found.title}” conditions were compared by {block.design.paper_name}."
        return
    held = {one.standard for one in found.answers} | {one.standard for one in found.settings}
    standards = sorted(one for one in held if one is not None)
    against = f" of {listed([f'{one:g}' for one in standards])} {found.unit}".rstrip() if standards else ""
    kind = LEVELS[stimulus.level_kind]
    low, high = stimulus.levels
    if found.settings:
        to = against.replace(" of ", " to the standard ", 1) if block.design.intervals > 1 else ""
        yield (
            f"In “{found.title}” participants set {found.quantity}{to} by {block.design.paper_name}, within {kind} "
            f"from {low:g} to {high:g}, starting alternately near either end."
        )
        return
    chosen = "" if block.method is None else f"; levels were chosen by {block.method.paper_name}"
    yield (
        f"In “{found.title}” {found.quantity} was judged by {block.design.paper_name}, at {kind}{against} from {low:g} "
        f"to {high:g}{chosen}."
    )
    if found.thresholds and block.assumed is not None:
        median, factor = block.assumed.width_prior
        family, log = FAMILIES[block.assumed.family], stimulus.spacing == "log"
        yield (
            f"A {family} function of the {'logarithm of the ' if log else ''}level was fitted, with a "
            f"flat prior on the threshold, a log-normal one on the width (median {median:.3g} "
            f"{'decades' if log else 'units of the level'}, factor {factor:.3g}) and lapse rates up to "
            f"{100 * max(ANALYSIS_LAPSES):.0f} %."
        )
