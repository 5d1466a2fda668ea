"""What the blocks of a study compare: liquids, delays, factorials, and their tests.

``opened`` are always the rows of `tracks` of a block whose key is open.
"""
