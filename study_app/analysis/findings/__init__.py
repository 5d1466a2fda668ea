"""Results of the analysis as typed values, with the words for them."""
