"""Colours as the colour-blind see them (Machado, Oliveira, Fernandes 2009, full severity), and how far apart they are.

The difference is CIEDE2000 in the form of Sharma, Wu and Dalal (2005), of sRGB under D65.
"""

import numpy as np

EYES = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def linear(srgb):
    """Linear light of sRGB in 0..1."""
    srgb = np.asarray(srgb, dtype=float)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def of_hexadecimal(colours):
    """SRGB in 0..1 (n, 3) of texts such as "#0072b2"."""
    return np.array([[int(c[k : k + 2], 16) / 255 for k in (1, 3, 5)] for c in colours])


def seen(srgb, eye):
    """Linear light (..., 3) that looks to everybody as the colours look to this eye."""
    return np.clip(linear(srgb) @ EYES[eye].T, 0, 1)


def lab(light):
    """CIE L*a*b* of linear light (..., 3)."""
    ratio = np.asarray(light) @ XYZ.T / XYZ.sum(axis=1)
    f = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


def contrast(colour):
    """Contrast of a colour on white, as of WCAG."""
    return 1.05 / (float(linear(of_hexadecimal([colour])[0]) @ XYZ[1]) + 0.05)


def difference(one, other):
    """CIEDE2000 of L*a*b* (..., 3)."""
    (l1, a1, b1), (l2, a2, b2) = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    chroma7 = (0.5 * (np.hypot(a1, b1) + np.hypot(a2, b2))) ** 7
    stretch = 1.5 - 0.5 * np.sqrt(chroma7 / (chroma7 + 25.0**7))
    a1, a2 = stretch * a1, stretch * a2
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = np.degrees(np.arctan2(b1, a1)) % 360, np.degrees(np.arctan2(b2, a2)) % 360
    grey = c1 * c2 == 0
    turn = np.where(grey, 0.0, (h2 - h1 + 180) % 360 - 180)
    middle = np.where(np.abs(h1 - h2) <= 180, 0.5 * (h1 + h2), (0.5 * (h1 + h2) + 180) % 360)
    middle = np.radians(np.where(grey, h1 + h2, middle))
    l, c = 0.5 * (l1 + l2), 0.5 * (c1 + c2)  # noqa: E741
    t = (
        1
        - 0.17 * np.cos(middle - np.radians(30))
        + 0.24 * np.cos(2 * middle)
        + 0.32 * np.cos(3 * middle + np.radians(6))
        - 0.20 * np.cos(4 * middle - np.radians(63))
    )
    of_l = (l2 - l1) / (1 + 0.015 * (l - 50) ** 2 / np.sqrt(20 + (l - 50) ** 2))
    of_c = (c2 - c1) / (1 + 0.045 * c)
    of_h = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn) / 2) / (1 + 0.015 * c * t)
    rotation = np.radians(60 * np.exp(-(((np.degrees(middle) - 275) / 25) ** 2)))
    mixed = -np.sin(rotation) * 2 * np.sqrt(c**7 / (c**7 + 25.0**7))
    return np.sqrt(of_l**2 + of_c**2 + of_h**2 + mixed * of_c * of_h)
