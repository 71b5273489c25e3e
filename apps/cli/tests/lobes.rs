//! `cuticle lobes` as people use it: figures of looks and models as SVG and PNG, and what it says of bad input.
//!
//! Every refusal must end with exit code 1 or 2, say what was found and what would have been right, and leave the
//! folder as it was: no new file, no half of one, old figures intact.

mod desk;

use std::fs;

use desk::Desk;

/// Three looks. The groom is not there: for a look nobody has to read it.
const LOOKS: &str = r#"[[groom]]
file = "not-there.hair"
look = "half"

[look.half]
model = "lambertian"
albedo = 0.5

[look.glinting]
model = "marschner"
preset = "brown"
eccentricity = 0.9
longitudinal_roughness_deg = 10.0

[look.two]
model = "hery"
tint2 = [0.1, 0.2, 0.3]
"#;

/// What stands in `o.svg` and `o.png` before a command that must not touch them.
const OLD: &[u8] = b"an older figure";

/// Kinds of figures and what is written at them: title, axes with units, legend.
const KINDS: [(&str, &[&str]); 5] = [
    ("azimuth", &["Around the fiber", "towards k", "away from k", "90°", "∫ f cos θs dθs / rad−1, radius as its root"]),
    ("longitudinal", &["Along the fiber", "sampled inclination θs", "cos θs ∫ f dφ / rad−1", "specular cone"]),
    ("sphere", &["All directions", "azimuth φ = φs − φk", "sampled inclination θs", "f / sr−1"]),
    (
        "histogram",
        &["Sampler over its density", "sin θs", "drawn / expected", "density / deg−1", "2000 directions were drawn"],
    ),
    ("albedo", &["Albedo per channel", "Albedo per lobe", "known inclination θk", "albedo", "all that arrives"]),
];

// --- good input -------------------------------------------------------------------------------------------------

#[test]
fn every_kind_is_drawn_with_its_axes() {
    let desk = desk();
    for (kind, labels) in KINDS {
        desk.good(&format!(
            "plot --model lambertian --set kd=0.5 --kind {kind} --theta-i 30 --samples 2000 -o {kind}.svg"
        ));
        let drawn = drawn(&desk, &format!("{kind}.svg"));
        drawn.says(labels);
        drawn.says(&["lambertian", "known inclination θk = 30°", "mean over the offset h"]);
        for (other, others) in KINDS.iter().filter(|(other, _)| *other != kind) {
            assert!(!drawn.text.contains(others[0]), "{kind} shows {other}, too");
        }
    }
    assert_eq!(desk.names().len(), KINDS.len() + 3, "a file each and nothing else: {:?}", desk.names());
}

#[test]
fn kinds_can_be_put_together() {
    let desk = desk();
    let plot = "plot --model lambertian --samples 2000";
    desk.good(&format!("{plot} --kind all -o all.svg"));
    let all = drawn(&desk, "all.svg");
    for (_, labels) in KINDS {
        all.says(labels);
    }
    // Panels of one figure have letters.
    all.says(&["(a)", "(b)"]);
    desk.good(&format!("{plot} --kind azimuth,longitudinal,sphere,histogram,albedo -o listed.svg"));
    assert_eq!(desk.read("listed.svg"), desk.read("all.svg"));
    desk.good(&format!("{plot} --kind azimuth --kind all,azimuth -o twice.svg"));
    assert_eq!(desk.read("twice.svg"), desk.read("all.svg"), "what is asked for twice is drawn once");
    desk.good(&format!("{plot} -o usual.svg"));
    desk.good(&format!("{plot} --kind azimuth -o azimuth.svg"));
    assert_eq!(desk.read("usual.svg"), desk.read("azimuth.svg"));
}

#[test]
fn a_png_is_the_same_figure_in_pixels() {
    let desk = desk();
    desk.good("plot --model lambertian --kind longitudinal -o a.svg");
    let [width, height] = drawn(&desk, "a.svg").size;
    for (flags, name, columns) in [
        // Twice the figure's own, so that text is sharp.
        ("", "a.png", 2.0 * width),
        ("--width 100", "b.png", 100.0),
        ("--width 333", "c.PNG", 333.0),
    ] {
        desk.good(&format!("plot --model lambertian --kind longitudinal {flags} -o {name}"));
        let image = desk.image(name);
        assert_eq!(f64::from(image.width), columns, "{name}");
        let rows = columns * height / width;
        assert!((f64::from(image.height) - rows).abs() <= 1.0, "{name}: {} rows, not {rows}", image.height);
        // Ink on paper.
        let light = image.pixels.iter().filter(|pixel| pixel.luminance() > 0.99).count();
        let dark = image.pixels.iter().filter(|pixel| pixel.luminance() < 0.7).count();
        assert!(light > image.pixels.len() / 2 && dark > 50, "{name}: {light} light and {dark} dark pixels");
    }
}

#[test]
fn looks_are_found_by_name_and_the_only_one_without() {
    let desk = desk();
    for (look, model) in [("half", "lambertian"), ("glinting", "marschner"), ("two", "hery")] {
        desk.good(&format!("plot --look looks.toml:{look} --kind longitudinal -o {look}.svg"));
        drawn(&desk, &format!("{look}.svg")).says(&[look, &format!("model {model}")]);
    }
    desk.write("one.toml", "[look.alone]\nmodel = \"lambertian\"\nalbedo = 0.5\n");
    desk.good("plot --look one.toml --kind longitudinal -o alone.svg");
    // The same fiber under three names; 0.5 is a number of every precision.
    desk.good("plot --model lambertian --set kd=0.5 --kind longitudinal -o lambertian.svg");
    let named = |name: &str| String::from_utf8(desk.read(&format!("{name}.svg"))).unwrap().replace(name, "NAME");
    let plain = |name: &str| named(name).replace("lambertian", "NAME");
    assert_eq!(plain("alone"), plain("lambertian"));
    assert_eq!(plain("half"), plain("lambertian"));
    assert_ne!(plain("glinting"), plain("lambertian"));
    // Another folder, and a name with a dot.
    fs::create_dir(desk.path("more")).unwrap();
    desk.write("more/b.c.toml", LOOKS);
    desk.good("plot --look more/b.c.toml:half --kind longitudinal -o more/half.svg");
    assert_eq!(desk.read("more/half.svg"), desk.read("half.svg"));
}

#[test]
fn every_model_is_drawn_with_its_parameters() {
    let desk = desk();
    for (model, set) in [
        ("deon", "--set sigma_a=[0.1,0.3,0.8] --set beta_M=0.2"),
        ("chiang", "--set beta_m=0.2"),
        ("lambertian", "--set kd=0.5"),
        ("kajiya_kay", "--set ks=0.3 --set mode=thesis"),
        ("hery", "--set beta=0.1 --set mode=faithful --set cos_theta_d=true"),
        ("marschner", "--set a=0.9 --set smoothing=false"),
        ("sadeghi", "--set I_R=0.2 --set C_TT=[0.5,0.3,0.1]"),
        ("fur", "--set kappa=0.5 --set sigma_ms=2"),
    ] {
        let plot = format!("plot --model {model} --kind longitudinal --h 0.4");
        desk.good(&format!("{plot} -o usual.svg"));
        desk.good(&format!("{plot} {set} -o set.svg"));
        drawn(&desk, "set.svg").says(&[&format!("model {model}"), "sampled inclination θs", "offset h = 0.4"]);
        assert_ne!(desk.read("set.svg"), desk.read("usual.svg"), "{model} does not mind {set}");
    }
}

#[test]
fn the_view_and_the_seed_change_what_they_say() {
    let desk = desk();
    let plot = |flags: &str| {
        desk.good(&format!("plot --model chiang --samples 2000 {flags} -o a.svg"));
        drawn(&desk, "a.svg")
    };
    plot("--h 0.5 --theta-i -30").says(&["known inclination θk = −30°", "offset h = 0.5", "∫ f cos θs dθs / rad−1"]);
    plot("--h -0.5 --theta-i 12.5 --cone").says(&["θk = 12.5°", "offset h = −0.5", "on the specular cone", "f / sr−1"]);
    // Light that meets one side of a fiber does not leave as that which meets the other.
    assert_ne!(plot("--h 0.5").svg, plot("--h -0.5").svg.replace("−0.5", "0.5"));
    for (kind, differs) in [("histogram", true), ("azimuth", false)] {
        let plot = |seed: u32| plot(&format!("--h 0.2 --kind {kind} --seed {seed}")).svg;
        assert_eq!(plot(1), plot(1), "{kind}");
        assert_eq!(plot(1) != plot(2), differs, "{kind}");
    }
}

#[test]
fn a_sheet_has_parameters_and_all_plots() {
    let desk = desk();
    desk.good("sheet --look looks.toml:glinting --theta-i 20 --samples 2000 -o a.svg");
    let sheet = drawn(&desk, "a.svg");
    // The sheet leaves out the marginal over the inclination, which its longitudinal plot shows.
    for (_, labels) in KINDS {
        sheet.says(labels);
    }
    sheet.says(&["glinting", "model marschner, known inclination θk = 20°", "Parameters", "R", "TT", "TRT"]);
    for (name, value) in [("eccentricity", "0.9"), ("eta", "1.55"), ("beta_m", "0.1745 rad = 10°"), ("roots", "Exact")]
    {
        assert!(sheet.has_entry(name, value), "{name} is not {value} in\n{}", sheet.text);
    }
    desk.good("sheet --look looks.toml:two --samples 2000 -o b.svg");
    let sheet = drawn(&desk, "b.svg");
    for (name, value) in [("mode", "Truncated"), ("cos_theta_d", "false")] {
        assert!(sheet.has_entry(name, value), "{name} is not {value} in\n{}", sheet.text);
    }
    desk.good("sheet --model lambertian --samples 2000 --width 400 -o c.png");
    let page = desk.image("c.png");
    // About as A4, which is 1.41 times as high as wide.
    assert!(page.width == 400 && (480..680).contains(&page.height), "{} x {}", page.width, page.height);
}

#[test]
fn old_figures_are_replaced_and_nothing_is_said() {
    let desk = desk();
    let before = desk.names();
    for output in ["o.svg", "o.png"] {
        let answer = desk.good(&format!("plot --look looks.toml:half -o {output}"));
        assert_eq!((answer.out.as_str(), answer.err.as_str()), ("", ""));
    }
    drawn(&desk, "o.svg").says(&["half"]);
    assert!(desk.image("o.png").width > 100);
    assert_eq!(desk.names(), before, "nothing temporary stays");
}

#[test]
fn help_says_what_there_is() {
    let desk = desk();
    let help = desk.good("--help").out;
    assert!(help.contains("plot") && help.contains("sheet"), "{help}");
    for command in ["plot", "sheet"] {
        let help = desk.good(&format!("{command} --help")).out;
        let flags = [
            "--look",
            "--model",
            "--set",
            "--theta-i",
            "--h <H>",
            "--cone",
            "--samples",
            "--seed",
            "--output",
            "--width",
        ];
        for flag in flags {
            assert!(help.contains(flag), "{flag} in {help}");
        }
    }
    let help = desk.good("plot --help").out;
    for (kind, _) in KINDS {
        assert!(help.contains(kind), "{kind} in {help}");
    }
}

// --- bad input --------------------------------------------------------------------------------------------------

#[test]
fn commands_without_a_subject_or_with_two_are_refused() {
    desk().refuse(&[
        ("", &["plot", "sheet"]),
        ("draw", &["'draw'", "Usage"]),
        ("plot", &["--output <FILE>", "--look <FILE[:NAME]>"]),
        ("plot --frob -o o.svg", &["--frob", "--help"]),
        ("plot --kind azimuth", &["--look <FILE[:NAME]>"]),
        ("sheet", &["--look <FILE[:NAME]>"]),
        ("plot --model lambertian --look looks.toml:half", &["--model", "--look", "cannot be used with"]),
        // Parameters are those of a model; taken in silence they would be lost.
        ("plot --look looks.toml:half --set kd=1", &["--set", "--look", "cannot be used with"]),
        ("sheet --look looks.toml:half --set kd=1", &["--set", "--look", "cannot be used with"]),
        ("sheet --model lambertian --kind albedo", &["--kind"]),
    ]);
}

#[test]
fn unknown_names_are_refused_with_those_there_are() {
    let desk = desk();
    let models = "deon, chiang, lambertian, kajiya_kay, hery, marschner, sadeghi, fur";
    desk.write("nothing.toml", "[film]\nwidth = 16\n");
    desk.refuse(&[
        ("plot --model blinn", &["'blinn'", models]),
        ("sheet --model blinn", &["'blinn'", models]),
        ("plot --model lambertian --kind polar", &["'polar'", "azimuth, longitudinal, sphere, histogram, albedo, all"]),
        ("plot --model lambertian --kind azimuth,polar", &["'polar'", "azimuth, longitudinal"]),
        ("plot --look looks.toml:halve", &["looks.toml", "\"halve\"", "glinting, half, two"]),
        ("plot --look looks.toml", &["looks.toml", "glinting, half, two", "FILE:NAME"]),
        ("plot --look nothing.toml", &["nothing.toml", "no looks"]),
        ("plot --look nothing.toml:half", &["nothing.toml", "\"half\""]),
    ]);
}

#[test]
fn scenes_that_cannot_be_read_are_refused_with_their_place() {
    let desk = desk();
    desk.write("syntax.toml", "[look.a\n");
    desk.write("typo.toml", "[look.a]\nmodel = \"lambertian\"\nalbdo = 0.5\n");
    desk.write("range.toml", "[look.a]\nmodel = \"marschner\"\neccentricity = 0.5\n");
    desk.write("foreign.toml", "[look.a]\nmodel = \"sadeghi\"\nglint_strength = 2\n");
    desk.write("bytes.toml", (0..=255).collect::<Vec<u8>>());
    fs::create_dir(desk.path("folder.toml")).unwrap();
    desk.refuse(&[
        ("plot --look missing.toml", &["missing.toml", "No such file or directory"]),
        // The name is no part of the file that is missing.
        ("plot --look missing.toml:half", &["missing.toml: No such file or directory"]),
        ("sheet --look folder.toml", &["folder.toml", "it is a folder"]),
        ("sheet --look folder.toml:half", &["folder.toml", "it is a folder"]),
        ("plot --look bytes.toml", &["bytes.toml", "UTF-8"]),
        ("plot --look syntax.toml", &["syntax.toml: line 1", "expected `]`"]),
        ("plot --look typo.toml", &["typo.toml: line 3, column 1", "`look.a.albdo`", "did you mean `albedo`"]),
        ("plot --look range.toml:a", &["range.toml: line 3, column 16", "`look.a.eccentricity` is 0.5", "0.85 and 1"]),
        (
            "plot --look foreign.toml",
            &["foreign.toml: line 3, column 1", "`sadeghi` has no parameter `glint_strength`"],
        ),
    ]);
}

#[test]
fn outputs_that_cannot_be_written_are_refused() {
    let desk = desk();
    fs::create_dir(desk.path("folder.svg")).unwrap();
    desk.write("file", "not a folder");
    desk.refuse(&[
        ("plot --model lambertian -o a.pdf", &["a.pdf", ".svg or .png"]),
        ("sheet --model lambertian -o a.jpeg", &["a.jpeg", ".svg or .png"]),
        ("plot --model lambertian -o a", &["cannot write a:", ".svg or .png"]),
        ("plot --model lambertian -o ..", &["..", ".svg or .png"]),
        ("plot --model lambertian -o .svg", &[".svg", ".svg or .png"]),
        ("plot --model lambertian -o folder.svg", &["folder.svg", "it is a folder"]),
        ("sheet --model lambertian -o no/such/a.svg", &["no/such/a.svg", "there is no folder no/such"]),
        ("plot --model lambertian -o file/a.svg", &["file/a.svg", "there is no folder file"]),
        // Widths of pictures that are none, or larger than any.
        ("plot --model lambertian --width 300 -o o.svg", &["--width", ".png"]),
        ("plot --model lambertian --width 99 -o o.png", &["--width", "99", "100..=16384"]),
        ("plot --model lambertian --width 16385 -o o.png", &["--width", "16385", "100..=16384"]),
        ("plot --model lambertian --width -300 -o o.png", &["--width", "-300", "100..=16384"]),
        ("sheet --model lambertian --samples 2000 --width 16384 -o o.png", &["o.png", "16384", "between 1 and 16384"]),
    ]);
    desk.refuse_args(&["plot", "--model", "lambertian", "-o", ""], &["--output", "value"]);
}

#[test]
fn views_that_there_are_not_are_refused() {
    desk().refuse(&[
        // Along the fiber there is no azimuth.
        ("plot --model lambertian --theta-i 90", &["--theta-i is 90", "between -90 and 90"]),
        ("plot --model lambertian --theta-i -90", &["--theta-i is -90", "between -90 and 90"]),
        ("sheet --model lambertian --theta-i 91.5", &["--theta-i is 91.5", "between -90 and 90"]),
        ("plot --model lambertian --theta-i nan", &["--theta-i is NaN", "between -90 and 90"]),
        ("plot --model lambertian --theta-i inf", &["--theta-i is inf", "between -90 and 90"]),
        ("plot --model lambertian --theta-i steep", &["--theta-i", "'steep'"]),
        ("plot --model lambertian --h 1.01", &["--h is 1.01", "between -1 and 1"]),
        ("plot --model lambertian --h -2", &["--h is -2", "between -1 and 1"]),
        ("plot --model lambertian --h nan", &["--h is NaN", "between -1 and 1"]),
        ("plot --model lambertian --h edge", &["--h", "'edge'"]),
        ("plot --model lambertian --samples 0", &["--samples", "0 is not in 1..=100000000"]),
        ("plot --model lambertian --samples 100000001", &["--samples", "1..=100000000"]),
        ("plot --model lambertian --samples -1", &["--samples", "-1", "1..=100000000"]),
        ("plot --model lambertian --samples many", &["--samples", "'many'"]),
        ("plot --model lambertian --seed -1", &["--seed", "-1", "0..=4294967295"]),
        ("plot --model lambertian --seed 4294967296", &["--seed", "0..=4294967295"]),
    ]);
}

#[test]
fn parameters_that_make_no_sense_are_refused() {
    desk().refuse(&[
        ("plot --model lambertian --set kd", &["--set \"kd\"", "NAME=VALUE"]),
        ("plot --model lambertian --set =1", &["--set \"=1\"", "NAME=VALUE"]),
        ("plot --model lambertian --set kd=", &["--set \"kd=\"", "NAME=VALUE"]),
        ("plot --model lambertian --set =", &["--set \"=\"", "NAME=VALUE"]),
        ("plot --model lambertian --set kd=0.1 --set kd=0.2", &["--set", "kd twice"]),
        ("plot --model lambertian --set eta=1.5", &["unknown field `eta`", "`kd`"]),
        ("plot --model lambertian --set kd=-1", &["kd", "-1", "must not be negative"]),
        ("plot --model lambertian --set kd=much", &["a number or [red, green, blue]"]),
        ("plot --model lambertian --set kd=[1,2]", &["a number or [red, green, blue]"]),
        ("plot --model lambertian --set kd=[1,2", &["a number or [red, green, blue]"]),
        ("plot --model deon --set beta_M=0", &["beta_M is 0", "greater than 0"]),
        ("plot --model deon --set mode=thesis", &["unknown field `mode`", "`beta_M`"]),
        ("plot --model kajiya_kay --set mode=faithful", &["`faithful`", "`normalised`", "`thesis`"]),
        ("plot --model marschner --set roots=quartic", &["`quartic`", "`exact`", "`cubic`"]),
        ("sheet --model fur --set kappa=2", &["kappa is 2", "between 0 and 0.95"]),
    ]);
}

// --- the desk ---------------------------------------------------------------------------------------------------

/// A desk with [`LOOKS`] as `looks.toml` and old figures; what must be refused writes to `o.svg` unless told otherwise.
fn desk() -> Desk {
    let complete = |args: &mut Vec<&str>| {
        if args.len() > 1 && !args.contains(&"-o") {
            args.extend(["-o", "o.svg"]);
        }
    };
    Desk::new(&["lobes"], complete, &[("looks.toml", LOOKS.as_bytes()), ("o.svg", OLD), ("o.png", OLD)])
}

fn drawn(desk: &Desk, name: &str) -> Drawn {
    Drawn::new(desk.text(name))
}

/// An SVG file.
struct Drawn {
    svg: String,
    /// What can be read in it, an element a line.
    text: String,
    /// Width and height.
    size: [f64; 2],
}

impl Drawn {
    #[track_caller]
    fn new(svg: String) -> Self {
        assert!(svg.starts_with("<?xml") && svg.trim_end().ends_with("</svg>"), "{svg}");
        let text = text_of(&svg);
        let size = ["width", "height"].map(|name| {
            let found = svg.split_once(&format!(" {name}=\"")).and_then(|(_, rest)| rest.split_once('"'));
            found.and_then(|(number, _)| number.parse().ok()).unwrap_or_else(|| panic!("no {name}"))
        });
        Self { svg, text, size }
    }

    #[track_caller]
    fn says(&self, what: &[&str]) {
        // A long sentence goes on in the next line.
        let text = self.text.replace('\n', " ");
        for what in what {
            assert!(text.contains(what), "{what} is missing in\n{}", self.text);
        }
    }

    /// Whether the list of parameters has this one.
    fn has_entry(&self, name: &str, value: &str) -> bool {
        let lines: Vec<&str> = self.text.lines().filter(|line| !line.is_empty()).collect();
        lines.windows(2).any(|pair| pair == [name, value])
    }
}

/// What can be read in an SVG; checks on the way that elements close and that places are numbers.
#[track_caller]
fn text_of(svg: &str) -> String {
    let (mut text, mut open) = (String::new(), Vec::new());
    for part in svg.split('<').skip(1) {
        let (tag, behind) = part.split_once('>').unwrap_or_else(|| panic!("{part} has no end"));
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap_or_default();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "an element closes that is not open");
        } else if !tag.ends_with('/') && !tag.starts_with('?') {
            open.push(name);
        }
        // Pictures within are letters that may say anything.
        if !tag.contains("data:") {
            assert!(!tag.contains("NaN") && !tag.contains("inf"), "a place that is none: {tag}");
        }
        text += behind;
    }
    assert!(open.is_empty(), "{open:?} stay open");
    text
}
