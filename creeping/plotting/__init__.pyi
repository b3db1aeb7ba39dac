# Public names and where they are: read by type checkers, and by lazy_loader when the package is imported.
from .coloured_body import currents_picture as currents_picture
from .coloured_body import decay_picture as decay_picture
from .coloured_body import surface_field_picture as surface_field_picture
from .coupling_pictures import coupling_picture as coupling_picture
from .echo_pictures import averages_picture as averages_picture
from .echo_pictures import comparison_picture as comparison_picture
from .echo_pictures import echo_picture as echo_picture
from .echo_pictures import range_picture as range_picture
from .far_cuts import far_cut_picture as far_cut_picture
from .line_plots import parameter_picture as parameter_picture
from .line_plots import plot_line as plot_line
from .pictures import picture as picture
from .plane_pictures import field_cut_picture as field_cut_picture
from .scene import GLProbe as GLProbe
from .scene import gl_available as gl_available
