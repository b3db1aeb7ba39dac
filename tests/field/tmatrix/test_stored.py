"""T-matrices as files: round trips, files of treams, and files that are none."""

from pathlib import Path

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.results.far_result import spherical_frame

h5py = pytest.importorskip("h5py")
CLUSTER = Path(__file__).parent / "treams_cluster.tmat.h5"
"""Two spheres of permittivity 4 and 6, k = 1.3, order 4, written by treams 0.4.7."""


@pytest.fixture(name="T", scope="module", params=["soft", pytest.param("pec", marks=pytest.mark.slow)])
def of_an_ellipsoid(request):
    return cr.t_matrix(sc.Ellipsoid(0.5, 0.4, 0.3), wavenumber=2.0, boundary=request.param, center=(0.1, 0.0, 0.2))


def test_a_round_trip_keeps_all(T, tmp_path):
    path = tmp_path / "body.tmat.h5"
    T.save(path)
    back = cr.TMatrix.load(path)
    assert np.array_equal(back.matrix, T.matrix) and np.array_equal(back.center, T.center)
    names = ("wavenumber", "boundary", "vector", "body", "extinction", "absorbing", "unit")
    assert all(getattr(back, name) == getattr(T, name) for name in names) and repr(back) == repr(T)


def test_the_layout_is_that_of_treams(T, tmp_path):
    path = tmp_path / "body.tmat.h5"
    T.save(path)
    with h5py.File(path) as file, h5py.File(CLUSTER) as other:
        assert file["angular_vacuum_wavenumber"].attrs["unit"] == "m^{-1}"
        assert set(file["modes"]) == {"l", "m", "positions", *["polarization"] * T.vector}
        assert set(other["modes"]) - set(file["modes"]) <= {"polarization"}
        assert file["embedding/relative_permittivity"][()] == file["embedding/relative_permeability"][()] == 1
        if T.vector:
            n = 2 * T.order * (T.order + 2)
            count = min(n, len(other["modes/l"]))
            for name in ("l", "m", "polarization"):
                assert list(file[f"modes/{name}"][:count]) == list(other[f"modes/{name}"][:count])
                assert file[f"modes/{name}"].shape == (n,)


def test_a_cluster_by_treams_scatters_as_there():
    T = cr.TMatrix.load(CLUSTER)
    assert T.vector and T.order == 4 and T.wavenumber == 1.3 and T.reciprocity < 1e-3
    # treams: plane wave with E0 = (0.8, 0, -0.6), field at a distance of 1e6
    d, r = np.array([0.48, 0.6, 0.64]), np.array([-0.36, 0.48, 0.8])
    want = np.array(
        [
            0.10444994883479976 + 0.009631193078239968j,
            0.07363140695166967 + 0.007249013499593412j,
            0.0028236110378705315 - 1.5077318657651804e-05j,
        ]
    )
    f = spherical_frame(r).T @ T.bistatic(d, r).values[0, 0] @ spherical_frame(d) @ np.array([0.8, 0, -0.6])
    assert np.abs(f - want).max() < 1e-6
    averages = T.orientation_average()
    assert averages.scattering == pytest.approx(0.22334801096863374, rel=1e-9)
    assert averages.extinction == pytest.approx(0.22334810900161392, rel=1e-9)


def test_waves_in_another_order_are_put_in_place(T, tmp_path):
    path = tmp_path / "body.tmat.h5"
    T.save(path)
    with h5py.File(path, "r+") as file:
        turn = np.random.default_rng(1).permutation(len(T.matrix))
        for name in ("l", "m", "polarization")[: 2 + T.vector]:
            file[f"modes/{name}"][...] = file[f"modes/{name}"][()][turn]
        file["tmatrix"][...] = T.matrix[np.ix_(turn, turn)]
    assert np.array_equal(cr.TMatrix.load(path).matrix, T.matrix)


def changed(T, path, name, values):
    T.save(path)
    with h5py.File(path, "r+") as file:
        if name in file:
            del file[name]
        if values is not None:
            file[name] = values


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("tmatrix", None, "no tmatrix"),
        ("tmatrix", np.zeros((2, 3, 3)), "one matrix"),
        ("tmatrix", np.full((3, 3), np.nan), "waves there"),
        ("modes/l", np.zeros(4, dtype=int), "waves there"),
        ("modes/l", h5py.SoftLink("/modes/m"), "of its own"),
        ("tmatrix", h5py.ExternalLink("/etc/passwd", "x"), "of its own"),
        ("modes/positions", np.zeros((2, 3)), "2 centres"),
        ("angular_vacuum_wavenumber", np.nan, "no positive number"),
        ("angular_vacuum_wavenumber", np.ones(3), "is of one"),
        ("angular_vacuum_wavenumber", None, "no angular_vacuum_wavenumber"),
        ("embedding/relative_permittivity", 2.25, "empty space"),
    ],
)
def test_what_is_no_t_matrix_is_refused(T, tmp_path, name, values, words):
    path = tmp_path / "bad.tmat.h5"
    changed(T, path, name, values)
    with pytest.raises(cr.CreepingError, match=words):
        cr.TMatrix.load(path)


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "words.h5"
    path.write_text("no HDF5")
    for bad in (path, tmp_path / "nothing.h5"):
        with pytest.raises(cr.CreepingError, match="can be read"):
            cr.TMatrix.load(bad)


def test_degrees_beyond_belief_are_refused(T, tmp_path):
    path = tmp_path / "bad.tmat.h5"
    changed(T, path, "modes/l", np.full(len(T.matrix), 10**9))
    with pytest.raises(cr.InvalidInputError, match="degrees"):
        cr.TMatrix.load(path)


def test_helicity_is_refused_with_a_remedy(tmp_path):
    T = cr.TMatrix.load(CLUSTER)
    path = tmp_path / "bad.tmat.h5"
    changed(T, path, "modes/polarization", ["positive", "negative"] * (len(T.matrix) // 2))
    with pytest.raises(cr.InvalidInputError, match="changepoltype"):
        cr.TMatrix.load(path)


def test_treams_reads_and_writes_it(tmp_path):
    treams = pytest.importorskip("treams", exc_type=ImportError)
    io = pytest.importorskip("treams.io", exc_type=ImportError)
    T = cr.t_matrix(sc.Ellipsoid(0.5, 0.4, 0.3), wavenumber=2.0, boundary="pec")
    T.save(tmp_path / "one.tmat.h5")
    there = io.load_hdf5(str(tmp_path / "one.tmat.h5"), lunit="m")
    assert isinstance(there, treams.TMatrix) and there.k0 == 2.0 and there.poltype == "parity"
    assert there.xs_sca_avg == pytest.approx(T.orientation_average().scattering, rel=1e-9)
    assert there.xs_ext_avg == pytest.approx(T.orientation_average().extinction, rel=1e-9)
    with h5py.File(tmp_path / "two.tmat.h5", "w") as file:
        io.save_hdf5(file, [there], lunit="m")
    assert np.array_equal(cr.TMatrix.load(tmp_path / "two.tmat.h5").matrix, T.matrix)


def test_acoustotreams_takes_it(tmp_path):
    acoustotreams = pytest.importorskip("acoustotreams", exc_type=ImportError)
    T = cr.t_matrix(sc.Ellipsoid(0.5, 0.4, 0.3), wavenumber=2.0, boundary="hard")
    basis = acoustotreams.ScalarSphericalWaveBasis.default(T.order)
    there = acoustotreams.AcousticTMatrix(T.matrix, k0=2.0, basis=basis)
    assert there.xs_sca_avg == pytest.approx(T.orientation_average().scattering, rel=1e-9)
