//! What a whole fiber scatters: integrals over the offset `h` across it.
//!
//! The azimuthal term of lobe `p` in the far field is `N_p(φ) = ½ ∫ A_p(h) D_p(φ - Φ(p, h)) dh`, and the
//! density of a sampler that draws `h` uniformly and then a lobe with probability `w_p(h)` is the same
//! integral with `w_p` for `A_p`. Both are done together, by a Gauss-Legendre rule in `γ = asin h`, in which
//! the integrand has no singular end points; only half the rule is visited, because `A` and `w` are even in
//! `γ` and `Φ` is odd about `pπ`. In single precision eight nodes are worked on at once.
//!
//! Kernels `D` that are too narrow for the rule are integrated in windows around the roots of
//! `Φ(p, γ) = φ` instead: see [`windows`](super::azimuthal::windows).

use std::sync::OnceLock;

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, f32x8};
use math::{LUMINANCE, Real, Rgb};

use super::attenuation::Optics;
use super::azimuthal::{self, Kernel};
use super::vector::{self, LANES, vectorised};
use crate::quadrature;

/// Most nodes over half the cross-section.
pub(crate) const HALF_NODES: usize = 128;

/// The half of a Gauss-Legendre rule with `γ > 0`, ready for both precisions.
#[derive(Debug)]
pub(crate) struct HalfRule {
    /// `γ`, `sin γ`, `cos γ` and the weight of `½ ∫ dh` over one half.
    nodes: Vec<[f64; 4]>,
    /// The last three in single precision, eight nodes to a block.
    blocks: Vec<[[f32; LANES]; 4]>,
}

impl HalfRule {
    fn new(n: usize) -> Self {
        let nodes: Vec<[f64; 4]> = quadrature::rule(n)
            .iter()
            .filter(|(x, _)| *x > 0.0)
            .map(|&(x, w)| {
                let gamma = std::f64::consts::FRAC_PI_2 * x;
                let (sin, cos) = gamma.sin_cos();
                [gamma, sin, cos, 0.5 * w * std::f64::consts::FRAC_PI_2 * cos]
            })
            .collect();
        let blocks = nodes
            .chunks(LANES)
            .map(|chunk| {
                // Lanes left over repeat the last node with no weight.
                std::array::from_fn(|i| {
                    std::array::from_fn(|lane| match chunk.get(lane) {
                        Some(node) => node[i] as f32,
                        None if i == 3 => 0.0,
                        None => chunk[chunk.len() - 1][i] as f32,
                    })
                })
            })
            .collect();
        Self { nodes, blocks }
    }

    /// The smallest rule that serves kernels of these scales, as far as they can be served.
    pub(crate) fn fit<F: Real>(kernel: Kernel, scales: &[F]) -> &'static Self {
        static RULES: [OnceLock<HalfRule>; quadrature::SIZES.len()] =
            [const { OnceLock::new() }; quadrature::SIZES.len()];
        let nodes = scales.iter().filter_map(|s| kernel.nodes(s.f64(), F::DOUBLE)).max().unwrap_or(0);
        let nodes = nodes.clamp(48, 2 * HALF_NODES);
        let i = quadrature::SIZES.iter().position(|&size| size >= nodes).unwrap_or(quadrature::SIZES.len() - 1);
        RULES[i].get_or_init(|| Self::new(quadrature::SIZES[i]))
    }
}

/// Lobe probabilities `w_p` at the nodes of a rule: what the sampled direction does not change.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shares<F> {
    /// By lobe, then by node.
    w: [[F; HALF_NODES]; 4],
    rule: &'static HalfRule,
}

impl<F: Real> Shares<F> {
    /// Works out the shares of the luminance of the four lobes, each with its own optics; without the
    /// residual lobe where `residual` is false.
    pub(crate) fn new(rule: &'static HalfRule, optics: &[Optics<F>; 4], sigma_a: Rgb<F>, residual: bool) -> Self {
        let mut shares = Self { w: [[F::zero(); HALF_NODES]; 4], rule };
        if F::DOUBLE {
            for (j, &[_, h, _, _]) in rule.nodes.iter().enumerate() {
                let w = lobe_shares(optics, sigma_a, residual, F::of(h));
                for (all, w) in shares.w.iter_mut().zip(w) {
                    all[j] = w;
                }
            }
        } else {
            let optics = [0, 1, 2, 3].map(|p| optics[p].constants());
            // Where all lobes share their optics, so does the work.
            let same = optics[1..].iter().all(|o| *o == optics[0]);
            let sigma = sigma_a.0.map(|x| x.f64() as f32);
            let mut w = [[0.0_f32; HALF_NODES]; 4];
            vectorised!(simd => shares_at_once(simd, rule, &optics, same, sigma, residual, &mut w));
            for (all, w) in shares.w.iter_mut().zip(&w) {
                for (to, from) in all.iter_mut().zip(w) {
                    *to = F::of(f64::from(*from));
                }
            }
        }
        shares
    }
}

/// `w_p(h)` at one offset: every lobe's share of the luminance on its own specular path.
pub(crate) fn lobe_shares<F: Real>(optics: &[Optics<F>; 4], sigma_a: Rgb<F>, residual: bool, h: F) -> [F; 4] {
    let cos_gamma = (F::one() - h.sqr()).safe_sqrt();
    let lum = if F::DOUBLE {
        let gamma = h.safe_asin();
        let mut lum = [F::zero(); 4];
        for (p, lum) in lum.iter_mut().enumerate() {
            *lum = optics[p].path(h, gamma, cos_gamma).attenuation(sigma_a)[p].luminance();
        }
        lum
    } else {
        let single = [0, 1, 2, 3].map(|p| optics[p].constants());
        let sigma = sigma_a.0.map(|x| x.f64() as f32);
        let at = [h.abs().f64() as f32, cos_gamma.f64() as f32];
        vectorised!(simd => luminances_at_once(simd, &single, sigma, at)).map(|x| F::of(f64::from(x)))
    };
    let lum = if residual { lum } else { [lum[0], lum[1], lum[2], F::zero()] };
    shares_of(lum)
}

/// What each has of the sum; everything is the first one's where there is nothing to share.
#[inline]
pub(crate) fn shares_of<F: Real>(lum: [F; 4]) -> [F; 4] {
    let total: F = lum.iter().copied().sum();
    if total > F::zero() { lum.map(|l| l / total) } else { [F::one(), F::zero(), F::zero(), F::zero()] }
}

/// The integrand over the cross-section, for one sampled inclination.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section<F> {
    /// Optics of the light that leaves.
    pub optics: Optics<F>,
    /// Absorption per radius.
    pub sigma_a: Rgb<F>,
    /// Azimuthal kernel of R, TT, TRT.
    pub kernel: Kernel,
    /// Its scale per lobe.
    pub scales: [F; 3],
}

/// `N_p` of R, TT, TRT and the residual lobe, and the same with `w_p` for `A_p`.
pub(crate) type Azimuthal<F> = ([Rgb<F>; 4], [F; 4]);

impl<F: Real> Section<F> {
    /// The azimuthal terms at `phi`, relative to the known direction, in `[-π, π]`. `share_at` gives `w_p` at
    /// offsets that are no nodes.
    pub(crate) fn integrate(&self, shares: &Shares<F>, phi: F, share_at: impl Fn(F) -> [F; 4]) -> Azimuthal<F> {
        let wide = self.scales.map(|s| self.kernel.nodes(s.f64(), F::DOUBLE).is_some());
        let (mut n, mut density) =
            if F::DOUBLE { self.one_by_one(shares, phi, wide) } else { self.eight_at_once(shares, phi, wide) };
        for p in (0..3).filter(|&p| !wide[p]) {
            azimuthal::windows(&self.optics, p, self.kernel, self.scales[p], phi, |gamma, d| {
                let (h, cos_gamma) = gamma.sin_cos();
                n[p] += self.optics.path(h, gamma, cos_gamma).attenuation(self.sigma_a)[p] * d;
                density[p] += share_at(h)[p] * d;
            });
        }
        (n, density)
    }

    fn one_by_one(&self, shares: &Shares<F>, phi: F, wide: [bool; 3]) -> Azimuthal<F> {
        let mut n = [Rgb::black(); 4];
        let mut density = [F::zero(); 4];
        for (j, &node) in shares.rule.nodes.iter().enumerate() {
            let [gamma, h, cos_gamma, c] = node.map(F::of);
            let path = self.optics.path(h, gamma, cos_gamma);
            let a = path.attenuation(self.sigma_a);
            for p in 0..3 {
                if wide[p] {
                    let turn = F::of(p as f64) * F::PI();
                    let odd = path.exit_azimuth(p) - turn;
                    let scale = self.scales[p];
                    let d = c
                        * (self.kernel.at(scale, crate::wrap_angle(phi - turn - odd))
                            + self.kernel.at(scale, crate::wrap_angle(phi - turn + odd)));
                    n[p] += a[p] * d;
                    density[p] += shares.w[p][j] * d;
                }
            }
            let d = F::of(2.0) * c / F::TAU();
            n[3] += a[3] * d;
            density[3] += shares.w[3][j] * d;
        }
        (n, density)
    }

    fn eight_at_once(&self, shares: &Shares<F>, phi: F, wide: [bool; 3]) -> Azimuthal<F> {
        let single = Single {
            optics: self.optics.constants(),
            sigma_a: self.sigma_a.0.map(|x| x.f64() as f32),
            kernel: self.kernel,
            scales: self.scales.map(|x| x.f64() as f32),
            norms: self.scales.map(|x| self.kernel.norm(x).f64() as f32),
            phi: phi.f64() as f32,
            wide,
            rule: shares.rule,
        };
        let (n, density) = single.run(&shares.w);
        (n.map(|rgb| Rgb(rgb.map(|x| F::of(f64::from(x))))), density.map(|x| F::of(f64::from(x))))
    }
}

/// [`Section`] in single precision.
struct Single {
    optics: [f32; 4],
    sigma_a: [f32; 3],
    kernel: Kernel,
    scales: [f32; 3],
    /// Norm of the kernel of every lobe.
    norms: [f32; 3],
    phi: f32,
    wide: [bool; 3],
    rule: &'static HalfRule,
}

impl Single {
    fn run<F: Real>(&self, w: &[[F; HALF_NODES]; 4]) -> ([[f32; 3]; 4], [f32; 4]) {
        vectorised!(simd => integrate_at_once(simd, self, w))
    }
}

/// Paths at eight offsets: attenuation per lobe, and how far the ray turns inside.
struct Paths<S: Simd> {
    /// `γ_t`.
    gamma_t: f32x8<S>,
    r: f32x8<S>,
    tt: [f32x8<S>; 3],
    trt: [f32x8<S>; 3],
    residual: [f32x8<S>; 3],
}

/// [`Path::attenuation`](super::attenuation::Path::attenuation) at eight offsets.
#[inline(always)]
fn paths<S: Simd>(simd: S, optics: &[f32x8<S>; 4], sigma_a: &[f32; 3], h: f32x8<S>, cos_gamma: f32x8<S>) -> Paths<S> {
    let [eta_v, cos_theta, inv_bravais, length] = *optics;
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let sin_t = (h * inv_bravais).min(one);
    let cos_t = (one - sin_t * sin_t).max(zero).sqrt();

    let cos_i = cos_gamma * cos_theta;
    let cos_o = (one - (one - cos_i * cos_i) / (eta_v * eta_v)).max(zero).sqrt();
    let (s, s_under) = (cos_i - eta_v * cos_o, cos_i + eta_v * cos_o);
    let (p, p_under) = (eta_v * cos_i - cos_o, eta_v * cos_i + cos_o);
    let (s, s_under) = (s * p_under, s_under * p_under);
    let p = p * (cos_i + eta_v * cos_o);
    let fresnel = (s * s + p * p) * f32x8::splat(simd, 0.5) / (s_under * s_under).max(f32x8::splat(simd, 1e-30));
    let fresnel = fresnel.min(one);

    let through = (one - fresnel) * (one - fresnel);
    let length = zero - cos_t * length;
    let (mut tt, mut trt, mut residual) = ([zero; 3], [zero; 3], [zero; 3]);
    let grey = sigma_a[0] == sigma_a[1] && sigma_a[1] == sigma_a[2];
    let mut channel = 0;
    while channel < 3 {
        if grey && channel > 0 {
            tt[channel] = tt[0];
            trt[channel] = trt[0];
            residual[channel] = residual[0];
        } else {
            let t = vector::exp(simd, length * f32x8::splat(simd, sigma_a[channel]));
            let ft = fresnel * t;
            let rest = one - ft;
            tt[channel] = t * through;
            trt[channel] = tt[channel] * ft;
            let series = trt[channel] * ft / rest.max(f32x8::splat(simd, 1e-30));
            residual[channel] = rest.simd_gt(zero).select(series, zero);
        }
        channel += 1;
    }
    Paths { gamma_t: vector::asin(simd, sin_t), r: fresnel, tt, trt, residual }
}

/// The kernel at eight wrapped azimuths `|x|`.
#[inline(always)]
fn kernel_at<S: Simd>(simd: S, kernel: Kernel, scale: f32, norm: f32, x: f32x8<S>) -> f32x8<S> {
    let one = f32x8::splat(simd, 1.0);
    match kernel {
        Kernel::Gaussian => {
            let narrow = f32x8::splat(simd, -0.5 / (scale * scale));
            let mut sum = vector::exp(simd, x * x * narrow);
            // Images within six standard deviations: beyond, single precision sees nothing.
            let mut turn = std::f32::consts::TAU;
            while turn - std::f32::consts::PI < (6.0 * scale).min(60.0) {
                let (a, b) = (x - f32x8::splat(simd, turn), x + f32x8::splat(simd, turn));
                sum = sum + vector::exp(simd, a * a * narrow) + vector::exp(simd, b * b * narrow);
                turn += std::f32::consts::TAU;
            }
            sum * f32x8::splat(simd, norm)
        }
        Kernel::Logistic => {
            let e = vector::exp(simd, x * f32x8::splat(simd, -1.0 / scale));
            e * f32x8::splat(simd, norm) / ((one + e) * (one + e))
        }
    }
}

#[inline(always)]
fn integrate_at_once<S: Simd, F: Real>(
    simd: S,
    section: &Single,
    w: &[[F; HALF_NODES]; 4],
) -> ([[f32; 3]; 4], [f32; 4]) {
    let zero = f32x8::splat(simd, 0.0);
    let mut n = [[zero; 3]; 4];
    let mut density = [zero; 4];
    let phi = f32x8::splat(simd, section.phi);
    let two = f32x8::splat(simd, 2.0);
    let optics = splat_optics(simd, &section.optics);
    let mut base = 0;
    for block in &section.rule.blocks {
        let gamma = f32x8::load_array_ref(simd, &block[0]);
        let c = f32x8::load_array_ref(simd, &block[3]);
        let path = paths(
            simd,
            &optics,
            &section.sigma_a,
            f32x8::load_array_ref(simd, &block[1]),
            f32x8::load_array_ref(simd, &block[2]),
        );
        let mut p = 0;
        while p < 4 {
            let d = if p == 3 {
                c * f32x8::splat(simd, 1.0 / std::f32::consts::PI)
            } else if section.wide[p] {
                let odd = two * (path.gamma_t * f32x8::splat(simd, p as f32) - gamma);
                let centre = phi - f32x8::splat(simd, p as f32 * std::f32::consts::PI);
                let a = vector::abs_wrapped(simd, centre - odd);
                let b = vector::abs_wrapped(simd, centre + odd);
                c * (kernel_at(simd, section.kernel, section.scales[p], section.norms[p], a)
                    + kernel_at(simd, section.kernel, section.scales[p], section.norms[p], b))
            } else {
                p += 1;
                continue;
            };
            let mut share = [0.0_f32; LANES];
            let mut lane = 0;
            while lane < LANES {
                share[lane] = w[p][base + lane].f64() as f32;
                lane += 1;
            }
            density[p] += f32x8::load_array_ref(simd, &share) * d;
            if p == 0 {
                n[0][0] += path.r * d;
            } else {
                let a = if p == 1 {
                    &path.tt
                } else if p == 2 {
                    &path.trt
                } else {
                    &path.residual
                };
                n[p][0] += a[0] * d;
                n[p][1] += a[1] * d;
                n[p][2] += a[2] * d;
            }
            p += 1;
        }
        base += LANES;
    }
    let mut out = [[0.0; 3]; 4];
    let mut out_density = [0.0; 4];
    let mut p = 0;
    while p < 4 {
        out_density[p] = vector::sum(density[p]);
        let mut channel = 0;
        while channel < 3 {
            out[p][channel] = vector::sum(n[p][if p == 0 { 0 } else { channel }]);
            channel += 1;
        }
        p += 1;
    }
    (out, out_density)
}

#[inline(always)]
fn shares_at_once<S: Simd>(
    simd: S,
    rule: &HalfRule,
    optics: &[[f32; 4]; 4],
    same: bool,
    sigma_a: [f32; 3],
    residual: bool,
    w: &mut [[f32; HALF_NODES]; 4],
) {
    let optics = [
        splat_optics(simd, &optics[0]),
        splat_optics(simd, &optics[1]),
        splat_optics(simd, &optics[2]),
        splat_optics(simd, &optics[3]),
    ];
    let mut base = 0;
    for block in &rule.blocks {
        let h = f32x8::load_array_ref(simd, &block[1]);
        let cos_gamma = f32x8::load_array_ref(simd, &block[2]);
        let mut lum = [f32x8::splat(simd, 0.0); 4];
        let mut path = paths(simd, &optics[0], &sigma_a, h, cos_gamma);
        let mut p = 0;
        while p < 4 {
            if p > 0 && !same && (p < 3 || residual) {
                path = paths(simd, &optics[p], &sigma_a, h, cos_gamma);
            }
            if p == 0 {
                lum[0] = path.r;
            } else if p < 3 || residual {
                let a = if p == 1 {
                    &path.tt
                } else if p == 2 {
                    &path.trt
                } else {
                    &path.residual
                };
                lum[p] = luminance(simd, a);
            }
            p += 1;
        }
        let total = (lum[0] + lum[1]) + (lum[2] + lum[3]);
        // Where there is nothing to share everything is R's.
        let none = total.simd_le(f32x8::splat(simd, 0.0));
        lum[0] = none.select(f32x8::splat(simd, 1.0), lum[0]);
        let total = none.select(f32x8::splat(simd, 1.0), total);
        let mut p = 0;
        while p < 4 {
            let share = (lum[p] / total).to_array();
            w[p][base..base + LANES].copy_from_slice(&share);
            p += 1;
        }
        base += LANES;
    }
}

#[inline(always)]
fn splat_optics<S: Simd>(simd: S, optics: &[f32; 4]) -> [f32x8<S>; 4] {
    [
        f32x8::splat(simd, optics[0]),
        f32x8::splat(simd, optics[1]),
        f32x8::splat(simd, optics[2]),
        f32x8::splat(simd, optics[3]),
    ]
}

/// Luminance of every lobe at one offset (`|h|` and `cos γ`), each with its own optics: a lobe to a lane.
#[inline(always)]
fn luminances_at_once<S: Simd>(simd: S, optics: &[[f32; 4]; 4], sigma_a: [f32; 3], at: [f32; 2]) -> [f32; 4] {
    let mut lanes = [[0.0_f32; LANES]; 4];
    let mut lane = 0;
    while lane < LANES {
        let own = &optics[lane % 4];
        lanes[0][lane] = own[0];
        lanes[1][lane] = own[1];
        lanes[2][lane] = own[2];
        lanes[3][lane] = own[3];
        lane += 1;
    }
    let optics = [
        f32x8::load_array_ref(simd, &lanes[0]),
        f32x8::load_array_ref(simd, &lanes[1]),
        f32x8::load_array_ref(simd, &lanes[2]),
        f32x8::load_array_ref(simd, &lanes[3]),
    ];
    let path = paths(simd, &optics, &sigma_a, f32x8::splat(simd, at[0]), f32x8::splat(simd, at[1]));
    let tt = luminance(simd, &path.tt).to_array();
    let trt = luminance(simd, &path.trt).to_array();
    let residual = luminance(simd, &path.residual).to_array();
    [path.r.to_array()[0], tt[1], trt[2], residual[3]]
}

#[inline(always)]
fn luminance<S: Simd>(simd: S, rgb: &[f32x8<S>; 3]) -> f32x8<S> {
    rgb[0] * f32x8::splat(simd, LUMINANCE[0] as f32)
        + rgb[1] * f32x8::splat(simd, LUMINANCE[1] as f32)
        + rgb[2] * f32x8::splat(simd, LUMINANCE[2] as f32)
}
