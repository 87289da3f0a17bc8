"""A surrogate as few wide products: the terms of each stage, tables over them, and the whole."""
