"""Drop-in modules: functions of potpourri3d and of libigl under their own names, computed by this package."""
