"""What the designer shows of playing a study: what is under way or asked, and the devices to play with."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from study_app.gui.theme.theme import Tone

PlayAction: TypeAlias = Literal["play", "stop", "keep", "delete", "problems", "close"]

KEEP: tuple[tuple[PlayAction, str], ...] = (("keep", "Keep as pilot"), ("delete", "Delete"))


@dataclass(frozen=True, slots=True)
class PlayState:
    """A line with its buttons: what each asks for, and its words; ``listed`` are lines below it."""

    tone: Tone
    icon: str
    words: str
    actions: tuple[tuple[PlayAction, str], ...] = ()
    listed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PlayDevices:
    """The devices to play with: name and words of each, and the chosen one."""

    choices: tuple[tuple[str, str], ...] = ()
    chosen: str = ""

    @property
    def title(self) -> str:
        """The words of the chosen one."""
        return dict(self.choices).get(self.chosen, "")


def asks_for_device(title: str, step: str, *, has_force: bool) -> PlayState:
    """Return the question before a device other than the scripted hand is used."""
    force = "The force fades in when a trial begins; hold" if has_force else "It has no force. Hold"
    words = f"Play from {step}, with the device {title}? {force} Esc to stop."
    return PlayState("warn", "device", words, (("play", "Play"), ("close", "Cancel")))


def refuses(problems: tuple[str, ...], most: int = 6) -> PlayState:
    """Return why the study cannot be played from here."""
    more = (f"and {len(problems) - most} more",) if len(problems) > most else ()
    words = "The study cannot be played from here: correct these problems first"
    return PlayState("bad", "warning", words, (("problems", "Show problems"), ("close", "Close")),
                     (*problems[:most], *more))  # fmt: skip


def under_way(step: str, title: str) -> PlayState:
    """Return what is said while a pilot is played."""
    words = f"Playing from {step}, with the device {title}. Hold Esc to stop."
    return PlayState("ok", "play", words, (("stop", "Stop"),))


def ended(step: str, how: str) -> PlayState:
    """Return the question after a pilot was played: whether its data are kept."""
    return PlayState("neutral", "flag", f"Played from {step}: {how}. Its data are deleted unless you keep them.", KEEP)


def kept(folder: str) -> PlayState:
    """Return where a pilot was kept."""
    return PlayState("ok", "check", f"Kept as a pilot in {folder}.", (("close", "Close"),))
