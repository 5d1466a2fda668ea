"""The section of a block of levels: times to answer and, once the key is open, all that was found."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import takewhile
from typing import Any, Final, TypeAlias

from study_app.analysis.figures.level_figures import level_words, mean_words, summary_words, with_unit
from study_app.analysis.figures.page_layout import Picture
from study_app.analysis.levels.results import (
    LevelAnswers,
    LevelsFound,
    LevelTimes,
    SensitivityFound,
    ThresholdFound,
    WithheldForce,
)
from study_app.analysis.report.html_page import drawn, heading, paragraph, table, table_of
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


Shown: TypeAlias = tuple[str, Callable[[Any], str]] | None
"""A column: its heading and what makes a cell of a row; None is one that is left out."""

OF_WHOM: Final[tuple[Shown, ...]] = (
    ("Participant", lambda one: one.participant or f"group of {one.n}"),
    ("n", lambda one: "–" if one.participant is None else str(one.n)),
)
"""The columns that say of whom a row is."""
INTERVAL: Final[Shown] = ("95 % interval", lambda one: _between(one.low, one.high, _digits))


def level_section(found: LevelsFound, pictures: Sequence[Picture], estimator: str | None) -> Iterator[str]:
    """Yield what a block's section says in addition to the counts of its answers.

    ``estimator`` is the name of the servo's velocity estimator, None where the receipt has none.
    """
    yield heading(3, "Time to answer")
    yield table_of(
        found.times,
        ("Setting" if found.revealed else "Code", lambda one: one.name),
        ("n", lambda one: str(one.numbers["n"])),
        ("median [s]", lambda one: number(one.numbers["median"])),
        ("quartiles [s]", lambda one: _between(one.numbers["q1"], one.numbers["q3"], number)),
    )
    at_each = "Answers at each level" if found.vary is not None or not found.revealed else "Answers"
    if not found.settings:
        yield heading(3, "Answers over levels" if found.adaptive else at_each)
    if not found.revealed:
        yield paragraph(SEALED)
        return
    if found.settings:
        yield from _settings(found, {one.name: one for one in pictures})
        return
    if not found.answers:
        yield paragraph("No answer counts yet.")
        return
    drawings = {one.name: one for one in pictures}
    if not found.adaptive:
        yield _of_group(found)
        explained = EXPLAINED.format(mean=mean_words(found).capitalize())
        yield paragraph(explained + (OWN_UNITS if found.own_units else ""), "soft")
    yield from drawn(drawings, f"levels-{found.block}")
    if not found.adaptive:
        for standard in sorted({one.standard for one in found.answers}, key=lambda one: one or 0.0):
            yield _of_people(found, standard)
    if found.thresholds:
        yield heading(3, "Thresholds")
        yield _thresholds(found)
        yield paragraph(_threshold_words(found), "soft")
        yield from _published(found, exponents=False)
        yield from drawn(drawings, f"tracks-{found.block}")
        yield from drawn(drawings, f"weber-{found.block}")
    if found.exponents:
        yield heading(3, found.exponent_name[0].upper() + found.exponent_name[1:])
        yield table_of(
            found.exponents,
            OF_WHOM[0],
            ("standards" if found.thresholds else "levels", lambda one: "–" if one.participant is None else str(one.n)),
            ("exponent", lambda one: number(one.exponent)),
            ("95 % interval", lambda one: _between(one.low, one.high, number)),
        )
        yield paragraph(EXPONENT if found.thresholds else POWER_LAW, "soft")
        yield from _published(found, exponents=True)
    if found.sensitivities:
        yield heading(3, "Sensitivity and bias")
        yield _sensitivities(found)
        yield paragraph(_sensitivity_words(found), "soft")
    if found.level_times:
        yield heading(3, "Time to answer by level")
        yield _by_standard(
            found,
            found.level_times,
            (level_words(found), _levels),
            ("n correct", lambda one: str(one.right_n)),
            ("median, correct [s]", lambda one: number(one.right_s)),
            ("n incorrect", lambda one: str(one.wrong_n)),
            ("median, incorrect [s]", lambda one: number(one.wrong_s)),
        )
    if found.conduct:
        yield heading(3, "Delivery of levels")
        yield _delivery(found)
        yield paragraph(_conduct_words(found, estimator), "soft")
    if found.catches:
        yield heading(3, "Catch trials")
        yield table_of(
            found.catches,
            ("Participant", lambda one: one.participant),
            ("session", lambda one: str(one.session)),
            ("n", lambda one: str(one.n)),
            ("incorrect", lambda one: str(one.wrong)),
            ("share", lambda one: f"{100 * one.wrong / one.n:.0f} %"),
            ("rule", lambda one: f"{'excluded: above' if one.excludes else 'kept: at most'} {100 * one.most:g} %"),
        )
        yield paragraph("Catch trials present the largest level; they enter the fit of the threshold.", "soft")
    yield from withheld(found)


def _by_standard(found: LevelsFound, rows: Sequence[Any], *columns: Shown, words: int = 0) -> str:
    """Return a table that has, where rows are at several standards, the standard as its first column."""
    several = len({one.standard for one in rows}) > 1
    return table_of(rows, _standard(found) if several else None, *columns, words=0 if several else words)


def _standard(found: LevelsFound) -> Shown:
    return f"Standard{_unit(found)}", lambda one: _digits(one.standard, 4)


def _thresholds(found: LevelsFound) -> str:
    """Return a row per standard and participant, the group first."""
    percent, compared, weber = _target_percent(found), found.compared_percent, found.level_kind == "weber"
    with_device = any(found.with_device(one) is not None for one in found.thresholds)

    def fit(one: ThresholdFound) -> str:
        return "–" if one.fit_p is None else f"{one.fit_p:.3f}{'' if one.fits else ': the function does not fit'}"

    def drift(one: ThresholdFound) -> str:
        return "–" if one.drift is None else f"{one.drift:+.2f}{'!' if one.drifts else ''}".replace("-", "−")

    return _by_standard(
        found,
        found.thresholds,
        *OF_WHOM,
        (
            "threshold" + (" (Weber fraction)" if weber else _unit(found)),
            lambda one: f"{BEYOND[one.beyond]}{one.threshold:.3g}",
        ),
        INTERVAL,
        None if compared is None else (f"at {compared:g} %", lambda one: _digits(one.compared)),
        ("with device damping", lambda one: _digits(found.with_device(one))) if with_device else None,
        (f"width [{WIDTH_UNITS[found.spacing]}]", lambda one: _digits(one.width, 2)),
        ("flat width prior", lambda one: _digits(one.flat_width)),
        None if percent is None else (f"mean of reversals ({percent:.1f} %)", lambda one: _digits(one.reversal_mean)),
        ("fit (p)", fit),
        ("drift", drift),
        words=1,
    )


def _target_percent(found: LevelsFound) -> float | None:
    return next((one.target_percent for one in found.own_thresholds), None)


def _unit(found: LevelsFound) -> str:
    return f" [{found.unit}]" if found.unit else ""


def _digits(value: float | None, digits: int = 3) -> str:
    """Return a number with so many digits, a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}g}"


def _between(low: float | None, high: float | None, written: Callable[[float], str]) -> str:
    """Return an interval, a dash where there is none."""
    return "–" if low is None or high is None else f"{written(low)} – {written(high)}"


def _levels(one: LevelTimes | WithheldForce) -> str:
    """Return the levels that a row is about."""
    return _digits(one.low) if one.low == one.high else _between(one.low, one.high, _digits)


def _published(found: LevelsFound, *, exponents: bool) -> Iterator[str]:
    """Yield the published values that are exponents, or those that are not."""
    shown = [one.in_words() for one in found.published if (one.measure == "exponent") is exponents]
    if shown:
        yield paragraph(f"Published: {'; '.join(shown)}.")


def _sensitivities(found: LevelsFound) -> str:
    """Return a row per standard, comparison or level and participant, the group first."""
    ones = found.sensitivities
    first = ones[0]
    where = "Comparison" if first.level is None else "Level"
    wheres = len({_sensitivity_where(one) for one in ones}) > 1
    measured = any(one.d_prime is not None for one in ones)
    biased = any(one.criterion is not None for one in ones)
    answers = tuple(first.shares)
    shares: list[Shown] = [
        (f"“{answer.replace('_', ' ')}”", lambda one, answer=answer: f"{100 * one.shares[answer]:.0f} %")  # type: ignore[misc]
        for answer in (answers[:1] if len(answers) == 2 else answers)
    ]
    return table_of(
        ones,
        (where if first.standard is None else f"Standard{_unit(found)}", _sensitivity_where) if wheres else None,
        *OF_WHOM,
        ("d′", lambda one: number(one.d_prime)) if measured else None,
        ("95 % interval", lambda one: _between(one.low, one.high, number)) if measured else None,
        ("k" if found.design == "samedifferent" else "c", lambda one: number(one.criterion)) if biased else None,
        *shares,
        words=int(not wheres),
    )


def _sensitivity_where(one: SensitivityFound) -> str:
    return _plain(one.comparison or (one.level if one.standard is None else one.standard))


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


def _delivery(found: LevelsFound) -> str:
    """Return a row per standard."""
    standards = any(one.standard is not None for one in found.conduct)
    digits, unit = (4, "") if found.level_kind == "weber" else (3, _unit(found))
    return table_of(
        found.conduct,
        _standard(found) if standards else None,
        ("trials", lambda one: str(one.trials)),
        ("repeated attempts", lambda one: str(one.repeated)),
        ("measured", lambda one: str(one.measured)),
        (f"level error{unit}, mean", lambda one: number(one.error_mean, digits)),
        ("largest", lambda one: number(one.error_largest, digits)),
        ("hand speed, RMS [m/s]", lambda one: number(one.pace_mps, 3)),
        ("apparent mass [kg]", lambda one: number(one.apparent_mass_kg, 3)),
        words=0,
    )


def _conduct_words(found: LevelsFound, estimator: str | None) -> str:
    reasons = sum((Counter(one.reasons) for one in found.conduct), Counter[str]())
    named = [
        f"{name.rpartition('_')[0].replace('_', ' ') or name} in {counted(count, 'interval')}"
        for name, count in reasons.most_common()
    ]
    with_estimator = f", with the velocity estimator {estimator}" if estimator else ""
    mass = f" Apparent mass: least-squares fit of F = −b v − m a to the force sent{with_estimator}."
    return (
        "Level error: delivered less requested level, from the recorded samples (delays: from the frames); fits take "
        f"delivered levels.{mass if any(one.apparent_mass_kg is not None for one in found.conduct) else ''} "
        f"{f'Limits that intervals did not keep: {listed(named)}.' if reasons else 'Every interval kept its limits.'}"
    )


def withheld(found: LevelsFound) -> Iterator[str]:
    """Yield the section; nothing where the force was prompt."""
    if not found.withheld:
        return
    yield heading(3, "Force withheld by safety")
    yield _by_standard(
        found,
        found.withheld,
        (f"Level{_unit(found)}", _levels),
        ("intervals", lambda one: str(one.n)),
        ("mean", lambda one: f"{one.mean_percent:.1f} %"),
        ("most", lambda one: f"{one.most_percent:.1f} %"),
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


def _settings(found: LevelsFound, pictures: Mapping[str, Picture]) -> Iterator[str]:
    """Yield the settings of a block whose key is open: a row per standard and participant, the group first."""
    compared = any(one.constant_error is not None for one in found.settings)
    unit = "decades" if found.spacing == "log" else found.unit or "units of the level"

    def signed(value: float | None) -> str:
        return "–" if value is None else f"{value:+.3g}".replace("-", "−")

    yield heading(3, "Settings")
    yield _by_standard(
        found,
        found.settings,
        *OF_WHOM,
        (f"PSE{_unit(found)}", lambda one: _digits(one.pse)),
        INTERVAL,
        (f"JND [{unit}]", lambda one: _digits(one.jnd)),
        (f"constant error [{unit}]", lambda one: signed(one.constant_error)) if compared else None,
        (f"hysteresis [{unit}]", lambda one: signed(one.hysteresis)),
        words=1,
    )
    in_u = "logarithm of the level" if found.spacing == "log" else "level"
    error = " constant error: PSE − standard;" if compared else ""
    yield paragraph(
        f"Settings as levels ({level_words(found)}). PSE, the point of subjective equality: mean of the {in_u}, with "
        f"Student’s 95 % interval; JND, the just-noticeable difference: standard deviation;{error} hysteresis: "
        "settings that started high − settings that started low. The group has the means over participants, and "
        "the interval of its PSE is that over participants.",
        "soft",
    )
    if found.published:
        yield paragraph(f"Published: {'; '.join(one.in_words() for one in found.published)}.")
    yield from drawn(pictures, f"settings-{found.block}")


def _of_group(found: LevelsFound) -> str:
    standards = any(one.standard is not None for one in found.of_group)
    columns: list[Shown] = [(f"Standard{_unit(found)}", lambda one: _plain(one.standard))] if standards else []
    if found.level_kind not in {None, "value"}:
        columns.append((level_words(found), lambda one: _plain(one.level)))
    alone = found.level_kind == "value" and not standards
    columns.append((level_words(found) if alone else f"Comparison{_unit(found)}", lambda one: _plain(one.comparison)))
    return table_of(
        found.of_group,
        *columns,
        ("participants", lambda one: str(one.participants)),
        ("n", lambda one: str(one.n)),
        (summary_words(found), lambda one: _value(found, one.value)),
        ("95 % interval", lambda one: _between(one.low, one.high, partial(_value, found))),
        words=1 if found.vary is None else 0,
    )


def _value(found: LevelsFound, value: float) -> str:
    return f"{100 * value:.0f} %" if found.summary == "share" else f"{value:.3g}"


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

    def cell(person: str, level: LevelAnswers) -> str:
        one = own.get((person, level.level, level.comparison))
        if one is None:
            return "–"
        return f"{_value(found, one.value)} ({one.n})" if one.count is None else f"{one.count}/{one.n}"

    names = [_plain(one.comparison if one.level is None else one.level) for one in shown]
    return table(
        ("Participant" if standard is None else f"Standard {with_unit(found, standard)}", *names),
        [[person, *(cell(person, one) for one in shown)] for person in found.people],
    )
