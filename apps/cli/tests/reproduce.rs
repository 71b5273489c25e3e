//! `cuticle reproduce` as people use it: the list, a page with pictures and numbers, the index over all, and what
//! it says of bad input.
//!
//! The experiments here are those that take a fraction of a second at the least effort; what they find at that
//! effort means nothing. That every experiment runs is tried beside the experiments themselves.

mod desk;

use std::fs;

use desk::Desk;

/// Two cheap experiments, in the order of the list.
const CHEAP: [&str; 2] = ["hery-energy", "hunz-ellipse"];

/// So little effort that seconds suffice.
const LITTLE: &str = "--quality 0.004 --threads 1";

// --- good input -------------------------------------------------------------------------------------------------

#[test]
fn the_list_names_every_experiment_with_its_paper() {
    let desk = desk();
    let list = desk.good("list").out;
    let names = names_in(&list);
    assert!(names.len() >= 20, "{list}");
    for name in CHEAP.into_iter().chain(["hery-fig1", "deon-sampler", "lambertian-fibers", "hunz-fig46"]) {
        assert!(names.contains(&name), "{name} is not in\n{list}");
    }
    for line in list.lines() {
        // Name, paper, year, figure and title.
        assert!(line.contains(" 20") && line.contains(", ") && line.contains(": ") && line.len() > 40, "{line}");
    }
    let mut unique = names.clone();
    unique.sort_unstable();
    unique.dedup();
    assert_eq!(unique.len(), names.len(), "{list}");
    assert!(desk.files().is_empty(), "the list is read, not written");
    let help = desk.good("--help").out;
    for flag in ["--output", "--quality", "--seed", "--threads", "--date", "--quiet", "`all`", "`list`"] {
        assert!(help.contains(flag), "{flag} in {help}");
    }
}

#[test]
fn an_experiment_leaves_a_page_with_pictures_and_numbers_and_an_index() {
    let desk = desk();
    let name = CHEAP[0];
    // Folders are made.
    let answer = desk.good(&format!("{name} -o new/pages {LITTLE}"));
    assert_eq!(answer.out, "", "the standard output is for results that are text");
    let said: Vec<&str> = answer.err.lines().collect();
    assert!(said.iter().any(|line| line.starts_with(&format!("{name}: "))), "{}", answer.err);
    assert!(said.iter().any(|line| line.contains("1 page") && line.contains("new/pages")), "{}", answer.err);

    let page = desk.text(&format!("new/pages/{name}.md"));
    for part in ["\n# ", "**Claim.** ", "**We found.** ", "**Verdict: ", "## Numbers", "## What was done", "Took "] {
        assert!(page.contains(part), "{part} is missing in\n{page}");
    }
    let again = format!("cuticle reproduce {name} --quality 0.004 --seed 1 -o FOLDER");
    assert!(page.contains(&again), "{again} is missing in\n{page}");
    let numbers = numbers_in(&page);
    assert!(numbers.len() >= 5, "{page}");
    // Every picture of the page is there, and every picture there is on the page.
    let pictures = pictures_in(&page);
    assert!(!pictures.is_empty(), "{page}");
    for picture in &pictures {
        let image = film::image::read(desk.path(&format!("new/pages/{picture}"))).unwrap();
        assert!(image.width >= 16 && image.height >= 16, "{picture}: {} x {}", image.width, image.height);
        assert!(image.pixels.iter().any(|pixel| *pixel != image.pixels[0]), "{picture} is empty");
    }
    let mut wanted: Vec<String> = pictures;
    wanted.extend(["README.md".to_owned(), format!("{name}.md")]);
    wanted.sort();
    assert_eq!(desk.names_in("new/pages"), wanted, "and nothing else");

    // The index has this one with its verdict, and all others without.
    let index = desk.text("new/pages/README.md");
    let list = desk.good("list").out;
    for other in names_in(&list) {
        let row = index.lines().find(|line| line.starts_with(&format!("| {other} |")) || links(line, other));
        let row = row.unwrap_or_else(|| panic!("{other} is missing in\n{index}"));
        assert_eq!(links(row, other), other == name, "{row}");
        assert_eq!(row.contains("not tried"), other != name, "{row}");
        assert_eq!(row.contains("**"), other == name, "a verdict is bold: {row}");
    }
}

#[test]
fn later_runs_add_to_the_index_and_replace_their_own_page() {
    let desk = desk();
    let [first, second] = CHEAP;
    desk.good(&format!("{first} -o pages {LITTLE}"));
    let old = desk.text(&format!("pages/{first}.md"));
    let answer = desk.good(&format!("{second} {second} -o pages {LITTLE} --date 2026-01-31 --quiet"));
    assert_eq!((answer.out.as_str(), answer.err.as_str()), ("", ""), "quiet is quiet");
    let index = desk.text("pages/README.md");
    for name in CHEAP {
        assert_eq!(index.lines().filter(|line| links(line, name)).count(), 1, "{name} in\n{index}");
    }
    assert_eq!(desk.text(&format!("pages/{first}.md")), old, "what was not done again is as it was");
    let page = desk.text(&format!("pages/{second}.md"));
    assert!(page.trim_end().ends_with("2026-01-31.") && !old.contains("2026"), "the day is what the user says it is");
    // Both at once, in the order of the list, with another seed.
    let answer = desk.good(&format!("{second} {first} -o pages {LITTLE} --seed 7"));
    let place = |name: &str| answer.err.find(&format!("{name}: ")).unwrap_or_else(|| panic!("{}", answer.err));
    assert!(place(first) < place(second), "{}", answer.err);
    assert!(desk.text(&format!("pages/{first}.md")).contains("--seed 7"));
}

#[test]
fn the_seed_decides_the_numbers_and_threads_do_not() {
    let desk = desk();
    let name = CHEAP[0];
    for (folder, flags) in [("a", "--threads 1"), ("b", "--threads 3"), ("c", "--threads 1 --seed 2")] {
        desk.good(&format!("{name} -o {folder} --quality 0.004 {flags}"));
    }
    let page = |folder: &str| desk.text(&format!("{folder}/{name}.md"));
    let [a, b, c] = ["a", "b", "c"].map(|folder| numbers_in(&page(folder)));
    assert_eq!(a, b, "another number of threads");
    assert_ne!(a, c, "another seed is other noise");
    for picture in pictures_in(&page("a")) {
        let [a, b] = ["a", "b"].map(|folder| fs::read(desk.path(&format!("{folder}/{picture}"))).unwrap());
        assert!(a == b, "{picture} differs");
    }
}

// --- bad input --------------------------------------------------------------------------------------------------

#[test]
fn unknown_experiments_are_refused_with_the_closest() {
    desk().refuse(&[
        ("", &["<NAME>"]),
        ("-o p", &["<NAME>"]),
        ("hery-fgi1 -o p", &["\"hery-fgi1\"", "did you mean hery-fig1?"]),
        ("hery-enrgy -o p", &["\"hery-enrgy\"", "did you mean hery-energy?"]),
        ("DEON-SAMPLER -o p", &["\"DEON-SAMPLER\"", "did you mean deon-sampler?"]),
        ("hunz-elipse -o p", &["\"hunz-elipse\"", "did you mean hunz-ellipse?"]),
        ("zebra -o p", &["\"zebra\"", "cuticle reproduce list"]),
        // One wrong name among good ones: nothing is begun.
        ("hery-energy zebra -o p", &["\"zebra\"", "cuticle reproduce list"]),
        ("all hery-fgi1 -o p", &["\"hery-fgi1\"", "did you mean hery-fig1?"]),
        ("list all", &["`list` stands alone"]),
        ("list hery-energy -o p", &["`list` stands alone"]),
        ("hery-energy -o p --frob", &["--frob"]),
    ]);
}

#[test]
fn efforts_and_counts_that_cannot_be_are_refused() {
    desk().refuse(&[
        ("hery-energy -o p --quality 0", &["--quality is 0", "between 0.001 and 100"]),
        ("hery-energy -o p --quality nan", &["--quality is NaN", "between 0.001 and 100"]),
        ("hery-energy -o p --quality -1", &["--quality is -1", "between 0.001 and 100"]),
        ("hery-energy -o p --quality 0.0009", &["--quality is 0.0009", "between 0.001 and 100"]),
        ("hery-energy -o p --quality 101", &["--quality is 101", "between 0.001 and 100"]),
        ("hery-energy -o p --quality inf", &["--quality is inf", "between 0.001 and 100"]),
        ("hery-energy -o p --quality high", &["--quality", "'high'"]),
        ("hery-energy -o p --threads 0", &["--threads", "1..=1024"]),
        ("hery-energy -o p --threads -2", &["--threads", "-2", "1..=1024"]),
        ("hery-energy -o p --seed -1", &["--seed", "-1", "0..=4294967295"]),
        ("hery-energy -o p --seed 4294967296", &["--seed", "0..=4294967295"]),
    ]);
}

#[test]
fn folders_that_cannot_take_pages_are_refused_before_anything_is_done() {
    let desk = desk();
    fs::write(desk.path("taken"), "not a folder").unwrap();
    fs::create_dir_all(desk.path("blocked/README.md")).unwrap();
    fs::create_dir(desk.path("other")).unwrap();
    fs::write(desk.path("other/README.md"), "# Something else\n").unwrap();
    // At full effort: whoever began would not be done soon.
    desk.refuse(&[
        ("all", &["-o FOLDER"]),
        ("hery-energy --quiet", &["-o FOLDER"]),
        ("all -o taken", &["cannot make the folder taken", "File exists"]),
        ("all -o taken/pages", &["cannot make the folder taken/pages", "Not a directory"]),
        ("all -o blocked", &["blocked/README.md", "it is a folder"]),
        // Somebody's own text, which has no other name to go by.
        ("all -o other", &["other/README.md", "would be overwritten", "another folder"]),
    ]);
    desk.refuse_args(&["hery-energy", "-o", ""], &["--output", "value"]);
}

// --- the desk ---------------------------------------------------------------------------------------------------

fn desk() -> Desk {
    Desk::new(&["reproduce"], |_| {}, &[])
}

// --- reading ----------------------------------------------------------------------------------------------------

/// The first word of every line.
fn names_in(list: &str) -> Vec<&str> {
    list.lines().filter_map(|line| line.split_whitespace().next()).collect()
}

/// Whether a row of the index points at the page of this experiment.
fn links(row: &str, name: &str) -> bool {
    row.starts_with(&format!("| [{name}]({name}.md) |"))
}

/// What the table of a page measured: labels with their numbers, which must be numbers.
#[track_caller]
fn numbers_in(page: &str) -> Vec<(String, f64)> {
    let (_, table) = page.split_once("## Numbers").unwrap_or_else(|| panic!("no numbers in\n{page}"));
    let rows = table.lines().skip_while(|line| !line.starts_with("|---")).skip(1);
    rows.take_while(|line| line.starts_with('|'))
        .map(|row| {
            let cells: Vec<&str> = row.trim_matches('|').split(" | ").map(str::trim).collect();
            assert_eq!(cells.len(), 5, "{row}");
            // The unit follows the number.
            let number = cells[1].split(' ').next().unwrap_or_default();
            let value: f64 = number.parse().unwrap_or_else(|error| panic!("{number} in {row}: {error}"));
            assert!(value.is_finite(), "{row}");
            (cells[0].to_owned(), value)
        })
        .collect()
}

/// The files that a page shows.
fn pictures_in(page: &str) -> Vec<String> {
    let shown = page.lines().filter_map(|line| line.strip_prefix("![")?.split_once("](")?.1.strip_suffix(')'));
    shown.map(str::to_owned).collect()
}
