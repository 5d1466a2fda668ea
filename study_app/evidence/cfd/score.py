"""A benchmark of liquid forces that any program can enter; this file needs numpy alone, and the tables beside it.

    python score.py PROGRAM [WORD ...]               a program that answers over a pipe
    python score.py --function MODULE:FUNCTION       a function of Python
    python score.py --only reversal PROGRAM          only the motions with this word in their names

An engine computes the force of a liquid on a ball, tick by tick at 1 kHz. As a function it receives the setup (a dict
of ``density_kg_m3``, ``viscosity_pa_s``, ``diameter_m``, ``handle_kg``, ``delay_ticks``) and returns a function of time
[s], position [m] and velocity [m/s] along a line, which returns the force [N]. That function may have an attribute
``along``: the same for arrays (n,) from the first tick on, which is then used where the motion is known. A program
reads lines: ``{"density_kg_m3": ...}`` begins a new ball, to which it answers ``ready``; ``0.001 1e-7 0.0002`` is a
tick, to which it answers the force. Its input ends after the last tick.

Measured: the error against a fluid solver along given motions (RMS over RMS of the force; greatest over greatest), the
time of a tick, and what becomes of a handle that the hand moved through the liquid and let go, with forces that come
late: how much energy the liquid gives it, and up to which delay it neither gets more energy than the hand had put into
the liquid nor goes on ringing.
"""

import argparse
import hashlib
import importlib
import itertools
import json
import math
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Step: TypeAlias = Callable[[float, float, float], float]
_Engine: TypeAlias = Callable[[Mapping[str, float]], Step]

_RATE_HZ: Final = 1000.0
_FOLDERS: Final = {"": True, "training": True, "held_out": False}
"""The folders of the tables, and whether the constants of unsteady drag, this project's law, are fitted to them."""
LIQUIDS: Final = ("honey", "glycerin", "gear_oil")
"""The liquids in which handles are released."""
HANDLES_KG: Final = (0.05, 0.2)
_STROKE_M: Final = 0.03
_STROKE_HZ: Final = 2.0
_PHASES: Final = (0.5, 0.625, 0.75)
"""Times of the release, in periods of the stroke: at its far end, on the way back, and in the middle."""
_FREE_S: Final = 0.6
DELAYS: Final = (0, 1, 2, 4, 8, 16, 32)
"""Tested delays of the force [ticks]; with 0, a force acts from the reading that it answers to the next one."""
_SETTLES_S: Final = 0.2
"""Time after which a handle must not ring: change direction more than `_RINGS` times by `_RINGS_MPS` [s]."""
_RINGS: Final = 3
_RINGS_MPS: Final = 0.01
_ALLOWANCE_J: Final = 1e-4
ANSWER_S: Final = 10.0
SUMS: Final = "SHA256SUMS"


class _EngineError(Exception):
    """The engine's answer is missing or invalid."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """One solved motion at `_RATE_HZ`: position, velocity and the solver's force, each (n,).

    ``fitted`` tells whether this project's law of unsteady drag was fitted to it.
    """

    name: str
    fitted: bool
    notes: Mapping[str, str]
    t_s: Floats
    position_m: Floats
    velocity_mps: Floats
    force_n: Floats

    @property
    def setup(self) -> dict[str, float]:
        """The properties of the liquid and the ball that an engine receives."""
        return {name: float(self.notes[name]) for name in ("density_kg_m3", "viscosity_pa_s", "diameter_m")}


@dataclass(frozen=True, kw_only=True)
class Score:
    """The RMS and the greatest error along one motion, relative to the force, and the time per tick [ns]."""

    motion: Motion
    rms: float
    greatest: float
    tick_ns: float


@dataclass(frozen=True)
class Releases:
    """The energy gained and the delay tolerated by a handle that is released in one liquid.

    The energy is the greatest at a delay of one tick [J]; the delay [ticks] is -1 if not even 0 is tolerated.
    """

    liquid: str
    given_j: float
    delay: int


def motions(folder: Path | None = None, only: str = "") -> tuple[Motion, ...]:
    """Return the motions whose names contain ``only``, after verifying the checksum of each file."""
    folder = folder or Path(__file__).resolve().parent
    lines = (folder / SUMS).read_text("utf-8").splitlines()
    sums = {line[66:]: line[:64] for line in lines if not line.startswith("#")}
    records = []
    for subfolder, fitted in _FOLDERS.items():
        for path in sorted(it for it in (folder / subfolder).glob("*mmps.csv") if only in it.stem):
            content = path.read_bytes()
            if hashlib.sha256(content).hexdigest() != sums.get(path.relative_to(folder).as_posix()):
                raise _EngineError(f"{path} is not the published table: its checksum is not in {SUMS}")
            records.append(_parse_motion(path.stem, content.decode("utf-8"), fitted=fitted))
    if not records:
        raise _EngineError(f"{folder} does not contain a motion with '{only}' in its name")
    return tuple(records)


def _parse_motion(name: str, text: str, *, fitted: bool) -> Motion:
    lines = text.splitlines()
    notes = dict(line[2:].split(": ", 1) for line in lines if line.startswith("#"))
    rows = [line for line in lines if not line.startswith("#")][1:]
    t_s, velocity_mps, force_n = np.array([[float(cell) for cell in row.split(",")] for row in rows]).T
    times_s = np.arange(math.floor(t_s[-1] * _RATE_HZ) + 1) / _RATE_HZ
    speeds_mps = np.interp(times_s, t_s, velocity_mps)
    position_m = np.concatenate([[0.0], np.cumsum((speeds_mps[1:] + speeds_mps[:-1]) / (2 * _RATE_HZ))])
    return Motion(
        name=name,
        fitted=fitted,
        notes=notes,
        t_s=times_s,
        position_m=position_m,
        velocity_mps=speeds_mps,
        force_n=np.interp(times_s, t_s, force_n),
    )


def score(engine: _Engine, motion: Motion) -> Score:
    """Run an engine along a motion and compare its forces with the solver's."""
    step = engine({**motion.setup, "handle_kg": math.inf, "delay_ticks": 0})
    ticks = (motion.t_s, motion.position_m, motion.velocity_mps)
    if (along := getattr(step, "along", None)) is not None:
        began_ns = time.perf_counter_ns()
        force_n = np.asarray(along(*ticks), float)
        tick_ns = (time.perf_counter_ns() - began_ns) / len(force_n)
    else:
        force_n, times_ns = np.empty(len(motion.t_s)), np.empty(len(motion.t_s))
        for k, tick in enumerate(zip(*(column.tolist() for column in ticks), strict=True)):
            began_ns = time.perf_counter_ns()
            force_n[k] = step(*tick)
            times_ns[k] = time.perf_counter_ns() - began_ns
        tick_ns = float(np.median(times_ns))
    if force_n.shape != motion.force_n.shape or not np.isfinite(force_n).all():
        raise _EngineError(f"{motion.name}: a force is missing or is not a finite number")
    error_n = force_n - motion.force_n
    rms = float(np.linalg.norm(error_n) / np.linalg.norm(motion.force_n))
    return Score(
        motion=motion, rms=rms, greatest=float(np.abs(error_n).max() / np.abs(motion.force_n).max()), tick_ns=tick_ns
    )


def release(
    engine: _Engine, setup: Mapping[str, float], handle_kg: float, phase: float, delay: int
) -> tuple[float, bool]:
    """Move a handle through a liquid, release it, and follow its motion.

    Parameters
    ----------
    setup : mapping
        Liquid and ball.
    handle_kg : float
        Mass of the handle.
    phase : float
        Time of the release, in periods of the stroke.
    delay : int
        Delay of each force [ticks].

    Returns
    -------
    given_j : float
        Greatest kinetic energy after the release beyond that at the release [J]; infinite if a force is not finite.
    fails : bool
        Whether that exceeds the hand's work on the liquid, or the handle keeps oscillating.
    """
    step = engine({**setup, "handle_kg": handle_kg, "delay_ticks": delay})
    angular_per_s = 2 * math.pi * _STROKE_HZ
    period_s, release_tick = 1 / _RATE_HZ, round((1 + phase) / _STROKE_HZ * _RATE_HZ)
    delayed_n = deque([0.0] * delay)
    x_m = v_mps = put_in_j = given_j = 0.0
    start_j, turns, heading = math.inf, 0, 0.0
    for k in range(release_tick + round(_FREE_S * _RATE_HZ)):
        delayed_n.append(float(step(k * period_s, x_m, v_mps)))
        acting_n = delayed_n.popleft()
        if k < release_tick:
            # from rest at one end of the stroke to the other, and back
            next_m = _STROKE_M * (1 - math.cos(angular_per_s * (k + 1) * period_s))
            put_in_j -= acting_n * (next_m - x_m)
            x_m, v_mps = next_m, _STROKE_M * angular_per_s * math.sin(angular_per_s * (k + 1) * period_s)
            start_j, heading = 0.5 * handle_kg * v_mps**2, math.copysign(1.0, v_mps)
            continue
        v_mps += acting_n / handle_kg * period_s
        x_m += v_mps * period_s
        if not (abs(v_mps) < 100.0 and math.isfinite(put_in_j)):
            return math.inf, True
        given_j = max(given_j, 0.5 * handle_kg * v_mps**2 - start_j)
        if v_mps * heading < -_RINGS_MPS:
            turns, heading = turns + (k > release_tick + _SETTLES_S * _RATE_HZ), -heading
    return given_j, given_j > max(put_in_j, 0.0) + _ALLOWANCE_J or turns > _RINGS


def releases(engine: _Engine, motion: Motion, delays: Sequence[int] = DELAYS) -> Releases:
    """Release handles in the liquid of a motion with increasing delay until one is unstable."""
    given_j, tolerated = 0.0, -1
    for delay in delays:
        cases = itertools.product(HANDLES_KG, _PHASES)
        measured = [release(engine, motion.setup, handle_kg, phase, delay) for handle_kg, phase in cases]
        if delay <= 1:
            given_j = max(given_j, *(case_j for case_j, _ in measured))
        if any(fails for _, fails in measured):
            break
        tolerated = delay
    return Releases(motion.notes["liquid"], given_j, tolerated)


def measure(
    engine: _Engine,
    over: Sequence[Motion],
    delays: Sequence[int] = DELAYS,
    progress: Callable[[str], object] = lambda _line: None,
) -> tuple[list[Score], list[Releases]]:
    """Return an engine's score along each motion, and its releases in each of their liquids."""
    scores = []
    for motion in over:
        progress(motion.name)
        scores.append(score(engine, motion))
    return scores, all_releases(engine, over, delays, progress)


def all_releases(
    engine: _Engine,
    over: Sequence[Motion],
    delays: Sequence[int] = DELAYS,
    progress: Callable[[str], object] = lambda _line: None,
) -> list[Releases]:
    """Return an engine's releases in each liquid of the motions."""
    first = {motion.notes["liquid"]: motion for motion in reversed(over)}
    all_results = []
    for name in LIQUIDS:
        if name in first:
            progress(f"released handles in {name}")
            all_results.append(releases(engine, first[name], delays))
    return all_results


HEADINGS: Final = (
    "engine", "RMS error, fitted", "not fitted", "largest error, not fitted", "time per tick",
    "energy given", *(f"delay borne, {name.replace('_', ' ')}" for name in LIQUIDS),
)  # fmt: skip


def row(name: str, scores: Sequence[Score], let: Sequence[Releases], against: Sequence[Score] = ()) -> list[str]:
    """Return an engine's cells for `HEADINGS`: medians of errors and time over motions, and the worst release.

    With ``against``, another engine's scores along the same motions in turn, the time is given relative to it.
    """
    fitted = [it.rms for it in scores if it.motion.fitted]
    others = [it for it in scores if not it.motion.fitted]
    tick_ns = float(np.median([it.tick_ns for it in scores]))
    times = float(np.median([it.tick_ns / other.tick_ns for it, other in zip(scores, against, strict=False)] or [1.0]))
    borne = {it.liquid: f"{it.delay / _RATE_HZ * 1e3:g} ms" if it.delay >= 0 else "none" for it in let}
    given_j = max((it.given_j for it in let), default=math.nan)
    return [
        name,
        *(f"{np.median(of):.1%}" if of else "" for of in (fitted, [it.rms for it in others])),
        f"{max(it.greatest for it in others):.1%}" if others else "",
        f"× {times:.2f}" if against else f"{tick_ns:.0f} ns" if tick_ns < 1e4 else f"{tick_ns / 1e3:.0f} µs",
        "" if math.isnan(given_j) else f"{1e3 * given_j:.2g} mJ" if given_j < 1 else f"{given_j:.2g} J",
        *(borne.get(name, "") for name in LIQUIDS),
    ]


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return the rows as a Markdown table."""
    marks = ["---", *["--:"] * (len(headings) - 1)]
    return "".join(f"| {' | '.join(line)} |\n" for line in (headings, marks, *rows))


class _Program:
    """An external program as an engine; it answers each line with one line."""

    def __init__(self, words: Sequence[str]) -> None:
        self._name = words[0]
        try:
            self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)  # noqa: S603
        except OSError as error:
            raise _EngineError(f"{words[0]} cannot be started: {error.strerror}") from error
        self._asked_s, self._late = math.inf, False
        threading.Thread(target=self._kill_if_silent, daemon=True).start()

    def __call__(self, setup: Mapping[str, float]) -> Step:
        finite_setup = {name: value if math.isfinite(value) else None for name, value in setup.items()}
        if (answer := self._answer(json.dumps(finite_setup))) != "ready":
            raise _EngineError(f"{self._name} answered '{answer}' to a new ball, not 'ready'")
        return self._tick

    def _tick(self, t_s: float, x_m: float, v_mps: float) -> float:
        answer = self._answer(f"{t_s!r} {x_m!r} {v_mps!r}")
        try:
            return float(answer)
        except ValueError:
            raise _EngineError(f"{self._name} answered '{answer}' to a tick, not a number") from None

    def _answer(self, line: str) -> str:
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None  # noqa: S101 - both are pipes
        assert stdout is not None  # noqa: S101
        self._asked_s = time.perf_counter()
        try:
            stdin.write(line + "\n")
            answer = stdout.readline()
        except OSError:
            answer = ""
        if not answer:
            code = self._process.wait()  # a program that only closed its output is ended, too
            reason = f"did not answer within {ANSWER_S:g} s" if self._late else f"ended with code {code}"
            raise _EngineError(f"{self._name} {reason}")
        self._asked_s = math.inf
        return answer.strip()

    def _kill_if_silent(self) -> None:
        """Kill the program if it does not answer in time; runs in its own thread."""
        while self._process.poll() is None:
            time.sleep(0.2)
            if time.perf_counter() - self._asked_s > ANSWER_S:
                self._late = True
                self._process.kill()

    def close(self) -> None:
        """Close the program's input, and terminate it if it does not exit."""
        assert self._process.stdin is not None  # noqa: S101
        assert self._process.stdout is not None  # noqa: S101
        try:
            self._process.stdin.close()
            self._process.wait(2.0)
        except (OSError, subprocess.TimeoutExpired):
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()


@contextmanager
def _open_engine(words: Sequence[str], function: str) -> Iterator[_Engine]:
    """Yield a program, or a function named ``module:function``, as an engine."""
    if not function:
        program = _Program(words)
        try:
            yield program
        finally:
            program.close()
        return
    module, _, name = function.partition(":")
    sys.path.insert(0, "")
    try:
        engine: Any = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise _EngineError(f"--function {function}: {error}; write MODULE:FUNCTION") from error
    yield engine


def main(words: Sequence[str] | None = None) -> int:
    """Score an engine and print both tables; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--function", default="", metavar="MODULE:FUNCTION")
    parser.add_argument("--only", default="", metavar="WORD", help="only motions with this word in their names")
    parser.add_argument("program", nargs=argparse.REMAINDER)
    arguments = parser.parse_args(words)
    if bool(arguments.program) == bool(arguments.function):
        parser.error("specify either a program or --function MODULE:FUNCTION")
    try:
        with _open_engine(arguments.program, arguments.function) as engine:
            solved_motions = motions(only=arguments.only)
            scores, handle_releases = measure(
                engine,
                solved_motions,
                DELAYS,
                lambda line: print(line, "...", file=sys.stderr),  # noqa: T201
            )
    except _EngineError as error:
        print(f"score: {error}", file=sys.stderr)  # noqa: T201
        return 2
    name = arguments.function or Path(arguments.program[0]).name
    cells = [
        [
            it.motion.name,
            it.motion.notes["reynolds"],
            "yes" if it.motion.fitted else "no",
            f"{it.rms:.1%}",
            f"{it.greatest:.1%}",
        ]
        for it in sorted(scores, key=lambda score_: float(score_.motion.notes["reynolds"]))
    ]
    print(table(("motion", "Re", "fitted", "RMS error", "greatest error"), cells))  # noqa: T201
    print(table(HEADINGS, [row(name, scores, handle_releases)]), end="")  # noqa: T201
    return 0


if __name__ == "__main__":
    sys.exit(main())
