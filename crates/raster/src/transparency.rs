//! How fragments become pixels: one technique a file, all with the same inputs and the same output.

pub(crate) mod a_buffer;
mod bands;
mod blend;
mod chain;
mod dbk;
pub(crate) mod k_plus;
mod opaque;
mod subsets;
mod weighted;

use crate::frame::Frame;
use crate::gpu::{Gpu, GpuError};
use crate::meter::{Allocation, Fragments};
use crate::settings::{Settings, Transparency};
use crate::stage::Context;

/// One way to put fragments of hair together.
///
/// The picture already holds what is solid; a technique blends the hair over it, premultiplied
/// ([`OVER`](crate::stage::OVER)).
pub(crate) trait Technique {
    /// Makes room for a picture of this size, if there is not enough; called before each frame.
    fn resize(&mut self, gpu: &Gpu, size: [u32; 2]);

    /// Appends its passes.
    fn record(&mut self, context: &Context<'_>, frame: &mut Frame);

    /// After the frame is done: what became of the fragments. When some were dropped, the next
    /// [`resize`](Self::resize) makes the room that was missing, and the caller draws again.
    fn fragments(&mut self, gpu: &Gpu) -> Result<Fragments, GpuError>;

    /// What it keeps allocated.
    fn memory(&self) -> Vec<Allocation>;
}

/// Makes the technique that the settings ask for.
pub(crate) fn technique(gpu: &Gpu, settings: &Settings) -> Box<dyn Technique> {
    match settings.transparency {
        Transparency::Opaque => Box::new(opaque::Opaque::new(gpu, settings)),
        Transparency::Blend { sort } => Box::new(blend::Blend::new(gpu, sort)),
        Transparency::Weighted => Box::new(weighted::Weighted::new(gpu)),
        Transparency::ABuffer { foremost } => Box::new(a_buffer::ABuffer::new(gpu, foremost)),
        Transparency::KPlus { k, form } => Box::new(k_plus::KPlus::new(gpu, k, form)),
        Transparency::Dbk { shift } => Box::new(dbk::Dbk::new(gpu, shift)),
        Transparency::RandomSubsets { k } => Box::new(subsets::Subsets::new(gpu, k)),
    }
}
