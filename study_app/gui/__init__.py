"""The windows of operator and participant."""
