"""A model in, a bundle of files that run elsewhere out, each checked against the model."""
