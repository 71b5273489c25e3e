use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use groom::{Groom, Mesh};
use math::{Rgb, Vec3};

use crate::assets::{Assets, EnvironmentImage};
use crate::error::SceneError;
use crate::file::{
    CurveBasisKind, CurveShapeKind, FilterKind, HeuristicKind, IntegratorKind, LightSelectionKind, SceneFile, ViewKind,
};
use crate::look::Look;
use crate::resolve;
use crate::source::Text;

/// Everything that a renderer needs, checked: radians, scene units, y up, plain numbers.
///
/// After [`load`](Self::load) has succeeded a renderer cannot fail on the scene: all numbers are finite and
/// in their ranges, indices exist, directions are unit vectors, there is something to see and some light.
#[derive(Clone, Debug)]
pub struct Scene {
    /// A name for people; may be empty.
    pub name: String,
    /// Metres per scene unit, greater than 0.
    pub unit_m: f32,
    /// Where it is seen from.
    pub camera: Camera,
    /// Size and development of the picture.
    pub film: FilmSettings,
    /// How it is computed.
    pub render: RenderSettings,
    /// At least one.
    pub lights: Vec<Light>,
    /// Solid things, diffuse.
    pub meshes: Vec<SceneMesh>,
    /// The hair; grooms and meshes together are at least one.
    pub grooms: Vec<SceneGroom>,
    /// What the grooms' `look` counts in.
    pub looks: Vec<Look>,
    /// What is odd but not wrong, as sentences for the user.
    pub warnings: Vec<String>,
}

impl Scene {
    /// Reads a scene file, applies overrides such as `look.main.ior=1.5`, and gets everything it names.
    ///
    /// # Errors
    /// The first mistake in text, overrides, values or assets, with its place where it has one.
    pub fn load(text: &str, overrides: &[String], assets: &dyn Assets) -> Result<Self, SceneError> {
        let text = Text::new(text, overrides);
        let source = text.parse()?;
        resolve::scene(&source.file()?, &source, assets)
    }

    /// As [`load`](Self::load), from a file that is already typed; complaints then have key paths, but no
    /// lines.
    ///
    /// # Errors
    /// The first mistake in values or assets.
    pub fn resolve(file: &SceneFile, assets: &dyn Assets) -> Result<Self, SceneError> {
        let text = Text::new("", &[]);
        resolve::scene(file, &text.parse()?, assets)
    }

    /// Smallest box around all grooms and meshes, widths not counted.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let grooms = self.grooms.iter().filter_map(|g| g.groom.bounds());
        let meshes = self.meshes.iter().filter_map(|m| m.mesh.bounds());
        grooms.chain(meshes).reduce(union)
    }
}

/// The box around two boxes.
pub(crate) fn union(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// A perspective camera with a thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands; differs from `target`.
    pub position: Vec3,
    /// What it looks at.
    pub target: Vec3,
    /// Which way is up, unit length; not parallel to the view.
    pub up: Vec3,
    /// Vertical field of view, radians, in `(0, π)`.
    pub fov_y: f32,
    /// Radius of the lens, `>= 0`; 0 is a pinhole.
    pub aperture_radius: f32,
    /// Distance of the sharp plane along the view, greater than 0.
    pub focus_distance: f32,
}

impl Camera {
    /// Right, up and forward of the picture: unit vectors at right angles.
    pub fn axes(&self) -> [Vec3; 3] {
        let forward = (self.target - self.position).normalize_or(Vec3::NEG_Z);
        let right = forward.cross(self.up).normalize_or(Vec3::X);
        [right, right.cross(forward), forward]
    }
}

/// From where an automatic camera looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Radians around the vertical: 0 looks from +z, π/2 from +x.
    pub azimuth: f32,
    /// Radians above the horizon, less than π/2 either way.
    pub elevation: f32,
    /// What is looked at; `None`: the middle of the box.
    pub target: Option<Vec3>,
    /// Distance from the target; `None`: so far that the box fills about 80 % of the frame.
    pub distance: Option<f32>,
}

/// A pinhole camera, with +y up, that frames `points`.
///
/// `fov_y` is the vertical field of view in radians and `aspect` the width of the frame over its height. With
/// no distance given, the points fill 80 % of the frame in the direction in which it is tighter; with no
/// target given, they are centred in it.
pub fn auto_camera(points: &[Vec3], view: Viewpoint, fov_y: f32, aspect: f32) -> Camera {
    let elevation = view.elevation.clamp(-0.995 * FRAC_PI_2, 0.995 * FRAC_PI_2);
    let (sin_azimuth, cos_azimuth) = view.azimuth.sin_cos();
    let (sin_elevation, cos_elevation) = elevation.sin_cos();
    // From the target to the camera.
    let back = Vec3::new(cos_elevation * sin_azimuth, sin_elevation, cos_elevation * cos_azimuth);
    let right = Vec3::Y.cross(back).normalize_or(Vec3::X);
    let up = back.cross(right);
    let tan_y = 0.8 * (0.5 * fov_y).tan();
    let tan_x = tan_y * aspect;

    let box_of = |points: &[Vec3]| {
        let first = points.first().copied().unwrap_or(Vec3::ZERO);
        points.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)))
    };
    let (lo, hi) = box_of(points);
    let mut target = view.target.unwrap_or((lo + hi) * 0.5);
    let distance_from = |target: Vec3| {
        let needed = points.iter().fold(0.0_f32, |needed, &p| {
            let p = p - target;
            let sideways = (p.dot(right).abs() / tan_x).max(p.dot(up).abs() / tan_y);
            needed.max(p.dot(back) + sideways)
        });
        // A single point needs no distance, but the camera cannot stand in it.
        if needed > 0.0 { needed } else { 1.0 }
    };
    let mut distance = view.distance.unwrap_or_else(|| distance_from(target));
    if view.target.is_none() {
        // Perspective makes near parts larger: centre what is seen, a few times over.
        for _ in 0..8 {
            let seen: Vec<Vec3> = points
                .iter()
                .map(|&p| {
                    let p = p - target;
                    let depth = (distance - p.dot(back)).max(1e-3 * distance);
                    Vec3::new(p.dot(right) / depth, p.dot(up) / depth, 0.0)
                })
                .collect();
            let (lo, hi) = box_of(&seen);
            let off = (lo + hi) * (0.5 * distance);
            target += right * off.x + up * off.y;
            distance = view.distance.unwrap_or_else(|| distance_from(target));
        }
    }
    Camera {
        position: target + back * distance,
        target,
        up: Vec3::Y,
        fov_y,
        aperture_radius: 0.0,
        focus_distance: distance,
    }
}

/// A few hundred of the points between which all others lie, nearly: the farthest ones in directions all
/// around. Framing them frames everything.
pub(crate) fn outline<'p>(points: impl Iterator<Item = &'p Vec3> + Clone) -> Vec<Vec3> {
    const DIRECTIONS: u32 = 256;
    // Enough to know the outline to a pixel or so, however large the groom.
    // Every so-manieth by chance: a fixed stride would miss the tips of strands of equal length.
    let stride = points.clone().count().div_ceil(40_000).max(1) as u32;
    let points: Vec<Vec3> = points
        .zip(0_u32..)
        .filter(|&(_, i)| i == 0 || math::hash::mix(i).is_multiple_of(stride))
        .map(|(&p, _)| p)
        .collect();
    (0..DIRECTIONS)
        .filter_map(|i| {
            // Spread evenly by the golden angle.
            let z = 1.0 - (2.0 * i as f32 + 1.0) / DIRECTIONS as f32;
            let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let d = Vec3::new(r * cos, r * sin, z);
            points.iter().copied().max_by(|a, b| a.dot(d).total_cmp(&b.dot(d)))
        })
        .collect()
}

/// Size and development of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmSettings {
    /// Pixels, 1 to 16384.
    pub width: u32,
    /// Pixels, 1 to 16384.
    pub height: u32,
    /// Shape of the pixel filter.
    pub filter: Filter,
    /// Full width of the filter, pixels, greater than 0.
    pub filter_width: f32,
    /// Stops; the developed picture is multiplied by 2 to this power.
    pub exposure_ev: f32,
    /// How radiance becomes display colours.
    pub view: View,
}

/// How the picture is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// Longest path in scattering events, at least 1.
    pub max_depth: u32,
    /// Scattering events before Russian roulette.
    pub roulette_start: u32,
    /// Which paths are followed, and how.
    pub integrator: Integrator,
    /// Weights of multiple importance sampling.
    pub heuristic: Heuristic,
    /// Changes the noise and nothing else.
    pub seed: u32,
    /// Largest radiance of one indirect path; `None` is off, and the only unbiased setting.
    pub clamp: Option<f32>,
    /// How strands are intersected.
    pub curve_shape: CurveShape,
    /// How strands run between their points.
    pub curve_basis: CurveBasis,
    /// How a light is chosen.
    pub light_selection: LightSelection,
}

/// An enum in memory that mirrors one of the file.
macro_rules! mirror {
    ($(#[$doc:meta])* $name:ident = $kind:ident { $($(#[$variant_doc:meta])* $variant:ident),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$variant_doc])* $variant),*
        }

        impl From<$kind> for $name {
            fn from(kind: $kind) -> Self {
                match kind {
                    $($kind::$variant => Self::$variant),*
                }
            }
        }
    };
}

mirror! {
    /// Shape of the pixel filter.
    Filter = FilterKind {
        /// Smooth, without ringing.
        BlackmanHarris,
        /// A bell curve cut off at its width.
        Gaussian,
        /// A plain average.
        Box,
    }
}

mirror! {
    /// How radiance becomes display colours.
    View = ViewKind {
        /// The sRGB curve alone.
        Srgb,
        /// A film-like curve per channel.
        Filmic,
        /// Soft highlights that lose colour, after AgX.
        Agx,
    }
}

mirror! {
    /// Which light paths are followed, and how.
    Integrator = IntegratorKind {
        /// All, lights and fibers sampled together.
        Path,
        /// Light that scatters once.
        Direct,
        /// All, lights found by chance only.
        BcsdfOnly,
        /// All, light sampled at the lights only.
        LightOnly,
    }
}

mirror! {
    /// Weights of multiple importance sampling.
    Heuristic = HeuristicKind {
        /// In proportion to the densities.
        Balance,
        /// In proportion to their squares.
        Power,
    }
}

mirror! {
    /// How a strand is intersected.
    CurveShape = CurveShapeKind {
        /// As a tube.
        Round,
        /// As a flat band that faces the ray.
        Ribbon,
    }
}

mirror! {
    /// How a strand runs between its points.
    CurveBasis = CurveBasisKind {
        /// A smooth curve through all points.
        CatmullRom,
        /// Straight pieces.
        Linear,
    }
}

mirror! {
    /// How a light is chosen for a shading point.
    LightSelection = LightSelectionKind {
        /// By an estimate of what each light brings to the point.
        Contribution,
        /// By the power of each light.
        Power,
        /// All alike.
        Uniform,
    }
}

/// A light. Radiance, intensity and irradiance are linear Rec.709, finite and `>= 0`.
#[derive(Clone, Debug)]
pub enum Light {
    /// From all around.
    Environment {
        /// A lat-long image, multiplied by `radiance`; `None`: constant.
        image: Option<Arc<EnvironmentImage>>,
        /// W/(m² sr), or the factor of the image.
        radiance: Rgb,
        /// Radians by which the image is turned about +y, counter-clockwise seen from above.
        rotation: f32,
        /// Whether the camera sees it.
        visible: bool,
    },
    /// A rectangle.
    Rectangle {
        /// Its middle.
        center: Vec3,
        /// Its width as a vector from one side to the other, at right angles to `edge_v`.
        edge_u: Vec3,
        /// Its height as a vector.
        edge_v: Vec3,
        /// Unit vector to where it shines; `edge_u × edge_v` points there too.
        normal: Vec3,
        /// W/(m² sr).
        radiance: Rgb,
        /// Whether the back shines too.
        two_sided: bool,
        /// Whether the camera sees it.
        visible: bool,
    },
    /// A sphere.
    Sphere {
        /// Its middle.
        center: Vec3,
        /// Greater than 0.
        radius: f32,
        /// W/(m² sr).
        radiance: Rgb,
        /// Whether the camera sees it.
        visible: bool,
    },
    /// A point.
    Point {
        /// Where it is.
        position: Vec3,
        /// W/sr with distances in scene units.
        intensity: Rgb,
    },
    /// From infinitely far away.
    Distant {
        /// Unit vector in which the light travels.
        direction: Vec3,
        /// W/m² on a surface that faces the light.
        irradiance: Rgb,
        /// Half the angular diameter, radians, in `[0, π/4]`; 0 is a single direction.
        half_angle: f32,
    },
}

/// A solid thing in scene units.
#[derive(Clone, Debug)]
pub struct SceneMesh {
    /// A name for people.
    pub name: String,
    /// Its triangles.
    pub mesh: Arc<Mesh>,
    /// Diffuse reflectance, `[0, 1]` per channel.
    pub albedo: Rgb,
    /// Whether the camera sees it.
    pub visible: bool,
}

/// Hair in scene units, y up.
#[derive(Clone, Debug)]
pub struct SceneGroom {
    /// A name for people.
    pub name: String,
    /// The strands; `radius` is always there.
    pub groom: Arc<Groom>,
    /// Which of the scene's looks it has.
    pub look: usize,
    /// What to put into [`StrandPoint::seed`](crate::StrandPoint::seed) for this groom.
    pub seed: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners((lo, hi): (Vec3, Vec3)) -> Vec<Vec3> {
        (0..8)
            .map(|i| {
                let pick = |bit: i32, a: f32, b: f32| if (i >> bit) & 1 == 0 { a } else { b };
                Vec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z))
            })
            .collect()
    }

    #[test]
    fn the_outline_reaches_as_far_as_all_points() {
        let points: Vec<Vec3> = (0..100_000_u32)
            .map(|i| math::warp::uniform_sphere([math::hash::unit(i, 1), math::hash::unit(i, 2)]))
            .collect();
        let outline = outline(points.iter());
        assert!(outline.len() <= 256);
        for d in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, 0.0, 0.8)] {
            let most = outline.iter().map(|p| p.dot(d)).fold(f32::MIN, f32::max);
            // 256 directions are at most about 9 degrees off; a sphere recedes by 1.2 % over that.
            assert!(most > 0.98, "{most}");
        }
    }

    /// The largest share of the frame, horizontally or vertically, that the box's corners reach.
    fn reach(camera: &Camera, bounds: (Vec3, Vec3), aspect: f32) -> f32 {
        let [right, up, forward] = camera.axes();
        let tan_y = (0.5 * camera.fov_y).tan();
        let mut reach = 0.0_f32;
        for x in [bounds.0.x, bounds.1.x] {
            for y in [bounds.0.y, bounds.1.y] {
                for z in [bounds.0.z, bounds.1.z] {
                    let p = Vec3::new(x, y, z) - camera.position;
                    let depth = p.dot(forward);
                    assert!(depth > 0.0, "a corner is behind the camera");
                    reach = reach.max(p.dot(right).abs() / (depth * tan_y * aspect));
                    reach = reach.max(p.dot(up).abs() / (depth * tan_y));
                }
            }
        }
        reach
    }

    #[test]
    fn the_automatic_camera_fills_four_fifths_of_any_frame() {
        let boxes = [
            (Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, 1.0, 1.0)),
            (Vec3::new(100.0, 0.0, 3.0), Vec3::new(101.0, 40.0, 4.0)),
            (Vec3::new(-9.0, 5.0, -0.1), Vec3::new(9.0, 5.1, 0.1)),
        ];
        for bounds in boxes {
            for aspect in [0.5, 0.8, 1.0, 2.4] {
                for (azimuth, elevation) in [(0.0, 0.0), (0.7, 0.2), (-2.5, -1.2), (3.0, 1.5)] {
                    let view = Viewpoint { azimuth, elevation, target: None, distance: None };
                    let camera = auto_camera(&corners(bounds), view, 0.5, aspect);
                    let reach = reach(&camera, bounds, aspect);
                    // f32 cancellation in positions around 100 units.
                    assert!((reach - 0.8).abs() < 1e-3, "{bounds:?} {aspect} {azimuth}: {reach}");
                }
            }
        }
    }

    #[test]
    fn azimuth_zero_looks_from_the_front_and_ninety_degrees_from_the_right() {
        let bounds = (Vec3::splat(-1.0), Vec3::splat(1.0));
        let view = Viewpoint { azimuth: 0.0, elevation: 0.0, target: None, distance: Some(5.0) };
        let front = auto_camera(&corners(bounds), view, 0.5, 1.0);
        assert!((front.position - Vec3::new(0.0, 0.0, 5.0)).length() < 1e-5);
        let side = auto_camera(&corners(bounds), Viewpoint { azimuth: FRAC_PI_2, ..view }, 0.5, 1.0);
        assert!((side.position - Vec3::new(5.0, 0.0, 0.0)).length() < 1e-5);
        // From the front, the right of the picture is +x.
        assert!((front.axes()[0] - Vec3::X).length() < 1e-6);
    }

    #[test]
    fn a_box_without_size_still_gets_a_camera() {
        let point = Vec3::new(1.0, 2.0, 3.0);
        let view = Viewpoint { azimuth: 0.3, elevation: 0.1, target: None, distance: None };
        let camera = auto_camera(&[point], view, 0.5, 1.0);
        assert!(camera.position.is_finite() && camera.position != point);
    }
}
