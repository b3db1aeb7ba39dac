# Public names and where they are: read by type checkers, and by lazy_loader when the package is imported.
from .ffe import FfeBlock as FfeBlock
from .ffe import read_ffe as read_ffe
from .ffe import write_ffe as write_ffe
from .mat import write_mat as write_mat
from .measured import MeasuredCut as MeasuredCut
from .measured import read_cut as read_cut
from .polylines import polydata as polydata
from .spectra import write_sofa as write_sofa
from .spectra import write_stk as write_stk
from .spectra import write_touchstone as write_touchstone
from .tables import write_couplings as write_couplings
from .tables import write_csv as write_csv
from .tables import write_echo as write_echo
from .tables import write_paths as write_paths
from .tables import write_profile as write_profile
from .tables import write_text as write_text
from .tables import write_vtp as write_vtp
