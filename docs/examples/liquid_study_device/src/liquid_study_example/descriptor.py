"""What liquid-study knows of the device without opening it. This module loads no driver."""

from study_app.devices.descriptor import READY, Backend, DeviceDescriptor, opened

DELAY_S = {"direct": 0.0, "mailbox": 1e-3}
"""How much later than in the tick in which it is written a force acts."""


def _described(way, title):
    """Return the descriptor of the device by one of the two ways."""

    def open_device(request):
        from liquid_study_example.driver import ExampleDevice  # noqa: PLC0415 - the driver: only once it is opened

        return opened(ExampleDevice(way, delay_s=DELAY_S[way], **request.limits))

    name = f"example-{way}"
    return DeviceDescriptor(
        name=name,
        title=title,
        icon="device",
        kind="felt",
        degrees_of_freedom=3,
        open=open_device,
        probe=lambda: [Backend(name, "liquid-study-example", READY, "force up to 8 N")],
        motion_shows_force=False,
    )


DIRECT = _described("direct", "Example device")
MAILBOX = _described("mailbox", "Example device with its own thread")
