"""Blocks of levels: how their trials are built and, once the key is open, what they vary."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from study_app.analysis.tables.compared_blocks import Setting, settings_in, spoken
from study_app.protocol.analysis_plan import Published
from study_app.protocol.blocks import Phase
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import every_step_of
from study_app.protocol.table import text_in
from study_app.protocol.trials.designs import KINDS as DESIGN_KINDS
from study_app.protocol.trials.designs import Design, default_design
from study_app.protocol.trials.methods import Method
from study_app.protocol.trials.stimuli import Assumed, Stimulus, assumed_for, rises
from study_app.protocol.trials.tracks import design_of, has_correct_answer, method_of, stimulus_of, success_name
from study_app.store.blinded.blinding import Key, whole_protocol


@dataclass(frozen=True, slots=True)
class LevelBlock:
    """A block with a design.

    ``stimulus`` is what it varies, ``method`` how its levels were chosen: None where it compares conditions, and while
    the key is sealed; ``published`` are the values of other studies that the protocol compares it with;
    ``wrong_most`` is the share of incorrect answers to catch trials that is permitted, None without catch trials.
    """

    id: str
    title: str
    phase: Phase
    design: Design
    stimulus: Stimulus | None
    settings: tuple[Setting, ...]
    method: Method | None = None
    published: tuple[Published, ...] = ()
    wrong_most: float | None = None

    @property
    def has_correct_answer(self) -> bool:
        """Whether an answer can be correct."""
        return has_correct_answer(self.design, self.stimulus)

    @property
    def counts(self) -> str:
        """What the share of answers at a level is of."""
        return success_name(self.design, self.stimulus)

    @property
    def standards_rove(self) -> bool:
        """Whether trials of several standards alternate."""
        standards = {one.standard for one in self.settings}
        return len(standards) > 1 and self.method is not None and self.method.order == "interleaved"

    @property
    def assumed(self) -> Assumed | None:
        """What is assumed about its psychometric function; None where no answer enters one, or the key is sealed."""
        if self.stimulus is None or not rises(self.stimulus, self.design):
            return None
        if self.method is None:
            return assumed_for(self.stimulus, self.design)
        return self.method.assumed(self.stimulus, self.design)

    def presents_modulus(self, index: int) -> bool:
        """Return whether the trial at this place in the block presents the modulus, which is not analysed."""
        return self.design.first is not None and index == 1


def level_blocks(protocol: Mapping[str, Any], key: Key | None) -> tuple[LevelBlock, ...]:
    """Return the blocks with a design of the protocol in a receipt, in the order of the session; ``key`` is open.

    Raises
    ------
    KeyError, TypeError, AttributeError, ValueError
        They give no protocol that this version knows.
    """
    steps = [step for step in every_step_of(protocol) if "slots" in protocol["blocks"].get(step, {})]
    whole = whole_protocol(protocol, key) if key is not None and steps else None
    return tuple(_block(protocol, step, key, whole) for step in steps)


def _block(protocol: Mapping[str, Any], step: str, key: Key | None, whole: Protocol | None) -> LevelBlock:
    table = protocol["blocks"][step]
    stimulus: Stimulus | None = None
    method: Method | None = None
    published: tuple[Published, ...] = ()
    if whole is not None:
        block = whole.blocks[step]
        design = design_of(whole, block)
        if block.stimulus is not None:
            stimulus, method = stimulus_of(whole, block), method_of(whole, block)
        if whole.analysis is not None:
            published = tuple(one for one in whole.analysis.published if one.block == step)
    elif (written := protocol.get("designs", {}).get(table["design"])) is not None:
        design = DESIGN_KINDS[written["kind"]].model_validate(written)
    else:
        design = default_design(table["design"])
    title = text_in(table["title"], spoken(protocol))
    return LevelBlock(
        step, title, table["phase"], design, stimulus, settings_in(protocol, step, key), method, published,
        (table.get("catch") or {}).get("wrong_most"),
    )  # fmt: skip
