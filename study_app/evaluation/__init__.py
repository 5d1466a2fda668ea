"""What the program computes about its model: computation time, expected error, replay, fitted parameters."""
