"""What the blocks of a study compare: liquids, delays, factorials, and their tests."""
