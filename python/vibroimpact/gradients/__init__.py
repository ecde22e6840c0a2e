"""Gradients of functions of a run, by parameters of its machine and by its start."""

from .call import gradient

__all__ = ["gradient"]
