use std::fmt;

/// An sRGB colour, 8 bits per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Colour(pub [u8; 3]);

impl Colour {
    /// Okabe and Ito's orange.
    pub const ORANGE: Self = Self([0xe6, 0x9f, 0x00]);
    /// Okabe and Ito's sky blue.
    pub const SKY: Self = Self([0x56, 0xb4, 0xe9]);
    /// Okabe and Ito's bluish green.
    pub const GREEN: Self = Self([0x00, 0x9e, 0x73]);
    /// Okabe and Ito's yellow; too light for thin lines.
    pub const YELLOW: Self = Self([0xf0, 0xe4, 0x42]);
    /// Okabe and Ito's blue.
    pub const BLUE: Self = Self([0x00, 0x72, 0xb2]);
    /// Okabe and Ito's vermilion.
    pub const VERMILION: Self = Self([0xd5, 0x5e, 0x00]);
    /// Okabe and Ito's reddish purple.
    pub const PURPLE: Self = Self([0xcc, 0x79, 0xa7]);
    /// Text and sums.
    pub const INK: Self = Self([0x1c, 0x1c, 0x1c]);
    /// Axes and secondary text.
    pub const GREY: Self = Self([0x4a, 0x4a, 0x4a]);
    /// Lines of the grid.
    pub const GRID: Self = Self([0xe2, 0xe2, 0xe2]);
    /// Lines of the fine grid, and where there is no value.
    pub const FAINT: Self = Self([0xf1, 0xf1, 0xf1]);
    /// Paper.
    pub const WHITE: Self = Self([0xff, 0xff, 0xff]);

    /// The order in which series take their colours: told apart with any kind of colour vision.
    ///
    /// Source: Okabe and Ito, Color Universal Design (2008), less the yellow, which vanishes on paper.
    pub const SERIES: [Self; 7] =
        [Self::BLUE, Self::VERMILION, Self::GREEN, Self::PURPLE, Self::ORANGE, Self::SKY, Self::INK];

    /// The colour between two, `t` in `0..=1`, straight in encoded values.
    pub fn mix(self, other: Self, t: f64) -> Self {
        let mut mixed = [0; 3];
        for ((mixed, a), b) in mixed.iter_mut().zip(self.0).zip(other.0) {
            let (a, b) = (f64::from(a), f64::from(b));
            *mixed = (a + (b - a) * t.clamp(0.0, 1.0)).round() as u8;
        }
        Self(mixed)
    }
}

impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [r, g, b] = self.0;
        write!(f, "#{r:02x}{g:02x}{b:02x}")
    }
}

/// How a number in `0..=1` becomes a colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColourMap {
    /// Dark purple to yellow, lightness rising evenly: nine stops of the map "viridis" (Smith and van der
    /// Walt, CC0), straight between them.
    #[default]
    Viridis,
    /// Blue over white to vermilion, the middle at 0.5: for ratios and differences.
    Diverging,
}

const VIRIDIS: [Colour; 9] = [
    Colour([0x44, 0x01, 0x54]),
    Colour([0x47, 0x2d, 0x7b]),
    Colour([0x3b, 0x52, 0x8b]),
    Colour([0x2c, 0x72, 0x8e]),
    Colour([0x21, 0x91, 0x8c]),
    Colour([0x28, 0xae, 0x80]),
    Colour([0x5e, 0xc9, 0x62]),
    Colour([0xad, 0xdc, 0x30]),
    Colour([0xfd, 0xe7, 0x25]),
];
const DIVERGING: [Colour; 5] = [
    Colour([0x00, 0x4a, 0x80]),
    Colour([0x5c, 0xa9, 0xd6]),
    Colour([0xf7, 0xf7, 0xf7]),
    Colour([0xee, 0x9a, 0x5c]),
    Colour([0x8f, 0x36, 0x00]),
];

impl ColourMap {
    /// The colour at `t`, clamped into `0..=1`; no value (NaN) is light grey.
    pub fn at(self, t: f64) -> Colour {
        if t.is_nan() {
            return Colour::GRID;
        }
        let stops: &[Colour] = match self {
            Self::Viridis => &VIRIDIS,
            Self::Diverging => &DIVERGING,
        };
        let last = stops.len() - 1;
        let x = t.clamp(0.0, 1.0) * last as f64;
        let i = (x as usize).min(last - 1);
        stops[i].mix(stops[i + 1], x - i as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE lightness, 0 to 100, of an sRGB colour.
    fn lightness(colour: Colour) -> f64 {
        let [r, g, b] = colour.0.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
    }

    #[test]
    fn the_sequential_map_rises_evenly_in_lightness() {
        let steps: Vec<f64> = (0..=16).map(|i| lightness(ColourMap::Viridis.at(f64::from(i) / 16.0))).collect();
        let mean = (steps[16] - steps[0]) / 16.0;
        assert!(mean > 4.0, "the map spans {:.1} of lightness", steps[16] - steps[0]);
        for pair in steps.windows(2) {
            let step = pair[1] - pair[0];
            // Straight pieces between nine stops are only nearly uniform.
            assert!((0.6 * mean..1.4 * mean).contains(&step), "a step of {step:.2} where the mean is {mean:.2}");
        }
    }

    #[test]
    fn the_diverging_map_is_lightest_in_the_middle_and_equally_dark_at_its_ends() {
        let at = |t: f64| lightness(ColourMap::Diverging.at(t));
        for i in 0..10 {
            let t = f64::from(i) / 20.0;
            assert!(at(t) < at(t + 0.05) && at(1.0 - t) < at(0.95 - t), "{t}");
        }
        assert!((at(0.0) - at(1.0)).abs() < 10.0, "{} and {}", at(0.0), at(1.0));
    }

    #[test]
    fn values_outside_are_clamped_and_missing_ones_grey() {
        assert_eq!(ColourMap::Viridis.at(-3.0), VIRIDIS[0]);
        assert_eq!(ColourMap::Viridis.at(f64::INFINITY), VIRIDIS[8]);
        assert_eq!(ColourMap::Viridis.at(f64::NAN), Colour::GRID);
        assert_eq!(Colour([1, 16, 255]).to_string(), "#0110ff");
    }
}
