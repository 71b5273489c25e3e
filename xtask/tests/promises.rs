//! What `ARCHITECTURE.md` promises about the sources.

use std::path::{Path, PathBuf};

use cargo_metadata::DependencyKind;
use xtask::source;

/// The Rust sources below some folders of the workspace.
fn files(folders: &[&str]) -> Vec<PathBuf> {
    let below = |folder: &&str| source::rust_files(&xtask::root().join(folder)).expect("the folder has sources");
    folders.iter().flat_map(below).collect()
}

/// No file may have a word for which `is_banned` holds.
fn must_not_say(files: &[PathBuf], is_banned: impl Fn(&str) -> bool) {
    let found: Vec<String> =
        files.iter().flat_map(|file| source::mentions(file, &is_banned).expect("the file is there")).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

const EVERYWHERE: [&str; 4] = ["crates", "apps", "lab", "xtask"];

#[test]
fn no_code_is_unsafe() {
    must_not_say(&files(&EVERYWHERE), |word| word == "unsafe");
}

#[test]
fn only_the_scene_file_derives_serialize() {
    let file = xtask::root().join("crates/scene/src/file.rs");
    let mut sources = files(&["crates"]);
    let before = sources.len();
    sources.retain(|path| *path != file && is_library(path));
    // The exception exists, and it is one.
    let derived = source::mentions(&file, |word| word == "Serialize").expect("the scene file is there");
    assert!(before > sources.len() && !derived.is_empty());
    must_not_say(&sources, |word| matches!(word, "Serialize" | "JsonSchema"));
}

/// Not a test of a crate, which may do as it likes.
fn is_library(path: &Path) -> bool {
    let is_test = |part: &std::ffi::OsStr| part == "tests" || part == "tests.rs" || part == "benches";
    !path.iter().any(is_test)
}

#[test]
fn the_scene_opens_no_files() {
    let mut sources = files(&["crates/scene/src"]);
    sources.retain(|path| is_library(path));
    must_not_say(&sources, |word| matches!(word, "fs" | "File" | "OpenOptions"));
}

#[test]
fn accel_knows_numbers_only() {
    must_not_say(&files(&["crates/accel/src"]), |word| {
        let known = ["groom", "grooms", "look", "looks", "scene", "scenes", "fiber", "fibers"];
        source::parts(word).iter().any(|part| known.contains(&part.as_str()))
    });
}

#[test]
fn only_raster_names_a_gpu_api() {
    let is_gpu = |word: &str| word.starts_with("wgpu");
    let raster = xtask::root().join("crates/raster");
    let (inside, outside): (Vec<_>, Vec<_>) =
        files(&EVERYWHERE).into_iter().partition(|path| path.starts_with(&raster));
    must_not_say(&outside, is_gpu);
    // The exception exists, and in the manifests it is the only one; tests are no excuse.
    let named = inside.iter().any(|file| !source::mentions(file, is_gpu).expect("the file is there").is_empty());
    assert!(named, "raster names no GPU API");
    let mut users: Vec<String> =
        manifests().into_iter().filter(|used| is_gpu(&used.name)).map(|used| used.package).collect();
    users.dedup();
    assert_eq!(users, ["cuticle-raster"]);
}

#[test]
fn nobody_names_a_window_or_python() {
    let heavy = ["egui", "eframe", "winit", "pyo3"];
    must_not_say(&files(&EVERYWHERE), |word| heavy.iter().any(|name| word.starts_with(name)));
    for Used { package, name, .. } in manifests() {
        assert!(!heavy.iter().any(|banned| name.starts_with(banned)), "{package} depends on {name}");
    }
}

#[test]
fn no_renderer_draws_from_a_generator() {
    // A generator has a state, and a state that threads share makes pictures that depend on them.
    for Used { package, name, .. } in manifests().into_iter().filter(|used| used.kind != DependencyKind::Development) {
        assert!(!["rand", "fastrand", "oorandom"].contains(&name.as_str()), "{package} depends on {name}");
    }
}

/// A line of a manifest.
struct Used {
    package: String,
    name: String,
    kind: DependencyKind,
}

/// What the packages of the workspace use, a package after the other.
fn manifests() -> Vec<Used> {
    let metadata = xtask::arrows::metadata().expect("Cargo runs");
    let mut all = Vec::new();
    for package in metadata.workspace_packages() {
        let used = package.dependencies.iter();
        all.extend(used.map(|d| Used { package: package.name.to_string(), name: d.name.clone(), kind: d.kind }));
    }
    for (kind, least) in [(DependencyKind::Normal, 40), (DependencyKind::Development, 10)] {
        let count = all.iter().filter(|used| used.kind == kind).count();
        assert!(count > least, "{kind:?}: {count}");
    }
    all
}

#[test]
fn ci_runs_the_steps_of_xtask() {
    let script = std::fs::read_to_string(xtask::root().join(".ci/run")).expect("the script is there");
    let in_script: Vec<&str> = script
        .lines()
        .filter_map(|line| line.strip_prefix("step "))
        .map(|line| line.strip_prefix("env ").unwrap_or(line))
        .collect();
    assert_eq!(in_script, xtask::ci::STEPS.map(|step| step.to_string()));
}

#[test]
fn the_readme_names_the_two_commands_that_must_work() {
    let readme = std::fs::read_to_string(xtask::root().join("README.md")).expect("the README is there");
    let tests = xtask::ci::STEPS[0].to_string();
    for command in ["cargo run --release -- render", tests.as_str()] {
        assert!(readme.lines().any(|line| line.trim() == command), "{command}");
    }
}

#[test]
fn links_between_documents_lead_somewhere() {
    let root = xtask::root();
    let mut documents: Vec<_> =
        ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"].map(|d| root.join(d)).into();
    let mut folders = vec![root.join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("the folder is there") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                documents.push(path);
            }
        }
    }
    let mut links = 0;
    for document in documents {
        let text = std::fs::read_to_string(&document).expect("the document is there");
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let path = target.split('#').next().unwrap_or_default();
            if path.is_empty() || path.contains("://") {
                continue;
            }
            let place = document.parent().expect("documents lie in folders").join(path);
            assert!(place.exists(), "{} links to {target}, which is not there", document.display());
            links += 1;
        }
    }
    assert!(links > 10, "{links}");
}
