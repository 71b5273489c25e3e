//! `cuticle preview` as people use it: pictures by every technique, reports of what they cost, and what it says of
//! bad input.
//!
//! All that draws needs a graphics adapter; a software one will do. Without any these tests fail with what to install.
//! Refusals that need no adapter run with little memory, and must leave the folder as it was.

mod desk;

use desk::Desk;
use film::{Image, View};
use math::Rgb;
use serde_json::Value;

/// Two thick hairs on a ball, with a sky that is not seen and a sun.
const SCENE: &str = r#"[film]
width = 16
height = 16

[[light]]
type = "environment"
radiance = 0.5
visible = false

[[light]]
type = "distant"
direction = [0.3, -1.0, -0.6]
irradiance = 2.0

[[groom]]
procedural = { preset = "fur", strands = 2, points = 2, guides = 1, clumps = 1, ellipsoid = { radii = [1.0, 1.0, 1.0] } }
width = { diameter_um = 1200.0 }
look = "main"

[look.main]
model = "deon"
eumelanin = 0.3
"#;

/// What stands in `o.exr`, `o.png` and `o.json` before a command that must not touch them.
const OLD: &[u8] = b"an older file";

// --- good input -------------------------------------------------------------------------------------------------

#[test]
fn a_preview_is_a_picture_with_its_price() {
    let desk = desk();
    let answer = desk.good("tiny.toml -o new.exr --report new.json");
    assert!(answer.err.contains("2 strands, 16 x 16 pixels"), "{}", answer.err);
    assert!(answer.err.contains("wrote new.exr and new.png and new.json"), "{}", answer.err);
    let (exr, png) = (desk.image("new.exr"), desk.image("new.png"));
    assert_eq!(((exr.width, exr.height), (png.width, png.height)), ((16, 16), (16, 16)));
    assert_lit(&exr, "new.exr");
    assert_lit(&png, "new.png");
    let alpha = exr.alpha.expect("an EXR keeps the coverage");
    assert!(alpha.iter().any(|a| *a > 0.0) && alpha.contains(&0.0), "hair covers a part of the picture: {alpha:?}");
    for (pixel, alpha) in exr.pixels.iter().zip(&alpha) {
        // Nothing but hair can be seen.
        assert!(*alpha > 0.0 || *pixel == Rgb::black(), "{pixel:?} where nothing is");
    }
    let names = ["new.exr", "new.json", "new.png", "o.exr", "o.json", "o.png", "tiny.toml"];
    assert_eq!(desk.names(), names, "and nothing else");

    let report = json(&desk, "new.json");
    assert_eq!(report["size"], serde_json::json!([16, 16]));
    assert_eq!(report["settings"]["shadow"], "dom");
    assert_eq!(report["settings"]["transparency"], "dbk");
    assert_eq!(report["fragments"]["dropped"], 0);
    assert!(report["attempts"].as_u64() >= Some(1) && report["wall_ms"].as_f64() > Some(0.0), "{report}");
    let adapter = report["adapter"]["name"].as_str().unwrap();
    assert!(answer.err.lines().any(|line| line.starts_with("on ") && line.contains(adapter)), "{}", answer.err);
    let notes = report["notes"].as_array().unwrap();
    assert!(!notes.is_empty(), "the environment became something else");
    for note in notes {
        let line = format!("note: {}", note.as_str().unwrap());
        assert!(answer.err.lines().any(|said| said == line), "{line} in {}", answer.err);
    }
}

/// The table for people, JSON and CSV are three ways to say the same.
#[test]
fn every_form_of_a_report_holds_every_pass_and_buffer() {
    let desk = desk();
    let flags = "tiny.toml -o a.png --transparency a-buffer";
    let out = desk.good(&format!("{flags} --report a.json")).out;
    let report = json(&desk, "a.json");
    let parts = |list: &str, name: &str| -> Vec<[String; 2]> {
        let entries = report[list].as_array().unwrap();
        entries.iter().map(|entry| ["part", name].map(|key| entry[key].as_str().unwrap().to_owned())).collect()
    };
    let (passes, buffers) = (parts("spans", "pass"), parts("memory", "name"));
    assert!(passes.len() >= 3 && buffers.len() >= 3, "{report}");
    for span in report["spans"].as_array().unwrap() {
        // A device without timers has none.
        assert!(span["ms"].is_null() || span["ms"].as_f64() >= Some(0.0), "{span}");
    }
    assert!(report["memory"].as_array().unwrap().iter().all(|one| one["bytes"].is_u64()), "{report}");
    assert!(report["fragments"]["stored"].as_u64() > Some(0), "an A-buffer keeps fragments: {report}");

    let blocks: Vec<&str> = out.split("\n\n").collect();
    assert_eq!(blocks.len(), 3, "{out}");
    assert_eq!(rows(blocks[0]), passes, "{out}");
    assert_eq!(rows(blocks[1]), buffers, "{out}");
    let stored = &report["fragments"]["stored"];
    assert!(blocks[2].starts_with(&format!("fragments stored {stored}, dropped 0")), "{out}");
    let adapter = report["adapter"]["name"].as_str().unwrap();
    let last = blocks[2].lines().last().unwrap();
    assert!(last.starts_with("16 x 16 pixels, wall ") && last.contains(&format!("on {adapter} (")), "{out}");
    assert_eq!(last.contains("software"), report["adapter"]["software"] == true, "{out}");

    desk.good(&format!("{flags} --report a.csv"));
    let csv = desk.text("a.csv");
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("kind,part,name,value"));
    let (mut csv_passes, mut csv_buffers, mut csv_stored, mut frame) = (Vec::new(), Vec::new(), None, Vec::new());
    for line in lines {
        let fields = fields(line);
        let [kind, part, name, value] = fields.as_slice() else { panic!("{line}") };
        match kind.as_str() {
            "ms" => {
                assert!(value.is_empty() || value.parse::<f64>().unwrap() >= 0.0, "{line}");
                csv_passes.push([part.clone(), name.clone()]);
            }
            "bytes" => {
                value.parse::<u64>().unwrap();
                csv_buffers.push([part.clone(), name.clone()]);
            }
            "frame" => frame.push((name.clone(), value.clone())),
            _ if name == "stored" => csv_stored = value.parse().ok(),
            _ => assert_eq!((name.as_str(), value.as_str()), ("dropped", "0"), "{line}"),
        }
    }
    assert_eq!((csv_passes, csv_buffers, csv_stored), (passes, buffers, stored.as_u64()));
    let names: Vec<&str> = frame.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["adapter", "software", "width", "height", "wall_ms", "attempts"]);
    let software = report["adapter"]["software"].to_string();
    assert_eq!([&frame[0].1, &frame[1].1, &frame[2].1, &frame[3].1], [adapter, &software, "16", "16"]);
    assert!(frame[4].1.parse::<f64>().unwrap() > 0.0 && frame[5].1.parse::<u32>().unwrap() >= 1, "{frame:?}");
}

#[test]
fn every_technique_draws_the_hair() {
    let desk = desk();
    let cases: &[(&str, &[(&str, &str)])] = &[
        (
            "--shading kajiya-kay --shadow none --transparency opaque --lines",
            &[("shading", "kajiya-kay"), ("shadow", "none"), ("transparency", "opaque"), ("shape", "line")],
        ),
        (
            "--shading marschner --direct --shadow sm --shadow-filter none --transparency blend --sort pieces",
            &[("shading", "marschner"), ("source", "direct"), ("shadow", "sm"), ("sort", "pieces")],
        ),
        (
            "--shading sadeghi --shadow adsm --shadow-spacing 0.05 --transparency weighted --area-samples 2",
            &[("shading", "sadeghi"), ("shadow", "adsm"), ("transparency", "weighted")],
        ),
        (
            "--shading deon --table-size 16 --shadow osm --shadow-filter 5x5 --transparency a-buffer --k 4",
            &[("source", "tables"), ("shadow", "osm"), ("shadow_filter", "5x5"), ("transparency", "a-buffer-k")],
        ),
        (
            "--shading chiang --palette 4 --shadow-layers 0.1,1 --transparency k-plus --k 4 --forward --web",
            &[("shading", "chiang"), ("shadow", "dom"), ("transparency", "k-plus"), ("when", "forward")],
        ),
        (
            "--shading lambertian --no-multiple --transparency k-plus --k-form max-heap --subdivisions 2",
            &[("shading", "lambertian"), ("transparency", "k-plus-heap"), ("when", "deferred")],
        ),
        (
            "--shading hery --transparency subsets --k 3 --harmonics --supersample 2",
            &[("shading", "hery"), ("transparency", "subsets")],
        ),
        (
            "--shading fur --transparency dbk --shift 0.1 --strands 0.5 --environment-directions 3",
            &[("shading", "fur"), ("transparency", "dbk")],
        ),
    ];
    for (flags, named) in cases {
        desk.good(&format!("tiny.toml -o a.exr --report a.json {flags}"));
        let image = desk.image("a.exr");
        assert_eq!((image.width, image.height), (16, 16), "{flags}");
        assert_lit(&image, flags);
        let report = json(&desk, "a.json");
        for (key, word) in *named {
            assert_eq!(report["settings"][key], *word, "{flags}: {report}");
        }
    }
}

/// Flags reach the renderer: each of these pairs has a known relation.
#[test]
fn flags_do_what_they_say() {
    let desk = desk();
    let draw = |flags: &str| {
        desk.good(&format!("tiny.toml -o a.exr {flags}"));
        desk.image("a.exr")
    };
    for transparency in ["blend", "a-buffer", "dbk"] {
        let image = draw(&format!("--transparency {transparency} --opacity 0"));
        assert!(image.pixels.iter().all(|pixel| *pixel == Rgb::black()), "{transparency}: hair of opacity 0 is seen");
    }
    let none = draw("--no-multiple --shadow none");
    let faint = draw("--no-multiple --shadow-strength 0");
    for (a, b) in none.pixels.iter().zip(&faint.pixels) {
        // Pictures are read back in half precision, 2^-11; what comes before is single.
        assert!((0..3).all(|c| (a[c] - b[c]).abs() <= 1e-3 * a[c].abs() + 1e-6), "{a:?} and {b:?}");
    }
    assert_ne!(none, draw("--no-multiple --shadow none --shading lambertian"), "another model looks the same");
    let mean = |image: &Image| image.pixels.iter().map(|pixel| f64::from(pixel.luminance())).sum::<f64>();
    let black = draw("--no-multiple --shadow none --set look.main.eumelanin=20");
    assert!(mean(&black) < mean(&none), "more pigment, less light");
    let small = draw("--size 8x4 --supersample 3");
    assert_eq!((small.width, small.height), (8, 4));
}

#[test]
fn the_png_is_the_exr_developed() {
    let desk = desk();
    for (flags, view, exposure) in
        [("", View::Srgb, 0.0), ("--view filmic --set film.exposure_ev=1", View::Filmic, 1.0)]
    {
        desk.good(&format!("tiny.toml -o a.exr {flags}"));
        let (exr, png) = (desk.image("a.exr"), desk.image("a.png"));
        for (linear, shown) in exr.pixels.iter().zip(&png.pixels) {
            let wanted = view.to_display(*linear, exposure);
            for c in 0..3 {
                // Half a level of 8 bits, and the roundings of encoding twice.
                let found = film::encode_srgb(shown[c]);
                assert!((found - wanted[c]).abs() < 0.5 / 255.0 + 1e-4, "{flags}: {found} for {}", wanted[c]);
            }
        }
    }
}

#[test]
fn quiet_is_quiet_and_old_files_are_replaced() {
    let desk = desk();
    let answer = desk.good("tiny.toml -o o.exr --report o.json --quiet");
    assert_eq!(answer.out, "");
    for line in answer.err.lines() {
        let ours = ["on ", "note: ", "wrote "].iter().any(|begin| line.starts_with(begin));
        assert!(!ours && !line.contains("strands"), "{line}");
    }
    assert_eq!((desk.image("o.exr").width, desk.image("o.png").width), (16, 16));
    assert!(json(&desk, "o.json")["spans"].is_array());
}

#[test]
fn adapters_are_listed_and_chosen_by_name() {
    let desk = desk();
    let list = desk.good("--list-adapters").out;
    let first = list.lines().next().unwrap();
    // The name without what stands in brackets behind it.
    let name = first.split(" (").next().unwrap();
    assert!(name.len() > 1, "{list}");
    let answer = desk.run(["tiny.toml", "-o", "a.png", "--adapter", &name.to_uppercase()]);
    assert_eq!(answer.code, Some(0), "{}", answer.err);
    assert!(answer.err.lines().any(|line| line.starts_with("on ") && line.contains(name)), "{}", answer.err);

    let before = desk.files();
    let answer = desk.run(["tiny.toml", "-o", "o.exr", "--report", "o.json", "--adapter", "nonsense"]);
    answer.assert_refused(&["\"nonsense\"", "there are: ", name]);
    assert_eq!(answer.out, "");
    assert_eq!(desk.files(), before, "what was there is untouched");
}

#[test]
fn grooms_alone_and_meshes_alone_are_drawn() {
    let desk = desk();
    desk.write("two.hair", two_hairs());
    let answer = desk.good("--groom two.hair --size 8x6 --up z --azimuth -40 --elevation 20 -o a.exr");
    assert!(answer.err.contains("2 strands, 8 x 6 pixels"), "{}", answer.err);
    assert_lit(&desk.image("a.exr"), "--groom");
    let lights = SCENE.split("[[groom]]").next().unwrap();
    desk.write("bald.toml", format!("{lights}[[mesh]]\nbuiltin = \"head\"\n"));
    for transparency in ["dbk", "k-plus"] {
        let answer = desk.good(&format!("bald.toml -o b.exr --transparency {transparency}"));
        assert!(answer.err.contains("0 strands"), "{}", answer.err);
        assert_lit(&desk.image("b.exr"), transparency);
    }
}

#[test]
fn help_lists_the_techniques() {
    let help = desk().good("--help").out;
    for word in ["kajiya-kay", "adsm", "3x3", "k-plus", "max-heap", "--list-adapters", "--report", "--groom", "--set"] {
        assert!(help.contains(word), "{word} in {help}");
    }
}

// --- bad input --------------------------------------------------------------------------------------------------

#[test]
fn unknown_names_list_what_there_is() {
    desk().refuse(&[
        (
            "tiny.toml --shading phong",
            &["'phong'", "look, kajiya-kay, marschner, sadeghi, deon, chiang, lambertian, hery, fur"],
        ),
        ("tiny.toml --shadow vsm", &["'vsm'", "none, sm, adsm, osm, dom"]),
        ("tiny.toml --shadow-filter 7x7", &["'7x7'", "none, 3x3, 5x5"]),
        ("tiny.toml --transparency magic", &["'magic'", "opaque, blend, weighted, a-buffer, k-plus, dbk, subsets"]),
        ("tiny.toml --transparency k-plus --k-form tree", &["'tree'", "lock-free, max-array, max-heap"]),
        ("tiny.toml --transparency blend --sort pixels", &["'pixels'", "none, strands, pieces"]),
        ("tiny.toml --view raw", &["\"raw\"", "srgb, filmic or agx"]),
        ("tiny.toml --samples 4", &["--samples"]),
    ]);
}

#[test]
fn numbers_out_of_range_are_refused() {
    desk().refuse(&[
        ("tiny.toml --palette 0", &["the palette is 0", "1 to 256"]),
        ("tiny.toml --palette 257", &["the palette is 257", "1 to 256"]),
        ("tiny.toml --palette -1", &["--palette", "-1"]),
        ("tiny.toml --palette many", &["--palette", "'many'"]),
        ("tiny.toml --table-size 4", &["is 4", "8 to 512"]),
        ("tiny.toml --environment-directions 65", &["is 65", "1 to 64"]),
        ("tiny.toml --area-samples 0", &["is 0", "1 to 16"]),
        ("tiny.toml --shadow-size 8", &["is 8", "16 to 4096"]),
        ("tiny.toml --shadow-size 5000", &["is 5000", "16 to 4096"]),
        ("tiny.toml --shadow-strength 1.5", &["is 1.5", "0 to 1"]),
        ("tiny.toml --shadow-strength nan", &["NaN", "0 to 1"]),
        ("tiny.toml --shadow-alpha -0.1", &["is -0.1", "0 to 1"]),
        ("tiny.toml --shadow-strands 0", &["is 0", "above 0 and at most 1"]),
        ("tiny.toml --shadow-layers 0.5,0.2", &["[0.5, 0.2]", "rising"]),
        ("tiny.toml --shadow-layers 0.1,0.2,0.3,0.4,1", &["5 ends", "1 to 4"]),
        ("tiny.toml --shadow-layers 0.1,deep", &["--shadow-layers", "'deep'"]),
        ("tiny.toml --shadow-layers -0.5,1", &["is -0.5", "above 0"]),
        ("tiny.toml --shadow adsm --shadow-spacing 0", &["is 0", "above 0, scene units"]),
        ("tiny.toml --transparency k-plus --k 17", &["k is 17", "1 to 16"]),
        ("tiny.toml --transparency subsets --k 0", &["k is 0", "1 to 16"]),
        ("tiny.toml --shift -1", &["is -1", "at least 0"]),
        ("tiny.toml --shift thick", &["\"thick\"", "auto"]),
        ("tiny.toml --shift-opacity 1", &["is 1", "below 1"]),
        ("tiny.toml --subdivisions 17", &["is 17", "1 to 16"]),
        ("tiny.toml --strands 1.1", &["is 1.1", "above 0 and at most 1"]),
        ("tiny.toml --opacity -1", &["is -1", "0 to 1"]),
        ("tiny.toml --supersample 5", &["is 5", "1 to 4"]),
        ("tiny.toml --size 16", &["\"16\"", "1280x720"]),
    ]);
}

#[test]
fn flags_that_do_not_go_together_are_refused() {
    let desk = desk();
    desk.write("two.hair", two_hairs());
    desk.refuse(&[
        ("tiny.toml --transparency blend --k 4", &["--k", "a-buffer, k-plus or subsets", "not with blend"]),
        ("tiny.toml --k-form max-heap", &["--k-form", "k-plus", "not with dbk"]),
        ("tiny.toml --sort strands", &["--sort", "blend", "not with dbk"]),
        ("tiny.toml --transparency opaque --shift 1", &["--shift", "dbk", "not with opaque"]),
        ("tiny.toml --shift 1 --shift-opacity 0.5", &["--shift-opacity", "--shift auto"]),
        ("tiny.toml --transparency weighted --forward", &["--forward", "not with weighted"]),
        ("tiny.toml --direct --table-size 32", &["--table-size", "--direct"]),
        ("tiny.toml --shading fur --direct", &["--direct", "look, marschner, deon or chiang", "not with fur"]),
        ("tiny.toml --shadow none --shadow-size 64", &["--shadow-size", "sm, adsm, osm or dom", "not with none"]),
        ("tiny.toml --shadow sm --shadow-layers 0.5,1", &["--shadow-layers", "dom", "not with sm"]),
        ("tiny.toml --shadow-spacing 1", &["--shadow-spacing", "adsm", "not with dom"]),
        ("tiny.toml --groom two.hair", &["--groom", "cannot be used with"]),
        ("tiny.toml --up y", &["--groom"]),
        ("--groom two.hair --elevation 95", &["--elevation", "95", "89"]),
        ("tiny.toml --list-adapters", &["--list-adapters", "cannot be used with"]),
    ]);
}

#[test]
fn files_that_cannot_be_read_or_written_are_refused() {
    let desk = desk();
    std::fs::create_dir(desk.path("taken.json")).unwrap();
    desk.refuse(&[
        ("missing.toml", &["missing.toml", "No such file or directory"]),
        ("tiny.toml --set film.widht=8", &["`film.widht`", "did you mean `width`"]),
        ("tiny.toml -o a.jpg", &["a.jpg", ".exr or .png"]),
        ("tiny.toml -o no/such/a.png", &["no/such", "No such file or directory"]),
        ("tiny.toml --report a.txt", &["a.txt", ".json or .csv"]),
        ("tiny.toml --report a", &["cannot write a", ".json or .csv"]),
        ("tiny.toml --report no/such/a.json", &["no/such", "No such file or directory"]),
        ("tiny.toml --report taken.json", &["taken.json", "is a folder"]),
    ]);
}

/// Scenes may be larger than what a device has textures for.
#[test]
fn pictures_that_are_too_large_are_refused() {
    let desk = desk();
    let before = desk.files();
    let answer = desk.run("tiny.toml -o o.exr --size 9000x16 --supersample 4".split(' '));
    answer.assert_refused(&["36000 x 64", "sides must be 1 to"]);
    assert_eq!(desk.files(), before, "what was there is untouched");
}

// --- the desk ---------------------------------------------------------------------------------------------------

/// A desk with [`SCENE`] as `tiny.toml` and old files.
fn desk() -> Desk {
    let complete = |args: &mut Vec<&str>| {
        if !args.iter().any(|arg| ["-o", "--output"].contains(arg)) {
            args.extend(["-o", "o.exr"]);
        }
        if !args.contains(&"--report") && !args.contains(&"--list-adapters") {
            args.extend(["--report", "o.json"]);
        }
    };
    Desk::new(
        &["preview"],
        complete,
        &[("tiny.toml", SCENE.as_bytes()), ("o.exr", OLD), ("o.png", OLD), ("o.json", OLD)],
    )
}

fn json(desk: &Desk, name: &str) -> Value {
    serde_json::from_str(&desk.text(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Light, and nothing that is no light.
#[track_caller]
fn assert_lit(image: &Image, what: &str) {
    assert!(image.defects().is_empty(), "{what}: {:?}", image.defects());
    assert!(image.pixels.iter().any(|pixel| pixel.luminance() > 1e-3), "{what}: all is black");
}

/// Part and name of the rows of a block of the table; its header and its sum have neither.
fn rows(block: &str) -> Vec<[String; 2]> {
    let rows = block.lines().skip(1).filter(|line| !line.starts_with(' '));
    rows.map(|line| {
        let (part, rest) = line.split_once(' ').unwrap_or_else(|| panic!("{line:?}"));
        let (name, _) = rest.rsplit_once(' ').unwrap_or_else(|| panic!("{line:?}"));
        [part.to_owned(), name.trim().to_owned()]
    })
    .collect()
}

/// The fields of a line of CSV; none of ours has a quotation mark in it.
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut current, mut quoted) = (Vec::new(), String::new(), false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(std::mem::take(&mut current)),
            _ => current.push(c),
        }
    }
    fields.push(current);
    fields
}

/// A `.hair` file of two strands with two points each.
fn two_hairs() -> Vec<u8> {
    let mut bytes = b"HAIR".to_vec();
    // Strands, points, flags (points alone), segments of each strand.
    for word in [2_u32, 4, 2, 1] {
        bytes.extend(word.to_le_bytes());
    }
    // Thickness, transparency, colour; then a text that is left empty.
    for number in [0.05_f32, 0.0, 1.0, 1.0, 1.0] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.resize(128, 0);
    for number in [0.0_f32, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 1.0, -1.0, 0.0] {
        bytes.extend(number.to_le_bytes());
    }
    bytes
}
