"""From points to a surface, in the order in which `mesh.neighbourhoods` and `mesh.cloud_triangles` call these kernels.

Every point has its k nearest ones, row by row, the point first; points are sorted by the leaves of a tree, so that
neighbours are near in memory. All kernels take rows, or a range of them, and share no state.

`nearest_points`
    The k nearest points of each place, by boxes around points that follow each other.
`local_fits`
    The tangent plane of each neighbourhood by principal components, and the quadric through it, onto which noisy points
    are moved.
`empty_balls`
    Where a neighbourhood is far from flat, the neighbours on the same sheet: those that share an empty ball.
`local_delaunay`
    The Delaunay triangles around each point in its plane, its star: the hull of the inverted neighbours. These keep
    their distances and the directions of their projections.
`agreeing`
    In how many stars of its corners a triangle is. Those in all three never overlap.
`fitting_triangles`
    Of the other triangles, one after the other, those that overlap none before them at a corner.
`loop_filling`
    Ears cut from loops of outer edges, in space, where no tangent plane shows a gap; first those between the fans of a
    point.
"""
