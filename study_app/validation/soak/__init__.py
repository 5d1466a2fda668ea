"""The servo for hours or days, in every fault there is, and what drifted, leaked or broke."""
