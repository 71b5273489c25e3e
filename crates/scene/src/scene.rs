use std::sync::Arc;

use groom::{Groom, Mesh};
use math::{Rgb, Vec3};

use crate::assets::EnvironmentImage;
use crate::file::{
    CurveBasisKind, CurveShapeKind, FilterKind, HeuristicKind, IntegratorKind, LightSelectionKind, ViewKind,
};
use crate::look::Look;

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
    /// A point that shines in a cone: `intensity` times [`spot_falloff`](Self::spot_falloff).
    Spot {
        /// Where it is.
        position: Vec3,
        /// Unit vector in which the light travels on the axis.
        direction: Vec3,
        /// W/sr on the axis, with distances in scene units.
        intensity: Rgb,
        /// Cosine of the angle from the axis up to which it is as bright as on the axis; at most 1, and greater
        /// than `cos_outer` by 9e-7 or more, however sharp the edge.
        cos_inner: f32,
        /// Cosine of the angle from the axis beyond which it is dark, at least 0.
        cos_outer: f32,
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

impl Light {
    /// Share of its intensity that a spot sends where the cosine to its axis is `cos`: 1 from `cos_inner` on,
    /// 0 up to `cos_outer`, and between them the cubic `3t² - 2t³`, which is the `smoothstep` of shaders.
    #[inline]
    pub fn spot_falloff(cos_inner: f32, cos_outer: f32, cos: f32) -> f32 {
        let t = ((cos - cos_outer) / (cos_inner - cos_outer)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }
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
