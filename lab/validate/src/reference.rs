//! What other renderers made of the lab scene; see `reference/README.md`.

use std::collections::BTreeMap;

use anyhow::{Context, bail};
use serde::Deserialize;

/// Block means of one picture with their standard errors.
#[derive(Debug, Deserialize)]
pub(crate) struct Blocks {
    pub(crate) renderer: String,
    /// Samples per pixel.
    pub(crate) spp: u32,
    /// Side of a block, pixels.
    pub(crate) block: usize,
    /// Width and height, pixels.
    pub(crate) size: [usize; 2],
    /// Rows from the top; linear RGB.
    pub(crate) mean: Vec<Vec<[f64; 3]>>,
    /// Of `mean`.
    pub(crate) standard_error: Vec<Vec<[f64; 3]>>,
}

/// Mean colours of the hair by case, such as `L1_brown`, and renderer.
#[derive(Debug, Deserialize)]
pub(crate) struct HairMeans {
    /// What was measured, and when.
    pub(crate) source: String,
    /// Size of the hair mask over which they are means.
    pub(crate) mask_pixels: usize,
    /// Linear RGB, four digits.
    pub(crate) cases: BTreeMap<String, BTreeMap<String, [f64; 3]>>,
}

/// The block means of a case, where there are any.
pub(crate) fn blocks(case: &str) -> anyhow::Result<Option<Blocks>> {
    let text = match case {
        "L1_brown" => include_str!("../reference/L1_brown.json"),
        "L2_brown" => include_str!("../reference/L2_brown.json"),
        _ => return Ok(None),
    };
    let blocks: Blocks = serde_json::from_str(text).with_context(|| format!("the reference {case}"))?;
    if blocks.block == 0 || blocks.size.iter().any(|side| side % blocks.block != 0) {
        bail!("the reference {case}: blocks of {} do not tile {:?}", blocks.block, blocks.size);
    }
    let [columns, rows] = blocks.size.map(|side| side / blocks.block);
    for table in [&blocks.mean, &blocks.standard_error] {
        if table.len() != rows || table.iter().any(|row| row.len() != columns) {
            bail!("the reference {case} is not a table of {columns} x {rows} blocks");
        }
    }
    Ok(Some(blocks))
}

/// The mean hair colours of all cases.
pub(crate) fn hair_means() -> anyhow::Result<HairMeans> {
    serde_json::from_str(include_str!("../reference/hair_means.json")).context("the reference hair_means")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_are_whole_and_of_the_light_they_are_named_after() {
        for (case, sky) in [("L1_brown", 1.0), ("L2_brown", 0.05)] {
            let blocks = blocks(case).unwrap().unwrap();
            assert_eq!((blocks.size, blocks.block), ([512, 512], 16));
            // The corner of the picture is sky.
            assert_eq!(blocks.mean[0][0], [sky; 3], "{case}");
            assert!(blocks.standard_error.iter().flatten().flatten().all(|e| (0.0..sky).contains(e)));
        }
        assert!(blocks("L1_green").unwrap().is_none());
        let means = hair_means().unwrap();
        assert!(means.cases.contains_key("L1_brown") && means.cases.contains_key("L2_blonde"));
        // Two renderers that share no code agree on every case to 1 %.
        for (case, peers) in &means.cases {
            let all: Vec<&[f64; 3]> = peers.values().collect();
            assert!(all.len() >= 2, "{case}");
            assert!((0..3).all(|c| (all[0][c] / all[1][c] - 1.0).abs() < 0.01), "{case}");
        }
    }
}
