"""A device together with its servo, and the names of devices: passed values, order of calls, and messages."""

from dataclasses import replace
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.devices import registry, rig
from study_app.devices.descriptor import DeviceOption, OpenRequest
from study_app.devices.registry import all_devices, check_options, descriptor_of, list_devices, title_of
from study_app.devices.rig import Rig, RigSettings, open_rig, study_settings
from study_app.errors import DeviceError, DeviceNotFound
from study_app.protocol.load import load
from tests.compiled import needs_servo

DRAWN = Random(5)  # noqa: S311 - handed on, not drawn from
SETTINGS = RigSettings(
    workspace_m=(0.1, 0.06, 0.04), force_limit_n=3.5, rate_hz=2000.0, elements=70, random=DRAWN, options={"port": "7"}
)


class Kept:
    """An object that records the order of its method calls; one of them may fail."""

    def __init__(self, name: str, calls: list[str], fails: str = "") -> None:
        self._name, self._calls, self._fails = name, calls, fails

    def __getattr__(self, method: str) -> Any:
        def call() -> dict[str, str]:
            self._calls.append(f"{self._name}.{method}")
            if f"{self._name}.{method}" == self._fails:
                raise DeviceError("it fails")
            return {self._name: method}

        return call


@needs_servo
@pytest.mark.parametrize(("runs", "starts"), [(None, True), (True, True), (False, False)])
def test_a_rig_is_opened_with_half_the_workspace_and_started_unless_its_clock_is_advanced(
    monkeypatch: pytest.MonkeyPatch, runs: bool | None, starts: bool
) -> None:
    requests: list[Any] = []
    calls: list[str] = []
    device, clock = Kept("device", calls), None if runs is None else SimpleNamespace(runs=runs)
    monkeypatch.setattr(rig, "open_device", lambda *words, **named: requests.append((words, named)) or device)
    monkeypatch.setattr(
        "study_app.haptics.runtime.servo.Servo",
        lambda *words, **named: requests.append((words, named)) or Kept("servo", calls),
    )
    opened_rig = open_rig("pen:7", SETTINGS, clock=clock, progress=print, cancelled=bool)  # type: ignore[arg-type]
    assert requests == [
        (
            ("pen:7",),
            {"workspace_m": (0.05, 0.03, 0.02), "force_limit_n": 3.5, "random": DRAWN, "progress": print,
             "cancelled": bool, "options": {"port": "7"}},
        ),
        ((device,), {"clock": clock, "rate_hz": 2000.0, "elements": 70}),
    ]  # fmt: skip
    assert calls == ["servo.start"] * starts
    assert (opened_rig in rig._open_rigs) == starts
    opened_rig.stop()
    assert opened_rig not in rig._open_rigs
    assert calls == [*["servo.start"] * starts, "servo.stop", "device.close"]


@needs_servo
@pytest.mark.parametrize("failing", ["cancelled", "servo.start"])
def test_a_rig_that_cannot_be_opened_leaves_no_device_open(monkeypatch: pytest.MonkeyPatch, failing: str) -> None:
    calls: list[str] = []
    monkeypatch.setattr(rig, "open_device", lambda *_, **__: Kept("device", calls))
    monkeypatch.setattr("study_app.haptics.runtime.servo.Servo", lambda *_, **__: Kept("servo", calls, failing))
    said = "opening the device 'pen' was cancelled" if failing == "cancelled" else "it fails"
    with pytest.raises(DeviceError, match=f"^{said}$"):
        open_rig("pen", SETTINGS, cancelled=lambda: failing == "cancelled")
    assert calls[-1] == "device.close"
    for leftover in tuple(rig._open_rigs):
        rig._open_rigs.discard(leftover)


def test_a_rig_is_stopped_before_its_device_is_closed_and_reopened_at_zero_force() -> None:
    calls: list[str] = []
    both: Any = Kept("device", calls), Kept("servo", calls)
    assert Rig(*both).reconnect() == {"device": "describe", "servo": "describe"}
    assert calls[:5] == ["servo.stop_force", "servo.stop", "device.close", "device.open", "servo.start"]
    calls.clear()
    failing: Any = Kept("servo", calls, "servo.stop")
    with pytest.raises(DeviceError, match="it fails"), Rig(both[0], failing):
        calls.append("used")
    assert calls == ["used", "servo.stop", "device.close"]


@needs_servo
def test_the_settings_of_a_session_follow_from_its_study(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "study_app.haptics.runtime.pack.elements_needed", lambda scene: round(1e6 * scene.liquids[0].density_kg_m3)
    )
    study = load("demo")
    settings = study_settings(study, DRAWN, {"port": "7"})
    densities = [study.scene_for(name).liquids[0].density_kg_m3 for name in study.conditions]
    assert settings.elements == round(1e6 * max(densities))
    assert (settings.workspace_m, settings.force_limit_n, settings.rate_hz, settings.random, settings.options) == (
        study.device.workspace_m, study.device.force_limit_n, study.device.rate_hz, DRAWN, {"port": "7"},
    )  # fmt: skip
    assert study_settings(study, DRAWN).options == {}
    for limit_n in (0.0, -1.0, float("nan")):
        with pytest.raises(DeviceError, match=f"^the force limit must be greater than 0 N, not {limit_n:g} N$"):
            RigSettings(workspace_m=(0.1, 0.1, 0.1), force_limit_n=limit_n, elements=1, random=DRAWN)


def test_devices_are_listed_with_the_mouse_first_and_simulated_ones_last() -> None:
    devices = all_devices()
    assert devices[0].name == list_devices()[0] == "mouse"
    simulated = [device.simulated for device in devices]
    assert simulated == sorted(simulated)
    assert {"scripted", "falcon-emulated"} <= {device.name for device in devices if device.simulated}
    assert descriptor_of("falcon:FT7").name == "falcon"
    assert (title_of("falcon:FT7"), title_of("pen")) == (descriptor_of("falcon").title, "pen")
    labels = {name: descriptor_of(name).label for name in ("mouse", "falcon", "scripted")}
    assert labels["mouse"] == f"{descriptor_of('mouse').title} (visual only)"
    assert labels["falcon"] == descriptor_of("falcon").title
    assert labels["scripted"] == f"{descriptor_of('scripted').title} (simulated)"
    with pytest.raises(DeviceNotFound, match=r"^device 'mouse:7' is not known; choose one of: mouse, "):
        descriptor_of("mouse:7")


def test_a_device_that_needs_an_argument_is_not_listed_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    bridge = replace(descriptor_of("scripted"), name="bridge", argument="HOST", argument_required=True)
    listed = list_devices()
    monkeypatch.setattr(registry, "all_devices", lambda: (bridge, *all_devices()))
    monkeypatch.setattr(registry, "DEVICES", {**registry.DEVICES, "bridge": bridge})
    assert list_devices() == listed
    assert descriptor_of("bridge:lab-7") is bridge
    with pytest.raises(DeviceNotFound, match=r"^device 'bridge' needs an argument .* specify it as bridge:HOST$"):
        descriptor_of("bridge")


def test_an_option_that_a_device_lacks_is_named_with_the_devices_that_have_it() -> None:
    check_options("falcon", ["firmware"])
    with pytest.raises(DeviceError) as refused:
        check_options("mouse", ["firmware"])
    having = [device.title for device in all_devices() if "firmware" in {it.name for it in device.options}]
    assert descriptor_of("falcon").title in having
    assert str(refused.value) == (
        f"device 'mouse' does not use firmware; only these do: {', '.join(having)}: omit --firmware"
    )
    with pytest.raises(DeviceError, match=r"^device 'mouse' does not use colour: omit --colour$"):
        check_options("mouse", ["colour"])


def test_windows_show_the_options_that_are_for_them_and_a_request_only_the_limits_it_has() -> None:
    options = tuple(
        DeviceOption(name=name, title=name, help="", in_windows=name != "trace") for name in ("port", "trace", "tip")
    )
    device = SimpleNamespace(options=options)
    kind: Any = type(descriptor_of("mouse"))
    window_options = kind.window_options.fget(device)
    assert [option.name for option in window_options] == ["port", "tip"]
    values = {"port": "7", "trace": "on"}
    assert kind.window_values(SimpleNamespace(window_options=window_options), values) == {"port": "7"}
    assert OpenRequest().limits == {}
    assert OpenRequest(force_limit_n=2.0).limits == {"force_limit_n": 2.0}
    both = OpenRequest(workspace_m=(0.1, 0.2, 0.3), force_limit_n=2.0).limits
    assert both == {"workspace_m": (0.1, 0.2, 0.3), "force_limit_n": 2.0}
