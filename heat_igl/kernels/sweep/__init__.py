"""Distance from vertex to vertex, in an order that is found on the way.

On the triangles of a surface, one pass (`sweeping`): a vertex takes the least that its triangles and those beyond them
say (`planar_updates.pxd`), from tables of spokes (`half_edges`), in the order of a front of its own (`front_order`, and
the queue in bands `front_queue.pxd`).

On simplices in a metric that changes, the Hopf-Lax formula (`hopf_lax`): first order in the order of Dijkstra's
algorithm, then second order until nothing changes. `facets` finds the least value over one facet.
"""
