"""Colours of lines."""

from typing import Final

# Okabe and Ito, Color Universal Design (2008), without the yellow, which is too faint on white. Neighbours
# differ in lightness too, and every series has a line style and a marker of its own.
PALETTE: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
