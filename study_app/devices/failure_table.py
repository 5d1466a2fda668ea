"""Failure modes of a device, as data: tested state, symptom, cause and cure. Loads no compiler."""

from collections.abc import Iterable
from dataclasses import dataclass

from study_app.devices.doctor_report import Finding, State
from study_app.errors import DeviceError, DeviceNotFound


@dataclass(frozen=True, slots=True)
class FailureMode:
    """A failure mode: the state without it, its symptom for the user, cause, cure, and how it is detected."""

    id: str
    tested: str
    symptom: str
    cause: str
    cure: str
    known_by: str


class DeviceFailure(DeviceError):
    """A device cannot be used; ``mode`` is the id of its `FailureMode`."""

    def __init__(self, mode: str, message: str) -> None:
        self.mode = mode
        super().__init__(message)


class DeviceFailureNotFound(DeviceFailure, DeviceNotFound):
    """There is no device, or no software that could find it."""


@dataclass(frozen=True, slots=True)
class FailureTable:
    """The modes of failure of ``device``, in the order in which they are tested; ``not_found``: it is not there."""

    device: str
    modes: tuple[FailureMode, ...]
    not_found: frozenset[str]

    def mode(self, mode: str) -> FailureMode:
        """Return the mode with this id."""
        return next(one for one in self.modes if one.id == mode)

    def before(self, mode: str) -> set[str]:
        """Return the ids of the modes that are tested before this one."""
        ids = [one.id for one in self.modes]
        return set(ids[: ids.index(mode)])

    def sentence(self, mode: str, seen: str = "") -> str:
        """Return symptom, what was ``seen``, cause and cure of a mode in a line."""
        known = self.mode(mode)
        detail = f" ({seen})" if seen else ""
        return f"{known.symptom}{detail}: {known.cause}; {known.cure}"

    def failure(self, mode: str, seen: str = "") -> DeviceFailure:
        """Return the error to raise for a mode."""
        kind = DeviceFailureNotFound if mode in self.not_found else DeviceFailure
        return kind(mode, f"{self.device} cannot be used: {self.sentence(mode, seen)}")

    def findings(self, found: str | None = None, passed: Iterable[str] = ()) -> tuple[Finding, ...]:
        """Return every mode in its order.

        Parameters
        ----------
        found : id of the mode that was found, None if none was passed : ids of those that were tested and not found;
        others count as not checked
        """
        fine = set(passed)

        def state(mode: FailureMode) -> State:
            return "found" if mode.id == found else "ok" if mode.id in fine else "not checked"

        return tuple(
            Finding(number, mode.id, mode.tested, mode.symptom, state(mode), mode.cause, mode.cure, mode.known_by)
            for number, mode in enumerate(self.modes, start=1)
        )
