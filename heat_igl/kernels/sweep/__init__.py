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

*Hopf-Lax formula* (`heat_igl.sweep.hopf_lax`). The distance at a corner v of a simplex is the minimum of
T(x) + |v - x| over the opposite facet, with T the distance on the facet and |v - x| in the metric of the simplex.

- `hopf_lax` begins with lengths of paths along edges, and updates vertices by distance, then in sweeps in the order of
  their dependencies, until nothing changes.
- `simplex_updates` updates a vertex in one simplex: in closed form for linear T, or with second differences of T^2 that
  come from gradients at the corners of the facet; `adjacent_updates` in two, through a facet between two metrics.
- `facets` minimizes over a facet with second differences.
- `simplex_metrics` has inverse roots of tensors, fits around vertices, and lengths in a linear velocity.
- `error_estimate` finds how far the gradients contradict the distances.
"""
