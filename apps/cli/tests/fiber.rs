//! `cuticle fiber eval`: every model against the tables that the scattering library itself is held to, and what
//! it says of parameters that cannot be.
//!
//! The tables were computed apart from this project and lie with the library's tests. Here they show that the
//! command line means by its parameters, angles and lobes what the model pages say: radians, `phi = phi_s - phi_k`,
//! the known direction first. Each model answers all of its rows in one call.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fs;
use std::io::{Seek as _, Write as _};
use std::path::Path;
use std::process::{Command, Output};

use serde_json::{Value, json};

/// Every model, and a parameter that only looks right.
const MODELS: [(&str, &str); 8] = [
    ("deon", "beta_n"),
    ("chiang", "beta_m"),
    ("lambertian", "kd"),
    ("kajiya_kay", "alpha2"),
    ("hery", "cos_theta_d"),
    ("marschner", "delta_h_M"),
    ("sadeghi", "delta_TT"),
    ("fur", "sigma_ms"),
];

/// R, TT, TRT in `lobes`.
const THREE: [usize; 3] = [0, 1, 2];

// --- the tables -------------------------------------------------------------------------------------------------

#[test]
fn deon_answers_the_table() {
    let rows = rows("deon_bcsdf.json");
    let query = |row: &Value| {
        let params = deon_params(row);
        [json!({ "params": params, "theta_k": row["theta_k"], "theta_s": row["theta_s"], "phi": row["phi"] })]
    };
    each("deon", &rows, query, |row, answers| {
        // The library's quadrature over the cross-section against another one.
        let close = |got: &Value, want: f64| close(at(got), want, 1e-4, 1e-7, row);
        close(&answers[0]["fcos"][0], number(row, "fcos_total"));
        close(&answers[0]["pdf"], number(row, "pdf_total"));
        for lobe in 0..4 {
            close(&answers[0]["lobes"][lobe][1], at(&row["fcos_lobes"][lobe]));
        }
    });
    assert_eq!(rows.len(), 224);
}

#[test]
fn chiang_answers_the_table() {
    let rows = rows("chiang_mitsuba.json");
    let query = |row: &Value| {
        let params = json!({
            "eta": row["eta"],
            "sigma_a": row["sigma_a"],
            "beta_m": row["beta_m"],
            "beta_n": row["beta_n"],
            "alpha": radians(row, "alpha_deg"),
        });
        let (theta_k, theta_s, phi, h) = (&row["theta_k"], &row["theta_s"], &row["phi_rel"], &row["h"]);
        [json!({ "params": params, "theta_k": theta_k, "theta_s": theta_s, "phi": phi, "h": h })]
    };
    each("chiang", &rows, query, |row, answers| {
        for channel in 0..3 {
            close(at(&answers[0]["fcos"][channel]), at(&row["exact_fcos"][channel]), 1e-6, 0.0, row);
        }
        close(at(&answers[0]["pdf"]), number(row, "exact_pdf_mitsuba_lum"), 1e-6, 0.0, row);
    });
    assert_eq!(rows.len(), 200);
}

#[test]
fn lambertian_answers_the_table() {
    let rows = rows("lambertian_fiber.json");
    let query = |row: &Value| {
        let params = json!({ "kd": row["kd"] });
        [json!({ "params": params, "theta_k": row["theta_k"], "theta_s": row["theta_s"], "phi": row["phi"] })]
    };
    each("lambertian", &rows, query, |row, answers| {
        close(at(&answers[0]["fcos"][0]), number(row, "fcos"), 0.0, 1e-8, row);
        close(at(&answers[0]["pdf"]), number(row, "pdf"), 0.0, 1e-8, row);
    });
    assert_eq!(rows.len(), 133);
}

#[test]
fn kajiya_kay_answers_the_table() {
    let rows = rows("kajiya_kay.json");
    let query = |row: &Value| {
        let (i, o) = (&row["theta_i"], &row["theta_o"]);
        let ask = |kd: f64, ks: f64, mode: &str, theta_k: &Value, theta_s: &Value| {
            let params = json!({ "kd": kd, "ks": ks, "m": row["m"], "mode": mode });
            json!({ "params": params, "theta_k": theta_k, "theta_s": theta_s, "phi": 1.0 })
        };
        // The thesis' diffuse term has the cosine of the light, which the table calls i; the rest has k = i.
        [
            ask(1.0, 0.0, "thesis", o, i),
            ask(0.0, 1.0, "thesis", i, o),
            ask(1.0, 0.0, "normalised", i, o),
            ask(0.0, 1.0, "normalised", i, o),
        ]
    };
    each("kajiya_kay", &rows, query, |row, answers| {
        let close = |got: &Value, want: f64| close(at(got), want, 1e-9, 1e-12, row);
        let [thesis_diffuse, thesis_specular, diffuse, specular] = [0, 1, 2, 3].map(|i| &answers[i]);
        // The normalised columns are the scattering function.
        let cos = number(row, "theta_o").cos();
        close(&thesis_diffuse["fcos"][0], number(row, "diffuse_thesis"));
        close(&thesis_specular["fcos"][0], number(row, "specular_thesis"));
        close(&diffuse["fcos"][0], number(row, "f_diffuse_normalised") * cos);
        close(&specular["fcos"][0], number(row, "f_specular_normalised") * cos);
        close(&diffuse["pdf"], number(row, "pdf_diffuse"));
        close(&specular["pdf"], number(row, "pdf_spec_folded"));
        close(&thesis_specular["pdf"], number(row, "pdf_spec_folded"));
    });
    assert_eq!(rows.len(), 107);
}

#[test]
fn hery_answers_the_table() {
    let rows = rows("hery.json");
    let modes = ["truncated", "faithful", "faithful_exact_pdf"];
    let query = |row: &Value| {
        modes.map(|mode| {
            let params = json!({ "beta": radians(row, "beta_deg"), "alpha": radians(row, "alpha_deg"), "mode": mode });
            json!({ "params": params, "theta_k": row["theta_r"], "theta_s": row["theta_i"], "phi": row["phi"] })
        })
    };
    each("hery", &rows, query, |row, answers| {
        let close = |got: &Value, want: f64| close(at(got), want, 1e-9, 1e-12, row);
        for (answer, key) in answers.iter().zip(["truncated_pdf", "alg2_pdf", "exact_cont_pdf"]) {
            close(&answer["pdf"], number(row, key));
        }
        // A white lobe's value is its density, but for what the exact mode knows of the folds.
        close(&answers[0]["lobes"][0][0], number(row, "truncated_pdf"));
        close(&answers[1]["lobes"][0][0], number(row, "alg2_pdf"));
    });
    assert_eq!(rows.len(), 217);
}

#[test]
fn sadeghi_answers_the_table() {
    let rows = rows("sadeghi.json");
    let query = |row: &Value| {
        ["legacy", "normalised"].map(|mode| {
            // TT and TRT follow R where nothing is said of them.
            let params = json!({
                "I_R": 1, "I_TT": 1, "I_TRT": 1,
                "alpha_R": radians(row, "alpha_R_deg"),
                "beta_R": radians(row, "beta_R_deg"),
                "delta_TT": radians(row, "delta_TT_deg"),
                "I_G": row["I_G"],
                "delta_G": radians(row, "delta_G_deg"),
                "G_angle": radians(row, "G_angle_deg"),
                "mode": mode,
            });
            json!({ "params": params, "theta_k": row["theta_i"], "theta_s": row["theta_o"], "phi": row["phi"] })
        })
    };
    each("sadeghi", &rows, query, |row, answers| {
        let cos = number(row, "theta_o").cos();
        for p in THREE {
            let fcos = at(&row["f_unit_lobes"][p]) * cos;
            close(at(&answers[0]["lobes"][p][0]), fcos, 1e-9, 0.0, row);
            // Normalised, a lobe is divided by its energy, which both sides have by quadrature.
            close(at(&answers[1]["lobes"][p][0]), fcos / at(&row["energy_lobes"][p]), 1e-5, 0.0, row);
        }
    });
    assert_eq!(rows.len(), 131);
}

/// The table has the azimuthal factors; the rest is written out here. With `theta_s = x + theta_d` and
/// `theta_k = x - theta_d` the half difference is the table's and the half angle is `x`.
#[test]
fn marschner_answers_the_table() {
    let table = table("marschner_azimuth.json");
    let rows = table["rows"].as_array().expect("the table has rows");
    let smooth = &table["smooth_params"];
    let (alpha, beta, x) = ((-5.0_f64).to_radians(), 7.5_f64.to_radians(), 0.05);
    let query = |row: &Value| {
        let ask = |roots: &str, smoothing: bool, mode: &str| {
            let params = json!({
                "eta": row["eta"],
                "sigma_a": row["sigma_a"],
                "alpha_R": alpha,
                "beta_R": beta,
                "roots": roots,
                "mode": mode,
                "smoothing": smoothing,
                "k_G": smooth["k_G"],
                "w_c": radians(smooth, "w_c_deg"),
                "delta_eta": smooth["delta_eta"],
                "delta_h_M": smooth["delta_h_M"],
            });
            let theta_d = number(row, "theta_d");
            json!({ "params": params, "theta_k": x - theta_d, "theta_s": x + theta_d, "phi": row["phi"] })
        };
        [
            ask("exact", false, "normalised"),
            ask("exact", true, "normalised"),
            ask("cubic", false, "normalised"),
            ask("cubic", true, "normalised"),
            ask("exact", false, "as_printed"),
        ]
    };
    each("marschner", rows, query, |row, answers| {
        let theta_d = number(row, "theta_d");
        for (i, answer) in answers.iter().enumerate() {
            let kappa = if i == 4 { 1.0 } else { 0.5 };
            for p in THREE {
                let n = match (i, p) {
                    (1, 2) => number(row, "N_TRT_smooth_exact"),
                    (3, 2) => number(row, "N_TRT_smooth_cubic"),
                    (2 | 3, _) => at(&row["N_cubic"][p]),
                    _ => at(&row["N_exact"][p]),
                };
                let (shift, width) = ([1.0, -0.5, -1.5][p] * alpha, [1.0, 0.5, 2.0][p] * beta);
                let m = kappa * (-0.5 * ((x - shift) / width).powi(2)).exp() / (width * TAU.sqrt());
                let want = m * n * (x + theta_d).cos() / theta_d.cos().powi(2);
                close(at(&answer["lobes"][p][1]), want, 1e-6, 1e-12, row);
            }
        }
    });
    assert_eq!(rows.len(), 146);
}

// --- what has no table ------------------------------------------------------------------------------------------

/// Fur without a medulla is d'Eon's near field with the attenuation at the known angle.
#[test]
fn fur_without_a_medulla_answers_as_deon() {
    let rows = rows("deon_bcsdf.json");
    let ask = |row: &Value, params: Value| {
        let h = number(row, "phi").sin();
        json!({ "params": params, "theta_k": row["theta_k"], "theta_s": row["theta_s"], "phi": row["phi"], "h": h })
    };
    let fur: Vec<Value> = rows.iter().map(|row| ask(row, deon_params(row))).collect();
    let deon: Vec<Value> = rows
        .iter()
        .map(|row| {
            let mut params = deon_params(row);
            params["attenuation"] = json!("known");
            params["field"] = json!("near");
            ask(row, params)
        })
        .collect();
    let (fur, deon) = (eval("fur", &fur), eval("deon", &deon));
    for (row, (fur, deon)) in rows.iter().zip(fur.iter().zip(&deon)) {
        // Products of the same factors in another order.
        close(at(&fur["pdf"]), at(&deon["pdf"]), 1e-12, 1e-300, row);
        for lobe in 0..4 {
            close(at(&fur["lobes"][lobe][0]), at(&deon["lobes"][lobe][0]), 1e-12, 1e-300, row);
        }
    }
    assert_eq!((fur.len(), deon.len()), (224, 224));
    // A medulla that scatters is another matter.
    let scattered = |params: Value| {
        let query = json!({ "params": params, "theta_k": 0.1, "theta_s": -0.1, "phi": 1, "h": 0.2 });
        at(&eval("fur", &[query])[0]["lobes"][3][0])
    };
    let (with, without) = (scattered(json!({ "kappa": 0.6, "sigma_ms": 2 })), scattered(json!({})));
    assert!(with > 5.0 * without, "{with} and {without}");
}

/// The far field is the mean of the near field over the offset; `h` is what tells them apart if nothing else does.
#[test]
fn the_far_field_is_the_mean_of_the_near_one() {
    const OFFSETS: u32 = 600;
    for (model, params) in [
        ("chiang", json!({ "sigma_a": [0.1, 0.3, 0.9], "beta_n": 0.3, "alpha": -0.03, "field": "far" })),
        ("deon", json!({ "sigma_a": [0.1, 0.3, 0.9], "beta_M": 0.2, "alpha": -0.05 })),
    ] {
        let mut near = params.clone();
        near["field"] = json!("near");
        let at_point = |params: &Value| json!({ "params": params, "theta_k": 0.4, "theta_s": -0.3, "phi": 2.5 });
        // Midpoints in the angle of incidence, whose sine is the offset.
        let gamma = |i: u32| (f64::from(i) + 0.5) / f64::from(OFFSETS) * PI - FRAC_PI_2;
        let mut queries = vec![at_point(&params)];
        queries.extend((0..OFFSETS).map(|i| {
            let mut query = at_point(&near);
            query["h"] = json!(gamma(i).sin());
            query
        }));
        let answers = eval(model, &queries);
        for channel in 0..3 {
            let weighted = (0..OFFSETS).zip(&answers[1..]).map(|(i, near)| gamma(i).cos() * at(&near["fcos"][channel]));
            let mean = weighted.sum::<f64>() * FRAC_PI_2 / f64::from(OFFSETS);
            let far = at(&answers[0]["fcos"][channel]);
            // The midpoint rule errs by 3e-7 with this many offsets, a quarter of it with twice as many.
            assert!((far / mean - 1.0).abs() < 3e-6, "{model}: far {far}, the mean of the near field is {mean}");
        }
    }
}

/// Only a fiber that is not round looks at the absolute azimuth.
#[test]
fn an_ellipse_feels_where_its_major_axis_is() {
    let trt = |a: f64, phi_k: f64| {
        let params = json!({ "sigma_a": 0.2, "beta_R": 0.175, "alpha_R": -0.087, "a": a });
        let query = json!({ "params": params, "theta_k": 0.2, "theta_s": -0.1, "phi": 0.3, "phi_k": phi_k });
        at(&eval("marschner", &[query])[0]["lobes"][2][0])
    };
    let (round, turned) = (trt(1.0, 0.0), trt(1.0, FRAC_PI_2));
    assert!((round / turned - 1.0).abs() < 1e-9, "{round} and {turned}");
    let (major, minor) = (trt(0.9, 0.0), trt(0.9, FRAC_PI_2));
    assert!((major / minor - 1.0).abs() > 0.1, "{major} and {minor}");
}

// --- refusals ---------------------------------------------------------------------------------------------------

#[test]
fn what_no_model_has_is_refused_by_every_model() {
    for (model, known) in MODELS {
        // The name that was meant is among those offered.
        refused(model, r#""params":{"nope":1},"h":0.3"#, &["unknown field `nope`", &format!("`{known}`")]);
        refused(model, r#""params":[],"h":0.3"#, &["\"params\" is []", "object"]);
        refused(model, r#""h":1.5"#, &["h is 1.5", "between -1 and 1"]);
        refused(model, r#""h":-2"#, &["h is -2", "between -1 and 1"]);
    }
}

#[test]
fn parameters_out_of_range_are_refused_by_name() {
    let positive = "greater than 0";
    let cases = [
        ("deon", r#"{"beta_M":-0.1}"#, ["beta_M is -0.1", positive]),
        ("deon", r#"{"beta_N":0}"#, ["beta_N is 0", positive]),
        ("deon", r#"{"alpha":2}"#, ["alpha is 2", "1.57"]),
        ("chiang", r#"{"beta_m":-0.1}"#, ["beta_m is -0.1", positive]),
        ("chiang", r#"{"beta_n":-0.1}"#, ["beta_n is -0.1", positive]),
        ("lambertian", r#"{"kd":[0.1,-0.2,0.3]}"#, ["kd is [0.1, -0.2, 0.3]", "must not be negative"]),
        ("kajiya_kay", r#"{"m":-1}"#, ["m is -1", "at least 0"]),
        ("kajiya_kay", r#"{"m2":-1}"#, ["m2 is -1", "at least 0"]),
        ("kajiya_kay", r#"{"alpha2":1}"#, ["alpha2 is 1", "0.785"]),
        ("hery", r#"{"beta":-0.1}"#, ["beta is -0.1", positive]),
        ("hery", r#"{"beta2":-0.1}"#, ["beta2 is -0.1", positive]),
        ("marschner", r#"{"beta_R":-0.1}"#, ["beta_R is -0.1", positive]),
        ("marschner", r#"{"w_c":-0.1}"#, ["w_c is -0.1", positive]),
        ("marschner", r#"{"k_G":-1}"#, ["k_G is -1", "at least 0"]),
        ("marschner", r#"{"delta_h_M":2}"#, ["delta_h_M is 2", "between 0 and 1"]),
        ("marschner", r#"{"a":1.2}"#, ["a is 1.2", "between 0.5 and 1"]),
        ("sadeghi", r#"{"beta_R":-0.1}"#, ["beta_R is -0.1", positive]),
        ("sadeghi", r#"{"beta_TT":-0.1}"#, ["beta_TT is -0.1", positive]),
        ("sadeghi", r#"{"beta_TRT":0}"#, ["beta_TRT is 0", positive]),
        ("sadeghi", r#"{"delta_TT":-0.1}"#, ["delta_TT is -0.1", positive]),
        ("sadeghi", r#"{"delta_G":0}"#, ["delta_G is 0", positive]),
        ("sadeghi", r#"{"I_R":-1}"#, ["I_R is -1", "at least 0"]),
        ("sadeghi", r#"{"G_angle":4}"#, ["G_angle is 4", "between 0 and 3.14"]),
        ("sadeghi", r#"{"C_TT":-1}"#, ["C_TT", "must not be negative"]),
        ("fur", r#"{"beta_M":-0.1}"#, ["beta_M is -0.1", positive]),
        ("fur", r#"{"kappa":1.2}"#, ["kappa is 1.2", "between 0 and 0.95"]),
        ("fur", r#"{"layers":0.5}"#, ["layers is 0.5", "between 1 and 10"]),
        ("fur", r#"{"sigma_ms":-1}"#, ["sigma_ms is -1", "between 0 and"]),
        ("fur", r#"{"sigma_ma":-1}"#, ["sigma_ma", "must not be negative"]),
        ("fur", r#"{"g":2}"#, ["g is 2", "between -0.6 and 0.9"]),
    ];
    for (model, params, says) in cases {
        refused(model, &format!(r#""params":{params},"h":0.3"#), &says);
    }
}

#[test]
fn modes_of_other_models_are_refused_with_the_right_ones() {
    let cases: [(&str, &str, &[&str]); 10] = [
        ("deon", r#"{"attenuation":"none"}"#, &["`none`", "`difference`", "`known`"]),
        ("deon", r#"{"field":"middle"}"#, &["`middle`", "`near`", "`far`"]),
        ("chiang", r#"{"field":"middle"}"#, &["`middle`", "`near`", "`far`"]),
        ("kajiya_kay", r#"{"mode":"legacy"}"#, &["`legacy`", "`normalised`", "`thesis`"]),
        ("hery", r#"{"mode":"exact"}"#, &["`exact`", "`truncated`", "`faithful`", "`faithful_exact_pdf`"]),
        ("marschner", r#"{"mode":"thesis"}"#, &["`thesis`", "`normalised`", "`as_printed`"]),
        ("marschner", r#"{"roots":"quartic"}"#, &["`quartic`", "`exact`", "`cubic`"]),
        ("sadeghi", r#"{"mode":"as_printed"}"#, &["`as_printed`", "`normalised`", "`legacy`"]),
        ("fur", r#"{"mode":"normalised"}"#, &["unknown field `mode`", "`kappa`"]),
        ("lambertian", r#"{"mode":"normalised"}"#, &["unknown field `mode`", "`kd`"]),
    ];
    for (model, params, says) in cases {
        refused(model, &format!(r#""params":{params},"h":0.3"#), says);
    }
}

#[test]
fn a_near_field_without_an_offset_is_refused() {
    refused("fur", r#""phi_k":0"#, &["needs \"h\""]);
    refused("chiang", r#""phi_k":0"#, &["needs \"h\"", "\"field\": \"far\""]);
    refused("deon", r#""params":{"field":"near"}"#, &["needs \"h\""]);
    refused("chiang", r#""params":{"field":"near"}"#, &["needs \"h\""]);
}

// --- asking -----------------------------------------------------------------------------------------------------

/// What `cuticle fiber eval` makes of these lines.
fn ask(model: &str, lines: &str) -> Output {
    // A file, not a pipe: nobody has to write and to read at once.
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(lines.as_bytes()).unwrap();
    file.rewind().unwrap();
    Command::new(env!("CARGO_BIN_EXE_cuticle")).args(["fiber", "eval", "--model", model]).stdin(file).output().unwrap()
}

/// The answers to queries that are all good.
#[track_caller]
fn eval(model: &str, queries: &[Value]) -> Vec<Value> {
    let lines: String = queries.iter().map(|query| format!("{query}\n")).collect();
    let output = ask(model, &lines);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!((output.status.code(), &*said), (Some(0), ""), "{model}");
    let answers: Vec<Value> =
        String::from_utf8(output.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(answers.len(), queries.len(), "{model} answers every line");
    for answer in &answers {
        for channel in 0..3 {
            // Rounded twice more on the way through text.
            let sum: f64 = (0..4).map(|lobe| at(&answer["lobes"][lobe][channel])).sum();
            let fcos = at(&answer["fcos"][channel]);
            assert!((sum - fcos).abs() <= 1e-14 * fcos, "{model}: the lobes are not the whole in {answer}");
        }
    }
    answers
}

/// Asks `N` queries for each row, all in one call, and checks the answers row by row.
#[track_caller]
fn each<const N: usize>(
    model: &str,
    rows: &[Value],
    query: impl Fn(&Value) -> [Value; N],
    check: impl Fn(&Value, &[Value]),
) {
    let queries: Vec<Value> = rows.iter().flat_map(&query).collect();
    let answers = eval(model, &queries);
    for (row, answers) in rows.iter().zip(answers.chunks_exact(N)) {
        check(row, answers);
    }
}

/// A line with these fields beside its directions is refused, and the complaint says all of `says`.
#[track_caller]
fn refused(model: &str, fields: &str, says: &[&str]) {
    let line = format!("{{{fields},\"theta_k\":0.1,\"theta_s\":0.2,\"phi\":1.0}}\n");
    let output = ask(model, &line);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{model}, {line}{said}");
    assert!(output.stdout.is_empty() && !said.contains("panicked"), "{model}, {line}{said}");
    for what in says.iter().chain(&["line 1 of standard input"]) {
        assert!(said.contains(*what), "{model}, {line}does not say {what}:\n{said}");
    }
}

// --- reading ----------------------------------------------------------------------------------------------------

fn table(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/fiber/tests/data").join(name);
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn rows(name: &str) -> Vec<Value> {
    match table(name)["rows"].take() {
        Value::Array(rows) => rows,
        _ => panic!("{name} has no rows"),
    }
}

#[track_caller]
fn at(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[track_caller]
fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {row}"))
}

/// A number that the table has in degrees.
#[track_caller]
fn radians(row: &Value, key: &str) -> f64 {
    number(row, key).to_radians()
}

/// Parameters of d'Eon's model, and of fur without a medulla.
fn deon_params(row: &Value) -> Value {
    json!({
        "eta": row["eta"],
        "sigma_a": row["sigma_a"],
        "beta_M": radians(row, "beta_M_deg"),
        "beta_N": radians(row, "beta_N_deg"),
        "alpha": radians(row, "alpha_deg"),
    })
}

/// Within `relative` of the wanted value, or within `absolute`.
#[track_caller]
fn close(got: f64, want: f64, relative: f64, absolute: f64, row: &Value) {
    assert!(
        (got - want).abs() <= (relative * want.abs()).max(absolute),
        "{got:e}, the table has {want:e} (off by {:.1e}) in {row}",
        ((got - want) / want).abs(),
    );
}
