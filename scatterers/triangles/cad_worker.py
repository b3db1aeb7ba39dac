"""What gmsh says of a CAD file, in a process of its own: ``python -P cad_worker.py FILE POINTS OUT [CURVED [SEW]]``.

gmsh keeps its state in the library, prints as it likes, and may end the process on a hostile file or where libraries
of the system are missing. With CURVED, triangles are smaller where faces curve: so many to a full turn;
with SEW, faces that far apart are sewn first. Lengths are in
millimetres, to which it brings files that state their unit. OUT (npz): ``nodes`` (n,) and ``points`` (n, 3);
``triangles`` (m, 3) of node numbers and ``of`` (m,), their faces; of each node on each face ``at`` (k,), ``face`` (k,),
``normals`` (k, 3); of each face of a solid ``bounds`` (j, 2), face and solid.
"""

import sys

import numpy as np


def main(path: str, points: int, out: str, curved: int = 0, sew: float = 0.0) -> None:
    """Mesh the faces of the file and write what is found."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.importShapes(path)
    if sew > 0:
        gmsh.model.occ.healShapes(tolerance=sew, sewFaces=True, makeSolids=True)
    gmsh.model.occ.synchronize()
    faces = [tag for _, tag in gmsh.model.getEntities(2)]
    if not faces:
        raise SystemExit("it holds no faces")
    area = sum(gmsh.model.occ.getMass(2, tag) for tag in faces)
    # a mesh of equilateral triangles has area/(0.866 edge^2) vertices
    edge = float(np.sqrt(area / (0.866 * points)))
    # smaller where faces curve, down to an eighth
    for option, value in (
        ("Mesh.MeshSizeMin", edge / 8.0 if curved else edge),
        ("Mesh.MeshSizeMax", edge),
        ("Mesh.MeshSizeFromPoints", 0),
        ("Mesh.MeshSizeExtendFromBoundary", 0),
        ("Mesh.MeshSizeFromCurvature", curved),
    ):
        gmsh.option.setNumber(option, value)
    gmsh.model.mesh.generate(2)
    nodes, coordinates, _ = gmsh.model.mesh.getNodes()
    triangles, of, at, face, normals, bounds = [], [], [], [], [], []
    for tag in faces:
        for kind, _, members in zip(*gmsh.model.mesh.getElements(2, tag), strict=True):
            # 2 is gmsh's number of the flat triangle
            if kind == 2:
                triangles.append(np.asarray(members).reshape(-1, 3))
                of.append(np.full(len(triangles[-1]), tag))
        bounds += [(tag, int(solid)) for solid in gmsh.model.getAdjacencies(2, tag)[0]]
        own, _, parameters = gmsh.model.mesh.getNodes(2, tag, includeBoundary=True, returnParametricCoord=True)
        at.append(own)
        face.append(np.full(len(own), tag))
        normals.append(np.asarray(gmsh.model.getNormal(tag, parameters)).reshape(-1, 3))
    np.savez(
        out,
        nodes=np.asarray(nodes, dtype=np.int64),
        points=np.asarray(coordinates).reshape(-1, 3),
        triangles=np.concatenate(triangles or [np.zeros((0, 3))]).astype(np.int64),
        of=np.concatenate(of or [np.zeros(0)]).astype(np.int64),
        at=np.concatenate(at).astype(np.int64),
        face=np.concatenate(face).astype(np.int64),
        normals=np.concatenate(normals),
        bounds=np.array(bounds, dtype=np.int64).reshape(-1, 2),
    )
    gmsh.finalize()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3], *map(int, sys.argv[4:5]), *map(float, sys.argv[5:6]))
