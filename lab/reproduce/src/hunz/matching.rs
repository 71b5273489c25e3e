//! One model made to look like another: shapes by its curves, strengths by least squares on pictures.

use std::f64::consts::PI;

use fiber::{Marschner, R, RESIDUAL, TRT, TT};
use film::Film;
use math::Rgb;

use super::ratio;
use crate::stats::solve;

/// Difference of two pictures, root mean square over the hair and relative, up to which they count as alike, and
/// up to which as a perfect match. The thesis compares by eye; these are ours.
pub(super) const ALIKE: f64 = 0.3;
pub(super) const PERFECT: f64 = 0.05;

/// Marschner's fiber as the thesis shows it: absorption, width and shift of R in degrees.
pub(super) fn marschner(sigma_a: [f64; 3], beta_deg: f64, alpha_deg: f64) -> Marschner<f64> {
    Marschner {
        beta_m: beta_deg.to_radians(),
        alpha: alpha_deg.to_radians(),
        ..Marschner::with_absorption(Rgb(sigma_a))
    }
}

/// Lines of the look of [`marschner`].
pub(super) fn marschner_look(sigma_a: [f64; 3], beta_deg: f64, alpha_deg: f64) -> String {
    format!(
        "model = \"marschner\"\nabsorption = {sigma_a:?}\nlongitudinal_roughness_deg = {beta_deg:?}\n\
         tilt_deg = {alpha_deg:?}\n"
    )
}

/// What the artist-friendly model needs beside colours and intensities, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    /// Width and shift of R; TT and TRT follow as in Marschner's model.
    pub(super) beta_deg: f64,
    pub(super) alpha_deg: f64,
    pub(super) tt_azimuthal_deg: f64,
    pub(super) glint_intensity: f64,
    pub(super) glint_width_deg: f64,
    pub(super) glint_angle_deg: f64,
}

impl Shape {
    /// The shape closest to a fiber: TT as wide around the fiber as its TT, and of all glints on a grid those
    /// that leave the least squared difference to its TRT. Both curves are means over difference angles up to 60
    /// degrees.
    pub(super) fn of(fiber: &Marschner<f64>) -> Self {
        let azimuths: Vec<f64> = (0..=180).map(|deg| f64::from(deg).to_radians()).collect();
        let curve = |lobe: usize| -> Vec<f64> {
            let at = |phi: f64| -> f64 {
                let over = (0..=6).map(|i| f64::from(10 * i).to_radians().cos().powi(2));
                over.map(|cos2| fiber.azimuthal(cos2, phi, 0.0)[lobe].luminance()).sum()
            };
            azimuths.iter().map(|&phi| at(phi)).collect()
        };
        let (tt, trt) = (curve(TT), curve(TRT));
        let second: f64 = tt.iter().zip(&azimuths).map(|(n, phi)| n * (PI - phi).powi(2)).sum();
        let tt_azimuthal_deg = ratio(second, tt.iter().sum()).sqrt().to_degrees().clamp(1.0, 90.0);

        let base: Vec<f64> = azimuths.iter().map(|phi| (0.5 * phi).cos()).collect();
        let none = vec![0.0; base.len()];
        let mut best = (f64::INFINITY, [1.0, 0.0], 5.0, 45.0);
        for width in (2..=18).map(|i| 2.5 * f64::from(i)) {
            for angle in (0..=24).map(|i| 2.5 * f64::from(i)) {
                let bell = |phi: &f64| (-0.5 * ((phi.to_degrees() - angle) / width).powi(2)).exp();
                let bells: Vec<f64> = azimuths.iter().map(bell).collect();
                let ([a, b, _], left) = factors([&base, &bells, &none], &trt);
                if left < best.0 {
                    best = (left, [a, b], width, angle);
                }
            }
        }
        let (_, [a, b], glint_width_deg, glint_angle_deg) = best;
        Self {
            beta_deg: fiber.beta_m.to_degrees(),
            alpha_deg: fiber.alpha.to_degrees(),
            tt_azimuthal_deg,
            // The model has no glints without the rest of TRT; 100 is as good as none of the rest.
            glint_intensity: if b > 0.0 { (b / a.max(0.01 * b)).min(100.0) } else { 0.0 },
            glint_width_deg,
            glint_angle_deg,
        }
    }

    /// Lines of a look of the artist-friendly model, as published, with these strengths of R, TT, TRT.
    pub(super) fn sadeghi_look(&self, strengths: [Rgb<f64>; 3]) -> String {
        let mut text = String::from("model = \"sadeghi\"\nmode = \"legacy\"\n");
        for ((name, strength), factors) in
            ["r", "tt", "trt"].into_iter().zip(strengths).zip([[1.0, 1.0], [-0.5, 0.5], [-1.5, 2.0]])
        {
            let intensity = strength.max_channel().clamp(0.0, 100.0);
            let colour = strength.map(|x| ratio(x, intensity).clamp(0.0, 1.0)).0;
            text += &format!(
                "{name}_color = {colour:?}\n{name}_intensity = {intensity:?}\n{name}_shift_deg = {:?}\n\
                 {name}_width_deg = {:?}\n",
                factors[0] * self.alpha_deg,
                factors[1] * self.beta_deg
            );
        }
        text + &format!(
            "tt_azimuthal_width_deg = {:?}\nglint_intensity = {:?}\nglint_width_deg = {:?}\nglint_angle_deg = {:?}\n",
            self.tt_azimuthal_deg, self.glint_intensity, self.glint_width_deg, self.glint_angle_deg
        )
    }

    /// Lines of a look of Kajiya and Kay, as published, with the second highlight of Scheuermann: diffuse part,
    /// first and second highlight. A cosine to the power `m` is as wide as a Gaussian of `1/√m`, and R is twice
    /// its β wide in the inclination of the light.
    pub(super) fn kajiya_look(&self, [diffuse, first, second]: [Rgb<f64>; 3]) -> String {
        let exponent = |factor: f64| (2.0 * factor * self.beta_deg.to_radians()).powi(-2);
        let within = |c: Rgb<f64>| c.map(|x| x.clamp(0.0, 1.0)).0;
        format!(
            "model = \"kajiya_kay\"\nmode = \"thesis\"\ndiffuse = {:?}\nspecular = {:?}\nexponent = {:?}\n\
             shift_deg = {:?}\nspecular2 = {:?}\nexponent2 = {:?}\nshift2_deg = {:?}\n",
            within(diffuse),
            within(first),
            exponent(1.0),
            self.alpha_deg,
            within(second),
            exponent(2.0),
            -1.5 * self.alpha_deg
        )
    }
}

/// The light of some pixels, lobe by lobe; of several pictures one after another.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Layers {
    pub(super) lobes: [Vec<Rgb<f64>>; 4],
}

impl Layers {
    /// Those pixels of one picture.
    pub(super) fn of(film: &Film, pixels: &[usize]) -> Self {
        let mut layers = Self::default();
        layers.extend(film, pixels);
        layers
    }

    /// Adds pixels of another picture.
    pub(super) fn extend(&mut self, film: &Film, pixels: &[usize]) {
        for &i in pixels {
            for (layer, light) in self.lobes.iter_mut().zip(film.pixels()[i].lobes()) {
                layer.push(light.cast());
            }
        }
    }

    /// All lobes together.
    pub(super) fn sum(&self) -> Vec<Rgb<f64>> {
        let [a, b, c, d] = &self.lobes;
        a.iter().zip(b).zip(c.iter().zip(d)).map(|((&a, &b), (&c, &d))| a + b + c + d).collect()
    }

    /// How strong R, TT and TRT of the artist-friendly model should be: each lobe of these pictures, made with
    /// strengths of 1, is brought closest to the same lobe of `want`.
    pub(super) fn sadeghi_strengths(&self, want: &Self) -> [Rgb<f64>; 3] {
        [R, TT, TRT].map(|lobe| {
            let dot = |a: &[Rgb<f64>], b: &[Rgb<f64>]| a.iter().zip(b).map(|(&a, &b)| a * b).sum::<Rgb<f64>>();
            let (basis, want) = (&self.lobes[lobe], &want.lobes[lobe]);
            dot(basis, want).zip(dot(basis, basis), |a, b| if b > 0.0 { a / b } else { 0.0 })
        })
    }

    /// How strong the diffuse part and the two highlights of Kajiya and Kay should be: these pictures, made with
    /// strengths of 1, are brought closest to the whole of `want`. No strength is negative.
    pub(super) fn kajiya_strengths(&self, want: &Self) -> [Rgb<f64>; 3] {
        let want = want.sum();
        let channel = |of: &[Rgb<f64>], c: usize| -> Vec<f64> { of.iter().map(|light| light[c]).collect() };
        let mut strengths = [Rgb::black(); 3];
        for c in 0..3 {
            let basis = [RESIDUAL, R, TRT].map(|lobe| channel(&self.lobes[lobe], c));
            let (found, _) = factors([&basis[0], &basis[1], &basis[2]], &channel(&want, c));
            for (strength, x) in strengths.iter_mut().zip(found) {
                strength[c] = x;
            }
        }
        strengths
    }
}

/// Factors `x`, none negative, with the least `|Σ x_j basis_j - want|²`, and that square.
///
/// The answer is the plain solution on those of its factors that are not zero; with three there are eight such
/// sets, so all are tried.
pub(super) fn factors(basis: [&[f64]; 3], want: &[f64]) -> ([f64; 3], f64) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let right = basis.map(|b| dot(b, want));
    let square = dot(want, want);
    let mut best = ([0.0; 3], square);
    for set in 1..8_u32 {
        let on = |j: usize| (set >> j) & 1 == 1;
        let mut m = [[0.0; 4]; 3];
        for (i, row) in m.iter_mut().enumerate() {
            if on(i) {
                for j in (0..3).filter(|&j| on(j)) {
                    row[j] = dot(basis[i], basis[j]);
                }
                row[3] = right[i];
            } else {
                row[i] = 1.0;
            }
        }
        let Some(x) = solve(m) else { continue };
        if x.iter().any(|x| *x < 0.0) {
            continue;
        }
        // At a solution of the normal equations the square is that of `want` less that of its image.
        let left = square - (x[0] * right[0] + x[1] * right[1] + x[2] * right[2]);
        if left < best.1 {
            best = (x, left);
        }
    }
    best
}

/// Sum of the squared differences of all channels.
pub(super) fn squared(a: &[Rgb<f64>], b: &[Rgb<f64>]) -> f64 {
    a.iter().zip(b).map(|(&a, &b)| (a - b).map(|x| x * x).0.iter().sum::<f64>()).sum()
}

/// Root of the squared difference over the squared light of `want`.
pub(super) fn relative(test: &[Rgb<f64>], want: &[Rgb<f64>]) -> f64 {
    let dark = vec![Rgb::black(); want.len()];
    ratio(squared(test, want), squared(want, &dark)).sqrt()
}

/// Mean of `test` over that of `want`, per channel.
pub(super) fn mean_ratio(test: &[Rgb<f64>], want: &[Rgb<f64>]) -> Rgb<f64> {
    let sum = |of: &[Rgb<f64>]| of.iter().copied().sum::<Rgb<f64>>();
    sum(test).zip(sum(want), ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(stream: u32) -> Vec<f64> {
        (0..200).map(|i| f64::from(math::hash::unit(i, stream))).collect()
    }

    #[test]
    fn factors_are_found_again_and_never_negative() {
        let [a, b, c] = [1, 2, 3].map(noise);
        let mix = |x: f64, y: f64, z: f64| -> Vec<f64> {
            a.iter().zip(&b).zip(&c).map(|((a, b), c)| x * a + y * b + z * c).collect()
        };
        let (found, left) = factors([&a, &b, &c], &mix(0.3, 0.0, 2.0));
        for (found, want) in found.into_iter().zip([0.3, 0.0, 2.0]) {
            assert!((found - want).abs() < 1e-9, "{found} and {want}");
        }
        assert!(left.abs() < 1e-9, "{left}");
        // What would have to be taken away is left out, and the others make up for it as well as they can.
        let (found, left) = factors([&a, &b, &c], &mix(1.0, -0.5, 0.0));
        assert!(found[1] == 0.0 && found[0] > 0.0 && left > 0.0, "{found:?}");
        let step = |x: f64| {
            let test: Vec<f64> = a.iter().zip(&c).map(|(a, c)| (found[0] + x) * a + found[2] * c).collect();
            test.iter().zip(mix(1.0, -0.5, 0.0)).map(|(t, w)| (t - w).powi(2)).sum::<f64>()
        };
        assert!((step(0.0) - left).abs() < 1e-9 && step(0.01) > left && step(-0.01) > left);
        // Dependent curves still have a best answer.
        let (found, left) = factors([&a, &a, &a], &a);
        assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-9 && left.abs() < 1e-9);
    }

    #[test]
    fn glints_are_near_the_caustic_and_backlight_is_as_wide_as_it_was() {
        let shape = Shape::of(&marschner([0.11, 0.36, 0.4], 7.5, -5.0));
        // Caustics of this index lie within 18.6 degrees, smoothed by 15.
        assert!(shape.glint_angle_deg < 25.0 && shape.glint_intensity > 1.0, "{shape:?}");
        assert!((5.0..=30.0).contains(&shape.glint_width_deg), "{shape:?}");
        // TT ends 80 degrees from straight on and has its light near the middle.
        assert!((15.0..=45.0).contains(&shape.tt_azimuthal_deg), "{shape:?}");
    }

    #[test]
    fn strengths_are_those_that_pictures_were_made_with() {
        let layer = |stream: u32| -> Vec<Rgb<f64>> { noise(stream).into_iter().map(Rgb::splat).collect() };
        let basis = Layers { lobes: [layer(1), layer(2), layer(3), layer(4)] };
        let colours = [[0.1, 0.2, 0.3], [0.5, 0.0, 0.2], [0.0, 0.3, 0.9], [0.2, 0.1, 0.4]].map(Rgb);
        let mut want = basis.clone();
        for (layer, colour) in want.lobes.iter_mut().zip(colours) {
            for light in layer.iter_mut() {
                *light *= colour;
            }
        }
        let near = |a: Rgb<f64>, b: Rgb<f64>| (a - b).map(f64::abs).max_channel() < 1e-9;
        let found = basis.sadeghi_strengths(&want);
        assert!(near(found[0], colours[0]) && near(found[1], colours[1]) && near(found[2], colours[2]), "{found:?}");
        // Kajiya-Kay has no TT: without it the sum is met exactly.
        for light in &mut want.lobes[TT] {
            *light = Rgb::black();
        }
        let found = basis.kajiya_strengths(&want);
        assert!(near(found[0], colours[3]) && near(found[1], colours[0]) && near(found[2], colours[2]), "{found:?}");
        assert!(relative(&want.sum(), &want.sum()) == 0.0);
    }
}
