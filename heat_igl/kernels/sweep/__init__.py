"""Distance in the order of a front: by triangles unfolded in pairs, and by simplices with metrics of their own."""
