"""A liquid's force in another program's loop of 60 Hz, such as PsychoPy's; the servo runs at 1 kHz by itself."""

import time

from study_app import api


class Window:
    """Stands for ``psychopy.visual.Window``, whose ``flip`` returns once the next frame is on the screen."""

    def __init__(self, rate_hz):
        self._period_s = 1 / rate_hz

    def flip(self):
        time.sleep(self._period_s - time.perf_counter() % self._period_s)


def main(frames=120, device="scripted"):
    """Feel water, then a thicker liquid; return the time [s], place [m] and force [N] of the last sample a frame."""
    window, shown = Window(60), []
    with api.open_force("rek2024", device=device, force_limit_n=2) as force:  # whatever ends it: zero force
        force.set_liquid("water")
        if device == "scripted":
            force.follow([0, 1, 2], [[0, 0, 0], [0.04, 0, 0], [0, 0, 0]])  # a simulated hand; a person moves a Falcon's
        for frame in range(frames):
            samples = force.read()  # all since the last frame
            if len(samples):
                newest = samples[-1]
                shown.append((newest.time_ns * 1e-9, newest.position_m.copy(), newest.device_force_n.copy()))
            if frame == frames // 2:
                force.set_liquid("water", viscosity_pa_s=0.5)  # numbers change without a fade
            window.flip()  # draw the ball at shown[-1][1] before it
        force.stop()  # zero force at the next tick
        if force.dropped:
            print(f"{force.dropped} samples were lost: read more often")
    return shown


if __name__ == "__main__":
    for at_s, place_m, force_n in main()[::20]:
        print(f"{at_s:6.2f} s  {place_m.round(3)} m  {force_n.round(2)} N")
