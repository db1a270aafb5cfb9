from heat_igl.applications.activation import activation_times as activation_times
from heat_igl.applications.matches import geodesic_errors as geodesic_errors
from heat_igl.applications.surface_maps import Statistic as Statistic
from heat_igl.applications.surface_maps import parcel_distances as parcel_distances
from heat_igl.applications.surface_maps import smooth as smooth
