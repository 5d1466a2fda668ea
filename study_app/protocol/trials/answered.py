"""The answered trials of designs, read from a journal whose sealed fields are opened."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.trials.due import Due, due_of
from study_app.protocol.trials.method import Heard
from study_app.protocol.trials.presentation import arrangement_of
from study_app.protocol.trials.tracks import design_of, has_correct_answer, stimulus_of, track_of


def presented_by(protocol: Protocol, codes: Mapping[str, Mapping[str, str]], started: Mapping[str, Any]) -> Due:
    """Return what a trial presented, from the line on its beginning whose sealed fields are opened.

    Raises
    ------
    KeyError
        The line lacks what lines of its event hold, or its sealed fields are not opened; or the key has no such code.
    ValueError
        The design has no such arrangement.
    StopIteration
        The block has no such track.
    """
    block = protocol.blocks[started["block"]]
    design = design_of(protocol, block)
    track = track_of(protocol, block, codes[block.id][started["code"]])
    arrangement = arrangement_of(design, started["arrangement"])
    return due_of(protocol, block, track, arrangement, started["level"], catch=started.get("catch", False))


def heard_of(
    protocol: Protocol,
    block: Block,
    trial: int,
    code: str,
    level: float | None,
    arrangement: int,
    answer: str,
    *,
    catch: bool = False,
) -> Heard:
    """Return the answer to a trial of a block with a design, at the level (None: conditions are compared)."""
    design = design_of(protocol, block)
    stimulus = None if block.stimulus is None else stimulus_of(protocol, block)
    correct = design.is_correct(arrangement, answer) if has_correct_answer(design, stimulus) else None
    success, noise = design.success(arrangement, answer), not any(design.arrangements[arrangement])
    return Heard(trial, code, level or 0.0, success, correct, catch, noise)


def heard_in(protocol: Protocol, lines: Iterable[Mapping[str, Any]]) -> tuple[Heard, ...]:
    """Return the answered trials, each at the level that was presented, by number; the last answer counts.

    Raises
    ------
    KeyError
        A line lacks what lines of its event hold, or sealed fields are not opened.
    ValueError
        A design has no such arrangement.
    """
    started: dict[tuple[int, int], Mapping[str, Any]] = {}
    found: dict[int, Heard] = {}
    for line in lines:
        if line["event"] == "trial_started":
            started[line["trial"], line["attempt"]] = line
        elif line["event"] == "responses":
            start = started[line["trial"], line["attempt"]]
            block = protocol.blocks[start["block"]]
            if block.design is None:
                continue
            arrangement = arrangement_of(design_of(protocol, block), start["arrangement"])
            answer = line["items"][0]["value"]
            found[line["trial"]] = heard_of(
                protocol,
                block,
                line["trial"],
                start["code"],
                start["level"],
                arrangement,
                answer,
                catch=start.get("catch", False),
            )
    return tuple(found[number] for number in sorted(found))
