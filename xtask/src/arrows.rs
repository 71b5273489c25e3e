//! Which crate uses which: the `arrows` block of `ARCHITECTURE.md` against the manifests, both ways.
//!
//! A crate is called by its package name without the prefix `cuticle-`. Dependencies for tests and benches
//! are no arrows.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail, ensure};
use cargo_metadata::{DependencyKind, Metadata, MetadataCommand};

use crate::root;

/// Every crate with those that it uses.
pub type Arrows = BTreeMap<String, BTreeSet<String>>;

/// What the package names of the workspace begin with.
const PREFIX: &str = "cuticle-";

/// The manifests of the workspace as Cargo reads them; needs no network.
///
/// # Errors
/// When Cargo cannot be run or does not understand a manifest.
pub fn metadata() -> Result<Metadata> {
    let mut command = MetadataCommand::new();
    command.manifest_path(root().join("Cargo.toml")).no_deps().other_options(vec!["--offline".to_owned()]);
    command.exec().context("asking Cargo for the manifests")
}

/// The arrows that the manifests draw.
///
/// # Errors
/// When a package of the workspace lacks the common prefix.
pub fn in_manifests(metadata: &Metadata) -> Result<Arrows> {
    let mut arrows = Arrows::new();
    for package in metadata.workspace_packages() {
        let ours = package.dependencies.iter().filter(|d| d.path.is_some() && d.kind != DependencyKind::Development);
        let uses = ours.map(|d| short(&d.name)).collect::<Result<BTreeSet<String>>>()?;
        arrows.insert(short(&package.name)?, uses);
    }
    Ok(arrows)
}

fn short(package: &str) -> Result<String> {
    let name = package.strip_prefix(PREFIX);
    Ok(name.with_context(|| format!("the package `{package}` should be called `{PREFIX}{package}`"))?.to_owned())
}

/// The arrows of the one block in `text` that is fenced as `arrows`; a line is `a -> b, c`.
///
/// # Errors
/// When there is no such block or more than one, or a line in it is no arrow, or a crate stands twice.
pub fn in_document(text: &str) -> Result<Arrows> {
    let mut arrows = Arrows::new();
    let (mut blocks, mut inside) = (0, false);
    for (index, line) in text.lines().enumerate() {
        let number = index + 1;
        match (inside, line.trim()) {
            (false, "```arrows") => {
                blocks += 1;
                inside = true;
            }
            (true, "```") => inside = false,
            (false, _) | (true, "") => {}
            (true, line) => {
                let Some((from, to)) = line.split_once("->") else {
                    bail!("line {number}: {line:?} is no arrow; write `a -> b, c`");
                };
                let to = to.split(',').map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect();
                let from = from.trim();
                ensure!(arrows.insert(from.to_owned(), to).is_none(), "line {number}: `{from}` stands there twice");
            }
        }
    }
    ensure!(!inside, "the block ```arrows is not closed");
    ensure!(blocks == 1, "there should be one block ```arrows; there are {blocks}");
    Ok(arrows)
}

/// What differs between document and manifests, a sentence each; nothing when they agree.
pub fn differences(document: &Arrows, manifests: &Arrows) -> Vec<String> {
    let mut found = Vec::new();
    let names: BTreeSet<&String> = document.keys().chain(manifests.keys()).collect();
    for name in names {
        match (document.get(name), manifests.get(name)) {
            (Some(drawn), Some(used)) => {
                found.extend(used.difference(drawn).map(|to| {
                    format!("the manifest of `{name}` uses `{to}`, but ARCHITECTURE.md has no arrow `{name} -> {to}`")
                }));
                found.extend(drawn.difference(used).map(|to| {
                    format!("ARCHITECTURE.md has `{name} -> {to}`, but the manifest of `{name}` does not use `{to}`")
                }));
            }
            (Some(_), None) => found.push(format!("ARCHITECTURE.md has a crate `{name}`, the workspace has none")),
            (None, _) => found.push(format!("the workspace has a crate `{name}`, ARCHITECTURE.md has none")),
        }
    }
    found
}

/// Compares `ARCHITECTURE.md` with the manifests; returns the number of arrows.
///
/// # Errors
/// When they differ, or one of them cannot be read.
pub fn check() -> Result<usize> {
    let path = root().join("ARCHITECTURE.md");
    let text = std::fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
    let document = in_document(&text).context("in ARCHITECTURE.md")?;
    let differences = differences(&document, &in_manifests(&metadata()?)?);
    ensure!(differences.is_empty(), "the map is wrong:\n  {}", differences.join("\n  "));
    Ok(document.values().map(BTreeSet::len).sum())
}
