"""The part of a block's section that only a block with a design has: thresholds, sensitivity and bias."""

from collections.abc import Iterator, Mapping
from typing import Final

from study_app.analysis.figures.levels.level_figure import level_words
from study_app.analysis.figures.picture import Picture
from study_app.analysis.report.answers.level_methods import FAMILIES
from study_app.analysis.report.html_page import drawn, heading, paragraph, table
from study_app.analysis.results.level_results import LevelsFound, SensitivityFound, ThresholdFound
from study_app.analysis.results.words import number
from study_app.analysis.statistics.psychometrics.goodness import SETS

WIDTHS: Final = {"log": "decades", "linear": "level"}
BEYOND: Final = {None: "", "above": "above ", "below": "below "}
MODELS: Final = {
    "differencing": " d′ is that of the differencing model, since standards vary from trial to trial.",
    "independent": " d′ is that of independent observations; the differencing model is in the table of thresholds.",
}

EXPONENT: Final = (
    "The exponent is the least-squares slope of ln JND on ln standard over the standards of a participant; the "
    "just-noticeable difference (JND) is the threshold in the unit of the standard. 1 is Weber’s law (the JND is "
    "proportional to the standard), 0 a constant JND. That of the group is the mean over participants with Student’s "
    "interval."
)

POWER_LAW: Final = (
    "The exponent n of answer ∝ levelⁿ (Stevens 1957) is the least-squares slope of a participant’s mean ln answer at "
    "each level on ln level, at the levels delivered to the hand; it does not depend on the unit that a participant "
    "chose. That of the group is the mean over participants with Student’s interval."
)


def section(found: LevelsFound, pictures: Mapping[str, Picture]) -> Iterator[str]:
    """Yield thresholds, sensitivity and bias, and times to answer of a block whose key is open."""
    if found.thresholds:
        yield heading(3, "Thresholds")
        yield _thresholds(found)
        yield paragraph(_threshold_words(found), "soft")
        yield from _published(found, exponents=False)
        yield from drawn(pictures, f"tracks-{found.block}")
        yield from drawn(pictures, f"weber-{found.block}")
    if found.exponents:
        yield heading(3, found.exponent_name[0].upper() + found.exponent_name[1:])
        yield _exponents(found)
        yield paragraph(EXPONENT if found.thresholds else POWER_LAW, "soft")
        yield from _published(found, exponents=True)
    if found.sensitivities:
        yield heading(3, "Sensitivity and bias")
        yield _sensitivities(found)
        yield paragraph(_sensitivity_words(found), "soft")
    if found.level_times:
        yield heading(3, "Time to answer by level")
        yield _times(found)


def _thresholds(found: LevelsFound) -> str:
    """Return a row per standard and participant, the group first."""
    standards = len({one.standard for one in found.thresholds}) > 1
    percent, compared = _target_percent(found), found.compared_percent
    with_device = any(found.with_device(one) is not None for one in found.thresholds)
    return table(
        (
            *((f"Standard{_unit(found)}",) if standards else ()),
            "Participant",
            "n",
            _threshold_name(found),
            "95 % interval",
            *((f"at {compared:g} %",) if compared is not None else ()),
            *(("with device damping",) if with_device else ()),
            f"width [{WIDTHS[found.spacing]}]",
            "flat width prior",
            *((f"mean of reversals ({percent:.1f} %)",) if percent is not None else ()),
            "fit (p)",
            "drift",
        ),
        [
            [
                *((_level(one.standard),) if standards else ()),
                one.participant or f"group of {one.n}",
                "–" if one.participant is None else str(one.n),
                f"{BEYOND[one.beyond]}{one.threshold:.3g}",
                "–" if one.low is None or one.high is None else f"{one.low:.3g} – {one.high:.3g}",
                *((_level(one.compared, 3),) if compared is not None else ()),
                *((_level(found.with_device(one), 3),) if with_device else ()),
                "–" if one.width is None else f"{one.width:.2g}",
                _level(one.flat_width, 3),
                *((_level(one.reversal_mean, 3),) if percent is not None else ()),
                _fit(one),
                _drift(one),
            ]
            for one in found.thresholds
        ],
        words=int(not standards),
    )


def _published(found: LevelsFound, *, exponents: bool) -> Iterator[str]:
    """Yield the published values that are exponents, or those that are not."""
    shown = [one.in_words() for one in found.published if (one.measure == "exponent") is exponents]
    if shown:
        yield paragraph(f"Published: {'; '.join(shown)}.")


def _exponents(found: LevelsFound) -> str:
    return table(
        ("Participant", "standards" if found.thresholds else "levels", "exponent", "95 % interval"),
        [
            [
                one.participant or f"group of {one.n}",
                "–" if one.participant is None else str(one.n),
                number(one.exponent),
                "–" if one.low is None or one.high is None else f"{number(one.low)} – {number(one.high)}",
            ]
            for one in found.exponents
        ],
    )


def _unit(found: LevelsFound) -> str:
    return f" [{found.unit}]" if found.unit else ""


def _threshold_name(found: LevelsFound) -> str:
    """Return what a threshold is, with its unit."""
    if found.level_kind == "weber":
        return "threshold (Weber fraction)"
    return "threshold" + _unit(found)


def _target_percent(found: LevelsFound) -> float | None:
    return next((one.target_percent for one in found.own_thresholds), None)


def _level(value: float | None, digits: int = 4) -> str:
    return "–" if value is None else f"{value:.{digits}g}"


def _fit(one: ThresholdFound) -> str:
    if one.fit_p is None:
        return "–"
    return f"{one.fit_p:.3f}{'' if one.fits else ': the function does not fit'}"


def _drift(one: ThresholdFound) -> str:
    return "–" if one.drift is None else f"{one.drift:+.2f}{'!' if one.drifts else ''}".replace("-", "−")


def _threshold_words(found: LevelsFound) -> str:
    at = "" if found.guess_rate is None else f" ({50 * (1 + found.guess_rate):.3g} % {found.counts})"
    percent = _target_percent(found)
    catch = ", those to catch trials included" if found.has_catch_trials else ""
    reversals = (
        ""
        if percent is None
        else f" The mean of reversals is the classical estimate of an up–down track, at {percent:.1f} % {found.counts}."
    )
    compared = (
        ""
        if found.compared_percent is None
        else f" “At {found.compared_percent:g} %” is the level at which the published value was measured."
    )
    function = FAMILIES[found.family or ""]
    return (
        f"A threshold is the level ({level_words(found)}) at which the {function} function is half-way between "
        f"guesses and lapses{at}: posterior median with an equal-tailed 95 % interval, from all counted answers, at "
        f"the levels delivered to the hand. The width, from 5 to 95 % of the rise, has a log-normal prior; "
        f"the next column is the threshold under a flat one. “Above” and “below” mark thresholds beyond the levels "
        f"presented. The group is the random-effects mean (Paule–Mandel), with the interval of Hartung and Knapp from "
        f"three participants on."
        f"{compared}{reversals} Fit: p of the deviance among {SETS} simulated sets of answers. Drift: correlation of "
        f"trial number and deviance residual, with “!” beyond 2/√n. n counts answers{catch}."
    )


def _sensitivities(found: LevelsFound) -> str:
    """Return a row per standard, comparison or level and participant, the group first."""
    ones = found.sensitivities
    wheres = len({_where(one) for one in ones}) > 1
    where = (
        f"Standard{_unit(found)}"
        if ones[0].standard is not None
        else "Level"
        if ones[0].level is not None
        else "Comparison"
    )
    measured = any(one.d_prime is not None for one in ones)
    biased = any(one.criterion is not None for one in ones)
    answers = tuple(ones[0].shares)
    return table(
        (
            *((where,) if wheres else ()),
            "Participant",
            "n",
            *(("d′", "95 % interval") if measured else ()),
            *(("k" if found.design == "samedifferent" else "c",) if biased else ()),
            *(f"“{answer.replace('_', ' ')}”" for answer in (answers[:1] if len(answers) == 2 else answers)),
        ),
        [
            [
                *((_where(one),) if wheres else ()),
                one.participant or f"group of {one.n}",
                "–" if one.participant is None else str(one.n),
                *((number(one.d_prime), _interval(one)) if measured else ()),
                *((number(one.criterion),) if biased else ()),
                *(f"{100 * one.shares[answer]:.0f} %" for answer in (answers[:1] if len(answers) == 2 else answers)),
            ]
            for one in ones
        ],
        words=int(not wheres),
    )


def _times(found: LevelsFound) -> str:
    """Return a row per standard and level, with the median times of correct and of other answers."""
    standards = len({one.standard for one in found.level_times}) > 1
    return table(
        (
            *((f"Standard{_unit(found)}",) if standards else ()),
            level_words(found),
            "n correct",
            "median, correct [s]",
            "n incorrect",
            "median, incorrect [s]",
        ),
        [
            [
                *((_level(one.standard),) if standards else ()),
                _level(one.low, 3) if one.low == one.high else f"{one.low:.3g} – {one.high:.3g}",
                str(one.right_n),
                number(one.right_s),
                str(one.wrong_n),
                number(one.wrong_s),
            ]
            for one in found.level_times
        ],
        words=0,
    )


def _where(one: SensitivityFound) -> str:
    if one.comparison is not None:
        return one.comparison.replace("_", " ")
    value = one.level if one.standard is None else one.standard
    return "–" if value is None else f"{value:.4g}"


def _interval(one: SensitivityFound) -> str:
    return "–" if one.low is None or one.high is None else f"{number(one.low)} – {number(one.high)}"


def _sensitivity_words(found: LevelsFound) -> str:
    shares = "Percentages are shares of the answers." if found.sensitivities[0].shares else ""
    if all(one.d_prime is None for one in found.sensitivities):
        return shares
    over = "over all levels presented" if found.vary is not None else "for each comparison"
    if found.summary == "mean":
        over = "of each level against the lowest, as d_a from the area under the ROC curve"
    bias = {
        "2ifc": " c is above 0 where the second interval is preferred.",
        "yesno": " c is above 0 where “no” is preferred.",
        "samedifferent": " k is the difference above which the answer is “different”.",
    }.get(found.design, "")
    model = MODELS.get(found.sensitivities[0].model or "", "")
    return (
        f"d′ {over}, from rates with the log-linear correction (Hautus 1995; Macmillan & Creelman 2005); that of the "
        f"group is the mean over participants with Student’s interval.{model}{bias} {shares}"
    ).rstrip()
