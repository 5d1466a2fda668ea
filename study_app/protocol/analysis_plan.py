"""What was decided about the analysis before the first session; the report holds the results to it.

Nothing here changes what a participant meets. It stands in every receipt, so that it cannot be decided afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.source.document import Path, entries
from study_app.protocol.source.problems import Fault, did_you_mean
from study_app.protocol.table import Table
from study_app.protocol.texts import Id

LISTS = ("primary", "names", "rising", "falling")


class Analysis(Table):
    """The decisions; a protocol without this table decides nothing, and the report calls all it finds exploratory."""

    alpha: Annotated[float, within(0.0001, 0.2, "no study of people shows less than 0.0001")] = Field(
        default=0.05, description="Largest p that counts as significant."
    )
    equivalence_bound: Annotated[float, within(0.05, 6, "the scale has 6 steps, means differ by tenths")] | None = (
        Field(
            default=None,
            description="Largest mean difference to no delay that would not matter, in points of the scale; left out: "
            "equivalence is not tested.",
        )
    )
    primary: tuple[Id, ...] = Field(
        default=(), description="Items of the questions asked; the others are exploratory. Left out: all are primary."
    )
    names: tuple[Id, ...] = Field(
        default=(),
        description="Items that name a liquid: the one with the single highest answer is what the participant named.",
    )
    rising: tuple[Id, ...] = Field(default=(), description="Items whose answers are expected to rise with delay.")
    falling: tuple[Id, ...] = Field(default=(), description="Items whose answers are expected to fall with delay.")
    noticed: Id | None = Field(
        default=None, description="Item of which agreement (5 to 7) means that a delay was noticed."
    )


def decisions(document: Mapping[str, Any]) -> Iterator[Fault]:
    """Check that what is decided is about statements there are, each once, and that liquids are named by such items."""
    found = (item for _, item in entries(document, "questionnaires.*.items.*") if isinstance(item, Mapping))
    items = {item["id"] for item in found if isinstance(item.get("id"), str) and "kind" not in item}
    for key in LISTS:
        yield from _listed(list(entries(document, f"analysis.{key}.*")), items)
    yield from _unknown(entries(document, "analysis.noticed"), items)
    falling = [name for _, name in entries(document, "analysis.falling.*")]
    for path, name in entries(document, "analysis.rising.*"):
        if name in falling:
            yield Fault(path, f'"{name}" is expected to fall too', "an item rises, falls, or is in neither list")
    names = [name for _, name in entries(document, "analysis.names.*")]
    for path, name in entries(document, "conditions.*.label"):
        if isinstance(name, str) and name not in names:
            yield Fault(path, f'"{name}" is not among analysis.names', "add it there, or leave the label out")


def _listed(found: list[tuple[Path, Any]], items: set[str]) -> Iterator[Fault]:
    yield from _unknown(iter(found), items)
    for place, (path, name) in enumerate(found):
        if name in [earlier for _, earlier in found[:place]]:
            yield Fault(path, f'"{name}" is there twice')


def _unknown(found: Iterator[tuple[Path, Any]], items: set[str]) -> Iterator[Fault]:
    for path, name in found:
        if isinstance(name, str) and name not in items:
            yield Fault(path, f'there is no item "{name}"', did_you_mean(name, items))
