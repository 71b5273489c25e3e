//! The pieces that models are made of: longitudinal densities, azimuthal densities, attenuation.

pub mod attenuation;
pub mod azimuthal;
pub mod bessel;
pub mod caustic;
pub(crate) mod cross_section;
pub mod longitudinal;
pub mod roots;
pub(crate) mod shapes;
pub(crate) mod vector;
