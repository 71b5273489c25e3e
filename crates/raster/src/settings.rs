//! Everything that can be chosen about a picture besides the scene: one plain structure.

use fiber::convert::Kind;

/// How a scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How strands become fragments.
    pub geometry: Geometry,
    /// How fragments get their colour.
    pub shading: Shading,
    /// What the scene's lights become.
    pub lights: Lighting,
    /// What keeps light from fragments.
    pub shadow: Shadow,
    /// How fragments become pixels.
    pub transparency: Transparency,
    /// Samples a side of a pixel, `1..=4`: the picture is drawn so many times as large and averaged.
    pub supersample: u32,
}

/// How strands become fragments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Ribbons or lines.
    pub shape: Shape,
    /// Straight pieces between two points of a strand, `1..=16`; their ends lie on the scene's curve.
    pub subdivisions: u32,
    /// Share of the strands that is drawn, `(0, 1]`. The others' width goes to those that are left.
    pub strands: f32,
    /// Opacity of hair where it covers a pixel, `[0, 1]`. The path tracer's fibers have 1.
    pub opacity: f32,
}

/// What a piece of strand is on screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// A band that faces the viewer, never narrower than a pixel; narrower ones become transparent.
    #[default]
    Ribbon,
    /// A line one pixel wide, transparent in proportion.
    Line,
}

/// How fragments get their colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shading {
    /// Another model than that of the look; its parameters come from the look by
    /// [`fiber::Fiber::converted`].
    pub model: Option<Kind>,
    /// Whether models that have tables are evaluated by them.
    pub source: ShadingSource,
    /// Whether a fragment is shaded when it is drawn or when the picture is put together.
    pub when: ShadingTime,
    /// Light that was scattered by other fibers.
    pub multiple: Option<DualScattering>,
    /// Most different fibers per look that varies, `1..=256`.
    pub palette: u32,
    /// Texels a side of the tables, `8..=512`.
    pub table_size: u32,
}

/// Where values of the fiber model come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadingSource {
    /// Textures, for models that have them: Marschner, d'Eon, Chiang.
    #[default]
    Tables,
    /// The model itself, fragment by fragment.
    Direct,
}

/// When a fragment is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadingTime {
    /// When it is drawn.
    Forward,
    /// When the picture is put together: only those that matter.
    #[default]
    Deferred,
}

/// The densities of dual scattering, both in `[0, 1]`: how full of hair the directions are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DualScattering {
    /// Towards the light.
    pub density_forward: f32,
    /// Away from it.
    pub density_backward: f32,
}

impl Default for DualScattering {
    fn default() -> Self {
        Self { density_forward: 0.7, density_backward: 0.7 }
    }
}

/// What the scene's lights become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lighting {
    /// Directions that stand for an environment, `1..=64`.
    pub environment_directions: u32,
    /// Points that stand for a rectangle, `1..=16`.
    pub area_samples: u32,
    /// Whether the smooth part of an environment is spherical harmonics without shadow.
    pub harmonics: bool,
}

/// Shadows. The technique is that of hair; solid meshes cast plain ones, into maps of their own with the same
/// resolution and filter, unless the technique is [`ShadowTechnique::None`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shadow {
    /// Which technique.
    pub technique: ShadowTechnique,
    /// Texels a side of each map, `16..=4096`.
    pub resolution: u32,
    /// How many texels are averaged.
    pub filter: Filter,
    /// How much of the shadow is applied, `[0, 1]`.
    pub strength: f32,
    /// Opacity of one fiber, `[0, 1]`; see [`KAPPA`].
    pub alpha: f32,
    /// Share of the strands that casts shadows, `(0, 1]`, with their width made up for.
    pub strands: f32,
}

/// Scale of opacities (`τ = exp(-κ Σ α)`): `8 ln 2`.
///
/// With [`Shadow::PHYSICAL_ALPHA`] each fiber crossed takes all light that meets it.
pub const KAPPA: f32 = 8.0 * std::f32::consts::LN_2;

impl Shadow {
    /// The opacity at which a fiber blocks all light that meets it: `1 / κ`.
    pub const PHYSICAL_ALPHA: f32 = 1.0 / KAPPA;
}

/// How light on its way through hair is estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShadowTechnique {
    /// No shadow at all, neither of hair nor of meshes.
    None,
    /// A depth map: lit or not.
    Map,
    /// Approximated deep shadow map: fibers guessed from the depth behind the first one.
    Adsm {
        /// Distance between fibers along a ray, scene units; `None`: from the groom's mean density.
        spacing: Option<f32>,
    },
    /// Opacity shadow maps: 16 slices of equal thickness.
    Osm,
    /// Deep opacity maps: layers that follow the first fiber.
    Dom {
        /// Number of layers, `1..=4`.
        layers: u32,
        /// Where the layers end, as shares of the hair's depth; unused ones are ignored, the last one used holds the
        /// rest.
        ends: [f32; 4],
    },
}

impl ShadowTechnique {
    /// Deep opacity maps as in the literature: 5 %, 15 % and the rest.
    pub const DOM: Self = Self::Dom { layers: 3, ends: [0.05, 0.2, 1.0, 1.0] };

    /// A name for tables and flags.
    pub fn name(&self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Map => "sm",
            Self::Adsm { .. } => "adsm",
            Self::Osm => "osm",
            Self::Dom { .. } => "dom",
        }
    }
}

/// Percentage-closer filtering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// One texel.
    None,
    /// 3 by 3 texels.
    #[default]
    Pcf3,
    /// 5 by 5 texels.
    Pcf5,
}

impl Filter {
    /// Texels to either side.
    pub fn radius(self) -> u32 {
        match self {
            Self::None => 0,
            Self::Pcf3 => 1,
            Self::Pcf5 => 2,
        }
    }

    /// A name for tables and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Pcf3 => "3x3",
            Self::Pcf5 => "5x5",
        }
    }
}

/// How fragments become pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transparency {
    /// The nearest fragment, as if it were opaque.
    Opaque,
    /// Strands or pieces sorted on the CPU, then blended by the hardware.
    Blend {
        /// What is sorted.
        sort: Sort,
    },
    /// Weighted blended transparency, not sorted.
    Weighted,
    /// Lists of all fragments, sorted per pixel.
    ABuffer {
        /// Blend only so many of the nearest, `1..=16`; `None`: all.
        foremost: Option<u32>,
    },
    /// The nearest fragments only.
    KPlus {
        /// How many, `1..=16`.
        k: u32,
        /// How fragments of one pixel are kept from disturbing each other.
        form: KPlusForm,
    },
    /// Lists of the fragments in a layer behind the nearest, opaque hair behind it.
    Dbk {
        /// How thick the layer is.
        shift: DepthShift,
    },
    /// Random subsets of the strands, each opaque, blended in order.
    RandomSubsets {
        /// How many, `1..=16`.
        k: u32,
    },
}

impl Transparency {
    /// A name for tables and flags.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Opaque => "opaque",
            Self::Blend { .. } => "blend",
            Self::Weighted => "weighted",
            Self::ABuffer { foremost: None } => "a-buffer",
            Self::ABuffer { .. } => "a-buffer-k",
            Self::KPlus { form: KPlusForm::LockFree, .. } => "k-plus",
            Self::KPlus { form: KPlusForm::MaxArray, .. } => "k-plus-array",
            Self::KPlus { form: KPlusForm::MaxHeap, .. } => "k-plus-heap",
            Self::Dbk { .. } => "dbk",
            Self::RandomSubsets { .. } => "subsets",
        }
    }
}

/// What is sorted on the CPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sort {
    /// Nothing.
    None,
    /// Whole strands, by the depth of their middle.
    #[default]
    Strands,
    /// Every piece.
    Pieces,
}

/// How the K+-buffer keeps fragments of one pixel apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KPlusForm {
    /// Atomic minima, in two passes over the hair: no lock.
    #[default]
    LockFree,
    /// A semaphore per pixel around an array whose first entry is the farthest. Bounded spinning: on some GPUs
    /// fragments are lost, which is counted.
    MaxArray,
    /// The same around a binary heap.
    MaxHeap,
}

/// Thickness of the DBK-buffer's layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthShift {
    /// As thick as it takes to reach this opacity, `(0, 1)`, in every pixel.
    Automatic {
        /// 0.97 by default. What lies behind the layer counts with its exact opacity, so that 0.99 is no better to look
        /// at (with both the test grooms differ from the full lists by FLIP below 0.001), but stores an eighth more.
        opacity: f32,
    },
    /// The same everywhere, scene units.
    Fixed(f32),
}

impl Default for DepthShift {
    fn default() -> Self {
        Self::Automatic { opacity: 0.97 }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            geometry: Geometry { shape: Shape::Ribbon, subdivisions: 1, strands: 1.0, opacity: 1.0 },
            shading: Shading {
                model: None,
                source: ShadingSource::Tables,
                when: ShadingTime::Deferred,
                multiple: Some(DualScattering::default()),
                palette: 32,
                table_size: 64,
            },
            lights: Lighting { environment_directions: 12, area_samples: 1, harmonics: false },
            shadow: Shadow {
                technique: ShadowTechnique::DOM,
                resolution: 512,
                filter: Filter::Pcf3,
                strength: 1.0,
                alpha: Shadow::PHYSICAL_ALPHA,
                strands: 1.0,
            },
            transparency: Transparency::Dbk { shift: DepthShift::default() },
            supersample: 1,
        }
    }
}

/// A setting that is out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {found}; it must be {range}")]
pub struct SettingError {
    /// Which setting.
    pub name: &'static str,
    /// What it is.
    pub found: String,
    /// What it may be.
    pub range: &'static str,
}

impl Settings {
    /// Whether everything is in its range.
    ///
    /// # Errors
    /// The first setting that is not.
    pub fn check(&self) -> Result<(), SettingError> {
        let count = |name, found: u32, least: u32, most: u32, range| {
            if (least..=most).contains(&found) {
                Ok(())
            } else {
                Err(SettingError { name, found: found.to_string(), range })
            }
        };
        let share = |name, found: f32, open: bool, range| {
            // NaN is in no range.
            let inside = if open { found > 0.0 && found <= 1.0 } else { (0.0..=1.0).contains(&found) };
            if inside { Ok(()) } else { Err(SettingError { name, found: found.to_string(), range }) }
        };
        count("subdivisions", self.geometry.subdivisions, 1, 16, "1 to 16")?;
        share("the share of strands", self.geometry.strands, true, "above 0 and at most 1")?;
        share("opacity", self.geometry.opacity, false, "0 to 1")?;
        count("the palette", self.shading.palette, 1, 256, "1 to 256")?;
        count("the size of tables", self.shading.table_size, 8, 512, "8 to 512")?;
        if let Some(densities) = self.shading.multiple {
            share("the forward density", densities.density_forward, false, "0 to 1")?;
            share("the backward density", densities.density_backward, false, "0 to 1")?;
        }
        count("the number of environment directions", self.lights.environment_directions, 1, 64, "1 to 64")?;
        count("the number of samples of an area light", self.lights.area_samples, 1, 16, "1 to 16")?;
        count("the shadow resolution", self.shadow.resolution, 16, 4096, "16 to 4096")?;
        share("the shadow strength", self.shadow.strength, false, "0 to 1")?;
        share("the shadow alpha", self.shadow.alpha, false, "0 to 1")?;
        share("the share of strands that cast shadows", self.shadow.strands, true, "above 0 and at most 1")?;
        match self.shadow.technique {
            ShadowTechnique::Adsm { spacing: Some(found) } if !(found > 0.0 && found.is_finite()) => {
                return Err(SettingError {
                    name: "the fiber spacing",
                    found: found.to_string(),
                    range: "above 0, scene units",
                });
            }
            ShadowTechnique::Dom { layers, ends } => {
                count("the number of opacity layers", layers, 1, 4, "1 to 4")?;
                let used = &ends[..layers as usize];
                for end in used {
                    share("the end of an opacity layer", *end, true, "above 0 and at most 1")?;
                }
                if !used.windows(2).all(|pair| pair[0] < pair[1]) {
                    return Err(SettingError {
                        name: "the ends of the opacity layers",
                        found: format!("{used:?}"),
                        range: "rising",
                    });
                }
            }
            _ => {}
        }
        match self.transparency {
            Transparency::ABuffer { foremost: Some(k) }
            | Transparency::KPlus { k, .. }
            | Transparency::RandomSubsets { k } => {
                count("k", k, 1, 16, "1 to 16")?;
            }
            Transparency::Dbk { shift: DepthShift::Automatic { opacity } } if !(opacity > 0.0 && opacity < 1.0) => {
                return Err(SettingError {
                    name: "the opacity of the layer",
                    found: opacity.to_string(),
                    range: "above 0 and below 1",
                });
            }
            Transparency::Dbk { shift: DepthShift::Fixed(shift) } if !(shift >= 0.0 && shift.is_finite()) => {
                return Err(SettingError {
                    name: "the depth shift",
                    found: shift.to_string(),
                    range: "at least 0, scene units",
                });
            }
            _ => {}
        }
        count("supersampling", self.supersample, 1, 4, "1 to 4")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_named() {
        assert_eq!(Settings::default().check(), Ok(()));
        let mut settings = Settings::default();
        settings.shadow.strength = f32::NAN;
        assert_eq!(settings.check().unwrap_err().to_string(), "the shadow strength is NaN; it must be 0 to 1");
        let mut settings = Settings::default();
        settings.shadow.technique = ShadowTechnique::Dom { layers: 3, ends: [0.2, 0.1, 1.0, 1.0] };
        assert!(settings.check().unwrap_err().to_string().contains("rising"));
        let settings = Settings { transparency: Transparency::KPlus { k: 17, form: KPlusForm::LockFree }, ..settings };
        assert!(settings.check().is_err());
    }
}
