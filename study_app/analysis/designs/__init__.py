"""What the blocks of a study compare: liquids, delays, factorials, and their tests.

A parameter named opened is always the rows of the table of tracks, of a block whose key is open.
"""
