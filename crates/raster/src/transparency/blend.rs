//! Blending by the hardware in the order of drawing, which the CPU sorts.
//!
//! *Theory:* fragments drawn from back to front blend to what an exact sort gives. Only fragments have a depth, though;
//! what can be sorted is whole strands or their pieces, by the middle of each. Strands that cross, or run along the
//! view, come out wrong (figure 39 of the thesis, which sorts strands); pieces are short enough to be nearly right.
//!
//! *Resources:* none on the device besides a list of the sorted order, 4 bytes a segment, made anew for each frame. The
//! sort is wall time of the CPU, not of any pass.
//!
//! *Rejected:* a depth test by the hardware. Solid things are tested by hand as everywhere, and among fragments of hair
//! there is nothing to reject.

use crate::frame::{Frame, kept};
use crate::gpu::{Gpu, GpuError};
use crate::meter::{Allocation, Fragments};
use crate::settings::Sort;
use crate::stage::{COLOR, Context, HairPass, OVER, target};
use crate::strands::Part;
use crate::transparency::Technique;

const OWNER: &str = "blend";
const HAIR: &str = include_str!("../../shaders/transparency/blend.wgsl");

/// See the head of this file.
#[derive(Debug)]
pub(crate) struct Blend {
    sort: Sort,
    /// Bytes of the last frame's order.
    order: u64,
}

impl Blend {
    pub(crate) fn new(_gpu: &Gpu, sort: Sort) -> Self {
        Self { sort, order: 0 }
    }
}

impl Technique for Blend {
    fn resize(&mut self, _gpu: &Gpu, _size: [u32; 2]) {}

    fn record(&mut self, context: &Context<'_>, frame: &mut Frame) {
        let pipeline = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "blend",
                part: HAIR,
                fragment: "blend_over",
                shades: true,
                technique: None,
                targets: &[target(COLOR, Some(OVER))],
                depth: None,
                shape: context.settings.geometry.shape,
            },
        );
        self.order = if self.sort == Sort::None { 0 } else { context.hair.order_bytes() };
        let sorted = match self.sort {
            Sort::None => None,
            sort => Some(context.hair.sorted(context.gpu, context.stage, context.view, sort)),
        };
        let mut pass = frame.render(OWNER, "hair", &[kept(&context.targets.color_view)], None);
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        pass.set_bind_group(2, context.shading_group, &[]);
        sorted.as_ref().unwrap_or(context.hair).draw(&mut pass, Part::All);
    }

    fn fragments(&mut self, _gpu: &Gpu) -> Result<Fragments, GpuError> {
        Ok(Fragments::default())
    }

    fn memory(&self) -> Vec<Allocation> {
        if self.order == 0 {
            return Vec::new();
        }
        vec![Allocation { owner: OWNER, name: "sorted order".to_owned(), bytes: self.order }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transparency::opaque::stubs;

    #[test]
    fn its_shader_is_valid() {
        stubs::check_hair(HAIR, true, &["blend_over"]);
    }
}
