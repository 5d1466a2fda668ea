"""What an export adds to the recorded tables, and its tables of blocks of levels: what a row is, and the columns.

Statistics name their table; rows, formats, codebook and data dictionary follow from the columns. Help reads them
without the libraries of the analysis, which may not be installed.
"""

from dataclasses import replace
from typing import Final, NamedTuple

from study_app.store.columns import INTERVALS, PARTICIPANTS, TRIALS_MISSING, with_missing_trials
from study_app.store.csv_files import Column, optional
from study_app.store.tables.column_dictionary import table_markdown

_STATUS: Final = next(column for column in with_missing_trials(PARTICIPANTS) if column.name == "status")

JUDGED: Final = (
    Column("session_status", "text", "How the row's session ended.", levels=_STATUS.levels),
    Column("excluded", "flag", "true if exclusions.csv excludes the row's session or trial."),
    optional("exclusion_reason", "text", "Reason for the exclusion."),
    Column(
        "counted",
        "flag",
        "true if the row is included in the aggregate and the figures: last attempt of a main trial in a "
        "completed session that is not excluded, whether valid or not.",
    ),
)

OPENED: Final = (
    Column("condition", "text", "ID of the condition that the code stands for."),
    Column("liquid", "text", "ID of the liquid presented."),
    Column("delay_ms", "number", "Requested visual delay; n/a if a stimulus varies it.", unit="ms", minimum=0),
)
ACHIEVED: Final = optional(
    "delay_achieved_ms", "number", "Achieved visual delay: the requested delay plus the trial's mean error.", unit="ms"
)

_INTERVALS: Final = {column.name: column for column in INTERVALS}
_BLOCK: Final = Column("block", "text", "Id of the block.")
_STANDARD: Final = optional(
    "standard", "number", "The standard, in the unit of the varied number; n/a if there is none."
)

OF_TRACKS: Final[tuple[Column, ...]] = (
    Column(
        "analysed",
        "flag",
        "true if the row is analysed and does not present the modulus of a magnitude estimation. False if the "
        "session's answers in the block are below chance, until a person decides to keep the session.",
    ),
    Column("track", "text", "Meaning of the code: standard and number of the track (8/1), or the condition."),
    Column(
        "slot", "integer", "Position of the trial among the trials with its code in the session, from 1.", minimum=1
    ),
    _INTERVALS["catch"],
    _INTERVALS["standard"],
    replace(_INTERVALS["level"], name="level_asked"),
    optional(
        "level_delivered",
        "number",
        "The level of the comparison as delivered to the hand, from the delivered values (for a visual delay "
        "from the mean errors of the frames); n/a if it was not measured.",
    ),
    optional(
        "comparison",
        "number",
        "The comparison at this level, in the unit of the varied number; n/a if conditions are compared.",
    ),
    optional(
        "arrangement", "text", "Order of the intervals: S is the standard, C the comparison; n/a if none was presented."
    ),
    optional(
        "comparison_interval",
        "integer",
        "The only interval with the comparison, from 1; n/a if there is none.",
        minimum=1,
    ),
    optional("response", "text", "The answer; n/a without an answer."),
    optional("value", "number", "The answer as a number, if it is a number."),
    optional("right", "flag", "true if the answer was correct; n/a if answers are neither correct nor incorrect."),
    optional("response_s", "number", "Time from the question to the first choice of an answer.", unit="s", minimum=0),
    optional(
        "reversal",
        "flag",
        "true if the up–down track changed its direction here; n/a if the method does not use steps.",
    ),
    replace(_INTERVALS["setting"], description="The level that the participant set, starting from level_asked."),
)


_SETTINGS: Final[tuple[Column, ...]] = (
    _BLOCK,
    _STANDARD,
    Column("n", "integer", "Settings that count.", minimum=0),
    Column(
        "pse",
        "number",
        "Point of subjective equality, a level: the mean of the settings (of their "
        "logarithms if levels are spaced logarithmically).",
    ),
    optional("low", "number", "Lower end of the 95 % interval of the PSE (Student's t)."),
    optional("high", "number", "Upper end of the 95 % interval of the PSE (Student's t)."),
    optional(
        "jnd",
        "number",
        "Just-noticeable difference: the standard deviation of the settings (in decades if levels are spaced "
        "logarithmically, otherwise in the unit of the levels).",
        minimum=0,
    ),
    optional(
        "constant_error", "number", "PSE minus standard, in the unit of the JND; n/a if a standard was not presented."
    ),
    optional(
        "hysteresis",
        "number",
        "Mean of the settings that started high minus mean of the settings that started low, in the unit of the JND.",
    ),
)

_EXPONENTS: Final[tuple[Column, ...]] = (
    _BLOCK,
    Column("levels", "integer", "Number of levels with analysed answers.", minimum=2),
    Column(
        "exponent",
        "number",
        "Exponent of the power law: the slope of the mean ln answer at each level on ln level, at delivered levels.",
    ),
)

_THRESHOLDS: Final[tuple[Column, ...]] = (
    _BLOCK,
    _STANDARD,
    optional("condition", "text", "The compared condition; n/a in a block of levels."),
    Column("n", "integer", "Number of answers included in the analysis.", minimum=0),
    optional(
        "threshold",
        "number",
        "Level halfway between guess rate and one minus lapse rate on the psychometric function (posterior "
        "median, in the unit of the stimulus' levels); n/a if a psychometric function is not fitted.",
    ),
    optional("low", "number", "Lower end of the threshold's equal-tailed 95 % interval."),
    optional("high", "number", "Upper end of the threshold's equal-tailed 95 % interval."),
    optional(
        "open_end",
        "text",
        "The end of the interval that the answers leave undetermined: the true end lies further out; n/a if both are "
        "determined.",
        levels=(("low", "the lower"), ("high", "the upper"), ("both", "both")),
    ),
    optional(
        "beyond",
        "text",
        "Whether the threshold lies beyond the levels of the stimulus; n/a if it lies within them.",
        levels=(("above", "above the highest"), ("below", "below the lowest")),
    ),
    optional(
        "width",
        "number",
        "Posterior median of the function's width, from 5 to 95 % of its rise, in decades if levels are spaced "
        "logarithmically, otherwise in the unit of the levels.",
        minimum=0,
    ),
    optional("lapse", "number", "Posterior median of the lapse rate.", minimum=0, maximum=1),
    optional(
        "weber_exponent",
        "number",
        "Slope of ln JND on ln standard over the participant's standards; identical in each of these rows; n/a "
        "with fewer than two standards.",
    ),
    optional("flat_width_threshold", "number", "The threshold under a flat prior on the width."),
    optional(
        "reversal_mean",
        "number",
        "Mean of the last reversals of the up–down tracks; n/a for other methods and if there are too few reversals.",
    ),
    optional(
        "target_percent",
        "number",
        "Percentage of correct answers to which the rule of the up–down tracks converges.",
        unit="%",
        minimum=0,
        maximum=100,
    ),
    optional(
        "d_prime", "number", "Sensitivity over all levels presented; n/a if answers are neither correct nor incorrect."
    ),
    optional(
        "d_prime_model",
        "text",
        "The model of d_prime, if the design has two models.",
        levels=(
            ("differencing", "intervals are compared with each other"),
            ("independent", "each interval is compared with known alternatives"),
        ),
    ),
    optional("d_prime_other", "number", "Sensitivity under the other model."),
    optional(
        "criterion",
        "number",
        "c of yes–no and of two-interval forced choice, k of the differencing model of same–different.",
    ),
    optional(
        "share_first",
        "number",
        "Proportion of the first answer category, such as “first” or “yes”.",
        minimum=0,
        maximum=1,
    ),
    optional(
        "fit_p",
        "number",
        "p value of the function's deviance, from simulated sets of answers; below 0.05 the function does not fit.",
        minimum=0,
        maximum=1,
    ),
    optional("drift", "number", "Correlation of trial number and deviance residual.", minimum=-1, maximum=1),
    optional(
        "change",
        "number",
        "Relative change of the threshold from the first to the last trial; 0 if it is within two standard errors.",
    ),
)


class Results(NamedTuple):
    """A table of results: the meaning of a row, and its columns."""

    row: str
    columns: tuple[Column, ...]


RESULTS: Final = {
    "thresholds": Results("one row per participant and standard, or condition compared, after unblinding", _THRESHOLDS),
    "settings": Results(
        "one row per participant and standard of a block whose levels participants set, after unblinding", _SETTINGS
    ),
    "exponents": Results("one row per participant of a block of magnitude estimation, after unblinding", _EXPONENTS),
}
"""By the names of the tables."""


def dictionary_markdown() -> str:
    """Return the columns of these tables as Markdown, with a heading and a table for each."""
    added = (
        "columns that `export` adds to responses, trials and intervals; `trials_missing` only in studies with trials "
        "of intervals, and the last four only after unblinding"
    )
    of_tracks = (
        "one row per trial with a design, after unblinding; it also contains the IDs and the condition of the trial, "
        "and force_mean_n and mean_speed_mps of each interval (…_1, …_2)"
    )
    tables = {"tracks": Results(of_tracks, OF_TRACKS), **RESULTS}
    return "\n".join(
        (
            table_markdown("Added by an export", "*_data.csv", added, (*JUDGED, TRIALS_MISSING, *OPENED, ACHIEVED)),
            *(
                table_markdown(name.capitalize(), f"study-…_description-{name}_data.csv", row, columns)
                for name, (row, columns) in tables.items()
            ),
        )
    )
