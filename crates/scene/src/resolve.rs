//! From the file to the scene: units, defaults, and every check that spares the renderers one.

use std::sync::Arc;

use groom::{Groom, Mesh, UpAxis};
use math::{Affine3A, Quat, Rgb, Vec3};

use crate::assets::Assets;
use crate::error::{SceneError, SceneErrorKind, closest, quoted_list};
use crate::file::{
    AxisKind, CameraSection, FilmSection, FilterKind, GroomSection, IntegratorKind, LightKind, LightSection,
    LookSection, MeshSection, OrbitSection, RenderSection, SceneFile, Tone, TransformSection, WidthSection,
};
use crate::framing::{Viewpoint, auto_camera, outline};
use crate::look;
use crate::procedural;
use crate::scene::{Camera, FilmSettings, Light, RenderSettings, Scene, SceneGroom, SceneMesh};
use crate::source::{Source, Text};

/// The farthest that anything may be from the origin, scene units: squares stay far inside `f32`.
const FARTHEST: f64 = 1e9;

/// Brightest radiance, intensity or irradiance: sums over many paths stay inside `f32`.
const BRIGHTEST: f64 = 1e9;

/// Most pixels of a picture; what the film accepts, too.
const MOST_PIXELS: u32 = 1 << 27;

/// Half angle below which a distant light is a single direction, radians: its disk has no digits left in `f32`.
const SMALLEST_DISK: f32 = 1e-3;

/// Least difference of the cosines between which a spot fades: a few times what a cosine in `f32` is known to, so
/// that nobody who divides by it has a case to tell apart.
const SHARPEST_FADE: f32 = 1e-6;

/// What hair is given when nobody says how thick it is, micrometres.
const DEFAULT_DIAMETER_UM: f64 = 80.0;

impl Scene {
    /// Reads a scene file, applies overrides such as `look.main.ior=1.5`, and gets everything it names.
    ///
    /// # Errors
    /// The first mistake in text, overrides, values or assets, with its place where it has one.
    pub fn load(text: &str, overrides: &[String], assets: &dyn Assets) -> Result<Self, SceneError> {
        let text = Text::new(text, overrides);
        let source = text.parse()?;
        scene(&source.file()?, &source, assets)
    }

    /// As [`load`](Self::load), from a file that is already typed; complaints then have key paths, but no
    /// lines.
    ///
    /// # Errors
    /// The first mistake in values or assets.
    pub fn resolve(file: &SceneFile, assets: &dyn Assets) -> Result<Self, SceneError> {
        let text = Text::new("", &[]);
        scene(file, &text.parse()?, assets)
    }
}

/// The looks of a scene file alone: no groom, mesh or picture is asked for.
///
/// # Errors
/// The first mistake in text, overrides or looks, with its place where it has one.
pub fn looks(text: &str, overrides: &[String]) -> Result<Vec<look::Look>, SceneError> {
    let text = Text::new(text, overrides);
    let source = text.parse()?;
    let file = source.file()?;
    file.look.iter().map(|(name, section)| Ok(look::resolve(name, section, &source)?.0)).collect()
}

/// The checked scene.
pub(crate) fn scene(file: &SceneFile, source: &Source<'_>, assets: &dyn Assets) -> Result<Scene, SceneError> {
    let mut resolver = Resolver { source, assets, unit_m: 1.0, warnings: Vec::new() };
    resolver.scene(file)
}

struct Resolver<'s, 't> {
    source: &'s Source<'t>,
    assets: &'s dyn Assets,
    unit_m: f64,
    warnings: Vec<String>,
}

impl Resolver<'_, '_> {
    fn scene(&mut self, file: &SceneFile) -> Result<Scene, SceneError> {
        self.number("scene.unit_m", file.scene.unit_m, 1e-9, 1e9)?;
        self.unit_m = file.scene.unit_m;
        let film = self.film(&file.film)?;
        let render = self.render(&file.render)?;
        let lights = self.lights(&file.light, file.render.integrator)?;
        // Looks before grooms: they are cheap to refuse, grooms are dear to read.
        let mut looks = Vec::with_capacity(file.look.len());
        for (name, section) in &file.look {
            let (look, warnings) = look::resolve(name, section, self.source)?;
            looks.push(look);
            self.warnings.extend(warnings);
        }
        if looks.is_empty() && !file.groom.is_empty() {
            looks.push(look::resolve("default", &LookSection::default(), self.source)?.0);
        }
        let names: Vec<&str> = looks.iter().map(look::Look::name).collect();
        let chosen: Vec<usize> = file
            .groom
            .iter()
            .enumerate()
            .map(|(index, section)| self.look_of(index, section, &names))
            .collect::<Result<_, _>>()?;
        if file.groom.is_empty() && file.mesh.is_empty() {
            let message = "there is nothing to see: the scene needs a [[groom]] or a [[mesh]]";
            return Err(SceneError::new(SceneErrorKind::Missing, message));
        }
        let meshes = self.meshes(&file.mesh)?;
        let mut grooms = Vec::with_capacity(file.groom.len());
        for (index, section) in file.groom.iter().enumerate() {
            let look = chosen[index];
            grooms.push(self.groom(index, section, look, looks[look].attributes())?);
        }
        let mut framed = outline(grooms.iter().flat_map(|g| g.groom.points()));
        if framed.is_empty() {
            framed = outline(meshes.iter().flat_map(|m| &m.mesh.positions));
        }
        let aspect = film.width as f32 / film.height as f32;
        let camera = self.camera(file.camera.as_ref(), &framed, aspect)?;
        Ok(Scene {
            name: file.scene.name.clone(),
            unit_m: self.unit_m as f32,
            camera,
            film,
            render,
            lights,
            meshes,
            grooms,
            looks,
            warnings: std::mem::take(&mut self.warnings),
        })
    }

    fn film(&self, film: &FilmSection) -> Result<FilmSettings, SceneError> {
        let default_width = if film.filter == FilterKind::Box { 1.0 } else { 1.5 };
        let filter_width = film.filter_width_px.unwrap_or(default_width);
        let width = self.count("film.width", film.width, 1, 16_384)?;
        let height = self.count("film.height", film.height, 1, 16_384)?;
        if width * height > MOST_PIXELS {
            let message = format!("`film` has {width} x {height} pixels; at most {MOST_PIXELS} can be held");
            return Err(self.source.at_value(SceneErrorKind::OutOfRange, "film.width", message));
        }
        Ok(FilmSettings {
            width,
            height,
            filter: film.filter.into(),
            filter_width: self.number("film.filter_width_px", filter_width, 0.1, 16.0)?,
            exposure_ev: self.number("film.exposure_ev", film.exposure_ev, -32.0, 32.0)?,
            view: film.view.into(),
        })
    }

    fn render(&self, render: &RenderSection) -> Result<RenderSettings, SceneError> {
        let clamp = self.number("render.clamp", render.clamp, 0.0, BRIGHTEST)?;
        Ok(RenderSettings {
            samples: self.count("render.samples", render.samples, 1, 1 << 24)?,
            max_depth: self.count("render.max_depth", render.max_depth, 1, 65_535)?,
            roulette_start: self.count("render.roulette_start", render.roulette_start, 0, u32::MAX)?,
            integrator: render.integrator.into(),
            heuristic: render.heuristic.into(),
            seed: render.seed,
            clamp: (clamp > 0.0).then_some(clamp),
            curve_shape: render.curve_shape.into(),
            curve_basis: render.curve_basis.into(),
            light_selection: render.light_selection.into(),
        })
    }

    // --- camera ---------------------------------------------------------------------------------

    fn camera(&self, section: Option<&CameraSection>, framed: &[Vec3], aspect: f32) -> Result<Camera, SceneError> {
        let automatic = CameraSection::default();
        let section = section.unwrap_or(&automatic);
        let fov_y = self.number("camera.fov_deg", section.fov_deg, 1.0, 170.0)?.to_radians();
        let up = self.direction("camera.up", section.up)?;
        let mut camera = match (section.position, &section.orbit) {
            (Some(_), Some(_)) => {
                let message = "`camera.orbit` stands beside `camera.position`; give one of the two";
                return Err(self.source.at_key(SceneErrorKind::Conflict, "camera.orbit", message));
            }
            (Some(position), None) => {
                let position = self.point("camera.position", position)?;
                let target = match section.target {
                    Some(target) => self.point("camera.target", target)?,
                    None => framed.iter().sum::<Vec3>() / framed.len().max(1) as f32,
                };
                let focus_distance = position.distance(target);
                Camera { position, target, up, fov_y, aperture_radius: 0.0, focus_distance }
            }
            (None, orbit) => {
                if section.target.is_some() {
                    let message = "`camera.target` needs `camera.position`; for automatic framing around a \
                                   target write orbit = { target = [x, y, z] }";
                    let path = "camera.target";
                    return Err(self.source.at_key(SceneErrorKind::Conflict, path, message));
                }
                let orbit = orbit.clone().unwrap_or_default();
                Camera { up, ..auto_camera(framed, self.orbit(&orbit)?, fov_y, aspect) }
            }
        };
        camera.aperture_radius = self.number("camera.aperture_radius", section.aperture_radius, 0.0, FARTHEST)?;
        if let Some(distance) = section.focus_distance {
            camera.focus_distance = self.number("camera.focus_distance", distance, 1e-6, FARTHEST)?;
        }
        let view = camera.target - camera.position;
        let Some(forward) = view.try_normalize() else {
            let message = "the camera stands in its target, so it looks nowhere";
            return Err(self.source.at_key(SceneErrorKind::Conflict, "camera.target", message));
        };
        // The sine of the angle between view and up; below this the picture's roll is rounding noise.
        if forward.cross(camera.up).length() < 1e-4 {
            let message = "the camera looks along its `camera.up`; choose another up";
            return Err(self.source.at_key(SceneErrorKind::Conflict, "camera.up", message));
        }
        Ok(camera)
    }

    fn orbit(&self, orbit: &OrbitSection) -> Result<Viewpoint, SceneError> {
        let target = match orbit.target {
            Some(target) => Some(self.point("camera.orbit.target", target)?),
            None => None,
        };
        let distance = match orbit.distance {
            Some(distance) => Some(self.number("camera.orbit.distance", distance, 1e-6, FARTHEST)?),
            None => None,
        };
        let azimuth = self.number("camera.orbit.azimuth_deg", orbit.azimuth_deg, -1e6, 1e6)?;
        let elevation = self.number("camera.orbit.elevation_deg", orbit.elevation_deg, -89.0, 89.0)?;
        Ok(Viewpoint { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), target, distance })
    }

    // --- lights ---------------------------------------------------------------------------------

    fn lights(&mut self, sections: &[LightSection], integrator: IntegratorKind) -> Result<Vec<Light>, SceneError> {
        let mut lights = Vec::with_capacity(sections.len().max(1));
        for (index, section) in sections.iter().enumerate() {
            let light = self.light(&format!("light.{index}"), section)?;
            let is_pointlike = match light {
                Light::Point { .. } | Light::Spot { .. } => true,
                Light::Distant { half_angle, .. } => half_angle == 0.0,
                _ => false,
            };
            if is_pointlike && integrator == IntegratorKind::BcsdfOnly {
                self.warnings.push(format!("light {index} has no size, so the integrator `bcsdf_only` never finds it"));
            }
            lights.push(light);
        }
        if lights.is_empty() {
            self.warnings.push("the scene has no [[light]]; it is lit by a white environment of radiance 1".into());
            lights.push(Light::Environment { image: None, radiance: Rgb::white(), rotation: 0.0, visible: true });
        }
        Ok(lights)
    }

    fn light(&self, path: &str, section: &LightSection) -> Result<Light, SceneError> {
        self.check_light_keys(path, section)?;
        let at = |key: &str| format!("{path}.{key}");
        let strength = self.number(&at("strength"), section.strength.unwrap_or(1.0), 0.0, BRIGHTEST)?;
        let emitted = |key: &str, tone: Option<Tone>| -> Result<Rgb, SceneError> {
            let value = self.tone(&at(key), tone.unwrap_or(Tone::Grey(1.0)), BRIGHTEST)? * strength;
            if value.max_channel() > BRIGHTEST as f32 {
                let message = format!("`{}` times the strength is above {BRIGHTEST}", at(key));
                return Err(self.source.at_value(SceneErrorKind::OutOfRange, &at(key), message));
            }
            Ok(value)
        };
        let visible = section.visible.unwrap_or(section.kind == LightKind::Environment);
        match section.kind {
            LightKind::Environment => {
                let rotation = self.number(&at("rotation_deg"), section.rotation_deg.unwrap_or(0.0), -1e6, 1e6)?;
                let image = match &section.file {
                    None => None,
                    Some(file) => {
                        let image = self.assets.environment(file).and_then(|image| {
                            image.check()?;
                            Ok(image)
                        });
                        let image = image.map_err(|error| {
                            let message = format!("environment `{file}`: {error}");
                            self.source.at_value(SceneErrorKind::Asset, &at("file"), message)
                        })?;
                        Some(Arc::new(image))
                    }
                };
                Ok(Light::Environment {
                    image,
                    radiance: emitted("radiance", section.radiance)?,
                    rotation: rotation.to_radians(),
                    visible,
                })
            }
            LightKind::Rectangle => {
                let center = self.required_point(path, "center", section.center)?;
                let normal = self.facing(path, (center, "centre"), section.aim, ("normal", section.normal))?;
                let width = self.required_length(path, "width", section.width)?;
                let height = self.required_length(path, "height", section.height)?;
                // Width is level; a rectangle that lies flat takes its width along x.
                let across = Vec3::Y.cross(normal).normalize_or(Vec3::X);
                Ok(Light::Rectangle {
                    center,
                    edge_u: across * width,
                    edge_v: normal.cross(across) * height,
                    normal,
                    radiance: emitted("radiance", section.radiance)?,
                    two_sided: section.two_sided.unwrap_or(false),
                    visible,
                })
            }
            LightKind::Sphere => Ok(Light::Sphere {
                center: self.required_point(path, "center", section.center)?,
                radius: self.required_length(path, "radius", section.radius)?,
                radiance: emitted("radiance", section.radiance)?,
                visible,
            }),
            LightKind::Point => Ok(Light::Point {
                position: self.required_point(path, "position", section.position)?,
                intensity: emitted("intensity", section.intensity)?,
            }),
            LightKind::Spot => {
                let position = self.required_point(path, "position", section.position)?;
                let direction =
                    self.facing(path, (position, "position"), section.aim, ("direction", section.direction))?;
                let cone = f64::from(self.number(&at("cone_deg"), section.cone_deg.unwrap_or(45.0), 1.0, 180.0)?);
                let blend = f64::from(self.number(&at("blend"), section.blend.unwrap_or(0.15), 0.0, 1.0)?);
                // Double precision: of a narrow cone's cosine only the last digits differ from 1.
                let half = 0.5 * cone.to_radians();
                let cos_outer = half.cos() as f32;
                Ok(Light::Spot {
                    position,
                    direction,
                    intensity: emitted("intensity", section.intensity)?,
                    cos_inner: ((half * (1.0 - blend)).cos() as f32).max(cos_outer + SHARPEST_FADE),
                    cos_outer,
                })
            }
            LightKind::Distant => {
                let Some(direction) = section.direction else {
                    return Err(self.missing(path, "direction"));
                };
                let angle = section.angle_deg.unwrap_or(0.0);
                Ok(Light::Distant {
                    direction: self.direction(&at("direction"), direction)?,
                    irradiance: emitted("irradiance", section.irradiance)?,
                    half_angle: {
                        let half = 0.5 * self.number(&at("angle_deg"), angle, 0.0, 90.0)?.to_radians();
                        if half < SMALLEST_DISK { 0.0 } else { half }
                    },
                })
            }
        }
    }

    /// Where a rectangle or a spot faces: towards its `aim`, or along the vector of the key that takes its place.
    /// With its place comes what that is called.
    fn facing(
        &self,
        path: &str,
        (place, place_name): (Vec3, &str),
        aim: Option<[f64; 3]>,
        (key, vector): (&str, Option<[f64; 3]>),
    ) -> Result<Vec3, SceneError> {
        match (aim, vector) {
            (Some(_), Some(_)) => {
                let path = format!("{path}.{key}");
                let message = format!("`{path}` stands beside `aim`; give one of the two");
                Err(self.source.at_key(SceneErrorKind::Conflict, &path, message))
            }
            (None, None) => Err(self.missing(path, "aim")),
            (None, Some(vector)) => self.direction(&format!("{path}.{key}"), vector),
            (Some(aim), None) => {
                let path = format!("{path}.aim");
                (self.point(&path, aim)? - place).try_normalize().ok_or_else(|| {
                    let message = format!("`{path}` is the {place_name} of the light, so it faces nowhere");
                    self.source.at_value(SceneErrorKind::OutOfRange, &path, message)
                })
            }
        }
    }

    /// Refuses keys of other kinds of light.
    fn check_light_keys(&self, path: &str, light: &LightSection) -> Result<(), SceneError> {
        let (kind, own): (&str, &[&str]) = match light.kind {
            LightKind::Environment => ("environment", &["radiance", "file", "strength", "rotation_deg", "visible"]),
            LightKind::Rectangle => (
                "rectangle",
                &["center", "aim", "normal", "width", "height", "radiance", "strength", "two_sided", "visible"],
            ),
            LightKind::Sphere => ("sphere", &["center", "radius", "radiance", "strength", "visible"]),
            LightKind::Point => ("point", &["position", "intensity", "strength"]),
            LightKind::Spot => {
                ("spot", &["position", "aim", "direction", "intensity", "cone_deg", "blend", "strength"])
            }
            LightKind::Distant => ("distant", &["direction", "irradiance", "angle_deg", "strength"]),
        };
        let given = [
            ("radiance", light.radiance.is_some()),
            ("file", light.file.is_some()),
            ("strength", light.strength.is_some()),
            ("rotation_deg", light.rotation_deg.is_some()),
            ("visible", light.visible.is_some()),
            ("center", light.center.is_some()),
            ("aim", light.aim.is_some()),
            ("normal", light.normal.is_some()),
            ("width", light.width.is_some()),
            ("height", light.height.is_some()),
            ("two_sided", light.two_sided.is_some()),
            ("radius", light.radius.is_some()),
            ("position", light.position.is_some()),
            ("intensity", light.intensity.is_some()),
            ("direction", light.direction.is_some()),
            ("irradiance", light.irradiance.is_some()),
            ("cone_deg", light.cone_deg.is_some()),
            ("blend", light.blend.is_some()),
            ("angle_deg", light.angle_deg.is_some()),
        ];
        let wrong = given.iter().find(|(key, is_given)| *is_given && !own.contains(key));
        let Some((key, _)) = wrong else { return Ok(()) };
        let path = format!("{path}.{key}");
        let list = quoted_list(own.iter().copied());
        let message = format!("`{path}`: a light of type `{kind}` has no `{key}`; it has {list}");
        let error = self.source.at_key(SceneErrorKind::Conflict, &path, message);
        // Every light is bright by one of these; the other names are what people try first.
        let brightness = ["radiance", "intensity", "irradiance"];
        let meant = if brightness.contains(key) {
            own.iter().copied().find(|own| brightness.contains(own))
        } else {
            closest(key, own.iter().copied())
        };
        Err(error.suggest(meant))
    }

    // --- meshes ---------------------------------------------------------------------------------

    fn meshes(&self, sections: &[MeshSection]) -> Result<Vec<SceneMesh>, SceneError> {
        let mut meshes = Vec::with_capacity(sections.len());
        for (index, section) in sections.iter().enumerate() {
            let path = format!("mesh.{index}");
            let mut mesh = self.mesh(&path, section)?;
            let up = section.up.map_or(UpAxis::Y, up_axis);
            let file_unit = match section.builtin {
                // The built-in head is modelled in centimetres.
                Some(_) => 0.01,
                None => self.unit_m,
            };
            let place = self.place(&path, &section.transform, section.unit_m.unwrap_or(file_unit))? * up.to_y_up();
            self.check_extent(&path, place, mesh.bounds())?;
            mesh.transform(place);
            if mesh.normals.is_none() && section.smooth.unwrap_or(true) {
                mesh.normals = Some(mesh.vertex_normals());
            }
            let albedo = self.tone(&format!("{path}.albedo"), section.albedo.unwrap_or(Tone::Grey(0.5)), 1.0)?;
            meshes.push(SceneMesh {
                name: section.name.clone().unwrap_or_else(|| format!("mesh {index}")),
                mesh: Arc::new(mesh),
                albedo,
                visible: section.visible.unwrap_or(true),
            });
        }
        Ok(meshes)
    }

    /// The mesh itself, in its own units.
    fn mesh(&self, path: &str, section: &MeshSection) -> Result<Mesh, SceneError> {
        match (&section.file, &section.shape, section.builtin) {
            (Some(file), None, None) => {
                let mesh = self.assets.mesh(file).map_err(|error| error.to_string());
                mesh.and_then(|mesh| match mesh.validate() {
                    Ok(()) => Ok(mesh),
                    Err(error) => Err(error.to_string()),
                })
                .map_err(|error| {
                    let message = format!("mesh `{file}`: {error}");
                    self.source.at_value(SceneErrorKind::Asset, &format!("{path}.file"), message)
                })
            }
            (None, Some(shape), None) => {
                let path = format!("{path}.shape.sphere");
                let center = self.point(&format!("{path}.center"), shape.sphere.center)?;
                let radius = shape.sphere.radius;
                let radius = self.number(&format!("{path}.radius"), radius, 1e-6, FARTHEST)?;
                // Quartered five times the outline departs from a circle by less than a thousandth.
                Ok(Mesh::sphere(center, radius, 5))
            }
            (None, None, Some(crate::file::BuiltinMesh::Head)) => Ok(groom::mannequin().mesh),
            _ => {
                let message = format!(
                    "`{path}` needs exactly one of file = \"head.obj\", shape = {{ sphere = {{ radius = 1.0 }} }} \
                     and builtin = \"head\""
                );
                Err(self.source.at_value(SceneErrorKind::Missing, path, message))
            }
        }
    }

    /// Scale, rotation and translation from units of `unit_m` metres into the scene's.
    fn place(&self, path: &str, transform: &TransformSection, unit_m: f64) -> Result<Affine3A, SceneError> {
        self.number(&format!("{path}.unit_m"), unit_m, 1e-9, 1e9)?;
        self.number(&format!("{path}.transform.scale"), transform.scale, 1e-9, 1e9)?;
        let mut angles = [0.0_f32; 3];
        for (angle, deg) in angles.iter_mut().zip(transform.rotate_deg) {
            let path = format!("{path}.transform.rotate_deg");
            *angle = self.number(&path, deg, -1e6, 1e6)?.to_radians();
        }
        let [x, y, z] = angles;
        let turn = Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x);
        let moved = self.point(&format!("{path}.transform.translate"), transform.translate)?;
        let scale = (transform.scale * unit_m / self.unit_m) as f32;
        Ok(Affine3A::from_scale_rotation_translation(Vec3::splat(scale), turn, moved))
    }

    /// Refuses what would end up too far away for the renderers' arithmetic.
    fn check_extent(&self, path: &str, place: Affine3A, bounds: Option<(Vec3, Vec3)>) -> Result<(), SceneError> {
        let Some((least, most)) = bounds else { return Ok(()) };
        let reach = least.abs().max(most.abs());
        let far = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| {
            // The image of the box lies within the sum of the images of its half axes.
            (place.transform_vector3(axis) * reach.dot(axis)).length()
        });
        let far = far.iter().sum::<f32>() + place.transform_point3(Vec3::ZERO).length();
        // Written so that a NaN is refused too.
        if f64::from(far) <= FARTHEST {
            return Ok(());
        }
        let message = format!("`{path}` reaches farther than {FARTHEST:e} scene units from the origin");
        Err(self.source.at_value(SceneErrorKind::OutOfRange, path, message))
    }

    // --- grooms ---------------------------------------------------------------------------------

    /// Which look a groom has.
    fn look_of(&self, index: usize, section: &GroomSection, names: &[&str]) -> Result<usize, SceneError> {
        let path = format!("groom.{index}.look");
        match &section.look {
            Some(wanted) => names.iter().position(|name| name == wanted).ok_or_else(|| {
                let list = quoted_list(names.iter().copied());
                let message = format!("`{path}`: there is no look `{wanted}`; the scene has {list}");
                self.source
                    .at_value(SceneErrorKind::UnknownName, &path, message)
                    .suggest(closest(wanted, names.iter().copied()))
            }),
            None if names.len() == 1 => Ok(0),
            None => {
                let list = quoted_list(names.iter().copied());
                let message = format!("`{path}` is missing; the scene has the looks {list}");
                Err(self.source.at_value(SceneErrorKind::Missing, &path, message))
            }
        }
    }

    fn groom(
        &mut self,
        index: usize,
        section: &GroomSection,
        look: usize,
        attributes: &[String],
    ) -> Result<SceneGroom, SceneError> {
        let path = format!("groom.{index}");
        let name = section.name.clone().unwrap_or_else(|| format!("groom {index}"));
        let mut groom = match (&section.file, &section.procedural) {
            (Some(file), None) => self.assets.groom(file).map_err(|error| {
                let message = format!("groom `{file}`: {error}");
                self.source.at_value(SceneErrorKind::Asset, &format!("{path}.file"), message)
            })?,
            (None, Some(recipe)) => procedural::grow(&path, recipe, self.source)?,
            _ => {
                let message = format!(
                    "`{path}` needs exactly one of file = \"hair.hair\" and procedural = {{ preset = \"wavy_long\" }}"
                );
                return Err(self.source.at_value(SceneErrorKind::Missing, &path, message));
            }
        };
        if groom.strand_count() == 0 {
            let message = format!("`{path}` has no strands");
            return Err(self.source.at_value(SceneErrorKind::Asset, &path, message));
        }
        if let Some(axis) = section.up {
            groom.up = up_axis(axis);
        }
        let own_unit = match groom.metres_per_unit {
            Some(metres) if metres.is_finite() && metres > 0.0 => f64::from(metres),
            _ => self.unit_m,
        };
        let place = self.place(&path, &section.transform, section.unit_m.unwrap_or(own_unit))?;
        self.check_extent(&path, place * groom.up.to_y_up(), groom.bounds())?;
        groom.make_y_up();
        groom.transform(place);
        groom.metres_per_unit = Some(self.unit_m as f32);
        self.widths(&path, &name, &section.width, &mut groom)?;
        for attribute in attributes {
            if groom.attributes.get(attribute).is_none() {
                let known = quoted_list(groom.attributes.iter().map(|(name, _)| name));
                let known = if known.is_empty() { "none".to_owned() } else { known };
                self.warnings.push(format!(
                    "{name} has no attribute `{attribute}` that its look reads (it has {known}); the look falls \
                     back to its value or ramp"
                ));
            }
        }
        Ok(SceneGroom { name, groom: Arc::new(groom), look, seed: index as u32 })
    }

    /// Gives every point its radius.
    fn widths(&mut self, path: &str, name: &str, width: &WidthSection, groom: &mut Groom) -> Result<(), SceneError> {
        let at = |key: &str| format!("{path}.width.{key}");
        let scale = self.number(&at("scale"), width.scale, 1e-6, 1e6)?;
        let root = self.number(&at("root_scale"), width.root_scale, 0.0, 1e6)?;
        let tip = self.number(&at("tip_scale"), width.tip_scale, 0.0, 1e6)?;
        if root == 0.0 && tip == 0.0 {
            let message = "hair that is 0 wide at root and tip cannot be seen";
            let path = at("tip_scale");
            return Err(self.source.at_value(SceneErrorKind::OutOfRange, &path, message));
        }
        let has_widths = groom.radius.as_ref().is_some_and(|radius| radius.iter().any(|&r| r > 0.0));
        let diameter_um = match width.diameter_um {
            Some(diameter) => {
                self.number(&at("diameter_um"), diameter, 1e-3, 1e6)?;
                Some(diameter)
            }
            None if has_widths => None,
            None => {
                self.warnings.push(format!(
                    "{name} has no widths; every fiber gets a diameter of {DEFAULT_DIAMETER_UM} micrometres"
                ));
                Some(DEFAULT_DIAMETER_UM)
            }
        };
        let factor = |u: f32| scale * math::lerp(root, tip, u);
        let done = match (diameter_um, groom.radius.take()) {
            (None, Some(mut radius)) => {
                for strand in 0..groom.strand_count() {
                    for point in groom.point_range(strand) {
                        radius[point] *= factor(groom.u_of_point(strand, point));
                    }
                }
                groom.set_radius(radius)
            }
            (diameter, _) => {
                let diameter = diameter.unwrap_or(DEFAULT_DIAMETER_UM);
                let radius = (0.5e-6 * diameter / self.unit_m) as f32;
                groom.set_radius_profile(|u| radius * factor(u))
            }
        };
        done.map_err(|error| {
            let message = format!("{name}: {error}");
            self.source.at_value(SceneErrorKind::OutOfRange, &format!("{path}.width"), message)
        })?;
        let median = median_radius(groom) * 2.0 * self.unit_m * 1e6;
        // Human hair has 60 to 120 micrometres; ten times off is a unit mistaken, not a thick hair.
        if !(6.0..=1200.0).contains(&median) {
            self.warnings.push(format!(
                "{name} is {median:.3} micrometres thick at real scale, hair is 60 to 120; check `unit_m` of the \
                 scene and of the groom, or set `width.diameter_um`"
            ));
        }
        Ok(())
    }

    // --- numbers --------------------------------------------------------------------------------

    /// A number within `[least, most]`.
    fn number(&self, path: &str, x: f64, least: f64, most: f64) -> Result<f32, SceneError> {
        if (least..=most).contains(&x) {
            return Ok(x as f32);
        }
        let message = format!("`{path}` is {x}; it must be between {least} and {most}");
        Err(self.source.at_value(SceneErrorKind::OutOfRange, path, message))
    }

    fn count(&self, path: &str, x: u32, least: u32, most: u32) -> Result<u32, SceneError> {
        if (least..=most).contains(&x) {
            return Ok(x);
        }
        let message = format!("`{path}` is {x}; it must be between {least} and {most}");
        Err(self.source.at_value(SceneErrorKind::OutOfRange, path, message))
    }

    fn point(&self, path: &str, p: [f64; 3]) -> Result<Vec3, SceneError> {
        for x in p {
            self.number(path, x, -FARTHEST, FARTHEST)?;
        }
        Ok(Vec3::from_array(p.map(|x| x as f32)))
    }

    /// A unit vector.
    fn direction(&self, path: &str, d: [f64; 3]) -> Result<Vec3, SceneError> {
        self.point(path, d)?.try_normalize().ok_or_else(|| {
            let message = format!("`{path}` has no length, so it is no direction");
            self.source.at_value(SceneErrorKind::OutOfRange, path, message)
        })
    }

    /// A colour with all channels within `[0, most]`.
    fn tone(&self, path: &str, tone: Tone, most: f64) -> Result<Rgb, SceneError> {
        for x in tone.rgb() {
            self.number(path, x, 0.0, most)?;
        }
        Ok(Rgb(tone.rgb().map(|x| x as f32)))
    }

    fn missing(&self, path: &str, key: &str) -> SceneError {
        let message = format!("missing key `{key}` in `{path}`");
        self.source.at_value(SceneErrorKind::Missing, path, message)
    }

    fn required_point(&self, path: &str, key: &str, p: Option<[f64; 3]>) -> Result<Vec3, SceneError> {
        match p {
            Some(p) => self.point(&format!("{path}.{key}"), p),
            None => Err(self.missing(path, key)),
        }
    }

    /// A length greater than 0.
    fn required_length(&self, path: &str, key: &str, x: Option<f64>) -> Result<f32, SceneError> {
        match x {
            Some(x) => self.number(&format!("{path}.{key}"), x, 1e-6, FARTHEST),
            None => Err(self.missing(path, key)),
        }
    }
}

fn up_axis(axis: AxisKind) -> UpAxis {
    match axis {
        AxisKind::X => UpAxis::X,
        AxisKind::Y => UpAxis::Y,
        AxisKind::Z => UpAxis::Z,
    }
}

/// The median radius, from a few thousand points spread evenly; 0 without any.
fn median_radius(groom: &Groom) -> f64 {
    let Some(radius) = &groom.radius else { return 0.0 };
    let step = (radius.len() / 4096).max(1);
    let mut some: Vec<f32> = radius.iter().copied().step_by(step).collect();
    some.sort_by(f32::total_cmp);
    some.get(some.len() / 2).map_or(0.0, |&r| f64::from(r))
}
