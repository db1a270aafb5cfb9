"""Drop-in modules: functions of potpourri3d, libigl, gdist and pygeodesic by their names, on this package."""
