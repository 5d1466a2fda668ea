"""A camera in a process of its own: python camera_process.py [--seconds S] [--age-ms A].

Prints its port, waits for one receiver, then sends frames in real time (Motion JPEG in NUT). Each frame's time stamp is
the system's monotonic time less ``--age-ms``, as those of a camera whose frames are so old when they arrive; with
``--relative`` they count from 0. Every ``--lose``-th frame is lost. ``--print`` prints number and time of sending.
"""

import argparse
import contextlib
import socket
import sys
import time
from fractions import Fraction
from pathlib import Path

import av

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.video.clips import RATE_HZ, picture

ACCEPT_S = 20.0


class Sent:
    """A file whose output goes to a socket."""

    def __init__(self, to: socket.socket) -> None:
        self._to = to

    def write(self, content: bytes) -> int:
        """Send all bytes."""
        self._to.sendall(content)
        return len(content)


def main() -> None:
    """Send the frames."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--age-ms", type=float, default=0.0)
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--lose", type=int, default=0)
    parser.add_argument("--relative", action="store_true")
    parser.add_argument("--print", action="store_true", dest="prints")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    pictures = [picture(number, (width, height)) for number in range(round(RATE_HZ * arguments.seconds))]
    frames = [av.VideoFrame.from_ndarray(image, "rgb24").reformat(format="yuvj420p") for image in pictures]
    sent: list[str] = []
    microsecond = Fraction(1, 1_000_000)
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(ACCEPT_S)
        sys.stdout.write(f"{server.getsockname()[1]}\n")
        sys.stdout.flush()
        receiver = server.accept()[0]
    receiver.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    options = {"flush_packets": "1"}
    with contextlib.suppress(OSError), av.open(Sent(receiver), "w", format="nut", options=options) as container:
        stream = container.add_stream("mjpeg", rate=RATE_HZ)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuvj420p"
        stream.time_base = stream.codec_context.time_base = microsecond
        began = time.perf_counter()
        for number, frame in enumerate(frames):
            time.sleep(max(0.0, began + number / RATE_HZ - time.perf_counter()))
            now = time.perf_counter()
            stamp = now - began if arguments.relative else now - 1e-3 * arguments.age_ms
            frame.pts, frame.time_base = round(1e6 * stamp), microsecond
            packets = stream.encode(frame)
            if arguments.lose and number % arguments.lose == arguments.lose - 1:
                continue
            sent.append(f"{number} {time.perf_counter()}")
            container.mux(packets)
    if arguments.prints:
        sys.stdout.write("\n".join(sent))


if __name__ == "__main__":
    main()
