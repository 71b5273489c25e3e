//! A scene on the device, and how a frame of it is drawn.

use std::sync::Arc;
use std::time::Instant;

use film::Image;
use math::{Rgb, Vec3};
use scene::{Camera, Scene};

use crate::RasterError;
use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::lights::{LampOptions, Lamps};
use crate::meter::Report;
use crate::palette::Palette;
use crate::settings::{Geometry, Settings};
use crate::shade::Shading;
use crate::shadow::Shadows;
use crate::sky::Sky;
use crate::solid::Solids;
use crate::stage::{Context, Stage, Targets, texture_bytes};
use crate::strands::{Portion, Strands};
use crate::transparency::{Technique, technique};
use crate::view::View;

/// How often a frame is drawn until its buffers are large enough.
const MOST_ATTEMPTS: u32 = 6;

/// Most lamps that shaders know.
const MOST_LAMPS: usize = 32;

/// A scene, ready to be drawn.
pub struct Renderer {
    gpu: Gpu,
    scene: Arc<Scene>,
    settings: Settings,
    strands: Strands,
    solids: Solids,
    sky: Sky,
    lamps: Lamps,
    shading: Shading,
    stage: Stage,
    shadows: Shadows,
    shading_group: wgpu::BindGroup,
    hair: Portion,
    casting: Portion,
    technique: Box<dyn Technique>,
    targets: Option<Targets>,
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer").field("gpu", &self.gpu).field("settings", &self.settings).finish_non_exhaustive()
    }
}

/// Everything that settings decide besides what is drawn into.
struct Lit {
    lamps: Lamps,
    sky: Sky,
}

impl Renderer {
    /// Uploads a scene and makes what the settings need.
    ///
    /// # Errors
    /// When a setting is out of its range, the scene does not fit, or the device fails.
    pub fn new(gpu: &Gpu, scene: Arc<Scene>, settings: &Settings) -> Result<Self, RasterError> {
        settings.check()?;
        let palette = Palette::new(&scene, settings.shading.model, settings.shading.palette as usize);
        let strands = Strands::new(gpu, &scene, &palette)?;
        let solids = Solids::new(gpu, &scene)?;
        let Lit { lamps, sky } = lit(gpu, &scene, settings);
        let shading = Shading::new(gpu, &palette, settings)?;
        let stage = Stage::new(gpu, shading.layout().clone(), shading.text().to_owned());
        let shadows = shadows(gpu, &scene, settings, &lamps, &strands);
        let shading_group = shading.group(gpu, &shadows);
        let hair = strands.portion(gpu, &stage, &settings.geometry);
        let casting = strands.portion(gpu, &stage, &casting(settings));
        let technique = technique(gpu, settings);
        gpu.check()?;
        Ok(Self {
            gpu: gpu.clone(),
            scene,
            settings: *settings,
            strands,
            solids,
            sky,
            lamps,
            shading,
            stage,
            shadows,
            shading_group,
            hair,
            casting,
            technique,
            targets: None,
        })
    }

    /// The settings of the next frame.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Changes the settings; makes only what depends on those that changed.
    ///
    /// # Errors
    /// As [`new`](Self::new). The old settings stay then.
    pub fn set(&mut self, settings: &Settings) -> Result<(), RasterError> {
        settings.check()?;
        let old = std::mem::replace(&mut self.settings, *settings);
        let made = self.make(&old);
        if made.is_err() {
            self.settings = old;
        }
        made
    }

    fn make(&mut self, old: &Settings) -> Result<(), RasterError> {
        let (gpu, new) = (self.gpu.clone(), self.settings);
        if new.shading.model != old.shading.model || new.shading.palette != old.shading.palette {
            // Points name their fibers: everything on the device changes.
            *self = Self::new(&gpu, Arc::clone(&self.scene), &new)?;
            return Ok(());
        }
        if new.lights != old.lights {
            Lit { lamps: self.lamps, sky: self.sky } = lit(&gpu, &self.scene, &new);
        }
        let text_changed = new.shading != old.shading || new.lights != old.lights || new.shadow != old.shadow;
        if text_changed {
            let baked_as_before = new.shading.source == old.shading.source
                && new.shading.table_size == old.shading.table_size
                && new.shading.multiple.is_some() == old.shading.multiple.is_some()
                && new.lights.harmonics == old.lights.harmonics;
            if baked_as_before {
                self.shading.retext(&new)?;
            } else {
                let palette = Palette::new(&self.scene, new.shading.model, new.shading.palette as usize);
                self.shading = Shading::new(&gpu, &palette, &new)?;
            }
            self.stage = Stage::new(&gpu, self.shading.layout().clone(), self.shading.text().to_owned());
            self.shadows = shadows(&gpu, &self.scene, &new, &self.lamps, &self.strands);
            self.shading_group = self.shading.group(&gpu, &self.shadows);
        }
        if text_changed || new.geometry != old.geometry {
            self.hair = self.strands.portion(&gpu, &self.stage, &new.geometry);
            self.casting = self.strands.portion(&gpu, &self.stage, &casting(&new));
            // Pipelines know the shape, and are cached by name.
            self.stage = Stage::new(&gpu, self.shading.layout().clone(), self.shading.text().to_owned());
        }
        if new.transparency != old.transparency || new.shading.when != old.shading.when {
            self.technique = technique(&gpu, &new);
        }
        gpu.check()?;
        Ok(())
    }

    /// Draws a frame and waits for it.
    ///
    /// Techniques that keep fragments find out how many there are by drawing: a frame that did not fit is drawn
    /// again with more room, as often as [`Report::attempts`] says. Shadows are drawn once.
    ///
    /// # Errors
    /// When the picture has no pixels or too many, fragments find no room, or the device fails.
    pub fn draw(&mut self, camera: &Camera, size: [u32; 2]) -> Result<Report, RasterError> {
        let begin = Instant::now();
        let full = size.map(|n| n.saturating_mul(self.settings.supersample));
        let most = self.gpu.largest_side();
        if full.iter().any(|&n| n == 0 || n > most) {
            return Err(RasterError::Size { size: full, most });
        }
        if self.targets.as_ref().is_none_or(|targets| targets.size != full) {
            self.targets = Some(Targets::new(&self.gpu, full));
        }
        let bounds = bounds(&self.scene, &self.strands);
        let view = View::camera(camera, full, bounds);

        let mut frame = Frame::new(&self.gpu);
        self.shadows.record(&self.gpu, &self.stage, &mut frame, &self.casting, &self.solids);
        let mut spans = frame.finish(&self.gpu)?;
        let mut attempts = 0;
        let (fragments, rest) = loop {
            attempts += 1;
            let (fragments, spans) = self.attempt(&view, full)?;
            if fragments.dropped == 0 || !self.repairable() {
                break (fragments, spans);
            }
            if attempts == MOST_ATTEMPTS {
                return Err(RasterError::Overflow { dropped: fragments.dropped, attempts });
            }
        };
        spans.extend(rest);
        Ok(Report {
            spans,
            memory: self.memory(),
            fragments,
            wall_ms: begin.elapsed().as_secs_f64() * 1e3,
            attempts,
            notes: self.lamps.notes.iter().chain(self.shadows.notes()).cloned().collect(),
        })
    }

    /// Whether dropped fragments come back with more room. Those that a bounded semaphore lost do not.
    fn repairable(&self) -> bool {
        use crate::settings::{KPlusForm, Transparency};
        !matches!(
            self.settings.transparency,
            Transparency::KPlus { form: KPlusForm::MaxArray | KPlusForm::MaxHeap, .. }
        )
    }

    /// The scene and the hair, once.
    fn attempt(
        &mut self,
        view: &View,
        size: [u32; 2],
    ) -> Result<(crate::meter::Fragments, Vec<crate::meter::Span>), RasterError> {
        let Some(targets) = &self.targets else { return Err(RasterError::NotDrawn) };
        let gpu = &self.gpu;
        let view_group = self.stage.view(gpu, view, &targets.solid_view);
        let context = Context {
            gpu,
            stage: &self.stage,
            view,
            view_group: &view_group,
            shading_group: &self.shading_group,
            hair: &self.hair,
            targets,
            settings: &self.settings,
            spacing: self.strands.mean_spacing(),
        };
        let mut frame = Frame::new(gpu);
        self.sky.record(&context, &mut frame);
        self.solids.record(&context, &mut frame);
        self.technique.resize(gpu, size);
        self.technique.record(&context, &mut frame);
        let spans = frame.finish(gpu)?;
        Ok((self.technique.fragments(gpu)?, spans))
    }

    /// Everything that is allocated.
    fn memory(&self) -> Vec<crate::meter::Allocation> {
        let mut memory = self.strands.memory();
        memory.extend(self.solids.memory());
        memory.extend(self.sky.memory());
        memory.extend(self.shading.memory());
        memory.extend(self.shadows.memory());
        if let Some(targets) = &self.targets {
            for (name, texture) in [("picture", &targets.color), ("solid depth", &targets.solid)] {
                let (name, bytes) = (name.to_owned(), texture_bytes(texture));
                memory.push(crate::meter::Allocation { owner: "scene", name, bytes });
            }
        }
        memory.extend(self.technique.memory());
        memory
    }

    /// The last picture: linear radiance, and how much of each pixel is covered. Hidden parts of the scene are black.
    ///
    /// # Errors
    /// When nothing was drawn, or the device fails.
    pub fn image(&self) -> Result<Image, RasterError> {
        let Some(targets) = &self.targets else { return Err(RasterError::NotDrawn) };
        let bytes = self.gpu.fetch_texture(&targets.color, 0, wgpu::TextureAspect::All)?;
        let texels: Vec<[f32; 4]> = bytes
            .chunks_exact(8)
            .map(|texel| {
                std::array::from_fn(|c| fiber::table::from_half(u16::from_le_bytes([texel[2 * c], texel[2 * c + 1]])))
            })
            .collect();
        let n = self.settings.supersample;
        let [width, height] = targets.size.map(|side| side / n);
        let (mut pixels, mut alpha) = (Vec::new(), Vec::new());
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0_f32; 4];
                for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                    let texel = texels[((y * n + j) * targets.size[0] + x * n + i) as usize];
                    for (sum, x) in sum.iter_mut().zip(texel) {
                        *sum += x / (n * n) as f32;
                    }
                }
                pixels.push(Rgb([sum[0], sum[1], sum[2]]));
                alpha.push(sum[3].clamp(0.0, 1.0));
            }
        }
        Image::new(width, height, pixels, Some(alpha))
            .map_err(|_| RasterError::Size { size: targets.size, most: self.gpu.largest_side() })
    }
}

/// What the scene's lights become.
fn lit(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Lit {
    let lamps = Lamps::new(
        scene,
        &LampOptions {
            environment_directions: settings.lights.environment_directions,
            area_samples: settings.lights.area_samples,
            harmonics: settings.lights.harmonics,
            most: MOST_LAMPS,
        },
    );
    let sky = Sky::new(gpu, &lamps.sky);
    Lit { lamps, sky }
}

/// The strands that cast shadows.
fn casting(settings: &Settings) -> Geometry {
    Geometry { strands: settings.shadow.strands, opacity: 1.0, ..settings.geometry }
}

/// The box around everything.
fn bounds(scene: &Scene, strands: &Strands) -> (Vec3, Vec3) {
    let meshes = scene.meshes.iter().filter_map(|mesh| mesh.mesh.bounds());
    let union = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    meshes.chain(strands.bounds()).reduce(union).unwrap_or((Vec3::NEG_ONE, Vec3::ONE))
}

fn shadows(gpu: &Gpu, scene: &Scene, settings: &Settings, lamps: &Lamps, strands: &Strands) -> Shadows {
    let everything = bounds(scene, strands);
    let hair = strands.bounds().unwrap_or(everything);
    // The bias of depth maps must reach through one fiber.
    let radii = scene.grooms.iter().filter_map(|one| one.groom.radius.as_deref()).flatten();
    let radius = radii.copied().fold(0.0_f32, f32::max);
    Shadows::new(gpu, lamps, &settings.shadow, everything, hair, strands.mean_spacing(), radius)
}

#[cfg(test)]
impl Renderer {
    /// Draws what is solid, and then whatever a test wants.
    pub(crate) fn compose(
        &mut self,
        camera: &Camera,
        size: [u32; 2],
        draw: &mut dyn FnMut(&Context<'_>, &mut Frame),
    ) -> Result<(), RasterError> {
        if self.targets.as_ref().is_none_or(|targets| targets.size != size) {
            self.targets = Some(Targets::new(&self.gpu, size));
        }
        let Some(targets) = &self.targets else { return Err(RasterError::NotDrawn) };
        let view = View::camera(camera, size, bounds(&self.scene, &self.strands));
        let view_group = self.stage.view(&self.gpu, &view, &targets.solid_view);
        let context = Context {
            gpu: &self.gpu,
            stage: &self.stage,
            view: &view,
            view_group: &view_group,
            shading_group: &self.shading_group,
            hair: &self.hair,
            targets,
            settings: &self.settings,
            spacing: self.strands.mean_spacing(),
        };
        let mut frame = Frame::new(&self.gpu);
        self.shadows.record(&self.gpu, &self.stage, &mut frame, &self.casting, &self.solids);
        self.sky.record(&context, &mut frame);
        self.solids.record(&context, &mut frame);
        draw(&context, &mut frame);
        frame.finish(&self.gpu)?;
        Ok(())
    }

    /// The hair on the device.
    pub(crate) fn strands(&self) -> &Strands {
        &self.strands
    }
}
