"""What liquid-study knows of the device without opening it. This module loads no driver."""

from study_app.devices.descriptor import READY, Backend, framed


def _described(way, title):
    """Return the descriptor of the device by one of the two ways."""
    name = f"example-{way}"
    return framed(
        name,
        title,
        f"liquid_study_example.driver:{way.title()}Device",
        "liquid_study_example.failures:FAILURES",
        icon="device",
        kind="felt",
        probe=lambda: [Backend(name, "liquid-study-example", state=READY, can="force up to 8 N")],
    )


DIRECT = _described("direct", "Example device")
MAILBOX = _described("mailbox", "Example device with its own thread")
