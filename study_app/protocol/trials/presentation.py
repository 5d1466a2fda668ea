"""What an interval presents to hand and eye, and how the journal writes an arrangement."""

from __future__ import annotations

from collections.abc import Iterator

from study_app.haptics.model.overrides import override
from study_app.haptics.model.scene import Scene
from study_app.protocol.blocks import Block
from study_app.protocol.model import Condition, Protocol
from study_app.protocol.streams import stream
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.stimuli import DELAY, OF_CONDITION, OF_LINK, Stimulated
from study_app.protocol.trials.tracks import standards_of, stimulus_of


def scene_of(protocol: Protocol, presented: Stimulated, link_seed: int = 0) -> Scene:
    """Return what is felt; ``link_seed`` is that of jitter and loss of the force."""
    scene = protocol.scene_for(presented.condition)
    link = presented_condition(protocol, presented).link(link_seed)
    if link.acts:
        scene = Scene.model_validate(scene.model_copy(update={"link": link}))
    if presented.vary is None or presented.vary in OF_CONDITION:
        return scene
    return override(scene, presented.vary, presented.value)


def presented_condition(protocol: Protocol, presented: Stimulated) -> Condition:
    """Return the presented condition, with its varied number if that is one of its force link."""
    condition = protocol.conditions[presented.condition]
    varied = {presented.vary: presented.value} if presented.vary in OF_LINK else {}
    return condition.model_copy(update=varied)


def link_words(delay_ms: float = 0.0, jitter_ms: float = 0.0, loss: float = 0.0) -> Iterator[str]:
    """Yield what is unusual of how the force of a condition is sent: late [ms], with jitter [ms], with losses."""
    if delay_ms:
        yield f"force {delay_ms:g} ms late"
    if jitter_ms:
        yield f"force jitter {jitter_ms:g} ms"
    if loss:
        yield f"{100 * loss:g} % of forces lost"


def delays_force(protocol: Protocol) -> bool:
    """Return whether a study sends any force late, with jitter or with loss."""
    varied = any(stimulus.vary in OF_LINK for stimulus in protocol.stimuli.values())
    return varied or any(condition.link().acts for condition in protocol.conditions.values())


def link_seed(schedule_seed: int, participant: str, trial: int, attempt: int, interval: int | None) -> int:
    """Return the seed of jitter and loss of the force in one attempt at a trial, or in one of its intervals."""
    draw = stream(schedule_seed, f"force link/{participant}/{trial}/{attempt}/{interval or 1}")
    return int(draw.random() * 2**32)


def delay_s_of(protocol: Protocol, presented: Stimulated) -> float:
    """Return by how much the tank is drawn late [s]."""
    return presented.value / 1000 if presented.vary == DELAY else protocol.delay_s(presented.condition)


def longest_delay_s(protocol: Protocol, block: Block) -> float:
    """Return the longest delay that a block can present [s]: the same for all its trials, so that it reveals none."""
    if block.stimulus is not None and (stimulus := stimulus_of(protocol, block)).vary == DELAY:
        standards = standards_of(protocol, block)
        compared = [stimulus.comparison(one, level) for one in standards for level in stimulus.levels]
        return max(*compared, *(one for one in standards if one is not None)) / 1000
    return max(protocol.delay_s(name) for name in protocol.conditions_in(block.id))


def arrangement_text(design: Design, arrangement: int) -> str:
    """Return an arrangement as the journal writes it: S for the standard, C for the comparison, such as "SC"."""
    return "".join("C" if holds else "S" for holds in design.arrangements[arrangement])


def arrangement_of(design: Design, text: str) -> int:
    """Return the arrangement that the journal writes so (ValueError if the design has none)."""
    return design.arrangements.index(tuple(letter == "C" for letter in text))
