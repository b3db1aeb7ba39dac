# Public names and where they are: read by type checkers, and by lazy_loader when the package is imported.
from .ffe import write_ffe as write_ffe
from .polylines import polydata as polydata
from .tables import write_csv as write_csv
from .tables import write_text as write_text
from .tables import write_vtp as write_vtp
