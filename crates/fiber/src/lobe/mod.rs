//! The pieces that models are made of: longitudinal densities, azimuthal densities, attenuation.

pub mod attenuation;
pub mod azimuthal;
pub mod bessel;
pub mod longitudinal;
