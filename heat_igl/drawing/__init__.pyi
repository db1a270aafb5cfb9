from heat_igl.drawing.plots import Page as Page
from heat_igl.drawing.plots import Picture as Picture
from heat_igl.drawing.plots import page as page
from heat_igl.drawing.plots import plot as plot
from heat_igl.drawing.plots import plot_field as plot_field
from heat_igl.drawing.plots import plot_labels as plot_labels
