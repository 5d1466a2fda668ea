"""What all tests share: no screen, and caches of their own only where a test asks for them."""

import os

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
