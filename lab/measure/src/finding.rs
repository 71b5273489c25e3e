//! What the thesis found, what was measured here, and whether that agrees.

use crate::table::number;

/// One sentence of the thesis beside our numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What the thesis says, in our words.
    pub claim: String,
    /// Its number or order.
    pub thesis: String,
    /// Ours.
    pub found: String,
    /// Whether they agree; `None` where something was not measured.
    pub agrees: Option<bool>,
}

impl Finding {
    /// Things whose numbers should rise in the order in which they stand.
    pub fn order(claim: impl Into<String>, rising: &[(&str, f64)]) -> Self {
        let known = rising.len() > 1 && rising.iter().all(|(_, x)| x.is_finite());
        let mut found = rising.to_vec();
        // What was not measured comes last, in the order of the thesis.
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        let told: Vec<String> = found.iter().map(|(name, x)| format!("{name} {}", number(*x))).collect();
        Self {
            claim: claim.into(),
            thesis: rising.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" < "),
            found: told.join(" < "),
            agrees: known.then(|| rising.windows(2).all(|pair| pair[0].1 < pair[1].1)),
        }
    }

    /// A ratio, which agrees within the share `within` of the thesis's.
    pub fn ratio(claim: impl Into<String>, thesis: f64, found: f64, within: f64) -> Self {
        Self {
            claim: claim.into(),
            thesis: format!("{} ± {:.0} %", number(thesis), 100.0 * within),
            found: number(found),
            agrees: found.is_finite().then(|| (found - thesis).abs() <= within * thesis.abs()),
        }
    }

    /// A number that should be below another.
    pub fn below(claim: impl Into<String>, most: f64, found: f64) -> Self {
        Self {
            claim: claim.into(),
            thesis: format!("below {}", number(most)),
            found: number(found),
            agrees: found.is_finite().then_some(found < most),
        }
    }

    /// A number that should be above another.
    pub fn above(claim: impl Into<String>, least: f64, found: f64) -> Self {
        Self {
            claim: claim.into(),
            thesis: format!("above {}", number(least)),
            found: number(found),
            agrees: found.is_finite().then_some(found > least),
        }
    }

    /// The verdict in words.
    pub fn verdict(&self) -> &'static str {
        match self.agrees {
            Some(true) => "reproduced",
            Some(false) => "not reproduced",
            None => "not measured",
        }
    }

    /// How many of some agree, for an index: `3 of 4`, those that were measured.
    pub fn tally(findings: &[Self]) -> String {
        let agree = findings.iter().filter(|finding| finding.agrees == Some(true)).count();
        let measured = findings.iter().filter(|finding| finding.agrees.is_some()).count();
        format!("{agree} of {measured}")
    }
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
        assert_eq!((found.thesis.as_str(), found.agrees), ("dbk < k-plus < a-buffer", Some(true)));
        let found = Finding::order("faster", &[("dbk", 4.0), ("k-plus", 3.0)]);
        assert_eq!((found.found.as_str(), found.verdict()), ("k-plus 3.00 < dbk 4.00", "not reproduced"));
        // Equal is not faster.
        assert_eq!(Finding::order("", &[("a", 1.0), ("b", 1.0)]).agrees, Some(false));
        let found = Finding::order("faster", &[("dbk", f64::NAN), ("k-plus", 3.0)]);
        assert_eq!((found.agrees, found.verdict()), (None, "not measured"));
        assert_eq!(Finding::order("", &[("alone", 1.0)]).agrees, None);
    }

    #[test]
    fn ratios_and_bounds_follow_from_the_numbers() {
        assert_eq!(Finding::ratio("", 0.4, 0.36, 0.11).agrees, Some(true));
        assert_eq!(Finding::ratio("", 0.4, 0.35, 0.11).agrees, Some(false));
        assert_eq!(Finding::ratio("", 0.4, f64::NAN, 1.0).agrees, None);
        assert_eq!(Finding::ratio("", 0.4, f64::INFINITY, 1.0).agrees, None);
        assert_eq!(
            (Finding::below("", 0.45, 0.44).agrees, Finding::below("", 0.45, 0.45).agrees),
            (Some(true), Some(false))
        );
        assert_eq!(
            (Finding::above("", 1.0, 1.1).agrees, Finding::above("", 1.0, 1.0).agrees),
            (Some(true), Some(false))
        );
        let all = [Finding::below("", 1.0, 0.0), Finding::below("", 1.0, 2.0), Finding::below("", 1.0, f64::NAN)];
        assert_eq!(Finding::tally(&all), "1 of 2");
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!((median(vec![9.0, 1.0, 2.0]), median(vec![4.0, 1.0])), (2.0, 2.5));
        assert!(median(Vec::new()).is_nan());
    }
}
