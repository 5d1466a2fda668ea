"""What a servo exchanges with a device, for tests that write to one themselves."""

from study_app.haptics.model.layout import new_command


def write(device, force_n=(0.0, 0.0, 0.0)):
    """Command a force; return what the device answered and the force that it says it sent."""
    command = new_command()
    command[0].force_n = command[0].sent_n = force_n
    return device.write.ctypes(device.context, command.ctypes.data), command[0].sent_n.copy()
