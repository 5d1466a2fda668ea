"""Output to other programs while a session runs: markers of its events, and the servo's samples."""
