//! Lights as the integrator sees them: sampled towards, met by rays, and chosen among.

use std::f32::consts::PI;

use math::{Frame, Rgb, Vec3, warp};
use scene::{Integrator, Light, LightSelection};

use crate::environment::ImageEnvironment;

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    pub(crate) dir: Vec3,
    pub(crate) distance: f32,
    /// Radiance that arrives; for a light without extent, irradiance.
    pub(crate) radiance: Rgb,
    /// Per steradian, the choice of light included; for a light without extent, the choice alone.
    pub(crate) pdf: f32,
    /// Without extent: no scattered ray can meet it.
    pub(crate) delta: bool,
}

/// What a ray finds of a light on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    /// Index of the light.
    pub(crate) light: usize,
    pub(crate) radiance: Rgb,
    pub(crate) visible: bool,
}

#[derive(Debug)]
enum Emitter {
    Constant {
        radiance: Rgb,
        visible: bool,
    },
    Image {
        environment: Box<ImageEnvironment>,
        visible: bool,
    },
    Rectangle {
        center: Vec3,
        edge_u: Vec3,
        edge_v: Vec3,
        normal: Vec3,
        area: f32,
        radiance: Rgb,
        two_sided: bool,
        visible: bool,
    },
    Sphere {
        center: Vec3,
        radius: f32,
        radiance: Rgb,
        visible: bool,
    },
    Point {
        position: Vec3,
        intensity: Rgb,
    },
    /// A point that shines in a cone about `direction`, in which its light travels.
    Spot {
        position: Vec3,
        direction: Vec3,
        intensity: Rgb,
        cos_inner: f32,
        cos_outer: f32,
    },
    /// Towards the light; one minus the cosine of the half angle; radiance within the cone.
    Disk {
        towards: Vec3,
        one_minus_cos: f32,
        radiance: Rgb,
        irradiance: Rgb,
    },
    /// A single direction.
    Beam {
        towards: Vec3,
        irradiance: Rgb,
    },
}

#[derive(Debug)]
pub(crate) struct Lights {
    emitters: Vec<Emitter>,
    /// Whether each light takes light samples.
    sampled: Vec<bool>,
    /// Fixed weights for power and uniform selection.
    fixed: Vec<f32>,
    selection: LightSelection,
    /// Whether any light takes light samples.
    any_sampled: bool,
}

/// Share of the choices that is spread evenly over the lights, relative to the rest.
const FLOOR: f32 = 0.1;

impl Lights {
    pub(crate) fn new(
        lights: &[Light],
        integrator: Integrator,
        selection: LightSelection,
        bounds: (Vec3, Vec3),
    ) -> Self {
        let emitters: Vec<Emitter> = lights.iter().map(Emitter::new).collect();
        let sampled: Vec<bool> = emitters
            .iter()
            .map(|e| match integrator {
                Integrator::BcsdfOnly => false,
                Integrator::LightOnly => true,
                // Scattering samples a constant environment almost perfectly by itself.
                Integrator::Path | Integrator::Direct => !matches!(e, Emitter::Constant { .. }),
            })
            .collect();
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        let fixed = emitters
            .iter()
            .zip(&sampled)
            .map(|(e, &sampled)| match selection {
                _ if !sampled => 0.0,
                LightSelection::Power => e.power(radius),
                LightSelection::Uniform | LightSelection::Contribution => 1.0,
            })
            .collect();
        let any_sampled = sampled.iter().any(|&s| s);
        Self { emitters, sampled, fixed, selection, any_sampled }
    }

    /// Unnormalised chance of a light at a place.
    #[inline]
    fn weight(&self, light: usize, p: Vec3) -> f32 {
        if !self.sampled[light] {
            return 0.0;
        }
        match self.selection {
            LightSelection::Contribution => self.emitters[light].irradiance_estimate(p),
            LightSelection::Power | LightSelection::Uniform => self.fixed[light],
        }
    }

    /// Sum of the chances before they are normalised, and what every light that shines here gets on top:
    /// the estimate knows no shadows, so the strongest light must not take all samples.
    #[inline]
    fn total(&self, p: Vec3) -> (f32, f32) {
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..self.emitters.len() {
            let w = self.weight(i, p);
            if w > 0.0 {
                sum += w;
                count += 1.0;
            }
        }
        match self.selection {
            LightSelection::Contribution if count > 0.0 => (sum * (1.0 + FLOOR), sum * FLOOR / count),
            _ => (sum, 0.0),
        }
    }

    /// Chance of choosing `light` at `p`.
    fn chance(&self, light: usize, p: Vec3) -> f32 {
        let own = self.weight(light, p);
        if own <= 0.0 {
            return 0.0;
        }
        let (total, floor) = self.total(p);
        (own + floor) / total
    }

    /// Draws a light and a direction towards it from `p`.
    pub(crate) fn sample(&self, p: Vec3, choice: f32, xi: [f32; 2]) -> Option<LightSample> {
        if !self.any_sampled {
            return None;
        }
        let (total, floor) = self.total(p);
        if !(total > 0.0) {
            return None;
        }
        let mut left = choice * total;
        let mut chosen = None;
        for i in 0..self.emitters.len() {
            let w = self.weight(i, p);
            let w = if w > 0.0 { w + floor } else { 0.0 };
            if w > 0.0 {
                chosen = Some((i, w));
                if left < w {
                    break;
                }
            }
            left -= w;
        }
        let (light, w) = chosen?;
        let mut sample = self.emitters[light].sample(p, xi)?;
        sample.pdf *= w / total;
        (sample.pdf > 0.0 && sample.pdf.is_finite()).then_some(sample)
    }

    /// Density with which [`sample`](Self::sample) draws `dir` at `p` by way of `light`, per steradian.
    pub(crate) fn pdf(&self, light: usize, p: Vec3, dir: Vec3) -> f32 {
        let chance = self.chance(light, p);
        if chance <= 0.0 { 0.0 } else { chance * self.emitters[light].pdf(p, dir) }
    }

    /// Calls `found` with every light that a ray meets before `t_max` (infinite when it leaves the scene).
    #[inline]
    pub(crate) fn met(&self, origin: Vec3, dir: Vec3, t_max: f32, mut found: impl FnMut(Met)) {
        for (light, emitter) in self.emitters.iter().enumerate() {
            if let Some((radiance, visible)) = emitter.met(origin, dir, t_max) {
                found(Met { light, radiance, visible });
            }
        }
    }
}

impl Emitter {
    fn new(light: &Light) -> Self {
        match light {
            Light::Environment { image: None, radiance, visible, .. } => {
                Self::Constant { radiance: *radiance, visible: *visible }
            }
            Light::Environment { image: Some(image), radiance, rotation, visible } => Self::Image {
                environment: Box::new(ImageEnvironment::new(image.clone(), *radiance, *rotation)),
                visible: *visible,
            },
            &Light::Rectangle { center, edge_u, edge_v, normal, radiance, two_sided, visible } => Self::Rectangle {
                center,
                edge_u,
                edge_v,
                normal,
                area: edge_u.cross(edge_v).length(),
                radiance,
                two_sided,
                visible,
            },
            &Light::Sphere { center, radius, radiance, visible } => Self::Sphere { center, radius, radiance, visible },
            &Light::Point { position, intensity } => Self::Point { position, intensity },
            &Light::Spot { position, direction, intensity, cos_inner, cos_outer } => {
                Self::Spot { position, direction, intensity, cos_inner, cos_outer }
            }
            &Light::Distant { direction, irradiance, half_angle } => {
                if half_angle <= 0.0 {
                    return Self::Beam { towards: -direction, irradiance };
                }
                // Irradiance of a facing surface is ∫ L cos θ dω = π sin² of the half angle.
                let radiance = irradiance / (PI * half_angle.sin().powi(2));
                // 1 - cos without cancellation.
                let one_minus_cos = 2.0 * (0.5 * half_angle).sin().powi(2);
                Self::Disk { towards: -direction, one_minus_cos, radiance, irradiance }
            }
        }
    }

    /// Emitted power up to a common factor, for a scene of that radius.
    fn power(&self, radius: f32) -> f32 {
        let scene = PI * radius * radius;
        match self {
            Self::Constant { radiance, .. } => radiance.luminance() * 4.0 * PI * scene,
            Self::Image { environment, .. } => environment.mean_luminance() * 4.0 * PI * scene,
            Self::Rectangle { radiance, area, two_sided, .. } => {
                radiance.luminance() * area * PI * if *two_sided { 2.0 } else { 1.0 }
            }
            Self::Sphere { radiance, radius, .. } => radiance.luminance() * 4.0 * PI * PI * radius * radius,
            Self::Point { intensity, .. } => intensity.luminance() * 4.0 * PI,
            // 2π ∫ falloff d cos: the fade counts half, as it is symmetric about its middle.
            Self::Spot { intensity, cos_inner, cos_outer, .. } => {
                intensity.luminance() * PI * ((1.0 - *cos_inner) + (1.0 - *cos_outer))
            }
            Self::Disk { irradiance, .. } | Self::Beam { irradiance, .. } => irradiance.luminance() * scene,
        }
    }

    /// Light that crosses a small sphere at `p`, shadows ignored: luminance of `∫ L dω`.
    fn irradiance_estimate(&self, p: Vec3) -> f32 {
        match self {
            Self::Constant { radiance, .. } => radiance.luminance() * 4.0 * PI,
            Self::Image { environment, .. } => environment.mean_luminance() * 4.0 * PI,
            Self::Rectangle { center, normal, area, radiance, two_sided, edge_u, edge_v, .. } => {
                // Averaged over the corners and the centre, so that a large light near by is not judged by
                // its centre alone.
                let corners = [(0.0, 0.0), (-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];
                let mut sum = 0.0;
                for (a, b) in corners {
                    let d = p - (*center + *edge_u * a + *edge_v * b);
                    let d2 = d.length_squared().max(1e-3 * area);
                    let cos = d.dot(*normal) / d2.sqrt();
                    let cos = if *two_sided { cos.abs() } else { cos.max(0.0) };
                    sum += cos * area / d2;
                }
                radiance.luminance() * (0.2 * sum).min(2.0 * PI)
            }
            Self::Sphere { center, radius, radiance, .. } => {
                radiance.luminance() * 2.0 * PI * sphere_cap(p.distance_squared(*center), radius * radius)
            }
            Self::Point { position, intensity } => intensity.luminance() / p.distance_squared(*position).max(1e-12),
            Self::Spot { position, direction, intensity, cos_inner, cos_outer } => {
                let Some((dir, _, d2)) = towards(*position, p) else { return 0.0 };
                let share = Light::spot_falloff(*cos_inner, *cos_outer, -dir.dot(*direction));
                intensity.luminance() * share / d2.max(1e-12)
            }
            Self::Disk { irradiance, .. } | Self::Beam { irradiance, .. } => irradiance.luminance(),
        }
    }

    fn sample(&self, p: Vec3, xi: [f32; 2]) -> Option<LightSample> {
        let far = f32::INFINITY;
        let area = |dir, distance, radiance, pdf| Some(LightSample { dir, distance, radiance, pdf, delta: false });
        match self {
            Self::Constant { radiance, .. } => area(warp::uniform_sphere(xi), far, *radiance, 0.25 / PI),
            Self::Image { environment, .. } => {
                let (dir, pdf) = environment.sample(xi)?;
                area(dir, far, environment.radiance(dir), pdf)
            }
            Self::Rectangle { center, edge_u, edge_v, normal, area: size, radiance, two_sided, .. } => {
                let d = *center + *edge_u * (xi[0] - 0.5) + *edge_v * (xi[1] - 0.5) - p;
                let d2 = d.length_squared();
                let distance = d2.sqrt();
                let dir = d / distance;
                let cos = -dir.dot(*normal);
                let cos = if *two_sided { cos.abs() } else { cos };
                if !(cos > 1e-6) || !(distance > 0.0) {
                    return None;
                }
                area(dir, distance, *radiance, d2 / (cos * size))
            }
            Self::Sphere { center, radius, radiance, .. } => {
                let d = *center - p;
                let d2 = d.length_squared();
                let r2 = radius * radius;
                if d2 <= r2 * 1.000_01 {
                    // Inside: the sphere is all around.
                    let dir = warp::uniform_sphere(xi);
                    let (distance, _) = meet_sphere(p, dir, *center, *radius)?;
                    return area(dir, distance, *radiance, 0.25 / PI);
                }
                let one_minus_cos = sphere_cap(d2, r2);
                let dir = cone(d / d2.sqrt(), one_minus_cos, xi);
                // Grazing rays may miss by rounding; their distance is that of the tangent.
                let distance = meet_sphere(p, dir, *center, *radius).map_or((d2 - r2).sqrt(), |(t, _)| t);
                area(dir, distance, *radiance, cap_pdf(one_minus_cos))
            }
            Self::Point { position, intensity } => {
                let (dir, distance, d2) = towards(*position, p)?;
                Some(LightSample { dir, distance, radiance: *intensity / d2, pdf: 1.0, delta: true })
            }
            Self::Spot { position, direction, intensity, cos_inner, cos_outer } => {
                let (dir, distance, d2) = towards(*position, p)?;
                let share = Light::spot_falloff(*cos_inner, *cos_outer, -dir.dot(*direction));
                let radiance = *intensity * (share / d2);
                (share > 0.0).then_some(LightSample { dir, distance, radiance, pdf: 1.0, delta: true })
            }
            Self::Disk { towards, one_minus_cos, radiance, .. } => {
                area(cone(*towards, *one_minus_cos, xi), far, *radiance, cap_pdf(*one_minus_cos))
            }
            Self::Beam { towards, irradiance } => {
                Some(LightSample { dir: *towards, distance: far, radiance: *irradiance, pdf: 1.0, delta: true })
            }
        }
    }

    fn pdf(&self, p: Vec3, dir: Vec3) -> f32 {
        match self {
            Self::Constant { .. } => 0.25 / PI,
            Self::Image { environment, .. } => environment.pdf(dir),
            Self::Rectangle { center, normal, area, two_sided, .. } => {
                let cos = -dir.dot(*normal);
                let t = (p - *center).dot(*normal) / cos;
                let cos = if *two_sided { cos.abs() } else { cos };
                if cos > 1e-6 && t > 0.0 { t * t / (cos * area) } else { 0.0 }
            }
            Self::Sphere { center, radius, .. } => {
                let (d2, r2) = (p.distance_squared(*center), radius * radius);
                if d2 <= r2 * 1.000_01 { 0.25 / PI } else { cap_pdf(sphere_cap(d2, r2)) }
            }
            Self::Disk { one_minus_cos, .. } => cap_pdf(*one_minus_cos),
            Self::Point { .. } | Self::Spot { .. } | Self::Beam { .. } => 0.0,
        }
    }

    /// Radiance that a ray finds here, if it does before `t_max`.
    #[inline]
    fn met(&self, origin: Vec3, dir: Vec3, t_max: f32) -> Option<(Rgb, bool)> {
        let escaped = t_max == f32::INFINITY;
        match self {
            Self::Constant { radiance, visible } => escaped.then_some((*radiance, *visible)),
            Self::Image { environment, visible } => escaped.then(|| (environment.radiance(dir), *visible)),
            Self::Rectangle { center, edge_u, edge_v, normal, radiance, two_sided, visible, .. } => {
                let cos = -dir.dot(*normal);
                if cos.abs() < 1e-6 || (cos < 0.0 && !two_sided) {
                    return None;
                }
                let t = (origin - *center).dot(*normal) / cos;
                if !(t > 0.0 && t < t_max) {
                    return None;
                }
                let x = origin + dir * t - *center;
                let inside = |edge: Vec3| x.dot(edge).abs() <= 0.5 * edge.length_squared();
                (inside(*edge_u) && inside(*edge_v)).then_some((*radiance, *visible))
            }
            Self::Sphere { center, radius, radiance, visible } => {
                let (t, _) = meet_sphere(origin, dir, *center, *radius)?;
                (t < t_max).then_some((*radiance, *visible))
            }
            // A disk in the sky is never seen by the camera: it stands for a light, not for a thing.
            Self::Disk { towards, one_minus_cos, radiance, .. } => {
                let off = 0.5 * (dir - *towards).length_squared();
                (escaped && off <= *one_minus_cos).then_some((*radiance, false))
            }
            Self::Point { .. } | Self::Spot { .. } | Self::Beam { .. } => None,
        }
    }
}

/// Direction, distance and squared distance from `p` to a point; `None` where they are the same.
#[inline]
fn towards(position: Vec3, p: Vec3) -> Option<(Vec3, f32, f32)> {
    let d = position - p;
    let d2 = d.length_squared();
    if !(d2 > 0.0) {
        return None;
    }
    let distance = d2.sqrt();
    Some((d / distance, distance, d2))
}

/// First crossing of a sphere in front of the origin; whether from inside.
fn meet_sphere(origin: Vec3, dir: Vec3, center: Vec3, radius: f32) -> Option<(f32, bool)> {
    let d = center - origin;
    let along = d.dot(dir);
    let off2 = (d - dir * along).length_squared();
    let half2 = radius * radius - off2;
    if half2 < 0.0 {
        return None;
    }
    let half = half2.sqrt();
    if along - half > 0.0 {
        Some((along - half, false))
    } else if along + half > 0.0 {
        Some((along + half, true))
    } else {
        None
    }
}

/// `1 - cos` of the half angle under which a sphere is seen.
fn sphere_cap(d2: f32, r2: f32) -> f32 {
    let sin2 = (r2 / d2).min(1.0);
    sin2 / (1.0 + (1.0 - sin2).sqrt())
}

fn cap_pdf(one_minus_cos: f32) -> f32 {
    1.0 / (2.0 * PI * one_minus_cos)
}

/// A direction uniform over a cone about `axis`.
fn cone(axis: Vec3, one_minus_cos: f32, xi: [f32; 2]) -> Vec3 {
    let away = xi[0] * one_minus_cos;
    let sin = (away * (2.0 - away)).max(0.0).sqrt();
    let (s, c) = (2.0 * PI * xi[1]).sin_cos();
    Frame::around(axis).to_world(Vec3::new(1.0 - away, sin * c, sin * s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::{DVec3, hash};

    fn all() -> Vec<Light> {
        vec![
            Light::Environment { image: None, radiance: Rgb::splat(0.3), rotation: 0.0, visible: true },
            Light::Rectangle {
                center: Vec3::new(0.0, 3.0, 1.0),
                edge_u: Vec3::X * 2.0,
                edge_v: Vec3::Z * 1.5,
                normal: Vec3::X.cross(Vec3::Z),
                radiance: Rgb::splat(5.0),
                two_sided: false,
                visible: true,
            },
            Light::Sphere { center: Vec3::new(-2.0, 0.5, 0.0), radius: 0.4, radiance: Rgb::splat(9.0), visible: true },
            Light::Distant { direction: Vec3::NEG_Z, irradiance: Rgb::splat(2.0), half_angle: 0.05 },
        ]
    }

    #[test]
    fn what_is_sampled_is_what_is_met_with_the_same_density() {
        let lights = all();
        for selection in [LightSelection::Contribution, LightSelection::Power, LightSelection::Uniform] {
            let lights = Lights::new(&lights, Integrator::LightOnly, selection, (Vec3::NEG_ONE, Vec3::ONE));
            let p = Vec3::new(0.2, -0.1, 0.3);
            let mut seen = 0;
            for i in 0..20_000 {
                let u = |s| hash::unit(i, s);
                let Some(sample) = lights.sample(p, u(1), [u(2), u(3)]) else { continue };
                // The light chosen must be met by the ray, with that radiance, and give this density.
                let mut best = f32::INFINITY;
                lights.met(p, sample.dir, f32::INFINITY, |met| {
                    if met.radiance == sample.radiance {
                        let pdf = lights.pdf(met.light, p, sample.dir);
                        best = best.min((pdf / sample.pdf - 1.0).abs());
                    }
                });
                seen += usize::from(best < 1e-2);
            }
            // Samples on the very rim may miss by rounding.
            assert!(seen > 19_900, "{selection:?}: {seen}");
        }
    }

    #[test]
    fn sampling_integrates_each_light_to_its_closed_form() {
        let p = Vec3::new(0.2, -0.1, 0.3);
        // ∫ L dω: sphere 2π(1 - cos) L, disk E/(π sin²) 2π(1 - cos).
        let sin2 = 0.16 / p.distance_squared(Vec3::new(-2.0, 0.5, 0.0));
        let sphere = 9.0 * 2.0 * PI * (1.0 - (1.0 - sin2).sqrt());
        let disk = 2.0 / (PI * 0.05_f32.sin().powi(2)) * 2.0 * PI * (1.0 - 0.05_f32.cos());
        for (light, want) in [(2, sphere), (3, disk), (0, 0.3 * 4.0 * PI)] {
            let lights = Lights::new(&all()[light..=light], Integrator::LightOnly, LightSelection::Uniform, (p, p));
            let n = 4000;
            let sum: f32 = (0..n)
                .map(|i| {
                    let s = lights.sample(p, 0.5, [hash::unit(i, 1), hash::unit(i, 2)]).unwrap();
                    s.radiance[0] / s.pdf
                })
                .sum();
            assert!((sum / n as f32 / want - 1.0).abs() < 1e-3, "light {light}: {} and {want}", sum / n as f32);
        }
    }

    /// A spot of a cone that is `outer` wide from its axis to its edge and fades from `inner` on, degrees.
    fn spot(intensity: f32, inner: f64, outer: f64) -> Light {
        Light::Spot {
            position: Vec3::new(0.5, 2.0, -0.3),
            direction: Vec3::new(2.0, -3.0, 6.0) / 7.0,
            intensity: Rgb::splat(intensity),
            cos_inner: inner.to_radians().cos() as f32,
            cos_outer: outer.to_radians().cos() as f32,
        }
    }

    /// The point at `distance` from the spot that lies `angle` degrees from its axis and `turn` radians around it.
    fn from_spot(distance: f64, angle: f64, turn: f64) -> Vec3 {
        // Unit vectors at right angles, the axis of the spot first.
        let axes = [(2.0, -3.0, 6.0), (3.0, 6.0, 2.0), (-6.0, 2.0, 3.0)].map(|(x, y, z)| DVec3::new(x, y, z) / 7.0);
        let (sin, cos) = angle.to_radians().sin_cos();
        let dir = axes[0] * cos + (axes[1] * turn.cos() + axes[2] * turn.sin()) * sin;
        (DVec3::new(0.5, 2.0, -0.3) + dir * distance).as_vec3()
    }

    /// Share of its intensity that a spot sends `angle` degrees from its axis, in the angles of its fade.
    fn share(inner: f64, outer: f64, angle: f64) -> f64 {
        let cos = |degrees: f64| degrees.to_radians().cos();
        let t = (cos(angle) - cos(outer)) / (cos(inner) - cos(outer));
        if t <= 0.0 {
            0.0
        } else if t >= 1.0 {
            1.0
        } else {
            // The cubic by its roots about the middle, where it is one half: ½ + ¾s - ¼s³ with s from -1 to 1.
            let s = 2.0 * t - 1.0;
            0.5 + 0.75 * s - 0.25 * s * s * s
        }
    }

    fn one(light: Light, selection: LightSelection) -> Lights {
        Lights::new(&[light], Integrator::LightOnly, selection, (Vec3::NEG_ONE, Vec3::ONE))
    }

    #[test]
    fn a_spot_brings_its_intensity_over_the_squared_distance_within_its_cone_and_nothing_outside() {
        let selections = [LightSelection::Contribution, LightSelection::Power, LightSelection::Uniform];
        for (inner, outer) in [(10.0, 30.0), (0.0, 90.0), (29.9, 30.0), (2.0, 3.0)] {
            for selection in selections {
                let lights = one(spot(5.0, inner, outer), selection);
                for i in 0..200 {
                    let angle = 1.2 * outer * (f64::from(i) + 0.5) / 200.0;
                    // Where the fade is steep the angle is known to no better than single precision.
                    if [inner, outer].iter().any(|edge| (angle - edge).abs() < 0.02) {
                        continue;
                    }
                    let (distance, turn) = (f64::from(1 + i % 7), 2.4 * f64::from(i));
                    let p = from_spot(distance, angle, turn);
                    let sample = lights.sample(p, hash::unit(i, 1), [hash::unit(i, 2), hash::unit(i, 3)]);
                    let want = 5.0 * share(inner, outer, angle) / (distance * distance);
                    let what = format!("{inner} {outer} {selection:?}: {angle} degrees, {distance}");
                    let Some(sample) = sample else {
                        assert_eq!(want, 0.0, "{what}");
                        continue;
                    };
                    assert!(want > 0.0 && sample.delta && (sample.pdf - 1.0).abs() < 1e-6, "{what}: {sample:?}");
                    // The place in single precision gives a cosine to 5e-7; the fade is 1.5 times as steep as a
                    // straight one at most.
                    let cos = |degrees: f64| degrees.to_radians().cos();
                    let slack = 5.0 / (distance * distance) * (2e-6 + 1.5 * 5e-7 / (cos(inner) - cos(outer)));
                    assert!((f64::from(sample.radiance[0]) - want).abs() < slack, "{what}: {sample:?} and {want}");
                    // The direction leads to the light, and a ray that goes there finds nothing to see.
                    assert!((p + sample.dir * sample.distance).distance(Vec3::new(0.5, 2.0, -0.3)) < 1e-5, "{what}");
                    lights.met(p, sample.dir, f32::INFINITY, |met| panic!("{what}: {met:?}"));
                    assert_eq!(lights.pdf(0, p, sample.dir), 0.0);
                }
            }
        }
    }

    #[test]
    fn all_light_of_a_spot_arrives() {
        // The irradiance of a sphere around it, summed up in even steps of the cosine and turned as they go.
        for (inner, outer) in [(10.0, 30.0), (0.0, 90.0), (0.0, 5.0), (29.99, 30.0)] {
            let light = spot(3.0, inner, outer);
            let power = f64::from(Emitter::new(&light).power(1.0));
            let lights = one(light, LightSelection::Uniform);
            let (radius, n) = (2.0, 20_000_u32);
            let least = outer.to_radians().cos();
            let mut sum = 0.0;
            for i in 0..n {
                // A little beyond the cone, so that light outside would be found.
                let cos = 1.0 - 1.1 * (1.0 - least) * (f64::from(i) + 0.5) / f64::from(n);
                let p = from_spot(radius, cos.acos().to_degrees(), 2.4 * f64::from(i));
                let sample = lights.sample(p, 0.5, [0.5; 2]);
                sum += sample.map_or(0.0, |s| f64::from(s.radiance[0])) * radius * radius;
            }
            let sum = sum * 2.0 * std::f64::consts::PI * 1.1 * (1.0 - least) / f64::from(n);
            // A dozen steps lie in the sharpest fade; the rest is single precision of the narrowest cone's cosine.
            assert!((sum / power - 1.0).abs() < 2e-4, "{inner} {outer}: {sum} and {power}");
        }
    }

    #[test]
    fn a_spot_is_chosen_only_where_it_shines_and_no_light_is_lost_by_the_choice() {
        let near = Vec3::new(-1.0, 0.4, 0.7);
        let point = |position, intensity| Light::Point { position, intensity: Rgb::splat(intensity) };
        let scene = [point(near, 0.5), spot(5.0, 10.0, 30.0), point(Vec3::ONE, 0.0)];
        for angle in [4.0, 25.0, 29.0, 45.0, 170.0] {
            let p = from_spot(2.0, angle, 1.0);
            let want = 0.5 / f64::from(p.distance_squared(near)) + 5.0 * share(10.0, 30.0, angle) / 4.0;
            for selection in [LightSelection::Contribution, LightSelection::Power, LightSelection::Uniform] {
                let lights = Lights::new(&scene, Integrator::Path, selection, (Vec3::NEG_ONE, Vec3::ONE));
                let n = 10_000;
                let (mut sum, mut lost) = (0.0, 0);
                for i in 0..n {
                    match lights.sample(p, (i as f32 + 0.5) / n as f32, [0.5; 2]) {
                        Some(s) => sum += f64::from(s.radiance[0] / s.pdf) / f64::from(n),
                        None => lost += 1,
                    }
                }
                // Evenly spread choices: at each of two boundaries between lights one of them may be on the wrong
                // side, and no light that shines here is chosen with less than one chance in 10.
                assert!((sum / want - 1.0).abs() < 20.0 / f64::from(n), "{angle} {selection:?}: {sum} and {want}");
                if selection == LightSelection::Contribution {
                    assert_eq!(lost, 0, "{angle}: a choice in vain");
                }
            }
        }
    }

    #[test]
    fn a_spot_in_the_very_place_that_it_lights_does_no_harm() {
        let place = Vec3::new(0.5, 2.0, -0.3);
        for selection in [LightSelection::Contribution, LightSelection::Power, LightSelection::Uniform] {
            assert!(one(spot(5.0, 10.0, 30.0), selection).sample(place, 0.5, [0.5; 2]).is_none(), "{selection:?}");
        }
    }
}
