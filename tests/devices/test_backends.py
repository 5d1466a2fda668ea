import subprocess
import sys
from types import SimpleNamespace

import numba
import pytest

from study_app.devices import registry
from study_app.devices.descriptor import DRIVER_READY, NONE, NOT_AVAILABLE, READY, Backend
from study_app.devices.falcon.failures import UsbFailure
from study_app.devices.falcon.transport import probe as probe_falcon
from study_app.devices.falcon.transport import probe_ftdi
from study_app.devices.registry import backends, list_devices
from study_app.devices.spacemouse.hid import MODELS
from study_app.devices.spacemouse.hid import probe as probe_spacemouse
from study_app.errors import DeviceNotFound


def hid(*models):
    listed = [{"vendor_id": model.vendor, "product_id": model.product, "path": b"x"} for model in models]
    return SimpleNamespace(enumerate=lambda: listed)


def bus(*emulators):
    from study_app.devices.emulators.falcon import EmulatedBackend

    return EmulatedBackend(*emulators)


def by_name(*, usb=None, spacemice=None, d2xx=None, platform="linux"):
    hardware = [*probe_spacemouse(spacemice or hid()), probe_falcon(usb or bus(), platform), probe_ftdi(d2xx, platform)]
    looked_for = {(backend.name, backend.by.split()[0]): backend for backend in backends()}
    return looked_for | {(backend.name, backend.by.split()[0]): backend for backend in hardware}


pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="the emulated bus is compiled")


def test_every_device_that_can_be_opened_is_listed():
    named = {name.partition(":")[0] for name, _ in by_name()}
    assert named == set(list_devices())


def test_without_hardware_each_backend_asks_to_connect_its_device():
    listed = by_name()
    assert listed["mouse", "the"].state == READY
    for key in (("falcon", "libusb"), ("spacemouse", "hidapi")):
        assert listed[key].state == NONE
        assert "connect" in listed[key].why


def test_connected_devices_are_named():
    from study_app.devices.emulators.falcon_emulator import Emulator

    listed = by_name(usb=bus(Emulator(serial="FT1"), Emulator(serial="FT2")), spacemice=hid(MODELS[1], MODELS[1]))
    assert listed["falcon", "libusb"].state == "connected: FT1, FT2"
    assert listed["falcon", "libusb"].why == ""
    assert listed["spacemouse", "hidapi"].state == "connected: SpaceNavigator"


@pytest.mark.parametrize(
    ("platform", "words"), [("linux", "this account"), ("win32", "driver"), ("darwin", "FTDI driver")]
)
def test_a_device_without_a_serial_number_states_possible_reasons(platform, words):
    from study_app.devices.emulators.falcon_emulator import Emulator

    emulator = Emulator()
    emulator.faults.on("access_denied")
    falcon = by_name(usb=bus(emulator), platform=platform)["falcon", "libusb"]
    assert falcon.state == "connected: unnamed"
    assert words in falcon.why
    assert "doctor" in falcon.why


def test_ftdis_driver_is_for_windows(monkeypatch):
    assert "Windows" in by_name(platform="linux")["falcon", "ftd2xx"].why
    assert by_name(platform="win32", d2xx=object())["falcon", "ftd2xx"].state == DRIVER_READY

    def missing():
        raise UsbFailure("no-ftd2xx", "loading FTDI's driver library")

    monkeypatch.setattr("study_app.devices.falcon.transport.load_d2xx", missing)
    assert "install FTDI's D2XX driver" in by_name(platform="win32")["falcon", "ftd2xx"].why


def test_a_hidapi_that_does_not_load_is_reported(monkeypatch):
    from study_app.devices.spacemouse import hid as spacemouse_hid

    def missing(name):
        raise OSError(f"no {name}")

    monkeypatch.setattr(spacemouse_hid, "import_module", missing)
    spacemouse = next(backend for backend in backends() if backend.name == "spacemouse")
    assert spacemouse.state == NOT_AVAILABLE
    assert "pip install hidapi" in spacemouse.why


@pytest.mark.slow
def test_backends_are_listed_without_loading_the_compiler():
    program = (
        "import sys; from study_app.devices.registry import backends; print(len(backends())); "
        "sys.exit('numba' in sys.modules)"
    )
    finished = subprocess.run([sys.executable, "-c", program], check=False, capture_output=True, text=True)
    assert (finished.returncode, finished.stdout.strip()) == (0, "10"), finished.stderr


@pytest.mark.parametrize(
    ("states", "missing"),
    [((NONE, NOT_AVAILABLE), True), ((NONE, DRIVER_READY), False), ((READY,), False), ((NOT_AVAILABLE,), False)],
)
def test_a_missing_device_is_reported_before_anything_is_compiled(
    monkeypatch: pytest.MonkeyPatch, states: tuple[str, ...], missing: bool
) -> None:
    pen_backends = [Backend("pen", "a library", state=state, can="force", why="connect its cable") for state in states]
    pen = SimpleNamespace(title="Pen", probe=lambda: pen_backends)
    monkeypatch.setattr(registry, "descriptor_of", lambda _name: pen)
    if not missing:
        registry.check_connected("pen")
        return
    with pytest.raises(DeviceNotFound, match=r"^Pen: none connected \(connect its cable\)$"):
        registry.check_connected("pen")
