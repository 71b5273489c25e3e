//! The diffuse cylinder: closed form, sampler, and pictures beside a surface that is diffuse.

use std::f32::consts::TAU;
use std::f64::consts::{FRAC_PI_2, PI};

use fiber::quadrature::integrate;
use fiber::{Dir, Hit, Lambertian, LambertianSetup, Model, Scatter, wrap_angle};
use film::{Film, View};
use groom::Mesh;
use math::{Rgb, Vec3};

use super::stage::enlarged;
use crate::chart::{Chart, Curve};
use crate::raster::Raster;
use crate::render::{self, Memory};
use crate::sphere::numbers;
use crate::{Context, Error, Measured, Report, Table, number};

/// Azimuths of the light in pictures, degrees around the fiber from the camera.
const AZIMUTHS_DEG: [f64; 7] = [0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 170.0];
/// Inclination of the light there, degrees.
const LIGHT_DEG: f64 = 25.0;
/// What it brings.
const IRRADIANCE: f64 = 3.0;
/// Half the length of the cylinder; its ends are far outside the picture.
const REACH: f32 = 20.0;
/// Reflectance in the picture of fur.
const ALBEDO: f64 = 0.7;

fn seen(theta_k: f64) -> LambertianSetup<f64> {
    Lambertian::<f64> { albedo: Rgb::white() }.prepare(&Hit::new(Dir::new(theta_k, 0.0), 0.0))
}

/// `fcos` of a white cylinder by brute force: the light that Lambert's law sends to the viewer from every line of the
/// surface that is seen and lit, averaged over the width that is seen.
///
/// A line at azimuth `γ` from the viewer takes `cos γ dγ / 2` of the width, whatever the viewer's inclination.
fn cylinder(theta_s: f64, phi: f64) -> f64 {
    const LINES: u32 = 20_000;
    let step = PI / f64::from(LINES);
    let lines = (0..LINES).map(|i| {
        let gamma = -FRAC_PI_2 + step * (f64::from(i) + 0.5);
        let facing = theta_s.cos() * (phi - gamma).cos();
        0.5 * gamma.cos() * facing.max(0.0) / PI * step
    });
    lines.sum()
}

/// `[(π - x) cos x + sin x] / 4π` without a look at where it holds.
fn printed(x: f64) -> f64 {
    ((PI - x) * x.cos() + x.sin()) / (4.0 * PI)
}

/// `∫ fcos dω` of a white fiber.
fn energy(theta_k: f64) -> f64 {
    let at = seen(theta_k);
    integrate(-FRAC_PI_2, FRAC_PI_2, 48, |theta| {
        // Smooth on either half of the turn.
        let half = |from: f64, to: f64| integrate(from, to, 32, |phi| at.eval(Dir::new(theta, phi)).sum().luminance());
        (half(-PI, 0.0) + half(0.0, PI)) * theta.cos()
    })
}

/// How samples fall into bins of the azimuth: χ² by degree of freedom, and the largest departure of a weight from 1.
fn sampled(count: u32, seed: u32) -> (f64, f64) {
    // Ten degrees wide; the last is wider, as hardly anything goes straight on.
    const BINS: usize = 17;
    let edge = |i: usize| if i == BINS { PI } else { (10.0 * i as f64).to_radians() };
    let at = seen(0.4);
    let mut found = [0.0_f64; BINS];
    let mut worst = 0.0_f64;
    for i in 0..count {
        let Some(sample) = at.sample(numbers(i, seed)) else {
            worst = 1.0;
            continue;
        };
        worst = worst.max(sample.weight.sum().0.map(|w| (w - 1.0).abs()).into_iter().fold(0.0, f64::max));
        let bin = (wrap_angle(sample.dir.phi).abs().to_degrees() / 10.0) as usize;
        found[bin.min(BINS - 1)] += 1.0;
    }
    let chi2: f64 = found
        .iter()
        .enumerate()
        .map(|(i, found)| {
            // ∫ cos² θ dθ = π/2, and both signs of the azimuth.
            let share = PI * integrate(edge(i), edge(i + 1), 16, printed);
            let expected = share * f64::from(count);
            (found - expected).powi(2) / expected
        })
        .sum();
    (chi2 / (BINS as f64 - 1.0), worst)
}

/// A cylinder of radius 1 about y as a mesh, smooth.
fn tube() -> Mesh {
    const SIDES: u32 = 512;
    let normals: Vec<Vec3> = (0..SIDES)
        .flat_map(|i| {
            let (sin, cos) = (TAU * i as f32 / SIDES as f32).sin_cos();
            [Vec3::new(sin, 0.0, cos); 2]
        })
        .collect();
    let positions = normals
        .iter()
        .enumerate()
        .map(|(i, normal)| *normal + Vec3::Y * if i % 2 == 0 { -REACH } else { REACH })
        .collect();
    let triangles = (0..SIDES)
        .flat_map(|i| {
            let (a, b) = (2 * i, 2 * ((i + 1) % SIDES));
            [[a, b, b + 1], [a, b + 1, a + 1]]
        })
        .collect();
    Mesh { positions, triangles, normals: Some(normals) }
}

fn assets() -> Result<Memory, Error> {
    let mut assets = Memory::default();
    let points = (-2..=2).map(|i| Vec3::Y * (0.5 * REACH * i as f32)).collect();
    assets.grooms.insert("fiber".into(), render::strands(&[points], 1.0)?);
    assets.meshes.insert("tube".into(), tube());
    Ok(assets)
}

/// The cylinder from afar under a light of a single direction.
fn film(context: &Context<'_>, assets: &Memory, azimuth_deg: f64, as_fiber: bool) -> Result<Film, Error> {
    let ((sin, cos), (sin_a, cos_a)) = (LIGHT_DEG.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    let thing = if as_fiber {
        "[[groom]]\nfile = \"fiber\"\nlook = \"main\"\n[look.main]\nmodel = \"lambertian\"\nalbedo = 1.0\n"
    } else {
        "[[mesh]]\nname = \"tube\"\nfile = \"tube\"\nalbedo = 1.0\n"
    };
    let text = format!(
        "[scene]\nname = \"cylinder\"\n[camera]\nposition = [0.0, 0.0, 149.0]\ntarget = [0.0, 0.0, 0.0]\n\
         fov_deg = 1.0\n[film]\nwidth = {0}\nheight = {0}\nfilter = \"box\"\n\
         [render]\nsamples = {1}\nintegrator = \"direct\"\nseed = {2}\n\
         [[light]]\ntype = \"distant\"\ndirection = [{3:?}, {4:?}, {5:?}]\nirradiance = {IRRADIANCE:?}\n{thing}",
        context.pixels(48),
        context.count(64),
        context.seed,
        -cos * sin_a,
        -sin,
        -cos * cos_a
    );
    let step = format!("light at {azimuth_deg}°, {}", if as_fiber { "fiber" } else { "surface" });
    render::film(context, &step, render::load(&text, assets)?)
}

/// Mean radiance over what the cylinder covers.
fn mean(film: &Film) -> f64 {
    let light: f64 = render::luminance(film).iter().sum();
    light / film.pixels().iter().map(|pixel| f64::from(pixel.alpha())).sum::<f64>()
}

/// A ball whose surface is diffuse, or one with fur of diffuse fibers.
fn ball(context: &Context<'_>, fur: bool) -> Result<Film, Error> {
    let side = context.pixels(160);
    let thing = if fur {
        format!(
            "[[mesh]]\nname = \"ball\"\nshape = {{ sphere = {{ radius = 4.9 }} }}\nalbedo = {ALBEDO:?}\n\
             [[groom]]\nname = \"fur\"\nlook = \"main\"\nwidth = {{ scale = 2.5 }}\nprocedural = {{ preset = \"fur\", \
             strands = {}, seed = 3, ellipsoid = {{ radii = [5.0, 5.0, 5.0] }} }}\n\
             [look.main]\nmodel = \"lambertian\"\nalbedo = {ALBEDO:?}\n",
            context.count(20_000).clamp(300, 60_000)
        )
    } else {
        format!("[[mesh]]\nname = \"ball\"\nshape = {{ sphere = {{ radius = 5.6 }} }}\nalbedo = {ALBEDO:?}\n")
    };
    let text = format!(
        "[scene]\nname = \"ball\"\n[camera]\nposition = [0.0, 4.0, 28.0]\ntarget = [0.0, 0.0, 0.0]\nfov_deg = 26.0\n\
         [film]\nwidth = {side}\nheight = {side}\n[render]\nsamples = {}\nmax_depth = 32\nseed = {}\n\
         [[light]]\ntype = \"rectangle\"\ncenter = [-16.0, 20.0, 20.0]\naim = [0.0, 0.0, 0.0]\nwidth = 8.0\n\
         height = 8.0\nradiance = 30.0\n\
         [[light]]\ntype = \"environment\"\nradiance = 0.1\nvisible = false\n{thing}",
        context.count(64),
        context.seed
    );
    let step = if fur { "ball of fur" } else { "ball" };
    render::film(context, step, render::load(&text, &Memory::default())?)
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    // Directions all around, not at round numbers.
    let mut worst_value = 0.0_f64;
    let at = seen(0.4);
    for theta_s in [0.0, 0.5, -1.1] {
        context.step("brute force", 0.0)?;
        for i in -36..=36 {
            let phi = f64::from(i) * 5.0_f64.to_radians() + 0.013;
            let value = at.eval(Dir::new(theta_s, phi)).sum().luminance();
            worst_value = worst_value.max((value - cylinder(theta_s, phi)).abs());
        }
    }
    let worst_energy = [0.0, 0.7, 1.4].map(|theta| (energy(theta) - 1.0).abs()).into_iter().fold(0.0, f64::max);
    let (chi2, worst_weight) = sampled(context.count(400_000), context.seed);
    // As printed: over a full turn, and at three quarters of it.
    let (at_three_quarters, turn) = (printed(1.5 * PI), [0.0, PI].map(|from| integrate(from, from + PI, 32, printed)));

    let assets = assets()?;
    let front = seen(0.0).eval(Dir::new(LIGHT_DEG.to_radians(), 0.0)).sum().luminance() * IRRADIANCE;
    let mut rows = Vec::new();
    let mut pictures: [Vec<Raster>; 2] = Default::default();
    for azimuth_deg in AZIMUTHS_DEG {
        let formula = cylinder(LIGHT_DEG.to_radians(), azimuth_deg.to_radians()) * IRRADIANCE;
        let mut means = [0.0; 2];
        for ((mean_of, as_fiber), pictures) in means.iter_mut().zip([true, false]).zip(&mut pictures) {
            let film = film(context, &assets, azimuth_deg, as_fiber)?;
            *mean_of = mean(&film);
            pictures.push(enlarged(&Raster::of(&film.image(), View::Srgb, -0.3), 2));
        }
        rows.push((azimuth_deg, means, formula));
    }
    let off = rows.iter().map(|(_, [fiber, surface], _)| (fiber - surface).abs() / front).fold(0.0, f64::max);
    let off_formula = rows.iter().map(|(_, [fiber, _], formula)| (fiber - formula).abs() / front).fold(0.0, f64::max);
    if !rows.iter().all(|(_, means, _)| means.iter().all(|mean| mean.is_finite())) {
        return Err(Error::Measure("the cylinder is not in the picture"));
    }
    let balls = [ball(context, false)?, ball(context, true)?];

    let measured = vec![
        Measured::new("closed form against brute force over the cylinder, largest difference", worst_value, "")
            .between(0.0, 1e-6)
            .decides(),
        Measured::new("energy returned to a white dome, largest departure from the albedo", worst_energy, "")
            .between(0.0, 1e-6)
            .decides(),
        Measured::new("sampler: largest departure of a weight from the albedo", worst_weight, "")
            .between(0.0, 1e-9)
            .decides(),
        Measured::new("sampler: azimuths against the closed form, χ² per degree of freedom", chi2, "")
            .between(0.1, 3.0)
            .decides(),
        Measured::new(
            "pictures: fiber against a diffuse surface, largest difference over what is seen with the light in front",
            100.0 * off,
            "%",
        )
        .between(0.0, 1.0)
        .decides(),
        Measured::new("pictures: fiber against the integral over the cylinder, likewise", 100.0 * off_formula, "%")
            .between(0.0, 1.0),
        Measured::new("as printed, for azimuths up to 2π: value at three quarters of a turn", at_three_quarters, "")
            .between(0.0, f64::INFINITY)
            .decides(),
        Measured::new("as printed: integral over the first half of the turn", turn[0], ""),
        Measured::new("as printed: integral over the second half", turn[1], ""),
    ];
    let mut report = Report::new(
        "The scattering of a diffuse cylinder has a short closed form on azimuths from 0 to 2π, and is sampled exactly \
         by an even offset and a cosine about the normal there, with the albedo as weight.",
        format!(
            "the form is exact to {} for azimuths up to half a turn and negative beyond, where it must be mirrored; \
             weights are the albedo; pictures agree with a diffuse surface within {} %",
            number(worst_value),
            number(100.0 * off)
        ),
        measured,
    );
    report.text = vec![
        "The closed form is held against a sum over 20,000 lines of a cylinder, each of which reflects by Lambert's \
         law what it receives, for 219 pairs of directions. Energy is the integral of the value over the sphere. The \
         azimuths of samples are counted in bins and compared with the integral of the closed form there."
            .into(),
        format!(
            "The paper says that its form holds from 0 to 2π. It holds from 0 to π: at three quarters of a turn it is \
             {}, less than nothing, and its integral over the whole turn is {}. With the distance from the known \
             direction, |φ| up to π, everything is right, the claim of exactness included. That is why the verdict is \
             not a full one.",
            number(at_three_quarters),
            number(if (turn[0] + turn[1]).abs() < 1e-12 { 0.0 } else { turn[0] + turn[1] })
        ),
        format!(
            "In pictures a cylinder fills most of the frame, once as a fiber, once as a mesh with a diffuse surface, \
             under a light {LIGHT_DEG} degrees off the normal plane that goes around it. The fiber shows its mean over \
             the width, since the model does not ask for the offset; the surface shows where the light falls. Seen \
             from where fibers are thinner than a pixel, they are the same."
        ),
        "As fur, diffuse fibers do not look like a diffuse ball of the same reflectance: light enters between them, \
         scatters more than once, and the side away from the light is less dark than shadows would have it."
            .into(),
    ];
    let mut table = Table::new(
        format!("Mean radiance of a white cylinder, irradiance {IRRADIANCE}, by azimuth of the light."),
        ["azimuth", "picture of a fiber", "picture of a surface", "integral over the cylinder"],
    );
    for (azimuth_deg, [fiber, surface], formula) in &rows {
        table.row([format!("{azimuth_deg}°"), number(*fiber), number(*surface), number(*formula)]);
    }
    report.tables.push(table);
    let all: Vec<Raster> = pictures.into_iter().flatten().collect();
    report.pictures.push(Raster::sheet(&all, AZIMUTHS_DEG.len(), 4).picture(
        "cylinders",
        "A white cylinder as a fiber (above) and as a diffuse surface (below), the light at azimuths of 0, 30, 60, 90, \
         120, 150, 170 degrees.",
    )?);
    let balls = balls.map(|film| Raster::of(&film.image(), View::Srgb, 0.0));
    report.pictures.push(
        Raster::sheet(&balls, 2, 4).picture(
            "balls",
            "A diffuse ball (left), and a ball with fur of diffuse fibers of the same reflectance.",
        )?,
    );
    let closed = (0..=180).map(|deg| f64::from(deg) * 2.0);
    let degrees = |x: f64| x.to_radians();
    report.pictures.push(
        Chart {
            title: "Diffuse fiber".into(),
            x: "azimuth of the light, degrees".into(),
            y: "S, per steradian".into(),
            curves: vec![
                Curve::line(
                    "mirrored at half a turn",
                    closed.clone().map(|deg| [deg, printed(wrap_angle(degrees(deg)).abs())]).collect(),
                ),
                Curve::line("as printed", closed.map(|deg| [deg, printed(degrees(deg))]).collect()),
                Curve::points(
                    "sum over the cylinder",
                    (0..=24).map(|i| 15.0 * f64::from(i)).map(|deg| [deg, cylinder(0.0, degrees(deg))]).collect(),
                ),
                Curve::points(
                    "picture of a diffuse surface",
                    rows.iter()
                        .map(|(deg, [_, surface], _)| [*deg, surface / (IRRADIANCE * degrees(LIGHT_DEG).cos())])
                        .collect(),
                ),
            ],
            ..Chart::default()
        }
        .picture("azimuth", "Scattering of a white diffuse cylinder against the azimuth between the directions.")?,
    );
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_form_is_right_on_half_a_turn_and_wrong_beyond() {
        for deg in [0.0, 40.0, 90.0, 133.0, 180.0_f64] {
            assert!((printed(deg.to_radians()) - cylinder(0.0, deg.to_radians())).abs() < 1e-7, "{deg}");
        }
        assert!((printed(1.5 * PI) + 1.0 / (4.0 * PI)).abs() < 1e-12);
        assert!(cylinder(0.0, 1.5 * PI) > 0.0);
    }

    #[test]
    fn samples_follow_the_closed_form() {
        // χ² of 16 degrees of freedom is above 48 once in 20,000; the stream is fixed.
        let (chi2, worst) = sampled(50_000, 3);
        assert!(chi2 < 3.0 && worst < 1e-12, "{chi2} {worst}");
    }

    #[test]
    fn the_tube_is_closed_and_faces_outwards() {
        let tube = tube();
        assert_eq!((tube.positions.len(), tube.triangles.len()), (1024, 1024));
        for [a, b, c] in tube.triangles {
            let [a, b, c] = [a, b, c].map(|i| tube.positions[i as usize]);
            let out = (a + b + c) / 3.0;
            assert!((b - a).cross(c - a).dot(Vec3::new(out.x, 0.0, out.z)) > 0.0);
        }
    }
}
