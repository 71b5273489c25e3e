//! `cuticle measure` and `cuticle compare-renderers` as people use them: the list, pages with tables, and what they say
//! of bad input.
//!
//! What draws needs a graphics adapter; a software one will do. Without any these tests fail with what to install.

mod desk;

use desk::Desk;

const SCENE: &[u8] = b"[film]\nwidth = 32\nheight = 32\n[[light]]\ntype = \"distant\"\ndirection = [0.3, -0.5, -0.8]\n\
                       irradiance = 5.0\n[[groom]]\n\
                       procedural = { preset = \"short\", strands = 60 }\nlook = \"main\"\nwidth = { scale = 150.0 }\n\
                       [look.main]\npreset = \"brown\"\n";

/// A few thick hairs, matt and grey, in the light of one lamp: nothing for two renderers to differ about. The
/// exposure is not 1, so that a picture that was exposed shows.
const SPARSE: &[u8] = b"[film]\nwidth = 48\nheight = 48\nexposure_ev = 2.0\n[[light]]\ntype = \"distant\"\n\
                        direction = [0.3, -0.5, -0.8]\nirradiance = 1.0\n[[groom]]\n\
                        procedural = { preset = \"short\", strands = 12 }\nlook = \"main\"\nwidth = { scale = 150.0 }\n\
                        [look.main]\nmodel = \"lambertian\"\nalbedo = 0.8\n";

fn desk() -> Desk {
    let desk = Desk::new(&["measure"], |_| {}, &[("broken.hair", b"nothing".as_slice()), ("note", b"mine".as_slice())]);
    for folder in ["page", "table", "taken/README.md"] {
        std::fs::create_dir_all(desk.path(folder)).unwrap();
    }
    desk.write("page/memory.md", "# Remember\n");
    desk.write("table/memory.csv", "what,when\nmilk,today\n");
    desk
}

fn truth() -> Desk {
    let files = [("scene.toml", SCENE), ("sparse.toml", SPARSE), ("note", b"mine".as_slice())];
    let desk = Desk::new(&["compare-renderers"], |_| {}, &files);
    for folder in ["other", "table"] {
        std::fs::create_dir(desk.path(folder)).unwrap();
    }
    desk.write("other/README.md", "# Something else\n");
    desk.write("table/results.csv", "team,goals\nours,3\n");
    desk
}

/// The cells of the first table of a CSV file, without its heads.
fn cells(csv: &str) -> Vec<Vec<&str>> {
    csv.lines().skip(1).map(|line| line.split(',').collect()).collect()
}

// --- good input -------------------------------------------------------------------------------------------------

#[test]
fn the_list_names_every_experiment_with_its_figure() {
    let desk = desk();
    let before = desk.files();
    let list = desk.good("list").out;
    for (name, figure) in
        [("shading", "fig. 33"), ("shadows", "fig. 36"), ("transparency", "fig. 41"), ("memory", "fig. 42")]
    {
        let line = list.lines().find(|line| line.split_whitespace().next() == Some(name));
        assert!(line.is_some_and(|line| line.contains(figure)), "{name} in\n{list}");
    }
    assert_eq!(desk.files(), before, "the list is read, not written");
    let help = desk.good("--help").out;
    for flag in ["--output", "--size", "--strands", "--grooms", "--repeats", "--adapter", "--date", "--quick", "`list`"]
    {
        assert!(help.contains(flag), "{flag} in {help}");
    }
}

#[test]
fn an_experiment_leaves_a_page_with_numbers_and_an_index() {
    let desk = desk();
    let answer = desk.good("memory -o new/pages --quick --size 48x64 --strands 50 --date 2026-01-31");
    assert_eq!(answer.out, "", "the standard output is for results that are text");
    assert!(answer.err.contains("memory: ") && answer.err.contains("wrote 1 page into new/pages"), "{}", answer.err);
    let want = ["README.md", "memory-2.csv", "memory-plot.png", "memory.csv", "memory.md"];
    assert_eq!(desk.names_in("new/pages"), want);
    let page = desk.text("new/pages/memory.md");
    for part in ["# Memory of transparency", "## Findings", "(our aim)", "Adapter: ", "48 x 64", "2026-01-31"] {
        assert!(page.contains(part), "{part} is missing in\n{page}");
    }
    let plot = desk.image("new/pages/memory-plot.png");
    assert!(plot.width >= 720 && plot.pixels.iter().any(|pixel| *pixel != plot.pixels[0]));
    assert!(!page.contains("medians of") && !page.contains("one frame"), "nothing was timed:\n{page}");
    // The A-buffer keeps every fragment, the DBK-buffer no more than these, and nothing is lost on the way.
    let csv = desk.text("new/pages/memory.csv");
    // Away from its page, a table still says whose numbers it has.
    assert!(csv.lines().next().unwrap().ends_with(",adapter,software"), "{csv}");
    let stored = |name: &str| {
        let rows = cells(&csv);
        // Names with a comma are quoted and come apart; those here have none.
        let row = rows.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("{name} in\n{csv}"));
        assert_eq!(row[5], "0", "{row:?}");
        row[4].parse::<u64>().unwrap()
    };
    let (all, near) = (stored("a-buffer"), stored("dbk"));
    assert!(0 < near && near <= all, "{near} of {all}");
    let index = desk.text("new/pages/README.md");
    assert!(index.contains("| [memory](memory.md) |") && index.contains("| shading | fig. 33 |"), "{index}");
    // A second one adds to the index, and quiet is quiet.
    let answer = desk.good("shading -o new/pages --quick --size 48x64 --strands 30,50 --grooms straight --quiet");
    // A driver may have something to say, the program has not.
    assert!(
        answer.out.is_empty() && !answer.err.contains("shading") && !answer.err.contains("wrote"),
        "{}",
        answer.err
    );
    let index = desk.text("new/pages/README.md");
    assert!(index.contains("| [memory](memory.md) |") && index.contains("| [shading](shading.md) |"), "{index}");
    let csv = desk.text("new/pages/shading.csv");
    // One groom, two numbers of strands, two ways to shade; names of variants have a comma, so lines count.
    assert_eq!(csv.lines().count(), 1 + 4, "{csv}");
}

#[test]
fn a_scene_is_held_against_the_path_tracer() {
    let desk = truth();
    let line = "scene.toml -o new/truth --samples 4 --size 32x32 --combinations look+dom+dbk,look+none+opaque";
    let answer = desk.good(line);
    assert!(answer.err.contains("wrote 4 rows into new/truth"), "{}", answer.err);
    let page = desk.text("new/truth/README.md");
    for part in ["# Renderers compared", "## Direct light", "## Full transport", "4 samples a pixel", "scene.toml"] {
        assert!(page.contains(part), "{part} is missing in\n{page}");
    }
    let csv = desk.text("new/truth/results.csv");
    let rows = cells(&csv);
    assert_eq!(rows.len(), 4, "{csv}");
    for (row, want) in rows.iter().zip(["direct", "direct", "full", "full"]) {
        assert_eq!((row[0], row[1]), (want, "look"));
        // relMSE and the error of the mean radiance are numbers: hair is in the picture.
        let numbers: Vec<f64> = [row[5], row[7], row[8]].iter().map(|cell| cell.parse().unwrap()).collect();
        assert!(numbers.iter().all(|x| x.is_finite() && *x >= 0.0), "{row:?}");
    }
    let names = desk.names_in("new/truth");
    assert!(names.len() == 2 + 4 && !names.iter().any(|name| name.starts_with('.')), "{names:?}");
    for strip in ["direct-look-dom-dbk.png", "full-look-none-opaque.png"] {
        assert!(page.contains(strip), "{strip} in\n{page}");
        let strip = desk.image(&format!("new/truth/{strip}"));
        assert!(strip.width > 3 * 32, "three pictures");
    }
}

/// Were the pictures swapped, mirrored or exposed, or hair looked for in the wrong places, this would show: hair covers
/// little of the picture, and two stops are a factor of four.
#[test]
fn both_renderers_agree_where_there_is_nothing_to_differ_about() {
    let desk = truth();
    desk.good("sparse.toml -o p --samples 32 --combinations look+none+a-buffer,look+none+dbk,look+none+opaque --quiet");
    let csv = desk.text("p/results.csv");
    let rows = cells(&csv);
    let direct: Vec<_> = rows.iter().filter(|row| row[0] == "direct").collect();
    assert_eq!(direct.len(), 3, "{csv}");
    for row in direct {
        // The raster casts no shadows here, and the few hairs cast few.
        let ratio: f64 = row[8].parse().unwrap();
        assert!((0.7..1.3).contains(&ratio), "{row:?}");
    }
}

// --- bad input --------------------------------------------------------------------------------------------------

#[test]
fn what_cannot_be_measured_is_refused() {
    desk().refuse(&[
        ("shadwos -o p", &["\"shadwos\"", "did you mean shadows?"]),
        ("zebra -o p", &["\"zebra\"", "cuticle measure list"]),
        ("memory zebra -o p", &["\"zebra\""]),
        ("list memory -o p", &["`list` stands alone"]),
        ("memory", &["-o FOLDER"]),
        ("memory -o note", &["note", "folder"]),
        ("memory -o p --size 0x64", &["0x64", "between 1 and 16384"]),
        ("memory -o p --size 48", &["\"48\"", "1280x720"]),
        ("memory -o p --size -4x4", &["-4x4"]),
        ("memory -o p --strands 0", &["the number of strands is 0", "1 to 1000000"]),
        ("memory -o p --strands 10,many", &["many"]),
        ("memory -o p --repeats 0", &["the number of repeats is 0", "1 to 1000"]),
        ("memory -o p --grooms strait", &["\"strait\"", "did you mean straight?"]),
        ("memory -o p --grooms absent.hair", &["absent.hair", ".hair"]),
        ("memory -o p --grooms broken.hair", &["broken.hair"]),
        ("memory -o p --grooms straight,curly,straight", &["\"straight\" twice", "different names"]),
        ("memory -o page", &["page/memory.md", "another folder"]),
        ("memory -o table", &["table/memory.csv", "another folder"]),
        ("memory -o taken", &["taken/README.md", "is a folder"]),
        ("memory -o p --frob", &["--frob"]),
    ]);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let desk = truth();
    desk.refuse(&[
        ("scene.toml", &["-o FOLDER"]),
        ("absent.toml -o p", &["absent.toml"]),
        ("scene.toml -o note", &["note", "folder"]),
        ("scene.toml -o other", &["other/README.md", "another folder"]),
        ("scene.toml -o table", &["table/results.csv", "another folder"]),
        ("scene.toml -o p --combinations look+dmo+dbk", &["look+dmo+dbk", "did you mean look+dom+dbk?", "kajiya-kay"]),
        ("scene.toml -o p --combinations zebra", &["zebra", "standard"]),
        ("scene.toml -o p --samples 0", &["--samples", "1..=16777216"]),
        ("scene.toml -o p --size 32", &["\"32\""]),
        ("scene.toml -o p --set look.mian.ior=1.5", &["mian", "main"]),
    ]);
}

#[test]
fn an_unknown_adapter_is_refused_with_those_there_are() {
    let desk = desk();
    let answer = desk.run("memory -o p --quick --size 16x16 --strands 5 --adapter zebra".split_whitespace());
    answer.assert_refused(&["\"zebra\"", "there are: "]);
    assert!(!desk.path("p").exists(), "nothing was begun");
}
