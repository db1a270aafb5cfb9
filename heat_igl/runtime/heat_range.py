"""The range of double precision that heat is kept in: the first and last values, and how far heat reaches between them.

Heat falls by a constant factor over each length, so the distance that it crosses before it underflows is the logarithm
of this range.
"""

from __future__ import annotations

# Largest heat at a source, in units of h. Doubles end at 1.8e308: 18 decades are left for gradients, which are heat
# divided by the height of a triangle, 1e-8 h at least after mollification, and for sums over faces.
SOURCE_HEAT = 1e290
# Heat, and gradients of it, below this have lost digits to gradual underflow, which begins at 2.2e-308: the difference
# of two numbers above it still has 8 decades, and so a direction.
LOWEST_HEAT = 1e-300
# How many e-foldings heat may fall on the way across a domain: log(SOURCE_HEAT / LOWEST_HEAT) = 1358, less a margin of
# 58 for the first step away from the source, where heat falls faster, and for the amplitude of a front that spreads.
RANGE_LIMIT = 1300.0
# cosh and exp of more than 709.8 overflow.
LARGEST_EXPONENT = 700.0
