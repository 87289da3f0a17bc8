"""Surrogates as C, for compilers of C and C++ and for Arduino."""
