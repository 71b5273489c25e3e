//! What the lights of a scene become for a rasteriser: lamps to loop over, ambient light, and a sky to look at.
//!
//! A rasteriser wants every light to come from one point or one direction, so that it can have a shadow map. What
//! becomes of which light:
//!
//! | light | becomes | is lost |
//! |---|---|---|
//! | point, spot | itself | nothing |
//! | distant | one direction | the width of its penumbra |
//! | sphere | a point with intensity `L π r²`: exact for a facing surface outside it | penumbra; the light near by |
//! | rectangle | `n` points with cosine, intensity `L A / n` each | penumbra between the points; the light near by |
//! | constant environment | `n` even directions, or ambient light | penumbra; as ambient light all its shadows |
//! | image | `n` directions, after the ambient light where there is one: [`environment`] | penumbra; detail |
//!
//! No light is lost or added, per channel. [`Lamps::notes`] says to the user what was done to this scene's lights.

mod environment;
mod harmonics;

use std::sync::Arc;

use math::{Rgb, Vec3};
use scene::{Light, Scene};

use environment::Beam;
pub(crate) use environment::{Sky, SkyLayer};
pub(crate) use harmonics::{Harmonics, SHADER as HARMONICS_SHADER};

/// What kind of light a [`Lamp`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LampKind {
    /// From infinitely far away, from one direction.
    Directional,
    /// From a point, to all sides or, with [`Lamp::cosine`], to one.
    Point,
    /// From a point into a cone.
    Spot,
}

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lamp {
    /// What it is.
    pub(crate) kind: LampKind,
    /// Where it is, scene units; the origin for a directional one.
    pub(crate) position: Vec3,
    /// Unit vector in which the light travels, on the axis where it goes to more sides than one.
    pub(crate) direction: Vec3,
    /// Directional: irradiance of a surface that faces it, W/m². Else intensity on the axis, W/sr with distances in
    /// scene units.
    pub(crate) color: Rgb,
    /// Whether intensity falls with the cosine to `direction`, as that of a piece of a surface.
    pub(crate) cosine: bool,
    /// With `cosine`: whether the back shines too.
    pub(crate) two_sided: bool,
    /// Of a spot: cosine of the angle up to which it is as bright as on the axis, and of that beyond which it is
    /// dark; smoothstep between.
    pub(crate) cone: Option<[f32; 2]>,
    /// Which light of the scene it is, or is part of.
    pub(crate) source: usize,
    /// Size of what it stands for, for soft shadows: radius in scene units, or of a directional lamp the half angle
    /// in radians. 0 for a light that has no size.
    pub(crate) radius: f32,
    /// Whether it casts shadows. All do as they come; for the renderer to clear where it cannot afford them.
    pub(crate) shadow: bool,
}

impl Lamp {
    /// What arrives at `at`, shadows apart: the unit direction to where it comes from, and the irradiance of a
    /// surface that faces it, W/m². None at the place of the lamp itself.
    pub(crate) fn reaching(&self, at: Vec3) -> (Vec3, Rgb) {
        if self.kind == LampKind::Directional {
            return (-self.direction, self.color);
        }
        let away = at - self.position;
        let distance2 = away.length_squared();
        if !(distance2 > 0.0) {
            return (-self.direction, Rgb::black());
        }
        let travels = away / distance2.sqrt();
        let cos = travels.dot(self.direction);
        let mut share = 1.0;
        if self.cosine {
            share *= if self.two_sided { cos.abs() } else { cos.max(0.0) };
        }
        if let Some([inner, outer]) = self.cone {
            share *= Light::spot_falloff(inner, outer, cos);
        }
        (-travels, self.color * (share / distance2))
    }
}

/// How lights are approximated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LampOptions {
    /// Directions for each environment. 0 with `harmonics`: ambient light alone; without, 0 counts as 1.
    pub(crate) environment_directions: u32,
    /// Points for each rectangle; 1, and 0 too, is its centre.
    pub(crate) area_samples: u32,
    /// Whether the smooth part of environments becomes ambient light, which has no shadows.
    pub(crate) harmonics: bool,
    /// Largest number of lamps; 0 counts as 1.
    pub(crate) most: usize,
}

impl Default for LampOptions {
    /// 16 directions, the centres of rectangles, no ambient light, 32 lamps.
    fn default() -> Self {
        Self { environment_directions: 16, area_samples: 1, harmonics: false, most: 32 }
    }
}

/// All light of a scene, as a rasteriser takes it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lamps {
    /// None is black; at most [`LampOptions::most`].
    pub(crate) lamps: Vec<Lamp>,
    /// Light without shadows.
    pub(crate) harmonics: Option<Harmonics>,
    /// What the camera sees behind everything.
    pub(crate) sky: Sky,
    /// What was approximated, and how: sentences for the user.
    pub(crate) notes: Vec<String>,
}

/// Directions that an environment keeps before rectangles lose points for it.
const FEWEST_DIRECTIONS: usize = 4;

impl Lamps {
    /// The lights of the scene, approximated.
    pub(crate) fn new(scene: &Scene, options: &LampOptions) -> Self {
        let most = options.most.max(1);
        let mut lamps = Self::default();
        let plan = lamps.plan(&scene.lights, options, most);
        for (source, light) in scene.lights.iter().enumerate() {
            lamps.add(source, light, &plan);
        }
        let center = scene.bounds().map_or(Vec3::ZERO, |(least, greatest)| 0.5 * (least + greatest));
        lamps.merge(most, center);
        lamps
    }

    /// How many directions and points there is room for.
    fn plan(&mut self, lights: &[Light], options: &LampOptions, most: usize) -> Plan {
        let ambient = options.harmonics;
        let asked = [options.environment_directions as usize, options.area_samples as usize];
        // Neither can be more than all of them, so that no product overflows.
        let mut directions = asked[0].max(usize::from(!ambient)).min(most);
        let mut points = asked[1].max(1).min(most);
        let (mut skies, mut rectangles, mut others) = (0, 0, 0);
        for light in lights.iter().filter(|light| !emitted(light).is_black()) {
            match light {
                Light::Environment { image: None, .. } if ambient => {}
                Light::Environment { .. } => skies += 1,
                Light::Rectangle { .. } => rectangles += 1,
                Light::Sphere { .. } | Light::Point { .. } | Light::Spot { .. } | Light::Distant { .. } => others += 1,
            }
        }
        if skies * directions + rectangles * points + others > most {
            let kept = directions.min(FEWEST_DIRECTIONS);
            let room = most.saturating_sub(others + skies * kept);
            points = points.min(room.checked_div(rectangles).unwrap_or(points).max(1));
            let room = most.saturating_sub(others + rectangles * points);
            directions = directions.min(room.checked_div(skies).unwrap_or(directions).max(kept));
        }
        if skies > 0 && directions < asked[0] {
            let count = counted(directions, "direction");
            self.notes.push(format!(
                "each environment has {count} instead of {}, so that there are no more than {}",
                asked[0],
                counted(most, "lamp"),
            ));
        }
        if rectangles > 0 && points < asked[1] {
            let count = counted(points, "point");
            self.notes.push(format!(
                "each rectangle has {count} instead of {}, so that there are no more than {}",
                asked[1],
                counted(most, "lamp"),
            ));
        }
        Plan { directions, points, ambient }
    }

    fn add(&mut self, source: usize, light: &Light, plan: &Plan) {
        if let Light::Environment { image, radiance, rotation, visible: true } = light {
            self.sky.layers.push(match image {
                None => SkyLayer::Constant(*radiance),
                Some(image) => SkyLayer::Image { image: Arc::clone(image), factor: *radiance, rotation: *rotation },
            });
        }
        // A dark light is nobody's approximation.
        if emitted(light).is_black() {
            return;
        }
        let point = Lamp {
            kind: LampKind::Point,
            position: Vec3::ZERO,
            direction: Vec3::NEG_Y,
            color: Rgb::black(),
            cosine: false,
            two_sided: false,
            cone: None,
            source,
            radius: 0.0,
            shadow: true,
        };
        match *light {
            Light::Environment { image: None, radiance, .. } if plan.ambient => {
                self.ambient(&Harmonics::constant(radiance));
                self.note(source, "the constant environment is ambient light, which nothing shadows");
            }
            Light::Environment { image: None, radiance, .. } => {
                let beams = environment::constant(radiance, plan.directions);
                let count = counted(beams.len(), "parallel light");
                self.note(source, &format!("the constant environment is {count}, spread evenly, with sharp shadows"));
                self.beams(&beams, point);
            }
            Light::Environment { image: Some(ref image), radiance, rotation, .. } => {
                let (beams, ambient) = environment::image(image, radiance, rotation, plan.directions, plan.ambient);
                if beams.is_empty() && ambient.is_none() {
                    // Every texel is black.
                    return;
                }
                let count = counted(beams.len(), "parallel light");
                let note = match &ambient {
                    None => format!("the environment image is {count} where it is brightest, with sharp shadows"),
                    Some(_) if beams.is_empty() => {
                        "the environment image is ambient light, blurred, which nothing shadows".to_owned()
                    }
                    Some(ambient) => {
                        let smooth = ambient.mean().luminance() * 4.0 * std::f32::consts::PI;
                        let sharp: f32 = beams.iter().map(|beam| beam.irradiance.luminance()).sum();
                        format!(
                            "of the environment image {:.0} % is ambient light, which nothing shadows, and what \
                             exceeds it is {count} with sharp shadows",
                            100.0 * smooth / (smooth + sharp),
                        )
                    }
                };
                if let Some(ambient) = &ambient {
                    self.ambient(ambient);
                }
                self.note(source, &note);
                self.beams(&beams, point);
            }
            Light::Rectangle { center, edge_u, edge_v, normal, radiance, two_sided, .. } => {
                let area = edge_u.cross(edge_v).length();
                let points = even_points(plan.points, edge_u.length(), edge_v.length());
                let share = area / points.len() as f32;
                self.lamps.extend(points.iter().map(|[a, b]| Lamp {
                    position: center + edge_u * *a + edge_v * *b,
                    direction: normal,
                    color: radiance * share,
                    cosine: true,
                    two_sided,
                    radius: (share / std::f32::consts::PI).sqrt(),
                    ..point
                }));
                let place = match points.len() {
                    1 => "one point at its centre".to_owned(),
                    n => format!("{n} points"),
                };
                self.note(source, &format!("the rectangle is {place}, with sharp shadows"));
            }
            Light::Sphere { center, radius, radiance, .. } => {
                let color = radiance * (std::f32::consts::PI * radius * radius);
                self.lamps.push(Lamp { position: center, color, radius, ..point });
                self.note(source, "the sphere is a point at its centre, with sharp shadows");
            }
            Light::Point { position, intensity } => {
                self.lamps.push(Lamp { position, color: intensity, ..point });
            }
            Light::Spot { position, direction, intensity, cos_inner, cos_outer } => {
                self.lamps.push(Lamp {
                    kind: LampKind::Spot,
                    position,
                    direction,
                    color: intensity,
                    cone: Some([cos_inner, cos_outer]),
                    ..point
                });
            }
            Light::Distant { direction, irradiance, half_angle } => {
                let kind = LampKind::Directional;
                self.lamps.push(Lamp { kind, direction, color: irradiance, radius: half_angle, ..point });
                if half_angle > 0.0 {
                    let wide = 2.0 * half_angle.to_degrees();
                    self.note(source, &format!("the disk of {wide:.2} degrees is one direction, with sharp shadows"));
                }
            }
        }
    }

    fn beams(&mut self, beams: &[Beam], lamp: Lamp) {
        self.lamps.extend(beams.iter().map(|beam| Lamp {
            kind: LampKind::Directional,
            direction: -beam.towards,
            color: beam.irradiance,
            radius: beam.half_angle,
            ..lamp
        }));
    }

    fn ambient(&mut self, light: &Harmonics) {
        self.harmonics = Some(self.harmonics.map_or(*light, |sum| sum.plus(light)));
    }

    fn note(&mut self, source: usize, text: &str) {
        self.notes.push(format!("light {source}: {text}"));
    }

    /// Makes one parallel lamp of those that bring least to `center`, if there are too many: from their mean
    /// direction, with all that they bring there.
    fn merge(&mut self, most: usize, center: Vec3) {
        if self.lamps.len() <= most {
            return;
        }
        let mut order: Vec<(f32, usize)> = Vec::with_capacity(self.lamps.len());
        for (i, lamp) in self.lamps.iter().enumerate() {
            // A lamp at the very centre brings it nothing that could be counted, and is the last to go.
            let is_there = lamp.kind != LampKind::Directional && lamp.position == center;
            let brings = if is_there { f32::INFINITY } else { lamp.reaching(center).1.luminance() };
            order.push((brings, i));
        }
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let weak = order.split_off(most - 1);
        let (mut color, mut mean) = (Rgb::black(), Vec3::ZERO);
        for &(brings, i) in &weak {
            // Several lamps at the centre: infinite, and no direction.
            if brings.is_finite() {
                let (towards, light) = self.lamps[i].reaching(center);
                color += light;
                mean -= towards * light.luminance();
            }
        }
        let source = self.lamps[weak[0].1].source;
        let mut kept: Vec<usize> = order.into_iter().map(|(_, i)| i).collect();
        kept.sort_unstable();
        self.lamps = kept.into_iter().map(|i| self.lamps[i]).collect();
        if !color.is_black() {
            self.lamps.push(Lamp {
                kind: LampKind::Directional,
                position: Vec3::ZERO,
                direction: mean.normalize_or(Vec3::NEG_Y),
                color,
                cosine: false,
                two_sided: false,
                cone: None,
                source,
                radius: 0.0,
                shadow: true,
            });
        }
        self.notes.push(format!(
            "there are at most {}: the weakest {} became one parallel light that brings the centre of the scene as \
             much",
            counted(most, "lamp"),
            weak.len(),
        ));
    }
}

/// What there is room for.
struct Plan {
    directions: usize,
    points: usize,
    ambient: bool,
}

/// Radiance, intensity or irradiance of a light.
fn emitted(light: &Light) -> Rgb {
    match light {
        Light::Environment { radiance, .. } | Light::Rectangle { radiance, .. } | Light::Sphere { radiance, .. } => {
            *radiance
        }
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity,
        Light::Distant { irradiance, .. } => *irradiance,
    }
}

/// "1 lamp", "2 lamps".
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Middles of `count` pieces of equal area of a rectangle with sides `u` and `v`, in `(-1/2, 1/2)²`: rows of about
/// square pieces, of different height where they are of different number.
fn even_points(count: usize, u: f32, v: f32) -> Vec<[f32; 2]> {
    let rows = (count as f32 * v / u).sqrt().round().clamp(1.0, count as f32) as usize;
    let mut points = Vec::with_capacity(count);
    for row in 0..rows {
        let (first, last) = (row * count / rows, (row + 1) * count / rows);
        let b = (first + last) as f32 / (2 * count) as f32 - 0.5;
        points.extend((first..last).map(|i| [((i - first) as f32 + 0.5) / (last - first) as f32 - 0.5, b]));
    }
    points
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use scene::{EnvironmentImage, NoAssets};

    use super::*;

    /// A scene with these lights, whose centre is the origin.
    fn lit_by(lights: Vec<Light>) -> Scene {
        let text = "[[mesh]]\nshape = { sphere = { radius = 2.0 } }\n";
        let mut scene = Scene::load(text, &[], &NoAssets).unwrap_or_else(|error| panic!("{error}"));
        scene.lights = lights;
        scene
    }

    fn lamps(lights: Vec<Light>, options: &LampOptions) -> Lamps {
        Lamps::new(&lit_by(lights), options)
    }

    fn constant(radiance: f32, visible: bool) -> Light {
        Light::Environment { image: None, radiance: Rgb::splat(radiance), rotation: 0.0, visible }
    }

    /// Half the sky bright, half dim, in two colours.
    fn picture(visible: bool) -> Light {
        let texel = |i: u32| if i < 16 * 32 { Rgb::new(0.5, 0.8, 2.0) } else { Rgb::new(0.3, 0.2, 0.1) };
        let pixels = (0..32 * 32).map(texel).collect();
        let image = Some(Arc::new(EnvironmentImage { width: 32, height: 32, pixels }));
        Light::Environment { image, radiance: Rgb::new(1.0, 2.0, 0.5), rotation: 0.4, visible }
    }

    /// 2 by 3, three above the origin, shining down.
    fn rectangle(two_sided: bool) -> Light {
        Light::Rectangle {
            center: Vec3::new(0.0, 3.0, 0.0),
            edge_u: Vec3::new(2.0, 0.0, 0.0),
            edge_v: Vec3::new(0.0, 0.0, 3.0),
            normal: Vec3::NEG_Y,
            radiance: Rgb::new(1.0, 2.0, 3.0),
            two_sided,
            visible: true,
        }
    }

    fn point(x: f32, intensity: f32) -> Light {
        Light::Point { position: Vec3::new(x, 0.0, 0.0), intensity: Rgb::splat(intensity) }
    }

    /// Irradiance of a surface at `at`, shadows apart.
    fn irradiance(lamps: &Lamps, at: Vec3, normal: Vec3) -> Rgb {
        lamps
            .lamps
            .iter()
            .map(|lamp| {
                let (towards, light) = lamp.reaching(at);
                light * towards.dot(normal).max(0.0)
            })
            .sum()
    }

    #[track_caller]
    fn near(found: f32, expected: f32, limit: f32) {
        assert!((found / expected - 1.0).abs() < limit, "{found} is not {expected}");
    }

    /// Irradiance per radiance of a surface that faces a rectangle of the same orientation above it: the corner
    /// formula for `a` by `b` at distance 1, four times.
    fn facing_rectangle(half_a: f32, half_b: f32) -> f32 {
        let side = |a: f32, b: f32| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
        4.0 * 0.5 * (side(half_a, half_b) + side(half_b, half_a))
    }

    #[test]
    fn a_rectangle_lights_as_the_closed_form_says() {
        let options = LampOptions { area_samples: 256, most: 256, ..LampOptions::default() };
        let many = lamps(vec![rectangle(false)], &options);
        assert_eq!(many.lamps.len(), 256);
        let below = irradiance(&many, Vec3::ZERO, Vec3::Y);
        // Half sides 1 and 1.5 at distance 3. The error goes as one over the number of points; 64 have 2.3e-3.
        near(below[1], 2.0 * facing_rectangle(1.0 / 3.0, 0.5), 1e-3);
        near(below[2], 1.5 * below[1], 1e-5);
        // Far away one point will do: L A cos cos / d².
        let one = lamps(vec![rectangle(false)], &LampOptions::default());
        assert_eq!(one.lamps.len(), 1);
        for (at, lamps) in [(Vec3::new(0.0, -197.0, 0.0), &one), (Vec3::new(120.0, -157.0, 0.0), &many)] {
            let d = at - Vec3::new(0.0, 3.0, 0.0);
            let cos = -d.y / d.length();
            near(irradiance(lamps, at, Vec3::Y)[0], 6.0 * cos * cos / d.length_squared(), 1e-3);
        }
        // Its back is dark, unless it has two fronts.
        let above = Vec3::new(0.0, 6.0, 0.0);
        assert!(irradiance(&many, above, Vec3::NEG_Y).is_black());
        let options = LampOptions { area_samples: 7, ..LampOptions::default() };
        let both = lamps(vec![rectangle(true)], &options);
        assert_eq!(irradiance(&both, above, Vec3::NEG_Y), irradiance(&both, Vec3::ZERO, Vec3::Y));
    }

    #[test]
    fn points_of_a_rectangle_share_it_evenly() {
        for count in 1..=40 {
            for [u, v] in [[1.0, 1.0], [2.0, 3.0], [10.0, 0.1], [0.1, 10.0]] {
                let points = even_points(count, u, v);
                assert_eq!(points.len(), count);
                assert!(points.iter().flatten().all(|x: &f32| x.abs() < 0.5));
                // Each stands for the same area, so that their mean is the centre.
                for axis in 0..2 {
                    let mean = points.iter().map(|p| p[axis]).sum::<f32>() / count as f32;
                    assert!(mean.abs() < 1e-5, "{count} points on {u} by {v}: {mean}");
                }
            }
        }
        assert_eq!(even_points(1, 2.0, 3.0), [[0.0, 0.0]]);
    }

    #[test]
    fn points_spheres_spots_and_suns_bring_what_they_should() {
        // A facing surface at distance d from the middle of a sphere: π L r²/d², exactly.
        let sphere = Light::Sphere { center: Vec3::X * 5.0, radius: 2.0, radiance: Rgb::splat(3.0), visible: false };
        let found = lamps(vec![sphere], &LampOptions::default());
        near(irradiance(&found, Vec3::ZERO, Vec3::X)[0], PI * 3.0 * 4.0 / 25.0, 1e-5);
        assert_eq!(found.lamps[0].radius, 2.0);

        let found = lamps(vec![point(4.0, 8.0)], &LampOptions::default());
        near(irradiance(&found, Vec3::ZERO, Vec3::X)[0], 0.5, 1e-6);
        assert!(found.notes.is_empty());

        let spot = Light::Spot {
            position: Vec3::Y * 2.0,
            direction: Vec3::NEG_Y,
            intensity: Rgb::splat(8.0),
            cos_inner: 0.9,
            cos_outer: 0.7,
        };
        let found = lamps(vec![spot], &LampOptions::default());
        assert_eq!(found.lamps[0].kind, LampKind::Spot);
        let at = |cos: f32| {
            let sin = (1.0 - cos * cos).sqrt();
            found.lamps[0].reaching(Vec3::new(2.0 * sin, 2.0 - 2.0 * cos, 0.0)).1[0]
        };
        // Bright, half way by symmetry, dark.
        near(at(0.95), 2.0, 1e-5);
        near(at(0.8), 1.0, 1e-4);
        assert_eq!([at(0.65), at(-1.0)], [0.0, 0.0]);

        let sun = Light::Distant { direction: Vec3::NEG_Z, irradiance: Rgb::splat(7.0), half_angle: 0.01 };
        let found = lamps(vec![sun], &LampOptions::default());
        assert_eq!(found.lamps[0].reaching(Vec3::ONE), (Vec3::Z, Rgb::splat(7.0)));
        assert_eq!(found.lamps[0].radius, 0.01);
    }

    #[test]
    fn environments_become_directions_or_ambient_light() {
        let options = LampOptions::default();
        let found = lamps(vec![constant(0.5, true), picture(false)], &options);
        assert_eq!(found.lamps.len(), 32);
        assert!(found.lamps.iter().all(|lamp| lamp.kind == LampKind::Directional && lamp.shadow));
        assert_eq!(found.lamps.iter().filter(|lamp| lamp.source == 1).count(), 16);
        assert!(found.harmonics.is_none());
        // Only the visible one is seen.
        assert_eq!(found.sky.radiance(Vec3::Y), Rgb::splat(0.5));
        // Light from above travels down, and the bright half is above.
        let down = |source: usize| -> f32 {
            let of = found.lamps.iter().filter(|lamp| lamp.source == source);
            of.map(|lamp| -lamp.direction.y * lamp.color[2]).sum()
        };
        assert!(down(1) > 1.0 && down(0).abs() < 1e-3, "{} and {}", down(1), down(0));

        let options = LampOptions { harmonics: true, ..options };
        let both = lamps(vec![constant(0.5, true), picture(true)], &options);
        let ambient = both.harmonics.expect("ambient light");
        assert!(both.lamps.iter().all(|lamp| lamp.source == 1));
        let light: Rgb = found.lamps.iter().map(|lamp| lamp.color).sum();
        let again: Rgb = both.lamps.iter().map(|lamp| lamp.color).sum::<Rgb>() + ambient.mean() * (4.0 * PI);
        for k in 0..3 {
            near(again[k], light[k], 1e-4);
        }
        assert!(both.sky.radiance(Vec3::Y)[2] > 1.49);
        // No directions at all: everything is ambient.
        let flat = lamps(vec![picture(true)], &LampOptions { environment_directions: 0, ..options });
        assert!(flat.lamps.is_empty() && flat.harmonics.is_some());
        // Without ambient light there has to be one.
        let one = LampOptions { environment_directions: 0, harmonics: false, ..options };
        assert_eq!(lamps(vec![constant(0.5, true)], &one).lamps.len(), 1);
    }

    #[test]
    fn dark_lights_are_left_out() {
        let dark = vec![constant(0.0, true), point(1.0, 0.0), point(2.0, 1.0)];
        let found = lamps(dark, &LampOptions::default());
        assert_eq!(found.lamps.iter().map(|lamp| lamp.source).collect::<Vec<_>>(), [2]);
        assert!(found.notes.is_empty(), "{:?}", found.notes);
        let nothing = lamps(Vec::new(), &LampOptions::default());
        assert!(nothing.lamps.is_empty() && nothing.sky.radiance(Vec3::X).is_black());
    }

    #[test]
    fn too_many_lamps_become_fewer() {
        // Directions give way first, but not below four; then points; the sum fits.
        let lights = || vec![constant(1.0, true), rectangle(false), rectangle(false), point(5.0, 1.0)];
        let options = |directions, points, most| LampOptions {
            environment_directions: directions,
            area_samples: points,
            harmonics: false,
            most,
        };
        for (asked, expected) in [
            (options(16, 4, 32), [16, 8, 1]),
            (options(64, 4, 32), [23, 8, 1]),
            (options(64, 16, 32), [5, 26, 1]),
            (options(64, 16, 8), [5, 2, 1]),
            (options(u32::MAX, u32::MAX, 32), [5, 26, 1]),
        ] {
            let found = lamps(lights(), &asked);
            let of =
                |from: usize, to: usize| found.lamps.iter().filter(|lamp| (from..=to).contains(&lamp.source)).count();
            assert_eq!([of(0, 0), of(1, 2), of(3, 3)], expected, "{asked:?}");
            assert!(found.lamps.len() <= asked.most);
            let is_less = asked.environment_directions > expected[0] as u32;
            assert_eq!(found.notes.iter().any(|note| note.starts_with("each environment has")), is_less);
            // The sky is as bright, however few directions it has.
            let total: f32 = found.lamps.iter().filter(|lamp| lamp.source == 0).map(|lamp| lamp.color[0]).sum();
            near(total, 4.0 * PI, 1e-4);
        }
    }

    #[test]
    fn the_weakest_lamps_become_one_that_brings_the_centre_as_much() {
        let lights: Vec<Light> = (1..=40).map(|i| point(i as f32, 3.0)).collect();
        let all = lamps(lights.clone(), &LampOptions { most: 40, ..LampOptions::default() });
        assert!(all.notes.is_empty());
        for most in [1, 2, 32] {
            let few = lamps(lights.clone(), &LampOptions { most, ..LampOptions::default() });
            assert_eq!(few.lamps.len(), most);
            // The nearest are kept as they are.
            assert_eq!(few.lamps[..most - 1], all.lamps[..most - 1]);
            let [expected, found] = [&all, &few].map(|lamps| irradiance(lamps, Vec3::ZERO, Vec3::X)[0]);
            near(found, expected, 1e-5);
            assert!(few.notes[0].contains(&format!("the weakest {}", 41 - most)), "{:?}", few.notes);
        }
        // Several at the centre itself: no infinity, no direction.
        let (least, greatest) = lit_by(Vec::new()).bounds().expect("a sphere");
        let there = Light::Point { position: 0.5 * (least + greatest), intensity: Rgb::white() };
        let center = lamps(vec![there; 4], &LampOptions { most: 2, ..LampOptions::default() });
        assert_eq!(center.lamps.len(), 1);
        assert!(center.lamps[0].color.is_finite());
    }

    #[test]
    fn notes_say_what_became_of_each_light() {
        let lights = vec![
            constant(1.0, true),
            picture(true),
            rectangle(false),
            Light::Sphere { center: Vec3::X * 9.0, radius: 1.0, radiance: Rgb::splat(1.0), visible: false },
            Light::Distant { direction: Vec3::NEG_Z, irradiance: Rgb::splat(1.0), half_angle: 0.5_f32.to_radians() },
            Light::Distant { direction: Vec3::NEG_Z, irradiance: Rgb::splat(1.0), half_angle: 0.0 },
            point(3.0, 1.0),
        ];
        let options = LampOptions { most: 64, area_samples: 4, ..LampOptions::default() };
        let found = lamps(lights.clone(), &options);
        let expected = [
            "light 0: the constant environment is 16 parallel lights, spread evenly, with sharp shadows",
            "light 1: the environment image is 16 parallel lights where it is brightest, with sharp shadows",
            "light 2: the rectangle is 4 points, with sharp shadows",
            "light 3: the sphere is a point at its centre, with sharp shadows",
            "light 4: the disk of 1.00 degrees is one direction, with sharp shadows",
        ];
        assert_eq!(found.notes, expected);
        let found = lamps(lights[..3].to_vec(), &LampOptions { harmonics: true, ..LampOptions::default() });
        assert_eq!(found.notes[0], "light 0: the constant environment is ambient light, which nothing shadows");
        let note = &found.notes[1];
        assert!(note.starts_with("light 1: of the environment image ") && note.contains(" % is ambient"), "{note}");
        assert_eq!(found.notes[2], "light 2: the rectangle is one point at its centre, with sharp shadows");
        let tight = lamps(lights[1..2].to_vec(), &LampOptions { most: 5, ..LampOptions::default() });
        let cut = "each environment has 5 directions instead of 16, so that there are no more than 5 lamps";
        assert_eq!(tight.notes[0], cut);
    }
}
