"""pyusb's own functions through the emulated backend, and what they raise when something is wrong."""

import errno

import numba
import pytest
import usb.core
import usb.util

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

from study_app.devices.falcon.emulator.usb_backend import EmulatedBackend
from study_app.devices.falcon.wire import constants
from tests.devices.falcon.support.emulated_falcon import packet, still, stripped


def plugged(*emulators):
    backend = EmulatedBackend(*(emulators or (still(running=True),)))
    return backend, list(usb.core.find(find_all=True, backend=backend))


def claimed(emulator=None):
    backend, (device,) = plugged(emulator or still(running=True))
    usb.util.claim_interface(device, 0)
    return backend, device


def request(device, number, value):
    return device.ctrl_transfer(constants.REQUEST_TYPE, number, value, 0)


def test_pyusb_finds_it_by_its_ids_and_reads_its_names():
    backend, _ = plugged(still(serial="FT0815"))
    device = usb.core.find(backend=backend, idVendor=constants.VENDOR_ID, idProduct=constants.PRODUCT_ID)
    assert (device.product, device.serial_number) == (constants.PRODUCT, "FT0815")
    assert usb.core.find(backend=backend, idVendor=0x0403, idProduct=0x6001) is None


def test_its_descriptors_are_those_of_the_bridge():
    _, (device,) = plugged()
    interface = device.get_active_configuration()[(0, 0)]
    assert interface.bInterfaceClass == 0xFF
    endpoints = {endpoint.bEndpointAddress: endpoint for endpoint in interface}
    assert set(endpoints) == {constants.ENDPOINT_IN, constants.ENDPOINT_OUT}
    for endpoint in endpoints.values():
        assert endpoint.wMaxPacketSize == constants.USB_PACKET
        assert usb.util.endpoint_type(endpoint.bmAttributes) == usb.util.ENDPOINT_TYPE_BULK


def test_several_are_told_apart_by_their_serials():
    _, devices = plugged(still(serial="A"), still(serial="B"))
    assert [device.serial_number for device in devices] == ["A", "B"]
    assert len({(device.bus, device.address) for device in devices}) == 2


def test_pyusb_writes_reads_and_controls_unchanged():
    emulator = still(running=True)
    _, device = claimed(emulator)
    request(device, constants.REQUEST_BAUD, constants.BAUD_1500000)
    request(device, constants.REQUEST_LATENCY, 1)
    assert device.write(constants.ENDPOINT_OUT, packet((3, 4, 5)), 100) == 16
    heard = b""
    while len(heard) < 16:
        heard += stripped(bytes(device.read(constants.ENDPOINT_IN, 64, 100)))
    assert (heard[0], heard[15]) == (constants.START, constants.STOP)
    assert emulator.torques == (3, 4, 5)
    assert emulator.recorded == [(constants.REQUEST_BAUD, constants.BAUD_1500000), (constants.REQUEST_LATENCY, 1)]


def refused(act):
    with pytest.raises(usb.core.USBError) as raised:
        act()
    return raised.value.backend_error_code, raised.value.errno


def test_a_time_out_and_an_overflow_are_pyusbs_own():
    backend, device = claimed()
    device.read(constants.ENDPOINT_IN, 64, 100)
    with pytest.raises(usb.core.USBTimeoutError) as raised:
        device.read(constants.ENDPOINT_IN, 64, 3)
    assert (raised.value.backend_error_code, raised.value.errno) == (constants.ERROR_TIMEOUT, errno.ETIMEDOUT)
    request(device, constants.REQUEST_BAUD, constants.BAUD_1500000)
    device.write(constants.ENDPOINT_OUT, packet(), 100)
    backend.pause(0.05)
    assert refused(lambda: device.read(constants.ENDPOINT_IN, 7, 100)) == (constants.ERROR_OVERFLOW, errno.EOVERFLOW)


def test_unplugged_it_is_gone():
    emulator = still(running=True)
    backend, device = claimed(emulator)
    emulator.faults.on("unplugged")
    gone = (constants.ERROR_NO_DEVICE, errno.ENODEV)
    assert refused(lambda: device.write(constants.ENDPOINT_OUT, packet(), 10)) == gone
    assert refused(lambda: device.read(constants.ENDPOINT_IN, 64, 10)) == gone
    assert refused(lambda: request(device, constants.REQUEST_LATENCY, 1)) == gone
    assert list(usb.core.find(find_all=True, backend=backend)) == []


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        ("access_denied", (constants.ERROR_ACCESS, errno.EACCES)),
        ("busy", (constants.ERROR_BUSY, errno.EBUSY)),
        ("kernel_driver", (constants.ERROR_BUSY, errno.EBUSY)),
    ],
)
def test_it_may_be_refused(fault, error):
    emulator = still()
    emulator.faults.on(fault)
    _, (device,) = plugged(emulator)
    assert refused(lambda: usb.util.claim_interface(device, 0)) == error
    emulator.faults.off(fault)
    usb.util.claim_interface(device, 0)


def test_another_driver_lets_it_be_seen_but_not_opened():
    emulator = still()
    emulator.faults.on("not_supported")
    _, (device,) = plugged(emulator)
    with pytest.raises(NotImplementedError):
        usb.util.claim_interface(device, 0)


def test_the_kernels_driver_can_be_detached_if_it_lets_itself():
    emulator = still()
    emulator.faults.on("kernel_driver")
    _, (device,) = plugged(emulator)
    assert device.is_kernel_driver_active(0)
    emulator.faults.on("kernel_driver_stays")
    assert refused(lambda: device.detach_kernel_driver(0)) == (constants.ERROR_ACCESS, errno.EACCES)
    emulator.faults.off("kernel_driver_stays")
    device.detach_kernel_driver(0)
    assert not device.is_kernel_driver_active(0)
    usb.util.claim_interface(device, 0)


def test_one_program_has_it_until_it_lets_go():
    backend, first = claimed()
    second = usb.core.find(backend=backend)
    assert refused(lambda: usb.util.claim_interface(second, 0)) == (constants.ERROR_BUSY, errno.EBUSY)
    assert refused(lambda: backend.bulk_write(backend.open_device(backend.emulators[0]), 2, 0, b"", 10))[0] == -1
    usb.util.dispose_resources(first)
    usb.util.claim_interface(second, 0)
    usb.util.release_interface(second, 0)
    usb.util.claim_interface(first, 0)


def test_compiled_code_gets_the_same_falcon_and_its_time():
    emulator = still(running=True)
    backend, _ = claimed(emulator)
    assert backend.c_calls(backend.open_device(backend.emulators[0])) == emulator.calls()
    before_s = backend.now_s()
    backend.pause(0.5)
    assert backend.now_s() - before_s == pytest.approx(0.5, abs=1e-3)
