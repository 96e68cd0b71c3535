"""Numba where it is installed; without it every simulator and operator runs as it is, only slower."""
try:
    from numba import njit
except ImportError:
    def njit(**_):
        return lambda function: function

__all__ = ["njit"]
