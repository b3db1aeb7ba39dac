# Public names and where they are: read by type checkers, and by lazy_loader when the package is imported.
from .coloured_body import currents_picture as currents_picture
from .display import GLProbe as GLProbe
from .display import gl_available as gl_available
from .far_cuts import far_cut_picture as far_cut_picture
from .field_pictures import decay_picture as decay_picture
from .field_pictures import surface_field_picture as surface_field_picture
from .parameter_plane import plot_parameters as plot_parameters
from .pictures import parameter_picture as parameter_picture
from .pictures import picture as picture
