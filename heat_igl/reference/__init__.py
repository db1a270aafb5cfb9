"""Distances to compare with: exact ones, those of other people's solvers, and bounds.

Every native solver runs in a child process. `docs/references.md` says how far each one can be trusted. Closed forms are
in `heat_igl.validation.closed_forms`.

Examples
--------
>>> import heat_igl
>>> heat_igl.reference.exact(heat_igl.shapes.strip(4, 3), 0)[[4, 15, 19]].round(6).tolist()
[4.0, 3.0, 5.0]
"""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
