"""Kernels into other languages: read once for given types, printed as C99."""
