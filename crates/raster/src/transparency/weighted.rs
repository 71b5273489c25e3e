//! Weighted blended transparency: a mean instead of an order.
//!
//! *Theory:* McGuire & Bavoil 2013, *Weighted Blended Order-Independent Transparency*. The opacity of a pixel does not
//! depend on the order of its fragments and is exact; its colour is replaced by a mean with weights that fall with
//! depth. Their equation 10 is used with a depth that is linear between the clipping planes, where they have the
//! hardware's; the factor in front is smaller, which cancels. All fragments have a say however much hides them, so that
//! dense hair shows the colours of its inside: the technique is here to be compared with.
//!
//! *Resources:* sums of colours (16 bytes a pixel) and of optical depths (4 bytes), both written by one hair pass and
//! read by a pass over all pixels. Where the device cannot blend 32-bit floats these are halves: 8 and 2 bytes. A half
//! stops growing when what is added is less than a 4096th of it, so that fragments fainter than that get lost once the
//! pixel has an optical depth of 1; the mean of the colours suffers alike.
//!
//! *Rejected:* the product of what fragments let through, in 8 bits as the paper has it or as a half. Next to 1 rounding
//! drops opacities below 1/510 and 1/4096, and fragments of fine hair are fainter. The sum is finest where there is
//! little.

use crate::frame::{Frame, cleared};
use crate::gpu::{Gpu, GpuError};
use crate::meter::{Allocation, Fragments};
use crate::stage::{COLOR, Context, HairPass, OVER, ScreenPass, target};
use crate::strands::Part;
use crate::transparency::Technique;
use crate::transparency::opaque::{Layer, PLAIN, draw_screen, loaded};

const OWNER: &str = "weighted";
const HAIR: &str = include_str!("../../shaders/transparency/weighted.wgsl");
const RESOLVE: &str = include_str!("../../shaders/transparency/weighted_resolve.wgsl");

/// Format of a number per pixel that many small ones are added to: [`Gpu::sum_format`] with one channel.
pub(crate) fn sum_format(gpu: &Gpu) -> wgpu::TextureFormat {
    match gpu.sum_format() {
        wgpu::TextureFormat::Rgba32Float => wgpu::TextureFormat::R32Float,
        _ => wgpu::TextureFormat::R16Float,
    }
}

/// Adds.
pub(crate) const ADD: wgpu::BlendState = wgpu::BlendState { color: ADD_ONE, alpha: ADD_ONE };

const ADD_ONE: wgpu::BlendComponent = wgpu::BlendComponent {
    src_factor: wgpu::BlendFactor::One,
    dst_factor: wgpu::BlendFactor::One,
    operation: wgpu::BlendOperation::Add,
};

#[derive(Debug)]
struct Room {
    size: [u32; 2],
    colors: Layer,
    depth: Layer,
    group: wgpu::BindGroup,
}

/// See the head of this file.
#[derive(Debug)]
pub(crate) struct Weighted {
    layout: wgpu::BindGroupLayout,
    room: Option<Room>,
}

impl Weighted {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("weighted"),
            entries: &[
                loaded(0, PLAIN, wgpu::TextureViewDimension::D2),
                loaded(1, PLAIN, wgpu::TextureViewDimension::D2),
            ],
        });
        Self { layout, room: None }
    }
}

impl Technique for Weighted {
    fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) {
        if self.room.as_ref().is_some_and(|room| room.size == size) {
            return;
        }
        let colors = Layer::new(gpu, "weighted colours", size, gpu.sum_format());
        let depth = Layer::new(gpu, "weighted optical depth", size, sum_format(gpu));
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("weighted"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&colors.view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&depth.view) },
            ],
        });
        self.room = Some(Room { size, colors, depth, group });
    }

    fn record(&mut self, context: &Context<'_>, frame: &mut Frame) {
        let Some(room) = &self.room else { return };
        let hair = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "weighted sum",
                part: HAIR,
                fragment: "weighted_sum",
                shades: true,
                technique: None,
                targets: &[target(context.gpu.sum_format(), Some(ADD)), target(sum_format(context.gpu), Some(ADD))],
                depth: None,
                shape: context.settings.geometry.shape,
            },
        );
        let resolve = context.stage.screen(
            context.gpu,
            &ScreenPass {
                label: "weighted resolve",
                part: RESOLVE,
                fragment: "weighted_resolve",
                shades: false,
                technique: Some(&self.layout),
                targets: &[target(COLOR, Some(OVER))],
                depth: None,
            },
        );
        {
            let colors = [&room.colors, &room.depth].map(|sum| cleared(&sum.view, wgpu::Color::TRANSPARENT));
            let mut pass = frame.render(OWNER, "hair", &colors, None);
            pass.set_pipeline(&hair);
            pass.set_bind_group(0, context.view_group, &[]);
            pass.set_bind_group(2, context.shading_group, &[]);
            context.hair.draw(&mut pass, Part::All);
        }
        draw_screen(context, frame, [OWNER, "resolve"], &resolve, None, &room.group);
    }

    fn fragments(&mut self, _gpu: &Gpu) -> Result<Fragments, GpuError> {
        Ok(Fragments::default())
    }

    fn memory(&self) -> Vec<Allocation> {
        let Some(room) = &self.room else { return Vec::new() };
        vec![room.colors.memory(OWNER, "sums of colours"), room.depth.memory(OWNER, "optical depth")]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transparency::opaque::stubs;

    #[test]
    fn its_shaders_are_valid() {
        stubs::check_hair(HAIR, true, &["weighted_sum"]);
        stubs::check_screen(RESOLVE, false, &["weighted_resolve"]);
    }
}
