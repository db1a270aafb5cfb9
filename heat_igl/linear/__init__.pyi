from heat_igl.linear.backends import Backend as Backend
from heat_igl.linear.backends import analyse as analyse
from heat_igl.linear.backends import factorize as factorize
from heat_igl.linear.protocols import Analysis as Analysis
from heat_igl.linear.protocols import Factorization as Factorization
