"""From points to a surface, in the order in which `mesh.neighbourhoods` and `mesh.cloud_triangles` call these kernels.

A row holds a point and its k nearest points. Points are sorted by the leaves of a tree, so that neighbours are near in
memory. Kernels work on a range of rows and share no state.

`local_fits`
    The tangent plane of each neighbourhood by principal components, and the quadric through it, onto which noisy points
    are moved.
`empty_balls`
    The neighbours on the same sheet, for neighbourhoods far from flat: those that share an empty ball with the point.
`local_delaunay`
    The star of each point: the Delaunay triangles around it in its tangent plane, from the convex hull of the inverted
    neighbours. Neighbours are projected so that they keep their distances.
`fitting_triangles`
    Adds the other triangles one by one, if they overlap no triangle at a common corner.
`loop_filling`
    Fills gaps by cutting ears from loops of outer edges in space, first those between the fans of a point; says where
    one of the nearest points is many edges away.
"""
