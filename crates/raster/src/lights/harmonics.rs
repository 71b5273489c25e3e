//! Ambient light as spherical harmonics of degree 0 to 2: nine coefficients per channel.
//!
//! Real, orthonormal harmonics with z as their axis, without the sign `(-1)^m`, in the order
//! `1; y, z, x; xy, yz, 3z² - 1, xz, x² - y²`, each times its constant below.
//!
//! - Source: Ramamoorthi & Hanrahan 2001 for the basis and for what a cosine makes of each degree.
//! - Never negative: what a projection leaves below 0 is [damped](Harmonics::damped) away, which keeps the mean.
//! - Twin: `shaders/harmonics.wgsl`.

use std::f64::consts::PI;

use math::{DVec3, Rgb, Vec3};

use super::environment::evenly;

/// The shader twin: `harmonics_radiance` and `harmonics_irradiance`.
pub(crate) const SHADER: &str = include_str!("../../shaders/harmonics.wgsl");

/// `√(1 / 4π)`: the harmonic of degree 0.
const Y0: f64 = 0.282_094_791_773_878_14;
/// `√(3 / 4π)`: factor of y, z and x.
const Y1: f64 = 0.488_602_511_902_919_9;
/// `√(15 / 4π)`: factor of xy, yz and xz.
const Y2: f64 = 1.092_548_430_592_079_2;
/// `√(5 / 16π)`: factor of `3z² - 1`.
const Y20: f64 = 0.315_391_565_252_520_05;
/// `√(15 / 16π)`: factor of `x² - y²`.
const Y22: f64 = 0.546_274_215_296_039_6;

/// Degree of each coefficient.
const DEGREE: [usize; 9] = [0, 1, 1, 1, 2, 2, 2, 2, 2];

/// Convolution with `max(cos, 0)`, by degree.
const COSINE: [f64; 3] = [PI, 2.0 * PI / 3.0, 0.25 * PI];

/// Smallest radiance that damping allows, as a share of the mean. It looks at [`PROBES`] directions, 0.08 rad apart;
/// between them a function of degree 2 can lie lower by no more than about this.
const FLOOR: f64 = 0.01;
const PROBES: usize = 2048;

/// Radiance from all around, W/(m² sr), as nine coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Harmonics {
    /// In the order of the module's header.
    pub(crate) coefficients: [Rgb; 9],
}

impl Harmonics {
    /// The same radiance from everywhere.
    pub(crate) fn constant(radiance: Rgb) -> Self {
        let mut coefficients = [Rgb::black(); 9];
        coefficients[0] = radiance.map(|x| (f64::from(x) / Y0) as f32);
        Self { coefficients }
    }

    /// Radiance from the unit direction `d`, W/(m² sr).
    #[cfg_attr(not(test), expect(dead_code, reason = "what the shader is held against"))]
    pub(crate) fn radiance(&self, d: Vec3) -> Rgb {
        self.weighted(d, [1.0; 3])
    }

    /// Irradiance of a surface with the unit normal `normal`, W/m².
    #[cfg_attr(not(test), expect(dead_code, reason = "what the shader is held against"))]
    pub(crate) fn irradiance(&self, normal: Vec3) -> Rgb {
        self.weighted(normal, COSINE)
    }

    fn weighted(&self, d: Vec3, by_degree: [f64; 3]) -> Rgb {
        let basis = basis(d.as_dvec3());
        let sum: Rgb<f64> =
            (0..9).map(|i| self.coefficients[i].cast::<f64>() * (basis[i] * by_degree[DEGREE[i]])).sum();
        sum.map(|x| x.max(0.0)).cast()
    }

    /// Mean radiance over the sphere, W/(m² sr).
    pub(crate) fn mean(&self) -> Rgb {
        self.coefficients[0] * Y0 as f32
    }

    /// Coefficients as the shader reads them: `rgb`, and 0.
    pub(crate) fn words(&self) -> [[f32; 4]; 9] {
        self.coefficients.map(|Rgb([r, g, b])| [r, g, b, 0.0])
    }

    /// Both lights together.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self { coefficients: std::array::from_fn(|i| self.coefficients[i] + other.coefficients[i]) }
    }

    /// From pieces of the sphere: the unit direction of each, and radiance times its solid angle.
    pub(super) fn project(pieces: impl Iterator<Item = (DVec3, Rgb<f64>)>) -> Self {
        let mut sums = [Rgb::<f64>::black(); 9];
        for (direction, light) in pieces {
            for (sum, y) in sums.iter_mut().zip(basis(direction)) {
                *sum += light * y;
            }
        }
        Self { coefficients: sums.map(Rgb::cast) }
    }

    /// The nearest of its family that is nowhere negative: degree `l` divided by `1 + λ (l (l + 1))²`, the same
    /// `λ` for all channels so that hues stay, and as small as will do. The mean is kept.
    ///
    /// Source: the window that minimises the squared Laplacian, Sloan 2008, "Stupid spherical harmonics tricks".
    pub(super) fn damped(&self) -> Self {
        // A channel is left alone where it is dark altogether.
        let mean = self.mean();
        let least = mean.map(|x| x * FLOOR as f32);
        let probes = evenly(PROBES);
        let is_legal = |lambda: f64| {
            let candidate = self.divided(lambda);
            probes.iter().all(|&d| {
                let found = candidate.signed(d);
                (0..3).all(|k| mean[k] <= 0.0 || found[k] >= f64::from(least[k]))
            })
        };
        if is_legal(0.0) {
            return *self;
        }
        let (mut low, mut high) = (0.0, 1e-3);
        // Degree 2 is gone to one part in 10⁸ long before the last doubling.
        for _ in 0..64 {
            if is_legal(high) {
                break;
            }
            low = high;
            high *= 2.0;
        }
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            if is_legal(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        self.divided(high)
    }

    fn divided(&self, lambda: f64) -> Self {
        let by_degree = [1.0, 1.0 / (1.0 + 4.0 * lambda), 1.0 / (1.0 + 36.0 * lambda)];
        Self { coefficients: std::array::from_fn(|i| self.coefficients[i] * by_degree[DEGREE[i]] as f32) }
    }

    /// The polynomial itself, below 0 too.
    pub(super) fn signed(&self, d: DVec3) -> Rgb<f64> {
        let basis = basis(d);
        (0..9).map(|i| self.coefficients[i].cast::<f64>() * basis[i]).sum()
    }
}

/// The nine harmonics at a unit direction.
fn basis(d: DVec3) -> [f64; 9] {
    let DVec3 { x, y, z } = d;
    [Y0, Y1 * y, Y1 * z, Y1 * x, Y2 * x * y, Y2 * y * z, Y20 * (3.0 * z * z - 1.0), Y2 * x * z, Y22 * (x * x - y * y)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::{hash, warp};

    fn directions(count: u32) -> impl Iterator<Item = Vec3> {
        (0..count).map(|i| warp::uniform_sphere([hash::unit(i, 71), hash::unit(i, 72)]))
    }

    /// By a quadrature of 40,000 directions, whose error for functions of low degree is below 1e-6.
    fn projected(light: impl Fn(DVec3) -> [f64; 3]) -> Harmonics {
        let points = evenly(40_000);
        let piece = 4.0 * PI / points.len() as f64;
        Harmonics::project(points.iter().map(|&d| (d, Rgb(light(d)) * piece)))
    }

    fn worst(found: Rgb, expected: [f64; 3]) -> f64 {
        (0..3).map(|k| (f64::from(found[k]) - expected[k]).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn the_basis_is_orthonormal() {
        let points = evenly(40_000);
        for i in 0..9 {
            for j in 0..9 {
                let inner: f64 = points.iter().map(|&d| basis(d)[i] * basis(d)[j]).sum::<f64>() * 4.0 * PI / 40_000.0;
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((inner - expected).abs() < 1e-4, "{i} and {j}: {inner}");
            }
        }
    }

    #[test]
    fn a_polynomial_of_degree_two_comes_back() {
        // Positive everywhere, another one in each channel, every coefficient in use.
        let light = |d: DVec3| {
            [
                2.0 + 0.5 * d.x - 0.3 * d.y + 0.2 * d.z,
                1.0 + 0.4 * d.x * d.y + 0.3 * d.y * d.z - 0.2 * d.x * d.z,
                1.5 + 0.6 * d.z * d.z - 0.7 * d.x * d.x,
            ]
        };
        let harmonics = projected(light);
        for d in directions(500) {
            let off = worst(harmonics.radiance(d), light(d.as_dvec3()));
            assert!(off < 1e-4, "{d}: {off}");
        }
        assert_eq!(harmonics.damped(), harmonics);
    }

    #[test]
    fn irradiance_is_the_closed_form() {
        // ∫ L max(cos, 0) dω: π for 1, (2π/3) n·x for x, and y² = 1/3 + (y² - 1/3) has a part of degree 2.
        let harmonics = projected(|d| [1.0, 1.0 + 0.9 * d.x, d.y * d.y]);
        for n in directions(500) {
            let (x, y) = (f64::from(n.x), f64::from(n.y));
            let expected = [PI, PI + 0.9 * (2.0 * PI / 3.0) * x, PI / 3.0 + 0.25 * PI * (y * y - 1.0 / 3.0)];
            let off = worst(harmonics.irradiance(n), expected);
            assert!(off < 1e-3, "{n}: {off}");
        }
        let sky = Harmonics::constant(Rgb::new(0.1, 0.2, 0.3));
        for n in directions(50) {
            assert!(worst(sky.radiance(n), [0.1, 0.2, 0.3]) < 1e-6);
            assert!(worst(sky.irradiance(n), [0.1 * PI, 0.2 * PI, 0.3 * PI]) < 1e-5);
        }
        assert!(worst(sky.mean(), [0.1, 0.2, 0.3]) < 1e-6);
    }

    #[test]
    fn damping_leaves_nothing_below_zero_and_keeps_the_mean() {
        // A sun in red and green, and a sky in green: the projection of a sun rings below zero.
        let sun = DVec3::new(0.48, 0.6, 0.64);
        let raw = Harmonics::project([(sun, Rgb([3.0, 2.0, 0.0]))].into_iter())
            .plus(&projected(|d| [0.0, 0.1 + 0.05 * d.y, 0.0]));
        assert!(directions(4000).any(|d| raw.signed(d.as_dvec3())[0] < -0.05), "nothing to damp");
        let damped = raw.damped();
        assert_eq!(damped.mean(), raw.mean());
        for d in directions(4000) {
            let found = damped.signed(d.as_dvec3());
            assert!((0..3).all(|k| found[k] >= 0.0), "{d}: {found:?}");
        }
        // It still shines from where the sun is: red is brighter there than on the far side, by far.
        let [towards, away] = [sun, -sun].map(|d| damped.signed(d)[0]);
        assert!(towards > 4.0 * away, "{towards} and {away}");
    }

    #[test]
    fn the_shader_has_the_same_constants() {
        let module = naga::front::wgsl::parse_str(SHADER).expect("the shader parses");
        let constant = |name: &str| {
            let (_, constant) = module
                .constants
                .iter()
                .find(|(_, constant)| constant.name.as_deref() == Some(name))
                .unwrap_or_else(|| panic!("no constant {name}"));
            match module.global_expressions[constant.init] {
                naga::Expression::Literal(naga::Literal::F32(x)) => x,
                ref other => panic!("{name} is {other:?}"),
            }
        };
        let expected = [
            ("HARMONICS_Y0", Y0),
            ("HARMONICS_Y1", Y1),
            ("HARMONICS_Y2", Y2),
            ("HARMONICS_Y20", Y20),
            ("HARMONICS_Y22", Y22),
            ("HARMONICS_COSINE0", COSINE[0]),
            ("HARMONICS_COSINE1", COSINE[1]),
            ("HARMONICS_COSINE2", COSINE[2]),
        ];
        for (name, value) in expected {
            assert_eq!(constant(name), value as f32, "{name}");
        }
    }
}
