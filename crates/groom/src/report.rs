//! What a groom contains, what looks odd about it, and how to clean it.

use std::fmt;

use math::Vec3;

use crate::strands::polyline_length;
use crate::{Attribute, Domain, Groom, UpAxis, Values};

/// Least, mean and greatest of something.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// The least.
    pub min: f32,
    /// The mean.
    pub mean: f32,
    /// The greatest.
    pub max: f32,
}

impl Spread {
    /// `None` without values.
    fn of(values: impl Iterator<Item = f32>) -> Option<Self> {
        let (mut min, mut max, mut sum, mut count) = (f32::INFINITY, f32::NEG_INFINITY, 0.0_f64, 0_u64);
        for x in values {
            min = min.min(x);
            max = max.max(x);
            sum += f64::from(x);
            count += 1;
        }
        (count > 0).then(|| Self { min, mean: (sum / count as f64) as f32, max })
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.4} / {:.4} / {:.4}", self.min, self.mean, self.max)
    }
}

/// Statistics of a groom. Lengths and widths are in the groom's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// How many strands there are.
    pub strands: usize,
    /// How many points they have together.
    pub points: usize,
    /// Points per strand.
    pub points_per_strand: Spread,
    /// Length of a strand.
    pub length: Spread,
    /// Half of the strands are shorter than this.
    pub median_length: f32,
    /// Radius of a point, where there are radii.
    pub radius: Option<Spread>,
    /// Smallest box around all points.
    pub bounds: Option<(Vec3, Vec3)>,
    /// Consecutive points at the same place.
    pub zero_length_segments: usize,
    /// Strands shorter than 1e-4 of the median.
    pub degenerate_strands: usize,
    /// Mean of chord over length: 1 is straight, coils are near 0.3.
    pub straightness: f32,
    /// Which axis is up.
    pub up: UpAxis,
    /// One unit in metres, where it is known.
    pub metres_per_unit: Option<f32>,
    /// Name and kind of every attribute.
    pub attributes: Vec<String>,
    /// What is odd, each a sentence.
    pub warnings: Vec<String>,
}

impl Report {
    /// Measures a groom.
    pub fn of(groom: &Groom) -> Self {
        let mut lengths = Vec::with_capacity(groom.strand_count());
        let (mut zero_length_segments, mut chord_sum, mut long) = (0, 0.0_f64, 0_usize);
        for strand in groom.strands() {
            let length = polyline_length(strand);
            lengths.push(length);
            zero_length_segments += strand.windows(2).filter(|w| w[0] == w[1]).count();
            if let (true, Some(root), Some(tip)) = (length > 0.0, strand.first(), strand.last()) {
                chord_sum += f64::from(root.distance(*tip) / length);
                long += 1;
            }
        }
        let length = Spread::of(lengths.iter().copied()).unwrap_or_default();
        let middle = lengths.len() / 2;
        let median_length =
            if lengths.is_empty() { 0.0 } else { *lengths.select_nth_unstable_by(middle, f32::total_cmp).1 };
        let mut report = Self {
            strands: groom.strand_count(),
            points: groom.point_count(),
            points_per_strand: Spread::of(groom.strands().map(|s| s.len() as f32)).unwrap_or_default(),
            length,
            median_length,
            radius: groom.radius.as_ref().and_then(|r| Spread::of(r.iter().copied())),
            bounds: groom.bounds(),
            zero_length_segments,
            degenerate_strands: lengths.iter().filter(|&&l| l <= 1e-4 * median_length).count(),
            straightness: if long > 0 { (chord_sum / long as f64) as f32 } else { 0.0 },
            up: groom.up,
            metres_per_unit: groom.metres_per_unit,
            attributes: groom.attributes.iter().map(|(name, a)| describe(name, a)).collect(),
            warnings: Vec::new(),
        };
        report.warnings = report.oddities();
        report
    }

    fn oddities(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.strands == 0 {
            warnings.push("there are no strands".to_owned());
            return warnings;
        }
        if self.radius.is_none() {
            warnings.push("there are no widths; human hair has a radius of 30 to 60 micrometres".to_owned());
        }
        if let (Some(radius), Some(metres)) = (self.radius, self.metres_per_unit) {
            // Hair is 30 to 60 micrometres; ten times off in either direction is no hair.
            let micrometres = radius.mean * metres * 1e6;
            if !(3.0..=600.0).contains(&micrometres) {
                warnings.push(format!(
                    "the mean radius is {micrometres:.1} micrometres; hair has 30 to 60, so the unit or the \
                     widths are probably wrong"
                ));
            }
        }
        if let Some(metres) = self.metres_per_unit {
            let length = self.median_length * metres;
            if !(5e-4..=3.0).contains(&length) {
                warnings.push(format!(
                    "half of the strands are shorter than {length:.2e} metres; hair and fur have 0.0005 to 3, so \
                     the unit is probably wrong"
                ));
            }
        }
        if self.degenerate_strands * 100 > self.strands {
            warnings.push(format!(
                "{} of {} strands have next to no length; cleaning drops them",
                self.degenerate_strands, self.strands
            ));
        }
        if self.strands < 500 {
            warnings.push(format!(
                "{} strands are few; these may be guides to interpolate between, not hair to render",
                self.strands
            ));
        }
        warnings
    }
}

/// Name, domain and type of an attribute in a few words.
fn describe(name: &str, attribute: &Attribute) -> String {
    let kind = match attribute.values {
        Values::Float(_) => "float",
        Values::Vec3(_) => "vec3",
    };
    let domain = match attribute.domain {
        Domain::Groom => "groom",
        Domain::Strand => "strand",
        Domain::Point => "point",
    };
    format!("{name} ({kind} per {domain})")
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut row = |name: &str, value: &dyn fmt::Display| writeln!(f, "{name:<22} {value}");
        let points = self.points_per_strand;
        row("strands", &self.strands)?;
        row("points", &self.points)?;
        row("points per strand", &format_args!("{} / {:.1} / {}", points.min, points.mean, points.max))?;
        row("length", &self.length)?;
        row("median length", &format_args!("{:.4}", self.median_length))?;
        match self.radius {
            Some(radius) => {
                row("radius", &format_args!("{:.3e} / {:.3e} / {:.3e}", radius.min, radius.mean, radius.max))?
            }
            None => row("radius", &"none")?,
        }
        if let Some((low, high)) = self.bounds {
            row("bounds, least", &format_args!("{:.3} {:.3} {:.3}", low.x, low.y, low.z))?;
            row("bounds, greatest", &format_args!("{:.3} {:.3} {:.3}", high.x, high.y, high.z))?;
        }
        row("straightness", &format_args!("{:.3}", self.straightness))?;
        row("zero-length segments", &self.zero_length_segments)?;
        row("degenerate strands", &self.degenerate_strands)?;
        match self.metres_per_unit {
            Some(metres) => row("metres per unit", &metres)?,
            None => row("metres per unit", &"unknown")?,
        }
        for attribute in &self.attributes {
            row("attribute", attribute)?;
        }
        for warning in &self.warnings {
            row("warning", warning)?;
        }
        Ok(())
    }
}

/// What [`clean`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CleanCounts {
    /// Strands without length that went.
    pub strands_dropped: usize,
    /// Points that went because their predecessor is at the same place; those of dropped strands not counted.
    pub points_merged: usize,
}

impl CleanCounts {
    /// What was done, as sentences for the user; none if nothing was.
    pub fn warnings(&self) -> Vec<String> {
        let mut out = Vec::new();
        if self.strands_dropped > 0 {
            out.push(format!("{} strands without length were left out", self.strands_dropped));
        }
        if self.points_merged > 0 {
            out.push(format!("{} points at the place of their predecessor were merged", self.points_merged));
        }
        out
    }
}

/// Merges consecutive points of a strand that coincide, while at least two remain, and, if `drop_degenerate`,
/// drops strands that have no length or less than a millionth of the bounding box's diagonal.
///
/// Widths and attributes follow their points and strands. A strand keeps its root and its tip.
pub fn clean(mut groom: Groom, drop_degenerate: bool) -> (Groom, CleanCounts) {
    let diagonal = groom.bounds().map_or(0.0, |(low, high)| low.distance(high));
    let mut counts = CleanCounts::default();
    let (mut strands, mut points, mut points_per_strand) = (Vec::new(), Vec::new(), Vec::new());
    let mut kept: Vec<u32> = Vec::new();
    for strand in 0..groom.strand_count() {
        let line = groom.strand(strand);
        let length = polyline_length(line);
        if drop_degenerate && (length == 0.0 || length < 1e-6 * diagonal) {
            counts.strands_dropped += 1;
            continue;
        }
        let first = groom.point_range(strand).start as u32;
        let last = line.len() - 1;
        kept.clear();
        for (i, p) in line.iter().enumerate() {
            let coincides = i > 0 && *p == line[i - 1];
            if coincides && i == last && kept.len() > 1 {
                // The tip stays and its twin goes, because the tip's width is the one that shows.
                kept.pop();
            } else if coincides && !(i == last && kept.len() == 1) {
                continue;
            }
            kept.push(first + i as u32);
        }
        counts.points_merged += line.len() - kept.len();
        strands.push(strand as u32);
        points_per_strand.push(kept.len() as u32);
        points.extend_from_slice(&kept);
    }
    if counts != CleanCounts::default() {
        groom.select(&strands, &points, &points_per_strand);
    }
    (groom, counts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample() -> Groom {
        let p = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let points = vec![
            // Straight, with a doubled middle.
            p(0.0, 0.0),
            p(0.0, 1.0),
            p(0.0, 1.0),
            p(0.0, 2.0),
            // No length.
            p(5.0, 5.0),
            p(5.0, 5.0),
            // Bent by a right angle.
            p(1.0, 0.0),
            p(2.0, 0.0),
            p(2.0, 1.0),
        ];
        Groom::new(points, [4, 2, 3]).unwrap()
    }

    #[test]
    fn reports_count_what_is_there() {
        let r = Report::of(&sample());
        assert_eq!((r.strands, r.points), (3, 9));
        assert_eq!(r.points_per_strand, Spread { min: 2.0, mean: 3.0, max: 4.0 });
        assert_eq!((r.length.min, r.length.max, r.median_length), (0.0, 2.0, 2.0));
        assert_eq!((r.zero_length_segments, r.degenerate_strands), (2, 1));
        // Chord over length is 1 and 1/√2.
        assert!((r.straightness - 0.5 * (1.0 + 0.5_f32.sqrt())).abs() < 1e-6);
        assert_eq!(r.warnings.len(), 3, "no widths, degenerate, few: {:?}", r.warnings);
        let text = r.to_string();
        assert!(text.contains("zero-length segments   2") && text.contains("warning"), "{text}");
    }

    #[test]
    fn implausible_widths_are_pointed_out() {
        let mut g = sample();
        g.metres_per_unit = Some(0.01);
        g.set_radius(vec![0.004; 9]).unwrap();
        let fine = Report::of(&g).warnings.len();
        g.set_radius(vec![0.4; 9]).unwrap();
        assert_eq!(Report::of(&g).warnings.len(), fine + 1);
    }

    #[test]
    fn cleaning_merges_and_drops() {
        let mut g = sample();
        g.set_radius((0..9).map(|i| i as f32).collect()).unwrap();
        let (clean_one, counts) = clean(g.clone(), true);
        assert_eq!(counts, CleanCounts { strands_dropped: 1, points_merged: 1 });
        assert_eq!((clean_one.strand_count(), clean_one.point_count()), (2, 6));
        assert_eq!(clean_one.radius, Some(vec![0.0, 1.0, 3.0, 6.0, 7.0, 8.0]));
        let (kept, counts) = clean(g, false);
        assert_eq!(counts, CleanCounts { strands_dropped: 0, points_merged: 1 });
        assert_eq!(kept.strand_count(), 3);
    }

    proptest! {
        /// Cleaning accounts for every point, keeps roots and tips and has nothing left to do afterwards.
        #[test]
        fn clean_accounts_for_everything(
            strands in prop::collection::vec(prop::collection::vec(0..3_i8, 2..7), 0..12),
            drop: bool,
        ) {
            // A coarse lattice makes coincidences common.
            let points = strands.iter().flatten().map(|&x| Vec3::new(f32::from(x), 0.0, 0.0)).collect();
            let groom = Groom::new(points, strands.iter().map(|s| s.len() as u32)).unwrap();
            let before = groom.clone();
            let (after, counts) = clean(groom, drop);

            prop_assert_eq!(after.strand_count() + counts.strands_dropped, before.strand_count());
            let survivors: Vec<usize> =
                (0..before.strand_count()).filter(|&s| !drop || before.strand_length(s) > 0.0).collect();
            prop_assert_eq!(survivors.len(), after.strand_count());
            let had: usize = survivors.iter().map(|&s| before.strand(s).len()).sum();
            prop_assert_eq!(after.point_count() + counts.points_merged, had);
            for (now, &s) in survivors.iter().enumerate() {
                let (new, old) = (after.strand(now), before.strand(s));
                prop_assert!(new.len() >= 2);
                prop_assert_eq!((new[0], new[new.len() - 1]), (old[0], old[old.len() - 1]));
                prop_assert_eq!(after.strand_length(now), before.strand_length(s));
                prop_assert!(new.len() == 2 || new.windows(2).all(|w| w[0] != w[1]));
            }
            let (again, nothing) = clean(after.clone(), drop);
            prop_assert_eq!(nothing, CleanCounts::default());
            prop_assert_eq!(again, after);
        }
    }
}
