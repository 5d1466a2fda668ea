"""Results of an evaluation as typed values, the words for them, and what a finding says of itself."""
