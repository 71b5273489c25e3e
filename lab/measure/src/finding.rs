//! What was expected, what was measured here, and whether that agrees.

use crate::table::number;

/// Whether what was found is what was wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is.
    Yes,
    /// It is not.
    No,
    /// The repeats differ by more than the things that are compared.
    Unclear,
    /// Something was not measured.
    Unknown,
}

impl Verdict {
    fn of(known: bool, holds: bool) -> Self {
        match (known, holds) {
            (false, _) => Self::Unknown,
            (true, true) => Self::Yes,
            (true, false) => Self::No,
        }
    }
}

/// A number, and the least and the most that repeats of its measurement gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measured {
    pub(crate) middle: f64,
    pub(crate) least: f64,
    pub(crate) most: f64,
}

impl Measured {
    /// What was not measured.
    pub(crate) const UNKNOWN: Self = Self { middle: f64::NAN, least: f64::NAN, most: f64::NAN };

    /// What does not differ from repeat to repeat.
    pub(crate) fn exact(x: f64) -> Self {
        Self { middle: x, least: x, most: x }
    }

    /// The ratio to another one, which is positive, with all that the repeats leave open.
    pub(crate) fn over(self, other: Self) -> Self {
        Self { middle: self.middle / other.middle, least: self.least / other.most, most: self.most / other.least }
    }

    fn is_known(self) -> bool {
        [self.middle, self.least, self.most].iter().all(|x| x.is_finite())
    }

    /// Whether it is below another one; `None` where the repeats of both overlap.
    fn is_below(self, other: Self) -> Option<bool> {
        if self.most < other.least {
            return Some(true);
        }
        // Without any spread, equal is not below.
        let exact = self.least == self.most && other.least == other.most;
        (exact || self.least > other.most).then_some(false)
    }
}

/// One sentence beside our numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What the thesis says, in our words, or what we aim at.
    pub claim: String,
    /// The number or order that is wanted.
    pub wanted: String,
    /// Ours.
    pub found: String,
    /// Whether they agree.
    pub verdict: Verdict,
    /// Whether the number or order is our own aim, and not one of the thesis.
    pub ours: bool,
}

impl Finding {
    /// Numbers that should rise in the order in which they stand.
    pub fn order(claim: impl Into<String>, rising: &[(&str, f64)]) -> Self {
        let exact: Vec<(&str, Measured)> = rising.iter().map(|&(name, x)| (name, Measured::exact(x))).collect();
        Self::order_of(claim, &exact)
    }

    /// The same of numbers with a spread: an order counts only where no two of them overlap.
    pub(crate) fn order_of(claim: impl Into<String>, rising: &[(&str, Measured)]) -> Self {
        let known = rising.len() > 1 && rising.iter().all(|(_, x)| x.is_known());
        let mut pairs = Vec::new();
        for (i, (_, a)) in rising.iter().enumerate() {
            pairs.extend(rising[i + 1..].iter().map(|(_, b)| a.is_below(*b)));
        }
        let verdict = if !known {
            Verdict::Unknown
        } else if pairs.contains(&Some(false)) {
            Verdict::No
        } else if pairs.contains(&None) {
            Verdict::Unclear
        } else {
            Verdict::Yes
        };
        let mut found = rising.to_vec();
        // What was not measured comes last, in the order that is wanted.
        found.sort_by(|a, b| a.1.middle.total_cmp(&b.1.middle));
        let told: Vec<String> = found.iter().map(|(name, x)| format!("{name} {}", number(x.middle))).collect();
        Self {
            claim: claim.into(),
            wanted: rising.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" < "),
            found: told.join(" < "),
            verdict,
            ours: false,
        }
    }

    /// A ratio, which agrees within the share `within` of the one that is wanted.
    pub fn ratio(claim: impl Into<String>, wanted: f64, found: f64, within: f64) -> Self {
        let told = format!("{} ± {:.0} %", number(wanted), 100.0 * within);
        Self::judged(claim, told, found, (found - wanted).abs() <= within * wanted.abs())
    }

    /// A number that should lie between two others, which count.
    pub fn between(claim: impl Into<String>, [least, most]: [f64; 2], found: f64) -> Self {
        let told = format!("{} to {}", number(least), number(most));
        Self::judged(claim, told, found, (least..=most).contains(&found))
    }

    /// A number that should be below another.
    pub fn below(claim: impl Into<String>, most: f64, found: f64) -> Self {
        Self::judged(claim, format!("below {}", number(most)), found, found < most)
    }

    /// A number that should be above another.
    pub fn above(claim: impl Into<String>, least: f64, found: f64) -> Self {
        Self::judged(claim, format!("above {}", number(least)), found, found > least)
    }

    fn judged(claim: impl Into<String>, wanted: String, found: f64, holds: bool) -> Self {
        let verdict = Verdict::of(found.is_finite(), holds);
        Self { claim: claim.into(), wanted, found: number(found), verdict, ours: false }
    }

    /// The same as our own aim: the thesis has no such number or order.
    #[must_use]
    pub fn ours(self) -> Self {
        Self { ours: true, ..self }
    }

    /// The verdict in words.
    pub fn told(&self) -> &'static str {
        match (self.verdict, self.ours) {
            (Verdict::Yes, false) => "reproduced",
            (Verdict::No, false) => "not reproduced",
            (Verdict::Yes, true) => "met",
            (Verdict::No, true) => "not met",
            (Verdict::Unclear, _) => "within the spread",
            (Verdict::Unknown, _) => "not measured",
        }
    }

    /// How many findings of the thesis agree, for an index: `3 of 4`, those that were measured; `-` where none was.
    pub fn tally(findings: &[Self]) -> String {
        count(findings.iter().filter(|finding| !finding.ours))
    }

    /// The same of our own aims.
    pub fn aims(findings: &[Self]) -> String {
        count(findings.iter().filter(|finding| finding.ours))
    }
}

fn count<'f>(findings: impl Iterator<Item = &'f Finding>) -> String {
    let measured: Vec<&Finding> = findings.filter(|finding| finding.verdict != Verdict::Unknown).collect();
    if measured.is_empty() {
        return "-".into();
    }
    let agree = measured.iter().filter(|finding| finding.verdict == Verdict::Yes).count();
    format!("{agree} of {}", measured.len())
}

/// The middle one, or the mean of the two in the middle; NaN of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_follow_from_the_numbers() {
        let found = Finding::order("faster", &[("dbk", 2.0), ("k-plus", 3.0), ("a-buffer", 10.0)]);
        assert_eq!((found.wanted.as_str(), found.verdict), ("dbk < k-plus < a-buffer", Verdict::Yes));
        let found = Finding::order("faster", &[("dbk", 4.0), ("k-plus", 3.0)]);
        assert_eq!((found.found.as_str(), found.told()), ("k-plus 3.00 < dbk 4.00", "not reproduced"));
        // Equal is not faster.
        assert_eq!(Finding::order("", &[("a", 1.0), ("b", 1.0)]).verdict, Verdict::No);
        let found = Finding::order("faster", &[("dbk", f64::NAN), ("k-plus", 3.0)]);
        assert_eq!((found.verdict, found.told()), (Verdict::Unknown, "not measured"));
        assert_eq!(Finding::order("", &[("alone", 1.0)]).verdict, Verdict::Unknown);
    }

    #[test]
    fn an_order_needs_repeats_that_do_not_overlap() {
        let time = |least, middle, most| Measured { middle, least, most };
        let (short, long) = (time(1.0, 2.0, 3.0), time(4.0, 5.0, 6.0));
        let order = |times: &[Measured]| {
            let named: Vec<(&str, Measured)> = times.iter().map(|time| ("x", *time)).collect();
            Finding::order_of("", &named)
        };
        assert_eq!(order(&[short, long]).verdict, Verdict::Yes);
        assert_eq!(order(&[long, short]).verdict, Verdict::No);
        // Either order may be right, whichever middle is smaller.
        let between = time(2.5, 3.5, 4.5);
        for unclear in [[short, between], [between, short], [between, long]] {
            let found = order(&unclear);
            assert_eq!((found.verdict, found.told()), (Verdict::Unclear, "within the spread"));
        }
        assert_eq!(order(&[short, between, long]).verdict, Verdict::Unclear);
        // Neighbours overlap, but the first is above the last.
        assert_eq!(order(&[long, between, short]).verdict, Verdict::No);
        assert_eq!(order(&[short, Measured::UNKNOWN]).verdict, Verdict::Unknown);
        assert_eq!(long.over(short), time(4.0 / 3.0, 2.5, 6.0));
    }

    #[test]
    fn ratios_and_bounds_follow_from_the_numbers() {
        use Verdict::{No, Unknown, Yes};
        assert_eq!(Finding::ratio("", 0.4, 0.36, 0.11).verdict, Yes);
        assert_eq!(Finding::ratio("", 0.4, 0.35, 0.11).verdict, No);
        assert_eq!(Finding::ratio("", 0.4, f64::NAN, 1.0).verdict, Unknown);
        assert_eq!(Finding::ratio("", 0.4, f64::INFINITY, 1.0).verdict, Unknown);
        let verdicts = [0.44, 0.45].map(|x| Finding::below("", 0.45, x).verdict);
        assert_eq!(verdicts, [Yes, No]);
        let verdicts = [1.1, 1.0].map(|x| Finding::above("", 1.0, x).verdict);
        assert_eq!(verdicts, [Yes, No]);
        let verdicts = [0.99, 1.0, 1.25, 1.26, f64::NAN].map(|x| Finding::between("", [1.0, 1.25], x).verdict);
        assert_eq!(verdicts, [No, Yes, Yes, No, Unknown]);
    }

    #[test]
    fn our_aims_are_no_findings_of_the_thesis() {
        let found = |x| Finding::below("", 1.0, x);
        let all = [found(0.0), found(2.0), found(f64::NAN), found(0.5).ours(), found(3.0).ours(), found(4.0).ours()];
        assert_eq!((Finding::tally(&all), Finding::aims(&all)), ("1 of 2".into(), "1 of 3".into()));
        assert_eq!((Finding::tally(&all[2..]), Finding::aims(&all[..3])), ("-".into(), "-".into()));
        assert_eq!((all[3].told(), all[4].told(), all[0].told()), ("met", "not met", "reproduced"));
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!((median(vec![9.0, 1.0, 2.0]), median(vec![4.0, 1.0])), (2.0, 2.5));
        assert!(median(Vec::new()).is_nan());
    }
}
