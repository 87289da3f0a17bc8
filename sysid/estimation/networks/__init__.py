"""Networks: NARX and neural state spaces, from one-step pretraining to free-run training of a whole system."""
