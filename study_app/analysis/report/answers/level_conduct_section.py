"""The part of a block's section on what was delivered, repeated and missed: levels, motion, and catch trials."""

from collections import Counter
from collections.abc import Iterator

from study_app.analysis.report.html_page import heading, paragraph, table
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.results.words import counted, listed, number


def section(found: LevelsFound, estimator: str | None) -> Iterator[str]:
    """Yield the delivery of levels and the answers to catch trials; nothing where neither is known."""
    if found.conduct:
        yield heading(3, "Delivery of levels")
        yield _delivery(found)
        yield paragraph(_words(found, estimator), "soft")
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


def _words(found: LevelsFound, estimator: str | None) -> str:
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
