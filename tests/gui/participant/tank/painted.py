"""What a tank looks like, as numbers."""

import numpy as np
from PySide6.QtGui import QImage

from study_app.gui.participant.tank_widget import TankWidget


def pixels(image: QImage) -> np.ndarray:
    """Return an image as (height, width, 3) of 0 … 255."""
    image = image.convertToFormat(QImage.Format.Format_RGB32)
    flat = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    return flat[:, : image.width(), :3].copy()


def shown(widget: TankWidget) -> np.ndarray:
    return pixels(widget.grab().toImage())
