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
use crate::meter::{Allocation, Fragments, Report, Span};
use crate::palette::Palette;
use crate::settings::{Geometry, Settings, Shadow, Transparency};
use crate::shade::Shading;
use crate::shadow::{OpacityMap, Shadows};
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
    /// Samples a side of a pixel in the picture that the targets hold; `None`: they hold none.
    drawn: Option<u32>,
    /// Whether a change of settings ended half way: what is here does not fit together.
    stale: bool,
}

impl std::fmt::Debug for Renderer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer").field("gpu", &self.gpu).field("settings", &self.settings).finish_non_exhaustive()
    }
}

/// What a scene's lights become.
struct Lit {
    lamps: Lamps,
    sky: Sky,
}

/// One go at a frame.
struct Attempt {
    fragments: Fragments,
    /// Passes of shadow maps, if they were drawn.
    shadows: Vec<Span>,
    /// All other passes.
    rest: Vec<Span>,
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
            drawn: None,
            stale: false,
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

    /// Pieces between two points of all strands.
    pub fn segments(&self) -> u64 {
        self.strands.segments()
    }

    /// How many lamps the scene's lights have become.
    pub fn lamps(&self) -> usize {
        self.shadows.lamp_count()
    }

    /// What the last frame's opacity map of a lamp holds; `None` if the technique has none, or there is no such lamp.
    ///
    /// # Errors
    /// When the device fails.
    pub fn opacities(&self, lamp: usize) -> Result<Option<OpacityMap>, RasterError> {
        Ok(self.shadows.fetch_layer(&self.gpu, lamp)?)
    }

    /// Changes the settings; makes only what depends on those that changed.
    ///
    /// # Errors
    /// As [`new`](Self::new). The old settings stay then, and the renderer can be used on.
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
        // Points name their fibers: with other fibers everything on the device changes.
        if self.stale || new.shading.model != old.shading.model || new.shading.palette != old.shading.palette {
            return self.rebuild();
        }
        // Until the last step is done.
        self.stale = true;
        let lit_anew = new.lights != old.lights;
        if lit_anew {
            Lit { lamps: self.lamps, sky: self.sky } = lit(&gpu, &self.scene, &new);
        }
        let baked_as_before = new.shading.source == old.shading.source
            && new.shading.table_size == old.shading.table_size
            && new.shading.multiple.is_some() == old.shading.multiple.is_some()
            && new.lights.harmonics == old.lights.harmonics;
        let text = self.shading.text().to_owned();
        if baked_as_before {
            self.shading.retext(&new)?;
        } else {
            let palette = Palette::new(&self.scene, new.shading.model, new.shading.palette as usize);
            self.shading = Shading::new(&gpu, &palette, &new)?;
        }
        // The filter is in the text alone; everything else about shadows is in maps or in the table of lamps.
        let shadows_anew = lit_anew || Shadow { filter: old.shadow.filter, ..new.shadow } != old.shadow;
        if shadows_anew {
            self.shadows = shadows(&gpu, &self.scene, &new, &self.lamps, &self.strands);
        }
        if shadows_anew || !baked_as_before {
            self.shading_group = self.shading.group(&gpu, &self.shadows);
        }
        // Pipelines know the text and the shape, and are cached by name. They are what takes longest to make: most
        // settings are numbers in buffers, and change neither. Layouts are the same whenever what they describe is, so
        // that groups of before and after go together.
        if self.shading.text() != text || new.geometry.shape != old.geometry.shape {
            self.stage = Stage::new(&gpu, self.shading.layout().clone(), self.shading.text().to_owned());
        }
        if new.geometry != old.geometry {
            self.hair = self.strands.portion(&gpu, &self.stage, &new.geometry);
        }
        if casting(&new) != casting(old) {
            self.casting = self.strands.portion(&gpu, &self.stage, &casting(&new));
        }
        if new.transparency != old.transparency || new.shading.when != old.shading.when {
            self.technique = technique(&gpu, &new);
        }
        gpu.check()?;
        self.stale = false;
        Ok(())
    }

    /// Makes everything anew but the last picture; nothing is changed if that fails.
    fn rebuild(&mut self) -> Result<(), RasterError> {
        let new = Self::new(&self.gpu, Arc::clone(&self.scene), &self.settings)?;
        let (targets, drawn) = (self.targets.take(), self.drawn);
        *self = Self { targets, drawn, ..new };
        Ok(())
    }

    /// Draws a frame and waits for it.
    ///
    /// Techniques that keep fragments find out how many there are by drawing: a frame that did not fit is drawn
    /// again with more room, as often as [`Report::attempts`] says. Shadows are drawn once.
    ///
    /// # Errors
    /// When the picture has no pixels or too many, fragments find no room, or the device fails. There is no picture
    /// then; another frame can be drawn, unless the device is lost.
    pub fn draw(&mut self, camera: &Camera, size: [u32; 2]) -> Result<Report, RasterError> {
        let begin = Instant::now();
        self.drawn = None;
        self.gpu.check()?;
        let full = size.map(|n| n.saturating_mul(self.settings.supersample));
        let most = self.gpu.largest_side();
        if full.iter().any(|&n| n == 0 || n > most) {
            return Err(RasterError::Size { size: full, most });
        }
        if self.stale {
            self.rebuild()?;
        }
        let drawn = self.draw_frame(camera, full);
        match &drawn {
            Ok(_) => self.drawn = Some(self.settings.supersample),
            Err(RasterError::Gpu(_)) => {
                // What was made for this frame may be there in name only.
                self.targets = None;
                self.technique = technique(&self.gpu, &self.settings);
            }
            Err(_) => {}
        }
        drawn.map(|report| Report { wall_ms: begin.elapsed().as_secs_f64() * 1e3, ..report })
    }

    /// The same for a picture of so many samples, without the clock.
    fn draw_frame(&mut self, camera: &Camera, size: [u32; 2]) -> Result<Report, RasterError> {
        if self.targets.as_ref().is_none_or(|targets| targets.size != size) {
            // The old ones go before there are new ones.
            self.targets = None;
            self.targets = Some(Targets::new(&self.gpu, size));
        }
        let view = View::camera(camera, size, bounds(&self.scene, &self.strands));
        let (mut spans, mut attempts) = (Vec::new(), 0);
        let fragments = loop {
            attempts += 1;
            let Attempt { fragments, shadows, rest } = self.attempt(&view, size, attempts == 1)?;
            spans.extend(shadows);
            if fragments.dropped == 0 || !self.repairable() {
                spans.extend(rest);
                break fragments;
            }
            if attempts == MOST_ATTEMPTS {
                return Err(RasterError::Overflow { dropped: fragments.dropped, attempts });
            }
        };
        let mut notes: Vec<String> = self.lamps.notes.iter().chain(self.shadows.notes()).cloned().collect();
        if camera.aperture_radius > 0.0 {
            notes.push("the camera's aperture is a point here: everything is in focus".to_owned());
        }
        Ok(Report { spans, memory: self.memory(), fragments, wall_ms: 0.0, attempts, notes })
    }

    /// Whether dropped fragments come back with more room. Those of a K+-buffer do not: it has the same room always,
    /// and loses fragments to a bounded semaphore or to rounding.
    fn repairable(&self) -> bool {
        !matches!(self.settings.transparency, Transparency::KPlus { .. })
    }

    /// The scene and the hair, once; with shadow maps, if they are not there yet.
    fn attempt(&mut self, view: &View, size: [u32; 2], shadows: bool) -> Result<Attempt, RasterError> {
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
        if shadows {
            self.shadows.record(gpu, &self.stage, &mut frame, &self.casting, &self.solids);
        }
        let shadow_passes = frame.passes();
        self.sky.record(&context, &mut frame);
        self.solids.record(&context, &mut frame);
        self.technique.resize(gpu, size);
        self.technique.record(&context, &mut frame);
        let mut shadows = frame.finish(gpu)?;
        let rest = shadows.split_off(shadow_passes);
        Ok(Attempt { fragments: self.technique.fragments(gpu)?, shadows, rest })
    }

    /// Everything that is allocated.
    fn memory(&self) -> Vec<Allocation> {
        let mut memory = self.strands.memory();
        memory.extend(self.solids.memory());
        memory.extend(self.sky.memory());
        memory.extend(self.shading.memory());
        memory.extend(self.shadows.memory());
        if let Some(targets) = &self.targets {
            for (name, texture) in [("picture", &targets.color), ("solid depth", &targets.solid)] {
                let (name, bytes) = (name.to_owned(), texture_bytes(texture));
                memory.push(Allocation { owner: "scene", name, bytes });
            }
        }
        memory.extend(self.technique.memory());
        memory
    }

    /// The last picture: linear radiance, and how much of each pixel is covered. Hidden parts of the scene are black.
    ///
    /// # Errors
    /// When nothing was drawn, or the last attempt to draw failed, or the device fails.
    pub fn image(&self) -> Result<Image, RasterError> {
        // The settings may have changed since.
        let (Some(targets), Some(n)) = (&self.targets, self.drawn) else { return Err(RasterError::NotDrawn) };
        let bytes = self.gpu.fetch_texture(&targets.color, 0, wgpu::TextureAspect::All)?;
        let texels: Vec<[f32; 4]> = bytes
            .chunks_exact(8)
            .map(|texel| {
                std::array::from_fn(|c| fiber::table::from_half(u16::from_le_bytes([texel[2 * c], texel[2 * c + 1]])))
            })
            .collect();
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

/// Makes lamps and a sky of the scene's lights.
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
        self.drawn = None;
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
}
