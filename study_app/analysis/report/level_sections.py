"""The section of a block of levels: times to answer and, once the key is open, all that was found."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from typing import Any, Final

from study_app.analysis.figures.level_figures import level_words, mean_words, summary_words, with_unit
from study_app.analysis.figures.page_layout import Picture
from study_app.analysis.levels.results import LevelAnswers, LevelsFound, SensitivityFound, SettingFound, ThresholdFound
from study_app.analysis.report.html_page import drawn, heading, paragraph, table
from study_app.analysis.report.sentences import FAMILIES
from study_app.analysis.results import counted, listed, number
from study_app.analysis.statistics.thresholds import SETS
from study_app.protocol.checks.delayed_force import WITHHELD_PERCENT

WITHHELD_EXPLAINED = (
    "Share of the requested force that limits, passivity controller and device withheld in the comparisons, those of "
    "trials that were presented again included: a late force pushes the hand, and the passivity controller limits "
    "the energy that it returns. What is withheld is not the force that the study is about."
)

WIDTH_UNITS: Final = {"log": "decades", "linear": "level"}
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

SEALED = (
    "Not yet revealed: standards, levels, what each interval presented, and which answers were correct. They appear "
    "here after unblinding."
)

EXPLAINED = (
    "{mean} over the participants, with the 95 % interval by Student's t where at least two participants differ. "
    "Below: each participant, with the number of answers."
)

OWN_UNITS = " The interval leaves out that each participant chose a unit: ln answers less the participant's mean."


def level_section(found: LevelsFound, pictures: Sequence[Picture], estimator: str | None) -> Iterator[str]:
    """Yield what a block's section says in addition to the counts of its answers.

    ``estimator`` is the name of the servo's velocity estimator, None where the receipt has none.
    """
    yield heading(3, "Time to answer")
    yield table(
        ("Setting" if found.revealed else "Code", "n", "median [s]", "quartiles [s]"),
        [[one.name, *_time_cells(one.numbers)] for one in found.times],
    )
    at_each = "Answers at each level" if found.vary is not None or not found.revealed else "Answers"
    if not found.settings:
        yield heading(3, "Answers over levels" if found.adaptive else at_each)
    if not found.revealed:
        yield paragraph(SEALED)
        return
    if found.settings:
        yield from settings_part(found, {one.name: one for one in pictures})
        return
    if not found.answers:
        yield paragraph("No answer counts yet.")
        return
    if not found.adaptive:
        yield _of_group(found)
        explained = EXPLAINED.format(mean=mean_words(found).capitalize())
        yield paragraph(explained + (OWN_UNITS if found.own_units else ""), "soft")
    yield from drawn({one.name: one for one in pictures}, f"levels-{found.block}")
    if not found.adaptive:
        for standard in sorted({one.standard for one in found.answers}, key=lambda one: one or 0.0):
            yield _of_people(found, standard)
    yield from thresholds_part(found, {one.name: one for one in pictures})
    yield from conduct_part(found, estimator)
    yield from withheld(found)


def thresholds_part(found: LevelsFound, pictures: Mapping[str, Picture]) -> Iterator[str]:
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
        yield _answer_times(found)


def _thresholds(found: LevelsFound) -> str:
    """Return a row per standard and participant, the group first."""
    standards = len({one.standard for one in found.thresholds}) > 1
    percent, compared = _target_percent(found), found.compared_percent
    with_device = any(found.with_device(one) is not None for one in found.thresholds)
    return table(
        (
            *((f"Standard{_width_unit(found)}",) if standards else ()),
            "Participant",
            "n",
            _threshold_name(found),
            "95 % interval",
            *((f"at {compared:g} %",) if compared is not None else ()),
            *(("with device damping",) if with_device else ()),
            f"width [{WIDTH_UNITS[found.spacing]}]",
            "flat width prior",
            *((f"mean of reversals ({percent:.1f} %)",) if percent is not None else ()),
            "fit (p)",
            "drift",
        ),
        [
            [
                *((_threshold_level(one.standard),) if standards else ()),
                one.participant or f"group of {one.n}",
                "–" if one.participant is None else str(one.n),
                f"{BEYOND[one.beyond]}{one.threshold:.3g}",
                "–" if one.low is None or one.high is None else f"{one.low:.3g} – {one.high:.3g}",
                *((_threshold_level(one.compared, 3),) if compared is not None else ()),
                *((_threshold_level(found.with_device(one), 3),) if with_device else ()),
                "–" if one.width is None else f"{one.width:.2g}",
                _threshold_level(one.flat_width, 3),
                *((_threshold_level(one.reversal_mean, 3),) if percent is not None else ()),
                _fit(one),
                _drift(one),
            ]
            for one in found.thresholds
        ],
        words=int(not standards),
    )


def _target_percent(found: LevelsFound) -> float | None:
    return next((one.target_percent for one in found.own_thresholds), None)


def _threshold_name(found: LevelsFound) -> str:
    """Return what a threshold is, with its unit."""
    if found.level_kind == "weber":
        return "threshold (Weber fraction)"
    return "threshold" + _width_unit(found)


def _width_unit(found: LevelsFound) -> str:
    return f" [{found.unit}]" if found.unit else ""


def _threshold_level(value: float | None, digits: int = 4) -> str:
    return "–" if value is None else f"{value:.{digits}g}"


def _fit(one: ThresholdFound) -> str:
    if one.fit_p is None:
        return "–"
    return f"{one.fit_p:.3f}{'' if one.fits else ': the function does not fit'}"


def _drift(one: ThresholdFound) -> str:
    return "–" if one.drift is None else f"{one.drift:+.2f}{'!' if one.drifts else ''}".replace("-", "−")


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


def _sensitivities(found: LevelsFound) -> str:
    """Return a row per standard, comparison or level and participant, the group first."""
    ones = found.sensitivities
    wheres = len({_sensitivity_where(one) for one in ones}) > 1
    where = (
        f"Standard{_width_unit(found)}"
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
                *((_sensitivity_where(one),) if wheres else ()),
                one.participant or f"group of {one.n}",
                "–" if one.participant is None else str(one.n),
                *((number(one.d_prime), _share_interval(one)) if measured else ()),
                *((number(one.criterion),) if biased else ()),
                *(f"{100 * one.shares[answer]:.0f} %" for answer in (answers[:1] if len(answers) == 2 else answers)),
            ]
            for one in ones
        ],
        words=int(not wheres),
    )


def _sensitivity_where(one: SensitivityFound) -> str:
    if one.comparison is not None:
        return one.comparison.replace("_", " ")
    value = one.level if one.standard is None else one.standard
    return "–" if value is None else f"{value:.4g}"


def _share_interval(one: SensitivityFound) -> str:
    return "–" if one.low is None or one.high is None else f"{number(one.low)} – {number(one.high)}"


def _answer_times(found: LevelsFound) -> str:
    """Return a row per standard and level, with the median times of correct and of other answers."""
    standards = len({one.standard for one in found.level_times}) > 1
    return table(
        (
            *((f"Standard{_width_unit(found)}",) if standards else ()),
            level_words(found),
            "n correct",
            "median, correct [s]",
            "n incorrect",
            "median, incorrect [s]",
        ),
        [
            [
                *((_threshold_level(one.standard),) if standards else ()),
                _threshold_level(one.low, 3) if one.low == one.high else f"{one.low:.3g} – {one.high:.3g}",
                str(one.right_n),
                number(one.right_s),
                str(one.wrong_n),
                number(one.wrong_s),
            ]
            for one in found.level_times
        ],
        words=0,
    )


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


def conduct_part(found: LevelsFound, estimator: str | None) -> Iterator[str]:
    """Yield the delivery of levels and the answers to catch trials; nothing where neither is known."""
    if found.conduct:
        yield heading(3, "Delivery of levels")
        yield _delivery(found)
        yield paragraph(_conduct_words(found, estimator), "soft")
    if found.catches:
        yield heading(3, "Catch trials")
        yield table(
            ("Participant", "session", "n", "incorrect", "share", "rule"),
            [
                [
                    one.participant,
                    str(one.session),
                    str(one.n),
                    str(one.wrong),
                    f"{100 * one.wrong / one.n:.0f} %",
                    f"{'excluded: above' if one.excludes else 'kept: at most'} {100 * one.most:g} %",
                ]
                for one in found.catches
            ],
        )
        yield paragraph("Catch trials present the largest level; they enter the fit of the threshold.", "soft")


def _delivery(found: LevelsFound) -> str:
    """Return a row per standard."""
    standards = any(one.standard is not None for one in found.conduct)
    unit = f" [{found.unit}]" if found.unit else ""
    digits = 4 if found.level_kind == "weber" else 3
    level = f"level error{'' if found.level_kind == 'weber' else unit}"
    return table(
        (
            *((f"Standard{unit}",) if standards else ()),
            *("trials", "repeated attempts", "measured", f"{level}, mean", "largest"),
            *("hand speed, RMS [m/s]", "apparent mass [kg]"),
        ),
        [
            [
                *(("–" if one.standard is None else f"{one.standard:.4g}",) if standards else ()),
                *(str(one.trials), str(one.repeated), str(one.measured)),
                *(number(one.error_mean, digits), number(one.error_largest, digits)),
                *(number(one.pace_mps, 3), number(one.apparent_mass_kg, 3)),
            ]
            for one in found.conduct
        ],
        words=0,
    )


def _conduct_words(found: LevelsFound, estimator: str | None) -> str:
    reasons: Counter[str] = Counter()
    for one in found.conduct:
        reasons.update(one.reasons)
    repeated = listed([f"{_limit(name)} in {counted(count, 'interval')}" for name, count in reasons.most_common()])
    with_estimator = f", with the velocity estimator {estimator}" if estimator else ""
    mass = f" Apparent mass: least-squares fit of F = −b v − m a to the force sent{with_estimator}."
    return (
        "Level error: delivered less requested level, from the recorded samples (delays: from the frames); fits take "
        f"delivered levels.{mass if any(one.apparent_mass_kg is not None for one in found.conduct) else ''} "
        f"{'Limits that intervals did not keep: ' + repeated + '.' if reasons else 'Every interval kept its limits.'}"
    )


def _limit(name: str) -> str:
    """Return the name of a limit in words: "pace error"."""
    return name.rpartition("_")[0].replace("_", " ") or name


def withheld(found: LevelsFound) -> Iterator[str]:
    """Yield the section; nothing where the force was prompt."""
    if not found.withheld:
        return
    standards = len({one.standard for one in found.withheld}) > 1
    unit = f" [{found.unit}]" if found.unit else ""
    yield heading(3, "Force withheld by safety")
    yield table(
        (*((f"Standard{unit}",) if standards else ()), f"Level{unit}", "intervals", "mean", "most"),
        [
            [
                *(((f"{one.standard:.4g}" if one.standard is not None else "–"),) if standards else ()),
                f"{one.low:.3g}" if one.low == one.high else f"{one.low:.3g} – {one.high:.3g}",
                str(one.n),
                f"{one.mean_percent:.1f} %",
                f"{one.most_percent:.1f} %",
            ]
            for one in found.withheld
        ],
        words=0,
    )
    yield paragraph(f"{' '.join(_withheld_words(found))} {WITHHELD_EXPLAINED}", "soft")


def _withheld_words(found: LevelsFound) -> Iterator[str]:
    """Yield for each standard up to which level hardly anything was withheld in any comparison."""
    unit = f" {found.unit}" if found.unit else ""
    for standard in dict.fromkeys(one.standard for one in found.withheld):
        rows = [one for one in found.withheld if one.standard == standard]
        kept = list(takewhile(lambda one: one.most_percent <= WITHHELD_PERCENT, rows))
        at = "" if standard is None else f" at the standard of {standard:.4g}{unit}"
        until = f"up to {kept[-1].high:.3g}{unit}" if kept else "at no level presented"
        yield f"At most {WITHHELD_PERCENT:g} % was withheld in every comparison {until}{at}."


def settings_part(found: LevelsFound, pictures: Mapping[str, Picture]) -> Iterator[str]:
    """Yield the settings of a block whose key is open."""
    yield heading(3, "Settings")
    yield _settings_table(found)
    yield paragraph(_settings_words(found), "soft")
    if found.published:
        yield paragraph(f"Published: {'; '.join(one.in_words() for one in found.published)}.")
    yield from drawn(pictures, f"settings-{found.block}")


def _settings_table(found: LevelsFound) -> str:
    """Return a row per standard and participant, the group first."""
    standards = len({one.standard for one in found.settings}) > 1
    compared = any(map(_has_error, found.settings))
    unit = "decades" if found.spacing == "log" else found.unit or "units of the level"
    return table(
        (
            *((f"Standard [{found.unit}]" if found.unit else "Standard",) if standards else ()),
            "Participant",
            "n",
            f"PSE [{found.unit}]" if found.unit else "PSE",
            "95 % interval",
            f"JND [{unit}]",
            *((f"constant error [{unit}]",) if compared else ()),
            f"hysteresis [{unit}]",
        ),
        [
            [
                *((_setting_number(one.standard, 4),) if standards else ()),
                one.participant or f"group of {one.n}",
                "–" if one.participant is None else str(one.n),
                f"{one.pse:.3g}",
                "–" if one.low is None or one.high is None else f"{one.low:.3g} – {one.high:.3g}",
                _setting_number(one.jnd),
                *((_signed(one.constant_error),) if compared else ()),
                _signed(one.hysteresis),
            ]
            for one in found.settings
        ],
        words=int(not standards),
    )


def _has_error(one: SettingFound) -> bool:
    return one.constant_error is not None


def _setting_number(value: float | None, digits: int = 3) -> str:
    return "–" if value is None else f"{value:.{digits}g}"


def _signed(value: float | None) -> str:
    return "–" if value is None else f"{value:+.3g}".replace("-", "−")


def _settings_words(found: LevelsFound) -> str:
    in_u = "logarithm of the level" if found.spacing == "log" else "level"
    error = " constant error: PSE − standard;" if any(map(_has_error, found.settings)) else ""
    return (
        f"Settings as levels ({level_words(found)}). PSE, the point of subjective equality: mean of the {in_u}, with "
        f"Student’s 95 % interval; JND, the just-noticeable difference: standard deviation;{error} hysteresis: "
        "settings that started high − settings that started low. The group has the means over participants, and "
        "the interval of its PSE is that over participants."
    )


def _of_group(found: LevelsFound) -> str:
    columns = list(_level_columns(found))
    return table(
        (*(name for name, _ in columns), "participants", "n", summary_words(found), "95 % interval"),
        [
            [
                *(_plain(getattr(one, what)) for _, what in columns),
                str(one.participants),
                str(one.n),
                _value(found, one.value),
                _interval(found, one),
            ]
            for one in found.of_group
        ],
        words=1 if found.vary is None else 0,
    )


def _level_columns(found: LevelsFound) -> Iterator[tuple[str, str]]:
    """Yield the columns that say what was presented: heading, and field of the answers."""
    unit = f" [{found.unit}]" if found.unit else ""
    if any(one.standard is not None for one in found.of_group):
        yield f"Standard{unit}", "standard"
    if found.level_kind not in {None, "value"}:
        yield level_words(found), "level"
    if found.level_kind == "value" and not any(one.standard is not None for one in found.of_group):
        yield level_words(found), "comparison"
    else:
        yield f"Comparison{unit}", "comparison"


def _value(found: LevelsFound, value: float) -> str:
    return f"{100 * value:.0f} %" if found.summary == "share" else f"{value:.3g}"


def _interval(found: LevelsFound, one: LevelAnswers) -> str:
    if one.low is None or one.high is None:
        return "–"
    return f"{_value(found, one.low)} – {_value(found, one.high)}"


def _plain(value: float | str | None) -> str:
    if value is None:
        return "–"
    return value.replace("_", " ") if isinstance(value, str) else f"{value:.4g}"


def _of_people(found: LevelsFound, standard: float | None) -> str:
    """Return a row per participant, a column per level."""
    shown = [one for one in found.of_group if one.standard == standard]
    own = {
        (one.participant, one.level, one.comparison): one
        for one in found.answers
        if one.standard == standard and not one.catch
    }
    names = [_plain(one.comparison if one.level is None else one.level) for one in shown]
    return table(
        ("Participant" if standard is None else f"Standard {with_unit(found, standard)}", *names),
        [
            [person, *(_level_cell(found, own.get((person, one.level, one.comparison))) for one in shown)]
            for person in found.people
        ],
    )


def _level_cell(found: LevelsFound, one: LevelAnswers | None) -> str:
    if one is None:
        return "–"
    if one.count is not None:
        return f"{one.count}/{one.n}"
    return f"{_value(found, one.value)} ({one.n})"


def _time_cells(numbers: Mapping[str, Any]) -> list[str]:
    low, high = numbers["q1"], numbers["q3"]
    return [str(numbers["n"]), number(numbers["median"]), "–" if low is None else f"{number(low)} – {number(high)}"]
