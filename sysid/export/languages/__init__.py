"""A language a file: MATLAB, CasADi, JAX and structured text, and what runs them for the parity gate."""
