"""What an export adds to the recorded tables, and its tables of blocks of levels: what a row is, and the columns.

Statistics name their table; rows, formats, codebook and data dictionary follow from the columns. Help reads them
without the libraries of the analysis, which may not be installed.
"""

from dataclasses import replace
from typing import Final, NamedTuple

from study_app.store.files import INTERVALS, PARTICIPANTS, TRIALS, TRIALS_MISSING, Column, optional, with_missing_trials
from study_app.store.tables import table_markdown

_STATUS: Final = next(column for column in with_missing_trials(PARTICIPANTS) if column.name == "status")

JUDGED: Final = (
    Column("session_status", "text", "How the row's session ended.", levels=_STATUS.levels),
    Column("excluded", "flag", "true if exclusions.csv excludes the row's session or trial."),
    optional("exclusion_reason", "text", "Reason for the exclusion."),
    Column(
        "counted",
        "flag",
        "true if the row is included in the aggregate table and the figures, that is, if it belongs to the last "
        "attempt at a main trial in a completed session and is not excluded. Invalid trials are included too.",
    ),
)

OPENED: Final = (
    Column("condition", "text", "ID of the condition that the code stands for."),
    Column("liquid", "text", "ID of the liquid that was presented."),
    Column("delay_ms", "number", "Requested visual delay; n/a if the stimulus varies the delay.", unit="ms", minimum=0),
)
ACHIEVED: Final = optional(
    "delay_achieved_ms", "number", "Achieved visual delay (requested delay plus the trial's mean error).", unit="ms"
)

_INTERVALS: Final = {column.name: column for column in INTERVALS}
_BLOCK: Final = Column("block", "text", "ID of the block.")
_STANDARD: Final = optional(
    "standard", "number", "The standard, in the unit of the varied parameter; n/a if there is no standard."
)

OF_TRACKS: Final[tuple[Column, ...]] = (
    Column(
        "analysed",
        "flag",
        "true if the answer is analysed; false if the trial presents the modulus in a magnitude-estimation block, or "
        "if the session's answers in the block are below chance and no decision has been made to keep the session.",
    ),
    Column("track", "text", "Meaning of the code: the standard and the track number (such as 8/1), or the condition."),
    Column(
        "slot",
        "integer",
        "Position of the trial among the session's trials with the same code, starting at 1.",
        minimum=1,
    ),
    _INTERVALS["catch"],
    _INTERVALS["standard"],
    replace(_INTERVALS["level"], name="level_asked"),
    optional(
        "level_delivered",
        "number",
        "Level of the comparison that was actually delivered, computed from the delivered values (for a visual delay, "
        "from the mean delay error of the frames); n/a if it was not measured.",
    ),
    optional(
        "comparison",
        "number",
        "Value of the comparison at this level, in the unit of the varied parameter; n/a if conditions are compared.",
    ),
    optional(
        "arrangement",
        "text",
        "Order of the intervals (S is the standard, C the comparison); n/a if no interval was presented.",
    ),
    optional(
        "comparison_interval",
        "integer",
        "Number of the interval that contains the comparison, starting at 1; n/a unless exactly one interval contains "
        "it.",
        minimum=1,
    ),
    optional(
        "outcome",
        "text",
        "How the trial ended. If a setting timed out, it is the level at the end of the time allowed.",
        levels=next(column for column in TRIALS if column.name == "outcome").levels,
    ),
    optional("response", "text", "The answer; n/a if there is no answer."),
    optional("value", "number", "The answer as a number; n/a if it is not a number."),
    optional("right", "flag", "true if the answer was correct; n/a if answers are neither correct nor incorrect."),
    optional(
        "response_s",
        "number",
        "Time from the appearance of the question until an answer is first selected.",
        unit="s",
        minimum=0,
    ),
    optional(
        "reversal",
        "flag",
        "true if the up–down track changed direction at this trial; n/a if the method does not use steps.",
    ),
    replace(_INTERVALS["setting"], description="The level that the participant set, starting from level_asked."),
)


_SETTINGS: Final[tuple[Column, ...]] = (
    _BLOCK,
    _STANDARD,
    Column("n", "integer", "Number of settings included in the analysis.", minimum=0),
    Column(
        "pse",
        "number",
        "Mean of the settings as a level (the geometric mean if levels are spaced logarithmically); if a standard was "
        "presented, this is the point of subjective equality (PSE).",
    ),
    optional("low", "number", "Lower end of the 95 % confidence interval for the mean (Student's t)."),
    optional("high", "number", "Upper end of the 95 % confidence interval for the mean (Student's t)."),
    optional(
        "jnd",
        "number",
        "Standard deviation of the settings (in decades if levels are spaced logarithmically, otherwise in the unit "
        "of the levels); if a standard was presented, this is the just-noticeable difference (JND).",
        minimum=0,
    ),
    optional(
        "constant_error", "number", "PSE minus the standard, in the unit of the JND; n/a if no standard was presented."
    ),
    optional(
        "hysteresis",
        "number",
        "Mean of the settings that started high minus the mean of those that started low, in the unit of the JND.",
    ),
    Column("timed_out", "integer", "Number of settings that the time limit ended; they are included.", minimum=0),
    Column("at_ends", "integer", "Number of settings at an end of the range; they are included.", minimum=0),
)

_EXPONENTS: Final[tuple[Column, ...]] = (
    _BLOCK,
    Column("levels", "integer", "Number of levels with analysed answers.", minimum=2),
    Column(
        "exponent",
        "number",
        "Exponent of the power law: the regression slope of the mean ln answer at each level on ln level, using "
        "delivered levels.",
    ),
)

_THRESHOLDS: Final[tuple[Column, ...]] = (
    _BLOCK,
    _STANDARD,
    optional("condition", "text", "The comparison condition; n/a in a block in which the level is varied."),
    Column("n", "integer", "Number of answers included in the analysis.", minimum=0),
    optional(
        "threshold",
        "number",
        "Level at which the psychometric function lies halfway between the guess rate and one minus the lapse rate "
        "(posterior median, in the unit of the stimulus's levels); n/a if no psychometric function is fitted.",
    ),
    optional("low", "number", "Lower end of the equal-tailed 95 % interval for the threshold."),
    optional("high", "number", "Upper end of the equal-tailed 95 % interval for the threshold."),
    optional(
        "open_end",
        "text",
        "The end of the interval that the answers do not determine, so that the true limit lies further out; n/a if "
        "the answers determine both ends.",
        levels=(("low", "the lower end"), ("high", "the upper end"), ("both", "both ends")),
    ),
    optional(
        "beyond",
        "text",
        "Shows whether the threshold lies above or below the range of the stimulus levels; n/a if it lies within "
        "the range.",
        levels=(("above", "above the highest level"), ("below", "below the lowest level")),
    ),
    optional(
        "width",
        "number",
        "Posterior median of the width of the psychometric function, from 5 to 95 % of its rise (in decades if levels "
        "are spaced logarithmically, otherwise in the unit of the levels).",
        minimum=0,
    ),
    optional("lapse", "number", "Posterior median of the lapse rate.", minimum=0, maximum=1),
    optional(
        "weber_exponent",
        "number",
        "Slope of ln JND on ln standard across the participant's standards, with the same value in all of the "
        "participant's rows; n/a if there are fewer than two standards.",
    ),
    optional("flat_width_threshold", "number", "Threshold estimated with a flat prior on the width."),
    optional(
        "reversal_mean",
        "number",
        "Mean of the last reversals in the up–down tracks; n/a for other methods or if there are too few reversals.",
    ),
    optional(
        "target_percent",
        "number",
        "Percentage of correct answers to which the up–down rule converges.",
        unit="%",
        minimum=0,
        maximum=100,
    ),
    optional(
        "d_prime",
        "number",
        "Sensitivity across all presented levels, negative below chance; n/a if answers are neither correct nor "
        "incorrect.",
    ),
    optional(
        "d_prime_model",
        "text",
        "Model used to calculate d_prime; n/a unless two models exist for the design.",
        levels=(
            ("differencing", "intervals are compared with each other"),
            ("independent", "each interval is compared with known alternatives"),
        ),
    ),
    optional("d_prime_other", "number", "Sensitivity (d′) under the other model, which d_prime_model does not name."),
    optional(
        "criterion",
        "number",
        "c for yes–no and two-interval forced choice; k of the differencing model for same–different.",
    ),
    optional(
        "share_first",
        "number",
        "Proportion of answers in the first category, such as “first” or “yes”.",
        minimum=0,
        maximum=1,
    ),
    optional(
        "fit_p",
        "number",
        "p value of the deviance of the fitted function, based on simulated data sets; a value below 0.05 means that "
        "the function does not fit.",
        minimum=0,
        maximum=1,
    ),
    optional("drift", "number", "Correlation between trial number and deviance residual.", minimum=-1, maximum=1),
    optional(
        "change",
        "number",
        "Relative change in the threshold from the first to the last trial; 0 if the change is within two standard "
        "errors.",
    ),
)


class Results(NamedTuple):
    """A table of results: the meaning of a row, and its columns."""

    row: str
    columns: tuple[Column, ...]


RESULTS: Final = {
    "thresholds": Results(
        "one row per participant and standard, or per participant and comparison condition; available after unblinding",
        _THRESHOLDS,
    ),
    "settings": Results(
        "one row per participant and standard in blocks in which participants set the level; available after "
        "unblinding",
        _SETTINGS,
    ),
    "exponents": Results(
        "one row per participant in blocks with magnitude estimation; available after unblinding", _EXPONENTS
    ),
}
"""By the names of the tables."""


def dictionary_markdown() -> str:
    """Return the columns of these tables as Markdown, with a heading and a table for each."""
    added = (
        "columns that `export` adds to the tables of responses, trials and intervals; `trials_missing` is added only "
        "in studies with interval trials, and the last four columns only after unblinding"
    )
    of_tracks = (
        "one row per trial of a block with a design; available after unblinding. It also contains the trial's IDs and "
        "condition, and force_mean_n and mean_speed_mps for each interval (…_1, …_2)"
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
