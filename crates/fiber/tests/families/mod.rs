//! Families of fibers with seeded parameters, and inputs to evaluate them for: what shaders are compared with models on,
//! by an interpreter here and by a device in the renderer that has one.

#![allow(dead_code, unreachable_pub, reason = "every test target is a crate of its own and uses another part")]

use std::f32::consts::PI;

use fiber::lobe::caustic::Caustic;
use fiber::lobe::roots::Roots;
use fiber::{
    ArtistLobe, Attenuation, Chiang, Deon, Dir, Fiber, Field, Fur, Glint, Hery, HeryLobe, HeryMode, Highlight, Hit,
    KajiyaKay, KajiyaKayMode, Lambertian, Marschner, MarschnerNorm, Medulla, Model, Sadeghi, SadeghiMode, Scatter,
    Weights,
};
use math::{Real, Rgb, hash};

/// Seeded numbers for one input.
pub struct Draws {
    stream: u32,
    index: u32,
    dim: u32,
}

impl Draws {
    pub fn new(stream: u32, index: u32) -> Self {
        Self { stream, index, dim: 0 }
    }

    pub fn unit(&mut self) -> f32 {
        self.dim += 1;
        hash::to_unit(hash::mix3(self.stream, self.index, self.dim))
    }

    /// Exactly the same number in either precision.
    pub fn real<F: Real>(&mut self, low: f32, high: f32) -> F {
        F::of(f64::from(low + (high - low) * self.unit()))
    }

    pub fn degrees<F: Real>(&mut self, low: f32, high: f32) -> F {
        F::of(f64::from((low + (high - low) * self.unit()).to_radians()))
    }

    pub fn color<F: Real>(&mut self, high: f32) -> Rgb<F> {
        let [r, g, b] = std::array::from_fn(|_| self.real(0.0, high));
        Rgb::new(r, g, b)
    }

    pub fn coin(&mut self) -> bool {
        self.unit() < 0.5
    }
}

fn deon<F: Real>(d: &mut Draws) -> Fiber<F> {
    Fiber::Deon(Deon {
        eta: d.real(1.3, 1.8),
        sigma_a: d.color(1.5),
        beta_m: d.degrees(3.0, 25.0),
        beta_n: d.degrees(3.0, 40.0),
        alpha: d.degrees(-10.0, 10.0),
        residual: d.coin(),
        attenuation: if d.coin() { Attenuation::Difference } else { Attenuation::Known },
        weights: Weights::Marginal,
        field: Field::Near,
    })
}

fn deon_in<F: Real>(d: &mut Draws, field: Field) -> Fiber<F> {
    let Fiber::Deon(model) = deon(d) else { unreachable!("a model of d'Eon was made") };
    // The shader's rule is made for these.
    Fiber::Deon(Deon { field, beta_n: d.degrees(7.5, 40.0), ..model })
}

fn deon_far<F: Real>(d: &mut Draws) -> Fiber<F> {
    deon_in(d, Field::Far)
}

fn deon_auto<F: Real>(d: &mut Draws) -> Fiber<F> {
    deon_in(d, Field::Auto)
}

fn chiang_in<F: Real>(d: &mut Draws, field: Field, least: f32) -> Fiber<F> {
    Fiber::Chiang(Chiang {
        beta_m: d.real(0.1, 1.0),
        beta_n: d.real(least, 0.7),
        alpha: d.degrees(-10.0, 10.0),
        eta: d.real(1.3, 1.8),
        sigma_a: d.color(1.5),
        field,
    })
}

fn chiang<F: Real>(d: &mut Draws) -> Fiber<F> {
    chiang_in(d, Field::Near, 0.1)
}

fn chiang_far<F: Real>(d: &mut Draws) -> Fiber<F> {
    chiang_in(d, Field::Far, 0.2)
}

fn chiang_auto<F: Real>(d: &mut Draws) -> Fiber<F> {
    chiang_in(d, Field::Auto, 0.2)
}

fn lambertian<F: Real>(d: &mut Draws) -> Fiber<F> {
    Fiber::Lambertian(Lambertian { albedo: d.color(1.0) })
}

fn kajiya_kay<F: Real>(d: &mut Draws) -> Fiber<F> {
    let both = d.coin();
    let mut highlight =
        || Highlight { color: d.color(0.5), exponent: d.real(0.0, 80.0), shift: d.degrees(-15.0, 15.0) };
    let highlights = [highlight(), if both { highlight() } else { Highlight::none() }];
    let mode = if d.coin() { KajiyaKayMode::Normalised } else { KajiyaKayMode::Thesis };
    Fiber::KajiyaKay(KajiyaKay { diffuse: d.color(0.5), highlights, mode })
}

fn hery<F: Real>(d: &mut Draws) -> Fiber<F> {
    let both = d.coin();
    let mut lobe = || HeryLobe { tint: d.color(0.5), beta: d.degrees(2.0, 19.0), alpha: d.degrees(-10.0, 10.0) };
    let lobes = [lobe(), if both { lobe() } else { HeryLobe::none() }];
    let mode = match (3.0 * d.unit()) as u32 {
        0 => HeryMode::Truncated,
        1 => HeryMode::Faithful,
        _ => HeryMode::FaithfulExactPdf,
    };
    Fiber::Hery(Hery { lobes, mode, cos_theta_d: d.coin() })
}

fn marschner<F: Real>(d: &mut Draws) -> Fiber<F> {
    Fiber::Marschner(Marschner {
        eta: d.real(1.3, 1.8),
        sigma_a: d.color(1.0),
        beta_m: d.degrees(3.0, 15.0),
        alpha: d.degrees(-10.0, 2.0),
        eccentricity: if d.coin() { F::one() } else { d.real(0.85, 1.0) },
        roots: if d.coin() { Roots::Exact } else { Roots::Cubic },
        norm: if d.coin() { MarschnerNorm::Normalised } else { MarschnerNorm::AsPrinted },
        caustic: d.coin().then(|| Caustic {
            strength: d.real(0.5, 5.0),
            width: d.degrees(5.0, 25.0),
            fade: d.real(0.2, 0.4),
            limit: F::of(0.5),
        }),
        diffuse: d.color(0.2),
    })
}

fn sadeghi<F: Real>(d: &mut Draws) -> Fiber<F> {
    let lobes = std::array::from_fn(|_| ArtistLobe {
        color: d.color(1.0),
        intensity: d.real(0.1, 1.0),
        shift: d.degrees(-15.0, 15.0),
        width: d.degrees(3.0, 20.0),
    });
    Fiber::Sadeghi(Sadeghi {
        lobes,
        tt_azimuthal_width: d.degrees(5.0, 40.0),
        glint: Glint { intensity: d.real(0.0, 3.0), width: d.degrees(2.0, 15.0), angle: d.degrees(20.0, 60.0) },
        mode: if d.coin() { SadeghiMode::Normalised } else { SadeghiMode::Legacy },
    })
}

fn fur<F: Real>(d: &mut Draws) -> Fiber<F> {
    Fiber::Fur(Fur {
        eta: d.real(1.3, 1.8),
        sigma_a: d.color(1.5),
        beta_m: d.degrees(3.0, 25.0),
        beta_n: d.degrees(3.0, 40.0),
        alpha: d.degrees(-10.0, 10.0),
        layers: d.real(1.0, 3.0),
        medulla: Medulla {
            radius: d.real(0.0, 0.95),
            scattering: d.real(0.0, 8.0),
            absorption: d.color(0.5),
            anisotropy: d.real(-0.7, 0.95),
        },
    })
}

/// A family of models to be compared.
pub struct Case {
    pub double: fn(&mut Draws) -> Fiber<f64>,
    pub single: fn(&mut Draws) -> Fiber<f32>,
    pub inputs: u32,
    /// Whether the fiber's width in pixels is passed on.
    pub wide: bool,
}

macro_rules! cases {
    ($($make:ident: $inputs:literal, $wide:literal;)*) => {
        &[$(Case { double: $make::<f64>, single: $make::<f32>, inputs: $inputs, wide: $wide },)*]
    };
}

/// Every model, one family each.
pub const CASES: &[Case] = cases! {
    deon: 4096, false;
    chiang: 4096, false;
    lambertian: 4096, false;
    kajiya_kay: 4096, false;
    hery: 4096, false;
    marschner: 4096, false;
    sadeghi: 4096, false;
    fur: 4096, false;
};

/// What takes a quadrature per value.
pub const FAR_CASES: &[Case] = cases! {
    deon_far: 512, false;
    chiang_far: 512, false;
    deon_auto: 256, true;
    chiang_auto: 256, true;
};

/// What single precision cannot tell from a direction or an offset: angles of up to π have a rounding of 2.4e-7,
/// and an exit azimuth is up to four times an angle.
const BLUR: f64 = 1e-6;

/// One thing to evaluate, what it should give, and how far a shader may be from that.
pub struct Question {
    pub fiber: Fiber,
    pub hit: Hit,
    pub s: Dir,
    /// Lobes, then channels, in double precision.
    pub want: [[f64; 3]; 4],
    /// How much the model itself changes when the direction or the offset is moved by its rounding: next to a caustic
    /// that is not blurred, or where a ray only just touches the medulla, that is a lot.
    pub blur: [[f64; 3]; 4],
    pub brightest: f64,
}

impl Question {
    /// Input `index` of a family. Half of the directions are where the lobes are.
    pub fn new(case: &Case, stream: u32, index: u32) -> Self {
        let double = (case.double)(&mut Draws::new(stream, index));
        let single = (case.single)(&mut Draws::new(stream, index));
        let mut d = Draws::new(stream + 1, index);
        let known: Dir<f32> = Dir::new(d.degrees(-80.0, 80.0), d.real(-PI, PI));
        let width = d.real(0.5, 2.0);
        let hit = Hit::new(known, d.real(-1.0, 1.0)).with_width(width);
        let hit_double = Hit::new(known.cast::<f64>(), f64::from(hit.h)).with_width(f64::from(width));
        let setup = double.prepare(&hit_double);
        let mut s = Dir::<f32>::new(d.degrees(-88.0, 88.0), d.real(-PI, PI));
        if d.coin() {
            let u = std::array::from_fn(|_| f64::from(d.unit()));
            if let Some(sample) = setup.sample(u) {
                s = sample.dir.cast();
            }
        }
        let exact: Dir<f64> = s.cast();
        let values = |s: Dir<f64>| setup.eval(s).0.map(|lobe| lobe.0);
        let want = values(exact);
        let theta = exact.theta();
        let aside = [(BLUR, 0.0), (-BLUR, 0.0), (0.0, BLUR), (0.0, -BLUR)]
            .map(|(up, around)| values(Dir::new(theta + up, exact.phi + around)));
        let moved = [BLUR, -BLUR].map(|by| {
            let hit = Hit::new(hit_double.known, hit_double.h + by).with_width(hit_double.width_px);
            double.prepare(&hit).eval(exact).0.map(|lobe| lobe.0)
        });
        let brightest = want.iter().flatten().copied().fold(0.0, f64::max);
        let blur = std::array::from_fn(|p| {
            std::array::from_fn(|c: usize| {
                let others = aside.iter().chain(&moved).map(|other| (other[p][c] - want[p][c]).abs());
                others.fold(0.0, f64::max)
            })
        });
        Self { fiber: single, hit, s, want, blur, brightest }
    }

    /// What is wrong with an answer: beyond `relative` of the brightest lobe, `absolute` where nothing is, and `blurs`
    /// times the model's own change.
    pub fn wrong(&self, got: &[[f32; 3]; 4], relative: f64, absolute: f64, blurs: f64) -> Vec<String> {
        let mut wrong = Vec::new();
        for p in 0..4 {
            for channel in 0..3 {
                let (got, want) = (f64::from(got[p][channel]), self.want[p][channel]);
                let allowed = relative * self.brightest + absolute + blurs * self.blur[p][channel];
                // Written so that what is no number is wrong.
                if !((got - want).abs() <= allowed) {
                    let Self { fiber, hit, s, .. } = self;
                    wrong.push(format!("lobe {p}: {got:e}, not {want:e} ± {allowed:.1e}: {fiber:?} {hit:?} {s:?}"));
                }
            }
        }
        wrong
    }
}
