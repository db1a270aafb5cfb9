"""Triangulations known by edge lengths: flips and their history, mollification, the tufted cover, fans of angles."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
