from heat_igl.sampling.dual import dual_triangulation as dual_triangulation
from heat_igl.sampling.extent import diameter as diameter
from heat_igl.sampling.extent import distance_matrix as distance_matrix
from heat_igl.sampling.farthest import farthest_cells as farthest_cells
from heat_igl.sampling.farthest import farthest_points as farthest_points
from heat_igl.sampling.queries import as_solver as as_solver
from heat_igl.sampling.voronoi import VoronoiCells as VoronoiCells
from heat_igl.sampling.voronoi import voronoi_cells as voronoi_cells
