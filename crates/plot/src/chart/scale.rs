//! From values to positions, and where the ticks stand.

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm; only positive values have a place.
    Log,
}

/// Where the ticks of an axis stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Ticks {
    /// At round numbers.
    #[default]
    Auto,
    /// At round angles, for values in degrees.
    Degrees,
    /// At these values with these labels.
    At(Vec<(f64, String)>),
    /// Nowhere.
    None,
}

/// One axis as it is asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What it shows, with its unit: `"θ_{s}"`, `"albedo"`, `"time / s"`.
    pub label: String,
    /// How values are spread.
    pub scale: Scale,
    /// First and last value; from the data if left out.
    pub range: Option<(f64, f64)>,
    /// Where ticks stand.
    pub ticks: Ticks,
}

impl Axis {
    /// A linear axis over the data.
    pub fn new(label: &str) -> Self {
        Self { label: label.to_owned(), ..Self::default() }
    }

    /// A logarithmic axis over the data.
    pub fn log(label: &str) -> Self {
        Self { scale: Scale::Log, ..Self::new(label) }
    }

    /// A linear axis of degrees over a range.
    pub fn degrees(label: &str, first: f64, last: f64) -> Self {
        Self { range: Some((first, last)), ticks: Ticks::Degrees, ..Self::new(label) }
    }

    /// The same axis over a range.
    pub fn over(self, first: f64, last: f64) -> Self {
        Self { range: Some((first, last)), ..self }
    }
}

/// Values larger than this are not drawn: no axis reaches them.
const LARGEST: f64 = 1e300;

/// An axis with everything decided.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ruler {
    scale: Scale,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
    pub(crate) major: Vec<(f64, String)>,
    pub(crate) minor: Vec<f64>,
}

impl Ruler {
    /// `padded` gives data that touch the ends some room, and starts at 0 where that is near.
    pub(crate) fn new(axis: &Axis, data: impl Iterator<Item = f64>, wanted: usize, padded: bool) -> Self {
        let log = axis.scale == Scale::Log;
        // Beyond this, room and steps overflow.
        let usable = |x: f64| x.abs() <= LARGEST && (!log || x >= 1.0 / LARGEST);
        let range = axis.range.filter(|&(lo, hi)| usable(lo) && usable(hi) && lo != hi);
        let (mut lo, mut hi) = range.unwrap_or_else(|| {
            let none = (f64::INFINITY, f64::NEG_INFINITY);
            data.filter(|&x| usable(x)).fold(none, |(lo, hi), x| (lo.min(x), hi.max(x)))
        });
        // An axis that was asked for may run backwards.
        if range.is_none() {
            if lo > hi {
                // No data at all.
                (lo, hi) = if log { (0.1, 1.0) } else { (0.0, 1.0) };
            }
            (lo, hi) = if log { roomy_log(lo, hi, padded) } else { roomy_linear(lo, hi, padded, wanted) };
        }
        let (major, minor) = match &axis.ticks {
            Ticks::None => (Vec::new(), Vec::new()),
            Ticks::At(ticks) => {
                let inside = |x: f64| x >= lo.min(hi) && x <= lo.max(hi);
                (ticks.iter().filter(|(x, _)| inside(*x)).cloned().collect(), Vec::new())
            }
            Ticks::Degrees => degree_ticks(lo, hi, wanted),
            Ticks::Auto if log => log_ticks(lo, hi, wanted),
            Ticks::Auto => linear_ticks(lo, hi, wanted),
        };
        Self { scale: axis.scale, lo, hi, major, minor }
    }

    /// Where a value stands: 0 at the first, 1 at the last; none for what has no place.
    pub(crate) fn at(&self, x: f64) -> Option<f64> {
        let t = match self.scale {
            Scale::Linear => (x - self.lo) / (self.hi - self.lo),
            Scale::Log => (x.ln() - self.lo.ln()) / (self.hi.ln() - self.lo.ln()),
        };
        // Far outside is outside: files need no numbers with twenty digits.
        t.is_finite().then(|| t.clamp(-20.0, 21.0))
    }
}

fn roomy_linear(lo: f64, hi: f64, padded: bool, wanted: usize) -> (f64, f64) {
    if lo == hi {
        let room = if lo == 0.0 { 1.0 } else { 0.5 * lo.abs() };
        return (lo - room, hi + room);
    }
    if !padded {
        return (lo, hi);
    }
    // A scale that nearly begins at zero does begin there: lengths can then be compared.
    let lo = if lo > 0.0 && lo < 0.4 * hi { 0.0 } else { lo };
    let step = nice_step((hi - lo) * 1.02, wanted, &[1.0, 2.0, 5.0]);
    let top = hi + 0.02 * (hi - lo);
    let bottom = if lo == 0.0 { 0.0 } else { lo - 0.02 * (hi - lo) };
    // To the next half step, so that neither room nor a tick at the end is missing.
    ((bottom / (0.5 * step)).floor() * 0.5 * step, (top / (0.5 * step)).ceil() * 0.5 * step)
}

fn roomy_log(lo: f64, hi: f64, padded: bool) -> (f64, f64) {
    if lo == hi {
        return ((lo / 3.0).max(1.0 / LARGEST), (hi * 3.0).min(LARGEST));
    }
    if padded {
        let room = (hi / lo).powf(0.04);
        ((lo / room).max(1.0 / LARGEST), (hi * room).min(LARGEST))
    } else {
        (lo, hi)
    }
}

/// The smallest round step that cuts `span` into at most `wanted` pieces.
fn nice_step(span: f64, wanted: usize, round: &[f64]) -> f64 {
    let rough = span.abs() / wanted.max(1) as f64;
    let decade = 10_f64.powf(rough.log10().floor());
    round.iter().chain(&[10.0]).map(|r| r * decade).find(|step| *step >= rough * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
}

/// Multiples of `step` from the smaller to the larger end.
fn multiples(lo: f64, hi: f64, step: f64) -> Vec<f64> {
    let (lo, hi) = (lo.min(hi), lo.max(hi));
    let (first, last) = ((lo / step - 1e-6).ceil(), (hi / step + 1e-6).floor());
    // A range of rounding errors around a huge number has no ticks, rather than endless ones.
    let count = if (last - first) < 1000.0 { (last - first + 1.0).max(0.0) as usize } else { 0 };
    (0..count).map(|i| (first + i as f64) * step).collect()
}

pub(crate) fn linear_ticks(lo: f64, hi: f64, wanted: usize) -> (Vec<(f64, String)>, Vec<f64>) {
    let step = nice_step(hi - lo, wanted, &[1.0, 2.0, 5.0]);
    let major = multiples(lo, hi, step).into_iter().map(|x| (x, label(x, step))).collect();
    (major, multiples(lo, hi, 0.5 * step))
}

fn degree_ticks(lo: f64, hi: f64, wanted: usize) -> (Vec<(f64, String)>, Vec<f64>) {
    let rough = (hi - lo).abs() / wanted.max(1) as f64;
    let steps = [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0];
    let step = steps.into_iter().find(|step| *step >= rough * (1.0 - 1e-9)).unwrap_or(360.0);
    let major = multiples(lo, hi, step).into_iter().map(|x| (x, format!("{}°", label(x, step)))).collect();
    (major, multiples(lo, hi, step / 3.0))
}

pub(crate) fn log_ticks(lo: f64, hi: f64, wanted: usize) -> (Vec<(f64, String)>, Vec<f64>) {
    let (lo, hi) = (lo.min(hi), lo.max(hi));
    let (first, last) = (lo.log10().floor() as i32, hi.log10().ceil() as i32);
    let inside = |x: &f64| *x >= lo * (1.0 - 1e-9) && *x <= hi * (1.0 + 1e-9);
    let every = |multipliers: &[f64]| -> Vec<f64> {
        (first..=last).flat_map(|p| multipliers.iter().map(move |m| m * 10_f64.powi(p))).filter(inside).collect()
    };
    let minor = every(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    let decades = every(&[1.0]);
    if decades.len() >= 3 {
        let stride = decades.len().div_ceil(wanted.max(1)) as i32;
        let major = decades.into_iter().filter(|x| x.log10().round() as i32 % stride == 0);
        return (major.map(|x| (x, power(x.log10().round() as i32))).collect(), minor);
    }
    // Less than two whole decades: plain numbers in between.
    let mut values = every(&[1.0, 2.0, 5.0]);
    if values.len() < 2 {
        values = linear_ticks(lo, hi, wanted).0.into_iter().map(|(x, _)| x).filter(|x| *x > 0.0).collect();
    }
    (values.into_iter().map(|x| (x, plain(x))).collect(), minor)
}

fn power(exponent: i32) -> String {
    match exponent {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        _ => format!("10^{{{}}}", minus(&exponent.to_string())),
    }
}

/// A tick's value with as many decimals as its step has.
fn label(x: f64, step: f64) -> String {
    // Multiples of a step are exact up to rounding; without this a zero can be −0.
    let x = if x.abs() < 1e-9 * step { 0.0 } else { x };
    if x != 0.0 && (x.abs() >= 1e5 || step < 1e-4) {
        return plain(x);
    }
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    minus(&format!("{x:.decimals$}"))
}

/// A number in few digits.
pub(crate) fn plain(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&x.abs()) {
        let text = format!("{x:.2e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((text.as_str(), "0"));
        let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
        let exponent = minus(exponent);
        return match mantissa {
            "1" => format!("10^{{{exponent}}}"),
            _ => format!("{}×10^{{{exponent}}}", minus(mantissa)),
        };
    }
    let decimals = (2.0 - x.abs().log10().floor()).clamp(0.0, 5.0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { minus(text.trim_end_matches('0').trim_end_matches('.')) } else { minus(&text) }
}

/// A hyphen is no minus sign.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, data: &[f64]) -> Vec<String> {
        let ruler = Ruler::new(axis, data.iter().copied(), 6, false);
        ruler.major.into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(labels(&Axis::new(""), &[0.0, 1.0]), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&Axis::new("").over(-3.0, 3.0), &[]), ["−3", "−2", "−1", "0", "1", "2", "3"]);
        assert_eq!(labels(&Axis::degrees("", -90.0, 90.0), &[]), ["−90°", "−60°", "−30°", "0°", "30°", "60°", "90°"]);
        assert_eq!(labels(&Axis::log("").over(1e-3, 10.0), &[]), ["10^{−3}", "10^{−2}", "10^{−1}", "1", "10"]);
        assert_eq!(labels(&Axis::log("").over(0.15, 3.0), &[]), ["0.2", "0.5", "1", "2"]);
    }

    #[test]
    fn ticks_lie_inside_whatever_the_range() {
        for i in 0..400 {
            let centre = 1e3 * f64::from(math::hash::signed(i, 1));
            let span = 10_f64.powf(6.0 * f64::from(math::hash::signed(i, 2)));
            let ruler = Ruler::new(&Axis::new("").over(centre, centre + span), std::iter::empty(), 6, false);
            assert!(ruler.major.len() <= 8, "{} ticks", ruler.major.len());
            assert!(ruler.major.len() >= 2, "{centre} {span}: {:?}", ruler.major);
            for (x, _) in &ruler.major {
                let t = ruler.at(*x).unwrap();
                assert!((-1e-5..=1.0 + 1e-5).contains(&t), "{centre} {span}: tick at {t}");
            }
        }
    }

    #[test]
    fn values_have_their_places() {
        let ruler = Ruler::new(&Axis::log("").over(1e-2, 1e2), std::iter::empty(), 6, false);
        assert!((ruler.at(1.0).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!((ruler.at(0.0), ruler.at(-1.0), ruler.at(f64::NAN)), (None, None, None));
        // An axis may run backwards.
        let ruler = Ruler::new(&Axis::new("").over(10.0, 0.0), std::iter::empty(), 6, false);
        assert_eq!((ruler.at(10.0), ruler.at(0.0)), (Some(0.0), Some(1.0)));
    }

    #[test]
    fn odd_data_still_make_an_axis() {
        let cases: [&[f64]; 6] = [&[], &[f64::NAN], &[3.0], &[0.0, 0.0], &[f64::INFINITY, 1.0], &[-1.0, -1.0]];
        for data in cases {
            for axis in [Axis::new(""), Axis::log("")] {
                let ruler = Ruler::new(&axis, data.iter().copied(), 6, true);
                assert!(ruler.lo.is_finite() && ruler.hi > ruler.lo, "{data:?}: {ruler:?}");
            }
        }
    }

    #[test]
    fn numbers_are_written_as_people_do() {
        let small = [(0.0, "0"), (0.02, "0.02"), (-0.5, "−0.5"), (1.0, "1"), (1e-4, "10^{−4}")];
        let large = [(1234.2, "1234"), (2.5e6, "2.5×10^{6}")];
        for (x, text) in small.into_iter().chain(large) {
            assert_eq!(plain(x), text);
        }
    }
}
