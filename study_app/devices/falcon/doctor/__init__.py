"""The diagnosis of a Falcon."""
