//! A parameter that may vary over a strand and from strand to strand.

use math::{Rgb, hash};

use super::StrandPoint;
use crate::file::Tone;

/// A parameter: its base value, the range it may take, and how it varies.
#[derive(Clone, Debug)]
pub(super) struct Varying<T> {
    pub(super) base: T,
    pub(super) least: f32,
    pub(super) most: f32,
    pub(super) variation: Option<Box<InMemory<T>>>,
}

/// How a parameter varies, ready to be evaluated.
#[derive(Clone, Debug)]
pub(super) struct InMemory<T> {
    /// Rising in its first component; may be empty.
    pub(super) ramp: Vec<(f32, T)>,
    pub(super) attribute: Option<String>,
    pub(super) scale: f32,
    pub(super) random: f32,
    pub(super) random_stream: u32,
    pub(super) noise: f32,
    pub(super) frequency: f32,
    pub(super) noise_stream: u32,
}

impl<T: Quantity> Varying<T> {
    /// Whether it is anything but a constant.
    pub(super) fn varies(&self) -> bool {
        self.variation.is_some()
    }

    /// The value at a point, or the base value.
    #[inline]
    pub(super) fn at(&self, at: Option<&StrandPoint<'_>>) -> T {
        let (Some(variation), Some(at)) = (&self.variation, at) else { return self.base };
        let base = variation
            .attribute
            .as_deref()
            .and_then(|name| T::attribute(name, at))
            .or_else(|| ramp_at(&variation.ramp, at.u))
            .map_or(self.base, |base| base.scaled(variation.scale, 0.0));
        let mut offset = 0.0;
        if variation.random > 0.0 {
            let stream = hash::mix2(variation.random_stream, at.seed);
            offset += variation.random * hash::signed(at.strand, stream);
        }
        if variation.noise > 0.0 {
            let stream = hash::mix3(variation.noise_stream, at.seed, at.strand);
            offset += variation.noise * hash::noise_1d(at.u * variation.frequency, stream);
        }
        base.scaled(1.0, offset).limited(self.least, self.most).unwrap_or(self.base)
    }
}

/// The ramp at `u`, straight between its points and level outside; `None` for an empty one.
#[inline]
pub(super) fn ramp_at<T: Quantity>(ramp: &[(f32, T)], u: f32) -> Option<T> {
    let after = ramp.partition_point(|&(x, _)| x <= u);
    let Some(&(x0, a)) = after.checked_sub(1).and_then(|i| ramp.get(i)) else {
        return ramp.first().map(|&(_, first)| first);
    };
    match ramp.get(after) {
        Some(&(x1, b)) if x1 > x0 => Some(T::mix(a, b, (u - x0) / (x1 - x0))),
        _ => Some(a),
    }
}

/// A number or a colour.
pub(super) trait Quantity: Copy {
    /// `None` for a colour where a number is wanted.
    fn from_tone(tone: Tone) -> Option<Self>;
    fn mix(a: Self, b: Self, t: f32) -> Self;
    fn scaled(self, factor: f32, offset: f32) -> Self;
    /// Within `[least, most]`; `None` when it is not finite.
    fn limited(self, least: f32, most: f32) -> Option<Self>;
    fn attribute(name: &str, at: &StrandPoint<'_>) -> Option<Self>;
}

impl Quantity for f32 {
    fn from_tone(tone: Tone) -> Option<Self> {
        match tone {
            Tone::Grey(x) => Some(x as Self),
            Tone::Colour(_) => None,
        }
    }

    #[inline]
    fn mix(a: Self, b: Self, t: f32) -> Self {
        math::lerp(a, b, t)
    }

    #[inline]
    fn scaled(self, factor: f32, offset: f32) -> Self {
        self * factor + offset
    }

    #[inline]
    fn limited(self, least: f32, most: f32) -> Option<Self> {
        self.is_finite().then(|| self.clamp(least, most))
    }

    fn attribute(name: &str, at: &StrandPoint<'_>) -> Option<Self> {
        at.attributes.float(name, at.strand as usize, at.point_index, at.frac)
    }
}

impl Quantity for Rgb {
    fn from_tone(tone: Tone) -> Option<Self> {
        Some(Self(tone.rgb().map(|x| x as f32)))
    }

    #[inline]
    fn mix(a: Self, b: Self, t: f32) -> Self {
        a.zip(b, |a, b| math::lerp(a, b, t))
    }

    #[inline]
    fn scaled(self, factor: f32, offset: f32) -> Self {
        self.map(|x| x * factor + offset)
    }

    #[inline]
    fn limited(self, least: f32, most: f32) -> Option<Self> {
        self.is_finite().then(|| self.map(|x| x.clamp(least, most)))
    }

    fn attribute(name: &str, at: &StrandPoint<'_>) -> Option<Self> {
        let strand = at.strand as usize;
        at.attributes
            .vec3(name, strand, at.point_index, at.frac)
            .map(Self)
            .or_else(|| at.attributes.float(name, strand, at.point_index, at.frac).map(Self::splat))
    }
}
