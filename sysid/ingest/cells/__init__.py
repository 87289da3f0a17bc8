"""What cells and headers of text say: numbers, dates, words, units, and what stands for nothing."""
