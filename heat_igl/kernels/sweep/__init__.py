"""Distance from vertex to vertex: planar unfolding over triangles, and the Hopf-Lax formula on simplices.

*Unfolding* (`heat_igl.sweep.sweep`). Two neighbours a and b of v that know their distances from one source place it
in the plane of their triangle; the distance of v is that of the straight line to it, if this line crosses ab.

- `spokes` fills a record per spoke, an edge seen from v: its length, the triangle to its left laid out flat, and
  the corner w of the triangle beyond the side ab.
- `visit_order` finds the order of the vertices as Dijkstra's algorithm does, by lengths of edges, and sorts them by
  bands of distance, without a heap.
- `sweeping` visits v: each spoke proposes a value from a and b, the best is found again with w, which is nearer to the
  source, and v keeps the least (formulas: `planar_updates.pxd`). If v falls below a vertex that came before, the sweep
  goes back to that one.

*Hopf-Lax formula* (`heat_igl.sweep.hopf_lax`). The distance of a corner v of a simplex is the least of
T(x) + |v - x| over the facet opposite, with T the distance on the facet and |v - x| in the metric of the simplex.

Distances begin with those along edges. `hopf_lax` visits vertices from near to far, then in rounds, each after those it
depends on, until no distance changes. In `simplex_updates`, the least value with T linear has a closed form, and second
differences of the square of T are found from the slopes of distance at the corners, or from the corner beyond a facet
between two metrics; `facets` has the least value with these, `simplex_metrics` inverse roots of tensors, fits around
vertices, and lengths in a velocity that is linear.
"""
