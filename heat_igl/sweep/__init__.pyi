from heat_igl.sweep.hopf_lax import HopfLaxEngine as HopfLaxEngine
from heat_igl.sweep.hopf_lax import engine_through as engine_through
from heat_igl.sweep.lines import LineEngine as LineEngine
from heat_igl.sweep.sweep import SweepEngine as SweepEngine
