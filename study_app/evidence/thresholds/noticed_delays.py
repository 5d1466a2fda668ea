"""Comparison of the delay that people rate as noticed with the one that they detect, for the same simulated people.

A person perceives a delay with Gaussian noise, whose spread follows from the person's just-noticeable difference. In
``delaydetect`` the person chooses the interval that seems more delayed. In ``rek2024`` the person rates the statement
``different`` after each delay by comparing the noisy delay with a personal criterion, as in the answer model of
rehearsals. Both sets of answers are analysed as in the report. The figure shows the proportions over the delay, and
both thresholds over the criterion.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from study_app import figure_style as style
from study_app.analysis.statistics import Threshold, detection_threshold
from study_app.evidence.table import Evidence, Table
from study_app.evidence.thresholds.known_values import KnownThreshold, known_value
from study_app.protocol.load import load
from study_app.protocol.randomization import Draw, stream
from study_app.protocol.simulated import NO_FEATURES, Observer, Rater, rate, rater
from study_app.protocol.trials import LINEAR_WIDTH
from study_app.psychophysics.families import success
from study_app.psychophysics.people import draw_normal

JND_S: Final = 0.045
"""Just-noticeable difference of a delay at 75 % correct in two intervals [s] (Vogels 2004)."""
_BETWEEN_PEOPLE: Final = 1.2
MEAN_CRITERION_S: Final = 0.13
"""Mean criterion of the answer model [s], chosen to agree with the thesis."""
CRITERIA_S: Final = (0.06, 0.095, MEAN_CRITERION_S, 0.165)
_ADAPTED_S: Final = 0.03
"""Adaptation: the shift, by earlier delays, of the delay that is perceived as none [s]."""
_STATEMENT: Final = "different"
LIKERT, FORCED_CHOICE = "rek2024", "delaydetect"


@dataclass(frozen=True, slots=True)
class Person:
    """A simulated participant of both procedures.

    ``observer.delay_noise_s`` is the standard deviation of the perceived delay, ``rater.threshold_s`` the criterion.
    """

    observer: Observer
    rater: Rater


@dataclass(frozen=True, slots=True)
class Rated:
    """The ratings of all participants for one mean criterion [s].

    ``adapted_s`` is the shift of the delay that is perceived as none [s]; ``found`` is the delay at which half of the
    ratings agree, as in the report.
    """

    criterion_s: float
    adapted_s: float
    found: Threshold


class Detected(NamedTuple):
    """A threshold and its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Compared:
    """The results of both procedures for the same participants.

    ``detected_ms`` is the group's threshold in the forced choice [ms]; ``ratings`` are the ratings by criterion,
    the last one after adaptation.
    """

    people: int
    seed: int
    detected_ms: Detected
    ratings: tuple[Rated, ...]


def draw_people(count: int, seed: int) -> tuple[Person, ...]:
    """Return participants whose just-noticeable differences differ by a factor of 1.2."""
    people = []
    for number in range(1, count + 1):
        draw = stream(seed, f"noticed/person/{number}").random
        jnd_s = JND_S * _BETWEEN_PEOPLE ** draw_normal(draw)
        people.append(Person(Observer(delay_jnd_s=jnd_s), rater(draw)))
    return tuple(people)


def compare_delays(count: int, seed: int) -> Compared:
    """Return the delays that ``count`` participants (at least three) detect, and those that they rate as noticed."""
    people = draw_people(count, seed)
    conditions = [(criterion_s, 0.0) for criterion_s in CRITERIA_S] + [(MEAN_CRITERION_S, _ADAPTED_S)]
    return Compared(
        count,
        seed,
        detect_threshold(people, seed),
        tuple(rate_delays(people, *condition, seed) for condition in conditions),
    )


def detect_threshold(people: Sequence[Person], seed: int) -> Detected:
    """Return the group's threshold in `FORCED_CHOICE` with its 95 % interval [ms]."""
    known = known_value(FORCED_CHOICE, load(FORCED_CHOICE))
    assert isinstance(known, KnownThreshold)  # noqa: S101 - it has only forced choices
    (group,) = known.simulate(0, seed, observers=[person.observer for person in people]).group
    return Detected(value=group.value, low=group.low, high=group.high)


def rate_delays(people: Sequence[Person], criterion_s: float, adapted_s: float, seed: int) -> Rated:
    """Return the delay above which participants agree with "different" in `LIKERT`.

    The participants' deviations from the mean criterion [s] and the noise are the same for every criterion.
    """
    protocol = load(LIKERT)
    (block,) = (main_block for main_block in protocol.main_blocks if protocol.compared_in(main_block.id) == "delays")
    delays_ms = sorted(protocol.conditions[name].delay_ms for name in block.conditions)
    answers = []
    for number, person in enumerate(people, start=1):
        draw = stream(seed, f"noticed/ratings/{number}").random
        person_rater = replace(person.rater, threshold_s=person.rater.threshold_s - MEAN_CRITERION_S + criterion_s)
        answers.append([_rating(replace(person, rater=person_rater), ms / 1000 - adapted_s, draw) for ms in delays_ms])
    return Rated(criterion_s, adapted_s, detection_threshold(np.array(answers, float), delays_ms))


def _rating(person: Person, delay_s: float, draw: Draw) -> int:
    perceived_s = delay_s + person.observer.delay_noise_s * draw_normal(draw)
    return rate([_STATEMENT], replace(NO_FEATURES, delay_s=perceived_s), person.rater, draw)[_STATEMENT]


_THESIS_MS: Final = 125.0
GUESS, LAPSE = 0.5, 0.02
TITLE: Final = "Which delays are noticed? Two questions, the same participants"


@style.own_settings(style.PLOT_SETTINGS)
def draw(comparison: Compared) -> Figure:
    """Draw both panels."""
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, 3.6), layout="constrained")
    figure.suptitle(f"{TITLE}: SIMULATED participants, n = {comparison.people}", fontsize=7.5)
    proportions, thresholds = figure.subplots(1, 2)
    proportions.set(title="Answers at each delay", xlabel="Delay, ms", xticks=[0, 50, 75, 100, 125, 150, 200])
    proportions.set(ylim=(-0.03, 1.03), yticks=[0.0, 0.5, 0.75, 1.0])
    proportions.yaxis.set_major_formatter(PercentFormatter(1.0))
    criteria = [1000 * rating.criterion_s for rating in comparison.ratings if not rating.adapted_s]
    thresholds.set(title="Threshold, ms", xlabel="Mean criterion of the ratings, ms", xlim=(50, 175), xticks=criteria)
    thresholds.set(ylim=(0, 205), yticks=[0, 50, 100, 150, 200])
    delays, (middle, low, high) = np.linspace(1.0, 200.0, 200), comparison.detected_ms
    correct = success("weibull", np.log10(delays), np.log10(middle), LINEAR_WIDTH, GUESS, LAPSE)
    proportions.plot(delays, correct, color=style.TEXT, dashes=(4, 2), label=f"{FORCED_CHOICE}, correct")
    proportions.plot([middle], [GUESS + (1 - GUESS - LAPSE) / 2], "s", markersize=4, color=style.TEXT)
    thresholds.axhspan(low, high, color=style.BAND, linewidth=0)
    thresholds.axhline(middle, color=style.TEXT, dashes=(4, 2), label=FORCED_CHOICE)
    thresholds.axhline(_THESIS_MS, color=style.TEXT_SOFT, linewidth=0.8, dashes=(1, 1.5), label="thesis, 125 ms")
    for rating, colour in zip(comparison.ratings, (*style.STEPS[1 : 1 + len(criteria)], style.WARN), strict=True):
        threshold, criterion_ms = rating.found, 1000 * rating.criterion_s + (5 if rating.adapted_s else 0)
        if threshold.effect is None or threshold.width is None or threshold.guess is None or threshold.lapse is None:
            continue
        if threshold.lower is not None and threshold.upper is not None:
            thresholds.plot(
                [criterion_ms, criterion_ms], [threshold.lower, threshold.upper], color=colour, linewidth=1.0
            )
        name = f"adapted to {1000 * rating.adapted_s:.0f} ms" if rating.adapted_s else LIKERT
        label = name if rating.adapted_s or criterion_ms == criteria[0] else None
        thresholds.plot(
            [criterion_ms],
            [threshold.effect],
            "D" if rating.adapted_s else "o",
            markersize=4,
            color=colour,
            label=label,
        )
        if not rating.adapted_s:
            proportions.plot(
                threshold.levels, np.array(threshold.yes) / threshold.asked, "o", markersize=3, color=colour
            )
            agree = success("logistic", delays, threshold.effect, threshold.width, threshold.guess, threshold.lapse)
            proportions.plot(delays, agree, color=colour, label=f"{LIKERT}, {criterion_ms:.0f} ms")
    for axes in (proportions, thresholds):
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=2, frameon=False, fontsize=7.2)
    return figure


_CAPTION: Final = (
    "Simulated participants answer two questions about the visual delay. Left: proportion correct in the forced "
    f"choice of {FORCED_CHOICE} (dashed line) and proportion agreeing with “different” in {LIKERT} (dots with "
    "fitted curves), for mean criteria of 60, 95, 130 and 165 ms. Right: both thresholds against the criterion, "
    "with 95 % intervals; the forced-choice threshold does not depend on it. Diamond: participants who have adapted "
    f"to a delay of 30 ms. The answer model's criterion is {1000 * MEAN_CRITERION_S:.0f} ms, chosen to agree "
    "with the thesis."
)


def noticed_delays_evidence(comparison: Compared) -> Evidence:
    """Return both thresholds as a table, and the figure (PNG, SVG, PDF) with its caption."""
    middle, low, high = comparison.detected_ms
    rows = [(f"{FORCED_CHOICE}: forced choice, 75 % correct", "–", f"{middle:.0f} ms", f"{low:.0f} to {high:.0f} ms")]
    for rating in comparison.ratings:
        adapted = f", adapted to {1000 * rating.adapted_s:.0f} ms" if rating.adapted_s else ""
        name = f"{LIKERT}: rating of “{_STATEMENT}”, half agree{adapted}"
        effect, threshold = rating.found.effect, rating.found
        value = "none" if effect is None else f"{effect:.0f} ms"
        known = threshold.lower is not None and threshold.upper is not None
        ends = f"{threshold.lower:.0f} to {threshold.upper:.0f} ms" if known else "–"
        rows.append((name, f"{1000 * rating.criterion_s:.0f} ms", value, ends))
    table = Table(("procedure", "criterion", "threshold", "95 % interval"), rows, left=1)
    head = f"**SIMULATED.** The same {comparison.people} participants in both procedures, seed {comparison.seed}."
    text = f"{head}\n\n{table.markdown()}\n"

    def figures() -> dict[str, bytes]:
        figure = draw(comparison)
        return {
            f"delay-thresholds.{form}": style.file_bytes(figure, form, TITLE, style.PLOT_SETTINGS)
            for form in style.FORMATS
        }

    return Evidence(text, {"delay-thresholds.md": text, "delay-thresholds.txt": f"{_CAPTION}\n"}, figures)
