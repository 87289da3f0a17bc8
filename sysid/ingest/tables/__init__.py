"""What every reader returns, and what its columns mean: names, units, time, states; as a description has it."""
