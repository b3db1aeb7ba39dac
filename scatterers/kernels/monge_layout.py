"""Where values stand in the flat parameters of an atlas of Monge charts, which its compiled locator shares.

Origin of the voxels, 1/side, their numbers along the axes, where the table of voxels begins, the least n.N and the
largest |2u - 1|; then `CHART` values a chart: x0, E1, E2, N, 1/w, bounds of the height. The table gives for each voxel
the place of its list of charts, which begins with its length.
"""

ORIGIN, PER_SIDE, SHAPE, VOXELS, LEAN, OUTSIDE = 0, 3, 4, 7, 8, 9
FIRST = 10
CHART = 15
# added to the score of a chart that is not valid
BEHIND = 1e3
