"""A study as an immutable, validated value; field names are the keys of the TOML file.

Each class is one table of the file (blocks, tasks and questionnaires have modules of their own). A class checks its
table alone; checks that need several tables are in ``checks``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, Final, Literal, Self, TypeAlias, TypeVar

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from study_app.haptics.model.effects import Effect as EffectDescriptor
from study_app.haptics.model.overrides import override_value, value_of
from study_app.haptics.model.ranges import DensityKgM3, DiameterM, DragCoefficient, FadeS, Metres, Vector, later, within
from study_app.haptics.model.scene import (
    FADE_S,
    Accuracy,
    Body,
    Estimator,
    Ewma,
    Knee,
    Liquid,
    MotionBox,
    Scene,
    SceneScale,
)
from study_app.ids import file_name_fault
from study_app.protocol.blocks import Block, Compared, Kind, OrderOfBlocks
from study_app.protocol.participants.groups import Group, GroupAssignment, Sequences, Sessions, Steps, parts_by_block
from study_app.protocol.participants.raters import SimulatedParticipants
from study_app.protocol.quantities import MAX_FORCE_N, quoted_title, with_article
from study_app.protocol.questionnaires import Questionnaire
from study_app.protocol.questions import POINTS, Scale
from study_app.protocol.source.table import Body as PageBody
from study_app.protocol.source.table import (
    Brief,
    Description,
    Id,
    Language,
    Localised,
    Printable,
    Table,
    invalid,
    text_in,
)
from study_app.protocol.trials.designs import AnyDesign, Design, default_design, question_of
from study_app.protocol.trials.methods import Adjusting, Adjustment, AnyMethod, Method, default_method
from study_app.protocol.trials.stimuli import DELAY, OF_CONDITION, OF_LINK, Condition, Stimulated, Stimulus
from study_app.protocol.trials.tasks import AnyTask, Explore, Follow, Reach, Seconds

__all__ = [
    "Analysis",
    "Block",
    "Condition",
    "DeviceNeeds",
    "Explore",
    "Follow",
    "Limits",
    "PageText",
    "Protocol",
    "Questionnaire",
    "Reach",
    "Scale",
    "SceneDefaults",
    "StudyHead",
]

HandForceN: TypeAlias = Annotated[
    float, within(0.1, MAX_FORCE_N, "participants can barely feel less than 0.1 N, and 8 N is the maximum safe force")
]


FORMAT: Final = 2
"""The format of study and scene files; `store.upgrade` rewrites files of earlier formats."""


def _check_format_number(value: Any) -> Any:
    if type(value) is not int:
        raise invalid(f"must be {FORMAT}, the version number of this format", use=("format", FORMAT))
    return value


Format: TypeAlias = Annotated[Literal[2], BeforeValidator(_check_format_number)]


class Credits(Table):
    """Authors, licence and citation that are included in an export for sharing."""

    authors: tuple[Printable, ...] = Field(
        default=(), max_length=200, description="Authors' names, in the order in which they are cited."
    )
    license: Printable | None = Field(
        default=None, description="Data licence: an SPDX identifier such as CC-BY-4.0, or a web address."
    )
    citation: Printable | None = Field(default=None, description="How to cite the data or the paper.")
    funder: Printable | None = Field(default=None, description="Funder of the study.")
    url: Printable | None = Field(
        default=None, description="Web address for the study, such as a link to its preregistration."
    )


class StudyHead(Table):
    """Name, version and languages of the study."""

    name: str = Field(
        pattern=r"^[a-z][a-z0-9]*$", max_length=40, description="Short name, used in folder and file names."
    )
    title: Localised = Field(description="The study's title, as it is displayed.")
    description: Description = Field(
        default="", description="The research question, for people who read the results later."
    )
    version: str = Field(
        pattern=r"^[0-9A-Za-z.+-]+$",
        max_length=40,
        description="Version of this protocol; increase it with every change.",
    )
    languages: tuple[Language, ...] = Field(
        min_length=1, description="Languages in which every text is available; the first is the default."
    )
    resume: Literal["trial", "block"] = Field(
        default="trial",
        description="What is presented again when an interrupted session is resumed. trial: the interrupted trial; "
        "block: the whole interrupted block.",
    )
    blinding: Literal["double", "single"] = Field(
        default="double",
        description=(
            "double: neither the participant nor the operator knows the condition; single: the operator sees the "
            "force and the wake during the session, but the participant does not know the condition."
        ),
    )
    codes: Literal["study", "participant"] = later(
        default="study",
        description=(
            "How codes are assigned to conditions. study: a code stands for the same condition for all participants; "
            "participant: each participant has different codes until unblinding."
        ),
    )
    block_order: OrderOfBlocks = later(
        default="fixed",
        description=(
            "Order of the main blocks; pages, forms and other blocks keep their positions. fixed: as written; "
            "balanced: counterbalanced by the rows of a Williams design, assigned by the number in the participant's "
            "ID or by the participant's position in the group; random: drawn for each session."
        ),
    )
    group_assignment: GroupAssignment = later(
        default="randomised",
        description="randomised: the program assigns participants to groups at random; pre-existing: participants "
        "already belong to a group, such as experts or novices, and the operator enters the group in each "
        "session.",
    )
    credits: Credits | None = later(default=None, description="Authors, licence and citation for exports.")

    @model_validator(mode="after")
    def _check_file_name(self) -> Self:
        if fault := file_name_fault(self.name):
            raise invalid(f'"{self.name}" {fault}: choose a name that is also valid on Windows', "name")
        return self


class DeviceNeeds(Table):
    """What the study requires of the device."""

    rate_hz: Annotated[
        float,
        within(
            250, 4000, "at lower rates forces are never stable, and at higher rates ticks cannot be computed in time"
        ),
    ] = Field(default=1000, description="Servo rate [Hz].")
    force_limit_n: HandForceN = Field(default=MAX_FORCE_N, description="Maximum force on the hand [N].")
    workspace_mm: tuple[float, float, float] = Field(
        description="Dimensions of the drawn tank along x, y and z in the hand frame [mm]; the tank is centred on the "
        "middle of the device's workspace."
    )

    @property
    def workspace_m(self) -> Vector:
        """Full sizes of the tank, hand frame [m]."""
        x, y, z = self.workspace_mm
        return (x / 1000, y / 1000, z / 1000)

    @model_validator(mode="after")
    def _check_workspace(self) -> Self:
        if not all(10 <= size <= 1000 for size in self.workspace_mm):
            raise invalid("every dimension must be between 10 and 1000 mm", "workspace_mm")
        return self


class SceneDefaults(Table):
    """The part of the scene shared by all conditions: everything except the liquids."""

    scale: SceneScale = Field(default=10, description="Metres in the scene per metre of hand movement.")
    origin_m: Metres = Field(
        default=(0, 0, 0), description="Point in the scene that corresponds to the origin of the hand frame [m]."
    )
    body: Body = Field(default_factory=Body, description="The ball that the participant moves.")
    velocity: Estimator = Field(default_factory=Ewma, description="How velocity is estimated from positions.")
    knee: Knee = Field(default_factory=Knee, description="How high speeds are reduced before forces are computed.")
    motion: MotionBox = Field(default_factory=MotionBox, description="How the ball is expected to move in the scene.")
    accuracy: Accuracy = Field(default_factory=Accuracy, description='The force that effects = "auto" may omit.')
    fade_s: FadeS = later(default=FADE_S, description="Time over which the force fades in [s].")


def compared(conditions: Sequence[Condition]) -> Compared:
    """Return the quantity in which conditions differ: liquids, else views, else delays; liquids if none differ."""
    liquids, delays, views = (
        {getattr(condition, name) for condition in conditions} for name in ("liquid_ids", "delay_ms", "seen")
    )
    if len(liquids) > 1:
        return "liquids"
    return "views" if len(views) > 1 else "delays" if len(delays) > 1 else "liquids"


class PageText(Table):
    """A page to read."""

    kind: Literal["consent", "instructions", "break", "debrief"] = Field(
        description=(
            "Purpose of the page. consent: asks for the participant's consent; instructions: what to do next; break: a "
            "rest; debrief: what the study was about."
        )
    )
    title: Localised = Field(description="Page heading.")
    body: PageBody = Field(description="The text; a blank line starts a new paragraph.")
    button: Localised | None = Field(default=None, description="Text on the button; default: Continue.")
    min_s: Seconds | None = Field(
        default=None,
        description=(
            "Minimum duration of a break [s]; the page counts it down. By default, the participant can end the break "
            "at any time."
        ),
    )

    @model_validator(mode="after")
    def _check_duration(self) -> Self:
        if self.min_s is not None and self.kind != "break":
            raise invalid(f"is only for pages of kind break, not {self.kind}", "min_s", kind="surplus")
        return self


class OwnBody(Table):
    """The ball in one liquid; omitted keys have the values in scene.body."""

    diameter_m: DiameterM | None = None
    drag_coefficient: DragCoefficient | None = None
    density_kg_m3: DensityKgM3 | None = None


class StudyLiquid(Liquid):
    """A liquid of a study, with its own ball if necessary."""

    model_config = ConfigDict(title="Liquid")

    body: OwnBody | None = later(default=None, description="The ball in this liquid, if it differs from scene.body.")

    def _check_effects(self, effects: Iterable[EffectDescriptor]) -> None:
        used = list(effects)
        if self.viscosity_pa_s is not None and any(effect.name == "non_newtonian" for effect in used):
            message = "describes a Newtonian liquid, but the non-Newtonian table specifies another law"
            raise invalid(message, "viscosity_pa_s", kind="surplus")
        super()._check_effects(used)

    @property
    def alone(self) -> Liquid:
        """The liquid without its ball."""
        return Liquid.model_validate({name: value for name, value in self if name != "body"})

    def body_in(self, scene: SceneDefaults) -> Body:
        """Return the liquid's ball."""
        return (
            scene.body if self.body is None else scene.body.model_copy(update=self.body.model_dump(exclude_none=True))
        )


def scene_with(scene: SceneDefaults, device: DeviceNeeds, liquids: Sequence[StudyLiquid]) -> Scene:
    """Return a scene with these liquids; they share one ball, which `checks.consistency` verifies."""
    return Scene(
        **dict(scene) | {"body": liquids[0].body_in(scene)},
        rate_hz=device.rate_hz,
        liquids=tuple(liquid.alone for liquid in liquids),
        force_limit_n=device.force_limit_n,
    )


class Limits(Table):
    """Limits within which a trial is valid."""

    lateness_ms: Annotated[
        float, within(0.01, 1000, "no servo loop is more accurate, and a lateness of 1 s is a failure")
    ] = Field(default=2, description="Maximum 99th percentile of tick lateness [ms].")
    worst_gap_ms: Annotated[
        float, within(0.25, 1000, "at 4 kHz ticks are 0.25 ms apart, and a gap of 1 s is a failure")
    ] = Field(default=20, description="Maximum time between two ticks [ms].")
    delay_error_ms: Annotated[
        float, within(1, 1000, "no screen is more accurate, and an error of 1 s is a failure")
    ] = Field(
        default=25, description="Maximum 95th percentile of the delay error (achieved minus requested delay) [ms]."
    )
    frame_gap_ms: Annotated[float, within(1, 1000, "no screen is faster, and a gap of 1 s is a failure")] = Field(
        default=250,
        description="Maximum time before the first frame, between two frames, or from the last frame to the end of "
        "the trial [ms].",
    )
    withheld_percent: Annotated[
        float, within(0.01, 100, "a percentage of the force; some force is nearly always held back")
    ] = Field(
        default=5,
        description=(
            "Maximum proportion of the force held back by the slope limits, the passivity controller and "
            "the slew limit [%]."
        ),
    )
    targets_percent: (
        Annotated[float, within(0.01, 100, "a percentage of the targets; without this limit, any number is sufficient")]
        | None
    ) = later(default=None, description="Minimum proportion of a reaching task's targets that must be reached [%].")
    level_error_percent: (
        Annotated[float, within(0.1, 100, "encoder resolution alone causes an error of 0.2 %")] | None
    ) = later(default=None, description="Maximum error in an interval's delivered level [%]; default: 2.")
    level_error_ms: Annotated[float, within(0.1, 100, "at 120 Hz a frame lasts 8 ms")] | None = later(
        default=None, description="Maximum error in the delay difference delivered in a trial [ms]; default: 2."
    )
    pace_error_percent: Annotated[float, within(1, 1000, "a hand cannot keep a pace within 1 %")] | None = later(
        default=None,
        description="Maximum error in the hand's RMS speed, relative to the speed of the target it "
        "follows [%]; default: 40.",
    )
    attempts: Annotated[int, Field(ge=1, le=100)] | None = later(
        default=None, description="Maximum number of attempts to deliver an interval trial; default: 3."
    )
    missing_percent: (
        Annotated[float, within(0, 100, "a percentage of the trials; 0 means that all trials are required")] | None
    ) = later(
        default=None,
        description=(
            "Maximum proportion of undelivered trials among a session's main interval trials [%]; above this, "
            "the session is incomplete; default: 5."
        ),
    )


_Reported = Annotated[float, within(-1e9, 1e9, "published values are smaller than this")]


class Published(Table):
    """A value from another study, which figures show next to this study's results."""

    block: Id = Field(description="The block whose results are compared with the published value.")
    measure: Literal["weber", "threshold", "exponent", "pse"] = Field(
        description="The quantity that was published. weber: the Weber fraction; threshold: the threshold; exponent: "
        "the exponent of a power law; pse: the point of subjective equality."
    )
    value: _Reported = Field(description="The published value; a threshold is in the unit of the varied parameter.")
    standard: _Reported | None = Field(
        default=None, description="The standard to which the value applies, in the same unit; default: all standards."
    )
    low: _Reported | None = Field(default=None, description="Lower end of the published interval or range.")
    high: _Reported | None = Field(default=None, description="Upper end of the published interval or range.")
    percent: Annotated[float, within(0, 100, "a percentage of the answers")] | None = Field(
        default=None, description="Percentage of correct answers at this value; default: unknown."
    )
    n: Annotated[int, within(1, 1_000_000, "studies have fewer participants", of_most=True)] | None = Field(
        default=None, description="Number of participants in the published study."
    )
    source: Brief = Field(default="", description="The publication that reports the value.")

    def value_text(self, unit: str) -> str:
        """Return the value with its measure, such as "PSE 3 ms"; ``unit`` is that of the varied parameter."""
        names = {"weber": "Weber fraction", "pse": "PSE"}
        value_unit = unit if self.measure in ("threshold", "pse") else ""
        return f"{names.get(self.measure, self.measure)} {self.value:g} {value_unit}".rstrip()

    def described(self, unit: str) -> str:
        """Return the value with its block, standard and source; ``unit`` is that of the varied parameter."""
        details = (
            "" if self.standard is None else f", standard {self.standard:g} {unit}".rstrip(),
            "" if self.percent is None else f", at {self.percent:g} % correct",
            "" if self.n is None else f", n = {self.n}",
            f", {self.source}" if self.source else "",
        )
        return f"{self.block}: {self.value_text(unit)}{''.join(details)}"


OF_LEVELS: Final = ("threshold", "exponent", "d_prime", "pse")
"""The measures of blocks with levels that contrasts can compare."""
MEAN_SETTING: Final = "mean setting"
"""The measure `pse` of a block in which participants set the level without a standard."""


class Contrast(Table):
    """A hypothesis: two blocks, conditions or groups differ in a measure; it is tested, planned and reported first.

    With groups and two blocks or conditions, it is an interaction: the difference between the two differs between
    groups.
    """

    measure: Id = Field(
        default="threshold",
        description='"threshold", "exponent", "d_prime" or "pse" for blocks with levels; for other blocks, the ID of a '
        "statement, rating, slider, number or score of the questionnaire after each trial or, if form is specified, of "
        "that questionnaire.",
    )
    form: Id | None = later(
        default=None, description="The questionnaire whose answers or score are compared; it must follow the blocks."
    )
    blocks: tuple[Id, ...] = Field(
        min_length=1,
        max_length=2,
        description=("The two blocks to compare, or the block in which conditions or groups are compared."),
    )
    conditions: tuple[Id, Id] | None = Field(
        default=None, description="The two conditions of the block to compare within participants."
    )
    groups: tuple[Id, Id] | None = Field(
        default=None,
        description="The two groups to compare; if two blocks or conditions are specified, the difference between "
        "these is compared between the groups.",
    )
    expected: Literal["higher", "lower"] | None = Field(
        default=None,
        description=(
            "Expected direction. higher: the first is higher than the second; lower: the first is lower; default: "
            "either direction."
        ),
    )
    bound: Annotated[float, within(1e-9, 1e9, "published differences are smaller")] | None = Field(
        default=None,
        description="Equivalence bound: the largest negligible difference (for thresholds, the largest negligible "
        "ratio, such as 1.25); default: equivalence is not tested.",
    )

    @model_validator(mode="after")
    def _check_sides(self) -> Self:
        if len(self.blocks) == 2 and self.conditions is not None:
            raise invalid("specify two blocks, or two conditions of one block", "conditions")
        if self.form is not None and (self.conditions is not None or self.is_of_levels):
            raise invalid("if form is specified, compare its questions or scores between blocks or groups", "form")
        if self.groups is None and self.within is None:
            hint = "to compare two standards, use a separate block for each" * self.is_of_levels
            message = "specify two blocks, or one block and two conditions, or one block and two groups"
            raise invalid(message, "blocks", hint)
        for first, second in filter(None, (self.groups, self.within)):
            if first == second:
                raise invalid(f'compares "{first}" with itself', "blocks")
        return self

    @property
    def compared(self) -> tuple[str, str]:
        """The ids of the two sides: groups, conditions or blocks."""
        first, second = self.groups or self.conditions or self.blocks
        return first, second

    @property
    def within(self) -> tuple[str, str] | None:
        """The ids of the two conditions or blocks that are compared within participants; None for groups alone."""
        if self.conditions is None and len(self.blocks) == 2:
            return self.blocks[0], self.blocks[1]
        return self.conditions

    @property
    def is_interaction(self) -> bool:
        """Whether groups are compared in the difference between two conditions or blocks."""
        return self.groups is not None and self.within is not None

    @property
    def is_of_levels(self) -> bool:
        """Whether the measure is estimated in a block with a design, and is not an answer or a score."""
        return self.measure in OF_LEVELS

    @property
    def largest_difference(self) -> int:
        """The largest possible difference if the measure is agreement with a statement."""
        return (POINTS - 1) * (2 if self.is_interaction else 1)

    @property
    def measure_text(self) -> str:
        """The measure in words: "threshold", "agreement with “thick”"; see also `Protocol.measure_text`."""
        if self.form is not None:
            return f"“{self.measure}” ({self.form})"
        words = {"d_prime": "sensitivity (d′)", "pse": "point of subjective equality"}
        return words.get(self.measure, self.measure) if self.is_of_levels else f"agreement with “{self.measure}”"

    def effect_text(self, within: tuple[str, str] | None = None, measure: str = "", block: str = "") -> str:
        """Return the compared quantity as text: the measure, or in an interaction the difference in the measure.

        ``within`` are the names of the two blocks or conditions, ``measure`` is the name of the measure and ``block``
        that of a single block; by default, IDs are used.
        """
        measure = measure or self.measure_text
        if self.groups is None or self.within is None:
            return measure
        block_text = "" if len(self.blocks) == 2 else f" in {quoted_title(block) or f'block {self.blocks[0]}'}"
        first, second = map(quoted_title, within or self.within)
        return f"the difference in {measure} between {first} and {second}{block_text}"

    def words(self, conditions: Mapping[str, str | None]) -> tuple[str, str]:
        """Return the labels of the two sides; blocks get the conditions of their stimuli if these differ."""
        first, second = self.compared
        if self.groups is not None:
            return first, second
        stimulus_conditions = [conditions.get(block) for block in self.blocks]
        return (
            (f"{first} ({stimulus_conditions[0]})", f"{second} ({stimulus_conditions[1]})")
            if len(set(stimulus_conditions)) > 1 and None not in stimulus_conditions
            else (first, second)
        )

    def described(
        self,
        names: tuple[str, str] | None = None,
        within: tuple[str, str] | None = None,
        measure: str = "",
        block: str = "",
    ) -> str:
        """Return the hypothesis as a sentence; ``names`` are those of the two sides, for others see `effect_text`."""
        first, second = map(quoted_title, names or self.compared)
        block_name = quoted_title(block) or f"block {self.blocks[0]}"
        where = "" if len(self.blocks) == 2 or self.is_interaction else f" in {block_name}"
        verb = "differs between" if self.expected is None else f"is {self.expected} in"
        joint = "and" if self.expected is None else "than in"
        bound = "" if self.bound is None else f", with an equivalence bound of {self.bound:g}"
        kind = " (interaction)" if self.is_interaction else ""
        subject = with_article(self.effect_text(within, measure, block))
        return f"{subject} {verb} {first} {joint} {second}{kind}{where}{bound}"


BELOW_CHANCE_P: Final = 0.001
_Rule: TypeAlias = Literal["below_chance", "threshold_beyond_levels", "constant_answers", "fast_answers"]
RULES: Final[Mapping[_Rule, str]] = {
    "below_chance": "a block has fewer correct answers than expected by chance (binomial p below 0.001)",
    "threshold_beyond_levels": "a threshold lies outside the range of its stimulus's levels",
    "constant_answers": "more than {limit:g} % of the answers to statements are identical",
    "fast_answers": "the median response time is below {limit:g} s",
}
"""The condition under which each rule proposes a session for exclusion."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RuleLimit:
    """The range of an exclusion rule's limit, a usual value, and the unit of all three."""

    least: float
    most: float
    usual: float
    unit: str


RULE_LIMITS: Final[Mapping[str, RuleLimit]] = {
    "constant_answers": RuleLimit(least=1, most=100, usual=95, unit="%"),
    "fast_answers": RuleLimit(least=0.05, most=600, usual=0.3, unit="s"),
}
"""The ranges of the limits of exclusion rules."""


class ExclusionRule(Table):
    """A rule for proposing a session for exclusion; a person decides."""

    rule: _Rule = Field(
        description="Reason for exclusion. "
        + "; ".join(f"{rule}: {condition.replace('{limit:g}', '`limit`')}" for rule, condition in RULES.items())
        + "."
    )
    limit: float | None = Field(
        default=None,
        description="constant_answers: maximum percentage of identical answers; fast_answers: minimum median "
        "response time in seconds; the other rules do not use a limit.",
    )

    @model_validator(mode="after")
    def _check_limit(self) -> Self:
        known = RULE_LIMITS.get(self.rule)
        if known is None and self.limit is not None:
            raise invalid(f"is not used by the rule {self.rule}", "limit", kind="surplus")
        if known is not None and not (self.limit is not None and known.least <= self.limit <= known.most):
            raise invalid(f"specify a number from {known.least:g} to {known.most:g} {known.unit}", "limit")
        return self

    @property
    def words(self) -> str:
        """The condition of the rule as text."""
        return RULES[self.rule].format(limit=self.limit)


Spending: TypeAlias = Literal["obrien-fleming", "pocock"]
SPENDINGS: Final[Mapping[str, str]] = {"obrien-fleming": "O'Brien–Fleming", "pocock": "Pocock"}
"""The name of each alpha spending function."""


class Analysis(Table):
    """Decisions about the analysis; without this table, the report labels all results as exploratory."""

    alpha: Annotated[float, within(0.0001, 0.2, "common significance levels are 0.001 to 0.1")] = Field(
        default=0.05, description="Largest p value that is considered significant."
    )
    equivalence_bound: (
        Annotated[float, within(0.05, 6, "the scale spans 6 points, and means differ by tenths of a point")] | None
    ) = Field(
        default=None,
        description="Largest negligible mean difference from the condition without delay, in scale points; "
        "default: equivalence is not tested.",
    )
    primary: tuple[Id, ...] = Field(
        default=(), description="Primary items, as opposed to exploratory items; default: all items are primary."
    )
    names: tuple[Id, ...] = Field(
        default=(),
        description="Items that each name a liquid. The item that a participant rates higher than all the others is "
        "taken as the participant's choice.",
    )
    rising: tuple[Id, ...] = Field(default=(), description="Items whose answers are expected to increase with delay.")
    falling: tuple[Id, ...] = Field(default=(), description="Items whose answers are expected to decrease with delay.")
    noticed: Id | None = Field(
        default=None, description="Item for which agreement (5 to 7) means that the participant noticed a delay."
    )
    participants: Annotated[int, Field(ge=1, le=100_000)] | None = later(
        default=None, description="Planned number of participants."
    )
    precision: Annotated[float, within(0.001, 10, "relative to the group mean")] | None = later(
        default=None,
        description="Planned half-width of the 95 % confidence interval for the group mean, relative to the mean.",
    )
    trends: Literal["ranks", "slopes"] = later(
        default="ranks",
        description=(
            "Test for a trend in answers with delay. ranks: sign-flip test on the participants' rank correlations; "
            "slopes: Student's t test on the participants' slopes."
        ),
    )
    looks: tuple[Annotated[int, Field(ge=2, le=100_000)], ...] = later(
        default=(),
        description="Numbers of participants at which the key is opened and all hypotheses are tested. The last one "
        "must equal the planned number of participants; default: once, at the end.",
    )
    spending: Spending = later(
        default="obrien-fleming",
        description=(
            "How alpha is spent across the looks (Lan and DeMets 1983). obrien-fleming: mostly at the last look; "
            "pocock: roughly evenly."
        ),
    )
    published: tuple[Published, ...] = later(default=(), description="Published values to compare with the results.")
    contrasts: tuple[Contrast, ...] = later(default=(), description="Hypotheses to be tested and reported first.")
    exclusions: tuple[ExclusionRule, ...] = later(default=(), description="Rules for proposing sessions for exclusion.")

    @model_validator(mode="after")
    def _check_looks(self) -> Self:
        if self.looks and (len(self.looks) < 2 or self.looks[-1] != self.participants):
            raise invalid("specify two or more numbers; the last must equal analysis.participants", "looks")
        if any(after <= look for look, after in pairwise(self.looks)):
            raise invalid("each look needs more participants than the previous look", "looks")
        return self

    def described(
        self,
        named_by: Sequence[str],
        *,
        units: Mapping[str, str],
        statements: bool,
        measure_text: Callable[[Contrast], str],
    ) -> Iterator[tuple[str, str]]:
        """Yield a row for each decision.

        ``named_by`` states which item names each condition; ``units`` maps blocks to the unit of the varied parameter;
        ``measure_text`` returns the measure of a hypothesis in words.

        Decisions about statements are omitted unless the study tests ``statements``.
        """
        yield "Significance level", f"{self.alpha:g}"
        if statements:
            yield from self._statement_decisions(named_by)
        if self.participants is not None:
            yield "Participants", f"{self.participants} planned"
        if self.looks:
            looks = ", ".join(map(str, self.looks))
            yield "Interim analyses", f"with {looks} participants; {SPENDINGS[self.spending]} alpha spending"
        if self.precision is not None:
            width = f"{100 * self.precision:g} %"
            yield "Precision", f"half-width of the 95 % confidence interval for the group mean: {width}"
        yield from (("Proposes exclusion", rule.words) for rule in self.exclusions)
        for contrast in self.contrasts:
            yield "Hypothesis", contrast.described(measure=measure_text(contrast))
        yield from (("Published", value.described(units.get(value.block, ""))) for value in self.published)

    def _statement_decisions(self, named_by: Sequence[str]) -> Iterator[tuple[str, str]]:
        bound = self.equivalence_bound
        points = "point" if bound == 1 else "points"
        yield (
            "Equivalent",
            "not tested" if bound is None else f"mean answers within {bound:g} {points} of those without delay",
        )
        yield "Primary", ", ".join(self.primary) or "all statements"
        yield "Recognition", ", ".join(self.names) or "none"
        if named_by:
            yield "Recognised", ", ".join(named_by)
        yield "Increase with delay", ", ".join(self.rising) or "none"
        yield "Decrease with delay", ", ".join(self.falling) or "none"
        yield "Detection", "not asked" if self.noticed is None else f"agreement with {self.noticed} (5 to 7)"


_T = TypeVar("_T")


def _set_ids(tables: Any) -> Any:
    """Set each table's name as its ``id``."""
    if not isinstance(tables, Mapping):
        return tables
    return {name: {**table, "id": name} if isinstance(table, Mapping) else table for name, table in tables.items()}


Named: TypeAlias = Annotated[dict[Id, _T], BeforeValidator(_set_ids)]


class Protocol(Sessions, Table):
    """The whole file."""

    format: Format = Field(description="Version of the file format.")
    study: StudyHead
    device: DeviceNeeds
    scene: SceneDefaults = Field(default_factory=SceneDefaults)
    liquids: Named[StudyLiquid] = Field(min_length=1)
    conditions: dict[Id, Condition] = Field(min_length=1)
    tasks: dict[Id, AnyTask] = Field(min_length=1, description="What participants do in a trial.")
    scales: dict[Id, Scale] = Field(default_factory=dict)
    questionnaires: dict[Id, Questionnaire] = Field(default_factory=dict)
    pages: dict[Id, PageText] = Field(default_factory=dict)
    stimuli: dict[Id, Stimulus] = later(default_factory=dict)
    designs: dict[Kind, AnyDesign] = later(default_factory=dict, description="How interval trials are constructed.")
    methods: dict[Kind, AnyMethod] = later(default_factory=dict, description="How the levels of a stimulus are chosen.")
    blocks: Named[Block] = Field(min_length=1)
    sequence: Steps = Field(
        default=(), min_length=1, description="The pages, blocks and forms of every session, in order."
    )
    sequences: Sequences = later(
        default=(), min_length=1, description="The steps of sessions 1, 2 and so on, if they differ."
    )
    groups: dict[Id, Group] = later(default_factory=dict)
    limits: Limits = Field(default_factory=Limits)
    analysis: Analysis | None = Field(
        default=None, description="Decisions about the analysis, made before the first session."
    )
    simulated_participants: SimulatedParticipants | None = later(
        default=None, description="How simulated participants respond to statements in power analyses and rehearsals."
    )

    def text(self, value: str | dict[str, str], language: str) -> str:
        """Return a localised text in one of the study's languages."""
        return text_in(value, language)

    def paragraphs(self, value: str | dict[str, str], language: str) -> tuple[str, ...]:
        """Return the paragraphs of a localised text."""
        return tuple(text_in(value, language).split("\n\n"))

    @property
    def main_blocks(self) -> tuple[Block, ...]:
        """The blocks that are analysed, in the order of the session."""
        return tuple(block for block in self.blocks_in_order if block.phase == "main")

    @property
    def blocks_with_statements(self) -> tuple[Block, ...]:
        """The main blocks with statements after each trial."""
        asked_in = ((block, self.questionnaire_of(block.id)) for block in self.main_blocks if block.design is None)
        return tuple(block for block, asked in asked_in if asked is not None and asked.statements)

    @property
    def blocks_in_order(self) -> tuple[Block, ...]:
        """All blocks in the order of the session."""
        return tuple(self.blocks[step] for step in self.steps if step in self.blocks)

    @property
    def shares(self) -> dict[str, int]:
        """The share of each group by name; empty without groups."""
        return {name: group.share for name, group in self.groups.items()}

    @property
    def randomises(self) -> bool:
        """Whether participants are assigned to groups at random."""
        return bool(self.groups) and self.study.group_assignment == "randomised"

    @property
    def asks_group(self) -> bool:
        """Whether groups are pre-existing, so that the operator enters each participant's group."""
        return bool(self.groups) and not self.randomises

    @property
    def assigns_rows(self) -> bool:
        """Whether blocks, or trials of one, follow a square whose rows are assigned to participants."""
        squares = any(block.order in ("williams", "latin") for block in self.blocks_in_order)
        return squares or self.study.block_order == "balanced"

    @property
    def forms(self) -> dict[str, Questionnaire]:
        """The questionnaires outside blocks by name, in the order of the session."""
        return {step: self.questionnaires[step] for step in self.steps if step in self.questionnaires}

    @property
    def parts(self) -> int:
        """The number of parts."""
        return max((block.part or 0 for block in self.blocks_in_order), default=0)

    def questionnaire_of(self, block_id: str) -> Questionnaire | None:
        """Return the questions after each trial of a block: its questionnaire, or its design's."""
        name = self.blocks[block_id].questionnaire
        return self.design_questions.get(block_id) if name is None else self.questionnaires[name]

    @cached_property
    def design_questions(self) -> dict[str, Questionnaire]:
        """The questions of each block with a design, by the block's id."""
        blocks = (block for block in self.blocks.values() if block.design is not None)
        return {block.id: question_of(self.design_of(block), self.study.languages) for block in blocks}

    def for_session(self, group: str | None, session: int) -> Self:
        """Return the protocol of one session of a participant in ``group``, with one sequence and no groups.

        Parts are numbered in the order of this session. A study whose sessions do not differ is returned unchanged.
        StudyError is raised if the participant has fewer sessions.
        """
        if not self.sessions_differ:
            return self
        steps = self.session_steps(group, session)
        parts = parts_by_block(steps, {name: block.part for name, block in self.blocks.items()})
        blocks = {
            name: block.model_copy(update={"part": parts[name]}) if name in parts else block
            for name, block in self.blocks.items()
        }
        return self.model_copy(update={"sequence": steps, "sequences": (), "groups": {}, "blocks": blocks})

    def design_of(self, block: Block) -> Design:
        """Return a block's design: a table of the file, or a kind with its defaults."""
        return self.designs.get(str(block.design)) or default_design(str(block.design))

    def method_of(self, block: Block) -> Method:
        """Return a block's method: a table of the file, or a kind with its defaults."""
        return self.methods.get(str(block.method)) or default_method(str(block.method))

    def adjusting(self, block: Block, standard: float | None, start: float) -> Adjusting | None:
        """Return the adjustment that starts at a level; None if participants do not set levels."""
        method = None if block.stimulus is None else self.method_of(block)
        return method.adjusting(self.stimulus_of(block), standard, start) if isinstance(method, Adjustment) else None

    def stimulus_of(self, block: Block) -> Stimulus:
        """Return the stimulus of a block."""
        return self.stimuli[str(block.stimulus)]

    def condition_of(self, stimulus: Stimulus) -> str:
        """Return the condition whose number varies."""
        return stimulus.condition or next(iter(self.conditions))

    def standards_of(self, block: Block) -> tuple[float | None, ...]:
        """Return the standards of a block; a single None if the level is the value of the only interval."""
        stimulus = self.stimulus_of(block)
        if stimulus.level_kind == "value" and self.design_of(block).intervals == 1:
            return (None,)
        return block.standards or stimulus.standards or (self.present_value(stimulus),)

    def compares_statement(self, contrast: Contrast) -> bool:
        """Return whether a contrast compares agreement with a statement after each trial."""
        questionnaires = () if contrast.form else filter(None, map(self.questionnaire_of, contrast.blocks))
        return any(item.id == contrast.measure for asked in questionnaires for item in asked.statements)

    def measure_text(self, contrast: Contrast) -> str:
        """Return the measure of a contrast in words: "threshold", "agreement with “thick”", "“roughness”".

        A threshold can be a point of subjective equality, see `Stimulus.has_pse`; without a standard, `pse` is the mean
        setting.
        """
        if contrast.form is None and not contrast.is_of_levels and not self.compares_statement(contrast):
            return f"“{contrast.measure}”"
        block = self.blocks[contrast.blocks[0]]
        if contrast.measure == "threshold" and block.stimulus is not None:
            return self.stimulus_of(block).threshold_term(self.design_of(block))
        if contrast.measure == "pse" and block.design is not None and self.design_of(block).intervals == 1:
            return MEAN_SETTING
        return contrast.measure_text

    def measures_of(self, block: Block) -> tuple[str, ...]:
        """Return the measures of `OF_LEVELS` that the answers of a block with a design determine.

        An exponent needs estimates, or thresholds at two standards or more, on a level that is not a value.
        """
        design, stimulus = self.design_of(block), None if block.stimulus is None else self.stimulus_of(block)
        measures = {"rating": {"d_prime"}, "number": {"exponent"}, "setting": {"pse"}}.get(design.reply, set())
        if design.reply == "choice" and design.can_be_correct(stimulus):
            measures.add("d_prime")
        if design.reply == "choice" and stimulus is not None and stimulus.rises(design):
            measures.add("threshold")
            if stimulus.level_kind != "value" and len(self.standards_of(block)) > 1:
                measures.add("exponent")
        return tuple(measure for measure in OF_LEVELS if measure in measures)

    def present_value(self, stimulus: Stimulus) -> float:
        """Return the varied number's value in the protocol (StudyError if the condition has none)."""
        name = self.condition_of(stimulus)
        if stimulus.vary in OF_CONDITION:
            return float(getattr(self.conditions[name], stimulus.vary))
        return value_of(self.scene_for(name), stimulus.vary)

    def compared_in(self, block_id: str) -> Compared | None:
        """Return the quantity that a main block compares, as stated or inferred; None for other blocks."""
        block = self.blocks[block_id]
        if block.phase != "main":
            return None
        return block.compares or compared([self.conditions[name] for name in self.conditions_in(block_id)])

    def conditions_in(self, block_id: str) -> tuple[str, ...]:
        """Return the conditions that a block presents, with or without a varied number."""
        block = self.blocks[block_id]
        if block.stimulus is None:
            return block.conditions
        return (self.condition_of(self.stimulus_of(block)),)

    def scene_for(self, condition_id: str) -> Scene:
        """Return the scene of a condition."""
        return self.scene_of(*self.conditions[condition_id].liquid_ids)

    def scene_of(self, *liquid_ids: str) -> Scene:
        """Return a scene with some of the liquids, including unused ones."""
        return scene_with(self.scene, self.device, [self.liquids[name] for name in liquid_ids])

    def delay_s(self, condition_id: str) -> float:
        """Return the visual delay of a condition [s]."""
        return self.conditions[condition_id].delay_ms / 1000

    @property
    def has_imperfect_link(self) -> bool:
        """Whether any force of the study is sent with delay, jitter or loss."""
        varied = any(stimulus.vary in OF_LINK for stimulus in self.stimuli.values())
        return varied or any(condition.link().acts for condition in self.conditions.values())

    def presented_scene(self, presented: Stimulated, link_seed: int = 0) -> Scene:
        """Return the scene of a presented condition; ``link_seed`` is the seed of the force's jitter and loss."""
        scene = self.scene_for(presented.condition)
        link = self.presented_condition(presented).link(link_seed)
        if link.acts:
            scene = Scene.model_validate(scene.model_copy(update={"link": link}))
        if presented.vary is None or presented.vary in OF_CONDITION:
            return scene
        return override_value(scene, presented.vary, presented.value)

    def presented_condition(self, presented: Stimulated) -> Condition:
        """Return the presented condition, with the varied number if it belongs to the force link."""
        varied = {presented.vary: presented.value} if presented.vary in OF_LINK else {}
        return self.conditions[presented.condition].model_copy(update=varied)

    def presented_delay_s(self, presented: Stimulated) -> float:
        """Return the visual delay of the tank [s]."""
        return presented.value / 1000 if presented.vary == DELAY else self.delay_s(presented.condition)
