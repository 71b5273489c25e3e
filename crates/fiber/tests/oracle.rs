//! The models against tables that were computed apart from this crate: ray-traced cylinders,
//! multi-precision convolutions, closed forms, and the renderer Mitsuba 3.
//!
//! Every test asserts how many rows it compared, so that nothing is skipped in silence.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use fiber::lobe::attenuation::Optics;
use fiber::lobe::longitudinal::{self, Cone};
use fiber::quadrature::rule;
use fiber::wrap_angle;
use fiber::{
    Attenuation, Chiang, DIMS, Deon, Dir, Field, Hery, HeryLobe, HeryMode, Highlight, Hit, KajiyaKay, KajiyaKayMode,
    Lambertian, Model, R, RESIDUAL, Scatter, TRT, Weights,
};
use math::{Rgb, hash};
use serde_json::Value;

// --- Reading

macro_rules! rows {
    ($file:literal) => {
        parse(include_str!(concat!("data/", $file)))
    };
}

fn parse(text: &str) -> Vec<Value> {
    match serde_json::from_str::<Value>(text).expect("the table is JSON") {
        Value::Array(rows) => rows,
        mut table => match table["rows"].take() {
            Value::Array(rows) => rows,
            _ => panic!("the table has no rows"),
        },
    }
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {row}"))
}

fn numbers(value: &Value) -> Vec<f64> {
    let array = value.as_array().unwrap_or_else(|| panic!("no array in {value}"));
    array.iter().map(|x| x.as_f64().unwrap_or_else(|| panic!("no number in {value}"))).collect()
}

fn colour(row: &Value, key: &str) -> Rgb<f64> {
    let x = numbers(&row[key]);
    Rgb([x[0], x[1], x[2]])
}

/// Within `relative` of the wanted value, or within `absolute`.
#[track_caller]
fn close(got: f64, want: f64, relative: f64, absolute: f64, what: &str, row: &Value) {
    assert!(
        (got - want).abs() <= (relative * want.abs()).max(absolute),
        "{what}: {got:e}, the table has {want:e} (off by {:.1e}) in {row}",
        ((got - want) / want).abs(),
    );
}

// --- Integrating

/// Gauss-Legendre over inclinations between the cuts, trapezoid over `azimuths` directions: `∫ f dω`.
///
/// Independent of the quadrature in the conformance suite.
fn over_the_sphere<const N: usize>(cuts: &[f64], azimuths: u32, mut f: impl FnMut(Dir<f64>) -> [f64; N]) -> [f64; N] {
    // Pieces shorter than this (0.3 degrees) are merged; also keeps nodes out of the 1e-4 next to the
    // poles, where some models floor the cosine.
    const SHORTEST: f64 = 0.005;
    let mut edges: Vec<f64> = cuts.iter().copied().filter(|cut| cut.abs() < FRAC_PI_2 - SHORTEST).collect();
    edges.sort_by(f64::total_cmp);
    edges.dedup_by(|next, last| *next - *last < SHORTEST);
    edges.insert(0, -FRAC_PI_2);
    edges.push(FRAC_PI_2);

    let turn = TAU / f64::from(azimuths);
    let mut sum = [0.0; N];
    for edge in edges.windows(2) {
        let (centre, half) = (0.5 * (edge[0] + edge[1]), 0.5 * (edge[1] - edge[0]));
        for &(x, w) in rule(8) {
            let theta = centre + half * x;
            for j in 0..azimuths {
                let at = f(Dir::new(theta, (f64::from(j) + 0.5) * turn - PI));
                for (sum, at) in sum.iter_mut().zip(at) {
                    *sum += w * half * theta.cos() * turn * at;
                }
            }
        }
    }
    sum
}

/// Cuts at 0, 1, 2, 4 and 8 widths around every `(centre, width)`, the centre folded at the poles.
fn around(lobes: &[(f64, f64)]) -> Vec<f64> {
    let fold = |theta: f64| if theta.abs() > FRAC_PI_2 { theta.signum() * PI - theta } else { theta };
    let steps = [-8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0];
    lobes.iter().flat_map(|&(centre, width)| steps.map(|step| fold(centre) + step * width)).collect()
}

/// Uniform numbers in `[0, 1)`, a function of stream and index.
fn uniform(stream: u32, index: u32) -> [f64; DIMS] {
    std::array::from_fn(|dim| {
        let word = hash::mix(hash::mix3(stream, index, dim as u32).wrapping_add(stream));
        (f64::from(word) + 0.5) / 4_294_967_296.0
    })
}

// --- Models in short

fn deon(beta_m: f64, beta_n: f64, alpha: f64, sigma_a: f64) -> Deon<f64> {
    Deon {
        eta: 1.55,
        sigma_a: Rgb::splat(sigma_a),
        beta_m,
        beta_n,
        alpha,
        residual: true,
        attenuation: Attenuation::Difference,
        weights: Weights::Marginal,
        field: Field::Far,
    }
}

fn hery(beta: f64, alpha: f64, mode: HeryMode) -> Hery<f64> {
    Hery { mode, ..Hery::single(Rgb::white(), beta, alpha) }
}

fn kajiya_kay(diffuse: f64, specular: f64, exponent: f64, mode: KajiyaKayMode) -> KajiyaKay<f64> {
    KajiyaKay::single(Rgb::splat(diffuse), Rgb::splat(specular), exponent, mode)
}

// --- Pieces

#[test]
fn longitudinal_densities_are_the_convolution() {
    let rows = rows!("longitudinal.json");
    let mut in_single = 0;
    for row in &rows {
        let (v, centre, theta) = (number(row, "v"), number(row, "theta_cone"), number(row, "theta_s"));
        let want = number(row, "L");
        let (sin, cos) = centre.sin_cos();
        let cone = Cone { sin, cos, raw_cos: cos };
        let s = Dir::new(theta, 0.0);
        close(longitudinal::density(v, cone, s.sin_theta, s.cos_theta), want, 1e-9, 0.0, "L", row);

        // Single precision, where it can hold the value: 2e-5, and what the rounding of the two
        // inclinations (a few 1e-7) does to a lobe as narrow as this.
        if want > 1e-30 {
            let cone = Cone { sin: sin as f32, cos: cos as f32, raw_cos: cos as f32 };
            let s: Dir<f32> = s.cast();
            let got = f64::from(longitudinal::density(v as f32, cone, s.sin_theta, s.cos_theta));
            close(got, want, 2e-5 + 4e-7 * (theta - centre).abs() / v, 0.0, "L in single precision", row);
            in_single += 1;
        }
    }
    assert_eq!((rows.len(), in_single), (174, 174));
}

#[test]
fn paths_through_the_cylinder_are_the_traced_ones() {
    let rows = rows!("cylinder_paths.json");
    let mut lobes = [0; 4];
    for row in &rows {
        let k = Dir::new(number(row, "theta_k"), 0.0);
        let p = number(row, "p") as usize;
        let path = Optics::new(k.cos_theta * k.cos_theta, number(row, "eta")).path_at(number(row, "h"));
        let azimuth = wrap_angle(path.exit_azimuth(p) - number(row, "phi_s"));
        close(azimuth, 0.0, 0.0, 1e-12, "exit azimuth minus the traced one", row);
        close(p as f64 * path.length, number(row, "path_length"), 1e-12, 1e-12, "length", row);
        // The residual lobe is the geometric series that starts with the path of three segments.
        let mut share = path.attenuation(Rgb::black())[p][0];
        if p == RESIDUAL {
            share *= 1.0 - path.fresnel;
        }
        close(share, number(row, "attenuation_fresnel"), 1e-12, 1e-12, "Fresnel factors", row);
        close(-k.theta(), number(row, "theta_s"), 0.0, 1e-12, "specular cone", row);
        lobes[p] += 1;
    }
    assert_eq!(rows.len(), 689);
    assert_eq!(lobes.iter().sum::<usize>(), 689);
    assert!(lobes.iter().all(|&count| count > 100), "{lobes:?}");
}

// --- d'Eon et al.

#[test]
fn deon_lobes_are_the_tabulated_ones() {
    let rows = rows!("deon_bcsdf.json");
    for row in &rows {
        let radians = |key: &str| number(row, key).to_radians();
        let model = Deon {
            eta: number(row, "eta"),
            ..deon(radians("beta_M_deg"), radians("beta_N_deg"), radians("alpha_deg"), number(row, "sigma_a"))
        };
        let known = Dir::new(number(row, "theta_k"), 0.4);
        let setup = model.prepare(&Hit::new(known, 0.0));
        let s = Dir::new(number(row, "theta_s"), 0.4 + number(row, "phi"));
        let (l, n) = setup.factors(s);
        let (fcos, pdf) = setup.eval_pdf(s);
        let (want_l, want_n, want) = (numbers(&row["L"]), numbers(&row["N"]), numbers(&row["fcos_lobes"]));
        for p in 0..4 {
            // The tabulated convolution has an absolute error where L is nothing.
            close(l[p], want_l[p], 1e-9, 1e-20, "longitudinal factor", row);
            // Where L underflows the factor N cannot be had from the product; the value is 0 there.
            if l[p] > 1e-100 {
                close(n[p][0], want_n[p], 1e-4, 1e-7, "azimuthal factor", row);
            }
            close(fcos[p][1], want[p], 1e-4, 1e-7, "lobe", row);
        }
        let three = fcos[0][2] + fcos[1][2] + fcos[2][2];
        close(three, number(row, "fcos_RTTTRT"), 1e-4, 1e-7, "R, TT and TRT", row);
        close(fcos.sum()[0], number(row, "fcos_total"), 1e-4, 1e-7, "value", row);
        close(pdf, number(row, "pdf_total"), 1e-4, 1e-7, "density", row);

        let without = Deon { residual: false, ..model }.prepare(&Hit::new(known, 0.0));
        close(without.eval(s).sum()[0], number(row, "fcos_RTTTRT"), 1e-4, 1e-7, "value without residual", row);
    }
    assert_eq!(rows.len(), 224);
}

#[test]
fn deon_joint_weights_scatter_as_tabulated() {
    const DRAWS: u32 = 60_000;
    let rows = rows!("deon_weight_stats.json");
    for (stream, row) in rows.iter().enumerate() {
        let beta = number(row, "beta_deg").to_radians();
        let theta_deg = number(row, "theta_deg");
        let joint = Deon { weights: Weights::Joint, ..deon(beta, beta, 0.0, number(row, "sigma_a")) };
        let hit = Hit::new(Dir::new(theta_deg.to_radians(), 0.0), 0.0);
        let clamped = Deon { weights: Weights::Clamped, ..joint }.prepare(&hit);
        let joint = joint.prepare(&hit);

        let (mut sum, mut squares, mut sum_clamped, mut lost_squares, mut above) = (0.0, 0.0, 0.0, 0.0, 0_u32);
        for index in 0..DRAWS {
            let u = uniform(0x6465 + stream as u32, index);
            let weight = joint.sample(u).map_or(0.0, |sample| sample.weight.sum()[0]);
            let cut = clamped.sample(u).map_or(0.0, |sample| sample.weight.sum()[0]);
            assert!(cut <= 2.0, "a clamped weight of {cut} in {row}");
            assert!((cut - weight.min(2.0)).abs() < 1e-12, "clamped to {cut} from {weight} in {row}");
            sum += weight;
            squares += weight * weight;
            sum_clamped += cut;
            lost_squares += (weight - cut) * (weight - cut);
            above += u32::from(weight > 2.0);
        }
        let n = f64::from(DRAWS);
        let mean = sum / n;
        let deviation = (squares / n - mean * mean).max(0.0).sqrt();

        // Both means are estimates: 4 standard errors of their difference (the table has 2e5 draws).
        let table_deviation = number(row, "std");
        let error = deviation.max(table_deviation) * (1.0 / n + 1.0 / 2e5).sqrt();
        close(mean, number(row, "mean"), 0.0, 4.0 * error + 1e-6, "mean weight", row);
        // The table is an upper bound, with a half for its own noise; at 89 degrees single weights of
        // 200 decide, and the bound is looser.
        let slack = if theta_deg > 88.0 { 3.0 } else { 1.5 };
        assert!(deviation <= slack * table_deviation, "weights vary by {deviation} in {row}");
        let share = f64::from(above) / n;
        let table_share = number(row, "frac_gt2");
        let share_error = ((table_share + 1.0 / n) * (1.0 / n + 1.0 / 2e5)).sqrt();
        assert!(share <= 1.2 * table_share + 4.0 * share_error, "a share of {share} above 2 in {row}");
        // Energy lost by the clamp, relative to the mean: 20 %, and the noise of both estimates.
        let loss = 1.0 - sum_clamped / sum;
        let loss_error = (lost_squares / n).sqrt() / mean * (1.0 / n + 1.0 / 2e5).sqrt();
        let table_loss = number(row, "energy_loss_from_clamp");
        close(loss, table_loss, 0.0, 0.2 * table_loss + 1e-3 + 4.0 * loss_error, "energy lost by the clamp", row);
    }
    assert_eq!(rows.len(), 62);
}

#[test]
fn near_field_averages_to_the_far_field() {
    const OFFSETS: u32 = 4096;
    let mut compared = 0;
    for (beta_deg, alpha_deg, theta_deg) in [(10.0_f64, 0.0_f64, 20.0_f64), (7.5, -3.0, -60.0), (20.0, -3.0, 75.0)] {
        let model = deon(beta_deg.to_radians(), beta_deg.to_radians(), alpha_deg.to_radians(), 0.3);
        let near = Deon { field: Field::Near, ..model };
        let known = Dir::new(theta_deg.to_radians(), -1.0);
        let far = model.prepare(&Hit::new(known, 0.0));
        let targets: Vec<Dir<f64>> =
            (0..8).filter_map(|i| far.sample(uniform(77, i))).map(|sample| sample.dir).collect();
        let mut means = vec![Rgb::<f64>::black(); targets.len()];
        for i in 0..OFFSETS {
            // Stratified: one offset within each stratum.
            let jitter = uniform(78, i)[0];
            let h = 2.0 * (f64::from(i) + jitter) / f64::from(OFFSETS) - 1.0;
            let setup = near.prepare(&Hit::new(known, h));
            for (mean, &s) in means.iter_mut().zip(&targets) {
                *mean += setup.eval(s).sum() / f64::from(OFFSETS);
            }
        }
        for (mean, &s) in means.iter().zip(&targets) {
            let want = far.eval(s).sum()[0];
            assert!((mean[0] / want - 1.0).abs() < 0.01, "{beta_deg}° from {theta_deg}° to {s:?}: {mean:?}, {want}");
            compared += 1;
        }
    }
    assert_eq!(compared, 24);
}

// --- Energies

#[test]
fn white_furnaces_are_the_tabulated_ones() {
    let rows = rows!("furnace.json");
    let (mut deon_rows, mut hery_rows, mut kajiya_kay_rows, mut chiang_rows, mut left_out) = (0, 0, 0, 0, 0);
    for row in &rows {
        let thetas: Vec<f64> = numbers(&row["theta_deg"]).iter().map(|theta| theta.to_radians()).collect();
        assert_eq!(thetas.len(), 35);
        let energies = row["energy"].is_array().then(|| numbers(&row["energy"]));
        match (row["model"].as_str(), energies) {
            (Some("deon"), None) => {
                let (beta, alpha) = (number(row, "beta_deg").to_radians(), number(row, "alpha_deg").to_radians());
                // The energy does not depend on the azimuthal width; at 40 degrees (TT 20) a trapezoid
                // of 20 azimuths is exact to 1e-8.
                let model = deon(beta, 40.0_f64.to_radians(), alpha, number(row, "sigma_a"));
                let lobes = row["energy_lobes"].as_array().map_or(&[][..], Vec::as_slice);
                assert_eq!(lobes.len(), 35);
                for (&theta_k, want) in thetas.iter().zip(lobes) {
                    let setup = model.prepare(&Hit::new(Dir::new(theta_k, 0.0), 0.0));
                    let cuts = around(&[
                        (2.0 * alpha - theta_k, beta),
                        (-alpha - theta_k, 0.5 * beta),
                        (-4.0 * alpha - theta_k, 2.0 * beta),
                        (-theta_k, 2.0 * beta),
                    ]);
                    let got = over_the_sphere(&cuts, 20, |s| setup.eval(s).0.map(|lobe| lobe[0]));
                    for (got, want) in got.into_iter().zip(numbers(want)) {
                        close(got, want, 1e-4, 1e-8, "energy of a lobe", row);
                    }
                }
                deon_rows += 1;
            }
            (Some("hery_alg2_value"), Some(energies)) => {
                let (beta, alpha) = (number(row, "beta_deg").to_radians(), number(row, "alpha_deg").to_radians());
                for (&theta_k, want) in thetas.iter().zip(energies) {
                    let setup = hery(beta, alpha, HeryMode::Faithful).prepare(&Hit::new(Dir::new(theta_k, 0.0), 0.0));
                    let cuts = around(&[(2.0 * alpha - theta_k, 2.0 * beta)]);
                    // cos(φ/2) has a kink at π, which costs the trapezoid 3e-6 at 720 azimuths.
                    let [got] = over_the_sphere(&cuts, 720, |s| [setup.eval(s)[R][0]]);
                    close(got, want, 1e-4, 0.0, "energy", row);
                }
                hery_rows += 1;
            }
            (Some("kk_spec_normalised_at_0"), Some(energies)) => {
                let m = number(row, "m");
                for (&theta_k, want) in thetas.iter().zip(energies) {
                    let setup = kajiya_kay(0.0, 1.0, m, KajiyaKayMode::Normalised)
                        .prepare(&Hit::new(Dir::new(theta_k, 0.0), 0.0));
                    let mut cuts = around(&[(-theta_k, m.sqrt().recip())]);
                    cuts.extend([FRAC_PI_2 - theta_k, -FRAC_PI_2 - theta_k]);
                    // No dependence on the azimuth at all.
                    let [got] = over_the_sphere(&cuts, 4, |s| [setup.eval(s)[R][0]]);
                    close(got, want, 1e-4, 0.0, "energy", row);
                }
                kajiya_kay_rows += 1;
            }
            (Some("chiang_far_field_average"), Some(energies)) => {
                // L and N of every lobe integrate to 1 (tested below): what comes back at an offset is
                // the sum of the attenuations.
                let sigma_a = Rgb::splat(number(row, "sigma_a"));
                for (&theta_k, want) in thetas.iter().zip(energies) {
                    let optics = Optics::new(theta_k.cos().powi(2), 1.55);
                    let got: f64 = rule(128)
                        .iter()
                        .map(|&(x, w)| {
                            let gamma = FRAC_PI_2 * x;
                            let lobes = optics.path_at(gamma.sin()).attenuation(sigma_a);
                            0.5 * w * FRAC_PI_2 * gamma.cos() * lobes.iter().map(|lobe| lobe[0]).sum::<f64>()
                        })
                        .sum();
                    close(got, want, 1e-4, 0.0, "energy", row);
                }
                chiang_rows += 1;
            }
            // Marschner's model is not in the crate yet.
            (Some("marschner_M"), Some(_)) => left_out += 1,
            _ => panic!("an unknown row: {row}"),
        }
    }
    assert_eq!((deon_rows, hery_rows, kajiya_kay_rows, chiang_rows, left_out), (16, 4, 3, 4, 8));
    assert_eq!(rows.len(), 35);
}

fn chiang(alpha: f64, sigma_a: f64) -> Chiang<f64> {
    Chiang { beta_m: 0.3, beta_n: 0.3, alpha, eta: 1.55, sigma_a: Rgb::splat(sigma_a), field: Field::Near }
}

fn chiang_energy(model: &Chiang<f64>, theta_k: f64, h: f64) -> f64 {
    let setup = model.prepare(&Hit::new(Dir::new(theta_k, 0.0), h));
    let [r, tt, trt, residual] = model.variances().map(f64::sqrt);
    let cuts = around(&[
        (2.0 * model.alpha - theta_k, r),
        (-model.alpha - theta_k, tt),
        (-4.0 * model.alpha - theta_k, trt),
        (-theta_k, residual),
    ]);
    // The logistic of scale 0.117 has no Fourier coefficient left at 128.
    let [energy] = over_the_sphere(&cuts, 128, |s| [setup.eval(s).sum()[0]]);
    energy
}

#[test]
fn chiang_loses_nothing_in_a_white_furnace() {
    let mut compared = 0;
    for alpha_deg in [-10.0_f64, 0.0, 10.0] {
        for theta_deg in [-85.0_f64, -60.0, -30.0, 0.0, 30.0, 60.0, 80.0] {
            for h in [-1.0, -0.95, -0.3, 0.0, 0.8, 1.0] {
                let energy = chiang_energy(&chiang(alpha_deg.to_radians(), 0.0), theta_deg.to_radians(), h);
                assert!((energy - 1.0).abs() < 1e-6, "α = {alpha_deg}°, θ = {theta_deg}°, h = {h}: {energy}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 126);
}

#[test]
fn chiang_returns_the_sum_of_its_attenuations() {
    let mut compared = 0;
    for theta_deg in [-80.0_f64, 0.0, 45.0] {
        for h in [-0.9, 0.2, 0.99] {
            let theta_k = theta_deg.to_radians();
            let attenuation = Optics::new(theta_k.cos().powi(2), 1.55).path_at(h).attenuation(Rgb::splat(0.7));
            let want: f64 = attenuation.iter().map(|lobe| lobe[0]).sum();
            let got = chiang_energy(&chiang(-0.05, 0.7), theta_k, h);
            assert!((got - want).abs() < 1e-6, "θ = {theta_deg}°, h = {h}: {got} and {want}");
            compared += 1;
        }
    }
    assert_eq!(compared, 9);
}

#[test]
fn lambertian_returns_its_albedo() {
    let mut compared = 0;
    for theta_deg in [-85.0_f64, 0.0, 40.0] {
        let setup =
            Lambertian { albedo: Rgb([0.9, 0.5, 0.1]) }.prepare(&Hit::new(Dir::new(theta_deg.to_radians(), 0.0), 0.0));
        let energy = over_the_sphere(&[0.0], 720, |s| setup.eval(s).sum().0);
        for (energy, albedo) in energy.into_iter().zip([0.9, 0.5, 0.1]) {
            assert!((energy - albedo).abs() < 1e-6, "{energy} and {albedo}");
            compared += 1;
        }
    }
    assert_eq!(compared, 9);
}

#[test]
fn hery_truncated_returns_its_tint() {
    let mut compared = 0;
    for (beta_deg, alpha_deg) in [(2.0_f64, 0.0_f64), (5.0, -2.0), (10.0, 5.0), (19.0, 0.0)] {
        for theta_deg in (-80..=80).step_by(20) {
            let (beta, alpha) = (beta_deg.to_radians(), alpha_deg.to_radians());
            let theta_k = f64::from(theta_deg).to_radians();
            let setup = hery(beta, alpha, HeryMode::Truncated).prepare(&Hit::new(Dir::new(theta_k, 0.0), 0.0));
            let mut cuts = around(&[(2.0 * alpha - theta_k, 2.0 * beta)]);
            cuts.extend(around(&[(2.0 * alpha - theta_k, 6.0 * beta)]));
            // Without the azimuth, whose kink at π is the trapezoid's business: ∫ cos(φ/2) dφ = 4, and
            // the value straight ahead is what cos 0 = 1 multiplies.
            let [energy] = over_the_sphere(&cuts, 1, |s| [setup.eval(Dir { phi: 0.0, ..s })[R][0] * 4.0 / TAU]);
            assert!((energy - 1.0).abs() < 1e-6, "β = {beta_deg}°, α = {alpha_deg}°, θ = {theta_deg}°: {energy}");
            compared += 1;
        }
    }
    assert_eq!(compared, 36);
}

// --- Chiang et al.

#[test]
fn chiang_is_the_exact_table_and_near_mitsuba() {
    let rows = rows!("chiang_mitsuba.json");
    let (mut channels, mut densities) = (0, 0);
    for row in &rows {
        let model = Chiang {
            beta_m: number(row, "beta_m"),
            beta_n: number(row, "beta_n"),
            alpha: number(row, "alpha_deg").to_radians(),
            eta: number(row, "eta"),
            sigma_a: colour(row, "sigma_a"),
            field: Field::Near,
        };
        let setup = model.prepare(&Hit::new(Dir::new(number(row, "theta_k"), 0.9), number(row, "h")));
        let s = Dir::new(number(row, "theta_s"), 0.9 + number(row, "phi_rel"));
        let (fcos, pdf) = setup.eval_pdf(s);
        let fcos = fcos.sum();
        let (exact, mitsuba) = (colour(row, "exact_fcos"), colour(row, "mitsuba_fcos"));
        for channel in 0..3 {
            close(fcos[channel], exact[channel], 1e-6, 0.0, "value", row);
            // Mitsuba computes in single precision, and its logarithm of I0 has half of the first
            // correction: 0.55 % apart at most. Compared where there is something to see.
            if mitsuba[channel] > 1e-4 {
                close(fcos[channel], mitsuba[channel], 0.0, 7e-3 * mitsuba.max_channel(), "value in Mitsuba", row);
                channels += 1;
            }
        }
        close(pdf, number(row, "exact_pdf_mitsuba_lum"), 1e-6, 0.0, "density", row);
        let mitsuba_pdf = number(row, "mitsuba_pdf");
        if mitsuba_pdf > 1e-4 {
            close(pdf, mitsuba_pdf, 7e-3, 0.0, "density in Mitsuba", row);
            densities += 1;
        }
    }
    assert_eq!(rows.len(), 200);
    assert_eq!((channels, densities), (MITSUBA_CHANNELS, MITSUBA_DENSITIES));
}

/// How many values and densities of Mitsuba's table are above 1e-4.
const MITSUBA_CHANNELS: usize = 508;
const MITSUBA_DENSITIES: usize = 178;

// --- The closed forms

#[test]
fn lambertian_is_the_summed_cylinder() {
    let rows = rows!("lambertian_fiber.json");
    for row in &rows {
        let model = Lambertian { albedo: Rgb::splat(number(row, "kd")) };
        let setup = model.prepare(&Hit::new(Dir::new(number(row, "theta_k"), 2.0), 0.0));
        let s = Dir::new(number(row, "theta_s"), 2.0 + number(row, "phi"));
        close(setup.eval(s).sum()[0], number(row, "fcos"), 0.0, 1e-8, "value", row);
        close(setup.eval(s).sum()[0] / s.cos_theta, number(row, "S"), 0.0, 1e-8, "scattering function", row);
        close(setup.pdf(s), number(row, "pdf"), 0.0, 1e-8, "density", row);
    }
    assert_eq!(rows.len(), 133);
}

#[test]
fn kajiya_kay_is_the_closed_form() {
    let rows = rows!("kajiya_kay.json");
    for row in &rows {
        let (i, o, m) = (number(row, "theta_i"), number(row, "theta_o"), number(row, "m"));
        let (hit, s) = (Hit::new(Dir::new(i, 0.0), 0.0), Dir::new(o, 1.0));
        let value = |diffuse: f64, specular: f64, mode, hit: &Hit<f64>, s: Dir<f64>| {
            kajiya_kay(diffuse, specular, m, mode).prepare(hit).eval(s).sum()[0]
        };
        // The thesis' diffuse term has the cosine of the light, which the table calls i and this crate s.
        let (from_o, to_i) = (Hit::new(Dir::new(o, 0.0), 0.0), Dir::new(i, 1.0));
        let diffuse = value(1.0, 0.0, KajiyaKayMode::Thesis, &from_o, to_i);
        close(diffuse, number(row, "diffuse_thesis"), 1e-9, 1e-12, "thesis' diffuse", row);
        let specular = value(0.0, 1.0, KajiyaKayMode::Thesis, &hit, s);
        close(specular, number(row, "specular_thesis"), 1e-9, 1e-12, "thesis' specular", row);
        // The rest has k = i and s = o; the normalised columns are S.
        let diffuse = value(1.0, 0.0, KajiyaKayMode::Normalised, &hit, s) / s.cos_theta;
        close(diffuse, number(row, "f_diffuse_normalised"), 1e-9, 1e-12, "normalised diffuse", row);
        let specular = value(0.0, 1.0, KajiyaKayMode::Normalised, &hit, s) / s.cos_theta;
        close(specular, number(row, "f_specular_normalised"), 1e-9, 1e-12, "normalised specular", row);
        for mode in [KajiyaKayMode::Thesis, KajiyaKayMode::Normalised] {
            let density = kajiya_kay(0.0, 1.0, m, mode).prepare(&hit).pdf(s);
            close(density, number(row, "pdf_spec_folded"), 1e-9, 1e-12, "specular density", row);
            let density = kajiya_kay(1.0, 0.0, m, mode).prepare(&hit).pdf(s);
            close(density, number(row, "pdf_diffuse"), 1e-9, 1e-12, "diffuse density", row);
        }
    }
    assert_eq!(rows.len(), 107);
}

/// Moving a highlight is turning the fiber under it: it returns what the unmoved one returns at the inclination
/// `θ_k - 2α`, so all of its colour where that is 0, and less on either side.
#[test]
fn kajiya_kay_shifted_returns_what_the_unshifted_does() {
    let mut compared = 0;
    for m in [0.0_f64, 3.0, 25.0, 100.0] {
        let energy = |theta_k: f64, shift: f64| {
            let highlight = Highlight { color: Rgb::white(), exponent: m, shift };
            let model = KajiyaKay {
                diffuse: Rgb::black(),
                highlights: [Highlight::none(), highlight],
                mode: KajiyaKayMode::Normalised,
            };
            let setup = model.prepare(&Hit::new(Dir::new(theta_k, 0.0), 0.0));
            let centre = 2.0 * shift - theta_k;
            let mut cuts = around(&[(centre, m.max(1.0).sqrt().recip())]);
            cuts.extend([centre - FRAC_PI_2, centre + FRAC_PI_2]);
            // No dependence on the azimuth at all.
            let [energy] = over_the_sphere(&cuts, 1, |s| [setup.eval(s)[TRT][0]]);
            energy
        };
        for shift_deg in [-10.0_f64, 4.0, 20.0] {
            let shift = shift_deg.to_radians();
            assert!((energy(2.0 * shift, shift) - 1.0).abs() < 1e-6, "m = {m}, α = {shift_deg}°: at its best not 1");
            for theta_deg in [-70.0_f64, -45.0, -10.0, 0.0, 30.0, 50.0] {
                let theta_k = theta_deg.to_radians();
                if (theta_k - 2.0 * shift).abs() > FRAC_PI_2 {
                    continue;
                }
                let (got, want) = (energy(theta_k, shift), energy(theta_k - 2.0 * shift, 0.0));
                // Two quadratures with cuts in different places.
                assert!((got - want).abs() < 1e-6, "m = {m}, α = {shift_deg}°, θ = {theta_deg}°: {got} and {want}");
                assert!(got < 1.0, "m = {m}, α = {shift_deg}°, θ = {theta_deg}°: {got} comes back");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 68);
}

#[test]
fn two_highlights_are_the_sum_of_each() {
    let (first, second) = (
        Highlight { color: Rgb([0.3, 0.2, 0.1]), exponent: 40.0, shift: -0.06 },
        Highlight { color: Rgb([0.1, 0.3, 0.2]), exponent: 12.0, shift: 0.1 },
    );
    for mode in [KajiyaKayMode::Normalised, KajiyaKayMode::Thesis] {
        for index in 0..50 {
            let u = uniform(0x6b6b, index);
            let hit = Hit::new(Dir::new(2.8 * u[0] - 1.4, 0.3), 0.0);
            let s = Dir::new(2.8 * u[1] - 1.4, 6.0 * u[2]);
            let at = |highlights| KajiyaKay { diffuse: Rgb::splat(0.2), highlights, mode }.prepare(&hit).eval(s);
            let both = at([first, second]);
            assert_eq!(both[R], at([first, Highlight::none()])[R]);
            assert_eq!(both[TRT], at([Highlight::none(), second])[TRT]);
            // The same highlight in the other place is the same highlight.
            assert_eq!(both[R], at([second, first])[TRT]);
            assert_eq!(both[RESIDUAL], at([Highlight::none(); 2])[RESIDUAL]);
        }
    }
}

#[test]
fn two_hery_lobes_are_the_sum_of_each() {
    let first = HeryLobe { tint: Rgb::splat(0.17), beta: 5.0_f64.to_radians(), alpha: (-2.0_f64).to_radians() };
    let second = HeryLobe { tint: Rgb([0.0, 0.1, 1.0]), beta: 10.0_f64.to_radians(), alpha: 5.0_f64.to_radians() };
    let share = first.tint.luminance() / (first.tint.luminance() + second.tint.luminance());
    for mode in [HeryMode::Truncated, HeryMode::Faithful, HeryMode::FaithfulExactPdf] {
        for index in 0..50 {
            let u = uniform(0x6872, index);
            let hit = Hit::new(Dir::new(2.8 * u[0] - 1.4, 0.3), 0.0);
            let s = Dir::new(2.8 * u[1] - 1.4, 6.0 * u[2]);
            let at = |lobes| Hery { lobes, mode, cos_theta_d: false }.prepare(&hit).eval_pdf(s);
            let ((both, pdf), (one, one_pdf), (other, other_pdf)) =
                (at([first, second]), at([first, HeryLobe::none()]), at([HeryLobe::none(), second]));
            assert_eq!((both[R], both[TRT]), (one[R], other[TRT]));
            assert!(one[TRT].is_black() && other[R].is_black());
            let mixture = share * one_pdf + (1.0 - share) * other_pdf;
            assert!((pdf - mixture).abs() <= 1e-12 * mixture, "{mode:?}: {pdf} and {mixture}");
        }
    }
}

#[test]
fn hery_is_the_closed_form() {
    let rows = rows!("hery.json");
    for row in &rows {
        let (beta, alpha) = (number(row, "beta_deg").to_radians(), number(row, "alpha_deg").to_radians());
        let hit = Hit::new(Dir::new(number(row, "theta_r"), -0.5), 0.0);
        let s = Dir::new(number(row, "theta_i"), -0.5 + number(row, "phi"));
        for (mode, key) in [
            (HeryMode::Faithful, "alg2_pdf"),
            (HeryMode::FaithfulExactPdf, "exact_cont_pdf"),
            (HeryMode::Truncated, "truncated_pdf"),
        ] {
            let setup = hery(beta, alpha, mode).prepare(&hit);
            close(setup.pdf(s), number(row, key), 1e-9, 1e-12, key, row);
            if mode != HeryMode::FaithfulExactPdf {
                close(setup.eval(s)[R][0], number(row, key), 1e-9, 1e-12, "value", row);
            }
        }
        let plain = hery(beta, alpha, HeryMode::Truncated);
        let variant = Hery { cos_theta_d: true, ..plain };
        let (plain, variant) = (plain.prepare(&hit).eval(s)[R][0], variant.prepare(&hit).eval(s)[R][0]);
        close(variant, plain * number(row, "cosd_ratio"), 1e-9, 1e-12, "value with Marschner's cosines", row);
    }
    assert_eq!(rows.len(), 217);
}
