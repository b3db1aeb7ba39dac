"""Tolerances of the tests, per quantity, each with its reason."""

TRACE = 1e-10
"""(x, p) after a length of a few units, traced at rtol 1e-12: the steps' errors add up."""
INVARIANT = 1e-10
"""Drift of a conserved quantity along a ray traced at rtol 1e-12."""
TWIN = 1e-11
"""Compiled against numpy: the same arithmetic in another order, steps chosen alike."""
JACOBI_DIFFERENCE = 1e-7
"""J against a central difference of step 1e-5 of traced rays: rounding 1e-11 over the step."""
MAP = 1e-6
"""Rms error of one g_T0 of a map built with that tolerance."""
COMPOSED = 2e-5
"""Error after eight units of length, composed from maps of 1e-6 each, the bodies' own growth included."""
LINE_LENGTH = 1e-8
"""Length of a shadow line against published digits."""
FRACTION = 1e-6
"""Share of a shadow line by status."""
SPREADING = 1e-4
"""J of a fan against finite differences across neighbouring rays, relative, before the first caustic."""
ORDER = 0.3
"""Fitted slope of an error against the expected order."""
PRINTED = 2e-8
"""Tables of Fock functions and roots printed to eight decimals."""
MODE = 1e-11
"""Roots of the Airy functions against scipy's zeros: its own digits."""
FOCK_SEAM = 2e-8
"""Jump of a Fock function of order 1 between two ways of computing it, ten modes being the worst of them."""
FOCK_TABLE = 1e-7
"""Splines of a Fock function and of two derivatives of it, relative, or absolute below 1."""
DIFFERENCE = 1e-6
"""A derivative against a central difference of fourth order with step 1e-3: table noise of 1e-9 over the step."""
ALONG_RAY = 1e-8
"""Curvatures, J and integrals along a ray of a fan traced at rtol 1e-12, steps re-traced at 1e-11."""
CURVATURE_BEND = 1e-5
"""ρ' from splines of degree 7 over steps of 0.1 rad against differences; ten times that for ρρ''."""
STRIP = 1e-6
"""(x, p) of a strip of a hundred rays of the triaxial ellipsoid, splines of degree 5 across them."""
STRIP_SLOPE = 3e-5
"""Slopes of a spline against central differences of step 1e-4, where rays detach third derivatives reach 1e4."""
SHED = 1e-6
"""A ray found by a search, in radians and body sizes: the splines' error, the search itself ends at 1e-9."""
SPECULAR = 1e-9
"""Specular points against closed forms: ten times the residual of the normal at which the search ends."""
SHAPE_TERM = 0.05
"""Λ of a specular point: a fourth derivative differenced over 0.05 radii of curvature, 0.6 % off on a sphere."""
