from heat_igl.validation import closed_forms as closed_forms
from heat_igl.validation import metrics as metrics
from heat_igl.validation.comparison import METHODS as METHODS
from heat_igl.validation.comparison import draw_sources as draw_sources
from heat_igl.validation.comparison import validate as validate
from heat_igl.validation.metrics import relative_error as relative_error
from heat_igl.validation.report import ValidationReport as ValidationReport
from heat_igl.validation.report import ValidationRow as ValidationRow
