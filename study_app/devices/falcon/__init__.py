"""The Novint Falcon."""
