#!/usr/bin/env python3
"""Makes crates/fiber/src/model/fur/table.bin: how the medulla of a fiber scatters light.

A smooth cylinder of radius 1 and index 1.55 holds a concentric medulla of radius kappa that scatters with
Henyey and Greenstein's phase function and refracts nothing. For every cell of a grid in

    kappa          radius of the medulla
    tau            its optical radius, scattering coefficient times kappa
    g              anisotropy
    x              offset of the entering ray, 1 where it only just touches the medulla (or the rim of the fiber)
    s              sine of the inclination outside

photons are followed that enter without absorption and are scattered on their first way through the medulla.
What leaves is sorted in two: light that leaves the first time it reaches the surface, and the rest, which was
reflected inside at least once. For each: the mean direction around the fiber, the spherical Gaussian with the same
first two moments along it, and how absorption would have dimmed it. The columns are described where they are made,
in `columns`.

    python3 fur_table.py part 0 4 /tmp/part0.npy   # one of 4 parts of the work, below a minute each
    python3 fur_table.py join 4 /tmp/part%d.npy ../src/model/fur/table.bin

Needs numpy 2. The same input gives the same table: every part has its own fixed seed.
"""

import sys

import numpy as np

ETA = 1.55
KAPPA = np.array([0.1, 0.35, 0.6, 0.8, 0.95])
TAU = 0.05 * (16 / 0.05) ** (np.arange(6) / 5)
G = np.array([-0.6, 0.0, 0.4, 0.7, 0.9])
X = np.array([0.0, 0.25, 0.5, 0.75, 0.99])
S = np.array([0.0, 1 / 3, 2 / 3, 0.999])
SHAPE = (5, 6, 5, 5, 4)

# Absorption at which the dimming is recorded, per fiber radius; the gamma law is fitted to go through both.
WEAK, STRONG, BOTH = 0.25, 1.5, 0.5

# Value of 0 and of 65535, column by column; the Rust side has the same numbers.
SET = [(-1, 1), (-1, 1), (-1.25, 1.25), (0, 1), (0, 3), (0, 8), (0, 4), (0, 8), (-1.5, 2.5)]
RANGES = [(0, 1)] + SET + SET


def fresnel(cos_t, eta):
    """Reflectance seen from inside, at the cosine inside."""
    sin2_i = eta * eta * (1 - cos_t * cos_t)
    cos_i = np.sqrt(np.maximum(0, 1 - sin2_i))
    s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    return np.where(sin2_i >= 1, 1.0, 0.5 * (s * s + p * p)), cos_i


def scatter(rng, u, g):
    """A new direction by Henyey and Greenstein."""
    xi = rng.random(len(g))
    flat = np.abs(g) < 1e-3
    safe = np.where(flat, 1.0, g)
    t = (1 - safe * safe) / (1 - safe + 2 * safe * xi)
    c = np.clip(np.where(flat, 2 * xi - 1, (1 + safe * safe - t * t) / (2 * safe)), -1, 1)
    sine = np.sqrt(1 - c * c)
    turn = 2 * np.pi * rng.random(len(g))
    a, b = sine * np.cos(turn), sine * np.sin(turn)
    # A frame without branches around u (Duff et al. 2017).
    sign = np.where(u[2] < 0, -1.0, 1.0)
    k = -1 / (sign + u[2])
    m = u[0] * u[1] * k
    out = np.stack([
        a * (1 + sign * u[0] * u[0] * k) + b * m + c * u[0],
        a * sign * m + b * (sign + u[1] * u[1] * k) + c * u[1],
        -a * sign * u[0] - b * u[1] + c * u[2],
    ])
    return out / np.sqrt((out * out).sum(0))


def chord(p, u, radius, enter):
    """Length to the cylinder of this radius: its near side from outside, its far side from inside."""
    across2 = np.maximum(u[1] ** 2 + u[2] ** 2, 1e-18)
    b = p[0] * u[1] + p[1] * u[2]
    root = np.sqrt(np.maximum(0, b * b - across2 * (p[0] ** 2 + p[1] ** 2 - radius**2)))
    return np.maximum(0, (-b - root if enter else -b + root) / across2)


def trace(rng, kappa, tau, g, x, s, eta=ETA, limit=4000):
    """Yields (photon, first, weight, phi, sin_theta, cortex, medulla) per arrival; phi is relative to the
    straight way through, cortex and medulla are lengths, the cortex before the medulla left out."""
    n = len(kappa)
    sigma = tau / kappa
    cos = np.sqrt(1 - s * s)
    bravais = np.sqrt(eta * eta - s * s) / cos
    h = x * np.minimum(1, kappa * bravais)
    gamma_i, gamma_t = np.arcsin(h), np.arcsin(h / bravais)
    straight = 2 * gamma_t - 2 * gamma_i + np.pi
    azimuth = np.pi - gamma_i + gamma_t
    sin_t = -s / eta
    cos_t = np.sqrt(1 - sin_t**2)
    u = np.stack([sin_t, cos_t * np.cos(azimuth), cos_t * np.sin(azimuth)])
    p = np.stack([np.cos(gamma_i), -np.sin(gamma_i)])
    to = chord(p, u, kappa, True)
    p = p + to * u[1:]
    # The first flight ends inside the medulla: an exponential cut at the chord.
    way = chord(p, u, kappa, False)
    xi = rng.random(n)
    flight = np.minimum(-np.log1p(xi * np.expm1(-sigma * way)) / sigma, way)
    p = p + flight * u[1:]
    u = scatter(rng, u, g)
    medulla, cortex = flight, np.zeros(n)
    first = np.ones(n, bool)
    who = np.arange(n)
    for _ in range(limit):
        if len(who) == 0:
            return
        way = chord(p, u, kappa, False)
        flight = rng.standard_exponential(len(who)) / sigma
        inside = flight < way
        step = np.where(inside, flight, way)
        p = p + step * u[1:]
        medulla = medulla + step
        u[:, inside] = scatter(rng, u[:, inside], g[inside])
        out = np.nonzero(~inside)[0]
        if len(out) == 0:
            continue
        q, w = p[:, out], u[:, out]
        step = chord(q, w, 1.0, False)
        q = q + step * w[1:]
        q = q / np.sqrt((q * q).sum(0))
        cortex[out] += step
        normal = w[1] * q[0] + w[2] * q[1]
        reflected, cos_i = fresnel(np.clip(normal, 0, 1), eta)
        gone = reflected < 1
        # Tangential parts grow by eta, the normal part is the cosine outside.
        y = eta * (w[1] - normal * q[0]) + cos_i * q[0]
        z = eta * (w[2] - normal * q[1]) + cos_i * q[1]
        o = out[gone]
        yield (who[o], first[o], 1 - reflected[gone], np.arctan2(z, y)[gone] - straight[who[o]],
               eta * w[0][gone], cortex[o], medulla[o])
        first[out] = False
        w = np.stack([w[0], w[1] - 2 * normal * q[0], w[2] - 2 * normal * q[1]])
        step = chord(q, w, kappa[out], True)
        cortex[out] += step
        p[:, out], u[:, out] = q + step * w[1:], w
        keep = np.ones(len(who), bool)
        keep[out] = rng.random(len(out)) < reflected
        # Light that glides along the fiber for ever is no light that leaves.
        keep[out] &= (w[1] ** 2 + w[2] ** 2) > 1e-8
        if not keep.all():
            p, u = p[:, keep], u[:, keep]
            who, kappa, sigma, g = who[keep], kappa[keep], sigma[keep], g[keep]
            cortex, medulla, first = cortex[keep], medulla[keep], first[keep]


def tally(seed, cells, photons):
    """Sums over photons for these cells: [first or later][cell][quantity]."""
    rng = np.random.Generator(np.random.Philox(seed))
    index = np.repeat(np.arange(len(cells)), photons)
    kappa, tau, g, x, s = (np.ascontiguousarray(c) for c in cells[index].T)
    sums = np.zeros((2, len(cells), 10))
    for who, first, w, phi, sin_theta, lc, lm in trace(rng, kappa, tau, g, x, s):
        parts = [np.ones_like(w), np.cos(phi), np.sin(phi), sin_theta, sin_theta**2,
                 np.exp(-WEAK * lc), np.exp(-STRONG * lc), np.exp(-WEAK * lm), np.exp(-STRONG * lm),
                 np.exp(-BOTH * (lc + lm))]
        slot = np.where(first, 0, len(cells)) + index[who]
        for j, part in enumerate(parts):
            sums[:, :, j] += np.bincount(slot, w * part, 2 * len(cells)).reshape(2, -1)
    return sums


def bisect(f, lo, hi):
    """Root of a falling f, element by element, on a logarithmic scale."""
    for _ in range(60):
        mid = np.sqrt(lo * hi)
        above = f(mid) > 0
        lo, hi = np.where(above, mid, lo), np.where(above, hi, mid)
    return np.sqrt(lo * hi)


def gaussian_on_the_sphere(m, q):
    """Sine of the centre and variance of the lobe whose sine has mean m and mean square q."""

    def moments(v):
        a = 1 / np.tanh(1 / v) - v
        return a, 1 - 2 * v * a

    def misses(v):
        a, e2 = moments(v)
        c2 = np.minimum(1, (m / a) ** 2)
        return q - (c2 * e2 + (1 - c2) * (1 - e2) / 2)

    # The mean square grows with the variance, as far as a third.
    # The mean square grows with the variance. Beyond 1 the lobe is as good as even, and its centre means nothing.
    v = bisect(misses, np.full_like(m, 1e-6), np.ones_like(m))
    a, _ = moments(v)
    return np.clip(m / a, -1, 1), v


def gamma_law(weak, strong):
    """Depth -ln(dimming) at the weak absorption and scale of the gamma law that has both dimmings: its depth is
    proportional to ln(1 + scale * sigma)."""
    a, b = -np.log(np.clip(weak, 1e-9, 1 - 1e-9)), -np.log(np.clip(strong, 1e-9, 1 - 1e-9))
    shape = lambda k: np.log1p(STRONG * k) / np.log1p(WEAK * k)
    return a, bisect(lambda k: shape(k) - b / a, np.full_like(a, 1e-4), np.full_like(a, 2e3))


def depth(weak, k, sigma):
    return weak * np.log1p(k * sigma) / np.log1p(k * WEAK)


def columns(sums):
    """The table's columns from the sums: share that leaves at first arrival, then for first and later arrivals
    mean cosine and sine of the azimuth, centre along the fiber over minus the known sine, width along the fiber;
    depth at the weak absorption and ln(1 + scale) for the cortex, the same for the medulla; and how much of the
    two depths is common, because a long way is long in both."""
    total = sums[0, :, 0] + sums[1, :, 0]
    columns = [sums[0, :, 0] / total]
    sines = np.broadcast_to(S, SHAPE).ravel()
    for part in sums:
        e = part[:, 1:] / part[:, :1]
        centre, v = gaussian_on_the_sphere(e[:, 2], e[:, 3])
        ratio = (-centre / np.maximum(sines, 1e-9)).reshape(SHAPE)
        # Straight on, the ratio is 0 over 0: take it from the next inclination.
        ratio[..., 0] = ratio[..., 1]
        # Through the axis there is no side to prefer; what the photons say is noise.
        sine = e[:, 1].reshape(SHAPE).copy()
        sine[:, :, :, 0] = 0
        y_c, k_c = gamma_law(e[:, 4], e[:, 5])
        y_m, k_m = gamma_law(e[:, 6], e[:, 7])
        c, m = depth(y_c, k_c, BOTH), depth(y_m, k_m, BOTH)
        common = (c + m + np.log(e[:, 8])) * (1 + np.maximum(c, m)) / (c * m)
        columns += [e[:, 0], sine.ravel(), ratio.ravel(), np.sqrt(v), y_c, np.log1p(k_c), y_m, np.log1p(k_m), common]
    return np.stack(columns, 1)


def grid():
    mesh = np.meshgrid(KAPPA, TAU, G, X, S, indexing="ij")
    return np.stack([m.ravel() for m in mesh], 1)


def encode(table):
    lo, hi = np.array(RANGES, float).T
    return np.round(65535 * np.clip((table - lo) / (hi - lo), 0, 1)).astype("<u2")


def main():
    if sys.argv[1] == "part":
        part, parts, path = int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
        cells = grid()
        sums = np.zeros((2, len(cells), 10))
        # Cells of one optical radius take equally long: every part gets its share of each.
        for block in np.array_split(np.arange(part, len(cells), parts), 24):
            sums[:, block] = tally(1000 * part + block[0], cells[block], PHOTONS)
        np.save(path, sums)
    else:
        parts, path, out = int(sys.argv[2]), sys.argv[3], sys.argv[4]
        table = columns(sum(np.load(path % i) for i in range(parts)))
        for j, (lo, hi) in enumerate(RANGES):
            column = table[:, j]
            print(f"{j:2} {column.min():8.4f} {column.max():8.4f}  clipped {np.mean((column < lo) | (column > hi)):.2%}")
        encode(table).tofile(out)


PHOTONS = 4000

if __name__ == "__main__":
    main()
