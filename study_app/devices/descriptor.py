"""Device descriptors: what the program knows about a device outside its driver.

Importing this module loads neither the compiler nor a driver; only `DeviceDescriptor.open`, ``probe`` and ``doctor``
do.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from random import Random
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, TypeVar, get_args

from study_app.devices import NAME_PATTERN
from study_app.errors import DeviceError

if TYPE_CHECKING:
    from study_app.devices.base import Device
    from study_app.devices.doctor import Finding, Report


Kind: TypeAlias = Literal["felt", "seen", "simulated"]
""""felt": with force; "seen": visual only; "simulated": not used by participants."""

Icon: TypeAlias = Literal["device", "mouse", "fast_forward"]

READY: Final = "ready"
DRIVER_READY: Final = "driver ready"
NONE: Final = "none connected"
NOT_AVAILABLE: Final = "not available"

_Opened = TypeVar("_Opened", bound="Device")


@dataclass(frozen=True, slots=True)
class Backend:
    """One connection to a device, as found by its probe.

    ``name`` is the value for ``--device``, ``by`` the library that finds the device, and ``state`` one of the texts
    above or "connected: ...". ``can`` describes its capabilities; ``why`` tells why it cannot be used now ("" if it
    can).
    """

    name: str
    by: str
    _: KW_ONLY
    state: str
    can: str
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceOption:
    """An option for opening a device.

    ``name`` is that of the command-line option, ``title`` its label, ``help`` the line of ``--help``. ``about``,
    ``hint`` and ``placeholder`` are texts of windows. ``file_filter`` is that of a file dialog, "" if the value is not
    a file's path. Without ``in_windows`` only commands have it.
    """

    name: str
    title: str
    help: str
    about: str = ""
    hint: str = ""
    placeholder: str = ""
    file_filter: str = ""
    in_windows: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenRequest:
    """Settings for opening a device; None is the device's default.

    Attributes
    ----------
    argument : the part of its name after the colon, "" without one
    workspace_m : half extents of the required workspace [m]
    force_limit_n : the greatest force that may be commanded [N]
    random : random numbers for the tremor of a simulated device
    progress : receives instructions while it is opened, one line at a time
    cancelled : returns whether to stop opening it
    options : values of its options, by name
    """

    argument: str = ""
    workspace_m: tuple[float, float, float] | None = None
    force_limit_n: float | None = None
    random: Random | None = None
    progress: Callable[[str], object] | None = None
    cancelled: Callable[[], bool] | None = None
    options: Mapping[str, str | Path] = field(default_factory=dict)

    @property
    def limits(self) -> dict[str, Any]:
        limits = {"workspace_m": self.workspace_m, "force_limit_n": self.force_limit_n}
        return {name: value for name, value in limits.items() if value is not None}


@dataclass(frozen=True, slots=True, kw_only=True)
class Doctor:
    """Examines a device.

    ``findings()`` returns all tests as not yet run. ``examine(name, options=, faults=, progress=)`` returns
    a `Report`; ``faults`` are those of an emulated device.
    """

    findings: Callable[[], tuple[Finding, ...]]
    examine: Callable[..., Report]


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceDescriptor:
    """The properties of a device that the program uses outside its driver.

    Attributes
    ----------
    name : for ``--device``, receipts and folders: lowercase letters, digits and hyphens
    title : displayed name
    icon : name of its icon in the theme
    kind : with force, visual only, or not used by participants
    degrees_of_freedom : number of measured degrees of freedom
    open : returns the device, open
    probe : returns all connections to it, without opening it
    argument : permitted text after its name and a colon, such as "SERIAL"; "" if none
    argument_required : its name alone does not open it
    moves_by_itself : the program moves its handle by a simulated hand; rehearsals may use it
    pointer : the window's pointer moves it; it then has ``point_to`` and ``press``
    motion_shows_force : its recorded position shows the force, so that motion is hidden while a study is blinded
    stop_button : its button that stops the force, as windows name it: "device button 4"; "" without one
    options : its options when it is opened
    doctor : its diagnosis; None without one
    driver : ``module:Class`` of its `driver.FramedDevice`; "" if its driver is another one
    """

    name: str
    title: str
    icon: Icon
    kind: Kind
    degrees_of_freedom: int
    open: Callable[[OpenRequest], Device]
    probe: Callable[[], Sequence[Backend]]
    argument: str = ""
    argument_required: bool = False
    moves_by_itself: bool = False
    pointer: bool = False
    motion_shows_force: bool = True
    stop_button: str = ""
    options: tuple[DeviceOption, ...] = ()
    doctor: Doctor | None = None
    driver: str = ""

    def __post_init__(self) -> None:
        if not re.fullmatch(NAME_PATTERN, self.name):
            raise DeviceError(
                f"the device name {self.name!r} is not permitted: use lowercase letters, digits and hyphens"
            )
        for field_name, value, choices in (("icon", self.icon, get_args(Icon)), ("kind", self.kind, get_args(Kind))):
            if value not in choices:
                raise DeviceError(
                    f"device '{self.name}': unknown {field_name} {value!r}; choose one of {', '.join(choices)}"
                )

    @property
    def simulated(self) -> bool:
        return self.kind == "simulated"

    @property
    def usage(self) -> str:
        return f"{self.name}:{self.argument}" if self.argument_required else self.name

    @property
    def label(self) -> str:
        if self.moves_by_itself:
            return f"{self.title} (simulated)"
        return f"{self.title} (visual only)" if self.kind == "seen" else self.title

    @property
    def window_options(self) -> tuple[DeviceOption, ...]:
        return tuple(option for option in self.options if option.in_windows)

    def window_values(self, values: Mapping[str, str | Path]) -> dict[str, str | Path]:
        return {option.name: values[option.name] for option in self.window_options if option.name in values}


def opened(device: _Opened) -> _Opened:
    """Open a device and return it."""
    device.open()
    return device


def loaded_on_call(function: str) -> Callable[..., Any]:
    """Return a function that loads ``module:name`` when it is called."""

    def call(*values: Any, **request: Any) -> Any:
        return resolve_name(function)(*values, **request)

    return call


def _open_by_driver(driver: str, request: OpenRequest) -> Any:
    """Return the device of a ``driver.FramedDevice`` class, ``module:Class``, open."""
    return opened(resolve_name(driver).of(request))


def framed(name: str, title: str, driver: str, failures: str, **more: Any) -> DeviceDescriptor:
    """Return the descriptor of a device whose driver is a ``driver.FramedDevice``.

    Parameters
    ----------
    driver : ``module:Class`` of it
    failures : ``module:name`` of its `doctor.FailureTable`, which loads no compiler
    more : further fields of the descriptor
    """
    return DeviceDescriptor(
        name=name,
        title=title,
        degrees_of_freedom=3,
        open=partial(_open_by_driver, driver),
        motion_shows_force=False,
        driver=driver,
        doctor=Doctor(
            findings=loaded_on_call(f"{failures}.findings"), examine=loaded_on_call("study_app.devices.driver:examine")
        ),
        **more,
    )
