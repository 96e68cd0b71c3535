"""Uses numba if it is installed. Without numba all simulators and operators run in Python, which is slower."""
try:
    from numba import njit
except ImportError:
    def njit(**_):
        return lambda function: function

__all__ = ["njit"]
