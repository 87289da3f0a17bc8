"""Reference physics: command vector in, traces of a compiled air-brake model out."""
