//! How the medulla scatters: the table made by `tools/fur_table.py`, and what can be asked of it.
//!
//! Cells are a grid in five numbers (see [`lookup`]); each holds 19 numbers of 16 bits. Between cells, numbers
//! are interpolated linearly in every direction, beyond the grid its edge holds.

/// Radius of the medulla, in fiber radii.
const KAPPA: [f64; 5] = [0.1, 0.35, 0.6, 0.8, 0.95];
/// Logarithm of the optical radius of the medulla, its scattering per fiber radius times its radius: 0.05 to 16.
const LN_TAU: [f64; 6] = [-2.995_732_274, -1.842_068_075, -0.688_403_876, 0.465_260_323, 1.618_924_522, 2.772_588_722];
/// Ends of that, without the logarithm.
const TAU_RANGE: [f64; 2] = [0.05, 16.0];
/// Anisotropy.
const G: [f64; 5] = [-0.6, 0.0, 0.4, 0.7, 0.9];
/// Offset, 1 where the ray only just touches the medulla or the rim.
const X: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 0.99];
/// Sine of the inclination outside, without its sign.
const S: [f64; 4] = [0.0, 1.0 / 3.0, 2.0 / 3.0, 0.999];

/// Numbers about one part of the light.
const SET: usize = 9;
/// Numbers in a cell: the share that leaves at its first arrival, and a set for that and for the rest.
const COLUMNS: usize = 1 + 2 * SET;
/// What 0 and 65535 stand for in a set.
const RANGES: [[f64; 2]; SET] =
    [[-1.0, 1.0], [-1.0, 1.0], [-1.25, 1.25], [0.0, 1.0], [0.0, 3.0], [0.0, 8.0], [0.0, 4.0], [0.0, 8.0], [-1.5, 2.5]];

static TABLE: &[u8; 2 * COLUMNS * KAPPA.len() * LN_TAU.len() * G.len() * X.len() * S.len()] =
    include_bytes!("table.bin");

/// Absorption at which the depth is tabulated, per fiber radius.
const WEAK: f64 = 0.25;

/// One part of the scattered light: where it goes and how absorption dims it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaving {
    /// Mean cosine and sine of the azimuth, relative to the way straight through, for offsets `h >= 0`.
    pub(super) mean: [f64; 2],
    /// Sine of the centre along the fiber, over minus the sine of the known inclination.
    pub(super) centre: f64,
    /// Standard deviation along the fiber, radians.
    pub(super) width: f64,
    /// Depth at [`WEAK`] and scale of the gamma law: in the cortex, in the medulla.
    depths: [[f64; 2]; 2],
    /// How much of the two depths is common.
    common: f64,
}

/// What the medulla does to light that is scattered on its first way through it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scattered {
    /// Share that leaves when it first reaches the surface; the rest is reflected inside at least once.
    pub(super) first_share: f64,
    /// The light that leaves when it first reaches the surface.
    pub(super) first: Leaving,
    /// The rest, which leaves later.
    pub(super) later: Leaving,
}

impl Leaving {
    fn new(columns: &[f64]) -> Self {
        let column = |i: usize| {
            let [low, high] = RANGES[i];
            low + (high - low) * columns[i]
        };
        let scale = |i: usize| column(i).exp_m1().max(1e-6);
        Self {
            mean: [column(0), column(1)],
            centre: column(2),
            width: column(3),
            depths: [[column(4), scale(5)], [column(6), scale(7)]],
            common: column(8),
        }
    }

    /// Share that absorption leaves of this light, for an absorption of the cortex and of the medulla per
    /// fiber radius; what happens before the light first reaches the medulla is not counted.
    ///
    /// Lengths follow a gamma law each, so that the share is `(1 + kσ)` to a power; exactly 1 at 0.
    pub(super) fn dimming(&self, cortex: f64, medulla: f64) -> f64 {
        let depth = |[weak, k]: [f64; 2], sigma: f64| weak * (k * sigma).ln_1p() / (k * WEAK).ln_1p();
        let (c, m) = (depth(self.depths[0], cortex), depth(self.depths[1], medulla));
        let longer = c.max(m);
        // A long way is long in both, so their depths do not simply add.
        let joint = (c + m - self.common * c * m / (1.0 + longer)).max(longer);
        (-joint).exp()
    }

    /// Mean azimuth relative to the way straight through (for `h >= 0`) and standard deviation of the wrapped
    /// Gaussian with the same mean direction, radians.
    pub(super) fn azimuth(&self) -> (f64, f64) {
        let [cos, sin] = self.mean;
        // A mean direction shorter than this is none: the Gaussian is even around the circle.
        let length = cos.hypot(sin).clamp(1e-3, 1.0 - 1e-9);
        (sin.atan2(cos), (-2.0 * length.ln()).sqrt())
    }
}

/// Cell and place in it, 0 to 1; the edge beyond the edge.
fn locate(nodes: &[f64], x: f64) -> (usize, f64) {
    let last = nodes.len() - 2;
    let i = nodes[1..=last].iter().take_while(|&&node| x >= node).count();
    (i, ((x - nodes[i]) / (nodes[i + 1] - nodes[i])).clamp(0.0, 1.0))
}

/// The radius that the table answers for when asked about this one.
pub(super) fn tabulated_radius(kappa: f64) -> f64 {
    kappa.clamp(KAPPA[0], KAPPA[KAPPA.len() - 1])
}

/// The numbers at one place, 0 to 1 each.
fn columns(kappa: f64, tau: f64, g: f64, x: f64, sin_k: f64) -> [f64; COLUMNS] {
    // So thick a medulla as the table does not have is replaced by one that is as thick for diffusion:
    // the same optical radius times one minus anisotropy.
    let [thinnest, thickest] = TAU_RANGE;
    let (tau, g) = if tau > thickest { (thickest, 1.0 - (1.0 - g) * tau / thickest) } else { (tau.max(thinnest), g) };
    let places = [
        (KAPPA.len(), locate(&KAPPA, kappa)),
        (LN_TAU.len(), locate(&LN_TAU, tau.ln())),
        (G.len(), locate(&G, g)),
        (X.len(), locate(&X, x)),
        (S.len(), locate(&S, sin_k.abs())),
    ];
    let mut columns = [0.0; COLUMNS];
    for corner in 0..1_usize << places.len() {
        let (mut cell, mut weight) = (0, 1.0);
        for (axis, &(count, (i, t))) in places.iter().enumerate() {
            let upper = (corner >> axis) & 1;
            cell = cell * count + i + upper;
            weight *= if upper == 1 { t } else { 1.0 - t };
        }
        if weight > 0.0 {
            let bytes = TABLE[2 * COLUMNS * cell..].chunks_exact(2);
            for (column, word) in columns.iter_mut().zip(bytes) {
                *column += weight / 65535.0 * f64::from(u16::from_le_bytes([word[0], word[1]]));
            }
        }
    }
    columns
}

/// What the table says about a medulla of radius `kappa` and optical radius `tau` with anisotropy `g`, for a ray
/// at the offset `x` and the inclination whose sine is `sin_k`.
pub(super) fn lookup(kappa: f64, tau: f64, g: f64, x: f64, sin_k: f64) -> Scattered {
    let columns = columns(kappa, tau, g, x, sin_k);
    Scattered {
        first_share: columns[0],
        first: Leaving::new(&columns[1..=SET]),
        later: Leaving::new(&columns[1 + SET..]),
    }
}

/// All cells of one medulla, offset slow and inclination fast, the numbers in their ranges.
pub(super) fn cells(kappa: f64, tau: f64, g: f64) -> [[f64; COLUMNS]; X.len() * S.len()] {
    std::array::from_fn(|cell| {
        let mut numbers = columns(kappa, tau, g, X[cell / S.len()], S[cell % S.len()]);
        for set in numbers[1..].chunks_exact_mut(SET) {
            for (number, [low, high]) in set.iter_mut().zip(RANGES) {
                *number = low + (high - low) * *number;
            }
        }
        numbers
    })
}

#[cfg(test)]
mod tests {
    use super::super::trace::{Cylinder, Random, trace};
    use super::*;

    /// Photons that the table's maker followed in every cell.
    const TABULATED: f64 = 4000.0;

    /// Mean and standard error of a number, for so many photons here and in the table.
    fn mean(values: &[f64], tabulated: f64) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        (mean, (variance * (1.0 / n + 1.0 / tabulated)).sqrt())
    }

    /// Another tracer, written independently of the maker of the table, finds the same numbers in some cells.
    ///
    /// 5 cells with at most 11 numbers, each allowed 5 standard errors: a false alarm with probability 3e-5, and
    /// only together with a change, because both sides are seeded. One hundredth more, because the table has 16
    /// bits (1e-4), leaves out the noise of its maker where symmetry says 0, and cuts means at its ranges.
    #[test]
    fn some_cells_are_traced_again() {
        for (seed, (kappa, tau, g, x, s)) in
            [(0, 3, 2, 1, 1), (1, 4, 4, 2, 0), (2, 2, 0, 0, 2), (3, 3, 3, 3, 1), (4, 4, 1, 2, 3)]
                .into_iter()
                .enumerate()
        {
            let (kappa, tau, g, x, s) = (KAPPA[kappa], LN_TAU[tau].exp(), G[g], X[x], S[s]);
            let cylinder = Cylinder { eta: 1.55, radius: kappa, scattering: tau / kappa, anisotropy: g };
            let (sin_t, root) = (s / 1.55, (1.55_f64 * 1.55 - s * s).sqrt());
            let bravais = root / (1.0 - s * s).sqrt();
            let h = x * (kappa * bravais).min(1.0);
            let d = h / bravais;
            let straight = 2.0 * d.asin() - 2.0 * h.asin() + std::f64::consts::PI;
            let before =
                ((1.0 - d * d).sqrt() - (kappa * kappa - d * d).max(0.0).sqrt()) / (1.0 - sin_t * sin_t).sqrt();

            let mut random = Random::new(seed as u32 + 40);
            let mut parts = [Vec::new(), Vec::new()];
            for _ in 0..40_000 {
                let Some(exit) = trace(&cylinder, s, h, &mut random) else { continue };
                // Scattered on the first way through the medulla; sorted by when it leaves.
                if exit.scattered_after == Some(0) {
                    parts[usize::from(exit.arrivals > 1)].push(exit);
                }
            }

            let entry = lookup(kappa, tau, g, x, s);
            let place = format!("kappa {kappa}, tau {tau}, g {g}, x {x}, s {s}");
            let total = (parts[0].len() + parts[1].len()) as f64;
            let share = parts[0].len() as f64 / total;
            let error = (share * (1.0 - share) * (1.0 / total + 1.0 / TABULATED)).sqrt();
            assert!(
                (share - entry.first_share).abs() < 5.0 * error + 1e-2,
                "{place}: {share} ± {error} leaves at once, the table says {}",
                entry.first_share
            );
            for (leaving, exits, share) in [(entry.first, &parts[0], share), (entry.later, &parts[1], 1.0 - share)] {
                let tabulated = TABULATED * share;
                let compare = |what: &str, values: Vec<f64>, want: f64| {
                    let (got, error) = mean(&values, tabulated);
                    assert!(
                        (got - want).abs() < 5.0 * error + 1e-2,
                        "{place}: {what} {got} ± {error}, the table says {want}"
                    );
                };
                let each = |f: &dyn Fn(f64, f64, f64) -> f64| -> Vec<f64> {
                    exits.iter().map(|e| f(e.phi - straight, e.cortex - before, e.medulla)).collect()
                };
                compare("mean cosine", each(&|phi, _, _| phi.cos()), leaving.mean[0]);
                compare("mean sine", each(&|phi, _, _| phi.sin()), leaving.mean[1]);
                // The Gaussian that has the tabulated mean; where it is as wide as the table allows, it has not.
                if leaving.width < 0.99 {
                    let v = leaving.width.powi(2);
                    let want = -leaving.centre * s * (v.recip().tanh().recip() - v);
                    compare("mean inclination", exits.iter().map(|e| e.sin_theta).collect(), want);
                }
                compare("cortex", each(&|_, c, _| (-1.5 * c).exp()), leaving.dimming(1.5, 0.0));
                compare("medulla", each(&|_, _, m| (-0.25 * m).exp()), leaving.dimming(0.0, 0.25));
            }
        }
    }

    #[test]
    fn nothing_is_lost_where_nothing_absorbs() {
        for i in 0..1000 {
            let u = |j: u32| f64::from(math::hash::unit(i, 90 + j));
            let entry = lookup(u(0), 40.0 * u(1), 2.0 * u(2) - 1.0, u(3), 2.0 * u(4) - 1.0);
            assert!(entry.first_share > 0.3 && entry.first_share < 1.0, "{entry:?}");
            assert_eq!(entry.first.dimming(0.0, 0.0), 1.0);
            assert_eq!(entry.later.dimming(0.0, 0.0), 1.0);
            // More absorption never leaves more light, in either material.
            for leaving in [entry.first, entry.later] {
                let share = |c: f64, m: f64| leaving.dimming(c, m);
                assert!(share(0.5, 0.0) < 1.0 && share(0.5, 0.2) <= share(0.5, 0.0) && share(1e4, 1e4) >= 0.0);
            }
        }
    }
}
