//! The contract that every model fulfils, and the closed set of models.

pub(crate) mod chiang;
pub(crate) mod deon;
pub(crate) mod field;
pub(crate) mod fur;
pub(crate) mod hery;
pub(crate) mod kajiya_kay;
pub(crate) mod lambertian;
pub(crate) mod marschner;
pub(crate) mod sadeghi;

use std::ops::{Index, IndexMut};

use math::{Real, Rgb};

use crate::{Chiang, ChiangGroom, Deon, DeonGroom, Dir, Fur, Hery, Hit, KajiyaKay, Lambertian, Marschner, Sadeghi};

/// How many uniform numbers [`Scatter::sample`] takes; a model may use fewer.
pub const DIMS: usize = 5;

/// Index of the reflection lobe in [`Lobes`].
pub const R: usize = 0;
/// Index of the double transmission lobe.
pub const TT: usize = 1;
/// Index of the lobe with one internal reflection.
pub const TRT: usize = 2;
/// Index of everything else: higher-order paths, or a model's diffuse part.
pub const RESIDUAL: usize = 3;

/// What the lobes are called, in the order of their indices.
pub const LOBE_NAMES: [&str; 4] = ["R", "TT", "TRT", "residual"];

/// A value per lobe: R, TT, TRT, residual.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lobes<F = f32>(pub [Rgb<F>; 4]);

impl<F: Real> Lobes<F> {
    /// All lobes zero.
    #[inline]
    pub fn zero() -> Self {
        Self([Rgb::black(); 4])
    }

    /// All in one lobe.
    #[inline]
    pub fn only(lobe: usize, value: Rgb<F>) -> Self {
        let mut lobes = Self::zero();
        lobes.0[lobe] = value;
        lobes
    }

    /// The whole: what a renderer multiplies by.
    #[inline]
    pub fn sum(&self) -> Rgb<F> {
        self.0[0] + self.0[1] + self.0[2] + self.0[3]
    }

    /// Every lobe times `x`.
    #[inline]
    pub fn scaled(self, x: F) -> Self {
        Self(self.0.map(|lobe| lobe * x))
    }
}

impl<F> Index<usize> for Lobes<F> {
    type Output = Rgb<F>;

    #[inline]
    fn index(&self, lobe: usize) -> &Rgb<F> {
        &self.0[lobe]
    }
}

impl<F> IndexMut<usize> for Lobes<F> {
    #[inline]
    fn index_mut(&mut self, lobe: usize) -> &mut Rgb<F> {
        &mut self.0[lobe]
    }
}

/// A direction drawn by a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<F = f32> {
    /// The sampled direction.
    pub dir: Dir<F>,
    /// What the light from there is multiplied by, per lobe. Its expectation at a direction is
    /// `fcos / pdf`; it is exactly that except for the joint and clamped weights of
    /// [`Deon`](crate::Deon).
    pub weight: Lobes<F>,
    /// Density of the direction per steradian; `None` where it costs a quadrature that only multiple
    /// importance sampling needs: ask [`Scatter::pdf`].
    pub pdf: Option<F>,
    /// The lobe that was drawn from.
    pub lobe: usize,
}

/// What one fiber model must answer: set-up for one shading point, then any number of directions.
pub trait Model<F: Real>: Copy {
    /// The model with everything worked out that depends on the known direction alone.
    type Setup: Scatter<F>;

    /// Works out what the known direction and the offset determine.
    fn prepare(&self, hit: &Hit<F>) -> Self::Setup;
}

/// Scattering at one shading point. Allocates nothing.
///
/// Values are `fcos`, the scattering function times `cos θ_s`; densities are per steradian.
pub trait Scatter<F: Real> {
    /// `fcos` towards `s`, per lobe.
    fn eval(&self, s: Dir<F>) -> Lobes<F>;

    /// Density of [`sample`](Self::sample) at `s`.
    fn pdf(&self, s: Dir<F>) -> F;

    /// [`eval`](Self::eval) and [`pdf`](Self::pdf) together, for less than both.
    #[inline]
    fn eval_pdf(&self, s: Dir<F>) -> (Lobes<F>, F) {
        (self.eval(s), self.pdf(s))
    }

    /// Draws a direction; `None` means that the path ends here. `u` is uniform in `[0, 1)`.
    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>>;
}

/// Smaller densities than this are treated as an impossible draw: the weight has no digits left.
pub(crate) const MIN_PDF: f64 = 1e-12;

/// Finishes a draw whose weight is value over density; refuses what is not finite.
#[inline]
pub(crate) fn finish<F: Real>(dir: Dir<F>, fcos: Lobes<F>, pdf: F, lobe: usize) -> Option<Sample<F>> {
    if !(pdf > F::of(MIN_PDF)) || !pdf.is_finite() {
        return None;
    }
    let weight = fcos.scaled(pdf.recip());
    weight.sum().is_finite().then_some(Sample { dir, weight, pdf: Some(pdf), lobe })
}

macro_rules! fibers {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {
        /// The closed set of models.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Fiber<F = f32> {
            $($(#[$doc])* $name($name<F>),)*
        }

        /// Any model, set up for a shading point.
        #[derive(Clone, Copy, Debug)]
        pub enum FiberSetup<F: Real = f32> {
            $($(#[$doc])* $name(<$name<F> as Model<F>>::Setup),)*
        }

        impl<F: Real> Model<F> for Fiber<F> {
            type Setup = FiberSetup<F>;

            #[inline]
            fn prepare(&self, hit: &Hit<F>) -> FiberSetup<F> {
                match self {
                    $(Self::$name(model) => FiberSetup::$name(model.prepare(hit)),)*
                }
            }
        }

        impl<F: Real> Scatter<F> for FiberSetup<F> {
            #[inline]
            fn eval(&self, s: Dir<F>) -> Lobes<F> {
                match self {
                    $(Self::$name(point) => point.eval(s),)*
                }
            }

            #[inline]
            fn pdf(&self, s: Dir<F>) -> F {
                match self {
                    $(Self::$name(point) => point.pdf(s),)*
                }
            }

            #[inline]
            fn eval_pdf(&self, s: Dir<F>) -> (Lobes<F>, F) {
                match self {
                    $(Self::$name(point) => point.eval_pdf(s),)*
                }
            }

            #[inline]
            fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
                match self {
                    $(Self::$name(point) => point.sample(u),)*
                }
            }
        }

        $(impl<F> From<$name<F>> for Fiber<F> {
            fn from(model: $name<F>) -> Self {
                Self::$name(model)
            }
        })*
    };
}

fibers! {
    /// d'Eon et al. 2011 with the sampler of 2013.
    Deon,
    /// Chiang et al. 2016.
    Chiang,
    /// An opaque diffuse cylinder.
    Lambertian,
    /// Kajiya & Kay 1989.
    KajiyaKay,
    /// The R lobes of Hery & Ramamoorthi 2012.
    Hery,
    /// Marschner et al. 2003.
    Marschner,
    /// Sadeghi et al. 2010.
    Sadeghi,
    /// Fur with a medulla, after Yan et al. 2017.
    Fur,
}

/// A fiber with everything that is the same at every shading point of a groom of equal fibers: prepares the same
/// set-ups for less.
#[derive(Clone, Copy, Debug)]
pub enum GroomFiber<F: Real = f32> {
    /// d'Eon et al.
    Deon(DeonGroom<F>),
    /// Chiang et al.
    Chiang(ChiangGroom<F>),
    /// Models with nothing worth keeping.
    Other(Fiber<F>),
}

impl<F: Real> GroomFiber<F> {
    /// [`Fiber::is_round`].
    #[inline]
    pub fn is_round(&self) -> bool {
        match self {
            Self::Deon(_) | Self::Chiang(_) => true,
            Self::Other(fiber) => fiber.is_round(),
        }
    }
}

impl<F: Real> Model<F> for GroomFiber<F> {
    type Setup = FiberSetup<F>;

    #[inline]
    fn prepare(&self, hit: &Hit<F>) -> FiberSetup<F> {
        match self {
            Self::Deon(groom) => FiberSetup::Deon(groom.prepare(hit)),
            Self::Chiang(groom) => FiberSetup::Chiang(groom.prepare(hit)),
            Self::Other(fiber) => fiber.prepare(hit),
        }
    }
}

impl<F: Real> Fiber<F> {
    /// Works out what no shading point changes, for grooms whose parameters do not vary.
    pub fn for_groom(&self) -> GroomFiber<F> {
        match self {
            Self::Deon(model) => GroomFiber::Deon(model.for_groom()),
            Self::Chiang(model) => GroomFiber::Chiang(model.for_groom()),
            other => GroomFiber::Other(*other),
        }
    }

    /// The same fiber in another precision.
    pub fn cast<G: Real>(&self) -> Fiber<G> {
        match self {
            Self::Deon(m) => Fiber::Deon(m.cast()),
            Self::Chiang(m) => Fiber::Chiang(m.cast()),
            Self::Lambertian(m) => Fiber::Lambertian(m.cast()),
            Self::KajiyaKay(m) => Fiber::KajiyaKay(m.cast()),
            Self::Hery(m) => Fiber::Hery(m.cast()),
            Self::Marschner(m) => Fiber::Marschner(m.cast()),
            Self::Sadeghi(m) => Fiber::Sadeghi(m.cast()),
            Self::Fur(m) => Fiber::Fur(m.cast()),
        }
    }

    /// The model's name, as in scene files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Deon(_) => "deon",
            Self::Chiang(_) => "chiang",
            Self::Lambertian(_) => "lambertian",
            Self::KajiyaKay(_) => "kajiya_kay",
            Self::Hery(_) => "hery",
            Self::Marschner(_) => "marschner",
            Self::Sadeghi(_) => "sadeghi",
            Self::Fur(_) => "fur",
        }
    }

    /// Whether the fiber looks the same from all sides. If not, absolute azimuths count: azimuth 0 is where the
    /// longer diameter points.
    pub fn is_round(&self) -> bool {
        match self {
            Self::Marschner(marschner) => marschner.eccentricity == F::one(),
            _ => true,
        }
    }
}

/// Picks an index with the given probabilities; returns `xi` rescaled to be uniform again.
#[inline]
pub(crate) fn pick<F: Real>(q: &[F; 4], xi: F) -> (usize, F) {
    let mut below = F::zero();
    for (p, &share) in q.iter().enumerate() {
        if xi < below + share {
            let again = (xi - below) / share;
            return (p, again.clamp_to(F::zero(), F::ONE_MINUS_EPSILON));
        }
        below += share;
    }
    // Rounding left a sliver above the last share: it belongs to the last lobe that has any.
    let last = (0..4).rev().find(|&p| q[p] > F::zero()).unwrap_or(0);
    (last, F::ONE_MINUS_EPSILON)
}
