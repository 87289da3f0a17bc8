"""What a surrogate is made of before any language: stages, their state, numbers and operations."""
