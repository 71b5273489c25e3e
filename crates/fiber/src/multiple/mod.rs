//! Many fibers together: what light does between the fibers of a groom, without following it.

pub mod albedo;
pub mod dual_scattering;
pub mod spread;
