"""A study as a frozen, validated value; field names are the keys of the TOML file.

Each class is one table of the file (blocks, tasks and questionnaires have modules of their own). What a single table
can decide by itself is checked by its class; what needs two tables is in ``references`` and ``checks``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Annotated, Any, Literal, Self, TypeAlias, TypeVar

from pydantic import BaseModel, BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.haptics.scene import Accuracy, Body, Estimator, Ewma, Knee, Liquid, MotionBox, Scene
from study_app.protocol.analysis import Analysis
from study_app.protocol.blocks import Block, Compared
from study_app.protocol.questionnaires import Item, Questionnaire, Scale
from study_app.protocol.table import Table
from study_app.protocol.tasks import Explore, Reach, Task
from study_app.protocol.texts import Id, Language, Localised, text_in

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


class StudyHead(Table):
    """Which study this is."""

    name: str = Field(pattern=r"^[a-z][a-z0-9]*$", max_length=40, description="Short name, used in folders and files.")
    title: Localised = Field(description="Title as people read it.")
    description: str = Field(default="", description="What the study asks, for those who find its results.")
    version: str = Field(
        pattern=r"^[0-9A-Za-z.+-]+$", description="Version of this protocol; raise it with every change."
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

    rate_hz: float = Field(default=1000, ge=250, le=4000, description="Rate of the servo [Hz].")
    force_limit_n: float = Field(
        default=MAX_FORCE_N, gt=0, le=MAX_FORCE_N, description="Largest force on the hand [N]."
    )
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

    scale: float = Field(default=10, ge=0.01, le=100, description="Scene metres per hand metre.")
    origin_m: tuple[float, float, float] = Field(
        default=(0, 0, 0), description="Scene point under the hand's zero [m]."
    )
    body: Body = Field(default_factory=Body, description="The ball that is felt.")
    velocity: Estimator = Field(default_factory=Ewma, description="How velocity is estimated from positions.")
    knee: Knee = Field(default_factory=Knee, description="How high speeds are lowered.")
    motion: MotionBox = Field(default_factory=MotionBox, description="How the ball is expected to move, scene.")
    accuracy: Accuracy = Field(default_factory=Accuracy, description='What effects = "auto" may leave out.')


class Condition(Table):
    """A named combination of what is felt (one liquid, or several with regions) and how late it is seen."""

    liquid: Id | None = Field(default=None, description="The liquid; or give liquids.")
    liquids: tuple[Id, ...] = Field(default=(), description="Several liquids; where they overlap the last one counts.")
    delay_ms: float = Field(default=0, ge=0, le=1000, description="Delay of everything drawn in the tank [ms].")
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
    body: Localised = Field(description="The text; a blank line begins a paragraph.")
    button: Localised | None = Field(default=None, description="Words on the button; left out: Continue.")
    min_s: float | None = Field(
        default=None,
        gt=0,
        le=3600,
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
    """What a trial may show at most and still be valid."""

    lateness_ms: float = Field(default=2, gt=0, description="99th percentile of the lateness of ticks [ms].")
    worst_gap_ms: float = Field(default=20, gt=0, description="Longest time between two ticks [ms].")
    delay_error_ms: float = Field(default=25, gt=0, description="95th percentile of achieved − requested delay [ms].")
    frame_gap_ms: float = Field(
        default=250, gt=0, description="Longest time before the first frame or between two [ms]."
    )
    withheld_percent: float = Field(
        default=5, gt=0, le=100, description="Share of the force that passivity controller and slew limit withhold [%]."
    )


T = TypeVar("T")


def _named(tables: Any) -> Any:
    """Give each table its name as ``id``, so that it can be used without the dictionary that held it."""
    if not isinstance(tables, Mapping):
        return tables
    return {name: {"id": name, **table} if isinstance(table, Mapping) else table for name, table in tables.items()}


Named: TypeAlias = Annotated[dict[Id, T], BeforeValidator(_named)]


class Protocol(Table):
    """The whole file."""

    format: Literal[1] = Field(description="Version of this file format.")
    study: StudyHead
    device: DeviceNeeds
    scene: SceneDefaults = Field(default_factory=SceneDefaults)
    liquids: Named[Liquid] = Field(min_length=1)
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
        return Scene(
            **dict(self.scene),
            rate_hz=self.device.rate_hz,
            liquids=tuple(self.liquids[name] for name in liquid_ids),
            force_limit_n=self.device.force_limit_n,
        )

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
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **described}
