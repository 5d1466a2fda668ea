"""The stable Python interface: load studies, compute forces, simulate, fit, read results, run sessions, drive a device.

Only this module is covered by semantic versioning; docs/api.md has examples. Importing it is quick: what a function
needs is imported when it is called. A wrong value is a `StudyError` that says what to do.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial, wraps
from importlib import import_module
from inspect import signature
from operator import index
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, ParamSpec, TypeVar

from study_app.errors import AnalysisError, StudyError

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import ArrayLike

    from study_app.devices.rig import Rig
    from study_app.haptics.model.scene import Scene
    from study_app.protocol.model import Protocol
    from study_app.protocol.simulated import TrialFeatures
    from study_app.session.pages import Page
    from study_app.session.simulated.rehearsal import Answer, Question
    from study_app.store.sessions import SessionStore

__all__ = [
    "ForceLoop",
    "Question",
    "Session",
    "StudyError",
    "TrialFeatures",
    "fit",
    "load",
    "open_force",
    "open_session",
    "read",
    "rehearse",
    "report",
    "simulate_force",
    "simulate_study",
    "unblind",
]
_ELSEWHERE: Final = {
    "Question": "study_app.session.simulated.rehearsal",
    "TrialFeatures": "study_app.protocol.simulated",
}


P = ParamSpec("P")
R = TypeVar("R")


class _Permitted(NamedTuple):
    """The permitted values of an argument: a phrase, and the function that returns it or raises an error."""

    phrase: str
    convert: Callable[[Any], Any]


def _check_arguments(**permitted: _Permitted) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Let a function raise a StudyError before it does anything if an argument is not ``permitted``."""

    def decorated(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def call(*values: P.args, **named: P.kwargs) -> R:
            given = signature(function).bind(*values, **named)
            for name in given.arguments.keys() & permitted.keys():
                value = given.arguments[name]
                try:
                    given.arguments[name] = permitted[name].convert(value)
                except (TypeError, ValueError, OverflowError) as error:
                    text = " ".join(repr(value).split())
                    shown = text if len(text) <= 60 else f"{text[:59]}…"
                    raise StudyError(f"{name} = {shown} is not possible: specify {permitted[name].phrase}") from error
            return function(*given.args, **given.kwargs)

        return call

    return decorated


def _instance(kinds: type | tuple[type, ...], value: Any) -> Any:
    if not isinstance(value, kinds):
        raise TypeError
    return value


def _path(value: Any) -> Any:
    if not isinstance(value, str | Path) or not str(value) or "\0" in str(value):
        raise TypeError
    return value


def _whole(least: int, most: int) -> _Permitted:
    def convert(value: Any) -> int:
        if isinstance(value, bool) or not least <= (number := index(value)) <= most:
            raise ValueError
        return number

    return _Permitted(f"a whole number from {least} to {most}", convert)


def _number(value: Any) -> float:
    if isinstance(value, bool | str) or getattr(value, "shape", ()) != ():
        raise TypeError
    return float(value)


def _callable(value: Any) -> Any:
    if not callable(value):
        raise TypeError
    return value


def _or_none(permitted: _Permitted) -> _Permitted:
    phrase, convert = permitted
    return _Permitted(f"{phrase}, or None", lambda value: None if value is None else convert(value))


def _two_numbers(value: Any) -> tuple[float, float]:
    low, high = map(_number, value)
    return low, high


_PATH: Final = _Permitted("a path, or a name", _path)
_TEXT: Final = _Permitted("a text", partial(_instance, str))
_FUNCTION: Final = _or_none(_Permitted("a function", _callable))
_PEOPLE: Final = _whole(1, 100_000)
_SEED: Final = _whole(0, 2**63 - 1)
_NUMBER: Final = _Permitted("a number", _number)
_OPTIONS: Final = _or_none(_Permitted("options by name", partial(_instance, Mapping)))


def __getattr__(name: str) -> Any:
    """Return a class of another module, which is imported on first access."""
    if name not in _ELSEWHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_ELSEWHERE[name]), name)


@_check_arguments(study=_PATH)
def load(study: str | Path) -> Protocol:
    """Return a study, checked.

    Parameters
    ----------
    study : str or Path
        Its file, or the name of a shipped study or of one in the workspace.

    Raises
    ------
    ProtocolError
        Lists every problem of the file with its line.
    """
    from study_app.protocol import load as loading

    return loading.load(study)


@_check_arguments(
    scene=_PATH,
    liquid=_TEXT,
    motion=_Permitted("a path, or times and positions", partial(_instance, (str, Path, tuple))),
)
def simulate_force(
    scene: str | Path, liquid: str, motion: str | Path | tuple[ArrayLike, ArrayLike], /, **parameters: object
) -> np.recarray[Any, Any]:
    """Compute the force along a motion with the servo's own tick, without a device.

    Parameters
    ----------
    scene : str or Path
        File or name of a study, or of a file of liquids.
    liquid : str
        The liquid's id there.
    motion : str, Path or tuple
        A programmed path (``"circle"``, ``"line"``, ``"stop"`` …), a CSV file, or times (n,) [s] and positions (n, 3)
        [m, scene], one row per tick.
    **parameters
        Values that override the file's, such as ``viscosity_pa_s=2.0``.

    Returns
    -------
    recarray (n,)
        Columns ``t_s``, ``x_m`` …, ``vx_mps`` …, ``fx_n`` … (sum of the effects), ``device_fx_n`` … (after the safety
        layer), ``limiters``.
    """
    import numpy as np

    from study_app.haptics.model import motion as motions
    from study_app.haptics.model.overrides import override_all
    from study_app.haptics.runtime import offline
    from study_app.protocol.load import load_scene

    chosen = override_all(load_scene(scene, liquid), parameters)
    if isinstance(motion, tuple):
        try:
            t_s, position_m = (np.asarray(values, np.float64) for values in motion)
        except (TypeError, ValueError) as error:
            raise StudyError(
                f"the motion is invalid ({error}): specify times of shape (n,) and positions of shape (n, 3)"
            ) from error
        return offline.simulate(chosen, motions.Motion(t_s, position_m))
    if str(motion) in motions.NAMES or not (Path(motion).suffix or Path(motion).exists()):
        return offline.simulate(chosen, motions.programmed_motion(str(motion), rate_hz=chosen.rate_hz))
    return offline.simulate(chosen, motions.read_motion(Path(motion)))


@_check_arguments(study=_PATH, people=_PEOPLE, seed=_SEED, progress=_FUNCTION)
def simulate_study(
    study: str | Path, people: int, *, seed: int, progress: Callable[[str], object] | None = None
) -> dict[str, pd.DataFrame]:
    """Answer a study with simulated participants; return its tables, unblinded, like `read`.

    Four sessions are first rehearsed with the servo to obtain the features of each condition; ``progress`` is called
    with a line from time to time.
    """
    from study_app.session.simulated.answers_only import rehearse_answers

    with TemporaryDirectory(prefix="liquid-study-") as folder:
        results = Path(folder) / "results"
        rehearse_answers(study, participants=people, seed=seed, results=results, progress=progress)
        unblind(results, by="simulate_study", reason="simulated")
        return read(results)


@_check_arguments(levels=_Permitted("two numbers", _two_numbers), design=_TEXT, spacing=_TEXT)
def fit(
    trials: pd.DataFrame,
    *,
    levels: tuple[float, float],
    design: str = "2ifc",
    spacing: Literal["log", "linear"] = "log",
    distances: bool = True,
) -> pd.DataFrame:
    """Fit thresholds as the report does: posterior medians with 95 % intervals.

    Parameters
    ----------
    trials : DataFrame
        Columns ``level`` and ``success`` (bool) in trial order; optionally ``participant``, ``session``,
        ``standard`` and ``arrangement`` (``"CS"``: the comparison came first).
    levels : tuple of float
        The smallest and the largest possible level.
    design : str
        Kind of design, such as ``"2ifc"`` or ``"yesno"``, which determines the guess rate.
    spacing : str
        Whether levels are evenly spaced logarithmically or linearly.
    distances : bool
        Whether a level is the distance from a standard, so that 0 is chance.

    Returns
    -------
    DataFrame
        One row of the group (``participant`` is missing) and one of each participant, per standard: ``threshold``,
        ``low``, ``high``, ``n``, ``width``, ``lapse``, ``fit_p``, ``change`` …

    Raises
    ------
    AnalysisError
        A column is missing or has invalid values, the design has no threshold, or the levels are invalid.

    Notes
    -----
    The threshold is the level half-way between guessing and 1 − lapses. Trials of results are the rows of
    ``read(...)["tracks"]`` that are ``analysed``, with ``level_delivered`` and ``right`` renamed to ``level`` and
    ``success``; `read` has their ``thresholds``, too.
    """
    from dataclasses import asdict

    import pandas as pd
    from pydantic import ValidationError

    from study_app.analysis.levels.thresholds import thresholds_of
    from study_app.protocol.trials import DESIGN_KINDS, Stimulus, default_design

    if not isinstance(trials, pd.DataFrame):
        raise AnalysisError(f"trials are a {type(trials).__name__}: specify a DataFrame")
    if missing := {"level", "success"} - set(trials.columns):
        raise AnalysisError(
            f"trials do not contain {' and '.join(sorted(missing))}: specify level and success in each row"
        )
    kinds = [name for name, kind in DESIGN_KINDS.items() if kind.adaptive]
    if design not in kinds:
        raise AnalysisError(f"no threshold can be fitted for design {design!r}: specify one of {', '.join(kinds)}")
    given = trials["level"]
    if not (pd.api.types.is_numeric_dtype(given) and given.between(0.0, float("inf"), inclusive="left").all()):
        raise AnalysisError("column level contains an invalid level: specify finite, non-negative numbers")
    if trials.empty or not trials["success"].isin([True, False]).all():
        raise AnalysisError("column success must contain true or false in every row, and at least one row is needed")
    kind = "difference" if distances else "value"
    try:
        stimulus = Stimulus(vary="level", level=kind, levels=levels, spacing=spacing)
    except ValidationError as error:
        raise AnalysisError(f"levels {levels} with spacing {spacing!r}: {error.errors()[0]['msg']}") from error
    return pd.DataFrame([asdict(estimate) for estimate in thresholds_of(trials, stimulus, default_design(design))])


@_check_arguments(results=_PATH)
def read(results: str | Path) -> dict[str, pd.DataFrame]:
    """Return the tables of a study folder by name, as written by ``export``: responses, trials and others.

    Sealed columns are omitted until the study is unblinded. docs/data-dictionary.md declares every column.
    """
    from study_app.analysis.data import load_study
    from study_app.analysis.export import exported_tables

    return {table.name: table.frame for table in exported_tables(load_study(Path(results)))}


@_check_arguments(results=_PATH, by=_TEXT, reason=_TEXT)
def unblind(results: str | Path, *, by: str, reason: str) -> None:
    """Open the sealed key of a study folder, so that `read` and `report` name conditions; record name and reason.

    Raises
    ------
    StudyError
        The key cannot be opened; or it was opened, but the named files could not be written, so repeat the call.
    """
    from study_app.store.unblinding import unblind_folder

    if left := [line for site in unblind_folder(Path(results), by=by, reason=reason).values() for line in site.left]:
        raise StudyError("the key was opened, but not everything was written: " + "; ".join(left))


@_check_arguments(results=_PATH, to=_PATH)
def report(results: str | Path, to: str | Path) -> Path:
    """Write the report of a study folder into the folder ``to``; return the path of ``report.html``."""
    from study_app.analysis.report import report as write

    return write(Path(results), Path(to))[0]


@_check_arguments(study=_PATH, people=_PEOPLE, seed=_SEED, results=_or_none(_PATH))
def rehearse(
    study: str | Path, people: int, *, seed: int, results: str | Path | None = None, recordings: bool = True
) -> Path:
    """Run whole sessions with simulated participants on a simulated device; return the study folder.

    ``results`` is a new or existing study folder; by default a new one of the workspace.
    """
    from study_app.session.simulated import rehearsal

    folder = None if results is None else Path(results)
    return rehearsal.rehearse(study, participants=people, seed=seed, results=folder, recordings=recordings)


@dataclass(frozen=True, slots=True)
class Session:
    """A session that runs while it is iterated over: each page is yielded before it is answered.

    Attributes
    ----------
    folder : Path
        The folder in which it is stored.
    """

    folder: Path
    _pages: Iterator[Page]
    _store: SessionStore

    def __iter__(self) -> Iterator[Page]:
        return self._pages

    def run(self) -> None:
        """Continue to the last page."""
        for _ in self._pages:
            pass

    @property
    def fingerprint(self) -> str:
        """The session's fingerprint once it has ended; empty before."""
        return self._store.fingerprint


@_check_arguments(
    study=_PATH,
    participant=_TEXT,
    results=_PATH,
    seed=_SEED,
    session=_whole(1, 99),
    device=_TEXT,
    answer=_FUNCTION,
    group=_or_none(_TEXT),
    row_of=_or_none(_TEXT),
)
@contextmanager
def open_session(
    study: str | Path,
    participant: str,
    *,
    results: str | Path,
    seed: int,
    session: int = 1,
    device: str = "scripted",
    answer: Answer | None = None,
    recordings: bool = True,
    group: str | None = None,
    row_of: str | None = None,
) -> Iterator[Session]:
    """Open a session without windows, in simulated time; an unfinished one is resumed.

    It is stored like a session with windows, marked as simulated. However the block ends, the force ends at zero, and
    every answer given is on the disk. A resumed session keeps its seed, device and recordings.

    Parameters
    ----------
    study : str or Path
        File or name of the study.
    participant : str
        The participant's id.
    results : str or Path
        The study folder.
    seed : int
        Seed of all randomness of a new session.
    session : int
        The number of the participant's session.
    device : str
        A device that moves by itself.
    answer : callable, optional
        An observer: called with a `Question`, it returns the answer, answers by item id, or None for those of the
        built-in simulated participant. In an adjustment it is called twice a second with the task, and returns the
        number of steps by which the level changes, positive towards more, or 0 to confirm it.
    recordings : bool
        Whether every tick of the servo is stored.
    group : str, optional
        The pre-existing group of a new participant; a resumed or later session keeps the recorded one.
    row_of : str, optional
        The id of the participant whom a new participant replaces.

    Raises
    ------
    StudyError
        The study, the id, the group or the folder cannot be used, the session was completed or belongs to a real
        participant, or an answer is not permitted.
    """
    from study_app.protocol.load import load, parse, source_bytes
    from study_app.session.simulated import rehearsal
    from study_app.store.blinded import check_choice, claims
    from study_app.store.files import StudyFolder

    folder = StudyFolder(Path(results)).session(participant, session)
    if folder.journal.exists():
        check_choice(load(study), claims(StudyFolder(Path(results))), participant, group=group, row_of=row_of)
        opening = rehearsal.reopen_session(folder.path, protocol=study, answer=answer)
    else:
        source = source_bytes(study)
        opening = rehearsal.open_session(
            parse(source, str(study)),
            source,
            participant,
            results=Path(results),
            seed=seed,
            session=session,
            device=device,
            recordings=recordings,
            group=group,
            row_of=row_of,
            answer=answer,
        )
    with opening as (rehearsed, store):
        yield Session(folder.path, rehearsed.pages(), store)


class ForceLoop:
    """A device whose force is computed from a liquid at 1 kHz in a separate thread, for another program's loop.

    After its block every call raises `StudyError`.
    """

    def __init__(self, rig: Rig, scenes: Mapping[str, Scene]) -> None:
        self._rig: Rig | None = rig
        self._scenes = scenes
        self._reader = rig.servo.telemetry.reader()

    @property
    def _opened(self) -> Rig:
        if self._rig is None:
            raise StudyError("the force loop has ended: open it again")
        return self._rig

    @property
    def dropped(self) -> int:
        """The number of samples lost because `read` was called too late."""
        return self._reader.dropped

    @_check_arguments(liquid=_TEXT)
    def set_liquid(self, liquid: str, **parameters: object) -> None:
        """Change the liquid, or only its parameters; the force changes within the slew limit, or fades in.

        ``parameters`` override the file's; those of an earlier call are not kept.

        Raises
        ------
        StudyError
            The liquid or a parameter is unknown, a value is out of range, or the servo has stopped.
        """
        from study_app.haptics.model.overrides import override_all

        if liquid not in self._scenes:
            raise StudyError(f"{liquid!r} is not in the file, which contains {', '.join(self._scenes)}")
        scene, servo = override_all(self._scenes[liquid], parameters), self._opened.servo
        if servo.may_adjust(scene):
            servo.adjust(scene)
        else:
            servo.load(scene)

    def follow(self, t_s: ArrayLike, position_m: ArrayLike) -> None:
        """Move the hand of a simulated device along straight lines between positions; until then it rests.

        Only differences of the increasing times (n,) [s] matter; positions (n, 3) [m, hand] outside the range of
        motion, ±0.05 m along x and ±0.03 m along y and z, are moved to its border.

        Raises
        ------
        StudyError
            A person moves the device, or the motion is invalid.
        """
        from study_app.devices.hand import hand_of

        hand = hand_of(self._opened.device)
        if hand is None:
            raise StudyError("follow works only with simulated devices, such as 'scripted'; a person moves this device")
        hand.follow(t_s, position_m)

    def read(self) -> np.recarray[Any, Any]:
        """Return the samples since the last call, oldest first: ``position_m`` [m], ``device_force_n`` [N] and more.

        Raises
        ------
        ServoFault, DeviceLost
            The servo has stopped itself; the force is zero.
        """
        self._opened.servo.check()
        samples: np.recarray[Any, Any] = self._reader.read()
        return samples

    def stop(self) -> None:
        """Send zero force from the next tick on, without a fade, until `fade_in`."""
        self._opened.servo.stop_force()

    def fade_in(self) -> None:
        """Fade the force in after `stop`."""
        self._opened.servo.fade_in()

    def _end(self) -> None:
        self._rig = None


@_check_arguments(scene=_PATH, device=_TEXT, force_limit_n=_or_none(_NUMBER), options=_OPTIONS)
@contextmanager
def open_force(
    scene: str | Path,
    *,
    device: str = "scripted",
    force_limit_n: float | None = None,
    options: Mapping[str, str | Path] | None = None,
) -> Iterator[ForceLoop]:
    """Open a device with the servo and its safety layer, at zero force until `ForceLoop.set_liquid`.

    However the block ends, the last force is zero. Open it in the main thread, where signals end the block; in another
    thread it is rejected unless the program handles SIGTERM.

    Parameters
    ----------
    scene : str or Path
        File or name of a study, or of a file of liquids.
    device : str
        Name of the device, such as ``"falcon"``; by default a simulated hand.
    force_limit_n : float, optional
        The greatest force [N], above 0 and at most that of the file.
    options : mapping, optional
        The device's options, by name.

    Raises
    ------
    StudyError
        The file or the device cannot be opened; then nothing is left open.
    """
    from study_app.devices.rig import RigSettings, open_rig
    from study_app.haptics.runtime.pack import elements_needed
    from study_app.lab.live import WORKSPACE_M
    from study_app.protocol.load import load_scenes
    from study_app.protocol.randomization import stream

    if threading.current_thread() is not threading.main_thread() and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        raise StudyError(
            "a force loop cannot be opened in a thread, because a termination request (SIGTERM) would leave the "
            "force on: open it in the main thread, or first install a SIGTERM handler there"
        )
    scenes = load_scenes(scene)
    first = next(iter(scenes.values()))
    if force_limit_n is not None and not 0 < force_limit_n <= first.force_limit_n:
        raise StudyError(
            f"force_limit_n = {force_limit_n:g} is not possible: specify more than 0 and at most "
            f"{first.force_limit_n:g} N, the limit in the file"
        )
    settings = RigSettings(
        workspace_m=WORKSPACE_M,
        force_limit_n=first.force_limit_n if force_limit_n is None else force_limit_n,
        rate_hz=first.rate_hz,
        elements=max(elements_needed(scene) for scene in scenes.values()),
        random=stream(1, "force/tremor"),
        options=options or {},
    )
    with open_rig(device, settings) as rig:
        loop = ForceLoop(rig, scenes)
        try:
            yield loop
        finally:
            loop._end()  # noqa: SLF001 - it belongs to this module
