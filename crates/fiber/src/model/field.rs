//! Near field or far field: whether the offset across the fiber matters.

use math::Real;

use super::Lobes;

/// Whether the offset of the hit matters.
///
/// Source: the hierarchy of Zinke & Weber 2007; the average of the near field over the offset is the far
/// field, so the choice changes noise and how a wide fiber looks, not how much light there is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Field {
    /// The hit's own offset: right at any distance, no quadrature, noise averages over the fiber.
    #[default]
    Near,
    /// The cross-section integrated out: right when the fiber is thinner than a pixel.
    Far,
    /// Far where the fiber looks thinner than 0.75 pixels, near where it looks wider than 1.5, and a blend
    /// between: by [`Hit::width_px`](crate::Hit::width_px).
    Auto,
}

/// Widths in pixels between which near and far field are blended.
const BLEND_PX: [f64; 2] = [0.75, 1.5];

impl Field {
    /// Share of the near field for a fiber that looks this wide.
    #[inline]
    pub(crate) fn near_share<F: Real>(self, width_px: F) -> F {
        match self {
            Self::Near => F::one(),
            Self::Far => F::zero(),
            Self::Auto => {
                let [far, near] = BLEND_PX.map(F::of);
                ((width_px - far) / (near - far)).clamp_to(F::zero(), F::one())
            }
        }
    }
}

/// Value and density of a mixture.
#[inline]
pub(crate) fn blend<F: Real>(near_share: F, near: (Lobes<F>, F), far: (Lobes<F>, F)) -> (Lobes<F>, F) {
    let far_share = F::one() - near_share;
    let mut fcos = near.0.scaled(near_share);
    for (sum, far) in fcos.0.iter_mut().zip(far.0.0) {
        *sum += far * far_share;
    }
    (fcos, near_share * near.1 + far_share * far.1)
}

/// Chooses the field to draw from: `None` for the near one, or a number that is uniform again.
#[inline]
pub(crate) fn split<F: Real>(near_share: F, xi: F) -> Option<F> {
    if xi < near_share {
        return None;
    }
    Some(((xi - near_share) / (F::one() - near_share)).clamp_to(F::zero(), F::ONE_MINUS_EPSILON))
}
