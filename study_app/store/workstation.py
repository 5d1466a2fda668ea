"""The settings of this computer, independent of studies: screens, display offset, device and folders.

They are stored in one JSON file in the user's folder, not in protocols, so that a study can move to another computer.
This module does not use windows: screen sizes are passed as numbers, in logical pixels and millimetres.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from study_app.devices import DEFAULT_DEVICE, NAME_PATTERN, WITHOUT_FORCE
from study_app.errors import StoreError
from study_app.outlets.session_outlets import SampleChoice
from study_app.protocol.source import faults_of
from study_app.store.files.atomic import cannot_read, cannot_write, write_file
from study_app.user_folder import FOLDER_VARIABLE, settings_file
from study_app.workspace import Workspace, setting_of, workspace

ASIDE: Final = "machine.damaged.json"
LEAST_X_HEIGHT_DEG: Final = 0.4
STATEMENT_X_HEIGHT_PX: Final = 16 * 1118 / 2048
"""x-height of Inter in a statement as designed [logical px]: font size times the font's ratio."""

DISTANCE_MM: Final = (200.0, 3000.0)
WIDTH_MM: Final = (80.0, 5000.0)
_MAX_RECENT: Final = 8
REMEMBERED_OPTIONS: Final = ("firmware",)
"""Names of device options stored as settings of this computer; others are asked for before each session."""
OFFSET_MS: Final = (0.0, 500.0)
SPREAD_MS: Final = (0.0, 200.0)
CAMERA_LENGTH: Final = 400
_TRIGGERS_PATTERN: Final = r"^([a-z]+:[^\x00-\x1f]+)?$"
_PathText = Annotated[str, Field(pattern=r"^[^\x00]+$")]
_PerAxis = Annotated[tuple[float, float, float], Field(strict=False)]
How = Literal["photodiode", "high-speed camera", "data sheet"]


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)


class DisplayOffset(_Strict):
    """The delay from painting to light on a screen [ms]: ``mean_ms`` ± ``spread_ms``.

    ``measured`` is the day, ``screen`` the name of the screen on which it was measured, the only one to which it
    applies.
    """

    mean_ms: Annotated[float, Field(ge=OFFSET_MS[0], le=OFFSET_MS[1])]
    spread_ms: Annotated[float, Field(ge=SPREAD_MS[0], le=SPREAD_MS[1])] = 0.0
    how: How = "photodiode"
    measured: str = ""
    screen: str = ""


class DeviceBench(_Strict):
    """The bench measurements of a device on the day ``measured``, for x, y and z.

    ``mass_kg``, ``damping_nspm`` and ``friction_n`` are properties of the device itself, ``stable_nspm`` is the
    greatest stable damping, ``delay_ms`` the delay of a force, ``gain`` the measured force per requested force (None
    without a scale), ``count_m`` the encoder count [m] that explains the noise of positions in motion (None if the
    device moved too little). ``name`` and ``serial`` ("" if it has none) identify the device. ``report`` is the path of
    bench.md.
    """

    name: Annotated[str, Field(pattern=rf"^{NAME_PATTERN}$")]
    serial: str = ""
    measured: str
    mass_kg: _PerAxis
    damping_nspm: _PerAxis
    friction_n: _PerAxis
    delay_ms: _PerAxis
    stable_nspm: _PerAxis
    gain: float | None = None
    count_m: Annotated[float, Field(gt=0.0)] | None = None
    report: _PathText | None = None

    @property
    def entry(self) -> dict[str, Any]:
        """The entry of the measurements in a receipt."""
        return self.model_dump(mode="json", exclude={"name", "serial", "report"})


class MachineSettings(_Strict):
    """The settings of this computer.

    ``screen`` is the name of the participant's screen, ``screen_number`` distinguishes screens of the same name, from
    1; ``viewing_distance_mm`` and ``screen_width_mm`` are None until they are measured. ``firmware`` is the file of a
    device's program, ``workspace`` the folder of protocols and results (None if not chosen, see `study_app.workspace`);
    ``recent`` are recently opened protocol files outside it, newest first; ``operator`` are the last initials;
    ``photodiode`` tells whether the tank has a corner for a photodiode; ``camera`` is the camera of video conditions
    (see `video.sources`), "" for the system's default; ``benches`` are the latest measurements of devices.
    ``lsl_markers``, ``lsl_samples`` and ``triggers`` (the address of a port, or "") are the outlets of sessions.
    ``proofs`` is the folder into which a study's proof is written after each session, ``stamps`` a time-stamp server
    (RFC 3161), ``stamp_root`` its root certificate (PEM). An unknown ``device`` is reported only when it is opened.
    """

    screen: str = ""
    screen_number: Annotated[int, Field(ge=1)] | None = None
    viewing_distance_mm: Annotated[float, Field(ge=DISTANCE_MM[0], le=DISTANCE_MM[1])] | None = None
    screen_width_mm: Annotated[float, Field(ge=WIDTH_MM[0], le=WIDTH_MM[1])] | None = None
    display_offset: DisplayOffset | None = None
    device: Annotated[str, Field(pattern=rf"^{NAME_PATTERN}(:.+)?$")] = DEFAULT_DEVICE
    firmware: _PathText | None = None
    workspace: _PathText | None = None
    recent: Annotated[tuple[_PathText, ...], Field(max_length=_MAX_RECENT, strict=False)] = ()
    theme: Annotated[Literal["light", "dark"], Field(title="Theme of the operator's windows")] = "light"
    sound: Annotated[bool, Field(title="Sound when a device needs attention")] = False
    photodiode: bool = False
    camera: Annotated[str, Field(max_length=CAMERA_LENGTH)] = ""
    operator: Annotated[str, Field(max_length=40)] = ""
    benches: Annotated[tuple[DeviceBench, ...], Field(strict=False)] = ()
    lsl_markers: bool = False
    lsl_samples: SampleChoice = "off"
    proofs: _PathText | None = None
    stamps: Annotated[str, Field(pattern=r"^(https?://\S+)?$")] = ""
    stamp_root: _PathText | None = None
    triggers: Annotated[str, Field(pattern=_TRIGGERS_PATTERN)] = ""

    @property
    def marker_addresses(self) -> tuple[str, ...]:
        """The addresses to which markers of sessions are sent."""
        return (*(("lsl",) if self.lsl_markers else ()), *((self.triggers,) if self.triggers else ()))

    @property
    def device_options(self) -> dict[str, Path]:
        """The values of the device options stored on this computer, by name."""
        values = {name: getattr(self, name) for name in REMEMBERED_OPTIONS}
        return {name: Path(value) for name, value in values.items() if value is not None}

    def with_recent(self, protocol: Path) -> MachineSettings:
        """Return the settings with this file as the most recent one, if it is outside the workspace."""
        if protocol.resolve().parent == workspace().protocols.resolve():
            return self
        name = str(protocol.absolute())
        others = (other for other in self.recent if other != name)
        return self.model_copy(update={"recent": (name, *others)[:_MAX_RECENT]})

    def with_bench(self, bench: DeviceBench) -> MachineSettings:
        """Return the settings with this measurement, replacing an earlier one of the same device."""
        others = (other for other in self.benches if (other.name, other.serial) != (bench.name, bench.serial))
        return self.model_copy(update={"benches": (bench, *others)})

    def bench_of(self, described: Mapping[str, Any]) -> DeviceBench | None:
        """Return the measurement of the device with this name and serial number, or None if it was not measured."""
        identity = described.get("name"), described.get("serial") or ""
        return next((bench for bench in self.benches if (bench.name, bench.serial) == identity), None)

    def screen_among(self, names: Sequence[str]) -> int:
        """Return the number (from 1) of the participant's screen among ``names``; the last if it is not connected."""
        alike = [number for number, name in enumerate(names, start=1) if name == self.screen]
        if not self.screen or not alike:
            return len(names)
        return self.screen_number if self.screen_number in alike else alike[0]

    def offset_on(self, screen: str) -> DisplayOffset | None:
        """Return the display offset measured on a screen, or None."""
        offset = self.display_offset
        return offset if offset is not None and offset.screen == screen else None

    def text_scale(self, width_px: float, system_mm: float) -> float:
        """Return the factor that enlarges text so that an x spans 0.4° at the viewing distance.

        ``width_px`` is the screen's width in logical pixels, ``system_mm`` the width reported by the system, which is
        used until a measured width is set. The factor is at least 1, and 1 if distance or width is unknown.
        """
        height_deg = self.x_height_deg(width_px, system_mm)
        return 1.0 if height_deg is None else max(1.0, LEAST_X_HEIGHT_DEG / height_deg)

    def x_height_deg(self, width_px: float, system_mm: float) -> float | None:
        """Return the visual angle of an x of a statement as designed [°], or None if it is unknown."""
        width_mm = self.screen_width_mm if self.screen_width_mm is not None else system_mm
        if self.viewing_distance_mm is None or width_mm <= 0 or width_px <= 0:
            return None
        height_mm = STATEMENT_X_HEIGHT_PX * width_mm / width_px
        return math.degrees(2 * math.atan(height_mm / (2 * self.viewing_distance_mm)))

    def describe(self, screen: str, width_px: float, system_mm: float) -> dict[str, Any]:
        """Return the receipt's fields on the participant's screen that the system does not report."""
        offset = self.offset_on(screen)
        return {
            "viewing_distance_mm": self.viewing_distance_mm,
            "width_mm": self.screen_width_mm if self.screen_width_mm is not None else round(system_mm, 1),
            "width_measured": self.screen_width_mm is not None,
            "photodiode_patch": self.photodiode,
            "text_scale": round(self.text_scale(width_px, system_mm), 3),
            "display_offset": None if offset is None else offset.model_dump(exclude={"screen"}),
        }


DEFAULTS: Final = MachineSettings()


def load_settings() -> MachineSettings:
    """Read the settings; without a file, return the defaults.

    Raises
    ------
    StoreError
        The file is invalid; one line names the problem.
    """
    path = settings_file()
    try:
        document = json.loads(path.read_bytes())
    except FileNotFoundError:
        return DEFAULTS
    except OSError as error:
        raise cannot_read(path, error) from error
    except (ValueError, RecursionError) as error:
        raise _unusable_file(path, f"it is not JSON ({error})") from error
    if not isinstance(document, dict):
        raise _unusable_file(path, "it does not contain a table of settings")
    document["workspace"] = setting_of(document)
    document.pop("results", None)
    try:
        return MachineSettings.model_validate(document)
    except ValidationError as error:
        raise _unusable_file(path, _first_problem(error, document)) from error


def load_or_default() -> tuple[MachineSettings, str]:
    """Return the settings, with the reason if they are the defaults because the file is invalid (else "")."""
    try:
        return load_settings(), ""
    except StoreError as error:
        return DEFAULTS, str(error)


def device_without_force() -> str:
    """Return the name of this computer's device if it renders no force; "" if it does or none was chosen."""
    settings = load_or_default()[0]
    return "" if settings is DEFAULTS else WITHOUT_FORCE.get(settings.device.partition(":")[0], "")


def save_settings(settings: MachineSettings) -> None:
    """Write the settings atomically; an invalid file is moved aside first.

    Raises
    ------
    StoreError
        They cannot be written, or a path in them is not UTF-8 text.
    """
    path = settings_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if load_or_default()[1]:
            with suppress(FileNotFoundError):
                path.replace(path.with_name(ASIDE))
    except OSError as error:
        raise cannot_write(path, error) from error
    text = json.dumps(settings.model_dump(mode="json"), indent=2, ensure_ascii=False)
    try:
        content = f"{text}\n".encode()
    except UnicodeEncodeError as error:
        name = text[: error.start].rpartition('"')[2] + text[error.start :].partition('"')[0]
        raise StoreError(f"{name!r} is not UTF-8 text, so the settings cannot store it: rename the folder") from error
    write_file(path, content)


def create_workspace(made: Workspace) -> None:
    """Create the two folders of a workspace if they are missing.

    Raises
    ------
    StoreError
        They cannot be created.
    """
    for folder in (made.protocols, made.results):
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(folder, error) from error


def keep_workspace(made: Workspace) -> None:
    """Set the workspace of this computer and create its two folders.

    Raises
    ------
    StoreError
        The folders or the settings cannot be written.
    """
    create_workspace(made)
    save_settings(load_or_default()[0].model_copy(update={"workspace": str(made.folder.absolute())}))


def remember_protocol(protocol: Path) -> None:
    """Add a protocol file to the recent ones.

    Raises
    ------
    StoreError
        The settings cannot be written.
    """
    save_settings(load_or_default()[0].with_recent(protocol))


def recent_protocols() -> tuple[str, ...]:
    """Return the recent protocol files that still exist, newest first."""
    return tuple(name for name in load_or_default()[0].recent if Path(name).is_file())


def _first_problem(error: ValidationError, document: dict[str, Any]) -> str:
    """Return one line on a problem in a settings file, preferring problems with a hint."""
    fault = min(faults_of(error, document, MachineSettings.model_json_schema()), key=lambda fault: not fault.hint)
    hint = f" ({fault.hint})" if fault.hint else ""
    return f"{'.'.join(str(step) for step in fault.path)}: {fault.message}{hint}"


def _unusable_file(path: Path, why: str) -> StoreError:
    return StoreError(
        f"this machine's settings in {path} cannot be used: {why}. Correct or delete the file, or set "
        f"{FOLDER_VARIABLE} to another folder"
    )
