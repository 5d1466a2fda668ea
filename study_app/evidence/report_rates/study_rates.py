"""One batch of simulated studies evaluated by the report's own tests, and the errors of their verdicts."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np

from study_app.analysis.data.blocks import Block
from study_app.analysis.data.measures import Array
from study_app.analysis.evaluate import found_in
from study_app.analysis.findings.block_tests import Asked, of_tables
from study_app.analysis.findings.delays import ContrastsWithControl, DetectionThreshold, LowestDelay, common_ms
from study_app.analysis.findings.finding import FOUND
from study_app.analysis.findings.recognition import LiquidRecognition
from study_app.analysis.findings.statement_tests import DelayTrend, OverAll, Pairs, SettingsDiffer, over_all
from study_app.analysis.report.sections import answers as answered
from study_app.analysis.results import BlockFound, Failures, Results
from study_app.evidence.report_rates.known_effects import Extent, Generator, Simulated, alike, answers, true_differences
from study_app.evidence.report_rates.rates import Limit, Rate

BATCH: Final = 25
DRAWS: Final = 999
"""Of the test over all statements: its error rate holds with any number."""

Event: TypeAlias = tuple[str, Limit]
"""What is counted, and its limit."""

Truth: TypeAlias = tuple[Array, ...]
"""True differences of means to the first setting (settings, items), of each block."""

LOST: Final[Event] = ("a part of the report is lost", "none")
CLAIMED: Final = "the first page claims something"


@dataclass(frozen=True, slots=True)
class Cell:
    """Studies of one kind: model of the answers, true effects, and number of participants."""

    generator: Generator
    extent: Extent
    participants: int

    @property
    def name(self) -> str:
        """The cell in words, without its size."""
        return f"{self.generator}, {self.extent}"


def truth(simulation: Simulated, cell: Cell) -> Truth:
    """Return the true effects in the studies of a cell, which do not depend on their size."""
    return true_differences(simulation, cell.generator, cell.extent)


def count(simulation: Simulated, cell: Cell, truth: Truth, seed: int, batch: int, studies: int) -> tuple[Rate, ...]:
    """Return the rates of so many studies of a cell, those of batch number ``batch``."""
    events: dict[Event, int] = {}
    for study in range(batch * BATCH, batch * BATCH + studies):
        for event, happened in _study(simulation, cell, truth, seed, study).items():
            events[event] = events.get(event, 0) + happened
    return tuple(
        Rate(cell.name, cell.participants, what, limit, hits, studies) for (what, limit), hits in events.items()
    )


def _study(simulation: Simulated, cell: Cell, truth: Truth, seed: int, study: int) -> dict[Event, bool]:
    failures = Failures()
    given = answers(simulation, cell.generator, cell.extent, cell.participants, seed, study)
    people = tuple(f"P{number:03d}" for number in range(cell.participants))
    found: dict[Event, bool] = {}
    results: list[BlockFound] = []
    for place, (block, values) in enumerate(zip(simulation.blocks, given, strict=True)):
        single = {item.id: values[:, :, [column]] for column, item in enumerate(block.items)}
        asked = of_tables(
            block,
            simulation.decided if cell.extent != "partial" else replace(simulation.decided, noticed=None),
            people,
            single,
            seed=1,
            failures=failures,
            planning=False,
            verdicts_only=True,
        )
        result = found_in(None, asked)
        if cell.extent != "partial":  # with draws of its own: the same draws in all studies would shift the rate
            result = OverAll.add_to(result, over_all(replace(asked, seed=1 + study), DRAWS))
        results.append(result)
        judged = _in_delays if block.kind == "delays" else _in_liquids
        for (what, at_most), hit in judged(asked, result, cell, truth[place]):
            found[f"{what} ({block.kind})", at_most] = hit
        if cell.extent == "empty":
            overall = OverAll.of(result)
            differs = overall is not None and (overall.p or 1.0) <= simulation.decided.alpha
            found[f"test over all statements ({block.kind})", "at most 5 %"] = differs
    found[LOST] = bool(failures.found)
    if cell.extent != "partial":
        whole = Results(simulation.decided, people, tuple(results), delivered=(), orders={}, performance=None, seed=1)
        limit: Limit = "at most 5 %" if cell.extent == "empty" else "counted"
        found[CLAIMED, limit] = any(one.claims for one in answered(whole))
    return found


def _in_liquids(asked: Asked, found: BlockFound, cell: Cell, _truth: Array) -> Iterator[tuple[Event, bool]]:
    if cell.extent == "empty":
        yield (
            ("settings differ in a statement", "at most 5 %"),
            any(one.verdict in FOUND for one in SettingsDiffer.of(found)),
        )
        yield ("liquids recognised", "at most 5 %"), _recognised(found)
    equal = _equal_pairs(asked.block, cell.extent)
    if equal:
        found_equal = any(one.tested.verdict in FOUND and (one.first, one.second) in equal for one in Pairs.of(found))
        yield ("equal liquids distinguished", "at most 5 %"), found_equal
    if cell.extent == "full":
        yield ("some liquids distinguished", "counted"), any(one.tested.verdict in FOUND for one in Pairs.of(found))
        yield ("liquids recognised", "counted"), _recognised(found)


def _recognised(found: BlockFound) -> bool:
    recognition = LiquidRecognition.of(found)
    return recognition is not None and recognition.verdict in FOUND


def _equal_pairs(block: Block, extent: Extent) -> set[tuple[str, str]]:
    """Return the pairs of codes whose settings are equal in truth."""
    like = alike(block, extent)
    codes = block.codes
    return {
        (first, second)
        for one, first in enumerate(codes)
        for other, second in enumerate(codes)
        if one < other and like.get(one, one) == like.get(other, other)
    }


def _in_delays(asked: Asked, found: BlockFound, cell: Cell, truth: Array) -> Iterator[tuple[Event, bool]]:
    block = asked.block
    null = [block.settings[at].delay_ms or 0.0 for at in alike(block, cell.extent)]
    if cell.extent == "empty":
        yield ("trend in a statement", "at most 5 %"), any(one.verdict in FOUND for one in DelayTrend.of(found))
        yield ("detection threshold printed", "at most 5 %"), _printed(found)
    if null:
        low = any(one.over_all_ms is not None and one.over_all_ms <= max(null) for one in LowestDelay.of(found))
        yield ("lowest delay stated too low", "at most 5 %"), low
        differ = any(one.verdict == "different" and one.delay_ms <= max(null) for one in ContrastsWithControl.of(found))
        yield ("equal delays called different", "at most 5 %"), differ
    if cell.extent != "empty":
        yield from _equivalence(asked, found, truth)
    if cell.extent == "full":
        yield ("lowest delay stated", "counted"), any(one.over_all_ms is not None for one in LowestDelay.of(found))
        yield ("detection threshold printed", "counted"), _printed(found)


def _printed(found: BlockFound) -> bool:
    threshold = DetectionThreshold.of(found)
    return threshold is not None and threshold.effect is not None


def _equivalence(asked: Asked, found: BlockFound, truth: Array) -> Iterator[tuple[Event, bool]]:
    """Yield whether a delay is called equivalent that is not: the one nearest to the bound, and on the first page."""
    bound = asked.decided.equivalence_bound
    if bound is None or not ContrastsWithControl.of(found):
        return
    beyond = {
        (item.id, setting.delay_ms or 0.0): float(away)
        for setting, row in zip(asked.block.settings, np.abs(truth), strict=True)
        for item, away in zip(asked.block.items, row, strict=True)
        if away >= bound
    }
    if not beyond:
        return
    nearest = min(beyond, key=beyond.__getitem__)
    called = {(one.item, one.delay_ms): one.verdict == "equivalent" for one in ContrastsWithControl.of(found)}
    yield ("nearest beyond the bound called equivalent", "at most 5 %"), called[nearest]
    up_to = common_ms(found)
    too_far = up_to is not None and any(delay <= up_to for _, delay in beyond)
    yield ("“unchanged up to” too long", "at most 5 %"), too_far
