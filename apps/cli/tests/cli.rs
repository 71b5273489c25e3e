//! The command line as people use it: what it writes, what it says, and what it does with bad input.
//!
//! Every refusal must end with exit code 1 or 2, say what was found and what would have been right, and leave
//! the folder as it was: no new file, no temporary one, old pictures intact. On Linux refusals run with little
//! memory, so that a header which lies about a size cannot have it believed.

mod desk;

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use desk::{Answer, Desk, Refusals, frugal};
use film::Image;
use math::Rgb;
use serde_json::Value;

/// Two thick hairs on a ball, lit from everywhere. Tests count its lines.
const SCENE: &str = r#"[film]
width = 16
height = 16

[render]
samples = 2

[[light]]
type = "environment"
radiance = 0.5
visible = false

[[groom]]
procedural = { preset = "fur", strands = 2, points = 2, guides = 1, clumps = 1, ellipsoid = { radii = [1.0, 1.0, 1.0] } }
width = { diameter_um = 1200.0 }
look = "main"

[look.main]
model = "lambertian"
albedo = 0.8
"#;

/// What stands in `o.exr` and `o.png` before a command that must not touch them.
const OLD: &[u8] = b"an older picture";

// --- good input -------------------------------------------------------------------------------------------------

#[test]
fn render_writes_layers_and_picture() {
    let desk = desk();
    let answer = desk.good("render tiny.toml -o new.exr");
    assert!(answer.err.contains("2 strands, 16 x 16 pixels"), "{}", answer.err);
    assert!(answer.err.contains("new.exr") && answer.err.contains("new.png"), "{}", answer.err);
    assert_eq!(answer.out, "", "the standard output is for results that are text");
    let (exr, png) = (desk.image("new.exr"), desk.image("new.png"));
    assert_eq!(((exr.width, exr.height), (png.width, png.height)), ((16, 16), (16, 16)));
    assert!(exr.defects().is_empty());
    assert!(exr.pixels.iter().any(|pixel| pixel.luminance() > 0.0), "hair in an environment is not black");
    assert_eq!(desk.names(), ["new.exr", "new.png", "o.exr", "o.png", "tiny.toml"], "and nothing else");
}

#[test]
fn the_name_says_what_is_written() {
    let cases: &[(&str, &[&str])] =
        &[("a.png", &["a.png"]), ("a.PNG", &["a.PNG"]), ("a", &["a.exr", "a.png"]), ("a.EXR", &["a.EXR", "a.png"])];
    for (name, files) in cases {
        let desk = desk();
        desk.good(&format!("render tiny.toml -o {name}"));
        let written: Vec<String> = desk.names().into_iter().filter(|file| file.starts_with('a')).collect();
        assert_eq!(written, *files, "-o {name}");
    }
}

#[test]
fn old_pictures_are_replaced_and_quiet_is_quiet() {
    let desk = desk();
    let answer = desk.good("render tiny.toml -o o.exr --quiet");
    assert_eq!((answer.out.as_str(), answer.err.as_str()), ("", ""));
    assert_eq!((desk.image("o.exr").width, desk.image("o.png").width), (16, 16));
}

#[test]
fn flags_override_the_scene_and_set_overrides_flags() {
    let desk = desk();
    desk.good("render tiny.toml -o a.png --size 8x4");
    desk.good("render tiny.toml -o b.png --size 8x8 --set film.width=4 --set groom.0.procedural.strands=1");
    assert_eq!((desk.image("a.png").width, desk.image("a.png").height), (8, 4));
    assert_eq!((desk.image("b.png").width, desk.image("b.png").height), (4, 8));

    desk.good("render tiny.toml -o plain.exr");
    desk.good("render tiny.toml -o seed.exr --seed 1");
    desk.good("render tiny.toml -o black.exr --set look.main.albedo=0");
    assert_ne!(desk.image("plain.exr"), desk.image("seed.exr"), "another seed is other noise");
    assert!(desk.image("black.exr").pixels.iter().all(|pixel| *pixel == Rgb::black()), "black hair before nothing");
}

/// Threads and instruction sets change how long a picture takes, never the picture.
#[test]
fn the_picture_is_the_same_however_it_is_computed() {
    let desk = desk();
    desk.good("render tiny.toml -o one.exr --threads 1");
    for how in ["--threads 2", "--threads 3 --simd auto"] {
        desk.good(&format!("render tiny.toml -o other.exr {how}"));
        for ending in ["exr", "png"] {
            let [one, other] = ["one", "other"].map(|name| desk.image(&format!("{name}.{ending}")));
            assert_eq!(one, other, "{how}, .{ending}");
        }
    }
}

#[test]
fn a_time_limit_ends_a_render() {
    let desk = desk();
    let begin = Instant::now();
    let answer = desk.good("render tiny.toml -o a.png --time 1s");
    // A second of samples, set-up and writing; far more than that on a machine that does other things too.
    assert!(begin.elapsed() < Duration::from_secs(30), "{}", answer.err);
    let samples = answer.err.lines().find_map(|line| line.split_once(" samples a pixel"));
    let samples: u32 = samples.expect("a summary").0.parse().unwrap();
    assert!(samples > 2, "without --samples, as many as fit and not what the scene says: {samples}");
}

#[test]
fn a_groom_alone_is_rendered() {
    let desk = desk();
    desk.write("two.hair", Hair::default().bytes());
    let answer = desk.good("render --groom two.hair --size 16x16 --samples 1 -o a.exr");
    assert!(answer.err.contains("2 strands"), "{}", answer.err);
    assert_eq!(desk.image("a.exr").width, 16);
    desk.good("render --groom two.hair --size 8x8 --samples 1 --up z --azimuth -40 --elevation 20 -o b.png");
    assert_eq!(desk.image("b.png").height, 8);
    desk.write("two.toml", SCENE.replace(&procedural_line(), "file = \"two.hair\""));
    desk.good("render two.toml -o c.png");
}

#[test]
fn scene_files_may_come_from_other_systems() {
    let desk = desk();
    let (bom, crlf) = (format!("\u{feff}{SCENE}"), SCENE.replace('\n', "\r\n"));
    for text in [&bom, &crlf] {
        desk.write("other.toml", text);
        desk.good("render other.toml -o a.png");
        // Places are counted as in an editor.
        desk.write("other.toml", text.replace("height = 16", "hieght = 16"));
        desk.refuse(&[("render other.toml", &["other.toml: line 3, column 1", "hieght", "did you mean `height`"])]);
    }
}

#[test]
fn info_counts_what_is_there() {
    let desk = desk();
    desk.write("two.hair", Hair::default().bytes());
    let answer = desk.good("info two.hair");
    for row in ["strands 2", "points 4", "zero-length segments 0", "degenerate strands 0"] {
        assert!(answer.has_row(row), "{row} in {}", answer.out);
    }
    let [a, b, c, d] = POINTS;
    desk.write("flat.hair", Hair { body: floats(&[a, a, c, d].concat()), ..Hair::default() }.bytes());
    let answer = desk.good("info flat.hair two.hair --unit-m 0.01");
    for row in ["zero-length segments 1", "degenerate strands 1", "zero-length segments 0", "metres per unit 0.01"] {
        assert!(answer.has_row(row), "{row} in {}", answer.out);
    }
    let body = [vec![0, 0, 1, 0], floats(&[a, c, b].concat())].concat();
    desk.write("single.hair", Hair { points: 3, flags: 3, body, ..Hair::default() }.bytes());
    let answer = desk.good("info single.hair");
    assert!(answer.has_row("strands 1") && answer.out.contains("1 of 2 strands have a single point"), "{}", answer.out);
}

#[test]
fn odd_strands_are_left_out_counted_and_the_rest_is_rendered() {
    let desk = desk();
    let [a, b, c, d] = POINTS;
    let render = |file: &str| desk.good(&format!("render --groom {file} --size 8x8 --samples 1 -o a.png")).err;
    desk.write("flat.hair", Hair { body: floats(&[a, a, c, d].concat()), ..Hair::default() }.bytes());
    let said = render("flat.hair");
    assert!(said.contains("warning") && said.contains("1 strands without length were left out"), "{said}");
    let body = [vec![0, 0, 1, 0], floats(&[a, c, b].concat())].concat();
    desk.write("single.hair", Hair { points: 3, flags: 3, body, ..Hair::default() }.bytes());
    let said = render("single.hair");
    assert!(said.contains("warning") && said.contains("1 of 2 strands have a single point"), "{said}");
    let body = [floats(&POINTS.concat()), b"more".to_vec()].concat();
    desk.write("longer.hair", Hair { body, ..Hair::default() }.bytes());
    let said = render("longer.hair");
    assert!(said.contains("warning") && said.contains("176"), "{said}");
}

#[test]
fn the_schema_is_json_and_knows_the_sections() {
    let schema: Value = serde_json::from_str(&desk().good("schema").out).unwrap();
    for section in ["scene", "camera", "film", "render", "light", "mesh", "groom", "look"] {
        assert!(schema["properties"][section].is_object(), "{section}");
    }
}

#[test]
fn fiber_eval_knows_the_lambertian_fiber_in_closed_form() {
    use std::f64::consts::PI;
    let directions: [(f64, f64); 6] = [(0.0, 0.0), (0.2, 0.5), (-1.1, 2.0), (1.4, 3.0), (0.3, -1.0), (0.3, 7.0)];
    let mut lines = String::new();
    for (theta_s, phi) in directions {
        let _ = writeln!(
            lines,
            r#"{{"params":{{"kd":[0.9,0.5,0.1]}},"theta_k":0.4,"theta_s":{theta_s},"phi":{phi},"h":0.3}}"#
        );
    }
    let answers = eval(&desk(), "lambertian", &lines);
    assert_eq!(answers.len(), directions.len());
    for ((theta_s, phi), answer) in directions.into_iter().zip(answers) {
        let x = (phi - 2.0 * PI * (phi / (2.0 * PI)).round()).abs();
        let pdf = ((PI - x) * x.cos() + x.sin()) * theta_s.cos() / (4.0 * PI);
        // A few roundings of numbers around 1, in double precision.
        let near = |found: &Value, want: f64| (found.as_f64().unwrap() - want).abs() < 1e-14;
        assert!(near(&answer["pdf"], pdf), "{answer}");
        for (channel, kd) in [0.9, 0.5, 0.1].into_iter().enumerate() {
            assert!(near(&answer["fcos"][channel], kd * pdf), "{answer}");
            let lobes = answer["lobes"].as_array().unwrap();
            let sum: f64 = lobes.iter().map(|lobe| lobe[channel].as_f64().unwrap()).sum();
            assert!((sum - kd * pdf).abs() < 1e-14, "{answer}");
        }
    }
}

/// Hair that absorbs nothing sends out all that it gets, wherever it comes from.
#[test]
fn fiber_eval_passes_the_furnace_with_chiang() {
    use std::f64::consts::PI;
    let (rows, columns) = (48, 96);
    let cell = PI / f64::from(rows) * 2.0 * PI / f64::from(columns);
    let (mut lines, mut areas) = (String::new(), Vec::new());
    for row in 0..rows {
        let theta_s = (f64::from(row) + 0.5) * PI / f64::from(rows) - 0.5 * PI;
        for column in 0..columns {
            let phi = (f64::from(column) + 0.5) * 2.0 * PI / f64::from(columns);
            let _ = writeln!(
                lines,
                r#"{{"params":{{"sigma_a":0,"beta_m":0.4,"beta_n":0.5,"alpha":0.05}},"theta_k":0.4,"theta_s":{theta_s},"phi":{phi},"h":0.3}}"#
            );
            areas.push(cell * theta_s.cos());
        }
    }
    let answers = eval(&desk(), "chiang", &lines);
    assert_eq!(answers.len(), areas.len());
    for key in ["fcos", "pdf"] {
        let value = |answer: &Value| if key == "fcos" { answer[key][1].as_f64() } else { answer[key].as_f64() };
        let whole: f64 = answers.iter().zip(&areas).map(|(answer, area)| value(answer).unwrap() * area).sum();
        // The midpoint rule leaves 9e-6 here, a quarter of it with twice the cells: the cosine's kink at the poles.
        assert!((whole - 1.0).abs() < 5e-5, "{key}: {whole}");
    }
}

#[test]
fn equal_pictures_are_equal_and_others_are_not() {
    let desk = desk();
    desk.good("render tiny.toml -o a.exr");
    desk.good("render tiny.toml -o b.exr --seed 1");
    let answer = desk.good("compare a.exr a.exr -o difference.png --max-relmse 0");
    assert!(answer.has_row("largest 0.000000") && answer.out.contains("relMSE          0.000000"), "{}", answer.out);
    let difference = desk.image("difference.png");
    assert_eq!((difference.width, difference.height), (16, 16));
    assert!(difference.pixels.iter().all(|pixel| *pixel == Rgb::black()));

    let answer = desk.good("compare a.exr b.exr -o difference.png");
    assert!(!answer.has_row("largest 0.000000"), "{}", answer.out);
    assert!(desk.image("difference.png").pixels.iter().any(|pixel| pixel.luminance() > 0.0));
    let answer = desk.run(["compare", "a.exr", "b.exr", "--max-relmse", "1e-9"]);
    assert_eq!(answer.code, Some(1), "{}", answer.err);
}

#[test]
fn help_lists_what_there_is() {
    let desk = desk();
    let subcommands = ["render", "info", "schema", "fiber", "compare"];
    let help = desk.good("--help").out;
    for subcommand in subcommands {
        assert!(help.lines().any(|line| line.trim_start().starts_with(subcommand)), "{subcommand} in {help}");
        assert!(desk.good(&format!("{subcommand} --help")).out.contains("Usage: cuticle"), "{subcommand}");
    }
    let help = desk.good("render --help").out;
    for flag in [
        "--groom",
        "--up",
        "--azimuth",
        "--elevation",
        "--head",
        "--env",
        "--samples",
        "--time",
        "--size",
        "--seed",
        "--threads",
        "--simd",
        "--set",
        "--view",
        "--output",
        "--quiet",
    ] {
        assert!(help.contains(flag), "{flag} in {help}");
    }
    assert!(desk.good("fiber --help").out.contains("eval"));
    let help = desk.good("fiber eval --help").out;
    for model in ["deon", "chiang", "lambertian", "kajiya_kay", "hery", "marschner", "sadeghi", "fur"] {
        assert!(help.contains(model), "{model} in {help}");
    }
    assert!(desk.good("--version").out.contains(env!("CARGO_PKG_VERSION")));
}

// --- bad input --------------------------------------------------------------------------------------------------

#[test]
fn wrong_commands_and_values_of_flags_are_refused() {
    let desk = desk();
    desk.write("two.hair", Hair::default().bytes());
    desk.refuse(&[
        ("frobnicate", &["frobnicate", "Usage"]),
        ("rendr", &["rendr", "'render'"]),
        ("render --frob", &["--frob", "--help"]),
        ("fiber", &["eval"]),
        ("fiber eval", &["--model"]),
        (
            "fiber eval --model blinn",
            &["'blinn'", "deon, chiang, lambertian, kajiya_kay, hery, marschner, sadeghi, fur"],
        ),
        ("info", &["<FILES>"]),
        ("compare a.exr", &["<REFERENCE>"]),
        ("render tiny.toml --groom two.hair", &["--groom", "cannot be used with"]),
        ("render --up y", &["--groom"]),
        ("render --groom two.hair --up w", &["'w'", "x, y, z"]),
        // Sizes.
        ("render tiny.toml --size 16", &["\"16\"", "1280x720"]),
        ("render tiny.toml --size 16x", &["\"16x\"", "1280x720"]),
        ("render tiny.toml --size 1.5x2", &["\"1.5x2\"", "1280x720"]),
        ("render tiny.toml --size 16x16x3", &["\"16x16x3\"", "1280x720"]),
        ("render tiny.toml --size 99999999999x1", &["99999999999x1", "1280x720"]),
        ("render tiny.toml --size 0x16", &["0", "16384"]),
        ("render tiny.toml --size 16x0", &["0", "16384"]),
        ("render tiny.toml --size 16385x1", &["16385", "16384"]),
        ("render tiny.toml --size 4294967295x4294967295", &["4294967295", "16384"]),
        // Each side is fine, the memory for all of it is not.
        ("render tiny.toml --size 16384x16384", &["16384", "pixels"]),
        // Durations.
        ("render tiny.toml --time x", &["\"x\"", "90s, 5m or 1h"]),
        ("render tiny.toml --time 1d", &["\"1d\"", "90s, 5m or 1h"]),
        ("render tiny.toml --time 0s", &["\"0s\"", "between 0 and"]),
        ("render tiny.toml --time nan", &["\"nan\"", "between 0 and"]),
        ("render tiny.toml --time 1e99h", &["\"1e99h\"", "between 0 and"]),
        // Counts.
        ("render tiny.toml --samples 0", &["--samples", "0 is not in 1..=16777216"]),
        ("render tiny.toml --samples 4294967296", &["--samples", "1..=16777216"]),
        ("render tiny.toml --samples many", &["--samples", "'many'"]),
        ("render tiny.toml --threads 0", &["--threads", "1..=1024"]),
        ("render tiny.toml --threads 1025", &["--threads", "1..=1024"]),
        ("render tiny.toml --seed 4294967296", &["--seed", "0..=4294967295"]),
        // Choices.
        ("render tiny.toml --simd mmx", &["\"mmx\"", "auto"]),
        ("render tiny.toml --view raw", &["\"raw\"", "srgb, filmic or agx"]),
        ("info two.hair --unit-m 0", &["--unit-m", "0", "greater than 0"]),
        ("info two.hair --unit-m nan", &["--unit-m", "NaN", "greater than 0"]),
    ]);
    for (flag, right) in [("--size", "1280x720"), ("--time", "90s"), ("--samples", "integer"), ("--output", "value")] {
        desk.refuse_args(&["render", "tiny.toml", flag, ""], &[flag, right]);
    }
}

#[test]
fn overrides_that_lead_nowhere_are_refused() {
    desk().refuse(&[
        ("render tiny.toml --set film.width", &["`--set film.width`", "`path=value`"]),
        ("render tiny.toml --set =", &["`--set =`", "needs a path"]),
        ("render tiny.toml --set film.width=", &["`--set film.width=`", "a value after it"]),
        ("render tiny.toml --set film.widht=8", &["`--set film.widht=8`", "`film.widht`", "did you mean `width`"]),
        ("render tiny.toml --set film.width=abc", &["`--set film.width=abc`", "`film.width`", "\"abc\""]),
        ("render tiny.toml --set film.width.a=3", &["`film.width`", "`a`"]),
        ("render tiny.toml --set look.mian.albedo=0.1", &["no look `mian`", "did you mean `main`"]),
        ("render tiny.toml --set look.main.model=chian", &["no `chian`", "did you mean `chiang`"]),
        ("render tiny.toml --set look.main.albedo=nan", &["`look.main.albedo` is NaN", "between 0 and 1"]),
        ("render tiny.toml --set look.main.albedo=[1,2", &["`--set look.main.albedo=[1,2`", "expected `]`"]),
        ("render tiny.toml --set groom.1.look=main", &["`groom[1]`", "1 entries, counted from 0"]),
        ("render tiny.toml --set mesh.0.albedo=0.1", &["the scene has no `mesh`"]),
        ("render tiny.toml --set zzz=1", &["unknown key `zzz`", "`camera`", "`film`"]),
        ("render tiny.toml --set film.width=8 --set film.filter=foo", &["`--set film.filter=foo`", "`gaussian`"]),
        ("render --set zzz=1", &["`--set zzz=1`", "unknown key `zzz`"]),
    ]);
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_rendering() {
    let desk = desk();
    desk.write("file", "not a folder");
    fs::create_dir(desk.path("taken.exr")).unwrap();
    fs::create_dir(desk.path("half.png")).unwrap();
    desk.refuse(&[
        ("render tiny.toml -o no/such/a.exr", &["no/such", "No such file or directory"]),
        ("render tiny.toml -o a.jpg", &["a.jpg", ".exr or .png", ".jpg"]),
        ("render tiny.toml -o take.2", &["take.2", ".exr or .png"]),
        ("render tiny.toml -o taken.exr", &["taken.exr", "is a folder"]),
        ("render tiny.toml -o taken", &["taken.exr", "is a folder"]),
        ("render tiny.toml -o half.exr", &["half.png", "is a folder"]),
        ("render tiny.toml -o ..", &["..", "names no picture"]),
        // A folder that denies writing would not deny it to root; a file denies to be a folder to everybody.
        ("render tiny.toml -o file/a.exr", &["file", "Not a directory"]),
    ]);
}

#[test]
fn wrong_scenes_are_refused_with_their_place() {
    let desk = desk();
    let cases: &[(&str, &str, &[&str])] = &[
        ("width = 16", "widht = 16", &["line 2, column 1", "`film.widht`", "did you mean `width`"]),
        ("[render]", "[rendr]", &["line 5, column 2", "`rendr`", "did you mean `render`"]),
        ("model =", "modle =", &["line 19, column 1", "`look.main.modle`", "did you mean `model`"]),
        ("width = 16", "width = \"wide\"", &["line 2, column 9", "`film.width`", "\"wide\""]),
        ("width = 16", "width = -16", &["line 2, column 9", "`film.width`", "-16"]),
        ("samples = 2", "samples = 0", &["line 6, column 11", "`render.samples` is 0", "between 1 and"]),
        ("radiance = 0.5", "radiance = -1", &["line 10, column 12", "is -1", "between 0 and"]),
        ("radiance = 0.5", "radiance = nan", &["line 10, column 12", "is NaN", "between 0 and"]),
        ("radiance = 0.5", "radiance = [1, 2]", &["line 10, column 12", "3 numbers", "found 2"]),
        ("radiance = 0.5", "intensity = 0.5", &["line 10, column 1", "no `intensity`", "did you mean `radiance`"]),
        ("type = \"environment\"", "type = \"sun\"", &["line 9, column 8", "no `sun`", "`distant`"]),
        ("look = \"main\"", "look = \"mian\"", &["line 16, column 8", "no look `mian`", "did you mean `main`"]),
        ("\"lambertian\"", "\"lambertain\"", &["line 19, column 9", "did you mean `lambertian`"]),
        ("albedo = 0.8", "albedo = 1.5", &["line 20, column 10", "is 1.5", "between 0 and 1"]),
        ("strands = 2", "strands = 0", &["line 14", "is 0", "from 1 to 1000000"]),
        ("points = 2", "points = 1", &["line 14", "is 1", "from 2 to 256"]),
        ("radii = [1.0, 1.0", "radii = [1.0, 0.0", &["line 14", "radii", "is 0", "between 0.001 and"]),
        ("diameter_um = 1200.0", "diameter_um = -1", &["line 15", "diameter_um", "is -1", "between 0.001 and"]),
        ("\"fur\"", "\"furr\"", &["line 14", "no `furr`", "did you mean `fur`"]),
        ("procedural =", "file = \"a.hair\"\nprocedural =", &["line 13", "exactly one of file"]),
        ("[look.main]", "[look.main", &["line 18", "expected `]`"]),
        ("height = 16", "width = 16", &["line 3, column 1", "duplicate key"]),
        (
            "[film]",
            "[camera]\nfov_deg = 0\n[film]",
            &["line 2, column 11", "`camera.fov_deg` is 0", "between 1 and 170"],
        ),
    ];
    for (right, wrong, says) in cases {
        assert!(SCENE.contains(right), "{right}");
        desk.write("wrong.toml", SCENE.replacen(right, wrong, 1));
        let says = [*says, &["wrong.toml"]].concat();
        desk.refuse(&[("render wrong.toml", &says)]);
    }
}

#[test]
fn files_that_are_no_scenes_are_refused() {
    let desk = desk();
    desk.write("empty.toml", "");
    desk.write("nothing.toml", "[film]\nwidth = 16\n");
    desk.write("bytes.toml", (0..=255).collect::<Vec<u8>>());
    desk.write("zeros.toml", [0_u8; 100]);
    desk.write("latin.toml", [SCENE.as_bytes(), b"# caf\xe9\n"].concat());
    desk.write("deep.toml", format!("a = {}", "[".repeat(100_000)));
    desk.write("long.toml", format!("{} = 1", vec!["a"; 100_000].join(".")));
    fs::create_dir(desk.path("folder.toml")).unwrap();
    desk.refuse(&[
        ("render missing.toml", &["missing.toml", "No such file or directory"]),
        ("render folder.toml", &["folder.toml", "it is a folder"]),
        ("render empty.toml", &["empty.toml", "[[groom]]", "[[mesh]]"]),
        ("render nothing.toml", &["nothing.toml", "[[groom]]", "[[mesh]]"]),
        ("render bytes.toml", &["bytes.toml", "UTF-8"]),
        ("render zeros.toml", &["zeros.toml", "line 1"]),
        ("render latin.toml", &["latin.toml", "UTF-8"]),
        ("render deep.toml", &["deep.toml", "recur"]),
        ("render long.toml", &["long.toml", "recur"]),
    ]);
}

#[test]
fn damaged_grooms_are_refused() {
    let desk = desk();
    let [a, b, c, d] = POINTS;
    let nan = f32::NAN;
    let widths = |widths: [f32; 4]| [floats(&POINTS.concat()), floats(&widths)].concat();
    let twice = |count: u16| [count.to_le_bytes(), count.to_le_bytes()].concat();
    let whole = Hair::default().bytes();
    let cases: &[(&str, Vec<u8>, &[&str])] = &[
        ("nothing", vec![], &["header", "128 bytes", "only 0"]),
        ("one byte", whole[..1].to_vec(), &["header", "128 bytes", "only 1"]),
        ("the magic", whole[..4].to_vec(), &["header", "128 bytes", "only 4"]),
        ("most of the header", whole[..127].to_vec(), &["header", "128 bytes", "only 127"]),
        ("the header", whole[..128].to_vec(), &["points array", "48 bytes", "offset 128", "only 0"]),
        ("a point", whole[..140].to_vec(), &["points array", "48 bytes", "offset 128", "only 12"]),
        ("all but a byte", whole[..175].to_vec(), &["points array", "48 bytes", "offset 128", "only 47"]),
        ("garbage", (0..=255).collect(), &["not a .hair file", "00, 01, 02, 03", "\"HAIR\""]),
        ("text", b"[film]\nwidth = 16\n".to_vec(), &["not a .hair file", "\"HAIR\""]),
        (
            "four gigabytes of points",
            Hair { strands: 1, points: 0x1555_5555, segments: 0x1555_5554, ..Hair::default() }.bytes(),
            &["points array", "4294967292 bytes", "only 48"],
        ),
        (
            "four billion strands",
            Hair { strands: u32::MAX, points: u32::MAX, segments: 0, ..Hair::default() }.bytes(),
            &["points array", "51539607540 bytes", "only 48"],
        ),
        (
            "four billion counts",
            Hair { strands: u32::MAX, flags: 3, ..Hair::default() }.bytes(),
            &["segments array", "8589934590 bytes", "only 48"],
        ),
        ("a point too many", Hair { points: 5, ..Hair::default() }.bytes(), &["5 points", "make 4"]),
        (
            "a segment too many",
            Hair { flags: 3, body: [twice(2), floats(&POINTS.concat())].concat(), ..Hair::default() }.bytes(),
            &["4 points", "make 6"],
        ),
        ("no strands", Hair { strands: 0, points: 0, ..Hair::default() }.bytes(), &["no strands"]),
        ("no points", Hair { flags: 0, ..Hair::default() }.bytes(), &["no points array", "flags 0x0"]),
        ("unknown flags", Hair { flags: 0x22, ..Hair::default() }.bytes(), &["0x22", "0x1f"]),
        (
            "a point that is no number",
            Hair { body: floats(&[a, b, c, [1.0, nan, 0.0]].concat()), ..Hair::default() }.bytes(),
            &["point 1 of strand 1", "NaN", "not finite"],
        ),
        (
            "a point at infinity",
            Hair { body: floats(&[a, [f32::INFINITY, 0.0, 0.0], c, d].concat()), ..Hair::default() }.bytes(),
            &["point 1 of strand 0", "inf", "not finite"],
        ),
        (
            "a negative width",
            Hair { flags: 6, body: widths([0.1, 0.1, -0.1, 0.1]), ..Hair::default() }.bytes(),
            &["point 0 of strand 1", "-0.1", "finite and >= 0"],
        ),
        (
            "a width that is no number",
            Hair { flags: 6, body: widths([0.1, nan, 0.1, 0.1]), ..Hair::default() }.bytes(),
            &["point 1 of strand 0", "NaN", "finite and >= 0"],
        ),
        (
            "a negative default width",
            Hair { thickness: -1.0, ..Hair::default() }.bytes(),
            &["default thickness is -1", "finite and >= 0"],
        ),
        ("no length at all", Hair { body: floats(&[0.0; 12]), ..Hair::default() }.bytes(), &["zero length"]),
    ];
    desk.write("of-file.toml", SCENE.replace(&procedural_line(), "file = \"bad.hair\""));
    for (what, bytes, says) in cases {
        desk.write("bad.hair", bytes);
        let says = [*says, &["bad.hair"]].concat();
        let begin = Instant::now();
        desk.refuse(&[("render --groom bad.hair", &says), ("render of-file.toml", &says)]);
        // Milliseconds, in truth; gigabytes would take longer than this.
        assert!(begin.elapsed() < Duration::from_secs(20), "{what} took {:?}", begin.elapsed());
        if *what != "no length at all" {
            desk.refuse(&[("info bad.hair", &says)]);
        }
    }
    desk.write("groom.abc", whole);
    fs::create_dir(desk.path("folder.hair")).unwrap();
    desk.refuse(&[
        ("render --groom missing.hair", &["missing.hair", "No such file or directory"]),
        ("render --groom missing.hair --up y", &["missing.hair", "No such file or directory"]),
        ("render --groom groom.abc", &["groom.abc", ".hair", "\"abc\""]),
        ("render --groom folder.hair", &["folder.hair", "it is a folder"]),
        ("info missing.hair", &["missing.hair", "No such file or directory"]),
        ("info tiny.toml", &["tiny.toml", ".hair", "\"toml\""]),
    ]);
}

#[test]
fn damaged_meshes_are_refused() {
    let desk = desk();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let cases: &[(&str, String, &[&str])] = &[
        ("bad.obj", format!("{corners}f 1 2 4\n"), &["faces do not fit", "out of bounds"]),
        ("bad.obj", format!("{corners}f 0 1 2\n"), &["faces do not fit", "out of bounds"]),
        ("bad.obj", format!("{corners}f 1 2 99999999999999999999\n"), &["line 4", "f 1 2 99999999999999999999"]),
        ("bad.obj", "v 0 0 0\nv 1 zero 0\n".into(), &["line 2", "v 1 zero 0"]),
        ("bad.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".into(), &["vertex 0", "not finite"]),
        ("bad.obj", String::new(), &["no triangles"]),
        ("bad.ply", ply.replace("3 0 1 2", "3 0 1 7"), &["vertex 7", "only 3"]),
        ("bad.ply", ply.replace("vertex 3", "vertex 400000000"), &["400000000 of \"vertex\"", "only"]),
        ("bad.ply", ply.replace("float z", "float w"), &["no element \"vertex\" with x, y and z"]),
        ("bad.ply", "stl".into(), &["PLY"]),
        ("bad.stl", "solid".into(), &[".obj or .ply", "\"stl\""]),
    ];
    for (name, text, says) in cases {
        desk.write(name, text);
        desk.write("mesh.toml", format!("{SCENE}\n[[mesh]]\nfile = \"{name}\"\n"));
        let says = [*says, &["mesh.toml: line 23, column 8", *name]].concat();
        desk.refuse(&[("render mesh.toml", &says)]);
    }
    desk.write("two.hair", Hair::default().bytes());
    desk.refuse(&[("render --groom two.hair --head missing.obj", &["missing.obj", "No such file or directory"])]);
}

#[test]
fn environments_that_are_no_light_are_refused() {
    let desk = desk();
    for (name, odd) in [("nan.exr", f32::NAN), ("minus.exr", -1.0), ("inf.exr", f32::INFINITY)] {
        let pixels = vec![Rgb::white(), Rgb::white(), Rgb::new(1.0, odd, 1.0), Rgb::white()];
        film::write_image_exr(desk.path(name), &Image::new(2, 2, pixels, None).unwrap()).unwrap();
    }
    let sky = Image::new(8, 4, vec![Rgb::white(); 32], None).unwrap();
    film::write_image_exr(desk.path("cut.exr"), &sky).unwrap();
    let bytes = fs::read(desk.path("cut.exr")).unwrap();
    desk.write("cut.exr", &bytes[..bytes.len() - 9]);
    desk.write("cut.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 10 +X 20\n\x02\x02");
    desk.write("vast.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999999 +X 99999999\n");
    desk.write("lie.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2000 +X 60000\n");
    desk.write("garbage.hdr", (0..=255).collect::<Vec<u8>>());
    desk.write("sky.jpg", "jpeg");
    let cases: &[(&str, &[&str])] = &[
        ("nan.exr", &["1 texels", "NaN", "column 0, row 1"]),
        ("minus.exr", &["1 texels", "-1", "column 0, row 1"]),
        ("inf.exr", &["1 texels", "inf", "column 0, row 1"]),
        ("cut.exr", &["OpenEXR"]),
        ("cut.hdr", &["Radiance HDR"]),
        ("vast.hdr", &["99999999 x 99999999", "65536"]),
        ("lie.hdr", &["Radiance HDR"]),
        ("garbage.hdr", &["Radiance HDR", "#?"]),
        ("sky.jpg", &[".exr, .hdr", "\"jpg\""]),
        ("missing.hdr", &["No such file or directory"]),
    ];
    for (name, says) in cases {
        desk.write("sky.toml", SCENE.replace("radiance = 0.5", &format!("file = \"{name}\"")));
        let says = [*says, &["sky.toml: line 10, column 8", *name]].concat();
        desk.refuse(&[("render sky.toml", &says)]);
    }
}

#[test]
fn fiber_eval_names_the_line_and_keeps_what_was_answered() {
    let desk = desk();
    let good = r#"{"theta_k":0.1,"theta_s":0.2,"phi":1.0,"h":0.3}"#;
    let cases: &[(&str, String, &[&str])] = &[
        ("lambertian", good.replace("phi", "phy"), &["`phy`", "`phi`"]),
        ("lambertian", good.replace(",\"phi\":1.0", ""), &["`phi`"]),
        ("lambertian", "garbage".into(), &["expected value"]),
        ("lambertian", "{".into(), &["EOF"]),
        ("lambertian", good.replace("1.0", "1e999"), &["out of range"]),
        ("lambertian", good.replace("0.1", "2"), &["theta_k is 2", "-pi/2 and pi/2"]),
        ("lambertian", good.replace("0.3", "1.5"), &["h is 1.5", "between -1 and 1"]),
        ("lambertian", good.replace('{', "{\"params\":{\"kd\":-1},"), &["kd", "-1", "must not be negative"]),
        ("chiang", good.replace(",\"h\":0.3", ""), &["needs \"h\""]),
        ("chiang", good.replace('{', "{\"params\":{\"beta_m\":0},"), &["beta_m is 0", "greater than 0"]),
        ("chiang", good.replace('{', "{\"params\":{\"betaM\":1},"), &["`betaM`", "`beta_m`"]),
        ("chiang", good.replace('{', "{\"params\":{\"eta\":1e308},"), &["eta is 1000", "between 1 and 3"]),
    ];
    for (model, bad, says) in cases {
        // The empty line counts as a line and has no answer.
        let answer = desk.feed(["fiber", "eval", "--model", *model], format!("{good}\n\n{bad}\n{good}\n").as_bytes());
        assert_eq!(answer.out.lines().count(), 1, "{bad}: what came before is answered, what follows is not");
        let says = [*says, &["line 3 of standard input"]].concat();
        answer.assert_refused(&says);
    }
    let answer = desk.feed(["fiber", "eval", "--model", "lambertian"], b"\xff\xfe\n");
    answer.assert_refused(&["line 1 of standard input", "UTF-8"]);
}

#[test]
fn pictures_that_cannot_be_compared_are_refused() {
    let desk = desk();
    let image = |width, pixels| Image::new(width, 1, pixels, None).unwrap();
    film::write_image_exr(desk.path("a.exr"), &image(2, vec![Rgb::white(); 2])).unwrap();
    film::write_image_exr(desk.path("wide.exr"), &image(3, vec![Rgb::white(); 3])).unwrap();
    film::write_image_exr(desk.path("nan.exr"), &image(2, vec![Rgb::white(), Rgb::splat(f32::NAN)])).unwrap();
    desk.write("garbage.exr", (0..=255).collect::<Vec<u8>>());
    desk.refuse(&[
        ("compare a.exr missing.exr", &["missing.exr", "No such file or directory"]),
        ("compare a.exr wide.exr", &["2x1", "3x1"]),
        ("compare a.exr nan.exr", &["reference", "not finite", "(1, 0)"]),
        ("compare nan.exr a.exr --max-relmse 1", &["test", "not finite", "(1, 0)"]),
        ("compare a.exr garbage.exr", &["garbage.exr", "OpenEXR"]),
        ("compare a.exr tiny.toml", &["tiny.toml", ".exr, .hdr and .png", "\"toml\""]),
        ("compare a.exr a.exr --scale nan", &["--scale", "finite"]),
        ("compare a.exr a.exr -o no/such/d.png", &["no/such", "No such file or directory"]),
    ]);
}

/// Ctrl-C ends a render, and what was rendered until then is kept.
#[cfg(unix)]
#[test]
fn an_interrupt_writes_what_is_there() {
    use std::io::{BufRead as _, BufReader};
    use std::sync::mpsc::{self, RecvTimeoutError};

    let desk = desk();
    let mut child = desk
        .command()
        .args(["render", "tiny.toml", "--size", "64x64", "--samples", "1048576", "-o", "o.exr"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let stderr = child.stderr.take().unwrap();
    let (sender, lines) = mpsc::channel();
    let reader = std::thread::spawn(move || {
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            // Nobody listens any more once the test has failed.
            let _ = sender.send(line);
        }
    });
    let mut said = String::new();
    while !said.contains("64 x 64") {
        said += &lines.recv_timeout(Duration::from_secs(60)).expect("the scene is announced");
    }
    // Into the middle of it: the handler and the first passes take milliseconds, the whole takes minutes.
    let middle = Instant::now() + Duration::from_secs(1);
    while let Ok(line) = lines.recv_timeout(middle.saturating_duration_since(Instant::now())) {
        said = said + &line + "\n";
    }
    let id = child.id().to_string();
    assert!(Command::new("sh").args(["-c", "kill -INT \"$0\"", &id]).status().unwrap().success());

    loop {
        match lines.recv_timeout(Duration::from_secs(60)) {
            Ok(line) => said = said + &line + "\n",
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                let _ = child.kill();
                panic!("still running a minute after the interrupt:\n{said}");
            }
        }
    }
    reader.join().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "128 + SIGINT, as shells count it:\n{said}");
    assert!(said.contains("stopped early"), "{said}");
    for name in ["o.exr", "o.png"] {
        let image = desk.image(name);
        assert_eq!((image.width, image.height), (64, 64), "{name}");
        assert!(image.pixels.iter().any(|pixel| pixel.luminance() > 0.0), "{name} has light in it");
    }
    assert_eq!(desk.names(), ["o.exr", "o.png", "tiny.toml"], "nothing temporary is left");
}

/// Paths on Unix are bytes; a picture of a file with an old name is a picture.
#[cfg(target_os = "linux")]
#[test]
fn paths_need_not_be_utf8() {
    use std::os::unix::ffi::OsStrExt as _;
    let desk = desk();
    let [scene, groom, output] =
        [&b"sc\xe8ne.toml"[..], b"m\xe8che.hair", b"im\xe8ge.exr"].map(|bytes| Path::new(OsStr::from_bytes(bytes)));
    fs::write(desk.path("").join(scene), SCENE).unwrap();
    fs::write(desk.path("").join(groom), Hair::default().bytes()).unwrap();

    let answer = desk.run([OsStr::new("render"), scene.as_os_str(), OsStr::new("-o"), output.as_os_str()]);
    assert_eq!(answer.code, Some(0), "{}", answer.err);
    assert_eq!(film::image::read(desk.path("").join(output)).unwrap().width, 16);
    let answer = desk.run([OsStr::new("info"), groom.as_os_str()]);
    assert_eq!(answer.code, Some(0), "{}", answer.err);
    let missing = desk.run([OsStr::new("info"), OsStr::from_bytes(b"n\xe8.hair")]);
    missing.assert_refused(&[".hair", "No such file or directory"]);
    // Whether a groom of that name can be rendered is another matter: it passes through a scene, which is text.
    let answer = desk.run([OsStr::new("render"), OsStr::new("--groom"), groom.as_os_str(), OsStr::new("--size=8x8")]);
    if answer.code != Some(0) {
        answer.assert_refused(&["UTF-8"]);
    }
    let wrong = desk.run([OsStr::new("render"), OsStr::new("--set"), OsStr::from_bytes(b"scene.name=\xff")]);
    wrong.assert_refused(&["UTF-8"]);
}

// --- what first trials found wrong ------------------------------------------------------------------------------

/// A picture that could not be written was once rendered all the same, and then lost.
#[test]
fn names_that_no_file_can_have_are_refused_before_rendering() {
    let desk = desk();
    desk.write("file.exr", OLD);
    for name in ["new.exr/".to_owned(), "file.exr/".to_owned(), "x".repeat(300) + ".exr", ".exr".to_owned()] {
        let args = ["render", "tiny.toml", "-o", &name];
        desk.refuse_args(&args, &[&name[..name.len().min(40)]]);
        assert!(!desk.run(args).err.contains("16 x 16"), "{name} was refused after rendering");
    }
}

/// The difference was once written under any name, that of a compared picture included.
#[test]
fn compare_writes_png_and_never_over_what_it_compares() {
    let desk = desk();
    desk.good("render tiny.toml -o a.exr");
    desk.refuse(&[
        ("compare a.exr a.exr -o d.jpg", &["d.jpg", ".png"]),
        ("compare a.exr a.exr -o a.exr", &["a.exr", ".png"]),
        ("compare a.png a.exr -o a.png", &["a.png"]),
        ("compare a.exr a.exr --flip-map f.exr", &["f.exr", ".png"]),
    ]);
}

/// Every comparison with NaN is false, so that this limit once passed all pictures.
#[test]
fn limits_of_a_comparison_are_numbers() {
    let desk = desk();
    desk.good("render tiny.toml -o a.exr");
    desk.refuse(&[
        ("compare a.exr a.exr --max-relmse nan", &["--max-relmse", "NaN"]),
        ("compare a.exr a.exr --max-relmse=-1", &["--max-relmse", "-1"]),
        ("compare a.exr a.exr --exposure 1e30", &["--exposure"]),
    ]);
}

/// An EXR of a few hundred bytes once had its word taken for gigabytes of pixels.
#[test]
fn a_lying_exr_costs_no_memory() {
    let desk = desk();
    desk.write("lie.exr", bare_exr(16_384, 8_192));
    desk.write("sky.toml", SCENE.replace("radiance = 0.5", "file = \"lie.exr\""));
    desk.refuse(&[("render sky.toml", &["lie.exr"]), ("compare lie.exr lie.exr", &["lie.exr"])]);
}

/// What is no ordinary file has no length, and was once read until memory ended.
#[cfg(target_os = "linux")]
#[test]
fn endless_files_are_refused() {
    let desk = desk();
    desk.write("two.hair", Hair::default().bytes());
    // Kept apart from what the desk watches: reading it would take forever too.
    let apart = tempfile::tempdir().unwrap();
    for ending in ["toml", "hair", "obj", "ply"] {
        let path = apart.path().join(format!("zero.{ending}"));
        std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
        let before = match ending {
            "toml" => &["render"][..],
            "hair" => &["render", "--groom"],
            _ => &["render", "--groom", "two.hair", "--head"],
        };
        let answer = Answer::of(frugal(&desk.command()).args(before).arg(&path));
        answer.assert_refused(&[&format!("zero.{ending}")]);
        assert!(!answer.err.contains("out of memory"), "{}", answer.err);
    }
}

/// A groom alone has a scene made for it; complaints once gave lines of that text, which nobody has seen.
#[test]
fn complaints_about_a_groom_alone_speak_of_what_was_given() {
    let desk = desk();
    let [a, _, c, d] = POINTS;
    desk.write("two.hair", Hair::default().bytes());
    desk.write("flat.hair", Hair { body: floats(&[0.0; 12]), ..Hair::default() }.bytes());
    desk.write("far.hair", Hair { body: floats(&[a, [0.0, 3e38, 0.0], c, d].concat()), ..Hair::default() }.bytes());
    desk.write("ones.hair", Hair { points: 2, segments: 0, body: floats(&[a, c].concat()), ..Hair::default() }.bytes());
    desk.write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
    let cases: Refusals<'_> = &[
        ("render --groom flat.hair", &["flat.hair", "zero length"]),
        ("render --groom far.hair", &["far.hair"]),
        ("render --groom ones.hair", &["ones.hair", "single point"]),
        ("render --groom two.hair --head missing.obj", &["missing.obj"]),
        ("render --groom two.hair --head bad.obj", &["bad.obj"]),
        ("render --groom two.hair --env missing.hdr", &["missing.hdr"]),
        ("render --groom two.hair --elevation 95", &["95", "89"]),
        ("render --groom two.hair --azimuth nan", &["--azimuth"]),
    ];
    desk.refuse(cases);
    for (line, _) in cases {
        let said = desk.run(line.split_whitespace()).err;
        assert!(!said.contains("line "), "cuticle {line}\n{said}");
    }
}

/// Whoever writes scenes need not know Rust.
#[test]
fn wrong_types_are_named_in_words() {
    let desk = desk();
    for set in [
        "film.width=wide",
        "film.width=-1",
        "film.width=1.5",
        "film=8",
        "groom=3",
        "look.main=3",
        "render.samples=true",
    ] {
        let said = desk.run(["render", "tiny.toml", "--set", set]).err;
        assert!(said.contains(set), "{said}");
        for word in ["u32", "i128", "f64", "struct", "Section", "sequence"] {
            assert!(!said.contains(word), "`{word}` in {said}");
        }
    }
    let line = r#"{"params":{"sigma_a":"much"},"theta_k":0.1,"theta_s":0.2,"phi":1.0,"h":0.3}"#;
    let answer = desk.feed(["fiber", "eval", "--model", "chiang"], line.as_bytes());
    answer.assert_refused(&["line 1 of standard input"]);
    assert!(!answer.err.contains("untagged"), "{}", answer.err);
}

/// A number below zero was once taken for a flag.
#[test]
fn numbers_below_zero_are_refused_as_numbers() {
    let desk = desk();
    for (flag, value) in
        [("--samples", "-1"), ("--seed", "-1"), ("--threads", "-1"), ("--time", "-1"), ("--size", "-1x5")]
    {
        let answer = desk.run(["render", "tiny.toml", flag, value]);
        answer.assert_refused(&[flag, value]);
        assert!(!answer.err.contains("unexpected argument"), "{}", answer.err);
    }
}

// --- the desk ---------------------------------------------------------------------------------------------------

/// A desk with [`SCENE`] as `tiny.toml` and old pictures.
fn desk() -> Desk {
    let complete = |args: &mut Vec<&str>| {
        if args.first() == Some(&"render") && !args.iter().any(|arg| ["-o", "--output"].contains(arg)) {
            args.extend(["-o", "o.exr"]);
        }
    };
    Desk::new(&[], complete, &[("tiny.toml", SCENE.as_bytes()), ("o.exr", OLD), ("o.png", OLD)])
}

/// The answers of `fiber eval`.
fn eval(desk: &Desk, model: &str, lines: &str) -> Vec<Value> {
    let answer = desk.feed(["fiber", "eval", "--model", model], lines.as_bytes());
    assert_eq!((answer.code, answer.err.as_str()), (Some(0), ""));
    answer.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

// --- files to read ----------------------------------------------------------------------------------------------

/// Two strands of two points.
const POINTS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [1.0, -1.0, 0.0]];

/// A `.hair` file, field by field, so that each can lie.
struct Hair {
    strands: u32,
    points: u32,
    flags: u32,
    segments: u32,
    thickness: f32,
    /// All that follows the header.
    body: Vec<u8>,
}

impl Default for Hair {
    fn default() -> Self {
        Self { strands: 2, points: 4, flags: 2, segments: 1, thickness: 0.01, body: floats(&POINTS.concat()) }
    }
}

impl Hair {
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = b"HAIR".to_vec();
        for word in [self.strands, self.points, self.flags, self.segments] {
            bytes.extend(word.to_le_bytes());
        }
        // Thickness, transparency, colour; then a text that is left empty.
        bytes.extend(floats(&[self.thickness, 0.0, 1.0, 1.0, 1.0]));
        bytes.resize(128, 0);
        bytes.extend(&self.body);
        bytes
    }
}

/// The header of an uncompressed EXR, and nothing of what it promises.
fn bare_exr(width: i32, height: i32) -> Vec<u8> {
    let mut bytes: Vec<u8> = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        for text in [name, kind] {
            bytes.extend(text.as_bytes());
            bytes.push(0);
        }
        bytes.extend((value.len() as u32).to_le_bytes());
        bytes.extend(value);
    };
    let window: Vec<u8> = [0, 0, width - 1, height - 1].into_iter().flat_map(i32::to_le_bytes).collect();
    // Name, 32-bit float, linearity and padding, sampling of one in both directions; an empty name ends the list.
    let channel = |name: u8| [name, 0, 2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0];
    attribute("channels", "chlist", &[&[b'B', b'G', b'R'].map(channel).concat()[..], &[0]].concat());
    attribute("compression", "compression", &[0]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &floats(&[1.0]));
    attribute("screenWindowCenter", "v2f", &floats(&[0.0, 0.0]));
    attribute("screenWindowWidth", "float", &floats(&[1.0]));
    bytes.push(0);
    // A few places where lines would be.
    bytes.resize(bytes.len() + 64, 0);
    bytes
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// The line of [`SCENE`] that grows its hair.
fn procedural_line() -> String {
    SCENE.lines().find(|line| line.starts_with("procedural")).unwrap_or_default().to_owned()
}
