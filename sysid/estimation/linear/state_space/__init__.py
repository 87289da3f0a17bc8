"""State spaces in innovations form: subspace starts, refined on the prediction error."""
