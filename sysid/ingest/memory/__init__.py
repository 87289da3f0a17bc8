"""What is in memory already, made to traces as files are: frames, arrays, inputs of a free run."""
