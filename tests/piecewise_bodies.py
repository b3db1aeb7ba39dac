"""Exact bodies of smooth pieces for tests, by numpy methods alone: their levels are those of the nearest piece."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Line:
    kind: str
    pieces: tuple
    points: np.ndarray


class Ball:
    """|x - c| - R, with its derivatives."""

    def __init__(self, centre=(0, 0, 0), radius=1.0):
        self.centre, self.radius = np.array(centre, float), radius
        self.bounds = np.array([self.centre - radius, self.centre + radius])

    def level(self, x):
        return np.linalg.norm(x - self.centre, axis=-1) - self.radius

    def gradient(self, x):
        v = x - self.centre
        return v / np.linalg.norm(v, axis=-1, keepdims=True)

    def hessian(self, x):
        v = x - self.centre
        r = np.linalg.norm(v, axis=-1)[..., None, None]
        n = v / r[..., 0]
        return (np.eye(3) - n[..., :, None] * n[..., None, :]) / r


class Plane:
    def __init__(self, normal, offset, bounds):
        self.normal, self.offset, self.bounds = np.array(normal, float), offset, np.array(bounds, float)

    def level(self, x):
        return x @ self.normal - self.offset

    def gradient(self, x):
        return np.broadcast_to(self.normal, x.shape).copy()

    def hessian(self, x):
        return np.zeros((*x.shape, 3))


class Pieced:
    """Union or intersection of pieces by ``choice`` (np.argmax or np.argmin over the levels), or by ``piece``."""

    choice = staticmethod(lambda levels: np.argmax(levels, axis=-1))

    def __init__(self, pieces, creases, bounds, profile):
        self.pieces, self.creases, self.bounds = tuple(pieces), tuple(creases), np.array(bounds, float)
        # piece numbers and generators (r, z), bottom first: triangles are those of a body of revolution
        self.profile = profile
        self.atlas = None

    def piece(self, x):
        return self.choice(np.stack([p.level(x) for p in self.pieces], axis=-1))

    def _picked(self, x, name):
        number = self.piece(x)
        every = [getattr(p, name)(x) for p in self.pieces]
        out = np.array(every[0])
        for k, one in enumerate(every):
            out[number == k] = one[number == k]
        return out

    def level(self, x):
        return self._picked(np.asarray(x, float), "level")

    def gradient(self, x):
        with np.errstate(all="ignore"):
            return self._picked(np.asarray(x, float), "gradient")

    def hessian(self, x):
        with np.errstate(all="ignore"):
            return self._picked(np.asarray(x, float), "hessian")

    def parameters(self, x):
        return np.stack([np.arctan2(np.hypot(x[..., 0], x[..., 1]), x[..., 2]), np.arctan2(x[..., 1], x[..., 0])], -1)

    def tiles(self, edge):
        corners, numbers = [], []
        for number, generator in self.profile:
            count = max(2, int(np.ceil(generator.length / edge)) + 1)
            rz = generator(np.linspace(0, 1, count))
            around = max(8, int(np.ceil(2 * np.pi * rz[:, 0].max() / edge)))
            angle = 2 * np.pi * (np.arange(around + 1) / around + 0.0123)
            z = np.broadcast_to(rz[:, 1:], (count, around + 1))
            x = np.stack([rz[:, :1] * np.cos(angle), rz[:, :1] * np.sin(angle), z], axis=-1)
            a, b, c, d = x[:-1, :-1], x[:-1, 1:], x[1:, 1:], x[1:, :-1]
            both = np.concatenate([np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)])
            area = np.linalg.norm(np.cross(both[:, 1] - both[:, 0], both[:, 2] - both[:, 0]), axis=1)
            both = both[area > 1e-9 * edge**2]
            corners.append(both)
            numbers.append(np.full(len(both), number))
        corners, numbers = np.concatenate(corners), np.concatenate(numbers)
        normals = np.empty_like(corners)
        for k, one in enumerate(self.pieces):
            mine = numbers == k
            # a hair towards the middle: at a tip there is no normal
            inside = corners[mine] + 1e-9 * (corners[mine].mean(axis=1, keepdims=True) - corners[mine])
            g = one.gradient(inside)
            normals[mine] = g / np.linalg.norm(g, axis=-1, keepdims=True)
        return corners, normals, numbers


class Arc:
    """Generator on a circle about (0, z0), from angle a to angle b from the axis -z: (r, z)."""

    def __init__(self, z0, radius, a, b):
        self.z0, self.radius, self.a, self.b = z0, radius, a, b
        self.length = radius * abs(b - a)

    def __call__(self, t):
        angle = self.a + t * (self.b - self.a)
        return np.stack([self.radius * np.sin(angle), self.z0 - self.radius * np.cos(angle)], axis=-1)


class Straight:
    def __init__(self, a, b):
        self.a, self.b = np.array(a, float), np.array(b, float)
        self.length = np.linalg.norm(self.b - self.a)

    def __call__(self, t):
        return self.a + t[:, None] * (self.b - self.a)


def ring(radius, z, count=257):
    angle = np.linspace(0, 2 * np.pi, count)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, z)], axis=-1)


def cut_sphere(z=0.5):
    """Unit ball below a flat cap at height z: pieces 0 (ball) and 1 (plane)."""
    rim = np.sqrt(1 - z * z)
    box = [[-1, -1, -1], [1, 1, z]]
    profile = [(0, Arc(0.0, 1.0, 0.0, np.pi - np.arccos(z))), (1, Straight((rim, z), (0, z)))]
    return Pieced([Ball(), Plane((0, 0, 1), z, box)], [Line("edge", (0, 1), ring(rim, z))], box, profile)


class TwoBalls(Pieced):
    """Union of two unit balls with centres at z = +-c: a concave edge at z = 0."""

    def __init__(self, c=0.7):
        rim = np.sqrt(1 - c * c)
        box = [[-1, -1, -1 - c], [1, 1, 1 + c]]
        angle = np.arccos(-c)
        profile = [(0, Arc(-c, 1.0, 0.0, angle)), (1, Arc(c, 1.0, np.pi - angle, np.pi))]
        super().__init__([Ball((0, 0, -c)), Ball((0, 0, c))], [Line("edge", (0, 1), ring(rim, 0.0))], box, profile)

    def piece(self, x):
        return np.where(x[..., 2] < 0, 0, 1)


class SplitBall(Pieced):
    """Unit ball of two halves: a joint at z = 0 across which nothing changes."""

    def __init__(self):
        box = [[-1, -1, -1], [1, 1, 1]]
        profile = [(0, Arc(0, 1.0, 0.0, np.pi / 2)), (1, Arc(0, 1.0, np.pi / 2, np.pi))]
        super().__init__([Ball(), Ball()], [Line("joint", (0, 1), ring(1.0, 0.0))], box, profile)

    def piece(self, x):
        return np.where(x[..., 2] < 0, 0, 1)
