"""A file of which nothing is known: what it holds, what that has to deal with, and a description of it."""
