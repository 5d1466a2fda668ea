"""The tracks of a block with a design: what its codes stand for, and how many slots each has."""

from __future__ import annotations

from dataclasses import dataclass

from study_app.haptics.model.overrides import value_of
from study_app.protocol.blocks import Block
from study_app.protocol.model import OF_LEVELS, Protocol
from study_app.protocol.trials.designs import Design, default_design
from study_app.protocol.trials.methods import Adjusting, Adjustment, Method, default_method
from study_app.protocol.trials.stimuli import OF_CONDITION, Stimulus, rises


@dataclass(frozen=True, slots=True)
class Track:
    """A sequence of at most ``slots`` trials whose levels are chosen together.

    Its code stands for ``name``: the standard and a number ("8/1", "/1" without a standard), or a condition.
    ``comparison`` is the condition that is compared with the block's standard, None if a number is varied; ``number``
    counts the tracks of its standard from 1; ``catch`` has, for each catch trial, the range of slots (from 0) from
    which its own is drawn.
    """

    name: str
    standard: float | None
    comparison: str | None
    slots: int
    number: int = 1
    catch: tuple[range, ...] = ()


def tracks_of(protocol: Protocol, block: Block) -> tuple[Track, ...]:
    """Return the tracks of a block with a design, in file order."""
    design = design_of(protocol, block)
    if block.stimulus is None:
        return tuple(Track(name, None, name, block.repetitions) for name in block.conditions if name != block.standard)
    stimulus, method = stimulus_of(protocol, block), method_of(protocol, block)
    comparisons = method.presentations(stimulus)
    others = comparisons + design.noise(comparisons) + (design.first is not None)
    catch = () if (rule := block.catch) is None else tuple(rule.stretch(number) for number in range(rule.count(others)))
    slots = others + len(catch)
    return tuple(
        Track(f"{'' if standard is None else f'{standard:.17g}'}/{number}", standard, None, slots, number, catch)
        for standard in standards_of(protocol, block)
        for number in range(1, method.tracks + 1)
    )


def track_of(protocol: Protocol, block: Block, name: str) -> Track:
    """Return the track with a name (StopIteration if there is none)."""
    return next(track for track in tracks_of(protocol, block) if track.name == name)


def standards_of(protocol: Protocol, block: Block) -> tuple[float | None, ...]:
    """Return the standards of a block; a single None if the level is the value of the only interval."""
    stimulus = stimulus_of(protocol, block)
    if stimulus.level_kind == "value" and design_of(protocol, block).intervals == 1:
        return (None,)
    return block.standards or stimulus.standards or (present_value(protocol, stimulus),)


def present_value(protocol: Protocol, stimulus: Stimulus) -> float:
    """Return the varied number's value in the protocol (StudyError if the condition has none)."""
    name = condition_of(protocol, stimulus)
    condition = protocol.conditions[name]
    if stimulus.vary in OF_CONDITION:
        return float(getattr(condition, stimulus.vary))
    return value_of(protocol.scene_for(name), stimulus.vary)


def design_of(protocol: Protocol, block: Block) -> Design:
    """Return a block's design: a table of the file, or a kind with its defaults."""
    name = str(block.design)
    return protocol.designs[name] if name in protocol.designs else default_design(name)


def method_of(protocol: Protocol, block: Block) -> Method:
    """Return a block's method: a table of the file, or a kind with its defaults."""
    name = str(block.method)
    return protocol.methods[name] if name in protocol.methods else default_method(name)


def adjusting_of(protocol: Protocol, block: Block, standard: float | None, start: float) -> Adjusting | None:
    """Return the adjustment that starts at a level; None if participants do not set levels."""
    method = None if block.stimulus is None else method_of(protocol, block)
    if not isinstance(method, Adjustment):
        return None
    return method.adjusting(stimulus_of(protocol, block), standard, start)


def has_correct_answer(design: Design, stimulus: Stimulus | None) -> bool:
    """Return whether answers can be correct.

    A level that is a value may be above or below the standard: then an interval can still differ from the others, or be
    the same as another, but a forced choice between more and less has no correct answer.
    """
    by_value = stimulus is not None and stimulus.level_kind == "value"
    return design.has_correct_answer and not (by_value and design.asks_for_more)


def measures_of(protocol: Protocol, block: Block) -> tuple[str, ...]:
    """Return the measures of `OF_LEVELS` that the answers of a block with a design determine.

    An exponent needs estimates, or thresholds at two standards or more, which are on a level that is not a value.
    """
    design, stimulus = design_of(protocol, block), None if block.stimulus is None else stimulus_of(protocol, block)
    measures = {"rating": {"d_prime"}, "number": {"exponent"}, "setting": {"pse"}}.get(design.reply, set())
    if design.reply == "choice" and has_correct_answer(design, stimulus):
        measures.add("d_prime")
    if design.reply == "choice" and stimulus is not None and rises(stimulus, design):
        measures.add("threshold")
        if stimulus.level_kind != "value" and len(standards_of(protocol, block)) > 1:
            measures.add("exponent")
    return tuple(measure for measure in OF_LEVELS if measure in measures)


def success_name(design: Design, stimulus: Stimulus | None) -> str:
    """Return the name of a success: "correct", "yes", or "comparison chosen" if no answer is correct."""
    unlike_others = design.has_correct_answer and not has_correct_answer(design, stimulus)
    return "comparison chosen" if unlike_others else design.success_name


def stimulus_of(protocol: Protocol, block: Block) -> Stimulus:
    """Return the stimulus of a block."""
    return protocol.stimuli[str(block.stimulus)]


def condition_of(protocol: Protocol, stimulus: Stimulus) -> str:
    """Return the condition whose number varies."""
    return stimulus.condition or next(iter(protocol.conditions))
