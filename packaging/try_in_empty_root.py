"""Run the bundled program in an empty root: no Python, no shell, only the libraries of X and GL that a desktop has.

    sudo python packaging/try_in_empty_root.py [dist/liquid-study] [--window]

Linux alone, as root. Copies into the root: the C library and its loader, the libraries below, one font, and the bundle.
Then, each as one program: the version, the start of a session's windows on a fresh machine, the pages of Help, a
rehearsal, its check and report, and a rehearsal with code compiled for another CPU; with --window only the first two.
Prints how long each took.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOADER = "/lib64/ld-linux-x86-64.so.2"
DESKTOP = """
    libc.so.6 libm.so.6 libpthread.so.0 libdl.so.2 librt.so.1 libutil.so.1 libresolv.so.2 libnss_files.so.2
    libgcc_s.so.1 libstdc++.so.6 libz.so.1 libEGL.so.1 libGL.so.1 libGLX.so.0 libGLdispatch.so.0 libOpenGL.so.0
    libX11.so.6 libX11-xcb.so.1 libxcb.so.1 libXau.so.6 libXdmcp.so.6 libbsd.so.0 libmd.so.0 libfontconfig.so.1
    libfreetype.so.6 libexpat.so.1 libpng16.so.16 libbrotlidec.so.1 libbrotlicommon.so.1 libdbus-1.so.3
    libsystemd.so.0 libcap.so.2 libgcrypt.so.20 libgpg-error.so.0 liblzma.so.5 liblz4.so.1 libzstd.so.1
    libxkbcommon.so.0 libxkbcommon-x11.so.0 libxcb-cursor.so.0 libxcb-icccm.so.4 libxcb-image.so.0
    libxcb-keysyms.so.1 libxcb-randr.so.0 libxcb-render.so.0 libxcb-render-util.so.0 libxcb-shape.so.0 libxcb-shm.so.0
    libxcb-sync.so.1 libxcb-util.so.1 libxcb-xfixes.so.0 libxcb-xinerama.so.0 libxcb-xkb.so.1 libglib-2.0.so.0
    libgthread-2.0.so.0 libpcre2-8.so.0 libudev.so.1
"""
"""Libraries of the system that a desktop has."""

PROGRAM = "/opt/liquid-study/liquid-study"
PYTHON = re.compile(r"python[0-9.]*$")

SESSION = """
import sys, time
began, worked = time.perf_counter(), time.process_time()
from pathlib import Path
from PySide6.QtCore import QEventLoop, QTimer
from study_app.app.timing import collecting_in_this_thread
from study_app.app.session.live_session import LiveSession
from study_app.gui.application import application_here
from study_app.gui.theme.theme import LIGHT
from study_app.session.start import NewSession
application_here()
chosen = NewSession(
    source="demo", participant="P001", session=1, seed=1, operator="", language="en", device="scripted", windowed=True,
    screen=None, results=Path("/home/session"),
)
live = LiveSession(chosen, LIGHT)
loop = QEventLoop()
live.over.connect(loop.quit)
timer = QTimer(interval=20)
def look():
    if live.bridge is not None and live.bridge.participant.isVisible():
        timer.stop()
        lasted_s, core_s = time.perf_counter() - began, time.process_time() - worked
        print(f"    windows after {lasted_s:.1f} s, {core_s:.1f} s of a core; 2 s of measuring are in it", flush=True)
        QTimer.singleShot(500, live.bridge.leave_without_asking)
timer.timeout.connect(look)
timer.start()
with collecting_in_this_thread():
    QTimer.singleShot(0, live.open)
    loop.exec()
    live.wait()
if live.error:
    raise live.error
sys.exit(live.code)
"""

HELP = """
from study_app.gui.application import application_here
from study_app.gui.help.view import HelpPlace, help_entries
application_here()
place = HelpPlace()
for entry in help_entries():
    place.open_page(entry.page)
    assert place.reader.toPlainText().strip(), entry.page
print(f"    {len(help_entries())} pages")
"""

COMPILING = """
import sys, time
from pathlib import Path
from study_app.haptics.kernels.compiled import following_compilation
from study_app.session.simulated.rehearsal import rehearse
shares = []
began, worked = time.perf_counter(), time.process_time()
with following_compilation(shares.append) as counter:
    rehearse("demo", participants=1, seed=1, results=Path("/home") / sys.argv[1])
print(f"    {counter.compiled} functions compiled in {time.process_time() - worked:.0f} s of a core, "
      f"{time.perf_counter() - began:.0f} s in all; progress to {max(shares, default=0):.0%}")
"""


def libraries() -> dict[str, Path]:
    """Return where this computer has the libraries of a desktop."""
    said = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    known = dict(re.findall(r"^\s*(\S+) \(libc6,x86-64[^)]*\) => (\S+)$", said, re.MULTILINE)[::-1])
    if lacking := [name for name in DESKTOP.split() if name not in known]:
        print(f"not on this computer, so not in the root: {' '.join(lacking)}", flush=True)
    return {name: Path(known[name]) for name in DESKTOP.split() if name in known}


def furnish(root: Path, bundle: Path) -> None:
    """Fill an empty root."""
    library = root / "lib" / "x86_64-linux-gnu"
    for folder in (library, root / "lib64", root / "tmp", root / "home", root / "proc", root / "dev", root / "etc"):
        folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(LOADER, root / LOADER[1:])
    (root / LOADER[1:]).chmod(0o755)
    for name, path in libraries().items():
        shutil.copyfile(path, library / name)
    shutil.copytree("/usr/lib/locale/C.utf8", root / "usr" / "lib" / "locale" / "C.utf8")
    shutil.copytree("/etc/fonts", root / "etc" / "fonts")
    (root / "etc" / "passwd").write_text("someone:x:0:0::/home:/none\n", encoding="utf-8", newline="\n")
    shutil.copytree(bundle, root / "opt" / "liquid-study", symlinks=True)
    for name, minor in (("null", 3), ("zero", 5), ("random", 8), ("urandom", 9)):
        os.mknod(root / "dev" / name, 0o20666, os.makedev(1, minor))
    (root / "dev" / "shm").mkdir()


def run(root: Path, title: str, *words: str, **variables: str) -> float:
    """Run the program in the root, in a process namespace of its own; return how long it took [s]."""
    environment = {"HOME": "/home", "PATH": "/none", "LANG": "C.UTF-8", "QT_QPA_PLATFORM": "offscreen"}
    environment |= {"LIQUID_STUDY_WORKSPACE": "/home"} | variables
    inside = ["unshare", "--mount", "--pid", "--fork", f"--mount-proc={root / 'proc'}", "chroot", str(root)]
    began, worked = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([*inside, PROGRAM, *words], env=environment | {"PATH": os.environ["PATH"]}, check=False)
    took_s = time.perf_counter() - began
    now = resource.getrusage(resource.RUSAGE_CHILDREN)
    core_s = now.ru_utime + now.ru_stime - worked.ru_utime - worked.ru_stime
    print(f"{title:<36}{took_s:>8.1f} s  {core_s:>7.1f} s of a core   exit code {done.returncode}", flush=True)
    if done.returncode:
        sys.exit(1)
    return took_s


def main() -> None:
    """Furnish the root, run, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=Path, nargs="?", default=ROOT / "dist" / "liquid-study")
    parser.add_argument("--window", action="store_true", help="end after the windows of the first session")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        furnish(root, asked.bundle)
        found = [
            path for path in root.rglob("*") if PYTHON.match(path.name) and path.is_file() and os.access(path, os.X_OK)
        ]
        print(f"programs called python in the root: {len(found)}", flush=True)
        run(root, "version", "--version")
        run(root, "first session of a fresh machine", "-c", SESSION)
        if asked.window:
            return
        run(root, "second session", "-c", SESSION.replace("P001", "P002"))
        run(root, "pages of Help", "-c", HELP)
        run(root, "rehearsal", "rehearse", "demo", "--participants", "2", "--results", "/home/demo")
        run(root, "verify", "verify", "/home/demo")
        run(root, "unblind", "unblind", "/home/demo", "--by", "AB", "--reason", "a test of the bundle")
        run(root, "report", "report", "/home/demo", "--to", "/home/report")
        report = root / "home" / "report" / "report.html"
        print(f"    report.html: {report.stat().st_size / 1e3:.0f} kB", flush=True)
        run(root, "another CPU: compiles", "-c", COMPILING, "other-1", NUMBA_CPU_NAME="x86-64-v2")
        run(root, "another CPU: again", "-c", COMPILING, "other-2", NUMBA_CPU_NAME="x86-64-v2")


if __name__ == "__main__":
    main()
