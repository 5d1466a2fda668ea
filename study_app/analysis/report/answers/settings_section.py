"""The part of a block's section about levels that participants set."""

from collections.abc import Iterator, Mapping

from study_app.analysis.figures.levels.level_figure import level_words
from study_app.analysis.figures.picture import Picture
from study_app.analysis.report.html_page import drawn, heading, paragraph, table
from study_app.analysis.results.level_results import LevelsFound, SettingFound


def section(found: LevelsFound, pictures: Mapping[str, Picture]) -> Iterator[str]:
    """Yield the settings of a block whose key is open."""
    yield heading(3, "Settings")
    yield _table(found)
    yield paragraph(_words(found), "soft")
    if found.published:
        yield paragraph(f"Published: {'; '.join(one.in_words() for one in found.published)}.")
    yield from drawn(pictures, f"settings-{found.block}")


def _table(found: LevelsFound) -> str:
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
                *((_number(one.standard, 4),) if standards else ()),
                one.participant or f"group of {one.n}",
                "–" if one.participant is None else str(one.n),
                f"{one.pse:.3g}",
                "–" if one.low is None or one.high is None else f"{one.low:.3g} – {one.high:.3g}",
                _number(one.jnd),
                *((_signed(one.constant_error),) if compared else ()),
                _signed(one.hysteresis),
            ]
            for one in found.settings
        ],
        words=int(not standards),
    )


def _number(value: float | None, digits: int = 3) -> str:
    return "–" if value is None else f"{value:.{digits}g}"


def _signed(value: float | None) -> str:
    return "–" if value is None else f"{value:+.3g}".replace("-", "−")


def _words(found: LevelsFound) -> str:
    in_u = "logarithm of the level" if found.spacing == "log" else "level"
    error = " constant error: PSE − standard;" if any(map(_has_error, found.settings)) else ""
    return (
        f"Settings as levels ({level_words(found)}). PSE, the point of subjective equality: mean of the {in_u}, with "
        f"Student’s 95 % interval; JND, the just-noticeable difference: standard deviation;{error} hysteresis: "
        "settings that started high − settings that started low. The group has the means over participants, and "
        "the interval of its PSE is that over participants."
    )


def _has_error(one: SettingFound) -> bool:
    return one.constant_error is not None
