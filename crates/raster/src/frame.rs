//! One frame while it is recorded: passes are opened here, so that none can forget its timer.

use crate::gpu::{Gpu, GpuError};
use crate::meter::Span;

/// Most passes that are timed in one frame.
const MOST_PASSES: u32 = 1024;

/// Commands of one frame.
#[derive(Debug)]
pub(crate) struct Frame {
    pub(crate) encoder: wgpu::CommandEncoder,
    spans: Vec<(&'static str, String)>,
    queries: Option<wgpu::QuerySet>,
}

impl Frame {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        let queries = gpu.has_timestamps().then(|| {
            gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timers"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST_PASSES,
            })
        });
        Self { encoder, spans: Vec::new(), queries }
    }

    /// Begins a pass that draws. `owner` is the technique it belongs to.
    pub(crate) fn render(
        &mut self,
        owner: &'static str,
        pass: impl Into<String>,
        color: &[Option<wgpu::RenderPassColorAttachment<'_>>],
        depth: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
    ) -> wgpu::RenderPass<'_> {
        let pass = pass.into();
        let at = self.spans.len() as u32;
        self.spans.push((owner, pass));
        let timestamp_writes =
            self.queries.as_ref().filter(|_| at < MOST_PASSES).map(|query_set| wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(2 * at),
                end_of_pass_write_index: Some(2 * at + 1),
            });
        self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(owner),
            color_attachments: color,
            depth_stencil_attachment: depth,
            timestamp_writes,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }

    /// How many passes were begun.
    pub(crate) fn passes(&self) -> usize {
        self.spans.len()
    }

    /// Submits everything, waits, and says how long each pass took.
    pub(crate) fn finish(mut self, gpu: &Gpu) -> Result<Vec<Span>, GpuError> {
        let timed = (self.spans.len() as u32).min(MOST_PASSES);
        let buffers = match &self.queries {
            Some(queries) if timed > 0 => {
                let size = 16 * u64::from(timed);
                let make = |usage| {
                    gpu.device.create_buffer(&wgpu::BufferDescriptor {
                        label: Some("timers"),
                        size,
                        usage,
                        mapped_at_creation: false,
                    })
                };
                let resolved = make(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
                let copy = make(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
                self.encoder.resolve_query_set(queries, 0..2 * timed, &resolved, 0);
                self.encoder.copy_buffer_to_buffer(&resolved, 0, &copy, 0, size);
                Some(copy)
            }
            _ => None,
        };
        gpu.queue.submit([self.encoder.finish()]);
        let times: Vec<f64> = match &buffers {
            None => Vec::new(),
            Some(copy) => {
                let bytes = gpu.read(copy)?;
                let period = f64::from(gpu.queue.get_timestamp_period());
                let ticks: Vec<u64> =
                    bytes.chunks_exact(8).map(|b| u64::from_le_bytes(b.try_into().unwrap_or_default())).collect();
                ticks.chunks_exact(2).map(|pair| pair[1].saturating_sub(pair[0]) as f64 * period * 1e-6).collect()
            }
        };
        gpu.wait()?;
        let spans = self.spans.into_iter().enumerate();
        Ok(spans.map(|(i, (owner, pass))| Span { owner, pass, ms: times.get(i).copied() }).collect())
    }
}

/// Clears a colour attachment.
pub(crate) fn cleared(view: &wgpu::TextureView, to: wgpu::Color) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(to), store: wgpu::StoreOp::Store },
    })
}

/// Draws onto what a colour attachment has.
pub(crate) fn kept(view: &wgpu::TextureView) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
    })
}

/// A depth attachment, cleared to the far plane first or kept as it is.
pub(crate) fn depth(view: &wgpu::TextureView, clear: bool) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: if clear { wgpu::LoadOp::Clear(1.0) } else { wgpu::LoadOp::Load },
            store: wgpu::StoreOp::Store,
        }),
        stencil_ops: None,
    }
}
