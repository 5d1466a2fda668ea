"""A study as a frozen, validated value; field names are the keys of the TOML file.

Each class is one table of the file (blocks, tasks and questionnaires have modules of their own). What a single table
can decide by itself is checked by its class; what needs two tables is in ``references`` and ``checks``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Annotated, Any, Literal, Self, TypeAlias, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from study_app.haptics.model.ranges import DensityKgM3, DiameterM, DragCoefficient, Metres, within
from study_app.haptics.model.scene import Accuracy, Body, Estimator, Ewma, Knee, Liquid, MotionBox, Scene, SceneScale
from study_app.protocol.analysis_plan import Analysis
from study_app.protocol.blocks import Block, Compared
from study_app.protocol.questions.questionnaire import Item, Questionnaire
from study_app.protocol.questions.rating import Scale
from study_app.protocol.table import Table
from study_app.protocol.texts import Body as PageBody
from study_app.protocol.texts import Description, Id, Language, Localised, text_in
from study_app.protocol.trials.task import Explore, Reach, Seconds, Task

__all__ = [
    "Analysis",
    "Block",
    "Condition",
    "DeviceNeeds",
    "Explore",
    "Item",
    "Limits",
    "PageText",
    "Protocol",
    "Questionnaire",
    "Reach",
    "Scale",
    "SceneDefaults",
    "StudyHead",
    "schema",
]

MAX_FORCE_N = 8.0
LIQUID_FILE = "A liquid file with one liquid, in place of the keys of this table: its path, relative to this file."
HandForceN: TypeAlias = Annotated[
    float, within(0.1, MAX_FORCE_N, "below 0.1 N a hand feels little; 8 N is the most that is safe")
]


def _whole(value: Any) -> Any:
    if type(value) is not int:
        raise PydanticCustomError("format", "must be 1, the number of this format")
    return value


Format: TypeAlias = Annotated[Literal[1], BeforeValidator(_whole)]


class StudyHead(Table):
    """Which study this is."""

    name: str = Field(pattern=r"^[a-z][a-z0-9]*$", max_length=40, description="Short name, used in folders and files.")
    title: Localised = Field(description="Title as people read it.")
    description: Description = Field(default="", description="What the study asks, for those who find its results.")
    version: str = Field(
        pattern=r"^[0-9A-Za-z.+-]+$", max_length=40, description="Version of this protocol; raise it with every change."
    )
    languages: tuple[Language, ...] = Field(
        min_length=1, description="Languages every text exists in; the first is preset."
    )
    resume: Literal["trial", "block"] = Field(
        default="trial", description="Where a session goes on that was interrupted: its trial again, or its block."
    )
    blinding: Literal["double", "single"] = Field(
        default="double",
        description="Who must not know what is felt: participant and operator, or the participant alone; in a "
        "single-blind study the operator sees force and wake while it runs.",
    )


class DeviceNeeds(Table):
    """What the study asks of whichever device is used."""

    rate_hz: Annotated[float, within(250, 4000, "no force is stable below, and no tick fits above")] = Field(
        default=1000, description="Rate of the servo [Hz]."
    )
    force_limit_n: HandForceN = Field(default=MAX_FORCE_N, description="Largest force on the hand [N].")
    workspace_mm: tuple[float, float, float] = Field(
        description="Full sizes of the drawn tank in x, y, z, hand frame, centred on the device's middle [mm]."
    )

    @property
    def workspace_m(self) -> tuple[float, float, float]:
        """Full sizes of the tank, hand frame [m]."""
        x, y, z = self.workspace_mm
        return (x / 1000, y / 1000, z / 1000)

    @model_validator(mode="after")
    def _workspace_has_room(self) -> Self:
        if not all(10 <= size <= 1000 for size in self.workspace_mm):
            raise PydanticCustomError("range", "every size must be from 10 to 1000 mm", {"place": "workspace_mm"})
        return self


class SceneDefaults(Table):
    """What all conditions share of the scene: everything but the liquids."""

    scale: SceneScale = Field(default=10, description="Scene metres per hand metre.")
    origin_m: Metres = Field(default=(0, 0, 0), description="Scene point under the hand's zero [m].")
    body: Body = Field(default_factory=Body, description="The ball that is felt.")
    velocity: Estimator = Field(default_factory=Ewma, description="How velocity is estimated from positions.")
    knee: Knee = Field(default_factory=Knee, description="How high speeds are lowered.")
    motion: MotionBox = Field(default_factory=MotionBox, description="How the ball is expected to move, scene.")
    accuracy: Accuracy = Field(default_factory=Accuracy, description='What effects = "auto" may leave out.')


class Condition(Table):
    """A named combination of what is felt (one liquid, or several with regions) and how late it is seen."""

    liquid: Id | None = Field(default=None, description="The liquid; or give liquids.")
    liquids: tuple[Id, ...] = Field(default=(), description="Several liquids; where they overlap the last one counts.")
    delay_ms: Annotated[float, within(0, 1000, "what is seen more than a second late is no feedback")] = Field(
        default=0, description="Delay of everything drawn in the tank [ms]."
    )
    label: Id | None = Field(
        default=None, description="The item of analysis.names that is right for it; left out: none is."
    )

    @property
    def liquid_ids(self) -> tuple[str, ...]:
        """The liquids of the scene, in order."""
        return self.liquids if self.liquid is None else (self.liquid,)

    @model_validator(mode="after")
    def _liquid_one_way(self) -> Self:
        if (self.liquid is None) == (not self.liquids):
            raise PydanticCustomError("one_of", "give either liquid or liquids, one of the two", {"place": "liquid"})
        return self


def compared(conditions: Sequence[Condition]) -> Compared:
    """Return what these conditions differ in: delays where they have one liquid and several delays."""
    liquids, delays = ({getattr(one, name) for one in conditions} for name in ("liquid_ids", "delay_ms"))
    return "delays" if len(liquids) == 1 and len(delays) > 1 else "liquids"


class PageText(Table):
    """A page to read."""

    kind: Literal["consent", "instructions", "break", "debrief"]
    title: Localised = Field(description="Heading of the page.")
    body: PageBody = Field(description="The text; a blank line begins a paragraph.")
    button: Localised | None = Field(default=None, description="Words on the button; left out: Continue.")
    min_s: Seconds | None = Field(
        default=None,
        description="A break's least time [s], counted down on the page; left out: as long as the participant likes.",
    )

    @model_validator(mode="after")
    def _only_breaks_last(self) -> Self:
        if self.min_s is not None and self.kind != "break":
            raise PydanticCustomError(
                "break", "belongs to a page of kind break, not {kind}", {"kind": self.kind, "place": "min_s"}
            )
        return self


class Limits(Table):
    """What a trial may show at most, and what it must show at least, and still be valid."""

    lateness_ms: Annotated[float, within(0.01, 1000, "no servo is more punctual, and 1 s is a failure")] = Field(
        default=2, description="99th percentile of the lateness of ticks [ms]."
    )
    worst_gap_ms: Annotated[float, within(0.25, 1000, "from a tick at 4 kHz to a second, which is a failure")] = Field(
        default=20, description="Longest time between two ticks [ms]."
    )
    delay_error_ms: Annotated[float, within(1, 1000, "no screen is more punctual, and 1 s is a failure")] = Field(
        default=25, description="95th percentile of achieved − requested delay [ms]."
    )
    frame_gap_ms: Annotated[float, within(1, 1000, "no screen is faster, and 1 s is a failure")] = Field(
        default=250,
        description="Longest time before the first frame or between two, or before the trial's end [ms].",
    )
    withheld_percent: Annotated[float, within(0.01, 100, "a share of the force; none withheld at all is rare")] = Field(
        default=5, description="Share of the force that passivity controller and slew limit withhold [%]."
    )
    targets_percent: Annotated[float, within(0.01, 100, "a share of the targets; left out, any is enough")] | None = (
        Field(default=None, description="Least share of a reaching task's targets that must be reached [%].")
    )

    @model_serializer(mode="wrap")
    def _without_what_is_not_asked(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave a completeness that is not asked for out of files: those of earlier versions do not know it."""
        return {name: value for name, value in plain(self).items() if value is not None}


class OwnBody(Table):
    """The ball in one liquid: what is left out is as in the scene's body."""

    diameter_m: DiameterM | None = None
    drag_coefficient: DragCoefficient | None = None
    density_kg_m3: DensityKgM3 | None = None


class StudyLiquid(Liquid):
    """A liquid of a study: that of the force model, and where it needs one a ball of its own."""

    model_config = ConfigDict(title="Liquid")

    body: OwnBody | None = Field(default=None, description="The ball in this liquid, where it is not the scene's.")

    @model_serializer(mode="wrap")
    def _without_no_body(self, serialized: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what earlier versions did not know: sealed keys keep their bytes."""
        return {name: value for name, value in serialized(self).items() if name != "body" or value is not None}

    @property
    def alone(self) -> Liquid:
        """The liquid without its ball."""
        return Liquid.model_validate(self.model_dump(exclude={"body"}))

    def body_in(self, scene: SceneDefaults) -> Body:
        """Return the ball in this liquid."""
        return (
            scene.body if self.body is None else scene.body.model_copy(update=self.body.model_dump(exclude_none=True))
        )


def scene_with(scene: SceneDefaults, device: DeviceNeeds, liquids: Sequence[StudyLiquid]) -> Scene:
    """Return a scene of some liquids; they have one ball (`checks.balls`)."""
    return Scene(
        **dict(scene) | {"body": liquids[0].body_in(scene)},
        rate_hz=device.rate_hz,
        liquids=tuple(liquid.alone for liquid in liquids),
        force_limit_n=device.force_limit_n,
    )


T = TypeVar("T")


def _named(tables: Any) -> Any:
    """Give each table its name as ``id``, so that it can be used without the dictionary that held it."""
    if not isinstance(tables, Mapping):
        return tables
    return {name: {**table, "id": name} if isinstance(table, Mapping) else table for name, table in tables.items()}


Named: TypeAlias = Annotated[dict[Id, T], BeforeValidator(_named)]


class Protocol(Table):
    """The whole file."""

    format: Format = Field(description="Version of this file format.")
    study: StudyHead
    device: DeviceNeeds
    scene: SceneDefaults = Field(default_factory=SceneDefaults)
    liquids: Named[StudyLiquid] = Field(min_length=1)
    conditions: dict[Id, Condition] = Field(min_length=1)
    tasks: dict[Id, Task] = Field(min_length=1)
    scales: dict[Id, Scale] = Field(default_factory=dict)
    questionnaires: dict[Id, Questionnaire] = Field(default_factory=dict)
    pages: dict[Id, PageText] = Field(default_factory=dict)
    blocks: Named[Block] = Field(min_length=1)
    sequence: tuple[Id, ...] = Field(min_length=1, description="Pages and blocks in the order of the session.")
    limits: Limits = Field(default_factory=Limits)
    analysis: Analysis | None = Field(default=None, description="What was decided before the first session.")

    def text(self, value: str | dict[str, str], language: str) -> str:
        """Return a localised text in one of the study's languages."""
        return text_in(value, language)

    def paragraphs(self, value: str | dict[str, str], language: str) -> tuple[str, ...]:
        """Return the paragraphs of a localised text."""
        return tuple(text_in(value, language).split("\n\n"))

    def labels(self, scale_id: str, language: str) -> tuple[str, ...]:
        """Return the names of the seven points, lowest first."""
        return self.scales[scale_id].labels[language]

    @property
    def main_blocks(self) -> tuple[Block, ...]:
        """The blocks that are analysed, in the order of the session."""
        return tuple(block for block in self.blocks_in_order if block.phase == "main")

    @property
    def blocks_in_order(self) -> tuple[Block, ...]:
        """All blocks in the order of the session."""
        return tuple(self.blocks[step] for step in self.sequence if step in self.blocks)

    @property
    def parts(self) -> int:
        """How many parts the study has."""
        return max(block.part or 0 for block in self.blocks.values())

    def questionnaire_of(self, block_id: str) -> Questionnaire | None:
        """Return what is answered after each trial of a block."""
        name = self.blocks[block_id].questionnaire
        return None if name is None else self.questionnaires[name]

    def compared_in(self, block_id: str) -> Compared | None:
        """Return what a main block compares, as it says or as follows from its conditions; of other blocks None."""
        block = self.blocks[block_id]
        if block.phase != "main":
            return None
        return block.compares or compared([self.conditions[name] for name in block.conditions])

    def scene_for(self, condition_id: str) -> Scene:
        """Return what is felt in a condition."""
        return self.scene_of(*self.conditions[condition_id].liquid_ids)

    def scene_of(self, *liquid_ids: str) -> Scene:
        """Return a scene of some of the liquids, those of no condition too."""
        return scene_with(self.scene, self.device, [self.liquids[name] for name in liquid_ids])

    def delay_s(self, condition_id: str) -> float:
        """Return by how much everything drawn in the tank is late [s]."""
        return self.conditions[condition_id].delay_ms / 1000

    def responses_per_participant(self) -> int:
        """Return how many answers a complete session holds, practice included if it asks anything."""
        return sum(
            len(block.conditions) * block.repetitions * len(self.questionnaires[block.questionnaire].items)
            for block in self.blocks.values()
            if block.questionnaire is not None
        )


@cache
def schema(of: type[BaseModel] = Protocol) -> dict[str, Any]:
    """Return the JSON Schema of a protocol file, for editors that complete and check while one writes."""
    described = of.model_json_schema()
    for node in described["properties"].values():
        if "patternProperties" in node:
            node["additionalProperties"] = False
    for table in ("Liquid", "Block"):  # their id is the name of their table
        for part in described["$defs"].values():
            if part.get("title") == table:
                part["properties"].pop("id")
                part["required"].remove("id")
                if "body" in part["properties"]:  # a liquid of a study may be that of a file instead
                    part["properties"]["file"] = {"type": "string", "description": LIQUID_FILE}
                    part["if"], part["then"] = {"not": {"required": ["file"]}}, {"required": part.pop("required")}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **described}
