//! The scene file as it is written: TOML, in metres per unit, degrees and the user's words.
//!
//! These are the only types of the crate that derive `Serialize`, `Deserialize` and `JsonSchema`; their
//! comments are the descriptions in the schema. What the renderers read is [`Scene`](crate::Scene).

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::de::{self, MapAccess, SeqAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};

/// A scene: what is in it, where it is seen from, and how it is rendered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SceneFile {
    /// Name and unit of length.
    pub scene: SceneSection,
    /// Where the scene is seen from. Without this section the camera frames everything by itself.
    pub camera: Option<CameraSection>,
    /// Size and development of the picture.
    pub film: FilmSection,
    /// How the picture is computed.
    pub render: RenderSection,
    /// The lights. Without any, a white environment of radiance 1 is used, with a warning.
    pub light: Vec<LightSection>,
    /// Solid things: heads, floors, spheres.
    pub mesh: Vec<MeshSection>,
    /// The hair.
    pub groom: Vec<GroomSection>,
    /// What fibers are made of, by name.
    pub look: BTreeMap<String, LookSection>,
}

/// Name and unit of length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SceneSection {
    /// A name for people.
    pub name: String,
    /// Length of one scene unit in metres: 0.01 (the default) makes a unit a centimetre. All lengths of the
    /// file are in scene units unless their name says otherwise.
    pub unit_m: f64,
}

impl Default for SceneSection {
    fn default() -> Self {
        Self { name: String::new(), unit_m: 0.01 }
    }
}

/// A perspective camera: either `position` and `target`, or `orbit`, or neither for automatic framing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSection {
    /// Where the camera stands, scene units.
    pub position: Option<[f64; 3]>,
    /// What it looks at, scene units. Default with `position`: the middle of the scene.
    pub target: Option<[f64; 3]>,
    /// Which way is up in the picture, any length. Default: +y.
    pub up: [f64; 3],
    /// The camera on a sphere around its target.
    pub orbit: Option<OrbitSection>,
    /// Vertical field of view in degrees, 1 to 170. Default: 30.
    pub fov_deg: f64,
    /// Radius of the lens in scene units; 0 (the default) is a pinhole, sharp everywhere.
    pub aperture_radius: f64,
    /// Distance of the plane that is sharp, in scene units. Default: the distance of the target.
    pub focus_distance: Option<f64>,
}

impl Default for CameraSection {
    fn default() -> Self {
        Self {
            position: None,
            target: None,
            up: [0.0, 1.0, 0.0],
            orbit: None,
            fov_deg: 30.0,
            aperture_radius: 0.0,
            focus_distance: None,
        }
    }
}

/// A camera on a sphere around its target; what is missing is framed automatically.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OrbitSection {
    /// What the camera looks at, scene units. Default: the middle of the scene.
    pub target: Option<[f64; 3]>,
    /// Distance from the target, scene units. Default: so far that the scene fills about 80 % of the frame.
    pub distance: Option<f64>,
    /// Degrees around the vertical: 0 looks from +z, 90 from +x. Default: 30.
    pub azimuth_deg: f64,
    /// Degrees above the horizon, -89 to 89. Default: 8.
    pub elevation_deg: f64,
}

impl Default for OrbitSection {
    fn default() -> Self {
        Self { target: None, distance: None, azimuth_deg: 30.0, elevation_deg: 8.0 }
    }
}

/// Size and development of the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilmSection {
    /// Width in pixels, 1 to 16384. Default: 768.
    pub width: u32,
    /// Height in pixels, 1 to 16384. Default: 960.
    pub height: u32,
    /// Shape of the pixel filter. Default: `blackman_harris`.
    pub filter: FilterKind,
    /// Full width of the filter in pixels, 0.1 to 16. Default: 1.5, for `box` 1.
    pub filter_width_px: Option<f64>,
    /// Exposure of the PNG in stops: +1 doubles. The EXR holds unexposed radiance. Default: 0.
    pub exposure_ev: f64,
    /// View transform of the PNG. Default: `srgb`.
    pub view: ViewKind,
}

impl Default for FilmSection {
    fn default() -> Self {
        Self {
            width: 768,
            height: 960,
            filter: FilterKind::default(),
            filter_width_px: None,
            exposure_ev: 0.0,
            view: ViewKind::default(),
        }
    }
}

/// Shape of the pixel filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FilterKind {
    /// Smooth, without ringing.
    #[default]
    BlackmanHarris,
    /// A bell curve cut off at its width.
    Gaussian,
    /// A plain average.
    Box,
}

/// How radiance becomes the colours of the PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ViewKind {
    /// The sRGB curve alone; bright things clip.
    #[default]
    Srgb,
    /// A film-like curve per channel: soft highlights, more contrast.
    Filmic,
    /// Soft highlights that lose colour as they brighten, after AgX.
    Agx,
}

/// How the picture is computed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RenderSection {
    /// Samples per pixel, 1 to 16777216. Default: 64.
    pub samples: u32,
    /// Longest path, in scattering events, 1 to 65535. Blonde hair needs 60 and more. Default: 96.
    pub max_depth: u32,
    /// Scattering events before Russian roulette may end a path. Default: 8.
    pub roulette_start: u32,
    /// Which light paths are followed. Default: `path`.
    pub integrator: IntegratorKind,
    /// How light and fiber sampling are weighted against each other. Default: `power`.
    pub heuristic: HeuristicKind,
    /// Changes the noise and nothing else. Default: 0.
    pub seed: u32,
    /// Largest radiance that one indirect path may bring; darkens the picture. 0 (the default) is off.
    pub clamp: f64,
    /// How a strand is intersected. Default: `round`.
    pub curve_shape: CurveShapeKind,
    /// How a strand runs between its points. Default: `catmull_rom`.
    pub curve_basis: CurveBasisKind,
    /// How a light is chosen for a shading point. Default: `contribution`.
    pub light_selection: LightSelectionKind,
}

impl Default for RenderSection {
    fn default() -> Self {
        Self {
            samples: 64,
            max_depth: 96,
            roulette_start: 8,
            integrator: IntegratorKind::default(),
            heuristic: HeuristicKind::default(),
            seed: 0,
            clamp: 0.0,
            curve_shape: CurveShapeKind::default(),
            curve_basis: CurveBasisKind::default(),
            light_selection: LightSelectionKind::default(),
        }
    }
}

/// Which light paths are followed, and how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IntegratorKind {
    /// All paths, lights and fibers sampled together.
    #[default]
    Path,
    /// Light that scatters once.
    Direct,
    /// All paths, but lights are only found by chance; point, spot and pointlike distant lights are not found.
    BcsdfOnly,
    /// All paths, but light that arrives is only sampled at the lights.
    LightOnly,
}

/// Weights of multiple importance sampling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeuristicKind {
    /// In proportion to the densities.
    Balance,
    /// In proportion to their squares.
    #[default]
    Power,
}

/// How a strand is intersected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CurveShapeKind {
    /// As a tube.
    #[default]
    Round,
    /// As a flat band that faces the ray; faster.
    Ribbon,
}

/// How a strand runs between its points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CurveBasisKind {
    /// A smooth curve through all points.
    #[default]
    CatmullRom,
    /// Straight pieces.
    Linear,
}

/// How a light is chosen for a shading point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightSelectionKind {
    /// By an estimate of what each light brings to the point.
    #[default]
    Contribution,
    /// By the power of each light.
    Power,
    /// All alike.
    Uniform,
}

/// A number for all three channels, or three numbers: linear Rec.709 red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Tone {
    /// The same in all channels.
    Grey(f64),
    /// Red, green, blue.
    Colour([f64; 3]),
}

impl Tone {
    /// Red, green, blue.
    pub fn rgb(self) -> [f64; 3] {
        match self {
            Self::Grey(x) => [x; 3],
            Self::Colour(rgb) => rgb,
        }
    }
}

/// Reads three numbers from what is left of `seq`.
fn three<'de, A: SeqAccess<'de>>(mut seq: A) -> Result<[f64; 3], A::Error> {
    let wrong = |found: usize| -> A::Error {
        de::Error::custom(format!("a colour has 3 numbers, [red, green, blue]; found {found}"))
    };
    let mut rgb = [0.0; 3];
    for (found, channel) in rgb.iter_mut().enumerate() {
        *channel = seq.next_element()?.ok_or_else(|| wrong(found))?;
    }
    match seq.next_element::<de::IgnoredAny>()? {
        None => Ok(rgb),
        Some(_) => Err(wrong(4)),
    }
}

// By hand: the derived form of an untagged enum answers a wrong value with the names of Rust types.
impl<'de> Deserialize<'de> for Tone {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ToneVisitor;

        impl<'de> Visitor<'de> for ToneVisitor {
            type Value = Tone;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or [red, green, blue]")
            }

            fn visit_i64<E: de::Error>(self, x: i64) -> Result<Tone, E> {
                Ok(Tone::Grey(x as f64))
            }

            fn visit_u64<E: de::Error>(self, x: u64) -> Result<Tone, E> {
                Ok(Tone::Grey(x as f64))
            }

            fn visit_f64<E: de::Error>(self, x: f64) -> Result<Tone, E> {
                Ok(Tone::Grey(x))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Tone, A::Error> {
                three(seq).map(Tone::Colour)
            }
        }

        deserializer.deserialize_any(ToneVisitor)
    }
}

/// A parameter of a look: a number, a colour, or a table that lets it vary over strands.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Param {
    /// The same everywhere.
    Constant(Tone),
    /// Varying from root to tip, from strand to strand, or both.
    Varying(Box<Variation>),
}

impl From<f64> for Param {
    fn from(x: f64) -> Self {
        Self::Constant(Tone::Grey(x))
    }
}

/// How a parameter varies. The base is the attribute where the groom has it, else the ramp, else the value;
/// it is multiplied by `scale`, then `random` and `noise` are added, in the parameter's own unit. The
/// result is clamped to what the parameter allows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Variation {
    /// The base value. Default: that of the parameter.
    pub value: Option<Tone>,
    /// Base values along the strand as `[u, value]`, u rising from 0 at the root to 1 at the tip; straight
    /// between them. Instead of `value`.
    pub ramp: Option<Vec<(f64, Tone)>>,
    /// Name of an attribute of the groom, per strand or per point, that gives the base value. Grooms
    /// without it fall back to `ramp` or `value`.
    pub attribute: Option<String>,
    /// Factor on the base value. Default: 1.
    pub scale: Option<f64>,
    /// Half width of a per-strand random offset: every strand adds a fixed number from [-random, random].
    pub random: Option<f64>,
    /// Changes which strand gets which random offset. Parameters of a look with the same seed vary
    /// together; without one, each parameter varies on its own.
    pub seed: Option<u32>,
    /// Smooth noise along the strand.
    pub noise: Option<NoiseSection>,
}

/// Smooth noise along the strand, different on every strand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseSection {
    /// Largest offset to either side, in the parameter's own unit.
    pub amount: f64,
    /// Features per strand length. Default: 4.
    #[serde(default = "default_frequency")]
    pub frequency: f64,
    /// Changes the noise and nothing else. Default: differs from parameter to parameter.
    pub seed: Option<u32>,
}

fn default_frequency() -> f64 {
    4.0
}

impl<'de> Deserialize<'de> for Param {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ParamVisitor;

        impl<'de> Visitor<'de> for ParamVisitor {
            type Value = Param;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, [red, green, blue], or a table such as { value = 1.0, random = 0.1 }")
            }

            fn visit_i64<E: de::Error>(self, x: i64) -> Result<Param, E> {
                Ok(Param::from(x as f64))
            }

            fn visit_u64<E: de::Error>(self, x: u64) -> Result<Param, E> {
                Ok(Param::from(x as f64))
            }

            fn visit_f64<E: de::Error>(self, x: f64) -> Result<Param, E> {
                Ok(Param::from(x))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Param, A::Error> {
                three(seq).map(|rgb| Param::Constant(Tone::Colour(rgb)))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Param, A::Error> {
                Variation::deserialize(MapAccessDeserializer::new(map))
                    .map(|variation| Param::Varying(Box::new(variation)))
            }
        }

        deserializer.deserialize_any(ParamVisitor)
    }
}

/// A light. Which keys it takes depends on its `type`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LightSection {
    /// What kind of light it is.
    #[serde(rename = "type")]
    pub kind: LightKind,
    /// A name for people and for `--set light.NAME.key=value`.
    pub name: Option<String>,
    /// Emitted radiance in W/(m² sr), a number or [r, g, b]. Default: 1. For environment, rectangle, sphere.
    pub radiance: Option<Tone>,
    /// Environment: a lat-long image (.hdr or .exr) of radiance.
    pub file: Option<String>,
    /// Factor on the light's radiance, intensity or irradiance. Default: 1.
    pub strength: Option<f64>,
    /// Environment: degrees by which the image is turned about +y, counter-clockwise seen from above.
    pub rotation_deg: Option<f64>,
    /// Whether the camera sees it. Default: true for an environment, false for rectangle and sphere.
    pub visible: Option<bool>,
    /// Rectangle, sphere: the centre, scene units.
    pub center: Option<[f64; 3]>,
    /// Rectangle, spot: a point it faces, scene units; instead of `normal` or `direction`.
    pub aim: Option<[f64; 3]>,
    /// Rectangle: the direction it faces, any length; instead of `aim`.
    pub normal: Option<[f64; 3]>,
    /// Rectangle: width (the level side), scene units.
    pub width: Option<f64>,
    /// Rectangle: height, scene units.
    pub height: Option<f64>,
    /// Rectangle: whether the back shines too. Default: false.
    pub two_sided: Option<bool>,
    /// Sphere: radius, scene units.
    pub radius: Option<f64>,
    /// Point, spot: the position, scene units.
    pub position: Option<[f64; 3]>,
    /// Point, spot: radiant intensity in W/sr, a number or [r, g, b], with distances in scene units: at a
    /// distance of d units the irradiance is intensity / d². For a spot that is on its axis. Default: 1.
    pub intensity: Option<Tone>,
    /// Distant, spot: the direction in which the light travels, any length; for a spot instead of `aim`.
    pub direction: Option<[f64; 3]>,
    /// Spot: full opening angle of the cone outside which it is dark, degrees, 1 to 180. Default: 45.
    pub cone_deg: Option<f64>,
    /// Spot: share of the cone's half angle over which the light fades, 0 (a sharp edge) to 1 (from the axis
    /// on). Default: 0.15.
    pub blend: Option<f64>,
    /// Distant: irradiance in W/m² on a surface that faces the light, a number or [r, g, b].
    pub irradiance: Option<Tone>,
    /// Distant: angular diameter in degrees, 0 to 90; the sun has 0.53. Below 0.115 it is a single
    /// direction. Default: 0.
    pub angle_deg: Option<f64>,
}

/// What kind of light it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightKind {
    /// From all around: constant, or an image.
    Environment,
    /// A rectangle that shines from its front.
    Rectangle,
    /// A sphere.
    Sphere,
    /// A point.
    Point,
    /// A point that shines in a cone.
    Spot,
    /// From infinitely far away: the sun.
    Distant,
}

/// A solid thing: exactly one of `file`, `shape` and `builtin`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MeshSection {
    /// A name for people and for `--set mesh.NAME.key=value`.
    pub name: Option<String>,
    /// An .obj or .ply file.
    pub file: Option<String>,
    /// A simple shape.
    pub shape: Option<ShapeSection>,
    /// A mesh that comes with the renderer.
    pub builtin: Option<BuiltinMesh>,
    /// Where it stands.
    pub transform: TransformSection,
    /// The axis that points up in the file. Default: y.
    pub up: Option<AxisKind>,
    /// Metres per unit of the file. Default: the scene's unit.
    pub unit_m: Option<f64>,
    /// Diffuse reflectance, 0 to 1, a number or [r, g, b]. Default: 0.5.
    pub albedo: Option<Tone>,
    /// Whether the camera sees it; its shadows stay. Default: true.
    pub visible: Option<bool>,
    /// Whether shading hides the facets of a mesh that brings no normals. Default: true.
    pub smooth: Option<bool>,
}

/// A simple shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeSection {
    /// A sphere.
    pub sphere: SphereSection,
}

/// A sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereSection {
    /// The centre, before the transform, in the unit of the mesh. Default: the origin.
    #[serde(default)]
    pub center: [f64; 3],
    /// The radius, in the unit of the mesh.
    pub radius: f64,
}

/// A mesh that comes with the renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BuiltinMesh {
    /// The mannequin head that the procedural grooms grow on.
    Head,
}

/// Where something stands: scaled first, then turned, then moved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TransformSection {
    /// How far it is moved, scene units.
    pub translate: [f64; 3],
    /// Degrees by which it is turned about x, then y, then z.
    pub rotate_deg: [f64; 3],
    /// Factor on its size, greater than 0. Widths of hair scale too.
    pub scale: f64,
}

impl Default for TransformSection {
    fn default() -> Self {
        Self { translate: [0.0; 3], rotate_deg: [0.0; 3], scale: 1.0 }
    }
}

/// An axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisKind {
    /// The x axis.
    X,
    /// The y axis.
    Y,
    /// The z axis.
    Z,
}

/// Hair: exactly one of `file` and `procedural`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GroomSection {
    /// A name for people and for `--set groom.NAME.key=value`.
    pub name: Option<String>,
    /// A .hair file.
    pub file: Option<String>,
    /// Hair that is grown, on the built-in head unless told otherwise.
    pub procedural: Option<ProceduralSection>,
    /// Name of its look. Default: the only look of the scene, or plain brown hair where there is none.
    pub look: Option<String>,
    /// Where it stands.
    pub transform: TransformSection,
    /// The axis that points up in the file. Default: what the file says, else y.
    pub up: Option<AxisKind>,
    /// Metres per unit of the file. Default: what the file says, else the scene's unit.
    pub unit_m: Option<f64>,
    /// How thick the hair is.
    pub width: WidthSection,
}

/// How thick the hair is. Without `diameter_um` the widths of the file count; a file without widths gets
/// 80 micrometres and a warning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WidthSection {
    /// Diameter of every fiber in micrometres at real scale, instead of the file's. Human hair has 60 to 120.
    pub diameter_um: Option<f64>,
    /// Factor on all widths. Default: 1.
    pub scale: f64,
    /// Further factor at the root. Default: 1.
    pub root_scale: f64,
    /// Further factor at the tip, straight between root and tip. Default: 1.
    pub tip_scale: f64,
}

impl Default for WidthSection {
    fn default() -> Self {
        Self { diameter_um: None, scale: 1.0, root_scale: 1.0, tip_scale: 1.0 }
    }
}

/// Hair that is grown: a preset, and what is changed about it. Lengths are centimetres on the built-in head,
/// and the groom's unit on an ellipsoid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ProceduralSection {
    /// What the hair is like. Default: `wavy_long`.
    pub preset: GroomPresetKind,
    /// Grow on an ellipsoid instead of the built-in head.
    pub ellipsoid: Option<EllipsoidSection>,
    /// Where on the surface hair grows. Default: `scalp` on the head, `everywhere` for the preset `fur` and
    /// on an ellipsoid.
    pub region: Option<RegionKind>,
    /// Other seeds give other hair of the same kind.
    pub seed: Option<u32>,
    /// Number of strands, 1 to 1000000; a human head has about 100000.
    pub strands: Option<u32>,
    /// Points per strand, 2 to 256; waves need about ten each.
    pub points: Option<u32>,
    /// Height of the hairline over the forehead. Scalp only.
    pub hairline_front: Option<f64>,
    /// Height of the hairline at the nape. Scalp only.
    pub hairline_nape: Option<f64>,
    /// Half the height over which hair thins out at the hairline. Scalp only.
    pub hairline_softness: Option<f64>,
    /// Where the parting runs: x, positive on the head's own left. Scalp only.
    pub parting: Option<f64>,
    /// How strongly hair is combed away from the parting; 0 for none. Scalp only.
    pub parting_strength: Option<f64>,
    /// Length of a strand before waves and curls.
    pub length: Option<f64>,
    /// Share by which lengths vary, below 1.
    pub length_variation: Option<f64>,
    /// Share by which lengths shrink towards the face and the nape, and at random.
    pub layering: Option<f64>,
    /// Bend towards the ground.
    pub gravity: Option<f64>,
    /// How much strands stand off the skin at the root: 0 flat, 1 at about half a right angle.
    pub lift: Option<f64>,
    /// Thickness of the layer that the hair makes over the skin.
    pub volume: Option<f64>,
    /// Direction in which hair is combed, any length but 0.
    pub comb: Option<[f64; 3]>,
    /// Length of a strand over which the comb's influence fades to a third.
    pub comb_length: Option<f64>,
    /// How much strands stray from their course.
    pub wander: Option<f64>,
    /// Share of the hair at the sides that falls in front of the shoulders. Built-in head only.
    pub over_shoulders: Option<f64>,
    /// Number of guide strands, 1 to 3000.
    pub guides: Option<u32>,
    /// Number of clumps, 1 to 50000.
    pub clumps: Option<u32>,
    /// How far strands draw together at the tip, 0 to 1.
    pub clump_strength: Option<f64>,
    /// Where along the strand they do: 1 evenly from root to tip, less near the root already.
    pub clump_profile: Option<f64>,
    /// Amplitude of the wave.
    pub wave_amplitude: Option<f64>,
    /// Length of a wave.
    pub wave_length: Option<f64>,
    /// Share of the strand's length that stays straight before the wave sets in, 0 to 1.
    pub wave_start: Option<f64>,
    /// Radius of the curl.
    pub curl_radius: Option<f64>,
    /// Turns of the curl over the whole length.
    pub curl_turns: Option<f64>,
    /// Amplitude of the frizz at the tip.
    pub frizz: Option<f64>,
    /// Length of one ripple of the frizz.
    pub frizz_length: Option<f64>,
    /// Share of strands that leave their clump, 0 to 1.
    pub flyaways: Option<f64>,
    /// How much strands differ from each other: 0 not at all, 1 as hair does.
    pub randomness: Option<f64>,
}

/// What grown hair is like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GroomPresetKind {
    /// Long, loosely wavy, parted a little left of the centre.
    #[default]
    WavyLong,
    /// Long, sleek, straight.
    Straight,
    /// Short, combed aside.
    Short,
    /// Voluminous curls to the shoulders.
    Curly,
    /// Short, dense fur, combed backwards.
    Fur,
}

/// An ellipsoid to grow hair on; it is not rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidSection {
    /// The centre. Default: the origin.
    #[serde(default)]
    pub center: [f64; 3],
    /// The half axes along x, y and z.
    pub radii: [f64; 3],
    /// Hair grows only higher than this.
    pub above: Option<f64>,
}

/// Where on a surface hair grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RegionKind {
    /// Behind the hairline of the built-in head.
    Scalp,
    /// All over.
    Everywhere,
}

/// What fibers are made of: a model and its parameters. Which parameters there are depends on the model.
///
/// The colour of `deon`, `chiang`, `marschner` and `fur` is given in exactly one form: eumelanin and pheomelanin, melanin and
/// redness, color, or absorption.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LookSection {
    /// The scattering model. Default: `deon`.
    pub model: Option<ModelKind>,
    /// Values to start from; what else is given replaces them. For models with pigment: `deon`, `chiang`,
    /// `marschner`, `fur`.
    pub preset: Option<PresetKind>,
    /// Models with pigment: concentration of eumelanin (brown), 0 to 100: 0.3 blonde, 1.3 brown, 8 black.
    /// Default: 1.3, or 0 when only pheomelanin is given.
    pub eumelanin: Option<Param>,
    /// Models with pigment: concentration of pheomelanin (red), 0 to 100. Default: 0.2, or 0 when only eumelanin
    /// is given.
    pub pheomelanin: Option<Param>,
    /// Models with pigment: amount of pigment as in Cycles, 0 (none) to 1 (black). Default: 0.8 when only redness
    /// is given.
    pub melanin: Option<Param>,
    /// Models with pigment: share of the red pigment as in Cycles, 0 to 1. Default: 0.
    pub redness: Option<Param>,
    /// Models with pigment: the colour that thick hair takes on after much scattering, 0 to 1 per channel.
    pub color: Option<Param>,
    /// deon, chiang: how `color` becomes absorption. Default: `fit` for chiang, `numeric` for deon.
    pub color_method: Option<ColorMethodKind>,
    /// Models with pigment: absorption per fiber radius, 0 to 10000 per channel.
    pub absorption: Option<Param>,
    /// Models with pigment: whose pigment constants are used. Default: `pbrt` for eumelanin and pheomelanin,
    /// `cycles` for melanin and redness.
    pub melanin_constants: Option<MelaninConstantsKind>,
    /// deon, marschner, fur: width of the highlight along the fiber, degrees (standard deviation; marschner: of
    /// the half angle), 0.02 to 90. Default: 7.5.
    pub longitudinal_roughness_deg: Option<Param>,
    /// deon, fur: width of the highlight around the fiber, degrees (standard deviation), 0.02 to 90. Default:
    /// the longitudinal one.
    pub azimuthal_roughness_deg: Option<Param>,
    /// chiang: roughness along the fiber, 0.01 to 1. Default: 0.3.
    pub longitudinal_roughness: Option<Param>,
    /// chiang: roughness around the fiber, 0.01 to 1. Default: 0.3.
    pub azimuthal_roughness: Option<Param>,
    /// deon, chiang, fur, marschner, hery: tilt of the cuticle scales, degrees, -20 to 20. Negative, as on real
    /// hair, moves the highlight to the root. Default: deon and fur -3, marschner -5, chiang and hery -2.
    pub tilt_deg: Option<Param>,
    /// deon, chiang, fur, marschner: index of refraction, 1.01 to 3. Default: 1.55.
    pub ior: Option<Param>,
    /// deon: whether light that bounces inside three times and more is kept. Default: true.
    pub residual: Option<bool>,
    /// deon: at which angle the attenuations are evaluated. Default: `difference`.
    pub attenuation: Option<AttenuationKind>,
    /// deon: how a sample is weighted. Default: `marginal`.
    pub weights: Option<WeightsKind>,
    /// deon, chiang: whether the place across the fiber counts. Default: `near`.
    pub field: Option<FieldKind>,
    /// lambertian: reflectance, 0 to 1. Default: 0.5.
    pub albedo: Option<Param>,
    /// kajiya_kay: diffuse reflectance, 0 to 1. Default: [0.4, 0.25, 0.15]. marschner: a diffuse part that
    /// stands for what the lobes leave out. Default: 0.
    pub diffuse: Option<Param>,
    /// kajiya_kay: strength of the highlight, 0 to 1. Default: 0.2.
    pub specular: Option<Param>,
    /// kajiya_kay: sharpness of the highlight, 0 to 10000. Default: 25.
    pub exponent: Option<Param>,
    /// kajiya_kay: tilt of the tangent for the highlight, degrees, -20 to 20; negative moves it to the root.
    /// Default: 0.
    pub shift_deg: Option<Param>,
    /// kajiya_kay: strength of the second highlight, 0 to 1. Default: 0, none.
    pub specular2: Option<Param>,
    /// kajiya_kay: sharpness of the second highlight. Default: 25.
    pub exponent2: Option<Param>,
    /// kajiya_kay: tilt of the tangent for the second highlight, degrees. Default: 0.
    pub shift2_deg: Option<Param>,
    /// hery: colour of the highlight, 0 to 1. Default: 1.
    pub tint: Option<Param>,
    /// hery: width of the highlight, degrees (standard deviation of the half angle), 0.02 to 90. Default: 5.
    pub roughness_deg: Option<Param>,
    /// hery: colour of the second highlight, 0 to 1. Default: 0, none.
    pub tint2: Option<Param>,
    /// hery: width of the second highlight, degrees. Default: 10.
    pub roughness2_deg: Option<Param>,
    /// hery: tilt of the second highlight, degrees. Default: 5.
    pub tilt2_deg: Option<Param>,
    /// marschner: shorter over longer diameter of the cross-section, 0.85 to 1. Default: 1.
    pub eccentricity: Option<Param>,
    /// marschner: how the paths that leave at an azimuth are found. Default: `exact`.
    pub roots: Option<RootsKind>,
    /// marschner: whether caustics are smoothed into glints. Default: true.
    pub glints: Option<bool>,
    /// marschner: strength of the glints, 0 to 5. Default: 1.
    pub glint_strength: Option<Param>,
    /// marschner: width of the glints in azimuth, degrees, 0.1 to 90. Default: 15. sadeghi: standard deviation
    /// of the glints. Default: 5.
    pub glint_width_deg: Option<Param>,
    /// marschner: stretch of the index over which glints fade where there is no caustic any more, 0.001 to 1.
    /// Default: 0.3.
    pub glint_fade: Option<Param>,
    /// marschner: widest part of the cross-section that feeds a glint, 0 to 1. Default: 0.5.
    pub glint_limit: Option<Param>,
    /// sadeghi: strength of the glints beside the rest of TRT, 0 to 100. Default: 1.
    pub glint_intensity: Option<Param>,
    /// sadeghi: azimuth of the glints, degrees, 0 to 180. Default: 37.5, another on every strand by up to 7.5.
    pub glint_angle_deg: Option<Param>,
    /// sadeghi: colour of lobe R, the first highlight, 0 to 1. Default: 1.
    pub r_color: Option<Param>,
    /// sadeghi: intensity of R, 0 to 100. Default: 0.45.
    pub r_intensity: Option<Param>,
    /// sadeghi: position of R, degrees in the half angle, -45 to 45; negative lies towards the root.
    /// Default: -5.
    pub r_shift_deg: Option<Param>,
    /// sadeghi: width of R along the fiber, degrees (standard deviation of the half angle). Default: 7.5.
    pub r_width_deg: Option<Param>,
    /// sadeghi: colour of lobe TT, the light that passes through. Default: [0.5, 0.3, 0.15].
    pub tt_color: Option<Param>,
    /// sadeghi: intensity of TT. Default: 0.25.
    pub tt_intensity: Option<Param>,
    /// sadeghi: position of TT, degrees. Default: 2.5.
    pub tt_shift_deg: Option<Param>,
    /// sadeghi: width of TT along the fiber, degrees. Default: 3.75.
    pub tt_width_deg: Option<Param>,
    /// sadeghi: width of TT around the fiber, degrees. Default: 10.
    pub tt_azimuthal_width_deg: Option<Param>,
    /// sadeghi: colour of lobe TRT, the second, coloured highlight. Default: [0.4, 0.2, 0.08].
    pub trt_color: Option<Param>,
    /// sadeghi: intensity of TRT. Default: 0.3.
    pub trt_intensity: Option<Param>,
    /// sadeghi: position of TRT, degrees. Default: 7.5.
    pub trt_shift_deg: Option<Param>,
    /// sadeghi: width of TRT along the fiber, degrees. Default: 15.
    pub trt_width_deg: Option<Param>,
    /// fur: radius of the medulla in fiber radii, 0 to 0.95. Default: 0.6.
    pub medulla: Option<Param>,
    /// fur: scattering of the medulla per fiber radius, 0 to 1000. Default: 2.
    pub medulla_scattering: Option<Param>,
    /// fur: absorption of the medulla per fiber radius, 0 to 10000 per channel. Default: 0.
    pub medulla_absorption: Option<Param>,
    /// fur: anisotropy of the medulla's scattering, -0.6 (back) to 0.9 (forward). Default: 0.4.
    pub medulla_anisotropy: Option<Param>,
    /// fur: number of layers of the cuticle, 1 to 10; more reflect more. Default: 1.
    pub cuticle_layers: Option<Param>,
    /// hery: whether the factor of the difference angle is kept. Default: false.
    pub cos_theta_d: Option<bool>,
    /// kajiya_kay: `normalised` (default) or `thesis`. hery: `truncated` (default), `faithful` or
    /// `faithful_exact_pdf`. marschner: `normalised` (default) or `as_printed`. sadeghi: `normalised`
    /// (default) or `legacy`.
    pub mode: Option<ModeKind>,
}

/// A scattering model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModelKind {
    /// d'Eon et al. 2011 with the sampler of 2013: the reference.
    #[default]
    Deon,
    /// Chiang et al. 2016, as in pbrt, Mitsuba and Cycles.
    Chiang,
    /// A perfectly diffuse cylinder.
    Lambertian,
    /// Kajiya and Kay 1989.
    KajiyaKay,
    /// Hery and Ramamoorthi 2012: the highlight alone.
    Hery,
    /// Marschner et al. 2003.
    Marschner,
    /// Sadeghi et al. 2010: the lobes of Marschner et al. under an artist's control.
    Sadeghi,
    /// Fur with a scattering medulla, after Yan et al. 2017.
    Fur,
}

/// How a colour becomes absorption.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColorMethodKind {
    /// The fit that Chiang et al. published, as in pbrt, Mitsuba and Cycles.
    Fit,
    /// Our own simulation of dense hair of this model, inverted.
    Numeric,
}

/// How the paths that leave at an azimuth are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RootsKind {
    /// By solving for them.
    Exact,
    /// By the cubic approximation of the paper.
    Cubic,
}

/// A hair colour by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PresetKind {
    /// Black: eumelanin 8.
    Black,
    /// Dark brown: eumelanin 3, pheomelanin 0.3.
    DarkBrown,
    /// Brown: eumelanin 1.3, pheomelanin 0.2.
    Brown,
    /// Light brown: eumelanin 0.7, pheomelanin 0.2.
    LightBrown,
    /// Auburn: eumelanin 0.6, pheomelanin 1.
    Auburn,
    /// Red: eumelanin 0.1, pheomelanin 1.
    Red,
    /// Blonde: eumelanin 0.3, pheomelanin 0.1.
    Blonde,
    /// Platinum: eumelanin 0.06, pheomelanin 0.02.
    Platinum,
    /// Grey: eumelanin 0.35 that varies much from strand to strand.
    Grey,
    /// White: no pigment.
    White,
}

/// Whose pigment constants are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MelaninConstantsKind {
    /// Those of pbrt and Mitsuba.
    Pbrt,
    /// Those of Cycles.
    Cycles,
}

/// At which angle the attenuations are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AttenuationKind {
    /// At the difference angle, as published.
    Difference,
    /// At the known direction: conserves energy exactly.
    Known,
}

/// How a sample is weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WeightsKind {
    /// With the hidden offset: cheap, unbiased.
    Joint,
    /// Value over density: less noise, dearer.
    Marginal,
    /// As `joint`, at most 2: biased, as published.
    Clamped,
}

/// Whether the place across the fiber counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FieldKind {
    /// It does: right for close views, and faster.
    Near,
    /// It is averaged: right for fibers thinner than a pixel.
    Far,
    /// Averaged where a fiber looks thinner than 0.75 pixels, not where it looks wider than 1.5.
    Auto,
}

/// A variant of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModeKind {
    /// kajiya_kay, marschner, sadeghi: conserves energy.
    Normalised,
    /// kajiya_kay: the classic look.
    Thesis,
    /// hery: exact density.
    Truncated,
    /// hery: as published.
    Faithful,
    /// hery: the published sampler with its true density.
    FaithfulExactPdf,
    /// marschner: as published, twice as bright as what arrives.
    AsPrinted,
    /// sadeghi: as published, not conserving.
    Legacy,
}

/// The JSON schema of the scene file, as pretty-printed JSON, for editors that complete and check TOML.
pub fn schema() -> String {
    format!("{:#}", schemars::schema_for!(SceneFile).as_value())
}
