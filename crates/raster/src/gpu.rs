//! The device: choosing an adapter, asking it for no more than is needed, and hearing of its errors.

use std::panic::AssertUnwindSafe;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What the user may say about the device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// Part of the adapter's name, in any case; `None`: the most capable one, which is never a software adapter while
    /// there is another that suffices.
    pub adapter: Option<String>,
    /// What may be asked of it.
    pub tier: Tier,
}

/// How much of the adapter is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tier {
    /// All that helps: larger bindings, timers, blending of 32-bit floats.
    #[default]
    Native,
    /// The default limits of WebGPU and no optional feature but timers: what every browser has.
    Web,
    /// The same without timers.
    Bare,
}

/// Why there is no device, or no longer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// Nothing that could draw.
    #[error(
        "no graphics adapter was found; a software one will do: on Debian or Ubuntu `apt-get install \
         mesa-vulkan-drivers libvulkan1`, on Fedora `dnf install mesa-vulkan-drivers vulkan-loader`, on Arch `pacman -S \
         vulkan-swrast vulkan-icd-loader`"
    )]
    NoAdapter,
    /// None of that name.
    #[error("no graphics adapter is called {wanted:?}; there are: {}", .found.join(", "))]
    UnknownAdapter {
        /// What was asked for.
        wanted: String,
        /// What there is.
        found: Vec<String>,
    },
    /// The adapter cannot do what every technique needs.
    #[error("the adapter {adapter:?} does not suffice: {lack}")]
    Incapable {
        /// Its name.
        adapter: String,
        /// What it lacks.
        lack: String,
    },
    /// The device went away.
    #[error("the graphics device was lost ({0}); open it again, or choose another adapter")]
    Lost(String),
    /// The device ran out of memory.
    #[error("the graphics device is out of memory ({0}); draw a smaller picture, fewer strands or smaller shadow maps")]
    OutOfMemory(String),
    /// The device refused what it was told. This is a mistake of this program.
    #[error("the graphics device refused a command, which is a mistake in this program: {0}")]
    Refused(String),
}

/// An adapter, for people and for tables.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterDescription {
    /// As its driver calls it.
    pub name: String,
    /// Vulkan, Metal, DX12 or the browser.
    pub backend: String,
    /// The driver and its version.
    pub driver: String,
    /// Whether a CPU does the work: its times say nothing of GPUs.
    pub software: bool,
}

impl std::fmt::Display for AdapterDescription {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}", self.name, self.backend)?;
        if !self.driver.is_empty() {
            write!(f, ", {}", self.driver)?;
        }
        if self.software {
            write!(f, ", software: times say nothing of GPUs")?;
        }
        write!(f, ")")
    }
}

impl AdapterDescription {
    fn of(info: &wgpu::AdapterInfo) -> Self {
        Self {
            name: info.name.clone(),
            backend: format!("{:?}", info.backend),
            driver: [info.driver.as_str(), info.driver_info.as_str()].join(" ").trim().to_owned(),
            software: info.device_type == wgpu::DeviceType::Cpu,
        }
    }
}

/// What the device said when nobody asked.
#[derive(Debug, Default)]
struct Complaints {
    lost: Option<String>,
    error: Option<GpuError>,
}

/// An open device.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    description: AdapterDescription,
    limits: wgpu::Limits,
    features: wgpu::Features,
    complaints: Arc<Mutex<Complaints>>,
}

/// What every technique needs beyond nothing: WebGPU's default limits.
fn web_limits() -> wgpu::Limits {
    wgpu::Limits::default()
}

impl Gpu {
    /// Opens the device that the options ask for.
    ///
    /// # Errors
    /// When there is no such adapter, or it cannot do what WebGPU promises.
    pub fn new(options: &GpuOptions) -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        if adapters.is_empty() {
            return Err(GpuError::NoAdapter);
        }
        // Stable: among equals the system's order counts.
        adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        });
        let wanted = options.adapter.as_ref().map(|wanted| wanted.to_lowercase());
        let is_wanted = |adapter: &&wgpu::Adapter| {
            wanted.as_ref().is_none_or(|wanted| adapter.get_info().name.to_lowercase().contains(wanted))
        };
        // One adapter is often there several times, by way of several drivers, not all of which suffice. If none does,
        // what the best one lacks is what there is to say.
        let mut lack = None;
        for adapter in adapters.iter().filter(is_wanted) {
            match Self::open(adapter, options.tier) {
                Ok(gpu) => return Ok(gpu),
                Err(error) => lack = lack.or(Some(error)),
            }
        }
        Err(lack.unwrap_or_else(|| GpuError::UnknownAdapter {
            wanted: options.adapter.clone().unwrap_or_default(),
            found: adapters.iter().map(|adapter| adapter.get_info().name).collect(),
        }))
    }

    /// The adapters of this machine.
    pub fn adapters() -> Vec<AdapterDescription> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        adapters.iter().map(|adapter| AdapterDescription::of(&adapter.get_info())).collect()
    }

    fn open(adapter: &wgpu::Adapter, tier: Tier) -> Result<Self, GpuError> {
        let description = AdapterDescription::of(&adapter.get_info());
        let incapable = |lack: String| GpuError::Incapable { adapter: description.name.clone(), lack };
        let web = web_limits();
        let has = adapter.limits();
        let mut lacking = Vec::new();
        for (name, found, needed) in [
            ("bind groups", has.max_bind_groups, web.max_bind_groups),
            (
                "storage buffers a stage",
                has.max_storage_buffers_per_shader_stage,
                web.max_storage_buffers_per_shader_stage,
            ),
            ("texture side", has.max_texture_dimension_2d, web.max_texture_dimension_2d),
            ("texture layers", has.max_texture_array_layers, web.max_texture_array_layers),
        ] {
            if found < needed {
                lacking.push(format!("{name}: {found} of {needed}"));
            }
        }
        // What WebGPU promises and drivers of older interfaces may not have; limits do not tell.
        let can = adapter.get_downlevel_capabilities().flags;
        for (name, needed) in [
            ("storage buffers in vertex shaders", wgpu::DownlevelFlags::VERTEX_STORAGE),
            ("storage buffers in fragment shaders", wgpu::DownlevelFlags::FRAGMENT_STORAGE),
            ("fragment shaders that write storage buffers", wgpu::DownlevelFlags::FRAGMENT_WRITABLE_STORAGE),
            ("blending of each target by itself", wgpu::DownlevelFlags::INDEPENDENT_BLEND),
            ("packing of half-precision numbers", wgpu::DownlevelFlags::SHADER_F16_IN_F32),
        ] {
            if !can.contains(needed) {
                lacking.push(format!("it has no {name}"));
            }
        }
        let wanted = match tier {
            Tier::Native => wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::FLOAT32_BLENDABLE,
            Tier::Web => wgpu::Features::TIMESTAMP_QUERY,
            Tier::Bare => wgpu::Features::empty(),
        };
        if !lacking.is_empty() {
            return Err(incapable(lacking.join(", ")));
        }
        let features = wanted & adapter.features();
        let mut limits = web;
        if tier == Tier::Native {
            limits.max_storage_buffer_binding_size = has.max_storage_buffer_binding_size;
            limits.max_buffer_size = has.max_buffer_size;
            limits.max_texture_dimension_2d = has.max_texture_dimension_2d;
            limits.max_color_attachment_bytes_per_sample = has.max_color_attachment_bytes_per_sample;
        }
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("cuticle"),
            required_features: features,
            required_limits: limits.clone(),
            ..Default::default()
        }))
        .map_err(|error| incapable(error.to_string()))?;
        Ok(Self::over(device, queue, description, features, limits))
    }

    /// Over a device that someone else opened, a window for example.
    pub fn from_parts(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let (description, features, limits) =
            (AdapterDescription::of(&device.adapter_info()), device.features(), device.limits());
        Self::over(device, queue, description, features, limits)
    }

    fn over(
        device: wgpu::Device,
        queue: wgpu::Queue,
        description: AdapterDescription,
        features: wgpu::Features,
        limits: wgpu::Limits,
    ) -> Self {
        let complaints = Arc::new(Mutex::new(Complaints::default()));
        let heard = Arc::clone(&complaints);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let mut heard = lock(&heard);
            // The first one: those behind it follow from it.
            if heard.error.is_none() {
                heard.error = Some(match error {
                    wgpu::Error::OutOfMemory { source } => GpuError::OutOfMemory(source.to_string()),
                    other => GpuError::Refused(other.to_string()),
                });
            }
        }));
        let heard = Arc::clone(&complaints);
        device.set_device_lost_callback(move |reason, message| {
            lock(&heard).lost = Some(if message.is_empty() { format!("{reason:?}") } else { message });
        });
        Self { device, queue, description, limits, features, complaints }
    }

    /// Which adapter it is.
    pub fn description(&self) -> &AdapterDescription {
        &self.description
    }

    /// Whether passes can be timed.
    pub fn has_timestamps(&self) -> bool {
        self.features.contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// Format of sums that need more digits than a half has, where the device can blend it.
    pub(crate) fn sum_format(&self) -> wgpu::TextureFormat {
        if self.features.contains(wgpu::Features::FLOAT32_BLENDABLE) {
            wgpu::TextureFormat::Rgba32Float
        } else {
            wgpu::TextureFormat::Rgba16Float
        }
    }

    /// The same device, taken for one whose buffers and bindings hold no more than so many bytes.
    #[cfg(test)]
    pub(crate) fn confined(&self, bytes: u64) -> Self {
        let mut confined = self.clone();
        confined.limits.max_storage_buffer_binding_size = bytes;
        confined.limits.max_buffer_size = bytes;
        confined
    }

    /// Largest storage buffer that a shader can see, bytes.
    pub fn largest_binding(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// Longest side of a picture, pixels.
    pub fn largest_side(&self) -> u32 {
        self.limits.max_texture_dimension_2d
    }

    /// What went wrong since the device was opened, if anything did.
    ///
    /// # Errors
    /// The first error that the device reported, or that it is lost.
    pub fn check(&self) -> Result<(), GpuError> {
        // A device says that it is gone only when it is asked.
        let polled = self.poll(wgpu::PollType::Poll);
        self.heard()?;
        polled
    }

    /// The first complaint.
    fn heard(&self) -> Result<(), GpuError> {
        let mut heard = lock(&self.complaints);
        if let Some(why) = &heard.lost {
            return Err(GpuError::Lost(why.clone()));
        }
        heard.error.take().map_or(Ok(()), Err)
    }

    /// Waits until everything submitted is done.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn wait(&self) -> Result<(), GpuError> {
        let polled = self.poll(wgpu::PollType::wait_indefinitely());
        self.heard()?;
        polled
    }

    /// Asks the device how far it is, or waits for it.
    fn poll(&self, how: wgpu::PollType) -> Result<(), GpuError> {
        // A device that is really lost (its driver was reset, it was unplugged) is first noticed here, and `wgpu` has no
        // other answer to that than a panic. Nothing of ours is in the middle of a change while it runs: what is caught
        // here is an error like others. Its message still goes to standard error.
        match std::panic::catch_unwind(AssertUnwindSafe(|| self.device.poll(how))) {
            Ok(polled) => polled.map(|_| ()).map_err(|error| GpuError::Lost(error.to_string())),
            Err(_) => {
                let why = "while it was waited for".to_owned();
                lock(&self.complaints).lost.get_or_insert_with(|| why.clone());
                Err(GpuError::Lost(why))
            }
        }
    }

    /// Gives the device up, as if it had been lost: for tests of what happens then.
    pub fn lose(&self) {
        self.device.destroy();
    }

    /// A buffer with this content. Unlike those that are mapped at creation it is no panic on a lost device.
    pub(crate) fn buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let size = (contents.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT).max(4);
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        });
        if contents.len() as u64 == size {
            self.queue.write_buffer(&buffer, 0, contents);
        } else {
            let mut padded = contents.to_vec();
            padded.resize(size as usize, 0);
            self.queue.write_buffer(&buffer, 0, &padded);
        }
        buffer
    }

    /// Whether a line has one pixel for each row or column that it crosses, whichever are more, and not as many as it is
    /// long: the standard allows both, and only trying tells.
    pub(crate) fn slants_lines(&self) -> Result<bool, GpuError> {
        // 48 columns and 38.4 rows: 48 pixels, or 61.5.
        const TEXT: &str = "
@vertex
fn trial_vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(select(vec2f(-0.75, -0.75), vec2f(0.75, 0.45), i == 1u), 0.0, 1.0);
}

@fragment
fn trial_fragment() -> @location(0) vec4f {
    return vec4f(1.0);
}
";
        const SIDE: u32 = 64;
        let format = wgpu::TextureFormat::R8Unorm;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let texture = self.device.create_texture(&crate::stage::texture_2d("trial", [SIDE; 2], 1, format, usage));
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("trial"),
            source: wgpu::ShaderSource::Wgsl(TEXT.into()),
        });
        let pipeline = self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("trial"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("trial_vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::LineList,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("trial_fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[crate::stage::target(format, None)],
            }),
            multiview_mask: None,
            cache: None,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("trial") });
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("trial"),
                color_attachments: &[crate::frame::cleared(&view, wgpu::Color::TRANSPARENT)],
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_pipeline(&pipeline);
            pass.draw(0..2, 0..1);
        }
        self.queue.submit([encoder.finish()]);
        let texels = self.fetch_texture(&texture, 0, wgpu::TextureAspect::All)?;
        Ok(texels.iter().filter(|&&texel| texel > 0).count() < 54)
    }

    /// The content of a buffer with `MAP_READ`.
    pub(crate) fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
        let slice = buffer.slice(..);
        slice.map_async(wgpu::MapMode::Read, |_| {});
        self.wait()?;
        let range = slice.get_mapped_range().map_err(|error| GpuError::Lost(error.to_string()))?;
        let bytes = range.to_vec();
        drop(range);
        buffer.unmap();
        Ok(bytes)
    }

    /// The content of any buffer with `COPY_SRC`, by way of a copy.
    pub(crate) fn fetch(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
        let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("fetch"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("fetch") });
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        self.read(&copy)
    }

    /// The texels of one layer of a texture with `COPY_SRC`, row by row without gaps.
    pub(crate) fn fetch_texture(
        &self,
        texture: &wgpu::Texture,
        layer: u32,
        aspect: wgpu::TextureAspect,
    ) -> Result<Vec<u8>, GpuError> {
        let texel = texture.format().block_copy_size(Some(aspect)).unwrap_or(4);
        let (width, height) = (texture.width(), texture.height());
        let row = width * texel;
        let stride = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        // As many rows at a time as one buffer holds. Depth is copied as a whole or not at all.
        let fitting = (self.limits.max_buffer_size / u64::from(stride)).clamp(1, u64::from(height)) as u32;
        let most = if texture.format().is_depth_stencil_format() { height } else { fitting };
        let mut texels = Vec::with_capacity(row as usize * height as usize);
        for y in (0..height).step_by(most as usize) {
            let rows = most.min(height - y);
            let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("fetch"),
                size: u64::from(stride) * u64::from(rows),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            let mut encoder =
                self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("fetch") });
            encoder.copy_texture_to_buffer(
                wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: 0, y, z: layer },
                    aspect,
                },
                wgpu::TexelCopyBufferInfo {
                    buffer: &copy,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(stride),
                        rows_per_image: Some(rows),
                    },
                },
                wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 },
            );
            self.queue.submit([encoder.finish()]);
            let padded = self.read(&copy)?;
            texels.extend(padded.chunks_exact(stride as usize).flat_map(|line| &line[..row as usize]));
        }
        Ok(texels)
    }
}

/// A panic elsewhere must not hide what the device has to say.
fn lock(complaints: &Mutex<Complaints>) -> MutexGuard<'_, Complaints> {
    complaints.lock().unwrap_or_else(PoisonError::into_inner)
}
