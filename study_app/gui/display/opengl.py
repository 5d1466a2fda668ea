"""Whether there is a graphics card to draw with: only then is an OpenGL surface quicker than painting in software."""

from functools import cache
from typing import Final

from PySide6.QtGui import QGuiApplication, QOffscreenSurface, QOpenGLContext

GL_RENDERER: Final = 0x1F01
IN_SOFTWARE: Final = ("llvmpipe", "softpipe", "swrast", "swiftshader", "gdi generic", "software", "basic render")
WITHOUT_OPENGL: Final = {"offscreen", "minimal", "vnc", "linuxfb"}


@cache
def renderer() -> str | None:
    """Return what OpenGL draws with here, as it names itself; None where there is no OpenGL."""
    if QGuiApplication.platformName() in WITHOUT_OPENGL:
        return None
    context = QOpenGLContext()
    if not context.create():
        return None
    surface = QOffscreenSurface()
    surface.create()
    if not context.makeCurrent(surface):
        return None
    try:
        return str(context.functions().glGetString(GL_RENDERER))
    finally:
        context.doneCurrent()


def has_card() -> bool:
    """Return whether OpenGL draws with a graphics card here, and not in software."""
    name = renderer()
    return name is not None and not any(word in name.lower() for word in IN_SOFTWARE)
