"""A device of another package: found by its entry point and usable everywhere, without changing this package."""

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.devices.registry import backends, list_devices
from study_app.errors import DeviceError
from study_app.gui.devices.view import DevicesPlace
from study_app.gui.home.dialogs import NewSessionDialog
from study_app.gui.home.study_facts import study_facts
from study_app.gui.kit.devices import devices_shown
from study_app.store.workstation import MachineSettings
from tests.plug_in_packages import install

pytestmark = pytest.mark.slow

DESCRIPTOR = """
    from study_app.devices.descriptor import READY, Backend, DeviceDescriptor, DeviceOption, Doctor, opened
    from study_app.devices.doctor import Finding, Report


    def open_toy(request):
        from toy_driver import ToyHand

        return opened(ToyHand(request))


    def findings(state="not looked at"):
        loose = Finding(
            number=1,
            id="loose",
            tested="its string is tight",
            symptom="its string is loose",
            state=state,
            cause="wear",
            cure="tighten it",
            known_by="a look",
        )
        return (loose,)


    def examine(name, *, options, faults, progress):
        progress(f"Looking at {name}.")
        return Report(("a string",), findings("found" if "loose" in faults else "ok"), None)


    TOY = DeviceDescriptor(
        name="toy-hand",
        title="Toy hand",
        icon="fast_forward",
        kind="simulated",
        degrees_of_freedom=2,
        open=open_toy,
        probe=lambda: [Backend("toy-hand", "a string", state=READY, can="moves by itself, as a toy does")],
        moves_by_itself=True,
        options=(DeviceOption(name="toy-mass", title="Mass of the toy", help="Its mass in grams."),),
        doctor=Doctor(findings=findings, examine=examine),
    )
"""
DRIVER = """
    from study_app.devices.simulated import SimulatedDevice
    from study_app.haptics.kernels.plant import new_handle


    class ToyHand(SimulatedDevice):
        name = "toy-hand"

        def __init__(self, request):
            grams = float(request.options.get("toy-mass", 300))
            handle = new_handle(mass_kg=grams / 1000, stiffness_npm=400.0, damping_nspm=30.0)
            super().__init__(handle, request.workspace_m or (0.05, 0.05, 0.05), request.force_limit_n or 8.0)
            self._tremble(request.random, 1e-5)
"""


@pytest.fixture
def toy(site):
    """Install the toy device."""
    install(site, "toy_hand", "device", {"toy-hand": "toy_hand:TOY"}, toy_hand=DESCRIPTOR, toy_driver=DRIVER)


def liquid_study(*words: str):
    return CliRunner().invoke(commands, words)


@pytest.mark.usefixtures("toy")
class TestDeviceOfAnotherPackage:
    def test_is_listed_by_the_command_and_in_the_window(self, qtbot):
        assert "toy-hand" in list_devices()
        listed = liquid_study("devices")
        assert "toy-hand            ready  (a string; simulated, 2 degrees of freedom)" in listed.output
        place = DevicesPlace(MachineSettings(device="toy-hand"))
        qtbot.addWidget(place)
        place.show_devices(devices_shown(backends()))
        row = place.rows["toy-hand"]
        assert row.title.text() == "Toy hand"
        assert row.title.isChecked()
        assert row.chip.word == "Ready"
        assert row.diagnose.isVisibleTo(place)

    def test_is_offered_for_a_session_with_its_option_and_a_folder_of_its_own(self, qtbot, tmp_path):
        dialog = NewSessionDialog(study_facts("demo"), tmp_path / "results")
        qtbot.addWidget(dialog)
        dialog.open()
        field = dialog.editors["toy-mass"].control
        assert not field.isVisible()
        dialog.editors["device"].control.setCurrentIndex(dialog.editors["device"].control.findData("toy-hand"))
        assert dialog.editors["device"].control.currentText() == "Toy hand (simulated)"
        assert field.isVisible()
        field.setText("250")
        chosen = dialog.chosen()
        assert (chosen.device, chosen.device_options) == ("toy-hand", {"toy-mass": "250"})
        assert chosen.results == tmp_path / "results" / "demo-toy-hand"

    def test_its_option_belongs_to_commands_and_its_doctor_examines_it(self):
        assert "--toy-mass TEXT" in liquid_study("run", "--help").output
        refused = liquid_study("run", "demo", "--participant", "P001", "--device", "mouse", "--toy-mass", "250")
        assert isinstance(refused.exception, DeviceError)
        assert str(refused.exception).startswith("device 'mouse' does not use toy-mass; only these do: Toy hand:")
        result = liquid_study("devices", "doctor", "--device", "toy-hand", "--fault", "loose")
        assert result.exit_code == 3
        assert "FAULT          its string is loose" in result.output


@pytest.mark.parametrize(
    ("value", "source", "reason"),
    [
        ("toy_missing:TOY", "", "No module named 'toy_missing'"),
        ("toy_broken:TOY", "raise RuntimeError('no such\\nlibrary')", "no such library"),
        ("toy_broken:TOY", "TOY = 3", "toy_broken:TOY must be a DeviceDescriptor, but has the type int"),
        ("toy_broken:TOY", DESCRIPTOR.replace('"toy-hand"', '"mouse"'), "device 'mouse' already exists: rename it"),
        ("toy_broken:TOY", DESCRIPTOR.replace('"toy-hand"', '"Toy 1"'), "the device name 'Toy 1' is not permitted"),
        ("toy_broken:TOY", DESCRIPTOR.replace('"simulated"', '"dreamt"'), "device 'toy-hand': unknown kind 'dreamt'"),
    ],
)
def test_a_broken_entry_point_is_one_row_and_every_other_device_stays(site, qtbot, value, source, reason):
    install(site, "toy_broken", "device", {"toy": value}, toy_broken=source)
    result = liquid_study("devices")
    assert result.exit_code == 0
    (broken,) = (backend for backend in backends() if backend.name == "toy (toy_broken)")
    assert reason in broken.why
    assert "\n" not in broken.why
    assert "toy (toy_broken)    not available  (entry point)" in result.output
    assert "uninstall the package toy_broken" in " ".join(result.output.split())
    place = DevicesPlace()
    qtbot.addWidget(place)
    place.show_devices(devices_shown(backends()))
    row = place.rows["toy (toy_broken)"]
    assert row.chip.word == "Not available"
    assert reason in row.why.text()
    assert place.rows["mouse"].title.isChecked()
    assert "toy" not in list_devices()


def test_a_device_that_cannot_be_looked_for_hides_no_other(site):
    install(
        site,
        "toy_blind",
        "device",
        {"toy": "toy_blind:TOY"},
        toy_blind=DESCRIPTOR.replace(
            '[Backend("toy-hand", "a string", state=READY, can="moves by itself, as a toy does")]', "1 / 0"
        ),
    )
    backends_by_name = {backend.name: backend for backend in backends()}
    assert backends_by_name["toy-hand"].why == (
        "the search for it failed: the plug-in toy_blind 1.0 failed (ZeroDivisionError: division by zero): "
        "update or uninstall the plug-in"
    )
    assert {"mouse", "falcon", "scripted"} <= set(backends_by_name)


def test_a_probe_that_returns_an_iterator_is_a_fault_of_its_plug_in(site):
    install(
        site,
        "toy_once",
        "device",
        {"toy": "toy_once:TOY"},
        toy_once=DESCRIPTOR.replace(
            '[Backend("toy-hand", "a string", state=READY, can="moves by itself, as a toy does")]', "iter([])"
        ),
    )
    backends_by_name = {backend.name: backend for backend in backends()}
    assert "toy_once 1.0 failed (probe of device toy-hand returned" in backends_by_name["toy-hand"].why
    assert "not a list of Backend" in backends_by_name["toy-hand"].why
