//! `ARCHITECTURE.md` draws the arrows that the manifests have.

use xtask::arrows::{self, Arrows};

fn document() -> String {
    std::fs::read_to_string(xtask::root().join("ARCHITECTURE.md")).expect("the map is there")
}

fn manifests() -> Arrows {
    arrows::in_manifests(&arrows::metadata().expect("Cargo runs")).expect("all packages are called cuticle-")
}

#[test]
fn the_map_shows_the_arrows_of_the_manifests() {
    let drawn = arrows::in_document(&document()).expect("the map has its arrows");
    let differences = arrows::differences(&drawn, &manifests());
    assert!(differences.is_empty(), "the map is wrong:\n  {}", differences.join("\n  "));
    // Neither side is empty by mistake.
    assert!(drawn.len() >= 10 && drawn["fiber"].contains("math"), "{drawn:?}");
}

#[test]
fn every_missing_and_every_false_arrow_is_found() {
    let manifests = manifests();
    let mut tried = 0;
    for (from, used) in &manifests {
        for to in used {
            let mut drawn = manifests.clone();
            drawn.get_mut(from).expect("it was there").remove(to);
            let found = arrows::differences(&drawn, &manifests);
            assert!(found.len() == 1 && found[0].contains(&format!("no arrow `{from} -> {to}`")), "{found:?}");
            // The same difference the other way round.
            let found = arrows::differences(&manifests, &drawn);
            assert!(found.len() == 1 && found[0].contains(&format!("has `{from} -> {to}`")), "{found:?}");
            tried += 1;
        }
        let mut drawn = manifests.clone();
        drawn.remove(from);
        assert_eq!(arrows::differences(&drawn, &manifests).len(), 1);
        assert_eq!(arrows::differences(&manifests, &drawn).len(), 1);
    }
    assert!(tried >= 20, "{tried}");
}

#[test]
fn tests_may_use_what_the_crate_may_not() {
    // fiber enrols itself in its own conformance suite by a dev-dependency on itself.
    assert!(!manifests()["fiber"].contains("fiber"));
}

#[test]
fn a_block_that_cannot_be_read_is_refused() {
    let block = |inner: &str| format!("# Map\n\n```arrows\n{inner}```\n");
    let arrows = arrows::in_document(&block("a ->\nb -> a\nc -> a, b\n")).expect("three arrows");
    assert_eq!(arrows.values().map(std::collections::BTreeSet::len).sum::<usize>(), 3);
    for (text, complaint) in [
        ("no block".to_owned(), "one block"),
        (block("a ->\n") + &block("b ->\n"), "one block"),
        (block("a: b\n"), "no arrow"),
        (block("a ->\na -> b\n"), "twice"),
        ("```arrows\na ->\n".to_owned(), "not closed"),
    ] {
        let error = arrows::in_document(&text).expect_err(&text).to_string();
        assert!(error.contains(complaint), "{text:?}: {error}");
    }
}
